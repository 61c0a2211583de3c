"""The second problem: quiet against efficient blades of the lift rotors in hover, trimmed; 64 variables with eight rotors."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from math import degrees, radians
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.config import ConfigurationError, Mission, Vehicle
from lpc_mdo.disciplines.hover_noise import observer_position
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.analyzer import Analyzer, scaled
from lpc_mdo.model.blade_airfoils import extrapolated_shares
from lpc_mdo.model.design import Design
from lpc_mdo.model.flight import Flight
from lpc_mdo.model.noise import Noise
from lpc_mdo.model.rotors import Rotors
from lpc_mdo.model.schedule import Schedule
from lpc_mdo.model.trim import Trim
from lpc_mdo.numerics.bsplines import basis_matrix, blade_degree
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.outputs import AXES
from lpc_mdo.problems.problem import Constraint, Objective, Problem, Variable
from lpc_mdo.problems.variables import bounded_variable, rotor_speeds

CHORD_POINTS = 3
NOISE_SCALE = 10.0  # dB(A), and
MERIT_SCALE = 0.1  # the differences that the study's front spans, to one figure: they make the two parts comparable


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
    """The model's stages with one hovering segment alone, that whose noise the mission limits; mass, centre of gravity and hubs are
    those of the baseline aircraft.

    Blades of a design are those of the rotors that lift: (..., lift rotor, control point).
    """

    def __init__(self, vehicle: Vehicle, mission: Mission, observer: Observer) -> None:
        self.vehicle, self.mission = vehicle, mission
        whole = Analyzer(vehicle, mission)
        start = gross_weight_problem(vehicle, mission)
        with torch.no_grad():
            baseline = whole(start.unpack(start.x0))
        self.weights, self.shape, self.span = baseline.weights, baseline.shape, whole.span
        self.geometry = whole.geometry
        self.schedule = schedule = Schedule(vehicle, mission, names=(mission.noise_segment.name,))
        self.flight, self.rotors = Flight(schedule), Rotors(schedule, whole.polars)
        self.trim, self.noise = Trim(schedule), Noise(schedule)
        self.baseline = replace(baseline.design, pitch=torch.zeros(0, dtype=torch.float64), of_segments={})
        hubs = self.shape.hubs[self.noise.rotors]
        self.observer = observer_position(hubs.mean(-2), observer.distance, observer.elevation)

    def __call__(self, design: Design) -> Analysis:
        flight = self.flight(design)
        rotors = self.rotors(design, flight)
        total = self.weights.total
        trim = self.trim(self.shape, flight, total, rotors)
        noise = self.noise.at(rotors, self.shape.hubs, self.observer)
        return Analysis(
            schedule=self.schedule,
            design=design,
            shape=self.shape,
            flight=flight,
            weights=self.weights,
            rotors=rotors,
            trim=trim,
            scaled_trim=scaled(trim, total.mass, self.span),
            noise=noise,
            observed_dba=noise.total_dba[..., None],
        )

    def complete(self, values: Mapping[str, Tensor]) -> Design:
        """The baseline aircraft with these blades and speeds."""
        batch = values["blade_twist"].shape[:-2]
        aircraft = {name: value.expand((*batch, *value.shape)) for name, value in self.baseline.values().items()}
        return Design.of(aircraft | dict(values))


def aeroacoustic_problem(
    vehicle: Vehicle,
    mission: Mission,
    trade: WeightedSum | LeastMerit = WeightedSum(),
    observer: Observer = PUBLISHED_OBSERVER,
) -> Problem[Analysis]:
    """The 64-variable problem for one point of the trade between noise and efficiency."""
    return aeroacoustic_front(vehicle, mission, [trade], observer)[0]


def aeroacoustic_front(
    vehicle: Vehicle,
    mission: Mission,
    trades: Sequence[WeightedSum | LeastMerit],
    observer: Observer = PUBLISHED_OBSERVER,
) -> list[Problem[Analysis]]:
    """One problem a trade, all with the same analysis."""
    analyze = _analyzer(vehicle, mission, observer)
    variables = _variables(analyze.schedule)
    trim = Constraint("trim_residual", "1", imposed_trim, lower=0.0, upper=0.0, scale=0.1)
    where = {
        "observer_distance_m": observer.distance,
        "observer_elevation_deg": degrees(observer.elevation),
    }
    problems = []
    for trade in trades:
        if isinstance(trade, WeightedSum):
            objective, formulation = _weighted(trade.noise_weight), "paper"
            rows: tuple[Constraint[Analysis], ...] = (trim,)
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
                complete=analyze.complete,
                outputs=_outputs,
                settings=asdict(trade) | where,
            )
        )
    return problems


@lru_cache(maxsize=2)
def _analyzer(vehicle: Vehicle, mission: Mission, observer: Observer) -> HoverAnalyzer:
    """Kept for the next point of a front, whose analysis is the same."""
    return HoverAnalyzer(vehicle, mission, observer)


def _weighted(noise_weight: float) -> Objective[Analysis]:
    def objective(a: Analysis) -> Tensor:
        noise, merit = a.noise.total_dba / NOISE_SCALE, a.mean_figure_of_merit / MERIT_SCALE
        return noise_weight * noise - (1.0 - noise_weight) * merit

    return Objective("noise_and_merit", "1", objective)


def _least_merit(least: float) -> Constraint[Analysis]:
    return Constraint("mean_figure_of_merit", "1", lambda a: a.mean_figure_of_merit, lower=least, scale=MERIT_SCALE)


def _variables(schedule: Schedule) -> tuple[Variable, ...]:
    """Bounds as in the main problem; chord starts as the file's taper."""
    vehicle = schedule.vehicle
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
        *(replace(rotor_speeds(schedule, group), twins=()) for group in schedule.speed_groups),
    )


def imposed_trim(a: Analysis) -> Tensor:
    """Vertical force and the three moments (..., 4): vertical rotors exert no other force."""
    return a.scaled_trim[..., 0, 2:]


def _outputs(analysis: Analysis, start: Analysis) -> dict[str, Any]:
    """What a designer reads first, with the same names as in the main problem where the quantity is the same."""
    names = [rotor for rotor, _ in analysis.schedule.point_names]
    loads, noise = analysis.rotors.loads, analysis.noise
    extrapolated = extrapolated_shares(loads, analysis.rotors.polars)
    return {
        "figure_of_merit_mean": analysis.mean_figure_of_merit,
        "figure_of_merit_mean_initial": start.mean_figure_of_merit,
        "figure_of_merit": dict(zip(names, analysis.figure_of_merit, strict=True)),
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
        "trim_residual": analysis.scaled_trim[0],
        "trim_residual_axes": AXES,
    }
