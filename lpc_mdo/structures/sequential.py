"""Sequential convex programming for structural sizing, batched over independent problems.

minimize f(x) subject to c(x) <= 0 and bounds, where x are logarithms of gauges and f = constant + sum of a_i exp(x_i): a mass.
Its Hessian is then diag(df/dx), known without further work, and logarithms of stress shares are nearly linear in x; so
each step minimizes the exact second-order model of f under linearized constraints within a trust region.

Why not the solver of `lpc_mdo.optimization`: here the whole batch is one tensor, from the rows' derivatives, in forward mode, to
the quadratic programs, of up to ROWS rows each. A hub would gather the evaluations, but every problem would solve its programs
alone and ask for the derivatives of its rows one copy of the design at a time.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.structures.quadratic import QuadraticProgram, solve_quadratic

# evaluate(x (k, variable), which (k,)): objective (k,) and rows (k, row) of the problems numbered `which`.
Evaluate = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]

ROWS = 400  # nearest to their limit, that a step sees; all rows are checked
RADIUS, LARGEST_RADIUS = 0.3, 1.5  # first and largest trust region, in the logarithm
PART = 32  # problems that are differentiated together: memory against the cost of many small operations
PENALTY = 3.0  # of the elastic variable and in the merit function; f is scaled to one
ITERATIONS, RESTART = 60, 8
DIFFERENCE = 1e-4  # in the logarithm, for second derivatives
CURVATURE = 1e-6  # smallest of the model
STATIONARITY, FEASIBILITY = 1e-6, 1e-8


@dataclass(frozen=True)
class Bounds:
    """lower and upper, each (variable,)."""

    lower: Tensor
    upper: Tensor


@dataclass(frozen=True)
class Optimum:
    """x (batch, variable); objective (batch,); rows (batch, row); multipliers (batch, row) of f/f0 + multipliers . c with f0
    the value of f; iterations (batch,); stationarity, violation and complementarity (batch,): infinity norms, the first of
    x - P(x - gradient of the Lagrangian) with P the projection on the bounds."""

    x: Tensor
    objective: Tensor
    rows: Tensor
    multipliers: Tensor
    stationarity: Tensor
    violation: Tensor
    complementarity: Tensor
    iterations: Tensor

    @property
    def error(self) -> Tensor:
        """(batch,) largest norm over its tolerance."""
        stationary = torch.maximum(self.stationarity, self.complementarity) / STATIONARITY
        return torch.maximum(stationary, self.violation / FEASIBILITY)

    @property
    def is_certified(self) -> Tensor:
        """(batch,) bool."""
        return self.error <= 1.0


@dataclass(frozen=True)
class Point:
    """objective (batch,), its gradient (batch, variable), rows (batch, row) and jacobian (batch, row, variable)."""

    objective: Tensor
    gradient: Tensor
    rows: Tensor
    jacobian: Tensor

    def take(self, which: Tensor) -> "Point":
        return Point(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    def put(self, which: Tensor, other: "Point") -> None:
        """Replace some problems' values in place."""
        for name in self.__dataclass_fields__:
            getattr(self, name)[which] = getattr(other, name)

    def merit(self, scale: Tensor) -> Tensor:
        """Exact penalty function (batch,)."""
        return self.objective / scale + PENALTY * self.rows.amax(-1).clamp(min=0.0)


def values_and_jacobian(evaluate: Evaluate, x: Tensor, which: Tensor) -> Point:
    """Values and derivatives in forward mode, in parts small enough for the processor's caches."""
    points = []
    for part in torch.arange(len(x)).split(PART):
        here, index = x[part], which[part]
        directions = torch.eye(x.shape[-1], dtype=x.dtype)[:, None, :].expand(-1, *here.shape)
        tangents: Any = torch.func.vmap(
            lambda v, here=here, index=index: torch.func.jvp(lambda y: evaluate(y, index), (here,), (v,)),
            out_dims=((None, None), (0, 0)),  # type: ignore[arg-type]  # torch takes trees, its annotation does not
        )(directions)
        (f, c), (df, dc) = tangents
        points.append((f, df.movedim(0, -1), c, dc.movedim(0, -1)))
    return Point(*(torch.cat(parts) for parts in zip(*points, strict=True)))


