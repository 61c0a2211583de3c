"""Structural mass surrogate against the published tables, which were fitted independently of one another."""

from dataclasses import fields, replace

import pytest
import torch

from lpc_mdo.disciplines.mass_properties import combine
from lpc_mdo.surrogates.structural_mass import StructuralInputs, load_structural_mass

# Name in our surrogate: regression, prefix of its rows in the table of 2024.
COMPONENTS = {
    "wing": ("wing_reg", "wing"),
    "fuselage": ("fuselage_reg", "fuselage"),
    "boom_inner_port": ("booms_left_inner", "BoomInPort"),
    "boom_outer_port": ("booms_left_outer", "BoomOutPort"),
    "boom_inner_starboard": ("booms_right_inner", "BoomInStar"),
    "boom_outer_starboard": ("booms_right_outer", "BoomOutStar"),
    "horizontal_tail": ("h_tail_reg", "htail"),
    "vertical_tail": ("v_tail_reg", "vtail"),
}
NAMES = (
    "wing_area",
    "wing_aspect_ratio",
    "fuselage_length",
    "battery_mass",
    "cruise_speed",
    "htail_area",
    "vtail_area",
)


@pytest.fixture(scope="module")
def published(reference):
    return reference("structures_published_regressions")


def inputs(published, *scale):
    """Baseline inputs, each times its `scale` (or 1)."""
    values = torch.tensor([published["baseline_inputs"][name] for name in NAMES], dtype=torch.float64)
    return StructuralInputs(*(values * torch.tensor(scale or [1.0] * 7, dtype=torch.float64)))


def regression(published, coefficients, x):
    """Published rows take wing area ... speed, or the two tail areas, and an intercept."""
    values = x.stacked().tolist()
    values = values[:5] if len(coefficients) == 6 else values[5:]
    return sum(c * v for c, v in zip(coefficients, [*values, 1.0], strict=True))


def off_baseline(published):
    return inputs(published, 1.07, 0.95, 1.03, 0.92, 1.06, 1.08, 0.94)


def test_component_values_are_those_of_the_published_rows(published):
    table, x = published["tables"]["components_2024"]["coefficients"], off_baseline(published)
    ours = load_structural_mass()(x)
    assert set(ours.names) == set(COMPONENTS)
    for i, name in enumerate(ours.names):
        rows, prefix = table[COMPONENTS[name][0]], COMPONENTS[name][1]
        for axis, k in (("X", 0), ("Y", 1), ("Z", 2)):
            row = rows.get(f"{prefix}_struct_cg_{axis}", [0.0] * 6)
            assert float(ours.center_of_gravity[i, k]) == pytest.approx(regression(published, row, x), rel=1e-12)
            inertia = rows[f"{prefix}_struct_I{axis.lower() * 2}_local"]
            assert float(ours.inertia[i, k, k]) == pytest.approx(regression(published, inertia, x), rel=1e-10)
        product = regression(published, rows.get(f"{prefix}_struct_Ixz_local", [0.0] * 6), x)
        assert float(ours.inertia[i, 0, 2]) == pytest.approx(-product, rel=1e-10)


def test_group_masses_are_the_published_ones(published):
    table, x = published["tables"]["components_2024"]["coefficients"], off_baseline(published)
    ours = load_structural_mass()(x)
    mass = dict(zip(ours.names, ours.mass.tolist(), strict=True))
    expected = {
        "wing": table["wing_reg"]["wing_mass"],
        "fuselage": table["fuselage_reg"]["fuselage_mass"],
        "boom": table["boom_mass_total"],
        "tail": table["empennage_mass"],
    }
    for group, row in expected.items():
        total = sum(value for name, value in mass.items() if group in name)
        assert total == pytest.approx(regression(published, row, x), rel=1e-12), group


