"""Newton's method for an optimum: sequential quadratic programming with the Lagrangian's own second derivatives.

A filter keeps the steps from leaving: each must improve the objective or the violation over every pair of both that was
left behind. A step that does not is damped (its curvature along the active rows raised), corrected for the rows' own
curvature, shortened, in this order; a trial costs one evaluation, new second derivatives cost many. Where none of this
helps, the violation alone is lowered until the filter accepts a point.
Sources: Fletcher, Leyffer, Math. Program. 91 (2002); Waechter, Biegler, Math. Program. 106 (2006), whose constants these are.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from lpc_mdo.optimization.certificate import Certificate, certify, least_squares_multipliers, violation
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.functions import Functions
from lpc_mdo.optimization.quadratic import Proposal, QuadraticModel, quadratic_model
from lpc_mdo.optimization.restoration import restore
from lpc_mdo.optimization.second_derivatives import SecondDerivatives
from lpc_mdo.optimization.verdict import HOPELESS_MULTIPLIER, pressure, remainder

FIRST_DAMPING, SMALLEST_DAMPING, LARGEST_DAMPING = 1e-1, 1e-8, 1e2
EASED = 0.1  # share of the damping that is left after a step that needed no more
HALVINGS = 6
MARGIN = 1e-5  # by which violation or objective must improve, relative to the violation
SUFFICIENT = 1e-4  # share of the objective's slope that a descending step must bring
OBJECTIVE_POWER, VIOLATION_POWER = 2.3, 1.1  # a step descends if slope^a > violation^b
LARGEST_VIOLATION = 3.0, 0.1  # relative to the start's, and absolute, summed: no step goes beyond
ROUNDING = 1e-12
ROUNDED = 1e2  # tolerances within which the best point is kept, beyond which the last one
PATIENCE = 6  # steps in a row that improve nothing, before the rest is called rounding
NEGLIGIBLE = 1e-10  # objective, relative, that is no improvement
REGAINED = 0.1  # share of the violation that is left when a step may be tried again
ACTIVE = 1e-6  # scaled distance from a limit up to which a row may press
POOR = 1e-3  # stationarity from which least-squares multipliers are tried


@dataclass(frozen=True)
class NewtonPoint:
    """An iterate: x (n,), scaled multipliers (m,), their certificate; damping and filter for the next step."""

    x: np.ndarray
    multipliers: np.ndarray
    certificate: Certificate
    filter: tuple[tuple[float, float], ...]  # (violation, objective), one of which a step must improve
    damping: float = FIRST_DAMPING
    count: int = 0  # steps taken
    step: float = 0.0  # the largest change of a variable that led here
    active: int = 0  # rows taken to hold with equality in that step
    held: int = 0  # variables that their bounds held
    idle: int = 0  # steps in a row that improved nothing
    best: "NewtonPoint | None" = None  # of the points before; None: this one is the best

    def state(self) -> dict[str, Any]:
        """As plain numbers, for a checkpoint."""
        best = None if self.best is None else self.best.state()
        return asdict(self) | {"x": self.x.tolist(), "multipliers": self.multipliers.tolist(), "best": best}


def start_point(evaluator: Functions, x: np.ndarray, multipliers: np.ndarray) -> NewtonPoint:
    """The point (x, multipliers) from which Newton's method starts."""
    _, missed = _figures(evaluator, x)
    largest = max(LARGEST_VIOLATION[0] * missed, LARGEST_VIOLATION[1])
    return NewtonPoint(x, multipliers, certify(evaluator, x, multipliers), ((largest, -np.inf),))


def stored_point(state: dict[str, Any]) -> NewtonPoint:
    """The point of which `state` is the checkpoint. Raises KeyError, TypeError or ValueError for anything else."""
    arrays = {key: np.array(state[key]) for key in ("x", "multipliers")}
    entries = tuple((float(violation), float(objective)) for violation, objective in state["filter"])
    best = None if state["best"] is None else stored_point(state["best"])
    read = {"filter": entries, "certificate": Certificate(**state["certificate"]), "best": best}
    return NewtonPoint(**(state | arrays | read))


@dataclass(frozen=True)
class Refined:
    """The best point reached, with the quadratic model there; None where its second derivatives are not finite."""

    point: NewtonPoint
    model: QuadraticModel | None


