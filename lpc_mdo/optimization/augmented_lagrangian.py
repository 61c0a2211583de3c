"""Newton's method from a nearby feasible point, and an augmented Lagrangian where that does not reach an optimum.

The start is brought to the nearest point that nearly satisfies the constraints, whence Newton's method mostly reaches the
optimum. Where it does not, the augmented Lagrangian takes over: Powell-Hestenes-Rockafellar function with two-sided rows,
safeguarded multipliers and penalty growth as in ALGENCAN (Andreani, Birgin, Martinez, Schuverdt, SIAM J. Optim. 18, 2008),
inner solves by SciPy's L-BFGS-B, and Newton's method again from every point that comes near.
"""

import time
from dataclasses import asdict
from typing import Any, Literal, get_args

import numpy as np
from scipy.optimize import OptimizeResult
from scipy.optimize import minimize as scipy_minimize

from lpc_mdo.optimization.certificate import Certificate, certify, least_squares_multipliers, violation
from lpc_mdo.optimization.evaluator import Evaluator, scales
from lpc_mdo.optimization.newton import ACTIVE, NewtonPoint, refine, start_point, stored_point
from lpc_mdo.optimization.restoration import FIRST_DAMPING, restore
from lpc_mdo.optimization.result import Hooks, Options, Progress, Status

LARGEST_MULTIPLIER = 1e6
LARGEST_PENALTY = 1e8
SUFFICIENT_DECREASE = 0.5  # of the violation, or the penalty grows tenfold
NEARLY_FEASIBLE, NEARLY_STATIONARY = 5e-2, 1e-2  # scaled: from here on Newton's method is tried
REFINED = 1e-2, 0.1  # of the tolerances: what Newton's method is asked for, since its last steps cost little
RESTORED = 1e-3  # scaled violation from which Newton's method starts
HOPELESS = 1e2  # of the feasibility tolerance: a stationary violation beyond it is no rounding
DRIFT = 100.0  # of a gradient's size, that calls for new scales
LARGEST = 1e300
UNBOUNDED = -1e12
FAILED_VALUE = 1e15  # what L-BFGS-B sees of a failed evaluation: its line search steps back


