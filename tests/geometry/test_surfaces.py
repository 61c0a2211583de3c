"""B-spline surfaces against SciPy's splines, closed forms and finite differences."""

import math

import numpy as np
import pytest
import torch
from scipy.interpolate import BSpline, NdBSpline

from lpc_mdo.geometry.surfaces import BSplineSurface
from lpc_mdo.numerics.bsplines import local_bases

RANDOM = torch.Generator().manual_seed(7)
SPACES = [((5, 4), (3, 2)), ((9, 6), (4, 5)), ((6, 2), (1, 1)), ((7, 8), (2, 3)), ((3, 3), (0, 1))]


def uniform(*shape):
    return torch.rand(*shape, dtype=torch.float64, generator=RANDOM)


def random_knots(count, degree):
    """Clamped, not uniform, one interior knot double where the degree leaves the surface continuous."""
    inner = torch.sort(0.1 + 2.0 * uniform(count - degree - 1)).values
    if inner.numel() >= 2 and degree >= 2:
        inner[1] = inner[0]
    ends = torch.tensor([0.0, 2.3], dtype=torch.float64).repeat_interleave(degree + 1)
    return torch.cat([ends[: degree + 1], inner, ends[degree + 1 :]])


def random_surface(counts=(9, 6), degrees=(4, 5), batch=(), is_rational=False):
    knots = tuple(random_knots(n, p) for n, p in zip(counts, degrees, strict=True))
    weights = 0.5 + uniform(*counts) if is_rational else None
    return BSplineSurface(2.0 * uniform(*batch, *counts, 3) - 1.0, degrees, knots, weights)


def scipys(surface):
    knots = tuple(k.numpy() for k in surface.knots)
    return NdBSpline(knots, surface.control_points.numpy(), surface.degrees)


@pytest.mark.parametrize(("counts", "degrees"), SPACES)
def test_points_equal_scipys(counts, degrees):
    surface = random_surface(counts, degrees)
    u, v = 2.3 * uniform(200), 2.3 * uniform(200)
    ends = torch.tensor([0.0, 0.0, 2.3, 2.3], dtype=torch.float64)
    u, v = torch.cat([u, ends]), torch.cat([v, ends.roll(1)])
    theirs = scipys(surface)(torch.stack([u, v], -1).numpy())
    np.testing.assert_allclose(surface(u, v).numpy(), theirs, rtol=0, atol=1e-13)


@pytest.mark.parametrize(("counts", "degrees"), SPACES)
def test_derivatives_to_second_order_equal_scipys(counts, degrees):
    surface = random_surface(counts, degrees)
    u, v = 2.3 * uniform(200), 2.3 * uniform(200)
    jet, theirs = surface.jet(u, v), scipys(surface)
    for name, order in (("u", (1, 0)), ("v", (0, 1)), ("uu", (2, 0)), ("uv", (1, 1)), ("vv", (0, 2))):
        expected = theirs(torch.stack([u, v], -1).numpy(), nu=order)
        scale = max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(getattr(jet, name).numpy() / scale, expected / scale, rtol=0, atol=1e-13)


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_local_bases_equals_each_basis_element_of_scipy(degree, derivative):
    count = degree + 4
    knots = random_knots(count, degree)
    x = 2.3 * uniform(50)
    first, values = local_bases(x, knots, degree, derivative)
    values = values[:, derivative]
    dense = torch.zeros(50, count, dtype=torch.float64)
    dense.scatter_(1, first[:, None] + torch.arange(degree + 1), values)
    theirs = BSpline(knots.numpy(), np.eye(count), degree)(x.numpy(), nu=derivative)
    scale = max(1.0, np.abs(theirs).max())
    np.testing.assert_allclose(dense.numpy() / scale, theirs / scale, rtol=0, atol=1e-13)


@pytest.mark.parametrize("is_rational", [False, True])
def test_basis_matrices_are_sparse_a_partition_of_unity_and_give_the_points(is_rational):
    surface = random_surface(is_rational=is_rational)
    u, v = 2.3 * uniform(100), 2.3 * uniform(100)
    matrix = surface.basis(u, v)
    assert matrix.is_sparse
    assert matrix._nnz() == 100 * 5 * 6
    torch.testing.assert_close(matrix.to_dense().sum(-1), torch.ones(100).double(), rtol=0, atol=1e-14)
    points = torch.sparse.mm(matrix, surface.control_points.flatten(0, 1))
    torch.testing.assert_close(points, surface(u, v), rtol=0, atol=1e-14)


def test_derivative_matrices_sum_to_zero_and_give_the_derivatives():
    surface = random_surface()
    u, v = 2.3 * uniform(100), 2.3 * uniform(100)
    jet = surface.jet(u, v)
    for name, order in (("u", (1, 0)), ("v", (0, 1)), ("uu", (2, 0)), ("uv", (1, 1)), ("vv", (0, 2))):
        matrix = surface.basis(u, v, order)
        assert float(matrix.to_dense().sum(-1).abs().max()) < 1e-10
        ours = torch.sparse.mm(matrix, surface.control_points.flatten(0, 1))
        torch.testing.assert_close(ours, getattr(jet, name), rtol=1e-12, atol=1e-12)
    with pytest.raises(ValueError, match="rational basis"):
        random_surface(is_rational=True).basis(u, v, (1, 0))


