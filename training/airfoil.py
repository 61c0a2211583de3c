"""Fitting the airfoil surrogate to polars, and measuring it on polars that it has not seen."""

import hashlib
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from rich.progress import Progress
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from lpc_mdo.airfoils.shape import AirfoilShape
from lpc_mdo.files.write import write_together
from lpc_mdo.surrogates.airfoil import (
    AirfoilPolar,
    TrainingRange,
    held_mach_number,
    parse_airfoil,
    scaled_inputs,
)
from lpc_mdo.surrogates.cards import AIRFOIL_SCHEMA
from lpc_mdo.surrogates.section_theory import drag_rise
from lpc_mdo.training.network_fit import Samples, State, fit, logistic_layers, parameter_count, start
from lpc_mdo.training.polar_data import PolarData

HIDDEN = 28
# Gentle, as measured post-stall lift is: a steep fall makes rotor inflow ambiguous.
BLEND_DEG = (-24.0, -10.0, 16.0, 30.0)
HELD_OUT_FROM = 1e5  # Reynolds number
HELD_OUT_SHARE = 0.1  # of the points on fitted polars, never fitted
ATTACHED_DEG = (-6.0, 12.0)
BANDS = {"re_from_2e5": (2e5, np.inf), "re_1e5_to_2e5": (1e5, 2e5), "re_below_1e5": (0.0, 1e5)}
ITERATIONS = 250
CHECKPOINT_EVERY = 20
LIFT_SCALE, DRAG_SCALE = 0.01, 0.01  # errors of cl and of log(cd) that weigh the same
LOW_REYNOLDS_WEIGHT, STALL_WEIGHT = 0.05, 0.2
FEWEST_POINTS = 100


@dataclass(frozen=True)
class Split:
    """Boolean masks (point,) over the data, and the Reynolds and Mach numbers that are held out whole."""

    train: np.ndarray
    unseen_polars: np.ndarray
    unseen_points: np.ndarray
    held_out_reynolds: tuple[float, ...]
    held_out_mach: tuple[float, ...]


def held_out_values(values: np.ndarray) -> tuple[float, ...]:
    """Every third of the distinct values from the second on, never the ends; none of fewer than four."""
    distinct = np.unique(values)
    return tuple(distinct[1:-1:3].tolist()) if len(distinct) >= 4 else ()


def split(data: PolarData, seed: int) -> Split:
    """Polars at the held-out Reynolds and Mach numbers, a share of the points elsewhere, and the rest to fit."""
    # Below, polars change so much from one Reynolds number to the next that none can be spared.
    reynolds = held_out_values(data.reynolds[data.reynolds >= HELD_OUT_FROM])
    mach = held_out_values(data.mach)
    unseen_polars = np.isin(data.reynolds, reynolds) | np.isin(data.mach, mach)
    draw = np.random.default_rng(seed).random(len(data.cl)) < HELD_OUT_SHARE
    unseen_points = draw & ~unseen_polars
    return Split(~(unseen_polars | unseen_points), unseen_polars, unseen_points, reynolds, mach)


def same_lift_mach(mach: float) -> tuple[float, float]:
    """The Mach numbers about `mach` where Prandtl and Glauert's rule, cl ~ (1 - M^2)^(-1/2), changes lift by at most 1 %."""
    beta = 1.0 - mach**2
    lower, upper = 1.0 - beta * 1.01**2, 1.0 - beta / 1.01**2
    return math.sqrt(max(lower, 0.0)), math.sqrt(upper)


def training_range(data: PolarData) -> TrainingRange:
    """Of polars at one Mach number: where they hold as they are, `same_lift_mach`.

    Raises ValueError if the data are too few, or of one angle or one Reynolds number.
    """
    if len(data.cl) < FEWEST_POINTS:
        raise ValueError(f"{len(data.cl)} points are not allowed; polars must hold at least {FEWEST_POINTS}")
    ends = {}
    for name in ("alpha_deg", "reynolds", "mach"):
        values = getattr(data, name)
        ends[name] = (float(values.min()), float(values.max()))
        if ends[name][0] == ends[name][1] and name == "mach":
            ends[name] = same_lift_mach(ends[name][0])
        elif ends[name][0] == ends[name][1]:
            raise ValueError(f"{name} = {values[0]:g} at every point is not allowed; polars must vary in it")
    return TrainingRange(**ends)


def _is_of_one_mach_number(data: PolarData) -> bool:
    return bool(np.ptp(data.mach) == 0.0)


