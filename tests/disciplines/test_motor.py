"""Motor operation against reference currents, scans of the dq plane, and the balance of power."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
import torch
from conftest import central_difference, number
from scipy.optimize import brentq, minimize_scalar

from lpc_mdo.cases.electric import MotorCondition, MotorInputs, analyze_motor
from lpc_mdo.disciplines.motor import (
    HANDOVER_WIDTH,
    VOLTAGE_TOLERANCE,
    MotorCircuit,
    electromagnetic_torque,
    friction_torque,
    maximum_torque_per_ampere,
    operate_motor,
    voltage_squared,
)
from lpc_mdo.disciplines.motor_limits import efficiency_map, maximum_torque

RPM = math.pi / 30.0
CIRCUIT = {
    "pole_pairs": 6.0,
    "phase_resistance": 0.012,
    "inductance_d": 2.0e-4,
    "inductance_q": 3.2e-4,
    "flux_linkage": 0.08,
    "voltage_limit": 800.0 / math.sqrt(3.0),
    "current_limit": 380.0,
    "hysteresis": 0.33,
    "eddy": 2.2e-3,
    "bearing_torque": 0.2,
    "windage": 2.3e-7,
    "stray_share": 0.0075,
}
SMOOTH_RUNNING = {"bearing_torque": 0.0, "windage": 0.0}  # air-gap torque is the shaft's


def a_motor(**changes):
    return MotorCircuit(**{k: torch.as_tensor(v, dtype=torch.float64) for k, v in (CIRCUIT | changes).items()})


def speeds(low, high, count):
    return torch.linspace(low * RPM, high * RPM, count, dtype=torch.float64)


def largest_torque_by_scan(rpm, c):
    """Along a ray at `angle` in the dq plane both limits are a quadratic in the current; the best ray by search."""
    w = c["pole_pairs"] * rpm * RPM
    resistance, l_d, l_q, flux = (c[k] for k in ("phase_resistance", "inductance_d", "inductance_q", "flux_linkage"))

    def torque(angle):
        d, q = -np.sin(angle), np.cos(angle)
        v_d, v_q = resistance * d - w * l_q * q, resistance * q + w * l_d * d
        a, b, rest = v_d**2 + v_q**2, v_q * w * flux, (w * flux) ** 2 - c["voltage_limit"] ** 2
        root = b**2 - a * rest
        if root < 0.0 or (current := min((-b + np.sqrt(root)) / a, c["current_limit"])) < 0.0:
            return 0.0
        return 1.5 * c["pole_pairs"] * (flux + (l_d - l_q) * current * d) * current * q

    angles = np.linspace(0.0, 0.5 * np.pi, 2001)
    best = angles[np.argmax([torque(a) for a in angles])]
    return -minimize_scalar(lambda a: -torque(a), bounds=(best - 1e-3, best + 1e-3), options={"xatol": 1e-10}).fun


def test_currents_equal_the_reference(reference):
    # The reference holds sixteen digits; flux weakening here is smooth within the voltage tolerance.
    case = reference("motor_dq")
    conditions = [MotorCondition(**{k: r[k] for k in MotorCondition.model_fields}) for r in case["results"]]
    results = analyze_motor(MotorInputs.model_validate(case["inputs"]), conditions, None)
    for ours, theirs in zip(results, case["results"], strict=True):
        assert ours["mode"] == theirs["mode"]
        tolerance = 1e-11 if theirs["mode"] == "mtpa" else 2e-6
        for key in ("i_d_A", "i_q_A", "voltage_V", "copper_loss_W"):
            assert ours[key] == pytest.approx(theirs[key], rel=tolerance)
        assert ours["maximum_torque_N_m"] > theirs["torque_em_N_m"]


@pytest.mark.parametrize("torque", [-300.0, 20.0, 150.0, 450.0])
def test_no_other_current_makes_the_torque_with_fewer_amperes(torque):
    c = a_motor()
    least_d, least_q = maximum_torque_per_ampere(c, number(torque))
    assert float(electromagnetic_torque(c, least_d, least_q)) == pytest.approx(torque, rel=1e-12)
    current_d = torch.linspace(-600.0, 300.0, 90001, dtype=torch.float64)
    current_q = torque / (9.0 * (0.08 - 1.2e-4 * current_d))
    squared = current_d**2 + current_q**2
    least = float(least_d**2 + least_q**2)
    # Grid of 0.01 A: the minimum of the scan lies above the true one by less than (0.005 A)^2 x curvature of order 1.
    assert least <= float(squared.min())
    assert least == pytest.approx(float(squared.min()), abs=1e-4)


def test_without_saliency_all_current_makes_torque():
    current_d, current_q = maximum_torque_per_ampere(a_motor(inductance_q=2.0e-4), number(90.0))
    assert float(current_d) == 0.0
    assert float(current_q) == pytest.approx(90.0 / (9.0 * 0.08), rel=1e-14)


@pytest.mark.parametrize("torque", [-200.0, 0.0, 60.0, 250.0])
@pytest.mark.parametrize("rpm", [500.0, 3000.0, 5000.0, 7500.0])
def test_terminal_power_is_mechanical_power_plus_every_loss(torque, rpm):
    """3/2 (v_d i_d + v_q i_q) from the phase voltages must equal torque x speed + friction + copper loss."""
    c, speed = a_motor(), number(rpm * RPM)
    o = operate_motor(c, number(torque), speed)
    w = 6.0 * speed
    v_d = 0.012 * o.current_d - w * 3.2e-4 * o.current_q
    v_q = 0.012 * o.current_q + w * (2.0e-4 * o.current_d + 0.08)
    terminal = 1.5 * (v_d * o.current_d + v_q * o.current_q)
    scale = 1.0 + abs(torque) * float(speed)
    assert float(terminal - o.copper_loss - o.mechanical_loss - o.output_power) == pytest.approx(0.0, abs=1e-10 * scale)
    assert float(o.output_power) == pytest.approx(torque * rpm * RPM, rel=1e-14)
    no_current_loss = o.iron_loss + o.stray_loss
    assert float(o.input_power - terminal - no_current_loss) == pytest.approx(0.0, abs=1e-10 * scale)
    losses = (o.copper_loss, o.iron_loss, o.mechanical_loss, o.stray_loss)
    assert all(float(loss) >= 0.0 for loss in losses)
    assert float(o.voltage) == pytest.approx(float(torch.hypot(v_d, v_q)), rel=1e-12)


def test_efficiency_is_below_one_and_peaks_at_part_load():
    torque = torch.linspace(5.0, 300.0, 60, dtype=torch.float64)
    efficiency = operate_motor(a_motor(), torque, number(4000 * RPM)).efficiency
    assert 0.9 < float(efficiency.max()) < 1.0
    assert 0 < int(efficiency.argmax()) < 59


def test_losses_follow_their_laws():
    """Copper ~ I^2; bearings ~ speed; windage ~ speed^3; no-load iron loss: hysteresis ~ speed, eddy currents ~ speed^2."""
    slow, fast = (operate_motor(a_motor(**SMOOTH_RUNNING), number(0.0), number(s)) for s in (100.0, 200.0))
    assert float(slow.iron_loss) == pytest.approx(0.33 * 100 + 2.2e-3 * 100**2, rel=1e-12)
    assert float(fast.iron_loss) == pytest.approx(0.33 * 200 + 2.2e-3 * 200**2, rel=1e-12)
    assert float(slow.copper_loss) == 0.0
    rubbing = operate_motor(a_motor(), number(0.0), number(200.0))
    assert float(rubbing.mechanical_loss) == pytest.approx(0.2 * 200 + 2.3e-7 * 200**3, rel=1e-12)
    loaded = operate_motor(a_motor(), number(100.0), number(100.0))
    assert float(loaded.copper_loss) == pytest.approx(1.5 * 0.012 * float(loaded.current) ** 2, rel=1e-14)


@pytest.mark.parametrize("rpm", [0.0, 1000.0, 8000.0])
def test_friction_draws_the_current_of_its_torque(rpm):
    """A motor with friction draws what one without draws at the sum of the torques; idling, too."""
    speed = number(rpm * RPM)
    friction = 0.2 + 2.3e-7 * float(speed) ** 2
    for torque in (0.0, 3.0, 90.0):
        ours = operate_motor(a_motor(), number(torque), speed)
        smooth = operate_motor(a_motor(**SMOOTH_RUNNING), number(torque + friction), speed)
        assert float(ours.current) == pytest.approx(float(smooth.current), rel=1e-14)
        assert float(ours.air_gap_torque) == pytest.approx(torque + friction, rel=1e-14)


def test_small_motor_draws_its_no_load_current_beside_the_loads():
    """Without saliency and iron loss: I = (Q + Q0)/K, input = 3/2 R I^2 + (Q + Q0) w, a hobby motor's three constants."""
    flux, pairs, resistance, friction, speed = 1.1e-3, 7.0, 0.06, 0.012, 600.0
    still = {"hysteresis": 0.0, "eddy": 0.0, "windage": 0.0, "stray_share": 0.0, "bearing_torque": friction}
    c = a_motor(**still, pole_pairs=pairs, flux_linkage=flux, phase_resistance=resistance, inductance_d=2e-5,
                inductance_q=2e-5, voltage_limit=12.8, current_limit=40.0)  # fmt: skip
    torque_constant = 1.5 * pairs * flux
    for torque in (0.0, 0.05, 0.2):
        current = (torque + friction) / torque_constant
        o = operate_motor(c, number(torque), number(speed))
        assert float(o.current) == pytest.approx(current, rel=1e-9)
        assert float(o.input_power) == pytest.approx(
            1.5 * resistance * current**2 + (torque + friction) * speed, rel=1e-9
        )


