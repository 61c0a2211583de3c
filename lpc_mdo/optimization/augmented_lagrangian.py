"""Augmented Lagrangian over bound-constrained L-BFGS, finished by Newton's method.

Powell-Hestenes-Rockafellar function with two-sided rows, safeguarded multipliers and penalty growth as in ALGENCAN
(Andreani, Birgin, Martinez, Schuverdt, SIAM J. Optim. 18, 2008); inner solves by SciPy's L-BFGS-B.
"""

import time
from dataclasses import asdict
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult
from scipy.optimize import minimize as scipy_minimize

from lpc_mdo.optimization.certificate import Certificate, certify, violation
from lpc_mdo.optimization.evaluator import Evaluator, scales
from lpc_mdo.optimization.newton import NewtonPoint, refine
from lpc_mdo.optimization.result import Hooks, Options, Progress, Status

LARGEST_MULTIPLIER = 1e6
LARGEST_PENALTY = 1e8
SUFFICIENT_DECREASE = 0.5  # of the violation, or the penalty grows tenfold
NEARLY_FEASIBLE, NEARLY_STATIONARY = 5e-2, 1e-2  # scaled: from here on Newton's method is tried
REFINED = 1e-2, 0.1  # of the tolerances: what Newton's method is asked for, since its last steps cost little
DRIFT = 100.0  # of a gradient's size, that calls for new scales
LARGEST = 1e300
UNBOUNDED = -1e12
FAILED_VALUE = 1e15  # what L-BFGS-B sees of a failed evaluation: its line search steps back


class _Stopped(Exception):
    """The time limit was reached, in an inner solve or between Newton steps."""


class _Diverged(Exception):
    """The objective fell below any that makes sense."""


