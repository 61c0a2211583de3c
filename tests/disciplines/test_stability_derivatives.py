"""Derivatives of the lattice's coefficients against differences, lifting-line and strip theory, and symmetry."""

import math

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.cases.wings import WingMesh, WingSurface, wing_mesh
from lpc_mdo.disciplines.stability_derivatives import (
    Reference,
    lattice_coefficients,
    stability_derivatives,
)


def a_surface(root, tip, panels=(2, 8), camber="none"):
    surface = WingSurface(name="surface", camber=camber, root=root, tip=tip)
    return wing_mesh(surface, WingMesh(chordwise_panels=panels[0], spanwise_panels_half=panels[1]))


def a_fin():
    """Vertical surface behind, from z = 0 to 1.5 m."""
    x = torch.linspace(0.0, 0.8, 3, dtype=torch.float64)[:, None]
    z = torch.linspace(0.0, 1.5, 6, dtype=torch.float64)
    return torch.stack(torch.broadcast_tensors(5.0 + x, torch.zeros_like(z), z), dim=-1)


def a_reference(x=0.25, area=8.0, span=8.0):
    return Reference(number(area), number(1.0), number(span), torch.tensor([x, 0.0, 0.0], dtype=torch.float64))


def at(alpha=0.05, beta=0.0, p=0.0, q=0.0, r=0.0):
    return torch.tensor([alpha, beta, p, q, r], dtype=torch.float64)


WING = ((0, 0, 0, 1), (0, 4, 0, 1))


def test_slopes_equal_central_differences():
    meshes = [a_surface((0, 0, 0, 1), (0.3, 4, 0.3, 0.6), camber="NACA 4412"), a_fin()]
    state = at(0.05, 0.04, 0.02, 0.01, -0.03)
    ours = stability_derivatives(meshes, a_reference(), state)
    differences = central_difference(lambda s: lattice_coefficients(meshes, a_reference(), s), state, 1e-4)
    torch.testing.assert_close(ours.slope, differences, rtol=1e-7, atol=1e-9)


def test_lift_slope_is_helmbolds():
    """2 pi A/(2 + sqrt(A^2 + 4)), good to a few per cent for straight wings of aspect ratio 8."""
    slope = stability_derivatives([a_surface(*WING)], a_reference(), at()).of("lift", "angle_of_attack")
    assert float(slope) == pytest.approx(2 * math.pi * 8.0 / (2.0 + math.sqrt(68.0)), rel=0.04)


def test_neutral_point_of_a_straight_wing_is_at_the_quarter_chord():
    # Of a finite wing a little ahead of it.
    margin = stability_derivatives([a_surface(*WING)], a_reference(), at(0.01)).static_margin()
    assert float(margin) == pytest.approx(0.0, abs=0.02)


def test_moments_about_the_neutral_point_do_not_depend_on_the_angle_of_attack():
    meshes = [a_surface(*WING), a_surface((4, 0, 0.3, 0.6), (4, 1.5, 0.3, 0.6))]
    ahead = stability_derivatives(meshes, a_reference(0.25), at(0.02))
    assert float(ahead.static_margin()) > 0.3
    neutral = stability_derivatives(meshes, a_reference(0.25 + float(ahead.static_margin())), at(0.02))
    assert float(neutral.static_margin()) == pytest.approx(0.0, abs=0.005)


def test_roll_damping_of_an_elliptic_wing_is_lifting_line_theorys():
    """-(a0/8) A/(A + 4) per p b/2V: the wake takes the second harmonic of the loading twice as much as the first."""
    theta = torch.linspace(0.0, math.pi, 31, dtype=torch.float64)
    chord = (4.0 / math.pi * torch.sin(theta)).clamp(min=1e-3)
    x = torch.tensor([-0.25, 0.25, 0.75], dtype=torch.float64)[:, None] * chord
    mesh = torch.stack(torch.broadcast_tensors(x, -12.0 * torch.cos(theta), torch.zeros_like(theta)), dim=-1)
    damping = stability_derivatives([mesh], a_reference(0.0, 24.0, 24.0), at(0.0)).of("roll", "roll_rate")
    assert float(damping) == pytest.approx(-2 * math.pi / 8 * 24.0 / 28.0, rel=0.04)


def test_pitch_damping_of_a_tail_is_its_lift_slope_times_both_arms():
    """Rotation sets the angle at the three-quarter chord, the force acts at the quarter chord."""
    tail = a_surface((10, 0, 0, 0.6), (10.05, 1.5, 0, 0.4))  # straight quarter-chord line at 10.15 m
    alone = stability_derivatives([tail], a_reference(), at(0.0))
    arm = 10.15 - 0.25
    lift_slope = float(alone.of("lift", "angle_of_attack"))
    assert float(alone.of("pitch", "pitch_rate")) == pytest.approx(-2.0 * lift_slope * arm * (arm + 0.25), rel=0.01)


def test_fin_turns_the_nose_into_the_wind_and_damps_the_yaw():
    derivatives = stability_derivatives([a_surface(*WING), a_fin()], a_reference(), at())
    assert float(derivatives.of("side_force", "sideslip")) < 0.0
    assert float(derivatives.of("yaw", "sideslip")) > 0.0
    assert float(derivatives.of("yaw", "yaw_rate")) < 0.0
    assert float(derivatives.of("roll", "sideslip")) < 0.0  # the fin stands above the point


def test_dihedral_rolls_away_from_sideslip_in_proportion():
    slopes = []
    for rise in (0.1, 0.2):
        mesh = a_surface((0, 0, 0, 1), (0, 4, rise, 1))
        slopes.append(float(stability_derivatives([mesh], a_reference(), at(0.0)).of("roll", "sideslip")))
    assert slopes[0] < 0.0
    assert slopes[1] == pytest.approx(2.0 * slopes[0], rel=0.02)


def test_symmetric_aircraft_has_no_coupling():
    derivatives = stability_derivatives([a_surface(*WING), a_fin()], a_reference(), at())
    symmetric, lateral = [0, 1, 4], [2, 3, 5]
    assert float(derivatives.slope[symmetric][:, [1, 2, 4]].abs().max()) < 1e-9
    assert float(derivatives.slope[lateral][:, [0, 3]].abs().max()) < 1e-9


def test_compressibility_raises_the_lift_slope_of_a_long_wing_by_prandtl_and_glauert():
    mesh = a_surface((0, 0, 0, 1), (0, 200, 0, 1), (2, 20))
    reference = a_reference(area=400.0, span=400.0)
    slow, fast = (
        stability_derivatives([mesh], reference, at(0.01), mach=mach).of("lift", "angle_of_attack")
        for mach in (number(0.0), number(0.6))
    )
    assert float(fast / slow) == pytest.approx(1.25, rel=0.01)


def test_slopes_can_be_differentiated_with_respect_to_the_shape():
    base = a_surface(*WING, panels=(1, 3))

    def margin(x):
        mesh = base * torch.stack([torch.ones_like(x[0]), x[0], torch.ones_like(x[0])])
        tail = a_surface((4, 0, 0.3, 0.6), (4, 1.5, 0.3, 0.6), (1, 2)) + x[1] * torch.tensor([1.0, 0, 0]).double()
        return stability_derivatives([mesh, tail], a_reference(), at()).static_margin().reshape(1)

    x = torch.tensor([1.0, 0.5], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(margin, x)
    torch.testing.assert_close(exact, central_difference(margin, x, 1e-3), rtol=1e-7, atol=1e-9)
