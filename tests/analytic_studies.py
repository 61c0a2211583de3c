"""Studies whose fronts are known in closed form, cheap enough to run many times and importable by worker processes."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

from torch import Tensor

from lpc_mdo.config import Mission, Vehicle, load
from lpc_mdo.problems.problem import Constraint, Objective, Problem, Variable
from lpc_mdo.studies.study import Axis, Parameter, Study
from lpc_mdo.studies.sweep import Envelope


@cache
def inputs() -> tuple[Vehicle, Mission]:
    return load()


@dataclass(frozen=True)
class Point:
    x: Tensor
    y: Tensor

    @property
    def first(self) -> Tensor:
        return (self.x + 1.0) ** 2 + self.y**2

    @property
    def second(self) -> Tensor:
        return (self.x - 1.0) ** 2 + self.y**2


@dataclass(frozen=True)
class Plane:
    """Stands for an analyzer; `delay` s for its cost."""

    delay: float = 0.0

    @property
    def vehicle(self) -> Vehicle:
        return inputs()[0]

    @property
    def mission(self) -> Mission:
        return inputs()[1]

    def __call__(self, point: Point) -> Point:
        time.sleep(self.delay)
        return point


def plane_problem(analyze: Plane, objective: Objective, rows: tuple[Constraint, ...] = (), x: float = 0.3) -> Problem:
    return Problem(
        name="plane",
        formulation="paper",
        variables=(Variable("x", "m", -2.0, 2.0, x), Variable("y", "m", -2.0, 2.0, 0.7)),
        constraints=(Constraint("y_limit", "m", lambda p: p.y, lower=-1.0), *rows),
        objective=objective,
        analyze_design=analyze,
        complete=lambda values: Point(**values),
        outputs=lambda point, start: {"first": point.first, "second": point.second},
    )


@dataclass(frozen=True)
class Circles:
    """Weighted sums of the squared distances from (-1, 0) and (1, 0): sqrt(first) + sqrt(second) = 2 on the front."""

    delay: float = 0.0

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        plane = Plane(self.delay)
        return [plane_problem(plane, _weighted(value)) for value in values]


def _weighted(weight: float) -> Objective:
    if weight < 0.0:
        raise ValueError(f"weight = {weight:g} is not allowed")
    return Objective("sum", "m^2", lambda p: weight * p.first + (1.0 - weight) * p.second)


@dataclass(frozen=True)
class Distance:
    """Least squared distance from (1, 0) left of a wall at x <= value: (1 - value)^2 for value < 1."""

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        plane = Plane()
        second = Objective("second", "m^2", lambda p: p.second, scale=10.0)
        return [
            plane_problem(plane, second, (Constraint("wall", "m", lambda p: p.x, upper=value, scale=0.5),))
            for value in values
        ]


@dataclass(frozen=True)
class TwoValleys:
    """Valleys near x = -1 and x = 1, the second one the deeper by `value`; the start lies in the first."""

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        plane = Plane()
        return [plane_problem(plane, _valleys(value), x=-0.97) for value in values]


def _valleys(depth: float) -> Objective:
    return Objective("valleys", "m^2", lambda p: (p.x**2 - 1.0) ** 2 + p.y**2 - 0.5 * depth * p.x)


def weighted_circle_slope(value: float, problem: Problem, x: Tensor, multipliers: Tensor) -> float | None:
    """d second / d first where value * first + (1 - value) * second has its minimum."""
    return -value / (1.0 - value) if value < 1.0 else None


def circles(values: Sequence[float], delay: float = 0.0) -> Study:
    return Study(
        kind="pareto",
        name="circles",
        problem="plane",
        formulation="paper",
        inputs=inputs(),
        method="weighted-sum",
        parameter=Parameter("weight", "1"),
        axes=(Axis("first", "m^2", "minimize"), Axis("second", "m^2", "minimize")),
        values=tuple(values),
        problems=Circles(delay),
        slope=weighted_circle_slope,
    )


def distances(values: Sequence[float]) -> Study:
    return Study(
        kind="sweep",
        name="wall",
        problem="plane",
        formulation="paper",
        inputs=inputs(),
        method="parameter",
        parameter=Parameter("wall", "m", "wall"),
        axes=(Axis("wall", "m", None), Axis("second", "m^2", "minimize")),
        values=tuple(values),
        problems=Distance(),
        slope=Envelope(Distance()),
    )


def valleys(values: Sequence[float]) -> Study:
    return Study(
        kind="sweep",
        name="valleys",
        problem="plane",
        formulation="paper",
        inputs=inputs(),
        method="parameter",
        parameter=Parameter("depth", "m^2"),
        axes=(Axis("depth", "m^2", None), Axis("first", "m^2", None)),
        values=tuple(values),
        problems=TwoValleys(),
        slope=Envelope(TwoValleys()),
    )


@dataclass(frozen=True)
class Arc:
    """First and second of a point that must not lie inside the unit circle, in the quadrant of positive values."""

    method: str

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        return [self._problem(value) for value in values]

    def _problem(self, value: float) -> Problem:
        outside = Constraint("outside", "1", lambda p: p.x**2 + p.y**2, lower=1.0)
        if self.method == "weighted-sum":
            rows, objective = (outside,), Objective("sum", "1", lambda p: value * p.x + (1.0 - value) * p.y)
        else:
            rows = (outside, Constraint("largest_first", "1", lambda p: p.x, upper=value))
            objective = Objective("second", "1", lambda p: p.y)
        return Problem(
            name="arc",
            formulation="paper",
            variables=(Variable("x", "1", 0.0, 2.0, 0.6), Variable("y", "1", 0.0, 2.0, 0.9)),
            constraints=rows,
            objective=objective,
            analyze_design=Plane(),
            complete=lambda values: Point(**values),
            outputs=lambda point, start: {"first": point.x, "second": point.y},
        )


def arcs(values: Sequence[float], method: str) -> Study:
    return replace(circles(values), name="arcs", method=method, problems=Arc(method), slope=Envelope(Arc(method)))


@dataclass(frozen=True)
class Ledge:
    """Squared distance of x from 1.2 times the value; the model has no values for x below the value."""

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        plane = Plane()
        return [plane_problem(plane, _ledge(value), x=1.0) for value in values]


def _ledge(value: float) -> Objective:
    return Objective("ledge", "m^2", lambda p: (p.x - 1.2 * value) ** 2 + p.y**2 + 0.0 * (p.x - value).sqrt())


def ledges(values: Sequence[float]) -> Study:
    return replace(distances(values), name="ledges", problems=Ledge(), slope=Envelope(Ledge()))
