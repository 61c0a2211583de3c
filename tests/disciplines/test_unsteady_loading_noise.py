"""Tones of load fluctuations: limits to the steady theory, circling forces in the time domain, and the rotor's axis."""

import math

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.disciplines.tonal_noise import BladeLoading, barry_magliozzi
from lpc_mdo.disciplines.unsteady_loading_noise import (
    LoadingHarmonics,
    LoadingLaw,
    loading_harmonics_noise,
    lowson_noise,
)

SOUND, SPEED = 340.0, 115.0
BELOW = math.pi


def a_loading(thrust=1.0, torque=1.0, chord=0.2, speed=SPEED, radius=1.5, blades=2.0):
    """Loads proportional to r^2; `thrust` and `torque` scale 4 kN and 600 N m."""
    r = radius * torch.linspace(0.2, 1.0, 20, dtype=torch.float64)
    shape = r**2 / (r**2).sum() / (r[1] - r[0])
    return BladeLoading(
        radius=r,
        width=(r[1] - r[0])[None],
        thrust_per_length=4000.0 * thrust * shape,
        torque_per_length=600.0 * torque * shape,
        chord=chord * torch.ones_like(r),
        thickness_to_chord=0.12,
        pitch_angle=torch.full_like(r, 0.1),
        blades=number(blades),
        rotation_speed=torch.as_tensor(speed, dtype=torch.float64),
        density=number(1.2),
        speed_of_sound=number(SOUND),
    )


def fluctuating(loading, shares):
    """Loads whose order s is `shares[s]` of the steady one."""
    shares = torch.tensor(shares, dtype=torch.complex128)[:, None]
    return LoadingHarmonics(shares * loading.thrust_per_length, shares * loading.torque_per_length)


def at(angle, distance=76.2):
    """Axial distance and distance of an observer at `angle` rad from the thrust's direction."""
    return number(distance * math.cos(angle)), number(distance)


@pytest.mark.parametrize("angle", [0.3, 1.2, 0.5 * math.pi, 2.0, 2.9])
@pytest.mark.parametrize("mach", [0.0, 0.3])
@pytest.mark.parametrize("blades", [2.0, 5.0])
def test_steady_loads_sound_as_in_the_theory_of_barry_and_magliozzi(angle, mach, blades):
    loading = a_loading(blades=blades)
    ours = loading_harmonics_noise(loading, fluctuating(loading, [1.0]), *at(angle), number(0.7), 4, mach)
    theirs = barry_magliozzi(loading, *at(angle), 4, mach).loading
    torch.testing.assert_close(ours, theirs, rtol=1e-10, atol=0.0)
    silent = lowson_noise(loading, *at(angle), 4, LoadingLaw(fluctuation=0.0), mach)
    torch.testing.assert_close(silent.loading, theirs, rtol=1e-12, atol=0.0)


def test_steady_loads_are_silent_on_the_axis_and_fluctuating_ones_are_not():
    loading = a_loading()
    steady = loading_harmonics_noise(loading, fluctuating(loading, [1.0]), *at(BELOW), number(0.0), 3)
    aside = barry_magliozzi(loading, *at(2.0), 3).loading
    assert bool((steady < 1e-15 * aside).all())
    assert bool((lowson_noise(loading, *at(BELOW), 3).loading > 1e6 * steady).all())


@pytest.mark.parametrize("harmonic", [1, 2, 3])
def test_on_the_axis_only_the_load_that_repeats_with_the_tone_is_heard(harmonic):
    """p = sqrt(2) k B |integral of T_n| / (4 pi S), n = m B; torque and every other order are silent."""
    loading, n = a_loading(), 2 * harmonic
    shares = [1.0] + [0.3] * 8
    shares[n] = 0.1j
    ours = loading_harmonics_noise(loading, fluctuating(loading, shares), *at(BELOW), number(0.4), 4)[harmonic - 1]
    expected = math.sqrt(2.0) * n * SPEED / SOUND * 0.1 * 4000.0 / (4.0 * math.pi * 76.2)
    # The observer stands 1e-6 rad off the axis.
    assert float(ours.sqrt()) == pytest.approx(expected, rel=1e-4)