def _step(x: Tensor, radius: Tensor, at: Point, hessian: Tensor, bounds: Bounds) -> tuple[Tensor, Tensor]:
    """Step (batch, variable) and multipliers (batch, row) of the convex model; an elastic variable keeps it feasible."""
    nearest = at.rows.topk(min(ROWS, at.rows.shape[-1]), dim=-1).indices
    rows = torch.gather(at.jacobian, 1, nearest[..., None].expand(-1, -1, x.shape[-1]))
    slope = at.gradient / at.objective[:, None]
    elastic = torch.ones_like(x[:, :1])
    program = QuadraticProgram(
        hessian=torch.nn.functional.pad(hessian, (0, 1, 0, 1))
        + torch.diag_embed(torch.cat([0.0 * slope, elastic], -1)),
        slope=torch.cat([slope, PENALTY * elastic], dim=-1),
        rows=torch.cat([rows, -torch.ones_like(rows[..., :1])], dim=-1),
        limit=-torch.gather(at.rows, 1, nearest),
        lower=torch.cat([torch.maximum(bounds.lower - x, -radius), 0.0 * elastic], dim=-1),
        upper=torch.cat([torch.minimum(bounds.upper - x, radius), 10.0 * elastic], dim=-1),
    )
    z, dual = solve_quadratic(program)
    return z[:, :-1], torch.zeros_like(at.rows).scatter(1, nearest, dual)


def _initial_hessian(at: Point) -> Tensor:
    """Hessian of a mass over itself, which is the diagonal of its gradient."""
    return torch.diag_embed((at.gradient / at.objective[:, None]).clamp(min=1e-6))


def _updated_hessian(hessian: Tensor, step: Tensor, old: Point, new: Point, multipliers: Tensor) -> Tensor:
    """Damped BFGS update for the Lagrangian. Source: Nocedal and Wright (2006), procedure 18.2."""

    def slope(at: Point) -> Tensor:
        return at.gradient / old.objective[:, None] + torch.einsum("bmn,bm->bn", at.jacobian, multipliers)

    change = slope(new) - slope(old)
    image = torch.einsum("bij,bj->bi", hessian, step)
    energy, product = (step * image).sum(-1, keepdim=True), (step * change).sum(-1, keepdim=True)
    share = torch.where(product < 0.2 * energy, 0.8 * energy / (energy - product), 1.0)
    damped = share * change + (1.0 - share) * image
    outer = damped[:, :, None] * damped[:, None, :] / (step * damped).sum(-1)[:, None, None]
    updated = hessian - image[:, :, None] * image[:, None, :] / energy[..., None] + outer
    is_usable = (energy > 1e-24)[..., None] & updated.isfinite().all(-1, keepdim=True).all(-2, keepdim=True)
    return torch.where(is_usable, updated, hessian)


def _lagrangian_hessian(evaluate: Evaluate, x: Tensor, which: Tensor, at: Point, multipliers: Tensor) -> Tensor:
    """Hessians (batch, n, n) of the Lagrangian by central differences of its gradient, made convex.

    Products of the gradients of active rows are added: steps along those rows do not feel them, and the curvature across
    them, which the optimum does not need, becomes positive. What stays below CURVATURE is raised to it.
    """
    n = x.shape[-1]
    steps = DIFFERENCE * torch.cat([torch.eye(n, dtype=x.dtype), -torch.eye(n, dtype=x.dtype)])
    hessians = []
    for k in range(len(x)):
        near = (x[k] + steps).requires_grad_()
        f, c = evaluate(near, which[k].expand(2 * n))
        (slope,) = torch.autograd.grad((f / at.objective[k] + c @ multipliers[k]).sum(), near)
        exact = (slope[:n] - slope[n:]) / (2.0 * DIFFERENCE)
        active = at.jacobian[k][multipliers[k] > CURVATURE]
        value, vector = torch.linalg.eigh(0.5 * (exact + exact.T) + active.T @ active)
        hessians.append(vector @ torch.diag(value.clamp(min=CURVATURE)) @ vector.T)
    return torch.stack(hessians)


def certify(x: Tensor, at: Point, multipliers: Tensor, bounds: Bounds, iterations: Tensor) -> Optimum:
    """How far x is from satisfying the optimality conditions with these multipliers."""
    gradient = at.gradient / at.objective[:, None] + torch.einsum("bmn,bm->bn", at.jacobian, multipliers)
    moved = x - torch.minimum(torch.maximum(x - gradient, bounds.lower), bounds.upper)
    return Optimum(
        x=x,
        objective=at.objective,
        rows=at.rows,
        multipliers=multipliers,
        stationarity=moved.abs().amax(-1),
        violation=at.rows.clamp(min=0.0).amax(-1),
        complementarity=torch.minimum(multipliers, (-at.rows).clamp(min=0.0)).amax(-1),
        iterations=iterations,
    )


def _is_accepted(x: Tensor, old: Point, new: Point, multipliers: Tensor, bounds: Bounds, error: Tensor) -> Tensor:
    """(batch,) bool: the penalty function falls, or the certificate's error does. Near the optimum the former refuses good
    steps for their curvature; the certificate decides there."""
    is_lower = new.merit(old.objective) <= old.merit(old.objective) + 1e-12
    reached = certify(x, new, multipliers, bounds, torch.zeros(len(x), dtype=torch.long)).error
    return is_lower | (reached < error)


