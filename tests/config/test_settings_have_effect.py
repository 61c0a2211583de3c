"""Every key of the vehicle and the mission file changes something of the problem or its analysis, or is listed with the reason."""

import json
import tomllib
from functools import cache
from importlib import resources
from typing import Any, Literal, get_args, get_origin

import pytest
import torch
from pydantic import BaseModel

from lpc_mdo.config import Mission, Vehicle, load
from lpc_mdo.geometry.shape import Geometry
from lpc_mdo.model import analyzer
from lpc_mdo.problems.gross_weight import gross_weight_problem

MODELS = {"vehicle": Vehicle, "mission": Mission}
WITHOUT_EFFECT = {
    "vehicle.name": "labels reports",
    "vehicle.structure.surrogate_file": "goes with source 'nastran' and a trained card: tests/structures/test_structure_sources.py",
    "vehicle.fixed_masses.0.name": "labels the file's own rows; results have their sum",
    "vehicle.rotors.0.spin": "mirrored rotors turn oppositely either way, and their torques cancel",
}
"""Keys that change nothing of an analysis, and why."""

BUILD_UP = ["vehicle.drag.source=build_up"]
NEEDS = {
    "vehicle.structure.is_calibrated_to_published": ["vehicle.structure.source=open"],
    **{
        f"vehicle.bounds.lift_motor_{size}_m.{key}": [
            f"vehicle.bounds.lift_motor_{size}_m.upper={above}",
            f"vehicle.motors.lift_{part}_m={above}",
            *([f"vehicle.bounds.lift_motor_{size}_m.lower={above}"] if key == "reason" else []),
        ]
        for size, part, above in (("length", "length", 0.3), ("diameter", "bore", 0.45))
        for key in ("lower", "reason")
    },
    **dict.fromkeys(
        (
            "vehicle.drag.fuselage_interference",
            "vehicle.drag.boom_interference",
            "vehicle.drag.leakage_and_protuberance",
            "vehicle.drag.areas.0.name",
            "vehicle.drag.areas.0.area_m2",
            "vehicle.drag.areas.0.position_m",
        ),
        BUILD_UP,
    ),
    "vehicle.battery.minimum_cell_voltage_V": ["vehicle.battery.model=equivalent_circuit"],
    "vehicle.battery.maximum_discharge_rate_per_h": ["vehicle.battery.model=equivalent_circuit"],
}
"""What else must be set for a key to matter."""

OTHER_VALUES = {
    "vehicle.bounds.lift_motor_length_m.lower": "0.28",  # above what hover asks of a motor
    "vehicle.bounds.lift_motor_diameter_m.lower": "0.44",
    "vehicle.wing.airfoil": "4415",
    "vehicle.wing.polar": "naca4412",
    "vehicle.horizontal_tail.airfoil": "0010",
    "vehicle.structure.source": "open",
    "vehicle.structure.outside_samples": "penalty",
    "mission.order": '["hover", "hover", "climb", "cruise"]',
    "mission.requirements.torque_segments": '["cruise"]',
    "mission.requirements.further_observer_elevations_deg": "[30.0]",
}
"""Of texts and lists, whose other values no rule gives."""


def content(kind: str) -> dict[str, Any]:
    return tomllib.loads(resources.files("lpc_mdo.data").joinpath(f"{kind}.toml").read_text(encoding="utf-8"))


