"""The frame against closed forms, MYSTRAN and CalculiX, and what statics asks of any frame."""

import math
import shutil
import subprocess

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.structures.frame import (
    BeamSections,
    Topology,
    element_axes,
    element_turns,
    internal_forces,
    local_stiffness,
    solve_frame,
    subdivide,
)

UP = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
E, NU = 70e9, 0.33
G = E / (2.0 * (1.0 + NU))
FRAMES = ["structures_frame_L", "structures_frame_wing_booms"]


def uniform(elements, area, second_moment, torsion, shear_area):
    ones = torch.ones(elements, dtype=torch.float64)
    moment, shear = second_moment * ones, shear_area * ones
    return BeamSections(area * ones, moment, moment, torsion * ones, shear, shear)


def cantilever(parts=3, length=4.0, shear_area=9e-4, direction=(0.0, 1.0, 0.0)):
    """A straight beam clamped at node 0, loaded at node 1: points, topology, sections."""
    ends = torch.stack([torch.zeros(3, dtype=torch.float64), length * torch.tensor(direction, dtype=torch.float64)])
    points, elements = subdivide(ends, torch.tensor([[0, 1]]), parts)
    fixed = torch.zeros(len(points), 6, dtype=torch.bool)
    fixed[0] = True
    topology = Topology(elements, UP.expand(parts, 3), fixed)
    return points, topology, uniform(parts, 1.9e-3, 9e-6, 1.8e-5, shear_area)


def case_frame(case, variant, parts=4):
    """Arguments of solve_frame for a stored frame: points, topology, sections, loads, E, G."""
    points = torch.tensor(case["points"], dtype=torch.float64)
    points, elements = subdivide(points, torch.tensor(case["segments"]), parts)
    fixed = torch.zeros(len(points), 6, dtype=torch.bool)
    fixed[case["fixed_points"]] = True
    section, setting = case["section"], case["variants"][variant]
    outer, inner = section["outer_radius_m"], section["outer_radius_m"] - section["thickness_m"]
    area, moment = math.pi * (outer**2 - inner**2), math.pi / 4 * (outer**4 - inner**4)
    shear_area = setting["shear_coefficient"] * area
    sections = uniform(len(elements), area, moment, 2 * moment, shear_area)
    loads = torch.zeros(1, len(points), 6, dtype=torch.float64)
    for load in case["loads"]:
        loads[0, load["point"], load["dof"]] += load["value"]
    shear_modulus = case["E"] / (2 * (1 + setting["nu"]))
    topology = Topology(elements, UP.expand(len(elements), 3), fixed)
    return points, topology, sections, loads, case["E"], shear_modulus


def tip_load(topology, freedom, value, node=1):
    loads = torch.zeros(1, topology.nodes, 6, dtype=torch.float64)
    loads[0, node, freedom] = value
    return loads


@pytest.mark.parametrize("parts", [1, 5])
@pytest.mark.parametrize(("freedom", "rotation", "sign"), [(0, 5, -1.0), (2, 3, 1.0)])
def test_tip_force_gives_the_timoshenko_deflection_in_both_planes(parts, freedom, rotation, sign):
    points, topology, sections = cantilever(parts)
    solution = solve_frame(points, topology, sections, tip_load(topology, freedom, 1000.0), E, G)
    bending = 1000.0 * 4.0**3 / (3 * E * 9e-6)
    expected = bending + 1000.0 * 4.0 / (G * 9e-4)
    assert solution.displacement[0, 1, freedom].item() == pytest.approx(expected, rel=1e-10)
    # The slope at the tip is that of bending alone: shear tilts sections, not their normals.
    slope = solution.displacement[0, 1, rotation].item()
    assert slope == pytest.approx(sign * 1.5 * bending / 4.0, rel=1e-10)


