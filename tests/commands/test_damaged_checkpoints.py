"""Checkpoints of a run: a sound one is taken up, a damaged one is refused in one sentence and kept."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from refusals import RUN, assert_refused, everything, write

from lpc_mdo.cli import main


def leave_the_report(patch):
    """It takes longer than the run that it shows."""
    patch.setattr("lpc_mdo.reporting.report.write_report", lambda folder: None)


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    """What a run that was cut short leaves behind: texts by their files."""
    folder = tmp_path_factory.mktemp("run")
    arguments = ["optimize", "--quiet", "--time-limit", "1", "--output", str(folder)]
    with pytest.MonkeyPatch.context() as patch:
        leave_the_report(patch)
        assert CliRunner().invoke(main, arguments).exit_code in (0, 1)
    return {f"run/{name}": (folder / name).read_text() for name in ("checkpoint.json", "checkpoint_history.jsonl")}


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("x", ..., "state.x must hold 109 finite numbers"),
        ("x", [0.0, 0.0], "state.x must hold 109 finite numbers"),
        ("x", [float("nan")] * 109, "state.x = [nan, nan, nan, nan, nan, nan, ...] is invalid"),
        ("multipliers", [0.0], "state.multipliers must hold "),
        ("multipliers", 10**400, "state.multipliers must hold "),
        ("penalty", 10**400, "state.penalty = inf is not allowed"),
        ("penalty", "ten", "state.penalty = 'ten' is not allowed"),
        ("newton", {"x": "text"}, "state.newton."),
    ],
)
def test_a_damaged_checkpoint_is_refused_and_kept(tmp_path, monkeypatch, checkpoint, key, value, expected):
    content = json.loads(checkpoint["run/checkpoint.json"])
    del content["state"][key]
    if value is not ...:
        content["state"][key] = value
    monkeypatch.chdir(tmp_path)
    write(checkpoint | {"run/checkpoint.json": json.dumps(content)})
    before = everything()
    run = CliRunner().invoke(main, f"{RUN} --resume".split())
    assert_refused(run.exit_code, run.stdout, run.stderr, ("checkpoint.json: ", expected, "run without --resume"))
    assert everything() == before


@pytest.mark.parametrize("key", ["configuration_sha256", "solver", "records", "state"])
def test_a_checkpoint_without_a_key_is_refused_and_the_key_named(tmp_path, monkeypatch, checkpoint, key):
    content = json.loads(checkpoint["run/checkpoint.json"])
    del content[key]
    monkeypatch.chdir(tmp_path)
    write(checkpoint | {"run/checkpoint.json": json.dumps(content)})
    run = CliRunner().invoke(main, f"{RUN} --resume".split())
    assert_refused(run.exit_code, run.stdout, run.stderr, (f"checkpoint.json: {key} is missing; run without --resume",))


@pytest.mark.parametrize(
    ("history", "expected"),
    [
        ("", "holds 1 records; it must hold "),
        ('{"phase": 1}\n', "line 1.phase is damaged"),
        ("3\n", "line 1"),
        ('{"phase": \n', "line 1: is not valid JSON"),
        (None, "checkpoint_history.jsonl: cannot be read"),
    ],
)
def test_a_damaged_history_is_refused_and_kept(tmp_path, monkeypatch, checkpoint, history, expected):
    monkeypatch.chdir(tmp_path)
    files = checkpoint | {"run/checkpoint_history.jsonl": history}
    if history:
        files["run/checkpoint_history.jsonl"] += checkpoint["run/checkpoint_history.jsonl"]
    write({name: text for name, text in files.items() if text is not None})
    before = everything()
    run = CliRunner().invoke(main, f"{RUN} --resume".split())
    assert_refused(run.exit_code, run.stdout, run.stderr, ("checkpoint_history.jsonl: ", expected))
    assert everything() == before


def test_a_checkpoint_of_another_solver_is_refused(tmp_path, monkeypatch, checkpoint):
    monkeypatch.chdir(tmp_path)
    write(checkpoint)
    run = CliRunner().invoke(main, f"{RUN} --resume --solver sqp".split())
    assert_refused(run.exit_code, run.stdout, run.stderr, ("checkpoint.json: ", "'augmented-lagrangian'", "'sqp'"))


def test_a_sound_checkpoint_is_taken_up(tmp_path, monkeypatch, checkpoint):
    """With half a record at the history's end, as a kill leaves it between a record and the state that counts it."""
    monkeypatch.chdir(tmp_path)
    leave_the_report(monkeypatch)
    write(checkpoint)
    with Path("run/checkpoint_history.jsonl").open("a") as history:
        history.write('{"phase": "Newt')
    run = CliRunner().invoke(main, f"{RUN} --resume --time-limit 1".split())
    assert run.exit_code in (0, 1), run.stderr
    assert json.loads(Path("run/result.json").read_text())["n_design_variables"] == 109


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("x", [0.0, 0.0], "state.newton.x must hold 68 finite numbers"),
        ("x", "text", "state.newton.x = 'text' is invalid"),
        ("multipliers", [[0.0]], "state.newton.multipliers"),
        ("multipliers", [0.0], "state.newton.multipliers must hold 18 finite numbers"),
        ("filter", [[0.1, "1"]], "state.newton.filter[0][1] = '1' is not allowed"),
        ("certificate", {"stationarity": 1.0}, "state.newton.certificate.feasibility is missing"),
        ("damping", -1.0, "state.newton.damping = -1.0 is not allowed"),
        ("count", 1.5, "state.newton.count = 1.5 is not allowed"),
    ],
)
def test_a_checkpoint_of_newtons_method_is_checked_whole(tmp_path, monkeypatch, checkpoint, key, value, expected):
    content = json.loads(checkpoint["run/checkpoint.json"])
    content["state"]["newton"] = {
        "x": [0.0] * 68,
        "multipliers": [0.0] * 18,
        "certificate": {
            "stationarity": 1.0,
            "feasibility": 1.0,
            "complementarity": 1.0,
            "worst_variable": 0,
            "worst_constraint": 0,
        },
        "filter": [[0.1, float("-inf")]],
        "damping": 1.0,
        "count": 1,
        "step": 0.1,
        "active": 1,
        "held": 1,
        "idle": 0,
        "best": None,
        key: value,
    }
    monkeypatch.chdir(tmp_path)
    write(checkpoint | {"run/checkpoint.json": json.dumps(content)})
    before = everything()
    run = CliRunner().invoke(main, f"{RUN} --resume".split())
    assert_refused(run.exit_code, run.stdout, run.stderr, ("checkpoint.json: ", expected, "run without --resume"))
    assert everything() == before
