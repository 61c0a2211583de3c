"""Cases of airfoils and rotors."""

from pathlib import Path
from typing import Annotated, Any

import torch
from pydantic import Field, PrivateAttr, StrictBool, ValidationInfo, model_validator
from torch import Tensor

from lpc_mdo.cases.files import RPM, NotNegative, Positive, Strict, positive, within
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum, station_radii
from lpc_mdo.numerics.present import present
from lpc_mdo.numerics.tensors import tensor
from lpc_mdo.reporting.flag import extrapolated_share, rotor_flags, stated, why_not_propelling
from lpc_mdo.surrogates.airfoil import AirfoilPolar
from lpc_mdo.surrogates.airfoil_names import resolve_airfoil

LARGEST = 1e4  # m and m/s, of anything about a wing, and m/s of a rotor


def _polar(name: str, key: str, info: ValidationInfo) -> AirfoilPolar:
    """The polar of a name in a case file, whose paths are relative to its folder. Raises ValueError that names the key."""
    return resolve_airfoil(name, (info.context or {}).get("folder", Path()), key)


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
