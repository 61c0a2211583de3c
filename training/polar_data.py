"""The data behind an airfoil surrogate: a designed grid of XFOIL polars, generated resumably, or a user's own table."""

import csv
import gzip
import hashlib
import io
import json
import zlib
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from rich.progress import track

from lpc_mdo.reporting.files import write_together
from training.airfoil_shape import AirfoilShape
from training.xfoil import PANEL_COUNTS, Polar, PolarPoint, missing_tools, run_polar

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
LARGEST_FILE = 200_000_000  # bytes, unpacked


@dataclass(frozen=True)
class PolarData:
    """Columns of the data set, each (point,)."""

    reynolds: np.ndarray
    mach: np.ndarray
    alpha_deg: np.ndarray
    cl: np.ndarray
    cd: np.ndarray
    sha256: str


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
    work = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(_cached_polar)(shape, reynolds, mach, grid.alpha_deg, parts) for reynolds, mach in pairs
    )
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
        "schema": "lpc-mdo/polar-data/1",
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


def read(file: Path) -> PolarData:
    """Polars from a table (.csv or .csv.gz) with columns reynolds, mach, alpha_deg, cl, cd, in any order.

    Raises ValueError for a file that disagrees with the card beside it (NAME.json, if there is one), is damaged, lacks a
    column, or holds a number that no polar can.
    """
    data = file.read_bytes()
    digest = hashlib.sha256(data).hexdigest()
    card_file = file.with_name(file.name.removesuffix(".gz").removesuffix(".csv") + ".json")
    if card_file.is_file():
        try:
            expected = json.loads(card_file.read_bytes())["sha256"]
        except (KeyError, TypeError, UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
            raise ValueError(f"{card_file.name} is damaged: {error!r}") from None
        if digest != expected:
            raise ValueError(f"{file.name}: sha256 = {digest} is not allowed; its card says {expected}")
    return _parse(file, _unpacked(file, data), digest)


def _unpacked(file: Path, data: bytes) -> str:
    try:
        if file.suffix == ".gz":
            with gzip.GzipFile(fileobj=io.BytesIO(data)) as stream:
                data = stream.read(LARGEST_FILE + 1)
        if len(data) > LARGEST_FILE:
            raise ValueError(f"{file.name}: more than {LARGEST_FILE} bytes are not allowed")
        return data.decode("utf-8-sig")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise ValueError(f"{file.name} is damaged: {error}") from None


def _parse(file: Path, text: str, digest: str) -> PolarData:
    reader = csv.reader(io.StringIO(text))
    try:
        header = [cell.strip() for cell in next(reader, [])]
        if missing := [name for name in NEEDED if name not in header]:
            raise ValueError(f"{file.name}: column {missing[0]} is missing; there must be {', '.join(NEEDED)}")
        places = [header.index(name) for name in NEEDED]
        columns: dict[str, list[float]] = {name: [] for name in NEEDED}
        for row in reader:
            if len(row) != len(header):
                raise ValueError(
                    f"{file.name}: {len(row)} columns are not allowed; the header has {len(header)} (line {reader.line_num})"
                )
            for name, place in zip(NEEDED, places, strict=True):
                columns[name].append(_number(row[place], name, f"{file.name}, line {reader.line_num}"))
    except csv.Error as error:
        raise ValueError(f"{file.name} is damaged: {error}") from None
    return PolarData(**{name: np.array(column) for name, column in columns.items()}, sha256=digest)


def _number(cell: str, name: str, place: str) -> float:
    lower, upper = ALLOWED[name]
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not lower <= value <= upper:
        raise ValueError(f"{place}: {name} = {cell!r} is not allowed; it must lie between {lower:g} and {upper:g}")
    return value
