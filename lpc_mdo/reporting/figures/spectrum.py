"""Third-octave spectra at one observer, one line a part."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from numpy.typing import ArrayLike

from lpc_mdo.reporting import style
from lpc_mdo.reporting.stored import StoredRun

TITLE = "Third-octave spectrum in hover"
CAPTION = "Unweighted levels in third-octave bands; tones fall into the band of their frequency."
SPAN = 70.0  # dB shown below the loudest
TICKS = (31.5, 63, 125, 250, 500, 1000, 2000, 4000, 8000, 16000)
NEEDS = ("spectrum",)


def draw(run: StoredRun) -> Figure:
    stored = run.optimized["noise"]["spectrum"]
    return plot(stored["centers_Hz"], stored["tones_db"], stored["broadband_db"], stored["where"])


def plot(centers: ArrayLike, tones: Mapping[str, ArrayLike], broadband: Mapping[str, ArrayLike], where: str) -> Figure:
    """centers (band,) Hz; levels by model, each (band,) dB, of tones and of broadband noise; `where` the observer stands."""
    f = np.asarray(centers)
    figure = style.figure(3.8)
    axes = figure.add_subplot()
    edges = np.append(f * 10.0**-0.05, f[-1] * 10.0**0.05)
    everything = [np.asarray(level) for level in (*tones.values(), *broadband.values())]
    loudest = 5.0 * np.ceil(max(float(level.max()) for level in everything) / 5.0)
    floor = loudest - SPAN
    # The louder of two tones stands behind. Sky blue would be the same as blue on a dark page.
    for (name, level), color in zip(tones.items(), (style.GOLD, style.BLUE), strict=False):
        shown = np.maximum(np.asarray(level), floor)
        axes.stairs(shown, edges, baseline=floor, fill=True, color=color, label=f"tones, {name}")
    for (name, level), color in zip(broadband.items(), (style.ORANGE, style.GREEN), strict=False):
        shown = np.where(np.asarray(level) > floor, level, np.nan)
        axes.plot(f, shown, color=color, label=f"broadband, {name}")
    axes.set_xscale("log")
    axes.set_xticks(TICKS, [f"{t:g}" if t < 1000 else f"{t / 1000:g} k" for t in TICKS])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set(
        xlim=(edges[0], edges[-1]),
        ylim=(floor, loudest + 3.0),
        xlabel="frequency, Hz",
        ylabel="level, dB re 20 µPa",
        title=f"{TITLE}, {where}",
    )
    figure.legend(loc="outside lower center", ncols=2)
    return figure
