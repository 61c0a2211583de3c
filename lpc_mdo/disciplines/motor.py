"""Operation of a permanent-magnet synchronous motor: currents, losses and torque limit from its equivalent circuit.

Steady state in the rotor's dq frame, amplitude-invariant, with w = pole pairs x speed:
    v_d = R i_d - w L_q i_q,  v_q = R i_q + w (L_d i_d + psi),  T = 1.5 p [psi i_q + (L_d - L_q) i_d i_q].
Maximum torque per ampere up to the voltage limit, then flux weakening along it. Source: Morimoto et al., IEEE Trans. Ind.
Appl. 26 (1990).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from lpc_mdo.numerics.implicit import RootNotFoundError
from lpc_mdo.numerics.smooth import smooth_maximum
from lpc_mdo.numerics.trinomial import trinomial_root

HANDOVER_WIDTH = 0.005  # of the squared voltage limit: flux weakening sets in over about this range, infinitely smooth
NO_WEAKENING = 1e-11  # below this share of the squared voltage limit nothing is weakened
STEP_TOLERANCE = 1e-6  # of the way: the step taken then leaves its cube
ROUNDINGS = 8.0  # units of the last place that a squared voltage may be off
ITERATIONS = 60  # three are usual

Polynomial = tuple[Tensor, ...]  # coefficients of V^2 along a path


@dataclass(frozen=True)
class MotorCircuit:
    """Equivalent circuit and loss constants, each (...,)."""

    pole_pairs: Tensor
    phase_resistance: Tensor  # ohm
    inductance_d: Tensor  # H
    inductance_q: Tensor  # H, at least inductance_d
    flux_linkage: Tensor  # Wb
    voltage_limit: Tensor  # V, phase amplitude
    current_limit: Tensor  # A, phase amplitude
    hysteresis: Tensor  # W s: loss per speed at no-load flux
    eddy: Tensor  # W s^2: loss per squared speed at no-load flux
    bearing_torque: Tensor  # N m
    windage: Tensor  # W s^3
    stray_share: Tensor  # of the output power

    def at(self, index: Tensor) -> "MotorCircuit":
        """The circuits at `index` of the last dimension."""
        return MotorCircuit(*(getattr(self, field.name)[..., index] for field in fields(self)))


@dataclass(frozen=True)
class MotorOperation:
    """One operating point, each (...,): amperes, volts, watts."""

    current_d: Tensor
    current_q: Tensor
    voltage: Tensor
    copper_loss: Tensor
    iron_loss: Tensor
    mechanical_loss: Tensor
    stray_loss: Tensor
    output_power: Tensor
    input_power: Tensor

    def at(self, index: Tensor) -> "MotorOperation":
        """The operating points at `index` of the last dimension."""
        return MotorOperation(*(getattr(self, field.name)[..., index] for field in fields(self)))

    @property
    def efficiency(self) -> Tensor:
        """Output over input (...,) of a driving motor."""
        return self.output_power / self.input_power

    @property
    def current(self) -> Tensor:
        """Phase amplitude (...,) A."""
        return torch.sqrt(self.current_d**2 + self.current_q**2)


def voltage_squared(c: MotorCircuit, current_d: Tensor, current_q: Tensor, speed: Tensor) -> Tensor:
    """Squared phase voltage amplitude (...,) V^2."""
    w = c.pole_pairs * speed
    v_d = c.phase_resistance * current_d - w * c.inductance_q * current_q
    v_q = c.phase_resistance * current_q + w * (c.inductance_d * current_d + c.flux_linkage)
    return v_d**2 + v_q**2


def electromagnetic_torque(c: MotorCircuit, current_d: Tensor, current_q: Tensor) -> Tensor:
    """Air-gap torque (...,) N m at currents (...,) A."""
    saliency = c.inductance_d - c.inductance_q
    return 1.5 * c.pole_pairs * (c.flux_linkage + saliency * current_d) * current_q


def _least_current_d(c: MotorCircuit, current_q: Tensor) -> Tensor:
    """i_d of maximum torque per ampere at i_q, free of cancellation as the saliency vanishes."""
    saliency = c.inductance_q - c.inductance_d
    root = torch.sqrt(c.flux_linkage**2 + 4.0 * saliency**2 * current_q**2)
    return -2.0 * saliency * current_q**2 / (c.flux_linkage + root)


def maximum_torque_per_ampere(c: MotorCircuit, torque: Tensor) -> tuple[Tensor, Tensor]:
    """Currents i_d, i_q (...,) A of least amplitude for `torque` (...,) N m of either sign."""
    without_reluctance = torque / (1.5 * c.pole_pairs * c.flux_linkage)
    # With i_q = h x that, the torque equation on the curve of least current becomes h + (dL/psi x that)^2 h^4 = 1.
    share = trinomial_root(((c.inductance_q - c.inductance_d) / c.flux_linkage * without_reluctance) ** 2, 4)
    current_q = without_reluctance * share
    return _least_current_d(c, current_q), current_q


def _most_torque_per_volt(c: MotorCircuit, speed: Tensor) -> tuple[Tensor, Tensor]:
    """Currents i_d, i_q (...,) A of the largest torque at the voltage limit when resistance is neglected.

    On the circle of flux V/w, (L_q psi - (L_q - L_d) flux_d) flux_q is largest; more current only costs torque there.
    """
    flux = c.voltage_limit / (c.pole_pairs * speed)
    saliency, reference = c.inductance_q - c.inductance_d, c.inductance_q * c.flux_linkage
    sine = 2.0 * saliency * flux / (reference + torch.sqrt(reference**2 + 8.0 * (saliency * flux) ** 2))
    return -(c.flux_linkage + flux * sine) / c.inductance_d, flux * torch.sqrt(1.0 - sine**2) / c.inductance_q


def _weaken(
    squared: Callable[[Tensor, Polynomial], Tensor],
    slopes: Callable[[Tensor, Polynomial], tuple[Tensor, Tensor]],
    polynomial: Polynomial,
    limit_squared: Tensor,
    start: Tensor,
    end: Tensor,
) -> Tensor:
    """The point between `start` and `end` at which the squared voltage has fallen to its limit, smoothly.

    squared(point, polynomial) is V^2, `slopes` its first two derivatives along the way. Well below the limit the answer
    is `start`; the demanded fall of V^2 rises as a softplus. Where even `end` exceeds the limit the lowest voltage on the
    way is approached: the torque limit, not this function, tells that the point is out of reach. NaN stays in its element.
    """
    at_start, at_end = squared(start, polynomial), squared(end, polynomial)
    width = HANDOVER_WIDTH * limit_squared
    fall = width * torch.nn.functional.softplus((at_start - limit_squared) / width, threshold=50.0)
    target = smooth_maximum(at_start - fall, at_end, 1e-3 * limit_squared)
    is_weakening = (fall > NO_WEAKENING * limit_squared) & (target < at_start) & (target > at_end)
    with torch.no_grad():
        point, slope = _crossing(squared, slopes, polynomial, limit_squared, start, end, target, is_weakening)
    # One Newton step in the graph has the derivatives of the implicit-function theorem.
    is_moved = is_weakening | target.isnan()
    return torch.where(is_moved, point - (squared(point, polynomial) - target) / slope, start)


def _crossing(
    squared: Callable[[Tensor, Polynomial], Tensor],
    slopes: Callable[[Tensor, Polynomial], tuple[Tensor, Tensor]],
    polynomial: Polynomial,
    limit_squared: Tensor,
    start: Tensor,
    end: Tensor,
    target: Tensor,
    is_searched: Tensor,
) -> tuple[Tensor, Tensor]:
    """Where V^2 falls through `target`, and its slope there; `start` and slope one where nothing is searched.

    Each step solves the parabola through value and two derivatives, which V^2 nearly is, so that a crossing close to the
    lowest voltage costs no more than another; steps that leave the bracket halve it instead.
    """
    point, above, below = start.expand(target.shape), start, end
    rounding = ROUNDINGS * torch.finfo(target.dtype).eps * torch.maximum(limit_squared, target)
    for _ in range(ITERATIONS):
        excess = torch.where(is_searched, squared(point, polynomial) - target, 0.0)
        first, second = slopes(point, polynomial)
        root = torch.sqrt((first**2 - 2.0 * excess * second).clamp(min=0.0))
        step = torch.where(excess == 0.0, 0.0, -2.0 * excess / (first + torch.copysign(root, first)))
        is_open = (step.abs() > STEP_TOLERANCE * (end - start).abs()) & (excess.abs() > rounding)
        if not bool(is_open.any()):
            return point + step, torch.where(is_searched, first + second * step, 1.0)
        above, below = torch.where(excess > 0.0, point, above), torch.where(excess > 0.0, below, point)
        new = point + step
        is_inside = (new - above) * (new - below) <= 0.0
        point = torch.where(is_open, torch.where(is_inside, new, 0.5 * (above + below)), point)
    worst = float((excess / limit_squared)[is_open].abs().max())
    raise RootNotFoundError(f"{int(is_open.sum())} motors found no current; squared voltage off by {worst:.3g}")


def _along_current_d(current_d: Tensor, polynomial: Polynomial) -> Tensor:
    """V^2 at constant torque, a convex function of i_d."""
    constant, linear, quadratic, quadrature, flux_linkage, saliency = polynomial
    return (
        constant
        + current_d * (linear + quadratic * current_d)
        + quadrature / (flux_linkage - saliency * current_d) ** 2
    )


def _slopes_along_current_d(current_d: Tensor, polynomial: Polynomial) -> tuple[Tensor, Tensor]:
    _, linear, quadratic, quadrature, flux_linkage, saliency = polynomial
    flux = flux_linkage - saliency * current_d
    ratio = saliency / flux
    bend = 2.0 * quadrature * ratio / flux**2
    return linear + 2.0 * quadratic * current_d + bend, 2.0 * quadratic + 3.0 * bend * ratio


def _along_angle(angle: Tensor, polynomial: Polynomial) -> Tensor:
    """V^2 at constant current, i_d = -I sin(angle) and i_q = I cos(angle)."""
    constant, sine, sine_squared, cosine, product = polynomial
    s, c = torch.sin(angle), torch.cos(angle)
    return constant + s * (sine + sine_squared * s) + c * (cosine + product * s)


def _slopes_along_angle(angle: Tensor, polynomial: Polynomial) -> tuple[Tensor, Tensor]:
    _, sine, sine_squared, cosine, product = polynomial
    s, c = torch.sin(angle), torch.cos(angle)
    double = c**2 - s**2
    first = c * (sine + 2.0 * sine_squared * s) - cosine * s + product * double
    return first, 2.0 * sine_squared * double - sine * s - c * (cosine + 4.0 * product * s)


def operate_motor(circuit: MotorCircuit, torque: Tensor, speed: Tensor) -> MotorOperation:
    """Currents and losses at shaft `torque` (...,) N m and `speed` (...,) rad/s > 0.

    Torque beyond the limits stays defined: currents grow on. Iron loss follows the flux of the operating point.
    """
    c = circuit
    least_d, _ = maximum_torque_per_ampere(c, torque)
    saliency = c.inductance_q - c.inductance_d
    w, k = c.pole_pairs * speed, torque / (1.5 * c.pole_pairs)
    # With i_q = k/(psi - dL i_d) the part of V^2 that is linear in i_q is constant.
    polynomial = (
        2.0 * c.phase_resistance * w * k + (w * c.flux_linkage) ** 2,
        2.0 * w**2 * c.inductance_d * c.flux_linkage,
        c.phase_resistance**2 + (w * c.inductance_d) ** 2,
        (c.phase_resistance**2 + (w * c.inductance_q) ** 2) * k**2,
        c.flux_linkage,
        saliency,
    )
    end = torch.minimum(_most_torque_per_volt(c, speed)[0], 2.0 * least_d)
    current_d = _weaken(_along_current_d, _slopes_along_current_d, polynomial, c.voltage_limit**2, least_d, end)
    current_q = k / (c.flux_linkage - saliency * current_d)

    copper = 1.5 * c.phase_resistance * (current_d**2 + current_q**2)
    linkage_squared = (c.flux_linkage + c.inductance_d * current_d) ** 2 + (c.inductance_q * current_q) ** 2
    iron = (c.hysteresis * speed + c.eddy * speed**2) * linkage_squared / c.flux_linkage**2
    mechanical = c.bearing_torque * speed + c.windage * speed**3
    output = torque * speed
    stray = c.stray_share * torch.sqrt(output**2 + 1.0)
    return MotorOperation(
        current_d=current_d,
        current_q=current_q,
        voltage=torch.sqrt(voltage_squared(c, current_d, current_q, speed)),
        copper_loss=copper,
        iron_loss=iron,
        mechanical_loss=mechanical,
        stray_loss=stray,
        output_power=output,
        input_power=output + copper + iron + mechanical + stray,
    )


def maximum_torque(circuit: MotorCircuit, speed: Tensor) -> Tensor:
    """Largest torque (...,) N m within the current and voltage limits at `speed` (...,) rad/s."""
    c = circuit
    saliency = c.inductance_q - c.inductance_d
    # At high speed less than the largest current gives the most torque; its slope vanishes at the change-over.
    current = torch.minimum(c.current_limit, torch.hypot(*_most_torque_per_volt(c, speed)))
    # On the current circle i_d = -I sin(angle), i_q = I cos(angle).
    best_d = (
        -2.0 * saliency * current**2 / (c.flux_linkage + torch.sqrt(c.flux_linkage**2 + 8.0 * saliency**2 * current**2))
    )
    start = torch.asin(-best_d / current)
    end = torch.full_like(start, 0.5 * math.pi - 1e-6)

    w, cross = c.pole_pairs * speed, 2.0 * c.phase_resistance * c.pole_pairs * speed * current
    polynomial = (
        (c.phase_resistance * current) ** 2 + w**2 * ((c.inductance_q * current) ** 2 + c.flux_linkage**2),
        -2.0 * w**2 * c.flux_linkage * c.inductance_d * current,
        (w * current) ** 2 * (c.inductance_d**2 - c.inductance_q**2),
        cross * c.flux_linkage,
        cross * current * saliency,
    )
    angle = _weaken(_along_angle, _slopes_along_angle, polynomial, c.voltage_limit**2, start, end)
    return electromagnetic_torque(c, -current * torch.sin(angle), current * torch.cos(angle))


@dataclass(frozen=True)
class EfficiencyMap:
    """Efficiency over torque and speed, NaN where the motor cannot go."""

    torque: Tensor  # (torque,) N m
    speed: Tensor  # (speed,) rad/s
    efficiency: Tensor  # (..., torque, speed)
    limit: Tensor  # (..., speed) N m, the largest torque


def efficiency_map(circuit: MotorCircuit, torque: Tensor, speed: Tensor) -> EfficiencyMap:
    """Efficiency of circuits (...,) on the grid of torque (torque,) N m > 0 and speed (speed,) rad/s > 0."""
    wide = MotorCircuit(*(getattr(circuit, field.name)[..., None, None] for field in fields(circuit)))
    limit = maximum_torque(wide, speed)  # (..., 1, speed)
    efficiency = operate_motor(wide, torque[:, None], speed).efficiency
    return EfficiencyMap(torque, speed, torch.where(torque[:, None] <= limit, efficiency, torch.nan), limit[..., 0, :])
