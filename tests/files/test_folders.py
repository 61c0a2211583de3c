"""Folders that results go to: one process at a time, one run's files, the result first and whole."""

import errno
import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from analytic_studies import Plane, _weighted, circles, plane_problem
from click.testing import CliRunner

import lpc_mdo
from lpc_mdo.cli import main
from lpc_mdo.config import ConfigurationError
from lpc_mdo.files.write import LOCK, locked, write_atomically
from lpc_mdo.optimization import Options
from lpc_mdo.reporting import report
from lpc_mdo.stored.result import Result, read_result
from lpc_mdo.studies import run_request, runs
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.runner import StudyRun
from lpc_mdo.studies.single import Clock, minimum, result_of

IN_USE = "is in use: another process writes there"
HOLD = "import sys; from pathlib import Path; from lpc_mdo.files.write import locked\nwith locked(Path(sys.argv[1])): print('held', flush=True); sys.stdin.read()"


@pytest.fixture
def problem():
    return plane_problem(Plane(), _weighted(0.5))


def test_a_second_process_in_a_folder_is_refused_until_the_first_has_ended_in_whatever_way(tmp_path, problem):
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    with pytest.raises(ConfigurationError, match=IN_USE):
        lpc_mdo.optimize(problem, output=tmp_path)
    with pytest.raises(ConfigurationError, match=IN_USE):
        StudyRun(circles((0.2, 0.8)), tmp_path, InProcess(), "slsqp").run()
    assert [file.name for file in tmp_path.iterdir()] == [LOCK]
    process.kill()
    process.communicate()
    assert lpc_mdo.optimize(problem, output=tmp_path).is_converged
    assert not (tmp_path / LOCK).exists()


def test_every_command_that_writes_a_folder_refuses_one_in_use(tmp_path, problem):
    lpc_mdo.optimize(problem, output=tmp_path)
    before = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()}
    with locked(tmp_path):
        for command in (
            ["optimize"],
            ["optimize", "--starts", "2"],
            ["export", "geometry", "--format", "stl"],
            ["export", "nastran"],
            ["train", "structures"],
            ["train", "airfoil"],
            ["report", str(tmp_path)],
        ):
            output = [] if command[0] == "report" else ["--output", str(tmp_path)]
            done = CliRunner().invoke(main, [*command, *output])
            assert done.exit_code == 2, command
            assert IN_USE in done.stderr, command
    assert before == {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()}


def test_a_folder_that_was_made_for_nothing_goes_again(tmp_path):
    with pytest.raises(ValueError, match="no"), locked(tmp_path / "a" / "b"):
        raise ValueError("no")
    assert not list(tmp_path.iterdir())


def test_a_fresh_run_leaves_nothing_of_the_run_before(tmp_path, problem):
    lpc_mdo.optimize(problem, output=tmp_path)
    first = sorted(file.name for file in tmp_path.rglob("*"))
    for name in ("sensitivities.json", "figures/of_another_aircraft.svg", "figures/of_another_aircraft.png"):
        (tmp_path / name).touch()
    (tmp_path / "notes.txt").write_text("the user's own")
    lpc_mdo.optimize(problem, output=tmp_path)
    assert sorted(file.name for file in tmp_path.rglob("*")) == sorted([*first, "notes.txt"])


def test_runs_and_studies_do_not_mix(tmp_path, problem):
    lpc_mdo.optimize(problem, output=tmp_path / "run")
    with pytest.raises(ConfigurationError, match="holds a single run"):
        StudyRun(circles((0.2, 0.8)), tmp_path / "run", InProcess(), "slsqp").run()
    StudyRun(circles((0.2, 0.8)), tmp_path / "study", InProcess(), "slsqp").run()
    with pytest.raises(ConfigurationError, match="holds a study"):
        lpc_mdo.optimize(problem, output=tmp_path / "study")
    assert not (tmp_path / "study" / "configuration.json").exists()


