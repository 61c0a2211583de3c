"""The optimum with each source of structural mass, side by side: the table of docs/structures.md.

    python scripts/structure_sources.py [--output FILE]

Every column is an optimum of its own (reduced formulation).
"""

from collections.abc import Iterator

from markdown_table import print_table

import lpc_mdo
from lpc_mdo.problems.reduced import reduced_problem
from lpc_mdo.reporting import wording
from lpc_mdo.reporting.weight_parts import masses_by_part
from lpc_mdo.stored.result import Result
from lpc_mdo.studies.single import solve

OPEN = "vehicle.structure.source=open"
SOURCES: dict[str, tuple[str, ...]] = {
    "`published`": (),
    "`open`": (OPEN,),
    "`open`, calibrated to published": (OPEN, "vehicle.structure.is_calibrated_to_published=true"),
}
BOOMS, TAILS = "boom_", ("horizontal_tail", "vertical_tail")


def optimum(overrides: tuple[str, ...]) -> Result:
    """The result with these overrides."""
    _, content = solve(reduced_problem(*lpc_mdo.load(overrides=overrides)), solver="sqp")
    return content


def column(content: Result) -> dict[str, str]:
    """Cells of one source by the row's name."""
    out = content.outputs
    before, after = out["mass_breakdown_initial_kg"], out["mass_breakdown_kg"]
    structure = [masses_by_part(groups)["structure"] for groups in (before, after)]
    outside = [flag for flag in content.flags if flag.what == "structure_extrapolated"]
    places = ", ".join(f"{wording.quantity(flag.where)} {flag.value:.1f}" for flag in outside).replace("-", "−")
    return {
        "gross mass at the start, kg": f"{out['gross_mass_initial_kg']:.1f}",
        "gross mass, kg": f"{out['gross_mass_kg']:.1f}",
        "reduction": f"{out['gross_mass_reduction_percent']:.1f} %",
        "structure at the start → optimum, kg": f"{structure[0]:.1f} → {structure[1]:.1f}",
        "wing, kg": f"{after['wing']:.1f}",
        "fuselage, kg": f"{after['fuselage']:.1f}",
        "booms, kg": f"{sum(mass for name, mass in after.items() if name.startswith(BOOMS)):.1f}",
        "tails, kg": f"{sum(after[name] for name in TAILS):.1f}",
        "wing area, m²": f"{out['wing_area_m2']:.2f}",
        "wing aspect ratio": f"{content.design['wing_aspect_ratio']:.2f}",
        "span, m": f"{out['wing_span_m']:.2f}",
        "battery, kg": f"{after['battery']:.1f}",
        "lift to drag in cruise": f"{out['lift_to_drag_cruise']:.2f}",
        "noise, dB(A)": f"{out['sound_pressure_level_dba']:.1f}",
        "inputs outside the samples, half-widths from their centre": places or "none",
        "status": content.status.replace("_", " "),
    }


def table() -> Iterator[str]:
    """Lines of Markdown, one row a quantity."""
    columns = [column(optimum(overrides)) for overrides in SOURCES.values()]
    yield f"| | {' | '.join(SOURCES)} |"
    yield "|---" * (1 + len(SOURCES)) + "|"
    for name in columns[0]:
        yield f"| {name} | {' | '.join(cells[name] for cells in columns)} |"


if __name__ == "__main__":
    print_table(__doc__, table())
