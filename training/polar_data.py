"""The data set behind the airfoil surrogate: a designed grid of XFOIL polars, generated resumably, shipped with a card."""

import csv
import gzip
import hashlib
import io
import json
import os
from dataclasses import astuple, dataclass, fields
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from rich.progress import track

from training.xfoil import PANEL_COUNTS, Polar, PolarPoint, missing_tools, run_polar

# What nine rotors meet from blade root in hover to pusher tip in cruise, with margin.
REYNOLDS = (5e4, 7.5e4, 1e5, 1.5e5, 2e5, 3e5, 4.5e5, 7e5, 1e6, 1.5e6, 2.2e6, 3.3e6, 5e6)
MACH = (0.0, 0.2, 0.35, 0.5, 0.6)
ALPHA_DEG = tuple(np.arange(-12.0, 20.01, 0.5).tolist())
COLUMNS = tuple(field.name for field in fields(PolarPoint))


@dataclass(frozen=True)
class PolarData:
    """Columns of the data set, each (point,)."""

    reynolds: np.ndarray
    mach: np.ndarray
    alpha_deg: np.ndarray
    cl: np.ndarray
    cd: np.ndarray
    sha256: str


def _write_atomically(file: Path, data: bytes) -> None:
    partial = file.with_suffix(file.suffix + ".partial")
    partial.write_bytes(data)
    os.replace(partial, file)


def _cached_polar(airfoil: str, reynolds: float, mach: float, folder: Path) -> Polar:
    file = folder / f"re{reynolds:g}_m{mach:g}.json"
    if file.exists():
        stored = json.loads(file.read_text())
        return Polar(tuple(PolarPoint(*row) for row in stored["points"]), tuple(stored["lost"]))
    polar = run_polar(airfoil, reynolds, mach, ALPHA_DEG)
    stored = {"points": [astuple(point) for point in polar.points], "lost": polar.lost}
    _write_atomically(file, json.dumps(stored).encode())
    return polar


def generate(airfoil: str, output: Path, jobs: int = 2) -> None:
    """Run every polar of the grid into `output`; what an earlier run finished is kept."""
    if reason := missing_tools():
        raise ValueError(f"XFOIL cannot run: {reason}")
    parts = output / f"naca{airfoil}_parts"
    parts.mkdir(parents=True, exist_ok=True)
    grid = [(reynolds, mach) for mach in MACH for reynolds in REYNOLDS]
    work = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(_cached_polar)(airfoil, reynolds, mach, parts) for reynolds, mach in grid
    )
    polars = list(track(work, total=len(grid), description="XFOIL polars"))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for polar in polars:
        writer.writerows([f"{value:.7g}" for value in astuple(point)] for point in polar.points)
    data = gzip.compress(text.getvalue().encode(), mtime=0)
    lost = [
        {"reynolds": reynolds, "mach": mach, "alpha_deg": list(polar.lost)}
        for (reynolds, mach), polar in zip(grid, polars, strict=True)
        if polar.lost
    ]
    card = {
        "schema": "lpc-mdo/polar-data/1",
        "airfoil": f"naca{airfoil}",
        "solver": "XFOIL 6.99",
        "settings": {"ncrit": 9, "iterations": 200, "panels": list(PANEL_COUNTS), "transition": "free"},
        "reynolds": list(REYNOLDS),
        "mach": list(MACH),
        "alpha_deg": [min(ALPHA_DEG), max(ALPHA_DEG), ALPHA_DEG[1] - ALPHA_DEG[0]],
        "points": sum(len(polar.points) for polar in polars),
        "requested": len(grid) * len(ALPHA_DEG),
        "lost": lost,
        "sha256": hashlib.sha256(data).hexdigest(),
    }
    _write_atomically(output / f"naca{airfoil}.csv.gz", data)
    _write_atomically(output / f"naca{airfoil}.json", (json.dumps(card, indent=1) + "\n").encode())


def read(folder: Path, airfoil: str) -> PolarData:
    """The stored data set. Raises ValueError if the file and its card disagree."""
    data = (folder / f"naca{airfoil}.csv.gz").read_bytes()
    card = json.loads((folder / f"naca{airfoil}.json").read_text())
    digest = hashlib.sha256(data).hexdigest()
    if digest != card["sha256"]:
        raise ValueError(f"naca{airfoil}.csv.gz: sha256 = {digest} is not allowed; its card says {card['sha256']}")
    rows = list(csv.DictReader(io.StringIO(gzip.decompress(data).decode())))
    columns = {name: np.array([float(row[name]) for row in rows]) for name in COLUMNS}
    return PolarData(**{name: columns[name] for name in ("reynolds", "mach", "alpha_deg", "cl", "cd")}, sha256=digest)
