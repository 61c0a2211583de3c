"""Battery: Thevenin cell against SciPy and closed forms, conservation of energy and charge, monotony and gradients."""

import math
from dataclasses import replace

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.cases import BatteryInputs, analyze_battery
from lpc_mdo.disciplines.battery import TheveninCell, energy_state_of_charge, thevenin_discharge

POWER = torch.tensor([400e3, 150e3, 90e3], dtype=torch.float64)
DURATION = torch.tensor([90.0, 300.0, 1800.0], dtype=torch.float64)
SPECIFIC_ENERGY = 400.0 * 3600.0
TABLE = torch.tensor([0.0, 0.25, 0.5, 0.75, 1.0], dtype=torch.float64)
VOLTAGE = torch.tensor([3.0, 3.5, 3.7, 3.9, 4.2], dtype=torch.float64)
CELL = TheveninCell(0.02, 0.015, 2000.0, 14400.0, TABLE, VOLTAGE)


def tensor(*values):
    return torch.tensor(values, dtype=torch.float64)


def test_energy_drawn_is_the_integral_of_power_and_leaves_the_battery():
    state = energy_state_of_charge(POWER, DURATION, number(800.0), SPECIFIC_ENERGY, efficiency=0.95)
    torch.testing.assert_close(state.energy_drawn * 0.95, POWER * DURATION, rtol=1e-14, atol=0.0)
    left, full = state.state_of_charge * 800.0 * SPECIFIC_ENERGY, tensor(800.0 * SPECIFIC_ENERGY)
    torch.testing.assert_close(left + torch.cumsum(state.energy_drawn, 0), full.expand(3), rtol=1e-14, atol=0.0)


def test_a_kilogram_delivers_its_specific_energy_and_no_more():
    state = energy_state_of_charge(tensor(400.0), tensor(3600.0), number(1.0), SPECIFIC_ENERGY)
    assert float(state.final_state_of_charge) == pytest.approx(0.0, abs=1e-14)


def test_final_charge_depends_neither_on_order_nor_on_how_segments_are_cut():
    def final(power, duration):
        return float(energy_state_of_charge(power, duration, number(800.0), SPECIFIC_ENERGY).final_state_of_charge)

    whole = final(POWER, DURATION)
    assert final(POWER.flip(0), DURATION.flip(0)) == pytest.approx(whole, rel=1e-14)
    cut = final(POWER.repeat_interleave(2), 0.5 * DURATION.repeat_interleave(2))
    assert cut == pytest.approx(whole, rel=1e-14)


def test_charge_falls_along_the_mission_and_rises_with_mass_and_efficiency():
    mass = torch.linspace(300.0, 1500.0, 50, dtype=torch.float64)
    state = energy_state_of_charge(POWER, DURATION, mass, SPECIFIC_ENERGY)
    assert state.state_of_charge.shape == (50, 3)
    assert bool((state.state_of_charge.diff(dim=-1) < 0.0).all())
    assert bool((state.final_state_of_charge.diff() > 0.0).all())
    assert bool((state.final_state_of_charge.diff().diff() < 0.0).all())  # as 1 - E/(m e)
    lossy = energy_state_of_charge(POWER, DURATION, mass, SPECIFIC_ENERGY, efficiency=0.9)
    assert bool((lossy.final_state_of_charge < state.final_state_of_charge).all())


