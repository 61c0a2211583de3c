"""Bessel functions against forty digits, their differential equation, their sums, and the edges of their range."""

import math

import mpmath
import numpy as np
import pytest
import torch
from scipy.special import jvp
from torch.autograd import gradcheck, gradgradcheck

from lpc_mdo.numerics.bessel import bessel_j, bessel_table

ORDERS = torch.tensor([-3.0, 0.0, 1.0, 2.0, 7.0, 20.0], dtype=torch.float64)
ARGUMENTS = torch.tensor([1e-8, 0.3, 1.0, 4.0, 11.0, 30.0], dtype=torch.float64)


@pytest.mark.parametrize("order", [0, 1, 2, 5, 12, 30, 64, 100])
def test_digits_are_right_from_the_smallest_values_to_the_oscillations(order):
    """Both sides of the change of method at x^2 = 4 (n + 1), and of the saddle's disappearance at x = n, included."""
    generator = np.random.default_rng(order)
    change = 2.0 * math.sqrt(order + 1.0)
    x = np.concatenate(
        [
            10.0 ** generator.uniform(-4.0, 2.3, 40),
            change + np.array([-1e-9, 1e-9]),
            order + np.array([-1e-9, 0.0, 1e-9]),
        ]
    )
    x = np.abs(x)
    ours = bessel_j(torch.tensor(float(order), dtype=torch.float64), torch.tensor(x))
    with mpmath.workdps(40):
        for value, argument in zip(ours.tolist(), x.tolist(), strict=True):
            exact = mpmath.besselj(order, mpmath.mpf(argument))
            # Next to a zero an error of one part in 1e16 of x changes every digit: there relative to the amplitude.
            scale = abs(exact) if argument <= order else max(abs(exact), 0.01 * mpmath.sqrt(2 / (mpmath.pi * argument)))
            assert float(abs(value - exact)) <= 2e-12 * float(scale)


def test_values_follow_from_the_generating_function():
    """exp(i x sin t) = sum over all orders of J_n(x) exp(i n t), whose mean square is 1."""
    # 121 terms, each to some 1e-15.
    orders, x = torch.arange(-60.0, 61.0, dtype=torch.float64), ARGUMENTS[:, None]
    table = bessel_j(orders, x)
    for t in (0.0, 0.7, 2.0):
        wave = (table * torch.exp(1j * orders * t)).sum(-1)
        torch.testing.assert_close(wave, torch.exp(1j * ARGUMENTS * math.sin(t)), rtol=0.0, atol=2e-13)
    torch.testing.assert_close((table**2).sum(-1), torch.ones_like(ARGUMENTS), rtol=1e-14, atol=0.0)


def test_negative_orders_and_arguments_change_the_sign_of_odd_orders():
    orders = torch.arange(0.0, 9.0, dtype=torch.float64)[:, None]
    parity = 1.0 - 2.0 * torch.remainder(orders, 2)
    value = bessel_j(orders, ARGUMENTS)
    torch.testing.assert_close(bessel_j(-orders, ARGUMENTS), parity * value, rtol=0.0, atol=0.0)
    torch.testing.assert_close(bessel_j(orders, -ARGUMENTS), parity * value, rtol=0.0, atol=0.0)
    torch.testing.assert_close(bessel_j(-orders, -ARGUMENTS), value, rtol=0.0, atol=0.0)


def test_derivatives_are_those_of_scipy():
    x = ARGUMENTS.clone().requires_grad_()
    for n in ORDERS:
        (slope,) = torch.autograd.grad(bessel_j(n, x).sum(), x)
        np.testing.assert_allclose(slope.numpy(), jvp(int(n), ARGUMENTS.numpy()), rtol=1e-11, atol=1e-15)


