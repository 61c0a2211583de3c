"""Trim against an independent evaluation, small motions and modes against published aircraft, levels against MIL-F-8785C."""

import math
from typing import Any

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from lpc_mdo.disciplines.dynamics import (
    LateralModes,
    LongitudinalModes,
    Oscillation,
    Subsidence,
    acceleration_sensitivity,
    lateral_modes,
    linearize,
    longitudinal_modes,
    rigid_body_residual,
)
from lpc_mdo.disciplines.flying_qualities import lateral_levels, longitudinal_levels
from lpc_mdo.disciplines.trim import Maneuver, maneuver_residual, trim_residual
from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.verification.aircraft import NAVION_SPEED, Aircraft, boeing_747, navion
from lpc_mdo.verification.comparison import Between, Comparison, reference

ETKIN = "Boeing 747: Etkin and Reid (1996), chapter 6"
NELSON = "Navion: Nelson (1998), chapters 4 and 5"
DIGITS = "digits of the published derivatives"
# Real and imaginary parts of the published eigenvalues, 1/s.
BOEING_MODES = {
    "short period": (-0.3719, 0.8875), "phugoid": (-0.003289, 0.06723), "Dutch roll": (-0.0330, 0.9465),
    "roll": (-0.5625,), "spiral": (-0.0073,),
}  # fmt: skip
NAVION_MODES = {
    "short period": (-2.51, 2.59), "phugoid": (-0.017, 0.213), "Dutch roll": (-0.487, 2.335), "roll": (-8.435,),
    "spiral": (-0.00877,),
}  # fmt: skip


def comparisons() -> list[Comparison]:
    boeing, small = linearize(*boeing_747()), linearize(*navion())
    rows = [
        *_trim(),
        *(_jacobian(name, aircraft) for name, aircraft in (("Boeing 747", boeing_747()), ("Navion", navion()))),
        *_modes(ETKIN, longitudinal_modes(boeing.longitudinal), lateral_modes(boeing.lateral), BOEING_MODES),
        *_modes(NELSON, longitudinal_modes(small.longitudinal), lateral_modes(small.lateral), NAVION_MODES),
        _sensitivity(),
    ]
    return [*rows, *_levels()]


def _trim() -> list[Comparison]:
    """Random loads on a banked, pitched aircraft in accelerated turning flight, by rotation matrices and Newton's law."""
    draw = np.random.default_rng(5)
    forces, points, moment = 1e4 * draw.normal(size=(6, 3)), 5.0 * draw.normal(size=(6, 3)), 1e3 * draw.normal(size=3)
    center, mass, pitch, bank = draw.normal(size=3), 3000.0, 0.12, 0.35
    velocity, turn, acceleration, spin_up = (scale * draw.normal(size=3) for scale in (60.0, 0.2, 1.0, 0.1))
    root = draw.normal(size=(3, 3))
    inertia = 1e3 * (root @ root.T + 3.0 * np.eye(3))
    loads = trim_residual(*(_tensor(v) for v in (forces, points, moment, center, mass, pitch, bank)))
    ours = maneuver_residual(
        loads, _tensor(mass), _tensor(inertia), Maneuver(*(_tensor(v) for v in (velocity, turn, acceleration, spin_up)))
    )
    half_turn = Rotation.from_euler("y", 180, degrees=True)
    weight = Rotation.from_euler("ZYX", [0.0, pitch, bank]).inv().apply([0.0, 0.0, mass * GRAVITY])
    force = half_turn.apply(forces.sum(0)) + weight - mass * (acceleration + np.cross(turn, velocity))
    about = half_turn.apply(np.cross(points - center, forces).sum(0) + moment)
    about -= inertia @ spin_up + np.cross(turn, inertia @ turn)
    between = Between("trim and manoeuvres", "Newton and Euler by rotation matrices (SciPy), random loads")
    return [
        between.of_largest("force left, N", ours.force, force, 1e-10, "rounding"),
        between.of_largest("moment left, N m", ours.moment, about, 1e-10, "rounding"),
        Between("trim and manoeuvres", "level turn at 40 deg bank: 1/cos").relative(
            "load factor that leaves no force", _turn_load_factor(math.radians(40.0)), 1.0 / math.cos(math.radians(40.0)),
            1e-10, "rounding",
        ),
    ]  # fmt: skip


def _turn_load_factor(bank: float) -> float:
    """Lift over weight of a level turn, from the vertical force that is left without any lift."""
    speed, mass, zero = 60.0, 3000.0, torch.zeros(3, dtype=torch.float64)
    rate = GRAVITY * math.tan(bank) / speed
    turn = _tensor([0.0, rate * math.sin(bank), rate * math.cos(bank)])
    loads = trim_residual(
        torch.zeros(1, 3, dtype=torch.float64), zero[None], zero, zero, _tensor(mass), _tensor(0.0), _tensor(bank)
    )
    left = maneuver_residual(
        loads, _tensor(mass), torch.eye(3).double(), Maneuver(_tensor([speed, 0, 0]), turn, zero, zero)
    )
    return float(left.force[2]) / (mass * GRAVITY)


