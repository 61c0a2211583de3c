"""The models: a vehicle and a mission as a callable from designs to analyses, stage after stage."""

from collections.abc import Sequence
from typing import Protocol

import torch
from torch import Tensor
from typing_extensions import TypeVar

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.disciplines.trim import TrimResidual
from lpc_mdo.geometry.shape import Geometry
from lpc_mdo.model.aerodynamics import Aerodynamics
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.blade_airfoils import BladePolar
from lpc_mdo.model.design import Design, shape_parameters
from lpc_mdo.model.energy import Energy
from lpc_mdo.model.flight import Flight
from lpc_mdo.model.noise import Noise
from lpc_mdo.model.propulsion import Motors
from lpc_mdo.model.rotors import Rotors
from lpc_mdo.model.schedule import Schedule
from lpc_mdo.model.trim import Trim
from lpc_mdo.model.weights import Weights
from lpc_mdo.numerics.constants import GRAVITY

AnalysisT_co = TypeVar("AnalysisT_co", covariant=True, default=Analysis)


class Model(Protocol[AnalysisT_co]):
    """What problems, runs and reports need of a model, whatever it evaluates."""

    vehicle: Vehicle
    mission: Mission
    schedule: Schedule
    geometry: Geometry
    noise: Noise
    rotors: Rotors

    def __call__(self, design: Design) -> AnalysisT_co:
        """The analysis of a design; leading dimensions batch."""
        ...


class Analyzer:
    """The whole aircraft on its mission; constant work is done once, here.

    `geometry`: that of a vehicle of the same shape, which is expensive to build; default: made of `vehicle`. `polars`:
    one a rotor; default: those of the sections that the file names. is_mirrored: every design has starboard rotors and
    motors like their port twins, whose loads then serve for both.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        mission: Mission,
        geometry: Geometry | None = None,
        polars: Sequence[BladePolar] | None = None,
        *,
        is_mirrored: bool = False,
    ) -> None:
        self.vehicle, self.mission = vehicle, mission
        self.schedule = schedule = Schedule(vehicle, mission, is_mirrored=is_mirrored)
        self.geometry = geometry or Geometry(vehicle)
        self.flight, self.weights = Flight(schedule), Weights(vehicle)
        self.rotors, self.motors = Rotors(schedule, polars), Motors(vehicle)
        self.aerodynamics, self.trim = Aerodynamics(schedule), Trim(schedule)
        self.noise, self.energy = Noise(schedule), Energy(schedule)
        self.span = torch.tensor(vehicle.wing.area * vehicle.wing.aspect_ratio, dtype=torch.float64).sqrt()

    @property
    def polars(self) -> tuple[BladePolar, ...]:
        """One a rotor."""
        return self.rotors.polars

    def __call__(self, design: Design) -> Analysis:
        shape = self.geometry(shape_parameters(design))
        flight = self.flight(design)
        motors = self.motors.sized(design)
        speed = flight.speed[..., self.energy.main]
        weights = self.weights(design, shape, motors, speed)
        rotors = self.rotors(design, flight)
        propulsion = self.motors(motors, rotors)
        aerodynamics = self.aerodynamics(design, shape, flight, weights.total.mass)
        trim = self.trim(shape, flight, weights.total, rotors, aerodynamics)
        noise, observed_dba = self.noise(rotors, shape.hubs)
        return Analysis(
            schedule=self.schedule,
            design=design,
            shape=shape,
            flight=flight,
            weights=weights,
            rotors=rotors,
            trim=trim,
            scaled_trim=scaled(trim, weights.total.mass, self.span),
            noise=noise,
            observed_dba=observed_dba,
            propulsion=propulsion,
            aerodynamics=aerodynamics,
            energy=self.energy(design, flight, propulsion.solved_operation),
        )


def scaled(trim: TrimResidual, mass: Tensor, span: Tensor) -> Tensor:
    """(..., segment, 6): forces over weight, moments over weight x semi-span."""
    return trim.scaled((mass * GRAVITY)[..., None], 0.5 * span.expand(mass.shape)[..., None])
