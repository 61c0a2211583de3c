"""Spreading, atmospheric absorption against the tables of ISO 9613, and third-octave spectra."""

import math

import pytest
import torch
from conftest import central_difference, number
from hypothesis import given, settings
from hypothesis import strategies as st

from lpc_mdo.disciplines.absorption import (
    atmospheric_absorption,
    spherical_spreading,
    transmitted_share,
    water_vapour_concentration,
)
from lpc_mdo.disciplines.sound import (
    bands_in_third_octaves,
    sound_pressure_level,
    third_octave_centers,
    tones_in_third_octaves,
)

SEA_LEVEL = 101325.0
# ISO 9613-1:1993 table 1, at exact middle frequencies 1000 x 10^(j/10): j, degrees Celsius, % humidity, dB/km.
PART_1 = [(-13, -20, 10, 0.589), (8, 20, 15, 175.0), (-13, 20, 80, 0.0501), (0, 20, 80, 5.15), (10, 20, 80, 105.0)]
# ISO 9613-2:1996 table 2, octaves from 63 Hz to 8 kHz: degrees Celsius, % humidity, dB/km.
PART_2 = [
    (10, 70, (0.1, 0.4, 1.0, 1.9, 3.7, 9.7, 32.8, 117.0)),
    (20, 70, (0.1, 0.3, 1.1, 2.8, 5.0, 9.0, 22.9, 76.6)),
    (30, 70, (0.1, 0.3, 1.0, 3.1, 7.4, 12.7, 23.1, 59.3)),
    (15, 20, (0.3, 0.6, 1.2, 2.7, 8.2, 28.2, 88.8, 202.0)),
    (15, 50, (0.1, 0.5, 1.2, 2.2, 4.2, 10.8, 36.2, 129.0)),
    (15, 80, (0.1, 0.3, 1.1, 2.4, 4.1, 8.3, 23.7, 82.8)),
]


def absorption(frequency, celsius=20.0, humidity=0.7, pressure=SEA_LEVEL):
    """dB/km"""
    values = (frequency, celsius + 273.15, pressure, humidity)
    return 1000.0 * atmospheric_absorption(*(torch.as_tensor(v, dtype=torch.float64) for v in values))


@pytest.mark.parametrize(("j", "celsius", "percent", "table"), PART_1)
def test_absorption_equals_the_table_of_the_standard(j, celsius, percent, table):
    # The table carries three digits.
    ours = float(absorption(1000.0 * 10.0 ** (j / 10), celsius, percent / 100))
    assert ours == pytest.approx(table, rel=0.5 * 10.0 ** (math.floor(math.log10(table)) - 2) / table)


@pytest.mark.parametrize(("celsius", "percent", "table"), PART_2)
def test_absorption_equals_the_octave_table_of_part_2(celsius, percent, table):
    frequency = 1000.0 * 10.0 ** (0.3 * torch.arange(-4, 4, dtype=torch.float64))
    for ours, theirs in zip(absorption(frequency, celsius, percent / 100).tolist(), table, strict=True):
        # Half a unit of the last digit printed; 4.151 is printed as 4.1.
        assert ours == pytest.approx(theirs, abs=0.5 if theirs > 100 else 0.0515)


def test_air_saturates_at_the_vapour_pressure_of_water():
    # 611.66 Pa at the triple point, 2339 Pa at 20 degrees Celsius (IAPWS); the standard's formula carries three digits.
    for celsius, pressure in ((0.01, 611.66), (20.0, 2339.0)):
        share = water_vapour_concentration(number(celsius + 273.15), number(SEA_LEVEL), number(1.0))
        assert float(share) * SEA_LEVEL == pytest.approx(pressure, rel=2e-3)


def test_classical_absorption_alone_remains_at_ultrasonic_frequencies():
    # Both relaxations saturate: absorption beyond them grows with the squared frequency.
    high = absorption(torch.tensor([1e7, 2e7, 4e7], dtype=torch.float64))
    torch.testing.assert_close(high[1:] / high[:-1], torch.full((2,), 4.0).double(), rtol=1e-3, atol=0.0)


def test_absorption_per_wavelength_peaks_where_oxygen_relaxes():
    # Without the classical part, which grows on; nitrogen's relaxation shifts the peak by less than 1 %.
    frequency = torch.logspace(3.5, 4.5, 2001, dtype=torch.float64)
    vapour = 100 * float(water_vapour_concentration(number(293.15), number(SEA_LEVEL), number(0.2)))
    relaxation = 24.0 + 4.04e4 * vapour * (0.02 + vapour) / (0.391 + vapour)
    relaxing = absorption(frequency, humidity=0.2) - 1000.0 * 8.686 * 1.84e-11 * frequency**2
    peak = frequency[(relaxing / frequency).argmax()]
    assert float(peak) == pytest.approx(relaxation, rel=0.01)


