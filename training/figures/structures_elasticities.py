"""Figure: elasticities of structural mass beside those of the published tables and the scatter between these."""

from typing import Any

from matplotlib.figure import Figure

from lpc_mdo.structures.published_tables import ELASTICITY_INPUTS

LABELS = ("wing area", "aspect ratio", "fuselage length", "battery mass", "cruise speed")
TITLES = {"wing+booms+fuselage": "all three"}
OWN, BAND = "#0072b2", "#f0d9a8"
YEARS = {"2022": ("#d55e00", "v"), "2023": ("#009e73", "s"), "2024": ("#cc79a7", "^")}


def elasticities_figure(replica: dict[str, dict[str, Any]]) -> Figure:
    """One panel a group of the tables; bars at our points: two standard errors. `replica`: that table of a model card."""
    groups = [name for name, row in replica.items() if "published_elasticities" in row]
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    panels = figure.subplots(1, len(groups), sharey=True, sharex=True)
    places = range(len(ELASTICITY_INPUTS))
    for axes, group in zip(panels, groups, strict=True):
        row = replica[group]
        published = row["published_elasticities"]
        for y, name in zip(places, ELASTICITY_INPUTS, strict=True):
            values = [fit[name] for fit in published.values()]
            axes.plot([min(values), max(values)], [y, y], color=BAND, linewidth=9, solid_capstyle="round", zorder=0)
        for year, fit in published.items():
            color, marker = YEARS[year]
            values = [fit[name] for name in ELASTICITY_INPUTS]
            axes.scatter(values, places, color=color, marker=marker, s=26, label=f"published, {year}")
        ours = [row["elasticities"][name] for name in ELASTICITY_INPUTS]
        errors = [2.0 * row["elasticity_standard_errors"][name] for name in ELASTICITY_INPUTS]
        axes.errorbar(ours, places, xerr=errors, color=OWN, fmt="o", ms=5, capsize=2, label="own sizing")
        axes.axvline(0.0, color="black", linewidth=0.8, zorder=0)
        axes.grid(axis="x", linewidth=0.4, alpha=0.5)
        axes.set_title(f"{TITLES.get(group, group)}: {row['baseline_kg']:.0f} kg", fontsize=10)
        axes.set_ylim(len(ELASTICITY_INPUTS) - 0.5, -0.5)
    panels[0].set_yticks(list(places), LABELS)
    figure.supxlabel("elasticity d ln m / d ln x at the baseline", fontsize=10)
    found = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    labels = sorted(found)
    figure.legend(
        [found[label] for label in labels],
        labels,
        loc="outside upper center",
        ncols=len(labels),
        frameon=False,
        fontsize=9,
    )
    return figure
