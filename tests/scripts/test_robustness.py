"""The table of damaged inputs, small: nothing but clear refusals and what is sound all the same."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "scripts" / "robustness.py"


def test_no_damaged_input_ends_in_a_traceback_a_hang_or_a_half_written_result(tmp_path):
    command = [sys.executable, "-W", "ignore", str(SCRIPT), "--count", "30", "--seed", "1", "--output", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = done.stdout.splitlines()
    heads = ("clear refusal", "accepted", "unclear", "traceback", "crash", "hang", "memory", "written after refusal")
    counts = dict(
        zip(heads, map(int, next(line for line in lines if line.startswith("all ")).split()[2:]), strict=True)
    )
    assert {head: counts[head] for head in heads[3:]} == dict.fromkeys(heads[3:], 0), done.stdout
    assert counts["clear refusal"] > 0.5 * sum(counts.values()), done.stdout
