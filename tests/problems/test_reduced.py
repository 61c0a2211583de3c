"""The reduced formulation is the published problem on its mirror-symmetric designs: values, gradients, optimum."""

import json
from types import SimpleNamespace

import pytest
import torch
from click.testing import CliRunner
from conftest import REFERENCE
from stored_files import result, variable

from lpc_mdo.cli import main
from lpc_mdo.config import load
from lpc_mdo.config.layout import mirror_pairs, own_rotors
from lpc_mdo.problems.gross_weight import with_motors_that_hover
from lpc_mdo.problems.reduced import reduced_problem
from lpc_mdo.reporting.sensitivities import sensitivities
from lpc_mdo.studies.single import solve

SETTLED = ("altitude_match", "rotor_symmetry", "motor_symmetry")


@pytest.fixture(scope="module")
def reduced():
    return reduced_problem(*load())


def published_x(problem, reduced, x):
    """The design of scaled x (..., 68) in the scaled variables of the published problem (..., 109), differentiable."""
    design = reduced.unpack(x)
    parts = [design.values()[v.name].reshape(*x.shape[:-1], v.count) for v in problem.variables]
    return (torch.cat(parts, dim=-1) - problem._middle) / problem._half_range


def designs(reduced):
    """Start, optimum of the published problem, and two designs between and beside them, which no row favours (4, 68)."""
    stored = json.loads((REFERENCE / "optimum.json").read_text())["design"]
    own, _ = own_rotors(reduced.analyze_design.vehicle)
    rotor_rows = {v.name: own[: v.size[0]] for v in reduced.variables if v.size and v.size[0] in (4, 5)}
    rotor_rows.pop("wing_twist")
    values = {
        name: [stored[name][i] for i in rotor_rows[name]] if name in rotor_rows else stored[name] for name in stored
    }
    optimum = reduced.scaled(values)
    generator = torch.Generator().manual_seed(5)
    share, noise = (torch.rand(2, reduced.size, generator=generator, dtype=torch.float64) for _ in range(2))
    beside = (reduced.x0 + share * (optimum - reduced.x0) + 0.1 * (noise - 0.5)).clamp(-1.0, 1.0)
    return torch.cat([reduced.x0[None], optimum[None], beside])


def rows_by_name(problem, x):
    objective, rows = problem.evaluate(x)
    names = [constraint.name for constraint in problem.constraints]
    parts = rows.split(problem.row_sizes, dim=-1)
    return objective, dict(zip(names, parts, strict=True))


def test_one_side_is_designed_and_nothing_is_equated(problem, reduced):
    pairs = len(mirror_pairs(reduced.analyze_design.vehicle))
    # A lift rotor has its radius, four twists, two chords, a speed, and its motor's length and diameter.
    assert problem.size - reduced.size == 10 * pairs + 1
    assert len(problem.constraints) - len(reduced.constraints) == 2 * pairs + 1
    assert not any(row.kind == "equality" for row in reduced.constraints if row.name != "trim_residual")


def test_values_are_those_of_the_published_problem(problem, reduced):
    x = designs(reduced)
    with torch.no_grad():
        objective, rows = rows_by_name(reduced, x)
        published_objective, published_rows = rows_by_name(problem, published_x(problem, reduced, x))
    torch.testing.assert_close(objective, published_objective, rtol=1e-13, atol=0.0)
    for name, values in published_rows.items():
        if name.startswith(SETTLED):
            assert float(values.abs().max()) < 1e-12
        else:
            kept = rows[name]
            torch.testing.assert_close(values, kept.expand_as(values), rtol=1e-12, atol=1e-12)


def test_gradients_are_those_of_the_published_problem_by_the_chain_rule(problem, reduced):
    x = designs(reduced).requires_grad_()
    generator = torch.Generator().manual_seed(6)
    objective, rows = rows_by_name(reduced, x)
    published_objective, published_rows = rows_by_name(problem, published_x(problem, reduced, x))
    for name, values in {"gross_mass": objective[..., None], **rows}.items():
        other = published_objective[..., None] if name == "gross_mass" else published_rows[name]
        if name.startswith("tip_clearance"):
            other = other[..., :1]
        weights = torch.randn(values.shape[-1], generator=generator, dtype=torch.float64)
        (own,) = torch.autograd.grad((values * weights).sum(), x, retain_graph=True)
        (theirs,) = torch.autograd.grad((other * weights).sum(), x, retain_graph=True)
        torch.testing.assert_close(own, theirs, rtol=1e-10, atol=1e-11 * float(theirs.abs().max()))