def test_functions_satisfy_their_differential_equation():
    """x^2 J'' + x J' + (x^2 - n^2) J = 0, with J'' from differentiating twice."""
    x = ARGUMENTS[1:].clone().requires_grad_()
    for n in ORDERS:
        value = bessel_j(n, x)
        (first,) = torch.autograd.grad(value.sum(), x, create_graph=True)
        (second,) = torch.autograd.grad(first.sum(), x)
        rest = x**2 * second + x * first + (x**2 - n**2) * value
        scale = (x**2 * second).abs() + (x**2 - n**2).abs() * value.abs()
        assert float((rest.abs() / (scale + 1e-300)).max().detach()) < 1e-11


def test_gradients_of_first_and_second_order_equal_differences():
    orders = torch.arange(-3.0, 8.0, dtype=torch.float64)[:, None]
    x = torch.tensor([-2.0, 0.0, 0.5, 3.0, 11.0], dtype=torch.float64, requires_grad=True)
    assert gradcheck(lambda x: bessel_j(orders, x), x)
    assert gradgradcheck(lambda x: bessel_j(orders, x), x)


def test_shapes_broadcast_and_types_stay():
    table = bessel_j(torch.arange(3.0)[:, None, None], torch.ones(4, 1, dtype=torch.float32) * torch.ones(5))
    assert table.shape == (3, 4, 5)
    assert table.dtype == torch.float32
    assert bessel_j(torch.arange(3.0)[:, None], torch.zeros(0, dtype=torch.float64)).shape == (3, 0)
    batch = bessel_j(ORDERS[:, None], ARGUMENTS)
    for i, n in enumerate(ORDERS):
        torch.testing.assert_close(batch[i], bessel_j(n, ARGUMENTS), rtol=1e-11, atol=0.0)


@pytest.mark.parametrize("fault", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_stays_alone(fault):
    x = torch.tensor([0.5, fault, 9.0], dtype=torch.float64, requires_grad=True)
    value = bessel_j(torch.tensor(2.0, dtype=torch.float64), x)
    (slope,) = torch.autograd.grad(value[[0, 2]].sum(), x)
    assert value.isnan().tolist() == [False, True, False]
    assert bool(slope[[0, 2]].isfinite().all())


@pytest.mark.parametrize("highest", [0, 7, 60])
def test_a_table_holds_every_order(highest):
    x = torch.cat([torch.zeros(1), torch.logspace(-12, 2.3, 60), torch.tensor([2.404825557695773])]).double()
    orders = torch.arange(highest + 1.0, dtype=torch.float64)
    single = bessel_j(orders, x[:, None])
    amplitude = torch.where(x[:, None] > orders, 0.01 * torch.sqrt(2.0 / (math.pi * x[:, None])), 0.0)
    # Both sides to 2e-12, as above; denormal numbers have fewer digits.
    error = (bessel_table(x, highest) - single).abs()
    assert bool((error <= 4e-12 * torch.maximum(single.abs(), amplitude) + 1e-300).all())


def test_a_table_has_the_gradients_of_its_orders_and_keeps_faults_alone():
    x = torch.tensor([0.0, 0.4, 3.0, 12.0], dtype=torch.float64, requires_grad=True)
    assert gradcheck(lambda x: bessel_table(x, 7), x)
    assert gradgradcheck(lambda x: bessel_table(x, 7), x)
    table = bessel_table(torch.tensor([1.0, math.nan, math.inf, 30.0]), 3)
    assert table.dtype == torch.float32
    assert table.isnan().any(-1).tolist() == [False, True, True, False]
    assert bessel_table(torch.zeros(0, 2, dtype=torch.float64), 4).shape == (0, 2, 5)
    with pytest.raises(ValueError, match="highest = -1 is not allowed"):
        bessel_table(x, -1)


def test_arguments_that_would_take_minutes_are_refused():
    large = torch.tensor([1.0, 1e7], dtype=torch.float64)
    with pytest.raises(
        ValueError, match=r"argument of a Bessel function = 1e\+07 is invalid: it must be at most 10000"
    ):
        bessel_j(torch.tensor(2), large)
    with pytest.raises(ValueError, match="must be at most 10000"):
        bessel_table(large, 3)
