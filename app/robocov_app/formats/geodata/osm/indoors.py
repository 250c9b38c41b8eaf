"""Floors of buildings: rooms, corridors, walls and doors, according to Simple Indoor Tagging."""

import re

import numpy as np

from robocov.typing import FloatArray
from robocov_app.formats.geodata.building_floor import DEFAULT_DOOR_WIDTH_M, MAX_FLOORS, FloorElement, Role
from robocov_app.formats.geodata.georeference import DEGREES, convert_to_meters
from robocov_app.formats.geodata.osm.data import OsmData, OsmElement
from robocov_app.formats.geodata.osm.geometries import parse_width, to_line, to_point, to_polygon
from robocov_app.formats.geometry.shapes.collection import Shapes, SourceGeometry

_SPACES: dict[str, Role] = {"room": "room", "corridor": "open", "area": "open"}
_STAIRS = {"stairs", "elevator", "escalator", "steps"}
"""Tag values of areas that robots cannot drive on."""
_MIN_INDOOR_FRACTION = 0.5
"""An extract is read as indoors if its spaces cover at least this fraction of the area of its buildings."""
_LEVEL_RANGE = re.compile(r"(-?\d{1,3}(?:\.\d+)?)(?:-(-?\d{1,3}(?:\.\d+)?))?")
_MIN_LENGTH_M = 1e-9


def _parse_levels(tags: dict[str, str]) -> set[float]:
    """Return the levels that an element is on, from its tags ``level`` and ``repeat_on``.

    Values are numbers, lists of them (``0;1``) and ranges (``-1-2``). An element without a level is on level
    0.
    """
    levels: set[float] = set()
    text = f"{tags.get('level', '')};{tags.get('repeat_on', '')}"
    for word in re.split(r"[;,]", text):
        match = _LEVEL_RANGE.fullmatch(word.strip())
        if match is None:
            continue
        low = float(match[1])
        high = low if match[2] is None else float(match[2])
        if low <= high < low + MAX_FLOORS:
            levels |= {low + step for step in range(int(high - low) + 1)}
    return levels or {0.0}


def _is_stairs(tags: dict[str, str]) -> bool:
    kinds = {tags.get("room"), tags.get("highway"), tags.get("indoor")}
    return bool(_STAIRS & kinds) or tags.get("stairs") == "yes"


def _choose_role(element: OsmElement) -> Role | None:
    """Return the role of an element on a floor, or None if it is not a part of the floor."""
    tags = element.tags
    indoor = tags.get("indoor", "")
    if element.kind == "node":
        if {"door", "entrance"} & tags.keys() or indoor == "door":
            return "opening"
        if indoor in ("column", "pillar"):
            return "post"
        return None
    if _is_stairs(tags) and indoor not in ("", "no"):
        return "solid"
    if indoor in ("column", "pillar") or (indoor == "wall" and tags.get("area") == "yes"):
        return "solid"
    if indoor == "wall" and element.kind == "way":
        return "wall"
    if indoor == "wall":
        return "solid"
    return _SPACES.get(indoor)


def measure_floors(data: OsmData) -> dict[float, float]:
    """Return the total area of the spaces on each level that has spaces.

    The areas serve for comparison only: they are in degrees of longitude times degrees of latitude.
    """
    floors: dict[float, float] = {}
    for element in data.elements:
        if _choose_role(element) not in ("open", "room"):
            continue
        area = _measure_area(data, element)
        for level in _parse_levels(element.tags):
            floors[level] = floors.get(level, 0.0) + area
    return {level: area for level, area in floors.items() if area > 0.0}


def _measure_area(data: OsmData, element: OsmElement) -> float:
    """Return the total area inside the ways of an element, in square degrees.

    It is exact for a single closed way, and an estimate for several ways, each of which is closed here.
    """
    area = 0.0
    for line in data.get_lines(element) or []:
        # The shoelace formula, relative to the first point.
        x, y = (line - line[0]).T
        area += abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1])) / 2
    return area


def is_indoor(data: OsmData, floors: dict[float, float]) -> bool:
    """Return whether an extract shows mostly the inside of buildings.

    Parameters
    ----------
    data : OsmData
    floors : dict of float to float
        Area of the spaces on each level, as returned by `measure_floors`.
    """
    buildings = [element for element in data.elements if element.is_building and element.kind != "node"]
    building_area = sum(_measure_area(data, building) for building in buildings)
    return max(floors.values()) >= _MIN_INDOOR_FRACTION * building_area


