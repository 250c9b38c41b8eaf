"""A floor of a building: spaces, their walls, and the openings that join them, as free space.

OpenStreetMap's indoor tags and IMDF both describe a floor by the areas of its rooms and corridors. A wall
runs along the outline of each space that has walls, and ends at the openings: where two spaces have one edge
in common, and where the file leaves out the wall between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
import shapely
from shapely import MultiPolygon
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array
from robocov.errors import MapError, ParameterError, format_count, quote
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.crossings import CrossingCounter
from robocov_app.formats.geometry.enclosed_area import find_enclosed_area
from robocov_app.formats.geometry.polygons import to_multipolygon, unite
from robocov_app.formats.geometry.shapes import Shapes, SourceGeometry, WallLine
from robocov_app.formats.geometry.snapping import close_gaps, compute_default_snap

Role: TypeAlias = Literal["open", "walled", "solid", "wall", "opening", "post"]
DOOR_WIDTH_M = 0.9  # of a door without a width
REACH_M = 0.4  # an opening joins spaces, and cuts walls, so far on both of its sides
MAX_FLOORS = 200  # floors of a building, and floors that one element may be on
_MIN_WALL_M = 1e-6  # shorter pieces of wall are left by rounding


@dataclass(frozen=True, eq=False)
class IndoorFigure:
    """A part of a floor.

    Attributes
    ----------
    role : str
        ``open`` and ``walled`` spaces are free, with walls along the outline of the latter; ``solid`` areas,
        ``wall`` lines and ``post`` points are obstacles; an ``opening`` is a line of two points, as wide as
        the door.
    figure : Figure
        Its geometry, in metres.
    """

    role: Role
    figure: SourceGeometry


def choose_floor(floors: dict[float, float], asked: str | None, where: str) -> float:
    """Return the number of a floor.

    Parameters
    ----------
    floors : dict of float to float
        Area of the spaces on each floor, by its number.
    asked : str or None
        Number that the user gave. None stands for the ground floor, or else the floor that is nearest to it.
    where : str
        What messages call the file.

    Raises
    ------
    ParameterError
        When there is no such floor.
    """
    if asked is None:
        return min(floors, key=lambda floor: (abs(floor), -floor))
    try:
        number = float(asked)
    except ValueError:
        number = float("nan")
    if number not in floors:
        known = list_floors(floors)
        raise ParameterError(f"{where}: level: expected one of {known}, got {quote(asked)}")
    return number


def list_floors(floors: Sequence[float] | dict[float, float], limit: int = 20) -> str:
    """Return the numbers of floors in words, the lowest first."""
    numbers = [f"{floor:g}" for floor in sorted(floors)]
    more = f" and {len(numbers) - limit} more" if len(numbers) > limit else ""
    return ", ".join(numbers[:limit]) + more


def build_floor(shapes: Shapes, figures: Sequence[IndoorFigure], name: str, text: str) -> ForeignMap:
    """Return the map of a floor.

    Where no opening is known at all, nothing would be connected: then spaces are open to what they adjoin.

    Raises
    ------
    MapError
        When there is no space with an area, or there are too many shapes.
    """
    wanted = [each for each in figures if shapes.accept(each.figure.labels)]
    openings = [each.figure for each in wanted if each.role == "opening"]
    spaces: list[MultiPolygon] = []
    outlines: list[BaseGeometry] = []
    walled = 0
    for each in wanted:
        if each.role not in ("open", "walled"):
            continue
        area = _area(each.figure, shapes)
        if area.is_empty:
            shapes.leave_out("space", "without an area")
            continue
        spaces.append(area)
        if each.role == "walled":
            walled += 1
            outlines += shapely.get_rings(shapely.get_parts(area)).tolist()
    if not spaces:
        raise MapError(f"{shapes.where}: expected spaces with an area on this level, got none")
    if not openings and walled:
        is_one = "a room is" if walled == 1 else f"{walled} rooms are"
        shapes.notes.append(f"no door or opening on this level: {is_one} open to what adjoins")
        outlines = []
    edges = [*(edge for space in spaces for edge in shapely.get_rings(shapely.get_parts(space))), *outlines]
    CrossingCounter(shapes.where).add(edges)
    gaps = [_opening_area(figure) for figure in openings]
    snap = compute_default_snap(spaces) if shapes.options.snap is None else shapes.options.snap
    joined = close_gaps(spaces, snap)
    floor = _join(joined.area, gaps, shapes)
    outer_walls = [wall.figure.rings[0] for wall in wanted if wall.role == "wall"]
    for line in _cut_walls([*outlines, *map(shapely.LineString, filter(_has_length, outer_walls))], gaps):
        shapes.add_line(WallLine(line, shapes.thickness, ("wall",)))
    shapes.join_lines()
    _add_obstacles(shapes, wanted, floor)
    shapes.notes.append(f"{format_count(len(spaces), 'space')}, {format_count(len(openings), 'opening')}")
    foreign = shapes.build_foreign_map(name, text, solid=True, world=floor)
    if joined.number:
        return replace(foreign, repaired=(*foreign.repaired, joined.describe()))
    return foreign


def _area(figure: SourceGeometry, shapes: Shapes) -> MultiPolygon:
    shapes.count_vertices(sum(map(len, figure.rings)))
    rings = [np.round(ring, 6) for ring in figure.rings]
    return find_enclosed_area(rings, figure.rule, CrossingCounter(shapes.where)).area


def _has_length(line: Array) -> bool:
    return bool((line[1:] != line[:-1]).any())


def _opening_area(figure: SourceGeometry) -> BaseGeometry:
    """Return the rectangle around an opening within which it cuts walls; empty for one without a width."""
    line = figure.rings[0]
    if not _has_length(line):
        return MultiPolygon()
    return shapely.LineString(line).buffer(REACH_M, cap_style="flat", join_style="mitre")


def _join(floor: MultiPolygon, gaps: list[BaseGeometry], shapes: Shapes) -> MultiPolygon:
    """Return the area of all spaces with a passage through each opening where a wall is between them."""
    tree = shapely.STRtree(list(floor.geoms))
    passages = []
    for gap in gaps:
        parts = [floor.geoms[k] for k in tree.query(gap, predicate="intersects").tolist()]
        if not parts:
            shapes.leave_out("opening", "that adjoins no space")
            continue
        inside = to_multipolygon(shapely.intersection(shapely.MultiPolygon(parts), gap))
        if len(inside.geoms) > 1:
            passages.append(gap)
    if not passages:
        return floor
    return to_multipolygon(unite([*floor.geoms, *passages]))


def _cut_walls(walls: list[BaseGeometry], gaps: list[BaseGeometry]) -> list[Array]:
    """Return the lines of walls, each once, without their parts in openings."""
    if not walls:
        return []
    lines = shapely.union_all(walls)
    if gaps:
        lines = shapely.difference(lines, shapely.union_all(gaps))
    merged = shapely.line_merge(lines)
    return [shapely.get_coordinates(part) for part in shapely.get_parts(merged) if part.length > _MIN_WALL_M]


def _add_obstacles(shapes: Shapes, figures: list[IndoorFigure], floor: MultiPolygon) -> None:
    shapely.prepare(floor)
    for each in figures:
        figure = each.figure
        if each.role == "post":
            shapes.add_point(figure.rings[0][0], figure.labels, at=figure.at)
        elif each.role == "solid":
            # most of them stand between the spaces, where nothing is free anyway
            area = _area(figure, shapes)
            if not area.is_empty and shapely.relate_pattern(floor, area, "T********"):
                shapes.add_outline(figure.rings, figure.labels, rule=figure.rule, at=figure.at)
