"""Vortex lattice, blade-element momentum theory and atmosphere against other codes, theory and experiments."""

import math
from collections.abc import Iterable

import torch
from torch import Tensor

from lpc_mdo.cases.aerodynamics import (
    RotorCondition,
    RotorInputs,
    WingInputs,
    WingMesh,
    WingSurface,
    analyze_rotor,
    analyze_wing,
    wing_mesh,
)
from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.disciplines.blade_element import Rotor, blade_element_momentum, station_radii
from lpc_mdo.disciplines.far_field import far_field
from lpc_mdo.disciplines.stability_derivatives import air_velocity
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice
from lpc_mdo.verification.comparison import Comparison, reference
from lpc_mdo.verification.random_rotors import failures, still_air
from lpc_mdo.verification.rotor_experiments import hover_curves, propeller_curve

WING_CASES = ("vlm_rect_ar8_flat", "vlm_rect_ar8_naca4412", "vlm_lpc_flat", "vlm_lpc_naca4412")
ROTOR_CASES = ("bem_lift_rotor_axial", "bem_pusher_axial")
LATTICE_TOLERANCE = {"CL": 1e-3, "CDi": 5e-3, "Cm": 0.01, "Cl_roll_body": 0.02, "Cn_body": 0.02}
ISO_2533 = (  # geopotential altitude m; pressure Pa, density kg/m^3, speed of sound m/s
    (0.0, 101325.0, 1.2250, 340.294),
    (1500.0, 84556.0, 1.0581, 334.487),
    (11000.0, 22632.0, 0.36392, 295.069),
)
ORIGIN = torch.zeros(3, dtype=torch.float64)


def comparisons(random_conditions: int = 1_000_000) -> list[Comparison]:
    """All rows; the random conditions take a minute a million."""
    with torch.no_grad():
        rows = [
            *(row for name in WING_CASES for row in _wing_rows(name)),
            *_wing_theory(),
            *(row for name in ROTOR_CASES for row in _rotor_rows(name)),
            _ideal_rotor(),
            *_experiment_rows(),
            *_atmosphere_rows(),
        ]
    return [*rows, _random_row(random_conditions)]


def _worst(ours: Iterable[float], theirs: Iterable[float]) -> float:
    """Largest difference over the largest value of the reference."""
    pairs = list(zip(ours, theirs, strict=True))
    return max(abs(a - b) for a, b in pairs) / max(abs(b) for _, b in pairs)


def _wing_rows(name: str) -> list[Comparison]:
    case = reference(name)
    straight = [
        ({key: mesh[key] for key in WingMesh.model_fields if key in mesh}, mesh["results"])
        for mesh in case["results"]["OpenAerostruct 2.12.0"]["meshes"]
    ]
    slipping = [
        ({key: row[key] for key in WingMesh.model_fields if key in row}, [row])
        for row in reference("vlm_sideslip")["results"][name]
    ]
    found: dict[str, tuple[list[float], list[float]]] = {key: ([], []) for key in LATTICE_TOLERANCE}
    for panels, rows in [*straight, *slipping]:
        angles = [[row["alpha_deg"], row["beta_deg"]] for row in rows]
        inputs = WingInputs.model_validate(case["inputs"] | {"conditions_alpha_beta_deg": angles})
        for ours, theirs in zip(analyze_wing(inputs, [], WingMesh(**panels)), rows, strict=True):
            for key, (left, right) in found.items():
                left.append(ours[key])
                right.append(theirs[key])
    is_cambered = "4412" in name
    return [
        Comparison(
            model="vortex lattice",
            against="OpenAerostruct 2.12.0 at equal mesh",
            quantity=f"{key}, {case['description']}",
            difference=_worst(*values),
            tolerance=3e-3 if key == "CL" and is_cambered else LATTICE_TOLERANCE[key],
            reason="the same lattice and wake; the digits of the file",
        )
        for key, values in found.items()
        if any(abs(value) > 1e-6 for value in values[1])
    ]


def _wing_theory() -> list[Comparison]:
    theta = torch.linspace(0.0, math.pi, 61, dtype=torch.float64)
    chord, y = torch.sin(theta).clamp(min=1e-3), -10.0 * torch.cos(theta)
    x = torch.tensor([-0.25, 0.25, 0.75], dtype=torch.float64)[:, None] * chord
    elliptic = torch.stack(torch.broadcast_tensors(x, y, torch.zeros_like(y)), dim=-1)
    velocity = air_velocity(_tensor(1.0), _tensor(0.05), _tensor(0.0))
    loads = vortex_lattice([elliptic], velocity, _tensor(1.0), ORIGIN)
    lifting_line = float(loads.lift) ** 2 / (0.5 * math.pi * 20.0**2)
    long_wing = _wing(3, 40, 500.0)
    slope = vortex_lattice([long_wing], air_velocity(_tensor(1.0), _tensor(0.02), _tensor(0.0)), _tensor(1.0), ORIGIN)
    gaps = []
    for panels in (4, 8):
        mesh = _wing(panels, 5 * panels, 4.0, "NACA 4412")
        near = vortex_lattice([mesh], velocity, _tensor(1.0), ORIGIN, has_chordwise_forces=True)
        far = far_field(near.circulation, [mesh[-1]], velocity, _tensor(1.0))
        gaps.append(float(near.induced_drag / far.induced_drag) - 1.0)
    return [
        Comparison(
            "vortex lattice",
            "lifting-line theory",
            "induced drag of an elliptic wing, aspect ratio 25",
            float(loads.induced_drag) / lifting_line - 1.0,
            0.03,
            "control points in the middle of strips converge at first order",
        ),
        Comparison(
            "vortex lattice",
            "thin-airfoil theory",
            "lift slope at aspect ratio 1000",
            float(slope.lift) / (0.5 * 1000.0 * 0.02 * 2.0 * math.pi) - 1.0,
            0.02,
            "finite aspect ratio",
        ),
        Comparison(
            "vortex lattice",
            "its own far field",
            "induced drag of a cambered wing, extrapolated from two meshes",
            2.0 * gaps[1] - gaps[0],
            1e-3,
            "what is left of second order",
        ),
    ]


