"""Promises of masses, drives, clearances, heat and cost: see `test_library_contract`."""

import torch
from promise import Promise

from lpc_mdo.disciplines.battery_heat import circuit_heat, discharge_loss, discharge_rate, pack_temperature
from lpc_mdo.disciplines.clearance import Disk, disk_to_disk, disk_to_plane, disk_to_segment, ground_normal
from lpc_mdo.disciplines.cost import cost_per_distance, purchase_price, trip_cost
from lpc_mdo.disciplines.electric_drive import (
    cable_mass,
    gearbox_mass_afdd00,
    gearbox_mass_afdd83,
    inverter_mass,
    overload_ratio,
    signal_wire_mass,
    supplied_power,
    winding_time_constant,
)
from lpc_mdo.disciplines.elliptic_body import EllipticBody, box_in_body, disk_to_body, distance_to_body
from lpc_mdo.disciplines.equivalent_circuit import LG_M50
from lpc_mdo.disciplines.hover_download import hover_download, stopped_rotor_drag_area, wake_pressure
from lpc_mdo.disciplines.rotor_mass import RotorSize, mean_chord, rotor_mass_afdd00, rotor_mass_afdd82
from lpc_mdo.disciplines.stability_derivatives import Reference, StabilityDerivatives
from lpc_mdo.disciplines.tail_sizing import (
    control_moment,
    fin_yaw_stiffness,
    flap_effectiveness,
    lift_slope,
    required_area,
    static_margins,
    surface_moment,
)


def rotor_masses(radius, chord, tip_speed, blades, flap):
    size = RotorSize(radius, chord, tip_speed, blades, flap)
    laws = (rotor_mass_afdd82(size), rotor_mass_afdd00(size), rotor_mass_afdd00(size, 1.18))
    return torch.stack([part for law in laws for part in (law.blades, law.hub, law.total)], dim=-1)


def a_disk(center, tilt, radius):
    axis = torch.stack([torch.sin(tilt), 0.0 * tilt, torch.cos(tilt)], dim=-1)
    return Disk(center, axis, radius)


def gaps(center, tilt, radius, start, end):
    disk = a_disk(center, tilt, radius)
    other = a_disk(start, -2.0 * tilt, 0.5 * radius)
    normal = ground_normal(0.3 * tilt)
    parts = [disk_to_disk(disk, other), disk_to_plane(disk, end, normal), disk_to_segment(disk, start, end, 0.1)]
    return torch.stack(parts, dim=-1)


def a_body(length):
    share = torch.linspace(0.0, 1.0, 9).to(length)
    half = torch.sin(3.14159 * share) * 0.8 * torch.ones_like(length)[..., None]
    return EllipticBody(length[..., None] * share, 0.0 * half, 0.1 * half + 1.0, half, 1.1 * half)


def body_gaps(length, center, tilt, radius):
    body = a_body(length)
    parts = [disk_to_body(a_disk(center, tilt, radius), body), box_in_body(body, center, 0.2 * center)]
    return torch.cat([torch.stack(parts, dim=-1), distance_to_body(body, center[..., None, :])], dim=-1)


def drive(power, motor_speed, rotor_speed, length):
    supplied = supplied_power(power, 0.98, 0.99)
    parts = [inverter_mass(supplied), cable_mass(supplied, length), signal_wire_mass(length)]
    parts += [law(power, motor_speed, rotor_speed) for law in (gearbox_mass_afdd83, gearbox_mass_afdd00)]
    return torch.stack([supplied / 1e5, *parts], dim=-1)


def overload(duration, density, rise, preload):
    constant = winding_time_constant(density, rise)
    return torch.stack([constant / 100.0, overload_ratio(duration, constant, preload)], dim=-1)


def download(thrust, radius, center, points):
    centers = torch.stack([center, -center], dim=-2)
    thrusts, radii = torch.stack([thrust, 0.8 * thrust], dim=-1), torch.stack([radius, radius], dim=-1)
    elements = torch.stack([points, 0.3 * points], dim=-2)
    area = torch.stack([0.1 * radius, 0.2 * radius], dim=-1)
    found = hover_download(thrusts, radii, centers, elements, area, 0.0 * area + 1.5)
    pressure = wake_pressure(thrusts, radii, centers, elements)
    return torch.cat([found.force, found.share[..., None], found.total[..., None], pressure], dim=-1) / 100.0


def trip(mass, capacity, energy, time, distance):
    price = purchase_price(mass, capacity)
    cost = trip_cost(price, energy, time)
    parts = [*vars(cost).values(), cost.total, price.total / 1e4, 1e4 * cost_per_distance(cost, 4.0, distance)]
    return torch.stack(parts, dim=-1)


def temperatures(power, duration, mass, initial, air, conductance):
    heat = discharge_loss(power, 0.95)
    found = pack_temperature(heat, duration, mass, initial, air, conductance)
    charge = 1.0 - power.cumsum(-1) / 1e6
    circuit = circuit_heat(LG_M50, charge, 0.1 * charge, duration, 10.0 * mass) / 1e3
    rate = discharge_rate(power, mass, 1.44e6)
    return torch.cat([found / 100.0, circuit, rate], dim=-1)


