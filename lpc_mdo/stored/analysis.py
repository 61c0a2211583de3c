"""analysis.json, schema lpc-mdo/analysis/1: what figures draw."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from lpc_mdo.files.values import (
    FARTHEST,
    Count,
    Name,
    Number,
    Stored,
    Text,
    numbers,
    read_table,
    same_lengths,
    validated,
)
from lpc_mdo.stored.analysis_parts import (
    Drawn,
    Mold,
    MotorMap,
    Noise,
    OperatingPoint,
    Polar,
    Quantity,
    Rotor,
    Segment,
    Summary,
)

SCHEMA = "lpc-mdo/analysis/1"
FILE = "analysis.json"
VIEWS = ("top", "front", "side")
LAYERS = ("booms", "wing", "horizontal_tail", "fuselage", "vertical_tail")
Polygon = Annotated[Any, numbers(None, 2, lower=-FARTHEST, upper=FARTHEST)]


class Design(Stored):
    """Each section where the problem's designs have it."""

    summary: Summary | None = None
    outlines: dict[Literal["top", "front", "side"], dict[Name, list[Polygon]]] | None = None
    rotors: list[Rotor] | None = None
    operating_points: list[OperatingPoint] | None = None
    mission: list[Segment] | None = None
    polar: Polar | None = None
    mold: Mold | None = None
    noise: Noise | None = None
    motor_map: MotorMap | None = None

    @model_validator(mode="after")
    def _is_of_one_piece(self) -> "Design":
        for key in self.model_fields_set:
            if getattr(self, key) in (None, []):
                raise ValueError(f"{key} is invalid: it must not be empty")
        if self.outlines is not None:
            self._require_outlines()
        if self.operating_points is not None:
            self._require_blades()
        return self

    def names(self) -> dict[str, str]:
        """Of what figures compare one by one, with their places."""
        found = {f"rotors[{i}].name": rotor.name for i, rotor in enumerate(self.rotors or ())}
        for i, point in enumerate(self.operating_points or ()):
            found |= {f"operating_points[{i}].{key}": getattr(point, key) for key in ("rotor", "segment")}
        return found

    def _require_outlines(self) -> None:
        outlines: Mapping[Any, Any] = self.outlines or {}
        for view in VIEWS:
            for layer in LAYERS:
                if not outlines.get(view, {}).get(layer):
                    raise ValueError(f"outlines.{view}.{layer} is missing")
        for key in ("gross_mass_kg", "wing_span_m", "lift_to_drag_cruise", "sound_pressure_level_dba"):
            if self.summary is None or getattr(self.summary, key) is None:
                raise ValueError(f"summary.{key} is missing")
        if self.rotors is None:
            raise ValueError("rotors is missing")

    def _require_blades(self) -> None:
        stations = {rotor.name: len(rotor.station_m) for rotor in self.rotors or ()}
        for i, point in enumerate(self.operating_points or ()):
            if point.rotor not in stations:
                raise ValueError(
                    f"operating_points[{i}].rotor = {point.rotor!r} is invalid: rotors has none of that name"
                )
            for key in ("angle_of_attack_rad", "lift_coefficient", "thrust_per_length_N_per_m"):
                if len(getattr(point, key)) != stations[point.rotor]:
                    raise ValueError(
                        f"operating_points[{i}].{key} is invalid: it must have {stations[point.rotor]} values"
                    )


class Designs(Stored):
    """Sections that figures compare are those of both."""

    initial: Design
    optimized: Design

    @model_validator(mode="after")
    def _compare(self) -> "Designs":
        for key in ("outlines", "rotors", "operating_points", "polar"):
            if (getattr(self.initial, key) is None) != (getattr(self.optimized, key) is None):
                raise ValueError(f"{key} is missing from one of the two designs")
        for key in ("rotors", "operating_points"):
            counts = [len(getattr(design, key) or ()) for design in (self.initial, self.optimized)]
            if counts[0] != counts[1]:
                raise ValueError(
                    f"{key} has {counts[0]} entries of the initial and {counts[1]} of the optimized design; both must have as many"
                )
        initial, optimized = (design.names() for design in (self.initial, self.optimized))
        for place, name in initial.items():
            if name != optimized[place]:
                raise ValueError(
                    f"initial.{place} = {name!r} is invalid: it must be {optimized[place]!r}, as optimized"
                )
        names = [
            sorted((design.summary.mass_breakdown_kg or {}) if design.summary else {})
            for design in (self.initial, self.optimized)
        ]
        if names[0] != names[1]:
            raise ValueError("summary.mass_breakdown_kg has other names in the two designs; they must be the same")
        return self


class Check(Stored):
    name: Text
    error: Number | None
    limit: Number | None
    is_met: bool = Field(strict=True)


class SampleValues(Stored):
    mass_kg: Drawn
    center_of_gravity_m: Drawn


class SampleSet(Stored):
    name: Name
    sized: SampleValues
    predicted: SampleValues

    @model_validator(mode="after")
    def _pairs(self) -> "SampleSet":
        for key in ("mass_kg", "center_of_gravity_m"):
            same_lengths(**{f"sized.{key}": getattr(self.sized, key), f"predicted.{key}": getattr(self.predicted, key)})
        return self


class Passed(Stored):
    giver: Name = Field(alias="from")
    taker: Name = Field(alias="to")
    count: Count


class DataFlow(Stored):
    blocks: list[Name] = Field(min_length=1, max_length=100)
    passes: list[Passed]

    @model_validator(mode="after")
    def _joins_its_blocks(self) -> "DataFlow":
        for i, entry in enumerate(self.passes):
            for key, name in (("from", entry.giver), ("to", entry.taker)):
                if name not in self.blocks:
                    raise ValueError(f"passes[{i}].{key} = {name!r} is invalid: blocks has none of that name")
        return self


class Sensitivity(Stored):
    kind: Literal["limit", "bound", "parameter"]
    label: Name
    per_percent: float = Quantity


class Analysis(Stored):
    designs: Designs
    checks: list[Check]
    surrogate_samples: list[SampleSet] | None = None
    data_flow: DataFlow | None = None
    sensitivities: list[Sensitivity] | None = None


def read_analysis(file: Path) -> dict[str, Any]:
    """Content of an analysis.json. Raises ConfigurationError where any of it is not as the format says."""
    content = read_table(file, SCHEMA)
    validated(Analysis, content, file)
    return content
