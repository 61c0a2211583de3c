"""Temperature of a battery: energy balance, limits, an integration step by step, circuit losses, published C-rates."""

import pytest
import torch
from conftest import central_difference

from lpc_mdo.disciplines.battery_heat import (
    SPECIFIC_HEAT,
    circuit_heat,
    discharge_loss,
    discharge_rate,
    pack_temperature,
)
from lpc_mdo.disciplines.equivalent_circuit import LG_M50, cell_energy, pack_discharge
from lpc_mdo.numerics.constants import HORSEPOWER
from lpc_mdo.numerics.tensors import tensor

HEAT, DURATION = tensor([40e3, 8e3, 4e3]), tensor([90.0, 300.0, 1800.0])
MASS, START, AIR = tensor(800.0), tensor(298.15), tensor([298.15, 290.0, 285.0])


def test_insulated_packs_keep_all_heat():
    found = pack_temperature(HEAT, DURATION, MASS, START, AIR, tensor(0.0))
    rise = torch.cumsum(HEAT * DURATION, 0) / (800.0 * SPECIFIC_HEAT)
    torch.testing.assert_close(found, START + rise, rtol=1e-13, atol=0.0)


def test_cooled_packs_follow_an_integration_step_by_step():
    conductance, steps = 300.0, 200000
    temperature, ends = float(START), []
    for heat, duration, air in zip(HEAT.tolist(), DURATION.tolist(), AIR.tolist(), strict=True):
        step = duration / steps
        for _ in range(steps):
            temperature += (heat - conductance * (temperature - air)) * step / (800.0 * SPECIFIC_HEAT)
        ends.append(temperature)
    found = pack_temperature(HEAT, DURATION, MASS, START, AIR, tensor(conductance))
    assert found.tolist() == pytest.approx(ends, abs=1e-4)
    assert float(found[2]) < float(found[1])  # the last segment cools


def test_long_segments_end_where_heat_flows_off():
    found = pack_temperature(HEAT, tensor([1e6] * 3), MASS, START, AIR, tensor(500.0))
    torch.testing.assert_close(found, AIR + HEAT / 500.0, rtol=1e-12, atol=0.0)


def test_cutting_a_segment_changes_nothing_and_small_conductance_is_none():
    whole = pack_temperature(HEAT, DURATION, MASS, START, AIR, tensor(300.0))
    halves = [part.repeat_interleave(2) for part in (HEAT, 0.5 * DURATION, AIR)]
    cut = pack_temperature(halves[0], halves[1], MASS, START, halves[2], tensor(300.0))
    torch.testing.assert_close(cut[1::2], whole, rtol=1e-13, atol=0.0)
    weak, none = (pack_temperature(HEAT, DURATION, MASS, START, AIR, tensor(g)) for g in (1e-6, 0.0))
    torch.testing.assert_close(weak, none, rtol=1e-9, atol=0.0)


def test_more_heat_is_warmer_and_more_mass_or_cooling_colder():
    def last(heat=1.0, mass=800.0, conductance=200.0):
        found = pack_temperature(heat * HEAT, DURATION, tensor(mass), START, AIR, tensor(conductance))
        return float(found[0])

    assert last(heat=1.1) > last() > last(mass=900.0)
    assert last() > last(conductance=400.0)


def test_heat_of_the_circuit_is_what_source_and_terminals_differ_by():
    """Energy of the source over a mission from the integral of the open-circuit voltage; the pair's store is left at the end."""
    power, duration = tensor([450e3, 160e3, 110e3]), tensor([90.0, 300.0, 1500.0])
    mass, energy = tensor(800.0), 400.0 * 3600.0
    state = pack_discharge(LG_M50, power, duration, mass, energy)
    cells = mass * energy / cell_energy(LG_M50)
    heat = circuit_heat(LG_M50, state.state_of_charge, state.pair_voltage, duration, cells)
    charge = torch.linspace(float(state.final_state_of_charge), 1.0, 20001, dtype=torch.float64)
    source = cells * LG_M50.capacity * torch.trapezoid(LG_M50.open_circuit_voltage(charge), charge)
    true = float(source - (power * duration).sum())
    stored = float(cells * 0.5 * LG_M50.pair_capacitance * state.pair_voltage[-1] ** 2)
    assert float((heat * duration).sum()) == pytest.approx(true - stored, rel=0.01)


def test_heat_of_constant_efficiency_closes_the_balance():
    loss = discharge_loss(HEAT, 0.95)
    torch.testing.assert_close(HEAT + loss, HEAT / 0.95, rtol=1e-14, atol=0.0)


@pytest.mark.parametrize(
    ("power", "energy", "rate"),
    [
        # Silva et al. (2018): lift power of weight over power, battery MJ, C-rate in hover; the motors' efficiency was not published.
        (6480.0 / 14.0, 1330e6, 1.1),
        (8210.0 / 7.4, 1440e6, 2.4),
        (4900.0 / 12.6, 846e6, 1.4),
    ],
)
def test_c_rates_in_hover_beside_nasas(power, energy, rate):
    found = discharge_rate(tensor([power * HORSEPOWER / 0.9]), tensor(energy), 1.0)
    assert float(found) == pytest.approx(rate, rel=0.12)


def test_gradients_equal_central_differences():
    def numbers(x):
        found = pack_temperature(
            x[0] * HEAT, x[1] * DURATION, x[2] * MASS, x[3] * START, x[4] * AIR, 200.0 * x[5], 1000.0 * x[6]
        )
        charge = 1.0 - x[0] * tensor([0.1, 0.3, 0.7])
        pair = x[6] * tensor([0.05, 0.02, 0.01])
        heat = circuit_heat(LG_M50, charge, pair, x[1] * DURATION, 1e4 * x[2]) / 1e4
        rate = discharge_rate(1e5 * x[0] * torch.ones(1).double(), 800.0 * x[2], 1.44e6 * x[6])
        return torch.cat([found / 100.0, heat, rate])

    x = tensor([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    exact = torch.autograd.functional.jacobian(numbers, x)
    torch.testing.assert_close(exact, central_difference(numbers, x, 1e-3), rtol=1e-8, atol=1e-8)
