"""report.html: one page without any outside reference, light and dark, for screens of any width and for print."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from lpc_mdo.reporting import style, wording
from lpc_mdo.reporting.flag_lines import flag_lines, study_flag_lines
from lpc_mdo.reporting.stored import StoredRun
from lpc_mdo.reporting.tables import POUNDS_PER_KILOGRAM, headlines, study_headlines
from lpc_mdo.reporting.verification import stored_verification, summary

THEMED = {
    style.INK: "ink",
    style.MUTED: "muted",
    style.GRID: "grid",
    style.SURFACE: "surface",
    style.AFTER: "after",
    style.tint(style.AFTER): "after-tint",
    style.tint(style.BEFORE): "before-tint",
    style.tint(style.GREEN): "green-tint",
}
"""Colours of the figures that follow the page's light or dark theme."""


@dataclass(frozen=True)
class DrawnFigure:
    """A figure as text, ready for a page."""

    name: str
    title: str
    caption: str
    svg: str


@cache
def _templates() -> Environment:
    environment = Environment(
        loader=PackageLoader("lpc_mdo.reporting"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters |= {"number": number, "words": wording.words, "unit": _unit, "quantity": wording.quantity}
    environment.globals["inline"] = inline
    return environment


def page(run: StoredRun, sections: Mapping[str, Sequence[DrawnFigure]]) -> str:
    """The page of a run; `sections` maps headings to drawn figures."""
    return (
        _templates()
        .get_template("report.html.j2")
        .render(
            result=run.result,
            tiles=_tiles(run.result),
            headlines=headlines(run.result),
            constraints=[_constraint(row) for row in run.result["constraints"]],
            variables=[_variable(entry) for entry in run.result["design_variables"]],
            on_bounds=run.result["variables_on_bounds"],
            flags=flag_lines(run.result.get("flags", [])),
            checks=run.analysis["checks"],
            verification=summary(stored_verification()),
            sections=sections,
            starts=run.starts,
        )
    )


def study_page(study: Mapping[str, Any], figures: Sequence[DrawnFigure]) -> str:
    """The page of a study."""
    counts = Counter(point["status"] for point in study["points"])
    return (
        _templates()
        .get_template("study.html.j2")
        .render(
            study=study,
            figures=figures,
            counts=counts,
            headlines=study_headlines(study),
            flags=study_flag_lines(study["points"], wording.quantity(study["parameter"]["name"])),
        )
    )


def inline(name: str, svg: str) -> str:
    """An SVG file's text as part of a page: names of its own, the page's colours, the width of its column."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    width, height = re.findall(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', body)[0]
    body = re.sub(r"<svg[^>]*>", f'<svg viewBox="0 0 {width} {height}" aria-hidden="true">', body, count=1)
    for reference in set(re.findall(r'(?:url\(#|href="#)([^)"]+)', body)):
        body = body.replace(f'id="{reference}"', f'ID="{name}-{reference}"')
        body = body.replace(f"url(#{reference})", f"url(#{name}-{reference})")
        body = body.replace(f'href="#{reference}"', f'href="#{name}-{reference}"')
    body = re.sub(r' id="[^"]*"', "", body).replace(' ID="', ' id="').replace("xlink:href", "href")
    for color, role in THEMED.items():
        body = body.replace(color, f"var(--{role})")
    return body


def number(value: float | None, digits: int = 5) -> str:
    """A number for people: significant digits, a true minus sign, a dash for none."""
    if value is None:
        return "–"
    return f"{value:.{digits}g}".replace("-", "−")


def _tiles(result: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """(label, value, beside it) of the figures that a reader wants first."""
    out, objective = result["outputs"], result["objective"]
    tiles = []
    if "gross_mass_kg" in out:
        mass = out["gross_mass_kg"]
        change = f"−{out['gross_mass_reduction_percent']:.1f} % from {out['gross_mass_initial_kg']:.0f} kg"
        tiles.append(("gross weight", f"{mass:.0f} kg", f"{mass * POUNDS_PER_KILOGRAM:.0f} lb, {change}"))
    else:
        unit = "" if objective["unit"] == "1" else f" {objective['unit']}"
        before = f"from {number(objective['initial'])}{unit}"
        tiles.append((wording.words(objective["name"]), f"{number(objective['value'])}{unit}", before))
    known = (
        ("lift_to_drag_cruise", "L/D in cruise", "{:.1f}", ""),
        ("sound_pressure_level_dba", "hover noise", "{:.1f} dB(A)", "at the observer"),
        ("final_state_of_charge", "state of charge", "{:.1%}", "after the reserve"),
        ("figure_of_merit_mean", "figure of merit", "{:.3f}", "mean in hover"),
        ("wing_span_m", "wing span", "{:.1f} m", ""),
    )
    tiles += [(label, form.format(out[key]), beside) for key, label, form, beside in known if key in out]
    return tiles


def _unit(unit: str) -> str:
    return "–" if unit == "1" else unit.replace("^2", "²")


def _constraint(row: Mapping[str, Any]) -> dict[str, str]:
    """One line of the table of constraints, as text."""
    lower, upper = row["lower"], row["upper"]
    if row["kind"] == "equality":
        limit = f"= {number(lower)}"
    else:
        limit = " and ".join(
            f"{sign} {number(value)}" for sign, value in (("≥", lower), ("≤", upper)) if value is not None
        )
    multiplier = row["multiplier"]
    if isinstance(multiplier, list):
        multiplier = max(multiplier, key=abs)
    return {
        "name": wording.words(row["name"]),
        "size": str(row["size"]),
        "unit": _unit(row["unit"]),
        "limit": limit,
        "initial": _range(row["initial"]),
        "value": _range(row["value"]),
        "multiplier": number(multiplier, 3) if row["active"] else "–",
        "state": "active" if row["active"] else "slack",
    }


def _variable(entry: Mapping[str, Any]) -> dict[str, str]:
    """One line of the table of design variables, as text."""
    values, lower, upper = _flat(entry["value"]), _flat(entry["lower"]), _flat(entry["upper"])
    # One bound for all, or one for each element of the first dimension.
    bounds = [ends for ends in zip(lower, upper, strict=True) for _ in range(len(values) // len(lower))]
    reach = 1e-6
    low = sum(v <= least + reach * (most - least) for v, (least, most) in zip(values, bounds, strict=True))
    high = sum(v >= most - reach * (most - least) for v, (least, most) in zip(values, bounds, strict=True))
    return {
        "name": wording.words(entry["name"]),
        "size": str(entry["size"]),
        "unit": _unit(entry["unit"]),
        "bounds": "; ".join(
            f"{number(a, 4)} … {number(b, 4)}" for a, b in dict.fromkeys(zip(lower, upper, strict=True))
        ),
        "initial": _range(entry["initial"]),
        "value": _range(entry["value"]),
        "at_bound": ", ".join(f"{count} {side}" for count, side in ((low, "low"), (high, "high")) if count) or "–",
    }


def _flat(value: Any) -> list[float]:
    return [number for item in value for number in _flat(item)] if isinstance(value, list) else [value]


def _range(value: Any) -> str:
    """One number, or the smallest and largest of several."""
    values = [item for item in _flat(value) if item is not None]
    if not values:
        return "–"
    low, high = min(values), max(values)
    # Components that agree to four digits read as one number.
    if abs(high - low) <= 1e-4 * max(abs(low), abs(high)):
        return number(high)
    return f"{number(low, 4)} … {number(high, 4)}"
