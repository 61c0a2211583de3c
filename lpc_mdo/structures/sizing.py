"""Sizing of the airframe: gauges of least structural mass under all load cases, batched over samples.

Gross mass contains the structure itself, so loads follow the gauges; derivatives see that.
"""

import math
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TypeVar

import torch
from torch import Tensor

from lpc_mdo.disciplines.mass_properties import MassProperties
from lpc_mdo.structures.airframe import FUSELAGE_CASES, WING_CASES, Airframe, rotor_mass, wing_loads
from lpc_mdo.structures.body_frames import Fuselage, TailSurface, fin, fuselage, horizontal_tail
from lpc_mdo.structures.pieces import Pieces, join
from lpc_mdo.structures.sections import BoxWalls, ShellWall
from lpc_mdo.structures.sequential import Bounds, Optimum, minimize_log_linear
from lpc_mdo.structures.wing_frame import BOOMS, HUBS, TIP, Wing, wing
from lpc_mdo.surrogates.structural_mass import COMPONENTS, StructuralInputs

# Variables: natural logarithms of gauges, in the order of the vector. m, caps m^2.
GAUGES = {"skin": 5, "web": 5, "cap": 5, "boom": 4, "fuselage": 5, "tail": 2, "fin": 2}
VARIABLES = sum(GAUGES.values())
BOX_LIMITS = ("skin strength", "web strength", "skin buckling", "web buckling")
TUBE_LIMITS = ("wall strength", "wall buckling")
FLOOR = 1e-3  # shares far below one are rounded off towards this one, so that their logarithm stays finite


@dataclass(frozen=True)
class Limit:
    """What a row of the constraints stands for."""

    component: str
    kind: str
    case: str

    def __str__(self) -> str:
        return f"{self.component}: {self.kind}, {self.case}"


@dataclass(frozen=True)
class Structure:
    """For gauges (..., variable): mass (...,) kg; shares (..., row), 1 at a limit; components' starboard pieces."""

    mass: Tensor
    gross_mass: Tensor
    shares: Tensor
    pieces: dict[str, Pieces]

    @property
    def rows(self) -> Tensor:
        """Constraints (..., row) <= 0: logarithms of the shares, nearly linear in logarithms of gauges."""
        return 0.5 * torch.log((self.shares**2 + FLOOR**2) / (1.0 + FLOOR**2))


def split_gauges(x: Tensor) -> dict[str, Tensor]:
    """Gauges by name from their logarithms (..., variable)."""
    return dict(zip(GAUGES, torch.exp(x).split(list(GAUGES.values()), dim=-1), strict=True))


@dataclass(frozen=True)
class Frames:
    """The frames of one set of gauges and their limit loads, each (..., case, node, 6)."""

    wing: Wing
    fuselage: Fuselage
    tails: dict[str, TailSurface]
    pieces: dict[str, Pieces]
    mass: Tensor
    gross_mass: Tensor
    wing_loads: Tensor
    fuselage_loads: Tensor


