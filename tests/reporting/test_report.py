"""The report: what is stored, what is drawn from it, the page, and folders that cannot be reported."""

import json
import math
import re
import shutil
import subprocess
import sys
from dataclasses import asdict, replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
import torch
from click.testing import CliRunner
from conftest import REFERENCE
from stored_files import point

from lpc_mdo.cli import main
from lpc_mdo.config import ConfigurationError
from lpc_mdo.files.write import write_atomically
from lpc_mdo.model.analyzer import Analyzer
from lpc_mdo.numerics.bsplines import basis_matrix
from lpc_mdo.optimization import Hooks, Options
from lpc_mdo.problems.gross_weight import with_motors_that_hover
from lpc_mdo.reporting import analysis_file, result_file, style
from lpc_mdo.reporting.figures.study_blades import bezier
from lpc_mdo.reporting.html import number
from lpc_mdo.reporting.own_checks import own_checks
from lpc_mdo.reporting.report import FIGURES, figure_module, is_drawable, write_report
from lpc_mdo.reporting.sensitivities import sensitivities
from lpc_mdo.reporting.stored import read_run
from lpc_mdo.reporting.tables import headlines
from lpc_mdo.reporting.trace import Trace
from lpc_mdo.studies.single import solve

STORED = json.loads((REFERENCE / "optimum.json").read_text())


@pytest.fixture(scope="module")
def finished(problem):
    """A few steps from the stored optimum: solver's result, content of result.json, trace."""
    trace = Trace(problem)
    result, content = solve(
        problem,
        problem.scaled(STORED["design"]),
        options=Options(outer_iterations=1, inner_iterations=4),
        hooks=Hooks(evaluation=trace.add),
    )
    return result, content, trace


@pytest.fixture(scope="module")
def run_folder(problem, finished, tmp_path_factory):
    """A run folder as `lpc-mdo optimize` leaves it, reported; its sensitivities are those of an unfinished run."""
    folder = tmp_path_factory.mktemp("run")
    result, content, trace = finished
    analysis = analysis_file.build(problem, result)
    analysis["sensitivities"] = [asdict(answer) for answer in sensitivities(problem, result)]
    result_file.write_result(content, folder)
    result_file.write_history(result, problem, folder)
    trace.write(folder)
    analysis_file.write(analysis, folder)
    vehicle, mission = problem.analyze_design.vehicle, problem.analyze_design.mission
    configuration = {"vehicle": vehicle.model_dump(), "mission": mission.model_dump()}
    write_atomically(folder / "configuration.json", json.dumps(configuration))
    write_report(folder)
    return folder


@pytest.fixture(scope="module")
def page(run_folder):
    return (run_folder / "report.html").read_text()


@pytest.fixture(scope="module")
def run(run_folder):
    return read_run(run_folder)


def test_sensitivity_to_a_parameter_is_the_lagrangians_partial_derivative(problem, finished):
    """Heavier fixed masses: gross mass by one for one, the rest through the constraints' multipliers."""
    result = finished[0]
    answers = {answer.label: answer.per_percent for answer in sensitivities(problem, result)}
    vehicle, mission = problem.analyze_design.vehicle, problem.analyze_design.mission
    heavier = vehicle.model_copy(
        update={"fixed_masses": tuple(m.model_copy(update={"mass": 1.01 * m.mass}) for m in vehicle.fixed_masses)}
    )
    with torch.no_grad():
        f0, c0 = problem.evaluate(result.x)
        changed = replace(problem, analyze_design=Analyzer(heavier, mission))
        same_motors, _ = changed.evaluate(result.x)
        f1, c1 = with_motors_that_hover(changed).evaluate(result.x)  # their bounds follow the aircraft's mass
    change = float(f1 - f0 + result.multipliers @ (c1 - c0)) * problem.objective.scale
    # One-sided differences over one per cent against central ones over 0.01 %: curvature is all that differs.
    assert answers["fixed masses and payload"] == pytest.approx(change, rel=1e-2)
    assert float(same_motors - f0) * problem.objective.scale == pytest.approx(
        0.01 * sum(m.mass for m in vehicle.fixed_masses), rel=1e-9
    )


