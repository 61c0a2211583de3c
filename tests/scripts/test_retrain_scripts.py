"""Scripts that train a surrogate and fly it: what they learn is what the optimization then uses."""

import importlib.util
import json
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

import lpc_mdo
from lpc_mdo.surrogates.airfoil_names import resolve_airfoil
from lpc_mdo.training import airfoil, neuralfoil

SCRIPTS = Path(__file__).parents[2] / "scripts"


def script(name):
    spec = importlib.util.spec_from_file_location(name, SCRIPTS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def flown(monkeypatch):
    """Runs a script with its optimization put off; returns what it would have optimized, and the exit code."""

    def run(name, *arguments):
        problems = []

        def optimize(problem, **_):
            problems.append(problem)
            outputs = {"gross_mass_kg": 1.0}
            return SimpleNamespace(status="converged", message="not run here", outputs=outputs, is_converged=True)

        monkeypatch.setattr(lpc_mdo, "optimize", optimize, raising=False)
        monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
        code = script(name).main()
        return problems[0].analyze_design, code

    return run


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(airfoil, "HIDDEN", 4)
    monkeypatch.setattr(airfoil, "ITERATIONS", 3)
    monkeypatch.setattr(neuralfoil, "is_installed", lambda: False)


def test_the_wing_flies_the_polar_that_was_trained(flown, short, tmp_path):
    analyzer, code = flown("retrain_airfoil", "ls417", "--for", "wing", "--output", tmp_path)
    assert code == 0
    card = str(tmp_path / "ls417.json")
    assert analyzer.vehicle.wing.polar == card
    assert resolve_airfoil(card).sha256 != resolve_airfoil("ls417").sha256


def test_every_rotor_flies_the_polar_that_was_trained(flown, short, tmp_path):
    analyzer, code = flown("retrain_airfoil", "--output", tmp_path)
    assert code == 0
    assert {rotor.airfoil for rotor in analyzer.vehicle.rotors} == {((str(tmp_path / "naca4412.json"), 1.0),)}


def test_structures_are_weighed_by_the_surrogate_that_was_trained(flown, tmp_path):
    analyzer, code = flown("retrain_structures", "--output", tmp_path)
    assert code == 0
    card = json.loads((tmp_path / "structural_mass_open.json").read_text())
    assert analyzer.vehicle.structure.source == "open"
    assert analyzer.weights.structure.sha256 == card["weights_sha256"]


@pytest.mark.parametrize(
    ("name", "arguments", "words"),
    [
        ("retrain_airfoil", ["clark"], "airfoil = 'clark' is invalid"),
        ("retrain_airfoil", ["--vehicle", "none.toml"], "none.toml"),
        ("retrain_structures", ["--data", "none.csv"], "none.csv"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_sentence(monkeypatch, capsys, tmp_path, name, arguments, words):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name, *arguments])
    with pytest.raises(SystemExit) as stopped:
        script(name).main()
    assert stopped.value.code == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
