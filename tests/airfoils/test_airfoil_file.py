"""Airfoil coordinate files as people have them: one section, whatever the file's order, unit, marks and notes."""

from pathlib import Path

import numpy as np
import pytest

from lpc_mdo.airfoils.coordinate_file import read_airfoil_file
from lpc_mdo.airfoils.shape import airfoil_shape, section_coordinates
from lpc_mdo.training.xfoil import missing_tools, run_polar

FAULTS = Path(__file__).parents[1] / "faults"
needs_xfoil = pytest.mark.skipif(missing_tools() is not None, reason=f"XFOIL cannot run: {missing_tools()}")


def naca(digits="2412", base=0.0):
    """Points once around, from the trailing edge over the upper side, cosine-spaced; `base` opens the trailing edge."""
    points = section_coordinates(airfoil_shape(digits))[::2]
    half = 0.5 * base * points[:, 0]
    front = int(points[:, 0].argmin())
    half = half - points[0, 1] * points[:, 0]
    return points + np.c_[np.zeros(len(points)), np.where(np.arange(len(points)) <= front, half, -half)]


def lines(points):
    return [f"{x:.7f} {y:.7f}" for x, y in points]


def read(tmp_path, text, encoding="utf-8"):
    file = tmp_path / "section.dat"
    file.write_bytes((text if isinstance(text, str) else "\n".join(text)).encode(encoding))
    return read_airfoil_file(file)


@pytest.fixture(scope="module")
def expected():
    return naca()


def is_same(section, points, atol=2e-7):
    return section.points.shape == points.shape and np.allclose(section.points, points, rtol=0.0, atol=atol)


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (lambda p: ["NACA 2412", *lines(p)], "Selig's order, 121 points"),
        (lambda p: lines(p), "Selig's order"),
        (lambda p: ["2412", *lines(p)], "Selig's order"),
        (lambda p: ["63 415", *lines(p)], "'63 415' before the points read as a title"),
        (lambda p: ["1 2", *lines(p)], "'1 2' before the points read as a title"),
        (lambda p: ["t", *lines(p), "", "source: somewhere", "thickness 12 %", "0.12 0.30"], None),
        (lambda p: ["t", *lines(p), "source: a book of 1999"], "1 line of text after the points left out"),
        (lambda p: ["# made by hand", "t", "! units: chords", *lines(p), "% end"], "1 line of text after"),
        (lambda p: ["t", "61 61", *lines(p[60::-1]), *lines(p[60:])], "Lednicer's order, 61 + 61 points"),
        (lambda p: ["t", "61. 61.", "", *lines(p[60::-1]), "", *lines(p[60:])], "Lednicer's order"),
        (lambda p: ["t", "61 61", *lines(p[60:]), *lines(p[60::-1])], "lower side first"),
        (lambda p: ["63 415", "61. 61.", *lines(p[60::-1]), *lines(p[60:])], "'63 415' before the points"),
        (lambda p: ["t", *lines(p[60::-1]), *lines(p[60:])], "two sides without point counts, 61 + 61 points"),
        (
            lambda p: ["t", "Upper", *lines(p[60::-1]), "Lower surface", *lines(p[60:])],
            "line of text between the points",
        ),
        (lambda p: ["t", *lines(p[:61]), *lines(p[:59:-1])], "two sides without point counts"),
        (lambda p: ["t", *lines(p[::-1])], "lower side first: turned around"),
        (lambda p: ["t", *lines(np.r_[p[60:], p[1:61]])], "Selig's order"),
        (lambda p: ["t", *lines(np.r_[p[60::-1], p[-2:59:-1]])], "lower side first"),
        (lambda p: ["t", *lines(np.r_[p[30:], p[1:30]])], "Selig's order"),
        (lambda p: ["t", *lines(np.repeat(p, 2, axis=0))], "repeated points left out"),
        (lambda p: ["t", *lines(350.0 * p + (20.0, -3.0))], "scaled from a chord of 350 to 1"),
        (lambda p: ["t", *lines(p * (-1.0, 1.0) + (1.0, 0.0))], "mirrored: its leading edge was on the right"),
        (lambda p: ["t", *(f"{x:.7f},{y:.7f}" for x, y in p)], "Selig's order"),
        (lambda p: ["t", *(f"{x:.7f}; {y:.7f};" for x, y in p)], "Selig's order"),
        (lambda p: ["t", *(f"{x:.7f}\t{y:.7f}".replace(".", ",") for x, y in p)], "decimal commas"),
        (lambda p: ["t", *(f"{x:.7f};{y:.7f}".replace(".", ",") for x, y in p)], "decimal commas"),
        (lambda p: ["t", *(f"{x:.8E} {y:.8E}".replace("E", "D") for x, y in p)], "Selig's order"),
        (lambda p: ["t", *(f"{x:.7f} {y:.7f}".replace("-", "\u2212") for x, y in p)], "Selig's order"),
        (lambda p: ["t", *(f"{x:.7f} 0.0 {y:.7f}" for x, y in p)], "column 2 of three, which never changes, left out"),
    ],
)
def test_one_section_is_read_from_whatever_form_it_has(tmp_path, expected, change, note):
    section = read(tmp_path, change(expected))
    assert is_same(section, expected)
    assert section.thickness_to_chord == pytest.approx(0.1193, abs=1e-4)  # 12 % less what closes the edge
    assert note is None or any(note in said for said in section.notes)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1", "cp1251"])
