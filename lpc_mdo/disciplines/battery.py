"""Battery state of charge by energy drawn: the published study's model. The circuit is in `equivalent_circuit`."""

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
