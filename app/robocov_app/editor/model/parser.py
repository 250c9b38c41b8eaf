"""Sketches read from documents: what a map may not be is kept, what is no map at all is refused.

Sizes may be 0 or less, rings may have few points or none, names may be empty: such a draft can be edited, and
says itself what is wrong with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from robocov.environment import (
    REPEATS,
    CircleObstacle,
    DiscStart,
    Obstacle,
    ObstaclePath,
    Point,
    PointsStart,
    PolygonObstacle,
    Ring,
    StartSpec,
    UniformStart,
    WallObstacle,
)
from robocov.errors import JsonPath, MapError, Mistake, one_line, place, shown_json, unknown_name
from robocov.files.strictjson import check_header, located, parse, require_json
from robocov.mapfile import density_of
from robocov.mapfile.models import FORMAT, VERSION
from robocov_app.editor.model.annotations import taken_apart
from robocov_app.editor.model.sketch import Item, Sketch

_MAP = ("$schema", "format", "version", "name", "description", "boundary", "obstacles", "starts")
_KEYS = {
    "map": (*_MAP, "density", "extra"),
    "polygon": ("kind", "name", "vertices", "holes", "path"),
    "circle": ("kind", "name", "center", "radius", "path"),
    "wall": ("kind", "name", "points", "width", "path"),
    "path": ("points", "speed", "repeat"),
    "disc": ("kind", "center", "radius"),
    "points": ("kind", "positions"),
    "uniform": ("kind",),
}

_UNBOUNDED: Ring = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
"""What a raster of a map without a boundary covers, m, unless it says so itself."""

_Read = TypeVar("_Read")


def parse_sketch(text: str | bytes, where: str, folder: Path | None = None) -> Sketch:
    """Return the sketch in the text of a file; messages call it `where`, and `folder` holds its pictures."""
    document = parse(text, where)
    try:
        return sketch_of(document, where, folder)
    except MapError as error:
        raise located(error, text, where) from None


def sketch_of(document: Any, where: str = "map", folder: Path | None = None) -> Sketch:
    """Return the sketch in a parsed map document; what breaks the rules of maps is kept as it is.

    A density is read as strictly as in a map; `folder` holds its picture. MapError, with the place, where it
    is not made as maps are: another version, an unknown key or kind, something that is not a number.
    """
    where = one_line(where)
    require_json(document, where)
    check_header(document, where, FORMAT, VERSION)
    reader = _Reader(where)
    members = reader.members(document, (), _KEYS["map"])
    obstacles = reader.items(members.get("obstacles", []), ("obstacles",), "obstacles")
    shapes = [reader.obstacle(value, ("obstacles", k)) for k, value in enumerate(obstacles)]
    starts = reader.object(members.get("starts", {}), ("starts",))
    extra = reader.object(members.get("extra", {}), ("extra",))
    marks, background, others = taken_apart(extra, [shape.name for shape in shapes])
    boundary = reader.optional(reader.ring, members, (), "boundary")
    density = members.get("density")
    return Sketch(
        name=reader.text(members.get("name", ""), ("name",)),
        description=reader.text(members.get("description", ""), ("description",)),
        boundary=boundary,
        obstacles=tuple(Item(k, shape, **marks.get(k, {})) for k, shape in enumerate(shapes)),
        starts=tuple((name, reader.start(value, ("starts", name))) for name, value in starts.items()),
        background=background,
        extra=others,
        schema=reader.optional(reader.text, members, (), "$schema"),
        density=None if density is None else density_of(density, boundary or _UNBOUNDED, where, folder),
    )


class _Reader:
    """Reads parts of the map document that messages call `where`; each MapError names the place in it."""

    def __init__(self, where: str) -> None:
        self._where = where

    def refuse(self, path: JsonPath, what: str, *, at_key: bool = False) -> NoReturn:
        at = f"{place(path[:-1] if at_key else path)}: " if path[: -1 if at_key else None] else ""
        raise MapError.of(self._where, [Mistake(path, at + what, at_key)])

    def object(self, value: Any, path: JsonPath) -> Mapping[str, Any]:
        if not isinstance(value, dict):
            self.refuse(path, f"{shown_json(value)}, but an object was wanted")
        return value

    def members(self, value: Any, path: JsonPath, known: Iterable[str]) -> Mapping[str, Any]:
        """Return an object that has known keys only."""
        known = list(known)
        for key in self.object(value, path):
            if key not in known:
                self.refuse((*path, key), unknown_name("key", str(key), known), at_key=True)
        return self.object(value, path)

    def text(self, value: Any, path: JsonPath) -> str:
        if not isinstance(value, str):
            self.refuse(path, f"{shown_json(value)}, but a text was wanted")
        return value

    def number(self, value: Any, path: JsonPath) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            self.refuse(path, f"{shown_json(value)}, but a number was wanted")
        return float(value)

    def items(self, value: Any, path: JsonPath, what: str) -> list[Any]:
        if not isinstance(value, list):
            self.refuse(path, f"{shown_json(value)}, but a list of {what} was wanted")
        return value

    def point(self, value: Any, path: JsonPath) -> Point:
        if not isinstance(value, list | tuple) or len(value) != 2:
            self.refuse(path, f"{shown_json(value)}, but a point [x, y] in metres was wanted")
        x, y = value
        if type(x) is float and type(y) is float:  # most of a large file: no path for each
            return x, y
        return self.number(x, (*path, 0)), self.number(y, (*path, 1))

    def ring(self, value: Any, path: JsonPath) -> Ring:
        points = self.items(value, path, "points [x, y]")
        return tuple([self.point(point, (*path, k)) for k, point in enumerate(points)])

    def obstacle(self, value: Any, path: JsonPath) -> Obstacle:
        kind, members = self._kind(value, path, ("polygon", "circle", "wall"))
        name = self.optional(self.text, members, path, "name")
        way = self.optional(self.way, members, path, "path")
        if kind == "polygon":
            holes = self.items(members.get("holes", []), (*path, "holes"), "rings")
            rings = tuple(self.ring(hole, (*path, "holes", k)) for k, hole in enumerate(holes))
            return PolygonObstacle(self.wanted(self.ring, members, path, "vertices"), rings, name, way)
        if kind == "circle":
            center = self.wanted(self.point, members, path, "center")
            return CircleObstacle(center, self.wanted(self.number, members, path, "radius"), name, way)
        points = self.wanted(self.ring, members, path, "points")
        return WallObstacle(points, self.wanted(self.number, members, path, "width"), name, way)

    def way(self, value: Any, path: JsonPath) -> ObstaclePath:
        members = self.members(value, path, _KEYS["path"])
        repeat = members.get("repeat", "loop")
        if repeat not in REPEATS:
            what = f"{shown_json(repeat)}, but one of {', '.join(REPEATS)} was wanted"
            self.refuse((*path, "repeat"), what)
        points = self.wanted(self.ring, members, path, "points")
        return ObstaclePath(points, self.wanted(self.number, members, path, "speed"), repeat)

    def start(self, value: Any, path: JsonPath) -> StartSpec:
        kind, members = self._kind(value, path, ("disc", "uniform", "points"))
        if kind == "disc":
            center = self.wanted(self.point, members, path, "center")
            return DiscStart(center, self.wanted(self.number, members, path, "radius"))
        if kind == "points":
            return PointsStart(self.wanted(self.ring, members, path, "positions"))
        return UniformStart()

    def _kind(self, value: Any, path: JsonPath, kinds: tuple[str, ...]) -> tuple[str, Mapping[str, Any]]:
        """Return the kind of an object, and its members."""
        wanted = f"one of {', '.join(kinds)}"
        if not isinstance(value, dict):
            self.refuse(path, f"{shown_json(value)}, but an object whose kind is {wanted} was wanted")
        kind = self.wanted(lambda kind, path: kind, value, path, "kind")
        if kind not in kinds:
            self.refuse((*path, "kind"), f"{shown_json(kind)}, but {wanted} was wanted")
        return kind, self.members(value, path, _KEYS[kind])

    def wanted(
        self, read: Callable[[Any, JsonPath], _Read], members: Mapping[str, Any], path: JsonPath, key: str
    ) -> _Read:
        """Return a member that must be there, as `read` returns it."""
        if key not in members:
            self.refuse((*path, key), "missing, but it was wanted")
        return read(members[key], (*path, key))

    def optional(
        self, read: Callable[[Any, JsonPath], _Read], members: Mapping[str, Any], path: JsonPath, key: str
    ) -> _Read | None:
        """Return a member that may be missing or null."""
        return None if members.get(key) is None else read(members[key], (*path, key))
