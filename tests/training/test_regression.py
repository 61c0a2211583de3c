"""Regressions of sized samples: form, errors, hand-over to torch, and what the shipped surrogate of our own sizing is worth."""

import hashlib
import json
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import number
from safetensors.torch import load, save

from lpc_mdo.structures.published_tables import ELASTICITY_INPUTS, GROUPS, PUBLISHED_FITS
from lpc_mdo.structures.samples import INPUTS, QUANTITIES, Samples
from lpc_mdo.structures.shipped import BASELINE, SHIPPED, read_open, structural_inputs
from lpc_mdo.surrogates.structural_mass import (
    COMPONENTS,
    TARGETS,
    StructuralInputs,
    load_structural_mass,
    parse_trained,
)
from lpc_mdo.surrogates.structural_regression import MassIntervals, Polynomials
from lpc_mdo.training.regression import export, fit_target, linear_slopes
from lpc_mdo.training.structure_fit import Origin, train, write
from lpc_mdo.training.structures import REPLICA_RANGE, WORKING_RANGE, design, latin_hypercube

CARD = Path(__file__).parents[2] / "surrogates" / "weights" / "structural_mass_open.json"


@pytest.fixture(scope="module")
def stored():
    return read_open(SHIPPED)


@pytest.fixture(scope="module")
def trained(stored):
    samples, digest = stored
    return train(samples, Origin("open", "test", digest))


@pytest.fixture(scope="module")
def points():
    """Inputs (80, 7) over the working range, and noise of one."""
    return latin_hypercube(80, WORKING_RANGE, 5), np.random.default_rng(6).normal(size=80)


def test_a_plane_is_found_again_and_stays_a_plane(points):
    x, noise = points
    slopes = np.array([3.0, 5.0, -2.0, 0.01, 0.3, 1.0, 2.0])
    fit = fit_target("wing", "mass_kg", x, x @ slopes + 40.0 + 0.5 * noise, 0)
    assert fit.form == "linear"
    assert fit.deviation == pytest.approx(0.5, rel=0.3)
    ours, errors, intercept, r2 = linear_slopes(x, x @ slopes + 40.0, 0)
    assert ours == pytest.approx(slopes, rel=1e-9)
    assert intercept == pytest.approx(40.0, rel=1e-8)
    assert r2 == pytest.approx(1.0, abs=1e-12)
    assert bool((errors >= 0.0).all())


def test_standard_errors_are_those_of_the_normal_equations(points):
    x, noise = points
    y = x @ np.arange(1.0, 8.0) + 2.0 * noise
    _, errors, _, _ = linear_slopes(x, y, 0)
    ones = np.column_stack([np.ones(80), x])
    coefficients, *_ = np.linalg.lstsq(ones, y, rcond=None)
    variance = ((y - ones @ coefficients) ** 2).sum() / (80 - 8)
    expected = np.sqrt(variance * np.diag(np.linalg.pinv(ones.T @ ones)))[1:]
    assert errors == pytest.approx(expected, rel=1e-6)


def test_curved_targets_win_their_form_by_cross_validation(points):
    x, noise = points
    squares = fit_target("wing", "mass_kg", x, 50.0 + (x[:, 0] - 19.0) ** 2 + 2.0 * x[:, 1] + 0.01 * noise, 0)
    power = fit_target("wing", "ixz_kg_m2", x, -3.0 * x[:, 0] ** 1.6 * x[:, 1] ** 1.6, 0)
    assert squares.form == "quadratic"
    assert power.form == "power law"
    assert power.sign == -1.0
    assert power.predict(x) == pytest.approx(-3.0 * x[:, 0] ** 1.6 * x[:, 1] ** 1.6, rel=1e-11)


def test_a_constant_is_fitted_and_has_no_r2(points):
    fit = fit_target("wing", "cg_z_m", points[0], np.full(80, 2.5), 0)
    assert fit.quality()["r2"] is None
    assert fit.predict(points[0]) == pytest.approx(2.5, rel=1e-12)


def test_too_few_samples_are_refused(points):
    with pytest.raises(ValueError, match="15 samples are not allowed; wing needs at least 16"):
        fit_target("wing", "mass_kg", points[0][:15], np.arange(15.0) + 1.0, 0)


