"""The largest torque of a motor: true over the whole plane of currents, with its derivatives, for any motor."""

import json
import math
from dataclasses import fields

import numpy as np
import pytest
import torch
from conftest import FAULTS, number
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from torch.autograd import gradcheck

from lpc_mdo.cases import analyze_case
from lpc_mdo.disciplines.motor import CURRENT_TOLERANCE, VOLTAGE_TOLERANCE, MotorCircuit, operate_motor
from lpc_mdo.disciplines.motor_limits import maximum_torque

RPM = math.pi / 30.0


def logarithmic(low, high):
    return st.floats(math.log10(low), math.log10(high)).map(lambda x: 10.0**x)


MOTOR = {
    "pole_pairs": st.integers(1, 30).map(float),
    "phase_resistance": st.just(0.0) | logarithmic(1e-5, 100.0),
    "inductance_d": logarithmic(1e-6, 1e-2),
    "saliency": st.just(1.0) | st.floats(1.0, 6.0),  # inductance_q over inductance_d
    "flux_linkage": logarithmic(1e-4, 1.0),
    "voltage_limit": logarithmic(1.0, 1000.0),
    "current_limit": logarithmic(0.1, 2000.0),
}


def circuit_of(motor, **tensors):
    values = {k: number(v) for k, v in motor.items() if k != "saliency"} | tensors
    values["inductance_q"] = values["inductance_d"] * motor["saliency"]
    return MotorCircuit(**{f.name: values.get(f.name, number(0.0)) for f in fields(MotorCircuit)})


def largest_by_grid(motor, speed):
    """Largest torque over a grid of angles on the current circle and on the voltage ellipse, kept within the other limit.

    The largest torque lies on one of the two curves, since torque rises with i_q.
    """
    w, resistance, l_d = motor["pole_pairs"] * speed, motor["phase_resistance"], motor["inductance_d"]
    l_q, flux, volts, amperes = (
        l_d * motor["saliency"],
        motor["flux_linkage"],
        motor["voltage_limit"],
        motor["current_limit"],
    )

    def best(d, q):
        v_squared = (resistance * d - w * l_q * q) ** 2 + (resistance * q + w * (l_d * d + flux)) ** 2
        is_inside = (d**2 + q**2 <= amperes**2 * (1 + 1e-9)) & (v_squared <= volts**2 * (1 + 1e-9)) & (q > 0.0)
        torque = 1.5 * motor["pole_pairs"] * (flux + (l_d - l_q) * d) * q
        return torque[is_inside].max(initial=0.0)

    angle = np.linspace(-np.pi, np.pi, 100_001)
    result = best(amperes * np.sin(angle), amperes * np.cos(angle))
    if (impedance := resistance**2 + w**2 * l_d * l_q) > 0.0:
        v_d, v_q = volts * np.cos(angle), volts * np.sin(angle) - w * flux
        d, q = (resistance * v_d + w * l_q * v_q) / impedance, (resistance * v_q - w * l_d * v_d) / impedance
        result = max(result, best(d, q))
    return result


@settings(max_examples=150, deadline=None, derandomize=True)
@given(motor=st.fixed_dictionaries(MOTOR), speed=st.just(0.0) | logarithmic(0.01, 3000.0))
# R I at the current limit far above the voltage, and a voltage that nothing reaches.
@example(motor=dict(pole_pairs=7.0, phase_resistance=0.05, inductance_d=5e-5, saliency=1.0, flux_linkage=0.0075,
                    voltage_limit=48 / math.sqrt(3), current_limit=1000.0), speed=1000 * RPM)  # fmt: skip
@example(motor=dict(pole_pairs=6.0, phase_resistance=100.0, inductance_d=2e-4, saliency=1.6, flux_linkage=0.08,
                    voltage_limit=800 / math.sqrt(3), current_limit=1000.0), speed=1200 * RPM)  # fmt: skip
# At rest, with both limits met at once.
@example(motor=dict(pole_pairs=1.0, phase_resistance=10.0, inductance_d=10.0**-2.6875, saliency=4.5,
                    flux_linkage=10.0**-0.5, voltage_limit=10.0, current_limit=1.0), speed=0.0)  # fmt: skip
