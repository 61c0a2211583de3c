"""What our own optimizers share: the state of a run with its checkpoint, its records, restoration and Newton's method.

More than 300 lines because all of them read and write the one state that a checkpoint keeps.
"""

import time
from abc import ABC, abstractmethod
from dataclasses import asdict
from typing import Any, Literal, get_args

import numpy as np

from lpc_mdo.optimization.certificate import LARGE, Certificate, certify, least_squares_multipliers, violation
from lpc_mdo.optimization.curvature import curves_downward, lower_point
from lpc_mdo.optimization.evaluator import Evaluator, TimeLimit
from lpc_mdo.optimization.large import fault_large, refine_large
from lpc_mdo.optimization.newton import ACTIVE, NewtonPoint, refine, start_point, stored_point
from lpc_mdo.optimization.optimizer import Outcome, Task
from lpc_mdo.optimization.quadratic import QuadraticModel, quadratic_model
from lpc_mdo.optimization.restoration import FIRST_DAMPING, Restored, restore
from lpc_mdo.optimization.result import Progress, Status
from lpc_mdo.optimization.scaling import scales
from lpc_mdo.optimization.verdict import DOWNHILL, Fault, fault, remainder

REFINED = 1e-2, 0.1  # of the tolerances: what Newton's method is asked for, since its last steps cost little
FINEST = 1e-9  # stationarity and complementarity that quadratic programmes reach
ROUNDS = 8  # of Newton's method: again after new scales, or from a lower point beside a saddle
DRIFTED = 3.0  # factor between a scale and the one of the point where it is certified
UNBOUNDED = -1e12
LARGEST = 1e300
CONVERGED = "the certificate holds"
FALLING = "the objective falls without limit"

Stage = Literal["restoration", "newton", "penalty"]
STAGES = get_args(Stage)


class Diverged(Exception):
    """The objective fell below any that makes sense."""


