"""The design: every quantity that an optimization may change, by name, in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

from torch import Tensor

from lpc_mdo.geometry.parameterization import SHAPE_VARIABLES, ShapeParameters


@dataclass(frozen=True)
class Design:
    """Leading dimensions batch; the last dimensions are given below. Rotors come in the order of the vehicle file, segments flown
    on the wing in that of the mission file."""

    rotor_radius: Tensor  # (..., rotor) m
    blade_twist: Tensor  # (..., rotor, 4) rad, B-spline control points from root to tip, as many as the file has
    blade_chord: Tensor  # (..., rotor, 2) m, likewise
    motor_length: Tensor  # (..., rotor) m, active length
    motor_diameter: Tensor  # (..., rotor) m
    wing_area: Tensor  # (...,) m^2
    wing_aspect_ratio: Tensor  # (...,)
    wing_twist: Tensor  # (..., 5) rad, root to tip, nose up
    tail_area: Tensor  # (...,) m^2
    tail_aspect_ratio: Tensor  # (...,)
    tail_position: Tensor  # (...,) m, x of the root quarter chord
    battery_mass: Tensor  # (...,) kg
    battery_position: Tensor  # (...,) m, x of its centre of gravity
    pitch: Tensor  # (..., wingborne) rad
    tail_deflection: Tensor  # (..., wingborne) rad, trailing edge down
    of_segments: Mapping[str, Tensor]
    """By the names of `schedule`: rotor speeds of each group (..., point of the group) rad/s; altitudes of level segments and at the
    end of climbs (...,) m; and, where a problem has them as variables, speeds of segments (...,) m/s."""

    @classmethod
    def of(cls, values: Mapping[str, Tensor]) -> "Design":
        """From named variables. Raises TypeError if one of the aircraft's is missing."""
        aircraft = {field.name for field in fields(cls)} - {"of_segments"}
        own = {name: value for name, value in values.items() if name in aircraft}
        return cls(**own, of_segments={name: value for name, value in values.items() if name not in aircraft})

    def values(self) -> dict[str, Tensor]:
        """Every variable by name, inverse of `of`."""
        own = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "of_segments"}
        return own | dict(self.of_segments)


def shape_parameters(design: Design) -> ShapeParameters:
    """What a design asks of the outer mold line."""
    return ShapeParameters(**{name: getattr(design, name) for name in SHAPE_VARIABLES})
