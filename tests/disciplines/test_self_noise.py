"""Airfoil self-noise and its average over a rotor's turn: scaling laws, symmetry, limits; its tables are on the verification page."""

import math
from dataclasses import replace

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.disciplines.airfoil_self_noise import (
    Listener,
    Section,
    displacement_thickness,
    laminar_vortex_noise,
    tip_vortex_noise,
    trailing_edge_noise,
)
from lpc_mdo.disciplines.hover_noise import hover_noise
from lpc_mdo.disciplines.rotor_self_noise import blade_strips, heard_over_a_turn, rotor_self_noise
from lpc_mdo.disciplines.sound import third_octave_centers
from lpc_mdo.disciplines.tonal_noise import BladeLoading

BANDS = third_octave_centers()
ABOVE = Listener(number(1.22), number(0.0), number(1.0))
STATIONS = 12


def a_section(speed=71.3, degrees=3.0, chord=0.3, span=0.5):
    return Section(*(number(v) for v in (speed, chord, span, math.radians(degrees), 340.0, 1.46e-5)))


def decibels(a, b):
    return float(10.0 * torch.log10(a / b))


def a_rotor(blades=2.0, speed=115.0, density=1.2):
    r = 1.5 * (0.2 + 0.8 * (torch.arange(STATIONS, dtype=torch.float64) + 0.5) / STATIONS)
    one = torch.ones_like(r)
    return BladeLoading(
        r, number(0.1)[None], 1500.0 * r, 150.0 * r, 0.2 * one, 0.12, 0.15 * one, *(number(v) for v in (blades, speed, density, 340.0))
    )  # fmt: skip


ALPHA = torch.linspace(0.05, 0.02, STATIONS, dtype=torch.float64)


def arm(elevation_deg, distance=76.2, azimuth=0.0):
    below = math.radians(elevation_deg)
    across = distance * math.cos(below)
    values = [across * math.cos(azimuth), across * math.sin(azimuth), -distance * math.sin(below)]
    return torch.tensor(values, dtype=torch.float64)


@pytest.mark.parametrize("degrees", [0.0, 4.0, 15.0])
def test_levels_follow_distance_and_span(degrees):
    section = a_section(degrees=degrees)
    near = trailing_edge_noise(section, ABOVE, BANDS, "tripped").total.sum()
    far = trailing_edge_noise(section, replace(ABOVE, distance=number(2.44)), BANDS, "tripped").total.sum()
    wide = trailing_edge_noise(replace(section, span=number(1.0)), ABOVE, BANDS, "tripped").total.sum()
    assert decibels(near, far) == pytest.approx(20.0 * math.log10(2.0), abs=1e-9)
    assert decibels(wide, near) == pytest.approx(10.0 * math.log10(2.0), abs=1e-9)


def test_edge_noise_grows_with_about_the_fifth_power_of_speed():
    # Ffowcs Williams and Hall (1970): an edge scatters with the fifth power; the boundary layer thins meanwhile.
    slow, fast = (
        trailing_edge_noise(a_section(speed=v, degrees=0.0, chord=1.0), ABOVE, BANDS, "tripped").total.sum()
        for v in (40.0, 80.0)
    )
    assert 4.3 < decibels(fast, slow) / (10.0 * math.log10(2.0)) < 5.2


def test_either_sign_of_the_angle_sounds_alike_and_more_angle_is_louder():
    up, down = (trailing_edge_noise(a_section(degrees=d), ABOVE, BANDS, "tripped").total for d in (3.0, -3.0))
    torch.testing.assert_close(up, down)
    levels = [trailing_edge_noise(a_section(degrees=d), ABOVE, BANDS, "tripped").total.sum() for d in (0, 2, 4, 6, 8)]
    assert levels == sorted(levels)


