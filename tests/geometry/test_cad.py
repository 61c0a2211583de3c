"""STEP files: our own come back unchanged; trimmed, rational and foreign-unit files of the kernel itself; bad files."""

import math
import random
import re
import sys
from pathlib import Path

import pytest
import torch
from conftest import number

from lpc_mdo.config import load
from lpc_mdo.geometry.cad import CadError, read_step, write_step
from lpc_mdo.geometry.meshing import wetted_area
from lpc_mdo.geometry.outer_mold_line import OuterMoldLine

FAULTS = Path(__file__).parents[1] / "faults"
FOOT = 0.3048
GRID = torch.linspace(0.0, 1.0, 9, dtype=torch.float64)


def test_without_the_kernel_it_is_said_how_to_get_it(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "OCP.Message", None)
    monkeypatch.setitem(sys.modules, "OCP", None)
    with pytest.raises(CadError, match=r"install it with: pip install 'lpc-mdo\[cad\]'"):
        read_step(tmp_path / "any.step")


@pytest.fixture(scope="module")
def kernel():
    return pytest.importorskip("OCP", reason="the CAD kernel (extra `cad`) is not installed")


@pytest.fixture(scope="module")
def own_file(kernel, tmp_path_factory):
    mold = OuterMoldLine(load()[0])
    surfaces = mold.surfaces(mold.control_points(mold.baseline_parameters()))
    file = tmp_path_factory.mktemp("cad") / "baseline.step"
    write_step(surfaces, file)
    return surfaces, file


def on_grid(surface):
    return surface.grid(*(low + (high - low) * GRID for low, high in surface.domain))


def test_our_own_file_comes_back_by_name_to_a_nanometre(own_file):
    surfaces, file = own_file
    found = {item.name: item for item in read_step(file)}
    assert set(found) == set(surfaces)
    for name, item in found.items():
        torch.testing.assert_close(on_grid(item.surface), on_grid(surfaces[name]), rtol=0, atol=1e-9)
        assert not item.is_trimmed
        assert item.surface.degrees == surfaces[name].degrees


def write_with_the_kernel(shape, file, unit):
    """A file as another program would write it, straight from the kernel's own shapes."""
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    writer = STEPControl_Writer()
    Interface_Static.SetCVal_s("xstep.cascade.unit", unit)
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(file))


def test_a_body_in_feet_arrives_in_metres(kernel, tmp_path):
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox

    file = tmp_path / "feet.step"
    write_with_the_kernel(BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape(), file, "FT")
    assert "FOOT" in file.read_text()
    faces = read_step(file)
    assert len(faces) == 6
    corners = torch.cat([face.surface.control_points.flatten(0, 1) for face in faces])
    expected = FOOT * torch.tensor([1.0, 2.0, 3.0], dtype=torch.float64)
    torch.testing.assert_close(corners.amax(0) - corners.amin(0), expected, rtol=0, atol=1e-9)
    assert sum(float(wetted_area(face.surface)) for face in faces) == pytest.approx(22.0 * FOOT**2, rel=1e-9)


