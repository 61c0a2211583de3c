"""Trim: balance of forces and moments in states known by hand, signs, mirror and rotation invariance."""

import math

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.disciplines.trim import (
    Maneuver,
    geometry_to_body,
    gravity_force,
    maneuver_residual,
    stall_speed,
    trim_residual,
)
from lpc_mdo.numerics.constants import GRAVITY

MASS = 3000.0
WEIGHT = MASS * GRAVITY
CENTER = torch.tensor([3.2, 0.1, 1.8], dtype=torch.float64)
ZERO = torch.zeros(3, dtype=torch.float64)


def vector(*values):
    return torch.tensor(values, dtype=torch.float64)


def residual(forces, points, moments=ZERO, center=CENTER, mass=MASS, pitch=0.0):
    return trim_residual(forces, points, moments, center, number(mass), torch.as_tensor(pitch, dtype=torch.float64))


def random_loads(count=5, seed=1):
    generator = torch.Generator().manual_seed(seed)
    draw = torch.randn(2 * count + 1, 3, generator=generator, dtype=torch.float64)
    return 1e4 * draw[:count], 5.0 * draw[count:-1], 1e3 * draw[-1]


def about_y(angle):
    c, s = math.cos(angle), math.sin(angle)
    return torch.tensor([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], dtype=torch.float64)


def test_hover_on_four_equal_rotors_about_the_centre_of_gravity_is_trimmed():
    points = CENTER + torch.tensor([[2.0, 4.0, 1.0], [2.0, -4.0, 1.0], [-2.0, 4.0, 1.0], [-2.0, -4.0, 1.0]]).double()
    forces = vector(0.0, 0.0, WEIGHT / 4).expand(4, 3)
    result = residual(forces, points)
    torch.testing.assert_close(result.force, ZERO, rtol=0.0, atol=1e-10 * WEIGHT)
    torch.testing.assert_close(result.moment, ZERO, rtol=0.0, atol=1e-10 * WEIGHT)


def test_rotors_share_the_weight_as_a_beam_on_two_supports_does():
    # Front rotors 2 m ahead (x points aft), rear ones 3 m behind: the front ones carry 3/5.
    points = CENTER + torch.tensor([[-2.0, 0.0, 0.5], [3.0, 0.0, 0.5]], dtype=torch.float64)
    forces = torch.stack([vector(0, 0, 0.6 * WEIGHT), vector(0, 0, 0.4 * WEIGHT)])
    result = residual(forces, points)
    assert float(result.force.norm() + result.moment.norm()) < 1e-9 * WEIGHT


@pytest.mark.parametrize("path_angle", [0.0, 0.12, -0.2])
@pytest.mark.parametrize("angle_of_attack", [0.0, 0.06])
def test_steady_climb_needs_thrust_of_drag_plus_the_share_of_weight_along_the_path(path_angle, angle_of_attack):
    """Along the path T cos(a) = D + W sin(gamma), across it L + T sin(a) = W cos(gamma)."""
    drag = 2500.0
    thrust = (drag + WEIGHT * math.sin(path_angle)) / math.cos(angle_of_attack)
    lift = WEIGHT * math.cos(path_angle) - thrust * math.sin(angle_of_attack)
    c, s = math.cos(angle_of_attack), math.sin(angle_of_attack)
    forces = torch.stack([drag * vector(c, 0, s), lift * vector(-s, 0, c), thrust * vector(-1, 0, 0)])
    result = residual(forces, CENTER.expand(3, 3), pitch=path_angle + angle_of_attack)
    torch.testing.assert_close(result.force, ZERO, rtol=0.0, atol=1e-10 * WEIGHT)


