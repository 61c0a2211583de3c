"""Fronts: who is dominated, where the two methods differ, and both slopes against closed forms."""

import math

import pytest
from analytic_studies import arcs, circles
from hypothesis import given
from hypothesis import strategies as st

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.pareto import noise_efficiency, noise_efficiency_between, non_dominated, weight_speed
from lpc_mdo.studies.runner import StudyRun
from lpc_mdo.studies.study_file import assemble, entry_of, parabola_slope

points = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1, max_size=12)
goals = st.tuples(*[st.sampled_from(["minimize", "maximize"])] * 2)


def run(study, folder, solver="slsqp"):
    return StudyRun(study, folder, InProcess(), solver).run()


@given(points, goals)
def test_nobody_on_the_front_is_dominated_and_everybody_else_is_by_someone_on_it(positions, goals):
    on_front = non_dominated(positions, goals)

    def beats(one, other):
        gains = [(b - a) if goal == "minimize" else (a - b) for a, b, goal in zip(one, other, goals, strict=True)]
        return min(gains) >= 0 and max(gains) > 0

    front = [p for p, is_on in zip(positions, on_front, strict=True) if is_on]
    assert front
    for position, is_on in zip(positions, on_front, strict=True):
        assert is_on != any(beats(other, position) for other in front)


def test_optima_that_are_one_to_the_solver_do_not_dominate_each_other():
    positions = [(57.19, 2836.2201), (57.19, 2836.2200), (60.0, 2850.0), (57.19, 2837.0), (56.0, 2836.22001)]
    assert non_dominated(positions, ("maximize", "minimize"), 1e-7) == [True, True, True, False, False]
    assert non_dominated(positions[:2], ("maximize", "minimize")) == [False, True]


def test_weighted_sums_trace_the_front_of_two_circles_with_its_slope(tmp_path):
    """Squared distances from two points 2 m apart: sqrt(first) + sqrt(second) = 2 between them."""
    content = run(circles([0.1, 0.25, 0.4, 0.5, 0.6, 0.75, 0.9]), tmp_path)
    for point in content["points"]:
        weight, (first, second) = point["value"], point["position"]
        assert point["is_on_front"] is True
        assert math.sqrt(first) + math.sqrt(second) == pytest.approx(2.0, abs=1e-6)
        assert first == pytest.approx(4.0 * (1.0 - weight) ** 2, abs=1e-5)
        assert point["slope"]["from_multipliers"] == pytest.approx(-weight / (1.0 - weight), rel=1e-12)


def test_the_slope_of_the_points_tends_to_that_of_the_multipliers_with_the_square_of_their_distance(tmp_path):
    differences = []
    for step in (0.1, 0.05):
        middle = run(circles([0.5 - step, 0.5, 0.5 + step]), tmp_path / str(step))["points"][1]["slope"]
        differences.append(abs(middle["from_points"] - middle["from_multipliers"]))
    assert differences[0] < 0.05
    assert differences[1] == pytest.approx(differences[0] / 4.0, rel=0.1)


def test_weighted_sums_leave_the_gap_that_the_epsilon_constraint_fills(tmp_path):
    """On the arc first^2 + second^2 = 1 both are to be small: it bulges away, and only its ends minimize a sum."""
    # Slopes alone end at a maximum along the arc, which is stationary; curvature leads on from there.
    sums = run(arcs([0.2, 0.4, 0.6, 0.8], "weighted-sum"), tmp_path / "sums", "sqp")
    for point in sums["points"]:
        assert point["status"] == "converged"
        assert sorted(point["position"]) == pytest.approx([0.0, 1.0], abs=1e-5)
    values = [0.2, 0.4, 0.6, 0.8]
    filled = run(arcs(values, "epsilon-constraint"), tmp_path / "filled")
    for point, value in zip(filled["points"], values, strict=True):
        assert point["is_on_front"] is True
        assert point["position"] == pytest.approx([value, math.sqrt(1.0 - value**2)], abs=1e-6)
        slope = -value / math.sqrt(1.0 - value**2)
        assert point["slope"]["from_multipliers"] == pytest.approx(slope, rel=1e-4)
    slopes = [point["slope"] for point in filled["points"][1:3]]
    assert all(s["from_points"] == pytest.approx(s["from_multipliers"], rel=0.1) for s in slopes)


def entry(study, index, position, status="converged"):
    content = {
        "status": status,
        "message": "",
        "objective": {"value": 0.0},
        "outputs": dict(zip(("first", "second"), position, strict=True)),
        "constraints": [],
        "certificate": {},
        "counts": {},
    }
    return entry_of(study, index, content, None)


def test_dominated_and_uncertified_points_are_marked_and_are_no_part_of_the_front():
    study = circles([0.1, 0.2, 0.3, 0.4, 0.5])
    entries = [
        entry(study, 0, (3.0, 1.0)),
        entry(study, 1, (2.0, 2.0)),
        entry(study, 2, (2.5, 2.5)),
        entry(study, 3, (0.5, 0.5), "iteration_limit"),
        None,
    ]
    content = assemble(study, entries, {"wall_s": 0.0, "processor_s": 0.0})
    assert [point["is_on_front"] for point in content["points"]] == [True, True, False, False, False]
    assert content["points"][4]["status"] == "pending"
    assert all(point["slope"]["from_points"] is None for point in content["points"])  # two points make no parabola


def test_the_parabola_has_the_slope_of_a_parabola_at_uneven_points():
    row = [(x, 3.0 * x**2 - x) for x in (0.0, 0.2, 1.0, 1.1)]
    assert [parabola_slope(i, row) for i in range(4)] == pytest.approx([6.0 * x - 1.0 for x, _ in row])
    assert parabola_slope(0, row[:2]) is None
    assert parabola_slope(1, [(0.0, 0.0), (0.0, 1.0), (1.0, 2.0)]) is None


def test_published_front_has_eleven_weights_and_the_speeds_lie_eleven_per_cent_apart():
    assert noise_efficiency(*load()).values == pytest.approx([i / 10 for i in range(11)])
    speeds = weight_speed(None, None).values
    assert speeds[0] == load()[1].speed("cruise")
    assert speeds[-1] / speeds[0] == pytest.approx(1.11)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: noise_efficiency(*load(), points=1), "--points 1 is not allowed"),
        (lambda: noise_efficiency_between(*load(), (0.7, 0.6)), "span no front"),
        (lambda: weight_speed(None, None, speeds=[60.0]), "--values 60 is not allowed"),
        (lambda: weight_speed(None, None, speeds=[60.0, 600.0]), "it must lie between 20 and 120"),
    ],
)
def test_fronts_that_cannot_be_are_refused(make, message):
    with pytest.raises(ConfigurationError, match=message):
        make()
