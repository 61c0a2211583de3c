"""checkpoint.json, schema lpc-mdo/checkpoint/2: where a run that was cut short goes on.

Its state has the solver's own numbers, among them NaN and infinity where there is none yet. The history lies beside it, one
record a line, and grows by what is new; `records` says how many of its lines belong to the state.
"""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from lpc_mdo.files.faults import shortened
from lpc_mdo.files.read import JSON_LIMIT, ConfigurationError, parse_json, read_text
from lpc_mdo.files.values import Count, Stored, numbers, read_table, require_keys, validated
from lpc_mdo.files.write import append, write_atomically
from lpc_mdo.optimization.certificate import Certificate
from lpc_mdo.optimization.result import Progress
from lpc_mdo.optimization.search import Stage

SCHEMA = "lpc-mdo/checkpoint/2"
FILE = "checkpoint.json"
HISTORY = "checkpoint_history.jsonl"
ADVICE = "; run without --resume"
GREATEST = 1e300  # what the solver starts its comparisons from
Scaled = Annotated[float, Field(ge=-GREATEST, le=GREATEST, strict=True)]
Anything = Annotated[float, Field(strict=True)]
Scale = Annotated[float, Field(gt=0.0, le=GREATEST, strict=True)]
Numbers = Annotated[Any, numbers(None, lower=-GREATEST, upper=GREATEST)]


class NewtonState(Stored):
    model_config = ConfigDict(allow_inf_nan=True)

    x: Annotated[Any, numbers(None, lower=-1.0 - 1e-9, upper=1.0 + 1e-9)]
    multipliers: Any
    certificate: dict[str, Any]
    filter: list[tuple[Anything, Anything]]
    damping: Scale
    count: Count
    step: float = Field(ge=0.0, strict=True)
    active: Count
    held: Count
    idle: Count
    best: "NewtonState | None"

    @model_validator(mode="after")
    def _has_a_certificate(self) -> "NewtonState":
        _require_rows(self.multipliers)
        _require(Certificate, self.certificate, "certificate")
        return self


class Reached(Stored):
    """The best end of Newton's method that was no optimum yet."""

    x: Annotated[Any, numbers(None, lower=-1.0 - 1e-9, upper=1.0 + 1e-9)]
    multipliers: Any

    @model_validator(mode="after")
    def _has_rows(self) -> "Reached":
        _require_rows(self.multipliers)
        return self


class State(Stored):
    model_config = ConfigDict(allow_inf_nan=True)

    x: Annotated[Any, numbers(None, lower=-1.0 - 1e-9, upper=1.0 + 1e-9)]
    multipliers: Any
    constraint_scale: Any
    objective_scale: Scale
    penalty: float = Field(ge=0.0, le=GREATEST, strict=True)
    outer: Count
    tolerance: Scale
    last_violation: Scaled
    last_progress: Scaled
    progress: Scaled | None
    stage: Stage
    damping: Scale
    polished: Count
    reached: Reached | None
    newton: NewtonState | None

    @model_validator(mode="after")
    def _has_rows(self) -> "State":
        _require_rows(self.multipliers)
        return self


def _require_rows(multipliers: Any) -> None:
    """A problem without constraints has none."""
    if multipliers != []:
        try:
            TypeAdapter(Numbers).validate_python(multipliers)
        except ValidationError as error:
            raise ValueError(f"multipliers{error.errors()[0]['ctx']['error']}") from None


def _require(kind: type, values: dict[str, Any], name: str) -> None:
    """Raises ValueError, as validators do, unless the values make an object of that dataclass, with its types."""
    try:
        # As JSON, where a table makes an object and yet text makes no number.
        TypeAdapter(kind).validate_json(json.dumps(values), strict=True)
    except ValidationError as error:
        entry = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in entry["loc"])
        what = "is missing" if entry["type"] == "missing" else f"is damaged; it must be right: {entry['msg'].lower()}"
        raise ValueError(f"{name}.{place} {what}") from None