@pytest.mark.parametrize(
    ("arm", "force", "moment"),
    [
        ((-2.0, 0.0, 0.0), (0.0, 0.0, 10.0), (0.0, 20.0, 0.0)),  # lift ahead of the centre raises the nose
        ((0.0, 0.0, 1.0), (10.0, 0.0, 0.0), (0.0, 10.0, 0.0)),  # drag above it does, too
        ((0.0, 0.0, -1.0), (-10.0, 0.0, 0.0), (0.0, 10.0, 0.0)),  # and thrust below it
        ((0.0, 3.0, 0.0), (0.0, 0.0, 10.0), (-30.0, 0.0, 0.0)),  # lift on starboard lowers the port wing
        ((0.0, 3.0, 0.0), (10.0, 0.0, 0.0), (0.0, 0.0, 30.0)),  # drag on starboard turns the nose to starboard
        ((4.0, 0.0, 0.0), (0.0, 10.0, 0.0), (0.0, 0.0, -40.0)),  # fin force to starboard turns the nose to port
    ],
)
def test_moments_have_the_signs_of_flight_mechanics(arm, force, moment):
    result = residual(vector(*force)[None], CENTER + vector(*arm)[None], mass=0.0)
    torch.testing.assert_close(result.moment, vector(*moment), rtol=0.0, atol=1e-12)


def test_weight_points_down_and_keeps_its_size_at_any_pitch():
    pitch = torch.linspace(-1.5, 1.5, 31, dtype=torch.float64)
    weight = gravity_force(number(MASS), pitch)
    torch.testing.assert_close(weight.norm(dim=-1), torch.full_like(pitch, WEIGHT), rtol=1e-14, atol=0.0)
    torch.testing.assert_close(gravity_force(number(MASS), number(0.0)), vector(0, 0, WEIGHT), rtol=0, atol=0)
    nose_up = gravity_force(number(MASS), number(0.5 * math.pi))  # then it points aft, x forward
    torch.testing.assert_close(nose_up, vector(-WEIGHT, 0, 0), rtol=0.0, atol=1e-9)


def test_body_axes_are_a_proper_rotation_of_the_geometry_axes():
    a, b = random_loads()[:2]
    cross = torch.linalg.cross(geometry_to_body(a), geometry_to_body(b))
    torch.testing.assert_close(cross, geometry_to_body(torch.linalg.cross(a, b)), rtol=1e-14, atol=1e-9)
    torch.testing.assert_close(geometry_to_body(a).norm(dim=-1), a.norm(dim=-1), rtol=1e-15, atol=0.0)


def test_mirrored_loads_give_mirrored_residuals():
    forces, points, moments = random_loads()
    mirror = vector(1.0, -1.0, 1.0)
    one = residual(forces, points, moments, pitch=0.1)
    other = residual(forces * mirror, points * mirror, -moments * mirror, CENTER * mirror, pitch=0.1)
    torch.testing.assert_close(other.force, one.force * mirror, rtol=1e-13, atol=1e-9)
    torch.testing.assert_close(other.moment, -one.moment * mirror, rtol=1e-13, atol=1e-8)


def test_turning_loads_and_weight_together_turns_the_residual():
    """Nose up by delta: gravity turns in body axes; loads that turn with it leave the same residual, turned."""
    forces, points, moments = random_loads()
    delta = 0.3
    # A pitch by delta turns vectors fixed in space by -delta about y in the axes that move with the aircraft.
    turn = about_y(-delta)
    one = residual(forces, points, moments, pitch=0.1)
    other = residual(forces @ turn.T, points @ turn.T, turn @ moments, turn @ CENTER, pitch=0.1 + delta)
    torch.testing.assert_close(other.force, turn @ one.force, rtol=1e-12, atol=1e-8)
    torch.testing.assert_close(other.moment, turn @ one.moment, rtol=1e-12, atol=1e-8)


def test_origin_does_not_matter():
    forces, points, moments = random_loads()
    shift = vector(4.0, -3.0, 7.0)
    one, other = residual(forces, points, moments), residual(forces, points + shift, moments, CENTER + shift)
    torch.testing.assert_close(other.force, one.force, rtol=0.0, atol=0.0)
    torch.testing.assert_close(other.moment, one.moment, rtol=1e-12, atol=1e-8)


