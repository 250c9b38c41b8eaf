"""Pictures, whose dark pixels are obstacles.

`decoding` reads pictures of all formats, and `classification` turns their pixels into cells. A picture
written by `robocov export` has a text chunk with the side of a pixel in meters and the lower left corner, so
that it is imported at the same scale and position.
"""

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import shapely

from robocov.errors import MapError, to_one_line
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov_app.formats.colors import PICTURE_TOLERANCE
from robocov_app.formats.foreign_map import ForeignMap, Thumbnail
from robocov_app.formats.geometry.cells.grid_map import GridFrame, build_grid_map
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.raster.picture.brightness import Brightness
from robocov_app.formats.raster.picture.decoding import is_picture, read_picture
from robocov_app.formats.raster.picture.pixel_classification import (
    classify_pixels,
    describe_doubts,
    drop_strokes,
    has_transparent_background,
    require_free_cells,
)

GEOREFERENCE_CHUNK = "robocov"
"""Key of the text chunk with the scale and position: JSON with ``cell_m`` and ``origin_m``."""
TITLE_CHUNK = "Title"
"""Key of the text chunk with the name of the map."""
_JPEG_NOISE_CELLS = 1.5
"""Obstacles of a JPEG that are smaller, in cells, are compression noise."""
_MIN_CELL_M = 1e-6
_MAX_CELL_M = 1e4


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return is_picture(head)


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a picture as a grid of cells.

    Raises
    ------
    MapError
        If the picture is damaged, its scale is unknown, or no cell is free.
    """
    source_name = to_one_line(path)
    picture = read_picture(path, source_name, options.build_color_key(PICTURE_TOLERANCE))
    cell, origin = _parse_georeference(picture)
    if options.cell is not None:
        cell = options.cell
    if cell is None:
        raise MapError(f"{source_name}: an image has no scale, {_describe_missing_scale(path)}")
    cells, notes = classify_pixels(picture, options)
    unknown = options.unknown or "obstacle"
    if options.unknown is None and has_transparent_background(cells):
        unknown = "free"
        notes.append("only dark paint on a transparent background, so transparent pixels are free")
    dropped: tuple[str, ...] = ()
    if options.min_stroke is not None:
        dropped = drop_strokes(cells, options, cell, source_name)
    require_free_cells(cells, unknown, picture, source_name)
    notes += describe_doubts(cells, unknown, picture)
    foreign = build_grid_map(
        cells,
        GridFrame(cell, origin),
        source_name,
        name=picture.texts.get(TITLE_CHUNK, "").strip() or path.stem,
        description=f"An image of {cell:g} m a pixel, imported.",
        unknown=unknown,
        unknown_name="transparent",
        noise_cells=_JPEG_NOISE_CELLS if picture.lossy else 0.0,
        notes=tuple(notes),
    )
    rows, columns = cells.shape
    left, bottom = origin
    bounds = (left, bottom, left + columns * cell, bottom + rows * cell)
    thumbnail = None if picture.thumbnail is None else Thumbnail(picture.thumbnail, bounds)
    return replace(
        foreign,
        dropped=(*dropped, *foreign.dropped),
        page=shapely.box(*bounds),
        thumbnail=thumbnail,
    )


def _parse_georeference(picture: Brightness) -> tuple[float | None, tuple[float, float]]:
    """Return the side of a pixel, m, and the lower left corner, m, from the text chunk of a picture.

    Without a valid chunk, they are None and (0, 0).
    """
    with suppress(ValueError, KeyError, TypeError, RecursionError, OverflowError):
        document = json.loads(picture.texts.get(GEOREFERENCE_CHUNK, ""))
        cell = float(document["cell_m"])
        x, y = map(float, document["origin_m"])
        is_in_range = abs(x) <= MAX_COORDINATE_M and abs(y) <= MAX_COORDINATE_M
        if _MIN_CELL_M <= cell <= _MAX_CELL_M and is_in_range:
            return cell, (x, y)
    return None, (0.0, 0.0)


def _describe_missing_scale(path: Path) -> str:
    metadata = path.with_suffix(".yaml")
    hint = f" (or import {to_one_line(metadata.name)} next to it)" if metadata.is_file() else ""
    return f"expected --cell, the meters per pixel{hint}"
