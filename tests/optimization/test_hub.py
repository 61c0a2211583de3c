"""Many problems side by side in a hub: the same optima as one at a time, and no problem harms another."""

import gc
import json
import os
import signal
import threading
from dataclasses import replace

import pytest
import torch
from conftest import REFERENCE
from hock_schittkowski import OTHER_OPTIMUM, bounds, expression

from lpc_mdo.config import load
from lpc_mdo.optimization import Hooks, Options, minimize_problem
from lpc_mdo.optimization.hub import POINTS, Hub
from lpc_mdo.optimization.requests import Batch
from lpc_mdo.problems.aeroacoustic import WeightedSum, aeroacoustic_front
from lpc_mdo.studies.together import solve_together

PROBLEMS = json.loads((REFERENCE / "hock_schittkowski.json").read_text())["problems"]
TIGHT = Options(stationarity_tolerance=1e-6, feasibility_tolerance=1e-10, outer_iterations=60, inner_iterations=500)


class HockSchittkowski:
    """All problems of the set as one batch: variables and rows that a problem lacks are fixed, or free rows of zero."""

    def __init__(self, cases):
        self.cases = cases
        self.n = max(case["n"] for case in cases)
        self.m = max(len(case["equalities"]) + len(case["inequalities"]) for case in cases)
        self.objectives = [expression(case["objective"]) for case in cases]
        self.rows = [[expression(t) for t in [*case["equalities"], *case["inequalities"]]] for case in cases]

    def evaluate(self, x, which):
        objectives, constraints = [], []
        for point, case in zip(x, which.tolist(), strict=True):
            used = point[: self.cases[case]["n"]]
            values = [torch.as_tensor(row(used), dtype=torch.float64) for row in self.rows[case]]
            objectives.append(self.objectives[case](used))
            constraints.append(torch.stack([*values, *[0.0 * point.sum()] * (self.m - len(values))]))
        return torch.stack(objectives), torch.stack(constraints)

    def padded(self, values, missing, size):
        return torch.tensor([*values, *[missing] * (size - len(values))], dtype=torch.float64)

    def arrays(self):
        starts, lower, upper, low, high = [], [], [], [], []
        for case in self.cases:
            least, most = (
                bounds(case[name], case["n"], end) for name, end in (("lower", -torch.inf), ("upper", torch.inf))
            )
            free = torch.full((case["n"],), torch.inf, dtype=torch.float64)
            starts.append(self.padded(case["x0"], 0.0, self.n))
            lower.append(self.padded((-free if least is None else least).tolist(), 0.0, self.n))
            upper.append(self.padded((free if most is None else most).tolist(), 0.0, self.n))
            equal, other = len(case["equalities"]), len(case["inequalities"])
            low.append(self.padded([0.0] * (equal + other), -torch.inf, self.m))
            high.append(self.padded([0.0] * equal, torch.inf, self.m))
        return [torch.stack(rows) for rows in (starts, lower, upper, low, high)]


def minimize_all(evaluate, arrays, options=None, solver="sqp", hooks=None, ended=lambda i, ending: None):
    """arrays: x0, lower, upper (k, n) and limits of the rows (k, m)."""

    def work(i, remote):
        own = [array[i] for array in arrays]
        return minimize_problem(
            remote, *own, solver=solver, options=options, is_batched=True, hooks=hooks[i] if hooks else None
        )

    return Hub(evaluate, work, len(arrays[0]), ended).run()


@pytest.fixture(scope="module")
def hock_schittkowski():
    # Scaled by its slope at the start, the objective of HS64 is nearly flat at the optimum.
    flat = [case for case in PROBLEMS if case["name"] == "HS64"]
    found: dict[str, object] = {}
    for cases, options in (
        ([case for case in PROBLEMS if case not in flat], TIGHT),
        (flat, replace(TIGHT, stationarity_tolerance=1e-8)),
    ):
        batch = HockSchittkowski(cases)
        endings = minimize_all(batch.evaluate, batch.arrays(), options)
        found |= dict(zip((case["name"] for case in cases), endings, strict=True))
    return found


