"""Section lift and drag over angle of attack, Reynolds and Mach number: a small network trained on XFOIL polars.

Attached and stalling flow come from the network; beyond, a stalled flat plate takes over through a step with two
continuous derivatives, so that the polar is defined, smooth and periodic for every angle.
"""

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import torch
from safetensors import SafetensorError
from safetensors.torch import load
from torch import Tensor

from lpc_mdo.numerics.smooth import smooth_step

NORMAL_FORCE_AT_90 = 1.98  # two-dimensional plate across the flow, Lindenburg, ECN-C-03-025 (2003)
STALLED_FRICTION = 0.02  # drag along the chord of a stalled section, ASSUMED: twice the attached drag
CLAMP_WIDTH = 0.05  # in the scaled inputs, over which a query is led back to the training range


@dataclass(frozen=True)
class TrainingRange:
    """Where the polars that the network has seen lie: degrees, and numbers."""

    alpha_deg: tuple[float, float]
    reynolds: tuple[float, float]
    mach: tuple[float, float]


@dataclass(frozen=True)
class AirfoilPolar:
    """Callable polar of one section.

    weights: pairs (matrix (out, in), bias (out,)) of the layers; blend_deg: the angles (deg) between which the flat plate
    takes over, (full plate, pure network, pure network, full plate).
    """

    name: str
    weights: tuple[tuple[Tensor, Tensor], ...]
    training_range: TrainingRange
    blend_deg: tuple[float, float, float, float]
    sha256: str
    card: Mapping

    def __call__(self, alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        """Lift and drag coefficient (...,) at alpha (...,) rad (any angle), reynolds (...,) > 0, mach (...,) >= 0.

        Outside the training range the network's inputs are held at its edge, smoothly; `extrapolated` tells where.
        """
        # Wrap to (-pi, pi]; sine and cosine of the angle serve the plate.
        sin, cos = torch.sin(alpha), torch.cos(alpha)
        wrapped = torch.atan2(sin, cos)
        low_full, low_none, high_none, high_full = (math.radians(angle) for angle in self.blend_deg)
        cl_net, cd_net = self.network(wrapped, reynolds, mach)
        share = smooth_step((wrapped - high_none) / (high_full - high_none)) + smooth_step(
            (wrapped - low_none) / (low_full - low_none)
        )
        cl_plate, cd_plate = stalled_plate(sin, cos)
        return cl_net + share * (cl_plate - cl_net), cd_net + share * (cd_plate - cd_net)

    def network(self, alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        """The trained part alone, every input held at the edge of the training range outside it."""
        x = scaled_inputs(alpha, reynolds, mach, self.training_range)
        return network_outputs(x, self.weights)

    def extrapolated(self, alpha: Tensor, reynolds: Tensor, mach: Tensor) -> Tensor:
        """(...,) bool: the query lies outside the polars that the network was trained on."""
        limits = self.training_range
        degrees = torch.rad2deg(alpha)
        inside = (degrees >= limits.alpha_deg[0]) & (degrees <= limits.alpha_deg[1])
        inside = inside & (reynolds >= limits.reynolds[0]) & (reynolds <= limits.reynolds[1])
        return ~(inside & (mach <= limits.mach[1]))

    def maximum_lift_coefficient(self, reynolds: Tensor, mach: Tensor) -> Tensor:
        """Section maximum lift (...,): the mean over 6 to 19 degrees weighted by exp(200 cl), smooth in both arguments."""
        alpha = torch.deg2rad(torch.linspace(6.0, 19.0, 53, dtype=torch.float64))
        cl, _ = self.network(alpha, reynolds[..., None], mach[..., None])
        return (torch.softmax(200.0 * cl, dim=-1) * cl).sum(-1)


def stalled_plate(sin: Tensor, cos: Tensor) -> tuple[Tensor, Tensor]:
    """Lift and drag coefficient of a stalled plate from sine and cosine of its angle.

    Normal force c90 sin a/(0.56 + 0.44 |sin a|) for an infinite aspect ratio. Source: Lindenburg, ECN-C-03-025 (2003),
    after Hoerner, Fluid-Dynamic Drag (1965).
    """
    size = torch.sqrt(sin**2 + 1e-4)
    normal = NORMAL_FORCE_AT_90 * sin / (0.56 + 0.44 * size)
    return normal * cos, normal * sin + STALLED_FRICTION * cos**2


def _soft_clamp(x: Tensor) -> Tensor:
    """x held within [-1, 1], smoothly; monotone and infinitely often differentiable."""
    below = -1.0 + CLAMP_WIDTH * torch.nn.functional.softplus((x + 1.0) / CLAMP_WIDTH)
    return 1.0 - CLAMP_WIDTH * torch.nn.functional.softplus((1.0 - below) / CLAMP_WIDTH)


def scaled_inputs(alpha: Tensor, reynolds: Tensor, mach: Tensor, limits: TrainingRange) -> Tensor:
    """Network inputs (..., 3): angle, logarithm of the Reynolds number and Mach number, each held within [-1, 1]."""

    def scaled(value: Tensor, ends: Sequence[float]) -> Tensor:
        return (value - 0.5 * (ends[0] + ends[1])) / (0.5 * (ends[1] - ends[0]))

    angle = _soft_clamp(scaled(alpha, [math.radians(a) for a in limits.alpha_deg]))
    size = _soft_clamp(scaled(torch.log(reynolds.clamp(min=1.0)), [math.log(r) for r in limits.reynolds]))
    speed = _soft_clamp(scaled(mach, limits.mach))
    return torch.stack(torch.broadcast_tensors(angle, size, speed), dim=-1)


def network_outputs(x: Tensor, weights: Sequence[tuple[Tensor, Tensor]]) -> tuple[Tensor, Tensor]:
    """Lift and drag coefficient from scaled inputs; the last layer gives cl and log(cd)."""
    for matrix, bias in weights[:-1]:
        x = torch.tanh(torch.nn.functional.linear(x, matrix, bias))
    cl, log_cd = torch.nn.functional.linear(x, *weights[-1]).unbind(-1)
    return cl, torch.exp(log_cd)


@cache
def load_airfoil(name: str = "naca4412") -> AirfoilPolar:
    """A shipped polar. Raises ValueError if there is none of that name or its files are damaged."""
    folder = resources.files("surrogates.weights")
    card_file, weight_file = folder.joinpath(f"{name}.json"), folder.joinpath(f"{name}.safetensors")
    if not (card_file.is_file() and weight_file.is_file()):
        raise ValueError(f"airfoil = {name!r} is not allowed; no such surrogate is shipped")
    return parse_airfoil(card_file.read_text(encoding="utf-8"), weight_file.read_bytes())


def parse_airfoil(card_text: str, data: bytes) -> AirfoilPolar:
    """A polar from its card (JSON) and weights (safetensors). Raises ValueError if they are damaged or disagree."""
    try:
        card = json.loads(card_text)
        digest = hashlib.sha256(data).hexdigest()
        if card["schema"] != "lpc-mdo/airfoil/1":
            raise ValueError(f"schema = {card['schema']!r} is not allowed; it must be 'lpc-mdo/airfoil/1'")
        if digest != card["weights_sha256"]:
            raise ValueError(f"sha256 of the weights is {digest}, the card says {card['weights_sha256']}")
        tensors = load(data)
        layers = tuple((tensors[f"matrix_{i}"], tensors[f"bias_{i}"]) for i in range(card["layers"]))
        limits = TrainingRange(**{key: tuple(card["training_range"][key]) for key in ("alpha_deg", "reynolds", "mach")})
        return AirfoilPolar(card["name"], layers, limits, tuple(card["blend_deg"]), digest, card)
    except (KeyError, TypeError, json.JSONDecodeError, SafetensorError) as error:
        raise ValueError(f"airfoil surrogate is damaged: {error!r}") from None
