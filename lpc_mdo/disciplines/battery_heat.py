"""Temperature of a battery as one lump along segments of constant heat, and its C-rate.

    m c dT/dt = heat - conductance (T - surroundings), solved exactly in each segment.

Without cooling the answer is on the safe side for the mean, not for the hottest cell. Resistance does not follow temperature, heat
of reaction (entropy) is left out: Bernardi, Pawlikowski, Newman, J. Electrochem. Soc. 132 (1985) have both.
"""

import torch
from torch import Tensor

from lpc_mdo.disciplines.equivalent_circuit import TheveninCell

SPECIFIC_HEAT = 1000.0  # J/(kg K): ASSUMED, lithium-ion cells have 800 to 1100
HIGHEST_TEMPERATURE = 333.15  # K, in discharge: data sheet of the LG M50, 60 degrees Celsius


def pack_temperature(
    heat: Tensor,
    duration: Tensor,
    mass: Tensor,
    initial: Tensor,
    surroundings: Tensor,
    conductance: Tensor,
    specific_heat: float | Tensor = SPECIFIC_HEAT,
) -> Tensor:
    """Temperatures (..., segment) K of a pack of mass (...,) kg after each segment, from `initial` (...,) K.

    In between it only rises or only falls: the highest of all is one of these, or the initial one.

    heat (..., segment) W, duration (..., segment) s, surroundings (..., segment) K of air or coolant, conductance (..., segment) W/K
    to them, zero if the pack is insulated; specific_heat (...,) J/(kg K).
    """
    capacity = torch.as_tensor(mass * specific_heat)[..., None]
    heat, duration, surroundings, conductance, capacity = torch.broadcast_tensors(
        heat, duration, surroundings, conductance, capacity
    )
    exponent = conductance * duration / capacity
    kept = torch.exp(-exponent)
    rise = surroundings * -torch.expm1(-exponent) + heat * duration / capacity * _mean_decay(exponent)
    ends = [initial]
    for share, added in zip(kept.unbind(-1), rise.unbind(-1), strict=True):
        ends.append(share * ends[-1] + added)
    return torch.stack(torch.broadcast_tensors(*ends[1:]), dim=-1)


def _mean_decay(x: Tensor) -> Tensor:
    """(1 - exp(-x))/x (...,), 1 at zero."""
    is_small = x.abs() < 1e-4
    safe = torch.where(is_small, 1.0, x)
    return torch.where(is_small, 1.0 - x / 2.0 + x**2 / 6.0, -torch.expm1(-safe) / safe)


def circuit_heat(
    cell: TheveninCell,
    state_of_charge: Tensor,
    pair_voltage: Tensor,
    duration: Tensor,
    cells: Tensor,
    initial: float | Tensor = 1.0,
) -> Tensor:
    """Mean heat (..., segment) W of a pack of cells (...,) in both resistances, as if each segment had its mean current throughout.

    state_of_charge, pair_voltage (..., segment) V after segments of duration (..., segment) s, as a `TheveninState` has them; from
    `initial` (...,) charge at rest. What flows into the pair is heat or stored.
    """
    full = torch.as_tensor(initial, dtype=state_of_charge.dtype, device=state_of_charge.device)
    charge, voltage = _with_start(state_of_charge, full), _with_start(pair_voltage, 0.0 * full)
    current = -charge.diff(dim=-1) * cell.capacity / duration
    flow = (
        current - cell.pair_capacitance * voltage.diff(dim=-1) / duration
    )  # through the pair's resistance, on the mean
    stored = 0.5 * cell.pair_capacitance * (voltage**2).diff(dim=-1) / duration
    return (cell.series_resistance * current**2 + cell.pair_resistance * flow * current - stored) * cells[..., None]


def _with_start(values: Tensor, start: Tensor) -> Tensor:
    """(..., segment) with one more before."""
    return torch.cat([start[..., None].expand_as(values[..., :1]), values], dim=-1)


def discharge_loss(power: Tensor, efficiency: float | Tensor) -> Tensor:
    """Heat (..., segment) W of a battery of constant efficiency that gives power (..., segment) W."""
    return power * (1.0 / efficiency - 1.0)


def discharge_rate(power: Tensor, mass: Tensor, specific_energy: float | Tensor) -> Tensor:
    """C-rate (..., segment) 1/h: power (..., segment) W over the energy of mass (...,) kg at specific_energy (...,) J/kg."""
    return 3600.0 * power / torch.as_tensor(mass * specific_energy)[..., None]
