"""Tile maps of Tiled: https://doc.mapeditor.org/en/stable/reference/tmx-map-format/.

Read here, with limits, and not by pytmx or pytiled-parser: these unpack whatever size a file has, and open
whatever other file it names.

Solid are the tiles that say so, by a property or class (``collides``, ``solid``, ``wall`` and the like) or by
collision objects; of a layer without any such tile all, if the option ``only`` names it, or its name, class
or a property says so. Objects are solid if they or their layer say so or are asked for, and all of them where
nothing else is. Hidden layers count: those of walls mostly are hidden. `options`: ``cell`` is the width of a
tile in metres, or ``scale`` that of a pixel.
"""

import binascii
import math
import re
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, BoolArray
from robocov.environment import CircleObstacle
from robocov.errors import MapError, ParameterError, format_count, quote, summarize_names, to_one_line
from robocov_app.formats import files
from robocov_app.formats.files.xml_tree import MAX_ELEMENTS, Element, read_xml_tree
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.frames import build_frame, transform_points
from robocov_app.formats.geometry.shapes import Shapes, WallLine
from robocov_app.formats.geometry.vectorize import count_polygon_vertices, outline_free_cells
from robocov_app.formats.options import ReadOptions

MOST_TILES, MOST_READ = 4_000_000, 16_000_000  # of a map, and of all its layers together
MOST_PARTS = 10_000  # collision objects, each as often as its tile is there, and tiles beside the grid
CELL = 1.0  # width of a tile in metres where none is given: the format has only pixels
_FLIPPED, _UPSIDE, _SWAPPED, _ID = 0x80000000, 0x40000000, 0x20000000, 0x0FFFFFFF  # bits of a global ID
_RECTANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
ROOT = re.compile(rb"<map[\s>]")
_SOLID = re.compile(
    r"(is|has|ge)?(collid(e|es|er|ers|able)|collisions?|(map)?walls?|solids?|block(s|ed|ing)?|obstacles?)"
    r"(layer|tiles?|objects?)?"
)
_DISC = CircleObstacle((0.0, 0.0), 1.0).polygon
_NO = ("false", "0", "no")
_START = re.compile(r"(robot|start|spawn)s?")
_IDs: TypeAlias = NDArray[np.uint32]


class _Tile(NamedTuple):
    """A tile that is solid: as a whole, or in the shape of its collision objects, if it has `parts`.

    `size`, `offset`, px: of its picture, and how far that is drawn from the lower left of the cell.
    """

    parts: list[Element]
    size: Array
    offset: Array


class _Layer(NamedTuple):
    """A layer of tiles or objects, with its labels and those of the groups around it; `offset` px, y down.

    `wall`: whether it is asked for, or says itself that it is solid.
    """

    element: Element
    labels: tuple[str, ...]
    offset: Array
    wall: bool


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return ROOT.search(head) is not None and b"tilewidth" in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    return _Map(path, options).read()


