"""Rotor tones against a reference evaluation, moving point sources in the time domain, and their limits."""

import math
from dataclasses import replace

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.cases.noise import ToneCondition, ToneInputs, analyze_tones
from lpc_mdo.disciplines.tonal_noise import SECTION_AREA_FACTOR, BladeLoading, barry_magliozzi
from lpc_mdo.disciplines.unsteady_loading_noise import lowson_noise
from lpc_mdo.verification.moving_sources import moving_point_source

SOUND = 340.0


def a_loading(thrust=1.0, torque=1.0, chord=0.2, speed=115.0, radius=1.5, blades=2.0, thickness=0.12, stations=20):
    """Loads proportional to r^2; `thrust` and `torque` scale 4 kN and 600 N m."""
    r = radius * torch.linspace(0.2, 1.0, stations, dtype=torch.float64)
    shape = r**2 / (r**2).sum() / (r[1] - r[0])
    return BladeLoading(
        radius=r,
        width=(r[1] - r[0])[None],
        thrust_per_length=4000.0 * thrust * shape,
        torque_per_length=600.0 * torque * shape,
        chord=chord * torch.ones_like(r),
        thickness_to_chord=thickness,
        pitch_angle=torch.full_like(r, 0.1),
        blades=number(blades),
        rotation_speed=torch.as_tensor(speed, dtype=torch.float64),
        density=number(1.2),
        speed_of_sound=number(SOUND),
    )


def tones(loading, angle, distance=76.2, harmonics=4, mach=0.0):
    """At `angle` rad from the thrust's direction."""
    return barry_magliozzi(loading, number(distance * math.cos(angle)), number(distance), harmonics, mach)


def decibels(ratio):
    return 10.0 * torch.log10(ratio)


def test_harmonics_equal_the_reference_evaluation(reference):
    # Same formulas and Bessel functions evaluated elsewhere; tolerance for the smoothed distance from the axis, 1e-6 S.
    case = reference("noise_tonal_hover")
    inputs = ToneInputs.model_validate(case["inputs"])
    key = "elevation_from_disk_plane_deg"
    conditions = [ToneCondition(**{key: r[key]}) for r in case["results"]]
    for ours, theirs in zip(analyze_tones(inputs, conditions, None), case["results"], strict=True):
        for a, b in zip(ours["harmonics"], theirs["harmonics"], strict=True):
            assert a["frequency_Hz"] == pytest.approx(b["frequency_Hz"], rel=1e-12)
            assert a["p_loading_rms_Pa"] == pytest.approx(b["p_loading_rms_Pa"], rel=1e-8, abs=0.0)
            assert a["p_thickness_rms_Pa"] == pytest.approx(b["p_thickness_rms_Pa"], rel=1e-8, abs=0.0)
        # The level's floor of 1e-7 Pa adds 2e-5 dB to the faintest, 8 dB(A).
        assert ours["spl_db"] == pytest.approx(theirs["spl_db"], abs=5e-5)
        assert ours["spl_dba_per_harmonic"] == pytest.approx(theirs["spl_dba_per_harmonic"], abs=5e-5)


def a_station(radius, chord, thrust, torque, blades, width=0.1):
    """All loads at one radius."""
    one = torch.ones(1, dtype=torch.float64)
    return BladeLoading(
        radius * one, width * one, thrust / width * one, torque / width * one, chord * one, 0.12, 0.0 * one,
        number(float(blades)), number(140.0), number(1.2), number(SOUND),
    )  # fmt: skip


@pytest.mark.parametrize("mach", [0.0, 0.15, 0.5])
@pytest.mark.parametrize("angle_deg", [40.0, 90.0, 130.0])
@pytest.mark.parametrize(("blades", "harmonic"), [(2, 1), (3, 2)])
def test_tones_are_those_of_circling_forces_and_volumes_far_away(mach, angle_deg, blades, harmonic):
    # A chord too small to spread the load. The far field neglects radius/distance = 1e-6, twice over in the phase.
    radius, thrust, torque, chord, distance, angle = 1.2, 3000.0, 500.0, 1e-4, 1.2e6, math.radians(angle_deg)
    ours = tones(a_station(radius, chord, thrust, torque, blades), angle, distance, harmonic, mach)
    volume = SECTION_AREA_FACTOR * 0.12 * chord**2 * 0.1
    observer = [distance * math.cos(angle), distance * math.sin(angle), 0.0]
    force, displacement = moving_point_source(
        blades * harmonic, 140.0, radius, mach, observer, thrust / blades, torque / radius / blades, volume, 1.2, SOUND
    )
    assert float(ours.loading[-1].sqrt()) == pytest.approx(blades * force, rel=2e-5, abs=0.0)
    assert float(ours.thickness[-1].sqrt()) == pytest.approx(blades * displacement, rel=2e-5, abs=0.0)


