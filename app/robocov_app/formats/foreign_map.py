"""The content of a foreign map file, before it becomes an environment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.density import Density
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
    """The content of a foreign file as it was read, before `geometry.conversion` cleans it.

    Attributes
    ----------
    name, description : str
        Name and description of the map.
    free : MultiPolygon, m
        Free space, with the y axis up. It may be invalid or empty, and may extend beyond `boundary`.
    format : str
        Name of the format.
    boundary : Polygon or MultiPolygon or None, m
        Outer boundary. Everything inside that is not free becomes an obstacle. If it is None, or if walls
        separate it from the free space, the outline of the free space becomes the boundary.
    has_named_boundary : bool
        Whether the file itself marks a shape as the boundary, which is kept even if walls separate it from
        the free space.
    boundary_source : str
        Description of where the boundary comes from, for the report.
    vertices_read : int
        Number of vertices in the file. For a raster: number of corners of the outline of its free cells.
    cell : float or None, m
        Longer side of a raster's cells.
    specks : float, m²
        Area below which obstacles are noise of the sensor or of the compression.
    cut_corners : bool
        Whether corners are cut off by a step or two of a grid; `geometry.cells.corners` restores them.
    primitives : tuple of Primitive
        Circles and walls in the file, outside `free`. They replace the polygons that they cover where that
        does not change the map.
    robots : tuple of (x, y), m
        Positions of the robots in the file.
    density : Density or None
        Density of the file, in the coordinates of the map.
    repaired, dropped, notes : tuple of str
        Lines of the import report.
    page : Polygon or None, m
        Page of a drawing, or outline of a picture.
    painted : tuple of Painted
        Colored shapes of a drawing, from bottom to top.
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
    density: Density | None = None
    repaired: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    page: Polygon | None = None
    painted: tuple[Painted, ...] = ()
    thumbnail: Thumbnail | None = None
