"""Promises of aerodynamics, rotors, flight mechanics, masses and noise maps: see `test_library_contract`."""

import torch
from promise import Promise

from lpc_mdo.disciplines import drag, trim
from lpc_mdo.disciplines.absorption import water_vapour_concentration
from lpc_mdo.disciplines.atmosphere import standard_atmosphere, sutherland_viscosity
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum, station_radii
from lpc_mdo.disciplines.blade_sections import prandtl_loss
from lpc_mdo.disciplines.dynamic_inflow import (
    dynamic_inflow_loads,
    dynamic_inflow_rate,
    dynamic_inflow_rotor,
    forcing,
    inflow_matrices,
    steady_inflow,
)
from lpc_mdo.disciplines.dynamics import (
    RigidBody,
    acceleration_sensitivity,
    lateral_modes,
    linearize,
    longitudinal_modes,
    rigid_body_residual,
    steady_state,
)
from lpc_mdo.disciplines.far_field import far_field, span_loading
from lpc_mdo.disciplines.flying_qualities import dutch_roll_margins, short_period_margins
from lpc_mdo.disciplines.inclined_rotor import InclinedFlow, in_disk, inclined_rotor, plane_basis
from lpc_mdo.disciplines.mass_properties import combine, point_inertia
from lpc_mdo.disciplines.stability_derivatives import (
    Reference,
    air_velocity,
    lattice_coefficients,
    stability_derivatives,
)
from lpc_mdo.disciplines.vortex_lattice import stream_axes, vortex_lattice
from lpc_mdo.surrogates.airfoil import load_airfoil
from lpc_mdo.surrogates.section_theory import drag_rise, stalled_plate

STATIONS = 5
POLAR = load_airfoil()


def section(alpha, reynolds, mach):
    return 5.7 * alpha, 0.01 + 0.5 * alpha**2


def a_rotor(radius, chord, twist):
    one = torch.ones(STATIONS).to(radius)
    return Rotor(radius, 0.2 * radius, chord[..., None] * one, twist[..., None] * one, torch.full_like(radius, 3.0))


def axial(polar):
    def loads(radius, chord, twist, axial_velocity, speed):
        one = torch.ones_like(radius)
        inflow = Inflow(axial_velocity, speed, 1.2 * one, 340.0 * one, 1.8e-5 * one)
        found = blade_element_momentum(a_rotor(radius, chord, twist), inflow, polar)
        return torch.stack([found.thrust / 1e3, found.torque / 1e3, found.figure_of_merit], dim=-1)

    return loads


def a_flow(along, across, speed):
    zero, one = torch.zeros_like(along), torch.ones_like(along)
    velocity = torch.stack([across, zero, -along], dim=-1)
    axis = torch.tensor([0.0, 0.0, 1.0]).to(along).expand_as(velocity)
    return InclinedFlow(velocity, axis, one, speed, 1.2 * one, 340.0 * one, 1.8e-5 * one)


def hub(model):
    def loads(radius, chord, twist, along, across, speed):
        found = model(a_rotor(radius, chord, twist), a_flow(along, across, speed), section)
        disk = in_disk(found, a_flow(along, across, speed))
        return torch.cat([found.force, found.moment, *disk], dim=-1) / 1e3

    return loads


def inflow_states(radius, chord, twist, along, across, speed):
    return steady_inflow(a_rotor(radius, chord, twist), a_flow(along, across, speed), section)


def some_states(along):
    return torch.stack([0.0 * along + 9.0, 0.0 * along + 1.0, 0.0 * along - 0.5], dim=-1)


def inflow_loads(radius, chord, twist, along, across, speed):
    rotor, flow = a_rotor(radius, chord, twist), a_flow(along, across, speed)
    loads = dynamic_inflow_loads(rotor, flow, section, some_states(along))
    return torch.cat([loads.force / 1e3, forcing(rotor, flow, loads)], dim=-1)


def inflow_rates(radius, chord, twist, along, across, speed):
    flow = a_flow(along, across, speed)
    return dynamic_inflow_rate(a_rotor(radius, chord, twist), flow, section, some_states(along)) / 1e2


def gains(along, across, speed):
    gain, through = inflow_matrices(a_flow(along, across, speed), torch.full_like(along, 8.0))
    return torch.cat([gain.flatten(-2), through], dim=-1)


