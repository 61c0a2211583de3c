"""Missions of any segments: what they are, what they take, and that the model evaluates all of them as it does the published three."""

import math
from importlib import resources
from pathlib import Path

import pytest
import torch
from conftest import central_difference

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.model.schedule import Schedule
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.reduced import reduced_problem

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "mission_with_descent.toml"
FORMER = """
flights = 2
temperature_offset_K = 0.0
[hover]
altitude_m = 76.2
duration_s = 90.0
[climb]
speed_m_per_s = 57.617778
rate_m_per_s = 4.6087
[cruise]
speed_m_per_s = 57.617778
altitude_m = 1006.0
distance_m = 69450.0
"""


def shipped():
    return resources.files("lpc_mdo.data").joinpath("mission.toml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def long():
    """The shipped aircraft on a flight with ascent, loiter, descent and landing, and a hover that is not flown."""
    problem = gross_weight_problem(*load(mission=EXAMPLE))
    with torch.no_grad():
        return problem, problem.analyze(problem.x0)


def test_files_of_former_versions_are_the_same_mission(tmp_path):
    file = tmp_path / "mission.toml"
    text = shipped()
    file.write_text(FORMER + text[text.index("[reserve]") :].replace('torque_segments = ["climb", "cruise"]', ""))
    (_, former), (_, mission) = load(mission=file), load()
    assert former.model_dump(exclude={"order"}) == mission.model_dump(exclude={"order"})
    assert former.flown == mission.flown
    with pytest.raises(ConfigurationError, match=r"hover\.duration_s = -1 is not allowed.*\(line 6\)"):
        load(mission=_edited(file, "duration_s = 90.0", "duration_s = -1"))


def _edited(file, old, new):
    file.write_text(file.read_text().replace(old, new, 1))
    return file


def test_energy_and_time_add_up_along_the_order(long):
    _, a = long
    segments = {name: a.segment(name) for name in a.mission.flown}
    power = sum(float(s.power * s.duration) for s in segments.values())
    power += float(a.segment("loiter").power) * 1200.0
    capacity = float(a.design.battery_mass) * a.vehicle.battery.specific_energy
    assert float(a.energy.battery.final_state_of_charge) == pytest.approx(1.0 - power / capacity, rel=1e-12)
    assert float(segments["ascent"].duration) == pytest.approx(30.0)
    assert float(segments["climb"].duration) == pytest.approx((1006.0 - 76.2) / 4.6)


def test_a_distance_includes_the_climb_before_and_the_descent_after(long):
    _, a = long
    ground = {
        name: float(a.flight.ground_speed[a.schedule.segment_index(name)] * a.segment(name).duration)
        for name in ("climb", "outbound", "descent")
    }
    assert sum(ground.values()) == pytest.approx(90000.0, rel=1e-12)
    descent = a.segment("descent")
    assert float(descent.start_altitude) == 1006.0
    assert float(descent.end_altitude) == 76.2
    assert float(descent.path_angle) == pytest.approx(-math.asin(2.5 / 57.617778))


def test_equal_segments_have_equal_results(long):
    """Take-off and landing are hovers at one altitude: the same thrust, power and trim."""
    _, a = long
    one, other = a.segment("take_off"), a.segment("landing")
    torch.testing.assert_close(one.scaled_trim, other.scaled_trim, rtol=0.0, atol=0.0)
    assert float(one.power) == float(other.power)
    published = gross_weight_problem(*load())
    with torch.no_grad():
        b = published.analyze_design(published.unpack(published.x0))
    torch.testing.assert_close(
        a.segment("take_off").scaled_trim[2], b.segment("hover").scaled_trim[2], rtol=2e-2, atol=0.0
    )


def test_the_same_blades_give_less_thrust_in_a_climb_and_in_thin_air(long):
    _, a = long
    inside = a.rotor("front_outer_port", "ascent"), a.rotor("front_outer_port", "take_off")
    assert float(inside[0].thrust) < float(inside[1].thrust)  # of the same blades at the same speed
    assert float(a.rotor("front_outer_port", "hot_and_high").thrust) < float(inside[1].thrust)
    density = a.flight.air.density
    assert float(density[a.schedule.segment_index("hot_and_high")]) < float(density[0])


def test_what_is_not_flown_is_trimmed_and_powered_but_takes_no_energy(long):
    problem, a = long
    names = {row.name for row in problem.constraints}
    assert "motor_torque_hot_and_high" in names
    rows = {row.name: value for row, value in zip(problem.constraints, problem.rows(a), strict=True)}
    assert rows["trim_residual"].shape[-1] == 4 * 2 + 4 * 3
    assert len(a.energy.battery.state_of_charge) == len(a.mission.flown) + 1


def test_gradients_of_a_long_mission_equal_differences(long):
    problem, _ = long
    direction = torch.cos(torch.arange(problem.size, dtype=torch.float64))

    def along(t):
        objective, rows = problem.evaluate(problem.x0 + t * direction)
        return torch.cat([objective[..., None], rows], dim=-1)

    zero = torch.zeros((), dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(along, zero)
    torch.testing.assert_close(exact, central_difference(along, zero, 1e-4)[:, 0], rtol=1e-6, atol=1e-7)


def test_mirrored_points_are_solved_once_and_stand_for_both(long):
    problem, a = long
    small = reduced_problem(*load(mission=EXAMPLE))
    with torch.no_grad():
        b = small.analyze(small.x0)
    assert len(b.schedule.solved) == 4 * 4 + 4
    assert len(a.schedule.solved) == 4 * 8 + 4
    torch.testing.assert_close(b.scaled_trim, a.scaled_trim, rtol=1e-10, atol=1e-12)
    torch.testing.assert_close(b.energy.power, a.energy.power, rtol=1e-12, atol=0.0)
    assert (
        small.size == problem.size - 40 - 12 - 1
    )  # twins' shapes, their speeds in three more hovers, the end of the climb


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ('mission.order=["take_off", "climb"]', "must be flown once a flight, and order holds it 0 times"),
        ('mission.order=["take_off", "nowhere"]', "order[1] = 'nowhere' is invalid"),
        ("mission.landing.kind=glide", "landing.kind = 'glide' is invalid: it must be one of hover, vertical_climb"),
        ("mission.climb.speed_m_per_s=descent", "climb.speed_m_per_s = 'descent' is invalid"),
        ("mission.outbound.distance_m=20000", "outbound.distance_m = 20000 is invalid: it includes climb and descent"),
        ("mission.landing.name=loiter", "another segment has that name"),
        ("mission.landing.name=2nd", "it must be a word"),
        (
            "mission.reserve.segment=landing",
            "reserve.segment = 'landing' is invalid: it must be one of outbound, loiter",
        ),
    ],
)
def test_what_cannot_be_flown_is_refused(override, message):
    with pytest.raises(ConfigurationError) as error:
        load(mission=EXAMPLE, overrides=[override])
    assert message in str(error.value)


