"""What the paint of a drawing stands for: which filled shapes are floors, and what they leave below them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import GRID
from robocov_app.formats.colours import DARK, PALE, Colour, luminance
from robocov_app.formats.geometry.polygons import enclosed, polygons_of, united


@dataclass(frozen=True, eq=False)
class Coat:
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


def find_floor_colours(fills: Sequence[Coat], marks: Sequence[Coat]) -> set[Colour]:
    """Return the pale colours of filled shapes that are floors.

    Nobody paints dark things onto a pale obstacle. So where one pale fill has something dark on it, fills of
    its colour are floors.

    Parameters
    ----------
    fills : sequence of Coat
    marks : sequence of Coat
        All that is painted; what is dark among it counts.
    """
    pale = [fill for fill in fills if is_pale(fill.colour)]
    dark = [mark for mark in marks if is_dark(mark.colour)]
    if not pale or not dark:
        return set()
    tree = shapely.STRtree([mark.area for mark in dark])
    mark_order = np.array([mark.order for mark in dark])
    found: set[Colour] = set()
    for fill in pale:
        if fill.colour is None or fill.colour in found:
            continue
        on_it = tree.query(fill.area, "covers")
        if (mark_order[on_it] > fill.order).any():
            found.add(fill.colour)
    return found


def uncover(solids: Sequence[Coat], floors: Sequence[Coat]) -> list[BaseGeometry]:
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
            covers = united([floors[k].area for k in above])
            area = shapely.difference(area, covers, grid_size=GRID)
        if not area.is_empty:
            left.append(area)
    return left


def alternate(areas: Sequence[BaseGeometry]) -> tuple[MultiPolygon, MultiPolygon]:
    """Return what lies in an odd number of areas, and what lies in some of them, but an even number."""
    parts = shapely.get_parts(shapely.get_parts(areas))
    rings = [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(parts)]
    odd, _, _ = enclosed(rings, "evenodd")
    whole = united([Polygon(part.exterior) for part in parts])
    return odd, polygons_of(shapely.difference(whole, odd, grid_size=GRID))
