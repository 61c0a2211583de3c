"""analysis.json, schema lpc-mdo/analysis/1: what figures draw."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool, model_validator

from lpc_mdo.files.values import (
    FARTHEST,
    Coordinate,
    Count,
    Length,
    Level,
    Name,
    NotNegative,
    Number,
    Point,
    Stored,
    Text,
    between,
    numbers,
    read_table,
    require_numbers,
    same_lengths,
    validated,
)

SCHEMA = "lpc-mdo/analysis/1"
FILE = "analysis.json"
VIEWS = ("top", "front", "side")
LAYERS = ("booms", "wing", "horizontal_tail", "fuselage", "vertical_tail")
DRAWN = 1e9  # of quantities on axes
Drawn = numbers(None, lower=-DRAWN, upper=DRAWN)
Places = numbers(None, lower=-FARTHEST, upper=FARTHEST)
Quantity = between(-DRAWN, DRAWN)


class Summary(Stored):
    gross_mass_kg: Number | None = None
    mass_breakdown_kg: dict[Name, Number] | None = None
    wing_span_m: Length | None = None
    lift_to_drag_cruise: Number | None = None
    sound_pressure_level_dba: Level | None = None


class Rotor(Stored):
    name: Name
    kind: Literal["lift", "pusher"]
    blades: Count = Field(ge=1, le=20)
    spin: Literal[-1, 1]
    hub_m: Point
    radius_m: Length
    station_m: Drawn
    chord_m: Drawn
    twist_rad: Drawn

    @model_validator(mode="after")
    def _is_one_blade(self) -> "Rotor":
        same_lengths(station_m=self.station_m, chord_m=self.chord_m, twist_rad=self.twist_rad)
        return self


class OperatingPoint(Stored):
    rotor: Name
    segment: Name
    efficiency: Annotated[float, Quantity] | None  # null where it is undefined
    angle_of_attack_rad: Drawn
    lift_coefficient: Drawn
    thrust_per_length_N_per_m: Drawn


class Segment(Stored):
    name: Name
    segment: Name
    is_wingborne: StrictBool
    duration_s: float = between(0.0, 1e7)
    distance_m: NotNegative
    altitude_m: numbers(2, lower=-1e3, upper=1e5)
    speed_m_per_s: NotNegative
    power_W: float = between(-1e12, 1e12)
    state_of_charge: numbers(2, lower=-1e6, upper=1e6)


class CruisePoint(Stored):
    lift_coefficient: float = Quantity
    drag_coefficient: float = Field(gt=0.0, le=DRAWN, strict=True)


class Polar(Stored):
    lift_coefficient: Drawn
    drag_coefficient: Drawn
    maximum_lift_coefficient: float = Quantity
    cruise: CruisePoint

    @model_validator(mode="after")
    def _has_a_curve_below_stall(self) -> "Polar":
        same_lengths(lift_coefficient=self.lift_coefficient, drag_coefficient=self.drag_coefficient)
        if min(self.lift_coefficient) > self.maximum_lift_coefficient:
            raise ValueError("lift_coefficient is invalid: some of it must lie below maximum_lift_coefficient")
        return self


class Surface(Stored):
    area_m2: NotNegative
    aspect_ratio: NotNegative
    span_m: Length
    mean_chord_m: Length
    aerodynamic_center_m: Point


class Wing(Surface):
    tip_m: numbers(2, 3, lower=-FARTHEST, upper=FARTHEST)


class Body(Stored):
    nose_m: Point
    length_m: Length
    width_m: Length
    height_m: Length
    roof_m: Coordinate


class Mold(Stored):
    surfaces: dict[Name, list[numbers(None, None, 3, lower=-FARTHEST, upper=FARTHEST)]]
    disks: dict[Name, numbers(None, 3, lower=-FARTHEST, upper=FARTHEST)]
    wing_mesh: numbers(None, None, 3, lower=-FARTHEST, upper=FARTHEST)
    tail_mesh: numbers(None, None, 3, lower=-FARTHEST, upper=FARTHEST)
    wing: Wing
    tail: Surface
    fuselage: Body
    hubs_m: numbers(None, 3, lower=-FARTHEST, upper=FARTHEST)
    rotor_radius_m: numbers(None, lower=1e-6, upper=FARTHEST)

    @model_validator(mode="after")
    def _has_rotors(self) -> "Mold":
        same_lengths(hubs_m=self.hubs_m, rotor_radius_m=self.rotor_radius_m)
        if len(self.hubs_m) < 3:
            raise ValueError(f"hubs_m has {len(self.hubs_m)} values; it must have at least 3")
        return self


class Directivity(Stored):
    polar_rad: numbers(None, lower=-10.0, upper=10.0)
    levels_dba: dict[Name, numbers(None, lower=-500.0, upper=500.0)] = Field(min_length=1)
    distance_m: float = between(1e-3, 1e6)

    @model_validator(mode="after")
    def _is_round(self) -> "Directivity":
        for name, levels in self.levels_dba.items():
            same_lengths(polar_rad=self.polar_rad, **{f"levels_dba.{name}": levels})
        return self


class Spectrum(Stored):
    centers_Hz: numbers(None, lower=1e-3, upper=1e6)
    tones_db: dict[Name, numbers(None, lower=-500.0, upper=500.0)] = Field(min_length=1)
    broadband_db: dict[Name, numbers(None, lower=-500.0, upper=500.0)] = Field(min_length=1)
    where: Text

    @model_validator(mode="after")
    def _has_bands(self) -> "Spectrum":
        if sorted(set(self.centers_Hz)) != self.centers_Hz:
            raise ValueError("centers_Hz is invalid: it must increase")
        for key in ("tones_db", "broadband_db"):
            for name, levels in getattr(self, key).items():
                same_lengths(centers_Hz=self.centers_Hz, **{f"{key}.{name}": levels})
        return self


class Contour(Stored):
    ahead_m: numbers(None, lower=-1e6, upper=1e6)
    starboard_m: numbers(None, lower=-1e6, upper=1e6)
    level_dba: numbers(None, None, lower=-500.0, upper=500.0)
    what: Text

    @model_validator(mode="after")
    def _is_a_map(self) -> "Contour":
        for key, axis in (("ahead_m", self.ahead_m), ("starboard_m", self.starboard_m)):
            if len(axis) < 2 or sorted(set(axis)) != axis:
                raise ValueError(f"{key} is invalid: it must be 2 increasing numbers or more")
        require_shape("level_dba", self.level_dba, len(self.ahead_m), len(self.starboard_m))
        return self


class Noise(Stored):
    directivity: Directivity | None = None
    spectrum: Spectrum | None = None
    contour: Contour | None = None


class MotorMap(Stored):
    name: Name
    speed_rad_per_s: Drawn
    torque_N_m: Drawn
    efficiency: numbers(None, None, lower=-DRAWN, upper=DRAWN, has_gaps=True)
    limit_N_m: numbers(None, lower=-DRAWN, upper=DRAWN, has_gaps=True)
    points: dict[Name, numbers(2, lower=-DRAWN, upper=DRAWN)] = Field(min_length=1)

    @model_validator(mode="after")
    def _is_a_map(self) -> "MotorMap":
        for key in ("speed_rad_per_s", "torque_N_m"):
            axis = getattr(self, key)
            if len(axis) < 2 or sorted(set(axis)) != axis:
                raise ValueError(f"{key} is invalid: it must be 2 increasing numbers or more")
        require_shape("efficiency", self.efficiency, len(self.torque_N_m), len(self.speed_rad_per_s))
        same_lengths(speed_rad_per_s=self.speed_rad_per_s, limit_N_m=self.limit_N_m)
        return self


def require_shape(name: str, value: list[Any], *shape: int) -> None:
    """Raises ValueError, as validators do, for lists of other lengths."""
    try:
        require_numbers(value, shape, has_gaps=True)
    except ValueError as error:
        raise ValueError(f"{name}{error}") from None


Polygon = numbers(None, 2, lower=-FARTHEST, upper=FARTHEST)


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
        for view in VIEWS:
            for layer in LAYERS:
                if not (self.outlines or {}).get(view, {}).get(layer):
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
