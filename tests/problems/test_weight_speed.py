"""Weight against speed: the sum of both with the speed as a variable, and what more speed costs."""

from dataclasses import replace

import pytest
import torch
from conftest import central_difference
from joblib import delayed

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.numerics.workers import side_by_side
from lpc_mdo.optimization import Options
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.reduced import reduced, reduced_problem
from lpc_mdo.problems.weight_speed import MASS_SCALE, MachRange, weight_speed_front
from lpc_mdo.reporting.stored import StoredStudy
from lpc_mdo.reporting.weight_parts import weight_parts
from lpc_mdo.studies.pareto import speed_slope, weight_speed_sum
from lpc_mdo.studies.runs import optimize


@pytest.fixture(scope="module")
def problems():
    return weight_speed_front(*load(), [0.0, 0.4, 1.0])


def test_the_speed_is_one_variable_more_between_mach_017_and_019(problems):
    published, (first, *_) = gross_weight_problem(*load()), problems
    assert first.size == published.size + 1 == 110
    speed = first.variables[-1]
    sound = float(standard_atmosphere(torch.tensor(1006.0, dtype=torch.float64), 0.0).speed_of_sound)
    assert (speed.name, speed.unit) == ("cruise_speed", "m/s")
    assert (speed.lower / sound, speed.upper / sound) == pytest.approx((0.17, 0.19), rel=1e-12)
    assert speed.initial == load()[1].speed("cruise")
    assert [row.name for row in first.constraints] == [
        "stall_margin" if row.name == "stall_speed" else row.name for row in published.constraints
    ]


def test_at_the_missions_speed_everything_else_is_the_published_problem(problems):
    published, (first, *_) = gross_weight_problem(*load()), problems
    with torch.no_grad():
        ours, theirs = first.analyze(first.x0), published.analyze(published.x0)
    torch.testing.assert_close(ours.gross_mass, theirs.gross_mass, rtol=1e-13, atol=0.0)
    torch.testing.assert_close(ours.scaled_trim, theirs.scaled_trim, rtol=1e-9, atol=1e-12)
    by_name = {row.name: row for row in (*first.constraints, *published.constraints)}
    margin, stall = by_name["stall_margin"], by_name["stall_speed"]
    torch.testing.assert_close(margin.of(ours) - margin.lower, stall.upper - stall.of(theirs), rtol=1e-9, atol=1e-9)


def test_the_sum_weighs_a_hundred_kilograms_as_much_as_the_whole_range_of_speed(problems):
    lightest, both, fastest = problems
    speed = both.variables[-1]
    with torch.no_grad():
        a = both.analyze(both.x0)
    mass, share = float(a.gross_mass) / MASS_SCALE, float(a.main_segment.speed) / (speed.upper - speed.lower)
    values = [float(problem.objective.of(a)) for problem in (lightest, both, fastest)]
    assert values == pytest.approx([mass, 0.6 * mass - 0.4 * share, -share], rel=1e-13)


def test_gradient_of_the_speed_equals_central_differences(problems):
    problem = problems[1]
    x = problem.x0.clone()
    x[-1] = 0.2

    def along(value):
        f, c = problem.evaluate(torch.cat([x[:-1], value[None]]))
        return torch.cat([f[None], c])

    exact = torch.autograd.functional.jacobian(along, x[-1])
    torch.testing.assert_close(exact, central_difference(along, x[-1], 1e-4)[:, 0], rtol=1e-6, atol=1e-8)
    assert torch.count_nonzero(exact) > 5


def test_slope_is_that_of_the_line_of_equal_sums_and_none_on_a_bound_of_the_speed(problems):
    _, both, fastest = problems
    speed, x = both.variables[-1], both.x0.clone()
    x[-1] = 0.3
    expected = 0.4 / 0.6 * MASS_SCALE / (speed.upper - speed.lower)
    assert speed_slope(0.4, both, x, x) == pytest.approx(expected, rel=1e-12)
    assert speed_slope(1.0, fastest, x, x) is None
    for end in (-1.0, 1.0):
        x[-1] = end
        assert speed_slope(0.4, both, x, x) is None


