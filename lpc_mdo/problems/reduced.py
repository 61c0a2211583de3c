"""The gross-weight problem without what symmetry settles: one of two mirrored rotors, no row that only equates variables."""

from collections.abc import Mapping
from dataclasses import replace

import torch
from torch import Tensor

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.config.layout import own_rotors
from lpc_mdo.model.analysis import Analysis, Analyzer
from lpc_mdo.model.design import Design
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.problem import Constraint, Problem

PER_ROTOR = ("rotor_radius", "blade_twist", "blade_chord", "motor_length", "motor_diameter")
PER_LIFT_ROTOR = ("lift_rotor_speed",)
FOLLOWS = {"climb_end_altitude": "cruise_altitude"}
"""Variables that a row equates with another one."""


def reduced_problem(vehicle: Vehicle, mission: Mission) -> Problem[Analysis]:
    """The published problem with starboard lift rotors and motors copied from the port ones, and climb ended at cruise altitude.

    Symmetry rows, the row of altitudes and the variables that they settle are gone; rows with a component a side keep the
    port one. Every design of it is one of the published problem, and the best of those is among them.
    """
    published = gross_weight_problem(vehicle, mission)
    own, place = own_rotors(vehicle)
    kept = {name: own for name in PER_ROTOR} | {name: own[:-1] for name in PER_LIFT_ROTOR}
    whole = {name: torch.tensor(place) for name in PER_ROTOR}
    whole |= {name: torch.tensor(place[:-1]) for name in PER_LIFT_ROTOR}

    def complete(values: Mapping[str, Tensor]) -> Design:
        batch = values["cruise_altitude"].dim()
        spread = {
            name: value.index_select(batch, whole[name]) if name in whole else value for name, value in values.items()
        }
        return Design(**spread, **{name: values[other] for name, other in FOLLOWS.items()})

    return replace(
        published,
        formulation="reduced",
        variables=tuple(
            variable.at(kept[variable.name]) if variable.name in kept else variable
            for variable in published.variables
            if variable.name not in FOLLOWS
        ),
        constraints=tuple(
            _of_port_rotors(row) if row.name.startswith("tip_clearance_") else row
            for row in published.constraints
            if row.name != "altitude_match" and not row.name.startswith(("rotor_symmetry_", "motor_symmetry_"))
        ),
        analyze_design=Analyzer(vehicle, mission, published.analyze_design.geometry, is_mirrored=True),
        complete=complete,
    )


def _of_port_rotors(row: Constraint[Analysis]) -> Constraint[Analysis]:
    """The first component (...,) of a row that has one for port and one for starboard rotors."""
    return replace(row, of=lambda a: row.of(a)[..., 0])
