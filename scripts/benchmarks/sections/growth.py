"""How cost grows with variables, designs in a batch, rotors, segments and panels."""

import math

from benchmarks.sections.cells import megabytes, milliseconds, ratio, runs
from benchmarks.sections.wing import MESHES
from benchmarks.session import Outcome, measure
from benchmarks.sheets import Section, Sheet, Target
from benchmarks.subject import Subject

SUBJECTS = "benchmarks.subjects"
CONTROL_POINTS = ((4, 2), (8, 8), (28, 28), (53, 52))  # of twist and chord of every blade
BATCHES, QUICK_BATCHES = (1, 4, 16, 64, 128, 256), (1, 16, 256)
ROTORS, SEGMENTS = (1, 9, 36, 144), (1, 3, 12, 48)
LARGEST_RATIO = 1.1


def run(is_quick: bool) -> Section:
    variables, target = _variables(is_quick)
    sheets = (variables, _batches(is_quick), _rotors("count", ROTORS), _rotors("segments", SEGMENTS), _panels())
    return Section(sheets, (target,))


def _variables(is_quick: bool) -> tuple[Sheet, Target]:
    subjects = [
        Subject(f"{twist}, {chord}", f"{SUBJECTS}.model:prepare", {"twist_points": twist, "chord_points": chord})
        for twist, chord in CONTROL_POINTS
    ]
    outcomes = measure(subjects, 15 if is_quick else 60, 10.0)
    first, last = outcomes[0], outcomes[-1]
    rows = tuple(
        (
            str(o.check.get("variables", "")),
            o.subject.label,
            milliseconds(o),
            ratio(o, first),
            _offset(o, first),
            runs(o),
        )
        for o in outcomes
    )
    is_measured = not (first.absence or last.absence)
    target = Target(
        f"value and gradient at 1000 variables: at most {LARGEST_RATIO} times that at 109",
        ratio(last, first),
        last.median <= LARGEST_RATIO * first.median if is_measured else None,
    )
    note = (
        "The same aircraft with finer control points along all nine blades (twist, chord); results off: sound level and "
        "state of charge from the first row's, relative. "
        "Beyond 28, the number of stations, control points have no effect of their own; the last row shows the cost alone."
    )
    columns = ("variables", "points a blade", "ms", "times the first", "results off", "runs")
    return Sheet("Growth with the number of variables, value and gradient", columns, rows, (note,)), target


def _offset(outcome: Outcome, first: Outcome) -> str:
    if outcome.absence or first.absence:
        return ""
    pairs = zip(outcome.check["results"], first.check["results"], strict=True)
    return f"{max(abs(ours / theirs - 1.0) for ours, theirs in pairs):.0e}"


def _batches(is_quick: bool) -> Sheet:
    counts = QUICK_BATCHES if is_quick else BATCHES
    subjects = [Subject(str(count), f"{SUBJECTS}.model:prepare", {"designs": count}) for count in counts]
    outcomes = measure(subjects, 7, 6.0)
    rows = tuple(
        (o.subject.label, milliseconds(o), *_per_design(o, count, outcomes[0]), megabytes(o), runs(o))
        for o, count in zip(outcomes, counts, strict=True)
    )
    columns = ("designs", "ms", "ms a design", "of one alone", "peak MB", "runs")
    return Sheet("Growth with designs in a batch, value and gradient of the whole model", columns, rows)


def _per_design(outcome: Outcome, count: int, alone: Outcome) -> tuple[str, str]:
    if outcome.absence or alone.absence:
        return "", ""
    return f"{1e3 * outcome.median / count:.3g}", f"{outcome.median / count / alone.median:.2f}"


def _rotors(name: str, counts: tuple[int, ...]) -> Sheet:
    base = {"count": 9, "segments": 3, "polar": "surrogate"}
    subjects = [Subject(str(count), f"{SUBJECTS}.rotors_lpc_mdo:prepare", base | {name: count}) for count in counts]
    title, other = ("rotors", "3 segments") if name == "count" else ("segments", "9 rotors")
    return _powers(title, f"Growth with {title} ({other}, 28 stations), loads and gradients", subjects, counts)


def _panels() -> Sheet:
    subjects = [
        Subject(str(panels), f"{SUBJECTS}.wing_lpc_mdo:prepare", {"chordwise": chordwise, "half": half})
        for panels, (chordwise, half) in MESHES.items()
    ]
    return _powers("panels", "Growth with panels, value and gradient of the vortex lattice", subjects, tuple(MESHES))


def _powers(column: str, title: str, subjects: list[Subject], counts: tuple[int, ...]) -> Sheet:
    """With the exponent of growth from the row above."""
    outcomes = measure(subjects, 9, 4.0)
    rows = []
    for i, (outcome, count) in enumerate(zip(outcomes, counts, strict=True)):
        before = outcomes[i - 1]
        exponent = ""
        if i and not outcome.absence and not before.absence:
            exponent = f"{math.log(outcome.median / before.median) / math.log(count / counts[i - 1]):.2f}"
        rows.append((str(count), milliseconds(outcome), exponent, megabytes(outcome), runs(outcome)))
    return Sheet(title, (column, "ms", "exponent", "peak MB", "runs"), tuple(rows))
