"""Blade-element momentum theory against CCBlade, the actuator disk, a complex-step derivative, experiments and chance."""

import math

import numpy as np
import torch
from torch import Tensor

from lpc_mdo.cases.aerodynamics import RotorCondition, RotorInputs, analyze_rotor
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, RotorLoads, blade_element_momentum, station_radii
from lpc_mdo.disciplines.dynamic_inflow import dynamic_inflow_rotor, steady_inflow
from lpc_mdo.disciplines.inclined_rotor import InclinedFlow, inclined_rotor
from lpc_mdo.numerics.tensors import tensor
from lpc_mdo.verification.comparison import Between, Comparison, reference
from lpc_mdo.verification.random_rotors import failures, still_air
from lpc_mdo.verification.rotor_experiments import (
    caradonna_tung_thrust,
    castles_gray_runs,
    hover_curves,
    propeller_curve,
)

MODEL = "blade-element momentum"
CASES = {"bem_lift_rotor_axial": "lift rotor, hover and climb", "bem_pusher_axial": "pusher, cruise"}
STEP = 1e-30
AIR = (1.2, 340.0, 1.8e-5)  # kg/m^3, m/s, Pa s


def comparisons() -> list[Comparison]:
    with torch.no_grad():
        rows = [
            *(row for name in CASES for row in _ccblade(name)),
            _ideal_rotor(),
            *_inclined(),
            *_knight_hefner(),
            *_castles_gray(),
            *_caradonna_tung(),
            *_propeller(),
        ]
    return [*rows, *_complex_step()]


def random_conditions(count: int) -> Comparison:
    """A minute and a half a million."""
    return Between(MODEL, "random conditions: hover to windmill, feathered, reversed pitch").absolute(
        f"failures and undefined results in {count:,}", failures(count), 0.0, 0.0, "none", "conditions"
    )


def _ccblade(name: str) -> list[Comparison]:
    case = reference(name)
    conditions = [RotorCondition(**{key: r[key] for key in RotorCondition.model_fields}) for r in case["results"]]
    ours = analyze_rotor(RotorInputs.model_validate(case["inputs"]), conditions, None)
    between = Between(MODEL, "CCBlade (WISDEM 4.2.9), the same polar")
    return [
        between.relative(
            f"{quantity}, {CASES[name]}",
            [row[key] for row in ours],
            [row[theirs] for row in case["results"]],
            2e-3,
            "the same equations; both integrated by mid-points",
        )
        for quantity, key, theirs in (
            ("thrust, N", "thrust_N", "thrust_midpoint_N"),
            ("torque, N m", "torque_N_m", "torque_midpoint_Nm"),
        )
    ]


def _ideal_rotor() -> Comparison:
    """Many lightly loaded blades of ideal twist without drag: the actuator disk."""
    radius, hub = tensor(1.0), tensor(0.05)
    r, _ = station_radii(radius, hub, 200)
    rotor = Rotor(radius, hub, torch.full_like(r, 0.002), 0.05 / r, tensor(40.0))
    loads = blade_element_momentum(
        rotor, still_air(tensor(200.0)), lambda a, re, m: (2.0 * math.pi * a, torch.full_like(a, 1e-9))
    )
    return Between(MODEL, "actuator disk in hover").relative(
        "figure of merit of an ideal rotor", loads.figure_of_merit, 1.0, 0.03, "tip loss of forty blades, hub cut-out"
    )


