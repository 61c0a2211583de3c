"""Constrained optimization over torch functions; knows nothing of aircraft."""

from lpc_mdo.optimization.result import Hooks, OptimizationResult, Options, Progress
from lpc_mdo.optimization.solvers import minimize, minimize_problem

__all__ = ["Hooks", "OptimizationResult", "Options", "Progress", "minimize", "minimize_problem"]