@pytest.mark.parametrize(
    ("group", "key"), [("wing", "2024 wing"), ("boom", "2024 booms"), ("fuselage", "2024 fuselage")]
)
def test_baseline_mass_and_elasticities_are_those_derived_from_the_tables(published, group, key):
    x = inputs(published)
    values = [getattr(x, f.name).clone().requires_grad_() for f in fields(x)]
    ours = load_structural_mass()(StructuralInputs(*values))
    mass = sum(ours.mass[i] for i, name in enumerate(ours.names) if group in name)
    derived = published["derived"][key]
    assert float(mass.detach()) == pytest.approx(derived["baseline_kg"], rel=1e-12)
    gradient = torch.autograd.grad(mass, values)
    elasticity = [(g * v / mass).item() for g, v in zip(gradient[:5], values[:5], strict=True)]
    assert elasticity == pytest.approx(derived["elasticity"], rel=1e-9)


def test_components_combine_to_the_independently_fitted_aggregate(published):
    """Table of 2023: wing, booms and fuselage as one body, inertia about its own centre of gravity.

    Another fit to another run of sizings with average r2 = 0.94: 0.1 % in mass, 5 mm, 5 % in inertia.
    """
    x = inputs(published)
    ours = load_structural_mass()(x)
    keep = [i for i, name in enumerate(ours.names) if "tail" not in name]
    body = combine(ours.mass[keep], ours.center_of_gravity[keep], ours.inertia[keep])
    rows = published["tables"]["aggregate_2023"]["coefficients"]["wing_boom_fuselage_structural_dict"]
    aggregate = {k.removeprefix("wing_boom_fuselage_structural_"): regression(published, v, x) for k, v in rows.items()}
    assert float(body.mass) == pytest.approx(aggregate["mass"], rel=1e-3)
    assert float(body.center_of_gravity[0]) == pytest.approx(aggregate["cg_x"], abs=5e-3)
    assert float(body.center_of_gravity[1]) == pytest.approx(0.0, abs=1e-3)
    assert float(body.center_of_gravity[2]) == pytest.approx(aggregate["cg_z"], abs=5e-3)
    for k, axes in enumerate(("xx", "yy", "zz")):
        assert float(body.inertia[k, k]) == pytest.approx(aggregate[f"I_{axes}_global"], rel=0.05)


def test_tails_combine_to_the_independently_fitted_empennage(published):
    x = inputs(published)
    ours = load_structural_mass()(x)
    keep = [i for i, name in enumerate(ours.names) if "tail" in name]
    body = combine(ours.mass[keep], ours.center_of_gravity[keep], ours.inertia[keep])
    rows = published["tables"]["aggregate_2023"]["coefficients"]["empennage_dict"]
    assert float(body.mass) == pytest.approx(regression(published, rows["empennage_struct_mass"], x), rel=1e-12)
    for k, axis in ((0, "x"), (2, "z")):
        cg = regression(published, rows[f"empennage_struct_cg_{axis}"], x)
        assert float(body.center_of_gravity[k]) == pytest.approx(cg, abs=2e-3)


def test_every_component_is_a_possible_body(published):
    """Positive mass; principal moments positive and none larger than the sum of the other two."""
    for x in (inputs(published), off_baseline(published)):
        ours = load_structural_mass()(x)
        assert bool((ours.mass > 0.0).all())
        torch.testing.assert_close(ours.inertia, ours.inertia.mT, rtol=0.0, atol=0.0)
        principal = torch.linalg.eigvalsh(ours.inertia)
        assert bool((principal > 0.0).all())
        assert bool((principal[:, 2] <= principal[:, 0] + principal[:, 1]).all())


def test_products_of_inertia_lean_as_the_parts_do(published):
    """x aft, z up: the tail cone rises and the fin is swept aft (integral of x z positive), the wing droops and sweeps aft."""
    ours = load_structural_mass()(inputs(published))
    product = dict(zip(ours.names, (-ours.inertia[:, 0, 2]).tolist(), strict=True))
    assert product["fuselage"] > 0.0
    assert product["vertical_tail"] > 0.0
    assert product["wing"] < 0.0


