"""Three named sources of structural mass: chosen in the vehicle file, guarded outside their samples, named in results."""

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from conftest import central_difference, number

from lpc_mdo.cli import main
from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.model.structure_source import structural_calibration, structural_surrogate
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.problems.outputs import gross_weight_outputs
from lpc_mdo.structures.samples import to_csv
from lpc_mdo.structures.shipped import BASELINE, SHIPPED, read_open, structural_inputs
from lpc_mdo.surrogates.airfoil import load_airfoil
from lpc_mdo.surrogates.structural_mass import COMPONENTS, StructuralInputs, load_structural_mass
from lpc_mdo.training.structures_command import StructuresRequest, train_structures

OPEN = "vehicle.structure.source=open"


def vehicle(*overrides):
    return load(overrides=overrides)[0]


@pytest.fixture(scope="module")
def user_run(tmp_path_factory):
    """A user's table of 60 samples (some of ours) with its card, trained through the command line."""
    folder = tmp_path_factory.mktemp("own")
    samples, _ = read_open(SHIPPED)
    table = folder / "samples.csv"
    table.write_bytes(to_csv(samples.named("replica").take(range(60))))
    run = CliRunner().invoke(main, ["train", "structures", "--data", str(table), "--output", str(folder / "out")])
    assert run.exit_code == 0, run.stderr
    return folder / "out", run.stdout


def test_a_users_table_becomes_a_source_of_its_own(user_run):
    folder, text = user_run
    card = folder / "structural_mass_nastran.json"
    content = json.loads(card.read_text())
    assert (content["name"], content["samples"]["count"], content["samples"]["dataset"]) == ("nastran", 60, None)
    assert {file.name for file in folder.glob("*.png")} == {
        "structures_samples.png",
        "structures_elasticities.png",  # the ids say that it is a replica of the published study's design
    }
    assert "vehicle.structure.source=nastran" in text
    chosen = vehicle("vehicle.structure.source=nastran", f"vehicle.structure.surrogate_file={card}")
    surrogate = structural_surrogate(chosen)
    assert surrogate.name == "nastran"
    base = structural_inputs(np.array(BASELINE))
    assert float(surrogate(base).mass.sum()) == pytest.approx(
        float(load_structural_mass("open")(base).mass.sum()), rel=0.01
    )


def test_a_damaged_surrogate_of_the_users_is_refused_by_the_command_line(user_run, tmp_path):
    folder, _ = user_run
    card, weights = (folder / f"structural_mass_nastran.{ending}" for ending in ("json", "safetensors"))
    (tmp_path / card.name).write_text(card.read_text())
    (tmp_path / weights.name).write_bytes(weights.read_bytes()[:-8])
    options = ["--set", "vehicle.structure.source=nastran"]
    options += ["--set", f"vehicle.structure.surrogate_file={tmp_path / card.name}"]
    run = CliRunner().invoke(main, ["optimize", *options, "--output", str(tmp_path / "run")])
    assert run.exit_code == 2
    assert "structural_mass_nastran.json is malformed: sha256 of the weights is" in run.stderr
    assert len(run.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--data", "none.csv"], "none.csv"),
        (["--data", "none.csv", "--generate"], "--generate is not allowed beside --data"),
        (["--jobs", "0"], "--jobs"),
    ],
)
def test_training_says_what_is_wrong(options, words, tmp_path):
    run = CliRunner().invoke(main, ["train", "structures", *options, "--output", str(tmp_path)])
    assert run.exit_code == 2
    assert words in run.stderr


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["source=guess"], "source = 'guess' is not allowed; it must be 'published', 'open' or 'nastran'"),
        (["source=nastran"], "surrogate_file is empty; source 'nastran' needs the card"),
        (["source=published", "surrogate_file=mine.json"], "surrogate_file is not allowed beside source 'published'"),
        (
            ["outside_samples=ignore"],
            "outside_samples = 'ignore' is not allowed; it must be 'flag', 'warn', 'error' or 'penalty'",
        ),
        (["is_calibrated_to_published=1"], "is_calibrated_to_published = 1 is not allowed; it must be true or false"),
    ],
)
def test_the_vehicle_file_is_checked(overrides, words):
    with pytest.raises(ConfigurationError) as error:
        vehicle(*(f"vehicle.structure.{text}" for text in overrides))
    assert words in str(error.value)


