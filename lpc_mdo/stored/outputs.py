"""What the outputs of a result.json may hold: figures in the unit that their name says."""

import re
from typing import Any

from pydantic import ConfigDict, Field, model_validator

from lpc_mdo.files.values import (
    LARGEST,
    Length,
    Level,
    Name,
    NotNegative,
    Number,
    Positive,
    Stored,
    require_numbers,
    shape_of,
)

IN_A_UNIT = re.compile(r"_(kg|kg_m2|kw|n|m|m2|s|m_per_s|dba|db|percent)$")
IS_LEVEL = re.compile(r"^sound_pressure_level\w*_dba?$")
LARGEST_LEVEL = 500.0  # dB; that of no sound at all is as far below zero


def require_figures(key: str, value: Any, largest: float = LARGEST) -> None:
    """Raises ValueError, as validators do, unless it is a number up to `largest`, null, or lists or a table of those."""
    if isinstance(value, dict):
        for name, inner in value.items():
            require_figures(f"{key}.{name}", inner, largest)
    elif value is not None:
        try:
            require_numbers(value, shape_of(value), -largest, largest, has_gaps=True)
        except ValueError as error:
            raise ValueError(f"{key}{error}") from None


def require_levels(outputs: dict[str, Any]) -> None:
    """Raises ValueError, as validators do, for a sound pressure level that is none."""
    for key, value in outputs.items():
        if IS_LEVEL.match(key):
            require_figures(key, value, LARGEST_LEVEL)


class Surrogate(Stored):
    outside_training_range: dict[Name, Number] = Field(default_factory=dict)


class Outputs(Stored):
    """What a designer reads first; those that a problem has. A unit in a name means figures: numbers, null, or lists or a
    table of those."""

    model_config = ConfigDict(extra="allow")

    lift_to_drag_cruise: Number | None = None
    sound_pressure_level_dba: Level | None = None
    final_state_of_charge: Number | None = None
    figure_of_merit_mean: Number | None = None
    wing_span_m: Length | None = None
    structural_surrogate: Surrogate = Field(default_factory=Surrogate)
    airfoil_extrapolated_share: dict[Name, NotNegative] = Field(default_factory=dict)
    motor_torque_share: dict[Name, Number] = Field(default_factory=dict)
    figure_of_merit: dict[Name, Number | None] = Field(default_factory=dict)
    trim_residual: Any = 0.0
    trim_residual_axes: tuple[Name, ...] = ()

    @model_validator(mode="after")
    def _holds_figures(self) -> "Outputs":
        """Left out is possible, null is not, where a figure is drawn or compared."""
        require_levels(self.model_extra or {})
        for key, value in (self.model_extra or {}).items():
            if IN_A_UNIT.search(key):
                require_figures(key, value)
        require_figures("trim_residual", self.trim_residual)
        for key in self.model_fields_set & type(self).model_fields.keys():
            if getattr(self, key) is None:
                raise ValueError(f"{key} = None is invalid: it must be a number")
        return self


class PusherMass(Stored):
    pusher_motor: Number


class GrossWeightOutputs(Outputs):
    """Of the gross-weight problem: what is compared with the published study, too."""

    gross_mass_kg: Positive
    gross_mass_initial_kg: Positive
    gross_mass_reduction_percent: Number
    mass_breakdown_kg: PusherMass
    mass_breakdown_initial_kg: PusherMass
    lift_to_drag_cruise: Number
    parasitic_drag_coefficient_cruise: Number
    figure_of_merit_mean: Number
    sound_pressure_level_dba: Level
    final_state_of_charge: Number
    wing_span_m: Length
    wing_span_initial_m: Length
    tail_area_m2: Positive
    tail_area_initial_m2: Positive


class HoverOutputs(Outputs):
    figure_of_merit_mean: Number
    figure_of_merit_mean_initial: Number
    sound_pressure_level_dba: Level
    sound_pressure_level_initial_dba: Level
    tip_speed_m_per_s: dict[Name, NotNegative] = Field(default_factory=dict)


OUTPUTS: dict[str, type[Outputs]] = {"gross-weight": GrossWeightOutputs, "aeroacoustic": HoverOutputs}
