"""Tones, broadband noise, weighting and absorption against other evaluations, standards and a measured rotor."""

import math

import torch
from scipy.special import jv
from torch import Tensor

from lpc_mdo.cases.noise import ToneCondition, ToneInputs, analyze_tones
from lpc_mdo.disciplines.absorption import atmospheric_absorption
from lpc_mdo.disciplines.broadband_noise import CODE_REFERENCE_DISTANCE, gill_lee, schlegel_king_mull
from lpc_mdo.disciplines.sound import REFERENCE_PRESSURE, a_weighting, sound_pressure_level
from lpc_mdo.disciplines.tonal_noise import SECTION_AREA_FACTOR, BladeLoading, TonalNoise, barry_magliozzi
from lpc_mdo.disciplines.unsteady_loading_noise import (
    LoadingHarmonics,
    LoadingLaw,
    loading_harmonics_noise,
    lowson_noise,
)
from lpc_mdo.numerics.bessel import bessel_j
from lpc_mdo.verification.comparison import Between, Comparison, reference
from lpc_mdo.verification.moving_sources import moving_point_source

STEADY, UNSTEADY, HELICOPTER = "steady tones", "unsteady-loading tones", "Schlegel-King-Mull"
HALF_DECIBEL = 0.5
ISO_9613_1 = (  # table 1: degrees Celsius, humidity %, third-octave j of 1000 x 10^(j/10) Hz, dB/km
    (10.0, 70.0, 0, 3.66),
    (20.0, 70.0, 0, 4.98),
    (20.0, 70.0, 6, 22.9),
)


def comparisons() -> list[Comparison]:
    with torch.no_grad():
        return [
            _bessel(),
            _tones(),
            *_circling_sources(),
            _weighting(),
            *_broadband(),
            _absorption(),
            *_axis(),
            *_scaling(),
        ]


def _bessel() -> Comparison:
    orders, x = torch.arange(0.0, 61.0, dtype=torch.float64), torch.logspace(-3, 2, 200, dtype=torch.float64)[:, None]
    theirs = torch.as_tensor(jv(orders.numpy(), x.numpy()))
    amplitude = torch.where(x > orders, 0.01 * torch.sqrt(2.0 / (math.pi * x)), 0.0)
    scale, is_counted = torch.maximum(theirs.abs(), amplitude), theirs.abs() > 1e-290
    scaled = [(values / scale)[is_counted] for values in (bessel_j(orders, x), theirs)]
    return Between("Bessel functions", "SciPy (AMOS)").absolute(
        "J_0 ... J_60 up to x = 100 over the larger of itself and a hundredth of its amplitude", *scaled, 1e-10,
        "rounding of both", "of one",
    )  # fmt: skip


def _tones() -> Comparison:
    case = reference("noise_tonal_hover")
    key = "elevation_from_disk_plane_deg"
    conditions = [ToneCondition(**{key: row[key]}) for row in case["results"]]
    ours = analyze_tones(ToneInputs.model_validate(case["inputs"]), conditions, None)
    keys = ("spl_db", "spl_dba_per_harmonic")
    return Between(STEADY, "evaluation of the same formulas with SciPy").absolute(
        "levels 5 to 89 deg off the disk, dB and dB(A)",
        *([[row[k] for k in keys] for row in rows] for rows in (ours, case["results"])),
        HALF_DECIBEL,
        "our levels have a floor of -46 dB; distance from the axis smoothed by 1e-6",
        "dB",
    )


