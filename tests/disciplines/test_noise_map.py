"""Directivity and ground contours: symmetry, distance laws, and the same levels as observer by observer."""

import math
from dataclasses import fields

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.disciplines.absorption import atmospheric_absorption
from lpc_mdo.disciplines.hover_noise import hover_noise
from lpc_mdo.disciplines.noise_map import (
    OBSERVERS_AT_ONCE,
    HoverSource,
    ground_contour,
    ground_points,
    heard_levels,
    hover_directivity,
    sphere_points,
)
from lpc_mdo.disciplines.tonal_noise import BladeLoading, barry_magliozzi
from lpc_mdo.disciplines.unsteady_loading_noise import lowson_noise

BELOW = math.pi


def grid(low, high, count):
    return torch.linspace(low, high, count, dtype=torch.float64)


def humid(frequency):
    return atmospheric_absorption(frequency, number(288.15), number(101325.0), number(0.7))


def a_source(load=1.0, hubs=None):
    """Eight rotors of 3 m in two rows, symmetric to y = 0; or others at `hubs` (rotor, 3)."""
    if hubs is None:
        places = [(x, s * y, 2.0) for x in (-2.2, 2.2) for y in (2.3, 5.0) for s in (-1.0, 1.0)]
        hubs = torch.tensor(places, dtype=torch.float64)
    r = grid(0.35, 1.5, 12).expand(len(hubs), -1)
    shape = load * r**2 / (r**2).sum(-1, keepdim=True) / (r[:, 1:2] - r[:, :1])
    one = torch.ones(len(hubs), dtype=torch.float64)
    loading = BladeLoading(
        r, r[:, 1:2] - r[:, :1], 4000.0 * shape, 600.0 * shape, 0.2 * torch.ones_like(r), 0.12,
        torch.full_like(r, 0.1), 2.0 * one, 115.0 * one, 1.2 * one, 340.0 * one,
    )  # fmt: skip
    return HoverSource(loading, 4000.0 * load * one, 1.5 * one, torch.full_like(r, 0.08), hubs)


def test_observers_in_one_batch_hear_what_each_hears_alone():
    source = a_source()
    observers = sphere_points(source.hubs.mean(0), 60.0, grid(0.0, BELOW, 4), grid(0.0, 2 * BELOW, 3))
    together = heard_levels(source, observers)
    assert together.shape == (4, 3)
    for level, observer in zip(together.flatten(), observers.reshape(-1, 3), strict=True):
        alone = hover_noise(
            source.loading, source.thrust, source.radius, source.angle_of_attack, source.hubs, observer
        ).total_dba
        assert float(level) == pytest.approx(float(alone), abs=1e-10)


def test_a_grid_larger_than_one_portion_is_whole():
    source = a_source(hubs=torch.zeros(1, 3, dtype=torch.float64))
    count = OBSERVERS_AT_ONCE + 7
    levels = heard_levels(source, ground_points(source.hubs[0], 50.0, grid(-80.0, 80.0, count), grid(0.0, 0.0, 1)))
    torch.testing.assert_close(levels, levels.flip(0), rtol=0.0, atol=1e-9)


def test_a_batch_of_designs_follows_the_observers():
    light, heavy = a_source(0.5), a_source(1.0)
    loading = {
        field.name: getattr(light.loading, field.name)
        if field.name == "thickness_to_chord"
        else torch.stack([getattr(light.loading, field.name), getattr(heavy.loading, field.name)])
        for field in fields(BladeLoading)
    }
    both = HoverSource(
        BladeLoading(**loading),
        *(
            torch.stack([getattr(light, name), getattr(heavy, name)])
            for name in ("thrust", "radius", "angle_of_attack", "hubs")
        ),
    )
    observers = sphere_points(number(0.0), 70.0, grid(1.8, 2.9, 3), grid(0.0, 1.0, 2))
    levels = heard_levels(both, observers)
    assert levels.shape == (3, 2, 2)
    torch.testing.assert_close(levels[..., 0], heard_levels(light, observers), rtol=0.0, atol=1e-10)
    torch.testing.assert_close(levels[..., 1], heard_levels(heavy, observers), rtol=0.0, atol=1e-10)


def test_directivity_of_one_rotor_has_its_axis_as_axis_of_symmetry():
    source = a_source(hubs=torch.tensor([[3.0, -1.0, 2.0]], dtype=torch.float64))
    levels = hover_directivity(source, 50.0, grid(0.1, 3.0, 7), grid(0.0, 6.0, 5), lowson_noise)
    torch.testing.assert_close(levels, levels[:, :1].expand_as(levels), rtol=0.0, atol=1e-9)


def test_directivity_of_a_symmetric_aircraft_is_symmetric_and_covers_the_sphere():
    polar, azimuth = grid(0.0, BELOW, 9), grid(-2.0, 2.0, 5)
    levels = hover_directivity(a_source(), 76.2, polar, azimuth)
    assert levels.shape == (9, 5)
    assert bool(levels.isfinite().all())
    torch.testing.assert_close(levels, levels.flip(1), rtol=0.0, atol=1e-9)
    # At the poles all azimuths are one point.
    torch.testing.assert_close(levels[[0, -1]], levels[[0, -1], :1].expand(2, 5), rtol=0.0, atol=1e-9)