def test_every_input_must_vary_and_every_target_be_there(stored):
    samples, digest = stored
    inputs, targets = samples.inputs.copy(), samples.targets.copy()
    inputs[:, 5], targets[150, 0, 0] = 3.67, np.nan
    values = {f.name: getattr(samples, f.name) for f in fields(Samples)}
    # The fitted set alone: on the axes, designs that differ in nothing but the tail would be the same.
    working = Samples(**values | {"inputs": inputs}).named("working")
    with pytest.raises(ValueError, match=r"htail_area_m2 = 3\.67 in all samples is not allowed"):
        train(working, Origin("nastran", "", digest))
    with pytest.raises(ValueError, match=r"wing\.mass_kg is missing in 1 samples"):
        train(Samples(**values | {"targets": targets}), Origin("nastran", "", digest))


def test_a_card_that_cannot_be_written_leaves_no_weights(trained, tmp_path):
    card = trained.card | {"samples": trained.card["samples"] | {"dataset": {"year": float("nan")}}}
    with pytest.raises(ValueError, match="JSON compliant"):
        write(replace(trained, card=card), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_prediction_interval_is_that_of_least_squares(points):
    """t s sqrt(1 + h) of a plane, by the normal equations; it holds 95 % of new noisy values."""
    x, noise = points
    rng, slopes = np.random.default_rng(7), np.array([3.0, 5.0, 2.0, 0.01, 0.3, 1.0, 2.0])
    y, zeros = x @ slopes + 40.0 + noise, np.zeros(80)
    targets = np.ones((80, len(COMPONENTS), len(QUANTITIES))) * y[:, None, None]
    samples = Samples(tuple(map(str, range(80))), ("converged",) * 80, x, targets, zeros, zeros, zeros)
    fits = {(i, 0): fit_target("wing", "mass_kg", x, y, 0) for i in range(len(COMPONENTS))}
    tensors = load(export(fits, samples)[0])
    model = Polynomials(**{f.name: tensors[f.name] for f in fields(Polynomials)})
    intervals = MassIntervals(**{f.name: tensors[f"interval_{f.name}"] for f in fields(MassIntervals)})
    new = latin_hypercube(2000, WORKING_RANGE, 8)
    width = intervals.half_width(model, torch.from_numpy(new))[:, 0].numpy()
    ones, ones_new = (np.column_stack([np.ones(len(v)), v]) for v in (x, new))
    coefficients, *_ = np.linalg.lstsq(ones, y, rcond=None)
    s = np.sqrt(((y - ones @ coefficients) ** 2).sum() / (80 - 8))
    leverage = np.einsum("ni,ij,nj->n", ones_new, np.linalg.pinv(ones.T @ ones), ones_new)
    assert width == pytest.approx(1.9934635 * s * np.sqrt(1.0 + leverage), rel=1e-6)  # t(0.975, 72)
    truth = new @ slopes + 40.0 + rng.normal(size=2000)
    covered = np.abs(model(torch.from_numpy(new))[:, 0, 0].numpy() - truth) <= width
    assert covered.mean() == pytest.approx(0.95, abs=0.03)


def test_torch_gives_what_scikit_learn_gives(stored, trained):
    """Masses to 1e-12 kg, other targets to rounding, also away from the samples."""
    inputs = np.concatenate([stored[0].inputs, latin_hypercube(50, REPLICA_RANGE, 3)])
    ours = trained.surrogate.model(torch.from_numpy(inputs)).numpy()
    for (i, j), fit in trained.fits.items():
        theirs = fit.predict(inputs)
        if TARGETS[j] == "mass_kg":
            assert np.abs(ours[:, i, j] - theirs).max() <= 1e-12, COMPONENTS[i]
        assert np.abs(ours[:, i, j] - theirs).max() <= 1e-13 * np.abs(theirs).max(), (COMPONENTS[i], TARGETS[j])


def test_training_is_the_same_bit_for_bit(stored, trained):
    again = train(stored[0], Origin("open", "test", stored[1]))
    assert again.weights == trained.weights
    assert again.card == trained.card


def test_shipped_weights_are_those_of_the_shipped_samples(stored, trained):
    shipped = load_structural_mass("open")
    card = json.loads(CARD.read_text())
    assert card["samples"]["sha256"] == stored[1]
    x = structural_inputs(stored[0].inputs)
    # Another machine's linear algebra may round differently.
    torch.testing.assert_close(shipped(x).mass, trained.surrogate(x).mass, rtol=0.0, atol=1e-9)


def test_written_files_load_as_they_were_trained(trained, tmp_path):
    file = write(trained, tmp_path)
    loaded = load_structural_mass("open", str(file))
    base = structural_inputs(np.array(BASELINE))
    assert torch.equal(loaded(base).mass, trained.surrogate(base).mass)
    assert loaded.sha256 == trained.surrogate.sha256
    with pytest.raises(ValueError, match="is of source 'open'"):
        load_structural_mass("nastran", str(file))


def test_derivatives_of_the_shipped_surrogate_are_exact():
    surrogate = load_structural_mass("open")
    base = torch.tensor(BASELINE, dtype=torch.float64)

    def outputs(share):
        found = surrogate(StructuralInputs(*(share * base).unbind(-1)))
        return torch.cat([found.mass, found.center_of_gravity.flatten(), found.inertia.flatten()])

    assert torch.autograd.gradcheck(outputs, torch.full((7,), 1.05, dtype=torch.float64, requires_grad=True))


def test_nearly_all_samples_are_certified_and_the_rest_listed(stored):
    samples, _ = stored
    card = json.loads((SHIPPED / "structures_open.json").read_text())
    replica = samples.named("replica")
    assert len(replica.ids) == 96
    assert replica.statuses.count("converged") >= 95
    assert len(card["rejected"]) == samples.statuses.count("failed")
    assert float(np.nanmax(samples.violation[[s == "converged" for s in samples.statuses]])) <= 1e-8
    assert card["multi_start"]["certified_runs"] == card["multi_start"]["samples"] * card["multi_start"]["starts"]
    assert card["multi_start"]["largest_spread_kg"] <= 0.01


def test_designs_are_latin_and_nearly_uncorrelated():
    for name, limits in (("replica", REPLICA_RANGE), ("working", WORKING_RANGE), ("test", WORKING_RANGE)):
        table = design(0)[name]
        lower, upper = np.array(limits).T
        strata = np.floor((table - lower) / (upper - lower) * len(table)).astype(int)
        assert all(sorted(column) == list(range(len(table))) for column in strata.T)
        if name != "test":
            assert np.abs(np.corrcoef(table.T) - np.eye(7)).max() < 0.1


def test_masses_of_unseen_samples_are_within_one_percent(trained):
    """Independent Latin hypercube over the working range; its largest error is 0.7 %, ends of the axes 1.2 %."""
    for name, row in trained.card["errors_on_test"].items():
        assert row["largest_relative"] < 0.01, name
        assert row["coverage"] >= 0.9, name
    for row in trained.card["errors_on_axis"].values():
        assert row["largest_relative"] < 0.015


def test_every_component_is_predictable_when_held_out(trained):
    for key, row in trained.card["quality"].items():
        if row["r2"] is not None:
            assert row["r2_cross_validated"][row["form"]] > 0.98, key


def test_port_and_starboard_booms_are_mirror_images():
    surrogate = load_structural_mass("open")
    x = structural_inputs(latin_hypercube(20, WORKING_RANGE, 9))
    found, at = surrogate(x), {name: i for i, name in enumerate(surrogate.components)}
    for place in ("inner", "outer"):
        port, starboard = at[f"boom_{place}_port"], at[f"boom_{place}_starboard"]
        mirror = torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
        torch.testing.assert_close(found.mass[:, port], found.mass[:, starboard], rtol=1e-10, atol=0.0)
        torch.testing.assert_close(
            found.center_of_gravity[:, port], mirror * found.center_of_gravity[:, starboard], rtol=1e-9, atol=1e-9
        )
        torch.testing.assert_close(found.inertia[:, port], found.inertia[:, starboard], rtol=1e-9, atol=1e-9)


def test_our_elasticities_have_the_signs_that_physics_asks(trained):
    """Wing with area, aspect ratio and carried mass; booms with span, alike in area and aspect ratio; fuselage with its
    length; nothing with speed, because neither gust nor dynamic pressure sizes the wing."""
    table = {name: row["elasticities"] for name, row in trained.card["replica"].items()}
    wing, booms, fuselage = table["wing"], table["booms"], table["fuselage"]
    assert 0.5 < wing["wing_area_m2"] < 1.4
    assert wing["wing_aspect_ratio"] > 0.2
    assert 0.0 < wing["battery_mass_kg"] < 0.2
    assert abs(wing["cruise_speed_m_s"]) < 0.02
    assert booms["wing_area_m2"] == pytest.approx(booms["wing_aspect_ratio"], abs=0.03)
    assert 1.0 < fuselage["fuselage_length_m"] < 1.4
    for tail, area in (("horizontal_tail", "htail_area_m2"), ("vertical_tail", "vtail_area_m2")):
        assert table[tail][area] == pytest.approx(1.1, abs=0.1)


def test_published_elasticities_are_those_derived_from_the_tables(reference):
    derived = reference("structures_published_regressions")["derived"]
    for fit in PUBLISHED_FITS:
        theirs = derived[f"{fit.year} {fit.group}"]
        assert fit.mass == pytest.approx(theirs["baseline_kg"], abs=6e-4)
        assert list(fit.elasticities) == pytest.approx(theirs["elasticity"], abs=6e-5)
        assert fit.group in GROUPS
    assert INPUTS[:5] == ELASTICITY_INPUTS


def test_damaged_and_hostile_files_are_refused(trained):
    text, data = json.dumps(trained.card), trained.weights

    def resigned(change):
        """Weights changed, and a card that vouches for them."""
        tensors = load(data)
        change(tensors)
        changed = save(tensors)
        return json.dumps(trained.card | {"weights_sha256": hashlib.sha256(changed).hexdigest()}), changed

    flipped = bytearray(data)
    flipped[-5] ^= 1
    pickled = b"\x80\x04\x95\x10\x00\x00\x00\x00\x00\x00\x00\x8c\x02os\x94."
    signed_pickle = json.dumps(trained.card | {"weights_sha256": hashlib.sha256(pickled).hexdigest()})
    cases = [
        (text, data[:-100], "sha256 of the weights"),
        (text, bytes(flipped), "sha256 of the weights"),
        (signed_pickle, pickled, "weights cannot be read"),
        (text[: len(text) // 2], data, ""),
        ("[1, 2]", data, "the card = [1, 2] is not allowed; it must be a table of keys"),
        ("{}", data, "schema is missing"),
        ("[" * 100_000, data, "must nest at most"),
        (json.dumps(trained.card | {"schema": "other/1"}), data, "schema = 'other/1' is not allowed"),
        (json.dumps(trained.card | {"components": ["wing"]}), data, "components"),
        (json.dumps(trained.card | {"inputs": "wing_area"}), data, "inputs"),
        (
            json.dumps(trained.card | {"samples": {"count": -1, "largest_leverage": 0.1}}),
            data,
            "samples.count = -1 is not allowed",
        ),
        (json.dumps(trained.card | {"samples": 2**70}), data, "samples = 1.1805916207174113e+21 is not allowed"),
        (json.dumps(trained.card | {"range": "wide"}), data, "range = 'wide' is not allowed"),
        (
            json.dumps(trained.card | {"range": {"wing_area_m2": [2.0**70, 1.0]}}),
            data,
            "it must be 2 increasing numbers",
        ),
        (json.dumps(trained.card | {"inputs": trained.card["inputs"][::-1]}), data, "inputs = ["),
        (*resigned(lambda t: t.pop("lower")), "tensors"),
        (*resigned(lambda t: t.update(extra=number(1.0))), "tensors"),
        (*resigned(lambda t: t.update(intercept=t["intercept"][:2])), "intercept of"),
        (*resigned(lambda t: t.update(intercept=t["intercept"].float())), "float64"),
        (*resigned(lambda t: t["coefficients"].fill_(float("nan"))), "coefficients is not allowed; it must be finite"),
        (*resigned(lambda t: t["powers"].fill_(1e9)), "powers are not allowed"),
        (*resigned(lambda t: t["scale"].fill_(0.0)), "scale is not allowed"),
        (*resigned(lambda t: t.update(lower=t["upper"].clone())), "lower is not allowed"),
        (*resigned(lambda t: t["power_law_sign"].fill_(3.0)), "power_law_sign is not allowed"),
    ]
    for card, weights, words in cases:
        with pytest.raises(ValueError) as error:  # noqa: PT011 (the words are compared below)
            parse_trained(card, weights)
        assert words in str(error.value)
