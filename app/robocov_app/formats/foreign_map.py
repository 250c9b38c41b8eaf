"""The content of a foreign map file, before it becomes an environment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import CircleObstacle, WallObstacle
from robocov_app.formats.colors import Color

Primitive: TypeAlias = CircleObstacle | WallObstacle


@dataclass(frozen=True, eq=False)
class Painted:
    """A colored shape of a drawing.

    Attributes
    ----------
    area : geometry, m
    color : tuple of 3 int
        Red, green and blue, mixed with white if the shape is translucent.
    """

    area: BaseGeometry
    color: Color


@dataclass(frozen=True, eq=False)
class Thumbnail:
    """A reduced picture in its colors.

    Attributes
    ----------
    pixels : (rows, columns, 3) array of uint8
        The top row first.
    bounds : tuple of 4 float, m
        Lower left and upper right corner.
    """

    pixels: NDArray[np.uint8]
    bounds: tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class ForeignMap:
    """The content of a foreign file as it was read; `geometry.conversion` cleans it.

    Attributes
    ----------
    name, description : str
        Name and description of the map.
    free : MultiPolygon, m
        Free space, y up. It may be invalid, empty, in several parts, and extend beyond `boundary`.
    format : str
        Name of the format.
    boundary : Polygon or MultiPolygon or None, m
        Outer boundary. Everything in it that is not free becomes an obstacle. Without it, or if walls
        separate the free space from it, the outline of the free space is the boundary.
    has_named_boundary : bool
        Whether the file names the boundary, which is then kept even if walls separate it.
    boundary_source : str
        Description of where the boundary comes from, for the report.
    vertices_read : int
        Number of vertices; of a raster, corners of the outline of its free cells.
    cell : float or None, m
        Longer side of a cell of a raster.
    specks : float, m²
        Smaller obstacles are noise of the sensors or the compression by which such maps are made.
    cut_corners : bool
        Whether corners are cut by a step or two of a grid; `geometry.cells.corners` completes them.
    primitives : tuple of Primitive
        Obstacles that the file draws as such, not in `free`. They are kept instead of the polygons that they
        cover if nothing contradicts it.
    robots : tuple of (x, y), m
        Positions of robots in the file.
    repaired, dropped, notes : tuple of str
        Lines of the report, with counts.
    page : Polygon or None, m
        Page of a drawing, or frame of a picture.
    painted : tuple of Painted
        Colored shapes of a drawing, the lowest first.
    thumbnail : Thumbnail or None
        The picture that the map was read from.
    """

    name: str
    description: str
    free: MultiPolygon
    format: str = ""
    boundary: Polygon | MultiPolygon | None = None
    has_named_boundary: bool = False
    boundary_source: str = ""
    vertices_read: int = 0
    cell: float | None = None
    specks: float = 0.0
    cut_corners: bool = False
    primitives: tuple[Primitive, ...] = ()
    robots: tuple[tuple[float, float], ...] = ()
    repaired: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    page: Polygon | None = None
    painted: tuple[Painted, ...] = ()
    thumbnail: Thumbnail | None = None
