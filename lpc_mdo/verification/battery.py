"""The battery's equivalent circuit against independent integrations, and the energy model against its limit."""

import math

import numpy as np
import torch
from scipy.integrate import solve_ivp

from lpc_mdo.cases.electric import BatteryInputs, analyze_battery
from lpc_mdo.disciplines.battery import energy_state_of_charge
from lpc_mdo.disciplines.equivalent_circuit import LG_M50, TheveninCell, cell_energy, thevenin_discharge
from lpc_mdo.verification.comparison import Between, Comparison, reference

MODEL = "equivalent circuit"
# Two flights and a reserve: watts of one cell and seconds.
POWER, DURATION = (35.0, 12.0, 9.0, 35.0, 12.0, 9.0, 9.0), (90.0, 200.0, 800.0, 90.0, 200.0, 800.0, 960.0)


def comparisons() -> list[Comparison]:
    with torch.no_grad():
        return [_reference(), _mission(), _lossless()]


def _reference() -> Comparison:
    case = reference("battery_thevenin")
    ours = analyze_battery(BatteryInputs.model_validate(case["inputs"]), [], None)
    keys = case["results"][0]
    return Between(MODEL, "SciPy solve_ivp, reference case").absolute(
        "charge, voltage V, current A after each segment",
        [[row[key] for key in keys] for row in ours],
        [[row[key] for key in keys] for row in case["results"]],
        1e-6,
        "kinks of the voltage table",
        "of the unit",
    )


def _mission() -> Comparison:
    ours = thevenin_discharge(LG_M50, *(torch.tensor(v, dtype=torch.float64) for v in (POWER, DURATION)))
    theirs = _by_scipy(LG_M50)
    return Between(MODEL, "SciPy solve_ivp (DOP853), mission of an LG M50").absolute(
        "charge and pair voltage V after each segment",
        torch.stack([ours.state_of_charge, ours.pair_voltage], dim=-1),
        theirs,
        1e-6,
        "eight nodes on each of four panels a segment",
        "of the unit",
    )


def _by_scipy(cell: TheveninCell) -> np.ndarray:
    """(segment, 2) state of charge and pair voltage."""

    def slope(_: float, y: np.ndarray, demand: float) -> list[float]:
        source = float(cell.open_circuit_voltage(torch.tensor(y[0], dtype=torch.float64))) - y[1]
        current = (source - math.sqrt(source**2 - 4.0 * cell.series_resistance * demand)) / (
            2.0 * cell.series_resistance
        )
        return [-current / cell.capacity, (current - y[1] / cell.pair_resistance) / cell.pair_capacitance]

    state, rows = [1.0, 0.0], []
    for demand, time in zip(POWER, DURATION, strict=True):
        run = solve_ivp(slope, (0.0, time), state, method="DOP853", rtol=1e-11, atol=1e-13, args=(demand,))
        state = run.y[:, -1]
        rows.append(state)
    return np.array(rows)


def _lossless() -> Comparison:
    """Slow discharge loses nothing: both models draw the same energy from the same cell."""
    power, energy = torch.tensor([1e-4], dtype=torch.float64), cell_energy(LG_M50)
    duration = 0.5 * energy / power
    circuit = thevenin_discharge(LG_M50, power, duration, panels=[(k + 1) / 40 for k in range(40)])
    # Charge that the circuit's voltage makes of half the energy.
    grid = torch.linspace(float(circuit.final_state_of_charge), 1.0, 20001, dtype=torch.float64)
    drawn = LG_M50.capacity * float(torch.trapezoid(LG_M50.open_circuit_voltage(grid), grid))
    simple = energy_state_of_charge(power, duration, torch.ones((), dtype=torch.float64), energy)
    left = (1.0 - float(simple.final_state_of_charge)) * energy
    return Between(MODEL, "energy model").relative(
        "energy drawn at vanishing power, J", drawn, left, 1e-5, "resistance at 0.03 mA"
    )
