"""IPOPT through cyipopt and the common interface."""

from functools import partial

import numpy as np

from lpc_mdo.optimization.model import TimeLimit
from lpc_mdo.optimization.optimizer import Optimizer
from lpc_mdo.optimization.peers import Watch, run_peer
from lpc_mdo.optimization.result import Status

UNLIMITED = 1e20  # what IPOPT takes for no limit
TOLERANCE = 1e-9
CODES: dict[int, Status] = {
    0: "converged",
    1: "converged",
    2: "infeasible",
    4: "unbounded",
    -1: "iteration_limit",
}
"""Any other is a failure, which IPOPT's message names."""


class _ForIpopt:
    """The problem as cyipopt calls it."""

    def __init__(self, watch: Watch) -> None:
        self.watch, self.evaluator = watch, watch.task.evaluator
        self.lower_triangle = np.tril_indices(len(watch.latest))
        self.seen = watch.latest
        self.stop: BaseException | None = None

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
            self.watch.add(np.clip(self.seen, self.evaluator.lower, self.evaluator.upper))
            self.evaluator.model.require_time()
        except (KeyboardInterrupt, TimeLimit) as stop:
            self.stop = stop
            return False
        return True


def _solve(watch: Watch) -> tuple[np.ndarray, Status, str]:
    """With exact second derivatives where batches make them cheap, L-BFGS ones otherwise."""
    try:
        import cyipopt
    except ImportError:
        raise ValueError("solver ipopt is not installed; pip install 'lpc-mdo[ipopt]'") from None
    evaluator = watch.task.evaluator
    lower, upper = (np.clip(limit, -UNLIMITED, UNLIMITED) for limit in evaluator.limits)
    asked = _ForIpopt(watch)
    solver = cyipopt.Problem(
        n=len(watch.task.x),
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
        ("tol", TOLERANCE),
        ("constr_viol_tol", TOLERANCE),
        ("bound_relax_factor", 0.0),
        ("max_iter", 100 * watch.task.options.outer_iterations),
        ("hessian_approximation", "exact" if evaluator.is_batched else "limited-memory"),
    ):
        solver.add_option(name, value)
    x, info = solver.solve(watch.task.x)
    if asked.stop is not None:
        raise asked.stop
    message = info["status_msg"]
    status = CODES.get(info["status"], "failed")
    return x, status, message.decode() if isinstance(message, bytes) else str(message)


OPTIMIZER = Optimizer("ipopt", partial(run_peer, "ipopt", _solve))
