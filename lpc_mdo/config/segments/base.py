"""What every segment has, whatever its kind: a name, the rotors that turn, the air, and what the model needs to know of its flight."""

from abc import abstractmethod
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar

from pydantic import Field, PlainValidator

from lpc_mdo.config.rotors import RotorSpecification
from lpc_mdo.config.tables import Identifier, Table, between, key


class Segment(Table):
    """A steady part of the mission.

    rotors: kinds or groups of rotors of the vehicle file that turn; default: as the kind of segment says. temperature_offset: K
    from the standard day; default: the mission's. Properties in SI units say how the kind flies; the model asks for nothing else.
    """

    name: Identifier
    rotors: tuple[str, ...] | None = Field(None, min_length=1, max_length=20)
    temperature_offset: float | None = Field(None, alias="temperature_offset_K", ge=-50.0, le=50.0, strict=True)

    is_wingborne: ClassVar[bool]  # wing and tail carry it at a pitch that is trimmed; else it is level on its rotors
    is_altitude_free: ClassVar[bool] = False  # its altitude is a design variable, which starts at the file's
    is_always_flown: ClassVar[bool] = True  # where the mission gives no order
    default_rotors: ClassVar[tuple[str, ...]]
    imposed: ClassVar[tuple[int, ...]]
    """Components of the trim residual that are imposed, of Fx, Fy, Fz, Mx, My, Mz in body axes."""

    @property
    def groups(self) -> tuple[str, ...]:
        """Kinds or groups of rotors that turn; groups alone, of the vehicle, once the mission is expanded."""
        return self.default_rotors if self.rotors is None else self.rotors

    @property
    def inoperative_rotor(self) -> str:
        """Name of a rotor that has failed; "": none."""
        return ""

    @property
    def acceleration(self) -> float:
        """m/s^2 along the path."""
        return 0.0

    @property
    def load_factor(self) -> float:
        """Lift normal to the path over weight; 1 in straight level flight."""
        return 1.0

    @property
    def rotor_share(self) -> float:
        """Of the weight that lift rotors carry at the start of an optimization."""
        return 1.0

    @property
    def is_steady(self) -> bool:
        """Whether it is straight flight at one speed with all rotors."""
        return not self.inoperative_rotor and self.acceleration == 0.0 and self.load_factor == 1.0

    def points(self, rotors: Sequence[RotorSpecification]) -> "tuple[Segment, ...]":
        """The steady points that it stands for, each with a name of its own; most are one. rotors: those that mirror none."""
        return (self,)

    @property
    @abstractmethod
    def flight_speed(self) -> float | str:
        """m/s along the path, or the name of the segment whose speed it follows."""

    @property
    def vertical_rate(self) -> float:
        """m/s, positive upwards."""
        return 0.0

    @property
    def level_altitude(self) -> float | None:
        """m; None: it leads from the altitude of the segment flown before to that of the one flown after."""
        return None

    @property
    def given_end_altitude(self) -> float | None:
        """m at which a segment without level ends; None: where the next one flies."""
        return None

    @property
    def given_duration(self) -> float | None:
        """s; None: as long as altitude or distance take."""
        return None

    @property
    def given_distance(self) -> float | None:
        """m over the ground, with the climbs and descents that lead there; None: none is asked for."""
        return None


class Wingborne(Segment):
    """Flown on wing and tail, by default with the pusher."""

    is_wingborne = True
    default_rotors: ClassVar[tuple[str, ...]] = ("pusher",)
    imposed: ClassVar[tuple[int, ...]] = (0, 2, 4)


class Hovering(Segment):
    """Flown level on rotors, by default the lift rotors."""

    is_wingborne = False
    default_rotors: ClassVar[tuple[str, ...]] = ("lift",)
    imposed: ClassVar[tuple[int, ...]] = (2, 4)
    altitude: float = key("altitude_m", 0.0, 5000.0)

    @property
    def level_altitude(self) -> float:
        return self.altitude


class Level(Wingborne):
    """At one altitude, which is a design variable, and at one speed."""

    is_altitude_free = True
    speed: float = key("speed_m_per_s", 20.0, 120.0)
    altitude: float = key("altitude_m", 100.0, 8000.0)

    @property
    def flight_speed(self) -> float:
        return self.speed

    @property
    def level_altitude(self) -> float:
        return self.altitude


def _speed(value: Any) -> float | str:
    if isinstance(value, str) and value.isidentifier():
        return value
    if isinstance(value, bool) or not isinstance(value, int | float) or not 20.0 <= value <= 120.0:
        raise ValueError(f" = {value!r} is invalid: it must be a number between 20 and 120, or the name of a segment")
    return float(value)


class Sloping(Wingborne):
    """From the altitude of the segment before to that of the one after.

    speed: m/s, or the name of the segment whose speed it follows. rate: m/s, upwards or downwards as the kind says.
    end_altitude: where no level segment follows.
    """

    speed: Annotated[float | str, PlainValidator(_speed)] = Field(alias="speed_m_per_s")
    rate: float = key("rate_m_per_s", 0.5, 15.0)
    end_altitude: Annotated[float, between(0.0, 8000.0)] | None = Field(None, alias="end_altitude_m")

    @property
    def flight_speed(self) -> float | str:
        return self.speed

    @property
    def given_end_altitude(self) -> float | None:
        return self.end_altitude
