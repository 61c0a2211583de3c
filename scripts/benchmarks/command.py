"""The benchmark's command line: sections, tables, page."""

from importlib import import_module
from pathlib import Path

import click

from benchmarks.machine import description
from benchmarks.sheets import Section, printed, targets_sheet, write_markdown

SECTIONS = ("wing", "rotors", "airfoil", "model", "optimization", "growth")
PROFILE = "profile"
NARROWEST = 124  # columns that the widest table takes without cutting words


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("sections", nargs=-1, type=click.Choice([*SECTIONS, PROFILE]))
@click.option("--quick", "is_quick", is_flag=True, help="Leave out what takes minutes; the tables say what.")
@click.option(
    "--markdown", type=click.Path(path_type=Path, dir_okay=False), help="Page whose measured tables to renew."
)
def main(sections: tuple[str, ...], is_quick: bool, markdown: Path | None) -> None:
    """Speed, memory and accuracy beside other codes, of SECTIONS (all but the profile if none is named).

    Other codes come with pip install 'lpc-mdo[bench]'. "profile" lists the operators of one evaluation.
    """
    from rich.console import Console

    console, header = Console(), description()
    console.width = max(console.width, NARROWEST)
    console.print(header, markup=False)
    done: list[Section] = []
    for name in sections or SECTIONS:
        section = _profile() if name == PROFILE else _run(name, is_quick)
        for sheet in section.sheets:
            console.print(printed(sheet))
        done.append(section)
    sheets = [sheet for section in done for sheet in section.sheets]
    if targets := [target for section in done for target in section.targets]:
        sheets = [targets_sheet(targets), *sheets]
        console.print(printed(sheets[0]))
    if markdown is not None:
        try:
            write_markdown(markdown, header, sheets)
        except (ValueError, OSError) as error:
            raise click.ClickException(str(error)) from None
        console.print(f"wrote {markdown}", markup=False)


def _run(name: str, is_quick: bool) -> Section:
    return import_module(f"benchmarks.sections.{name}").run(is_quick)


def _profile() -> Section:
    from benchmarks.sections.model import profile_sheets

    return Section(profile_sheets())
