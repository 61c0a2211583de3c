"""Vehicle and mission files: TOML with units in the keys in, validated frozen objects in SI units out."""

import re
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from lpc_mdo.config.mission import CRUISE, Mission
from lpc_mdo.config.vehicle import Vehicle
from lpc_mdo.faults import fault, telling
from lpc_mdo.input_files import ConfigurationError, parse_toml, read_toml


def _line_of(text: str, location: tuple[int | str, ...]) -> int | None:
    """Line of the key at `location` in a TOML text, where one can be found."""
    table: list[int | str] = []
    counts: dict[str, int] = {}
    found = None
    for number, line in enumerate(text.splitlines(), start=1):
        if header := re.match(r"\s*(\[\[?)\s*([\w.]+)\s*\]", line):
            name = header[2]
            table = list(name.split("."))
            if header[1] == "[[":
                table.append(counts.get(name, 0))
                counts[name] = counts.get(name, 0) + 1
            if found is None and location and tuple(table[: len(location)]) == location:
                found = number
        elif (entry := re.match(r"\s*([\w]+)\s*=", line)) and (*table, entry[1]) == location[: len(table) + 1]:
            return number
    return found


def _sentence(model: type[BaseModel], error: Mapping[str, Any], file: str, text: str, overridden: Iterable[str]) -> str:
    """One clear sentence for one pydantic error: file or option, place, value, rule, line."""
    name, what = fault(model, error)
    return _located(name, what, file, text, overridden, is_missing=error["type"] == "missing")


def _located(name: str, what: str, file: str, text: str, overridden: Iterable[str], *, is_missing: bool = False) -> str:
    """The sentence on the key `name`: with the option that set it, or the file and the line where it stands."""
    location = tuple(int(part) if part.isdecimal() else part for part in re.findall(r"[^.\[\]]+", name))
    path = ".".join(str(part) for part in location)
    for override in overridden:
        changed = override.partition("=")[0].partition(".")[2] + "."
        if f"{path}.".startswith(changed) or (len(location) > 1 and changed.startswith(f"{path}.")):
            return f"--set {override}: {name}{what}."
    line = _line_of(text, location[:-1] if is_missing else location)
    return f"{file}: {name}{what}{f' (line {line})' if line else ''}."


def _validate(
    model: type[BaseModel],
    data: Mapping[str, Any],
    file: str,
    text: str,
    overridden: Iterable[str] = (),
    folder: Path = Path(),
) -> Any:
    try:
        return model.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        faults = telling(error.errors())[:5]
        raise ConfigurationError("\n".join(_sentence(model, e, file, text, overridden) for e in faults)) from None


ALTERNATIVES = {
    "mission.reserve.distance_m": "duration_s",
    "mission.reserve.duration_s": "distance_m",
}


def _apply(data: dict[str, Any], path: str, value: str) -> None:
    """Replace one value of a parsed file; only keys that the file has or could have in another's place, no tables."""
    *parents, last = path.split(".")
    node: Any = data
    for part in (*parents, last):
        if isinstance(node, dict) and part == last and part not in node and ALTERNATIVES.get(path) in node:
            node[part] = node.pop(ALTERNATIVES[path])
        is_list = isinstance(node, list)
        if is_list and not (part.isascii() and part.isdecimal() and int(part) < len(node)):
            raise ConfigurationError(f"--set {path}={value}: {part!r} is not an index from 0 to {len(node) - 1}.")
        if not is_list and (not isinstance(node, dict) or part not in node):
            keys = f"; it must be one of {', '.join(node)}" if isinstance(node, dict) else ""
            raise ConfigurationError(f"--set {path}={value}: {part!r} is not a known key{keys}.")
        parent, key = node, int(part) if is_list else part
        node = node[key]
    if isinstance(node, dict):
        raise ConfigurationError(f"--set {path}={value}: {path} is a table; name one of its keys: {', '.join(node)}.")
    parent[key] = _parsed(path, value, is_text=isinstance(node, str))


def _parsed(path: str, value: str, is_text: bool) -> Any:
    """The value as TOML reads it; text needs no quotes."""
    try:
        parsed = parse_toml(f"value = {value}", "--set")
    except ConfigurationError:
        parsed = {}
    if (is_text or value == CRUISE) and not isinstance(parsed.get("value"), str | list):
        return value
    if parsed.keys() != {"value"}:
        raise ConfigurationError(f"--set {path}={value}: {value!r} is not a number.")
    return parsed["value"]


def _read(path: Path | None, default: str) -> tuple[dict[str, Any], str, str]:
    if path is None:
        text = resources.files("lpc_mdo.data").joinpath(default).read_text(encoding="utf-8")
        return parse_toml(text, default), default, text
    content, text = read_toml(path)
    return content, str(path), text


def load(
    vehicle: Path | str | None = None, mission: Path | str | None = None, overrides: Iterable[str] = ()
) -> tuple[Vehicle, Mission]:
    """Vehicle and mission from their files, or the shipped baseline where a path is None.

    `overrides` are KEY=VALUE strings, e.g. "vehicle.wing.area_m2=18" or "mission.cruise.speed_m_per_s=60".
    Raises ConfigurationError with one sentence per fault: file, key, value, rule, line.
    """
    data, names, texts = {}, {}, {}
    for kind, path in (("vehicle", vehicle), ("mission", mission)):
        data[kind], names[kind], texts[kind] = _read(None if path is None else Path(path), f"{kind}.toml")
    of_kind: dict[str, list[str]] = {kind: [] for kind in data}
    for override in overrides:
        key, separator, value = override.partition("=")
        if not separator or not key or not value:
            raise ConfigurationError(f"--set {override}: must read KEY=VALUE, e.g. vehicle.wing.area_m2=18.")
        if key.split(".")[0] not in data:
            raise ConfigurationError(f"--set {override}: the key must start with 'vehicle.' or 'mission.'.")
        _apply(data, key, value)
        of_kind[key.split(".")[0]].insert(0, override)
    folder = Path() if vehicle is None else Path(vehicle).parent
    return (
        _validate(Vehicle, data["vehicle"], names["vehicle"], texts["vehicle"], of_kind["vehicle"], folder),
        _validate(Mission, data["mission"], names["mission"], texts["mission"], of_kind["mission"]),
    )


def baseline() -> tuple[Vehicle, Mission]:
    """The shipped Lift+Cruise vehicle and mission."""
    return load()
