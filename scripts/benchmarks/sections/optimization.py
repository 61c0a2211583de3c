"""The 109-variable optimization with every solver, by the command that users call."""

from benchmarks.session import SubjectError, Worker
from benchmarks.sheets import Section, Sheet, Target
from benchmarks.subject import INSTALL, Subject
from lpc_mdo.commands.optimize import command as optimize

TARGET = "benchmarks.subjects.optimization:prepare"
PACKAGES = {"ipopt": "cyipopt"}  # what a solver needs beyond this package
QUICK = ("augmented-lagrangian", "sqp")
TIME_LIMIT = 900.0  # s for each solver
LONGEST = 36.0  # s
COLUMNS = (
    "solver",
    "formulation",
    "status",
    "mass kg",
    "evaluations, gradients",
    "optimize s",
    "total s",
    "processor s",
    "peak MB",
    "certificate",
)


def run(is_quick: bool) -> Section:
    solvers = next(option for option in optimize.params if option.name == "solver").type.choices
    rows, targets = [], []
    for solver, formulation in [*((solver, "paper") for solver in solvers), (solvers[0], "reduced")]:
        if is_quick and solver not in QUICK:
            rows.append((solver, formulation, "left out by --quick", *[""] * (len(COLUMNS) - 3)))
            continue
        arguments = {"solver": solver, "formulation": formulation, "time_limit": TIME_LIMIT}
        cells, total = _cells(Subject(solver, TARGET, arguments, PACKAGES.get(solver, "lpc_mdo")))
        rows.append((solver, formulation, *cells))
        if solver == solvers[0] and formulation == "paper":
            is_met = None if total is None else cells[0] == "converged" and total <= LONGEST
            promise = f"109-variable optimization, process start to result.json: at most {LONGEST:g} s, converged"
            targets.append(Target(promise, "" if total is None else f"{total:.1f} s, {cells[0]}", is_met))
    note = (
        "Gross mass at the end; wall time of the optimizer and of the whole command, from process start to result.json, figures "
        "and report included, and its processor time. Certificate: stationarity and feasibility, the same for every "
        "solver: scaled infinity norms, converged below 1e-4 and 1e-6."
    )
    return Section((Sheet("The optimization by solver", COLUMNS, tuple(rows), (note,)),), tuple(targets))


def _cells(subject: Subject) -> tuple[tuple[str, ...], float | None]:
    """The row after solver and formulation, and the command's time, s."""
    empty = [""] * (len(COLUMNS) - 3)
    if not subject.is_installed:
        return (f"not installed ({INSTALL})", *empty), None
    worker = None
    try:
        worker = Worker(subject)
        took = worker.ask("run")
        result = worker.ask("check")
    except SubjectError as error:
        return (f"failed: {error}", *empty), None
    finally:
        if worker is not None:
            worker.close()
    counts, timing, certificate = result["counts"], result["timing"], result["certificate"]
    cells = (
        result["status"],
        f"{result['objective']['value']:.3f}",
        f"{counts['evaluations']}, {counts['gradients']}",
        f"{timing['optimize_s']:.1f}",
        f"{timing['total_s']:.1f}",
        f"{took['processor_s']:.1f}",
        f"{took['peak_bytes'] / 1e6:.0f}",
        f"{certificate['stationarity']:.0e}, {certificate['feasibility']:.0e}",
    )
    return cells, timing["total_s"]
