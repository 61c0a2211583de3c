"""The section polar against the XFOIL points that it has never seen, thin-airfoil theory and the flat plate."""

import hashlib
import json
import math
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import central_difference, number

from surrogates.airfoil import load_airfoil, parse_airfoil, stalled_plate
from training.polar_data import read

DATA = Path(__file__).parents[1] / "training" / "data"
POLAR = load_airfoil()
CIRCLE = torch.deg2rad(torch.linspace(-180.0, 180.0, 1441, dtype=torch.float64))


@pytest.fixture(scope="module")
def xfoil():
    return read(DATA, "4412")


def held_out_masks(data):
    """The split as the card of the weights words it, drawn anew: whole Reynolds numbers, and single points."""
    held_out = POLAR.card["held_out"]
    polars = np.isin(data.reynolds, held_out["reynolds"])
    draw = np.random.default_rng(POLAR.card["seed"]).random(len(data.cl)) < held_out["share_of_points"]
    return {"unseen_polars": polars, "unseen_points": draw & ~polars}


def predictions(data, mask):
    columns = (np.deg2rad(data.alpha_deg), data.reynolds, data.mach)
    cl, cd = POLAR(*(torch.tensor(column[mask]) for column in columns))
    return cl.numpy(), cd.numpy()


def shipped_files():
    folder = resources.files("surrogates.weights")
    return folder.joinpath("naca4412.json").read_text(), folder.joinpath("naca4412.safetensors").read_bytes()


def lift_slope(reynolds, mach, low_deg=-2.0, high_deg=4.0):
    angles = torch.deg2rad(torch.tensor([low_deg, high_deg], dtype=torch.float64))
    cl, _ = POLAR(angles, number(reynolds), number(mach))
    return float((cl[1] - cl[0]) / (angles[1] - angles[0]))


def test_weights_have_not_seen_the_held_out_points_and_name_their_data(xfoil):
    assert POLAR.card["held_out"]["fitted_afterwards"] is False
    assert POLAR.card["data_sha256"] == xfoil.sha256


@pytest.mark.parametrize(("part", "at_least"), [("unseen_polars", 300), ("unseen_points", 100)])
def test_held_out_attached_flow_agrees_with_xfoil(xfoil, part, at_least):
    # Requirement at Re >= 2e5: lift to 0.005, drag to 1.5 % in the mean.
    attached = (xfoil.alpha_deg >= -6.0) & (xfoil.alpha_deg <= 12.0) & (xfoil.reynolds >= 2e5)
    mask = held_out_masks(xfoil)[part] & attached
    cl, cd = predictions(xfoil, mask)
    lift, drag = np.abs(cl - xfoil.cl[mask]), np.abs(cd / xfoil.cd[mask] - 1.0)
    assert mask.sum() >= at_least
    assert lift.mean() <= 0.005
    assert drag.mean() <= 0.015
    card = POLAR.card["errors"][f"{part}_re_from_2e5"]
    assert card["points"] == mask.sum()
    assert [lift.mean(), lift.max()] == pytest.approx([card["cl_mean"], card["cl_max"]], rel=1e-9)
    assert [drag.mean(), drag.max()] == pytest.approx([card["cd_mean_relative"], card["cd_max_relative"]], rel=1e-9)


def test_every_unseen_polar_agrees_with_xfoil_not_only_their_mean(xfoil):
    # Twice the mean requirement for the worst single polar, at Re >= 2e5.
    attached = (xfoil.alpha_deg >= -6.0) & (xfoil.alpha_deg <= 12.0) & (xfoil.reynolds >= 2e5)
    for reynolds in (4.5e5, 1.5e6):
        for mach in np.unique(xfoil.mach):
            mask = attached & (xfoil.reynolds == reynolds) & (xfoil.mach == mach)
            cl, cd = predictions(xfoil, mask)
            assert np.abs(cl - xfoil.cl[mask]).mean() < 0.01
            assert np.abs(cd / xfoil.cd[mask] - 1.0).mean() < 0.03


