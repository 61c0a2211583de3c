"""What every table of a file is made of: frozen, without unknown keys, numbers with their range and unit."""

import math
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from lpc_mdo.files.read import is_there


def between(lower: float, upper: float) -> Any:
    """A number that is given as a number, not as text or as true or false."""
    return Field(ge=lower, le=upper, strict=True)


def key(name: str, lower: float, upper: float) -> Any:
    """A number whose file key carries the unit and whose attribute does not."""
    return Field(alias=name, ge=lower, le=upper, strict=True)


# A number whose range is given in the file's unit and whose value is kept in SI: Annotated[float, between(-5.0, 5.0), FROM_DEGREES].
FROM_DEGREES = AfterValidator(math.radians)
FROM_RPM = AfterValidator(lambda rpm: rpm * math.pi / 30.0)
FROM_WATT_HOURS = AfterValidator(lambda energy: energy * 3600.0)


def not_a_truth_value(value: object) -> object:
    """True equals 1: without this it would pass for it."""
    return str(value).lower() if isinstance(value, bool) else value


def printable(name: str) -> str:
    if not name.isprintable() or not name.strip():
        raise ValueError(f"{name!r} is invalid: a name must be printable, without line breaks")
    return name


def identifier(name: str) -> str:
    if not (name.isascii() and name.isidentifier()):
        raise ValueError(
            f"{name!r} is invalid: it must be a word of ASCII letters, digits and _, as it names variables and rows"
        )
    return name


Identifier = Annotated[str, Field(min_length=1, max_length=40), AfterValidator(identifier)]


def beside(name: str, folder: Path) -> str:
    """A card or coordinate file by its path from the vehicle file's folder; other names stay."""
    file = folder / name
    return str(file.resolve()) if is_there(file) and file.is_file() else name


Name = Annotated[str, Field(min_length=1, max_length=80), AfterValidator(printable)]


Coordinate = Annotated[float, between(-50.0, 50.0)]


Point = tuple[Coordinate, Coordinate, Coordinate]


MOST_ITEMS = 500  # of fixed masses and of drag areas


class Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
