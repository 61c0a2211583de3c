"""Projection of points onto a B-spline surface: the closest point, and the point met along a direction.

Both minimize half the squared distance |P (S(u, v) - p)|^2, where P is the identity or takes the direction out. Starts
are the local minima over a grid of samples; from each, Newton's method with Levenberg-Marquardt damping and bounds.
Where the tangent may jump, at knots of full multiplicity, a search stops and a new one goes on behind. An edge that is
collapsed to a point, like the nose of a body, would hold every search that reaches it from the wrong side: searches only
approach it, and the point itself is a candidate of its own.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.geometry.boxed_newton import State, breaks_of, held, newton_step, smooth_box
from lpc_mdo.geometry.surfaces import BSplineSurface

STARTS = 4  # local minima of the sampled distance that are followed
SAMPLES_A_SPAN = 3  # samples between two knots
ITERATIONS = 100
APPROACH = 0.1  # what a step may leave of the way to a collapsed edge
CONVERGED = 1e-12  # residual over the size of the problem; rounding allows no less
ACCEPTED = 1e-8  # m
CHUNK = 20000  # points at a time, for the memory of the distance table


@dataclass(frozen=True)
class Projection:
    """Where points meet a surface, each (point,) unless given.

    residual: length in m of the part of the distance that is not normal to the surface, nor held by its edge; zero at
    a minimum. distance: in m, for a direction the gap between line and surface: zero where the line meets it.
    """

    u: Tensor
    v: Tensor
    point: Tensor  # (point, 3) m
    distance: Tensor
    residual: Tensor
    is_converged: Tensor


def closest_point(surface: BSplineSurface, points: Tensor) -> Projection:
    """The points of the surface closest to `points` (point, 3) in m. Parameters carry no gradient.

    Raises ValueError for a batch of surfaces, and for points that are not finite.
    """
    return _project(surface, points, None)


def project_along(surface: BSplineSurface, points: Tensor, direction: Tensor) -> Projection:
    """The points of the surface on the lines through `points` (point, 3) along `direction` (3,), either way.

    Of several the one nearest to the point is taken; where a line misses the surface, the point closest to the line.
    Raises ValueError as `closest_point`, and for a direction of no length.
    """
    length = torch.linalg.vector_norm(direction)
    if not bool(length > 0.0):
        raise ValueError("direction is not allowed; it must have a length")
    return _project(surface, points, direction / length)


def _project(surface: BSplineSurface, points: Tensor, direction: Tensor | None) -> Projection:
    if surface.control_points.dim() != 3 or points.dim() != 2:
        raise ValueError("a batch is not allowed; project (point, 3) onto one surface")
    if not bool(points.isfinite().all()):
        raise ValueError("points are not allowed; all must be finite")
    with torch.no_grad():
        search = _Search(surface, direction)
        parts = [search(chunk) for chunk in points.double().split(CHUNK)]
    return Projection(*(torch.cat([getattr(part, name) for part in parts]) for name in Projection.__annotations__))


@dataclass(frozen=True)
class _Pole:
    """An edge at an end of an axis that is one point (3,), with parameters x (around, 2) along it.

    inward (around, 3): the derivatives with respect to the axis that lead away from it.
    """

    axis: int
    point: Tensor
    x: Tensor
    inward: Tensor


@dataclass(frozen=True)
class _Found:
    """Ends of searches: parameters (search, 2), half the squared distance (search,) m^2 and residual (search,) m."""

    x: Tensor
    value: Tensor
    residual: Tensor


class _Search:
    """Constant parts of a search on one surface."""

    def __init__(self, surface: BSplineSurface, direction: Tensor | None) -> None:
        self.surface, self.direction = surface, direction
        self.size = float(surface.control_points.abs().max())
        axes = list(zip(surface.knots, surface.degrees, surface.shape, strict=True))
        self.breaks = [breaks_of(*axis) for axis in axes]
        inner = [_samples(*axis) for axis in axes]
        self.poles = [_pole(surface, axis, end, inner[1 - axis], self.size) for axis in (0, 1) for end in (0, 1)]
        parameters = []
        for axis, values in enumerate(inner):
            ends = [
                torch.full_like(values[:1], surface.domain[axis][end]) if self.poles[2 * axis + end] is None else None
                for end in (0, 1)
            ]
            parts = [ends[0], values, ends[1]]
            parameters.append(torch.cat([part for part in parts if part is not None]))
        self.grid_shape = (parameters[0].numel(), parameters[1].numel())
        self.samples = torch.cartesian_prod(*parameters)
        self.sampled = self._across(surface(self.samples[:, 0], self.samples[:, 1]))
        is_pole = [self.poles[2 * axis + end] is not None for axis in (0, 1) for end in (0, 1)]
        self.is_pole = torch.tensor(is_pole).reshape(2, 2)  # axis, end

    def _across(self, vectors: Tensor) -> Tensor:
        """What is left of vectors (..., 3) across the direction."""
        if self.direction is None:
            return vectors
        return vectors - (vectors @ self.direction)[..., None] * self.direction

    def __call__(self, points: Tensor) -> Projection:
        found = self._closest(points, *self._starts(points))
        is_lost = found.residual > 1e-2 * ACCEPTED
        poles = [pole for pole in self.poles if pole is not None]
        if poles and bool(is_lost.any()):
            lost = points[is_lost]
            starts = torch.cat([self._off_pole(pole, lost) for pole in poles])
            again = self._closest(lost, starts, torch.arange(len(lost)).repeat(len(poles)))
            for name in ("x", "value", "residual"):
                getattr(found, name)[is_lost] = getattr(again, name)
        return Projection(
            u=found.x[:, 0],
            v=found.x[:, 1],
            point=self.surface(found.x[:, 0], found.x[:, 1]),
            distance=torch.sqrt(2.0 * found.value),
            residual=found.residual,
            is_converged=found.residual <= ACCEPTED,
        )

    def _closest(self, points: Tensor, starts: Tensor, owner: Tensor) -> "_Found":
        """The best end, for each point, of its searches and of the collapsed edges."""
        found, owners, before = [], [], torch.full_like(starts[:, 0], torch.inf)
        while len(starts) > 0:
            boxes = [smooth_box(starts[:, i], self.breaks[i]) for i in range(2)]
            low, high = (torch.stack([box[i] for box in boxes], dim=-1) for i in range(2))
            ends = self._minimize(starts, points[owner], low, high)
            found.append(_Found(ends.x, ends.value, ends.residual))
            owners.append(owner)
            behind, is_held = self._behind_breaks(ends.x, low, high)
            goes_on = is_held & (ends.value < before)
            starts, owner, before = behind[goes_on], owner[goes_on], (1.0 - 1e-6) * ends.value[goes_on]
        for pole in self.poles:
            if pole is not None:
                found.append(self._at_pole(pole, points))
                owners.append(torch.arange(len(points)))
        x, value, residual = (torch.cat([getattr(part, name) for part in found]) for name in ("x", "value", "residual"))
        owner = torch.cat(owners)
        offset = self.surface(x[:, 0], x[:, 1]) - points[owner]
        best = self._best(value, residual, offset, owner, len(points))
        return _Found(x[best], value[best], residual[best])

    def _starts(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """Starts (search, 2) and the points (search,) that they belong to."""
        # Single precision decides well enough where to start; centred, so that it does.
        center = self.sampled.mean(0)
        samples, across = (self.sampled - center).float(), (self._across(points) - center).float()
        squared = (samples**2).sum(-1) - 2.0 * across @ samples.T
        table = squared.unflatten(1, self.grid_shape)
        lowest = _neighbourhood_minimum(_neighbourhood_minimum(table, 1), 2)
        minima = torch.where(table <= lowest, table, torch.inf).flatten(1)
        chosen = minima.topk(min(STARTS, minima.shape[1]), dim=1, largest=False)
        owner, rank = torch.nonzero(chosen.values.isfinite(), as_tuple=True)
        return self.samples[chosen.indices[owner, rank]], owner

    def _behind_breaks(self, x: Tensor, low: Tensor, high: Tensor) -> tuple[Tensor, Tensor]:
        """Starts (search, 2) just behind the breaks that hold searches, and whether one does (search,)."""
        ends = torch.tensor(self.surface.domain, dtype=x.dtype)
        is_low, is_high = (x == low) & (low > ends[:, 0]), (x == high) & (high < ends[:, 1])
        below, above = torch.nextafter(low, ends[:, 0]), torch.nextafter(high, ends[:, 1])
        return torch.where(is_low, below, torch.where(is_high, above, x)), (is_low | is_high).any(-1)

    def _at_pole(self, pole: "_Pole", points: Tensor) -> "_Found":
        """The collapsed edge as a candidate; residual: the steepest descent away from it."""
        gap, slope, place = self._descent(pole, points)
        return _Found(pole.x[place], 0.5 * (gap**2).sum(-1), (-slope).clamp(min=0.0))

    def _descent(self, pole: "_Pole", points: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """From pole to points: the gaps (point, 3) m, the steepest slopes (point,) m and where around it they are."""
        gap = self._across(pole.point - points)
        slope, place = (gap @ torch.nn.functional.normalize(self._across(pole.inward), dim=-1).T).min(-1)
        return gap, slope, place

    def _off_pole(self, pole: "_Pole", points: Tensor) -> Tensor:
        """Starts (point, 2) off the collapsed edge, as far down the steepest descent as the points lie."""
        _, slope, place = self._descent(pole, points)
        first, last = self.surface.domain[pole.axis]
        away = (slope.abs() / torch.linalg.vector_norm(pole.inward[place], dim=-1)).clamp(1e-9, 0.1 * (last - first))
        starts = pole.x[place].clone()
        starts[:, pole.axis] += torch.where(starts[:, pole.axis] == first, away, -away)
        return starts

    def _best(self, value: Tensor, residual: Tensor, offset: Tensor, owner: Tensor, count: int) -> Tensor:
        """Index (point,) of the search to keep: the least distance, or the nearest meeting point along the line."""
        distance = torch.sqrt(2.0 * value)
        if self.direction is not None:
            is_met = distance <= ACCEPTED
            reach = 1.0 + 1e3 * self.size + torch.linalg.vector_norm(offset, dim=-1).max()
            distance = torch.where(is_met, (offset @ self.direction).abs(), reach + distance)
        # A search that failed must not hide one that did not, at the same place.
        distance = torch.where(residual <= ACCEPTED, distance, distance + 1e-9 * (1.0 + distance))
        order = torch.argsort(distance, descending=True, stable=True)
        best = torch.empty(count, dtype=torch.long)
        best[owner[order]] = order  # the last write, the least distance, stays
        return best

    def _minimize(self, x: Tensor, points: Tensor, low: Tensor, high: Tensor) -> State:
        state = self._state(x, points, low, high)
        open_, damping = torch.arange(len(x)), torch.full((len(x),), 1e-6, dtype=x.dtype)
        tolerance = CONVERGED * (self.size + torch.linalg.vector_norm(points, dim=-1))
        for _ in range(ITERATIONS):
            is_open = (state.residual[open_] > tolerance[open_]) & (damping[open_] < 1e12)
            open_ = open_[is_open]
            if open_.numel() == 0:
                break
            now, box, target = state.take(open_), (low[open_], high[open_]), points[open_]
            inside = self._short_of_poles(now.x, box)
            step = now.x + newton_step(now, box, damping[open_])
            trial = self._state(torch.minimum(torch.maximum(step, inside[0]), inside[1]), target, *box)
            # Near the minimum rounding hides the decrease: there the residual decides.
            slack = 1e-12 * (now.value + tolerance[open_] ** 2 / CONVERGED**2)
            is_better = (trial.value < now.value) | (trial.value <= now.value + slack) & (trial.residual < now.residual)
            state.put(open_, trial.where(is_better, now))
            damping[open_] = (damping[open_] * torch.where(is_better, 0.1, 8.0)).clamp(min=1e-15)
        return state

    def _short_of_poles(self, x: Tensor, box: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor]:
        """The box, ends at collapsed edges moved towards x."""
        moved = []
        for side, end in enumerate(box):
            edge = torch.tensor([domain[side] for domain in self.surface.domain], dtype=x.dtype)
            moved.append(torch.where(self.is_pole[:, side] & (end == edge), end + APPROACH * (x - end), end))
        return moved[0], moved[1]

    def _state(self, x: Tensor, points: Tensor, low: Tensor, high: Tensor) -> State:
        jet = self.surface.jet(x[:, 0], x[:, 1])
        gap, by_u, by_v = (self._across(item) for item in (jet.point - points, jet.u, jet.v))

        def dot(a: Tensor, b: Tensor) -> Tensor:
            return (a * b).sum(-1)

        gradient = torch.stack([dot(gap, by_u), dot(gap, by_v)], dim=-1)
        metric = torch.stack([dot(by_u, by_u), dot(by_v, by_v)], dim=-1)
        hessian = torch.stack(
            [
                metric[:, 0] + dot(gap, jet.uu),
                dot(by_u, by_v) + dot(gap, jet.uv),
                metric[:, 1] + dot(gap, jet.vv),
            ],
            dim=-1,
        )
        is_held = held(x, gradient, low, high)
        along = torch.where(is_held, 0.0, gradient).abs() / torch.sqrt(metric + 1e-300)
        return State(x, 0.5 * dot(gap, gap), gradient, hessian, metric, along.amax(-1))


def _neighbourhood_minimum(table: Tensor, dim: int) -> Tensor:
    """The least of each entry and its two neighbours along `dim`."""
    count = table.shape[dim]
    lowest = table.clone()
    inner, outer = lowest.narrow(dim, 0, count - 1), table.narrow(dim, 1, count - 1)
    torch.minimum(inner, outer, out=inner)
    inner, outer = lowest.narrow(dim, 1, count - 1), table.narrow(dim, 0, count - 1)
    torch.minimum(inner, outer, out=inner)
    return lowest


def _samples(knots: Tensor, degree: int, count: int) -> Tensor:
    """Parameters evenly between any two knots, none on a knot."""
    ends = torch.unique(knots[degree : count + 1])
    inner = (torch.arange(SAMPLES_A_SPAN, dtype=knots.dtype) + 0.5) / SAMPLES_A_SPAN
    return (ends[:-1, None] + inner * (ends[1:] - ends[:-1])[:, None]).flatten()


def _pole(surface: BSplineSurface, axis: int, end: int, along: Tensor, size: float) -> _Pole | None:
    """The edge at an end of an axis, if it is collapsed to a point."""
    x = torch.empty(len(along), 2, dtype=along.dtype)
    x[:, axis], x[:, 1 - axis] = surface.domain[axis][end], along
    jet = surface.jet(x[:, 0], x[:, 1])
    if float((jet.point - jet.point[0]).abs().max()) > 1e-12 * size:
        return None
    along_axis = jet.u if axis == 0 else jet.v
    return _Pole(axis, jet.point[0], x, along_axis * (1.0 - 2.0 * end))
