"""Cases of motors and battery cells."""

import contextlib
import math
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, model_validator
from scipy.optimize import brentq

from lpc_mdo.cases.files import RPM, Share, Strict, positive, within
from lpc_mdo.disciplines import equivalent_circuit, motor, motor_limits
from lpc_mdo.numerics.implicit import RootNotFoundError
from lpc_mdo.numerics.tensors import tensor
from lpc_mdo.reporting.flag import Flag, stated

MOST_SALIENT = 100.0  # inductances of one motor: reluctance machines reach 20
TABLE_PANELS = 24  # of each segment of a battery case
MOST_SEGMENTS = 1000  # ten seconds or so


class MotorInputs(Strict):
    pole_pairs: Annotated[int, within(1, 100)]
    flux_linkage_Wb: Annotated[float, positive(1e3)]
    L_d_H: Annotated[float, positive(1e2)]
    L_q_H: Annotated[float, positive(1e2)]
    phase_resistance_ohm: Annotated[float, positive(1e4)]
    dc_voltage_V: Annotated[float, positive(1e5)]
    voltage_limit: str = ""
    maximum_current_A: Annotated[float, positive(1e5)] = 1e3

    @model_validator(mode="after")
    def _is_salient(self) -> "MotorInputs":
        if self.L_q_H < self.L_d_H:
            raise ValueError(f"L_q_H = {self.L_q_H} is not allowed; it must be at least L_d_H = {self.L_d_H}")
        if self.L_q_H > MOST_SALIENT * self.L_d_H:
            raise ValueError(
                f"L_q_H = {self.L_q_H} is invalid: it must be at most {MOST_SALIENT:g} times L_d_H = {self.L_d_H}"
            )
        return self


class MotorCondition(Strict):
    torque_em_N_m: Annotated[float, within(-1e7, 1e7)]
    speed_rpm: Annotated[float, within(0.0, 1e6)]


def _circuit(inputs: MotorInputs) -> motor.MotorCircuit:
    zero = tensor(0.0)
    return motor.MotorCircuit(
        pole_pairs=tensor(float(inputs.pole_pairs)),
        phase_resistance=tensor(inputs.phase_resistance_ohm),
        inductance_d=tensor(inputs.L_d_H),
        inductance_q=tensor(inputs.L_q_H),
        flux_linkage=tensor(inputs.flux_linkage_Wb),
        voltage_limit=tensor(inputs.dc_voltage_V / math.sqrt(3.0)),
        current_limit=tensor(inputs.maximum_current_A),
        hysteresis=zero,
        eddy=zero,
        bearing_torque=zero,
        windage=zero,
        stray_share=zero,
    )


def analyze_motor(inputs: MotorInputs, conditions: list[MotorCondition], mesh: Any) -> list[dict[str, Any]]:
    """Currents of a torque beyond the limits are those that make it all the same; `flags` says which limit they break."""
    circuit = _circuit(inputs)
    results = []
    for condition in conditions:
        torque, speed = tensor(condition.torque_em_N_m), tensor(condition.speed_rpm * RPM)
        operation = motor.operate_motor(circuit, torque, speed)
        largest = float(motor_limits.maximum_torque(circuit, speed))
        least_d, _ = motor.maximum_torque_per_ampere(circuit, torque)
        flags = _motor_flags(circuit, operation, condition.torque_em_N_m, largest)
        results.append(
            {
                **condition.model_dump(),
                "mode": "flux weakening" if float(operation.current_d) < float(least_d) - 1e-3 else "mtpa",
                "i_d_A": float(operation.current_d),
                "i_q_A": float(operation.current_q),
                "voltage_V": float(operation.voltage),
                "copper_loss_W": float(operation.copper_loss),
                "maximum_torque_N_m": largest,
                "is_within_limits": not flags,
                **stated(flags),
            }
        )
    return results