CONVERGED = "the certificate holds"
FALLING = "the objective falls without limit"
Outcome = tuple[np.ndarray, np.ndarray, Certificate, Status, str]
Stage = Literal["restoration", "newton", "penalty"]
STAGES = get_args(Stage)


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
        self.stage: Stage = "restoration" if multipliers is None else "newton"
        self.damping = FIRST_DAMPING  # of the restoration
        self.newton: NewtonPoint | None = None  # the newest point of Newton's method, while it is at work
        self.is_doubtful = False  # no feasible point was found near the start
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
        self.progress, self.stage, self.is_doubtful = state["progress"], state["stage"], state["is_doubtful"]
        self.damping = state["damping"]
        self.newton = None if state["newton"] is None else stored_point(state["newton"])
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
            "stage": self.stage,
            "is_doubtful": self.is_doubtful,
            "damping": self.damping,
            "newton": None if self.newton is None else self.newton.state(),
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
        if objective < UNBOUNDED:
            self.x = x.copy()
            raise _Diverged
        value = objective + 0.5 * self.penalty * float(residual @ residual)
        return value, self.evaluator.gradient(x, self.penalty * residual)

    def _initial_penalty(self) -> float:
        objective, values = self.evaluator.values(self.x)
        beyond = violation(values, *self.evaluator.limits)
        return float(np.clip(10.0 * max(1.0, abs(objective)) / max(1.0, 0.5 * beyond @ beyond), 1e-6, 10.0))

    def _record(
        self, phase: str, x: np.ndarray, certificate: Certificate, point: NewtonPoint | None = None, inner: int = 0
    ) -> None:
        objective, _ = self.evaluator.values(x)
        self.history.append(
            Progress(
                phase=phase,
                iteration=len(self.history),
                objective=objective / self.evaluator.objective_scale,
                violation=certificate.feasibility,
                worst_constraint=certificate.worst_constraint,
                stationarity=certificate.stationarity,
                penalty=self.penalty if phase == "augmented Lagrangian" else float("nan"),
                evaluations=self.evaluator.counts.evaluations,
                elapsed=self.elapsed,
                inner=inner,
                step=float("nan") if point is None else point.step,
                damping=self.damping if phase == "restoration" else float("nan") if point is None else point.damping,
                active=_active(self.evaluator, x),
                on_bounds=int(((x <= self.evaluator.lower) | (x >= self.evaluator.upper)).sum()),
            )
        )
        self.evaluator.counts.outer += phase in ("restoration", "Newton")
        self.hooks.progress(self.history[-1])
        self.hooks.checkpoint(self.state())
        if self.elapsed > self.options.time_limit:
            raise _Stopped

    def run(self) -> Outcome:
        """Solve; returns x, scaled multipliers, certificate, status and message."""
        try:
            return self._run()
        except KeyboardInterrupt:
            return self._stopped("interrupted", "stopped by the user")
        except _Stopped:
            return self._stopped("time_limit", f"the time limit of {self.options.time_limit:g} s was reached")

    def _stopped(self, status: Status, message: str) -> Outcome:
        """The newest point: Newton's, if that was at work."""
        if self.newton is not None:
            self.x, self.multipliers = self.newton.x, self.newton.multipliers
        return self._outcome(status, message)

    def _outcome(self, status: Status, message: str) -> Outcome:
        return self.x, self.multipliers, certify(self.evaluator, self.x, self.multipliers), status, message

    def _run(self) -> Outcome:
        options, evaluator = self.options, self.evaluator
        if self.penalty == 0.0:
            self.penalty = self._initial_penalty()
            self._record("start", self.x, certify(evaluator, self.x, self.multipliers))
        if options.newton_iterations == 0:
            self.stage = "penalty"
        if self.stage != "penalty":
            try:
                if self._start_with_newton():
                    return self._outcome("converged", CONVERGED)
            except _Diverged:
                if self._is_nearly_feasible():
                    return self._outcome("unbounded", FALLING)
            self.stage, self.newton = "penalty", None
        certificate = certify(evaluator, self.x, self.multipliers)
        while self.progress is not None or self.outer < options.outer_iterations:
            if self.progress is None:
                self.hooks.checkpoint(self.state())
                self.outer += 1
                evaluator.counts.outer += 1
                start = self.x
                try:
                    self.progress, inner = self._improve()
                except _Diverged:
                    if self._is_nearly_feasible():
                        return self._outcome("unbounded", FALLING)
                    self.x, self.penalty = start, min(10.0 * self.penalty, LARGEST_PENALTY)
                    continue
                self._record("augmented Lagrangian", self.x, certify(evaluator, self.x, self.multipliers), inner=inner)
            beyond = self._violation()
            try:
                if self._is_finished():
                    return self._outcome("converged", CONVERGED)
            except _Diverged:
                self.newton = None
            if self._is_infeasible(beyond):
                message = (
                    f"no design satisfies all constraints; least violation reached {self._violation():.3g} (scaled)"
                )
                return self._outcome("infeasible", message)
            progress, self.progress = self.progress, None
            certificate = certify(evaluator, self.x, self.multipliers)
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
        return self._outcome("iteration_limit", message)

    def _start_with_newton(self) -> bool:
        """Newton's method from the nearest point that is nearly feasible, or from the given multipliers' point."""
        if self.stage == "restoration":
            start = self.x

            def report(x: np.ndarray, damping: float) -> None:
                self.x, self.damping = x, damping
                self._record("restoration", x, certify(self.evaluator, x, self.multipliers))

            restored = restore(self.evaluator, self.x, RESTORED, self.damping, report=report)
            if restored.violation > HOPELESS * self.options.feasibility_tolerance and not restored.is_near:
                self.x, self.is_doubtful = start, True
                return False
            self.x = restored.x
            self.evaluator.objective_scale, self.evaluator.constraint_scale = scales(self.evaluator, self.x)
            self.multipliers = least_squares_multipliers(self.evaluator, self.x, ACTIVE)
            self.stage = "newton"
            self.hooks.checkpoint(self.state())
        return self._refine()

    def _refine(self) -> bool:
        """Newton's method from here, or on from where it was; takes over its end if that is better."""
        tolerances = self.options.stationarity_tolerance, self.options.feasibility_tolerance

        def report(point: NewtonPoint) -> None:
            self.newton = point
            self._record("Newton", point.x, point.certificate, point)
            if self.evaluator.values(point.x)[0] < UNBOUNDED:
                self.x, self.multipliers = point.x, point.multipliers
                raise _Diverged

        reached = refine(
            self.evaluator,
            self.newton or start_point(self.evaluator, self.x, self.multipliers),
            REFINED[0] * tolerances[0],
            REFINED[1] * tolerances[1],
            self.options.newton_iterations,
            report,
        )
        self.newton = None
        here = certify(self.evaluator, self.x, self.multipliers)
        if reached.certificate.merit(*tolerances) < here.merit(*tolerances):
            self.x, self.multipliers, here = reached.x, reached.multipliers, reached.certificate
        return here.holds(*tolerances)

    def _improve(self) -> tuple[float, int]:
        """One inner solve and new multipliers; how far violation and complementarity are, as in ALGENCAN; iterations."""
        inner = self._minimize_inner()
        self.evaluator.counts.inner += int(inner.nit)
        self.x = np.clip(inner.x, self.evaluator.lower, self.evaluator.upper)
        _, values = self.evaluator.values(self.x)
        old = self.multipliers
        self.multipliers = np.clip(self.penalty * self._residual(values), -LARGEST_MULTIPLIER, LARGEST_MULTIPLIER)
        return float(np.abs(self.multipliers - old).max(initial=0.0)) / self.penalty, int(inner.nit)

    def _violation(self) -> float:
        _, values = self.evaluator.values(self.x)
        return float(np.abs(violation(values, *self.evaluator.limits)).max(initial=0.0))

    def _is_nearly_feasible(self) -> bool:
        return self._violation() <= 1e-3 * np.abs(self.x).max()

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

    def _is_infeasible(self, beyond: float) -> bool:
        """No feasible point can be found from here, although the penalty has outgrown the objective, or from the start."""
        if (self.penalty < 1e4 and not self.is_doubtful) or beyond < HOPELESS * self.options.feasibility_tolerance:
            return False
        restored = restore(self.evaluator, self.x, RESTORED)
        if not restored.is_near:
            self.x = restored.x
            return True
        self.is_doubtful = False
        return False

    def _is_finished(self) -> bool:
        """The certificate holds, at this point or at the one to which Newton's method leads."""
        certificate = certify(self.evaluator, self.x, self.multipliers)
        is_near = certificate.stationarity <= NEARLY_STATIONARY and certificate.feasibility <= NEARLY_FEASIBLE
        if self.options.newton_iterations > 0 and (is_near or self.newton is not None):
            return self._refine()
        return certificate.holds(self.options.stationarity_tolerance, self.options.feasibility_tolerance)


def _active(evaluator: Evaluator, x: np.ndarray) -> int:
    """Number of rows at or beyond a limit."""
    _, values = evaluator.values(x)
    lower, upper = evaluator.limits
    return int(((values - lower <= ACTIVE) | (upper - values <= ACTIVE)).sum())
