"""Solid tiles and objects of TMX files as obstacles, and objects that are starts of robots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robocov.typing import BoolArray, FloatArray
from robocov_app.formats.files.xml_tree import Element
from robocov_app.formats.geometry.shapes.collection import Shapes, WallLine
from robocov_app.formats.raster.tmx.grids import Window
from robocov_app.formats.raster.tmx.layers import Layer
from robocov_app.formats.raster.tmx.object_shapes import RECTANGLE, ObjectShape, flip_points, parse_object
from robocov_app.formats.raster.tmx.solidity import is_declared_solid, is_robot_name
from robocov_app.formats.raster.tmx.tile_data import ID_MASK, GlobalIDs
from robocov_app.formats.raster.tmx.tilesets import Tile

MAX_PARTS = 10_000
"""Maximum number of collision objects, counted for each use of their tile, and of tiles off the grid."""


@dataclass(frozen=True, eq=False)
class TileFrame:
    """Conversion from pixels, with y down, to meters, with y up from the lower left corner of the tiles.

    Attributes
    ----------
    tile : (2,) array, px
        Width and height of a tile.
    pixel : float, m
        Side of a pixel.
    window : Window
        Columns and rows of the tiles of the map.
    """

    tile: FloatArray
    pixel: float
    window: Window

    @property
    def lower_left(self) -> FloatArray:
        """Lower left corner of the tiles, (2,) px."""
        return np.array([self.window.left, self.window.bottom]) * self.tile

    @property
    def upper_left(self) -> FloatArray:
        """Upper left corner of the tiles, (2,) px."""
        return np.array([self.window.left, self.window.top]) * self.tile

    def to_meters(self, points: FloatArray) -> FloatArray:
        """Convert points, (..., 2), from pixels to meters."""
        return np.asarray((points - self.lower_left) * [self.pixel, -self.pixel])


class ObstacleReader:
    """Adds solid tiles and objects to a collection of shapes.

    Parameters
    ----------
    root : Element
        The map.
    shapes : Shapes
    frame : TileFrame
    tiles : dict of int to Tile
        Solid tiles, keyed by their global IDs.
    """

    def __init__(self, root: Element, shapes: Shapes, frame: TileFrame, tiles: dict[int, Tile]) -> None:
        self._root = root
        self._shapes = shapes
        self._frame = frame
        self._tiles = tiles
        self._part_count = 0

    def add_tiles(self, layer: Layer, ids: GlobalIDs) -> BoolArray:
        """Add a layer of tiles.

        Parameters
        ----------
        layer : Layer
        ids : (rows, columns) array
            Global IDs of its tiles.

        Returns
        -------
        (rows, columns) array of bool
            Cells of the map that are entirely solid. Other obstacles are added to the shapes.

        Raises
        ------
        MapError
            If a collision object is invalid, or there are too many.
        """
        numbers = ids & ID_MASK
        whole_tiles = [number for number, tile in self._tiles.items() if not tile.parts]
        is_full: BoolArray = np.isin(numbers, whole_tiles)
        if not np.isin(numbers, list(self._tiles)).any():
            is_full = (numbers != 0) & layer.is_solid
        self._add_tile_parts(layer, ids, is_full)
        if not layer.offset.any():
            return is_full
        # With an offset, the tiles of the layer are off the grid of the map and become separate shapes.
        corner = self._frame.upper_left + layer.offset
        for row, column in np.argwhere(is_full).tolist():
            ring = corner + np.add(RECTANGLE, [column, row]) * self._frame.tile
            self._add_part(layer.element, ObjectShape("polygon", ring), layer.labels)
        return np.zeros_like(is_full)

    def _add_tile_parts(self, layer: Layer, ids: GlobalIDs, is_full: BoolArray) -> None:
        """Add the collision objects of tiles; if one fills its cell, mark the cell in `is_full` instead."""
        tiles_with_parts = [number for number, tile in self._tiles.items() if tile.parts]
        has_parts = np.isin(ids & ID_MASK, tiles_with_parts)
        cells = np.argwhere(has_parts)
        gids, gid_index = np.unique(ids[has_parts], return_inverse=True)
        parts_of_gids = self._parse_parts((gids & ID_MASK).tolist())
        fills_cell = np.array([self._has_filling_part(parts) for parts in parts_of_gids], dtype=bool)[
            gid_index
        ]
        rows, columns = cells[fills_cell].T
        is_full[rows, columns] = True
        remaining = np.flatnonzero(~fills_cell)
        part_counts = np.array([len(parts) for parts in parts_of_gids], dtype=int)
        self._require_few_parts(int(part_counts[gid_index[remaining]].sum()))
        # In the order of global IDs, and row by row for each ID.
        for k in remaining[np.argsort(gid_index[remaining], kind="stable")].tolist():
            gid = int(gids[gid_index[k]])
            row, column = cells[k].tolist()
            tile = self._tiles[gid & ID_MASK]
            lower_left = self._frame.upper_left + layer.offset + [column, row + 1] * self._frame.tile
            corner = lower_left - [0.0, tile.size[1]] + tile.offset
            for element, part in zip(tile.parts, parts_of_gids[gid_index[k]], strict=True):
                points = corner + flip_points(part.points, gid, tile.size)
                self._add_part(element, part._replace(points=points), layer.labels)

    def _parse_parts(self, numbers: list[int]) -> list[list[ObjectShape]]:
        """Return the collision objects of each tile; a number that occurs repeatedly is parsed once."""
        parts_of_tile: dict[int, list[ObjectShape]] = {}
        for number in numbers:
            if number not in parts_of_tile:
                parts_of_tile[number] = [parse_object(part) for part in self._tiles[number].parts]
        return [parts_of_tile[number] for number in numbers]

    def _has_filling_part(self, parts: list[ObjectShape]) -> bool:
        """Return whether one of the collision objects of a tile fills it."""
        return any(np.array_equal(part.points, RECTANGLE * self._frame.tile) for part in parts)

    def _require_few_parts(self, additional: int) -> None:
        if self._part_count + additional > MAX_PARTS:
            self._root.raise_error(f"expected at most {MAX_PARTS} parts of tiles, got more")

    def _add_part(self, element: Element, shape: ObjectShape, labels: tuple[str, ...]) -> None:
        self._require_few_parts(1)
        self._part_count += 1
        self._add_shape(element, shape, labels)

    def add_objects(self, layer: Layer, *, are_all_solid: bool) -> None:
        """Add the solid objects of a layer; the positions of objects named as robots become starts.

        Parameters
        ----------
        layer : Layer
        are_all_solid : bool
            Whether all objects are solid if the user selects none, even if the file does not declare them so.

        Raises
        ------
        MapError
            If an object is invalid.
        """
        for element in layer.element.children:
            names = [element.attributes.get(key, "") for key in ("name", "class", "type")]
            labels = (*filter(None, names), *layer.labels)
            folded_labels = self._shapes.labels.register_and_fold(labels)
            if element.tag != "object" or self._shapes.labels.skip & folded_labels:
                continue
            shape = parse_object(element)
            shape = shape._replace(points=shape.points + layer.offset)
            if shape.kind and any(is_robot_name(name) for name in names):
                x, y = self._frame.to_meters(shape.points.mean(axis=0)).tolist()
                self._shapes.robots.append((x, y))
            elif self._is_solid(
                element, labels, folded_labels, is_layer_solid=are_all_solid or layer.is_solid
            ):
                self._add_shape(element, shape, labels)
            else:
                reason = "without a name or property of a solid object (--only NAME selects by name)"
                self._shapes.count_omission("object", reason)

    def _is_solid(
        self, element: Element, labels: tuple[str, ...], folded_labels: set[str], *, is_layer_solid: bool
    ) -> bool:
        """Return whether an object is an obstacle; `folded_labels` are its labels in lower case."""
        only = self._shapes.labels.only
        if only is not None:
            return bool(only & folded_labels)
        return is_layer_solid or is_declared_solid(element, labels)

    def _add_shape(self, element: Element, shape: ObjectShape, labels: tuple[str, ...]) -> None:
        """Add an obstacle whose points are in pixels on the map."""
        shapes = self._shapes
        location = f"line {element.line}"
        points = self._frame.to_meters(shape.points)
        if shape.kind == "line":
            shapes.add_line(WallLine(points, shapes.thickness, labels), location=location)
        elif shape.kind == "circle" and (points[0] != points[1]).any():
            radius = float(np.hypot(*(points[1] - points[0])))
            shapes.add_circle(points[0], radius, labels, location=location)
        elif shape.kind == "point":
            shapes.add_point(points[0], labels, location=location)
        else:
            is_polygon = shape.kind == "polygon"
            if not is_polygon or not shapes.add_outline([points], labels, location=location, kind=""):
                shapes.count_omission("object", "with a text or template, or without an area")
