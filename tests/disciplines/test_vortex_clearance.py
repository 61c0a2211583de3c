"""Meshes that a vortex lattice refuses, and those it must not: by name, with the right answer where there is one."""

import json
import math
from pathlib import Path

import pytest
import torch
from click.testing import CliRunner
from conftest import number

from lpc_mdo.cases.wings import WingMesh, WingSurface, wing_mesh
from lpc_mdo.cli import main
from lpc_mdo.disciplines import vortex_clearance
from lpc_mdo.disciplines.far_field import far_field
from lpc_mdo.disciplines.stability_derivatives import air_velocity
from lpc_mdo.disciplines.vortex_clearance import require_sound_meshes, wake_passages
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice
from lpc_mdo.disciplines.vortex_topology import lattice_of
from lpc_mdo.numerics.spacing import cosine_spacing

FAULTS = Path(__file__).parents[1] / "faults"
ORIGIN = torch.zeros(3, dtype=torch.float64)


def fault(name):
    return json.loads((FAULTS / f"{name}.json").read_text())


@pytest.fixture
def analyze(tmp_path):
    def run(case, **mesh):
        file = tmp_path / "case.json"
        file.write_text(json.dumps(case | ({"mesh": mesh} if mesh else {})))
        return CliRunner().invoke(main, ["analyze", "wing", str(file)])

    return run


def results(run):
    assert run.exit_code == 0, run.stderr
    return json.loads(run.stdout)["results"]


def messages(row):
    return [flag["message"] for flag in row.get("flags", [])]


def refusal(run):
    assert run.exit_code == 2
    assert run.stdout == ""
    assert run.stderr.count("\n") == 1
    return run.stderr


def surface(name="wing", root=(0.0, 0.0, 0.0, 1.0), tip=(0.0, 4.0, 0.0, 1.0)):
    return {"name": name, "camber": "none", "root": list(root), "tip": list(tip)}


def case_of(*surfaces, angles=((4.0, 0.0),)):
    return fault("wing_coincident") | {
        "inputs": fault("wing_coincident")["inputs"]
        | {"surfaces_half": list(surfaces), "conditions_alpha_beta_deg": [list(pair) for pair in angles]}
    }


def mesh_of(root, tip, chordwise=4, spanwise=20, camber="none"):
    return wing_mesh(
        WingSurface(name="wing", camber=camber, root=root, tip=tip),
        WingMesh(chordwise_panels=chordwise, spanwise_panels_half=spanwise),
    )


def stream(alpha_deg=4.0, beta_deg=0.0):
    return air_velocity(number(50.0), number(math.radians(alpha_deg)), number(math.radians(beta_deg)))


# What other codes and limits say: the wake core is on by default, near and far field agree.


def test_a_wake_that_runs_through_a_wing_leaves_lift_and_drag_right(analyze):
    """Limit of refined meshes with a core that shrinks with the strips: CL 0.162, CDi 0.00102 at 1.4 degrees."""
    case = fault("wing_tandem_wake")
    for mesh in ({}, {"chordwise_panels": 8, "spanwise_panels_half": 40}):
        found = results(analyze(case, **mesh))
        assert [r["CDi"] for r in found] == pytest.approx([0.00088, 0.00102, 0.00118], rel=0.01)
        assert [r["CDi_far_field"] for r in found] == pytest.approx([r["CDi"] for r in found], rel=2e-3)
        assert found[1]["CL"] == pytest.approx(0.165, rel=0.02)
        # Lift of thin wings is linear in the angle of attack, however the wake passes.
        assert found[0]["CL"] + found[2]["CL"] == pytest.approx(2.0 * found[1]["CL"], rel=1e-3)
        for r in found:
            assert messages(r) == [
                "the wake of front passes through rear: the load there depends on the mesh and on wake_core"
            ]


