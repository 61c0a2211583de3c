"""Inputs that once gave wrong figures, silence or a traceback: each with its right answer."""

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import FAULTS
from scipy.integrate import solve_ivp

from lpc_mdo.cases import analyze_case
from lpc_mdo.config import ConfigurationError


def case_of(name):
    return json.loads((FAULTS / f"{name}.json").read_text())


def rows_of(discipline, case):
    return analyze_case(discipline, case, Path("case.json"))["results"]


def kinds(row):
    return [flag["what"] for flag in row.get("flags", [])]


def test_figures_of_a_rotor_are_null_where_they_are_undefined():
    for row in rows_of("rotor", case_of("rotor_sweep_axial_velocity")):
        is_defined = row["V_m_per_s"] >= 0.0 and not row["is_windmilling"]
        for key in ("figure_of_merit", "efficiency"):
            if is_defined:
                assert 0.0 <= row[key] < 1.0
                assert "reasons" not in row
            else:
                assert row[key] is None
                assert row["reasons"][key]
        assert ("windmilling" in kinds(row)) == row["is_windmilling"]
        assert ("vortex_ring" in kinds(row)) == row["is_vortex_ring"]
        assert ("polar_extrapolated" in kinds(row)) == (row["extrapolated_share"] > 0.0)


def test_sweep_of_axial_velocity_meets_every_state():
    rows = {row["V_m_per_s"]: row for row in rows_of("rotor", case_of("rotor_sweep_axial_velocity"))}
    assert kinds(rows[0.0]) == []
    assert kinds(rows[-10.0]) == ["vortex_ring"]
    assert kinds(rows[60.0]) == ["windmilling", "polar_extrapolated"]
    assert rows[0.0]["figure_of_merit"] == pytest.approx(0.810, abs=1e-3)
    assert rows[0.0]["efficiency"] == 0.0


@pytest.mark.parametrize(("name", "mach"), [("rotor_supersonic_tip", 1.876), ("rotor_tip_mach_469", 469.0)])
def test_supersonic_tips_are_flagged(name, mach):
    (row,) = rows_of("rotor", case_of(name))
    assert row["tip_mach"] == pytest.approx(mach, rel=1e-3)
    assert row["is_tip_fast"]
    (flag,) = (flag for flag in row["flags"] if flag["what"] == "tip_mach")
    assert "supersonic" in flag["message"]
    assert (flag["value"], flag["limit"]) == (row["tip_mach"], 0.7)


def test_polars_whose_drag_could_fall_below_zero_are_refused():
    case = case_of("rotor_tip_mach_469")
    case["inputs"]["k"] = -0.01
    with pytest.raises(ConfigurationError, match=r"inputs\.k = -0\.01"):
        rows_of("rotor", case)


def test_cell_that_is_empty_from_the_start_has_no_state():
    (row,) = rows_of("battery", case_of("battery_start_empty"))
    assert row["state_of_charge"] is None
    assert kinds(row) == ["battery_empty"]
    assert "empty after 0 s" in row["reasons"]["terminal_voltage_V"]


def by_scipy(inputs, power, duration):
    """Charge at the end and the moment at which it is used up, by an adaptive Runge-Kutta method."""

    def slope(_, y):
        voltage = float(np.interp(max(y[0], 0.0), inputs["soc_table"], inputs["ocv_table_V"])) - y[1]
        current = (voltage - (voltage**2 - 4 * inputs["R0_ohm"] * power) ** 0.5) / (2 * inputs["R0_ohm"])
        return [-current / inputs["capacity_C"], (current - y[1] / inputs["R1_ohm"]) / inputs["C1_F"]]

    def charge(_, y):
        return y[0]

    charge.terminal = True
    run = solve_ivp(slope, (0.0, duration), [1.0, 0.0], events=charge, rtol=1e-9, atol=1e-11, max_step=5.0)
    return run.y[0, -1], run.t_events[0]


