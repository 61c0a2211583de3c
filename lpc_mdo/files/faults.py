"""What is wrong with a value in a file, and what it must be instead, in words; from pydantic's errors."""

import re
import reprlib
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import BaseModel

_SHORT = reprlib.Repr()
_SHORT.maxlevel, _SHORT.maxdict, _SHORT.maxstring, _SHORT.maxother = 2, 2, 60, 60
LONGEST_VALUE = 200  # characters of a value in a message
LONGEST_KEY = 80


def shortened(value: object) -> str:
    """A value as a message shows it: whole where it is short, its beginning where it is not."""
    text = _SHORT.repr(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]} ..."


def _schema_at(model: type[BaseModel], location: Iterable[int | str]) -> dict[str, Any]:
    """JSON schema of the value at `location`; empty where the model has no such key."""
    schema = model.model_json_schema()

    def resolved(node: dict[str, Any]) -> dict[str, Any]:
        node = node["anyOf"][0] if "anyOf" in node else node
        return schema["$defs"][node["$ref"].rsplit("/", 1)[-1]] if "$ref" in node else node

    node = resolved(schema)
    for part in location:
        if "discriminator" in node:
            node = {"$ref": node["discriminator"]["mapping"].get(part, "#/$defs/")} if isinstance(part, str) else {}
            node = resolved(node) if node.get("$ref", "").rsplit("/", 1)[-1] else {}
            continue
        if isinstance(part, str):
            node = node.get("properties", {}).get(part) or node.get("additionalProperties") or {}
            node = node if isinstance(node, dict) else {}
        else:
            node = (node.get("prefixItems") or [node.get("items", {})] * (part + 1))[part]
        node = resolved(node)
    return node


def _untagged(model: type[BaseModel], location: tuple[int | str, ...]) -> tuple[int | str, ...]:
    """The location in a file: without the kinds that pydantic puts in where the kind of a table says which model it has."""
    return tuple(
        part for k, part in enumerate(location) if "discriminator" not in _schema_at(model, location[:k]) or k == 0
    )


def _range(schema: Mapping[str, Any]) -> str:
    """Where a number of this schema must lie: "between 0 and 1", "above 0", or nothing."""
    if {"minimum", "maximum"} <= schema.keys():
        return f"between {schema['minimum']:.10g} and {schema['maximum']:.10g}"
    words = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most", "exclusiveMaximum": "below"}
    return " and ".join(f"{word} {schema[key]:.10g}" for key, word in words.items() if key in schema)


def _rule(model: type[BaseModel], error: Mapping[str, Any]) -> str:
    """What the value of one pydantic error must be instead."""
    kind, schema = error["type"], _schema_at(model, error["loc"])
    if kind == "literal_error":
        return f"it must be {error['ctx']['expected']}"
    if schema.get("type") in ("number", "integer"):
        where = _range(schema)
        if kind.startswith(("greater", "less")):
            return f"it must {'lie' if where.startswith('between') else 'be'} {where}"
        noun = "whole" if schema["type"] == "integer" else "finite"
        return f"it must be a {noun} number {where}".rstrip()
    if kind in ("too_short", "too_long"):
        few, many = schema.get("minItems"), schema.get("maxItems")
        if few == many:
            return f"it must have {many} values"
        return f"it must have at least {few}" if kind == "too_short" else f"it must have at most {many} values"
    message = str(error["msg"])
    return {
        "model_type": "it must be a table of keys",
        "dict_type": "it must be a table of keys",
        "tuple_type": "it must be a list",
        "list_type": "it must be a list",
        "bool_type": "it must be true or false",
        "string_type": "it must be text in quotes",
        "string_too_short": "it must not be empty",
        "string_pattern_mismatch": f"it must be {schema.get('description')}",
    }.get(kind, message[0].lower() + message[1:])


def fault(model: type[BaseModel], error: Mapping[str, Any], prefix: str = "") -> tuple[str, str]:
    """Place and what is wrong there, for one pydantic error: "wing.area_m2", " = -1 is not allowed; it must ..."."""
    kind = error["type"]
    location = _untagged(model, error["loc"])
    name = prefix + "".join(f"[{part}]" if isinstance(part, int) else f".{part[:LONGEST_KEY]}" for part in location)
    name = name.lstrip(".")
    if kind == "extra_forbidden":
        keys = ", ".join(_schema_at(model, error["loc"][:-1]).get("properties", {}))
        return name, f" is not a known key; it must be one of {keys}"
    if kind == "missing":
        return name, " is missing"
    if kind == "union_tag_not_found":
        return f"{name}.kind", " is missing"
    if kind == "union_tag_invalid":
        tags = error["ctx"]["expected_tags"].replace("'", "")
        return f"{name}.kind", f" = {shortened(error['ctx']['tag'])} is invalid: it must be one of {tags}"
    if kind == "value_error":
        key, rest = re.findall(r"\A([\w.\[\]]*)(.*)\Z", str(error["ctx"]["error"]), re.DOTALL)[0]
        return f"{name}.{key}".strip("."), f" = {rest}" if rest.startswith(("'", '"')) else rest
    return name, f" = {shortened(error['input'])} is not allowed; {_rule(model, error)}"


def telling(errors: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """The errors without those that only follow from another: a key missing beside an unknown one, a list of bad items."""
    errors = list(errors)
    misspelt = {error["loc"][:-1] for error in errors if error["type"] == "extra_forbidden"}
    above = {error["loc"][:depth] for error in errors for depth in range(len(error["loc"]))}

    def follows(error: Mapping[str, Any]) -> bool:
        location = error["loc"]
        is_renamed = error["type"] == "missing" and location[:-1] in misspelt
        return is_renamed or location in above

    return [error for error in errors if not follows(error)]
