"""Cells by travel time: the multiplicatively weighted Voronoi partition of robots of different speeds.

Cell i contains the points that robot i reaches before any other, |q - p_i| / v_i <= |q - p_j| / v_j, on a
straight line. The border between robots of the same speed is their bisector; between robots of different
speeds it is a circle of Apollonius around the slower one. Cells are bounded by segments and arcs, and may be
neither convex nor connected: the cell of a slow robot is a hole in that of a fast one, or divides it. The
centroid, at which the cost sum_i int |q - p_i|² / v_i² dq is smallest for given cells, may then lie in the
cell of another robot.

Source: F. Aurenhammer and H. Edelsbrunner, *An optimal algorithm for constructing the weighted Voronoi
diagram in the plane*, Pattern Recognition 17 (1984). Here the pieces of all boundaries are found
independently and not linked, because Green's theorem needs no order.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.density.base import Density
from robocov.density.cell_edges import MASS, MOMENT_X, MOMENT_Y, POLAR_MOMENT, CellEdges
from robocov.errors import InputError, quote
from robocov.observation import Cells
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.voronoi.arcs import CELL, OTHER_CELL, compute_moments, link_rings, split_into_chords
from robocov.voronoi.boundary_curves import trace_boundaries
from robocov.voronoi.bounded_partition import (
    VoronoiPartition,
    apply_density,
    check_neighbors,
    partition,
    to_generators,
)
from robocov.voronoi.delaunay import Mesh

_OUTLINE_DEVIATION = 2e-4
"""Maximum deviation of drawn outlines from their arcs, relative to the region's diameter."""
_EDGE_DEVIATION = 2e-5
"""Maximum deviation of the polygons that replace cells in integrals, relative to the region's diameter."""
_MIN_AREA = 1e-14
"""Area of a cell, relative to that of the region, below which it is empty up to rounding."""


@dataclass(eq=False, kw_only=True)
class WeightedCells(Cells):
    """The cells of robots of different speeds within a convex region.

    The centroid of a cell that is not convex may lie outside it. There is no triangulation.

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
    triangulation : None
        There is none.
    speeds : (n,) array, m/s
        Speeds of the robots.
    pieces : (p, 7) array
        The pieces of the boundaries, by cell; for the columns see `robocov.voronoi.arcs`.
    region : Region
        The region that the cells divide.

    See Also
    --------
    partition_by_travel_time : Compute the cells.
    VoronoiPartition : Cells of robots of equal speeds.

    Examples
    --------
    >>> import numpy as np
    >>> import robocov as rc
    >>> square = rc.Region([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> positions = np.array([[0.5, 1.0], [1.5, 1.0]])
    >>> cells = rc.partition_by_travel_time(positions, np.array([0.5, 1.0]), square)
    >>> bool(cells.mass[0] < cells.mass[1]), round(float(cells.mass.sum()), 9)
    (True, 4.0)
    """

    speeds: Array
    """(n,) m/s"""
    pieces: Array
    """(p, 7) The pieces of the boundaries, by cell; for the columns see `robocov.voronoi.arcs`."""
    region: Region

    @cached_property
    def edges(self) -> CellEdges:
        """The boundaries as polygons that deviate from the arcs by at most 2e-5 of the region's diameter.

        The edges of a cell are in no particular order. Those of holes run clockwise.
        """
        lines = split_into_chords(self.pieces, _EDGE_DEVIATION * self.region.diameter)
        chord_counts = [len(line) - 1 for line in lines]
        return CellEdges(
            start=np.concatenate([np.empty((0, 2)), *(line[:-1] for line in lines)]),
            end=np.concatenate([np.empty((0, 2)), *(line[1:] for line in lines)]),
            cell=self.pieces[:, CELL].astype(np.intp).repeat(chord_counts),
            other_cell=self.pieces[:, OTHER_CELL].astype(np.intp).repeat(chord_counts),
        )

    @cached_property
    def outlines(self) -> tuple[list[Array], IntArray]:
        """The outlines of the cells as polygons, (k, 2) m each, and the cell that each outline belongs to.

        Chords replace the arcs. Outlines run counter-clockwise around a component of a cell, clockwise around
        a hole. The cells of fast robots come first. A hole in a cell contains only cells of slower robots,
        which are painted later, so that a program that cannot draw holes may fill them.
        """
        outlines = []
        cells = []
        for i in np.argsort(-self.speeds, kind="stable").tolist():
            pieces = self.pieces[self.pieces[:, CELL] == i]
            for ring in link_rings(pieces, _OUTLINE_DEVIATION * self.region.diameter):
                outlines.append(ring + self.generators[i])
                cells.append(i)
        return outlines, np.array(cells, dtype=np.intp)

    @cached_property
    def polar_moment(self) -> Array:
        """Polar moments of the cells about their generators, (n,) m⁴; exact if the density is uniform."""
        if self.density is not None and not self.density.is_uniform:
            return super().polar_moment
        weight = 1.0 if self.density is None else self.density.max_value
        moments = compute_moments(self.pieces, cell_count=len(self.generators))
        return np.where(self.mass > 0.0, weight * moments[:, POLAR_MOMENT], 0.0)


