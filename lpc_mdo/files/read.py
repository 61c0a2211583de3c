"""Every text file that the project is given is read here: bounded in size, time and memory, refused in one sentence."""

import csv
import io
import json
import math
import os
import re
import stat
import tomllib
import zlib
from collections import Counter
from collections.abc import Iterable
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

MEGABYTE = 1_000_000
TOML_LIMIT = MEGABYTE // 4  # twenty times the shipped vehicle
TEXT_LIMIT = MEGABYTE  # of other files that people write
JSON_LIMIT = 32 * MEGABYTE  # of stored results, and of tables: fifty times the largest that the shipped aircraft gives
LARGEST_DEPTH = 32  # of tables and lists in each other
LONGEST_KEY = 8  # parts with dots between them
LARGEST_LINE = 4000  # characters of a TOML line
MOST_VALUES = 1_000_000  # in one JSON file, and lines of a table
SAFE_DIGITS = 18  # with its sign: a whole number that certainly fits into 64 bits


class ConfigurationError(ValueError):
    """A vehicle, mission, case or stored file, or an option, that cannot be used as it stands."""


def is_there(path: Path) -> bool:
    """Whether there is something of that path; of a name that the file system cannot hold there is nothing."""
    try:
        return path.exists()
    except OSError:
        return False


def read_bytes(path: Path, limit_bytes: int = JSON_LIMIT) -> bytes:
    """Content of a regular file. Raises ConfigurationError for anything else, and above the limit, without waiting."""
    try:
        # Before it is opened: a named pipe would wait for a writer, a device may never end.
        kind = path.stat().st_mode
        if stat.S_ISDIR(kind):
            raise IsADirectoryError(0, "Is a directory")
        if not stat.S_ISREG(kind):
            raise ConfigurationError(f"{path}: cannot be read: it is a pipe, a socket or a device; it must be a file.")
        with path.open("rb") as stream:
            data = stream.read(limit_bytes + 1)
    except OSError as error:
        raise ConfigurationError(f"{path}: cannot be read: {error.strerror}.") from None
    except ValueError as error:
        if isinstance(error, ConfigurationError):
            raise
        raise ConfigurationError(f"{str(path)!r}: cannot be read: {error}.") from None  # a NUL in the name
    if len(data) > limit_bytes:
        size = os.path.getsize(path)
        raise ConfigurationError(
            f"{path}: cannot be read: it has {max(size, len(data))} bytes; it must have at most {limit_bytes}."
        )
    return data


def read_packaged(file: Path | Traversable, limit_bytes: int) -> bytes:
    """As `read_bytes`; what is shipped may lie in an archive, and is taken as it is."""
    return read_bytes(file, limit_bytes) if isinstance(file, Path) else file.read_bytes()


def unzipped(data: bytes, path: Path, limit_bytes: int = JSON_LIMIT) -> bytes:
    """What gzip data hold. Raises ConfigurationError where they are damaged, or hold more than the limit."""
    parts, size = [], 0
    try:
        while data:
            engine = zlib.decompressobj(wbits=31)
            parts.append(engine.decompress(data, limit_bytes + 1 - size))
            size += len(parts[-1])
            if size > limit_bytes:
                raise ConfigurationError(
                    f"{path}: cannot be read: it unpacks to more than {limit_bytes} bytes; it must have at most those."
                )
            if not engine.eof:
                raise ConfigurationError(f"{path}: cannot be read: its gzip stream ends too soon.")
            data = engine.unused_data.lstrip(b"\0")
    except zlib.error:
        raise ConfigurationError(f"{path}: cannot be read: it is not gzip data, or damaged.") from None
    return b"".join(parts)


def read_text(path: Path, limit_bytes: int = TEXT_LIMIT) -> str:
    """Text of a UTF-8 file, unpacked where its name ends in .gz; a byte-order mark is left out, line ends become \\n.

    Raises ConfigurationError as `read_bytes`, and for what is not text.
    """
    data = read_bytes(path, limit_bytes)
    return decoded(unzipped(data, path, limit_bytes) if path.suffix == ".gz" else data, path)


