"""Aircraft whose stability derivatives and modes of motion are published."""

import torch
from torch import Tensor

from lpc_mdo.disciplines.dynamics import Loads, RigidBody, steady_state
from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.numerics.tensors import tensor

FOOT, SLUG_SQUARE_FOOT, POUND = 0.3048, 1.355817948, 4.4482216  # m, kg m^2, N

# Boeing 747-100 at 40,000 ft, Mach 0.8, SI, stability axes: Etkin and Reid, Dynamics of Flight (1996), chapter 6.
BOEING = {
    "Xu": -1.982e3, "Xw": 4.025e3, "Zu": -2.595e4, "Zw": -9.030e4, "Zq": -4.524e5, "Zw_dot": 1.909e3,
    "Mu": 1.593e4, "Mw": -1.563e5, "Mq": -1.521e7, "Mw_dot": -1.702e4, "Yv": -1.610e4,
    "Lv": -3.062e5, "Lp": -1.076e7, "Lr": 9.925e6, "Nv": 2.131e5, "Np": -1.330e6, "Nr": -8.934e6,
}  # fmt: skip
BOEING_SPEED, BOEING_MASS = 235.9, 2.83176e6 / 9.81
NAVION_SPEED = 176 * FOOT

Aircraft = tuple[RigidBody, Loads, Tensor]
"""Body, loads and steady state, as `linearize` takes them."""


def boeing_747(**changes: float | Tensor) -> Aircraft:
    """Loads linear in the derivatives of the table, of which `changes` replace some."""
    d = {key: torch.as_tensor(value, dtype=torch.float64) for key, value in (BOEING | changes).items()}

    def loads(state: Tensor, rate: Tensor) -> tuple[Tensor, Tensor]:
        u, v, w, p, q, r, _, _ = state.unbind(-1)
        du, w_dot = u - BOEING_SPEED, rate[..., 2]
        x = d["Xu"] * du + d["Xw"] * w
        z = d["Zu"] * du + d["Zw"] * w + d["Zq"] * q + d["Zw_dot"] * w_dot - BOEING_MASS * GRAVITY
        roll = d["Lv"] * v + d["Lp"] * p + d["Lr"] * r
        pitch = d["Mu"] * du + d["Mw"] * w + d["Mq"] * q + d["Mw_dot"] * w_dot
        yaw = d["Nv"] * v + d["Np"] * p + d["Nr"] * r
        return torch.stack([x, d["Yv"] * v, z], dim=-1), torch.stack([roll, pitch, yaw], dim=-1)

    # The product of inertia is -2.12e6 kg m^2; the matrix holds its negative.
    inertia = torch.tensor([[2.47e7, 0, 2.12e6], [0, 4.49e7, 0], [2.12e6, 0, 6.73e7]], dtype=torch.float64)
    return (
        RigidBody(tensor(BOEING_MASS), inertia),
        loads,
        steady_state(*(tensor(x) for x in (BOEING_SPEED, 0.0, 0.0))),
    )


def navion() -> Aircraft:
    """Nonlinear loads from coefficients at sea level, 176 ft/s: Nelson, Flight Stability and Automatic Control (1998),
    appendix B; his Z_q and Z_w_dot are zero."""
    area, span, chord = 184 * FOOT**2, 33.4 * FOOT, 5.7 * FOOT
    speed, density, mass = NAVION_SPEED, 1.225, 2750 * POUND / GRAVITY
    pressure_area = 0.5 * density * speed**2 * area
    lift_0 = mass * GRAVITY / pressure_area
    inertia = torch.diag(torch.tensor([1048.0, 3000.0, 3530.0], dtype=torch.float64) * SLUG_SQUARE_FOOT)

    def loads(state: Tensor, rate: Tensor) -> tuple[Tensor, Tensor]:
        u, v, w, p, q, r, _, _ = state.unbind(-1)
        squared = u**2 + v**2 + w**2
        alpha, beta = torch.atan2(w, u), torch.asin(v / squared.sqrt())
        share = squared / speed**2 * pressure_area
        lift, drag = (lift_0 + 4.44 * alpha) * share, (0.05 + 0.33 * alpha) * share
        thrust = 0.05 * pressure_area
        force = [
            thrust - drag * torch.cos(alpha) + lift * torch.sin(alpha),
            -0.564 * beta * share,
            -drag * torch.sin(alpha) - lift * torch.cos(alpha),
        ]
        q_hat, lag_hat = q * chord / (2 * speed), rate[..., 2] / speed * chord / (2 * speed)
        p_hat, r_hat = p * span / (2 * speed), r * span / (2 * speed)
        moment = [
            (-0.074 * beta - 0.410 * p_hat + 0.107 * r_hat) * share * span,
            (-0.683 * alpha - 9.96 * q_hat - 4.36 * lag_hat) * share * chord,
            (0.071 * beta - 0.0575 * p_hat - 0.125 * r_hat) * share * span,
        ]
        return torch.stack(force, dim=-1), torch.stack(moment, dim=-1)

    return RigidBody(tensor(mass), inertia), loads, steady_state(*(tensor(x) for x in (speed, 0.0, 0.0)))