def _motor_flags(
    circuit: motor.MotorCircuit, operation: motor.MotorOperation, torque: float, largest: float
) -> list[Flag]:
    """Which limits a torque breaks. A driving one is held against the largest; a braking one, which voltage limits less,
    against the currents and the voltage that it takes."""
    if torque > max(largest, 0.0):
        message = (
            f"torque {torque:.6g} N m exceeds the largest within the limits of current and voltage, {largest:.6g} N m"
        )
        return [Flag("torque", "", torque, largest, message)]
    flags = []
    for what, unit, value, limit, tolerance in (
        ("current", "A", float(operation.current), float(circuit.current_limit), 1e-9),
        ("voltage", "V", float(operation.voltage), float(circuit.voltage_limit), motor.VOLTAGE_TOLERANCE),
    ):
        if torque <= 0.0 and value > limit * (1.0 + tolerance):
            message = f"the {what} for this torque, {value:.6g} {unit}, exceeds its limit, {limit:.6g} {unit}"
            flags.append(Flag(what, "", value, limit, message))
    return flags


class BatterySegment(Strict):
    duration_s: Annotated[float, positive(1e7)]
    power_W: Annotated[float, within(0.0, 1e8)]


class BatteryInputs(Strict):
    R0_ohm: Annotated[float, positive(100.0)]
    R1_ohm: Annotated[float, positive(100.0)]
    C1_F: Annotated[float, positive(1e8)]
    capacity_C: Annotated[float, positive(1e8)]  # 28 kAh
    soc_table: list[Share] = Field(min_length=2, max_length=10_000)
    ocv_table_V: list[Annotated[float, positive(2000.0)]] = Field(min_length=2, max_length=10_000)
    initial_state_of_charge: Share
    segments: list[BatterySegment] = Field(min_length=1, max_length=MOST_SEGMENTS)

    @model_validator(mode="after")
    def _has_tables(self) -> "BatteryInputs":
        if len(self.soc_table) != len(self.ocv_table_V):
            raise ValueError(
                f"soc_table has {len(self.soc_table)} values, ocv_table_V has {len(self.ocv_table_V)}; both must have as many"
            )
        if any(b <= a for a, b in zip(self.soc_table, self.soc_table[1:], strict=False)):
            raise ValueError("soc_table is not allowed; it must increase")
        for i, (low, high) in enumerate(zip(self.ocv_table_V, self.ocv_table_V[1:], strict=False)):
            if high < low:
                raise ValueError(
                    f"ocv_table_V[{i + 1}] = {high:g} is invalid: it must be at least the {low:g} before it"
                )
        return self


@dataclass(frozen=True)
class _Cell:
    """Charge and voltage of the pair of one cell at one moment."""

    charge: float
    pair_voltage: float


def analyze_battery(inputs: BatteryInputs, conditions: list[Any], mesh: Any) -> list[dict[str, Any]]:
    """State after each segment; null, with the reason, from the segment on in which the cell runs empty."""
    cell = equivalent_circuit.TheveninCell(
        inputs.R0_ohm,
        inputs.R1_ohm,
        inputs.C1_F,
        inputs.capacity_C,
        equivalent_circuit.tabulated_voltage(tensor(inputs.soc_table), tensor(inputs.ocv_table_V)),
    )
    now, time, results, reason = _Cell(inputs.initial_state_of_charge, 0.0), 0.0, [], ""
    for i, segment in enumerate(inputs.segments):
        end = None if reason else _after(cell, segment, now, i)
        if end and end.state_of_charge[-1] < 0.0:
            lasted = _time_to_empty(cell, segment.power_W, _longest(cell, segment, now), now, i)
            reason = f"the cell is empty after {time + lasted:.6g} s, in segments[{i}]"
        time += segment.duration_s
        results.append({"time_s": time} | _battery_row(inputs, None if reason else end, now.charge, reason))
        if end and not reason:
            now = _Cell(float(end.state_of_charge[-1]), float(end.pair_voltage[-1]))
    return results


