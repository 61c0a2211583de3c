"""`lpc-mdo train structures` and `lpc-mdo export nastran`: samples in, weights, card, figures or decks out."""

import csv
import io
import json
from dataclasses import dataclass
from pathlib import Path

from rich.progress import track
from rich.table import Table

from lpc_mdo.files.write import write_together
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.reporting.terminal import terminal
from lpc_mdo.structures.samples import INPUTS, Samples, read_dataset_card, read_samples
from lpc_mdo.structures.shipped import NAME, SHIPPED, read_open, structural_inputs
from lpc_mdo.structures.sizing import SizingModel, size
from lpc_mdo.training.figures.structures import write_figures
from lpc_mdo.training.nastran import deck
from lpc_mdo.training.structure_fit import Origin, Trained, train, write
from lpc_mdo.training.structures import OPEN_SOURCE, baseline_gauges, generate


@dataclass(frozen=True)
class StructuresRequest:
    data: Path | None
    is_generating: bool
    jobs: int
    seed: int
    output: Path


def _samples(request: StructuresRequest) -> tuple[Samples, Origin]:
    """Raises ValueError if table, card and options do not go together."""
    if request.data is not None:
        if request.is_generating:
            raise ValueError("--generate is not allowed beside --data; samples are either sized here or yours")
        samples, digest = read_samples(request.data)
        card = read_dataset_card(request.data, samples, digest)
        return samples, Origin("nastran", f"user's table {request.data.name}", digest, card)
    if request.is_generating:
        generate(request.output, request.seed, request.jobs)
    samples, digest = read_open(request.output if request.is_generating else SHIPPED)
    return samples, Origin("open", OPEN_SOURCE, digest)


@one_thread()
def train_structures(request: StructuresRequest) -> Path:
    """Write weights, card and figures and print how good they are; returns the card. Raises ValueError with one sentence
    if the samples cannot be used."""
    console = terminal()
    samples, origin = _samples(request)
    trained = train(samples, origin, request.seed)
    file = write(trained, request.output)
    folder = request.output if request.is_generating else SHIPPED
    own_card = folder / f"{NAME}.json" if origin.name == "open" else None
    figures = write_figures(samples, trained, request.output, own_card)
    console.print(_quality_table(trained))
    for sentence in trained.card["samples"]["dropped"]:
        console.print(f"dropped {sentence}", soft_wrap=True, markup=False)
    for written in (file, *figures):
        console.print(f"wrote {written}", soft_wrap=True, markup=False)
    console.print(
        f"use it: --set vehicle.structure.source={origin.name} --set vehicle.structure.surrogate_file={file}",
        soft_wrap=True,
        markup=False,
    )
    return file


def _quality_table(trained: Trained) -> Table:
    card = trained.card
    table = Table("mass of", "form", "r2", "r2 held out", "rmse kg", "kg", "published / ours")
    for name, mass in card["baseline_mass_kg"].items():
        row = card["quality"][f"{name}.mass_kg"]
        held_out = row["r2_cross_validated"][row["form"]]
        cells = [row["form"], f"{row['r2']:.5f}", f"{held_out:.5f}", f"{row['rmse']:.3g}", f"{mass:.2f}"]
        table.add_row(name, *cells, f"{card['calibration_to_published'][name]:.2f}")
    return table


@one_thread()
def export_decks(prefix: str, solution: int, output: Path) -> None:
    """Size the shipped samples whose id starts with the prefix; write ID.bdf for each, and design.csv with their inputs.

    Raises ValueError if there is no such sample.
    """
    samples, _ = read_open(SHIPPED)
    chosen = samples.named(prefix)
    if not chosen.ids:
        raise ValueError(
            f"--samples {prefix!r} is not allowed; ids start with baseline, replica, working, test or axis"
        )
    model = SizingModel()
    start = baseline_gauges(json.loads((SHIPPED / f"{NAME}.json").read_text(encoding="utf-8")))
    output.mkdir(parents=True, exist_ok=True)
    table = io.StringIO()
    writer = csv.writer(table, lineterminator="\n")
    writer.writerow(["sample_id", *INPUTS])
    for name, row in track(list(zip(chosen.ids, chosen.inputs, strict=True)), description="decks"):
        optimum = size(model, structural_inputs(row[None]), start)
        text = deck(model, structural_inputs(row), optimum.x[0], solution)
        write_together({output / f"{name}.bdf": text.encode()})
        writer.writerow([name, *(f"{value:.12g}" for value in row)])
    write_together({output / "design.csv": table.getvalue().encode()})
    terminal().print(f"wrote {len(chosen.ids)} decks of SOL {solution} and design.csv to {output}", soft_wrap=True)
