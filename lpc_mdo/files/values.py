"""Values of stored files: finite numbers within what can be drawn, texts, and lists of numbers of a given shape."""

from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from lpc_mdo.files.faults import fault, shortened, telling
from lpc_mdo.files.read import ConfigurationError, read_json

LARGEST = 1e30  # of any number; drawn quantities have ranges of their own
FARTHEST = 75.0  # m from the origin of geometry: a vehicle file allows 50, and figures grow with its square


def between(lower: float, upper: float) -> Any:
    return Field(ge=lower, le=upper, strict=True)


Number = Annotated[float, between(-LARGEST, LARGEST)]
Positive = Annotated[float, Field(gt=0.0, le=LARGEST, strict=True)]
NotNegative = Annotated[float, between(0.0, LARGEST)]
Length = Annotated[float, between(1e-6, 2.0 * FARTHEST)]
Coordinate = Annotated[float, between(-FARTHEST, FARTHEST)]
Point = tuple[Coordinate, Coordinate, Coordinate]
Level = Annotated[float, between(-500.0, 500.0)]  # dB; that of no sound at all is far below zero
Count = Annotated[int, between(0, 10**12)]
Text = Annotated[str, Field(max_length=1000)]
Name = Annotated[str, Field(min_length=1, max_length=200)]


class Stored(BaseModel):
    """A table of a stored file."""

    model_config = ConfigDict(extra="ignore", frozen=True, allow_inf_nan=False)


def invalid(value: object, rule: str) -> ValueError:
    """What a validator of one field raises: " = 3 is invalid: it must ..."."""
    return ValueError(f" = {shortened(value)} is invalid: it must {rule}")


def _numbers_of(value: Any, shape: tuple[int | None, ...], has_gaps: bool) -> Iterator[float]:
    """The numbers of nested lists. Raises TypeError where they are no lists of that shape, or hold something else."""
    if shape:
        if not isinstance(value, list) or not value or shape[0] not in (None, len(value)):
            raise TypeError
        for item in value:
            yield from _numbers_of(item, shape[1:], has_gaps)
    elif not (value is None and has_gaps):
        if not isinstance(value, int | float) or isinstance(value, bool):
            raise TypeError
        yield value


def shape_of(value: Any) -> tuple[int, ...]:
    """Lengths of nested lists, from the first of each."""
    return (len(value), *shape_of(value[0])) if isinstance(value, list) and value else ()


def require_numbers(
    value: Any, shape: tuple[int | None, ...], lower: float = -LARGEST, upper: float = LARGEST, has_gaps: bool = False
) -> Any:
    """`value` if it is a number, or nested lists of numbers, of this shape (None: any length) within these limits.

    All lists of one depth must have one length. has_gaps: null may stand for a number. Raises ValueError as `invalid`.
    """
    whole = shape_of(value)
    form = " x ".join("n" if size is None else str(size) for size in shape)
    what = f"hold {form} numbers" if shape else "be a number"
    try:
        if len(whole) != len(shape) or any(want not in (None, have) for want, have in zip(shape, whole, strict=True)):
            raise TypeError
        numbers = list(_numbers_of(value, whole, has_gaps))
    except TypeError:
        raise invalid(value, what) from None
    if not all(lower <= number <= upper for number in numbers):  # a NaN is in no range
        raise invalid(value, f"{what} between {lower:g} and {upper:g}")
    return value


def numbers(*shape: int | None, lower: float = -LARGEST, upper: float = LARGEST, has_gaps: bool = False) -> Any:
    """What holds a field of numbers, `Annotated[Any, numbers(...)]`; arguments as `require_numbers`."""
    return AfterValidator(lambda value: require_numbers(value, shape, lower, upper, has_gaps))


def same_lengths(**lists: Any) -> None:
    """Raises ValueError, as validators do, unless all have as many entries as the first."""
    (first, reference), *others = lists.items()
    for name, values in others:
        if len(values) != len(reference):
            raise ValueError(f"{name} has {len(values)} values; it must have {len(reference)}, as {first}")


def validated(model: type[BaseModel], content: Any, file: Path, where: str = "", advice: str = "") -> Any:
    """`content` as the model. Raises ConfigurationError: file, field, value, rule, and what to do then."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        place, what = fault(model, telling(error.errors(include_url=False))[0], where)
        raise ConfigurationError(f"{file}: {place}{what}{advice}.") from None


def read_table(file: Path, schema: str, **options: Any) -> dict[str, Any]:
    """Content of a stored JSON file. Raises ConfigurationError as `read_json`, and for another schema."""
    table = require_keys(read_json(file, **options), file, "schema")
    if table["schema"] != schema:
        raise ConfigurationError(
            f"{file}: schema = {shortened(table['schema'])} is not allowed; it must be {schema!r}."
        )
    return table


def require_keys(content: Any, file: Path, *keys: str, advice: str = "") -> dict[str, Any]:
    """`content` of a file, if it is a table that has these keys. Raises ConfigurationError otherwise."""
    if not isinstance(content, dict):
        raise ConfigurationError(f"{file}: {shortened(content)} is invalid: it must be a table of keys{advice}.")
    for key in keys:
        if key not in content:
            raise ConfigurationError(f"{file}: {key} is missing{advice}.")
    return content


def rebuilt(kind: Any, value: Any) -> Any:
    """Objects and tuples as a model has them, from plain values that are known to be right; the numbers bit for bit."""
    origin = get_origin(kind)
    if origin is Annotated:
        return rebuilt(get_args(kind)[0], value)
    if origin in (Union, UnionType):
        kinds = [part for part in get_args(kind) if "kind" in getattr(part, "model_fields", {})]
        if kinds and isinstance(value, dict):  # tables of several models, whose kind says which one
            named = (part for part in kinds if value["kind"] in get_args(part.model_fields["kind"].annotation))
            return rebuilt(next(named), value)
        return None if value is None else rebuilt(get_args(kind)[0], value)
    if origin is tuple and isinstance(value, list | tuple):
        inner = get_args(kind)[0]
        return tuple(rebuilt(inner, item) for item in value)
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        places = {name: name if name in value else field.alias for name, field in kind.model_fields.items()}
        own = {name: place for name, place in places.items() if place in value}
        return kind.model_construct(
            **{name: rebuilt(kind.model_fields[name].annotation, value[place]) for name, place in own.items()}
        )
    return value