def wing_and_tail_of_avl(**options):
    case = fault("vlm_wake_leg_through_control_points")
    halves = [
        mesh_of(
            (*part.get("translate", (0.0, 0.0, 0.0)), part["chord"][0]),
            (part.get("translate", (0.0,))[0], part["yle"][1], 0.0, part["chord"][1]),
            part["chordwise"],
            part["spanwise"],
        )[:, part["spanwise"] :]
        for part in case["inputs"]["surfaces"]
    ]
    loads = vortex_lattice(
        halves,
        stream(case["inputs"]["alpha_deg"]),
        number(2.0),
        torch.tensor(case["inputs"]["point"]).double(),
        is_symmetric=True,
        wake_direction=torch.tensor([1.0, 0.0, 0.0]).double(),
        **options,
    )
    force = 50.0**2 * case["inputs"]["S"]
    return (
        {
            "CL": float(loads.lift) / force,
            "CD": float(loads.induced_drag) / force,
            "Cm": float(loads.moment[1]) / force,
        },
        case["reference"],
    )


def test_legs_through_control_points_give_what_avl_gives():
    found, theirs = wing_and_tail_of_avl(wake_core=0.0)
    assert found == pytest.approx(theirs, rel=1e-5)


def test_the_core_changes_that_tail_in_the_wake_by_less_than_the_mesh_does():
    found, theirs = wing_and_tail_of_avl()
    assert found["CL"] == pytest.approx(theirs["CL"], rel=3e-3)
    assert found["CD"] == pytest.approx(theirs["CD"], rel=3e-3)
    assert found["Cm"] == pytest.approx(theirs["Cm"], rel=0.02)


def test_every_result_compares_near_and_far_field(analyze):
    (found,) = results(analyze(case_of(surface())))
    assert found["CDi_difference"] == found["CDi"] - found["CDi_far_field"]
    assert found["CDi"] == pytest.approx(found["CDi_far_field"], rel=2e-3)
    assert messages(found) == []


def test_drags_that_disagree_are_flagged(analyze):
    """Without a core the wake's single vortices drive the rear wing's drag below 0, as at 1.4 degrees here."""
    found = results(analyze(fault("wing_tandem_wake"), wake_core=0.0))[1]
    assert found["CDi"] < -0.02
    wake, drag = found["flags"]
    assert (wake["what"], wake["where"]) == ("wake_passage", "rear")
    assert drag["what"] == "induced_drag"
    assert abs(drag["value"]) > drag["limit"]
    assert "neither is to be trusted" in drag["message"]


def test_a_tail_clear_of_the_wake_raises_no_flag(analyze):
    tail = surface("tail", (5.0, 0.0, -0.3, 0.6), (5.0, 1.5, -0.3, 0.6))
    found = results(analyze(case_of(surface(), tail, angles=[(0.0, 0.0), (4.0, 0.0), (4.0, 10.0)])))
    assert [messages(r) for r in found] == [[], [], []]


# Refusals name the surfaces.


def test_coincident_surfaces_are_refused(analyze):
    assert "wing and same are 0 m apart" in refusal(analyze(fault("wing_coincident")))


def test_a_fin_that_folds_onto_its_mirror_image_is_refused(analyze):
    assert "parts of fin that do not adjoin are 0.00015 m apart" in refusal(analyze(fault("wing_fin_1mm")))


def test_the_wing_beside_that_fin_lifts_as_alone(analyze):
    """0.33: the fin stands in the plane of symmetry, where it carries nothing; spread, it may stay."""
    front = fault("wing_fin_1mm")["inputs"]["surfaces_half"][0]
    spread = surface("fins", (5.0, 0.0, 0.0, 1.0), (5.3, 1.5, 1.5, 0.6))
    alone, beside = (results(analyze(case_of(*parts)))[0] for parts in ((front,), (front, spread)))
    assert alone["CL"] == pytest.approx(0.33, abs=0.01)
    assert beside["span_load"]["front"] == pytest.approx(alone["span_load"]["front"], rel=0.03)


def test_a_span_of_two_micrometres_is_refused(analyze):
    assert "surfaces_half[0].tip[1] = 1e-06 is invalid: it must be at least 0.001" in refusal(
        analyze(fault("wing_span_2um"))
    )
    mesh = mesh_of((0.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0)) * flat([1.0, 1e-6, 1.0])
    with pytest.raises(ValueError, match=r"0.25 m along the chord and 5e-08 m across"):
        vortex_lattice([mesh], stream(), number(1.0), ORIGIN)


