"""Worlds of the simulator Stage: https://player-stage-manual.readthedocs.io/en/latest/WORLDFILES/.

A world file is a tree of models with properties, of macros that others are made of, and of files that it
includes. A model is as large as its ``size``, whatever its bitmap or its blocks measure: the box around
them is scaled to it.

R. Vaughan, Massively multi-robot simulation in Stage, Swarm Intelligence 2 (2008), 189-208.

Models are obstacles unless nothing meets them (``obstacle_return 0`` and no ``ranger_return``); robots
(``position``) are places to start; sensors and the like are left out. The map is the largest model with a
bitmap or a ``boundary``, if most of the others are in it.
"""

from __future__ import annotations

import math
import re
from collections import deque
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array
from robocov.errors import MapError, quote, to_one_line
from robocov.mapfile.models import MAX_COORDINATE_M
from robocov_app.formats import files
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.frames import UNIT_SQUARE, build_frame, transform_points
from robocov_app.formats.geometry.polygons import to_multipolygon
from robocov_app.formats.geometry.shapes import ClosedOutline, Shapes
from robocov_app.formats.geometry.vectorize import count_polygon_vertices, outline_free_cells
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.picture import describe_transparency, read_picture

MAX_BYTES = 5_000_000
"""Largest file of a world, and largest size of all included files together."""
MAX_TOKENS = 200_000
"""Largest number of words and numbers."""
MAX_ENTITIES = 10_000
"""Largest number of models and blocks, macros expanded."""
_DARK = 127 / 255  # pixels that are not brighter are solid
_TOKEN = re.compile(
    r"(?P<blank>(?>[ \t\r\n]+|#[^\n]*)++)|(?P<word>[A-Za-z_][\w.-]*(?:\[\d+\][\w.-]*)*)"
    r'|(?P<number>[-+.\d][-+.\w]*)|"(?P<string>[^"\n]*)"|(?P<mark>[()\[\]])|(?P<strange>[\s\S])'
)
MODELS = re.compile(rb"^\s*(?:define\s+\S+\s+\S+|floorplan|model|position|window)\s*\(", re.MULTILINE)
_MARKS = ("(", ")", "[", "]")
_LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001}


class _Token(NamedTuple):
    kind: str
    text: str
    at: str

    def refuse(self, expected: str) -> NoReturn:
        """Raise the MapError of this token."""
        raise MapError(f"{self.at}: expected {expected}, got {quote(self.text)}")


@dataclass(frozen=True, eq=False)
class _Entity:
    """A model, a block or a window: its properties, and the entities within."""

    type: str
    at: str
    properties: dict[str, list[str]] = field(default_factory=dict)
    inside: list[_Entity] = field(default_factory=list)

    def text(self, name: str, default: str = "") -> str:
        """Return the first value of a property."""
        return self.properties.get(name, [default])[0]

    def numbers(self, name: str, default: tuple[float, ...]) -> Array:
        """Return the values of a property as numbers; missing ones are as in `default`."""
        given = self.properties.get(name, [])[: len(default)]
        values = np.array([*map(files.parse_number, given), *default[len(given) :]])
        if not (np.abs(values) <= MAX_COORDINATE_M).all():
            raise MapError(f"{self.at}: expected numbers within 1e7, got {name} {quote(' '.join(given))}")
        return values

    def number(self, name: str, default: float) -> float:
        """Return the first value of a property as a number."""
        return float(self.numbers(name, (default,))[0])


