"""The parasitic drag items of a vehicle: what is constant is made once, all items are evaluated side by side.

Source "build_up": every item from its wetted area, and the file's rows. Source "study": wing and horizontal tail likewise, since
the study's lattice adds their profile drag, without an allowance for leakage, and its one area for all else.
"""

import torch
from torch import Tensor

from lpc_mdo.config import Vehicle
from lpc_mdo.disciplines import drag
from lpc_mdo.disciplines.atmosphere import Atmosphere
from lpc_mdo.geometry.shape import Shape
from lpc_mdo.numerics.tensors import tensor

BODIES = ("fuselage", "booms")
SURFACES = ("wing", "horizontal_tail", "vertical_tail")


class ParasiticDrag:
    """Callable drag areas of a vehicle's shape; `names` in the order of the last dimension of everything it returns."""

    def __init__(self, vehicle: Vehicle) -> None:
        factors, fin = vehicle.drag, vehicle.vertical_tail
        body, halves = vehicle.fuselage, (vehicle.wing, vehicle.horizontal_tail, fin)
        wetted, rows = (*BODIES, *SURFACES), [(row.name, row.area, row.position) for row in factors.areas]
        kept: tuple[str, ...] = wetted
        if factors.source == "study":
            kept, rows = SURFACES[:2], [("study", factors.study.area, factors.study.position)]
        self._kept = torch.tensor([wetted.index(name) for name in kept])
        self.names = (*kept, *(name for name, _, _ in rows))
        self._length = tensor([body.length])
        self._diameter = tensor([(body.width * body.height) ** 0.5, vehicle.booms.diameter])
        self._thickness = tensor([surface.thickness_to_chord for surface in halves])
        self._fin_area, self._fin_chord = tensor([fin.area]), tensor([(fin.area / fin.aspect_ratio) ** 0.5])
        interference = [factors.fuselage_interference, factors.boom_interference, factors.wing_interference]
        interference += [factors.tail_interference, factors.tail_interference]
        # The leakage allowance multiplies the wetted items of the build-up; the study's one area holds what leaks and protrudes.
        allowance = factors.leakage_and_protuberance if factors.source == "build_up" else 0.0
        self._factor = tensor(interference) * (1.0 + allowance)
        self._fixed = tensor([area for _, area, _ in rows])
        self._fuselage_point = 0.5 * (tensor(body.nose) + tensor(body.rear))
        mid_span = 0.5 * (fin.area * fin.aspect_ratio) ** 0.5
        fin_point = tensor(fin.root_quarter_chord) + tensor([0.0, 0.0, mid_span])
        self._fin_point = fin_point[None]
        self._row_points = tensor([position for _, _, position in rows]).reshape(-1, 3)
        self._lift_rotors = len(vehicle.lift_rotors)

    def areas(self, shape: Shape, speed: Tensor, air: Atmosphere) -> Tensor:
        """Drag areas (..., segment, item) m^2 at speed (..., segment) m/s in air (..., segment)."""
        mach = (speed / air.speed_of_sound)[..., None]
        unit_reynolds = (air.density * speed / air.dynamic_viscosity)[..., None]
        booms = shape.boom_length  # two of each pair
        boom_wetted = 2.0 * drag.tube_wetted_area(booms.sum(-1, keepdim=True), self._diameter[1])
        batch = booms.shape[:-1]
        bodies = torch.cat([self._length.expand(*batch, 1), booms.mean(-1, keepdim=True)], dim=-1)
        chords = [shape.wing.mean_chord[..., None], shape.tail.mean_chord[..., None], self._fin_chord.expand(*batch, 1)]
        surfaces = [shape.wing.area[..., None], shape.tail.area[..., None], self._fin_area.expand(*batch, 1)]
        length = torch.cat([bodies, *chords], dim=-1)[..., None, :]
        body_wetted = torch.cat([shape.fuselage_wetted_area.expand(*batch, 1), boom_wetted], dim=-1)
        wetted = [body_wetted, drag.surface_wetted_area(torch.cat(surfaces, dim=-1), self._thickness)]
        surface_form = drag.surface_form_factor(self._thickness, mach)
        body_form = drag.body_form_factor(bodies, self._diameter)[..., None, :]
        form = torch.cat([body_form.expand(*surface_form.shape[:-1], -1), surface_form], dim=-1)
        friction = drag.turbulent_friction_coefficient(unit_reynolds * length, mach)
        items = (torch.cat(wetted, dim=-1) * self._factor)[..., None, :] * friction * form
        return torch.cat([items[..., self._kept], self._fixed.expand(*items.shape[:-1], -1)], dim=-1)

    def points(self, shape: Shape) -> Tensor:
        """Where each item acts (..., item, 3) m."""
        batch = shape.hubs.shape[:-2]
        points = [
            self._fuselage_point.expand(*batch, 1, 3),
            shape.hubs[..., : self._lift_rotors, :].mean(-2, keepdim=True),
            shape.wing.aerodynamic_center[..., None, :],
            shape.tail.aerodynamic_center[..., None, :],
            self._fin_point.expand(*batch, 1, 3),
        ]
        wetted = torch.cat(points, dim=-2)[..., self._kept, :]
        return torch.cat([wetted, self._row_points.expand(*batch, -1, 3)], dim=-2)
