"""Every malformed file and option ends with exit code 2, one sentence that teaches, and nothing written."""

import importlib.util
import json
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path

import pytest
from click.testing import CliRunner
from conftest import REFERENCE
from refusals import RUN, assert_refused, everything, write
from stored_files import result, variable

from lpc_mdo.cli import main


@dataclass(frozen=True)
class Row:
    """What is malformed, the command, what the message must name, and the files it meets: text, or None for a folder."""

    what: str
    command: str
    expected: tuple[str, ...]
    files: dict[str, str | bytes | None] = field(default_factory=dict)


def shipped(kind):
    return resources.files("lpc_mdo.data").joinpath(f"{kind}.toml").read_text(encoding="utf-8")


def line(kind, text):
    """Where it stands in the shipped file."""
    return f"line {shipped(kind)[: shipped(kind).index(text)].count(chr(10)) + 1}"


def in_vehicle(what, old, new, *expected):
    assert old in shipped("vehicle")
    files = {"mine.toml": shipped("vehicle").replace(old, new, 1)}
    return Row(what, f"{RUN} mine.toml", ("mine.toml: ", *expected), files)


def in_mission(what, old, new, *expected):
    assert old in shipped("mission")
    files = {"mine.toml": shipped("mission").replace(old, new, 1)}
    return Row(what, f"{RUN} --mission mine.toml", ("mine.toml: ", *expected), files)


def in_case(what, discipline, case, path, value, *expected):
    """The reference case with the value at `path` replaced, or removed where `value` is ..."""
    content = (
        json.loads((REFERENCE / f"{case}.json").read_text()) if isinstance(case, str) else json.loads(json.dumps(case))
    )
    node = content
    for key in path[:-1]:
        node = node[key]
    if value is ...:
        del node[path[-1]]
    else:
        node[path[-1]] = value
    files = {"case.json": json.dumps(content)}
    return Row(what, f"analyze {discipline} case.json", ("case.json: ", *expected), files)


def in_json(what, text, *expected):
    return Row(what, "analyze motor case.json", ("case.json: ", *expected), {"case.json": text})


def option(what, options, *expected, **files):
    return Row(what, f"{RUN} {options}", expected, {name.replace("_", "."): text for name, text in files.items()})


AIRFOIL = {"inputs": {"airfoil": "naca4412", "alpha_deg": [0.0, 5.0], "reynolds": 1e6, "mach": 0.1}}
ROTOR, WING, TONES = "bem_lift_rotor_axial", "vlm_rect_ar8_flat", "noise_tonal_hover"
MOTOR, BATTERY, FRAME = "motor_dq", "battery_thevenin", "structures_frame_L"

