"""From sized samples to the surrogate of structural mass: fitting, judging, writing weights and model card."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lpc_mdo.files.write import write_together
from lpc_mdo.structures.published_tables import ELASTICITY_INPUTS, GROUPS, PUBLISHED_FITS
from lpc_mdo.structures.samples import INPUTS, QUANTITIES, Samples
from lpc_mdo.structures.shipped import BASELINE, structural_inputs
from lpc_mdo.surrogates.cards import STRUCTURE_SCHEMA
from lpc_mdo.surrogates.structural_mass import COMPONENTS, StructuralMassSurrogate, load_structural_mass, parse_trained
from lpc_mdo.training.regression import Fit, export, fit_all, linear_slopes

LIMITS = (
    "Masses as the samples have them, without joints, fittings, cut-outs and brackets; calibration_to_published lifts each "
    "to the published level at the baseline and is applied only on request. Outside the box nothing vouches for the fit."
)


@dataclass(frozen=True)
class Origin:
    """Where samples come from: name of the source ("open", "nastran"), a sentence on it, sha256 of their file, and the
    user's own card of the data set, if there is one."""

    name: str
    sentence: str
    sha256: str
    card: dict[str, Any] | None = None


@dataclass(frozen=True)
class Trained:
    """A fitted surrogate, its files' contents, and the fits that it was made from."""

    card: dict[str, Any]
    weights: bytes
    surrogate: StructuralMassSurrogate
    fits: dict[tuple[int, int], Fit]


def fitted_samples(samples: Samples) -> tuple[Samples, list[str]]:
    """Those that a surrogate is fitted to: the working set if there is one, else all; and why others were dropped."""
    usable, dropped = samples.usable()
    working = usable.named("working")
    return (working if working.ids else usable), dropped


def train(samples: Samples, origin: Origin, seed: int = 0) -> Trained:
    """Fit and judge. Raises ValueError if the samples are too few, miss targets or do not vary in an input."""
    fitted, dropped = fitted_samples(samples)
    usable, _ = samples.usable()
    fits = fit_all(fitted, seed)
    weights, leverage = export(fits, fitted)
    card = {
        "schema": STRUCTURE_SCHEMA,
        "name": origin.name,
        "source": origin.sentence,
        "limits": LIMITS,
        "inputs": [column.replace("_m_s", "_m_per_s") for column in INPUTS],
        "range": {name: [low, high] for name, low, high in zip(INPUTS, *_box(fitted), strict=True)},
        "components": list(COMPONENTS),
        "samples": {
            "count": len(fitted.ids),
            "dropped": dropped,
            "largest_leverage": leverage,
            "sha256": origin.sha256,
            "dataset": origin.card,
        },
        "seed": seed,
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
        "calibration_to_published": dict.fromkeys(COMPONENTS, 1.0),
    }
    base = structural_inputs(np.array(BASELINE))
    ours = parse_trained(json.dumps(card), weights)(base).mass
    published = load_structural_mass("published")(base).mass
    # Level of the published tables over ours at one point: stands for joints, cut-outs, fittings; never applied unasked.
    card["calibration_to_published"] = dict(zip(COMPONENTS, (published / ours).tolist(), strict=True))
    card["baseline_mass_kg"] = dict(zip(COMPONENTS, ours.tolist(), strict=True))
    surrogate = parse_trained(json.dumps(card), weights)
    card["quality"] = {f"{fit.component}.{fit.target}": fit.quality() for fit in fits.values()}
    for part in ("test", "axis"):
        if (unseen := usable.named(part)).ids:
            card[f"errors_on_{part}"] = _errors(surrogate, unseen)
    if (replica := usable.named("replica")).ids:
        card["replica"] = replica_table(replica, seed)
    return Trained(card, weights, surrogate, fits)


def write(trained: Trained, output: Path) -> Path:
    """Write structural_mass_NAME.safetensors and its card beside it, both or neither; returns the path of the card."""
    stem = output / f"structural_mass_{trained.card['name']}"
    file = stem.with_suffix(".json")
    card = (json.dumps(trained.card, indent=1, allow_nan=False) + "\n").encode()
    output.mkdir(parents=True, exist_ok=True)
    write_together({stem.with_suffix(".safetensors"): trained.weights, file: card})
    return file


def _box(samples: Samples) -> tuple[list[float], list[float]]:
    return samples.inputs.min(0).tolist(), samples.inputs.max(0).tolist()


def _errors(surrogate: StructuralMassSurrogate, samples: Samples) -> dict[str, dict[str, float]]:
    """Of the component masses on samples that were not fitted; coverage: share within the 95 % prediction interval."""
    inputs = structural_inputs(samples.inputs)
    masses, width = surrogate(inputs).mass.numpy(), surrogate.prediction_interval(inputs).numpy()
    table = {}
    for i, name in enumerate(COMPONENTS):
        error = np.abs(masses[:, i] - samples.targets[:, i, 0])
        table[name] = {
            "rms_kg": float(np.sqrt((error**2).mean())),
            "largest_kg": float(error.max()),
            "largest_relative": float((error / samples.targets[:, i, 0]).max()),
            "coverage": float((error <= width[:, i]).mean()),
        }
    return table


def replica_table(samples: Samples, seed: int) -> dict[str, dict[str, Any]]:
    """Linear fits on the replica set, by group of the published tables and tail: what the published study would report.

    Elasticities are those of the fit at the published baseline, with their standard errors; mass in kg there.
    """
    base, groups = np.array(BASELINE), GROUPS | {name: (name,) for name in ("horizontal_tail", "vertical_tail")}
    table = {}
    for group, members in groups.items():
        mass = samples.targets[:, [COMPONENTS.index(name) for name in members], QUANTITIES.index("mass_kg")].sum(1)
        slopes, errors, intercept, r2 = linear_slopes(samples.inputs, mass, seed)
        value = intercept + float(slopes @ base)
        table[group] = {
            "r2_cross_validated": r2,
            "baseline_kg": value,
            "slopes_si": dict(zip(INPUTS, slopes.tolist(), strict=True)),
            "elasticities": dict(zip(INPUTS, (slopes * base / value).tolist(), strict=True)),
            "elasticity_standard_errors": dict(zip(INPUTS, (errors * base / value).tolist(), strict=True)),
        }
        published = [fit for fit in PUBLISHED_FITS if fit.group == group]
        if published:
            table[group]["published_elasticities"] = {
                str(fit.year): dict(zip(ELASTICITY_INPUTS, fit.elasticities, strict=True)) for fit in published
            }
    return table
