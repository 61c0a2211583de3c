"""The table of samples: what it keeps, what it refuses, and the card beside it."""

import gzip
import hashlib
import json

import numpy as np
import pytest

from lpc_mdo.structures.samples import (
    COLUMNS,
    COMPONENTS,
    INPUTS,
    QUANTITIES,
    Samples,
    read_dataset_card,
    read_samples,
    to_csv,
)


@pytest.fixture
def samples():
    rng = np.random.default_rng(1)
    targets = rng.uniform(1.0, 2.0, (4, len(COMPONENTS), len(QUANTITIES)))
    targets[2] = np.nan
    return Samples(
        ids=("a_0", "a_1", "b_0", "b_1"),
        statuses=("converged", "soft", "failed", "converged"),
        inputs=rng.uniform(1.0, 20.0, (4, len(INPUTS))),
        targets=targets,
        gross_mass=np.array([3000.0, np.nan, 3100.0, 3200.0]),
        violation=np.array([0.0, 1e-9, 0.3, 0.0]),
        cycles=np.array([3.0, 4.0, 60.0, 5.0]),
    )


def rows_of(samples):
    return [line.split(",") for line in to_csv(samples).decode().splitlines()]


def written(folder, rows, name="samples.csv"):
    file = folder / name
    file.write_text("\n".join(",".join(row) for row in rows) + "\n")
    return file


@pytest.mark.parametrize("name", ["samples.csv", "samples.csv.gz"])
def test_a_table_comes_back_as_it_was_written(samples, tmp_path, name):
    data = to_csv(samples)
    file = tmp_path / name
    file.write_bytes(gzip.compress(data) if name.endswith("gz") else data)
    found, digest = read_samples(file)
    assert digest == hashlib.sha256(file.read_bytes()).hexdigest()
    assert (found.ids, found.statuses) == (samples.ids, samples.statuses)
    for field in ("inputs", "targets", "gross_mass", "violation", "cycles"):
        np.testing.assert_allclose(getattr(found, field), getattr(samples, field), rtol=1e-11)


def test_failed_samples_are_dropped_with_their_reason(samples):
    kept, dropped = samples.usable()
    assert kept.ids == ("a_0", "a_1", "b_1")
    assert dropped == ["b_0: not converged after 60 cycles, largest violation 3.0e-01"]
    assert samples.named("a_").ids == ("a_0", "a_1")


def changed(rows, line, column, value):
    rows = [list(row) for row in rows]
    rows[line][COLUMNS.index(column)] = value
    return rows


@pytest.mark.parametrize(
    ("line", "column", "value", "words"),
    [
        (0, "wing_mass_kg", "wing_mass_lb", "column 'wing_mass_lb' is not allowed"),
        (1, "status", "fine", "line 2: status = 'fine' is not allowed"),
        (
            1,
            "wing_area_m2",
            "1,5".replace(",", ";"),
            "line 2: wing_area_m2 = '1;5' is not allowed; it must be a number",
        ),
        (2, "wing_mass_kg", "inf", "line 3: wing_mass_kg = 'inf' is not allowed; it must be finite"),
        (1, "wing_area_m2", "-3", "sample a_0: wing_area_m2 = -3 is not allowed; it must be positive"),
        (4, "htail_mass_kg", "0", "sample b_1: horizontal_tail mass_kg = 0 is not allowed; it must be positive"),
        (1, "fuselage_ixx_kg_m2", "50", "sample a_0: fuselage moments of inertia"),
    ],
)
def test_values_that_no_structure_has_are_refused(samples, tmp_path, line, column, value, words):
    with pytest.raises(ValueError, match=r"samples\.csv") as error:
        read_samples(written(tmp_path, changed(rows_of(samples), line, column, value)))
    assert words in str(error.value)


def test_missing_columns_short_lines_and_empty_tables_are_refused(samples, tmp_path):
    rows = rows_of(samples)
    with pytest.raises(ValueError, match="column 'vtail_iyz_kg_m2' is missing"):
        read_samples(written(tmp_path, [row[:-1] for row in rows]))
    with pytest.raises(ValueError, match=r"line 3: .* cells are invalid: it must have"):
        read_samples(written(tmp_path, [*rows[:2], rows[2][:-3]]))
    with pytest.raises(ValueError, match="the table has a header only"):
        read_samples(written(tmp_path, rows[:1]))


def test_a_truncated_archive_is_refused(samples, tmp_path):
    file = tmp_path / "samples.csv.gz"
    file.write_bytes(gzip.compress(to_csv(samples))[:200])
    with pytest.raises(ValueError, match=r"samples\.csv\.gz: cannot be read"):
        read_samples(file)


def test_decimal_commas_are_read_where_semicolons_part_the_cells(samples, tmp_path):
    text = to_csv(samples).decode().replace(",", ";").replace(".", ",")
    file = tmp_path / "samples.csv"
    file.write_text("\ufeff" + text.replace("\n", "\r\n") + ";" * (len(COLUMNS) - 1) + "\r\n\r\n")
    np.testing.assert_allclose(read_samples(file)[0].inputs, samples.inputs, rtol=1e-11)


def test_a_sample_given_twice_is_refused_or_left_out_with_a_sentence(samples, tmp_path):
    rows = rows_of(samples)
    with pytest.raises(ValueError, match=r"line 6: sample_id = 'a_0' is invalid: it must stand once"):
        read_samples(written(tmp_path, [*rows, rows[1]]))
    again = ["a_9", *rows[1][1:]]
    found, _ = read_samples(written(tmp_path, [*rows, again]))
    kept, dropped = found.usable()
    assert kept.ids == ("a_0", "a_1", "b_1")
    assert dropped[-1] == "a_9: the same sample as a_0"
    heavier = changed([rows[0], again], 1, "wing_mass_kg", "9.5")[1]
    found, _ = read_samples(written(tmp_path, [*rows, heavier]))
    with pytest.raises(
        ValueError, match="samples a_0 and a_9 are invalid: they have the same inputs but different results"
    ):
        found.usable()


def test_the_card_of_a_data_set_must_fit_its_table(samples, tmp_path):
    file = written(tmp_path, rows_of(samples))
    found, digest = read_samples(file)
    assert read_dataset_card(file, found, digest) is None
    card = tmp_path / "dataset.json"
    good = {"sha256": digest, "author": "somebody", "bounds": {"wing_area_m2": [1.0, 20.0]}}
    card.write_text(json.dumps(good))
    assert read_dataset_card(file, found, digest) == good
    for change, words in (
        ({"sha256": "0" * 64}, "sha256 is not allowed"),
        ({"bounds": {"wing_area_ft2": [1.0, 2.0]}}, "bounds are not allowed"),
        ({"bounds": {"wing_area_m2": [2.0, 1.0]}}, r"bounds.wing_area_m2 = \[2.0, 1.0\] is not allowed"),
        ({"bounds": {"wing_area_m2": [1.0, 1.5]}}, "dataset.json says between 1 and 1.5"),
    ):
        card.write_text(json.dumps(good | change))
        with pytest.raises(ValueError, match=words):
            read_dataset_card(file, found, digest)
    card.write_text("{")
    with pytest.raises(ValueError, match="not valid JSON"):
        read_dataset_card(file, found, digest)
