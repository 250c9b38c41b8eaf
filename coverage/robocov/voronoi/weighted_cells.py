"""Cells by travel time: the multiplicatively weighted Voronoi partition of robots of different speeds.

Cell i holds the places that robot i reaches before all others, |q - p_i| / v_i <= |q - p_j| / v_j, going
straight. Between robots of one speed the border is their bisector; of different speeds it is a circle of
Apollonius, around the slower one. Cells are bounded by segments and arcs, and need be neither convex nor in
one piece: a slow robot's cell is a hole in a fast one's, or divides it. The centroid, where the partition's
cost sum_i int |q - p_i|² / v_i² dq is least for given cells, may then lie in somebody else's cell.

Source: F. Aurenhammer and H. Edelsbrunner, *An optimal algorithm for constructing the weighted Voronoi
diagram in the plane*, Pattern Recognition 17 (1984). Here the boundary pieces of all cells are found at
once instead, and are not linked: Green's theorem needs no order.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.density.cell_edges import CellEdges
from robocov.errors import InputError, shown
from robocov.observation.cells import Cells
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.voronoi.arcs import chords, moments, rings
from robocov.voronoi.bisectors import borders
from robocov.voronoi.bounded_cells import VoronoiPartition, partition
from robocov.voronoi.delaunay import Mesh

if TYPE_CHECKING:
    from robocov.density import Density

_SAGITTA = 2e-4
"""How far the outlines of cells may leave their arcs, relative to the region's diameter."""

_FINE = 2e-5
"""The same where polygons stand for cells in integrals."""

_NOTHING = 1e-14
"""Area of a cell, relative to the region's, that is rounding."""


@dataclass(eq=False)
class WeightedCells(Cells):
    """The cells of robots of different speeds within a convex region.

    Where a cell is not convex, its centroid may lie outside of it.

    Attributes
    ----------
    speeds : (n,) m/s
    pieces : (p, 7)
        The boundaries, relative to the generators: five numbers as in `robocov.voronoi.arcs`, whose each
        is (ascending), and what is beyond.
    region : Region
    triangulation : None
        `VoronoiPartition` may have one.
    density : Density or None
    """

    speeds: Array
    pieces: Array
    region: Region
    triangulation: Mesh | None = None
    density: Density | None = None

    @cached_property
    def edges(self) -> CellEdges:
        """The boundaries as polygons that leave the arcs by at most 2e-5 of the region's diameter.

        The edges of a cell are not in order: holes are among them, clockwise.
        """
        lines = chords(self.pieces, _FINE * self.region.diameter)
        count = [len(line) - 1 for line in lines]
        start = np.concatenate([np.empty((0, 2)), *(line[:-1] for line in lines)])
        end = np.concatenate([np.empty((0, 2)), *(line[1:] for line in lines)])
        return CellEdges(start, end, *(part.repeat(count) for part in self.pieces[:, 5:].T.astype(np.intp)))

    @cached_property
    def outlines(self) -> tuple[list[Array], IntArray]:
        """The outlines of the cells, (k, 2) m each, and whose each is; arcs are cut into chords.

        Counter-clockwise around a part of a cell, clockwise around a hole. The cells of fast robots come
        first: painted one over the other without regard for holes, they show the partition.
        """
        found, owners = [], []
        for i in np.argsort(-self.speeds, kind="stable").tolist():
            for ring in rings(self.pieces[self.pieces[:, 5] == i], _SAGITTA * self.region.diameter):
                found.append(ring + self.generators[i])
                owners.append(i)
        return found, np.array(owners, dtype=np.intp)

    @cached_property
    def adjacency(self) -> IntArray:
        return self.edges.adjacency()

    @cached_property
    def polar_moment(self) -> Array:
        if self.density is not None and not self.density.uniform:
            return self.density.moments(self.edges, self.generators)[:, 3]
        weight = 1.0 if self.density is None else self.density.highest
        polar = moments(self.pieces, len(self.generators))[:, 3]
        return np.where(self.mass > 0.0, weight * polar, 0.0)


