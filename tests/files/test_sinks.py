"""Names and texts of the user on their way out: terminal, figures, page, tables; and readers that go away."""

import csv
import io
import json
import os
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import pytest
from analytic_studies import circles
from conftest import FAULTS
from rich.table import Table

import lpc_mdo
from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.optimization import Options
from lpc_mdo.problems.gross_weight import gross_weight_problem
from lpc_mdo.reporting import style
from lpc_mdo.reporting.tables import headlines
from lpc_mdo.reporting.terminal import PatientStream, terminal
from lpc_mdo.studies.display import StudyDisplay

HOSTILE = (
    next(
        row["name"] for row in tomllib.loads((FAULTS / "math_rotor.toml").read_text())["rotors"] if "$" in row["name"]
    ),
    "$\\frac{$ and $}",
    "[/red]",
    "[bold]",
    ":smile:",
    "<b>&amp;",
    'a "quoted, name"',
    "50 % ≈ ½",
    "\\",
)


def renamed(items, names):
    return tuple(
        item.model_copy(update={"name": f"{name} {i}"})
        for i, (item, name) in enumerate(zip(items, [*names, *names], strict=False))
    )


@pytest.fixture(scope="module")
def hostile_run(tmp_path_factory):
    """A run of a few steps of an aircraft with such names, drawn and reported."""
    vehicle, mission = load()
    vehicle = vehicle.model_copy(
        update={
            "name": "[/red] $x^$ <i>",
            "rotors": renamed(vehicle.rotors, HOSTILE),
            "fixed_masses": renamed(vehicle.fixed_masses, HOSTILE),
        }
    )
    folder = tmp_path_factory.mktemp("hostile") / "[/red] $x^$"
    options = Options(outer_iterations=1, inner_iterations=1, newton_iterations=1)
    stream = io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "stdout", stream)
        lpc_mdo.optimize(gross_weight_problem(vehicle, mission), output=folder, progress=True, options=options)
    return folder, stream.getvalue()


def test_no_name_ends_a_run_or_its_report(hostile_run):
    folder, shown = hostile_run
    assert (folder / "report.html").exists()
    assert "wrote" in shown
    assert "[/red] $x^$" in shown


def test_names_stand_in_figures_as_they_are(hostile_run):
    folder, _ = hostile_run
    figures = sorted((folder / "figures").glob("*.svg"))
    assert len(figures) > 15
    texts = [" ".join(ElementTree.parse(file).getroot().itertext()) for file in figures]
    assert not [file.name for file, text in zip(figures, texts, strict=True) if "mathdefault" in text]
    everything = " ".join(texts)
    for name in HOSTILE[:4]:
        assert name in everything, name


def test_names_stand_in_the_page_escaped(hostile_run):
    folder, _ = hostile_run
    page = (folder / "report.html").read_text()
    assert "<h1>[/red] $x^$ &lt;i&gt;, gross-weight problem</h1>" in page
    assert "<b>&amp;amp;" not in page.replace("&lt;b&gt;", "")
    assert "Published study and ours" not in page


def test_names_stand_in_tables_of_numbers_as_they_are(hostile_run):
    folder, _ = hostile_run
    lines = list(csv.reader(io.StringIO((folder / "evaluations.csv").read_text())))
    assert len({len(line) for line in lines}) == 1
    rows = {row["name"] for row in json.loads((folder / "result.json").read_text())["constraints"]}
    assert set(lines[0][2:]) == rows


def test_only_the_shipped_aircraft_mission_and_problem_are_shown_beside_the_published_study(hostile_run):
    """The hostile one differs from the shipped aircraft by names alone; reasons why figures differ speak of that one."""
    folder, shown = hostile_run
    result = json.loads((folder / "result.json").read_text())
    assert result["vehicle"] == "[/red] $x^$ <i>"
    assert not result["is_published_case"]
    assert headlines(result) == []
    assert "published" not in shown
    assert "initial" in shown


