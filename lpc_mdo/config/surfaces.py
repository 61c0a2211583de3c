"""Wing and tails."""

import re
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationInfo, model_validator

from lpc_mdo.airfoils.sections import section_name, section_thickness
from lpc_mdo.config.tables import FROM_DEGREES, Point, Table, beside, between, key


class LiftingSurface(Table):
    """A trapezoidal wing or tail: areas in m^2, angles in rad, positions in m."""

    area: float = key("area_m2", 0.5, 100.0)
    aspect_ratio: float = between(1.0, 30.0)
    taper: float = between(0.1, 1.0)
    quarter_chord_sweep: Annotated[float, between(-45.0, 45.0), FROM_DEGREES] = Field(alias="quarter_chord_sweep_deg")
    dihedral: Annotated[float, between(-20.0, 20.0), FROM_DEGREES] = Field(alias="dihedral_deg")
    incidence: Annotated[float, between(-15.0, 15.0), FROM_DEGREES] = Field(alias="incidence_deg")
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

    maximum_lift_factor: float = between(0.5, 1.2)
    polar: str = ""

    @model_validator(mode="before")
    @classmethod
    def _finds_its_polar(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict) or not isinstance(data.get("polar"), str) or not data["polar"]:
            return data
        return data | {"polar": beside(data["polar"], (info.context or {}).get("folder", Path()))}


class VerticalTail(Table):
    area: float = key("area_m2", 0.1, 50.0)
    aspect_ratio: float = between(0.5, 6.0)
    taper: float = between(0.1, 1.0)
    thickness_to_chord: float = between(0.05, 0.25)
    root_quarter_chord: Point = Field(alias="root_quarter_chord_m")
