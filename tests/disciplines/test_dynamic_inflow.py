"""Pitt and Peters' inflow against momentum theory, its published limits and annulus momentum."""

import math

import pytest
import torch
from conftest import central_difference, number
from test_inclined_rotor import a_flow, a_rotor, linear_polar

from lpc_mdo.disciplines.blade_element import Rotor
from lpc_mdo.disciplines.dynamic_inflow import (
    APPARENT_MASS,
    dynamic_inflow_loads,
    dynamic_inflow_rate,
    dynamic_inflow_rotor,
    inflow_matrices,
    steady_inflow,
)
from lpc_mdo.disciplines.inclined_rotor import InclinedFlow, inclined_rotor


def test_hover_has_the_mean_inflow_of_the_actuator_disk_and_no_gradient():
    flow = a_flow((0.0, 0.0, 0.0))
    states = steady_inflow(a_rotor(), flow, linear_polar)
    thrust = float(dynamic_inflow_loads(a_rotor(), flow, linear_polar, states).thrust)
    assert float(states[0]) == pytest.approx(math.sqrt(thrust / (2 * 1.2 * math.pi * 1.5**2)), rel=1e-9)
    assert float(states[1:].abs().max()) < 1e-9


def test_gain_matrix_has_the_published_limits():
    """Axial flow: diag(1/2, 2, 2). Edgewise: the gradient along the wind cannot be held, 15 pi/32 of the mean leads aft."""
    axial, _ = inflow_matrices(a_flow((0.0, 0.0, -20.0)), number(5.0))
    torch.testing.assert_close(axial, torch.diag(torch.tensor([0.5, 2.0, 2.0], dtype=torch.float64)))
    edgewise, flow_through = inflow_matrices(a_flow((50.0, 0.0, 0.0)), number(1e-9))
    # The first axis of the disk is x for a disk facing z.
    assert float(edgewise[1, 0] / edgewise[0, 0]) == pytest.approx(15 * math.pi / 32, rel=1e-6)
    assert float(edgewise[1, 1]) == pytest.approx(0.0, abs=1e-6)
    assert float(edgewise[2, 2]) == pytest.approx(4.0, rel=1e-6)
    assert float(flow_through[0]) == pytest.approx(50.0, rel=1e-6)


def test_more_lift_on_one_side_has_more_downwash_there():
    flow = a_flow((20.0, 0.0, -2.0))  # blades advance at +y
    states = steady_inflow(a_rotor(), flow, linear_polar)
    loads = dynamic_inflow_loads(a_rotor(), flow, linear_polar, states)
    assert float(loads.moment[0]) > 0.0
    assert float(states[2]) > 0.0
    assert float(states[1]) > 0.0  # and aft of the hub


def test_gap_to_annulus_momentum_vanishes_with_the_loading():
    """Inflow uniform along the blade, no swirl, no tip loss, wind in the disk as mass flow: it all falls with solidity.

    In edgewise flow at full loading the two are a third apart, since annulus momentum knows the axial flow alone.
    """
    few = a_rotor()
    for wind in ((0.0, 0.0, -10.0), (15.0, 0.0, -10.0), (40.0, 0.0, -5.0)):
        gaps = []
        for share in (1.0, 0.1, 0.001):
            rotor = Rotor(few.radius, few.hub_radius, few.chord * share, few.twist, few.blades)
            annulus, states = (
                float(model(rotor, a_flow(wind), linear_polar).thrust)
                for model in (inclined_rotor, dynamic_inflow_rotor)
            )
            gaps.append(abs(states / annulus - 1.0))
        assert gaps[2] < 0.5 * gaps[1] < 0.5 * gaps[0]
        assert gaps[2] < 0.01


def test_inflow_settles_at_the_steady_state_and_starts_with_the_apparent_mass():
    flow, rotor = a_flow((12.0, 0.0, -6.0)), a_rotor(12)
    states = torch.zeros(3, dtype=torch.float64)
    first = dynamic_inflow_rate(rotor, flow, linear_polar, states)
    thrust = float(dynamic_inflow_loads(rotor, flow, linear_polar, states).thrust)
    # At rest all thrust accelerates the air.
    expected = thrust / (1.2 * math.pi * 1.5**2) / (APPARENT_MASS[0] * 1.5)
    assert float(first[0]) == pytest.approx(expected, rel=1e-9)
    for _ in range(300):  # midpoint rule over 0.6 s
        half = states + 1e-3 * dynamic_inflow_rate(rotor, flow, linear_polar, states)
        states = states + 2e-3 * dynamic_inflow_rate(rotor, flow, linear_polar, half)
    torch.testing.assert_close(states, steady_inflow(rotor, flow, linear_polar), rtol=1e-4, atol=1e-4)


def test_steady_rate_is_zero_and_axes_do_not_matter():
    flow = a_flow((10.0, 5.0, -6.0))
    states = steady_inflow(a_rotor(), flow, linear_polar)
    assert float(dynamic_inflow_rate(a_rotor(), flow, linear_polar, states).abs().max()) < 1e-8
    turned = a_flow((-5.0, 10.0, -6.0))
    one, other = (dynamic_inflow_rotor(a_rotor(), f, linear_polar) for f in (flow, turned))
    quarter = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    torch.testing.assert_close(other.force, quarter @ one.force, rtol=1e-8, atol=1e-6)


def loads_at(x):
    rotor = a_rotor(6)
    rotor = Rotor(rotor.radius, rotor.hub_radius, rotor.chord * x[4], rotor.twist + x[5], rotor.blades)
    axis = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
    air = (number(1.2), number(340.0), number(1.8e-5))
    result = dynamic_inflow_rotor(rotor, InclinedFlow(x[:3], axis, number(1.0), x[3], *air), linear_polar)
    return torch.cat([result.force, result.moment])


def test_gradient_equals_central_differences():
    x = torch.tensor([8.0, 3.0, -4.0, 120.0, 1.0, 0.02], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(loads_at, x)
    torch.testing.assert_close(exact, central_difference(loads_at, x, 1e-4), rtol=1e-6, atol=1e-4)


def test_a_batch_equals_a_loop_and_an_undefined_element_stays_alone():
    winds = torch.tensor([[8.0, 3.0, -4.0], [math.nan] * 3, [20.0, 0.0, 0.0]], dtype=torch.float64)
    batch = dynamic_inflow_rotor(a_rotor(), a_flow(winds), linear_polar)
    assert batch.thrust.isnan().tolist() == [False, True, False]
    for i in (0, 2):
        one = dynamic_inflow_rotor(a_rotor(), a_flow(winds[i]), linear_polar)
        torch.testing.assert_close(batch.force[i], one.force, rtol=1e-9, atol=1e-6)
