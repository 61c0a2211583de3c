"""The main problem: least gross mass of the Lift+Cruise over 109 design variables under 17 constraints.

So many with the published eight lift rotors; other layouts of the vehicle file have their own numbers.
"""

from collections.abc import Mapping
from dataclasses import replace

import torch

from lpc_mdo.config import Bound, Mission, Vehicle
from lpc_mdo.config.layout import lift_pairs
from lpc_mdo.model.analysis import Analysis
from lpc_mdo.model.analyzer import Analyzer
from lpc_mdo.problems.lift_motors import least_lift_motor
from lpc_mdo.problems.outputs import gross_weight_outputs
from lpc_mdo.problems.problem import Objective, Problem, Variable
from lpc_mdo.problems.rows import gross_weight_rows
from lpc_mdo.problems.variables import aircraft_variables, segment_variables


def gross_weight_problem(vehicle: Vehicle, mission: Mission) -> Problem[Analysis]:
    """The 109-variable problem in its published form; bounds are the vehicle file's.

    Another aircraft or mission has the variables and rows of its own rotors and segments. `reduced` is the same without what
    symmetry settles.
    """
    return with_motors_that_hover(aircraft_problem(vehicle, mission))


def aircraft_problem(vehicle: Vehicle, mission: Mission) -> Problem[Analysis]:
    """The same with the vehicle file's bounds of the lift motors, whatever the rule for them says."""
    analyzer = Analyzer(vehicle, mission)
    return Problem(
        name="gross-weight",
        formulation="paper",
        variables=(*aircraft_variables(vehicle), *segment_variables(analyzer.schedule)),
        constraints=gross_weight_rows(analyzer.schedule),
        objective=Objective("gross_mass", "kg", lambda a: a.gross_mass, scale=100.0),
        analyze_design=analyzer,
        outputs=gross_weight_outputs,
    )


def with_motors_that_hover(problem: Problem[Analysis]) -> Problem[Analysis]:
    """The problem with start and bounds of the lift motors as its vehicle's file and rule say, in whatever formulation.

    The rule, `least_lift_motor`, raises lower bounds, and starts below them. Whatever they were before does not matter.
    """
    vehicle = problem.analyze_design.vehicle
    bounds, motors = vehicle.bounds, vehicle.motors
    sizes = {
        "motor_length": (bounds.lift_motor_length, motors.lift_length),
        "motor_diameter": (bounds.lift_motor_diameter, motors.lift_bore),
    }
    plain = _with_lift_motors(problem, {name: (file, file.lower, start) for name, (file, start) in sizes.items()})
    if motors.lift_bounds == "file":
        return plain
    with torch.no_grad():
        least = least_lift_motor(vehicle, plain.analyze(plain.x0))
    floors = {"motor_length": least.length, "motor_diameter": least.bore}
    raised = {
        name: (
            file.model_copy(update={"reason": least.reason}) if floors[name] > file.lower else file,
            max(floors[name], file.lower),
            max(floors[name], start),
        )
        for name, (file, start) in sizes.items()
    }
    return _with_lift_motors(problem, raised)


def _with_lift_motors(problem: Problem[Analysis], sizes: Mapping[str, tuple[Bound, float, float]]) -> Problem[Analysis]:
    """bound with its reason, lower bound and start of all lift motors by the variable's name; the pusher's stay."""

    def changed(variable: Variable) -> Variable:
        if variable.name not in sizes:
            return variable
        (file, lower, start), vehicle = sizes[variable.name], problem.analyze_design.vehicle
        # Lift rotors come first, all of them or, in the reduced formulation, those to port.
        is_whole = variable.size[0] == len(vehicle.rotors)
        lift = len(vehicle.lift_rotors) if is_whole else len(lift_pairs(vehicle))
        return replace(
            variable,
            lower=[lower] * lift + variable.lower_tensor[lift:].tolist(),
            initial=[start] * lift + variable.initial_tensor[lift:].tolist(),
            reason=[file.reason] * lift + list(variable.reasons[lift:]),
        )

    return replace(problem, variables=tuple(changed(variable) for variable in problem.variables))
