"""Convex quadratic programs, batched over independent problems: all of a batch in each tensor operation.

The optimizer's own programs (`lpc_mdo.optimization.quadratic`) go to PIQP, which takes one at a time.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

TOLERANCE = 1e-11


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
        is_open = worst > TOLERANCE
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