@pytest.mark.parametrize("gap", [0.03, -0.03])
@pytest.mark.parametrize(
    "other", [((0.0, 0.0, 0.0, 1.0), (0.0, 4.0, 0.0, 1.0)), ((0.02, 0, 0, 0.9), (0.02, 4.1, 0, 0.9))]
)
def test_surfaces_three_per_cent_of_a_chord_apart_are_refused(analyze, gap, other):
    root, tip = ((*place[:2], gap, place[3]) for place in other)
    assert "wing and other are 0.03 m apart" in refusal(analyze(case_of(surface(), surface("other", root, tip))))


def test_surfaces_three_per_cent_of_a_chord_apart_are_right_on_a_mesh_fine_enough():
    """0.33: together they lift as one wing; three per cent of a chord add a few per cent."""
    rows, strips = 17, 20
    halves = [
        mesh_of((x, 0.0, z, c), (x, 1.0, z, c), rows, strips)[:, strips:]
        for x, z, c in ((0, 0, 1.0), (0.02, 0.03, 0.9))
    ]
    alone = vortex_lattice(halves[:1], stream(), number(1.1), ORIGIN, is_symmetric=True)
    both = vortex_lattice(halves, stream(), number(1.1), ORIGIN, is_symmetric=True)
    assert float(both.lift / alone.lift) == pytest.approx(1.03, abs=0.02)


@pytest.mark.parametrize(
    ("chord", "span", "shift", "alpha_deg"),
    [(0.66, 4.16, 0.45, 7.3), (1.13, 4.23, 0.48, 4.5), (0.77, 4.82, -0.21, 4.0)],
)
def test_at_half_a_panel_lift_is_right(monkeypatch, chord, span, shift, alpha_deg):
    """Against a mesh so fine that the gap is several panels."""
    lifts = []
    for rows, strips in ((4, 20), (10, 40)):
        gap = 0.5 * max(0.25, span / 20.0, chord / 4.0) * 1.001
        halves = [
            mesh_of((x, 0.0, z, c), (x, s, z, c), rows, strips)[:, strips:]
            for x, z, c, s in ((0.0, 0.0, 1.0, 4.0), (shift, gap, chord, span))
        ]
        lifts.append(float(vortex_lattice(halves, stream(alpha_deg), number(1.1), ORIGIN, is_symmetric=True).lift))
    assert lifts[0] == pytest.approx(lifts[1], rel=0.03)


def test_below_half_a_panel_lift_would_be_wrong(monkeypatch):
    """Why that gap is the limit: at a fifth of a panel a third of the lift is missing."""
    monkeypatch.setattr(vortex_clearance, "LEAST_GAP", 0.0)
    monkeypatch.setattr(vortex_clearance, "LEAST_CROSSING", 0.0)
    lifts = []
    for rows, strips in ((4, 20), (10, 44)):
        halves = [
            mesh_of((x, 0.0, z, c), (x, s, z, c), rows, strips)[:, strips:]
            for x, z, c, s in ((0.0, 0.0, 1.0, 4.0), (0.02, 0.05, 0.9, 4.1))
        ]
        lifts.append(float(vortex_lattice(halves, stream(), number(1.1), ORIGIN, is_symmetric=True).lift))
    assert lifts[0] < 0.7 * lifts[1]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"tip": [0.0, 4.0, 0.0, 0.0]}, "surfaces_half[0].tip[3] = 0"),
        ({"root": [0.0, 0.0, 0.0, -1.0]}, "surfaces_half[0].root[3] = -1"),
        ({"tip": [1e300, 4.0, 0.0, 1.0]}, "surfaces_half[0].tip[0] = 1e+300"),
        ({"tip": [0.0, 1e-5, 0.0, 1.0]}, "surfaces_half[0].tip[1] = 1e-05 is invalid"),
        (
            {"root": [0.0, 0.0, 0.0, 1e-12], "tip": [0.0, 4.0, 0.0, 1e-12]},
            "wing is invalid: its panels must have an area",
        ),
        ({"tip": [1e4, 0.001, 0.0, 1e-3]}, "wing is invalid: its panels must have an area"),
    ],
)
def test_degenerate_surfaces_are_refused_by_name(analyze, change, words):
    assert words in refusal(analyze(case_of(surface() | change)))


def test_two_surfaces_of_one_name_are_refused(analyze):
    twice = case_of(surface(), surface(root=(0, 0, 2.0, 1.0), tip=(0, 4, 2.0, 1.0)))
    assert "surfaces_half[1].name = 'wing' is invalid" in refusal(analyze(twice))


