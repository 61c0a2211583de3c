"""Kill runs of the main problem with SIGKILL at random moments, resume them, compare: python scripts/kill_and_resume.py DIR.

Moments are drawn with a fixed seed over the time to the result that one run left alone takes.
"""

import argparse
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

COMMAND = [sys.executable, "-c", "from lpc_mdo.cli import main; main()", "optimize", "--quiet", "--output"]


def design(folder: Path) -> list:
    """Status and every design variable of a finished run, to the last bit."""
    result = json.loads((folder / "result.json").read_text())
    return [result["status"], *(entry["value"] for entry in result["design_variables"])]


def killed_after(folder: Path, moment: float) -> int:
    """Iterations that the checkpoint of the killed run shows; -1: there was none yet."""
    process = subprocess.Popen([*COMMAND, str(folder)])
    try:
        process.wait(timeout=moment)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.wait()
    file = folder / "checkpoint.json"
    return json.loads(file.read_text())["records"] - 1 if file.exists() else -1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True)
    started = time.monotonic()
    subprocess.run([*COMMAND, str(asked.folder / "whole")], check=True)
    duration = time.monotonic() - started
    whole = design(asked.folder / "whole")
    print(f"left alone: {duration:.1f} s, {whole[0]}", flush=True)
    is_same = True
    for number, moment in enumerate(np.random.default_rng(asked.seed).uniform(0.0, duration, asked.kills), start=1):
        folder = asked.folder / f"killed_{number:02d}"
        iterations = killed_after(folder, moment)
        resume = ["--resume"] if iterations >= 0 else []
        subprocess.run([*COMMAND, str(folder), *resume], check=True)
        same = design(folder) == whole
        is_same &= same
        word = f"iteration {iterations}" if resume else "no checkpoint yet: started again"
        print(f"killed after {moment:5.1f} s ({word}): {'the same bits' if same else 'ANOTHER DESIGN'}", flush=True)
    return 0 if is_same else 1


if __name__ == "__main__":
    sys.exit(main())
