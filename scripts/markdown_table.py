"""What scripts that make tables of the pages share."""

import argparse
import warnings
from collections.abc import Iterator
from pathlib import Path


def print_table(description: str, lines: Iterator[str]) -> None:
    """A script's main: lines of Markdown as they are done, in the terminal and, with --output, in a file at the end."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path, help="also write the table into this file")
    output = parser.parse_args().output
    warnings.simplefilter("ignore")
    done = []
    for line in lines:
        done.append(line)
        print(line, flush=True)
    if output is not None:
        output.write_text("\n".join(done) + "\n", encoding="utf-8")
