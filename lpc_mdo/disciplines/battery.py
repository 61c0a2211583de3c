"""Battery state of charge by energy drawn."""

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class BatteryState:
    """energy_drawn (..., segment) J out of the cells; state_of_charge (..., segment) after each segment."""

    energy_drawn: Tensor
    state_of_charge: Tensor

    @property
    def final_state_of_charge(self) -> Tensor:
        return self.state_of_charge[..., -1]


def energy_state_of_charge(
    power: Tensor,
    duration: Tensor,
    mass: Tensor,
    specific_energy: float | Tensor,
    efficiency: float | Tensor = 1.0,
    initial: float | Tensor = 1.0,
) -> BatteryState:
    """State of charge along segments of constant electrical power.

    power (..., segment) W at the terminals; duration (..., segment) s; mass (...,) kg; specific_energy J/kg of the pack;
    efficiency: terminal over cell power. State of charge may fall below zero: a constraint, not this function, forbids it.
    """
    energy = power * duration / efficiency
    capacity = mass * specific_energy
    drawn = torch.cumsum(energy, dim=-1)
    return BatteryState(energy, initial - drawn / capacity[..., None])


@dataclass(frozen=True)
class TheveninCell:
    """One cell: open-circuit voltage table over state of charge, series resistance, one resistor-capacitor pair."""

    series_resistance: float  # ohm
    pair_resistance: float  # ohm
    pair_capacitance: float  # F
    capacity: float  # C
    state_of_charge_table: Tensor  # (k,) increasing
    open_circuit_voltage_table: Tensor  # (k,) V


@dataclass(frozen=True)
class TheveninState:
    """After each segment, (..., segment); current and voltages at its end, A and V."""

    state_of_charge: Tensor
    pair_voltage: Tensor
    current: Tensor
    terminal_voltage: Tensor


def _interpolate(x: Tensor, table_x: Tensor, table_y: Tensor) -> Tensor:
    """Piecewise linear, extended by the end slopes."""
    index = torch.searchsorted(table_x, x.detach().contiguous()).clamp(1, len(table_x) - 1)
    x0, x1, y0, y1 = table_x[index - 1], table_x[index], table_y[index - 1], table_y[index]
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0)


def thevenin_discharge(
    cell: TheveninCell, power: Tensor, duration: Tensor, initial: float | Tensor = 1.0, largest_step: float = 2.0
) -> TheveninState:
    """Discharge at constant power by segments: power (..., segment) W, duration (..., segment) s.

    The current solves P = (E - R0 I) I with E = OCV - v1; classical Runge-Kutta steps of at most `largest_step` s. Raises
    ValueError where the cell cannot deliver the power (E^2 < 4 R0 P).
    """
    r0, r1, c1 = cell.series_resistance, cell.pair_resistance, cell.pair_capacitance
    charge = torch.as_tensor(initial, dtype=power.dtype).expand(power.shape[:-1])
    pair = torch.zeros_like(charge)
    states = []

    def current_at(charge: Tensor, pair: Tensor, demand: Tensor) -> tuple[Tensor, Tensor]:
        source = _interpolate(charge, cell.state_of_charge_table, cell.open_circuit_voltage_table) - pair
        margin = source**2 - 4.0 * r0 * demand
        if bool((margin < 0.0).any()):
            raise ValueError(f"battery power = {float(demand.max()):g} W is not allowed; the cell cannot deliver it")
        current = 2.0 * demand / (source + torch.sqrt(margin))
        return current, source - r0 * current

    def slope(charge: Tensor, pair: Tensor, demand: Tensor) -> tuple[Tensor, Tensor]:
        current, _ = current_at(charge, pair, demand)
        return -current / cell.capacity, (current - pair / r1) / c1

    for demand, time in zip(power.unbind(-1), duration.unbind(-1), strict=True):
        steps = max(1, int(torch.ceil(time.max() / largest_step)))
        h = time / steps
        for _ in range(steps):
            a = slope(charge, pair, demand)
            b = slope(charge + 0.5 * h * a[0], pair + 0.5 * h * a[1], demand)
            c = slope(charge + 0.5 * h * b[0], pair + 0.5 * h * b[1], demand)
            d = slope(charge + h * c[0], pair + h * c[1], demand)
            charge = charge + h / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0])
            pair = pair + h / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1])
        states.append((charge, pair, *current_at(charge, pair, demand)))
    return TheveninState(*(torch.stack(column, dim=-1) for column in zip(*states, strict=True)))
