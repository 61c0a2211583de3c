"""Wing, tail and parasitic drag of all segments flown on the wing, in one batch."""

from dataclasses import dataclass, fields

from torch import Tensor

from lpc_mdo.config import Vehicle
from lpc_mdo.disciplines.atmosphere import Atmosphere
from lpc_mdo.disciplines.trim import stall_speed
from lpc_mdo.disciplines.vortex_lattice import LatticeLoads, vortex_lattice
from lpc_mdo.geometry.actuation import Axis, rotate
from lpc_mdo.geometry.shape import Shape
from lpc_mdo.model.design import Design
from lpc_mdo.model.flight import FlightConditions
from lpc_mdo.model.inclined_rotors import wind_direction
from lpc_mdo.model.parasitic_drag import ParasiticDrag
from lpc_mdo.model.schedule import Schedule
from lpc_mdo.surrogates.airfoil import AirfoilPolar
from lpc_mdo.surrogates.airfoil_names import resolve_airfoil


@dataclass(frozen=True)
class AerodynamicLoads:
    """Each (..., wingborne) unless noted."""

    lattice: LatticeLoads
    parasitic_items: tuple[str, ...]
    parasitic_areas: Tensor  # (..., wingborne, item) m^2
    parasitic_points: Tensor  # (..., item, 3) m, where each acts
    wind: Tensor  # (..., wingborne, 3) unit vector of the free stream, geometry axes
    dynamic_pressure: Tensor  # Pa
    lift: Tensor  # N
    induced_drag: Tensor  # N
    parasitic_drag: Tensor  # N
    lift_coefficient: Tensor
    drag_coefficient: Tensor
    parasitic_drag_coefficient: Tensor
    lift_to_drag: Tensor
    reynolds: Tensor  # of the wing's mean aerodynamic chord
    mach: Tensor
    maximum_lift_coefficient: Tensor
    stall_speed: Tensor  # m/s
    reference_area: Tensor  # (...,) m^2

    @property
    def parasitic_area(self) -> dict[str, Tensor]:
        """m^2 by item, each (..., wingborne)."""
        return dict(zip(self.parasitic_items, self.parasitic_areas.unbind(-1), strict=True))


class Aerodynamics:
    """Callable stage: design, shape, flight conditions and mass (...,) kg -> AerodynamicLoads.

    The wing stalls as the polar of its own section does.
    """

    def __init__(self, schedule: Schedule) -> None:
        self.schedule, self.vehicle = schedule, schedule.vehicle
        self.wing_polar: AirfoilPolar = wing_polar(schedule.vehicle)
        self.parasitic_drag = ParasiticDrag(schedule.vehicle)

    def __call__(self, design: Design, shape: Shape, flight: FlightConditions, mass: Tensor) -> AerodynamicLoads:
        index = self.schedule.wingborne
        air = Atmosphere(*(getattr(flight.air, field.name)[..., index] for field in fields(Atmosphere)))
        speed, density = flight.speed[..., index], air.density
        wind = wind_direction(flight.angle_of_attack[..., index])
        hinge = Axis.lateral(shape.tail_hinge[..., None, :])
        tail_mesh = rotate(shape.tail_mesh[..., None, :, :, :], hinge, design.tail_deflection)
        wing_mesh = shape.wing_mesh[..., None, :, :, :].expand(*tail_mesh.shape[:-3], *shape.wing_mesh.shape[-3:])
        reference = shape.wing.aerodynamic_center[..., None, :]
        lattice = vortex_lattice([wing_mesh, tail_mesh], wind * speed[..., None], density, reference, is_symmetric=True)
        pressure = 0.5 * density * speed**2
        areas = self.parasitic_drag.areas(shape, speed, air)
        total_area, area = areas.sum(-1), shape.wing.area[..., None]
        parasitic = pressure * total_area
        drag_force = lattice.induced_drag + parasitic
        mach = speed / air.speed_of_sound
        reynolds = density * speed * shape.wing.mean_chord[..., None] / air.dynamic_viscosity
        factor = self.vehicle.wing.maximum_lift_factor
        maximum_lift = factor * self.wing_polar.maximum_lift_coefficient(reynolds, mach)
        return AerodynamicLoads(
            lattice=lattice,
            parasitic_items=self.parasitic_drag.names,
            parasitic_areas=areas,
            parasitic_points=self.parasitic_drag.points(shape),
            wind=wind,
            dynamic_pressure=pressure,
            lift=lattice.lift,
            induced_drag=lattice.induced_drag,
            parasitic_drag=parasitic,
            lift_coefficient=lattice.lift / (pressure * area),
            drag_coefficient=drag_force / (pressure * area),
            parasitic_drag_coefficient=total_area / area,
            lift_to_drag=lattice.lift / drag_force,
            reynolds=reynolds,
            mach=mach,
            maximum_lift_coefficient=maximum_lift,
            stall_speed=stall_speed(mass[..., None] * flight.load_factor[index].abs(), density, area, maximum_lift),
            reference_area=shape.wing.area,
        )


def wing_polar(vehicle: Vehicle) -> AirfoilPolar:
    """The trained polar of the wing's section. Raises ValueError that says how to make one if there is none."""
    wing = vehicle.wing
    return resolve_airfoil(wing.polar or wing.airfoil, key="wing.polar" if wing.polar else "wing.airfoil")