@pytest.mark.parametrize("title", [[], ["t"]])
def test_marks_and_old_encodings_cost_no_point(tmp_path, expected, encoding, title):
    note = {"latin-1": "d'après", "cp1251": "профиль"}.get(encoding, "профиль d'après")
    assert is_same(read(tmp_path, [*title, *lines(expected), note], encoding), expected)


@pytest.mark.parametrize("end", ["\r\n", "\r", "\n\n"])
def test_line_ends_of_other_systems_are_read(tmp_path, expected, end):
    assert is_same(read(tmp_path, end.join(["t", *lines(expected)])), expected)


@pytest.mark.parametrize("tilt", [20.0, -35.0, 80.0])
def test_a_section_turned_far_is_turned_back_onto_its_chord_line(tmp_path, tilt):
    cos, sin = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    points = naca("0012")
    section = read(tmp_path, ["t", *lines(points @ np.array([[cos, sin], [-sin, cos]]))])
    assert is_same(section, points, atol=2e-6)
    assert f"turned by {-tilt:.2f} degrees onto its chord line" in section.notes


def test_a_small_tilt_is_the_section_s_own_and_stays():
    # NASA TN D-7428 measures angles from the x axis of its table, on which the trailing edge lies 0.4 % of the chord low.
    section = read_airfoil_file(Path(__file__).parents[2] / "lpc_mdo" / "data" / "airfoils" / "ls417.dat")
    assert section.thickness_to_chord == pytest.approx(0.17, abs=2e-4)
    assert section.points[[0, -1]].tolist() == [[1.0, -0.00074], [1.0, -0.00783]]
    assert section.notes == ("Lednicer's order, 38 + 38 points",)


@pytest.mark.parametrize("inner", [0, 1, 4])
@pytest.mark.parametrize("is_closed", [False, True])
def test_a_blunt_trailing_edge_stays_open_and_its_base_bears_no_points(tmp_path, inner, is_closed):
    points = naca(base=0.01)
    base = np.linspace(points[-1], points[0], inner + 2)[1:-1]
    section = read(tmp_path, ["t", *lines(np.r_[points, base, points[: int(is_closed)]])])
    assert is_same(section, points)
    assert any("on the base of the blunt trailing edge" in note for note in section.notes) == (inner > 0)
    assert any("closed the blunt trailing edge" in note for note in section.notes) == is_closed


