"""README and its page carry the table of published and own figures as the optimum prints it."""

import runpy
from pathlib import Path

from lpc_mdo.studies.single import solve

ROOT = Path(__file__).parents[1]


def test_the_table_of_the_pages_is_that_of_the_optimum(problem):
    _, content = solve(problem, solver="sqp")
    assert content.is_converged
    lines = runpy.run_path(str(ROOT / "scripts" / "published_table.py"))["table"](content)
    text = "\n".join(lines)
    assert text in (ROOT / "README.md").read_text(encoding="utf-8")
    assert text.strip() == (ROOT / "docs" / "tables" / "published.md").read_text(encoding="utf-8").strip()