def tail(aspect_ratio, sweep, mach, area, chord_share):
    slope = lift_slope(aspect_ratio, sweep, mach)
    reference = Reference(10.0 * area, area, 8.0 + 0.0 * area, torch.stack([area, area, area], dim=-1))
    moments = [
        surface_moment(area, area, slope, sweep, area),
        control_moment(area, area, slope, area, sweep, chord_share),
        required_area(area, slope),
        fin_yaw_stiffness(area, slope, area, reference),
    ]
    derivatives = StabilityDerivatives(slope, slope[..., None, None] * torch.arange(1.0, 31.0).reshape(6, 5).to(slope))
    margins = static_margins(derivatives, reference, torch.stack([area, 2.0 * area], dim=-1))
    return torch.cat([torch.stack([slope, flap_effectiveness(chord_share), *moments], dim=-1), margins], dim=-1)


CENTERS = [[0.1, 0.2, 0.3], [0.3, -0.2, 0.1], [-0.2, 0.4, 0.2]]
STARTS = [[0.5, 3.0, -1.0], [0.2, 2.5, 1.0], [2.0, 2.0, 1.5]]
ENDS = [[0.4, 2.0, 2.0], [0.3, 2.2, -1.0], [3.0, -2.0, 1.0]]

PROMISES = {
    "disk_to_disk, disk_to_plane, disk_to_segment, ground_normal": Promise(
        gaps, (CENTERS, [0.2, -0.1, 0.3], [1.5, 1.2, 1.0], STARTS, ENDS), 1e-3
    ),
    "disk_to_body, distance_to_body, box_in_body": Promise(
        body_gaps,
        ([6.0, 5.0, 7.0], [[2.0, 2.1, 1.4], [1.5, 1.8, 0.7], [3.0, 1.9, 1.9]], [0.1, 0.2, -0.1], [0.9, 0.7, 0.8]),
        1e-3,
    ),
    "rotor_mass_afdd82, rotor_mass_afdd00": Promise(
        rotor_masses,
        ([1.5, 1.2, 1.8], [0.15, 0.3, 0.4], [150.0, 190.0, 170.0], [2.0, 4.0, 3.0], [1.25, 1.03, 1.5]),
    ),
    "mean_chord": Promise(mean_chord, ([[0.3, 0.2], [0.4, 0.1], [0.2, 0.2]], [[1.0, 2.0], [2.0, 1.0], [0.5, 0.4]])),
    "supplied_power, inverter_mass, cable_mass, signal_wire_mass, gearbox_mass_afdd83, gearbox_mass_afdd00": Promise(
        drive, ([1e5, 5e4, 3e5], [500.0, 400.0, 600.0], [120.0, 100.0, 150.0], [8.0, 5.0, 3.0])
    ),
    "winding_time_constant, overload_ratio": Promise(
        overload, ([30.0, 10.0, 90.0], [1e7, 8e6, 6e6], [100.0, 80.0, 90.0], [0.8, 0.2, 0.6])
    ),
    "hover_download, wake_pressure": Promise(
        download,
        ([4e3, 3e3, 5e3], [1.5, 1.2, 1.8], CENTERS, [[0.5, 0.7, -1.0], [0.2, 1.0, -0.4], [1.4, 0.3, 0.3]]),
        1e-3,
    ),
    "stopped_rotor_drag_area": Promise(
        stopped_rotor_drag_area,
        (
            [[0.3, 0.2]] * 3,
            [[0.5, 0.6]] * 3,
            [[0.4, 0.2], [0.3, 0.1], [0.5, 0.3]],
            [[0.3, 3.4], [1.0, 4.1], [2.0, 5.0]],
        ),
    ),
    "purchase_price, trip_cost, cost_per_distance": Promise(
        trip, ([2e3, 1e3, 3e3], [1e9, 2e9, 8e8], [3e8, 2e8, 5e8], [1500.0, 1000.0, 3000.0], [7e4, 5e4, 1e5])
    ),
    "pack_temperature, circuit_heat, discharge_loss, discharge_rate": Promise(
        temperatures,
        (
            [[4e5, 1e5], [3e5, 2e5], [2e5, 1e5]],
            [[90.0, 600.0], [60.0, 900.0], [120.0, 300.0]],
            [800.0, 600.0, 900.0],
            [298.0, 290.0, 300.0],
            [[290.0, 280.0], [285.0, 275.0], [300.0, 290.0]],
            [[100.0, 300.0], [200.0, 50.0], [20.0, 400.0]],
        ),
    ),
    "lift_slope, flap_effectiveness, surface_moment, control_moment, required_area, fin_yaw_stiffness, static_margins": Promise(
        tail, ([4.0, 2.0, 8.0], [0.1, 0.3, 0.2], [0.2, 0.4, 0.1], [2.0, 1.0, 3.0], [0.3, 0.2, 0.5])
    ),
}