def test_a_group_that_the_aircraft_has_not_is_refused(tmp_path):
    file = tmp_path / "mission.toml"
    file.write_text(shipped().replace('kind = "cruise"', 'kind = "cruise"\nrotors = ["tractor"]'))
    with pytest.raises(
        ConfigurationError, match=r"cruise\.rotors = \['tractor'\] is invalid: 'tractor' must be a group"
    ):
        load(mission=file)


def twin_pushers(tmp_path):
    """The shipped aircraft with two pushers behind the wing in place of one at the tail."""
    text = resources.files("lpc_mdo.data").joinpath("vehicle.toml").read_text(encoding="utf-8")
    begin, end = text.index('[[rotors]]\nname = "pusher"'), text.index("[motors]")
    port = text[begin:end].replace("[9.94, 0.0, 2.374]", "[6.5, -1.9, 2.6]").replace('"pusher"\nkind', '"port"\nkind')
    starboard = port.replace('"port"', '"starboard"').replace("-1.9", "1.9").replace("spin = 1", "spin = -1")
    file = tmp_path / "twin.toml"
    file.write_text(text[:begin] + port + starboard + text[end:])
    return file


def test_two_pushers_share_the_thrust_and_roll_nothing(tmp_path):
    vehicle, mission = load(twin_pushers(tmp_path))
    problem, small = gross_weight_problem(vehicle, mission), reduced_problem(vehicle, mission)
    with torch.no_grad():
        a, b = problem.analyze(problem.x0), small.analyze(small.x0)
    assert problem.size == 109 + 11
    ports, starboards = (a.rotor(name, "cruise") for name in ("port", "starboard"))
    assert float(ports.thrust) == float(starboards.thrust)
    assert float(a.segment("cruise").scaled_trim[3].abs()) < 1e-6  # a single pusher's torque rolls: 0.01 or so
    torch.testing.assert_close(b.scaled_trim, a.scaled_trim, rtol=1e-10, atol=1e-12)
    assert {row.name for row in problem.constraints} >= {"rotor_symmetry_port", "motor_symmetry_port"}
    with pytest.raises(
        ConfigurationError, match=r"rotors\[8\]\.hub_m\[1\] = -2\.9 is invalid: it must be 0, or 'port'"
    ):
        load(twin_pushers(tmp_path), overrides=["vehicle.rotors.8.hub_m.1=-2.9"])


def test_names_find_points_and_wrong_ones_are_told():
    vehicle, mission = load()
    schedule = Schedule(vehicle, mission)
    assert schedule.point_names[schedule.point_index("pusher", "cruise")] == ("pusher", "cruise")
    assert schedule.of_group("lift") == list(range(8))
    for wrong in (lambda: schedule.segment_index("taxi"), lambda: schedule.point_index("pusher", "hover")):
        with pytest.raises(KeyError):
            wrong()
