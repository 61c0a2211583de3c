"""Vehicle files with other numbers of lift rotors: the problem follows the file, and nothing of the absent rotors is left."""

import re
import runpy
from importlib import resources
from pathlib import Path

import pytest
import torch

from lpc_mdo.config import ConfigurationError, baseline, load
from lpc_mdo.config.layout import booms
from lpc_mdo.model.structure_source import boom_shares
from lpc_mdo.problems.aeroacoustic import aeroacoustic_problem
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.reduced import reduced_problem
from lpc_mdo.reporting.own_checks import own_checks
from lpc_mdo.surrogates.structural_mass import COMPONENTS

SHIPPED = resources.files("lpc_mdo.data").joinpath("vehicle.toml").read_text(encoding="utf-8")
OUTER_FRONT = ("front_outer_port", "front_outer_starboard")


def without(*names):
    """The shipped file less these rotors."""
    head, *rotors = re.split(r"(?m)^(?=\[\[rotors\]\])", SHIPPED)
    return head + "".join(rotor for rotor in rotors if not any(f'"{name}"' in rotor for name in names))


@pytest.fixture(scope="module")
def six(tmp_path_factory):
    """The shipped aircraft without its outer front rotors."""
    file = tmp_path_factory.mktemp("six") / "vehicle.toml"
    file.write_text(without(*OUTER_FRONT).replace('lift_bounds = "hover_torque"', 'lift_bounds = "file"'))
    vehicle, mission = load(file)
    return gross_weight_problem(vehicle, mission)


def test_six_rotors_have_ten_variables_less_a_rotor_and_only_their_own_rows(six):
    assert six.size == 109 - 2 * 10
    rows = [row.name for row in six.constraints]
    assert [name for name in rows if name.startswith("rotor_symmetry")] == [
        "rotor_symmetry_rear_outer_port",
        "rotor_symmetry_front_inner_port",
        "rotor_symmetry_rear_inner_port",
    ]
    assert [name for name in rows if name.startswith("tip_clearance")] == ["tip_clearance_rear"]
    assert len(rows) == 17 - 1 - 1 - 1  # symmetry of rotors and motors, tip clearance


def test_absent_rotors_take_motors_and_half_of_their_booms_with_them(six):
    """All else, which does not know of rotors, stays."""
    eight = gross_weight_problem(*load(overrides=["vehicle.motors.lift_bounds=file"]))
    with torch.no_grad():
        less, more = (problem.analyze(problem.x0).weights.groups for problem in (six, eight))
    assert float(less["lift_motors"] / more["lift_motors"]) == pytest.approx(6.0 / 8.0, rel=1e-12)
    for side in ("port", "starboard"):
        assert float(less[f"boom_outer_{side}"] / more[f"boom_outer_{side}"]) == pytest.approx(0.5, rel=1e-12)
    for name in ("wing", "fuselage", "boom_inner_port", "battery", "fixed", "pusher_motor"):
        assert float(less[name]) == float(more[name])


def test_hover_trim_is_that_of_the_rotors_that_are_there(six):
    """Downward force of body axes: weight less thrusts; pitching moment: thrusts times arms about the centre of gravity."""
    with torch.no_grad():
        analysis = six.analyze(six.x0)
    thrust = analysis.propulsion.loads.thrust[:6]
    weight = analysis.gross_mass * 9.80665
    assert float(analysis.trim.force[0, 2]) == pytest.approx(float(weight - thrust.sum()), rel=1e-9)
    arms = analysis.shape.hubs[:6, 0] - analysis.weights.total.center_of_gravity[0]
    assert float(analysis.trim.moment[0, 1].abs()) == pytest.approx(float((thrust * arms).sum().abs()), rel=1e-9)