def test_moving_the_centre_of_gravity_adds_the_moment_of_the_resultant():
    forces, points, moments = random_loads()
    shift = vector(0.2, -0.1, 0.3)
    change = residual(forces, points, moments, CENTER + shift).moment - residual(forces, points, moments).moment
    expected = geometry_to_body(-torch.linalg.cross(shift, forces.sum(0)))
    torch.testing.assert_close(change, expected, rtol=1e-10, atol=1e-8)


def test_a_couple_turns_without_pushing_wherever_the_centre_of_gravity_lies():
    forces = torch.stack([vector(0, 0, 500.0), vector(0, 0, -500.0)])
    points = torch.stack([vector(1.0, 2.0, 0.0), vector(1.0, -2.0, 0.0)])
    for center in (CENTER, ZERO):
        result = residual(forces, points, center=center, mass=0.0)
        torch.testing.assert_close(result.force, ZERO, rtol=0.0, atol=0.0)
        torch.testing.assert_close(result.moment, vector(-2000.0, 0.0, 0.0), rtol=0.0, atol=1e-10)


def test_scaled_residual_of_a_free_fall_is_one_weight():
    result = residual(torch.zeros(1, 3).double(), CENTER[None]).scaled(number(WEIGHT), number(7.0))
    torch.testing.assert_close(result, vector(0, 0, 1, 0, 0, 0), rtol=0.0, atol=1e-15)
    moment = residual(torch.zeros(1, 3).double(), CENTER[None], vector(0, 7.0 * WEIGHT, 0)).scaled(
        number(WEIGHT), number(7.0)
    )
    assert float(moment[4]) == pytest.approx(1.0, rel=1e-14)


def test_lift_at_the_stall_speed_carries_the_weight():
    speed = stall_speed(number(MASS), number(1.1), number(19.5), number(1.5))
    assert 0.5 * 1.1 * float(speed) ** 2 * 19.5 * 1.5 == pytest.approx(WEIGHT, rel=1e-14)


def test_gradient_equals_central_differences():
    forces, points, moments = random_loads()

    def both(x):
        result = trim_residual(forces * x[0], points * x[1], moments, x[2:5], MASS * x[5], x[6])
        return result.scaled(number(WEIGHT), number(7.0))

    x = vector(1.1, 0.9, 3.2, 0.1, 1.8, 1.2, 0.15)
    exact = torch.autograd.functional.jacobian(both, x)
    torch.testing.assert_close(exact, central_difference(both, x, 1e-3), rtol=1e-9, atol=1e-10)


def test_a_batch_of_segments_equals_a_loop():
    forces, points, moments = random_loads()
    pitch = vector(0.0, 0.1, -0.2)
    batch = trim_residual(forces.expand(3, 5, 3), points, moments.expand(3, 3), CENTER, number(MASS), pitch)
    for i in range(3):
        one = residual(forces, points, moments, pitch=pitch[i])
        torch.testing.assert_close(batch.force[i], one.force, rtol=1e-14, atol=1e-9)
        torch.testing.assert_close(batch.moment[i], one.moment, rtol=1e-14, atol=1e-8)


@pytest.mark.parametrize("bank", [0.2, 0.7])
def test_coordinated_turn_needs_the_load_factor_of_its_bank(bank):
    """Lift W/cos(bank) along -z, turn rate g tan(bank)/V: nothing is left of force or, turning slowly, of moment."""
    speed = 60.0
    rate = GRAVITY * math.tan(bank) / speed
    turn = vector(0.0, rate * math.sin(bank), rate * math.cos(bank))  # about the vertical, level flight
    lift = vector(0.0, 0.0, WEIGHT / math.cos(bank))
    loads = trim_residual(lift[None], CENTER[None], ZERO, CENTER, number(MASS), number(0.0), number(bank))
    sphere = 500.0 * torch.eye(3, dtype=torch.float64)
    left = maneuver_residual(loads, number(MASS), sphere, Maneuver(vector(speed, 0, 0), turn, ZERO, ZERO))
    torch.testing.assert_close(left.force, ZERO, rtol=0.0, atol=1e-9 * WEIGHT)
    torch.testing.assert_close(left.moment, ZERO, rtol=0.0, atol=1e-9)