def test_a_multiplier_off_by_what_a_certificate_leaves_open_moves_no_missing_limit(problem, finished):
    """Steps of Newton's method may leave a multiplier of an inactive row slightly on the side where it has no limit."""
    result = finished[0]
    sign = torch.where(problem.constraint_lower.isinf(), -1.0, 1.0)
    answers = sensitivities(problem, replace(result, multipliers=result.multipliers + 1e-8 * sign))
    assert all(math.isfinite(answer.per_percent) for answer in answers)


def test_stored_mission_conserves_energy(run):
    """The fall of the state of charge along the segments is the energy drawn over the battery's capacity."""
    vehicle = run.configuration["vehicle"]["battery"]
    mass = run.optimized["summary"]["mass_breakdown_kg"]["battery"]
    for segment in run.optimized["mission"]:
        before, after = segment["state_of_charge"]
        drawn = segment["power_W"] * segment["duration_s"] / vehicle["discharge_efficiency"]
        assert before - after == pytest.approx(drawn / (mass * vehicle["specific_energy"]), abs=1e-6)
    assert run.optimized["mission"][-1]["state_of_charge"][1] == pytest.approx(
        run.outputs["final_state_of_charge"], abs=1e-6
    )


def test_stored_polar_passes_through_the_cruise_point(run):
    polar = run.optimized["polar"]
    alpha, cruise = torch.tensor(polar["angle_of_attack_rad"]), polar["cruise"]
    i = int(torch.searchsorted(alpha, torch.tensor(cruise["angle_of_attack_rad"])))
    for key in ("lift_coefficient", "drag_coefficient"):
        low, high = sorted((polar[key][i - 1], polar[key][i]))
        assert low <= cruise[key] <= high


def test_trace_holds_single_evaluations_and_ends_where_the_result_does(run):
    """Evaluations in batches, for second derivatives, are counted but not traced."""
    assert 3 < len(run.evaluations) <= run.result["counts"]["evaluations"]
    first = {row["name"]: row["initial"] for row in run.result["constraints"] if row["size"] == 1}
    assert {"final_state_of_charge", "sound_pressure_level"} <= first.keys()
    last = run.evaluations[-1]
    assert float(last["gross_mass_kg"]) == pytest.approx(run.outputs["gross_mass_kg"], rel=1e-3)


def test_every_figure_is_drawn_and_has_title_and_units(run):
    names = [name for section in FIGURES.values() for name in section]
    assert len(set(names)) == len(names)
    for name in names:
        module = figure_module(name)
        assert is_drawable(run, module), name
        assert module.TITLE
        assert module.CAPTION.endswith(".")
        with style.look():
            figure = module.draw(run)
        labels = [
            label
            for axes in figure.axes
            if axes.axison and axes.get_visible()
            for label in (axes.get_xlabel(), axes.get_ylabel())
            if label
        ]
        for label in labels:
            # A unit, "–" for none, after the last comma; counts and radii over radii carry none.
            assert re.search(
                r",\s(m|mm|kg|kW|kN/m|min|°|–|%|Hz|N m|rev/min|dB re 20 µPa|dB\(A\))$", label
            ) or label in {
                "r/R",
                "evaluation",
                "design evaluated",
            }, (name, label)


def test_drawn_samples_are_the_shipped_ones_as_the_surrogate_predicts_them(run):
    """Every converged sample is there once; those never fitted differ by less than one per cent, the card's own figure."""
    sets = {part["name"]: part for part in run.analysis["surrogate_samples"]}
    assert {name: len(part["sized"]["mass_kg"]) for name, part in sets.items()} == {
        "fitted": 256,
        "replica ±10 %, not fitted": 96,
        "test set, not fitted": 32,
    }
    for part in sets.values():
        sized, predicted = (torch.tensor(part[kind]["mass_kg"]) for kind in ("sized", "predicted"))
        assert float((predicted / sized - 1.0).abs().max()) < 0.01


