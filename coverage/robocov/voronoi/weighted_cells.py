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
from robocov.density.cell_edges import REGION, CellEdges
from robocov.errors import InputError, shown
from robocov.observation.cells import Cells
from robocov.observation.neighbours import Neighbours
from robocov.observation.region import Region
from robocov.voronoi.arcs import Arcs, rings
from robocov.voronoi.bisectors import Curves, Pieces, boundaries, in_reach
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
    pieces : Pieces
        The boundaries, relative to the generators.
    region : Region
    triangulation : None
        `VoronoiPartition` may have one.
    density : Density or None
    """

    speeds: Array
    pieces: Pieces
    region: Region
    triangulation: Mesh | None = None
    density: Density | None = None

    @cached_property
    def edges(self) -> CellEdges:
        """The boundaries as polygons that leave the arcs by at most 2e-5 of the region's diameter.

        The edges of a cell are not in order: holes are among them, clockwise.
        """
        lines = self.pieces.arcs.points(_FINE * self.region.diameter)
        count = np.array([len(line) - 1 for line in lines], dtype=np.intp)
        start = np.concatenate([np.empty((0, 2)), *(line[:-1] for line in lines)])
        end = np.concatenate([np.empty((0, 2)), *(line[1:] for line in lines)])
        return CellEdges(start, end, self.pieces.cell.repeat(count), self.pieces.beyond.repeat(count))

    @cached_property
    def outlines(self) -> tuple[list[Array], IntArray]:
        """The outlines of the cells, (k, 2) m each, and whose each is; arcs are cut into chords.

        Counter-clockwise around a part of a cell, clockwise around a hole. The cells of fast robots come
        first: painted one over the other without regard for holes, they show the partition.
        """
        first = np.searchsorted(self.pieces.cell, np.arange(len(self.generators) + 1))
        sagitta = _SAGITTA * self.region.diameter
        found, owners = [], []
        for i in np.argsort(-self.speeds, kind="stable").tolist():
            own = self.pieces.take(np.arange(first[i], first[i + 1]))
            for ring in rings(own.arcs, sagitta):
                found.append(ring + self.generators[i])
                owners.append(i)
        return found, np.array(owners, dtype=np.intp)

    @cached_property
    def adjacency(self) -> IntArray:
        """The pairs (i, j), i < j, of cells with a border between them, (m, 2), ascending."""
        between = self.pieces.beyond != REGION
        one, other = self.pieces.cell[between], self.pieces.beyond[between]
        pairs = np.column_stack([np.minimum(one, other), np.maximum(one, other)])
        return np.asarray(np.unique(pairs, axis=0).reshape(-1, 2), dtype=np.intp)

    @cached_property
    def polar_moment(self) -> Array:
        """J_{V,p} of equation (2), (n,) m⁴: the polar moments of the cells about their generators."""
        if self.density is not None and not self.density.uniform:
            return self.density.moments(self.edges, self.generators)[:, 3]
        weight = 1.0 if self.density is None else self.density.highest
        polar = weight * self.pieces.arcs.moments()[2]
        return np.where(self.mass > 0.0, _sums(self.pieces.cell, polar, len(self.generators)), 0.0)


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


def _links(neighbours: Neighbours) -> tuple[IntArray, IntArray]:
    """Return who hears whom, by the hearer."""
    n = neighbours.count
    if neighbours.indptr is None or neighbours.indices is None:
        one, other = np.nonzero(~np.eye(n, dtype=bool))
        return one, other
    return np.arange(n).repeat(np.diff(neighbours.indptr)), neighbours.indices


def _cells(
    points: Array, speeds: Array, region: Region, neighbours: Neighbours, heard: Array | None
) -> WeightedCells:
    n = len(points)
    one, other = _links(neighbours)
    equal = speeds[one] == speeds[other]
    places = None if heard is None else heard[equal]
    cells = partition(points, region, _linked(n, one[equal], other[equal]), heard=places)
    offset = (points[other] if heard is None else heard) - points[one]
    distance = np.sqrt(offset[:, 0] ** 2 + offset[:, 1] ** 2)
    link = np.searchsorted(one * n + other, cells.edges.cell * n + cells.edges.beyond)
    edges = _lines(cells.edges, points, region, offset, link)
    reach = np.zeros(n)
    np.maximum.at(reach, cells.edges.cell, np.hypot(*cells.edges.start.T))
    circles = _circles(one, other, offset, distance, speeds, reach)

    # a robot without a place of its own: a faster one is where it is
    beaten = np.zeros(n, dtype=bool)
    beaten[one[(distance == 0.0) & (speeds[other] > speeds[one])]] = True
    curved = np.zeros(n, dtype=bool)
    curved[circles.cell] = True
    curved &= ~beaten & (np.bincount(edges.cell, minlength=n) > 0)
    straight = _whole(cells.edges, (~curved & ~beaten)[edges.cell].nonzero()[0])
    edges, circles = (each.take(curved[each.cell].nonzero()[0]) for each in (edges, circles))
    bent = boundaries(in_reach(_together(edges, circles)))

    area, first, _ = bent.arcs.moments()
    mass = _sums(bent.cell, area, n)
    mass[mass < _NOTHING * region.area] = 0.0
    shift = np.column_stack([_sums(bent.cell, first[:, k], n) for k in (0, 1)])
    shift /= np.where(mass > 0.0, mass, np.inf)[:, None]
    mass = np.where(beaten, 0.0, np.where(curved, mass, cells.mass))
    centroid = np.where((curved | beaten)[:, None], points + shift, cells.centroid)
    return WeightedCells(points, mass, centroid, speeds, _joined(straight, bent), region)


def _linked(n: int, one: IntArray, other: IntArray) -> Neighbours:
    """Return who hears whom of pairs that are sorted."""
    indptr = np.zeros(n + 1, dtype=np.intp)
    np.cumsum(np.bincount(one, minlength=n), out=indptr[1:])
    return Neighbours(n, None, indptr, other)


def _lines(edges: CellEdges, points: Array, region: Region, offset: Array, link: IntArray) -> Curves:
    """Return the edges of cells as lines between their ends.

    `link` (s,) says which `offset` leads to the robot beyond. The directions are those of the bisectors and
    of the region's sides: an edge may be so short that rounding decides on its own.
    """
    own = edges.beyond == REGION
    middle = 0.5 * (edges.start + edges.end)
    normal, near = np.empty_like(middle), np.empty(len(middle))
    across = offset[link[~own]]
    length = np.hypot(across[:, 0], across[:, 1])
    normal[~own], near[~own] = across / length[:, None], 0.5 * length
    room = region.offsets - points[edges.cell[own]] @ region.normals.T
    side = np.abs(middle[own] @ region.normals.T - room).argmin(axis=1)
    normal[own] = region.normals[side]
    near[own] = (normal[own] * middle[own]).sum(axis=1)
    left = np.column_stack([-normal[:, 1], normal[:, 0]])
    return Curves(
        cell=edges.cell,
        beyond=edges.beyond,
        normal=normal,
        near=near,
        half_curvature=np.zeros(len(near)),
        begin=0.5 * (left[:, 0] * edges.start[:, 0] + left[:, 1] * edges.start[:, 1]),
        end=0.5 * (left[:, 0] * edges.end[:, 0] + left[:, 1] * edges.end[:, 1]),
    )


def _whole(edges: CellEdges, some: IntArray) -> Pieces:
    """Return edges as pieces, to the last bit."""
    arcs = Arcs(edges.start[some], edges.end[some], np.zeros(len(some)))
    return Pieces(edges.cell[some], edges.beyond[some], arcs)


def _circles(
    one: IntArray, other: IntArray, offset: Array, distance: Array, speeds: Array, reach: Array
) -> Curves:
    """Return the circles of Apollonius that may bound cells that end within `reach` (n,) m."""
    apart = ((speeds[one] != speeds[other]) & (distance > 0.0)).nonzero()[0]
    one, other, offset, distance = one[apart], other[apart], offset[apart], distance[apart]
    own, more = speeds[one], speeds[other] - speeds[one]
    # the farthest place of a circle around the cell is behind the robot, seen from the faster one
    around = (more > 0.0).nonzero()[0]
    reach = reach.copy()
    np.minimum.at(reach, one[around], distance[around] * own[around] / more[around])
    near = distance * (own / (own + speeds[other]))
    some = (near < reach[one]).nonzero()[0]
    one, other, distance = one[some], other[some], distance[some]
    relative = more[some] * (own[some] + speeds[other]) / (own[some] * speeds[other])
    return Curves(
        cell=one,
        beyond=other,
        normal=offset[some] / distance[:, None],
        near=near[some],
        half_curvature=0.5 * relative / distance,
        begin=np.full(len(some), -np.inf),
        end=np.full(len(some), np.inf),
    )


def _together(edges: Curves, circles: Curves) -> Curves:
    """Return all curves by their cells."""
    order = np.argsort(np.concatenate([edges.cell, circles.cell]), kind="stable")
    return Curves._make(np.concatenate(both)[order] for both in zip(edges, circles, strict=True))


def _joined(one: Pieces, other: Pieces) -> Pieces:
    """Return all pieces by their cells."""
    cell = np.concatenate([one.cell, other.cell])
    order = np.argsort(cell, kind="stable")
    arcs = [np.concatenate(both)[order] for both in zip(one.arcs, other.arcs, strict=True)]
    return Pieces(cell[order], np.concatenate([one.beyond, other.beyond])[order], Arcs(*arcs))


def _sums(cell: IntArray, values: Array, n: int) -> Array:
    # without any values, whole numbers are what numpy counts
    return np.bincount(cell, values, n).astype(np.float64, copy=False)