class _Map:
    """Reads a map: its tilesets and layers."""

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self.path, self.options = path, options
        self.root = root = read_xml_tree(path, "map", "TMX", ("data", "chunk"))
        self.shapes = shapes = Shapes(root.where, options)
        self.tiles_read = self.parts = 0
        orientation = root.attributes.get("orientation", "orthogonal")
        if orientation != "orthogonal":
            root.refuse(f"expected an orthogonal map, got {to_one_line(orientation)[:20]}")
        self.tile = np.array([_whole(root, name, 1) for name in ("tilewidth", "tileheight")], float)
        cell, scale = options.cell, options.scale
        if cell is not None and scale is not None:
            raise ParameterError(
                "--cell, --scale: expected one of them, because both say how large a tile is"
            )
        if cell is None and scale is None:
            shapes.notes.append(f"no size of a tile was given: {CELL:g} m wide taken (--cell)")
        self.pixel = scale or (cell or CELL) / float(self.tile[0])
        files.require_length(self.pixel * float(self.tile.max()), f"{root.where}: the side of a tile")
        self.corner = np.zeros(2)
        self.shape = (0, 0)

    def read(self) -> ForeignMap:
        shapes, where, tiles = self.shapes, self.root.where, self._tiles()
        layers = [*self._layers(self.root, (), np.zeros(2), wall=False)]
        grids = self._grids([layer for layer in layers if layer.element.tag == "layer"])
        solid = np.zeros(self.shape, dtype=bool)
        for layer, ids in grids:
            solid |= self._solid(layer, ids, tiles)
        self._add_objects([layer for layer in layers if layer.element.tag != "layer"], anything=not grids)
        shapes.labels.require_known_names()
        if not (solid.any() or shapes.outlines or shapes.lines or shapes.pillars):
            names = summarize_names([quote(layer.labels[0]) for layer in layers if layer.labels])
            nothing = "nothing is solid by properties, collision objects or names of layers"
            wanted = f"expected --only LAYER with one of walls: {names or 'there is none'}"
            raise MapError(f"{where}: {nothing}, {wanted}")
        width, height = (self.pixel * self.tile).tolist()
        world = outline_free_cells(~solid, (width, height), (0.0, 0.0), where)
        shapes.count_vertices(count_polygon_vertices(world))
        shapes.cell = max(width, height) if solid.any() else None
        return shapes.build_foreign_map(self.path.stem, "A map of Tiled, imported.", solid=True, world=world)

    def _tiles(self) -> dict[int, _Tile]:
        found: dict[int, _Tile] = {}
        budget = files.IncludeBudget()
        elements = 0
        for tileset in self.root.children:
            if tileset.tag != "tileset":
                continue
            first = _whole(tileset, "firstgid", 1)
            source = tileset.attributes.get("source")
            if source is not None:
                at, anywhere = f"{tileset.where}:{tileset.line}", self.options.anywhere
                file = files.find_named_file(
                    self.path, source, "tileset", at=at, notes=self.shapes.notes, allow_anywhere=anywhere
                )
                budget.take(file, at)
                tileset = read_xml_tree(file, "tileset", "TSX")
                elements += sum(1 for _ in tileset.iterate())
                if elements > MAX_ELEMENTS:
                    raise MapError(
                        f"{at}: tilesets of more than {MAX_ELEMENTS} elements, expected at most that"
                    )
            size = np.array([_number(tileset, name) for name in ("tilewidth", "tileheight")])
            drawn = tileset.find_child("tileoffset")
            offset = np.zeros(2) if drawn is None else np.array([_number(drawn, name) for name in "xy"])
            for tile in tileset.children:
                if tile.tag != "tile":
                    continue
                group = tile.find_child("objectgroup")
                parts = [] if group is None else group.children
                if parts or _says_solid(tile):
                    found[first + _whole(tile, "id", 0)] = _Tile(parts, size, offset)
        return found

    def _layers(
        self, parent: Element, labels: tuple[str, ...], offset: Array, *, wall: bool
    ) -> Iterator[_Layer]:
        shapes = self.shapes
        for element in parent.children:
            if element.tag not in ("layer", "objectgroup", "group"):
                continue
            names = (*filter(None, map(element.attributes.get, ("name", "class"))), *labels)
            found = shapes.labels.register(names)
            shifted = offset + [_number(element, key) for key in ("offsetx", "offsety")]
            says = wall or (
                _says_solid(element, names)
                if shapes.labels.only is None
                else bool(shapes.labels.only & found)
            )
            if shapes.labels.skip & found:
                shapes.leave_out("layer", "by the names that were asked for")
            elif element.tag == "group":
                yield from self._layers(element, names, shifted, wall=says)
            elif element.tag == "objectgroup" or shapes.labels.only is None or says:
                yield _Layer(element, names, shifted, says)

    def _grids(self, layers: list[_Layer]) -> list[tuple[_Layer, _IDs]]:
        """Return layers of tiles with global IDs, (rows, columns) of the map, whose corner it finds."""
        given = [(layer, [*self._pieces(layer.element)]) for layer in layers]
        pieces = [piece for _, some in given for piece in some]
        left = top = 0
        right, bottom = (_whole(self.root, name, 1) for name in ("width", "height"))
        infinite = bool(pieces) and self.root.attributes.get("infinite", "0") != "0"
        if infinite:
            left, top = min(x for x, _, _ in pieces), min(y for _, y, _ in pieces)
            right, bottom = (max(piece[k] + piece[2].shape[1 - k] for piece in pieces) for k in (0, 1))
        elif any((x, y, *ids.shape) != (0, 0, bottom, right) for x, y, ids in pieces):
            self.root.refuse(f"expected one of {right} x {bottom} tiles, got a layer of another size")
        self.shape = bottom - top, right - left
        if math.prod(self.shape) > MOST_TILES or math.prod(self.shape) * len(given) > MOST_READ:
            found = f"{right - left} x {bottom - top} tiles in {format_count(len(given), 'layer')}"
            self.root.refuse(f"expected fewer, got {found}")
        grids = []
        for layer, some in given:
            grid = np.zeros(self.shape, np.uint32)
            for x, y, ids in some:
                grid[y - top : y - top + len(ids), x - left : x - left + ids.shape[1]] = ids
            grids.append((layer, grid))
        used = np.logical_or.reduce([grid & _ID != 0 for _, grid in grids]) if infinite else np.empty((0, 0))
        if used.any():  # chunks have empty edges
            rows, columns = (np.flatnonzero(used.any(axis=axis)) for axis in (1, 0))
            part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
            grids = [(layer, grid[part]) for layer, grid in grids]
            left, bottom, self.shape = left + int(columns[0]), top + int(rows[-1]) + 1, grids[0][1].shape
        self.corner = np.array([left, bottom]) * self.tile
        return grids

    def _pieces(self, layer: Element) -> Iterator[tuple[int, int, _IDs]]:
        """Yield the tiles of a layer: all, or, of an infinite map, chunk by chunk, with column and row."""
        data = layer.find_child("data")
        if data is None:
            return
        chunks = [child for child in data.children if child.tag == "chunk"]
        for part in chunks or [data]:
            width, height = (_whole(part if chunks else layer, name, 1) for name in ("width", "height"))
            self.tiles_read += width * height
            if self.tiles_read > MOST_READ:
                part.refuse(f"expected at most {MOST_READ} tiles in all, got more")
            x, y = (_whole(part, name, -MOST_READ, "0") for name in "xy") if chunks else (0, 0)
            yield x, y, _decoded(part, data, width * height).reshape(height, width)

    def _metres(self, points: Array) -> Array:
        return np.asarray((points - self.corner) * [self.pixel, -self.pixel])

    def _solid(self, layer: _Layer, ids: _IDs, tiles: dict[int, _Tile]) -> BoolArray:
        """Return which cells a layer makes solid as a whole, and add what it makes solid besides."""
        place = self.corner - [0.0, self.shape[0] * self.tile[1]] + layer.offset
        full = np.isin(ids & _ID, [gid for gid, tile in tiles.items() if not tile.parts])
        if not np.isin(ids & _ID, [*tiles]).any():
            full = (ids & _ID != 0) & layer.wall
        in_parts = np.isin(ids & _ID, [gid for gid, tile in tiles.items() if tile.parts])
        cells = np.argwhere(in_parts)
        gids, kinds = np.unique(ids[in_parts], return_inverse=True)
        own_figures = {gid: [_figure(part) for part in tiles[gid].parts] for gid in {*(gids & _ID).tolist()}}
        figures = [own_figures[gid] for gid in (gids & _ID).tolist()]
        is_whole = np.array([self._fills_tile(each) for each in figures], dtype=bool)
        rows, columns = cells[is_whole[kinds]].T
        full[rows, columns] = True
        part_counts = np.array([len(each) for each in figures], dtype=int)
        self._require_few_parts(int(part_counts[kinds[~is_whole[kinds]]].sum()))
        # by kind, and of a kind row by row
        for k in np.flatnonzero(~is_whole[kinds])[
            np.argsort(kinds[~is_whole[kinds]], kind="stable")
        ].tolist():
            gid = int(gids[kinds[k]])
            row, column = cells[k].tolist()
            tile = tiles[gid & _ID]
            corner = place + [column, row + 1] * self.tile - [0.0, tile.size[1]] + tile.offset
            for part, (kind, points) in zip(tile.parts, figures[kinds[k]], strict=True):
                self._add_part(part, kind, corner + _turned(points, gid, tile.size), layer.labels)
        if layer.offset.any():  # beside the grid
            for row, column in np.argwhere(full).tolist():
                cell = place + np.add(_RECTANGLE, [column, row]) * self.tile
                self._add_part(layer.element, "polygon", cell, layer.labels)
            full = np.zeros_like(full)
        return full

    def _fills_tile(self, figures: list[tuple[str, Array]]) -> bool:
        return any(np.array_equal(points, _RECTANGLE * self.tile) for _, points in figures)

    def _require_few_parts(self, more: int) -> None:
        if self.parts + more > MOST_PARTS:
            self.root.refuse(f"expected at most {MOST_PARTS} parts of tiles, got more")

    def _add_part(self, element: Element, kind: str, points: Array, labels: tuple[str, ...]) -> None:
        self._require_few_parts(1)
        self.parts += 1
        self._add(element, kind, points, labels)

    def _add_objects(self, layers: list[_Layer], *, anything: bool) -> None:
        """Add the objects that are solid, or all; those that are called robots are places to start."""
        shapes = self.shapes
        for layer in layers:
            for element in layer.element.children:
                given = [element.attributes.get(key, "") for key in ("name", "class", "type")]
                labels = (*filter(None, given), *layer.labels)
                found = shapes.labels.register(labels)
                if element.tag != "object" or shapes.labels.skip & found:
                    continue
                kind, points = _figure(element)
                points = points + layer.offset
                says = anything or layer.wall or _says_solid(element, labels)
                if kind and any(_START.fullmatch(_plain(label)) for label in given):
                    x, y = self._metres(points.mean(axis=0)).tolist()
                    shapes.robots.append((x, y))
                elif says if shapes.labels.only is None else shapes.labels.only & found:
                    self._add(element, kind, points, labels)
                else:
                    shapes.leave_out("object", "not solid by name or property (--only NAME takes it)")

    def _add(self, element: Element, kind: str, points: Array, labels: tuple[str, ...]) -> None:
        """Add an obstacle of a kind, as of `_figure`, in pixels on the map."""
        shapes, at, points = self.shapes, f"line {element.line}", self._metres(points)
        if kind == "line":
            shapes.add_line(WallLine(points, shapes.thickness, labels), at=at)
        elif kind == "circle" and (points[0] != points[1]).any():
            shapes.add_circle(points[0], float(np.hypot(*(points[1] - points[0]))), labels, at=at)
        elif kind == "point":
            shapes.add_point(points[0], at=at)
        elif kind != "polygon" or not shapes.add_outline([points], labels, at=at, thing=""):
            shapes.leave_out("object", "of text, a template or without an area")


