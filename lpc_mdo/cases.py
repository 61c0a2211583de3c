"""Case files of `lpc-mdo analyze`: one discipline, JSON in, JSON out."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import torch
from pydantic import BaseModel, ConfigDict, Field, StrictBool, ValidationError, model_validator
from torch import Tensor

from lpc_mdo.config import ConfigurationError, read_json
from lpc_mdo.disciplines import equivalent_circuit, motor, sound
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum, station_radii
from lpc_mdo.disciplines.tonal_noise import BladeLoading, barry_magliozzi
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice
from lpc_mdo.faults import fault, telling
from lpc_mdo.geometry.sections import naca_camber_line
from surrogates.airfoil import load_airfoil

RPM = math.pi / 30.0
TABLE_PANELS = 24  # of each segment of a battery case
IGNORED = {"description", "source", "sources", "method", "axes", "note", "title", "results"}
IGNORED_PREFIX = "difference_between"


def _within(lower: float, upper: float) -> Any:
    return Field(ge=lower, le=upper, strict=True)


Finite = Annotated[float, Field(strict=True)]
Positive = Annotated[float, Field(gt=0.0, strict=True)]
NotNegative = Annotated[float, Field(ge=0.0, strict=True)]
Share = Annotated[float, _within(0.0, 1.0)]
Angle = Annotated[float, _within(-90.0, 90.0)]
Pair = tuple[Finite, Finite]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _tensor(values: object) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)


class AirfoilInputs(_Strict):
    """`alpha_deg` takes any angle; reynolds and mach, one for all or one for each, must lie where the polars do."""

    airfoil: str  # shipped by name, or the card of a trained one
    alpha_deg: list[Annotated[float, _within(-180.0, 180.0)]] = Field(min_length=1)
    reynolds: list[Positive]
    mach: list[NotNegative]

    @model_validator(mode="before")
    @classmethod
    def _repeat_single_values(cls, data: Any) -> Any:
        if not isinstance(data, dict) or not isinstance(alpha := data.get("alpha_deg"), list):
            return data
        single = {k: v for k, v in data.items() if k in ("reynolds", "mach") and not isinstance(v, list)}
        return data | {name: [value] * len(alpha) for name, value in single.items()}

    @model_validator(mode="after")
    def _has_polars(self) -> "AirfoilInputs":
        trained = load_airfoil(self.airfoil).training_range
        for name, (lower, upper) in (("reynolds", trained.reynolds), ("mach", trained.mach)):
            values = getattr(self, name)
            if len(values) != len(self.alpha_deg):
                raise ValueError(f"{name} has {len(values)} values, alpha_deg has {len(self.alpha_deg)}")
            for value in values:
                if not lower <= value <= upper:
                    raise ValueError(
                        f"{name} = {value:g} is not allowed; the polars of {self.airfoil} lie between {lower:g} and {upper:g}"
                    )
        return self


def analyze_airfoil(inputs: AirfoilInputs, conditions: list[Any], mesh: Any) -> dict[str, Any]:
    polar = load_airfoil(inputs.airfoil)
    query = (torch.deg2rad(_tensor(inputs.alpha_deg)), _tensor(inputs.reynolds), _tensor(inputs.mach))
    cl, cd = polar(*query)
    return {"cl": cl.tolist(), "cd": cd.tolist(), "extrapolated": polar.extrapolated(*query).tolist()}


class RotorInputs(_Strict):
    radius_m: Positive
    hub_radius_m: Positive
    blades: Annotated[int, _within(1, 12)]
    rho: Positive
    stations: Annotated[int, _within(3, 1000)]
    station_rule: str = ""
    chord_m: tuple[Positive, Positive]
    twist_deg: Pair
    linear: str = ""
    polar: str = "naca4412"
    cl0: Finite | None = None
    cla_per_rad: Finite | None = None
    cd0: Positive | None = None
    k: Finite | None = None
    speed_of_sound_m_per_s: Positive = 340.3
    dynamic_viscosity_Pa_s: Positive = 1.79e-5

    @model_validator(mode="after")
    def _is_consistent(self) -> "RotorInputs":
        if self.hub_radius_m >= self.radius_m:
            raise ValueError(
                f"hub_radius_m = {self.hub_radius_m} is not allowed; it must be below radius_m = {self.radius_m}"
            )
        analytic = [self.cl0, self.cla_per_rad, self.cd0, self.k]
        if any(v is None for v in analytic) and not (all(v is None for v in analytic) and self.polar == "naca4412"):
            raise ValueError("polar: give cl0, cla_per_rad, cd0 and k, or name the airfoil 'naca4412'")
        return self


class RotorCondition(_Strict):
    V_m_per_s: Finite
    rpm: Positive
    hub_loss: StrictBool = False


def analyze_rotor(inputs: RotorInputs, conditions: list[RotorCondition], mesh: Any) -> list[dict[str, Any]]:
    def analytic(alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        cl = inputs.cl0 + inputs.cla_per_rad * alpha
        return cl, inputs.cd0 + inputs.k * cl**2

    polar = load_airfoil("naca4412") if inputs.cl0 is None else analytic
    radius, hub = _tensor(inputs.radius_m), _tensor(inputs.hub_radius_m)
    r, _ = station_radii(radius, hub, inputs.stations)
    share = (r - hub) / (radius - hub)
    chord = inputs.chord_m[0] + (inputs.chord_m[1] - inputs.chord_m[0]) * share
    twist = torch.deg2rad(inputs.twist_deg[0] + (inputs.twist_deg[1] - inputs.twist_deg[0]) * share)
    rotor = Rotor(radius, hub, chord, twist, _tensor(float(inputs.blades)))
    results = []
    for condition in conditions:
        inflow = Inflow(
            _tensor(condition.V_m_per_s),
            _tensor(condition.rpm * RPM),
            _tensor(inputs.rho),
            _tensor(inputs.speed_of_sound_m_per_s),
            _tensor(inputs.dynamic_viscosity_Pa_s),
        )
        loads = blade_element_momentum(rotor, inflow, polar, has_hub_loss=condition.hub_loss)
        results.append(
            {
                **condition.model_dump(),
                "thrust_N": float(loads.thrust),
                "torque_N_m": float(loads.torque),
                "power_W": float(loads.power),
                "figure_of_merit": float(loads.figure_of_merit),
                "efficiency": float(loads.propulsive_efficiency),
                "is_vortex_ring": bool(loads.is_vortex_ring),
                "is_windmilling": bool(loads.is_windmilling),
                "stations": {
                    "r_m": loads.station_radius.tolist(),
                    "dT_dr_N_per_m": loads.thrust_per_length.tolist(),
                    "dQ_dr_Nm_per_m": loads.torque_per_length.tolist(),
                    "angle_of_attack_deg": torch.rad2deg(loads.angle_of_attack).tolist(),
                },
            }
        )
    return results


class WingSurface(_Strict):
    name: str
    camber: str = Field(
        pattern="^(none|NACA (00|[1-9][1-9])[0-9]{2})$", description="'none' or a NACA section, e.g. 'NACA 4412'"
    )
    root: tuple[Finite, Finite, Finite, Positive]
    tip: tuple[Finite, Finite, Finite, Positive]
    keys: str = ""

    @model_validator(mode="after")
    def _meets_its_mirror_image(self) -> "WingSurface":
        if self.root[1] != 0.0:
            raise ValueError(f"root[1] = {self.root[1]} is not allowed; it must be 0, where the mirror image begins")
        if self.tip[1] <= 0.0:
            raise ValueError(f"tip[1] = {self.tip[1]} is not allowed; it must be above 0")
        return self


class WingReference(_Strict):
    S: Positive
    c: Positive
    b: Positive
    point: tuple[Finite, Finite, Finite]


class WingInputs(_Strict):
    V_m_per_s: Positive
    rho_kg_per_m3: Positive
    surfaces_half: list[WingSurface] = Field(min_length=1)
    reference: WingReference
    conditions_alpha_beta_deg: list[tuple[Angle, Angle]] = Field(min_length=1)
    mean_line: str = ""


class WingMesh(_Strict):
    chordwise_panels: Annotated[int, _within(1, 64)] = 4
    spanwise_panels_half: Annotated[int, _within(1, 200)] = 20


def wing_mesh(surface: WingSurface, mesh: WingMesh) -> Tensor:
    """Uniform mesh (chordwise + 1, 2 spanwise + 1, 3) of a straight-tapered surface and its mirror image."""
    across = torch.linspace(-1.0, 1.0, 2 * mesh.spanwise_panels_half + 1, dtype=torch.float64)
    along = torch.linspace(0.0, 1.0, mesh.chordwise_panels + 1, dtype=torch.float64)
    root, tip = _tensor(surface.root), _tensor(surface.tip)
    x_le, y, z_le, chord = (root + (tip - root) * across.abs()[:, None]).unbind(-1)
    line = torch.as_tensor(naca_camber_line(surface.camber[-4:] if "NACA" in surface.camber else "0012", along.numpy()))
    x = x_le + along[:, None] * chord
    z = z_le + line[:, None] * chord
    return torch.stack([x, (y * torch.sign(across)).expand_as(x), z], dim=-1)


def analyze_wing(inputs: WingInputs, conditions: list[Any], mesh: WingMesh) -> list[dict[str, Any]]:
    """Wakes stay in the plane of symmetry in sideslip, too, as those of the code that made the reference cases."""
    alpha, beta = torch.deg2rad(_tensor(inputs.conditions_alpha_beta_deg)).unbind(-1)
    direction = torch.stack(
        [torch.cos(alpha) * torch.cos(beta), -torch.sin(beta), torch.sin(alpha) * torch.cos(beta)], dim=-1
    )
    meshes = [wing_mesh(surface, mesh) for surface in inputs.surfaces_half]
    reference = inputs.reference
    loads = vortex_lattice(
        meshes,
        inputs.V_m_per_s * direction,
        _tensor(inputs.rho_kg_per_m3),
        _tensor(reference.point),
        wake_direction=torch.stack([torch.cos(alpha), torch.zeros_like(alpha), torch.sin(alpha)], dim=-1),
    )
    force = 0.5 * inputs.rho_kg_per_m3 * inputs.V_m_per_s**2 * reference.S
    return [
        {
            "alpha_deg": angles[0],
            "beta_deg": angles[1],
            "CL": float(loads.lift[i]) / force,
            "CDi": float(loads.induced_drag[i]) / force,
            "Cm": float(loads.moment[i, 1]) / (force * reference.c),
            "Cl_roll_body": -float(loads.moment[i, 0]) / (force * reference.b),
            "Cn_body": -float(loads.moment[i, 2]) / (force * reference.b),
            "span_load": {
                surface.name: loads.panel_force[k][i, ..., 2].sum(0).tolist()
                for k, surface in enumerate(inputs.surfaces_half)
            },
        }
        for i, angles in enumerate(inputs.conditions_alpha_beta_deg)
    ]


class ToneInputs(_Strict):
    blades: Annotated[int, _within(1, 12)]
    radius_m: Positive
    root_radius_m: Positive
    rpm: Positive
    thrust_N: Finite
    torque_N_m: Finite
    chord_m: Positive
    thickness_to_chord: Annotated[float, _within(0.01, 1.0)]
    speed_of_sound_m_per_s: Positive
    rho: Positive
    distance_m: Positive
    loading: str = ""

    @model_validator(mode="after")
    def _is_seen_from_outside(self) -> "ToneInputs":
        if self.root_radius_m >= self.radius_m:
            raise ValueError(
                f"root_radius_m = {self.root_radius_m} is not allowed; it must be below radius_m = {self.radius_m}"
            )
        if self.distance_m <= self.radius_m:
            raise ValueError(
                f"distance_m = {self.distance_m} is not allowed; it must exceed radius_m = {self.radius_m}"
            )
        return self


class ToneCondition(_Strict):
    elevation_from_disk_plane_deg: Angle


class WeightingInputs(_Strict):
    frequency_Hz: list[Positive] = Field(min_length=1)


def analyze_tones(inputs: ToneInputs, conditions: list[ToneCondition], mesh: Any) -> list[dict[str, Any]]:
    """Loads proportional to r^2, local pitch 0.1 rad, 400 stations: what the reference case prescribes."""
    r, width = station_radii(_tensor(inputs.radius_m), _tensor(inputs.root_radius_m), 400)
    shape = r**2 / ((r**2).sum() * width)
    loading = BladeLoading(
        radius=r,
        width=width,
        thrust_per_length=inputs.thrust_N * shape,
        torque_per_length=inputs.torque_N_m * shape,
        chord=torch.full_like(r, inputs.chord_m),
        thickness_to_chord=inputs.thickness_to_chord,
        pitch_angle=torch.full_like(r, 0.1),
        blades=_tensor(float(inputs.blades)),
        rotation_speed=_tensor(inputs.rpm * RPM),
        density=_tensor(inputs.rho),
        speed_of_sound=_tensor(inputs.speed_of_sound_m_per_s),
    )
    results = []
    for condition in conditions:
        height = inputs.distance_m * math.sin(math.radians(condition.elevation_from_disk_plane_deg))
        noise = barry_magliozzi(loading, _tensor(-height), _tensor(inputs.distance_m), harmonics=6)
        weighted = noise.pressure_squared * sound.a_weighting_factor(noise.frequency)
        columns = (noise.frequency, noise.loading.sqrt(), noise.thickness.sqrt())
        keys = ("frequency_Hz", "p_loading_rms_Pa", "p_thickness_rms_Pa")
        results.append(
            {
                **condition.model_dump(),
                "harmonics": [
                    {"harmonic": m + 1, **{key: float(column[m]) for key, column in zip(keys, columns, strict=True)}}
                    for m in range(6)
                ],
                "spl_db": float(sound.sound_pressure_level(noise.pressure_squared.sum())),
                "spl_dba_per_harmonic": float(sound.sound_pressure_level(weighted.sum())),
            }
        )
    return results


def analyze_weighting(inputs: WeightingInputs, conditions: list[Any], mesh: Any) -> list[float]:
    return sound.a_weighting(_tensor(inputs.frequency_Hz)).tolist()


class MotorInputs(_Strict):
    pole_pairs: Annotated[int, _within(1, 100)]
    flux_linkage_Wb: Positive
    L_d_H: Positive
    L_q_H: Positive
    phase_resistance_ohm: Positive
    dc_voltage_V: Positive
    voltage_limit: str = ""
    maximum_current_A: Positive = 1e3

    @model_validator(mode="after")
    def _is_salient(self) -> "MotorInputs":
        if self.L_q_H < self.L_d_H:
            raise ValueError(f"L_q_H = {self.L_q_H} is not allowed; it must be at least L_d_H = {self.L_d_H}")
        return self


class MotorCondition(_Strict):
    torque_em_N_m: Finite
    speed_rpm: Positive


def analyze_motor(inputs: MotorInputs, conditions: list[MotorCondition], mesh: Any) -> list[dict[str, Any]]:
    zero = _tensor(0.0)
    circuit = motor.MotorCircuit(
        pole_pairs=_tensor(float(inputs.pole_pairs)),
        phase_resistance=_tensor(inputs.phase_resistance_ohm),
        inductance_d=_tensor(inputs.L_d_H),
        inductance_q=_tensor(inputs.L_q_H),
        flux_linkage=_tensor(inputs.flux_linkage_Wb),
        voltage_limit=_tensor(inputs.dc_voltage_V / math.sqrt(3.0)),
        current_limit=_tensor(inputs.maximum_current_A),
        hysteresis=zero,
        eddy=zero,
        bearing_torque=zero,
        windage=zero,
        stray_share=zero,
    )
    results = []
    for condition in conditions:
        speed = _tensor(condition.speed_rpm * RPM)
        operation = motor.operate_motor(circuit, _tensor(condition.torque_em_N_m), speed)
        largest = float(motor.maximum_torque(circuit, speed))
        least_d, _ = motor.maximum_torque_per_ampere(circuit, _tensor(condition.torque_em_N_m))
        results.append(
            {
                **condition.model_dump(),
                "mode": "flux weakening" if float(operation.current_d) < float(least_d) - 1e-3 else "mtpa",
                "i_d_A": float(operation.current_d),
                "i_q_A": float(operation.current_q),
                "voltage_V": float(operation.voltage),
                "copper_loss_W": float(operation.copper_loss),
                "maximum_torque_N_m": largest,
                "is_within_limits": abs(condition.torque_em_N_m) <= largest,
            }
        )
    return results


class BatterySegment(_Strict):
    duration_s: Positive
    power_W: NotNegative


class BatteryInputs(_Strict):
    R0_ohm: Positive
    R1_ohm: Positive
    C1_F: Positive
    capacity_C: Positive
    soc_table: list[Share] = Field(min_length=2)
    ocv_table_V: list[Positive] = Field(min_length=2)
    initial_state_of_charge: Share
    segments: list[BatterySegment] = Field(min_length=1)

    @model_validator(mode="after")
    def _has_tables(self) -> "BatteryInputs":
        if len(self.soc_table) != len(self.ocv_table_V):
            raise ValueError(f"soc_table has {len(self.soc_table)} values, ocv_table_V has {len(self.ocv_table_V)}")
        if any(b <= a for a, b in zip(self.soc_table, self.soc_table[1:], strict=False)):
            raise ValueError("soc_table is not allowed; it must increase")
        return self


def analyze_battery(inputs: BatteryInputs, conditions: list[Any], mesh: Any) -> list[dict[str, Any]]:
    cell = equivalent_circuit.TheveninCell(
        inputs.R0_ohm,
        inputs.R1_ohm,
        inputs.C1_F,
        inputs.capacity_C,
        equivalent_circuit.tabulated_voltage(_tensor(inputs.soc_table), _tensor(inputs.ocv_table_V)),
    )
    duration = _tensor([segment.duration_s for segment in inputs.segments])
    power = _tensor([segment.power_W for segment in inputs.segments])
    # Even panels: the table has kinks, which no other panels would meet better.
    even = [(k + 1) / TABLE_PANELS for k in range(TABLE_PANELS)]
    state = equivalent_circuit.thevenin_discharge(cell, power, duration, inputs.initial_state_of_charge, even)
    least = 1.0 - equivalent_circuit.SUSTAINED_SHARE
    for i, margin in enumerate(state.power_margin.tolist()):
        if margin < least:
            raise ValueError(
                f"inputs.segments[{i}].power_W = {power[i]:g} is not allowed; the cell sustains "
                f"{float(power[i]) * (1.0 - least) / (1.0 - margin):.4g}"
            )
    keys = ("state_of_charge", "v_rc_V", "current_A", "terminal_voltage_V")
    columns = (state.state_of_charge, state.pair_voltage, state.current, state.terminal_voltage)
    return [
        {"time_s": float(time), **{key: float(column[i]) for key, column in zip(keys, columns, strict=True)}}
        for i, time in enumerate(torch.cumsum(duration, 0))
    ]


Kind = tuple[type[_Strict], type[_Strict] | None, Callable[..., Any]]
KINDS: dict[str, Kind] = {
    "airfoil": (AirfoilInputs, None, analyze_airfoil),
    "rotor": (RotorInputs, RotorCondition, analyze_rotor),
    "wing": (WingInputs, None, analyze_wing),
    "noise": (ToneInputs, ToneCondition, analyze_tones),
    "motor": (MotorInputs, MotorCondition, analyze_motor),
    "battery": (BatteryInputs, None, analyze_battery),
}


def validated(model: type[_Strict], data: Any, file: Path, where: str) -> Any:
    try:
        return model.model_validate(data)
    except ValidationError as error:
        place, what = fault(model, telling(error.errors())[0], where)
        raise ConfigurationError(f"{file}: {place}{what}.") from None


def _conditions(model: type[_Strict], case: dict[str, Any], file: Path) -> list[Any]:
    """From `conditions`, or the condition keys of every entry of `results`."""
    if "conditions" in case:
        entries, where = case["conditions"], "conditions"
    else:
        known = set(model.model_fields)
        entries, where = case.get("results", []), "results"
        if isinstance(entries, list):
            entries = [{k: v for k, v in e.items() if k in known} if isinstance(e, dict) else e for e in entries]
    if not isinstance(entries, list) or not entries:
        raise ConfigurationError(f"{file}: conditions is missing.")
    return [validated(model, entry, file, f"{where}[{i}]") for i, entry in enumerate(entries)]


def is_finite(results: Any) -> bool:
    if isinstance(results, dict | list):
        return all(is_finite(value) for value in (results.values() if isinstance(results, dict) else results))
    return not isinstance(results, float) or math.isfinite(results)


def analyze_case(discipline: str, case: Any, file: Path) -> dict[str, Any]:
    """Results of one case. Raises ConfigurationError with one sentence on what is wrong with it."""
    if not isinstance(case, dict) or "inputs" not in case:
        raise ConfigurationError(f"{file}: inputs is missing.")
    inputs_model, condition_model, function = KINDS[discipline]
    if discipline == "noise" and isinstance(case["inputs"], dict) and "frequency_Hz" in case["inputs"]:
        inputs_model, condition_model, function = WeightingInputs, None, analyze_weighting
    known = {"inputs"} | ({"conditions"} if condition_model else set()) | ({"mesh"} if discipline == "wing" else set())
    for key in case:
        if key not in IGNORED | known and not key.startswith(IGNORED_PREFIX):
            raise ConfigurationError(
                f"{file}: {key} is not a known key; it must be one of {', '.join(sorted(known))}, or a note."
            )
    inputs = validated(inputs_model, case["inputs"], file, "inputs")
    conditions = _conditions(condition_model, case, file) if condition_model else []
    mesh = validated(WingMesh, case.get("mesh", {}), file, "mesh")
    try:
        with torch.no_grad():
            results = function(inputs, conditions, mesh)
    except torch.linalg.LinAlgError:
        raise ConfigurationError(f"{file}: inputs.surfaces_half is not allowed; surfaces must not coincide.") from None
    except ValueError as error:
        raise ConfigurationError(f"{file}: {error}.") from None
    if not is_finite(results):
        raise ConfigurationError(f"{file}: inputs are not allowed; they give results that are not finite.")
    return {"results": results}


def analyze_file(discipline: str, file: Path) -> str:
    """Results of a case file as JSON text."""
    return json.dumps(analyze_case(discipline, read_json(file), file), indent=1, allow_nan=False)