def test_iron_and_stray_losses_draw_their_current_at_the_terminals():
    """Phasors: the losses' current lies along the voltage, and voltage times the sum is shaft power and every loss."""
    speed = torch.tensor([5.0, 150.0, 300.0, 900.0], dtype=torch.float64)
    torque = torch.tensor([[120.0], [1.0], [-60.0]], dtype=torch.float64)
    c = a_motor()
    o = operate_motor(c, torque, speed)
    w, current = c.pole_pairs * speed, torch.complex(o.current_d, o.current_q)
    v_d = c.phase_resistance * o.current_d - w * c.inductance_q * o.current_q
    v_q = c.phase_resistance * o.current_q + w * (c.inductance_d * o.current_d + c.flux_linkage)
    voltage = torch.complex(v_d, v_q)
    supply = current + (o.iron_loss + o.stray_loss) / 1.5 * voltage / voltage.abs() ** 2
    drawn = 1.5 * (voltage.conj() * supply).real
    torch.testing.assert_close(
        drawn, o.output_power + o.copper_loss + o.iron_loss + o.mechanical_loss + o.stray_loss, rtol=1e-10, atol=1e-7
    )
    torch.testing.assert_close(o.terminal_current, supply.abs(), rtol=1e-9, atol=1e-9)
    assert bool((o.terminal_current[:2] > o.current[:2]).all())


