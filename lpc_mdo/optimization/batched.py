"""Many problems at once: an augmented Lagrangian over L-BFGS and Newton's method, every problem with its own state.

The method is that of a single problem. What is shared is the model: one evaluation for the points that all problems ask for,
which costs little more than one for a single point. Multipliers, penalty, step lengths, memory, second derivatives and
certificate are each problem's own; a problem that is finished leaves the batch.
"""

import time
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.optimization import sqp
from lpc_mdo.optimization.batched_functions import BatchedFunctions, BatchEvaluate, Observe, scaled_functions
from lpc_mdo.optimization.batched_lbfgs import minimize_in_boxes
from lpc_mdo.optimization.batched_newton import refine_batch
from lpc_mdo.optimization.certificate import Certificate, certify
from lpc_mdo.optimization.evaluator import Counts, Evaluator, TimeLimit
from lpc_mdo.optimization.feasibility import infeasibility
from lpc_mdo.optimization.judge import fault_at
from lpc_mdo.optimization.optimizer import Task
from lpc_mdo.optimization.result import Hooks, OptimizationResult, Options, Progress, Status
from lpc_mdo.optimization.verdict import missing

LARGEST_MULTIPLIER, LARGEST_PENALTY = 1e6, 1e8
SUFFICIENT_DECREASE = 0.5  # of violation and complementarity, or the penalty grows tenfold
NEARLY_FEASIBLE, NEARLY_STATIONARY = 5e-2, 1e-2  # scaled: from here on Newton's method is tried
REFINED = 1e-2, 0.1  # of the tolerances: what Newton's method is asked for, since its last steps cost little
FIRST_TOLERANCE = 1e-2
HOPELESS = 1e2
"""The constants of the single solver, which say why (augmented_lagrangian.py)."""


@dataclass
class _Run:
    """State of all problems; the first dimension is the problem."""

    functions: BatchedFunctions
    x: Tensor  # (k, n)
    multipliers: Tensor  # (k, m)
    penalty: Tensor  # (k,)
    tolerance: Tensor  # (k,)
    last_progress: Tensor  # (k,)
    outer: np.ndarray  # (k,) counts
    inner: np.ndarray  # (k,)
    certificates: list[Certificate]
    status: list[Status]
    elapsed: list[float]  # s from the start until each was finished
    history: list[list[Progress]]


def minimize_batch(
    evaluate: BatchEvaluate,
    x0: Tensor,
    lower: Tensor,
    upper: Tensor,
    constraint_lower: Tensor,
    constraint_upper: Tensor,
    options: Options | None = None,
    observe: Observe = lambda which, objective, constraints: None,
) -> list[OptimizationResult]:
    """Minimize k objectives, each subject to its own m rows: evaluate(points (b, n), which (b,)) -> (b,), (b, m).

    x0, lower, upper (k, n); constraint_lower, constraint_upper (k, m). Statuses are those of a single problem, by the same
    certificate; unbounded problems end at the iteration limit, and one whose model fails at its start has "failed" without
    harm to the others. `observe` is told every design that a search looks at.
    Raises ValueError for crossed bounds.
    """
    if bool((lower > upper).any()) or bool((constraint_lower > constraint_upper).any()):
        raise ValueError("bounds are not allowed: a lower one lies above its upper one")
    options, started = options or Options(), time.monotonic()
    x = torch.maximum(torch.minimum(x0.detach().double(), upper), lower)
    limits = lower, upper, constraint_lower, constraint_upper
    is_sound = _sound_starts(evaluate, x, limits)
    if not is_sound.all():
        sound = torch.nonzero(is_sound).flatten()

        def evaluate_sound(points: Tensor, which: Tensor) -> tuple[Tensor, Tensor]:
            return evaluate(points, sound[which])

        def observe_sound(which: Tensor, objective: Tensor, constraints: Tensor) -> None:
            observe(sound[which], objective, constraints)

        others = [values[sound] for values in (x, *limits)]
        solved = iter(minimize_batch(evaluate_sound, *others, options, observe_sound) if len(sound) else [])
        return [
            next(solved) if is_fine else _not_begun(x[i], limits[2][i]) for i, is_fine in enumerate(is_sound.tolist())
        ]
    functions = scaled_functions(evaluate, x, lower, upper, constraint_lower, constraint_upper, observe)
    run = _begin(functions, x)
    active = torch.arange(len(x))
    for _ in range(options.outer_iterations):
        if len(active) == 0:
            break
        if time.monotonic() - started > options.time_limit:
            for i in active.tolist():
                run.status[i] = "time_limit"
            break
        _improve(run, active, options, started)
        _refine(run, active, options, started)
        tolerances = options.stationarity_tolerance, options.feasibility_tolerance
        finished = [i for i in active.tolist() if run.certificates[i].holds(*tolerances)]
        for i in finished:
            run.status[i], run.elapsed[i] = "converged", time.monotonic() - started
        active = active[~torch.isin(active, torch.tensor(finished, dtype=torch.long))]
    judged = [_judged(run, i, options, started) for i in range(len(x))]
    return [_result(run, i, *words) for i, words in enumerate(judged)]


