"""The largest torque of a motor within its current and voltage limits, and its efficiency map.

The torque 1.5 p (psi - dL i_d) i_q is a product of two positive linear functions where it drives, so its logarithm is concave;
current circle and voltage ellipse are convex. Hence the largest torque is unique, and is one of three: maximum torque per ampere
at the current limit (if its voltage allows), maximum torque per volt at the voltage limit (if its current allows), or else where
both limits meet. Source: Morimoto et al., IEEE Trans. Ind. Appl. 26 (1990), here with resistance throughout.
"""

import math
from dataclasses import dataclass, fields
from functools import partial

import torch
from torch import Tensor

from lpc_mdo.disciplines.motor import (
    NO_IMPEDANCE,
    MotorCircuit,
    electromagnetic_torque,
    friction_torque,
    operate_motor,
    voltage_squared,
)
from lpc_mdo.numerics.crossing import falling_crossing

ITERATIONS = 60  # of Newton's method on a convex function, from above: five are usual
TIE = 1e-12  # of the squared voltage limit: rounding, on which the choice of the regime must not hang
ROUNDINGS = 8.0  # units of the last place at which it ends


def maximum_torque(circuit: MotorCircuit, speed: Tensor) -> Tensor:
    """Largest driving air-gap torque (...,) N m within the current and voltage limits at `speed` (...,) rad/s, at least 0.

    What friction leaves of it is the shaft's. Zero where no currents within both limits drive the motor. The slope is
    continuous where one limit takes over from another; derivatives are those of the envelope theorem: first ones, in
    either mode. NaN stays in its element.
    """
    c = circuit
    with torch.no_grad():
        best = _best_currents(c, speed)
        by_current, by_voltage = _multipliers(c, best, speed)
    # At the best currents either limit is met or its multiplier is zero: the sum is the torque, its slopes those of the best.
    spare_current = c.current_limit**2 - best.current_d**2 - best.current_q**2
    spare_voltage = c.voltage_limit**2 - voltage_squared(c, best.current_d, best.current_q, speed)
    torque = electromagnetic_torque(c, best.current_d, best.current_q)
    return torque + by_current * spare_current + by_voltage * spare_voltage


@dataclass(frozen=True)
class _Best:
    """Currents A of the largest torque, zero where none drives, and which limits they meet; each (...,)."""

    current_d: Tensor
    current_q: Tensor
    is_at_current: Tensor
    is_at_voltage: Tensor


def _best_currents(c: MotorCircuit, speed: Tensor) -> _Best:
    current_d, current_q = _least_amperes_at_limit(c)
    excess = voltage_squared(c, current_d, current_q, speed) - c.voltage_limit**2
    is_cut = excess > TIE * c.voltage_limit**2  # both limits may meet at rest, where all the circle has one voltage
    nothing = 0.0 * excess  # but NaN where an input is
    if not bool(is_cut.any()):
        return _Best(current_d + nothing, current_q + nothing, ~is_cut, is_cut)
    volts_d, volts_q = _most_torque_per_volt(c, speed)
    is_beyond = is_cut & (volts_d**2 + volts_q**2 > c.current_limit**2)
    meeting_d, meeting_q, is_met = _meeting_of_limits(c, speed, current_d, is_beyond)
    return _Best(
        torch.where(is_beyond, meeting_d, torch.where(is_cut, volts_d, current_d)) + nothing,
        torch.where(is_beyond, meeting_q, torch.where(is_cut, volts_q, current_q)) + nothing,
        ~is_cut | is_met,
        is_met | (is_cut & ~is_beyond & (volts_q > 0.0)),
    )


def _least_amperes_at_limit(c: MotorCircuit) -> tuple[Tensor, Tensor]:
    """i_d, i_q (...,) A of maximum torque per ampere at the current limit."""
    saliency, current = c.inductance_q - c.inductance_d, c.current_limit
    root = torch.sqrt(c.flux_linkage**2 + 8.0 * (saliency * current) ** 2)
    current_d = -2.0 * saliency * current**2 / (c.flux_linkage + root)
    return current_d, torch.sqrt(current**2 - current_d**2)


