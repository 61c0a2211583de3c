"""Segments beyond straight flight, failed rotors, transition and load factors, and the rows that keep blades and tips from harm."""

import math

import pytest
import torch
from conftest import central_difference

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.disciplines.dynamic_inflow import dynamic_inflow_rotor
from lpc_mdo.model.analyzer import Analyzer
from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.problems.envelope_rows import SHARPNESS
from lpc_mdo.problems.full_envelope import full_envelope_mission, full_envelope_problem
from lpc_mdo.problems.reduced import reduced

MISSION = full_envelope_mission()
SMALL = ["mission.transition_out.points=2", "mission.transition_back.points=1"]


@pytest.fixture(scope="module")
def problem():
    return full_envelope_problem(*load(mission=MISSION, overrides=SMALL))


@pytest.fixture(scope="module")
def start(problem):
    with torch.no_grad():
        return problem.analyze(problem.x0)


def test_the_shipped_mission_has_as_many_variables_and_rows_as_a_full_envelope_needs():
    whole = full_envelope_problem(*load(mission=MISSION))
    assert whole.size >= 250
    assert sum(whole.row_sizes) >= 150


def test_each_rotor_fails_once_and_nothing_mirrors_then(problem):
    schedule = problem.analyze_design.schedule
    failures = [s for s in schedule.segments if s.inoperative_rotor]
    assert [s.inoperative_rotor for s in failures] == [
        rotor.name for rotor in schedule.vehicle.rotors[:4]
    ]  # those to port
    for segment in failures:
        turning = [schedule.point_names[k][0] for k in schedule.in_segment(segment.name)]
        assert len(turning) == 7
        assert segment.inoperative_rotor not in turning
    small = reduced(problem)
    speeds = next(v for v in small.variables if v.name == "lift_rotor_speed")
    symmetric = len([s for s in schedule.segments if schedule.in_segment(s.name) and "lift" in s.groups]) - len(
        failures
    )
    assert speeds.count == 4 * symmetric + 7 * len(failures)


def test_both_formulations_see_one_aircraft(problem, start):
    small = reduced(problem)
    with torch.no_grad():
        other = small.analyze(small.x0)
    torch.testing.assert_close(other.scaled_trim, start.scaled_trim, rtol=1e-9, atol=1e-11)
    torch.testing.assert_close(other.energy.power, start.energy.power, rtol=1e-9, atol=0.0)


def test_a_transition_gains_its_speed_in_its_time(start):
    mission = start.mission
    points = [s for s in mission.segments if s.name.startswith("transition_out")]
    assert sum(s.given_duration for s in points) == pytest.approx(57.6 / 1.5, rel=1e-12)
    assert [s.flight_speed for s in points] == pytest.approx([14.4, 43.2])
    assert all("lift" in s.groups for s in points)
    back = mission.segment("transition_back_1")
    assert back.acceleration == -1.0
    order = list(mission.flown)
    assert order[order.index("take_off") + 1 : order.index("climb")] == ["transition_out_1", "transition_out_2"]


def test_acceleration_is_what_is_left_of_the_forces(problem, start):
    """Newton's second law: with another acceleration the residual differs by mass times the difference, along the path."""
    faster = full_envelope_problem(
        *load(mission=MISSION, overrides=[*SMALL, "mission.transition_out.acceleration_m_per_s2=2.5"])
    )
    with torch.no_grad():
        other = faster.analyze(faster.x0)
    i = start.schedule.segment_index("transition_out_1")
    change = (other.scaled_trim - start.scaled_trim)[i]
    alpha = float(start.flight.angle_of_attack[i])
    expected = torch.tensor([-math.cos(alpha), 0.0, math.sin(alpha), 0.0, 0.0, 0.0], dtype=torch.float64) / GRAVITY
    torch.testing.assert_close(change, expected, rtol=1e-9, atol=1e-12)


def test_a_load_factor_asks_so_much_lift(problem, start):
    """At one design the lift is what it is; the residual counts it against n times the weight."""
    others = {}
    for factor in (1.5, 3.0):
        changed = full_envelope_problem(
            *load(mission=MISSION, overrides=[*SMALL, f"mission.pull_up.load_factor={factor}"])
        )
        with torch.no_grad():
            others[factor] = changed.analyze(changed.x0).segment("pull_up").scaled_trim
    missing = torch.linalg.vector_norm((others[3.0] - others[1.5])[:3])
    assert float(missing) == pytest.approx(1.5, rel=1e-12)
    k, pull_up = start.schedule.wingborne_index("pull_up"), start.segment("pull_up")
    assert float(start.aerodynamics.stall_speed[k]) == pytest.approx(
        math.sqrt(
            3.0
            * 2.0
            * float(start.gross_mass)
            * GRAVITY
            / (float(start.flight.air.density[start.schedule.segment_index("pull_up")]) * float(start.shape.wing.area))
            / float(pull_up.maximum_lift_coefficient)
        ),
        rel=1e-12,
    )


