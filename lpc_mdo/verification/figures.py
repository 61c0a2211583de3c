"""Blade-element momentum theory beside published rotor and propeller experiments."""

from pathlib import Path

import torch
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from lpc_mdo.reporting import style
from lpc_mdo.verification.comparison import reference
from lpc_mdo.verification.rotor_experiments import (
    HoverCurve,
    HoverRun,
    PropellerCurve,
    caradonna_tung_thrust,
    castles_gray_runs,
    hover_curves,
    propeller_curve,
)

HOVER, PROPELLER = "verification_hover.png", "verification_propeller.png"
MARKERS = ("o", "s", "^", "D")
POINTS = {"markersize": 4.5, "linestyle": "none"}


def hover_figure() -> Figure:
    """Thrust and torque of hovering model rotors over blade angle: lines are the model, points the experiments."""
    figure = style.figure(5.2)
    (thrust, torque), (runs, short) = figure.subplots(2, 2)
    with torch.no_grad():
        _draw_knight_hefner(thrust, torque, hover_curves())
        _draw_castles_gray(runs, castles_gray_runs())
        _draw_caradonna_tung(short)
    for axes, title in (
        (thrust, "Thrust coefficient × 10³"),
        (torque, "Torque coefficient × 10⁴"),
        (runs, "Thrust coefficient × 10³"),
        (short, "Thrust coefficient × 10³"),
    ):
        axes.set(xlabel="blade angle, deg", xlim=(0.0, 13.0), ylim=(0.0, None), title=title)
        axes.set_xticks(range(0, 13, 2))
    for axes, title in (
        (thrust, "Knight and Hefner, blades"),
        (torque, "Knight and Hefner, blades"),
        (runs, "Castles and Gray, three blades"),
        (short, "Caradonna and Tung, two short blades"),
    ):
        axes.legend(fontsize=7, title=title, title_fontsize=7, alignment="left", loc="upper left")
    return figure


def _draw_knight_hefner(thrust: Axes, torque: Axes, curves: list[HoverCurve]) -> None:
    fine = torch.linspace(0.02, 12.5, 120, dtype=torch.float64)
    for curve, color, marker in zip(curves, style.CYCLE, MARKERS, strict=False):
        for axes, measured, line, scale in zip(
            (thrust, torque), (curve.measured_thrust, curve.measured_torque), curve.model(fine), (1e3, 1e4), strict=True
        ):
            axes.plot(fine, scale * line, color=color)
            axes.plot(curve.blade_angle_deg, scale * measured, marker, color=color, label=str(curve.blades), **POINTS)


def _draw_castles_gray(axes: Axes, runs: list[HoverRun]) -> None:
    fine = torch.linspace(0.3, 12.0, 80, dtype=torch.float64)
    axes.plot(fine, 1e3 * runs[0].model(fine)[0], color=style.BLUE, label="model, 1200 rpm")
    for run, color, marker in zip(runs, style.CYCLE[1:], MARKERS, strict=False):
        axes.plot(run.blade_angle_deg, 1e3 * run.measured_thrust, marker, color=color, label=run.name, **POINTS)


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
            style.save(draw(), folder / name, dpi=150)
            files.append(folder / name)
    return files
