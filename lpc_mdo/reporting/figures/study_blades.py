"""Blade shapes at both ends of a front over the lift rotors."""

from math import comb
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredStudy

TITLE = "Blade shapes at the ends"
CAPTION = (
    "Chord and twist of the lift rotors at the first and the last point of the front that carry a certificate; one line a "
    "rotor."
)
ENDS = (style.GREEN, style.ORANGE)


def is_drawable(study: StoredStudy) -> bool:
    return study.content["problem"] == "aeroacoustic" and len(_ends(study)) == 2


def _ends(study: StoredStudy) -> list[dict[str, Any]]:
    front = [point for point in study.content["points"] if point["is_on_front"]]
    front.sort(key=lambda point: point["position"][0])
    return [front[0], front[-1]] if len(front) > 1 else []


def draw(study: StoredStudy) -> Figure:
    figure = style.figure(2.8)
    chord, twist = figure.subplots(1, 2)
    fraction = np.linspace(0.0, 1.0, 41)
    for point, color in zip(_ends(study), ENDS, strict=True):
        result = study.results[point["folder"]]
        design = {entry["name"]: np.array(entry["value"]) for entry in result["design_variables"]}
        horizontal, vertical = point["position"]
        label = f"{vertical:.1f} dB(A), figure of merit {horizontal:.3f}"
        for axes, values in ((chord, design["blade_chord"]), (twist, np.degrees(design["blade_twist"]))):
            lines = axes.plot(fraction, bezier(values, fraction).T, color=color, linewidth=1.0, alpha=0.8)
            lines[0].set_label(label)
    chord.set(xlabel="along the blade, root 0, tip 1", ylabel="chord, m", ylim=(0.0, None))
    twist.set(xlabel="along the blade, root 0, tip 1", ylabel="twist, °", ylim=(0.0, None))
    figure.legend(*chord.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def bezier(points: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Curves (curve, at) of control points (curve, k): with no inner knots a B-spline is Bernstein's polynomial."""
    degree = points.shape[-1] - 1
    basis = np.stack([comb(degree, i) * at**i * (1.0 - at) ** (degree - i) for i in range(degree + 1)])
    return points @ basis
