"""Layouts that nobody could build are refused in words; those that somebody has built are not."""

import re
import runpy
from importlib import resources
from pathlib import Path

import pytest

from lpc_mdo.config import ConfigurationError, load

SHIPPED = resources.files("lpc_mdo.data").joinpath("vehicle.toml").read_text(encoding="utf-8")


def refusal(*overrides):
    with pytest.raises(ConfigurationError) as told:
        load(overrides=[f"vehicle.{override}" for override in overrides])
    assert len(str(told.value).splitlines()) == 1
    return str(told.value)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("blades=4", "rotors[0].blades = 4 is invalid: it must be 2"),
        ("root_cutout=0.3", "rotors[0].root_cutout = 0.3 is invalid: it must be 0.2"),
        ("radius_m=1.4", "rotors[0].radius_m = 1.4 is invalid: it must be 1.524"),
        ("chord_m.1=0.2", "rotors[0].chord_m = [0.3, 0.2] is invalid: it must be [0.3, 0.1]"),
        ("twist_deg.3=12", "rotors[0].twist_deg = [30.0, 23.33333, 16.66667, 12.0] is invalid"),
        ("speed_rpm=1000", "rotors[0].speed_rpm = 1000.0 is invalid: it must be 1200.0"),
    ],
)
@pytest.mark.parametrize("rotor", [0, 6])
def test_two_mirrored_rotors_are_one_design(rotor, override, words):
    sentence = refusal(f"rotors.{rotor}.{override}")
    for name in ("'front_outer_port'", "'front_outer_starboard'"):
        assert name in sentence
    if rotor == 0:
        assert sentence.startswith(f"--set vehicle.rotors.0.{override}: {words}")


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["rotors.8.hub_m.1=20"], "rotors[8].hub_m[1] = 20.0 is invalid: it must be 0"),
        (["battery.position_m.1=50"], "battery.position_m[1] = 50.0 is invalid: it must be 0"),
        (["vertical_tail.root_quarter_chord_m.1=30"], "vertical_tail.root_quarter_chord_m[1] = 30.0 is invalid"),
        (["wing.root_quarter_chord_m.1=0.1"], "wing.root_quarter_chord_m[1] = 0.1 is invalid"),
        (["fixed_masses.2.position_m.1=3"], "fixed_masses[2].position_m[1] = 3.0 is invalid: it must be balanced"),
        (["drag.areas.1.position_m.1=0.5"], "drag.areas[1].position_m[1] = 0.5 is invalid: it must be balanced"),
        (["fuselage.nose_m.0=20"], "fuselage.rear_m[0] = 9.72 is invalid: it must lie behind nose_m[0] = 20.0"),
        (["fuselage.length_m=30"], "fuselage.length_m = 30.0 is invalid: it must agree with nose_m and rear_m"),
        (["wing.root_quarter_chord_m.2=-50"], "wing.root_quarter_chord_m[2] = -50.0 is invalid"),
        (["horizontal_tail.root_quarter_chord_m.0=3.1"], "it must lie farther aft: its leading edge, x = 2.811 m"),
        (["horizontal_tail.root_quarter_chord_m.0=-5"], "horizontal_tail.root_quarter_chord_m[0] = -5.0 is invalid"),
        (["vertical_tail.root_quarter_chord_m.0=3"], "vertical_tail.root_quarter_chord_m[0] = 3.0 is invalid"),
        (["horizontal_tail.root_quarter_chord_m.2=20"], "the body or the fin, which carry the tail"),
        (["rotors.8.hub_m.0=1"], "rotors[8].hub_m[0] = 1.0 is invalid: it must lie behind the wing's trailing edge"),
        (["rotors.8.hub_m.2=-30"], "rotors[8].hub_m[2] = -30.0 is invalid"),
        (["battery.position_m.2=-20"], "battery.position_m[2] = -20.0 is invalid"),
        (["fixed_masses.0.position_m.0=-40"], "'nose_gear' is a part of the aircraft"),
        (["drag.areas.0.position_m.2=40"], "'hubs_and_stopped_rotors' is a part of the aircraft"),
        (["wing.area_m2=10"], "rotors[0].hub_m[1] = -5.715 is invalid: it must lie within the wing's half span"),
        (["wing.aspect_ratio=4"], "the boom of 'front_outer_port' crosses the wing there"),
        ([f"fixed_masses.{i}.mass_kg=0" for i in range(8)], "all fixed masses together are 0 kg"),
        ([f"rotors.{i}.radius_m=10" for i in range(8)], "rotors[0].radius_m = 10.0 is invalid"),
        ([f"rotors.{i}.radius_m=2" for i in range(8)], "rotors[0].radius_m = 2.0 is invalid: it must be smaller"),
        ([f"rotors.{i}.radius_m=2.5" for i in (2, 3, 4, 5)], "the distance of its hub from the fuselage's side"),
        ([f"rotors.{i}.hub_m.2=40" for i in (0, 6)], "a boom joins them"),
        (
            ["booms.diameter_m=1.3"],
            "booms.diameter_m = 1.3 is invalid: it must be at most 0.7785, half the fuselage's width",
        ),
        (["booms.overhang_m=3"], "booms.overhang_m = 3 is invalid: it must be at most 1.524, the lift rotors' radius"),
        (["fuselage.height_m=6"], "fuselage.height_m = 6 is invalid: it must be at most 4.572, half its length"),
        (["vertical_tail.area_m2=50"], "vertical_tail.area_m2 = 50 is invalid: it must be at most 9.768"),
        (["drag.study.area_m2=10"], "drag.study.area_m2 = 10 is invalid: it must be at most 4.884"),
        (["drag.areas.0.area_m2=5"], "a quarter of the wing's area, all areas together"),
        (["drag.study.position_m.1=0.5"], "drag.study.position_m[1] = 0.5 is invalid: it must be 0"),
        (["drag.study.position_m.0=-50"], "drag.study.position_m[0] = -50.0 is invalid: it must lie between"),
        (["rotors.8.speed_rpm=2400"], "rotors[8].speed_rpm = 2400.0 is invalid: it must be lower"),
        (
            ["rotors.8.hub_m.0=6"],
            "rotors[8].hub_m[0] = 6.0 is invalid: it must lie before 0.751 or behind 9.72: between them",
        ),
        (["rotors.8.hub_m=[9.73, 0.0, 3.0]"], "its blades cut through the vertical_tail"),
        (
            ["rotors.8.hub_m.0=9.8", "horizontal_tail.root_quarter_chord_m.0=9.1"],
            "between them its blades cut through the horizontal_tail",
        ),
        (
            ["rotors.0.airfoil=[['naca4412', 0.5], ['ls417', 1.0]]"],
            "rotors[0].airfoil = [['naca4412', 0.5], ['ls417', 1.0]] is invalid: it must be 'naca4412', that of rotors[6]",
        ),
        (["wing.root_quarter_chord_m.0=31"], "both lie ahead of the wing's quarter-chord line, x = 31.54 there"),
        (["vertical_tail.root_quarter_chord_m.0=11"], "vertical_tail.root_quarter_chord_m[0] = 11.0 is invalid"),
        (
            ["bounds.battery_position_m.upper=35"],
            "bounds.battery_position_m.upper = 35.0 is invalid: it must lie between",
        ),
        (
            ["bounds.battery_position_m.lower=-7"],
            "bounds.battery_position_m.lower = -7.0 is invalid: it must lie between",
        ),
        (["bounds.tail_position_m.upper=27"], "bounds.tail_position_m.upper = 27.0 is invalid: it must lie between"),
        (["bounds.tail_position_m.lower=0.5"], "along the body or the fin, which carry the tail, behind the wing"),
        (["fixed_masses.2.position_m.2=5"], "fixed_masses[2].position_m[2] = 5.0 is invalid: it must lie between"),
        (["fixed_masses.5.position_m.0=11.4"], "fixed_masses[5].position_m[0] = 11.4 is invalid: it must lie between"),
        (
            ["wing.area_m2=29"],
            "wing.area_m2 = 29 is invalid: it must lie between 13.9355 and 23.2258, bounds.wing_area_m2",
        ),
        (["battery.minimum_cell_voltage_V=4.5"], "it must lie between 0.5 and 4"),
        (["rotors.8.chord_m=[1.5, 0.1]"], "rotors[8].chord_m = [1.5, 0.1] is invalid: it must be below radius_m"),
    ],
)
def test_what_nobody_could_build_is_refused(overrides, words):
    assert words in refusal(*overrides)


