"""All figures of a trained structural surrogate, as PNG files."""

import json
from pathlib import Path

import torch

from lpc_mdo.reporting.style import save
from lpc_mdo.structures.samples import Samples
from lpc_mdo.structures.shipped import BASELINE, structural_inputs
from lpc_mdo.structures.sizing import SizingModel
from lpc_mdo.training.figures.structures_elasticities import elasticities_figure
from lpc_mdo.training.figures.structures_samples import samples_figure
from lpc_mdo.training.figures.structures_sizing import sizing_figure
from lpc_mdo.training.structure_fit import Trained
from lpc_mdo.training.structures import baseline_gauges


def write_figures(samples: Samples, trained: Trained, output: Path, card: Path | None) -> list[Path]:
    """Prediction against sample; elasticities where there is a replica set; the sized airframe where a card of our own
    samples stores gauges. Returns the files."""
    figures = {"samples": samples_figure(samples, trained.surrogate)}
    if "replica" in trained.card:
        figures["elasticities"] = elasticities_figure(trained.card["replica"])
    if card is not None:
        stored = json.loads(card.read_text(encoding="utf-8"))
        with torch.no_grad():
            base = structural_inputs(BASELINE)
            figures["sizing"] = sizing_figure(SizingModel(), base, baseline_gauges(stored))
    files = []
    for name, figure in figures.items():
        files.append(output / f"structures_{name}.png")
        save(figure, files[-1], dpi=150)
    return files
