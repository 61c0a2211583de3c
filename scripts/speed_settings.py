"""What 11 % more cruise speed costs at the optimum, by parts, under settings of the mission and of the vehicle.

    python scripts/speed_settings.py [--output FILE]

Prints the table of docs/weight-speed.md. Every row is two optima (reduced formulation): at the mission's speed and at 1.11 times it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from markdown_table import print_table

import lpc_mdo
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.problems.problem import Problem
from lpc_mdo.problems.reduced import reduced_problem
from lpc_mdo.reporting.weight_parts import PARTS, masses_by_part
from lpc_mdo.studies.single import solve

FASTER = 1.11
TIME = ("mission.reserve.duration_s=1200",)
CLIMB = ("mission.climb.speed_m_per_s=cruise",)
NARROW = (  # 20 % about the file's values
    "vehicle.bounds.wing_area_m2.lower=15.629",
    "vehicle.bounds.wing_aspect_ratio.lower=9.714",
    "vehicle.bounds.tail_area_m2.lower=2.936",
    "vehicle.bounds.tail_area_m2.upper=4.405",
    "vehicle.bounds.tail_aspect_ratio.lower=3.44",
    "vehicle.bounds.tail_aspect_ratio.upper=5.16",
)


@dataclass(frozen=True)
class Setting:
    name: str
    overrides: tuple[str, ...] = ()
    has_torque_rows: bool = False  # lift motors free, and a row for the torque of each


SETTINGS = (
    Setting("as shipped"),
    Setting("reserve of 20 minutes", TIME),
    Setting("climb at the cruise speed", CLIMB),
    Setting("both", TIME + CLIMB),
    Setting("wing and tail within 20 % of the file", NARROW),
    Setting("a row for the torque of each lift motor instead of their lower bounds", (), has_torque_rows=True),
    Setting("all of these", TIME + CLIMB + NARROW, has_torque_rows=True),
)


def problem_of(setting: Setting, speed: float) -> Problem[Analysis]:
    """The gross-weight problem under the setting at a cruise speed, m/s."""
    overrides = [*setting.overrides, f"mission.cruise.speed_m_per_s={speed}"]
    if setting.has_torque_rows:
        overrides += [
            "vehicle.motors.lift_bounds=file",
            'mission.requirements.torque_segments=["hover", "climb", "cruise"]',
        ]
    return reduced_problem(*lpc_mdo.load(overrides=overrides))


def optimum(setting: Setting, speed: float) -> dict[str, Any]:
    _, content = solve(problem_of(setting, speed), solver="sqp")
    return content.outputs | {"status": content.status}


def line(setting: Setting) -> str:
    """One row of the table: mass at the mission's speed, and what 11 % more adds."""
    speed = lpc_mdo.load()[1].speed("cruise")
    slow, fast = (optimum(setting, speed * factor) for factor in (1.0, FASTER))
    if {slow["status"], fast["status"]} != {"converged"}:
        return f"| {setting.name} | {slow['status']}, {fast['status']} |" + " |" * (1 + len(PARTS))
    more = fast["gross_mass_kg"] - slow["gross_mass_kg"]
    parts = [masses_by_part(outputs["mass_breakdown_kg"]) for outputs in (slow, fast)]
    changes = " | ".join(f"{parts[1][name] - parts[0][name]:+.1f}" for name in PARTS)
    mass = slow["gross_mass_kg"]
    return f"| {setting.name} | {mass:.1f} | {100.0 * more / mass:+.2f} % | {changes} |".replace("-", "−")


def table() -> Iterator[str]:
    """Lines of Markdown, one row a setting."""
    heads = ["setting", "gross mass, kg", "at 1.11 times the speed", *(f"{name}, kg" for name in PARTS)]
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    for setting in SETTINGS:
        yield line(setting)


if __name__ == "__main__":
    print_table(__doc__, table())
