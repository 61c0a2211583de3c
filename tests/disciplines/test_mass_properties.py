"""Mass properties: the parallel-axis theorem against clouds of point masses, and invariances."""

import math

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.disciplines.mass_properties import combine, point_inertia


def cloud(points=60, seed=4):
    """Random point masses: mass (point,), position (point, 3)."""
    generator = torch.Generator().manual_seed(seed)
    mass = 1.0 + 50.0 * torch.rand(points, generator=generator, dtype=torch.float64)
    return mass, torch.randn(points, 3, generator=generator, dtype=torch.float64) * torch.tensor(
        [4.0, 6.0, 1.0]
    ).double()


def as_points(mass, position):
    return combine(mass, position, torch.zeros(*mass.shape, 3, 3, dtype=torch.float64))


def rotation(seed=9):
    generator = torch.Generator().manual_seed(seed)
    q, r = torch.linalg.qr(torch.randn(3, 3, generator=generator, dtype=torch.float64))
    q = q * torch.sign(torch.diagonal(r))
    return q * torch.linalg.det(q)


def test_inertia_is_the_kinetic_energy_of_rotation():
    """w.I.w/2 about the centre of gravity = sum of m |w x r|^2/2."""
    mass, position = cloud()
    total = as_points(mass, position)
    arm = position - (mass[:, None] * position).sum(0) / mass.sum()
    for rate in torch.eye(3, dtype=torch.float64).tolist() + [[0.3, -1.2, 0.7]]:
        w = torch.tensor(rate, dtype=torch.float64)
        energy = 0.5 * (mass * torch.linalg.cross(w.expand_as(arm), arm).square().sum(-1)).sum()
        assert float(0.5 * w @ total.inertia @ w) == pytest.approx(float(energy), rel=1e-12)


def test_components_add_as_their_points_do():
    """Parallel-axis theorem: bodies of many points each, combined from their own inertias, equal all points at once."""
    mass, position = cloud(60)
    bodies = [as_points(mass[i : i + 12], position[i : i + 12]) for i in range(0, 60, 12)]
    stacked = (torch.stack([getattr(b, f) for b in bodies]) for f in ("mass", "center_of_gravity", "inertia"))
    together, at_once = combine(*stacked), as_points(mass, position)
    torch.testing.assert_close(together.mass, mass.sum(), rtol=1e-14, atol=0.0)
    torch.testing.assert_close(together.center_of_gravity, at_once.center_of_gravity, rtol=1e-12, atol=1e-12)
    torch.testing.assert_close(together.inertia, at_once.inertia, rtol=1e-12, atol=1e-8)


def test_a_rod_of_points_tends_to_one_twelfth_of_mass_times_squared_length():
    n, length = 2001, 6.0
    y = torch.linspace(-0.5 * length, 0.5 * length, n, dtype=torch.float64)
    rod = as_points(number(30.0 / n).expand(n), torch.stack([0 * y + 2.0, y + 5.0, 0 * y - 1.0], dim=-1))
    # n points: m l^2/12 (n + 1)/(n - 1).
    expected = 30.0 * length**2 / 12 * (n + 1) / (n - 1)
    assert float(rod.inertia[0, 0]) == pytest.approx(expected, rel=1e-10)
    assert float(rod.inertia[2, 2]) == pytest.approx(expected, rel=1e-10)
    assert float(rod.inertia[1, 1]) == pytest.approx(0.0, abs=1e-9)


def test_a_dumbbell_turns_with_its_reduced_mass():
    bell = as_points(torch.tensor([2.0, 3.0]).double(), torch.tensor([[0.0, 0.0, 0.0], [0.0, 0.0, 5.0]]).double())
    assert float(bell.center_of_gravity[2]) == pytest.approx(3.0, rel=1e-15)
    assert float(bell.inertia[0, 0]) == pytest.approx(2.0 * 3.0 / 5.0 * 25.0, rel=1e-14)


