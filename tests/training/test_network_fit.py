"""The fit behind the airfoil surrogate: exact derivatives, descent, and the logistic form of the same network."""

from itertools import pairwise

import pytest
import torch

from lpc_mdo.surrogates.airfoil import network_outputs
from lpc_mdo.training.network_fit import (
    Samples,
    fit,
    layers,
    logistic_layers,
    objective,
    outputs,
    outputs_and_jacobian,
    parameter_count,
    start,
)

INPUTS = torch.rand(40, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64) * 2.0 - 1.0


def test_jacobian_equals_automatic_differentiation():
    parameters = start(5, 0).parameters
    values, jacobian = outputs_and_jacobian(parameters, INPUTS, 5)
    torch.testing.assert_close(values, outputs(parameters, INPUTS, 5), rtol=0.0, atol=1e-14)
    exact = torch.autograd.functional.jacobian(lambda p: outputs(p, INPUTS, 5), parameters)
    torch.testing.assert_close(jacobian, exact, rtol=0.0, atol=1e-13)


def test_parameters_are_counted():
    assert len(start(7, 0).parameters) == parameter_count(7)
    assert sum(m.numel() + b.numel() for m, b in layers(start(7, 0).parameters, 7)) == parameter_count(7)


def test_logistic_layers_are_the_same_network():
    parameters = start(6, 3).parameters
    cl, cd = network_outputs(INPUTS, logistic_layers(parameters, 6))
    torch.testing.assert_close(
        torch.stack([cl, torch.log(cd)], -1), outputs(parameters, INPUTS, 6), rtol=0.0, atol=1e-12
    )


def test_a_network_is_recovered_from_its_own_outputs():
    targets = outputs(start(3, 11).parameters, INPUTS, 3)
    samples = Samples(INPUTS, targets, torch.ones(len(INPUTS), dtype=torch.float64))
    history = []

    def watch(state):
        history.append(objective(state.parameters, samples, 4))

    state = fit(samples, start(4, 2), 4, 150, watch)
    assert all(later <= earlier for earlier, later in pairwise(history))
    assert float((outputs(state.parameters, INPUTS, 4) - targets).abs().mean()) < 1e-2  # outputs of order one
    assert state.iteration == len(history)


@pytest.mark.parametrize("pause", [1, 17])
def test_going_on_from_a_state_gives_the_same_bits(pause):
    targets = torch.stack([torch.sin(3.0 * INPUTS[:, 0]), INPUTS[:, 1] * INPUTS[:, 2]], -1)
    samples = Samples(INPUTS, targets, torch.ones(len(INPUTS), dtype=torch.float64))
    whole = fit(samples, start(4, 0), 4, 30, lambda _: None)
    half = fit(samples, start(4, 0), 4, pause, lambda _: None)
    assert torch.equal(fit(samples, half, 4, 30, lambda _: None).parameters, whole.parameters)
