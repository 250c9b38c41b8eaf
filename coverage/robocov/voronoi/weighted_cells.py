"""Cells by travel time: the multiplicatively weighted Voronoi partition of robots of different speeds.

Cell i contains the points q that robot i reaches first on a straight line: |q - p_i| / v_i <= |q - p_j| / v_j
for all other robots j. The border between robots of the same speed is their bisector. Between robots of
different speeds, it is a circle of Apollonius around the slower robot. Cells are bounded by segments and
arcs. They may be neither convex nor connected: the cell of a slow robot may be a hole in that of a fast
robot, or divide it. The centroid, which minimizes the cost sum_i ∫ |q - p_i|² / v_i² dq for given cells, may
then lie in the cell of another robot.

Source: F. Aurenhammer and H. Edelsbrunner, *An optimal algorithm for constructing the weighted Voronoi
diagram in the plane*, Pattern Recognition 17 (1984). Unlike there, the pieces of all boundaries are found
independently of each other and are not linked, because the integrals by Green's theorem do not depend on
their order.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robocov.density.base import Density
from robocov.density.cell_edges import MASS, MOMENT_X, MOMENT_Y, POLAR_MOMENT, CellEdges
from robocov.errors import InputError, quote
from robocov.observation import Cells, to_numbers
from robocov.observation.neighbors import Neighbors
from robocov.observation.region import Region
from robocov.typing import FloatArray, IntArray
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
"""Maximum deviation of drawn outlines from their arcs, as a fraction of the region's diameter."""
_EDGE_DEVIATION = 2e-5
"""Maximum deviation of the polygons that replace cells in integrals, as a fraction of the region's
diameter."""
_MIN_AREA = 1e-14
"""Areas of cells below this fraction of the area of the region may be rounding errors."""


