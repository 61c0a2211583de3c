"""Sections of the blades as the vehicle file names them: per rotor, and along the span."""

import pytest
import torch

from lpc_mdo.config import load
from lpc_mdo.model.blade_airfoils import blade_polars, vehicle_polars
from lpc_mdo.problems.gross_weight import gross_weight_problem

RADIAL = (torch.arange(28, dtype=torch.float64) + 0.5) / 28
PUSHER = "vehicle.rotors.8.airfoil="


def start(*overrides):
    """Analysis of the start with these overrides."""
    problem = gross_weight_problem(*load(overrides=list(overrides)))
    with torch.no_grad():
        return problem.analyze(problem.x0)


@pytest.fixture(scope="module")
def shipped():
    return start()


def test_another_section_of_the_pusher_changes_its_loads_alone(shipped):
    other = start(f"{PUSHER}ls417").propulsion.loads
    ours = shipped.propulsion.loads
    assert bool((other.thrust[-2:] != ours.thrust[-2:]).all())
    torch.testing.assert_close(other.thrust[:8], ours.thrust[:8], rtol=1e-12, atol=0.0)


def test_one_section_named_twice_along_the_span_is_that_section(shipped):
    twice = start(f'{PUSHER}[["naca4412", 0.3], ["naca4412", 1.0]]').propulsion.loads
    torch.testing.assert_close(twice.thrust, shipped.propulsion.loads.thrust, rtol=1e-10, atol=0.0)
    torch.testing.assert_close(twice.torque, shipped.propulsion.loads.torque, rtol=1e-10, atol=0.0)


def test_sections_blend_between_the_radii_that_name_them():
    vehicle, _ = load(overrides=[f'{PUSHER}[["naca4412", 0.3], ["ls417", 0.8]]'])
    blade, radius = blade_polars(vehicle, RADIAL)[8], 0.2 + 0.8 * RADIAL
    share = ((radius - 0.3) / 0.5).clamp(0.0, 1.0)
    torch.testing.assert_close(blade.shares, torch.stack([1.0 - share, share]))
    inner, outer = (float(polar.thickness_to_chord) for polar in blade.polars)
    torch.testing.assert_close(blade.thickness_to_chord, inner + share * (outer - inner))
    alpha, reynolds, mach = (torch.full((28,), value, dtype=torch.float64) for value in (0.1, 2e6, 0.3))
    lift = [polar(alpha, reynolds, mach)[0] for polar in blade.polars]
    torch.testing.assert_close(blade(alpha, reynolds, mach)[0], torch.lerp(*lift, share))


def test_gradient_through_two_sections_equals_differences():
    vehicle, mission = load(overrides=[f'{PUSHER}[["naca4412", 0.3], ["ls417", 1.0]]'])
    problem = gross_weight_problem(vehicle, mission)

    def pusher_thrust(x):
        return problem.analyze(x).propulsion.loads.thrust[-1] / 1e4

    x = problem.x0.clone().requires_grad_(True)
    (gradient,) = torch.autograd.grad(pusher_thrust(x), x)
    direction = torch.cos(torch.arange(1.0, problem.size + 1.0, dtype=torch.float64))
    step = 1e-5 * direction
    with torch.no_grad():
        slope = (pusher_thrust(problem.x0 + step) - pusher_thrust(problem.x0 - step)) / 2e-5
    assert float(gradient @ direction) == pytest.approx(float(slope), rel=1e-6)


def test_the_thickness_of_a_section_is_heard():
    thin, thick = (start(*(f"vehicle.rotors.{i}.airfoil={name}" for i in range(8))) for name in ("naca4412", "ls417"))
    assert float(thick.noise.tonal.thickness.sum()) > float(thin.noise.tonal.thickness.sum())


def test_provenance_names_every_polar_once():
    vehicle, _ = load(overrides=[f"{PUSHER}ls417"])
    assert sorted(polar.name for polar in vehicle_polars(vehicle)) == ["ls417", "naca4412"]


@pytest.mark.parametrize(
    ("airfoil", "sentence"),
    [
        ("e387", r"rotors\[8\]\.airfoil = 'e387' is invalid: it must be one of ls417, naca4412"),
        ('[["naca4412", 0.8], ["ls417", 0.2]]', "must name sections at increasing fractions of the radius"),
        ('[["naca4412", 1.2]]', "1.2 is not allowed; it must lie between 0 and 1"),
        ("[]", "must name sections at increasing fractions"),
    ],
)
def test_sections_that_cannot_be_are_refused_by_place(airfoil, sentence):
    with pytest.raises(ValueError, match=sentence):
        gross_weight_problem(*load(overrides=[f"{PUSHER}{airfoil}"]))


def test_the_wing_stalls_as_its_own_section_does(shipped):
    other = start("vehicle.wing.airfoil=4412")
    assert float(other.aerodynamics.maximum_lift_coefficient[1]) != float(
        shipped.aerodynamics.maximum_lift_coefficient[1]
    )
    with pytest.raises(
        ValueError, match=r"wing\.airfoil = '0006' is invalid: it has no trained polar; `lpc-mdo train airfoil"
    ):
        gross_weight_problem(*load(overrides=["vehicle.wing.airfoil=0006"]))
