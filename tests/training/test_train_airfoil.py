"""lpc-mdo train airfoil: from a user's polars to a surrogate that the disciplines load; bad input; stopping and going on."""

import csv
import gzip
import importlib.util

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from conftest import number

from lpc_mdo.airfoils.shape import airfoil_shape
from lpc_mdo.cli import main
from lpc_mdo.surrogates.airfoil import load_airfoil
from lpc_mdo.training import airfoil, neuralfoil
from lpc_mdo.training.polar_data import read

COLUMNS = ("alpha_deg", "reynolds", "mach", "cl", "cd")


def analytic_rows():
    """A parabolic polar: lift 2 pi (alpha + 2 deg)/sqrt(1 - M^2), drag of laminar friction and lift squared."""
    for reynolds in (2e5, 3e5, 4e5, 5e5, 7e5, 1e6, 1.3e6, 1.5e6):
        for mach in (0.0, 0.1, 0.15, 0.2, 0.25, 0.3):
            for alpha in np.arange(-8.0, 14.1, 2.0):
                cl = 2.0 * np.pi * np.radians(alpha + 2.0) / np.sqrt(1.0 - mach**2)
                yield alpha, reynolds, mach, cl, 4.0 / np.sqrt(reynolds) + 0.006 * cl**2


def write_polars(file, rows=None, header=COLUMNS):
    with (gzip.open if file.suffix == ".gz" else open)(file, "wt", newline="") as stream:
        csv.writer(stream).writerows([header, *(analytic_rows() if rows is None else rows)])
    return file


@pytest.fixture(scope="module", autouse=True)
def short():
    """A smaller network, fitted in a second."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(airfoil, "HIDDEN", 12)
        patch.setattr(airfoil, "ITERATIONS", 150)
        patch.setattr(neuralfoil, "is_installed", lambda: False)
        yield


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run that nobody stopped: its polars, its output folder and what it printed."""
    folder = tmp_path_factory.mktemp("whole")
    file = write_polars(folder / "mine.csv.gz")
    answer = run("--airfoil", "2409", "--data", file, "--output", folder / "out")
    assert answer.exit_code == 0, answer.output
    return file, folder / "out", answer.output


def run(*arguments):
    return CliRunner().invoke(main, ["train", "airfoil", *map(str, arguments)])


def test_a_users_polars_become_a_surrogate_that_repeats_them(whole):
    _, folder, printed = whole
    names = {path.name for path in folder.iterdir()}
    assert names == {"naca2409.json", "naca2409.safetensors", "naca2409_polars.png", "naca2409_errors.png"}
    assert "unseen_polars" in printed
    assert "pip install 'lpc-mdo[bench]'" in " ".join(printed.split())
    polar = load_airfoil(str(folder / "naca2409.json"))
    assert (polar.name, polar.thickness_to_chord) == ("naca2409", 0.09)
    cl, cd = polar(number(np.radians(4.5)), number(6e5), number(0.15))
    lift = 2.0 * np.pi * np.radians(6.5) / np.sqrt(1.0 - 0.15**2)
    assert float(cl) == pytest.approx(lift, rel=0.01)
    assert float(cd) == pytest.approx(4.0 / np.sqrt(6e5) + 0.006 * lift**2, rel=0.02)


def test_a_stopped_run_says_so_and_goes_on_to_the_same_bits(whole, tmp_path, monkeypatch):
    file, folder, _ = whole
    options = ("--airfoil", "2409", "--data", file)
    save = airfoil._save_checkpoint

    def save_then_stop(checkpoint, key, state):
        save(checkpoint, key, state)
        if state.iteration == 40:
            raise KeyboardInterrupt

    monkeypatch.setattr(airfoil, "_save_checkpoint", save_then_stop)
    stopped = run(*options, "--output", tmp_path / "resumed")
    assert (stopped.exit_code, [f.name for f in (tmp_path / "resumed").iterdir()]) == (1, ["naca2409.fit"])
    monkeypatch.setattr(airfoil, "_save_checkpoint", save)
    assert run(*options, "--output", tmp_path / "resumed").exit_code == 0
    for name in ("naca2409.json", "naca2409.safetensors"):
        assert (tmp_path / "resumed" / name).read_bytes() == (folder / name).read_bytes()


