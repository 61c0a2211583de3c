"""Tails: margins by moving the centre of gravity, slopes in their limits and beside the lattice, moments and areas."""

import math

import pytest
import torch
from conftest import central_difference

from lpc_mdo.disciplines.dynamics import LateralModes, LongitudinalModes, Oscillation, Subsidence
from lpc_mdo.disciplines.flying_qualities import (
    dutch_roll_margins,
    lateral_levels,
    longitudinal_levels,
    short_period_margins,
)
from lpc_mdo.disciplines.stability_derivatives import Reference, stability_derivatives
from lpc_mdo.disciplines.tail_sizing import (
    control_moment,
    fin_yaw_stiffness,
    flap_effectiveness,
    lift_slope,
    required_area,
    static_margins,
    surface_moment,
)
from lpc_mdo.numerics.tensors import tensor


def rectangle(span, chord, x=0.0, z=0.0, strips=24, rows=4):
    y = torch.linspace(-0.5 * span, 0.5 * span, strips + 1, dtype=torch.float64)
    along = x + torch.linspace(0.0, chord, rows + 1, dtype=torch.float64)
    grid = torch.stack(torch.meshgrid(along, y, indexing="ij"), dim=-1)
    return torch.cat([grid, torch.full_like(grid[..., :1], z)], dim=-1)


def reference(x=0.5):
    return Reference(tensor(8.0), tensor(1.0), tensor(8.0), tensor([x, 0.0, 0.0]))


MESHES = [rectangle(8.0, 1.0), rectangle(2.5, 0.6, x=5.0, z=0.3)]


def test_margins_are_those_of_the_lattice_about_the_moved_point():
    state = torch.zeros(5, dtype=torch.float64)
    about = stability_derivatives(MESHES, reference(0.5), state)
    centers = tensor([0.3, 0.5, 0.8])
    found = static_margins(about, reference(0.5), centers)
    for x, margin in zip(centers.tolist(), found.tolist(), strict=True):
        moved = stability_derivatives(MESHES, reference(x), state)
        assert margin == pytest.approx(float(moved.static_margin()), abs=1e-9)
    assert found.diff().tolist() == pytest.approx([-0.2, -0.3], abs=1e-12)


def test_slope_in_its_limits():
    assert float(lift_slope(tensor(1e7))) == pytest.approx(2.0 * math.pi, rel=1e-6)
    assert float(lift_slope(tensor(1e-4))) == pytest.approx(0.5 * math.pi * 1e-4, rel=1e-6)  # slender wings
    assert float(lift_slope(tensor(1e7), 0.0, 0.6)) == pytest.approx(2.0 * math.pi / 0.8, rel=1e-6)
    assert float(lift_slope(tensor(1e7), 0.5)) == pytest.approx(2.0 * math.pi * math.cos(0.5), rel=1e-6)


@pytest.mark.parametrize("aspect_ratio", [2.0, 4.0, 8.0])
def test_slope_is_near_that_of_the_lattice(aspect_ratio):
    """The formula is Helmbold's, of elliptical wings; rectangular ones have up to 5 % less."""
    mesh = rectangle(aspect_ratio, 1.0)
    of = Reference(tensor(aspect_ratio), tensor(1.0), tensor(aspect_ratio), tensor([0.25, 0.0, 0.0]))
    lattice = stability_derivatives([mesh], of, torch.zeros(5, dtype=torch.float64)).of("lift", "angle_of_attack")
    assert 1.0 < float(lift_slope(tensor(aspect_ratio)) / lattice) < 1.055


def test_flaps_of_no_chord_do_nothing_and_of_all_chord_turn_the_wing():
    found = flap_effectiveness(tensor([1e-9, 0.25, 0.5, 1.0 - 1e-9]))
    # A quarter of the chord: 1/3 + sqrt(3)/(2 pi).
    known = [0.0, 1.0 / 3.0 + math.sqrt(3.0) / (2.0 * math.pi), 0.5 + 1.0 / math.pi, 1.0]
    assert found.tolist() == pytest.approx(known, abs=1e-4)


def test_a_fin_of_the_required_area_gives_the_moment():
    pressure, slope, arm = tensor(1800.0), lift_slope(tensor(1.8)), tensor(4.5)
    per_area = control_moment(pressure, tensor(1.0), slope, arm, tensor(0.35), tensor(0.3))
    for moment in (2000.0, -2000.0):
        area = required_area(tensor(moment), per_area)
        given = control_moment(pressure, area, slope, arm, tensor(0.35), tensor(0.3))
        assert float(given) == pytest.approx(2000.0, rel=1e-10)
    assert float(required_area(tensor(0.0), per_area)) < 1e-8


def test_yaw_stiffness_is_the_fins_moment_by_sideslip():
    area, slope, arm = tensor(2.5), tensor(2.2), tensor(5.0)
    moment = surface_moment(tensor(1500.0), area, slope, tensor(0.1), arm)
    stiffness = fin_yaw_stiffness(area, slope, arm, reference())
    assert float(stiffness) * 0.1 * 1500.0 * 8.0 * 8.0 == pytest.approx(float(moment), rel=1e-12)


def pair(ratio, frequency):
    root = complex(-ratio * frequency, frequency * math.sqrt(1.0 - ratio**2))
    return Oscillation(torch.tensor([root, root.conjugate()], dtype=torch.complex128))


def test_margins_are_positive_where_level_one_is_met_and_only_there():
    rest = Subsidence(torch.tensor(-2.0 + 0.0j, dtype=torch.complex128))
    for ratio, frequency in ((0.1, 2.0), (0.07, 3.0), (0.1, 1.0), (0.5, 0.3), (0.5, 0.5)):
        modes = LateralModes(pair(ratio, frequency), rest, rest)
        is_first = int(lateral_levels(modes).dutch_roll) == 1
        assert bool((dutch_roll_margins(modes) >= 0.0).all()) == is_first
    for ratio, frequency, sensitivity in ((0.5, 2.0, 5.0), (0.2, 2.0, 5.0), (0.5, 0.3, 5.0), (0.5, 6.0, 5.0)):
        modes = LongitudinalModes(pair(ratio, frequency), pair(0.1, 0.1))
        levels = longitudinal_levels(modes, tensor(sensitivity))
        is_first = int(levels.short_period_damping) == int(levels.control_anticipation) == 1
        assert bool((short_period_margins(modes, tensor(sensitivity)) >= 0.0).all()) == is_first


def test_gradients_equal_central_differences():
    def numbers(x):
        slope = lift_slope(2.0 * x[0], 0.2 * x[1], 0.2 * x[2])
        moment = control_moment(x[3], x[0], slope, 4.0 * x[1], 0.3 * x[2], 0.3 * x[3])
        return torch.stack([slope, moment, required_area(moment - 2.0, x[2]), flap_effectiveness(0.4 * x[1])])

    x = torch.ones(4, dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(numbers, x)
    torch.testing.assert_close(exact, central_difference(numbers, x, 1e-3), rtol=1e-8, atol=1e-9)