def a_wing(span, chord, sweep):
    """Cambered and swept, (..., 3, 5, 3)."""
    y = span[..., None, None] * torch.linspace(-0.5, 0.5, 5).to(span) * torch.ones(3, 1).to(span)
    share = torch.linspace(0.0, 1.0, 3).to(span)[:, None]
    x = chord[..., None, None] * share + sweep[..., None, None] * y.abs()
    z = 0.1 * chord[..., None, None] * share * (1.0 - share) * torch.ones_like(y)
    return torch.stack([x, y, z], dim=-1)


def a_tail(wing):
    return 0.4 * wing + torch.tensor([5.0, 0.0, 0.4]).to(wing)


def lattice(span, chord, sweep, alpha, beta):
    velocity, density = air_velocity(torch.full_like(alpha, 20.0), alpha, beta), torch.full_like(alpha, 1.2)
    mesh = a_wing(span, chord, sweep)
    return mesh, velocity, density, vortex_lattice(
        [mesh, a_tail(mesh)], velocity, density, torch.zeros(3).to(span), has_chordwise_forces=True, mach=torch.full_like(alpha, 0.2)
    )  # fmt: skip


def lattice_loads(*inputs):
    loads = lattice(*inputs)[-1]
    return torch.cat([loads.force, loads.moment], dim=-1) / 100.0


def wake_loads(*inputs):
    mesh, velocity, density, loads = lattice(*inputs)
    far = far_field(loads.circulation, [mesh[..., -1, :, :], a_tail(mesh)[..., -1, :, :]], velocity, density)
    return torch.stack([far.lift, 10.0 * far.side_force, 10.0 * far.induced_drag], dim=-1) / 100.0


def section_loads(*inputs):
    mesh, velocity, density, loads = lattice(*inputs)
    return span_loading(mesh, loads.panel_force[0], velocity, density).lift_coefficient


def a_reference(span, chord):
    return Reference(span * chord, chord, span, torch.zeros(*span.shape, 3).to(span))


def coefficients(span, chord, sweep, state):
    return lattice_coefficients([a_wing(span, chord, sweep)], a_reference(span, chord), state)


def slopes(span, chord, sweep, state):
    return stability_derivatives([a_wing(span, chord, sweep)], a_reference(span, chord), state).slope.flatten(-2)


def a_body(mass, pitch_damping, stiffness):
    """A rigid body with linear loads, flying at 60 m/s."""
    ones = torch.ones_like(mass)
    inertia = mass[..., None, None] * torch.tensor([[2.0, 0.0, 0.3], [0.0, 3.0, 0.0], [0.3, 0.0, 4.0]]).to(mass)

    def loads(state, rate):
        u, v, w, p, q, r, _, _ = state.unbind(-1)
        pull = torch.stack([-0.03 * u, -0.2 * v, -9.80665 * ones - 1.5 * w + 0.02 * (u - 60.0)], dim=-1)
        roll = -4.0 * p + 0.8 * r - 0.05 * v
        pitch = -pitch_damping * q - stiffness * w
        yaw = -0.6 * r - 0.1 * p + 0.06 * v
        return mass[..., None] * pull, mass[..., None] * torch.stack([roll, pitch, yaw], dim=-1)

    return RigidBody(mass, inertia), loads, steady_state(60.0 * ones, 0.0 * ones, 0.0 * ones)


def motion_matrix(*body):
    return linearize(*a_body(*body)).matrix.flatten(-2)


def mode_numbers(*body):
    motion = linearize(*a_body(*body))
    long, lateral = longitudinal_modes(motion.longitudinal), lateral_modes(motion.lateral)
    pairs = (long.short_period, long.phugoid, lateral.dutch_roll)
    numbers = [v for pair in pairs for v in (pair.natural_frequency, pair.damping_ratio)]
    sensitivity = acceleration_sensitivity(motion, torch.full_like(body[0], 60.0))
    margins = [dutch_roll_margins(lateral), short_period_margins(long, sensitivity)]
    return torch.cat(
        [torch.stack([*numbers, lateral.roll.time_constant, sensitivity / 10.0], dim=-1), *margins], dim=-1
    )


