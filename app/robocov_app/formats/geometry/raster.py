"""A grid of free, blocked and unknown cells, read as a foreign map."""

from __future__ import annotations

import math
from typing import Literal, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array, BoolArray
from robocov.errors import MapError
from robocov_app.formats.files import require_coordinate
from robocov_app.formats.foreign import ForeignMap, square_metres
from robocov_app.formats.geometry.tracing import traced

Cells: TypeAlias = NDArray[np.uint8]
"""`FREE`, `BLOCKED` or `UNKNOWN` for each cell, (rows, columns), the top row first as in pictures."""

FREE, BLOCKED, UNKNOWN = 0, 1, 2

RIM = 2
"""Around the known cells so many are solid where a map is cut to them."""

_TOUCHING = np.ones((3, 3), dtype=bool)
"""Known cells that touch at a corner belong together."""


def foreign_map(
    cells: Cells,
    *,
    name: str,
    description: str,
    format: str,  # noqa: A002 - as of the map
    cell: float,
    origin: tuple[float, float] = (0.0, 0.0),
    yaw: float = 0.0,
    unknown: Literal["obstacle", "free", "cut"] = "obstacle",
    called: str = "unknown",
    noise: float = 0.0,
    where: str,
    repaired: tuple[str, ...] = (),
    notes: tuple[str, ...] = (),
) -> ForeignMap:
    """Return `cells`, (rows, columns), as a map.

    `cell`, m: side of a cell. `origin`, m: lower left corner of the lower left one, about which the grid is
    turned by `yaw`, rad. `unknown`: what unknown cells are, which the report calls `called`; with ``cut`` the
    map ends around the known ones. `noise`: obstacles of fewer cells are noise. Raises MapError when no cell
    is free, or the grid is too rough or too far away.
    """
    rows, columns = cells.shape
    corners = _placed(np.array([[0, 0], [columns, 0], [columns, rows], [0, rows]], float), cell, origin, yaw)
    for value in corners.ravel().tolist():
        require_coordinate(value, f"{where}: a corner of the grid")
    number = [int(np.count_nonzero(cells == kind)) for kind in (FREE, BLOCKED, UNKNOWN)]
    told = [*notes, _counts(number, rows, columns, cell, called, unknown)]
    dropped: list[str] = []
    upward = cells[::-1]
    free = upward == FREE
    if unknown == "free":
        free |= upward == UNKNOWN
    if not free.any():
        hint = f" (--unknown free takes {called} cells as free)" if number[UNKNOWN] else ""
        raise MapError(f"{where}: no cell is free, but some were wanted{hint}")
    boundary = None
    if unknown == "cut" and number[UNKNOWN]:
        known = upward != UNKNOWN
        island, count = ndimage.label(known, structure=_TOUCHING)
        area = np.bincount(island[free], minlength=count + 1)
        main = island == int(area.argmax())
        lost = int(area.sum() - area.max())
        if lost:
            dropped.append(
                f"{square_metres(lost * cell * cell, 3)} of free space on other islands of known cells"
            )
        free &= main
        boundary = _around(main, where)
    area = _moved(_traced(free, where), cell, origin, yaw)
    return ForeignMap(
        name=name,
        description=description,
        format=format,
        free=area,
        boundary=None if boundary is None else _moved(boundary, cell, origin, yaw),
        vertices_read=vertices_of(area),
        cell=cell,
        specks=noise * cell * cell,
        repaired=repaired,
        dropped=tuple(dropped),
        notes=tuple(told),
    )


def free_area(
    free: BoolArray, cell: tuple[float, float], origin: tuple[float, float], where: str
) -> MultiPolygon:
    """Return the free cells, (rows, columns), the top row first, as polygons in metres.

    `cell`, m: width and height of one. `origin`, m: lower left corner of all. Raises MapError as
    `foreign_map`.
    """
    if not free.any():
        raise MapError(f"{where}: no cell is free, but some were wanted")
    return _moved(_traced(free[::-1], where), cell, origin, 0.0)


def vertices_of(area: MultiPolygon) -> int:
    """Return the number of vertices of polygons."""
    return int(shapely.get_num_coordinates(area)) - sum(1 + len(part.interiors) for part in area.geoms)


def _placed(
    points: Array, cell: float | tuple[float, float], origin: tuple[float, float], yaw: float
) -> Array:
    """Return (n, 2) places in the grid, in cells, in metres on the map."""
    x, y = (points * cell).T
    if yaw:
        x, y = x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)
    return np.column_stack([x + origin[0], y + origin[1]])


def _moved(
    outline: MultiPolygon, cell: float | tuple[float, float], origin: tuple[float, float], yaw: float
) -> MultiPolygon:
    """Return `outline`, in cells, in metres on the map."""
    placed: MultiPolygon = shapely.transform(outline, lambda points: _placed(points, cell, origin, yaw))
    return placed


def _traced(cells: BoolArray, where: str) -> MultiPolygon:
    """Return the outline of the cells; only the part of the grid that they fill is looked at."""
    row, column = np.flatnonzero(cells.any(axis=1)), np.flatnonzero(cells.any(axis=0))
    corner = np.array([column[0], row[0]], float)
    part = traced(cells[row[0] : row[-1] + 1, column[0] : column[-1] + 1], where)
    outline: MultiPolygon = shapely.transform(part, lambda points: points + corner)
    return outline


def _around(known: BoolArray, where: str) -> Polygon:
    """Return the outline of the known cells and a rim, without holes, in cells."""
    wide = ndimage.binary_dilation(np.pad(known, RIM), structure=_TOUCHING, iterations=RIM)
    (part,) = _traced(wide, where).geoms
    outline: Polygon = shapely.transform(Polygon(part.exterior), lambda points: points - RIM)
    return outline


def _counts(number: list[int], rows: int, columns: int, cell: float, called: str, unknown: str) -> str:
    """Return what cells there are, in words."""
    total = rows * columns
    words = f"{columns} x {rows} cells of {cell:.6g} m: {_share(number[FREE], total)} free"
    words += f", {_share(number[BLOCKED], total)} blocked"
    if number[UNKNOWN]:
        taken = {"obstacle": "taken as obstacles", "free": "taken as free", "cut": "cut away"}[unknown]
        words += f", {_share(number[UNKNOWN], total)} {called}, {taken}"
    return words


def _share(number: int, total: int) -> str:
    """Return a part of the cells in per cent, never rounded to none or all.

    >>> _share(1, 100_000), _share(500, 1000)
    ('<0.1 %', '50 %')
    """
    share = 100 * number / total
    if 0.0 < share < 0.1:
        return "<0.1 %"
    if 99.9 < share < 100.0:
        return ">99.9 %"
    return f"{share:.3g} %"
