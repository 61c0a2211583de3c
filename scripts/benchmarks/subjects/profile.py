"""Where an evaluation with gradient spends its time, forward and backward, by discipline and by operator."""

from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from torch.autograd.profiler_util import FunctionEvent
from torch.profiler import ProfilerActivity, profile, record_function

import lpc_mdo
from benchmarks.subject import Task
from benchmarks.subjects.model import gradient
from lpc_mdo.geometry.shape import Geometry
from lpc_mdo.model import aerodynamics, energy, flight, noise, propulsion, rotors, trim, weights
from lpc_mdo.model.parasitic_drag import ParasiticDrag
from lpc_mdo.surrogates.structural_mass import StructuralMassSurrogate

FUNCTIONS = {
    (rotors, "rotor_loads"): "rotors",
    (rotors, "inclined"): "rotors",
    (propulsion, "size_motor"): "motors",
    (propulsion, "operate_motor"): "motors",
    (propulsion, "maximum_torque"): "motors",
    (aerodynamics, "vortex_lattice"): "vortex lattice",
    (noise, "heard_in_hover"): "noise",
    (flight, "standard_atmosphere"): "atmosphere",
    (weights, "combine"): "masses",
    (trim, "trim_residual"): "trim",
    (energy, "energy_state_of_charge"): "battery",
    (Geometry, "__call__"): "geometry",
    (ParasiticDrag, "areas"): "parasitic drag",
    (ParasiticDrag, "points"): "parasitic drag",
    (StructuralMassSurrogate, "guarded"): "masses",
}
REST = "variables, rows, joining"
DISCIPLINES = tuple(dict.fromkeys([*FUNCTIONS.values(), REST]))
TOP = 20
BACKWARD = "autograd::engine::evaluate_function: "


def prepare(repetitions: int = 5) -> Task:
    """run: one evaluation with gradient; check: {"disciplines": {name: {...}}, "operators": [[name, calls, s], ...]}.

    Of several profiled evaluations the quickest counts: the profiler's clock runs on while other processes have their turn.
    """
    problem = lpc_mdo.gross_weight_problem(*lpc_mdo.baseline())

    def run() -> object:
        return gradient(problem, problem.x0)

    def check() -> dict[str, Any]:
        run()
        records = []
        for _ in range(repetitions):
            with _labels(), profile(activities=[ProfilerActivity.CPU]) as recorded:
                run()
            records.append(list(recorded.events()))
        quickest = min(records, key=lambda events: sum(event.self_cpu_time_total for event in events))
        return {"disciplines": _by_discipline(quickest), "operators": _by_operator(quickest)}

    return Task(run, check)


@contextmanager
def _labels() -> Iterator[None]:
    """Let the profiler see which discipline it is in."""
    replaced = [(owner, name, getattr(owner, name), label) for (owner, name), label in FUNCTIONS.items()]
    try:
        for owner, name, function, label in replaced:
            setattr(owner, name, _labelled(function, label))
        yield
    finally:
        for owner, name, function, _ in replaced:
            setattr(owner, name, function)


def _labelled(function: Callable, label: str) -> Callable:
    def call(*args: Any, **kwargs: Any) -> Any:
        with record_function(label):
            return function(*args, **kwargs)

    return call


def _by_discipline(events: list[FunctionEvent]) -> dict[str, dict[str, float]]:
    """Time (s) and ATen calls, those inside others included, of one evaluation, forward and backward.

    A step of the backward pass belongs to the discipline whose operator has the same sequence number.
    """
    totals = {label: defaultdict(float) for label in DISCIPLINES}
    owner: dict[int, str] = {}
    steps = []
    for event in events:
        line = _ancestors(event)
        step = next((e for e in line if e.name.startswith(BACKWARD)), None)
        if step is not None:
            steps.append((event, step))
            continue
        label = next((e.name for e in line if e.name in totals), REST)
        if event.sequence_nr >= 0:
            owner[event.sequence_nr] = label
        _add(totals[label], "forward", event)
    for event, step in steps:
        _add(totals[owner.get(step.sequence_nr, REST)], "backward", event)
    return {label: dict(total) for label, total in totals.items()}


def _ancestors(event: FunctionEvent) -> list[FunctionEvent]:
    """The event and all that it lies in, innermost first."""
    line = [event]
    while line[-1].cpu_parent is not None:
        line.append(line[-1].cpu_parent)
    return line


def _add(total: dict[str, float], phase: str, event: FunctionEvent) -> None:
    total[f"{phase}_s"] += 1e-6 * event.self_cpu_time_total
    total[f"{phase}_calls"] += event.name.startswith("aten::")


def _by_operator(events: list[FunctionEvent]) -> list[list]:
    """Operators by time spent in themselves: name, calls, s."""
    totals: dict[str, list[float]] = defaultdict(lambda: [0, 0.0])
    for event in events:
        if event.name.startswith("aten::"):
            totals[event.name][0] += 1
            totals[event.name][1] += 1e-6 * event.self_cpu_time_total
    return sorted(([name, *total] for name, total in totals.items()), key=lambda row: -row[2])[:TOP]