def test_a_stream_across_is_refused(analyze):
    assert "[0][1] = 90" in refusal(analyze(case_of(surface(), angles=[(0.0, 90.0)])))


def test_more_panels_than_memory_is_meant_for_are_refused(analyze):
    words = refusal(analyze(case_of(surface()), chordwise_panels=64, spanwise_panels_half=200))
    assert "25600 panels; at most 5000 are allowed" in words


def flat(points):
    return torch.tensor(points, dtype=torch.float64)


UNSOUND = {
    "no size": flat([[[0, 0, 0], [0, 0, 0]], [[0, 0, 0], [0, 0, 0]]]),
    "collinear": flat([[[0, 0, 0], [0, 1, 0]], [[0, 2, 0], [0, 3, 0]]]),
    "no chord": flat([[[0, 0, 0], [0, 1, 0]], [[0, 0, 0], [0, 1, 0]]]),
    "no span": flat([[[0, 0, 0], [0, 0, 0]], [[1, 0, 0], [1, 0, 0]]]),
    "crossed edges": flat([[[0, 0, 0], [0, 1, 0]], [[1, 1, 0], [1, 0.2, 0]]]),
    "bow tie": flat([[[0, 0, 0], [0, 1, 0]], [[1, 1, 0], [1, 0, 0]]]),
    "a corner inside": flat([[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [0.2, 0.3, 0]]]),
    "overflow": flat([[[0, 0, 0], [0, 1e200, 0]], [[1e200, 0, 0], [1e200, 1e200, 0]]]),
    "underflow": flat([[[0, 0, 0], [0, 1e-200, 0]], [[1e-200, 0, 0], [1e-200, 1e-200, 0]]]),
}


@pytest.mark.parametrize("name", UNSOUND)
@pytest.mark.filterwarnings("error")
def test_panels_without_a_normal_are_refused(name):
    good = mesh_of((0.0, 0.0, 0.0, 1.0), (0.0, 4.0, 0.0, 1.0), 2, 3)
    with pytest.raises(ValueError, match="tail is invalid: its panels must have an area"):
        vortex_lattice([good, UNSOUND[name]], stream(), number(1.0), ORIGIN, names=["wing", "tail"])


def test_a_pointed_tip_is_no_fault():
    """Delta wing of aspect ratio 1: slender-wing theory's pi/2 AR alpha, less what its aspect ratio costs."""
    rows, strips = 8, 12
    across, along = (
        torch.linspace(-1, 1, 2 * strips + 1, dtype=torch.float64),
        torch.linspace(0, 1, rows + 1, dtype=torch.float64)[:, None],
    )
    x = 4.0 * (across.abs() + along * (1.0 - across.abs()))
    mesh = torch.stack(torch.broadcast_tensors(x, across, torch.zeros(())), dim=-1)
    lift = float(vortex_lattice([mesh], stream(2.0), number(2.0), ORIGIN).lift) / (50.0**2 * 4.0)
    assert 0.8 < lift / (0.5 * math.pi * math.radians(2.0)) < 1.0


def test_slender_wings_lift_as_theory_says_up_to_where_they_are_refused():
    """Slender-wing theory, lift = pi/2 AR alpha: the same ratio at every aspect ratio far below 1."""
    ratios = []
    for half_span in (1e-2, 2e-3, 1e-3):
        mesh = mesh_of((0.0, 0.0, 0.0, 1.0), (0.0, half_span, 0.0, 1.0))
        lift = float(vortex_lattice([mesh], stream(3.0), number(2.0), ORIGIN).lift) / (50.0**2 * 2.0 * half_span)
        ratios.append(lift / (0.5 * math.pi * 2.0 * half_span * math.radians(3.0)))
    assert ratios[0] == pytest.approx(1.0, abs=0.03)
    assert ratios == pytest.approx([ratios[0]] * 3, rel=1e-3)


# Neighbours that are no fault.