def test_counts_that_no_aircraft_has_are_refused(tmp_path):
    head, *rotors = re.split(r"(?m)^(?=\[\[rotors\]\])", SHIPPED)
    file = tmp_path / "vehicle.toml"
    file.write_text(head + rotors[0] * 400)
    with pytest.raises(ConfigurationError, match=r"rotors = .* it must have at most 24"):
        load(file)
    unknown = "\n".join(f"key_{i} = {i}" for i in range(9000))
    file.write_text(SHIPPED.replace("[booms]", f"[booms]\n{unknown}"))
    with pytest.raises(ConfigurationError, match=r"booms\.key_0 is not a known key"):
        load(file)


@pytest.mark.parametrize("count", range(4, 17, 2))
def test_any_allowed_number_of_rotors_in_a_row_is_an_aircraft(tmp_path, count):
    """Booms of two rotors, the last of one where the half number is odd, evenly along a wing that is long enough."""
    side = count // 2
    head, *rotors = re.split(r"(?m)^(?=\[\[rotors\]\])", SHIPPED)
    made = []
    for k in range(side):
        y = 2.0 + 2.4 * (k // 2)
        x = (1.4, 5.8)[k % 2]
        for sign in (-1, 1):
            rotor = re.sub(r"hub_m = .*", f"hub_m = [{x}, {sign * y}, 2.4]", rotors[0])
            rotor = re.sub(r'name = ".*"', f'name = "rotor_{k}_{sign}"', rotor).replace("1.524", "1.1")
            made.append(rotor.replace("spin = 1", f"spin = {sign}"))
    text = head + "".join(made) + rotors[-1]
    for key, value in (("area_m2", 30.0), ("wing_area_m2", "{ lower = 20.0, upper = 40.0, reason = 'own' }")):
        text = re.sub(rf"(?m)^{key} = .*", f"{key} = {value}", text, count=1)
    text = text.replace("lift_rotor_radius_m = { lower = 1.2", "lift_rotor_radius_m = { lower = 1.0")
    file = tmp_path / "vehicle.toml"
    file.write_text(text)
    assert len(load(file)[0].lift_rotors) == count


@pytest.mark.parametrize("name", ["four_rotors", "other_aircraft"])
def test_examples_of_the_documentation_pass(name):
    file = Path(__file__).parents[2] / "docs" / "examples" / f"{name}.py"
    assert "problem" in runpy.run_path(str(file))
