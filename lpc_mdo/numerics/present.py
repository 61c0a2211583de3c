"""Values that may be missing in general and must be there in particular."""

from typing import TypeVar

ValueT = TypeVar("ValueT")


def present(value: ValueT | None, what: str) -> ValueT:
    """The value. Raises ValueError where it is None; `what` says in the message what is missing."""
    if value is None:
        raise ValueError(f"{what} is missing")
    return value