def motion_residual(mass, pitch_damping, stiffness, state, rate):
    body, loads, _ = a_body(mass, pitch_damping, stiffness)
    return rigid_body_residual(body, loads, state, rate) / 1e3


def trimmed(force, point, center, mass, pitch, bank):
    forces, points = torch.stack([force, 0.5 * force], dim=-2), torch.stack([point, -point], dim=-2)
    left = trim.trim_residual(forces, points, force, center, mass, pitch, bank)
    turning = trim.Maneuver(0.1 * force, 0.001 * force, 0.01 * force, 0.002 * force)
    inertia = mass[..., None, None] * torch.eye(3).to(mass)
    moved = trim.maneuver_residual(left, mass, inertia, turning)
    return torch.cat([left.scaled(mass, torch.ones_like(mass)), moved.scaled(mass, torch.ones_like(mass))], dim=-1)


def whole(mass, position):
    positions = torch.stack([position, -0.5 * position], dim=-2)
    masses = torch.stack([mass, 2.0 * mass], dim=-1)
    total = combine(masses, positions, point_inertia(masses, positions))
    return torch.cat([total.mass[..., None], total.center_of_gravity, total.inertia.flatten(-2)], dim=-1)


AXIAL = ([1.5, 1.2, 1.8], [0.15, 0.1, 0.2], [0.3, 0.25, 0.4], [6.0, 0.5, 12.0], [120.0, 140.0, 90.0])
INCLINED = (*AXIAL[:3], [6.0, 2.0, 12.0], [8.0, 15.0, 3.0], AXIAL[4])
WING = ([8.0, 6.0, 10.0], [1.0, 0.8, 1.2], [0.2, 0.1, 0.3])
ATTITUDE = ([0.05, 0.1, -0.03], [0.02, -0.04, 0.1])
STATE = [[0.05, 0.02, 0.1, 0.02, -0.05], [0.1, -0.04, 0.02, 0.01, 0.03], [-0.03, 0.1, -0.05, 0.03, 0.02]]
BODY = ([3000.0, 2500.0, 4000.0], [8.0, 6.0, 10.0], [0.5, 0.4, 0.6])
VECTORS = [[10.0, -20.0, 30.0], [5.0, 8.0, -9.0], [-3.0, 4.0, 12.0]]
EIGHT = [[0.3, -0.2, 0.5, 0.1, -0.3, 0.2, 0.05, 0.1], [0.2, 0.4, 0.1, -0.2, 0.1, 0.3, -0.1, 0.2], [0.1] * 8]
UNIT = [[1 / 3, 2 / 3, 2 / 3], [2 / 3, -1 / 3, 2 / 3], [-2 / 3, 2 / 3, -1 / 3]]

