"""The benchmark's own code: what it measures is what it says, and codes that it compares agree. No times are judged."""

import math
from importlib import import_module
from importlib.util import find_spec

import numpy as np
import pytest
import torch
from benchmarks import command
from benchmarks.refinement import refined
from benchmarks.sections import rotors as rotors_section
from benchmarks.sections import wing as wing_section
from benchmarks.session import Outcome, measure
from benchmarks.sheets import BEGIN, END, Section, Sheet, Target, markdown, targets_sheet, write_markdown
from benchmarks.subject import Subject
from benchmarks.subjects import model, profile, rotors_lpc_mdo, wing_lpc_mdo
from benchmarks.subjects.wing import interpolation, section_positions, start
from click.testing import CliRunner

import lpc_mdo
from lpc_mdo.config import ConfigurationError, load

HERE = "tests.benchmark_subjects"


def computed(subject: Subject) -> Outcome:
    """The outcome of a subject that runs in this process."""
    module, function = subject.target.split(":")
    task = getattr(import_module(module), function)(**subject.arguments)
    return Outcome(subject, check=task.check())


def test_subjects_take_turns_in_processes_of_their_own():
    subjects = [Subject(str(count), f"{HERE}:prepare_sum", {"count": count}) for count in (10, 1000)]
    outcomes = measure(subjects, repeats=3, seconds=60.0)
    assert [o.check["sum"] for o in outcomes] == [45, 499500]
    assert all(len(o.processor) == 3 and o.peak > 1e6 and not o.absence for o in outcomes)


def test_missing_failing_and_talkative_subjects_are_told_apart():
    missing = Subject("missing", f"{HERE}:prepare_sum", {"count": 1}, package="a_package_that_nobody_has")
    failing, talking = (Subject(name, f"{HERE}:prepare_{name}") for name in ("failure", "noise"))
    absent, failed, heard = measure([missing, failing, talking], repeats=1, seconds=1.0)
    assert absent.absence == "not installed (pip install 'lpc-mdo[bench]')"
    assert failed.absence == "failed: ArithmeticError: no such wing"
    assert heard.check == {"is_heard": False}
    assert heard.absence == ""


def test_time_allowed_ends_the_runs_but_not_before_the_first():
    (outcome,) = measure([Subject("sum", f"{HERE}:prepare_sum", {"count": 10})], repeats=50, seconds=0.0)
    assert len(outcome.processor) == 1


def test_wing_is_a_plane_of_straight_lines_between_its_sections():
    assert np.allclose(interpolation(section_positions()), np.eye(6), atol=1e-15)
    assert np.allclose(interpolation(np.linspace(-4.0, 4.0, 33)).sum(1), 1.0, atol=1e-14)
    results = wing_lpc_mdo.prepare(2, 5).check()
    half = wing_lpc_mdo.prepare(2, 5, is_symmetric=True).check()
    for wake, found in results.items():
        assert found["lift"] == pytest.approx(half[wake]["lift"], rel=1e-12)
        assert found["gradient"] == pytest.approx(half[wake]["gradient"], rel=1e-9)


def test_lift_and_drag_are_of_a_lifting_line_of_the_same_aspect_ratio():
    found = wing_lpc_mdo.prepare(4, 20).check()["stream"]
    force, aspect_ratio, angle = 0.5 * 1.1 * 50.0**2 * 8.0, 8.0, start()[-1]
    lift, drag = found["lift"] / force, found["drag"] / force
    assert lift == pytest.approx(2.0 * math.pi * angle / (1.0 + 2.0 / aspect_ratio), rel=0.08)  # lifting surface, taper
    assert drag == pytest.approx(lift**2 / (math.pi * aspect_ratio), rel=0.1)


@pytest.mark.parametrize(
    "name", [wing_section.AEROSANDBOX, wing_section.ANEW, wing_section.VALUE_ONLY, wing_section.OPENAEROSTRUCT]
)
def test_vortex_lattices_agree(name):
    subjects = wing_section.subjects(2, 5)
    if not subjects[name].is_installed:
        pytest.skip(f"{name} is not installed (extra `bench`)")
    ours, theirs = computed(subjects[wing_section.OURS]), computed(subjects[name])
    lift, drag, *gradient = wing_section.differences(theirs, ours)
    assert max(lift, drag) < 1e-7  # the peers' vortex cores
    if name == wing_section.OPENAEROSTRUCT:
        assert gradient[0] < 1e-6
    elif name in (wing_section.AEROSANDBOX, wing_section.ANEW):
        in_plane = [*range(6), 12]  # of chords and angle of attack; twist tells its straight legs from rings
        mine, other = (np.array(found["gradient"])[in_plane] for found in (ours.check["plane"], theirs.check))
        assert other == pytest.approx(mine, rel=1e-6)