def test_port_and_starboard_booms_are_mirror_images(published):
    # The booms were fitted one by one: 0.5 % scatter of inertia is the sizing optimizer's noise (STRUCTURES.md 1.4).
    ours = load_structural_mass()(inputs(published))
    at = {name: i for i, name in enumerate(ours.names)}
    for place in ("inner", "outer"):
        port, starboard = at[f"boom_{place}_port"], at[f"boom_{place}_starboard"]
        mirrored = ours.center_of_gravity[starboard] * torch.tensor([1.0, -1.0, 1.0], dtype=torch.float64)
        torch.testing.assert_close(ours.center_of_gravity[port], mirrored, rtol=0.0, atol=2e-3)
        torch.testing.assert_close(ours.inertia[port], ours.inertia[starboard], rtol=5e-3, atol=0.0)
        assert float(ours.mass[port]) == float(ours.mass[starboard])


def test_booms_stay_at_their_share_of_the_span(published):
    """y of the booms goes as sqrt(S AR): elasticity one half in each."""
    x = inputs(published)
    area, ratio = x.wing_area.clone().requires_grad_(), x.wing_aspect_ratio.clone().requires_grad_()
    ours = load_structural_mass()(replace(x, wing_area=area, wing_aspect_ratio=ratio))
    for i, name in enumerate(ours.names):
        if "boom" in name:
            y = ours.center_of_gravity[i, 1]
            for variable in (area, ratio):
                (slope,) = torch.autograd.grad(y, variable, retain_graph=True)
                assert float((slope * variable / y).detach()) == pytest.approx(0.5, abs=0.01)


def test_surrogate_is_linear_also_beyond_its_samples(published):
    surrogate = load_structural_mass()
    near, far, middle = (surrogate(inputs(published, *[f] * 7)) for f in (0.8, 1.4, 1.1))
    torch.testing.assert_close(0.5 * (near.mass + far.mass), middle.mass, rtol=1e-12, atol=1e-9)
    torch.testing.assert_close(0.5 * (near.inertia + far.inertia), middle.inertia, rtol=1e-12, atol=1e-8)


def test_queries_beyond_the_samples_are_named_with_their_distance(published):
    surrogate = load_structural_mass()
    assert surrogate.outside(inputs(published)) == {}
    assert surrogate.outside(inputs(published, 1.1, 0.9, 1.1, 0.9, 1.1, 0.9, 1.1)) == {}
    outside = surrogate.outside(inputs(published, 1.0, 1.2, 1.0, 0.7, 1.0, 1.0, 1.0))
    # +-10 % is one half-width.
    assert outside == pytest.approx({"wing_aspect_ratio": 2.0, "battery_mass_kg": 3.0}, rel=1e-9)


def test_leverage_of_a_uniform_sample_averages_to_parameters_over_samples(published):
    """Trace of the hat matrix: the mean of 1/n + sum z^2/n over the box is (k + 1)/n."""
    surrogate = load_structural_mass()
    generator = torch.Generator().manual_seed(5)
    sample = 0.9 + 0.2 * torch.rand(20000, 7, generator=generator, dtype=torch.float64)
    points = inputs(published).stacked() * sample
    leverage = surrogate.leverage(StructuralInputs(*points.unbind(-1)))
    assert float(leverage.mean()) == pytest.approx(8 / 96, rel=0.01)
    assert float(surrogate.leverage(inputs(published))) == pytest.approx(1 / 96, rel=1e-9)
    assert float(surrogate.leverage(inputs(published, *[1.1] * 7))) == pytest.approx((1 + 3 * 7) / 96, rel=1e-9)


def test_a_batch_equals_a_loop(published):
    x = torch.stack([inputs(published).stacked(), off_baseline(published).stacked()])
    batch = load_structural_mass()(StructuralInputs(*x.unbind(-1)))
    for i in range(2):
        one = load_structural_mass()(StructuralInputs(*x[i]))
        torch.testing.assert_close(batch.mass[i], one.mass, rtol=1e-13, atol=0.0)
        torch.testing.assert_close(batch.inertia[i], one.inertia, rtol=1e-12, atol=1e-10)


def test_an_unknown_surrogate_is_refused():
    with pytest.raises(ValueError, match=r"structure\.source = 'guess' is not allowed"):
        load_structural_mass("guess")
