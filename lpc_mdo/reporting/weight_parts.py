"""What more speed costs: gross mass along a weight-speed front by battery, structure, motors and fixed masses."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isclose
from typing import Any

from rich.table import Table

from lpc_mdo.reporting.stored import NO_STRUCTURE, StoredStudy

SAME = 1e-6  # relative difference of speeds that count as one
PARTS = ("battery", "structure", "motors")


@dataclass(frozen=True)
class WeightParts:
    """Masses, kg, of one optimum and its cruise speed, m/s; what the parts leave of the total is fixed."""

    speed: float
    total: float
    parts: dict[str, float]


def weight_parts(study: StoredStudy) -> list[WeightParts]:
    """The points on the front, slowest first, equal ones once; none of a study of something else."""
    if study.content["name"] != "weight-speed":
        return []
    points = [point for point in study.content["points"] if point["is_on_front"]]
    rows = [_parts(point["position"], study.results[point["folder"]]["outputs"]) for point in points]
    rows.sort(key=lambda row: row.speed)
    return [row for i, row in enumerate(rows) if i == 0 or not isclose(row.speed, rows[i - 1].speed, rel_tol=SAME)]


def _parts(position: list[float], outputs: dict[str, Any]) -> WeightParts:
    return WeightParts(position[0], position[1], masses_by_part(outputs["mass_breakdown_kg"]))


def masses_by_part(groups: Mapping[str, float]) -> dict[str, float]:
    """Masses of PARTS from those of all groups, kg."""
    return {
        "battery": groups["battery"],
        "structure": sum(mass for name, mass in groups.items() if name not in NO_STRUCTURE),
        "motors": groups["lift_motors"] + groups["pusher_motor"],
    }


def parts_table(rows: list[WeightParts]) -> Table:
    """Masses of the slowest aircraft, then what the others have more, in kg and as a share of the slowest's gross mass."""
    slowest = rows[0]
    table = Table("m/s", "speed, %", "gross", *PARTS, "gross, %")
    masses = (f"{slowest.parts[name]:.2f}" for name in PARTS)
    table.add_row(f"{slowest.speed:.3f}", "", f"{slowest.total:.2f}", *masses, "")
    for row in rows[1:]:
        table.add_row(
            f"{row.speed:.3f}",
            f"{100.0 * (row.speed / slowest.speed - 1.0):+.2f}",
            f"{row.total:.2f}",
            *(f"{row.parts[name] - slowest.parts[name]:+.2f}" for name in PARTS),
            f"{100.0 * (row.total / slowest.total - 1.0):+.2f}",
        )
    return table
