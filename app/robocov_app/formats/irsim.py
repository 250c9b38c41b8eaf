"""Worlds of the simulator IR-SIM: https://ir-sim.readthedocs.io/en/stable/yaml_config/configuration.html.

A YAML contains the size of the ``world``, optionally a picture of it, and groups of ``robot`` and
``obstacle``: a number of objects of a shape, at given states [x, y, theta] or distributed.

Obstacles are placed where they start, even if they move; lines are walls as wide as the option ``thickness``.
Objects that collide with nothing, have random shapes or are distributed at random are left out and counted.
The states of robots are starts.
"""

from __future__ import annotations

import importlib.util
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np
import shapely
from shapely import MultiPolygon

from robocov.arrays import Array, BoolArray
from robocov.errors import MapError, format_count, quote, to_one_line
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.frames import UNIT_SQUARE, build_frame, transform_points
from robocov_app.formats.geometry.shapes import Shapes, WallLine
from robocov_app.formats.geometry.vectorize import count_polygon_vertices, outline_free_cells
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.picture import describe_transparency, read_picture

MAX_OBJECTS = 4_000
"""Largest number of robots and obstacles of a world."""
_WORLD = re.compile(rb"^(?:world|obstacle)[ \t]*:", re.MULTILINE)
_TRUE_WORDS = ("true", "yes", "on", "1")


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
    where = to_one_line(path)
    shapes = Shapes(where, options)
    root = _Node(files.parse_yaml(files.read_content(path, files.MAX_YAML_BYTES), where), f"{where}: ")
    world = root["world"]
    size = np.array([world["width"].length(10.0), world["height"].length(10.0)])
    corner = world["offset"].numbers([0.0, 0.0])[:2]
    free = MultiPolygon([shapely.box(*corner, *(corner + size))])
    if world["obstacle_map"].is_given:
        light = _picture(world, path, shapes)
        width, height = (size / light.shape[::-1]).tolist()
        free = outline_free_cells(light, (width, height), (float(corner[0]), float(corner[1])), where)
        shapes.cell = max(width, height)
        shapes.count_vertices(count_polygon_vertices(free))
    drawer = _ShapeDrawer(shapes)
    count = moving = 0
    for kind in ("robot", "obstacle"):
        for group in root[kind].items(one=True):
            number = max(int(group["number"].number(1.0)), 0)
            count += number
            if count > MAX_OBJECTS:
                group["number"].refuse(f"a number of at most {MAX_OBJECTS} together")
            states = _states(group, number, corner + size / 2, float(size.min() / 2 - 0.5))
            if states is None:
                shapes.leave_out(kind, "that IR-SIM places at random", number)
                continue
            names = group["name"].items(one=True)
            for k in range(number):
                given = [names[min(k, len(names) - 1)].text()] if names else []
                labels = tuple(filter(None, (*given, group["group_name"].text())))
                x, y, turn = states[min(k, len(states) - 1)][:3]
                if kind == "robot":
                    shapes.robots.append((float(x), float(y)))
                elif shapes.accept(labels):
                    if group["unobstructed"].text().lower() in _TRUE_WORDS:
                        shapes.leave_out(kind, "that nothing collides with")
                        continue
                    moving += group["kinematics"].is_given
                    figures = group["shape"].items(one=True) or [group["shape"]]
                    drawer.draw(figures[min(k, len(figures) - 1)], build_frame(x, y, turn), labels)
    if moving:
        words = "with kinematics taken as standing where the file has them"
        shapes.notes.append(f"{format_count(moving, 'obstacle')} {words}")
    name = world["name"].text() or path.stem
    return shapes.build_foreign_map(name, "A world of IR-SIM, imported.", solid=True, world=free)


def _picture(world: _Node, path: Path, shapes: Shapes) -> BoolArray:
    """Return which cells of the world's picture are free, the top row first."""
    source, step = world["obstacle_map"], world["mdownsample"]
    if isinstance(source.value, dict):
        if source["name"].text() != "image":
            name = quote(source["name"].value)
            raise MapError(f"{source.at}: expected a picture, got {name}, which IR-SIM generates")
        source = source["path"]
    notes, anywhere = shapes.notes, shapes.options.anywhere
    file = files.find_named_file(
        path, source.text(), "picture", at=source.at, notes=notes, allow_anywhere=anywhere
    )
    if not file.is_file():
        file = _find_bundled(source)
        notes.append(f"{source.at.rpartition(': ')[2]}: {quote(file.name)} taken from the installed ir-sim")
    picture = read_picture(file, to_one_line(file))
    every = int(step.number(1.0))
    if every < 1:
        step.refuse("a number from 1")
    # IR-SIM counts rows from the bottom
    light = 2 * picture.level.astype(np.uint32) >= picture.full
    if transparency := describe_transparency(picture):
        notes.append(f"{source.at.rpartition(': ')[2]}: {transparency}")
        if not light.any():
            raise MapError(f"{to_one_line(file)}: no cell is free: {transparency}")
    return light[::-1][::every, ::every][::-1]


def _find_bundled(source: _Node) -> Path:
    """Return a picture of the maps that IR-SIM brings along, as it does itself where there is no such file.

    IR-SIM is only looked for, not imported.

    Raises
    ------
    MapError
        When IR-SIM is not installed, or has no such picture.
    """
    name = source.text()
    missing = (
        f"{source.at}: expected a picture beside the file, or one that IR-SIM brings along, got {quote(name)}"
    )
    package = importlib.util.find_spec("irsim")
    if package is None or not package.submodule_search_locations:
        raise MapError(f"{missing}. IR-SIM is not installed (pip install ir-sim).")
    maps = Path(package.submodule_search_locations[0]) / "world" / "map"
    bundled = {file.name: file for file in sorted(maps.rglob("*.png"), reverse=True)}
    if name not in bundled:
        known = f" (it has {', '.join(sorted(bundled)[:20])})" if bundled else ""
        raise MapError(f"{missing}. The installed IR-SIM has no such picture{known}.")
    return bundled[name]


