"""Free-form deformation and the parameterization solver: measures asked for are met with the least deformation."""

import dataclasses
import json
import math

import numpy as np
import pytest
import torch
from conftest import REFERENCE, central_difference
from scipy.integrate import quad
from scipy.interpolate import BSpline
from scipy.optimize import minimize

from lpc_mdo.config import load
from lpc_mdo.geometry.deformation import ChordMeasures, DeformationError, FreeFormBlock, least_deformation
from lpc_mdo.geometry.outer_mold_line import ShapeParameters
from lpc_mdo.geometry.shape import Geometry
from lpc_mdo.numerics.bsplines import basis_matrix, clamped_knots, greville_abscissae
from lpc_mdo.numerics.quadrature import gauss_legendre

VEHICLE, _ = load()
GEOMETRY = Geometry(VEHICLE)
MOLD = GEOMETRY.outer_mold_line
BASELINE = MOLD.baseline_parameters()
STATIONS = torch.from_numpy(greville_abscissae(5, 3))
DESIGNS = 200


def real(values):
    return torch.tensor(values, dtype=torch.float64)


def uniform(*shape, seed=0):
    return torch.rand(*shape, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))


def random_parameters(count=DESIGNS, seed=1):
    """Designs within the bounds of the 109-variable problem."""
    share = 0.8 + 0.4 * uniform(5, count, seed=seed)
    tail_x = VEHICLE.horizontal_tail.root_quarter_chord[0]
    return ShapeParameters(
        wing_area=share[0] * VEHICLE.wing.area,
        wing_aspect_ratio=share[1] * VEHICLE.wing.aspect_ratio,
        wing_twist=math.radians(10.0) * (2.0 * uniform(count, 5, seed=seed + 1) - 1.0),
        tail_area=share[2] * VEHICLE.horizontal_tail.area,
        tail_aspect_ratio=share[3] * VEHICLE.horizontal_tail.aspect_ratio,
        tail_position=tail_x + uniform(count, seed=seed + 2) - 0.5,
        rotor_radius=1.2 + 0.6 * uniform(count, 9, seed=seed + 3),
    )


RANDOM = random_parameters()
NETS = MOLD.control_points(RANDOM)


def moved(name, nets=NETS):
    return MOLD.patches[name].moved(nets)


# --- the block


def block(degrees=(2, 3, 1), counts=(4, 5, 3)):
    sizes = ((-1.0, 2.0), (0.0, 5.0), (0.5, 1.0))
    knots = [
        low + (high - low) * torch.from_numpy(clamped_knots(n, p))
        for (low, high), n, p in zip(sizes, counts, degrees, strict=True)
    ]
    return FreeFormBlock(tuple(knots), degrees)


def points_inside(count=50):
    low, high = real([-1.0, 0.0, 0.5]), real([2.0, 5.0, 1.0])
    return low + (high - low) * uniform(count, 3, seed=4)


def test_a_block_at_rest_gives_back_what_is_embedded_and_an_affine_map_moves_it_alike():
    points, lattice = points_inside(), block().rest.flatten(0, 2)
    matrix = block().embed(points)
    torch.testing.assert_close(matrix.sum(-1), torch.ones(50).double(), rtol=0, atol=1e-13)
    torch.testing.assert_close(matrix @ lattice, points, rtol=0, atol=1e-13)
    turn, shift = uniform(3, 3, seed=5), uniform(3, seed=6)
    torch.testing.assert_close(matrix @ (lattice @ turn + shift), points @ turn + shift, rtol=0, atol=1e-13)


def test_a_block_refuses_points_outside():
    with pytest.raises(ValueError, match=r"points are not allowed; y must lie between 0 and 5 m"):
        block().embed(real([[0.0, 5.1, 0.7]]))


def test_sections_turn_stretch_and_shift_as_rigid_plates():
    sections = real([0.0, 2.0, 5.0])
    plate = FreeFormBlock.with_sections(points_inside(200), sections)
    reference = torch.stack([real([0.3, 0.2, 0.1]), sections, real([0.7] * 3)], dim=-1)
    point = real([[0.9, 2.0, 0.8]])
    angle, stretch, shift = 0.4, 1.3, real([0.5, -0.2, 0.1])
    motion = torch.cat([reference.T.flatten(), torch.ones(3).double(), torch.zeros(3).double()])
    torch.testing.assert_close(plate.section_map(point, reference) @ motion, point, rtol=0, atol=1e-14)
    motion[[1, 4, 7]] += shift
    motion[[10, 13]] = stretch * real([math.cos(angle), math.sin(angle)])
    dx, dz = 0.9 - 0.2, 0.8 - 0.7
    x = 0.2 + stretch * (math.cos(angle) * dx + math.sin(angle) * dz)
    z = 0.7 + stretch * (math.cos(angle) * dz - math.sin(angle) * dx)
    expected = real([[x, 2.0, z]]) + shift
    torch.testing.assert_close(plate.section_map(point, reference) @ motion, expected, rtol=0, atol=1e-14)


