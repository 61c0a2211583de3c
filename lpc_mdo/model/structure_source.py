"""The structural surrogate that a vehicle file names, and the factors on its masses."""

import torch
from torch import Tensor

from lpc_mdo.config import Vehicle
from lpc_mdo.surrogates.structural_mass import StructuralMassSurrogate, load_structural_mass

BOOM_PLACES = {"inner": 0.335, "outer": 0.742}  # of the half span: hubs of the shipped vehicle file


def structural_surrogate(vehicle: Vehicle) -> StructuralMassSurrogate:
    """Raises ValueError if its files are missing or damaged."""
    return load_structural_mass(vehicle.structure.source, vehicle.structure.surrogate_file or None)


def structural_calibration(vehicle: Vehicle) -> Tensor:
    """Factors (component,) on the structural masses, in the surrogate's order of components."""
    surrogate, structure = structural_surrogate(vehicle), vehicle.structure
    level = surrogate.calibration if structure.is_calibrated_to_published else torch.ones_like(surrogate.calibration)
    return structure.calibration_factor * level * boom_shares(vehicle, surrogate.components)


def boom_shares(vehicle: Vehicle, components: tuple[str, ...]) -> Tensor:
    """Of each component's mass (component,) what the aircraft has: one, but of booms half for every rotor that they carry.

    The regressions know four booms with two rotors each. A rotor elsewhere counts with the boom whose place along the
    span is nearest: ASSUMED, as no sized structures of other layouts are known.
    """
    shares = {name: 0.0 if name.startswith("boom_") else 1.0 for name in components}
    half_span = 0.5 * (vehicle.wing.area * vehicle.wing.aspect_ratio) ** 0.5
    for rotor in vehicle.lift_rotors:
        side, along = "port" if rotor.hub[1] < 0.0 else "starboard", abs(rotor.hub[1]) / half_span
        place = min(BOOM_PLACES, key=lambda name: abs(BOOM_PLACES[name] - along))
        shares[f"boom_{place}_{side}"] += 0.5
    return torch.tensor(list(shares.values()), dtype=torch.float64)
