"""Noise and motors of an analysed design as figures draw them: directivity, spectrum, ground contours, motor map."""

import math
from itertools import islice
from typing import Any

import torch
from matplotlib.figure import Figure

from lpc_mdo.config import Requirements
from lpc_mdo.disciplines.absorption import atmospheric_absorption
from lpc_mdo.disciplines.fly_over import FlightSource, fly_over
from lpc_mdo.disciplines.hover_noise import TONAL_MODELS, BroadbandModel, hover_noise, observer_position
from lpc_mdo.disciplines.motor_limits import efficiency_map
from lpc_mdo.disciplines.noise_map import HoverSource, ground_contour, sphere_points
from lpc_mdo.disciplines.sound import (
    bands_in_third_octaves,
    sound_pressure_level,
    third_octave_centers,
    tones_in_third_octaves,
)
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.rotor_noise import blade_loading
from lpc_mdo.numerics.present import present
from lpc_mdo.problems.aeroacoustic import HoverAnalyzer
from lpc_mdo.reporting import wording
from lpc_mdo.reporting.figures import directivity, motor_efficiency_map, noise_contour, spectrum

DISTANCE = 76.2  # m, 250 ft
BROADBAND_NAMES: dict[BroadbandModel, str] = {
    "schlegel_king_mull": "Schlegel-King-Mull",
    "gill_lee": "Gill-Lee",
    "brooks_pope_marcolini": "Brooks-Pope-Marcolini",
}
OBSERVERS_AT_ONCE = 8  # bounds the memory of strip-by-strip noise


def humid(frequency: torch.Tensor) -> torch.Tensor:
    """15 degrees, sea level, 70 % humidity."""
    state = (torch.tensor(v, dtype=torch.float64) for v in (288.15, 101325.0, 0.7))
    return atmospheric_absorption(frequency, *state)


def hover_source(a: Analysis) -> HoverSource:
    """The lift rotors of an analysed design in hover, each with its own blades."""
    points = torch.tensor(a.schedule.in_segment(a.mission.noise_segment.name))
    loads, hubs = a.rotors.loads.at(points), a.shape.hubs[a.schedule.rotor[points]]
    polars = [a.rotors.polars[k] for k in points]
    return HoverSource(blade_loading(loads, polars), loads.thrust, loads.rotor.radius, loads.angle_of_attack, hubs)


def hover_noise_data(source: HoverSource, requirements: Requirements) -> dict[str, Any]:
    """What the figures of hover noise draw: directivity and spectrum at one observer by model, contour on the ground by those
    that the mission requires."""
    polar = torch.linspace(0.0, 2.0 * math.pi, 121, dtype=torch.float64)
    center, zero = source.hubs.mean(0), torch.zeros(1, dtype=torch.float64)
    around = sphere_points(center, DISTANCE, polar, zero)[:, 0]
    rotors = (source.loading, source.thrust, source.radius, source.angle_of_attack, source.hubs)
    centers, observer = third_octave_centers(), observer_position(center, DISTANCE, math.radians(45.0))
    levels, tones, broadband = {}, {}, {}
    # The louder first: the figure draws the next in front of it.
    for name in ("unsteady_loading", "steady_loading"):
        levels[f"tones, {wording.words(name)}"] = hover_noise(*rotors, around, tonal_model=TONAL_MODELS[name]).tonal_dba
        part = hover_noise(*rotors, observer, tonal_model=TONAL_MODELS[name]).tonal
        energy = tones_in_third_octaves(part.frequency, part.pressure_squared, centers)
        tones[wording.words(name)] = sound_pressure_level(energy.sum(0))
    for name, label in islice(BROADBAND_NAMES.items(), 2):
        levels[f"broadband, {label}"] = hover_noise(*rotors, around, broadband_model=name).broadband_dba
        rest = hover_noise(*rotors, observer, broadband_model=name).broadband
        energy = bands_in_third_octaves(rest.frequency, rest.bands, centers, rest.thirds)
        broadband[label] = sound_pressure_level(energy.sum(0))
    share = torch.linspace(-1.0, 1.0, 25, dtype=torch.float64)
    grid = 400.0 * share * share.abs() ** 0.5
    return {
        "directivity": {"polar_rad": polar, "levels_dba": levels, "distance_m": DISTANCE},
        "spectrum": {
            "centers_Hz": centers,
            "tones_db": tones,
            "broadband_db": broadband,
            "where": f"45° below the disks, {DISTANCE:g} m",
        },
        "contour": {
            "ahead_m": grid,
            "starboard_m": grid,
            "level_dba": ground_contour(
                source,
                DISTANCE,
                -grid,
                grid,
                TONAL_MODELS[requirements.tonal_model],
                humid,
                requirements.broadband_model,
            ),
            "what": f"hover at {DISTANCE:.0f} m",
        },
    }


