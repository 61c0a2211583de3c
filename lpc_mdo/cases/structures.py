"""Case files of `lpc-mdo analyze structures`: a frame of pipes in, displacements, stress and mass out."""

import json
import math
from pathlib import Path
from typing import Annotated, Any, Literal

import torch
from pydantic import Field, model_validator
from torch import Tensor

from lpc_mdo.cases.files import IGNORED, IGNORED_PREFIX, Positive, Strict, is_finite, positive, validated, within
from lpc_mdo.files.read import ConfigurationError, read_json
from lpc_mdo.structures.frame import BeamSections, FrameSolution, Topology, element_axes, solve_frame

NOTES = IGNORED | {"units", "theory", "suggested_tolerance"}

MOST_POINTS, MOST_SEGMENTS = 500, 2000  # one matrix holds the whole frame: 72 MB

Place = Annotated[float, within(-1e5, 1e5)]  # m
Index = Annotated[int, Field(ge=0, le=100_000, strict=True)]
Freedom = Annotated[int, Field(ge=0, le=5, strict=True)]
PoissonRatio = Annotated[float, Field(ge=0.0, lt=0.5, strict=True)]


class Pipe(Strict):
    """Constants follow from radius and thickness; where they are given too, they must agree to the digits of the files."""

    type: Literal["pipe"]
    outer_radius_m: Annotated[float, Field(gt=0.0, le=1e3, strict=True)]
    thickness_m: Positive
    area_m2: Positive | None = None
    second_moment_m4: Positive | None = None
    torsion_constant_m4: Positive | None = None

    @property
    def inner_radius(self) -> float:
        return self.outer_radius_m - self.thickness_m

    @property
    def area(self) -> float:
        return math.pi * (self.outer_radius_m**2 - self.inner_radius**2)

    @property
    def second_moment(self) -> float:
        return math.pi / 4.0 * (self.outer_radius_m**4 - self.inner_radius**4)

    @model_validator(mode="after")
    def _is_a_pipe(self) -> "Pipe":
        if self.thickness_m >= self.outer_radius_m:
            raise ValueError(
                f"thickness_m = {self.thickness_m} is not allowed; it must be below outer_radius_m = {self.outer_radius_m}"
            )
        constants = {
            "area_m2": self.area,
            "second_moment_m4": self.second_moment,
            "torsion_constant_m4": 2.0 * self.second_moment,
        }
        for name, value in constants.items():
            given = getattr(self, name)
            if given is not None and not math.isclose(given, value, rel_tol=1e-6):
                raise ValueError(f"{name} = {given} is not allowed; radius and thickness give {value:.7g}")
        return self


class Load(Strict):
    point: Index
    dof: Freedom
    value: Annotated[float, within(-1e12, 1e12)]


class Variant(Strict):
    """The shear coefficient divides shear force by shear area; that of a thick-walled pipe where it is left out."""

    nu: PoissonRatio
    shear_coefficient: Positive | None = None

    @model_validator(mode="before")
    @classmethod
    def _without_figures_of_other_codes(cls, data: Any) -> Any:
        return {k: v for k, v in data.items() if not isinstance(v, dict)} if isinstance(data, dict) else data


class FrameInputs(Strict):
    points: list[tuple[Place, Place, Place]] = Field(min_length=2, max_length=MOST_POINTS)
    segments: list[tuple[Index, Index]] = Field(min_length=1, max_length=MOST_SEGMENTS)
    section: Pipe
    E: Annotated[float, positive(1e13)]  # Pa: ten diamonds
    density_for_mass: Annotated[float, positive(1e5)]
    loads: list[Load] = Field(max_length=100 * MOST_POINTS)
    fixed_points: list[Index] = Field(min_length=1, max_length=MOST_POINTS)
    nu: PoissonRatio | None = None
    shear_coefficient: Positive | None = None
    variants: dict[str, Variant] | None = None

    @model_validator(mode="after")
    def _has_one_material_or_variants(self) -> "FrameInputs":
        if self.nu is None and not self.variants:
            raise ValueError("nu is missing")
        if self.variants and (self.nu is not None or self.shear_coefficient is not None):
            raise ValueError("nu or shear_coefficient is not allowed beside variants, which have their own")
        return self

    @model_validator(mode="after")
    def _hangs_together(self) -> "FrameInputs":
        count = len(self.points)
        named = [(f"segments[{i}]", end) for i, segment in enumerate(self.segments) for end in segment]
        named += [(f"loads[{i}].point", load.point) for i, load in enumerate(self.loads)]
        named += [(f"fixed_points[{i}]", point) for i, point in enumerate(self.fixed_points)]
        for place, point in named:
            if point >= count:
                raise ValueError(f"{place} = {point} is not allowed; it must lie between 0 and {count - 1}")
        for i, (a, b) in enumerate(self.segments):
            if self.points[a] == self.points[b]:
                raise ValueError(f"segments[{i}] = {[a, b]} is not allowed; its ends coincide")
        known: dict[frozenset[int], int] = {}
        for i, segment in enumerate(self.segments):
            if (first := known.setdefault(frozenset(segment), i)) < i:
                raise ValueError(f"segments[{i}] = {list(segment)} is invalid: it must differ from segments[{first}]")
        reached, front = set(), set(self.fixed_points)
        while front:
            reached |= front
            front = {p for segment in self.segments if reached & set(segment) for p in segment} - reached
        if loose := sorted(set(range(count)) - reached):
            raise ValueError(f"points[{loose[0]}] is not allowed; no chain of segments ties it to a fixed point")
        return self