def test_second_derivatives_that_steps_improve_lead_to_the_same_optima():
    cases = [case for case in PROBLEMS if case["name"] != "HS64"][::4]
    batch = HockSchittkowski(cases)
    endings = minimize_all(batch.evaluate, batch.arrays(), replace(TIGHT, second_derivatives="updated"))
    for case, ending in zip(cases, endings, strict=True):
        result = ending.unwrap()
        assert result.status == "converged", (case["name"], result.message)
        assert result.objective == pytest.approx(OTHER_OPTIMUM.get(case["name"], case["f_opt"]), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("case", PROBLEMS, ids=lambda case: case["name"])
def test_hock_schittkowski_optimum_out_of_one_hub(case, hock_schittkowski):
    result = hock_schittkowski[case["name"]].unwrap()
    assert result.status == "converged", (result.message, result.certificate)
    assert result.objective == pytest.approx(OTHER_OPTIMUM.get(case["name"], case["f_opt"]), rel=1e-6, abs=1e-6)


def circles(failing=lambda x: torch.zeros(len(x), dtype=torch.bool)):
    """min a x + y within the circle x^2 + y^2 <= r^2 of each problem: optimum -r sqrt(1 + a^2)."""
    slopes, radii = torch.tensor([0.5, 1.0, 2.0, -3.0]).double(), torch.tensor([1.0, 2.0, 0.5, 1.5]).double()
    asked = []

    def evaluate(x, which):
        asked.append(which.tolist())
        if bool(failing(x.detach()).any()):
            raise FloatingPointError("no solution")
        return slopes[which] * x[:, 0] + x[:, 1], (x**2).sum(-1, keepdim=True)

    start = torch.tensor([[0.1, -0.2]]).double().expand(4, 2)
    free = torch.full((4, 2), torch.inf).double()
    arrays = (start, -free, free, torch.full((4, 1), -torch.inf).double(), radii[:, None] ** 2)
    return evaluate, arrays, -radii * (1.0 + slopes**2).sqrt(), asked


@pytest.mark.filterwarnings("ignore:delta_grad == 0.0:UserWarning")  # SciPy's trust-constr, of this linear objective
@pytest.mark.parametrize("solver", ["sqp", "augmented-lagrangian", "slsqp", "trust-constr", "ipopt"])
def test_every_problem_keeps_its_own_multiplier_and_optimum(solver):
    """d optimum / d r^2 = -sqrt(1 + a^2)/(2 r): each problem's own, whatever the others do and whoever solves them."""
    if solver == "ipopt":
        pytest.importorskip("cyipopt")
    evaluate, arrays, optima, _ = circles()
    radii = arrays[-1].sqrt()[:, 0].tolist()
    for ending, optimum, r in zip(minimize_all(evaluate, arrays, solver=solver), optima.tolist(), radii, strict=True):
        result = ending.unwrap()
        assert result.status == "converged"
        assert result.objective == pytest.approx(optimum, rel=1e-6)
        assert float(result.multipliers[0]) == pytest.approx(-optimum / (2.0 * r * r), rel=1e-4)


@pytest.mark.parametrize("solver", ["sqp", "augmented-lagrangian"])
def test_company_changes_nothing_of_a_problem(solver):
    """Same points, same words, same numbers of evaluations as `minimize_problem` alone."""
    evaluate, arrays, _, _ = circles()
    for i, ending in enumerate(minimize_all(evaluate, arrays, solver=solver)):

        def own(x, i=i):
            flat = x.reshape(-1, 2)
            objective, rows = evaluate(flat, torch.full((len(flat),), i))
            return objective.reshape(x.shape[:-1]), rows.reshape(*x.shape[:-1], 1)

        alone = minimize_problem(own, *[array[i] for array in arrays], solver=solver, is_batched=True)
        result = ending.unwrap()
        torch.testing.assert_close(result.x, alone.x, rtol=0.0, atol=1e-12)
        assert (result.status, result.message, result.counts) == (alone.status, alone.message, alone.counts)
        assert [record.phase for record in result.history] == [record.phase for record in alone.history]


def test_the_same_hub_twice_has_the_same_bits():
    one, other = ([e.unwrap().x for e in minimize_all(*circles()[:2])] for _ in range(2))
    assert all(torch.equal(a, b) for a, b in zip(one, other, strict=True))


def test_questions_are_gathered_and_whoever_is_done_leaves():
    evaluate, arrays, _, asked = circles()
    counts = [ending.unwrap().counts.evaluations for ending in minimize_all(evaluate, arrays)]
    assert max(map(len, asked)) <= POINTS
    assert sum(set(which) == {0, 1, 2, 3} for which in asked) > 0.3 * len(asked)
    assert len(asked) < 0.5 * sum(counts)
    assert set(asked[-1]) < {0, 1, 2, 3}


def test_a_model_that_fails_at_a_point_makes_that_problem_step_back_and_the_others_do_not_notice():
    """The model of all has no values right of x = 0.3, where none of the optima lies but the last's."""
    plain, failing = (circles(f)[:2] for f in (lambda x: x[:, 0] > 99.0, lambda x: x[:, 0] > 0.3))
    short = Options(outer_iterations=3, inner_iterations=20)
    for one, other in list(zip(minimize_all(*plain), minimize_all(*failing, short), strict=True))[:3]:
        assert other.unwrap().status == "converged"
        assert one.unwrap().objective == pytest.approx(other.unwrap().objective, rel=1e-6)


@pytest.mark.parametrize("kind", ["values", "gradients", "raised", "broken"])
def test_a_start_that_fails_harms_no_other(kind):
    evaluate, arrays, optima, _ = circles()

    def failing(x, which):
        objective, rows = evaluate(x, which)
        if kind in ("raised", "broken") and bool((which == 2).any()):
            raise FloatingPointError("no root") if kind == "raised" else RuntimeError("a fault of the model")
        if kind == "values":
            return torch.where(which == 2, torch.nan, objective), rows
        return objective + torch.where(which == 2, x[:, 0] - x[:, 0], 1.0).sqrt() - 1.0, rows

    endings = minimize_all(failing, arrays)
    with pytest.raises(RuntimeError if kind == "broken" else ValueError, match=r"a fault of|start is not allowed"):
        endings[2].unwrap()
    for i in (0, 1, 3):
        assert endings[i].unwrap().status == "converged"
        assert endings[i].unwrap().objective == pytest.approx(float(optima[i]), rel=1e-6)


def test_infeasible_problems_and_limits_end_as_they_do_alone():
    """x^2 + y^2 <= r^2 with r^2 = -1 has no point; the others have theirs."""
    evaluate, arrays, optima, _ = circles()
    arrays[-1][1] = -1.0
    endings = minimize_all(evaluate, arrays)
    assert endings[1].unwrap().status == "infeasible"
    assert "no feasible design found" in endings[1].unwrap().message
    assert endings[0].unwrap().objective == pytest.approx(float(optima[0]), rel=1e-6)
    short = Options(outer_iterations=1, inner_iterations=1, newton_iterations=0)
    assert {e.unwrap().status for e in minimize_all(*circles()[:2], short)} == {"iteration_limit"}
    late = Options(time_limit=0.0)
    assert {e.unwrap().status for e in minimize_all(*circles()[:2], late)} == {"time_limit"}


@pytest.mark.parametrize("solver", ["sqp", "augmented-lagrangian"])
def test_a_problem_without_a_bottom_says_so_beside_others_that_have_one(solver):
    """Without its circle the objective of the second falls forever; the others have their optima all the same."""
    evaluate, arrays, optima, _ = circles()
    arrays[-1][1] = torch.inf
    endings = minimize_all(evaluate, arrays, solver=solver)
    assert endings[1].unwrap().status == "unbounded"
    for i in (0, 2, 3):
        assert endings[i].unwrap().status == "converged"
        assert endings[i].unwrap().objective == pytest.approx(float(optima[i]), rel=1e-6)


def test_a_falling_problem_ends_in_a_hub_as_it_does_alone():
    """Unbounded along a constraint, down a line, down a cubic: one status each, alone and in company."""
    falls = (
        lambda x: x[..., 0] ** 2 - x[..., 1] ** 2,
        lambda x: -x[..., 0] - x[..., 1],
        lambda x: x[..., 0] ** 3 + x[..., 1] ** 2,
    )

    def evaluate(x, which):
        values = torch.stack([fall(x) for fall in falls])
        return values[which, torch.arange(len(x))], x[..., :1] - 0.1 * x[..., 1:]

    free = torch.full((3, 2), torch.inf).double()
    limit = torch.tensor([[0.0], [torch.inf], [torch.inf]]).double()
    start = torch.tensor([[0.5, 0.6]]).double().expand(3, 2)
    for i, ending in enumerate(minimize_all(evaluate, (start, -free, free, -limit, limit))):
        alone = minimize_problem(
            lambda x, i=i: (falls[i](x), x[..., :1] - 0.1 * x[..., 1:]),
            *(array[i] for array in (start, -free, free, -limit, limit)),
            solver="sqp",
            is_batched=True,
        )
        assert ending.unwrap().status == alone.status == "unbounded"
        assert ending.unwrap().message == alone.message


def test_every_problem_keeps_checkpoints_from_which_it_goes_on():
    evaluate, arrays, optima, _ = circles()
    states = [[] for _ in range(4)]
    hooks = [Hooks(checkpoint=own.append) for own in states]
    minimize_all(evaluate, arrays, Options(newton_iterations=2), hooks=hooks)

    def resumed(i, remote):
        return minimize_problem(remote, *[array[i] for array in arrays], state=states[i][1], is_batched=True)

    for i, ending in enumerate(Hub(evaluate, resumed, 4).run()):
        assert ending.unwrap().objective == pytest.approx(float(optima[i]), rel=1e-6)


@pytest.mark.parametrize("place", ["in the hub", "in a solver's thread"])
def test_an_interruption_ends_every_problem_with_its_newest_point(place):
    evaluate, arrays, _, _ = circles()
    records, done = [], []

    def stop_once():
        if len(records) >= 5 and not done:
            done.append(True)
            os.kill(os.getpid(), signal.SIGINT)

    def interrupting(x, which):
        if place == "in the hub":
            stop_once()
        return evaluate(x, which)

    def progress(record):
        records.append(record)
        if place != "in the hub":
            stop_once()

    endings = minimize_all(interrupting, arrays, hooks=[Hooks(progress=progress)] * 4)
    assert {ending.unwrap().status for ending in endings} == {"interrupted"}
    assert all(bool(ending.unwrap().x.isfinite().all()) for ending in endings)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("problem ")]


