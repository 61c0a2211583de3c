"""Free-form deformation, and the parameterization solver: the least deformation that has the measures asked for.

A block of B-spline control points surrounds a part; whatever is embedded in the block follows it as a constant linear
map. Each section of a block moves as a whole: its reference point shifts, and it turns about the y axis and stretches,
both held by the two numbers (c, s) = stretch (cos, sin of the turn), in which the points are linear. Sources: Sederberg
and Parry (1986) for the block; Powell (1969) and Nocedal and Wright (2006), chapter 18, for Newton's method on the
conditions of the constrained minimum; the gradient is the implicit-function theorem's.

Why not the solver of `lpc_mdo.optimization`: this is a part of the model, solved within every evaluation for all of its designs in
one tensor, and differentiated through. It has equations only, and exact second derivatives in closed form.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import torch
from torch import Tensor

from lpc_mdo.numerics.bsplines import local_bases

ITERATIONS = 50
TOLERANCE = 1e-9  # of the last step; the step that stays in the graph squares it


class DeformationError(ArithmeticError):
    """No deformation with the measures asked for was found; carries how many designs and their worst residual."""


@dataclass(frozen=True)
class FreeFormBlock:
    """A B-spline volume: knots (three tensors, m) and degrees along x, y, z.

    At rest the control points stand at the Greville abscissae, where they give back every embedded point.
    """

    knots: tuple[Tensor, Tensor, Tensor]
    degrees: tuple[int, int, int]

    @classmethod
    def with_sections(cls, points: Tensor, sections: Tensor) -> "FreeFormBlock":
        """The block around points (..., 3) with straight edges between sections at y = `sections`, increasing, m."""
        low, high = points.reshape(-1, 3).amin(0), points.reshape(-1, 3).amax(0)
        ends = [torch.stack([low[i], low[i], high[i], high[i]]) for i in (0, 2)]
        return cls((ends[0], torch.cat([sections[:1], sections, sections[-1:]]), ends[1]), (1, 1, 1))

    @property
    def rest(self) -> Tensor:
        """Control points (nx, ny, nz, 3) of the undeformed block, m."""
        axes = []
        for knots, degree in zip(self.knots, self.degrees, strict=True):
            count = knots.numel() - degree - 1
            axes.append(torch.stack([knots[i + 1 : i + degree + 1].mean() for i in range(count)]))
        return torch.stack(torch.meshgrid(*axes, indexing="ij"), dim=-1)

    def embed(self, points: Tensor) -> Tensor:
        """Matrix (point, nx ny nz) that gives points (point, 3) from the block's control points.

        Raises ValueError for a point outside of the block.
        """
        matrix = torch.ones(len(points), 1, dtype=points.dtype)
        for axis, (knots, degree) in enumerate(zip(self.knots, self.degrees, strict=True)):
            x = points[:, axis]
            low, high = knots[degree], knots[-degree - 1]
            if not bool(((x >= low) & (x <= high)).all()):
                raise ValueError(f"points are not allowed; {'xyz'[axis]} must lie between {low:g} and {high:g} m")
            first, values = local_bases(x, knots, degree)
            basis = torch.zeros(len(points), knots.numel() - degree - 1, dtype=points.dtype)
            basis.scatter_(1, first[:, None] + torch.arange(degree + 1), values[:, 0])
            matrix = (matrix[:, :, None] * basis[:, None, :]).flatten(1)
        return matrix

    def section_map(self, points: Tensor, reference: Tensor) -> Tensor:
        """Embedded points (point, 3) as a linear map (point, 3, 5 sections) of the motion of the block's y sections.

        reference (section, 3) m: the points of the sections that are moved and turned about. The motion is the list
        [x of all sections, y, z, c, s]; at rest it holds the references, ones and zeros.
        """
        arm = self.rest - reference[:, None, :]
        _, count, _, _ = arm.shape
        control = torch.zeros(*arm.shape[:3], 3, 5, count, dtype=points.dtype)
        for j in range(count):
            control[:, j, :, range(3), range(3), j] = 1.0
            dx, dz = arm[:, j, :, 0], arm[:, j, :, 2]
            control[:, j, :, 0, 3, j], control[:, j, :, 0, 4, j] = dx, dz
            control[:, j, :, 2, 3, j], control[:, j, :, 2, 4, j] = dz, -dx
        flat = self.embed(points) @ control.flatten(0, 2).flatten(1)
        return flat.reshape(len(points), 3, 5 * count)


class Measures(Protocol):
    """What a deformation is asked for, as smooth functions of its state (..., n); designs batch."""

    def linearized(self, state: Tensor) -> tuple[Tensor, Tensor]:
        """Values (..., m) and Jacobian (..., m, n)."""

    def expanded(self, state: Tensor, multipliers: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """The same, and the second derivatives of multipliers (..., m) x values: (..., n, n)."""


@dataclass(frozen=True)
class ChordMeasures:
    """Twist at stations, and mean chord, of half surfaces whose sections carry (c, s); the state is [c of all, s].

    twist (..., station): the turn asked for, rad, nose up; basis (station, section) gives the surface there; chord
    (..., section): chords at rest over their mean; mean_basis (node, section) and mean_weight (node,): quadrature of the
    mean over the span. Values: at each station the chord's component across the twist asked for, then the mean chord;
    all over the mean chord at rest.
    """

    twist: Tensor
    basis: Tensor
    chord: Tensor
    mean_basis: Tensor
    mean_weight: Tensor

    @cached_property
    def _across(self) -> Tensor:
        """(..., station, 2 section): the chords' components across the twist asked for, linear in the state."""
        with torch.enable_grad():  # it is kept, though first asked for where none is wanted
            rows = self.basis * self.chord[..., None, :]
            cos, sin = torch.cos(self.twist)[..., None], torch.sin(self.twist)[..., None]
            return torch.cat([-sin * rows, cos * rows], dim=-1)

    @cached_property
    def _rows(self) -> Tensor:
        """(..., node, section): chord vectors at the nodes of the mean, linear in the state."""
        with torch.enable_grad():
            return self.mean_basis * self.chord[..., None, :]

    def _linearized(self, state: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Values, Jacobian, and at the nodes unit chord vectors (..., 2, node) and chord lengths (..., node)."""
        vectors = (self._rows[..., None, :, :] @ state.unflatten(-1, (2, -1))[..., None])[..., 0]
        length = torch.linalg.vector_norm(vectors, dim=-2)
        direction = vectors / length[..., None, :]
        across = self._across.expand(*state.shape[:-1], *self._across.shape[-2:])
        mean_rows = ((self.mean_weight * direction) @ self._rows).flatten(-2)[..., None, :]
        mean = (length * self.mean_weight).sum(-1, keepdim=True)
        values = torch.cat([(across @ state[..., None])[..., 0], mean], dim=-1)
        return values, torch.cat([across, mean_rows], dim=-2), direction, length

    def linearized(self, state: Tensor) -> tuple[Tensor, Tensor]:
        return self._linearized(state)[:2]

    def expanded(self, state: Tensor, multipliers: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        values, jacobian, direction, length = self._linearized(state)
        cos, sin = direction[..., None].unbind(-3)
        turn = torch.cat([-sin * self._rows, cos * self._rows], dim=-1)
        weight = multipliers[..., -1:] * self.mean_weight / length
        return values, jacobian, (turn * weight[..., None]).mT @ turn


def least_deformation(
    measures: Measures, reference: Tensor, weight: Tensor, requested: Tensor, start: Tensor | None = None
) -> Tensor:
    """The state (..., n) with the requested measures (..., m) and the least sum of weight (..., n) x deformation^2.

    Deformation is the difference from `reference` (..., n); the search begins at `start` (..., n), the reference if left out.
    Differentiable once with respect to whatever `measures`, `reference` and `requested` were made of: one Newton step stays in
    the graph, and its derivative is the implicit-function theorem's. Raises DeformationError if a design has no solution or
    is not finite.
    """
    with torch.no_grad():
        state, multipliers, matrix = _solve(
            measures, reference, weight, requested, reference if start is None else start
        )
    residual = _residual(*measures.linearized(state), state, multipliers, reference, weight, requested)
    return state - torch.linalg.solve(matrix, residual)[..., : state.shape[-1]]


def _residual(
    values: Tensor,
    jacobian: Tensor,
    state: Tensor,
    multipliers: Tensor,
    reference: Tensor,
    weight: Tensor,
    requested: Tensor,
) -> Tensor:
    """Residual (..., n + m) of the conditions for a constrained minimum."""
    pull = (multipliers[..., None, :] @ jacobian)[..., 0, :]
    return torch.cat([weight * (state - reference) + pull, values - requested], dim=-1)


def _solve(
    measures: Measures, reference: Tensor, weight: Tensor, requested: Tensor, start: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """State, multipliers and the matrix of Newton's method there."""
    state, multipliers = start.clone(), torch.zeros_like(requested + start[..., :1])
    n, m = state.shape[-1], multipliers.shape[-1]
    corner = torch.zeros(*state.shape[:-1], m, m, dtype=state.dtype)
    stiffness = torch.diag_embed(weight.expand_as(state))
    for _ in range(ITERATIONS):
        values, jacobian, curvature = measures.expanded(state, multipliers)
        upper, lower = torch.cat([stiffness + curvature, jacobian.mT], -1), torch.cat([jacobian, corner], -1)
        matrix = torch.cat([upper, lower], dim=-2)
        step = torch.linalg.solve(matrix, _residual(values, jacobian, state, multipliers, reference, weight, requested))
        size = step[..., :n].abs().amax(-1)
        if bool((size <= TOLERANCE).all()):
            return state, multipliers, matrix
        state, multipliers = state - step[..., :n], multipliers - step[..., n:]
    is_open = ~(size <= TOLERANCE)  # counts what is not a number
    raise DeformationError(
        f"{int(is_open.sum())} of {size.numel()} deformations were not found; the last step is {float(size.max()):.3g}"
    )
