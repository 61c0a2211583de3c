"""Ways in which files go wrong: values, keys, text and bytes, drawn with a seeded generator."""

import copy
import json
import random
import re
from collections.abc import Callable, Iterator
from typing import Any

NASTY: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 1e-300, -1e-9, 1e30, 1e308, -1e308, 2**70, -(2**70), 10**400, 1.5, "", "text", "1.0", "ü", "$x$",
    "[/red]", "a" * 5000, "../../x", [], {}, [[]], [1, 2], ["a"], {"a": 1}, [None], float("nan"), float("inf"), float("-inf"),
)  # fmt: skip
TOML_VALUES = (
    "nan", "inf", "-inf", "0", "-1", "1e308", "1e-308", str(2**70), "true", '""', '"text"', '"$x$"', "[]", "[1, 2]", "{}",
    "{ a = 1 }", "2024-01-01", "[[1, 2], [3]]", '"\\u0000"', "0x10", "1_000", '["a"]', "[nan]", "12:00:00", "'''a\nb'''",
)  # fmt: skip
CELLS = (
    "",
    "nan",
    "inf",
    "text",
    "1,5",
    "-1",
    "1e308",
    "0",
    '"',
    "1e-400",
    "٣",
    "1_0",
    " 1 ",
    "None",
    "$x$",
    "9" * 400,
)

Mutation = tuple[str, bytes]
"""What was done, and the file's new content."""


