"""Problems with known minima, from the usual collections: classics, Hock and Schittkowski's, scaled, degenerate, without optimum.

`minima` are the values at all local minima that a descent from the start may end in. Sources: More, Garbow, Hillstrom, ACM
TOMS 7 (1981); Hock, Schittkowski, Test Examples for Nonlinear Programming Codes (1981); Surjanovic, Bingham, Virtual Library
of Simulation Experiments. Every minimum is reached by SLSQP or by IPOPT's published runs as well.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, pi, sqrt
from typing import Any

import hock_schittkowski
import torch
from torch import Tensor, cos, exp, sin, stack

from lpc_mdo.optimization import minimize


@dataclass(frozen=True)
class Case:
    """rows = 0 for the first `equal`, >= 0 for the others; expected: the status that is true."""

    name: str
    objective: Callable[[Tensor], Tensor]
    x0: tuple[float, ...]
    minima: tuple[float, ...] = (0.0,)
    lower: tuple[float, ...] | float | None = None
    upper: tuple[float, ...] | float | None = None
    rows: Callable[[Tensor], Tensor] | None = None
    equal: int = 0
    expected: str = "converged"
    scale: float = 1.0  # of the objective

    def solve(self, **options: Any):
        start = torch.tensor(self.x0, dtype=torch.float64)
        count = 0 if self.rows is None else self.rows(start).numel()
        upper = [0.0] * self.equal + [inf] * (count - self.equal)
        return minimize(
            lambda x: self.scale * self.objective(x),
            start,
            self.lower,
            self.upper,
            self.rows,
            [0.0] * count if count else None,
            upper if count else None,
            **options,
        )

    def scaled(self, scale: float) -> "Case":
        return replace(self, name=f"{self.name} x {scale:g}", scale=scale, minima=tuple(scale * m for m in self.minima))

    def error(self, result) -> float:
        """Distance of the objective from the nearest minimum, relative to it, or to the problem's own scale at zero."""
        return min(abs(result.objective - m) / max(abs(m), self.scale) for m in self.minima)

    def is_false(self, result) -> bool:
        """A claim that is not true: an optimum that is none, or no design where there are some."""
        if result.status == "converged":
            return self.expected not in ("converged", "failed") or not self.error(result) <= 1e-6
        return result.status in ("infeasible", "unbounded") and result.status != self.expected


def rosenbrock(x):
    return 100.0 * (x[1] - x[0] ** 2) ** 2 + (1.0 - x[0]) ** 2


def wood(x):
    first = 100 * (x[1] - x[0] ** 2) ** 2 + (1 - x[0]) ** 2 + 90 * (x[3] - x[2] ** 2) ** 2 + (1 - x[2]) ** 2
    return first + 10.1 * ((x[1] - 1) ** 2 + (x[3] - 1) ** 2) + 19.8 * (x[1] - 1) * (x[3] - 1)


def powell(x):
    return (x[0] + 10 * x[1]) ** 2 + 5 * (x[2] - x[3]) ** 2 + (x[1] - 2 * x[2]) ** 4 + 10 * (x[0] - x[3]) ** 4


def beale(x):
    return sum((c - x[0] * (1 - x[1] ** k)) ** 2 for k, c in ((1, 1.5), (2, 2.25), (3, 2.625)))


def himmelblau(x):
    return (x[0] ** 2 + x[1] - 11) ** 2 + (x[0] + x[1] ** 2 - 7) ** 2


def freudenstein_roth(x):
    return (-13 + x[0] + ((5 - x[1]) * x[1] - 2) * x[1]) ** 2 + (-29 + x[0] + ((x[1] + 1) * x[1] - 14) * x[1]) ** 2


def brown(x):
    return (x[0] - 1e6) ** 2 + (x[1] - 2e-6) ** 2 + (x[0] * x[1] - 2) ** 2