def test_infinite_shear_area_gives_the_euler_bernoulli_beam(reference):
    case = reference("structures_closed_form")["cantilever_pipe"]
    outer, inner = case["R"], case["R"] - case["t"]
    second_moment = math.pi / 4 * (outer**4 - inner**4)
    points, topology, _ = cantilever(3, case["L"])
    sections = uniform(3, 1.0, second_moment, 1.0, math.inf)
    solution = solve_frame(points, topology, sections, tip_load(topology, 2, case["tip_load"]), case["E"], G)
    assert solution.displacement[0, 1, 2].item() == pytest.approx(case["euler_bernoulli"], rel=1e-10)


def test_torque_and_axial_force_give_the_closed_forms():
    points, topology, sections = cantilever()
    loads = torch.cat([tip_load(topology, 4, 700.0), tip_load(topology, 1, 5000.0)])
    tip = solve_frame(points, topology, sections, loads, E, G).displacement[:, 1]
    assert tip[0, 4].item() == pytest.approx(700.0 * 4.0 / (G * 1.8e-5), rel=1e-10)
    assert tip[1, 1].item() == pytest.approx(5000.0 * 4.0 / (E * 1.9e-3), rel=1e-10)


def test_displacements_do_not_depend_on_the_mesh():
    loads = [tip_load(cantilever(n)[1], 2, 800.0) + tip_load(cantilever(n)[1], 3, 90.0) for n in (1, 9)]
    tips = [solve_frame(*cantilever(n), load, E, G).displacement[0, 1] for n, load in zip((1, 9), loads, strict=True)]
    assert torch.allclose(*tips, rtol=1e-10, atol=1e-15)


@pytest.mark.parametrize("name", FRAMES)
@pytest.mark.parametrize("variant", ["nu=0", "nu=0.33"])
def test_displacement_and_stress_equal_mystran(reference, name, variant):
    # Seven digits are printed: 1e-6 relative.
    case = reference(name)
    stored = case["variants"][variant]["mystran"]
    frame = case_frame(case, variant)
    solution = solve_frame(*frame)
    for point, theirs in stored["displacement"].items():
        ours = solution.displacement[0, int(point)]
        assert torch.allclose(ours, torch.tensor(theirs, dtype=torch.float64), rtol=1e-6, atol=1e-9), point
    ends = solution.end_forces[0]
    area, moment, radius = frame[2].area[0], frame[2].second_moment_y[0], case["section"]["outer_radius_m"]
    axial = ends[:, [0, 6]].abs() / area
    bending = torch.maximum(ends[:, [4, 10]].abs(), ends[:, [5, 11]].abs()) * radius / moment
    assert (axial + bending).max().item() == pytest.approx(stored["max_abs_fibre_stress"], rel=1e-6)


def test_mass_and_centre_of_gravity_equal_mystran(reference):
    case = reference("structures_frame_wing_booms")
    points, topology, sections, *_ = case_frame(case, "nu=0")
    ends = points[topology.elements]
    length = torch.linalg.vector_norm(ends[:, 1] - ends[:, 0], dim=-1)
    mass = case["density_for_mass"] * sections.area * length
    center = (mass[:, None] * ends.mean(1)).sum(0) / mass.sum()
    stored = case["variants"]["nu=0"]["mystran"]
    assert mass.sum().item() == pytest.approx(stored["mass"], rel=1e-6)
    assert center.tolist() == pytest.approx(stored["cg"], rel=1e-6, abs=1e-9)


