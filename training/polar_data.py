"""The data behind an airfoil surrogate: a designed grid of XFOIL polars, generated resumably, or a user's own table."""

import csv
import gzip
import hashlib
import io
import json
import reprlib
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path

import numpy as np
from joblib import delayed
from rich.progress import track

from lpc_mdo.airfoils.shape import AirfoilShape
from lpc_mdo.files.read import read_json
from lpc_mdo.files.tables import read_table
from lpc_mdo.files.write import write_together
from lpc_mdo.numerics.workers import side_by_side
from lpc_mdo.training.saved_polars import is_saved_polar, read_saved_polar
from lpc_mdo.training.xfoil import PANEL_COUNTS, Polar, PolarPoint, missing_tools, run_polar

# What nine rotors and the wing meet from the start of an optimization to its end, with margin (docs/airfoil.md).
REYNOLDS = (
    *(3e4, 5e4, 7.5e4, 1e5, 1.25e5, 1.5e5, 2e5, 3e5),
    *(4.5e5, 7e5, 1e6, 1.5e6, 2.2e6, 3.3e6, 5e6, 7e6, 1e7),
)
MACH = (0.0, 0.1, 0.2, 0.275, 0.35, 0.45, 0.5, 0.6)
ALPHA_DEG = tuple(np.arange(-12.0, 20.01, 0.5).tolist())
COLUMNS = tuple(field.name for field in fields(PolarPoint))
NEEDED = ("reynolds", "mach", "alpha_deg", "cl", "cd")
ALLOWED = {
    "reynolds": (1e3, 1e9),
    "mach": (0.0, 0.95),
    "alpha_deg": (-180.0, 180.0),
    "cl": (-5.0, 5.0),
    "cd": (1e-5, 3.0),
}
MOST_FILES = 1000  # of a folder of polars
DATA_SCHEMA = "lpc-mdo/polar-data/1"


@dataclass(frozen=True)
class PolarData:
    """Columns of the data set, each (point,)."""

    reynolds: np.ndarray
    mach: np.ndarray
    alpha_deg: np.ndarray
    cl: np.ndarray
    cd: np.ndarray
    sha256: str
    notes: tuple[str, ...] = ()  # what reading them changed


def _cached_polar(
    shape: AirfoilShape, reynolds: float, mach: float, alpha_deg: tuple[float, ...], folder: Path
) -> Polar:
    file = folder / f"re{reynolds:g}_m{mach:g}.json"
    if file.exists():
        stored = json.loads(file.read_text())
        return Polar(tuple(PolarPoint(*row) for row in stored["points"]), tuple(stored["lost"]))
    polar = run_polar(shape, reynolds, mach, alpha_deg)
    stored = {"points": [astuple(point) for point in polar.points], "lost": polar.lost}
    write_together({file: json.dumps(stored).encode()})
    return polar


@dataclass(frozen=True)
class Grid:
    """Reynolds and Mach numbers to run XFOIL at, and angles (deg)."""

    reynolds: tuple[float, ...] = REYNOLDS
    mach: tuple[float, ...] = MACH
    alpha_deg: tuple[float, ...] = ALPHA_DEG

    def within(self, reynolds: tuple[float, float], mach: tuple[float, float]) -> "Grid":
        """The part between two Reynolds and two Mach numbers. Raises ValueError if fewer than two of either are left."""
        parts = {}
        for name, (lower, upper) in (("reynolds", reynolds), ("mach", mach)):
            values = getattr(self, name)
            parts[name] = tuple(value for value in values if lower <= value <= upper)
            if len(parts[name]) < 2:
                raise ValueError(
                    f"{name} = {lower:g} {upper:g} is invalid: at least two of {', '.join(f'{v:g}' for v in values)} "
                    "must lie between them"
                )
        return replace(self, **parts)


def generate(shape: AirfoilShape, output: Path, jobs: int = 2, grid: Grid | None = None) -> Path:
    """Run every polar of the grid and write NAME.csv.gz with its card NAME.json into `output`; returns the former.

    Polars that an earlier run of the same section finished are kept. Raises ValueError if XFOIL cannot run.
    """
    grid = grid or Grid()
    if reason := missing_tools():
        raise ValueError(f"XFOIL cannot run: {reason}")
    parts = output / f"{shape.name}_{shape.key}_polars"
    parts.mkdir(parents=True, exist_ok=True)
    pairs = [(reynolds, mach) for mach in grid.mach for reynolds in grid.reynolds]
    calls = (delayed(_cached_polar)(shape, reynolds, mach, grid.alpha_deg, parts) for reynolds, mach in pairs)
    work = side_by_side(jobs, calls, is_ordered=True)
    polars = list(track(work, total=len(pairs), description="XFOIL polars"))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for polar in polars:
        writer.writerows([f"{value:.7g}" for value in astuple(point)] for point in polar.points)
    data = gzip.compress(text.getvalue().encode(), mtime=0)
    lost = [
        {"reynolds": reynolds, "mach": mach, "alpha_deg": list(polar.lost)}
        for (reynolds, mach), polar in zip(pairs, polars, strict=True)
        if polar.lost
    ]
    card = {
        "schema": DATA_SCHEMA,
        "airfoil": shape.name,
        "thickness_to_chord": shape.thickness_to_chord,
        "coordinates": shape.coordinates,
        "notes": shape.notes,
        "solver": "XFOIL 6.99",
        "settings": {"ncrit": 9, "iterations": 200, "panels": list(PANEL_COUNTS), "transition": "free"},
        "reynolds": list(grid.reynolds),
        "mach": list(grid.mach),
        "alpha_deg": [min(grid.alpha_deg), max(grid.alpha_deg), grid.alpha_deg[1] - grid.alpha_deg[0]],
        "points": sum(len(polar.points) for polar in polars),
        "requested": len(pairs) * len(grid.alpha_deg),
        "lost": lost,
        "sha256": hashlib.sha256(data).hexdigest(),
    }
    file = output / f"{shape.name}.csv.gz"
    write_together({file: data, output / f"{shape.name}.json": (json.dumps(card, indent=1) + "\n").encode()})
    return file


