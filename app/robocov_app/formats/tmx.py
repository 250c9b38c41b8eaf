"""Tile maps of Tiled: https://doc.mapeditor.org/en/stable/reference/tmx-map-format/.

Neither pytmx nor pytiled-parser is used: they unpack files of any size, and open any other file that is
named.

A tile is solid if a property or class (``collides``, ``solid``, ``wall`` and the like) or collision objects
say so. All tiles of a layer without any such tile are solid if the option ``only`` names the layer, or its
name, class or a property says so. Objects are solid if they or their layer say so or are selected, and all of
them if there are no layers of tiles. Hidden layers count, because layers of walls are usually hidden. The
option ``cell`` is the width of a tile in meters, ``scale`` that of a pixel.
"""

import binascii
import math
import re
import zlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple, NoReturn, TypeAlias

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

MAX_TILES = 4_000_000
"""Largest number of tiles of a map."""
MAX_TILES_READ = 16_000_000
"""Largest number of tiles of all its layers together."""
MAX_PARTS = 10_000
"""Collision objects, each counted as often as its tile is used, and tiles off the grid."""
DEFAULT_TILE_M = 1.0
"""Width of a tile if no option gives it: the format has only pixels."""
_FLIPPED_HORIZONTALLY = 0x80000000
_FLIPPED_VERTICALLY = 0x40000000
_FLIPPED_DIAGONALLY = 0x20000000
_ID_MASK = 0x0FFFFFFF
"""Bits of a global ID."""
_RECTANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
ROOT = re.compile(rb"<map[\s>]")
_SOLID = re.compile(
    r"(is|has|ge)?(collid(e|es|er|ers|able)|collisions?|(map)?walls?|solids?|block(s|ed|ing)?|obstacles?)"
    r"(layer|tiles?|objects?)?"
)
_DISC = CircleObstacle((0.0, 0.0), 1.0).polygon
_FALSE_WORDS = ("false", "0", "no")
_ROBOT = re.compile(r"(robot|start|spawn)s?")
_IDs: TypeAlias = NDArray[np.uint32]


class _Tile(NamedTuple):
    """A solid tile.

    Attributes
    ----------
    parts : list of Element
        Collision objects, which are solid instead of the whole tile.
    size : (2,) array, px
        Size of its picture.
    offset : (2,) array, px
        Position of the picture, from the lower left of the cell.
    """

    parts: list[Element]
    size: Array
    offset: Array


class _Layer(NamedTuple):
    """A layer of tiles or objects.

    Attributes
    ----------
    element : Element
    labels : tuple of str
        Its labels and those of the groups around it.
    offset : (2,) array, px
        Offset, y down.
    is_solid : bool
        Whether it is selected, or says itself that it is solid.
    """

    element: Element
    labels: tuple[str, ...]
    offset: Array
    is_solid: bool