def test_checks_at_the_optimum_are_met_and_a_wrong_derivative_is_told(problem, run):
    assert len(run.analysis["checks"]) == 4
    assert all(check["is_met"] for check in run.analysis["checks"])

    class Wrong(torch.autograd.Function):
        @staticmethod
        def forward(context, x):
            return x.clone()

        @staticmethod
        def backward(context, gradient):
            return 1.01 * gradient

    broken = replace(problem, objective=replace(problem.objective, of=lambda a: Wrong.apply(a.gross_mass)))
    assert not own_checks(broken, problem.x0)[0]["is_met"]


def test_a_figure_whose_data_a_problem_lacks_is_left_out(run):
    hover_only = replace(
        run,
        analysis={"designs": {name: {"rotors": design["rotors"]} for name, design in run.analysis["designs"].items()}},
    )
    assert is_drawable(hover_only, figure_module("blade_shapes"))
    assert not is_drawable(hover_only, figure_module("drag_polar"))


class _Page(HTMLParser):
    """Collects tags that are left open, references and names."""

    VOID = frozenset({"meta", "br", "img", "link", "hr", "input", "path", "use", "rect", "circle", "line"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.references: list[str] = []
        self.names: list[str] = []
        self.svgs = 0

    def handle_starttag(self, tag, attributes):
        self.svgs += tag == "svg"
        for key, value in attributes:
            if key in {"href", "src", "xlink:href"}:
                self.references.append(value)
            if key == "id":
                self.names.append(value)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag


def test_page_is_one_well_formed_file_without_outside_references(page):
    parsed = _Page()
    parsed.feed(page)
    assert not parsed.open
    assert len(set(parsed.names)) == len(parsed.names), "names on the page must be unique"
    within = [reference for reference in parsed.references if not reference.startswith("data:image/png;base64,")]
    assert all(reference.startswith("#") for reference in within)
    assert {reference[1:] for reference in within} <= set(parsed.names)
    used = set(re.findall(r"url\(#([^)]+)\)", page))
    assert used <= set(parsed.names)
    assert not re.search(r"@import|<script|url\((?!#)", page)
    assert len(page.encode()) < 5_000_000


def test_page_shows_every_figure_and_every_headline(page, run):
    parsed = _Page()
    parsed.feed(page)
    assert parsed.svgs == sum(len(names) for names in FIGURES.values())
    rows = headlines(run.result)
    assert len(rows) >= 10
    for row in rows:
        assert row.published in page
        assert row.ours in page
    for row in run.result["constraints"]:
        assert row["name"].replace("_", " ") in page


def test_page_follows_light_and_dark_and_prints(page):
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page
    drawn = page[page.index("</style>") :]
    for color in (style.INK, style.SURFACE, style.GRID):
        assert color not in drawn


def test_files_and_page_are_the_same_each_time(run_folder, page):
    before = (run_folder / "figures" / "overview.svg").read_text()
    write_report(run_folder)
    assert (run_folder / "figures" / "overview.svg").read_text() == before
    assert (run_folder / "report.html").read_text() == page


def test_numbers_have_true_minus_signs_and_a_dash_for_none():
    assert number(-0.5) == "−0.5"
    assert number(None) == "–"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("result.json", None),
        ("analysis.json", None),
        ("history.csv", None),
        ("evaluations.csv", None),
        ("configuration.json", None),
        ("result.json", "{"),
        ("result.json", "[]"),
        ("analysis.json", '{"schema": "lpc-mdo/analysis/99"}'),
    ],
)
def test_a_damaged_folder_is_refused_by_name(run_folder, tmp_path, name, content):
    for file in run_folder.glob("*.*"):
        shutil.copy(file, tmp_path)
    if content is None:
        (tmp_path / name).unlink()
    else:
        (tmp_path / name).write_text(content)
    with pytest.raises(ConfigurationError, match=re.escape(name)):
        write_report(tmp_path)


