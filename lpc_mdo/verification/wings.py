"""The vortex lattice against OpenAeroStruct, lifting-line and thin-airfoil theory, its own far field and differences."""

import math

import torch
from torch import Tensor

from lpc_mdo.cases.wings import WingInputs, WingMesh, WingSurface, analyze_wing, wing_mesh
from lpc_mdo.disciplines.far_field import far_field
from lpc_mdo.disciplines.stability_derivatives import (
    Reference,
    air_velocity,
    lattice_coefficients,
    stability_derivatives,
)
from lpc_mdo.disciplines.vortex_lattice import vortex_lattice
from lpc_mdo.numerics.tensors import tensor
from lpc_mdo.verification.comparison import Between, Comparison, reference

MODEL = "vortex lattice"
CASES = {
    "vlm_rect_ar8_flat": "flat wing, aspect ratio 8",
    "vlm_rect_ar8_naca4412": "cambered wing, aspect ratio 8",
    "vlm_lpc_flat": "flat wing and tail",
    "vlm_lpc_naca4412": "cambered wing and flat tail",
}
QUANTITIES = {  # name in words, limit
    "CL": ("lift coefficient", 1e-3),
    "CDi": ("induced drag coefficient", 5e-3),
    "Cm": ("pitching moment coefficient", 0.01),
    "Cl_roll_body": ("rolling moment coefficient", 0.02),
    "Cn_body": ("yawing moment coefficient", 0.02),
}
CAMBERED_LIFT = 3e-3
SAME = "the same lattice and wake; printed digits"
WITH_CORE = "as in the main problem: wakes have a core on other surfaces, which the other code's have not"
ORIGIN = torch.zeros(3, dtype=torch.float64)


def comparisons() -> list[Comparison]:
    with torch.no_grad():
        rows = [
            *(row for name in CASES for row in _equal_mesh(name, 0.0, SAME)),
            *(row for name in CASES if "tail" in CASES[name] for row in _equal_mesh(name, 1.0, WITH_CORE)),
            _elliptic(),
            _long_wing(),
            _far_field(),
        ]
    return [*rows, _derivatives()]


def _equal_mesh(name: str, wake_core: float, reason: str) -> list[Comparison]:
    case = reference(name)
    straight = [
        ({key: mesh[key] for key in WingMesh.model_fields if key in mesh}, mesh["results"])
        for mesh in case["results"]["OpenAerostruct 2.12.0"]["meshes"]
    ]
    slipping = [
        ({key: row[key] for key in WingMesh.model_fields if key in row}, [row])
        for row in reference("vlm_sideslip")["results"][name]
    ]
    found: dict[str, tuple[list[float], list[float]]] = {key: ([], []) for key in QUANTITIES}
    for panels, rows in [*straight, *slipping]:
        angles = [[row["alpha_deg"], row["beta_deg"]] for row in rows]
        inputs = WingInputs.model_validate(case["inputs"] | {"conditions_alpha_beta_deg": angles})
        results = analyze_wing(inputs, [], WingMesh(**panels, wake_core=wake_core))
        for result, row in zip(results, rows, strict=True):
            for key, (left, right) in found.items():
                left.append(result[key])
                right.append(row[key])
    own = f", wake core {wake_core:g}" if wake_core else ""
    between = Between(MODEL, "OpenAeroStruct 2.12.0 at equal mesh, every mesh, angle and sideslip")
    rows = []
    for key, (ours, theirs) in found.items():
        if max(abs(value) for value in theirs) < 1e-6:  # a moment that symmetry makes zero
            continue
        words, limit = QUANTITIES[key]
        limit = CAMBERED_LIFT if key == "CL" and "4412" in name else limit
        quantity = f"{words}, {CASES[name]}{own}"
        rows.append(between.of_largest(quantity, ours, theirs, limit, reason))
    return rows


def _elliptic() -> Comparison:
    theta = torch.linspace(0.0, math.pi, 61, dtype=torch.float64)
    chord, y = torch.sin(theta).clamp(min=1e-3), -10.0 * torch.cos(theta)
    x = torch.tensor([-0.25, 0.25, 0.75], dtype=torch.float64)[:, None] * chord
    elliptic = torch.stack(torch.broadcast_tensors(x, y, torch.zeros_like(y)), dim=-1)
    loads = vortex_lattice([elliptic], _stream(0.05), tensor(1.0), ORIGIN)
    lifting_line = float(loads.lift) ** 2 / (0.5 * math.pi * 20.0**2)
    return Between(MODEL, "lifting-line theory").relative(
        "induced drag of an elliptic wing, aspect ratio 25, N at unit density and speed", loads.induced_drag,
        lifting_line, 0.005, "a finite aspect ratio, and a tip chord that is not 0",
    )  # fmt: skip


def _long_wing() -> Comparison:
    lift = vortex_lattice([_wing(3, 40, 500.0)], _stream(0.02), tensor(1.0), ORIGIN).lift
    return Between(MODEL, "thin-airfoil theory, 2 pi").relative(
        "lift slope at aspect ratio 1000, 1/rad", float(lift) / (0.5 * 1000.0 * 0.02), 2.0 * math.pi, 0.02,
        "aspect ratio is finite",
    )  # fmt: skip


def _far_field() -> Comparison:
    ratios = []
    for panels in (4, 8):
        mesh = _wing(panels, 5 * panels, 4.0, "NACA 4412")
        near = vortex_lattice([mesh], _stream(0.05), tensor(1.0), ORIGIN, has_chordwise_forces=True)
        far = far_field(near.circulation, [mesh[-1]], _stream(0.05), tensor(1.0))
        ratios.append(float(near.induced_drag / far.induced_drag))
    return Between(MODEL, "its own far field").relative(
        "induced drag of a cambered wing, near over far field, extrapolated from two meshes",
        2.0 * ratios[1] - ratios[0], 1.0, 1e-3, "what is left of second order",
    )  # fmt: skip


def _derivatives() -> Comparison:
    """All thirty slopes of a cambered wing that slips, rolls, pitches and yaws."""
    wing = _wing(2, 6, 4.0, "NACA 4412")
    at = torch.tensor([0.06, 0.03, 0.01, 0.02, -0.01], dtype=torch.float64)
    basis = Reference(tensor(8.0), tensor(1.0), tensor(8.0), tensor([0.25, 0.0, 0.0]))
    exact = stability_derivatives([wing], basis, at).slope
    step = 1e-3
    with torch.no_grad():
        columns = []
        for direction in torch.eye(5, dtype=torch.float64):
            far, near, back, far_back = (
                lattice_coefficients([wing], basis, at + k * step * direction) for k in (2, 1, -1, -2)
            )
            columns.append((8.0 * (near - back) - (far - far_back)) / (12.0 * step))
    return Between("stability derivatives", "central differences of fourth order").of_largest(
        "six coefficients by five motions, 1/rad", exact, torch.stack(columns, dim=-1), 1e-7, "rounding and step"
    )


def _wing(chordwise: int, spanwise: int, half_span: float, camber: str = "none") -> Tensor:
    surface = WingSurface(name="wing", camber=camber, root=(0.0, 0.0, 0.0, 1.0), tip=(0.0, half_span, 0.0, 1.0))
    return wing_mesh(surface, WingMesh(chordwise_panels=chordwise, spanwise_panels_half=spanwise))


def _stream(angle_of_attack: float) -> Tensor:
    return air_velocity(tensor(1.0), tensor(angle_of_attack), tensor(0.0))