def _most_torque_per_volt(c: MotorCircuit, speed: Tensor) -> tuple[Tensor, Tensor]:
    """i_d, i_q (...,) A of the largest torque at the voltage limit; zero where the no-load voltage exceeds it.

    Along the curve of most torque per volt, i_d is given by i_q in closed form, and V^2 is a convex, rising function of i_q:
    Newton's method falls to the root from any point above it.
    """
    saliency = c.inductance_q - c.inductance_d
    w = c.pole_pairs * speed
    impedance_d = c.phase_resistance**2 + (w * c.inductance_d) ** 2 + NO_IMPEDANCE
    impedance_q = c.phase_resistance**2 + (w * c.inductance_q) ** 2 + NO_IMPEDANCE
    idle = w**2 * c.inductance_d * c.flux_linkage / impedance_d  # -i_d of the lowest voltage at no torque
    flux = c.flux_linkage + saliency * idle
    cross = 2.0 * c.phase_resistance * w
    available = c.voltage_limit**2 - (w * c.phase_resistance * c.flux_linkage) ** 2 / impedance_d
    spare = available.clamp(min=0.0)
    # Without saliency this is the root; saliency only adds voltage.
    current_q = 2.0 * spare / (cross * flux + torch.sqrt((cross * flux) ** 2 + 4.0 * impedance_q * spare))
    for _ in range(ITERATIONS):
        root = torch.sqrt(flux**2 + 4.0 * saliency**2 * impedance_q / impedance_d * current_q**2)
        shift = -2.0 * saliency * impedance_q / impedance_d * current_q**2 / (flux + root)  # of i_d
        shift_slope = -2.0 * saliency * impedance_q / impedance_d * current_q / root
        linked = flux - saliency * shift
        excess = impedance_d * shift**2 + impedance_q * current_q**2 + cross * linked * current_q - spare
        slope = 2.0 * impedance_q * current_q + cross * linked
        slope = slope + (2.0 * impedance_d * shift - cross * saliency * current_q) * shift_slope
        is_open = excess.abs() > ROUNDINGS * torch.finfo(excess.dtype).eps * spare
        if not bool(is_open.any()):
            break
        current_q = torch.where(is_open, current_q - excess / slope, current_q)
    is_driving = available > 0.0
    return torch.where(is_driving, shift - idle, 0.0 * available), torch.where(is_driving, current_q, 0.0 * available)


