"""Wake integrals and span loading against the near field, lifting-line theory and each other."""

import itertools
import math

import pytest
import torch
from conftest import number

from lpc_mdo.cases.wings import WingMesh, WingSurface, wing_mesh
from lpc_mdo.disciplines.far_field import far_field, span_loading
from lpc_mdo.disciplines.stability_derivatives import air_velocity
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice
from lpc_mdo.numerics.spacing import tip_inset_spacing

ORIGIN = torch.zeros(3, dtype=torch.float64)


def a_wing(panels, camber="NACA 4412", rise=0.2, half_span=4.0, tip=0.6):
    surface = WingSurface(name="wing", camber=camber, root=(0, 0, 0, 1), tip=(0.3, half_span, rise, tip))
    return wing_mesh(surface, WingMesh(chordwise_panels=panels, spanwise_panels_half=5 * panels))


def a_tail(panels, height=1.2):
    surface = WingSurface(name="tail", camber="none", root=(4.0, 0, height, 0.6), tip=(4.1, 1.5, height, 0.4))
    return wing_mesh(surface, WingMesh(chordwise_panels=panels, spanwise_panels_half=3 * panels))


def wind(alpha=0.1, beta=0.0):
    return air_velocity(number(50.0), number(alpha), number(beta))


def both_fields(meshes, velocity, **options):
    near = vortex_lattice(meshes, velocity, number(1.1), ORIGIN, has_chordwise_forces=True, **options)
    return near, far_field(near.circulation, [mesh[-1] for mesh in meshes], velocity, number(1.1), **options)


@pytest.mark.parametrize(
    ("meshes", "velocity"),
    [
        (lambda n: [a_wing(n, "none", 0.0)], wind()),
        (lambda n: [a_wing(n)], wind()),
        (lambda n: [a_wing(n, rise=0.8)], wind(beta=0.1)),
        (lambda n: [a_wing(n), a_tail(n)], wind()),
    ],
    ids=["flat", "cambered", "dihedral in sideslip", "wing and tail"],
)
def test_near_field_drag_tends_to_far_field_drag_under_refinement(meshes, velocity):
    gaps = []
    for panels in (2, 4, 8) if len(meshes(1)) == 1 else (2, 4):
        near, far = both_fields(meshes(panels), velocity)
        gaps.append(float(near.induced_drag / far.induced_drag) - 1.0)
    assert all(abs(fine) < 0.7 * abs(coarse) for coarse, fine in itertools.pairwise(gaps))
    # First order: extrapolating 2h - h leaves what is of second order.
    assert abs(2.0 * gaps[-1] - gaps[-2]) < 0.002


def test_far_field_lift_and_side_force_equal_the_near_field_to_the_order_of_the_wash():
    """The momentum integral leaves out the square of the wash, a few thousandths of the lift."""
    near, far = both_fields([a_wing(4, rise=0.8)], wind(0.05, 0.1))
    assert float(far.lift) == pytest.approx(float(near.lift), rel=0.01)
    assert float(far.side_force) == pytest.approx(float(near.side_force), abs=0.003 * float(near.lift))


