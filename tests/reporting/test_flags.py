"""Flags of a result: what leaves the regime of a model is named with place, value and limit, and nothing else is."""

import io
import json
import warnings
from dataclasses import replace

import pytest
import torch
from analytic_studies import circles
from conftest import number
from rich.console import Console

from lpc_mdo.config import load
from lpc_mdo.problems.aeroacoustic import aeroacoustic_problem
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.reporting import result_file
from lpc_mdo.reporting.flag import Flag, rotor_flags
from lpc_mdo.reporting.flag_lines import LOUD, TITLES, flag_lines, study_flag_lines
from lpc_mdo.reporting.flags import regime_flags
from lpc_mdo.reporting.report import write_report
from lpc_mdo.stored.result import StoredFlag
from lpc_mdo.stored.study import read_study_file
from lpc_mdo.studies.display import StudyDisplay
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.runner import StudyRun


@pytest.fixture(scope="module")
def aircraft():
    return load()


@pytest.fixture(scope="module")
def analysis(aircraft):
    problem = gross_weight_problem(*aircraft)
    with torch.no_grad():
        return problem.analyze(problem.x0)


def of_kind(analysis, vehicle, what):
    return [flag for flag in regime_flags(analysis) if flag.what == what]


def with_shares(analysis, *shares):
    share = torch.zeros_like(analysis.propulsion.torque_share)
    share[: len(shares)] = torch.tensor(shares, dtype=torch.float64)
    return replace(analysis, propulsion=replace(analysis.propulsion, torque_share=share))


def test_motors_beyond_their_torque_are_flagged_and_those_at_the_limit_are_not(aircraft, analysis):
    flags = of_kind(with_shares(analysis, 4.4, 0.99, 1.0 + 1e-9, 1.2), aircraft[0], "motor_torque_share")
    assert [(f.where, f.value, f.limit) for f in flags] == [
        ("front_outer_port, hover", 4.4, 1.0),
        ("rear_inner_port, hover", 1.2, 1.0),
    ]
    assert "4.4 times its largest torque" in flags[0].message


def test_fast_tips_and_windmilling_are_flagged_by_rotor_and_segment(aircraft, analysis):
    loads = analysis.propulsion.loads
    sound = torch.full_like(loads.inflow.speed_of_sound.expand(loads.thrust.shape), 340.0)
    sound[1] = 100.0
    torque = loads.torque_per_length.clone()
    torque[-1] = -torque[-1].abs()
    solved = replace(loads, torque_per_length=torque, inflow=replace(loads.inflow, speed_of_sound=sound))
    moved = replace(analysis, rotors=replace(analysis.rotors, solved_loads=solved))
    (fast,) = of_kind(moved, aircraft[0], "tip_mach")
    assert (fast.where, fast.limit) == ("rear_outer_port, hover", 0.7)
    assert fast.value == pytest.approx(float(solved.tip_mach[1]))
    (driven,) = of_kind(moved, aircraft[0], "windmilling")
    assert driven.where == "pusher, cruise"
    assert driven.value < 0.0


def test_structural_inputs_outside_their_samples_are_flagged_without_a_warning(aircraft, analysis):
    weights = analysis.weights
    wide = replace(weights.structural_inputs, wing_aspect_ratio=number(30.0))
    moved = replace(analysis, weights=replace(weights, structural_inputs=wide))
    flags = {flag.where: flag for flag in of_kind(moved, aircraft[0], "structure_extrapolated")}
    assert flags["wing_aspect_ratio"].value > 1.0
    assert flags["wing_aspect_ratio"].limit == 1.0


def test_the_shipped_aircraft_runs_without_a_warning(aircraft):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        problem = gross_weight_problem(*aircraft)
        with torch.no_grad():
            problem.evaluate(problem.x0)


def test_a_warning_comes_where_it_is_asked_for():
    """On the way to the first result too: the baseline's battery is lighter than those of the samples."""
    loaded = load(overrides=["vehicle.structure.outside_samples=warn"])
    with pytest.warns(RuntimeWarning, match="outside its samples"):
        problem = gross_weight_problem(*loaded)
    with torch.no_grad(), pytest.warns(RuntimeWarning, match="outside its samples"):
        problem.evaluate(torch.full_like(problem.x0, 3.0))


