"""`lpc-mdo check`: does this installation load its inputs and surrogates, and are the model's gradients exact here?"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from rich.table import Table
from rich.text import Text
from torch import Tensor

from lpc_mdo.config import load
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.reporting.terminal import terminal
from lpc_mdo.surrogates.airfoil import load_airfoil
from lpc_mdo.surrogates.structural_mass import load_structural_mass

STEP = 1e-4  # of a variable's half range: at 1e-3 truncation reaches 5e-5 in the charge over the pusher's speed
GRADIENT_TOLERANCE = 1e-6  # relative to one plus the derivative; truncation and rounding of the differences stay below


@dataclass(frozen=True)
class Check:
    """One row of the table; `finding` is a figure or what went wrong."""

    name: str
    is_passed: bool
    finding: str


@one_thread()
def run_checks(is_every_gradient: bool = False) -> int:
    """Print one row a check; returns the exit code: 0 if all passed, 1 otherwise."""
    checks = _loading()
    if all(check.is_passed for check in checks):
        problem = gross_weight_problem(*load())
        checks.append(_attempt("design at the start", lambda: _start(problem)))
        if checks[-1].is_passed:
            checks += _gradients(problem, is_every_gradient)
    table = Table("check", "", "finding")
    for check in checks:
        table.add_row(check.name, _verdict(check), check.finding)
    terminal().print(table)
    return 0 if all(check.is_passed for check in checks) else 1


def _verdict(check: Check) -> Text:
    return Text("pass", "green") if check.is_passed else Text("FAIL", "red")


def _attempt(name: str, action: Callable[[], str]) -> Check:
    try:
        return Check(name, True, action())
    except Exception as error:  # whatever it is, the user wants to see it in its row
        return Check(name, False, f"{type(error).__name__}: {error}")


def _loading() -> list[Check]:
    def inputs() -> str:
        vehicle, mission = load()
        return f"{len(vehicle.rotors)} rotors, {mission.flights} flights of {', '.join(mission.flown)}"

    return [
        _attempt("vehicle and mission", inputs),
        _attempt("airfoil surrogate", lambda: f"naca4412, sha256 {load_airfoil('naca4412').sha256[:12]}"),
        *(
            _attempt(
                f"structural mass, {source}", lambda source=source: f"sha256 {load_structural_mass(source).sha256[:12]}"
            )
            for source in ("published", "open")
        ),
    ]


def _start(problem: Problem[Analysis]) -> str:
    with torch.no_grad():
        objective, constraints = problem.evaluate(problem.x0)
    if not bool(objective.isfinite() & constraints.isfinite().all()):
        raise ValueError("objective or constraints are not finite")
    return f"{problem.objective.name} {float(objective) * problem.objective.scale:.1f} {problem.objective.unit}"


def _gradients(problem: Problem[Analysis], is_every_gradient: bool) -> list[Check]:
    """Derivatives of the objective and of every constraint, along one random direction or along every variable."""
    size = problem.size
    if is_every_gradient:
        directions = torch.eye(size, dtype=torch.float64)
    else:
        seeded = torch.Generator().manual_seed(0)
        directions = 2.0 * torch.rand(1, size, generator=seeded, dtype=torch.float64) - 1.0
    exact, differences = directional_derivatives(problem, directions)
    error = ((exact - differences).abs() / (1.0 + differences.abs())).amax(-1)
    names = [f"gradient: {name}" for name in (problem.objective.name, *(row.name for row in problem.constraints))]
    worst = [float(part.max()) for part in error.split([1, *problem.row_sizes])]
    return [
        Check(name, value < GRADIENT_TOLERANCE, f"error {value:.0e}, limit {GRADIENT_TOLERANCE:.0e}")
        for name, value in zip(names, worst, strict=True)
    ]


def directional_derivatives(problem: Problem[Analysis], directions: Tensor) -> tuple[Tensor, Tensor]:
    """Of objective and constraints at the start, along directions (direction, n): exact and by differences, each
    (1 + m, direction)."""
    x0 = problem.x0
    exact = torch.autograd.functional.jacobian(lambda x: _values(problem, x), x0) @ directions.T
    return exact, torch.stack([_central_difference(problem, x0, direction) for direction in directions], dim=-1)


def _values(problem: Problem[Analysis], x: Tensor) -> Tensor:
    """Objective, then constraints (..., 1 + m), scaled."""
    objective, constraints = problem.evaluate(x)
    return torch.cat([objective[..., None], constraints], dim=-1)


def _central_difference(problem: Problem[Analysis], x: Tensor, direction: Tensor) -> Tensor:
    """Fourth-order directional derivative (1 + m,)."""
    steps = STEP * torch.tensor([2.0, 1.0, -1.0, -2.0], dtype=torch.float64)
    with torch.no_grad():
        far, near, near_back, far_back = _values(problem, x + steps[:, None] * direction)
    return (8.0 * (near - near_back) - (far - far_back)) / (12.0 * STEP)
