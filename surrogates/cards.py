"""What the cards beside surrogates' weights must hold: tables that are checked whole before anything is built from them.

A card also keeps how good its surrogate is, for whoever reads it: figures by name, which nothing is computed from.
"""

import hashlib
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, Field, ValidationError

from lpc_mdo.files.faults import fault, shortened, telling
from lpc_mdo.files.read import parse_json
from lpc_mdo.files.values import Count, Name, NotNegative, Number, Positive, Stored, Text, require_numbers

AIRFOIL_SCHEMA, STRUCTURE_SCHEMA = "lpc-mdo/airfoil/2", "lpc-mdo/structural-mass/2"
THICKEST = 0.75  # chords, of a section


def _increasing(count: int, lower: float | None = None) -> AfterValidator:
    """The validator of a field of so many finite numbers, each above the one before, the first at least `lower`."""

    def check(values: Any) -> tuple[float, ...]:
        try:
            require_numbers(values, (count,))
            is_right = values == sorted(set(values)) and (lower is None or values[0] >= lower)
        except ValueError:
            is_right = False
        if not is_right:
            where = "" if lower is None else f" of at least {lower:g}"
            raise ValueError(f" = {shortened(values)} is not allowed; it must be {count} increasing numbers{where}")
        return tuple(float(value) for value in values)

    return AfterValidator(check)


Range = Annotated[Any, _increasing(2)]
Figures = dict[Name, Number]
Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$", description="64 hexadecimal digits")]


class AirfoilRange(Stored):
    alpha_deg: Range
    reynolds: Annotated[Any, _increasing(2, 1.0)]
    mach: Annotated[Any, _increasing(2, 0.0)]


class Section(Stored):
    """Which section a trained polar is of."""

    key: Name


class HeldOut(Stored):
    """What the fit has not seen."""

    reynolds: tuple[Positive, ...]
    mach: tuple[NotNegative, ...]
    share_of_points: float = Field(ge=0.0, le=1.0, strict=True)
    fitted_afterwards: bool = Field(strict=True)


class AirfoilCard(Stored):
    format: Literal["lpc-mdo/airfoil/2"] = Field(alias="schema")
    name: Name
    thickness_to_chord: float = Field(gt=0.0, lt=THICKEST, strict=True)
    blend_deg: Annotated[Any, _increasing(4)]
    training_range: AirfoilRange
    weights_sha256: Digest
    section: Section | None = None
    held_out: HeldOut | None = None
    attached_deg: Range = None
    errors: dict[Name, Figures] = Field(default_factory=dict)
    model: Text = ""
    limits: Text = ""
    data_sha256: Text = ""
    seed: Count = 0


class Samples(Stored):
    count: Count = Field(gt=0)
    largest_leverage: Positive


class Quality(Stored):
    """Of one regression: its form, and how well each form does."""

    form: Name
    n: Count
    r2: Number | None
    r2_cross_validated: dict[Name, Number | None]
    rmse: NotNegative
    rmse_cross_validated: NotNegative
    largest_error_cross_validated: NotNegative


class StructuralCard(Stored):
    format: Literal["lpc-mdo/structural-mass/2"] = Field(alias="schema")
    name: Name
    source: Text
    inputs: tuple[Name, ...]
    components: tuple[Name, ...]
    samples: Samples
    calibration_to_published: dict[Name, Positive]
    weights_sha256: Digest
    range: dict[Name, Range] = Field(default_factory=dict)
    baseline_mass_kg: dict[Name, Positive] = Field(default_factory=dict)
    quality: dict[Name, Quality] = Field(default_factory=dict)
    errors_on_test: dict[Name, Figures] = Field(default_factory=dict)
    errors_on_axis: dict[Name, Figures] = Field(default_factory=dict)
    replica: dict[Name, dict[Name, Number | Figures | dict[Name, Figures]]] = Field(default_factory=dict)
    limits: Text = ""
    seed: Count = 0


CardT = TypeVar("CardT", AirfoilCard, StructuralCard)


def read_card(model: type[CardT], text: str, weights: bytes) -> tuple[CardT, dict[str, Any]]:
    """The card, checked, and all that it holds. Raises ValueError where it is no such card, or of other weights."""
    content = parse_json(text, "the card")
    try:
        card = model.model_validate(content)
    except ValidationError as error:
        place, wrong = fault(model, telling(error.errors(include_url=False))[0])
        raise ValueError(f"{place or 'the card'}{wrong}") from None
    digest = hashlib.sha256(weights).hexdigest()
    if digest != card.weights_sha256:
        raise ValueError(
            f"sha256 of the weights is {digest}, the card says {card.weights_sha256}; both must be the same"
        )
    return card, content
