"""The published study beside a stored run, as a table in Markdown: the one that README carries.

python scripts/published_table.py RUN_FOLDER
"""

import argparse
from pathlib import Path

from lpc_mdo.reporting.tables import headlines
from lpc_mdo.stored.result import FILE, read_result


def table(content: dict) -> list[str]:
    """Lines of the table, from the content of result.json."""
    rows = [(row.name, row.published, row.ours, row.difference, row.why) for row in headlines(content)]
    heads = ("quantity", "published", "ours", "difference", "why")
    return [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|", *(f"| {' | '.join(row)} |" for row in rows)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path, help="folder of a run of the shipped aircraft and mission")
    run = parser.parse_args().run
    try:
        lines = table(read_result(run / FILE))
    except ValueError as error:
        parser.error(str(error))
    print("\n".join(lines))


if __name__ == "__main__":
    main()
