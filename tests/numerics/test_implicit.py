"""Implicit roots against SciPy's brentq, the implicit-function theorem and finite differences."""

import math

import pytest
import torch
from conftest import central_difference, number
from scipy.optimize import brentq

from lpc_mdo.numerics.implicit import RootNotFoundError, implicit_root


def kepler(anomaly, mean, eccentricity):
    return anomaly - eccentricity * torch.sin(anomaly) - mean


def solve_kepler(mean, eccentricity):
    return implicit_root(kepler, mean - 1.0, mean + 1.0, (mean, eccentricity))


def kepler_cases(count=400):
    generator = torch.Generator().manual_seed(7)
    mean = 2 * math.pi * torch.rand(count, generator=generator, dtype=torch.float64)
    return mean, 0.99 * torch.rand(count, generator=generator, dtype=torch.float64)


def test_roots_of_keplers_equation_equal_brentq():
    mean, eccentricity = kepler_cases()
    ours = solve_kepler(mean, eccentricity)
    for root, m, e in zip(ours.tolist(), mean.tolist(), eccentricity.tolist(), strict=True):
        theirs = brentq(lambda x, e=e, m=m: x - e * math.sin(x) - m, m - 1.0, m + 1.0, xtol=1e-14, rtol=1e-14)
        assert root == pytest.approx(theirs, abs=1e-12)


@pytest.mark.parametrize(
    ("function", "root"),
    [
        (lambda x, a: torch.atan(50.0 * (x - a)), 0.3),  # Newton alone diverges from most points
        (lambda x, a: torch.expm1(30.0 * (x - a)), 0.3),  # very steep on one side, flat on the other
        (lambda x, a: (x - a) + 2.0 * (x - a).clamp(min=0.0), 0.3),  # kink at the root
        (lambda x, a: torch.where(x < a, 1e-3, 1e3) * (x - a), 0.3),  # slope changes a millionfold at the root
        (lambda x, a: torch.cos(x) - a * x - 1.0 + 2.0 * x, 0.0),  # root on an end of the bracket
    ],
)
def test_roots_are_found_where_newton_alone_fails(function, root):
    a = number(0.3)
    value = implicit_root(function, number(0.0), number(1.0), (a,), initial=number(0.999))
    assert float(value) == pytest.approx(root, abs=1e-11)


def test_root_does_not_depend_on_the_first_guess():
    mean, eccentricity = kepler_cases()
    guesses = [
        implicit_root(kepler, mean - 1, mean + 1, (mean, eccentricity), mean + d) for d in (-5.0, -0.9, 0.7, 1.0)
    ]
    for guess in guesses[1:]:
        torch.testing.assert_close(guess, guesses[0], rtol=0.0, atol=1e-11)


def test_gradient_is_that_of_the_implicit_function_theorem():
    mean, eccentricity = (t.requires_grad_() for t in kepler_cases())
    anomaly = solve_kepler(mean, eccentricity)
    by_mean, by_eccentricity = torch.autograd.grad(anomaly.sum(), (mean, eccentricity))
    slope = 1.0 - eccentricity * torch.cos(anomaly)
    torch.testing.assert_close(by_mean, 1.0 / slope, rtol=1e-9, atol=0.0)
    torch.testing.assert_close(by_eccentricity, torch.sin(anomaly) / slope, rtol=1e-9, atol=1e-12)


