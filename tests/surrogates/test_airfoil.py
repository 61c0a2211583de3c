"""The section polar against the XFOIL points that it has never seen, thin-airfoil theory and the flat plate."""

import hashlib
import json
import math
import pickle
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import central_difference, number
from safetensors.torch import save

from lpc_mdo.surrogates.airfoil import load_airfoil, parse_airfoil
from lpc_mdo.surrogates.section_theory import drag_rise, stalled_plate
from lpc_mdo.training.polar_data import read

DATA = Path(__file__).parents[2] / "training" / "data"
POLAR = load_airfoil()
CIRCLE = torch.deg2rad(torch.linspace(-180.0, 180.0, 1441, dtype=torch.float64))


@pytest.fixture(scope="module")
def xfoil():
    return read(DATA / "naca4412.csv.gz")


def held_out_masks(data):
    """The split as the card of the weights words it, drawn anew: whole Reynolds and Mach numbers, and single points."""
    held_out = POLAR.card["held_out"]
    polars = np.isin(data.reynolds, held_out["reynolds"]) | np.isin(data.mach, held_out["mach"])
    draw = np.random.default_rng(POLAR.card["seed"]).random(len(data.cl)) < held_out["share_of_points"]
    return {"unseen_polars": polars, "unseen_points": draw & ~polars}


def predictions(data, mask):
    columns = (np.deg2rad(data.alpha_deg), data.reynolds, data.mach)
    cl, cd = POLAR(*(torch.tensor(column[mask]) for column in columns))
    return cl.numpy(), cd.numpy()


def shipped_files():
    folder = resources.files("lpc_mdo.surrogates.weights")
    return folder.joinpath("naca4412.json").read_text(), folder.joinpath("naca4412.safetensors").read_bytes()


def lift_slope(reynolds, mach, low_deg=-2.0, high_deg=4.0):
    angles = torch.deg2rad(torch.tensor([low_deg, high_deg], dtype=torch.float64))
    cl, _ = POLAR(angles, number(reynolds), number(mach))
    return float((cl[1] - cl[0]) / (angles[1] - angles[0]))


def test_weights_have_not_seen_the_held_out_points_and_name_their_data(xfoil):
    assert POLAR.card["held_out"]["fitted_afterwards"] is False
    assert POLAR.card["data_sha256"] == xfoil.sha256


def attached(data, low, high):
    return (data.alpha_deg >= -6.0) & (data.alpha_deg <= 12.0) & (data.reynolds >= low) & (data.reynolds < high)


@pytest.mark.parametrize(
    ("part", "band", "low", "high", "lift_error", "drag_error", "at_least"),
    [
        ("unseen_polars", "re_from_2e5", 2e5, math.inf, 0.003, 0.01, 1000),
        ("unseen_points", "re_from_2e5", 2e5, math.inf, 0.003, 0.01, 100),
        ("unseen_polars", "re_1e5_to_2e5", 1e5, 2e5, 0.01, 0.03, 200),
    ],
)
def test_held_out_attached_flow_agrees_with_xfoil(xfoil, part, band, low, high, lift_error, drag_error, at_least):
    """The requirement: mean errors of lift and drag on whole polars, and points, that the fit has not seen."""
    mask = held_out_masks(xfoil)[part] & attached(xfoil, low, high)
    cl, cd = predictions(xfoil, mask)
    lift, drag = np.abs(cl - xfoil.cl[mask]), np.abs(cd / xfoil.cd[mask] - 1.0)
    assert mask.sum() >= at_least
    assert lift.mean() <= lift_error
    assert drag.mean() <= drag_error
    card = POLAR.card["errors"][f"{part}_{band}"]
    assert card["points"] == mask.sum()
    assert [lift.mean(), lift.max()] == pytest.approx([card["cl_mean"], card["cl_max"]], rel=1e-9)
    assert [drag.mean(), drag.max()] == pytest.approx([card["cd_mean_relative"], card["cd_max_relative"]], rel=1e-9)


