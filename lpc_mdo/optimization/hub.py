"""Many problems that share one model: their solvers run side by side, and what they ask of the model is answered in batches.

A solver asks for two things: values at points, and gradients of weighted sums of those values. Alone, both are answered on the
spot. Here they are gathered: every solver stops where it asks; when all have stopped, one evaluation or one backward pass
serves them, and each goes on until it asks again. All else is the solver's own, be it ours or SciPy's: scales, restoration,
filter, multipliers, verdict, checkpoints, interruption. One problem alone needs no hub.

Each solver has a thread, but only one of them or the hub moves at any time: the threads serve as coroutines, and results
depend on what is asked alone, not on who is quick. Generators would do the same without threads, but each of some forty
helpers would have to pass requests on, and SciPy's L-BFGS-B, SLSQP and IPOPT, which call back, could not: they would have to be
written again. Ctrl-C reaches the main thread only; the hub passes it on to every solver, which then ends as it does alone.
"""

import contextvars
import threading
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from queue import SimpleQueue
from typing import Any, Generic, TypeVar, cast

import torch
from torch import Tensor

from lpc_mdo.optimization.evaluator import Evaluate
from lpc_mdo.optimization.requests import Answer, Batch, Begin, Remote, Reply, Request, Slopes, Values, count_points

SharedEvaluate = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
"""Points (b, n) and the problem (b,) of each, to objectives (b,) and constraints (b, m); every point alone."""

POINTS = 48  # evaluated at a time: more gain little, and cost memory
ResultT = TypeVar("ResultT")
RequestT = TypeVar("RequestT", Values, Slopes)


class Abandoned(BaseException):
    """The hub is gone: nobody waits for this problem's result any more."""


@dataclass(frozen=True)
class Ending(Generic[ResultT]):
    """How the work on a problem ended: with a result, or with an exception; its share of wall and processor time, s."""

    result: ResultT | None
    error: BaseException | None
    wall: float
    processor: float

    def unwrap(self) -> ResultT:
        """The result. Raises the exception that ended the work."""
        if self.error is not None:
            raise self.error
        return cast(ResultT, self.result)  # which may be None itself


@dataclass(eq=False)
class _Solver:
    """One problem's thread. `slot` holds its request while it waits and the reply until it moves on, then nothing.

    That one field decides, and every store to it is whole: an interruption, which may lose a word on the queues, loses nothing.
    """

    number: int
    slot: Request | Reply | None = field(default_factory=Begin)
    wake: "SimpleQueue[None]" = field(default_factory=SimpleQueue)
    is_over: bool = False
    result: Any = None
    error: BaseException | None = None
    wall: float = 0.0
    processor: float = 0.0

    @property
    def is_moving(self) -> bool:
        return not self.is_over and (self.slot is None or isinstance(self.slot, Reply))

    @property
    def ending(self) -> Ending[Any]:
        return Ending(self.result, self.error, self.wall, self.processor)


