"""A foreign map as its reader understood it: what is free, and nothing cleaned yet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from shapely import MultiPolygon, Polygon

if TYPE_CHECKING:
    from robocov_app.importers.primitives import Primitive


@dataclass(frozen=True, eq=False)
class ForeignMap:
    """What a reader found in a file. Readers only read: `robocov_app.importers.shaping` cleans.

    Attributes
    ----------
    name : str
        The map's name, for people: from the file where it has one, else the file's stem.
    description : str
        A sentence about it.
    format : str
        Name of its format, as in `robocov_app.importers.IMPORTERS`.
    free : MultiPolygon, m
        What is free, y up. May be invalid (rings that cross themselves or each other), empty, of
        many parts, and may stick out of `boundary`: nothing is cleaned yet.
    boundary : Polygon or None, m
        The outer boundary where the format gives one; what is inside of it and not free becomes
        obstacles. Without it the outline of the free space is the boundary.
    vertices_read : int
        Vertices in the file; of a raster, corners of the outline of its free cells.
    cell : float or None, m
        Side of a cell, of rasters; of cells that are no squares the longer one.
    specks : float, m²
        Smaller obstacles are noise of how such maps are made, unless somebody says otherwise.
    cut_corners : bool
        Whether corners are cut by a step or two of a grid: simplifying then makes them whole, as
        `robocov_app.importers.corners` does.
    primitives : tuple of CircleObstacle and WallObstacle
        Obstacles that the file draws as such, with their names: they are not in `free`, and are kept instead
        of the polygons that they cover where nothing speaks against it.
    robots : (n, 2) m
        Where the file places robots.
    repaired, dropped, notes : tuple of str
        What the reader had to put right, what it left out, and what is worth knowing besides (how
        unknown cells were taken, say): one line each, with counts and areas.
    """

    name: str
    description: str
    format: str
    free: MultiPolygon
    boundary: Polygon | None = None
    vertices_read: int = 0
    cell: float | None = None
    specks: float = 0.0
    cut_corners: bool = False
    primitives: tuple[Primitive, ...] = ()
    robots: tuple[tuple[float, float], ...] = ()
    repaired: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
