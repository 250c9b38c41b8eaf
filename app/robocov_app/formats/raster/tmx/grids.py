"""Grids of tiles: layers of the size that the map states, or chunks of an infinite map."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from robocov.errors import format_count
from robocov_app.formats.files.xml_tree import Element
from robocov_app.formats.raster.tmx.attributes import parse_integer
from robocov_app.formats.raster.tmx.layers import Layer
from robocov_app.formats.raster.tmx.tile_data import ID_MASK, GlobalIDs, decode_ids

MAX_TILES = 4_000_000
"""Maximum number of tiles of a map."""
MAX_TILES_READ = 16_000_000
"""Maximum total number of tiles in all layers of a map."""


class Window(NamedTuple):
    """A rectangle of tiles; `right` and `bottom` are the first column and row outside of it."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""
        return self.bottom - self.top, self.right - self.left


class TileLayers(NamedTuple):
    """The tiles of all layers.

    Attributes
    ----------
    layers : list of Layer
    grids : list of (rows, columns) arrays
        The global IDs of the tiles of each layer.
    window : Window
        Columns and rows of the map that the grids cover.
    """

    layers: list[Layer]
    grids: list[GlobalIDs]
    window: Window


class _Piece(NamedTuple):
    """The tiles of a layer, or of a chunk of it, with the column and row of the first tile."""

    column: int
    row: int
    ids: GlobalIDs

    @property
    def window(self) -> Window:
        """Position of the tiles."""
        rows, columns = self.ids.shape
        return Window(self.column, self.row, self.column + columns, self.row + rows)


def read_tile_layers(root: Element, layers: list[Layer]) -> TileLayers:
    """Read the tiles of layers.

    Parameters
    ----------
    root : Element
        The map.
    layers : list of Layer

    Raises
    ------
    MapError
        If the tiles cannot be decoded, do not match the size of the map, or are too many.
    """
    reader = _PieceReader()
    pieces_of_layers = [list(reader.iterate_pieces(layer.element)) for layer in layers]
    pieces = [piece for layer_pieces in pieces_of_layers for piece in layer_pieces]
    columns = parse_integer(root, "width", 1)
    rows = parse_integer(root, "height", 1)
    window = Window(0, 0, columns, rows)
    is_infinite = bool(pieces) and root.attributes.get("infinite", "0") != "0"
    if is_infinite:
        window = _find_bounds(pieces)
    elif any(piece.window != window for piece in pieces):
        root.raise_error(f"expected layers of {columns} x {rows} tiles, got one of another size")
    _require_few_tiles(root, window, len(layers))
    grids = [_combine(layer_pieces, window) for layer_pieces in pieces_of_layers]
    if is_infinite:
        grids, window = _crop_empty_edges(grids, window)
    return TileLayers(layers, grids, window)


def _find_bounds(pieces: list[_Piece]) -> Window:
    """Return the smallest window that contains all pieces."""
    windows = [piece.window for piece in pieces]
    return Window(
        left=min(window.left for window in windows),
        top=min(window.top for window in windows),
        right=max(window.right for window in windows),
        bottom=max(window.bottom for window in windows),
    )


def _require_few_tiles(root: Element, window: Window, layer_count: int) -> None:
    rows, columns = window.shape
    size = math.prod(window.shape)
    if size > MAX_TILES or size * layer_count > MAX_TILES_READ:
        expected = f"expected at most {MAX_TILES} tiles, and {MAX_TILES_READ} in all layers"
        layers = format_count(layer_count, "layer")
        root.raise_error(f"{expected}, got {columns} x {rows} in {layers}")


def _combine(pieces: list[_Piece], window: Window) -> GlobalIDs:
    """Combine the pieces of a layer into a grid that fills the window."""
    grid = np.zeros(window.shape, np.uint32)
    for piece in pieces:
        left, top, right, bottom = piece.window
        row_range = slice(top - window.top, bottom - window.top)
        grid[row_range, left - window.left : right - window.left] = piece.ids
    return grid


def _crop_empty_edges(grids: list[GlobalIDs], window: Window) -> tuple[list[GlobalIDs], Window]:
    """Remove rows and columns at the edges that are empty in all grids; return the grids and their window."""
    is_used = np.logical_or.reduce([grid & ID_MASK != 0 for grid in grids])
    if not is_used.any():
        return grids, window
    rows = np.flatnonzero(is_used.any(axis=1))
    columns = np.flatnonzero(is_used.any(axis=0))
    first_row = int(rows[0])
    first_column = int(columns[0])
    end_row = int(rows[-1]) + 1
    end_column = int(columns[-1]) + 1
    cropped = Window(
        left=window.left + first_column,
        top=window.top + first_row,
        right=window.left + end_column,
        bottom=window.top + end_row,
    )
    return [grid[first_row:end_row, first_column:end_column] for grid in grids], cropped


class _PieceReader:
    """Reads the tiles of layers, and limits their total number."""

    def __init__(self) -> None:
        self._tile_count = 0

    def iterate_pieces(self, layer: Element) -> Iterator[_Piece]:
        """Yield the tiles of a layer: all at once, or chunk by chunk."""
        data = layer.find_child("data")
        if data is None:
            return
        chunks = [child for child in data.children if child.tag == "chunk"]
        if not chunks:
            width, height = self._parse_size(layer, data)
            yield _Piece(0, 0, decode_ids(data, data, width * height).reshape(height, width))
        for chunk in chunks:
            width, height = self._parse_size(chunk, chunk)
            column = parse_integer(chunk, "x", -MAX_TILES_READ, "0")
            row = parse_integer(chunk, "y", -MAX_TILES_READ, "0")
            ids = decode_ids(chunk, data, width * height)
            yield _Piece(column, row, ids.reshape(height, width))

    def _parse_size(self, sized: Element, piece: Element) -> tuple[int, int]:
        """Return the width and height in the attributes of `sized`, and count the tiles of the piece."""
        width = parse_integer(sized, "width", 1)
        height = parse_integer(sized, "height", 1)
        self._tile_count += width * height
        if self._tile_count > MAX_TILES_READ:
            piece.raise_error(f"expected at most {MAX_TILES_READ} tiles in all, got more")
        return width, height