@pytest.mark.parametrize(
    "others",
    [
        [((1.03, 0, 0, 0.3), (1.03, 4, 0, 0.3))],  # a flap behind a slot
        [((0, 0, 1.0, 1.0), (0, 4, 1.0, 1.0))],  # a biplane
        [((5, 0, 0, 0.8), (5, 1.5, 1.5, 0.5))],  # a tail in V
        [((-3, 0, 0, 0.5), (-3, 1.5, 0, 0.5)), ((4, 0, 0.5, 0.5), (4, 1.5, 0.5, 0.5))],  # canard and tail
    ],
)
def test_usual_arrangements_are_not_refused(analyze, others):
    parts = [surface(f"other {k}", *(tuple(map(float, p)) for p in pair)) for k, pair in enumerate(others)]
    for found in results(analyze(case_of(surface(), *parts, angles=[(4.0, 0.0), (4.0, 8.0)]))):
        assert abs(found["CDi_difference"]) < 0.1 * found["CDi"]


def fin(root_z, strips=6, rows=4):
    """In the plane of symmetry, from `root_z` up; first strip below."""
    along, up = (
        torch.linspace(0, 1, rows + 1, dtype=torch.float64)[:, None],
        torch.linspace(0, 1, strips + 1, dtype=torch.float64),
    )
    return torch.stack(torch.broadcast_tensors(along, torch.zeros(()).double(), root_z + up), dim=-1)


def test_a_fin_on_a_wing_is_no_fault_and_one_halfway_through_a_strip_of_it_is():
    wing = mesh_of((0.0, 0.0, 0.0, 1.0), (0.0, 4.0, 0.0, 1.0))
    loads = vortex_lattice([wing, fin(0.0)], stream(beta_deg=5.0), number(1.0), ORIGIN)
    alone = vortex_lattice([wing], stream(beta_deg=5.0), number(1.0), ORIGIN)
    assert float(loads.surface_force[0][2] / alone.force[2]) == pytest.approx(1.0, abs=0.01)
    assert abs(float(loads.surface_force[1][1])) > 0.005 * float(alone.force[2])
    with pytest.raises(ValueError, match=r"meshes.0 and meshes.1 are .* apart"):
        vortex_lattice([wing, fin(-1.0 / 12.0)], stream(beta_deg=5.0), number(1.0), ORIGIN)


def test_a_fin_in_the_plane_of_symmetry_of_a_half_model_is_refused():
    wing = mesh_of((0.0, 0.0, 0.0, 1.0), (0.0, 4.0, 0.0, 1.0))[:, 20:]
    with pytest.raises(ValueError, match=r"meshes.1 and the mirror image of meshes.1 are 0 m apart"):
        vortex_lattice([wing, fin(1.0)], stream(), number(1.0), ORIGIN, is_symmetric=True)


def test_every_member_of_a_batch_is_looked_at_and_what_is_no_number_passes():
    wing, gaps = mesh_of((0.0, 0.0, 0.0, 1.0), (0.0, 4.0, 0.0, 1.0)), torch.tensor([1.0, 0.05, math.nan]).double()
    other = wing + gaps[:, None, None, None] * torch.tensor([0.0, 0.0, 1.0]).double()
    with pytest.raises(ValueError, match=r"meshes.0 and meshes.1 are 0.05 m apart.* at least 0.125 m"):
        vortex_lattice([wing, other], stream(), number(1.0), ORIGIN)
    assert vortex_lattice([wing, other[::2]], stream(), number(1.0), ORIGIN).lift.isnan().tolist() == [False, True]


def test_the_check_does_not_depend_on_how_the_work_is_cut(monkeypatch):
    meshes = [mesh_of((0.0, 0.0, z, 1.0), (0.0, 4.0, z, 1.0)) for z in (0.0, 0.03)]
    lattice = lattice_of(tuple((m.shape[0] - 1, m.shape[1] - 1) for m in meshes))
    nodes = torch.cat([m.flatten(-3, -2) for m in meshes], dim=-2)
    monkeypatch.setattr(vortex_clearance, "PAIRS", 1000)
    with pytest.raises(ValueError, match=r"a and b are 0.03 m apart"):
        require_sound_meshes(lattice, nodes, ["a", "b"], False)


def test_wakes_pass_through_what_lies_behind_them_alone():
    front, rear = mesh_of((0.0, 0, 0, 1.0), (0.0, 4.0, 0, 1.0)), mesh_of((5.0, 0, 0.1, 0.6), (5.0, 4.1, 0.1, 0.6))
    for alpha, met in ((0.0, []), (1.4, [(0, 1)]), (6.0, [])):
        wake = air_velocity(number(1.0), number(math.radians(alpha)), number(0.0))
        assert wake_passages([front, rear], wake) == met


