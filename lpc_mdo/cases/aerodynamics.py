"""Cases of airfoils, rotors and wings."""

from pathlib import Path
from typing import Annotated, Any, Literal

import torch
from pydantic import Field, PrivateAttr, StrictBool, ValidationInfo, model_validator
from torch import Tensor

from lpc_mdo.airfoils.sections import naca_camber_line
from lpc_mdo.cases.files import RPM, Angle, NotNegative, Positive, Strict, positive, within
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum, station_radii
from lpc_mdo.disciplines.far_field import far_field
from lpc_mdo.disciplines.stability_derivatives import air_velocity
from lpc_mdo.disciplines.vortex_clearance import LEAST_PASSAGE, wake_passages
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice
from lpc_mdo.numerics.present import present
from lpc_mdo.numerics.spacing import cosine_spacing, uniform_spacing
from lpc_mdo.numerics.tensors import tensor
from lpc_mdo.reporting.flag import Flag, extrapolated_share, rotor_flags, stated, why_not_propelling
from lpc_mdo.surrogates.airfoil import AirfoilPolar
from lpc_mdo.surrogates.airfoil_names import resolve_airfoil

LARGEST = 1e4  # m and m/s, of anything about a wing, and m/s of a rotor


def _polar(name: str, key: str, info: ValidationInfo) -> AirfoilPolar:
    """The polar of a name in a case file, whose paths are relative to its folder. Raises ValueError that names the key."""
    try:
        return resolve_airfoil(name, (info.context or {}).get("folder", Path()))
    except ValueError as error:
        what = str(error).removeprefix(f"airfoil = {name!r} is invalid: ")
        raise ValueError(f"{key} = {name!r} is invalid: {what}") from None


class AirfoilInputs(Strict):
    """`alpha_deg` takes any angle; reynolds and mach, one for all or one for each, must lie where the polars do."""

    airfoil: str  # NACA designation or other name of a shipped polar, card of a trained one, or its coordinate file
    alpha_deg: list[Annotated[float, within(-180.0, 180.0)]] = Field(min_length=1, max_length=100_000)
    reynolds: list[Positive]
    mach: list[NotNegative]
    _section: AirfoilPolar = PrivateAttr()

    @model_validator(mode="before")
    @classmethod
    def _repeat_single_values(cls, data: Any) -> Any:
        if not isinstance(data, dict) or not isinstance(alpha := data.get("alpha_deg"), list):
            return data
        single = {k: v for k, v in data.items() if k in ("reynolds", "mach") and not isinstance(v, list)}
        return data | {name: [value] * len(alpha) for name, value in single.items()}

    @model_validator(mode="after")
    def _has_polars(self, info: ValidationInfo) -> "AirfoilInputs":
        self._section = _polar(self.airfoil, "airfoil", info)
        trained = self._section.training_range
        for name, (lower, upper) in (("reynolds", trained.reynolds), ("mach", trained.mach)):
            values = getattr(self, name)
            if len(values) != len(self.alpha_deg):
                raise ValueError(
                    f"{name} has {len(values)} values, alpha_deg has {len(self.alpha_deg)}; it must have one or as many"
                )
            for value in values:
                if not lower <= value <= upper:
                    raise ValueError(
                        f"{name} = {value:g} is not allowed; the polars of {self.airfoil} lie between {lower:g} and {upper:g}"
                    )
        return self


def analyze_airfoil(inputs: AirfoilInputs, conditions: list[Any], mesh: Any) -> dict[str, Any]:
    polar = inputs._section
    query = (torch.deg2rad(tensor(inputs.alpha_deg)), tensor(inputs.reynolds), tensor(inputs.mach))
    cl, cd = polar(*query)
    return {"cl": cl.tolist(), "cd": cd.tolist(), "extrapolated": polar.extrapolated(*query).tolist()}