def test_gradient_equals_central_differences():
    def root(p):
        return implicit_root(
            lambda x, a, b, c: a * torch.sinh(x) + b * x - c, number(-10.0), number(10.0), tuple(p)
        ).reshape(1)

    p = torch.tensor([0.7, 1.3, 4.0], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(root, p)
    torch.testing.assert_close(exact, central_difference(root, p, 1e-3), rtol=1e-9, atol=0.0)


def test_inverse_function_has_the_reciprocal_gradient():
    x = torch.linspace(-2.0, 2.0, 41, dtype=torch.float64)
    y = (torch.exp(x) + x).requires_grad_()
    inverse = implicit_root(lambda x, y: torch.exp(x) + x - y, torch.full_like(x, -3), torch.full_like(x, 3), (y,))
    torch.testing.assert_close(inverse.detach(), x, rtol=0.0, atol=1e-11)
    (gradient,) = torch.autograd.grad(inverse.sum(), y)
    torch.testing.assert_close(gradient, 1.0 / (torch.exp(x) + 1.0), rtol=1e-10, atol=0.0)


def test_no_gradient_flows_from_the_bracket_or_the_guess():
    lower, upper, guess = (number(v).requires_grad_() for v in (0.0, 3.0, 1.0))
    a = number(2.0).requires_grad_()
    root = implicit_root(lambda x, a: x**2 - a, lower, upper, (a,), guess)
    gradients = torch.autograd.grad(root, (lower, upper, guess, a), allow_unused=True)
    assert gradients[:3] == (None, None, None)
    assert float(gradients[3]) == pytest.approx(0.5 / math.sqrt(2.0), rel=1e-12)


def test_a_batch_equals_a_loop():
    mean, eccentricity = kepler_cases(24)
    batch = solve_kepler(mean.reshape(4, 6), eccentricity.reshape(4, 6)).flatten()
    loop = torch.stack([solve_kepler(m, e) for m, e in zip(mean, eccentricity, strict=True)])
    torch.testing.assert_close(batch, loop, rtol=0.0, atol=1e-12)


def test_an_undefined_element_leaves_the_others_alone():
    a = torch.tensor([2.0, math.nan, 3.0], dtype=torch.float64)
    roots = implicit_root(lambda x, a: x**2 - a, torch.zeros_like(a), torch.full_like(a, 3.0), (a,))
    assert bool(roots[1].isnan())
    torch.testing.assert_close(roots[[0, 2]], a[[0, 2]].sqrt(), rtol=1e-12, atol=0.0)


def test_too_few_iterations_raise_and_count_the_roots_missed():
    mean, eccentricity = kepler_cases(5)
    with pytest.raises(RootNotFoundError, match="of 5 roots did not converge"):
        implicit_root(kepler, mean - 1, mean + 1, (mean, eccentricity + 0.0), iterations=1)


@pytest.mark.parametrize("shift", [1.0, -3.0])
def test_a_bracket_without_a_root_raises_instead_of_returning_its_end(shift):
    bracket = torch.zeros(2, dtype=torch.float64), torch.ones(2, dtype=torch.float64)
    a = torch.tensor([-0.5, shift], dtype=torch.float64)
    with pytest.raises(RootNotFoundError, match="1 of 2 brackets hold no root"):
        implicit_root(lambda x, a: x + a, *bracket, (a,))


def test_second_derivatives_are_those_of_the_implicit_function_theorem():
    """x^3 + x = p: x'' = -6 x/(3 x^2 + 1)^3."""
    p = torch.linspace(-2.0, 2.0, 9, dtype=torch.float64, requires_grad=True)
    ends = torch.full((9,), 3.0, dtype=torch.float64)
    x = implicit_root(lambda x, p: x**3 + x - p, -ends, ends, (p,))
    (first,) = torch.autograd.grad(x.sum(), p, create_graph=True)
    (second,) = torch.autograd.grad(first.sum(), p)
    x = x.detach()
    torch.testing.assert_close(first.detach(), 1.0 / (3.0 * x**2 + 1.0), rtol=1e-10, atol=0.0)
    torch.testing.assert_close(second, -6.0 * x / (3.0 * x**2 + 1.0) ** 3, rtol=1e-9, atol=1e-12)


def test_derivatives_of_any_order_pass_gradcheck():
    mean, eccentricity = (value[:3].requires_grad_() for value in kepler_cases())
    assert torch.autograd.gradcheck(solve_kepler, (mean, eccentricity))
    assert torch.autograd.gradgradcheck(solve_kepler, (mean, eccentricity))


def test_rows_of_a_jacobian_share_one_evaluation_of_the_residual():
    calls = []

    def residual(x, a):
        calls.append(None)
        return x**2 - a

    a = torch.tensor([2.0, 3.0], dtype=torch.float64, requires_grad=True)
    x = implicit_root(residual, torch.zeros(2).double(), torch.full((2,), 3.0).double(), (a,))
    before = len(calls)
    rows = [torch.autograd.grad(x[i], a, retain_graph=True)[0] for i in range(2)]
    assert len(calls) == before + 1
    torch.testing.assert_close(torch.stack(rows), torch.diag(0.5 / a.detach().sqrt()), rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("slope", [0.3, 1.0, 40.0])
def test_an_estimate_of_the_slope_does_not_change_the_root(slope):
    mean, eccentricity = kepler_cases()
    args = (kepler, mean - 1.0, mean + 1.0, (mean, eccentricity), mean)
    torch.testing.assert_close(
        implicit_root(*args, initial_slope=torch.full_like(mean, slope)), implicit_root(*args), rtol=0.0, atol=1e-11
    )


def test_args_broadcast_and_empty_batches_stay_empty():
    mean = kepler_cases()[0][:4].reshape(4, 1)
    eccentricity = torch.tensor([0.1, 0.5, 0.9], dtype=torch.float64, requires_grad=True)
    roots = implicit_root(kepler, (mean - 1.0).expand(4, 3), (mean + 1.0).expand(4, 3), (mean, eccentricity))
    torch.testing.assert_close(roots[2, 1], solve_kepler(mean[2, 0], number(0.5)), rtol=0.0, atol=1e-12)
    (gradient,) = torch.autograd.grad(roots.sum(), eccentricity)
    assert gradient.shape == (3,)
    assert solve_kepler(torch.empty(0, 2).double(), torch.empty(0, 2).double()).shape == (0, 2)


def test_single_precision_converges_to_its_own_rounding():
    mean, eccentricity = kepler_cases()
    single = solve_kepler(mean.float(), eccentricity.float())
    assert single.dtype == torch.float32
    torch.testing.assert_close(single.double(), solve_kepler(mean, eccentricity), rtol=2e-5, atol=2e-5)
