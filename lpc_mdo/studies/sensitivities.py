"""`lpc-mdo sensitivities RUN`: what the stored optimum answers to, and with --verify, optimized again."""

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.box import SIMPLE
from rich.table import Table
from torch import Tensor

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.write import locked, write_atomically
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.problems.choice import chosen_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.result_file import configuration_sha256
from lpc_mdo.reporting.stored import StoredRun, read_run
from lpc_mdo.reporting.terminal import terminal
from lpc_mdo.stored import analysis, configuration, result
from lpc_mdo.stored.configuration import read_configuration
from lpc_mdo.stored.designs import multipliers_by_row, scaled_design
from lpc_mdo.studies.points import multipliers_of
from lpc_mdo.studies.reoptimization import CHECKED, RESOLUTION, SHARE, Checked, check, gross_weight_changes

FILE = "sensitivities.json"
SCHEMA = "lpc-mdo/sensitivities/1"
SHOWN_CHANGES = 3
APART = 0.01  # of the larger one: from here on both sides of a sensitivity are told


def show(folder: Path) -> int:
    """Print the stored answers of the envelope theorem, the largest first; returns the exit code."""
    run = read_run(folder)
    _require_gross_weight(run)
    if "sensitivities" not in run.analysis:
        raise ConfigurationError(f"{run.folder / analysis.FILE}: sensitivities is missing.")
    unit = run.result["objective"]["unit"]
    table = Table("for 1 % more of", "kind", f"{unit} by the envelope theorem", box=SIMPLE)
    for entry in sorted(run.analysis["sensitivities"], key=lambda entry: -abs(entry["per_percent"])):
        table.add_row(entry["label"], entry["kind"], f"{entry['per_percent']:+.4f}")
    terminal().print(table)
    return 0


@one_thread()
def verify(folder: Path, labels: Sequence[str]) -> int:
    """Optimize again around the stored optimum, print and store the comparison; 1 if an optimum was not certified."""
    started, run = time.monotonic(), read_run(folder)
    with locked(folder):
        return _verify(run, labels, started)


def _verify(run: StoredRun, labels: Sequence[str], started: float) -> int:
    folder = run.folder
    problem, x, multipliers = _optimum(run)
    changes = gross_weight_changes(problem)
    if unknown := [label for label in labels if label not in changes]:
        raise ConfigurationError(f"--of {unknown[0]!r} is not allowed; it must be one of {', '.join(changes)}.")
    console, found = terminal(), []
    for checked in check(
        problem, x, multipliers, {label: changes[label] for label in labels or filter(changes.__contains__, CHECKED)}
    ):
        found.append(checked)
        console.print(f"{checked.label}: {_outcome(checked)}", soft_wrap=True, highlight=False)
    content = {"schema": SCHEMA, "share": SHARE, "unit": problem.objective.unit, "entries": [_stored(c) for c in found]}
    write_atomically(folder / FILE, json.dumps(content, indent=1, allow_nan=False) + "\n")
    console.print(_table(found, problem.objective.unit))
    for checked in found:
        if remark := _remark(checked, problem.objective.unit):
            console.print(f"{checked.label}: {remark}", soft_wrap=True, highlight=False)
    console.print(f"{time.monotonic() - started:.1f} s; wrote {folder / FILE}", soft_wrap=True)
    return 0 if all(checked.is_certified for checked in found) else 1


def _require_gross_weight(run: StoredRun) -> None:
    name = run.result["problem"]
    if name != "gross-weight":
        raise ConfigurationError(f"{run.folder}: problem {name!r} is not allowed; it must be gross-weight.")


def _optimum(run: StoredRun) -> tuple[Problem, Tensor, Tensor]:
    """The problem of a converged run, its scaled optimum and multipliers."""
    _require_gross_weight(run)
    if run.result["status"] != "converged":
        raise ConfigurationError(f"{run.folder}: status {run.result['status']!r} is not allowed; it must be converged.")
    vehicle, mission = read_configuration(run.folder / configuration.FILE)
    problem = chosen_problem(vehicle, mission, None, run.result["formulation"] == "reduced")
    if run.result["provenance"].get("configuration_sha256") != configuration_sha256(vehicle, mission, problem.settings):
        raise ConfigurationError(
            f"{run.folder / configuration.FILE}: is not the configuration of the {result.FILE} beside it; both must be of "
            "one run, by one version of this program."
        )
    file = run.folder / result.FILE
    multipliers = multipliers_of(problem, multipliers_by_row(run.result, file, problem))
    return problem, scaled_design(run.result, file, problem), multipliers


def _outcome(checked: Checked) -> str:
    if checked.is_certified:
        return f"{checked.below.objective:.4f} and {checked.above.objective:.4f}"
    return f"not certified: {checked.below.status} below, {checked.above.status} above"


def _table(found: Sequence[Checked], unit: str) -> Table:
    table = Table(f"{unit} for 1 % more of", box=SIMPLE)
    for head in ("envelope", "optimized again", "off by"):
        table.add_column(head, justify="right", no_wrap=True)
    for checked in found:
        cells = ["not certified", "-"]
        if checked.is_certified:
            difference = checked.relative_difference
            cells = [_signed(checked.reoptimized), "both zero" if difference is None else f"{difference:.0e}"]
        table.add_row(checked.label, _signed(checked.envelope), *cells)
    return table


def _remark(checked: Checked, unit: str) -> str:
    """Why first order may not be all: sides that differ, and what begins or ceases to press."""
    parts, (down, up) = list(checked.changes[:SHOWN_CHANGES]), checked.one_sided
    if (left := len(checked.changes) - SHOWN_CHANGES) > 0:
        parts.append(f"and {left} more")
    if checked.is_certified and abs(up - down) > APART * max(abs(up), abs(down), RESOLUTION * abs(checked.objective)):
        parts.append(f"{_signed(down)} {unit} from below, {_signed(up)} {unit} above")
    return "; ".join(parts)


def _signed(value: float) -> str:
    return f"{value:+.4g}" if abs(value) >= 5e-5 else "0"


def _stored(checked: Checked) -> dict[str, Any]:
    ends = {"below": checked.below, "above": checked.above}
    return {
        "label": checked.label,
        "envelope_per_percent": checked.envelope,
        "reoptimized_per_percent": checked.reoptimized if checked.is_certified else None,
        "relative_difference": checked.relative_difference if checked.is_certified else None,
        "objective": checked.objective,
        **{name: {"status": end.status, "objective": end.objective} for name, end in ends.items()},
        "active_set_changes": list(checked.changes),
    }
