"""The mission file."""

import math
from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from lpc_mdo.config.segments import AnySegment, Segment
from lpc_mdo.config.tables import FROM_DEGREES, Identifier, Table, between, key
from lpc_mdo.numerics.present import present


def _no_former_convention(value: object) -> object:
    if value == "paper":
        raise ValueError(
            ' = "paper" is invalid: write "lsdo_acoustics_2023", the code after the paper that it stood for'
        )
    return value


MOST_SEGMENTS = 60  # of a mission: each is a point of the lattice, with variables and rows of its own
NONE: Mapping[str, Any] = MappingProxyType({})
MOST_OBSERVERS = 91  # one a degree; each takes 4 MB a design


class Reserve(Table):
    """Flown as `segment`, by default the last cruise, over a distance, m, or for a time, s: one of the two, the other is None."""

    segment: str = Field("", max_length=40)
    distance: float | None = Field(None, alias="distance_m", ge=0.0, le=1e6, strict=True)
    duration: float | None = Field(None, alias="duration_s", ge=0.0, le=1e5, strict=True)

    @model_validator(mode="after")
    def _is_one_of_both(self) -> "Reserve":
        if (self.distance is None) == (self.duration is None):
            has = "neither" if self.distance is None else "both"
            raise ValueError(f" has {has} of distance_m and duration_s; it must have one of them")
        return self


class Requirements(Table):
    """noise_segment: whose noise is limited; default: the first on lift rotors. torque_segments: those in which every motor must
    give its torque; default: all. torque_margin: share of the largest torque that stays free there. Limits that are None have no row."""

    noise_segment: str = Field("", max_length=40)
    minimum_final_state_of_charge: float = between(0.0, 0.9)
    stall_margin: float = key("stall_margin_m_per_s", 0.0, 40.0)
    rotor_tip_clearance: float = key("rotor_tip_clearance_m", 0.0, 2.0)
    maximum_sound_pressure_level: float = key("maximum_sound_pressure_level_dba", 20.0, 140.0)
    observer_distance: float = key("observer_distance_m", 10.0, 2000.0)
    observer_elevation: Annotated[float, between(0.0, 90.0), FROM_DEGREES] = Field(alias="observer_elevation_deg")
    further_observer_elevations: tuple[Annotated[float, between(0.0, 90.0), FROM_DEGREES], ...] = Field(
        (), alias="further_observer_elevations_deg", max_length=MOST_OBSERVERS
    )
    torque_segments: tuple[Identifier, ...] | None = Field(None, max_length=MOST_SEGMENTS)
    torque_margin: float = Field(0.0, ge=0.0, le=0.9, strict=True)
    maximum_tip_mach: float | None = Field(None, ge=0.1, le=1.0, strict=True)
    maximum_blade_angle_of_attack: Annotated[float, between(1.0, 30.0), FROM_DEGREES] | None = Field(
        None, alias="maximum_blade_angle_of_attack_deg"
    )
    maximum_blade_loading: float | None = Field(None, ge=0.01, le=0.3, strict=True)
    fuselage_clearance: float | None = Field(None, alias="fuselage_clearance_m", ge=0.0, le=5.0, strict=True)
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