class Search(ABC):
    """One run. A subclass has `_run`, which takes it from its stage to an outcome."""

    def __init__(self, task: Task) -> None:
        self.evaluator, self.options, self.hooks = task.evaluator, task.options, task.hooks
        self.x = task.x.copy()
        self.stage: Stage = "restoration"
        self.damping = FIRST_DAMPING  # of the restoration
        self.newton: NewtonPoint | None = None  # the newest point of Newton's method, while it is at work
        self.multipliers = np.zeros_like(self.evaluator.constraint_lower)
        self.penalty = 0.0
        self.outer = 0
        self.tolerance = 1e-2
        self.last_violation = self.last_progress = LARGEST
        self.progress: float | None = None  # of an inner solve that has not been judged yet
        self.history: list[Progress] = []
        self.rows: list[dict[str, Any]] = []  # the history as plain numbers, each record converted once
        self.fault: Fault | None = None  # why the newest end of Newton's method is no optimum
        self.reached: dict[str, Any] | None = None  # the best end of Newton's method that was no optimum yet, unscaled
        self.polished = 0  # times that Newton's method was tried
        self.started = time.monotonic()
        if task.multipliers is not None:
            self.multipliers = task.multipliers.copy()
            self.stage = "newton"
        if task.state is not None:
            self._restore(task.state)
        self.evaluator.deadline = self.started + self.options.time_limit
        self.evaluator.is_thrifty = self.options.second_derivatives == "updated"

    def _restore(self, state: dict[str, Any]) -> None:
        self.x = np.array(state["x"])
        self.multipliers = np.array(state["multipliers"])
        self.penalty, self.outer, self.tolerance = state["penalty"], state["outer"], state["tolerance"]
        self.last_violation, self.last_progress = state["last_violation"], state["last_progress"]
        self.progress, self.stage = state["progress"], state["stage"]
        self.damping, self.polished, self.reached = state["damping"], state["polished"], state["reached"]
        self.newton = None if state["newton"] is None else stored_point(state["newton"])
        self.rows = list(state["history"])
        self.history = [Progress(**record) for record in self.rows]
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
            "damping": self.damping,
            "polished": self.polished,
            "reached": self.reached,
            "newton": None if self.newton is None else self.newton.state(),
            "history": list(self.rows),
        }

    @property
    def elapsed(self) -> float:
        return time.monotonic() - self.started

    @property
    def tolerances(self) -> tuple[float, float]:
        return self.options.stationarity_tolerance, self.options.feasibility_tolerance

    def run(self) -> Outcome:
        try:
            return self._run()
        except KeyboardInterrupt:
            return self._stopped("interrupted", "stopped by the user")
        except TimeLimit:
            return self._stopped("time_limit", f"the time limit of {self.options.time_limit:g} s was reached")
        finally:
            self.evaluator.deadline = float("inf")

    @abstractmethod
    def _run(self) -> Outcome: ...

    def _stopped(self, status: Status, message: str) -> Outcome:
        """The newest point: Newton's, if that was at work."""
        if self.newton is not None:
            self.x, self.multipliers = self.newton.x, self.newton.multipliers
        return self.outcome(status, message)

    def outcome(self, status: Status, message: str) -> Outcome:
        return Outcome(self.x, self.multipliers, status, message, self.history)

    def certificate(self) -> Certificate:
        return certify(self.evaluator, self.x, self.multipliers)

    def record(
        self, phase: str, x: np.ndarray, certificate: Certificate, point: NewtonPoint | None = None, inner: int = 0
    ) -> None:
        """One line of the history, told to the caller with a checkpoint. Raises TimeLimit where the time is over."""
        self.history.append(self._line(phase, x, certificate, point, inner))
        self.rows.append(asdict(self.history[-1]))
        self.evaluator.counts.outer += phase in ("restoration", "Newton")
        self.hooks.progress(self.history[-1])
        self.hooks.checkpoint(self.state())
        self.evaluator.require_time()

    def show(self, phase: str, x: np.ndarray) -> None:
        """Tell the caller of a point (n,) of a search that a restart repeats: it is no line of the history."""
        self.hooks.progress(self._line(phase, x, certify(self.evaluator, x, self.multipliers)))

    def _line(
        self, phase: str, x: np.ndarray, certificate: Certificate, point: NewtonPoint | None = None, inner: int = 0
    ) -> Progress:
        objective, _ = self.evaluator.values(x)
        return Progress(
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

    def restored(self, tolerance: float, iterations: int) -> Restored:
        """The nearest point whose violation is within the tolerance; every step is recorded.

        A restart goes on with what is left of the steps.
        """

        def report(x: np.ndarray, damping: float) -> None:
            self.x, self.damping = x, damping
            self.record("restoration", x, certify(self.evaluator, x, self.multipliers))

        past = [record.violation for record in self.history if record.phase in ("start", "restoration")]
        return restore(self.evaluator, self.x, tolerance, self.damping, iterations, report=report, past=past[:-1])

    def settle(self, x: np.ndarray, stage: Stage, is_near: bool = False) -> None:
        """Go on from x (n,) at another stage, with scales and multipliers of that point; is_near: by Newton's method."""
        self.x = x
        self.evaluator.objective_scale, self.evaluator.constraint_scale = scales(self.evaluator, x)
        self.multipliers = least_squares_multipliers(self.evaluator, x, ACTIVE)
        self.stage = stage
        self.newton = start_point(self.evaluator, x, self.multipliers) if is_near else None
        self.hooks.checkpoint(self.state())

    def polish(self) -> bool:
        """Newton's method from here, or on from where it was, until an optimum is certified; True if it is.

        The certificate is that of scales at its own point. `fault` says what is missing where it is not certified; the end is
        kept then, in case nothing better follows.
        """
        is_optimum = self._polished()
        if not is_optimum:
            ratio = self.evaluator.constraint_scale / self.evaluator.objective_scale
            here = {"x": self.x.tolist(), "multipliers": (self.multipliers * ratio).tolist()}
            if self.reached is None or self.certificate().merit(*self.tolerances) < self._kept(self.reached)[2]:
                self.reached = here
        return is_optimum

    def _kept(self, reached: dict[str, Any]) -> tuple[np.ndarray, np.ndarray, float]:
        """x (n,) and multipliers (m,) of the best end so far, in the scales of now, with its merit."""
        x = np.array(reached["x"])
        multipliers = np.array(reached["multipliers"])
        multipliers = multipliers * self.evaluator.objective_scale / self.evaluator.constraint_scale
        return x, multipliers, certify(self.evaluator, x, multipliers).merit(*self.tolerances)

    def take_best(self) -> None:
        """Go back to the best end of Newton's method where this point is no better."""
        if self.reached is not None:
            x, multipliers, merit = self._kept(self.reached)
            if merit < self.certificate().merit(*self.tolerances):
                self.x, self.multipliers = x, multipliers

    def _polished(self) -> bool:
        self.fault, self.polished = None, self.polished + (self.newton is None)
        if len(self.x) > LARGE:
            return self._polish_large()
        for _ in range(ROUNDS):
            model = self._newton()
            if model is None:
                self.fault = Fault("second derivatives are not finite at the best point")
                return False
            if self._rescale_here(model):
                self.newton = None
                continue
            left = remainder(self.evaluator, self.x, self.multipliers, model)
            self.fault = fault(self.multipliers, self.certificate(), model, left, self.tolerances)
            if self.fault is not None:
                return False
            lower = lower_point(self.evaluator, self.x, self.multipliers, model, 0.1 * self.tolerances[1])
            if lower is None:
                if curves_downward(self.evaluator, self.x, model):
                    self.fault = DOWNHILL
                return self.fault is None
            self.settle(lower, "newton")
        return False

    def _polish_large(self) -> bool:
        """As `polish`, without matrices; rows that are not active stay so."""

        def report(x: np.ndarray, multipliers: np.ndarray, certificate: Certificate) -> None:
            self.x, self.multipliers = x, multipliers
            self.record("Newton", x, certificate)
            if self.evaluator.values(x)[0] < UNBOUNDED:
                raise Diverged

        iterations = self.options.newton_iterations
        self.x, self.multipliers = refine_large(
            self.evaluator, self.x, self.multipliers, self.tolerances, iterations, report
        )
        self.rescale(*scales(self.evaluator, self.x))
        self.fault = fault_large(self.evaluator, self.x, self.multipliers, self.tolerances)
        return self.fault is None

    def _newton(self) -> QuadraticModel | None:
        """Newton's method to its end, which is taken over if it is better; the quadratic model there."""
        tolerances = self.tolerances

        def report(point: NewtonPoint) -> None:
            self.newton = point
            self.record("Newton", point.x, point.certificate, point)
            if self.evaluator.values(point.x)[0] < UNBOUNDED:
                self.x, self.multipliers = point.x, point.multipliers
                raise Diverged

        reached = refine(
            self.evaluator,
            self.newton or start_point(self.evaluator, self.x, self.multipliers),
            min(tolerances[0], max(REFINED[0] * tolerances[0], FINEST)),
            REFINED[1] * tolerances[1],
            self.options.newton_iterations,
            report,
        )
        self.newton = None
        merit = reached.point.certificate.merit(*tolerances)
        if merit <= self.certificate().merit(*tolerances):
            self.x, self.multipliers = reached.point.x, reached.point.multipliers
            if reached.model is not None:
                return reached.model
        try:
            return quadratic_model(self.evaluator, self.x, self.multipliers)
        except ArithmeticError:
            return None

    def _rescale_here(self, model: QuadraticModel) -> bool:
        """Take the scales of this point where they differ much; True if they do."""
        new = scales(self.evaluator, self.x, model.stiffness)
        drift = np.append(new[1] / self.evaluator.constraint_scale, new[0] / self.evaluator.objective_scale)
        if ((drift > 1.0 / DRIFTED) & (drift < DRIFTED)).all():
            return False
        self.rescale(*new)
        return True

    def rescale(self, objective: float, rows: np.ndarray) -> None:
        """New scales of objective and rows (m,), multipliers with them."""
        evaluator = self.evaluator
        self.multipliers = self.multipliers * objective / evaluator.objective_scale * evaluator.constraint_scale / rows
        evaluator.objective_scale, evaluator.constraint_scale = objective, rows

    def violation(self) -> float:
        """The largest, scaled."""
        _, values = self.evaluator.values(self.x)
        return float(np.abs(violation(values, *self.evaluator.limits)).max(initial=0.0))

    def is_nearly_feasible(self) -> bool:
        return self.violation() <= 1e-3 * float(np.abs(self.x).max())


def _active(evaluator: Evaluator, x: np.ndarray) -> int:
    """Number of rows at or beyond a limit."""
    _, values = evaluator.values(x)
    lower, upper = evaluator.limits
    return int(((values - lower <= ACTIVE) | (upper - values <= ACTIVE)).sum())
