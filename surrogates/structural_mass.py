"""Structural mass, centre of gravity and inertia by component, as regressions of sized structures: files and loading.

Sources, never mixed: "published", the linear tables of the study's authors; "open", our own sizing (docs/structures.md);
"nastran", what a user trains on tables or runs of their own.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError
from safetensors.torch import load
from torch import Tensor

from lpc_mdo.files.faults import shortened
from lpc_mdo.files.read import is_there, parse_json, read_packaged
from lpc_mdo.surrogates.cards import StructuralCard, read_card
from lpc_mdo.surrogates.structural_regression import (
    TARGETS,
    ComponentMasses,
    MassIntervals,
    Policy,
    Polynomials,
    StructuralInputs,
    StructuralMassSurrogate,
)

__all__ = [
    "COMPONENTS",
    "TARGETS",
    "ComponentMasses",
    "Policy",
    "StructuralInputs",
    "StructuralMassSurrogate",
    "load_structural_mass",
    "parse_trained",
]

COMPONENTS = (
    "wing",
    "fuselage",
    "boom_inner_port",
    "boom_outer_port",
    "boom_inner_starboard",
    "boom_outer_starboard",
    "horizontal_tail",
    "vertical_tail",
)
INPUTS = (  # in the order of StructuralInputs, as cards name them
    "wing_area_m2",
    "wing_aspect_ratio",
    "fuselage_length_m",
    "battery_mass_kg",
    "cruise_speed_m_per_s",
    "htail_area_m2",
    "vtail_area_m2",
)
TABLE_SCHEMA = "lpc-mdo/structural-mass/1"
HIGHEST_POWER = 2
LARGEST_FILE = 10_000_000  # bytes, of a card or of weights


def _parse_table(text: str, digest: str) -> StructuralMassSurrogate:
    """A surrogate from linear coefficients alone."""
    card: Mapping[str, Any] = parse_json(text, "the card")
    if card.get("schema") != TABLE_SCHEMA:
        raise ValueError(f"schema = {card.get('schema')!r} is not allowed; it must be {TABLE_SCHEMA!r}")
    inputs, components = card["inputs"], card["components"]
    zeros = [0.0] * (len(inputs) + 1)
    rows = [[components[name].get(target, zeros) for target in TARGETS] for name in components]
    coefficients = torch.tensor(rows, dtype=torch.float64).permute(2, 0, 1).contiguous()
    lower, upper = (torch.tensor([e[end] for e in inputs], dtype=torch.float64) for end in ("lower", "upper"))
    count, samples = len(inputs), card["samples"]["count"]
    identity = torch.eye(count, dtype=torch.float64)
    model = Polynomials(
        mean=torch.zeros(2, count, dtype=torch.float64),
        scale=torch.ones(2, count, dtype=torch.float64),
        powers=identity,
        coefficients=coefficients[:-1],
        intercept=coefficients[-1],
        power_law_sign=torch.zeros(coefficients.shape[1:], dtype=torch.float64),
    )
    return StructuralMassSurrogate(
        name=card["name"],
        source=card["source"],
        components=tuple(components),
        input_names=tuple(entry["name"] for entry in inputs),
        model=model,
        lower=lower,
        upper=upper,
        mean=0.5 * (lower + upper),
        deviation=(upper - lower) / 12**0.5,
        inverse_gram=identity / samples,
        largest_leverage=float("inf"),
        intervals=None,
        calibration=torch.ones(len(components), dtype=torch.float64),
        sample_count=samples,
        sha256=digest,
    )


def _checked(tensors: dict[str, Tensor], inputs: int, components: int) -> None:
    """Raises ValueError unless all tensors are there, float64, finite, of the right shape, and make sense."""
    monomials = len(tensors["powers"])
    shapes = {
        "mean": (2, inputs),
        "scale": (2, inputs),
        "powers": (monomials, inputs),
        "coefficients": (monomials, components, len(TARGETS)),
        "intercept": (components, len(TARGETS)),
        "power_law_sign": (components, len(TARGETS)),
        "lower": (inputs,),
        "upper": (inputs,),
        "sample_mean": (inputs,),
        "sample_deviation": (inputs,),
        "sample_inverse_gram": (inputs, inputs),
        "interval_inverse_gram": (components, 1 + monomials, 1 + monomials),
        "interval_deviation": (components,),
        "interval_student": (components,),
        "interval_cross_validated": (components,),
    }
    if tensors.keys() != shapes.keys():
        raise ValueError(f"tensors {sorted(tensors)} are not allowed; they must be {sorted(shapes)}")
    for name, shape in shapes.items():
        tensor = tensors[name]
        if tensor.dtype != torch.float64 or tuple(tensor.shape) != shape:
            raise ValueError(
                f"{name} of {tensor.dtype} {tuple(tensor.shape)} is not allowed; it must be float64 {shape}"
            )
        if not bool(tensor.isfinite().all()):
            raise ValueError(f"{name} is not allowed; it must be finite")
    if not bool((tensors["scale"] > 0.0).all() and (tensors["sample_deviation"] > 0.0).all()):
        raise ValueError("scale is not allowed; it must be positive")
    if not bool((tensors["lower"] < tensors["upper"]).all()):
        raise ValueError("lower is not allowed; it must be below upper")
    powers = tensors["powers"]
    if not bool(((powers >= 0.0) & (powers <= HIGHEST_POWER) & (powers == powers.round())).all()):
        raise ValueError(f"powers are not allowed; they must be whole and between 0 and {HIGHEST_POWER}")
    if not torch.equal(powers[:inputs], torch.eye(inputs, dtype=powers.dtype)):
        raise ValueError("powers are not allowed; they must begin with the inputs one by one")
    if not bool(torch.isin(tensors["power_law_sign"], torch.tensor([-1.0, 0.0, 1.0], dtype=powers.dtype)).all()):
        raise ValueError("power_law_sign is not allowed; it must be -1, 0 or 1")


def parse_trained(card_text: str, data: bytes) -> StructuralMassSurrogate:
    """A surrogate from its card (JSON) and weights (safetensors). Raises ValueError if they are damaged or disagree."""
    card, _ = read_card(StructuralCard, card_text, data)
    for key, names in (("components", COMPONENTS), ("inputs", INPUTS)):
        if (found := getattr(card, key)) != names:
            raise ValueError(f"{key} = {shortened(list(found))} is invalid: it must be {list(names)}")
    if missing := [name for name in COMPONENTS if name not in card.calibration_to_published]:
        raise ValueError(f"calibration_to_published.{missing[0]} is missing")
    try:
        tensors = load(data)
    except SafetensorError as error:
        raise ValueError(f"its weights cannot be read: {error}") from None
    _checked(tensors, len(INPUTS), len(COMPONENTS))
    factors = [card.calibration_to_published[name] for name in COMPONENTS]
    return StructuralMassSurrogate(
        name=card.name,
        source=card.source,
        components=COMPONENTS,
        input_names=INPUTS,
        model=Polynomials(**{f.name: tensors[f.name] for f in fields(Polynomials)}),
        lower=tensors["lower"],
        upper=tensors["upper"],
        mean=tensors["sample_mean"],
        deviation=tensors["sample_deviation"],
        inverse_gram=tensors["sample_inverse_gram"],
        largest_leverage=card.samples.largest_leverage,
        intervals=MassIntervals(**{f.name: tensors[f"interval_{f.name}"] for f in fields(MassIntervals)}),
        calibration=torch.tensor(factors, dtype=torch.float64),
        sample_count=card.samples.count,
        sha256=card.weights_sha256,
    )


@cache
def load_structural_mass(source: str = "published", card: str | None = None) -> StructuralMassSurrogate:
    """The surrogate of that name: a shipped one, or the one whose card is at path `card`, with its weights beside it.

    Raises ValueError if there is none, its files are damaged, or the card is of another source.
    """
    if card is None:
        file = resources.files("lpc_mdo.surrogates.weights").joinpath(f"structural_mass_{source}.json")
        weights = resources.files("lpc_mdo.surrogates.weights").joinpath(f"structural_mass_{source}.safetensors")
        if not file.is_file():
            raise ValueError(f"structure.source = {source!r} is not allowed; no such surrogate is shipped")
    else:
        file, weights = Path(card), Path(card).with_suffix(".safetensors")
        for needed in (file, weights):
            if not (is_there(needed) and needed.is_file()):
                raise ValueError(
                    f"structure.surrogate_file = {shortened(card)} is not allowed; there is no file {shortened(str(needed))}"
                )
    data = read_packaged(file, LARGEST_FILE)
    try:
        if weights.is_file():
            found = parse_trained(data.decode(), read_packaged(weights, LARGEST_FILE))
        else:
            found = _parse_table(data.decode(), hashlib.sha256(data).hexdigest())
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{file.name} is malformed: {error}") from None
    if found.name != source:
        raise ValueError(f"structure.source = {source!r} is not allowed; {file.name} is of source {found.name!r}")
    return found