def powell_badly_scaled(x):
    return (1e4 * x[0] * x[1] - 1) ** 2 + (exp(-x[0]) + exp(-x[1]) - 1.0001) ** 2


def jennrich_sampson(x):
    return sum((2 + 2 * i - (exp(i * x[0]) + exp(i * x[1]))) ** 2 for i in range(1, 11))


def bard(x):
    data = (0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39)
    return sum(
        (y - (x[0] + u / ((16 - u) * x[1] + min(u, 16 - u) * x[2]))) ** 2
        for u, y in zip(range(1, 16), data, strict=True)
    )


def kowalik_osborne(x):
    y = (0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246)
    u = (4.0, 2.0, 1.0, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625)
    return sum((b - x[0] * (a * a + a * x[1]) / (a * a + a * x[2] + x[3])) ** 2 for a, b in zip(u, y, strict=True))


def brown_dennis(x):
    t = 0.2 * torch.arange(1, 21, dtype=torch.float64)
    return (((x[0] + t * x[1] - exp(t)) ** 2 + (x[2] + x[3] * sin(t) - cos(t)) ** 2) ** 2).sum()


def box(x):
    t = 0.1 * torch.arange(1, 11, dtype=torch.float64)
    return ((exp(-t * x[0]) - exp(-t * x[1]) - x[2] * (exp(-t) - exp(-10 * t))) ** 2).sum()


def broyden(x):
    before, after = torch.cat([x.new_zeros(1), x[:-1]]), torch.cat([x[1:], x.new_zeros(1)])
    return (((3 - 2 * x) * x - before - 2 * after + 1) ** 2).sum()


def variably_dimensioned(x):
    t = (torch.arange(1, len(x) + 1, dtype=torch.float64) * (x - 1)).sum()
    return ((x - 1) ** 2).sum() + t**2 + t**4


def extended_rosenbrock(x):
    return (100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2).sum()


def goldstein_price(x):
    a, b = x
    first = 1 + (a + b + 1) ** 2 * (19 - 14 * a + 3 * a**2 - 14 * b + 6 * a * b + 3 * b**2)
    return first * (30 + (2 * a - 3 * b) ** 2 * (18 - 32 * a + 12 * a**2 + 48 * b - 36 * a * b + 27 * b**2))


def branin(x):
    return (x[1] - 5.1 / (4 * pi**2) * x[0] ** 2 + 5 / pi * x[0] - 6) ** 2 + 10 * (1 - 1 / (8 * pi)) * cos(x[0]) + 10


def six_hump(x):
    return (4 - 2.1 * x[0] ** 2 + x[0] ** 4 / 3) * x[0] ** 2 + x[0] * x[1] + (-4 + 4 * x[1] ** 2) * x[1] ** 2