class Mission(Table):
    """Segments in flown order, and those that are sized for but not flown; requirements; SI units.

    order: names as one flight flies them; default: all segments as the file lists them. A segment that is not in it has to be
    trimmed and powered, and takes no time.
    """

    flights: int = between(1, 20)
    order: tuple[Identifier, ...] = Field((), max_length=MOST_SEGMENTS)
    temperature_offset: float = key("temperature_offset_K", -50.0, 50.0)
    rotor_inflow: Literal["axial", "inclined"] = "axial"
    segments: tuple[AnySegment, ...] = Field(min_length=2, max_length=MOST_SEGMENTS)
    reserve: Reserve
    requirements: Requirements

    @model_validator(mode="after")
    def _names_its_segments(self) -> "Mission":
        names = [segment.name for segment in self.segments]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise ValueError(f"segments[{i}].name = {name!r} is invalid: another segment has that name")
        flyable = [segment.name for segment in self.segments if segment.is_always_flown]
        for i, name in enumerate(self.order):
            if name not in flyable:
                raise ValueError(
                    f"order[{i}] = {name!r} is invalid: it must be the name of a segment that is flown, one of {', '.join(flyable)}"
                )
        for is_wingborne, words in ((False, "on lift rotors, e.g. a hover"), (True, "on the wing, e.g. a cruise")):
            if not any(segment.is_wingborne is is_wingborne and segment.is_steady for segment in self.segments):
                raise ValueError(f"segments is invalid: at least one must be flown {words}")
        for i, segment in enumerate(self.segments):
            speed = segment.flight_speed
            if isinstance(speed, str) and not (speed in names and isinstance(self.segment(speed).flight_speed, float)):
                raise ValueError(
                    f"segments[{i}].speed_m_per_s = {speed!r} is invalid: it must be a number, or the name of a segment with one"
                )
        for key_, name, is_wingborne in (
            ("reserve.segment", self.reserve.segment, True),
            ("requirements.noise_segment", self.requirements.noise_segment, False),
        ):
            choices = [
                segment.name
                for segment in self.segments
                if segment.is_wingborne is is_wingborne and segment.is_steady and segment.level_altitude is not None
            ]
            if name and name not in choices:
                raise ValueError(f"{key_} = {name!r} is invalid: it must be one of {', '.join(choices)}")
        for i, name in enumerate(self.requirements.torque_segments or ()):
            if name not in names:
                raise ValueError(
                    f"requirements.torque_segments[{i}] = {name!r} is invalid: it must be one of {', '.join(names)}"
                )
        return self

    @model_validator(mode="after")
    def _is_flyable(self) -> "Mission":
        names = [segment.name for segment in self.segments]
        for i, segment in enumerate(self.segments):
            flown = self.flown.count(segment.name)
            leads = segment.level_altitude is None
            if leads and flown != 1:
                raise ValueError(
                    f"segments[{i}].name = {segment.name!r} is invalid: a {segment.kind} must be flown once a flight, "
                    f"and order holds it {flown} times"
                )
            if segment.given_distance is not None and flown > 1:
                raise ValueError(
                    f"order holds {segment.name!r} {flown} times: a segment with a distance may be flown once a flight"
                )
        for name in self.flown:
            i, segment = names.index(name), self.segment(name)
            if segment.level_altitude is None:
                self._require_way(i, segment)
        for i, segment in enumerate(self.segments):
            if segment.given_distance is not None and segment.name in self.flown:
                covered = sum(self.ground_distance(name) for name in self.credited(segment.name))
                if segment.given_distance <= covered:
                    raise ValueError(
                        f"segments[{i}].distance_m = {segment.given_distance:g} is invalid: it includes climb and descent "
                        f"and must exceed their {covered:.0f} m"
                    )
        return self

    def _require_way(self, i: int, segment: AnySegment) -> None:
        """A climb must gain altitude, a descent lose some; both need a segment before, and to know where they end."""
        before, after = self.before(segment.name), self.after(segment.name)
        where = f"segments[{i}].name = {segment.name!r} is invalid: a {segment.kind}"
        if before is None:
            raise ValueError(f"{where} must not be the first segment of a flight")
        if segment.given_end_altitude is None and (after is None or after.level_altitude is None):
            raise ValueError(f"{where} needs end_altitude_m where no level segment follows")
        if segment.given_end_altitude is not None and after is not None and after.is_altitude_free:
            raise ValueError(f"{where} must not have end_altitude_m: it ends at the altitude of {after.name!r}")
        start, end = self.altitudes(segment.name)
        speed = self.speed(segment.name)
        if (end - start) * segment.vertical_rate <= 0.0:
            word, key_ = "exceed" if segment.vertical_rate > 0.0 else "be below", f"segments[{i}].end_altitude_m"
            if segment.given_end_altitude is None and after is not None:
                key_ = f"segments[{self.index(after.name)}].altitude_m"
            raise ValueError(f"{key_} = {end:g} is invalid: it must {word} {start:g} m, where {segment.name!r} begins")
        if abs(segment.vertical_rate) >= speed:
            raise ValueError(f"{where} must be slower upwards than along its path")

    @property
    def flown(self) -> tuple[str, ...]:
        """Names in the order of one flight."""
        return self.order or tuple(segment.name for segment in self.segments if segment.is_always_flown)

    def expanded(self, rotors: Sequence[tuple[str, str]]) -> "Mission":
        """The mission with every segment as the steady points that it stands for; rotors: name and group of those that mirror none.

        Raises ValueError where two points would have one name.
        """
        points = {segment.name: segment.points(rotors) for segment in self.segments}
        names = [point.name for of in points.values() for point in of]
        if twice := [name for i, name in enumerate(names) if name in names[:i]]:
            raise ValueError(f"segments: {twice[0]!r} is the name of two segments or of their points")

        def of(wholes: Iterable[str]) -> tuple[str, ...]:
            return tuple(point.name for whole in wholes for point in points[whole])

        requirements = self.requirements.model_copy(update={"torque_segments": of(self.torque_segments)})
        segments = tuple(point for of in points.values() for point in of)
        return self.model_copy(update={"segments": segments, "order": of(self.flown), "requirements": requirements})

    def segment(self, name: str) -> AnySegment:
        """Raises KeyError for a name that no segment has."""
        for segment in self.segments:
            if segment.name == name:
                return segment
        raise KeyError(name)

    def index(self, name: str) -> int:
        """Place of a segment in the file."""
        return [segment.name for segment in self.segments].index(name)

    def before(self, name: str) -> Segment | None:
        """The segment flown before this one, first time that it is flown."""
        i = self.flown.index(name)
        return self.segment(self.flown[i - 1]) if i else None

    def after(self, name: str) -> Segment | None:
        """The segment flown after this one."""
        i = self.flown.index(name)
        return self.segment(self.flown[i + 1]) if i + 1 < len(self.flown) else None

    def credited(self, name: str) -> tuple[str, ...]:
        """Climbs and descents whose ground counts in the distance of this segment: climbs in that of the next segment with a
        distance, descents in that of the one before."""
        with_distance = [k for k, other in enumerate(self.flown) if self.segment(other).given_distance is not None]
        found = []
        for k, other in enumerate(self.flown):
            if self.segment(other).level_altitude is not None:
                continue
            later, earlier = [i for i in with_distance if i > k], [i for i in with_distance if i < k]
            is_climb = self.segment(other).vertical_rate > 0.0
            nearest = (later[:1] or earlier[-1:]) if is_climb else (earlier[-1:] or later[:1])
            if nearest and self.flown[nearest[0]] == name:
                found.append(other)
        return tuple(found)

    def speed(self, name: str, chosen: Mapping[str, Any] = NONE) -> Any:
        """m/s along the path: that of the file, or of `chosen` where it names the segment; that of another where it follows it."""
        speed = self.segment(name).flight_speed
        return self.speed(speed, chosen) if isinstance(speed, str) else chosen.get(name, speed)

    def altitudes(self, name: str, levels: Mapping[str, Any] = NONE, ends: Mapping[str, Any] = NONE) -> tuple[Any, Any]:
        """m at the begin and the end of a segment: those of the file or, by the segments' names, of level flight in `levels` and
        at the end of climbs in `ends`."""
        segment = self.segment(name)
        if segment.level_altitude is not None:
            altitude = levels.get(name, segment.level_altitude)
            return altitude, altitude
        before = present(self.before(name), f"the segment before {name!r}")
        start, end = self.altitudes(before.name, levels, ends)[1], ends.get(name, segment.given_end_altitude)
        if end is None:
            end = self.altitudes(present(self.after(name), f"the segment after {name!r}").name, levels, ends)[0]
        return start, end

    def ground_distance(self, name: str) -> float:
        """m over the ground along a climb or descent."""
        start, end = self.altitudes(name)
        rate, speed = self.segment(name).vertical_rate, float(self.speed(name))
        return float(end - start) / rate * math.sqrt(speed**2 - rate**2)

    def path_angle(self, name: str) -> float:
        """rad, as the file has it."""
        return math.asin(self.segment(name).vertical_rate / self.speed(name))

    @property
    def noise_segment(self) -> Segment:
        """Whose noise the requirements limit."""
        hovering = next(segment for segment in self.segments if not segment.is_wingborne and segment.is_steady)
        return self.segment(self.requirements.noise_segment) if self.requirements.noise_segment else hovering

    @property
    def torque_segments(self) -> tuple[str, ...]:
        """Names of those in which every motor must give its torque."""
        given = self.requirements.torque_segments
        return tuple(segment.name for segment in self.segments) if given is None else given

    @property
    def main_segment(self) -> Segment:
        """That of the reserve: the last one with a distance, else the last level one on the wing, unless the file names it."""
        if self.reserve.segment:
            return self.segment(self.reserve.segment)
        wingborne = [segment for segment in self.segments if segment.is_wingborne and segment.is_steady]
        level = [segment for segment in wingborne if segment.level_altitude is not None]
        with_distance = [segment for segment in level if segment.given_distance is not None]
        return (with_distance or level or wingborne)[-1]
