"""Regressions of structural mass, centre of gravity and inertia by component, with their errors and where they hold."""

import warnings
from dataclasses import dataclass, fields
from typing import Literal, get_args

import torch
from torch import Tensor

TARGETS = ("mass_kg", "cg_x_m", "cg_y_m", "cg_z_m", "ixx_kg_m2", "iyy_kg_m2", "izz_kg_m2", "ixz_kg_m2")
Policy = Literal["flag", "warn", "error", "penalty"]


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
    """y = intercept + coefficients . monomials of z, or a power law: sign times exp of the same in standardized logarithms.

    mean, scale (2, input): of the inputs and of their logarithms, z = (x - mean)/scale; powers (monomial, input);
    coefficients (monomial, component, target); intercept, power_law_sign (component, target), the latter 0 for
    polynomials and else the sign of y. Power laws use the first monomials, which must be the inputs one by one.
    """

    mean: Tensor
    scale: Tensor
    powers: Tensor
    coefficients: Tensor
    intercept: Tensor
    power_law_sign: Tensor

    def monomials(self, x: Tensor) -> Tensor:
        """(..., monomial) of the standardized inputs."""
        z = (x - self.mean[0]) / self.scale[0]
        return torch.where(self.powers > 0, z[..., None, :] ** self.powers, 1.0).prod(-1)

    def logarithms(self, x: Tensor) -> Tensor:
        """(..., input) standardized."""
        return (torch.log(x) - self.mean[1]) / self.scale[1]

    def __call__(self, x: Tensor) -> Tensor:
        """(..., component, target) for inputs x (..., input)."""
        plain = torch.tensordot(self.monomials(x), self.coefficients, dims=1) + self.intercept
        is_power_law = self.power_law_sign != 0.0
        if not bool(is_power_law.any()):
            found: Tensor = plain
            return found
        exponent = torch.tensordot(self.logarithms(x), self.coefficients[: x.shape[-1]], dims=1) + self.intercept
        # Both branches stay finite, so that no derivative of the one not taken spoils the other.
        power = self.power_law_sign * torch.exp(torch.where(is_power_law, exponent, 0.0))
        return torch.where(is_power_law, power, plain)


@dataclass(frozen=True)
class MassIntervals:
    """Errors of the component masses. inverse_gram (component, 1 + monomial, 1 + monomial): of the terms that each mass
    uses, zero elsewhere; deviation (component,): residual standard deviation in kg, of the logarithm for power laws;
    student (component,): t(0.975, n - p); cross_validated (component,) kg: half-width that held 95 % of the samples when
    they were predicted from others."""

    inverse_gram: Tensor
    deviation: Tensor
    student: Tensor
    cross_validated: Tensor

    def half_width(self, model: Polynomials, x: Tensor) -> Tensor:
        """(..., component) kg of the 95 % prediction interval, t s sqrt(1 + h).

        What a smooth model leaves is lack of fit, not chance: see also `cross_validated`.
        """
        monomials, logarithms = model.monomials(x), model.logarithms(x)
        logarithms = torch.nn.functional.pad(logarithms, (0, monomials.shape[-1] - logarithms.shape[-1]))
        is_power_law = model.power_law_sign[:, 0] != 0.0
        terms = torch.where(is_power_law[:, None], logarithms[..., None, :], monomials[..., None, :])
        terms = torch.nn.functional.pad(terms, (1, 0), value=1.0)
        leverage = torch.einsum("...ci,cij,...cj->...c", terms, self.inverse_gram, terms)
        width = self.student * self.deviation * torch.sqrt(1.0 + leverage)
        return torch.where(is_power_law, width * model(x)[..., 0], width)


@dataclass(frozen=True)
class StructuralMassSurrogate:
    """model: inputs to (..., component, target); lower, upper (input,): the box of the training samples; their mean and
    standard deviation (input,), the inverse (input, input) of the sum of their standardized products, and the largest
    leverage among them; intervals: None where the samples are not public; calibration (component,): what lifts each mass to
    the published level at the published baseline, applied only on request."""

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
    intervals: MassIntervals | None
    calibration: Tensor
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

    def prediction_interval(self, inputs: StructuralInputs) -> Tensor:
        """Half-width (..., component) kg of the 95 % prediction interval of the masses; NaN if the samples are not public."""
        x = inputs.stacked()
        if self.intervals is None:
            return torch.full((*x.shape[:-1], len(self.components)), float("nan"), dtype=x.dtype)
        return self.intervals.half_width(self.model, x)

    def guarded(self, inputs: StructuralInputs, policy: Policy = "error") -> ComponentMasses:
        """Evaluate one query or a batch, heeding the training range.

        "flag" only evaluates: `outside` and `leverage` tell. "error" raises ValueError and "warn" warns where an input leaves the box or the leverage exceeds the largest of
        the samples; "penalty" multiplies masses by 1 + sum of (|distance| - 1)^3 over the inputs outside, which has two
        continuous derivatives, so that an optimizer turns back. Raises ValueError for another policy.
        """
        if policy not in get_args(Policy):
            raise ValueError(f"policy = {policy!r} is not allowed; it must be one of {', '.join(get_args(Policy))}")
        values = self(inputs)
        if policy == "flag":
            return values
        distance = self.distance(inputs)
        if policy == "penalty":
            beyond = (distance.abs() - 1.0).clamp(min=0.0)
            mass = values.mass * (1.0 + (beyond**3).sum(-1, keepdim=True))
            return ComponentMasses(values.names, mass, values.center_of_gravity, values.inertia)
        if fault := self._fault(inputs, distance.detach()):
            if policy == "error":
                raise ValueError(fault)
            # Always the same words, so that Python shows them once.
            words = f"structural mass of source {self.name!r} is asked outside its samples; the result says by how much"
            warnings.warn(words, RuntimeWarning, stacklevel=2)
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
