"""configuration.json: vehicle and mission of a run as the models hold them, in SI units, under the models' own names."""

import inspect
from collections.abc import Iterator
from functools import cache, reduce
from operator import or_
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field, PlainValidator, create_model
from pydantic.fields import FieldInfo

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.files.read import ConfigurationError, read_json
from lpc_mdo.files.values import Stored, rebuilt, validated
from lpc_mdo.stored.provenance import Settings

FILE = "configuration.json"
ROUNDING = 1e-9  # relative, of a limit that was converted


def read_configuration(file: Path) -> tuple[Vehicle, Mission]:
    """Vehicle and mission of a run. Raises ConfigurationError where they could not come from files."""
    content = read_json(file)
    inputs = []
    for name, kind in (("vehicle", Vehicle), ("mission", Mission)):
        part = content.get(name) if isinstance(content, dict) else None
        if not isinstance(part, dict):
            raise ConfigurationError(f"{file}: {name} is missing; it must be the configuration.json of a run.")
        validated(in_si_units(kind), part, file, name)
        whole = rebuilt(kind, part)
        for place, entry in _tables(whole, name):
            try:
                _check(entry)
            except ValueError as error:
                raise ConfigurationError(f"{file}: {place}.{error}.") from None
        inputs.append(whole)
    validated(_WithSettings, content, file)
    return tuple(inputs)


class _WithSettings(Stored):
    settings: Settings = Field(default_factory=dict)


@cache
def in_si_units(kind: type[BaseModel]) -> type[BaseModel]:
    """The model of a table of `kind` as it is stored: its field names, and limits in SI units."""
    fields: dict[str, Any] = {
        name: (_stored_type(field), ... if field.is_required() else field.get_default(call_default_factory=True))
        for name, field in kind.model_fields.items()
    }
    return create_model(f"Stored{kind.__name__}", __base__=Stored, **fields)


def _stored_type(field: FieldInfo) -> Any:
    return _in_si(field.annotation, tuple(field.metadata))


def _in_si(kind: Any, metadata: tuple[Any, ...]) -> Any:
    """A type as it is stored: what turns a file's value into it is left out, and limits turn with it."""
    if _is_table(kind):
        return in_si_units(kind)
    if get_origin(kind) is Annotated:
        inner, *own = get_args(kind)
        return _in_si(inner, (*own, *metadata))
    if get_origin(kind) in (Union, UnionType) and all(map(_is_table, get_args(kind))):
        return Annotated[reduce(or_, map(in_si_units, get_args(kind))), *metadata]
    if get_origin(kind) is tuple:
        parts = tuple(part if part is ... else _in_si(part, ()) for part in get_args(kind))
        return tuple.__class_getitem__(parts)
    factors = [_factor(entry) for entry in metadata if isinstance(entry, AfterValidator) and kind is float]
    kept = [entry for entry in metadata if not isinstance(entry, AfterValidator | BeforeValidator | PlainValidator)]
    if not factors:
        return Annotated[kind, *kept] if kept else kind
    limits = {name: getattr(entry, name) for entry in _plain(kept) for name in ("ge", "le") if hasattr(entry, name)}
    room = ROUNDING * max(map(abs, limits.values()), default=0.0)
    lower, upper = limits.get("ge", -1e30) - room, limits.get("le", 1e30) + room
    return Annotated[float, Field(ge=factors[0] * lower, le=factors[0] * upper, strict=True)]


def _factor(validator: AfterValidator) -> float:
    """What turns a number of the file's unit into SI units."""
    convert: Any = validator.func  # of the number alone, not of pydantic's second argument
    return float(convert(1.0))


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _plain(metadata: list[Any]) -> Iterator[Any]:
    """Constraints, those of a Field one by one."""
    for entry in metadata:
        yield from entry.metadata if isinstance(entry, FieldInfo) else [entry]


def _tables(value: Any, name: str) -> Iterator[tuple[str, BaseModel]]:
    """Every table with its place, inner ones first."""
    if isinstance(value, BaseModel):
        for key in type(value).model_fields:
            yield from _tables(getattr(value, key), f"{name}.{key}")
        yield name, value
    elif isinstance(value, tuple):
        for i, item in enumerate(value):
            yield from _tables(item, f"{name}[{i}]")


def _check(entry: BaseModel) -> None:
    """What the table's model asks of its fields together. Raises ValueError as that does."""
    for decorator in type(entry).__pydantic_decorators__.model_validators.values():
        if decorator.info.mode == "after" and len(inspect.signature(decorator.func).parameters) == 1:
            decorator.func(entry)
