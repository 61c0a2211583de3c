"""Cases of one discipline with any numbers: an answer that is finite or null with its reason, or one sentence; nothing else."""

import copy
import json
import math
from pathlib import Path

import pytest
from conftest import FAULTS, REFERENCE
from hypothesis import given, settings
from hypothesis import strategies as st

from lpc_mdo.cases import analyze_case, structures
from lpc_mdo.files.read import ConfigurationError

FILE = Path("case.json")
BASES = {
    "rotor": [REFERENCE / "bem_lift_rotor_axial.json", FAULTS / "rotor_sweep_axial_velocity.json"],
    "motor": [REFERENCE / "motor_dq.json", FAULTS / "motor_low_voltage.json"],
    "battery": [FAULTS / "battery_overdischarge.json", FAULTS / "battery_start_empty.json"],
    "noise": [REFERENCE / "noise_tonal_hover.json", REFERENCE / "noise_a_weighting.json"],
    "structures": [REFERENCE / "structures_frame_L.json", FAULTS / "tube_load_at_45deg.json"],
}
EXTREME = st.sampled_from(
    [0.0, -0.0, 1.0, -1.0, 1e-9, -1e-9, 1e-30, 1e-300, 5e-324, 1e9, 1e30, 1e300, -1e300, 1.7e308, math.nan, math.inf]
    + [0, 1, -1, 7, 2**70, -(2**70), 10**400, True, None, "1.0", [], {}, [1.0, 2.0]]
)
ANY = EXTREME | st.floats(allow_nan=False, allow_infinity=False) | st.integers(-10, 10_000)


def leaves(node, path=()):
    """Paths of all values that are numbers."""
    if isinstance(node, dict):
        for key, value in node.items():
            yield from leaves(value, (*path, key))
    elif isinstance(node, list):
        for i, value in enumerate(node[:4]):
            yield from leaves(value, (*path, i))
    elif isinstance(node, int | float):
        yield path


def base(file):
    """A case with its conditions apart and at most three of them, for speed."""
    case = json.loads(file.read_text())
    if "inputs" in case:
        case = {key: case[key] for key in ("inputs", "conditions", "results") if key in case}
        for key in ("conditions", "results"):
            if key in case:
                case[key] = case[key][:3]
    return case


@st.composite
def damaged(draw, discipline):
    """A case with one to three numbers replaced by any, or scaled by up to a million."""
    case = copy.deepcopy(draw(st.sampled_from(CASES[discipline])))
    places = list(leaves(case))
    for place in draw(st.lists(st.sampled_from(places), min_size=1, max_size=3, unique=True)):
        *path, last = place
        node = case
        for step in path:
            node = node[step]
        scaled = st.floats(-6.0, 6.0).map(lambda x, old=node[last]: old * 10.0**x)
        node[last] = draw(ANY | scaled | st.just(-node[last]))
    return case


CASES = {discipline: [base(file) for file in files] for discipline, files in BASES.items()}


def numbers_are_honest(node, reasons=None):
    """Every number is finite; what is null stands beside its reason, or is a value or limit of a flag."""
    if isinstance(node, dict):
        for key, value in node.items():
            if value is None:
                assert key in node.get("reasons", {}) or ("what" in node and node["message"]), key
            numbers_are_honest(value)
    elif isinstance(node, list):
        for value in node:
            assert value is not None
            numbers_are_honest(value)
    elif isinstance(node, float):
        assert math.isfinite(node)


def ask(discipline, case):
    """The answer, and the refusal where there is none."""
    try:
        if discipline == "structures":
            return structures.analyze_case(case, FILE), ""
        return analyze_case(discipline, case, FILE), ""
    except ConfigurationError as error:
        return None, str(error)


@pytest.mark.parametrize("discipline", list(BASES))
def test_damaged_cases_are_answered_honestly_or_refused_in_a_sentence(discipline):
    outcomes = {"answered": 0, "refused": 0}

    @settings(max_examples=200, deadline=None, derandomize=True)
    @given(damaged(discipline))
    def holds(case):
        answer, refusal = ask(discipline, case)
        outcomes["refused" if answer is None else "answered"] += 1
        assert len(refusal) < 500
        assert "\n" not in refusal
        numbers_are_honest(answer)

    holds()
    assert min(outcomes.values()) > 10, outcomes