@pytest.mark.parametrize("velocity", [[0.0, 0.0, 0.0], [0.0, 30.0, 0.0]])
def test_a_stream_without_a_direction_of_lift_is_refused(velocity):
    with pytest.raises(ValueError, match="velocity is invalid"):
        vortex_lattice([UNSOUND["no size"] + 1.0], flat(velocity), number(1.0), ORIGIN)


# Spacing.


@pytest.mark.parametrize("panels", [4, 12])
def test_cosine_spacing_converges_at_second_order(analyze, panels):
    """Rectangular wing, aspect ratio 8: with points in the middle of strips 24 of them missed the limit by 2 %."""
    lifts, drags = [], []
    for count in (panels, 2 * panels, 4 * panels):
        (found,) = results(
            analyze(case_of(surface()), chordwise_panels=2, spanwise_panels_half=count, spanwise_spacing="cosine")
        )
        lifts.append(found["CL"])
        drags.append(found["CDi_far_field"])
    for coarse, middle, fine in (lifts, drags):
        assert abs(fine - middle) < 0.3 * abs(middle - coarse)
    if panels == 12:
        assert lifts[0] == pytest.approx(lifts[2], rel=1e-4)
        (uniform,) = results(analyze(case_of(surface()), chordwise_panels=2, spanwise_panels_half=100))
        assert lifts[0] == pytest.approx(uniform["CL"], rel=0.01)


def test_points_sit_at_the_middle_angle_of_cosine_spacing_and_in_the_middle_of_equal_strips():
    count = 24
    lattice = lattice_of(((1, count),))
    equal = torch.linspace(-3.0, 1.0, count + 1, dtype=torch.float64)[:, None]
    torch.testing.assert_close(
        lattice.collocation(equal.diff(dim=0)), torch.full((count,), 0.5).double(), rtol=0, atol=1e-13
    )
    edges = cosine_spacing(count)
    middle = 0.5 - 0.5 * torch.cos(math.pi * (torch.arange(count).double() + 0.5) / count)
    exact = (middle - edges[:-1]) / (edges[1:] - edges[:-1])
    torch.testing.assert_close(lattice.collocation(edges.diff()[:, None]), exact, rtol=0.0, atol=(math.pi / count) ** 2)


def test_points_stay_inside_their_strips_whatever_the_spacing():
    edges = torch.tensor([0.0, 1.0, 1.001, 1.002, 3.0, 3.0001]).double()[:, None]
    share = lattice_of(((1, 5),)).collocation(edges.diff(dim=0))
    assert bool(((share >= 0.25) & (share <= 0.75)).all())
    assert lattice_of(((1, 1),)).collocation(edges[:2].diff(dim=0)).tolist() == [0.5]


def test_cosine_spacing_of_a_half_model_equals_the_whole():
    mesh = wing_mesh(
        WingSurface(name="wing", camber="NACA 4412", root=(0, 0, 0, 1), tip=(0.3, 4.0, 0.2, 0.6)),
        WingMesh(chordwise_panels=3, spanwise_panels_half=8, spanwise_spacing="cosine"),
    )
    whole = vortex_lattice([mesh], stream(), number(1.0), ORIGIN)
    half = vortex_lattice([mesh[:, 8:]], stream(), number(1.0), ORIGIN, is_symmetric=True)
    torch.testing.assert_close(half.force, whole.force, rtol=1e-3, atol=1e-6)


def test_gradient_with_respect_to_a_mesh_of_uneven_strips_passes_gradcheck():
    mesh = wing_mesh(
        WingSurface(name="wing", camber="NACA 4412", root=(0, 0, 0, 1), tip=(0.3, 4.0, 0.2, 0.6)),
        WingMesh(chordwise_panels=2, spanwise_panels_half=2, spanwise_spacing="cosine"),
    ).requires_grad_()

    def loads(nodes):
        found = vortex_lattice([nodes], stream() / 50.0, number(1.0), ORIGIN, has_chordwise_forces=True)
        behind = far_field(found.circulation, [nodes[-1]], stream() / 50.0, number(1.0))
        return found.force, found.moment, behind.lift, behind.induced_drag

    assert torch.autograd.gradcheck(loads, (mesh,))