def test_largest_torque_is_that_of_a_dense_grid_for_any_motor(motor, speed):
    ours, theirs = float(maximum_torque(circuit_of(motor), number(speed))), largest_by_grid(motor, speed)
    # A grid of 6e-5 rad misses the largest torque by that angle squared along a limit, by the angle where two limits meet.
    assert ours >= theirs * (1.0 - 1e-7)
    assert ours == pytest.approx(theirs, rel=5e-3, abs=1e-9 * motor["flux_linkage"] * motor["current_limit"])


@settings(max_examples=60, deadline=None, derandomize=True)
@given(motor=st.fixed_dictionaries(MOTOR), speed=logarithmic(0.1, 3000.0))
def test_operation_keeps_both_limits_up_to_the_largest_torque_and_not_beyond(motor, speed):
    c, speed = circuit_of(motor), number(speed)
    largest = maximum_torque(c, speed)
    assume(float(largest) > 1e-6 * motor["pole_pairs"] * motor["flux_linkage"] * motor["current_limit"])
    below, above = (operate_motor(c, share * largest, speed) for share in (0.9, 1.02))
    assert float(below.voltage) <= float(c.voltage_limit) * (1.0 + VOLTAGE_TOLERANCE)
    # The smooth hand-over asks a few per cent of the no-load flux early: amperes beyond the limit where all of them weaken less.
    if motor["inductance_d"] * motor["current_limit"] > 0.1 * motor["flux_linkage"]:
        assert float(below.current) <= float(c.current_limit) * 1.001
    exceeds = float(above.voltage) > float(c.voltage_limit), float(above.current) > float(c.current_limit)
    assert any(exceeds)


@pytest.mark.parametrize("speed", [50.0, 700.0, 900.0, 1400.0, 2500.0])
@pytest.mark.parametrize(
    "changes", [{}, {"phase_resistance": 0.3}, {"current_limit": 2000.0, "phase_resistance": 0.1}, {"saliency": 1.0}]
)
def test_derivatives_of_the_largest_torque_are_exact_in_every_regime(speed, changes):
    motor = dict(pole_pairs=6.0, phase_resistance=0.012, inductance_d=2e-4, saliency=1.6, flux_linkage=0.08,
                 voltage_limit=462.0, current_limit=380.0) | changes  # fmt: skip
    names = [name for name in motor if name not in ("pole_pairs", "saliency")]

    def of_shares(shares):
        c = circuit_of(motor, **{name: motor[name] * shares[i] for i, name in enumerate(names)})
        return maximum_torque(c, speed * shares[-1]) / 300.0

    shares = torch.ones(len(names) + 1, dtype=torch.float64).requires_grad_()
    assert gradcheck(of_shares, shares, eps=1e-6, atol=1e-7, rtol=1e-6)


def test_largest_torque_and_its_slope_pass_from_limit_to_limit_without_a_jump():
    motor = dict(pole_pairs=6.0, phase_resistance=0.012, inductance_d=2e-4, saliency=1.6, flux_linkage=0.08,
                 voltage_limit=462.0, current_limit=1000.0)  # fmt: skip
    speed = torch.linspace(100.0, 2500.0, 40_001, dtype=torch.float64).requires_grad_()
    torque = maximum_torque(circuit_of(motor), speed)
    (slope,) = torch.autograd.grad(torque.sum(), speed)
    steps, chord = torque.detach().diff(), 0.5 * (slope[1:] + slope[:-1]) * speed.detach().diff()
    assert float((steps - chord).abs().max()) < 1e-5 * float(torque.detach().max())
    assert float(slope.diff().abs().max()) < 0.01 * float(slope.abs().max())


def test_motor_at_rest_is_finite_with_its_gradient():
    motor = dict(pole_pairs=6.0, phase_resistance=0.012, inductance_d=2e-4, saliency=1.6, flux_linkage=0.08,
                 voltage_limit=462.0, current_limit=380.0)  # fmt: skip
    for resistance in (0.012, 0.0):
        c, speed, torque = circuit_of(motor | {"phase_resistance": resistance}), number(0.0), number(50.0)
        speed, torque = speed.requires_grad_(), torque.requires_grad_()
        o = operate_motor(c, torque, speed)
        slopes = torch.autograd.grad(o.input_power + o.voltage + o.current + maximum_torque(c, speed), (speed, torque))
        assert bool(torch.stack([o.input_power, o.voltage, *slopes]).isfinite().all())
        assert float(o.input_power.detach()) == pytest.approx(1.5 * resistance * float(o.current.detach()) ** 2)


