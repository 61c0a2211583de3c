"""What scattered starts say together: which converged, how far each is from the best, which other optima there are, and
whether the best of them is one design or many that are equally good.
"""

import string
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lpc_mdo.stored.result import read_result
from lpc_mdo.stored.starts import SCHEMA

NEAR = 1e-3  # of the objective: what counts as the same optimum
SHOWN = 5  # variables of each optimum
EQUAL = 1e-6  # of the objective: designs that are equally good
FREE = 1e-2  # of its range: a variable that lies farther apart than this among them is free


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


@dataclass(frozen=True)
class FreeVariable:
    """A block of variables along which the optimum is flat: how many of its scalars are free, and the one that varies most."""

    name: str
    free: int
    of: int
    widest: Difference


@dataclass(frozen=True)
class Flatness:
    """Designs that are equally good, by how far they lie apart.

    starts: that end at them; directions: straight lines through design space along which they lie apart by more than FREE
    of the ranges; largest: the greatest distance of any scalar, as a share of its range; both null for a single design.
    """

    equal: float
    starts: int
    directions: int | None
    largest: float | None
    free: tuple[FreeVariable, ...]


def summarize(study: dict[str, Any], folder: Path, violations: Sequence[float]) -> dict[str, Any]:
    """The content of starts.json from study.json, the points' results and every start's violation.

    Distances are relative to the best converged objective; null without one.
    """
    points = study["points"]
    converged = [i for i, point in enumerate(points) if point["status"] == "converged"]
    designs = {i: _design(read_result(folder / points[i]["folder"] / "result.json")) for i in converged}
    optima = _optima({i: points[i]["objective"] for i in converged}, designs)
    best = optima[0].objective if optima else None
    reach = -np.inf if best is None else best + EQUAL * abs(best)
    equals = [designs[i] for i in converged if points[i]["objective"] <= reach]
    flatness = _flatness(equals)
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
        "verdict": verdict(len(converged), len(points), optima, flatness),
        "flatness": asdict(flatness),
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
    order = sorted(objectives, key=lambda i: objectives[i])
    found: list[Optimum] = []
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


def _flatness(equals: Sequence[dict[str, Any]]) -> Flatness:
    """How far equally good designs lie apart."""
    if len(equals) < 2:
        return Flatness(EQUAL, len(equals), None, None, ())
    labels = list(equals[0])
    apart = {difference.name: difference for difference in _all_apart(equals)}
    places = np.array([[design[label][0] / (design[label][1] or 1.0) for label in labels] for design in equals])
    middle = places - places.mean(axis=0)
    along = middle @ np.linalg.svd(middle, full_matrices=False)[2].T
    directions = int((along.max(axis=0) - along.min(axis=0) > FREE).sum())
    free = []
    for name in dict.fromkeys(label.partition("[")[0] for label in labels):
        own = [apart[label] for label in labels if label.partition("[")[0] == name]
        wide = sorted((entry for entry in own if entry.share > FREE), key=lambda entry: -entry.share)
        if wide:
            free.append(FreeVariable(name, len(wide), len(own), wide[0]))
    largest = max(entry.share for entry in apart.values())
    return Flatness(EQUAL, len(equals), directions, largest, tuple(sorted(free, key=lambda each: -each.widest.share)))


def verdict(converged: int, count: int, optima: Sequence[Optimum], flatness: Flatness) -> str:
    """One optimum or several, and whether the best is one design, in words."""
    if not optima:
        return f"none of {count} starts converged: nothing is known of the optimum"
    if len(optima) == 1:
        words = f"one optimum: all {converged} certified starts of {count} end within {NEAR:.1%} of the best objective"
    else:
        names = ", ".join(f"{each.name} ({len(each.starts)})" for each in optima)
        words = f"{len(optima)} optima: {converged} certified starts of {count} end at {names}"
    subject = "it" if len(optima) == 1 else "the best"
    alike = f"designs whose objectives agree to {EQUAL:g}"
    if flatness.largest is None:
        return f"{words}; a single start ends at the best, which does not show whether it is unique"
    if not flatness.free:
        return f"{words}; {subject} is unique: {alike} differ by at most {flatness.largest:.1g} of any variable's range"
    parts = [f"{each.name} ({each.free} of {each.of}, up to {each.widest.share:.0%})" for each in flatness.free]
    return (
        f"{words}; {subject} is flat: {alike} ({flatness.starts} of them) lie apart by more "
        f"than {FREE:.0%} of the range along {flatness.directions} direction{'' if flatness.directions == 1 else 's'}, "
        f"in {', '.join(parts)}"
    )


def _name(number: int) -> str:
    letters = string.ascii_uppercase
    return letters[number] if number < len(letters) else f"{letters[number % 26]}{number // 26}"


def _apart(one: dict[str, Any], other: dict[str, Any]) -> tuple[Difference, ...]:
    """The scalars that differ most between two designs."""
    return _shown(
        Difference(label, unit, value, other[label][0], abs(value - other[label][0]) / span if span else 0.0)
        for label, (value, span, unit) in one.items()
    )


def _spread(designs: Sequence[dict[str, Any]]) -> tuple[Difference, ...]:
    """The scalars that differ most among designs."""
    return _shown(_all_apart(designs))


def _all_apart(designs: Sequence[dict[str, Any]]) -> list[Difference]:
    """Every scalar's largest and smallest value among designs."""
    found = []
    for label, (_, span, unit) in designs[0].items():
        values = [design[label][0] for design in designs]
        width = max(values) - min(values)
        found.append(Difference(label, unit, max(values), min(values), width / span if span else 0.0))
    return found


def _shown(differences: Iterable[Difference]) -> tuple[Difference, ...]:
    apart = [difference for difference in differences if difference.share > 0.0]
    return tuple(sorted(apart, key=lambda difference: -difference.share)[:SHOWN])
