"""Damaged input of every kind, counted by outcome: `python scripts/robustness.py --count 5000`.

Each input is a sound file with one thing wrong (scripts/mutations.py), given to the command that reads it in a process of its own,
with limits of time and memory. Reading is tried whole; the computation behind it is not run. A refusal is clear if it has exit code
2, names the file or the option, says what must be, and leaves nothing behind. What is accepted is listed, to be looked at.
"""

import argparse
import csv
import importlib.util
import os
import random
import resource
import shutil
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module, resources
from pathlib import Path
from typing import Any

import mutations

ROOT = Path(__file__).parents[1]
REFERENCE = ROOT / "tests" / "reference"
SECONDS, BYTES = 10, 2 * 1024**3
READ = 77  # exit code of a process that has read everything and stops before it computes
OUTCOMES = ("clear refusal", "accepted", "unclear", "traceback", "crash", "hang", "memory", "written after refusal")
RULES = (
    "must",
    "needs",
    "give ",
    "missing",
    "not valid",
    "cannot be read",
    "belongs to",
    "not allowed",
    "invalid",
    "cannot be drawn",
)
CASES = {
    "rotor": "bem_lift_rotor_axial",
    "wing": "vlm_rect_ar8_flat",
    "noise": "noise_tonal_hover",
    "motor": "motor_dq",
    "battery": "battery_thevenin",
    "structures": "structures_frame_L",
}


@dataclass(frozen=True)
class Kind:
    """Files of one kind: where a sound set of files is, the one that is damaged, and how it is read.

    stop: "module.attribute" whose call means that all is read. weight: share of the inputs. seconds: of processor time, four
    times what the sound file takes where that is more than two.
    """

    name: str
    base: Path
    victim: str
    mutate: Callable[[str, random.Random], mutations.Mutation]
    command: str
    stop: str | None = None
    weight: float = 1.0
    seconds: float = SECONDS


def kinds(base: Path) -> list[Kind]:
    """All kinds whose tools are installed; `base` holds their sound files."""
    configuration, run, hover, study = (
        "lpc_mdo.studies.runs.write_configuration",
        base / "run",
        base / "hover",
        base / "study",
    )
    found = [
        Kind("vehicle", base / "files", "vehicle.toml", mutations.of_toml, "optimize vehicle.toml --quiet --output out",
             configuration, 5.0),
        Kind("mission", base / "files", "mission.toml", mutations.of_toml, "optimize --mission mission.toml --output out",
             configuration, 3.0),
        Kind("start", hover, "result.json", mutations.of_json,
             "optimize --problem aeroacoustic --start result.json --output out", configuration, 1.0),
        Kind("checkpoint", base / "checkpoint", "out/checkpoint.json", mutations.of_json,
             "optimize --resume --quiet --output out", configuration, 2.0),
        Kind("coordinates", base / "files", "section.dat", mutations.of_text,
             "train airfoil --airfoil section.dat --generate --output out", "lpc_mdo.training.airfoil_command.generate", 2.0),
        Kind("polar table", base / "files", "polars.csv", mutations.of_csv,
             "train airfoil --data polars.csv --output out", "lpc_mdo.training.airfoil_command.train", 2.0),
        Kind("sample table", base / "files", "samples.csv", mutations.of_csv,
             "train structures --data samples.csv --output out", "lpc_mdo.training.structures_command.train", 2.0),
        Kind("airfoil card", base / "card", "card.json", mutations.of_json, "analyze airfoil case.json", None, 1.0),
    ]  # fmt: skip
    found += [
        Kind(
            f"case {name}", base / "cases", f"{name}.json", mutations.of_json, f"analyze {name} {name}.json", None, 2.0
        )
        for name in ("airfoil", *CASES)
    ]
    for folder, name in ((hover, "report"), (run, "report of an aircraft")):
        weight = 1.0 if folder == hover else 0.3
        for victim in ("result.json", "analysis.json", "configuration.json", "history.csv", "evaluations.csv"):
            mutate = mutations.of_json if victim.endswith("json") else mutations.of_csv
            seconds = SECONDS if folder == hover else 4.0 * SECONDS
            found.append(Kind(f"{name}: {victim}", folder, victim, mutate, "report .", None, weight, seconds))
    point = "points/00_0"
    resume = "pareto noise-efficiency --points 2 --resume --quiet --output ."
    for victim in ("study.json", f"{point}/result.json"):
        found.append(Kind(f"report of a study: {victim}", study, victim, mutations.of_json, "report .", None, 1.0))
    for victim in ("study.json", f"{point}/point.json", f"{point}/result.json"):
        stop = "lpc_mdo.studies.runner.StudyRun._execute"
        found.append(Kind(f"resumed study: {victim}", study, victim, mutations.of_json, resume, stop, 1.0))
    for victim in ("result.json", "analysis.json", "configuration.json"):
        command, stop = "sensitivities . --verify", "lpc_mdo.studies.sensitivities.check"
        found.append(Kind(f"sensitivities: {victim}", run, victim, mutations.of_json, command, stop, 0.7))
    for victim in ("result.json", "configuration.json"):
        command, stop = "export geometry result.json --format stl --output out", "lpc_mdo.interop.shape_files._write"
        found.append(Kind(f"export: {victim}", run, victim, mutations.of_json, command, stop, 0.7))
    if importlib.util.find_spec("pyNastran"):
        found.append(
            Kind(
                "NASTRAN deck",
                base / "decks",
                "decks/baseline.bdf",
                mutations.of_text,
                "nastran decks decks/design.csv",
            )
        )
    if importlib.util.find_spec("OCP"):
        found.append(Kind("STEP", base / "step", "baseline.step", mutations.of_text, "step baseline.step", None, 1.0))
    return found