def test_gradient_of_the_energy_model_is_exact():
    """d SoC/d m = (SoC_0 - SoC)/m; the rest by differences."""
    mass = number(800.0).requires_grad_()
    final = energy_state_of_charge(POWER, DURATION, mass, SPECIFIC_ENERGY, initial=0.9).final_state_of_charge
    (gradient,) = torch.autograd.grad(final, mass)
    assert float(gradient) == pytest.approx((0.9 - float(final.detach())) / 800.0, rel=1e-13)

    def charge(x):
        return energy_state_of_charge(POWER * x[:3], DURATION * x[3:6], 800.0 * x[6], SPECIFIC_ENERGY).state_of_charge

    x = torch.ones(7, dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(charge, x)
    torch.testing.assert_close(exact, central_difference(charge, x, 1e-3), rtol=1e-9, atol=1e-11)


def test_thevenin_cell_equals_scipys_integration(reference):
    # solve_ivp at rtol 1e-11; steps of 2 s against the pair's 30 s, and kinks of the voltage table, leave 1e-8.
    case = reference("battery_thevenin")
    ours = analyze_battery(BatteryInputs.model_validate(case["inputs"]), [], None)
    for a, b in zip(ours, case["results"], strict=True):
        assert a.keys() == b.keys()
        for key, value in b.items():
            assert a[key] == pytest.approx(value, rel=0.0, abs=1e-8), key


def test_cell_without_losses_conserves_energy():
    """Without resistance the terminals deliver Q times the area under the open-circuit voltage."""
    ideal = replace(CELL, series_resistance=1e-12, pair_resistance=1.0, pair_capacitance=1e15)
    final = thevenin_discharge(ideal, tensor(10.0, 6.0), tensor(900.0, 2000.0)).state_of_charge[-1]
    x = torch.linspace(float(final), 1.0, 100001, dtype=torch.float64)
    index = torch.searchsorted(TABLE, x).clamp(1, 4)
    y = VOLTAGE[index - 1] + (VOLTAGE[index] - VOLTAGE[index - 1]) * (x - TABLE[index - 1]) / 0.25
    energy = 14400.0 * float(torch.trapezoid(y, x))
    # Steps of 2 s cross the table's kinks.
    assert energy == pytest.approx(10.0 * 900 + 6.0 * 2000, rel=1e-7)


def test_heat_of_the_resistances_is_what_the_terminals_do_not_get():
    """Energy out of the source = P t + R0 I^2 + v1^2/R1 integrated + what the capacitor still holds; flat voltage."""
    flat = replace(CELL, open_circuit_voltage_table=torch.full_like(VOLTAGE, 3.7))
    steps, total = 800, 200.0
    state = thevenin_discharge(flat, number(20.0).expand(steps), number(total / steps).expand(steps))
    start = thevenin_discharge(flat, tensor(20.0), tensor(1e-9))
    current = torch.cat([start.current, state.current])
    pair = torch.cat([start.pair_voltage, state.pair_voltage])
    heat = torch.trapezoid(0.02 * current**2 + pair**2 / 0.015, dx=total / steps)
    source = 3.7 * 14400.0 * (1.0 - state.state_of_charge[-1])
    stored = 0.5 * 2000.0 * pair[-1] ** 2
    assert float(source) == pytest.approx(20.0 * total + float(heat + stored), rel=1e-6)


def test_series_resistance_alone_has_a_closed_form():
    """I = (E - sqrt(E^2 - 4 R P))/(2 R), constant while E is."""
    flat = replace(
        CELL, open_circuit_voltage_table=torch.full_like(VOLTAGE, 3.7), pair_resistance=1.0, pair_capacitance=1e18
    )
    state = thevenin_discharge(flat, tensor(25.0), tensor(600.0))
    current = (3.7 - math.sqrt(3.7**2 - 4 * 0.02 * 25.0)) / 0.04
    assert float(state.current[0]) == pytest.approx(current, rel=1e-12)
    assert float(state.state_of_charge[0]) == pytest.approx(1.0 - current * 600.0 / 14400.0, rel=1e-12)
    assert float(state.terminal_voltage[0] * state.current[0]) == pytest.approx(25.0, rel=1e-12)


def test_a_resting_cell_keeps_its_charge_and_relaxes_exponentially():
    state = thevenin_discharge(CELL, tensor(30.0, 0.0, 0.0), tensor(60.0, 15.0, 15.0))
    assert float(state.state_of_charge[2]) == float(state.state_of_charge[0])
    assert float(state.current[1]) == 0.0
    decay = state.pair_voltage[1:] / state.pair_voltage[:-1]
    # R1 C1 = 30 s; Runge-Kutta's error (2/30)^5/120 a step.
    torch.testing.assert_close(decay, number(math.exp(-0.5)).expand(2), rtol=1e-6, atol=0.0)


def test_power_beyond_the_matched_load_is_refused_and_just_below_it_halves_the_voltage():
    largest = 4.2**2 / (4 * 0.02)
    state = thevenin_discharge(CELL, tensor(largest * (1 - 1e-6)), tensor(1e-6))
    assert float(state.terminal_voltage[0]) == pytest.approx(2.1, rel=2e-3)
    with pytest.raises(ValueError, match="the cell cannot deliver it"):
        thevenin_discharge(CELL, tensor(largest * (1 + 1e-6)), tensor(1.0))


def test_gradient_of_the_cell_equals_central_differences():
    def outputs(x):
        state = thevenin_discharge(CELL, x[:2], x[2:4], initial=x[4])
        return torch.cat([state.state_of_charge, state.pair_voltage, state.terminal_voltage])

    x = tensor(20.0, 8.0, 91.0, 151.0, 0.95)
    exact = torch.autograd.functional.jacobian(outputs, x)
    torch.testing.assert_close(exact, central_difference(outputs, x, 1e-3), rtol=1e-7, atol=1e-9)


def test_a_batch_of_cells_equals_a_loop():
    power = torch.tensor([[20.0, 5.0], [10.0, 12.0], [0.0, 3.0]], dtype=torch.float64)
    duration = tensor(100.0, 250.0).expand(3, 2)
    batch = thevenin_discharge(CELL, power, duration)
    for i in range(3):
        one = thevenin_discharge(CELL, power[i], duration[i])
        torch.testing.assert_close(batch.state_of_charge[i], one.state_of_charge, rtol=1e-13, atol=0.0)