def _columns(data: PolarData) -> tuple[Tensor, Tensor, Tensor]:
    return torch.deg2rad(torch.tensor(data.alpha_deg)), torch.tensor(data.reynolds), torch.tensor(data.mach)


def is_attached(data: PolarData) -> np.ndarray:
    return (data.alpha_deg >= ATTACHED_DEG[0]) & (data.alpha_deg <= ATTACHED_DEG[1])


def samples(data: PolarData, mask: np.ndarray, thickness_to_chord: float) -> Samples:
    """The masked points in the units of the fit."""
    limits = training_range(data)
    inputs = scaled_inputs(*_columns(data), limits)
    cl, cd = torch.tensor(data.cl), torch.tensor(data.cd)
    # The model adds the drag rise from the held Mach number to the true one, which differ just below the last one.
    rise = drag_rise(cl, torch.tensor(data.mach), held_mach_number(inputs[:, 2], limits), thickness_to_chord)
    log_cd = torch.log(torch.maximum(cd - rise, 0.5 * cd))
    if _is_of_one_mach_number(data):
        inputs[:, 2] = 0.0  # where its weights, which the data do not determine, have no say
    low, high = ATTACHED_DEG[0] - 1.0, ATTACHED_DEG[1] + 1.0
    # Stall and the lowest Reynolds numbers, where XFOIL itself scatters, must not bend what rotors use.
    weight = np.where((data.alpha_deg >= low) & (data.alpha_deg <= high), 1.0, STALL_WEIGHT)
    weights = torch.tensor(weight * np.where(data.reynolds < 1e5, LOW_REYNOLDS_WEIGHT, 1.0))
    targets = torch.stack([cl / LIFT_SCALE, log_cd / DRAG_SCALE], dim=-1)
    return Samples(inputs[mask], targets[mask], weights[mask])


def as_polar(parameters: Tensor, data: PolarData, name: str, thickness_to_chord: float) -> AirfoilPolar:
    """The model of fitted parameters, which work in units of allowed errors; without hash and card."""
    *hidden, (matrix, bias) = logistic_layers(parameters, HIDDEN)
    if _is_of_one_mach_number(data):
        first, offset = hidden[0]
        hidden[0] = first * torch.tensor([1.0, 1.0, 0.0], dtype=torch.float64), offset
    scale = torch.tensor([LIFT_SCALE, DRAG_SCALE], dtype=torch.float64)
    layers = (*hidden, (scale[:, None] * matrix, scale * bias))
    return AirfoilPolar(name, thickness_to_chord, layers, training_range(data), BLEND_DEG, "", {})


