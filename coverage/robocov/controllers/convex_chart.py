"""Diffeomorphisms of a convex region that shrink the obstacles of a known map to points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import shapely
from scipy.sparse import csr_array, diags_array
from scipy.spatial import Delaunay

from robocov.compiled import kernel
from robocov.controllers.known_map import build_configuration_space
from robocov.environment import Environment, find_nearest_inside
from robocov.observation.region import Region
from robocov.typing import BoolArray, FloatArray, IntArray

_MAX_REFINEMENTS = 12
"""Maximum number of times that wall segments are halved until they are edges of the mesh."""
_ROUNDING_M = 1e-6
"""Vertices of the mesh are rounded to multiples of this length."""


class ConvexChart:
    """Diffeomorphism F from a convex region to itself that shrinks obstacles to points. Immutable.

    Parameters
    ----------
    environment : Environment
    clearance : float, m
        Distance that the centers of robots keep from walls.
    lattice : int
        Number of cells of the mesh along a side of the region.
    shrink : float
        Stiffness of obstacles relative to the free space: the larger, the smaller they become.

    Attributes
    ----------
    configuration_space : shapely.Geometry
        Space where the centers of robots may be.
    points : (v, 2) array, m
        Vertices of a mesh of the region.
    triangles : (t, 3) int array
        Its triangles, counter-clockwise.
    images : (v, 2) array, m
        F at the vertices; it is affine on each triangle.
    samples : (k, 2) array, m
        Images of sample points of the free space.
    mass : (k,) array, m²
        Mass of each sample in the map: the free area that it represents, times the density.

    Notes
    -----
    F is a discrete harmonic map of a mesh of the whole region, obstacles included. Vertices on the boundary
    are fixed; each other vertex is the weighted mean of its neighbors, with Floater's mean value weights
    (2003), multiplied by `shrink` in obstacles. With positive weights and a convex boundary F is one-to-one
    (Tutte 1963, Floater 1997), for any `shrink`. An obstacle that touches the boundary shrinks toward the
    place where it does so, and a wall between two rooms becomes a slit. Without obstacles, or for a `shrink`
    of 1, F is the identity.
    """

    def __init__(self, environment: Environment, clearance: float, lattice: int, shrink: float) -> None:
        self.configuration_space = build_configuration_space(environment, clearance)
        shapely.prepare(self.configuration_space)
        mesh = _build_mesh(environment.region, self.configuration_space, lattice)
        self.points = mesh.points
        self.triangles = mesh.triangles
        corners = mesh.points[mesh.triangles]
        centers = corners.mean(axis=1)
        is_obstacle = ~shapely.contains_xy(self.configuration_space, centers)
        # F maps each vertex to its image. The stiffer the triangles of an obstacle are, the smaller their
        # images.
        self.images = _compute_harmonic_images(mesh, stiffness=np.where(is_obstacle, shrink, 1.0))
        image_corners = self.images[mesh.triangles]
        self._to_chart = _PiecewiseAffineMap.build(corners, image_corners)
        self._to_region = _PiecewiseAffineMap.build(image_corners, corners)

        mass = _compute_areas(corners)
        # Obstacles are enlarged by the clearance. The free space in this margin still has mass.
        mass[is_obstacle] = shapely.area(
            shapely.intersection(environment.free, shapely.polygons(corners[is_obstacle]))
        )
        has_mass = mass > 0.0
        self.samples = image_corners[has_mass].mean(axis=1)
        self.mass = mass[has_mass]
        if environment.density is not None:
            self.mass *= environment.density.evaluate(centers[has_mass])

    def map_to_chart(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute F at the nearest points of the configuration space.

        Parameters
        ----------
        positions : (n, 2) array, m

        Returns
        -------
        images : (n, 2) array, m
        jacobians : (n, 2, 2) array
            Derivatives DF at these points.
        """
        return self._to_chart.evaluate(find_nearest_inside(self.configuration_space, positions))

    def map_to_region(self, images: FloatArray) -> FloatArray:
        """Compute the points of the region that F maps to the given images.

        Parameters
        ----------
        images : (n, 2) array, m

        Returns
        -------
        (n, 2) array, m
        """
        points, _ = self._to_region.evaluate(images)
        return points


