"""The whole model: value and gradient of the 109-variable problem, and where they spend their time."""

from benchmarks.sections.cells import megabytes, milliseconds, ratio, runs
from benchmarks.session import Outcome, measure
from benchmarks.sheets import Section, Sheet, Target
from benchmarks.subject import Subject

TARGET = "benchmarks.subjects"
LONGEST = 0.025  # s


def run(is_quick: bool) -> Section:
    value, gradient = measure(
        [
            Subject("value", f"{TARGET}.model:prepare", {"has_gradient": False}),
            Subject("value and gradient", f"{TARGET}.model:prepare"),
        ],
        15,
        6.0,
    )
    rows = tuple((o.subject.label, milliseconds(o), ratio(o, value), megabytes(o), runs(o)) for o in (value, gradient))
    columns = ("evaluation", "ms", "times the value", "peak MB", "runs")
    sheet = Sheet("Whole model, 109 variables", columns, rows)
    promise = f"whole model, value and gradient: at most {1e3 * LONGEST:g} ms"
    target = Target(promise, f"{milliseconds(gradient)} ms", None if gradient.absence else gradient.median <= LONGEST)
    return Section((sheet, *profile_sheets()[:1]), (target,))


def profile_sheets() -> tuple[Sheet, Sheet]:
    """By discipline, and by operator. Raises RuntimeError if the profile could not be made."""
    (outcome,) = measure([Subject("profile", f"{TARGET}.profile:prepare")], 1, 0.0)
    if outcome.absence:
        raise RuntimeError(f"profile {outcome.absence}")
    return _by_discipline(outcome), _by_operator(outcome)


def _by_discipline(outcome: Outcome) -> Sheet:
    parts = outcome.check["disciplines"]
    time = {phase: sum(part.get(f"{phase}_s", 0.0) for part in parts.values()) for phase in ("forward", "backward")}
    calls = {phase: sum(part.get(f"{phase}_calls", 0.0) for part in parts.values()) for phase in time}
    rows = [
        (
            name,
            *(f"{100.0 * part.get(f'{phase}_s', 0.0) / time[phase]:.0f}" for phase in time),
            *(f"{part.get(f'{phase}_calls', 0.0):.0f}" for phase in time),
        )
        for name, part in parts.items()
    ]
    rows.append(
        ("all", *(f"{1e3 * time[phase]:.3g} ms" for phase in time), *(f"{calls[phase]:.0f}" for phase in calls))
    )
    columns = ("discipline", "forward %", "backward %", "ATen calls forward", "ATen calls backward")
    note = "Shares of the time under the profiler, which adds to every operator; calls inside others are counted."
    return Sheet("Whole model by discipline", columns, tuple(rows), (note,))


def _by_operator(outcome: Outcome) -> Sheet:
    rows = tuple((name, f"{calls:.0f}", f"{1e3 * seconds:.2f}") for name, calls, seconds in outcome.check["operators"])
    columns = ("operator", "calls", "ms in itself, profiled")
    return Sheet("Value and gradient of the whole model by operator", columns, rows)
