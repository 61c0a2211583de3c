"""Our figures beside the published ones, generated from a result."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rich.table import Table

from lpc_mdo.numerics.constants import POUND

POUNDS_PER_KILOGRAM = 1.0 / POUND
STUDY_BEST_MERIT, OUR_BEST_MERIT = (
    0.78,
    0.855,
)  # efficient ends of the aeroacoustic fronts: published, and docs/studies.md


@dataclass(frozen=True)
class Headline:
    """One published figure (text, as published), ours, the difference where both are numbers, and why they differ."""

    name: str
    published: str
    ours: str
    difference: str
    why: str


def headlines(content: dict[str, Any]) -> list[Headline]:
    """The rows of published study | ours | difference | why, from a result; none for another aircraft, mission or problem."""
    out = content["outputs"]
    if not content.get("is_published_case", False):
        return []
    if content["problem"] == "aeroacoustic":
        return _hover_headlines(out)
    if content["problem"] != "gross-weight":
        return []
    initial, final = (out[key] * POUNDS_PER_KILOGRAM for key in ("gross_mass_initial_kg", "gross_mass_kg"))
    rows = {row["name"]: row for row in content["constraints"]}
    noise, charge = rows["sound_pressure_level"], rows["final_state_of_charge"]
    level, level_limit = out["sound_pressure_level_dba"], noise["upper"]
    reduction, ratio = out["gross_mass_reduction_percent"], out["lift_to_drag_cruise"]
    pusher = _pusher_change(out)
    return [
        Headline(
            "gross weight, initial",
            "≈ 7500 lb",
            f"{initial:.0f} lb",
            _percent(initial, 7500.0),
            "the study's start values are known in part: docs/design-problem.md",
        ),
        Headline(
            "gross weight, optimized",
            "just under 6600 lb",
            f"{final:.0f} lb",
            _percent(final, 6600.0),
            "motors, noise and wing by models of our own",
        ),
        Headline(
            "reduction",
            "11.4 %",
            f"{reduction:.1f} %",
            f"{_signed(reduction - 11.4, 1)} points",
            "as the two weights above",
        ),
        Headline(
            "wing span, initial to optimized",
            "clearly shorter",
            f"{out['wing_span_initial_m']:.2f} to {out['wing_span_m']:.2f} m",
            _percent(out["wing_span_m"], out["wing_span_initial_m"]) + " from start",
            "as short as the smallest rotors side by side allow; span costs structural mass",
        ),
        Headline(
            "tail area, initial to optimized",
            "slightly smaller",
            f"{out['tail_area_initial_m2']:.2f} to {out['tail_area_m2']:.2f} m²",
            _percent(out["tail_area_m2"], out["tail_area_initial_m2"]) + " from start",
            "no stability row in the problem; the least area of the study's scripts",
        ),
        Headline("L/D in cruise", "≈ 13.5", f"{ratio:.2f}", _percent(ratio, 13.5), _impossible_pair()),
        Headline(
            "minimum drag coefficient",
            "≈ 0.07",
            f"{out['parasitic_drag_coefficient_cruise']:.4f}",
            _percent(out["parasitic_drag_coefficient_cruise"], 0.07),
            "the study's drag area over a smaller wing; it calls its own value unreasonably high",
        ),
        Headline(
            "mean hover figure of merit",
            "≈ 0.65",
            f"{out['figure_of_merit_mean']:.3f}",
            _percent(out["figure_of_merit_mean"], 0.65),
            f"of each model's best: {0.65 / STUDY_BEST_MERIT:.2f} theirs, {out['figure_of_merit_mean'] / OUR_BEST_MERIT:.2f} ours",
        ),
        Headline(
            "hover noise",
            "67 dB(A), active",
            f"{level:.2f} dB(A){_activity(noise)}",
            f"{_signed(level - 67.0, 2)} dB(A)",
            f"limit {level_limit:g}; every tone and band weighted at its own frequency",
        ),
        Headline(
            "final state of charge",
            "0.2, active",
            f"{out['final_state_of_charge']:.4f}{_activity(charge)}",
            _signed(out["final_state_of_charge"] - 0.2, 4),
            "" if charge["active"] else "the battery has energy to spare",
        ),
        Headline(
            "lift motors, largest share of their torque",
            "below 1",
            f"{_largest_lift_share(out):.3f}",
            "",
            "least sizes from the aircraft's own hover torque: docs/design-problem.md",
        ),
        Headline(
            "pusher motor, change",
            "≈ + 4 lb",
            f"{_signed(pusher, 1)} lb",
            f"{_signed(pusher - 4.0, 1)} lb",
            "depends on the start size, here that of the authors' script",
        ),
    ]


def _hover_headlines(out: dict[str, Any]) -> list[Headline]:
    """Blades in hover: the study gives the two ends of its front, between which a single point lies somewhere."""
    return [
        Headline(
            "mean figure of merit, initial to optimized",
            "just below 0.64 (quiet) to just over 0.78 (efficient)",
            f"{out['figure_of_merit_mean_initial']:.3f} to {out['figure_of_merit_mean']:.3f}",
            "",
            "wider chord bounds of the public scripts; profile drag of the airfoil model",
        ),
        Headline(
            "level at the observer, initial to optimized",
            "≈ 81 dB(A) (quiet) to ≈ 91 dB(A) (efficient)",
            f"{out['sound_pressure_level_initial_dba']:.1f} to {out['sound_pressure_level_dba']:.1f} dB(A)",
            "",
            "reference distance of the broadband model and A-weighting: docs/noise.md",
        ),
    ]


def study_headlines(study: Mapping[str, Any]) -> list[Headline]:
    """The same for a study's front: its ends, or its slope; none for another aircraft or mission, or a front of another kind."""
    if not study.get("is_published_case", False):
        return []
    front = sorted((p for p in study["points"] if p["is_on_front"]), key=lambda point: point["position"][0])
    if len(front) < 2 or study["name"] not in ("noise-efficiency", "weight-speed"):
        return []
    if study["name"] == "noise-efficiency":
        return _front_ends(front)
    return [_weight_slope(front), *_pure_speed_end(study, front[0]["position"])]


