"""Designs of stored results as starts and as optima: what lies beyond a bound is told or refused, never moved in silence."""

import warnings
from pathlib import Path

import pytest
from analytic_studies import circles

from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.stored.designs import scaled_design, start_design

FILE = Path("old.json")


def stored(problem, **moved):
    values = {name: value.tolist() for name, value in problem.physical(problem.x0).items()} | moved
    return {"design_variables": [{"name": name, "value": value} for name, value in values.items()]}


@pytest.fixture
def problem():
    return circles([0.5]).problems([0.5])[0]


def test_a_design_within_its_bounds_is_taken_as_it_is(problem):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert start_design(stored(problem), FILE, problem).tolist() == problem.x0.tolist()
        assert scaled_design(stored(problem), FILE, problem).tolist() == problem.x0.tolist()


def test_a_start_beyond_a_bound_says_so_and_an_optimum_is_refused(problem):
    variable = problem.variables[0]
    far = (variable.upper_tensor + 7.0).tolist()
    words = f"{problem.variable_label(0)} = .* lies beyond its bounds"
    with pytest.warns(UserWarning, match=f"{words}.*the start takes the bound"):
        x = start_design(stored(problem, **{variable.name: far}), FILE, problem)
    assert float(x[0]) == 1.0
    with pytest.raises(ConfigurationError, match=words):
        scaled_design(stored(problem, **{variable.name: far}), FILE, problem)