def test_every_output_of_the_analysis_has_all_rotors(problem, reduced):
    x = designs(reduced)[1]
    with torch.no_grad():
        ours, theirs = reduced.analyze(x), problem.analyze(published_x(problem, reduced, x))
    for part in ("thrust", "torque", "tip_mach", "angle_of_attack", "figure_of_merit"):
        torch.testing.assert_close(getattr(ours.propulsion.loads, part), getattr(theirs.propulsion.loads, part))
    torch.testing.assert_close(ours.propulsion.operation.efficiency, theirs.propulsion.operation.efficiency)
    torch.testing.assert_close(ours.propulsion.torque_share, theirs.propulsion.torque_share)
    _, place = own_rotors(reduced.analyze_design.vehicle)
    torch.testing.assert_close(ours.noise.rotor_dba[..., place[:-1]], theirs.noise.rotor_dba)
    for level in ("total_dba", "tonal_dba", "broadband_dba", "total_db"):
        torch.testing.assert_close(getattr(ours.noise, level), getattr(theirs.noise, level), rtol=1e-12, atol=0.0)
    torch.testing.assert_close(ours.scaled_trim, theirs.scaled_trim, rtol=1e-10, atol=1e-12)


def test_sensitivities_are_those_of_the_published_problem(problem, reduced):
    """Of the objective and the limits that both have: multipliers of the rows that only equate variables are zero."""
    x, unequal = designs(reduced)[1], torch.linspace(0.5, 1.5, len(reduced.constraints), dtype=torch.float64)
    by_name = {row.name: share for row, share in zip(reduced.constraints, unequal, strict=True)}

    def changes(some, at):
        parts = [
            # A row with one component a side: half of the multiplier on either.
            torch.full(
                (size,), float(by_name.get(row.name, 0.0)) / (size if row.is_two_sided else 1), dtype=torch.float64
            )
            for row, size in zip(some.constraints, some.row_sizes, strict=True)
        ]
        answers = sensitivities(some, SimpleNamespace(x=at, multipliers=torch.cat(parts)))
        return {answer.label: answer.per_percent for answer in answers if answer.kind != "bound"}

    ours, theirs = changes(reduced, x), changes(problem, published_x(problem, reduced, x))
    assert len(theirs) > 15
    assert ours == pytest.approx(theirs, rel=1e-6, abs=1e-6)  # kg; central differences of 1e-4 lose as many digits


def test_optimum_is_that_of_the_published_problem(reduced):
    # The stored one is the published formulation's; a fiftieth of the way back to the start is no stationary point.
    start, optimum = designs(reduced)[:2]
    _, content = solve(reduced, optimum + 0.02 * (start - optimum))
    assert content.is_converged
    stored = json.loads((REFERENCE / "optimum.json").read_text())["objective_kg"]
    assert content.objective.value == pytest.approx(stored, rel=1e-8)


def test_reduced_is_refused_where_it_has_no_meaning(tmp_path):
    arguments = ["optimize", "--problem", "aeroacoustic", "--formulation", "reduced", "--output", str(tmp_path / "run")]
    run = CliRunner().invoke(main, arguments)
    assert run.exit_code == 2
    assert "--formulation reduced is not allowed with --problem aeroacoustic" in run.output
    assert not (tmp_path / "run").exists()


def test_shape_of_a_reduced_result_has_all_rotors(reduced, tmp_path):
    from lpc_mdo.interop.shape_files import stored_shapes

    vehicle = reduced.analyze_design.vehicle
    radii = [1.31, 1.32, 1.33, 1.34, 1.35]
    entries = []
    for own_variable in reduced.variables:
        initial = own_variable.initial_tensor.tolist()
        entries.append(variable(own_variable.name, initial, radii if own_variable.name == "rotor_radius" else initial))
    (tmp_path / "result.json").write_text(json.dumps(result(entries, formulation="reduced")))
    inputs = {"vehicle": vehicle.model_dump(), "mission": reduced.analyze_design.mission.model_dump()}
    (tmp_path / "configuration.json").write_text(json.dumps(inputs))
    _, shapes = stored_shapes(tmp_path / "result.json")
    own, _ = own_rotors(vehicle)
    stored = shapes["after"].rotor_radius
    assert stored[own].tolist() == radii
    for port, starboard in mirror_pairs(vehicle):
        assert stored[port] == stored[starboard]


def test_the_rule_of_the_lift_motors_holds_in_both_formulations(problem, reduced):
    """It is applied anew where a sensitivity to the aircraft's numbers is taken, whatever the formulation."""
    for whole in (problem, reduced):
        again = with_motors_that_hover(whole)
        assert torch.equal(again.x0, whole.x0)
        for one, other in zip(again.variables, whole.variables, strict=True):
            assert torch.equal(one.lower_tensor, other.lower_tensor)
            assert one.reasons == other.reasons
