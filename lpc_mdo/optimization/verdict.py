"""Whether a point is an optimum, by figures that do not depend on where a search began or on how large the objective is.

The certificate's scaled gradients alone can be small far from an optimum, where everything is flat. So Newton's step from the
point must be short, and what it promises little; the Lagrangian must not curve downward along the active rows; and multipliers
must be finite, or the point satisfies no optimality conditions at all.
"""

from dataclasses import dataclass

import numpy as np

from lpc_mdo.optimization.certificate import Certificate
from lpc_mdo.optimization.functions import Functions
from lpc_mdo.optimization.quadratic import Proposal, QuadraticModel

GAIN = 1e-3  # of the tolerance of stationarity: what Newton's step may promise, relative to the objective
GAP = 1e-1  # of it: what slack and violation may be worth
TIGHT_STEP, TIGHT_GAIN, TIGHT_NOISE, TIGHT_GAP = (
    1e-7,
    1e-13,
    1e-5,
    1e-8,
)  # what the last steps are asked for, since they cost little
NEAR = 1e-3  # distance from a bound, relative to max(1, |x|)
DOWNWARD = 1e-5  # of the largest curvature: what is above minus this is taken for noise of differences
LARGEST_MULTIPLIER, HOPELESS_MULTIPLIER = 1e5, 1e9  # relative to the objective's gradient


@dataclass(frozen=True)
class Remainder:
    """What is left to an optimum: Newton's step relative to max(1, |x|), and its promise in the scaled objective."""

    step: float
    gain: float
    gap: float  # sum of |multiplier| times slack or violation over rows and bounds
    objective: float

    def is_small(self, step: float, gain: float, gap: float) -> bool:
        """A promise that is nothing beside the objective; or a short step with one that is nothing beside one."""
        size = abs(self.objective)
        is_settled = self.gain <= gain * size or (self.step <= step and self.gain <= gain * max(1.0, size))
        return is_settled and self.gap <= gap * max(1.0, size)

    def is_settled(self, tolerance: float) -> bool:
        """Whether it is within the tolerance of stationarity."""
        return self.is_small(tolerance, GAIN * tolerance, GAP * tolerance)

    def unsettled(self) -> "Fault":
        return Fault(
            f"gradients are small but the point is not settled: Newton's step from here changes variables by up to "
            f"{self.step:.2g} and promises {max(self.gain, self.gap):.2g} of an objective of {self.objective:.2g} (scaled)"
        )

    def is_tiny(self, noise: float, tolerance: float) -> bool:
        """Nothing to gain beyond what the relative noise of second derivatives lets one see."""
        return self.is_small(TIGHT_STEP, max(TIGHT_GAIN, TIGHT_NOISE * noise), min(TIGHT_GAP, GAP * tolerance))


def remainder(evaluator: Functions, x: np.ndarray, multipliers: np.ndarray, model: QuadraticModel) -> Remainder:
    """From x (n,); infinite where the linear rows cannot be met."""
    proposal: Proposal | None = model.minimize(0.0)
    objective = evaluator.values(x)[0]
    gap = gap_of(evaluator, x, multipliers)
    if proposal is None:
        return Remainder(np.inf, np.inf, gap, objective)
    step = proposal.step[model.free]
    gain = abs(proposal.slope) + 0.5 * abs(float(step @ model.hessian @ step))
    relative = np.abs(proposal.step) / np.maximum(1.0, np.abs(x))
    return Remainder(float(relative.max(initial=0.0)), gain, gap, objective)


def gap_of(evaluator: Functions, x: np.ndarray, multipliers: np.ndarray) -> float:
    """What slack and violation of rows and bounds are worth at their multipliers."""
    _, values = evaluator.values(x)
    lower, upper = evaluator.limits
    pressure = evaluator.gradient(x, multipliers)
    rows = np.where(multipliers > 0.0, upper - values, values - lower)[multipliers != 0.0]
    room = np.where(pressure > 0.0, x - evaluator.lower, evaluator.upper - x)
    near = room <= NEAR * np.maximum(1.0, np.abs(x))  # farther away it is no bound that holds the variable
    return float(np.abs(multipliers[multipliers != 0.0] * rows).sum() + np.abs(pressure[near] * room[near]).sum())


@dataclass(frozen=True)
class Fault:
    """Why a point is no optimum; `is_final`: further search from it would not help."""

    words: str
    is_final: bool = False


UNQUALIFIED = Fault(
    "the constraint qualification fails here: multipliers grow without bound as the point nears the constraints, so that "
    "no optimality conditions hold",
    is_final=True,
)
DOWNHILL = Fault(
    "the point is stationary, but the objective curves downward along the active constraints", is_final=True
)


def pressure(model: QuadraticModel, multipliers: np.ndarray) -> float:
    """The largest scaled multiplier (m,), relative to the objective's gradient or to one."""
    return float(np.abs(multipliers).max(initial=0.0)) / max(float(np.abs(model.gradient).max(initial=0.0)), 1.0)


def missing(certificate: Certificate, tolerances: tuple[float, float]) -> Fault:
    """What the first-order conditions lack."""
    return Fault(
        f"stationarity {certificate.stationarity:.2g}, violation {certificate.feasibility:.2g} and complementarity "
        f"{certificate.complementarity:.2g} are not within {tolerances[0]:g}, {tolerances[1]:g} and {tolerances[0]:g}"
    )


def fault(
    multipliers: np.ndarray,
    certificate: Certificate,
    model: QuadraticModel,
    left: Remainder,
    tolerances: tuple[float, float],
) -> Fault | None:
    """Why a point with multipliers (m,) is no optimum; None where it is one."""
    if certificate.feasibility <= tolerances[1] and pressure(model, multipliers) > LARGEST_MULTIPLIER:
        return UNQUALIFIED
    if not certificate.holds(*tolerances):
        return missing(certificate, tolerances)
    return None if left.is_settled(tolerances[0]) else left.unsettled()


def least_curvature(model: QuadraticModel) -> float:
    """Of the Lagrangian along the active rows, relative to the largest; zero where nothing is free."""
    return float(model.curvature[0]) / model.stiffness if len(model.curvature) else 0.0