@dataclass(frozen=True)
class SizingModel:
    """Callable (inputs, x) -> Structure; refinement multiplies the elements of the wing frame."""

    airframe: Airframe = field(default_factory=Airframe)
    refinement: int = 1

    def frames(self, inputs: StructuralInputs, x: Tensor) -> Frames:
        """Geometry, mass and loads for logarithms of gauges x (..., variable)."""
        a, gauge = self.airframe, split_gauges(x)
        half = wing(a, inputs, gauge["skin"], gauge["web"], gauge["cap"], gauge["boom"], self.refinement)
        body = fuselage(a, inputs, gauge["fuselage"])
        tails = {
            "horizontal_tail": horizontal_tail(a, inputs, gauge["tail"]),
            "vertical_tail": fin(a, inputs, gauge["fin"]),
        }
        half_pieces, body_pieces = half.pieces(), body.pieces()
        pieces = {"fuselage": body_pieces, **{name: tail.pieces() for name, tail in tails.items()}, **half_pieces}
        sides = {"wing": 2.0, "boom_inner": 2.0, "boom_outer": 2.0, "horizontal_tail": 2.0}
        mass = torch.stack([sides.get(name, 1.0) * p.mass.sum(-1) for name, p in pieces.items()]).sum(0)
        fixed = sum(item.mass for item in a.items)
        gross = fixed + inputs.battery_mass + rotor_mass(a, inputs) + mass
        loads = half.loads(half_pieces, inputs, wing_loads(a, inputs, gross))
        return Frames(half, body, tails, pieces, mass, gross, loads, body.loads(body_pieces, inputs, gross))

    def __call__(self, inputs: StructuralInputs, x: Tensor) -> Structure:
        a, f = self.airframe, self.frames(inputs, x)
        solution, count = f.wing.solve(f.wing_loads), f.wing.spanwise
        forces = a.safety_factor * solution.at_ends
        box = _with_cases(f.wing.box).shares(forces[..., :count, :, :], a.material, a.stringer_pitch, a.rib_pitch)
        tube = _with_cases(f.wing.tube, ends=True).shares(forces[..., count:, :, :], a.material)
        moved = solution.displacement
        tip = torch.sqrt(moved[..., TIP, 2] ** 2 + 1e-12) / (a.tip_deflection * f.wing.semi_span[..., None])
        # Hover at 1 g: half of the manoeuvre at 2 g, whose loads are twice as large but for the torque.
        turned = moved[..., WING_CASES.index("hover_manoeuvre"), HUBS, 4]
        rotation = 0.5 * torch.sqrt(turned**2 + 1e-12) / a.rotor_rotation
        shell_forces = a.safety_factor * f.fuselage.solve(f.fuselage_loads).at_ends
        parts = [box, tube, tip, rotation, _with_cases(f.fuselage.ends).shares(shell_forces, a.material)]
        for tail in f.tails.values():
            ultimate = a.safety_factor * tail.solve(tail.loads()).at_ends
            parts.append(_with_cases(tail.box).shares(ultimate, a.material, a.stringer_pitch, a.rib_pitch))
        shares = torch.cat([part.flatten(f.mass.dim()) for part in parts], dim=-1)
        return Structure(f.mass, f.gross_mass, shares, f.pieces)

    @cached_property
    def limits(self) -> tuple[Limit, ...]:
        """Meaning of the rows, in their order."""
        wing_elements, boom_elements = 11 * self.refinement, 4 * self.refinement
        rows = [Limit("wing", k, c) for c in WING_CASES for _ in range(2 * wing_elements) for k in BOX_LIMITS]
        rows += [
            Limit(boom, kind, case)
            for case in WING_CASES
            for boom in BOOMS
            for _ in range(2 * boom_elements)
            for kind in TUBE_LIMITS
        ]
        rows += [Limit("wing", "tip deflection", case) for case in WING_CASES]
        rows += [Limit(boom, "rotor rotation", "hover") for boom in BOOMS for _ in range(2)]
        rows += [Limit("fuselage", k, c) for c in FUSELAGE_CASES for _ in range(16) for k in TUBE_LIMITS]
        for tail in ("horizontal_tail", "vertical_tail"):
            rows += [Limit(tail, kind, "tail load") for _ in range(8) for kind in BOX_LIMITS]
        return tuple(rows)

    @property
    def bounds(self) -> Bounds:
        """Of the logarithms, each (variable,)."""
        a = self.airframe
        lower = {name: a.minimum_cap if name == "cap" else a.minimum_gauge for name in GAUGES}
        upper = {name: a.maximum_cap if name == "cap" else a.maximum_gauge for name in GAUGES}
        return Bounds(*(_logarithms(values) for values in (lower, upper)))

    def start(self) -> Tensor:
        """A feasible start (variable,) for usual sizes: walls of 4 mm. Caps start small: trading them for web near the root
        changes the mass by grams, and descending from thick ones takes many steps."""
        return _logarithms({name: 3e-5 if name == "cap" else 4e-3 for name in GAUGES})


def _logarithms(values: dict[str, float]) -> Tensor:
    entries = [math.log(values[name]) for name, count in GAUGES.items() for _ in range(count)]
    return torch.tensor(entries, dtype=torch.float64)


WallsT = TypeVar("WallsT", BoxWalls, ShellWall)


def _with_cases(walls: WallsT, ends: bool = False) -> WallsT:
    """The walls (..., element, 2) with a dimension for load cases; `ends`: one wall (..., element) for both ends."""
    values = {field.name: getattr(walls, field.name) for field in fields(walls)}
    return replace(walls, **{n: (v[..., None] if ends else v)[..., None, :, :] for n, v in values.items()})


def mass_properties(pieces: dict[str, Pieces]) -> dict[str, MassProperties]:
    """Mass, centre and inertia of the components of the whole aircraft, in the order COMPONENTS."""
    both = {name: join(pieces[name], pieces[name].mirrored()) for name in ("wing", "horizontal_tail")}
    parts = {
        **both,
        "fuselage": pieces["fuselage"],
        "vertical_tail": pieces["vertical_tail"],
        **{f"{boom}_starboard": pieces[boom] for boom in BOOMS},
        **{f"{boom}_port": pieces[boom].mirrored() for boom in BOOMS},
    }
    return {name: parts[name].total() for name in COMPONENTS}


def size(model: SizingModel, inputs: StructuralInputs, start: Tensor | None = None) -> Optimum:
    """Gauges of least mass for every sample: inputs each (sample,), start (variable,) or (sample, variable)."""
    columns = inputs.stacked()
    x0 = model.start() if start is None else start

    def evaluate(x: Tensor, which: Tensor) -> tuple[Tensor, Tensor]:
        structure = model(StructuralInputs(*columns[which].unbind(-1)), x)
        return structure.mass, structure.rows

    return minimize_log_linear(evaluate, x0.expand(len(columns), VARIABLES), model.bounds)