def list_floor_elements(data: OsmData, floor: float, shapes: Shapes) -> list[FloorElement]:
    """Return the elements of a level, in meters.

    Parameters
    ----------
    data : OsmData
    floor : float
        The level.
    shapes : Shapes
        Counts the elements that are left out, and collects notes.
    """
    roles: list[Role] = []
    geometries: list[SourceGeometry] = []
    doors: list[OsmElement] = []
    walls: list[OsmElement] = []
    stairs_count = 0
    for element in data.elements:
        role = _choose_role(element)
        if role is None or floor not in _parse_levels(element.tags):
            continue
        if role == "opening":
            doors.append(element)
            continue
        # Doors are nodes of the outlines of rooms ("room") or of walls that are drawn as lines.
        if role in ("room", "wall"):
            walls.append(element)
        if role == "solid" and _is_stairs(element.tags):
            stairs_count += 1
        geometry = _build_geometry(data, element, role, shapes)
        if geometry is not None:
            roles.append(role)
            geometries.append(geometry)
    if stairs_count:
        shapes.notes.append(f"stairs and elevators treated as solid: {stairs_count}")
    door_lines = _find_doors(data, doors, walls)
    lost_doors = len(doors) - len(door_lines)
    if lost_doors:
        shapes.count_omission("door", "in no wall of this level", lost_doors)
    # Geometries and doors are converted in one call, so that they get the same origin.
    projected = convert_to_meters([*geometries, *door_lines], shapes, DEGREES)
    shapes_in_meters = projected[: len(geometries)]
    doors_in_meters = projected[len(geometries) :]
    elements = [FloorElement(role, shape) for role, shape in zip(roles, shapes_in_meters, strict=True)]
    elements += [FloorElement("opening", _build_opening(door)) for door in doors_in_meters]
    return elements


def _build_geometry(data: OsmData, element: OsmElement, role: Role, shapes: Shapes) -> SourceGeometry | None:
    if role == "post":
        return to_point(data, element)
    if role == "wall":
        return to_line(data, element, shapes)
    return to_polygon(data, element, shapes)


def _find_doors(data: OsmData, doors: list[OsmElement], walls: list[OsmElement]) -> list[SourceGeometry]:
    """Return each door as a line of three points, in degrees.

    They are the preceding node of its wall, the door, and the following node.
    """
    neighbors = _find_neighbors({door.id for door in doors}, data, walls)
    lines = []
    for door in doors:
        if door.id not in neighbors:
            continue
        before, after = neighbors[door.id]
        line = data.get_lines(OsmElement("way", door.id, members=[before, door.id, after]))
        if line is not None:
            width = parse_width(door.tags)
            lines.append(SourceGeometry("line", (line[0],), ("door",), door.location, width=width))
    return lines


def _find_neighbors(doors: set[int], data: OsmData, walls: list[OsmElement]) -> dict[int, tuple[int, int]]:
    """Return, for each door, the nodes before and after it in the first wall that contains it."""
    neighbors: dict[int, tuple[int, int]] = {}
    for wall in walls:
        for way in data.get_ways(wall):
            nodes = [] if way is None else way.members
            for k, node_id in enumerate(nodes):
                if node_id in doors and node_id not in neighbors:
                    neighbors[node_id] = _get_adjacent_nodes(nodes, k)
    return neighbors


def _get_adjacent_nodes(nodes: list[int], k: int) -> tuple[int, int]:
    """Return the nodes before and after node `k` of a way; at an open end, the node itself."""
    is_closed = len(nodes) > 2 and nodes[0] == nodes[-1]
    if is_closed:
        # The first node is repeated at the end.
        side_count = len(nodes) - 1
        return nodes[(k - 1) % side_count], nodes[(k + 1) % side_count]
    return nodes[max(k - 1, 0)], nodes[min(k + 1, len(nodes) - 1)]


def _build_opening(door: SourceGeometry) -> SourceGeometry:
    """Return the opening of a door: a line along its wall, as long as the door is wide.

    `door` is a line as returned by `_find_doors`, converted to meters.
    """
    before, middle, after = door.rings[0]
    direction = after - before
    if not direction.any():
        # The wall turns back at the door, so its two neighbors coincide.
        direction = after - middle
    length = float(np.hypot(*direction))
    width = door.width or DEFAULT_DOOR_WIDTH_M
    half: FloatArray = direction * (width / 2 / max(length, _MIN_LENGTH_M))
    ends = np.array([middle - half, middle + half])
    return SourceGeometry("line", (ends,), door.labels, door.location)
