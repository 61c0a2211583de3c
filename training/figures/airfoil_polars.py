"""Figure: lift and drag of the surrogate over the polars that it was trained on and those that it has not seen."""

import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lpc_mdo.surrogates.airfoil import AirfoilPolar
from lpc_mdo.training.polar_data import PolarData

COLORS = ("#0072B2", "#009E73", "#D55E00", "#CC79A7")  # Okabe and Ito: told apart by colour-blind readers
CURVES = 4  # Reynolds numbers, spread over those of the data


def airfoil_polar_figure(polar: AirfoilPolar, data: PolarData) -> Figure:
    """Points of the data and curves of the model at the lowest Mach number; open symbols were never fitted."""
    figure = Figure(figsize=(10.0, 7.6), layout="constrained")
    lift, drag, polars, around = figure.subplots(2, 2).ravel()
    mach = float(data.mach.min())
    numbers = np.unique(data.reynolds[data.reynolds >= 5e4]) if data.reynolds.max() > 5e4 else np.unique(data.reynolds)
    picked = numbers[np.unique(np.linspace(0, len(numbers) - 2, CURVES).round().astype(int))]
    unseen = set(polar.card["held_out"]["reynolds"])
    alpha = np.linspace(data.alpha_deg.min(), data.alpha_deg.max(), 321)
    for reynolds, color in zip(picked, COLORS, strict=False):
        cl, cd = _model(polar, alpha, reynolds, mach)
        mask = (data.reynolds == reynolds) & (data.mach == mach)
        face = "none" if reynolds in unseen else color
        label = f"Re {reynolds:.3g}" + (", unseen" if reynolds in unseen else "")
        style = {"ls": "", "marker": "o", "ms": 3.5, "color": color, "mfc": face, "mew": 0.8}
        for axes, x, y, points in (
            (lift, alpha, cl, (data.alpha_deg, data.cl)),
            (drag, alpha, cd, (data.alpha_deg, data.cd)),
            (polars, cd, cl, (data.cd, data.cl)),
        ):
            axes.plot(x, y, color=color, lw=1.1)
            axes.plot(points[0][mask], points[1][mask], label=label, **style)
    drag.set_yscale("log")
    polars.set_xscale("log")
    _labels(lift, "angle of attack, deg", "lift coefficient")
    _labels(drag, "angle of attack, deg", "drag coefficient")
    _labels(polars, "drag coefficient", "lift coefficient")
    lift.legend(fontsize=8, frameon=False)
    _full_circle(around, polar, float(picked[-1]), mach)
    figure.suptitle(f"{polar.name}, Mach {mach:g}: XFOIL (points) and surrogate (lines)", fontsize=11)
    return figure


def _full_circle(axes: Axes, polar: AirfoilPolar, reynolds: float, mach: float) -> None:
    alpha = np.linspace(-180.0, 180.0, 1441)
    cl, cd = _model(polar, alpha, reynolds, mach)
    axes.plot(alpha, cl, color="#0072B2", label="lift")
    axes.plot(alpha, cd, color="#D55E00", ls="--", label="drag")
    low, high = polar.blend_deg[:2], polar.blend_deg[2:]
    for ends in (low, high):
        axes.axvspan(*ends, color="0.88", lw=0, label="blend to flat plate" if ends is low else None)
    axes.set_xticks(range(-180, 181, 60))
    _labels(axes, "angle of attack, deg", f"coefficient at Re {reynolds:.2g}")
    axes.legend(fontsize=8, frameon=False)


def _labels(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(lw=0.3, color="0.8")


def _model(polar: AirfoilPolar, alpha_deg: np.ndarray, reynolds: float, mach: float) -> tuple[np.ndarray, np.ndarray]:
    alpha = torch.deg2rad(torch.tensor(alpha_deg))
    cl, cd = polar(alpha, torch.full_like(alpha, reynolds), torch.full_like(alpha, mach))
    return cl.numpy(), cd.numpy()
