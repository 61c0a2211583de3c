"""Sections by designation or coordinate file: closed forms, orders of points, and files that are no sections."""

import math

import numpy as np
import pytest

from lpc_mdo.airfoils.shape import airfoil_shape, section_coordinates
from lpc_mdo.training import xfoil
from lpc_mdo.training.xfoil import missing_tools, run_polar

needs_xfoil = pytest.mark.skipif(missing_tools() is not None, reason=f"XFOIL cannot run: {missing_tools()}")


def naca_four_digits(digits: str, count: int = 81) -> tuple[np.ndarray, np.ndarray]:
    """Upper and lower side from the leading edge. Source: NACA Report 460 (1933); XFOIL lays the thickness across the
    chord instead of across the camber line, which lowers lift by 1.5 %, and so does this."""
    camber, place, thickness = int(digits[0]) / 100.0, int(digits[1]) / 10.0, int(digits[2:]) / 100.0
    x = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, count)))
    half = 5.0 * thickness * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1015 * x**4)
    line = np.zeros(count)
    if camber > 0.0:
        front, rear = camber / place**2, camber / (1.0 - place) ** 2
        line = np.where(
            x < place, front * (2.0 * place * x - x**2), rear * (1.0 - 2.0 * place + 2.0 * place * x - x**2)
        )
    return np.c_[x, line + half], np.c_[x, line - half]


def selig(digits="4412", scale=1.0, shift=(0.0, 0.0)):
    upper, lower = naca_four_digits(digits)
    return np.r_[upper[::-1], lower[1:]] * scale + shift


def write(file, points, title="SECTION"):
    file.write_text(title + "\n" + "".join(f" {x:.8f}  {y:.8f}\n" for x, y in points))
    return str(file)


@pytest.mark.parametrize(
    ("text", "name", "thickness"),
    [
        ("4412", "naca4412", 0.12),
        ("NACA 0009", "naca0009", 0.09),
        ("naca23015", "naca23015", 0.15),
        ("naca-2421", "naca2421", 0.21),
    ],
)
def test_designations_name_their_thickness(text, name, thickness):
    shape = airfoil_shape(text)
    assert (shape.name, shape.thickness_to_chord, shape.coordinates) == (name, thickness, ())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("4400", "its thickness"),
        ("4490", "its thickness"),
        ("4012", "must both be zero or neither"),
        ("0412", "must both be zero or neither"),
        ("13012", "five-digit sections begin with"),
        ("23112", "five-digit sections begin with"),
        ("clark", "it must be a NACA section"),
        ("441", "it must be a NACA section"),
    ],
)
def test_designations_that_are_none_are_refused(text, message):
    with pytest.raises(ValueError, match=message):
        airfoil_shape(text)


def test_coordinate_file_has_the_thickness_of_its_section_in_every_order_and_unit(tmp_path):
    upper, lower = naca_four_digits("4412")
    files = {
        "selig": write(tmp_path / "selig.dat", selig()),
        "reversed": write(tmp_path / "reversed.dat", selig()[::-1]),
        "millimetres": write(tmp_path / "millimetres.dat", selig(scale=350.0, shift=(20.0, -3.0))),
        "lednicer": write(tmp_path / "lednicer.dat", [(len(upper), len(lower)), *upper, *lower]),
    }
    shapes = {key: airfoil_shape(file) for key, file in files.items()}
    for key, shape in shapes.items():
        assert shape.name == key
        assert shape.thickness_to_chord == pytest.approx(0.12, rel=1e-3)
        ours, first = np.array(shape.coordinates), np.array(shapes["selig"].coordinates)
        assert ours.shape == first.shape
        np.testing.assert_allclose(ours, first, atol=2e-7)
    assert np.array(shapes["selig"].coordinates)[:, 0].min() == 0.0


