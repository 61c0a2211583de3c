"""What a report draws and tells: outlines, data flow, comparisons, fronts beside the published ones."""

from dataclasses import asdict, dataclass

import pytest
import torch

from lpc_mdo.config import baseline
from lpc_mdo.model.design import Design
from lpc_mdo.problems.aeroacoustic import aeroacoustic_problem
from lpc_mdo.reporting.acoustics import blades_noise_data
from lpc_mdo.reporting.data_flow import data_flow, reach
from lpc_mdo.reporting.outlines import outlines
from lpc_mdo.reporting.tables import study_headlines
from lpc_mdo.reporting.verification import stored_verification, summary, write_verification


def area(polygon):
    points = torch.tensor(polygon, dtype=torch.float64)
    x, y = points.T
    return float(0.5 * (x * y.roll(-1) - y * x.roll(-1)).sum().abs())


def test_outline_of_the_wing_has_the_area_of_the_wing(problem):
    """Seen from above the wing shows its area, less the cosine of its dihedral and twist (below 1 %)."""
    design = problem.unpack(problem.x0)
    shape = problem.analyze(problem.x0).shape
    top = outlines(problem.analyze_design.geometry, design)["top"]
    assert area(top["wing"][0]) == pytest.approx(float(shape.wing.area), rel=0.01)
    assert area(top["horizontal_tail"][0]) == pytest.approx(float(shape.tail.area), rel=1e-6)


@pytest.mark.parametrize("view", ["top", "front"])
def test_outlines_are_mirror_images_of_themselves(problem, view):
    polygons = outlines(problem.analyze_design.geometry, problem.unpack(problem.x0))[view]
    for name in ("wing", "horizontal_tail", "fuselage", "vertical_tail"):
        across = polygons[name][0][:, 0]
        assert across.max() == pytest.approx(-across.min(), abs=1e-9), name


def test_only_what_the_data_flow_connects_answers_to_a_change(problem):
    """Moving one variable changes the blocks that it is handed to, and none that the recorded graph does not reach."""
    flow = data_flow(problem)
    reached = reach(flow)
    assert reached["design variables"] == set(flow.blocks[1:])
    probes = {
        "battery_mass": {"masses", "mission and battery"},
        "climb_end_altitude": {"atmosphere and flight", "mission and battery"},
        "motor_length": {"motor sizing"},
        "tail_deflection": {"wing and tail"},
    }
    base = problem.analyze(problem.x0)
    for name, first in probes.items():
        design = problem.unpack(problem.x0)
        values = design.values()
        moved = problem.analyze_design(Design.of(values | {name: values[name] * 1.01 + 1e-3}))
        expected = first.union(*(reached[block] for block in first))
        for block, output in {
            "geometry": lambda a: a.shape.wing_mesh,
            "motor sizing": lambda a: a.propulsion.motors.mass,
            "masses": lambda a: a.weights.total.mass,
            "rotors": lambda a: a.propulsion.loads.thrust,
            "motor operation": lambda a: a.propulsion.operation.input_power,
            "wing and tail": lambda a: torch.cat([a.aerodynamics.lift, a.aerodynamics.stall_speed]),
            "trim": lambda a: a.scaled_trim,
            "noise": lambda a: a.noise.total_dba,
            "mission and battery": lambda a: a.energy.battery.state_of_charge,
        }.items():
            has_changed = not torch.equal(output(moved), output(base))
            # Blocks are coarse: a block may depend on another only for values that this variable does not touch.
            assert block in expected or not has_changed, (name, block)
            assert block not in first or has_changed, (name, block)


def test_data_flows_forward_only(problem):
    """No discipline waits for a later one: trim and the rest are closed by the optimizer."""
    flow = data_flow(problem)
    order = {name: i for i, name in enumerate(flow.blocks)}
    assert all(order[giver] < order[taker] for giver, taker, _ in flow.passes)


