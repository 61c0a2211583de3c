"""The 64-variable problem: its table, its agreement with the main problem's hover, its physics, and its front."""

import math
from dataclasses import replace

import pytest
import torch
from conftest import central_difference

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.numerics.constants import GRAVITY
from lpc_mdo.problems.aeroacoustic import (
    HoverAnalyzer,
    LeastMerit,
    Observer,
    WeightedSum,
    aeroacoustic_front,
    aeroacoustic_problem,
)
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.reporting.acoustics import hover_source
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.pareto import noise_efficiency
from lpc_mdo.studies.runner import StudyRun
from lpc_mdo.studies.single import solve

RPM, DEGREE = math.pi / 30.0, math.pi / 180.0
MIRROR = [6, 7, 4, 5, 2, 3, 0, 1]


@pytest.fixture(scope="module")
def blades():
    return aeroacoustic_problem(*load(overrides=["mission.requirements.observer_elevation_deg=45"]))


def test_the_table_is_the_published_one(blades):
    table = {v.name: (v.count, v.lower, v.upper) for v in blades.variables}
    assert table == {
        "blade_twist": (32, 3.0 * DEGREE, 85.0 * DEGREE),
        "blade_chord": (24, 0.02, 0.5),
        "lift_rotor_speed": (8, 500.0 * RPM, 1800.0 * RPM),
    }
    assert blades.size == 64
    assert [(row.name, row.kind) for row in blades.constraints] == [("trim_residual", "equality")]


def test_the_start_is_the_main_problems_hover(blades, problem):
    """Same blades, same aircraft: thrust, torque, trim and spectra of both analyses are the same to rounding."""
    with torch.no_grad():
        hover, whole = blades.analyze(blades.x0), problem.analyze(problem.x0)
    torch.testing.assert_close(hover.rotors.loads.thrust, whole.propulsion.loads.thrust[:8], rtol=1e-12, atol=0.0)
    torch.testing.assert_close(hover.rotors.loads.torque, whole.propulsion.loads.torque[:8], rtol=1e-12, atol=0.0)
    torch.testing.assert_close(hover.scaled_trim[0], whole.scaled_trim[0], rtol=1e-10, atol=1e-12)
    assert float(hover.mean_figure_of_merit) == pytest.approx(float(whole.mean_figure_of_merit), rel=1e-12)
    steep = aeroacoustic_problem(*load(), observer=Observer(elevation=85.0 * DEGREE))
    level = float(steep.analyze(steep.x0).noise.total_dba)
    assert level == pytest.approx(float(whole.noise.total_dba), rel=1e-10)


def test_gradients_equal_differences(blades):
    generator = torch.Generator().manual_seed(3)
    direction = torch.rand(blades.size, generator=generator, dtype=torch.float64) - 0.5
    for share in (0.0, 0.3):
        x = blades.x0 + share * (2.0 * torch.rand(blades.size, generator=generator, dtype=torch.float64) - 1.0)
        x = x.clamp(-1.0, 1.0)

        def along(t, x=x):
            f, c = blades.evaluate(x + t * direction)
            return torch.cat([f[None], c])

        ours = torch.autograd.functional.jacobian(along, torch.zeros((), dtype=torch.float64))
        theirs = central_difference(along, torch.zeros((), dtype=torch.float64), 1e-4)[:, 0]
        torch.testing.assert_close(ours, theirs, rtol=1e-6, atol=1e-7)


def test_a_mirrored_design_sounds_and_hovers_the_same_with_mirrored_moments(blades):
    generator = torch.Generator().manual_seed(5)
    x = (blades.x0 + 0.2 * (torch.rand(blades.size, generator=generator, dtype=torch.float64) - 0.5)).clamp(-1.0, 1.0)
    design = blades.unpack(x)
    speeds = {name: speed[MIRROR] for name, speed in design.of_segments.items()}
    mirrored = replace(
        design, blade_twist=design.blade_twist[MIRROR], blade_chord=design.blade_chord[MIRROR], of_segments=speeds
    )
    one, other = blades.analyze_design(design), blades.analyze_design(mirrored)
    assert float(one.noise.total_dba) == pytest.approx(float(other.noise.total_dba), abs=1e-9)
    sign = torch.tensor([1.0, -1.0, 1.0, -1.0, 1.0, -1.0], dtype=torch.float64)
    # The published structure's centre of gravity lies a few micrometres off the plane of symmetry.
    hover = blades.analyze_design
    aside = (
        2.0
        * hover.weights.total.center_of_gravity[1]
        * one.rotors.loads.thrust.sum()
        / (hover.weights.total.mass * GRAVITY * 0.5 * hover.span)
    )
    expected = sign * other.scaled_trim[0] + torch.eye(6, dtype=torch.float64)[3] * aside
    torch.testing.assert_close(one.scaled_trim[0], expected, rtol=0.0, atol=1e-12)


def test_doubling_the_distance_lowers_the_level_by_six_decibels():
    """To 0.1 dB from 600 m on, where the eight rotors are nearly one source."""
    levels = []
    for distance in (600.0, 1200.0):
        far = aeroacoustic_problem(*load(), observer=Observer(distance=distance))
        levels.append(float(far.analyze(far.x0).noise.total_dba))
    assert levels[0] - levels[1] == pytest.approx(20.0 * math.log10(2.0), abs=0.1)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: WeightedSum(1.2), "weight = 1.2 is not allowed; it must lie between 0 and 1"),
        (lambda: WeightedSum(math.nan), "weight = nan is not allowed"),
        (lambda: Observer(distance=1.0), "observer distance = 1 m is not allowed; it must lie between 10 and 2000"),
        (lambda: Observer(elevation=2.0), r"observer angle = 114\.592 deg is not allowed"),
        (lambda: LeastMerit(1.0), "figure of merit = 1 is not allowed"),
    ],
)
def test_values_out_of_range_are_refused(make, message):
    with pytest.raises(ConfigurationError, match=message):
        make()