@dataclass(eq=False, kw_only=True)
class WeightedCells(Cells):
    """The cells of robots of different speeds within a convex region.

    A cell may be neither convex nor connected, and its centroid may lie outside the cell.

    Attributes
    ----------
    generators : (n, 2) array, m
        The position of the robot to which each cell belongs.
    masses : (n,) array, m²
        Mass M of each cell, equation (2). It is the area if the density is 1.
    centroids : (n, 2) array, m
        Centroid C of each cell, equation (2). The centroid of an empty cell is its generator.
    density : Density or None
        Density φ with which masses, centroids and moments are computed; None means 1 everywhere.
    triangulation : None
        These cells have no triangulation.
    speeds : (n,) array, m/s
        Speed of each robot.
    pieces : (p, 7) array
        The pieces of the boundaries, sorted by cell; for the columns, see `robocov.voronoi.arcs`.
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
    >>> bool(cells.masses[0] < cells.masses[1]), round(float(cells.masses.sum()), 9)
    (True, 4.0)
    """

    speeds: FloatArray
    pieces: FloatArray
    region: Region

    @cached_property
    def edges(self) -> CellEdges:
        """The boundaries as edges, with chords in place of the arcs.

        The chords deviate from the arcs by at most 2e-5 of the region's diameter. The edges of a cell are in
        no particular order. The edges of holes run clockwise.
        """
        lines = split_into_chords(self.pieces, _EDGE_DEVIATION * self.region.diameter)
        chord_counts = [len(line) - 1 for line in lines]
        return CellEdges(
            starts=np.concatenate([np.empty((0, 2)), *(line[:-1] for line in lines)]),
            ends=np.concatenate([np.empty((0, 2)), *(line[1:] for line in lines)]),
            cells=self.pieces[:, CELL].astype(np.intp).repeat(chord_counts),
            other_cells=self.pieces[:, OTHER_CELL].astype(np.intp).repeat(chord_counts),
        )

    @cached_property
    def outlines(self) -> tuple[list[FloatArray], IntArray]:
        """The outlines of the cells as polygons, (k, 2) m each, and the index of the cell of each outline.

        Chords replace the arcs. An outline runs counter-clockwise around a component of a cell, or clockwise
        around a hole. The cells of fast robots come first. A hole in a cell contains only cells of slower
        robots, so that a program that cannot draw holes may fill them, and paint the later cells over them.
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
    def polar_moments(self) -> FloatArray:
        """Polar moment of each cell about its generator, (n,) m⁴; exact if the density is uniform."""
        if self.density is not None and not self.density.is_uniform:
            return super().polar_moments
        weight = 1.0 if self.density is None else self.density.upper_bound
        moments = compute_moments(self.pieces, cell_count=len(self.generators))
        return np.where(self.masses > 0.0, weight * moments[:, POLAR_MOMENT], 0.0)


def partition_by_travel_time(
    generators: FloatArray,
    speeds: FloatArray,
    region: Region,
    neighbors: Neighbors | None = None,
    triangulation: Mesh | None = None,
    reported_positions: FloatArray | None = None,
    density: Density | None = None,
) -> VoronoiPartition | WeightedCells:
    """Compute the cells of points that each robot reaches before all others on a straight line.

    Each cell depends, to the last bit, only on the positions and speeds of its robot and of the neighbors.

    Parameters
    ----------
    generators : (n, 2) array, m
        Positions of the robots. Equally fast robots at the same position have the same cell. If a faster
        robot is at the position of a robot, the cell of the slower one is empty.
    speeds : (n,) array, m/s
        Speed of each robot, above 0. If all are equal, the cells are those of `partition`, bit for bit.
    region, neighbors, triangulation, reported_positions
        See `partition`.
    density : Density or None
        Density φ with which masses, centroids and moments are computed. It is integrated over cells in which
        chords replace the arcs; the chords deviate from the arcs by at most 2e-5 of the region's diameter. By
        default the density is 1 everywhere, and the integrals are exact.

    Returns
    -------
    VoronoiPartition or WeightedCells
        The cells: a `VoronoiPartition` if all robots are equally fast, and otherwise `WeightedCells`.

    Raises
    ------
    InputError
        If the speeds are not n positive, finite numbers, and for the reasons given in `partition`.

    See Also
    --------
    partition : Cells of the points that are nearest to each robot.
    WeightedCells : Masses, centroids and outlines of the cells.

    Notes
    -----
    Cell i contains the points q with ``|q - p_i| / v_i <= |q - p_j| / v_j`` for all neighbors j. The border
    between the cells of two robots of different speeds is part of a circle of Apollonius. The paper considers
    only robots of equal speeds (1), and names heterogeneous teams as future work.

    Examples
    --------
    If the other robot is twice as fast, the cell of a robot is a disc, whose radius is 2/3 of their distance.

    >>> import numpy as np
    >>> import robocov as rc
    >>> square = rc.Region(np.array([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]))
    >>> cells = rc.partition_by_travel_time(np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([1.0, 2.0]), square)
    >>> bool(abs(cells.masses[0] - np.pi * 2.0**2) < 1e-12), cells.centroids[0].round(12).tolist()
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
    points: FloatArray,
    speeds: FloatArray,
    region: Region,
    neighbors: Neighbors,
    reported_positions: FloatArray | None,
) -> WeightedCells:
    """Compute the cells of robots whose speeds are not all equal, for density 1.

    The borders between robots of the same speed are straight, and bound a polygon around each robot. The
    circles of Apollonius between robots of different speeds then cut areas off these polygons.
    """
    robots, other_robots = neighbors.list_pairs()
    if reported_positions is None:
        neighbor_positions = points[other_robots]
    else:
        neighbor_positions = np.asarray(reported_positions)
    is_equal = speeds[robots] == speeds[other_robots]
    polygons = partition(
        points,
        region,
        Neighbors.from_pairs(len(points), robots[is_equal], other_robots[is_equal]),
        reported_positions=None if reported_positions is None else neighbor_positions[is_equal],
    )
    edges = polygons.edges
    offsets = neighbor_positions - points[robots]
    is_straight = np.empty(len(points), dtype=bool)
    # If the kernel runs as Python code, NumPy would warn of infinite and undefined numbers.
    with np.errstate(all="ignore"):
        pieces = trace_boundaries(
            points=points,
            sides=region.sides,
            pairs=np.column_stack([robots, other_robots, offsets, speeds[robots], speeds[other_robots]]),
            edges=np.column_stack([edges.starts, edges.ends, edges.cells, edges.other_cells]),
            is_straight=is_straight,
        )
    moments = compute_moments(pieces, cell_count=len(points))
    areas = moments[:, MASS]
    first_moments = moments[:, [MOMENT_X, MOMENT_Y]]
    masses = np.where(areas < _MIN_AREA * region.area, 0.0, areas)
    # The centroid of an empty cell is its generator.
    centroids = points + first_moments / np.where(masses > 0.0, masses, np.inf)[:, None]
    # A cell without arcs is one of the polygons. Take the mass and centroid that were computed for the
    # polygon, so that their last bits do not depend on the presence of other robots.
    masses = np.where(is_straight, polygons.masses, masses)
    centroids = np.where(is_straight[:, None], polygons.centroids, centroids)
    speeds.setflags(write=False)
    return WeightedCells(
        generators=points,
        masses=masses,
        centroids=centroids,
        speeds=speeds,
        pieces=pieces,
        region=region,
    )


def _convert_speeds(values: object, robot_count: int) -> FloatArray:
    """Convert speeds to a new array, (n,); raise InputError if they are not positive, finite numbers."""
    speeds = to_numbers(values)
    if speeds is None or speeds.shape != (robot_count,) or not ((speeds > 0.0) & (speeds < np.inf)).all():
        raise InputError(f"speeds: expected {robot_count} positive numbers, got {quote(_to_list(values))}")
    return speeds.copy()


def _to_list(values: object) -> object:
    """Convert an array to a list, so that messages can quote it; return anything else unchanged."""
    return values.tolist() if isinstance(values, np.ndarray) else values
