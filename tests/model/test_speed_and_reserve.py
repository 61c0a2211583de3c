"""Cruise speed as part of the design, climb that follows it or not, and a reserve by distance or by time."""

from dataclasses import replace

import pytest
import torch
from conftest import central_difference

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.model.analyzer import Analyzer
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.reporting.sensitivities import parameters

KNOTS_112 = 57.617778


def at_speed(design, speed):
    return replace(design, of_segments={**design.of_segments, "cruise_speed": speed})


def analyses(*overrides, speed=None):
    """The shipped aircraft's start on a mission with overrides, at a speed of its own if one is given."""
    problem = gross_weight_problem(*load())
    design = problem.unpack(problem.x0)
    if speed is not None:
        design = at_speed(design, torch.tensor(speed, dtype=torch.float64))
    with torch.no_grad():
        return Analyzer(*load(overrides=overrides), problem.analyze_design.geometry)(design)


def test_the_design_carries_the_missions_speed_where_it_has_none_of_its_own():
    given, own = analyses("mission.cruise.speed_m_per_s=60"), analyses(speed=60.0)
    assert float(given.main_segment.speed) == 60.0
    for name in ("gross_mass", "scaled_trim", "observed_dba"):
        torch.testing.assert_close(getattr(given, name), getattr(own, name), rtol=1e-13, atol=1e-13)
    torch.testing.assert_close(given.energy.duration, own.energy.duration, rtol=1e-13, atol=0.0)
    torch.testing.assert_close(
        given.aerodynamics.drag_coefficient, own.aerodynamics.drag_coefficient, rtol=1e-12, atol=0.0
    )


