"""The commands of studies: what they refuse in one sentence, and a front from end to end."""

import itertools
import json

import pytest
from analytic_studies import circles
from click.testing import CliRunner

from lpc_mdo.cli import main
from lpc_mdo.studies.executors import InProcess
from lpc_mdo.studies.runner import StudyRun


def invoke(command, folder):
    return CliRunner().invoke(main, [*command.split(), "--quiet", "--output", str(folder)])


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (
            "optimize a.toml --vehicle b.toml",
            "--vehicle is invalid beside the argument VEHICLE; it must be given once.",
        ),
        ("sweep cruise a.toml --vehicle b.toml", "--vehicle is invalid beside the argument VEHICLE"),
        ("optimize --vehicle none.toml", "none.toml: cannot be read: No such file or directory."),
        ("sweep battery-energy-density none.toml", "none.toml: cannot be read: No such file or directory."),
        ("pareto weight-speed none.toml", "none.toml: cannot be read: No such file or directory."),
        ("optimize --noise-weight 0.5", "--noise-weight is not allowed with --problem gross-weight"),
        ("optimize --problem aeroacoustic --noise-weight 2", "weight = 2 is not allowed; it must lie between 0 and 1"),
        ("optimize --problem aeroacoustic --observer-angle-deg 91", "observer angle = 91 deg is not allowed"),
        (
            "pareto weight-speed --points 4",
            "--points is invalid with weight-speed at fixed speeds: it needs --method w",
        ),
        ("pareto weight-speed --mach 0.17,0.19", "--mach is invalid with weight-speed at fixed speeds"),
        (
            "pareto weight-speed --observer-angle-deg 45",
            "--observer-angle-deg is invalid with weight-speed: it is of noise",
        ),
        ("pareto weight-speed --method weighted-sum --values 57,60", "--values is invalid with --method weighted-sum"),
        ("pareto weight-speed --method weighted-sum --mach 0.17", "--mach is invalid: it must be two numbers"),
        ("pareto weight-speed --method weighted-sum --mach 0.19,0.17", "Mach numbers 0.19 to 0.17 are invalid"),
        ("pareto weight-speed --method weighted-sum --mach 0.2,0.3", "cruise.speed_m_per_s = 57.6178 is invalid: with"),
        ("pareto noise-efficiency --mach 0.17,0.19", "--mach is invalid with noise-efficiency"),
        ("pareto weight-speed --values 50,x", "'50,x' is not allowed; it must be numbers with commas"),
        ("pareto noise-efficiency --values 0.1,0.2", "--values is not allowed with noise-efficiency"),
        ("pareto noise-efficiency --observer-distance-ft 1", "observer distance = 0.3048 m is not allowed"),
        ("pareto noise-efficiency --jobs 2 --cluster tcp://localhost:1", "--jobs is not allowed with --cluster"),
        ("sweep nothing --values 1,2", "'nothing' is not allowed; it must be one of final_state_of_charge"),
        ("sweep vehicle.wing.taper", "sweep vehicle.wing.taper: --values is missing"),
    ],
)
def test_bad_input_ends_with_one_sentence_and_nothing_written(tmp_path, command, message):
    result = invoke(command, tmp_path / "out")
    assert result.exit_code == 2
    assert message in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("command", "resumed"),
    [
        ("pareto weight-speed --method weighted-sum --points 2", "belongs to a study of other values or files"),
        ("pareto noise-efficiency --method epsilon-constraint", "belongs to a study by another method"),
    ],
)
def test_a_folder_of_another_study_is_refused_before_the_side_study_runs(tmp_path, command, resumed):
    StudyRun(circles((0.2, 0.8)), tmp_path, InProcess(), "slsqp").run()
    before = sorted(tmp_path.rglob("*"))
    for more, message in (("", "holds a study: add --resume or name another folder"), (" --resume", resumed)):
        result = invoke(command + more, tmp_path)
        assert (result.exit_code, message in result.stderr) == (2, True), result.stderr
        assert sorted(tmp_path.rglob("*")) == before


def test_the_epsilon_constraint_spaces_points_evenly_between_the_ends(tmp_path):
    result = invoke("pareto noise-efficiency --method epsilon-constraint --points 2", tmp_path)
    assert result.exit_code == 0
    study, ends = (json.loads((tmp_path / name).read_text()) for name in ("study.json", "ends/study.json"))
    efficient, quiet = (point["position"] for point in ends["points"])
    merits, levels = zip(quiet, *(point["position"] for point in study["points"]), efficient, strict=True)
    third = (efficient[0] - quiet[0]) / 3.0
    assert [later - earlier for earlier, later in itertools.pairwise(merits)] == pytest.approx([third] * 3, rel=1e-4)
    assert list(levels) == sorted(levels)
    slopes = [point["slope"]["from_multipliers"] for point in study["points"]]
    assert 0.0 < slopes[0] < slopes[1]
