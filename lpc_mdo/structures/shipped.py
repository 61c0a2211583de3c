"""The sized samples that come with the package."""

import json
from importlib import resources
from pathlib import Path

import numpy as np
import torch

from lpc_mdo.structures.samples import Samples, read_samples
from lpc_mdo.surrogates.structural_mass import StructuralInputs

BASELINE = (19.536, 12.1423, 9.144, 1213.48, 57.618, 3.6706, 2.54)  # inputs of the published regressions
SHIPPED = Path(str(resources.files("lpc_mdo"))) / "training" / "data"
NAME = "structures_open"


def structural_inputs(columns: np.ndarray) -> StructuralInputs:
    """From columns (sample, 7) in the order of `samples.INPUTS`."""
    return StructuralInputs(*torch.tensor(columns, dtype=torch.float64).unbind(-1))


def read_open(folder: Path) -> tuple[Samples, str]:
    """The stored samples and their hash. Raises ValueError if file and card disagree."""
    samples, digest = read_samples(folder / f"{NAME}.csv.gz")
    card = json.loads((folder / f"{NAME}.json").read_text(encoding="utf-8"))
    if digest != card["sha256"]:
        raise ValueError(f"{NAME}.csv.gz: sha256 = {digest} is not allowed; its card says {card['sha256']}")
    return samples, digest