def test_rotors_hand_over_to_motors_trim_and_noise(problem):
    """What a rotor does is what its motor, the balance of forces and the observer get; nothing is computed for nobody."""
    flow = data_flow(problem)
    handed = {(giver, taker) for giver, taker, _ in flow.passes}
    assert {("rotors", taker) for taker in ("motor operation", "trim", "noise")} <= handed
    assert ("motor operation", "mission and battery") in handed
    assert {giver for giver, _ in handed} == set(flow.blocks) - {"objective", "constraints"}
    assert ("design variables", "motor operation") not in handed, "motors know blades by their loads alone"


@dataclass(frozen=True)
class Compared:
    """What the summary needs of a comparison."""

    model: str
    against: str
    quantity: str
    difference: float
    tolerance: float

    @property
    def is_met(self):
        return abs(self.difference) <= self.tolerance


def test_stored_comparisons_are_summed_up_by_group_and_partner(tmp_path):
    rows = [
        Compared("lattice", "a code", "lift", difference=-0.001, tolerance=0.01),
        Compared("lattice", "a code", "drag", difference=0.008, tolerance=0.01),
        Compared("lattice", "theory", "slope", difference=float("nan"), tolerance=0.01),
    ]
    assert stored_verification(tmp_path / "verification.json") == {}
    write_verification({"Wings": rows[:2]}, tmp_path / "verification.json")
    (line,) = summary(stored_verification(tmp_path / "verification.json"))
    assert (line["group"], line["against"], line["met"]) == ("Wings", "a code", "2 of 2")
    assert (line["quantity"], line["difference"], line["limit"]) == ("lattice: drag", "0.8 %", "1 %")
    missed = summary({"Wings": [asdict(row) | {"is_met": row.is_met} for row in rows]})[1]
    assert (missed["met"], missed["difference"]) == ("0 of 1", "nan")


def test_blades_are_heard_by_the_models_of_their_own_problem():
    """Straight ahead and below at 45 degrees the directivity has the level that the problem minimizes; energies add up."""
    problem = aeroacoustic_problem(*baseline())
    with torch.no_grad():
        analysis = problem.analyze(problem.x0)
        noise = blades_noise_data(problem.analyze_design, analysis)
    levels, polar = noise["directivity"]["levels_dba"], noise["directivity"]["polar_rad"]
    at = int((polar - 0.75 * torch.pi).abs().argmin())
    assert float(polar[at]) == pytest.approx(0.75 * torch.pi, abs=1e-12)
    assert float(levels["together"][at]) == pytest.approx(float(analysis.noise.total_dba), abs=1e-9)
    total = 10.0 * torch.log10(10.0 ** (levels["tones"] / 10.0) + 10.0 ** (levels["broadband"] / 10.0))
    torch.testing.assert_close(total, levels["together"], rtol=0.0, atol=1e-9)
    assert noise["spectrum"]["where"] == "45° below the disks, 76.2 m"


def front_point(x, y, plain=None):
    return {
        "position": [x, y],
        "is_on_front": True,
        "value": x,
        "status": "converged",
        "outputs": {"sound_pressure_level_unweighted_db": plain},
    }


def test_fronts_are_told_beside_the_published_ones():
    blades = {
        "name": "noise-efficiency",
        "is_published_case": True,
        "points": [front_point(0.8, 79.0, 91.5), front_point(0.6, 60.0, 80.0)],
    }
    rows = study_headlines(blades)
    assert [(row.published, row.ours, row.difference) for row in rows] == [
        ("just over 0.78", "0.800", "+0.020"),
        ("≈ 91 dB(A)", "79.0 dB(A)", "−12.0 dB(A)"),
        ("just below 0.64", "0.600", "−0.040"),
        ("≈ 81 dB(A)", "60.0 dB(A)", "−21.0 dB(A)"),
    ]
    speed = {
        "name": "weight-speed",
        "method": "parameter",
        "points": [front_point(50.0, 2000.0), front_point(55.5, 2100.0)],
    }
    (row,) = study_headlines(speed | {"is_published_case": True})
    assert (row.name, row.ours, row.difference) == (
        "gross weight for +11.0 % of cruise speed",
        "+5.00 %",
        "−10.0 points",
    )
    assert study_headlines(blades | {"name": "wall"}) == []
    assert study_headlines(speed | {"is_published_case": False}) == [], "another aircraft's front is not compared"