class RotorInputs(Strict):
    radius_m: Annotated[float, positive(100.0)]
    hub_radius_m: Annotated[float, positive(100.0)]
    blades: Annotated[int, within(1, 12)]
    rho: Annotated[float, positive(2000.0)]  # water, too
    stations: Annotated[int, within(3, 1000)]
    station_rule: str = ""
    chord_m: tuple[Annotated[float, positive(100.0)], Annotated[float, positive(100.0)]]
    twist_deg: tuple[Annotated[float, within(-180.0, 180.0)], Annotated[float, within(-180.0, 180.0)]]
    linear: str = ""
    polar: str = "naca4412"
    cl0: Annotated[float, within(-5.0, 5.0)] | None = None
    cla_per_rad: Annotated[float, within(-20.0, 20.0)] | None = None
    cd0: Annotated[float, positive(10.0)] | None = None
    k: Annotated[float, within(0.0, 100.0)] | None = None
    speed_of_sound_m_per_s: Annotated[float, positive(1e6)] = 340.3
    dynamic_viscosity_Pa_s: Annotated[float, positive(10.0)] = 1.79e-5
    _section: AirfoilPolar | None = PrivateAttr(None)

    @model_validator(mode="after")
    def _is_consistent(self, info: ValidationInfo) -> "RotorInputs":
        if self.hub_radius_m >= self.radius_m:
            raise ValueError(
                f"hub_radius_m = {self.hub_radius_m} is not allowed; it must be below radius_m = {self.radius_m}"
            )
        if max(self.chord_m) > self.radius_m:
            raise ValueError(
                f"chord_m = {list(self.chord_m)} is invalid: it must be at most radius_m = {self.radius_m}"
            )
        analytic = [self.cl0, self.cla_per_rad, self.cd0, self.k]
        if all(v is None for v in analytic):
            self._section = _polar(self.polar, "polar", info)
        elif any(v is None for v in analytic):
            raise ValueError("polar: give cl0, cla_per_rad, cd0 and k, or none of them and name an airfoil")
        return self


class RotorCondition(Strict):
    V_m_per_s: Annotated[float, within(-LARGEST, LARGEST)]
    rpm: Annotated[float, positive(1e7)]
    hub_loss: StrictBool = False


def analyze_rotor(inputs: RotorInputs, conditions: list[RotorCondition], mesh: Any) -> list[dict[str, Any]]:
    """`flags` says where a result lies outside the theory's regime; what is undefined there is null, with the reason."""

    def analytic(alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        cl = present(inputs.cl0, "cl0") + present(inputs.cla_per_rad, "cla_per_rad") * alpha
        return cl, present(inputs.cd0, "cd0") + present(inputs.k, "k") * cl**2

    named = inputs._section
    radius, hub = tensor(inputs.radius_m), tensor(inputs.hub_radius_m)
    r, _ = station_radii(radius, hub, inputs.stations)
    share = (r - hub) / (radius - hub)
    chord = inputs.chord_m[0] + (inputs.chord_m[1] - inputs.chord_m[0]) * share
    twist = torch.deg2rad(inputs.twist_deg[0] + (inputs.twist_deg[1] - inputs.twist_deg[0]) * share)
    rotor = Rotor(radius, hub, chord, twist, tensor(float(inputs.blades)))
    results = []
    for condition in conditions:
        inflow = Inflow(
            tensor(condition.V_m_per_s),
            tensor(condition.rpm * RPM),
            tensor(inputs.rho),
            tensor(inputs.speed_of_sound_m_per_s),
            tensor(inputs.dynamic_viscosity_Pa_s),
        )
        loads = blade_element_momentum(rotor, inflow, named or analytic, has_hub_loss=condition.hub_loss)
        extrapolated = extrapolated_share(loads, named) if named else tensor(0.0)
        reason = why_not_propelling(loads)
        results.append(
            {
                **condition.model_dump(),
                "thrust_N": float(loads.thrust),
                "torque_N_m": float(loads.torque),
                "power_W": float(loads.power),
                "figure_of_merit": None if reason else float(loads.figure_of_merit),
                "efficiency": None if reason else float(loads.propulsive_efficiency),
                "tip_mach": float(loads.tip_mach),
                "is_tip_fast": bool(loads.is_tip_fast),
                "is_vortex_ring": bool(loads.is_vortex_ring),
                "is_windmilling": bool(loads.is_windmilling),
                "extrapolated_share": float(extrapolated),
                **stated(
                    rotor_flags(loads, extrapolated, ""),
                    {"figure_of_merit": reason, "efficiency": reason} if reason else {},
                ),
                "stations": {
                    "r_m": loads.station_radius.tolist(),
                    "dT_dr_N_per_m": loads.thrust_per_length.tolist(),
                    "dQ_dr_Nm_per_m": loads.torque_per_length.tolist(),
                    "angle_of_attack_deg": torch.rad2deg(loads.angle_of_attack).tolist(),
                },
            }
        )
    return results


SMALLEST = 1e-3  # m, of half a span
MOST_PANELS = 5000  # of a wing case: 0.2 GB for each matrix of their influence
DRAG_COUNT = 1e-4
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
            | stated(_wing_flags(near, far, [(names[a], names[b]) for a, b in wake_passages(meshes, wake[i])]))
        )
    return results


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