def test_every_unseen_polar_agrees_with_xfoil_not_only_their_mean(xfoil):
    # Thrice the mean requirement for the worst single polar, at Re >= 2e5.
    unseen = held_out_masks(xfoil)["unseen_polars"] & attached(xfoil, 2e5, math.inf)
    for reynolds, mach in {(r, m) for r, m in zip(xfoil.reynolds[unseen], xfoil.mach[unseen], strict=True)}:
        mask = unseen & (xfoil.reynolds == reynolds) & (xfoil.mach == mach)
        cl, cd = predictions(xfoil, mask)
        assert np.abs(cl - xfoil.cl[mask]).mean() < 0.009
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
    for reynolds in (3e5, 1e6, 3.3e6):
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


@pytest.mark.parametrize(("reynolds", "mach"), [(3e4, 0.0), (1e6, 0.1), (1e7, 0.6), (1e3, 0.0), (1e9, 1.5)])
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


OUTSIDE = {
    "alpha_deg": ((math.radians(21.0), 1e6, 0.1), (math.radians(-13.0), 1e6, 0.1)),
    "reynolds": ((0.0, 2.9e4, 0.1), (0.0, 1.1e7, 0.1)),
    "mach": ((0.0, 1e6, 0.61),),
}


def test_queries_outside_the_training_range_are_flagged():
    inside = [(0.0, 1e6, 0.1), (math.radians(-11.9), 3.1e4, 0.0), (math.radians(19.9), 9.9e6, 0.6)]
    outside = [query for queries in OUTSIDE.values() for query in queries]
    columns = (torch.tensor(column, dtype=torch.float64) for column in zip(*inside, *outside, strict=True))
    assert POLAR.extrapolated(*columns).tolist() == [False] * len(inside) + [True] * len(outside)


@pytest.mark.parametrize(("name", "query"), [(name, q) for name, queries in OUTSIDE.items() for q in queries])
def test_out_of_range_policies_refuse_warn_or_penalize(name, query):
    batch = [torch.stack([number(value), number(good)]) for value, good in zip(query, (0.0, 1e6, 0.1), strict=True)]
    plain = POLAR(*batch)
    message = rf"{name} = [-0-9.e+]+ is not allowed; the polars of naca4412 lie between"
    with pytest.raises(ValueError, match=message):
        POLAR.guarded(*batch)
    with pytest.warns(RuntimeWarning, match=message):
        warned = POLAR.guarded(*batch, policy="warn")
    assert all(torch.equal(ours, theirs) for ours, theirs in zip(warned, plain, strict=True))
    cl, cd = POLAR.guarded(*batch, policy="penalty")
    assert torch.equal(cl, plain[0])
    assert float(cd[0]) > float(plain[1][0])
    assert float(cd[1]) == float(plain[1][1])  # the query inside pays nothing


def test_penalty_grows_with_the_distance_and_has_two_continuous_derivatives():
    def ratio(mach):
        query = number(0.0), number(1e6), mach
        return POLAR.guarded(*query, policy="penalty")[1] / POLAR(*query)[1]

    # Squared Mach numbers from 0 to 0.36 were trained: at 0.36 + 0.09 half a half-width is missing, and drag 1 + 0.5^3.
    far = math.sqrt(0.45)
    assert float(ratio(number(far))) == pytest.approx(1.125, rel=1e-6)
    for mach, slope in ((0.6, 0.0), (far, 3.0 * 0.5**2 * 2.0 * far / 0.18)):
        x = number(mach).requires_grad_()
        (gradient,) = torch.autograd.grad(ratio(x), x)
        assert float(gradient) == pytest.approx(slope, rel=1e-6, abs=1e-12)


def test_queries_inside_pass_every_policy_silently(recwarn):
    query = number(0.05), number(2e6), number(0.3)
    for policy in ("error", "warn", "penalty"):
        assert POLAR.guarded(*query, policy=policy) == POLAR(*query)
    assert not recwarn.list


def test_an_unknown_policy_is_refused():
    with pytest.raises(ValueError, match="policy = 'ignore' is not allowed; it must be one of error, warn, penalty"):
        POLAR.guarded(number(0.0), number(1e6), number(0.1), policy="ignore")