def test_symmetric_half_has_the_forces_of_the_whole():
    meshes = [a_wing(2), a_tail(2)]
    halves = [mesh[:, mesh.shape[1] // 2 :] for mesh in meshes]
    near, far = both_fields(meshes, wind())
    near_half, far_half = both_fields(halves, wind(), is_symmetric=True)
    for name in ("lift", "induced_drag"):
        assert float(getattr(far_half, name)) == pytest.approx(float(getattr(far, name)), rel=1e-9)
        assert float(getattr(near_half, name)) == pytest.approx(float(getattr(near, name)), rel=1e-9)
    torch.testing.assert_close(near_half.moment, near.moment, rtol=1e-9, atol=1e-6)


def test_side_legs_shared_out_to_panels_add_up_to_the_whole_force():
    mesh = a_wing(3)
    near, _ = both_fields([mesh], wind(0.08, 0.05))
    torch.testing.assert_close(near.panel_force[0].sum((-3, -2)), near.force, rtol=1e-12, atol=1e-9)


def test_elliptic_circulation_has_span_efficiency_one():
    """Gamma = Gamma0 sqrt(1 - (y/s)^2) on a straight edge: D = pi rho Gamma0^2/8, e = 1."""
    errors = []
    for count in (100, 400):
        edge = torch.cos(torch.linspace(math.pi, 0.0, count + 1, dtype=torch.float64))
        middle = torch.cos(math.pi * (1.0 - (torch.arange(count, dtype=torch.float64) + 0.5) / count))
        line = torch.stack([torch.zeros_like(edge), 5.0 * edge, torch.zeros_like(edge)], dim=-1)
        far = far_field([torch.sqrt(1.0 - middle**2)], [line], wind(0.0), number(1.1))
        errors.append(abs(float(far.span_efficiency(number(10.0), number(1.1), number(50.0))) - 1.0))
    assert errors[1] < 0.3 * errors[0]
    assert errors[1] < 0.004


def test_induced_drag_far_behind_depends_on_no_stagger():
    """Munk: moving a lifting element along the stream at fixed circulation leaves the total induced drag unchanged."""
    circulation = [torch.ones(4, dtype=torch.float64), 2.0 * torch.ones(4, dtype=torch.float64)]
    y = torch.linspace(-2.0, 2.0, 5, dtype=torch.float64)
    zero = torch.zeros_like(y)
    velocity = wind(0.1)

    def drag(shift):
        lower = torch.stack([zero, y, zero], dim=-1)
        upper = torch.stack([zero, 0.8 * y, zero + 0.5], dim=-1) + shift * velocity / 50.0
        return far_field(circulation, [lower, upper], velocity, number(1.0)).induced_drag

    assert float(drag(3.0)) == pytest.approx(float(drag(0.0)), rel=1e-12)


def test_span_loading_adds_up_to_the_lift_and_falls_to_the_tips():
    mesh, velocity = a_wing(4, rise=0.0), wind(0.08)
    near = vortex_lattice([mesh], velocity, number(1.1), ORIGIN)
    loading = span_loading(mesh, near.panel_force[0], velocity, number(1.1))
    total = (loading.lift_per_length * loading.width).sum()
    # Lift of a swept strip is normal to its line, too: a cosine of the sweep times the angle of attack.
    assert float(total) == pytest.approx(float(near.lift), rel=2e-5)
    assert float(loading.width.sum()) == pytest.approx(8.0, rel=1e-3)
    half = loading.lift_per_length[20:]
    assert bool((half.diff() < 0.0).all())


def test_section_lift_of_a_very_long_wing_is_two_pi_alpha_everywhere_but_at_the_tips():
    mesh = a_wing(3, "none", 0.0, half_span=400.0, tip=1.0)
    velocity = wind(0.03)
    near = vortex_lattice([mesh], velocity, number(1.0), ORIGIN)
    loading = span_loading(mesh, near.panel_force[0], velocity, number(1.0))
    middle = loading.lift_coefficient[10:20]
    torch.testing.assert_close(middle, torch.full_like(middle, 2.0 * math.pi * 0.03), rtol=0.01, atol=0.0)


def test_spacing_inset_at_the_tip_converges_faster_than_uniform_spacing():
    """Rectangular wing, drag at given lift: a quarter strip kept free at the tips against strips up to the tips."""

    def drag_at_lift(edges):
        y = 4.0 * torch.cat([-edges.flip(0)[:-1], edges])
        x = torch.linspace(0.0, 1.0, 3, dtype=torch.float64)[:, None]
        mesh = torch.stack(torch.broadcast_tensors(x, y, torch.zeros_like(y)), dim=-1)
        loads = vortex_lattice([mesh], wind(0.05), number(1.0), ORIGIN)
        return float(loads.induced_drag / loads.lift**2)

    limit = 2.0 * drag_at_lift(tip_inset_spacing(80)) - drag_at_lift(tip_inset_spacing(40))
    for count in (5, 10, 20):
        uniform = torch.linspace(0.0, 1.0, count + 1, dtype=torch.float64)
        inset_error, uniform_error = (abs(drag_at_lift(e) / limit - 1.0) for e in (tip_inset_spacing(count), uniform))
        assert inset_error < 0.25 * uniform_error
