"""Vehicle and mission files: TOML with units in the keys in, validated frozen objects in SI units out."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from lpc_mdo.config.mission import Mission
from lpc_mdo.config.segments.rotor_inoperative import EACH
from lpc_mdo.config.vehicle import Vehicle
from lpc_mdo.files.faults import fault, telling
from lpc_mdo.files.read import ConfigurationError, parse_toml, read_toml


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


@dataclass(frozen=True)
class _Source:
    """Where values come from: a file with its text, the options that replaced some of it (by the path of what they set), and
    what tables are called in messages and where they stand in the text, by their place in the data."""

    file: str
    text: str
    overridden: tuple[tuple[str, str], ...] = ()
    called: Mapping[str, str] = field(default_factory=dict)
    written: Mapping[str, str] = field(default_factory=dict)


def _renamed(name: str, tables: Mapping[str, str]) -> str:
    for place, other in tables.items():
        if name == place or name.startswith((f"{place}.", f"{place}[")):
            return other + name[len(place) :]
    return name


def _sentence(model: type[BaseModel], error: Mapping[str, Any], source: _Source) -> str:
    """One clear sentence for one pydantic error: file or option, place, value, rule, line."""
    name, what = fault(model, error)
    return _located(name, what, source, is_missing=error["type"] == "missing")


def _located(name: str, what: str, source: _Source, *, is_missing: bool = False) -> str:
    """The sentence on the key `name`: with the option that set it, or the file and the line where it stands."""
    set_at, shown = ".".join(re.findall(r"[^.\[\]]+", name)), _renamed(name, source.called)
    for override, changed in source.overridden:
        if f"{set_at}.".startswith(changed) or ("." in set_at and changed.startswith(f"{set_at}.")):
            return f"--set {override}: {shown}{what}."
    parts = re.findall(r"[^.\[\]]+", _renamed(name, source.written))
    location = tuple(int(part) if part.isdecimal() else part for part in parts)
    line = _line_of(source.text, location[:-1] if is_missing else location)
    return f"{source.file}: {shown}{what}{f' (line {line})' if line else ''}."


def _validate(
    model: type[BaseModel],
    data: Mapping[str, Any],
    source: _Source,
    folder: Path = Path(),
) -> Any:
    try:
        return model.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        faults = telling(error.errors())[:5]
        raise ConfigurationError("\n".join(_sentence(model, e, source) for e in faults)) from None


_WORD = re.compile(r"[A-Za-z_]\w*")  # what may stand without quotes where a number stood: the name of a segment
ALTERNATIVES = {
    "mission.reserve.distance_m": "duration_s",
    "mission.reserve.duration_s": "distance_m",
}


FORMER_SEGMENTS = ("hover", "climb", "cruise")


def _with_segments(mission: dict[str, Any]) -> dict[str, str]:
    """Earlier files have three tables, [hover], [climb] and [cruise], in place of [[segments]]: they are read as such.

    Returns where each segment stands in the text, by its place in the data.
    """
    if "segments" in mission or not all(isinstance(mission.get(name), dict) for name in FORMER_SEGMENTS):
        return {}
    mission["segments"] = [{"name": name, "kind": name} | mission.pop(name) for name in FORMER_SEGMENTS]
    if isinstance(mission.get("requirements"), dict):
        mission["requirements"].setdefault("torque_segments", list(FORMER_SEGMENTS[1:]))
    return {f"segments[{i}]": name for i, name in enumerate(FORMER_SEGMENTS)}


def _segment_names(mission: Mapping[str, Any]) -> dict[str, str]:
    """Segments are called by their names, where those are fit for it."""
    segments = mission.get("segments")
    tables = enumerate(segments if isinstance(segments, list) else [])
    names = {f"segments[{i}]": item.get("name") for i, item in tables if isinstance(item, dict)}
    return {place: name for place, name in names.items() if isinstance(name, str) and name.isidentifier()}


def _place(node: Any, part: str) -> str | int | None:
    """The key or index of `part` in a table or a list, whose tables go by number or by name; None if it has none."""
    if isinstance(node, dict):
        return part if part in node else None
    if not isinstance(node, list):
        return None
    if part.isascii() and part.isdecimal():
        return int(part) if int(part) < len(node) else None
    names = [item.get("name") if isinstance(item, dict) else None for item in node]
    return names.index(part) if names.count(part) == 1 else None


def _apply(data: dict[str, Any], path: str, value: str) -> str:
    """Replace one value of a parsed file; only keys that the file has or could have, no tables.

    A table of a list goes by its number or its name, e.g. vehicle.rotors.pusher.radius_m; of segments the name is enough, e.g.
    mission.cruise.speed_m_per_s. Returns the path of what was set, with numbers.
    """
    kind, *parts = path.split(".")
    if (
        kind == "mission"
        and parts
        and parts[0] not in data[kind]
        and _place(data[kind].get("segments"), parts[0]) is not None
    ):
        parts.insert(0, "segments")
    node, places = data[kind], []
    for depth, part in enumerate(parts):
        is_last = depth == len(parts) - 1
        if is_last and isinstance(node, dict) and part not in node and ALTERNATIVES.get(path) in node:
            node[part] = node.pop(ALTERNATIVES[path])
        further = _optional_keys(kind, parts[:depth])
        if is_last and isinstance(node, dict) and part in further:
            node.setdefault(part, None)
        place = _place(node, part)
        if place is None and isinstance(node, list):
            raise ConfigurationError(
                f"--set {path}={value}: {part!r} is not an index from 0 to {len(node) - 1}{_names(node)}."
            )
        if place is None:
            known = dict.fromkeys([*node, *further]) if isinstance(node, dict) else {}
            keys = f"; it must be one of {', '.join(known)}" if known else ""
            raise ConfigurationError(f"--set {path}={value}: {part!r} is not a known key{keys}.")
        parent, node = node, node[place]
        places.append(place)
    if not parts or isinstance(node, dict):
        raise ConfigurationError(f"--set {path}={value}: {path} is a table; name one of its keys: {', '.join(node)}.")
    parent[places[-1]] = _parsed(path, value, is_text=isinstance(node, str))
    return ".".join(str(place) for place in places)


def _optional_keys(kind: str, parts: Iterable[str]) -> list[str]:
    """Keys of a table of a file that may be left out; none of tables in lists, which stand in the file with all that they have."""
    model: Any = {"vehicle": Vehicle, "mission": Mission}[kind]
    for part in parts:
        fields = {field.alias or name: field.annotation for name, field in model.model_fields.items()}
        model = fields.get(part)
        if not (isinstance(model, type) and issubclass(model, BaseModel)):
            return []
    return [
        field.alias or name
        for name, field in model.model_fields.items()
        if not field.is_required()
        and not (isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel))
    ]


def _names(tables: list[Any]) -> str:
    names = [item["name"] for item in tables if isinstance(item, dict) and isinstance(item.get("name"), str)]
    return f" or one of {', '.join(names)}" if names else ""


def _parsed(path: str, value: str, is_text: bool) -> Any:
    """The value as TOML reads it; text needs no quotes."""
    try:
        parsed = parse_toml(f"value = {value}", "--set")
    except ConfigurationError:
        parsed = {}
    is_name = path.endswith(".speed_m_per_s") and not parsed and _WORD.fullmatch(value)
    if is_name or (is_text and not isinstance(parsed.get("value"), str | list)):
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
    written = _with_segments(data["mission"])
    of_kind: dict[str, list[tuple[str, str]]] = {kind: [] for kind in data}
    for override in overrides:
        key, separator, value = override.partition("=")
        if not separator or not key or not value:
            raise ConfigurationError(f"--set {override}: must read KEY=VALUE, e.g. vehicle.wing.area_m2=18.")
        kind = key.split(".")[0]
        if kind not in data:
            raise ConfigurationError(f"--set {override}: the key must start with 'vehicle.' or 'mission.'.")
        of_kind[kind].insert(0, (override, _apply(data, key, value) + "."))
    sources = {kind: _Source(names[kind], texts[kind], tuple(of_kind[kind])) for kind in data}
    sources["mission"] = replace(sources["mission"], called=_segment_names(data["mission"]), written=written)
    folder = Path() if vehicle is None else Path(vehicle).parent
    read = (
        _validate(Vehicle, data["vehicle"], sources["vehicle"], folder),
        _validate(Mission, data["mission"], sources["mission"]),
    )
    _require_rotors(*read, sources["mission"])
    return read


def _require_rotors(vehicle: Vehicle, mission: Mission, source: _Source) -> None:
    """Every segment must turn groups of rotors that the vehicle has."""
    groups = tuple(dict.fromkeys(rotor.group for rotor in vehicle.rotors))
    for i, segment in enumerate(mission.segments):
        for group in segment.groups:
            if group not in groups:
                what = f" = {list(segment.groups)} is invalid: {group!r} must be a group of the vehicle's rotors, {', '.join(groups)}"
                raise ConfigurationError(_located(f"segments[{i}].rotors", what, source))
        names = [rotor.name for rotor in vehicle.rotors if rotor.group in segment.groups]
        if (failed := segment.inoperative_rotor) not in ("", EACH, *names):
            what = f" = {failed!r} is invalid: it must be {EACH!r} or a rotor that the segment turns, one of {', '.join(names)}"
            raise ConfigurationError(_located(f"segments[{i}].rotor", what, source))


def baseline() -> tuple[Vehicle, Mission]:
    """The shipped Lift+Cruise vehicle and mission."""
    return load()
