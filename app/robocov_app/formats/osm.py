"""OpenStreetMap extracts, in metres east and north of their middle.

Outdoors, buildings, also those that relations make up of several ways, and water (unless the option
``water`` says that it is free) are solid; walls, fences, hedges and the like are walls of their tag
``width``, or of the option ``thickness``; bollards, blocks and trees are points. The bounds are the boundary.
What is below the ground, roofs, and ways whose nodes the extract lacks are left out.

Indoors, as of https://wiki.openstreetmap.org/wiki/Simple_Indoor_Tagging, rooms, corridors and areas of one
level are free; rooms have walls, which doors open; ``indoor=wall`` is a wall; stairs and lifts are solid. The
inside is read if the option ``level`` names a floor, or if most of the buildings in the extract have one.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely

from robocov.arrays import Array
from robocov.errors import ParameterError, format_count, quote
from robocov_app.formats import files
from robocov_app.formats.building_floor import (
    DEFAULT_DOOR_WIDTH_M,
    MAX_FLOORS,
    FloorElement,
    Role,
    build_floor,
    choose_floor,
    list_floors,
)
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.shapes import BOUNDARY, Shapes, SourceGeometry
from robocov_app.formats.georeference import DEGREES, convert_to_metres
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.osm_data import OsmData, OsmElement, is_osm, read_osm

_TEXT = "Imported from OpenStreetMap, © OpenStreetMap contributors."
# barriers that are walls; gates, kerbs and chains are not
_WALLS = {"wall", "city_wall", "retaining_wall", "fence", "hedge", "guard_rail", "jersey_barrier"}
_POSTS = {"bollard", "block", "tree"}
_GATES = ("gate", "lift_gate")
_OPEN = {"no", "roof"}  # buildings that robots pass: a roof stands on posts
_METRES = re.compile(r"(\d{1,3}(?:\.\d+)?)\s*m?")
_SPACES: dict[str, Role] = {"room": "walled", "corridor": "open", "area": "open"}
_STAIRS = {"stairs", "elevator", "escalator", "steps"}  # what robots do not drive on
_MIN_INDOOR_SHARE = 0.5  # of the area of buildings, above which an extract is one of their inside
_LEVEL = re.compile(r"(-?\d{1,3}(?:\.\d+)?)(?:-(-?\d{1,3}(?:\.\d+)?))?")


def sniff(path: Path, head: bytes) -> bool:
    return is_osm(head)


def read(path: Path, options: ReadOptions) -> ForeignMap:
    data = read_osm(path)
    shapes = Shapes(data.where, options)
    shapes.notes += data.notes
    floors = _measure_floors(data)
    if options.level is not None and not floors:
        raise ParameterError(
            f"{data.where}: level: expected none, got {quote(options.level)}: no indoor spaces"
        )
    name = files.get_map_name(path)
    if floors and (options.level is not None or _is_indoor(data, floors)):
        floor = choose_floor(floors, options.level, data.where)
        if len(floors) > 1:
            shapes.notes.append(f"level {floor:g} of {list_floors(floors)} (--level)")
        return build_floor(shapes, _place_floor(data, floor, shapes), name, _TEXT)
    if floors:
        shapes.notes.append(f"indoor spaces on level {list_floors(floors)} left out (--level reads a floor)")
    return _read_outdoors(data, shapes, name)


def _read_outdoors(data: OsmData, shapes: Shapes, name: str) -> ForeignMap:
    figures = list(_find_outdoors(data, shapes))
    origin = None
    if data.bounds:
        bounds = np.array(data.bounds)
        west, south = bounds.min(axis=0)[:2].tolist()
        east, north = bounds.max(axis=0)[2:].tolist()
        origin = ((west + east) / 2, (south + north) / 2)
        corners = np.array([[west, south], [east, south], [east, north], [west, north]])
        figures.append(SourceGeometry("polygon", (corners,), (BOUNDARY,), "bounds"))
    shapes.add_all(convert_to_metres(figures, shapes, DEGREES, origin=origin))
    gates = sum(node.tags.get("barrier") in _GATES for node in data.nodes.values())
    if gates:
        shapes.notes.append(f"{format_count(gates, 'gate')} taken as closed")
    return shapes.build_foreign_map(name, _TEXT, solid=True)


def _find_outdoors(data: OsmData, shapes: Shapes) -> Iterator[SourceGeometry]:
    """Yield what stands on the ground, in degrees; tell `shapes` what is left out."""
    for element in data.elements:
        tags = element.tags
        is_building = tags.get("building", "no") not in _OPEN
        is_water = tags.get("natural") == "water" or tags.get("waterway") == "riverbank"
        is_wall = tags.get("barrier") in _WALLS
        is_post = element.kind == "node" and bool(_POSTS & {tags.get("barrier"), tags.get("natural")})
        is_wet = is_water and shapes.options.water != "free"
        if not (is_building or is_wall or is_post or is_wet):
            continue
        if _is_below_ground(tags):
            shapes.leave_out("thing", "below the ground")
        elif is_post:
            yield SourceGeometry("point", (data.point(element)[None],), element.labels, element.place)
        elif element.kind != "node":
            is_line = is_wall and not is_building and element.kind == "way" and tags.get("area") != "yes"
            figure = _to_line(data, element, shapes) if is_line else _to_polygon(data, element, shapes)
            if figure is not None:
                yield figure


def _is_below_ground(tags: dict[str, str]) -> bool:
    is_under = tags.get("location") == "underground" or tags.get("layer", "0").startswith("-")
    return is_under or tags.get("tunnel", "no") != "no"


def _to_line(data: OsmData, way: OsmElement, shapes: Shapes) -> SourceGeometry | None:
    lines = data.lines(way)
    if lines is None:
        shapes.leave_out("way", "of which the file does not have all")
        return None
    return SourceGeometry("line", (lines[0],), way.labels, way.place, width=_width(way.tags))


def _to_polygon(data: OsmData, element: OsmElement, shapes: Shapes) -> SourceGeometry | None:
    """Return the area of a way or of the ways of a relation; None, and say why, where there is none."""
    lines = data.lines(element)
    if lines is None:
        shapes.leave_out(element.kind, "of which the file does not have all")
        return None
    merged = shapely.line_merge(shapely.MultiLineString([shapely.LineString(line) for line in lines]))
    rings = [shapely.get_coordinates(part) for part in shapely.get_parts(merged)]
    if not rings:  # all nodes are at one place
        shapes.leave_out(element.kind, "without an area")
        return None
    if not all((ring[0] == ring[-1]).all() for ring in rings):
        shapes.leave_out(element.kind, "that does not close")
        return None
    return SourceGeometry("polygon", tuple(rings), element.labels, element.place, rule="evenodd")


def _width(tags: dict[str, str]) -> float | None:
    match = _METRES.fullmatch(tags.get("width", "").strip())
    return float(match[1]) if match else None


def _levels(tags: dict[str, str]) -> set[float]:
    """Return the levels that an element is on, as of its tags ``level`` and ``repeat_on``.

    Values are numbers, lists of them (``0;1``) and ranges (``-1-2``). What has no level is on level 0.
    """
    found: set[float] = set()
    for part in re.split(r"[;,]", f"{tags.get('level', '')};{tags.get('repeat_on', '')}"):
        match = _LEVEL.fullmatch(part.strip())
        if match is None:
            continue
        low = float(match[1])
        high = low if match[2] is None else float(match[2])
        if low <= high < low + MAX_FLOORS:
            found |= {low + step for step in range(int(high - low) + 1)}
    return found or {0.0}


def _is_stairs(tags: dict[str, str]) -> bool:
    return (
        bool(_STAIRS & {tags.get("room"), tags.get("highway"), tags.get("indoor")})
        or tags.get("stairs") == "yes"
    )


def _role(element: OsmElement) -> Role | None:
    """Return what an element is on a floor, None for nothing."""
    tags = element.tags
    indoor = tags.get("indoor", "")
    if element.kind == "node":
        if {"door", "entrance"} & tags.keys() or indoor == "door":
            return "opening"
        return "post" if indoor in ("column", "pillar") else None
    if _is_stairs(tags) and indoor not in ("", "no"):
        return "solid"
    if indoor in ("column", "pillar") or (indoor == "wall" and tags.get("area") == "yes"):
        return "solid"
    if indoor == "wall":
        return "wall" if element.kind == "way" else "solid"
    return _SPACES.get(indoor)


def _measure_floors(data: OsmData) -> dict[float, float]:
    """Return the levels with spaces, and the area of these in square degrees of the equator."""
    floors: dict[float, float] = {}
    for element in data.elements:
        if _role(element) not in ("open", "walled"):
            continue
        area = _measure_area(data, element)
        for level in _levels(element.tags):
            floors[level] = floors.get(level, 0.0) + area
    return {level: area for level, area in floors.items() if area > 0.0}


def _measure_area(data: OsmData, element: OsmElement) -> float:
    """Return the area within the ways of an element, which is exact for a single closed one."""
    area = 0.0
    for line in data.lines(element) or []:
        x, y = (line - line[0]).T
        area += abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1])) / 2
    return area


def _is_indoor(data: OsmData, floors: dict[float, float]) -> bool:
    """Return whether the inside of buildings is what an extract shows most of."""
    buildings = [each for each in data.elements if each.tags.get("building", "no") not in _OPEN]
    covered = sum(_measure_area(data, each) for each in buildings if each.kind != "node")
    return max(floors.values()) >= _MIN_INDOOR_SHARE * covered


def _place_floor(data: OsmData, floor: float, shapes: Shapes) -> list[FloorElement]:
    """Return the parts of a level, in metres."""
    roles: list[Role] = []
    figures: list[SourceGeometry] = []
    doors: list[OsmElement] = []
    walls: list[OsmElement] = []
    stairs = 0
    for element in data.elements:
        role = _role(element)
        if role is None or floor not in _levels(element.tags):
            continue
        if role == "opening":
            doors.append(element)
            continue
        if role in ("walled", "wall"):
            walls.append(element)
        if role == "post":
            figure: SourceGeometry | None = SourceGeometry(
                "point", (data.point(element)[None],), element.labels, element.place
            )
        elif role == "wall":
            figure = _to_line(data, element, shapes)
        else:
            figure = _to_polygon(data, element, shapes)
        stairs += role == "solid" and _is_stairs(element.tags)
        if figure is not None:
            roles.append(role)
            figures.append(figure)
    if stairs:
        shapes.notes.append(f"stairs and lifts taken as solid: {stairs}")
    door_lines = _find_doors(data, doors, walls)
    if lost := len(doors) - len(door_lines):
        shapes.leave_out("door", "in no wall of this level", lost)
    placed = convert_to_metres([*figures, *door_lines], shapes, DEGREES)
    floor_figures = [FloorElement(role, figure) for role, figure in zip(roles, placed, strict=False)]
    return floor_figures + [FloorElement("opening", _span_door(figure)) for figure in placed[len(figures) :]]


def _find_doors(data: OsmData, doors: list[OsmElement], walls: list[OsmElement]) -> list[SourceGeometry]:
    """Return doors as lines of three points, in degrees: the node before in its wall, its own, the next."""
    wanted = {door.number for door in doors}
    beside: dict[int, tuple[int, int]] = {}
    for element in walls:
        ways = [data.ways.get(k) for k in element.members] if element.kind == "relation" else [element]
        for way in ways:
            nodes = [] if way is None else way.members
            closed = len(nodes) > 2 and nodes[0] == nodes[-1]
            for k, number in enumerate(nodes):
                if number in wanted and number not in beside:
                    before = nodes[k - 1] if k > 0 else (nodes[-2] if closed else number)
                    after = nodes[k + 1] if k + 1 < len(nodes) else (nodes[1] if closed else number)
                    beside[number] = (before, after)
    lines = []
    for door in doors:
        if door.number not in beside:
            continue
        before, after = beside[door.number]
        line = data.lines(OsmElement("way", door.number, members=[before, door.number, after]))
        if line is not None:
            lines.append(SourceGeometry("line", (line[0],), ("door",), door.place, width=_width(door.tags)))
    return lines


def _span_door(figure: SourceGeometry) -> SourceGeometry:
    """Return the line across an opening, in metres, of a door as of `_find_doors`."""
    before, middle, after = figure.rings[0]
    along = after - before if (after != before).any() else after - middle
    length = float(np.hypot(*along))
    half: Array = along * ((figure.width or DEFAULT_DOOR_WIDTH_M) / 2 / max(length, 1e-9))
    return SourceGeometry("line", (np.array([middle - half, middle + half]),), figure.labels, figure.at)
