"""The Powell-Hestenes-Rockafellar augmented Lagrangian over L-BFGS, with Newton's method once it is near.

Two-sided rows, safeguarded multipliers and penalty growth as in ALGENCAN (Andreani, Birgin, Martinez, Schuverdt, SIAM J.
Optim. 18, 2008); inner solves by SciPy's L-BFGS-B, from loose to tight, each from the last one's end. Before the first, a few
restoration steps bring the start near the constraints, where least-squares multipliers are a better guess than none.
"""

import numpy as np
from scipy.optimize import OptimizeResult
from scipy.optimize import minimize as scipy_minimize

from lpc_mdo.optimization.certificate import Certificate
from lpc_mdo.optimization.feasibility import lack_of_feasible, nearest_feasible
from lpc_mdo.optimization.optimizer import Optimizer, Outcome, Task
from lpc_mdo.optimization.restoration import RESTORED, restore
from lpc_mdo.optimization.result import Options
from lpc_mdo.optimization.scaling import scales
from lpc_mdo.optimization.search import CONVERGED, FALLING, LARGEST, UNBOUNDED, Diverged, Search, Stage

LARGEST_MULTIPLIER = 1e6
LARGEST_PENALTY = 1e8
SUFFICIENT_DECREASE = 0.5  # of the violation, or the penalty grows tenfold
NEARLY_FEASIBLE, NEARLY_STATIONARY = 1e-1, 3e-2  # scaled: from here on Newton's method is tried
SETTLED = 0.02  # of the objective: two inner ends this near to each other, and feasible, call for Newton's method, too
FIRST_RESTORATION = 10  # steps at most
HOPELESS = 1e2  # of the feasibility tolerance: a stationary violation beyond it is no rounding
SPREAD = 15  # steps from the least violation to least squares, where there is no feasible design
IN_VAIN = 0.99e2  # of the first penalty: raised twice, and the rows are still not met
POLISHES = 6  # times at most that Newton's method is tried
DRIFT = 100.0  # of a gradient's size, that calls for new scales
FAILED_VALUE = 1e15  # what L-BFGS-B sees of a failed evaluation: its line search steps back