@pytest.mark.parametrize("reynolds", [5e5, 1e6, 3e6])
def test_lift_slope_is_near_two_pi_at_low_mach(reynolds):
    # Thin-airfoil theory; thickness raises the slope by up to 0.77 t/c = 9 %, the boundary layer lowers it about as much.
    assert lift_slope(reynolds, 0.0) == pytest.approx(2.0 * math.pi, rel=0.05)


def test_compressibility_raises_the_lift_slope_as_prandtl_and_glauert_say():
    # The rule is linear; XFOIL corrects pressures by Karman and Tsien, which adds a few per cent at Mach 0.5.
    for mach, tolerance in ((0.2, 0.02), (0.35, 0.03), (0.5, 0.06)):
        gain = lift_slope(2e6, mach) / lift_slope(2e6, 0.0)
        assert gain == pytest.approx(1.0 / math.sqrt(1.0 - mach**2), rel=tolerance)


@pytest.mark.parametrize(("reynolds", "mach"), [(5e5, 0.0), (1e6, 0.2), (3e6, 0.0), (3e6, 0.5)])
def test_lift_vanishes_near_minus_four_degrees(reynolds, mach):
    # Abbott and von Doenhoff measured -4, thin-airfoil theory gives -4.15, XFOIL -4.1 to -4.3.
    cl, _ = POLAR(torch.deg2rad(torch.tensor([-4.4, -3.9], dtype=torch.float64)), number(reynolds), number(mach))
    assert float(cl[0]) < 0.0 < float(cl[1])


def test_maximum_lift_is_the_peak_of_the_unseen_xfoil_polar(xfoil):
    # Peaks of a grid of 0.5 degrees; stall is where XFOIL itself scatters by some 2 %.
    for reynolds in (4.5e5, 1.5e6):
        for mach in (0.0, 0.2, 0.35):
            mask = (xfoil.reynolds == reynolds) & (xfoil.mach == mach)
            ours = float(POLAR.maximum_lift_coefficient(number(reynolds), number(mach)))
            assert ours == pytest.approx(xfoil.cl[mask].max(), rel=0.025)


def test_larger_reynolds_number_gives_more_maximum_lift_and_less_drag():
    reynolds = torch.logspace(5.5, 6.6, 12, dtype=torch.float64)
    assert bool((POLAR.maximum_lift_coefficient(reynolds, number(0.1)).diff() > 0.0).all())
    _, cd = POLAR(number(math.radians(4.0)), reynolds, number(0.1))
    assert bool((cd.diff() < 0.0).all())


def test_broadside_section_is_a_plate_across_the_flow():
    # Hoerner (1965): drag coefficient 1.98 of a two-dimensional plate; measured sections 1.8 to 2.1.
    for degrees in (90.0, -90.0):
        cl, cd = POLAR(number(math.radians(degrees)), number(1e6), number(0.1))
        assert float(cl) == pytest.approx(0.0, abs=1e-12)
        assert float(cd) == pytest.approx(1.98, rel=1e-4)  # sin^2 is smoothed by 1e-4


def test_deep_stall_force_is_normal_to_the_plate():
    # cl/cd = cot(alpha) but for the friction along the chord, 0.02.
    alpha = torch.deg2rad(torch.tensor([35.0, 45.0, 60.0, 80.0, 120.0, -50.0, -130.0], dtype=torch.float64))
    cl, cd = POLAR(alpha, number(1e6), number(0.1))
    along_chord = cd * torch.cos(alpha) - cl * torch.sin(alpha)
    torch.testing.assert_close(along_chord, 0.02 * torch.cos(alpha) ** 3, rtol=0.0, atol=1e-12)
    normal = cl * torch.cos(alpha) + cd * torch.sin(alpha)
    assert bool((normal * torch.sin(alpha) > 0.0).all())
    assert bool((normal.abs() > 1.4).all())
    assert bool((normal.abs() < 2.0).all())


