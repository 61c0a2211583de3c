"""Sized samples as a table: the exchange format for our own sizing and for a user's, checked on reading.

CSV (optionally gzip), UTF-8, comma, header, SI units in the names. Positions in geometry axes (x aft, y starboard, z up),
inertia about the component's own centre of gravity, products as + integral of xy dm (NASTRAN prints them negative).
"""

import csv
import io
import reprlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lpc_mdo.files.read import read_json
from lpc_mdo.files.tables import read_table

INPUTS = (
    "wing_area_m2",
    "wing_aspect_ratio",
    "fuselage_length_m",
    "battery_mass_kg",
    "cruise_speed_m_s",
    "htail_area_m2",
    "vtail_area_m2",
)
# Order of surrogates.structural_mass.StructuralInputs, by column name.
COMPONENTS = {
    "wing": "wing",
    "fuselage": "fuselage",
    "boom_inner_port": "boom_in_port",
    "boom_outer_port": "boom_out_port",
    "boom_inner_starboard": "boom_in_star",
    "boom_outer_starboard": "boom_out_star",
    "horizontal_tail": "htail",
    "vertical_tail": "vtail",
}
QUANTITIES = (
    "mass_kg",
    "cg_x_m",
    "cg_y_m",
    "cg_z_m",
    "ixx_kg_m2",
    "iyy_kg_m2",
    "izz_kg_m2",
    "ixy_kg_m2",
    "ixz_kg_m2",
    "iyz_kg_m2",
)
LEADING = ("sample_id", "status", *INPUTS, "gross_mass_kg", "max_violation", "design_cycles")
COLUMNS = LEADING + tuple(f"{short}_{quantity}" for short in COMPONENTS.values() for quantity in QUANTITIES)
STATUSES = ("converged", "soft", "failed")


@dataclass(frozen=True)
class Samples:
    """ids and statuses (sample,); inputs (sample, 7); targets (sample, component, quantity), NaN where missing; gross mass,
    largest violation and design cycles (sample,)."""

    ids: tuple[str, ...]
    statuses: tuple[str, ...]
    inputs: np.ndarray
    targets: np.ndarray
    gross_mass: np.ndarray
    violation: np.ndarray
    cycles: np.ndarray

    def take(self, keep: Sequence[int] | np.ndarray) -> "Samples":
        keep = np.asarray(keep, dtype=int)
        return Samples(
            tuple(self.ids[i] for i in keep),
            tuple(self.statuses[i] for i in keep),
            *(getattr(self, name)[keep] for name in ("inputs", "targets", "gross_mass", "violation", "cycles")),
        )

    def named(self, prefix: str) -> "Samples":
        """Those whose id starts with the prefix."""
        return self.take([i for i, name in enumerate(self.ids) if name.startswith(prefix)])

    def usable(self) -> "tuple[Samples, list[str]]":
        """Converged samples (hard or soft), each design once, and one sentence for every sample that is dropped.

        A design that stood twice would be fitted and held out at once. Raises ValueError where two samples of one design
        disagree.
        """
        dropped = [
            f"{self.ids[i]}: not converged after {self.cycles[i]:g} cycles, largest violation {self.violation[i]:.1e}"
            for i, status in enumerate(self.statuses)
            if status == "failed"
        ]
        first: dict[tuple[str, ...], int] = {}
        for i, status in enumerate(self.statuses):
            if status == "failed":
                continue
            other = first.setdefault(tuple(f"{value:.10g}" for value in self.inputs[i]), i)
            if other == i:
                continue
            if not np.allclose(self.targets[i], self.targets[other], rtol=1e-6, atol=1e-9, equal_nan=True):
                raise ValueError(
                    f"samples {self.ids[other]} and {self.ids[i]} are invalid: they have the same inputs but different results"
                )
            dropped.append(f"{self.ids[i]}: the same sample as {self.ids[other]}")
        return self.take(list(first.values())), dropped


