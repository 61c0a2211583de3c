"""Runs and studies that are asked to stop, or whose process is killed: what is found is kept, and nobody is left behind."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from lpc_mdo.studies.signals import finishing, stoppable

GIVE_UP = 120.0  # s, for what takes a second or two
HANDLED = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler);"  # the parent may ignore it
RUN = (
    HANDLED + "import lpc_mdo; from pathlib import Path; from analytic_studies import Plane, _weighted, plane_problem;"
    "problem = plane_problem(Plane(0.2), _weighted(0.5));"
    "print(lpc_mdo.optimize(problem, output=Path({folder!r}), progress=True).status)"
)
STUDY = (
    HANDLED + "from pathlib import Path; from analytic_studies import circles;"
    "from lpc_mdo.studies.executors import Processes; from lpc_mdo.studies.runner import StudyRun;"
    "from lpc_mdo.studies.signals import stoppable;"
    "study = circles((0.1, 0.3, 0.5, 0.7, 0.9), delay=0.3);"
    "work = StudyRun(study, Path({folder!r}), Processes(2), 'slsqp');"
    "guard = stoppable('asked to stop');"
    "guard.__enter__(); work.run()"
)


def started(script: str, folder: Path) -> subprocess.Popen:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-W", "ignore", "-c", script.format(folder=str(folder))]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(condition, process) -> None:
    begun = time.monotonic()
    while not condition():
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() - begun < GIVE_UP
        time.sleep(0.05)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_run_that_is_asked_to_stop_says_so_and_keeps_its_newest_design(tmp_path, number):
    folder = tmp_path / "run"
    process = started(RUN, folder)
    wait_for((folder / "checkpoint.json").exists, process)
    process.send_signal(number)
    output, errors = process.communicate(timeout=GIVE_UP)
    assert "stopping with the newest design" in errors
    assert output.splitlines()[-1] == "interrupted"
    assert process.returncode == 0
    result = json.loads((folder / "result.json").read_text())
    assert (result["status"], result["message"]) == ("interrupted", "stopped by the user")
    assert (folder / "report.html").exists()
    assert not (folder / ".lock").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_workers_of_a_study_end_with_it_whatever_ends_it(tmp_path, number):
    """Output ends only when the last process that holds it has ended; nothing of theirs stays in shared memory."""
    folder = tmp_path / "study"
    process = started(STUDY, folder)
    wait_for(lambda: any(folder.glob("points/*/point.json")), process)
    process.send_signal(number)
    _, errors = process.communicate(timeout=GIVE_UP)
    assert process.returncode != 0
    assert ("asked to stop" in errors) == (number != signal.SIGKILL)
    assert not [file for file in Path("/dev/shm").glob("*") if str(process.pid) in file.name]
    landed = [json.loads(file.read_text()) for file in folder.glob("points/*/point.json")]
    assert landed
    assert all(point["status"] == "converged" for point in landed)


@pytest.fixture
def default_handlers():
    """As a process has them that nobody started in the background."""
    requests = {
        signal.SIGINT: signal.default_int_handler,
        signal.SIGTERM: signal.SIG_DFL,
        signal.SIGHUP: signal.SIG_DFL,
    }
    before = {number: signal.signal(number, handler) for number, handler in requests.items()}
    yield requests
    for number, handler in before.items():
        signal.signal(number, handler)


def send(number):
    """To this process, which handles it before it goes on."""
    os.kill(os.getpid(), number)
    time.sleep(0.01)


def test_handlers_are_given_back(default_handlers):
    with pytest.raises(KeyboardInterrupt), finishing("later"), stoppable("now"):
        send(signal.SIGTERM)
    assert {number: signal.getsignal(number) for number in default_handlers} == default_handlers


def test_while_a_result_is_written_the_first_request_waits_and_the_second_does_not(default_handlers, capfd):
    with finishing("being written"):
        send(signal.SIGINT)
        assert "being written" in capfd.readouterr().err
        with pytest.raises(KeyboardInterrupt):
            send(signal.SIGHUP)


def test_what_is_ignored_or_handled_by_the_caller_stays_so(default_handlers):
    seen = []
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # nohup
    signal.signal(signal.SIGTERM, lambda number, frame: seen.append(number))
    with stoppable("now"):
        send(signal.SIGHUP)
        send(signal.SIGTERM)
    assert seen == [signal.SIGTERM]
