"""Thevenin cells against SciPy's integration and closed forms, conservation of energy, limits, gradients, batches."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from conftest import central_difference, number
from scipy.integrate import solve_ivp

from lpc_mdo.cases.electric import BatteryInputs, analyze_battery
from lpc_mdo.config import load
from lpc_mdo.disciplines.equivalent_circuit import (
    LG_M50,
    SUSTAINED_SHARE,
    TheveninCell,
    cell_energy,
    lg_m50_voltage,
    pack_discharge,
    tabulated_voltage,
    thevenin_discharge,
)
from lpc_mdo.problems.gross_weight import gross_weight_problem

TABLE = torch.tensor([0.0, 0.25, 0.5, 0.75, 1.0], dtype=torch.float64)
VOLTAGE = torch.tensor([3.0, 3.5, 3.7, 3.9, 4.2], dtype=torch.float64)
CELL = TheveninCell(0.02, 0.015, 2000.0, 14400.0, tabulated_voltage(TABLE, VOLTAGE))
FLAT = replace(CELL, open_circuit_voltage=lambda charge: torch.full_like(charge, 3.7))
EVEN = [(k + 1) / 20 for k in range(20)]


def tensor(*values):
    return torch.tensor(values, dtype=torch.float64)


def by_scipy(cell, power, duration, charge=1.0):
    """(segment, 2) state of charge and pair voltage from an adaptive Runge-Kutta method of order 8."""

    def slope(_, y, demand):
        source = float(cell.open_circuit_voltage(tensor(y[0]))[0]) - y[1]
        current = (source - math.sqrt(source**2 - 4.0 * cell.series_resistance * demand)) / (
            2.0 * cell.series_resistance
        )
        return [-current / cell.capacity, (current - y[1] / cell.pair_resistance) / cell.pair_capacitance]

    state, rows = [charge, 0.0], []
    for demand, time in zip(power, duration, strict=True):
        run = solve_ivp(slope, (0.0, time), state, method="DOP853", rtol=1e-11, atol=1e-13, args=(demand,))
        state = run.y[:, -1]
        rows.append(state)
    return np.array(rows)


def test_mission_of_an_lg_m50_equals_scipys_integration():
    # Two flights and a reserve: hover at 2 C, climb, cruise. The required agreement is 1e-6; the rule leaves 1e-8.
    power, duration = [35.0, 12.0, 9.0, 35.0, 12.0, 9.0, 9.0], [90.0, 200.0, 800.0, 90.0, 200.0, 800.0, 960.0]
    ours = thevenin_discharge(LG_M50, tensor(*power), tensor(*duration))
    theirs = by_scipy(LG_M50, power, duration)
    np.testing.assert_allclose(ours.state_of_charge.numpy(), theirs[:, 0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(ours.pair_voltage.numpy(), theirs[:, 1], rtol=0.0, atol=2e-8)


def test_case_of_the_reference_equals_scipys_integration(reference):
    # solve_ivp at rtol 1e-11; kinks of the voltage table leave 5e-9.
    case = reference("battery_thevenin")
    ours = analyze_battery(BatteryInputs.model_validate(case["inputs"]), [], None)
    for a, b in zip(ours, case["results"], strict=True):
        assert a.keys() == b.keys()
        for key, value in b.items():
            assert a[key] == pytest.approx(value, rel=0.0, abs=1e-8), key


def test_cell_without_losses_conserves_energy():
    """Without resistance the terminals deliver Q times the area under the open-circuit voltage."""
    ideal = replace(CELL, series_resistance=1e-12, pair_resistance=1e-12, pair_capacitance=1e15)
    final = thevenin_discharge(ideal, tensor(10.0, 6.0), tensor(900.0, 2000.0), panels=EVEN).state_of_charge[-1]
    x = torch.linspace(float(final), 1.0, 100001, dtype=torch.float64)
    energy = 14400.0 * float(torch.trapezoid(CELL.open_circuit_voltage(x), x))
    # Panels span the table's kinks.
    assert energy == pytest.approx(10.0 * 900 + 6.0 * 2000, rel=1e-7)


def test_heat_of_the_resistances_is_what_the_terminals_do_not_get():
    """Energy out of the source = P t + R0 I^2 + v^2/R1 integrated + what the capacitor still holds; flat voltage."""
    steps, total = 40, 200.0
    state = thevenin_discharge(FLAT, number(20.0).expand(steps), number(total / steps).expand(steps))
    # Heat by Simpson's rule over halves of 5 s.
    current = torch.cat([(3.7 - torch.sqrt(tensor(3.7**2 - 4 * 0.02 * 20.0))) / 0.04, state.current])
    pair = torch.cat([tensor(0.0), state.pair_voltage])
    power = 0.02 * current**2 + pair**2 / 0.015
    heat = (power[0] + power[-1] + 4.0 * power[1:-1:2].sum() + 2.0 * power[2:-1:2].sum()) * total / steps / 3.0
    source = 3.7 * 14400.0 * (1.0 - state.state_of_charge[-1])
    stored = 0.5 * 2000.0 * pair[-1] ** 2
    assert float(source) == pytest.approx(20.0 * total + float(heat + stored), rel=1e-7)


def test_series_resistance_alone_has_a_closed_form():
    """I = (E - sqrt(E^2 - 4 R P))/(2 R), constant while E is."""
    state = thevenin_discharge(replace(FLAT, pair_resistance=1e-12, pair_capacitance=1e18), tensor(25.0), tensor(600.0))
    current = (3.7 - math.sqrt(3.7**2 - 4 * 0.02 * 25.0)) / 0.04
    assert float(state.current[0]) == pytest.approx(current, rel=1e-11)
    assert float(state.state_of_charge[0]) == pytest.approx(1.0 - current * 600.0 / 14400.0, rel=1e-12)
    assert float(state.terminal_voltage[0] * state.current[0]) == pytest.approx(25.0, rel=1e-12)
    assert float(state.highest_rate[0]) == pytest.approx(current * 3600.0 / 14400.0, rel=1e-11)


def test_a_resting_cell_keeps_its_charge_and_relaxes_exponentially():
    state = thevenin_discharge(CELL, tensor(30.0, 0.0, 0.0), tensor(60.0, 15.0, 15.0))
    assert float(state.state_of_charge[2]) == pytest.approx(float(state.state_of_charge[0]), abs=1e-15)
    assert float(state.current[1]) == 0.0
    decay = state.pair_voltage[1:] / state.pair_voltage[:-1]
    torch.testing.assert_close(decay, number(math.exp(-0.5)).expand(2), rtol=1e-12, atol=0.0)


def test_voltage_sags_under_load_and_recovers():
    state = thevenin_discharge(LG_M50, tensor(8.0, 40.0, 8.0), tensor(100.0, 60.0, 100.0))
    before, loaded, after = state.terminal_voltage.tolist()
    assert loaded < after < before
    assert float(state.lowest_voltage[1]) == pytest.approx(loaded, abs=1e-12)
    # At once by R0 times the current's step, the rest in the pair and by charge.
    step = float(state.current[1] - state.current[0])
    assert before - loaded > LG_M50.series_resistance * step
    assert before - loaded < 1.2 * (LG_M50.series_resistance + LG_M50.pair_resistance) * step


def test_power_that_cannot_be_sustained_stays_finite_shows_in_the_margin_and_is_refused_in_a_case(reference):
    sustained = 3.7**2 / (4 * 0.035)
    power = sustained * tensor(0.5, 0.8, 0.89, 0.95, 1.5, 20.0)[:, None].requires_grad_()
    state = thevenin_discharge(FLAT, power, tensor(600.0))
    torch.testing.assert_close(state.power_margin, 1.0 - power / sustained, rtol=1e-12, atol=1e-14)
    delivered = state.current * state.terminal_voltage
    below = (state.power_margin > 1.0 - SUSTAINED_SHARE).detach()
    torch.testing.assert_close(delivered[below], power[below], rtol=1e-11, atol=0.0)
    assert bool((delivered[~below] < power[~below]).all())
    assert bool((state.current.diff(dim=0) > 0.0).all())
    assert bool(torch.autograd.grad(state.state_of_charge.sum(), power)[0].isfinite().all())
    case = reference("battery_thevenin")["inputs"] | {"segments": [{"duration_s": 60, "power_W": 500.0}]}
    with pytest.raises(ValueError, match="power_W = 500 is not allowed; the cell sustains"):
        analyze_battery(BatteryInputs.model_validate(case), [], None)


def test_open_circuit_voltage_spans_the_data_sheets_range_and_rises_with_charge():
    charge = torch.linspace(0.0, 1.0, 501, dtype=torch.float64)
    voltage = lg_m50_voltage(charge)
    assert bool((voltage.diff() > 0.0).all())
    # Data sheet: 4.2 V charged, 2.5 V empty; 18.2 W h nominal at low rate, less than the ideal cell's.
    assert float(voltage[-1]) == pytest.approx(4.2, abs=0.01)
    assert 18.2 < cell_energy(LG_M50) / 3600.0 < 19.0
    assert bool(lg_m50_voltage(tensor(-5.0, -0.1)).isfinite().all())


def test_a_pack_behaves_as_its_cells_and_twice_the_pack_halves_every_current():
    power, duration = tensor(800e3, 200e3), tensor(90.0, 900.0)
    one, two = (pack_discharge(LG_M50, power, duration, number(m), 400 * 3600.0) for m in (800.0, 1600.0))
    half = pack_discharge(LG_M50, 0.5 * power, duration, number(800.0), 400 * 3600.0)
    torch.testing.assert_close(two.current, half.current, rtol=1e-12, atol=0.0)
    assert bool((two.final_state_of_charge > one.final_state_of_charge).all())
    # All the energy of the pack is 320 kW h; 70 kW h and the heat are gone.
    drawn = (1.0 - one.final_state_of_charge) * LG_M50.capacity * 800.0 * 400.0 * 3600.0 / cell_energy(LG_M50)
    assert float(drawn) * 4.2 > 70 * 3.6e6


def test_gradient_of_the_cell_equals_central_differences():
    def outputs(x):
        state = thevenin_discharge(LG_M50, x[:2], x[2:4], initial=x[4])
        return torch.cat([state.state_of_charge, state.pair_voltage, state.terminal_voltage, state.highest_rate])

    x = tensor(20.0, 8.0, 91.0, 151.0, 0.95)
    exact = torch.autograd.functional.jacobian(outputs, x)
    torch.testing.assert_close(exact, central_difference(outputs, x, 2e-4), rtol=1e-7, atol=1e-9)


def test_a_batch_of_cells_equals_a_loop_and_faults_stay_alone():
    power = torch.tensor([[20.0, 5.0], [math.nan, 12.0], [0.0, 3.0]], dtype=torch.float64)
    duration = tensor(100.0, 250.0)
    batch = thevenin_discharge(LG_M50, power, duration)
    for i in (0, 2):
        one = thevenin_discharge(LG_M50, power[i], duration)
        torch.testing.assert_close(batch.state_of_charge[i], one.state_of_charge, rtol=1e-13, atol=0.0)
    assert bool(batch.state_of_charge[1].isnan().all())
    single = thevenin_discharge(LG_M50, power[0].float(), duration.float())
    assert single.state_of_charge.dtype == torch.float32
    torch.testing.assert_close(single.state_of_charge.double(), batch.state_of_charge[0], rtol=1e-5, atol=0.0)
    assert thevenin_discharge(LG_M50, torch.zeros(0, 2, dtype=torch.float64), duration).current.shape == (0, 2)


@pytest.mark.parametrize("panels", [[], [0.5], [0.5, 0.4, 1.0], [0.0, 1.0]])
def test_panels_that_do_not_fill_a_segment_are_refused(panels):
    with pytest.raises(ValueError, match="they must increase from above 0 to 1"):
        thevenin_discharge(LG_M50, tensor(1.0), tensor(1.0), panels=panels)


def test_main_problem_takes_the_circuit_for_the_energy_model_and_limits_it():
    energy, circuit = (
        gross_weight_problem(*load(overrides=[f"vehicle.battery.model={m}"])) for m in ("energy", "equivalent_circuit")
    )
    names = {row.name for row in circuit.constraints} - {row.name for row in energy.constraints}
    assert names == {"cell_voltage", "discharge_rate", "battery_power_margin"}
    x = energy.x0.clone().requires_grad_()
    f, c = circuit.evaluate(x)
    assert float(f.detach()) == float(energy.evaluate(energy.x0)[0])
    (gradient,) = torch.autograd.grad(c.sum(), x)
    assert bool(gradient.isfinite().all())
    direction = torch.cos(torch.arange(x.numel(), dtype=torch.float64))

    def along(t):
        return circuit.evaluate(circuit.x0 + t * direction)[1].sum()

    slope = central_difference(along, tensor(0.0), 1e-4)
    assert float(gradient @ direction) == pytest.approx(float(slope[0]), rel=1e-5)


def test_a_discharge_goes_on_from_charge_and_pair_voltage():
    whole = thevenin_discharge(LG_M50, tensor(20.0, 5.0), tensor(300.0, 200.0))
    first = thevenin_discharge(LG_M50, tensor(20.0), tensor(300.0))
    rest = thevenin_discharge(
        LG_M50, tensor(5.0), tensor(200.0), first.state_of_charge[-1], initial_pair_voltage=first.pair_voltage[-1]
    )
    assert float(rest.state_of_charge[-1]) == pytest.approx(float(whole.state_of_charge[-1]), abs=1e-9)
    assert float(rest.pair_voltage[-1]) == pytest.approx(float(whole.pair_voltage[-1]), abs=1e-9)


def test_a_table_that_falls_is_refused():
    with pytest.raises(ValueError, match="must not fall"):
        tabulated_voltage(TABLE, VOLTAGE.flip(0))


def test_a_table_below_its_first_point_stays_positive_and_smooth():
    charge = torch.linspace(-3.0, 0.0, 301, dtype=torch.float64).requires_grad_()
    voltage = tabulated_voltage(TABLE, VOLTAGE)(charge)
    (slope,) = torch.autograd.grad(voltage.sum(), charge)
    assert float(voltage.detach().min()) > 0.0
    assert float(slope[-2]) == pytest.approx(2.0, rel=0.02)
