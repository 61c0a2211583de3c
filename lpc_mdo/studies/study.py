"""What a study is: one problem along one parameter, which points start from which, and what is drawn."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from torch import Tensor

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.problems.problem import Problem


@dataclass(frozen=True)
class Parameter:
    """What steps from point to point; key: its place in vehicle or mission file, a constraint's name, or None."""

    name: str
    unit: str
    key: str | None = None


@dataclass(frozen=True)
class Axis:
    """One direction of the drawing; an output's key in result.json, or the parameter's name."""

    name: str
    unit: str
    goal: Literal["minimize", "maximize"] | None


class Slope(Protocol):
    """d vertical / d horizontal at an optimum x (n,) with multipliers (m,), by the envelope theorem; None: vertical."""

    def __call__(self, value: float, problem: Problem, x: Tensor, multipliers: Tensor) -> float | None: ...


@dataclass(frozen=True)
class Study:
    """Everything that a worker needs; plain data and module-level functions, so that it travels to other processes.

    problems: one problem a value of the parameter, and nothing else than these values may tell one from another.
    from_baseline: points that start from the baseline whatever their neighbours found.
    """

    kind: Literal["pareto", "sweep", "starts"]
    name: str
    problem: str
    formulation: str
    inputs: tuple[Vehicle, Mission]  # of the first value, for the record
    method: Literal["weighted-sum", "epsilon-constraint", "parameter", "scatter"]
    parameter: Parameter
    axes: tuple[Axis, Axis]
    values: tuple[float, ...]
    problems: Callable[[Sequence[float]], list[Problem]]
    slope: Slope
    from_baseline: tuple[int, ...] = ()

    @property
    def origins(self) -> tuple[int | None, ...]:
        """For every point the one whose optimum it starts from; scattered starts stand alone."""
        starts = (None,) * len(self.values) if self.kind == "starts" else starting_points(len(self.values))
        return tuple(None if i in self.from_baseline else start for i, start in enumerate(starts))


def starting_points(count: int) -> tuple[int | None, ...]:
    """For every point in a row, the point whose optimum it starts from: its neighbour towards the middle; the middle none.

    Fixed in advance, so that neither the number of workers nor an interruption changes any result. Next neighbours are so
    near that Newton's method starts at once; from farther away it takes twice the steps or leads to another optimum.
    """
    middle = (count - 1) // 2
    return tuple(None if i == middle else i - 1 if i > middle else i + 1 for i in range(count))


def generations(starts: Sequence[int | None]) -> list[list[int]]:
    """Points that can run side by side: those without a start, then those that start from them, and so on."""
    waves = [[i for i, start in enumerate(starts) if start is None]]
    while sum(map(len, waves)) < len(starts):
        waves.append([i for i, start in enumerate(starts) if start in waves[-1]])
    return waves