def test_broadband_is_loudest_on_the_axis_and_quietest_in_the_disk_plane():
    # Weighted, the broadband dipole rules: |sin| of the elevation from the disk plane.
    levels = hover_directivity(a_source(), 76.2, torch.tensor([0.5, 1.0]).double() * BELOW, grid(0.0, 0.0, 1))
    assert float(levels[1, 0] - levels[0, 0]) > 6.0


def test_unsteady_tones_fill_the_silence_below_and_change_little_near_the_disk():
    source, polar = a_source(), torch.tensor([BELOW, math.radians(100.0)], dtype=torch.float64)
    observers = sphere_points(source.hubs.mean(0), 76.2, polar, grid(0.0, 0.0, 1))[:, 0]
    steady, unsteady = (
        hover_noise(
            source.loading, source.thrust, source.radius, source.angle_of_attack, source.hubs, observers,
            tonal_model=model,
        ).tonal_dba
        for model in (barry_magliozzi, lowson_noise)
    )  # fmt: skip
    assert float(unsteady[0] - steady[0]) > 30.0
    assert 0.0 < float(unsteady[1] - steady[1]) < 1.0


def test_sphere_and_ground_points_lie_where_they_should():
    center = torch.tensor([1.0, 2.0, 3.0], dtype=torch.float64)
    points = sphere_points(center, 10.0, grid(0.0, BELOW, 3), grid(0.0, 0.5 * BELOW, 2))
    assert (points[0, 0] - center).tolist() == pytest.approx([0.0, 0.0, 10.0], abs=1e-12)  # above
    assert (points[2, 0] - center).tolist() == pytest.approx([0.0, 0.0, -10.0], abs=1e-12)  # below
    assert (points[1, 0] - center).tolist() == pytest.approx([-10.0, 0.0, 0.0], abs=1e-12)  # ahead: x points aft
    assert (points[1, 1] - center).tolist() == pytest.approx([0.0, 10.0, 0.0], abs=1e-12)  # starboard
    ground = ground_points(center, 20.0, grid(-5.0, 5.0, 3), grid(0.0, 4.0, 2))
    assert ground[0, 1].tolist() == [-4.0, 6.0, -17.0]


def test_contour_is_symmetric_loudest_near_below_and_falls_outwards():
    levels = ground_contour(a_source(), 76.2, grid(-300.0, 300.0, 13), grid(-300.0, 300.0, 13), absorption=humid)
    torch.testing.assert_close(levels, levels.flip(1), rtol=0.0, atol=1e-9)
    torch.testing.assert_close(levels, levels.flip(0), rtol=0.0, atol=1e-9)
    outwards = levels[6, 7:]
    assert bool((outwards.diff() < 0.0).all())
    assert int(levels.argmax()) == 6 * 13 + 6


def test_doubling_height_and_grid_lowers_one_rotors_contour_by_six_decibels():
    source = a_source(hubs=torch.zeros(1, 3, dtype=torch.float64))
    near = ground_contour(source, 50.0, grid(-80.0, 80.0, 4), grid(-80.0, 80.0, 3))
    far = ground_contour(source, 100.0, grid(-160.0, 160.0, 4), grid(-160.0, 160.0, 3))
    torch.testing.assert_close(near - far, torch.full_like(near, 20 * math.log10(2)), rtol=0.0, atol=1e-4)


def test_absorption_takes_more_from_observers_further_below_and_never_adds():
    # Far out on the ground low tones rule and lose little; straight below the broadband's share stays.
    source, zero = a_source(), grid(0.0, 0.0, 1)
    loss = [
        float(ground_contour(source, h, zero, zero) - ground_contour(source, h, zero, zero, absorption=humid))
        for h in (40.0, 80.0, 160.0, 320.0)
    ]
    assert 0.1 < loss[0] < loss[1] < loss[2] < loss[3]
    aft = grid(0.0, 1000.0, 5)
    assert bool(
        (ground_contour(source, 76.2, aft, zero) > ground_contour(source, 76.2, aft, zero, absorption=humid)).all()
    )


def test_equal_absorption_of_all_frequencies_lowers_every_level_by_rate_times_path():
    source = a_source(hubs=torch.zeros(1, 3, dtype=torch.float64))
    observers = torch.tensor([[0.0, 0.0, -100.0], [30.0, 40.0, -120.0]], dtype=torch.float64)
    loss = heard_levels(source, observers) - heard_levels(
        source, observers, absorption=lambda f: torch.full_like(f, 0.02)
    )
    assert loss.tolist() == pytest.approx([2.0, 2.6], abs=1e-6)


def test_gradient_equals_central_differences():
    def levels(x):
        source = a_source(load=x[0])
        points = source.hubs.mean(0) + torch.stack([x[1], 0.3 * x[1], -x[2]])
        return heard_levels(source, points[None], lowson_noise, humid)

    x = torch.tensor([1.0, 30.0, 70.0], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(levels, x)
    torch.testing.assert_close(exact, central_difference(levels, x, 1e-3), rtol=1e-6, atol=1e-8)
