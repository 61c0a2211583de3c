"""Fitting the airfoil surrogate: it learns, it never sees what is held out, it resumes, and equal seeds give equal bits."""

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
import torch

from lpc_mdo.airfoils.shape import airfoil_shape
from lpc_mdo.surrogates.airfoil import load_airfoil, parse_airfoil
from lpc_mdo.training import airfoil
from lpc_mdo.training.figures.airfoil_errors import airfoil_error_figure
from lpc_mdo.training.figures.airfoil_polars import airfoil_polar_figure
from lpc_mdo.training.polar_data import PolarData, read

DATA = Path(__file__).parents[2] / "training" / "data"
SHAPE = airfoil_shape("naca4412")
THICKNESS = SHAPE.thickness_to_chord


@pytest.fixture(scope="module")
def shipped():
    return read(DATA / "naca4412.csv.gz")


def part_of(data: PolarData, mask: np.ndarray) -> PolarData:
    columns = {
        f.name: getattr(data, f.name)[mask] for f in dataclasses.fields(data) if f.name not in ("sha256", "notes")
    }
    return PolarData(**columns, sha256=data.sha256)


@pytest.fixture(scope="module")
def subset(shipped):
    """Four Mach numbers, whole degrees, Re >= 1e5: a quarter of the Reynolds and of the Mach numbers is held out."""
    mask = np.isin(shipped.mach, (0.0, 0.2, 0.35, 0.5)) & (shipped.alpha_deg % 1.0 == 0.0) & (shipped.reynolds >= 1e5)
    return part_of(shipped, mask & (np.abs(shipped.alpha_deg) <= 12.0))


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(airfoil, "HIDDEN", 12)
    monkeypatch.setattr(airfoil, "ITERATIONS", 30)
    monkeypatch.setattr(airfoil, "CHECKPOINT_EVERY", 10)


def fitted(data, seed=0):
    return airfoil.as_polar(airfoil.fit_resumably(data, THICKNESS, seed), data, "naca4412", THICKNESS)


def test_split_covers_the_data_without_overlap(shipped):
    parts = airfoil.split(shipped, seed=0)
    count = parts.train.astype(int) + parts.unseen_polars + parts.unseen_points
    assert (count == 1).all()
    # Whole Reynolds numbers at every Mach number and the reverse; of the rest a tenth, within four standard deviations.
    is_held_out = np.isin(shipped.reynolds, parts.held_out_reynolds) | np.isin(shipped.mach, parts.held_out_mach)
    assert (parts.unseen_polars == is_held_out).all()
    rest = int((~parts.unseen_polars).sum())
    assert abs(parts.unseen_points.sum() - 0.1 * rest) < 4.0 * np.sqrt(0.09 * rest)


def test_unseen_polars_lie_between_fitted_ones(shipped):
    parts = airfoil.split(shipped, seed=0)
    for values, unseen in ((shipped.reynolds, parts.held_out_reynolds), (shipped.mach, parts.held_out_mach)):
        fitted_values = set(np.unique(values)) - set(unseen)
        assert len(unseen) >= 2
        assert all(min(fitted_values) < value < max(fitted_values) for value in unseen)


def test_few_reynolds_or_mach_numbers_are_all_fitted():
    assert airfoil.held_out_values(np.array([1e5, 1e6, 1e6, 2e6])) == ()
    assert airfoil.held_out_values(np.array([0.0, 0.1, 0.2, 0.3])) == (0.1,)


def test_training_lowers_the_error_on_polars_that_it_has_not_seen(subset, monkeypatch):
    monkeypatch.setattr(airfoil, "HIDDEN", 16)
    parts = airfoil.split(subset, seed=0)
    lift, drag = [], []
    for iterations in (1, 10, 80):
        monkeypatch.setattr(airfoil, "ITERATIONS", iterations)
        table = airfoil.error_table(subset, parts, fitted(subset))
        lift.append(table["unseen_polars_re_from_2e5"]["cl_mean"])
        drag.append(table["unseen_polars_re_from_2e5"]["cd_mean_relative"])
    assert lift[1] < 0.5 * lift[0]
    assert drag[1] < 0.5 * drag[0]
    assert lift[2] < lift[1]
    # A third of the weights, of the points and of the iterations: thrice the errors allowed to the shipped weights.
    assert lift[2] < 0.009
    assert drag[2] < 0.03