def refine(
    evaluator: Functions,
    point: NewtonPoint,
    stationarity_tolerance: float,
    feasibility_tolerance: float,
    iterations: int,
    report: Callable[[NewtonPoint], None] = lambda point: None,
) -> Refined:
    """At most `iterations` Newton steps until the certificate holds to the tolerances and the next step would be tiny.

    It also stops where several steps in a row improve neither the certificate nor the objective: the rest is rounding.
    Second derivatives are exact at every point or, of a thrifty evaluator, at the first and the last one and where steps do
    not help; there every other step improves them.
    """
    tolerances = stationarity_tolerance, feasibility_tolerance
    second = SecondDerivatives(evaluator)
    is_exact = False  # whether second derivatives have to be so
    while True:
        try:
            merit = point.certificate.merit(*tolerances)
            hessian = (second.exact if is_exact else second.at)(point.x, point.multipliers, merit)
            model = quadratic_model(evaluator, point.x, point.multipliers, hessian)
        except ArithmeticError:  # the model failed beside the point
            return Refined(point.best or point, None)
        is_within = point.certificate.holds(*tolerances)
        is_tiny = is_within and remainder(evaluator, point.x, point.multipliers, model).is_tiny(
            model.noise, tolerances[0]
        )
        if is_tiny and second.is_exact:
            return Refined(point, model)
        if merit <= ROUNDED and pressure(model, point.multipliers) > HOPELESS_MULTIPLIER:
            return Refined(point, model if second.is_exact else None)
        is_over = point.count >= iterations or point.idle >= PATIENCE
        stepped = None if is_over or is_tiny else _step(evaluator, point, model)
        is_exact = stepped is None and not is_over and not second.is_exact
        if is_exact:  # a step that is tiny or does not help may be the fault of second derivatives that are not
            continue
        if stepped is None:
            last = model if second.is_exact else None
            return Refined(point, last) if point.best is None else Refined(point.best, None)
        point = _compared(evaluator, point, stepped, tolerances)
        report(point)


def _compared(
    evaluator: Functions, point: NewtonPoint, stepped: NewtonPoint, tolerances: tuple[float, float]
) -> NewtonPoint:
    """The stepped point with the best one so far, and the number of steps since something improved."""
    best, merit = point.best or point, stepped.certificate.merit(*tolerances)
    is_better = merit < best.certificate.merit(*tolerances)
    idle = 0 if is_better or _descends(evaluator, point, stepped) else point.idle + 1
    kept = None if is_better or merit > ROUNDED else replace(best, best=None)
    return replace(stepped, best=kept, idle=idle)


def _descends(evaluator: Functions, point: NewtonPoint, stepped: NewtonPoint) -> bool:
    """Whether the step lowered objective or violation by more than rounding."""
    (old, old_missed), (new, new_missed) = _figures(evaluator, point.x), _figures(evaluator, stepped.x)
    evaluator.values(stepped.x)
    return new < old - NEGLIGIBLE * (1.0 + abs(old)) or new_missed < 0.5 * old_missed


def _step(evaluator: Functions, point: NewtonPoint, model: QuadraticModel) -> NewtonPoint | None:
    """The next point; None where nothing helps."""
    here = _figures(evaluator, point.x)
    damping = point.damping
    while damping <= LARGEST_DAMPING:
        found = model.minimize(damping)
        if found is None:  # no point within the bounds meets the linear rows
            return _regained(evaluator, point, model, here)
        proposal = found
        for step in _tries(evaluator, point, model, proposal, damping):
            kind = _accepted(point, here, _figures(evaluator, point.x + step), proposal.slope)
            if kind is not None:
                eased = EASED * damping if damping == point.damping else damping
                entries = _entries(point, here, kind)
                return _arrive(
                    evaluator, point, model, step, proposal.multipliers, max(eased, SMALLEST_DAMPING), entries
                )
        damping *= 10.0
    for share in 0.5 ** np.arange(1, HALVINGS + 1):
        kind = _accepted(point, here, _figures(evaluator, point.x + share * proposal.step), share * proposal.slope)
        if kind is not None:
            multipliers = point.multipliers + share * (proposal.multipliers - point.multipliers)
            entries = _entries(point, here, kind)
            return _arrive(evaluator, point, model, share * proposal.step, multipliers, LARGEST_DAMPING, entries)
    return _regained(evaluator, point, model, here)


