"""Our rotor and motor in somebody else's OpenMDAO model: least electrical power of a lift unit at a given thrust.

Needs the extra `openmdao`: pip install 'lpc-mdo[openmdao]'.
"""

import numpy as np
import openmdao.api as om
import torch

from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, blade_element_momentum
from lpc_mdo.disciplines.motor import operate_motor
from lpc_mdo.disciplines.motor_sizing import size_motor
from lpc_mdo.interop.openmdao import DisciplineComponent, Port
from lpc_mdo.numerics.bsplines import basis_matrix
from lpc_mdo.surrogates.airfoil import load_airfoil

THRUST, GEAR_RATIO = 4000.0, 4.0  # N
stations = (torch.arange(28, dtype=torch.float64) + 0.5) / 28
twist_basis, chord_basis = basis_matrix(stations, 4, 3), basis_matrix(stations, 2, 1)
air = standard_atmosphere(torch.tensor(76.2, dtype=torch.float64))
polar = load_airfoil("naca4412")


def rotor(twist: torch.Tensor, chord: torch.Tensor, speed: torch.Tensor) -> dict[str, torch.Tensor]:
    radius = torch.tensor(1.524, dtype=torch.float64)
    two = torch.tensor(2.0, dtype=torch.float64)
    blades = Rotor(radius, 0.2 * radius, chord_basis @ chord, twist_basis @ twist, two)
    hover = Inflow(torch.zeros_like(speed), speed, air.density, air.speed_of_sound, air.dynamic_viscosity)
    loads = blade_element_momentum(blades, hover, polar)
    return {"thrust": loads.thrust, "torque": loads.torque}


def motor(torque: torch.Tensor, speed: torch.Tensor, diameter: torch.Tensor, length: torch.Tensor):
    sized = size_motor(diameter, length)
    operation = operate_motor(sized.circuit, torque / GEAR_RATIO, speed * GEAR_RATIO)
    return {"power": operation.input_power, "mass": sized.mass}


problem = om.Problem(reports=False)
model = problem.model
model.add_subsystem(
    "rotor",
    DisciplineComponent(
        rotor,
        inputs={
            "twist": Port(np.radians([30.0, 23.3, 16.7, 10.0]), "rad"),
            "chord": Port([0.3, 0.1], "m"),
            "speed": Port(125.66, "rad/s"),
        },
        outputs={"thrust": Port(0.0, "N"), "torque": Port(0.0, "N*m")},
    ),
    promotes=["*"],
)
model.add_subsystem(
    "motor",
    DisciplineComponent(
        motor,
        inputs={
            "torque": Port(200.0, "N*m"),
            "speed": Port(125.66, "rad/s"),
            "diameter": Port(0.235, "m"),
            "length": Port(0.065, "m"),
        },
        outputs={"power": Port(0.0, "W"), "mass": Port(0.0, "kg")},
    ),
    promotes=["*"],
)
model.set_input_defaults("speed", 125.66, units="rad/s")
model.add_design_var("twist", lower=np.radians(3.0), upper=np.radians(60.0))
model.add_design_var("chord", lower=0.05, upper=0.5)
model.add_design_var("speed", lower=60.0, upper=190.0, ref=100.0)
model.add_constraint("thrust", equals=THRUST, ref=THRUST)
model.add_objective("power", ref=1e5)
problem.driver = om.ScipyOptimizeDriver(optimizer="SLSQP", tol=1e-8, disp=False)
problem.setup()
problem.run_model()
partials = problem.check_partials(out_stream=None, method="fd", form="central", step=1e-6, step_calc="rel_avg")
power_before = float(problem.get_val("power", units="kW")[0]), float(problem.get_val("thrust")[0])
has_failed = problem.run_driver().success is False

if __name__ == "__main__":
    print(f"before: {power_before[0]:.1f} kW at {power_before[1]:.0f} N")
    print(f"after: {problem.get_val('power', units='kW')[0]:.1f} kW at {problem.get_val('thrust')[0]:.0f} N")
    worst = max(entry["rel error"].forward for pairs in partials.values() for entry in pairs.values())
    print(f"largest relative difference of the partials from central differences: {worst:.1e}")