def read_checkpoint(file: Path, digest: str, variables: int, rows: int, solver: str) -> dict[str, Any]:
    """The state in a checkpoint.json of a problem with so many scalar variables and rows.

    Raises ConfigurationError where it belongs to other inputs (their hash is `digest`) or another solver, or any of it is
    damaged.
    """
    content = read_table(file, SCHEMA, is_finite=False)
    require_keys(content, file, "configuration_sha256", advice=ADVICE)
    if content["configuration_sha256"] != digest:
        raise ConfigurationError(f"{file}: belongs to another vehicle or mission{ADVICE}.")
    require_keys(content, file, "solver", "records", "state", advice=ADVICE)
    if content["solver"] != solver:
        raise ConfigurationError(
            f"{file}: solver = {shortened(content['solver'])} wrote it; --resume must go on with that, not {solver!r}."
        )
    state: Any = content["state"]
    lengths = {"x": variables, "multipliers": rows, "constraint_scale": rows}
    for key, length in lengths.items():
        values = state.get(key) if isinstance(state, dict) else None
        if not isinstance(values, list) or len(values) != length:
            raise ConfigurationError(f"{file}: state.{key} must hold {length} finite numbers{ADVICE}.")
    validated(State, state, file, "state", ADVICE)
    history = _read_history(file.with_name(HISTORY), content["records"], file)
    return _known(state, State.model_fields) | {"newton": _newton(state["newton"]), "history": history}


def _read_history(file: Path, count: Any, checkpoint: Path) -> list[dict[str, Any]]:
    """The first `count` records. Raises ConfigurationError where they are not there, or damaged."""
    if not isinstance(count, int) or isinstance(count, bool) or count < 0:
        raise ConfigurationError(f"{checkpoint}: records = {shortened(count)} is invalid: it must be a count{ADVICE}.")
    lines = read_text(file, JSON_LIMIT).split("\n")[:count]
    if len(lines) < count:
        raise ConfigurationError(f"{file}: holds {len(lines)} records; it must hold {count}{ADVICE}.")
    records = [parse_json(line, f"{file}: line {i}", is_finite=False) for i, line in enumerate(lines, 1)]
    for i, record in enumerate(records, 1):
        try:
            _require(Progress, record, f"line {i}")
            if not 0.0 <= record["elapsed"] <= GREATEST:
                raise ValueError(f"line {i}.elapsed = {record['elapsed']} is invalid: it must be a time in s")
        except ValueError as error:
            raise ConfigurationError(f"{file}: {error}{ADVICE}.") from None
    return [_known(record, Progress.__dataclass_fields__) for record in records]


class CheckpointWriter:
    """Keeps the checkpoint of a run: the state is written whole after every step, the history only grows."""

    def __init__(self, folder: Path, digest: str, solver: str) -> None:
        self.folder = folder
        self.head = {"schema": SCHEMA, "configuration_sha256": digest, "solver": solver}
        self.kept = -1  # records in the file; -1: whatever lies there is none of this process's

    def write(self, state: dict[str, Any]) -> None:
        """The records come first, so that a state never counts any that are not there. Raises OSError."""
        records, file = state["history"], self.folder / HISTORY
        if self.kept < 0:
            write_atomically(file, "".join(map(_line, records)))
        elif self.kept < len(records):
            append(file, "".join(map(_line, records[self.kept :])))
        self.kept = len(records)
        state = {key: value for key, value in state.items() if key != "history"}
        content = self.head | {"records": self.kept, "state": state}
        write_atomically(self.folder / FILE, json.dumps(content))


def _line(record: dict[str, Any]) -> str:
    return json.dumps(record) + "\n"


def _newton(state: dict[str, Any] | None) -> dict[str, Any] | None:
    """A point of Newton's method, and the best one that it keeps, with the keys of their format."""
    if state is None:
        return None
    certificate = _known(state["certificate"], Certificate.__dataclass_fields__)
    return _known(state, NewtonState.model_fields) | {"certificate": certificate, "best": _newton(state["best"])}


def _known(table: dict[str, Any], keys: Iterable[str]) -> dict[str, Any]:
    """Without the keys that the format does not have."""
    return {key: table[key] for key in keys if key in table}
