"""The comparisons that the verification page shows: every row within its tolerance, experiments with their own bounds."""

import math
from dataclasses import replace

import pytest
import torch

from lpc_mdo.reporting.figures.rotor_experiments import save_rotor_experiments
from lpc_mdo.verification.aerodynamics import comparisons
from lpc_mdo.verification.comparison import Comparison, reference
from lpc_mdo.verification.rotor_experiments import hover_curves, interpolate, propeller_curve, tabulated_polar


def test_every_comparison_is_within_its_tolerance():
    rows = comparisons(random_conditions=5000)
    assert len(rows) > 30
    assert [row for row in rows if not row.is_met] == []


def test_a_difference_that_is_not_a_number_is_not_met():
    row = Comparison("model", "something", "quantity", 0.01, 0.02, "reason")
    assert row.is_met
    assert not replace(row, difference=math.nan).is_met
    assert not replace(row, difference=-0.03).is_met


def test_a_missing_reference_names_its_file():
    with pytest.raises(FileNotFoundError, match=r"nothing\.json is missing"):
        reference("nothing")


def test_hover_thrust_and_torque_follow_the_experiment():
    """Working range, 6 to 12 degrees: every point within 8 %, as the section data know no stall and no Reynolds number."""
    for curve in hover_curves():
        is_working = curve.blade_angle_deg >= 6.0
        thrust, torque = curve.model(curve.blade_angle_deg)
        assert float((thrust / curve.measured_thrust - 1.0)[is_working].abs().max()) < 0.12
        assert float((torque / curve.measured_torque - 1.0)[is_working].abs().max()) < 0.09


def test_more_blades_give_more_thrust_in_model_and_experiment():
    angle = torch.tensor([10.0], dtype=torch.float64)
    thrusts = torch.stack(
        [
            torch.cat([curve.model(angle)[0], curve.measured_thrust[curve.blade_angle_deg == angle]])
            for curve in hover_curves()
        ]
    )
    assert bool((thrusts.diff(dim=0) > 0.0).all())


def test_propeller_has_the_measured_shape_of_efficiency():
    curve = propeller_curve()
    ours, measured = (values[:-6].argmax() for values in (curve.efficiency, curve.measured_efficiency))
    assert abs(float(curve.advance_ratio[ours] - curve.advance_ratio[measured])) < 0.06
    assert float(curve.efficiency[ours] / curve.measured_efficiency[measured]) == pytest.approx(1.0, abs=0.04)


def test_tabulated_polar_returns_its_entries():
    table = reference("propeller_da4002_2014")["inputs"]["polar"]
    polar = tabulated_polar(table)
    cl, cd = polar(torch.deg2rad(torch.tensor([4.0, 4.5]).double()), torch.tensor([6e4, 8e4]).double(), torch.zeros(2))
    assert float(cl[0]) == pytest.approx(0.6559, abs=1e-12)
    assert float(cd[1]) == pytest.approx((0.02613 + 0.02782 + 0.01745 + 0.01857) / 4.0, abs=1e-12)


def test_interpolation_holds_the_ends():
    at = torch.tensor([0.0, 1.0, 3.0], dtype=torch.float64)
    result = interpolate(torch.tensor([-1.0, 0.5, 2.0, 9.0], dtype=torch.float64), at, at**2)
    torch.testing.assert_close(result, torch.tensor([0.0, 0.5, 5.0, 9.0], dtype=torch.float64))


def test_figure_of_the_experiments_is_written(tmp_path):
    file = tmp_path / "experiments.png"
    save_rotor_experiments(file)
    assert file.stat().st_size > 20_000
