"""What is asked of a model outside its regime: stated in results, tables and reports instead of passing silently."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from torch import Tensor

from lpc_mdo.disciplines.blade_element import TIP_MACH_LIMIT, RotorLoads
from lpc_mdo.surrogates.airfoil import AirfoilPolar


@dataclass(frozen=True)
class Flag:
    """One figure outside a model's regime.

    what: short name, the same for every flag of a kind; where: rotor, segment or part, empty where there is but one;
    value and limit: of the quantity that says so, in its unit; message: one sentence for people.
    """

    what: str
    where: str
    value: float | None
    limit: float | None
    message: str

    def content(self) -> dict[str, Any]:
        """As result files hold it."""
        return asdict(self)


def stated(flags: Iterable[Flag], reasons: Mapping[str, str] | None = None) -> dict[str, Any]:
    """`flags`, and `reasons` of what is null by its key, as a row of results holds them: only where there are any."""
    rows = [flag.content() for flag in flags]
    return ({"flags": rows} if rows else {}) | ({"reasons": dict(reasons)} if reasons else {})


def rotor_flags(loads: RotorLoads, extrapolated: Tensor, where: str) -> list[Flag]:
    """Of one rotor at one operating point; extrapolated () is the share of its span outside the airfoil's polars."""
    flags = []
    if bool(loads.is_tip_fast):
        mach = float(loads.tip_mach)
        speed = "supersonic" if mach >= 1.0 else "fast"
        words = f"the tip is {speed}, Mach {mach:.4g}: blade-element theory with subsonic polars is trusted to {TIP_MACH_LIMIT:g}"
        flags.append(Flag("tip_mach", where, mach, TIP_MACH_LIMIT, words))
    if bool(loads.is_windmilling):
        torque = float(loads.torque)
        words = f"the air drives the rotor, torque {torque:.4g} N m: it takes no power"
        flags.append(Flag("windmilling", where, torque, 0.0, words))
    if bool(loads.is_vortex_ring):
        descent = -float(loads.inflow.axial_velocity)
        words = f"descent at {descent:.4g} m/s is a vortex-ring state, where momentum theory does not hold"
        flags.append(Flag("vortex_ring", where, descent, None, words))
    if (share := float(extrapolated)) > 0.0:
        words = f"{100.0 * share:.3g} % of the span lies outside the polars of its airfoil"
        flags.append(Flag("polar_extrapolated", where, share, 0.0, words))
    return flags


def extrapolated_share(loads: RotorLoads, polar: AirfoilPolar) -> Tensor:
    """Share (...,) of the span whose angle of attack, Reynolds or Mach number lies outside the polars."""
    return polar.extrapolated(loads.angle_of_attack, loads.reynolds, loads.mach).to(loads.thrust).mean(-1)


def why_not_propelling(loads: RotorLoads) -> str:
    """Why figure of merit and efficiency of one operating point are undefined; empty where they are not."""
    if bool(loads.is_propelling):
        return ""
    if float(loads.inflow.axial_velocity) < 0.0:
        return "the rotor descends: the air brings in power that no ideal rotor bounds"
    if bool(loads.is_windmilling):
        return "the air drives the rotor: it takes no power"
    return "the rotor gives no thrust"
