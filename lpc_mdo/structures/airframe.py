"""The airframe that is sized: its parameters, every one with its source, and the load cases.

ASSUMED: reasoned here, no source found. Parts of the Code of Federal Regulations are quoted as they stood before 2017.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.numerics.constants import FOOT, GRAVITY, POUND
from lpc_mdo.structures.sections import CARBON, Material
from lpc_mdo.surrogates.structural_mass import StructuralInputs

SEA_LEVEL_DENSITY = 1.225  # kg/m^3

# Load cases of wing and booms; "out" names the starboard rotor that stands still.
WING_CASES = (
    "pull_up",
    "push_over",
    "gust_up",
    "gust_down",
    "dive",
    "hover_manoeuvre",
    "rotor_out_front_inner",
    "rotor_out_rear_inner",
    "rotor_out_front_outer",
    "rotor_out_rear_outer",
    "landing",
)
FUSELAGE_CASES = ("pull_up", "push_over", "hover_manoeuvre", "landing", "tail_load", "fin_load", "crash")


@dataclass(frozen=True)
class Item:
    """A mass in the fuselage: kg, x in m at the baseline length, its change with length (m/m)."""

    name: str
    mass: float
    x: float
    slope: float


@dataclass(frozen=True)
class Airframe:
    """Lengths in m, angles in rad, masses in kg; baseline values of the Lift+Cruise where no other source is given."""

    material: Material = CARBON
    safety_factor: float = 1.5  # 14 CFR 23.303

    # Wing
    taper: float = 0.531
    sweep: float = math.radians(5.35)  # quarter chord
    dihedral: float = math.radians(-2.25)
    root_quarter_chord: tuple[float, float, float] = (3.1245, 0.0, 2.616)
    wing_shift: float = 0.257  # m per m of fuselage length: regression table of 2024
    thickness_to_chord: float = 0.17
    spars: tuple[float, float] = (0.15, 0.60)  # of the chord, ASSUMED: front and rear spar of usual place
    height_factor: float = (
        0.9  # box height over largest thickness: 0.93 is the section's mean between the spars, less skins
    )
    zero_lift_moment: float = -0.106  # thin-wing theory for the 44 camber line
    rib_pitch: float = 0.5  # ASSUMED
    stringer_pitch: float = 0.12  # ASSUMED
    rib_thickness: float = 0.001  # ASSUMED: minimum gauge
    secondary_areal_mass: float = 5.0  # kg/m^2 of planform outside the box, ASSUMED: two skins of 1 mm and stiffening

    # Booms
    span_fractions: tuple[float, float] = (0.335, 0.742)  # of the semi-span, inner and outer
    boom_radius: float = 0.15  # ASSUMED, as in the vehicle file
    boom_overhang: float = 0.35  # beyond each hub at the baseline span
    hub_offsets: tuple[tuple[float, float], ...] = (
        (-1.955, -0.365),  # x and z of the hub from the quarter chord: inner front, inner rear, outer front, outer rear
        (2.352, 0.315),
        (-2.115, -0.341),
        (2.192, 0.355),
    )
    spins: tuple[int, ...] = (1, -1, -1, 1)
    baseline_span: float = 15.402

    # Fuselage
    half_width: float = 0.7785
    half_height: float = 0.844
    nose: float = 0.751
    cabin_axis_height: float = 1.97  # mean of the heights of nose and rear end
    baseline_length: float = 9.144
    frame_mass_per_area: float = (
        2.0  # kg/m^2 of shell, ASSUMED: frames 100 mm^2 every 0.5 m, stringers 30 mm^2 every 0.12 m
    )
    floor_areal_mass: float = 5.0  # kg/m^2 of length times width: Torenbeek (1976), light passenger floors
    items: tuple[Item, ...] = (  # 2022 table; the slopes are its coefficients of fuselage length
        Item("nose_gear", 70.8, 1.40, 0.088),
        Item("main_gear", 120.8, 4.40, 0.418),
        Item("passengers_front", 181.4, 2.03, 0.165),
        Item("passengers_middle", 181.4, 2.88, 0.279),
        Item("passengers_back", 181.4, 3.74, 0.370),
        Item("propulsion", 185.5, 9.62, 0.987),
        Item("drive_system", 167.5, 5.74, 0.582),
        Item("systems", 248.8, 1.73, 0.165),
        Item("miscellaneous", 187.6, 1.18, 0.067),
    )
    battery_x: float = 4.60
    battery_slope: float = 0.449
    gear_x: float = 4.40
    gear_slope: float = 0.418

    # Rotor groups on the booms: what the 2022 table of non-structural mass leaves after the items in the fuselage.
    rotor_mass: float = 642.6
    rotor_mass_per_area: float = 26.84  # kg/m^2
    rotor_mass_per_aspect_ratio: float = 41.43  # kg
    rotor_radius: float = 1.524
    tip_speed: float = 191.0  # m/s
    figure_of_merit: float = 0.75  # ASSUMED

    # Tails: half horizontal tail and fin are cantilever boxes
    tail_aspect_ratio: float = 4.3
    tail_taper: float = 0.6
    tail_root: tuple[float, float, float] = (8.6465, 0.0, 2.441)
    fin_aspect_ratio: float = 1.17
    fin_taper: float = 0.272
    fin_root: tuple[float, float, float] = (8.0, 0.0, 2.4)
    tail_thickness_to_chord: float = 0.12
    tail_normal_force: float = 0.7  # at cruise speed, ASSUMED: about the limit loading of 14 CFR 23 appendix A

    # Minimum and maximum gauges: m, caps m^2
    minimum_gauge: float = 0.00104  # eight plies of 0.13 mm
    maximum_gauge: float = 0.02
    minimum_cap: float = 2.0e-5  # ASSUMED
    maximum_cap: float = 4.0e-3

    # Stiffness, own choices
    tip_deflection: float = 0.12  # of the semi-span at limit load
    rotor_rotation: float = math.radians(3.0)  # at the hub in hover

    @property
    def box_width(self) -> float:
        """Over the chord."""
        return self.spars[1] - self.spars[0]

    @property
    def box_offset(self) -> float:
        """Middle of the box behind the quarter chord, over the chord."""
        return 0.5 * sum(self.spars) - 0.25


def span(inputs: StructuralInputs) -> Tensor:
    return torch.sqrt(inputs.wing_area * inputs.wing_aspect_ratio)


def rotor_mass(airframe: Airframe, inputs: StructuralInputs) -> Tensor:
    """All eight rotor groups (...,) kg."""
    area, ratio = inputs.wing_area - 19.536, inputs.wing_aspect_ratio - 12.1423
    return airframe.rotor_mass + airframe.rotor_mass_per_area * area + airframe.rotor_mass_per_aspect_ratio * ratio


def manoeuvre_load_factor(mass: Tensor) -> Tensor:
    """Positive limit load factor (...,) of a normal-category airplane of mass (...,) kg. Source: 14 CFR 23.337(a)."""
    return torch.clamp(2.1 + 24000.0 / (mass / POUND + 10000.0), max=3.8)


def lift_slope(aspect_ratio: Tensor) -> Tensor:
    """Wing lift slope (...,) 1/rad. Source: Helmbold (1942)."""
    return 2.0 * math.pi * aspect_ratio / (2.0 + torch.sqrt(4.0 + aspect_ratio**2))


def gust_increment(mass: Tensor, area: Tensor, chord: Tensor, speed: Tensor, slope: Tensor) -> Tensor:
    """Load factor (...,) that a 50 ft/s gust adds at `speed` (...,) m/s. Source: 14 CFR 23.341(c)."""
    gust = 50.0 * FOOT
    ratio = 2.0 * (mass / area) / (SEA_LEVEL_DENSITY * chord * slope)
    alleviation = 0.88 * ratio / (5.3 + ratio)
    return alleviation * SEA_LEVEL_DENSITY * gust * speed * slope * area / (2.0 * mass * GRAVITY)


@dataclass(frozen=True)
class WingLoads:
    """Limit load cases of the starboard half, (..., case): lift of the whole wing in N, inertia factor, dynamic pressure
    in Pa; thrust (..., case, rotor) in N of inner front, inner rear, outer front and outer rear rotor."""

    lift: Tensor
    inertia: Tensor
    dynamic_pressure: Tensor
    thrust: Tensor


def wing_loads(airframe: Airframe, inputs: StructuralInputs, mass: Tensor) -> WingLoads:
    """The cases WING_CASES for gross mass (...,) kg.

    A lost rotor's opposite on the other side stands still, so that every half meets one idle rotor of its own at a time;
    the six others carry the weight. Sources: 14 CFR 23.333, 23.337, 23.473; 27.337(b); rotor loss: own choice after the
    intent of SC-VTOL.
    """
    limit = manoeuvre_load_factor(mass)
    gust = gust_increment(
        mass,
        inputs.wing_area,
        torch.sqrt(inputs.wing_area / inputs.wing_aspect_ratio),
        inputs.cruise_speed,
        lift_slope(inputs.wing_aspect_ratio),
    )
    one, zero = torch.ones_like(limit), torch.zeros_like(limit)
    lifts = [limit, -0.4 * limit, one + gust, one - gust, limit, *[zero] * 5, one * 2.0 / 3.0]
    inertias = [*lifts[:5], 2.0 * one, *[one] * 4, 2.67 * one]
    pressure = 0.5 * SEA_LEVEL_DENSITY * inputs.cruise_speed**2
    pressures = [pressure] * 4 + [1.25**2 * pressure] + [zero] * 6
    share = torch.zeros(len(WING_CASES), 4, dtype=torch.float64)
    share[5] = 2.0 / 8.0
    share[6:10] = (1.0 - torch.eye(4, dtype=torch.float64)) / 6.0
    weight = mass * GRAVITY
    return WingLoads(
        lift=torch.stack(lifts, dim=-1) * weight[..., None],
        inertia=torch.stack(inertias, dim=-1),
        dynamic_pressure=torch.stack(torch.broadcast_tensors(*pressures), dim=-1),
        thrust=share * weight[..., None, None],
    )


def rotor_torque(airframe: Airframe, thrust: Tensor) -> Tensor:
    """Shaft torque (...,) N m of a rotor in hover from momentum theory and the figure of merit."""
    disk = math.pi * airframe.rotor_radius**2
    power = thrust**1.5 / (math.sqrt(2.0 * SEA_LEVEL_DENSITY * disk) * airframe.figure_of_merit)
    return power * airframe.rotor_radius / airframe.tip_speed
