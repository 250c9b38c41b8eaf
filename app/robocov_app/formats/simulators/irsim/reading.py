"""Worlds of the simulator IR-SIM: https://ir-sim.readthedocs.io/en/stable/yaml_config/configuration.html.

The YAML file contains the size of the ``world``, optionally a picture of it, and groups of ``robot`` and
``obstacle``. A group is a number of objects with a shape, at given states [x, y, theta] or distributed.

Obstacles are placed at their initial state, even if they move; lines become walls with the width of the
option ``thickness``. Objects that collide with nothing, have random shapes or are distributed at random are
left out and counted. The positions of robots become starts.
"""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.errors import format_count, to_one_line
from robocov.typing import FloatArray
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.cells.vectorize import count_polygon_vertices, outline_free_cells
from robocov_app.formats.geometry.frames import build_frame
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.simulators.irsim.node import Node
from robocov_app.formats.simulators.irsim.obstacle_map import read_obstacle_map
from robocov_app.formats.simulators.irsim.shape_reader import ShapeReader

MAX_OBJECTS = 4_000
"""Maximum number of robots and obstacles of a world."""
_DEFAULT_SIDE_M = 10.0
"""Default width and height of a world."""
_CIRCLE_MARGIN_M = 0.5
"""Default distance between the edge of the world and the circle on which objects are distributed."""
_WORLD = re.compile(rb"^(?:world|obstacle)[ \t]*:", re.MULTILINE)
_Item = TypeVar("_Item")


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return path.suffix.lower() in (".yaml", ".yml") and _WORLD.search(head) is not None


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a world with its robots and obstacles.

    Raises
    ------
    MapError
        If the file is damaged, too large, or contains no map.
    """
    source_name = to_one_line(path)
    shapes = Shapes(source_name, options)
    root = Node(
        files.parse_yaml(files.read_content(path, files.MAX_YAML_BYTES), source_name), f"{source_name}: "
    )
    world = root["world"]
    width = world["width"].parse_length(_DEFAULT_SIDE_M)
    height = world["height"].parse_length(_DEFAULT_SIDE_M)
    size = np.array([width, height])
    corner = world["offset"].parse_numbers([0.0, 0.0])[:2]
    free = _read_free_space(world, path, shapes, corner, size)
    groups = _GroupReader(shapes, corner, size)
    for kind in ("robot", "obstacle"):
        for group in root[kind].list_items(allow_single=True):
            groups.add(kind, group)
    shapes.notes += groups.describe_moving()
    name = world["name"].get_text() or path.stem
    return shapes.build_foreign_map(name, "A world of IR-SIM, imported.", solid=True, world=free)


def _read_free_space(
    world: Node, path: Path, shapes: Shapes, corner: FloatArray, size: FloatArray
) -> MultiPolygon:
    """Return the free space of the world without its obstacles: a rectangle, or the light part of a picture.

    Parameters
    ----------
    world : Node
    path : Path
        File of the world.
    shapes : Shapes
    corner, size : (2,) arrays, m
        Lower left corner of the world, and its width and height.
    """
    if not world["obstacle_map"].is_given:
        return MultiPolygon([shapely.box(*corner, *(corner + size))])
    is_free = read_obstacle_map(world, path, shapes)
    rows, columns = is_free.shape
    width, height = (size / [columns, rows]).tolist()
    x, y = corner.tolist()
    free = outline_free_cells(is_free, (width, height), (x, y), shapes.source_name)
    shapes.cell = max(width, height)
    shapes.count_vertices(count_polygon_vertices(free))
    return free


class _GroupReader:
    """Adds groups of robots and obstacles to a collection of shapes.

    Parameters
    ----------
    shapes : Shapes
    corner, size : (2,) arrays, m
        Lower left corner of the world, and its width and height.
    """

    def __init__(self, shapes: Shapes, corner: FloatArray, size: FloatArray) -> None:
        self._shapes = shapes
        self._center = corner + size / 2
        self._radius = float(size.min() / 2 - _CIRCLE_MARGIN_M)
        self._shape_reader = ShapeReader(shapes)
        self._object_count = 0
        self._moving_count = 0

    def add(self, kind: str, group: Node) -> None:
        """Add a group of robots or obstacles; raise MapError if a value is invalid."""
        number = max(int(group["number"].parse_number(1.0)), 0)
        self._object_count += number
        if self._object_count > MAX_OBJECTS:
            group["number"].raise_error(f"a number of at most {MAX_OBJECTS} in total")
        states = self._parse_states(group, number)
        if states is None:
            if number > 0:
                self._shapes.count_omission(kind, "that IR-SIM places at random", number)
            return
        names = group["name"].list_items(allow_single=True)
        for k in range(number):
            name = _get_item(names, k).get_text() if names else ""
            labels = tuple(label for label in (name, group["group_name"].get_text()) if label)
            x, y, angle = _get_item(states, k)[:3]
            if kind == "robot":
                self._shapes.robots.append((float(x), float(y)))
            elif self._shapes.accept(labels):
                self._add_obstacle(group, k, build_frame(x, y, angle), labels)

    def describe_moving(self) -> list[str]:
        """Return a note about obstacles that move in IR-SIM, if there are any."""
        if not self._moving_count:
            return []
        obstacles = format_count(self._moving_count, "obstacle")
        return [f"{obstacles} with kinematics treated as fixed at their initial positions"]

    def _add_obstacle(self, group: Node, k: int, frame: FloatArray, labels: tuple[str, ...]) -> None:
        """Add obstacle k of a group; `frame` is the (3, 3) transform from its frame to meters."""
        if group["unobstructed"].is_true():
            self._shapes.count_omission("obstacle", "that nothing collides with")
            return
        # Without a shape, the node that is not given stands for a shape with default values.
        candidates = group["shape"].list_items(allow_single=True) or [group["shape"]]
        shape = _get_item(candidates, k)
        # Obstacles of random shape are left out.
        if group["kinematics"].is_given and not shape["random_shape"].is_true():
            self._moving_count += 1
        self._shape_reader.add(shape, frame, labels)

    def _parse_states(self, group: Node, number: int) -> list[FloatArray] | None:
        """Return the states [x, y, theta] of a group, or None if they are random.

        There may be fewer states than objects: see `_get_item`.
        """
        distribution = group["distribution"]
        name = distribution["name"].get_text("manual")
        if name == "random":
            return None
        if name == "circle":
            return self._compute_states_on_circle(distribution, number)
        if name != "manual":
            distribution["name"].raise_error("manual, circle or random")
        states = group["state"].list_items()
        is_nested = bool(states) and isinstance(states[0].value, list)
        if not is_nested:
            states = [group["state"]]
        return [state.parse_numbers([1.0, 1.0, 0.0]) for state in states]

    def _compute_states_on_circle(self, distribution: Node, number: int) -> list[FloatArray]:
        """Return states [x, y, theta] at equal distances on a circle, facing its center."""
        center = distribution["center"].parse_numbers([*self._center.tolist(), 0.0])[:2]
        radius = distribution["radius"].parse_number(self._radius)
        angles = 2 * math.pi * np.arange(number) / max(number, 1)
        directions = np.column_stack([np.cos(angles), np.sin(angles)])
        return list(np.column_stack([directions * radius + center, angles - math.pi]))


def _get_item(items: Sequence[_Item], k: int) -> _Item:
    """Return item k, or the last item if there are fewer: IR-SIM repeats it for the rest of a group."""
    return items[min(k, len(items) - 1)]