def _tries(
    evaluator: Functions, point: NewtonPoint, model: QuadraticModel, proposal: Proposal, damping: float
) -> Iterator[np.ndarray]:
    """The step, and the one that allows for the rows' curvature, seen from their values at its end."""
    yield proposal.step
    _, values = evaluator.values(point.x)
    end = np.clip(point.x + proposal.step, evaluator.lower, evaluator.upper)
    if evaluator.is_finite(end):
        bend = evaluator.values(end)[1] - values - model.jacobian @ proposal.step[model.free]
        corrected = model.shifted(bend).minimize(damping)
        if corrected is not None:
            yield corrected.step


def _regained(
    evaluator: Functions, point: NewtonPoint, model: QuadraticModel, here: tuple[float, float]
) -> NewtonPoint | None:
    """The nearest point of far less violation that passes the filter; None if there is none, or nothing to lower."""
    entries = _entries(point, here, "restoring")

    def is_enough(x: np.ndarray) -> bool:
        objective, missed = _figures(evaluator, x)
        return missed <= REGAINED * here[1] and _passes(entries, objective, missed)

    restored = restore(evaluator, point.x, 0.0, is_enough=is_enough)
    if not is_enough(restored.x):
        return None
    multipliers = least_squares_multipliers(evaluator, restored.x, ACTIVE, point.multipliers)
    return _arrive(evaluator, point, model, restored.x - point.x, multipliers, FIRST_DAMPING, entries)


def _entries(point: NewtonPoint, here: tuple[float, float], kind: str) -> tuple[tuple[float, float], ...]:
    """The filter after a step from `here`: a step that restores leaves the point behind that must not be seen again."""
    if kind == "descending":
        return point.filter
    objective, missed = here
    new = ((1.0 - MARGIN) * missed, objective - MARGIN * missed)
    return (*(entry for entry in point.filter if entry[0] < new[0] or entry[1] < new[1]), new)


def _passes(entries: tuple[tuple[float, float], ...], objective: float, missed: float) -> bool:
    rounding = ROUNDING * (1.0 + abs(objective))
    return all(missed < old_missed or objective - rounding < old for old_missed, old in entries)


def _accepted(point: NewtonPoint, here: tuple[float, float], there: tuple[float, float], slope: float) -> str | None:
    """ "descending" or "restoring" for a step that passes the filter, None for one that does not."""
    (objective, missed), (new_objective, new_missed) = here, there
    if not np.isfinite(new_missed) or not _passes(point.filter, new_objective, new_missed):
        return None
    rounding = ROUNDING * (1.0 + abs(objective))
    if slope < 0.0 and (-slope) ** OBJECTIVE_POWER > missed**VIOLATION_POWER:
        return "descending" if new_objective <= objective + SUFFICIENT * slope + rounding else None
    is_better = new_missed <= (1.0 - MARGIN) * missed or new_objective <= objective - MARGIN * missed + rounding
    return "restoring" if is_better else None


def _arrive(
    evaluator: Functions,
    point: NewtonPoint,
    model: QuadraticModel,
    step: np.ndarray,
    multipliers: np.ndarray,
    damping: float,
    entries: tuple[tuple[float, float], ...],
) -> NewtonPoint:
    """The point at the step's end, with those multipliers or, far from an optimum, least-squares ones if they suit better."""
    x = np.clip(point.x + step, evaluator.lower, evaluator.upper)
    if isinstance(evaluator, Evaluator) and evaluator.is_thrifty:
        evaluator.differentiate(x)
    certificate = certify(evaluator, x, multipliers)
    if certificate.optimality > POOR:
        others = least_squares_multipliers(evaluator, x, ACTIVE, multipliers)
        other = certify(evaluator, x, others)
        if other.optimality < certificate.optimality:
            multipliers, certificate = others, other
    return replace(
        point,
        x=x,
        multipliers=multipliers,
        certificate=certificate,
        filter=entries,
        damping=damping,
        count=point.count + 1,
        step=float(np.abs(step).max(initial=0.0)),
        active=len(model.active),
        held=model.size - len(model.free),
    )


def _figures(evaluator: Functions, x: np.ndarray) -> tuple[float, float]:
    """Objective and sum of violations at x (n,), brought within the bounds; infinity where the model fails."""
    x = np.clip(x, evaluator.lower, evaluator.upper)
    if not evaluator.is_finite(x):
        return np.inf, np.inf
    objective, values = evaluator.values(x)
    return objective, float(np.abs(violation(values, *evaluator.limits)).sum())
