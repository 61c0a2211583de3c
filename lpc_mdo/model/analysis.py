"""What comes out of the model: everything that may be asked of a design, by names."""

from dataclasses import dataclass, fields
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.disciplines.hover_noise import HoverNoise
from lpc_mdo.disciplines.trim import TrimResidual
from lpc_mdo.geometry.shape import Shape
from lpc_mdo.model.aerodynamics import AerodynamicLoads
from lpc_mdo.model.design import Design
from lpc_mdo.model.energy import MissionEnergy
from lpc_mdo.model.flight import FlightConditions
from lpc_mdo.model.propulsion import Propulsion
from lpc_mdo.model.rotors import RotorOperation
from lpc_mdo.model.schedule import Schedule
from lpc_mdo.model.weights import WeightBreakdown


@dataclass(frozen=True)
class SegmentAnalysis:
    """One segment, each (...,) in SI units; None: what only a segment on the wing has, or a model that knows power."""

    name: str
    speed: Tensor
    path_angle: Tensor
    pitch: Tensor
    start_altitude: Tensor
    end_altitude: Tensor
    scaled_trim: Tensor  # (..., 6)
    power: Tensor | None  # W, electrical
    duration: Tensor | None  # s
    lift: Tensor | None = None
    lift_coefficient: Tensor | None = None
    drag_coefficient: Tensor | None = None
    parasitic_drag_coefficient: Tensor | None = None
    parasitic_area: dict[str, Tensor] | None = None
    induced_drag: Tensor | None = None
    lift_to_drag: Tensor | None = None
    maximum_lift_coefficient: Tensor | None = None
    stall_speed: Tensor | None = None


@dataclass(frozen=True)
class RotorAnalysis:
    """One rotor in one segment, each (...,) in SI units; None: what only a model with motors knows."""

    rotor: str
    segment: str
    thrust: Tensor
    torque: Tensor  # N m of the shaft
    power: Tensor  # W of the shaft
    speed: Tensor  # rad/s
    tip_mach: Tensor
    efficiency: Tensor  # figure of merit of a lift rotor, propulsive efficiency of a pusher
    torque_share: Tensor | None
    electrical_power: Tensor | None


_OF_SURFACES = tuple({f.name for f in fields(SegmentAnalysis)} & {f.name for f in fields(AerodynamicLoads)})


@dataclass(frozen=True)
class Analysis:
    """Everything a person may ask for; leading dimensions as in the design.

    A model of the rotors in hover alone has no motors, wing and battery: those parts are None.
    """

    schedule: Schedule
    design: Design
    shape: Shape
    flight: FlightConditions
    weights: WeightBreakdown
    rotors: RotorOperation
    trim: TrimResidual  # (..., segment, 3)
    scaled_trim: Tensor  # (..., segment, 6) forces over weight, moments over weight x semi-span
    noise: HoverNoise  # at the mission's observer; spectra are those of the solved rotors
    observed_dba: Tensor  # (..., observer) dB(A): that observer, then the further ones
    propulsion: Propulsion | None = None
    aerodynamics: AerodynamicLoads | None = None
    energy: MissionEnergy | None = None

    @property
    def vehicle(self) -> Vehicle:
        return self.schedule.vehicle

    @property
    def mission(self) -> Mission:
        return self.schedule.mission

    @property
    def gross_mass(self) -> Tensor:
        """(...,) kg."""
        return self.weights.total.mass

    def segment(self, name: str) -> SegmentAnalysis:
        """Raises KeyError for a segment that there is not."""
        i = self.schedule.segment_index(name)
        flight, energy, surfaces = self.flight, self.energy, {}
        if self.aerodynamics is not None and name in self.schedule.wingborne_names:
            k = self.schedule.wingborne_index(name)
            surfaces = {key: getattr(self.aerodynamics, key)[..., k] for key in _OF_SURFACES}
            areas = self.aerodynamics.parasitic_area.items()
            surfaces["parasitic_area"] = {item: area[..., k] for item, area in areas}
        return SegmentAnalysis(
            name=name,
            speed=flight.speed[..., i],
            path_angle=flight.path_angle[..., i],
            pitch=flight.pitch[..., i],
            start_altitude=flight.start_altitude[..., i],
            end_altitude=flight.end_altitude[..., i],
            scaled_trim=self.scaled_trim[..., i, :],
            power=None if energy is None else energy.power[..., i],
            duration=None if energy is None else energy.duration[..., i],
            **surfaces,
        )

    @property
    def main_segment(self) -> SegmentAnalysis:
        """That of the mission's reserve: cruise, in the published study."""
        return self.segment(self.mission.main_segment.name)

    def rotor(self, name: str, segment: str) -> RotorAnalysis:
        """Raises KeyError for a rotor that does not turn in the segment."""
        k = self.schedule.point_index(name, segment)
        loads, propulsion = self.rotors.loads, self.propulsion

        def at(value: Tensor) -> Tensor:
            return value[..., k]

        speed = at(loads.inflow.rotation_speed)
        return RotorAnalysis(
            rotor=name,
            segment=segment,
            thrust=at(loads.thrust),
            torque=at(loads.torque),
            power=at(loads.power),
            speed=speed,
            tip_mach=speed * at(loads.rotor.radius) / at(loads.inflow.speed_of_sound),
            efficiency=at(self.rotors.efficiency),
            torque_share=None if propulsion is None else at(propulsion.torque_share),
            electrical_power=None if propulsion is None else at(propulsion.operation.input_power),
        )

    @property
    def figure_of_merit(self) -> Tensor:
        """(..., rotor that lifts) in the segment whose noise is limited."""
        points = self.schedule.in_segment(self.mission.noise_segment.name)
        return self.rotors.efficiency[..., points]

    @property
    def mean_figure_of_merit(self) -> Tensor:
        """(...,) of the same rotors."""
        return self.figure_of_merit.mean(-1)

    def by_segment(self, values: Tensor) -> dict[str, Any]:
        """Values (segment, ...) by the names of segments."""
        return dict(zip(self.schedule.segment_names, values, strict=True))

    def defined_efficiency(self) -> Tensor:
        """(..., point): efficiency, NaN where the air drives the rotor or it brakes, and of lift rotors in edgewise flow."""
        is_defined = self.rotors.loads.is_propelling & ~self.schedule.is_edgewise
        return torch.where(is_defined, self.rotors.efficiency, torch.nan)


def is_whole_aircraft(analysis: Any) -> bool:
    """Whether an analysis of any problem is one of the whole aircraft on its mission."""
    return isinstance(analysis, Analysis) and analysis.energy is not None