def make_base(base: Path) -> None:
    """Sound files of every kind; kept for the next call."""
    if (base / "done").exists():
        return
    shutil.rmtree(base, ignore_errors=True)
    for name in ("files", "cases", "card"):
        (base / name).mkdir(parents=True)
    for name in ("vehicle.toml", "mission.toml"):
        text = resources.files("lpc_mdo.data").joinpath(name).read_text(encoding="utf-8")
        (base / "files" / name).write_text(text, encoding="utf-8")
    _write_tables(base / "files")
    for name, file in CASES.items():
        shutil.copy(REFERENCE / f"{file}.json", base / "cases" / f"{name}.json")
    section = '{"inputs": {"airfoil": %s, "alpha_deg": [0.0, 5.0], "reynolds": [1e6, 2e6], "mach": 0.1}}'
    (base / "cases" / "airfoil.json").write_text(section % '"naca4412"')
    (base / "card" / "case.json").write_text(section % '"card.json"')
    weights = resources.files("lpc_mdo.surrogates.weights")
    for ending in ("json", "safetensors"):
        (base / "card" / f"card.{ending}").write_bytes(weights.joinpath(f"naca4412.{ending}").read_bytes())
    for arguments in (
        ["optimize", "--quiet", "--output", str(base / "run")],
        ["optimize", "--quiet", "--problem", "aeroacoustic", "--output", str(base / "hover")],
        ["pareto", "noise-efficiency", "--points", "2", "--quiet", "--output", str(base / "study")],
        ["optimize", "--quiet", "--time-limit", "2", "--output", str(base / "checkpoint" / "out")],
    ):
        print(f"making files: lpc-mdo {' '.join(arguments)}", flush=True)
        run_command(arguments)
    for folder in ("run", "hover"):
        shutil.rmtree(base / folder / "figures")
        (base / folder / "report.html").unlink()
    for file in (base / "checkpoint" / "out").iterdir():
        if file.name not in ("checkpoint.json", "checkpoint_history.jsonl"):
            shutil.rmtree(file) if file.is_dir() else file.unlink()
    if importlib.util.find_spec("pyNastran"):
        run_command(["export", "nastran", "--output", str(base / "decks" / "decks")])
    if importlib.util.find_spec("OCP"):
        run_command(["export", "geometry", "--format", "step", "--output", str(base / "step")])
    (base / "done").touch()


