"""Scripts that no other test runs, and the help of all of them."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPTS = ROOT / "scripts"


def test_both_sources_of_geometry_are_timed():
    command = [sys.executable, "-W", "ignore", str(SCRIPTS / "geometry_source.py"), "--repetitions", "1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "ratio" in done.stdout


@pytest.mark.parametrize("script", sorted(path.name for path in SCRIPTS.glob("*.py") if "__main__" in path.read_text()))
def test_help_of_a_script_explains_it_and_writes_nothing(script, tmp_path):
    command = [sys.executable, "-W", "ignore", str(SCRIPTS / script), "--help"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "usage" in done.stdout.lower()
    assert not list(tmp_path.iterdir())


def test_help_of_the_package_explains_it_and_writes_nothing(tmp_path):
    command = [sys.executable, "-W", "ignore", "-m", "lpc_mdo", "--help"]
    environment = {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "usage" in done.stdout.lower()
    assert not list(tmp_path.iterdir())


def test_a_command_that_is_none_is_refused():
    command = [sys.executable, "-m", "lpc_mdo", "x"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "No such command 'x'" in done.stderr