def test_cell_that_runs_empty_says_when():
    rows = rows_of("battery", case_of("battery_overdischarge"))
    _, (empty,) = by_scipy(case_of("battery_overdischarge")["inputs"], 30.0, 1800.0)
    assert all(row["state_of_charge"] is None for row in rows)
    (words,) = {row["reasons"]["state_of_charge"] for row in rows}
    assert float(words.split("after ")[1].split(" s")[0]) == pytest.approx(empty, rel=1e-5)
    assert "in segments[0]" in words


@pytest.mark.parametrize("duration", [3e3, 1e4, 6e4, 1e6, 1e7])
@pytest.mark.parametrize("capacity", [14400.0, 1.0])
def test_a_cell_emptied_many_times_over_says_when_it_was_empty(duration, capacity):
    """The moment does not depend on how long one goes on asking."""
    case = case_of("battery_overdischarge")
    case["inputs"] |= {"capacity_C": capacity, "segments": [{"duration_s": duration, "power_W": 30.0}]}
    row = rows_of("battery", case)[0]
    assert row["state_of_charge"] is None
    assert kinds(row) == ["battery_empty"]
    _, (empty,) = by_scipy(case["inputs"], 30.0, 1800.0)
    assert float(row["reasons"]["state_of_charge"].split("after ")[1].split(" s")[0]) == pytest.approx(empty, rel=1e-4)


def test_a_wing_beyond_incompressible_attached_flow_says_so():
    half = {"name": "wing", "camber": "none", "root": [0.0, 0.0, 0.0, 1.0], "tip": [0.0, 4.0, 0.0, 1.0]}
    inputs = {
        "V_m_per_s": 50.0,
        "rho_kg_per_m3": 1.1,
        "surfaces_half": [half],
        "reference": {"S": 8.0, "c": 1.0, "b": 8.0, "point": [0.25, 0.0, 0.0]},
        "conditions_alpha_beta_deg": [[4.0, 0.0], [25.0, 0.0], [-16.0, 0.0]],
    }
    slow = rows_of("wing", {"inputs": inputs})
    assert ["stall_unknown" in kinds(row) for row in slow] == [False, True, True]
    fast = rows_of("wing", {"inputs": inputs | {"V_m_per_s": 500.0}})
    assert all("compressible" in kinds(row) for row in fast)
    assert not any("compressible" in kinds(row) for row in slow)
    assert fast[0]["CL"] == pytest.approx(slow[0]["CL"], rel=1e-12)


def test_segments_before_the_empty_one_keep_their_figures():
    case = case_of("battery_overdischarge")
    case["inputs"]["segments"] = [{"duration_s": 600.0, "power_W": 30.0}] * 4
    rows = rows_of("battery", case)
    left, _ = by_scipy(case["inputs"], 30.0, 1200.0)
    assert [row["state_of_charge"] is None for row in rows] == [False, False, True, True]
    assert rows[1]["state_of_charge"] == pytest.approx(left, abs=1e-6)
    assert all("in segments[2]" in row["reasons"]["current_A"] for row in rows[2:])


def test_falling_tables_of_voltage_are_refused():
    case = case_of("battery_start_empty")
    case["inputs"]["ocv_table_V"][4] = 3.1
    with pytest.raises(ConfigurationError, match=r"ocv_table_V\[4\] = 3\.1 is invalid: it must be at least the 3\.62"):
        rows_of("battery", case)


def test_charge_beyond_the_table_is_flagged():
    case = case_of("battery_start_empty")
    case["inputs"] |= {"soc_table": [0.2, 0.9], "ocv_table_V": [3.4, 4.1], "initial_state_of_charge": 1.0}
    case["inputs"]["segments"] = [{"duration_s": t, "power_W": 15.0} for t in (900.0, 900.0, 1500.0)]
    flags = [kinds(row) for row in rows_of("battery", case)]
    assert flags == [["charge_extrapolated"], [], ["charge_extrapolated"]]


@pytest.mark.parametrize(("rpm", "mach"), [(1e7, "4694"), (4e3, "1.878")])
def test_tones_of_supersonic_tips_are_refused(reference, rpm, mach):
    case = reference("noise_tonal_hover")
    case["inputs"]["rpm"] = rpm
    with pytest.raises(ConfigurationError, match=rf"inputs\.rpm = .*Mach {mach}"):
        rows_of("noise", case)