class Hub(Generic[ResultT]):
    """One run of k problems. `work` is called for each in a thread of its own, with the problem's number and `evaluate`."""

    def __init__(
        self,
        evaluate: SharedEvaluate,
        work: Callable[[int, Evaluate], ResultT],
        count: int,
        ended: Callable[[int, Ending[ResultT]], None] = lambda number, ending: None,
    ) -> None:
        """`ended` is told each ending as soon as it is there, in the thread that runs the hub."""
        self._evaluate, self._work, self._ended = evaluate, work, ended
        self._solvers = [_Solver(number) for number in range(count)]
        self._told: set[int] = set()
        self._interrupted: set[int] = set()  # who has not been told of it yet
        self._asked: SimpleQueue[None] = SimpleQueue()  # a word from whoever stops moving
        self._turns = 0

    def run(self) -> list[Ending[ResultT]]:
        """All endings. An interruption is passed on to every solver; an exception of `ended` gives all of them up."""
        for solver in self._solvers:
            live = partial(contextvars.copy_context().run, self._live, solver)
            threading.Thread(target=live, name=f"problem {solver.number}", daemon=True).start()
        try:
            while len(self._told) < len(self._solvers):
                try:
                    self._turn()
                except KeyboardInterrupt:
                    self._interrupted = {solver.number for solver in self._solvers if not solver.is_over}
        finally:
            self._dismiss()
        return [solver.ending for solver in self._solvers]

    def _turn(self) -> None:
        """With all solvers waiting: tell who is over, and serve one batch of requests."""
        for solver in self._solvers:
            self._settle(solver)
        for solver in self._solvers:
            if solver.is_over and solver.number not in self._told:
                self._told.add(solver.number)
                self._ended(solver.number, solver.ending)
        self._turns += 1
        waiting = [solver for solver in self._solvers if not solver.is_over]
        interrupted = [solver for solver in waiting if solver.number in self._interrupted]
        if interrupted:
            self._interrupted = set()
            self._reply((solver, KeyboardInterrupt()) for solver in interrupted)
        elif beginning := [solver for solver in waiting if isinstance(solver.slot, Begin)]:
            self._reply((solver, None) for solver in beginning)
        # Gradients first: whoever waits for one then meets the others again at the next point.
        elif slopes := [solver for solver in waiting if isinstance(solver.slot, Slopes)]:
            batches = [request.answer.batch for request in _asked(slopes, Slopes)]
            same = [solver for solver, batch in zip(slopes, batches, strict=True) if batch is batches[0]]
            self._serve(same, self._gradients)
        elif waiting:
            self._serve(_chosen(waiting), self._values)

    def _serve(self, solvers: list[_Solver], work: Callable[[list[_Solver]], list[Any]]) -> None:
        """Reply to all of them by one piece of work; its time is shared by points."""
        wall, processor = time.monotonic(), time.process_time()
        contents = work(solvers)
        wall, processor = time.monotonic() - wall, time.process_time() - processor
        counts = [count_points(s.slot) for s in solvers if isinstance(s.slot, Values | Slopes)]
        for solver, count in zip(solvers, counts, strict=True):
            solver.wall += wall * count / sum(counts)
            solver.processor += processor * count / sum(counts)
        self._reply(zip(solvers, contents, strict=True))

    def _reply(self, replies: Iterable[tuple[_Solver, Any]]) -> None:
        """Let solvers go on, one after the other."""
        for solver, content in replies:
            wall, processor = time.monotonic(), time.process_time()
            solver.slot = Reply(content)
            self._settle(solver)
            solver.wall += time.monotonic() - wall
            solver.processor += time.process_time() - processor

    def _settle(self, solver: _Solver) -> None:
        """Wait until the solver waits or is over."""
        while solver.is_moving:
            if isinstance(solver.slot, Reply):
                solver.wake.put(None)
            self._asked.get()

    def _dismiss(self) -> None:
        """End the threads that are still there."""
        for solver in self._solvers:
            while not solver.is_over:
                if not solver.is_moving:
                    solver.slot = Reply(Abandoned())
                self._settle(solver)

    def _values(self, solvers: list[_Solver]) -> list[Any]:
        """An Answer to each, from one evaluation; to those whose points fail, alone as well, the exception."""
        requests = _asked(solvers, Values)
        counts = [count_points(request) for request in requests]
        has_graph = any(request.has_graph for request in requests)
        points = torch.cat([request.points for request in requests]).requires_grad_(has_graph)
        which = torch.tensor([solver.number for solver in solvers]).repeat_interleave(torch.tensor(counts))
        try:
            with torch.set_grad_enabled(has_graph):
                objective, constraints = self._evaluate(points, which)
        except Exception as error:
            return [error] if len(solvers) == 1 else [self._values([solver])[0] for solver in solvers]
        batch = Batch(points, objective, constraints)
        parts = [part.detach().clone().split(counts) for part in (objective, constraints)]
        firsts = [sum(counts[:i]) for i in range(len(counts))]
        return [Answer(f, c, batch, first) for f, c, first in zip(*parts, firsts, strict=True)]

    def _gradients(self, solvers: list[_Solver]) -> list[Any]:
        """To each of them, who hold points of one batch, gradients (p, n), from one backward pass."""
        requests = _asked(solvers, Slopes)
        batch = requests[0].answer.batch
        weights = [torch.zeros_like(part) for part in (batch.objective, batch.constraints)]
        is_asked = [False, False]
        for request in requests:
            for i, given in enumerate((request.objective, request.constraints)):
                if given is not None:
                    weights[i][request.answer.place], is_asked[i] = given, True
        values = zip((batch.objective, batch.constraints), weights, is_asked, strict=True)
        pairs = [(value, weight) for value, weight, is_used in values if is_used and value.requires_grad]
        gradient = torch.zeros_like(batch.points)
        try:
            if pairs:
                outputs, parts = zip(*pairs, strict=True)
                (found,) = torch.autograd.grad(outputs, batch.points, parts, retain_graph=True, allow_unused=True)
                gradient = gradient if found is None else found
        except Exception as error:
            return [error] if len(solvers) == 1 else [self._gradients([solver])[0] for solver in solvers]
        return [gradient[request.answer.place] for request in requests]

    def _live(self, solver: _Solver) -> None:
        """A solver's thread."""
        try:
            self._wait(solver)
            solver.result = self._work(solver.number, partial(self._evaluated, solver))
        except BaseException as error:
            solver.error = error
        solver.is_over = True
        self._asked.put(None)

    def _wait(self, solver: _Solver) -> Any:
        """In a solver's thread: the content of the reply. Raises it where it is an exception."""
        while not isinstance(solver.slot, Reply):
            solver.wake.get()
        content = solver.slot.content
        solver.slot = None
        if isinstance(content, BaseException):
            raise content
        return content

    def _ask(self, solver: _Solver, request: Request) -> Any:
        solver.slot = request
        self._asked.put(None)
        return self._wait(solver)

    def _evaluated(self, solver: _Solver, points: Tensor) -> tuple[Tensor, Tensor]:
        """In a solver's thread: objectives (...,) and constraints (..., m) at points (..., n), differentiable once."""
        flat, ask = points.reshape(-1, points.shape[-1]), partial(self._ask, solver)
        if torch.is_grad_enabled() and flat.requires_grad:
            objective, constraints = Remote.apply(flat, ask, self._turns)  # type: ignore[no-untyped-call]  # torch leaves it so
        else:
            answer = ask(Values(flat.detach(), False, self._turns))
            objective, constraints = answer.objective, answer.constraints
        return objective.reshape(points.shape[:-1]), constraints.reshape(*points.shape[:-1], -1)


def _chosen(waiting: Sequence[_Solver]) -> list[_Solver]:
    """Who has waited longest for values, and all others whose points fit into the same evaluation."""
    chosen: list[_Solver] = []
    count = 0
    requests = zip(waiting, _asked(waiting, Values), strict=True)
    for solver, request in sorted(requests, key=lambda pair: pair[1].turn):
        if not chosen or count + count_points(request) <= POINTS:
            chosen.append(solver)
            count += count_points(request)
    return chosen


def _asked(solvers: Sequence[_Solver], kind: type[RequestT]) -> list[RequestT]:
    """Requests of solvers that all wait for this kind."""
    return [solver.slot for solver in solvers if isinstance(solver.slot, kind)]
