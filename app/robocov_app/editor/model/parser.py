"""Reading of sketches from map documents.

A sketch may break the rules of maps, so that issues can be corrected in the editor. A document that cannot
be represented as a sketch, for instance because a point has three coordinates, raises an error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from robocov import environment as env
from robocov.environment import Obstacle, Point, Ring
from robocov.errors import (
    Issue,
    JsonPath,
    MapError,
    describe_unknown_name,
    format_path,
    quote_json,
    to_one_line,
)
from robocov.files.documents import check_header
from robocov.files.strictjson import locate_issues, parse_json, require_json
from robocov.mapfile import parse_density
from robocov.mapfile.models import FORMAT, VERSION, MapModel
from robocov_app.editor.model.background import read_marks
from robocov_app.editor.model.sketch import KINDS, Item, Sketch

_MAP_KEYS = [field.alias or name for name, field in MapModel.model_fields.items()]
_OBSTACLE_CLASSES: dict[str, type[Obstacle]] = {kind: shape for shape, kind in KINDS.items()}
_START_CLASSES: dict[str, Any] = {
    "disc": env.DiscStart,
    "uniform": env.UniformStart,
    "points": env.PointsStart,
}
_EXTENT_WITHOUT_BOUNDARY: Ring = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
"""Extent of a density image on a map without a boundary, or with one that has no width or height, m; unless
the image has its own extent."""
_REQUIRED_VALUES = {
    "center": "a point [x, y] in meters",
    "points": "a list of points [x, y]",
    "positions": "a list of points [x, y]",
    "radius": "a number",
    "speed": "a number",
    "vertices": "a list of points [x, y]",
    "width": "a number",
}
"""Descriptions of the values that obstacles, starts and paths must have, by key, for messages."""
_Value = TypeVar("_Value")


def parse_sketch(text: str | bytes, source_name: str, folder: Path | None = None) -> Sketch:
    """Read a sketch from the text of a file.

    Parameters
    ----------
    text : str or bytes
        JSON text.
    source_name : str
        Name of the file in messages.
    folder : Path, optional
        Folder of the images to which the map refers.

    Returns
    -------
    Sketch

    Raises
    ------
    MapError
        If the text cannot be represented as a sketch. The message contains line and column.
    """
    document = parse_json(text, source_name)
    try:
        return build_sketch(document, source_name, folder)
    except MapError as error:
        raise locate_issues(error, text, source_name) from None


def build_sketch(document: Any, source_name: str = "map", folder: Path | None = None) -> Sketch:
    """Build a sketch from a parsed document, which may break the rules of maps.

    Parameters
    ----------
    document : object
        Parsed JSON.
    source_name : str
        Name of the document in messages.
    folder : Path, optional
        Folder of the images to which the map refers.

    Returns
    -------
    Sketch

    Raises
    ------
    MapError
        If the document cannot be represented as a sketch.
    """
    source_name = to_one_line(source_name)
    require_json(document, source_name)
    check_header(document, source_name, FORMAT, VERSION)
    reader = _Reader(source_name)
    members = reader.read_object(document, (), _MAP_KEYS)
    shapes = _read_obstacles(reader, members.get("obstacles", []))
    extra = reader.require_type(dict, members.get("extra", {}), ("extra",), "an object")
    marks, background, other_keys = read_marks(extra, [shape.name for shape in shapes])
    boundary = None
    if members.get("boundary") is not None:
        boundary = reader.read_ring(members["boundary"], ("boundary",))
    schema = None
    if members.get("$schema") is not None:
        schema = reader.read_text(members["$schema"], ("$schema",))
    density = None
    if members.get("density") is not None:
        extent = boundary if boundary and _has_extent(boundary) else _EXTENT_WITHOUT_BOUNDARY
        density = parse_density(members["density"], extent, source_name, folder)
    return Sketch(
        name=reader.read_text(members.get("name", ""), ("name",)),
        description=reader.read_text(members.get("description", ""), ("description",)),
        boundary=boundary,
        obstacles=tuple(Item(k, shape, **marks.get(k, {})) for k, shape in enumerate(shapes)),
        starts=_read_starts(reader, members.get("starts", {})),
        background=background,
        extra=other_keys,
        schema=schema,
        density=density,
    )


def _read_obstacles(reader: _Reader, value: Any) -> list[Obstacle]:
    obstacles = reader.require_type(list, value, ("obstacles",), "a list of obstacles")
    return [
        reader.read_variant(_OBSTACLE_CLASSES, obstacle, ("obstacles", k))
        for k, obstacle in enumerate(obstacles)
    ]


def _has_extent(ring: Ring) -> bool:
    """Return whether a ring has a width and a height above 0."""
    x, y = zip(*ring, strict=True)
    return bool(min(x) < max(x) and min(y) < max(y))


def _read_starts(reader: _Reader, value: Any) -> tuple[tuple[str, Any], ...]:
    starts = reader.require_type(dict, value, ("starts",), "an object")
    return tuple(
        (name, reader.read_variant(_START_CLASSES, start, ("starts", name))) for name, start in starts.items()
    )


class _Reader:
    """Reads the parts of a map document. Each MapError contains the path in the document.

    Parameters
    ----------
    source_name : str
        Name of the document in messages.
    """

    def __init__(self, source_name: str) -> None:
        self._source_name = source_name
        # How to read the fields of obstacles, starts and paths, by their names.
        self._readers: dict[str, Callable[[Any, JsonPath], Any]] = {
            "center": self.read_point,
            "holes": self.read_rings,
            "name": self.read_text,
            "path": self.read_motion,
            "points": self.read_ring,
            "positions": self.read_ring,
            "radius": self.read_number,
            "repeat": self.read_repeat,
            "speed": self.read_number,
            "vertices": self.read_ring,
            "width": self.read_number,
        }

    def fail(self, path: JsonPath, message: str, *, at_key: bool = False) -> NoReturn:
        """Raise MapError about the value at a path or, with `at_key`, about its key."""
        named_path = path
        if at_key:
            named_path = path[:-1]
        if named_path:
            message = f"{format_path(named_path)}: {message}"
        raise MapError.from_issues(self._source_name, [Issue(path, message, at_key)])

    def require_type(self, kind: type[_Value], value: Any, path: JsonPath, expected: str) -> _Value:
        """Return a value unchanged; raise MapError unless it has the given type."""
        if not isinstance(value, kind):
            self.fail(path, f"expected {expected}, got {quote_json(value)}")
        return value

    def read_object(self, value: Any, path: JsonPath, keys: Sequence[str]) -> dict[str, Any]:
        """Return a JSON object; raise MapError if it has keys other than the given ones."""
        members = self.require_type(dict, value, path, "an object")
        for key in members:
            if key not in keys:
                self.fail((*path, key), describe_unknown_name("key", str(key), keys), at_key=True)
        return members

    def read_text(self, value: Any, path: JsonPath) -> str:
        """Read a string."""
        return self.require_type(str, value, path, "a string")

    def read_number(self, value: Any, path: JsonPath) -> float:
        """Read a finite number."""
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            self.fail(path, f"expected a number, got {quote_json(value)}")
        return float(value)

    def read_point(self, value: Any, path: JsonPath) -> Point:
        """Read a position, m."""
        if not isinstance(value, list | tuple) or len(value) != 2:
            self.fail(path, f"expected a point [x, y] in meters, got {quote_json(value)}")
        x, y = value
        if type(x) is float and type(y) is float:
            # Fast path: large files consist mostly of such points, and building paths takes time.
            return x, y
        return self.read_number(x, (*path, 0)), self.read_number(y, (*path, 1))

    def read_ring(self, value: Any, path: JsonPath) -> Ring:
        """Read a list of positions, m."""
        points = self.require_type(list, value, path, "a list of points [x, y]")
        return tuple([self.read_point(point, (*path, k)) for k, point in enumerate(points)])

    def read_rings(self, value: Any, path: JsonPath) -> tuple[Ring, ...]:
        """Read a list of lists of positions, m."""
        rings = self.require_type(list, value, path, "a list of rings")
        return tuple([self.read_ring(ring, (*path, k)) for k, ring in enumerate(rings)])

    def read_repeat(self, value: Any, path: JsonPath) -> env.Repeat:
        """Read how a moving obstacle repeats its path."""
        if value not in env.REPEATS:
            self.fail(path, f"expected one of {', '.join(env.REPEATS)}, got {quote_json(value)}")
        return value  # type: ignore[no-any-return]

    def read_motion(self, value: Any, path: JsonPath) -> env.ObstaclePath:
        """Read the path of a moving obstacle."""
        return self.read_fields(env.ObstaclePath, value, path)

    def read_variant(self, classes: Mapping[str, type[_Value]], value: Any, path: JsonPath) -> _Value:
        """Read an object whose class is given by its key ``kind``."""
        expected = f"one of {', '.join(classes)}"
        members = self.require_type(dict, value, path, f"an object whose kind is {expected}")
        if "kind" not in members:
            self.fail((*path, "kind"), f"missing, expected {expected}")
        kind = members["kind"]
        # A tuple, because a value from JSON may be unhashable.
        if kind not in tuple(classes):
            self.fail((*path, "kind"), f"expected {expected}, got {quote_json(kind)}")
        return self.read_fields(classes[kind], members, path, other_keys=("kind",))

    def read_fields(
        self, cls: type[_Value], value: Any, path: JsonPath, other_keys: Sequence[str] = ()
    ) -> _Value:
        """Read an instance of a dataclass from a JSON object whose keys are the fields.

        Fields with the default None may also be null.
        """
        dataclass_fields: tuple[Field[Any], ...] = fields(cls)  # type: ignore[arg-type]
        names = [field.name for field in dataclass_fields]
        members = self.read_object(value, path, [*other_keys, *names])
        arguments = {}
        for field in dataclass_fields:
            name = field.name
            is_default = name in members and members[name] is None and field.default is None
            if name in members and not is_default:
                arguments[name] = self._readers[name](members[name], (*path, name))
            elif field.default is MISSING:
                self.fail((*path, name), f"missing, expected {_REQUIRED_VALUES[name]}")
        return cls(**arguments)
