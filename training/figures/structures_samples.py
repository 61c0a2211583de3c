"""Figure: prediction against sample for wing, booms and fuselage together, as the published study shows them."""

import numpy as np
from matplotlib.figure import Figure

from surrogates.structural_mass import COMPONENTS, StructuralMassSurrogate
from training.published_tables import GROUPS
from training.samples import Samples
from training.structures import structural_inputs

# Sets in drawing order: prefix of their ids, label, colour (Okabe and Ito), marker, size.
SETS = (
    ("working", "fitted", "#999999", "o", 12),
    ("replica", "replica ±10 %, not fitted", "#e69f00", "s", 10),
    ("test", "test set, not fitted", "#0072b2", "^", 16),
)


def _sums(mass: np.ndarray, cg_x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mass and common x of the centre of gravity (sample,) of wing, booms and fuselage."""
    keep = [COMPONENTS.index(name) for name in GROUPS["wing+booms+fuselage"]]
    total = mass[:, keep].sum(1)
    return total, (mass[:, keep] * cg_x[:, keep]).sum(1) / total


def samples_figure(samples: Samples, surrogate: StructuralMassSurrogate) -> Figure:
    """Above: prediction over sample; below: their difference. Without a working set, all samples were fitted."""
    figure = Figure(figsize=(8.0, 6.0), layout="constrained")
    grid = figure.subplots(2, 2, sharex="col", height_ratios=(2.0, 1.0))
    usable, _ = samples.usable()
    sets = [(usable.named(prefix), *style) for prefix, *style in SETS]
    if not sets[0][0].ids:
        sets = [(usable, *SETS[0][1:])]
    for part, label, color, marker, size in sets:
        if not part.ids:
            continue
        found = surrogate(structural_inputs(part.inputs))
        theirs = _sums(part.targets[:, :, 0], part.targets[:, :, 1])
        ours = _sums(found.mass.numpy(), found.center_of_gravity[..., 0].numpy())
        for column, (x, y) in enumerate(zip(theirs, ours, strict=True)):
            style = {"s": size, "color": color, "marker": marker, "linewidths": 0.0, "alpha": 0.8}
            grid[0, column].scatter(x, y, label=label, **style)
            grid[1, column].scatter(x, (y - x) * (1.0, 1e3)[column], **style)
    names = (("mass", "kg", "kg"), ("centre of gravity, x", "m", "mm"))
    for column, (name, unit, fine) in enumerate(names):
        top, bottom = grid[:, column]
        low, high = top.get_xlim()
        top.plot([low, high], [low, high], color="black", linewidth=0.8, zorder=0)
        top.set_title(f"wing, booms and fuselage: {name}", fontsize=10)
        top.set_ylabel(f"surrogate, {unit}")
        bottom.axhline(0.0, color="black", linewidth=0.8, zorder=0)
        bottom.set_ylabel(f"difference, {fine}")
        bottom.set_xlabel(f"sized sample, {unit}")
        for axes in (top, bottom):
            axes.grid(linewidth=0.4, alpha=0.5)
    grid[0, 0].legend(fontsize=9, frameon=False, markerscale=1.5)
    return figure
