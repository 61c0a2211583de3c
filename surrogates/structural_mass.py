"""Structural mass, centre of gravity and inertia by component, as a linear surrogate of sized structures."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources

import torch
from torch import Tensor

TARGETS = ("mass_kg", "cg_x_m", "cg_y_m", "cg_z_m", "ixx_kg_m2", "iyy_kg_m2", "izz_kg_m2", "ixz_kg_m2")


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
class StructuralMassSurrogate:
    """coefficients (input + 1, component, target); lower, upper (input,): the box of the training samples."""

    name: str
    source: str
    components: tuple[str, ...]
    input_names: tuple[str, ...]
    coefficients: Tensor
    lower: Tensor
    upper: Tensor
    sample_count: int
    sha256: str

    def __call__(self, inputs: StructuralInputs) -> ComponentMasses:
        """Evaluate all components; linear, hence also defined outside the training box (see `leverage`)."""
        x = inputs.stacked()
        ones = torch.ones_like(x[..., :1])
        values = torch.tensordot(torch.cat([x, ones], dim=-1), self.coefficients, dims=1)
        mass, cg = values[..., 0], values[..., 1:4]
        ixx, iyy, izz, ixz = values[..., 4:].unbind(-1)
        zero = torch.zeros_like(ixx)
        rows = [ixx, zero, -ixz, zero, iyy, zero, -ixz, zero, izz]
        inertia = torch.stack(rows, dim=-1).unflatten(-1, (3, 3))
        return ComponentMasses(self.components, mass, cg, inertia)

    def outside(self, inputs: StructuralInputs) -> dict[str, float]:
        """Inputs outside the training box, with their distance in box half-widths from its centre (1 = its edge)."""
        x = inputs.stacked().detach()
        distance = ((x - 0.5 * (self.lower + self.upper)) / (0.5 * (self.upper - self.lower))).abs()
        return {n: float(d) for n, d in zip(self.input_names, distance, strict=True) if d > 1.0 + 1e-9}

    def leverage(self, inputs: StructuralInputs) -> Tensor:
        """Leverage (...,) of the query for a uniform design over the box: 1/n + sum z^2/n.

        The published samples are not public; the variance of a uniform design, (upper - lower)^2/12, stands for
        theirs. The corner of the box has 1/n + 3 k/n for k inputs.
        """
        x = inputs.stacked()
        standard = (x - 0.5 * (self.lower + self.upper)) / ((self.upper - self.lower) / 12**0.5)
        return (1.0 + (standard**2).sum(-1)) / self.sample_count


def _parse(text: str, digest: str) -> StructuralMassSurrogate:
    card: Mapping = json.loads(text)
    if card.get("schema") != "lpc-mdo/structural-mass/1":
        raise ValueError(f"schema = {card.get('schema')!r} is not allowed; it must be 'lpc-mdo/structural-mass/1'")
    inputs, components = card["inputs"], card["components"]
    zeros = [0.0] * (len(inputs) + 1)
    rows = [[components[name].get(target, zeros) for target in TARGETS] for name in components]
    return StructuralMassSurrogate(
        name=card["name"],
        source=card["source"],
        components=tuple(components),
        input_names=tuple(entry["name"] for entry in inputs),
        coefficients=torch.tensor(rows, dtype=torch.float64).permute(2, 0, 1).contiguous(),
        lower=torch.tensor([entry["lower"] for entry in inputs], dtype=torch.float64),
        upper=torch.tensor([entry["upper"] for entry in inputs], dtype=torch.float64),
        sample_count=card["samples"]["count"],
        sha256=digest,
    )


@cache
def load_structural_mass(source: str = "published") -> StructuralMassSurrogate:
    """The shipped surrogate of that name. Raises ValueError if there is none or its file is malformed."""
    file = resources.files("surrogates.weights").joinpath(f"structural_mass_{source}.json")
    if not file.is_file():
        raise ValueError(f"structure.source = {source!r} is not allowed; no such surrogate is shipped")
    data = file.read_bytes()
    try:
        return _parse(data.decode(), hashlib.sha256(data).hexdigest())
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"structural_mass_{source}.json is malformed: {error}") from None
