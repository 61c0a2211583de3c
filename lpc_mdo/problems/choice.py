"""The problem that a command asks for."""

from pathlib import Path

from lpc_mdo.config import ConfigurationError, Mission, Vehicle
from lpc_mdo.problems import full_envelope
from lpc_mdo.problems.aeroacoustic import Observer, WeightedSum, aeroacoustic_problem
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.problems.problem_file import problem_of
from lpc_mdo.problems.reduced import reduced, reduced_problem

Case = tuple[WeightedSum, Observer] | Path | str | None
"""Blades in hover with their weights and observer, a problem file, the name of another problem of the whole aircraft, or the
gross-weight problem."""


def chosen_problem(vehicle: Vehicle, mission: Mission, case: Case, is_reduced: bool) -> Problem:
    """The gross-weight problem, in one of its formulations, or what `case` asks for.

    Raises ConfigurationError for a reduced formulation of the aeroacoustic problem, which has none, and of a problem file, which
    says its own.
    """
    if case is None:
        return (reduced_problem if is_reduced else gross_weight_problem)(vehicle, mission)
    if case == full_envelope.NAME:
        problem = full_envelope.full_envelope_problem(vehicle, mission)
        return reduced(problem) if is_reduced else problem
    if isinstance(case, Path):
        if is_reduced:
            raise ConfigurationError(
                f"--formulation reduced is invalid with --problem {case}: it is a key of that file."
            )
        return problem_of(case, vehicle, mission)
    if is_reduced:
        raise ConfigurationError(
            "--formulation reduced is not allowed with --problem aeroacoustic; it needs gross-weight."
        )
    return aeroacoustic_problem(vehicle, mission, *case)