def test_held_out_points_do_not_touch_the_weights(subset, short):
    parts = airfoil.split(subset, seed=0)
    spoiled = dataclasses.replace(
        subset, cl=np.where(parts.train, subset.cl, 4.0), cd=np.where(parts.train, subset.cd, 0.9)
    )
    ours, theirs = (airfoil.fit_resumably(data, THICKNESS, 0) for data in (subset, spoiled))
    assert torch.equal(ours, theirs)


def test_spoiled_points_do_not_bend_the_fit_elsewhere(subset, short):
    """XFOIL's own failures enter with their size, not with its square, which would treble the error elsewhere."""
    parts = airfoil.split(subset, seed=0)
    spoiled = np.flatnonzero(parts.train & (subset.alpha_deg == 4.0))[::2]
    cl = subset.cl.copy()
    cl[spoiled] += 1.0
    others = parts.train & airfoil.is_attached(subset) & ~np.isin(np.arange(len(cl)), spoiled)
    clean, bent = (
        airfoil.error_figures(subset, others, *airfoil.predictions(fitted(data), subset, others))["cl_mean"]
        for data in (subset, dataclasses.replace(subset, cl=cl))
    )
    assert bent < 1.5 * clean


def test_errors_report_a_known_offset(subset):
    everything = np.ones(len(subset.cl), dtype=bool)
    figures = airfoil.error_figures(subset, everything, subset.cl - 0.01, subset.cd * 1.02)
    assert figures["points"] == len(subset.cl)
    assert [figures["cl_mean"], figures["cl_max"]] == pytest.approx([0.01, 0.01], rel=1e-9)
    assert [figures["cd_mean_relative"], figures["cd_max_relative"]] == pytest.approx([0.02, 0.02], rel=1e-9)


def test_error_table_counts_every_attached_point_once(subset):
    parts = airfoil.split(subset, seed=0)
    masks = airfoil.error_masks(subset, parts)
    assert (sum(mask.astype(int) for mask in masks.values()) == 1).all()


def test_equal_seeds_give_equal_files_and_other_seeds_other_weights(subset, short, tmp_path):
    for folder, seed in (("first", 5), ("second", 5), ("third", 6)):
        airfoil.train(subset, SHAPE, seed, tmp_path / folder)
    for name in ("naca4412.safetensors", "naca4412.json"):
        first, second, third = ((tmp_path / folder / name).read_bytes() for folder in ("first", "second", "third"))
        assert first == second
        assert first != third
    assert not list(tmp_path.rglob("*.partial"))
    assert not list(tmp_path.rglob("*.fit"))


class Stopped(Exception):
    pass


