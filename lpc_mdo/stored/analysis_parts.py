"""What the analysis of one design is made of: blades, points, segments, polar, shape, noise, motor map."""

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
    require_numbers,
    same_lengths,
)

DRAWN = 1e9  # of quantities on axes
Drawn = Annotated[Any, numbers(None, lower=-DRAWN, upper=DRAWN)]
Places = Annotated[Any, numbers(None, lower=-FARTHEST, upper=FARTHEST)]
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
        stations = self.station_m
        if sorted(set(stations)) != stations or stations[0] < 0.0 or stations[-1] > (1.0 + 1e-6) * self.radius_m:
            raise ValueError("station_m is invalid: it must increase, from 0 at least to radius_m at most")
        if min(self.chord_m) <= 0.0:
            raise ValueError("chord_m is invalid: it must be above 0 everywhere")
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
    altitude_m: Annotated[Any, numbers(2, lower=-1e3, upper=1e5)]
    speed_m_per_s: NotNegative
    power_W: float = between(-1e12, 1e12)
    state_of_charge: Annotated[Any, numbers(2, lower=-1e6, upper=1e6)]


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
    tip_m: Annotated[Any, numbers(2, 3, lower=-FARTHEST, upper=FARTHEST)]


class Body(Stored):
    nose_m: Point
    length_m: Length
    width_m: Length
    height_m: Length
    roof_m: Coordinate


class Mold(Stored):
    surfaces: dict[Name, list[Annotated[Any, numbers(None, None, 3, lower=-FARTHEST, upper=FARTHEST)]]]
    disks: dict[Name, Annotated[Any, numbers(None, 3, lower=-FARTHEST, upper=FARTHEST)]]
    wing_mesh: Annotated[Any, numbers(None, None, 3, lower=-FARTHEST, upper=FARTHEST)]
    tail_mesh: Annotated[Any, numbers(None, None, 3, lower=-FARTHEST, upper=FARTHEST)]
    wing: Wing
    tail: Surface
    fuselage: Body
    hubs_m: Annotated[Any, numbers(None, 3, lower=-FARTHEST, upper=FARTHEST)]
    rotor_radius_m: Annotated[Any, numbers(None, lower=1e-6, upper=FARTHEST)]

    @model_validator(mode="after")
    def _has_rotors(self) -> "Mold":
        same_lengths(hubs_m=self.hubs_m, rotor_radius_m=self.rotor_radius_m)
        if len(self.hubs_m) < 3:
            raise ValueError(f"hubs_m has {len(self.hubs_m)} values; it must have at least 3")
        return self


class Directivity(Stored):
    polar_rad: Annotated[Any, numbers(None, lower=-10.0, upper=10.0)]
    levels_dba: dict[Name, Annotated[Any, numbers(None, lower=-500.0, upper=500.0)]] = Field(min_length=1)
    distance_m: float = between(1e-3, 1e6)

    @model_validator(mode="after")
    def _is_round(self) -> "Directivity":
        for name, levels in self.levels_dba.items():
            same_lengths(polar_rad=self.polar_rad, **{f"levels_dba.{name}": levels})
        return self


class Spectrum(Stored):
    centers_Hz: Annotated[Any, numbers(None, lower=1e-3, upper=1e6)]
    tones_db: dict[Name, Annotated[Any, numbers(None, lower=-500.0, upper=500.0)]] = Field(min_length=1)
    broadband_db: dict[Name, Annotated[Any, numbers(None, lower=-500.0, upper=500.0)]] = Field(min_length=1)
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
    ahead_m: Annotated[Any, numbers(None, lower=-1e6, upper=1e6)]
    starboard_m: Annotated[Any, numbers(None, lower=-1e6, upper=1e6)]
    level_dba: Annotated[Any, numbers(None, None, lower=-500.0, upper=500.0)]
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
    efficiency: Annotated[Any, numbers(None, None, lower=-DRAWN, upper=DRAWN, has_gaps=True)]
    limit_N_m: Annotated[Any, numbers(None, lower=-DRAWN, upper=DRAWN, has_gaps=True)]
    points: dict[Name, Annotated[Any, numbers(2, lower=-DRAWN, upper=DRAWN)]] = Field(min_length=1)

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