def _jacobian(name: str, aircraft: Aircraft) -> Comparison:
    """Rates solved for at displaced states, by fourth-order central differences: columns scaled by the speed."""
    body, loads, state = aircraft
    speed = float(state[0])
    steps = torch.tensor([speed] * 3 + [1.0] * 5, dtype=torch.float64)

    def rates(at: Tensor) -> Tensor:
        """The residual is linear in the rates."""
        zero = torch.zeros_like(at)
        at_rest = rigid_body_residual(body, loads, at, zero)
        by_rate = torch.stack(
            [rigid_body_residual(body, loads, at, e) - at_rest for e in torch.eye(8).double()], dim=-1
        )
        return torch.linalg.solve(by_rate, -at_rest)

    step = 1e-3
    columns = [
        (
            8.0 * (rates(state + step * e) - rates(state - step * e))
            - rates(state + 2 * step * e)
            + rates(state - 2 * step * e)
        )
        / (12.0 * step)
        for e in torch.diag(steps)
    ]
    scale = steps[:, None]
    ours, theirs = linearize(*aircraft).matrix * steps / scale, torch.stack(columns, dim=-1) / scale
    return Between("linearized dynamics", "central differences of fourth order").of_largest(
        f"system matrix of the {name}, speeds over the flight speed, 1/s", ours, theirs, 1e-7, "rounding and step"
    )


def _modes(
    against: str, longitudinal: LongitudinalModes, lateral: LateralModes, published: dict[str, tuple[float, ...]]
) -> list[Comparison]:
    ours = {
        "short period": longitudinal.short_period.eigenvalues[0],
        "phugoid": longitudinal.phugoid.eigenvalues[0],
        "Dutch roll": lateral.dutch_roll.eigenvalues[0],
        "roll": lateral.roll.eigenvalue,
        "spiral": lateral.spiral.eigenvalue,
    }
    is_boeing = against == ETKIN
    # Nelson's derivatives are rounded to two or three digits on the way. The spirals are small differences of large
    # products: the last digits of the Navion's table add up to 11 %.
    limits = dict.fromkeys(ours, 4e-3 if is_boeing else 0.03) | {"spiral": 7e-3 if is_boeing else 0.11}
    between = Between("modes of motion", against)
    return [
        between.relative(
            f"{name}, eigenvalue 1/s" if len(values) == 1 else f"{name}, real and imaginary part of eigenvalue, 1/s",
            [ours[name].real.item(), abs(ours[name].imag.item())][: len(values)],
            values,
            limits[name],
            DIGITS if name != "spiral" else "digits of the derivatives: a small difference of large products",
        )
        for name, values in published.items()
    ]


def _sensitivity() -> Comparison:
    motion = linearize(*navion())
    # Load factor per radian: (lift slope + drag) over lift coefficient, Nelson's coefficients.
    lift = 2750 * 4.4482216 / (0.5 * 1.225 * NAVION_SPEED**2 * 184 * 0.3048**2)
    return Between("linearized dynamics", "lift slope over lift").relative(
        "load factor per angle of attack of the Navion, 1/rad",
        acceleration_sensitivity(motion, _tensor(NAVION_SPEED)), (4.44 + 0.05) / lift, 1e-9, "rounding",
    )  # fmt: skip


def _levels() -> list[Comparison]:
    """Points on either side of the specification's boundaries: how many are given the level that it asks for."""
    cases = reference("mil_f_8785c_levels")["results"]
    between, rows = Between("flying qualities", "MIL-F-8785C"), []
    for name, table in cases.items():
        found = [level_of(name, row) for row in table]
        rows.append(
            between.absolute(
                f"{name.replace('_', ' ')}: levels of {len(table)} points about the boundaries", found,
                [row["level"] for row in table], 0.0, "none", "levels",
            )
        )  # fmt: skip
    return rows


def level_of(requirement: str, row: dict[str, Any]) -> int:
    """Our level of one row of `mil_f_8785c_levels.json`."""
    pair = oscillation(row.get("damping_ratio", 0.3), row.get("frequency", 2.0))
    steady = Subsidence(torch.tensor(complex(-1.0 / row.get("time_constant", 0.5)), dtype=torch.complex128))
    growth = math.log(2.0) / row.get("time_to_double", math.inf)
    spiral = Subsidence(torch.tensor(complex(growth), dtype=torch.complex128))
    lateral = lateral_levels(LateralModes(pair, steady, spiral), row.get("airplane_class", 1), row.get("category", "B"))
    long = longitudinal_levels(
        LongitudinalModes(pair, pair), _tensor(row.get("load_factor_per_rad", 8.0)), row.get("category", "B")
    )
    return int(
        {
            "Dutch_roll": lateral.dutch_roll,
            "roll": lateral.roll,
            "spiral": lateral.spiral,
            "short_period_damping": long.short_period_damping,
            "control_anticipation": long.control_anticipation,
            "phugoid": long.phugoid,
        }[requirement]
    )


def oscillation(ratio: float, frequency: float) -> Oscillation:
    """The pair of eigenvalues with this damping ratio and natural frequency rad/s."""
    real, imaginary = -ratio * frequency, frequency * math.sqrt(1.0 - ratio**2)
    return Oscillation(torch.tensor([complex(real, imaginary), complex(real, -imaginary)], dtype=torch.complex128))


def _tensor(value: object) -> Tensor:
    return torch.as_tensor(value, dtype=torch.float64)
