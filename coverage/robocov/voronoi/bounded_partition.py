"""The bounded Voronoi partition (1) of all robots, with the masses and centroids (2) of its cells."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.density.base import Density
from robocov.density.cell_edges import CellEdges
from robocov.errors import InputError, quote
from robocov.observation import Cells
from robocov.observation.neighbors import NeighborPositions, Neighbors
from robocov.observation.region import Region
from robocov.voronoi.clipped_cells import compute_clipped_cells
from robocov.voronoi.clipping import EDGE_CELL, EDGE_COLUMNS, EDGE_END_X, EDGE_OTHER_CELL, CellArrays
from robocov.voronoi.delaunay import CORNER, ENTRIES_PER_TRIANGLE, NOT_TRIANGULATED, Mesh
from robocov.voronoi.triangulated_cells import FAILED, compute_triangulated_cells

_MIN_TRIANGULATED_ROBOTS = 16
"""Team size from which a triangulation is faster than clipping each cell by all other robots."""

_NO_EDGES = np.empty((0, EDGE_COLUMNS))
_NO_MESH = np.empty((2, 0), dtype=np.int32)
"""Replaces the triangulation if cells are clipped."""
_NOT_FINITE = -1
"""Returned instead of a number of edges if the coordinates of a generator are not finite."""

_AnyCells = TypeVar("_AnyCells", bound=Cells)


@dataclass(eq=False, kw_only=True)
class VoronoiPartition(Cells):
    """The cells V_i of equation (1) within a convex region.

    Attributes
    ----------
    generators : (n, 2) array, m
        The points to which the cells belong.
    mass : (n,) array, m²
        M of equation (2): the area of each cell if the density is 1.
    centroid : (n, 2) array, m
        C of equation (2). The centroid of an empty cell is its generator.
    density : Density or None
        φ of mass, centroid and moments; None means 1 everywhere.
    triangulation : (2, 8 n + 4) int32 array or None
        Triangulation from which the partition of slightly moved generators can start.

    See Also
    --------
    partition : Compute the cells.
    WeightedCells : Cells of robots of different speeds.

    Examples
    --------
    >>> import robocov as rc
    >>> square = rc.Region([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> cells = rc.partition([[0.5, 1.0], [1.5, 1.0]], square)
    >>> cells.centroid
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
    def polygons(self) -> list[Array]:
        """The cells, (k, 2) m each, counter-clockwise; (0, 2) if a cell is empty."""
        return self.edges.build_polygons(self.generators)

    @property
    def outlines(self) -> tuple[list[Array], IntArray]:
        """The polygons of the cells, and the index of the cell of each."""
        return self.polygons, np.arange(len(self.generators))


def partition(
    generators: Array,
    region: Region,
    neighbors: Neighbors | None = None,
    triangulation: Mesh | None = None,
    reported_positions: Array | None = None,
    density: Density | None = None,
) -> VoronoiPartition:
    """Compute the Voronoi cells of robots within a convex region, without regard to obstacles.

    Parameters
    ----------
    generators : (n, 2) array, m
        They may lie on the region's boundary or outside. Generators at the same position do not cut
        each other's cells.
    region : Region
        The cells divide it.
    neighbors : Neighbors or None
        Communication graph. Cell i is clipped only along the bisectors to the neighbors of robot i, and
        depends, to the last bit, on nothing else. By default each robot is a neighbor of all others.
    triangulation : (2, 8 n + 4) int32 array or None
        `Cells.triangulation` of the previous partition. If the generators have moved only a little since
        then, reusing it takes a fraction of the time. The cells are the same, to the last bit unless four
        generators lie on a circle up to rounding.
    reported_positions : (m, 2) array or None, m
        Positions of the neighbors as known to each robot, in the order of ``neighbors.indices``. The cells of
        two robots may then overlap or leave a gap, because each is based on what its own robot knows. By
        default robots know the true positions.
    density : Density or None
        φ of mass, centroid and moments; the cells do not depend on it. By default 1 everywhere.

    Returns
    -------
    VoronoiPartition

    Raises
    ------
    InputError
        If the generators are not finite numbers of shape (n, 2), or neighbors or reported positions do not
        match them.

    See Also
    --------
    partition_by_travel_time : Cells of robots of different speeds.
    VoronoiPartition : Masses, centroids, polygons and neighbors of the cells.

    Notes
    -----
    Cell V_i of equation (1) contains the points of the region that are nearer to robot i than to any of its
    neighbors. Its mass M and centroid C are those of equation (2)::

        M = ∫ φ(q) dq        C = 1/M ∫ q φ(q) dq

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> square = rc.Region(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))
    >>> halves = rc.partition(np.array([[0.5, 1.0], [1.5, 1.0]]), square)
    >>> halves.mass, halves.adjacency
    (array([2., 2.]), array([[0, 1]]))
    """
    points = to_generators(generators)
    if neighbors is None:
        neighbors = Neighbors(len(points))
    check_neighbors(neighbors, reported_positions, len(points))
    neighbor_positions = NeighborPositions.from_graph(neighbors, reported_positions)
    mesh = _create_mesh(len(points), triangulation, is_complete=neighbors.is_complete)
    cells = CellArrays(mass=np.empty(len(points)), centroid=np.empty((len(points), 2)), edges=_NO_EDGES)
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
        mass=cells.mass,
        centroid=cells.centroid,
        triangulation=mesh if mesh.shape[1] > 0 else None,
        _compute_edges=partial(_compute_edges, points, region.sides, neighbor_positions, mesh, edge_count),
    )
    return apply_density(voronoi_cells, density)


def to_generators(values: object) -> Array:
    """Convert generators to a new array.

    Parameters
    ----------
    values : (n, 2) array_like, m

    Returns
    -------
    (n, 2) array, m

    Raises
    ------
    InputError
        If the values are not numbers, or their shape is not (n, 2).
    """
    try:
        points = np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InputError(f"generators: expected numbers of shape (n, 2), got {quote(values)}") from None
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError(f"generators: expected an array of shape (n, 2), got shape {points.shape}")
    return points


def check_neighbors(neighbors: Neighbors, reported_positions: Array | None, robot_count: int) -> None:
    """Check that neighbors and reported positions match the number of robots.

    Parameters
    ----------
    neighbors : Neighbors
    reported_positions : (m, 2) array or None, m
    robot_count : int

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
    expected = (len(neighbors.indices), 2)
    if np.shape(reported_positions) != expected:
        got = np.shape(reported_positions)
        raise InputError(f"reported_positions: expected shape {expected}, got {got}")


def apply_density(cells: _AnyCells, density: Density | None) -> _AnyCells:
    """Set the density of new cells, and update their masses and centroids.

    Parameters
    ----------
    cells : Cells
        Cells computed for a density of 1. They are changed in place, and their arrays become read-only.
    density : Density or None
        None means 1 everywhere.

    Returns
    -------
    Cells
        The same cells.
    """
    cells.density = density
    if density is not None and density.is_uniform:
        cells.mass = cells.mass * density.max_value
    elif density is not None:
        cells.mass, cells.centroid = density.compute_mass_and_centroid(
            cells.edges, cells.generators, cells.mass, cells.centroid
        )
    for values in (cells.generators, cells.mass, cells.centroid):
        values.setflags(write=False)
    return cells


def _create_mesh(robot_count: int, previous: Mesh | None, *, is_complete: bool) -> Mesh:
    """Create the mesh from which the triangulation starts; it has no columns if cells are to be clipped."""
    if not is_complete or robot_count < _MIN_TRIANGULATED_ROBOTS:
        return _NO_MESH.copy()
    triangle_count = 2 * robot_count + 1
    shape = (2, ENTRIES_PER_TRIANGLE * triangle_count)
    if previous is not None and previous.shape == shape:
        return previous.copy()
    return np.full(shape, NOT_TRIANGULATED, dtype=np.int32)


def _compute_edges(
    points: Array, sides: Array, neighbor_positions: NeighborPositions, mesh: Mesh, edge_count: int
) -> CellEdges:
    """Compute the edges of all cells: the cells are computed again, this time with room for their edges."""
    edges = np.empty((edge_count, EDGE_COLUMNS))
    cells = CellArrays(mass=np.empty(len(points)), centroid=np.empty((len(points), 2)), edges=edges)
    # Copies, because read-only arrays are a different type to the compiler.
    _compute_cells(points.copy(), sides, neighbor_positions, mesh.copy(), cells)
    return CellEdges(
        start=edges[:, :EDGE_END_X].copy(),
        end=edges[:, EDGE_END_X:EDGE_CELL].copy(),
        cell=edges[:, EDGE_CELL].astype(np.intp),
        other_cell=edges[:, EDGE_OTHER_CELL].astype(np.intp),
    )


@kernel
def _compute_cells(
    points: Array, sides: Array, neighbors: NeighborPositions, mesh: Mesh, cells: CellArrays
) -> int:
    """Compute all cells; return the number of edges, or `_NOT_FINITE`.

    If the mesh has columns, all robots must be neighbors of each other, and the cells follow from their
    Delaunay triangulation. Otherwise, or if the triangulation fails, each cell is clipped along the bisectors
    to the robot's neighbors. After a failure, the first corner of the mesh is `NOT_TRIANGULATED`.
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