def test_a_slanted_base_is_one_too(tmp_path):
    points = naca(base=0.02)
    points[0] -= (0.004, 0.0)
    points = np.delete(points, 1, axis=0)  # else the corner lies ahead of its neighbour
    base = 0.5 * (points[:1] + points[-1:])
    section = read(tmp_path, ["t", *lines(np.r_[points, base, points[:1]])])
    assert is_same(section, points)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda p: ["t", "60 61", *lines(p[60::-1]), *lines(p[60:])],
            r"122 points are invalid: its header says 60 \+ 61",
        ),
        (lambda p: ["t", *lines(p[:100])], "they must close at the trailing edge"),
        (
            lambda p: ["t", *lines(p[:50]), "0.4 O.1", *lines(p[51:])],
            "'0.4 O.1' is invalid: it must be two finite numbers",
        ),
        (lambda p: ["t", *lines(p[:50]), "x.9 .1", *lines(p[51:])], "'x.9 .1' is invalid"),
        (lambda p: ["t", *lines(p[:50]), "0.4", *lines(p[51:])], r"'0.4' is invalid.*line 52"),
        (lambda p: ["t", "1.00000 0.00x", *lines(p[1:])], r"'1.00000 0.00x' is invalid.*line 2"),
        (lambda p: ["1.0?000 0.0", *lines(p[1:])], r"'1.0\?000 0.0' is invalid.*line 1"),
        (lambda p: ["t", *lines(p[:-1]), "0.9 0.0x"], "'0.9 0.0x' is invalid"),
        (lambda p: ["t", *lines(p[:50]), "1e999 0.1", *lines(p[51:])], "two finite numbers"),
        (lambda p: ["t", *lines(p[:50]), "0.1 0.2 0.3", *lines(p[51:])], "every point must be two finite numbers"),
        (
            lambda p: ["t", *lines(p[:80]), *lines(p[80:] + np.c_[np.zeros(41), 0.1 * np.sin(np.pi * p[80:, 0])])],
            "the lower side lies above",
        ),
        (
            lambda p: ["t", *lines(p[:40]), *lines(p[80:])],
            r"there must be more: 0\.\d+ chords without one, at most 0.1 at the",
        ),
        (lambda p: ["t", *lines(p[:60]), *lines(p[75:])], "at most 0.1 at the leading edge"),
        (lambda p: ["t", *lines(p[:20]), *lines(p[45:])], "chords without one, at most 0.2$"),
        (lambda p: ["t", *(f"{x:.7f},{y:.7f}".replace(".", ",") for x, y in p)], "'1,0000000,0,0000000' is invalid"),
    ],
)
def test_what_stays_ambiguous_is_refused(tmp_path, expected, change, message):
    with pytest.raises(ValueError, match=message):
        read(tmp_path, change(expected))


@needs_xfoil
@pytest.mark.parametrize(
    ("name", "lift_at_rest"),
    # NACA 2412 at Re 1e6 as XFOIL lays it out: 0.237; with a base of 1 % of the chord 0.248 and, at 4 degrees, 0.706.
    [
        ("airfoil_bom_no_title", 0.237),
        ("airfoil_decimal_comma", 0.237),
        ("airfoil_first_point_repeated", 0.237),
        ("airfoil_note_after_points", 0.237),
        ("airfoil_two_numbers_in_title", 0.237),
        ("airfoil_blunt_closed", 0.248),
    ],
)
def test_files_that_once_gave_another_section_give_the_right_lift(name, lift_at_rest):
    level, up = run_polar(airfoil_shape(str(FAULTS / f"{name}.dat")), 1e6, 0.0, [0.0, 4.0]).points
    assert level.cl == pytest.approx(lift_at_rest, abs=1e-3)
    assert up.cl == pytest.approx(0.706 if name == "airfoil_blunt_closed" else 0.7146, abs=1e-3)


def test_names_in_any_alphabet_name_the_section(tmp_path, expected):
    for name in ("профиль", "翼型 12", "Δ-wing", "Flügel"):
        file = tmp_path / f"{name}.dat"
        file.write_text("\n".join(lines(expected)))
        assert airfoil_shape(str(file)).name == name.lower().replace(" ", "_")
    file = tmp_path / ("ж" * 120 + ".dat")
    file.write_text("\n".join(lines(expected)))
    assert airfoil_shape(str(file)).name == "ж" * 100


def test_what_is_no_file_or_too_large_is_refused_at_once(tmp_path):
    with pytest.raises(ValueError, match="/dev/zero"):
        airfoil_shape("/dev/zero")
    with pytest.raises(ValueError, match=r"is invalid|cannot be read"):
        airfoil_shape(str(tmp_path))
    large = tmp_path / "large.dat"
    large.write_bytes(b"0.5 0.1\n" * 200_000)
    with pytest.raises(ValueError, match="must have at most 1000000"):
        airfoil_shape(str(large))
