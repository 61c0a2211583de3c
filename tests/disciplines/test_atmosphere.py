"""Standard atmosphere against the tables of ISO 2533 and the laws it is made of."""

import pytest
import torch
from conftest import number

from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.numerics.constants import GRAVITY

ALTITUDES = torch.linspace(-2000.0, 11000.0, 53, dtype=torch.float64)

# ISO 2533:1975 by geopotential altitude: K, Pa, kg/m^3, m/s, Pa s; the tolerance is the tables' last digit.
TABLE = [
    (0.0, 288.15, 101325.0, 1.2250, 340.294, 1.7894e-5),
    (1500.0, 278.40, 84556.0, 1.0581, 334.487, 1.7419e-5),
    (11000.0, 216.65, 22632.0, 0.36392, 295.069, 1.4216e-5),
]


@pytest.mark.parametrize("row", TABLE)
def test_air_is_that_of_the_published_tables(row):
    air = standard_atmosphere(number(row[0]))
    assert float(air.temperature) == pytest.approx(row[1], abs=1e-9)
    assert float(air.pressure) == pytest.approx(row[2], abs=0.6)
    assert float(air.density) == pytest.approx(row[3], abs=6e-5)
    assert float(air.speed_of_sound) == pytest.approx(row[4], abs=1e-3)
    assert float(air.dynamic_viscosity) == pytest.approx(row[5], abs=6e-10)


def test_air_is_in_hydrostatic_balance():
    """dp/dh = -rho g, by automatic differentiation."""
    altitude = ALTITUDES.clone().requires_grad_()
    air = standard_atmosphere(altitude)
    (slope,) = torch.autograd.grad(air.pressure.sum(), altitude)
    torch.testing.assert_close(slope, -air.density.detach() * GRAVITY, rtol=1e-12, atol=0.0)


def test_air_is_an_ideal_diatomic_gas():
    """c_p - c_v = R and a^2 = gamma p/rho; R from the universal constant and the molar mass of ISO 2533."""
    air = standard_atmosphere(ALTITUDES, temperature_offset=12.0)
    constant = 8.31432 / 28.964420e-3
    torch.testing.assert_close(
        air.pressure / (air.density * air.temperature), torch.full_like(ALTITUDES, constant), rtol=1e-7, atol=0
    )
    torch.testing.assert_close(air.speed_of_sound**2, 1.4 * air.pressure / air.density, rtol=1e-12, atol=0.0)


def test_hot_day_thins_the_air_at_unchanged_pressure():
    standard, hot = standard_atmosphere(ALTITUDES), standard_atmosphere(ALTITUDES, temperature_offset=20.0)
    torch.testing.assert_close(hot.pressure, standard.pressure, rtol=0.0, atol=0.0)
    torch.testing.assert_close(
        hot.density * hot.temperature, standard.density * standard.temperature, rtol=1e-14, atol=0
    )
    assert bool((hot.density < standard.density).all())
    assert bool((hot.speed_of_sound > standard.speed_of_sound).all())
    assert bool((hot.dynamic_viscosity > standard.dynamic_viscosity).all())


def test_temperature_falls_by_six_and_a_half_kelvin_per_kilometre():
    air = standard_atmosphere(ALTITUDES)
    assert float((air.temperature[0] - air.temperature[-1]) / 13.0) == pytest.approx(6.5, rel=1e-13)
    for values in (air.pressure, air.density, air.speed_of_sound, air.dynamic_viscosity):
        assert bool((values.diff() < 0.0).all())


@pytest.mark.parametrize("altitude", [-2001.0, 11001.0])
def test_altitudes_beyond_the_layer_are_refused(altitude):
    with pytest.raises(ValueError, match=r"altitude = -?\d+ m is not allowed; it must lie between -2000 and 11000"):
        standard_atmosphere(torch.tensor([0.0, altitude], dtype=torch.float64))


def values_of(altitude):
    air = standard_atmosphere(altitude, 5.0)
    return air.temperature, air.pressure, air.density, air.speed_of_sound, air.dynamic_viscosity


def test_derivatives_of_any_order_pass_gradcheck():
    altitude = torch.tensor([0.0, 3000.0, 9000.0], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(values_of, altitude, eps=1.0, atol=1e-12, rtol=1e-6)
    assert torch.autograd.gradgradcheck(values_of, altitude, eps=1.0, atol=1e-12, rtol=1e-5)


def test_single_precision_empty_batches_and_undefined_elements():
    for single, double in zip(values_of(ALTITUDES.float()), values_of(ALTITUDES), strict=True):
        assert single.dtype == torch.float32
        torch.testing.assert_close(single.double(), double, rtol=1e-5, atol=0.0)
    assert values_of(torch.empty(0, 3).double())[0].shape == (0, 3)
    density = values_of(torch.tensor([1000.0, float("nan"), 1000.0], dtype=torch.float64))[2]
    assert density.isnan().tolist() == [False, True, False]