# --- the solver


def chord_measures(twist):
    chord = real([1.3, 1.2, 1.0, 0.8, 0.7])
    nodes, weights = gauss_legendre(real([0.0, 0.5, 1.0]), 6)
    return ChordMeasures(twist, basis_matrix(STATIONS, 5, 3), chord, basis_matrix(nodes, 5, 3), weights)


STATE = torch.cat([1.0 + 0.2 * uniform(5, seed=7), 0.2 * uniform(5, seed=8)])
TWIST = real([0.1, -0.05, 0.0, 0.12, -0.1])


def test_derivatives_of_the_measures_equal_those_of_autograd():
    measures = chord_measures(TWIST)
    multipliers = uniform(6, seed=9)
    values, jacobian, curvature = measures.expanded(STATE, multipliers)
    for ours, alone in zip((values, jacobian), measures.linearized(STATE), strict=True):
        assert torch.equal(ours, alone)
    theirs = torch.autograd.functional.jacobian(lambda s: measures.linearized(s)[0], STATE)
    torch.testing.assert_close(jacobian, theirs, rtol=0, atol=1e-14)
    hessian = torch.autograd.functional.hessian(lambda s: multipliers @ measures.linearized(s)[0], STATE)
    torch.testing.assert_close(curvature, hessian, rtol=0, atol=1e-14)


def solved(twist, mean, weight):
    reference = torch.cat([torch.cos(twist), torch.sin(twist)])
    requested = torch.cat([torch.zeros(5, dtype=torch.float64), mean[None]])
    return least_deformation(chord_measures(twist), reference, weight, requested)


def test_no_other_solver_finds_a_smaller_deformation():
    weight, mean = 0.5 + uniform(10, seed=10), real(1.15)
    ours = solved(TWIST, mean, weight)
    measures = chord_measures(TWIST)
    reference = torch.cat([torch.cos(TWIST), torch.sin(TWIST)]).numpy()
    target = np.array([0.0] * 5 + [1.15])
    theirs = minimize(
        lambda s: 0.5 * weight.numpy() @ (s - reference) ** 2,
        reference,
        jac=lambda s: weight.numpy() * (s - reference),
        method="SLSQP",
        constraints={
            "type": "eq",
            "fun": lambda s: measures.linearized(torch.from_numpy(s))[0].numpy() - target,
            "jac": lambda s: measures.linearized(torch.from_numpy(s))[1].numpy(),
        },
        options={"ftol": 1e-15, "maxiter": 200},
    )
    np.testing.assert_allclose(ours.numpy(), theirs.x, atol=1e-7)
    torch.testing.assert_close(measures.linearized(ours)[0], torch.from_numpy(target), rtol=0, atol=1e-13)


def test_gradients_of_the_solution_pass_gradcheck():
    weight = 0.5 + uniform(10, seed=11)
    inputs = (TWIST.clone().requires_grad_(), real(1.1).requires_grad_())
    assert torch.autograd.gradcheck(lambda t, m: solved(t, m, weight), inputs, eps=1e-6, atol=1e-8)


def test_what_no_deformation_can_meet_is_said():
    with pytest.raises(DeformationError, match="1 of 1 deformations were not found"):
        solved(TWIST, real(float("nan")), torch.ones(10).double())


# --- the aircraft


def scipys_chord(name, net):
    """Chord vector along the span as SciPy's spline, from the first and last row of control points of a side."""
    points = moved(name, net).control_points
    return BSpline(clamped_knots(5, 3), (points[-1] - points[0]).numpy(), 3)


