"""What a run checks of its own model at its own optimum: exact derivatives and balances that no approximation may break."""

from typing import Any

import torch
from torch import Tensor

from lpc_mdo.disciplines.battery import BatteryState
from lpc_mdo.model.analysis import Analysis, is_whole_aircraft
from lpc_mdo.numerics.present import present
from lpc_mdo.problems.problem import Problem

STEP = 1e-4  # of a variable's half range, of a fourth-order difference: truncation and rounding are both below 1e-8
DERIVATIVE_LIMIT = 1e-6  # relative to one plus the derivative
ROUNDING_LIMIT = 1e-9  # relative, of sums over many terms


def own_checks(problem: Problem[Any], x: Tensor) -> list[dict[str, Any]]:
    """Rows {name, error, limit, is_met} at the scaled design x (n,); errors are relative."""
    found = {
        "derivatives of objective and rows, against differences": (_derivative_error(problem, x), DERIVATIVE_LIMIT)
    }
    with torch.no_grad():
        analysis = problem.analyze(x)
    if is_whole_aircraft(analysis):
        found |= {name: (error, ROUNDING_LIMIT) for name, error in _balances(analysis).items()}
    return [
        {"name": name, "error": error, "limit": limit, "is_met": error <= limit}
        for name, (error, limit) in found.items()
    ]


def _derivative_error(problem: Problem[Any], x: Tensor) -> float:
    """Of a random combination of objective and rows, along a random direction; seeded."""
    seeded = torch.Generator().manual_seed(0)
    weights, direction = (
        2.0 * torch.rand(size, generator=seeded, dtype=torch.float64) - 1.0
        for size in (1 + sum(problem.row_sizes), problem.size)
    )

    def combination(x: Tensor) -> Tensor:
        objective, rows = problem.evaluate(x)
        return torch.cat([objective[..., None], rows], dim=-1) @ weights

    leaf = x.detach().clone().requires_grad_(True)
    (gradient,) = torch.autograd.grad(combination(leaf), leaf)
    steps = STEP * torch.tensor([2.0, 1.0, -1.0, -2.0], dtype=torch.float64)
    with torch.no_grad():
        far, near, near_back, far_back = (combination(x + step * direction) for step in steps)
    difference = (8.0 * (near - near_back) - (far - far_back)) / (12.0 * STEP)
    return float((gradient @ direction - difference).abs() / (1.0 + difference.abs()))


def _balances(analysis: Analysis) -> dict[str, float]:
    propulsion, energy = present(analysis.propulsion, "propulsion"), present(analysis.energy, "energy")
    battery = analysis.vehicle.battery
    operation, shaft = propulsion.operation, propulsion.loads.power / analysis.vehicle.motors.gear_efficiency
    errors = {
        "sum of mass groups, against gross mass": _relative(
            torch.stack(list(analysis.weights.groups.values())).sum(0), analysis.gross_mass
        ),
        "motor output, against rotor power": _relative(operation.output_power, shaft),
    }
    if isinstance(energy.battery, BatteryState):
        schedule, mission = analysis.schedule, analysis.mission
        drawn = energy.power[schedule.flown[-1]] * energy.reserve_duration
        for name in mission.flown * mission.flights:
            i = schedule.segment_index(name)
            drawn = drawn + energy.power[i] * energy.duration[i]
        stored = analysis.design.battery_mass * battery.specific_energy * battery.discharge_efficiency
        errors["energy drawn, against the battery's loss of charge"] = _relative(
            drawn, stored * (1.0 - energy.battery.final_state_of_charge)
        )
    return errors


def _relative(value: Tensor, expected: Tensor) -> float:
    return float(((value - expected) / expected).abs().max())