def _write_tables(folder: Path) -> None:
    import gzip

    data = ROOT / "training" / "data"
    for name, source, rows in (("polars", "naca4412", 400), ("samples", "structures_open", 300)):
        lines = gzip.decompress((data / f"{source}.csv.gz").read_bytes()).decode().splitlines()[: rows + 1]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    points = [f"{0.5 * (1 + x):.5f} {y:.5f}" for x, y in _ellipse()]
    (folder / "section.dat").write_text("ellipse\n" + "\n".join(points) + "\n")


def _ellipse() -> list[tuple[float, float]]:
    from math import cos, pi, sin

    return [(cos(2 * pi * k / 80), 0.06 * sin(2 * pi * k / 80) * (1 - cos(2 * pi * k / 80) ** 8)) for k in range(81)]


def run_command(arguments: Sequence[str]) -> int:
    """The exit code of the command in this process."""
    try:
        if arguments[0] == "nastran":
            return import_module("lpc_mdo.training.nastran_ingest").main([*arguments[1:], "samples_out.csv"])
        if arguments[0] == "step":
            try:
                import_module("lpc_mdo.geometry.cad").read_step(Path(arguments[1]))
            except ValueError as error:
                print(f"lpc-mdo: {error}", file=sys.stderr)
                return 2
            return 0
        from lpc_mdo.cli import main

        main(list(arguments))
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 1
    return 0


def _stop_at(name: str) -> None:
    """Replace a function or method by the end of this process."""
    *path, last = name.split(".")
    for split in range(len(path), 0, -1):
        try:
            owner: Any = import_module(".".join(path[:split]))
        except ModuleNotFoundError:
            continue
        for part in path[split:]:
            owner = getattr(owner, part)
        setattr(owner, last, lambda *_, **__: os._exit(READ))
        return


