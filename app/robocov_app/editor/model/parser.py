"""Sketches read from documents: what a map may not be is kept, what is no map at all is refused."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from robocov import environment as env
from robocov.environment import Obstacle, Point, Ring
from robocov.errors import (
    JsonPath,
    MapError,
    Mistake,
    describe_unknown_name,
    format_path,
    quote_json,
    to_one_line,
)
from robocov.files.documents import check_header
from robocov.files.strictjson import locate_mistakes, parse_json, require_json
from robocov.mapfile import parse_density
from robocov.mapfile.models import FORMAT, VERSION, MapModel
from robocov_app.editor.model.background import read_marks
from robocov_app.editor.model.sketch import KINDS, Item, Sketch

_MAP = [field.alias or name for name, field in MapModel.model_fields.items()]
_OBSTACLES: dict[str, type[Obstacle]] = {kind: shape for shape, kind in KINDS.items()}
_STARTS: dict[str, Any] = {"disc": env.DiscStart, "uniform": env.UniformStart, "points": env.PointsStart}
# parser method of each key
_READ_AS = {"center": "point", "holes": "rings", "name": "text", "path": "way", "repeat": "repeat"}
_READ_AS |= dict.fromkeys(("vertices", "points", "positions"), "ring")
_READ_AS |= dict.fromkeys(("radius", "width", "speed"), "number")
# extent of a raster on a map without a boundary, m, unless it states its own
_UNBOUNDED: Ring = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
_Read = TypeVar("_Read")


def parse_sketch(text: str | bytes, where: str, folder: Path | None = None) -> Sketch:
    """Return the sketch in the text of a file; messages call it `where`, and `folder` holds its pictures."""
    document = parse_json(text, where)
    try:
        return build_sketch(document, where, folder)
    except MapError as error:
        raise locate_mistakes(error, text, where) from None


def build_sketch(document: Any, where: str = "map", folder: Path | None = None) -> Sketch:
    """Return the sketch in a parsed document, whatever rule it breaks; MapError where it is no map at all."""
    where = to_one_line(where)
    require_json(document, where)
    check_header(document, where, FORMAT, VERSION)
    reader = _Reader(where)
    members = reader.members(document, (), _MAP)
    obstacles = reader.typed(list, members.get("obstacles", []), ("obstacles",), "a list of obstacles")
    shapes = [reader.either(_OBSTACLES, value, ("obstacles", k)) for k, value in enumerate(obstacles)]
    starts = reader.typed(dict, members.get("starts", {}), ("starts",), "an object")
    extra = reader.typed(dict, members.get("extra", {}), ("extra",), "an object")
    marks, background, others = read_marks(extra, [shape.name for shape in shapes])
    boundary, schema, density = (members.get(key) for key in ("boundary", "$schema", "density"))
    boundary = None if boundary is None else reader.ring(boundary, ("boundary",))
    return Sketch(
        name=reader.text(members.get("name", ""), ("name",)),
        description=reader.text(members.get("description", ""), ("description",)),
        boundary=boundary,
        obstacles=tuple(Item(k, shape, **marks.get(k, {})) for k, shape in enumerate(shapes)),
        starts=tuple((name, reader.either(_STARTS, spec, ("starts", name))) for name, spec in starts.items()),
        background=background,
        extra=others,
        schema=None if schema is None else reader.text(schema, ("$schema",)),
        density=None if density is None else parse_density(density, boundary or _UNBOUNDED, where, folder),
    )


class _Reader:
    """Reads parts of the map document that messages call `where`; each MapError names the place in it."""

    def __init__(self, where: str) -> None:
        self._where = where

    def refuse(self, path: JsonPath, what: str, *, at_key: bool = False) -> NoReturn:
        at = f"{format_path(path[:-1] if at_key else path)}: " if path[: -1 if at_key else None] else ""
        raise MapError.from_mistakes(self._where, [Mistake(path, at + what, at_key)])

    def typed(self, kind: type[_Read], value: Any, path: JsonPath, wanted: str) -> _Read:
        if not isinstance(value, kind):
            self.refuse(path, f"expected {wanted}, got {quote_json(value)}")
        return value

    def members(self, value: Any, path: JsonPath, known: Sequence[str]) -> dict[str, Any]:
        for key in self.typed(dict, value, path, "an object"):
            if key not in known:
                self.refuse((*path, key), describe_unknown_name("key", str(key), known), at_key=True)
        return value  # type: ignore[no-any-return]

    def text(self, value: Any, path: JsonPath) -> str:
        return self.typed(str, value, path, "a string")

    def number(self, value: Any, path: JsonPath) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            self.refuse(path, f"expected a number, got {quote_json(value)}")
        return float(value)

    def point(self, value: Any, path: JsonPath) -> Point:
        if not isinstance(value, list | tuple) or len(value) != 2:
            self.refuse(path, f"expected a point [x, y] in meters, got {quote_json(value)}")
        x, y = value
        if type(x) is float and type(y) is float:  # most of a large file: no path for each
            return x, y
        return self.number(x, (*path, 0)), self.number(y, (*path, 1))

    def ring(self, value: Any, path: JsonPath) -> Ring:
        points = self.typed(list, value, path, "a list of points [x, y]")
        return tuple([self.point(point, (*path, k)) for k, point in enumerate(points)])

    def rings(self, value: Any, path: JsonPath) -> tuple[Ring, ...]:
        rings = self.typed(list, value, path, "a list of rings")
        return tuple([self.ring(ring, (*path, k)) for k, ring in enumerate(rings)])

    def repeat(self, value: Any, path: JsonPath) -> env.Repeat:
        if value not in env.REPEATS:
            self.refuse(path, f"expected one of {', '.join(env.REPEATS)}, got {quote_json(value)}")
        return value  # type: ignore[no-any-return]

    def way(self, value: Any, path: JsonPath) -> env.ObstaclePath:
        return self.built(env.ObstaclePath, value, path)

    def either(self, classes: Mapping[str, type[_Read]], value: Any, path: JsonPath) -> _Read:
        wanted = f"one of {', '.join(classes)}"
        if "kind" not in self.typed(dict, value, path, f"an object whose kind is {wanted}"):
            self.refuse((*path, "kind"), "missing")
        kind = value["kind"]
        if kind not in tuple(classes):
            self.refuse((*path, "kind"), f"expected {wanted}, got {quote_json(kind)}")
        return self.built(classes[kind], value, path, "kind")

    def built(self, of: type[_Read], value: Any, path: JsonPath, *more: str) -> _Read:
        """Return an object of a dataclass whose fields are the keys; what may be None may also be null."""
        known: tuple[Field[Any], ...] = fields(of)  # type: ignore[arg-type]
        members = self.members(value, path, [*more, *(field.name for field in known)])
        found = {}
        for key, default in ((field.name, field.default) for field in known):
            if key in members and not (members[key] is None and default is None):
                found[key] = getattr(self, _READ_AS[key])(members[key], (*path, key))
            elif default is MISSING:
                self.refuse((*path, key), "missing")
        return of(**found)
