"""Vehicle and mission files: units in the keys in, SI units out; one sentence for every fault."""

import math
import re
from importlib import resources

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from lpc_mdo.config import ConfigurationError, baseline, load
from lpc_mdo.config.layout import mirror_pairs

TEXT = {kind: resources.files("lpc_mdo.data").joinpath(f"{kind}.toml").read_text() for kind in ("vehicle", "mission")}


def line_of(kind, entry):
    """Number of the first line that begins with `entry`."""
    return next(i for i, line in enumerate(TEXT[kind].splitlines(), start=1) if line.startswith(entry))


def message_of(action, *arguments, **options):
    with pytest.raises(ConfigurationError) as error:
        action(*arguments, **options)
    return str(error.value)


@pytest.fixture
def edited(tmp_path):
    """A copy of a shipped file with one piece of text replaced; its path."""

    def write(kind, old, new):
        assert old in TEXT[kind]
        file = tmp_path / f"my_{kind}.toml"
        file.write_text(TEXT[kind].replace(old, new, 1))
        return file

    return write


def test_shipped_files_describe_eight_lift_rotors_and_one_pusher():
    vehicle, mission = baseline()
    assert (vehicle, mission) == load()
    assert len(vehicle.lift_rotors) == 8
    assert vehicle.pushers[0].kind == "pusher"
    assert mission.flights == 2


@pytest.mark.parametrize(
    ("value", "si"),
    [
        (lambda v, m: v.wing.area, 19.536),
        (lambda v, m: v.wing.incidence, math.radians(2.04)),
        (lambda v, m: v.wing.quarter_chord_sweep, math.radians(5.35)),
        (lambda v, m: v.wing.dihedral, math.radians(-2.25)),
        (lambda v, m: v.horizontal_tail.thickness_to_chord, 0.12),
        (lambda v, m: v.rotors[0].twist[0], math.radians(30.0)),
        (lambda v, m: v.rotors[0].speed, 1200.0 * 2.0 * math.pi / 60.0),
        (lambda v, m: v.battery.specific_energy, 400.0 * 3600.0),
        (lambda v, m: m.requirements.observer_elevation, math.radians(85.0)),
        (lambda v, m: m.segment("cruise").distance, 69450.0),
        (lambda v, m: math.sin(m.path_angle("climb")), 4.6087 / 57.617778),
    ],
)
def test_file_units_become_si_units(value, si):
    assert value(*load()) == pytest.approx(si, rel=1e-15)


def test_climb_covers_its_ground_distance():
    _, mission = load()
    time = (1006.0 - 76.2) / 4.6087
    assert math.hypot(mission.ground_distance("climb"), 1006.0 - 76.2) == pytest.approx(time * 57.617778, rel=1e-12)


def test_a_file_of_ones_own_replaces_the_shipped_one(edited):
    file = edited("vehicle", "area_m2 = 19.536", "area_m2 = 18")
    vehicle, mission = load(file)
    assert vehicle.wing.area == 18.0
    assert mission == load()[1]
    assert load(mission=edited("mission", "flights = 2", "flights = 3"))[1].flights == 3


def test_configuration_cannot_be_changed_after_loading():
    vehicle, _ = load()
    with pytest.raises(ValidationError, match="frozen"):
        vehicle.wing.area = 1.0


def test_override_changes_one_value_and_nothing_else():
    before, after = load()[0].model_dump(), load(overrides=["vehicle.wing.area_m2=18.5"])[0].model_dump()
    assert after["wing"].pop("area") == 18.5
    before["wing"].pop("area")
    assert after == before


