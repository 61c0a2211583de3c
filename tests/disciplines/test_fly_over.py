"""Fly-over noise: against the retarded-time equation, similarity in space and time, limits of slow flight, bad input."""

import math
from dataclasses import replace

import pytest
import torch
from conftest import number

from lpc_mdo.disciplines.absorption import atmospheric_absorption
from lpc_mdo.disciplines.broadband_noise import schlegel_king_mull
from lpc_mdo.disciplines.fly_over import HARMONICS, FlightSource, fly_over
from lpc_mdo.disciplines.sound import a_weighting_factor, sound_pressure_level
from lpc_mdo.disciplines.tonal_noise import BladeLoading, barry_magliozzi

SOUND = 340.0


def vector(*values):
    return torch.tensor(values, dtype=torch.float64)


def a_pusher(rotors=1):
    r = torch.linspace(0.3, 1.4, 12, dtype=torch.float64).expand(rotors, -1)
    shape = r**2 / (r**2).sum(-1, keepdim=True) / 0.1
    one = torch.ones(rotors, dtype=torch.float64)
    loading = BladeLoading(
        r, torch.full_like(r[:, :1], 0.1), 2500.0 * shape, 900.0 * shape, torch.full_like(r, 0.15), 0.12,
        torch.full_like(r, 0.4), 4.0 * one, 170.0 * one, 1.2 * one, SOUND * one,
    )  # fmt: skip
    return FlightSource(loading, 2500.0 * one, 1.4 * one, 0.03 * one, torch.zeros(rotors, 3, dtype=torch.float64))


def a_track(height, speed=57.6, half=1500.0, count=201):
    """Velocity ahead (-x), start and times of a level flight over the origin."""
    time = torch.linspace(0.0, 2 * half / speed, count, dtype=torch.float64)
    return vector(-speed, 0.0, 0.0), vector(half, 0.0, height), time


@pytest.mark.parametrize("emitted", [8.0, 25.0, 30.0])
def test_level_is_that_of_the_present_position_at_the_time_of_reception(emitted):
    """Solve |x - position(t_e)| = c (t - t_e) anew and look at the rotor where it is at t."""
    velocity, start, _ = a_track(120.0)
    source, ear = a_pusher(), vector(0.0, 60.0, 0.0)
    result = fly_over(source, velocity, start, vector(emitted, emitted + 1.0), ear)
    here = start + velocity * emitted
    path = float((ear - here).norm())
    now = start + velocity * (emitted + path / SOUND)
    along, distance = float((ear - now)[0] / -1.0), float((ear - now).norm())
    mach = 57.6 / SOUND
    tones = barry_magliozzi(source.loading, number(along)[None], number(distance)[None], HARMONICS, mach)
    cosine = float((ear - here)[0] / -path)
    # What a moving observer hears at f a fixed one hears shifted.
    heard = tones.frequency / (1.0 - mach * cosine)
    rest = schlegel_king_mull(
        number(2500.0), number(1.4), number(170.0 * 1.4), number(4 * 0.15 * 12 * 0.1), number(1.2),
        number(abs(cosine)), number(path), number(0.03),
    )  # fmt: skip
    energy = (a_weighting_factor(heard) * tones.pressure_squared).sum()
    energy = energy + (a_weighting_factor(rest.frequency / (1.0 - mach * cosine)) * rest.bands).sum()
    assert float(result.level_dba[0]) == pytest.approx(float(sound_pressure_level(energy)), abs=1e-6)


def test_twice_the_height_costs_six_decibels_of_the_maximum_and_three_of_the_exposure():
    """Similarity at equal speed: path, grid and times doubled, sound pressure halved, heard twice as long."""
    ears = torch.tensor([[0.0, 0.0, 0.0], [100.0, 80.0, 0.0]], dtype=torch.float64)
    near, far = (
        fly_over(a_pusher(), *a_track(scale * 100.0, half=scale * 1500.0), scale * ears) for scale in (1.0, 2.0)
    )
    two = 10.0 * math.log10(2.0)
    # The floor of the levels, -46 dB, bends the faint ends.
    assert (near.maximum_dba - far.maximum_dba).tolist() == pytest.approx([2 * two] * 2, abs=1e-6)
    assert (near.exposure_dba - far.exposure_dba).tolist() == pytest.approx([two] * 2, abs=1e-6)


