"""Where a result rests on bounds, and why a run that did not converge ended where it did."""

from typing import Literal

from pydantic import Field

from lpc_mdo.files.values import (
    Count,
    Name,
    Number,
    Stored,
    Text,
)


class OnBound(Stored):
    """A variable with so many scalars that stand on a bound."""

    variable: Name
    unit: Name
    side: Literal["lower", "upper"]
    bound: Number
    count: Count
    size: Count
    reason: Text


class Conflict(Stored):
    """A component of a row that is missed; share: of the violation's square, in the solver's scaling."""

    constraint: Name
    unit: Name
    reached: Number | None
    lower: Number | None
    upper: Number | None
    share: Number | None


class Price(Stored):
    """What an inequality's limit costs where the run ended: d objective / d limit."""

    constraint: Name
    unit: Name
    value: Number | None


class HeldBound(Stored):
    """A bound against which the design is pressed; `count` of the variable's components stand on it."""

    variable: Name
    unit: Name
    side: Literal["lower", "upper"]
    bound: Number
    count: Count
    size: Count


class Relaxation(Stored):
    """A limit that, moved so far and alone, would let every constraint hold, to first order."""

    constraint: Name
    unit: Name
    side: Literal["lower", "upper"]
    limit: Number
    relaxed: Number


class Diagnosis(Stored):
    """Why a run did not converge; everything is empty where it does not apply."""

    conflicts: tuple[Conflict, ...]
    prices: tuple[Price, ...]
    bounds: tuple[HeldBound, ...]
    relaxations: tuple[Relaxation, ...]
    is_within_reach: bool = Field(strict=True)
