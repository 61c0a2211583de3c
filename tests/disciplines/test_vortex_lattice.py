"""Vortex lattice against OpenAerostruct at equal mesh, theory, symmetry and differences."""

import math

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.cases.wings import WingInputs, WingMesh, WingSurface, analyze_wing, wing_mesh
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice

ORIGIN = torch.zeros(3, dtype=torch.float64)
CASES = ["vlm_rect_ar8_flat", "vlm_rect_ar8_naca4412", "vlm_lpc_flat", "vlm_lpc_naca4412"]


def stream(alpha, beta=0.0, speed=50.0):
    return speed * torch.tensor(
        [math.cos(alpha) * math.cos(beta), -math.sin(beta), math.sin(alpha) * math.cos(beta)], dtype=torch.float64
    )


def a_wing(chordwise=3, spanwise=8, half_span=4.0, tip=0.6, camber="NACA 4412"):
    surface = WingSurface(name="wing", camber=camber, root=(0, 0, 0, 1), tip=(0.3, half_span, 0.2, tip))
    return wing_mesh(surface, WingMesh(chordwise_panels=chordwise, spanwise_panels_half=spanwise))


@pytest.mark.parametrize("name", CASES)
def test_coefficients_equal_openaerostruct_at_equal_mesh(reference, name):
    # The same lattice once wakes have no core, so the tolerance is the eight digits of the file.
    case = reference(name)
    for mesh in case["results"]["OpenAerostruct 2.12.0"]["meshes"]:
        angles = [[r["alpha_deg"], r["beta_deg"]] for r in mesh["results"]]
        inputs = WingInputs.model_validate(case["inputs"] | {"conditions_alpha_beta_deg": angles})
        panels = WingMesh(**{k: mesh[k] for k in WingMesh.model_fields if k in mesh}, wake_core=0.0)
        for ours, theirs in zip(analyze_wing(inputs, [], panels), mesh["results"], strict=True):
            for key in ("CL", "CDi", "Cm", "Cl_roll_body", "Cn_body"):
                assert ours[key] == pytest.approx(theirs[key], rel=1e-5, abs=1e-9), (key, theirs["alpha_deg"])


@pytest.mark.parametrize("name", CASES)
def test_coefficients_in_sideslip_equal_openaerostruct_at_equal_mesh(reference, name):
    # The same lattice and wake; eight digits of the file.
    for theirs in reference("vlm_sideslip")["results"][name]:
        angles = [[theirs["alpha_deg"], theirs["beta_deg"]]]
        inputs = WingInputs.model_validate(reference(name)["inputs"] | {"conditions_alpha_beta_deg": angles})
        panels = WingMesh(**{k: theirs[k] for k in WingMesh.model_fields if k in theirs}, wake_core=0.0)
        (ours,) = analyze_wing(inputs, [], panels)
        for key in ("CL", "CDi", "Cm", "Cl_roll_body", "Cn_body"):
            assert ours[key] == pytest.approx(theirs[key], rel=1e-5, abs=1e-9), key


def test_tips_roll_a_straight_wing_away_from_sideslip():
    """The chordwise legs' force does it: more lift on the tip that leads; without it the skewed wake decides alone."""
    surface = WingSurface(name="wing", camber="none", root=(0, 0, 0, 1), tip=(0, 4, 0, 1))
    mesh = wing_mesh(surface, WingMesh(chordwise_panels=4, spanwise_panels_half=10))
    rolls = [
        -float(vortex_lattice([mesh], stream(a, 0.1), number(1.0), ORIGIN, has_chordwise_forces=True).moment[0])
        for a in (0.05, 0.1)
    ]
    assert rolls[0] < 0.0
    assert rolls[1] == pytest.approx(2.0 * rolls[0], rel=0.02)


@pytest.mark.parametrize("name", ["vlm_rect_ar8_flat", "vlm_lpc_flat"])
def test_refinement_tends_to_the_richardson_limit(reference, name):
    # Uniform meshes converge at first order: extrapolate 2h - h.
    case = reference(name)
    inputs = WingInputs.model_validate(case["inputs"])
    coarse, fine = (analyze_wing(inputs, [], WingMesh(chordwise_panels=n, spanwise_panels_half=5 * n)) for n in (3, 6))
    for a, b, limit in zip(coarse, fine, case["results"]["OpenAerostruct 2.12.0"]["richardson"], strict=True):
        if abs(limit["CL"]) > 1e-6:
            assert 2 * b["CL"] - a["CL"] == pytest.approx(limit["CL"], rel=0.01)
            assert 2 * b["CDi"] - a["CDi"] == pytest.approx(limit["CDi"], rel=0.01)


