"""`lpc-mdo analyze` on the figures of other codes, through the command line: JSON file in, JSON text out."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from conftest import REFERENCE

from lpc_mdo.cli import main
from lpc_mdo.surrogates.airfoil import load_airfoil
from lpc_mdo.training.polar_data import read

DATA = Path(__file__).parents[2] / "training" / "data"
OPENAEROSTRUCT = "OpenAerostruct 2.12.0"
AIRFOIL_CASE = {"inputs": {"airfoil": "naca4412", "alpha_deg": [0.0, 5.0], "reynolds": 1e6, "mach": [0.0, 0.2]}}


def analyze(discipline, file):
    run = CliRunner().invoke(main, ["analyze", discipline, str(file)])
    assert run.exit_code == 0, run.stderr
    return json.loads(run.stdout)["results"]


@pytest.fixture
def answer(tmp_path):
    """Results of a case given as plain data."""

    def written(discipline, case):
        file = tmp_path / "case.json"
        file.write_text(json.dumps(case))
        return analyze(discipline, file)

    return written


@pytest.mark.parametrize("name", ["bem_lift_rotor_axial", "bem_pusher_axial"])
def test_rotor_loads_are_those_of_ccblade(reference, name):
    # The file's note: local values satisfy the momentum balance to 1e-9; its mid-point integrals are like ours.
    theirs = reference(name)["results"]
    for ours, expected in zip(analyze("rotor", REFERENCE / f"{name}.json"), theirs, strict=True):
        assert [ours[key] for key in ("V_m_per_s", "rpm", "hub_loss")] == [
            expected[key] for key in ("V_m_per_s", "rpm", "hub_loss")
        ]
        assert ours["thrust_N"] == pytest.approx(expected["thrust_midpoint_N"], rel=1e-9)
        assert ours["torque_N_m"] == pytest.approx(expected["torque_midpoint_Nm"], rel=1e-9)
        for key, values in expected["stations"].items():
            assert ours["stations"][key] == pytest.approx(values, rel=1e-9), key


@pytest.mark.parametrize("name", ["bem_lift_rotor_axial", "bem_pusher_axial"])
def test_rotor_integrals_differ_from_ccblades_own_by_its_radial_rule(reference, name):
    # The file's note: the mid-point rule gives one percent more, "1 percent" to the nearest half.
    theirs = reference(name)["results"]
    for ours, expected in zip(analyze("rotor", REFERENCE / f"{name}.json"), theirs, strict=True):
        assert 0.005 < ours["thrust_N"] / expected["thrust_N"] - 1.0 < 0.015


@pytest.mark.parametrize("name", ["vlm_rect_ar8_flat", "vlm_rect_ar8_naca4412", "vlm_lpc_flat", "vlm_lpc_naca4412"])
@pytest.mark.parametrize("level", [0, 1])
def test_wing_coefficients_are_those_of_openaerostruct_at_equal_mesh(reference, answer, name, level):
    # Same lattice in both codes once wakes have no core; the file holds eight digits of geometry and of results, five units of the last.
    case = reference(name)
    mesh = case["results"][OPENAEROSTRUCT]["meshes"][level]
    case["mesh"] = {key: mesh[key] for key in ("chordwise_panels", "spanwise_panels_half")} | {"wake_core": 0.0}
    for ours, theirs in zip(answer("wing", case), mesh["results"], strict=True):
        for key in ("alpha_deg", "beta_deg", "CL", "CDi", "Cm", "Cl_roll_body", "Cn_body"):
            assert ours[key] == pytest.approx(theirs[key], rel=5e-7, abs=1e-10), (key, theirs["alpha_deg"])


def test_flat_wing_tends_to_the_limit_on_which_two_codes_agree(reference, answer):
    # The file states by how much the codes differ after extrapolation; uniform meshes converge at first order.
    case = reference("vlm_rect_ar8_flat")
    coarse, fine = (
        answer("wing", case | {"mesh": {"chordwise_panels": n, "spanwise_panels_half": 5 * n}}) for n in (3, 6)
    )
    for a, b, limit in zip(coarse, fine, case["results"][OPENAEROSTRUCT]["richardson"], strict=True):
        for key in ("CL", "CDi"):
            known_to = case["difference_between_codes_after_extrapolation"][key]
            assert 2.0 * b[key] - a[key] == pytest.approx(limit[key], abs=known_to)


def test_rotor_tones_are_those_of_the_reference_evaluation(reference):
    # The reference is exact to rounding; our distance from the axis is smoothed by 1e-6 of itself, and the level has a
    # floor of 1e-7 Pa, 2e-5 dB on the faintest.
    theirs = reference("noise_tonal_hover")["results"]
    for ours, expected in zip(analyze("noise", REFERENCE / "noise_tonal_hover.json"), theirs, strict=True):
        assert ours["elevation_from_disk_plane_deg"] == expected["elevation_from_disk_plane_deg"]
        for tone, expected_tone in zip(ours["harmonics"], expected["harmonics"], strict=True):
            assert tone == pytest.approx(expected_tone, rel=1e-8)
        for key in ("spl_db", "spl_dba_per_harmonic"):
            assert ours[key] == pytest.approx(expected[key], abs=5e-5)


def test_a_weighting_is_that_of_the_standards_formula(reference):
    # Same closed formula: sixteen digits, of which the sum of logarithms keeps twelve.
    ours = analyze("noise", REFERENCE / "noise_a_weighting.json")
    assert ours == pytest.approx(reference("noise_a_weighting")["results"], rel=1e-12, abs=1e-12)


def test_motor_currents_are_those_of_the_reference(reference):
    # Closed form to rounding; the bracketed root of flux weakening meets the voltage limit to our smoothing, 2e-6.
    theirs = reference("motor_dq")["results"]
    for ours, expected in zip(analyze("motor", REFERENCE / "motor_dq.json"), theirs, strict=True):
        tolerance = 1e-11 if expected["mode"] == "mtpa" else 2e-6
        assert ours["is_within_limits"]
        for key, value in expected.items():
            assert ours[key] == (value if isinstance(value, str) else pytest.approx(value, rel=tolerance)), key


def test_cell_discharge_is_that_of_an_adaptive_integration(reference):
    # The reference integrates to rtol 1e-11; our fixed steps of 2 s leave 1e-8.
    theirs = reference("battery_thevenin")["results"]
    for ours, expected in zip(analyze("battery", REFERENCE / "battery_thevenin.json"), theirs, strict=True):
        assert ours == pytest.approx(expected, rel=0.0, abs=1e-8)


def test_section_coefficients_are_those_of_xfoil_on_a_polar_never_fitted(answer):
    # The surrogate's own card states its largest error on unseen polars in attached flow.
    card = load_airfoil().card
    polars = read(DATA / "naca4412.csv.gz")
    low, high = card["attached_deg"]
    assert 1e6 in card["held_out"]["reynolds"]
    chosen = (polars.reynolds == 1e6) & (polars.mach == 0.0) & (polars.alpha_deg >= low) & (polars.alpha_deg <= high)
    inputs = {"airfoil": "naca4412", "alpha_deg": polars.alpha_deg[chosen].tolist(), "reynolds": 1e6, "mach": 0.0}
    ours, errors = answer("airfoil", {"inputs": inputs}), card["errors"]["unseen_polars_re_from_2e5"]
    assert len(ours["cl"]) == chosen.sum() > 20
    assert np.abs(ours["cl"] - polars.cl[chosen]).max() <= errors["cl_max"]
    assert np.abs(ours["cd"] / polars.cd[chosen] - 1.0).max() <= errors["cd_max_relative"]
    assert not any(ours["extrapolated"])


def test_airfoil_case_equals_the_polar_and_repeats_single_values(answer):
    ours = answer("airfoil", AIRFOIL_CASE)
    alpha, reynolds, mach = torch.tensor([[0.0, 5.0], [1e6, 1e6], [0.0, 0.2]], dtype=torch.float64)
    cl, cd = load_airfoil()(torch.deg2rad(alpha), reynolds, mach)
    assert ours["cl"] == cl.tolist()
    assert ours["cd"] == cd.tolist()


@pytest.mark.parametrize("name", ["NACA 4412", "4412", "naca-4412"])
def test_a_section_is_known_by_every_spelling(answer, name):
    ours = answer("airfoil", {"inputs": AIRFOIL_CASE["inputs"] | {"airfoil": name}})
    assert ours == answer("airfoil", AIRFOIL_CASE)


def test_angles_beyond_the_polars_are_answered_and_flagged(answer):
    ours = answer("airfoil", {"inputs": AIRFOIL_CASE["inputs"] | {"alpha_deg": [5.0, 90.0]}})
    assert ours["extrapolated"] == [False, True]
    assert ours["cd"][1] > 1.0


def test_conditions_may_stand_apart_from_results(reference, answer):
    case = reference("motor_dq")
    expected = answer("motor", case)
    conditions = [{key: row[key] for key in ("torque_em_N_m", "speed_rpm")} for row in case.pop("results")]
    assert answer("motor", case | {"conditions": conditions}) == expected


def test_results_come_in_the_order_of_the_conditions(reference, answer):
    case = reference("noise_tonal_hover")
    forward = answer("noise", case)
    assert answer("noise", case | {"results": case["results"][::-1]}) == forward[::-1]


def test_torque_beyond_the_motors_limits_is_answered_and_flagged(reference, answer):
    case = reference("motor_dq") | {"conditions": [{"torque_em_N_m": 5000.0, "speed_rpm": 3000.0}]}
    (ours,) = answer("motor", case)
    assert not ours["is_within_limits"]
    assert ours["maximum_torque_N_m"] < 5000.0


def test_rotor_with_a_named_airfoil_feels_reynolds_and_mach_number(reference, answer):
    """In fast sound NACA 4412 nearly is the linear polar, 2 pi alpha less viscous losses; compressibility adds lift."""
    case = reference("bem_lift_rotor_axial") | {"conditions": [{"V_m_per_s": 0.0, "rpm": 1400.0}]}
    (linear,) = answer("rotor", case)
    named = {k: v for k, v in case["inputs"].items() if k not in ("cl0", "cla_per_rad", "cd0", "k")}
    named["polar"] = "NACA 4412"
    thrust = {}
    for sound in (340.0, 1e5):
        (loads,) = answer("rotor", case | {"inputs": named | {"speed_of_sound_m_per_s": sound}})
        thrust[sound] = loads["thrust_N"]
    assert thrust[1e5] == pytest.approx(linear["thrust_N"], rel=0.1)
    assert thrust[340.0] > 1.02 * thrust[1e5]