class AugmentedLagrangian(Search):
    """One run."""

    def _run(self) -> Outcome:
        if self.penalty == 0.0:
            self.penalty = self._initial_penalty()
            self.record("start", self.x, self.certificate())
        try:
            ended = self._begin()
            if ended is not None:
                return ended
            if self.fault is not None and self.fault.is_final:
                return self.outcome("failed", self.fault.words)
        except Diverged:
            if self.is_nearly_feasible():
                return self.outcome("unbounded", FALLING)
        self.stage, self.newton = "penalty", None
        return self._loop()

    def _begin(self) -> Outcome | None:
        """What comes before the loop; the end of the run where that already tells it."""
        if self.stage == "restoration":
            restored = self.restored(RESTORED, FIRST_RESTORATION)
            self.settle(restored.x, "penalty")
        if self.stage == "newton" and self.options.newton_iterations > 0 and self.polish():
            return self.outcome("converged", CONVERGED)
        return None

    def _loop(self) -> Outcome:
        options, evaluator = self.options, self.evaluator
        while self.progress is not None or self.outer < options.outer_iterations:
            if self.progress is None:
                self.hooks.checkpoint(self.state())
                self.outer += 1
                evaluator.counts.outer += 1
                start = self.x
                try:
                    self.progress, inner = self._improve()
                except Diverged:
                    if self.is_nearly_feasible():
                        return self.outcome("unbounded", FALLING)
                    self.x, self.penalty = start, min(10.0 * self.penalty, LARGEST_PENALTY)
                    continue
                self.record("augmented Lagrangian", self.x, self.certificate(), inner=inner)
            beyond = self.violation()
            try:
                if self._is_finished():
                    return self.outcome("converged", CONVERGED)
                if self.fault is not None and self.fault.is_final:
                    return self.outcome("failed", self.fault.words)
            except Diverged:
                self.newton = None
            try:
                ended = self._feasible_or_not(beyond)
            except Diverged:
                self.newton, ended = None, None
            if ended is not None:
                return ended
            progress, self.progress = self.progress, None
            is_slow = progress > SUFFICIENT_DECREASE * self.last_progress
            if is_slow and progress > 0.1 * options.feasibility_tolerance:
                self.penalty = min(10.0 * self.penalty, LARGEST_PENALTY)
            self._rescale()
            self.last_violation, self.last_progress = beyond, progress
            self.tolerance = max(0.3 * self.tolerance, 0.3 * options.stationarity_tolerance)
        self.take_best()
        return self.outcome(
            "iteration_limit", self.fault.words if self.fault else _missing(self.certificate(), options)
        )

    def _residual(self, values: np.ndarray) -> np.ndarray:
        """c + lambda/rho less its projection on the limits."""
        shifted = values + self.multipliers / self.penalty
        return shifted - np.clip(shifted, *self.evaluator.limits)

    def _function(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        if not self.evaluator.is_finite(x):
            return FAILED_VALUE, np.zeros_like(x)
        objective, values = self.evaluator.values(x)
        residual = self._residual(values)
        if objective < UNBOUNDED:
            self.x = x.copy()
            raise Diverged
        value = objective + 0.5 * self.penalty * float(residual @ residual)
        gradient = self.evaluator.gradient(x, self.penalty * residual)
        return (value, gradient) if np.isfinite(gradient).all() else (FAILED_VALUE, np.zeros_like(x))

    def _initial_penalty(self) -> float:
        objective, values = self.evaluator.values(self.x)
        lower, upper = self.evaluator.limits
        beyond = values - np.clip(values, lower, upper)
        return float(np.clip(10.0 * max(1.0, abs(objective)) / max(1.0, 0.5 * beyond @ beyond), 1e-6, 10.0))

    def _improve(self) -> tuple[float, int]:
        """One inner solve and new multipliers; how far violation and complementarity are, as in ALGENCAN; iterations."""
        inner = self._minimize_inner()
        self.evaluator.counts.inner += int(inner.nit)
        self.x = np.clip(inner.x, self.evaluator.lower, self.evaluator.upper)
        _, values = self.evaluator.values(self.x)
        old = self.multipliers
        self.multipliers = np.clip(self.penalty * self._residual(values), -LARGEST_MULTIPLIER, LARGEST_MULTIPLIER)
        return float(np.abs(self.multipliers - old).max(initial=0.0)) / self.penalty, int(inner.nit)

    def _minimize_inner(self) -> OptimizeResult:
        def keep(x: np.ndarray) -> None:
            self.x = np.clip(x, self.evaluator.lower, self.evaluator.upper)

        return scipy_minimize(
            self._function,
            self.x,
            jac=True,
            method="L-BFGS-B",
            callback=keep,
            bounds=list(zip(self.evaluator.lower, self.evaluator.upper, strict=True)),
            options={
                "maxiter": self.options.inner_iterations,
                "maxfun": 3 * self.options.inner_iterations,
                "maxcor": 30,
                "maxls": 50,
                "gtol": self.tolerance,
                "ftol": 0.0,
            },
        )

    def _rescale(self) -> None:
        """Scale again what has drifted: gradients that have grown or shrunk a hundredfold since they were scaled."""
        evaluator = self.evaluator
        objective, rows = scales(evaluator, self.x)
        drift = np.append(rows / evaluator.constraint_scale, objective / evaluator.objective_scale)
        if ((drift > 1.0 / DRIFT) & (drift < DRIFT)).all():
            return
        self.rescale(objective, rows)

    def _feasible_or_not(self, beyond: float) -> Outcome | None:
        """Where penalties grow in vain: look for a feasible point. The end of the run, as `_to_feasible`; else None."""
        is_in_vain = self.penalty >= IN_VAIN * self._first_penalty()
        if not is_in_vain or beyond < HOPELESS * self.options.feasibility_tolerance:
            return None
        return self._to_feasible("penalty")

    def _first_penalty(self) -> float:
        """Of the inner solves since the search last settled somewhere."""
        first = self.penalty
        for record in reversed(self.history):
            if record.phase != "augmented Lagrangian":
                break
            first = record.penalty
        return first

    def _to_feasible(self, stage: Stage) -> Outcome | None:
        """A feasible point from here or from other starts becomes this one, for Newton's method to go on from.

        The end of the run where there is none, or where Newton's method ends at an optimum; else None.
        """
        tolerance = self.options.feasibility_tolerance
        found = nearest_feasible(self.evaluator, self.x, tolerance, lambda x: self.show("elastic", x))
        if found.violation > tolerance:
            status, words = lack_of_feasible(found)
            if status == "failed" and self.stage == "restoration":  # the loop may yet find one
                self.settle(found.x, "penalty")
                return None
            # The least largest violation spreads the miss over all rows; the least squares beside it tell which rows fight.
            self.x = restore(self.evaluator, found.x, 0.0, iterations=SPREAD).x
            return self.outcome(status, words)
        may_polish = self.options.newton_iterations > 0
        self.penalty, self.last_progress = self._initial_penalty(), LARGEST
        self.settle(found.x, stage, is_near=may_polish)
        return self.outcome("converged", CONVERGED) if may_polish and self.polish() else None

    def _is_finished(self) -> bool:
        """The certificate holds, at this point or at the one to which Newton's method leads."""
        certificate = self.certificate()
        is_settled = certificate.stationarity <= NEARLY_STATIONARY or self._has_settled()
        is_near = certificate.feasibility <= NEARLY_FEASIBLE and is_settled
        may_polish = self.options.newton_iterations > 0 and self.polished < POLISHES
        if self.newton is not None or (may_polish and is_near):
            return self.polish()
        return certificate.holds(*self.tolerances)

    def _has_settled(self) -> bool:
        """The objective of the last two inner solves agrees; L-BFGS leaves large gradients where penalties are stiff."""
        ends = [record.objective for record in self.history if record.phase == "augmented Lagrangian"][-2:]
        return len(ends) == 2 and abs(ends[1] - ends[0]) <= SETTLED * max(abs(ends[1]), 1e-12)


def _missing(certificate: Certificate, options: Options) -> str:
    return (
        f"stationarity {certificate.stationarity:.2g} and violation {certificate.feasibility:.2g} "
        f"are above {options.stationarity_tolerance:g} and {options.feasibility_tolerance:g}"
    )


def solve(task: Task) -> Outcome:
    return AugmentedLagrangian(task).run()


OPTIMIZER = Optimizer("augmented-lagrangian", solve, keeps_checkpoints=True)
