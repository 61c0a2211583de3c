"""README and its page carry the table of published and own figures as the optimum prints it."""

import runpy
from pathlib import Path

from lpc_mdo.studies.single import solve

ROOT = Path(__file__).parents[2]


def test_the_table_of_the_pages_is_that_of_the_optimum(problem):
    _, content = solve(problem, solver="sqp")
    assert content.is_converged
    lines = runpy.run_path(str(ROOT / "scripts" / "published_table.py"))["table"](content.content())
    text = "\n".join(lines)
    assert text in (ROOT / "README.md").read_text(encoding="utf-8")
    assert text.strip() == (ROOT / "docs" / "tables" / "published.md").read_text(encoding="utf-8").strip()
    sources = runpy.run_path(str(ROOT / "scripts" / "structure_sources.py"))["column"](content)
    assert sources == {name: cell for name, cell, *_ in rows_of("structure_sources.md")}
    mass = f"{content.outputs['gross_mass_kg']:.1f}"
    (choices, *_) = (ROOT / "docs" / "tables" / "choices.md").read_text(encoding="utf-8").splitlines()
    assert choices.startswith(f"Our optimum: {mass} kg, ")
    assert rows_of("speed_settings.md")[0][:2] == ["as shipped", mass]


def rows_of(name):
    """Cells of a table of the pages, without its heading."""
    lines = (ROOT / "docs" / "tables" / name).read_text(encoding="utf-8").splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]