@pytest.mark.parametrize("climb", ["57.6", "cruise"])
@pytest.mark.parametrize("reserve", ["distance_m=69200", "duration_s=1200"])
@pytest.mark.parametrize("inflow", ["axial", "inclined"])
def test_gradient_of_the_speed_equals_central_differences(climb, reserve, inflow):
    """Of everything that depends on it: structure, both segments' trim, stall, charge and torque."""
    overrides = [f"mission.climb.speed_m_per_s={climb}", f"mission.reserve.{reserve}", f"mission.rotor_inflow={inflow}"]
    problem = gross_weight_problem(*load(overrides=overrides))
    design = problem.unpack(problem.x0)

    def results(speed):
        a = problem.analyze_design(at_speed(design, speed))
        parts = [a.gross_mass / 1e3, a.energy.battery.final_state_of_charge, a.energy.reserve_duration / 1e3]
        parts += [a.scaled_trim, a.aerodynamics.stall_speed / 10.0, a.propulsion.torque_share, a.energy.duration / 1e3]
        return torch.cat([part.flatten() for part in parts])

    speed = torch.tensor(61.0, dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(results, speed)
    torch.testing.assert_close(exact, central_difference(results, speed, 1e-4)[:, 0], rtol=1e-6, atol=1e-8)
    assert float(exact[0]) > 0.0  # the regressions know heavier structure for faster aircraft
    assert (float(exact[2]) == 0.0) == (reserve == "duration_s=1200")


def test_speeds_of_a_batch_are_those_of_its_designs():
    problem = gross_weight_problem(*load())
    design = problem.unpack(problem.x0.expand(2, -1))
    both = problem.analyze_design(at_speed(design, torch.tensor([58.0, 63.0], dtype=torch.float64)))
    for i, speed in enumerate((58.0, 63.0)):
        alone = analyses(speed=speed)
        torch.testing.assert_close(both.scaled_trim[i], alone.scaled_trim, rtol=1e-9, atol=1e-12)
        torch.testing.assert_close(both.energy.duration[i], alone.energy.duration, rtol=1e-12, atol=0.0)


def test_climb_follows_the_cruise_or_keeps_its_own_speed():
    own, follows = analyses(speed=63.0), analyses("mission.climb.speed_m_per_s=cruise", speed=63.0)
    assert own.flight.speed.tolist() == pytest.approx([0.0, load()[1].speed("climb"), 63.0])
    assert follows.flight.speed.tolist() == [0.0, 63.0, 63.0]
    rate = load()[1].segment("climb").rate
    for analysis in (own, follows):  # the rate stays, the path gets flatter
        flown = analysis.flight.speed[1] * torch.sin(analysis.flight.path_angle[1])
        assert float(flown) == pytest.approx(rate, rel=1e-12)


def test_twenty_minutes_are_as_good_as_their_distance_at_one_speed_and_ask_for_more_at_a_higher():
    """57.617778 m/s for 1200 s are 69 141 m."""
    speed, distance = KNOTS_112, KNOTS_112 * 1200.0
    by_time, by_distance = "mission.reserve.duration_s=1200", f"mission.reserve.distance_m={distance!r}"
    slow = [analyses(reserve, speed=speed).energy for reserve in (by_time, by_distance)]
    assert float(slow[0].reserve_duration) == pytest.approx(float(slow[1].reserve_duration), rel=1e-14)
    charges = [float(energy.battery.final_state_of_charge) for energy in slow]
    assert charges[0] == pytest.approx(charges[1], rel=1e-13)
    fast = [analyses(reserve, speed=63.9).energy for reserve in (by_time, by_distance)]
    assert float(fast[0].reserve_duration) == 1200.0
    assert float(fast[1].reserve_duration) == pytest.approx(distance / 63.9, rel=1e-14)
    assert float(fast[0].battery.final_state_of_charge) < float(fast[1].battery.final_state_of_charge)


def mission_with(tmp_path, old, new):
    file = tmp_path / "mission.toml"
    from importlib import resources

    text = resources.files("lpc_mdo.data").joinpath("mission.toml").read_text(encoding="utf-8")
    assert text.count(old) == 1
    file.write_text(text.replace(old, new))
    return file


@pytest.mark.parametrize(
    ("reserve", "message"),
    [
        ("", "mission.toml: reserve has neither of distance_m and duration_s; it must have one of them"),
        (
            "distance_m = 1e4\nduration_s = 60.0",
            "reserve has both of distance_m and duration_s; it must have one of them",
        ),
        ("duration_s = -1.0", "reserve.duration_s = -1.0 is not allowed; it must lie between 0 and 100000"),
        ("duration_s = true", "reserve.duration_s = True is not allowed; it must be a finite number"),
    ],
)
def test_a_reserve_is_by_distance_or_by_time(tmp_path, reserve, message):
    with pytest.raises(ConfigurationError) as error:
        load(mission=mission_with(tmp_path, "distance_m = 69200.0", reserve))
    assert message in str(error.value)


def test_an_override_of_one_kind_of_reserve_takes_the_place_of_the_other():
    overrides = ["mission.reserve.duration_s=1200", "mission.reserve.distance_m=5e4"]
    assert load(overrides=overrides[:1])[1].reserve.model_dump() == {
        "segment": "cruise",
        "distance": None,
        "duration": 1200.0,
    }
    assert load(overrides=overrides)[1].reserve.model_dump() == {
        "segment": "cruise",
        "distance": 5e4,
        "duration": None,
    }
    with pytest.raises(ConfigurationError, match=r"'time_s' is not a known key"):
        load(overrides=["mission.reserve.time_s=1200"])


def test_a_climb_at_the_speed_of_no_segment_is_refused():
    with pytest.raises(
        ConfigurationError,
        match=r"climb.speed_m_per_s = 'fast' is invalid: it must be a number, or the name of a segment with one",
    ):
        load(overrides=['mission.climb.speed_m_per_s="fast"'])
    with pytest.raises(
        ConfigurationError,
        match=r"climb.speed_m_per_s = 200 is invalid: it must be a number between 20 and 120, or the name of a segment",
    ):
        load(overrides=["mission.climb.speed_m_per_s=200"])


def test_sensitivities_are_of_numbers_that_the_files_give():
    """A reserve by time has no distance to be longer."""
    by_distance, by_time = (
        {label for _, _, label in parameters(gross_weight_problem(*load(overrides=overrides)))}
        for overrides in ([], ["mission.reserve.duration_s=1200"])
    )
    assert by_distance - by_time == {"reserve distance"}
    assert by_time - by_distance == {"reserve duration"}
    assert "cruise speed" in by_distance