def test_stalled_flow_leaves_the_separated_part_alone():
    noise = trailing_edge_noise(a_section(degrees=14.0), ABOVE, BANDS, "tripped")
    assert float(noise.pressure_side.abs().max()) == float(noise.suction_side.abs().max()) == 0.0
    assert float(noise.separation.sum()) > 0.0


def test_tripping_thickens_the_boundary_layer():
    tripped, free = (displacement_thickness(a_section(), kind) for kind in ("tripped", "untripped"))
    assert all(float(a) > 1.5 * float(b) for a, b in zip(tripped, free, strict=True))
    assert float(tripped[1]) > float(tripped[0])
    with pytest.raises(ValueError, match="boundary_layer = 'rough' is not allowed"):
        displacement_thickness(a_section(), "rough")


@pytest.mark.parametrize(
    ("ends", "boundary_layer"), [((5.0, 12.5), "tripped"), ((7.5, 12.5), "untripped")], ids=["tripped", "untripped"]
)
def test_the_fit_is_continuous_to_the_digits_of_its_constants(ends, boundary_layer):
    for end in ends:
        below, above = (displacement_thickness(a_section(degrees=end + d), boundary_layer)[1] for d in (-1e-9, 1e-9))
        assert float(above / below) == pytest.approx(1.0, abs=0.02)


def test_an_edge_is_silent_downstream_and_along_the_span():
    section, mach = a_section(), number(0.2)
    behind, aside = replace(ABOVE, downstream_cosine=number(1.0)), replace(ABOVE, normal_share=number(0.0))
    for listener in (behind, aside):
        assert float(trailing_edge_noise(section, listener, BANDS, "tripped").total.max()) == 0.0
    ahead = replace(ABOVE, downstream_cosine=number(-0.7))
    assert float(ahead.high_frequency(mach)) > float(ABOVE.high_frequency(mach)) == 1.0
    assert float(ABOVE.low_frequency(mach)) == 1.0


def test_tip_and_laminar_vortices_peak_where_they_are_said_to():
    """Tip: Strouhal number 0.5 of extent and speed; laminar: near 0.28 of the layer's thickness at high Reynolds numbers."""
    fine = torch.logspace(2.0, 4.6, 4001, dtype=torch.float64)
    section = a_section(degrees=5.0)
    peak = float(fine[tip_vortex_noise(section, ABOVE, fine).argmax()])
    extent, speed = 0.008 * 5.0 * 0.3, (1.0 + 0.036 * 5.0) * 71.3
    assert peak * extent / speed == pytest.approx(10.0**-0.3, rel=2e-3)
    section = a_section(degrees=0.0)
    log = math.log10(71.3 * 0.3 / 1.46e-5)
    thickness = 0.3 * 10.0 ** (1.6569 - 0.9045 * log + 0.0596 * log**2)
    peak = float(fine[laminar_vortex_noise(section, ABOVE, fine).argmax()])
    assert peak * thickness / 71.3 == pytest.approx(0.28, rel=2e-3)


def test_a_slow_rotor_sounds_as_its_strips_at_rest_would_on_its_axis():
    """Without Mach number towards the observer and with flat blades the average over the turn is the sum of the strips."""
    rotor = replace(a_rotor(), pitch_angle=torch.zeros(STATIONS, dtype=torch.float64))
    strips, place = blade_strips(rotor, ALPHA), arm(90.0, 1e4)

    def edge(strip, listener, frequency):
        return trailing_edge_noise(strip, listener, frequency, "tripped").total

    listener = Listener(number(1e4), number(0.0), number(1.0))
    straight = 2.0 * edge(strips, listener, BANDS.expand(STATIONS, -1)).sum(-2)
    torch.testing.assert_close(heard_over_a_turn(rotor, strips, place, BANDS, edge), straight, rtol=1e-3, atol=0.0)


