"""The second problem: quiet against efficient blades of the lift rotors in hover, trimmed; 64 variables with eight rotors."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from math import degrees, radians
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.config import ConfigurationError, Mission, Vehicle
from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, RotorLoads
from lpc_mdo.disciplines.hover_noise import HoverNoise, observer_position
from lpc_mdo.disciplines.trim import TrimResidual, trim_residual
from lpc_mdo.model.analysis import BLADE_STATIONS, Analyzer
from lpc_mdo.model.blade_airfoils import BladePolar, extrapolated_shares, rotor_loads
from lpc_mdo.model.rotor_noise import heard_in_hover
from lpc_mdo.numerics.bsplines import basis_matrix, blade_degree
from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.problems.gross_weight import bounded_variable, gross_weight_problem
from lpc_mdo.problems.problem import Constraint, Objective, Problem, Variable

CHORD_POINTS = 3
NOISE_SCALE = 10.0  # dB(A), and
MERIT_SCALE = 0.1  # the differences that the study's front spans, to one figure: they make the two parts comparable


@dataclass(frozen=True)
class HoverDesign:
    """Leading dimensions batch; rotors in the order of the vehicle file."""

    blade_twist: Tensor  # (..., rotor, 4) rad, B-spline control points from root to tip
    blade_chord: Tensor  # (..., rotor, 3) m, likewise
    lift_rotor_speed: Tensor  # (..., rotor) rad/s


@dataclass(frozen=True)
class HoverAnalysis:
    """The hovering aircraft; leading dimensions as in the design."""

    design: HoverDesign
    loads: RotorLoads  # (..., rotor)
    polars: tuple[BladePolar, ...]  # one a rotor
    noise: HoverNoise
    trim: TrimResidual  # (..., 3)
    scaled_trim: Tensor  # (..., 6) forces over weight, moments over weight x semi-span

    @property
    def mean_figure_of_merit(self) -> Tensor:
        """(...,), mean of the lift rotors."""
        return self.loads.figure_of_merit.mean(-1)


@dataclass(frozen=True)
class Observer:
    """Who listens: distance m from the middle of the lift rotors, elevation rad from the disk plane, ahead and below.

    Raises ConfigurationError for a value out of range.
    """

    distance: float = 76.2  # 250 ft [M]
    elevation: float = radians(45.0)  # [M]

    def __post_init__(self) -> None:
        if not 10.0 <= self.distance <= 2000.0:
            raise ConfigurationError(
                f"observer distance = {self.distance:.6g} m is not allowed; it must lie between 10 and 2000 m."
            )
        if not 0.0 <= self.elevation <= radians(90.0):
            raise ConfigurationError(
                f"observer angle = {degrees(self.elevation):.6g} deg is not allowed; it must lie between 0 and 90 deg."
            )


PUBLISHED_OBSERVER = Observer()


@dataclass(frozen=True)
class WeightedSum:
    """Minimize noise_weight x level/10 dB(A) - (1 - noise_weight) x mean figure of merit/0.1."""

    noise_weight: float = 0.5

    def __post_init__(self) -> None:
        if not 0.0 <= self.noise_weight <= 1.0:
            raise ConfigurationError(f"weight = {self.noise_weight:g} is not allowed; it must lie between 0 and 1.")


@dataclass(frozen=True)
class LeastMerit:
    """Minimize the level with a mean figure of merit of at least `figure_of_merit`: the epsilon-constraint method."""

    figure_of_merit: float

    def __post_init__(self) -> None:
        if not 0.0 < self.figure_of_merit < 1.0:
            raise ConfigurationError(
                f"figure of merit = {self.figure_of_merit:g} is not allowed; it must lie between 0 and 1."
            )


class HoverAnalyzer:
    """Callable HoverDesign -> HoverAnalysis; mass, centre of gravity and hubs are those of the baseline aircraft."""

    def __init__(self, vehicle: Vehicle, mission: Mission, observer: Observer) -> None:
        self.vehicle, self.mission = vehicle, mission
        whole = Analyzer(vehicle, mission)
        start = gross_weight_problem(vehicle, mission)
        with torch.no_grad():
            baseline = whole(start.unpack(start.x0))
        self.polars = whole.polars[:-1]
        self.mass, self.center_of_gravity = baseline.gross_mass, baseline.weights.total.center_of_gravity
        self.semi_span = 0.5 * whole.span
        count = len(vehicle.lift_rotors)
        self.hubs = baseline.shape.hubs[:count]
        self.spin, self.blades = whole.spin[:count], whole.blades[:count]
        self.radius = torch.tensor([rotor.radius for rotor in vehicle.lift_rotors], dtype=torch.float64)
        self.hub_radius = self.radius * whole.root_cutout[:count]
        self.observer = observer_position(self.hubs.mean(-2), observer.distance, observer.elevation)
        self.air = standard_atmosphere(
            torch.tensor(mission.hover.altitude, dtype=torch.float64), mission.temperature_offset
        )
        self.twist_basis = whole.twist_basis
        radial = (torch.arange(BLADE_STATIONS, dtype=torch.float64) + 0.5) / BLADE_STATIONS
        self.chord_basis = basis_matrix(radial, CHORD_POINTS, CHORD_POINTS - 1)

    def __call__(self, design: HoverDesign) -> HoverAnalysis:
        shape = design.lift_rotor_speed.shape
        rotor = Rotor(
            radius=self.radius.expand(shape),
            hub_radius=self.hub_radius.expand(shape),
            chord=design.blade_chord @ self.chord_basis.T,
            twist=design.blade_twist @ self.twist_basis.T,
            blades=self.blades.expand(shape),
        )
        inflow = Inflow(
            axial_velocity=torch.zeros_like(design.lift_rotor_speed),
            rotation_speed=design.lift_rotor_speed,
            density=self.air.density.expand(shape),
            speed_of_sound=self.air.speed_of_sound.expand(shape),
            dynamic_viscosity=self.air.dynamic_viscosity.expand(shape),
        )
        loads = rotor_loads(rotor, inflow, self.polars)
        trim = self._trim(loads)
        weight = self.mass * GRAVITY
        return HoverAnalysis(
            design, loads, self.polars, self.noise_at(loads, self.observer), trim, trim.scaled(weight, self.semi_span)
        )

    def _trim(self, loads: RotorLoads) -> TrimResidual:
        up = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
        return trim_residual(
            forces=loads.thrust[..., None] * up,
            points=self.hubs,
            moments=-(self.spin * loads.torque).sum(-1, keepdim=True) * up,
            center_of_gravity=self.center_of_gravity,
            mass=self.mass,
            pitch=torch.zeros_like(self.mass),
        )

    def noise_at(self, loads: RotorLoads, observer: Tensor) -> HoverNoise:
        """What an observer (..., 3) m hears of these loads by the mission's models; several make the leading dimensions."""
        return heard_in_hover(loads, self.polars, self.hubs, observer, self.mission.requirements)


