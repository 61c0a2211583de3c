"""A problem without what symmetry settles: one of two mirrored rotors, no row that only equates variables."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.analyzer import Analyzer
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Constraint, Problem


def reduced_problem(vehicle: Vehicle, mission: Mission) -> Problem[Analysis]:
    """The published problem, reduced."""
    return reduced(gross_weight_problem(vehicle, mission))


def reduced(problem: Problem[Analysis]) -> Problem[Analysis]:
    """The problem with starboard rotors and motors copied from their port twins, and variables copied from those they follow.

    Rows that only equate variables and the variables that they settle are gone; rows with a component a side keep the
    port one. Every design of it is one of the given problem, and the best of those is among them.
    """
    analyzer = problem.analyze_design
    own = {v.name: sorted(set(v.twins)) for v in problem.variables if v.twins}
    place = {v.name: torch.tensor([own[v.name].index(twin) for twin in v.twins]) for v in problem.variables if v.twins}
    first_dimension = {v.name: -len(v.size) for v in problem.variables}
    follows = {v.name: v.follows for v in problem.variables if v.follows}

    def complete(values: Mapping[str, Tensor]) -> Any:
        whole = {
            name: value.index_select(first_dimension[name], place[name]) if name in place else value
            for name, value in values.items()
        }
        return problem.complete(whole | {name: values[other] for name, other in follows.items()})

    return replace(
        problem,
        formulation="reduced",
        variables=tuple(
            variable.at(own[variable.name]) if variable.twins else variable
            for variable in problem.variables
            if not variable.follows
        ),
        constraints=tuple(
            _of_port_side(row) if row.is_two_sided else row for row in problem.constraints if not row.only_equates
        ),
        analyze_design=Analyzer(analyzer.vehicle, analyzer.mission, analyzer.geometry, is_mirrored=True),
        complete=complete,
    )


def _of_port_side(row: Constraint[Analysis]) -> Constraint[Analysis]:
    """The first component (...,) of a row that has one for port and one for starboard rotors."""
    return replace(row, of=lambda a: row.of(a)[..., 0], is_two_sided=False)
