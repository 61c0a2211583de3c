"""The structural surrogate that a vehicle file names, and the factors on its masses."""

import torch
from torch import Tensor

from lpc_mdo.config import Vehicle
from surrogates.structural_mass import StructuralMassSurrogate, load_structural_mass


def structural_surrogate(vehicle: Vehicle) -> StructuralMassSurrogate:
    """Raises ValueError if its files are missing or damaged."""
    return load_structural_mass(vehicle.structure.source, vehicle.structure.surrogate_file or None)


def structural_calibration(vehicle: Vehicle) -> Tensor:
    """Factors (component,) on the structural masses, in the surrogate's order of components."""
    surrogate, structure = structural_surrogate(vehicle), vehicle.structure
    level = surrogate.calibration if structure.is_calibrated_to_published else torch.ones_like(surrogate.calibration)
    return structure.calibration_factor * level
