"""Scripts that no other test runs."""

import subprocess
import sys
from pathlib import Path

SCRIPTS = Path(__file__).parents[1] / "scripts"


def test_both_sources_of_geometry_are_timed():
    command = [sys.executable, "-W", "ignore", str(SCRIPTS / "geometry_source.py"), "--repetitions", "1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "ratio" in done.stdout
