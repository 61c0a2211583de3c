"""Vortex lattices: induced drag of a wing and its gradient, this package beside AeroSandbox and OpenAerostruct."""

from typing import Any

import numpy as np

from benchmarks.sections.cells import difference, megabytes, milliseconds, ratio, runs
from benchmarks.session import Outcome, measure
from benchmarks.sheets import Section, Sheet, Target
from benchmarks.subject import Subject

SUBJECTS = "benchmarks.subjects"
MESHES = {60: (3, 10), 240: (6, 20), 960: (12, 40), 2000: (20, 50)}  # panels: chordwise, across a half span
OURS, HALF, AEROSANDBOX, OPENAEROSTRUCT = "lpc-mdo", "lpc-mdo, half model", "AeroSandbox", "OpenAerostruct"
VALUE_ONLY, ANEW = "AeroSandbox, value alone", "AeroSandbox, function included"
LARGEST_QUICK = {AEROSANDBOX: 960, VALUE_ONLY: 960, ANEW: 960, OPENAEROSTRUCT: 240}
LARGEST = {OPENAEROSTRUCT: (960, "it would need some 20 GB"), ANEW: (960, "it would take a minute a run")}
NOTE = (
    "Value and gradient of the induced drag of one flat, tapered wing (whole span, uniform mesh) with respect to 13 variables: "
    "chord and twist of six sections, angle of attack. lpc-mdo: reverse mode, one backward pass; 'half model': the same wing by "
    "its starboard half and a mirror image, which AeroSandbox does not offer. AeroSandbox: CasADi's reverse "
    "mode, the function built beforehand and not timed; 'function included': built for every run; 'value alone': its NumPy path without gradient. OpenAerostruct: "
    "run_model and compute_totals (adjoint). Differences from lpc-mdo are relative, of gradients the norm; lpc-mdo's wake lies "
    "along the stream, as OpenAerostruct's, or in the wing's plane, as AeroSandbox's, whose straight legs from inside a twisted "
    "surface are another discretization (twist gradients differ, most at the tip)."
)
TIMES_FASTER = {60: 1.0, 240: 10.0, 960: 20.0}
LONGEST, MOST_MEMORY = 1.5, 1e9  # s, bytes at 2000 panels


def subjects(chordwise: int, half: int) -> dict[str, Subject]:
    arguments = {"chordwise": chordwise, "half": half}
    sandbox = f"{SUBJECTS}.wing_aerosandbox"
    return {
        OURS: Subject(OURS, f"{SUBJECTS}.wing_lpc_mdo:prepare", arguments),
        HALF: Subject(HALF, f"{SUBJECTS}.wing_lpc_mdo:prepare", arguments | {"is_symmetric": True}),
        AEROSANDBOX: Subject(AEROSANDBOX, f"{sandbox}:prepare", arguments, "aerosandbox"),
        ANEW: Subject(ANEW, f"{sandbox}:prepare_anew", arguments, "aerosandbox"),
        VALUE_ONLY: Subject(VALUE_ONLY, f"{sandbox}:prepare_value", arguments, "aerosandbox"),
        OPENAEROSTRUCT: Subject(OPENAEROSTRUCT, f"{SUBJECTS}.wing_openaerostruct:prepare", arguments, "openaerostruct"),
    }


def run(is_quick: bool) -> Section:
    rows, targets = [], []
    for panels, mesh in MESHES.items():
        chosen = subjects(*mesh)
        left_out = {name: reason for name in chosen if (reason := _reason(name, panels, is_quick))}
        kept = [subject for name, subject in chosen.items() if name not in left_out]
        outcomes = {o.subject.label: o for o in measure(kept, 15, 6.0 if is_quick else 40.0)}
        for name in chosen:
            if name in left_out:
                rows.append((str(panels), name, left_out[name], *[""] * 6))
            else:
                rows.append((str(panels), name, *_cells(outcomes[name], outcomes[OURS])))
        targets += _targets(panels, outcomes)
    columns = ("panels", "code", "ms", "times ours", "peak MB", "lift off", "drag off", "gradient off", "runs")
    return Section((Sheet("Vortex lattice, value and gradient", columns, tuple(rows), (NOTE,)),), tuple(targets))


def _reason(name: str, panels: int, is_quick: bool) -> str:
    """Why a code is not measured at this size; empty if it is."""
    largest, why = LARGEST.get(name, (panels, ""))
    if panels > largest:
        return f"left out: {why}"
    return "left out by --quick" if is_quick and panels > LARGEST_QUICK.get(name, panels) else ""


def _cells(outcome: Outcome, ours: Outcome) -> tuple[str, ...]:
    off = ("", "", "")
    if outcome is not ours and not outcome.absence and not ours.absence:
        off = tuple(map(difference, differences(outcome, ours)))
        off = (*off, "") if len(off) == 2 else off
    timing = milliseconds(outcome), ratio(outcome, ours), megabytes(outcome)
    return (*timing, *off, runs(outcome))


def differences(outcome: Outcome, ours: Outcome) -> list[float]:
    """Of lift, drag and, if the code gives it, gradient, relative to ours with the same wake."""
    label = outcome.subject.label
    mine: dict[str, Any] = ours.check["plane" if label in (AEROSANDBOX, ANEW, VALUE_ONLY) else "stream"]
    others = outcome.check["stream"] if label == HALF else outcome.check
    return [
        float(np.linalg.norm(np.subtract(value, mine[name])) / np.linalg.norm(mine[name]))
        for name, value in others.items()
    ]


def _targets(panels: int, outcomes: dict[str, Outcome]) -> list[Target]:
    ours, peer = outcomes[OURS], outcomes.get(AEROSANDBOX)
    found = []
    if panels in TIMES_FASTER:
        least = TIMES_FASTER[panels]
        promise = f"vortex lattice, {panels} panels: at least {least:g} times as fast as AeroSandbox"
        if peer is None or peer.absence or ours.absence:
            found.append(Target(promise, "", None))
        else:
            faster, half = (peer.median / outcomes[name].median for name in (OURS, HALF))
            anew = outcomes[ANEW].median / ours.median
            words = f"{faster:.3g} times (half model {half:.3g}; its function included {anew:.3g})"
            found.append(Target(promise, words, faster >= least))
    if panels == max(MESHES):
        promise = f"vortex lattice, {panels} panels: at most {LONGEST} s and {MOST_MEMORY / 1e9:g} GB"
        is_met = None if ours.absence else ours.median <= LONGEST and ours.peak < MOST_MEMORY
        measured = "" if ours.absence else f"{ours.median:.2f} s, {ours.peak / 1e9:.2f} GB"
        found.append(Target(promise, measured, is_met))
    return found
