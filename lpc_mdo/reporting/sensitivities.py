"""How the optimum answers to limits, active bounds and parameters: the envelope theorem at the end of a run.

At an optimum d f*/d p is the partial derivative of the Lagrangian f + multipliers . (c - limit) at fixed design: first
order, exact where the set of active constraints stays. Source: Nocedal and Wright, Numerical Optimization, ch. 12.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.analyzer import Analyzer, Model
from lpc_mdo.optimization import OptimizationResult
from lpc_mdo.problems.gross_weight import with_motors_that_hover
from lpc_mdo.problems.problem import Problem

AT_BOUND = 1e-9  # of half a variable's range
STEP = 1e-4  # relative, of central differences in parameters

PARAMETERS = (
    ("vehicle", ("battery", "specific_energy"), "battery specific energy"),
    ("vehicle", ("structure", "calibration_factor"), "structural mass factor"),
    ("vehicle", ("fixed_masses", "mass"), "fixed masses and payload"),
    ("vehicle", ("drag", "areas", "area"), "hub, rotor and gear drag areas"),
    ("vehicle", ("drag", "study", "area"), "drag area beside wing and tail"),
    ("vehicle", ("motors", "gear_ratio"), "gear ratio"),
    ("mission", ("reserve", "distance"), "reserve distance"),
    ("mission", ("reserve", "duration"), "reserve duration"),
    ("mission", ("requirements", "observer_distance"), "observer distance"),
    ("airfoil", ("drag",), "profile drag of the blades"),
)
"""Numbers of the vehicle and mission file, and of the airfoil, that move no shape; limits of constraints are entries of their
own. Those of the mission's segments are `SEGMENT_NUMBERS`."""

SEGMENT_NUMBERS = ("speed", "rate", "distance", "duration", "height")


@dataclass(frozen=True)
class Sensitivity:
    """Change of the optimal objective, in its unit, for one per cent more of `label`."""

    kind: str  # "limit", "bound" or "parameter"
    label: str
    per_percent: float


def sensitivities(problem: Problem[Analysis], result: OptimizationResult) -> list[Sensitivity]:
    """All that is known at the optimum of `result`; it means little unless that converged."""
    return [
        *_of_limits(problem, result.multipliers),
        *_of_bounds(problem, result.x, result.multipliers),
        *_of_parameters(problem, result.x, result.multipliers),
    ]


def _of_limits(problem: Problem[Any], multipliers: Tensor) -> list[Sensitivity]:
    entries = []
    for row, parts in zip(problem.constraints, multipliers.split(problem.row_sizes), strict=True):
        if row.kind == "equality":
            continue
        for limit, share in ((row.lower, parts.clamp(max=0.0)), (row.upper, parts.clamp(min=0.0))):
            if not math.isfinite(limit):  # a multiplier of the missing side is what the certificate left open
                continue
            change = -float(share.sum()) * problem.objective.scale / row.scale * 0.01 * limit
            if change:
                entries.append(Sensitivity("limit", f"limit of {row.name.replace('_', ' ')}", change))
    return entries


def _of_bounds(problem: Problem[Any], x: Tensor, multipliers: Tensor) -> list[Sensitivity]:
    """Bounds of a variable move together for all of its components that stand on them."""
    leaf = x.clone().requires_grad_(True)
    objective, constraints = problem.evaluate(leaf)
    (slope,) = torch.autograd.grad(objective + (multipliers * constraints).sum(), leaf)
    entries = []
    counts = [variable.count for variable in problem.variables]
    for variable, at, gradient in zip(problem.variables, x.split(counts), slope.split(counts), strict=True):
        lower, upper = variable.lower_tensor.flatten(), variable.upper_tensor.flatten()
        per_unit = gradient * problem.objective.scale * 2.0 / (upper - lower)
        for side, bound, is_there in (
            ("least", lower, at <= -1.0 + AT_BOUND),
            ("largest", upper, at >= 1.0 - AT_BOUND),
        ):
            if bool(is_there.any()):
                change = 0.01 * float((per_unit * bound)[is_there].sum())
                entries.append(Sensitivity("bound", f"{side} {variable.name.replace('_', ' ')}", change))
    return entries


def _of_parameters(problem: Problem[Analysis], x: Tensor, multipliers: Tensor) -> list[Sensitivity]:
    def lagrangian(file: str, path: tuple[str, ...], factor: float) -> float:
        changed = replace(problem, analyze_design=scaled_analyzer(problem.analyze_design, file, path, factor))
        changed = with_motors_that_hover(changed)  # their bounds follow from the aircraft
        with torch.no_grad():
            objective, constraints = changed.evaluate(x)
        return float(objective + (multipliers * constraints).sum()) * problem.objective.scale

    return [
        Sensitivity(
            "parameter",
            label,
            (lagrangian(file, path, 1.0 + STEP) - lagrangian(file, path, 1.0 - STEP)) / (2.0 * STEP) * 0.01,
        )
        for file, path, label in parameters(problem)
    ]


def parameters(problem: Problem[Analysis]) -> list[tuple[str, tuple[str, ...], str]]:
    """Those that the problem has: numbers that its files give and no design variable takes over."""
    variables = {variable.name for variable in problem.variables}
    mission, drag = problem.analyze_design.mission, problem.analyze_design.vehicle.drag
    idle = ("drag", "areas" if drag.source == "study" else "study")
    of_segments = [
        ("mission", ("segments", segment.name, number), f"{segment.name} {number}".replace("_", " "))
        for segment in mission.segments
        for number in SEGMENT_NUMBERS
        if isinstance(getattr(segment, number, None), float) and f"{segment.name}_{number}" not in variables
    ]

    def is_there(file: str, path: tuple[str, ...]) -> bool:
        return path[:2] != idle and (file != "mission" or _at(mission, path) is not None)

    return [*(entry for entry in PARAMETERS if is_there(*entry[:2])), *of_segments]


def _at(node: Any, path: tuple[str, ...]) -> Any:
    return _at(getattr(node, path[0]), path[1:]) if path else node


def scaled_analyzer(analyzer: Model, file: str, path: tuple[str, ...], factor: float) -> Analyzer:
    """The analyzer with the number at `path` of one of its files multiplied."""
    is_mirrored = analyzer.schedule.is_mirrored
    if file == "airfoil":
        # The same object for blades alike, which are solved together.
        thicker = {id(polar): polar.with_drag(factor) for polar in analyzer.rotors.polars}
        polars = [thicker[id(polar)] for polar in analyzer.rotors.polars]
        return Analyzer(analyzer.vehicle, analyzer.mission, analyzer.geometry, polars, is_mirrored=is_mirrored)
    vehicle, mission = analyzer.vehicle, analyzer.mission
    if file == "vehicle":
        vehicle = scaled(vehicle, path, factor)
    else:
        mission = scaled(mission, path, factor)
    return Analyzer(vehicle, mission, analyzer.geometry, analyzer.rotors.polars, is_mirrored=is_mirrored)


def scaled(node: Any, path: tuple[str, ...], factor: float) -> Any:
    """A copy of a vehicle or mission in which the number at `path` is multiplied; in a list of tables, that of each, or of the one
    that `path` names."""
    head, rest = path[0], path[1:]
    if isinstance(node, tuple) and any(getattr(item, "name", None) == head for item in node):
        return tuple(scaled(item, rest, factor) if item.name == head else item for item in node)
    if isinstance(node, tuple):
        return tuple(scaled(item, path, factor) for item in node)
    child = getattr(node, head)
    return node.model_copy(update={head: scaled(child, rest, factor) if rest else child * factor})