def test_flux_weakening_lowers_iron_loss_at_equal_speed():
    c, speed = a_motor(), number(11000 * RPM)
    weak = operate_motor(c, number(30.0), speed)
    free = operate_motor(replace(c, voltage_limit=number(2000.0)), number(30.0), speed)
    assert float(weak.iron_loss) < float(free.iron_loss)
    assert float(weak.copper_loss) > float(free.copper_loss)


@pytest.mark.parametrize("current_limit", [380.0, 1000.0])
def test_voltage_and_current_stay_within_their_limits_up_to_the_largest_torque(current_limit):
    # 1000 A exceeds flux_linkage/inductance_d = 400 A: at high speed less than the limit gives the most torque.
    c, speed = a_motor(current_limit=current_limit), speeds(200.0, 14000.0, 400)
    for share in (0.05, 0.5, 0.9, 0.99):
        o = operate_motor(c, share * maximum_torque(c, speed), speed)
        assert float(o.voltage.max()) <= (1.0 + VOLTAGE_TOLERANCE) * CIRCUIT["voltage_limit"]
        assert float(o.current.max()) <= current_limit


@pytest.mark.parametrize("current_limit", [380.0, 1000.0])
@pytest.mark.parametrize("rpm", [500.0, 3000.0, 6500.0, 9000.0, 14000.0])
def test_largest_torque_equals_a_scan_of_the_dq_plane(rpm, current_limit):
    ours = float(maximum_torque(a_motor(current_limit=current_limit), number(rpm * RPM)))
    # 1e-3: the hand-over to flux weakening is 0.5 % of V^2 wide, and torque stands to V as some power near one.
    assert ours == pytest.approx(largest_torque_by_scan(rpm, CIRCUIT | {"current_limit": current_limit}), rel=1e-3)