def aeroacoustic_problem(
    vehicle: Vehicle,
    mission: Mission,
    trade: WeightedSum | LeastMerit = WeightedSum(),
    observer: Observer = PUBLISHED_OBSERVER,
) -> Problem[HoverAnalysis]:
    """The 64-variable problem for one point of the trade between noise and efficiency."""
    return aeroacoustic_front(vehicle, mission, [trade], observer)[0]


def aeroacoustic_front(
    vehicle: Vehicle,
    mission: Mission,
    trades: Sequence[WeightedSum | LeastMerit],
    observer: Observer = PUBLISHED_OBSERVER,
) -> list[Problem[HoverAnalysis]]:
    """One problem a trade, all with the same analysis."""
    analyze, variables = _analyzer(vehicle, mission, observer), _variables(vehicle)
    trim = Constraint("trim_residual", "1", imposed_trim, lower=0.0, upper=0.0, scale=0.1)
    where = {
        "observer_distance_m": observer.distance,
        "observer_elevation_deg": degrees(observer.elevation),
    }
    problems = []
    for trade in trades:
        if isinstance(trade, WeightedSum):
            objective, rows, formulation = _weighted(trade.noise_weight), (trim,), "paper"
        else:
            objective = Objective("sound_pressure_level", "dB(A)", lambda a: a.noise.total_dba, NOISE_SCALE)
            rows, formulation = (trim, _least_merit(trade.figure_of_merit)), "epsilon-constraint"
        problems.append(
            Problem(
                name="aeroacoustic",
                formulation=formulation,
                variables=variables,
                constraints=rows,
                objective=objective,
                analyze_design=analyze,
                complete=lambda values: HoverDesign(**values),
                outputs=lambda a, start: _outputs(a, start, vehicle),
                settings=asdict(trade) | where,
            )
        )
    return problems


