"""Batteries as Thevenin circuits: open-circuit voltage, series resistance, one resistor-capacitor pair.

    P = (E - R0 I) I,  E = OCV(SoC) - v,  dSoC/dt = -I/Q,  dv/dt = (I - v/R1)/C1.

Along segments of constant power the current is found at the nodes of Radau's rule on panels that are graded towards each
segment's start, all nodes of a mission at once: charge and pair voltage are linear in the nodes' currents, and a fixed-point
iteration, a contraction wherever the cell sustains the power, closes the circuit. Source of the circuit: Plett, Battery
Management Systems I (2015), section 2.4; of the rule: Hairer and Wanner, Solving ODEs II (1996), section IV.5.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import torch
from numpy.polynomial import legendre
from torch import Tensor

from lpc_mdo.numerics.implicit import RootNotFoundError

NODES = 8  # of Radau's rule on each panel: order 15
GRADED_PANELS = (1 / 64, 1 / 16, 1 / 4, 1.0)  # panel ends over a segment's time; the pair settles in the first ones
SUSTAINED_SHARE = 0.9  # of the most power that the cell sustains: demands beyond are cut, smoothly
LEAST_CHARGE = 0.02  # below it the voltage is bent to stay finite: for designs that no constraint would admit
ITERATIONS = 200  # about ten are usual

Voltage = Callable[[Tensor], Tensor]  # open-circuit voltage V of a state of charge, element by element


@dataclass(frozen=True)
class TheveninCell:
    """One cell."""

    series_resistance: float  # ohm
    pair_resistance: float  # ohm
    pair_capacitance: float  # F
    capacity: float  # C
    open_circuit_voltage: Voltage


@dataclass(frozen=True)
class TheveninState:
    """After each segment, (..., segment), and the extremes during it."""

    state_of_charge: Tensor
    pair_voltage: Tensor  # V
    current: Tensor  # A
    terminal_voltage: Tensor  # V
    lowest_voltage: Tensor  # V
    highest_rate: Tensor  # 1/h, current over capacity
    power_margin: Tensor  # 1 - demand over sustained power; below 1 - SUSTAINED_SHARE the demand is cut

    @property
    def final_state_of_charge(self) -> Tensor:
        return self.state_of_charge[..., -1]


def tabulated_voltage(charge: Tensor, voltage: Tensor) -> Voltage:
    """Piecewise linear between the points (k,) of a table, extended by its end slopes; below, it bends to stay positive.

    Raises ValueError unless charge increases and voltage is positive and does not fall.
    """
    if charge.numel() < 2 or bool((charge.diff() <= 0.0).any()):
        raise ValueError("charge is not allowed; a table needs two or more increasing states of charge")
    if bool((voltage <= 0.0).any()) or bool((voltage.diff() < 0.0).any()):
        raise ValueError("voltage is invalid: it must be above 0 and must not fall as the charge rises")

    def interpolated(x: Tensor) -> Tensor:
        table, values = charge.to(x), voltage.to(x)
        index = torch.searchsorted(table, x.detach().contiguous()).clamp(1, len(table) - 1)
        x0, x1, y0, y1 = table[index - 1], table[index], values[index - 1], values[index]
        rise = (y1 - y0) * (x - x0) / (x1 - x0)
        return torch.where(x < table[0], y0 * torch.exp((rise / y0).clamp(max=0.0)), y0 + rise)

    return interpolated


def lg_m50_voltage(charge: Tensor) -> Tensor:
    """Open-circuit voltage (...,) V of an LG M50 (NMC 811 over graphite with silicon) at charge (...,) from 0 to 1.

    Difference of the half cells' fits of Chen et al., J. Electrochem. Soc. 167 (2020) 080534, equations 8 and 9, between their
    stoichiometries at 2.5 and 4.2 V. Below a charge of 2 % it bends towards the voltage at zero.
    """
    x = torch.where(
        charge > LEAST_CHARGE, charge, LEAST_CHARGE * torch.exp((charge / LEAST_CHARGE - 1.0).clamp(max=0.0))
    )
    positive, negative = 0.9084 + (0.2661 - 0.9084) * x, 0.0279 + (0.9014 - 0.0279) * x
    cathode = (
        4.4875
        - 0.8090 * positive
        - 0.0428 * torch.tanh(18.5138 * (positive - 0.5542))
        - 17.7326 * torch.tanh(15.7890 * (positive - 0.3117))
        + 17.5842 * torch.tanh(15.9308 * (positive - 0.3120))
    )
    anode = (
        0.2482
        + 1.9793 * torch.exp(-39.3631 * negative)
        - 0.0909 * torch.tanh(29.8538 * (negative - 0.1234))
        - 0.04478 * torch.tanh(14.9159 * (negative - 0.2769))
        - 0.0205 * torch.tanh(30.4444 * (negative - 0.6103))
    )
    return cathode - anode


LG_M50 = TheveninCell(
    series_resistance=0.020,  # ASSUMED: 5 A h energy cells of this size show 20 to 25 milliohm at once
    pair_resistance=0.012,  # ASSUMED: 30 to 35 milliohm after some ten seconds
    pair_capacitance=2500.0,  # ASSUMED: a time constant of 30 s
    capacity=5.0 * 3600.0,  # data sheet, 5 A h
    open_circuit_voltage=lg_m50_voltage,
)
LG_M50_CUT_OFF = 2.5  # V, data sheet


@cache
def cell_energy(cell: TheveninCell) -> float:
    """Energy J that a full cell holds: capacity times the mean of its open-circuit voltage."""
    nodes, weights = legendre.leggauss(200)
    voltage = cell.open_circuit_voltage(torch.tensor(0.5 * (nodes + 1.0), dtype=torch.float64))
    return cell.capacity * 0.5 * float(voltage @ torch.tensor(weights, dtype=torch.float64))


def pack_discharge(
    cell: TheveninCell, power: Tensor, duration: Tensor, mass: Tensor, specific_energy: float
) -> TheveninState:
    """A pack of `mass` (...,) kg and specific_energy J/kg, full at first, of equal cells that share the power evenly.

    power (..., segment) W at the terminals, duration (..., segment) s. The number of cells is real-valued; how many are in
    series changes the bus voltage, not what a cell sees. Volts and amperes of the result are a cell's.
    """
    cells = mass * specific_energy / cell_energy(cell)
    return thevenin_discharge(cell, power / cells[..., None], duration)


@cache
def _integration_matrix(panels: int) -> np.ndarray:
    """(panels x nodes, panels x nodes): integral up to each node of what has given values at the nodes, panels of unit width.

    Nodes on (0, 1]: zeros of the difference of two Legendre polynomials, the end included.
    """
    difference = np.zeros(NODES + 1)
    difference[NODES - 1], difference[NODES] = -1.0, 1.0
    points = np.sort(0.5 * (legendre.legroots(difference) + 1.0))
    points[-1] = 1.0
    basis = np.linalg.inv(legendre.legvander(2.0 * points - 1.0, NODES - 1))  # node values to Legendre coefficients
    integrals = np.stack([legendre.legint(np.eye(NODES)[k], lbnd=-1) for k in range(NODES)])
    inside = 0.5 * legendre.legval(2.0 * points - 1.0, integrals.T).T @ basis
    whole = np.tile(inside[-1], (NODES, 1))
    blocks = [
        [inside if q == p else whole if q < p else np.zeros_like(whole) for q in range(panels)] for p in range(panels)
    ]
    return np.block(blocks)


def thevenin_discharge(
    cell: TheveninCell,
    power: Tensor,
    duration: Tensor,
    initial: float | Tensor = 1.0,
    panels: Sequence[float] = GRADED_PANELS,
    initial_pair_voltage: float | Tensor = 0.0,
) -> TheveninState:
    """Discharge at constant power by segments: power (..., segment) W at the terminals, duration (..., segment) s.

    initial, initial_pair_voltage (...,): state of charge and the pair's voltage V at first; at rest it has none. panels: ends of the panels over a segment's time, the last 1;
    graded ones suit smooth voltages, many even ones tables with kinks. Demands beyond 90 % of the most power that open-circuit
    voltage and both resistances sustain are cut smoothly: `power_margin` tells, and a constraint forbids. NaN stays in its
    element. Raises ValueError unless the panels increase to 1.
    """
    edges = (0.0, *panels)
    if len(edges) < 2 or edges[-1] != 1.0 or any(b <= a for a, b in itertools.pairwise(edges)):
        raise ValueError(f"panels = {tuple(panels)} is not allowed; they must increase from above 0 to 1")
    power, duration = torch.broadcast_tensors(power, duration)
    segments, nodes = power.shape[-1], len(panels) * NODES
    width = torch.tensor([b - a for a, b in itertools.pairwise(edges)], dtype=power.dtype, device=power.device)
    columns = (duration[..., None] * width).flatten(-2).repeat_interleave(NODES, -1)
    integrals = torch.as_tensor(_integration_matrix(segments * len(panels))).to(power) * columns[..., None, :]
    share = integrals / (cell.pair_resistance * cell.pair_capacitance)
    # v = v0 + integral of (R1 I - v)/(R1 C1).
    settling = share + torch.eye(share.shape[-1]).to(power)
    response = torch.linalg.solve(settling, share)
    pair_start = torch.as_tensor(initial_pair_voltage, dtype=power.dtype, device=power.device)[..., None]
    decaying = pair_start * (1.0 - response.sum(-1))  # settling^-1 1 = 1 - settling^-1 share 1
    demand = power.repeat_interleave(nodes, -1)
    start = torch.as_tensor(initial, dtype=power.dtype, device=power.device)[..., None]

    def of_currents(current: Tensor) -> tuple[Tensor, Tensor]:
        charge = start - (integrals @ current[..., None])[..., 0] / cell.capacity
        return charge, decaying + cell.pair_resistance * (response @ current[..., None])[..., 0]

    with torch.no_grad():
        current = _closed_circuit(cell, of_currents, demand)
        jacobian = _jacobian(cell, current, of_currents, demand, integrals, response)
    # One Newton step in the graph has the derivatives of the implicit-function theorem.
    excess = current - _current(cell, *of_currents(current), demand)[0]
    current = current - torch.linalg.solve(jacobian, excess)
    charge, pair = of_currents(current)
    _, margin = _current(cell, charge, pair, demand)
    voltage = cell.open_circuit_voltage(charge) - pair - cell.series_resistance * current
    by_segment = [value.unflatten(-1, (segments, nodes)) for value in (charge, pair, current, voltage, margin)]
    ends = [value[..., -1] for value in by_segment[:4]]
    return TheveninState(
        state_of_charge=ends[0],
        pair_voltage=ends[1],
        current=ends[2],
        terminal_voltage=ends[3],
        lowest_voltage=by_segment[3].amin(-1),
        highest_rate=by_segment[2].amax(-1) * 3600.0 / cell.capacity,
        power_margin=by_segment[4].amin(-1),
    )


def _current(cell: TheveninCell, charge: Tensor, pair: Tensor, demand: Tensor) -> tuple[Tensor, Tensor]:
    """Current A, element by element, and the margin to the sustained power."""
    open_circuit = cell.open_circuit_voltage(charge)
    sustained = open_circuit**2 / (4.0 * (cell.series_resistance + cell.pair_resistance))
    share, soft = demand / sustained, 0.5 * (1.0 - SUSTAINED_SHARE)
    beyond = (share - SUSTAINED_SHARE).clamp(min=0.0)
    cut = torch.where(share > SUSTAINED_SHARE, SUSTAINED_SHARE + soft * (1.0 - torch.exp(-beyond / soft)), share)
    power, source = cut * sustained, open_circuit - pair
    root = torch.sqrt((source**2 - 4.0 * cell.series_resistance * power).clamp(min=0.0))
    return 2.0 * power / (source + root), 1.0 - share


def _closed_circuit(
    cell: TheveninCell, of_currents: Callable[[Tensor], tuple[Tensor, Tensor]], demand: Tensor
) -> Tensor:
    """Currents (..., node) at which charge and pair voltage ask for these currents."""
    current = torch.zeros_like(demand)
    tolerance = 64.0 * torch.finfo(demand.dtype).eps
    for _ in range(ITERATIONS):
        new, _ = _current(cell, *of_currents(current), demand)
        change = (new - current).abs() - tolerance * new.abs()
        current = new
        if bool(((change <= 0.0) | change.isnan()).all()):
            return current
    raise RootNotFoundError(f"{int((change > 0.0).sum())} currents of {change.numel()} did not settle")


def _jacobian(
    cell: TheveninCell,
    current: Tensor,
    of_currents: Callable[[Tensor], tuple[Tensor, Tensor]],
    demand: Tensor,
    integrals: Tensor,
    response: Tensor,
) -> Tensor:
    """Derivative (..., node, node) of a current less what the circuit makes of all currents."""
    with torch.enable_grad():
        charge, pair = (value.detach().requires_grad_() for value in of_currents(current))
        value, _ = _current(cell, charge, pair, demand.detach())
        # A constant open-circuit voltage does not know the charge.
        by_charge, by_pair = torch.autograd.grad(value.sum(), (charge, pair), materialize_grads=True)
    circuit = by_pair[..., None] * cell.pair_resistance * response - by_charge[..., None] * integrals / cell.capacity
    return torch.eye(circuit.shape[-1]).to(circuit) - circuit
