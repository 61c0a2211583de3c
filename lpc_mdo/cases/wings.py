"""Cases of wings."""

from typing import Annotated, Any, Literal

import torch
from pydantic import Field, model_validator
from torch import Tensor

from lpc_mdo.airfoils.sections import naca_camber_line
from lpc_mdo.cases.files import Angle, Strict, positive, within
from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.disciplines.far_field import far_field
from lpc_mdo.disciplines.stability_derivatives import air_velocity
from lpc_mdo.disciplines.vortex_clearance import LEAST_PASSAGE, wake_passages
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice
from lpc_mdo.numerics.spacing import cosine_spacing, uniform_spacing
from lpc_mdo.numerics.tensors import tensor
from lpc_mdo.reporting.flag import Flag, stated

LARGEST = 1e4  # m and m/s
SMALLEST = 1e-3  # m, of half a span
MOST_PANELS = 5000  # of a wing case: 0.2 GB for each matrix of their influence
DRAG_COUNT = 1e-4
LARGEST_MACH = 0.3  # where Prandtl and Glauert's factor is 1.05
LARGEST_INCIDENCE = 15.0  # deg, assumed: sections stall at 12 to 18 (Abbott and von Doenhoff, 1959, appendix IV)
Place = Annotated[float, within(-LARGEST, LARGEST)]
Size = Annotated[float, positive(LARGEST)]
Sideslip = Annotated[float, within(-89.0, 89.0)]  # at 90 no direction of lift is left


class WingSurface(Strict):
    name: str
    camber: str = Field(
        pattern="^(none|NACA (00|[1-9][1-9])[0-9]{2})$", description="'none' or a NACA section, e.g. 'NACA 4412'"
    )
    root: tuple[Place, Place, Place, Size]
    tip: tuple[Place, Place, Place, Size]
    keys: str = ""

    @model_validator(mode="after")
    def _meets_its_mirror_image(self) -> "WingSurface":
        if self.root[1] != 0.0:
            raise ValueError(f"root[1] = {self.root[1]} is not allowed; it must be 0, where the mirror image begins")
        if self.tip[1] <= 0.0:
            raise ValueError(f"tip[1] = {self.tip[1]} is not allowed; it must be above 0")
        if self.tip[1] < SMALLEST:
            raise ValueError(f"tip[1] = {self.tip[1]:g} is invalid: it must be at least {SMALLEST:g}")
        return self


class WingReference(Strict):
    S: Annotated[float, positive(LARGEST**2)]
    c: Size
    b: Size
    point: tuple[Place, Place, Place]


class WingInputs(Strict):
    V_m_per_s: Size
    rho_kg_per_m3: Annotated[float, positive(2000.0)]
    surfaces_half: list[WingSurface] = Field(min_length=1)
    reference: WingReference
    conditions_alpha_beta_deg: list[tuple[Angle, Sideslip]] = Field(min_length=1)
    mean_line: str = ""

    @model_validator(mode="after")
    def _names_differ(self) -> "WingInputs":
        names = [surface.name for surface in self.surfaces_half]
        for k, name in enumerate(names):
            if name in names[:k]:
                raise ValueError(
                    f"surfaces_half[{k}].name = {name!r} is invalid: it must differ from the other surfaces'"
                )
        return self


class WingMesh(Strict):
    chordwise_panels: Annotated[int, within(1, 64)] = 4
    spanwise_panels_half: Annotated[int, within(1, 200)] = 20
    spanwise_spacing: Literal["uniform", "cosine"] = "uniform"
    wake_core: Annotated[float, within(0.0, 10.0)] = 1.0  # as in the main problem; codes to compare with may have none


def wing_mesh(surface: WingSurface, mesh: WingMesh) -> Tensor:
    """Mesh (chordwise + 1, 2 spanwise + 1, 3) of a straight-tapered surface and its mirror image.

    Cosine spacing is that of the whole span, dense at the tips.
    """
    spacing = cosine_spacing if mesh.spanwise_spacing == "cosine" else uniform_spacing
    across = 2.0 * spacing(2 * mesh.spanwise_panels_half) - 1.0
    across = 0.5 * (across - across.flip(0))  # the root falls on the plane of symmetry to the last digit
    along = torch.linspace(0.0, 1.0, mesh.chordwise_panels + 1, dtype=torch.float64)
    root, tip = tensor(surface.root), tensor(surface.tip)
    x_le, y, z_le, chord = (root + (tip - root) * across.abs()[:, None]).unbind(-1)
    line = torch.as_tensor(naca_camber_line(surface.camber[-4:] if "NACA" in surface.camber else "0012", along.numpy()))
    x = x_le + along[:, None] * chord
    z = z_le + line[:, None] * chord
    return torch.stack([x, (y * torch.sign(across)).expand_as(x), z], dim=-1)