SIX_HUMPS = (-1.031628453489877, -0.2154638243837, 2.1042503103112)
CLASSICS = [
    *(Case(f"Rosenbrock from {s}", rosenbrock, s) for s in ((-1.2, 1.0), (-3.0, -4.0), (5.0, 5.0), (10.0, 10.0), (-50.0, 80.0))),
    Case("Beale", beale, (1.0, 1.0)),
    *(Case(f"Himmelblau from {s}", himmelblau, s) for s in ((0.0, 0.0), (-0.27, -0.92), (100.0, -100.0))),
    Case("Powell's singular function", powell, (3.0, -1.0, 0.0, 1.0)),
    Case("Wood", wood, (-3.0, -1.0, -3.0, -1.0)),
    Case("Brown, badly scaled", brown, (1.0, 1.0)),
    Case("Powell, badly scaled", powell_badly_scaled, (0.0, 1.0)),
    Case("Freudenstein and Roth", freudenstein_roth, (0.5, -2.0), (0.0, 48.98425367924)),
    Case("Freudenstein and Roth, far", freudenstein_roth, (50.0, 20.0), (0.0, 48.98425367924)),
    Case("Jennrich and Sampson", jennrich_sampson, (0.3, 0.4), (124.36218235561, 259.5801907)),
    Case("Bard", bard, (1.0, 1.0, 1.0), (8.21487730657896e-3,)),
    Case("Kowalik and Osborne", kowalik_osborne, (0.25, 0.39, 0.415, 0.39), (3.0750560385e-4,)),
    Case("Brown and Dennis", brown_dennis, (25.0, 5.0, -5.0, -1.0), (85822.2016263563,)),
    Case("Box", box, (0.0, 10.0, 20.0)),
    Case("Broyden, tridiagonal", broyden, (-1.0,) * 10),
    Case("variably dimensioned", variably_dimensioned, tuple(1 - i / 8 for i in range(1, 9))),
    Case("Rosenbrock of ten", extended_rosenbrock, (-1.2, 1.0) * 5, (0.0, 3.98657909)),
    Case("Goldstein and Price", goldstein_price, (-0.5, 0.25), (3.0, 30.0, 84.0, 840.0)),
    Case("Branin", branin, (0.0, 0.0), (0.39788735772974,)),
    *(Case(f"six-hump camel from {s}", six_hump, s, SIX_HUMPS) for s in ((0.0, 0.0), (-1.5, 0.4), (2.0, 2.0))),
]  # fmt: skip
FAR = [
    Case("(x-1)^4 + (x-1)^2 from 1000", lambda x: (x[0] - 1) ** 4 + (x[0] - 1) ** 2, (1000.0,)),
    Case("1/x + x from 0.001", lambda x: 1 / x[0] + x[0], (1e-3,), (2.0,), lower=(0.0,)),
    Case("exp(-10 x) + x from -3", lambda x: exp(-10 * x[0]) + x[0], (-3.0,), (0.1 + 0.1 * 2.302585092994046,)),
    Case("1e5 x^4 + 1e-5 y^4", lambda x: 1e5 * x[0] ** 4 + 1e-5 * x[1] ** 4, (10.0, 10.0)),
    Case("1e-6 times a parabola", lambda x: 1e-6 * ((x[0] - 1) ** 2 + (x[1] - 2) ** 2), (3.0, 3.0), scale=1.0),
    Case("cosh from 30", lambda x: torch.cosh(x[0]), (30.0,), (1.0,)),
    Case("log(1 + x^2) from 40", lambda x: torch.log1p(x[0] ** 2), (40.0,)),
]
STATIONARY = [
    Case("maximum of a cosine", lambda x: cos(x[0]) + x[1] ** 2, (0.0, 0.0), (-1.0,)),
    Case("saddle", lambda x: x[0] ** 2 - x[1] ** 2 + x[1] ** 4, (0.0, 0.0), (-0.25,)),
    Case("inflection", lambda x: x[0] ** 3, (0.0,), (-1.0,), lower=(-1.0,)),
    Case("quartic maximum", lambda x: -(x[0] ** 4), (0.0,), (-1.0,), lower=(-1.0,), upper=(1.0,)),
    Case("maximum on a bound", lambda x: -(x[0] ** 2), (0.0,), (-4.0,), lower=(0.0,), upper=(2.0,)),
    Case("worst point of a circle", lambda x: x[0], (1.0, 0.0), (-1.0,), rows=lambda x: x @ x - 1, equal=1),
    Case("worst corner", lambda x: -(x[0] ** 2) - x[1], (0.0, 1.0), (-2.0,), lower=0.0, upper=1.0),
    Case("constant", lambda x: 0.0 * x.sum() + 3.0, (1.0, 2.0), (3.0,)),
    Case("one variable fixed", lambda x: ((x - 1) ** 2).sum(), (3.0, 4.0), (1.0,), lower=(0.0, 2.0), upper=(5.0, 2.0)),
]
UNQUALIFIED = [
    Case(
        "HS13",
        lambda x: (x[0] - 2) ** 2 + x[1] ** 2,
        (-2.0, -2.0),
        (1.0,),
        lower=(0.0, 0.0),
        rows=lambda x: (1 - x[0]) ** 3 - x[1],
        expected="failed",
    ),
    Case("-x with x^2 <= 0", lambda x: -x[0], (1.0,), rows=lambda x: -(x[0] ** 2)),  # solved: steps halve the distance
    Case(
        "circles that touch",
        lambda x: x[1],
        (0.5, 0.5),
        rows=lambda x: stack([1 - x[0] ** 2 - x[1] ** 2, 1 - (x[0] - 2) ** 2 - x[1] ** 2]),
        expected="failed",
    ),
    Case(
        "cusp",
        lambda x: x[0],
        (1.0, 0.5),
        rows=lambda x: stack([x[0] ** 3 - x[1], x[1]]),
        expected="failed",
    ),
]
WITHOUT = [
    Case("x >= 3 and x <= 1", lambda x: x @ x, (0.0, 0.0), (), rows=lambda x: stack([x[0] - 3, 1 - x[0]]), expected="infeasible"),
    Case("square below zero", lambda x: x.sum(), (0.3, -0.2), (), -5.0, 5.0, lambda x: -1 - ((x - 1) ** 2).sum(), expected="infeasible"),
    Case("circle beyond a line", lambda x: x.sum(), (0.3, -0.2), (), -5.0, 5.0, lambda x: stack([1 - x @ x, x[0] - 3]), expected="infeasible"),
    Case("line that falls", lambda x: -x[0] - x[1], (0.5, 0.6), (), expected="unbounded"),
    Case("cubic that falls", lambda x: x[0] ** 3, (1.0,), (), expected="unbounded"),
]  # fmt: skip
HOCK = [
    Case("HS8", lambda x: 0 * x[0] - 1.0, (2.0, 1.0), (-1.0,), rows=lambda x: stack([x @ x - 25, x[0] * x[1] - 9]), equal=2),
    Case("HS9", lambda x: sin(pi * x[0] / 12) * cos(pi * x[1] / 16), (0.0, 0.0), (-0.5,), rows=lambda x: 4 * x[0] - 3 * x[1], equal=1),
    Case("HS11", lambda x: (x[0] - 5) ** 2 + x[1] ** 2 - 25, (4.9, 0.1), (-8.498464223,), rows=lambda x: -(x[0] ** 2) + x[1]),
    Case("HS15", rosenbrock, (-2.0, 1.0), (306.5, 360.379767), upper=(0.5, inf), rows=lambda x: stack([x[0] * x[1] - 1, x[0] + x[1] ** 2])),
    Case("HS16", rosenbrock, (-2.0, 1.0), (0.25, 3.98206045, 23.1446609), lower=(-2.0, -inf), upper=(0.5, 1.0), rows=lambda x: stack([x[0] + x[1] ** 2, x[0] ** 2 + x[1]])),
    Case("HS17", rosenbrock, (-2.0, 1.0), (1.0,), lower=(-2.0, -inf), upper=(0.5, 1.0), rows=lambda x: stack([x[1] ** 2 - x[0], x[0] ** 2 - x[1]])),
    Case("HS18", lambda x: 0.01 * x[0] ** 2 + x[1] ** 2, (2.0, 2.0), (5.0,), lower=(2.0, 0.0), upper=50.0, rows=lambda x: stack([x[0] * x[1] - 25, x @ x - 25])),
    Case("HS19", lambda x: (x[0] - 10) ** 3 + (x[1] - 20) ** 3, (20.1, 5.84), (-6961.81387558015,), (13.0, 0.0), 100.0,
         lambda x: stack([(x[0] - 5) ** 2 + (x[1] - 5) ** 2 - 100, 82.81 - (x[1] - 5) ** 2 - (x[0] - 6) ** 2])),
    Case("HS20", rosenbrock, (-2.0, 1.0), (81.5 - 25 * sqrt(3), 40.1987298), lower=(-0.5, -inf), upper=(0.5, inf),
         rows=lambda x: stack([x[0] + x[1] ** 2, x[0] ** 2 + x[1], x @ x - 1])),
    Case("HS23", lambda x: x @ x, (3.0, 1.0), (2.0,), -50.0, 50.0,
         lambda x: stack([x.sum() - 1, x @ x - 1, 9 * x[0] ** 2 + x[1] ** 2 - 9, x[0] ** 2 - x[1], x[1] ** 2 - x[0]])),
    Case("HS24", lambda x: ((x[0] - 3) ** 2 - 9) * x[1] ** 3 / (27 * sqrt(3)), (1.0, 0.5), (-1.0, 0.0), lower=0.0,
         rows=lambda x: stack([x[0] / sqrt(3) - x[1], x[0] + sqrt(3) * x[1], 6 - x[0] - sqrt(3) * x[1]])),
    Case("HS29", lambda x: -x.prod(), (1.0, 1.0, 1.0), (-16 * sqrt(2),), rows=lambda x: 48 - x[0] ** 2 - 2 * x[1] ** 2 - 4 * x[2] ** 2),
    Case("HS30", lambda x: x @ x, (1.0, 1.0, 1.0), (1.0,), (1.0, -10.0, -10.0), 10.0, lambda x: x[0] ** 2 + x[1] ** 2 - 1),
    Case("HS31", lambda x: 9 * x[0] ** 2 + x[1] ** 2 + 9 * x[2] ** 2, (1.0, 1.0, 1.0), (6.0,), (-10.0, 1.0, -10.0), (10.0, 10.0, 1.0), lambda x: x[0] * x[1] - 1),
    Case("HS32", lambda x: (x[0] + 3 * x[1] + x[2]) ** 2 + 4 * (x[0] - x[1]) ** 2, (0.1, 0.7, 0.2), (1.0,), lower=0.0,
         rows=lambda x: stack([1 - x.sum(), 6 * x[1] + 4 * x[2] - x[0] ** 3 - 3]), equal=1),
    Case("HS33", lambda x: (x[0] - 1) * (x[0] - 2) * (x[0] - 3) + x[2], (0.0, 0.0, 3.0), (sqrt(2) - 6, -4.0), 0.0, (inf, inf, 5.0),
         lambda x: stack([x[2] ** 2 - x[1] ** 2 - x[0] ** 2, x @ x - 4])),
    Case("HS34", lambda x: -x[0], (0.0, 1.05, 2.9), (-0.8340324452,), 0.0, (100.0, 100.0, 10.0), lambda x: stack([x[1] - exp(x[0]), x[2] - exp(x[1])])),
    Case("HS36", lambda x: -x.prod(), (10.0, 10.0, 10.0), (-3300.0,), 0.0, (20.0, 11.0, 42.0), lambda x: 72 - x[0] - 2 * x[1] - 2 * x[2]),
    Case("HS37", lambda x: -x.prod(), (10.0, 10.0, 10.0), (-3456.0,), 0.0, 42.0, lambda x: stack([72 - x[0] - 2 * x[1] - 2 * x[2], x[0] + 2 * x[1] + 2 * x[2]])),
    Case("HS40", lambda x: -x.prod(), (0.8,) * 4, (-0.25,), rows=lambda x: stack([x[0] ** 3 + x[1] ** 2 - 1, x[0] ** 2 * x[3] - x[2], x[3] ** 2 - x[1]]), equal=3),
    Case("HS41", lambda x: 2 - x[0] * x[1] * x[2], (2.0,) * 4, (52 / 27,), 0.0, (1.0, 1.0, 1.0, 2.0), lambda x: x[0] + 2 * x[1] + 2 * x[2] - x[3], 1),
    Case("HS42", lambda x: ((x - torch.arange(1.0, 5.0, dtype=torch.float64)) ** 2).sum(), (1.0,) * 4, (28 - 10 * sqrt(2),),
         rows=lambda x: stack([x[0] - 2, x[2] ** 2 + x[3] ** 2 - 2]), equal=2),
    Case("HS44", lambda x: x[0] - x[1] - x[2] - x[0] * x[2] + x[0] * x[3] + x[1] * x[2] - x[1] * x[3], (0.0,) * 4, (-15.0, -13.0), lower=0.0,
         rows=lambda x: stack([8 - x[0] - 2 * x[1], 12 - 4 * x[0] - x[1], 12 - 3 * x[0] - 4 * x[1], 8 - 2 * x[2] - x[3], 8 - x[2] - 2 * x[3], 5 - x[2] - x[3]])),
    Case("HS45", lambda x: 2 - x.prod() / 120, (2.0,) * 5, (1.0, 2.0), 0.0, (1.0, 2.0, 3.0, 4.0, 5.0)),
    Case("HS46", lambda x: (x[0] - x[1]) ** 2 + (x[2] - 1) ** 2 + (x[3] - 1) ** 4 + (x[4] - 1) ** 6, (sqrt(2) / 2, 1.75, 0.5, 2.0, 2.0),
         rows=lambda x: stack([x[0] ** 2 * x[3] + sin(x[3] - x[4]) - 1, x[1] + x[2] ** 4 * x[3] ** 2 - 2]), equal=2),
    Case("HS49", lambda x: (x[0] - x[1]) ** 2 + (x[2] - 1) ** 2 + (x[3] - 1) ** 4 + (x[4] - 1) ** 6, (10.0, 7.0, 2.0, -3.0, 0.8),
         rows=lambda x: stack([x[0] + x[1] + x[2] + 4 * x[3] - 7, x[2] + 5 * x[4] - 6]), equal=2),
    Case("HS52", lambda x: (4 * x[0] - x[1]) ** 2 + (x[1] + x[2] - 2) ** 2 + (x[3] - 1) ** 2 + (x[4] - 1) ** 2, (2.0,) * 5, (1859 / 349,),
         rows=lambda x: stack([x[0] + 3 * x[1], x[2] + x[3] - 2 * x[4], x[1] - x[4]]), equal=3),
    Case("HS53", lambda x: (x[0] - x[1]) ** 2 + (x[1] + x[2] - 2) ** 2 + (x[3] - 1) ** 2 + (x[4] - 1) ** 2, (2.0,) * 5, (176 / 43,), -10.0, 10.0,
         lambda x: stack([x[0] + 3 * x[1], x[2] + x[3] - 2 * x[4], x[1] - x[4]]), 3),
    Case("HS61", lambda x: 4 * x[0] ** 2 + 2 * x[1] ** 2 + 2 * x[2] ** 2 - 33 * x[0] + 16 * x[1] - 24 * x[2], (0.0, 0.0, 0.0), (-143.6461422, -81.91),
         rows=lambda x: stack([3 * x[0] - 2 * x[1] ** 2 - 7, 4 * x[0] - x[2] ** 2 - 11]), equal=2),
    Case("HS63", lambda x: 1000 - x[0] ** 2 - 2 * x[1] ** 2 - x[2] ** 2 - x[0] * x[1] - x[0] * x[2], (2.0,) * 3, (961.7151721,), lower=0.0,
         rows=lambda x: stack([8 * x[0] + 14 * x[1] + 7 * x[2] - 56, x @ x - 25]), equal=2),
    Case("HS65", lambda x: (x[0] - x[1]) ** 2 + (x[0] + x[1] - 10) ** 2 / 9 + (x[2] - 5) ** 2, (-5.0, 5.0, 0.0), (0.9535288567,),
         (-4.5, -4.5, -5.0), (4.5, 4.5, 5.0), lambda x: 48 - x @ x),
    Case("HS66", lambda x: 0.2 * x[2] - 0.8 * x[0], (0.0, 1.05, 2.9), (0.5181632741,), 0.0, (100.0, 100.0, 10.0), lambda x: stack([x[1] - exp(x[0]), x[2] - exp(x[1])])),
    Case("HS77", lambda x: (x[0] - 1) ** 2 + (x[0] - x[1]) ** 2 + (x[2] - 1) ** 2 + (x[3] - 1) ** 4 + (x[4] - 1) ** 6, (2.0,) * 5, (0.24150513,),
         rows=lambda x: stack([x[0] ** 2 * x[3] + sin(x[3] - x[4]) - 2 * sqrt(2), x[1] + x[2] ** 4 * x[3] ** 2 - 8 - sqrt(2)]), equal=2),
    Case("HS78", lambda x: x.prod(), (-2.0, 1.5, 2.0, -1.0, -1.0), (-2.91970041,),
         rows=lambda x: stack([x @ x - 10, x[1] * x[2] - 5 * x[3] * x[4], x[0] ** 3 + x[1] ** 3 + 1]), equal=3),
    Case("HS80", lambda x: exp(x.prod()), (-2.0, 2.0, 2.0, -1.0, -1.0), (0.0539498478,), (-2.3, -2.3, -3.2, -3.2, -3.2), (2.3, 2.3, 3.2, 3.2, 3.2),
         lambda x: stack([x @ x - 10, x[1] * x[2] - 5 * x[3] * x[4], x[0] ** 3 + x[1] ** 3 + 1]), 3),
    Case("HS100", lambda x: (x[0] - 10) ** 2 + 5 * (x[1] - 12) ** 2 + x[2] ** 4 + 3 * (x[3] - 11) ** 2 + 10 * x[4] ** 6 + 7 * x[5] ** 2 + x[6] ** 4
         - 4 * x[5] * x[6] - 10 * x[5] - 8 * x[6], (1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0), (680.6300573,),
         rows=lambda x: stack([127 - 2 * x[0] ** 2 - 3 * x[1] ** 4 - x[2] - 4 * x[3] ** 2 - 5 * x[4], 282 - 7 * x[0] - 3 * x[1] - 10 * x[2] ** 2 - x[3] + x[4],
                               196 - 23 * x[0] - x[1] ** 2 - 6 * x[5] ** 2 + 8 * x[6], -4 * x[0] ** 2 - x[1] ** 2 + 3 * x[0] * x[1] - 2 * x[2] ** 2 - 5 * x[5] + 11 * x[6]])),
]  # fmt: skip