@pytest.mark.parametrize(
    ("header", "row", "message"),
    [
        (COLUMNS[:-1], None, "column cd is missing; there must be reynolds, mach, alpha_deg, cl, cd"),
        (COLUMNS, (0.0, 1e6, 0.0, 0.4, -0.01), "mine.csv, line 2: cd = '-0.01' is not allowed"),
        (
            COLUMNS,
            (0.0, "many", 0.0, 0.4, 0.01),
            "reynolds = 'many' is not allowed; it must lie between 1000 and 1e+09",
        ),
        (COLUMNS, (0.0, 1e6, "nan", 0.4, 0.01), "mach = 'nan' is not allowed; it must lie between 0 and 0.95"),
        (COLUMNS, (0.0, 1e6, 0.0, 0.4), "line 2: 4 cells are invalid: it must have 5, as the header"),
        (COLUMNS, (0.0, 1e6, 0.0, 0.4, 0.01), "1 points are not allowed; polars must hold at least 100"),
    ],
)
def test_malformed_polars_are_refused_and_nothing_is_written(tmp_path, header, row, message):
    file = tmp_path / "mine.csv"
    write_polars(file, [row] if row else [], header)
    answer = run("--data", file, "--output", tmp_path / "out")
    assert answer.exit_code == 2
    assert message in answer.output
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--airfoil", "clark"), "airfoil = 'clark' is invalid"),
        (("--airfoil", "4412", "--data", "missing.csv"), "missing.csv"),
        (("--airfoil", "4412", "--data", "x.csv", "--generate"), "--data is invalid with --generate"),
        (("--jobs", "0"), "0 is not in the range"),
        (("--seed", "-1"), "-1 is not in the range"),
    ],
)
def test_bad_options_exit_with_two_and_name_the_fault(tmp_path, options, message):
    answer = run(*options, "--output", tmp_path / "out")
    assert answer.exit_code == 2
    assert message in answer.output
    assert not (tmp_path / "out").exists()


def test_an_output_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "out").write_text("")
    answer = run("--output", tmp_path / "out")
    assert answer.exit_code == 2
    assert "it exists and is not a folder" in answer.output


def test_damaged_archives_are_refused(tmp_path):
    file = write_polars(tmp_path / "mine.csv.gz")
    file.write_bytes(file.read_bytes()[:-20])
    with pytest.raises(ValueError, match=r"mine\.csv\.gz: cannot be read"):
        read(file)
    file.write_bytes(b"\x00" * 40)
    with pytest.raises(ValueError, match=r"mine\.csv\.gz: cannot be read"):
        read(file)


def test_comparison_without_neuralfoil_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(neuralfoil, "is_installed", lambda: False)
    with pytest.raises(ValueError, match=r"NeuralFoil is not installed; pip install 'lpc-mdo\[bench\]'"):
        neuralfoil.compare(load_airfoil(), airfoil_shape("4412"), None, 0)


@pytest.mark.skipif(importlib.util.find_spec("neuralfoil") is None, reason="NeuralFoil is not installed")
def test_neuralfoil_agrees_with_ours_on_attached_flow():
    # Two models of the same XFOIL: their differences are the sum of both errors.
    shape, polar = airfoil_shape("4412"), load_airfoil()
    alpha = torch.deg2rad(torch.linspace(-4.0, 8.0, 13, dtype=torch.float64))
    cl, cd = polar(alpha, number(1e6), number(0.0))
    theirs = neuralfoil.coefficients(shape, np.degrees(alpha.numpy()), np.full(13, 1e6), "xxxlarge")
    assert np.abs(cl.numpy() - theirs[0]).mean() < 0.01
    assert np.abs(cd.numpy() / theirs[1] - 1.0).mean() < 0.03