def test_a_boom_with_one_rotor_ends_at_the_wing(six):
    """The outer boom has lost the piece ahead of the wing, which the quarter chord divides."""
    eight = gross_weight_problem(*load(overrides=["vehicle.motors.lift_bounds=file"]))
    with torch.no_grad():
        less, more = (problem.analyze(problem.x0).shape for problem in (six, eight))
    outer_front, outer_rear = more.hubs[0, 0], more.hubs[1, 0]
    overhang = baseline()[0].booms.overhang
    assert float(less.boom_length[1]) == float(more.boom_length[1])
    piece = float(more.boom_length[0]) - float(less.boom_length[0]) - overhang  # from the front hub to the wing
    quarter_chord = float(outer_front) + piece
    expected = 3.1245 + 5.715 * torch.tan(torch.tensor(baseline()[0].wing.quarter_chord_sweep)).item()
    assert quarter_chord == pytest.approx(expected, abs=2e-3)
    assert float(outer_rear) > quarter_chord


def test_derivatives_of_another_layout_are_exact(six):
    assert all(check["is_met"] for check in own_checks(six, six.x0))


def test_blades_of_other_layouts_can_be_optimized_in_hover(six):
    problem = aeroacoustic_problem(six.analyze_design.vehicle, six.analyze_design.mission)
    assert problem.size == 6 * 8
    with torch.no_grad():
        objective, rows = problem.evaluate(problem.x0)
    assert bool(objective.isfinite() & rows.isfinite().all())


def test_shipped_booms_carry_two_rotors_each_and_have_their_whole_mass():
    vehicle, _ = baseline()
    assert [boom.rotors for boom in booms(vehicle)] == [((0, 6), (1, 7)), ((2, 4), (3, 5))]
    assert boom_shares(vehicle, COMPONENTS).tolist() == [1.0] * len(COMPONENTS)


def test_rotors_of_one_boom_that_could_touch_have_a_row():
    """Four large rotors: 5 m between the hubs of a boom, radii of up to 2.5 m."""
    problem = runpy.run_path(str(Path(__file__).parents[2] / "docs" / "examples" / "four_rotors.py"))["problem"]
    (row,) = (row for row in problem.constraints if row.name.startswith("tip_clearance"))
    with torch.no_grad():
        gap = row.of(problem.analyze(problem.x0))
    assert row.name == "tip_clearance_boom_1"
    assert gap.tolist() == pytest.approx([5.0 - 2 * 2.1] * 2, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "fragment"),
    [
        (without("front_outer_port"), "7 lift and 1 pusher rotors are not allowed"),
        (
            without(
                *OUTER_FRONT, "rear_outer_port", "rear_outer_starboard", "front_inner_port", "front_inner_starboard"
            ),
            "an even number of lift rotors from 4 to 16",
        ),
        (SHIPPED.replace("[5.852, ", "[2.852, "), "both lie ahead of the wing's quarter-chord line"),
        (without("front_outer_port", "rear_outer_starboard"), "'rear_outer_port' needs one mirror image"),
    ],
)
def test_layouts_that_cannot_be_are_refused_in_one_sentence(tmp_path, text, fragment):
    file = tmp_path / "vehicle.toml"
    file.write_text(text)
    with pytest.raises(ConfigurationError) as told:
        load(file)
    assert fragment in str(told.value)
    assert "\n" not in str(told.value)


def test_the_reduced_formulation_of_another_layout_is_the_same_aircraft(six):
    """One of two mirrored rotors designed: three lift rotors and the pusher, the same rows of the published problem's start."""
    vehicle, mission = six.analyze_design.vehicle, six.analyze_design.mission
    reduced = reduced_problem(vehicle, mission)
    assert reduced.size == six.size - 3 * 10 - 1  # the climb's end follows the cruise altitude
    with torch.no_grad():
        ours, whole = reduced.analyze(reduced.x0), six.analyze(six.x0)
    torch.testing.assert_close(ours.scaled_trim, whole.scaled_trim, rtol=0.0, atol=1e-12)
    assert float(ours.gross_mass) == pytest.approx(float(whole.gross_mass), rel=1e-14)
