"""What a solver is asked for and what it returns."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np
from torch import Tensor

from lpc_mdo.optimization.certificate import Certificate
from lpc_mdo.optimization.model import Counts

Status = Literal["converged", "iteration_limit", "time_limit", "infeasible", "unbounded", "interrupted", "failed"]

SecondDerivativesKind = Literal["exact", "updated"]


@dataclass(frozen=True)
class Options:
    """Tolerances and limits; tolerances are scaled infinity norms.

    second_derivatives: of Newton's method, exact at every point or, for fewer evaluations and more steps, at some of them.
    """

    stationarity_tolerance: float = 1e-4
    feasibility_tolerance: float = 1e-6
    outer_iterations: int = 30
    inner_iterations: int = 150
    newton_iterations: int = 200
    time_limit: float = float("inf")  # s
    second_derivatives: SecondDerivativesKind = "exact"

    def __post_init__(self) -> None:
        """Raises ValueError for NaN, negative numbers, counts that are none, and second derivatives of another kind."""
        if self.second_derivatives not in get_args(SecondDerivativesKind):
            allowed = " or ".join(get_args(SecondDerivativesKind))
            raise ValueError(f"second_derivatives = {self.second_derivatives!r} is invalid: it must be {allowed}")
        for name, value in vars(self).items():
            if name == "second_derivatives":
                continue
            if not value >= 0:  # NaN, too
                raise ValueError(f"{name} = {value:g} is invalid: it must be at least 0")
            if name.endswith("iterations") and not isinstance(value, int):
                raise ValueError(f"{name} = {value!r} is invalid: it must be a whole number")


@dataclass(frozen=True)
class Progress:
    """State after an iteration, for display and history."""

    phase: str
    iteration: int
    objective: float  # unscaled
    violation: float
    worst_constraint: int
    stationarity: float
    penalty: float  # nan where there is none
    evaluations: int
    elapsed: float
    inner: int = 0  # iterations of the inner solve
    step: float = float("nan")  # the largest change of a variable
    damping: float = float("nan")  # added curvature
    active: int = 0  # rows at a limit
    on_bounds: int = 0  # variables on a bound


@dataclass
class Hooks:
    """Calls back into the caller: `progress` for display, `checkpoint` with a JSON-serializable state.

    `evaluation` sees objective () and constraints (m,) of every evaluation, unscaled by the solver.
    """

    progress: Callable[[Progress], None] = lambda progress: None
    checkpoint: Callable[[dict[str, Any]], None] = lambda state: None
    evaluation: Callable[[Tensor, Tensor], None] = lambda objective, constraints: None


@dataclass(frozen=True)
class OptimizationResult:
    """x (n,) and multipliers (m,) of f + multipliers . c, unscaled: positive on an upper limit, negative on a lower one.

    The certificate is in the solver's scaling; scales tells it: s_f, s_c (m,).
    """

    x: Tensor
    objective: float
    constraints: Tensor
    multipliers: Tensor
    certificate: Certificate
    status: Status
    message: str
    counts: Counts
    objective_scale: float
    constraint_scale: np.ndarray
    history: list[Progress] = field(default_factory=list)
