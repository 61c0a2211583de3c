"""The examples of the documentation run, and mean what they say."""

import runpy
from pathlib import Path

import pytest
import torch

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


def example(name):
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_every_example_is_tested_here():
    text = Path(__file__).read_text()
    assert all(f'example("{file.stem}")' in text for file in EXAMPLES.glob("*.py"))


def test_every_example_is_shown_on_a_page():
    """By the mark that the site replaces with the file's text."""
    pages = "".join(page.read_text() for page in EXAMPLES.parent.glob("*.md"))
    assert all(f'\n--8<-- "examples/{file.name}"\n' in pages for file in EXAMPLES.glob("*.py"))


def test_blade_alone_is_a_better_rotor_of_the_same_thrust():
    done = example("blade_alone")
    assert done["result"].status == "converged"
    before, after = done["before"], done["after"]
    assert float(after.thrust) == pytest.approx(done["THRUST"], rel=1e-5)
    assert float(before.figure_of_merit) < float(after.figure_of_merit) < 1.0


def test_wing_trimmed_carries_the_weight_without_moment():
    done = example("wing_trimmed")
    assert done["imbalance"](done["controls"]).abs().max() < 1e-12
    steeper = done["imbalance"](done["controls"] + torch.tensor([0.01, 0.0], dtype=torch.float64))
    assert steeper[0] > 0.0, "nose up must give more lift"


def test_new_constraint_has_the_gradient_of_its_own_finite_difference():
    done = example("new_constraint")
    problem, gradient = done["problem"], done["gradient"]
    assert len(problem.constraints) == 18
    direction = torch.randn(problem.size, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    step = 1e-5
    with torch.no_grad():
        ends = [problem.analyze(problem.x0 + k * step * direction).propulsion.torque_share[0] for k in (1.0, -1.0)]
    slope = (ends[0] - ends[1]) / (2.0 * step)
    assert float(gradient @ direction) == pytest.approx(float(slope), rel=1e-6)


def test_other_aircraft_is_the_one_in_the_files():
    done = example("other_aircraft")
    analysis, mission = done["analysis"], done["mission"]
    assert float(analysis.shape.wing.span) == pytest.approx((16.0 * 10.0) ** 0.5, rel=2e-3)  # span along the dihedral
    assert done["vehicle"].name == "Smaller air taxi"
    assert float(analysis.weights.groups["battery"]) == 650.0
    assert mission.requirements.maximum_sound_pressure_level == 62.0
    assert analysis.energy.battery.state_of_charge.shape[-1] == 3 * mission.flights + 1
    assert bool(analysis.scaled_trim.isfinite().all())


def test_four_rotors_hover_with_half_the_motors():
    done = example("four_rotors")
    problem, analysis = done["problem"], done["analysis"]
    assert done["vehicle"].name == "Four rotors"
    assert problem.size == 109 - 4 * 10
    assert analysis.figure_of_merit.shape == (4,)
    assert analysis.shape.boom_length.shape == (1,)
    assert bool(analysis.scaled_trim.isfinite().all())


def test_network_trained_through_the_rotor_meets_the_thrust():
    done = example("train_through_rotor")
    assert done["trained"] < 0.1
    assert done["trained"] < 0.1 * done["untrained"]


def test_openmdao_model_has_exact_partials_and_saves_power():
    pytest.importorskip("openmdao")
    done = example("openmdao_rotor")
    for component in done["partials"].values():
        for pair, entry in component.items():
            # Central differences with relative steps of 1e-6 are good to about 1e-7.
            assert entry["rel error"].forward < 1e-6, pair
    model = done["problem"]
    assert not done["has_failed"]
    assert float(model.get_val("thrust")[0]) == pytest.approx(done["THRUST"], rel=1e-5)
    assert float(model.get_val("power", units="kW")[0]) < done["power_before"][0]


def test_openmdao_component_refuses_what_does_not_fit():
    pytest.importorskip("openmdao")
    import openmdao.api as om

    from lpc_mdo.interop.openmdao import DisciplineComponent, Port

    for outputs, message in (({"y": Port([0.0, 0.0])}, "shape"), ({"z": Port(0.0)}, "declared are")):
        problem = om.Problem(reports=False)
        problem.model.add_subsystem("c", DisciplineComponent(lambda x: {"y": 2.0 * x}, {"x": Port(1.0)}, outputs))
        with pytest.raises(ValueError, match=message):
            problem.setup()
