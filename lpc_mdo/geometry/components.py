"""What the Lift+Cruise is made of: its surfaces by component as the vehicle file has them, and their names."""

import torch
from torch import Tensor

from lpc_mdo.config import RotorSpecification, Vehicle
from lpc_mdo.geometry.bodies import disk_surface, fuselage_surface, tube_surface
from lpc_mdo.geometry.lifting import SPAN_DEGREE, SPAN_POINTS, Trapezoid, fin_surface, half_surface, trapezoid
from lpc_mdo.geometry.surfaces import BSplineSurface, Patch
from lpc_mdo.numerics.bsplines import basis_matrix
from lpc_mdo.numerics.constants import FOOT

DISK_OFFSET = 0.62 * FOOT  # m from hub point to rotor disk; geometry set-up script of the study's authors
HUB_RADIUS = 0.12  # m, ASSUMED: 8 % of the lift rotors' radius
MIRRORED = ("wing", "horizontal_tail")  # carried as starboard halves
INWARD = ("wing_lower", "horizontal_tail_lower", "vertical_tail_starboard")  # patches whose du x dv enters the body


def roof_height(vehicle: Vehicle) -> float:
    """z of the cabin's roof, m: the lower side of the wing's centre section rests on it."""
    root_chord = float(trapezoid(vehicle.wing).chord[0])
    return vehicle.wing.root_quarter_chord[2] - 0.5 * vehicle.wing.thickness_to_chord * root_chord


def patches(vehicle: Vehicle) -> dict[str, Patch]:
    """All patches by name, one after the other in the list of control points, each component in a row."""
    found, first = {}, 0
    for component, surfaces in _surfaces(vehicle).items():
        for part, surface in surfaces.items():
            name = f"{component}_{part}" if part else component
            found[name] = Patch(name, first, surface, name not in INWARD)
            first += found[name].size
    return found


def component_of(patch: str) -> str:
    """Name of the component that a patch belongs to."""
    surfaces = ("wing", "horizontal_tail", "vertical_tail")
    return next((name for name in surfaces if patch.startswith(f"{name}_")), patch)


def mirror(rotor: RotorSpecification) -> Tensor:
    """What takes a point (3,) of the starboard wing to the rotor's own side."""
    return torch.tensor([1.0, 1.0 if rotor.hub[1] > 0.0 else -1.0, 1.0], dtype=torch.float64)


def span_fraction(rotor: RotorSpecification, wing: Trapezoid) -> Tensor:
    """Where along the half span (1,) the boom of a lift rotor crosses the wing."""
    return torch.tensor([abs(rotor.hub[1]) / wing.half_span], dtype=torch.float64)


def attachment_basis(rotor: RotorSpecification, wing: Trapezoid) -> Tensor:
    """Weights (section,) of the wing's quarter chords in the point that carries the boom."""
    return basis_matrix(span_fraction(rotor, wing), SPAN_POINTS, SPAN_DEGREE)[0]


def attachment_point(rotor: RotorSpecification, wing: Trapezoid) -> Tensor:
    """The point (3,) m of the wing's quarter chord that carries the boom, as built."""
    return attachment_basis(rotor, wing) @ wing.quarter_chord * mirror(rotor)


def _surfaces(vehicle: Vehicle) -> dict[str, dict[str, BSplineSurface]]:
    """Surfaces by component and part."""
    parts = {
        "wing": half_surface(vehicle.wing),
        "horizontal_tail": half_surface(vehicle.horizontal_tail),
        "vertical_tail": fin_surface(vehicle.vertical_tail),
        "fuselage": {"": fuselage_surface(vehicle.fuselage, roof_height(vehicle))},
    }
    wing = trapezoid(vehicle.wing)
    for rotor in vehicle.rotors:
        hub = torch.tensor(rotor.hub, dtype=torch.float64)
        if rotor.kind == "lift":
            attachment = attachment_point(rotor, wing)
            end = hub + vehicle.booms.overhang * torch.nn.functional.normalize(hub - attachment, dim=0)
            parts[f"boom_{rotor.name}"] = {"": tube_surface(end, attachment, 0.5 * vehicle.booms.diameter)}
        thrust = torch.tensor([0.0, 0.0, 1.0] if rotor.kind == "lift" else [-1.0, 0.0, 0.0], dtype=torch.float64)
        starboard = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
        center = hub + DISK_OFFSET * thrust if rotor.kind == "lift" else hub
        parts[f"hub_{rotor.name}"] = {"": tube_surface(hub, hub + DISK_OFFSET * thrust, HUB_RADIUS)}
        up = torch.linalg.cross(starboard, thrust)
        parts[f"disk_{rotor.name}"] = {"": disk_surface(center, rotor.radius, starboard, up)}
    return parts