def _circling_sources() -> list[Comparison]:
    """One station of two and three blades, at rest and in flight, far enough for the far field to be exact to 1e-5."""
    radius, thrust, torque, chord, distance, sound = 1.2, 3000.0, 500.0, 1e-4, 1.2e6, 340.0
    one = torch.ones(1, dtype=torch.float64)
    found: dict[str, tuple[list[float], list[float]]] = {"loading": ([], []), "thickness": ([], [])}
    for blades, order, mach, degrees in ((2, 1, 0.0, 130.0), (2, 1, 0.5, 40.0), (3, 2, 0.15, 90.0)):
        values = (float(blades), 140.0, 1.2, sound)
        station = BladeLoading(
            radius * one, 0.1 * one, 10.0 * thrust * one, 10.0 * torque * one, chord * one, 0.12, 0.0 * one,
            *(torch.tensor(v, dtype=torch.float64) for v in values),
        )  # fmt: skip
        angle = math.radians(degrees)
        tones = barry_magliozzi(station, *_at(angle, distance), order, mach)
        with torch.enable_grad():
            parts = moving_point_source(
                blades * order, 140.0, radius, mach, [distance * math.cos(angle), distance * math.sin(angle), 0.0],
                thrust / blades, torque / radius / blades, SECTION_AREA_FACTOR * 0.12 * chord**2 * 0.1, 1.2, sound,
            )  # fmt: skip
        for part, single in zip(found, parts, strict=True):
            found[part][0].append(float(getattr(tones, part)[-1].sqrt()))
            found[part][1].append(blades * single)
    between = Between(STEADY, "circling force and volume in retarded time, from first principles")
    return [
        between.relative(f"{part} tones in hover and flight to Mach 0.5, Pa", *values, 2e-5, "distance is finite")
        for part, values in found.items()
    ]


def _weighting() -> Comparison:
    case = reference("noise_a_weighting")
    ours = a_weighting(torch.tensor(case["inputs"]["frequency_Hz"], dtype=torch.float64))
    return Between("A-weighting", "IEC 61672-1").absolute(
        "third-octaves 10 Hz to 20 kHz, dB", ours, case["results"], 0.1, "same formula", "dB"
    )


def _broadband() -> list[Comparison]:
    case = reference("noise_ideally_twisted_rotor")
    inputs, rows = case["inputs"], case["results"]
    radius, distance = inputs["radius_m"], math.dist(inputs["observer_m"], (0.0, 0.0, 0.0))
    tip_speed = torch.tensor([row["rpm"] for row in rows], dtype=torch.float64) * math.pi / 30.0 * radius
    coefficient = torch.tensor([row["thrust_coefficient"] for row in rows], dtype=torch.float64)
    one = torch.ones_like(tip_speed)
    rotor = {
        "thrust": coefficient * math.pi * radius**2 * tip_speed**2,
        "radius": radius * one,
        "tip_speed": tip_speed,
        "blade_area": inputs["blades"] * inputs["chord_m"] * radius * one,
        "density": one,
        "elevation_sine": -inputs["observer_m"][2] / distance * one,
        "distance": distance * one,
    }
    helicopter = sound_pressure_level(
        schlegel_king_mull(**rotor, projected_thickness=one, reference_distance=CODE_REFERENCE_DISTANCE).overall
    )
    fit = sound_pressure_level(
        gill_lee(**rotor, blades=inputs["blades"] * one, speed_of_sound=inputs["speed_of_sound_m_per_s"] * one).overall
    )
    theirs, measured = (
        torch.tensor([row[key] for row in rows], dtype=torch.float64)
        for key in ("schlegel_king_mull_db", "measured_db")
    )
    quantity = "broadband level of the ideally twisted model rotor, dB"
    return [
        Between(HELICOPTER, "Gill's evaluation (lsdo_acoustics)").absolute(
            quantity, helicopter, theirs, HALF_DECIBEL, "our floors of dipole and blade loading; with 150 m", "dB"
        ),
        Between(HELICOPTER, "experiment: ideally twisted model rotor (lsdo_acoustics data)").mean_absolute(
            quantity, helicopter, measured, 15.0,
            "made from full-size helicopters: falls with the sixth power of speed, the model rotor with less", "dB",
        ),
        Between("Gill-Lee", "experiment: ideally twisted model rotor (lsdo_acoustics data)").mean_absolute(
            quantity, fit, measured, 4.0, "fit to computations; one of six points stands 3 dB above its neighbours", "dB"
        ),
    ]  # fmt: skip


def _absorption() -> Comparison:
    ours = []
    for celsius, percent, j, _ in ISO_9613_1:
        values = (1000.0 * 10.0 ** (j / 10.0), celsius + 273.15, 101325.0, percent / 100.0)
        ours.append(1e3 * float(atmospheric_absorption(*(torch.tensor(v, dtype=torch.float64) for v in values))))
    return Between("atmospheric absorption", "ISO 9613-1, table 1").relative(
        "dB/km at 1 and 4 kHz, 10 and 20 C", ours, [row[-1] for row in ISO_9613_1], 0.005, "three digits"
    )


