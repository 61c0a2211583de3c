"""Blade-element momentum theory beside published rotor and propeller experiments."""

from pathlib import Path

import torch
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lpc_mdo.reporting import style
from lpc_mdo.verification.comparison import reference
from lpc_mdo.verification.rotor_experiments import (
    HoverCurve,
    PropellerCurve,
    caradonna_tung_thrust,
    hover_curves,
    propeller_curve,
)

HOVER, PROPELLER = "verification_hover.png", "verification_propeller.png"
MARKERS = ("o", "s", "^", "D")
POINTS = {"markersize": 4.5, "linestyle": "none"}


def hover_figure() -> Figure:
    """Thrust and torque of hovering model rotors over blade angle: lines are the model, points the experiments."""
    figure = style.figure(3.0)
    thrust, torque, short = figure.subplots(1, 3)
    with torch.no_grad():
        _draw_knight_hefner(thrust, torque, hover_curves())
        _draw_caradonna_tung(short)
    for axes in (thrust, torque, short):
        axes.set(xlabel="blade angle, deg", xlim=(0.0, 13.0), ylim=(0.0, None))
        axes.set_xticks(range(0, 13, 4))
    thrust.set_title("Thrust coefficient × 10³")
    torque.set_title("Torque coefficient × 10⁴")
    short.set_title("Thrust coefficient × 10³")
    thrust.legend(fontsize=7, title="Knight and Hefner, blades", title_fontsize=7)
    short.legend(fontsize=7, title="Caradonna and Tung", title_fontsize=7)
    return figure


def _draw_knight_hefner(thrust: Axes, torque: Axes, curves: list[HoverCurve]) -> None:
    fine = torch.linspace(0.02, 12.5, 120, dtype=torch.float64)
    for curve, color, marker in zip(curves, style.CYCLE, MARKERS, strict=False):
        for axes, measured, line, scale in zip(
            (thrust, torque), (curve.measured_thrust, curve.measured_torque), curve.model(fine), (1e3, 1e4), strict=True
        ):
            axes.plot(fine, scale * line, color=color)
            axes.plot(curve.blade_angle_deg, scale * measured, marker, color=color, label=str(curve.blades), **POINTS)


def _draw_caradonna_tung(axes: Axes) -> None:
    rows = reference("rotor_caradonna_tung_1981")["results"]
    angles = [row["blade_angle_deg"] for row in rows]
    measured = [1e3 * row["thrust_coefficient"] for row in rows]
    others = [m * (1.0 + row["other_code_relative_difference"]) for m, row in zip(measured, rows, strict=True)]
    fine = torch.linspace(0.5, 12.5, 60, dtype=torch.float64)
    axes.plot(fine, 1e3 * caradonna_tung_thrust(fine), color=style.BLUE, label="model")
    axes.plot(angles, others, "x", color=style.MUTED, label="another such code", **POINTS)
    axes.plot(angles, measured, "o", color=style.ORANGE, label="measured", **POINTS)


def propeller_figure() -> Figure:
    """Thrust, power and efficiency of a propeller over advance ratio: lines are the model, points the experiment."""
    figure = style.figure(3.0)
    coefficients, efficiency = figure.subplots(1, 2)
    with torch.no_grad():
        curve = propeller_curve()
    _draw_coefficients(coefficients, curve)
    _draw_efficiency(efficiency, curve)
    for axes in (coefficients, efficiency):
        axes.set(xlabel="advance ratio V/nD", xlim=(0.0, None))
    coefficients.set_title("Thrust T/ρn²D⁴ and power P/ρn³D⁵")
    efficiency.set_title("Efficiency while it pulls")
    return figure


def _draw_coefficients(axes: Axes, curve: PropellerCurve) -> None:
    for name, measured, ours, color, marker in (
        ("thrust", curve.measured_thrust, curve.thrust, style.BLUE, "o"),
        ("power", curve.measured_power, curve.power, style.ORANGE, "s"),
    ):
        axes.plot(curve.advance_ratio, ours, color=color, label=f"{name}, model")
        axes.plot(curve.advance_ratio, measured, marker, color=color, label=f"{name}, measured", **POINTS)
    axes.axhline(0.0, color=style.MUTED, linewidth=0.8)
    axes.legend(fontsize=7)


def _draw_efficiency(axes: Axes, curve: PropellerCurve) -> None:
    pulls, is_measured = curve.thrust > 0.0, curve.measured_thrust > 0.0
    axes.plot(curve.advance_ratio[pulls], curve.efficiency[pulls], color=style.GREEN, label="model")
    axes.plot(
        curve.advance_ratio[is_measured],
        curve.measured_efficiency[is_measured],
        "o",
        color=style.GREEN,
        label="measured",
        **POINTS,
    )
    axes.set_ylim(0.0, 0.8)
    axes.legend(fontsize=7, loc="lower center")


def save_figures(folder: Path) -> list[Path]:
    """Both figures as PNG files in the folder, which is made if it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    with style.look():
        for name, draw in ((HOVER, hover_figure), (PROPELLER, propeller_figure)):
            draw().savefig(folder / name, dpi=150)
            files.append(folder / name)
    return files
