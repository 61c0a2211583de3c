"""Levels, A-weighting and what an observer hears of several hovering rotors."""

import math
from dataclasses import replace

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.cases.noise import WeightingInputs, analyze_weighting
from lpc_mdo.disciplines.hover_noise import hover_noise, observer_position
from lpc_mdo.disciplines.sound import a_weighting, a_weighting_factor, sound_pressure_level, squared_pressure
from lpc_mdo.disciplines.tonal_noise import BladeLoading

# IEC 61672-1:2013 table 3: nominal frequency, A-weighting in dB, rounded to 0.1 dB.
IEC_TABLE = [
    (10, -70.4), (12.5, -63.4), (16, -56.7), (20, -50.5), (25, -44.7), (31.5, -39.4), (40, -34.6), (50, -30.2),
    (63, -26.2), (80, -22.5), (100, -19.1), (125, -16.1), (160, -13.4), (200, -10.9), (250, -8.6), (315, -6.6),
    (400, -4.8), (500, -3.2), (630, -1.9), (800, -0.8), (1000, 0.0), (1250, 0.6), (1600, 1.0), (2000, 1.2),
    (2500, 1.3), (3150, 1.2), (4000, 1.0), (5000, 0.5), (6300, -0.1), (8000, -1.1), (10000, -2.5), (12500, -4.3),
    (16000, -6.6), (20000, -9.3),
]  # fmt: skip


def test_weighting_equals_the_reference_evaluation(reference):
    case = reference("noise_a_weighting")
    ours = analyze_weighting(WeightingInputs.model_validate(case["inputs"]), [], None)
    assert ours == pytest.approx(case["results"], abs=1e-9)


def test_weighting_equals_the_table_of_the_standard_at_exact_frequencies():
    # The table's values belong to the base-ten frequencies behind the nominal ones and carry one digit.
    for j, (nominal, table) in enumerate(IEC_TABLE, start=-20):
        exact = 1000.0 * 10.0 ** (j / 10)
        assert nominal == pytest.approx(exact, rel=0.025)
        assert float(a_weighting(number(exact))) == pytest.approx(table, abs=0.0501)


def test_weighting_is_zero_at_one_kilohertz():
    # The standard's offset of 2.000 dB has three digits.
    assert float(a_weighting(number(1000.0))) == pytest.approx(0.0, abs=5e-4)


def test_weighting_falls_by_24_decibels_an_octave_at_the_bottom_and_by_12_at_the_top():
    rise = a_weighting(torch.tensor([0.02, 0.01, 1e7, 2e7], dtype=torch.float64))
    assert float(rise[0] - rise[1]) == pytest.approx(80 * math.log10(2), abs=1e-3)
    assert float(rise[2] - rise[3]) == pytest.approx(40 * math.log10(2), abs=1e-3)


def test_one_pascal_is_94_decibels_and_the_threshold_of_hearing_zero():
    assert float(sound_pressure_level(number(1.0))) == pytest.approx(93.979, abs=1e-3)
    # The floor of 1e-7 Pa lifts the threshold by 1e-4 dB.
    assert float(sound_pressure_level(number(20e-6**2))) == pytest.approx(0.0, abs=2e-4)
    assert float(sound_pressure_level(number(0.0))) == pytest.approx(-46.02, abs=1e-2)


def test_two_equal_sources_are_three_decibels_louder_than_one_and_ten_are_ten():
    energy = squared_pressure(number(61.5))
    assert float(sound_pressure_level(2 * energy)) == pytest.approx(61.5 + 3.0103, abs=1e-5)
    assert float(sound_pressure_level(10 * energy)) == pytest.approx(71.5, abs=1e-9)


def test_level_and_energy_are_inverse():
    levels = torch.linspace(30.0, 130.0, 21, dtype=torch.float64)
    torch.testing.assert_close(sound_pressure_level(squared_pressure(levels)), levels, rtol=0.0, atol=2e-7)