@pytest.mark.parametrize(("surface", "part"), [("wing", "wing"), ("horizontal_tail", "tail")])
def test_planforms_measured_by_quadrature_are_the_ones_asked_for(surface, part):
    area, ratio = getattr(RANDOM, f"{part}_area"), getattr(RANDOM, f"{part}_aspect_ratio")
    for i in range(DESIGNS):
        chord = scipys_chord(f"{surface}_upper", NETS[i])
        net = moved(f"{surface}_upper", NETS[i]).control_points
        half_span = float(0.75 * net[0, -1, 1] + 0.25 * net[-1, -1, 1])
        size = lambda v, chord=chord: float(np.linalg.norm(chord(v)))  # noqa: E731
        half_area = half_span * sum(quad(size, *ends, epsabs=1e-12, limit=80)[0] for ends in ((0, 0.5), (0.5, 1)))
        assert 2.0 * half_area == pytest.approx(float(area[i]), rel=1e-8)
        assert 2.0 * half_span == pytest.approx(float(torch.sqrt(area[i] * ratio[i])), rel=1e-8)
        assert (2.0 * half_span) ** 2 / (2.0 * half_area) == pytest.approx(float(ratio[i]), rel=1e-8)


def test_measures_that_the_disciplines_see_are_the_ones_asked_for():
    shape = GEOMETRY(RANDOM)
    for measures, part in ((shape.wing, "wing"), (shape.tail, "tail")):
        torch.testing.assert_close(measures.area, getattr(RANDOM, f"{part}_area"), rtol=1e-8, atol=0)
        torch.testing.assert_close(measures.aspect_ratio, getattr(RANDOM, f"{part}_aspect_ratio"), rtol=1e-8, atol=0)


def test_twist_at_the_stations_is_the_one_asked_for():
    wing = moved("wing_upper")
    ends = torch.zeros(5, dtype=torch.float64)
    chord = wing(ends + 1.0, STATIONS) - wing(ends, STATIONS)
    twist = torch.atan2(-chord[..., 2], chord[..., 0])
    asked = RANDOM.wing_twist @ basis_matrix(STATIONS, 5, 3).T
    torch.testing.assert_close(twist, asked, rtol=0, atol=1e-8)


def test_attachments_are_kept():
    """Booms on the wing's quarter chord, hubs on booms, disks on hubs, wing on the roof, tail on the tail cone's axis."""
    mirror = real([1.0, -1.0, 1.0])
    still = torch.zeros(1, dtype=torch.float64)
    rest = MOLD.control_points(BASELINE)
    for rotor in VEHICLE.lift_rotors:
        carrier = MOLD.attachments[rotor.name](NETS)[:, 0] * (mirror if rotor.hub[1] < 0.0 else 1.0)
        boom = moved(f"boom_{rotor.name}")
        torch.testing.assert_close(boom(still + 1.0, still)[:, 0], carrier, rtol=0, atol=1e-8)
        for part in ("boom", "hub", "disk"):
            surface = moved(f"{part}_{rotor.name}")
            before = moved(f"{part}_{rotor.name}", rest).control_points[0, 0]
            anchor = moved(f"hub_{rotor.name}", rest).control_points[0, 0]
            hub = moved(f"hub_{rotor.name}").control_points[:, 0, 0]
            torch.testing.assert_close(surface.control_points[:, 0, 0] - hub, (before - anchor).expand_as(hub))
        disk = moved(f"disk_{rotor.name}")
        radius = torch.linalg.vector_norm(disk(still + 1.0, still) - disk(still, still), dim=-1)[:, 0]
        index = [r.name for r in VEHICLE.rotors].index(rotor.name)
        torch.testing.assert_close(radius, RANDOM.rotor_radius[:, index], rtol=0, atol=1e-12)
    root = GEOMETRY(RANDOM).tail_hinge
    body = VEHICLE.fuselage
    cabin_end = body.nose[0] + 0.5 * body.length
    slope = (body.rear[2] - (MOLD.roof_height - 0.5 * body.height)) / (body.rear[0] - cabin_end)
    above = root[:, 2] - body.rear[2] - slope * (root[:, 0] - body.rear[0])
    torch.testing.assert_close(above, above[:1].expand_as(above), rtol=0, atol=1e-8)
    torch.testing.assert_close(root[:, 0], RANDOM.tail_position, rtol=0, atol=1e-8)
    wing_root = 0.75 * moved("wing_upper")(still, still) + 0.25 * moved("wing_upper")(still + 1.0, still)
    published = real(VEHICLE.wing.root_quarter_chord)
    torch.testing.assert_close(wing_root[:, 0], published.expand(DESIGNS, 3), rtol=0, atol=1e-8)


