"""Vehicle and mission files: TOML with units in the keys in, validated frozen objects in SI units out."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StrictBool,
    ValidationError,
    ValidationInfo,
    model_validator,
)

from lpc_mdo.faults import fault, telling
from lpc_mdo.geometry.sections import section_name, section_thickness
from lpc_mdo.input_files import ConfigurationError, parse_toml, read_toml
from lpc_mdo.layout import booms, mirror_pairs
from lpc_mdo.layout_checks import require_buildable


def _between(lower: float, upper: float) -> Any:
    """A number that is given as a number, not as text or as true or false."""
    return Field(ge=lower, le=upper, strict=True)


def _key(name: str, lower: float, upper: float) -> Any:
    """A number whose file key carries the unit and whose attribute does not."""
    return Field(alias=name, ge=lower, le=upper, strict=True)


def _converted(convert: Any, lower: float, upper: float) -> Any:
    """A number whose range is given in the file's unit and whose value is kept in SI."""
    return Annotated[float, _between(lower, upper), AfterValidator(convert)]


def _not_a_truth_value(value: object) -> object:
    """True equals 1: without this it would pass for it."""
    return str(value).lower() if isinstance(value, bool) else value


def _no_former_convention(value: object) -> object:
    if value == "paper":
        raise ValueError(
            ' = "paper" is invalid: write "lsdo_acoustics_2023", the code after the paper that it stood for'
        )
    return value


CRUISE = "cruise"


def _none_at_cruise_speed(value: object) -> object:
    if isinstance(value, str) and value != CRUISE:
        raise ValueError(f' = {value!r} is invalid: it must be a number or "{CRUISE}"')
    return None if value == CRUISE else value


def _radians(lower_degrees: float, upper_degrees: float) -> Any:
    return _converted(math.radians, lower_degrees, upper_degrees)


def _printable(name: str) -> str:
    if not name.isprintable() or not name.strip():
        raise ValueError(f"{name!r} is invalid: a name must be printable, without line breaks")
    return name


LIFT_ROTOR_COUNTS = range(4, 17, 2)
CONTROL_POINTS = 28  # of a blade at most: it has as many stations
MOST_ITEMS = 500  # of fixed masses and of drag areas
MOST_OBSERVERS = 91  # one a degree; each takes 4 MB a design
Name = Annotated[str, Field(min_length=1, max_length=80), AfterValidator(_printable)]
Coordinate = Annotated[float, _between(-50.0, 50.0)]
Point = tuple[Coordinate, Coordinate, Coordinate]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class LiftingSurface(_Table):
    """A trapezoidal wing or tail: areas in m^2, angles in rad, positions in m."""

    area: float = _key("area_m2", 0.5, 100.0)
    aspect_ratio: float = _between(1.0, 30.0)
    taper: float = _between(0.1, 1.0)
    quarter_chord_sweep: _radians(-45.0, 45.0) = Field(alias="quarter_chord_sweep_deg")
    dihedral: _radians(-20.0, 20.0) = Field(alias="dihedral_deg")
    incidence: _radians(-15.0, 15.0) = Field(alias="incidence_deg")
    root_quarter_chord: Point = Field(alias="root_quarter_chord_m")
    airfoil: str

    @property
    def thickness_to_chord(self) -> float:
        return section_thickness(self.airfoil)

    @model_validator(mode="before")
    @classmethod
    def _names_a_section(cls, data: Any, info: ValidationInfo) -> Any:
        """Four digits in quotes, the name of a shipped section, or a coordinate file, its path from the vehicle file."""
        if not isinstance(data, dict) or not isinstance(data.get("airfoil"), str):
            return data
        return data | {"airfoil": section_name(data["airfoil"], (info.context or {}).get("folder", Path()))}

    @model_validator(mode="after")
    def _is_a_section(self) -> "LiftingSurface":
        if not re.fullmatch(r"\d{4}", self.airfoil):
            if not 0.06 <= self.thickness_to_chord <= 0.24:
                raise ValueError(
                    f"airfoil = {self.airfoil!r} is invalid: its thickness of {self.thickness_to_chord:.3f} chords must lie "
                    "between 0.06 and 0.24"
                )
            return self
        if not 6 <= int(self.airfoil[2:]) <= 24:
            raise ValueError(
                f"airfoil = {self.airfoil!r} is not allowed; its thickness (last two digits) must lie between 06 and 24"
            )
        if (self.airfoil[0] == "0") != (self.airfoil[1] == "0"):
            raise ValueError(
                f"airfoil = {self.airfoil!r} is not allowed; camber and its position (first two digits) must both be zero "
                "or both lie between 1 and 9"
            )
        return self


