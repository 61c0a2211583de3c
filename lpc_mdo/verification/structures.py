"""Frame, sections, structural surrogates and mass properties against other codes, closed forms and unseen samples."""

import math
from pathlib import Path

import torch
from torch import Tensor

from lpc_mdo.cases.structures import analyze_case
from lpc_mdo.disciplines.drag import turbulent_friction_coefficient
from lpc_mdo.disciplines.mass_properties import combine
from lpc_mdo.structures.sections import BoxWalls
from lpc_mdo.structures.shipped import SHIPPED, read_open, structural_inputs
from lpc_mdo.surrogates.structural_mass import StructuralInputs, load_structural_mass
from lpc_mdo.verification.comparison import Between, Comparison, reference

FRAMES = {"structures_frame_L": "L-shaped cantilever", "structures_frame_wing_booms": "wing with booms"}
GROUPS = {"wing": "wing", "boom": "booms", "fuselage": "fuselage"}
BASELINE_INPUTS = (
    "wing_area", "wing_aspect_ratio", "fuselage_length", "battery_mass", "cruise_speed", "htail_area", "vtail_area",
)  # fmt: skip


def comparisons() -> list[Comparison]:
    return [
        *(row for name in FRAMES for row in _frame(name)),
        *_box(),
        *_published_masses(),
        _unseen_samples(),
        *_rod(),
        _friction(),
    ]


def _frame(name: str) -> list[Comparison]:
    case = reference(name)
    results = analyze_case(case, Path(f"{name}.json"))["results"]
    rows = []
    for code, variants, keys, limit, reason in (
        ("MYSTRAN 17.0.0", ("nu=0", "nu=0.33"), 6, 1e-6, "seven printed digits"),
        ("CalculiX 2.20 without contraction", ("nu=0",), 3, 5e-3, "its quadratic pipe elements are solids"),
    ):
        key = code.split()[0].lower()
        ours, theirs = [], []
        for variant in variants:
            for point, displacement in case["variants"][variant][key]["displacement"].items():
                ours += results[variant]["displacement"][point][:keys]
                theirs += displacement[:keys]
        of = "displacements m and turns rad" if keys == 6 else "displacements, m"
        rows.append(Between("structural frame", code).of_largest(f"{of}, {FRAMES[name]}", ours, theirs, limit, reason))
    stored = [case["variants"][variant]["mystran"] for variant in ("nu=0", "nu=0.33")]
    own = [results[variant] for variant in ("nu=0", "nu=0.33")]
    at_points = "max_abs_fibre_stress_at_recovery_points"
    for quantity, ours_key, key in (
        ("largest fibre stress at a bar's four points, Pa", at_points, "max_abs_fibre_stress"),
        ("mass, kg", "mass", "mass"),
    ):
        columns = ([row[name] for row in rows] for name, rows in ((ours_key, own), (key, stored)))
        rows.append(
            Between("structural frame", "MYSTRAN 17.0.0").relative(
                f"{quantity}, {FRAMES[name]}", *columns, 1e-6, "seven printed digits"
            )
        )
    return rows


def _box() -> list[Comparison]:
    case = reference("structures_closed_form")["box"]
    keys = ("width_between_webs", "height_between_skins", "skin_thickness", "web_thickness")
    ours = BoxWalls(*(_tensor(case[key]) for key in keys), _tensor(0.0)).constants()
    theirs = case["sectionproperties_3_10_2"]
    between = Between("thin-walled box section", "sectionproperties 3.10.2 (finite elements)")
    return [
        between.relative(
            "second moments about both axes, m^4", [float(ours.second_moment_y), float(ours.second_moment_z)],
            [theirs["I_flap"], theirs["I_chord"]], 2e-4, "walls are lines",
        ),
        between.relative("torsion constant, m^4", ours.torsion_constant, theirs["J"], 5e-3, "walls are lines"),
    ]  # fmt: skip


def _published_masses() -> list[Comparison]:
    published = reference("structures_published_regressions")
    inputs = [_tensor(published["baseline_inputs"][name]) for name in BASELINE_INPUTS]
    ours = load_structural_mass()(StructuralInputs(*inputs))
    between = Between("published structural regressions", "tables of the component regressions (2024)")
    return [
        between.relative(
            f"mass of {words} at the baseline, kg",
            sum(float(ours.mass[i]) for i, name in enumerate(ours.names) if group in name),
            published["derived"][f"2024 {words}"]["baseline_kg"],
            1e-10,
            "the same rows",
        )
        for group, words in GROUPS.items()
    ]


def _unseen_samples() -> Comparison:
    unseen = read_open(SHIPPED)[0].usable()[0].named("test")
    ours = load_structural_mass("open")(structural_inputs(unseen.inputs)).mass
    return Between("structural surrogate of our own sizing", "sized samples that the fit has not seen").relative(
        f"masses of {ours.shape[-1]} components in {len(unseen.ids)} aircraft, kg", ours, unseen.targets[..., 0], 0.01,
        "a quadratic in logarithms",
    )  # fmt: skip


def _rod() -> list[Comparison]:
    """A slender rod of many pieces, askew in space: its closed-form inertia about the middle."""
    count, length, mass = 400, 3.0, 12.0
    axis = _tensor([2.0, -1.0, 2.0]) / 3.0
    at = (torch.arange(count, dtype=torch.float64) + 0.5) / count - 0.5
    middle = _tensor([1.0, 2.0, -3.0])
    piece = mass / count * (length / count) ** 2 / 12.0 * (torch.eye(3).double() - axis[:, None] * axis)
    ours = combine(
        torch.full((count,), mass / count, dtype=torch.float64),
        middle + length * at[:, None] * axis,
        piece.expand(count, 3, 3),
    )
    theirs = mass * length**2 / 12.0 * (torch.eye(3).double() - axis[:, None] * axis)
    between = Between("mass properties", "closed form of a slender rod, cut into 400 pieces")
    return [
        between.of_largest("inertia about the centre of gravity, kg m^2", ours.inertia, theirs, 1e-10, "rounding"),
        between.of_largest("centre of gravity, m", ours.center_of_gravity, middle, 1e-12, "rounding"),
    ]


def _friction() -> Comparison:
    """0.242/sqrt(Cf) = log10(Re Cf), solved by Newton's method."""
    theirs = []
    reynolds = (1e6, 3e6, 1e7, 1e8, 1e9)
    for number in reynolds:
        cf = 0.003
        for _ in range(60):
            gap = 0.242 / math.sqrt(cf) - math.log10(number * cf)
            cf -= gap / (-0.121 * cf**-1.5 - 1.0 / (cf * math.log(10.0)))
        theirs.append(cf)
    ours = turbulent_friction_coefficient(_tensor(reynolds), _tensor(0.0))
    return Between("turbulent skin friction", "Schoenherr's implicit law").relative(
        "mean friction coefficient, Reynolds number 1e6 to 1e9", ours, theirs, 0.03, "two fits of the same measurements"
    )


def _tensor(value: object) -> Tensor:
    return torch.as_tensor(value, dtype=torch.float64)