@dataclass(frozen=True)
class _Trial:
    """A step's end x (batch, variable), the values there, the multipliers (batch, row) of its model, and whether it is
    accepted (batch,)."""

    x: Tensor
    point: Point
    multipliers: Tensor
    is_accepted: Tensor


@dataclass(frozen=True)
class _Problems:
    """What does not change within one iteration for the problems numbered `which`: functions, bounds, where they stand
    (x, at), their error and trust radius."""

    evaluate: Evaluate
    bounds: Bounds
    which: Tensor
    x: Tensor
    at: Point
    error: Tensor
    radius: Tensor

    def take(self, part: Tensor) -> "_Problems":
        places = (self.which[part], self.x[part], self.at.take(part), self.error[part], self.radius[part])
        return _Problems(self.evaluate, self.bounds, *places)

    def attempt(self, model: Point, hessian: Tensor) -> _Trial:
        """Step to the minimum of the convex model, which is `at` but for the rows of a corrected step."""
        step, multipliers = _step(self.x, self.radius, model, hessian, self.bounds)
        x = torch.minimum(torch.maximum(self.x + step, self.bounds.lower), self.bounds.upper)
        new = values_and_jacobian(self.evaluate, x, self.which)
        is_accepted = _is_accepted(x, self.at, new, multipliers, self.bounds, self.error)
        return _Trial(x, new, multipliers, is_accepted)


def _corrected(problems: _Problems, trial: _Trial, hessian: Tensor) -> None:
    """Bend refused steps with the rows' values at their ends, for a refusal may be due to the rows' curvature alone; what
    is accepted then replaces the trial in place. Source: Nocedal and Wright (2006), section 18.3."""
    again = torch.nonzero(~trial.is_accepted).squeeze(-1)
    if len(again) == 0:
        return
    refused = problems.take(again)
    bent = trial.point.rows[again] - torch.einsum("bmn,bn->bm", refused.at.jacobian, trial.x[again] - refused.x)
    second = refused.attempt(replace(refused.at, rows=bent), hessian[again])
    good, part = again[second.is_accepted], torch.nonzero(second.is_accepted).squeeze(-1)
    trial.x[good], trial.multipliers[good] = second.x[part], second.multipliers[part]
    trial.point.put(good, second.point.take(part))
    trial.is_accepted[good] = True


def minimize_log_linear(evaluate: Evaluate, start: Tensor, bounds: Bounds, iterations: int = ITERATIONS) -> Optimum:
    """Minimize every problem of the batch from start (batch, variable); see the module for what evaluate must be.

    Problems whose certificate holds rest while others go on; none is dropped if it never does: ask `is_certified`.
    """
    x = torch.minimum(torch.maximum(start, bounds.lower), bounds.upper)
    everyone = torch.arange(len(x))
    radius = torch.full_like(x[:, :1], RADIUS)
    state = values_and_jacobian(evaluate, x, everyone)
    multipliers, hessian = torch.zeros_like(state.rows), _initial_hessian(state)
    steps = torch.zeros(len(x), dtype=torch.long)
    for _ in range(iterations):
        now = certify(x, state, multipliers, bounds, steps)
        left = everyone[~now.is_certified]
        if len(left) == 0:
            break
        # From time to time learn the true curvature in place of what updates gathered far away, and forget a trust region
        # that refusals have shrunk.
        tired = left[steps[left] % RESTART == RESTART - 1]
        if len(tired):
            hessian[tired] = _lagrangian_hessian(evaluate, x[tired], tired, state.take(tired), multipliers[tired])
            radius[tired] = 0.5 * RADIUS
        problems = _Problems(evaluate, bounds, left, x[left], state.take(left), now.error[left], radius[left])
        trial = problems.attempt(problems.at, hessian[left])
        step = trial.x - problems.x
        hessian[left] = _updated_hessian(hessian[left], step, problems.at, trial.point, trial.multipliers)
        _corrected(problems, trial, hessian[left])
        length = step.abs().amax(-1, keepdim=True)
        grown = torch.where(length > 0.9 * problems.radius, 2.0 * problems.radius, problems.radius)
        shrunk = 0.3 * torch.minimum(length, problems.radius)
        radius[left] = torch.where(trial.is_accepted[:, None], grown.clamp(max=LARGEST_RADIUS), shrunk)
        steps[left] += 1
        moved, part = left[trial.is_accepted], torch.nonzero(trial.is_accepted).squeeze(-1)
        x[moved] = trial.x[part]
        state.put(moved, trial.point.take(part))
        # Multipliers of a refused step serve the next certificate as well: they belong to the same linearization.
        multipliers[left] = trial.multipliers
    return certify(x, state, multipliers, bounds, steps)
