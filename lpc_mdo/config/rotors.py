"""Rotors with their blades."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from lpc_mdo.config.tables import (
    FROM_DEGREES,
    FROM_RPM,
    Identifier,
    Name,
    Point,
    Table,
    beside,
    between,
    key,
    not_a_truth_value,
)

LIFT_ROTOR_COUNTS = range(4, 17, 2)
MOST_PUSHERS = 8
CONTROL_POINTS = 28  # of a blade at most: it has as many stations
Kind = Literal["lift", "pusher"]
KINDS = get_args(Kind)


class RotorSpecification(Table):
    """One rotor: hub in m, blade chord (2 control points or more, m), twist (4 or more, rad), speed in rad/s.

    kind: its duty; segments turn all rotors of a kind unless they name groups. group: rotors whose speeds are one block of variables,
    and which a segment may name alone; default: the kind.
    """

    name: Name
    kind: Kind
    hub: Point = Field(alias="hub_m")
    spin: Annotated[Literal[-1, 1], BeforeValidator(not_a_truth_value)]
    radius: float = key("radius_m", 0.2, 10.0)
    root_cutout: float = between(0.05, 0.5)
    blades: int = between(2, 8)
    chord: tuple[Annotated[float, between(0.01, 2.0)], ...] = Field(
        alias="chord_m", min_length=2, max_length=CONTROL_POINTS
    )
    twist: tuple[Annotated[float, between(-10.0, 90.0), FROM_DEGREES], ...] = Field(
        alias="twist_deg", min_length=4, max_length=CONTROL_POINTS
    )
    speed: Annotated[float, between(50.0, 10000.0), FROM_RPM] = Field(alias="speed_rpm")
    group: Identifier
    airfoil: tuple[tuple[str, Annotated[float, between(0.0, 1.0)]], ...] = (("naca4412", 1.0),)

    @model_validator(mode="before")
    @classmethod
    def _names_sections_and_group(cls, data: Any, info: ValidationInfo) -> Any:
        """One name, or [name, fraction of the radius] from the root to the tip; cards and files lie beside the vehicle file."""
        if not isinstance(data, dict):
            return data
        # Beside a kind that is wrong or missing, which is told, nothing is said of a group that follows from it.
        data = {"group": data.get("kind") if data.get("kind") in KINDS else KINDS[0]} | data
        if not isinstance(data.get("airfoil"), str | list | tuple):
            return data
        folder, given = (info.context or {}).get("folder", Path()), data["airfoil"]
        pairs = [(given, 1.0)] if isinstance(given, str) else given

        def located(pair: Any) -> Any:
            is_pair = isinstance(pair, list | tuple) and len(pair) == 2 and isinstance(pair[0], str)
            return (beside(pair[0], folder), pair[1]) if is_pair else pair

        return data | {"airfoil": tuple(located(pair) for pair in pairs)}

    @property
    def axis(self) -> tuple[float, float, float]:
        """Direction of its thrust in geometry axes: up, or forward."""
        return (0.0, 0.0, 1.0) if self.kind == "lift" else (-1.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _orders_its_sections(self) -> "RotorSpecification":
        fractions = [fraction for _, fraction in self.airfoil]
        if not fractions or sorted(set(fractions)) != fractions:
            raise ValueError(
                f"airfoil = {[list(pair) for pair in self.airfoil]} is invalid: it must name sections at increasing "
                "fractions of the radius"
            )
        return self


def groups_named(names: Iterable[str], rotors: Iterable[RotorSpecification]) -> tuple[str, ...]:
    """Groups that names stand for, in the rotors' order: a kind for all its groups, any other name for the group of that name."""
    wanted = set(names)
    return tuple(dict.fromkeys(rotor.group for rotor in rotors if wanted & {rotor.kind, rotor.group}))
