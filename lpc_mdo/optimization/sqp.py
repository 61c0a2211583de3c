"""Sequential quadratic programming with exact second derivatives from the nearest point that is nearly feasible.

Where Newton's method stops short of an optimum, or no feasible point is near the start, the augmented Lagrangian goes on.
"""

from lpc_mdo.optimization.augmented_lagrangian import NEARLY_FEASIBLE, AugmentedLagrangian
from lpc_mdo.optimization.certificate import LARGE
from lpc_mdo.optimization.optimizer import Optimizer, Outcome, Task
from lpc_mdo.optimization.restoration import RESTORED

RESTORATION = 100  # steps at most


class SequentialQuadratic(AugmentedLagrangian):
    """One run."""

    def _begin(self) -> bool:
        if self.options.newton_iterations == 0 or self.stage == "penalty":
            return False
        if len(self.x) > LARGE:  # Newton's method comes when L-BFGS has found what is active
            return super()._begin()
        if self.stage == "restoration":
            start = self.x
            restored = self.restored(RESTORED, RESTORATION)
            if restored.violation > NEARLY_FEASIBLE:
                self.x, self.is_doubtful = start, True
                return False
            self.settle(restored.x, "newton")
        return self.polish()


def solve(task: Task) -> Outcome:
    return SequentialQuadratic(task).run()


OPTIMIZER = Optimizer("sqp", solve, keeps_checkpoints=True)
