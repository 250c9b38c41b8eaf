"""The convex region: the robots' knowledge of the outer boundary."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from shapely import Polygon

from robocov.arrays import compute_lengths, copy_read_only
from robocov.errors import InputError, quote, to_floats
from robocov.typing import BoolArray, FloatArray

SIDE_X = 0
"""Column of a side of the region: x of its start, m."""
SIDE_Y = 1
"""Column of a side: y of its start, m."""
SIDE_NORMAL_X = 2
"""Column of a side: x of its outward unit normal."""
SIDE_NORMAL_Y = 3
"""Column of a side: y of its outward unit normal."""
SIDE_OFFSET = 4
"""Column of a side: scalar product of its start and its normal, m."""

_MAX_COLLINEAR_TURN_RAD = 1e-9
"""Maximum change of direction at a vertex that counts as collinear with its neighbors."""


@dataclass(frozen=True, eq=False)
class Region:
    """A convex polygon with its edges, normals, area and centroid, which are computed once.

    Parameters
    ----------
    vertices : (k, 2) array, m
        Points whose convex hull is the region, in any order.

    Attributes
    ----------
    vertices : (k, 2) array, m
        Counter-clockwise; no three are collinear, and the first is not repeated at the end.
    edges : (k, 2) array, m
        ``vertices[e + 1] - vertices[e]``.
    normals : (k, 2) array
        Outward unit normals of the edges.
    offsets : (k,) array, m
        ``normals[e] @ vertices[e]``. A point q is inside if and only if ``normals @ q <= offsets``.
    sides : (k, 5) array
        The vertex, the normal and the offset of each edge in one row, for kernels. For the columns, see the
        constants `SIDE_...`.
    area : float, m²
    centroid : (2,) array, m

    Raises
    ------
    InputError
        If the vertices are not finite numbers of shape (k, 2), or the region has no area.

    See Also
    --------
    Environment.region : The region of a map.
    partition : Divide the region into Voronoi cells.

    Examples
    --------
    >>> import robocov as rc
    >>> region = rc.Region([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
    >>> region.area, region.diameter
    (12.0, 5.0)
    """

    vertices: FloatArray
    edges: FloatArray = field(init=False)
    normals: FloatArray = field(init=False)
    offsets: FloatArray = field(init=False)
    sides: FloatArray = field(init=False)
    area: float = field(init=False)
    centroid: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        points = to_floats("region", self.vertices, "[x, y] of each vertex in meters", InputError)
        if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
            raise InputError(
                f"region: expected finite [x, y] of each vertex in meters, got {quote(points.tolist())}"
            )
        hull = shapely.convex_hull(shapely.MultiPoint(points))
        if not isinstance(hull, Polygon) or hull.area <= 0.0:
            raise InputError("region: expected an outer boundary with an area above 0, got area 0")
        ring = np.asarray(shapely.orient_polygons(hull).exterior.coords)[:-1]
        # A collinear vertex would divide an edge into two with the same normal.
        ring = _remove_collinear_vertices(ring)
        if len(ring) < 3:
            # All corners of an extremely thin region count as collinear.
            raise InputError(
                "region: expected an outer boundary with at least 3 corners that are not collinear, "
                f"got {quote(points.tolist())}"
            )
        edges = np.roll(ring, -1, axis=0) - ring
        lengths = compute_lengths(edges)
        normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / lengths[:, None]
        offsets = np.einsum("ed,ed->e", normals, ring)
        derived = {
            "vertices": copy_read_only(ring),
            "edges": copy_read_only(edges),
            "normals": copy_read_only(normals),
            "offsets": copy_read_only(offsets),
            "sides": copy_read_only(np.column_stack([ring, normals, offsets])),
            "area": float(hull.area),
            "centroid": copy_read_only(hull.centroid.coords[0]),
        }
        for name, value in derived.items():
            object.__setattr__(self, name, value)  # Attributes of a frozen object cannot be assigned.

    @property
    def polygon(self) -> Polygon:
        """The region as a shapely polygon."""
        return Polygon(self.vertices)

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Minimum x and y, maximum x and y, m."""
        low_x, low_y, high_x, high_y = self.polygon.bounds
        return low_x, low_y, high_x, high_y

    @cached_property
    def diameter(self) -> float:
        """Diagonal of the bounding box, m. No two points inside are farther apart."""
        low_x, low_y, high_x, high_y = self.bounds
        return float(np.hypot(high_x - low_x, high_y - low_y))

    def contains(self, points: FloatArray, tolerance: float = 0.0) -> BoolArray:
        """Return a mask of the points inside.

        Parameters
        ----------
        points : (..., 2) array, m
        tolerance : float, m
            Maximum distance from the line of an edge at which a point beyond the edge counts as inside.

        Returns
        -------
        (...) bool array
        """
        is_inside = points @ self.normals.T <= self.offsets + tolerance
        return np.asarray(is_inside.all(axis=-1))


def _remove_collinear_vertices(ring: FloatArray) -> FloatArray:
    """Return a convex ring, (k, 2), without its collinear vertices."""
    before = ring - np.roll(ring, 1, axis=0)
    after = np.roll(ring, -1, axis=0) - ring
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    lengths = compute_lengths(before) * compute_lengths(after)
    return np.asarray(ring[cross > _MAX_COLLINEAR_TURN_RAD * lengths])
