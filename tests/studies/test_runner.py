"""Studies as they run: who starts whom, side by side, on workers that die, killed and resumed, with points that fail."""

import json
import logging
import os
import shutil
import signal
import subprocess
import sys
import time

import pytest
from analytic_studies import circles, distances, ledges, valleys

from lpc_mdo.config import ConfigurationError
from lpc_mdo.reporting.report import write_report
from lpc_mdo.reporting.stored import read_run
from lpc_mdo.studies import executors
from lpc_mdo.studies.executors import Cluster, InProcess, Processes
from lpc_mdo.studies.runner import StudyRun
from lpc_mdo.studies.study import generations, starting_points

WEIGHTS = (0.1, 0.3, 0.5, 0.7, 0.9)
GIVE_UP = 120.0  # s, for a file to appear: far beyond what it takes


def run(study, folder, executor=None, is_resuming=False, **how):
    return StudyRun(study, folder, executor or InProcess(), "slsqp", **how).run(is_resuming)


def positions(content):
    return [point["position"] for point in content["points"]]


def stamps(folder):
    return {file: file.stat().st_mtime_ns for file in sorted(folder.glob("points/*/*.json"))}


@pytest.mark.parametrize("count", [1, 2, 3, 11, 40])
def test_every_point_starts_from_its_neighbour_that_is_solved_before(count):
    starts = starting_points(count)
    assert sum(start is None for start in starts) == 1
    waves = generations(starts)
    assert sorted(i for wave in waves for i in wave) == list(range(count))
    wave_of = {i: number for number, wave in enumerate(waves) for i in wave}
    for i, start in enumerate(starts):
        assert start is None or (abs(start - i) == 1 and wave_of[start] == wave_of[i] - 1)


def test_neighbours_hand_over_design_and_multipliers(tmp_path):
    """At the wall's next place the design and the wall's pressure are nearly right: it takes less than from the start."""
    content = StudyRun(distances((0.2, 0.3, 0.4)), tmp_path, InProcess()).run()
    middle, other = content["points"][1], content["points"][0]
    assert (middle["start"], other["start"]) == (None, "points/01_0.3")
    assert other["counts"]["evaluations"] < middle["counts"]["evaluations"]
    assert other["multipliers"]["wall"] == pytest.approx(2.0 * (1.0 - 0.2), abs=1e-4)  # the certificate's


def test_processes_of_this_machine_give_the_same_points(tmp_path):
    here, there = run(circles(WEIGHTS), tmp_path / "a"), run(circles(WEIGHTS), tmp_path / "b", Processes(2))
    assert positions(here) == positions(there)
    assert there["timing"]["processor_s"] > 0.0


def test_a_cluster_finishes_although_one_of_its_two_workers_is_killed(tmp_path):
    distributed = pytest.importorskip("distributed")
    study, killed = circles(WEIGHTS, delay=0.1), []
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as local:

        def kill_the_other(entry, left):
            """One of the two points of the second generation has landed: kill the worker of the other one."""
            if left == len(WEIGHTS) - 2:
                busy = [worker for worker in local.scheduler.workers.values() if worker.processing]
                killed.append(local.workers[busy[0].name].pid)
                os.kill(killed[0], signal.SIGKILL)

        cluster = Cluster(local.scheduler_address)
        content = run(study, tmp_path / "cluster", cluster, report=kill_the_other)
        cluster.close()
        assert killed[0] not in [nanny.pid for nanny in local.workers.values()]
    assert [point["status"] for point in content["points"]] == ["converged"] * len(WEIGHTS)
    assert positions(content) == positions(run(circles(WEIGHTS), tmp_path / "here"))


def test_a_scheduler_that_dies_ends_a_study_in_one_sentence_and_keeps_its_points(tmp_path):
    distributed = pytest.importorskip("distributed")
    study = circles(WEIGHTS, delay=0.1)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, processes=False, silence_logs=logging.CRITICAL
    ) as local:
        cluster = Cluster(local.scheduler_address)

        def end_the_scheduler(entry, left):
            if left == len(WEIGHTS) - 1:
                local.close()

        with pytest.raises(ConnectionError, match="the scheduler is gone; finished points are kept: add --resume"):
            run(study, tmp_path, cluster, report=end_the_scheduler)
        cluster.close()
    statuses = [point["status"] for point in json.loads((tmp_path / "study.json").read_text())["points"]]
    assert sorted(statuses) == ["converged", *["pending"] * (len(WEIGHTS) - 1)]


