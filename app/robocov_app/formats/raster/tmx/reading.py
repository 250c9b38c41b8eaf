"""Tile maps of Tiled: https://doc.mapeditor.org/en/stable/reference/tmx-map-format/.

Neither pytmx nor pytiled-parser is used: they unpack files of any size, and open any other file that is
named.

A tile is solid if a property or its class says so (``collides``, ``solid``, ``wall`` and the like), or if it
has collision objects. If a layer has no such tile, all its tiles are solid if the option ``only`` names the
layer, or if its name, its class or a property says so. Objects are solid if they or their layer are declared
solid or selected; in a map without layers of tiles, all objects are solid. Hidden layers are read, because
layers of walls are usually hidden. The option ``cell`` is the width of a tile in meters, ``scale`` that of a
pixel.
"""

import re
from pathlib import Path
from typing import NoReturn

import numpy as np

from robocov.errors import MapError, ParameterError, quote, to_one_line
from robocov.typing import FloatArray
from robocov_app.formats import files
from robocov_app.formats.files.xml_tree import read_xml_tree
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.cells.vectorize import count_polygon_vertices, outline_free_cells
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.raster.tmx.attributes import parse_integer
from robocov_app.formats.raster.tmx.grids import read_tile_layers
from robocov_app.formats.raster.tmx.layers import Layer, list_layers
from robocov_app.formats.raster.tmx.obstacles import ObstacleReader, TileFrame
from robocov_app.formats.raster.tmx.tilesets import read_solid_tiles

DEFAULT_TILE_M = 1.0
"""Default width of a tile: files contain only sizes in pixels."""
ROOT = re.compile(rb"<map[\s>]")
_MAX_QUOTED_CHARACTERS = 20


def sniff(path: Path, head: bytes) -> bool:
    """Return whether a file that starts with `head` has this format."""
    return ROOT.search(head) is not None and b"tilewidth" in head


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read an orthogonal map.

    Raises
    ------
    MapError
        If the map is not orthogonal, too large, damaged, or nothing in it is solid.
    ParameterError
        If both ``cell`` and ``scale`` are given.
    """
    root = read_xml_tree(path, "map", "TMX", ("data", "chunk"))
    shapes = Shapes(root.source_name, options)
    orientation = root.attributes.get("orientation", "orthogonal")
    if orientation != "orthogonal":
        name = to_one_line(orientation)[:_MAX_QUOTED_CHARACTERS]
        root.raise_error(f"expected an orthogonal map, got {name}")
    tile = np.array([parse_integer(root, "tilewidth", 1), parse_integer(root, "tileheight", 1)], float)
    pixel = _choose_pixel_size(tile, options, shapes.notes)
    files.require_length(pixel * float(tile.max()), f"{root.source_name}: the side of a tile")
    tiles = read_solid_tiles(root, path, shapes)
    layers = list_layers(root, shapes)
    tile_layers = read_tile_layers(root, [layer for layer in layers if layer.has_tiles])
    reader = ObstacleReader(root, shapes, TileFrame(tile, pixel, tile_layers.window), tiles)
    is_solid = np.zeros(tile_layers.window.shape, dtype=bool)
    for layer, ids in zip(tile_layers.layers, tile_layers.grids, strict=True):
        is_solid |= reader.add_tiles(layer, ids)
    for layer in layers:
        if not layer.has_tiles:
            reader.add_objects(layer, are_all_solid=not tile_layers.layers)
    shapes.labels.require_known_names()
    has_solid_cells = bool(is_solid.any())
    if not (has_solid_cells or shapes.outlines or shapes.lines or shapes.pillars):
        _raise_nothing_solid_error(layers, root.source_name)
    width, height = (pixel * tile).tolist()
    world = outline_free_cells(~is_solid, (width, height), (0.0, 0.0), root.source_name)
    shapes.count_vertices(count_polygon_vertices(world))
    if has_solid_cells:
        shapes.cell = max(width, height)
    return shapes.build_foreign_map(path.stem, "A map of Tiled, imported.", solid=True, world=world)


def _choose_pixel_size(tile: FloatArray, options: ReadOptions, notes: list[str]) -> float:
    """Return the side of a pixel, m; `tile` is the width and height of a tile, (2,) px."""
    if options.cell is not None and options.scale is not None:
        raise ParameterError("--cell, --scale: expected one of them, because both say how large a tile is")
    if options.scale is not None:
        return options.scale
    cell = options.cell
    if cell is None:
        notes.append(f"no tile size given; assuming tiles {DEFAULT_TILE_M:g} m wide. Set it with --cell.")
        cell = DEFAULT_TILE_M
    return cell / float(tile[0])


def _raise_nothing_solid_error(layers: list[Layer], source_name: str) -> NoReturn:
    names = ", ".join(quote(layer.labels[0]) for layer in layers if layer.labels)
    problem = "nothing is solid by properties, collision objects or names of layers"
    expected = f"expected --only LAYER with one of walls: {names or 'there is none'}"
    raise MapError(f"{source_name}: {problem}, {expected}")
