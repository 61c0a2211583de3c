"""Electrical power and state of charge over the mission."""

from matplotlib.figure import Figure

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Mission power and state of charge"
CAPTION = (
    "Power drawn from the battery by all motors, constant within a segment, and the state of charge along the flights "
    "and the reserve of the optimized aircraft."
)
NEEDS = ("mission",)


def draw(run: StoredRun) -> Figure:
    segments = run.optimized["mission"]
    times = [0.0]
    for segment in segments:
        times.append(times[-1] + segment["duration_s"] / 60.0)
    figure = style.figure(4.0)
    above, below = figure.subplots(2, 1, sharex=True)
    above.stairs([segment["power_W"] / 1e3 for segment in segments], times, fill=True, color=style.AFTER, alpha=0.3)
    above.stairs([segment["power_W"] / 1e3 for segment in segments], times, color=style.AFTER, linewidth=1.6)
    above.set(ylabel="electrical power, kW", title=TITLE, ylim=(0.0, None))
    charge = [segments[0]["state_of_charge"][0], *(segment["state_of_charge"][1] for segment in segments)]
    below.plot(times, charge, color=style.AFTER)
    below.annotate(
        f"{charge[-1]:.3f}",
        (times[-1], charge[-1]),
        xytext=(2, 4),
        textcoords="offset points",
        color=style.AFTER,
        fontsize=8,
    )
    limit = run.configuration["mission"]["requirements"]["minimum_final_state_of_charge"]
    below.axhline(limit, color=style.ORANGE, linewidth=1.0)
    below.annotate(f"least at the end: {limit:g}", (0.3, limit), color=style.ORANGE, fontsize=8, va="bottom")
    labels: list[tuple[float, str]] = []
    for time, segment in zip(times, segments, strict=False):
        if segment["altitude_m"][0] != segment["altitude_m"][1]:
            continue
        below.axvline(time, color=style.GRID, linewidth=0.8)
        name = wording.words(segment["name"])
        if labels and time - labels[-1][0] < 0.035 * times[-1]:  # too near to stand beside each other
            labels[-1] = (labels[-1][0], f"{labels[-1][1]}, {name}")
        else:
            labels.append((time, name))
    for time, name in labels:
        below.annotate(name, (time, 1.03), fontsize=7.5, rotation=30, va="bottom", annotation_clip=False)
    below.set(
        xlabel="time, min", ylabel="state of charge, –", ylim=(min(0.0, charge[-1]), 1.02), xlim=(0.0, 1.06 * times[-1])
    )
    return figure
