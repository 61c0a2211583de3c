"""Finished NASTRAN runs to the table of samples. Runs under an interpreter that has pyNastran, apart from torch:

    python -m lpc_mdo.training.nastran_ingest RUNS DESIGN.csv SAMPLES.csv

RUNS holds, for every sample_id of DESIGN.csv, the final bulk data (ID.pch as punched, or ID.bdf) and the printed output
(ID.f06), which tells whether the run converged. Where there is ID.op2, the mass and centre of gravity that NASTRAN found
must be those of the bulk data, else the two are of different designs and the sample fails. A sample whose files cannot be
used is named and left out, the others go on; files that a deck includes must lie in RUNS. pyNastran 1.4.1 needs numpy < 2;
this file imports nothing but the two and the table format.
"""

import io
import reprlib
import sys
import warnings
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from lpc_mdo.files.tables import read_table
from lpc_mdo.files.write import write_together
from lpc_mdo.structures.samples import COMPONENTS, INPUTS, QUANTITIES, Samples, to_csv
from lpc_mdo.training.nastran_files import Run, bulk_text, read_run

# First and last number of the properties (for concentrated masses: elements) of what the starboard half holds.
RANGES = {
    "wing": (1000, 1999),
    "boom_inner": (2000, 2499),
    "boom_outer": (2500, 2999),
    "fuselage": (3000, 3999),
    "horizontal_tail": (4000, 4499),
    "vertical_tail": (4500, 4999),
}
BOTH_SIDES = ("wing", "horizontal_tail")  # one component made of both halves
SAME_MASS, SAME_PLACE = 1e-4, 1e-3  # relative; m: single precision of NASTRAN's weight generator, lumped bars
LONGEST_NAME = 100  # characters of a sample_id: files carry it
MIRROR = np.diag([1.0, -1.0, 1.0])


class DeckError(ValueError):
    """What is wrong with bulk data, in a sentence of ours; all else that reading them raises is pyNastran's."""


@dataclass(frozen=True)
class Body:
    """mass kg, center (3,) m, inertia (3, 3) kg m^2 about the centre."""

    mass: float
    center: np.ndarray
    inertia: np.ndarray

    def mirrored(self) -> "Body":
        return Body(self.mass, MIRROR @ self.center, MIRROR @ self.inertia @ MIRROR)


def combined(bodies: list[Body]) -> Body:
    """All bodies as one. Raises ValueError where their mass is not above zero."""
    mass = sum(body.mass for body in bodies)
    if not mass > 0.0:
        raise DeckError(f"mass = {mass:g} is invalid: it must be above 0")
    center = sum(body.mass * body.center for body in bodies) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        arm = body.center - center
        inertia += body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Body(mass, center, inertia)


def _bar(element: Any) -> Body:
    """A CBAR as a uniform rod with the spread of its section."""
    a, b = (node.get_position() for node in element.nodes_ref)
    length, mass = float(np.linalg.norm(b - a)), float(element.Mass())
    axis = (b - a) / length
    up = np.asarray(element.x, dtype=float) if element.g0 is None else element.g0_ref.get_position() - a
    side = np.cross(axis, up)
    side /= np.linalg.norm(side)
    axes = np.stack([axis, np.cross(side, axis), side])
    section = element.pid_ref
    density = float(section.Rho())
    along_y, along_z = density * section.I11() * length, density * section.I22() * length
    reach = mass * length**2 / 12.0
    inertia = np.diag([along_y + along_z, along_z + reach, along_y + reach])
    return Body(mass, 0.5 * (a + b), axes.T @ inertia @ axes)


def _concentrated(element: Any) -> Body:
    i11, i21, i22, i31, i32, i33 = element.I
    inertia = np.array([[i11, -i21, -i31], [-i21, i22, -i32], [-i31, -i32, i33]])
    return Body(float(element.mass), element.nid_ref.get_position() + element.X, inertia)