VEHICLES = [
    in_vehicle(
        "negative area",
        "area_m2 = 19.536",
        "area_m2 = -19.5",
        "wing.area_m2 = -19.5",
        f"0.5 and 100 ({line('vehicle', 'area_m2')})",
    ),
    in_vehicle("area not a number", "area_m2 = 19.536", "area_m2 = nan", "wing.area_m2 = nan", "between 0.5 and 100"),
    in_vehicle("infinite mass", "mass_kg = 900.0", "mass_kg = inf", "battery.mass_kg = inf", "between 10 and 10000"),
    in_vehicle("number as text", "mass_kg = 900.0", 'mass_kg = "900"', "battery.mass_kg = '900'", "finite number"),
    in_vehicle("truth value for a number", "spin = 1", "spin = true", "rotors[0].spin = 'true'", "-1 or 1"),
    in_vehicle("area in square feet", "area_m2 = 19.536", "area_ft2 = 210", "wing.area_ft2", "area_m2", "known key"),
    in_vehicle("unknown key", "[booms]", "[booms]\ncolour = 3", "booms.colour", "diameter_m, overhang_m", "known key"),
    in_vehicle("unknown table", "[booms]", "[floats]\n[booms]", "floats is not a known key", "fuselage, booms"),
    in_vehicle("missing key", "dc_voltage_V = 800.0", "", "motors.dc_voltage_V is missing (line "),
    in_vehicle("rotor without a kind", 'kind = "lift"', "", "rotors[0].kind is missing (line "),
    in_vehicle("rotor of no kind", 'kind = "lift"', "kind = 3", "rotors[0].kind = 3 is", "'lift' or 'pusher'"),
    in_vehicle("half a blade", "blades = 2", "blades = 2.5", "rotors[0].blades = 2.5", "whole number between 2 and 8"),
    in_vehicle("three twists", ", 23.333333", "", "rotors[0].twist_deg = [30.0, ", "at least 4"),
    in_vehicle("one rotor finer", "chord_m = [0.30, 0.10]", "chord_m = [0.3, 0.2, 0.1]", "2 and 3 control points"),
    in_vehicle("feathered beyond", "twist_deg = [30.0", "twist_deg = [95.0", "twist_deg[0] = 95.0", "-10 and 90"),
    in_vehicle("point in a plane", "hub_m = [1.545, -5.715, 2.051]", "hub_m = [1.5, -5.7]", "rotors[0].hub_m[2]"),
    in_vehicle("list for a table", "[booms]", "[[booms]]", "booms = [", "it must be a table of keys", "(line "),
    in_vehicle("thin section", 'airfoil = "ls417"', 'airfoil = "4404"', "wing.airfoil = '4404'", "between 06 and 24"),
    in_vehicle("camber nowhere", 'airfoil = "ls417"', 'airfoil = "4017"', "wing.airfoil = '4017'", "between 1 and 9"),
    in_vehicle("unknown source", 'source = "published"', 'source = "mine"', "structure.source = 'mine'", "'published'"),
    in_vehicle("no mirror image", "hub_m = [1.545, -5.715", "hub_m = [1.6, -5.715", "rotors", "'front_outer_port'"),
    in_vehicle(
        "no pusher", 'kind = "pusher"', 'kind = "lift"', "rotors: 9 lift and 0 pusher", "even number of lift rotors"
    ),
    in_vehicle("drag counted twice", '"landing_gear"', '"wing"', "drag.areas[1].name = 'wing'", "another item"),
    in_vehicle("not TOML", "[wing]", "[wing", "is not valid TOML", line("vehicle", "[wing]")),
    Row(
        "start beyond the problem's bounds",
        f"{RUN} mine.toml",
        (
            "mine.toml: battery.position_m[0] = 9 is invalid",
            "between 2.85 and 3.5, bounds.battery_position_m; change either",
            line("vehicle", "position_m = [3.2,"),
        ),
        {"mine.toml": shipped("vehicle").replace("position_m = [3.2,", "position_m = [9.0,")},
    ),
    Row("binary vehicle", f"{RUN} mine.toml", ("mine.toml: cannot be read", "UTF-8"), {"mine.toml": b"\xff\xfe\x00"}),
    Row("vehicle not there", f"{RUN} mine.toml", ("mine.toml: cannot be read", "No such file")),
    Row("folder for a vehicle", f"{RUN} mine.toml", ("mine.toml: cannot be read", "directory"), {"mine.toml": None}),
]

MISSIONS = [
    in_mission(
        "no flight", "flights = 2", "flights = 0", "flights = 0", "between 1 and 20", line("mission", "flights = 2")
    ),
    in_mission("endless hover", "duration_s = 90.0", "duration_s = inf", "hover.duration_s = inf", "1 and 3600"),
    in_mission("speed in knots", "speed_m_per_s", "speed_kt", "climb.speed_kt is not a known key", "speed_m_per_s"),
    in_mission("hover above cruise", "= 76.2 ", "= 2000 ", "cruise.altitude_m = 1006", "it must exceed 2000 m"),
    in_mission("climb beyond cruise", "= 69450.0", "= 9000.0", "cruise.distance_m = 9000", "exceed their 11587 m"),
    in_mission(
        "unknown convention",
        '"per_band"',
        '"loud"',
        "acoustic_convention = 'loud'",
        "'per_band', 'lsdo_acoustics_2023' or 'acoustics_2022'",
    ),
    in_mission(
        "former name of a convention", '"per_band"', '"paper"', 'acoustic_convention = "paper" is invalid: write "lsdo_'
    ),
    in_mission("list for a number", "= 0.2", "= [0.2]", "minimum_final_state_of_charge = [0.2]", "between 0 and 0.9"),
    Row("mission not there", f"{RUN} --mission mine.toml", ("mine.toml: cannot be read", "No such file")),
]