def test_acceleration_takes_mass_times_itself_and_torque_inertia_times_turn_acceleration():
    inertia = torch.diag(vector(100.0, 200.0, 300.0))
    loads = residual(torch.zeros(1, 3).double(), CENTER[None], geometry_to_body(vector(10.0, 20.0, 30.0)), mass=0.0)
    maneuver = Maneuver(ZERO, ZERO, vector(1.0, 2.0, 3.0), vector(0.1, 0.1, 0.1))
    left = maneuver_residual(loads, number(MASS), inertia, maneuver)
    torch.testing.assert_close(left.force, -MASS * vector(1.0, 2.0, 3.0), rtol=1e-14, atol=0.0)
    torch.testing.assert_close(left.moment, ZERO, rtol=0.0, atol=1e-12)


def test_free_tumbling_about_a_skew_axis_needs_eulers_torque():
    """Torque-free rotation: d(omega)/dt = -I^-1 (omega x I omega) leaves no residual."""
    inertia = torch.tensor([[100.0, 5.0, -8.0], [5.0, 250.0, 3.0], [-8.0, 3.0, 310.0]], dtype=torch.float64)
    turn = vector(0.3, -0.8, 1.1)
    change = -torch.linalg.solve(inertia, torch.linalg.cross(turn, inertia @ turn))
    free_fall = trim_residual(torch.zeros(1, 3).double(), CENTER[None], ZERO, CENTER, number(0.0), number(0.0))
    left = maneuver_residual(free_fall, number(0.0), inertia, Maneuver(ZERO, turn, ZERO, change))
    torch.testing.assert_close(left.moment, ZERO, rtol=0.0, atol=1e-11)


def everything(forces, points, moments, center, mass, pitch, bank):
    loads = trim_residual(forces, points, moments, center, mass, pitch, bank)
    maneuver = Maneuver(center, moments, points[..., 0, :], forces[..., 0, :])
    inertia = torch.eye(3, dtype=forces.dtype) * mass[..., None, None]
    left = maneuver_residual(loads, mass, inertia, maneuver)
    return left.scaled(mass, 1.0 + mass), stall_speed(mass, 1.0 + mass, 1.0 + mass**2, mass)


def random_arguments(*batch, dtype=torch.float64):
    generator = torch.Generator().manual_seed(4)
    shapes = [(*batch, 3, 3), (*batch, 3, 3), (*batch, 3), (*batch, 3), batch, batch, batch]
    drawn = [torch.rand(shape, generator=generator, dtype=torch.float64).to(dtype) for shape in shapes]
    return drawn


def test_first_and_second_derivatives_pass_gradcheck():
    inputs = [value.requires_grad_() for value in random_arguments(2)]
    assert torch.autograd.gradcheck(everything, inputs)
    assert torch.autograd.gradgradcheck(everything, inputs)


def test_single_precision_empty_batches_and_undefined_elements():
    single, double = everything(*random_arguments(4, dtype=torch.float32)), everything(*random_arguments(4))
    assert single[0].dtype == torch.float32
    torch.testing.assert_close(single[0].double(), double[0], rtol=1e-4, atol=1e-4)
    assert everything(*random_arguments(0))[0].shape == (0, 6)
    inputs = random_arguments(3)
    inputs[4] = inputs[4].clone()
    inputs[4][1] = math.nan
    assert everything(*inputs)[0].isnan().any(-1).tolist() == [False, True, False]
