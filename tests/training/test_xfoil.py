"""Running XFOIL: known sections, and programs that hang, flood the disk, diverge or are not there."""

import math
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from lpc_mdo.airfoils.shape import airfoil_shape
from lpc_mdo.training import xfoil
from lpc_mdo.training.polar_data import read
from lpc_mdo.training.xfoil import missing_tools, run_polar

DATA = Path(__file__).parents[2] / "training" / "data"
NACA_4412 = airfoil_shape("naca4412")
needs_xfoil = pytest.mark.skipif(missing_tools() is not None, reason=f"XFOIL cannot run: {missing_tools()}")
needs_compiler = pytest.mark.skipif("gcc" in (missing_tools() or ""), reason="gcc is not installed")


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Puts a shell script in XFOIL's place."""

    def install(script: str) -> None:
        program = tmp_path / "xfoil"
        program.write_text(f"#!/bin/bash\n{script}\n")
        program.chmod(0o755)
        monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")

    return install


@needs_xfoil
def test_naca_4412_agrees_with_the_shipped_polar():
    polar = run_polar(NACA_4412, 1e6, 0.0, [-4.0, 0.0, 4.0, 8.0])
    shipped = read(DATA / "naca4412.csv.gz")
    same = (shipped.reynolds == 1e6) & (shipped.mach == 0.0)
    assert polar.lost == ()
    for point in polar.points:
        # XFOIL prints four decimals of lift and five of drag; the way to an angle moves transition by a little.
        row = same & (shipped.alpha_deg == point.alpha_deg)
        assert [point.cl] == pytest.approx(shipped.cl[row].tolist(), abs=1e-3)
        assert [point.cd] == pytest.approx(shipped.cd[row].tolist(), abs=2e-5)


@needs_xfoil
def test_naca_4412_agrees_with_thin_airfoil_theory():
    # Moment about the quarter chord -0.106, and lift slope 2 pi: theory; thickness and friction change both by < 7 %.
    low, high = run_polar(NACA_4412, 3e6, 0.0, [0.0, 3.0]).points
    assert low.cm == pytest.approx(-0.106, rel=0.07)
    assert (high.cl - low.cl) / math.radians(3.0) == pytest.approx(2.0 * math.pi, rel=0.07)


@needs_xfoil
def test_symmetric_section_has_no_lift_at_zero_angle_and_mirrored_polars():
    down, level, up = run_polar(airfoil_shape("0012"), 1e6, 0.0, [-3.0, 0.0, 3.0]).points
    assert level.cl == pytest.approx(0.0, abs=1e-4)  # the last printed digit
    assert level.cm == pytest.approx(0.0, abs=1e-4)
    assert down.cl == pytest.approx(-up.cl, abs=2e-4)
    assert down.cd == pytest.approx(up.cd, abs=2e-5)


@needs_xfoil
def test_mach_and_reynolds_number_reach_the_program():
    (slow,), (fast,), (small,) = (
        run_polar(NACA_4412, re, m, [2.0]).points for re, m in ((1e6, 0.0), (1e6, 0.4), (2e5, 0.0))
    )
    # Prandtl and Glauert; Karman and Tsien's correction in XFOIL stays within 5 % of it here.
    assert fast.cl / slow.cl == pytest.approx(1.0 / math.sqrt(1.0 - 0.4**2), rel=0.05)
    assert small.cd > 1.2 * slow.cd
    assert (fast.mach, small.reynolds) == (0.4, 2e5)


