"""Shapes of IR-SIM's obstacles: circles, rectangles, polygons, lines and compounds of them."""

import numpy as np

from robocov.typing import FloatArray
from robocov_app.formats import files
from robocov_app.formats.geometry.frames import UNIT_SQUARE, build_frame, transform_points
from robocov_app.formats.geometry.shapes.collection import Shapes, WallLine
from robocov_app.formats.simulators.irsim.node import Node

_DEFAULT_RADIUS_M = 0.2
_DEFAULT_SIDE_M = 1.0
"""Default length and width of a rectangle."""


class ShapeReader:
    """Adds the shapes of obstacles to a collection, and limits their number.

    Parameters
    ----------
    shapes : Shapes
    """

    def __init__(self, shapes: Shapes) -> None:
        self._shapes = shapes
        self._count = 0

    def add(self, shape: Node, frame: FloatArray, labels: tuple[str, ...]) -> None:
        """Add a shape, or all parts of a compound.

        Parameters
        ----------
        shape : Node
        frame : (3, 3) array
            Transform from the frame of the shape to meters.
        labels : tuple of str

        Raises
        ------
        MapError
            If a value is invalid, or there are too many shapes.
        """
        # Compounds may turn a few objects into many shapes, so shapes are counted before they are built.
        self._count += 1
        files.require_shapes(self._count, self._shapes.source_name)
        name = shape["name"].get_text("circle").lower()
        # IR-SIM places the origin of a body with a wheelbase on the rear axle.
        shift = np.array([shape["wheelbase"].parse_number(0.0) / 2, 0.0])
        if shape["random_shape"].is_true():
            self._shapes.count_omission("shape", "of random form")
        elif name == "circle":
            self._add_circle(shape, frame, labels, shift)
        elif name == "rectangle":
            self._add_rectangle(shape, frame, labels, shift)
        elif name == "polygon":
            points = _parse_vertices(shape, frame, minimum=3)
            self._shapes.add_outline([points], labels, location=_get_location(shape), kind="polygon")
        elif name == "linestring":
            points = _parse_vertices(shape, frame, minimum=2)
            self._shapes.add_line(
                WallLine(points, self._shapes.thickness, labels), location=_get_location(shape)
            )
        elif name == "compound":
            for part in shape["parts"].list_items():
                pose = part["pose"].parse_numbers([0.0, 0.0, 0.0])[:3]
                self.add(part, frame @ build_frame(*pose), labels)
        else:
            shape["name"].raise_error("circle, rectangle, polygon, linestring or compound")

    def _add_circle(self, shape: Node, frame: FloatArray, labels: tuple[str, ...], shift: FloatArray) -> None:
        """Add a disc; `shift`, (2,) m, moves it within its frame."""
        center = shape["center"].parse_numbers([0.0, 0.0])[:2] + shift
        radius = shape["radius"].parse_length(_DEFAULT_RADIUS_M)
        (center,) = transform_points(frame, center[None])
        self._shapes.add_circle(center, radius, labels, location=_get_location(shape))

    def _add_rectangle(
        self, shape: Node, frame: FloatArray, labels: tuple[str, ...], shift: FloatArray
    ) -> None:
        length = shape["length"].parse_length(_DEFAULT_SIDE_M)
        width = shape["width"].parse_length(_DEFAULT_SIDE_M)
        ring = transform_points(frame, UNIT_SQUARE * [length, width] + shift)
        self._shapes.add_outline([ring], labels, location=_get_location(shape))


def _get_location(shape: Node) -> str:
    """Return the location of a shape for messages, without the name of the file."""
    _, _, location = shape.location.partition(": ")
    return location


def _parse_vertices(shape: Node, frame: FloatArray, *, minimum: int) -> FloatArray:
    """Return the vertices of a polygon or line, (k, 2) m; raise MapError if there are too few."""
    points = [point.parse_numbers([0.0, 0.0])[:2] for point in shape["vertices"].list_items()]
    if len(points) < minimum:
        shape["vertices"].raise_error("a list of points [x, y]")
    return transform_points(frame, np.array(points))