class _Piece(NamedTuple):
    """The tiles of a layer, or of a chunk of it, from a column and row."""

    column: int
    row: int
    ids: _IDs


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return ROOT.search(head) is not None and b"tilewidth" in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read an orthogonal map.

    Raises
    ------
    MapError
        If the map is not orthogonal, too large, broken, or nothing in it is solid.
    ParameterError
        If there is both a cell and a scale.
    """
    return _MapReader(path, options).read()


class _MapReader:
    """Reads a map with its tilesets and layers."""

    def __init__(self, path: Path, options: ReadOptions) -> None:
        self.path = path
        self.options = options
        self.root = read_xml_tree(path, "map", "TMX", ("data", "chunk"))
        self.shapes = Shapes(self.root.where, options)
        self.tiles_read = 0
        self.part_count = 0
        orientation = self.root.attributes.get("orientation", "orthogonal")
        if orientation != "orthogonal":
            self.root.refuse(f"expected an orthogonal map, got {to_one_line(orientation)[:20]}")
        width = _parse_integer(self.root, "tilewidth", 1)
        height = _parse_integer(self.root, "tileheight", 1)
        self.tile = np.array([width, height], float)
        self.pixel = self._choose_pixel_size()
        files.require_length(self.pixel * float(self.tile.max()), f"{self.root.where}: the side of a tile")
        self.corner = np.zeros(2)
        self.shape = (0, 0)

    def _choose_pixel_size(self) -> float:
        """Return the size of a pixel in meters."""
        cell = self.options.cell
        scale = self.options.scale
        if cell is not None and scale is not None:
            raise ParameterError(
                "--cell, --scale: expected one of them, because both say how large a tile is"
            )
        if scale is not None:
            return scale
        if cell is None:
            self.shapes.notes.append(f"no size of a tile was given: {DEFAULT_TILE_M:g} m wide taken (--cell)")
            cell = DEFAULT_TILE_M
        return cell / float(self.tile[0])

    def read(self) -> ForeignMap:
        """Return the map."""
        shapes = self.shapes
        tiles = self._read_tilesets()
        layers = list(self._iterate_layers(self.root, (), np.zeros(2), is_solid=False))
        grids = self._read_grids([layer for layer in layers if layer.element.tag == "layer"])
        solid = np.zeros(self.shape, dtype=bool)
        for layer, ids in grids:
            solid |= self._find_solid_cells(layer, ids, tiles)
        object_layers = [layer for layer in layers if layer.element.tag != "layer"]
        self._add_objects(object_layers, anything=not grids)
        shapes.labels.require_known_names()
        if not (solid.any() or shapes.outlines or shapes.lines or shapes.pillars):
            self._refuse_nothing_solid(layers)
        width, height = (self.pixel * self.tile).tolist()
        world = outline_free_cells(~solid, (width, height), (0.0, 0.0), self.root.where)
        shapes.count_vertices(count_polygon_vertices(world))
        shapes.cell = max(width, height) if solid.any() else None
        return shapes.build_foreign_map(self.path.stem, "A map of Tiled, imported.", solid=True, world=world)

    def _refuse_nothing_solid(self, layers: list[_Layer]) -> NoReturn:
        names = summarize_names([quote(layer.labels[0]) for layer in layers if layer.labels])
        problem = "nothing is solid by properties, collision objects or names of layers"
        expected = f"expected --only LAYER with one of walls: {names or 'there is none'}"
        raise MapError(f"{self.root.where}: {problem}, {expected}")

    def _read_tilesets(self) -> dict[int, _Tile]:
        """Return the solid tiles of all tilesets, by their global IDs."""
        tiles: dict[int, _Tile] = {}
        budget = files.IncludeBudget()
        element_count = 0
        for element in self.root.children:
            if element.tag != "tileset":
                continue
            first_id = _parse_integer(element, "firstgid", 1)
            tileset = element
            if "source" in element.attributes:
                tileset = self._read_tileset_file(element, budget)
                element_count += sum(1 for _ in tileset.iterate())
            if element_count > MAX_ELEMENTS:
                raise MapError(
                    f"{element.where}:{element.line}: tilesets of more than {MAX_ELEMENTS} elements, "
                    "expected at most that"
                )
            self._add_solid_tiles(tileset, first_id, tiles)
        return tiles

    def _read_tileset_file(self, element: Element, budget: files.IncludeBudget) -> Element:
        at = f"{element.where}:{element.line}"
        file = files.find_named_file(
            self.path,
            element.attributes["source"],
            "tileset",
            at=at,
            notes=self.shapes.notes,
            allow_anywhere=self.options.anywhere,
        )
        budget.take(file, at)
        return read_xml_tree(file, "tileset", "TSX")

    def _add_solid_tiles(self, tileset: Element, first_id: int, tiles: dict[int, _Tile]) -> None:
        size = _parse_vector(tileset, "tilewidth", "tileheight")
        drawn = tileset.find_child("tileoffset")
        offset = np.zeros(2) if drawn is None else _parse_vector(drawn, "x", "y")
        for tile in tileset.children:
            if tile.tag != "tile":
                continue
            group = tile.find_child("objectgroup")
            parts = [] if group is None else group.children
            if parts or _says_solid(tile):
                tiles[first_id + _parse_integer(tile, "id", 0)] = _Tile(parts, size, offset)

    def _iterate_layers(
        self, parent: Element, labels: tuple[str, ...], offset: Array, *, is_solid: bool
    ) -> Iterator[_Layer]:
        """Yield the layers in an element; `is_solid` is what the groups around it say."""
        selection = self.shapes.labels
        for element in parent.children:
            if element.tag not in ("layer", "objectgroup", "group"):
                continue
            names = (*filter(None, map(element.attributes.get, ("name", "class"))), *labels)
            folded = selection.register(names)
            layer_offset = offset + _parse_vector(element, "offsetx", "offsety")
            if selection.only is None:
                is_layer_solid = is_solid or _says_solid(element, names)
            else:
                is_layer_solid = is_solid or bool(selection.only & folded)
            if selection.skip & folded:
                self.shapes.leave_out("layer", "by the names that were asked for")
            elif element.tag == "group":
                yield from self._iterate_layers(element, names, layer_offset, is_solid=is_layer_solid)
            elif element.tag == "objectgroup" or selection.only is None or is_layer_solid:
                yield _Layer(element, names, layer_offset, is_layer_solid)

    def _read_grids(self, layers: list[_Layer]) -> list[tuple[_Layer, _IDs]]:
        """Return layers of tiles with global IDs, (rows, columns) of the map, and find its corner."""
        layer_pieces = [(layer, list(self._iterate_pieces(layer.element))) for layer in layers]
        pieces = [piece for _, some in layer_pieces for piece in some]
        left = 0
        top = 0
        right = _parse_integer(self.root, "width", 1)
        bottom = _parse_integer(self.root, "height", 1)
        is_infinite = bool(pieces) and self.root.attributes.get("infinite", "0") != "0"
        if is_infinite:
            left = min(piece.column for piece in pieces)
            top = min(piece.row for piece in pieces)
            right = max(piece.column + piece.ids.shape[1] for piece in pieces)
            bottom = max(piece.row + piece.ids.shape[0] for piece in pieces)
        elif any((x, y, *ids.shape) != (0, 0, bottom, right) for x, y, ids in pieces):
            self.root.refuse(f"expected one of {right} x {bottom} tiles, got a layer of another size")
        self.shape = (bottom - top, right - left)
        size = math.prod(self.shape)
        if size > MAX_TILES or size * len(layers) > MAX_TILES_READ:
            actual = f"{right - left} x {bottom - top} tiles in {format_count(len(layers), 'layer')}"
            self.root.refuse(f"expected fewer, got {actual}")
        grids = []
        for layer, some in layer_pieces:
            grid = np.zeros(self.shape, np.uint32)
            for x, y, ids in some:
                grid[y - top : y - top + len(ids), x - left : x - left + ids.shape[1]] = ids
            grids.append((layer, grid))
        if is_infinite:
            grids, left, bottom = self._crop_empty_edges(grids, left, top, bottom)
        self.corner = np.array([left, bottom]) * self.tile
        return grids

    def _crop_empty_edges(
        self, grids: list[tuple[_Layer, _IDs]], left: int, top: int, bottom: int
    ) -> tuple[list[tuple[_Layer, _IDs]], int, int]:
        """Return grids without the empty edges of chunks, their left column and the row below them."""
        used = np.logical_or.reduce([grid & _ID_MASK != 0 for _, grid in grids])
        if not used.any():
            return grids, left, bottom
        rows = np.flatnonzero(used.any(axis=1))
        columns = np.flatnonzero(used.any(axis=0))
        window = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        grids = [(layer, grid[window]) for layer, grid in grids]
        self.shape = grids[0][1].shape
        return grids, left + int(columns[0]), top + int(rows[-1]) + 1

    def _iterate_pieces(self, layer: Element) -> Iterator[_Piece]:
        """Yield the tiles of a layer: all, or, of an infinite map, chunk by chunk."""
        data = layer.find_child("data")
        if data is None:
            return
        chunks = [child for child in data.children if child.tag == "chunk"]
        if not chunks:
            width, height = self._parse_piece_size(layer, data)
            yield _Piece(0, 0, _decode_ids(data, data, width * height).reshape(height, width))
        for chunk in chunks:
            width, height = self._parse_piece_size(chunk, chunk)
            column = _parse_integer(chunk, "x", -MAX_TILES_READ, "0")
            row = _parse_integer(chunk, "y", -MAX_TILES_READ, "0")
            ids = _decode_ids(chunk, data, width * height)
            yield _Piece(column, row, ids.reshape(height, width))

    def _parse_piece_size(self, sized: Element, piece: Element) -> tuple[int, int]:
        """Return the width and height of a piece, and count its tiles."""
        width = _parse_integer(sized, "width", 1)
        height = _parse_integer(sized, "height", 1)
        self.tiles_read += width * height
        if self.tiles_read > MAX_TILES_READ:
            piece.refuse(f"expected at most {MAX_TILES_READ} tiles in all, got more")
        return width, height

    def _to_meters(self, points: Array) -> Array:
        """Return points in pixels of the map, y down, as meters, y up."""
        return np.asarray((points - self.corner) * [self.pixel, -self.pixel])

    def _find_solid_cells(self, layer: _Layer, ids: _IDs, tiles: dict[int, _Tile]) -> BoolArray:
        """Return which cells a layer makes solid as a whole, and add other shapes that it makes solid."""
        numbers = ids & _ID_MASK
        whole_tiles = [number for number, tile in tiles.items() if not tile.parts]
        full: BoolArray = np.isin(numbers, whole_tiles)
        if not np.isin(numbers, list(tiles)).any():
            full = (numbers != 0) & layer.is_solid
        place = self.corner - [0.0, self.shape[0] * self.tile[1]] + layer.offset
        self._add_tile_parts(layer, ids, tiles, place, full)
        if not layer.offset.any():
            return full
        # The tiles of the layer are off the grid of the map.
        for row, column in np.argwhere(full).tolist():
            cell = place + np.add(_RECTANGLE, [column, row]) * self.tile
            self._add_part(layer.element, "polygon", cell, layer.labels)
        return np.zeros_like(full)

    def _add_tile_parts(
        self, layer: _Layer, ids: _IDs, tiles: dict[int, _Tile], place: Array, full: BoolArray
    ) -> None:
        """Add the collision objects of tiles, or mark in `full` the cells that they fill.

        Parameters
        ----------
        layer : _Layer
        ids : (rows, columns) array
            Global IDs of the layer.
        tiles : dict of int to _Tile
        place : (2,) array, px
            Upper left corner of the layer.
        full : (rows, columns) array of bool
            Cells that are solid as a whole.
        """
        tiles_with_parts = [number for number, tile in tiles.items() if tile.parts]
        has_parts = np.isin(ids & _ID_MASK, tiles_with_parts)
        cells = np.argwhere(has_parts)
        gids, kinds = np.unique(ids[has_parts], return_inverse=True)
        numbers = (gids & _ID_MASK).tolist()
        objects_of_tile = {
            number: [_parse_object(part) for part in tiles[number].parts] for number in numbers
        }
        objects = [objects_of_tile[number] for number in numbers]
        is_filled = np.array([self._fills_tile(tile_objects) for tile_objects in objects], dtype=bool)
        rows, columns = cells[is_filled[kinds]].T
        full[rows, columns] = True
        part_counts = np.array([len(tile_objects) for tile_objects in objects], dtype=int)
        self._require_few_parts(int(part_counts[kinds[~is_filled[kinds]]].sum()))
        partial = np.flatnonzero(~is_filled[kinds])
        # By kind, and of a kind row by row.
        for k in partial[np.argsort(kinds[partial], kind="stable")].tolist():
            gid = int(gids[kinds[k]])
            row, column = cells[k].tolist()
            tile = tiles[gid & _ID_MASK]
            corner = place + [column, row + 1] * self.tile - [0.0, tile.size[1]] + tile.offset
            for part, (kind, points) in zip(tile.parts, objects[kinds[k]], strict=True):
                self._add_part(part, kind, corner + _flip_points(points, gid, tile.size), layer.labels)

    def _fills_tile(self, objects: list[tuple[str, Array]]) -> bool:
        """Return whether one of the collision objects of a tile fills it."""
        return any(np.array_equal(points, _RECTANGLE * self.tile) for _, points in objects)

    def _require_few_parts(self, more: int) -> None:
        if self.part_count + more > MAX_PARTS:
            self.root.refuse(f"expected at most {MAX_PARTS} parts of tiles, got more")

    def _add_part(self, element: Element, kind: str, points: Array, labels: tuple[str, ...]) -> None:
        self._require_few_parts(1)
        self.part_count += 1
        self._add_shape(element, kind, points, labels)

    def _add_objects(self, layers: list[_Layer], *, anything: bool) -> None:
        """Add the objects that are solid, or all; those that are named as robots are starts."""
        for layer in layers:
            for element in layer.element.children:
                self._add_object(layer, element, anything=anything)

    def _add_object(self, layer: _Layer, element: Element, *, anything: bool) -> None:
        shapes = self.shapes
        selection = shapes.labels
        names = [element.attributes.get(key, "") for key in ("name", "class", "type")]
        labels = (*filter(None, names), *layer.labels)
        folded = selection.register(labels)
        if element.tag != "object" or selection.skip & folded:
            return
        kind, points = _parse_object(element)
        points = points + layer.offset
        if kind and any(_ROBOT.fullmatch(_fold_name(name)) for name in names):
            x, y = self._to_meters(points.mean(axis=0)).tolist()
            shapes.robots.append((x, y))
            return
        if selection.only is None:
            is_solid = anything or layer.is_solid or _says_solid(element, labels)
        else:
            is_solid = bool(selection.only & folded)
        if is_solid:
            self._add_shape(element, kind, points, labels)
        else:
            shapes.leave_out("object", "not solid by name or property (--only NAME takes it)")

    def _add_shape(self, element: Element, kind: str, points: Array, labels: tuple[str, ...]) -> None:
        """Add an obstacle of a kind as of `_parse_object`, in pixels on the map."""
        shapes = self.shapes
        at = f"line {element.line}"
        points = self._to_meters(points)
        if kind == "line":
            shapes.add_line(WallLine(points, shapes.thickness, labels), at=at)
        elif kind == "circle" and (points[0] != points[1]).any():
            radius = float(np.hypot(*(points[1] - points[0])))
            shapes.add_circle(points[0], radius, labels, at=at)
        elif kind == "point":
            shapes.add_point(points[0], at=at)
        elif kind != "polygon" or not shapes.add_outline([points], labels, at=at, thing=""):
            shapes.leave_out("object", "of text, a template or without an area")


def _decode_ids(piece: Element, data: Element, count: int) -> _IDs:
    """Return the global IDs of `count` tiles, encoded as the attributes of `data` say."""
    encoding = data.attributes.get("encoding", "")
    compression = data.attributes.get("compression", "")
    ids: _IDs | None
    if encoding == "base64" and compression in ("", "zlib", "gzip"):
        ids = _decode_base64_ids(piece, compression, count)
    elif encoding == "csv":
        ids = _decode_csv_ids(piece, count)
    elif not encoding:
        tiles = [child for child in piece.children if child.tag == "tile"]
        ids = np.array([_parse_integer(tile, "gid", 0, "0") for tile in tiles], np.uint32)
    else:
        name = " ".join(filter(None, (to_one_line(encoding)[:20], to_one_line(compression)[:20])))
        piece.refuse(f"expected CSV, or base64 with zlib or gzip or neither, got {name}")
    if ids is None or len(ids) != count:
        piece.refuse(f"expected {count} tiles, as it says, got {'more' if ids is None else len(ids)}")
    return ids


def _decode_base64_ids(piece: Element, compression: str, count: int) -> _IDs | None:
    """Return global IDs, or None if there are more than `count`."""
    size = 4 * count
    try:
        raw = binascii.a2b_base64("".join(piece.text.split()), strict_mode=True)
        if compression:  # never unpacked to more than expected
            raw = zlib.decompressobj(wbits=47).decompress(raw, size + 1)
    except (ValueError, zlib.error) as error:
        piece.refuse(f"not {compression or 'base64'}: {to_one_line(error)[:60]}")
    if len(raw) > size:
        return None
    return np.frombuffer(raw, "<u4", min(count, len(raw) // 4))


def _decode_csv_ids(piece: Element, count: int) -> _IDs | None:
    """Return global IDs, or None if there are more than `count`."""
    if piece.text.count(",") > count:  # a comma may end the text
        return None
    numbers = files.parse_integers(piece.text, ",")
    if numbers is None or not ((numbers >= 0) & (numbers < 2**32)).all():
        piece.refuse("expected whole numbers from 0, separated by commas")
    return numbers.astype(np.uint32)


def _parse_object(element: Element) -> tuple[str, Array]:
    """Return the kind of an object, empty for none, and its points, px.

    Of a circle the points are its center and one of its rim.
    """
    x, y = _parse_vector(element, "x", "y")
    width, height = _parse_vector(element, "width", "height").tolist()
    turn = math.radians(_parse_number(element, "rotation"))
    children = {child.tag: child for child in element.children}
    if "template" in element.attributes or children.keys() & {"text", "capsule"}:
        return "", np.empty((0, 2))
    kind, points = _parse_outline(element, children, width, height)
    return kind, transform_points(build_frame(x, y, turn), points)


def _parse_outline(
    element: Element, children: dict[str, Element], width: float, height: float
) -> tuple[str, Array]:
    """Return the kind and the points of an object, px, relative to its position."""
    rectangle = _RECTANGLE * [width, height]
    if "polyline" in children:
        return "line", _parse_vertices(children["polyline"], 2)
    if "polygon" in children:
        return "polygon", _parse_vertices(children["polygon"], 3)
    if "gid" in element.attributes:  # the position of a picture is its lower left corner
        return "polygon", rectangle - [0.0, height]
    if "point" in children or width == height == 0.0:
        return "point", np.zeros((1, 2))
    if "ellipse" not in children:
        return "polygon", rectangle
    middle = np.array([width, height]) / 2
    if width == height:
        return "circle", np.array([middle, [width, height / 2]])
    return "polygon", np.asarray(_DISC.exterior.coords)[:-1] * middle + middle


def _parse_vertices(element: Element, minimum: int) -> Array:
    """Return the vertices of a polygon or polyline, at least `minimum`."""
    numbers = element.parse_numbers("points")
    if len(numbers) % 2 or len(numbers) < 2 * minimum:
        element.refuse(f"points: expected {minimum} points, got {len(numbers)} numbers")
    return numbers.reshape(-1, 2)


def _flip_points(points: Array, gid: int, size: Array) -> Array:
    """Return points on the picture of a tile, flipped as the bits of its global ID say."""
    if gid & _FLIPPED_DIAGONALLY:
        points = points[:, ::-1]
        size = size[::-1]
    for column, flag in enumerate((_FLIPPED_HORIZONTALLY, _FLIPPED_VERTICALLY)):
        if gid & flag:
            points = np.where(np.arange(2) == column, size - points, points)
    return points


def _says_solid(element: Element, names: Iterable[str] = ()) -> bool:
    """Return whether names, the class or a property of an element say that it is solid."""
    words = list(names)
    words += [element.attributes.get(key, "") for key in ("class", "type")]
    properties = element.find_child("properties")
    if properties is not None:
        for child in properties.children:
            if child.attributes.get("value", "").casefold() not in _FALSE_WORDS:
                words.append(child.attributes.get("name", ""))
    return any(_SOLID.fullmatch(_fold_name(word)) for word in words)


def _fold_name(name: str) -> str:
    return re.sub(r"[\W\d_]", "", name.casefold())


def _parse_vector(element: Element, x_name: str, y_name: str) -> Array:
    return np.array([_parse_number(element, x_name), _parse_number(element, y_name)])


def _parse_number(element: Element, name: str) -> float:
    return float(element.parse_numbers(name, count=1, default="0")[0])


def _parse_integer(element: Element, name: str, minimum: int, default: str = "") -> int:
    """Return the integer in an attribute, at least `minimum`."""
    text = element.attributes.get(name, default)
    if not re.fullmatch(r"-?[0-9]{1,10}", text) or not minimum <= int(text) < 2**32:
        element.refuse(f"expected a whole number from {minimum}, got {name} {quote(text)}")
    return int(text)