@settings(max_examples=60, deadline=None)
@given(
    celsius=st.floats(-20, 50),
    humidity=st.floats(0.1, 1.0),
    pressure=st.floats(6e4, 1.1e5),
    frequency=st.floats(50, 1e4),
)
def test_air_always_takes_energy_and_more_of_higher_tones(celsius, humidity, pressure, frequency):
    one, double = absorption(torch.tensor([frequency, 2 * frequency]), celsius, humidity, pressure)
    assert 0.0 < float(one) < float(double) < 4.0001 * float(one)


def test_lift_rotor_tones_lose_nothing_and_broadband_half_a_decibel_at_250_feet():
    assert float(absorption(36.0)) * 0.0762 < 0.01
    assert 0.2 < float(absorption(1000.0)) * 0.0762 < 0.8


def test_spreading_is_six_decibels_a_doubling_and_conserves_power():
    assert float(spherical_spreading(number(152.4), 76.2)) == pytest.approx(20 * math.log10(2), rel=1e-12)
    distance = torch.tensor([1.0, 10.0, 50.0], dtype=torch.float64)
    power = distance**2 * 10.0 ** (-spherical_spreading(distance) / 10.0)
    torch.testing.assert_close(power, torch.ones_like(power), rtol=1e-12, atol=0.0)


def test_absorption_of_two_paths_is_that_of_their_sum():
    rate, near, far = number(0.03), number(120.0), number(300.0)
    product = transmitted_share(rate, near) * transmitted_share(rate, far)
    assert float(product) == pytest.approx(float(transmitted_share(rate, near + far)), rel=1e-12)
    assert float(10 * torch.log10(transmitted_share(rate, near))) == pytest.approx(-3.6, rel=1e-12)


def test_gradient_equals_central_differences():
    def rate(x):
        return 1000.0 * atmospheric_absorption(*x)[None]

    x = torch.tensor([800.0, 288.0, 9.5e4, 0.6], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(rate, x)[0]
    for i, step in enumerate((1.0, 0.1, 10.0, 1e-3)):
        one = central_difference(lambda v, i=i: rate(torch.cat([x[:i], v, x[i + 1 :]])), x[i : i + 1], step)
        assert float(exact[i]) == pytest.approx(float(one), rel=1e-7)


def test_conditions_broadcast_and_one_bad_number_leaves_the_others_alone():
    frequency = torch.tensor([100.0, float("nan"), 1000.0], dtype=torch.float64)
    result = absorption(frequency, torch.tensor([[10.0], [20.0]], dtype=torch.float64))
    assert result.shape == (2, 3)
    assert result.isnan().tolist() == [[False, True, False]] * 2
    assert float(result[1, 2]) == float(absorption(1000.0, 20.0))
    assert absorption(torch.empty(0)).shape == (0,)


def test_third_octave_centers_are_the_exact_ones_behind_the_nominal():
    centers = third_octave_centers(20.0, 20e3)
    assert len(centers) == 31
    assert float(centers[17]) == 1000.0
    torch.testing.assert_close(centers[1:] / centers[:-1], torch.full((30,), 10**0.1).double())
    with pytest.raises(ValueError, match="lowest = 0"):
        third_octave_centers(0.0, 1e3)


def test_third_octaves_hold_every_tone_once():
    centers = third_octave_centers()
    frequency = torch.tensor([[36.7, 73.4, 110.1], [1000.0, 1010.0, 5000.0]], dtype=torch.float64)
    energy = torch.tensor([[3.0, 2.0, 1.0], [1.0, 1.0, 4.0]], dtype=torch.float64)
    bands = tones_in_third_octaves(frequency, energy, centers)
    torch.testing.assert_close(bands.sum(-1), energy.sum(-1), rtol=1e-12, atol=0.0)
    assert float(bands[1, 17]) == 2.0
    raised = sound_pressure_level(bands[1, 17]) - sound_pressure_level(number(1.0))
    assert float(raised) == pytest.approx(3.0103, abs=1e-4)


def test_an_octave_is_shared_by_three_third_octaves():
    centers = third_octave_centers()
    energy = torch.tensor([6.0, 3.0], dtype=torch.float64)
    bands = bands_in_third_octaves(torch.tensor([1000.0, 4000.0], dtype=torch.float64), energy, centers, 3)
    torch.testing.assert_close(bands[16:19], torch.full((3,), 2.0).double())
    assert float(bands.sum()) == pytest.approx(9.0, rel=1e-12)

    def spectrum(log_frequency):
        return bands_in_third_octaves(log_frequency.exp(), energy[:1], centers, 3)[15:20]

    x = torch.tensor([math.log(1100.0)], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(spectrum, x)
    torch.testing.assert_close(exact, central_difference(spectrum, x, 1e-3), rtol=1e-8, atol=1e-9)