def test_products_of_inertia_carry_the_minus_sign():
    one = point_inertia(number(2.0), torch.tensor([1.0, 0.0, 3.0], dtype=torch.float64))
    assert one.tolist() == [[18.0, 0.0, -6.0], [0.0, 20.0, 0.0], [-6.0, 0.0, 2.0]]


def test_inertia_about_the_centre_of_gravity_does_not_depend_on_the_origin():
    mass, position = cloud()
    shift = torch.tensor([30.0, -20.0, 10.0], dtype=torch.float64)
    here, there = as_points(mass, position), as_points(mass, position + shift)
    torch.testing.assert_close(there.inertia, here.inertia, rtol=1e-11, atol=1e-7)
    torch.testing.assert_close(there.center_of_gravity, here.center_of_gravity + shift, rtol=1e-13, atol=0.0)


def test_turning_the_aircraft_turns_its_inertia_and_keeps_the_principal_moments():
    mass, position = cloud()
    turn = rotation()
    one, other = as_points(mass, position), as_points(mass, position @ turn.T)
    torch.testing.assert_close(other.inertia, turn @ one.inertia @ turn.T, rtol=1e-11, atol=1e-8)
    principal = torch.linalg.eigvalsh(one.inertia)
    torch.testing.assert_close(torch.linalg.eigvalsh(other.inertia), principal, rtol=1e-11, atol=0.0)


def test_principal_moments_are_positive_and_obey_the_triangle_inequality():
    for seed in range(20):
        inertia = as_points(*cloud(8, seed)).inertia
        torch.testing.assert_close(inertia, inertia.T, rtol=0.0, atol=1e-10)
        a, b, c = torch.linalg.eigvalsh(inertia).tolist()
        assert 0.0 < a <= b <= c < a + b


def test_mirror_symmetric_aircraft_has_its_centre_and_one_axis_in_the_plane_of_symmetry():
    mass, position = cloud()
    both = torch.cat([position, position * torch.tensor([1.0, -1.0, 1.0]).double()])
    total = as_points(torch.cat([mass, mass]), both)
    assert float(total.center_of_gravity[1]) == pytest.approx(0.0, abs=1e-13)
    assert float(total.inertia[0, 1].abs() + total.inertia[1, 2].abs()) < 1e-9


def test_mass_at_the_centre_of_gravity_adds_weight_but_no_inertia():
    mass, position = cloud()
    base = as_points(mass, position)
    more = as_points(torch.cat([mass, number(500.0)[None]]), torch.cat([position, base.center_of_gravity[None]]))
    assert float(more.mass - base.mass) == pytest.approx(500.0, rel=1e-12)
    torch.testing.assert_close(more.center_of_gravity, base.center_of_gravity, rtol=1e-12, atol=1e-12)
    torch.testing.assert_close(more.inertia, base.inertia, rtol=1e-11, atol=1e-8)


def test_gradient_equals_central_differences():
    mass, position = cloud(4)
    own = torch.diag_embed(torch.rand(4, 3, generator=torch.Generator().manual_seed(2), dtype=torch.float64))

    def properties(x):
        total = combine(mass * x[:4], position * x[4:8, None], own * x[8])
        return torch.cat([total.mass[None], total.center_of_gravity, total.inertia.flatten() / 100])

    x = torch.ones(9, dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(properties, x)
    torch.testing.assert_close(exact, central_difference(properties, x, 1e-3), rtol=1e-9, atol=1e-9)


def test_a_batch_of_aircraft_equals_a_loop():
    mass, position = cloud(6)
    scale = torch.tensor([0.5, 1.0, 3.0], dtype=torch.float64)
    batch = combine(scale[:, None] * mass, position.expand(3, 6, 3), torch.zeros(3, 6, 3, 3).double())
    assert math.isclose(float(batch.mass[2]), 3.0 * float(mass.sum()), rel_tol=1e-13)
    for i in range(3):
        one = as_points(scale[i] * mass, position)
        torch.testing.assert_close(batch.inertia[i], one.inertia, rtol=1e-12, atol=1e-8)