def _front_ends(front: list[dict[str, Any]]) -> list[Headline]:
    rows = []
    for point, end, merit, merit_text, level in (
        (front[-1], "efficient", 0.78, "just over 0.78", 91.0),
        (front[0], "quiet", 0.64, "just below 0.64", 81.0),
    ):
        (ours, weighted), plain = point["position"], point["outputs"]["sound_pressure_level_unweighted_db"]
        rows.append(
            Headline(
                f"{end} end: mean figure of merit",
                merit_text,
                f"{ours:.3f}",
                _signed(ours - merit, 3),
                "wider chord bounds of the public scripts; weights of the two aims are ours",
            )
        )
        rows.append(
            Headline(
                f"{end} end: level",
                f"≈ {level:.0f} dB(A)",
                f"{weighted:.1f} dB(A)",
                f"{_signed(weighted - level, 1)} dB(A)",
                f"without A-weighting the same design has {plain:.1f} dB: docs/noise.md",
            )
        )
    return rows


def _weight_slope(front: list[dict[str, Any]]) -> Headline:
    (slow, light), (fast, heavy) = front[0]["position"], front[-1]["position"]
    speed, mass = 100.0 * (fast / slow - 1.0), 100.0 * (heavy / light - 1.0)
    return Headline(
        f"gross weight for {_signed(speed, 1)} % of cruise speed",
        "+15 % for +11 %",
        f"{_signed(mass, 2)} %",
        f"{_signed(mass - 15.0, 1)} points",
        "the published end may be one at which weight is not minimized: docs/weight-speed.md",
    )


def _pure_speed_end(study: Mapping[str, Any], slowest: list[float]) -> list[Headline]:
    """The point of a weighted sum at which only the speed counts, where there is one with a result."""
    ends = [point for point in study["points"] if point["value"] == 1.0 and point["status"] == "converged"]
    if study["method"] != "weighted-sum" or not ends:
        return []
    speed, mass = (100.0 * (end / start - 1.0) for end, start in zip(ends[0]["position"], slowest, strict=True))
    return [
        Headline(
            f"pure-speed end of the weighted sum, {_signed(speed, 1)} % of cruise speed",
            "+15 % for +11 %",
            f"{_signed(mass, 1)} %",
            f"{_signed(mass - 15.0, 1)} points",
            "weight is no part of that objective: any feasible aircraft at the largest speed is an optimum",
        )
    ]


def _percent(ours: float, published: float) -> str:
    return f"{_signed(100.0 * (ours / published - 1.0), 1)} %"


def _signed(value: float, digits: int) -> str:
    """With a sign, minus as it is printed; what rounds to zero has none."""
    text = f"{value:+.{digits}f}".replace("-", "−")
    return text if float(f"{value:.{digits}f}") else text[1:]


def _impossible_pair() -> str:
    """Best L/D is sqrt(pi e AR / (4 CD0)): what 13.5 at the study's minimum drag coefficient would need."""
    needed = 4.0 * 0.07 * 13.5**2 / math.pi
    return f"13.5 with a minimum drag coefficient of 0.07 needs e·AR ≥ {needed:.0f}: only lift without induced drag gives it"


def _activity(row: dict[str, Any]) -> str:
    return ", active" if row["active"] else ", not active"


def _largest_lift_share(out: dict[str, Any]) -> float:
    return max(share for point, share in out["motor_torque_share"].items() if not point.startswith("pusher"))


def _pusher_change(out: dict[str, Any]) -> float:
    before, after = (out[key]["pusher_motor"] for key in ("mass_breakdown_initial_kg", "mass_breakdown_kg"))
    return (after - before) * POUNDS_PER_KILOGRAM


OUTPUTS = (
    ("gross mass", "kg", "gross_mass_initial_kg", "gross_mass_kg"),
    ("wing span", "m", "wing_span_initial_m", "wing_span_m"),
    ("tail area", "m²", "tail_area_initial_m2", "tail_area_m2"),
    ("mean hover figure of merit", "", "figure_of_merit_mean_initial", "figure_of_merit_mean"),
    ("sound pressure level", "dB(A)", "sound_pressure_level_initial_dba", "sound_pressure_level_dba"),
    ("L/D in cruise", "", "", "lift_to_drag_cruise"),
    ("final state of charge", "", "", "final_state_of_charge"),
)
"""What a table of a result shows: name, unit, keys of the initial and the optimized design."""


def headline_table(content: dict[str, Any]) -> Table:
    """Published study beside this result; of what the study has not, the initial beside the optimized design."""
    if not headlines(content):
        return _own_table(content)
    table = Table("quantity", "published", "ours", "difference", "why they differ")
    for row in headlines(content):
        table.add_row(row.name, row.published, row.ours, row.difference, row.why)
    return table


def _own_table(content: dict[str, Any]) -> Table:
    table = Table(content["vehicle"], "unit", "initial", "optimized")
    objective, out = content["objective"], content["outputs"]
    if objective["name"] != "gross_mass":
        ends = (f"{objective[key]:.6g}" for key in ("initial", "value"))
        table.add_row(objective["name"].replace("_", " "), _unit(objective["unit"]), *ends)
    for name, unit, before, after in OUTPUTS:
        if after in out:
            table.add_row(name, unit, f"{out[before]:.5g}" if before in out else "", f"{out[after]:.5g}")
    return table


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit.replace("^2", "²")