class Wing(LiftingSurface):
    """polar: trained polar of the section, by name or card with its path from the vehicle file; default: that of `airfoil`."""

    maximum_lift_factor: float = _between(0.5, 1.2)
    polar: str = ""

    @model_validator(mode="before")
    @classmethod
    def _finds_its_polar(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict) or not isinstance(data.get("polar"), str) or not data["polar"]:
            return data
        return data | {"polar": _beside(data["polar"], (info.context or {}).get("folder", Path()))}


class VerticalTail(_Table):
    area: float = _key("area_m2", 0.1, 50.0)
    aspect_ratio: float = _between(0.5, 6.0)
    taper: float = _between(0.1, 1.0)
    thickness_to_chord: float = _between(0.05, 0.25)
    root_quarter_chord: Point = Field(alias="root_quarter_chord_m")


class Fuselage(_Table):
    length: float = _key("length_m", 2.0, 40.0)
    height: float = _key("height_m", 0.5, 6.0)
    width: float = _key("width_m", 0.5, 6.0)
    nose: Point = Field(alias="nose_m")
    rear: Point = Field(alias="rear_m")


class Booms(_Table):
    diameter: float = _key("diameter_m", 0.05, 1.5)
    overhang: float = _key("overhang_m", 0.0, 3.0)


def _beside(name: str, folder: Path) -> str:
    """A card or coordinate file by its path from the vehicle file's folder; other names stay."""
    return str((folder / name).resolve()) if (folder / name).is_file() else name


class RotorSpecification(_Table):
    """One rotor: hub in m, blade chord (2 control points or more, m), twist (4 or more, rad), speed in rad/s."""

    name: Name
    kind: Literal["lift", "pusher"]
    hub: Point = Field(alias="hub_m")
    spin: Annotated[Literal[-1, 1], BeforeValidator(_not_a_truth_value)]
    radius: float = _key("radius_m", 0.2, 10.0)
    root_cutout: float = _between(0.05, 0.5)
    blades: int = _between(2, 8)
    chord: tuple[Annotated[float, _between(0.01, 2.0)], ...] = Field(
        alias="chord_m", min_length=2, max_length=CONTROL_POINTS
    )
    twist: tuple[_radians(-10.0, 90.0), ...] = Field(alias="twist_deg", min_length=4, max_length=CONTROL_POINTS)
    speed: _converted(lambda rpm: rpm * math.pi / 30.0, 50.0, 10000.0) = Field(alias="speed_rpm")
    airfoil: tuple[tuple[str, Annotated[float, _between(0.0, 1.0)]], ...] = (("naca4412", 1.0),)

    @model_validator(mode="before")
    @classmethod
    def _names_sections(cls, data: Any, info: ValidationInfo) -> Any:
        """One name, or [name, fraction of the radius] from the root to the tip; cards and files lie beside the vehicle file."""
        if not isinstance(data, dict) or not isinstance(data.get("airfoil"), str | list | tuple):
            return data
        folder, given = (info.context or {}).get("folder", Path()), data["airfoil"]
        pairs = [(given, 1.0)] if isinstance(given, str) else given

        def located(pair: Any) -> Any:
            is_pair = isinstance(pair, list | tuple) and len(pair) == 2 and isinstance(pair[0], str)
            return (_beside(pair[0], folder), pair[1]) if is_pair else pair

        return data | {"airfoil": tuple(located(pair) for pair in pairs)}

    @model_validator(mode="after")
    def _orders_its_sections(self) -> "RotorSpecification":
        fractions = [fraction for _, fraction in self.airfoil]
        if not fractions or sorted(set(fractions)) != fractions:
            raise ValueError(
                f"airfoil = {[list(pair) for pair in self.airfoil]} is invalid: it must name sections at increasing "
                "fractions of the radius"
            )
        return self