def test_beyond_the_training_range_the_polar_is_held_at_its_edge():
    alpha = torch.deg2rad(torch.linspace(-5.0, 12.0, 35, dtype=torch.float64))
    for inside, edge, far, farther in (
        ((5e6, 0.1), (1e7, 0.1), (1e9, 0.1), (1e12, 0.1)),
        ((7.5e4, 0.1), (3e4, 0.1), (1e2, 0.1), (1e-3, 0.1)),
        ((1e6, 0.5), (1e6, 0.6), (1e6, 1.2), (1e6, 9.0)),
    ):
        polars = [torch.stack(POLAR(alpha, number(re), number(m))) for re, m in (inside, edge, far, farther)]
        torch.testing.assert_close(polars[3], polars[2], rtol=1e-9, atol=1e-12)
        # Smoothness lets the edge move by 0.035 half ranges: less than the way from the neighbouring polar inside.
        coefficients = 1 if edge[1] == 0.6 else 2  # drag rises beyond the last Mach number
        beyond = (polars[2] - polars[1]).abs().mean(-1)[:coefficients]
        assert bool((beyond < 0.5 * (polars[1] - polars[0]).abs().mean(-1)[:coefficients]).all())


def test_drag_diverges_where_korn_says_so_and_stays_below_a_tenth():
    # At the divergence Mach number 0.87 - t/c - cl/10 Lock's rise is 20 (0.1/80)^(4/3) = 0.0027 and its slope 0.1.
    cl = torch.tensor([-0.8, 0.0, 0.4, 1.0], dtype=torch.float64)
    divergence = 0.87 - 0.12 - 0.1 * torch.sqrt(cl**2 + 0.01)
    mach = divergence.clone().requires_grad_()
    rise = drag_rise(cl, mach, torch.full_like(cl, 0.3), 0.12)
    (slope,) = torch.autograd.grad(rise.sum(), mach)
    torch.testing.assert_close(rise, torch.full_like(cl, 20.0 * 0.00125 ** (4.0 / 3.0)), rtol=1e-3, atol=0.0)
    torch.testing.assert_close(slope, torch.full_like(cl, 0.1), rtol=2e-3, atol=0.0)
    assert float(drag_rise(number(1.5), number(3.0), number(0.3), 0.12)) <= 0.1


def test_a_section_has_no_drag_rise_below_its_critical_mach_number_and_a_thin_one_less():
    cl, held = number(0.5), number(0.59)
    assert float(drag_rise(cl, number(0.55), number(0.55), 0.12)) == 0.0
    thin, thick = (float(drag_rise(cl, number(0.8), held, t)) for t in (0.06, 0.12))
    assert 0.0 < thin < thick


def test_a_supersonic_tip_is_not_free():
    cd = POLAR(number(0.03), number(1e6), torch.tensor([0.5, 0.7, 0.8, 0.9, 1.1], dtype=torch.float64))[1]
    assert bool((cd.diff() > 0.0).all())
    assert float(cd[3] / cd[0]) > 5.0


def test_batches_broadcast_and_equal_single_queries():
    alpha, reynolds = torch.tensor([0.0, 0.1, 1.0], dtype=torch.float64), torch.tensor([[2e5], [2e6]]).double()
    cl, cd = POLAR(alpha, reynolds, number(0.2))
    assert cl.shape == cd.shape == (2, 3)
    for i in range(2):
        for j in range(3):
            single = POLAR(alpha[j], reynolds[i, 0], number(0.2))
            assert [float(v) for v in single] == pytest.approx([float(cl[i, j]), float(cd[i, j])], rel=1e-13)


def test_an_airfoil_that_is_not_shipped_is_refused_by_name():
    with pytest.raises(ValueError, match="airfoil = 'naca0000' is invalid: it must be naca4412"):
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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "card: is not valid JSON"),
        ("{", "card: is not valid JSON"),
        *((text, "airfoil surrogate is damaged") for text in ("[]", "null", "{}")),
    ],
)
def test_a_broken_card_is_refused(text, message):
    with pytest.raises(ValueError, match=message):
        parse_airfoil(text, shipped_files()[1])


