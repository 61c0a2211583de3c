"""The noise limit of the main problem at further observers and under each choice of models."""

import pytest
import torch
from conftest import central_difference, number

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.problems.gross_weight import gross_weight_problem

ELEVATIONS = "mission.requirements.further_observer_elevations_deg=[0, 30, 60, 85, 90]"


def a_problem(*overrides):
    return gross_weight_problem(*load(overrides=overrides))


def level_row(problem, x):
    names = [row.name for row in problem.constraints]
    return problem.rows(problem.analyze(x))[names.index("sound_pressure_level")]


@pytest.mark.parametrize("tones", ["steady_loading", "unsteady_loading"])
@pytest.mark.parametrize("broadband", ["schlegel_king_mull", "gill_lee", "brooks_pope_marcolini"])
def test_every_observer_is_limited_and_hears_what_it_would_alone(tones, broadband):
    models = (f"mission.requirements.tonal_model={tones}", f"mission.requirements.broadband_model={broadband}")
    problem = a_problem(ELEVATIONS, *models)
    with torch.no_grad():
        levels = level_row(problem, problem.x0)
        assert levels.shape == (6,)
        # The fourth of the further ones is the mission's own observer again.
        assert float(levels[4]) == pytest.approx(float(levels[0]), abs=1e-10)
        for index, elevation in ((2, 30.0), (5, 90.0)):
            alone = a_problem(f"mission.requirements.observer_elevation_deg={elevation}", *models)
            assert float(level_row(alone, problem.x0)[0]) == pytest.approx(float(levels[index]), abs=1e-10)
        batch = level_row(problem, torch.stack([problem.x0, 0.9 * problem.x0]))
        torch.testing.assert_close(batch[0], levels, rtol=0.0, atol=1e-9)


def test_without_further_observers_the_row_stays_one_number():
    problem = a_problem()
    with torch.no_grad():
        analysis = problem.analyze(problem.x0)
    assert analysis.observed_dba.shape == (1,)
    assert float(analysis.observed_dba[0]) == float(analysis.noise.total_dba)


def test_gradient_at_every_observer_equals_differences():
    problem = a_problem(ELEVATIONS, "mission.requirements.tonal_model=unsteady_loading")
    direction = torch.cos(torch.arange(problem.size, dtype=torch.float64))

    def along(t):
        return level_row(problem, problem.x0 + t * direction)

    exact = torch.autograd.functional.jacobian(along, number(0.0))
    torch.testing.assert_close(exact, central_difference(along, number(0.0), 1e-4)[:, 0], rtol=1e-6, atol=1e-7)


def test_observers_above_the_disk_plane_are_refused():
    with pytest.raises(ConfigurationError, match=r"further_observer_elevations_deg"):
        a_problem("mission.requirements.further_observer_elevations_deg=[0, 95]")
    with pytest.raises(ConfigurationError, match="tonal_model"):
        a_problem("mission.requirements.tonal_model=loud")


@pytest.mark.parametrize(("model", "limit"), [("schlegel_king_mull", 64), ("brooks_pope_marcolini", 8)])
def test_more_observers_than_memory_holds_are_refused(model, limit):
    key = "mission.requirements.further_observer_elevations_deg"
    chosen = f"mission.requirements.broadband_model={model}"
    angles = [round(0.1 * i, 1) for i in range(limit + 1)]
    load(overrides=[chosen, f"{key}={angles[1:]}"])
    with pytest.raises(ConfigurationError, match=f"has {limit + 1} values; it may have at most {limit}"):
        load(overrides=[chosen, f"{key}={angles}"])
