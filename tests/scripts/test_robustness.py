"""The table of damaged inputs, small: nothing but clear refusals and what is sound all the same."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "robustness.py"


def test_no_damaged_input_ends_in_a_traceback_a_hang_or_a_half_written_result(tmp_path, baseline_run):
    options = ["--count", "30", "--seed", "1", "--run", str(baseline_run), "--output", str(tmp_path)]
    command = [sys.executable, "-W", "ignore", str(SCRIPT), *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = done.stdout.splitlines()
    bad = ("traceback", "crash", "hang", "memory", "silent NaN", "written after refusal")
    heads = ("clear refusal", "accepted", "unclear", *bad)
    counts = dict(
        zip(heads, map(int, next(line for line in lines if line.startswith("all ")).split()[2:]), strict=True)
    )
    assert {head: counts[head] for head in heads[3:]} == dict.fromkeys(heads[3:], 0), done.stdout
    assert counts["clear refusal"] > 0.5 * sum(counts.values()), done.stdout


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ('{"lift": NaN}', True),
        ("1.0,-inf,2.0", True),
        ("<td>nan</td>", True),
        ("Infinity", True),
        ('{"name": "banana", "unit": "inch"}', False),
        ('<img src="data:image/png;base64,aa/nan/inf==">', False),
        ('<svg viewBox="0 0 1 1"><path d="M nan inf"/></svg>', False),
        ("runs/nan.json", False),
        ("<th>measure, scaled infinity norm</th>", False),
        ('{"lift": [\n  1.0,\n  -Infinity\n ]}', True),
    ],
)
def test_a_figure_that_is_no_number_is_seen_and_words_and_pictures_are_none(monkeypatch, text, holds):
    monkeypatch.syspath_prepend(str(SCRIPT.parent))
    from damaged_attempt import not_a_number

    assert (not_a_number(text) is not None) == holds