def _battery_row(
    inputs: BatteryInputs, end: equivalent_circuit.TheveninState | None, charge_before: float, reason: str
) -> dict[str, Any]:
    keys = ("state_of_charge", "v_rc_V", "current_A", "terminal_voltage_V")
    if end is None:
        flag = Flag("battery_empty", "", None, 0.0, reason)
        return dict.fromkeys(keys) | stated([flag], dict.fromkeys(keys, reason))
    columns = (end.state_of_charge, end.pair_voltage, end.current, end.terminal_voltage)
    flags = []
    for charge, limit, side in (
        (float(end.state_of_charge[-1]), inputs.soc_table[0], "below"),
        (charge_before, inputs.soc_table[-1], "above"),
    ):
        if charge < limit if side == "below" else charge > limit:
            words = f"a state of charge of {charge:.4g} lies {side} the table of open-circuit voltage, which ends at {limit:g}"
            flags.append(Flag("charge_extrapolated", "", charge, limit, words))
    values = {key: float(column[-1]) for key, column in zip(keys, columns, strict=True)}
    return values | stated(flags)


def _after(
    cell: equivalent_circuit.TheveninCell, segment: BatterySegment, now: _Cell, index: int
) -> equivalent_circuit.TheveninState:
    """The cell after a segment, or, where that lies too far beyond empty to be found, when it surely is empty."""
    with contextlib.suppress(RootNotFoundError):
        state = _discharged(cell, segment.power_W, segment.duration_s, now, index)
        if math.isfinite(float(state.state_of_charge[-1])):
            return state
    return _discharged(cell, segment.power_W, _longest(cell, segment, now), now, index)


def _discharged(
    cell: equivalent_circuit.TheveninCell, power: float, duration: float, now: _Cell, segment: int
) -> equivalent_circuit.TheveninState:
    """The cell after `duration` s at `power` W. Raises ValueError for more power than it sustains while it holds charge."""
    # Even panels: the table has kinks, which no other panels would meet better.
    even = [(k + 1) / TABLE_PANELS for k in range(TABLE_PANELS)]
    state = equivalent_circuit.thevenin_discharge(
        cell, tensor([power]), tensor([duration]), now.charge, even, now.pair_voltage
    )
    least, margin = 1.0 - equivalent_circuit.SUSTAINED_SHARE, float(state.power_margin[0])
    if margin < least and float(state.state_of_charge[-1]) >= 0.0:
        raise ValueError(
            f"inputs.segments[{segment}].power_W = {power:g} is not allowed; the cell sustains "
            f"{power * (1.0 - least) / (1.0 - margin):.4g}"
        )
    return state


def _longest(cell: equivalent_circuit.TheveninCell, segment: BatterySegment, now: _Cell) -> float:
    """Seconds of a segment, or, where that is less, a time in which even the voltage of now, the highest, empties the cell."""
    charge = max(now.charge, 1e-6)
    energy = 1.01 * charge * cell.capacity * float(cell.open_circuit_voltage(tensor([charge]))[0])
    return min(segment.duration_s, energy / segment.power_W) if segment.power_W > 0.0 else segment.duration_s


def _time_to_empty(
    cell: equivalent_circuit.TheveninCell, power: float, longest: float, now: _Cell, index: int
) -> float:
    """Seconds at `power` W, at most `longest`, after which no charge is left; zero for a cell that is empty before."""
    if now.charge <= 0.0:
        return 0.0

    def charge_after(duration: float) -> float:
        return float(_discharged(cell, power, duration, now, index).state_of_charge[-1])

    lasted = float(brentq(charge_after, 1e-12 * longest, longest, xtol=1e-12 * longest, rtol=1e-9))
    _discharged(cell, power, lasted * (1.0 - 1e-6), now, index)  # whether it sustains the power until then
    return lasted