def circling_force(order, shares, mach, observer, thrust, drag, radius):
    """rms pressure at `order` x speed of one blade's forces on the air, from first principles.

    The blade circles from y towards z, seen from where the thrust (+x) points, and moves along +x at `mach` with the
    observer. Emission times are uniform over a turn; reception times solve |observer(t) - source| = c x delay. Pressure:
    minus the divergence of force x Green's function.
    """
    x = torch.tensor(observer, dtype=torch.float64, requires_grad=True)
    psi = 2.0 * math.pi * torch.arange(512, dtype=torch.float64) / 512
    cos, sin, zero = torch.cos(psi), torch.sin(psi), torch.zeros_like(psi)
    load = sum((1.0 if s == 0 else 2.0) * (share * torch.exp(1j * s * psi)).real for s, share in enumerate(shares))
    flight = mach * SOUND
    arm = x - radius * torch.stack([zero, cos, sin], dim=-1)
    along, gap = arm[:, 0] * flight, SOUND**2 - flight**2
    delay = (along + torch.sqrt(along**2 + gap * (arm**2).sum(-1))) / gap
    convection = 1.0 - (arm[:, 0] + flight * delay) * flight / (SOUND**2 * delay)
    phase = order * (psi + SPEED * delay)
    force = load[:, None] * torch.stack([torch.full_like(zero, -thrust), -drag * sin, drag * cos], dim=-1)
    parts = []
    for wave in (torch.cos, torch.sin):
        green = wave(phase) / (4.0 * math.pi * SOUND * delay * convection)
        gradients = (torch.autograd.grad((force[:, i] * green).mean(), x, retain_graph=True)[0][i] for i in range(3))
        parts.append(float(sum(gradients)))
    return math.sqrt(2.0) * math.hypot(*parts)


@pytest.mark.parametrize("mach", [0.0, 0.3])
@pytest.mark.parametrize("angle_deg", [0.0, 20.0, 90.0, 150.0, 180.0])
@pytest.mark.parametrize("azimuth", [0.0, 2.0])
@pytest.mark.parametrize(("blades", "harmonic"), [(2, 1), (3, 2)])
def test_tones_are_those_of_circling_forces_that_vary_around_the_turn(mach, angle_deg, azimuth, blades, harmonic):
    # A chord too small to spread the load; the far field neglects radius/distance = 1e-6.
    radius, width, thrust, torque, distance = 1.2, 0.1, 3000.0, 500.0, 1.2e6
    shares = [1.0, 0.2 + 0.1j, -0.1, 0.05j, 0.03, 0.02 - 0.02j, 0.04, 0.01j]
    one = torch.ones(1, dtype=torch.float64)
    loading = BladeLoading(
        radius * one, width * one, thrust / width * one, torque / width * one, 1e-4 * one, 0.12, 0.0 * one,
        number(float(blades)), number(SPEED), number(1.2), number(SOUND),
    )  # fmt: skip
    angle = math.radians(angle_deg)
    ours = loading_harmonics_noise(
        loading, fluctuating(loading, shares), *at(angle, distance), number(azimuth), harmonic, mach
    )[-1]
    lateral = distance * math.sin(angle)
    place = [distance * math.cos(angle), lateral * math.cos(azimuth), lateral * math.sin(azimuth)]
    one_blade = circling_force(
        blades * harmonic, shares, mach, place, thrust / blades, torque / radius / blades, radius
    )
    assert float(ours.sqrt()) == pytest.approx(blades * one_blade, rel=3e-5)


def test_random_phases_add_the_energies_of_all_orders():
    """Averaged over the phases 0 and 90 degrees, the parts s and -s of one order do not interfere."""
    loading, law, place = a_loading(), LoadingLaw(0.2, 1.5), at(2.2)
    energy = barry_magliozzi(loading, *place, 2).loading
    for s in range(1, 30):
        for phase in (1.0, 1j):
            shares = [0.0] * s + [phase * law.fluctuation * s**-law.decay]
            alone = loading_harmonics_noise(loading, fluctuating(loading, shares), *place, number(0.3), 2)
            energy = energy + 0.5 * alone
    torch.testing.assert_close(lowson_noise(loading, *place, 2, law).loading, energy, rtol=1e-12, atol=0.0)