def test_largest_torque_is_flat_below_base_speed_and_falls_beyond():
    torque = maximum_torque(a_motor(), speeds(100.0, 12000.0, 500))
    assert float(torque[0] - torque[150]) == pytest.approx(0.0, abs=1e-9)
    assert float(torque.diff().max()) <= 1e-9
    assert float(torque[-1]) < 0.7 * float(torque[0])


@pytest.mark.parametrize(("torque", "rpm"), [(250.0, 7500.0), (-150.0, 9000.0), (20.0, 11000.0)])
def test_flux_weakening_takes_the_least_current_on_the_voltage_limit(torque, rpm):
    c, speed = a_motor(**SMOOTH_RUNNING, current_limit=1000.0), number(rpm * RPM)

    def excess(current_d):
        current_d = number(current_d)
        current_q = torque / (9.0 * (0.08 - 1.2e-4 * current_d))
        return float(voltage_squared(c, current_d, current_q, speed) / c.voltage_limit**2) - 1.0

    ours = operate_motor(c, number(torque), speed)
    least_d = float(maximum_torque_per_ampere(c, number(torque))[0])
    assert excess(least_d) > 0.1
    # From the point of least amperes towards -flux_linkage/inductance_d the first crossing is the nearest one.
    assert float(ours.current_d) == pytest.approx(brentq(excess, -400.0, least_d, xtol=1e-12), rel=1e-5)


@pytest.mark.parametrize(("torque", "low"), [(60.0, 7500.0), (250.0, 5000.0)])
def test_hand_over_to_flux_weakening_is_smooth(torque, low):
    """i_d follows the least-ampere point, then the voltage limit; value and slope change without a jump."""
    c, speed = a_motor(**SMOOTH_RUNNING, current_limit=1000.0), speeds(low, low + 3000.0, 6001)
    s = speed.clone().requires_grad_()
    o = operate_motor(c, number(torque), s)
    (slope,) = torch.autograd.grad(o.current_d.sum(), s)
    current_d, least_d = o.current_d.detach(), float(maximum_torque_per_ampere(c, number(torque))[0])
    assert float(current_d[0]) == pytest.approx(least_d, abs=1e-6)
    assert float(current_d[-1]) < least_d - 10.0
    assert float(current_d.diff().max()) <= 1e-9
    # 0.05 rad/s apart: over the hand-over's 0.25 % of the speed the slope rises in some forty steps, not in one.
    assert float(slope.diff().abs().max()) < 0.1 * float(slope.abs().max())
    # Well below the limit, by ten hand-over widths, nothing is weakened yet: softplus(-10) = 5e-5 widths.
    is_below = (o.voltage < c.voltage_limit * (1.0 - 5.0 * HANDOVER_WIDTH)).detach()
    assert float((current_d - least_d)[is_below].abs().max()) < 1e-3 * float(least_d - current_d[-1])


def test_torque_beyond_the_limits_stays_defined_and_its_currents_grow_on():
    c = a_motor(**SMOOTH_RUNNING)
    largest = float(maximum_torque(c, number(7500 * RPM)))
    torque = (largest * torch.tensor([1.2, 2.0, 5.0, 50.0], dtype=torch.float64)).requires_grad_()
    o = operate_motor(c, torque, number(7500 * RPM))
    assert bool((o.current > c.current_limit).all())
    assert bool((o.current.diff() > 0.0).all())
    assert bool((o.input_power > o.output_power).all())
    torch.testing.assert_close(electromagnetic_torque(c, o.current_d, o.current_q), torque, rtol=1e-10, atol=0.0)
    assert bool(torch.autograd.grad(o.input_power.sum(), torque)[0].isfinite().all())


