"""What `pareto` and `sweep` share: their options, and a study run and shown."""

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from lpc_mdo.commands.options import MOST_JOBS, applied, input_options, output_option, solver_option

MOST_VALUES = 1000  # of a sweep
MOST_TOGETHER = 24  # points in one hub: more gain little


def numbers(context: click.Context, parameter: click.Parameter, text: str | None) -> tuple[float, ...]:
    """Of a list with commas between them, empty where the option is not given."""
    if text is None:
        return ()
    if text.count(",") >= MOST_VALUES:
        raise click.BadParameter(f"{text.count(',') + 1} values are too many; there must be at most {MOST_VALUES}.")
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise click.BadParameter(f"{text!r} is not allowed; it must be numbers with commas between them.") from None


def study_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every study; those from --solver on reach the command as keywords of `run_study`."""
    options: list[Callable[..., Any]] = [
        input_options,
        click.option("--values", callback=numbers, help="Values of the parameter, e.g. 300,350,400."),
        solver_option(None),
        click.option(
            "--jobs", type=click.IntRange(1, MOST_JOBS), default=1, show_default=True, help="Processes to use."
        ),
        click.option("--cluster", metavar="ADDRESS", help="Dask scheduler, e.g. tcp://host:8786; extra `cluster`."),
        click.option("--resume", "is_resuming", is_flag=True, help="Go on with the study in the output folder."),
        click.option("--quiet", "is_quiet", is_flag=True, help="No progress display."),
        output_option("NAME", "NAME is the study's"),
    ]
    return applied(options, command)


def exit_code(content: dict[str, Any]) -> int:
    """0 where every point of a study converged, 1 otherwise."""
    return 0 if all(point["status"] == "converged" for point in content["points"]) else 1


def run_study(
    study: Any, solver: str, jobs: int, cluster: str | None, is_resuming: bool, is_quiet: bool, output: Path
) -> dict[str, Any]:
    """Run a study with the chosen workers and show it; returns the content of study.json."""
    from lpc_mdo.files.read import ConfigurationError
    from lpc_mdo.optimization import Options
    from lpc_mdo.reporting.terminal import terminal
    from lpc_mdo.studies.display import STOPPING, StudyDisplay
    from lpc_mdo.studies.executors import Cluster, InProcess, Processes
    from lpc_mdo.studies.lockstep import Lockstep
    from lpc_mdo.studies.runner import Executor, StudyRun
    from lpc_mdo.studies.signals import stoppable

    if cluster is not None and jobs > 1:
        raise ConfigurationError("--jobs is not allowed with --cluster; the cluster's workers decide.")
    console = terminal(is_quiet)
    is_shared = study.problem == "aeroacoustic" and jobs == 1 and cluster is None  # one analysis: one hub
    options = Options(second_derivatives="updated" if is_shared else "exact")
    with contextlib.ExitStack() as stack:
        executor: Executor
        if cluster is not None:
            executor = stack.enter_context(contextlib.closing(Cluster(cluster)))
        else:
            executor = Processes(jobs) if jobs > 1 else Lockstep(MOST_TOGETHER) if is_shared else InProcess()
        display = stack.enter_context(StudyDisplay(console, study))
        stack.enter_context(stoppable(STOPPING))
        content = StudyRun(study, output, executor, solver, options, display.landed).run(is_resuming)
    display.table(content, output)
    return content