def calculix_deck(case, parts):
    """Input of CalculiX: quadratic pipe elements at nu = 0, nodes of the stored points numbered from 1."""
    points = torch.tensor(case["points"], dtype=torch.float64)
    points, halves = subdivide(points, torch.tensor(case["segments"]), 2 * parts)
    nodes = [f"{i + 1}, " + ", ".join(f"{c:.9g}" for c in point) for i, point in enumerate(points.tolist())]
    pairs = halves.reshape(-1, 2, 2)
    elements = [f"{i + 1}, {a[0] + 1}, {a[1] + 1}, {b[1] + 1}" for i, (a, b) in enumerate(pairs.tolist())]
    section = case["section"]
    return "\n".join(
        [
            "*NODE, NSET=ALL",
            *nodes,
            "*ELEMENT, TYPE=B32R, ELSET=BEAMS",
            *elements,
            "*NSET, NSET=POINTS",
            *[f"{i + 1}," for i in range(len(case["points"]))],
            f"*MATERIAL, NAME=M\n*ELASTIC\n{case['E']:.9g}, 0.0",
            "*BEAM SECTION, ELSET=BEAMS, MATERIAL=M, SECTION=PIPE",
            f"{section['outer_radius_m']}, {section['thickness_m']}\n0.0, 0.0, 1.0",
            "*BOUNDARY",
            *[f"{p + 1}, 1, 6" for p in case["fixed_points"]],
            "*STEP\n*STATIC\n*CLOAD",
            *[f"{load['point'] + 1}, {load['dof'] + 1}, {load['value']}" for load in case["loads"]],
            "*NODE PRINT, NSET=POINTS\nU\n*END STEP\n",
        ]
    )


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
@pytest.mark.parametrize("name", FRAMES)
def test_displacement_equals_a_calculix_run_without_poisson_contraction(reference, name, tmp_path):
    case = reference(name)
    (tmp_path / "frame.inp").write_text(calculix_deck(case, 8))
    subprocess.run(["ccx", "frame"], cwd=tmp_path, check=True, capture_output=True, timeout=60)
    rows = [line.split() for line in (tmp_path / "frame.dat").read_text().splitlines() if line.strip()[:1].isdigit()]
    theirs = {int(row[0]) - 1: torch.tensor([float(v) for v in row[1:4]], dtype=torch.float64) for row in rows}
    ours = solve_frame(*case_frame(case, "nu=0")).displacement[0, :, :3]
    assert set(theirs) == set(range(len(case["points"])))
    for point, displacement in theirs.items():
        if point in case["fixed_points"]:
            continue
        error = torch.linalg.vector_norm(ours[point] - displacement) / torch.linalg.vector_norm(displacement)
        assert error < 0.006, (point, float(error))  # beams expanded to solids, quadratic; see the reference file


def test_reactions_balance_the_loads(reference):
    points, topology, sections, loads, e, g = case_frame(reference("structures_frame_L"), "nu=0.33")
    solution = solve_frame(points, topology, sections, loads, e, g)
    total = (solution.reactions + loads)[0]
    moment = total[:, 3:].sum(0) + torch.linalg.cross(points, total[:, :3], dim=-1).sum(0)
    assert torch.allclose(total[:, :3].sum(0), torch.zeros(3, dtype=torch.float64), atol=1e-6)
    assert torch.allclose(moment, torch.zeros(3, dtype=torch.float64), atol=1e-6)


def rotation_matrix():
    a, b = 0.7, -0.4
    about_z = [[math.cos(a), -math.sin(a), 0.0], [math.sin(a), math.cos(a), 0.0], [0.0, 0.0, 1.0]]
    about_x = [[1.0, 0.0, 0.0], [0.0, math.cos(b), -math.sin(b)], [0.0, math.sin(b), math.cos(b)]]
    return torch.tensor(about_x, dtype=torch.float64) @ torch.tensor(about_z, dtype=torch.float64)