def analyze_wing(inputs: WingInputs, conditions: list[Any], mesh: WingMesh) -> list[dict[str, Any]]:
    """Coefficients of every condition, the drag from near and far field, and flags where they cannot be trusted.

    Wakes stay in the plane of symmetry in sideslip, too, as those of the code that made the reference cases. Raises
    ValueError for more panels than memory is meant for, and what `vortex_lattice` refuses.
    """
    panels = 2 * mesh.chordwise_panels * mesh.spanwise_panels_half * len(inputs.surfaces_half)
    if panels > MOST_PANELS:
        raise ValueError(
            f"mesh is invalid: all surfaces together have {panels} panels; at most {MOST_PANELS} are allowed"
        )
    meshes = [wing_mesh(surface, mesh) for surface in inputs.surfaces_half]
    angles = inputs.conditions_alpha_beta_deg
    at_once = max(1, MOST_PANELS**2 // panels**2)  # no more memory than the largest lattice takes
    return [
        result
        for start in range(0, len(angles), at_once)
        for result in _wing_results(inputs, mesh, meshes, angles[start : start + at_once])
    ]


def _wing_results(
    inputs: WingInputs, mesh: WingMesh, meshes: list[Tensor], angles: list[tuple[float, float]]
) -> list[dict[str, Any]]:
    alpha, beta = torch.deg2rad(tensor(angles)).unbind(-1)
    velocity = air_velocity(tensor(inputs.V_m_per_s), alpha, beta)
    wake = air_velocity(tensor(1.0), alpha, torch.zeros_like(beta))
    reference, density = inputs.reference, tensor(inputs.rho_kg_per_m3)
    names = [surface.name for surface in inputs.surfaces_half]
    loads = vortex_lattice(
        meshes, velocity, density, tensor(reference.point), wake_direction=wake, wake_core=mesh.wake_core, names=names
    )
    behind = far_field(loads.circulation, [part[-1] for part in meshes], velocity, density, wake_core=mesh.wake_core)
    force = 0.5 * inputs.rho_kg_per_m3 * inputs.V_m_per_s**2 * reference.S
    results = []
    for i, (alpha_deg, beta_deg) in enumerate(angles):
        near, far = float(loads.induced_drag[i]) / force, float(behind.induced_drag[i]) / force
        results.append(
            {
                "alpha_deg": alpha_deg,
                "beta_deg": beta_deg,
                "CL": float(loads.lift[i]) / force,
                "CDi": near,
                "CDi_far_field": far,
                "CDi_difference": near - far,
                "Cm": float(loads.moment[i, 1]) / (force * reference.c),
                "Cl_roll_body": -float(loads.moment[i, 0]) / (force * reference.b),
                "Cn_body": -float(loads.moment[i, 2]) / (force * reference.b),
                "span_load": {name: loads.panel_force[k][i, ..., 2].sum(0).tolist() for k, name in enumerate(names)},
            }
            | stated(
                [
                    *_regime_flags(inputs.V_m_per_s, alpha_deg),
                    *_wing_flags(near, far, [(names[a], names[b]) for a, b in wake_passages(meshes, wake[i])]),
                ]
            )
        )
    return results


def _regime_flags(speed: float, alpha_deg: float) -> list[Flag]:
    """Where the flow is not the incompressible, attached one of a lattice."""
    flags, mach = [], speed / float(standard_atmosphere(tensor(0.0)).speed_of_sound)  # a case names no temperature
    if mach > LARGEST_MACH:
        words = f"Mach {mach:.3g} at sea level: the lattice knows no compressibility, which raises lift by 5 % at {LARGEST_MACH:g}"
        flags.append(Flag("compressible", "", mach, LARGEST_MACH, words))
    if abs(alpha_deg) > LARGEST_INCIDENCE:
        words = f"{alpha_deg:g} degrees of incidence: the lattice knows no stall, which sections meet at 12 to 18"
        flags.append(Flag("stall_unknown", "", alpha_deg, LARGEST_INCIDENCE, words))
    return flags


def _wing_flags(near: float, far: float, passages: list[tuple[str, str]]) -> list[Flag]:
    flags = [
        Flag(
            "wake_passage",
            met,
            None,
            LEAST_PASSAGE,
            f"the wake of {shedding} passes through {met}: the load there depends on the mesh and on wake_core",
        )
        for shedding, met in passages
    ]
    limit = max(DRAG_COUNT, 0.1 * max(abs(near), abs(far)))
    if abs(near - far) > limit:
        words = (
            f"CDi = {near:.3g} and CDi_far_field = {far:.3g} differ by more than a tenth: neither is to be trusted here"
        )
        flags.append(Flag("induced_drag", "", near - far, limit, words))
    return flags
