"""Samples of structural mass: design of the inputs, sizing in parallel, multi-start check, files with their card."""

import gzip
import hashlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from joblib import delayed
from rich.progress import track

from lpc_mdo.files.write import write_together
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.numerics.workers import side_by_side
from lpc_mdo.structures.samples import COMPONENTS, INPUTS, QUANTITIES, Samples, to_csv
from lpc_mdo.structures.sequential import Optimum
from lpc_mdo.structures.shipped import BASELINE, NAME, structural_inputs
from lpc_mdo.structures.sizing import GAUGES, SizingModel, mass_properties, size, split_gauges

REPLICA_COUNT, WORKING_COUNT, TEST_COUNT = 96, 256, 32
REPLICA_RANGE = tuple((0.9 * x, 1.1 * x) for x in BASELINE)
# Wide enough for the main problem with margin: areas and aspect ratio +-30 %, length and speed +-20 %; battery from the
# lightest of the main problem to 120 % of the published baseline.
WORKING_RANGE = (
    (0.7 * BASELINE[0], 1.3 * BASELINE[0]),
    (0.7 * BASELINE[1], 1.3 * BASELINE[1]),
    (0.8 * BASELINE[2], 1.2 * BASELINE[2]),
    (600.0, 1.2 * BASELINE[3]),
    (0.8 * BASELINE[4], 1.2 * BASELINE[4]),
    (0.7 * BASELINE[5], 1.3 * BASELINE[5]),
    (0.7 * BASELINE[6], 1.3 * BASELINE[6]),
)
MULTI_START_COUNT = 5  # the baseline and the first of the replica set
PART = 50  # samples sized together: fixed, so that results do not depend on the number of jobs
OPEN_SOURCE = "own sizing of Timoshenko frames, docs/structures.md; masses as sized, without any calibration"


def latin_hypercube(count: int, limits: tuple[tuple[float, float], ...], seed: int) -> np.ndarray:
    """Scrambled Latin hypercube (count, input); of 200 draws the one with the least largest pairwise correlation."""
    rng = np.random.default_rng(seed)
    best, least = None, np.inf
    for _ in range(200):
        strata = rng.permuted(np.tile(np.arange(count), (len(limits), 1)), axis=1).T
        draw = (strata + rng.random((count, len(limits)))) / count
        correlation = np.abs(np.corrcoef(draw.T) - np.eye(len(limits))).max()
        if correlation < least:
            best, least = draw, correlation
    lower, upper = np.array(limits).T
    return lower + best * (upper - lower)


def design(seed: int) -> dict[str, np.ndarray]:
    """Inputs by set: baseline, replica of the published study, working set, independent test set, axis points."""
    base = np.array(BASELINE)
    axis = np.repeat(base[None], 2 * len(base), axis=0)
    for i, limits in enumerate(WORKING_RANGE):
        axis[2 * i : 2 * i + 2, i] = limits
    return {
        "baseline": base[None],
        "replica": latin_hypercube(REPLICA_COUNT, REPLICA_RANGE, seed),
        "working": latin_hypercube(WORKING_COUNT, WORKING_RANGE, seed + 1),
        "test": latin_hypercube(TEST_COUNT, WORKING_RANGE, seed + 2),
        "axis": axis,
    }


@one_thread()
def _size_part(model: SizingModel, columns: np.ndarray, start: torch.Tensor) -> tuple[Optimum, np.ndarray, np.ndarray]:
    """Optimum, targets (sample, component, quantity) and gross masses of some samples, on one thread."""
    inputs = structural_inputs(columns)
    optimum = size(model, inputs, start)
    structure = model(inputs, optimum.x)
    targets = np.empty((len(columns), len(COMPONENTS), len(QUANTITIES)))
    for i, body in enumerate(mass_properties(structure.pieces).values()):
        tensor = body.inertia
        products = [-tensor[..., 0, 1], -tensor[..., 0, 2], -tensor[..., 1, 2]]
        columns_of_body = [body.mass, *body.center_of_gravity.unbind(-1), *tensor.diagonal(dim1=-2, dim2=-1).unbind(-1)]
        targets[:, i] = torch.stack([*columns_of_body, *products], dim=-1).numpy()
    return optimum, targets, structure.gross_mass.numpy()


@dataclass(frozen=True)
class Sized:
    """Samples with their gauges (sample, variable) and, by sample, the multiplier of every kind of limit."""

    samples: Samples
    gauges: np.ndarray
    drivers: list[dict[str, float]]


def size_samples(model: SizingModel, sets: dict[str, np.ndarray], jobs: int = 2) -> Sized:
    """Size all samples, in parallel parts of fixed size, from the baseline's optimum."""
    columns = np.concatenate(list(sets.values()))
    ids = [f"{name}_{i:03d}" for name, rows in sets.items() for i in range(len(rows))]
    start = size(model, structural_inputs(np.array(BASELINE)[None])).x[0]
    parts = [columns[i : i + PART] for i in range(0, len(columns), PART)]
    work = side_by_side(jobs, (delayed(_size_part)(model, part, start) for part in parts), is_ordered=True)
    results = list(track(work, total=len(parts), description="sizing"))
    certified = np.concatenate([optimum.is_certified.numpy() for optimum, *_ in results])
    samples = Samples(
        ids=tuple(ids),
        statuses=tuple("converged" if ok else "failed" for ok in certified),
        inputs=columns,
        targets=np.concatenate([targets for _, targets, _ in results]),
        gross_mass=np.concatenate([gross for *_, gross in results]),
        violation=np.concatenate([optimum.violation.numpy() for optimum, *_ in results]),
        cycles=np.concatenate([optimum.iterations.numpy() for optimum, *_ in results]),
    )
    gauges = np.concatenate([optimum.x.exp().numpy() for optimum, *_ in results])
    drivers = [_drivers(model, row) for optimum, *_ in results for row in optimum.multipliers]
    return Sized(samples, gauges, drivers)