def test_without_resistance_braking_mirrors_driving():
    c = a_motor(**SMOOTH_RUNNING, phase_resistance=0.0)
    drive, brake = (operate_motor(c, number(t), speeds(1000, 9000, 9)) for t in (120.0, -120.0))
    torch.testing.assert_close(brake.current_d, drive.current_d, rtol=1e-9, atol=1e-9)
    torch.testing.assert_close(brake.current_q, -drive.current_q, rtol=1e-9, atol=0.0)
    torch.testing.assert_close(brake.voltage, drive.voltage, rtol=1e-9, atol=0.0)


def test_more_turns_trade_volts_for_amperes_at_the_same_losses():
    """Turns x k: flux and voltage x k, current / k, resistance and inductances x k^2."""
    k = 3.0
    c = a_motor()
    wound = replace(
        c,
        phase_resistance=k**2 * c.phase_resistance,
        inductance_d=k**2 * c.inductance_d,
        inductance_q=k**2 * c.inductance_q,
        flux_linkage=k * c.flux_linkage,
        voltage_limit=k * c.voltage_limit,
        current_limit=c.current_limit / k,
    )
    speed = speeds(1000, 9000, 9)
    one, other = (operate_motor(m, number(150.0), speed) for m in (c, wound))
    torch.testing.assert_close(other.current, one.current / k, rtol=1e-9, atol=0.0)
    torch.testing.assert_close(other.voltage, one.voltage * k, rtol=1e-9, atol=0.0)
    torch.testing.assert_close(other.input_power, one.input_power, rtol=1e-10, atol=0.0)
    torch.testing.assert_close(maximum_torque(wound, speed), maximum_torque(c, speed), rtol=1e-9, atol=0.0)


