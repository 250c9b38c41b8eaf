"""Parts of drafts read from documents: what a map may not be is kept, what is no map at all is refused."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NoReturn

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

_MAP_KEYS = (
    *("$schema", "format", "version", "name", "description", "boundary", "obstacles", "starts"),
    *("density", "extra"),
)

FIRST: Ring = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
"""What a raster of a map without a boundary covers, m, unless it says so itself."""

_KEYS = {
    "polygon": ("kind", "name", "vertices", "holes", "path"),
    "circle": ("kind", "name", "center", "radius", "path"),
    "wall": ("kind", "name", "points", "width", "path"),
    "path": ("points", "speed", "repeat"),
    "disc": ("kind", "center", "radius"),
    "points": ("kind", "positions"),
    "uniform": ("kind",),
}


class PartReader:
    """Reads parts of a map document, as strictly as to know what they are, and no further.

    Sizes may be 0 or less, rings may have few points or none, names may be empty: such a draft can be
    edited, and says itself what is wrong with it. All methods raise a MapError with the place.

    Parameters
    ----------
    where : str
        What messages call the document.
    """

    def __init__(self, where: str) -> None:
        self._where = where

    def refuse(self, path: JsonPath, what: str, *, at_key: bool = False) -> NoReturn:
        """Raise the error that something is wrong at a place."""
        at = f"{place(path[:-1] if at_key else path)}: " if path[: -1 if at_key else None] else ""
        raise MapError.of(self._where, [Mistake(path, at + what, at_key)])

    def object(self, value: Any, path: JsonPath) -> Mapping[str, Any]:
        """Return an object."""
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
        """Return a text."""
        if not isinstance(value, str):
            self.refuse(path, f"{shown_json(value)}, but a text was wanted")
        return value

    def number(self, value: Any, path: JsonPath) -> float:
        """Return a finite number."""
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            self.refuse(path, f"{shown_json(value)}, but a number was wanted")
        return float(value)

    def items(self, value: Any, path: JsonPath, what: str) -> list[Any]:
        """Return a list of something."""
        if not isinstance(value, list):
            self.refuse(path, f"{shown_json(value)}, but a list of {what} was wanted")
        return value

    def point(self, value: Any, path: JsonPath) -> Point:
        """Return a point."""
        if not isinstance(value, list | tuple) or len(value) != 2:
            self.refuse(path, f"{shown_json(value)}, but a point [x, y] in metres was wanted")
        x, y = value
        # most of a large file: no path for each
        if type(x) is float and type(y) is float:
            return x, y
        return self.number(x, (*path, 0)), self.number(y, (*path, 1))

    def ring(self, value: Any, path: JsonPath) -> Ring:
        """Return points, any number of them."""
        points = self.items(value, path, "points [x, y]")
        return tuple([self.point(point, (*path, k)) for k, point in enumerate(points)])

    def obstacle(self, value: Any, path: JsonPath) -> Obstacle:
        """Return an obstacle."""
        kind = self._kind(value, path, ("polygon", "circle", "wall"))
        members = self.members(value, path, _KEYS[kind])
        name = self.text(members["name"], (*path, "name")) if members.get("name") is not None else None
        way = self.way(members["path"], (*path, "path")) if members.get("path") is not None else None
        if kind == "polygon":
            holes = self.items(members.get("holes", []), (*path, "holes"), "rings")
            rings = tuple(self.ring(hole, (*path, "holes", k)) for k, hole in enumerate(holes))
            return PolygonObstacle(self._ring_at(members, path, "vertices"), rings, name, way)
        if kind == "circle":
            center = self.point(self._at(members, path, "center"), (*path, "center"))
            return CircleObstacle(center, self._number_at(members, path, "radius"), name, way)
        return WallObstacle(
            self._ring_at(members, path, "points"), self._number_at(members, path, "width"), name, way
        )

    def way(self, value: Any, path: JsonPath) -> ObstaclePath:
        """Return the path of an obstacle that moves."""
        members = self.members(value, path, _KEYS["path"])
        repeat = members.get("repeat", "loop")
        if repeat not in REPEATS:
            self.refuse(
                (*path, "repeat"), f"{shown_json(repeat)}, but one of {', '.join(REPEATS)} was wanted"
            )
        points, speed = self._ring_at(members, path, "points"), self._number_at(members, path, "speed")
        return ObstaclePath(points, speed, repeat)

    def start(self, value: Any, path: JsonPath) -> StartSpec:
        """Return a start."""
        kind = self._kind(value, path, ("disc", "uniform", "points"))
        members = self.members(value, path, _KEYS[kind])
        if kind == "disc":
            center = self.point(self._at(members, path, "center"), (*path, "center"))
            return DiscStart(center, self._number_at(members, path, "radius"))
        if kind == "points":
            return PointsStart(self._ring_at(members, path, "positions"))
        return UniformStart()

    def _kind(self, value: Any, path: JsonPath, kinds: tuple[str, ...]) -> str:
        wanted = f"one of {', '.join(kinds)}"
        if not isinstance(value, dict):
            self.refuse(path, f"{shown_json(value)}, but an object whose kind is {wanted} was wanted")
        kind = self._at(value, path, "kind")
        if kind not in kinds:
            self.refuse((*path, "kind"), f"{shown_json(kind)}, but {wanted} was wanted")
        return str(kind)

    def _at(self, members: Mapping[str, Any], path: JsonPath, key: str) -> Any:
        if key not in members:
            self.refuse((*path, key), "missing, but it was wanted")
        return members[key]

    def _ring_at(self, members: Mapping[str, Any], path: JsonPath, key: str) -> Ring:
        return self.ring(self._at(members, path, key), (*path, key))

    def _number_at(self, members: Mapping[str, Any], path: JsonPath, key: str) -> float:
        return self.number(self._at(members, path, key), (*path, key))


def sketch_of(document: Any, where: str = "map", folder: Path | None = None) -> Sketch:
    """Return the sketch in a parsed map document; what breaks the rules of maps is kept as it is.

    A density is read as strictly as in a map; `folder` holds its picture.

    Raises
    ------
    MapError
        When it is not made as maps are: not a map, another version, an unknown key or kind, something
        that is not a number; the message names the place.
    """
    where = one_line(where)
    require_json(document, where)
    check_header(document, where, FORMAT, VERSION)
    reader = PartReader(where)
    members = reader.members(document, (), _MAP_KEYS)
    boundary = members.get("boundary")
    obstacles = reader.items(members.get("obstacles", []), ("obstacles",), "obstacles")
    shapes = [reader.obstacle(value, ("obstacles", k)) for k, value in enumerate(obstacles)]
    starts = reader.object(members.get("starts", {}), ("starts",))
    extra = reader.object(members.get("extra", {}), ("extra",))
    notes, background, others = taken_apart(extra, [shape.name for shape in shapes])
    schema = members.get("$schema")
    boundary = None if boundary is None else reader.ring(boundary, ("boundary",))
    density = members.get("density")
    return Sketch(
        name=reader.text(members.get("name", ""), ("name",)),
        description=reader.text(members.get("description", ""), ("description",)),
        boundary=boundary,
        obstacles=tuple(Item(k, shape, notes.get(k, "")) for k, shape in enumerate(shapes)),
        starts=tuple((name, reader.start(value, ("starts", name))) for name, value in starts.items()),
        background=background,
        extra=others,
        schema=None if schema is None else reader.text(schema, ("$schema",)),
        density=None if density is None else density_of(density, boundary or FIRST, where, folder),
    )


def parse_sketch(text: str | bytes, where: str, folder: Path | None = None) -> Sketch:
    """Return the sketch in the text of a file; messages call it `where`, and `folder` holds its pictures.

    Raises
    ------
    MapError
        As `sketch_of`, and when the text is not JSON.
    """
    document = parse(text, where)
    try:
        return sketch_of(document, where, folder)
    except MapError as error:
        raise located(error, text, where) from None
