"""Battery by energy drawn: conservation of energy, monotony and gradients."""

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.disciplines.battery import energy_state_of_charge

POWER = torch.tensor([400e3, 150e3, 90e3], dtype=torch.float64)
DURATION = torch.tensor([90.0, 300.0, 1800.0], dtype=torch.float64)
SPECIFIC_ENERGY = 400.0 * 3600.0


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


def test_one_mission_that_is_no_number_leaves_the_others_alone():
    power = torch.stack([POWER, POWER * float("nan"), 2.0 * POWER])
    final = energy_state_of_charge(power, DURATION, number(800.0), SPECIFIC_ENERGY).final_state_of_charge
    assert final.isnan().tolist() == [False, True, False]
    empty = energy_state_of_charge(torch.zeros(0, 3), torch.zeros(3), torch.zeros(0), SPECIFIC_ENERGY)
    assert empty.state_of_charge.shape == (0, 3)
    assert empty.state_of_charge.dtype == torch.float32
