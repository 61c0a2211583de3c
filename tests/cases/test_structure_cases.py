"""`lpc-mdo analyze structures` through the command line: other codes' figures, closed forms, and what it refuses."""

import json
import math

import pytest
from click.testing import CliRunner
from conftest import FAULTS, REFERENCE

from lpc_mdo.cli import main

INPUT_KEYS = ("points", "segments", "section", "E", "density_for_mass", "loads", "fixed_points", "variants")
PIPE = {"type": "pipe", "outer_radius_m": 0.1, "thickness_m": 0.003}


def run(file):
    return CliRunner().invoke(main, ["analyze", "structures", str(file)])


@pytest.fixture
def answer(tmp_path):
    """Outcome of a case given as plain data."""

    def written(case):
        file = tmp_path / "case.json"
        file.write_text(json.dumps(case))
        return run(file)

    return written


def cantilever(**changes):
    return {
        "points": [[0.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
        "segments": [[0, 1]],
        "section": PIPE,
        "E": 70e9,
        "density_for_mass": 1600.0,
        "loads": [{"point": 1, "dof": 2, "value": 1000.0}],
        "fixed_points": [0],
        "nu": 0.33,
    } | changes


@pytest.mark.parametrize("name", ["structures_frame_L", "structures_frame_wing_booms"])
@pytest.mark.parametrize("is_nested", [False, True])
def test_frames_are_those_of_mystran(reference, answer, name, is_nested):
    # Seven printed digits: 1e-6.
    case = reference(name)
    outcome = answer({"inputs": {k: case[k] for k in INPUT_KEYS}}) if is_nested else run(REFERENCE / f"{name}.json")
    assert outcome.exit_code == 0, outcome.stderr
    results = json.loads(outcome.stdout)["results"]
    assert list(results) == list(case["variants"])
    for variant, ours in results.items():
        theirs = case["variants"][variant]["mystran"]
        for point, displacement in theirs["displacement"].items():
            assert ours["displacement"][point] == pytest.approx(displacement, rel=1e-6, abs=1e-9)
        # MYSTRAN evaluates four points on the bar's axes, which miss the largest where it bends about both.
        on_axes = ours["max_abs_fibre_stress_at_recovery_points"]
        assert on_axes == pytest.approx(theirs["max_abs_fibre_stress"], rel=1e-6)
        assert on_axes <= ours["max_abs_fibre_stress"] <= on_axes * math.sqrt(2.0)
        assert ours["mass"] == pytest.approx(theirs["mass"], rel=1e-6)
        assert ours["cg"] == pytest.approx(theirs["cg"], rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(("tip", "freedom"), [([0.0, 4.0, 0.0], 2), ([0.0, 0.0, 4.0], 0), ([4.0, 0.0, 0.0], 1)])
def test_cantilever_in_any_direction_bends_as_timoshenko_says(answer, tip, freedom):
    load = [{"point": 1, "dof": freedom, "value": 1000.0}]
    results = json.loads(answer({"inputs": cantilever(points=[[0, 0, 0], tip], loads=load)}).stdout)["results"]
    area, moment = math.pi * (0.1**2 - 0.097**2), math.pi / 4 * (0.1**4 - 0.097**4)
    m2 = 0.97**2
    cowper = 6 * 1.33 * (1 + m2) ** 2 / ((7 + 6 * 0.33) * (1 + m2) ** 2 + (20 + 12 * 0.33) * m2)
    expected = 1000.0 * 4.0**3 / (3 * 70e9 * moment) + 1000.0 * 4.0 / (70e9 / 2.66 * cowper * area)
    assert results["displacement"]["1"][freedom] == pytest.approx(expected, rel=1e-10)
    assert results["max_abs_fibre_stress"] == pytest.approx(1000.0 * 4.0 * 0.1 / moment, rel=1e-10)
    assert results["reactions"]["0"][freedom] == pytest.approx(-1000.0, rel=1e-10)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"fixed_points": []}, "fixed_points = [] is not allowed; it must have at least 1"),
        ({"fixed_points": [2]}, "fixed_points[0] = 2 is not allowed; it must lie between 0 and 1"),
        ({"segments": [[0, 0]]}, "segments[0] = [0, 0] is not allowed; its ends coincide"),
        ({"points": [[0, 0, 0], [0, 4, 0], [1, 1, 1]]}, "points[2] is not allowed; no chain of segments"),
        ({"nu": 0.5}, "nu = 0.5 is not allowed; it must be at least 0 and below 0.5"),
        ({"E": -1.0}, "E = -1.0 is not allowed; it must be above 0"),
        ({"section": PIPE | {"thickness_m": 0.2}}, "section.thickness_m = 0.2 is not allowed"),
        ({"section": PIPE | {"area_m2": 0.1}}, "section.area_m2 = 0.1 is not allowed; radius and thickness give"),
        ({"loads": [{"point": 1, "dof": 6, "value": 1.0}]}, "loads[0].dof = 6 is not allowed"),
        (
            {"loads": [{"point": 1, "dof": 2, "value": math.nan}]},
            "loads[0].value = nan is invalid: it must be a finite number",
        ),
        ({"colour": "red"}, "colour is not a known key"),
        ({"variants": {"a": {"nu": 0.3}}}, "nu or shear_coefficient is not allowed beside variants"),
    ],
)
def test_bad_frames_are_refused_in_one_line(answer, changes, words):
    outcome = answer({"inputs": cantilever(**changes)})
    assert outcome.exit_code == 2
    assert words in outcome.stderr
    assert len(outcome.stderr.splitlines()) == 1


