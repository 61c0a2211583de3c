"""The structural surrogate beside the samples that it was made from, and beside those that it has never seen."""

from functools import cache
from typing import Any

import numpy as np

from lpc_mdo.structures.published_tables import GROUPS
from lpc_mdo.structures.samples import Samples, read_samples
from lpc_mdo.structures.shipped import NAME, SHIPPED, structural_inputs
from lpc_mdo.surrogates.structural_mass import COMPONENTS, StructuralMassSurrogate, load_structural_mass

SETS = {  # prefix of the samples' ids, in drawing order
    "working": "fitted",
    "replica": "replica ±10 %, not fitted",
    "test": "test set, not fitted",
}
TOGETHER = "wing+booms+fuselage"


def sample_data(samples: Samples, surrogate: StructuralMassSurrogate) -> list[dict[str, Any]]:
    """Mass kg and x m of the common centre of gravity of wing, booms and fuselage, (sample,) by set: as sized, predicted.

    Samples of one's own, whose ids name no set, were all fitted.
    """
    usable, _ = samples.usable()
    parts = {label: usable.named(prefix) for prefix, label in SETS.items()}
    if not parts[SETS["working"]].ids:
        parts = {SETS["working"]: usable}
    return [{"name": label} | _both(part, surrogate) for label, part in parts.items() if part.ids]


@cache
def shipped_sample_data() -> list[dict[str, Any]]:
    """Of the surrogate and the samples that come with the package."""
    samples, _ = read_samples(SHIPPED / f"{NAME}.csv.gz")
    return sample_data(samples, load_structural_mass("open"))


def _both(part: Samples, surrogate: StructuralMassSurrogate) -> dict[str, Any]:
    found = surrogate(structural_inputs(part.inputs))
    sized = _sums(part.targets[:, :, 0], part.targets[:, :, 1])
    predicted = _sums(found.mass.numpy(), found.center_of_gravity[..., 0].numpy())
    return {
        "sized": dict(zip(_QUANTITIES, sized, strict=True)),
        "predicted": dict(zip(_QUANTITIES, predicted, strict=True)),
    }


_QUANTITIES = ("mass_kg", "center_of_gravity_m")


def _sums(mass: np.ndarray, cg_x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    keep = [COMPONENTS.index(name) for name in GROUPS[TOGETHER]]
    total = mass[:, keep].sum(1)
    return total, (mass[:, keep] * cg_x[:, keep]).sum(1) / total