@pytest.mark.parametrize(("torque", "rpm"), [(150.0, 2000.0), (250.0, 6150.0), (200.0, 8000.0), (-90.0, 8000.0)])
def test_gradients_equal_central_differences(torque, rpm):
    """At least amperes, in the hand-over, in flux weakening and braking; with respect to all the circuit."""
    names = [field.name for field in fields(MotorCircuit)]

    def results(x):
        c = MotorCircuit(**{name: CIRCUIT[name] * x[i] for i, name in enumerate(names)})
        o = operate_motor(c, torque * x[-2], rpm * RPM * x[-1])
        return torch.stack(
            [o.input_power / 1e5, o.current_d / 100, o.voltage / 400, maximum_torque(c, rpm * RPM * x[-1]) / 300]
        )

    x = torch.ones(len(names) + 2, dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(results, x)
    torch.testing.assert_close(exact, central_difference(results, x, 2e-5), rtol=1e-5, atol=1e-6)


def test_a_batch_equals_a_loop():
    torque, speed = torch.tensor([[50.0], [280.0]], dtype=torch.float64), speeds(1000, 9000, 5)
    batch = operate_motor(a_motor(), torque, speed)
    for i in range(2):
        for j in range(5):
            one = operate_motor(a_motor(), torque[i, 0], speed[j])
            assert float(batch.input_power[i, j]) == pytest.approx(float(one.input_power), rel=1e-12)


def least_current_by_search(c, torque, speed):
    """Least amplitude for `torque` within the voltage limit, by brute force over i_d in three ever finer scans."""
    low, high = -2.0 * c["flux_linkage"] / c["inductance_d"], 0.2 * c["flux_linkage"] / c["inductance_d"]
    w, saliency = c["pole_pairs"] * speed, c["inductance_d"] - c["inductance_q"]
    for _ in range(3):
        d = np.linspace(low, high, 20001)
        q = torque / (1.5 * c["pole_pairs"] * (c["flux_linkage"] + saliency * d))
        v_d = c["phase_resistance"] * d - w * c["inductance_q"] * q
        v_q = c["phase_resistance"] * q + w * (c["inductance_d"] * d + c["flux_linkage"])
        current = np.where(v_d**2 + v_q**2 <= c["voltage_limit"] ** 2, np.hypot(d, q), np.inf)
        best, width = d[np.argmin(current)], d[1] - d[0]
        low, high = best - 2 * width, best + 2 * width
    return current.min()


def test_currents_are_the_least_of_a_brute_force_search_at_random_points():
    """Random circuits, torques of both signs and speeds: below, in and beyond the hand-over, to 1e-4 where it is not at work."""
    generator, worst = np.random.default_rng(5), {"least amperes": 0.0, "flux weakening": 0.0}
    counts = dict.fromkeys(worst, 0)
    for _ in range(150):
        c = (
            CIRCUIT
            | SMOOTH_RUNNING
            | {
                "flux_linkage": generator.uniform(0.06, 0.1),
                "inductance_q": 2e-4 * generator.uniform(1.0, 2.0),
                "phase_resistance": generator.uniform(0.0, 0.02),
                "current_limit": 1000.0,
            }
        )
        speed, circuit = generator.uniform(50.0, 1100.0), a_motor(**c)
        torque = generator.uniform(-0.9, 0.9) * float(maximum_torque(circuit, number(speed)))
        ours, theirs = operate_motor(circuit, number(torque), number(speed)), least_current_by_search(c, torque, speed)
        least = torch.hypot(*maximum_torque_per_ampere(circuit, number(torque)))
        # The hand-over is five widths of 0.5 % of V^2 to either side; there weakening starts early, on purpose.
        free = float(voltage_squared(circuit, *maximum_torque_per_ampere(circuit, number(torque)), number(speed)))
        excess = free / c["voltage_limit"] ** 2 - 1.0
        if abs(excess) > 8.0 * HANDOVER_WIDTH:
            kind = "flux weakening" if excess > 0.0 else "least amperes"
            assert float(ours.current) >= float(least) * (1.0 - 1e-12)
            worst[kind] = max(worst[kind], abs(float(ours.current) / theirs - 1.0))
            counts[kind] += 1
    assert min(counts.values()) > 20
    assert max(worst.values()) < 1e-4, worst


def test_nine_motors_in_every_segment_are_one_batch():
    """Nine circuits, three segments: (9, 3) in one call as in twenty-seven."""
    flux = torch.linspace(0.07, 0.09, 9, dtype=torch.float64)
    c = MotorCircuit(
        **{k: torch.full((9,), v, dtype=torch.float64) for k, v in CIRCUIT.items()} | {"flux_linkage": flux}
    )
    wide = MotorCircuit(*(getattr(c, field.name)[:, None] for field in fields(c)))
    torque, speed = torch.tensor([300.0, 150.0, 60.0], dtype=torch.float64), speeds(3000.0, 9000.0, 3)
    together, largest = operate_motor(wide, torque, speed), maximum_torque(wide, speed)
    assert together.input_power.shape == largest.shape == (9, 3)
    for i in range(9):
        for j in range(3):
            alone = operate_motor(c.at(torch.tensor(i)), torque[j], speed[j])
            assert float(together.input_power[i, j]) == pytest.approx(float(alone.input_power), rel=1e-12)
            assert float(largest[i, j]) == pytest.approx(
                float(maximum_torque(c.at(torch.tensor(i)), speed[j])), rel=1e-12
            )


def test_efficiency_map_ends_at_the_limits():
    torque, speed = torch.linspace(5.0, 500.0, 34, dtype=torch.float64), speeds(200.0, 14000.0, 40)
    result = efficiency_map(a_motor(), torque, speed)
    inside = ~result.efficiency.isnan()
    assert torch.equal(inside, torque[:, None] <= maximum_torque(a_motor(), speed) - friction_torque(a_motor(), speed))
    assert 0.0 < float(inside.double().mean()) < 1.0
    assert 0.9 < float(result.efficiency[inside].max()) < 1.0
    voltage = operate_motor(a_motor(), torque[:, None], speed).voltage
    assert float(voltage[inside].max()) <= CIRCUIT["voltage_limit"] * (1.0 + VOLTAGE_TOLERANCE)