def test_rational_and_trimmed_faces_lie_on_the_body_that_was_written(kernel, tmp_path):
    """A plate of 4 x 4 x 1 m with a round hole of radius 1 m through its middle."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    plate = BRepPrimAPI_MakeBox(4.0, 4.0, 1.0).Shape()
    drill = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(2.0, 2.0, -1.0), gp_Dir(0.0, 0.0, 1.0)), 1.0, 3.0).Shape()
    file = tmp_path / "plate.step"
    write_with_the_kernel(BRepAlgoAPI_Cut(plate, drill).Shape(), file, "MM")
    faces = read_step(file)
    assert len(faces) == 7
    trimmed = [face for face in faces if face.is_trimmed]
    rational = [face for face in faces if face.surface.weights is not None]
    assert len(trimmed) == 2  # top and bottom have the hole
    assert len(rational) == 1
    wall = on_grid(rational[0].surface)
    # The kernel's box counted in its unit, here millimetres.
    radius = torch.linalg.vector_norm(wall[..., :2] - 0.002, dim=-1)
    torch.testing.assert_close(radius, torch.full_like(radius, 0.001), rtol=0, atol=1e-12)
    assert float(wetted_area(rational[0].surface)) == pytest.approx(2.0 * math.pi * 1e-6, rel=1e-9)
    for face in trimmed:
        assert float(wetted_area(face.surface)) == pytest.approx(16e-6, rel=1e-9)


def test_bodies_closed_all_around_are_read_whole(kernel):
    # 4 pi^2 R r of a torus of 500 and 50 mm, given in inches; pi (r1 + r2) s of a cone from 100 to 40 mm, 300 mm long.
    (torus,) = read_step(FAULTS / "torus.step")
    assert float(wetted_area(torus.surface)) == pytest.approx(
        4.0 * math.pi**2 * 0.5 * 0.05, rel=1e-8
    )  # twelve digits in the file
    assert not torus.is_trimmed
    wall, *ends = read_step(FAULTS / "frustum.step")
    assert float(wetted_area(wall.surface)) == pytest.approx(math.pi * 0.14 * math.hypot(0.06, 0.3), rel=1e-8)
    assert (wall.is_trimmed, [end.is_trimmed for end in ends]) == (False, [True, True])


@pytest.mark.parametrize("angle", [1.0, 3.0, 6.0])
def test_part_of_a_torus_is_that_part(kernel, tmp_path, angle):
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeTorus

    file = tmp_path / "part.step"
    write_with_the_kernel(BRepPrimAPI_MakeTorus(2.0, 0.5, angle).Shape(), file, "M")
    areas = [float(wetted_area(face.surface)) for face in read_step(file) if face.surface.weights is not None]
    assert areas[0] == pytest.approx(2.0 * math.pi * 0.5 * 2.0 * angle, rel=1e-8)


def test_a_sphere_has_its_area(kernel, tmp_path):
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeSphere

    file = tmp_path / "sphere.step"
    write_with_the_kernel(BRepPrimAPI_MakeSphere(2.0).Shape(), file, "M")
    (face,) = read_step(file)
    assert float(wetted_area(face.surface)) == pytest.approx(16.0 * math.pi, rel=1e-6)


def test_a_kernel_that_crashes_or_never_ends_takes_nothing_with_it(kernel, own_file, monkeypatch):
    with pytest.raises(CadError, match=r"the CAD kernel did not end within 0\.01 s"):
        read_step(own_file[1], time_limit=0.01)
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(CadError, match="the CAD kernel crashed on it") as caught:
        read_step(own_file[1])
    assert str(own_file[1]) in str(caught.value)


def test_a_file_that_cannot_be_written_whole_is_not_there(own_file, tmp_path):
    surfaces, _ = own_file
    (tmp_path / "out.step.partial").mkdir()
    with pytest.raises(OSError, match=r"out\.step"):
        write_step(surfaces, tmp_path / "out.step")
    assert not (tmp_path / "out.step").exists()


@pytest.mark.parametrize("seed", range(6))
def test_damaged_files_are_read_or_refused_in_one_sentence(kernel, tmp_path, seed):
    rng = random.Random(seed)
    lines = (FAULTS / rng.choice(["torus.step", "frustum.step"])).read_text().splitlines()
    for _ in range(rng.choice([1, 3, 10])):
        k = rng.randrange(len(lines))
        number = rng.choice(["0", "-1", "1E400", "#1", "$", "99999"])
        lines[k] = rng.choice(["", lines[rng.randrange(len(lines))], re.sub(r"[-\d.E]+", number, lines[k], count=1)])
    file = tmp_path / "damaged.step"
    file.write_text("\n".join(lines))
    try:
        faces = read_step(file, time_limit=60.0)
        assert all(bool(face.surface.control_points.isfinite().all()) for face in faces)
    except CadError as error:
        assert re.fullmatch(re.escape(str(file)) + ": .+", str(error))  # noqa: PT017


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "cannot be read: it is not a STEP file, or damaged"),
        ("hello", "cannot be read: it is not a STEP file, or damaged"),
        (
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
            "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n",
            "must hold a surface",
        ),
    ],
    ids=["empty", "no STEP", "no geometry"],
)
def test_bad_files_get_one_clear_message(kernel, tmp_path, capfd, content, message):
    file = tmp_path / "bad.step"
    file.write_text(content)
    with pytest.raises(CadError, match=message) as caught:
        read_step(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_cut_off_file_is_refused(own_file, tmp_path):
    file = tmp_path / "cut.step"
    file.write_text(own_file[1].read_text()[:20000])
    with pytest.raises(CadError, match="cannot be read: it is not a STEP file, or damaged"):
        read_step(file)


def test_a_missing_file_is_refused(kernel, tmp_path):
    with pytest.raises(CadError, match="does not exist or is not a file"):
        read_step(tmp_path / "none.step")


def test_imported_surfaces_are_differentiable(own_file):
    surface = next(item.surface for item in read_step(own_file[1]) if item.name == "wing_upper")
    u = number(0.3)[None].requires_grad_()
    height = surface(u, number(0.4)[None])[0, 2]
    (slope,) = torch.autograd.grad(height, u)
    assert float(slope) == pytest.approx(float(surface.jet(u.detach(), number(0.4)[None]).u[0, 2]), rel=1e-12)
