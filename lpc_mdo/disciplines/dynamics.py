"""Small motions of a rigid aircraft about steady flight, and the modes they consist of.

State (..., 8): velocities u, v, w m/s and turn rates p, q, r rad/s in body axes (x forward, y starboard, z down), bank and
pitch rad. The equations of motion are a residual of state and rate, so that loads may depend on accelerations (downwash
lag, apparent mass); their Jacobians by automatic differentiation give the linear system. Source: Etkin and Reid, Dynamics
of Flight, 3rd ed. (1996), chapters 4 and 6.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.constants import GRAVITY

LONGITUDINAL = (0, 2, 4, 7)  # u, w, q, pitch
LATERAL = (1, 3, 5, 6)  # v, p, r, bank

Loads = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
"""State and rate (..., 8) to force (..., 3) N without weight and moment (..., 3) N m about the centre of gravity."""


@dataclass(frozen=True)
class RigidBody:
    """mass (...,) kg; inertia (..., 3, 3) kg m^2 about the centre of gravity in body axes, off-diagonals negative products."""

    mass: Tensor
    inertia: Tensor


def steady_state(speed: Tensor, angle_of_attack: Tensor, path_angle: Tensor) -> Tensor:
    """State (..., 8) of straight flight with wings level, from (...,) m/s and rad."""
    speed, alpha, path = torch.broadcast_tensors(speed, angle_of_attack, path_angle)
    zero = torch.zeros_like(speed)
    return torch.stack(
        [speed * torch.cos(alpha), zero, speed * torch.sin(alpha), zero, zero, zero, zero, alpha + path], dim=-1
    )


def rigid_body_residual(body: RigidBody, loads: Loads, state: Tensor, rate: Tensor) -> Tensor:
    """Newton's and Euler's equations and the attitude's kinematics (..., 8): zero where `rate` belongs to `state`."""
    velocity, turn, bank, pitch = state[..., :3], state[..., 3:6], state[..., 6], state[..., 7]
    force, moment = loads(state, rate)
    weight = GRAVITY * torch.stack(
        [-torch.sin(pitch), torch.sin(bank) * torch.cos(pitch), torch.cos(bank) * torch.cos(pitch)], dim=-1
    )
    acceleration = rate[..., :3] + torch.linalg.cross(turn, velocity) - weight
    momentum = (body.inertia @ turn[..., None])[..., 0]
    change = (body.inertia @ rate[..., 3:6, None])[..., 0] + torch.linalg.cross(turn, momentum)
    p, q, r = turn.unbind(-1)
    around = q * torch.sin(bank) + r * torch.cos(bank)
    attitude = torch.stack(
        [
            rate[..., 6] - p - around * torch.tan(pitch),
            rate[..., 7] - q * torch.cos(bank) + r * torch.sin(bank),
        ],
        dim=-1,
    )
    return torch.cat([body.mass[..., None] * acceleration - force, change - moment, attitude], dim=-1)


@dataclass(frozen=True)
class LinearMotion:
    """d(state)/dt = matrix (..., 8, 8) x small changes of the state."""

    matrix: Tensor

    @property
    def longitudinal(self) -> Tensor:
        """(..., 4, 4) in u, w, q, pitch."""
        return self._block(LONGITUDINAL, LONGITUDINAL)

    @property
    def lateral(self) -> Tensor:
        """(..., 4, 4) in v, p, r, bank."""
        return self._block(LATERAL, LATERAL)

    @property
    def coupling(self) -> Tensor:
        """Both blocks (..., 2, 4, 4) that link the two; zero for a symmetric aircraft in straight flight."""
        return torch.stack([self._block(LONGITUDINAL, LATERAL), self._block(LATERAL, LONGITUDINAL)], dim=-3)

    def _block(self, rows: tuple[int, ...], columns: tuple[int, ...]) -> Tensor:
        return self.matrix[..., rows, :][..., columns]


def linearize(body: RigidBody, loads: Loads, state: Tensor) -> LinearMotion:
    """Small motions about the steady `state` (..., 8), differentiable with respect to whatever `loads` uses.

    matrix = -(dR/drate)^-1 dR/dstate at zero rate. Elements of the batch must not influence each other in `loads`.
    """
    # Without anything to differentiate with respect to later, the result carries no graph.
    is_differentiable = rigid_body_residual(body, loads, state, torch.zeros_like(state)).requires_grad
    with torch.enable_grad():
        at = state if state.requires_grad else state.detach().requires_grad_()
        rate = torch.zeros_like(at).requires_grad_()
        residual = rigid_body_residual(body, loads, at, rate)
        rows = [
            torch.autograd.grad(
                component.sum(),
                (at, rate),
                retain_graph=True,
                create_graph=is_differentiable,
                materialize_grads=True,
            )
            for component in residual.unbind(-1)
        ]
        by_state, by_rate = (torch.stack(column, dim=-2) for column in zip(*rows, strict=True))
    return LinearMotion(-torch.linalg.solve(by_rate, by_state))