def test_a_cluster_without_workers_is_told_and_waited_for(tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(executors, "LOOK_EVERY", 0.2)
    with distributed.LocalCluster(
        n_workers=0, threads_per_worker=1, dashboard_address=None, processes=False, silence_logs=logging.CRITICAL
    ) as local:
        cluster, told = Cluster(local.scheduler_address), []

        def hear(message, *details, **more):
            told.append(str(message))
            local.scale(1)

        monkeypatch.setattr(executors.warnings, "warn", hear)
        content = run(circles((0.2, 0.8)), tmp_path, cluster)
        cluster.close()
    assert any("has no workers; waiting for one" in words for words in told)
    assert [point["status"] for point in content["points"]] == ["converged"] * 2


def test_a_cluster_whose_workers_are_all_dead_ends_a_study_in_one_sentence_and_keeps_its_points(tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(executors, "LOOK_EVERY", 0.2)
    monkeypatch.setattr(executors, "PATIENCE", 0.5)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, processes=False, silence_logs=logging.CRITICAL
    ) as local:
        cluster = Cluster(local.scheduler_address)

        def end_the_worker(entry, left):
            local.scale(0)

        with (
            pytest.warns(UserWarning, match="has no workers; waiting for one, 0.5 s at most"),
            pytest.raises(
                ConnectionError, match=r"no worker came within 0\.5 s; finished points are kept: add --resume"
            ),
        ):
            run(circles(WEIGHTS, delay=0.1), tmp_path, cluster, report=end_the_worker)
        cluster.close()
    statuses = [point["status"] for point in json.loads((tmp_path / "study.json").read_text())["points"]]
    assert "converged" in statuses
    assert "pending" in statuses


def test_nobody_at_the_address_of_a_cluster_is_told(monkeypatch):
    pytest.importorskip("distributed")
    with pytest.raises(ConfigurationError, match="--cluster 'nowhere' is invalid: it must be HOST:PORT"):
        Cluster("nowhere")
    with pytest.raises(ConfigurationError, match=r"--cluster 127\.0\.0\.1:99999 is not allowed; no scheduler answers"):
        Cluster("127.0.0.1:99999")


def test_a_killed_study_resumes_without_repeating_a_point(tmp_path):
    folder = tmp_path / "study"
    script = (
        "from pathlib import Path; from analytic_studies import circles; from test_runner import *;"
        f"run(circles(WEIGHTS, delay=0.05), Path({str(folder)!r}))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script], env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    )
    started = time.monotonic()
    while len(list(folder.glob("points/*/point.json"))) < 2 and time.monotonic() - started < GIVE_UP:
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert process.returncode == -signal.SIGKILL, "the study ended before it was killed"
    before = stamps(folder)
    landed = [file for file in before if file.name == "point.json"]
    assert 2 <= len(landed) < len(WEIGHTS)
    interrupted = json.loads((folder / "study.json").read_text())
    # study.json follows a point's own file: at most the last one landed is not in it yet, and nothing else is called done.
    done = [folder / point["folder"] / "point.json" for point in interrupted["points"] if point["status"] != "pending"]
    assert set(done) <= set(landed)
    assert len(done) >= len(landed) - 1
    with pytest.raises(ConfigurationError, match="add --resume"):
        run(circles(WEIGHTS, delay=0.05), folder)

    content = run(circles(WEIGHTS, delay=0.05), folder, is_resuming=True)
    assert [point["status"] for point in content["points"]] == ["converged"] * len(WEIGHTS)
    after = stamps(folder)
    assert all(after[file] == stamp for file, stamp in before.items() if (file.parent / "point.json") in landed)
    assert positions(content) == positions(run(circles(WEIGHTS, delay=0.0), tmp_path / "whole"))
    assert content["timing"]["wall_s"] > interrupted["timing"]["wall_s"]
    assert stamps(folder) == after


def test_only_the_same_study_may_be_resumed(tmp_path):
    run(circles((0.2, 0.8)), tmp_path)
    with pytest.raises(ConfigurationError, match="belongs to a study of other values"):
        run(circles((0.2, 0.7)), tmp_path, is_resuming=True)


def test_failed_points_are_shown_as_failed_and_the_others_stand(tmp_path):
    values, reports = (-0.5, 0.2, 0.5, 0.8), []
    content = run(circles(values), tmp_path, report=lambda entry, left: reports.append(entry["status"]))
    statuses = {point["value"]: point["status"] for point in content["points"]}
    assert statuses == {-0.5: "failed", 0.2: "converged", 0.5: "converged", 0.8: "converged"}
    failed = content["points"][0]
    assert failed["message"] == "ValueError: weight = -0.5 is not allowed"
    assert failed["position"] is None
    assert failed["is_on_front"] is False
    assert [point["is_on_front"] for point in content["points"][1:]] == [True] * 3
    assert sorted(reports) == ["converged"] * 3 + ["failed"]
    assert not (tmp_path / failed["folder"] / "result.json").exists()


def test_a_point_in_a_local_optimum_is_run_again_from_a_neighbour_that_is_better(tmp_path):
    """All but the steepest start in the valley at x = -1; tilted by 4 it has no bottom, and x = 1 is best for all."""
    content = run(valleys((0.2, 0.4, 4.0)), tmp_path)
    points = content["points"]
    assert [point["status"] for point in points] == ["converged"] * 3
    assert [point["start"] for point in points] == ["points/01_0.4", "points/02_4", "points/01_0.4"]
    for point in points:
        result = json.loads((tmp_path / point["folder"] / "result.json").read_text())
        assert result["design_variables"][0]["value"] > 0.9


def test_a_point_that_its_neighbour_cannot_start_is_run_from_the_baseline(tmp_path):
    """The optimum for 0.2, x = 0.24, lies where the model for 0.8 has no values."""
    first, second = run(ledges((0.2, 0.8)), tmp_path)["points"]
    assert (first["start"], second["start"]) == (None, None)
    assert [point["status"] for point in (first, second)] == ["converged"] * 2
    result = json.loads((tmp_path / second["folder"] / "result.json").read_text())
    assert result["design_variables"][0]["value"] == pytest.approx(0.96, abs=1e-4)


def test_every_point_is_a_run_that_can_be_reported(tmp_path):
    """A point's folder holds what `lpc-mdo report` draws: no file of a run is missing, also of a resumed study."""
    run(circles((0.2, 0.8)), tmp_path)
    shutil.rmtree(tmp_path / "points" / "01_0.8")
    run(circles((0.2, 0.8)), tmp_path, is_resuming=True)
    for folder in tmp_path.glob("points/*"):
        stored = read_run(folder)
        assert stored.evaluations, "the search is traced"
        last = stored.evaluations[-1]
        assert float(last["sum_m^2"]) == pytest.approx(stored.result["objective"]["value"], abs=1e-6)
        page = write_report(folder).read_text()
        assert "Convergence of the optimizer" in page
        assert "Constraint histories" in page
