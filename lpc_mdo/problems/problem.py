"""Variables, constraints and scaling: an optimization problem over the aircraft, with no knowledge of solvers."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic

import torch
from torch import Tensor
from typing_extensions import TypeVar

from lpc_mdo.model.design import Design

if TYPE_CHECKING:
    from lpc_mdo.model.analyzer import Model

AnalysisT = TypeVar("AnalysisT", default=Any)  # a plain `Problem` is one of any analysis


@dataclass(frozen=True)
class Variable:
    """A block of design variables: bounds and start in SI units; `size` is its shape in Design.

    Bounds are one number for all, or one for each element of the first dimension. `reason` says why they stand where they do,
    likewise one sentence for all or one for each.
    """

    name: str
    unit: str
    lower: float | Sequence[float]
    upper: float | Sequence[float]
    initial: float | Sequence[Any] | Tensor
    size: tuple[int, ...] = ()
    reason: str | Sequence[str] = ""
    twins: tuple[int, ...] = ()
    """For each element of the first dimension the one that it equals by the aircraft's symmetry, itself if none; () if all differ."""
    follows: str = ""
    """Name of the variable that a row makes it equal to."""

    @property
    def count(self) -> int:
        return math.prod(self.size)

    @property
    def initial_tensor(self) -> Tensor:
        return torch.as_tensor(self.initial, dtype=torch.float64).expand(self.size)

    @property
    def lower_tensor(self) -> Tensor:
        """Lower bounds in the variable's own shape."""
        return self._per_element(self.lower)

    @property
    def upper_tensor(self) -> Tensor:
        """Upper bounds in the variable's own shape."""
        return self._per_element(self.upper)

    @property
    def reasons(self) -> tuple[str, ...]:
        """One for each scalar, in the order of the flat block."""
        if isinstance(self.reason, str):
            return (self.reason,) * self.count
        return tuple(reason for reason in self.reason for _ in range(self.count // len(self.reason)))

    def at(self, elements: Sequence[int]) -> "Variable":
        """The block of these elements of the first dimension."""

        def picked(each: Any) -> Any:
            return each if isinstance(each, str | float | int) else [each[element] for element in elements]

        return replace(
            self,
            lower=picked(self.lower),
            upper=picked(self.upper),
            reason=picked(self.reason),
            initial=self.initial_tensor[list(elements)],
            size=(len(elements), *self.size[1:]),
            twins=(),
        )

    def _per_element(self, bound: float | Sequence[float]) -> Tensor:
        value = torch.as_tensor(bound, dtype=torch.float64)
        if value.dim() == 1:
            value = value.reshape(-1, *[1] * (len(self.size) - 1))
        return value.expand(self.size)


@dataclass(frozen=True)
class Constraint(Generic[AnalysisT]):
    """A row of the problem's table: lower <= of(analysis) <= upper; equal limits make an equality.

    `of` returns (...,) or, for a row that is imposed component by component, (..., k). `scale` divides the row: the
    change that an engineer would call large. limits_within: where a limit makes sense at all, for advice.
    """

    name: str
    unit: str
    of: Callable[[AnalysisT], Tensor]
    lower: float = -math.inf
    upper: float = math.inf
    scale: float = 1.0
    limits_within: tuple[float, float] = (-math.inf, math.inf)
    only_equates: bool = False
    """Whether it says no more than that variables are equal: by symmetry, or because one follows another."""
    is_two_sided: bool = False
    """Whether it has one component for port and one for starboard."""

    @property
    def kind(self) -> str:
        return "equality" if self.lower == self.upper else "inequality"


@dataclass(frozen=True)
class Objective(Generic[AnalysisT]):
    name: str
    unit: str
    of: Callable[[AnalysisT], Tensor]
    scale: float = 1.0


@dataclass(frozen=True)
class Problem(Generic[AnalysisT]):
    """Minimize objective over variables subject to constraints, all read off `analyze_design(complete(variables))`.

    The solver's x is flat, float64 and maps every variable's bounds to [-1, 1], equal bounds to 0.
    """

    name: str
    formulation: str
    variables: tuple[Variable, ...]
    constraints: tuple[Constraint[AnalysisT], ...]
    objective: Objective[AnalysisT]
    analyze_design: "Model[AnalysisT]"
    complete: Callable[[Mapping[str, Tensor]], Any] = field(default=Design.of)
    outputs: Callable[[AnalysisT, AnalysisT], dict[str, Any]] = field(default=lambda analysis, start: {})
    """What a designer reads first, from the analyses of a design and of the start, by name with its unit."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Values beyond vehicle and mission that make this problem, by name with their unit."""

    def __post_init__(self) -> None:
        for variable in self.variables:
            start, lower, upper = variable.initial_tensor, variable.lower_tensor, variable.upper_tensor
            outside = (start < lower - 1e-12) | (start > upper + 1e-12)
            if bool(outside.any()):
                value, least, largest = (float(t[outside].flatten()[0]) for t in (start, lower, upper))
                raise ValueError(
                    f"{variable.name} = {value:g} {variable.unit} at the start is invalid: "
                    f"its bounds are {least:g} and {largest:g} {variable.unit}"
                )

    @cached_property
    def size(self) -> int:
        """Number of design variables."""
        return sum(variable.count for variable in self.variables)

    @cached_property
    def _middle(self) -> Tensor:
        return self._spread(lambda v: 0.5 * (v.lower_tensor + v.upper_tensor))

    @cached_property
    def _half_range(self) -> Tensor:
        half = self._spread(lambda v: 0.5 * (v.upper_tensor - v.lower_tensor))
        return torch.where(half > 0.0, half, 1.0)

    @cached_property
    def _is_fixed(self) -> Tensor:
        return self._spread(lambda v: (v.upper_tensor == v.lower_tensor).double()) > 0.0

    def _spread(self, value: Callable[[Variable], Tensor]) -> Tensor:
        return torch.cat([value(v).flatten() for v in self.variables])

    @cached_property
    def x0(self) -> Tensor:
        """The start (n,), scaled."""
        start = torch.cat([variable.initial_tensor.flatten() for variable in self.variables])
        return self._within((start - self._middle) / self._half_range)

    @property
    def lower(self) -> Tensor:
        """Scaled lower bounds (n,): -1, or 0 of a variable whose bounds are equal."""
        return torch.where(self._is_fixed, 0.0, -1.0).double()

    @property
    def upper(self) -> Tensor:
        """Scaled upper bounds (n,): 1, or 0 of a variable whose bounds are equal."""
        return torch.where(self._is_fixed, 0.0, 1.0).double()

    def _within(self, x: Tensor) -> Tensor:
        return torch.maximum(torch.minimum(x, self.upper), self.lower)

    def physical(self, x: Tensor) -> dict[str, Tensor]:
        """Named variables in SI units from scaled x (..., n)."""
        values = self._middle + self._half_range * x
        parts = values.split([variable.count for variable in self.variables], dim=-1)
        return {
            variable.name: part.reshape((*x.shape[:-1], *variable.size))
            for variable, part in zip(self.variables, parts, strict=True)
        }

    def scaled(self, values: Mapping[str, Any]) -> Tensor:
        """Scaled x (n,) of named variables in SI units, inverse of `physical`; beyond a bound, the bound itself."""
        parts = [torch.as_tensor(values[v.name], dtype=torch.float64).reshape(v.count) for v in self.variables]
        return self._within((torch.cat(parts) - self._middle) / self._half_range)

    def unpack(self, x: Tensor) -> Any:
        """The design of scaled x (..., n), as `analyze_design` takes it."""
        return self.complete(self.physical(x))

    def analyze(self, x: Tensor) -> AnalysisT:
        """Everything about the design of scaled x (..., n), in SI units."""
        return self.analyze_design(self.unpack(x))

    def rows(self, analysis: AnalysisT) -> list[Tensor]:
        """Constraint values in engineering units, one tensor (..., k) a row, k = 1 for scalar rows."""
        batch = self.objective.of(analysis).dim()
        values = [constraint.of(analysis) for constraint in self.constraints]
        return [value if value.dim() > batch else value[..., None] for value in values]

    def evaluate(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Scaled objective (...,) and scaled constraints (..., m) at scaled x (..., n), differentiable."""
        analysis = self.analyze(x)
        scaled = [row / constraint.scale for row, constraint in zip(self.rows(analysis), self.constraints, strict=True)]
        return self.objective.of(analysis) / self.objective.scale, torch.cat(scaled, dim=-1)

    @cached_property
    def row_sizes(self) -> tuple[int, ...]:
        """Number of components of each row."""
        with torch.no_grad():
            return tuple(row.shape[-1] for row in self.rows(self.analyze(self.x0)))

    @cached_property
    def constraint_lower(self) -> Tensor:
        """Scaled lower limits (m,)."""
        return self._limits(lambda constraint: constraint.lower)

    @cached_property
    def constraint_upper(self) -> Tensor:
        """Scaled upper limits (m,)."""
        return self._limits(lambda constraint: constraint.upper)

    def _limits(self, limit: Callable[[Constraint[AnalysisT]], float]) -> Tensor:
        parts = [
            torch.full((size,), limit(constraint) / constraint.scale, dtype=torch.float64)
            for constraint, size in zip(self.constraints, self.row_sizes, strict=True)
        ]
        return torch.cat(parts)

    def variable_label(self, index: int) -> str:
        """Name of the scalar variable at `index` of x, for messages."""
        return _label([(v.name, v.count) for v in self.variables], index)

    def constraint_label(self, index: int) -> str:
        """Name of the scalar component at `index` of c, for messages."""
        names = [constraint.name for constraint in self.constraints]
        return _label(list(zip(names, self.row_sizes, strict=True)), index)


def _label(blocks: list[tuple[str, int]], index: int) -> str:
    for name, count in blocks:
        if index < count:
            return name if count == 1 else f"{name}[{index}]"
        index -= count
    raise IndexError(index)