def partition_by_travel_time(
    generators: Array,
    speeds: Array,
    region: Region,
    neighbors: Neighbors | None = None,
    triangulation: Mesh | None = None,
    reported_positions: Array | None = None,
    density: Density | None = None,
) -> VoronoiPartition | WeightedCells:
    """Compute the cells of the points that each robot reaches first, on a straight line.

    Each cell depends, to the last bit, only on the positions and speeds of its robot and of its neighbors.

    Parameters
    ----------
    generators : (n, 2) array, m
        Generators at the same position do not cut each other's cells if they are equally fast. Otherwise only
        the fastest of them have a cell, and the cells of the others are empty.
    speeds : (n,) array, m/s
        Positive. If all are equal, the cells are those of `partition`, bit for bit.
    region, neighbors, triangulation, reported_positions
        See `partition`.
    density : Density or None
        φ is integrated over cells whose arcs are replaced by chords, which deviate from them by at most 2e-5
        of the region's diameter. By default it is 1 everywhere, and moments are exact.

    Returns
    -------
    VoronoiPartition or WeightedCells
        A `VoronoiPartition` if all robots are equally fast.

    Raises
    ------
    InputError
        See `partition`; also if the speeds are not n positive, finite numbers.

    See Also
    --------
    partition : Cells of the points that are nearest to each robot.
    WeightedCells : Masses, centroids and outlines of the cells.

    Notes
    -----
    Cell i contains the points q with ``|q - p_i| / v_i <= |q - p_j| / v_j`` for all neighbors j. The border
    between two cells is part of a circle of Apollonius. The paper has only cells of equal speeds (1), and
    names heterogeneous teams as future work.

    Examples
    --------
    The cell of a robot is a disc if the other one is twice as fast. Its radius is 2/3 of their distance.

    >>> import numpy as np
    >>> import robocov as rc
    >>> square = rc.Region(np.array([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]))
    >>> cells = rc.partition_by_travel_time(np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([1.0, 2.0]), square)
    >>> bool(abs(cells.mass[0] - np.pi * 2.0**2) < 1e-12), cells.centroid[0].round(12).tolist()
    (True, [-1.0, 0.0])
    """
    points = to_generators(generators)
    speeds = _convert_speeds(speeds, len(points))
    if neighbors is None:
        neighbors = Neighbors(len(points))
    check_neighbors(neighbors, reported_positions, len(points))
    if (speeds == speeds[:1]).all():
        return partition(
            points,
            region,
            neighbors,
            triangulation=triangulation,
            reported_positions=reported_positions,
            density=density,
        )
    cells = _compute_weighted_cells(points, speeds, region, neighbors, reported_positions)
    return apply_density(cells, density)


def _compute_weighted_cells(
    points: Array, speeds: Array, region: Region, neighbors: Neighbors, reported_positions: Array | None
) -> WeightedCells:
    """Compute cells of robots whose speeds are not all equal, for a density of 1.

    The borders between robots of the same speed are straight, and bound a polygon around each robot. The
    circles of Apollonius between robots of different speeds then cut areas off these polygons.
    """
    robot, neighbor = neighbors.list_pairs()
    neighbor_positions = points[neighbor] if reported_positions is None else np.asarray(reported_positions)
    is_equal = speeds[robot] == speeds[neighbor]
    equal_cells = partition(
        points,
        region,
        Neighbors.from_pairs(len(points), robot[is_equal], neighbor[is_equal]),
        reported_positions=None if reported_positions is None else neighbor_positions[is_equal],
    )
    edges = equal_cells.edges
    offsets = neighbor_positions - points[robot]
    is_straight = np.empty(len(points), dtype=bool)
    # When the kernel runs as Python, NumPy would warn of infinite and undefined numbers.
    with np.errstate(all="ignore"):
        pieces = trace_boundaries(
            points=points,
            sides=region.sides,
            pairs=np.column_stack([robot, neighbor, offsets, speeds[robot], speeds[neighbor]]),
            edges=np.column_stack([edges.start, edges.end, edges.cell, edges.other_cell]),
            is_straight=is_straight,
        )
    moments = compute_moments(pieces, cell_count=len(points))
    areas = moments[:, MASS]
    first_moments = moments[:, [MOMENT_X, MOMENT_Y]]
    mass = np.where(areas < _MIN_AREA * region.area, 0.0, areas)
    # The centroid of an empty cell is its generator.
    centroid = points + first_moments / np.where(mass > 0.0, mass, np.inf)[:, None]
    # A cell without arcs is the same as among equally fast robots, and so are the bits of mass and centroid.
    mass = np.where(is_straight, equal_cells.mass, mass)
    centroid = np.where(is_straight[:, None], equal_cells.centroid, centroid)
    speeds.setflags(write=False)
    return WeightedCells(
        generators=points,
        mass=mass,
        centroid=centroid,
        speeds=speeds,
        pieces=pieces,
        region=region,
    )


def _convert_speeds(values: object, robot_count: int) -> Array:
    """Convert speeds to a new array of shape (n,); raise InputError if they are not positive numbers."""
    try:
        speeds = np.array(values, dtype=np.float64)
        is_valid = speeds.shape == (robot_count,) and bool(((speeds > 0.0) & (speeds < np.inf)).all())
    except (TypeError, ValueError):
        is_valid = False
    if not is_valid:
        raise InputError(f"speeds: expected {robot_count} positive numbers, got {quote(_to_list(values))}")
    return speeds


def _to_list(values: object) -> object:
    """Convert an array to a list, which messages can quote; return anything else unchanged."""
    return values.tolist() if isinstance(values, np.ndarray) else values