@dataclass(frozen=True)
class Oscillation:
    """A pair of eigenvalues (..., 2) 1/s, complex conjugates or, past critical damping, both real."""

    eigenvalues: Tensor

    @property
    def is_oscillatory(self) -> Tensor:
        return self.eigenvalues[..., 0].imag.abs() > 0.0

    @property
    def natural_frequency(self) -> Tensor:
        """Undamped (...,) rad/s."""
        return torch.sqrt(self.eigenvalues.prod(-1).abs())

    @property
    def damping_ratio(self) -> Tensor:
        return -self.eigenvalues.sum(-1).real / (2.0 * self.natural_frequency)

    @property
    def period(self) -> Tensor:
        """(...,) s, infinite without oscillation."""
        return 2.0 * math.pi / self.eigenvalues[..., 0].imag.abs()

    @property
    def time_to_double(self) -> Tensor:
        """(...,) s, infinite if stable."""
        return _time_to_double(self.eigenvalues.real.amax(-1))


@dataclass(frozen=True)
class Subsidence:
    """One eigenvalue (...,) 1/s, complex only where roll and spiral have joined to an oscillation."""

    eigenvalue: Tensor

    @property
    def time_constant(self) -> Tensor:
        """(...,) s, negative if unstable."""
        return -1.0 / self.eigenvalue.real

    @property
    def time_to_double(self) -> Tensor:
        """(...,) s, infinite if stable."""
        return _time_to_double(self.eigenvalue.real)


def _time_to_double(growth: Tensor) -> Tensor:
    is_growing = growth > 0.0
    time = torch.where(is_growing, math.log(2.0) / torch.where(is_growing, growth, 1.0), math.inf)
    return torch.where(growth.isnan(), growth, time)


@dataclass(frozen=True)
class LongitudinalModes:
    short_period: Oscillation
    phugoid: Oscillation


@dataclass(frozen=True)
class LateralModes:
    dutch_roll: Oscillation
    roll: Subsidence
    spiral: Subsidence


def longitudinal_modes(matrix: Tensor) -> LongitudinalModes:
    """Modes of (..., 4, 4) in u, w, q, pitch: the faster pair is the short period, the slower the phugoid.

    Where one pair oscillates between two real eigenvalues (the aircraft is statically unstable, say) it is the phugoid.
    """
    values = _by(_eigenvalues(matrix), lambda v: v.abs())
    middle = values[..., 1:3]
    is_pair = (middle[..., 0].imag != 0.0) & (
        (middle[..., 0] - middle[..., 1].conj()).abs() <= 1e-9 * middle[..., 0].abs()
    )
    ends = torch.stack([values[..., 0], values[..., 3]], dim=-1)
    slow = torch.where(is_pair[..., None], middle, values[..., :2])
    fast = torch.where(is_pair[..., None], ends, values[..., 2:])
    return LongitudinalModes(Oscillation(fast), Oscillation(slow))


def lateral_modes(matrix: Tensor) -> LateralModes:
    """Modes of (..., 4, 4) in v, p, r, bank: the fastest oscillation is the Dutch roll, of the rest roll is the faster."""
    values = _by(_eigenvalues(matrix), lambda v: v.imag.abs())
    rest = _by(values[..., :2], lambda v: v.abs())
    return LateralModes(Oscillation(values[..., 2:]), Subsidence(rest[..., 1]), Subsidence(rest[..., 0]))


def _eigenvalues(matrix: Tensor) -> Tensor:
    """(..., 4); undefined where the matrix is, which LAPACK would refuse for the whole batch."""
    is_defined = matrix.isfinite().all(-1).all(-1)[..., None]
    stand_in = torch.diag(torch.arange(1.0, matrix.shape[-1] + 1.0, dtype=matrix.dtype, device=matrix.device))
    values = torch.linalg.eigvals(torch.where(is_defined[..., None], matrix, stand_in))
    return torch.where(is_defined, values, torch.full_like(values, complex(math.nan, math.nan)))


def _by(values: Tensor, key: Callable[[Tensor], Tensor]) -> Tensor:
    return torch.gather(values, -1, torch.argsort(key(values), dim=-1, stable=True))


def acceleration_sensitivity(motion: LinearMotion, speed: Tensor) -> Tensor:
    """Load factor over angle of attack (...,) 1/rad at `speed` (...,) m/s, by the usual -Z_w V/(m g)."""
    return -motion.matrix[..., 2, 2] * speed / GRAVITY
