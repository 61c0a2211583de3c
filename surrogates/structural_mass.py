"""Structural mass, centre of gravity and inertia by component, as regressions of sized structures.

Sources, never mixed: "published", the linear tables of the study's authors; "open", our own sizing (docs/structures.md);
and what a user trains and loads with `parse_trained`.
"""

import hashlib
import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources
from typing import Literal

import torch
from safetensors import SafetensorError
from safetensors.torch import load
from torch import Tensor

TARGETS = ("mass_kg", "cg_x_m", "cg_y_m", "cg_z_m", "ixx_kg_m2", "iyy_kg_m2", "izz_kg_m2", "ixz_kg_m2")
Policy = Literal["error", "warn", "penalty"]


@dataclass(frozen=True)
class StructuralInputs:
    """Inputs of the regressions, each (...,): m^2, 1, m, kg, m/s, m^2, m^2."""

    wing_area: Tensor
    wing_aspect_ratio: Tensor
    fuselage_length: Tensor
    battery_mass: Tensor
    cruise_speed: Tensor
    horizontal_tail_area: Tensor
    vertical_tail_area: Tensor

    def stacked(self) -> Tensor:
        values = [torch.as_tensor(getattr(self, f.name), dtype=torch.float64) for f in fields(self)]
        return torch.stack(torch.broadcast_tensors(*values), dim=-1)


@dataclass(frozen=True)
class ComponentMasses:
    """mass (..., component) kg, center_of_gravity (..., component, 3) m in geometry axes, inertia
    (..., component, 3, 3) kg m^2 about each component's own centre of gravity."""

    names: tuple[str, ...]
    mass: Tensor
    center_of_gravity: Tensor
    inertia: Tensor


@dataclass(frozen=True)
class Polynomials:
    """y = intercept + coefficients . monomials of z, or exp of the same in standardized logarithms.

    mean, scale (2, input): of the inputs and of their logarithms, z = (x - mean)/scale; powers (monomial, input);
    coefficients (monomial, component, target); intercept, is_power_law (component, target). Power laws use the first
    monomials, which must be the inputs one by one.
    """

    mean: Tensor
    scale: Tensor
    powers: Tensor
    coefficients: Tensor
    intercept: Tensor
    is_power_law: Tensor

    def __call__(self, x: Tensor) -> Tensor:
        """(..., component, target) for inputs x (..., input)."""
        count = x.shape[-1]
        z = (x - self.mean[0]) / self.scale[0]
        monomials = torch.where(self.powers > 0, z[..., None, :] ** self.powers, 1.0).prod(-1)
        plain = torch.tensordot(monomials, self.coefficients, dims=1) + self.intercept
        if not bool(self.is_power_law.any()):
            return plain
        logarithms = (torch.log(x) - self.mean[1]) / self.scale[1]
        exponent = torch.tensordot(logarithms, self.coefficients[:count], dims=1) + self.intercept
        # Both branches stay finite, so that no derivative of the one not taken spoils the other.
        return torch.where(self.is_power_law, torch.exp(torch.where(self.is_power_law, exponent, 0.0)), plain)


@dataclass(frozen=True)
class StructuralMassSurrogate:
    """model: inputs to (..., component, target); lower, upper (input,): the box of the training samples; their mean and
    standard deviation (input,), the inverse (input, input) of the sum of their standardized products, and the largest
    leverage among them; mass_interval (component,) kg: half-width that held 95 % of the samples in cross-validation, NaN
    where the samples are not public."""

    name: str
    source: str
    components: tuple[str, ...]
    input_names: tuple[str, ...]
    model: Polynomials
    lower: Tensor
    upper: Tensor
    mean: Tensor
    deviation: Tensor
    inverse_gram: Tensor
    largest_leverage: float
    mass_interval: Tensor
    sample_count: int
    sha256: str

    def __call__(self, inputs: StructuralInputs) -> ComponentMasses:
        """Evaluate all components; also defined outside the training box, where nothing vouches for it (see `guarded`)."""
        values = self.model(inputs.stacked())
        mass, cg = values[..., 0], values[..., 1:4]
        ixx, iyy, izz, ixz = values[..., 4:].unbind(-1)
        zero = torch.zeros_like(ixx)
        rows = [ixx, zero, -ixz, zero, iyy, zero, -ixz, zero, izz]
        inertia = torch.stack(rows, dim=-1).unflatten(-1, (3, 3))
        return ComponentMasses(self.components, mass, cg, inertia)

    def distance(self, inputs: StructuralInputs) -> Tensor:
        """(..., input) from the centre of the training box in its half-widths, signed: beyond +-1 lies outside."""
        return (inputs.stacked() - 0.5 * (self.lower + self.upper)) / (0.5 * (self.upper - self.lower))

    def outside(self, inputs: StructuralInputs) -> dict[str, float]:
        """Inputs outside the training box, with their distance in box half-widths from its centre (1 = its edge)."""
        distance = self.distance(inputs).detach().abs()
        return {n: float(d) for n, d in zip(self.input_names, distance, strict=True) if d > 1.0 + 1e-9}

    def leverage(self, inputs: StructuralInputs) -> Tensor:
        """Leverage (...,) of the query in the linear basis: 1/n + z (Z'Z)^-1 z.

        The published samples are not public; a uniform design over their box stands for them: 1/n + sum z^2/n with the
        variance (upper - lower)^2/12; its corner has 1/n + 3 k/n for k inputs.
        """
        z = (inputs.stacked() - self.mean) / self.deviation
        return 1.0 / self.sample_count + torch.einsum("...i,ij,...j->...", z, self.inverse_gram, z)

    def guarded(self, inputs: StructuralInputs, policy: Policy = "error") -> ComponentMasses:
        """Evaluate one query or a batch, heeding the training range.

        "error" raises ValueError and "warn" warns where an input leaves the box or the leverage exceeds the largest of
        the samples; "penalty" multiplies masses by 1 + sum of (|distance| - 1)^3 over the inputs outside, which has two
        continuous derivatives, so that an optimizer turns back. Raises ValueError for another policy.
        """
        if policy not in ("error", "warn", "penalty"):
            raise ValueError(f"policy = {policy!r} is not allowed; it must be one of error, warn, penalty")
        values = self(inputs)
        distance = self.distance(inputs)
        if policy == "penalty":
            beyond = (distance.abs() - 1.0).clamp(min=0.0)
            mass = values.mass * (1.0 + (beyond**3).sum(-1, keepdim=True))
            return ComponentMasses(values.names, mass, values.center_of_gravity, values.inertia)
        if fault := self._fault(inputs, distance.detach()):
            if policy == "error":
                raise ValueError(fault)
            warnings.warn(fault, RuntimeWarning, stacklevel=2)
        return values

    def _fault(self, inputs: StructuralInputs, distance: Tensor) -> str:
        """What is wrong with the worst query, in a sentence; empty if nothing is."""
        worst = distance.abs().reshape(-1, len(self.input_names)).amax(0)
        k = int(worst.argmax())
        if worst[k] > 1.0 + 1e-9:
            values = inputs.stacked().detach().reshape(-1, len(self.input_names))[:, k]
            value = float(values[distance.reshape(-1, len(self.input_names))[:, k].abs().argmax()])
            lower, upper = float(self.lower[k]), float(self.upper[k])
            return (
                f"{self.input_names[k]} = {value:g} is not allowed; the structural samples of source {self.name!r} lie "
                f"between {lower:g} and {upper:g}"
            )
        leverage = float(self.leverage(inputs).detach().max())
        if leverage > self.largest_leverage:
            return (
                f"leverage = {leverage:.3g} is not allowed; the structural samples of source {self.name!r} reach "
                f"{self.largest_leverage:.3g}: the inputs are each in range but not together"
            )
        return ""


