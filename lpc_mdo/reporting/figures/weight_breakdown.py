"""Masses by group, before and after."""

from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredRun
from lpc_mdo.reporting.tables import POUNDS_PER_KILOGRAM

TITLE = "Weight breakdown"
CAPTION = "Mass of every group in the initial and the optimized aircraft; the four booms are one group."
NEEDS = ("mass_breakdown_kg",)


def draw(run: StoredRun) -> Figure:
    before, after = (_groups(design["summary"]["mass_breakdown_kg"]) for design in (run.initial, run.optimized))
    names = sorted(after, key=lambda name: before[name])
    figure = style.figure(3.8)
    axes = figure.subplots()
    for offset, masses, color, label in (
        (0.2, before, style.BEFORE, "initial"),
        (-0.2, after, style.AFTER, "optimized"),
    ):
        total = sum(masses.values())
        text = f"{label}: {total:.0f} kg ({total * POUNDS_PER_KILOGRAM:.0f} lb)"
        rows = [i + offset for i in range(len(names))]
        axes.barh(rows, [masses[name] for name in names], height=0.38, color=color, label=text)
    for i, name in enumerate(names):
        change = after[name] - before[name]
        text = f"{after[name]:.0f} kg" + (f" ({change:+.0f})".replace("-", "−") if abs(change) >= 0.5 else "")
        axes.annotate(
            text,
            (max(before[name], after[name]), i),
            xytext=(5, 0),
            textcoords="offset points",
            va="center",
            fontsize=8,
        )
    axes.set_yticks(range(len(names)), [wording.words(name) for name in names])
    axes.set(xlabel="mass, kg", title=TITLE, xlim=(0.0, 1.16 * max(before.values())))
    axes.grid(axis="y", visible=False)
    axes.legend(loc="lower right")
    return figure


def _groups(masses: dict[str, float]) -> dict[str, float]:
    groups = {name: mass for name, mass in masses.items() if not name.startswith("boom_")}
    groups["booms"] = sum(mass for name, mass in masses.items() if name.startswith("boom_"))
    return groups