def predictions(polar: AirfoilPolar, data: PolarData, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lift and drag coefficient (masked point,) of the model."""
    cl, cd = polar(*(column[mask] for column in _columns(data)))
    return cl.numpy(), cd.numpy()


def error_figures(data: PolarData, mask: np.ndarray, cl: np.ndarray, cd: np.ndarray) -> dict[str, float]:
    """Mean and largest error of predictions (masked point,): of cl absolute, of cd relative."""
    lift, drag = np.abs(cl - data.cl[mask]), np.abs(cd / data.cd[mask] - 1.0)
    return {
        "points": int(mask.sum()),
        "cl_mean": float(lift.mean()),
        "cl_max": float(lift.max()),
        "cd_mean_relative": float(drag.mean()),
        "cd_max_relative": float(drag.max()),
    }


def error_masks(data: PolarData, parts: Split) -> dict[str, np.ndarray]:
    """The points behind each row of the error table: fitted, unseen points, unseen polars, by Reynolds number."""
    table = {}
    for part in ("train", "unseen_points", "unseen_polars"):
        for band, (low, high) in BANDS.items():
            mask = getattr(parts, part) & (data.reynolds >= low) & (data.reynolds < high)
            if mask.any():
                table[f"{part}_{band}"] = mask
    return table


def error_table(data: PolarData, parts: Split, polar: AirfoilPolar) -> dict[str, dict[str, float]]:
    """Errors in the attached range, a row for each of `error_masks`."""
    rows = {name: mask & is_attached(data) for name, mask in error_masks(data, parts).items()}
    return {
        name: error_figures(data, mask, *predictions(polar, data, mask)) for name, mask in rows.items() if mask.any()
    }


def _fit_key(data: PolarData, thickness_to_chord: float, seed: int) -> str:
    """What a checkpoint must agree in to be gone on from."""
    settings = [
        HIDDEN,
        thickness_to_chord,
        HELD_OUT_FROM,
        HELD_OUT_SHARE,
        ATTACHED_DEG,
        LIFT_SCALE,
        DRAG_SCALE,
        seed,
        data.sha256,
    ]
    return hashlib.sha256(json.dumps(settings).encode()).hexdigest()


def _save_checkpoint(file: Path, key: str, state: State) -> None:
    metadata = {
        "key": key,
        "damping": repr(state.damping),
        "iteration": str(state.iteration),
        "has_ended": str(state.has_ended),
    }
    write_together({file: save({"parameters": state.parameters}, metadata)})


def _read_checkpoint(file: Path, key: str) -> State | None:
    """The stored state of the same fit; None if there is none or it belongs to another fit."""
    try:
        with safe_open(file, framework="pt") as stored:
            metadata, parameters = stored.metadata(), stored.get_tensor("parameters")
    except (OSError, SafetensorError):
        return None
    if metadata["key"] != key or parameters.shape != (parameter_count(HIDDEN),):
        return None
    return State(parameters, float(metadata["damping"]), int(metadata["iteration"]), metadata["has_ended"] == str(True))


def fit_resumably(data: PolarData, thickness_to_chord: float, seed: int, checkpoint: Path | None = None) -> Tensor:
    """Parameters that minimize the robust error over the fitted points; the same bits whether or not interrupted."""
    key = _fit_key(data, thickness_to_chord, seed)
    state = (_read_checkpoint(checkpoint, key) if checkpoint else None) or start(HIDDEN, seed)
    with Progress(transient=True) as progress:
        task = progress.add_task("fitting", total=ITERATIONS, completed=state.iteration)

        def on_iteration(state: State) -> None:
            progress.update(task, completed=state.iteration)
            if checkpoint and (state.iteration % CHECKPOINT_EVERY == 0 or state.has_ended):
                _save_checkpoint(checkpoint, key, state)

        fitted = samples(data, split(data, seed).train, thickness_to_chord)
        return fit(fitted, state, HIDDEN, ITERATIONS, on_iteration).parameters


def train(data: PolarData, shape: AirfoilShape, seed: int, output: Path) -> dict[str, dict[str, Any]]:
    """Fit, measure and write NAME.safetensors and its card; the weights have not seen the held-out points.

    Goes on from the checkpoint NAME.fit in `output` that an interrupted run of the same fit left there.
    Raises ValueError if the data are too few or do not vary.
    """
    name, thickness_to_chord = shape.name, shape.thickness_to_chord
    limits, parts = training_range(data), split(data, seed)
    output.mkdir(parents=True, exist_ok=True)
    checkpoint = output / f"{name}.fit"
    polar = as_polar(fit_resumably(data, thickness_to_chord, seed, checkpoint), data, name, thickness_to_chord)
    table = error_table(data, parts, polar)
    tensors: dict[str, torch.Tensor] = {}
    for i, (matrix, bias) in enumerate(polar.weights):
        tensors |= {f"matrix_{i}": matrix.contiguous(), f"bias_{i}": bias.contiguous()}
    weights = save(tensors)
    card = {
        "schema": AIRFOIL_SCHEMA,
        "name": name,
        "thickness_to_chord": thickness_to_chord,
        "section": {"key": shape.key, "designation": shape.designation, "notes": shape.notes},
        "model": f"logistic network 3-{HIDDEN}-{HIDDEN}-2 for cl and log(cd); stalled plate and drag rise outside",
        "blend_deg": list(BLEND_DEG),
        "training_range": {"alpha_deg": limits.alpha_deg, "reynolds": limits.reynolds, "mach": limits.mach},
        "held_out": {
            "reynolds": parts.held_out_reynolds,
            "mach": parts.held_out_mach,
            "share_of_points": HELD_OUT_SHARE,
            "fitted_afterwards": False,
        },
        "limits": (
            "steady two-dimensional flow over a smooth surface with free transition; no shocks within the training range, "
            "Lock's drag rise beyond its Mach numbers, a flat plate beyond stall"
        )
        + (f"; polars at Mach {data.mach[0]:g} alone, taken as they are" if _is_of_one_mach_number(data) else ""),
        "attached_deg": list(ATTACHED_DEG),
        "errors": table,
        "seed": seed,
        "data_sha256": data.sha256,
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
    }
    card_text = (json.dumps(card, indent=1) + "\n").encode()
    parse_airfoil(card_text, weights)  # what cannot be read back is not written
    write_together({output / f"{name}.safetensors": weights, output / f"{name}.json": card_text})
    checkpoint.unlink(missing_ok=True)
    return table