def test_designs_that_figures_compare_have_the_same_points(run_folder, tmp_path):
    for file in run_folder.glob("*.*"):
        shutil.copy(file, tmp_path)
    analysis = json.loads((tmp_path / "analysis.json").read_text())
    analysis["designs"]["initial"]["operating_points"][2]["segment"] = "../../x"
    (tmp_path / "analysis.json").write_text(json.dumps(analysis))
    with pytest.raises(
        ConfigurationError, match=r"operating_points\[2\].segment = '../../x' is invalid: it must be 'hover'"
    ):
        write_report(tmp_path)


def study_folder(run_folder, folder, kind):
    """A study of the front y = 1/x, the run's own result at every point but a pending one."""
    points = []
    for i, x in enumerate((0.5, 0.8, 1.25, 2.0)):
        name = f"points/{i:02d}_{x}"
        (folder / name).mkdir(parents=True)
        shutil.copy(run_folder / "result.json", folder / name)
        points.append(
            point(
                value=x,
                folder=name,
                position=[x, 1.0 / x],
                slope={"from_multipliers": -1.0 / x**2, "from_points": -1.0 / x**2},
                is_on_front=True if kind == "pareto" else None,
            )
        )
    empty = dict.fromkeys(("position", "objective", "outputs", "multipliers", "certificate", "counts", "time_s"))
    points.append(point(value=3.0, folder="points/04", status="pending", is_on_front=False, **empty))
    content = {
        "schema": "lpc-mdo/study/1",
        "kind": kind,
        "name": "weight-speed",
        "problem": "gross-weight",
        "formulation": "paper",
        "method": "parameter",
        "parameter": {"name": "cruise_speed", "unit": "m/s", "key": None},
        "axes": [
            {"name": "cruise_speed", "unit": "m/s", "goal": "maximize"},
            {"name": "gross_mass_kg", "unit": "kg", "goal": "minimize"},
        ],
        "points": points,
        "timing": {"wall_s": 1.0, "processor_s": 1.0},
        "provenance": {"version": "0"},
    }
    (folder / "study.json").write_text(json.dumps(content))
    return folder


@pytest.mark.parametrize("kind", ["pareto", "sweep"])
def test_study_is_reported_with_its_unfinished_points(run_folder, tmp_path, kind):
    text = write_report(study_folder(run_folder, tmp_path, kind)).read_text()
    assert "4 converged" in text
    assert "1 pending" in text
    assert text.count("<svg") == 1
    assert (tmp_path / "figures" / "study_points.svg").exists()
    parsed = _Page()
    parsed.feed(text)
    assert not parsed.open
    assert all(reference.startswith("#") for reference in parsed.references)


def test_study_with_a_missing_result_is_refused_by_name(run_folder, tmp_path):
    folder = study_folder(run_folder, tmp_path, "sweep")
    (folder / "points" / "00_0.5" / "result.json").unlink()
    with pytest.raises(ConfigurationError, match=r"00_0\.5"):
        write_report(folder)


def test_blade_curves_of_control_points_are_the_models_splines():
    points = torch.rand(3, 4, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    at = torch.linspace(0.0, 1.0, 9, dtype=torch.float64)
    drawn = bezier(points.numpy(), at.numpy())
    assert torch.allclose(torch.from_numpy(drawn), points @ basis_matrix(at, 4, 3).T, atol=1e-14)


def test_command_reports_and_refuses(run_folder, tmp_path):
    done = CliRunner().invoke(main, ["report", str(run_folder)])
    assert done.exit_code == 0, done.stderr
    assert {f"{name}.png" for names in FIGURES.values() for name in names} <= {
        file.name for file in (run_folder / "figures").iterdir()
    }
    for folder in (tmp_path, tmp_path / "absent"):
        refused = CliRunner().invoke(main, ["report", str(folder)])
        assert refused.exit_code == 2
        assert len(refused.stderr.strip().splitlines()) == 1
        assert str(folder) in refused.stderr


def test_report_needs_no_torch():
    """Nothing can be recomputed by a process that never loads the model."""
    program = "import sys, lpc_mdo.reporting.report; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_write_is_atomic(tmp_path):
    file = Path(tmp_path / "a.txt")
    write_atomically(file, "whole")
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.txt"]
