"""Maps of ROS: the YAML of map_server and a picture beside it.

What is outside of the boundary is unknown, but for the cells along the free space: these are occupied, so
that planners which take the unknown for passable stay inside.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from robocov.errors import OutputError, one_line, shown
from robocov.files.atomic import written
from robocov_app.exporters.cells import Grid, free_cells, grid_over, lost_passages, not_held
from robocov_app.exporters.writing import Exporter, ExportReport, WriteOptions

if TYPE_CHECKING:
    from robocov.arrays import BoolArray
    from robocov.environment import Environment

OCCUPIED, FREE = 0.65, 0.196
"""The thresholds of map_server's own maps."""

_WHITE, _GREY, _BLACK = 254, 205, 0
"""What map_saver writes for free, unknown and occupied."""

_FINER = 4
"""Of scale and raw a cell's occupancy is the part of so many by so many of its places that is solid."""

_Pixels: TypeAlias = NDArray[np.uint8]


def _files(path: Path, options: WriteOptions) -> tuple[Path, ...]:
    mode = options.mode or "trinary"
    image = options.image or ("png" if mode == "scale" else "pgm")
    return (path, path.with_suffix(f".{image}"))


def _write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    mode = options.mode or "trinary"
    _, image = _files(path, options)
    if image == path:
        raise OutputError(f"{one_line(path)}: the name of the picture, but one for the YAML was wanted")
    text_name = _quoted(image.name, path)
    grid = grid_over(environment, options.cell)
    free = free_cells(environment, grid)
    within = grid.covered(environment.boundary_polygon)
    # a wall of one cell all around what is free
    unknown = ~(within | ndimage.binary_dilation(free, np.ones((3, 3), bool)))
    if mode == "trinary":
        pixels = np.where(free, np.uint8(_WHITE), np.uint8(_BLACK))
        pixels[unknown] = _GREY
        alpha = None
    else:
        pixels, alpha, free = _graded(environment, grid, free, unknown, mode)
    notes: tuple[str, ...] = ()
    if alpha is not None and image.suffix == ".pgm":
        notes = ("a PGM of mode scale has no unknown cells: what is outside is occupied",)
        pixels = np.where(unknown, np.uint8(_BLACK), pixels)
        alpha = None
    _save(image, pixels[::-1], None if alpha is None else alpha[::-1], grid)
    with written(path) as part:
        part.write_text(
            f"image: {text_name}\n"
            f"mode: {mode}\n"
            f"resolution: {grid.cell!r}\n"
            f"origin: [{grid.origin[0]!r}, {grid.origin[1]!r}, 0.0]\n"
            f"negate: 0\n"
            f"occupied_thresh: {OCCUPIED}\n"
            f"free_thresh: {FREE}\n",
            encoding="utf-8",
        )
    return ExportReport(
        "ros",
        (path, image),
        environment.free_area,
        float(np.count_nonzero(free)) * grid.cell**2,
        dropped=not_held(environment),
        notes=notes,
        warnings=lost_passages(environment, grid, free),
    )


def _graded(
    environment: Environment, grid: Grid, free: BoolArray, unknown: BoolArray, mode: str
) -> tuple[_Pixels, _Pixels | None, BoolArray]:
    """Return pixels and opacity of mode scale or raw, (rows, columns), and the cells that are mostly free.

    A cell that is not free is occupied for sure: costmaps take what is less than sure for free.
    """
    fine = grid.covered(environment.free, _FINER).reshape(grid.rows, _FINER, grid.columns, _FINER)
    solid = 1.0 - fine.mean(axis=(1, 3), dtype=np.float32)
    solid[~free] = 1.0
    percent = np.rint(100.0 * solid)
    free = percent < 50.0
    if mode == "raw":
        return np.where(unknown, 255, percent).astype(np.uint8), None, free
    dark = np.where(solid >= 1.0, 1.0, np.where(solid <= 0.0, 0.0, FREE + solid * (OCCUPIED - FREE)))
    alpha = np.where(unknown, np.uint8(0), np.uint8(255))
    return np.rint(255.0 * (1.0 - dark)).astype(np.uint8), alpha, free


def _save(path: Path, pixels: _Pixels, alpha: _Pixels | None, grid: Grid) -> None:
    """Write a picture, the top row first."""
    with written(path) as part:
        if path.suffix == ".pgm":
            head = f"P5\n# robocov {grid.cell!r} m/pix\n{grid.columns} {grid.rows}\n255\n"
            part.write_bytes(head.encode("ascii") + pixels.tobytes())
            return
        import PIL.Image

        picture = pixels if alpha is None else np.dstack([pixels, alpha])
        PIL.Image.fromarray(np.ascontiguousarray(picture)).save(part, format="PNG")


def _quoted(name: str, path: Path) -> str:
    """Return a file's name as YAML has it."""
    try:
        name.encode()
    except UnicodeEncodeError:
        raise OutputError(f"{one_line(path)}: {shown(name)}: no name that UTF-8 can hold") from None
    return name if re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", name) else json.dumps(name)


EXPORTER = Exporter(
    name="ros",
    title="ROS map_server: YAML with a PGM or PNG",
    suffixes=(".yaml", ".yml"),
    write=_write,
    options=frozenset({"cell", "mode", "image"}),
    files=_files,
)