@pytest.mark.parametrize("key", ["training_range", "blend_deg", "weights_sha256", "thickness_to_chord", "name"])
def test_a_card_without_a_key_is_refused_and_the_key_named(key):
    text, weights = shipped_files()
    card = {name: value for name, value in json.loads(text).items() if name != key}
    with pytest.raises(ValueError, match=key):
        parse_airfoil(json.dumps(card), weights)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"blend_deg": [-24, -10, 16]}, "blend_deg = .* it must be 4 increasing numbers"),
        ({"blend_deg": [-24, -10, 16, 10]}, "blend_deg = .* it must be 4 increasing numbers"),
        ({"blend_deg": [-24, -10, 16, float("nan")]}, r"blend_deg\[3\] = nan is invalid: it must be a finite number"),
        (
            {"training_range": {"alpha_deg": [0, 1], "reynolds": [-1, 1], "mach": [0, 1]}},
            r"training_range.reynolds = \[-1, 1\] is not allowed; it must be 2 increasing numbers of at least 1",
        ),
        (
            {"training_range": {"alpha_deg": "ab", "reynolds": [1, 2], "mach": [0, 1]}},
            "alpha_deg = 'ab' is not allowed",
        ),
        ({"thickness_to_chord": -0.1}, "thickness_to_chord = -0.1 is not allowed"),
        ({"thickness_to_chord": "thin"}, "thickness_to_chord = 'thin' is not allowed"),
        ({"schema": "other/2"}, "schema = 'other/2' is not allowed"),
        ({"name": 1.5}, "name = 1.5 is not allowed; it must be text in quotes"),
        ({"held_out": {}}, "held_out.reynolds is missing"),
        ({"errors": {"train": {"cl_mean": "small"}}}, "errors.train.cl_mean = 'small' is not allowed"),
        ({"attached_deg": None}, "attached_deg = None is not allowed; it must be 2 increasing numbers"),
    ],
)
def test_a_card_with_a_value_that_cannot_be_is_refused(change, message):
    text, weights = shipped_files()
    with pytest.raises(ValueError, match=message):
        parse_airfoil(json.dumps(json.loads(text) | change), weights)


def with_weights(tensors):
    """The shipped card, made to fit other weights: what a hostile or careless author would ship."""
    weights = save(tensors)
    card = json.loads(shipped_files()[0]) | {"weights_sha256": hashlib.sha256(weights).hexdigest()}
    return json.dumps(card), weights


def shipped_tensors():
    return {
        f"{kind}_{i}": t
        for i, layer in enumerate(POLAR.weights)
        for kind, t in zip(("matrix", "bias"), layer, strict=True)
    }


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda t: t | {"matrix_1": t["matrix_1"][:, :-1].contiguous()}, "layer 1 of shape .* it must take"),
        (lambda t: t | {"bias_0": t["bias_0"][:-1]}, "layer 0 of shape .* is not allowed"),
        (lambda t: t | {"bias_0": t["bias_0"] * float("inf")}, "layer 0 holds weights that are not finite"),
        (lambda t: {k: v.float() for k, v in t.items()}, "it must be float64"),
        (lambda t: {k: v for k, v in t.items() if k != "bias_2"}, "tensors with .* outputs are not allowed"),
        (lambda t: t | {"bias_3": torch.zeros(2).double()}, "7 tensors with 2 outputs are not allowed"),
        (lambda t: {f"x{k}": v for k, v in t.items()}, "its weights must hold the tensor 'matrix_0'"),
        (lambda t: t | {"extra": torch.zeros(1_300_000).double()}, "bytes of weights are not allowed"),
    ],
)
def test_weights_that_do_not_make_a_polar_are_refused(spoil, message):
    with pytest.raises(ValueError, match=message):
        parse_airfoil(*with_weights(spoil(shipped_tensors())))


def test_a_pickle_is_refused_unread():
    data = pickle.dumps({"matrix_0": [1.0]})
    card = json.loads(shipped_files()[0]) | {"weights_sha256": hashlib.sha256(data).hexdigest()}
    with pytest.raises(ValueError, match="airfoil surrogate is damaged"):
        parse_airfoil(json.dumps(card), data)


def test_a_card_nested_beyond_reason_is_refused():
    with pytest.raises(ValueError, match="it must nest at most 32 lists or tables"):
        parse_airfoil("[" * 200_000, shipped_files()[1])
