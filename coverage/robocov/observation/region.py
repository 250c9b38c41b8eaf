"""The convex region: the outer boundary as the robots know it."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon

from robocov.arrays import Array, BoolArray, freeze
from robocov.errors import InputError


@dataclass(frozen=True, eq=False)
class Region:
    """A convex polygon with what the control laws need of it, computed once; an InputError without area."""

    vertices: Array
    """(k, 2) m, counter-clockwise, no three collinear, the first not repeated."""
    edges: Array = field(init=False)
    """(k, 2) m, ``vertices[e + 1] - vertices[e]``."""
    normals: Array = field(init=False)
    """(k, 2) Outward unit normals of the edges."""
    offsets: Array = field(init=False)
    """(k,) m, ``normals[e] @ vertices[e]``: a point q is inside iff ``normals @ q <= offsets``."""
    sides: Array = field(init=False)
    """(k, 5) Vertices, normals and offsets side by side."""
    area: float = field(init=False)
    """m²"""
    centroid: Array = field(init=False)
    """(2,) m"""

    def __post_init__(self) -> None:
        hull = shapely.convex_hull(shapely.MultiPoint(np.asarray(self.vertices, dtype=float)))
        if not isinstance(hull, Polygon) or hull.area <= 0.0:
            raise InputError("region: the outer boundary has no area")
        ring = np.asarray(shapely.orient_polygons(hull).exterior.coords)[:-1]
        # hull vertices that lie on a line between their neighbours would give edges of no use
        ring = _without_collinear(ring)
        edges = np.roll(ring, -1, axis=0) - ring
        lengths = np.hypot(edges[:, 0], edges[:, 1])
        normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths[:, None]
        offsets = np.einsum("ed,ed->e", normals, ring)
        # the way round being frozen
        vars(self).update(
            vertices=freeze(ring),
            edges=freeze(edges),
            normals=freeze(normals),
            offsets=freeze(offsets),
            sides=freeze(np.column_stack([ring, normals, offsets])),
            area=float(hull.area),
            centroid=freeze(hull.centroid.coords[0]),
        )

    @property
    def polygon(self) -> Polygon:
        """The region as a shapely polygon."""
        return Polygon(self.vertices)

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Smallest x, smallest y, largest x, largest y in metres."""
        low_x, low_y, high_x, high_y = self.polygon.bounds
        return low_x, low_y, high_x, high_y

    @cached_property
    def diameter(self) -> float:
        """Diagonal of the bounding box in metres: a length that no distance inside exceeds."""
        low_x, low_y, high_x, high_y = self.bounds
        return float(np.hypot(high_x - low_x, high_y - low_y))

    def contains(self, points: Array, tolerance: float = 0.0) -> BoolArray:
        """Return for (..., 2) points whether they lie inside, up to `tolerance` metres outside."""
        inside = points @ self.normals.T <= self.offsets + tolerance
        return np.asarray(inside.all(axis=-1))


def _without_collinear(ring: Array) -> Array:
    """Return the (k, 2) convex ring without vertices that bend it by less than 1e-9 rad."""
    before = ring - np.roll(ring, 1, axis=0)
    after = np.roll(ring, -1, axis=0) - ring
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    size = np.hypot(*before.T) * np.hypot(*after.T)
    return np.asarray(ring[cross > 1e-9 * size])
