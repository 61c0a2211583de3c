"""Damaged input of every kind, counted by outcome: `python scripts/robustness.py --count 5200`.

Each input is a sound file with one thing wrong (scripts/mutations.py), given to the command that reads it in a process of its own,
with limits of time and memory. Reading is tried whole; the computation behind it is not run. A refusal is clear if it has exit code
2, names the file or the option, says what must be, and leaves nothing behind. What is accepted is listed, to be looked at.

Kinds that this interpreter cannot read (NASTRAN's need pyNastran, STEP files the CAD kernel) are left to another: run the same
command with --resume under it, and the table has all. Only an interpreter with torch makes the sound files.
"""

import argparse
import csv
import os
import random
import shutil
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path

from damaged_attempt import OUTCOMES, attempt, run_command
from damaged_kinds import ROOT, Kind, kinds, make_base, shares

COLUMNS = ("kind", "number", "outcome", "mutation", "message")
READERS = {  # what every child shall have without loading it again
    "torch": ("lpc_mdo.studies.run_request", "lpc_mdo.reporting.report", "lpc_mdo.studies.runner", "lpc_mdo.interop.shape_files", "lpc_mdo.cases",
              "lpc_mdo.studies.sensitivities", "lpc_mdo.cases.structures", "lpc_mdo.training.airfoil_command",
              "lpc_mdo.training.structures_command", "lpc_mdo.commands.study_run", "lpc_mdo.studies.lockstep"),
    "pyNastran": ("lpc_mdo.training.nastran_ingest", "pyNastran.bdf.bdf"),
    "OCP": ("lpc_mdo.geometry.cad",),
}  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=5200, help="inputs in all; default: 5200")
    parser.add_argument("--seed", type=int, default=0, help="of the mutations; default: 0")
    parser.add_argument("--only", default="", help="kinds whose name contains this; default: all")
    parser.add_argument("--output", type=Path, default=Path("runs/robustness"), help="default: runs/robustness")
    parser.add_argument("--run", type=Path, metavar="DIR", help="a finished optimization to damage; default: a new one")
    parser.add_argument("--resume", action="store_true", help="try only what the output folder does not hold yet")
    parser.add_argument("--table", type=Path, help="write the table here, as Markdown, and beside it what was accepted")
    options = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = (
        "1"  # before torch is loaded: a forked child must not wait for threads that are gone
    )
    output = options.output.resolve()
    make_base(output / "base", run_command, options.run)
    found = kinds(output / "base")
    wanted = [pair for pair in zip(found, shares(found, options.count), strict=True) if options.only in pair[0].name]
    for package in {kind.needs for kind, _ in wanted if kind.is_readable_here}:
        for module in READERS[package]:
            import_module(module)
    record = output / "inputs.csv"
    if not options.resume:
        record.unlink(missing_ok=True)
    for kind, share in wanted:
        if kind.is_readable_here:
            _try(kind, share, options.seed, output, record)
    rows = [row for row in _recorded(record) if options.only in row["kind"]]
    counts = {kind.name: Counter(row["outcome"] for row in rows if row["kind"] == kind.name) for kind, _ in wanted}
    table(counts)
    for kind, share in wanted:
        if (missing := share - counts[kind.name].total()) > 0:
            print(f"{kind.name}: {missing} inputs are still to be tried, where {kind.needs} is installed")
    print(f"every input with its outcome: {record}")
    if options.table:
        _write_page(options.table, counts, rows, options.count, options.seed)
    return 1 if any(counts[name][outcome] for name in counts for outcome in OUTCOMES[2:]) else 0


def _recorded(record: Path) -> list[dict[str, str]]:
    if not record.is_file():
        return []
    csv.field_size_limit(10**7)
    with record.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def _try(kind: Kind, share: int, seed: int, output: Path, record: Path) -> None:
    """The inputs of one kind that are not recorded yet; each is recorded as soon as it is tried."""
    done = {int(row["number"]) for row in _recorded(record) if row["kind"] == kind.name}
    work = output / f"work_{os.getpid()}"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    counts: Counter = Counter()
    sound = (kind.base / kind.victim).read_text(encoding="utf-8")
    is_new = not record.exists()
    with record.open("a", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        if is_new:
            writer.writerow(COLUMNS)
        for number in sorted(set(range(share)) - done):
            what, content = kind.mutate(sound, random.Random(f"{seed} {kind.name} {number}"))
            outcome, message = attempt(kind, content, work)
            counts[outcome] += 1
            writer.writerow([kind.name, number, outcome, what, message[-3000:].strip()])
            stream.flush()
    if counts:
        print(f"{kind.name}: {dict(counts)}", flush=True)
    shutil.rmtree(work, ignore_errors=True)


def _lines(counts: dict[str, Counter]) -> Iterable[tuple[str, int, list[int]]]:
    """Name, inputs and outcomes of every kind, and of all together."""
    total: Counter = Counter()
    for name, found in [*counts.items(), ("all", total)]:
        yield name, found.total(), [found[outcome] for outcome in OUTCOMES]
        if found is not total:
            total.update(found)


def table(counts: dict[str, Counter]) -> None:
    """Print the table by kind and outcome."""
    width = max(map(len, counts), default=3)
    heads = [f"{outcome:>21s}" if " " in outcome else f"{outcome:>10s}" for outcome in OUTCOMES]
    print(f"{'':{width}s}  inputs {' '.join(heads)}")
    for name, inputs, numbers in _lines(counts):
        cells = [f"{number:{len(head)}d}" for number, head in zip(numbers, heads, strict=True)]
        print(f"{name:{width}s}  {inputs:6d} {' '.join(cells)}")


def _write_page(page: Path, counts: dict[str, Counter], rows: Sequence[dict[str, str]], count: int, seed: int) -> None:
    """The table as Markdown, and a text file beside it with every input that was accepted."""
    lines = [f"| read by its command | inputs | {' | '.join(OUTCOMES)} |", f"|---|{'---:|' * (1 + len(OUTCOMES))}"]
    lines += [f"| {name} | {' | '.join(map(str, (inputs, *numbers)))} |" for name, inputs, numbers in _lines(counts)]
    accepted = page.with_name(f"{page.stem}_accepted.txt")
    lines += ["", f"`python scripts/robustness.py --count {count} --seed {seed}`; accepted: {accepted.name}"]
    page.write_text("\n".join(lines) + "\n", encoding="utf-8")
    kept = [f"{row['kind']}: {' '.join(row['mutation'].split())}" for row in rows if row["outcome"] == "accepted"]
    accepted.write_text("\n".join(kept) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.path.append(str(ROOT))  # for an interpreter without an installation
    sys.exit(main())