def _drivers(model: SizingModel, multipliers: torch.Tensor) -> dict[str, float]:
    """Sum of the multipliers by kind of limit: the relative mass that one percent more of every such limit costs."""
    total: dict[str, float] = {}
    for row in torch.nonzero(multipliers > 1e-6).squeeze(-1).tolist():
        key = str(model.limits[row])
        total[key] = total.get(key, 0.0) + float(multipliers[row])
    return total


def _mean_drivers(drivers: list[dict[str, float]]) -> dict[str, float]:
    keys = {key for entry in drivers for key in entry}
    mean = {key: sum(entry.get(key, 0.0) for entry in drivers) / len(drivers) for key in keys}
    return {key: round(value, 5) for key, value in sorted(mean.items(), key=lambda item: -item[1]) if value > 5e-5}


def multi_start_spread(model: SizingModel, columns: np.ndarray, seed: int) -> dict[str, float]:
    """Largest difference (kg) between the masses that certified runs from different starts reach, over the samples.

    Starts: walls of 4 mm; walls and caps drawn between their smallest and a thick gauge; thick walls with thick caps.
    """
    inputs, rng = structural_inputs(columns), np.random.default_rng(seed)
    thick = {name: 1e-3 if name == "cap" else 8e-3 for name in GAUGES}
    upper = torch.tensor([np.log(thick[name]) for name, count in GAUGES.items() for _ in range(count)])
    lower = model.bounds.lower
    share = torch.from_numpy(rng.random((len(columns), len(lower))))
    masses = []
    for start in (model.start(), lower + share * (upper - lower), upper):
        optimum = size(model, inputs, start)
        masses.append(torch.where(optimum.is_certified, optimum.objective, torch.nan).numpy())
    table = np.stack(masses)
    return {
        "samples": len(columns),
        "starts": len(masses),
        "certified_runs": int(np.isfinite(table).sum()),
        "largest_spread_kg": float((np.nanmax(table, axis=0) - np.nanmin(table, axis=0)).max()),
    }


@one_thread()
def generate(output: Path, seed: int = 0, jobs: int = 2, model: SizingModel | None = None) -> Samples:
    """Size the designed samples; write structures_open.csv.gz and its card. Returns all samples, rejected ones marked."""
    model = model or SizingModel()
    sized = size_samples(model, design(seed), jobs)
    data = gzip.compress(to_csv(sized.samples), mtime=0)
    _, rejected = sized.samples.usable()
    replica = [i for i, name in enumerate(sized.samples.ids) if name.startswith("replica")]
    gauges = split_gauges(torch.tensor(sized.gauges[0]).log())
    correlation = np.corrcoef(sized.samples.named("working").inputs.T) - np.eye(len(INPUTS))
    card = {
        "schema": "lpc-mdo/structural-samples/1",
        "axes": "x aft, y starboard, z up, origin of the public geometry model; m, kg, kg m^2",
        "solver": "lpc_mdo/structures/sizing.py: Timoshenko frames, sequential convex programming",
        "airframe": asdict(model.airframe),
        "sets": {
            "baseline": "the inputs of the published regressions",
            "replica": "Latin hypercube, +-10 %",
            "working": "Latin hypercube over the working range, fitted",
            "test": "Latin hypercube over the working range, never fitted",
            "axis": "ends of the working range, one input at a time, never fitted",
        },
        "working_range": dict(zip(INPUTS, WORKING_RANGE, strict=True)),
        "multi_start": multi_start_spread(model, sized.samples.inputs[:MULTI_START_COUNT], seed),
        "largest_correlation": float(np.abs(correlation).max()),
        "seed": seed,
        "samples": len(sized.samples.ids),
        "rejected": rejected,
        "baseline_gauges_mm_or_mm2": {
            name: [round(float(v) * (1e6 if name == "cap" else 1e3), 4) for v in gauges[name]] for name in GAUGES
        },
        "drivers_of_the_replica_set": _mean_drivers([sized.drivers[i] for i in replica]),
        "calibration_factors": dict.fromkeys(COMPONENTS, 1.0),
        "sha256": hashlib.sha256(data).hexdigest(),
    }
    output.mkdir(parents=True, exist_ok=True)
    card_text = json.dumps(card, indent=1) + "\n"
    write_together({output / f"{NAME}.csv.gz": data, output / f"{NAME}.json": card_text.encode()})
    return sized.samples


def baseline_gauges(card: dict[str, Any]) -> torch.Tensor:
    """Logarithms of gauges (variable,) of the baseline, from the card of our samples, which stores mm and mm^2."""
    stored, unit = card["baseline_gauges_mm_or_mm2"], {"cap": 1e-6}
    return torch.tensor([np.log(v * unit.get(name, 1e-3)) for name in GAUGES for v in stored[name]])
