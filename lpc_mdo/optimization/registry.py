"""The optimizers by name. A new one is a file with an `Optimizer` in it, and its entry here."""

from lpc_mdo.optimization import augmented_lagrangian, ipopt, scipy_solvers, sqp
from lpc_mdo.optimization.optimizer import Optimizer

OPTIMIZERS: dict[str, Optimizer] = {
    optimizer.name: optimizer
    for optimizer in (
        augmented_lagrangian.OPTIMIZER,
        sqp.OPTIMIZER,
        scipy_solvers.SLSQP,
        scipy_solvers.TRUST_CONSTR,
        ipopt.OPTIMIZER,
    )
}
DEFAULT = augmented_lagrangian.OPTIMIZER.name
