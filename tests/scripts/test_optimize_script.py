"""scripts/optimize.py, which people start from."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "scripts" / "optimize.py"


def run(*arguments):
    command = [sys.executable, "-W", "ignore", str(SCRIPT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_it_sets_up_the_published_problem_and_says_how_far_it_came():
    done = run("--time-limit", "0.5")
    assert "109 variables, 17 constraints" in done.stdout
    assert "time_limit" in done.stdout
    assert "gross mass" in done.stdout
    assert done.returncode == 1, done.stderr  # half a second certifies nothing


def test_it_refuses_bad_input_in_one_sentence(tmp_path):
    for arguments, message in (
        (["--set", "vehicle.wing.area_m2=-1"], "wing.area_m2 = -1"),
        ([str(tmp_path / "none.toml")], "none.toml: cannot be read"),
        (["--mission", str(tmp_path)], "cannot be read"),
        (["--time-limit", "nan"], "time_limit = nan is invalid"),
        (["--time-limit", "-3"], "time_limit = -3 is invalid"),
    ):
        done = run(*arguments)
        assert done.returncode == 2
        assert done.stdout == ""
        assert message in done.stderr.splitlines()[-1]
        assert "Traceback" not in done.stderr


def test_it_is_thin():
    assert len(SCRIPT.read_text().splitlines()) <= 60
