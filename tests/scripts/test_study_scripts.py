"""Scripts that print the tables of the pages on noise and on studies."""

import runpy
import subprocess
import sys
from pathlib import Path

from analytic_studies import circles

from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.runner import StudyRun

SCRIPTS = Path(__file__).parents[2] / "scripts"


def run(name, *arguments):
    command = [sys.executable, "-W", "ignore", str(SCRIPTS / name), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def table(text):
    """Cells of a table in Markdown, without its heading."""
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines() if line.startswith("|")]
    assert len({len(row) for row in rows}) == 1
    return rows[2:]


def test_levels_add_up_under_every_convention():
    done = run("noise_levels.py")
    assert done.returncode == 0, done.stderr
    levels = {name: [float(cell) for cell in cells] for name, *cells in table(done.stdout)}
    for steep, flat in zip(levels["total, unweighted"], levels["total, `per_band`"], strict=True):
        assert steep > flat
    # At 45 degrees fore and aft is as far as down: the code of 2022 is unweighted, with the louder reference distance.
    assert levels["total, `acoustics_2022`"][1] > levels["total, `per_band`"][1]
    # Straight below its broadband part nearly vanishes.
    assert levels["total, `acoustics_2022`"][0] < levels["total, unweighted"][0] - 5.0
    assert levels["tones, steady loads"][0] < levels["tones, unsteady loads"][0]


def test_conventions_refuse_an_override_that_is_none():
    done = run("noise_conventions.py", "--set", "mission.nothing=1")
    assert done.returncode == 2
    assert "'nothing' is not a known key" in done.stderr.splitlines()[-1]


def test_a_study_is_printed_point_by_point(tmp_path):
    StudyRun(circles([0.25, 0.5, 0.75]), tmp_path, InProcess(), "slsqp").run()
    done = run("study_table.py", str(tmp_path))
    assert done.returncode == 0, done.stderr
    rows = table(done.stdout)
    assert [row[0] for row in rows] == ["0.25", "0.5", "0.75"]
    assert [float(row[1]) for row in rows] == [round(4.0 * (1.0 - w) ** 2, 5) for w in (0.25, 0.5, 0.75)]
    assert [row[-2:] for row in rows] == [["converged", "yes"]] * 3


def test_a_verdict_is_refuted_by_a_design_that_violates_nothing():
    verdicts = runpy.run_path(str(SCRIPTS / "verdicts.py"))
    cells = {
        "sqp": {"status": "infeasible", "violation": 0.1},
        "augmented-lagrangian": {"status": "iteration_limit", "violation": 0.2},
        "slsqp": {"status": "failed", "violation": 1e-9},
    }
    assert verdicts["is_refuted"](cells, "sqp")
    assert not verdicts["is_refuted"](cells, "augmented-lagrangian")
    assert not verdicts["is_refuted"](cells | {"slsqp": cells["augmented-lagrangian"]}, "sqp")


def test_verdicts_are_kept_and_settings_that_are_none_refused(tmp_path):
    kept = runpy.run_path(str(SCRIPTS / "verdicts.py"))["Kept"]
    assert kept(tmp_path).get("a, sqp", lambda: {"status": "converged"}) == {"status": "converged"}
    assert kept(tmp_path).get("a, sqp", lambda: {"status": "again"}) == {"status": "converged"}
    done = run("verdicts.py", "--only", "nothing", "--output", str(tmp_path))
    assert done.returncode == 2
    assert "--only 'nothing' names none of noise limit 56 dB(A)" in done.stderr


def test_a_choice_says_what_becomes_of_the_optimum_and_of_its_lift_motors():
    effect = runpy.run_path(str(SCRIPTS / "choices.py"))["effect"]
    ours = {
        "status": "converged",
        "gross_mass_kg": 3037.0,
        "gross_mass_initial_kg": 3384.0,
        "gross_mass_reduction_percent": 10.3,
        "motor_torque_share": {"front_hover": 0.98, "pusher_climb": 1.0},
    }
    assert effect(ours | {"gross_mass_kg": 3036.98}, ours) == "0.0 kg; 10.3 %"
    assert effect(ours | {"gross_mass_initial_kg": 7000.0}, ours) == "0.0 kg; 10.3 % of a start of 7000 kg"
    overloaded = ours | {"gross_mass_kg": 2901.8, "motor_torque_share": {"front_hover": 4.06, "pusher_climb": 1.0}}
    assert effect(overloaded, ours) == "−135.2 kg; 10.3 %; lift motors at 4.06 times their torque"
    assert effect(ours | {"status": "iteration_limit"}, ours) == "none: iteration limit"


def test_speed_settings_change_what_they_name():
    script = runpy.run_path(str(SCRIPTS / "speed_settings.py"))
    settings = {setting.name: setting for setting in script["SETTINGS"]}
    shipped, everything = (script["problem_of"](settings[name], 60.0) for name in ("as shipped", "all of these"))
    missions = [problem.analyze_design.mission for problem in (shipped, everything)]
    assert [mission.speed("cruise") for mission in missions] == [60.0, 60.0]
    assert [mission.speed("climb") == 60.0 for mission in missions] == [False, True], (
        "the climb follows the cruise speed"
    )
    assert [mission.reserve.duration for mission in missions] == [None, 1200.0]
    assert len(everything.constraints) == len(shipped.constraints) + 1
    names = [constraint.name for constraint in everything.constraints]
    assert everything.row_sizes[names.index("motor_torque_hover")] == 4, "one of two mirrored motors"
