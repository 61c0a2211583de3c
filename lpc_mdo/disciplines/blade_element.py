"""Blade-element momentum theory for rotors and propellers in axial flow.

Source: Ning, Wind Energy 17 (2014) and Struct. Multidisc. Optim. 64 (2021); Ruh and Hwang (2021); tip loss: Prandtl in
Glauert (1935). Written in the angle between blade velocity and geometric inflow, the residual has one bracket that
always holds a root:

With axial and tangential velocity Vx = V sin(phi0), Vy = V cos(phi0), inflow angle phi and local solidity s = Bc/(2 pi r),
    R(phi)/V = 4 F |sin phi| sin(phi - phi0) - s [cl cos(phi - phi0) - cd sin(phi - phi0)]
is Ruh and Hwang's residual with |sin phi|, which momentum theory needs where the flow passes the disk backwards. At
phi0 -+ pi/2 it equals -+(4 F |sin phi| + s cd), whence a sign change for every section with drag, and between the two the
resultant W = V cos(phi - phi0)/(1 + s cd/(4 F |sin phi|)) is positive. Hover (phi0 = 0) is nothing special.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.implicit import implicit_root

Polar = Callable[[Tensor, Tensor, Tensor], tuple[Tensor, Tensor]]
"""Angle of attack (rad), Reynolds number, Mach number to lift and drag coefficient, element by element."""

TYPICAL_LIFT_SLOPE = 5.7  # 1/rad, and
TYPICAL_ZERO_LIFT_ANGLE = -0.06  # rad: only for the first guess of the inflow angle


@dataclass(frozen=True)
class Rotor:
    """Blade geometry; leading dimensions batch, stations are the mid-points of equal intervals from hub to tip."""

    radius: Tensor  # (...,) m
    hub_radius: Tensor  # (...,) m
    chord: Tensor  # (..., station) m
    twist: Tensor  # (..., station) rad, from the plane of rotation
    blades: Tensor  # (...,)


@dataclass(frozen=True)
class Inflow:
    """Operating condition, each (...,)."""

    axial_velocity: Tensor  # m/s, positive from ahead of the disk
    rotation_speed: Tensor  # rad/s, positive
    density: Tensor  # kg/m^3
    speed_of_sound: Tensor  # m/s
    dynamic_viscosity: Tensor  # Pa s


@dataclass(frozen=True)
class RotorLoads:
    """Loads of all blades together and the flow at the stations."""

    rotor: Rotor
    inflow: Inflow
    station_radius: Tensor  # (..., station) m
    station_width: Tensor  # (..., 1) m
    thrust_per_length: Tensor  # (..., station) N/m
    torque_per_length: Tensor  # (..., station) N
    inflow_angle: Tensor  # (..., station) rad
    angle_of_attack: Tensor  # (..., station) rad
    lift_coefficient: Tensor  # (..., station)
    drag_coefficient: Tensor  # (..., station)
    reynolds: Tensor  # (..., station), of the geometric velocity
    mach: Tensor  # (..., station), likewise
    residual: Tensor  # (..., station), of the inflow equation over the velocity

    @property
    def thrust(self) -> Tensor:
        """(...,) N."""
        return (self.thrust_per_length * self.station_width).sum(-1)

    @property
    def torque(self) -> Tensor:
        """(...,) N m."""
        return (self.torque_per_length * self.station_width).sum(-1)

    @property
    def power(self) -> Tensor:
        """Shaft power (...,) W."""
        return self.torque * self.inflow.rotation_speed

    @property
    def disk_area(self) -> Tensor:
        return math.pi * self.rotor.radius**2

    @property
    def blade_area(self) -> Tensor:
        """(...,) m^2, all blades."""
        return self.rotor.blades * (self.rotor.chord * self.station_width).sum(-1)

    @property
    def figure_of_merit(self) -> Tensor:
        """Ideal over actual power of a hovering rotor, T^1.5/(P sqrt(2 rho A)); zero where thrust is negative."""
        ideal = self.thrust.clamp(min=0.0) ** 1.5 / torch.sqrt(2.0 * self.inflow.density * self.disk_area)
        return ideal / self.power

    @property
    def propulsive_efficiency(self) -> Tensor:
        """T V/P (...,)."""
        return self.thrust * self.inflow.axial_velocity / self.power

    @property
    def advance_ratio(self) -> Tensor:
        """V/(n D) (...,), propeller convention."""
        return math.pi * self.inflow.axial_velocity / (self.inflow.rotation_speed * self.rotor.radius)

    @property
    def thrust_coefficient(self) -> Tensor:
        """T/(rho n^2 D^4) (...,), propeller convention."""
        n, diameter = self.inflow.rotation_speed / (2.0 * math.pi), 2.0 * self.rotor.radius
        return self.thrust / (self.inflow.density * n**2 * diameter**4)

    @property
    def torque_coefficient(self) -> Tensor:
        """Q/(rho n^2 D^5) (...,), propeller convention."""
        n, diameter = self.inflow.rotation_speed / (2.0 * math.pi), 2.0 * self.rotor.radius
        return self.torque / (self.inflow.density * n**2 * diameter**5)

    @property
    def is_vortex_ring(self) -> Tensor:
        """(...,) descent at 0.2 to 2 times the hover induced velocity, where momentum theory does not hold."""
        hover_velocity = torch.sqrt(self.thrust.clamp(min=0.0) / (2.0 * self.inflow.density * self.disk_area))
        descent = -self.inflow.axial_velocity
        return (descent > 0.2 * hover_velocity) & (descent < 2.0 * hover_velocity)

    @property
    def is_windmilling(self) -> Tensor:
        """(...,) the air drives the rotor."""
        return self.torque < 0.0


def station_radii(radius: Tensor, hub_radius: Tensor, count: int) -> tuple[Tensor, Tensor]:
    """Mid-points (..., count) and width (..., 1) of equal intervals from hub to tip, m."""
    fraction = (torch.arange(count, dtype=radius.dtype, device=radius.device) + 0.5) / count
    span = (radius - hub_radius)[..., None]
    return hub_radius[..., None] + span * fraction, span / count


def prandtl_loss(exponent_at_unit_sine: Tensor, sine: Tensor) -> Tensor:
    """(2/pi) acos(exp(-f)), f = exponent/|sin phi|, written so that its slope stays finite as f goes to zero."""
    exponent = exponent_at_unit_sine / sine.abs().clamp(min=1e-6)
    return (2.0 / math.pi) * torch.atan2(torch.sqrt(-torch.expm1(-2.0 * exponent)), torch.exp(-exponent))


def _momentum_factor(phi: Tensor, tip: Tensor, hub: Tensor | None) -> Tensor:
    """4 F |sin phi|."""
    sine = torch.sin(phi)
    loss = prandtl_loss(tip, sine)
    if hub is not None:
        loss = loss * prandtl_loss(hub, sine)
    return 4.0 * loss * sine.abs()


def blade_element_momentum(rotor: Rotor, inflow: Inflow, polar: Polar, *, has_hub_loss: bool = False) -> RotorLoads:
    """Loads on rotors in axial flow, every leading dimension in one batch.

    The polar is read at the Reynolds and Mach number of the geometric velocity (without induction), which differs from
    the resultant by a few per cent and keeps the equation scalar.
    Raises ValueError if a radius does not exceed its hub radius or a hub radius is not positive.
    """
    if not bool(((rotor.radius > rotor.hub_radius) & (rotor.hub_radius > 0.0)).all()):
        raise ValueError("rotor.radius is not allowed; every radius must exceed its hub_radius, which must be positive")
    r, width = station_radii(rotor.radius, rotor.hub_radius, rotor.chord.shape[-1])
    axial, tangential = inflow.axial_velocity[..., None], inflow.rotation_speed[..., None] * r
    speed = torch.sqrt(axial**2 + tangential**2 + 1e-12)  # m/s; the floor gives a rotor at rest in still air a gradient
    geometric_angle = torch.atan2(axial.expand_as(tangential), tangential + 1e-12)
    blades = rotor.blades[..., None]
    solidity = blades * rotor.chord / (2.0 * math.pi * r)
    reynolds = inflow.density[..., None] * speed * rotor.chord / inflow.dynamic_viscosity[..., None]
    mach = speed / inflow.speed_of_sound[..., None]
    tip = 0.5 * blades * (rotor.radius[..., None] - r) / r
    hub = 0.5 * blades * (r - rotor.hub_radius[..., None]) / rotor.hub_radius[..., None] if has_hub_loss else None
    twist, solidity, geometric_angle, reynolds, mach, tip = torch.broadcast_tensors(
        rotor.twist, solidity, geometric_angle, reynolds, mach, tip
    )

    def residual(phi, twist, solidity, geometric_angle, reynolds, mach, tip, *hub):
        cl, cd = polar(twist - phi, reynolds, mach)
        return _residual(phi - geometric_angle, _momentum_factor(phi, tip, hub[0] if hub else None), solidity, cl, cd)

    args = (twist, solidity, geometric_angle, reynolds, mach, tip) + (() if hub is None else (hub,))
    middle = geometric_angle.detach()
    guess, slope = _first_guess(twist.detach(), solidity.detach(), middle, tip.detach())
    phi = implicit_root(
        residual,
        middle - 0.5 * math.pi,
        middle + 0.5 * math.pi,
        args,
        initial=guess,
        initial_slope=slope,
        tolerance=1e-10,  # of the last step, which is taken
    )
    alpha, turn = twist - phi, phi - geometric_angle
    cl, cd = polar(alpha, reynolds, mach)
    momentum = _momentum_factor(phi, tip, hub)
    resultant = speed * torch.cos(turn) * momentum / (momentum + solidity * cd)
    pressure = 0.5 * inflow.density[..., None] * resultant**2 * rotor.chord * blades
    sin, cos = torch.sin(phi), torch.cos(phi)
    return RotorLoads(
        rotor=rotor,
        inflow=inflow,
        station_radius=r,
        station_width=width,
        thrust_per_length=pressure * (cl * cos - cd * sin),
        torque_per_length=pressure * (cl * sin + cd * cos) * r,
        inflow_angle=phi,
        angle_of_attack=alpha,
        lift_coefficient=cl,
        drag_coefficient=cd,
        reynolds=reynolds,
        mach=mach,
        residual=_residual(turn, momentum, solidity, cl, cd).detach(),
    )


def _residual(turn: Tensor, momentum: Tensor, solidity: Tensor, cl: Tensor, cd: Tensor) -> Tensor:
    """R/V for the angle `turn` by which induction turns the flow and momentum = 4 F |sin phi|."""
    return (momentum + solidity * cd) * torch.sin(turn) - solidity * cl * torch.cos(turn)


def _first_guess(twist: Tensor, solidity: Tensor, geometric_angle: Tensor, tip: Tensor) -> tuple[Tensor, Tensor]:
    """Root of the small-angle residual with linear lift, 4 F phi (phi - phi0) = s a (theta - alpha0 - phi), and its slope.

    Twice: without tip loss, then with the loss F at the angle found.
    """
    pitch = twist - TYPICAL_ZERO_LIFT_ANGLE
    loading = solidity * TYPICAL_LIFT_SLOPE
    loss = prandtl_loss(tip, _small_angle_root(loading, pitch, geometric_angle))
    phi = _small_angle_root(loading / loss, pitch, geometric_angle)
    return phi, (4.0 * loss * (2.0 * phi - geometric_angle)).abs() + loading


def _small_angle_root(loading: Tensor, pitch: Tensor, geometric_angle: Tensor) -> Tensor:
    b = loading - 4.0 * geometric_angle
    return (torch.sqrt((b**2 + 16.0 * loading * pitch).clamp(min=0.0)) - b) / 8.0