class Motors(_Table):
    dc_voltage: float = _key("dc_voltage_V", 48.0, 3000.0)
    gear_ratio: float = _between(1.0, 20.0)
    gear_efficiency: float = _between(0.5, 1.0)
    lift_bounds: Literal["hover_torque", "file"] = "hover_torque"
    lift_bore: float = _key("lift_bore_m", 0.1, 0.5)
    lift_length: float = _key("lift_length_m", 0.01, 0.5)
    pusher_bore: float = _key("pusher_bore_m", 0.1, 0.5)
    pusher_length: float = _key("pusher_length_m", 0.01, 0.5)


class Battery(_Table):
    mass: float = _key("mass_kg", 10.0, 10000.0)
    position: Point = Field(alias="position_m")
    specific_energy: _converted(lambda energy: energy * 3600.0, 50.0, 2000.0) = Field(alias="specific_energy_Wh_per_kg")
    discharge_efficiency: float = _between(0.5, 1.0)
    model: Literal["energy", "equivalent_circuit"] = "energy"
    minimum_cell_voltage: float = Field(2.5, alias="minimum_cell_voltage_V", ge=0.5, le=4.0, strict=True)
    maximum_discharge_rate: float = Field(5.0, alias="maximum_discharge_rate_per_h", ge=0.1, le=100.0, strict=True)


class Structure(_Table):
    source: Literal["published", "open", "nastran"]
    surrogate_file: str
    calibration_factor: float = _between(0.5, 3.0)
    is_calibrated_to_published: StrictBool
    outside_samples: Literal["flag", "warn", "error", "penalty"]

    @model_validator(mode="after")
    def _has_a_file_where_none_is_shipped(self) -> "Structure":
        if self.source == "nastran" and not self.surrogate_file:
            raise ValueError(
                "surrogate_file is empty; source 'nastran' needs the card that 'lpc-mdo train structures' wrote"
            )
        if self.source == "published" and self.surrogate_file:
            raise ValueError("surrogate_file is not allowed beside source 'published', which is shipped")
        return self


class FixedMass(_Table):
    name: Name
    mass: float = _key("mass_kg", 0.0, 5000.0)
    position: Point = Field(alias="position_m")


class DragArea(_Table):
    name: Name
    area: float = _key("area_m2", 0.0, 5.0)
    position: Point = Field(alias="position_m")


class StudyDrag(_Table):
    """One drag area for all but wing and horizontal tail, and where it acts."""

    area: float = _key("area_m2", 0.0, 10.0)
    position: Point = Field(alias="position_m")


class Drag(_Table):
    """source "build_up": wetted areas with these factors, and the rows of `areas`; "study": those of wing and tail, and `study`."""

    source: Literal["study", "build_up"]
    study: StudyDrag
    fuselage_interference: float = _between(0.8, 2.0)
    boom_interference: float = _between(0.8, 2.0)
    wing_interference: float = _between(0.8, 2.0)
    tail_interference: float = _between(0.8, 2.0)
    leakage_and_protuberance: float = _between(0.0, 0.5)
    areas: tuple[DragArea, ...] = Field(max_length=MOST_ITEMS)

    @model_validator(mode="after")
    def _has_distinct_areas(self) -> "Drag":
        taken = {"study", "fuselage", "booms", "wing", "horizontal_tail", "vertical_tail"}
        for i, area in enumerate(self.areas):
            if area.name in taken:
                raise ValueError(f"areas[{i}].name = {area.name!r} is not allowed; another item of drag has that name")
            taken.add(area.name)
        return self


class Bound(_Table):
    """Bounds of a design variable and why they stand where they do."""

    lower: float = Field(strict=True)
    upper: float = Field(strict=True)
    reason: str = Field(min_length=1)

    @model_validator(mode="after")
    def _is_a_range(self) -> "Bound":
        if self.lower > self.upper:
            raise ValueError(f"lower = {self.lower:g} is invalid: it must not exceed upper = {self.upper:g}")
        return self


def _bound(name: str, lower: float, upper: float, unit: float = 1.0) -> Any:
    """A bound whose ends lie between `lower` and `upper` in the file's unit and are kept in SI: times `unit`."""

    def checked(bound: Bound) -> Bound:
        for end in ("lower", "upper"):
            if not lower <= getattr(bound, end) <= upper:
                value = getattr(bound, end)
                raise ValueError(f"{end} = {value:g} is invalid: it must lie between {lower:g} and {upper:g}")
        return Bound(lower=unit * bound.lower, upper=unit * bound.upper, reason=bound.reason)

    return Annotated[Bound, AfterValidator(checked), Field(alias=name)]


