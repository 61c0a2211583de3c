"""The problems of Hock and Schittkowski as they stand in reference/hock_schittkowski.json, ready to be solved."""

import json
from pathlib import Path

import torch

from lpc_mdo.optimization import Options, minimize

PROBLEMS = json.loads((Path(__file__).parent / "reference/hock_schittkowski.json").read_text())["problems"]
OTHER_OPTIMUM = {"HS2": 4.9412293180}  # Rosenbrock's valley cut by x2 >= 1.5: the local minimum on the start's side
TIGHT = Options(stationarity_tolerance=1e-6, feasibility_tolerance=1e-10, outer_iterations=60, inner_iterations=500)
FLAT = {
    "HS64": 1e-8
}  # stationarity asked for: scaled by its slope at the start, the objective is nearly flat at the optimum


def _of_numbers_too(function):
    return lambda value: function(torch.as_tensor(value, dtype=torch.float64))


def expression(text: str):
    code = compile(text, "problem", "eval")
    functions = {name: _of_numbers_too(getattr(torch, name)) for name in ("sin", "cos", "exp", "log", "sqrt")}
    return lambda x: eval(code, {**functions, **{f"x{i + 1}": value for i, value in enumerate(x)}})


def bounds(values, count: int, missing: float):
    if values is None:
        return None
    return torch.tensor([missing if v is None else float(v) for v in values], dtype=torch.float64)


def solve(case, **options):
    rows = [expression(text) for text in [*case["equalities"], *case["inequalities"]]]
    equal = len(case["equalities"])
    upper = torch.full((len(rows),), float("inf"), dtype=torch.float64)
    upper[:equal] = 0.0
    return minimize(
        expression(case["objective"]),
        torch.tensor(case["x0"], dtype=torch.float64),
        bounds(case["lower"], case["n"], -float("inf")),
        bounds(case["upper"], case["n"], float("inf")),
        (lambda x: torch.stack([row(x) for row in rows])) if rows else None,
        torch.zeros(len(rows), dtype=torch.float64) if rows else None,
        upper if rows else None,
        **options,
    )


def optimum(case) -> float:
    return OTHER_OPTIMUM.get(case["name"], case["f_opt"])


def violation(case, x) -> float:
    missed = [abs(float(expression(text)(x))) for text in case["equalities"]]
    missed += [max(0.0, -float(expression(text)(x))) for text in case["inequalities"]]
    return max(missed, default=0.0)
