"""Objects of TMX files: rectangles, ellipses, polygons, lines and points, in pixels."""

import math
from typing import Literal, NamedTuple

import numpy as np

from robocov.environment import CircleObstacle
from robocov.typing import FloatArray
from robocov_app.formats.files.xml_tree import Element
from robocov_app.formats.geometry.frames import build_frame, transform_points
from robocov_app.formats.raster.tmx.attributes import parse_number, parse_vector
from robocov_app.formats.raster.tmx.tile_data import (
    FLIPPED_DIAGONALLY,
    FLIPPED_HORIZONTALLY,
    FLIPPED_VERTICALLY,
)

RECTANGLE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
"""Vertices of the unit square with a corner at the origin, (4, 2)."""
_DISC = CircleObstacle((0.0, 0.0), 1.0).polygon


class ObjectShape(NamedTuple):
    """The shape of an object.

    Attributes
    ----------
    kind : "polygon", "line", "point", "circle" or ""
        Empty for objects that are not read: texts, capsules, and objects defined by a template.
    points : (k, 2) array, px
        Vertices, with the y axis down. For a circle: its center and a point on its edge.
    """

    kind: Literal["polygon", "line", "point", "circle", ""]
    points: FloatArray


def parse_object(element: Element) -> ObjectShape:
    """Return the shape of an object, in pixels of its layer.

    Raises
    ------
    MapError
        If a number is invalid.
    """
    x, y = parse_vector(element, "x", "y")
    width, height = parse_vector(element, "width", "height").tolist()
    rotation = math.radians(parse_number(element, "rotation"))
    children = {child.tag: child for child in element.children}
    if "template" in element.attributes or children.keys() & {"text", "capsule"}:
        return ObjectShape("", np.empty((0, 2)))
    shape = _parse_outline(element, children, width, height)
    return shape._replace(points=transform_points(build_frame(x, y, rotation), shape.points))


def _parse_outline(
    element: Element, children: dict[str, Element], width: float, height: float
) -> ObjectShape:
    """Return the shape of an object relative to its position, before rotation."""
    rectangle = RECTANGLE * [width, height]
    if "polyline" in children:
        return ObjectShape("line", _parse_vertices(children["polyline"], 2))
    if "polygon" in children:
        return ObjectShape("polygon", _parse_vertices(children["polygon"], 3))
    if "gid" in element.attributes:  # The position of a picture is its lower left corner.
        return ObjectShape("polygon", rectangle - [0.0, height])
    if "point" in children or width == height == 0.0:
        return ObjectShape("point", np.zeros((1, 2)))
    if "ellipse" not in children:
        return ObjectShape("polygon", rectangle)
    center = np.array([width, height]) / 2
    if width == height:
        return ObjectShape("circle", np.array([center, [width, height / 2]]))
    return ObjectShape("polygon", np.asarray(_DISC.exterior.coords)[:-1] * center + center)


def _parse_vertices(element: Element, minimum: int) -> FloatArray:
    """Return the vertices of a polygon or polyline, (k, 2) px; raise MapError if there are too few."""
    numbers = element.parse_numbers("points")
    if len(numbers) % 2 or len(numbers) < 2 * minimum:
        element.raise_error(f"points: expected {minimum} points, got {len(numbers)} numbers")
    return numbers.reshape(-1, 2)


def flip_points(points: FloatArray, gid: int, size: FloatArray) -> FloatArray:
    """Flip points on the picture of a tile as specified by the flags in its global ID.

    Parameters
    ----------
    points : (k, 2) array, px
    gid : int
    size : (2,) array, px
        Size of the picture.

    Returns
    -------
    (k, 2) array, px
    """
    if gid & FLIPPED_DIAGONALLY:
        points = points[:, ::-1]
        size = size[::-1]
    for axis, flag in enumerate((FLIPPED_HORIZONTALLY, FLIPPED_VERTICALLY)):
        if gid & flag:
            points = np.where(np.arange(2) == axis, size - points, points)
    return points