def test_elliptic_wing_has_the_induced_drag_of_lifting_line_theory():
    # CDi = CL^2/(pi AR) for elliptic chord at high aspect ratio; cosine spacing keeps the tip resolved.
    theta = torch.linspace(0, math.pi, 61, dtype=torch.float64)
    y = -10.0 * torch.cos(theta)
    chord = torch.sin(theta).clamp(min=1e-3)
    x = torch.tensor([0.0, 0.5, 1.0], dtype=torch.float64)[:, None] * chord - 0.25 * chord
    mesh = torch.stack([x, y.expand_as(x), torch.zeros_like(x)], dim=-1)
    loads = vortex_lattice([mesh], stream(0.05), number(1.2), ORIGIN)
    area = float(torch.trapezoid(chord, y))
    dynamic = 0.5 * 1.2 * 50.0**2 * area
    lift, drag = float(loads.lift) / dynamic, float(loads.induced_drag) / dynamic
    assert drag == pytest.approx(lift**2 / (math.pi * 400.0 / area), rel=0.005)


def test_lift_slope_tends_to_two_pi_with_aspect_ratio():
    mesh = a_wing(half_span=500.0, tip=1.0, camber="none", spanwise=40)
    loads = vortex_lattice([mesh], stream(0.02), number(1.0), ORIGIN)
    slope = float(loads.lift) / (0.5 * 50.0**2 * 1000.0 * 0.02)
    assert slope == pytest.approx(2 * math.pi, rel=0.02)


def test_doubling_the_speed_quadruples_the_force():
    slow, fast = (vortex_lattice([a_wing()], stream(0.1, 0.05, v), number(1.0), ORIGIN) for v in (30.0, 60.0))
    torch.testing.assert_close(fast.force, 4.0 * slow.force, rtol=1e-12, atol=1e-9)


def test_mirrored_sideslip_gives_mirrored_loads():
    left, right = (vortex_lattice([a_wing()], stream(0.1, b), number(1.0), ORIGIN) for b in (-0.1, 0.1))
    mirror = torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
    torch.testing.assert_close(left.force, right.force * mirror, rtol=1e-8, atol=1e-7)
    torch.testing.assert_close(left.moment, -right.moment * mirror, rtol=1e-8, atol=1e-7)


