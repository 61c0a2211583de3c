"""Induced drag of the wing and its gradient, by AeroSandbox's vortex lattice and CasADi's reverse mode.

The lattice is run once on CasADi symbols. The function so made is called again and again, as AeroSandbox's optimizations
do, and making it is not timed; or it is made for every call, as where a shape is looked at once.
"""

from typing import Any

import aerosandbox
import aerosandbox.numpy as either
import casadi
import numpy as np

from benchmarks.subject import Task
from benchmarks.subjects.wing import DENSITY, SECTIONS, SPEED, section_positions, start


def prepare(chordwise: int, half: int) -> Task:
    """`half` panels across each half span, a multiple of the number of intervals between sections."""
    function = _function(chordwise, half)

    def check() -> dict[str, Any]:
        lift, drag, gradient = function(start())
        return {"lift": float(lift), "drag": float(drag), "gradient": np.array(gradient).ravel().tolist()}

    return Task(lambda: function(start()), check)


def prepare_anew(chordwise: int, half: int) -> Task:
    """The function made and called once; `half` as above."""
    return Task(lambda: _function(chordwise, half)(start()), lambda: prepare(chordwise, half).check())


def _function(chordwise: int, half: int) -> Any:
    x = casadi.MX.sym("x", len(start()))
    lift, drag = _loads(x, chordwise, half // (SECTIONS - 1))
    return casadi.Function("wing", [x], [lift, drag, casadi.gradient(drag, x)])


def prepare_value(chordwise: int, half: int) -> Task:
    """Without gradient, on NumPy arrays; `half` as above."""

    def check() -> dict[str, Any]:
        lift, drag = _loads(start(), chordwise, half // (SECTIONS - 1))
        return {"lift": float(lift), "drag": float(drag)}

    return Task(lambda: _loads(start(), chordwise, half // (SECTIONS - 1)), check)


def _loads(x: Any, chordwise: int, per_section: int) -> tuple[Any, Any]:
    """Lift and induced drag, N, for numbers or symbols x."""
    flat, degrees = aerosandbox.Airfoil("naca0012"), 180.0 / np.pi
    sections = [
        aerosandbox.WingXSec([-0.25 * x[i], y, 0.0], chord=x[i], twist=degrees * x[SECTIONS + i], airfoil=flat)
        for i, y in enumerate(section_positions())
    ]
    condition = aerosandbox.OperatingPoint(velocity=SPEED, alpha=degrees * x[2 * SECTIONS])
    analysis = aerosandbox.VortexLatticeMethod(
        aerosandbox.Airplane(wings=[aerosandbox.Wing(symmetric=True, xsecs=sections)], s_ref=1.0, c_ref=1.0, b_ref=1.0),
        condition,
        spanwise_resolution=per_section,
        chordwise_resolution=chordwise,
        spanwise_spacing_function=either.linspace,
        chordwise_spacing_function=either.linspace,
    )
    loads, scale = analysis.run(), DENSITY / condition.atmosphere.density()
    return scale * loads["L"], scale * loads["D"]