CASES = [
    in_json("not JSON", '{"inputs": ', "is not valid JSON", "line 1 column 12"),
    in_json("empty file", "", "is not valid JSON"),
    in_json("list for a case", "[1, 2]", "inputs is missing"),
    in_json("JSON nested too deeply", "[" * 100_000, "is not valid JSON"),
    Row("case not there", "analyze wing case.json", ("case.json: cannot be read", "No such file")),
    Row("folder for a case", "analyze wing case.json", ("case.json: cannot be read", "directory"), {"case.json": None}),
    Row("unknown discipline", "analyze tail case.json", ("'tail'", "airfoil", "battery")),
    in_case("Reynolds number beyond the polars", "airfoil", AIRFOIL, ["inputs", "reynolds"], 1e9,
            "inputs.reynolds = 1e+09", "between 30000 and 1e+07"),
    in_case("Reynolds number below the polars", "airfoil", AIRFOIL, ["inputs", "reynolds"], [1e6, 1e3],
            "inputs.reynolds = 1000", "between 30000 and 1e+07"),
    in_case("transonic section", "airfoil", AIRFOIL, ["inputs", "mach"], 0.9, "inputs.mach = 0.9", "0 and 0.6"),
    in_case("too few Mach numbers", "airfoil", AIRFOIL, ["inputs", "mach"], [0.1], "inputs.mach has 1 values", "has 2"),
    in_case("more than a turn", "airfoil", AIRFOIL, ["inputs", "alpha_deg"], [200], "alpha_deg[0] = 200", "-180 and 180"),
    in_case("unknown section", "airfoil", AIRFOIL, ["inputs", "airfoil"], "e387", "inputs.airfoil = 'e387'", "naca4412"),
    in_case("missing density", "rotor", ROTOR, ["inputs", "rho"], ..., "inputs.rho is missing"),
    in_case("density as text", "rotor", ROTOR, ["inputs", "rho"], "1.1", "inputs.rho = '1.1'", "number above 0"),
    in_case("density not a number", "rotor", ROTOR, ["inputs", "rho"], float("nan"), "inputs.rho = nan", "finite number"),
    in_case("truth value for density", "rotor", ROTOR, ["inputs", "rho"], True, "inputs.rho = True", "above 0"),
    in_case("speed in rad/s", "rotor", ROTOR, ["inputs", "omega"], 100.0, "inputs.omega is not a known key", "radius_m"),
    in_case("hub beyond the tip", "rotor", ROTOR, ["inputs", "hub_radius_m"], 2.0, "hub_radius_m = 2.0", "radius_m = 1.524"),
    in_case("half a polar", "rotor", ROTOR, ["inputs", "cd0"], ..., "inputs.polar", "cl0, cla_per_rad, cd0 and k"),
    in_case("rotor at rest", "rotor", ROTOR, ["results", 0, "rpm"], 0, "results[0].rpm = 0", "above 0"),
    in_case("yes for true", "rotor", ROTOR, ["results", 0, "hub_loss"], "yes", "hub_loss = 'yes'", "true or false"),
    in_case("no conditions", "rotor", ROTOR, ["results"], [], "conditions is missing"),
    in_case("overflowing speed", "rotor", ROTOR, ["results", 0, "rpm"], 1e300, "results[0].rpm = 1e+300", "at most 10000000"),
    in_case("a cell of a whole town", "battery", BATTERY, ["inputs", "capacity_C"], 1.44e13, "capacity_C = 14400000000000.0", "at most 100000000"),
    in_case("ohms for milliohms", "battery", BATTERY, ["inputs", "R0_ohm"], 2e3, "R0_ohm = 2000.0", "at most 100"),
    in_case("volts for millivolts", "battery", BATTERY, ["inputs", "ocv_table_V", 0], 3200.0, "ocv_table_V[0] = 3200.0", "at most 2000"),
    in_case("a saliency of a thousand", "motor", MOTOR, ["inputs", "L_q_H"], 0.32, "L_q_H = 0.32", "100 times L_d_H"),
    in_case("a chord longer than the blade", "rotor", ROTOR, ["inputs", "chord_m"], [2.5, 0.1], "chord_m = [2.5, 0.1]", "at most radius_m"),
    in_case("gigapascals in pascals", "structures", FRAME, ["E"], 7e19, "E = 7e+19", "at most 1e+13"),
    in_case("a tube twice", "structures", FRAME, ["segments", 1], [0, 1], "segments[1] = [0, 1]", "differ from segments[0]"),
    in_case("blades in water of lead", "noise", TONES, ["inputs", "rho"], 1.2e4, "rho = 12000.0", "at most 2000"),
    in_case("wing of no span", "wing", WING, ["inputs", "surfaces_half", 0, "tip", 1], 0.0, "tip[1] = 0.0", "above 0"),
    in_case("wing without centre", "wing", WING, ["inputs", "surfaces_half", 0, "root", 1], 1.0, "root[1] = 1.0", "be 0"),
    in_case("unknown camber", "wing", WING, ["inputs", "surfaces_half", 0, "camber"], "flat", "camber = 'flat'", "'none'"),
    in_case("no panels", "wing", WING, ["mesh"], {"chordwise_panels": 0}, "mesh.chordwise_panels = 0", "1 and 64"),
    in_case("conditions for a wing", "wing", WING, ["conditions"], [], "conditions is not a known key", "inputs, mesh"),
    in_case("flow from behind", "wing", WING, ["inputs", "conditions_alpha_beta_deg"], [[180, 0]], "[0][0] = 180", "90"),
    in_case("ear in the rotor", "noise", TONES, ["inputs", "distance_m"], 1.0, "distance_m = 1.0", "radius_m = 1.524"),
    in_case("above the zenith", "noise", TONES, ["results", 1, "elevation_from_disk_plane_deg"], 120,
            "results[1].elevation_from_disk_plane_deg = 120", "between -90 and 90"),
    in_case("negative frequency", "noise", "noise_a_weighting", ["inputs", "frequency_Hz", 3], -20, "[3] = -20", "above 0"),
    in_case("reversed saliency", "motor", MOTOR, ["inputs", "L_q_H"], 1e-4, "L_q_H = 0.0001", "at least L_d_H = 0.0002"),
    in_case("mesh for a motor", "motor", MOTOR, ["mesh"], {}, "mesh is not a known key", "conditions, inputs"),
    in_case("falling charge table", "battery", BATTERY, ["inputs", "soc_table", 1], 0.5, "inputs.soc_table", "increase"),
    in_case("tables of two lengths", "battery", BATTERY, ["inputs", "soc_table"], [0, 1], "has 2 values", "has 11"),
    in_case("more than full", "battery", BATTERY, ["inputs", "initial_state_of_charge"], 1.2, "= 1.2", "between 0 and 1"),
    in_case("more power than the cell has", "battery", BATTERY, ["inputs", "segments", 0, "power_W"], 1e4, "power_W = 10000", "101.6"),
]  # fmt: skip

