"""The problem that a command asks for."""

from lpc_mdo.config import ConfigurationError, Mission, Vehicle
from lpc_mdo.problems.aeroacoustic import Observer, WeightedSum, aeroacoustic_problem
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Problem
from lpc_mdo.problems.reduced import reduced_problem


def chosen_problem(
    vehicle: Vehicle, mission: Mission, blades: tuple[WeightedSum, Observer] | None, is_reduced: bool
) -> Problem:
    """The aeroacoustic problem for `blades`, else the gross-weight problem in one of its formulations.

    Raises ConfigurationError for a reduced formulation of the aeroacoustic problem, which has none.
    """
    if blades is None:
        return (reduced_problem if is_reduced else gross_weight_problem)(vehicle, mission)
    if is_reduced:
        raise ConfigurationError(
            "--formulation reduced is not allowed with --problem aeroacoustic; it needs gross-weight."
        )
    return aeroacoustic_problem(vehicle, mission, *blades)