def test_symmetric_half_model_equals_the_whole():
    tail = a_wing(2, 4, 1.5, 0.6, "none") + torch.tensor([5.0, 0.0, -0.2], dtype=torch.float64)
    meshes = [a_wing(), tail]
    halves = [mesh[:, mesh.shape[1] // 2 :] for mesh in meshes]
    whole = vortex_lattice(meshes, stream(0.08), number(1.1), ORIGIN)
    half = vortex_lattice(halves, stream(0.08), number(1.1), ORIGIN, is_symmetric=True)
    torch.testing.assert_close(half.force, whole.force, rtol=1e-8, atol=1e-6)
    torch.testing.assert_close(half.moment, whole.moment, rtol=1e-8, atol=1e-6)


def test_loads_do_not_depend_on_where_the_origin_lies():
    shift = torch.tensor([3.0, -2.0, 1.0], dtype=torch.float64)
    here = vortex_lattice([a_wing()], stream(0.1, 0.05), number(1.0), ORIGIN)
    there = vortex_lattice([a_wing() + shift], stream(0.1, 0.05), number(1.0), shift)
    torch.testing.assert_close(there.force, here.force, rtol=1e-8, atol=1e-7)
    torch.testing.assert_close(there.moment, here.moment, rtol=1e-8, atol=1e-7)


def test_a_batch_of_conditions_equals_a_loop():
    winds = torch.stack([stream(a, b) for a, b in ((0.0, 0.0), (0.1, 0.0), (0.05, 0.1))])
    batch = vortex_lattice([a_wing()], winds, number(1.0), ORIGIN)
    for i, wind in enumerate(winds):
        one = vortex_lattice([a_wing()], wind, number(1.0), ORIGIN)
        torch.testing.assert_close(batch.force[i], one.force, rtol=1e-10, atol=1e-9)


def test_gradient_with_respect_to_shape_and_stream_equals_central_differences():
    base = a_wing(2, 2)

    def loads(x):
        mesh = base * torch.stack([x[0], x[1], torch.ones_like(x[0])])
        wind = torch.stack([50.0 * torch.cos(x[2]), 0 * x[2], 50.0 * torch.sin(x[2])])
        result = vortex_lattice([mesh], wind, number(1.0), ORIGIN)
        return torch.stack([result.lift, result.induced_drag, result.moment[1]])

    x = torch.tensor([1.1, 0.9, 0.07], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(loads, x)
    torch.testing.assert_close(exact, central_difference(loads, x, 1e-4), rtol=1e-7, atol=1e-5)


def small_loads(mesh, wind, **options):
    loads = vortex_lattice([mesh], wind, number(1.2), torch.tensor([0.2, 0.0, 0.1], dtype=torch.float64), **options)
    return loads.force, loads.moment, loads.circulation[0]


@pytest.mark.parametrize("options", [{}, {"is_symmetric": True}, {"mach": number(0.3)}])
def test_first_and_second_derivatives_pass_gradcheck(options):
    mesh = a_wing(2, 2)
    if "is_symmetric" in options:
        mesh = mesh[:, 2:]
    wind = stream(0.06, 0.0 if "is_symmetric" in options else 0.05, 1.0)
    inputs = (mesh.requires_grad_(), wind.requires_grad_())
    assert torch.autograd.gradcheck(lambda *x: small_loads(*x, **options), inputs)
    assert torch.autograd.gradgradcheck(lambda *x: small_loads(*x, **options), inputs, rtol=1e-4)
    once, twice = (
        torch.autograd.grad(small_loads(*inputs, **options)[1][1], inputs, create_graph=is_kept)
        for is_kept in (False, True)
    )
    torch.testing.assert_close(twice, once, rtol=1e-10, atol=1e-12)


def wing_and_tail(height, chordwise=2, spanwise=2):
    tail = torch.stack([a_wing(1, spanwise, 1.5, 0.6, "none")]) + height[..., None, None, None] * number(
        [0.0, 0.0, 1.0]
    )
    return [a_wing(chordwise, spanwise), tail + number([5.0, 0.0, 0.0])]


@pytest.mark.parametrize("is_symmetric", [False, True])
def test_derivatives_of_a_tail_in_the_wake_pass_gradcheck(is_symmetric):
    def loads(*meshes_and_wind):
        *meshes, wind = meshes_and_wind
        result = vortex_lattice(meshes, wind, number(1.2), ORIGIN, is_symmetric=is_symmetric)
        return result.force, result.moment

    meshes = [mesh[..., mesh.shape[-2] // 2 * is_symmetric :, :] for mesh in wing_and_tail(number([0.0, 0.29]))]
    inputs = tuple(part.contiguous().requires_grad_() for part in (*meshes, stream(0.06, 0.0, 1.0)))
    assert torch.autograd.gradcheck(loads, inputs)
    assert torch.autograd.gradgradcheck(loads, inputs, rtol=1e-4)


def test_a_tail_crosses_the_wake_smoothly():
    """Without a core the tail's force leaps where its control points pass a trailing vortex."""
    heights = torch.linspace(0.2, 0.6, 161, dtype=torch.float64)
    leaps = []
    for core in (0.0, 1.0):
        loads = vortex_lattice(wing_and_tail(heights, 4, 15), stream(0.08), number(1.0), ORIGIN, wake_core=core)
        tail = loads.surface_force[1][:, 2]
        leaps.append(float((tail[2:] - 2.0 * tail[1:-1] + tail[:-2]).abs().max() / tail.mean()))
    assert 100.0 * leaps[1] < leaps[0]
    assert leaps[1] < 1e-5


def test_the_core_vanishes_with_the_width_of_the_strips():
    """Off the sheet its effect is of second order in the width of the strips."""
    effects = []
    for spanwise in (8, 16, 32):
        meshes = wing_and_tail(number([-0.5]), 2, spanwise)
        forces = [
            vortex_lattice(meshes, stream(0.05), number(1.0), ORIGIN, wake_core=core).surface_force[1][0, 2]
            for core in (0.0, 1.0)
        ]
        effects.append(abs(float(forces[1] / forces[0]) - 1.0))
    assert effects[0] > 3.0 * effects[1] > 9.0 * effects[2]


def test_a_lone_surface_has_no_core():
    loads = [vortex_lattice([a_wing()], stream(0.1), number(1.0), ORIGIN, wake_core=core).force for core in (0.0, 1.0)]
    assert torch.equal(*loads)


def test_a_negative_core_is_refused():
    with pytest.raises(ValueError, match="wake_core = -1"):
        vortex_lattice([a_wing()], stream(0.1), number(1.0), ORIGIN, wake_core=-1.0)


def test_gradient_does_not_depend_on_how_the_work_is_cut(monkeypatch):
    gradients = []
    for chunk in (200, 10**9):
        monkeypatch.setattr("lpc_mdo.disciplines.vortex_filaments.CHUNK", chunk)
        mesh = a_wing(4, 6).requires_grad_()
        force, moment, _ = small_loads(mesh, stream(0.06, 0.05, 1.0))
        gradients.append(torch.autograd.grad(force[2] + moment[1], mesh)[0])
    torch.testing.assert_close(*gradients, rtol=1e-10, atol=1e-12)


def test_single_precision_agrees_with_double():
    double = small_loads(a_wing(), stream(0.06, 0.05, 1.0))
    point = torch.tensor([0.2, 0.0, 0.1])
    single = vortex_lattice([a_wing().float()], stream(0.06, 0.05, 1.0).float(), torch.tensor(1.2), point)
    assert single.force.dtype == torch.float32
    torch.testing.assert_close(single.force.double(), double[0], rtol=2e-3, atol=2e-4)


def test_an_undefined_stream_leaves_the_other_conditions_alone():
    winds = torch.stack([stream(0.05), stream(math.nan), stream(0.05)])
    lift = vortex_lattice([a_wing()], winds, number(1.0), ORIGIN).lift
    assert lift.isnan().tolist() == [False, True, False]
    assert float(lift[0]) == pytest.approx(float(lift[2]), rel=1e-12)


def test_an_empty_batch_has_an_empty_result_and_gradient():
    winds = torch.empty(0, 3, dtype=torch.float64, requires_grad=True)
    loads = vortex_lattice([a_wing()], winds, number(1.0), ORIGIN)
    assert loads.force.shape == (0, 3)
    assert torch.autograd.grad(loads.force.sum(), winds)[0].shape == (0, 3)