def test_gradients_of_levels_equal_central_differences_and_stay_finite_in_silence():
    def total(x):
        return sound_pressure_level((a_weighting_factor(x[:2]) * squared_pressure(x[2:])).sum()).reshape(1)

    x = torch.tensor([90.0, 400.0, 70.0, 65.0], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(total, x)
    torch.testing.assert_close(exact, central_difference(total, x, 1e-2), rtol=1e-8, atol=0.0)
    silence = number(0.0).requires_grad_()
    assert bool(torch.autograd.grad(sound_pressure_level(silence), silence)[0].isfinite())


STATIONS = torch.linspace(0.35, 1.5, 24, dtype=torch.float64)


def rotors(count, speed=115.0, chord=0.2, load=1.0):
    """Loading, thrust, radius and angle of attack of equal rotors."""
    r = STATIONS.expand(count, -1)
    shape = r**2 / (r**2).sum(-1, keepdim=True) / (r[:, 1:2] - r[:, :1])
    one = torch.ones(count, dtype=torch.float64)
    loading = BladeLoading(
        r, r[:, 1:2] - r[:, :1], 4000.0 * load * shape, 600.0 * load * shape, chord * torch.ones_like(r), 0.12,
        torch.full_like(r, 0.1), 2.0 * one, speed * one, 1.2 * one, 340.0 * one,
    )  # fmt: skip
    return loading, 4000.0 * load * one, 1.5 * one, torch.full_like(r, 0.08)


def an_aircraft(half_span=5.0):
    """Hubs (8, 3) in geometry axes, symmetric to y = 0."""
    places = [(x, s * y * half_span, 2.0) for x in (1.5, 5.8) for y in (0.45, 1.0) for s in (-1, 1)]
    return torch.tensor(places, dtype=torch.float64)


@pytest.mark.parametrize("convention", ["per_band", "lsdo_acoustics_2023", "acoustics_2022"])
def test_eight_rotors_sound_as_the_sum_of_their_energies(convention):
    hubs, observer = an_aircraft(), torch.tensor([-40.0, 15.0, -50.0], dtype=torch.float64)
    total = hover_noise(*rotors(8), hubs, observer, convention)
    alone = [hover_noise(*rotors(1), hub[None], observer, convention) for hub in hubs]
    for name in ("total_dba", "tonal_dba", "broadband_dba", "total_db"):
        energy = sum(squared_pressure(getattr(one, name)) for one in alone)
        # Each level alone carries the floor of 1e-14 Pa^2.
        assert float(getattr(total, name)) == pytest.approx(float(sound_pressure_level(energy)), abs=1e-6)
    torch.testing.assert_close(total.rotor_dba, torch.stack([one.total_dba for one in alone]), rtol=1e-12, atol=0.0)


def test_eight_equal_rotors_at_one_place_are_nine_decibels_louder_than_one():
    hubs, observer = torch.zeros(8, 3, dtype=torch.float64), torch.tensor([-50.0, 0.0, -50.0], dtype=torch.float64)
    gain = hover_noise(*rotors(8), hubs, observer).total_dba - hover_noise(*rotors(1), hubs[:1], observer).total_dba
    assert float(gain) == pytest.approx(10 * math.log10(8), abs=1e-6)


@pytest.mark.parametrize("convention", ["per_band", "lsdo_acoustics_2023", "acoustics_2022"])
def test_total_is_the_energy_of_tones_and_broadband(convention):
    result = hover_noise(*rotors(8), an_aircraft(), torch.tensor([-40.0, 0.0, -50.0]).double(), convention)
    energy = squared_pressure(result.tonal_dba) + squared_pressure(result.broadband_dba)
    assert float(result.total_dba) == pytest.approx(float(sound_pressure_level(energy)), abs=1e-6)
    assert float(result.total_dba) < float(result.total_db)


def test_doubling_the_distance_of_one_rotor_lowers_its_level_by_six_decibels():
    center = torch.tensor([1.0, -2.0, 3.0], dtype=torch.float64)
    near, far = (
        hover_noise(*rotors(1), center[None], observer_position(center, s, math.radians(50.0))) for s in (60.0, 120.0)
    )
    for name in ("total_dba", "tonal_dba", "broadband_dba", "total_db"):
        assert float(getattr(near, name) - getattr(far, name)) == pytest.approx(6.0206, abs=1e-4)


def test_observer_stands_below_and_ahead_at_the_given_distance_and_elevation():
    center = torch.tensor([3.0, 1.0, 2.0], dtype=torch.float64)
    offset = observer_position(center, 76.2, math.radians(85.0)) - center
    assert float(torch.linalg.vector_norm(offset)) == pytest.approx(76.2, rel=1e-12)
    assert float(offset[2]) == pytest.approx(-76.2 * math.sin(math.radians(85.0)), rel=1e-12)
    assert float(offset[0]) < 0.0  # x points aft
    assert float(offset[1]) == 0.0


def test_mirrored_observer_hears_the_same():
    left, right = (torch.tensor([-30.0, y, -50.0], dtype=torch.float64) for y in (-25.0, 25.0))
    levels = [float(hover_noise(*rotors(8), an_aircraft(), o).total_dba) for o in (left, right)]
    assert levels[0] == pytest.approx(levels[1], abs=1e-9)


def test_level_does_not_depend_on_the_origin_or_the_heading():
    hubs, observer = an_aircraft(), torch.tensor([-30.0, 20.0, -50.0], dtype=torch.float64)
    here = hover_noise(*rotors(8), hubs, observer).total_dba
    turn = torch.tensor([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    shift = torch.tensor([5.0, -7.0, 2.0], dtype=torch.float64)
    there = hover_noise(*rotors(8), hubs @ turn.T + shift, turn @ observer + shift).total_dba
    assert float(there) == pytest.approx(float(here), abs=1e-9)


def test_each_convention_weights_where_it_says():
    """per_band: tones and octaves at their own frequency; lsdo_acoustics_2023: everything at the blade-passing frequency."""
    observer = torch.tensor([-40.0, 0.0, -50.0], dtype=torch.float64)
    band = hover_noise(*rotors(1), torch.zeros(1, 3).double(), observer)
    weights = a_weighting(band.tonal.frequency[0])
    energy = (squared_pressure(sound_pressure_level(band.tonal.pressure_squared[0]) + weights)).sum()
    assert float(band.tonal_dba) == pytest.approx(float(sound_pressure_level(energy)), abs=1e-5)
    paper = hover_noise(*rotors(1), torch.zeros(1, 3).double(), observer, "lsdo_acoustics_2023")
    passing = 2 * 115.0 / (2 * math.pi)
    drop = a_weighting(number(passing))
    assert float(paper.total_dba - paper.total_db) == pytest.approx(float(drop), abs=1e-4)
    assert paper.tonal.frequency.shape[-1] == 3
    # Broadband at 1 to 6 kHz loses next to nothing by weighting its own bands.
    broadband = sound_pressure_level(band.broadband.overall[0])
    assert abs(float(band.broadband_dba - broadband)) < 2.0


def test_the_code_of_2022_is_in_effect_unweighted_and_quiet_below():
    """What it adds per tone and band is less than 2 dB re 20 uPa: nothing at any level that is heard."""
    hub, ahead = torch.zeros(1, 3).double(), torch.tensor([-54.0, 0.0, -54.0], dtype=torch.float64)
    result = hover_noise(*rotors(1), hub, ahead, "acoustics_2022")
    tones = sound_pressure_level(result.tonal.pressure_squared[0].sum())
    bands = sound_pressure_level(result.broadband.bands[0].sum())
    assert float(result.tonal_dba) == pytest.approx(float(tones), abs=1e-3)
    assert float(result.broadband_dba) == pytest.approx(float(bands), abs=1e-3)
    assert result.tonal.frequency.shape[-1] == 3
    # At 45 degrees fore and aft is as far as down: the honest directivity, louder by the reference distance alone.
    honest = hover_noise(*rotors(1), hub, ahead)
    louder = result.broadband.overall / honest.broadband.overall
    assert float(louder) == pytest.approx((150.0 / 45.72) ** 2, rel=1e-9)
    # Straight below it nearly vanishes, where the real one is loudest; abreast likewise.
    below = torch.tensor([0.0, 0.0, -76.2], dtype=torch.float64)
    silent = hover_noise(*rotors(1), hub, below, "acoustics_2022").broadband.overall
    loudest = hover_noise(*rotors(1), hub, below).broadband.overall
    assert 10.0 * math.log10(float(loudest / silent)) == pytest.approx(40.0 - 10.32, abs=0.01)


def test_tones_of_the_code_of_2022_are_those_above_the_disk():
    hub, below = torch.zeros(1, 3).double(), torch.tensor([-54.0, 0.0, -54.0], dtype=torch.float64)
    above = below * torch.tensor([1.0, 1.0, -1.0])
    ours = hover_noise(*rotors(1), hub, below, "acoustics_2022").tonal.pressure_squared
    torch.testing.assert_close(
        ours, hover_noise(*rotors(1), hub, above).tonal.pressure_squared[:, :3], rtol=1e-12, atol=0.0
    )
    assert float(ours[0, 0]) < float(hover_noise(*rotors(1), hub, below).tonal.pressure_squared[0, 0])


def test_a_convention_that_is_not_known_is_refused():
    with pytest.raises(ValueError, match=r"convention = 'paper' is invalid: it must be one of 'per_band', 'lsdo_ac"):
        hover_noise(*rotors(1), torch.zeros(1, 3).double(), torch.tensor([0.0, -30.0, -50.0]).double(), "paper")


def test_broadband_peak_follows_the_blade_thickness_across_the_flow_at_seven_tenths_radius():
    # h cos(alpha) + b sin(alpha) with h = 0.12 b; alpha = 0.08 rad; the smoothed |sin| adds less than 1 %.
    result = hover_noise(*rotors(1), torch.zeros(1, 3).double(), torch.tensor([0.0, -30.0, -50.0]).double())
    thickness = 0.2 * (0.12 * math.cos(0.08) + math.sin(0.08))
    assert float(result.broadband.frequency[0, 1]) == pytest.approx(0.28 * 0.7 * 115.0 * 1.5 / thickness, rel=1e-3)
    loading, thrust, radius, alpha = rotors(1)
    tapered = replace(loading, chord=0.3 - 0.1 * loading.radius)
    taper = hover_noise(
        tapered, thrust, radius, alpha, torch.zeros(1, 3).double(), torch.tensor([0, -30.0, -50]).double()
    )
    assert float(result.broadband.frequency[0, 1] / taper.broadband.frequency[0, 1]) == pytest.approx(
        0.195 / 0.2, rel=1e-9
    )


@pytest.mark.parametrize("convention", ["per_band", "lsdo_acoustics_2023", "acoustics_2022"])
def test_gradient_equals_central_differences(convention):
    def levels(x):
        loading, thrust, radius, alpha = rotors(8, speed=x[0], chord=x[1], load=x[2])
        observer = torch.stack([x[4], 0 * x[4], number(-50.0)])
        hubs = an_aircraft() * torch.stack([torch.ones_like(x[3]), x[3], torch.ones_like(x[3])])
        result = hover_noise(loading, thrust, radius, alpha, hubs, observer, convention)
        return torch.stack([result.total_dba, result.tonal_dba, result.broadband_dba])

    x = torch.tensor([115.0, 0.2, 1.0, 1.1, -30.0], dtype=torch.float64)
    exact = torch.autograd.functional.jacobian(levels, x)
    torch.testing.assert_close(exact, central_difference(levels, x, 1e-4), rtol=1e-7, atol=1e-7)
