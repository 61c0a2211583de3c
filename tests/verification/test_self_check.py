"""`lpc-mdo check` passes on a sound installation and names what is broken on another."""

import pytest
import torch
from click.testing import CliRunner

from lpc_mdo.cli import main
from lpc_mdo.problems.problem import Constraint, Objective, Problem, Variable
from lpc_mdo.verification import self_check


def check(*options):
    run = CliRunner().invoke(main, ["check", *options])
    return run.exit_code, run.stdout


def test_every_check_passes_at_the_start():
    code, table = check()
    assert code == 0
    assert "FAIL" not in table
    assert table.count("pass") >= 4 + 1 + 17  # inputs, surrogates, start; objective; constraints
    for name in ("airfoil surrogate", "structural mass", "gross_mass", "sound_pressure_level"):
        assert name in table


def test_a_damaged_surrogate_is_named_and_fails(monkeypatch):
    def damaged(name):
        raise ValueError("sha256 of the weights is 00, the card says [ff]")

    monkeypatch.setattr(self_check, "load_airfoil", damaged)
    code, table = check()
    assert code == 1
    assert "FAIL" in table
    assert "[ff]" in table


class _Doubled(torch.autograd.Function):
    """Identity whose gradient is twice what it should be."""

    @staticmethod
    def forward(context, x):
        return x.clone()

    @staticmethod
    def backward(context, gradient):
        return 2.0 * gradient


@pytest.mark.parametrize("option", [(), ("--gradients",)])
def test_a_wrong_gradient_fails_the_row_it_belongs_to(monkeypatch, option):
    def wrong(problem, x):
        objective, constraints = problem.evaluate(x)
        return torch.cat([_Doubled.apply(objective)[..., None], constraints], dim=-1)

    monkeypatch.setattr(self_check, "_values", wrong)
    monkeypatch.setattr(self_check, "gross_weight_problem", lambda vehicle, mission: _small_problem())
    code, table = check(*option)
    assert code == 1
    assert [line.split("│")[1].strip() for line in table.splitlines() if "FAIL" in line] == ["gradient: product"]


def _small_problem():
    return Problem(
        name="small",
        formulation="paper",
        variables=(Variable("sides", "m", 0.0, 4.0, [1.0, 3.0], (2,)),),
        constraints=(Constraint("sum", "m", lambda sides: sides.sum(-1), upper=5.0),),
        objective=Objective("product", "m^2", lambda sides: sides.prod(-1)),
        analyze_design=lambda sides: sides,
        complete=lambda values: values["sides"],
    )