def test_a_missing_program_is_named(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert missing_tools() == "not installed: xfoil, gcc"
    with pytest.raises(ValueError, match="XFOIL cannot run: not installed: xfoil, gcc"):
        run_polar(NACA_4412, 1e6, 0.0, [0.0])


@needs_compiler
def test_a_run_that_never_returns_is_ended_and_its_points_counted_as_lost(stand_in, monkeypatch):
    stand_in("exec sleep 600")
    monkeypatch.setattr(xfoil, "TIME_LIMIT", 0.2)
    polar = run_polar(NACA_4412, 1e6, 0.0, [-1.0, 0.0, 1.0])
    assert polar.points == ()
    assert polar.lost == (-1.0, 0.0, 1.0)


@needs_compiler
def test_a_run_that_floods_its_log_is_ended_by_size(stand_in, monkeypatch, tmp_path):
    stand_in(f"yes; stat -c %s log > {tmp_path}/size")
    limit = xfoil.SUPERVISOR.replace(str(xfoil.OUTPUT_LIMIT // 1024), "1024")
    monkeypatch.setattr(xfoil, "SUPERVISOR", limit)
    monkeypatch.setattr(xfoil, "PANEL_COUNTS", (160,))
    assert run_polar(NACA_4412, 1e6, 0.0, [0.0]).lost == (0.0,)
    assert int((tmp_path / "size").read_text()) == 1024 * 1024


@needs_compiler
def test_diverged_and_unreadable_rows_are_lost_and_tried_again_with_other_panels(stand_in, tmp_path):
    rows = "   0.000   0.4739   0.00689   0.0020  -0.1034\\n   1.000   0.58   0.00000   0.0  -0.1\\n   2.000   ******* 0.1\\n"
    stand_in(f"cat >> {tmp_path}/commands; for i in {{1..12}}; do echo header; done > polar; printf '{rows}' >> polar")
    polar = run_polar(NACA_4412, 1e6, 0.0, [0.0, 1.0, 2.0])
    assert [(p.alpha_deg, p.cl, p.cd, p.cm) for p in polar.points] == [(0.0, 0.4739, 0.00689, -0.1034)]
    assert polar.lost == (1.0, 2.0)
    panels = [line for line in (tmp_path / "commands").read_text().splitlines() if line.startswith("N ")]
    assert panels == [f"N {count}" for count in xfoil.PANEL_COUNTS]


@needs_compiler
def test_angles_are_approached_from_zero_in_both_directions(stand_in, tmp_path):
    stand_in(f"cat >> {tmp_path}/commands")
    run_polar(NACA_4412, 1e6, 0.0, np.arange(-1.0, 1.1, 0.5).tolist())
    angles = [line for line in (tmp_path / "commands").read_text().splitlines() if line.startswith("ALFA ")]
    assert angles[:5] == ["ALFA 0", "ALFA 0.5", "ALFA 1", "ALFA -0.5", "ALFA -1"]


def are_alive(marker):
    """Whether a process has the text in its command line."""
    lines = [file.read_bytes() for file in Path("/proc").glob("[0-9]*/cmdline") if file.parent.name != str(os.getpid())]
    return any(marker.encode() in line for line in lines)


def wait_until(condition):
    end = time.monotonic() + 20.0
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


PARENT = """
from lpc_mdo.training import xfoil
from lpc_mdo.airfoils.shape import airfoil_shape
xfoil.run_polar(airfoil_shape("4412"), 1e6, 0.0, [0.0])
"""


@needs_compiler
@pytest.mark.skipif(shutil.which("setpriv") is None, reason="setpriv is not installed")
@pytest.mark.parametrize("ending", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_xfoil_ends_with_what_started_it_and_leaves_no_folder(tmp_path, ending):
    scratch, started = tmp_path / "scratch", tmp_path / "started"
    scratch.mkdir()
    (tmp_path / "xfoil").write_text(f"#!/bin/bash\ntouch {started}\nexec sleep 4321.{os.getpid()}\n")
    (tmp_path / "xfoil").chmod(0o755)
    root = Path(__file__).parents[2]
    environment = {"PATH": f"{tmp_path}:/usr/bin:/bin", "TMPDIR": str(scratch), "PYTHONPATH": str(root)}
    parent = subprocess.Popen([sys.executable, "-c", PARENT], env=environment, stderr=subprocess.DEVNULL)
    assert wait_until(started.exists)
    assert len(list(scratch.glob("lpc-mdo-xfoil-*"))) == 1
    parent.send_signal(ending)
    parent.wait(timeout=20)
    assert wait_until(lambda: not are_alive(f"4321.{os.getpid()}"))
    assert wait_until(lambda: not list(scratch.iterdir()))