def to_csv(samples: Samples) -> bytes:
    """The table with twelve digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for i, name in enumerate(samples.ids):
        numbers = [*samples.inputs[i], samples.gross_mass[i], samples.violation[i]]
        cells = ["" if np.isnan(v) else f"{v:.12g}" for v in (*numbers, samples.cycles[i], *samples.targets[i].ravel())]
        writer.writerow([name, samples.statuses[i], *cells])
    return text.getvalue().encode()


def _number(cell: str, where: str) -> float:
    if cell == "":
        return float("nan")
    try:
        value = float(cell)
    except ValueError:
        raise ValueError(
            f"{where} = {reprlib.repr(cell)} is not allowed; it must be a number with a decimal dot"
        ) from None
    if not np.isfinite(value):
        raise ValueError(f"{where} = {reprlib.repr(cell)} is not allowed; it must be finite")
    return value


def read_samples(file: Path) -> tuple[Samples, str]:
    """Samples of a CSV file (.csv or .csv.gz), and the sha256 of the file.

    Raises ValueError that names place, value and rule for unknown or missing columns, non-numbers, masses that are not
    positive and inertia that no body can have.
    """
    table = read_table(file)
    if unknown := sorted(set(table.header) - set(COLUMNS)):
        raise ValueError(
            f"{file.name}: column {unknown[0][:80]!r} is not allowed; it must be one of {', '.join(COLUMNS[:4])}, ..."
        )
    if missing := [name for name in COLUMNS if name not in table.header]:
        raise ValueError(f"{file.name}: column {missing[0]!r} is missing")
    ids, statuses, numbers = [], [], []
    for line, cells in table.rows:
        row, where = dict(zip(table.header, cells, strict=True)), f"{file.name}, line {line}: "
        if row["status"] not in STATUSES:
            raise ValueError(f"{where}status = {row['status']!r} is not allowed; it must be one of {STATUSES}")
        if row["sample_id"] in ids:
            raise ValueError(f"{where}sample_id = {row['sample_id']!r} is invalid: it must stand once")
        ids.append(row["sample_id"])
        statuses.append(row["status"])
        numbers.append([_number(row[name], where + name) for name in COLUMNS[2:]])
    if not ids:
        raise ValueError(f"{file.name}: no samples are not allowed; the table has a header only")
    values = np.array(numbers)
    targets = values[:, len(LEADING) - 2 :].reshape(len(ids), len(COMPONENTS), len(QUANTITIES))
    count = len(INPUTS)
    gross, violation, cycles = values[:, count : count + 3].T
    samples = Samples(tuple(ids), tuple(statuses), values[:, :count], targets, gross, violation, cycles)
    _check(samples, file.name)
    return samples, table.sha256


def read_dataset_card(table: Path, samples: Samples, digest: str) -> dict[str, Any] | None:
    """Content of dataset.json beside a user's table, or None if there is none; its keys: docs/structures.md.

    Raises ValueError if it is of another table, or samples lie outside the bounds that it declares.
    """
    file = table.with_name("dataset.json")
    if not file.is_file():
        return None
    card = read_json(file)
    if not isinstance(card, dict) or card.get("sha256") != digest:
        raise ValueError(f"{file.name}: sha256 is not allowed; {table.name} has {digest}")
    bounds = card.get("bounds", {})
    if not isinstance(bounds, dict) or not bounds.keys() <= set(INPUTS):
        raise ValueError(f"{file.name}: bounds are not allowed; they must be lists by input: {', '.join(INPUTS)}")
    for name, limits in bounds.items():
        is_pair = isinstance(limits, list) and len(limits) == 2 and all(isinstance(v, int | float) for v in limits)
        if not is_pair or not limits[0] < limits[1]:
            raise ValueError(f"{file.name}: bounds.{name} = {limits} is not allowed; it must be lower and upper")
        values = samples.inputs[:, INPUTS.index(name)]
        for i in np.flatnonzero((values < limits[0]) | (values > limits[1])):
            where = f"{table.name}: sample {samples.ids[i]}: {name} = {values[i]:g}"
            raise ValueError(f"{where} is not allowed; {file.name} says between {limits[0]:g} and {limits[1]:g}")
    return card


def _check(samples: Samples, file: str) -> None:
    good = [i for i, status in enumerate(samples.statuses) if status != "failed"]
    for i in good:
        where = f"{file}: sample {samples.ids[i]}: "
        for name, value in zip(INPUTS, samples.inputs[i], strict=True):
            if not value > 0.0:
                raise ValueError(f"{where}{name} = {value:g} is not allowed; it must be positive")
        for component, values in zip(COMPONENTS, samples.targets[i], strict=True):
            if np.isnan(values).all():
                continue
            if not values[0] > 0.0:
                raise ValueError(f"{where}{component} mass_kg = {values[0]:g} is not allowed; it must be positive")
            moments = values[4:7]
            if not (2.0 * moments.max() <= moments.sum() * (1.0 + 1e-6) + 1e-9):
                raise ValueError(
                    f"{where}{component} moments of inertia {moments.round(6).tolist()} are not allowed; "
                    "none may exceed the sum of the other two"
                )
