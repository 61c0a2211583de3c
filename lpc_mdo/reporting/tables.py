"""Tables for the terminal: our figures beside the published ones."""

from dataclasses import dataclass
from typing import Any

from rich.table import Table

POUNDS_PER_KILOGRAM = 1.0 / 0.45359237


@dataclass(frozen=True)
class Headline:
    """One published figure (text, as published), ours, and why they differ."""

    name: str
    published: str
    ours: str
    why: str


def headlines(content: dict[str, Any]) -> list[Headline]:
    """The rows of published study | ours | why, from a result."""
    if content["problem"] == "aeroacoustic":
        return _hover_headlines(content["outputs"])
    out = content["outputs"]
    initial, final = (out[key] * POUNDS_PER_KILOGRAM for key in ("gross_mass_initial_kg", "gross_mass_kg"))
    rows = {row["name"]: row for row in content["constraints"]}
    limit = rows["sound_pressure_level"]["upper"]
    return [
        Headline(
            "gross weight, initial", "≈ 7500 lb", f"{initial:.0f} lb", "structure, motors and battery start differ"
        ),
        Headline(
            "gross weight, optimized",
            "just under 6600 lb",
            f"{final:.0f} lb",
            "less drag, and start values that leave more to gain",
        ),
        Headline(
            "reduction",
            "11.4 %",
            f"{out['gross_mass_reduction_percent']:.1f} %",
            "lift motors start oversized: the problem limits no torque of theirs",
        ),
        Headline(
            "wing span, initial to optimized",
            "clearly shorter",
            f"{out['wing_span_initial_m']:.2f} to {out['wing_span_m']:.2f} m",
            "span costs structural mass",
        ),
        Headline(
            "tail area, initial to optimized",
            "slightly smaller",
            f"{out['tail_area_initial_m2']:.2f} to {out['tail_area_m2']:.2f} m²",
            "no stability constraint in the problem",
        ),
        Headline("L/D in cruise", "≈ 13.5", f"{out['lift_to_drag_cruise']:.2f}", "drag build-up from wetted areas"),
        Headline(
            "minimum drag coefficient",
            "≈ 0.07",
            f"{out['parasitic_drag_coefficient_cruise']:.4f}",
            "the study itself calls its value unreasonably high",
        ),
        Headline(
            "mean hover figure of merit",
            "≈ 0.65",
            f"{out['figure_of_merit_mean']:.3f}",
            "quiet, slow, heavily loaded blades cost nothing: hover power is no limit",
        ),
        Headline(
            "hover noise",
            "67 dB(A), active",
            f"{out['sound_pressure_level_dba']:.2f} dB(A){_activity(rows['sound_pressure_level'])}",
            f"limit {limit:g}; broadband weighted in its own bands",
        ),
        Headline(
            "final state of charge",
            "0.2, active",
            f"{out['final_state_of_charge']:.4f}{_activity(rows['final_state_of_charge'])}",
            "less drag: the battery stops at its own lower bound",
        ),
        Headline(
            "pusher motor, change",
            "≈ + 4 lb",
            f"{_pusher_change(out):+.1f} lb",
            "start size and gear ratio assumed",
        ),
    ]


def _hover_headlines(out: dict[str, Any]) -> list[Headline]:
    """Blades in hover: the study gives the two ends of its front."""
    return [
        Headline(
            "mean figure of merit, initial to optimized",
            "just below 0.64 (quiet) to just over 0.78 (efficient)",
            f"{out['figure_of_merit_mean_initial']:.3f} to {out['figure_of_merit_mean']:.3f}",
            "wider chord bounds of the public scripts; profile drag of the airfoil model",
        ),
        Headline(
            "level at the observer, initial to optimized",
            "≈ 81 dB(A) (quiet) to ≈ 91 dB(A) (efficient)",
            f"{out['sound_pressure_level_initial_dba']:.1f} to {out['sound_pressure_level_dba']:.1f} dB(A)",
            "reference distance of the broadband model and A-weighting: docs/studies.md",
        ),
    ]


def _activity(row: dict[str, Any]) -> str:
    return ", active" if row["active"] else ", not active"


def _pusher_change(out: dict[str, Any]) -> float:
    before, after = (out[key]["pusher_motor"] for key in ("mass_breakdown_initial_kg", "mass_breakdown_kg"))
    return (after - before) * POUNDS_PER_KILOGRAM


def headline_table(content: dict[str, Any]) -> Table:
    """Published study beside this result."""
    table = Table("quantity", "published", "ours", "why they differ")
    for row in headlines(content):
        table.add_row(row.name, row.published, row.ours, row.why)
    return table