def _inclined() -> list[Comparison]:
    """Axial flow through both models for inclined flow; inflow of Pitt and Peters in hover."""
    rotor = _uniform_rotor(tensor(1.5), tensor(0.15), tensor(0.3))
    axis, air = tensor([0.0, 0.0, 1.0]), [tensor(v) for v in AIR]
    speed = tensor(120.0)
    climb = InclinedFlow(tensor([0.0, 0.0, -6.0]), axis, tensor(1.0), speed, *air)
    around = inclined_rotor(rotor, climb, linear_polar)
    axial = blade_element_momentum(rotor, Inflow(tensor(6.0), speed, *air), linear_polar)
    hover = InclinedFlow(tensor([0.0, 0.0, 0.0]), axis, tensor(1.0), speed, *air)
    inflow = steady_inflow(rotor, hover, linear_polar)[0]
    thrust = float(dynamic_inflow_rotor(rotor, hover, linear_polar).thrust)
    return [
        Between("inclined rotor, annulus momentum", "axial theory").relative(
            "thrust (N) and torque (N m) in climb", [around.thrust, around.torque], [axial.thrust, axial.torque], 1e-12,
            "the same at every azimuth",
        ),
        Between("inclined rotor, Pitt and Peters", "actuator disk").relative(
            "mean induced velocity in hover, m/s", inflow, math.sqrt(thrust / (2.0 * AIR[0] * math.pi * 1.5**2)), 1e-8,
            "the balance is solved to rounding",
        ),
    ]  # fmt: skip


def _knight_hefner() -> list[Comparison]:
    between = Between(MODEL, "experiment: Knight and Hefner, NACA TN-626 (1937)")
    rows = []
    for curve in hover_curves():
        is_working = curve.blade_angle_deg >= 6.0
        thrust, torque = curve.model(curve.blade_angle_deg)
        for quantity, ours, measured, limit in (
            ("thrust", thrust, curve.measured_thrust, 0.11),
            ("torque", torque, curve.measured_torque, 0.14),
        ):
            rows.append(
                between.mean_relative(
                    f"{quantity} coefficient in hover, {curve.blades} blades, mean of 6 to 12 deg",
                    ours[is_working], measured[is_working], limit,
                    "section data without stall and Reynolds number; no contraction of the wake",
                )
            )  # fmt: skip
    return rows


def _castles_gray() -> list[Comparison]:
    ours: tuple[list[float], list[float]] = ([], [])
    measured: tuple[list[float], list[float]] = ([], [])
    for run in castles_gray_runs():
        is_working = run.blade_angle_deg >= 5.0
        for part, values in enumerate(run.model(run.blade_angle_deg)):
            ours[part].append(values[is_working])
            measured[part].append((run.measured_thrust, run.measured_torque)[part][is_working])
    between = Between(MODEL, "experiment: Castles and Gray, NACA TN-2474 (1951)")
    return [
        between.mean_relative(
            f"{name} coefficient in hover, 3 blades, mean of four runs above 5 deg", torch.cat(ours[part]),
            torch.cat(measured[part]), limit, "runs scatter by 10 to 20 %; no contraction of the wake",
        )
        for part, (name, limit) in enumerate((("thrust", 0.30), ("torque", 0.15)))
    ]  # fmt: skip


def _caradonna_tung() -> list[Comparison]:
    results = reference("rotor_caradonna_tung_1981")["results"]
    ours = caradonna_tung_thrust()
    measured = tensor([row["thrust_coefficient"] for row in results])
    others = measured * (1.0 + tensor([row["other_code_relative_difference"] for row in results]))
    quantity = "thrust coefficient in hover at 5, 8 and 12 deg"
    return [
        Between(MODEL, "experiment: Caradonna and Tung, NASA TM-81232 (1981)").relative(
            quantity, ours, measured, 0.45,
            "the preceding blade's tip vortex passes below the blade; theory knows its mean alone",
        ),
        Between(MODEL, "another blade-element momentum code on the same rotor").relative(
            quantity, ours, others, 0.03, "its angles are small, its wake does not turn; no drag"
        ),
    ]  # fmt: skip


