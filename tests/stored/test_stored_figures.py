"""What a stored result, study or configuration says of itself is of the kind that its name promises, or refused in words."""

import json

import pytest
from pydantic import ValidationError
from stored_files import point, result, variable

from lpc_mdo.config import ConfigurationError
from lpc_mdo.stored.analysis_parts import Rotor
from lpc_mdo.stored.result import read_result
from lpc_mdo.stored.study import read_point

SOUND = {
    "figure_of_merit_mean": 0.7,
    "figure_of_merit_mean_initial": 0.6,
    "sound_pressure_level_dba": 67.0,
    "sound_pressure_level_initial_dba": 79.0,
    "tip_speed_m_per_s": {"front": 130.0},
    "shaft_power_kw": {"front": 93.0},
    "thrust_n": {"front": 4500.0},
    "trim_residual": {"hover": [0.0, None]},
    "trim_residual_axes": ["Fx", "Fz"],
    "sound_pressure_level_tonal_dba": 40.0,
    "said_of_it": "a problem of one's own may say anything",
}
SAID = {
    "version": "0.1.0",
    "git": None,
    "seed": None,
    "threads": 1,
    "platform": "Linux",
    "surrogate_sha256": {"naca4412": "80ce"},
}


def reading(tmp_path, **changes):
    content = result([variable("twist", [0.1], [0.2])], problem="aeroacoustic", outputs=SOUND, provenance=SAID)
    file = tmp_path / "result.json"
    file.write_text(json.dumps(content | changes))
    return read_result(file)


def test_a_sound_result_is_read_as_it_stands(tmp_path):
    assert reading(tmp_path)["outputs"] == SOUND


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("shaft_power_kw", "", "outputs.shaft_power_kw = '' is invalid: it must be a number"),
        ("thrust_n", {"front": "[/red]"}, "outputs.thrust_n.front = '[/red]' is invalid"),
        ("thrust_n", {"front": [[1.0], 2.0]}, "outputs.thrust_n.front = [[1.0], 2.0] is invalid"),
        ("tip_speed_m_per_s", {"front": -130.0}, "it must lie between 0"),
        ("sound_pressure_level_tonal_dba", -1e20, "it must be a number between -500 and 500"),
        ("trim_residual", {"hover": "small"}, "outputs.trim_residual.hover = 'small' is invalid"),
        ("trim_residual_axes", ["Fx", ""], "outputs.trim_residual_axes[1] = '' is not allowed"),
        ("figure_of_merit", {"front": "good"}, "outputs.figure_of_merit.front = 'good' is not allowed"),
        ("sound_pressure_level_dba", None, "it must be a finite number"),
    ],
)
def test_outputs_are_figures_where_their_names_say_so(tmp_path, key, value, words):
    with pytest.raises(ConfigurationError) as told:
        reading(tmp_path, outputs=SOUND | {key: value})
    assert words in str(told.value)


@pytest.mark.parametrize(
    ("table", "key", "value", "words"),
    [
        ("provenance", "platform", False, "provenance.platform = False is invalid: it must be text in quotes"),
        ("provenance", "version", 1e308, "provenance.version = 1e+308 is invalid"),
        ("provenance", "git", {}, "provenance.git = {} is invalid"),
        ("provenance", "surrogate_sha256", {"naca4412": -1}, "it must be a table of texts"),
        ("provenance", "threads", -1, "it must be a whole number of at least 0"),
        ("settings", "observer_distance_m", [], "settings.observer_distance_m = [] is invalid: it must be a number"),
        ("settings", "observer_distance_m", 7.6e10, "it must be a number between 0.001 and 1e+06"),
        ("settings", "noise_weight", "half", "settings.noise_weight = 'half' is invalid"),
    ],
)
def test_where_a_result_comes_from_is_told_in_texts_and_numbers(tmp_path, table, key, value, words):
    with pytest.raises(ConfigurationError) as told:
        reading(tmp_path, **{table: (SAID if table == "provenance" else {}) | {key: value}})
    assert words in str(told.value)


def test_levels_of_a_study_s_point_are_levels(tmp_path):
    file = tmp_path / "point.json"
    file.write_text(json.dumps(point(outputs={"sound_pressure_level_dba": -(2.0**70)}, study_sha256="0")))
    with pytest.raises(ConfigurationError, match=r"outputs.sound_pressure_level_dba = -1.18.* between -500 and 500"):
        read_point(file)


BLADE = {
    "name": "front",
    "kind": "lift",
    "blades": 2,
    "spin": 1,
    "hub_m": [0.0, 0.0, 0.0],
    "radius_m": 1.5,
    "station_m": [0.3, 0.9, 1.5],
    "chord_m": [0.3, 0.2, 0.1],
    "twist_rad": [0.3, 0.2, 0.1],
}


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("chord_m", [0.3, -1.0, 0.1], "chord_m is invalid: it must be above 0"),
        ("station_m", [0.3, 1e-300, 1.5], "station_m is invalid: it must increase"),
        ("station_m", [0.3, 0.9, 1.6], "to radius_m at most"),
        ("twist_rad", [0.3, 0.2], "twist_rad"),
    ],
)
def test_a_stored_blade_is_one(key, value, words):
    assert Rotor.model_validate(BLADE).chord_m == BLADE["chord_m"]
    with pytest.raises(ValidationError, match=words):
        Rotor.model_validate(BLADE | {key: value})