def _sound_starts(evaluate: BatchEvaluate, x: Tensor, limits: tuple[Tensor, ...]) -> Tensor:
    """Mask (k,) of the starts at which values and first derivatives are finite."""
    ones = x.new_ones(len(x)), torch.ones_like(limits[2])
    at = BatchedFunctions(evaluate, *limits, *ones).derivatives(x, torch.arange(len(x)))
    parts = at.objective[:, None], at.constraints, at.gradient, at.jacobian.flatten(1)
    return torch.cat(parts, dim=1).isfinite().all(-1)


def _not_begun(x: Tensor, row: Tensor) -> OptimizationResult:
    """Of a problem whose model fails at its start x (n,); row: any of its m rows' length."""
    nothing = float("nan")
    return OptimizationResult(
        x=x.clone(),
        objective=nothing,
        constraints=torch.full_like(row, nothing),
        multipliers=torch.zeros_like(row),
        certificate=Certificate(nothing, nothing, nothing, -1, -1),
        status="failed",
        message="objective, constraints or their derivatives are not finite at the start",
        counts=Counts(evaluations=1),
        objective_scale=1.0,
        constraint_scale=np.ones(len(row)),
    )


def _judged(run: _Run, i: int, options: Options, started: float) -> tuple[Status, str]:
    """Status and message of problem i, by the verdict of a single problem."""
    certificate = run.certificates[i]
    tolerances = options.stationarity_tolerance, options.feasibility_tolerance
    status = run.status[i]
    if status == "time_limit":
        return status, f"the time limit of {options.time_limit:g} s was reached"
    evaluator = _alone(run.functions, i)
    evaluator.deadline = started + options.time_limit
    x, multipliers = run.x[i].numpy(), run.multipliers[i].numpy()
    try:
        if status == "converged":
            if fault_at(evaluator, x, multipliers, tolerances) is None:
                return "converged", "the certificate holds"
            return _go_on_alone(run, i, evaluator, options, started)
        if certificate.feasibility > HOPELESS * tolerances[1]:
            return infeasibility(evaluator, x, tolerances[1]) or (
                "iteration_limit",
                missing(certificate, tolerances).words,
            )
    except TimeLimit:
        return "time_limit", f"the time limit of {options.time_limit:g} s was reached"
    return status, missing(certificate, tolerances).words


def _go_on_alone(run: _Run, i: int, evaluator: Evaluator, options: Options, started: float) -> tuple[Status, str]:
    """The single solver from where the batch left problem i, whose gradients are small but which is no optimum yet."""
    left = options.time_limit - (time.monotonic() - started)
    task = Task(evaluator, run.x[i].numpy(), replace(options, time_limit=left), Hooks(), run.multipliers[i].numpy())
    outcome = sqp.solve(task)
    run.x[i], run.multipliers[i] = torch.from_numpy(outcome.x), torch.from_numpy(outcome.multipliers)
    run.functions.objective_scale[i] = evaluator.objective_scale
    run.functions.constraint_scale[i] = torch.from_numpy(evaluator.constraint_scale)
    run.certificates[i] = certify(evaluator, outcome.x, outcome.multipliers)
    run.functions.evaluations[i] += evaluator.counts.evaluations
    run.functions.gradients[i] += evaluator.counts.gradients
    done = len(run.history[i])
    run.history[i] += [replace(record, iteration=done + k) for k, record in enumerate(outcome.history[1:], 1)]
    return outcome.status, outcome.message


def _alone(functions: BatchedFunctions, i: int) -> Evaluator:
    """Problem i as a single one, with the scales that it has in the batch."""

    def evaluate(x: Tensor) -> tuple[Tensor, Tensor]:
        points = x.reshape(-1, x.shape[-1])
        objective, constraints = functions.evaluate(points, torch.full((len(points),), i))
        return objective.reshape(x.shape[:-1]), constraints.reshape(*x.shape[:-1], -1)

    limits = functions.lower, functions.upper, functions.constraint_lower, functions.constraint_upper
    scales = float(functions.objective_scale[i]), functions.constraint_scale[i].numpy()
    return Evaluator(evaluate, *(limit[i].numpy() for limit in limits), *scales, is_batched=True)


def _begin(functions: BatchedFunctions, x: Tensor) -> _Run:
    everyone = torch.arange(len(x))
    at = functions.derivatives(x, everyone)
    beyond = functions.violations(at.constraints, everyone)
    penalty = 10.0 * at.objective.abs().clamp(min=1.0) / (0.5 * (beyond**2).sum(-1)).clamp(min=1.0)
    multipliers = torch.zeros_like(at.constraints)
    counts = np.zeros(len(x), dtype=int)
    return _Run(
        functions=functions,
        x=x,
        multipliers=multipliers,
        penalty=penalty.clamp(1e-6, 10.0),
        tolerance=torch.full_like(penalty, FIRST_TOLERANCE),
        last_progress=torch.full_like(penalty, torch.inf),
        outer=counts,
        inner=counts.copy(),
        certificates=functions.certificates(x, everyone, multipliers, at),
        status=["iteration_limit"] * len(x),
        elapsed=[float("nan")] * len(x),
        history=[[] for _ in range(len(x))],
    )


