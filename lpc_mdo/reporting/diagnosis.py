"""Why a run did not converge, in engineering words: which constraints fight, which bounds hold, what to relax and how far."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.optimize import linprog

from lpc_mdo.numerics.constants import POUND
from lpc_mdo.optimization import OptimizationResult
from lpc_mdo.optimization.certificate import violation
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.problems.problem import Problem
from lpc_mdo.stored.diagnosis import Conflict, Diagnosis, HeldBound, Price, Relaxation

POUNDS_PER_KILOGRAM = 1.0 / POUND
MISSED = 1e-5  # scaled: a row is missed beyond this
AT_BOUND = 1e-4  # of half a variable's range
PUSHED = 1e-3  # share of the largest force: bounds that are pressed less do not matter
SHOWN = 6
UNFINISHED = ("time_limit", "interrupted")  # a run that ended of itself would end there again


def diagnose(problem: Problem, result: OptimizationResult) -> Diagnosis:
    """Look at the end of a run that did not converge."""
    evaluator = Evaluator(
        problem.evaluate,
        problem.lower.numpy(),
        problem.upper.numpy(),
        problem.constraint_lower.numpy(),
        problem.constraint_upper.numpy(),
        constraint_scale=result.constraint_scale,  # it is in the solver's scaling that the violation is least
        is_batched=True,
    )
    x = result.x.numpy()
    missed = violation(evaluator.values(x)[1], *evaluator.limits)
    is_missed = bool((np.abs(missed) > MISSED).any())
    # Where constraints are missed, the violation's slope says what stands in the way; else the Lagrangian's does.
    if is_missed:
        force = evaluator.gradient(x, missed, objective_weight=0.0)
    else:
        force = evaluator.gradient(x, result.multipliers.numpy() / evaluator.constraint_scale)
    is_within_reach = not is_missed or _least_change(evaluator, x, np.zeros(0, dtype=int), "lower") is not None
    return Diagnosis.model_construct(
        conflicts=tuple(_conflicts(problem, result.constraints.numpy(), missed)),
        prices=() if is_missed else tuple(_prices(problem, result)),
        bounds=tuple(_bounds(problem, x, force)),
        relaxations=() if is_within_reach else tuple(_relaxations(problem, evaluator, x)),
        is_within_reach=is_within_reach,
    )


def _rows(problem: Problem) -> list[Any]:
    """The constraint of every component, (m,)."""
    return [row for row, size in zip(problem.constraints, problem.row_sizes, strict=True) for _ in range(size)]


def _conflicts(problem: Problem, values: np.ndarray, missed: np.ndarray) -> Iterable[Conflict]:
    """Worst first; values (m,) in the problem's scaling, missed (m,) in the solver's."""
    rows = _rows(problem)
    for index in np.argsort(-np.abs(missed), kind="stable"):
        if abs(missed[index]) > MISSED:
            row = rows[index]
            yield Conflict.model_construct(
                constraint=problem.constraint_label(int(index)),
                unit=row.unit,
                reached=float(values[index]) * row.scale,
                lower=row.lower,
                upper=row.upper,
                share=float(missed[index] ** 2 / (missed @ missed)),
            )


def _prices(problem: Problem, result: OptimizationResult) -> Iterable[Price]:
    rows, multipliers = _rows(problem), result.multipliers.numpy()
    for index in np.argsort(-np.abs(multipliers), kind="stable"):
        row = rows[index]
        if row.kind == "inequality" and multipliers[index] != 0.0:
            value = -float(multipliers[index]) * problem.objective.scale / row.scale
            label = problem.constraint_label(int(index))
            yield Price.model_construct(constraint=label, unit=row.unit, value=value)


def _bounds(problem: Problem, x: np.ndarray, force: np.ndarray) -> Iterable[HeldBound]:
    """Most pressed first."""
    largest, first, found = np.abs(force).max(initial=0.0), 0, []
    for variable in problem.variables:
        part = slice(first, first + variable.count)
        first += variable.count
        for side, is_there, bounds in (
            ("lower", (x[part] <= -1.0 + AT_BOUND) & (force[part] > PUSHED * largest), variable.lower_tensor),
            ("upper", (x[part] >= 1.0 - AT_BOUND) & (force[part] < -PUSHED * largest), variable.upper_tensor),
        ):
            values = bounds.flatten().numpy()
            for bound in np.unique(values[is_there]):
                here = is_there & (values == bound)
                held = HeldBound.model_construct(
                    variable=variable.name,
                    unit=variable.unit,
                    side=side,
                    bound=float(bound),
                    count=int(here.sum()),
                    size=variable.count,
                )
                found.append((float(np.abs(force[part])[here].max()), held))
    return [held for _, held in sorted(found, key=lambda pair: -pair[0])]


def _relaxations(problem: Problem, evaluator: Evaluator, x: np.ndarray) -> Iterable[Relaxation]:
    """For each inequality by itself: the least change of its limit with which the linear rows can all be met."""
    first = 0
    for row, size in zip(problem.constraints, problem.row_sizes, strict=True):
        part = np.arange(first, first + size)
        first += size
        if row.kind == "equality":
            continue
        for side, limit, sign in (("lower", row.lower, -1.0), ("upper", row.upper, 1.0)):
            change = _least_change(evaluator, x, part, side) if np.isfinite(limit) else None
            if change is None or change <= MISSED:
                continue
            relaxed = limit + sign * change * row.scale
            low, high = row.limits_within
            if low <= relaxed <= high:  # a state of charge below zero, or more torque than there is, is no remedy
                yield Relaxation.model_construct(
                    constraint=row.name, unit=row.unit, side=side, limit=limit, relaxed=relaxed
                )


def _least_change(evaluator: Evaluator, x: np.ndarray, part: np.ndarray, side: str) -> float | None:
    """How far the limit of rows `part` must move for a step within the bounds to meet all linear rows; None: no way."""
    _, values = evaluator.values(x)
    jacobian = evaluator.jacobian(x)
    lower, upper = evaluator.limits
    give = np.zeros(len(values))
    give[part] = evaluator.constraint_scale[part]
    is_equal = lower == upper
    above, below = np.isfinite(upper) & ~is_equal, np.isfinite(lower) & ~is_equal
    gives = (give if side == "upper" else 0.0 * give, give if side == "lower" else 0.0 * give)
    answer = linprog(
        np.append(np.zeros(len(x)), 1.0),
        A_ub=np.vstack(
            [
                np.column_stack([jacobian[above], -gives[0][above]]),
                np.column_stack([-jacobian[below], -gives[1][below]]),
            ]
        ),
        b_ub=np.concatenate([(upper - values)[above], (values - lower)[below]]),
        A_eq=np.column_stack([jacobian[is_equal], np.zeros(is_equal.sum())]),
        b_eq=(lower - values)[is_equal],
        bounds=[*zip(evaluator.lower - x, evaluator.upper - x, strict=True), (0.0, None)],
    )
    return float(answer.fun) if answer.status == 0 else None


def words(content: dict[str, Any], objective: dict[str, Any], status: str) -> list[str]:
    """Lines for the terminal from a diagnosis, the objective and the status as they stand in result.json."""
    lines = []
    if content["conflicts"]:
        word = "are missed" if content["is_within_reach"] else "cannot all hold"
        lines.append(f"these constraints {word} here:")
        lines += [f"  {_missed(entry)}" for entry in content["conflicts"][:SHOWN]]
    if content["prices"]:
        lines.append("what the limits cost here:")
        lines += [f"  {_price(entry, objective)}" for entry in content["prices"][:SHOWN]]
    if content["bounds"]:
        lines.append("the design is pressed against these bounds:")
        lines += [f"  {_held(entry)}" for entry in content["bounds"][:SHOWN]]
    if content["relaxations"]:
        lines.append("to first order, one of these limits moved alone would let all constraints hold:")
        lines += [
            f"  {entry['constraint']}: {entry['limit']:.6g} -> {entry['relaxed']:.6g} {entry['unit']}"
            for entry in content["relaxations"]
        ]
    elif content["is_within_reach"] and content["conflicts"]:
        advice = "go on with --resume" if status in UNFINISHED else "another start may, e.g. --starts 5"
        lines.append(f"to first order a step within the bounds would meet them all: {advice}")
    elif content["conflicts"]:
        lines.append(
            "to first order, no single limit moved alone, as far as makes sense, would do: several must give, or bounds"
        )
    return lines


def _missed(entry: dict[str, Any]) -> str:
    lower, upper = entry["lower"], entry["upper"]
    if lower is not None and lower == upper:
        asked = f"{lower:.6g} asked"
    elif lower is not None and entry["reached"] < lower:
        asked = f"at least {lower:.6g} asked"
    else:
        asked = f"at most {upper:.6g} asked"
    return f"{entry['constraint']}: {entry['reached']:.6g} {entry['unit']} reached, {asked}; {entry['share']:.0%} of the miss"


def _price(entry: dict[str, Any], objective: dict[str, Any]) -> str:
    value, unit = entry["value"], objective["unit"]
    pounds = f" ({value * POUNDS_PER_KILOGRAM:+.4g} lb)" if unit == "kg" else ""
    name = objective["name"].replace("_", " ")
    return f"limit of {entry['constraint']} up by 1 {entry['unit']}: {value:+.4g} {unit}{pounds} {name}"


def _held(entry: dict[str, Any]) -> str:
    word = "least" if entry["side"] == "lower" else "largest"
    return f"{word} {entry['variable']} {entry['bound']:.6g} {entry['unit']} ({entry['count']} of {entry['size']})"