def weighted_partition(
    generators: Array,
    speeds: Array,
    region: Region,
    neighbours: Neighbours | None = None,
    warm: Mesh | None = None,
    heard: Array | None = None,
    density: Density | None = None,
) -> VoronoiPartition | WeightedCells:
    """Return the cells of the places that each robot reaches first, going straight.

    Parameters
    ----------
    generators : (n, 2) m
        Those at the very same place do not cut each other when they are equally fast; of others the
        fastest has the cell, and the rest have none.
    speeds : (n,) m/s
        Positive. When all are equal, the cells are those of `partition`, bit for bit.
    region : Region
    neighbours : Neighbours or None
        Who hears whom. Cell i is cut only against the robots that i hears, and depends, to the last bit, on
        their places and speeds and its own. None: everybody hears everybody.
    warm : Mesh or None
        As `partition` takes it.
    heard : (m, 2) m or None
        Where robots know their neighbours to be, in the order of ``neighbours.indices``.
    density : Density or None
        φ, by which mass, centroid and moments are taken, over cells whose arcs are cut into chords that leave
        them by at most 2e-5 of the region's diameter. None: 1 everywhere, without that.

    Raises
    ------
    InputError
        When the generators are not (n, 2) finite numbers, or the speeds not (n,) positive ones.

    Examples
    --------
    A robot of twice the speed leaves a slow one a disc of 2/3 of the distance between them.

    >>> square = Region(np.array([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]))
    >>> cells = weighted_partition(np.array([[0.0, 0.0], [3.0, 0.0]]), np.array([1.0, 2.0]), square)
    >>> bool(abs(cells.mass[0] - np.pi * 2.0**2) < 1e-12), cells.centroid[0].round(12).tolist()
    (True, [-1.0, 0.0])
    """
    points = np.array(generators, dtype=np.float64, order="C")
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError(f"generators: an array of shape {points.shape}, but (n, 2) was wanted")
    speeds = np.array(speeds, dtype=np.float64)
    if speeds.shape != points.shape[:1] or not ((speeds > 0.0) & (speeds < np.inf)).all():
        raise InputError(f"speeds: {shown(speeds.tolist())}, but {len(points)} positive numbers were wanted")
    neighbours = Neighbours(len(points)) if neighbours is None else neighbours
    if (speeds == speeds[:1]).all():
        return partition(points, region, neighbours, warm, heard=heard, density=density)
    cells = _cells(points, speeds, region, neighbours, heard)
    if density is not None:
        mass, centroid = cells.mass * density.highest, cells.centroid
        if not density.uniform:
            mass, centroid = density.mass_and_centroid(cells.edges, points, cells.mass, centroid)
        cells = replace(cells, mass=mass, centroid=centroid, density=density)
    for values in (points, speeds, cells.mass, cells.centroid):
        values.setflags(write=False)
    return cells


def _cells(
    points: Array, speeds: Array, region: Region, neighbours: Neighbours, heard: Array | None
) -> WeightedCells:
    n = len(points)
    one, other = neighbours.pairs()
    equal = speeds[one] == speeds[other]
    places = None if heard is None else heard[equal]
    cells = partition(points, region, Neighbours.of_pairs(n, one[equal], other[equal]), heard=places)
    edges = np.column_stack([cells.edges.start, cells.edges.end, cells.edges.cell, cells.edges.beyond])
    offsets = np.ascontiguousarray((points[other] if heard is None else heard) - points[one])
    first, indptr = (np.searchsorted(owner, np.arange(n + 1)) for owner in (cells.edges.cell, one))
    kind = np.empty(n, dtype=np.intp)
    # only Python without the compiler warns of what is infinite, or nothing
    with np.errstate(all="ignore"):
        pieces = borders(speeds, region.sides, points, indptr, other, offsets, edges, first, kind)
    sums = moments(pieces, n)
    mass = np.where(sums[:, 0] < _NOTHING * region.area, 0.0, sums[:, 0])
    centroid = points + sums[:, 1:3] / np.where(mass > 0.0, mass, np.inf)[:, None]
    mass = np.where(kind == 0, cells.mass, mass)
    centroid = np.where(kind[:, None] == 0, cells.centroid, centroid)
    return WeightedCells(points, mass, centroid, speeds, pieces, region)
