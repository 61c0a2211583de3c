"""Figure: where the surrogate is how wrong, over angle of attack, Reynolds and Mach number."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from lpc_mdo.surrogates.airfoil import AirfoilPolar
from lpc_mdo.training.airfoil import predictions
from lpc_mdo.training.polar_data import PolarData


def airfoil_error_figure(polar: AirfoilPolar, data: PolarData) -> Figure:
    """Above: mean error of each Reynolds number and angle over the Mach numbers; below: over Mach number and angle at
    Re >= 2e5. Arrows mark the Reynolds and Mach numbers that were never fitted."""
    cl, cd = predictions(polar, data, np.ones(len(data.cl), dtype=bool))
    fields = (
        ("lift coefficient, absolute error", np.abs(cl - data.cl), LogNorm(1e-3, 1e-1)),
        ("drag coefficient, error in %", 100.0 * np.abs(cd / data.cd - 1.0), LogNorm(0.1, 10.0)),
    )
    figure = Figure(figsize=(10.0, 7.6), layout="constrained")
    grid = figure.subplots(2, 2, sharex=True)
    held_out, usual = polar.card["held_out"], data.reynolds >= 2e5
    for column, (title, error, norm) in enumerate(fields):
        top, bottom = grid[:, column]
        image = _map(top, data.alpha_deg, data.reynolds, error, norm, held_out["reynolds"])
        top.set_title(title, fontsize=10)
        top.set_ylabel("Reynolds number, all Mach numbers")
        if usual.any():
            _map(bottom, data.alpha_deg[usual], data.mach[usual], error[usual], norm, held_out["mach"])
        bottom.set_ylabel("Mach number, Re ≥ 2e5")
        bottom.set_xlabel("angle of attack, deg")
        figure.colorbar(image, ax=[top, bottom], extend="both", location="bottom", shrink=0.8, aspect=40)
    figure.suptitle(f"{polar.name}: error against the polars; ▸ = never fitted", fontsize=11)
    return figure


def _map(
    axes: Axes, angles: np.ndarray, values: np.ndarray, error: np.ndarray, norm: LogNorm, unseen: list[float]
) -> QuadMesh:
    """Mean error by angle (columns) and value (rows); the rows are evenly spaced and named."""
    columns, rows = np.unique(angles), np.unique(values)
    total, count = np.zeros((2, len(rows), len(columns)))
    place = np.searchsorted(rows, values), np.searchsorted(columns, angles)
    np.add.at(total, place, error)
    np.add.at(count, place, 1.0)
    mean = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0)
    image = axes.pcolormesh(columns, np.arange(len(rows)), mean, norm=norm, cmap="cividis", shading="nearest")
    labels = [("▸ " if value in unseen else "") + f"{value:.3g}" for value in rows]
    axes.set_yticks(np.arange(len(rows)), labels, fontsize=8)
    for angle in (-6.0, 12.0):
        axes.axvline(angle, color="white", lw=0.8, ls=":")
    return image
