"""Flow and loads of blade sections: blade-element momentum theory, annulus by annulus.

Source: Ning, Wind Energy 17 (2014) and Struct. Multidisc. Optim. 64 (2021); Ruh and Hwang (2021); tip loss: Prandtl in
Glauert (1935). Written in the angle between blade velocity and geometric inflow, the residual has one bracket that
always holds a root:

With axial and tangential velocity Vx = V sin(phi0), Vy = V cos(phi0), inflow angle phi and local solidity s = Bc/(2 pi r),
    R(phi)/V = 4 F |sin phi| sin(phi - phi0) - s [cl cos(phi - phi0) - cd sin(phi - phi0)]
is Ruh and Hwang's residual with |sin phi|, which momentum theory needs where the flow passes the disk backwards. At
phi0 -+ pi/2 it equals -+(4 F |sin phi| + s cd), whence a sign change for every section with drag, and between the two the
resultant W = V cos(phi - phi0)/(1 + s cd/(4 F |sin phi|)) is positive. Hover (phi0 = 0) is nothing special, nor is reversed
flow (|phi0| > pi/2).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.duplicates import distinct_rows
from lpc_mdo.numerics.implicit import find_root, with_implicit_gradient

Polar = Callable[[Tensor, Tensor, Tensor], tuple[Tensor, Tensor]]
"""Angle of attack (rad), Reynolds number, Mach number to lift and drag coefficient, element by element."""

TYPICAL_LIFT_SLOPE = 5.7  # 1/rad, and
TYPICAL_ZERO_LIFT_ANGLE = -0.06  # rad, and
TYPICAL_MAXIMUM_LIFT = 1.5  # only for the first guess of the inflow angle


@dataclass(frozen=True)
class Blades:
    """Blades at their sections; every tensor broadcasts to (..., station)."""

    count: Tensor
    tip_radius: Tensor  # m
    hub_radius: Tensor  # m
    radius: Tensor  # m
    chord: Tensor  # m
    twist: Tensor  # rad, from the plane of rotation


@dataclass(frozen=True)
class SectionFlow:
    """Each (..., station); loads of all blades together."""

    thrust_per_length: Tensor  # N/m
    drag_per_length: Tensor  # N/m against the blades' motion
    inflow_angle: Tensor  # rad
    angle_of_attack: Tensor  # rad
    lift_coefficient: Tensor
    drag_coefficient: Tensor
    reynolds: Tensor  # of the geometric velocity
    mach: Tensor  # likewise
    axial_induction: Tensor  # m/s, added by the rotor to the axial velocity
    swirl: Tensor  # m/s, taken by the rotor from the tangential velocity
    residual: Tensor  # of the inflow equation over the velocity


def prandtl_loss(exponent_at_unit_sine: Tensor, sine: Tensor) -> Tensor:
    """(2/pi) acos(exp(-f)), f = exponent/|sin phi|, written so that its slope stays finite as f goes to zero."""
    exponent = exponent_at_unit_sine / sine.abs().clamp(min=1e-6)
    return (2.0 / math.pi) * torch.atan2(torch.sqrt(-torch.expm1(-2.0 * exponent)), torch.exp(-exponent))


def _momentum_factor(phi: Tensor, *losses: Tensor) -> Tensor:
    """4 F |sin phi| for loss exponents at |sin phi| = 1 of tip and, if given, hub."""
    sine = torch.sin(phi)
    factor = 4.0 * sine.abs()
    for exponent in losses:
        factor = factor * prandtl_loss(exponent, sine)
    return factor


def section_flow(
    blades: Blades,
    axial: Tensor,
    tangential: Tensor,
    density: Tensor,
    speed_of_sound: Tensor,
    dynamic_viscosity: Tensor,
    polar: Polar,
    *,
    has_hub_loss: bool = False,
) -> SectionFlow:
    """Flow where blade force and annulus momentum balance, at axial and tangential velocity (..., station) m/s.

    The polar is read at the Reynolds and Mach number of the geometric velocity (without induction), which differs from
    the resultant by a few per cent and keeps the equation scalar. Air: kg/m^3, m/s, Pa s, broadcasting.
    """
    r = blades.radius
    speed = torch.sqrt(axial**2 + tangential**2 + 1e-12)  # m/s; the floor gives a rotor at rest in still air a gradient
    geometric_angle = torch.atan2(axial, tangential + 1e-12)
    solidity = blades.count * blades.chord / (2.0 * math.pi * r)
    reynolds = density * speed * blades.chord / dynamic_viscosity
    mach = speed / speed_of_sound
    tip = 0.5 * blades.count * (blades.tip_radius - r) / r
    hub = (0.5 * blades.count * (r - blades.hub_radius) / blades.hub_radius,) if has_hub_loss else ()
    args = torch.broadcast_tensors(blades.twist, solidity, geometric_angle, reynolds, mach, tip, *hub)
    twist, solidity, geometric_angle, reynolds, mach, tip, *hub = args

    def residual(
        phi: Tensor,
        twist: Tensor,
        solidity: Tensor,
        geometric_angle: Tensor,
        reynolds: Tensor,
        mach: Tensor,
        tip: Tensor,
        *hub: Tensor,
    ) -> Tensor:
        cl, cd = polar(twist - phi, reynolds, mach)
        return _residual(phi - geometric_angle, _momentum_factor(phi, tip, *hub), solidity, cl, cd)

    phi = with_implicit_gradient(residual, _inflow_angle(residual, args), args)
    alpha, turn = twist - phi, phi - geometric_angle
    cl, cd = polar(alpha, reynolds, mach)
    momentum = _momentum_factor(phi, tip, *hub)
    resultant = speed * torch.cos(turn) * momentum / (momentum + solidity * cd)
    pressure = 0.5 * density * resultant**2 * blades.chord * blades.count
    sin, cos = torch.sin(phi), torch.cos(phi)
    return SectionFlow(
        thrust_per_length=pressure * (cl * cos - cd * sin),
        drag_per_length=pressure * (cl * sin + cd * cos),
        inflow_angle=phi,
        angle_of_attack=alpha,
        lift_coefficient=cl,
        drag_coefficient=cd,
        reynolds=reynolds,
        mach=mach,
        axial_induction=resultant * sin - axial,
        swirl=tangential - resultant * cos,
        residual=_residual(turn, momentum, solidity, cl, cd).detach(),
    )


@torch.no_grad()
def _inflow_angle(residual: Callable[..., Tensor], args: tuple[Tensor, ...]) -> Tensor:
    """Root (..., station) of the residual for `args`, each (..., station); equal blades are solved once."""
    rows = [arg.reshape(-1, arg.shape[-1]) for arg in args]
    distinct = distinct_rows(*rows)
    twist, solidity, geometric_angle, reynolds, mach, tip, *hub = (distinct.of(row) for row in rows)
    guess, slope = _first_guess(twist, solidity, geometric_angle, tip)
    root = find_root(
        residual,
        geometric_angle - 0.5 * math.pi,
        geometric_angle + 0.5 * math.pi,
        (twist, solidity, geometric_angle, reynolds, mach, tip, *hub),
        initial=guess,
        initial_slope=slope,
        tolerance=1e-10,  # of the last step, which is taken; at 1e-9 one in a million leaves 2e-10 of the velocity
    )
    return distinct.spread(root).reshape(args[0].shape)


def _residual(turn: Tensor, momentum: Tensor, solidity: Tensor, cl: Tensor, cd: Tensor) -> Tensor:
    """R/V for the angle `turn` by which induction turns the flow and momentum = 4 F |sin phi|."""
    return (momentum + solidity * cd) * torch.sin(turn) - solidity * cl * torch.cos(turn)


def _first_guess(twist: Tensor, solidity: Tensor, geometric_angle: Tensor, tip: Tensor) -> tuple[Tensor, Tensor]:
    """Root of the small-angle residual with linear lift up to stall, and its slope.

    4 F phi (phi - phi0) = s min(a (theta - alpha0 - phi), cl_max), twice: without tip loss, then with the loss F at the
    angle found.
    """
    pitch = twist - TYPICAL_ZERO_LIFT_ANGLE
    loss = prandtl_loss(tip, torch.minimum(*_small_angle_roots(solidity, pitch, geometric_angle)))
    attached, stalled = _small_angle_roots(solidity / loss, pitch, geometric_angle)
    phi = torch.minimum(attached, stalled)
    lift_slope = TYPICAL_LIFT_SLOPE * (attached <= stalled)
    return phi, (4.0 * loss * (2.0 * phi - geometric_angle)).abs() + solidity * lift_slope


def _small_angle_roots(solidity: Tensor, pitch: Tensor, geometric_angle: Tensor) -> tuple[Tensor, Tensor]:
    """With linear lift, and with the maximum lift."""
    loading = solidity * TYPICAL_LIFT_SLOPE
    b = loading - 4.0 * geometric_angle
    attached = (torch.sqrt((b**2 + 16.0 * loading * pitch).clamp(min=0.0)) - b) / 8.0
    stalled = 0.5 * (geometric_angle + torch.sqrt(geometric_angle**2 + TYPICAL_MAXIMUM_LIFT * solidity))
    return attached, stalled
