"""Placement of models in the world: shapes become obstacles, and positions of robots become starts."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.errors import MapError, quote, to_one_line
from robocov.typing import FloatArray
from robocov_app.formats import files
from robocov_app.formats.geometry.cells.vectorize import count_polygon_vertices
from robocov_app.formats.geometry.frames import UNIT_SQUARE, build_frame, transform_points
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.simulators.stage.bitmaps import BitmapReader
from robocov_app.formats.simulators.stage.entities import Entity, World

MAX_ENTITIES = 10_000
"""Maximum number of models and blocks, including those from macros."""
_METERS_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_DEFAULT_SIDE = 0.4
"""Default length and width of a model, in units of the world."""
_MIN_EXTENT = 1e-12
"""Minimum extent that is used to scale blocks, to avoid a division by zero."""
_DIGITS = 9
"""Decimals of coordinates in meters."""
_MAX_TYPE_CHARACTERS = 30


@dataclass(frozen=True, eq=False)
class Floorplan:
    """A model that may be the map: it has a bitmap, or a boundary around its blocks.

    Attributes
    ----------
    box : Polygon, m
        Rectangle that the model fills.
    free : MultiPolygon, m
        The box without the dark pixels of its bitmap.
    labels : tuple of str
    cell : float or None, m
        Longer side of a pixel.
    """

    box: Polygon
    free: MultiPolygon
    labels: tuple[str, ...]
    cell: float | None = None


class _ModelBox:
    """The rectangle that a model fills.

    Parameters
    ----------
    frame : (3, 3) array
        Transform from the frame of the model to meters.
    size : (2,) array, m
    """

    def __init__(self, frame: FloatArray, size: FloatArray) -> None:
        self._frame = frame
        self._size = size
        self.polygon = Polygon(self.place(UNIT_SQUARE))

    def place(self, points: FloatArray) -> FloatArray:
        """Convert positions in the unit square around the origin, (k, 2), to positions on the map, m."""
        return np.round(transform_points(self._frame, points * self._size), _DIGITS) + 0.0


class ModelPlacer:
    """Adds the models of a world to a collection of shapes.

    Parameters
    ----------
    world : World
    shapes : Shapes
    find_file : callable
        ``find_file(name, kind, location=location)`` returns the path of a file that the world names.

    Attributes
    ----------
    floorplans : list of Floorplan
        Models that may be the map. All others are added to the shapes.
    """

    def __init__(self, world: World, shapes: Shapes, find_file: Callable[..., Path]) -> None:
        self.floorplans: list[Floorplan] = []
        self._world = world
        self._shapes = shapes
        self._find_file = find_file
        self._bitmaps = BitmapReader(shapes.notes)
        self._entity_count = 0
        unit = world.root.get_text("unit_length", "m")
        self._meters_per_unit = _METERS_PER_UNIT.get(unit, 1.0)
        is_in_radians = world.root.get_text("unit_angle") == "radians"
        self._radians_per_unit = 1.0 if is_in_radians else math.pi / 180

    def place_all(self) -> None:
        """Add all models; raise MapError if a value is invalid, or if there are too many."""
        self._place(self._world.root.children, np.eye(3), 0)

    def _place(self, entities: list[Entity], frame: FloatArray, depth: int) -> None:
        """Add models and, recursively, the models in them; `frame` is the (3, 3) transform to meters."""
        for given in entities:
            entity, labels = self._expand_macros(given)
            if depth > files.MAX_DEPTH:
                raise MapError(f"{entity.location}: nested in more than {files.MAX_DEPTH} models")
            if entity.type in ("window", "block"):
                continue
            model_frame = frame @ self._parse_pose(entity, "pose")
            if entity.type not in ("model", "position"):
                self._shapes.count_omission(to_one_line(entity.type)[:_MAX_TYPE_CHARACTERS])
            elif not self._shapes.accept(labels):
                continue
            elif entity.type == "position":
                self._shapes.robots.append((float(model_frame[0, 2]), float(model_frame[1, 2])))
            else:
                if _is_solid(entity):
                    self._add_model(entity, model_frame @ self._parse_pose(entity, "origin"), labels)
                else:
                    self._shapes.count_omission("model", "that nothing collides with")
                self._place(entity.children, model_frame, depth + 1)

    def _expand_macros(self, entity: Entity) -> tuple[Entity, tuple[str, ...]]:
        """Merge an entity with the macros on which it is based.

        Properties of the entity take precedence. Also returned are its labels: its own name, and the names of
        these macros and of its type.
        """
        macros = self._world.macros
        chain = [entity]
        while chain[-1].type in macros:
            chain.append(macros[chain[-1].type])
            if len(chain) > files.MAX_DEPTH:
                raise MapError(
                    f"{entity.location}: the model {quote(entity.type)} is defined in terms of itself"
                )
        self._entity_count += 1 + sum(len(base.children) for base in chain)
        if self._entity_count > MAX_ENTITIES:
            raise MapError(f"{entity.location}: expected at most {MAX_ENTITIES} models and blocks, got more")
        expanded = Entity(chain[-1].type, entity.location)
        for base in reversed(chain):
            expanded.properties.update(base.properties)
            expanded.children.extend(base.children)
        names = [expanded.get_text("name"), *(base.type for base in chain)]
        return expanded, tuple(name for name in names if name)

    def _parse_pose(self, entity: Entity, name: str) -> FloatArray:
        """Return the (3, 3) frame of a pose [x y z heading], or [x y heading] as in Stage 2."""
        x, y, third, fourth = entity.parse_numbers(name, (0.0, 0.0, 0.0, 0.0)).tolist()
        heading = third if len(entity.properties.get(name, [])) == 3 else fourth
        meters = self._meters_per_unit
        return build_frame(x * meters, y * meters, heading * self._radians_per_unit)

    def _add_model(self, entity: Entity, frame: FloatArray, labels: tuple[str, ...]) -> None:
        """Add the outlines of a model: those in its bitmap; without one, its blocks or its box."""
        size = entity.parse_numbers("size", (_DEFAULT_SIDE, _DEFAULT_SIDE)) * self._meters_per_unit
        for length in size.tolist():
            files.require_length(length, f"{entity.location}: size")
        box = _ModelBox(frame, size)
        blocks = self._parse_blocks(entity)
        if "bitmap" in entity.properties:
            self._add_bitmap(entity, box, size, labels)
            if blocks:
                self._shapes.count_omission("block", "next to a bitmap", len(blocks))
            return
        rings: list[FloatArray] = []
        if blocks:
            rings = [box.place(ring) for ring in _scale_to_unit_square(blocks)]
            if entity.parse_number("boundary", 0):
                self.floorplans.append(Floorplan(box.polygon, MultiPolygon([box.polygon]), labels))
        elif not entity.parse_number("noblocks", 0):
            rings = [np.asarray(box.polygon.exterior.coords)[:-1]]
        for ring in rings:
            self._shapes.add_outline([ring], labels, location=entity.location, kind="block")

    def _add_bitmap(self, entity: Entity, box: _ModelBox, size: FloatArray, labels: tuple[str, ...]) -> None:
        """Add a model with a bitmap to the floor plans."""
        file = self._find_file(entity.get_text("bitmap"), "image", location=f"{entity.location}: bitmap")
        bitmap = self._bitmaps.read(file)
        self._shapes.count_vertices(count_polygon_vertices(bitmap.free))
        cell = float(max(size[0] / bitmap.columns, size[1] / bitmap.rows))
        free = shapely.transform(bitmap.free, box.place)
        self.floorplans.append(Floorplan(box.polygon, free, labels, cell))

    def _parse_blocks(self, entity: Entity) -> list[FloatArray]:
        """Return the polygons of all blocks of a model, (k, 2) each."""
        rings = _parse_rings(entity)
        for child in entity.children:
            block, _ = self._expand_macros(child)
            if block.type == "block":
                rings += _parse_rings(block)
        return rings


def _is_solid(entity: Entity) -> bool:
    """Return whether a model blocks robots or their range sensors."""
    returns = [entity.parse_number(name, 1.0) for name in ("ranger_return", "laser_return")]
    is_seen = min(returns) > 0
    return is_seen or entity.parse_number("obstacle_return", 1.0) != 0 or "bitmap" in entity.properties


def _scale_to_unit_square(rings: list[FloatArray]) -> list[FloatArray]:
    """Scale rings so that their bounding box becomes the unit square around the origin."""
    points = np.concatenate(rings)
    low = points.min(axis=0)
    high = points.max(axis=0)
    extent = np.maximum(high - low, _MIN_EXTENT)
    return [(ring - (low + high) / 2) / extent for ring in rings]


def _parse_rings(entity: Entity) -> list[FloatArray]:
    """Return the polygons of a block, or of a model as in Stage 2, (k, 2) each.

    Points are properties such as ``point[1] [x y]`` in a block, or ``block[0].point[1] [x y]`` in a model.
    """
    rings: dict[str, dict[int, FloatArray]] = {}
    for name in entity.properties:
        prefix, separator, index = name.removesuffix("]").rpartition("point[")
        if separator and name.endswith("]") and index.isdecimal() and len(index) < 9:
            rings.setdefault(prefix, {})[int(index)] = entity.parse_numbers(name, (0.0, 0.0))
    for prefix, points in rings.items():
        count = entity.parse_number(f"{prefix}points", len(points))
        if count != len(points):
            raise MapError(f"{entity.location}: expected {count:g} points as stated, got {len(points)}")
    return [np.array([points[index] for index in sorted(points)]) for points in rings.values()]