def _decoded(part: Element, data: Element, count: int) -> _IDs:
    """Return so many global IDs of tiles, encoded as `data` says."""
    encoding, packing = (data.attributes.get(key, "") for key in ("encoding", "compression"))
    if encoding == "base64" and packing in ("", "zlib", "gzip"):
        try:
            raw = binascii.a2b_base64("".join(part.text.split()), strict_mode=True)
            if packing:  # not more than there should be, whatever is in it
                raw = zlib.decompressobj(wbits=47).decompress(raw, 4 * count + 1)
        except (ValueError, zlib.error) as error:
            part.refuse(f"not {packing or encoding}: {to_one_line(error)[:60]}")
        ids = np.frombuffer(raw, "<u4", min(count, len(raw) // 4)) if len(raw) <= 4 * count else None
    elif encoding == "csv":
        more = part.text.count(",") > count  # a comma may end it
        numbers = files.parse_integers("" if more else part.text, ",")
        if numbers is None or not ((numbers >= 0) & (numbers < 2**32)).all():
            part.refuse("expected whole numbers from 0, separated by commas")
        ids = None if more else numbers.astype(np.uint32)
    elif not encoding:
        tiles = [child for child in part.children if child.tag == "tile"]
        ids = np.array([_whole(tile, "gid", 0, "0") for tile in tiles], np.uint32)
    else:
        name = " ".join(filter(None, (to_one_line(encoding)[:20], to_one_line(packing)[:20])))
        part.refuse(f"expected CSV, or base64 with zlib or gzip or neither, got {name}")
    if ids is None or len(ids) != count:
        part.refuse(f"expected {count} tiles, as it says, got {'more' if ids is None else len(ids)}")
    return ids


def _figure(element: Element) -> tuple[str, Array]:
    """Return an object's kind, if any, and its points, px: of a circle its centre and one of the rim."""
    x, y, width, height, turn = (_number(element, key) for key in ("x", "y", "width", "height", "rotation"))
    kind, points = "polygon", _RECTANGLE * [width, height]
    children = {child.tag: child for child in element.children}
    if "template" in element.attributes or children.keys() & {"text", "capsule"}:
        return "", np.empty((0, 2))
    if "gid" in element.attributes:  # of pictures the lower left corner is given
        points = points - [0.0, height]
    elif "point" in children or (width == height == 0.0 and not children.keys() & {"polygon", "polyline"}):
        kind, points = "point", np.zeros((1, 2))
    elif "ellipse" in children:
        middle = np.array([width, height]) / 2
        kind, points = "circle", np.array([middle, [width, height / 2]])
        if width != height:
            kind, points = "polygon", np.asarray(_DISC.exterior.coords)[:-1] * middle + middle
    for tag, name, least in (("polygon", "polygon", 3), ("polyline", "line", 2)):
        if tag in children:
            flat = children[tag].parse_numbers("points")
            if len(flat) % 2 or len(flat) < 2 * least:
                children[tag].refuse(f"points: expected {least} points, got {len(flat)} numbers")
            kind, points = name, flat.reshape(-1, 2)
    return kind, transform_points(build_frame(x, y, math.radians(turn)), points)


def _turned(points: Array, gid: int, size: Array) -> Array:
    """Return points on the picture of a tile, as that is turned."""
    if gid & _SWAPPED:
        points, size = points[:, ::-1], size[::-1]
    for column, flag in enumerate((_FLIPPED, _UPSIDE)):
        if gid & flag:
            points = np.where(np.arange(2) == column, size - points, points)
    return points


def _says_solid(element: Element, names: Iterable[str] = ()) -> bool:
    properties = element.find_child("properties")
    given = () if properties is None else [child.attributes for child in properties.children]
    yes = [each.get("name", "") for each in given if each.get("value", "").casefold() not in _NO]
    classes = [element.attributes.get(key, "") for key in ("class", "type")]
    return any(_SOLID.fullmatch(_plain(name)) for name in (*names, *classes, *yes))


def _plain(name: str) -> str:
    return re.sub(r"[\W\d_]", "", name.casefold())


def _number(element: Element, name: str) -> float:
    return float(element.parse_numbers(name, count=1, default="0")[0])


def _whole(element: Element, name: str, least: int, default: str = "") -> int:
    text = element.attributes.get(name, default)
    if not re.fullmatch(r"-?[0-9]{1,10}", text) or not least <= int(text) < 2**32:
        element.refuse(f"expected a whole number from {least}, got {name} {quote(text)}")
    return int(text)
