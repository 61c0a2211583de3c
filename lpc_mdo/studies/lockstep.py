"""Several solvers on problems that share one analysis: they run side by side, and their evaluations go in one batch.

A batch of designs costs much less than its designs one by one, since small tensors spend their time in overhead. Each
solver runs in a thread of its own and waits whenever it asks for values or a gradient; when all that still run are
waiting, their requests are answered together. Gradients go first: solvers that fell out of step meet again at the next
request for values.
"""

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from dataclasses import dataclass, field
from typing import Any, TypeVar

import torch
from torch import Tensor

from lpc_mdo.optimization.evaluator import Evaluate
from lpc_mdo.problems.problem import Problem

ResultT = TypeVar("ResultT")


@dataclass
class _Batch:
    """One evaluated stack of designs with its graph; rows[i] belongs to solver i."""

    x: Tensor
    values: dict[int, tuple[Tensor, Tensor]]  # objective (), constraints (m,)
    rows: dict[int, int]


@dataclass
class _Request:
    answer: Future = field(default_factory=Future)
    x: Tensor | None = None
    batch: _Batch | None = None
    weights: tuple[Tensor, Tensor] | None = None


class _Meeting:
    """Collects requests of solvers that run, and answers them when all wait."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = problems
        self.running = set(range(len(problems)))
        self.waiting: dict[int, _Request] = {}
        self.changed = threading.Condition()
        self.is_stopped = False

    def ask(self, solver: int, request: _Request) -> Any:
        with self.changed:
            if self.is_stopped:
                raise KeyboardInterrupt
            self.waiting[solver] = request
            self.changed.notify()
        return request.answer.result()

    def stop(self) -> None:
        """Interrupt every solver at its present or next request."""
        with self.changed:
            self.is_stopped = True
            for request in self.waiting.values():
                request.answer.set_exception(KeyboardInterrupt())
            self.waiting.clear()

    def leave(self, solver: int) -> None:
        with self.changed:
            self.running.discard(solver)
            self.changed.notify()

    def serve(self) -> None:
        """Answer until the last solver has left."""
        while True:
            with self.changed:
                self.changed.wait_for(lambda: self.waiting.keys() == self.running)
                if not self.running:
                    return
                gradients = {i: r for i, r in self.waiting.items() if r.batch is not None}
                served = gradients or dict(self.waiting)
                for solver in served:
                    del self.waiting[solver]
            answer = self._gradients if gradients else self._values
            answer(dict(sorted(served.items())))

    def _values(self, requests: dict[int, _Request]) -> None:
        try:
            batch = _evaluate({i: self.problems[i] for i in requests}, {i: r.x for i, r in requests.items()})
        except Exception as error:
            if len(requests) == 1:
                next(iter(requests.values())).answer.set_exception(error)
                return
            for solver, request in requests.items():  # the one that fails must not fail the others
                self._values({solver: request})
            return
        for request in requests.values():
            request.answer.set_result(batch)

    def _gradients(self, requests: dict[int, _Request]) -> None:
        batches = {id(request.batch): request.batch for request in requests.values()}
        for key, batch in batches.items():
            together = {i: r for i, r in requests.items() if id(r.batch) == key}
            try:
                total = torch.zeros((), dtype=torch.float64)
                for solver, request in together.items():
                    objective, constraints = batch.values[solver]
                    on_objective, on_constraints = request.weights
                    total = total + objective * on_objective + (constraints * on_constraints).sum()
                (gradient,) = torch.autograd.grad(total, batch.x, retain_graph=True)
            except Exception as error:
                for request in together.values():
                    request.answer.set_exception(error)
                continue
            for solver, request in together.items():
                request.answer.set_result(gradient[batch.rows[solver]].clone())


def _evaluate(problems: dict[int, Problem], designs: dict[int, Tensor]) -> _Batch:
    """All designs in one analysis; every problem reads its own row."""
    x = torch.stack(list(designs.values())).requires_grad_()
    analysis = next(iter(problems.values())).analyze(x)
    rows = {solver: row for row, solver in enumerate(problems)}
    values = {}
    for solver, problem in problems.items():
        objective, constraints = problem.scaled_values(analysis)
        values[solver] = (objective[rows[solver]], constraints[rows[solver]])
    return _Batch(x, values, rows)


class _Together(torch.autograd.Function):
    """Values and gradient of one solver's design, computed with those of the others."""

    @staticmethod
    def forward(ctx: Any, x: Tensor, meeting: _Meeting, solver: int) -> tuple[Tensor, Tensor]:
        ctx.meeting, ctx.solver = meeting, solver
        ctx.batch = meeting.ask(solver, _Request(x=x.detach().clone()))
        objective, constraints = ctx.batch.values[solver]
        return objective.detach().clone(), constraints.detach().clone()

    @staticmethod
    def backward(ctx: Any, on_objective: Tensor, on_constraints: Tensor) -> tuple[Tensor, None, None]:
        request = _Request(batch=ctx.batch, weights=(on_objective, on_constraints))
        return ctx.meeting.ask(ctx.solver, request), None, None


def run_in_lockstep(
    problems: Sequence[Problem],
    solve: Callable[[int, Evaluate], ResultT],
    land: Callable[[int, ResultT | Exception], None],
) -> None:
    """Run solve(i, evaluate_i) for every problem i; land(i, its result or the exception) as they finish.

    All problems must have the same variables and the same `analyze_design`; evaluate_i(x) returns what
    problems[i].evaluate(x) would. Raises ValueError if they differ.
    """
    if any(p.analyze_design is not problems[0].analyze_design or p.size != problems[0].size for p in problems):
        raise ValueError("problems are not allowed to run in lockstep; they must share variables and analyze_design")
    meeting = _Meeting(problems)

    def run(solver: int) -> ResultT:
        def evaluate(x: Tensor) -> tuple[Tensor, Tensor]:
            # A solver's own batch, asked for second derivatives, is large enough to go alone.
            return _Together.apply(x, meeting, solver) if x.dim() == 1 else problems[solver].evaluate(x)

        try:
            return solve(solver, evaluate)
        finally:
            meeting.leave(solver)

    with ThreadPoolExecutor(len(problems) + 1) as pool:
        server = pool.submit(meeting.serve)
        futures = {pool.submit(run, i): i for i in range(len(problems))}
        try:
            for future in as_completed(futures):
                error = future.exception()
                if error is not None and not isinstance(error, Exception):
                    raise error
                land(futures[future], future.result() if error is None else error)
        except BaseException:
            meeting.stop()
            raise
        server.result()
