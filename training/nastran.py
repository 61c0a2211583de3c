"""NASTRAN bulk data of a sized sample: SOL 101 for its load cases, SOL 200 to let NASTRAN size it.

SI units with densities in kg/m^3, WTMASS 1. Property numbers tell components: wing 1000s, booms 2000s (inner 2000, outer
2500), fuselage 3000s, tails 4000s (horizontal 4000, fin 4500). The starboard half of wing, booms and horizontal tail is
modelled; the frames stand side by side, each on its own supports. In SOL 200 the loads stay those of the exported gauges,
and panel buckling is left out: NASTRAN's bars know no panels.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from torch import Tensor

from surrogates.structural_mass import StructuralInputs
from training.airframe import FUSELAGE_CASES, WING_CASES
from training.frame import BeamSections, Topology, element_axes
from training.sizing import GAUGES, VARIABLES, SizingModel
from training.wing_frame import HUBS, TIP

PROPERTIES = ("A", "I1", "I2", "J")  # of PBAR: area, bending in plane 1 (up), in plane 2, torsion
TINY = 1e-12


@dataclass(frozen=True)
class _Part:
    """One frame in the deck: points (node, 3), loads (case, node, 6), recovery (element, 2): half depth along local z and y,
    non-structural mass (element,) kg/m, first numbers of grids and elements, property numbers (element,)."""

    points: Tensor
    topology: Topology
    sections: BeamSections
    loads: Tensor
    recovery: Tensor
    non_structural: Tensor
    first: int
    properties: list[int]
    cases: tuple[str, ...]


def card(name: str, *fields: object) -> str:
    """One bulk-data card in large-field format."""
    cells = [_field(value) for value in fields]
    rows = [cells[i : i + 4] for i in range(0, len(cells), 4)]
    lines = [(f"{name}*" if i == 0 else "*").ljust(8) + "".join(row) for i, row in enumerate(rows)]
    return "\n".join(line.rstrip() for line in lines)


def _field(value: object) -> str:
    text = "" if value is None else f"{value:.9E}" if isinstance(value, float) else str(value)
    return text.rjust(16)


def _parts(model: SizingModel, inputs: StructuralInputs, x: Tensor) -> list[_Part]:
    f = model.frames(inputs, x)
    half = f.wing
    count, per_boom = half.spanwise, (len(half.topology.elements) - half.spanwise) // 2
    box = torch.stack([half.box.height.mean(-1) / 2, half.box.width.mean(-1) / 2], dim=-1)
    tube = torch.stack([half.tube.semi_axis_z, half.tube.semi_axis_y], dim=-1)
    secondary = f.pieces["wing"].mass.unflatten(-1, (3, count))[1:].sum(0)
    wing_numbers = [1000 + i for i in range(count)]
    boom_numbers = [2000 + 500 * boom + i for boom in range(2) for i in range(per_boom)]
    no_mass = torch.zeros(2 * per_boom, dtype=x.dtype)
    parts = [
        _Part(
            half.points,
            half.topology,
            half.sections,
            f.wing_loads,
            torch.cat([box, tube]),
            torch.cat([secondary, no_mass]),
            1000,
            wing_numbers + boom_numbers,
            WING_CASES,
        )
    ]
    body = f.fuselage
    ends = torch.stack([body.ends.semi_axis_z.mean(-1), body.ends.semi_axis_y.mean(-1)], dim=-1)
    bays, mass = len(body.topology.elements), f.pieces["fuselage"].mass
    extra = mass[bays : 2 * bays].clone()
    extra[1 : 1 + len(mass) - 2 * bays] += mass[2 * bays :]
    numbers = [3000 + i for i in range(bays)]
    parts.append(
        _Part(body.points, body.topology, body.sections, f.fuselage_loads, ends, extra, 3000, numbers, FUSELAGE_CASES)
    )
    for first, (name, tail) in zip((4000, 4500), f.tails.items(), strict=True):
        ends = torch.stack([tail.box.height.mean(-1) / 2, tail.box.width.mean(-1) / 2], dim=-1)
        n = len(tail.topology.elements)
        extra = f.pieces[name].mass.unflatten(-1, (3, n))[1:].sum(0)
        numbers = [first + i for i in range(n)]
        parts.append(
            _Part(tail.points, tail.topology, tail.sections, tail.loads(), ends, extra, first, numbers, (name,))
        )
    lengths = [element_axes(part.points, part.topology)[0] for part in parts]
    return [
        replace(part, non_structural=part.non_structural / length) for part, length in zip(parts, lengths, strict=True)
    ]


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
        mass = float(part.non_structural[i])
        yield card("PBAR", number, 1, *values, mass, None, *corners, *shear)
    for i, held in enumerate(part.topology.is_fixed.tolist()):
        if any(held):
            freedoms = "".join(str(k + 1) for k in range(6) if held[k])
            yield card("SPC1", 1, freedoms, part.first + i)


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


def gauges_from_punch(file: Path) -> Tensor:
    """Logarithms of gauges (variable,) from the DESVAR cards of a bulk-data file in any NASTRAN field format.

    Raises ValueError if a design variable is missing or not positive.
    """
    found: dict[int, float] = {}
    lines = file.read_text(encoding="ascii", errors="replace").splitlines()
    for line in lines:
        if line[:7].upper().startswith("DESVAR*"):
            cells = [line[i : i + 16] for i in range(8, 72, 16)]
        elif line[:6].upper() == "DESVAR" and "," in line:
            cells = line.split(",")[1:]
        elif line[:6].upper() == "DESVAR":
            cells = [line[i : i + 8] for i in range(8, 72, 8)]
        else:
            continue
        found[int(cells[0])] = _nastran_number(cells[2])
    missing = [i for i in range(1, VARIABLES + 1) if i not in found]
    if missing:
        raise ValueError(f"{file.name}: DESVAR {missing[0]} is missing; all {VARIABLES} are needed")
    values = torch.tensor([found[i] for i in range(1, VARIABLES + 1)], dtype=torch.float64)
    if not bool((values > 0.0).all()):
        raise ValueError(f"{file.name}: DESVAR {int(values.argmin()) + 1} = {float(values.min())} must be positive")
    return torch.log(values)


def _nastran_number(text: str) -> float:
    """A real number, also in the form 1.5-3 that leaves out the E."""
    text = text.strip().upper().replace("D", "E")
    for sign in "+-":
        head, found, tail = text[1:].partition(sign)
        if found and "E" not in text:
            return float(f"{text[0]}{head}E{sign}{tail}")
    return float(text)
