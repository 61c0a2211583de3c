"""Sequential quadratic programming with exact second derivatives from the nearest point that is nearly feasible.

Where restoration stalls before one, elastic mode goes on, or ends the run; where Newton's method stops short of an optimum,
the augmented Lagrangian goes on.
"""

from lpc_mdo.optimization.augmented_lagrangian import AugmentedLagrangian
from lpc_mdo.optimization.certificate import LARGE
from lpc_mdo.optimization.optimizer import Optimizer, Outcome, Task
from lpc_mdo.optimization.restoration import RESTORED
from lpc_mdo.optimization.search import CONVERGED

RESTORATION = 12  # steps at most: elastic mode is faster from there


class SequentialQuadratic(AugmentedLagrangian):
    """One run."""

    def _begin(self) -> Outcome | None:
        if self.options.newton_iterations == 0 or self.stage == "penalty":
            return None
        if len(self.x) > LARGE:  # Newton's method comes when L-BFGS has found what is active
            return super()._begin()
        if self.stage == "restoration":
            restored = self.restored(RESTORED, RESTORATION)
            if not restored.is_near:
                return self._to_feasible("newton")
            self.settle(restored.x, "newton")
        return self.outcome("converged", CONVERGED) if self.polish() else None


def solve(task: Task) -> Outcome:
    return SequentialQuadratic(task).run()


OPTIMIZER = Optimizer("sqp", solve, keeps_checkpoints=True)
