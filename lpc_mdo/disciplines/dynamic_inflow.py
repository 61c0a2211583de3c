"""Dynamic inflow of Pitt and Peters: three states of induced velocity for rotors in axial, inclined and edgewise flow.

The induced velocity at a blade element is w0 + g . e r/R, with e the blade's direction in the disk and g a vector in the
disk; states (w0, g) m/s by two fixed axes of the disk. With F = T/(rho A), G = mean(r dT e)/(rho A R) and the skew t of the
wake (a vector downwind, |t| = tan(chi/2)) they obey
    R M d(w0, g)/dt = (F, G) - V L^-1 (w0, g),   M = diag(128/75 pi, 16/45 pi, 16/45 pi),
    L = [[1/2, -k t'], [k t, 2 (1 + t't) I - 4 t t']],   k = 15 pi/64,
and V the flow through the disk, for the mean and for the gradients. Written with t no direction is singled out in axial flow.
Neither tip loss nor swirl. Source: Pitt and Peters, Vertica 5 (1981); Peters and HaQuang, J. Am. Helicopter Soc. 33 (1988).
"""

import math
from collections.abc import Callable

import numpy as np  # its broadcast_shapes: PyTorch's would load a symbolic algebra package
import torch
from torch import Tensor

from lpc_mdo.disciplines.blade_element import Rotor, blades_of
from lpc_mdo.disciplines.blade_sections import Polar
from lpc_mdo.disciplines.inclined_rotor import (
    AZIMUTHS,
    HubLoads,
    InclinedFlow,
    around,
    hub_loads,
    plane_basis,
    turn_of,
)
from lpc_mdo.numerics.duplicates import distinct_rows
from lpc_mdo.numerics.implicit import RootNotFoundError

APPARENT_MASS = (128.0 / (75.0 * math.pi), 16.0 / (45.0 * math.pi), 16.0 / (45.0 * math.pi))
COUPLING = 15.0 * math.pi / 64.0
TOLERANCE = 1e-9  # of the last Newton step over the states


def dynamic_inflow_loads(
    rotor: Rotor, flow: InclinedFlow, polar: Polar, states: Tensor, *, azimuths: int = AZIMUTHS
) -> HubLoads:
    """Hub loads at given inflow states (..., 3) m/s; leading dimensions broadcast."""
    blades, width = blades_of(rotor)
    turn = turn_of(blades.radius, flow, azimuths)
    first, second = plane_basis(flow.axis)
    gradient = states[..., 1:2] * first + states[..., 2:3] * second
    slope = (turn.outward * gradient[..., None, :]).sum(-1)[..., None]
    share = (blades.radius / blades.tip_radius)[..., None, :]
    axial = turn.axial + states[..., 0, None, None] + slope * share
    ring = around(blades)
    squared = axial**2 + turn.tangential**2 + 1e-12
    angle = torch.atan2(axial, turn.tangential + 1e-12)
    speed = torch.sqrt(squared)
    density, sound, viscosity = (
        air[..., None, None] for air in (flow.density, flow.speed_of_sound, flow.dynamic_viscosity)
    )
    alpha = ring.twist - angle
    alpha, reynolds, mach = torch.broadcast_tensors(alpha, density * speed * ring.chord / viscosity, speed / sound)
    cl, cd = polar(alpha, reynolds, mach)
    pressure = 0.5 * density * squared * ring.chord * ring.count
    sin, cos = torch.sin(angle), torch.cos(angle)
    return hub_loads(
        flow, turn, blades.radius, width, pressure * (cl * cos - cd * sin), pressure * (cl * sin + cd * cos), alpha
    )


