"""Viscous polars from XFOIL, run so that it cannot hang, trap or fill the disk.

Some builds of XFOIL enable floating-point traps, with which every viscous run dies; a preloaded library makes the call
that sets them do nothing. A run that never returns is ended by time and by the size of its output, and the points that
it lost are tried again with other panellings, past the point at which it hung.
"""

import shutil
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from lpc_mdo.airfoils.shape import AirfoilShape

PANEL_COUNTS = (160, 180, 140, 200)  # the first serves the sweeps, the others the retries
TIME_LIMIT = 120.0  # s, one run of some forty points, which take 1 to 4 s
PROCESSOR_LIMIT = 8  # s of processor time, likewise: ends a hung run as early on a busy machine as on an idle one
HANGS_PASSED = 2  # points of a sweep that may hang before its rest is left to the next panelling
OUTPUT_LIMIT = 20_000_000  # bytes written by one run
STOPPED = {sign * s + base for s in (signal.SIGINT, signal.SIGTERM) for sign, base in ((1, 128), (-1, 0))}
TRAP_FREE_SOURCE = "void _gfortran_set_fpe(int options) { (void)options; }\n"


@dataclass(frozen=True)
class PolarPoint:
    """One converged point; alpha in degrees."""

    reynolds: float
    mach: float
    alpha_deg: float
    cl: float
    cd: float
    cm: float


@dataclass(frozen=True)
class Polar:
    points: tuple[PolarPoint, ...]
    lost: tuple[float, ...]  # angles (deg) that no panelling converged


def missing_tools() -> str | None:
    """Why XFOIL cannot run here, or None."""
    absent = [tool for tool in ("xfoil", "gcc") if shutil.which(tool) is None]
    return f"not installed: {', '.join(absent)}" if absent else None


# Ends XFOIL by time, processor time and size of what it writes. Whoever stops this shell, or the program that started it,
# which it outlives by no more than this: XFOIL ends with it, and the folder goes.
SUPERVISOR = f"""
stopped() {{ kill "$child" 2>/dev/null; wait "$child" 2>/dev/null; rm -rf "$PWD"; exit "$1"; }}
gcc -shared -fPIC -o traps.so traps.c || exit 1
trap 'stopped 143' TERM HUP
trap 'stopped 130' INT
(
  ulimit -f {OUTPUT_LIMIT // 1024} -t {PROCESSOR_LIMIT}
  LD_PRELOAD="$PWD/traps.so" exec timeout -k 1 "$1" xfoil <commands >log 2>/dev/null
) &
child=$!
wait "$child"
"""


def _run(commands: Sequence[str], folder: Path) -> bool:
    """Feed XFOIL in a folder of its own; what it wrote until it was ended counts. True if it came to its end.

    Raises KeyboardInterrupt if somebody stopped it: what it did not write then is not lost, but never tried.
    """
    (folder / "commands").write_text("\n".join(commands) + "\n\n\nQUIT\n")
    (folder / "traps.c").write_text(TRAP_FREE_SOURCE)
    with_parent = ["setpriv", "--pdeathsig", "TERM"] if shutil.which("setpriv") else []
    command = [*with_parent, "bash", "-c", SUPERVISOR, "xfoil", f"{TIME_LIMIT:g}"]
    process = subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        code = process.wait()
    except BaseException:
        process.terminate()
        process.wait()
        raise
    if code in STOPPED:
        raise KeyboardInterrupt
    return code == 0


def _read(file: Path, reynolds: float, mach: float) -> list[PolarPoint]:
    if not file.exists():
        return []
    points = []
    for line in file.read_text(errors="replace").splitlines()[12:]:
        columns = line.split()
        try:
            alpha, cl, cd, _, cm = (float(value) for value in columns[:5])
        except ValueError:
            continue
        if cd > 1e-4:  # a diverged boundary layer now and then reports zero or negative drag
            points.append(PolarPoint(reynolds, mach, alpha, cl, cd, cm))
    return points


def _section_commands(shape: AirfoilShape, folder: Path) -> list[str]:
    if shape.designation:
        return [f"NACA {shape.designation}"]
    rows = "".join(f"{x:.7f} {y:.7f}\n" for x, y in shape.coordinates)
    (folder / "section.dat").write_text(f"section\n{rows}")
    return ["LOAD section.dat"]


def _sweep(
    shape: AirfoilShape, reynolds: float, mach: float, sweep: Sequence[float], panels: int
) -> tuple[list[PolarPoint], bool]:
    """Converged points of one sweep, and whether it came to its end."""
    with tempfile.TemporaryDirectory(prefix="lpc-mdo-xfoil-") as name:
        folder = Path(name)
        commands = ["PLOP", "G F", "", *_section_commands(shape, folder), "PPAR", f"N {panels}", "", "", "PANE", "OPER"]
        commands += [f"VISC {reynolds:.6g}", f"MACH {mach:g}", "ITER 200", "PACC", "polar", ""]
        has_ended = _run([*commands, *(f"ALFA {alpha:g}" for alpha in sweep), "PACC"], folder)
        return _read(folder / "polar", reynolds, mach), has_ended


def run_polar(shape: AirfoilShape, reynolds: float, mach: float, alphas_deg: Sequence[float]) -> Polar:
    """The polar of a section, free transition at Ncrit 9.

    Sweeps up and down from 0 degrees; lost points are then approached anew with other panel counts.
    Raises ValueError if XFOIL or the compiler that its preloaded library needs is not installed.
    """
    if reason := missing_tools():
        raise ValueError(f"XFOIL cannot run: {reason}")
    wanted = sorted({round(alpha, 3) for alpha in alphas_deg})
    found: dict[float, PolarPoint] = {}
    for panels in PANEL_COUNTS:
        lost = [alpha for alpha in wanted if alpha not in found]
        if not lost:
            break
        up = [alpha for alpha in wanted if alpha >= 0.0 and alpha <= max(lost)]
        down = [alpha for alpha in reversed(wanted) if alpha < 0.0 and alpha >= min(lost)]
        for sweep in (up, down):
            _sweep_past_hangs(shape, reynolds, mach, sweep, panels, found)
    return Polar(
        points=tuple(found[alpha] for alpha in wanted if alpha in found),
        lost=tuple(alpha for alpha in wanted if alpha not in found),
    )


def _sweep_past_hangs(
    shape: AirfoilShape,
    reynolds: float,
    mach: float,
    sweep: Sequence[float],
    panels: int,
    found: dict[float, PolarPoint],
) -> None:
    """Add to `found` what the sweep converges; where it hangs, once more without the angle at which it did."""
    for _ in range(1 + HANGS_PASSED):
        if all(alpha in found for alpha in sweep):
            return
        points, has_ended = _sweep(shape, reynolds, mach, sweep, panels)
        for point in points:
            found.setdefault(round(point.alpha_deg, 3), point)
        if has_ended:
            return
        reached = max((sweep.index(a) for p in points if (a := round(p.alpha_deg, 3)) in sweep), default=-1)
        sweep = [alpha for i, alpha in enumerate(sweep) if i != reached + 1]
