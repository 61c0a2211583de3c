"""One damaged file given to the command that reads it, in a process of its own: what came of it (scripts/robustness.py)."""

import os
import re
import resource
import shutil
import signal
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from damaged_kinds import Kind

BYTES = 2 * 1024**3
READ = 77  # exit code of a process that has read everything and stops before it computes
OUTCOMES = (
    "clear refusal",
    "accepted",
    "unclear",
    "traceback",
    "crash",
    "hang",
    "memory",
    "silent NaN",
    "written after refusal",
)
# A whole value of JSON, of a table's line, or of a cell; prose may speak of an infinity norm.
NOT_A_NUMBER = re.compile(r"(?:^|[\[,:>])\s*-?(?:nan|inf|infinity)\s*(?:$|[\],}<])", re.IGNORECASE | re.MULTILINE)
PLAIN = (".json", ".csv", ".txt", ".html")  # endings of what a command writes for people and programs to read
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
    said, message = (work / name for name in ("stdout", "stderr"))
    message = message.read_text(encoding="utf-8", errors="replace")
    after = _listing(folder)
    outcome = _outcome(kind, os.waitstatus_to_exitcode(status), message, after != before, usage.ru_maxrss)
    if outcome == "accepted":
        new = [folder / name for name in after if after[name] != before.get(name) and name.endswith(PLAIN)]
        for file in (said, *new):
            if (found := not_a_number(file.read_text(encoding="utf-8", errors="replace"))) is not None:
                return "silent NaN", f"{file.name}: {found}"
    return outcome, message


def not_a_number(text: str) -> str | None:
    """Where a NaN or an infinity stands among the figures of a text, None if nowhere; letters of pictures mean nothing."""
    plain = re.sub(r"base64,[\w+/=]+|<svg.*?</svg>", "", text, flags=re.DOTALL)
    found = NOT_A_NUMBER.search(plain)
    return None if found is None else plain[max(0, found.start() - 80) : found.end() + 20]


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
