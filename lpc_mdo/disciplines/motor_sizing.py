"""A permanent-magnet synchronous motor from its bore and active length: masses, circuit constants, loss constants.

Structure after Cheng et al. (2023) and Pyrhonen, Jokinen, Hrabovcova, Design of Rotating Electrical Machines, 2nd ed.
(2014) [P]. Every number in MotorParameters is a default of the design, not a law.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.disciplines.motor import MotorCircuit
from lpc_mdo.numerics.trinomial import trinomial_root

VACUUM_PERMEABILITY = 4e-7 * math.pi  # H/m
# Electrical steel: H = line B + power B^15 A/m at B T, that is 0.2, 0.8 and 4.3 kA/m at 1.35, 1.5 and 1.7 T, as M270-35A.
MAGNETIZATION_LINE = 70.0
MAGNETIZATION_POWER = 75.0 / 1.3**15


@dataclass(frozen=True)
class MotorParameters:
    """Design rules and materials; SI units, temperatures in degrees Celsius."""

    dc_voltage: float = 800.0
    pole_pairs: int = 6
    slots: int = 36
    outer_to_bore: float = 1.25  # stator outer over bore diameter
    electric_loading: float = 30e3  # A/m rms, for which the air gap is sized
    maximum_electric_loading: float = 65e3  # A/m rms, sets the current limit; top of [P] table 6.2 for PM machines
    air_gap_flux_density: float = 0.85  # T, for which teeth and yoke are sized
    tooth_flux_density: float = 1.7  # T
    yoke_flux_density: float = 1.35  # T
    stacking_factor: float = 0.95
    mean_to_peak_flux: float = 0.7
    winding_factor: float = 0.95
    slot_fill: float = 0.45  # copper over slot area
    end_winding_allowance: float = 0.02  # m a half turn, beyond two pole pitches
    copper_resistivity: float = 2.17e-8  # ohm m, at about 80 degrees
    carter_factor: float = 1.1
    slot_leakage: float = 0.25  # leakage over d-axis air-gap inductance, [P] section 4.3 range 0.1-0.4
    magnet_thickness: float = 4e-3  # m
    magnet_arc: float = 0.78  # of the pole
    remanence_20: float = 1.2  # T, NdFeB
    coercivity_20: float = 907e3  # A/m
    remanence_slope: float = -0.0012  # 1/K
    magnet_temperature: float = 80.0
    rated_speed: float = 750.0  # rad/s: the winding is wound so that here
    rated_voltage_share: float = 0.8  # the no-load voltage is this share of the limit, V_dc/sqrt(3)
    copper_density: float = 8900.0
    iron_density: float = 7800.0
    magnet_density: float = 7600.0
    structure_factor: float = 1.25  # housing, shaft, bearings and cooling over active mass, ASSUMED
    hysteresis_loss: float = 0.0178  # W/(kg Hz T^2), and
    eddy_loss: float = 1.24e-4  # W/(kg Hz^2 T^2): 0.35 mm steel of 2.7 W/kg at 1.5 T, 50 Hz (M270-35A)
    windage_coefficient: float = 0.005  # drum friction coefficient, [P] eq. 9.17 at this Reynolds number
    bearing_torque: float = 0.2  # N m, ASSUMED
    stray_share: float = 0.0075  # of the output; 0.5-1 % usual


@dataclass(frozen=True)
class Motor:
    """A sized motor; every field (...,)."""

    circuit: MotorCircuit
    mass: Tensor  # kg
    outer_diameter: Tensor  # m
    flux_density: Tensor  # T, in the air gap under the magnets


def size_motor(bore: Tensor, length: Tensor, parameters: MotorParameters | None = None) -> Motor:
    """Motor of stator bore (...,) m and active length (...,) m.

    The number of turns is real-valued: it follows from the rated speed and the voltage limit, and cancels out of torque,
    loss and mass. Raises ValueError unless bore and length are positive and the bore holds magnets and rotor yoke.
    """
    q = parameters or MotorParameters()
    bore, length = torch.broadcast_tensors(bore, length)
    if bool(((bore <= 0.0) | (length <= 0.0)).any()):
        raise ValueError("motor diameter and length are not allowed; both must be positive")
    pole_pitch = math.pi * bore / (2 * q.pole_pairs)
    slot_pitch = math.pi * bore / q.slots
    gap = 0.4 * q.electric_loading * pole_pitch / (0.9e6 * q.air_gap_flux_density)
    effective_length = length + 2.0 * gap
    tooth = slot_pitch * q.air_gap_flux_density / (q.stacking_factor * q.tooth_flux_density)
    yoke = pole_pitch * q.mean_to_peak_flux * q.air_gap_flux_density / (2 * q.stacking_factor * q.yoke_flux_density)
    outer = q.outer_to_bore * bore
    slot_depth = 0.5 * (outer - bore) - yoke
    slot_width = math.pi * (bore + slot_depth) / q.slots - tooth
    copper_area = q.slots * slot_width * slot_depth * q.slot_fill  # m^2, all slots
    half_turn = effective_length + q.end_winding_allowance + 2.0 * pole_pitch

    rotor = bore - 2.0 * gap
    core = rotor - 2.0 * q.magnet_thickness - yoke  # mean diameter of the rotor's yoke
    if bool((core <= yoke).any()):
        worst = float(bore.detach()[core <= yoke].min())
        raise ValueError(f"motor diameter = {worst:g} m is invalid: it must hold magnets and the yoke within them")
    teeth_mass = q.iron_density * q.stacking_factor * q.slots * tooth * slot_depth * length
    yoke_mass = q.iron_density * q.stacking_factor * math.pi * (outer - yoke) * yoke * length
    rotor_mass = q.iron_density * math.pi * core * yoke * length
    magnet_mass = q.magnet_density * q.magnet_arc * math.pi * (rotor - q.magnet_thickness) * q.magnet_thickness * length
    copper_mass = q.copper_density * copper_area * half_turn
    active = teeth_mass + yoke_mass + rotor_mass + magnet_mass + copper_mass

    flux_density, magnet_gap = _gap_flux_density(q, gap, slot_depth, pole_pitch)
    fundamental = flux_density * (4.0 / math.pi) * math.sin(0.5 * math.pi * q.magnet_arc)
    pole_flux = (2.0 / math.pi) * fundamental * pole_pitch * effective_length
    voltage = q.dc_voltage / math.sqrt(3.0)
    flux_linkage = torch.full_like(pole_flux, q.rated_voltage_share * voltage / (q.pole_pairs * q.rated_speed))
    turns = flux_linkage / (q.winding_factor * pole_flux)

    # Inset magnets: fundamental permeances of a gap that is wide under the magnets and narrow between them.
    overlap = math.sin(math.pi * q.magnet_arc) / math.pi
    iron_gap = q.carter_factor * gap
    permeance_d = (q.magnet_arc + overlap) / magnet_gap + (1.0 - q.magnet_arc - overlap) / iron_gap
    permeance_q = (q.magnet_arc - overlap) / magnet_gap + (1.0 - q.magnet_arc + overlap) / iron_gap
    # [P] eq. 3.110 with the gap's permeance in place of its inverse width.
    unit = 3.0 * bore * VACUUM_PERMEABILITY * effective_length * (q.winding_factor * turns) ** 2
    unit = unit / (math.pi * q.pole_pairs**2)
    leakage = q.slot_leakage * unit * permeance_d
    frequency_per_speed = q.pole_pairs / (2.0 * math.pi)
    tooth_field, yoke_field = _iron_fields(q, flux_density)
    squared_field_mass = teeth_mass * tooth_field**2 + (yoke_mass) * yoke_field**2
    circuit = MotorCircuit(
        pole_pairs=torch.full_like(bore, float(q.pole_pairs)),
        phase_resistance=q.copper_resistivity * 2.0 * turns * half_turn * 6.0 * turns / copper_area,
        inductance_d=unit * permeance_d + leakage,
        inductance_q=unit * permeance_q + leakage,
        flux_linkage=flux_linkage,
        voltage_limit=torch.full_like(bore, voltage),
        current_limit=math.sqrt(2.0) * q.maximum_electric_loading * math.pi * bore / (6.0 * turns),
        hysteresis=q.hysteresis_loss * frequency_per_speed * squared_field_mass,
        eddy=q.eddy_loss * frequency_per_speed**2 * squared_field_mass,
        bearing_torque=torch.full_like(bore, q.bearing_torque),
        windage=q.windage_coefficient * math.pi * 1.2 * (0.5 * rotor) ** 4 * length,
        stray_share=torch.full_like(bore, q.stray_share),
    )
    return Motor(circuit, q.structure_factor * active, outer, flux_density)


def _iron_fields(q: MotorParameters, flux_density: Tensor) -> tuple[Tensor, Tensor]:
    """Flux densities (...,) T in teeth and yoke, which are sized for the nominal one in the gap."""
    share = flux_density / q.air_gap_flux_density
    return share * q.tooth_flux_density, share * q.yoke_flux_density


def _gap_flux_density(q: MotorParameters, gap: Tensor, slot_depth: Tensor, pole_pitch: Tensor) -> tuple[Tensor, Tensor]:
    """Flux density (...,) T under the magnets, and the gap (...,) m they make with the air, from the magnetic circuit.

    Magnet source = drops across magnet and air gap + teeth + yoke; saturation bends the last two.
    """
    heat = 1.0 + q.remanence_slope * (q.magnet_temperature - 20.0)
    remanence = q.remanence_20 * heat
    relative_permeability = q.remanence_20 / (VACUUM_PERMEABILITY * q.coercivity_20)
    magnet_gap = q.carter_factor * gap + q.magnet_thickness / relative_permeability
    source = remanence * q.magnet_thickness / (VACUUM_PERMEABILITY * relative_permeability)

    # Drops are `line` x B + `power` x B^15; with h = B line/source: h + c h^15 = 1.
    tooth, yoke = (field / q.air_gap_flux_density for field in (q.tooth_flux_density, q.yoke_flux_density))
    linear, bent = MAGNETIZATION_LINE, MAGNETIZATION_POWER
    line = magnet_gap / VACUUM_PERMEABILITY + linear * (tooth * slot_depth + yoke * 0.5 * pole_pitch)
    power = bent * (tooth**15 * slot_depth + yoke**15 * 0.5 * pole_pitch)
    share = source / line
    return share * trinomial_root(power * share**15 / source, 15), magnet_gap
