"""Broadband noise: Schlegel-King-Mull against its original formula in feet, both models against a measured rotor, scaling laws."""

import math

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.disciplines.broadband_noise import (
    CODE_REFERENCE_DISTANCE,
    REFERENCE_DISTANCE,
    gill_lee,
    schlegel_king_mull,
)
from lpc_mdo.disciplines.sound import sound_pressure_level

FOOT = 0.3048
ROTOR = {  # a lift rotor of the study in hover, observer 250 ft away at 85 degrees
    "thrust": 4100.0,
    "radius": 1.524,
    "tip_speed": 175.6,
    "blade_area": 0.49,
    "density": 1.216,
    "elevation_sine": math.sin(math.radians(85.0)),
    "distance": 76.2,
    "projected_thickness": 0.045,
}


def noise(reference_distance=REFERENCE_DISTANCE, **changes):
    values = {k: torch.as_tensor(v, dtype=torch.float64) for k, v in (ROTOR | changes).items()}
    return schlegel_king_mull(**values, reference_distance=reference_distance)


def level(**changes):
    return float(sound_pressure_level(noise(**changes).overall))


def test_level_is_that_of_the_original_report_within_the_conversion_of_its_constant():
    """10 log10(6.1e-27 A V^6/1e-16) + 20 log10(C_L/0.4) at 300 ft, in ft and ft/s at 0.7 R, with C_L = 6 C_T/sigma.

    TR 65-4 converted gives -40.6 dB where the published code has -42.9: 2.3 dB apart, no more.
    """
    for thrust, tip_speed in ((2500.0, 150.0), (4100.0, 175.6), (60e3, 210.0)):
        area, velocity = ROTOR["blade_area"] / FOOT**2, 0.7 * tip_speed / FOOT
        lift = 6.0 * thrust / (ROTOR["density"] * ROTOR["blade_area"] * tip_speed**2)
        original = 10 * math.log10(6.1e-27 * area * velocity**6 / 1e-16) + 20 * math.log10(lift / 0.4)
        ours = level(thrust=thrust, tip_speed=tip_speed, elevation_sine=1.0, distance=300 * FOOT)
        assert original - ours == pytest.approx(2.3, abs=0.1)


def test_published_reference_distance_is_ten_decibels_louder():
    # EQUATIONS_NOISE_MOTOR.md: 71 dB and 81.5 dB for this rotor, evaluated by hand to half a decibel.
    loud = float(sound_pressure_level(noise(CODE_REFERENCE_DISTANCE).overall))
    assert level() == pytest.approx(71.0, abs=0.7)
    assert loud - level() == pytest.approx(20 * math.log10(150.0 / 45.72), abs=1e-9)


@pytest.mark.parametrize(
    ("changes", "rise"),
    [
        ({"distance": 152.4}, -20 * math.log10(2)),
        ({"thrust": 8200.0}, 20 * math.log10(2)),
        ({"tip_speed": 351.2}, 20 * math.log10(2)),  # V^6 (C_T/sigma)^2 at fixed thrust
        ({"tip_speed": 351.2, "thrust": 4 * 4100.0}, 60 * math.log10(2)),  # at fixed blade loading
        ({"blade_area": 0.98}, -10 * math.log10(2)),  # A (C_T/sigma)^2 at fixed thrust
        ({"density": 0.608}, 20 * math.log10(2)),
        ({"radius": 3.0}, 0.0),  # only blade area and tip speed count
    ],
)
def test_scaling_laws(changes, rise):
    # The floor of the blade loading, 1e-6 beside 0.05^2, bends them by up to 0.002 dB.
    assert level(**changes) - level() == pytest.approx(rise, abs=3e-3)


def test_noise_is_a_dipole_along_the_axis():
    sines = torch.linspace(0.2, 1.0, 9, dtype=torch.float64)
    energy = noise(elevation_sine=sines).overall
    # The floor 1e-4 keeps the disk plane audible.
    torch.testing.assert_close(energy / energy[-1], sines**2, rtol=3e-3, atol=0.0)
    assert math.isfinite(level(elevation_sine=0.0))
    assert level(elevation_sine=0.0) == pytest.approx(level(elevation_sine=1.0) - 40.0, abs=1e-3)


def test_spectrum_peaks_at_the_strouhal_frequency_of_the_projected_thickness():
    result = noise()
    peak = result.frequency[result.bands.argmax()]
    assert float(peak * ROTOR["projected_thickness"] / (0.7 * ROTOR["tip_speed"])) == pytest.approx(0.28, rel=1e-12)
    torch.testing.assert_close(result.frequency[1:] / result.frequency[:-1], torch.full((5,), 2.0).double())
    assert float(noise(projected_thickness=0.09).frequency[0] * 2) == pytest.approx(float(result.frequency[0]))


def test_octaves_hold_the_overall_energy_but_for_what_lies_beyond_them():
    # The published shares add to -0.35 dB (their two digits).
    result = noise()
    missing = 10 * torch.log10(result.bands.sum() / result.overall)
    assert float(missing) == pytest.approx(-0.35, abs=0.01)