def test_negative_induced_drag_and_an_empty_battery_are_flagged(aircraft, analysis):
    aero = replace(analysis.aerodynamics, induced_drag=torch.tensor([-3.0, 100.0], dtype=torch.float64))
    battery = replace(analysis.energy.battery, state_of_charge=torch.tensor([0.5, -0.1], dtype=torch.float64))
    moved = replace(analysis, aerodynamics=aero, energy=replace(analysis.energy, battery=battery))
    (drag,) = of_kind(moved, aircraft[0], "induced_drag_negative")
    assert (drag.where, drag.value) == ("climb", -3.0)
    (empty,) = of_kind(moved, aircraft[0], "battery_empty")
    assert (empty.value, empty.limit) == (-0.1, 0.0)
    full = replace(
        analysis, energy=replace(analysis.energy, battery=replace(battery, state_of_charge=number(0.2)[None]))
    )
    assert of_kind(full, aircraft[0], "battery_empty") == []


def test_blades_in_hover_are_flagged_too(aircraft):
    problem = aeroacoustic_problem(*aircraft)
    with torch.no_grad():
        fastest = problem.analyze(torch.ones_like(problem.x0))
    assert of_kind(fastest, aircraft[0], "tip_mach")
    assert regime_flags(object()) == []


def test_lines_gather_each_kind_and_put_the_loudest_first():
    flags = [
        Flag("structure_extrapolated", "battery_mass_kg", -2.58, 1.0, ""),
        Flag("motor_torque_share", "front_outer_port, hover", 4.466, 1.0, ""),
        Flag("motor_torque_share", "front_outer_starboard, hover", 4.466, 1.0, ""),
        Flag("motor_torque_share", "pusher, climb", 1.2, 1.0, ""),
        Flag("own_kind", "", None, None, ""),
    ]
    lines = flag_lines([flag.content() for flag in flags])
    assert [(line.text, line.is_loud) for line in lines] == [
        (
            "motors asked for more torque than they have, times the largest: "
            "front outer port, hover and front outer starboard, hover 4.466; pusher, climb 1.2",
            True,
        ),
        ("half-widths from the centre of the samples of structural mass, which end at 1: battery mass −2.58", False),
        ("own kind: ", False),
    ]
    assert flag_lines([]) == []
    assert set(LOUD) <= set(TITLES)


def test_flags_are_plain_data(aircraft, analysis):
    flags = regime_flags(with_shares(analysis, 2.0))
    text = json.dumps([flag.content() for flag in flags], allow_nan=False)
    assert {"what", "where", "value", "limit", "message"} == json.loads(text)[0].keys()


def test_a_still_rotor_in_still_air_has_no_flag(analysis):
    calm = analysis.propulsion.loads.at(torch.tensor(0))
    assert rotor_flags(calm, number(0.0), "") == []


def test_flags_of_the_points_reach_study_file_terminal_and_report(tmp_path, monkeypatch):
    """Every point's flags stand in study.json as in its result.json; table and page say which points go how far."""
    fast = [Flag("tip_mach", "pusher, cruise", mach, 0.7, "the tip is fast").content() for mach in (0.8, 0.9)]
    study = circles((0.1, 0.5, 0.9))
    build = result_file.build

    def flagged(problem, result, *others, **more):
        x = float(result.x[0])
        flags = () if x > 0.0 else (StoredFlag.model_validate(fast[x < -0.5]),)
        return build(problem, result, *others, **more).model_copy(update={"flags": flags})

    monkeypatch.setattr(result_file, "build", flagged)
    content = StudyRun(study, tmp_path, InProcess(), "slsqp").run()
    for point in content["points"]:
        assert point["flags"] == json.loads((tmp_path / point["folder"] / "result.json").read_text())["flags"]
    flags = {point["value"]: [flag["value"] for flag in point["flags"]] for point in content["points"]}
    assert sorted(map(len, flags.values())) == [0, 1, 1] or sorted(map(len, flags.values())) == [0, 0, 1]
    (line,) = study_flag_lines(content["points"], "weight")
    named = ", ".join(f"{value:g}" for value, found in flags.items() if found)
    assert line.text == f"blade tips beyond Mach 0.7, up to {0.9 if [0.9] in flags.values() else 0.8}: weight {named}"
    console = Console(file=io.StringIO(), width=200)
    StudyDisplay(console, study).table(content, tmp_path)
    assert f"outside the models' regime: {line.text}" in console.file.getvalue()
    assert line.text in write_report(tmp_path).read_text()


def test_points_of_earlier_versions_have_no_flags(tmp_path):
    study = circles((0.2, 0.8))
    StudyRun(study, tmp_path, InProcess(), "slsqp").run()
    for file in [*tmp_path.glob("points/*/point.json"), tmp_path / "study.json"]:
        content = json.loads(file.read_text())
        for point in content.get("points", [content]):
            del point["flags"]
        file.write_text(json.dumps(content))
    assert read_study_file(tmp_path / "study.json")
    again = StudyRun(study, tmp_path, InProcess(), "slsqp").run(is_resuming=True)
    assert [point["flags"] for point in again["points"]] == [[], []]
