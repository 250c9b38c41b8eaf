"""Writing maps as ROS maps.

Cells outside the boundary are unknown, except for those next to the free space: these are occupied, so that
planners that treat unknown cells as passable stay inside.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy import ndimage

from robocov.environment import Environment
from robocov.errors import OutputError, quote, to_one_line
from robocov.files.writing import replace_file
from robocov.typing import BoolArray, Float32Array
from robocov_app.formats.geometry.cells.rasterize import (
    CellGrid,
    build_grid,
    build_grid_report,
    find_free_cells,
)
from robocov_app.formats.options import WriteOptions
from robocov_app.formats.raster.ros.metadata import FREE_THRESHOLD, OCCUPIED_THRESHOLD, UNKNOWN_LEVEL
from robocov_app.formats.reports import ExportReport

_FREE_LEVEL = 254
"""Level that map_saver writes for free cells. For occupied cells it is 0."""
_SUBDIVISION = 4
"""Subcells along each side of a cell; the solid fraction of them is its occupancy in modes scale and raw."""
_PLAIN_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
"""File names that need no quotes in YAML."""
_MAX_LINE_CHARACTERS = 10_000
"""File names of up to this length are written in one line."""


def list_files(path: Path, options: WriteOptions) -> tuple[Path, ...]:
    """Return the YAML and the picture that are written for a path."""
    suffix = options.image
    if suffix is None:
        suffix = "png" if options.mode == "scale" else "pgm"
    return (path, path.with_suffix(f".{suffix}"))


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    """Write an environment as a YAML file and a picture.

    Raises
    ------
    OutputError
        If a file cannot be written, or both would have the same name.
    """
    mode = options.mode or "trinary"
    _, image = list_files(path, options)
    image_name = _quote_image_name(path, image)
    is_pgm = image.suffix == ".pgm"
    grid = build_grid(environment, options.cell)
    free = find_free_cells(environment, grid)
    # The cells next to the free space stay occupied, even outside the boundary.
    walls_and_free = ndimage.binary_dilation(free, np.ones((3, 3), bool))
    unknown = ~(grid.find_covered_cells(environment.boundary_polygon) | walls_and_free)
    notes: tuple[str, ...] = ()
    if mode == "trinary":
        pixels = _build_trinary_pixels(free, unknown)
    else:
        occupancy = _compute_occupancy(environment, grid, free)
        free = np.rint(100.0 * occupancy) < 50.0
        if mode == "raw":
            pixels = _build_raw_pixels(occupancy, unknown)
        else:
            pixels = _build_scale_pixels(occupancy, unknown, has_alpha=not is_pgm)
            if is_pgm:
                notes = ("a PGM of mode scale has no unknown cells: cells outside are occupied",)
    x, y = grid.origin
    # Neither file is replaced before both have been written.
    with replace_file(path) as temporary, replace_file(image) as temporary_image:
        _write_picture(temporary_image, pixels, grid.cell)
        temporary.write_text(
            f"image: {image_name}\nmode: {mode}\nresolution: {grid.cell!r}\n"
            f"origin: [{x!r}, {y!r}, 0.0]\n"
            f"negate: 0\noccupied_thresh: {OCCUPIED_THRESHOLD}\nfree_thresh: {FREE_THRESHOLD}\n",
            encoding="utf-8",
        )
    return replace(build_grid_report("ros", (path, image), environment, grid, free), notes=notes)


def _quote_image_name(path: Path, image: Path) -> str:
    """Return the name of the picture as written in the YAML file `path`, in quotes if necessary."""
    if image == path:
        raise OutputError(f"{to_one_line(path)}: expected another name for the YAML than for the image")
    try:
        image.name.encode()
    except UnicodeEncodeError:
        raise OutputError(f"{to_one_line(path)}: {quote(image.name)}: expected a name in UTF-8") from None
    if _PLAIN_NAME.fullmatch(image.name):
        return image.name
    # JSON escapes characters beyond U+FFFF as surrogate pairs, which YAML does not combine.
    quoted = yaml.safe_dump(image.name, default_style='"', allow_unicode=True, width=_MAX_LINE_CHARACTERS)
    return quoted.rstrip("\n")


def _compute_occupancy(environment: Environment, grid: CellGrid, free: BoolArray) -> Float32Array:
    """Return the solid fraction of each cell.

    A cell that is not free counts as fully occupied, because costmaps treat any lower occupancy as free.
    """
    subcells = grid.find_covered_cells(environment.free, _SUBDIVISION)
    subcells = subcells.reshape(grid.rows, _SUBDIVISION, grid.columns, _SUBDIVISION)
    occupancy: Float32Array = 1.0 - subcells.mean(axis=(1, 3), dtype=np.float32)
    occupancy[~free] = 1.0
    return occupancy


def _build_trinary_pixels(free: BoolArray, unknown: BoolArray) -> NDArray[np.uint8]:
    """Return the pixels of a map of mode trinary, (rows, columns), the bottom row first."""
    pixels: NDArray[np.uint8] = np.where(free, np.uint8(_FREE_LEVEL), np.uint8(0))
    pixels[unknown] = UNKNOWN_LEVEL
    return pixels


def _build_raw_pixels(occupancy: Float32Array, unknown: BoolArray) -> NDArray[np.uint8]:
    """Return the pixels of a map of mode raw, (rows, columns), the bottom row first."""
    return np.where(unknown, 255, np.rint(100.0 * occupancy)).astype(np.uint8)


def _build_scale_pixels(occupancy: Float32Array, unknown: BoolArray, *, has_alpha: bool) -> NDArray[np.uint8]:
    """Return the pixels of a map in the mode "scale": the darker a pixel, the higher its occupancy.

    The shape is (rows, columns), from the bottom row up, or (rows, columns, 2) with an alpha channel, which
    is 0 for unknown cells.
    """
    darkness = FREE_THRESHOLD + occupancy * (OCCUPIED_THRESHOLD - FREE_THRESHOLD)
    darkness = np.where(occupancy <= 0.0, 0.0, darkness)
    darkness = np.where(occupancy >= 1.0, 1.0, darkness)
    pixels: NDArray[np.uint8] = np.rint(255.0 * (1.0 - darkness)).astype(np.uint8)
    if not has_alpha:
        pixels[unknown] = 0
        return pixels
    alpha = np.where(unknown, np.uint8(0), np.uint8(255))
    pixels_with_alpha: NDArray[np.uint8] = np.dstack([pixels, alpha])
    return pixels_with_alpha


def _write_picture(path: Path, pixels: NDArray[np.uint8], cell: float) -> None:
    """Write pixels, whose bottom row is first, as a PGM or PNG."""
    picture = np.ascontiguousarray(pixels[::-1])
    if path.suffix == ".pgm":
        rows, columns = picture.shape
        header = f"P5\n# robocov {cell!r} m/pix\n{columns} {rows}\n255\n"
        path.write_bytes(header.encode("ascii") + picture.tobytes())
    else:
        import PIL.Image

        PIL.Image.fromarray(picture).save(path, format="PNG")