def test_a_missing_file_of_the_users_is_named():
    chosen = vehicle("vehicle.structure.source=nastran", "vehicle.structure.surrogate_file=none.json")
    with pytest.raises(
        ValueError, match=r"surrogate_file = 'none\.json' is not allowed; there is no file 'none\.json'"
    ):
        structural_surrogate(chosen)


@pytest.mark.parametrize("large", ["json", "safetensors"])
def test_a_card_or_weights_without_end_are_refused_before_they_are_read(tmp_path, large):
    for ending in ("json", "safetensors"):
        (tmp_path / f"mine.{ending}").write_bytes(b"{}")
    with (tmp_path / f"mine.{large}").open("r+b") as stream:
        stream.truncate(2**36)  # sparse: it takes no disk, but would take 64 GB of memory
    chosen = vehicle("vehicle.structure.source=nastran", f"vehicle.structure.surrogate_file={tmp_path / 'mine.json'}")
    with pytest.raises(ValueError, match=rf"mine\.{large}: cannot be read: it has .* it must have at most 10000000"):
        structural_surrogate(chosen)
    with pytest.raises(ValueError, match="it must have at most 10000000"):
        load_airfoil(str(tmp_path / "mine.json"))


def test_calibration_lifts_every_component_to_the_published_level_at_the_baseline():
    base = structural_inputs(np.array(BASELINE))
    plain, lifted = (
        structural_calibration(vehicle(OPEN, f"vehicle.structure.is_calibrated_to_published={flag}"))
        for flag in ("false", "true")
    )
    assert plain.tolist() == [1.22] * len(COMPONENTS)
    published = load_structural_mass("published")(base).mass
    torch.testing.assert_close(lifted * load_structural_mass("open")(base).mass, 1.22 * published, rtol=1e-12, atol=0.0)
    assert structural_calibration(vehicle()).tolist() == [1.22] * len(COMPONENTS)


@pytest.fixture(scope="module")
def open_problem():
    return gross_weight_problem(*load(overrides=[OPEN]))


