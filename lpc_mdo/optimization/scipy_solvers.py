"""SciPy's SLSQP and trust-constr through the common interface."""

from functools import partial

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint
from scipy.optimize import minimize as scipy_minimize

from lpc_mdo.optimization.optimizer import Optimizer
from lpc_mdo.optimization.peers import Watch, run_peer
from lpc_mdo.optimization.result import Status

STATUS: dict[str, dict[int, Status]] = {
    "SLSQP": {0: "converged", 4: "infeasible", 9: "iteration_limit"},
    "trust-constr": {0: "iteration_limit", 1: "converged", 2: "converged"},
}
"""What the codes' exit modes mean; any other is a failure, which their message names."""


def _solve(method: str, watch: Watch) -> tuple[np.ndarray, Status, str]:
    evaluator, options = watch.task.evaluator, watch.task.options
    lower, upper = evaluator.limits
    settings = {
        "SLSQP": {"maxiter": 10 * options.outer_iterations, "ftol": 1e-9},
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
    answer = scipy_minimize(
        lambda x: evaluator.values(x)[0],
        watch.task.x,
        jac=lambda x: evaluator.gradient(x, np.zeros_like(lower)),
        bounds=Bounds(evaluator.lower, evaluator.upper),
        constraints=rows,
        method=method,
        callback=lambda x, *_: watch.add(x),
        options=settings[method],
    )
    return answer.x, STATUS[method].get(answer.status, "failed"), str(answer.message)


SLSQP = Optimizer("slsqp", partial(run_peer, "slsqp", partial(_solve, "SLSQP")))
TRUST_CONSTR = Optimizer("trust-constr", partial(run_peer, "trust-constr", partial(_solve, "trust-constr")))