def places(value: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Keys that lead to every entry of nested tables and lists."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield (*at, key)
        yield from places(item, (*at, key))


def _changed(number: Any, draw: random.Random) -> Any:
    """A value of the same kind, elsewhere."""
    if isinstance(number, bool) or not isinstance(number, int | float):
        return draw.choice(NASTY)
    return draw.choice(
        (-number, 1e3 * number, 1e-3 * number, 1e9 * number, number + 1, 0.5 * number, int(number), 0 * number)
    )


def of_json(text: str, draw: random.Random) -> Mutation:
    """One entry replaced, removed, added, renamed or given twice; or damage to the text."""
    if draw.random() < 0.2:
        return of_text(text, draw)
    content = json.loads(text)
    # By depth first, or the longest list would take all.
    found = list(places(content))
    depth = draw.choice(sorted({len(place) for place in found}))
    place = draw.choice([place for place in found if len(place) == depth])
    where = ".".join(map(str, place))
    parent = content
    for key in place[:-1]:
        parent = parent[key]
    kind, last = draw.choice(("replace", "replace", "change", "remove", "add", "rename", "twice", "repeat")), place[-1]
    old = parent[last]
    if kind == "replace":
        parent[last] = draw.choice(NASTY)
        what = f"{where} = {json.dumps(parent[last])[:60]}"
    elif kind == "change":
        parent[last] = _changed(old, draw)
        what = f"{where} = {json.dumps(parent[last])[:60]} for {json.dumps(old)[:30]}"
    elif kind == "remove":
        del parent[last]
        what = f"{where} removed"
    elif kind == "add" and isinstance(parent, dict):
        parent["extra"] = draw.choice(NASTY)
        what = f"{where} beside an extra key"
    elif kind == "rename" and isinstance(parent, dict):
        parent[f"{last}_"] = parent.pop(last)
        what = f"{where} renamed"
    elif kind == "twice" and isinstance(parent, dict):
        mark = json.dumps(f"{last}#again")
        parent[f"{last}#again"] = copy.deepcopy(old)
        return f"{where} given twice", json.dumps(content).replace(mark, json.dumps(last)).encode()
    elif isinstance(parent, list):
        parent.append(copy.deepcopy(old))
        what = f"{where} repeated"
    else:
        parent[last] = [old] * 3
        what = f"{where} three times in a list"
    return what, json.dumps(content).encode()


def of_toml(text: str, draw: random.Random) -> Mutation:
    """A line's value or key changed, a line removed, repeated or moved; or damage to the text."""
    if draw.random() < 0.2:
        return of_text(text, draw)
    lines = text.splitlines()
    rows = [i for i, line in enumerate(lines) if re.match(r"\s*[\w.]+\s*=", line) or line.startswith("[")]
    i = draw.choice(rows)
    kind = draw.choice(("value", "value", "value", "scale", "remove", "repeat", "rename", "move", "header"))
    key, _, value = lines[i].partition("=")
    if kind in ("value", "scale") and value:
        number = re.match(r"\s*(-?[\d.]+)", value)
        new = draw.choice(TOML_VALUES)
        if kind == "scale" and number:
            new = repr(_changed(float(number[1]), draw))
        lines[i] = f"{key}= {new}"
    elif kind == "remove":
        del lines[i]
        return f"line {i + 1} removed", "\n".join(lines).encode()
    elif kind == "repeat":
        lines.insert(i, lines[i])
    elif kind == "rename":
        lines[i] = "x" + lines[i]
    elif kind == "move":
        lines.insert(draw.choice(rows), lines.pop(i))
        return f"line {i + 1} moved", "\n".join(lines).encode()
    else:
        lines.insert(i, draw.choice(("[new]", "[[rotors]]", "[wing]", "[a.b.c]", "x", "= 3", "a.b = 1")))
    return f"line {i + 1}: {lines[i][:70]}", "\n".join(lines).encode()


def of_csv(text: str, draw: random.Random) -> Mutation:
    """A cell, a column or a row changed; or damage to the text."""
    if draw.random() < 0.3:
        return of_text(text, draw)
    rows = [line.split(",") for line in text.splitlines()]
    i = draw.choice((0, draw.randrange(len(rows))))
    j = draw.randrange(len(rows[i]))
    kind = draw.choice(("cell", "cell", "cell", "column", "row", "short", "long", "swap", "repeat"))
    if kind == "cell":
        rows[i][j] = draw.choice(CELLS)
    elif kind == "column":
        rows = [row[:j] + row[j + 1 :] for row in rows]
    elif kind == "row":
        del rows[i]
    elif kind == "short":
        del rows[i][j]
    elif kind == "long":
        rows[i].insert(j, "1")
    elif kind == "swap":
        rows[0][0], rows[0][-1] = rows[0][-1], rows[0][0]
    else:
        rows.append(list(rows[i]))
    return f"{kind} at row {i + 1}, column {j + 1}", "\n".join(",".join(row) for row in rows).encode()


def of_text(text: str, draw: random.Random) -> Mutation:
    """Damage that knows nothing of the format."""
    data = text.encode()
    at, to = sorted(draw.randrange(len(data) + 1) for _ in range(2))
    ways: dict[str, Callable[[], bytes]] = {
        "cut short": lambda: data[:at],
        "a piece cut out": lambda: data[:at] + data[to:],
        "a piece twice": lambda: data[:to] + data[at:],
        "a byte changed": lambda: data[:at] + bytes([draw.randrange(256)]) + data[at + 1 :],
        "bytes put in": lambda: data[:at] + bytes(draw.randrange(256) for _ in range(8)) + data[at:],
        "empty": lambda: b"",
        "byte-order mark": lambda: b"\xef\xbb\xbf" + data,
        "UTF-16": lambda: text.encode("utf-16"),
        "NUL": lambda: data[:at] + b"\0" + data[at:],
        "carriage returns": lambda: data.replace(b"\n", b"\r"),
        "decimal commas": lambda: re.sub(rb"(\d)\.(\d)", rb"\1,\2", data),
        "brackets": lambda: b"[" * 100_000,
        "tabs": lambda: data.replace(b" ", b"\t"),
        "upper case": lambda: text.upper().encode(),
        "another file's bytes": lambda: b"\x89PNG\r\n\x1a\n" + bytes(64),
        "a long line": lambda: data[:at] + b"x" * 200_000 + data[at:],
        "two files in one": lambda: data + data,
    }
    what = draw.choice(sorted(ways))
    return f"{what} at byte {at}", ways[what]()
