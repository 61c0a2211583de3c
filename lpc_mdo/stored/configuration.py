"""configuration.json: vehicle and mission of a run as the models hold them, in SI units."""

from pathlib import Path
from typing import Any, get_args, get_origin

from pydantic import AfterValidator, BaseModel

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.input_files import ConfigurationError, read_json
from lpc_mdo.stored.values import validated

FILE = "configuration.json"
DIGITS = 12  # of a number in its file's unit: its last ones come from the conversion
IN_FILE_UNITS = " (in the units of a vehicle or mission file)"


def read_configuration(file: Path) -> tuple[Vehicle, Mission]:
    """Vehicle and mission of a run. Raises ConfigurationError where they could not come from files."""
    content = read_json(file)
    inputs = []
    for name, kind in (("vehicle", Vehicle), ("mission", Mission)):
        part = content.get(name) if isinstance(content, dict) else None
        if not isinstance(part, dict):
            raise ConfigurationError(f"{file}: {name} is missing; it must be the configuration.json of a run.")
        validated(kind, _in_file_units(kind, part), file, name, IN_FILE_UNITS)
        inputs.append(_rebuilt(kind, part))
    return tuple(inputs)


def _in_file_units(kind: Any, value: Any) -> Any:
    """Tables as a file has them, from tables in SI units; what is no table, list or number stays as it is."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        if not isinstance(value, dict):
            return value
        table = {}
        for name, field in kind.model_fields.items():
            if name in value:
                table[field.alias or name] = _converted(field.metadata, _in_file_units(field.annotation, value[name]))
        return table
    inner, *_ = get_args(kind) or (None,)
    if get_origin(kind) is tuple:
        return [_in_file_units(inner, item) for item in value] if isinstance(value, list) else value
    if hasattr(kind, "__metadata__"):
        return _converted(kind.__metadata__, _in_file_units(inner, value))
    return value


def _converted(metadata: Any, value: Any) -> Any:
    """A number divided by the factor by which its validators multiply the file's."""
    for entry in metadata:
        if isinstance(entry, AfterValidator) and isinstance(value, int | float) and not isinstance(value, bool):
            value = float(f"{value / entry.func(1.0):.{DIGITS}g}")
    return value


def _rebuilt(kind: Any, value: Any) -> Any:
    """Objects and tuples as the model has them, from tables that were validated; the numbers bit for bit."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return kind.model_construct(
            **{
                name: _rebuilt(field.annotation, value[name])
                for name, field in kind.model_fields.items()
                if name in value
            }
        )
    if get_origin(kind) is tuple:
        inner = get_args(kind)[0]
        return tuple(_rebuilt(inner, item) for item in value)
    return value
