"""B-spline bases: partition of unity, linear precision, end points, de Boor's recursion and Bernstein polynomials."""

import math

import numpy as np
import pytest
import torch
from scipy.interpolate import BSpline

from lpc_mdo.numerics.bsplines import basis_matrix, clamped_knots, greville_abscissae

SPACES = [(4, 1), (4, 2), (4, 3), (5, 3), (9, 3), (12, 2)]
POINTS = torch.linspace(0.0, 1.0, 101, dtype=torch.float64)


def cox_de_boor(i, degree, x, knots):
    """Basis function by its defining recursion, closed at the last knot."""
    if degree == 0:
        is_last = x == knots[-1] and knots[i] < knots[i + 1] == knots[-1]
        return float(knots[i] <= x < knots[i + 1] or is_last)
    left, right = knots[i + degree] - knots[i], knots[i + degree + 1] - knots[i + 1]
    value = (x - knots[i]) / left * cox_de_boor(i, degree - 1, x, knots) if left > 0 else 0.0
    if right > 0:
        value += (knots[i + degree + 1] - x) / right * cox_de_boor(i + 1, degree - 1, x, knots)
    return value


@pytest.mark.parametrize(("count", "degree"), SPACES)
def test_basis_equals_the_defining_recursion_on_uniform_clamped_knots(count, degree):
    inner = np.arange(count - degree + 1) / (count - degree)
    knots = [0.0] * degree + list(inner) + [1.0] * degree
    expected = [[cox_de_boor(i, degree, x, knots) for i in range(count)] for x in POINTS.tolist()]
    # Points that fall on a knot to rounding belong to either side: the basis is continuous there.
    np.testing.assert_allclose(basis_matrix(POINTS, count, degree).numpy(), expected, atol=1e-13)


@pytest.mark.parametrize(("count", "degree"), SPACES)
def test_curve_equals_scipys_spline_with_the_same_control_points(count, degree):
    control = np.random.default_rng(3).normal(size=(count, 2))
    theirs = BSpline(clamped_knots(count, degree), control, degree)(POINTS.numpy())
    np.testing.assert_allclose(basis_matrix(POINTS, count, degree).numpy() @ control, theirs, atol=1e-13)


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_one_span_is_a_bezier_curve(degree):
    bernstein = [math.comb(degree, i) * POINTS**i * (1 - POINTS) ** (degree - i) for i in range(degree + 1)]
    torch.testing.assert_close(basis_matrix(POINTS, degree + 1, degree), torch.stack(bernstein, -1), rtol=0, atol=1e-13)


@pytest.mark.parametrize(("count", "degree"), SPACES)
def test_basis_is_a_partition_of_unity_without_negative_parts(count, degree):
    basis = basis_matrix(POINTS, count, degree)
    torch.testing.assert_close(basis.sum(-1), torch.ones_like(POINTS), rtol=0.0, atol=1e-14)
    assert float(basis.min()) >= 0.0


@pytest.mark.parametrize(("count", "degree"), SPACES)
def test_control_points_at_the_greville_abscissae_reproduce_a_straight_line(count, degree):
    abscissae = torch.from_numpy(greville_abscissae(count, degree))
    torch.testing.assert_close(basis_matrix(POINTS, count, degree) @ abscissae, POINTS, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize(("count", "degree"), SPACES)
def test_curve_starts_and_ends_in_its_end_points(count, degree):
    basis = basis_matrix(torch.tensor([0.0, 1.0], dtype=torch.float64), count, degree)
    assert basis[0].tolist() == [1.0] + [0.0] * (count - 1)
    assert basis[1].tolist() == [0.0] * (count - 1) + [1.0]


def test_each_control_point_acts_on_degree_plus_one_spans_only():
    count, degree = 9, 3
    knots = clamped_knots(count, degree)
    basis = basis_matrix(POINTS, count, degree)
    for i in range(count):
        start, end = knots[i], knots[i + degree + 1]
        outside = (start > POINTS) | (end < POINTS)
        assert float(basis[outside, i].abs().sum()) == 0.0


def test_reversing_the_control_points_reverses_the_curve():
    basis = basis_matrix(POINTS, 7, 3)
    torch.testing.assert_close(basis.flip(0).flip(1), basis, rtol=0.0, atol=1e-14)


@pytest.mark.parametrize(("count", "degree"), [(3, 3), (2, -1)])
def test_too_few_control_points_are_refused(count, degree):
    with pytest.raises(ValueError, match=f"degree = {degree} is not allowed"):
        clamped_knots(count, degree)