def read(place: Path) -> PolarData:
    """Polars of a table (.csv, .csv.gz) with columns reynolds, mach, alpha_deg, cl, cd in any order, of a polar that XFOIL
    saved, or of a folder of such polars.

    Raises ValueError for a file that disagrees with the card beside it (NAME.json, if it is one of polars), is damaged,
    lacks a column, holds a number that no polar can, or gives two values for one point.
    """
    if place.is_dir():
        files = sorted(file for file in place.iterdir() if file.is_file() and not file.name.startswith("."))
        if not 0 < len(files) <= MOST_FILES:
            raise ValueError(f"{place}: {len(files)} files are invalid: it must hold 1 to {MOST_FILES} polars of XFOIL")
        parts = [_read_saved(file) for file in files]
    elif is_saved_polar(place):
        parts = [_read_saved(place)]
    else:
        parts = [_read_table(place)]
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in NEEDED}
    # One file keeps its own hash, which its card states.
    digest = (
        parts[0].sha256 if len(parts) == 1 else hashlib.sha256("".join(p.sha256 for p in parts).encode()).hexdigest()
    )
    return _without_repeated_points(PolarData(**columns, sha256=digest), str(place))


def _read_saved(file: Path) -> PolarData:
    rows, digest = read_saved_polar(file)
    checked = [
        [_number(cell, name, f"{file.name}, line {line}") for name, cell in zip(NEEDED, cells, strict=True)]
        for line, cells in rows
    ]
    columns = dict(zip(NEEDED, np.array(checked).reshape(-1, len(NEEDED)).T, strict=True))
    return PolarData(**columns, sha256=digest)


def _read_table(file: Path) -> PolarData:
    table = read_table(file)
    _check_card(file, table.sha256)
    if missing := [name for name in NEEDED if name not in table.header]:
        raise ValueError(f"{file.name}: column {missing[0]} is missing; there must be {', '.join(NEEDED)}")
    columns = {}
    for name in NEEDED:
        k = table.header.index(name)
        columns[name] = np.array([_number(row[k], name, f"{file.name}, line {line}") for line, row in table.rows])
    return PolarData(**columns, sha256=table.sha256)


def _check_card(file: Path, digest: str) -> None:
    """Raises ValueError if a card of polars beside the file is damaged or of another table."""
    card_file = file.with_name(file.name.removesuffix(".gz").removesuffix(".csv") + ".json")
    if not card_file.is_file():
        return
    card = read_json(card_file)
    if not isinstance(card, dict) or not str(card.get("schema", DATA_SCHEMA)).startswith("lpc-mdo/"):
        return  # somebody's own file
    if card.get("schema", DATA_SCHEMA) == DATA_SCHEMA and digest != card.get("sha256"):
        raise ValueError(f"{file.name}: sha256 = {digest} is not allowed; its card says {card.get('sha256')}")


def _without_repeated_points(data: PolarData, place: str) -> PolarData:
    """Every point once: a second one would stand among the fitted and among those held out. Raises ValueError where they
    disagree."""
    points = np.stack([data.reynolds, data.mach, data.alpha_deg], axis=-1)
    order = np.lexsort(points.T)
    is_second = np.r_[False, (np.diff(points[order], axis=0) == 0.0).all(axis=1)]
    for i in np.flatnonzero(is_second):
        first, second = order[i - 1], order[i]
        if data.cl[first] != data.cl[second] or data.cd[first] != data.cd[second]:
            reynolds, mach, alpha = points[first]
            raise ValueError(
                f"{place}: alpha_deg = {alpha:g} at reynolds = {reynolds:g}, mach = {mach:g} is given twice with different "
                f"values, cl = {data.cl[first]:g} and {data.cl[second]:g}; it must stand once"
            )
    keep = np.ones(len(points), dtype=bool)
    keep[order[is_second]] = False
    columns = {name: getattr(data, name)[keep] for name in NEEDED}
    count = int(is_second.sum())
    notes = (f"{count} repeated point{'s' if count > 1 else ''} left out",) if count else ()
    return PolarData(**columns, sha256=data.sha256, notes=notes)


def _number(cell: str, name: str, place: str) -> float:
    lower, upper = ALLOWED[name]
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not lower <= value <= upper:
        raise ValueError(
            f"{place}: {name} = {reprlib.repr(cell)} is not allowed; it must lie between {lower:g} and {upper:g}"
        )
    return value
