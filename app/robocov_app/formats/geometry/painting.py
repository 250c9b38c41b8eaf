"""What the paint of a drawing stands for: which filled shapes are floors, and what they leave below them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID_M
from robocov_app.formats.colours import DARK, PALE, Colour, luminance
from robocov_app.formats.geometry.polygons import find_enclosed_area, to_multipolygon, unite

_ROOM_SHARE = 0.5  # of the smallest fill with something on it: the size of a room


@dataclass(frozen=True, eq=False)
class PaintLayer:
    """Something that is painted.

    Attributes
    ----------
    area : shapely geometry, m
    order : float
        Higher is painted later, above what is lower.
    colour : Colour or None
        As it is seen on white; None where it is not known.
    """

    area: BaseGeometry
    order: float
    colour: Colour | None = None


def is_dark(colour: Colour | None) -> bool:
    return colour is not None and luminance(colour) < DARK


def is_pale(colour: Colour | None) -> bool:
    return colour is not None and luminance(colour) >= PALE


def find_evident_floors(fills: Sequence[PaintLayer], marks: Sequence[PaintLayer]) -> list[bool]:
    """Return which filled shapes are floors by what is painted on them.

    Nobody paints furniture and walls onto a pale obstacle. So where one pale fill has something darker on it,
    fills of its colour are floors, and pale ones of the size of a room are, too: rooms often have different
    colours.

    Parameters
    ----------
    fills : sequence of Coat
    marks : sequence of Coat
        All that is painted; what is not pale among it counts.
    """
    evident = _find_marked(fills, marks)
    if not evident.any():
        return [False] * len(fills)
    colours = {fills[k].colour for k in np.flatnonzero(evident).tolist()}
    sizes = shapely.area([fill.area for fill in fills])
    room = _ROOM_SHARE * sizes[evident].min()
    return [
        is_pale(fill.colour) and (fill.colour in colours or size >= room)
        for fill, size in zip(fills, sizes.tolist(), strict=True)
    ]


def _find_marked(fills: Sequence[PaintLayer], marks: Sequence[PaintLayer]) -> NDArray[np.bool_]:
    """Return which fills are pale and have something on them that is not."""
    found = np.zeros(len(fills), dtype=bool)
    darker = [mark for mark in marks if mark.colour is not None and not is_pale(mark.colour)]
    if not darker:
        return found
    tree = shapely.STRtree([mark.area for mark in darker])
    order = np.array([mark.order for mark in darker])
    for k, fill in enumerate(fills):
        if is_pale(fill.colour):
            on_it = tree.query(fill.area, "covers")
            found[k] = (order[on_it] > fill.order).any()
    return found


def uncover(solids: Sequence[PaintLayer], floors: Sequence[PaintLayer]) -> list[BaseGeometry]:
    """Return solids without the floors that are painted above them."""
    if not floors:
        return [solid.area for solid in solids]
    tree = shapely.STRtree([floor.area for floor in floors])
    order = np.array([floor.order for floor in floors])
    left = []
    for solid in solids:
        above = tree.query(solid.area, "intersects")
        above = above[order[above] > solid.order]
        area = solid.area
        if len(above):
            covers = unite([floors[k].area for k in above])
            area = shapely.difference(area, covers, grid_size=GRID_M)
        if not area.is_empty:
            left.append(area)
    return left


def alternate(areas: Sequence[BaseGeometry]) -> tuple[MultiPolygon, MultiPolygon]:
    """Return what lies in an odd number of areas, and what lies in some of them, but an even number."""
    parts = shapely.get_parts(shapely.get_parts(areas))
    rings = [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(parts)]
    odd, _, _ = find_enclosed_area(rings, "evenodd")
    whole = unite([Polygon(part.exterior) for part in parts])
    return odd, to_multipolygon(shapely.difference(whole, odd, grid_size=GRID_M))