def forcing(rotor: Rotor, flow: InclinedFlow, loads: HubLoads) -> Tensor:
    """(F, G) m^2/s^2 (..., 3) from hub loads: thrust and the gradient of thrust, over density and disk area."""
    first, second = plane_basis(flow.axis)
    # r dT e is the moment of thrust turned back by a right angle: e x n dT = m, hence n x m = e dT - n (...).
    gradient = torch.linalg.cross(flow.axis.expand_as(loads.moment), loads.moment)
    per_area = 1.0 / (flow.density * math.pi * rotor.radius**2)
    parts = (loads.thrust, (gradient * first).sum(-1) / rotor.radius, (gradient * second).sum(-1) / rotor.radius)
    return torch.stack([part * per_area for part in torch.broadcast_tensors(*parts)], dim=-1)


def inflow_matrices(flow: InclinedFlow, mean: Tensor) -> tuple[Tensor, Tensor]:
    """L (..., 3, 3) and the diagonal of V (..., 3) m/s at mean induced velocity `mean` (...,) m/s."""
    first, second = plane_basis(flow.axis)
    in_plane = torch.stack([(flow.velocity * first).sum(-1), (flow.velocity * second).sum(-1)], dim=-1)
    through = flow.axial_velocity + mean
    squared = (in_plane**2).sum(-1)
    total = torch.sqrt(squared + through**2 + 1e-12)
    skew = in_plane / (through.abs() + total)[..., None]
    eye = torch.eye(2, dtype=mean.dtype, device=mean.device)
    steepness = 2.0 * (1.0 + (skew**2).sum(-1))[..., None, None]
    gradient = steepness * eye - 4.0 * skew[..., :, None] * skew[..., None, :]
    half = torch.full_like(total, 0.5)[..., None, None]
    top = torch.cat([half, -COUPLING * skew[..., None, :]], dim=-1)
    bottom = torch.cat([COUPLING * skew[..., :, None], gradient], dim=-1)
    mass_flow = (squared + through * (through + mean)) / total
    return torch.cat([top, bottom], dim=-2), torch.stack([total, mass_flow, mass_flow], dim=-1)


def dynamic_inflow_rate(
    rotor: Rotor, flow: InclinedFlow, polar: Polar, states: Tensor, *, azimuths: int = AZIMUTHS
) -> Tensor:
    """Change of the states with time, d(states)/dt (..., 3) m/s^2, at `states` (..., 3) m/s."""
    loads = dynamic_inflow_loads(rotor, flow, polar, states, azimuths=azimuths)
    matrix, through = inflow_matrices(flow, states[..., 0])
    balance = forcing(rotor, flow, loads) - through * torch.linalg.solve(matrix, states)
    mass = torch.tensor(APPARENT_MASS, dtype=states.dtype, device=states.device)
    found: Tensor = balance / (mass * rotor.radius[..., None])
    return found


def steady_inflow(
    rotor: Rotor, flow: InclinedFlow, polar: Polar, *, azimuths: int = AZIMUTHS, iterations: int = 40
) -> Tensor:
    """States (..., 3) m/s at which the rate vanishes, by Broyden's method and a last step of Newton's; once differentiable.

    Elements that are undefined stay so. Raises RootNotFoundError if one of the others has not converged.
    """

    batch = np.broadcast_shapes(rotor.radius.shape, flow.rotation_speed.shape, flow.velocity.shape[:-1])
    rotor = Rotor(**{name: _flat(name, part, batch) for name, part in vars(rotor).items()})
    flow = InclinedFlow(**{name: _flat(name, part, batch) for name, part in vars(flow).items()})
    distinct = distinct_rows(*(_as_rows(part) for whole in (rotor, flow) for part in vars(whole).values()))
    own, met = Rotor(**_mapped(distinct.of, rotor)), InclinedFlow(**_mapped(distinct.of, flow))
    with torch.no_grad():
        tip_speed = met.rotation_speed * own.radius
        start = torch.stack([0.05 * tip_speed, torch.zeros_like(tip_speed), torch.zeros_like(tip_speed)], dim=-1)
    states, jacobian, is_done = _solve(lambda found: _balance(own, met, polar, found, azimuths), start, iterations)
    if not bool(is_done.all()):
        raise RootNotFoundError(f"{int((~is_done).sum())} of {is_done.numel()} steady inflows did not converge")
    states, jacobian = distinct.spread(states), distinct.spread(jacobian)
    found: Tensor = states - torch.linalg.solve(jacobian, _balance(rotor, flow, polar, states, azimuths))
    return found.reshape(*batch, 3)


