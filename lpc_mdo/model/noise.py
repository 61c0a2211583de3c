"""Noise of the rotors that lift, in the segment that the mission's requirement names."""

from collections.abc import Callable

import torch
from torch import Tensor

from lpc_mdo.disciplines.hover_noise import HoverNoise, observer_position
from lpc_mdo.model.rotor_noise import heard_by_observers, heard_in_hover
from lpc_mdo.model.rotors import RotorOperation
from lpc_mdo.model.schedule import Schedule


class Noise:
    """Callable stage: rotors and hubs (..., rotor, 3) m -> levels at the mission's observer, and (..., observer) dB(A) there and at
    the further elevations.

    Observers stand ahead of and below the middle of the rotors in the plane of symmetry.
    """

    def __init__(self, schedule: Schedule) -> None:
        self.schedule, self.requirements = schedule, schedule.mission.requirements
        of_segment = schedule.in_segment(schedule.mission.noise_segment.name)
        self.rotors = schedule.rotor[of_segment]  # (noisy rotor,) in the vehicle's order
        solved = sorted({int(schedule.place[k]) for k in of_segment})
        self.own_rotors = schedule.solved_rotor[solved]  # those that are evaluated, for themselves and their twins
        self.multiplicity = schedule.multiplicity[solved]
        self._index = slice(solved[0], solved[-1] + 1)
        if solved != list(range(len(schedule.solved)))[self._index]:
            raise ValueError("points of one segment must be solved side by side")

    def __call__(self, rotors: RotorOperation, hubs: Tensor) -> tuple[HoverNoise, Tensor]:
        center, requirements = hubs[..., self.rotors, :].mean(-2), self.requirements
        observer = observer_position(center, requirements.observer_distance, requirements.observer_elevation)
        noise = self.at(rotors, hubs, observer)
        if not requirements.further_observer_elevations:
            return noise, noise.total_dba[..., None]
        elevations = requirements.further_observer_elevations
        observers = [observer_position(center, requirements.observer_distance, angle) for angle in elevations]
        further = self._heard(heard_by_observers, rotors, hubs, torch.stack(observers, dim=-2))
        return noise, torch.cat([noise.total_dba[..., None], further.total_dba], dim=-1)

    def at(self, rotors: RotorOperation, hubs: Tensor, observer: Tensor) -> HoverNoise:
        """What an observer (..., 3) m hears; several make the leading dimensions."""
        return self._heard(heard_in_hover, rotors, hubs, observer)

    def _heard(
        self, hearing: Callable[..., HoverNoise], rotors: RotorOperation, hubs: Tensor, place: Tensor
    ) -> HoverNoise:
        hubs = hubs[..., self.own_rotors, :]
        loads, polars = rotors.solved_loads, rotors.solved_polars
        return hearing(loads, polars, hubs, place, self.requirements, self._index, self.multiplicity)