def decoded(data: bytes, path: Path) -> str:
    """Text of UTF-8 data as `read_text` gives it; `path` is for its messages."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ConfigurationError(f"{path}: cannot be read: it is not UTF-8 text.") from None
    if "\0" in text:
        raise ConfigurationError(f"{path}: cannot be read: it is not text; it holds a NUL character.")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def read_json(path: Path, limit_bytes: int = JSON_LIMIT, *, is_finite: bool = True) -> Any:
    """Content of a JSON file; whole numbers beyond 64 bits become floats. is_finite: NaN and infinities are refused.

    Raises ConfigurationError as `read_text`, where it is not JSON, gives a key twice, nests too deeply or is too much.
    """
    return parse_json(read_text(path, limit_bytes), str(path), is_finite=is_finite)


def parse_json(text: str, name: str, *, is_finite: bool = True) -> Any:
    """As `read_json`, from text; `name` is for its messages."""
    if text.count(",") >= MOST_VALUES:
        raise ConfigurationError(f"{name}: holds more than {MOST_VALUES} values; it must hold fewer.")
    try:
        content = json.loads(text, object_pairs_hook=_table_of_unique_keys, parse_int=_whole)
        place = _not_finite(content)
    except RecursionError:
        raise ConfigurationError(
            f"{name}: is not valid JSON here: it must nest at most {LARGEST_DEPTH} lists or tables."
        ) from None
    except ConfigurationError as error:
        raise ConfigurationError(f"{name}: {error}") from None
    except ValueError as error:
        raise ConfigurationError(f"{name}: is not valid JSON: {error}.") from None
    if place is not None and is_finite:
        where = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place[:-1]).lstrip(".")
        value = f"{where} = {place[-1]}" if where else str(place[-1])
        raise ConfigurationError(f"{name}: {value} is invalid: it must be a finite number.")
    return content


def _table_of_unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for i, key in enumerate(keys) if key in keys[:i])
        raise ConfigurationError(f"{twice[:80]} is given twice; every key must stand once.")
    return table


def _whole(digits: str) -> int | float:
    """A whole number; as a float, which a model accepts or refuses by its range, where 64 bits may not hold it."""
    return int(digits) if len(digits) <= SAFE_DIGITS else float(digits)


def _not_finite(value: Any, depth: int = 0) -> tuple[int | str | float, ...] | None:
    """Keys that lead to the first number that is not finite, and that number; None where all are."""
    if isinstance(value, float):
        return None if math.isfinite(value) else (value,)
    if not isinstance(value, list | dict):
        return None
    if depth >= LARGEST_DEPTH:
        raise RecursionError
    items: Iterable[tuple[int | str, Any]] = value.items() if isinstance(value, dict) else enumerate(value)
    for key, item in items:
        if (rest := _not_finite(item, depth + 1)) is not None:
            return (key, *rest)
    return None


def read_toml(path: Path, limit_bytes: int = TOML_LIMIT) -> tuple[dict[str, Any], str]:
    """Content and text of a TOML file. Raises ConfigurationError as `read_text` and `parse_toml`."""
    text = read_text(path, limit_bytes)
    return parse_toml(text, str(path)), text


_DEEP_KEY = re.compile(rf"(?:[\w-]++[ \t]*+\.[ \t]*+){{{LONGEST_KEY}}}")
_TEXT = re.compile(
    r"""\#[^\n]* | \"{3}(?:\\.|[^\\])*?\"{3} | '{3}.*?'{3} | "(?:\\.|[^"\\\n])*" | '[^'\n]*'""", re.VERBOSE | re.DOTALL
)


def parse_toml(text: str, name: str) -> dict[str, Any]:
    """Content of a TOML text; `name` is for the messages.

    Raises ConfigurationError where it is not TOML, and where the parser, whose time and memory grow with the square of
    nesting and of the parts of a key, would not end soon.
    """
    for number, line in enumerate(text.split("\n"), start=1):
        if len(line) > LARGEST_LINE:
            raise ConfigurationError(
                f"{name}: line {number} has {len(line)} characters; it must have at most {LARGEST_LINE}."
            )
    bare = _TEXT.sub(lambda token: ("" if token[0][0] == "#" else "x") + "\n" * token[0].count("\n"), text)
    if found := _DEEP_KEY.search(bare):
        number = bare.count("\n", 0, found.start()) + 1
        raise ConfigurationError(
            f"{name}: line {number} holds a key of more than {LONGEST_KEY} parts; it must have fewer."
        )
    depth = 0
    for bracket in re.finditer(r"[\[\]{}]", bare):
        depth += 1 if bracket[0] in "[{" else -1
        if depth > LARGEST_DEPTH:
            number = bare.count("\n", 0, bracket.start()) + 1
            raise ConfigurationError(
                f"{name}: line {number} opens a list or table within {LARGEST_DEPTH} others; fewer must be nested."
            )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigurationError(f"{name}: is not valid TOML: {error}.") from None
    except (RecursionError, ValueError) as error:  # a date that no calendar has, a number of too many digits
        raise ConfigurationError(f"{name}: is not valid TOML: {str(error).partition(';')[0]}.") from None


def read_csv_rows(path: Path, limit_bytes: int = JSON_LIMIT, *, required: Iterable[str] = ()) -> list[dict[str, str]]:
    """Rows of a comma-separated file by the names of its header; blank lines are passed over.

    Raises ConfigurationError as `read_text`, for a header that is empty, names a column twice or lacks a required one, and for a row that has
    more or fewer values than it.
    """
    return parse_csv_rows(read_text(path, limit_bytes), str(path), required=required)


def parse_csv_rows(text: str, name: str, *, required: Iterable[str] = ()) -> list[dict[str, str]]:
    """As `read_csv_rows`, from text; `name` is for its messages."""
    if text.count("\n") > MOST_VALUES:
        raise ConfigurationError(f"{name}: has more than {MOST_VALUES} lines; it must have fewer.")
    reader = csv.reader(io.StringIO(text), strict=True)
    header, rows = None, []
    try:
        for row in reader:
            if not row:
                continue
            if header is None:
                header = [column.strip() for column in row]
                if twice := [column for column, count in Counter(header).items() if count > 1]:
                    raise ConfigurationError(
                        f"{name}: column {twice[0][:80]!r} stands twice in the header; it must stand once."
                    )
            elif len(row) != len(header):
                raise ConfigurationError(
                    f"{name}: line {reader.line_num} has {len(row)} values; it must have {len(header)}, as the header."
                )
            else:
                rows.append(dict(zip(header, row, strict=True)))
    except csv.Error as error:
        raise ConfigurationError(f"{name}: line {reader.line_num} is not valid CSV: {error}.") from None
    if header is None:
        raise ConfigurationError(f"{name}: is empty; it must begin with a header.")
    if missing := [column for column in required if column not in header]:
        raise ConfigurationError(f"{name}: column {missing[0]} is missing.")
    return rows