def test_fluctuations_dominate_near_the_axis_and_steady_loads_near_the_disk():
    loading = a_loading()
    for angle, is_dominant in ((BELOW - math.radians(5.0), True), (math.radians(120.0), False)):
        both, steady = (noise(loading, *at(angle), 1).loading for noise in (lowson_noise, barry_magliozzi))
        assert (float(both) > 10.0 * float(steady)) == is_dominant
        assert float(both) > float(steady)
        if not is_dominant:
            assert float(both) < 1.1 * float(steady)


def test_the_level_has_a_flat_maximum_on_the_axis_when_only_axial_fluctuations_are_near():
    heights = [lowson_noise(a_loading(), *at(BELOW - e), 1).loading[0] for e in (0.0, 0.005, 0.01)]
    first, second = (float(h / heights[0]) - 1.0 for h in heights[1:])
    assert abs(second) < 2e-3
    assert second / first == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize(("change", "rise"), [("fluctuation", 6.0206), ("distance", -6.0206)])
def test_scaling_laws_on_the_axis(change, rise):
    law = LoadingLaw(0.1 if change == "fluctuation" else 0.05)
    place = at(BELOW, 152.4 if change == "distance" else 76.2)
    ratio = lowson_noise(a_loading(), *place, 3, law).loading / lowson_noise(a_loading(), *at(BELOW), 3).loading
    torch.testing.assert_close(10.0 * torch.log10(ratio), torch.full((3,), rise).double(), rtol=0.0, atol=1e-4)


def test_more_blades_at_equal_loads_are_quieter_on_the_axis():
    # The tone's amplitude on the axis falls as n k_n ~ n x n^-decay.
    few, many = (lowson_noise(a_loading(blades=b), *at(BELOW), 1).loading for b in (2.0, 4.0))
    assert float(10.0 * torch.log10(few / many)) == pytest.approx(20.0 * math.log10(2.0), abs=1e-3)


@pytest.mark.parametrize("angle", [2.2, 3.0])
def test_gradient_equals_central_differences(angle):
    def levels(x):
        loading = a_loading(thrust=x[0], torque=x[1], chord=x[2], speed=x[3], radius=x[4])
        return 10.0 * torch.log10(lowson_noise(loading, x[5], x[6], 2).pressure_squared)

    height = 76.2 * math.cos(angle)
    x = torch.tensor([1.0, 1.0, 0.2, 115.0, 1.5, height, 76.2], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(levels, x)
    torch.testing.assert_close(exact, central_difference(levels, x, 1e-4), rtol=1e-6, atol=1e-6)


def test_energy_has_a_finite_gradient_on_the_axis():
    height = number(-76.2).requires_grad_()
    noise = lowson_noise(a_loading(), height, number(76.2), 2)
    (gradient,) = torch.autograd.grad(noise.pressure_squared.sum(), height)
    assert bool(gradient.isfinite())


def test_observers_and_rotors_of_different_blade_number_broadcast():
    heights = torch.tensor([-76.2, -70.0, 30.0], dtype=torch.float64)
    two, three = (lowson_noise(a_loading(blades=b), heights, number(76.2).expand(3), 2).loading for b in (2.0, 3.0))
    loading = a_loading()
    stacked = BladeLoading(
        **{name: getattr(loading, name) for name in loading.__dataclass_fields__}
        | {"blades": torch.tensor([[2.0], [3.0]], dtype=torch.float64)}
    )
    both = lowson_noise(stacked, heights.expand(2, 3), number(76.2).expand(2, 3), 2).loading
    torch.testing.assert_close(both[1], three, rtol=1e-12, atol=0.0)
    # The three-bladed rotor's higher orders are summed for both; they add next to nothing to the two-bladed.
    torch.testing.assert_close(both[0], two, rtol=1e-3, atol=0.0)


def test_no_harmonics_are_refused():
    with pytest.raises(ValueError, match="harmonics = 0 is not allowed"):
        lowson_noise(a_loading(), *at(2.0), 0)