@pytest.fixture(scope="module")
def front(tmp_path_factory):
    """Three weights around 0.7, close enough for a parabola."""
    study = noise_efficiency(*load(), 11)
    near = replace(study, values=(0.66, 0.7, 0.74))
    return StudyRun(near, tmp_path_factory.mktemp("front"), InProcess()).run()["points"]


def test_every_point_is_certified_trimmed_and_on_the_front(front):
    for point in front:
        assert point["status"] == "converged"
        assert point["certificate"]["stationarity"] <= 1e-4
        assert point["certificate"]["feasibility"] <= 1e-6
        assert point["is_on_front"] is True
    merits, levels = zip(*(point["position"] for point in front), strict=True)
    assert merits == tuple(sorted(merits, reverse=True))  # more weight on noise: quieter and less efficient
    assert levels == tuple(sorted(levels, reverse=True))


def test_slope_of_the_weights_equals_that_of_the_points(front):
    """Between neighbours 0.04 apart the parabola is off by some per mille."""
    slope = front[1]["slope"]
    assert slope["from_multipliers"] == pytest.approx((0.3 / 0.7) * 100.0)
    assert slope["from_points"] == pytest.approx(slope["from_multipliers"], rel=0.01)


def test_the_epsilon_constraint_finds_the_same_point_with_the_same_slope(front):
    """The quietest blades of at least this figure of merit: same level, and the slope is its multiplier."""
    merit, level = front[1]["position"]
    (problem,) = aeroacoustic_front(*load(), [LeastMerit(merit)])
    result, content = solve(problem)
    assert content.is_converged
    assert content.outputs["figure_of_merit_mean"] == pytest.approx(merit, abs=1e-6)
    assert content.outputs["sound_pressure_level_dba"] == pytest.approx(level, abs=5e-3)
    rows = {row.name: row.multiplier for row in content.constraints}
    assert -rows["mean_figure_of_merit"] == pytest.approx(front[1]["slope"]["from_multipliers"], rel=5e-3)
    with torch.no_grad():
        a = problem.analyze(result.x)
    weight = a.gross_mass * GRAVITY
    assert float(a.rotors.loads.thrust.sum() / weight) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("tonal", ["steady_loading", "unsteady_loading"])
@pytest.mark.parametrize("broadband", ["schlegel_king_mull", "gill_lee", "brooks_pope_marcolini"])
def test_both_problems_hear_one_design_alike_by_the_models_of_the_mission(tonal, broadband):
    """The same rotors, observer and models: hover of the whole aircraft and the problem of its blades agree to rounding."""
    vehicle, mission = load()
    heard = {"tonal_model": tonal, "broadband_model": broadband}
    requirements = mission.requirements.model_copy(update=heard)
    mission = mission.model_copy(update={"requirements": requirements})
    observer = Observer(requirements.observer_distance, requirements.observer_elevation)
    blades = HoverAnalyzer(vehicle, mission, observer)
    whole = gross_weight_problem(vehicle, mission)
    with torch.no_grad():
        analysis = whole.analyze(whole.x0)
        design = whole.unpack(whole.x0)
        of_lift = {name: getattr(design, name)[: len(vehicle.lift_rotors)] for name in ("blade_twist", "blade_chord")}
        ours = blades(replace(design, pitch=torch.zeros(0, dtype=torch.float64), **of_lift)).noise
    for name in ("total_dba", "tonal_dba", "broadband_dba"):
        assert float(getattr(ours, name)) == pytest.approx(float(getattr(analysis.noise, name)), abs=1e-9)


def test_every_noise_model_of_the_mission_moves_the_level_of_the_blades():
    vehicle, mission = load()
    levels = set()
    for tonal in ("steady_loading", "unsteady_loading"):
        for broadband in ("schlegel_king_mull", "gill_lee", "brooks_pope_marcolini"):
            chosen = {"tonal_model": tonal, "broadband_model": broadband}
            requirements = mission.requirements.model_copy(update=chosen)
            problem = aeroacoustic_problem(vehicle, mission.model_copy(update={"requirements": requirements}))
            with torch.no_grad():
                levels.add(round(float(problem.analyze(problem.x0).noise.total_dba), 4))
    assert len(levels) == 6


def test_every_rotor_is_heard_with_its_own_number_of_blades():
    more = [f"vehicle.rotors.{i}.blades=4" for i in (0, 6)]  # a mirrored pair
    problem = gross_weight_problem(*load(overrides=more))
    with torch.no_grad():
        analysis = problem.analyze(problem.x0)
    assert hover_source(analysis).loading.blades.tolist() == [4.0, 2.0, 2.0, 2.0, 2.0, 2.0, 4.0, 2.0]
    frequency = (
        analysis.noise.tonal.frequency[..., 0]
        / analysis.propulsion.loads.inflow.rotation_speed[: len(analysis.noise.tonal.frequency)]
    )
    assert (frequency * 2.0 * math.pi).tolist()[:2] == pytest.approx([4.0, 2.0])