@lru_cache(maxsize=2)
def _analyzer(vehicle: Vehicle, mission: Mission, observer: Observer) -> HoverAnalyzer:
    """Kept for the next point of a front, whose analysis is the same."""
    return HoverAnalyzer(vehicle, mission, observer)


def _weighted(noise_weight: float) -> Objective[HoverAnalysis]:
    def objective(a: HoverAnalysis) -> Tensor:
        noise, merit = a.noise.total_dba / NOISE_SCALE, a.mean_figure_of_merit / MERIT_SCALE
        return noise_weight * noise - (1.0 - noise_weight) * merit

    return Objective("noise_and_merit", "1", objective)


def _least_merit(least: float) -> Constraint[HoverAnalysis]:
    return Constraint("mean_figure_of_merit", "1", lambda a: a.mean_figure_of_merit, lower=least, scale=MERIT_SCALE)


def _variables(vehicle: Vehicle) -> tuple[Variable, ...]:
    """Bounds as in the main problem; chord starts as the file's taper."""
    lift, bounds = vehicle.lift_rotors, vehicle.bounds
    along = torch.linspace(0.0, 1.0, CHORD_POINTS, dtype=torch.float64)
    count, twists = len(lift[0].chord), len(lift[0].twist)
    basis = basis_matrix(along, count, blade_degree(count))
    chord = torch.tensor([rotor.chord for rotor in lift], dtype=torch.float64) @ basis.T

    return (
        bounded_variable(
            "blade_twist", "rad", bounds.blade_twist, [rotor.twist for rotor in lift], (len(lift), twists)
        ),
        bounded_variable("blade_chord", "m", bounds.blade_chord, chord, (len(lift), CHORD_POINTS)),
        bounded_variable(
            "lift_rotor_speed", "rad/s", bounds.lift_rotor_speed, [rotor.speed for rotor in lift], (len(lift),)
        ),
    )


def imposed_trim(a: HoverAnalysis) -> Tensor:
    """Vertical force and the three moments (..., 4): vertical rotors exert no other force."""
    return a.scaled_trim[..., 2:]


def _outputs(analysis: HoverAnalysis, start: HoverAnalysis, vehicle: Vehicle) -> dict[str, Any]:
    """What a designer reads first, with the same names as in the main problem where the quantity is the same."""
    names = [rotor.name for rotor in vehicle.lift_rotors]
    loads, noise = analysis.loads, analysis.noise
    extrapolated = extrapolated_shares(loads, analysis.polars)
    return {
        "figure_of_merit_mean": analysis.mean_figure_of_merit,
        "figure_of_merit_mean_initial": start.mean_figure_of_merit,
        "figure_of_merit": dict(zip(names, loads.figure_of_merit, strict=True)),
        "sound_pressure_level_dba": noise.total_dba,
        "sound_pressure_level_initial_dba": start.noise.total_dba,
        "sound_pressure_level_tonal_dba": noise.tonal_dba,
        "sound_pressure_level_broadband_dba": noise.broadband_dba,
        "sound_pressure_level_unweighted_db": noise.total_db,
        "thrust_n": dict(zip(names, loads.thrust, strict=True)),
        "shaft_power_kw": dict(zip(names, loads.power / 1e3, strict=True)),
        "shaft_power_total_kw": loads.power.sum(-1) / 1e3,
        "tip_speed_m_per_s": dict(zip(names, loads.inflow.rotation_speed * loads.rotor.radius, strict=True)),
        "airfoil_extrapolated_share": dict(zip(names, extrapolated, strict=True)),
        "trim_residual": analysis.scaled_trim,
        "trim_residual_axes": ["Fx", "Fy", "Fz", "Mx", "My", "Mz"],
    }
