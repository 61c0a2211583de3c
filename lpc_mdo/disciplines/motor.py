"""Operation of a permanent-magnet synchronous motor: currents and losses from its equivalent circuit.

Steady state in the rotor's dq frame, amplitude-invariant, with w = pole pairs x speed:
    v_d = R i_d - w L_q i_q,  v_q = R i_q + w (L_d i_d + psi),  T = 1.5 p [psi i_q + (L_d - L_q) i_d i_q].
Maximum torque per ampere up to the voltage limit, then flux weakening along it; the largest torque is in `motor_limits`.
Source: Morimoto et al., IEEE Trans. Ind. Appl. 26 (1990).
"""

from dataclasses import dataclass, fields
from functools import partial

import torch
from torch import Tensor

from lpc_mdo.numerics.crossing import falling_crossing
from lpc_mdo.numerics.smooth import safe_sqrt, smooth_maximum
from lpc_mdo.numerics.trinomial import trinomial_root

HANDOVER_WIDTH = 0.005  # of the squared voltage limit: flux weakening sets in over about this range, infinitely smooth
VOLTAGE_WIDTH = 1e-3  # of the squared voltage limit: how far the lowest voltage is rounded off, and
VOLTAGE_TOLERANCE = 0.25 * VOLTAGE_WIDTH  # of the limit: so far may the voltage exceed it at the largest torque
NARROWEST = 1e-6  # of the squared voltage limit: at rest, where flux weakening does nothing
REACH = 4.0  # times what the current limit's worth of flux weakening takes off the squared voltage: no wider is the handover
CURRENT_TOLERANCE = 5e-4  # of the limit: so far may the current exceed it at the largest torque
NO_WEAKENING = 1e-11  # below this share of the squared voltage limit nothing is weakened
SMALL = 1e-12  # A or V: amplitudes are rounded off below, so that they have a slope at rest
NO_IMPEDANCE = 1e-30  # ohm^2: nothing beside any winding's

Polynomial = tuple[Tensor, ...]  # coefficients of V^2 at constant torque


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

    air_gap_torque: Tensor  # N m: the shaft's and friction's
    current_d: Tensor
    current_q: Tensor
    voltage: Tensor
    copper_loss: Tensor
    iron_loss: Tensor
    mechanical_loss: Tensor
    stray_loss: Tensor
    output_power: Tensor
    input_power: Tensor

    def at(self, index: Tensor) -> "MotorOperation":
        """The operating points at `index` of the last dimension."""
        return MotorOperation(*(getattr(self, field.name)[..., index] for field in fields(self)))

    @property
    def efficiency(self) -> Tensor:
        """Output over input (...,) of a driving motor."""
        return self.output_power / self.input_power

    @property
    def current(self) -> Tensor:
        """Phase amplitude in the winding (...,) A."""
        return safe_sqrt(self.current_d**2 + self.current_q**2, SMALL**2)

    @property
    def terminal_current(self) -> Tensor:
        """Phase amplitude at the terminals (...,) A: the winding's, and what iron and stray loss draw in phase with the voltage.

        3/2 x voltage x that x power factor is the input power.
        """
        voltage = safe_sqrt(self.voltage**2, SMALL**2)
        winding = (self.input_power - self.iron_loss - self.stray_loss) / (1.5 * voltage)  # in phase with the voltage
        active = self.input_power / (1.5 * voltage)
        return safe_sqrt(self.current**2 + active**2 - winding**2, SMALL**2)


def voltage_squared(c: MotorCircuit, current_d: Tensor, current_q: Tensor, speed: Tensor) -> Tensor:
    """Squared phase voltage amplitude (...,) V^2."""
    w = c.pole_pairs * speed
    v_d = c.phase_resistance * current_d - w * c.inductance_q * current_q
    v_q = c.phase_resistance * current_q + w * (c.inductance_d * current_d + c.flux_linkage)
    return v_d**2 + v_q**2


