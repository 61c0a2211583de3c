"""Inclined rotors: the axial limit, Glauert's edgewise flow, symmetry, rotation of axes, differences."""

import math

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum, station_radii
from lpc_mdo.disciplines.inclined_rotor import InclinedFlow, inclined_rotor, plane_basis
from lpc_mdo.surrogates.airfoil import load_airfoil


def linear_polar(alpha, reynolds, mach):
    cl = 0.45 + 5.9 * alpha
    return cl, 0.009 + 0.008 * cl**2


def a_rotor(stations=20):
    radius, hub = number(1.5), number(0.3)
    r, _ = station_radii(radius, hub, stations)
    return Rotor(radius, hub, torch.full_like(r, 0.15), torch.deg2rad(24.0 - 8.0 * r / radius), number(3.0))


def a_flow(velocity, axis=(0.0, 0.0, 1.0), spin=1.0, speed=130.0):
    vector = torch.as_tensor(velocity, dtype=torch.float64)
    unit = torch.as_tensor(axis, dtype=torch.float64)
    unit = unit / unit.norm()
    return InclinedFlow(vector, unit, number(spin), number(speed), number(1.2), number(340.0), number(1.8e-5))


@pytest.mark.parametrize("axial", [0.0, 12.0, -3.0])
def test_axial_flow_gives_exactly_the_axial_result(axial):
    inflow = Inflow(number(axial), number(130.0), number(1.2), number(340.0), number(1.8e-5))
    straight = blade_element_momentum(a_rotor(), inflow, load_airfoil())
    inclined = inclined_rotor(a_rotor(), a_flow((0.0, 0.0, -axial)), load_airfoil())
    assert float(inclined.thrust) == pytest.approx(float(straight.thrust), rel=1e-9)
    assert float(inclined.torque) == pytest.approx(float(straight.torque), rel=1e-9)
    thrust, torque = float(straight.thrust), float(straight.torque)
    torch.testing.assert_close(inclined.force, number(thrust) * torch.tensor([0.0, 0, 1]).double(), rtol=0, atol=1e-6)
    torch.testing.assert_close(inclined.moment, number(torque) * torch.tensor([0.0, 0, -1]).double(), rtol=0, atol=1e-6)


def test_wind_in_the_plane_drags_the_hub_along_and_lifts_the_advancing_side():
    """Right-handed spin about z in wind along x: blades advance at +y; more lift there rolls about +x."""
    loads = inclined_rotor(a_rotor(), a_flow((15.0, 0.0, -5.0)), linear_polar)
    assert float(loads.force[0]) > 0.0
    assert float(loads.moment[0]) > 0.05 * float(loads.thrust)
    assert float(loads.moment[2]) == pytest.approx(-float(loads.torque), rel=1e-12)


def test_thrust_grows_with_the_square_of_the_wind_in_the_plane():
    base, *more = (
        float(inclined_rotor(a_rotor(), a_flow((v, 0.0, -10.0)), linear_polar).thrust) for v in (0.0, 2.0, 4.0)
    )
    assert (more[1] - base) / (more[0] - base) == pytest.approx(4.0, rel=0.02)


def test_opposite_spin_mirrors_the_loads():
    mirror = torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
    right, left = (inclined_rotor(a_rotor(), a_flow((15.0, 0.0, -5.0), spin=s), linear_polar) for s in (1.0, -1.0))
    torch.testing.assert_close(left.force, right.force * mirror, rtol=1e-10, atol=1e-8)
    torch.testing.assert_close(left.moment, -right.moment * mirror, rtol=1e-10, atol=1e-8)


def test_turning_axis_and_wind_together_turns_the_loads():
    angle = 0.7
    c, s = math.cos(angle), math.sin(angle)
    turn = torch.tensor([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], dtype=torch.float64)
    wind, axis = torch.tensor([12.0, 4.0, -6.0], dtype=torch.float64), torch.tensor([0.0, 0, 1]).double()
    one = inclined_rotor(a_rotor(), a_flow(wind), linear_polar, azimuths=16)
    other = inclined_rotor(a_rotor(), a_flow(turn @ wind, turn @ axis), linear_polar, azimuths=16)
    torch.testing.assert_close(other.force, turn @ one.force, rtol=1e-7, atol=1e-5)
    torch.testing.assert_close(other.moment, turn @ one.moment, rtol=1e-7, atol=1e-5)


def test_azimuthal_average_converges_faster_than_any_power():
    flow = a_flow((25.0, 0.0, -8.0))
    values = [float(inclined_rotor(a_rotor(), flow, linear_polar, azimuths=n).thrust) for n in (4, 8, 16, 64)]
    errors = [abs(v / values[-1] - 1.0) for v in values[:-1]]
    assert errors[0] < 1e-3
    assert errors[1] < 1e-5
    assert errors[2] < 1e-8


def test_basis_is_right_handed_everywhere():
    generator = torch.Generator().manual_seed(3)
    axis = torch.randn(200, 3, generator=generator, dtype=torch.float64)
    axis = torch.cat(
        [axis / axis.norm(dim=-1, keepdim=True), torch.tensor([[0, 0, 1.0], [0, 0, -1], [1, 0, 0]]).double()]
    )
    first, second = plane_basis(axis)
    torch.testing.assert_close(torch.linalg.cross(first, second), axis, rtol=0.0, atol=1e-14)
    torch.testing.assert_close((first * axis).sum(-1), torch.zeros(203).double(), rtol=0.0, atol=1e-14)


def test_edgewise_flow_has_a_finite_solution_with_reversed_flow_at_the_root():
    # The root moves at 39 m/s.
    loads = inclined_rotor(a_rotor(), a_flow((60.0, 0.0, 0.0)), load_airfoil())
    assert bool(loads.force.isfinite().all() & loads.moment.isfinite().all())


def test_gradient_in_axial_and_inclined_flow_equals_central_differences():
    def loads(x):
        rotor = a_rotor(8)
        rotor = Rotor(rotor.radius, rotor.hub_radius, rotor.chord * x[4], rotor.twist + x[5], rotor.blades)
        air = (number(1.2), number(340.0), number(1.8e-5))
        axis = torch.tensor([0.0, 0, 1]).double()
        result = inclined_rotor(rotor, InclinedFlow(x[:3], axis, number(1.0), x[3], *air), load_airfoil())
        return torch.cat([result.force, result.moment])

    for wind in ((0.0, 0.0, -4.0), (8.0, 3.0, -4.0)):
        x = torch.tensor([*wind, 120.0, 1.0, 0.02], dtype=torch.float64)
        exact = torch.autograd.functional.jacobian(loads, x)
        torch.testing.assert_close(exact, central_difference(loads, x, 1e-4), rtol=1e-6, atol=1e-5)


def test_raises_for_too_few_azimuths():
    with pytest.raises(ValueError, match="azimuths = 3 is not allowed"):
        inclined_rotor(a_rotor(), a_flow((0.0, 0.0, -4.0)), linear_polar, azimuths=3)