def _propeller() -> list[Comparison]:
    curve = propeller_curve()
    is_working = curve.advance_ratio < 0.6
    between = Between(MODEL, "experiment: Deters, Ananda and Selig, AIAA 2014-2151 (2014)")
    reason = "computed polar with laminar separation at Reynolds numbers of 3e4 to 8e4; no rotational augmentation"
    best = [float(values[is_working].max()) for values in (curve.efficiency, curve.measured_efficiency)]
    return [
        between.mean_relative(
            "thrust coefficient, mean below advance ratio 0.6", curve.thrust[is_working],
            curve.measured_thrust[is_working], 0.15, reason,
        ),
        between.mean_relative(
            "power coefficient, mean below advance ratio 0.6", curve.power[is_working],
            curve.measured_power[is_working], 0.15, reason,
        ),
        between.relative("best efficiency below advance ratio 0.6", *best, 0.05, reason),
    ]  # fmt: skip


def linear_polar(alpha: Tensor, reynolds: object, mach: object) -> tuple[Tensor, Tensor]:
    """A section that needs no table, for tensors, arrays and complex numbers alike."""
    return 5.7 * alpha, 0.01 + 0.5 * alpha**2


def _uniform_rotor(radius: Tensor, chord: Tensor, twist: Tensor, stations: int = 20) -> Rotor:
    one = torch.ones(stations, dtype=torch.float64)
    return Rotor(radius, 0.2 * radius, chord * one, twist * one, tensor(3.0))


def complex_step_loads(
    radius: complex, chord: complex, twist: complex, axial: complex, speed: complex, count: int = 20
) -> np.ndarray:
    """Thrust and torque of three blades by NumPy in complex arithmetic, by the published residual (Ning 2021), which our
    code does not use: `linear_polar`, no hub loss, hub at a fifth of the radius."""
    hub, blades = 0.2 * radius, 3
    r = hub + (radius - hub) * (np.arange(count) + 0.5) / count
    across, along = axial + 0.0 * r, speed * r
    solidity = blades * chord / (2 * np.pi * r)

    def terms(phi: np.ndarray) -> tuple[np.ndarray, ...]:
        sin, cos = np.sin(phi), np.cos(phi)
        cl, cd = linear_polar(twist - phi, None, None)
        loss = 2 / np.pi * np.arccos(np.exp(-0.5 * blades * (radius - r) / (r * sin)))
        normal, tangent = cl * cos - cd * sin, cl * sin + cd * cos
        residual = 4 * loss * sin * (along * sin - across * cos) - solidity * (normal * along + tangent * across)
        return residual, normal, tangent, along / (cos + solidity * tangent / (4 * loss * sin))

    phi = np.full(count, 0.1) + 0j
    for _ in range(60):
        slope = (terms(phi + 1e-7)[0] - terms(phi - 1e-7)[0]) / 2e-7
        phi = phi - terms(phi)[0] / slope
    # The imaginary part converges linearly with the slope's error; sixty steps leave rounding alone.
    _, normal, tangent, resultant = terms(phi)
    pressure = 0.5 * AIR[0] * resultant**2 * chord * blades * (radius - hub) / count
    return np.array([(pressure * normal).sum(), (pressure * tangent * r).sum()])


def _complex_step() -> list[Comparison]:
    values = [1.5, 0.15, 0.3, 6.0, 120.0]  # radius, chord, twist, axial velocity, rotation speed
    theirs = []
    for i in range(5):
        shifted = [value + (1j * STEP if k == i else 0.0) for k, value in enumerate(values)]
        theirs.append(complex_step_loads(*shifted).imag / STEP)

    def loads(x: Tensor) -> Tensor:
        rotor = _uniform_rotor(x[0], x[1], x[2])
        found: RotorLoads = blade_element_momentum(rotor, Inflow(x[3], x[4], *(tensor(v) for v in AIR)), linear_polar)
        return torch.stack([found.thrust, found.torque])

    x = torch.tensor(values, dtype=torch.float64)
    with torch.enable_grad():
        jacobian = torch.autograd.functional.jacobian(loads, x)
    between = Between("implicit gradient of the rotor", "complex step through independent formulas")
    return [
        between.relative(
            f"{name} by radius, chord, twist, axial velocity and rotation speed", jacobian[i],
            [row[i] for row in theirs], 1e-8, "root of the inflow equation to rounding",
        )
        for i, name in enumerate(("thrust", "torque"))
    ]  # fmt: skip
