"""Cases of motors and battery cells."""

import math
from typing import Annotated, Any

import torch
from pydantic import Field, model_validator

from lpc_mdo.cases.files import RPM, Finite, NotNegative, Positive, Share, Strict, tensor, within
from lpc_mdo.disciplines import equivalent_circuit, motor, motor_limits
from lpc_mdo.flag import Flag

TABLE_PANELS = 24  # of each segment of a battery case


class MotorInputs(Strict):
    pole_pairs: Annotated[int, within(1, 100)]
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


class MotorCondition(Strict):
    torque_em_N_m: Finite
    speed_rpm: NotNegative


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
                "flags": [flag.content() for flag in flags],
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
    duration_s: Positive
    power_W: NotNegative


class BatteryInputs(Strict):
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
        equivalent_circuit.tabulated_voltage(tensor(inputs.soc_table), tensor(inputs.ocv_table_V)),
    )
    duration = tensor([segment.duration_s for segment in inputs.segments])
    power = tensor([segment.power_W for segment in inputs.segments])
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
