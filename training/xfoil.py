"""Viscous polars from XFOIL, run so that it cannot hang, trap or fill the disk.

Some builds of XFOIL enable floating-point traps, with which every viscous run dies; a preloaded library makes the call
that sets them do nothing. A run that never returns is ended by time and by the size of its output, and the points that
it lost are tried again with other panellings.
"""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

PANEL_COUNTS = (160, 180, 140, 200)  # the first serves the sweeps, the others the retries
TIME_LIMIT = 90.0  # s, one run
OUTPUT_LIMIT = 20_000_000  # bytes written by one run
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


@cache
def _trap_free_library() -> str:
    folder = Path(tempfile.mkdtemp(prefix="lpc-mdo-xfoil-"))
    source, library = folder / "traps.c", folder / "traps.so"
    source.write_text(TRAP_FREE_SOURCE)
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", str(library), str(source)], check=True, capture_output=True)
    return str(library)


def _run(commands: Sequence[str], folder: Path) -> None:
    """Feed XFOIL; end it by time or output size. What it wrote until then counts."""
    environment = {**os.environ, "LD_PRELOAD": _trap_free_library()}
    limit = f"ulimit -f {OUTPUT_LIMIT // 1024}; exec timeout -k 1 {TIME_LIMIT:g} xfoil"
    subprocess.run(
        ["bash", "-c", limit],
        input="\n".join(commands) + "\n\n\nQUIT\n",
        cwd=folder,
        env=environment,
        text=True,
        stdout=(folder / "log").open("w"),
        stderr=subprocess.DEVNULL,
        check=False,
    )


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


def _sweep(
    airfoil: str, reynolds: float, mach: float, sweeps: Sequence[Sequence[float]], panels: int
) -> list[PolarPoint]:
    with tempfile.TemporaryDirectory(prefix="lpc-mdo-xfoil-") as name:
        folder = Path(name)
        commands = ["PLOP", "G F", "", f"NACA {airfoil}", "PPAR", f"N {panels}", "", "", "PANE", "OPER"]
        commands += [f"VISC {reynolds:.6g}", f"MACH {mach:g}", "ITER 200", "PACC", "polar", ""]
        for number, sweep in enumerate(sweeps):
            # INIT toggles, so it may only follow a sweep that has initialized the boundary layer.
            commands += (["INIT"] if number else []) + [f"ALFA {alpha:g}" for alpha in sweep]
        _run([*commands, "PACC"], folder)
        return _read(folder / "polar", reynolds, mach)


def run_polar(airfoil: str, reynolds: float, mach: float, alphas_deg: Sequence[float]) -> Polar:
    """The polar of a NACA section, free transition at Ncrit 9.

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
            if any(alpha in lost for alpha in sweep):
                for point in _sweep(airfoil, reynolds, mach, [sweep], panels):
                    found.setdefault(round(point.alpha_deg, 3), point)
    return Polar(
        points=tuple(found[alpha] for alpha in wanted if alpha in found),
        lost=tuple(alpha for alpha in wanted if alpha not in found),
    )