@pytest.mark.skipif(find_spec("wisdem") is None, reason="WISDEM is not installed")
def test_blade_element_codes_agree_in_loads_and_derivatives():
    ours, _, *theirs = map(computed, rotors_section.subjects(2, 3))
    for outcome in theirs:
        assert max(rotors_section.differences(outcome, ours).values()) < 1e-8  # its root finder's tolerance


@pytest.mark.parametrize("polar", ["analytic", "surrogate"])
def test_loads_of_a_rotor_do_not_depend_on_its_company(polar):
    alone, together = (rotors_lpc_mdo.prepare(count, 3, polar).check() for count in (1, 3))
    # One rotor stands where the first of several does: both are laid from the lower end of the spread.
    for name, values in alone.items():
        first = np.array(together[name])[:, :1]
        assert np.array(values) == pytest.approx(first, rel=1e-9)


def test_finer_control_points_keep_the_blades_and_what_they_do():
    vehicle, mission = lpc_mdo.baseline()
    finer = refined(vehicle, 9, 7)
    assert {len(rotor.twist) for rotor in finer.rotors} == {9}
    coarse, fine = (lpc_mdo.gross_weight_problem(v, mission) for v in (vehicle, finer))
    assert (coarse.size, fine.size) == (109, 109 + 9 * 5 + 9 * 5)
    with torch.no_grad():
        a, b = (p.analyze(p.x0) for p in (coarse, fine))
    torch.testing.assert_close(b.propulsion.loads.rotor.twist, a.propulsion.loads.rotor.twist, rtol=1e-12, atol=0.0)
    torch.testing.assert_close(b.propulsion.loads.rotor.chord, a.propulsion.loads.rotor.chord, rtol=1e-12, atol=0.0)
    torch.testing.assert_close(b.observed_dba, a.observed_dba, rtol=1e-10, atol=0.0)


def test_rotors_with_different_numbers_of_control_points_are_refused():
    with pytest.raises(ConfigurationError, match="2 and 3 control points"):
        load(None, None, ("vehicle.rotors.0.chord_m=[0.3, 0.2, 0.1]",))


def test_profile_names_every_discipline_and_counts_both_passes():
    parts = profile.prepare(repetitions=1).check()["disciplines"]
    for name in ("rotors", "motors", "vortex lattice", "noise", "geometry"):
        assert parts[name]["forward_calls"] > 0
        assert parts[name]["backward_calls"] > 0
        assert parts[name]["forward_s"] > 0.0


def test_model_subject_evaluates_designs_of_a_batch_alike():
    task = model.prepare(designs=2)
    gradient = task.run()
    assert gradient.shape == (2, 109)
    torch.testing.assert_close(gradient[0], gradient[1], rtol=1e-9, atol=1e-12)
    assert task.check()["variables"] == 109


def test_measured_tables_are_renewed_between_the_marks_of_a_page(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"# Title\n\nBefore.\n{BEGIN}\nold\n{END}\nAfter.\n", encoding="utf-8")
    sheet = Sheet("A | B", ("a", "b"), (("1 | 2", "3"),), ("A note.",))
    write_markdown(page, "Machine.", [sheet])
    write_markdown(page, "Machine.", [sheet])
    text = page.read_text(encoding="utf-8")
    assert "old" not in text
    assert text.startswith("# Title\n\nBefore.\n")
    assert text.endswith("\nAfter.\n")
    assert text.count("| 1 \\| 2 | 3 |") == 1
    bare = tmp_path / "bare.md"
    bare.write_text("nothing here", encoding="utf-8")
    with pytest.raises(ValueError, match="must have one line"):
        write_markdown(bare, "", [sheet])
    assert bare.read_text(encoding="utf-8") == "nothing here"


def test_targets_say_whether_they_are_met():
    sheet = targets_sheet([Target("fast", "1 s", True), Target("small", "2 GB", False), Target("peer", "", None)])
    assert [row[-1] for row in sheet.rows] == ["yes", "no", "not measured"]
    assert markdown(sheet).splitlines()[0] == "### Targets"


def test_command_prints_sections_and_writes_the_page(tmp_path, monkeypatch):
    section = Section((Sheet("Rotors", ("code", "ms"), (("lpc-mdo", "1"),)),), (Target("fast", "1 s", True),))
    monkeypatch.setattr(command, "_run", lambda name, is_quick: section)
    page = tmp_path / "page.md"
    result = CliRunner().invoke(command.main, ["rotors", "--quick", "--markdown", str(page)])
    assert result.exit_code == 0, result.output
    assert "lpc-mdo" in result.output
    assert page.read_text(encoding="utf-8").startswith(BEGIN)
    assert CliRunner().invoke(command.main, ["wings"]).exit_code == 2
