"""What one per cent of a requirement, a bound or a parameter costs: a tornado chart."""

from matplotlib.figure import Figure

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Sensitivities of the optimum"
CAPTION = (
    "Change of the optimized gross mass for one per cent more of a requirement's limit, of a design variable's active "
    "bound, or of a parameter of the vehicle or mission file, by the envelope theorem (the design adapts). Entries "
    "below 0.01 kg are left out."
)
NEEDS = ("sensitivities",)
SMALLEST = 0.01  # kg
COLORS = {"limit": style.ORANGE, "bound": style.GREEN, "parameter": style.AFTER}
SHOWN = 18


def draw(run: StoredRun) -> Figure:
    entries = [entry for entry in run.analysis["sensitivities"] if abs(entry["per_percent"]) >= SMALLEST]
    entries = sorted(entries, key=lambda entry: abs(entry["per_percent"]))[-SHOWN:]
    figure = style.figure(0.24 * len(entries) + 1.1)
    axes = figure.subplots()
    for kind, color in COLORS.items():
        rows = [i for i, entry in enumerate(entries) if entry["kind"] == kind]
        axes.barh(rows, [entries[i]["per_percent"] for i in rows], color=color, height=0.7, label=kind)
    for i, entry in enumerate(entries):
        value = entry["per_percent"]
        axes.annotate(
            f"{value:+.2f} kg".replace("-", "−"),
            (value, i),
            xytext=(4 if value > 0 else -4, 0),
            textcoords="offset points",
            ha="left" if value > 0 else "right",
            va="center",
            fontsize=8,
        )
    axes.axvline(0.0, color=style.INK, linewidth=0.8)
    axes.set_yticks(range(len(entries)), [entry["label"] for entry in entries])
    axes.set(xlabel="change of gross mass for + 1 %, kg", title=TITLE)
    axes.grid(axis="y", visible=False)
    axes.margins(x=0.2)
    axes.legend(loc="lower right")
    return figure