@dataclass(frozen=True, eq=False)
class _Room:
    """The box of a model, m, and what is free in it: all, but for the dark of its bitmap."""

    box: Polygon
    free: MultiPolygon
    labels: tuple[str, ...]
    cell: float | None = None


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return path.suffix.lower() == ".world" and MODELS.search(head) is not None


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read a world with its includes and bitmaps.

    Raises
    ------
    MapError
        If the file is damaged, too large, or contains no map.
    """
    shapes = Shapes(to_one_line(path), options)
    world = _World(path, shapes)
    world.place(world.root.inside, np.eye(3))
    rooms = sorted(world.rooms, key=lambda room: -room.box.area)
    places = [*(outline.area.representative_point() for outline in shapes.outlines)]
    places += [*(room.box.centroid for room in rooms), *map(shapely.Point, shapes.robots)]
    main = next((room for room in rooms if shapely.covers(room.box, places).mean() > 0.5), None)
    for room in rooms:
        dark = (
            to_multipolygon(shapely.difference(room.box, room.free)) if room is not main else MultiPolygon()
        )
        if not dark.is_empty:
            shapes.outlines.append(ClosedOutline(dark, room.labels))
    free = None if main is None else main.free
    source = ""
    if free is None and shapes.outlines:
        found = shapes.find_surrounding()
        free = found.area
        source = found.source
    shapes.cell = max((room.cell for room in rooms if room.cell is not None), default=None)
    name = world.root.text("name") or path.stem
    foreign = shapes.build_foreign_map(name, "A world of Stage, imported.", solid=True, world=free)
    return replace(foreign, boundary_source=source) if source else foreign


class _World:
    """Reads a world and places its models."""

    def __init__(self, path: Path, shapes: Shapes) -> None:
        self.path, self.shapes = path, shapes
        self.tokens: deque[_Token] = deque()
        self.entities = self.pixels = 0
        self.macros: dict[str, _Entity] = {}
        self.bitmaps: dict[Path, tuple[MultiPolygon, int, int]] = {}
        self.rooms: list[_Room] = []
        self.includes = files.IncludeBudget(max_bytes=MAX_BYTES)
        self._split(path, (path,))
        self.root = _Entity("world", shapes.where)
        self._fill(self.root, 0)
        self.meter = _LENGTHS.get(self.root.text("unit_length", "m"), 1.0)
        self.turn = 1.0 if self.root.text("unit_angle") == "radians" else math.pi / 180

    def _named(self, name: str, what: str, at: str) -> Path:
        notes, anywhere = self.shapes.notes, self.shapes.options.anywhere
        return files.find_named_file(self.path, name, what, at=at, notes=notes, allow_anywhere=anywhere)

    def _split(self, path: Path, including: tuple[Path, ...]) -> None:
        """Append the tokens of a file and of those that it includes; `including` are the files above it."""
        world = files.read_content(path, MAX_BYTES).decode("utf-8", "replace")
        line, name, include = 1, to_one_line(path), False
        for found in _TOKEN.finditer(world):
            kind, text = str(found.lastgroup), found[found.lastgroup or 0]
            token = _Token(text if kind == "mark" else kind, text, f"{name}:{line}")
            line += found[0].count("\n")
            if token.kind == "blank":
                continue
            if token.kind == "strange":
                strange = world[found.start() : found.start() + 20]
                token._replace(text=strange).refuse("a word, a number or a bracket")
            if include:
                self._include(token, including)
            elif token[:2] != ("word", "include"):
                if len(self.tokens) >= MAX_TOKENS:
                    what = f"more than {MAX_TOKENS} words and numbers"
                    raise MapError(f"{token.at}: expected fewer, got {what}")
                self.tokens.append(token)
            include = not include and token[:2] == ("word", "include")

    def _include(self, token: _Token, including: tuple[Path, ...]) -> None:
        if token.kind != "string":
            token.refuse("a file to include")
        path = self._named(token.text, "file", token.at)
        is_own_part = any(path.resolve() == each.resolve() for each in including)
        if is_own_part or len(including) > files.MAX_DEPTH:
            token.refuse("a file to include, which does not include itself,")
        self.includes.take(path, token.at)
        self._split(path, (*including, path))

    def _fill(self, entity: _Entity, depth: int) -> None:
        end = _Token("", "the end of the file", entity.at)
        if depth > files.MAX_DEPTH:
            raise MapError(f"{entity.at}: nested deeper than {files.MAX_DEPTH}")
        while self.tokens:
            token = self.tokens.popleft()
            ahead = [*islice(self.tokens, 3), end, end, end]
            if depth and token.kind == ")":
                return
            if token.kind != "word":
                token.refuse("the name of a model or a property" + (", or )," if depth else ""))
            macro = [after.kind for after in ahead[:2]] == ["word", "word"] and ahead[2].kind in _MARKS
            if token.text == "define" and macro:
                name, kind, _ = (self.tokens.popleft() for _ in range(3))
                whole = _Entity(kind.text, token.at)
                self._fill(whole, depth + 1)
                self.macros.setdefault(name.text, whole)
            elif ahead[0].kind == "(":
                self.tokens.popleft()
                entity.inside.append(_Entity(token.text, token.at))
                self._fill(entity.inside[-1], depth + 1)
            else:
                entity.properties[token.text] = self._values(token)
        if depth:
            end.refuse("a ) after what begins here")

    def _values(self, name: _Token) -> list[str]:
        values = [self.tokens.popleft()] if self.tokens else [name]
        if values[0].kind == "[":
            values = []
            while self.tokens and self.tokens[0].kind not in _MARKS:
                values.append(self.tokens.popleft())
            if not self.tokens or self.tokens.popleft().text != "]":
                name.refuse("a ] after its values")
        if not all(value.kind in ("number", "string") for value in values):
            name.refuse("a value, or ( and ), after it")
        return [value.text for value in values] or [""]

    def place(self, entities: list[_Entity], frame: Array, depth: int = 0) -> None:
        """Place models in the frame of their parent, a (3, 3) matrix to meters, and what is in them."""
        for given in entities:
            entity, labels = self._expanded(given)
            if depth > files.MAX_DEPTH:
                raise MapError(f"{entity.at}: nested in more than {files.MAX_DEPTH} models")
            if entity.type in ("window", "block"):
                continue
            here = frame @ self._pose(entity, "pose")
            if entity.type not in ("model", "position"):
                self.shapes.leave_out(to_one_line(entity.type)[:30])
            elif not self.shapes.accept(labels):
                continue
            elif entity.type == "position":
                self.shapes.robots.append((float(here[0, 2]), float(here[1, 2])))
            else:
                seen = min(entity.number(name, 1.0) for name in ("ranger_return", "laser_return")) > 0
                if seen or entity.number("obstacle_return", 1.0) != 0 or "bitmap" in entity.properties:
                    self._shape(entity, here @ self._pose(entity, "origin"), labels)
                else:
                    self.shapes.leave_out("model", "that nothing meets")
                self.place(entity.inside, here, depth + 1)

    def _expanded(self, entity: _Entity) -> tuple[_Entity, tuple[str, ...]]:
        """Return an entity with all that its macros say, and its name and theirs."""
        chain = [entity]
        while chain[-1].type in self.macros:
            chain.append(self.macros[chain[-1].type])
            if len(chain) > files.MAX_DEPTH:
                raise MapError(f"{entity.at}: the model {quote(entity.type)} is made of itself")
        self.entities += 1 + sum(len(part.inside) for part in chain)
        if self.entities > MAX_ENTITIES:
            raise MapError(f"{entity.at}: expected at most {MAX_ENTITIES} models and blocks, got more")
        whole = _Entity(chain[-1].type, entity.at)
        for part in reversed(chain):
            whole.properties.update(part.properties)
            whole.inside.extend(part.inside)
        names = [whole.text("name"), *(part.type for part in chain)]
        return whole, tuple(name for name in names if name)

    def _pose(self, entity: _Entity, name: str) -> Array:
        """Return the matrix of a pose [x y z heading], or [x y heading] as Stage 2 has it."""
        x, y, *turns = entity.numbers(name, (0.0, 0.0, 0.0, 0.0)).tolist()
        turn = turns[0 if len(entity.properties.get(name, [])) == 3 else 1]
        return build_frame(x * self.meter, y * self.meter, turn * self.turn)

    def _shape(self, entity: _Entity, around: Array, labels: tuple[str, ...]) -> None:
        size = entity.numbers("size", (0.4, 0.4)) * self.meter
        for length in size.tolist():
            files.require_length(length, f"{entity.at}: size")

        def placed(points: Array) -> Array:
            """Return (n, 2) places in a box of side 1 about the origin, in meters in the world."""
            return np.round(transform_points(around, points * size), 9) + 0.0

        box = Polygon(placed(UNIT_SQUARE))
        rings = _blocks(entity)
        for inner in entity.inside:
            block, _ = self._expanded(inner)
            rings += _blocks(block) if block.type == "block" else []
        if "bitmap" in entity.properties:
            file = self._named(entity.text("bitmap"), "picture", f"{entity.at}: bitmap")
            free, columns, rows = self._bitmap(file)
            self.shapes.count_vertices(count_polygon_vertices(free))
            cell = float(max(size[0] / columns, size[1] / rows))
            self.rooms.append(_Room(box, shapely.transform(free, placed), labels, cell))
            if rings:
                self.shapes.leave_out("block", "beside a bitmap", len(rings))
            return
        if rings:
            low, high = np.concatenate(rings).min(axis=0), np.concatenate(rings).max(axis=0)
            extent = np.maximum(high - low, 1e-12)
            rings = [placed((ring - (low + high) / 2) / extent) for ring in rings]
            if entity.number("boundary", 0):
                self.rooms.append(_Room(box, MultiPolygon([box]), labels))
        elif not entity.number("noblocks", 0):
            rings = [np.asarray(box.exterior.coords)[:-1]]
        for ring in rings:
            self.shapes.add_outline([ring], labels, at=entity.at, thing="block")

    def _bitmap(self, file: Path) -> tuple[MultiPolygon, int, int]:
        """Return what is light in the box around all dark pixels, of side 1, and its columns and rows."""
        if file not in self.bitmaps:
            where = to_one_line(file)
            picture = read_picture(file, where)
            self.pixels += picture.level.size
            if self.pixels > files.MAX_CELLS:
                what = f"with those before it more than {files.MAX_CELLS // 1_000_000} million pixels"
                raise MapError(f"{where}: expected fewer, got {what}")
            dark = picture.level <= _DARK * picture.full
            transparency = describe_transparency(picture)
            if transparency:
                self.shapes.notes.append(f"{to_one_line(file.name)}: {transparency}")
            if not dark.any() or (transparency and dark.all()):
                what = "dark" if dark.any() else "light"
                cause = f": {transparency}" if transparency else ""
                raise MapError(f"{where}: all is {what}, expected a picture with dark walls{cause}")
            row, column = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
            light = ~dark[row[0] : row[-1] + 1, column[0] : column[-1] + 1]
            rows, columns = light.shape
            sides = 1 / columns, 1 / rows
            free = outline_free_cells(light, sides, (-0.5, -0.5), where) if light.any() else MultiPolygon()
            self.bitmaps[file] = free, columns, rows
        return self.bitmaps[file]


def _blocks(entity: _Entity) -> list[Array]:
    """Return the polygons of a block, or of a model as Stage 2 has it: ``block[0].point[1] [x y]``."""
    rings: dict[str, dict[int, Array]] = {}
    for name in entity.properties:
        prefix, found, number = name.removesuffix("]").rpartition("point[")
        if found and name.endswith("]") and number.isdecimal() and len(number) < 9:
            rings.setdefault(prefix, {})[int(number)] = entity.numbers(name, (0.0, 0.0))
    for prefix, points in rings.items():
        count = entity.number(f"{prefix}points", len(points))
        if count != len(points):
            raise MapError(f"{entity.at}: expected {count:g}, as it says, got {len(points)} points")
    return [np.array([points[k] for k in sorted(points)]) for points in rings.values()]