class AugmentedLagrangian:
    """One run; `state` restarts it where a checkpoint was written. Scaled multipliers (m,) are tried as they are given."""

    def __init__(
        self,
        evaluator: Evaluator,
        x: np.ndarray,
        options: Options,
        hooks: Hooks,
        multipliers: np.ndarray | None = None,
    ) -> None:
        self.evaluator, self.options, self.hooks = evaluator, options, hooks
        self.x = x.copy()
        self.is_warm = multipliers is not None
        self.multipliers = np.zeros_like(evaluator.constraint_lower) if multipliers is None else multipliers.copy()
        self.penalty = 0.0
        self.outer = 0
        self.tolerance = 1e-2
        self.last_violation = self.last_progress = LARGEST
        self.progress: float | None = None  # of an inner solve that has not been judged yet
        self.history: list[Progress] = []
        self.started = time.monotonic()

    def restore(self, state: dict[str, Any]) -> None:
        self.x = np.array(state["x"])
        self.multipliers = np.array(state["multipliers"])
        self.penalty, self.outer, self.tolerance = state["penalty"], state["outer"], state["tolerance"]
        self.last_violation, self.last_progress = state["last_violation"], state["last_progress"]
        self.progress = state["progress"]
        self.history = [Progress(**record) for record in state["history"]]
        self.started -= self.history[-1].elapsed if self.history else 0.0

    def state(self) -> dict[str, Any]:
        """Everything that a restart needs, as plain numbers."""
        return {
            "x": self.x.tolist(),
            "multipliers": self.multipliers.tolist(),
            "penalty": self.penalty,
            "outer": self.outer,
            "tolerance": self.tolerance,
            "last_violation": self.last_violation,
            "last_progress": self.last_progress,
            "progress": self.progress,
            "history": [asdict(record) for record in self.history],
        }

    @property
    def elapsed(self) -> float:
        return time.monotonic() - self.started

    def _residual(self, values: np.ndarray) -> np.ndarray:
        """c + lambda/rho less its projection on the limits."""
        shifted = values + self.multipliers / self.penalty
        return shifted - np.clip(shifted, *self.evaluator.limits)

    def _function(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        if self.elapsed > self.options.time_limit:
            raise _Stopped
        if not self.evaluator.is_finite(x):
            return FAILED_VALUE, np.zeros_like(x)
        objective, values = self.evaluator.values(x)
        residual = self._residual(values)
        self.x = x.copy()
        if objective < UNBOUNDED:
            raise _Diverged
        value = objective + 0.5 * self.penalty * float(residual @ residual)
        return value, self.evaluator.gradient(x, self.penalty * residual)

    def _initial_penalty(self) -> float:
        objective, values = self.evaluator.values(self.x)
        beyond = violation(values, *self.evaluator.limits)
        return float(np.clip(10.0 * max(1.0, abs(objective)) / max(1.0, 0.5 * beyond @ beyond), 1e-6, 10.0))

    def _record(self, phase: str, x: np.ndarray, certificate: Certificate) -> None:
        objective, _ = self.evaluator.values(x)
        self.history.append(
            Progress(
                phase=phase,
                iteration=len(self.history) + 1,
                objective=objective / self.evaluator.objective_scale,
                violation=certificate.feasibility,
                worst_constraint=certificate.worst_constraint,
                stationarity=certificate.stationarity,
                penalty=self.penalty,
                evaluations=self.evaluator.counts.evaluations,
                elapsed=self.elapsed,
            )
        )
        self.hooks.progress(self.history[-1])

    def run(self) -> tuple[np.ndarray, np.ndarray, Certificate, Status, str]:
        """Solve; returns x, scaled multipliers, certificate, status and message."""
        try:
            return self._run()
        except KeyboardInterrupt:
            certificate = certify(self.evaluator, self.x, self.multipliers)
            return self.x, self.multipliers, certificate, "interrupted", "stopped by the user"
        except _Stopped:
            certificate = certify(self.evaluator, self.x, self.multipliers)
            message = f"the time limit of {self.options.time_limit:g} s was reached"
            return self.x, self.multipliers, certificate, "time_limit", message

    def _run(self) -> tuple[np.ndarray, np.ndarray, Certificate, Status, str]:
        options, evaluator = self.options, self.evaluator
        if self.penalty == 0.0:
            self.penalty = self._initial_penalty()
        certificate = certify(evaluator, self.x, self.multipliers)
        if self.is_warm and self._is_finished(certificate):
            return self._finished()
        while self.progress is not None or self.outer < options.outer_iterations:
            if self.progress is None:
                self.hooks.checkpoint(self.state())
                self.outer += 1
                evaluator.counts.outer += 1
                start = self.x
                try:
                    self.progress = self._improve()
                except _Diverged:
                    if self._violation() <= 1e-3 * np.abs(self.x).max():
                        return self.x, self.multipliers, certificate, "unbounded", "the objective falls without limit"
                    self.x, self.penalty = start, min(10.0 * self.penalty, LARGEST_PENALTY)
                    continue
                self._record("augmented Lagrangian", self.x, certify(evaluator, self.x, self.multipliers))
                self.hooks.checkpoint(self.state())
            progress, self.progress, beyond = self.progress, None, self._violation()
            certificate = certify(evaluator, self.x, self.multipliers)
            if self._is_finished(certificate):
                return self._finished()
            if self._is_infeasible(beyond):
                message = f"no design satisfies all constraints; least violation reached {beyond:.3g} (scaled)"
                return self.x, self.multipliers, certificate, "infeasible", message
            is_slow = progress > SUFFICIENT_DECREASE * self.last_progress
            if is_slow and progress > 0.1 * options.feasibility_tolerance:
                self.penalty = min(10.0 * self.penalty, LARGEST_PENALTY)
            self._rescale()
            self.last_violation, self.last_progress = beyond, progress
            self.tolerance = max(0.3 * self.tolerance, 0.3 * options.stationarity_tolerance)
        message = (
            f"stationarity {certificate.stationarity:.2g} and violation {certificate.feasibility:.2g} "
            f"are above {options.stationarity_tolerance:g} and {options.feasibility_tolerance:g}"
        )
        return self.x, self.multipliers, certificate, "iteration_limit", message

    def _improve(self) -> float:
        """One inner solve and new multipliers; returns how far violation and complementarity are, as in ALGENCAN."""
        inner = self._minimize_inner()
        self.evaluator.counts.inner += int(inner.nit)
        self.x = np.clip(inner.x, self.evaluator.lower, self.evaluator.upper)
        _, values = self.evaluator.values(self.x)
        old = self.multipliers
        self.multipliers = np.clip(self.penalty * self._residual(values), -LARGEST_MULTIPLIER, LARGEST_MULTIPLIER)
        return float(np.abs(self.multipliers - old).max(initial=0.0)) / self.penalty

    def _violation(self) -> float:
        _, values = self.evaluator.values(self.x)
        return float(np.abs(violation(values, *self.evaluator.limits)).max(initial=0.0))

    def _rescale(self) -> None:
        """Scale anew what has drifted: gradients that have grown or shrunk a hundredfold since they were scaled."""
        evaluator = self.evaluator
        objective, rows = scales(evaluator, self.x)
        drift = np.append(rows / evaluator.constraint_scale, objective / evaluator.objective_scale)
        if ((drift > 1.0 / DRIFT) & (drift < DRIFT)).all():
            return
        self.multipliers = self.multipliers * objective / evaluator.objective_scale * evaluator.constraint_scale / rows
        evaluator.objective_scale, evaluator.constraint_scale = objective, rows

    def _minimize_inner(self) -> OptimizeResult:
        return scipy_minimize(
            self._function,
            self.x,
            jac=True,
            method="L-BFGS-B",
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

    def _is_infeasible(self, beyond: float) -> bool:
        """The violation is large and stationary although the penalty has outgrown the objective."""
        if self.penalty < 1e4 or beyond < 1e2 * self.options.feasibility_tolerance:
            return False
        _, values = self.evaluator.values(self.x)
        residual = violation(values, *self.evaluator.limits)
        slope = self.evaluator.gradient(self.x, residual, objective_weight=0.0)
        moved = self.x - np.clip(self.x - slope, self.evaluator.lower, self.evaluator.upper)
        return float(np.abs(moved).max(initial=0.0)) < 1e-2 * beyond and beyond > 0.9 * self.last_violation

    def _is_finished(self, certificate: Certificate) -> bool:
        """The certificate holds, at this point or at the one to which Newton's method leads."""
        tolerances = self.options.stationarity_tolerance, self.options.feasibility_tolerance
        is_near = self.is_warm or (
            certificate.stationarity <= NEARLY_STATIONARY and certificate.feasibility <= NEARLY_FEASIBLE
        )
        self.is_warm = False
        if self.options.newton_iterations == 0 or not is_near:
            return certificate.holds(*tolerances)

        def report(point: NewtonPoint) -> None:
            self._record("Newton", point.x, point.certificate)
            if self.elapsed > self.options.time_limit:
                self.x, self.multipliers = point.x, point.multipliers
                raise _Stopped

        refined = refine(
            self.evaluator,
            self.x,
            self.multipliers,
            REFINED[0] * tolerances[0],
            REFINED[1] * tolerances[1],
            self.options.newton_iterations,
            report,
        )
        if refined.certificate.merit(*tolerances) < certificate.merit(*tolerances):
            self.x, self.multipliers = refined.x, refined.multipliers
            certificate = refined.certificate
        return certificate.holds(*tolerances)

    def _finished(self) -> tuple[np.ndarray, np.ndarray, Certificate, Status, str]:
        certificate = certify(self.evaluator, self.x, self.multipliers)
        return self.x, self.multipliers, certificate, "converged", "the certificate holds"
