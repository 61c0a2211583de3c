"""Which design variables end on a bound, and why that bound stands where it does."""

from torch import Tensor

from lpc_mdo.problems.problem import Problem
from lpc_mdo.stored.diagnosis import OnBound

REACH = 1e-6  # of the range between the bounds


def on_bounds(problem: Problem, x: Tensor) -> list[OnBound]:
    """In the order of the variables; scalars that share a bound and its reason are counted together. x (n,) is scaled."""
    counts: dict[tuple[str, str, str, float, int, str], int] = {}
    for variable, part in zip(problem.variables, x.split([v.count for v in problem.variables]), strict=True):
        lower, upper = variable.lower_tensor.flatten().tolist(), variable.upper_tensor.flatten().tolist()
        for value, least, most, reason in zip(part.tolist(), lower, upper, variable.reasons, strict=True):
            for side, is_there, bound in (
                ("lower", value <= -1.0 + 2.0 * REACH, least),
                ("upper", value >= 1.0 - 2.0 * REACH, most),
            ):
                if is_there:
                    key = (variable.name, variable.unit, side, bound, variable.count, reason)
                    counts[key] = counts.get(key, 0) + 1
    return [
        OnBound.model_construct(variable=name, unit=unit, side=side, bound=bound, count=count, size=size, reason=reason)
        for (name, unit, side, bound, size, reason), count in counts.items()
    ]