_DEGREE, _RPM = math.pi / 180.0, math.pi / 30.0


class Bounds(_Table):
    """What an optimization may choose, in SI units; the file's values must lie within."""

    lift_rotor_radius: _bound("lift_rotor_radius_m", 0.2, 10.0)
    pusher_radius: _bound("pusher_radius_m", 0.2, 10.0)
    blade_twist: _bound("blade_twist_deg", -10.0, 90.0, _DEGREE)
    blade_chord: _bound("blade_chord_m", 0.005, 2.0)
    lift_motor_length: _bound("lift_motor_length_m", 0.01, 0.5)
    lift_motor_diameter: _bound("lift_motor_diameter_m", 0.05, 1.0)
    pusher_motor_length: _bound("pusher_motor_length_m", 0.01, 0.5)
    pusher_motor_diameter: _bound("pusher_motor_diameter_m", 0.05, 1.0)
    wing_area: _bound("wing_area_m2", 0.5, 100.0)
    wing_aspect_ratio: _bound("wing_aspect_ratio", 1.0, 30.0)
    wing_twist: _bound("wing_twist_deg", -30.0, 30.0, _DEGREE)
    tail_area: _bound("tail_area_m2", 0.1, 100.0)
    tail_aspect_ratio: _bound("tail_aspect_ratio", 0.5, 30.0)
    tail_position: _bound("tail_position_m", -50.0, 50.0)
    battery_mass: _bound("battery_mass_kg", 10.0, 10000.0)
    battery_position: _bound("battery_position_m", -50.0, 50.0)
    lift_rotor_speed: _bound("lift_rotor_speed_rpm", 50.0, 10000.0, _RPM)
    pusher_speed: _bound("pusher_speed_rpm", 50.0, 10000.0, _RPM)
    pitch: _bound("pitch_deg", -30.0, 30.0, _DEGREE)
    tail_deflection: _bound("tail_deflection_deg", -40.0, 40.0, _DEGREE)


class Vehicle(_Table):
    """The aircraft as the file describes it; the start of every optimization."""

    name: Name
    wing: Wing
    horizontal_tail: LiftingSurface
    vertical_tail: VerticalTail
    fuselage: Fuselage
    booms: Booms
    rotors: tuple[RotorSpecification, ...] = Field(max_length=LIFT_ROTOR_COUNTS[-1] + 1)
    motors: Motors
    battery: Battery
    structure: Structure
    fixed_masses: tuple[FixedMass, ...] = Field(min_length=1, max_length=MOST_ITEMS)
    drag: Drag
    bounds: Bounds

    @property
    def lift_rotors(self) -> tuple[RotorSpecification, ...]:
        return tuple(rotor for rotor in self.rotors if rotor.kind == "lift")

    @property
    def pusher(self) -> RotorSpecification:
        return self.rotors[-1]

    @model_validator(mode="after")
    def _is_lift_plus_cruise(self) -> "Vehicle":
        kinds = [rotor.kind for rotor in self.rotors]
        lift = kinds.count("lift")
        if kinds != ["lift"] * lift + ["pusher"] or lift not in LIFT_ROTOR_COUNTS:
            raise ValueError(
                f"rotors: {lift} lift and {kinds.count('pusher')} pusher rotors are not allowed; the file must list an even "
                f"number of lift rotors from {LIFT_ROTOR_COUNTS[0]} to {LIFT_ROTOR_COUNTS[-1]} and then one pusher"
            )
        names = [rotor.name for rotor in self.rotors]
        if len(set(names)) != len(names):
            raise ValueError("rotors: every rotor needs a name of its own")
        for key in ("chord", "twist"):
            counts = sorted({len(getattr(rotor, key)) for rotor in self.rotors})
            if len(counts) > 1:
                raise ValueError(
                    f"rotors: {key} with {counts[0]} and {counts[-1]} control points is not allowed; "
                    "all rotors must have as many"
                )
        mirror_pairs(self)
        booms(self)
        require_buildable(self)
        return self

    @model_validator(mode="after")
    def _starts_within_bounds(self) -> "Vehicle":
        """The file's values are the start of every optimization."""
        for place, value, name, unit in _starts(self):
            bound = getattr(self.bounds, name)
            if not bound.lower - 1e-12 <= value <= bound.upper + 1e-12:
                key = Bounds.model_fields[name].alias
                raise ValueError(
                    f"{place} = {value / unit:.6g} is invalid: bounds.{key} = {bound.lower / unit:.6g} to "
                    f"{bound.upper / unit:.6g} does not hold it; change either"
                )
        return self