def test_a_stopped_fit_goes_on_to_the_same_bits(subset, short, tmp_path, monkeypatch):
    airfoil.train(subset, SHAPE, 0, tmp_path / "whole")
    save, calls = airfoil._save_checkpoint, []

    def save_twice_then_stop(*args):
        save(*args)
        calls.append(args)
        if len(calls) == 2:
            raise Stopped

    monkeypatch.setattr(airfoil, "_save_checkpoint", save_twice_then_stop)
    with pytest.raises(Stopped):
        airfoil.train(subset, SHAPE, 0, tmp_path / "resumed")
    assert [file.name for file in (tmp_path / "resumed").iterdir()] == ["naca4412.fit"]
    monkeypatch.setattr(airfoil, "_save_checkpoint", save)
    iterations = []
    original = airfoil.fit

    def counted(samples, state, *args):
        iterations.append(state.iteration)
        return original(samples, state, *args)

    monkeypatch.setattr(airfoil, "fit", counted)
    airfoil.train(subset, SHAPE, 0, tmp_path / "resumed")
    assert iterations == [20]
    for name in ("naca4412.safetensors", "naca4412.json"):
        assert (tmp_path / "resumed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.parametrize("spoil", ["other seed", "truncated", "empty"])
def test_a_checkpoint_of_another_fit_or_a_damaged_one_is_not_gone_on_from(subset, short, tmp_path, spoil):
    state = airfoil.start(airfoil.HIDDEN, 0)
    file = tmp_path / "naca4412.fit"
    key = airfoil._fit_key(subset, THICKNESS, 0)
    airfoil._save_checkpoint(file, key, dataclasses.replace(state, iteration=7))
    assert airfoil._read_checkpoint(file, key).iteration == 7
    if spoil == "other seed":
        key = airfoil._fit_key(subset, THICKNESS, 1)
    else:
        file.write_bytes(file.read_bytes()[:100] if spoil == "truncated" else b"")
    assert airfoil._read_checkpoint(file, key) is None


def test_trained_weights_load_as_a_polar_with_the_errors_of_its_card(subset, short, tmp_path):
    table = airfoil.train(subset, SHAPE, 0, tmp_path)
    polar = parse_airfoil((tmp_path / "naca4412.json").read_text(), (tmp_path / "naca4412.safetensors").read_bytes())
    assert polar.card["errors"] == table
    assert polar.card["data_sha256"] == subset.sha256
    assert polar.training_range.reynolds == (1e5, 1e7)
    assert polar.training_range.mach == (0.0, 0.5)
    mask = airfoil.split(subset, 0).unseen_polars & (subset.reynolds >= 2e5) & (subset.alpha_deg >= -6.0)
    cl, _ = airfoil.predictions(polar, subset, mask)
    error = np.abs(cl - subset.cl[mask]).mean()
    assert error == pytest.approx(table["unseen_polars_re_from_2e5"]["cl_mean"], rel=1e-9)
    loaded = load_airfoil(str(tmp_path / "naca4412.json"))
    assert loaded.sha256 == json.loads((tmp_path / "naca4412.json").read_text())["weights_sha256"]


def test_data_that_are_too_few_or_do_not_vary_are_refused(subset, tmp_path):
    few = part_of(subset, np.arange(len(subset.cl)) < 50)
    with pytest.raises(ValueError, match="50 points are not allowed; polars must hold at least 100"):
        airfoil.train(few, SHAPE, 0, tmp_path / "few")
    with pytest.raises(ValueError, match=r"reynolds = 1e\+06 at every point is not allowed; polars must vary in it"):
        airfoil.train(part_of(subset, subset.reynolds == 1e6), SHAPE, 0, tmp_path / "flat")
    assert not list(tmp_path.iterdir())


def test_polars_at_one_mach_number_make_a_polar_without_it_that_says_where_it_ends(subset, monkeypatch, tmp_path):
    """Constant in Mach where Prandtl and Glauert change lift by up to 1 %: |M| up to 0.14 from 0; beyond it is extrapolated."""
    monkeypatch.setattr(airfoil, "HIDDEN", 12)
    monkeypatch.setattr(airfoil, "ITERATIONS", 60)
    assert airfoil.same_lift_mach(0.0) == pytest.approx((0.0, math.sqrt(1.0 - 1.01**-2)))
    low, high = airfoil.same_lift_mach(0.5)
    for mach, factor in ((low, 1.01), (high, 1.01)):
        ratio = math.sqrt((1.0 - mach**2) / (1.0 - 0.5**2))
        assert max(ratio, 1.0 / ratio) == pytest.approx(factor)
    data = part_of(subset, subset.mach == 0.0)
    airfoil.train(data, SHAPE, 0, tmp_path)
    polar = load_airfoil(str(tmp_path / "naca4412.json"))
    assert polar.training_range.mach == pytest.approx(airfoil.same_lift_mach(0.0))
    assert "polars at Mach 0 alone" in polar.card["limits"]
    alpha, reynolds = torch.deg2rad(torch.linspace(-4.0, 10.0, 15)).double(), torch.tensor(1e6).double()
    still, slow = (polar(alpha, reynolds, torch.tensor(mach).double()) for mach in (0.0, 0.13))
    torch.testing.assert_close(still, slow, rtol=1e-12, atol=1e-12)
    seen = data.reynolds == 1e6
    cl, _ = airfoil.predictions(polar, data, seen)
    assert np.abs(cl - data.cl[seen]).mean() < 0.03
    extrapolated = polar.extrapolated(alpha, reynolds, torch.tensor([[0.1], [0.2]]).double())
    assert extrapolated.tolist() == [[False] * 15, [True] * 15]
    for figure in (airfoil_polar_figure, airfoil_error_figure):
        figure(polar, data).savefig(tmp_path / "figure.png", dpi=30)