def electromagnetic_torque(c: MotorCircuit, current_d: Tensor, current_q: Tensor) -> Tensor:
    """Air-gap torque (...,) N m at currents (...,) A."""
    saliency = c.inductance_d - c.inductance_q
    return 1.5 * c.pole_pairs * (c.flux_linkage + saliency * current_d) * current_q


def _least_current_d(c: MotorCircuit, current_q: Tensor) -> Tensor:
    """i_d of maximum torque per ampere at i_q, free of cancellation as the saliency vanishes."""
    saliency = c.inductance_q - c.inductance_d
    root = torch.sqrt(c.flux_linkage**2 + 4.0 * saliency**2 * current_q**2)
    return -2.0 * saliency * current_q**2 / (c.flux_linkage + root)


def maximum_torque_per_ampere(c: MotorCircuit, torque: Tensor) -> tuple[Tensor, Tensor]:
    """Currents i_d, i_q (...,) A of least amplitude for `torque` (...,) N m of either sign."""
    without_reluctance = torque / (1.5 * c.pole_pairs * c.flux_linkage)
    # With i_q = h x that, the torque equation on the curve of least current becomes h + (dL/psi x that)^2 h^4 = 1.
    share = trinomial_root(((c.inductance_q - c.inductance_d) / c.flux_linkage * without_reluctance) ** 2, 4)
    current_q = without_reluctance * share
    return _least_current_d(c, current_q), current_q


def _lowest_voltage_current_d(c: MotorCircuit, torque: Tensor, speed: Tensor) -> Tensor:
    """i_d (...,) A of the lowest voltage at which `torque` can be made, in closed form and free of cancellation.

    On the curve of constant torque, V^2 is least where m g^3 (g - 1) is a constant, g = (psi - dL i_d)/m: with h = 1/g the
    equation of `trinomial_root`.
    """
    saliency = c.inductance_q - c.inductance_d
    w, k = c.pole_pairs * speed, torque / (1.5 * c.pole_pairs)
    # The floors serve a motor without resistance at rest, whose voltage is zero everywhere.
    impedance_d = c.phase_resistance**2 + (w * c.inductance_d) ** 2 + NO_IMPEDANCE
    impedance_q = c.phase_resistance**2 + (w * c.inductance_q) ** 2 + NO_IMPEDANCE
    idle = w**2 * c.inductance_d * c.flux_linkage / impedance_d  # -i_d of the lowest voltage at no torque
    m = c.flux_linkage + saliency * idle
    ratio = saliency * impedance_q / impedance_d * (k / m**2) ** 2
    h = trinomial_root(saliency * ratio, 4)
    return -c.flux_linkage * ratio * h**3 - idle / h


def _weakened_current_d(c: MotorCircuit, torque: Tensor, speed: Tensor, least_d: Tensor) -> Tensor:
    """i_d (...,) A at which the squared voltage has fallen to its limit, smoothly; least_d (...,) well below the limit.

    The demanded fall of V^2 rises as a softplus. Where even the lowest voltage exceeds the limit, it is approached: the torque
    limit, not this function, tells that the point is out of reach. NaN stays in its element.
    """
    limit_squared, polynomial = c.voltage_limit**2, _polynomial(c, torque, speed)
    with torch.no_grad():  # V^2 is stationary there: no derivative comes this way
        end = torch.minimum(_lowest_voltage_current_d(c, torque, speed), least_d)
    at_start, at_end = _along_current_d(least_d, polynomial), _along_current_d(end, polynomial)
    # Of a motor that flux weakening hardly helps, so many volts would take far more current than its limit.
    scale = torch.minimum(limit_squared, REACH * c.current_limit * polynomial[1] + NARROWEST * limit_squared)
    width = HANDOVER_WIDTH * scale
    fall = width * torch.nn.functional.softplus((at_start - limit_squared) / width, threshold=50.0)
    target = smooth_maximum(at_start - fall, at_end, VOLTAGE_WIDTH * scale)
    is_weakening = (fall > NO_WEAKENING * limit_squared) & (target < at_start) & (target > at_end)
    point, slope = falling_crossing(
        partial(_along_current_d, polynomial=polynomial),
        partial(_slopes_along_current_d, polynomial=polynomial),
        target,
        least_d,
        end,
        is_weakening,
        limit_squared,
    )
    # One Newton step in the graph has the derivatives of the implicit-function theorem.
    is_moved = is_weakening | target.isnan()
    return torch.where(is_moved, point - (_along_current_d(point, polynomial) - target) / slope, least_d)