def keys(value: Any, at: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Leaves of a file; of lists of tables the first and the last entry stand for all."""
    if isinstance(value, dict):
        return [key for name, item in value.items() for key in keys(item, (*at, name))]
    if isinstance(value, list) and value and isinstance(value[0], dict):
        ends = {"rotors": sorted({0, len(value) - 1}), "segments": range(len(value))}.get(at[-1], [0])
        return [key for i in ends for key in keys(value[i], (*at, str(i)))]
    return [at]


LEAVES = [".".join(key) for kind in MODELS for key in keys(content(kind), (kind,))]


def literal(kind: Any, key: str) -> tuple[Any, ...]:
    """What else a key may be, where the model lists it."""
    if get_origin(kind) is Literal:
        return get_args(kind)
    for inner in get_args(kind):
        if found := literal(inner, key):
            return found
    return ()


def field_of(key: str) -> Any:
    """The type of a key's value in the model."""
    model: Any = MODELS[key.split(".")[0]]
    parts = key.split(".")
    for depth, part in enumerate(parts[1:], start=1):
        if isinstance(model, type) and issubclass(model, BaseModel):
            field = next(f for name, f in model.model_fields.items() if part in (name, f.alias))
            model = field.annotation
        else:
            model = table_of(get_args(model)[0], value_at(".".join(parts[: depth + 1])))
    return model


def table_of(kind: Any, value: Any) -> Any:
    """Of several models, whose kind says which it is, the one of a table."""
    if isinstance(kind, type) or not isinstance(value, dict):
        return kind
    return next(m for m in get_args(get_args(kind)[0]) if value["kind"] in get_args(m.model_fields["kind"].annotation))


def value_at(key: str) -> Any:
    kind, *path = key.split(".")
    node: Any = content(kind)
    for part in path:
        node = node[int(part) if isinstance(node, list) else part]
    return node


def others(key: str) -> list[str]:
    """Values that the key may have instead, as an override writes them."""
    old = value_at(key)
    if key in OTHER_VALUES:
        return [OTHER_VALUES[key]]
    if options := [option for option in literal(field_of(key), key) if option != old]:
        return [str(option) for option in options]
    if isinstance(old, bool):
        return [str(not old).lower()]
    if isinstance(old, str):
        return [f"{old}_other"]
    if isinstance(old, int) and field_of(key) is int:
        return [str(old + 1)]
    if isinstance(old, list):
        changed = [[*old[:k], 1.01 * old[k] + 1e-3 * (old[k] == 0.0), *old[k + 1 :]] for k in range(len(old))]
        return [json.dumps(value) for value in changed]
    return [repr(1.01 * old if old else 0.01), repr(0.99 * old)]


def overrides(key: str, value: str) -> list[str]:
    """With what must change beside the key: the mirrored rotor."""
    found = [f"{key}={value}"]
    parts = key.split(".")
    if parts[1] == "rotors" and parts[2] == "0" and parts[3] != "name":
        twin = len(content("vehicle")["rotors"]) - 3  # the mirror image of the first of eight is the seventh
        other = value
        if parts[3] == "hub_m":
            x, y, z = json.loads(value)
            other = json.dumps([x, -y, z])
        if parts[3] == "spin":
            other = str(-int(value))
        found.append(".".join(["vehicle", "rotors", str(twin), *parts[3:]]) + f"={other}")
    return found


def fingerprint(changes: list[str]) -> dict[str, Any]:
    """All that a designer may see of the problem at its start: variables, bounds, limits, rows, outputs."""
    problem = gross_weight_problem(*load(overrides=changes))
    with torch.no_grad():
        start = problem.analyze(problem.x0)
        rows = [row.tolist() for row in problem.rows(start)]
    mold = problem.analyze_design.geometry.outer_mold_line
    return {
        "variables": [repr(variable) for variable in problem.variables],
        "limits": [(row.name, row.lower, row.upper) for row in problem.constraints],
        "rows": rows,
        "outputs": repr(problem.outputs(start, start)),
        "mold": mold.control_points(mold.baseline_parameters()).square().sum(0).tolist(),
    }


@cache
def baseline(needs: tuple[str, ...]) -> dict[str, Any]:
    return fingerprint(list(needs))


GEOMETRIC = ("wing", "horizontal_tail", "vertical_tail", "fuselage", "booms", "rotors")


@pytest.fixture(autouse=True)
def _geometry_of_unchanged_shapes_is_kept(monkeypatch):
    """It takes seconds to build. A key outside the shape that reached it all the same would be told as without effect."""

    def geometry(vehicle: Vehicle) -> Geometry:
        shape = json.dumps(vehicle.model_dump(include=set(GEOMETRIC)))
        if shape not in _KEPT:
            _KEPT[shape] = Geometry(vehicle)
        return _KEPT[shape]

    monkeypatch.setattr(analyzer, "Geometry", geometry)


_KEPT: dict[str, Geometry] = {}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("key", LEAVES)
def test_every_key_changes_something_or_says_why_not(key):
    needs = NEEDS.get(key, [])
    tried, refused = 0, []
    for value in others(key):
        try:
            changed = fingerprint([*needs, *overrides(key, value)])
        except ValueError as error:
            refused.append(str(error))
            continue
        tried += 1
        if changed != baseline(tuple(needs)):
            assert key not in WITHOUT_EFFECT, "it has an effect now: take it off the list"
            return
    if key in WITHOUT_EFFECT:
        return
    # A key that is refused in every other value matters; its refusals are tested elsewhere.
    assert tried == 0, f"{key} changes nothing"
    assert refused
