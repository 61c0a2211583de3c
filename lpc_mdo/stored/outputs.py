"""Outputs of a result by problem: what a designer reads first, and what tables and figures take from them."""

from pydantic import Field, model_validator

from lpc_mdo.stored.values import (
    Length,
    Level,
    Name,
    NotNegative,
    Number,
    Positive,
    Stored,
)


class Surrogate(Stored):
    outside_training_range: dict[Name, Number] = Field(default_factory=dict)


class Outputs(Stored):
    """What a designer reads first; those that a problem has."""

    lift_to_drag_cruise: Number | None = None
    sound_pressure_level_dba: Level | None = None
    final_state_of_charge: Number | None = None
    figure_of_merit_mean: Number | None = None
    wing_span_m: Length | None = None
    structural_surrogate: Surrogate = Field(default_factory=Surrogate)
    airfoil_extrapolated_share: dict[Name, NotNegative] = Field(default_factory=dict)
    motor_torque_share: dict[Name, Number] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _has_no_null(self) -> "Outputs":
        """Left out is possible, null is not."""
        for key in self.model_fields_set:
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


OUTPUTS: dict[str, type[Outputs]] = {"gross-weight": GrossWeightOutputs, "aeroacoustic": HoverOutputs}
