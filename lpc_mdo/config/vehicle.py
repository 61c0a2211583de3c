"""The vehicle file."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, StrictBool, model_validator

from lpc_mdo.config.bounds import DEGREE, RPM, Bounds
from lpc_mdo.config.layout import booms, mirror_pairs
from lpc_mdo.config.layout_checks import require_buildable
from lpc_mdo.config.rotors import LIFT_ROTOR_COUNTS, MOST_PUSHERS, RotorSpecification
from lpc_mdo.config.surfaces import LiftingSurface, VerticalTail, Wing
from lpc_mdo.config.tables import FROM_WATT_HOURS, MOST_ITEMS, Name, Point, Table, between, key


class Fuselage(Table):
    length: float = key("length_m", 2.0, 40.0)
    height: float = key("height_m", 0.5, 6.0)
    width: float = key("width_m", 0.5, 6.0)
    nose: Point = Field(alias="nose_m")
    rear: Point = Field(alias="rear_m")


class Booms(Table):
    diameter: float = key("diameter_m", 0.05, 1.5)
    overhang: float = key("overhang_m", 0.0, 3.0)


class Motors(Table):
    dc_voltage: float = key("dc_voltage_V", 48.0, 3000.0)
    gear_ratio: float = between(1.0, 20.0)
    gear_efficiency: float = between(0.5, 1.0)
    lift_bounds: Literal["hover_torque", "file"] = "hover_torque"
    lift_bore: float = key("lift_bore_m", 0.1, 0.5)
    lift_length: float = key("lift_length_m", 0.01, 0.5)
    pusher_bore: float = key("pusher_bore_m", 0.1, 0.5)
    pusher_length: float = key("pusher_length_m", 0.01, 0.5)


class Battery(Table):
    mass: float = key("mass_kg", 10.0, 10000.0)
    position: Point = Field(alias="position_m")
    specific_energy: Annotated[float, between(50.0, 2000.0), FROM_WATT_HOURS] = Field(alias="specific_energy_Wh_per_kg")
    discharge_efficiency: float = between(0.5, 1.0)
    model: Literal["energy", "equivalent_circuit"] = "energy"
    minimum_cell_voltage: float = Field(2.5, alias="minimum_cell_voltage_V", ge=0.5, le=4.0, strict=True)
    maximum_discharge_rate: float = Field(5.0, alias="maximum_discharge_rate_per_h", ge=0.1, le=100.0, strict=True)


class Structure(Table):
    source: Literal["published", "open", "nastran"]
    surrogate_file: str
    calibration_factor: float = between(0.5, 3.0)
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


class FixedMass(Table):
    name: Name
    mass: float = key("mass_kg", 0.0, 5000.0)
    position: Point = Field(alias="position_m")


class DragArea(Table):
    name: Name
    area: float = key("area_m2", 0.0, 5.0)
    position: Point = Field(alias="position_m")


class StudyDrag(Table):
    """One drag area for all but wing and horizontal tail, and where it acts."""

    area: float = key("area_m2", 0.0, 10.0)
    position: Point = Field(alias="position_m")


class Drag(Table):
    """source "build_up": wetted areas with these factors, and the rows of `areas`; "study": those of wing and tail, and `study`."""

    source: Literal["study", "build_up"]
    study: StudyDrag
    fuselage_interference: float = between(0.8, 2.0)
    boom_interference: float = between(0.8, 2.0)
    wing_interference: float = between(0.8, 2.0)
    tail_interference: float = between(0.8, 2.0)
    leakage_and_protuberance: float = between(0.0, 0.5)
    areas: tuple[DragArea, ...] = Field(max_length=MOST_ITEMS)

    @model_validator(mode="after")
    def _has_distinct_areas(self) -> "Drag":
        taken = {"study", "fuselage", "booms", "wing", "horizontal_tail", "vertical_tail"}
        for i, area in enumerate(self.areas):
            if area.name in taken:
                raise ValueError(f"areas[{i}].name = {area.name!r} is not allowed; another item of drag has that name")
            taken.add(area.name)
        return self


class Vehicle(Table):
    """The aircraft as the file describes it; the start of every optimization."""

    name: Name
    wing: Wing
    horizontal_tail: LiftingSurface
    vertical_tail: VerticalTail
    fuselage: Fuselage
    booms: Booms
    rotors: tuple[RotorSpecification, ...] = Field(max_length=LIFT_ROTOR_COUNTS[-1] + MOST_PUSHERS)
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
    def pushers(self) -> tuple[RotorSpecification, ...]:
        return tuple(rotor for rotor in self.rotors if rotor.kind == "pusher")

    @property
    def groups(self) -> dict[str, tuple[int, ...]]:
        """Indices of the rotors of each group."""
        found: dict[str, tuple[int, ...]] = {}
        for i, rotor in enumerate(self.rotors):
            found[rotor.group] = (*found.get(rotor.group, ()), i)
        return found

    @model_validator(mode="after")
    def _is_lift_plus_cruise(self) -> "Vehicle":
        kinds = [rotor.kind for rotor in self.rotors]
        lift, pushers = kinds.count("lift"), kinds.count("pusher")
        is_ordered = kinds == ["lift"] * lift + ["pusher"] * pushers
        if not is_ordered or lift not in LIFT_ROTOR_COUNTS or not 1 <= pushers <= MOST_PUSHERS:
            raise ValueError(
                f"rotors: {lift} lift and {pushers} pusher rotors are not allowed; the file must list an even number of lift "
                f"rotors from {LIFT_ROTOR_COUNTS[0]} to {LIFT_ROTOR_COUNTS[-1]} and then one pusher, or up to {MOST_PUSHERS}"
            )
        for group, members in self.groups.items():
            of_group = {kinds[i] for i in members}
            if len(of_group | ({group} & set(kinds))) > 1:
                raise ValueError(f"rotors: group {group!r} is invalid: its rotors must be of one kind")
        names = [rotor.name for rotor in self.rotors]
        if len(set(names)) != len(names):
            raise ValueError("rotors: every rotor needs a name of its own")
        for field in ("chord", "twist"):
            counts = sorted({len(getattr(rotor, field)) for rotor in self.rotors})
            if len(counts) > 1:
                raise ValueError(
                    f"rotors: {field} with {counts[0]} and {counts[-1]} control points is not allowed; "
                    "all rotors must have as many"
                )
        mirror_pairs(self)
        booms(self)
        require_buildable(self)
        return self

    @model_validator(mode="after")
    def _starts_within_bounds(self) -> "Vehicle":
        """The file's values are the start of every optimization."""
        for place, value, name, unit in starts(self):
            bound = getattr(self.bounds, name)
            if not bound.lower - 1e-12 <= value <= bound.upper + 1e-12:
                key = Bounds.model_fields[name].alias
                raise ValueError(
                    f"{place} = {value / unit:.6g} is invalid: it must lie between {bound.lower / unit:.6g} and "
                    f"{bound.upper / unit:.6g}, bounds.{key}; change either"
                )
        return self


def starts(vehicle: Vehicle) -> Iterator[tuple[str, float, str, float]]:
    """Key, value in SI, its bound, and the file's unit in SI, of everything that an optimization starts from."""
    wing, tail, battery, motors = vehicle.wing, vehicle.horizontal_tail, vehicle.battery, vehicle.motors
    yield "wing.area_m2", wing.area, "wing_area", 1.0
    yield "wing.aspect_ratio", wing.aspect_ratio, "wing_aspect_ratio", 1.0
    yield "wing.incidence_deg", wing.incidence, "wing_twist", DEGREE
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
        yield f"rotors[{i}].speed_rpm", rotor.speed, "lift_rotor_speed" if is_lift else "pusher_speed", RPM
        for k, chord in enumerate(rotor.chord):
            yield f"rotors[{i}].chord_m[{k}]", chord, "blade_chord", 1.0
        for k, twist in enumerate(rotor.twist):
            yield f"rotors[{i}].twist_deg[{k}]", twist, "blade_twist", DEGREE