@pytest.mark.parametrize("name", ["two\nlines", "bell\x07", "", " ", "x" * 81, "\u202eright to left"])
def test_names_that_nobody_can_print_are_refused(tmp_path, name):
    shipped = Path(lpc_mdo.__file__).parent / "data" / "vehicle.toml"
    text = shipped.read_text().replace('"NASA Lift+Cruise"', json.dumps(name))
    (tmp_path / "vehicle.toml").write_text(text)
    with pytest.raises(ConfigurationError, match=r"vehicle\.toml: name"):
        load(tmp_path / "vehicle.toml")


def test_labels_of_logarithmic_axes_are_plain_text():
    figure = style.figure(2.0)
    axes = figure.subplots()
    axes.loglog([1e-4, 1e3], [2.0, 5.0])
    style.without_mathematics(figure)
    figure.canvas.draw()
    labels = [label.get_text() for axis in (axes.xaxis, axes.yaxis) for label in axis.get_ticklabels(which="both")]
    assert "10⁻³" in labels
    assert "4×10⁰" in labels
    assert not any("$" in label for label in labels)


def test_the_terminal_shows_brackets_and_colons_as_they_are(capsys):
    console = terminal(width=80)
    table = Table("[/red]")
    table.add_row(":smile: [bold]")
    console.print(table)
    console.print("[/x] :smile:")
    with StudyDisplay(console, replace(circles((0.2, 0.8)), name="[/red]")) as display:
        display.progress.start()
    shown = capsys.readouterr().out
    assert shown.count("[/red]") >= 2
    assert ":smile: [bold]" in shown
    assert "[/x] :smile:" in shown


def test_a_terminal_without_a_sign_shows_a_question_mark():
    raw = io.BytesIO()
    stream = PatientStream(io.TextIOWrapper(raw, encoding="ascii"))
    stream.write("≈ 7500 lb \udcff")
    stream.flush()
    assert raw.getvalue() == b"? 7500 lb ?"


PROBLEM = (
    "import lpc_mdo; from pathlib import Path; from analytic_studies import Plane, _weighted, plane_problem;"
    "lpc_mdo.optimize(plane_problem(Plane(0.02), _weighted(0.5)), output=Path({folder!r}), progress=True)"
)


def environment(**more):
    return os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)} | more


def test_a_reader_of_the_progress_that_goes_away_does_not_end_the_run(tmp_path):
    command = [sys.executable, "-W", "ignore", "-c", PROBLEM.format(folder=str(tmp_path))]
    process = subprocess.Popen(
        command, env=environment(PYTHONUNBUFFERED="1"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdout.readline()
    process.stdout.close()
    with process:
        errors = process.stderr.read()
    assert "Traceback" not in errors
    assert json.loads((tmp_path / "result.json").read_text())["status"] == "converged"
    assert (tmp_path / "report.html").exists()


def test_a_display_that_cannot_be_written_does_not_end_the_run(tmp_path):
    if not Path("/dev/full").exists():
        pytest.skip("the system has no /dev/full")
    command = [sys.executable, "-W", "ignore", "-c", PROBLEM.format(folder=str(tmp_path))]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, env=environment(), stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert "the display ends here: No space left on device; the work goes on" in done.stderr
    assert json.loads((tmp_path / "result.json").read_text())["status"] == "converged"


def command_line(*arguments, **how):
    return [sys.executable, "-m", "lpc_mdo", *arguments]


def test_a_command_whose_reader_goes_away_ends_quietly(tmp_path):
    case = Path(__file__).parents[1] / "reference" / "structures_frame_L.json"
    process = subprocess.Popen(
        command_line("analyze", "structures", str(case)),
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    process.stdout.close()
    with process:
        errors = process.stderr.read()
    assert errors == ""


def test_an_ascii_terminal_ends_no_command(tmp_path):
    folder = tmp_path / "né ≈"
    folder.mkdir()
    done = subprocess.run(
        command_line("init", str(folder / "ü")),
        env=environment(PYTHONIOENCODING="ascii", LC_ALL="C", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0"),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "wrote" in done.stdout