def test_stalled_plate_lift_is_odd_and_drag_even():
    sin, cos = torch.sin(CIRCLE), torch.cos(CIRCLE)
    (cl, cd), (cl_mirror, cd_mirror) = stalled_plate(sin, cos), stalled_plate(-sin, cos)
    torch.testing.assert_close(cl_mirror, -cl, rtol=0.0, atol=1e-15)
    torch.testing.assert_close(cd_mirror, cd, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(("reynolds", "mach"), [(5e4, 0.0), (1e6, 0.1), (5e6, 0.6), (1e3, 0.0), (1e9, 1.5)])
def test_drag_is_positive_and_forces_bounded_at_every_angle(reynolds, mach):
    cl, cd = POLAR(CIRCLE, number(reynolds), number(mach))
    assert float(cd.min()) > 0.005  # the smallest of any XFOIL point is 0.00503
    assert float(cd.max()) < 2.01
    assert float(cl.abs().max()) < 2.0


def test_polar_is_periodic():
    query = number(8e5), number(0.15)
    for turns in (-2.0, 1.0):
        for ours, turned in zip(POLAR(CIRCLE, *query), POLAR(CIRCLE + turns * 2.0 * math.pi, *query), strict=True):
            torch.testing.assert_close(turned, ours, rtol=0.0, atol=1e-12)


def largest_slope_step(function, low, high, count):
    """Largest change of the derivative between neighbours of a uniform grid."""
    x = torch.linspace(low, high, count, dtype=torch.float64, requires_grad=True)
    steps = []
    for output in function(x):
        (slope,) = torch.autograd.grad(output.sum(), x, retain_graph=True)
        steps.append(float(slope.diff().abs().max()))
    return np.array(steps)


@pytest.mark.parametrize(
    ("name", "function", "low", "high"),
    [
        ("angle, all around", lambda a: POLAR(a, number(7e5), number(0.2)), -3.3, 3.3),
        ("angle at low Reynolds number", lambda a: POLAR(a, number(6e4), number(0.0)), -3.3, 3.3),
        ("Reynolds number, beyond both ends", lambda s: POLAR(number(0.1), torch.exp(s), number(0.1)), 8.0, 18.0),
        ("Mach number, beyond the upper end", lambda m: POLAR(number(0.1), number(1e6), m), 0.0, 0.9),
    ],
)
def test_derivatives_have_no_kinks(name, function, low, high):
    # Halving the step halves the largest change of slope where the slope is continuous, and leaves it at a kink.
    coarse = largest_slope_step(function, low, high, 8001)
    fine = largest_slope_step(function, low, high, 16001)
    assert (fine < 0.6 * coarse).all(), name


@pytest.mark.parametrize("degrees", [-179.9, -95.0, -17.0, -9.0, 0.0, 5.0, 13.0, 22.0, 45.0, 140.0, 180.0])
def test_gradient_equals_central_differences(degrees):
    # Fourth-order differences with step 1e-4: truncation and rounding near 1e-9.
    x = torch.tensor([math.radians(degrees), math.log(6e5), 0.2], dtype=torch.float64)

    def coefficients(x):
        return torch.stack(POLAR(x[0], torch.exp(x[1]), x[2]))

    exact = torch.autograd.functional.jacobian(coefficients, x)
    torch.testing.assert_close(exact, central_difference(coefficients, x, 1e-4), rtol=1e-6, atol=1e-7)


def test_queries_outside_the_training_range_are_flagged():
    alpha, reynolds, mach = (
        torch.tensor(column, dtype=torch.float64)
        for column in zip(
            (0.0, 1e6, 0.1),
            (math.radians(-11.9), 5.1e4, 0.0),
            (math.radians(19.9), 4.9e6, 0.6),
            (math.radians(21.0), 1e6, 0.1),
            (math.radians(-13.0), 1e6, 0.1),
            (0.0, 4e4, 0.1),
            (0.0, 6e6, 0.1),
            (0.0, 1e6, 0.65),
            strict=True,
        )
    )
    assert POLAR.extrapolated(alpha, reynolds, mach).tolist() == [False] * 3 + [True] * 5


def test_beyond_the_training_range_the_polar_is_held_at_its_edge():
    alpha = torch.deg2rad(torch.linspace(-5.0, 12.0, 35, dtype=torch.float64))
    for inside, edge, far, farther in (
        ((2.2e6, 0.1), (5e6, 0.1), (1e9, 0.1), (1e12, 0.1)),
        ((2e5, 0.1), (5e4, 0.1), (1e2, 0.1), (1e-3, 0.1)),
        ((1e6, 0.5), (1e6, 0.6), (1e6, 1.2), (1e6, 9.0)),
    ):
        polars = [torch.stack(POLAR(alpha, number(re), number(m))) for re, m in (inside, edge, far, farther)]
        torch.testing.assert_close(polars[3], polars[2], rtol=1e-9, atol=1e-12)
        # Smoothness lets the edge move by 0.035 half ranges: less than the way from the neighbouring polar inside.
        beyond = (polars[2] - polars[1]).abs().mean(-1)
        assert bool((beyond < 0.5 * (polars[1] - polars[0]).abs().mean(-1)).all())


def test_batches_broadcast_and_equal_single_queries():
    alpha, reynolds = torch.tensor([0.0, 0.1, 1.0], dtype=torch.float64), torch.tensor([[2e5], [2e6]]).double()
    cl, cd = POLAR(alpha, reynolds, number(0.2))
    assert cl.shape == cd.shape == (2, 3)
    for i in range(2):
        for j in range(3):
            single = POLAR(alpha[j], reynolds[i, 0], number(0.2))
            assert [float(v) for v in single] == pytest.approx([float(cl[i, j]), float(cd[i, j])], rel=1e-13)


def test_an_airfoil_that_is_not_shipped_is_refused_by_name():
    with pytest.raises(ValueError, match="airfoil = 'naca0000' is not allowed; no such surrogate is shipped"):
        load_airfoil("naca0000")


@pytest.mark.parametrize("position", [8, 500, -1])
def test_one_flipped_bit_in_the_weights_is_refused(position):
    card, weights = shipped_files()
    broken = bytearray(weights)
    broken[position] ^= 1
    with pytest.raises(ValueError, match=r"sha256 of the weights is [0-9a-f]{64}, the card says"):
        parse_airfoil(card, bytes(broken))


@pytest.mark.parametrize("keep", [0, 7, 100, -8])
def test_truncated_weights_are_refused_even_with_a_matching_card(keep):
    text, weights = shipped_files()
    card = json.loads(text) | {"weights_sha256": hashlib.sha256(weights[:keep]).hexdigest()}
    with pytest.raises(ValueError, match="airfoil surrogate is damaged"):
        parse_airfoil(json.dumps(card), weights[:keep])


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "{}"])
def test_a_broken_card_is_refused(text):
    with pytest.raises(ValueError, match="airfoil surrogate is damaged"):
        parse_airfoil(text, shipped_files()[1])


@pytest.mark.parametrize("key", ["layers", "training_range", "blend_deg", "weights_sha256"])
def test_a_card_without_a_key_is_refused_and_the_key_named(key):
    text, weights = shipped_files()
    card = {name: value for name, value in json.loads(text).items() if name != key}
    with pytest.raises(ValueError, match=key):
        parse_airfoil(json.dumps(card), weights)


def test_a_card_of_another_schema_is_refused():
    text, weights = shipped_files()
    with pytest.raises(ValueError, match="schema = 'other/2' is not allowed"):
        parse_airfoil(json.dumps(json.loads(text) | {"schema": "other/2"}), weights)
