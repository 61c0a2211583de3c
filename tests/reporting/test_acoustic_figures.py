"""Figures of noise and motors show the data that they were given."""

import io
import math

import numpy as np
import pytest
import torch

from lpc_mdo.reporting import style
from lpc_mdo.reporting.acoustics import finite_part
from lpc_mdo.reporting.figures import directivity, motor_efficiency_map, noise_contour, spectrum


def rendered(figure):
    """Size in bytes of the figure as PNG: it can be drawn."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=40)
    return buffer.tell()


def test_directivity_draws_every_line_clipped_at_its_centre():
    polar = np.linspace(0.0, 2.0 * math.pi, 37)
    levels = {"silent below": 40.0 + 30.0 * np.abs(np.sin(polar)), "even": np.full(37, 64.0)}
    with style.look():
        figure = directivity.plot(polar, levels, 76.2)
        assert rendered(figure) > 5000
    (axes,) = figure.axes
    assert [line.get_label() for line in axes.lines] == list(levels)
    assert axes.get_ylim() == (20.0, 70.0)
    np.testing.assert_allclose(axes.lines[1].get_ydata(), 64.0)
    assert "dB(A) at 76.2 m" in axes.get_title(loc="left")


@pytest.mark.parametrize(("spread", "step"), [(8.0, 1.0), (20.0, 2.0), (50.0, 5.0), (200.0, 10.0)])
def test_contours_have_equal_scales_and_a_readable_number_of_levels(spread, step):
    x, y = np.linspace(-100.0, 100.0, 9), np.linspace(-50.0, 50.0, 7)
    level = 70.0 - spread * np.hypot(x[:, None], y) / math.hypot(100.0, 50.0)
    with style.look():
        figure = noise_contour.plot(x, y, level, "a test")
        assert rendered(figure) > 5000
    axes = figure.axes[0]
    assert axes.get_aspect() == 1.0
    levels = axes.collections[0].levels
    assert np.diff(levels)[0] == step
    assert levels[0] <= level.min()
    assert levels[-1] >= level.max()


def test_spectrum_draws_tones_as_areas_and_broadband_as_lines():
    centers = 1000.0 * 10.0 ** (np.arange(-17, 14) / 10.0)
    tone = np.where(np.arange(31) == 4, 80.0, -46.0)
    with style.look():
        figure = spectrum.plot(centers, {"steady": tone}, {"fit": np.linspace(40.0, 60.0, 31)}, "somewhere")
        assert rendered(figure) > 5000
    (axes,) = figure.axes
    assert len(axes.patches) == len(axes.lines) == 1
    assert axes.get_xscale() == "log"
    assert axes.get_ylim()[0] == 10.0


def test_efficiency_map_shows_limit_and_operating_points():
    speed, torque = np.linspace(10.0, 1000.0, 20), np.linspace(1.0, 100.0, 15)
    limit = np.minimum(90.0, 5e4 / speed)
    efficiency = np.where(torque[:, None] <= limit, 0.7 + 0.25 * torque[:, None] / 100.0 + 0.0 * speed, np.nan)
    with style.look():
        figure = motor_efficiency_map.plot(speed, torque, efficiency, limit, {"cruise": (500.0, 40.0)}, "pusher")
        assert rendered(figure) > 5000
    axes = figure.axes[0]
    np.testing.assert_allclose(axes.lines[0].get_ydata(), limit)
    assert axes.lines[1].get_xdata()[0] == pytest.approx(500.0 * 30.0 / math.pi)
    assert [text.get_text() for text in axes.texts if text.get_text().isalpha()] == ["cruise"]


def test_models_without_a_level_for_a_design_are_left_out_of_what_is_stored():
    """A model that knows no supersonic tip gives NaN, which no stored file may hold; a figure left without any model goes."""
    level = torch.zeros(3, dtype=torch.float64)
    noise = {
        "directivity": {
            "polar_rad": level,
            "levels_dba": {"one": level, "other": level * math.nan},
            "distance_m": 76.2,
        },
        "spectrum": {"centers_Hz": level, "tones_db": {"one": level}, "broadband_db": {"other": level * math.nan}},
        "contour": {"ahead_m": level, "starboard_m": level, "level_dba": level * math.inf, "what": "hover"},
    }
    kept = finite_part(noise)
    assert list(kept) == ["directivity"]
    assert list(kept["directivity"]["levels_dba"]) == ["one"]
    assert kept["directivity"]["distance_m"] == 76.2