def test_rotor_noise_follows_distance_blades_and_symmetry():
    rotor = a_rotor()
    level = rotor_self_noise(rotor, ALPHA, arm(45.0)).overall
    assert decibels(level, rotor_self_noise(rotor, ALPHA, arm(45.0, 152.4)).overall) == pytest.approx(6.02, abs=0.02)
    assert decibels(rotor_self_noise(a_rotor(blades=4.0), ALPHA, arm(45.0)).overall, level) == pytest.approx(
        3.0103, abs=1e-4
    )
    around = rotor_self_noise(rotor, ALPHA, arm(45.0, azimuth=1.3)).overall
    assert decibels(around, level) == pytest.approx(0.0, abs=0.01)
    fine = rotor_self_noise(rotor, ALPHA, arm(45.0), azimuths=128).overall
    assert decibels(fine, level) == pytest.approx(0.0, abs=0.01)


def test_rotor_noise_is_loudest_towards_the_axis():
    levels = [rotor_self_noise(a_rotor(), ALPHA, arm(angle)).overall for angle in (5.0, 30.0, 60.0, 90.0)]
    assert levels[0] < levels[1] < levels[2] < levels[3]


def test_untripped_blades_add_the_tones_of_their_laminar_layer():
    rotor = replace(a_rotor(speed=30.0), chord=torch.full((STATIONS,), 0.08, dtype=torch.float64))
    free = rotor_self_noise(rotor, ALPHA, arm(60.0), zero_lift_angle=0.0, boundary_layer="untripped")
    turbulent, laminar, tip = (
        heard_over_a_turn(rotor, blade_strips(rotor, ALPHA), arm(60.0), BANDS, source, stations=stations)
        for source, stations in (
            (lambda *at: trailing_edge_noise(*at, "untripped").total, slice(None)),
            (laminar_vortex_noise, slice(None)),
            (tip_vortex_noise, slice(-1, None)),
        )
    )
    torch.testing.assert_close(free.bands, turbulent + laminar + tip)
    assert float(laminar.sum()) > float(turbulent.sum())  # a small, slow rotor: Reynolds numbers of some 1e5
    with pytest.raises(ValueError, match="azimuths = 0 is not allowed"):
        rotor_self_noise(rotor, ALPHA, arm(60.0), azimuths=0)


def test_gradient_equals_central_differences():
    def level(x):
        rotor = replace(a_rotor(), chord=x[0] * torch.ones(STATIONS).double(), rotation_speed=100.0 * x[1])
        return torch.log10(rotor_self_noise(rotor, x[2] * ALPHA, arm(70.0)).overall)[None]

    x = torch.tensor([0.2, 1.15, 0.9], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(level, x)
    # A small step, lest a strip passes a kink of the fits within it.
    torch.testing.assert_close(exact, central_difference(level, x, 1e-7), rtol=1e-5, atol=1e-7)


def test_hovering_rotors_are_heard_through_the_common_interface():
    rotor = a_rotor()
    several = BladeLoading(
        *(v[None].expand(3, *v.shape) if isinstance(v, torch.Tensor) and v.dim() else v if not isinstance(v, torch.Tensor) else v.expand(3) for v in vars(rotor).values())
    )  # fmt: skip
    hubs = torch.tensor([[0.0, -4.0, 0.0], [0.0, 0.0, 0.0], [0.0, 4.0, 0.0]], dtype=torch.float64)
    radius, thrust = torch.full((3,), 1.5).double(), torch.full((3,), 4000.0).double()
    heard = hover_noise(
        several, thrust, radius, ALPHA.expand(3, -1), hubs, arm(85.0), broadband_model="brooks_pope_marcolini"
    )
    alone = [rotor_self_noise(rotor, ALPHA, arm(85.0) - hub).overall for hub in hubs]
    torch.testing.assert_close(heard.broadband.overall, torch.stack(alone))
    assert heard.broadband.bands.shape == (3, len(BANDS))
    with pytest.raises(ValueError, match="or 'brooks_pope_marcolini'"):
        hover_noise(several, thrust, radius, ALPHA.expand(3, -1), hubs, arm(85.0), broadband_model="loud")
