"""The free space of one floor of a building: spaces, their walls, and the openings between them.

OpenStreetMap's indoor tags and IMDF both describe a floor by the areas of its rooms and corridors. A wall
runs along the outline of each space that has walls, and is interrupted by the openings. Two adjacent spaces
may share an edge, or the file may leave a gap for the wall between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np
import shapely
from shapely import MultiPolygon
from shapely.geometry.base import BaseGeometry

from robocov.errors import MapError, ParameterError, format_count, quote
from robocov.typing import FloatArray
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.crossings import CrossingCounter
from robocov_app.formats.geometry.polygons import to_multipolygon, unite
from robocov_app.formats.geometry.shapes.collection import Shapes, SourceGeometry, WallLine
from robocov_app.formats.geometry.shapes.enclosed_area import find_enclosed_area
from robocov_app.formats.geometry.shapes.snapping import close_gaps, compute_default_snap

Role: TypeAlias = Literal["open", "room", "solid", "wall", "opening", "post"]
DEFAULT_DOOR_WIDTH_M = 0.9
OPENING_REACH_M = 0.4
"""Distance to which an opening joins spaces and cuts walls on each side of its line."""
MAX_FLOORS = 200
"""Maximum number of floors that a range of levels of one element may span."""
_MIN_WALL_M = 1e-6
"""Shorter pieces of walls are rounding errors."""
_INTERIORS_INTERSECT = "T********"
"""DE-9IM pattern of two areas whose interiors overlap."""


@dataclass(frozen=True, eq=False)
class FloorElement:
    """An element of a floor.

    Attributes
    ----------
    role : str
        ``open`` spaces and ``room`` spaces are free, and rooms have walls along their outlines; ``solid``
        areas, ``wall`` lines and ``post`` points are obstacles; an ``opening`` is a line of two points, as
        wide as the door.
    geometry : SourceGeometry
        Its geometry, in meters.
    """

    role: Role
    geometry: SourceGeometry


def choose_floor(floors: dict[float, float], requested: str | None, source_name: str) -> float:
    """Return the number of the floor to be read.

    Parameters
    ----------
    floors : dict of float to float
        Total area of the spaces on each floor, keyed by its number.
    requested : str or None
        Number that the user gave. With None, it is the floor nearest to the ground floor, 0.
    source_name : str
        Name of the file for messages.

    Raises
    ------
    ParameterError
        If there is no such floor.
    """
    if requested is None:
        # Of two floors at the same distance, the upper one.
        return min(floors, key=lambda floor: (abs(floor), -floor))
    try:
        number = float(requested)
    except ValueError:
        number = float("nan")
    if number not in floors:
        known = list_floors(floors)
        raise ParameterError(f"{source_name}: level: expected one of {known}, got {quote(requested)}")
    return number


def list_floors(floors: Sequence[float] | dict[float, float], limit: int = 20) -> str:
    """Return the numbers of floors as text, the lowest first, at most `limit` of them."""
    numbers = [f"{floor:g}" for floor in sorted(floors)]
    more = f" and {len(numbers) - limit} more" if len(numbers) > limit else ""
    return ", ".join(numbers[:limit]) + more


@dataclass
class _Spaces:
    """The spaces of a floor.

    Attributes
    ----------
    areas : list of MultiPolygon, m
    outlines : list of geometry, m
        Outlines of those spaces that have walls.
    walled : int
        Number of spaces that have walls.
    """

    areas: list[MultiPolygon] = field(default_factory=list)
    outlines: list[BaseGeometry] = field(default_factory=list)
    walled: int = 0


def build_floor(shapes: Shapes, elements: Sequence[FloorElement], name: str, description: str) -> ForeignMap:
    """Build the map of a floor from its spaces, walls, openings and obstacles.

    If the floor has no opening at all, its rooms get no walls, because they would all be disconnected.

    Parameters
    ----------
    shapes : Shapes
        Contains the options, and collects the walls, obstacles and notes.
    elements : sequence of FloorElement
    name, description : str
        Name and description of the map.

    Raises
    ------
    MapError
        If there is no space with an area, or if there are too many shapes.
    """
    elements = [element for element in elements if shapes.accept(element.geometry.labels)]
    openings = [element.geometry for element in elements if element.role == "opening"]
    spaces = _collect_spaces(elements, shapes)
    if not spaces.areas:
        raise MapError(f"{shapes.source_name}: expected spaces with an area on this level, got none")
    if not openings and spaces.walled:
        rooms = "a room is" if spaces.walled == 1 else f"{spaces.walled} rooms are"
        shapes.notes.append(f"no door or opening on this level: {rooms} open to adjacent spaces")
        spaces.outlines = []
    edges = [ring for area in spaces.areas for ring in _get_rings(area)]
    CrossingCounter(shapes.source_name).add([*edges, *spaces.outlines])
    gaps = [_compute_opening_area(opening) for opening in openings]
    snap = shapes.options.snap
    if snap is None:
        snap = compute_default_snap(spaces.areas)
    joined = close_gaps(spaces.areas, snap)
    floor = _add_passages(joined.area, gaps, shapes)
    walls = [*spaces.outlines, *_list_wall_lines(elements)]
    for line in _cut_walls(walls, gaps):
        shapes.add_line(WallLine(line, shapes.thickness, ("wall",)))
    shapes.join_lines()
    _add_obstacles(shapes, elements, floor)
    space_count = format_count(len(spaces.areas), "space")
    shapes.notes.append(f"{space_count}, {format_count(len(openings), 'opening')}")
    foreign = shapes.build_foreign_map(name, description, solid=True, world=floor)
    if joined.number:
        return replace(foreign, repaired=(*foreign.repaired, joined.describe()))
    return foreign


def _collect_spaces(elements: Sequence[FloorElement], shapes: Shapes) -> _Spaces:
    """Return the spaces among the elements of a floor; those without an area are counted as left out."""
    spaces = _Spaces()
    for element in elements:
        if element.role not in ("open", "room"):
            continue
        area = _compute_area(element.geometry, shapes)
        if area.is_empty:
            shapes.count_omission("space", "without an area")
            continue
        spaces.areas.append(area)
        if element.role == "room":
            spaces.walled += 1
            spaces.outlines += _get_rings(area)
    return spaces


def _get_rings(area: MultiPolygon) -> list[BaseGeometry]:
    rings: list[BaseGeometry] = shapely.get_rings(shapely.get_parts(area)).tolist()
    return rings


def _compute_area(geometry: SourceGeometry, shapes: Shapes) -> MultiPolygon:
    shapes.count_vertices(sum(map(len, geometry.rings)))
    rings = [np.round(ring, 6) for ring in geometry.rings]
    return find_enclosed_area(rings, geometry.rule, CrossingCounter(shapes.source_name)).area


def _has_length(line: FloatArray) -> bool:
    return bool((line[1:] != line[:-1]).any())


def _list_wall_lines(elements: Sequence[FloorElement]) -> list[BaseGeometry]:
    """Return the walls that the file draws as lines."""
    lines = [element.geometry.rings[0] for element in elements if element.role == "wall"]
    return [shapely.LineString(line) for line in lines if _has_length(line)]


def _compute_opening_area(opening: SourceGeometry) -> BaseGeometry:
    """Return the rectangle in which an opening cuts walls; empty if the opening has no width."""
    line = opening.rings[0]
    if not _has_length(line):
        return MultiPolygon()
    return shapely.LineString(line).buffer(OPENING_REACH_M, cap_style="flat", join_style="mitre")


def _add_passages(floor: MultiPolygon, gaps: list[BaseGeometry], shapes: Shapes) -> MultiPolygon:
    """Add a passage to the area of all spaces for each opening between spaces that do not touch."""
    tree = shapely.STRtree(list(floor.geoms))
    passages = []
    for gap in gaps:
        neighbors = [floor.geoms[k] for k in tree.query(gap, predicate="intersects").tolist()]
        if not neighbors:
            shapes.count_omission("opening", "that adjoins no space")
            continue
        free_area = to_multipolygon(shapely.intersection(shapely.MultiPolygon(neighbors), gap))
        # Several parts: the file leaves a gap for the wall, which the passage bridges.
        if len(free_area.geoms) > 1:
            passages.append(gap)
    if not passages:
        return floor
    return to_multipolygon(unite([*floor.geoms, *passages]))


def _cut_walls(walls: list[BaseGeometry], gaps: list[BaseGeometry]) -> list[FloatArray]:
    """Return the lines of walls, (k, 2) m each, without duplicates and without their sections in openings."""
    if not walls:
        return []
    lines = shapely.union_all(walls)
    if gaps:
        lines = shapely.difference(lines, shapely.union_all(gaps))
    pieces = shapely.get_parts(shapely.line_merge(lines))
    return [shapely.get_coordinates(piece) for piece in pieces if piece.length > _MIN_WALL_M]


def _add_obstacles(shapes: Shapes, elements: Sequence[FloorElement], floor: MultiPolygon) -> None:
    """Add the posts, and the solid areas that overlap a space; the others are not free anyway."""
    shapely.prepare(floor)
    for element in elements:
        geometry = element.geometry
        if element.role == "post":
            shapes.add_point(geometry.rings[0][0], geometry.labels, location=geometry.location)
        elif element.role == "solid":
            area = _compute_area(geometry, shapes)
            if not area.is_empty and shapely.relate_pattern(floor, area, _INTERIORS_INTERSECT):
                shapes.add_outline(
                    geometry.rings, geometry.labels, rule=geometry.rule, location=geometry.location
                )
