"""`lpc-mdo check --full`: every model against what is not ours, as one table, one page and two figures."""

from collections.abc import Callable
from pathlib import Path

from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.write import locked, write_atomically
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.reporting.terminal import terminal
from lpc_mdo.reporting.verification import FILE as STORED
from lpc_mdo.reporting.verification import write_verification
from lpc_mdo.verification import (
    airfoil,
    atmosphere,
    battery,
    flight,
    geometry,
    model,
    motor,
    noise,
    rotors,
    self_noise,
    structures,
    wings,
)
from lpc_mdo.verification.comparison import SOURCE_TREE, Comparison
from lpc_mdo.verification.figures import save_figures
from lpc_mdo.verification.page import HEAD, NAME, cells, page

PAGE = SOURCE_TREE / "docs" / NAME
WIDTH = 160  # columns where the output is no terminal

GROUPS: dict[str, Callable[[], list[Comparison]]] = {
    "Wings": wings.comparisons,
    "Rotors": rotors.comparisons,
    "Airfoil polars": airfoil.comparisons,
    "Noise": noise.comparisons,
    "Airfoil self-noise": self_noise.comparisons,
    "Motors": motor.comparisons,
    "Batteries": battery.comparisons,
    "Flight mechanics": flight.comparisons,
    "Structures and masses": structures.comparisons,
    "Geometry": geometry.comparisons,
    "Atmosphere": atmosphere.comparisons,
    "Whole model": model.comparisons,
}


@one_thread()
def compare_all(
    random_conditions: int, announce: Callable[[str], None] = lambda name: None
) -> dict[str, list[Comparison]]:
    """All rows by group; `announce` is told each group's name before it starts."""
    groups = {}
    for name, comparisons in GROUPS.items():
        announce(name)
        groups[name] = comparisons()
        if name == "Rotors":
            announce(f"{random_conditions:,} random rotor conditions")
            groups[name].append(rotors.random_conditions(random_conditions))
    return groups


def run_full_check(random_conditions: int, folder: Path | None) -> int:
    """Compare, print the table, write page, comparisons and figures into the folder.

    None: the source tree's own page and pictures in docs, and what reports show of it.
    Returns the exit code: 0 if every limit is met, 1 otherwise. Raises ConfigurationError if the folder cannot be made, or
    there is no source tree.
    """
    if folder is None and not PAGE.is_file():
        raise ConfigurationError("--publish needs the source tree, which holds docs/verification.md.")
    with locked(folder or PAGE.parent):
        return _compare_and_write(random_conditions, folder)


def _compare_and_write(random_conditions: int, folder: Path | None) -> int:
    with Progress(
        SpinnerColumn(),
        TextColumn("{task.description}"),
        TimeElapsedColumn(),
        console=terminal(is_error=True),
        transient=True,
    ) as progress:
        task = progress.add_task("", total=None)
        groups = compare_all(random_conditions, lambda name: progress.update(task, description=name))
    _print(groups)
    file = PAGE if folder is None else folder / NAME
    write_atomically(file, page(groups))
    write_verification(groups, STORED if folder is None else file.with_suffix(".json"))
    figures = save_figures(file.parent / "images")
    missed = [row for rows in groups.values() for row in rows if not row.is_met]
    console = terminal()
    console.print(f"wrote {file}, {', '.join(figure.name for figure in figures)}", soft_wrap=True, highlight=False)
    console.print(f"{sum(map(len, groups.values()))} comparisons, {len(missed)} beyond their limits", highlight=False)
    return 1 if missed else 0


def _print(groups: dict[str, list[Comparison]]) -> None:
    table = Table(*HEAD)
    for rows in groups.values():
        for row in rows:
            text: list[str | Text] = list(cells(row))
            text[-2] = Text("yes", "green") if row.is_met else Text("NO", "red")
            table.add_row(*text)
        table.add_section()
    console = terminal()
    (console if console.is_terminal else terminal(width=WIDTH)).print(table)