def _rotor(blades: float = 2.0, speed: float = 115.0, torque: float = 600.0) -> BladeLoading:
    """4 kN and loads in proportion to r^2."""
    r = 1.5 * torch.linspace(0.2, 1.0, 40, dtype=torch.float64)
    shape = r**2 / (r**2).sum() / (r[1] - r[0])
    values = (blades, speed, 1.2, 340.0)
    return BladeLoading(
        r, (r[1] - r[0])[None], 4000.0 * shape, torque * shape, 0.2 * torch.ones_like(r), 0.12, torch.full_like(r, 0.1),
        *(torch.tensor(v, dtype=torch.float64) for v in values),
    )  # fmt: skip


def _at(angle: float, distance: float = 76.2) -> tuple[Tensor, Tensor]:
    return torch.tensor(distance * math.cos(angle), dtype=torch.float64), torch.tensor(distance, dtype=torch.float64)


def _level(pressure_squared: object) -> float:
    """Without the floor of `sound_pressure_level`: these rows compare energies far below it, too."""
    return 10.0 * math.log10(float(pressure_squared) / REFERENCE_PRESSURE**2)


def _axis() -> list[Comparison]:
    """On the axis only the load of the tone's own order is heard, at sqrt(2) k B T_n/(4 pi S); steady loads are silent."""
    loading, law, n = _rotor(), LoadingLaw(), 2
    place, azimuth = _at(math.pi), torch.tensor(0.0, dtype=torch.float64)
    shares = torch.tensor([1.0, 0.0, law.fluctuation * n**-law.decay], dtype=torch.complex128)[:, None]
    unsteady = LoadingHarmonics(shares * loading.thrust_per_length, shares * loading.torque_per_length)
    ours = loading_harmonics_noise(loading, unsteady, *place, azimuth, 1)
    amplitude = law.fluctuation * n**-law.decay * 4000.0  # all blades together
    pressure = math.sqrt(2.0) * n * 115.0 / 340.0 * amplitude / (4.0 * math.pi * 76.2)
    steady, aside = (barry_magliozzi(loading, *_at(a), 4).loading.sum() for a in (math.pi, 2.0))
    alike = lowson_noise(loading, *_at(2.0), 4, LoadingLaw(fluctuation=0.0)).loading.sum()
    return [
        Between(UNSTEADY, "closed form on the axis").absolute(
            "first tone, dB", _level(ours[0]), _level(pressure**2), HALF_DECIBEL, "observer 1e-6 rad beside the axis",
            "dB",
        ),
        Between(STEADY, "theory: silent on the axis").absolute(
            "energy there over that at 25 deg below the disk", steady / aside, 0.0, 1e-12,
            "smoothed distance from the axis", "of one",
        ),
        Between(UNSTEADY, "steady tones, without fluctuation").absolute(
            "four tones, dB", _level(alike), _level(aside), 1e-9, "same limit", "dB"
        ),
    ]  # fmt: skip


def _scaling() -> list[Comparison]:
    def tones(harmonics: int, distance: float = 76.2, angle: float = 2.0, **rotor: float) -> TonalNoise:
        return barry_magliozzi(_rotor(**rotor), *_at(angle, distance), harmonics)

    near, far = (tones(3, distance).pressure_squared.sum() for distance in (76.2, 152.4))
    few, many = tones(4).loading, tones(2, blades=4.0).loading
    slow, fast = (tones(1, angle=2.4, speed=v, torque=0.0).loading[0] for v in (1.0, 2.0))
    return [
        Between(STEADY, "spherical spreading").absolute(
            "level lost over twice the distance, dB", _level(near) - _level(far), 20.0 * math.log10(2.0), 1e-6,
            "far-field formula", "dB",
        ),
        Between(STEADY, "ring of sources").absolute(
            "tone m of twice the blades is tone 2 m, dB", [_level(many[m]) for m in range(2)],
            [_level(few[2 * m + 1]) for m in range(2)], 1e-9, "same total load", "dB",
        ),
        Between(STEADY, "small tip Mach number: sixth power of speed").absolute(
            "first tone of two blades at twice the speed, dB gained", _level(fast) - _level(slow),
            60.0 * math.log10(2.0), 0.01, "tip Mach number not zero", "dB",
        ),
    ]  # fmt: skip