def _compute_areas(triangles: FloatArray) -> FloatArray:
    """Return the areas of counter-clockwise triangles, (t, 3, 2)."""
    x, y = (triangles[:, 1] - triangles[:, 0]).T
    u, v = (triangles[:, 2] - triangles[:, 0]).T
    return np.asarray(0.5 * (x * v - y * u))


class _PiecewiseAffineMap(NamedTuple):
    """Map that is affine on each of t triangles."""

    origins: FloatArray
    """(t, 2) Third corners of the triangles."""
    inverses: FloatArray
    """(t, 2, 2) Matrices from the offset from the origin to the first two barycentric coordinates."""
    images: FloatArray
    """(t, 3, 2) Images of the corners."""
    jacobians: FloatArray
    """(t, 2, 2) Matrices of the derivatives of the images with respect to the position."""

    @classmethod
    def build(cls, corners: FloatArray, images: FloatArray) -> _PiecewiseAffineMap:
        """Build the map from triangles, (t, 3, 2), to their images, (t, 3, 2)."""
        first = corners[:, 0] - corners[:, 2]
        second = corners[:, 1] - corners[:, 2]
        determinant = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        # The inverse of the matrix with the columns `first` and `second`.
        inverses = np.stack([second[:, ::-1] * [1.0, -1.0], first[:, ::-1] * [-1.0, 1.0]], axis=1)
        inverses /= determinant[:, None, None]
        image_sides = images[:, :2] - images[:, 2:]
        # The matrix with the sides of the image as columns, times the inverse: a sum of outer products.
        jacobians = (image_sides[..., None] * inverses[:, :, None]).sum(axis=1)
        return cls(origins=corners[:, 2], inverses=inverses, images=images, jacobians=jacobians)

    def evaluate(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the images of (n, 2) points, (n, 2), and the Jacobians there, (n, 2, 2)."""
        triangle = _find_triangles(points, self.inverses, self.origins)
        offsets = points - self.origins[triangle]
        first_two = (self.inverses[triangle] * offsets[:, None]).sum(axis=2)
        weights = np.column_stack([first_two, 1.0 - first_two.sum(axis=1)])
        images = (weights[..., None] * self.images[triangle]).sum(axis=1)
        return images, self.jacobians[triangle]


@kernel
def _find_triangles(points: FloatArray, inverses: FloatArray, origins: FloatArray) -> IntArray:
    """Return the index of the triangle that contains each of (n, 2) points, (n,).

    A point inside a triangle has no negative barycentric coordinate. For a point outside all triangles,
    return the triangle in which the smallest barycentric coordinate of the point is largest.
    """
    triangles = np.zeros(len(points), dtype=np.intp)
    for i in range(len(points)):
        best = -np.inf
        for t in range(len(origins)):
            x = points[i, 0] - origins[t, 0]
            y = points[i, 1] - origins[t, 1]
            first = inverses[t, 0, 0] * x + inverses[t, 0, 1] * y
            second = inverses[t, 1, 0] * x + inverses[t, 1, 1] * y
            smallest = min(first, second, 1.0 - first - second)
            if smallest > best:
                triangles[i] = t
                best = smallest
            if best >= 0.0:
                break
    return triangles


class _Mesh(NamedTuple):
    """Triangulation of a region with the walls as edges."""

    points: FloatArray
    """(v, 2) m, sorted vertices."""
    triangles: IntArray
    """(t, 3) Counter-clockwise."""
    is_fixed: BoolArray
    """(v,) Whether each vertex is on the boundary of the region."""


def _build_mesh(region: Region, configuration_space: shapely.Geometry, lattice: int) -> _Mesh:
    """Return a mesh of the region with the boundary of the configuration space as edges."""
    low_x, low_y, high_x, high_y = region.bounds
    spacing = max(high_x - low_x, high_y - low_y) / lattice
    boundary = shapely.union(configuration_space.boundary, region.polygon.boundary)
    walls = shapely.segmentize(boundary, spacing)
    coordinates, lines = shapely.get_coordinates(shapely.get_parts(walls), return_index=True)
    # Two consecutive points are a segment if they belong to the same line.
    is_segment = lines[1:] == lines[:-1]
    starts = coordinates[:-1][is_segment]
    ends = coordinates[1:][is_segment]
    inner = _build_inner_points(region, walls, spacing)
    # Halve the segments that are not edges of the triangulation, until all are.
    for _ in range(_MAX_REFINEMENTS):
        vertices = np.concatenate([starts, ends, inner])
        points = np.unique(np.round(vertices / _ROUNDING_M) * _ROUNDING_M, axis=0)
        triangles = Delaunay(points).simplices.astype(np.intp)
        is_edge = _find_edges(points, triangles, starts, ends)
        if is_edge.all():
            break
        middles = 0.5 * (starts + ends)[~is_edge]
        halved_starts = [starts[is_edge], starts[~is_edge], middles]
        halved_ends = [ends[is_edge], middles, ends[~is_edge]]
        starts = np.concatenate(halved_starts)
        ends = np.concatenate(halved_ends)
    is_fixed = ~region.contains(points, -2.0 * _ROUNDING_M)
    # Triangles whose vertices are all on the boundary are left out. Those along a side have no area, except
    # for rounding. Those that fill a corner of the region have a small area, which is neglected.
    is_on_boundary = is_fixed[triangles].all(axis=1)
    return _Mesh(points=points, triangles=triangles[~is_on_boundary], is_fixed=is_fixed)


def _build_inner_points(region: Region, walls: shapely.Geometry, spacing: float) -> FloatArray:
    """Return the points of a lattice, (k, 2) m, in the region and not close to walls."""
    low_x, low_y, high_x, high_y = region.bounds
    x, y = np.meshgrid(np.arange(low_x, high_x, spacing), np.arange(low_y, high_y, spacing))
    points = np.column_stack([x.ravel(), y.ravel()])
    points = points[region.contains(points)]
    return np.asarray(points[shapely.distance(walls, shapely.points(points)) > 0.5 * spacing])


def _find_edges(points: FloatArray, triangles: IntArray, starts: FloatArray, ends: FloatArray) -> BoolArray:
    """Return whether segments, from (k, 2) to (k, 2) m, are edges of triangles, (k,)."""
    first = _find_indices(points, starts)
    second = _find_indices(points, ends)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    # An edge is one number: the lower index times the number of points, plus the higher index.
    numbers = edges @ [len(points), 1]
    return np.isin(np.minimum(first, second) * len(points) + np.maximum(first, second), numbers)


def _find_indices(points: FloatArray, selected: FloatArray) -> IntArray:
    """Return the indices of selected points, (s, 2), among sorted points, (k, 2), both in meters."""
    # After rounding, each selected point equals one of `points`. The unique rows of both together are
    # therefore `points` again, and the inverse indices of the selected points are their indices in `points`.
    rounded = np.round(selected / _ROUNDING_M) * _ROUNDING_M
    _, indices = np.unique(np.concatenate([points, rounded]), axis=0, return_inverse=True)
    return np.asarray(indices.ravel()[len(points) :])


def _compute_harmonic_images(mesh: _Mesh, stiffness: FloatArray) -> FloatArray:
    """Return the images of the vertices, (v, 2) m, given the stiffness of each triangle, (t,).

    Each vertex that is not fixed is the weighted mean of its neighbors. The weight of an edge is, by
    Floater's mean value coordinates, (tan(α/2) + tan(β/2)) / length with the two adjacent angles, each
    multiplied by the stiffness of its triangle.
    """
    weights = _build_weights(mesh, stiffness)
    inner = np.flatnonzero(~mesh.is_fixed)
    fixed = np.flatnonzero(mesh.is_fixed)
    # At an inner vertex i, sum_j w_ij (x_i - x_j) = 0. The terms of the fixed vertices are known, and become
    # the right-hand side.
    right_side = weights[inner][:, fixed] @ mesh.points[fixed]
    laplacian = diags_array(weights.sum(axis=1)) - weights
    system = laplacian.tocsr()[inner][:, inner].tocoo()
    # Vertices are sorted, so that the indices of neighbors are close to each other, and all elements of the
    # matrix that are not zero lie in a narrow band around the diagonal.
    bandwidth = int(np.abs(system.row - system.col).max(initial=0))
    band = np.zeros((len(inner), 2 * bandwidth + 1))
    band[system.row, system.col - system.row + bandwidth] = system.data
    images = mesh.points.copy()
    images[inner] = _solve_banded_system(band, right_side)
    return images


def _build_weights(mesh: _Mesh, stiffness: FloatArray) -> csr_array:
    """Build the matrix of mean value weights; entry (i, j) is the weight of vertex j in the mean at vertex i.

    A triangle with the angle α at a vertex adds its stiffness times tan(α/2) / length to the weights of its
    two edges from that vertex. If a and b are the vectors of these edges,

        tan(α/2) = |a × b| / (|a| |b| + a · b)
    """
    rows = []
    columns = []
    weights = []
    for k in range(3):
        vertex = mesh.triangles[:, k]
        next_vertex = mesh.triangles[:, (k + 1) % 3]
        previous_vertex = mesh.triangles[:, (k + 2) % 3]
        a = mesh.points[next_vertex] - mesh.points[vertex]
        b = mesh.points[previous_vertex] - mesh.points[vertex]
        a_length = np.hypot(*a.T)
        b_length = np.hypot(*b.T)
        cross = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        tangent_of_half_angle = cross / (a_length * b_length + (a * b).sum(axis=1))
        rows += [vertex, vertex]
        columns += [next_vertex, previous_vertex]
        weights += [
            stiffness * tangent_of_half_angle / a_length,
            stiffness * tangent_of_half_angle / b_length,
        ]
    # Entries with the same indices are added up: each inner edge has one from either triangle.
    indices = (np.concatenate(rows), np.concatenate(columns))
    size = len(mesh.points)
    return csr_array((np.concatenate(weights), indices), shape=(size, size))


@kernel
def _solve_banded_system(band: FloatArray, right_side: FloatArray) -> FloatArray:
    """Solve a banded linear system in place by Gaussian elimination, and return the solution.

    The matrix is diagonally dominant, so that no pivoting is needed.

    Parameters
    ----------
    band : (v, 2 b + 1) array
        The diagonal of the matrix, and b diagonals on either side: element (i, j) of the matrix is stored in
        row i and column j - i + b. Overwritten.
    right_side : (v, 2) array
        Two right-hand sides. Overwritten by the solutions.
    """
    size = len(band)
    b = band.shape[1] // 2
    # Eliminate the elements below the diagonal.
    for k in range(size):
        end = min(size, k + b + 1)
        for row in range(k + 1, end):
            factor = band[row, k - row + b] / band[k, b]
            if factor != 0.0:
                right_side[row] -= factor * right_side[k]
                for column in range(k, end):
                    band[row, column - row + b] -= factor * band[k, column - k + b]
    # Substitute back, from the last row to the first.
    for k in range(size - 1, -1, -1):
        for column in range(k + 1, min(size, k + b + 1)):
            right_side[k] -= band[k, column - k + b] * right_side[column]
        right_side[k] /= band[k, b]
    return right_side