@pytest.mark.parametrize(
    ("override", "value", "expected"),
    [
        ("vehicle.rotors.8.speed_rpm=1500", lambda v, m: v.pushers[0].speed, 50.0 * math.pi),
        ("vehicle.rotors.8.twist_deg.3=12", lambda v, m: v.rotors[8].twist[3], math.radians(12.0)),
        ("vehicle.rotors.8.chord_m=[0.2, 0.1]", lambda v, m: v.rotors[8].chord, (0.2, 0.1)),
        ("vehicle.wing.airfoil=2412", lambda v, m: v.wing.airfoil, "2412"),
        ("vehicle.wing.airfoil=0012", lambda v, m: v.wing.airfoil, "0012"),
        ('vehicle.wing.airfoil="0012"', lambda v, m: v.wing.airfoil, "0012"),
        (
            "mission.requirements.acoustic_convention=acoustics_2022",
            lambda v, m: m.requirements.acoustic_convention,
            "acoustics_2022",
        ),
        ("mission.cruise.speed_m_per_s=60", lambda v, m: m.speed("cruise"), 60.0),
        ("mission.reserve.distance_m=7e4", lambda v, m: m.reserve.distance, 7e4),
    ],
)
def test_override_reaches_numbers_lists_and_text(override, value, expected):
    assert value(*load(overrides=[override])) == expected


def test_last_of_two_overrides_holds():
    overrides = ["vehicle.wing.area_m2=-1", "vehicle.wing.area_m2=18"]
    assert load(overrides=overrides)[0].wing.area == 18.0
    message = message_of(load, overrides=overrides[::-1])
    assert message == (
        "--set vehicle.wing.area_m2=-1: wing.area_m2 = -1 is not allowed; it must lie between 0.5 and 100."
    )


@settings(deadline=None, max_examples=60)
@given(st.floats() | st.floats(-10.0, 150.0))
def test_a_number_is_kept_as_given_inside_its_range_and_refused_outside(speed):
    override = f"mission.cruise.speed_m_per_s={speed!r}"
    if 20.0 <= speed <= 120.0:
        assert load(overrides=[override])[1].speed("cruise") == speed
    else:
        message = message_of(load, overrides=[override])
        assert "cruise.speed_m_per_s" in message
        assert repr(speed) in message
        assert "between 20 and 120" in message


@pytest.mark.parametrize(
    ("kind", "old", "new", "line", "sentence"),
    [
        (
            "vehicle", "area_m2 = 19.536", "area_m2 = -19.5", "area_m2 = 19.536",
            "wing.area_m2 = -19.5 is not allowed; it must lie between 0.5 and 100",
        ),
        (
            "vehicle", "area_m2 = 19.536", 'area_m2 = "large"', "area_m2 = 19.536",
            "wing.area_m2 = 'large' is not allowed; it must be a finite number between 0.5 and 100",
        ),
        (
            "vehicle", "speed_rpm = 1350.0", "speed_rpm = 0", "speed_rpm = 1350",
            "rotors[8].speed_rpm = 0 is not allowed; it must lie between 50 and 10000",
        ),
        (
            "vehicle", "twist_deg = [60.0, 48.333333,", "twist_deg = [60.0, 91.0,", "twist_deg = [60",
            "rotors[8].twist_deg[1] = 91.0 is not allowed; it must lie between -10 and 90",
        ),
        (
            "vehicle", "blades = 4", "blades = 4.5", "blades = 4",
            "rotors[8].blades = 4.5 is not allowed; it must be a whole number between 2 and 8",
        ),
        (
            "vehicle", 'name = "landing_gear"\narea_m2 = 0.063', 'name = "landing_gear"\narea_m2 = 6',
            "area_m2 = 0.063", "drag.areas[1].area_m2 = 6 is not allowed; it must lie between 0 and 5",
        ),
        (
            "vehicle", 'airfoil = "ls417"', 'airfoil = "44170"', "airfoil = \"ls417",
            "wing.airfoil = '44170' is invalid: it must be a NACA section of four digits, one of ls417, or a coordinate file",
        ),
        (
            "vehicle", 'airfoil = "ls417"', 'airfoil = "4430"', "airfoil = \"ls417",
            "wing.airfoil = '4430' is not allowed; its thickness (last two digits) must lie between 06 and 24",
        ),
        (
            "vehicle", 'name = "landing_gear"', 'name = "wing"', 'name = "landing_gear"',
            "drag.areas[1].name = 'wing' is not allowed; another item of drag has that name",
        ),
        (
            "mission", "altitude_m = 76.2", "altitude_m = 2000.0", "altitude_m = 1006",
            "cruise.altitude_m = 1006 is invalid: it must exceed 2000 m, where 'climb' begins",
        ),
        (
            "mission", "distance_m = 69450.0", "distance_m = 11000", "distance_m = 69450",
            "cruise.distance_m = 11000 is invalid: it includes climb and descent and must exceed their 11587 m",
        ),
        (
            "mission", 'acoustic_convention = "per_band"', 'acoustic_convention = "loud"', "acoustic_convention",
            "requirements.acoustic_convention = 'loud' is not allowed; it must be 'per_band', 'lsdo_acoustics_2023' or 'acoustics_2022'",
        ),
        (
            "mission", "flights = 2", "flights = true", "flights",
            "flights = True is not allowed; it must be a whole number between 1 and 20",
        ),
        ("mission", "duration_s = 90.0", "", "[[segments]]", "hover.duration_s is missing"),
    ],
)  # fmt: skip
def test_fault_names_file_field_value_rule_and_line(edited, kind, old, new, line, sentence):
    file = edited(kind, old, new)
    expected = f"{file}: {sentence} (line {line_of(kind, line)})."
    assert message_of(load, **{kind: file}) == expected