def test_missing_material_and_stray_keys_are_refused(answer):
    frame = cantilever()
    del frame["nu"]
    assert "inputs.nu is missing" in answer({"inputs": frame}).stderr
    assert "mesh is not a known key" in answer({"inputs": cantilever(), "mesh": {}}).stderr
    assert "inputs" in answer([]).stderr


@pytest.mark.parametrize("angle", [0.0, 20.0, 45.0, 90.0, 135.0])
def test_a_round_tube_is_stressed_alike_by_a_load_in_any_direction(answer, angle):
    across, up = (1000.0 * f(math.radians(angle)) for f in (math.cos, math.sin))
    load = [{"point": 1, "dof": 0, "value": across}, {"point": 1, "dof": 2, "value": up}]
    results = json.loads(answer({"inputs": cantilever(loads=load)}).stdout)["results"]
    moment = math.pi / 4 * (0.1**4 - 0.097**4)
    assert results["max_abs_fibre_stress"] == pytest.approx(1000.0 * 4.0 * 0.1 / moment, rel=1e-10)


def test_tube_loaded_at_45_degrees_has_the_stress_of_one_loaded_along_an_axis():
    results = json.loads(run(FAULTS / "tube_load_at_45deg.json").stdout)["results"]
    moment = math.pi / 4 * (0.05**4 - 0.045**4)
    assert results["max_abs_fibre_stress"] == pytest.approx(1000.0 * 2.0 * 0.05 / moment, rel=1e-10)
    assert results["max_abs_fibre_stress"] == pytest.approx(59.2e6, rel=1e-3)


def test_a_frame_that_is_fixed_everywhere_does_not_move_and_passes_its_loads_on():
    results = json.loads(run(FAULTS / "structures_all_fixed.json").stdout)["results"]
    assert results["displacement"] == {"0": [0.0] * 6, "1": [0.0] * 6}
    assert results["reactions"]["0"] == [0.0] * 6
    assert results["reactions"]["1"] == [0.0, 0.0, -1000.0, 0.0, 0.0, 0.0]
    assert results["max_abs_fibre_stress"] == 0.0
    assert results["mass"] == pytest.approx(8.058, rel=1e-3)


def test_frames_beyond_what_one_matrix_holds_are_refused(answer):
    points = [[0.0, 0.1 * i, 0.0] for i in range(501)]
    outcome = answer({"inputs": cantilever(points=points, segments=[[i, i + 1] for i in range(500)])})
    assert outcome.exit_code == 2
    assert "inputs.points = " in outcome.stderr
    assert "it must have at most 500 values" in outcome.stderr