def half_bodies(file: Path, runs: Path) -> dict[str, Body]:
    """Components from the bulk data of the starboard half, by the names of RANGES; what is included must lie in `runs`.

    Bars count as rods, concentrated masses with their own inertia, any other element as a point at its centroid. Raises
    ValueError if a mass belongs to no component or a component has none.
    """
    from pyNastran.bdf.bdf import BDF

    try:
        text = bulk_text(file, runs)
    except ValueError as error:
        raise DeckError(str(error)) from None
    model = BDF(debug=False, log=None)
    model.read_bdf(io.StringIO(text), punch="BEGIN BULK" not in text.upper(), xref=True)
    if model.reject_count:  # it may carry mass
        raise DeckError(f"{file.name}: card {min(model.reject_count)} is invalid: pyNastran does not know it")
    found: dict[str, list[Body]] = {name: [] for name in RANGES}
    for number, element in [*model.elements.items(), *model.masses.items()]:
        if element.type == "CONM2":
            key, body = number, _concentrated(element)
        else:
            key = element.pid_ref.pid
            body = _bar(element) if element.type == "CBAR" else _point(element)
        names = [name for name, (first, last) in RANGES.items() if first <= key <= last]
        if not names:
            raise DeckError(f"{file.name}: {element.type} {number} of number {key} belongs to no component")
        found[names[0]].append(body)
    if empty := [name for name, bodies in found.items() if not bodies]:
        raise DeckError(f"{file.name}: {empty[0]} has no elements; every component must have some")
    return {name: combined(bodies) for name, bodies in found.items()}


def whole_bodies(half: dict[str, Body]) -> dict[str, Body]:
    """Components of the whole aircraft, by the names of the table."""
    bodies = {}
    for name, body in half.items():
        if name in BOTH_SIDES:
            bodies[name] = combined([body, body.mirrored()])
        elif name.startswith("boom"):
            bodies[f"{name}_starboard"], bodies[f"{name}_port"] = body, body.mirrored()
        else:
            bodies[name] = body
    return bodies


def _point(element: Any) -> Body:
    return Body(float(element.Mass()), np.asarray(element.Centroid(), dtype=float), np.zeros((3, 3)))


def is_weighed_alike(half: dict[str, Body], file: Path) -> bool:
    """Whether NASTRAN's grid point weights, if the OP2 file has them, are those of the bulk data."""
    from pyNastran.op2.op2 import OP2

    model = OP2(debug=False, log=None)
    model.read_op2(str(file))
    body = combined(list(half.values()))
    for weight in model.grid_point_weight.values():
        center = np.array([weight.cg[1, 0], weight.cg[0, 1], weight.cg[0, 2]])
        is_as_heavy = abs(float(weight.mass[0]) - body.mass) <= SAME_MASS * body.mass
        if not is_as_heavy or np.abs(center - body.center).max() > SAME_PLACE:
            return False
    return True


def _quantities(body: Body) -> np.ndarray:
    """In the order QUANTITIES; products of inertia as + integral."""
    tensor = body.inertia
    products = [-tensor[0, 1], -tensor[0, 2], -tensor[1, 2]]
    return np.array([body.mass, *body.center, *np.diag(tensor), *products])


def _final_bulk_data(runs: Path, name: str) -> Path | None:
    files = [runs / f"{name}{ending}" for ending in (".pch", ".bdf")]
    return next((file for file in files if file.is_file()), None)


def read_design(file: Path) -> dict[str, list[float]]:
    """Inputs by sample_id. Raises ValueError for missing columns, names given twice or with a path, and other numbers than
    positive ones."""
    table = read_table(file)
    if missing := [name for name in ("sample_id", *INPUTS) if name not in table.header]:
        raise ValueError(f"{file.name}: column {missing[0]!r} is missing")
    designs: dict[str, list[float]] = {}
    for line, cells in table.rows:
        row = dict(zip(table.header, cells, strict=True))
        name, where = row["sample_id"], f"{file.name}, line {line}"
        if not 0 < len(name) <= LONGEST_NAME or Path(name).name != name or name in designs:
            raise ValueError(
                f"{where}: sample_id = {reprlib.repr(name)} is invalid: it must be the name of files, and stand once"
            )
        designs[name] = [_positive(row[column], f"{where}: {column}") for column in INPUTS]
    return designs