def _starts(vehicle: Vehicle) -> Iterator[tuple[str, float, str, float]]:
    """Key, value in SI, its bound, and the file's unit in SI, of everything that an optimization starts from."""
    wing, tail, battery, motors = vehicle.wing, vehicle.horizontal_tail, vehicle.battery, vehicle.motors
    yield "wing.area_m2", wing.area, "wing_area", 1.0
    yield "wing.aspect_ratio", wing.aspect_ratio, "wing_aspect_ratio", 1.0
    yield "wing.incidence_deg", wing.incidence, "wing_twist", _DEGREE
    yield "horizontal_tail.area_m2", tail.area, "tail_area", 1.0
    yield "horizontal_tail.aspect_ratio", tail.aspect_ratio, "tail_aspect_ratio", 1.0
    yield "horizontal_tail.root_quarter_chord_m[0]", tail.root_quarter_chord[0], "tail_position", 1.0
    yield "battery.mass_kg", battery.mass, "battery_mass", 1.0
    yield "battery.position_m[0]", battery.position[0], "battery_position", 1.0
    for part in ("lift", "pusher"):
        yield f"motors.{part}_length_m", getattr(motors, f"{part}_length"), f"{part}_motor_length", 1.0
        yield f"motors.{part}_bore_m", getattr(motors, f"{part}_bore"), f"{part}_motor_diameter", 1.0
    for i, rotor in enumerate(vehicle.rotors):
        is_lift = rotor.kind == "lift"
        yield f"rotors[{i}].radius_m", rotor.radius, "lift_rotor_radius" if is_lift else "pusher_radius", 1.0
        yield f"rotors[{i}].speed_rpm", rotor.speed, "lift_rotor_speed" if is_lift else "pusher_speed", _RPM
        for k, chord in enumerate(rotor.chord):
            yield f"rotors[{i}].chord_m[{k}]", chord, "blade_chord", 1.0
        for k, twist in enumerate(rotor.twist):
            yield f"rotors[{i}].twist_deg[{k}]", twist, "blade_twist", _DEGREE


class Hover(_Table):
    altitude: float = _key("altitude_m", 0.0, 5000.0)
    duration: float = _key("duration_s", 1.0, 3600.0)


class Climb(_Table):
    """speed: m/s, None where the file says "cruise": then that of the cruise, whatever it is; the rate stays."""

    speed: Annotated[float | None, BeforeValidator(_none_at_cruise_speed)] = _key("speed_m_per_s", 20.0, 120.0)
    rate: float = _key("rate_m_per_s", 0.5, 15.0)


class Cruise(_Table):
    speed: float = _key("speed_m_per_s", 20.0, 120.0)
    altitude: float = _key("altitude_m", 100.0, 8000.0)
    distance: float = _key("distance_m", 1000.0, 1e6)


class Reserve(_Table):
    """Flown at cruise power over a distance, m, or for a time, s: one of the two, the other is None."""

    distance: float | None = Field(None, alias="distance_m", ge=0.0, le=1e6, strict=True)
    duration: float | None = Field(None, alias="duration_s", ge=0.0, le=1e5, strict=True)

    @model_validator(mode="after")
    def _is_one_of_both(self) -> "Reserve":
        if (self.distance is None) == (self.duration is None):
            has = "neither" if self.distance is None else "both"
            raise ValueError(f" has {has} of distance_m and duration_s; it must have one of them")
        return self


