"""The problem that a command asks for."""

from collections.abc import Iterable
from pathlib import Path

from lpc_mdo.config import ConfigurationError, Mission, Vehicle, vehicle_sentence
from lpc_mdo.problems.aeroacoustic import Observer, WeightedSum, aeroacoustic_problem
from lpc_mdo.problems.file_keys import file_key
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Problem, StartError
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


def start_sentence(error: StartError, vehicle: Vehicle, path: Path | None, overrides: Iterable[str]) -> str:
    """The sentence on a start beyond its bounds as the vehicle file's reader needs it: file, key, value, rule, line."""
    if (found := file_key(error.variable.name, error.at, vehicle)) is None:
        return f"{error}."
    (key, factor), variable = found, error.variable
    lower, upper = (factor * bound for bound in (variable.lower, variable.upper))
    what = (
        f" = {factor * error.value:.6g} is invalid: it must lie between {lower:.6g} and {upper:.6g}, the bounds of the "
        f"design variable {variable.name} that starts there"
    )
    return vehicle_sentence(path, overrides, key, what)