def _wing(chordwise: int, spanwise: int, half_span: float, camber: str = "none") -> Tensor:
    surface = WingSurface(name="wing", camber=camber, root=(0.0, 0.0, 0.0, 1.0), tip=(0.0, half_span, 0.0, 1.0))
    return wing_mesh(surface, WingMesh(chordwise_panels=chordwise, spanwise_panels_half=spanwise))


def _rotor_rows(name: str) -> list[Comparison]:
    case = reference(name)
    conditions = [RotorCondition(**{key: r[key] for key in RotorCondition.model_fields}) for r in case["results"]]
    ours = analyze_rotor(RotorInputs.model_validate(case["inputs"]), conditions, None)
    return [
        Comparison(
            model="blade-element momentum",
            against="CCBlade (WISDEM 4.2.9), the same polar",
            quantity=f"{label}, {case['description']}",
            difference=max(abs(a[key] / b[theirs] - 1.0) for a, b in zip(ours, case["results"], strict=True)),
            tolerance=2e-3,
            reason="the same equations; both integrated by mid-points",
        )
        for label, key, theirs in (
            ("thrust", "thrust_N", "thrust_midpoint_N"),
            ("torque", "torque_N_m", "torque_midpoint_Nm"),
        )
    ]


def _ideal_rotor() -> Comparison:
    """Many lightly loaded blades of ideal twist without drag: the actuator disk."""
    radius, hub = _tensor(1.0), _tensor(0.05)
    r, _ = station_radii(radius, hub, 200)
    rotor = Rotor(radius, hub, torch.full_like(r, 0.002), 0.05 / r, _tensor(40.0))
    loads = blade_element_momentum(
        rotor, still_air(_tensor(200.0)), lambda a, re, m: (2.0 * math.pi * a, torch.full_like(a, 1e-9))
    )
    return Comparison(
        "blade-element momentum",
        "actuator disk in hover",
        "figure of merit of an ideal rotor",
        float(loads.figure_of_merit) - 1.0,
        0.03,
        "tip loss of forty blades, hub cut-out",
    )


def _experiment_rows() -> list[Comparison]:
    rows = []
    for curve in hover_curves():
        is_working = curve.blade_angle_deg >= 6.0
        thrust, torque = curve.model(curve.blade_angle_deg)
        for label, ours, measured in (
            ("thrust", thrust, curve.measured_thrust),
            ("torque", torque, curve.measured_torque),
        ):
            rows.append(
                Comparison(
                    "blade-element momentum",
                    "Knight and Hefner, NACA TN-626 (1937)",
                    f"mean {label} difference, hover at 6 to 12 deg, {curve.blades} blades",
                    float((ours / measured - 1.0)[is_working].abs().mean()),
                    0.10,
                    "section data without stall and Reynolds number; no contraction of the wake",
                )
            )
    propeller = propeller_curve()
    is_working = propeller.advance_ratio < 0.6
    reason = "computed polar with laminar separation at Reynolds numbers of 3e4 to 8e4; no rotational augmentation"
    against = "Deters, Ananda and Selig, AIAA 2014-2151 (2014)"
    for label, ours, measured in (
        ("thrust", propeller.thrust, propeller.measured_thrust),
        ("power", propeller.power, propeller.measured_power),
    ):
        difference = float((ours / measured - 1.0)[is_working].abs().mean())
        rows.append(
            Comparison(
                "blade-element momentum",
                against,
                f"mean {label} difference, advance ratio below 0.6",
                difference,
                0.15,
                reason,
            )
        )
    best = [
        float(values.max()) for values in (propeller.efficiency[is_working], propeller.measured_efficiency[is_working])
    ]
    rows.append(
        Comparison(
            "blade-element momentum", against, "best efficiency below 0.6", best[0] / best[1] - 1.0, 0.05, reason
        )
    )
    return rows


def _atmosphere_rows() -> list[Comparison]:
    table = torch.tensor(ISO_2533, dtype=torch.float64)
    air = standard_atmosphere(table[:, 0])
    columns = {"pressure": air.pressure, "density": air.density, "speed of sound": air.speed_of_sound}
    return [
        Comparison(
            "atmosphere",
            "tables of ISO 2533",
            f"{label}, sea level to 11 km",
            float((ours / table[:, i + 1] - 1.0).abs().max()),
            5e-5,
            "digits of the tables",
        )
        for i, (label, ours) in enumerate(columns.items())
    ]


def _random_row(count: int) -> Comparison:
    return Comparison(
        "blade-element momentum",
        f"{count:,} random conditions, hover to windmill, feathered and reversed pitch",
        "number of failures and undefined results",
        float(failures(count)),
        0.0,
        "none",
    )


def _tensor(value: float) -> Tensor:
    return torch.tensor(value, dtype=torch.float64)