def test_at_the_pure_speed_end_mass_is_not_minimized(problems):
    """Any feasible aircraft at the largest speed is an optimum: the certificate asks nothing of its mass."""
    content = optimize(reduced(problems[2]), solver="sqp", options=Options(time_limit=300.0))
    assert content.is_converged
    outputs = content.outputs
    assert outputs["cruise_speed_m_per_s"] == pytest.approx(problems[2].variables[-1].upper, rel=1e-9)
    fixed = reduced_problem(*load(overrides=[f"mission.cruise.speed_m_per_s={outputs['cruise_speed_m_per_s']!r}"]))
    lighter = optimize(fixed, solver="sqp", options=Options(time_limit=300.0))
    assert lighter.is_converged
    assert outputs["gross_mass_kg"] > lighter.outputs["gross_mass_kg"] * 1.02


def test_the_study_travels_to_other_processes_and_has_evenly_spaced_weights():
    study = weight_speed_sum(*load(), points=5)
    assert study.values == (0.0, 0.25, 0.5, 0.75, 1.0)
    (values,) = side_by_side(2, [delayed(getattr)(study, "values")])
    assert values == study.values
    assert study.origins == (1, 2, None, 2, None)  # at weight 1 a neighbour's optimum would be one already
    assert [axis.name for axis in study.axes] == ["cruise_speed_m_per_s", "gross_mass_kg"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MachRange(0.19, 0.17), r"Mach numbers 0\.19 to 0\.17 are invalid: they must increase"),
        (lambda: MachRange(float("nan"), 0.17), "Mach numbers nan to 0.17 are invalid"),
        (lambda: weight_speed_front(*load(), [1.5]), r"speed weight = 1\.5 is invalid: it must lie between 0 and 1"),
        (lambda: weight_speed_sum(*load(), points=1), "--points 1 is not allowed; a front needs at least 2"),
        (
            lambda: weight_speed_sum(*load(overrides=["mission.cruise.speed_m_per_s=80"])),
            r"cruise.speed_m_per_s = 80 is invalid: with the speed as a variable it must lie between 57\.19 and 63\.92",
        ),
    ],
)
def test_fronts_that_cannot_be_are_refused(make, message):
    with pytest.raises(ConfigurationError, match=message):
        make()


def stored(groups):
    points, results = [], {}
    for i, (speed, masses) in enumerate(groups):
        folder = f"points/{i}"
        is_on_front = i != 1
        points.append({"position": [speed, sum(masses.values())], "folder": folder, "is_on_front": is_on_front})
        results[folder] = {"outputs": {"mass_breakdown_kg": masses}}
    return StoredStudy(None, {"name": "weight-speed", "points": points}, results)


def test_parts_of_the_cost_add_up_to_it():
    slow = {
        "wing": 300.0,
        "booms": 100.0,
        "lift_motors": 150.0,
        "pusher_motor": 40.0,
        "battery": 700.0,
        "fixed": 1300.0,
    }
    fast = slow | {"wing": 310.0, "battery": 760.0, "pusher_motor": 45.0}
    heavy = fast | {"battery": 900.0}
    first, second = weight_parts(stored([(63.0, fast), (63.0, heavy), (57.0, slow), (57.0, slow)]))
    assert (first.speed, second.speed) == (57.0, 63.0)  # the dominated one is no part of the front
    assert second.parts["battery"] - first.parts["battery"] == 60.0
    assert second.parts["structure"] - first.parts["structure"] == 10.0
    assert second.parts["motors"] - first.parts["motors"] == 5.0
    for row in (first, second):
        assert sum(row.parts.values()) == pytest.approx(row.total - 1300.0, rel=1e-14)
    other = replace(stored([(57.0, slow)]), content={"name": "noise-efficiency", "points": []})
    assert weight_parts(other) == []
