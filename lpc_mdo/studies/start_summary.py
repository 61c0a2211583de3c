"""What scattered starts say together: which converged, how far each is from the best, and which other optima there are."""

import string
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lpc_mdo.stored.result import read_result

SCHEMA = "lpc-mdo/starts/1"
NEAR = 1e-3  # of the objective: what counts as the same optimum
SHOWN = 5  # variables of each optimum


@dataclass(frozen=True)
class Difference:
    """One scalar of the design: its values in SI units, their difference as a share of the variable's range."""

    name: str
    unit: str
    here: float
    there: float
    share: float


@dataclass(frozen=True)
class Optimum:
    """Converged starts whose objectives lie within NEAR of the best of them.

    from_best: where the best of them differs most from the best of all; within: where the starts of this optimum differ
    most among themselves, largest and smallest value.
    """

    name: str
    starts: tuple[int, ...]
    best_start: int
    objective: float
    from_best: tuple[Difference, ...]
    within: tuple[Difference, ...]


def summarize(study: dict[str, Any], folder: Path, violations: Sequence[float]) -> dict[str, Any]:
    """The content of starts.json from study.json, the points' results and every start's violation.

    Distances are relative to the best converged objective; null without one.
    """
    points = study["points"]
    converged = [i for i, point in enumerate(points) if point["status"] == "converged"]
    designs = {i: _design(read_result(folder / points[i]["folder"] / "result.json")) for i in converged}
    optima = _optima({i: points[i]["objective"] for i in converged}, designs)
    best = optima[0].objective if optima else None
    name_of = {start: optimum.name for optimum in optima for start in optimum.starts}
    rows = []
    for i, (point, violation) in enumerate(zip(points, violations, strict=True)):
        objective, number = point["objective"], i + 1
        rows.append(
            {
                "start": number,
                "initial_violation": violation if np.isfinite(violation) else None,
                "objective": objective,
                "distance_to_best": None if best is None or objective is None else (objective - best) / abs(best),
                "status": point["status"],
                "message": point["message"],
                "optimum": name_of.get(number),
                "evaluations": None if point["counts"] is None else point["counts"]["evaluations"],
                "time_s": point.get("time_s"),
                "folder": point["folder"],
            }
        )
    return {
        "schema": SCHEMA,
        "count": len(points),
        "converged": len(converged),
        "near_best": len(optima[0].starts) if optima else 0,
        "near": NEAR,
        "best_start": optima[0].best_start if optima else None,
        "starts": rows,
        "optima": [asdict(optimum) for optimum in optima],
    }


def _design(result: dict[str, Any]) -> dict[str, tuple[float, float, str]]:
    """Every scalar of a design by its label: value, range between its bounds, unit."""
    scalars = {}
    for variable in result["design_variables"]:
        values = np.asarray(variable["value"], dtype=float)
        width = np.asarray(variable["upper"], dtype=float) - np.asarray(variable["lower"], dtype=float)
        for index in np.ndindex(values.shape):
            label = variable["name"] + (f"[{','.join(map(str, index))}]" if index else "")
            scalars[label] = (float(values[index]), float(width[index[0]] if width.ndim else width), variable["unit"])
    return scalars


def _optima(objectives: dict[int, float], designs: dict[int, dict[str, Any]]) -> list[Optimum]:
    """Converged points grouped from the best on; a group reaches NEAR beyond its best."""
    order, found = sorted(objectives, key=lambda i: objectives[i]), []
    while order:
        best = order[0]
        reach = objectives[best] + NEAR * abs(objectives[best])
        members = [i for i in order if objectives[i] <= reach]
        order = [i for i in order if i not in members]
        overall = found[0].best_start - 1 if found else best
        found.append(
            Optimum(
                name=_name(len(found)),
                starts=tuple(sorted(i + 1 for i in members)),
                best_start=best + 1,
                objective=objectives[best],
                from_best=_apart(designs[best], designs[overall]),
                within=_spread([designs[i] for i in members]),
            )
        )
    return found


def _name(number: int) -> str:
    letters = string.ascii_uppercase
    return letters[number] if number < len(letters) else f"{letters[number % 26]}{number // 26}"


def _apart(one: dict[str, Any], other: dict[str, Any]) -> tuple[Difference, ...]:
    """The scalars that differ most between two designs."""
    return _shown(
        Difference(label, unit, value, other[label][0], abs(value - other[label][0]) / span)
        for label, (value, span, unit) in one.items()
    )


def _spread(designs: Sequence[dict[str, Any]]) -> tuple[Difference, ...]:
    """The scalars that differ most among designs: largest and smallest value."""
    values = {label: [design[label][0] for design in designs] for label in designs[0]}
    return _shown(
        Difference(
            label, unit, max(values[label]), min(values[label]), (max(values[label]) - min(values[label])) / span
        )
        for label, (_, span, unit) in designs[0].items()
    )


def _shown(differences: Iterable[Difference]) -> tuple[Difference, ...]:
    apart = [difference for difference in differences if difference.share > 0.0]
    return tuple(sorted(apart, key=lambda difference: -difference.share)[:SHOWN])
