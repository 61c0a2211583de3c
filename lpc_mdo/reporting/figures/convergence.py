"""The optimizer at work: objective, violation and stationarity over the evaluations."""

from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Convergence of the optimizer"
CAPTION = (
    "Above: the objective at every design that the search evaluated. Below: largest violation and stationarity after every "
    "iteration, in the solver's scaling, with their tolerances (dashed), over all evaluations, those of whole batches for "
    "second derivatives included."
)
NEEDS = ("evaluations", "history")


def draw(run: StoredRun) -> Figure:
    objective = run.result["objective"]
    column = f"{objective['name']}_{objective['unit']}"
    figure = style.figure(4.2)
    above, below = figure.subplots(2, 1)
    values = [float(record[column]) for record in run.evaluations]
    above.plot([int(record["evaluation"]) for record in run.evaluations], values, color=style.AFTER, linewidth=1.1)
    at = [int(record["evaluations"]) for record in run.history]
    unit = "" if objective["unit"] == "1" else f", {objective['unit']}"
    above.set(xlabel="design evaluated", ylabel=wording.words(objective["name"]) + unit, title=TITLE)
    tolerance = run.result["certificate"]["tolerance"]
    for name, key, color in (("violation", "feasibility", style.ORANGE), ("stationarity", "stationarity", style.GREEN)):
        known = [(x, float(record[name])) for x, record in zip(at, run.history, strict=True)]
        known = [(x, y) for x, y in known if y > 0.0]
        if known:
            below.semilogy(*zip(*known, strict=True), "o-", color=color, markersize=3.5)
            style.label_end(below, *known[-1], name, color)
        below.axhline(tolerance[key], color=color, linestyle="--", linewidth=0.9)
    below.set(xlabel="evaluation", ylabel="scaled, –")
    below.margins(x=0.12)
    return figure
