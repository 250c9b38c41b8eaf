"""The bounded Voronoi partition (1) of all robots, with the masses and centroids (2) of its cells.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from robocov.compiled import kernel
from robocov.density.base import Density
from robocov.density.cell_edges import CellEdges
from robocov.errors import InputError, quote
from robocov.observation import Cells, to_numbers
from robocov.observation.neighbors import NeighborPositions, Neighbors
from robocov.observation.region import Region
from robocov.typing import FloatArray, IntArray
from robocov.voronoi.clipped_cells import compute_clipped_cells
from robocov.voronoi.clipping import EDGE_CELL, EDGE_COLUMNS, EDGE_END_X, EDGE_OTHER_CELL, CellArrays
from robocov.voronoi.delaunay import CORNER, ENTRIES_PER_TRIANGLE, NOT_TRIANGULATED, Mesh
from robocov.voronoi.triangulated_cells import FAILED, compute_triangulated_cells

_MIN_TRIANGULATED_ROBOTS = 16
"""Number of robots from which a triangulation is faster than clipping each cell along all bisectors."""

_NO_EDGES = np.empty((0, EDGE_COLUMNS))
"""Array of edges without space: edges are counted, but not written."""
_NO_MESH = np.empty((2, 0), dtype=np.int32)
"""Used in place of a triangulation if cells are clipped."""
_NOT_FINITE = -1
"""Returned instead of a number of edges if the coordinates of a generator are not finite."""

_AnyCells = TypeVar("_AnyCells", bound=Cells)


@dataclass(eq=False, kw_only=True)
class VoronoiPartition(Cells):
    """The Voronoi cells V_i of equation (1) within a convex region.

    Attributes
    ----------
    generators : (n, 2) array, m
        The point to which each cell belongs.
    masses : (n,) array, m²
        Mass M of each cell, equation (2). It is the area if the density is 1.
    centroids : (n, 2) array, m
        Centroid C of each cell, equation (2). The centroid of an empty cell is its generator.
    density : Density or None
        Density φ with which masses, centroids and moments are computed; None means 1 everywhere.
    triangulation : (2, 8 n + 4) int32 array or None
        Triangulation that can be passed to `partition` after the generators have moved.

    See Also
    --------
    partition : Compute the cells.
    WeightedCells : Cells of robots of different speeds.

    Examples
    --------
    >>> import robocov as rc
    >>> square = rc.Region([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> cells = rc.partition([[0.5, 1.0], [1.5, 1.0]], square)
    >>> cells.centroids
    array([[0.5, 1. ],
           [1.5, 1. ]])
    >>> [len(polygon) for polygon in cells.polygons]
    [4, 4]
    """

    _compute_edges: Callable[[], CellEdges]

    @cached_property
    def edges(self) -> CellEdges:
        """The edges of all cells, computed when they are first used."""
        return self._compute_edges()

    @cached_property
    def polygons(self) -> list[FloatArray]:
        """The vertices of each cell, (k, 2) m, counter-clockwise; of shape (0, 2) if the cell is empty."""
        return self.edges.build_polygons(self.generators)

    @property
    def outlines(self) -> tuple[list[FloatArray], IntArray]:
        """The polygons of the cells, and the index of the cell of each polygon."""
        return self.polygons, np.arange(len(self.generators))


def partition(
    generators: FloatArray,
    region: Region,
    neighbors: Neighbors | None = None,
    triangulation: Mesh | None = None,
    reported_positions: FloatArray | None = None,
    density: Density | None = None,
) -> VoronoiPartition:
    """Compute the Voronoi cells of robots within a convex region, without regard to obstacles.

    Parameters
    ----------
    generators : (n, 2) array, m
        Positions of the robots. They may lie on the boundary of the region or outside. Robots at the same
        position have the same cell.
    region : Region
        The region that the cells divide.
    neighbors : Neighbors or None
        Communication graph. Cell i is bounded only by the bisectors to the neighbors of robot i, and depends,
        to the last bit, on nothing else. By default each robot is a neighbor of all others.
    triangulation : (2, 8 n + 4) int32 array or None
        `Cells.triangulation` of the previous partition. If the generators have moved only a little since
        then, the computation takes a fraction of the time. The cells are the same as without it. Only if four
        generators lie on a circle, up to rounding, the last bits may differ.
    reported_positions : (m, 2) array or None, m
        Positions of the neighbors as known to each robot, in the order of ``neighbors.indices``. The cells of
        two robots may then overlap or leave a gap, because each cell is based on what its own robot knows. By
        default the robots know the true positions.
    density : Density or None
        Density φ with which masses, centroids and moments are computed; the cells do not depend on it. By
        default it is 1 everywhere.

    Returns
    -------
    VoronoiPartition
        The cells with their masses and centroids.

    Raises
    ------
    InputError
        If the generators are not finite numbers of shape (n, 2), or the neighbors or the reported positions
        do not match them.

    See Also
    --------
    partition_by_travel_time : Cells of robots of different speeds.
    VoronoiPartition : Masses, centroids, polygons and neighbors of the cells.

    Notes
    -----
    Cell V_i of equation (1) contains the points of the region that are nearer to robot i than to any of its
    neighbors. Its mass M and centroid C are the integrals (2) over the cell::

        M = ∫ φ(q) dq        C = 1/M ∫ q φ(q) dq

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> square = rc.Region(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))
    >>> halves = rc.partition(np.array([[0.5, 1.0], [1.5, 1.0]]), square)
    >>> halves.masses, halves.adjacency
    (array([2., 2.]), array([[0, 1]]))
    """
    points = to_generators(generators)
    if neighbors is None:
        neighbors = Neighbors(len(points))
    check_neighbors(neighbors, reported_positions, len(points))
    neighbor_positions = NeighborPositions.from_graph(neighbors, reported_positions)
    mesh = _create_mesh(len(points), triangulation, is_complete=neighbors.is_complete)
    cells = CellArrays(masses=np.empty(len(points)), centroids=np.empty((len(points), 2)), edges=_NO_EDGES)
    edge_count = _compute_cells(points, region.sides, neighbor_positions, mesh, cells)
    if edge_count == _NOT_FINITE:
        robot = int(np.isfinite(points).all(axis=1).argmin())
        raise InputError(f"generators[{robot}]: expected finite numbers, got {quote(points[robot].tolist())}")
    triangulation_failed = mesh.shape[1] > 0 and mesh[CORNER, 0] == NOT_TRIANGULATED
    if triangulation_failed:
        mesh = _NO_MESH.copy()
    mesh.setflags(write=False)
    voronoi_cells = VoronoiPartition(
        generators=points,
        masses=cells.masses,
        centroids=cells.centroids,
        triangulation=mesh if mesh.shape[1] > 0 else None,
        _compute_edges=partial(_compute_edges, points, region.sides, neighbor_positions, mesh, edge_count),
    )
    return apply_density(voronoi_cells, density)


def to_generators(values: object) -> FloatArray:
    """Convert the positions of generators to a new array.

    Parameters
    ----------
    values : (n, 2) array_like, m
        The positions.

    Returns
    -------
    (n, 2) array, m
        A contiguous copy.

    Raises
    ------
    InputError
        If the values are not numbers, or their shape is not (n, 2).
    """
    numbers = to_numbers(values)
    if numbers is None:
        raise InputError(f"generators: expected numbers of shape (n, 2), got {quote(values)}")
    points = np.array(numbers, order="C")
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError(f"generators: expected an array of shape (n, 2), got shape {points.shape}")
    return points


def check_neighbors(neighbors: Neighbors, reported_positions: FloatArray | None, robot_count: int) -> None:
    """Check that neighbors and reported positions match each other and the number of robots.

    Parameters
    ----------
    neighbors : Neighbors
        Communication graph.
    reported_positions : (m, 2) array or None, m
        Positions of the neighbors as known to each robot; see `partition`.
    robot_count : int
        Number of robots.

    Raises
    ------
    InputError
        If they do not match.
    """
    if neighbors.robot_count != robot_count:
        raise InputError(f"neighbors: expected a graph of {robot_count} robots, got {neighbors.robot_count}")
    if reported_positions is None:
        return
    if neighbors.indices is None:
        raise InputError("reported_positions: expected None without limited communication")
    expected_shape = (len(neighbors.indices), 2)
    shape = np.shape(reported_positions)
    if shape != expected_shape:
        raise InputError(f"reported_positions: expected shape {expected_shape}, got {shape}")


def apply_density(cells: _AnyCells, density: Density | None) -> _AnyCells:
    """Set the density of new cells and their masses and centroids for this density; return the cells.

    Parameters
    ----------
    cells : Cells
        Cells that were computed for density 1. They are changed in place, and their arrays become read-only.
    density : Density or None
        The density; None means 1 everywhere.

    Returns
    -------
    Cells
        The same object as `cells`.
    """
    cells.density = density
    if density is not None and density.is_uniform:
        cells.masses = cells.masses * density.upper_bound
    elif density is not None:
        cells.masses, cells.centroids = density.compute_masses_and_centroids(
            cells.edges, cells.generators, cells.masses, cells.centroids
        )
    for values in (cells.generators, cells.masses, cells.centroids):
        values.setflags(write=False)
    return cells


def _create_mesh(robot_count: int, previous: Mesh | None, *, is_complete: bool) -> Mesh:
    """Return the mesh from which the triangulation starts, without columns if the cells are to be clipped.

    `is_complete` says whether all robots are neighbors of each other, and `previous` is the mesh of the
    previous partition.
    """
    if not is_complete or robot_count < _MIN_TRIANGULATED_ROBOTS:
        return _NO_MESH.copy()
    triangle_count = 2 * robot_count + 1
    shape = (2, ENTRIES_PER_TRIANGLE * triangle_count)
    if previous is not None and previous.shape == shape:
        return previous.copy()
    return np.full(shape, NOT_TRIANGULATED, dtype=np.int32)


def _compute_edges(
    points: FloatArray, sides: FloatArray, neighbor_positions: NeighborPositions, mesh: Mesh, edge_count: int
) -> CellEdges:
    """Compute the cells again, with space for all `edge_count` edges, and return the edges.

    `partition` only counts the edges, because many callers need nothing but masses and centroids.
    """
    edges = np.empty((edge_count, EDGE_COLUMNS))
    cells = CellArrays(masses=np.empty(len(points)), centroids=np.empty((len(points), 2)), edges=edges)
    # Pass copies, because read-only arrays have a different type for the compiler.
    _compute_cells(points.copy(), sides, neighbor_positions, mesh.copy(), cells)
    return CellEdges(
        starts=edges[:, :EDGE_END_X].copy(),
        ends=edges[:, EDGE_END_X:EDGE_CELL].copy(),
        cells=edges[:, EDGE_CELL].astype(np.intp),
        other_cells=edges[:, EDGE_OTHER_CELL].astype(np.intp),
    )


@kernel
def _compute_cells(
    points: FloatArray, sides: FloatArray, neighbors: NeighborPositions, mesh: Mesh, cells: CellArrays
) -> int:
    """Compute all cells; return the number of their edges, or `_NOT_FINITE`.

    If the mesh has columns, all robots must be neighbors of each other, and the cells follow from their
    Delaunay triangulation. Otherwise, or if the triangulation fails, the region is clipped along the
    bisectors to the neighbors of each robot. After a failure, the first corner of the mesh is
    `NOT_TRIANGULATED`.
    """
    for i in range(len(points)):
        if not (abs(points[i, 0]) < np.inf and abs(points[i, 1]) < np.inf):
            return _NOT_FINITE
    if mesh.shape[1] > 0:
        edge_count = compute_triangulated_cells(points, sides, mesh, cells)
        if edge_count != FAILED:
            return edge_count
        mesh[CORNER, 0] = NOT_TRIANGULATED
    return compute_clipped_cells(points, sides, neighbors, cells)
