"""How the case files of `lpc-mdo analyze` are read and refused: what all kinds of case share."""

import math
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from lpc_mdo.config import ConfigurationError
from lpc_mdo.files.faults import fault, telling

RPM = math.pi / 30.0  # rad/s
IGNORED = {"description", "source", "sources", "method", "axes", "note", "title", "results"}
IGNORED_PREFIX = "difference_between"


def within(lower: float, upper: float) -> Any:
    return Field(ge=lower, le=upper, strict=True)


def positive(upper: float) -> Any:
    """Above 0, and at most what anything of the kind has: beyond stands a slip of units or of the decimal point."""
    return Field(gt=0.0, le=upper, strict=True)


Positive = Annotated[float, Field(gt=0.0, strict=True)]
NotNegative = Annotated[float, Field(ge=0.0, strict=True)]
Share = Annotated[float, within(0.0, 1.0)]
Angle = Annotated[float, within(-90.0, 90.0)]


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def validated(model: type[BaseModel], data: Any, file: Path, where: str) -> Any:
    """`data` as the model. Raises ConfigurationError with the first fault, its place below `where` and its value."""
    try:
        return model.model_validate(data, context={"folder": file.parent})
    except ValidationError as error:
        place, what = fault(model, telling(error.errors())[0], where)
        raise ConfigurationError(f"{file}: {place}{what}.") from None


def is_finite(results: Any) -> bool:
    """Whether all numbers in nested results are finite."""
    if isinstance(results, dict | list):
        return all(is_finite(value) for value in (results.values() if isinstance(results, dict) else results))
    return not isinstance(results, float) or math.isfinite(results)