def test_gradient_equals_central_differences():
    names = list(ROTOR)

    def levels(x):
        result = noise(**{name: ROTOR[name] * x[i] for i, name in enumerate(names)})
        return torch.cat([10 * torch.log10(result.overall)[None], result.frequency.log()])

    x = torch.ones(len(names), dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(levels, x)
    torch.testing.assert_close(exact, central_difference(levels, x, 1e-3), rtol=1e-8, atol=1e-9)


def test_an_unloaded_rotor_and_an_observer_in_the_disk_plane_have_finite_gradients():
    thrust, sine = number(0.0).requires_grad_(), number(0.0).requires_grad_()
    result = sound_pressure_level(noise(thrust=thrust, elevation_sine=sine).overall)
    assert all(bool(g.isfinite()) for g in torch.autograd.grad(result, (thrust, sine)))


def model_rotor(reference):
    """Inputs of the measured rotor, density one: loads follow from the thrust coefficient."""
    case = reference("noise_ideally_twisted_rotor")
    inputs, rows = case["inputs"], case["results"]
    column = {key: torch.tensor([float(row[key]) for row in rows], dtype=torch.float64) for key in rows[0]}
    radius, distance = inputs["radius_m"], math.dist(inputs["observer_m"], (0.0, 0.0, 0.0))
    tip_speed = column["rpm"] * math.pi / 30.0 * radius
    one = torch.ones_like(tip_speed)
    values = {
        "thrust": column["thrust_coefficient"] * math.pi * radius**2 * tip_speed**2,
        "radius": radius * one,
        "tip_speed": tip_speed,
        "blade_area": inputs["blades"] * inputs["chord_m"] * radius * one,
        "density": one,
        "elevation_sine": abs(inputs["observer_m"][2]) / distance * one,
        "distance": distance * one,
    }
    return values, {"blades": inputs["blades"] * one, "speed_of_sound": inputs["speed_of_sound_m_per_s"] * one}, column


def test_schlegel_king_mull_is_that_of_another_evaluation_to_its_digits(reference):
    # Four decimals; our floors of the dipole's sine and of the blade loading add up to 0.01 dB.
    values, _, column = model_rotor(reference)
    ours = schlegel_king_mull(
        **values, projected_thickness=torch.tensor(0.005), reference_distance=CODE_REFERENCE_DISTANCE
    )
    level = sound_pressure_level(ours.overall)
    torch.testing.assert_close(level, column["schlegel_king_mull_db"], rtol=0.0, atol=0.01)


def test_gill_lee_is_nearer_to_the_measured_rotor_than_schlegel_king_mull(reference):
    # Not a match of equals, a statement of how far off each is: the fit within 3.5 dB but for one speed at which the measured
    # level stands out of its own trend by 3 dB; the helicopter formula falls too steeply with speed.
    values, further, column = model_rotor(reference)
    measured = column["measured_db"]
    fit = sound_pressure_level(gill_lee(**values, **further).overall) - measured
    helicopter = (
        sound_pressure_level(
            schlegel_king_mull(
                **values, projected_thickness=torch.tensor(0.005), reference_distance=CODE_REFERENCE_DISTANCE
            ).overall
        )
        - measured
    )
    regular = column["rpm"] != 3479.0
    assert float(fit[regular].abs().max()) < 4.0
    assert float(fit.abs().mean()) < 3.0
    assert float(helicopter.abs().mean()) > 8.0


SPECTRUM = {key: ROTOR[key] for key in ROTOR if key != "projected_thickness"} | {"blades": 2.0, "speed_of_sound": 340.0}


def spectrum(**changes):
    return gill_lee(**{k: torch.as_tensor(v, dtype=torch.float64) for k, v in (SPECTRUM | changes).items()})


def test_gill_lee_falls_by_six_decibels_with_every_doubling_of_the_distance():
    ratio = spectrum().bands / spectrum(distance=2 * 76.2).bands
    torch.testing.assert_close(ratio, torch.full_like(ratio, 4.0), rtol=1e-12, atol=0.0)


def test_gill_lee_rises_with_tip_speed_and_is_loudest_below():
    levels = [
        float(sound_pressure_level(spectrum(tip_speed=v, thrust=4100.0 * (v / 175.0) ** 2).overall))
        for v in (120, 150, 180)
    ]
    assert levels[0] < levels[1] < levels[2]
    # V^5 to V^8 are the laws of edge and of turbulent noise.
    assert 50.0 < (levels[2] - levels[0]) / math.log10(180 / 120) < 110.0
    around = sound_pressure_level(spectrum(elevation_sine=torch.linspace(0.0, 1.0, 11).double()).overall)
    assert bool((around.diff() > 0.0).all())


def test_gill_lee_and_schlegel_king_mull_agree_within_some_decibels_for_a_lift_rotor():
    other = {key: value for key, value in ROTOR.items()}
    assert float(sound_pressure_level(spectrum().overall)) == pytest.approx(level(**other), abs=3.0)


def test_gill_lee_bands_are_third_octaves_that_add_to_the_overall_energy():
    result = spectrum()
    assert result.thirds == 1
    torch.testing.assert_close(result.bands.sum(-1), result.overall, rtol=1e-14, atol=0.0)
    peak = float(result.frequency[result.bands.argmax()])
    assert 500.0 < peak < 5000.0
    assert bool(spectrum(thrust=-100.0).overall.isfinite())