OPTIONS = [
    Row("no command", "", ("Missing command",)),
    Row("misspelt command", "optimise", ("No such command 'optimise'", "optimize")),
    Row("unknown option", "optimize --colour red", ("--colour",)),
    option("unknown solver", "--solver simplex", "--solver", "'simplex'", "'augmented-lagrangian', 'sqp', 'slsqp'"),
    *(
        ()
        if importlib.util.find_spec("cyipopt")
        else (option("solver not installed", "--solver ipopt", "--solver", "not installed", "lpc-mdo[ipopt]"),)
    ),
    option("output of a name too long", f"--output {'x' * 300}", "file name too long", "at most 255 bytes"),
    option(
        "section of a name beyond reading", f"--set vehicle.wing.airfoil={'x' * 90_000}", " ... ", "it must be a NACA"
    ),
    option("polar of a name too long", f"--set vehicle.wing.polar={'x' * 300}", "is invalid: it must be one of"),
    option("section of a name too long", f"--set vehicle.wing.airfoil={'x' * 300}", "is invalid: it must be a NACA"),
    option("unknown problem", "--problem range", "--problem", "range", "gross-weight"),
    option("no time", "--time-limit 0", "--time-limit", "0.0", "1.0"),
    option("time not a number", "--time-limit nan", "--time-limit", "nan", "at least 1"),
    option("override without value", "--set vehicle.wing.area_m2", "--set vehicle.wing.area_m2", "KEY=VALUE"),
    option("override of nothing", "--set area_m2=18", "--set area_m2=18", "'vehicle.' or 'mission.'"),
    option("override of an unknown key", "--set vehicle.wing.area=18", "'area' is not a known key", "area_m2"),
    option("override of a table", "--set vehicle.booms=1", "vehicle.booms is a table", "diameter_m, overhang_m"),
    option("override of a tenth rotor", "--set vehicle.rotors.9.radius_m=1", "'9' is not an index from 0 to 8"),
    option("override with words", "--set vehicle.wing.area_m2=big", "--set vehicle.wing.area_m2=big", "not a number"),
    option("override out of range", "--set vehicle.wing.area_m2=900", "--set vehicle.wing.area_m2=900", "0.5 and 100"),
    option("override with infinity", "--set mission.reserve.distance_m=inf", "distance_m = inf", "0 and 1000000"),
    option(
        "start slower than the problem's rotors",
        "--set vehicle.rotors.8.speed_rpm=900",
        "--set vehicle.rotors.8.speed_rpm=900: rotors[8].speed_rpm = 900 is invalid",
        "between 1200 and 2500, bounds.pusher_speed_rpm; change either",
    ),
    option(
        "motor beyond the problem's",
        "--set vehicle.motors.lift_bore_m=0.4",
        "motors.lift_bore_m = 0.4 is invalid",
        "between 0.08 and 0.3, bounds.lift_motor_diameter_m; change either",
    ),
    option("start not there", "--start old.json", "old.json: cannot be read", "No such file"),
    option("start not JSON", "--start old.json", "old.json: is not valid JSON", old_json='{"schema": '),
    option(
        "start of another schema",
        "--start old.json",
        "old.json: [] is invalid",
        "must be a table of keys",
        old_json="[]",
    ),
    option(
        "start of another problem",
        "--start old.json",
        "old.json: design variable rotor_radius is missing",
        old_json=json.dumps(result([variable("x", 0.0, 1.0)])),
    ),
    option(
        "start with a hole",
        "--start old.json",
        "old.json: design variable rotor_radius must hold 9 finite numbers",
        old_json=json.dumps(result([variable("rotor_radius", [1.4, 1.4], [1.5, 1.6])])),
    ),
    option("resume nothing", "--resume", "checkpoint.json: cannot be read", "No such file"),
    option("resume with a start", "--resume --start old.json", "--start is not allowed with --resume"),
    option("resume a solver without checkpoint", "--resume --solver slsqp", "--resume", "--solver slsqp"),
    Row("resume half a file", f"{RUN} --resume", ("is not valid JSON",), {"run/checkpoint.json": '{"schema": "lpc'}),
    Row(
        "resume a list",
        f"{RUN} --resume",
        ("checkpoint.json: [] is invalid", "must be a table of keys"),
        {"run/checkpoint.json": "[]"},
    ),
    Row(
        "resume without a schema",
        f"{RUN} --resume",
        ("checkpoint.json: schema is missing",),
        {"run/checkpoint.json": "{}"},
    ),
    Row(
        "resume another aircraft",
        f"{RUN} --resume",
        ("checkpoint.json: belongs to another vehicle or mission",),
        {"run/checkpoint.json": '{"schema": "lpc-mdo/checkpoint/2", "configuration_sha256": "0"}'},
    ),
    Row("too many points", "pareto noise-efficiency --points 1600 --output run", ("--points", "1600", "2<=x<=400")),
    Row(
        "too many values",
        f"sweep vehicle.wing.taper --output run --values {','.join(['0.5'] * 1001)}",
        ("--values", "1001 values are too many", "at most 1000"),
    ),
    Row("output is a file", RUN, ("--output run is not allowed", "not a folder"), {"run": "text"}),
    Row("output below a file", f"{RUN}/a", ("--output run/a is not allowed", "Not a directory"), {"run": "text"}),
    Row("copy onto a file", "init here", ("here is not allowed", "not a folder"), {"here": "text"}),
    Row("copy over a vehicle", "init here", ("vehicle.toml exists already",), {"here/vehicle.toml": "[wing]"}),
    Row("copy below a file", "init here/there", ("here/there is not allowed",), {"here": "text"}),
]