def test_results_name_their_source_and_its_hash(open_problem, problem):
    for p, source in ((open_problem, "open"), (problem, "published")):
        with torch.no_grad(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            analysis = p.analyze(p.x0)
        chosen = vehicle(f"vehicle.structure.source={source}")
        out = gross_weight_outputs(analysis, analysis)["structural_surrogate"]
        assert out["source"] == source
        surrogate = load_structural_mass(source)
        assert structural_surrogate(chosen).sha256 == surrogate.sha256
        mass = surrogate(analysis.weights.structural_inputs).mass
        for i, name in enumerate(COMPONENTS):
            assert float(analysis.weights.groups[name]) == pytest.approx(1.22 * float(mass[i]), rel=1e-12)


def test_a_design_outside_the_samples_fails_where_that_is_asked(tmp_path):
    strict = gross_weight_problem(*load(overrides=[OPEN, "vehicle.structure.outside_samples=error"]))
    with torch.no_grad():
        strict.evaluate(strict.x0)
        with pytest.raises(ValueError, match="is not allowed; the structural samples of source 'open' lie between"):
            strict.evaluate(torch.full_like(strict.x0, 3.0))


def edge(scale):
    """Inputs with the wing area at `scale` half-widths from the middle of our samples, the rest in the middle."""
    surrogate = load_structural_mass("open")
    middle, half = 0.5 * (surrogate.lower + surrogate.upper), 0.5 * (surrogate.upper - surrogate.lower)
    shift = torch.zeros_like(middle)
    shift[0] = scale
    return StructuralInputs(*(middle + shift * half).unbind(-1))


@pytest.mark.parametrize("source", ["open", "published"])
def test_the_error_policy_names_input_value_and_range(source):
    surrogate = load_structural_mass(source)
    inputs = structural_inputs(np.array(BASELINE) * np.array([1.0, 1.4, 1.0, 1.0, 1.0, 1.0, 1.0]))
    with pytest.raises(ValueError, match=f"wing_aspect_ratio = 16.9992 is not allowed; .* '{source}' lie between"):
        surrogate.guarded(inputs, "error")
    base = structural_inputs(np.array(BASELINE))
    assert torch.equal(surrogate.guarded(base, "error").mass, surrogate(base).mass)
    with pytest.raises(ValueError, match="policy = 'ignore' is not allowed"):
        surrogate.guarded(base, "ignore")


def test_a_corner_of_the_box_is_refused_for_its_leverage():
    surrogate = load_structural_mass("open")
    with pytest.raises(ValueError, match="the inputs are each in range but not together"):
        surrogate.guarded(StructuralInputs(*surrogate.upper.unbind(-1)), "error")


def test_the_warning_policy_warns_and_changes_nothing():
    surrogate = load_structural_mass("open")
    with pytest.warns(RuntimeWarning, match="source 'open' is asked outside its samples"):
        found = surrogate.guarded(edge(1.5), "warn")
    assert torch.equal(found.mass, surrogate(edge(1.5)).mass)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surrogate.guarded(edge(0.5), "warn")


def test_the_penalty_sets_in_smoothly_and_grows():
    surrogate = load_structural_mass("open")

    def excess(scale):
        return surrogate.guarded(edge(scale), "penalty").mass.sum() / surrogate(edge(scale)).mass.sum() - 1.0

    assert [float(excess(number(s))) for s in (-1.0, 0.0, 1.0)] == [0.0, 0.0, 0.0]
    assert float(excess(number(1.5))) == pytest.approx(0.5**3, rel=1e-12)
    assert float(excess(number(-2.0))) == pytest.approx(1.0, rel=1e-12)
    for scale in (0.9, 1.0, 1.4):
        x = number(scale).requires_grad_()
        (slope,) = torch.autograd.grad(excess(x), x, create_graph=True)
        assert float(slope.detach()) == pytest.approx(3.0 * max(scale - 1.0, 0.0) ** 2, rel=1e-9, abs=1e-15)
    x = torch.tensor([1.3], dtype=torch.float64)
    exact = torch.func.jacrev(lambda v: excess(v[0])[None])(x)
    torch.testing.assert_close(exact, central_difference(lambda v: excess(v[0])[None], x, 1e-3), rtol=1e-8, atol=0.0)


def test_published_samples_are_not_public_so_no_interval_is_claimed():
    base = structural_inputs(np.array(BASELINE))
    assert bool(load_structural_mass("published").prediction_interval(base).isnan().all())
    width = load_structural_mass("open").prediction_interval(base)
    assert bool((width > 0.0).all() and (width < 3.0).all())


def test_decks_of_shipped_samples_are_written_with_their_inputs(tmp_path):
    run = CliRunner().invoke(main, ["export", "nastran", "--output", str(tmp_path), "--solution", "101"])
    assert run.exit_code == 0, run.stderr
    assert (tmp_path / "baseline_000.bdf").read_text().startswith("SOL 101")
    assert (tmp_path / "design.csv").read_text().splitlines()[1].startswith("baseline_000,19.536,12.1423,9.144")
    refused = CliRunner().invoke(main, ["export", "nastran", "--samples", "mine", "--output", str(tmp_path)])
    assert refused.exit_code == 2
    assert "ids start with baseline, replica" in refused.stderr


def test_a_sample_named_like_markup_is_told_as_it_is(tmp_path, capsys):
    samples, _ = read_open(SHIPPED)
    names = ("[/red]", *samples.ids[1:])
    changed = replace(samples, ids=names, statuses=("failed", *samples.statuses[1:]))
    (tmp_path / "mine.csv").write_bytes(to_csv(changed))
    train_structures(StructuresRequest(tmp_path / "mine.csv", False, 1, 0, tmp_path / "[/out]"))
    printed = capsys.readouterr().out
    assert "dropped [/red]: not converged" in printed
    assert "[/out]/structural_mass_nastran.json" in printed
