"""The 109-variable problem: its size, its exact derivatives, and what its rows say."""

import json

import pytest
import torch
from conftest import REFERENCE

POINTS = ("initial", "optimum", "random 1", "random 2", "random 3")


def point(problem, name: str):
    if name == "initial":
        return problem.x0
    stored = json.loads((REFERENCE / "optimum.json").read_text())
    optimum = problem.scaled(stored["design"])
    if name == "optimum":
        return optimum
    # Between start and optimum, and off both by a twentieth of the bounds: neither symmetric nor trimmed.
    generator = torch.Generator().manual_seed(int(name[-1]))
    share, noise = (torch.rand(len(optimum), generator=generator, dtype=torch.float64) for _ in range(2))
    return (problem.x0 + share * (optimum - problem.x0) + 0.1 * (noise - 0.5)).clamp(problem.lower, problem.upper)


def outputs(problem, x):
    objective, rows = problem.evaluate(x)
    return torch.cat([objective[..., None], rows], dim=-1)


def exact_jacobian(problem, x):
    x = x.clone().requires_grad_()
    values = outputs(problem, x)
    rows = [torch.autograd.grad(value, x, retain_graph=True, allow_unused=True)[0] for value in values]
    return torch.stack([torch.zeros_like(x) if row is None else row for row in rows])


def central_differences(problem, x, step: float, batch: int = 16):
    """Fourth order, (outputs, variables)."""
    columns = []
    with torch.no_grad():
        for first in range(0, len(x), batch):
            e = step * torch.eye(len(x), dtype=torch.float64)[first : first + batch]
            f = [outputs(problem, x + k * e) for k in (2, 1, -1, -2)]
            columns.append((-f[0] + 8 * f[1] - 8 * f[2] + f[3]) / (12 * step))
    return torch.cat(columns).T


@pytest.mark.parametrize("name", POINTS)
def test_gradient_of_every_output_equals_central_differences(problem, name):
    x = point(problem, name)
    exact = exact_jacobian(problem, x)
    largest = exact.abs().amax(dim=1, keepdim=True)
    # A long step suits small entries (rounding), a short one the onset of flux weakening (truncation): either may agree.
    size = torch.maximum(exact.abs(), 1e-4 * largest).clamp(min=1e-12)
    error = torch.stack([(exact - central_differences(problem, x, h)).abs() / size for h in (1e-3, 1e-4)]).amin(0)
    assert float(error.max()) <= 1e-6, divmod(int(error.argmax()), exact.shape[1])


def test_problem_is_the_published_one(problem):
    assert len(problem.x0) == 109
    assert len(problem.constraints) == 17
    assert torch.equal(problem.x0, problem.x0.clamp(problem.lower, problem.upper))


def test_batch_of_designs_gives_what_single_ones_give(problem):
    batch = torch.stack([point(problem, name) for name in POINTS])
    together = outputs(problem, batch)
    for x, values in zip(batch, together, strict=True):
        torch.testing.assert_close(outputs(problem, x), values, rtol=1e-11, atol=1e-11)


def test_two_evaluations_agree_bit_for_bit(problem):
    assert torch.equal(outputs(problem, problem.x0), outputs(problem, problem.x0))


def test_initial_aircraft_is_symmetric(problem):
    rows = dict(zip([row.name for row in problem.constraints], problem.rows(problem.analyze(problem.x0)), strict=True))
    for name, values in rows.items():
        if "symmetry" in name:
            assert float(values.abs().max()) == 0.0


def test_a_stronger_battery_leaves_more_charge_and_the_same_mass():
    from lpc_mdo.config import load
    from lpc_mdo.problems.gross_weight import gross_weight_problem

    weak, strong = (
        gross_weight_problem(*load(overrides=(f"vehicle.battery.specific_energy_Wh_per_kg={value}",)))
        for value in (200, 300)
    )
    a, b = weak.analyze(weak.x0), strong.analyze(strong.x0)
    assert float(a.gross_mass) == float(b.gross_mass)
    used = [1.0 - float(x.energy.battery.final_state_of_charge) for x in (a, b)]
    assert used[0] / used[1] == pytest.approx(1.5, rel=1e-12)
