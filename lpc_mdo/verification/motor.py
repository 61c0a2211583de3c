"""Motor currents and losses against a reference, a brute-force search of the dq plane and the balance of power."""

import torch
from torch import Tensor

from lpc_mdo.cases.electric import MotorCondition, MotorInputs, analyze_motor
from lpc_mdo.disciplines.motor import (
    HANDOVER_WIDTH,
    MotorCircuit,
    maximum_torque_per_ampere,
    operate_motor,
    voltage_squared,
)
from lpc_mdo.disciplines.motor_limits import maximum_torque
from lpc_mdo.disciplines.motor_sizing import size_motor
from lpc_mdo.verification.comparison import Between, Comparison, reference

MODEL = "motor"
POINTS = 400
KEYS = ("i_d_A", "i_q_A", "voltage_V", "copper_loss_W")


def comparisons() -> list[Comparison]:
    with torch.no_grad():
        return [*_reference(), *_search(), _balance()]


def _reference() -> list[Comparison]:
    case = reference("motor_dq")
    conditions = [MotorCondition(**{k: row[k] for k in MotorCondition.model_fields}) for row in case["results"]]
    ours = analyze_motor(MotorInputs.model_validate(case["inputs"]), conditions, None)
    between = Between(MODEL, "closed form and bracketed root (SciPy)")
    rows = []
    for words, mode, limit, reason in (
        ("least amperes", "mtpa", 1e-10, "closed form in both"),
        ("flux weakening", "flux weakening", 1e-5, "the voltage limit is approached smoothly"),
    ):
        pairs = [(a[k], b[k]) for a, b in zip(ours, case["results"], strict=True) if b["mode"] == mode for k in KEYS]
        quantity = f"currents A, voltage V, copper loss W: {words}"
        rows.append(between.relative(quantity, *zip(*pairs, strict=True), limit, reason))
    return rows


def _random_points() -> tuple[MotorCircuit, Tensor, Tensor]:
    """Motors of the sized family within the bounds of the main problem, at random points within their limits."""
    generator = torch.Generator().manual_seed(11)

    def uniform(low: float, high: float) -> Tensor:
        return low + (high - low) * torch.rand(POINTS, generator=generator, dtype=torch.float64)

    circuit = size_motor(uniform(0.15, 0.32), uniform(0.03, 0.15)).circuit
    speed = uniform(50.0, 1200.0)
    return circuit, uniform(-0.95, 0.95) * maximum_torque(circuit, speed), speed


def _search() -> list[Comparison]:
    circuit, torque, speed = _random_points()
    operation = operate_motor(circuit, torque, speed)
    ours, torque = operation.current, operation.air_gap_torque
    free = voltage_squared(circuit, *maximum_torque_per_ampere(circuit, torque), speed) / circuit.voltage_limit**2 - 1.0
    theirs, wide = _least_current(circuit, torque, speed), 8.0 * HANDOVER_WIDTH
    between = Between(MODEL, "brute-force search of the dq plane")
    return [
        between.relative(
            f"current, A, {words}, {int(chosen.sum())} random points", ours[chosen], theirs[chosen], 1e-4, reason
        )
        for words, chosen, reason in (
            ("least amperes", free < -wide, "resolution of the search"),
            ("flux weakening", free > wide, "resolution of the search; the voltage limit is approached smoothly"),
        )
    ]


def _least_current(c: MotorCircuit, torque: Tensor, speed: Tensor) -> Tensor:
    """Least amplitude (point,) for the torque within the voltage limit, by three ever finer scans of i_d."""
    low, high = -2.0 * c.flux_linkage / c.inductance_d, 0.2 * c.flux_linkage / c.inductance_d
    share, w = torch.linspace(0.0, 1.0, 4001, dtype=torch.float64), (c.pole_pairs * speed)[:, None]
    p, resistance, l_d, l_q, flux, limit = (
        v[:, None]
        for v in (c.pole_pairs, c.phase_resistance, c.inductance_d, c.inductance_q, c.flux_linkage, c.voltage_limit)
    )
    for _ in range(3):
        d = low[:, None] + (high - low)[:, None] * share
        q = torque[:, None] / (1.5 * p * (flux + (l_d - l_q) * d))
        v_d, v_q = resistance * d - w * l_q * q, resistance * q + w * (l_d * d + flux)
        current = torch.where(v_d**2 + v_q**2 <= limit**2, torch.hypot(d, q), torch.inf)
        least, index = current.min(-1)
        best, width = d.gather(-1, index[:, None])[:, 0], 2.0 * (high - low) / (len(share) - 1)
        low, high = best - width, best + width
    return least


def _balance() -> Comparison:
    """Terminal power, 3/2 (v_d i_d + v_q i_q), is shaft power, friction and copper loss; the input adds the other losses."""
    c, torque, speed = _random_points()
    o = operate_motor(c, torque, speed)
    w = c.pole_pairs * speed
    v_d = c.phase_resistance * o.current_d - w * c.inductance_q * o.current_q
    v_q = c.phase_resistance * o.current_q + w * (c.inductance_d * o.current_d + c.flux_linkage)
    terminal = 1.5 * (v_d * o.current_d + v_q * o.current_q)
    total = terminal + o.iron_loss + o.stray_loss
    return Between(MODEL, "balance of power").relative(
        f"input over terminal power and losses, {POINTS} random points", o.input_power / total, torch.ones(POINTS), 1e-10,
        "rounding",
    )  # fmt: skip
