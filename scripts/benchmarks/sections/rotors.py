"""Blade-element momentum theory: loads of nine rotors in three segments and their gradients, beside CCBlade."""

import numpy as np

from benchmarks.sections.cells import difference, megabytes, milliseconds, ratio, runs
from benchmarks.session import Outcome, measure
from benchmarks.sheets import Section, Sheet, Target
from benchmarks.subject import Subject

SUBJECTS = "benchmarks.subjects"
OURS, SURROGATE = "lpc-mdo, formula", "lpc-mdo, polar surrogate"
CCBLADE, SPLINE = "CCBlade, formula", "CCBlade, its spline"
NOTE = (
    "Thrust and torque of every rotor in every segment (28 stations), with their derivatives with respect to chord and twist of "
    "every station. lpc-mdo: one batch, two backward passes. CCBlade (WISDEM): its analytic derivatives, a loop over rotors and "
    "segments. The section's polar is a formula, CCBlade's spline through it, or, for lpc-mdo, the surrogate that the aircraft "
    "model reads (another polar, so not compared). Differences are relative to the largest value, loads and derivatives."
)
TIMES_FASTER = 15.0


def subjects(count: int, segments: int) -> list[Subject]:
    size = {"count": count, "segments": segments}
    ours, theirs = f"{SUBJECTS}.rotors_lpc_mdo:prepare", f"{SUBJECTS}.rotors_ccblade:prepare"
    return [
        Subject(OURS, ours, size | {"polar": "analytic"}),
        Subject(SURROGATE, ours, size | {"polar": "surrogate"}),
        Subject(CCBLADE, theirs, size | {"polar": "analytic"}, "wisdem"),
        Subject(SPLINE, theirs, size | {"polar": "spline"}, "wisdem"),
    ]


def run(is_quick: bool) -> Section:
    outcomes = measure(subjects(9, 3), 15, 6.0 if is_quick else 20.0)
    ours, _, formula, spline = outcomes  # the spline is what CCBlade comes with
    rows = tuple((outcome.subject.label, *_cells(outcome, ours)) for outcome in outcomes)
    promise = f"9 rotors in 3 segments: at least {TIMES_FASTER:g} times as fast as CCBlade"
    if ours.absence or spline.absence:
        target = Target(promise, "", None)
    else:
        faster, bare = (peer.median / ours.median for peer in (spline, formula))
        words = f"{faster:.3g} times (a formula in place of its spline: {bare:.3g})"
        target = Target(promise, words, faster >= TIMES_FASTER)
    columns = ("code, polar", "ms", "times ours", "peak MB", "loads off", "derivatives off", "runs")
    return Section((Sheet("Rotors, loads and gradients", columns, rows, (NOTE,)),), (target,))


def _cells(outcome: Outcome, ours: Outcome) -> tuple[str, ...]:
    off = ("", "")
    if outcome.subject.label in (CCBLADE, SPLINE) and not outcome.absence and not ours.absence:
        found = differences(outcome, ours)
        off = tuple(
            difference(max(v for k, v in found.items() if ("_by_" in k) is is_slope)) for is_slope in (False, True)
        )
    return milliseconds(outcome), ratio(outcome, ours), megabytes(outcome), *off, runs(outcome)


def differences(outcome: Outcome, ours: Outcome) -> dict[str, float]:
    """Largest difference of each result over its largest value."""
    return {
        name: float(np.abs(np.subtract(theirs, ours.check[name])).max() / np.abs(theirs).max())
        for name, theirs in outcome.check.items()
    }
