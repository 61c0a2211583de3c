"""Section lift and drag over angle of attack, Reynolds and Mach number: a small network trained on XFOIL polars.

Attached and stalling flow come from the network; beyond, a stalled flat plate takes over through a step with two
continuous derivatives, so that the polar is defined, smooth and periodic for every angle. Beyond the last Mach number of
the polars, where XFOIL knows no shocks, a drag rise is added, so that no optimizer finds a supersonic blade tip free.
"""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Literal

import torch
from safetensors import SafetensorError
from safetensors.torch import load
from torch import Tensor

from lpc_mdo.files.faults import shortened
from lpc_mdo.files.read import decoded, is_there, read_packaged
from lpc_mdo.numerics.smooth import smooth_step
from lpc_mdo.surrogates.cards import AirfoilCard, read_card
from lpc_mdo.surrogates.section_theory import drag_rise, stalled_plate

Policy = Literal["error", "warn", "penalty"]

CLAMP_WIDTH = 0.05  # in the scaled inputs, over which a query is led back to the training range
CHUNK = 4096  # rows of the network at a time: hidden layers stay in the cache
LARGEST_FILE = 10_000_000  # bytes of a card or of weights


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
    thickness_to_chord: float
    weights: tuple[tuple[Tensor, Tensor], ...]
    training_range: TrainingRange
    blend_deg: tuple[float, float, float, float]
    sha256: str
    card: Mapping[str, Any]

    def __call__(self, alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        """Lift and drag coefficient (...,) at alpha (...,) rad (any angle), reynolds (...,) > 0, mach (...,) >= 0.

        Outside the training range the network's inputs are held at its edge, smoothly; `extrapolated` tells where.
        """
        low_full, low_none, high_none, high_full = (math.radians(angle) for angle in self.blend_deg)
        angles = alpha.detach()
        if alpha.numel() and low_none <= float(angles.min()) and float(angles.max()) <= high_none:
            return self.network(alpha, reynolds, mach)  # the plate's share and its derivatives are zero: half the work
        sin, cos = torch.sin(alpha), torch.cos(alpha)
        wrapped = torch.atan2(sin, cos)
        cl, cd = self.network(wrapped, reynolds, mach)
        above, below = (wrapped - high_none) / (high_full - high_none), (wrapped - low_none) / (low_full - low_none)
        share = smooth_step(torch.maximum(above, below))
        cl_plate, cd_plate = stalled_plate(sin, cos)
        return torch.lerp(cl, cl_plate, share), torch.lerp(cd, cd_plate, share)

    def network(self, alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        """The trained part, every input held at the edge of the training range outside it, and the drag rise."""
        query = _query(alpha, reynolds, mach)
        x = _held(query, self._edges)
        # Stored in double precision on the processor; `to` follows the query and costs nothing where it does so already.
        cl, cd = network_outputs(x, [(matrix.to(x), bias.to(x)) for matrix, bias in self.weights])
        held_mach = held_mach_number(x[..., 2], self.training_range)
        return cl, cd + drag_rise(cl, mach, held_mach, self.thickness_to_chord)

    def with_drag(self, factor: float) -> "AirfoilPolar":
        """The same section with the network's drag multiplied by `factor` > 0: another finish, or dirt.

        Drag rise and stalled plate stay; `sha256` and `card` remain those of the trained weights.
        """
        matrix, bias = self.weights[-1]
        return replace(self, weights=(*self.weights[:-1], (matrix, bias + bias.new_tensor([0.0, math.log(factor)]))))

    @cached_property
    def _edges(self) -> tuple[Tensor, Tensor]:
        return _scaling(self.training_range)

    def beyond(self, alpha: Tensor, reynolds: Tensor, mach: Tensor) -> Tensor:
        """(..., 3) distance of angle, log of Reynolds number and squared Mach number outside the training range, in its
        half-widths; zero inside."""
        wrapped = torch.atan2(torch.sin(alpha), torch.cos(alpha))
        query = _query(wrapped, reynolds, mach)
        return (_scaled(query, self._edges).abs() - 1.0 - 1e-9).clamp(min=0.0)

    def extrapolated(self, alpha: Tensor, reynolds: Tensor, mach: Tensor) -> Tensor:
        """(...,) bool: the query lies outside the polars that the network was trained on."""
        return (self.beyond(alpha, reynolds, mach) > 0.0).any(-1)

    def guarded(self, alpha: Tensor, reynolds: Tensor, mach: Tensor, policy: Policy = "error") -> tuple[Tensor, Tensor]:
        """Lift and drag coefficient as by a call, heeding the training range.

        "error" raises ValueError and "warn" warns where a query leaves it; "penalty" multiplies drag by 1 + the sum of
        the cubed distances outside (in half-widths), which has two continuous derivatives, so that an optimizer turns
        back. Raises ValueError for another policy.
        """
        if policy not in ("error", "warn", "penalty"):
            raise ValueError(f"policy = {policy!r} is not allowed; it must be one of error, warn, penalty")
        beyond = self.beyond(alpha, reynolds, mach)
        cl, cd = self(alpha, reynolds, mach)
        if policy == "penalty":
            return cl, cd * (1.0 + (beyond**3).sum(-1))
        if fault := self._fault(alpha, reynolds, mach, beyond.detach()):
            if policy == "error":
                raise ValueError(fault)
            warnings.warn(fault, RuntimeWarning, stacklevel=2)
        return cl, cd

    def _fault(self, alpha: Tensor, reynolds: Tensor, mach: Tensor, beyond: Tensor) -> str:
        """What is wrong with the worst query, in a sentence; empty if nothing is."""
        farthest = beyond.reshape(-1, 3).max(0)
        k = int(farthest.values.argmax())
        if not farthest.values[k] > 0.0:
            return ""
        columns = torch.broadcast_tensors(torch.rad2deg(alpha), reynolds, mach)
        value = float(columns[k].detach().flatten()[farthest.indices[k]])
        name = fields(TrainingRange)[k].name
        lower, upper = getattr(self.training_range, name)
        return f"{name} = {value:g} is not allowed; the polars of {self.name} lie between {lower:g} and {upper:g}"

    def maximum_lift_coefficient(self, reynolds: Tensor, mach: Tensor) -> Tensor:
        """Section maximum lift (...,): the mean over 6 to 19 degrees weighted by exp(200 cl), smooth in both arguments."""
        alpha = torch.deg2rad(torch.linspace(6.0, 19.0, 53, dtype=reynolds.dtype, device=reynolds.device))
        cl, _ = self.network(alpha, reynolds[..., None], mach[..., None])
        return (torch.softmax(200.0 * cl, dim=-1) * cl).sum(-1)


def held_mach_number(scaled: Tensor, limits: TrainingRange) -> Tensor:
    """Mach number (...,) of the network's third input (...,)."""
    slowest, fastest = (mach**2 for mach in limits.mach)
    return torch.sqrt(0.5 * (slowest + fastest) + 0.5 * (fastest - slowest) * scaled)


def _query(alpha: Tensor, reynolds: Tensor, mach: Tensor) -> Tensor:
    """(..., 3): angle in rad, logarithm of the Reynolds number, and square of the Mach number, as compressible flow
    depends on it: smooth at rest, and next to nothing below Mach 0.1."""
    return torch.stack(torch.broadcast_tensors(alpha, torch.log(reynolds.clamp(min=1.0)), mach * mach), dim=-1)


def _scaling(limits: TrainingRange) -> tuple[Tensor, Tensor]:
    """Offset and slope (3,) that map queries in the training range to [-1, 1]."""
    ends = [
        [math.radians(a) for a in limits.alpha_deg],
        [math.log(r) for r in limits.reynolds],
        [m**2 for m in limits.mach],
    ]
    lower, upper = torch.tensor(ends, dtype=torch.float64).unbind(-1)
    return -(upper + lower) / (upper - lower), 2.0 / (upper - lower)


def _scaled(query: Tensor, edges: tuple[Tensor, Tensor]) -> Tensor:
    offset, slope = (edge.to(query) for edge in edges)
    return torch.addcmul(offset, query, slope)


def _held(query: Tensor, edges: tuple[Tensor, Tensor]) -> Tensor:
    """Queries (..., 3) scaled and held within [-1, 1], smoothly; monotone and infinitely often differentiable."""
    above_lower = torch.nn.functional.softplus(_scaled(query, edges) + 1.0, 1.0 / CLAMP_WIDTH, 30.0)
    return 1.0 - torch.nn.functional.softplus(2.0 - above_lower, 1.0 / CLAMP_WIDTH, 30.0)


def scaled_inputs(alpha: Tensor, reynolds: Tensor, mach: Tensor, limits: TrainingRange) -> Tensor:
    """Network inputs (..., 3): what `_query` gives, each scaled and held within [-1, 1]."""
    return _held(_query(alpha, reynolds, mach), _scaling(limits))


def network_outputs(x: Tensor, weights: Sequence[tuple[Tensor, Tensor]]) -> tuple[Tensor, Tensor]:
    """Lift and drag coefficient from scaled inputs (..., 3); the last layer gives cl and log(cd)."""
    rows = x.reshape(-1, 3)
    parts = [_layers(part, weights) for part in rows.split(CHUNK)] if len(rows) > CHUNK else [_layers(rows, weights)]
    outputs = torch.cat(parts) if len(parts) > 1 else parts[0]
    cl, log_cd = outputs.reshape(*x.shape[:-1], 2).unbind(-1)
    return cl, torch.exp(log_cd)


def _layers(x: Tensor, weights: Sequence[tuple[Tensor, Tensor]]) -> Tensor:
    # The logistic function is a hyperbolic tangent in other units, and four times as fast in double precision.
    for matrix, bias in weights[:-1]:
        x = torch.sigmoid(torch.nn.functional.linear(x, matrix, bias))
    return torch.nn.functional.linear(x, *weights[-1])


def load_airfoil(name: str = "naca4412") -> AirfoilPolar:
    """A shipped polar by name, or a trained one by the path of its card (NAME.json, beside NAME.safetensors).

    Raises ValueError if there is none or its files are damaged. `surrogates.airfoil_names` takes other names, too.
    """
    if name.endswith(".json"):
        files: tuple[Traversable, Traversable] = Path(name), Path(name).with_suffix(".safetensors")
    else:
        folder = resources.files("lpc_mdo.surrogates.weights")
        files = folder.joinpath(f"{name}.json"), folder.joinpath(f"{name}.safetensors")
    if not all(not isinstance(file, Path) or is_there(file) for file in files) or not all(
        file.is_file() for file in files
    ):
        raise ValueError(
            f"airfoil = {shortened(name)} is invalid: it must be naca4412 or ls417, which are shipped, or the card of a trained surrogate"
        )
    return _parsed(*(read_packaged(file, LARGEST_FILE) for file in files))


@lru_cache(maxsize=32)
def _parsed(card_text: bytes, data: bytes) -> AirfoilPolar:
    return parse_airfoil(card_text, data)


def parse_airfoil(card_text: str | bytes, data: bytes) -> AirfoilPolar:
    """A polar from its card (JSON) and weights (safetensors). Raises ValueError if they are damaged or disagree."""
    try:
        if len(data) > LARGEST_FILE:
            raise ValueError(f"{len(data)} bytes of weights are not allowed; there must be at most {LARGEST_FILE}")
        text = card_text if isinstance(card_text, str) else decoded(card_text, Path("the card"))
        card, content = read_card(AirfoilCard, text, data)
        limits = TrainingRange(**{f.name: getattr(card.training_range, f.name) for f in fields(TrainingRange)})
        layers = _parse_layers(load(data))
    except KeyError as error:
        raise ValueError(f"airfoil surrogate is damaged: its weights must hold the tensor {error}") from None
    except (ValueError, SafetensorError) as error:
        raise ValueError(f"airfoil surrogate is damaged: {error}") from None
    return AirfoilPolar(
        card.name, card.thickness_to_chord, layers, limits, card.blend_deg, card.weights_sha256, content
    )


def _parse_layers(tensors: Mapping[str, Tensor]) -> tuple[tuple[Tensor, Tensor], ...]:
    """Layers whose shapes fit together, from 3 inputs to 2 outputs."""
    layers, width = [], 3
    for i in range(len(tensors) // 2):
        matrix, bias = tensors[f"matrix_{i}"], tensors[f"bias_{i}"]
        if matrix.dim() != 2 or matrix.shape[1] != width or bias.shape != matrix.shape[:1]:
            shapes = f"{tuple(matrix.shape)} and {tuple(bias.shape)}"
            raise ValueError(f"layer {i} of shape {shapes} is not allowed; it must take {width} inputs")
        if matrix.dtype != torch.float64 or bias.dtype != torch.float64:
            raise ValueError(f"layer {i} of type {matrix.dtype} is not allowed; it must be float64")
        if not bool(matrix.isfinite().all() & bias.isfinite().all()):
            raise ValueError(f"layer {i} holds weights that are not finite")
        layers.append((matrix, bias))
        width = len(matrix)
    if not layers or width != 2 or len(tensors) != 2 * len(layers):
        raise ValueError(f"{len(tensors)} tensors with {width} outputs are not allowed; the last layer must have 2")
    return tuple(layers)