def pipe_shear_coefficient(nu: float, section: Pipe) -> float:
    """Source: Cowper (1966), hollow circle."""
    m2 = (section.inner_radius / section.outer_radius_m) ** 2
    ring = (1.0 + m2) ** 2
    return 6.0 * (1.0 + nu) * ring / ((7.0 + 6.0 * nu) * ring + (20.0 + 12.0 * nu) * m2)


def _up(points: Tensor, elements: Tensor) -> Tensor:
    """Direction (element, 3) of the local z axis: as near to z as possible, to x for upright segments."""
    along = torch.nn.functional.normalize(points[elements[:, 1]] - points[elements[:, 0]], dim=-1)
    z, x = torch.eye(3, dtype=points.dtype)[[2, 0]]
    return torch.where(along[:, 2:].abs() > 0.99, x, z)


def _solve(inputs: FrameInputs, variant: Variant) -> tuple[Tensor, Topology, BeamSections, FrameSolution]:
    points = torch.tensor(inputs.points, dtype=torch.float64)
    elements = torch.tensor(inputs.segments)
    is_fixed = torch.zeros(len(points), 6, dtype=torch.bool)
    is_fixed[inputs.fixed_points] = True
    topology = Topology(elements, _up(points, elements), is_fixed)
    section, ones = inputs.section, torch.ones(len(elements), dtype=points.dtype)
    coefficient = variant.shear_coefficient or pipe_shear_coefficient(variant.nu, section)
    area, moment = section.area * ones, section.second_moment * ones
    sections = BeamSections(area, moment, moment, 2.0 * moment, coefficient * area, coefficient * area)
    loads = torch.zeros(1, len(points), 6, dtype=points.dtype)
    for load in inputs.loads:
        loads[0, load.point, load.dof] += load.value
    shear_modulus = inputs.E / (2.0 * (1.0 + variant.nu))
    return points, topology, sections, solve_frame(points, topology, sections, loads, inputs.E, shear_modulus)


def analyze_frame(inputs: FrameInputs, variant: Variant) -> dict[str, Any]:
    """Displacements and reactions by point (N, N m, m, rad), fibre stress (Pa), mass (kg) and centre of gravity (m).

    The largest fibre stress is that of the resultant of both bending moments; beside it stands the largest at the four
    recovery points of a NASTRAN bar, on its two local axes, for comparison with other codes. One element a segment: exact
    for loads at points.
    """
    points, topology, sections, solution = _solve(inputs, variant)
    ends = solution.at_ends[0].abs()
    axial = ends[..., 0] / inputs.section.area
    per_moment = inputs.section.outer_radius_m / inputs.section.second_moment
    resultant, on_axes = torch.hypot(ends[..., 4], ends[..., 5]), ends[..., 4:].amax(-1)
    length, _ = element_axes(points, topology)
    mass = inputs.density_for_mass * sections.area * length
    middle = points[topology.elements].mean(1)
    return {
        "displacement": {str(i): row for i, row in enumerate(solution.displacement[0].tolist())},
        "reactions": {str(i): solution.reactions[0, i].tolist() for i in sorted(set(inputs.fixed_points))},
        "max_abs_fibre_stress": float((axial + resultant * per_moment).max()),
        "max_abs_fibre_stress_at_recovery_points": float((axial + on_axes * per_moment).max()),
        "mass": float(mass.sum()),
        "cg": ((mass[:, None] * middle).sum(0) / mass.sum()).tolist(),
    }


def analyze_case(case: Any, file: Path) -> dict[str, Any]:
    """Results of one case, by name of the variant where it has `variants`.

    The frame stands under `inputs` or, as in the reference files, at the top level; figures of other codes within a
    variant are passed over. Raises ConfigurationError with one sentence on what is wrong.
    """
    if not isinstance(case, dict):
        raise ConfigurationError(f"{file}: inputs is missing.")
    frame = {key: value for key, value in case.items() if key not in NOTES and not key.startswith(IGNORED_PREFIX)}
    where = "inputs" if "inputs" in frame else ""
    if where and len(frame) > 1:
        other = min(frame.keys() - {"inputs"})
        raise ConfigurationError(f"{file}: {other} is not a known key; beside inputs there must be notes alone.")
    inputs = validated(FrameInputs, frame["inputs"] if where else frame, file, where)
    try:
        if inputs.variants:
            results = {name: analyze_frame(inputs, variant) for name, variant in inputs.variants.items()}
        else:
            results = analyze_frame(inputs, Variant(nu=inputs.nu, shear_coefficient=inputs.shear_coefficient))
    except ValueError as error:
        raise ConfigurationError(f"{file}: {error}.") from None
    if not is_finite(results):
        raise ConfigurationError(f"{file}: inputs are not allowed; they give results that are not finite.")
    return {"results": results}


def analyze_file(file: Path) -> str:
    """Results of a case file as JSON text."""
    return json.dumps(analyze_case(read_json(file), file), indent=1, allow_nan=False)