def blades_noise_data(analyzer: HoverAnalyzer, analysis: Analysis) -> dict[str, Any]:
    """Directivity and spectrum of the blades by the models of their own problem, at its observer's distance."""
    center = analysis.shape.hubs[analyzer.noise.rotors].mean(0)
    noise, requirements = analysis.noise, analyzer.mission.requirements
    arm = analyzer.observer - center
    distance = float(torch.linalg.vector_norm(arm))
    polar = torch.linspace(0.0, 2.0 * math.pi, 121, dtype=torch.float64)
    around = sphere_points(center, distance, polar, torch.zeros(1, dtype=torch.float64))[:, 0]
    parts = [analyzer.noise.at(analysis.rotors, analysis.shape.hubs, some) for some in around.split(OBSERVERS_AT_ONCE)]
    heard = {
        name: torch.cat([getattr(part, f"{name}_dba") for part in parts]) for name in ("tonal", "broadband", "total")
    }
    centers = third_octave_centers()
    tones = tones_in_third_octaves(noise.tonal.frequency, noise.tonal.pressure_squared, centers)
    rest = bands_in_third_octaves(noise.broadband.frequency, noise.broadband.bands, centers, noise.broadband.thirds)
    elevation = math.degrees(math.asin(-float(arm[2]) / distance))
    return {
        "directivity": {
            "polar_rad": polar,
            "levels_dba": {"tones": heard["tonal"], "broadband": heard["broadband"], "together": heard["total"]},
            "distance_m": distance,
        },
        "spectrum": {
            "centers_Hz": centers,
            "tones_db": {wording.words(requirements.tonal_model): sound_pressure_level(tones.sum(0))},
            "broadband_db": {BROADBAND_NAMES[requirements.broadband_model]: sound_pressure_level(rest.sum(0))},
            "where": f"{elevation:.3g}° below the disks, {distance:.4g} m",
        },
    }


def finite_part(noise: dict[str, Any]) -> dict[str, Any]:
    """The same without models that give no level for this design, as beyond the speed of sound, and figures left without any."""

    def kept(value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        return {
            name: item
            for name, item in value.items()
            if not isinstance(item, torch.Tensor) or bool(item.isfinite().all())
        }

    parts = {name: {key: kept(value) for key, value in part.items()} for name, part in noise.items()}
    return {name: part for name, part in parts.items() if {} not in part.values() and kept(part).keys() == part.keys()}


def fly_over_figure(a: Analysis, speed: float) -> Figure:
    """A pass at 300 m over the middle of the map, exposure of 3 km of track."""
    points = torch.tensor(a.schedule.in_segment(a.main_segment.name))
    loads = a.rotors.loads.at(points)
    loading = blade_loading(loads, [a.rotors.polars[k] for k in points])
    radius = loads.rotor.radius
    at_70_percent = (loading.radius - 0.7 * radius[:, None]).abs().argmin(-1, keepdim=True)
    thickness = (loading.thickness_to_chord * loading.chord).gather(-1, at_70_percent)[:, 0]
    hubs = a.shape.hubs[a.schedule.rotor[points]]
    source = FlightSource(loading, loads.thrust, radius, thickness, hubs - hubs.mean(0))
    ahead = torch.linspace(-1500.0, 1500.0, 41, dtype=torch.float64)
    aside = torch.linspace(-800.0, 800.0, 25, dtype=torch.float64)
    x, y = torch.meshgrid(-ahead, aside, indexing="ij")
    velocity, start = (torch.tensor(v, dtype=torch.float64) for v in ([-speed, 0.0, 0.0], [1500.0, 0.0, 300.0]))
    time = torch.linspace(0.0, 3000.0 / speed, 121, dtype=torch.float64)
    heard = fly_over(source, velocity, start, time, torch.stack([x, y, torch.zeros_like(x)], dim=-1), humid)
    return noise_contour.plot(ahead, aside, heard.exposure_dba, "exposure, 3 km of flight at 300 m", "dB(A) re 1 s")


def motor_map_data(a: Analysis) -> dict[str, Any]:
    """Efficiency of the first pusher's motor over speed and torque, and where it works."""
    schedule, propulsion = a.schedule, present(a.propulsion, "propulsion")
    pusher = next(i for i, rotor in enumerate(a.vehicle.rotors) if rotor.kind == "pusher")
    points = [k for k, point in enumerate(schedule.points) if point.rotor == pusher]
    circuit = propulsion.motors.circuit.at(torch.tensor(pusher))
    speeds = propulsion.loads.inflow.rotation_speed * a.vehicle.motors.gear_ratio
    torque = propulsion.operation.output_power / speeds
    top = 1.3 * float(torque[points].max())
    result = efficiency_map(
        circuit,
        torch.linspace(0.01 * top, top, 60, dtype=torch.float64),
        torch.linspace(20.0, 1100.0, 75, dtype=torch.float64),
    )
    return {
        "name": a.vehicle.rotors[pusher].name,
        "speed_rad_per_s": result.speed,
        "torque_N_m": result.torque,
        "efficiency": result.efficiency,
        "limit_N_m": result.limit,
        "points": {schedule.point_names[k][1]: (speeds[k], torque[k]) for k in points},
    }


def acoustic_figures(a: Analysis) -> dict[str, Figure]:
    """By name, for one design; some seconds for the ground contours. To be drawn and saved within `style.look()`."""
    noise = hover_noise_data(hover_source(a), a.mission.requirements)
    motor = motor_map_data(a)
    return {
        "directivity": directivity.plot(*noise["directivity"].values()),
        "spectrum": spectrum.plot(*noise["spectrum"].values()),
        "contour_hover": noise_contour.plot(*noise["contour"].values()),
        "contour_fly_over": fly_over_figure(a, float(a.main_segment.speed)),
        "motor_efficiency": motor_efficiency_map.plot(
            *(motor[key] for key in ("speed_rad_per_s", "torque_N_m", "efficiency", "limit_N_m", "points", "name"))
        ),
    }
