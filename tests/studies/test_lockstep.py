"""Points of a study in one batch: the same optima, whole run folders, and points that the batch cannot do."""

import csv
import json
from collections.abc import Sequence
from dataclasses import dataclass

import pytest
import torch
from analytic_studies import Plane, circles, distances, plane_problem, valleys

from lpc_mdo.optimization import Options
from lpc_mdo.problems.problem import Constraint, Objective, Problem
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.lockstep import Lockstep
from lpc_mdo.studies.runner import StudyRun
from lpc_mdo.studies.together import solve_together


def together(study, folder, **options):
    return StudyRun(study, folder, Lockstep(11), options=Options(**options)).run()


def test_a_batch_gives_the_points_that_single_runs_give(tmp_path):
    study = circles([0.1, 0.3, 0.5, 0.7, 0.9])
    one, other = together(study, tmp_path / "a"), StudyRun(study, tmp_path / "b", InProcess()).run()
    for ours, alone in zip(one["points"], other["points"], strict=True):
        assert ours["status"] == "converged"
        assert ours["start"] is None
        assert ours["position"] == pytest.approx(alone["position"], abs=1e-5)
        assert ours["slope"]["from_multipliers"] == alone["slope"]["from_multipliers"]
        assert set(ours) == set(alone)


def test_every_point_keeps_the_designs_that_it_looked_at(tmp_path):
    """From its start to its optimum, in its own folder: (x, y) = (0.3, 0.7) weighs both squared distances."""
    content = together(circles([0.25, 0.75]), tmp_path)
    for point in content["points"]:
        folder, weight = tmp_path / point["folder"], point["value"]
        rows = list(csv.DictReader((folder / "evaluations.csv").read_text().splitlines()))
        first, second = 1.3**2 + 0.7**2, 0.7**2 + 0.7**2
        assert float(rows[0]["sum_m^2"]) == pytest.approx(weight * first + (1.0 - weight) * second, abs=1e-5)
        assert float(rows[-1]["sum_m^2"]) == pytest.approx(point["objective"], abs=1e-5)
        result = json.loads((folder / "result.json").read_text())
        assert result["counts"]["evaluations"] >= len(rows)
        assert (folder / "history.csv").stat().st_size > 0


def test_a_local_optimum_is_still_bettered_from_a_neighbour(tmp_path):
    points = together(valleys((0.2, 0.4, 4.0)), tmp_path)["points"]
    assert [point["status"] for point in points] == ["converged"] * 3
    for point in points:
        result = json.loads((tmp_path / point["folder"] / "result.json").read_text())
        assert result["design_variables"][0]["value"] > 0.9


def test_points_that_have_no_problem_fail_alone(tmp_path):
    points = together(circles((-0.5, 0.2, 0.8)), tmp_path)["points"]
    assert [point["status"] for point in points] == ["failed", "converged", "converged"]


def test_a_point_without_an_optimum_says_so_as_it_does_alone(tmp_path):
    study, options = distances([-3.0, 0.2]), Options(outer_iterations=1, inner_iterations=1, newton_iterations=0)
    one = StudyRun(study, tmp_path / "a", Lockstep(11)).run()["points"]
    assert [point["status"] for point in one] == ["infeasible", "converged"]  # the bounds end at -2
    for executor, folder in ((Lockstep(11), "b"), (InProcess(), "c")):
        points = StudyRun(study, tmp_path / folder, executor, options=options).run()["points"]
        assert points[1]["status"] == "iteration_limit"


def test_a_study_begun_in_a_batch_is_resumed_without_repeating_a_point(tmp_path):
    study = circles([0.2, 0.5, 0.8])
    first = together(study, tmp_path)
    (tmp_path / first["points"][1]["folder"] / "point.json").unlink()
    stamps = {file: file.stat().st_mtime_ns for file in tmp_path.glob("points/*/point.json")}
    again = StudyRun(study, tmp_path, Lockstep(11)).run(is_resuming=True)
    assert all(file.stat().st_mtime_ns == stamp for file, stamp in stamps.items())
    assert again["points"][1]["position"] == pytest.approx(first["points"][1]["position"], abs=1e-5)


def test_a_batch_of_problems_with_different_limits(tmp_path):
    """Left of a wall: each point has its own limit and its own pressure on it."""
    study = distances((0.2, 0.4, 0.6))
    for point in together(study, tmp_path)["points"]:
        assert point["position"][1] == pytest.approx((1.0 - point["value"]) ** 2, abs=1e-5)
        assert point["multipliers"]["wall"] == pytest.approx(2.0 * (1.0 - point["value"]), rel=1e-3)


@dataclass(frozen=True)
class OnALine:
    """Weighted squared distances from (-1, 0) and (1, 0) on the line y = 2 x + 0.1: one equation of two variables."""

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        line = Constraint("line", "m", lambda p: p.y - 2.0 * p.x, 0.1, 0.1, scale=0.5)
        plane = Plane()
        return [plane_problem(plane, self.objective(value), (line,)) for value in values]

    def objective(self, weight: float) -> Objective:
        return Objective("sum", "m^2", lambda p: weight * p.first + (1.0 - weight) * p.second, scale=2.0)


def test_equations_of_two_variables_are_solved_beforehand_and_have_their_multipliers():
    """Least w |p + e|^2 + (1 - w) |p - e|^2 on the line: x = (1 - 2 w - 0.2)/5, and d optimum / d 0.1 = 2 y."""
    weights = (0.2, 0.7)
    problems = OnALine()(weights)
    for weight, problem, ending in zip(weights, problems, solve_together(problems), strict=True):
        result = ending.unwrap()
        x = (1.0 - 2.0 * weight - 0.2) / 5.0
        found = problem.physical(result.x)
        assert result.status == "converged"
        assert result.certificate.holds(1e-4, 1e-6)
        assert float(found["x"]) == pytest.approx(x, abs=1e-5)
        assert float(found["y"]) == pytest.approx(2.0 * float(found["x"]) + 0.1, abs=1e-12)
        slope = -float(result.multipliers[1]) * problem.objective.scale / 0.5
        assert slope == pytest.approx(2.0 * (2.0 * x + 0.1), abs=1e-4)
        objective, rows = problem.evaluate(result.x)
        assert result.objective == pytest.approx(float(objective), rel=1e-12)
        torch.testing.assert_close(result.constraints, rows)