def _improve(run: _Run, active: Tensor, options: Options, started: float) -> None:
    """One inner solve, new multipliers and penalties for the active problems (b,)."""
    functions = run.functions

    def function(x: Tensor, index: Tensor) -> tuple[Tensor, Tensor]:
        which = active[index]
        return functions.augmented(x, which, run.multipliers[which], run.penalty[which])[:2]

    lower, upper = functions.lower[active], functions.upper[active]
    x, steps = minimize_in_boxes(
        function, run.x[active], lower, upper, run.tolerance[active], 3 * options.inner_iterations
    )
    run.x[active] = x
    run.inner[active.numpy()] += steps.numpy()
    run.outer[active.numpy()] += 1
    at = functions.derivatives(x, active)
    old, penalty = run.multipliers[active], run.penalty[active]
    new = penalty[:, None] * functions.residual(at.constraints, active, old, penalty)
    run.multipliers[active] = new = new.clamp(-LARGEST_MULTIPLIER, LARGEST_MULTIPLIER)
    progress = (new - old).abs().amax(-1) / penalty if new.shape[1] else torch.zeros_like(penalty)
    is_slow = (progress > SUFFICIENT_DECREASE * run.last_progress[active]) & (
        progress > 0.1 * options.feasibility_tolerance
    )
    run.penalty[active] = torch.where(is_slow, (10.0 * penalty).clamp(max=LARGEST_PENALTY), penalty)
    run.last_progress[active] = progress
    run.tolerance[active] = (0.3 * run.tolerance[active]).clamp(min=0.3 * options.stationarity_tolerance)
    certificates = functions.certificates(x, active, new, at)
    for i, certificate, objective in zip(active.tolist(), certificates, at.objective.tolist(), strict=True):
        run.certificates[i] = certificate
        _record(run, i, "augmented Lagrangian", objective, certificate, started)


def _refine(run: _Run, active: Tensor, options: Options, started: float) -> None:
    """Newton's method for the active problems that are near enough; a point that it does not better stays."""
    near = [
        i
        for i in active.tolist()
        if run.certificates[i].stationarity <= NEARLY_STATIONARY and run.certificates[i].feasibility <= NEARLY_FEASIBLE
    ]
    if not near or options.newton_iterations == 0:
        return
    which = torch.tensor(near)
    tolerances = options.stationarity_tolerance, options.feasibility_tolerance
    asked = REFINED[0] * tolerances[0], REFINED[1] * tolerances[1]

    def report(i: int, objective: float, certificate: Certificate) -> None:
        _record(run, i, "Newton", objective, certificate, started)

    x, multipliers, certificates = refine_batch(
        run.functions, run.x[which], run.multipliers[which], which, asked, options.newton_iterations, report
    )
    for j, i in enumerate(near):
        if certificates[j].merit(*tolerances) < run.certificates[i].merit(*tolerances):
            run.x[i], run.multipliers[i], run.certificates[i] = x[j], multipliers[j], certificates[j]


def _record(run: _Run, i: int, phase: str, objective: float, certificate: Certificate, started: float) -> None:
    """One line of the problem's history; objective: scaled."""
    run.history[i].append(
        Progress(
            phase=phase,
            iteration=len(run.history[i]) + 1,
            objective=objective / float(run.functions.objective_scale[i]),
            violation=certificate.feasibility,
            worst_constraint=certificate.worst_constraint,
            stationarity=certificate.stationarity,
            penalty=float(run.penalty[i]),
            evaluations=int(run.functions.evaluations[i]),
            elapsed=time.monotonic() - started,
        )
    )


def _result(run: _Run, i: int, status: Status, message: str) -> OptimizationResult:
    functions, which = run.functions, torch.tensor([i])
    with torch.no_grad():
        objective, constraints = functions.values(run.x[i : i + 1], which)
    objective_scale, row_scale = float(functions.objective_scale[i]), functions.constraint_scale[i]
    return OptimizationResult(
        x=run.x[i].clone(),
        objective=float(objective) / objective_scale,
        constraints=constraints[0] / row_scale,
        multipliers=run.multipliers[i] * row_scale / objective_scale,
        certificate=run.certificates[i],
        status=status,
        message=message,
        counts=Counts(
            outer=int(run.outer[i]),
            inner=int(run.inner[i]),
            evaluations=int(functions.evaluations[i]),
            gradients=int(functions.gradients[i]),
        ),
        objective_scale=objective_scale,
        constraint_scale=row_scale.numpy().copy(),
        history=run.history[i],
    )