def test_spreading_the_load_over_the_chord_averages_its_phase():
    narrow, wide = (tones(a_station(1.5, c, 3000.0, 500.0, 2), 1.2) for c in (1e-6, 0.4))
    azimuth = torch.linspace(-0.5, 0.5, 20001, dtype=torch.float64) * 0.4 / 1.5
    for m in range(4):
        mean = float(torch.trapezoid(torch.cos(2 * (m + 1) * azimuth), dx=1.0 / 20000))
        assert float((wide.loading[m] / narrow.loading[m]).sqrt()) == pytest.approx(mean, rel=1e-7)


def test_doubling_the_distance_lowers_every_tone_by_six_decibels():
    near, far = (tones(a_loading(), 2.0, s).pressure_squared for s in (60.0, 120.0))
    torch.testing.assert_close(decibels(near / far), torch.full_like(near, 20 * math.log10(2)), rtol=1e-9, atol=0.0)


@pytest.mark.parametrize("harmonic", [1, 2, 3])
def test_twice_the_blades_with_the_same_load_leave_every_second_tone(harmonic):
    """Blade-number law: a ring of 2 B sources is silent at odd multiples of B, and at even ones the sources agree."""
    few, many = tones(a_loading(blades=2.0), 2.0, harmonics=6), tones(a_loading(blades=4.0), 2.0, harmonics=3)
    assert float(many.loading[harmonic - 1]) == pytest.approx(float(few.loading[2 * harmonic - 1]), rel=1e-12)
    assert float(many.frequency[harmonic - 1]) == pytest.approx(float(few.frequency[2 * harmonic - 1]), rel=1e-12)
    # Each blade keeps its section: twice the volume.
    assert float(many.thickness[harmonic - 1]) == pytest.approx(4.0 * float(few.thickness[2 * harmonic - 1]), rel=1e-12)


@pytest.mark.parametrize(("blades", "harmonic"), [(2, 1), (2, 2), (3, 1)])
def test_slow_rotors_follow_the_speed_to_the_power_of_order_plus_one(blades, harmonic):
    """Rotation-speed law at given thrust: k J_mB(k r) ~ speed^(mB + 1) while the tip Mach number is small, 6 (mB + 1) dB."""
    order = blades * harmonic
    slow, fast = (
        tones(a_loading(torque=0.0, blades=float(blades), speed=v), 2.4, harmonics=harmonic).loading[-1]
        for v in (1.0, 2.0)
    )
    # J_n(x) = (x/2)^n/n! (1 - x^2/(4 n + 4)), x up to 0.02 x order here.
    assert float(decibels(fast / slow)) == pytest.approx(20.0 * (order + 1) * math.log10(2.0), abs=0.01)


def test_tones_vanish_towards_the_axis_with_the_power_blades_times_harmonic_of_the_angle():
    # Steady loads on a ring are constant in time when seen from the axis: p ~ sin(angle)^(mB).
    near, nearer = (tones(a_loading(blades=3.0), math.pi - e, harmonics=3) for e in (0.02, 0.01))
    for kind in ("loading", "thickness"):
        ratio = (getattr(near, kind) / getattr(nearer, kind)).sqrt()
        expected = torch.tensor([2.0**3, 2.0**6, 2.0**9], dtype=torch.float64)
        torch.testing.assert_close(ratio, expected, rtol=5e-3, atol=0.0)
    on_axis = tones(a_loading(), math.pi).pressure_squared
    assert float(on_axis.sum()) < 1e-15 * float(tones(a_loading(), 2.0).pressure_squared.sum())