def test_more_emission_times_change_nothing():
    ear = vector(30.0, 50.0, 0.0)
    coarse, fine = (fly_over(a_pusher(), *a_track(100.0, count=n), ear) for n in (201, 801))
    assert float(coarse.exposure_dba) == pytest.approx(float(fine.exposure_dba), abs=0.02)


def test_carpet_is_symmetric_to_the_track_and_falls_away_from_it():
    lateral = torch.linspace(-400.0, 400.0, 9, dtype=torch.float64)
    ears = torch.stack([torch.zeros_like(lateral), lateral, torch.zeros_like(lateral)], dim=-1)
    result = fly_over(a_pusher(), *a_track(150.0), ears)
    for level in (result.maximum_dba, result.exposure_dba):
        torch.testing.assert_close(level, level.flip(0), rtol=0.0, atol=1e-9)
        assert bool((level[4:].diff() < 0.0).all())
    assert bool((result.level_dba.amax(-1) == result.maximum_dba).all())


def test_sound_is_higher_pitched_as_the_rotor_comes_than_as_it_goes():
    """Absorption that knows only what lies above the blade-passing frequency at rest tells the two apart."""
    velocity, start, time = a_track(50.0, half=800.0)

    def high(frequency):
        return torch.where(frequency > 3e3, 1.0, 0.0)

    ear = vector(0.0, 20.0, 0.0)
    loss = (
        fly_over(a_pusher(), velocity, start, time, ear).level_dba
        - fly_over(a_pusher(), velocity, start, time, ear, high).level_dba
    )
    assert float(loss[:90].mean()) > float(loss[-90:].mean())


def test_air_takes_its_share_and_two_rotors_are_three_decibels_louder():
    ear = torch.tensor([[0.0, 0.0, 0.0], [0.0, 500.0, 0.0]], dtype=torch.float64)
    one, two = (fly_over(a_pusher(n), *a_track(150.0), ear) for n in (1, 2))
    assert (two.exposure_dba - one.exposure_dba).tolist() == pytest.approx([10 * math.log10(2)] * 2, abs=1e-6)
    humid = fly_over(
        a_pusher(), *a_track(150.0), ear,
        lambda f: atmospheric_absorption(f, number(288.15), number(101325.0), number(0.7)),
    )  # fmt: skip
    assert bool((humid.exposure_dba < one.exposure_dba).all())


def test_gradient_with_respect_to_the_loads_is_finite_and_right():
    """All pressures in proportion to the loads but thickness: here none, and broadband in proportion to thrust."""
    source, load = a_pusher(), number(1.0).requires_grad_()
    thin = replace(source.loading, thickness_to_chord=0.0)
    loaded = replace(
        source,
        loading=replace(
            thin, thrust_per_length=load * thin.thrust_per_length, torque_per_length=load * thin.torque_per_length
        ),
        thrust=load * source.thrust,
    )
    level = fly_over(loaded, *a_track(100.0), vector(0.0, 40.0, 0.0)).exposure_dba
    (slope,) = torch.autograd.grad(level, load)
    # The broadband's floor, 1e-6 beside (C_T/sigma)^2, takes a little.
    assert float(slope) == pytest.approx(20.0 / math.log(10.0), rel=2e-3)


@pytest.mark.parametrize("speed", [0.0, 341.0])
def test_flight_that_stands_still_or_outruns_its_sound_is_refused(speed):
    with pytest.raises(ValueError, match="must lie between 0 and the speed of sound"):
        fly_over(a_pusher(), vector(-speed, 0.0, 0.0), vector(0.0, 0.0, 9.0), vector(0.0, 1.0), vector(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="it must have two or more"):
        fly_over(a_pusher(), vector(-50.0, 0.0, 0.0), vector(0.0, 0.0, 9.0), vector(0.0), vector(0.0, 0.0, 0.0))
