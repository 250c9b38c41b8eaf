"""A picture of a floor plan: dark is an obstacle, light is free, transparent is unknown.

A picture that `robocov export` wrote says in a text chunk what a pixel is in metres and where its lower
left corner is, and so comes back to its place.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from robocov.errors import MapError, one_line
from robocov.mapfile.models import FARTHEST
from robocov_app.importers.images import Brightness, is_picture, read_picture
from robocov_app.importers.raster import BLOCKED, FREE, UNKNOWN, foreign_map
from robocov_app.importers.reading import Importer, ReadOptions

if TYPE_CHECKING:
    from robocov_app.importers.foreign import ForeignMap

CHUNK = "robocov"
"""Key of the text chunk that says where the picture belongs: JSON with ``cell_m`` and ``origin_m``."""

TITLE = "Title"
"""Key of the text chunk with the name of what is shown."""

_NOISE = 1.5
"""Single cells beside dark ones come of how a JPEG is saved."""

_OPAQUE = 128
"""Less opaque pixels count as transparent, of 255."""


def _sniff(path: Path, head: bytes) -> bool:
    return is_picture(head)


def _read(path: Path, options: ReadOptions) -> ForeignMap:
    where = one_line(path)
    picture = read_picture(path, where)
    cell, origin = _place(picture)
    cell = options.cell if options.cell is not None else cell
    if cell is None:
        beside = path.with_suffix(".yaml")
        hint = f" (or import {one_line(beside.name)} beside it)" if beside.is_file() else ""
        raise MapError(f"{where}: a picture has no scale, but --cell, the metres a pixel, was wanted{hint}")
    threshold = 0.5 if options.threshold is None else options.threshold
    shade = np.arange(picture.full + 1) / picture.full
    light = shade > 1.0 - threshold if options.invert else shade >= threshold
    table = np.where(light ^ bool(options.invert), FREE, BLOCKED).astype(np.uint8)
    cells = table[picture.level]
    if picture.alpha is not None:
        cells[picture.alpha < _OPAQUE] = UNKNOWN
    return foreign_map(
        cells,
        name=picture.texts.get(TITLE, "").strip() or path.stem,
        description=f"A picture of {cell:g} m a pixel, imported.",
        format="picture",
        cell=cell,
        origin=origin,
        unknown=options.unknown or "obstacle",
        called="transparent",
        noise=_NOISE if picture.lossy else 0.0,
        where=where,
    )


def _place(picture: Brightness) -> tuple[float | None, tuple[float, float]]:
    """Return what the picture says of itself: metres a pixel, and its lower left corner."""
    nothing = (None, (0.0, 0.0))
    try:
        given = json.loads(picture.texts.get(CHUNK, ""))
        cell, (x, y) = float(given["cell_m"]), map(float, given["origin_m"])
    except (ValueError, KeyError, TypeError, RecursionError, OverflowError):
        return nothing
    sane = 1e-6 <= cell <= 1e4 and abs(x) <= FARTHEST and abs(y) <= FARTHEST
    return (cell, (x, y)) if sane else nothing


IMPORTER = Importer(
    name="picture",
    title="picture: PNG, JPEG, BMP, TIFF, PGM, PPM, dark is an obstacle",
    suffixes=(".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pbm", ".pgm", ".ppm"),
    sniff=_sniff,
    read=_read,
    options=frozenset({"cell", "unknown", "threshold", "invert"}),
)
