"""How many threads the work uses, and that the caller's number is left as it was."""

from dataclasses import replace

import pytest
import torch
from analytic_studies import circles
from threadpoolctl import threadpool_info, threadpool_limits

import lpc_mdo
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.runner import StudyRun


@pytest.fixture
def two_threads():
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    with threadpool_limits(limits=2):
        yield
    torch.set_num_threads(before)


def watched(problem, seen):
    """The problem, which notes the number of threads at every evaluation."""

    def analyze(design):
        seen.append((torch.get_num_threads(), max(pool["num_threads"] for pool in threadpool_info())))
        return problem.analyze_design(design)

    for name in ("vehicle", "mission"):
        setattr(analyze, name, getattr(problem.analyze_design, name))
    return replace(problem, analyze_design=analyze)


def test_an_optimization_from_python_works_on_one_thread_and_gives_the_others_back(two_threads):
    (problem,) = circles((0.5,)).problems([0.5])
    seen = []
    result = lpc_mdo.optimize(watched(problem, seen), solver="slsqp")
    assert result.is_converged
    assert set(seen) == {(1, 1)}
    assert result.provenance["threads"] == 1
    assert torch.get_num_threads() == 2
    assert max(pool["num_threads"] for pool in threadpool_info()) == 2


def test_a_study_in_this_process_gives_the_threads_back(two_threads, tmp_path):
    StudyRun(circles((0.2, 0.8)), tmp_path, InProcess(), "slsqp").run()
    assert torch.get_num_threads() == 2


def test_threads_come_back_after_a_failure(two_threads):
    with pytest.raises(ValueError, match="stop"), lpc_mdo.one_thread():
        raise ValueError("stop")
    assert torch.get_num_threads() == 2
