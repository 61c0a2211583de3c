"""NeuralFoil, an independent network for any section, on the same points as ours: accuracy and speed side by side.

Needs the extra `bench`. NeuralFoil knows no Mach number, so points at Mach 0 alone are compared.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
import torch

from lpc_mdo.airfoils.shape import AirfoilShape, section_coordinates
from lpc_mdo.surrogates.airfoil import AirfoilPolar
from lpc_mdo.training.airfoil import error_figures, error_masks, is_attached, predictions, split
from lpc_mdo.training.polar_data import PolarData

MODEL_SIZES = ("large", "xxxlarge")
BATCH = 20_000  # points of one call, by which the speed is taken


@dataclass(frozen=True)
class Comparison:
    """figures: {points: {model: errors as in the error table}}; speed: {model: evaluations per second in batches}."""

    figures: dict[str, dict[str, dict[str, float]]]
    speed: dict[str, float]


def is_installed() -> bool:
    return find_spec("neuralfoil") is not None


def compare(polar: AirfoilPolar, shape: AirfoilShape, data: PolarData, seed: int) -> Comparison:
    """Errors on the unseen polars at Mach 0 in the attached range, and speed.

    Raises ValueError if NeuralFoil is not installed.
    """
    if not is_installed():
        raise ValueError("NeuralFoil is not installed; pip install 'lpc-mdo[bench]'")
    ours = "this surrogate"
    sizes = {f"NeuralFoil {size}": size for size in MODEL_SIZES}
    figures: dict[str, dict[str, dict[str, float]]] = {}
    for name, mask in error_masks(data, split(data, seed)).items():
        mask = mask & is_attached(data) & (data.mach == 0.0)
        if not name.startswith("unseen_polars") or not mask.any():
            continue
        rows = {ours: predictions(polar, data, mask)}
        query = data.alpha_deg[mask], data.reynolds[mask]
        rows |= {model: coefficients(shape, *query, size) for model, size in sizes.items()}
        figures[name] = {model: error_figures(data, mask, *row) for model, row in rows.items()}
    at_rest = np.resize(np.flatnonzero(data.mach == 0.0), BATCH)
    query = data.alpha_deg[at_rest], data.reynolds[at_rest]
    tensors = torch.deg2rad(torch.tensor(query[0])), torch.tensor(query[1]), torch.zeros(BATCH, dtype=torch.float64)
    speed = {ours: _per_second(lambda: polar(*tensors), 10)}
    speed |= {model: _per_second(lambda s=size: coefficients(shape, *query, s), 1) for model, size in sizes.items()}
    return Comparison(figures, speed)


def coefficients(
    shape: AirfoilShape, alpha_deg: np.ndarray, reynolds: np.ndarray, model_size: str
) -> tuple[np.ndarray, np.ndarray]:
    """Lift and drag coefficient (point,) by NeuralFoil, of the shape that XFOIL was run on."""
    import aerosandbox
    import neuralfoil

    section = aerosandbox.Airfoil(shape.name, coordinates=section_coordinates(shape))
    result = neuralfoil.get_aero_from_airfoil(section, alpha=alpha_deg, Re=reynolds, n_crit=9.0, model_size=model_size)
    return np.asarray(result["CL"]), np.asarray(result["CD"])


def _per_second(function: Callable[[], object], repeats: int) -> float:
    """Evaluations in the quickest of `repeats` batches, after one that warms up."""
    times = []
    for _ in range(1 + repeats):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return BATCH / min(times[1:])
