"""Which discipline hands what to which: read off the autograd graph of one evaluation, not drawn by hand."""

from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

from torch import Tensor

from lpc_mdo.model.analysis import Analysis
from lpc_mdo.numerics.present import present
from lpc_mdo.problems.problem import Problem


@dataclass(frozen=True)
class DataFlow:
    """Blocks in the order of evaluation, and how many numbers each hands directly to which other: (from, to, count)."""

    blocks: tuple[str, ...]
    passes: tuple[tuple[str, str, int], ...]


def _blocks(problem: Problem[Analysis], analysis: Analysis) -> dict[str, Any]:
    """Outputs of every discipline, as they lie in Analysis, in the order of evaluation."""
    propulsion, energy = present(analysis.propulsion, "propulsion"), analysis.energy
    return {
        "design variables": analysis.design,
        "geometry": analysis.shape,
        "atmosphere and flight": analysis.flight,
        "motor sizing": propulsion.motors,
        "masses": analysis.weights,
        # What was solved, not the views of it that name every rotor: others take it from there.
        "rotors": analysis.rotors.solved_loads,
        "motor operation": (propulsion.solved_operation, propulsion.torque_share),
        "wing and tail": analysis.aerodynamics,
        "trim": (analysis.trim, analysis.scaled_trim),
        "noise": analysis.noise,
        "mission and battery": energy,
        "objective": problem.objective.of(analysis),
        "constraints": problem.rows(analysis),
    }


def data_flow(problem: Problem[Analysis]) -> DataFlow:
    """The direct hand-overs at the initial design: from each block's outputs back to the nearest outputs of others."""
    x = problem.x0.clone().requires_grad_(True)
    blocks = {name: list(_tensors(block)) for name, block in _blocks(problem, problem.analyze(x)).items()}
    owner: dict[Any, tuple[str, int]] = {}
    for name, tensors in blocks.items():
        for tensor in tensors:
            # What a block merely passes on stays its maker's.
            owner.setdefault(tensor.grad_fn, (name, tensor.numel()))
    passes = []
    for name, tensors in blocks.items():
        counts: dict[str, int] = {}
        for node in _nearest([tensor.grad_fn for tensor in tensors], owner, name):
            giver, count = owner[node]
            counts[giver] = counts.get(giver, 0) + count
        passes += [(giver, name, counts[giver]) for giver in blocks if giver in counts]
    return DataFlow(tuple(blocks), tuple(passes))


def _tensors(value: Any) -> Iterator[Tensor]:
    """Every tensor with a graph in dataclasses, lists and dictionaries."""
    if isinstance(value, Tensor):
        if value.grad_fn is not None:
            yield value
    elif is_dataclass(value):
        for field in fields(value):
            yield from _tensors(getattr(value, field.name))
    elif isinstance(value, dict | list | tuple):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _tensors(item)


def _nearest(start: list[Any], owner: dict[Any, tuple[str, int]], name: str) -> set[Any]:
    """Graph nodes owned by other blocks than `name` that are reached from `start` without passing through another."""
    found, seen, waiting = set(), set(), list(start)
    while waiting:
        node = waiting.pop()
        if node is None or node in seen:
            continue
        seen.add(node)
        if node in owner and owner[node][0] != name:
            found.add(node)
        else:
            waiting.extend(following for following, _ in node.next_functions)
    return found


def reach(flow: DataFlow) -> dict[str, set[str]]:
    """For every block, all blocks that depend on it, directly or through others."""
    direct = {name: {to for giver, to, _ in flow.passes if giver == name} for name in flow.blocks}
    for name in reversed(flow.blocks):
        for to in tuple(direct[name]):
            direct[name] |= direct[to]
    return direct
