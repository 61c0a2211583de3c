"""Where an analysis leaves the regime of a model: the flags of result.json."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.config import Vehicle
from lpc_mdo.disciplines.blade_element import RotorLoads
from lpc_mdo.disciplines.equivalent_circuit import SUSTAINED_SHARE, TheveninState
from lpc_mdo.model.aerodynamics import wing_polar
from lpc_mdo.model.analysis import Analysis, is_whole_aircraft
from lpc_mdo.model.blade_airfoils import BladePolar, extrapolated_shares
from lpc_mdo.model.structure_source import structural_surrogate
from lpc_mdo.numerics.present import present
from lpc_mdo.reporting import wording
from lpc_mdo.reporting.flag import Flag, rotor_flags

ROUNDING = 1e-6  # of a limit: an active constraint is no flag


def regime_flags(analysis: Any) -> list[Flag]:
    """Of one design's analysis of the whole aircraft or of its blades in hover; none of an analysis of another kind."""
    if not isinstance(analysis, Analysis):
        return []
    with torch.no_grad():
        points = [", ".join(point) for point in analysis.schedule.point_names]
        rotors = _rotors(analysis.rotors.loads, analysis.rotors.polars, points)
        if not is_whole_aircraft(analysis):
            return rotors
        vehicle = analysis.vehicle
        return [
            *_motors(analysis, points),
            *rotors,
            *_structure(analysis, vehicle),
            *_wing(analysis, vehicle),
            *_battery(analysis),
        ]


def _motors(analysis: Analysis, points: Sequence[str]) -> list[Flag]:
    return [
        Flag(
            "motor_torque_share",
            where,
            share,
            1.0,
            f"the motor would have to give {share:.4g} times its largest torque",
        )
        for where, share in zip(points, present(analysis.propulsion, "propulsion").torque_share.tolist(), strict=True)
        if share > 1.0 + ROUNDING
    ]


def _rotors(loads: RotorLoads, polars: Sequence[BladePolar], points: Sequence[str]) -> list[Flag]:
    shares = extrapolated_shares(loads, polars)
    return [flag for i, where in enumerate(points) for flag in rotor_flags(loads.at(torch.tensor(i)), shares[i], where)]


def _structure(analysis: Analysis, vehicle: Vehicle) -> list[Flag]:
    surrogate, inputs = structural_surrogate(vehicle), analysis.weights.structural_inputs
    flags = [
        Flag(
            "structure_extrapolated",
            name,
            distance,
            1.0,
            f"{wording.quantity(name)} lies {abs(distance):.3g} half-widths from the centre of the samples of structural mass",
        )
        for name, distance in surrogate.outside(inputs).items()
    ]
    leverage = float(surrogate.leverage(inputs))
    if leverage > surrogate.largest_leverage:
        words = f"leverage {leverage:.3g} exceeds the samples' largest, {surrogate.largest_leverage:.3g}"
        flags.append(Flag("structure_leverage", "", leverage, surrogate.largest_leverage, words))
    return flags


def _wing(analysis: Analysis, vehicle: Vehicle) -> list[Flag]:
    flags = []
    aerodynamics = present(analysis.aerodynamics, "aerodynamics")
    for i, segment in enumerate(analysis.schedule.wingborne_names):
        if (drag := float(aerodynamics.induced_drag[i])) < 0.0:
            words = f"induced drag {drag:.4g} N is below zero: the lattice cannot be trusted"
            flags.append(Flag("induced_drag_negative", segment, drag, 0.0, words))
        if (beyond := float(_stall_beyond(analysis, vehicle, i))) > 0.0:
            words = "Reynolds or Mach number of the wing lies outside the polars of its section, which give its largest lift"
            flags.append(Flag("stall_extrapolated", segment, beyond, 0.0, words))
    return flags


def _stall_beyond(analysis: Analysis, vehicle: Vehicle, i: int) -> Tensor:
    """() the farther of Reynolds and Mach number beyond the polars of the wing's section, in half-widths."""
    aerodynamics = present(analysis.aerodynamics, "aerodynamics")
    reynolds, mach = aerodynamics.reynolds[..., i], aerodynamics.mach[..., i]
    return wing_polar(vehicle).beyond(torch.zeros_like(reynolds), reynolds, mach)[..., 1:].amax()


def _battery(analysis: Analysis) -> list[Flag]:
    state, flags = present(analysis.energy, "energy").battery, []
    if (charge := float(state.final_state_of_charge)) < 0.0:
        flags.append(Flag("battery_empty", "", charge, 0.0, "the battery is empty before the mission ends"))
    if isinstance(state, TheveninState):
        share = 1.0 - float(state.power_margin.amin())
        if share > SUSTAINED_SHARE:
            words = f"the battery is asked for {share:.3g} of the most power that it sustains, and gives less"
            flags.append(Flag("battery_power", "", share, SUSTAINED_SHARE, words))
    return flags