def test_an_error_of_the_caller_ends_all_threads():
    evaluate, arrays, _, _ = circles()

    def ended(i, ending):
        raise OSError("no space left")

    with pytest.raises(OSError, match="no space left"):
        minimize_all(evaluate, arrays, ended=ended)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("problem ")]


def test_time_is_shared_among_the_problems():
    endings = minimize_all(*circles()[:2])
    assert all(ending.wall > 0.0 and ending.processor >= 0.0 for ending in endings)


WEIGHTS = (0.0, 0.3, 0.8)


def test_quiet_and_efficient_blades_of_several_weights_at_once():
    """The 64-variable problem: certified, and the same optima as one at a time."""
    problems = aeroacoustic_front(*load(), [WeightedSum(weight) for weight in WEIGHTS])
    for ending, problem in zip(solve_together(problems, "augmented-lagrangian"), problems, strict=True):
        result = ending.unwrap()
        alone = minimize_problem(
            problem.evaluate,
            problem.x0,
            problem.lower,
            problem.upper,
            problem.constraint_lower,
            problem.constraint_upper,
            is_batched=True,
        )
        assert result.status == alone.status == "converged"
        assert result.certificate.holds(1e-4, 1e-6)
        assert result.objective == pytest.approx(alone.objective, rel=1e-6)


def test_problems_of_different_analyses_are_not_solved_together():
    one, other = (
        aeroacoustic_front(*load(overrides=[f"vehicle.wing.area_m2={a}"]), [WeightedSum()])[0] for a in (18, 19)
    )
    with pytest.raises(ValueError, match="different analyses"):
        solve_together([one, other])


def test_evaluations_are_freed_with_the_points_that_they_served():
    """Each holds its graph, 10 MB a design of the aircraft: one that nobody needs must go."""
    evaluate, arrays, _, _ = circles()
    records, alive = [], []

    def count(record):
        records.append(record)
        if len(records) % 8 == 0:
            gc.collect()
            alive.append(sum(type(item) is Batch for item in gc.get_objects()))

    gc.freeze()  # what was there before is not looked through each time
    try:
        minimize_all(evaluate, arrays, hooks=[Hooks(progress=count)] * 4)
    finally:
        gc.unfreeze()
    assert len(alive) > 1
    assert min(alive) > 0, "none was counted"
    assert max(alive) <= 2 * len(arrays) + 2, "a point and one beside it, of each problem"