def test_lift_rotors_on_the_wing_have_the_inflow_of_pitt_and_peters(start):
    """Thrust and torque of the model's coarse blade beside the discipline's own, with all stations and many azimuths."""
    from lpc_mdo.disciplines.inclined_rotor import InclinedFlow
    from lpc_mdo.model.inclined_rotors import wind_direction

    schedule, loads = start.schedule, start.rotors.loads
    points = torch.nonzero(schedule.is_edgewise)[:, 0]
    at, segment = loads.at(points), schedule.segment[points]
    velocity = wind_direction(start.flight.angle_of_attack[segment]) * start.flight.speed[segment, None]
    flow = InclinedFlow(
        velocity=velocity,
        axis=torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64).expand_as(velocity),
        spin=torch.tensor([float(schedule.vehicle.rotors[i].spin) for i in schedule.rotor[points]]).double(),
        rotation_speed=at.inflow.rotation_speed,
        density=at.inflow.density,
        speed_of_sound=at.inflow.speed_of_sound,
        dynamic_viscosity=at.inflow.dynamic_viscosity,
    )
    fine = dynamic_inflow_rotor(at.rotor, flow, start.rotors.polars[points[0]], azimuths=36)
    torch.testing.assert_close(at.thrust, fine.thrust, rtol=2e-3, atol=2.0)
    torch.testing.assert_close(at.torque, fine.torque, rtol=2e-3, atol=0.5)
    assert bool(start.defined_efficiency()[points].isnan().all())


def test_rows_of_blades_and_tips_are_what_they_say(problem, start):
    rows = {row.name: (row, row.of(start)) for row in problem.constraints}
    loads, points = start.rotors.loads, torch.tensor(start.schedule.own_points)
    tip = loads.inflow.rotation_speed * loads.rotor.radius / loads.inflow.speed_of_sound
    hovering = ~start.schedule.is_edgewise[points] & ~start.schedule.is_propelling[points]
    found = rows["tip_mach"][1]
    assert bool((found >= tip[points] - 1e-12).all())
    torch.testing.assert_close(found[hovering], tip[points][hovering], rtol=1e-4, atol=0.0)
    smooth = rows["blade_angle_of_attack"][1]
    true = loads.angle_of_attack[points][hovering][:, 14:].amax(-1)
    assert bool((smooth >= true).all() & (smooth <= true + math.log(14) / SHARPNESS).all())
    row, gap = rows["fuselage_clearance_front_inner_port"]
    assert float(gap) == pytest.approx(2.58 - 1.524 - 0.5 * 1.557, abs=1e-6)
    assert row.lower == 0.15
    assert "fuselage_clearance_front_outer_port" not in rows
    shares = rows["motor_torque_failure_front_outer_port"]
    assert shares[1].shape == (7,)
    assert shares[0].upper == 0.9


def test_gradients_of_all_rows_are_those_of_central_differences(problem):
    small = reduced(problem)
    torch.manual_seed(2)
    direction = torch.randn(small.size, dtype=torch.float64)
    x0 = small.x0.clone()

    def rows(step):
        objective, constraints = small.evaluate(x0 + step * direction)
        return torch.cat([objective[None], constraints])

    step = torch.zeros(1, dtype=torch.float64, requires_grad=True)
    values = rows(step)
    slopes = torch.stack([torch.autograd.grad(value, step, retain_graph=True)[0][0] for value in values])
    with torch.no_grad():
        expected = central_difference(lambda s: rows(s), torch.zeros(1, dtype=torch.float64), 1e-4)[:, 0]
    torch.testing.assert_close(slopes, expected, rtol=1e-6, atol=1e-6)


def test_weight_is_conserved_over_the_failures(start):
    """Free components of a failure are not imposed, but what is there adds up: no side or longitudinal force from vertical rotors."""
    for segment in start.schedule.segments:
        if segment.inoperative_rotor:
            trim = start.segment(segment.name).scaled_trim
            assert torch.equal(trim[:2].abs(), torch.zeros(2, dtype=torch.float64))
            thrust = sum(
                float(start.rotor(name, where).thrust)
                for name, where in start.schedule.point_names
                if where == segment.name
            )
            weight = float(start.gross_mass) * GRAVITY
            assert float(trim[2]) == pytest.approx(1.0 - thrust / weight, rel=1e-9)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            'mission.failure.rotor="nose"',
            "failure.rotor = 'nose' is invalid: it must be 'each' or a rotor that the segment turns",
        ),
        ("mission.transition_out.end_speed_m_per_s=0.0", "it must differ from start_speed_m_per_s"),
        ('mission.order=["take_off", "failure", "cruise"]', "must be the name of a segment that is flown"),
        ('mission.requirements.noise_segment="failure"', "requirements.noise_segment = 'failure' is invalid"),
        ('mission.reserve.segment="transition_out"', "reserve.segment = 'transition_out' is invalid"),
        ("mission.transition_out.points=40", "transition_out.points = 40 is not allowed; it must lie between 1 and 30"),
        (
            "mission.requirements.maximum_tip_mach=1.4",
            "requirements.maximum_tip_mach = 1.4 is not allowed; it must lie",
        ),
        ("mission.requirements.maximum_tip_mash=0.6", "'maximum_tip_mash' is not a known key"),
    ],
)
def test_wrong_missions_are_refused_in_one_sentence(override, message):
    with pytest.raises(ConfigurationError) as caught:
        load(mission=MISSION, overrides=[override])
    assert message in str(caught.value)


def test_a_limit_that_the_file_leaves_out_may_be_set():
    _, mission = load(overrides=["mission.requirements.maximum_tip_mach=0.6"])
    assert mission.requirements.maximum_tip_mach == 0.6
    names = [row.name for row in full_envelope_problem(load()[0], mission).constraints]
    assert "tip_mach" in names


def test_one_rotor_may_fail_by_name():
    vehicle, mission = load(mission=MISSION, overrides=['mission.failure.rotor="rear_inner_starboard"'])
    schedule = Analyzer(vehicle, mission).schedule
    assert [s.name for s in schedule.segments if s.inoperative_rotor] == ["failure"]