def _parse_table(text: str, digest: str) -> StructuralMassSurrogate:
    """A surrogate from linear coefficients alone."""
    card: Mapping = json.loads(text)
    if card.get("schema") != "lpc-mdo/structural-mass/1":
        raise ValueError(f"schema = {card.get('schema')!r} is not allowed; it must be 'lpc-mdo/structural-mass/1'")
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
        is_power_law=torch.zeros(coefficients.shape[1:], dtype=torch.bool),
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
        mass_interval=torch.full((len(components),), float("nan"), dtype=torch.float64),
        sample_count=samples,
        sha256=digest,
    )


def parse_trained(card_text: str, data: bytes) -> StructuralMassSurrogate:
    """A surrogate from its card (JSON) and weights (safetensors). Raises ValueError if they are damaged or disagree."""
    try:
        card = json.loads(card_text)
        digest = hashlib.sha256(data).hexdigest()
        if card["schema"] != "lpc-mdo/structural-mass/2":
            raise ValueError(f"schema = {card['schema']!r} is not allowed; it must be 'lpc-mdo/structural-mass/2'")
        if digest != card["weights_sha256"]:
            raise ValueError(f"sha256 of the weights is {digest}, the card says {card['weights_sha256']}")
        tensors = load(data)
        model = Polynomials(**{f.name: tensors[f.name] for f in fields(Polynomials)})
        counts = len(card["components"]), len(TARGETS)
        if model.coefficients.shape != (len(model.powers), *counts):
            raise ValueError(f"coefficients of shape {tuple(model.coefficients.shape)} are not allowed")
        if not all(bool(t.isfinite().all()) for t in tensors.values()):
            raise ValueError("weights that are not finite are not allowed")
        names = ("lower", "upper", "sample_mean", "sample_deviation", "inverse_gram", "mass_interval")
        box = {name.removeprefix("sample_"): tensors[name] for name in names}
        return StructuralMassSurrogate(
            name=card["name"],
            source=card["source"],
            components=tuple(card["components"]),
            input_names=tuple(card["inputs"]),
            model=model,
            largest_leverage=card["samples"]["largest_leverage"],
            sample_count=card["samples"]["count"],
            sha256=digest,
            **box,
        )
    except (KeyError, TypeError, json.JSONDecodeError, SafetensorError) as error:
        raise ValueError(f"structural mass surrogate is damaged: {error!r}") from None


@cache
def load_structural_mass(source: str = "published") -> StructuralMassSurrogate:
    """The shipped surrogate of that name. Raises ValueError if there is none or its files are damaged."""
    folder = resources.files("surrogates.weights")
    file, weights = (folder.joinpath(f"structural_mass_{source}.{ending}") for ending in ("json", "safetensors"))
    if not file.is_file():
        raise ValueError(f"structure.source = {source!r} is not allowed; no such surrogate is shipped")
    data = file.read_bytes()
    try:
        if weights.is_file():
            return parse_trained(data.decode(), weights.read_bytes())
        return _parse_table(data.decode(), hashlib.sha256(data).hexdigest())
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"structural_mass_{source}.json is malformed: {error}") from None
