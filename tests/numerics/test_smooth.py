"""Smooth stand-ins: how far they may stray from what they replace, and that their slopes are finite and continuous."""

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.numerics.smooth import safe_norm, safe_sqrt, smooth_maximum, smooth_step

X = torch.linspace(-2.0, 3.0, 501, dtype=torch.float64)


def slope(function, x):
    x = x.detach().clone().requires_grad_()
    return torch.autograd.grad(function(x).sum(), x)[0]


def curvature(function, x):
    x = x.detach().clone().requires_grad_()
    (first,) = torch.autograd.grad(function(x).sum(), x, create_graph=True)
    return torch.autograd.grad(first.sum(), x)[0]


def test_square_root_is_exact_away_from_zero_and_has_a_finite_slope_at_and_below_it():
    x = torch.logspace(-12, 6, 50, dtype=torch.float64)
    torch.testing.assert_close(safe_sqrt(x), x.sqrt(), rtol=1e-15, atol=0.0)
    at_zero = torch.tensor([-1.0, 0.0], dtype=torch.float64)
    torch.testing.assert_close(safe_sqrt(at_zero), torch.full_like(at_zero, 1e-15), rtol=1e-12, atol=0.0)
    assert bool(slope(safe_sqrt, at_zero).isfinite().all())


def test_norm_is_euclidean_and_its_gradient_the_unit_vector():
    v = torch.tensor([[3.0, 4.0, 12.0], [-2.0, 3.0, 6.0]], dtype=torch.float64)
    torch.testing.assert_close(safe_norm(v), torch.tensor([13.0, 7.0], dtype=torch.float64), rtol=1e-15, atol=0.0)
    torch.testing.assert_close(slope(safe_norm, v), v / safe_norm(v)[:, None], rtol=1e-14, atol=0.0)
    torch.testing.assert_close(safe_norm(v, dim=0), torch.linalg.vector_norm(v, dim=0), rtol=1e-14, atol=0.0)


def test_norm_of_nothing_is_zero_with_zero_gradient():
    zero = torch.zeros(3, dtype=torch.float64)
    assert float(safe_norm(zero)) <= 1e-12
    assert slope(safe_norm, zero).tolist() == [0.0, 0.0, 0.0]


def test_step_rises_from_zero_to_one_between_zero_and_one_and_is_flat_beyond():
    step = smooth_step(X)
    assert bool((step[X <= 0.0] == 0.0).all())
    assert bool((step[X >= 1.0] == 1.0).all())
    assert bool((slope(smooth_step, X) >= 0.0).all())
    assert float(smooth_step(number(0.5))) == pytest.approx(0.5, abs=1e-15)


def test_step_is_point_symmetric_about_its_middle():
    torch.testing.assert_close(smooth_step(X) + smooth_step(1.0 - X), torch.ones_like(X), rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("joint", [0.0, 1.0])
def test_step_has_two_continuous_derivatives_at_its_joints(joint):
    # Third derivative 60 at the joints: within 1e-7 the slope stays below 30 (1e-7)^2, the curvature below 60e-7.
    sides = joint + torch.tensor([-1e-7, 1e-7], dtype=torch.float64)
    assert float(slope(smooth_step, sides).abs().max()) < 1e-12
    assert float(curvature(smooth_step, sides).abs().max()) < 1e-5


def test_maximum_lies_above_by_at_most_half_the_width_where_both_are_equal():
    a, b, width = X, torch.full_like(X, 0.4), 0.1
    excess = smooth_maximum(a, b, width) - torch.maximum(a, b)
    assert float(excess.min()) > 0.0
    assert float(excess.max()) <= 0.5 * width + 1e-15
    assert float(smooth_maximum(number(0.4), number(0.4), width)) == pytest.approx(0.45, rel=1e-14)
    # Asymptotically width^2/(4 gap).
    assert float(smooth_maximum(number(5.0), number(0.0), width)) - 5.0 == pytest.approx(0.01 / 20.0, rel=1e-3)


def test_maximum_is_symmetric_convex_and_moves_with_its_arguments():
    b = number(0.3)
    torch.testing.assert_close(smooth_maximum(X, b, 0.2), smooth_maximum(b, X, 0.2), rtol=0.0, atol=0.0)
    torch.testing.assert_close(smooth_maximum(X + 7, b + 7, 0.2), smooth_maximum(X, b, 0.2) + 7, rtol=0, atol=1e-13)
    assert float(curvature(lambda x: smooth_maximum(x, b, 0.2), X).min()) > 0.0


def test_gradients_of_the_maximum_are_shares_that_add_to_one():
    def maximum(x):
        return smooth_maximum(x[0], x[1], 0.2).reshape(1)

    x = torch.tensor([0.35, 0.3], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(maximum, x)
    torch.testing.assert_close(exact, central_difference(maximum, x, 1e-3), rtol=1e-6, atol=0.0)
    assert float(exact.sum()) == pytest.approx(1.0, abs=1e-14)
    assert bool(((exact > 0.0) & (exact < 1.0)).all())