class Requirements(_Table):
    minimum_final_state_of_charge: float = _between(0.0, 0.9)
    stall_margin: float = _key("stall_margin_m_per_s", 0.0, 40.0)
    rotor_tip_clearance: float = _key("rotor_tip_clearance_m", 0.0, 2.0)
    maximum_sound_pressure_level: float = _key("maximum_sound_pressure_level_dba", 20.0, 140.0)
    observer_distance: float = _key("observer_distance_m", 10.0, 2000.0)
    observer_elevation: _radians(0.0, 90.0) = Field(alias="observer_elevation_deg")
    further_observer_elevations: tuple[_radians(0.0, 90.0), ...] = Field(
        (), alias="further_observer_elevations_deg", max_length=MOST_OBSERVERS
    )
    acoustic_convention: Annotated[
        Literal["per_band", "lsdo_acoustics_2023", "acoustics_2022"], BeforeValidator(_no_former_convention)
    ]
    tonal_model: Literal["steady_loading", "unsteady_loading"] = "steady_loading"
    broadband_model: Literal["schlegel_king_mull", "gill_lee", "brooks_pope_marcolini"] = "schlegel_king_mull"

    @model_validator(mode="after")
    def _has_few_observers(self) -> "Requirements":
        # All observers are heard in one batch with its derivatives: 5 MB each, 170 MB strip by strip.
        limit = 8 if self.broadband_model == "brooks_pope_marcolini" else 64
        if (count := len(self.further_observer_elevations)) > limit:
            raise ValueError(
                f"further_observer_elevations_deg has {count} values; "
                f"it may have at most {limit} with broadband_model = {self.broadband_model!r}"
            )
        return self


class Mission(_Table):
    """Segments and requirements in SI units."""

    flights: int = _between(1, 20)
    temperature_offset: float = _key("temperature_offset_K", -50.0, 50.0)
    rotor_inflow: Literal["axial", "inclined"] = "axial"
    hover: Hover
    climb: Climb
    cruise: Cruise
    reserve: Reserve
    requirements: Requirements

    @model_validator(mode="after")
    def _is_flyable(self) -> "Mission":
        if self.cruise.altitude <= self.hover.altitude:
            raise ValueError(
                f"cruise.altitude_m = {self.cruise.altitude:g} is not allowed; "
                f"it must exceed hover.altitude_m = {self.hover.altitude:g}"
            )
        if self.cruise.distance <= self.climb_distance:
            raise ValueError(
                f"cruise.distance_m = {self.cruise.distance:g} is not allowed; "
                f"it includes the climb and must exceed its {self.climb_distance:.0f} m"
            )
        return self

    @property
    def climb_speed(self) -> float:
        """m/s, the cruise speed where the climb follows it."""
        return self.cruise.speed if self.climb.speed is None else self.climb.speed

    @property
    def climb_path_angle(self) -> float:
        """rad."""
        return math.asin(self.climb.rate / self.climb_speed)

    @property
    def climb_distance(self) -> float:
        """Ground covered from hover to cruise altitude, m."""
        time = (self.cruise.altitude - self.hover.altitude) / self.climb.rate
        return time * (self.climb_speed**2 - self.climb.rate**2) ** 0.5


def _line_of(text: str, location: tuple[int | str, ...]) -> int | None:
    """Line of the key at `location` in a TOML text, where one can be found."""
    table: list[int | str] = []
    counts: dict[str, int] = {}
    found = None
    for number, line in enumerate(text.splitlines(), start=1):
        if header := re.match(r"\s*(\[\[?)\s*([\w.]+)\s*\]", line):
            name = header[2]
            table = list(name.split("."))
            if header[1] == "[[":
                table.append(counts.get(name, 0))
                counts[name] = counts.get(name, 0) + 1
            if found is None and location and tuple(table[: len(location)]) == location:
                found = number
        elif (entry := re.match(r"\s*([\w]+)\s*=", line)) and (*table, entry[1]) == location[: len(table) + 1]:
            return number
    return found


def _sentence(model: type[BaseModel], error: Mapping[str, Any], file: str, text: str, overridden: Iterable[str]) -> str:
    """One clear sentence for one pydantic error: file or option, place, value, rule, line."""
    name, what = fault(model, error)
    return _located(name, what, file, text, overridden, is_missing=error["type"] == "missing")


def _located(name: str, what: str, file: str, text: str, overridden: Iterable[str], *, is_missing: bool = False) -> str:
    """The sentence on the key `name`: with the option that set it, or the file and the line where it stands."""
    location = tuple(int(part) if part.isdecimal() else part for part in re.findall(r"[^.\[\]]+", name))
    path = ".".join(str(part) for part in location)
    for override in overridden:
        changed = override.partition("=")[0].partition(".")[2] + "."
        if f"{path}.".startswith(changed) or (len(location) > 1 and changed.startswith(f"{path}.")):
            return f"--set {override}: {name}{what}."
    line = _line_of(text, location[:-1] if is_missing else location)
    return f"{file}: {name}{what}{f' (line {line})' if line else ''}."


