"""Sequential convex programming for structural sizing, batched over independent problems.

minimize f(x) subject to c(x) <= 0 and bounds, where x are logarithms of gauges and f = constant + sum of a_i exp(x_i): a mass.
Its Hessian is then diag(df/dx), known without further work, and logarithms of stress shares are nearly linear in x; so
each step minimizes the exact second-order model of f under linearized constraints within a trust region.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

# evaluate(x (k, variable), which (k,)): objective (k,) and rows (k, row) of the problems numbered `which`.
Evaluate = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]

ROWS = 400  # nearest to their limit, that a step sees; all rows are checked
RADIUS, LARGEST_RADIUS = 0.3, 1.5  # first and largest trust region, in the logarithm
PART = 32  # problems that are differentiated together: memory against the cost of many small operations
PENALTY = 3.0  # of the elastic variable and in the merit function; f is scaled to one
ITERATIONS, RESTART = 60, 8
DIFFERENCE = 1e-4  # in the logarithm, for second derivatives
CURVATURE = 1e-6  # smallest of the model
QUADRATIC_TOLERANCE = 1e-11
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
        (f, c), (df, dc) = torch.func.vmap(
            lambda v, here=here, index=index: torch.func.jvp(lambda y: evaluate(y, index), (here,), (v,)),
            out_dims=((None, None), (0, 0)),
        )(directions)
        points.append((f, df.movedim(0, -1), c, dc.movedim(0, -1)))
    return Point(*(torch.cat(parts) for parts in zip(*points, strict=True)))


@dataclass(frozen=True)
class QuadraticProgram:
    """min z . hessian z/2 + slope . z  subject to  rows z <= limit, lower <= z <= upper; all (batch, ...)."""

    hessian: Tensor
    slope: Tensor
    rows: Tensor
    limit: Tensor
    lower: Tensor
    upper: Tensor


def solve_quadratic(q: QuadraticProgram, iterations: int = 60) -> tuple[Tensor, Tensor]:
    """Minimizers z (batch, n) and multipliers (batch, row) of strictly convex programs with lower < upper.

    Mehrotra's predictor-corrector method, with bounds kept strictly satisfied. Source: Nocedal and Wright, Numerical
    Optimization (2006), algorithm 16.4.
    """
    z = 0.5 * (q.lower + q.upper)
    slack = torch.cat([(q.limit - _rows_times(q, z)).clamp(min=0.1), q.upper - z, z - q.lower], dim=-1)
    dual = torch.full_like(slack, 0.1)
    for _ in range(iterations):
        residual = torch.einsum("bij,bj->bi", q.hessian, z) + q.slope + _transposed(q, dual)
        beyond = _sides(q, z) + slack - torch.cat([q.limit, q.upper, -q.lower], dim=-1)
        gap = (slack * dual).mean(-1, keepdim=True)
        worst = torch.cat([gap, residual.abs(), beyond.abs()], dim=-1).amax(-1, keepdim=True)
        is_open = worst > QUADRATIC_TOLERANCE
        if not bool(is_open.any()):
            break
        changes = _mehrotra_direction(q, slack, dual, residual, beyond)
        # Finished programs rest: further steps would only meet rounding errors, as do systems too ill to be solved.
        is_open = is_open & torch.cat(changes, dim=-1).isfinite().all(-1, keepdim=True)
        dz, ds, dl = (torch.where(is_open, change, 0.0) for change in changes)
        step = 0.995 * torch.minimum(_longest(slack, ds), _longest(dual, dl))
        z, slack, dual = z + step * dz, slack + step * ds, dual + step * dl
    return z, dual[:, : q.rows.shape[1]]


def _rows_times(q: QuadraticProgram, v: Tensor) -> Tensor:
    return torch.einsum("bmn,bn->bm", q.rows, v)


def _sides(q: QuadraticProgram, v: Tensor) -> Tensor:
    """Rows, upper and lower bounds (batch, m + 2 n) applied to v."""
    return torch.cat([_rows_times(q, v), v, -v], dim=-1)


def _transposed(q: QuadraticProgram, v: Tensor) -> Tensor:
    m, n = q.rows.shape[-2:]
    return torch.einsum("bmn,bm->bn", q.rows, v[:, :m]) + v[:, m : m + n] - v[:, m + n :]


def _longest(value: Tensor, change: Tensor) -> Tensor:
    """Share (batch, 1) of the change, at most 1, that leaves every value positive."""
    return torch.where(change < 0, -value / change, torch.inf).amin(-1, keepdim=True).clamp(max=1.0)


def _mehrotra_direction(
    q: QuadraticProgram, slack: Tensor, dual: Tensor, residual: Tensor, beyond: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Changes of z, slack and dual."""
    m, n = q.rows.shape[-2:]
    weight = dual / slack
    normal = torch.einsum("bmi,bm,bmj->bij", q.rows, weight[:, :m], q.rows) + q.hessian
    factor = torch.linalg.cholesky_ex(normal + torch.diag_embed(weight[:, m : m + n] + weight[:, m + n :]))[0]

    def newton(product: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Towards slack times dual smaller by `product`."""
        right = -residual - _transposed(q, weight * beyond - product / slack)
        dz = torch.cholesky_solve(right[..., None], factor).squeeze(-1)
        ds = -beyond - _sides(q, dz)
        return dz, ds, -(product + dual * ds) / slack

    product = slack * dual
    gap = product.mean(-1, keepdim=True)
    _, ds, dl = newton(product)
    reached = ((slack + _longest(slack, ds) * ds) * (dual + _longest(dual, dl) * dl)).mean(-1, keepdim=True)
    return newton(product + ds * dl - (reached / gap) ** 3 * gap)


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
        old, size = state.take(left), radius[left]
        d, dual = _step(x[left], size, old, hessian[left], bounds)
        trial = torch.minimum(torch.maximum(x[left] + d, bounds.lower), bounds.upper)
        new = values_and_jacobian(evaluate, trial, left)
        hessian[left] = _updated_hessian(hessian[left], trial - x[left], old, new, dual)
        is_better = _is_accepted(trial, old, new, dual, bounds, now.error[left])
        if len(again := torch.nonzero(~is_better).squeeze(-1)):
            # Refused for the curvature of rows along the step: bend the step with their values at its end.
            which, before = left[again], old.take(again)
            bent = new.rows[again] - torch.einsum("bmn,bn->bm", before.jacobian, trial[again] - x[which])
            bend = replace(before, rows=bent)
            step, bent_dual = _step(x[which], size[again], bend, hessian[which], bounds)
            corrected = torch.minimum(torch.maximum(x[which] + step, bounds.lower), bounds.upper)
            reached = values_and_jacobian(evaluate, corrected, which)
            is_good = _is_accepted(corrected, before, reached, bent_dual, bounds, now.error[which])
            good = again[is_good]
            trial[good], dual[good] = corrected[is_good], bent_dual[is_good]
            new.put(good, reached.take(torch.nonzero(is_good).squeeze(-1)))
            is_better[good] = True
        length = d.abs().amax(-1, keepdim=True)
        grown = torch.where(length > 0.9 * size, 2.0 * size, size).clamp(max=LARGEST_RADIUS)
        radius[left] = torch.where(is_better[:, None], grown, 0.3 * torch.minimum(length, size))
        steps[left] += 1
        moved = left[is_better]
        x[moved] = trial[is_better]
        state.put(moved, new.take(torch.nonzero(is_better).squeeze(-1)))
        # Multipliers of a refused step serve the next certificate as well: they belong to the same linearization.
        multipliers[left] = dual
    return certify(x, state, multipliers, bounds, steps)
