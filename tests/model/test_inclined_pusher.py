"""The pusher at the angle of attack flown: axial where it is zero, the known normal force where it is not, and trim feels it."""

import math

import pytest
import torch

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.disciplines.inclined_rotor import inclined_rotor
from lpc_mdo.model.inclined_rotors import Inclination, Turning, inclined, wind_direction
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.reduced import reduced_problem


@pytest.fixture(scope="module")
def analyses():
    """The baseline with axial and with inclined inflow, at 5 degrees of angle of attack in cruise and none in climb."""
    found = {}
    for inflow in ("axial", "inclined"):
        problem = gross_weight_problem(*load(overrides=[f"mission.rotor_inflow={inflow}"]))
        design = problem.physical(problem.x0)
        design["pitch"] = torch.tensor([load()[1].path_angle("climb"), math.radians(5.0)], dtype=torch.float64)
        found[inflow] = problem.analyze(problem.scaled(design))
    return found


def test_axial_is_the_default_and_has_nothing_in_the_disk(analyses):
    assert load()[1].rotor_inflow == "axial"
    assert analyses["axial"].rotors.disk_force is None
    with pytest.raises(ConfigurationError, match="rotor_inflow"):
        load(overrides=["mission.rotor_inflow=sideways"])


def test_no_angle_of_attack_is_axial_flow(analyses):
    axial, inclined = (analyses[name].rotors for name in ("axial", "inclined"))
    torch.testing.assert_close(inclined.loads.thrust[8], axial.loads.thrust[8], rtol=1e-9, atol=0.0)
    assert float(inclined.disk_force[8].abs().max()) < 1e-6 * float(axial.loads.thrust[8])


def test_the_normal_force_points_along_the_wind_in_the_disk_and_is_some_per_cent_of_thrust(analyses):
    """Wind from below in the disk pushes up; Glauert's and Ribner's normal force of propellers is of this size."""
    axial, inclined = (analyses[name].rotors for name in ("axial", "inclined"))
    share = inclined.disk_force[9] / axial.loads.thrust[9]
    assert 0.01 < float(share[2]) < 0.06
    assert abs(float(share[0])) < 1e-12
    # Thrust changes with the square of the angle.
    assert abs(float(inclined.loads.thrust[9] / axial.loads.thrust[9]) - 1.0) < 5e-3
    lifted = analyses["inclined"].trim.force - analyses["axial"].trim.force
    torch.testing.assert_close(-lifted[2, 2], inclined.disk_force[9, 2], rtol=1e-6, atol=1e-6)


def test_the_reduced_formulation_flies_the_same_pusher(analyses):
    problem = reduced_problem(*load(overrides=["mission.rotor_inflow=inclined"]))
    design = problem.physical(problem.x0)
    design["pitch"] = torch.tensor([load()[1].path_angle("climb"), math.radians(5.0)], dtype=torch.float64)
    ours, theirs = problem.analyze(problem.scaled(design)).propulsion, analyses["inclined"].propulsion
    for part in (ours.rotors, theirs.rotors):
        assert (
            float(part.disk_force[part.schedule.is_propelling[part.schedule.solved].logical_not()].abs().max()) == 0.0
        )
    ours_force, theirs_force = (part.rotors.disk_force[part.schedule.place] for part in (ours, theirs))
    torch.testing.assert_close(ours_force, theirs_force, rtol=1e-9, atol=1e-9)
    torch.testing.assert_close(ours.operation.input_power, theirs.operation.input_power, rtol=1e-9, atol=0.0)


def test_a_batch_of_angles_equals_a_loop_and_lift_rotors_stay_as_they_are(analyses):
    a = analyses["axial"]
    loads, speed = a.rotors.loads, torch.full((10,), 57.6, dtype=torch.float64)
    polars, pushers = a.rotors.polars, torch.tensor([8, 9])
    axis = torch.tensor([[0.0, 0.0, 1.0]] * 8 + [[-1.0, 0.0, 0.0]] * 2, dtype=torch.float64)

    def at(angle, spin):
        wind = wind_direction(torch.nn.functional.pad(angle, (8, 0))) * speed[:, None]
        turning = Turning(wind, axis, torch.full((10,), -spin, dtype=torch.float64))
        return inclined(loads, Inclination(pushers, inclined_rotor), turning, polars)

    angles = torch.tensor([[0.02, 0.05], [-0.1, 0.12]], dtype=torch.float64)
    wide = [at(angle, 1.0) for angle in angles]
    assert all(torch.equal(part[0].thrust[:8], loads.thrust[:8]) for part in wide)
    assert all(float(part[1][:8].abs().max()) == 0.0 for part in wide)
    forward, turned = (at(angles[0], spin) for spin in (1.0, -1.0))
    mirror = torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
    torch.testing.assert_close(forward[1], mirror * turned[1], rtol=1e-9, atol=1e-8)
    torch.testing.assert_close(forward[2], -mirror * turned[2], rtol=1e-9, atol=1e-8)
