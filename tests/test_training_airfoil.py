"""Fitting the airfoil surrogate: it learns, it never sees what is held out, and equal seeds give equal bits."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import torch

from surrogates.airfoil import network_outputs, parse_airfoil, scaled_inputs
from training import airfoil
from training.polar_data import PolarData, read

DATA = Path(__file__).parents[1] / "training" / "data"


@pytest.fixture(scope="module")
def shipped():
    return read(DATA, "4412")


def part_of(data: PolarData, mask: np.ndarray) -> PolarData:
    columns = {f.name: getattr(data, f.name)[mask] for f in dataclasses.fields(data) if f.name != "sha256"}
    return PolarData(**columns, sha256=data.sha256)


@pytest.fixture(scope="module")
def subset(shipped):
    """Two Mach numbers, whole degrees, Re >= 1e5: 550 points, three Reynolds numbers of eleven held out."""
    mask = np.isin(shipped.mach, (0.0, 0.35)) & (shipped.alpha_deg % 1.0 == 0.0) & (shipped.reynolds >= 1e5)
    return part_of(shipped, mask & (np.abs(shipped.alpha_deg) <= 12.0))


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(airfoil, "ITERATIONS", 200)


def flat(layers):
    return torch.cat([tensor.flatten() for layer in layers for tensor in layer])


def test_split_covers_the_data_without_overlap(shipped):
    parts = airfoil.split(shipped, seed=0)
    count = parts.train.astype(int) + parts.unseen_polars + parts.unseen_points
    assert (count == 1).all()
    # Whole Reynolds numbers at every Mach number; of the rest a tenth, within four standard deviations.
    for reynolds in np.unique(shipped.reynolds):
        is_held_out = reynolds in airfoil.HELD_OUT_REYNOLDS
        assert parts.unseen_polars[shipped.reynolds == reynolds].tolist() == [is_held_out] * int(
            (shipped.reynolds == reynolds).sum()
        )
    rest = int((~parts.unseen_polars).sum())
    assert abs(parts.unseen_points.sum() - 0.1 * rest) < 4.0 * np.sqrt(0.09 * rest)


def test_unseen_polars_lie_between_fitted_ones(shipped):
    fitted = set(np.unique(shipped.reynolds)) - set(airfoil.HELD_OUT_REYNOLDS)
    assert all(min(fitted) < held_out < max(fitted) for held_out in airfoil.HELD_OUT_REYNOLDS)
    assert set(airfoil.HELD_OUT_REYNOLDS) <= set(np.unique(shipped.reynolds))


def test_training_lowers_the_error_on_polars_that_it_has_not_seen(subset, monkeypatch):
    parts = airfoil.split(subset, seed=0)
    lift, drag = [], []
    for iterations in (1, 40, 400):
        monkeypatch.setattr(airfoil, "ITERATIONS", iterations)
        table = airfoil.error_table(subset, parts, airfoil.fit(subset, parts.train, seed=0))
        lift.append(table["unseen_polars_re_from_2e5"]["cl_mean"])
        drag.append(table["unseen_polars_re_from_2e5"]["cd_mean_relative"])
    assert lift[1] < 0.5 * lift[0]
    assert drag[1] < 0.5 * drag[0]
    assert lift[2] < 0.5 * lift[1]
    # An eighth of the points, a tenth of the iterations: thrice the errors allowed to the shipped weights.
    assert lift[2] < 0.015
    assert drag[2] < 0.045


def test_held_out_points_do_not_touch_the_weights(subset, short):
    parts = airfoil.split(subset, seed=0)
    spoiled = dataclasses.replace(
        subset, cl=np.where(parts.train, subset.cl, 9.0), cd=np.where(parts.train, subset.cd, 0.9)
    )
    ours, theirs = (airfoil.fit(data, parts.train, seed=0) for data in (subset, spoiled))
    assert torch.equal(flat(ours), flat(theirs))


def test_spoiled_points_do_not_bend_the_fit_elsewhere(subset, short):
    """XFOIL's own failures enter with their size, not with its square, which would treble the error elsewhere."""
    parts = airfoil.split(subset, seed=0)
    spoiled = np.flatnonzero(parts.train & (subset.alpha_deg == 4.0))[::2]
    cl = subset.cl.copy()
    cl[spoiled] += 1.0
    others = parts.train & ~np.isin(np.arange(len(cl)), spoiled)
    clean, bent = (
        airfoil.errors(subset, others, airfoil.fit(data, parts.train, seed=0))["cl_mean"]
        for data in (subset, dataclasses.replace(subset, cl=cl))
    )
    assert bent < 1.5 * clean


def test_errors_report_a_known_offset(subset):
    """Data made by the network itself, then shifted by 0.01 in lift and 2 % in drag."""
    layers = airfoil._unflatten(airfoil._start(3))
    limits = airfoil.training_range(subset)
    columns = (np.deg2rad(subset.alpha_deg), subset.reynolds, subset.mach)
    cl, cd = network_outputs(scaled_inputs(*(torch.tensor(c) for c in columns), limits), layers)
    made = dataclasses.replace(subset, cl=cl.numpy() + 0.01, cd=cd.numpy() / 1.02)
    figures = airfoil.errors(made, np.ones(len(made.cl), dtype=bool), layers)
    attached = (subset.alpha_deg >= -6.0) & (subset.alpha_deg <= 12.0)
    assert figures["points"] == attached.sum()
    assert [figures["cl_mean"], figures["cl_max"]] == pytest.approx([0.01, 0.01], rel=1e-9)
    assert [figures["cd_mean_relative"], figures["cd_max_relative"]] == pytest.approx([0.02, 0.02], rel=1e-9)


def test_equal_seeds_give_equal_files_and_other_seeds_other_weights(subset, short, tmp_path):
    for folder, seed in (("first", 5), ("second", 5), ("third", 6)):
        airfoil.train(subset, "naca4412", seed, tmp_path / folder)
    for name in ("naca4412.safetensors", "naca4412.json"):
        first, second, third = ((tmp_path / folder / name).read_bytes() for folder in ("first", "second", "third"))
        assert first == second
        assert first != third
    assert not torch.equal(airfoil._start(5), airfoil._start(6))  # not only the split differs
    assert not list(tmp_path.rglob("*.partial"))


def test_trained_weights_load_as_a_polar_with_the_errors_of_its_card(subset, short, tmp_path):
    table = airfoil.train(subset, "naca4412", 0, tmp_path)
    polar = parse_airfoil((tmp_path / "naca4412.json").read_text(), (tmp_path / "naca4412.safetensors").read_bytes())
    assert polar.card["errors"] == table
    assert polar.card["data_sha256"] == subset.sha256
    assert polar.training_range.reynolds == (1e5, 5e6)
    assert polar.training_range.mach == (0.0, 0.35)
    mask = airfoil.split(subset, 0).unseen_polars & (subset.reynolds >= 2e5) & (subset.alpha_deg >= -6.0)
    columns = (np.deg2rad(subset.alpha_deg), subset.reynolds, subset.mach)
    cl, _ = polar(*(torch.tensor(column[mask]) for column in columns))
    error = np.abs(cl.numpy() - subset.cl[mask]).mean()
    assert error == pytest.approx(table["unseen_polars_re_from_2e5"]["cl_mean"], rel=1e-9)
