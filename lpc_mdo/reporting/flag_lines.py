"""Flags of a stored result in a line for each kind, for report and terminal."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lpc_mdo.reporting import wording

TITLES = {
    "motor_torque_share": "motors asked for more torque than they have, times the largest",
    "battery_empty": "battery empty, state of charge",
    "battery_power": "battery asked for more power than it sustains, share",
    "induced_drag_negative": "induced drag below zero, N",
    "tip_mach": "blade tips beyond Mach {limit}",
    "windmilling": "rotors driven by the air, torque N m",
    "vortex_ring": "vortex-ring state, descent m/s",
    "polar_extrapolated": "share of the blade's span beyond its airfoil's polars",
    "stall_extrapolated": "half-widths beyond the polars of the wing's section",
    "structure_extrapolated": "half-widths from the centre of the samples of structural mass, which end at {limit}",
    "structure_leverage": "leverage of the structural inputs together, beyond the samples'",
}
"""What a line of the summary says of each kind; the loudest first."""
LOUD = ("motor_torque_share", "battery_empty", "battery_power", "induced_drag_negative")
"""Kinds of which an aircraft cannot fly: more than a model's range."""


@dataclass(frozen=True)
class FlagLine:
    """Every flag of one kind in a sentence."""

    text: str
    is_loud: bool


def flag_lines(flags: Sequence[Mapping[str, Any]]) -> list[FlagLine]:
    """One line for each kind of flag of a stored result, the loudest first: where, and by how much."""
    return [FlagLine(f"{_title(kind, flags)}: {_places(kind, flags)}", kind in LOUD) for kind in _kinds(flags)]


def _title(kind: str, flags: Sequence[Mapping[str, Any]]) -> str:
    """With the limit of the kind's first flag where the title names it."""
    if kind not in TITLES:
        return wording.words(kind)
    limit = next(flag["limit"] for flag in flags if flag["what"] == kind)
    return TITLES[kind].format(limit="their limit" if limit is None else f"{limit:g}")


def study_flag_lines(points: Sequence[Mapping[str, Any]], parameter: str) -> list[FlagLine]:
    """One line for each kind of flag of a study's points, the loudest first: which points, and how far the farthest goes."""
    flags = [flag | {"point": point["value"]} for point in points for flag in point.get("flags", [])]
    lines = []
    for kind in _kinds(flags):
        own = [flag for flag in flags if flag["what"] == kind]
        values = [flag["value"] for flag in own if flag["value"] is not None]
        farthest = f", up to {_number(max(values, key=abs))}" if values else ""
        where = ", ".join(f"{value:.5g}".replace("-", "−") for value in dict.fromkeys(flag["point"] for flag in own))
        lines.append(FlagLine(f"{_title(kind, own)}{farthest}: {parameter} {where}", kind in LOUD))
    return lines


def _kinds(flags: Sequence[Mapping[str, Any]]) -> list[str]:
    """Kinds of flags, the loudest first."""
    found = dict.fromkeys(flag["what"] for flag in flags)
    return [kind for kind in TITLES if kind in found] + [kind for kind in found if kind not in TITLES]


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}".replace("-", "−")


def _places(kind: str, flags: Sequence[Mapping[str, Any]]) -> str:
    """Places with one value, to four digits, stand together."""
    by_value: dict[str, list[str]] = {}
    for flag in flags:
        if flag["what"] == kind:
            by_value.setdefault(_number(flag["value"]), []).append(wording.quantity(flag["where"]))
    return "; ".join(f"{' and '.join(filter(None, places))} {value}".strip() for value, places in by_value.items())
