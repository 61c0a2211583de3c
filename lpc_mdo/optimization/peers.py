"""Other codes on the same scaled problem, judged by the same certificate: SciPy's SLSQP and trust-constr, IPOPT."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint
from scipy.optimize import minimize as scipy_minimize

from lpc_mdo.optimization.certificate import Certificate, certify, least_squares_multipliers, violation
from lpc_mdo.optimization.evaluator import Evaluator
from lpc_mdo.optimization.result import Hooks, Options, Progress, Status

SETTLED = 1e-5  # scaled distance from a limit up to which a row may press
UNLIMITED = 1e20  # what IPOPT takes for no limit
IPOPT_TOLERANCE = 1e-9
IPOPT_CODES = {0: "converged", 1: "converged", 2: "infeasible", 4: "unbounded"}


@dataclass
class _Watch:
    """Tells the caller of every iteration and holds the time limit."""

    solver: str
    evaluator: Evaluator
    options: Options
    hooks: Hooks
    history: list[Progress]
    started: float
    latest: np.ndarray

    def add(self, x: np.ndarray) -> bool:
        """False where the time is over."""
        self.latest = x.copy()
        objective, values = self.evaluator.values(x)
        beyond = np.abs(violation(values, *self.evaluator.limits))
        self.evaluator.counts.outer += 1
        self.history.append(
            Progress(
                phase=self.solver,
                iteration=self.evaluator.counts.outer,
                objective=objective / self.evaluator.objective_scale,
                violation=float(beyond.max(initial=0.0)),
                worst_constraint=int(beyond.argmax()) if len(beyond) else -1,
                stationarity=float("nan"),
                penalty=float("nan"),
                evaluations=self.evaluator.counts.evaluations,
                elapsed=time.monotonic() - self.started,
            )
        )
        self.hooks.progress(self.history[-1])
        return self.history[-1].elapsed <= self.options.time_limit


def run_peer(
    solver: str, evaluator: Evaluator, x0: np.ndarray, options: Options, hooks: Hooks, history: list[Progress]
) -> tuple[np.ndarray, np.ndarray, Certificate, Status, str]:
    """x (n,), scaled multipliers (m,), certificate, status and message. Raises ValueError where IPOPT is not installed."""
    watch = _Watch(solver, evaluator, options, hooks, history, time.monotonic(), x0)
    run: Callable[[_Watch, np.ndarray], tuple[np.ndarray, Status, str]] = _ipopt if solver == "ipopt" else _scipy
    try:
        x, status, message = run(watch, x0)
    except KeyboardInterrupt:
        x, status, message = watch.latest, "interrupted", "stopped by the user"
    x = np.clip(x, evaluator.lower, evaluator.upper)
    multipliers = least_squares_multipliers(evaluator, x, active_tolerance=SETTLED)
    certificate = certify(evaluator, x, multipliers)
    if certificate.holds(options.stationarity_tolerance, options.feasibility_tolerance):
        status = "converged"
    elif status == "converged":
        status = "iteration_limit"
    return x, multipliers, certificate, status, message


def _scipy(watch: _Watch, x0: np.ndarray) -> tuple[np.ndarray, Status, str]:
    evaluator, options = watch.evaluator, watch.options
    lower, upper = evaluator.limits
    settings = {
        "slsqp": {"maxiter": 10 * options.outer_iterations, "ftol": 1e-9},
        "trust-constr": {"maxiter": 100 * options.outer_iterations, "gtol": 1e-7, "xtol": 1e-10},
    }
    rows = [
        NonlinearConstraint(
            lambda x, rows=rows: evaluator.values(x)[1][rows],
            lower[rows],
            upper[rows],
            jac=lambda x, rows=rows: evaluator.jacobian(x)[rows],
        )
        for rows in (np.flatnonzero(mask) for mask in (lower == upper, lower < upper))
        if len(rows)
    ]

    def report(x: np.ndarray, *_: object) -> None:
        if not watch.add(x):
            raise StopIteration

    answer = scipy_minimize(
        lambda x: evaluator.values(x)[0],
        x0,
        jac=lambda x: evaluator.gradient(x, np.zeros_like(lower)),
        bounds=Bounds(evaluator.lower, evaluator.upper),
        constraints=rows,
        method="SLSQP" if watch.solver == "slsqp" else watch.solver,
        callback=report,
        options=settings[watch.solver],
    )
    return answer.x, "iteration_limit", str(answer.message)


class _ForIpopt:
    """The problem as cyipopt calls it."""

    def __init__(self, watch: _Watch) -> None:
        self.watch, self.evaluator = watch, watch.evaluator
        self.lower_triangle = np.tril_indices(len(watch.latest))
        self.seen = watch.latest
        self.is_interrupted = False

    def objective(self, x: np.ndarray) -> float:
        return self.evaluator.values(x)[0]

    def gradient(self, x: np.ndarray) -> np.ndarray:
        self.seen = x.copy()
        return self.evaluator.gradient(x, np.zeros(len(self.evaluator.constraint_lower)))

    def constraints(self, x: np.ndarray) -> np.ndarray:
        return self.evaluator.values(x)[1]

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        return self.evaluator.jacobian(x).ravel()

    def hessianstructure(self) -> tuple[np.ndarray, np.ndarray]:
        return self.lower_triangle

    def hessian(self, x: np.ndarray, multipliers: np.ndarray, objective_factor: float) -> np.ndarray:
        return self.evaluator.hessian(x, multipliers, objective_factor)[self.lower_triangle]

    def intermediate(self, *_: object) -> bool:
        """After every iteration: gradients are asked for at accepted points only. cyipopt loses exceptions raised here."""
        try:
            return self.watch.add(np.clip(self.seen, self.evaluator.lower, self.evaluator.upper))
        except KeyboardInterrupt:
            self.is_interrupted = True
            return False


def _ipopt(watch: _Watch, x0: np.ndarray) -> tuple[np.ndarray, Status, str]:
    """With exact second derivatives where batches make them cheap, L-BFGS ones otherwise."""
    try:
        import cyipopt
    except ImportError:
        raise ValueError("solver ipopt is not installed; pip install 'lpc-mdo[ipopt]'") from None
    evaluator = watch.evaluator
    lower, upper = (np.clip(limit, -UNLIMITED, UNLIMITED) for limit in evaluator.limits)
    asked = _ForIpopt(watch)
    solver = cyipopt.Problem(
        n=len(x0),
        m=len(lower),
        problem_obj=asked,
        lb=np.clip(evaluator.lower, -UNLIMITED, UNLIMITED),
        ub=np.clip(evaluator.upper, -UNLIMITED, UNLIMITED),
        cl=lower,
        cu=upper,
    )
    for name, value in (
        ("print_level", 0),
        ("sb", "yes"),
        ("tol", IPOPT_TOLERANCE),
        ("constr_viol_tol", IPOPT_TOLERANCE),
        ("bound_relax_factor", 0.0),
        ("max_iter", 100 * watch.options.outer_iterations),
        ("hessian_approximation", "exact" if evaluator.is_batched else "limited-memory"),
    ):
        solver.add_option(name, value)
    x, info = solver.solve(x0)
    if asked.is_interrupted:
        raise KeyboardInterrupt
    message = info["status_msg"]
    status = IPOPT_CODES.get(info["status"], "iteration_limit")
    return x, status, message.decode() if isinstance(message, bytes) else str(message)