def _positive(cell: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if not 0.0 < value < float("inf"):
        raise ValueError(f"{where} = {reprlib.repr(cell)} is invalid: it must be a positive number")
    return value


def _quietly(function: Callable[..., Any], *arguments: Any) -> Any:
    """What the function returns, without what pyNastran prints. Raises DeckError in one line, whatever it raises."""
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return function(*arguments)
    except DeckError:
        raise
    except (Exception, SystemExit) as error:  # pyNastran answers damaged files with exceptions of every kind
        words = " ".join(str(error).split())[:200]
        raise DeckError(f"cannot be read: pyNastran stops with {type(error).__name__}: {words}") from None


def _sample(runs: Path, file: Path, name: str, notes: list[str]) -> tuple[Run, np.ndarray]:
    """How the run ended, and targets (component, quantity). Raises ValueError if the bulk data cannot be used."""
    run, weighed = read_run(runs / f"{name}.f06"), runs / f"{name}.op2"
    half = _quietly(half_bodies, file, runs)
    if run.status == "failed":
        notes.append(f"{name}: {run.reason}")
    if weighed.is_file():
        try:
            is_alike = _quietly(is_weighed_alike, half, weighed)
            fault = "" if is_alike else f"{weighed.name} weighs another design than {file.name}"
        except ValueError as error:
            fault = f"{weighed.name}: {error}"
        if fault:
            run = replace(run, status="failed")
            notes.append(f"{name}: {fault}")
    bodies = whole_bodies(half)
    targets = np.stack([_quantities(bodies[component]) for component in COMPONENTS])
    if not np.isfinite(targets).all():
        raise ValueError("it gives masses or inertia that are not finite")
    return run, targets


def ingest(runs: Path, design: Path) -> tuple[Samples, list[str]]:
    """Samples whose bulk data can be used, and a sentence on every one that is missing, is not, or did not converge.

    Raises ValueError if the design table cannot be used or no sample is left.
    """
    designs, kept, notes = read_design(design), [], []
    for name, inputs in designs.items():
        if (file := _final_bulk_data(runs, name)) is None:
            notes.append(f"{name}: there must be {name}.pch or {name}.bdf in {runs}")
            continue
        try:
            run, targets = _sample(runs, file, name, notes)
        except ValueError as error:
            notes.append(
                f"{name} left out: {str(error) if str(error).startswith(file.name) else f'{file.name}: {error}'}"
            )
            continue
        kept.append((name, run, inputs, targets))
    if not kept:
        why = notes[0] if notes else "it must hold a line for each"
        raise ValueError(f"{design.name}: no sample can be used: {why}")
    names, found, inputs, targets = zip(*kept, strict=True)
    samples = Samples(
        ids=tuple(names),
        statuses=tuple(run.status for run in found),
        inputs=np.array(inputs),
        targets=np.array(targets).reshape(len(names), len(COMPONENTS), len(QUANTITIES)),
        gross_mass=np.full(len(names), np.nan),
        violation=np.array([run.violation for run in found]),
        cycles=np.array([run.cycles for run in found]),
    )
    return samples, notes


def main(arguments: list[str]) -> int:
    if len(arguments) != 3:
        print("usage: python -m lpc_mdo.training.nastran_ingest RUNS DESIGN.csv SAMPLES.csv", file=sys.stderr)
        return 2
    if find_spec("pyNastran") is None:
        print("nastran_ingest: pyNastran is not installed here; see docs/structures.md", file=sys.stderr)
        return 2
    runs, design, output = map(Path, arguments)
    try:
        samples, notes = ingest(runs, design)
        write_together({output: to_csv(samples)})
    except (OSError, ValueError) as error:
        print(f"nastran_ingest: {error}", file=sys.stderr)
        return 2
    for note in notes:
        print(note)
    print(f"wrote {output}: {len(samples.ids)} samples, {samples.statuses.count('failed')} of them failed")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
