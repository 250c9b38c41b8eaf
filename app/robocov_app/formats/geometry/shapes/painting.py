"""Paint of drawings: floors among the filled shapes, and the visible parts of the shapes below them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID_M
from robocov.typing import BoolArray
from robocov_app.formats.colors import MAX_DARK_LUMINANCE, MIN_PALE_LUMINANCE, Color, compute_luminance
from robocov_app.formats.geometry.polygons import to_multipolygon, unite
from robocov_app.formats.geometry.shapes.enclosed_area import find_enclosed_area

_MIN_ROOM_SHARE = 0.5
"""A pale fill has the size of a room if its area is this fraction of the smallest evident floor's or more."""


@dataclass(frozen=True, eq=False)
class PaintLayer:
    """A painted area.

    Attributes
    ----------
    area : shapely geometry, m
    order : float
        Layers with a higher order are painted later, on top of others.
    color : Color or None
        Color on a white page, or None if it is unknown.
    """

    area: BaseGeometry
    order: float
    color: Color | None = None


def is_dark(color: Color | None) -> bool:
    """Return whether a color is known and dark."""
    return color is not None and compute_luminance(color) < MAX_DARK_LUMINANCE


def is_pale(color: Color | None) -> bool:
    """Return whether a color is known and pale."""
    return color is not None and compute_luminance(color) >= MIN_PALE_LUMINANCE


def find_evident_floors(fills: Sequence[PaintLayer], marks: Sequence[PaintLayer]) -> list[bool]:
    """Decide from the paint on filled shapes which of them are floors.

    Furniture and walls are never drawn on an obstacle. So a pale fill with darker objects on it is evidently
    a floor. If there is such a fill, all fills of its color are floors, too, and so are pale fills of the
    size of a room, because rooms often have different colors.

    Parameters
    ----------
    fills : sequence of PaintLayer
    marks : sequence of PaintLayer
        Everything that is painted; pale marks are ignored.

    Returns
    -------
    list of bool
        Whether each fill is a floor.
    """
    is_marked = _find_fills_with_marks(fills, marks)
    if not is_marked.any():
        return [False] * len(fills)
    colors = {fills[k].color for k in np.flatnonzero(is_marked).tolist()}
    sizes = shapely.area([fill.area for fill in fills])
    min_size = _MIN_ROOM_SHARE * sizes[is_marked].min()
    return [
        is_pale(fill.color) and (fill.color in colors or size >= min_size)
        for fill, size in zip(fills, sizes.tolist(), strict=True)
    ]


def _find_fills_with_marks(fills: Sequence[PaintLayer], marks: Sequence[PaintLayer]) -> BoolArray:
    """Return, for each fill, whether it is pale and has darker paint on it."""
    is_marked = np.zeros(len(fills), dtype=bool)
    darker = [mark for mark in marks if mark.color is not None and not is_pale(mark.color)]
    if not darker:
        return is_marked
    tree = shapely.STRtree([mark.area for mark in darker])
    order = np.array([mark.order for mark in darker])
    for k, fill in enumerate(fills):
        if is_pale(fill.color):
            on_fill = tree.query(fill.area, "covers")
            is_marked[k] = (order[on_fill] > fill.order).any()
    return is_marked


def uncover(solids: Sequence[PaintLayer], floors: Sequence[PaintLayer]) -> list[BaseGeometry]:
    """Return the areas of solids, m, without the floors painted on top of them."""
    if not floors:
        return [solid.area for solid in solids]
    tree = shapely.STRtree([floor.area for floor in floors])
    order = np.array([floor.order for floor in floors])
    areas = []
    for solid in solids:
        above = tree.query(solid.area, "intersects")
        above = above[order[above] > solid.order]
        area = solid.area
        if len(above):
            covers = unite([floors[k].area for k in above])
            area = shapely.difference(area, covers, grid_size=GRID_M)
        if not area.is_empty:
            areas.append(area)
    return areas


def split_alternating(areas: Sequence[BaseGeometry]) -> tuple[MultiPolygon, MultiPolygon]:
    """Split the union of areas by how many of the areas overlap.

    Returns
    -------
    odd, even : MultiPolygon, m
        What lies in an odd number of areas, and what lies in an even number of two or more.
    """
    parts = shapely.get_parts(shapely.get_parts(areas))
    rings = [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(parts)]
    odd = find_enclosed_area(rings, "evenodd").area
    whole = unite([Polygon(part.exterior) for part in parts])
    return odd, to_multipolygon(shapely.difference(whole, odd, grid_size=GRID_M))