def test_hubs_stand_where_they_are_asked_for_and_booms_reach_from_the_wing_to_them():
    asked = real([rotor.hub for rotor in VEHICLE.rotors]) + 0.4 * (uniform(DESIGNS, 9, 3, seed=12) - 0.5)
    shifted = MOLD.with_hubs_at(RANDOM, asked)
    nets = MOLD.control_points(shifted)
    torch.testing.assert_close(MOLD.hubs(nets), asked, rtol=0, atol=1e-8)
    torch.testing.assert_close(GEOMETRY(shifted).hubs, asked, rtol=0, atol=1e-8)
    still = torch.zeros(1, dtype=torch.float64)
    mirror = real([1.0, -1.0, 1.0])
    for i, rotor in enumerate(VEHICLE.lift_rotors):
        carrier = MOLD.attachments[rotor.name](nets)[:, 0] * (mirror if rotor.hub[1] < 0.0 else 1.0)
        boom = moved(f"boom_{rotor.name}", nets)
        torch.testing.assert_close(boom(still + 1.0, still)[:, 0], carrier, rtol=0, atol=1e-8)
        axis = torch.nn.functional.normalize(boom(still, still)[:, 0] - carrier, dim=-1)
        off_axis = torch.linalg.cross(asked[:, i] - carrier, axis).norm(dim=-1)
        assert float(off_axis.max()) < 1e-8
    torch.testing.assert_close(moved("wing_upper", nets).control_points, moved("wing_upper").control_points)


def test_wing_sections_do_not_cross_themselves_and_keep_their_order_along_the_span():
    u = 1e-4 + 0.9998 * torch.linspace(0.0, 1.0, 60, dtype=torch.float64)
    v = torch.linspace(0.0, 1.0, 17, dtype=torch.float64)
    upper, lower = moved("wing_upper").grid(u, v), moved("wing_lower").grid(u, v)
    chord = moved("wing_upper").grid(real([0.0, 1.0]), v)
    along = torch.nn.functional.normalize(chord[:, 1] - chord[:, 0], dim=-1)
    normal = torch.stack([-along[..., 2], torch.zeros_like(along[..., 0]), along[..., 0]], dim=-1)
    assert float(((upper - lower) * normal[:, None]).sum(-1).min()) > 0.0
    for side in (upper, lower):
        forward = ((side[:, 1:] - side[:, :-1]) * along[:, None]).sum(-1)
        assert float(forward.min()) > 0.0
        assert float((side[:, :, 1:, 1] - side[:, :, :-1, 1]).min()) > 0.0


def test_a_flat_planform_is_deformed_as_a_whole():
    """Without a change of twist the least deformation keeps taper, sweep and section: the trapezoid of the formulas."""
    asked = dataclasses.replace(BASELINE, wing_area=real(16.0), wing_aspect_ratio=real(14.0))
    chord = MOLD.motion(asked)[15:20]
    torch.testing.assert_close(chord, chord[:1].expand(5), rtol=1e-12, atol=0)


def test_gradients_of_the_motion_equal_differences():
    shifted = dataclasses.replace(RANDOM, hub_shift=0.2 * uniform(DESIGNS, 9, 3, seed=20))
    one = [torch.as_tensor(getattr(shifted, f.name)[3]) for f in dataclasses.fields(ShapeParameters)]
    sizes = [part.numel() for part in one]

    def motion(x):
        parts = [p.reshape(o.shape) for p, o in zip(x.split(sizes), one, strict=True)]
        return MOLD.motion(ShapeParameters(*parts))

    x = torch.cat([part.reshape(-1) for part in one])
    exact = torch.autograd.functional.jacobian(motion, x)
    torch.testing.assert_close(exact, central_difference(motion, x, 1e-3), rtol=1e-6, atol=1e-9)


def test_a_batch_equals_a_loop():
    for i in (0, 57, 199):
        one = ShapeParameters(**{name: value[i] for name, value in vars(RANDOM).items() if value is not None})
        torch.testing.assert_close(MOLD.control_points(one), NETS[i], rtol=0, atol=1e-12)


def test_with_one_twist_all_along_the_span_the_model_is_that_of_trapezoids_in_closed_form(problem, monkeypatch):
    """Objective and every row with a uniform stretch in place of the solver, at the stored optimum but for its washout."""
    stored = json.loads((REFERENCE / "optimum.json").read_text())
    x = problem.scaled(stored["design"] | {"wing_twist": [0.08] * 5})
    with torch.no_grad():
        full, rows = problem.evaluate(x)
        monkeypatch.setattr(
            "lpc_mdo.geometry.parameterization.least_deformation",
            lambda measures, reference, weight, requested, start: reference * requested[..., -1:],
        )
        closed, closed_rows = problem.evaluate(x)
    assert float(closed) == pytest.approx(float(full), rel=1e-12)
    torch.testing.assert_close(closed_rows, rows, rtol=1e-9, atol=1e-9)
