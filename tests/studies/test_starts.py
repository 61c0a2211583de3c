"""Scattered starts: what is drawn, that starts stand alone, and that several optima are found, named and told apart."""

import html
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch
from analytic_studies import Plane, circles, plane_problem
from click.testing import CliRunner

from lpc_mdo.cli import main
from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.problems.problem import Objective, Problem
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.runner import StudyRun
from lpc_mdo.studies.start_summary import NEAR, summarize
from lpc_mdo.studies.starts import Scatter, scattered_starts


@pytest.fixture(scope="module")
def scatter() -> Scatter:
    return scattered_starts(*load(), None, 5, seed=3, reach=0.25).problems


def test_starts_lie_within_the_reach_of_the_baseline_and_within_the_bounds(scatter):
    problem = scatter.problem
    starts = torch.stack([scatter.start(number) for number in range(1, 201)])
    assert bool(((starts >= problem.lower) & (starts <= problem.upper)).all())
    away = (starts - problem.x0).abs()
    assert float(away.max()) <= 2.0 * 0.25
    # Variables whose reach no bound cuts are uniform: standard deviation of their width over the root of twelve.
    whole = (problem.x0 - 0.5 > problem.lower) & (problem.x0 + 0.5 < problem.upper)
    assert int(whole.sum()) > 20
    assert float(starts[:, whole].std(0).mean()) == pytest.approx(1.0 / 12.0**0.5, rel=0.02)


def test_a_start_depends_on_seed_and_number_alone(scatter):
    again = scattered_starts(*load(), None, 100, seed=3, reach=0.25).problems
    assert torch.equal(scatter.start(4), again.start(4))
    assert not torch.equal(scatter.start(4), scatter.start(5))
    assert not torch.equal(scatter.start(4), replace(scatter, seed=4).start(4))
    (problem,) = again([4.0])
    torch.testing.assert_close(problem.x0, again.start(4), rtol=0.0, atol=1e-12)


def test_the_violation_of_a_start_is_that_of_its_worst_row(scatter):
    x, problem = scatter.start(2), scatter.problem
    _, values = problem.evaluate(x)
    worst = max(float((problem.constraint_lower - values).max()), float((values - problem.constraint_upper).max()), 0.0)
    assert scatter.violations([1, 2])[1] == pytest.approx(worst, rel=1e-9)
    assert worst > 0.0


@dataclass(frozen=True)
class Valleys:
    """Valleys near x = -1 and x = 1, the second the deeper; start k lies at x = -1.5 + 0.5 k, y = 0.1 k."""

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        objective = Objective("valleys", "m^2", lambda p: (p.x**2 - 1.0) ** 2 + p.y**2 - 0.1 * p.x + 5.0)
        problem = plane_problem(Plane(), objective)
        x, y = problem.variables
        return [
            replace(problem, variables=(replace(x, initial=-1.5 + 0.5 * v), replace(y, initial=0.1 * v)))
            for v in values
        ]


@pytest.fixture(scope="module")
def valleys(tmp_path_factory):
    study = replace(circles([0.9, 1.0, 4.9, 5.0, 5.1]), kind="starts", method="scatter", problems=Valleys())
    folder = tmp_path_factory.mktemp("valleys")
    return study, folder, StudyRun(study, folder, InProcess()).run()


def test_every_start_is_on_its_own_and_resuming_repeats_none(valleys):
    """No start is handed a neighbour's better design: that would hide the worse optimum."""
    study, folder, content = valleys
    assert [point["start"] for point in content["points"]] == [None] * 5
    assert all(point["slope"]["from_points"] is None for point in content["points"])
    stamps = {file: file.stat().st_mtime_ns for file in folder.glob("points/*/*")}
    StudyRun(study, folder, InProcess()).run(is_resuming=True)
    assert stamps == {file: file.stat().st_mtime_ns for file in folder.glob("points/*/*")}


def test_the_other_optimum_is_named_and_told_apart(valleys):
    """Minima of (x^2 - 1)^2 - x/10: the real roots of 4 x^3 - 4 x - 1/10."""
    _, folder, content = valleys
    summary = summarize(content, folder, [0.0] * 5)
    left, _, right = sorted(np.roots([4.0, 0.0, -4.0, -0.1]).real)
    assert (summary["converged"], summary["near_best"]) == (5, 3)
    assert [row["optimum"] for row in summary["starts"]] == ["B", "B", "A", "A", "A"]
    best, other = summary["optima"]
    (largest, *_) = other["from_best"]
    assert (largest["name"], largest["unit"]) == ("x", "m")
    assert (largest["here"], largest["there"]) == pytest.approx((left, right), abs=1e-4)
    assert largest["share"] == pytest.approx((right - left) / 4.0, abs=1e-4)  # x may lie between -2 and 2
    assert best["from_best"] == ()
    assert best["within"] == () or best["within"][0]["share"] < 1e-4
    value = [(x * x - 1.0) ** 2 - 0.1 * x + 5.0 for x in (left, right)]
    assert summary["starts"][0]["distance_to_best"] == pytest.approx(value[0] / value[1] - 1.0, rel=1e-4)
    assert value[0] / value[1] - 1.0 > NEAR
    assert summary["verdict"].startswith(
        "2 optima: 5 certified starts of 5 end at A (3), B (2); the best is unique: designs"
    )
    assert summary["flatness"]["starts"] == 3
    assert summary["flatness"]["directions"] == 0


