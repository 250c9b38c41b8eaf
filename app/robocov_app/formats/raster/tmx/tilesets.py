"""Tiles that properties, classes or collision objects in their tilesets make solid."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from robocov.errors import MapError
from robocov.typing import FloatArray
from robocov_app.formats import files
from robocov_app.formats.files.xml_tree import MAX_ELEMENTS, Element, read_xml_tree
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.raster.tmx.attributes import parse_integer, parse_vector
from robocov_app.formats.raster.tmx.solidity import is_declared_solid


class Tile(NamedTuple):
    """A solid tile.

    Attributes
    ----------
    parts : list of Element
        Collision objects. If there are any, they are solid instead of the whole tile.
    size : (2,) array, px
        Size of the tile's picture.
    offset : (2,) array, px
        Position of the picture relative to the lower left corner of the cell.
    """

    parts: list[Element]
    size: FloatArray
    offset: FloatArray


def read_solid_tiles(root: Element, path: Path, shapes: Shapes) -> dict[int, Tile]:
    """Return the solid tiles of all tilesets, keyed by their global IDs.

    Parameters
    ----------
    root : Element
        The map.
    path : Path
        File of the map.
    shapes : Shapes
        Contains the options, and collects the notes.

    Raises
    ------
    MapError
        If the file of a tileset cannot be read, or if all tilesets together are too large.
    """
    tiles: dict[int, Tile] = {}
    budget = files.IncludeBudget()
    element_count = 0
    for element in root.children:
        if element.tag != "tileset":
            continue
        first_id = parse_integer(element, "firstgid", 1)
        tileset = element
        if "source" in element.attributes:
            tileset = _read_file(element, path, shapes, budget)
            element_count += sum(1 for _ in tileset.iterate())
        if element_count > MAX_ELEMENTS:
            raise MapError(
                f"{element.source_name}:{element.line}: "
                f"expected at most {MAX_ELEMENTS} elements in all tilesets, got more"
            )
        _add_solid_tiles(tileset, first_id, tiles)
    return tiles


def _read_file(element: Element, path: Path, shapes: Shapes, budget: files.IncludeBudget) -> Element:
    """Return the tileset in the file that an element names."""
    location = f"{element.source_name}:{element.line}"
    file = files.find_named_file(
        path,
        element.attributes["source"],
        "tileset",
        location=location,
        notes=shapes.notes,
        allow_anywhere=shapes.options.anywhere,
    )
    budget.count_file(file, location)
    return read_xml_tree(file, "tileset", "TSX")


def _add_solid_tiles(tileset: Element, first_id: int, tiles: dict[int, Tile]) -> None:
    """Add the solid tiles of a tileset, whose global IDs start at `first_id`."""
    size = parse_vector(tileset, "tilewidth", "tileheight")
    offset_element = tileset.find_child("tileoffset")
    offset = np.zeros(2) if offset_element is None else parse_vector(offset_element, "x", "y")
    for element in tileset.children:
        if element.tag != "tile":
            continue
        group = element.find_child("objectgroup")
        parts = [] if group is None else group.children
        if parts or is_declared_solid(element):
            tiles[first_id + parse_integer(element, "id", 0)] = Tile(parts, size, offset)
