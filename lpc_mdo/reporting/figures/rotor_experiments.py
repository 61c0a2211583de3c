"""Blade-element momentum theory beside published rotor and propeller experiments."""

from pathlib import Path

import torch
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lpc_mdo.verification.rotor_experiments import HoverCurve, PropellerCurve, hover_curves, propeller_curve

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")  # Okabe and Ito: distinct to colour-blind readers
MARKERS = ("o", "s", "^", "D")


def rotor_experiments() -> Figure:
    """Thrust and torque of hovering rotors over blade angle; thrust, power and efficiency of a propeller over advance ratio."""
    figure = Figure(figsize=(10.0, 7.4), layout="constrained")
    FigureCanvasAgg(figure)
    (thrust, torque), (coefficients, efficiency) = figure.subplots(2, 2)
    with torch.no_grad():
        hover, propeller = hover_curves(), propeller_curve()
    _draw_hover(thrust, torque, hover)
    _draw_propeller(coefficients, efficiency, propeller)
    for axes in (thrust, torque, coefficients, efficiency):
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _draw_hover(thrust: Axes, torque: Axes, curves: list[HoverCurve]) -> None:
    fine = torch.linspace(0.02, 12.5, 120, dtype=torch.float64)
    for curve, colour, marker in zip(curves, COLOURS, MARKERS, strict=True):
        ours = curve.model(fine)
        for axes, measured, line, scale in (
            (thrust, curve.measured_thrust, ours[0], 1e3),
            (torque, curve.measured_torque, ours[1], 1e4),
        ):
            label = f"{curve.blades} blades, measured"
            axes.plot(curve.blade_angle_deg, scale * measured, marker, color=colour, label=label)
            axes.plot(fine, scale * line, "-", color=colour)
    thrust.plot([], [], "-", color="0.3", label="model")
    thrust.set(xlabel="blade angle, deg", ylabel=r"thrust coefficient $T/\rho A(\Omega R)^2$, $10^{-3}$")
    torque.set(xlabel="blade angle, deg", ylabel=r"torque coefficient $Q/\rho A(\Omega R)^2R$, $10^{-4}$")
    thrust.set_title("Hover, untwisted NACA 0015 blades (Knight and Hefner 1937)", fontsize=10)
    torque.set_title("The same: torque", fontsize=10)
    thrust.legend(fontsize=8)


def _draw_propeller(coefficients: Axes, efficiency: Axes, curve: PropellerCurve) -> None:
    advance = curve.advance_ratio
    for measured, ours, colour, marker, name in (
        (curve.measured_thrust, curve.thrust, COLOURS[0], "o", "thrust"),
        (curve.measured_power, curve.power, COLOURS[1], "s", "power"),
    ):
        coefficients.plot(advance, measured, marker, color=colour, markersize=4, label=f"{name}, measured")
        coefficients.plot(advance, ours, "-", color=colour, label=f"{name}, model")
    coefficients.axhline(0.0, color="0.5", linewidth=0.8)
    coefficients.set(xlabel="advance ratio $V/nD$", ylabel=r"$T/\rho n^2D^4$ and $P/\rho n^3D^5$")
    coefficients.set_title("Propeller DA4002 9x6.75 near 5000 rpm (Deters et al. 2014)", fontsize=10)
    coefficients.legend(fontsize=8)
    is_measured, is_driven = curve.measured_thrust > 0.0, curve.thrust > 0.0
    efficiency.plot(
        advance[is_measured],
        curve.measured_efficiency[is_measured],
        "o",
        color=COLOURS[2],
        markersize=4,
        label="measured",
    )
    efficiency.plot(advance[is_driven], curve.efficiency[is_driven], "-", color=COLOURS[2], label="model")
    efficiency.set(xlabel="advance ratio $V/nD$", ylabel="propulsive efficiency", ylim=(0.0, 0.8))
    efficiency.set_title("The same: efficiency while it pulls", fontsize=10)
    efficiency.legend(fontsize=8, loc="upper left")


def save_rotor_experiments(file: Path) -> None:
    """Write the figure; its format follows the suffix."""
    rotor_experiments().savefig(file, dpi=150)
