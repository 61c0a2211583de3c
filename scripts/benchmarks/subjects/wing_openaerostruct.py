"""Induced drag of the wing and its total derivatives, by OpenAerostruct and OpenMDAO's adjoint."""

from typing import Any

import numpy as np
import openmdao.api as om
from openaerostruct.aerodynamics.aero_groups import AeroPoint

from benchmarks.subject import Task
from benchmarks.subjects.wing import DENSITY, HALF_SPAN, SECTIONS, SPEED, interpolation, start

LIFT, DRAG = "point.wing_perf.L", "point.wing_perf.D"


class _Mesh(om.ExplicitComponent):
    """From the sections' chords and twists (12,) to the corners of the panels."""

    def initialize(self) -> None:
        self.options.declare("chordwise", types=int)
        self.options.declare("half", types=int)

    def setup(self) -> None:
        chordwise, half = self.options["chordwise"], self.options["half"]
        self.y = np.linspace(-HALF_SPAN, HALF_SPAN, 2 * half + 1)
        self.weights = interpolation(self.y)
        self.along = np.linspace(0.0, 1.0, chordwise + 1)[:, None]
        self.add_input("sections", shape=2 * SECTIONS)
        self.add_output("mesh", shape=(chordwise + 1, 2 * half + 1, 3), units="m")
        self.declare_partials("mesh", "sections")

    def compute(self, inputs: Any, outputs: Any) -> None:
        outputs["mesh"] = self.mesh(inputs["sections"])

    def mesh(self, sections: np.ndarray) -> np.ndarray:
        chord, twist = self.weights @ sections[:SECTIONS], self.weights @ sections[SECTIONS:]
        behind = self.along * chord
        x, z = behind * np.cos(twist) - 0.25 * chord, -behind * np.sin(twist)
        return np.stack([x, np.broadcast_to(self.y, x.shape), z], axis=-1)

    def compute_partials(self, inputs: Any, partials: Any) -> None:
        sections = inputs["sections"]
        chord, twist = self.weights @ sections[:SECTIONS], self.weights @ sections[SECTIONS:]
        along, weights = self.along[..., None], self.weights
        zero = np.zeros((len(self.along), *weights.shape))
        cos, sin = np.cos(twist)[:, None], np.sin(twist)[:, None]
        turned = along * chord[:, None] * weights
        by_chord = np.stack([(along * cos - 0.25) * weights, zero, -along * sin * weights], axis=2)
        by_twist = np.stack([-turned * sin, zero, -turned * cos], axis=2)
        partials["mesh", "sections"] = np.concatenate([by_chord, by_twist], axis=-1).reshape(-1, 2 * SECTIONS)


def prepare(chordwise: int, half: int) -> Task:
    """`half` panels across each half span."""
    problem = om.Problem(reports=False)
    mesh = _Mesh(chordwise=chordwise, half=half)
    values = problem.model.add_subsystem("values", om.IndepVarComp(), promotes=["*"])
    x0 = start()
    values.add_output("sections", x0[:-1])
    values.add_output("alpha", x0[-1], units="rad")
    for name, value, units in (
        ("v", SPEED, "m/s"),
        ("rho", DENSITY, "kg/m**3"),
        ("re", 1e6, "1/m"),
        ("Mach_number", 0.0, None),
        ("cg", np.zeros(3), "m"),
    ):
        values.add_output(name, value, units=units)
    problem.model.add_subsystem("mesh_of_sections", mesh, promotes=["*"])
    surface = {
        "name": "wing",
        "symmetry": False,
        "S_ref_type": "projected",
        "mesh": np.zeros((chordwise + 1, 2 * half + 1, 3)),
        "CL0": 0.0,
        "CD0": 0.0,
        "with_viscous": False,
        "with_wave": False,
        "k_lam": 0.05,
        "t_over_c_cp": np.array([0.12]),
        "c_max_t": 0.303,
    }
    flow = ["v", "alpha", "Mach_number", "re", "rho", "cg"]
    problem.model.add_subsystem("point", AeroPoint(surfaces=[surface]), promotes_inputs=flow)
    for corner in ("wing.def_mesh", "aero_states.wing_def_mesh"):
        problem.model.connect("mesh", f"point.{corner}")
    problem.setup(mode="rev")

    def run() -> np.ndarray:
        problem.run_model()
        return problem.compute_totals(of=[DRAG], wrt=["sections", "alpha"], return_format="array")[0]

    def check() -> dict[str, Any]:
        gradient = run()
        return {"lift": problem[LIFT].item(), "drag": problem[DRAG].item(), "gradient": gradient.tolist()}

    return Task(run, check)
