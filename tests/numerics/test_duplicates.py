"""Equal members of a batch are found, and are solved once."""

import torch

from lpc_mdo.disciplines.blade_element import blade_element_momentum
from lpc_mdo.numerics.duplicates import distinct_rows
from lpc_mdo.surrogates.airfoil import load_airfoil
from lpc_mdo.verification.random_rotors import random_conditions


def test_rows_are_put_together_again_from_the_distinct_ones():
    generator = torch.Generator().manual_seed(1)
    pool = torch.randn(5, 2, 3, generator=generator, dtype=torch.float64)
    one, other = pool[[3, 1, 3, 4, 1, 1]], torch.tensor([[0.0], [1.0], [0.0], [2.0], [1.0], [3.0]]).double()
    distinct = distinct_rows(one, other)
    assert distinct.first.tolist() == [0, 1, 3, 5]  # the last row differs in its second part alone
    for rows in (one, other):
        assert torch.equal(distinct.spread(distinct.of(rows)), rows)


def test_no_rows_have_no_distinct_ones():
    distinct = distinct_rows(torch.zeros(0, 4))
    assert distinct.of(torch.zeros(0, 2)).shape == (0, 2)


def test_equal_rotors_in_a_batch_have_the_loads_of_each_alone():
    rotor, inflow = random_conditions(6, stations=9, seed=3)
    index = torch.tensor([0, 1, 0, 2, 2, 3, 4, 5, 5])
    taken = lambda record: type(record)(*(value[index] for value in vars(record).values()))  # noqa: E731
    together = blade_element_momentum(taken(rotor), taken(inflow), load_airfoil())
    alone = blade_element_momentum(rotor, inflow, load_airfoil())
    assert torch.equal(together.inflow_angle, alone.inflow_angle[index])
    for name in ("thrust_per_length", "torque_per_length"):  # matrix products round by the size of the batch
        torch.testing.assert_close(getattr(together, name), getattr(alone, name)[index], rtol=1e-13, atol=1e-11)
