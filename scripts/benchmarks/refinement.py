"""The same blades with more control points: a vehicle with more design variables and nothing else changed."""

import torch

from lpc_mdo.config import Vehicle
from lpc_mdo.numerics.bsplines import basis_matrix, blade_degree, greville_abscissae


def refined(vehicle: Vehicle, twist_points: int, chord_points: int) -> Vehicle:
    """The vehicle with that many control points along every blade, which keeps its shape.

    The splines of the shipped blades have no inner knots and no higher degree, so that the finer ones contain them.
    """
    rotors = tuple(
        rotor.model_copy(update={"twist": _more(rotor.twist, twist_points), "chord": _more(rotor.chord, chord_points)})
        for rotor in vehicle.rotors
    )
    return vehicle.model_copy(update={"rotors": rotors})


def _more(points: tuple[float, ...], count: int) -> tuple[float, ...]:
    """Control points of the same curve: interpolation at as many places as there are points."""
    degree = blade_degree(count)
    places = torch.from_numpy(greville_abscissae(count, degree))
    curve = basis_matrix(places, len(points), blade_degree(len(points))) @ torch.tensor(points, dtype=torch.float64)
    return tuple(torch.linalg.solve(basis_matrix(places, count, degree), curve).tolist())
