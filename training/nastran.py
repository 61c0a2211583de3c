"""NASTRAN bulk data of a sized sample: SOL 101 for its load cases, SOL 200 to let NASTRAN size it.

SI units with densities in kg/m^3, WTMASS 1. Property numbers (element numbers for concentrated masses) tell components:
wing 1000s, booms 2000s (inner 2000, outer 2500), fuselage 3000s, tails 4000s (horizontal 4000, fin 4500). The starboard
half of wing, booms and horizontal tail is modelled; the frames stand side by side, each on its own supports. What is not
sized (ribs, secondary structure, frames, floor) stands as concentrated masses. In SOL 200 the loads stay those of the
exported gauges, and panel buckling is left out: NASTRAN's bars know no panels.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.structures.airframe import FUSELAGE_CASES, WING_CASES
from lpc_mdo.structures.body_frames import FLOOR
from lpc_mdo.structures.frame import BeamSections, Topology
from lpc_mdo.structures.pieces import Pieces
from lpc_mdo.structures.sections import BoxWalls, ShellWall
from lpc_mdo.structures.sizing import GAUGES, VARIABLES, Frames, SizingModel
from lpc_mdo.structures.wing_frame import BOOMS, HUBS, TIP
from lpc_mdo.surrogates.structural_mass import StructuralInputs

PROPERTIES = ("A", "I1", "I2", "J")  # of PBAR: area, bending in plane 1 (up), in plane 2, torsion
TINY = 1e-12


@dataclass(frozen=True)
class _Part:
    """One frame in the deck: points (node, 3), loads (case, node, 6), recovery (element, 2): half depth along local z and y,
    numbers of the first grid and of every element's property, pieces that are not sized; stubs: bars without load beyond
    the frame as (node, property, end (3,))."""

    points: Tensor
    topology: Topology
    sections: BeamSections
    loads: Tensor
    recovery: Tensor
    first: int
    properties: list[int]
    cases: tuple[str, ...]
    extras: tuple["_Extras", ...]
    stubs: tuple[tuple[int, int, Tensor], ...] = ()


@dataclass(frozen=True)
class _Extras:
    """Pieces that hang on the nodes nodes[i], numbered from `first`."""

    pieces: Pieces
    nodes: list[int]
    first: int


def card(name: str, *fields: object) -> str:
    """One bulk-data card in large-field format."""
    cells = [_field(value) for value in fields]
    rows = [cells[i : i + 4] for i in range(0, len(cells), 4)]
    lines = [(f"{name}*" if i == 0 else "*").ljust(8) + "".join(row) for i, row in enumerate(rows)]
    return "\n".join(line.rstrip() for line in lines)


def _field(value: object) -> str:
    text = "" if value is None else f"{value:.9E}" if isinstance(value, float) else str(value)
    return text.rjust(16)


def _half_depths(walls: BoxWalls | ShellWall) -> Tensor:
    """(element, 2) along local z and y, of walls at both ends or of one wall an element."""
    if isinstance(walls, BoxWalls):
        return torch.stack([walls.height.mean(-1) / 2, walls.width.mean(-1) / 2], dim=-1)
    axes = torch.stack([walls.semi_axis_z, walls.semi_axis_y], dim=-1)
    return axes if axes.dim() == 2 else axes.mean(-2)


def _wing_part(f: Frames) -> _Part:
    half, count = f.wing, f.wing.spanwise
    bars = len(half.topology.elements)
    per_boom = (bars - count) // 2
    starts = half.topology.elements[:, 0].tolist()
    secondary = f.pieces["wing"].take(slice(count, 3 * count))
    properties = [1000 + i for i in range(count)]
    properties += [2000 + 500 * boom + i for boom in range(2) for i in range(per_boom)]
    stubs = []
    for boom, name in enumerate(BOOMS):
        # The last two pieces of a boom are what stands beyond its hubs: as far again from the hub as their middle.
        for end in range(2):
            hub = HUBS[2 * boom + end]
            last = count + per_boom * boom + per_boom // 2 * (end + 1) - 1
            middle = f.pieces[name].center[end - 2]
            stubs.append((hub, properties[last], 2.0 * middle - half.points[hub]))
    return _Part(
        half.points,
        half.topology,
        half.sections,
        f.wing_loads,
        torch.cat([_half_depths(half.box), _half_depths(half.tube)]),
        1000,
        properties,
        WING_CASES,
        (_Extras(secondary, 2 * starts[:count], 1100),),
        tuple(stubs),
    )


def _body_part(f: Frames) -> _Part:
    body = f.fuselage
    bars = len(body.topology.elements)
    starts = body.topology.elements[:, 0].tolist()
    stiffening = f.pieces["fuselage"].take(slice(bars, None))
    return _Part(
        body.points,
        body.topology,
        body.sections,
        f.fuselage_loads,
        _half_depths(body.ends),
        3000,
        [3000 + i for i in range(bars)],
        FUSELAGE_CASES,
        (_Extras(stiffening, starts + starts[FLOOR], 3100),),
    )


def _parts(model: SizingModel, inputs: StructuralInputs, x: Tensor) -> list[_Part]:
    f = model.frames(inputs, x)
    parts = [_wing_part(f), _body_part(f)]
    for first, (name, tail) in zip((4000, 4500), f.tails.items(), strict=True):
        bars = len(tail.topology.elements)
        extras = _Extras(f.pieces[name].take(slice(bars, None)), 2 * tail.topology.elements[:, 0].tolist(), first + 100)
        properties = [first + i for i in range(bars)]
        loads, recovery = tail.loads(), _half_depths(tail.box)
        parts.append(
            _Part(tail.points, tail.topology, tail.sections, loads, recovery, first, properties, (name,), (extras,))
        )
    return parts


def _model_cards(part: _Part) -> Iterable[str]:
    s = part.sections
    for i, point in enumerate(part.points.tolist()):
        yield card("GRID", part.first + i, None, *point)
    for i, ((a, b), up) in enumerate(zip(part.topology.elements.tolist(), part.topology.up.tolist(), strict=True)):
        number = part.properties[i]
        yield card("CBAR", number, number, part.first + a, part.first + b, *up)
        depth, breadth = part.recovery[i].tolist()
        values = [float(v[i]) for v in (s.area, s.second_moment_y, s.second_moment_z, s.torsion_constant)]
        corners = [depth, breadth, -depth, breadth, -depth, -breadth, depth, -breadth]
        shear = [float(s.shear_area_z[i] / s.area[i]), float(s.shear_area_y[i] / s.area[i])]
        yield card("PBAR", number, 1, *values, None, None, *corners, *shear)
    for i, held in enumerate(part.topology.is_fixed.tolist()):
        if any(held):
            freedoms = "".join(str(k + 1) for k in range(6) if held[k])
            yield card("SPC1", 1, freedoms, part.first + i)
    for i, (node, number, end) in enumerate(part.stubs):
        grid = part.first + 500 + i
        yield card("GRID", grid, None, *end.tolist())
        yield card("CBAR", number + 400, number, part.first + node, grid, *part.topology.up[0].tolist())
    for extras in part.extras:
        yield from _mass_cards(part, extras)


def _mass_cards(part: _Part, extras: _Extras) -> Iterable[str]:
    """Concentrated masses, offset from their grids; products of inertia as + integral, which is how CONM2 wants them."""
    pieces = extras.pieces
    for i, node in enumerate(extras.nodes):
        offset, tensor = (pieces.center[i] - part.points[node]).tolist(), pieces.inertia[i]
        moments = [tensor[0, 0], -tensor[0, 1], tensor[1, 1], -tensor[0, 2], -tensor[1, 2], tensor[2, 2]]
        mass = float(pieces.mass[i])
        yield card(
            "CONM2", extras.first + i, part.first + node, 0, mass, *offset, None, *(float(moment) for moment in moments)
        )


def _load_cards(part: _Part, first_case: int) -> Iterable[str]:
    for case, rows in enumerate(part.loads.tolist(), start=first_case):
        for i, row in enumerate(rows):
            for name, vector in (("FORCE", row[:3]), ("MOMENT", row[3:])):
                if any(abs(v) > TINY for v in vector):
                    yield card(name, case, part.first + i, 0, 1.0, *vector)


def _design_cards(model: SizingModel, inputs: StructuralInputs, x: Tensor, parts: list[_Part]) -> Iterable[str]:
    """Design variables are the gauges; A, I1 and I2 are linear in them, J of the wing box is an equation."""
    names = [f"{name[:4].upper()}{i + 1}" for name, count in GAUGES.items() for i in range(count)]
    gauges, bounds = torch.exp(x), model.bounds
    for i, name in enumerate(names):
        limits = [float(torch.exp(b[i])) for b in (bounds.lower, bounds.upper)]
        yield card("DESVAR", i + 1, name, float(gauges[i]), *limits)
    part_sections = torch.func.jacfwd(lambda g: [_constants(p) for p in _parts(model, inputs, torch.log(g))])(gauges)
    relation = 0
    for part, slopes in zip(parts, part_sections, strict=True):
        for element, number in enumerate(part.properties):
            for k, name in enumerate(PROPERTIES):
                if name == "J" and number < 2000:
                    continue
                terms = [(i + 1, float(v)) for i, v in enumerate(slopes[element, k]) if abs(float(v)) > 0.0]
                relation += 1
                pairs = [entry for pair in terms for entry in pair]
                yield card("DVPREL1", relation, "PBAR", number, name, TINY, None, 0.0, None, *pairs)
    frames = model.frames(inputs, x)
    skin = list(GAUGES).index("skin") * 5
    weights = torch.func.jacfwd(lambda g: model.frames(inputs, torch.log(g)).wing.box.skin.mean(-1))(gauges)
    for element, number in enumerate(parts[0].properties[: frames.wing.spanwise]):
        stations = [i for i in range(5) if abs(float(weights[element, skin + i])) > 0.0]
        shares = [float(weights[element, skin + i]) for i in stations]
        width, height = (float(v[element].mean()) for v in (frames.wing.box.width, frames.wing.box.height))
        skins, webs = [f"S{i + 1}" for i in stations], [f"W{i + 1}" for i in stations]
        sums = ["+".join(f"{s:.8f}*{v}" for s, v in zip(shares, group, strict=True)) for group in (skins, webs)]
        flow = f"({2 * width:.8f}/({sums[0]})+{2 * height:.8f}/({sums[1]}))"
        text = f"J({','.join(skins + webs)})={4 * (width * height) ** 2:.9E}/{flow}"
        yield _equation(number, text)
        relation += 1
        variables = [skin + i + 1 for i in stations] + [skin + 5 + i + 1 for i in stations]
        yield card("DVPREL2", relation, "PBAR", number, "J", TINY, None, number, None, "DESVAR", *variables)
    yield from _responses(model, parts)


def _constants(part: _Part) -> Tensor:
    """(element, 4) in the order PROPERTIES."""
    s = part.sections
    return torch.stack([s.area, s.second_moment_y, s.second_moment_z, s.torsion_constant], dim=-1)


def _equation(number: int, text: str) -> str:
    lines = [f"DEQATN  {number:<8d}{text[:56]}"]
    return "\n".join(lines + [f"        {text[i : i + 64]}" for i in range(56, len(text), 64)])


def _responses(model: SizingModel, parts: list[_Part]) -> Iterable[str]:
    a = model.airframe
    limit = a.material.allowable / a.safety_factor
    yield card("DRESP1", 1, "MASS", "WEIGHT")
    numbers = [number for part in parts for number in part.properties]
    for response, (label, item, low, high) in enumerate(
        [
            ("SAMAX", 7, None, limit),
            ("SAMIN", 8, -limit, None),
            ("SBMAX", 14, None, limit),
            ("SBMIN", 15, -limit, None),
        ],
        start=2,
    ):
        yield card("DRESP1", response, label, "STRESS", "PBAR", None, item, None, *numbers)
        yield card("DCONSTR", 100, response, low, high)
    tip = float(a.tip_deflection * parts[0].points[TIP, 1])
    yield card("DRESP1", 10, "TIP", "DISP", None, None, 3, None, parts[0].first + TIP)
    yield card("DCONSTR", 100, 10, -tip, tip)
    hover = 2.0 * a.rotor_rotation  # at 2 g
    yield card("DRESP1", 11, "ROTOR", "DISP", None, None, 5, None, *[parts[0].first + hub for hub in HUBS])
    yield card("DCONSTR", 101, 11, -hover, hover)
    yield card("DCONADD", 102, 100, 101)
    yield card("DOPTPRM", "DESMAX", 50, "CONV1", 1.0e-4)


def deck(model: SizingModel, inputs: StructuralInputs, x: Tensor, solution: int = 101) -> str:
    """Bulk data of one sample (inputs scalar, logarithms of gauges x (variable,)) for SOL 101 or 200.

    Raises ValueError for another solution or a batch of samples.
    """
    if solution not in (101, 200):
        raise ValueError(f"solution = {solution} is not allowed; it must be 101 or 200")
    if x.shape != (VARIABLES,):
        raise ValueError(f"gauges of shape {tuple(x.shape)} are not allowed; a deck holds one sample of {VARIABLES}")
    parts = _parts(model, inputs, x)
    cases = [case if part.first == 1000 else f"fuselage_{case}" for part in parts[:2] for case in part.cases]
    cases += [f"{part.cases[0]}_load" for part in parts[2:]]
    lines = [f"SOL {solution}", "CEND", "ECHO = PUNCH(NEWBULK)" if solution == 200 else "ECHO = NONE"]
    lines += ["SPC = 1", "DISPLACEMENT = ALL", "STRESS = ALL", "FORCE = ALL"]
    lines += ["DESOBJ(MIN) = 1", "ANALYSIS = STATICS"] if solution == 200 else []
    for number, case in enumerate(cases, start=1):
        lines += [f"SUBCASE {number}", f"  LABEL = {case}", f"  LOAD = {number}"]
        if solution == 200:
            lines.append(f"  DESSUB = {102 if case == 'hover_manoeuvre' else 100}")
    lines += ["BEGIN BULK", "PARAM,POST,-1", "PARAM,GRDPNT,0", "PARAM,WTMASS,1.0"]
    material = model.airframe.material
    lines.append(
        card("MAT1", 1, material.elastic_modulus, material.shear_modulus, material.poisson_ratio, material.density)
    )
    first = 1
    for part in parts:
        lines += [*_model_cards(part), *_load_cards(part, first)]
        first += len(part.loads)
    if solution == 200:
        lines += _design_cards(model, inputs, x, parts)
    return "\n".join([*lines, "ENDDATA", ""])
