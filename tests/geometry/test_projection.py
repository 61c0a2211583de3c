"""Projection onto B-spline surfaces: no failures, points on the surface recovered, true minima, closed forms."""

import math

import pytest
import torch

from lpc_mdo.config import load
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine
from lpc_mdo.geometry.projection import closest_point, project_along
from lpc_mdo.geometry.surfaces import BSplineSurface

MOLD = OuterMoldLine(load()[0])


def generator(seed):
    return torch.Generator().manual_seed(seed)


def uniform(*shape, seed):
    return torch.rand(*shape, dtype=torch.float64, generator=generator(seed))


def surface_of(name):
    return MOLD.patches[name].surface


def quarter_cylinder():
    """Radius 1 about z, 2 long, in the first quadrant: exact as a rational surface."""
    net = torch.tensor([[[1, 0, 0], [1, 0, 2]], [[1, 1, 0], [1, 1, 2]], [[0, 1, 0], [0, 1, 2]]]).double()
    weights = torch.tensor([[1, 1], [math.sqrt(0.5)] * 2, [1, 1]], dtype=torch.float64)
    plain = BSplineSurface.clamped(net, (2, 1))
    return BSplineSurface(net, (2, 1), plain.knots, weights)


def around(surface, count, seed):
    """Points in the surface's box, widened by a third of its diagonal."""
    net = surface.control_points.flatten(0, 1)
    low, high = net.amin(0), net.amax(0)
    margin = torch.linalg.vector_norm(high - low) / 3.0
    return low - margin + (high - low + 2.0 * margin) * uniform(count, 3, seed=seed)


@pytest.mark.parametrize(("name", "count"), [("wing_upper", 50_000), ("fuselage", 50_000)])
def test_random_points_are_projected_without_a_failure(name, count):
    surface = surface_of(name)
    found = closest_point(surface, around(surface, count, seed=1))
    assert bool(found.is_converged.all())
    assert float(found.residual.max()) <= 1e-8


@pytest.mark.parametrize("name", ["wing_upper", "fuselage", "horizontal_tail_lower"])
def test_points_on_the_surface_are_recovered(name):
    surface = surface_of(name)
    u, v = uniform(2, 20_000, seed=2)
    points = surface(u, v)
    found = closest_point(surface, points)
    assert float(torch.linalg.vector_norm(found.point - points, dim=-1).max()) <= 1e-10


def test_points_by_the_nose_are_recovered_though_the_whole_edge_is_one_point():
    surface = surface_of("fuselage")
    u, v = 10.0 ** (-12.0 * uniform(2000, seed=3) - 1.0), uniform(2000, seed=4)
    points = surface(u, v)
    found = closest_point(surface, points)
    assert float(torch.linalg.vector_norm(found.point - points, dim=-1).max()) <= 1e-10
    nose = surface(torch.zeros(1).double(), torch.zeros(1).double())
    ahead = closest_point(surface, nose - torch.tensor([[1.0, 0.0, 0.0]]).double())
    assert bool(ahead.is_converged.all())


@pytest.mark.parametrize("name", ["wing_upper", "fuselage"])
def test_no_sample_of_the_surface_is_closer_than_the_projection(name):
    surface = surface_of(name)
    points = around(surface, 500, seed=5)
    found = closest_point(surface, points)
    grid = torch.linspace(0.0, 1.0, 201, dtype=torch.float64)
    samples = surface.grid(grid, grid).flatten(0, 1)
    nearest = torch.cat([torch.cdist(chunk, samples).amin(-1) for chunk in points.split(100)])
    assert bool((found.distance <= nearest + 1e-6).all())  # cdist rounds at 1e-7


def test_offset_points_return_to_their_foot_along_the_normal():
    surface = surface_of("wing_upper")
    u, v = 0.1 + 0.8 * uniform(2, 2000, seed=6)
    foot, normal = surface(u, v), surface.normal(u, v)
    found = closest_point(surface, foot + 0.05 * normal)
    torch.testing.assert_close(found.point, foot, rtol=0, atol=1e-8)
    torch.testing.assert_close(found.distance, torch.full_like(u, 0.05), rtol=0, atol=1e-10)


def test_a_rational_cylinder_gives_the_closed_form():
    surface = quarter_cylinder()
    angle, radius = 0.5 * math.pi * uniform(2000, seed=7), 0.2 + 2.0 * uniform(2000, seed=8)
    height = 2.0 * uniform(2000, seed=9)
    circle = torch.stack([torch.cos(angle), torch.sin(angle)], dim=-1)
    found = closest_point(surface, torch.cat([radius[:, None] * circle, height[:, None]], dim=-1))
    torch.testing.assert_close(found.point, torch.cat([circle, height[:, None]], -1), rtol=0, atol=1e-9)
    torch.testing.assert_close(found.distance, (radius - 1.0).abs(), rtol=0, atol=1e-10)


def test_lines_meet_the_surface_where_they_left_it():
    surface, up = surface_of("wing_upper"), torch.tensor([0.0, 0.0, 2.0], dtype=torch.float64)
    u, v = 0.02 + 0.96 * uniform(2, 5000, seed=10)
    points = surface(u, v)
    shifted = points + (4.0 * uniform(5000, 1, seed=11) - 2.0) * up
    found = project_along(surface, shifted, up)
    assert bool(found.is_converged.all())
    assert float(found.distance.max()) < 1e-8
    torch.testing.assert_close(found.point, points, rtol=0, atol=1e-7)  # the nose is steep: along z by 1e-8 across


def test_of_two_crossings_the_nearest_is_taken_and_a_miss_gives_the_gap():
    surface, up = surface_of("fuselage"), torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
    points = torch.tensor([[3.0, 0.0, 5.0], [3.0, 0.0, -5.0], [3.0, 2.0, 0.0]], dtype=torch.float64)
    found = project_along(surface, points, up)
    assert float(found.point[0, 2]) > float(found.point[1, 2]) + 1.0
    assert float(found.distance[2]) == pytest.approx(float((found.point[2] - points[2])[:2].norm()), abs=1e-9)


def test_what_cannot_be_projected_is_refused():
    surface = surface_of("wing_upper")
    points = torch.zeros(2, 3, dtype=torch.float64)
    with pytest.raises(ValueError, match="direction is not allowed"):
        project_along(surface, points, torch.zeros(3, dtype=torch.float64))
    with pytest.raises(ValueError, match="points are not allowed; all must be finite"):
        closest_point(surface, points * torch.nan)
    with pytest.raises(ValueError, match="a batch is not allowed"):
        closest_point(surface, points[None])