@dataclass(frozen=True)
class Groove:
    """A groove along x + y = 1/2, flat from end to end: start k lies at x = -1.5 + 0.5 k, y = 0.1 k."""

    def __call__(self, values: Sequence[float]) -> list[Problem]:
        problem = plane_problem(Plane(), Objective("groove", "m^2", lambda p: (p.x + p.y - 0.5) ** 2 + 1.0))
        x, y = problem.variables
        return [
            replace(problem, variables=(replace(x, initial=-1.5 + 0.5 * v), replace(y, initial=0.1 * v)))
            for v in values
        ]


def test_an_optimum_that_is_flat_is_told_with_its_direction(tmp_path):
    """Designs of one groove lie apart along one line, on which both variables move alike."""
    study = replace(circles([0.9, 2.0, 3.1]), kind="starts", method="scatter", problems=Groove())
    content = StudyRun(study, tmp_path, InProcess()).run()
    summary = summarize(content, tmp_path, [0.0] * 3)
    flatness = summary["flatness"]
    assert (flatness["starts"], flatness["directions"]) == (3, 1)
    assert {each["name"] for each in flatness["free"]} == {"x", "y"}
    assert all((each["free"], each["of"]) == (1, 1) for each in flatness["free"])
    widths = [each["widest"]["here"] - each["widest"]["there"] for each in flatness["free"]]
    assert widths[0] == pytest.approx(widths[1], rel=1e-4)
    assert flatness["largest"] == pytest.approx(widths[0] / 4.0, rel=1e-4)  # both may lie between -2 and 2
    assert "one optimum: all 3 certified starts of 3" in summary["verdict"]
    assert "is flat" in summary["verdict"]
    assert "along 1 direction, in " in summary["verdict"]


def test_starts_without_a_certificate_have_no_optimum(valleys):
    _, folder, content = valleys
    points = [dict(point) for point in content["points"]]
    points[4] |= {"status": "failed", "objective": None, "counts": None, "time_s": None}
    points[3] |= {"status": "iteration_limit", "objective": 0.0}
    summary = summarize(content | {"points": points}, folder, [0.0, 0.0, 0.0, 0.0, float("inf")])
    assert (summary["converged"], summary["near_best"], summary["best_start"]) == (3, 1, 3)
    assert [row["optimum"] for row in summary["starts"]] == ["B", "B", "A", None, None]
    assert summary["starts"][4]["initial_violation"] is None
    assert "a single start ends at the best" in summary["verdict"]
    json.dumps(summary, allow_nan=False)


def test_a_scatter_that_cannot_be_is_refused():
    with pytest.raises(ConfigurationError, match="--starts 1 is not allowed"):
        scattered_starts(*load(), None, 1)
    with pytest.raises(ConfigurationError, match="--reach 2 is not allowed; it must lie between 0 and 1"):
        scattered_starts(*load(), None, 3, reach=2.0)


def invoke(command, folder):
    return CliRunner().invoke(main, [*command.split(), "--output", str(folder)])


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("optimize --seed 1", "--seed is not allowed without --starts"),
        ("optimize --jobs 2", "--jobs is not allowed without --starts"),
        ("optimize --starts 3 --start there", "--start is not allowed with --starts"),
        ("optimize --starts 3 --reach 0", "--reach 0 is not allowed; it must lie between 0 and 1"),
    ],
)
def test_options_that_contradict_each_other_are_refused(tmp_path, command, message):
    result = invoke(command, tmp_path / "out")
    assert result.exit_code == 2
    assert message in result.stderr
    assert not (tmp_path / "out").exists()


def test_the_best_start_is_the_result_of_the_run(tmp_path):
    result = invoke("optimize --problem aeroacoustic --noise-weight 0 --starts 2 --reach 0.02 --seed 1", tmp_path)
    assert result.exit_code == 0, result.output
    assert "2 of 2 starts converged" in " ".join(result.output.split())
    summary, run = (json.loads((tmp_path / name).read_text()) for name in ("starts.json", "result.json"))
    best = min(row["objective"] for row in summary["starts"])
    assert summary["verdict"] in " ".join(result.output.split())
    assert summary["verdict"] in html.unescape((tmp_path / "report.html").read_text())
    assert run["status"] == "converged"
    assert run["objective"]["value"] == pytest.approx(best, rel=1e-7)
    baseline = json.loads((tmp_path / "starts/points/00_1/result.json").read_text())["objective"]["initial"]
    assert run["objective"]["initial"] != baseline  # the run's start is the baseline, not the scattered one
    for name in ("starts.svg", "starts.png", "history.csv", "analysis.json", "report.html"):
        assert (tmp_path / name).stat().st_size > 0
