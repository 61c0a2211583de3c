"""The table of operating points: an aircraft and a mission expanded once. What stands where in a tensor is known here alone."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import torch
from torch import Tensor

from lpc_mdo.config import Mission, Vehicle
from lpc_mdo.config.layout import own_rotors
from lpc_mdo.config.segments import Segment


@dataclass(frozen=True)
class Point:
    """One rotor in one segment, by their indices in the files."""

    rotor: int
    segment: int


@dataclass(frozen=True)
class Schedule:
    """Segments and rotor points of an aircraft on a mission.

    names: segments that are evaluated, in the file's order; default: all. is_mirrored: starboard rotors work as their port twins,
    whose points then serve for both. Dimensions that the model's tensors have: `segment`, all of them; `wingborne`, those flown on
    the wing; `point`, a rotor in a segment, segment by segment; `solved`, points that are evaluated.
    """

    vehicle: Vehicle
    file_mission: Mission
    names: tuple[str, ...] = ()
    is_mirrored: bool = False

    @cached_property
    def mission(self) -> Mission:
        """The mission whose segments are steady points."""
        own, _ = own_rotors(self.vehicle)
        return self.file_mission.expanded([(self.vehicle.rotors[i].name, self.vehicle.rotors[i].group) for i in own])

    @cached_property
    def segments(self) -> tuple[Segment, ...]:
        return tuple(s for s in self.mission.segments if not self.names or s.name in self.names)

    @cached_property
    def segment_names(self) -> tuple[str, ...]:
        return tuple(segment.name for segment in self.segments)

    def segment_index(self, name: str) -> int:
        """Place along `segment`. Raises KeyError for a segment that there is not."""
        if name not in self.segment_names:
            raise KeyError(f"{name!r} is no segment; there are {', '.join(self.segment_names)}")
        return self.segment_names.index(name)

    @cached_property
    def wingborne_names(self) -> tuple[str, ...]:
        return tuple(segment.name for segment in self.segments if segment.is_wingborne)

    @cached_property
    def wingborne(self) -> Tensor:
        """(wingborne,) places along `segment`."""
        return _indices(i for i, segment in enumerate(self.segments) if segment.is_wingborne)

    def wingborne_index(self, name: str) -> int:
        """Place along `wingborne`. Raises KeyError for a segment that is not flown on the wing."""
        if name not in self.wingborne_names:
            raise KeyError(f"{name!r} is not flown on the wing; {', '.join(self.wingborne_names)} are")
        return self.wingborne_names.index(name)

    @cached_property
    def points(self) -> tuple[Point, ...]:
        groups, names = self.vehicle.groups, [rotor.name for rotor in self.vehicle.rotors]
        return tuple(
            Point(rotor, i)
            for i, segment in enumerate(self.segments)
            for rotor in sorted(rotor for group in segment.groups for rotor in groups[group])
            if names[rotor] != segment.inoperative_rotor
        )

    @cached_property
    def point_names(self) -> tuple[tuple[str, str], ...]:
        """Rotor and segment of each point."""
        rotors = self.vehicle.rotors
        return tuple((rotors[point.rotor].name, self.segment_names[point.segment]) for point in self.points)

    def point_index(self, rotor: str, segment: str) -> int:
        """Place along `point`. Raises KeyError for a rotor that does not turn there."""
        if (rotor, segment) not in self.point_names:
            raise KeyError(f"{rotor!r} does not turn in {segment!r}")
        return self.point_names.index((rotor, segment))

    @cached_property
    def rotor(self) -> Tensor:
        """(point,) rotor of each point."""
        return _indices(point.rotor for point in self.points)

    @cached_property
    def segment(self) -> Tensor:
        """(point,) place along `segment` of each point."""
        return _indices(point.segment for point in self.points)

    @cached_property
    def is_propelling(self) -> Tensor:
        """(point,) bool: of a rotor whose axis lies along the flight; its efficiency is the propulsive one, else the figure of merit."""
        return torch.tensor([self.vehicle.rotors[point.rotor].kind == "pusher" for point in self.points])

    def of_group(self, group: str) -> list[int]:
        """Places along `point` of a group's points: the order of its block of speeds."""
        members = self.vehicle.groups[group]
        return [k for k, point in enumerate(self.points) if point.rotor in members]

    def in_segment(self, name: str) -> list[int]:
        """Places along `point`."""
        i = self.segment_index(name)
        return [k for k, point in enumerate(self.points) if point.segment == i]

    def is_symmetric(self, point: Point) -> bool:
        """Whether a mirrored rotor does there what its twin does."""
        return not self.segments[point.segment].inoperative_rotor

    @cached_property
    def own_points(self) -> tuple[int, ...]:
        """Places along `point` of those that are no mirror image of another."""
        own, _ = own_rotors(self.vehicle)
        return tuple(k for k, p in enumerate(self.points) if p.rotor in own or not self.is_symmetric(p))

    @cached_property
    def is_edgewise(self) -> Tensor:
        """(point,) bool: of a lift rotor that turns in flight on the wing."""
        return torch.tensor(
            [
                self.vehicle.rotors[point.rotor].kind == "lift" and self.segments[point.segment].is_wingborne
                for point in self.points
            ]
        )

    @cached_property
    def _own(self) -> tuple[list[int], list[int]]:
        """Places along `point` of the solved points, and for every point its place along `solved`."""
        if not self.is_mirrored:
            everything = list(range(len(self.points)))
            return everything, everything
        own, place = own_rotors(self.vehicle)
        stands_for = [
            Point(own[place[point.rotor]], point.segment) if self.is_symmetric(point) else point
            for point in self.points
        ]
        solved = [k for k, point in enumerate(self.points) if stands_for[k] == point]
        of_point = {self.points[k]: i for i, k in enumerate(solved)}
        return solved, [of_point[point] for point in stands_for]

    @cached_property
    def solved(self) -> Tensor:
        """(solved,) places along `point`."""
        return _indices(self._own[0])

    @cached_property
    def place(self) -> Tensor:
        """(point,) places along `solved`."""
        return _indices(self._own[1])

    @cached_property
    def solved_rotor(self) -> Tensor:
        """(solved,) rotor of each solved point."""
        return self.rotor[self.solved]

    @cached_property
    def solved_segment(self) -> Tensor:
        """(solved,) place along `segment` of each solved point."""
        return self.segment[self.solved]

    @cached_property
    def multiplicity(self) -> Tensor:
        """(solved,) points that each solved one stands for."""
        return torch.bincount(self.place, minlength=len(self.solved)).double()

    @cached_property
    def speed_groups(self) -> tuple[str, ...]:
        """Groups that turn, in the order of the vehicle file: each has a block of speeds, one a point."""
        turning = {group for segment in self.segments for group in segment.groups}
        return tuple(group for group in self.vehicle.groups if group in turning)

    @cached_property
    def speed_order(self) -> Tensor:
        """(point,) places along the blocks of speeds of all groups, one after another."""
        order = [k for group in self.speed_groups for k in self.of_group(group)]
        return torch.argsort(_indices(order))

    @cached_property
    def flown(self) -> Tensor:
        """Places along `segment` of all that is flown: the flights one after another, then the reserve."""
        one = [self.segment_index(name) for name in self.mission.flown]
        return _indices(one * self.mission.flights + [self.segment_index(self.mission.main_segment.name)])

    @cached_property
    def sums(self) -> Tensor:
        """(segment, point) ones where a point belongs to a segment."""
        return torch.nn.functional.one_hot(self.segment, len(self.segments)).T.double()


def speed_name(group: str) -> str:
    """Name of a group's block of rotor speeds."""
    return "lift_rotor_speed" if group == "lift" else f"{group}_speed"


def altitude_name(segment: str) -> str:
    """Name of the variable that is the altitude of a level segment."""
    return f"{segment}_altitude"


def end_altitude_name(segment: str) -> str:
    """Name of the variable that is the altitude at which a climb ends."""
    return f"{segment}_end_altitude"


def flight_speed_name(segment: str) -> str:
    """Name of the variable that is the speed of a segment, where a problem has one."""
    return f"{segment}_speed"


def _indices(values: Iterable[int]) -> Tensor:
    return torch.tensor(list(values), dtype=torch.int64)
