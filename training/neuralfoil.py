"""NeuralFoil, an independent network for any section, on the same points as ours: accuracy and speed side by side.

Needs the extra `bench`. NeuralFoil knows no Mach number, so points at Mach 0 alone are compared.
"""

import time
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from surrogates.airfoil import AirfoilPolar
from training.airfoil import error_figures, error_masks, is_attached, predictions, split
from training.airfoil_shape import AirfoilShape, section_coordinates
from training.polar_data import PolarData

MODEL_SIZES = ("large", "xxxlarge")
BATCH = 50_000  # points of one call, of which the speed is taken


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
    ours, speed = "this surrogate", {}
    figures: dict[str, dict[str, dict[str, float]]] = {}
    for name, mask in error_masks(data, split(data, seed)).items():
        mask = mask & is_attached(data) & (data.mach == 0.0)
        if not name.startswith("unseen_polars") or not mask.any():
            continue
        rows = {ours: predictions(polar, data, mask)}
        rows |= {f"NeuralFoil {size}": _coefficients(shape, data, mask, size) for size in MODEL_SIZES}
        figures[name] = {model: error_figures(data, mask, *row) for model, row in rows.items()}
    repeated = np.resize(np.flatnonzero(data.mach == 0.0), BATCH)
    speed[ours] = _per_second(lambda: predictions(polar, data, repeated))
    for size in MODEL_SIZES:
        speed[f"NeuralFoil {size}"] = _per_second(lambda size=size: _coefficients(shape, data, repeated, size))
    return Comparison(figures, speed)


def _coefficients(shape: AirfoilShape, data: PolarData, mask: np.ndarray, size: str) -> tuple[np.ndarray, np.ndarray]:
    import aerosandbox
    import neuralfoil

    section = aerosandbox.Airfoil(shape.name, coordinates=section_coordinates(shape))
    result = neuralfoil.get_aero_from_airfoil(
        section, alpha=data.alpha_deg[mask], Re=data.reynolds[mask], n_crit=9.0, model_size=size
    )
    return np.asarray(result["CL"]), np.asarray(result["CD"])


def _per_second(function) -> float:
    function()
    begin = time.perf_counter()
    function()
    return BATCH / (time.perf_counter() - begin)