@pytest.mark.parametrize("is_rational", [False, True])
def test_gradients_pass_gradcheck(is_rational):
    surface = random_surface(is_rational=is_rational)
    u, v = 2.3 * uniform(4), 2.3 * uniform(4)

    def jet(control_points, u, v):
        moved = BSplineSurface(control_points, surface.degrees, surface.knots, surface.weights).jet(u, v)
        return moved.point, moved.u, moved.uv, moved.vv

    inputs = [t.clone().requires_grad_() for t in (surface.control_points, u, v)]
    assert torch.autograd.gradcheck(jet, inputs, eps=1e-6, atol=1e-5)


@pytest.mark.parametrize("is_rational", [False, True])
def test_derivatives_are_the_gradients_of_what_they_differentiate(is_rational):
    surface = random_surface(is_rational=is_rational)
    u, v = (2.3 * uniform(30)).requires_grad_(), (2.3 * uniform(30)).requires_grad_()
    jet = surface.jet(u, v)
    for value, by_u, by_v in (("point", "u", "v"), ("u", "uu", "uv"), ("v", "uv", "vv")):
        for axis in range(3):
            total = getattr(jet, value)[:, axis].sum()
            gradients = torch.autograd.grad(total, (u, v), retain_graph=True)
            for gradient, name in zip(gradients, (by_u, by_v), strict=True):
                torch.testing.assert_close(gradient, getattr(jet, name)[:, axis], rtol=1e-10, atol=1e-10)


def test_a_batch_of_control_points_equals_a_loop():
    surface = random_surface(batch=(2, 3))
    u, v = 2.3 * uniform(20), 2.3 * uniform(20)
    jet = surface.jet(u, v)
    assert jet.uv.shape == (2, 3, 20, 3)
    for i in range(2):
        for j in range(3):
            one = BSplineSurface(surface.control_points[i, j], surface.degrees, surface.knots).jet(u, v)
            torch.testing.assert_close(jet.point[i, j], one.point, rtol=0, atol=1e-15)
            torch.testing.assert_close(jet.uv[i, j], one.uv, rtol=1e-13, atol=1e-13)
    assert surface.grid(u[:4], v[:5]).shape == (2, 3, 4, 5, 3)


def test_a_rational_quarter_turn_is_an_exact_cylinder():
    root = math.sqrt(0.5)
    net = torch.tensor([[[1, 0, 0], [1, 0, 2]], [[1, 1, 0], [1, 1, 2]], [[0, 1, 0], [0, 1, 2]]]).double()
    weights = torch.tensor([[1, 1], [root, root], [1, 1]], dtype=torch.float64)
    flat = BSplineSurface.clamped(net, (2, 1))
    surface = BSplineSurface(net, (2, 1), flat.knots, weights)
    u, v = uniform(50), uniform(50)
    points, normals = surface(u, v), surface.normal(u, v)
    torch.testing.assert_close(points[:, :2].norm(dim=-1), torch.ones(50).double(), rtol=0, atol=1e-14)
    torch.testing.assert_close(normals[:, :2], points[:, :2], rtol=0, atol=1e-13)


@pytest.mark.parametrize("is_rational", [False, True])
def test_the_mirror_image_and_its_normal(is_rational):
    surface = random_surface(is_rational=is_rational)
    u, v = 2.3 * uniform(20), 2.3 * uniform(20)
    mirror = torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
    image = surface.mirrored()
    torch.testing.assert_close(image(2.3 - u, v), surface(u, v) * mirror, rtol=0, atol=1e-13)
    torch.testing.assert_close(image.normal(2.3 - u, v), surface.normal(u, v) * mirror, rtol=0, atol=1e-11)
    torch.testing.assert_close(surface.reversed().normal(2.3 - u, v), -surface.normal(u, v), rtol=0, atol=1e-11)


def test_what_does_not_fit_is_refused():
    net, knots = uniform(4, 3, 3), (random_knots(4, 3), random_knots(3, 2))
    with pytest.raises(ValueError, match="degree 3 in v is not allowed for 3 control points"):
        BSplineSurface(net, (3, 3), knots)
    with pytest.raises(ValueError, match="8 knots in u are not allowed; it needs 7"):
        BSplineSurface(net, (2, 2), knots)
    with pytest.raises(ValueError, match="knots in v are not allowed"):
        BSplineSurface(net, (3, 2), (knots[0], knots[1].flip(0)))
    with pytest.raises(ValueError, match="weights are not allowed"):
        BSplineSurface(net, (3, 2), knots, torch.zeros(4, 3).double())
    with pytest.raises(ValueError, match=r"u is not allowed; it must lie between 0 and 2\.3"):
        BSplineSurface(net, (3, 2), knots)(torch.tensor([2.4]).double(), torch.tensor([0.0]).double())