def _validate(
    model: type[BaseModel],
    data: Mapping[str, Any],
    file: str,
    text: str,
    overridden: Iterable[str] = (),
    folder: Path = Path(),
) -> Any:
    try:
        return model.model_validate(data, context={"folder": folder})
    except ValidationError as error:
        faults = telling(error.errors())[:5]
        raise ConfigurationError("\n".join(_sentence(model, e, file, text, overridden) for e in faults)) from None


ALTERNATIVES = {
    "mission.reserve.distance_m": "duration_s",
    "mission.reserve.duration_s": "distance_m",
}
"""Keys of which a file has one: an override that gives one takes the place of the other."""


def _apply(data: dict[str, Any], path: str, value: str) -> None:
    """Replace one value of a parsed file; only keys that the file has or could have in another's place, no tables."""
    *parents, last = path.split(".")
    node: Any = data
    for part in (*parents, last):
        if isinstance(node, dict) and part == last and part not in node and ALTERNATIVES.get(path) in node:
            node[part] = node.pop(ALTERNATIVES[path])
        is_list = isinstance(node, list)
        if is_list and not (part.isascii() and part.isdecimal() and int(part) < len(node)):
            raise ConfigurationError(f"--set {path}={value}: {part!r} is not an index from 0 to {len(node) - 1}.")
        if not is_list and (not isinstance(node, dict) or part not in node):
            keys = f"; it must be one of {', '.join(node)}" if isinstance(node, dict) else ""
            raise ConfigurationError(f"--set {path}={value}: {part!r} is not a known key{keys}.")
        parent, key = node, int(part) if is_list else part
        node = node[key]
    if isinstance(node, dict):
        raise ConfigurationError(f"--set {path}={value}: {path} is a table; name one of its keys: {', '.join(node)}.")
    parent[key] = _parsed(path, value, is_text=isinstance(node, str))


def _parsed(path: str, value: str, is_text: bool) -> Any:
    """The value as TOML reads it; text needs no quotes."""
    try:
        parsed = parse_toml(f"value = {value}", "--set")
    except ConfigurationError:
        parsed = {}
    if (is_text or value == CRUISE) and not isinstance(parsed.get("value"), str | list):
        return value
    if parsed.keys() != {"value"}:
        raise ConfigurationError(f"--set {path}={value}: {value!r} is not a number.")
    return parsed["value"]


def _read(path: Path | None, default: str) -> tuple[dict[str, Any], str, str]:
    if path is None:
        text = resources.files("lpc_mdo.data").joinpath(default).read_text(encoding="utf-8")
        return parse_toml(text, default), default, text
    content, text = read_toml(path)
    return content, str(path), text


def load(
    vehicle: Path | str | None = None, mission: Path | str | None = None, overrides: Iterable[str] = ()
) -> tuple[Vehicle, Mission]:
    """Vehicle and mission from their files, or the shipped baseline where a path is None.

    `overrides` are KEY=VALUE strings, e.g. "vehicle.wing.area_m2=18" or "mission.cruise.speed_m_per_s=60".
    Raises ConfigurationError with one sentence per fault: file, key, value, rule, line.
    """
    data, names, texts = {}, {}, {}
    for kind, path in (("vehicle", vehicle), ("mission", mission)):
        data[kind], names[kind], texts[kind] = _read(None if path is None else Path(path), f"{kind}.toml")
    of_kind: dict[str, list[str]] = {kind: [] for kind in data}
    for override in overrides:
        key, separator, value = override.partition("=")
        if not separator or not key or not value:
            raise ConfigurationError(f"--set {override}: must read KEY=VALUE, e.g. vehicle.wing.area_m2=18.")
        if key.split(".")[0] not in data:
            raise ConfigurationError(f"--set {override}: the key must start with 'vehicle.' or 'mission.'.")
        _apply(data, key, value)
        of_kind[key.split(".")[0]].insert(0, override)
    folder = Path() if vehicle is None else Path(vehicle).parent
    return (
        _validate(Vehicle, data["vehicle"], names["vehicle"], texts["vehicle"], of_kind["vehicle"], folder),
        _validate(Mission, data["mission"], names["mission"], texts["mission"], of_kind["mission"]),
    )


def baseline() -> tuple[Vehicle, Mission]:
    """The shipped Lift+Cruise vehicle and mission."""
    return load()