def _states(group: _Node, number: int, center: Array, radius: float) -> list[Array] | None:
    """Return the states [x, y, theta] of a group, of which the last may stand for more; None by chance."""
    way = group["distribution"]
    name = way["name"].text("manual")
    if name == "circle":
        middle, radius = way["center"].numbers([*center.tolist(), 0.0]), way["radius"].number(radius)
        turns = 2 * math.pi * np.arange(number) / max(number, 1)
        around = np.column_stack([np.cos(turns), np.sin(turns)]) * radius + middle[:2]
        return [*np.column_stack([around, turns - math.pi])]
    if name == "random":
        return None
    if name != "manual":
        way["name"].refuse("manual, circle or random")
    states = group["state"].items()
    nested = bool(states) and isinstance(states[0].value, list)
    return [state.numbers([1.0, 1.0, 0.0]) for state in (states if nested else [group["state"]])]


class _ShapeDrawer:
    """Adds the shapes of obstacles: so many objects may have so many parts that they are counted first."""

    def __init__(self, shapes: Shapes) -> None:
        self.shapes = shapes
        self.count = 0

    def draw(self, shape: _Node, around: Array, labels: tuple[str, ...]) -> None:
        """Add a shape in a frame, a (3, 3) matrix to meters."""
        self.count += 1
        files.require_shapes(self.count, self.shapes.where)
        name, at = shape["name"].text("circle").lower(), shape.at.partition(": ")[2]
        shift = np.array([shape["wheelbase"].number(0.0) / 2, 0.0])
        if shape["random_shape"].text().lower() in _TRUE_WORDS:
            self.shapes.leave_out("shape", "by chance")
        elif name == "circle":
            center = shape["center"].numbers([0.0, 0.0])[:2] + shift
            radius = shape["radius"].length(0.2)
            self.shapes.add_circle(transform_points(around, center[None])[0], radius, labels, at=at)
        elif name == "rectangle":
            size = np.array([shape["length"].length(1.0), shape["width"].length(1.0)])
            self.shapes.add_outline([transform_points(around, UNIT_SQUARE * size + shift)], labels, at=at)
        elif name in ("polygon", "linestring"):
            self._draw_points(shape, around, labels, at)
        elif name == "compound":
            for part in shape["parts"].items():
                pose = part["pose"].numbers([0.0, 0.0, 0.0])[:3]
                self.draw(part, around @ build_frame(*pose), labels)
        else:
            shape["name"].refuse("circle, rectangle, polygon, linestring or compound")

    def _draw_points(self, shape: _Node, around: Array, labels: tuple[str, ...], at: str) -> None:
        is_line = shape["name"].text().lower() == "linestring"
        points = [point.numbers([0.0, 0.0])[:2] for point in shape["vertices"].items()]
        if len(points) < (2 if is_line else 3):
            shape["vertices"].refuse("a list of points [x, y]")
        places = transform_points(around, np.array(points))
        if is_line:
            self.shapes.add_line(WallLine(places, self.shapes.thickness, labels), at=at)
        else:
            self.shapes.add_outline([places], labels, at=at, thing="polygon")


@dataclass(frozen=True)
class _Node:
    """A value of the file and its position; None if the file does not contain it."""

    value: files.Value | None
    at: str

    @property
    def is_given(self) -> bool:
        """Whether the file contains the value."""
        return self.value not in (None, "", "null", "~", "None", [], {})

    def __getitem__(self, name: str) -> _Node:
        """Return the value of a key in a mapping."""
        if self.is_given and not isinstance(self.value, dict):
            self.refuse("a mapping (name: value)")
        place = self.at if self.at.endswith(": ") else f"{self.at}."
        return _Node(self.value.get(name) if isinstance(self.value, dict) else None, f"{place}{name}")

    def items(self, *, one: bool = False) -> list[_Node]:
        """Return the items of a list; where `one` is allowed, anything else is a list of it."""
        if not self.is_given:
            return []
        if isinstance(self.value, list):
            return [_Node(item, f"{self.at}[{k}]") for k, item in enumerate(self.value)]
        if not one:
            self.refuse("a list")
        return [self]

    def text(self, default: str = "") -> str:
        """Return a text; raise MapError if it is a list or mapping."""
        if not self.is_given:
            return default
        if not isinstance(self.value, str):
            self.refuse("one value")
        return self.value

    def number(self, default: float) -> float:
        """Return a number; raise MapError if it is not one."""
        value = files.parse_number(self.text(str(default)))
        if not abs(value) <= MAX_COORDINATE_M:
            self.refuse("a number within 1e7")
        return value

    def length(self, default: float) -> float:
        """Return a positive length in meters; raise MapError if it is out of range."""
        value = self.number(default)
        files.require_length(value, self.at)
        return value

    def numbers(self, default: list[float]) -> Array:
        """Return the numbers of a list; missing ones are as in `default`."""
        values = [item.number(0.0) for item in self.items()]
        if self.is_given and len(values) < 2:
            self.refuse(f"a list of {len(default)} numbers")
        return np.array([*values, *default[len(values) :]])

    def refuse(self, expected: str) -> NoReturn:
        """Raise the MapError of this value."""
        raise MapError(f"{self.at}: expected {expected}, got {quote(self.value)}")