def test_an_optimization_from_python_writes_the_folder_and_shows_its_progress(tmp_path, problem, capsys):
    result = lpc_mdo.optimize(problem, output=str(tmp_path / "mine"), progress=True)
    shown = capsys.readouterr().out
    assert "start" in shown
    assert "status: converged" in shown
    names = {file.name for file in (tmp_path / "mine").iterdir()}
    assert names == {"figures", "report.html", runs.CHECKPOINT, runs.HISTORY, "configuration.json", *runs.RESULTS[:4]}
    assert json.loads((tmp_path / "mine" / "result.json").read_text()) == result.content()
    lpc_mdo.optimize(problem)
    assert capsys.readouterr().out == "", "by default nothing is shown"


def test_a_result_is_frozen_and_names_what_it_holds(tmp_path, problem):
    result = lpc_mdo.optimize(problem, output=tmp_path)
    variable, row = problem.variables[0], problem.constraints[0]
    assert result.design[variable.name] == result.design_variables[0].value
    assert result.constraint(row.name).unit == row.unit
    with pytest.raises(KeyError):
        result.constraint("no row")
    with pytest.raises(ValueError, match="frozen"):
        result.status = "converged"
    assert Result.model_validate(read_result(tmp_path / "result.json")) == result, "what is read is what was returned"


def test_a_result_without_finite_numbers_is_still_a_result(problem):
    found = minimum(problem, problem.x0)
    damaged = replace(
        found,
        multipliers=torch.full_like(found.multipliers, math.nan),
        certificate=replace(found.certificate, stationarity=math.inf),
        status="failed",
    )
    result = result_of(problem, damaged, Options(), Clock(0.0, 0.0, 0.0))
    assert not result.is_converged
    assert result.certificate.stationarity is None
    assert all(row.multiplier is None for row in result.constraints)
    json.dumps(result.content(), allow_nan=False)


def test_a_result_is_whole_although_its_report_fails(tmp_path, problem, monkeypatch):
    def fails(folder):
        raise RuntimeError("no such font")

    monkeypatch.setattr(report, "write_report", fails)
    with pytest.warns(UserWarning, match=r"result\.json is whole, but the report could not be written: .*no such font"):
        content = lpc_mdo.optimize(problem, output=tmp_path)
    assert content.is_converged
    assert json.loads((tmp_path / "result.json").read_text())["status"] == "converged"
    assert (tmp_path / "history.csv").exists()


def test_a_full_disk_is_the_machines_fault_and_leaves_no_part_of_a_file(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("old")

    def full(descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space left on device"):
        write_atomically(tmp_path / "file", "new")
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("file", "old")]
    done = CliRunner().invoke(main, ["export", "geometry", "--format", "png", "--output", str(tmp_path / "out")])
    assert done.exit_code == 1
    assert "baseline.png: No space left on device" in done.stderr


def test_what_cannot_be_a_folder_is_bad_input(tmp_path):
    (tmp_path / "file").touch()
    for place in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(ConfigurationError, match="is not allowed"), locked(place):
            pass


def test_results_go_to_a_folder_of_their_name_unless_another_is_given(tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(run_request, "run_request", lambda request, started: seen.append(request.output) or 0)
    for arguments in (
        [],
        ["mine/vehicle.toml"],
        ["fast.toml"],
        ["--problem", "aeroacoustic"],
        ["--output", "elsewhere"],
    ):
        assert CliRunner().invoke(main, ["optimize", *arguments]).exit_code == 0
    names = ["runs/baseline", "runs/mine", "runs/fast", "runs/baseline-aeroacoustic", "elsewhere"]
    assert seen == [Path(name) for name in names]


def test_never_are_two_processes_in_a_folder_whose_lock_is_removed_again_and_again(tmp_path):
    script = (
        "import sys; from pathlib import Path; from lpc_mdo.files.write import locked, ConfigurationError\n"
        "for _ in range(200):\n"
        " try:\n"
        "  with locked(Path(sys.argv[1])):\n"
        "   Path(sys.argv[1], 'inside').touch(exist_ok=False); Path(sys.argv[1], 'inside').unlink()\n"
        " except ConfigurationError: pass\n"
    )
    crowd = [subprocess.Popen([sys.executable, "-c", script, str(tmp_path)]) for _ in range(3)]
    assert [process.wait(timeout=120) for process in crowd] == [0, 0, 0]
