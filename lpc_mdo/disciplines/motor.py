"""Operation of a permanent-magnet synchronous motor: currents, losses and torque limit from its equivalent circuit.

Steady state in the rotor's dq frame, amplitude-invariant, with w = pole pairs x speed:
    v_d = R i_d - w L_q i_q,  v_q = R i_q + w (L_d i_d + psi),  T = 1.5 p [psi i_q + (L_d - L_q) i_d i_q].
Maximum torque per ampere up to the voltage limit, then flux weakening along it. Source: Morimoto et al., IEEE Trans. Ind.
Appl. 26 (1990).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields

import torch
from torch import Tensor

from lpc_mdo.numerics.implicit import implicit_root
from lpc_mdo.numerics.smooth import smooth_maximum

HANDOVER_WIDTH = 0.005  # of the squared voltage limit: flux weakening sets in over about this range, infinitely smooth
NO_WEAKENING = 1e-11  # below this share of the squared voltage limit nothing is weakened


@dataclass(frozen=True)
class MotorCircuit:
    """Equivalent circuit and loss constants, each (...,)."""

    pole_pairs: Tensor
    phase_resistance: Tensor  # ohm
    inductance_d: Tensor  # H
    inductance_q: Tensor  # H, at least inductance_d
    flux_linkage: Tensor  # Wb
    voltage_limit: Tensor  # V, phase amplitude
    current_limit: Tensor  # A, phase amplitude
    hysteresis: Tensor  # W s: loss per speed at no-load flux
    eddy: Tensor  # W s^2: loss per squared speed at no-load flux
    bearing_torque: Tensor  # N m
    windage: Tensor  # W s^3
    stray_share: Tensor  # of the output power

    def at(self, index: Tensor) -> "MotorCircuit":
        """The circuits at `index` of the last dimension."""
        return MotorCircuit(*(getattr(self, field.name)[..., index] for field in fields(self)))


@dataclass(frozen=True)
class MotorOperation:
    """One operating point, each (...,): amperes, volts, watts."""

    current_d: Tensor
    current_q: Tensor
    voltage: Tensor
    copper_loss: Tensor
    iron_loss: Tensor
    mechanical_loss: Tensor
    stray_loss: Tensor
    output_power: Tensor
    input_power: Tensor

    @property
    def efficiency(self) -> Tensor:
        """Output over input (...,) of a driving motor."""
        return self.output_power / self.input_power

    @property
    def current(self) -> Tensor:
        """Phase amplitude (...,) A."""
        return torch.sqrt(self.current_d**2 + self.current_q**2)


def voltage_squared(c: MotorCircuit, current_d: Tensor, current_q: Tensor, speed: Tensor) -> Tensor:
    """Squared phase voltage amplitude (...,) V^2."""
    w = c.pole_pairs * speed
    v_d = c.phase_resistance * current_d - w * c.inductance_q * current_q
    v_q = c.phase_resistance * current_q + w * (c.inductance_d * current_d + c.flux_linkage)
    return v_d**2 + v_q**2


def electromagnetic_torque(c: MotorCircuit, current_d: Tensor, current_q: Tensor) -> Tensor:
    """Torque (...,) N m."""
    saliency = c.inductance_d - c.inductance_q
    return 1.5 * c.pole_pairs * (c.flux_linkage + saliency * current_d) * current_q


def _least_current_d(c: MotorCircuit, current_q: Tensor) -> Tensor:
    """i_d of maximum torque per ampere at i_q, free of cancellation as the saliency vanishes."""
    saliency = c.inductance_q - c.inductance_d
    root = torch.sqrt(c.flux_linkage**2 + 4.0 * saliency**2 * current_q**2)
    return -2.0 * saliency * current_q**2 / (c.flux_linkage + root)


def maximum_torque_per_ampere(c: MotorCircuit, torque: Tensor) -> tuple[Tensor, Tensor]:
    """Currents i_d, i_q (...,) A of least amplitude for `torque` (...,) N m of either sign."""
    without_reluctance = (torque / (1.5 * c.pole_pairs * c.flux_linkage)).detach()
    saliency = c.inductance_q - c.inductance_d

    def residual(current_q, torque, flux_linkage, saliency, pole_pairs):
        root = torch.sqrt(flux_linkage**2 + 4.0 * saliency**2 * current_q**2)
        # psi - dL i_d = (psi + root)/2 on the curve of least current.
        return 0.75 * pole_pairs * (flux_linkage + root) * current_q - torque

    zero = torch.zeros_like(without_reluctance)
    current_q = implicit_root(
        residual,
        torch.minimum(without_reluctance, zero) - 1e-6,
        torch.maximum(without_reluctance, zero) + 1e-6,
        torch.broadcast_tensors(torque, c.flux_linkage, saliency, c.pole_pairs),
        initial=without_reluctance,
    )
    return _least_current_d(c, current_q), current_q


def _most_torque_per_volt(c: MotorCircuit, speed: Tensor) -> tuple[Tensor, Tensor]:
    """Currents i_d, i_q (...,) A of the largest torque at the voltage limit when resistance is neglected.

    On the circle of flux V/w, (L_q psi - (L_q - L_d) flux_d) flux_q is largest; more current only costs torque there.
    """
    flux = c.voltage_limit / (c.pole_pairs * speed)
    saliency, reference = c.inductance_q - c.inductance_d, c.inductance_q * c.flux_linkage
    sine = 2.0 * saliency * flux / (reference + torch.sqrt(reference**2 + 8.0 * (saliency * flux) ** 2))
    return -(c.flux_linkage + flux * sine) / c.inductance_d, flux * torch.sqrt(1.0 - sine**2) / c.inductance_q


def _weaken(
    voltage_at: Callable[..., Tensor], limit_squared: Tensor, start: Tensor, end: Tensor, args: tuple[Tensor, ...]
) -> Tensor:
    """The point between `start` and `end` at which the squared voltage has fallen to its limit, smoothly.

    voltage_at(point, *args) is V^2. Well below the limit the answer is `start`; the demanded fall of V^2 rises as a
    softplus. Where even `end` exceeds the limit the lowest voltage on the way is approached: the torque limit, not
    this function, tells that the point is out of reach.
    """
    at_start, at_end = voltage_at(start, *args), voltage_at(end, *args)
    width = HANDOVER_WIDTH * limit_squared
    fall = width * torch.nn.functional.softplus((at_start - limit_squared) / width, threshold=50.0)
    target = smooth_maximum(at_start - fall, at_end, 1e-3 * limit_squared)
    is_weakening = (fall > NO_WEAKENING * limit_squared) & (target < at_start) & (target > at_end)

    def residual(share, start, end, target, limit_squared, *args):
        beyond = (target - voltage_at(start + share * (end - start), *args)) / limit_squared
        return torch.where(is_weakening, beyond, share)

    zero = torch.zeros_like(at_start).detach()
    operands = torch.broadcast_tensors(zero, start, end, target, limit_squared, *args)[1:]
    # Near its lowest point V^2 is quadratic in what is left of the way.
    left = torch.sqrt(((target - at_end) / (at_start - at_end)).clamp(0.0, 1.0)).detach()
    initial = torch.where(is_weakening, 1.0 - left, zero)
    share = implicit_root(residual, zero, zero + 1.0, operands, initial=initial)
    return start + share * (end - start)


def operate_motor(circuit: MotorCircuit, torque: Tensor, speed: Tensor) -> MotorOperation:
    """Currents and losses at shaft `torque` (...,) N m and `speed` (...,) rad/s > 0.

    Torque beyond the limits stays defined: currents grow on. Iron loss follows the flux of the operating point.
    """
    c = circuit
    least_d, _ = maximum_torque_per_ampere(c, torque)
    saliency = c.inductance_d - c.inductance_q

    def quadrature(current_d, torque, pole_pairs, flux_linkage, saliency):
        return torque / (1.5 * pole_pairs * (flux_linkage + saliency * current_d))

    def voltage_at(current_d, torque, speed, p, resistance, l_d, l_q, flux_linkage):
        current_q = quadrature(current_d, torque, p, flux_linkage, l_d - l_q)
        w = p * speed
        v_d = resistance * current_d - w * l_q * current_q
        return v_d**2 + (resistance * current_q + w * (l_d * current_d + flux_linkage)) ** 2

    args = (torque, speed, c.pole_pairs, c.phase_resistance, c.inductance_d, c.inductance_q, c.flux_linkage)
    end = torch.minimum(_most_torque_per_volt(c, speed)[0], 2.0 * least_d)
    current_d = _weaken(voltage_at, c.voltage_limit**2, least_d, end, args)
    current_q = quadrature(current_d, torque, c.pole_pairs, c.flux_linkage, saliency)

    copper = 1.5 * c.phase_resistance * (current_d**2 + current_q**2)
    linkage_squared = (c.flux_linkage + c.inductance_d * current_d) ** 2 + (c.inductance_q * current_q) ** 2
    iron = (c.hysteresis * speed + c.eddy * speed**2) * linkage_squared / c.flux_linkage**2
    mechanical = c.bearing_torque * speed + c.windage * speed**3
    output = torque * speed
    stray = c.stray_share * torch.sqrt(output**2 + 1.0)
    return MotorOperation(
        current_d=current_d,
        current_q=current_q,
        voltage=torch.sqrt(voltage_squared(c, current_d, current_q, speed)),
        copper_loss=copper,
        iron_loss=iron,
        mechanical_loss=mechanical,
        stray_loss=stray,
        output_power=output,
        input_power=output + copper + iron + mechanical + stray,
    )


def maximum_torque(circuit: MotorCircuit, speed: Tensor) -> Tensor:
    """Largest torque (...,) N m within the current and voltage limits at `speed` (...,) rad/s."""
    c = circuit
    saliency = c.inductance_q - c.inductance_d
    # At high speed less than the largest current gives the most torque; its slope vanishes at the change-over.
    current = torch.minimum(c.current_limit, torch.hypot(*_most_torque_per_volt(c, speed)))
    # On the current circle i_d = -I sin(angle), i_q = I cos(angle).
    best_d = (
        -2.0 * saliency * current**2 / (c.flux_linkage + torch.sqrt(c.flux_linkage**2 + 8.0 * saliency**2 * current**2))
    )
    start = torch.asin(-best_d / current)
    end = torch.full_like(start, 0.5 * math.pi - 1e-6)

    def voltage_at(angle, current, speed, p, resistance, l_d, l_q, flux_linkage):
        current_d, current_q = -current * torch.sin(angle), current * torch.cos(angle)
        w = p * speed
        v_d = resistance * current_d - w * l_q * current_q
        return v_d**2 + (resistance * current_q + w * (l_d * current_d + flux_linkage)) ** 2

    args = (current, speed, c.pole_pairs, c.phase_resistance, c.inductance_d, c.inductance_q, c.flux_linkage)
    angle = _weaken(voltage_at, c.voltage_limit**2, start, end, args)
    return electromagnetic_torque(c, -current * torch.sin(angle), current * torch.cos(angle))