def _meeting_of_limits(
    c: MotorCircuit, speed: Tensor, least_d: Tensor, is_searched: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """i_d, i_q (...,) A on the current limit where V^2 falls to its limit, zero where it does not, and whether it does.

    From maximum torque per ampere towards i_d = -I, torque, flux and with them voltage fall: there is one crossing or none.
    """
    current, w = c.current_limit, c.pole_pairs * speed
    saliency = c.inductance_q - c.inductance_d
    cross = 2.0 * c.phase_resistance * w * current
    polynomial = (
        (c.phase_resistance * current) ** 2 + w**2 * ((c.inductance_q * current) ** 2 + c.flux_linkage**2),
        -2.0 * w**2 * c.flux_linkage * c.inductance_d * current,
        (w * current) ** 2 * (c.inductance_d**2 - c.inductance_q**2),
        cross * c.flux_linkage,
        cross * current * saliency,
    )
    start = torch.asin((-least_d / current).clamp(max=1.0))
    end = torch.full_like(start, 0.5 * math.pi)
    is_met = is_searched & (_along_angle(end, polynomial) < c.voltage_limit**2)
    angle, _ = falling_crossing(
        partial(_along_angle, polynomial=polynomial),
        partial(_slopes_along_angle, polynomial=polynomial),
        (c.voltage_limit**2).expand(is_met.shape),
        start,
        end,
        is_met,
        c.voltage_limit**2,
    )
    zero = torch.zeros_like(angle)
    return (
        torch.where(is_met, -current * torch.sin(angle), zero),
        torch.where(is_met, current * torch.cos(angle), zero),
        is_met,
    )


def _along_angle(angle: Tensor, polynomial: tuple[Tensor, ...]) -> Tensor:
    """V^2 at constant current, i_d = -I sin(angle) and i_q = I cos(angle)."""
    constant, sine, sine_squared, cosine, product = polynomial
    s, c = torch.sin(angle), torch.cos(angle)
    return constant + s * (sine + sine_squared * s) + c * (cosine + product * s)


def _slopes_along_angle(angle: Tensor, polynomial: tuple[Tensor, ...]) -> tuple[Tensor, Tensor]:
    _, sine, sine_squared, cosine, product = polynomial
    s, c = torch.sin(angle), torch.cos(angle)
    double = c**2 - s**2
    first = c * (sine + 2.0 * sine_squared * s) - cosine * s + product * double
    return first, 2.0 * sine_squared * double - sine * s - c * (cosine + 4.0 * product * s)


def _multipliers(c: MotorCircuit, best: _Best, speed: Tensor) -> tuple[Tensor, Tensor]:
    """What the largest torque gains from a unit of squared current limit and of squared voltage limit, (...,).

    Gradients of torque, squared current and squared voltage are in balance, by one multiplier for each limit that is met.
    """
    w, saliency, current_d, current_q = (
        c.pole_pairs * speed,
        c.inductance_q - c.inductance_d,
        best.current_d,
        best.current_q,
    )
    v_d = c.phase_resistance * current_d - w * c.inductance_q * current_q
    v_q = c.phase_resistance * current_q + w * (c.inductance_d * current_d + c.flux_linkage)
    voltage_by_d = 2.0 * (c.phase_resistance * v_d + w * c.inductance_d * v_q)
    voltage_by_q = 2.0 * (c.phase_resistance * v_q - w * c.inductance_q * v_d)
    torque_by_d = -1.5 * c.pole_pairs * saliency * current_q
    torque_by_q = 1.5 * c.pole_pairs * (c.flux_linkage - saliency * current_d)
    across = 2.0 * (current_d * voltage_by_q - current_q * voltage_by_d)
    both = (
        (torque_by_d * voltage_by_q - torque_by_q * voltage_by_d) / across,
        2.0 * (current_d * torque_by_q - current_q * torque_by_d) / across,
    )
    alone = (
        0.5 * (torque_by_d * current_d + torque_by_q * current_q) / (current_d**2 + current_q**2),
        (torque_by_d * voltage_by_d + torque_by_q * voltage_by_q) / (voltage_by_d**2 + voltage_by_q**2),
    )
    is_both, zero = best.is_at_current & best.is_at_voltage, torch.zeros_like(across)
    by_current, by_voltage = (
        torch.where(is_both, together, torch.where(is_met, single, zero))
        for together, single, is_met in zip(both, alone, (best.is_at_current, best.is_at_voltage), strict=True)
    )
    return by_current, by_voltage


@dataclass(frozen=True)
class EfficiencyMap:
    """Efficiency over torque and speed, NaN where the motor cannot go."""

    torque: Tensor  # (torque,) N m
    speed: Tensor  # (speed,) rad/s
    efficiency: Tensor  # (..., torque, speed)
    limit: Tensor  # (..., speed) N m, the largest at the shaft


def efficiency_map(circuit: MotorCircuit, torque: Tensor, speed: Tensor) -> EfficiencyMap:
    """Efficiency of circuits (...,) on the grid of shaft torque (torque,) N m > 0 and speed (speed,) rad/s > 0."""
    wide = MotorCircuit(*(getattr(circuit, field.name)[..., None, None] for field in fields(circuit)))
    limit = maximum_torque(wide, speed) - friction_torque(wide, speed)  # (..., 1, speed)
    efficiency = operate_motor(wide, torque[:, None], speed).efficiency
    return EfficiencyMap(torque, speed, torch.where(torque[:, None] <= limit, efficiency, torch.nan), limit[..., 0, :])