def _balance(rotor: Rotor, flow: InclinedFlow, polar: Polar, states: Tensor, azimuths: int) -> Tensor:
    """States less those that the loads at them induce (..., 3) m/s."""
    loads = dynamic_inflow_loads(rotor, flow, polar, states, azimuths=azimuths)
    matrix, through = inflow_matrices(flow, states[..., 0])
    return states - (matrix @ (forcing(rotor, flow, loads) / through)[..., None])[..., 0]


def _flat(name: str, part: Tensor, batch: tuple[int, ...]) -> Tensor:
    """A part of a rotor or its flow with one leading dimension in place of those of `batch`."""
    own = part.shape[-1:] if name in ("chord", "twist", "velocity", "axis") else ()
    return part.expand((*batch, *own)).reshape(-1, *own)


def _mapped(change: Callable[[Tensor], Tensor], whole: Rotor | InclinedFlow) -> dict[str, Tensor]:
    return {name: change(part) for name, part in vars(whole).items()}


def _as_rows(part: Tensor) -> Tensor:
    return part if part.dim() > 1 else part[:, None]


def _solve(balance: Callable[[Tensor], Tensor], states: Tensor, iterations: int) -> tuple[Tensor, Tensor, Tensor]:
    """States (..., 3) where balance vanishes, detached, its Jacobian there and where it was reached.

    Broyden's method, begun and, wherever a step does not halve the residual, begun again with the exact Jacobian.
    """
    tolerance = max(TOLERANCE, 64.0 * torch.finfo(states.dtype).eps)
    residual, jacobian = _value_and_jacobian(balance, states)
    inverse = torch.linalg.inv(jacobian)
    is_done = states.isnan().any(-1)
    for _ in range(iterations):
        step = -(inverse @ residual[..., None])[..., 0]
        states = states + step
        is_done = (step.abs().amax(-1) <= tolerance * (1.0 + states.abs().amax(-1))) | step.isnan().any(-1)
        if bool(is_done.all()):
            break
        with torch.no_grad():
            after = balance(states)
        size, before = (torch.linalg.vector_norm(part, dim=-1) for part in (after, residual))
        if bool(((size > 0.5 * before) & ~is_done).any()):
            residual, jacobian = _value_and_jacobian(balance, states)
            inverse = torch.linalg.inv(jacobian)
            continue
        moved = (inverse @ (after - residual)[..., None])[..., 0]
        scale = (step * moved).sum(-1)
        scale = torch.where(scale == 0.0, 1.0, scale)[..., None, None]
        inverse = inverse + (step - moved)[..., :, None] * (step[..., None, :] @ inverse) / scale
        residual = after
    return states, _value_and_jacobian(balance, states)[1], is_done


def _value_and_jacobian(function: Callable[[Tensor], Tensor], states: Tensor) -> tuple[Tensor, Tensor]:
    """Value (..., 3) and Jacobian (..., 3, 3), both detached."""
    with torch.enable_grad():
        at = states.detach().requires_grad_()
        value = function(at)
        rows = [torch.autograd.grad(part.sum(), at, retain_graph=True)[0] for part in value.unbind(-1)]
    return value.detach(), torch.stack(rows, dim=-2)


def dynamic_inflow_rotor(rotor: Rotor, flow: InclinedFlow, polar: Polar, *, azimuths: int = AZIMUTHS) -> HubLoads:
    """Hub loads in steady flow with the inflow of Pitt and Peters; takes and gives what `inclined_rotor` does."""
    states = steady_inflow(rotor, flow, polar, azimuths=azimuths)
    return dynamic_inflow_loads(rotor, flow, polar, states, azimuths=azimuths)