def test_equal_names_of_different_sections_have_different_keys(tmp_path):
    first = airfoil_shape(write(tmp_path / "wing.dat", selig("4412")))
    second = airfoil_shape(write(tmp_path / "wing.dat", selig("2412")))
    assert first.name == second.name
    assert first.key != second.key


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "0 points are invalid"),
        ("title only\n", "0 points are invalid"),
        ("t\n" + "0.5 0.1\n" * 8, "8 points are invalid"),
        ("t\n" + "0.5 0.1\n" * 30, "x coordinates are invalid: they are all the same"),
        ("t\n1 0\n0.5 abc\n", r"'0.5 abc' is invalid: it must be two finite numbers \(line 3\)"),
        ("t\n1 0\n0.5 nan\n", "two finite numbers"),
        ("t\n1 0\n0.5 0.1 0.2\n", "2 points are invalid"),
        ("t\n" + "1 0\n" * 10001, "10001 points are invalid"),
        ("t\n" + "".join(f"{x / 40:.4f} {x % 2}\n" for x in range(40)), "they must close at the trailing edge"),
    ],
)
def test_files_that_are_no_section_are_refused(tmp_path, content, message):
    file = tmp_path / "section.dat"
    file.write_text(content)
    with pytest.raises(ValueError, match=message):
        airfoil_shape(str(file))


def test_shuffled_points_are_refused(tmp_path):
    points = selig()
    points[20:60] = points[20:60][np.random.default_rng(0).permutation(40)]
    with pytest.raises(ValueError, match="the order of points is invalid: it must run once around the section"):
        airfoil_shape(write(tmp_path / "section.dat", points))


def test_a_plate_or_a_brick_is_no_section(tmp_path):
    for factor in (0.1, 7.0):
        points = selig("0012") * (1.0, factor)
        with pytest.raises(
            ValueError, match=r"a thickness of .* chords is invalid: it must lie between 0\.019 and 0\.7"
        ):
            airfoil_shape(write(tmp_path / "section.dat", points))


@needs_xfoil
@pytest.mark.parametrize("digits", ["4412", "23012"])
def test_a_section_has_one_polar_whether_named_or_given_by_coordinates(tmp_path, digits):
    shape = airfoil_shape(digits)
    given = airfoil_shape(write(tmp_path / "given.dat", section_coordinates(shape)))
    assert given.thickness_to_chord == pytest.approx(0.12, rel=1e-3)
    polars = (run_polar(s, 1e6, 0.0, [0.0, 4.0]).points for s in (given, shape))
    for ours, theirs in zip(*polars, strict=True):
        # The same shape in other panels.
        assert ours.cl == pytest.approx(theirs.cl, abs=3e-3)
        assert ours.cd == pytest.approx(theirs.cd, rel=0.01)


@pytest.mark.parametrize("digits", ["0012", "2412", "4412"])
def test_four_digit_coordinates_are_those_of_the_report(digits):
    upper, lower = naca_four_digits(digits, 121)
    points = np.r_[upper[::-1], lower[1:]]
    np.testing.assert_allclose(section_coordinates(airfoil_shape(digits)), points, rtol=0.0, atol=1e-12)


@needs_xfoil
def test_a_five_digit_section_has_nearly_no_pitching_moment():
    # Abbott and von Doenhoff (1959), NACA 23012: moment about the quarter chord near -0.01, zero lift near -1.2 degrees.
    (point,) = run_polar(airfoil_shape("23012"), 3e6, 0.0, [0.0]).points
    assert point.cm == pytest.approx(-0.01, abs=0.01)
    assert point.cl / (2.0 * math.pi) == pytest.approx(math.radians(1.2), rel=0.2)


def test_no_more_points_reach_xfoil_than_it_holds(tmp_path):
    upper, lower = naca_four_digits("4412", 450)
    shape = airfoil_shape(write(tmp_path / "dense.dat", np.r_[upper[::-1], lower[1:]]))
    assert len(shape.coordinates) <= 300
    assert shape.thickness_to_chord == pytest.approx(0.12, rel=0.01)
    lines = xfoil._section_commands(shape, tmp_path)
    assert lines == ["LOAD section.dat"]
    assert len((tmp_path / "section.dat").read_text().splitlines()) == 1 + len(shape.coordinates)