def test_turning_the_whole_frame_leaves_member_forces_unchanged(reference):
    points, topology, sections, loads, e, g = case_frame(reference("structures_frame_wing_booms"), "nu=0.33")
    turn = rotation_matrix()
    turned_topology = Topology(topology.elements, topology.up @ turn.T, topology.is_fixed)
    turned_loads = (loads.unflatten(-1, (2, 3)) @ turn.T).flatten(-2)
    straight = solve_frame(points, topology, sections, loads, e, g)
    turned = solve_frame(points @ turn.T, turned_topology, sections, turned_loads, e, g)
    scale = straight.end_forces.abs().max()
    assert torch.allclose(turned.end_forces, straight.end_forces, rtol=0, atol=1e-9 * scale)
    expected = (straight.displacement.unflatten(-1, (2, 3)) @ turn.T).flatten(-2)
    assert torch.allclose(turned.displacement, expected, rtol=0, atol=1e-10)


def test_rigid_motion_carries_no_forces(reference):
    points, topology, sections, _, e, g = case_frame(reference("structures_frame_wing_booms"), "nu=0.33")
    length, axes = element_axes(points, topology)
    local = local_stiffness(sections, length, e, g)
    shift, turn = torch.tensor([0.3, -0.2, 0.1]).double(), torch.tensor([0.02, 0.01, -0.03]).double()
    motion = torch.cat([shift + torch.linalg.cross(turn.expand_as(points), points), turn.expand_as(points)], dim=-1)
    ends, _ = internal_forces(motion.flatten()[None], local, element_turns(axes), topology)
    assert ends.abs().max() < 1e-12 * local.abs().max()


def test_mirrored_frame_has_mirrored_displacements(reference):
    points, topology, sections, loads, e, g = case_frame(reference("structures_frame_wing_booms"), "nu=0.33")
    mirror = torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
    both = torch.cat([mirror, -mirror])
    straight = solve_frame(points, topology, sections, loads, e, g).displacement
    mirrored = solve_frame(points * mirror, topology, sections, loads * both, e, g).displacement
    assert torch.allclose(mirrored, straight * both, rtol=0, atol=1e-12)


def test_batch_and_cases_equal_one_by_one():
    points, topology, sections = cantilever()
    scale = torch.tensor([[1.0], [2.0]], dtype=torch.float64)
    batch = BeamSections(*(scale * getattr(sections, f) for f in BeamSections.__dataclass_fields__))
    loads = torch.cat([tip_load(topology, 2, 800.0), tip_load(topology, 4, 90.0)])
    together = solve_frame(points, topology, batch, loads.expand(2, -1, -1, -1), E, G).displacement
    alone = solve_frame(points, topology, sections, loads[1:], E, G).displacement
    assert together.shape == (2, 2, 4, 6)
    assert torch.allclose(together[0, 1], alone[0], rtol=1e-12, atol=0)
    assert torch.allclose(together[1], 0.5 * together[0], rtol=1e-10, atol=1e-18)


def test_gradients_of_displacement_and_force_equal_differences(reference):
    points, topology, sections, loads, e, g = case_frame(reference("structures_frame_wing_booms"), "nu=0.33", parts=1)

    def measures(x):
        scaled = BeamSections(*(getattr(sections, f) * (1 + x[0]) for f in BeamSections.__dataclass_fields__))
        moved = points * torch.stack([number(1.0) + x[1], number(1.0) + x[2], number(1.0)])
        solution = solve_frame(moved, topology, scaled, loads * (1 + x[3]), e, g)
        return torch.stack([solution.displacement[0, 7, 2], 1e-6 * solution.end_forces[0, 0, 4]])

    x = torch.tensor([0.05, 0.1, -0.1, 0.2], dtype=torch.float64)
    differences = central_difference(measures, x, 1e-3)
    for jacobian in (torch.func.jacrev(measures)(x), torch.func.jacfwd(measures)(x)):
        assert torch.allclose(jacobian, differences, rtol=1e-8, atol=1e-10)


def test_a_mechanism_is_refused():
    points, topology, sections = cantilever()
    loose = Topology(topology.elements, topology.up, torch.zeros_like(topology.is_fixed))
    with pytest.raises(ValueError, match="supports are not allowed"):
        solve_frame(points, loose, sections, tip_load(topology, 2, 1.0), E, G)