PROMISES = {
    "standard_atmosphere": Promise(
        lambda h: torch.stack(
            [v / s for v, s in zip(vars(standard_atmosphere(h)).values(), (300, 1e5, 1, 300, 1e-5), strict=True)],
            dim=-1,
        ),
        ([0.0, 1000.0, 9000.0],),
    ),
    "sutherland_viscosity": Promise(lambda t: 1e5 * sutherland_viscosity(t), ([220.0, 288.15, 310.0],)),
    "water_vapour_concentration": Promise(
        lambda t, p, h: water_vapour_concentration(t, p, h), ([280.0, 290.0, 300.0], [1e5, 9e4, 8e4], [0.3, 0.6, 0.9])
    ),
    "airfoil polar": Promise(
        lambda a, re, m: torch.stack(POLAR(a, re, m), dim=-1),
        ([0.05, 0.4, -0.5], [1e6, 3e5, 2e6], [0.1, 0.3, 0.5]),
        1e-3,
    ),
    "maximum_lift_coefficient": Promise(POLAR.maximum_lift_coefficient, ([1e6, 3e5, 2e6], [0.1, 0.3, 0.5]), 1e-3),
    "drag_rise": Promise(lambda c, m: drag_rise(c, m, 0.5 * m, 0.12), ([0.3, 0.5, 0.1], [0.7, 0.75, 0.8]), 1e-3),
    "stalled_plate": Promise(
        lambda a: torch.stack(stalled_plate(torch.sin(a), torch.cos(a)), dim=-1), ([0.4, 1.2, -2.0],)
    ),
    "turbulent_friction_coefficient": Promise(
        lambda re, m: 1e3 * drag.turbulent_friction_coefficient(re, m), ([1e6, 1e7, 3e7], [0.1, 0.2, 0.6])
    ),
    "surface_form_factor": Promise(lambda m: drag.surface_form_factor(0.12, m), ([0.1, 0.2, 0.6],)),
    "body_form_factor": Promise(lambda length: drag.body_form_factor(length, 1.5), ([8.0, 9.0, 12.0],)),
    "surface_wetted_area": Promise(lambda area: drag.surface_wetted_area(area, 0.12), ([8.0, 9.0, 12.0],)),
    "tube_wetted_area": Promise(lambda length: drag.tube_wetted_area(length, 0.3), ([8.0, 9.0, 12.0],)),
    "station_radii": Promise(
        lambda r, h: torch.cat(station_radii(r, h, STATIONS), dim=-1), ([1.5, 1.2, 1.8], [0.3, 0.2, 0.4])
    ),
    "prandtl_loss": Promise(prandtl_loss, ([0.5, 2.0, 0.1], [0.1, 0.3, 0.2])),
    "blade_element_momentum": Promise(axial(section), AXIAL, 1e-3),
    "blade_element_momentum with the network": Promise(axial(POLAR), AXIAL, 2e-3),
    "inclined_rotor, in_disk": Promise(hub(inclined_rotor), INCLINED, 2e-3),
    "dynamic_inflow_rotor": Promise(hub(dynamic_inflow_rotor), INCLINED, 2e-3),
    "steady_inflow": Promise(inflow_states, INCLINED, 2e-3),
    "dynamic_inflow_loads": Promise(inflow_loads, INCLINED, 1e-3),
    "dynamic_inflow_rate": Promise(inflow_rates, INCLINED, 2e-3),
    "inflow_matrices": Promise(gains, INCLINED[3:]),
    "plane_basis": Promise(
        lambda v: torch.cat(plane_basis(v / torch.linalg.vector_norm(v, dim=-1, keepdim=True)), dim=-1), (UNIT,)
    ),
    "air_velocity": Promise(air_velocity, ([20.0, 30.0, 60.0], *ATTITUDE)),
    "stream_axes": Promise(
        lambda v: torch.cat(stream_axes(v / torch.linalg.vector_norm(v, dim=-1, keepdim=True)), dim=-1), (UNIT,)
    ),
    "vortex_lattice": Promise(lattice_loads, (*WING, *ATTITUDE), 1e-3),
    "far_field": Promise(wake_loads, (*WING, *ATTITUDE), 2e-3),
    "span_loading": Promise(section_loads, (*WING, *ATTITUDE), 1e-3),
    "lattice_coefficients": Promise(coefficients, (*WING, STATE), 1e-3),
    "stability_derivatives": Promise(slopes, (*WING, STATE), 3e-3),
    "steady_state": Promise(steady_state, ([60.0, 50.0, 70.0], *ATTITUDE)),
    "rigid_body_residual": Promise(motion_residual, (*BODY, EIGHT, EIGHT)),
    "linearize": Promise(motion_matrix, BODY),
    "longitudinal_modes, lateral_modes, acceleration_sensitivity, dutch_roll_margins, short_period_margins": Promise(
        mode_numbers, BODY, 1e-3
    ),
    "geometry_to_body": Promise(trim.geometry_to_body, (VECTORS,)),
    "gravity_force": Promise(lambda m, p, b: trim.gravity_force(m, p, b) / 1e3, ([3000.0, 2500.0, 4000.0], *ATTITUDE)),
    "trim_residual, maneuver_residual": Promise(
        trimmed, (VECTORS, VECTORS, VECTORS, [3000.0, 2500.0, 4000.0], *ATTITUDE), 1e-3
    ),
    "stall_speed": Promise(
        trim.stall_speed, ([3000.0, 2500.0, 4000.0], [1.2, 1.1, 1.0], [19.0, 18.0, 20.0], [1.4, 1.5, 1.6])
    ),
    "point_inertia, combine": Promise(whole, ([10.0, 20.0, 5.0], VECTORS), 1e-3),
}