def _polynomial(c: MotorCircuit, torque: Tensor, speed: Tensor) -> Polynomial:
    """Coefficients of V^2 at constant torque: with i_q = k/(psi - dL i_d) the part that is linear in i_q is constant."""
    w, k = c.pole_pairs * speed, torque / (1.5 * c.pole_pairs)
    return (
        2.0 * c.phase_resistance * w * k + (w * c.flux_linkage) ** 2,
        2.0 * w**2 * c.inductance_d * c.flux_linkage,
        c.phase_resistance**2 + (w * c.inductance_d) ** 2,
        (c.phase_resistance**2 + (w * c.inductance_q) ** 2) * k**2,
        c.flux_linkage,
        c.inductance_q - c.inductance_d,
    )


def _along_current_d(current_d: Tensor, polynomial: Polynomial) -> Tensor:
    """V^2 at constant torque, a convex function of i_d."""
    constant, linear, quadratic, quadrature, flux_linkage, saliency = polynomial
    return (
        constant
        + current_d * (linear + quadratic * current_d)
        + quadrature / (flux_linkage - saliency * current_d) ** 2
    )


def _slopes_along_current_d(current_d: Tensor, polynomial: Polynomial) -> tuple[Tensor, Tensor]:
    _, linear, quadratic, quadrature, flux_linkage, saliency = polynomial
    flux = flux_linkage - saliency * current_d
    ratio = saliency / flux
    bend = 2.0 * quadrature * ratio / flux**2
    return linear + 2.0 * quadratic * current_d + bend, 2.0 * quadratic + 3.0 * bend * ratio


def friction_torque(c: MotorCircuit, speed: Tensor) -> Tensor:
    """Torque (...,) N m of bearings and windage at `speed` (...,) rad/s, which the air gap makes beside the shaft's."""
    return c.bearing_torque + c.windage * speed**2


def operate_motor(circuit: MotorCircuit, torque: Tensor, speed: Tensor) -> MotorOperation:
    """Currents and losses at shaft `torque` (...,) N m and `speed` (...,) rad/s, at least 0.

    Friction takes torque, and so current, beside the shaft. Iron loss follows the flux of the operating point; it and stray
    loss draw their current at the terminals, beside the winding, whose current is what the limit holds. Torque beyond the
    limits stays defined: currents grow on.
    """
    c = circuit
    friction = friction_torque(c, speed)
    air_gap = torque + friction
    least_d, _ = maximum_torque_per_ampere(c, air_gap)
    current_d = _weakened_current_d(c, air_gap, speed, least_d)
    current_q = air_gap / (1.5 * c.pole_pairs * (c.flux_linkage - (c.inductance_q - c.inductance_d) * current_d))

    copper = 1.5 * c.phase_resistance * (current_d**2 + current_q**2)
    linkage_squared = (c.flux_linkage + c.inductance_d * current_d) ** 2 + (c.inductance_q * current_q) ** 2
    iron = (c.hysteresis * speed + c.eddy * speed**2) * linkage_squared / c.flux_linkage**2
    mechanical = friction * speed
    output = torque * speed
    stray = c.stray_share * torch.sqrt(output**2 + 1.0)
    return MotorOperation(
        air_gap_torque=air_gap,
        current_d=current_d,
        current_q=current_q,
        voltage=safe_sqrt(voltage_squared(c, current_d, current_q, speed), SMALL**2),
        copper_loss=copper,
        iron_loss=iron,
        mechanical_loss=mechanical,
        stray_loss=stray,
        output_power=output,
        input_power=output + copper + iron + mechanical + stray,
    )
