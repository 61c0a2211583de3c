"""One row of the verification table, and where the figures of others lie."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

SOURCE_TREE = Path(__file__).parents[2]
REFERENCE = Path(__file__).parent / "reference"


@dataclass(frozen=True)
class Comparison:
    """A model against something that is not ours.

    `ours` and `theirs` carry the unit that `quantity` names; of several values they are those that differ most.
    """

    model: str
    against: str
    quantity: str
    ours: float
    theirs: float
    difference: float
    tolerance: float  # what the difference may be
    reason: str  # why it differs
    unit: str = ""  # of the difference; relative without

    @property
    def is_met(self) -> bool:
        """False for a difference that is not a number, too."""
        return abs(self.difference) <= self.tolerance


@dataclass(frozen=True)
class Between:
    """Whom a row compares; its methods make rows, each by another measure of the difference."""

    model: str
    against: str

    def relative(self, quantity: str, ours: object, theirs: object, tolerance: float, reason: str) -> Comparison:
        """The largest relative difference of numbers or sequences of them, element by element."""
        pairs = _pairs(ours, theirs)
        a, b = max(pairs, key=lambda pair: _size(pair[0] / pair[1] - 1.0))
        return self._row(quantity, a, b, a / b - 1.0, tolerance, reason)

    def of_largest(self, quantity: str, ours: object, theirs: object, tolerance: float, reason: str) -> Comparison:
        """The largest difference over the largest of the reference: for columns that pass through zero."""
        pairs = _pairs(ours, theirs)
        scale = max(abs(b) for _, b in pairs)
        a, b = max(pairs, key=lambda pair: _size(pair[0] - pair[1]))
        return self._row(quantity, a, b, (a - b) / scale, tolerance, reason)

    def absolute(
        self, quantity: str, ours: object, theirs: object, tolerance: float, reason: str, unit: str
    ) -> Comparison:
        """The largest difference in `unit`."""
        a, b = max(_pairs(ours, theirs), key=lambda pair: _size(pair[0] - pair[1]))
        return self._row(quantity, a, b, a - b, tolerance, reason, unit)

    def mean_relative(self, quantity: str, ours: object, theirs: object, tolerance: float, reason: str) -> Comparison:
        """Mean size of the relative differences, beside the means of both sides."""
        pairs = _pairs(ours, theirs)
        means = [sum(column) / len(pairs) for column in zip(*pairs, strict=True)]
        gap = sum(abs(a / b - 1.0) for a, b in pairs) / len(pairs)
        return self._row(quantity, *means, gap, tolerance, reason)

    def mean_absolute(
        self, quantity: str, ours: object, theirs: object, tolerance: float, reason: str, unit: str
    ) -> Comparison:
        """Mean size of the differences in `unit`, beside the means of both sides."""
        pairs = _pairs(ours, theirs)
        means = [sum(column) / len(pairs) for column in zip(*pairs, strict=True)]
        gap = sum(abs(a - b) for a, b in pairs) / len(pairs)
        return self._row(quantity, *means, gap, tolerance, reason, unit)

    def _row(
        self, quantity: str, ours: float, theirs: float, gap: float, limit: float, reason: str, unit: str = ""
    ) -> Comparison:
        return Comparison(self.model, self.against, quantity, ours, theirs, gap, limit, reason, unit)


def _pairs(ours: object, theirs: object) -> list[tuple[float, float]]:
    return list(zip(_numbers(ours), _numbers(theirs), strict=True))


def _numbers(values: Any) -> list[float]:
    """Numbers, sequences, arrays and tensors of any shape as one list."""
    if hasattr(values, "tolist"):
        values = values.tolist()
    if isinstance(values, Iterable):
        return [number for value in values for number in _numbers(value)]
    return [float(values)]


def _size(value: float) -> float:
    """Magnitude, what is not a number being the largest of all."""
    return abs(value) if value == value else float("inf")


@cache
def reference(name: str) -> dict[str, Any]:
    """A reference file. Raises FileNotFoundError outside a source tree, which alone holds them."""
    file = REFERENCE / f"{name}.json"
    if not file.is_file():
        raise FileNotFoundError(f"{file} is missing; comparisons with references need the source tree")
    return json.loads(file.read_text(encoding="utf-8"))