def _child(kind: Kind, folder: Path) -> None:
    """Runs the command and ends the process; what it says goes to files beside the folder."""
    code = 1
    try:
        os.chdir(folder)
        for stream, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(folder.with_name(name), os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
        sys.stdout, sys.stderr = (os.fdopen(stream, "w", buffering=1) for stream in (1, 2))
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limit = pages * resource.getpagesize() + BYTES
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        if kind.stop:
            _stop_at(kind.stop)
        code = run_command(kind.command.split())
    except BaseException:
        import traceback

        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def attempt(kind: Kind, content: bytes, work: Path) -> tuple[str, str]:
    """Outcome and message of one damaged file."""
    folder = work / "run"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(kind.base, folder)
    (folder / kind.victim).write_bytes(content)
    before = _listing(folder)
    started = time.monotonic()
    child = os.fork()
    if child == 0:
        _child(kind, folder)
    while True:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            break
        if _processor_time(child) > kind.seconds or time.monotonic() - started > 12 * kind.seconds:
            os.kill(child, signal.SIGKILL)
            os.wait4(child, 0)
            return "hang", ""
        time.sleep(0.005)
    message = (work / "stderr").read_text(encoding="utf-8", errors="replace")
    return _outcome(
        kind, os.waitstatus_to_exitcode(status), message, _listing(folder) != before, usage.ru_maxrss
    ), message


def _processor_time(child: int) -> float:
    """s; a machine that others use, too, must not make a hang of what waits for its turn."""
    try:
        fields = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _outcome(kind: Kind, code: int, message: str, is_changed: bool, kilobytes: int) -> str:
    if kilobytes * 1024 > BYTES or "MemoryError" in message or "can't allocate memory" in message:
        return "memory"
    if code < 0:
        return "crash"
    if "Traceback" in message:
        return "traceback"
    if code in (0, READ) or (code == 1 and "lpc-mdo: " not in message):
        return "accepted"
    if is_changed:
        return "written after refusal"
    lines = [line for line in message.splitlines() if line and "asked outside" not in line]
    names = [Path(kind.victim).name, "--", Path(kind.victim).stem]
    is_clear = 0 < len(lines) <= 5 and all(
        any(name in line for name in names) and any(rule in line for rule in RULES) and len(line) < 900
        for line in lines
    )
    return "clear refusal" if is_clear and code == 2 else "unclear"


def _listing(folder: Path) -> dict[str, tuple[int, int]]:
    return {
        str(path.relative_to(folder)): (path.stat().st_size, path.stat().st_mtime_ns) if path.is_file() else (0, 0)
        for path in folder.rglob("*")
    }


def shares(found: Sequence[Kind], count: int) -> list[int]:
    """Inputs of each kind, at least one."""
    total = sum(kind.weight for kind in found)
    return [max(1, round(count * kind.weight / total)) for kind in found]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=5000, help="inputs in all; default: 5000")
    parser.add_argument("--seed", type=int, default=0, help="of the mutations; default: 0")
    parser.add_argument("--only", default="", help="kinds whose name contains this; default: all")
    parser.add_argument("--output", type=Path, default=Path("runs/robustness"), help="default: runs/robustness")
    options = parser.parse_args()
    os.environ["OMP_NUM_THREADS"] = (
        "1"  # before torch is loaded: a forked child must not wait for threads that are gone
    )
    output = options.output.resolve()
    make_base(output / "base")
    for module in ("lpc_mdo.studies.runs", "lpc_mdo.reporting.report", "lpc_mdo.studies.runner", "lpc_mdo.interop.shape_files", "lpc_mdo.cases",
                   "lpc_mdo.studies.sensitivities", "lpc_mdo.cases.structures", "lpc_mdo.training.airfoil_command",
                   "lpc_mdo.training.structures_command", "lpc_mdo.commands.study_run", "lpc_mdo.studies.lockstep"):  # fmt: skip
        import_module(module)  # once, here: every child has them
    found = [kind for kind in kinds(output / "base") if options.only in kind.name]
    counts = {kind.name: Counter() for kind in found}
    work = output / "work"
    work.mkdir(exist_ok=True)
    with (output / "inputs.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(["kind", "number", "outcome", "mutation", "message"])
        for kind, share in zip(found, shares(found, options.count), strict=True):
            sound = (kind.base / kind.victim).read_text(encoding="utf-8")
            for number in range(share):
                what, content = kind.mutate(sound, random.Random(f"{options.seed} {kind.name} {number}"))
                outcome, message = attempt(kind, content, work)
                counts[kind.name][outcome] += 1
                writer.writerow([kind.name, number, outcome, what, message[-3000:].strip()])
            stream.flush()
            print(f"{kind.name}: {dict(counts[kind.name])}", flush=True)
    total = table(counts)
    print(f"every input with its outcome: {output / 'inputs.csv'}")
    return 1 if sum(total[outcome] for outcome in OUTCOMES[2:]) else 0


def table(counts: dict[str, Counter]) -> Counter:
    """Print the table by kind and outcome; returns its last line."""
    total = Counter()
    width = max(map(len, counts))
    heads = [f"{outcome:>21s}" if " " in outcome else f"{outcome:>10s}" for outcome in OUTCOMES]
    print(f"{'':{width}s}  inputs {' '.join(heads)}")
    for name, found in [*counts.items(), ("all", total)]:
        cells = [f"{found[outcome]:{len(head)}d}" for outcome, head in zip(OUTCOMES, heads, strict=True)]
        print(f"{name:{width}s}  {sum(found.values()):6d} {' '.join(cells)}")
        if found is not total:
            total.update(found)
    return total


if __name__ == "__main__":
    sys.exit(main())