ROWS = VEHICLES + MISSIONS + CASES + OPTIONS


@pytest.mark.parametrize("row", ROWS, ids=[row.what for row in ROWS])
def test_malformed_input_is_refused_in_one_line_and_leaves_nothing_behind(tmp_path, monkeypatch, row):
    monkeypatch.chdir(tmp_path)
    write(row.files)
    before = everything()
    run = CliRunner().invoke(main, row.command.split())
    assert_refused(run.exit_code, run.stdout, run.stderr, row.expected)
    assert everything() == before


def test_a_process_of_its_own_refuses_in_the_same_way(tmp_path):
    row = VEHICLES[0]
    (tmp_path / "mine.toml").write_text(row.files["mine.toml"])
    program = shutil.which("lpc-mdo", path=str(Path(sys.executable).parent))
    run = subprocess.run([program, *row.command.split()], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert_refused(run.returncode, run.stdout, run.stderr, row.expected)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


def test_a_long_refusal_shows_its_place_and_its_rule(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke(main, [*RUN.split(), "--set", "vehicle.wing.airfoil=" + "x" * 100_000])
    assert run.exit_code == 2
    assert len(run.stderr) < 900
    assert run.stderr.startswith("lpc-mdo: --set vehicle.wing.airfoil=xxx")
    assert "it must be a NACA section" in run.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["export", "geometry", "run"], ("Missing option '--format'. Choose from: step, stl, vtk, png",)),
        (["analyze"], ("Missing argument", "airfoil, rotor, wing, noise, motor, battery, structures")),
        (["optimize", "--output", ""], ("--output", "'' is invalid: it must name a folder")),
        (["sweep", "battery-energy-density", "--values", ""], ("--values", "it must be numbers with commas")),
        (["pareto", "noise-efficiency", "--jobs", "100000"], ("--jobs", "1<=x<=256")),
        (["optimize", "--starts", "2", "--jobs", "100000"], ("--jobs", "1<=x<=256")),
        (
            [*RUN.split(), "--set", "vehicle.wing.polar=/dev/zero"],
            ("wing.polar = '/dev/zero' is invalid", "it must be a file"),
        ),
        (
            [*RUN.split(), "--set", "vehicle.wing.polar=nothing"],
            ("wing.polar = 'nothing' is invalid: it must be one of",),
        ),
        (
            [*RUN.split(), "--set", "vehicle.wing.airfoil=/dev/zero"],
            ("wing.airfoil = '/dev/zero' is invalid", "a file."),
        ),
        (
            [*RUN.split(), "--set", "mission.segments.0.name=x y"],
            ("segments[0].name = 'x y' is invalid", "it must be a word"),
        ),
    ],
)
def test_options_without_sense_are_refused_before_anything_is_done(tmp_path, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke(main, arguments)
    assert_refused(run.exit_code, run.stdout, run.stderr, words)
    assert ".." not in run.stderr
    assert not list(tmp_path.iterdir())