def _published(case: dict) -> Case:
    """One of the 27 problems of the reference file."""
    texts = [*case["equalities"], *case["inequalities"]]
    rows = [hock_schittkowski.expression(text) for text in texts]
    limits = [
        None if case[key] is None else tuple(end if v is None else float(v) for v in case[key])
        for key, end in (("lower", -inf), ("upper", inf))
    ]
    minima = {case["f_opt"], hock_schittkowski.optimum(case)}
    together = (lambda x: stack([row(x) for row in rows])) if rows else None
    objective = hock_schittkowski.expression(case["objective"])
    start = tuple(float(v) for v in case["x0"])
    return Case(case["name"], objective, start, tuple(minima), *limits, together, len(case["equalities"]))


PUBLISHED = [_published(case) for case in hock_schittkowski.PROBLEMS]
_BY_NAME = {case.name: case for case in [*CLASSICS, *HOCK, *PUBLISHED]}
SCALED = [
    _BY_NAME[name].scaled(scale)
    for name in ("Rosenbrock from (-1.2, 1.0)", "Freudenstein and Roth", "Powell's singular function", "HS71", "HS43", "HS29", "HS100")
    for scale in (1e-8, 1e-4, 1e4, 1e8)
]  # fmt: skip
ALL = [*CLASSICS, *FAR, *STATIONARY, *UNQUALIFIED, *WITHOUT, *PUBLISHED, *HOCK, *SCALED]
