"""Trip costs: the trade study whose rates they are, sums, proportions and differences."""

from dataclasses import fields, replace

import pytest
import torch
from conftest import central_difference

from lpc_mdo.disciplines.cost import (
    HOUR,
    KILOWATT_HOUR,
    CostRates,
    cost_per_distance,
    purchase_price,
    trip_cost,
)
from lpc_mdo.numerics.tensors import tensor

# config_trade_study_tabulatedData.txt: airframe kg, battery kg of 400 Wh/kg, mission and charging time min at 200 kW with 0.9, price in
# thousands of $, trip cost $, $ by passenger and kilometre over 30 nautical miles with two passengers.
STUDY = {
    "lift and cruise": (797.0, 348.0, 26.0, 11.1, 731.0, 132.0, 1.19),
    "compound helicopter": (738.0, 379.0, 27.3, 12.5, 690.0, 139.0, 1.25),
    "tilt wing": (793.0, 290.0, 24.0, 9.2, 718.0, 118.0, 1.06),
    "tilt rotor": (729.0, 238.0, 22.2, 7.4, 661.0, 105.0, 0.94),
}


@pytest.mark.parametrize("name", STUDY)
def test_trade_study_comes_out(name):
    airframe, battery, mission, charging, thousands, trip, by_kilometre = STUDY[name]
    price = purchase_price(tensor(airframe), tensor(battery * 0.4 * KILOWATT_HOUR))
    assert float(price.total) == pytest.approx(1e3 * thousands, rel=1e-3)
    energy = tensor(0.9 * 200e3 * charging * 60.0)
    cost = trip_cost(price, energy, tensor(mission * 60.0))
    assert float(cost.total) == pytest.approx(trip, rel=0.015)
    by_metre = cost_per_distance(cost, 2.0, tensor(30.0 * 1852.0))
    assert 1e3 * float(by_metre) == pytest.approx(by_kilometre, rel=0.02)


def example(rates=None, energy=100.0, time=0.4):
    price = purchase_price(tensor(2000.0), tensor(300.0 * KILOWATT_HOUR), rates)
    return trip_cost(price, tensor(energy * KILOWATT_HOUR), tensor(time * HOUR), rates)


def test_parts_add_up_and_none_is_negative():
    cost = example()
    assert float(cost.total) == pytest.approx(sum(float(getattr(cost, f.name)) for f in fields(cost)), rel=1e-14)
    assert all(float(getattr(cost, f.name)) > 0.0 for f in fields(cost))


def test_every_part_follows_what_it_should():
    one, more = example(), example(energy=200.0)
    assert float(more.energy) == pytest.approx(2.0 * float(one.energy), rel=1e-14)
    assert float(more.airframe) == float(one.airframe)
    longer = example(time=0.8)
    for name in ("airframe", "avionics", "pilots", "maintenance"):
        assert float(getattr(longer, name)) == pytest.approx(2.0 * float(getattr(one, name)), rel=1e-14)
    assert float(longer.battery) == float(one.battery)


def test_without_empty_flights_a_trip_pays_for_itself_alone():
    alone = example(replace(CostRates(), empty_share=0.0))
    assert float(alone.empty_flights) == 0.0
    # As many empty flights as others, with as many pilots: twice the cost.
    half = example(replace(CostRates(), empty_share=0.5, pilots_empty=1.5))
    assert float(half.total) == pytest.approx(2.0 * float(alone.total), rel=1e-14)


def test_energy_is_paid_at_the_grid():
    assert float(example().energy) == pytest.approx(100.0 * 0.12 / 0.9, rel=1e-14)


def test_gradient_equals_central_differences():
    def total(x):
        price = purchase_price(2000.0 * x[0], 1e9 * x[1])
        cost = trip_cost(price, 3e8 * x[2], 1500.0 * x[3], battery_cycles=0.7 * x[2])
        return torch.stack([cost.total, 1e4 * cost_per_distance(cost, 4.0, 7e4 * x[4]), price.total / 1e4])

    x = torch.ones(5, dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(total, x)
    torch.testing.assert_close(exact, central_difference(total, x, 1e-3), rtol=1e-9, atol=1e-9)
