"""What the default problem decides that the published study leaves open: each choice, its reason, and what another does.

    python scripts/choices.py [--output FILE]

Prints the table of docs/design-problem.md. Every row is an optimum of its own (reduced formulation); its reduction counts from
its own start.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from markdown_table import print_table

import lpc_mdo
from lpc_mdo.problems.reduced import reduced_problem
from lpc_mdo.studies.single import solve


@dataclass(frozen=True)
class Choice:
    what: str
    reason: str
    other: str
    overrides: tuple[str, ...]


CHOICES = (
    Choice(
        "profile drag of wing and tail beside the study's 9 ft², without an allowance for leakage",
        "so does the authors' lattice code",
        "wetted-area build-up of everything",
        ("vehicle.drag.source=build_up",),
    ),
    Choice(
        "the drag area acts in the middle of the body (4.37, 0, 2.02 m)",
        "mean of the build-up's items without wing and tail; the code gives it no moment",
        "half a metre higher",
        ("vehicle.drag.study.position_m.2=2.52",),
    ),
    Choice(
        "wing's maximum lift is 0.9 of its section's",
        "Raymer (2018) eq. 12.15; the study gives none",
        "0.7",
        ("vehicle.wing.maximum_lift_factor=0.7",),
    ),
    Choice(
        "no discharge efficiency",
        "the authors' battery model has none",
        "0.95, usual for cells and bus",
        ("vehicle.battery.discharge_efficiency=0.95",),
    ),
    Choice(
        "lift motors give the aircraft's own hover torque",
        "the paper: their lower bound is so high that the torque limit is not active",
        "bounds of the authors' script, 0.08 × 0.05 m",
        ("vehicle.motors.lift_bounds=file",),
    ),
    Choice(
        "chord at most 0.5 m",
        "authors' scripts of 2024; 1.1 ft in an older one; NASA's blades have up to 0.75 m",
        "0.75 m; the slowest hover that lift motors are bounded for is then slower",
        ("vehicle.bounds.blade_chord_m.upper=0.75",),
    ),
    Choice(
        "lift-rotor radius at least 1.2 m",
        "authors' scripts of 2024",
        "0.76 m, an older one",
        ("vehicle.bounds.lift_rotor_radius_m.lower=0.762",),
    ),
    Choice(
        "every tone and band weighted at its own frequency",
        "IEC 61672; the authors' codes do otherwise: docs/noise.md",
        "as the authors' code of 2023",
        ("mission.requirements.acoustic_convention=lsdo_acoustics_2023",),
    ),
    Choice(
        "pusher in axial inflow",
        "as the study's blade-element model",
        "averaged over a revolution at the pitch flown",
        ("mission.rotor_inflow=inclined",),
    ),
    Choice(
        "structural regressions as they are, outside their samples too",
        "as the study; the result says how far outside",
        "a smooth penalty on the masses there",
        ("vehicle.structure.outside_samples=penalty",),
    ),
    Choice(
        "reserve by distance, 43 miles",
        "the paper; equals 20 minutes at 112 kt",
        "20 minutes",
        ("mission.reserve.duration_s=1200",),
    ),
    Choice(
        "tail's root may move by half a metre",
        "assumed: the tail cone; no stability row guards it",
        "it stays where it is",
        (
            "vehicle.bounds.tail_position_m.lower=8.6465",
            "vehicle.bounds.tail_position_m.upper=8.6465",
        ),
    ),
)


def optimum(overrides: tuple[str, ...]) -> dict:
    """The outputs of the optimum with these overrides, and its status."""
    _, content = solve(reduced_problem(*lpc_mdo.load(overrides=overrides)), solver="sqp")
    return content.outputs | {"status": content.status}


def table() -> Iterator[str]:
    """Lines of Markdown, one row a choice."""
    ours = optimum(())
    yield f"Our optimum: {ours['gross_mass_kg']:.1f} kg, {ours['gross_mass_reduction_percent']:.1f} % below the start."
    yield ""
    yield "| our choice | reason | another | optimum with it |"
    yield "|---|---|---|---|"
    for choice in CHOICES:
        yield f"| {choice.what} | {choice.reason} | {choice.other} | {effect(optimum(choice.overrides), ours)} |"


def effect(other: dict, ours: dict) -> str:
    """What becomes of the optimum, in words for a table's cell."""
    if other["status"] != "converged":
        return f"none: {other['status'].replace('_', ' ')}"
    change = f"{other['gross_mass_kg'] - ours['gross_mass_kg']:+.1f}".replace("-", "−")
    start = other["gross_mass_initial_kg"]
    words = f"{'0.0' if float(change[1:]) == 0.0 else change} kg; {other['gross_mass_reduction_percent']:.1f} %"
    if abs(start / ours["gross_mass_initial_kg"] - 1.0) > 0.01:
        words += f" of a start of {start:.0f} kg"
    share = max(other["motor_torque_share"].values())
    # A share of one is the pusher's in climb, where its own row is active.
    return words if share <= 1.0 + 1e-6 else f"{words}; lift motors at {share:.2f} times their torque"


if __name__ == "__main__":
    print_table(__doc__, table())