def test_a_lift_rotor_is_louder_below_the_disk_than_above():
    below, above = (tones(a_loading(), a) for a in (math.radians(130), math.radians(50)))
    assert bool((below.loading > 1.5 * above.loading).all())
    torch.testing.assert_close(below.thickness, above.thickness, rtol=1e-12, atol=0.0)


def test_in_the_disk_plane_only_torque_radiates_and_far_from_it_both_do():
    assert bool((tones(a_loading(torque=0.0), 0.5 * math.pi).loading < 1e-25).all())
    with_thrust, without = (tones(a_loading(thrust=t), 0.5 * math.pi).loading for t in (1.0, 0.0))
    torch.testing.assert_close(with_thrust, without, rtol=1e-12, atol=0.0)


def test_loading_energy_is_quadratic_in_the_loads_and_thickness_energy_in_the_section():
    one, two = tones(a_loading(), 2.0), tones(a_loading(thrust=2.0, torque=2.0, thickness=0.24), 2.0)
    torch.testing.assert_close(two.loading, 4.0 * one.loading, rtol=1e-12, atol=0.0)
    torch.testing.assert_close(two.thickness, 4.0 * one.thickness, rtol=1e-12, atol=0.0)
    torch.testing.assert_close(two.pressure_squared, two.loading + two.thickness, rtol=0.0, atol=0.0)


def test_same_tip_mach_number_sounds_alike_at_the_same_distance_in_radii():
    """Similarity: with lengths x 2, speed / 2 and loads x 4 pressures are unchanged."""
    small = tones(a_loading(), 2.0, 50.0)
    large = tones(a_loading(thrust=4.0, torque=8.0, chord=0.4, speed=57.5, radius=3.0), 2.0, 100.0)
    torch.testing.assert_close(large.loading, small.loading, rtol=1e-9, atol=0.0)
    torch.testing.assert_close(large.thickness, small.thickness, rtol=1e-9, atol=0.0)
    torch.testing.assert_close(2.0 * large.frequency, small.frequency, rtol=1e-12, atol=0.0)


def test_gradient_equals_central_differences():
    def levels(x):
        loading = a_loading(thrust=x[0], torque=x[1], chord=x[2], speed=x[3], radius=x[4])
        noise = barry_magliozzi(loading, x[5], x[6], 3)
        return decibels(torch.cat([noise.loading, noise.thickness]))

    x = torch.tensor([1.0, 1.0, 0.2, 115.0, 1.5, -50.0, 76.0], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(levels, x)
    torch.testing.assert_close(exact, central_difference(levels, x, 1e-4), rtol=1e-6, atol=1e-7)


def test_energy_has_a_finite_gradient_on_the_axis():
    height = number(-76.2).requires_grad_()
    noise = barry_magliozzi(a_loading(), height, number(76.2), 2)
    (gradient,) = torch.autograd.grad(noise.pressure_squared.sum(), height)
    assert bool(gradient.isfinite())


def test_a_batch_of_observers_equals_a_loop():
    heights = torch.tensor([-70.0, -40.0, 30.0], dtype=torch.float64)
    batch = barry_magliozzi(a_loading(), heights, number(76.2).expand(3), 5)
    for i, height in enumerate(heights):
        one = barry_magliozzi(a_loading(), height, number(76.2), 5)
        torch.testing.assert_close(batch.pressure_squared[i], one.pressure_squared, rtol=1e-13, atol=0.0)


def test_no_harmonics_are_refused():
    with pytest.raises(ValueError, match="harmonics = 0 is not allowed"):
        tones(a_loading(), 1.0, harmonics=0)


@pytest.mark.parametrize(("change", "words"), [({"rotation_speed": 0.0}, "rotation_speed = 0"), ({}, "distance = 0")])
def test_a_rotor_at_rest_and_an_ear_at_its_hub_are_refused(change, words):
    loading = replace(a_loading(), **{name: number(value) for name, value in change.items()})
    for tones in (barry_magliozzi, lowson_noise):
        with pytest.raises(ValueError, match=words):
            tones(loading, number(0.0), number(0.0 if "distance" in words else 80.0), 3)