def results_of(name):
    file = FAULTS / f"{name}.json"
    return analyze_case("motor", json.loads(file.read_text()), file)["results"]


def test_motor_of_low_voltage_reaches_the_torque_of_a_grid_search():
    results = results_of("motor_low_voltage")
    motor = dict(pole_pairs=7.0, phase_resistance=0.05, inductance_d=5e-5, saliency=1.0, flux_linkage=0.0075,
                 voltage_limit=48 / math.sqrt(3), current_limit=1000.0)  # fmt: skip
    for row in results:
        assert row["maximum_torque_N_m"] == pytest.approx(largest_by_grid(motor, row["speed_rpm"] * RPM), rel=1e-6)
        assert row["is_within_limits"]
        assert "flags" not in row
    assert results[0]["maximum_torque_N_m"] == pytest.approx(29.57, rel=1e-3)


def test_motor_that_cannot_make_the_torque_at_its_voltage_says_so():
    (row,) = results_of("motor_R_100")
    assert row["voltage_V"] > 30_000.0
    assert not row["is_within_limits"]
    assert row["maximum_torque_N_m"] == pytest.approx(2.891, rel=1e-3)
    (flag,) = row["flags"]
    assert (flag["what"], flag["value"], flag["limit"]) == ("torque", 250.0, row["maximum_torque_N_m"])


def test_braking_may_take_more_torque_than_driving_and_has_limits_too():
    """Resistance takes voltage from a driving motor and gives it to a braking one."""
    case = json.loads((FAULTS / "motor_low_voltage.json").read_text())
    case["conditions"] = [{"torque_em_N_m": t, "speed_rpm": 2000.0} for t in (19.0, 20.0, -20.0, -60.0)]
    rows = analyze_case("motor", case, FAULTS)["results"]
    assert [row["is_within_limits"] for row in rows] == [True, False, True, False]
    assert [flag["what"] for flag in rows[-1]["flags"]] == ["voltage"]


def test_no_torque_within_the_limits_takes_more_than_the_largest_current():
    """Among them motors of so small an inductance x current that flux weakening hardly lowers their voltage."""
    n, draw = 4000, torch.Generator().manual_seed(0)

    def spread(low, high):
        ends = math.log(low), math.log(high)
        return torch.exp(ends[0] + (ends[1] - ends[0]) * torch.rand(n, dtype=torch.float64, generator=draw))

    values = dict(pole_pairs=torch.randint(1, 30, (n,), generator=draw).double(), phase_resistance=spread(1e-4, 100.0),
                  inductance_d=spread(1e-6, 0.1), flux_linkage=spread(1e-4, 5.0), voltage_limit=spread(5.0, 2000.0),
                  current_limit=spread(0.1, 3000.0))  # fmt: skip
    values["inductance_q"] = values["inductance_d"] * (1.0 + spread(1e-3, 50.0))
    circuit, speed = (
        MotorCircuit(**{f.name: values.get(f.name, torch.zeros(n).double()) for f in fields(MotorCircuit)}),
        spread(0.1, 3000.0),
    )
    odd = dict(pole_pairs=9.0, phase_resistance=0.553093, saliency=25.61043, inductance_d=0.003635555, flux_linkage=1.22441881,
               voltage_limit=51.64101457, current_limit=0.154655921)  # fmt: skip
    for c, w in ((circuit, speed), (circuit_of(odd), number(4.68085))):
        largest = maximum_torque(c, w)
        for share in (1.0, 0.99, 0.8):
            o = operate_motor(c, share * largest, w)
            is_driven = largest > 1e-9
            assert bool((o.current <= (1.0 + CURRENT_TOLERANCE) * c.current_limit)[is_driven].all())
            assert bool((o.voltage <= (1.0 + VOLTAGE_TOLERANCE) * c.voltage_limit)[is_driven].all())
