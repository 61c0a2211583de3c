"""The sections of an aircraft's blades, along the span and from rotor to rotor, as its vehicle file names them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from lpc_mdo.config import RotorSpecification, Vehicle
from lpc_mdo.disciplines.blade_element import Inflow, Rotor, RotorLoads, blade_element_momentum
from lpc_mdo.surrogates.airfoil import AirfoilPolar
from lpc_mdo.surrogates.airfoil_names import resolve_airfoil


@dataclass(frozen=True)
class BladePolar:
    """Polars along one blade: between the radii at which the file names sections, shares change linearly."""

    polars: tuple[AirfoilPolar, ...]
    shares: Tensor  # (polar, station)

    def __call__(self, alpha: Tensor, reynolds: Tensor, mach: Tensor) -> tuple[Tensor, Tensor]:
        """Lift and drag coefficient (..., station), as of one polar."""
        if len(self.polars) == 1:
            return self.polars[0](alpha, reynolds, mach)
        pairs = [torch.stack(polar(alpha, reynolds, mach)) for polar in self.polars]
        cl, cd = sum(share * pair for share, pair in zip(self.shares, pairs, strict=True))
        return cl, cd

    @property
    def thickness_to_chord(self) -> Tensor:
        """(station,)"""
        thickness = torch.tensor([polar.thickness_to_chord for polar in self.polars], dtype=torch.float64)
        return thickness @ self.shares

    def extrapolated(self, alpha: Tensor, reynolds: Tensor, mach: Tensor) -> Tensor:
        """(..., station) bool: a section that counts there is asked outside its polars."""
        found = [
            polar.extrapolated(alpha, reynolds, mach) & (share > 0.0)
            for polar, share in zip(self.polars, self.shares, strict=True)
        ]
        return torch.stack(found).any(0)

    def coarse(self, grain: int) -> "BladePolar":
        """The same blade with `grain` stations as one."""
        return self if grain == 1 else replace(self, shares=self.shares.unflatten(-1, (-1, grain)).mean(-1))

    def with_drag(self, factor: float) -> "BladePolar":
        """The same blade with every section's drag multiplied by `factor` > 0."""
        return replace(self, polars=tuple(polar.with_drag(factor) for polar in self.polars))


def blade_polars(vehicle: Vehicle, radial: Tensor) -> tuple[BladePolar, ...]:
    """One a rotor, the same object for blades alike; `radial` (station,): where stations lie between hub and tip, 0 to 1.

    Raises ValueError, with the rotor's place in the file, where a section has no trained polar.
    """
    known: dict[tuple[object, ...], BladePolar] = {}
    found = []
    for i, rotor in enumerate(vehicle.rotors):
        key = (rotor.airfoil, rotor.root_cutout if len(rotor.airfoil) > 1 else None)
        if key not in known:
            known[key] = _blade_polar(rotor, radial, f"rotors[{i}]")
        found.append(known[key])
    return tuple(found)


def _blade_polar(rotor: RotorSpecification, radial: Tensor, place: str) -> BladePolar:
    polars = tuple(resolve_airfoil(name, key=f"{place}.airfoil") for name, _ in rotor.airfoil)
    at = rotor.root_cutout + (1.0 - rotor.root_cutout) * radial
    knots = [fraction for _, fraction in rotor.airfoil]
    shares = torch.zeros(len(polars), len(radial), dtype=torch.float64)
    shares[0] = 1.0
    for k in range(1, len(polars)):
        share = ((at - knots[k - 1]) / (knots[k] - knots[k - 1])).clamp(0.0, 1.0)
        shares[:k] = shares[:k] * (1.0 - share)
        shares[k] = share
    return BladePolar(polars, shares)


def rotor_loads(rotor: Rotor, inflow: Inflow, polars: Sequence[BladePolar]) -> RotorLoads:
    """Loads of rotors (..., point), one polar a point; points of blades alike are solved in one batch."""
    kinds = list({id(polar): polar for polar in polars}.values())
    if len(kinds) == 1:
        return blade_element_momentum(rotor, inflow, kinds[0])
    groups = [torch.tensor([i for i, polar in enumerate(polars) if polar is kind]) for kind in kinds]
    parts = [
        blade_element_momentum(rotor.at(group), inflow.at(group), kind)
        for group, kind in zip(groups, kinds, strict=True)
    ]
    return RotorLoads.joined(parts).at(torch.argsort(torch.cat(groups)))


def extrapolated_shares(loads: RotorLoads, polars: Sequence[BladePolar]) -> Tensor:
    """Share (..., point) of each blade's span whose angle, Reynolds or Mach number lies outside the polars there."""
    queries = (loads.angle_of_attack, loads.reynolds, loads.mach)
    columns = [
        polar.extrapolated(*(query[..., i, :] for query in queries)).to(loads.thrust).mean(-1)
        for i, polar in enumerate(polars)
    ]
    return torch.stack(columns, dim=-1)


def thickness_to_chord(polars: Sequence[BladePolar]) -> Tensor:
    """(point, station) of the blades' sections."""
    return torch.stack([polar.thickness_to_chord for polar in polars])


def vehicle_polars(vehicle: Vehicle) -> tuple[AirfoilPolar, ...]:
    """Every trained polar that the vehicle's blades and wing use, each once."""
    names = [name for rotor in vehicle.rotors for name, _ in rotor.airfoil] + [
        vehicle.wing.polar or vehicle.wing.airfoil
    ]
    return tuple({polar.sha256: polar for polar in map(resolve_airfoil, dict.fromkeys(names))}.values())
