"""Thin-walled sections: constants, and how much of their strength and stability a set of section forces uses up.

Reserves are written as shares: 1 is the limit, more fails. Forces in the local axes of `structures.frame`: N, Vy, Vz, T, My,
Mz; My bends in the x-z plane (flapwise), Mz in the x-y plane (chordwise).
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from lpc_mdo.structures.frame import BeamSections

SMALL_FORCE = 1.0  # N or N m: magnitudes are rounded off below, so that they have a slope at zero


@dataclass(frozen=True)
class Material:
    """Isotropic: Pa, 1, kg/m^3; allowable is the von Mises stress at ultimate load, Pa."""

    name: str
    elastic_modulus: float
    poisson_ratio: float
    density: float
    allowable: float
    source: str

    @property
    def shear_modulus(self) -> float:
        return self.elastic_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def plate_factor(self) -> float:
        """pi^2 E/(12 (1 - nu^2)): Pa; a plate of thickness t and width b buckles at k times this times (t/b)^2."""
        return math.pi**2 * self.elastic_modulus / (12.0 * (1.0 - self.poisson_ratio**2))


CARBON = Material(
    "IM7/8552 quasi-isotropic",
    59.7e9,
    0.315,
    1580.0,
    4500e-6 * 59.7e9,
    "lamina of NCAMP CAM-RP-2009-015 by classical lamination theory; 4500 microstrain, damage tolerant, ASSUMED",
)
ALUMINIUM = Material("2024-T3 sheet", 72.4e9, 0.33, 2768.0, 441e6, "MIL-HDBK-5J table 3.2.4.0, ultimate strength")


def magnitude(x: Tensor) -> Tensor:
    """|x| rounded off near zero."""
    return torch.sqrt(x**2 + SMALL_FORCE**2)


@dataclass(frozen=True)
class BoxWalls:
    """Two-web box (...,), mid-surface dimensions in m; cap: area of each of the four corner caps, m^2."""

    width: Tensor
    height: Tensor
    skin: Tensor
    web: Tensor
    cap: Tensor

    def constants(self) -> BeamSections:
        """Torsion by Bredt and Batho; shear areas are those of the walls along the force."""
        w, h, ts, tw, cap = self.width, self.height, self.skin, self.web, self.cap
        return BeamSections(
            area=2 * w * ts + 2 * h * tw + 4 * cap,
            second_moment_y=w * ts * h**2 / 2 + tw * h**3 / 6 + cap * h**2,
            second_moment_z=ts * w**3 / 6 + h * tw * w**2 / 2 + cap * w**2,
            torsion_constant=4 * (w * h) ** 2 / (2 * w / ts + 2 * h / tw),
            shear_area_y=2 * w * ts,
            shear_area_z=2 * h * tw,
        )

    def shares(self, forces: Tensor, material: Material, stringer_pitch: float, rib_pitch: float) -> Tensor:
        """(..., 4) of the strength of skin and web and of the stability of skin and web, for forces (..., 6) at ultimate
        load.

        The worst corner's direct stress acts in skin and web alike; skin panels between stringers and webs between
        ribs are simply supported plates. Source: Bruhn (1973), chapters C5; NACA TN 3781.
        """
        n, vy, vz, torque, my, mz = (magnitude(f) for f in forces.unbind(-1))
        w, h = self.width, self.height
        k = self.constants()
        direct = my * h / (2 * k.second_moment_y) + mz * w / (2 * k.second_moment_z) + n / k.area
        flow = torque / (2 * w * h)
        skin_shear, web_shear = (flow + vy / (2 * w)) / self.skin, (flow + vz / (2 * h)) / self.web
        plate = material.plate_factor
        skin_plate = plate * (self.skin / stringer_pitch) ** 2
        web_plate = plate * (self.web / h) ** 2 * (5.35 + 4.0 * (h / rib_pitch) ** 2)
        return torch.stack(
            [
                torch.sqrt(direct**2 + 3 * skin_shear**2) / material.allowable,
                torch.sqrt(direct**2 + 3 * web_shear**2) / material.allowable,
                direct / (4.0 * skin_plate) + (skin_shear / (5.35 * skin_plate)) ** 2,
                web_shear / web_plate,
            ],
            dim=-1,
        )


@dataclass(frozen=True)
class ShellWall:
    """Thin elliptical tube (...,), semi-axes of its mid-surface along local y and z and its wall in m."""

    semi_axis_y: Tensor
    semi_axis_z: Tensor
    wall: Tensor

    @property
    def perimeter(self) -> Tensor:
        """Source: Ramanujan's first approximation, exact for the circle."""
        a, b = self.semi_axis_y, self.semi_axis_z
        return math.pi * (3 * (a + b) - torch.sqrt((3 * a + b) * (a + 3 * b)))

    @property
    def enclosed(self) -> Tensor:
        return math.pi * self.semi_axis_y * self.semi_axis_z

    def constants(self) -> BeamSections:
        """Second moments of a thin wall, pi b^2 (b + 3 a) t/4, exact for the circle; half the area carries shear."""
        a, b, t = self.semi_axis_y, self.semi_axis_z, self.wall
        area = self.perimeter * t
        return BeamSections(
            area=area,
            second_moment_y=math.pi * b**2 * (b + 3 * a) * t / 4,
            second_moment_z=math.pi * a**2 * (a + 3 * b) * t / 4,
            torsion_constant=4 * self.enclosed**2 * t / self.perimeter,
            shear_area_y=0.5 * area,
            shear_area_z=0.5 * area,
        )

    def shares(self, forces: Tensor, material: Material) -> Tensor:
        """(..., 2) of strength and of the stability of the wall, for forces (..., 6) at ultimate load.

        Bending in both planes is added as vectors of stress; the wall buckles as a cylinder of the largest radius of
        curvature in bending, with the knock-down 1 - 0.731 (1 - exp(-sqrt(R/t)/16)). Source: NASA SP-8007.
        """
        n, vy, vz, torque = (magnitude(f) for f in forces[..., :4].unbind(-1))
        k = self.constants()
        a, b = self.semi_axis_y, self.semi_axis_z
        bending = torch.sqrt(
            (forces[..., 4] * b / k.second_moment_y) ** 2
            + (forces[..., 5] * a / k.second_moment_z) ** 2
            + (SMALL_FORCE * b / k.second_moment_y) ** 2
        )
        direct = bending + n / k.area
        shear = torque / (2 * self.enclosed * self.wall) + torch.sqrt(vy**2 + vz**2) / (0.5 * k.area)
        radius = torch.maximum(a**2 / b, b**2 / a)
        knock_down = 1.0 - 0.731 * (1.0 - torch.exp(-torch.sqrt(radius / self.wall) / 16.0))
        critical = knock_down * 0.6 * material.elastic_modulus * self.wall / radius
        strength = torch.sqrt(direct**2 + 3 * shear**2) / material.allowable
        return torch.stack([strength, direct / critical], dim=-1)
