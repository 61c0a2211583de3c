"""A new constraint in ten lines: no lift motor may be asked for more torque than it has, which the published problem
leaves out. A row reads any output of the analysis; gradient, multiplier, certificate and report follow."""

from dataclasses import replace

import torch

import lpc_mdo
from lpc_mdo.problems.problem import Constraint

published = lpc_mdo.gross_weight_problem(*lpc_mdo.baseline())
lift_motor_torque = Constraint(
    "lift_motor_torque",
    unit="1",
    of=lambda analysis: analysis.propulsion.torque_share[..., :8],
    upper=1.0,
    scale=0.3,
)
problem = replace(published, constraints=(*published.constraints, lift_motor_torque))

# lpc_mdo.optimize(problem, output="runs/mine", progress=True) solves it, with folder and report. Here is what a solver sees of the new row at the start:
x = problem.x0.requires_grad_(True)
objective, constraints = problem.evaluate(x)
shares = constraints[-8:] * lift_motor_torque.scale
(gradient,) = torch.autograd.grad(shares[0], x)

if __name__ == "__main__":
    print(
        f"{len(problem.constraints)} rows; torque shares at the start {[round(share, 3) for share in shares.tolist()]}"
    )
    steepest = int(gradient.abs().argmax())
    print(f"the first depends most on {problem.variable_label(steepest)}")