def test_a_key_in_the_wrong_unit_is_one_fault_that_lists_the_known_keys(edited):
    file = edited("vehicle", "area_m2 = 19.536", "area_ft2 = 210.28")
    message = message_of(load, file)
    assert message.startswith(f"{file}: wing.area_ft2 is not a known key; it must be one of area_m2, aspect_ratio,")
    assert message.endswith(f"(line {line_of('vehicle', 'area_m2 = 19.536')}).")
    assert "\n" not in message


def test_every_independent_fault_has_its_own_sentence():
    message = message_of(load, overrides=["vehicle.wing.area_m2=-1", "vehicle.battery.mass_kg=1"])
    first, second = message.splitlines()
    assert "wing.area_m2 = -1" in first
    assert "battery.mass_kg = 1 is not allowed; it must lie between 10 and 10000" in second


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"[wing\narea_m2 = 1", r"is not valid TOML: .*line 1"),
        (b"[wing]\narea_m2 = 1\narea_m2 = 2\n", "is not valid TOML: Cannot overwrite a value"),
        (b"\xff\xfe", "cannot be read: it is not UTF-8 text"),
        (b"", "name is missing"),
    ],
)
def test_a_file_that_is_no_vehicle_says_why(tmp_path, content, reason):
    file = tmp_path / "vehicle.toml"
    file.write_bytes(content)
    assert re.match(f"{re.escape(str(file))}: {reason}", message_of(load, file))


def test_mirror_pairs_have_opposite_sides_and_opposite_spins():
    vehicle, _ = load()
    pairs = mirror_pairs(vehicle)
    assert pairs == ((0, 6), (1, 7), (2, 4), (3, 5))
    for port, starboard in ((vehicle.rotors[i], vehicle.rotors[j]) for i, j in pairs):
        assert starboard.hub == (port.hub[0], -port.hub[1], port.hub[2])
        assert port.hub[1] < 0.0
        assert port.spin == -starboard.spin


@pytest.mark.parametrize(
    ("overrides", "fragment"),
    [
        (["vehicle.rotors.0.hub_m.0=1.6"], "'front_outer_port' needs one mirror image at hub_m = [1.6, 5.715, 2.051]"),
        (["vehicle.rotors.0.spin=-1"], "with the opposite spin"),
        (["vehicle.rotors.0.hub_m.1=5.715"], "'front_outer_port' needs one mirror image at hub_m"),
        (["vehicle.rotors.0.kind=pusher"], "7 lift and 2 pusher rotors are not allowed"),
        (["vehicle.rotors.0.name=pusher"], "every rotor needs a name of its own"),
    ],
)
def test_rotors_without_mirror_symmetry_are_refused(overrides, fragment):
    message = message_of(load, overrides=overrides)
    assert message.startswith("vehicle.toml: rotors: ")
    assert fragment in message
