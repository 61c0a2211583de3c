"""Case files of `lpc-mdo analyze`: one discipline, JSON in, JSON out."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from lpc_mdo.cases.aerodynamics import (
    AirfoilInputs,
    RotorCondition,
    RotorInputs,
    analyze_airfoil,
    analyze_rotor,
)
from lpc_mdo.cases.electric import BatteryInputs, MotorCondition, MotorInputs, analyze_battery, analyze_motor
from lpc_mdo.cases.files import IGNORED, IGNORED_PREFIX, Strict, is_finite, validated
from lpc_mdo.cases.noise import ToneCondition, ToneInputs, WeightingInputs, analyze_tones, analyze_weighting
from lpc_mdo.cases.wings import WingInputs, WingMesh, analyze_wing
from lpc_mdo.files.read import ConfigurationError, read_json
from lpc_mdo.numerics.threads import one_thread

MOST_CONDITIONS = 2000  # half a minute of rotors

Kind = tuple[type[Strict], type[Strict] | None, Callable[..., Any]]
KINDS: dict[str, Kind] = {
    "airfoil": (AirfoilInputs, None, analyze_airfoil),
    "rotor": (RotorInputs, RotorCondition, analyze_rotor),
    "wing": (WingInputs, None, analyze_wing),
    "noise": (ToneInputs, ToneCondition, analyze_tones),
    "motor": (MotorInputs, MotorCondition, analyze_motor),
    "battery": (BatteryInputs, None, analyze_battery),
}


def _conditions(model: type[Strict], case: dict[str, Any], file: Path) -> list[Any]:
    """From `conditions`, or the condition keys of every entry of `results`."""
    if "conditions" in case:
        entries, where = case["conditions"], "conditions"
    else:
        known = set(model.model_fields)
        entries, where = case.get("results", []), "results"
        if isinstance(entries, list):
            entries = [{k: v for k, v in e.items() if k in known} if isinstance(e, dict) else e for e in entries]
    if not isinstance(entries, list) or not entries:
        raise ConfigurationError(f"{file}: conditions is missing.")
    if len(entries) > MOST_CONDITIONS:
        raise ConfigurationError(f"{file}: {where} has {len(entries)} entries; it may have at most {MOST_CONDITIONS}.")
    return [validated(model, entry, file, f"{where}[{i}]") for i, entry in enumerate(entries)]


def analyze_case(discipline: str, case: Any, file: Path) -> dict[str, Any]:
    """Results of one case. Raises ConfigurationError with one sentence on what is wrong with it."""
    if not isinstance(case, dict) or "inputs" not in case:
        raise ConfigurationError(f"{file}: inputs is missing.")
    inputs_model, condition_model, function = KINDS[discipline]
    if discipline == "noise" and isinstance(case["inputs"], dict) and "frequency_Hz" in case["inputs"]:
        inputs_model, condition_model, function = WeightingInputs, None, analyze_weighting
    known = {"inputs"} | ({"conditions"} if condition_model else set()) | ({"mesh"} if discipline == "wing" else set())
    for key in case:
        if key not in IGNORED | known and not key.startswith(IGNORED_PREFIX):
            raise ConfigurationError(
                f"{file}: {key} is not a known key; it must be one of {', '.join(sorted(known))}, or a note."
            )
    inputs = validated(inputs_model, case["inputs"], file, "inputs")
    conditions = _conditions(condition_model, case, file) if condition_model else []
    mesh = validated(WingMesh, case.get("mesh", {}), file, "mesh")
    try:
        with torch.no_grad():
            results = function(inputs, conditions, mesh)
    except ValueError as error:
        raise ConfigurationError(f"{file}: {error}.") from None
    except ArithmeticError as error:
        raise ConfigurationError(
            f"{file}: inputs are invalid: they leave the equations without a solution ({error})."
        ) from None
    if not is_finite(results):
        raise ConfigurationError(f"{file}: inputs are not allowed; they give results that are not finite.")
    return {"results": results}


@one_thread()
def analyze_file(discipline: str, file: Path) -> str:
    """Results of a case file as JSON text."""
    return json.dumps(analyze_case(discipline, read_json(file), file), indent=1, allow_nan=False)
