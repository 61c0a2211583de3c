"""The aircraft's shape as CAD and mesh files, from a vehicle file or from a stored result."""

from collections.abc import Mapping
from pathlib import Path

import torch

from lpc_mdo.config import Vehicle, load
from lpc_mdo.config.layout import own_rotors
from lpc_mdo.files.read import ConfigurationError
from lpc_mdo.files.values import FARTHEST, require_numbers
from lpc_mdo.files.write import locked
from lpc_mdo.geometry.cad import write_step
from lpc_mdo.geometry.mesh_files import quad_mesh, write_stl, write_vtk
from lpc_mdo.geometry.parameterization import SHAPE_VARIABLES, ShapeParameters
from lpc_mdo.geometry.shape import Geometry
from lpc_mdo.geometry.surfaces import BSplineSurface
from lpc_mdo.numerics.threads import one_thread
from lpc_mdo.stored.configuration import read_configuration
from lpc_mdo.stored.result import read_result

FORMATS = ("step", "stl", "vtk", "png")
FIGURE_DPI = 150
SHAPE_RANGES = {"wing_twist": (-1.0, 1.0), "tail_position": (-FARTHEST, FARTHEST)}  # rad, m
LEAST_SIZE, LARGEST_SIZE = 0.05, 200.0  # of areas (m^2), aspect ratios and radii (m): twice what a vehicle file allows


@one_thread()
def export_shape(source: Path | None, file_format: str, folder: Path) -> list[Path]:
    """Write the shapes of `source` to `folder` and return the files.

    source: a result.json (with its configuration.json beside it) gives `before` and `after`; a vehicle file, or None for
    the shipped baseline, gives `baseline`. As png, figures: each shape with its camber meshes and with its measures, and
    both over each other. Raises ConfigurationError or CadError with one sentence.
    """
    if file_format not in FORMATS:
        raise ConfigurationError(f"format = {file_format} is not allowed; it must be one of {', '.join(FORMATS)}.")
    if folder.exists() and not folder.is_dir():
        raise ConfigurationError(f"{folder} is not allowed; it exists and is not a folder.")
    geometry, shapes = _chosen(source)
    with locked(folder):
        if file_format == "png":
            return _draw(geometry, shapes, folder)
        mold, written = geometry.outer_mold_line, []
        for name, shape in shapes.items():
            file = folder / f"{name}.{file_format}"
            _write(mold.surfaces(mold.control_points(shape)), file_format, file)
            written.append(file)
        return written


def _chosen(source: Path | None) -> tuple[Geometry, dict[str, ShapeParameters]]:
    if source is not None and source.suffix == ".json":
        return stored_shapes(source)
    geometry = Geometry(load(source)[0])
    return geometry, {"baseline": geometry.outer_mold_line.baseline_parameters()}


def _write(surfaces: Mapping[str, BSplineSurface], file_format: str, file: Path) -> None:
    if file_format == "step":
        write_step(surfaces, file)
    elif file_format == "stl":
        write_stl(quad_mesh(surfaces), file)
    else:
        write_vtk(quad_mesh(surfaces), file)


def _draw(geometry: Geometry, shapes: dict[str, ShapeParameters], folder: Path) -> list[Path]:
    from lpc_mdo.reporting import style
    from lpc_mdo.reporting.figures import geometry_comparison, geometry_measures, outer_mold_line
    from lpc_mdo.reporting.mold import mold_data

    molds = {name: mold_data(geometry, shape) for name, shape in shapes.items()}
    with style.look():
        figures = {name: outer_mold_line.plot(mold) for name, mold in molds.items()}
        figures |= {f"{name}_measures": geometry_measures.plot(mold) for name, mold in molds.items()}
        if len(molds) == 2:
            figures["comparison"] = geometry_comparison.draw(*molds.values())
        files = [folder / f"{name}.png" for name in figures]
        for file, figure in zip(files, figures.values(), strict=True):
            style.save(figure, file, dpi=FIGURE_DPI)
    return files


def stored_shapes(result: Path) -> tuple[Geometry, dict[str, ShapeParameters]]:
    """Geometry of a stored result's vehicle, and its shape parameters `before` and `after` optimization.

    Raises ConfigurationError where result.json or the configuration.json beside it lacks what is needed.
    """
    vehicle = stored_vehicle(result.parent / "configuration.json")
    content = read_result(result)
    variables = {entry["name"]: entry for entry in content["design_variables"]}
    geometry = Geometry(vehicle)
    start = geometry.outer_mold_line.baseline_parameters()
    is_reduced = content["formulation"] == "reduced"
    shapes = {}
    for name, key in (("before", "initial"), ("after", "value")):
        values = {}
        for variable in SHAPE_VARIABLES:
            if variable not in variables:
                raise ConfigurationError(f"{result}: design variable {variable} is missing.")
            size = tuple(getattr(start, variable).shape)
            if is_reduced and variable == "rotor_radius":
                size = (len(own_rotors(vehicle)[0]),)
            lower, upper = SHAPE_RANGES.get(variable, (LEAST_SIZE, LARGEST_SIZE))
            try:
                require_numbers(variables[variable][key], size, lower, upper)
            except ValueError as error:
                raise ConfigurationError(f"{result}: design variable {variable}: {key}{error}.") from None
            values[variable] = torch.tensor(variables[variable][key], dtype=torch.float64)
        if is_reduced:
            values["rotor_radius"] = values["rotor_radius"][own_rotors(vehicle)[1]]
        shapes[name] = ShapeParameters(**values)
    return geometry, shapes


def stored_vehicle(configuration: Path) -> Vehicle:
    """The vehicle of a run. Raises ConfigurationError as `read_configuration`."""
    return read_configuration(configuration)[0]
