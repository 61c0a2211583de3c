"""Blade-element momentum theory against CCBlade, momentum theory and random conditions."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from conftest import central_difference, number
from hypothesis import given, settings
from hypothesis import strategies as st

from lpc_mdo.cases.aerodynamics import RotorCondition, RotorInputs, analyze_rotor
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum, station_radii
from lpc_mdo.surrogates.airfoil import load_airfoil
from lpc_mdo.verification.random_rotors import random_conditions
from lpc_mdo.verification.rotors import complex_step_loads
from lpc_mdo.verification.rotors import linear_polar as plain_section

AIR = (number(1.2), number(340.0), number(1.8e-5))


def linear_polar(alpha, reynolds, mach):
    cl = 0.45 + 5.9 * alpha
    return cl, 0.009 + 0.008 * cl**2


def a_rotor(twist_shift=0.0, stations=28):
    radius, hub = number(1.5), number(0.3)
    r, _ = station_radii(radius, hub, stations)
    twist = torch.deg2rad(24.0 - 8.0 * r / radius) + twist_shift
    return Rotor(radius, hub, torch.full_like(r, 0.15), twist, number(3.0))


def an_inflow(axial=0.0, speed=130.0, density=1.2):
    return Inflow(number(axial), number(speed), number(density), number(340.0), number(1.8e-5))


@pytest.mark.parametrize("name", ["bem_lift_rotor_axial", "bem_pusher_axial"])
def test_stations_and_integrals_equal_ccblade(reference, name):
    # The case's own note: local values satisfy the momentum balance to 1e-9.
    case = reference(name)
    inputs = RotorInputs.model_validate(case["inputs"])
    keys = RotorCondition.model_fields
    conditions = [RotorCondition(**{k: r[k] for k in keys}) for r in case["results"]]
    for ours, theirs in zip(analyze_rotor(inputs, conditions, None), case["results"], strict=True):
        assert ours["thrust_N"] == pytest.approx(theirs["thrust_midpoint_N"], rel=1e-9)
        assert ours["torque_N_m"] == pytest.approx(theirs["torque_midpoint_Nm"], rel=1e-9)
        assert ours["stations"]["dT_dr_N_per_m"] == pytest.approx(theirs["stations"]["dT_dr_N_per_m"], rel=1e-8)
        assert ours["stations"]["dQ_dr_Nm_per_m"] == pytest.approx(theirs["stations"]["dQ_dr_Nm_per_m"], rel=1e-8)


def test_hundred_thousand_random_conditions_all_have_a_root():
    polar, flags = load_airfoil(), []
    for part in range(20):
        rotor, inflow = random_conditions(5000, stations=4, seed=part)
        twist = rotor.twist.requires_grad_()
        loads = blade_element_momentum(rotor, inflow, polar)
        assert float(loads.residual.abs().max()) < 1e-11
        for values in (loads.thrust, loads.torque, loads.power):
            assert bool(values.isfinite().all())
        (gradient,) = torch.autograd.grad((loads.thrust / (1.0 + loads.thrust.detach().abs())).sum(), twist)
        assert bool(gradient.isfinite().all())
        assert not bool((loads.is_vortex_ring & (inflow.axial_velocity >= 0.0)).any())
        flags.append([int(loads.is_vortex_ring.sum()), int(loads.is_windmilling.sum())])
    assert min(sum(column) for column in zip(*flags, strict=True)) > 1000


@pytest.mark.parametrize(("seed", "index"), [(160, 890), (129, 4479)])
def test_roots_that_once_escaped_are_found(seed, index):
    """Of a million conditions: a first guess where the residual falls towards a fold, and a last step that left too much."""
    rotor, inflow = random_conditions(5000, 4, seed)
    part = slice(index, index + 1)
    one, air = (type(o)(*(v[part] for v in vars(o).values())) for o in (rotor, inflow))
    loads = blade_element_momentum(one, air, load_airfoil())
    assert float(loads.residual.abs().max()) < 1e-11


def test_ideal_rotor_approaches_figure_of_merit_one():
    # Ideal twist ~ 1/r, no drag, lightly loaded, many blades so that tip loss and swirl vanish.
    radius, hub = number(1.0), number(0.05)
    r, _ = station_radii(radius, hub, 200)
    rotor = Rotor(radius, hub, torch.full_like(r, 0.002), 0.05 / r, number(40.0))
    inflow = Inflow(number(0.0), number(200.0), number(1.2), number(340.0), number(1.8e-5))
    loads = blade_element_momentum(rotor, inflow, lambda a, re, m: (2 * math.pi * a, torch.full_like(a, 1e-9)))
    assert 0.97 < float(loads.figure_of_merit) < 1.0


def test_figure_of_merit_never_exceeds_one_in_random_hover():
    rotor, inflow = random_conditions(3000)
    inflow = Inflow(
        0 * inflow.axial_velocity,
        inflow.rotation_speed,
        inflow.density,
        inflow.speed_of_sound,
        inflow.dynamic_viscosity,
    )
    assert float(blade_element_momentum(rotor, inflow, load_airfoil()).figure_of_merit.max()) < 1.0


def test_thrust_and_torque_are_proportional_to_density():
    thin, dense = (blade_element_momentum(a_rotor(), an_inflow(density=d), linear_polar) for d in (0.6, 1.2))
    assert float(dense.thrust / thin.thrust) == pytest.approx(2.0, rel=1e-12)
    assert float(dense.torque / thin.torque) == pytest.approx(2.0, rel=1e-12)


def test_hover_is_the_limit_of_slow_climb():
    hover, climb = (blade_element_momentum(a_rotor(), an_inflow(axial=v), linear_polar) for v in (0.0, 1e-7))
    assert float(climb.thrust) == pytest.approx(float(hover.thrust), rel=1e-8)


def test_climb_power_exceeds_hover_power_at_the_same_thrust():
    """Momentum theory: P = T (V + v); at fixed thrust climbing costs power."""
    hover = blade_element_momentum(a_rotor(), an_inflow(), linear_polar)
    low, high = 0.0, 0.3
    for _ in range(60):
        middle = 0.5 * (low + high)
        climb = blade_element_momentum(a_rotor(twist_shift=middle), an_inflow(axial=8.0), linear_polar)
        low, high = (middle, high) if climb.thrust < hover.thrust else (low, middle)
    induced = math.sqrt(float(hover.thrust) / (2 * 1.2 * float(hover.disk_area)))
    ideal_gain = float(hover.thrust) * (4.0 + math.sqrt(16.0 + induced**2) - induced)
    assert float(climb.power - hover.power) == pytest.approx(ideal_gain, rel=0.25)


def test_momentum_balance_holds_at_every_station():
    """dT = 4 pi r rho F |Vx + u| u, from loads and inflow angle alone, for tip loss F."""
    loads = blade_element_momentum(a_rotor(), an_inflow(axial=10.0), linear_polar)
    r, phi = loads.station_radius, loads.inflow_angle
    f = 1.5 * (1.5 - r) / (r * torch.sin(phi))
    loss = (2 / math.pi) * torch.acos(torch.exp(-f))
    drag_lift = loads.drag_coefficient / loads.lift_coefficient
    swirl_ratio = torch.tan(phi + torch.atan(drag_lift))  # v/u
    induced = (130.0 * r * torch.tan(phi) - 10.0) / (1.0 + swirl_ratio * torch.tan(phi))
    thrust = 4 * math.pi * r * 1.2 * loss * (10.0 + induced) * induced
    torch.testing.assert_close(loads.thrust_per_length, thrust, rtol=1e-9, atol=0.0)


def test_gradient_equals_central_differences():
    polar = load_airfoil()

    def loads(x):
        stations = torch.ones(28, dtype=torch.float64)
        rotor = Rotor(
            x[0], 0.2 * x[0], x[1] * stations, x[2] * torch.linspace(1.4, 0.6, 28, dtype=torch.float64), number(3.0)
        )
        inflow = Inflow(x[3], x[4], x[5], number(340.0), number(1.8e-5))
        result = blade_element_momentum(rotor, inflow, polar)
        return torch.stack([result.thrust, result.torque])

    x = torch.tensor([1.5, 0.15, 0.25, 4.0, 120.0, 1.1], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(loads, x)
    differences = central_difference(loads, x, 1e-4)
    torch.testing.assert_close(exact, differences, rtol=1e-7, atol=1e-6)


def test_a_batch_equals_a_loop():
    rotor, inflow = random_conditions(20)
    batch = blade_element_momentum(rotor, inflow, linear_polar).thrust
    for i in range(20):
        one = Rotor(*(getattr(rotor, f)[i] for f in ("radius", "hub_radius", "chord", "twist", "blades")))
        air = Inflow(
            *(
                getattr(inflow, f)[i]
                for f in ("axial_velocity", "rotation_speed", "density", "speed_of_sound", "dynamic_viscosity")
            )
        )
        assert float(blade_element_momentum(one, air, linear_polar).thrust) == pytest.approx(float(batch[i]), rel=1e-10)


def test_a_hub_beyond_the_tip_is_refused():
    rotor = a_rotor()
    with pytest.raises(ValueError, match="hub_radius"):
        blade_element_momentum(
            Rotor(rotor.radius, number(2.0), rotor.chord, rotor.twist, rotor.blades), an_inflow(), linear_polar
        )


def test_implicit_gradient_equals_complex_step():
    """Radius, chord, twist, axial velocity, speed; independent formulas (the published residual) and derivative."""
    values = [1.5, 0.15, 0.3, 6.0, 120.0]
    theirs = []
    for i in range(5):
        arguments = [value + (1e-30j if k == i else 0.0) for k, value in enumerate(values)]
        theirs.append(complex_step_loads(*arguments).imag / 1e-30)

    def ours(x):
        one = torch.ones(20, dtype=torch.float64)
        rotor = Rotor(x[0], 0.2 * x[0], x[1] * one, x[2] * one, number(3.0))
        loads = blade_element_momentum(rotor, Inflow(x[3], x[4], *AIR), plain_section)
        return torch.stack([loads.thrust, loads.torque])

    x = torch.tensor(values, dtype=torch.float64)
    np.testing.assert_allclose(ours(x).numpy(), complex_step_loads(*values).real, rtol=1e-12)
    jacobian = torch.autograd.functional.jacobian(ours, x).numpy()
    np.testing.assert_allclose(jacobian, np.array(theirs).T, rtol=1e-8)


def test_hub_loss_lowers_thrust_near_the_hub_alone():
    without, with_loss = (
        blade_element_momentum(a_rotor(), an_inflow(axial=5.0), linear_polar, has_hub_loss=h) for h in (False, True)
    )
    ratio = with_loss.thrust_per_length / without.thrust_per_length
    assert float(ratio[0]) < 0.9
    assert float(ratio[-1]) == pytest.approx(1.0, abs=1e-3)


def test_swirl_carries_the_torque():
    """dQ = 4 pi r^2 rho F (Vx + u) v: angular momentum of the annulus."""
    loads = blade_element_momentum(a_rotor(), an_inflow(axial=10.0), linear_polar)
    r, phi = loads.station_radius, loads.inflow_angle
    loss = (2 / math.pi) * torch.acos(torch.exp(-1.5 * (1.5 - r) / (r * torch.sin(phi))))
    torque = 4 * math.pi * r**2 * 1.2 * loss * (10.0 + loads.axial_induction) * loads.swirl
    torch.testing.assert_close(loads.torque_per_length, torque, rtol=1e-9, atol=0.0)


def test_induction_in_hover_is_the_actuator_disks():
    """T = 2 rho A v^2 for the mean of the induced velocity weighted by the flow, tip loss apart."""
    radius, hub = number(1.0), number(0.05)
    r, _ = station_radii(radius, hub, 200)
    rotor = Rotor(radius, hub, torch.full_like(r, 0.002), 0.05 / r, number(40.0))
    loads = blade_element_momentum(rotor, an_inflow(speed=200.0), lambda a, re, m: (2 * math.pi * a, 1e-9 + 0 * a))
    disk = math.sqrt(float(loads.thrust) / (2 * 1.2 * math.pi))
    assert float(loads.axial_induction[100]) == pytest.approx(disk, rel=0.02)


def test_flags_name_the_state():
    descent = blade_element_momentum(a_rotor(), an_inflow(axial=-8.0), linear_polar)
    assert bool(descent.is_vortex_ring)
    windmill = blade_element_momentum(a_rotor(-0.5), an_inflow(axial=60.0, speed=60.0), linear_polar)
    assert bool(windmill.is_windmilling)
    hover = blade_element_momentum(a_rotor(), an_inflow(), linear_polar)
    assert not bool(hover.is_vortex_ring | hover.is_windmilling | hover.is_tip_fast)
    assert float(hover.tip_mach) == pytest.approx(130.0 * 1.5 / 340.0, rel=1e-12)
    assert bool(blade_element_momentum(a_rotor(), an_inflow(speed=170.0), linear_polar).is_tip_fast)
    shares = [float(hover.stall_fraction(-0.2, limit)) for limit in (0.0, 0.1, 0.5)]
    assert shares == sorted(shares, reverse=True)
    assert shares[0] > 0.9
    assert shares[-1] == 0.0


def small_loads(twist, chord, axial):
    rotor = Rotor(number(1.5), number(0.3), chord, twist, number(3.0))
    loads = blade_element_momentum(rotor, Inflow(axial, number(130.0), *AIR), linear_polar)
    return loads.thrust, loads.torque, loads.inflow_angle


def test_first_and_second_derivatives_pass_gradcheck():
    twist = torch.tensor([0.4, 0.3, 0.2], dtype=torch.float64, requires_grad=True)
    chord = torch.full((3,), 0.15, dtype=torch.float64, requires_grad=True)
    axial = number(5.0).requires_grad_()
    assert torch.autograd.gradcheck(small_loads, (twist, chord, axial))
    assert torch.autograd.gradgradcheck(small_loads, (twist, chord, axial), rtol=1e-4)


def test_leading_dimensions_broadcast():
    twist = torch.linspace(0.2, 0.4, 6, dtype=torch.float64).reshape(2, 1, 3)
    axial = torch.tensor([0.0, 5.0, 10.0, 15.0], dtype=torch.float64)
    thrust, _, _ = small_loads(twist, torch.full((3,), 0.15, dtype=torch.float64), axial)
    assert thrust.shape == (2, 4)
    one, _, _ = small_loads(twist[1, 0], torch.full((3,), 0.15, dtype=torch.float64), axial[2])
    assert float(thrust[1, 2]) == pytest.approx(float(one), rel=1e-12)


def test_single_precision_agrees_with_double():
    double = blade_element_momentum(a_rotor(), an_inflow(axial=5.0), linear_polar)
    rotor, inflow = (type(o)(*(v.float() for v in vars(o).values())) for o in (a_rotor(), an_inflow(axial=5.0)))
    single = blade_element_momentum(rotor, inflow, linear_polar)
    assert single.thrust.dtype == torch.float32
    assert float(single.thrust) == pytest.approx(float(double.thrust), rel=1e-4)


def test_an_undefined_rotor_leaves_the_others_alone():
    axial = torch.tensor([5.0, math.nan, 5.0], dtype=torch.float64)
    thrust, _, _ = small_loads(torch.full((3,), 0.3).double(), torch.full((3,), 0.15).double(), axial)
    assert thrust.isnan().tolist() == [False, True, False]
    assert float(thrust[0]) == float(thrust[2])


def test_an_empty_batch_has_an_empty_result():
    thrust, _, angle = small_loads(
        torch.full((3,), 0.3).double(), torch.full((3,), 0.15).double(), torch.empty(0).double()
    )
    assert thrust.shape == (0,)
    assert angle.shape == (0, 3)


@pytest.mark.parametrize("name", ["chord", "blades"])
@pytest.mark.parametrize("value", [0.0, -0.1])
def test_blades_of_no_width_or_number_are_refused(name, value):
    """Without a chord the annulus equation has a double root in hover and no sign change."""
    rotor = a_rotor()
    size = getattr(rotor, name).clone()
    size.view(-1)[0] = value
    with pytest.raises(ValueError, match=rf"rotor\.{name} = {value:g} is invalid: it must be above 0"):
        blade_element_momentum(replace(rotor, **{name: size}), an_inflow(), linear_polar)


@pytest.mark.parametrize("name", ["density", "speed_of_sound", "dynamic_viscosity"])
def test_no_air_is_refused(name):
    with pytest.raises(ValueError, match=rf"inflow\.{name} = 0 is invalid"):
        blade_element_momentum(a_rotor(), replace(an_inflow(), **{name: number(0.0)}), linear_polar)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    chord=st.floats(-8.0, 1.0).map(lambda x: 10.0**x),
    twist=st.floats(-math.pi, math.pi),
    axial=st.just(0.0) | st.floats(-300.0, 300.0),
    speed=st.floats(-3.0, 4.0).map(lambda x: 10.0**x),
    blades=st.integers(1, 12),
)
def test_any_rotor_has_finite_loads_and_bounded_efficiencies_where_they_are_defined(chord, twist, axial, speed, blades):
    r, _ = station_radii(number(1.5), number(0.3), 12)
    rotor = Rotor(number(1.5), number(0.3), torch.full_like(r, chord), torch.full_like(r, twist), number(float(blades)))
    for polar in (linear_polar, load_airfoil()):
        loads = blade_element_momentum(rotor, an_inflow(axial, speed), polar)
        assert bool(torch.stack([loads.thrust, loads.torque, loads.tip_mach]).isfinite().all())
        if bool(loads.is_propelling):
            assert 0.0 <= float(loads.propulsive_efficiency) < 1.0
            assert float(loads.figure_of_merit) < 1.0
