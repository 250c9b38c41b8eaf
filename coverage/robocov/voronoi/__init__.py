"""The bounded Voronoi partition of all robots at once: equation (1) and what equation (2) needs of it.

A cell is the region, clipped by the bisectors to those who may bound it: whom the robot hears, or, where
everybody hears everybody, its neighbours in a Delaunay triangulation. A cell clipped by too few robots is too
large: when all masses add up to the region's area, no robot is missing. Where they do not, as when robots
coincide, each is clipped by all others.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TypeVar

import numpy as np

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel
from robocov.density.base import REGION, CellEdges, Density
from robocov.errors import InputError, quote
from robocov.observation import Cells
from robocov.observation.neighbours import NO_INDICES, Neighbours
from robocov.observation.region import Region
from robocov.voronoi.delaunay import Mesh, before, following, triangulated

_TRIANGULATE_FROM = 16
"""Size of team from which a triangulation is quicker than clipping by everybody."""

_NEAREST = 6
"""Robots by which a cell is cut in order of their distance; then it is so small that few others count."""

_TOLERANCE = 1e-12
"""Tolerance of the sum of masses, relative to the region's area."""

_CHORDS = 64
"""For one arc of a disc, which is less than half a turn."""

_NOT_HEARD = np.empty((0, 2))
_NO_EDGES = np.empty((0, 6))

_AnyCells = TypeVar("_AnyCells", bound=Cells)


@dataclass(eq=False, kw_only=True)
class VoronoiPartition(Cells):
    """The cells V_i of equation (1) within a convex region."""

    _find_edges: Callable[[], CellEdges]

    @cached_property
    def edges(self) -> CellEdges:
        return self._find_edges()

    @cached_property
    def polygons(self) -> list[Array]:
        """The cells, (k, 2) m each, counter-clockwise; (0, 2) where a cell is empty."""
        return self.edges.build_polygons(self.generators)

    @property
    def outlines(self) -> tuple[list[Array], IntArray]:
        return self.polygons, np.arange(len(self.generators))


def partition(
    generators: Array,
    region: Region,
    neighbours: Neighbours | None = None,
    warm: Mesh | None = None,
    heard: Array | None = None,
    density: Density | None = None,
) -> VoronoiPartition:
    """Return the Voronoi cells of `generators` within `region`; obstacles play no part.

    Raises InputError when the generators are not (n, 2) finite numbers.

    Parameters
    ----------
    generators : (n, 2) m
        They may lie on the region's boundary or outside. Those at the very same place do not cut
        each other: they get the same cell.
    neighbours : Neighbours or None
        Who hears whom. Cell i is cut only by the bisectors to the robots that i hears, and depends,
        to the last bit, on nothing else. None: everybody hears everybody.
    warm : Mesh or None
        The triangulation of the partition before. When the generators have moved little since, this one
        takes a fraction of the time; its cells are the same, to the last bit where no four generators
        lie on a circle up to rounding.
    heard : (m, 2) m or None
        Where robots know those that they hear to be, in the order of ``neighbours.indices``. The cells of
        two robots may then overlap or leave a gap: each is what its own robot takes for it. None: where
        they are.
    density : Density or None
        φ of mass, centroid and moments; the cells are the same. None: 1 everywhere.

    >>> square = Region(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))
    >>> halves = partition(np.array([[0.5, 1.0], [1.5, 1.0]]), square)
    >>> halves.mass, halves.adjacency
    (array([2., 2.]), array([[0, 1]]))
    """
    points = generators_of(generators)
    n = len(points)
    mesh = np.empty((2, 0), dtype=np.int32)
    if neighbours is None or neighbours.indptr is None or neighbours.indices is None:
        if heard is not None:
            raise InputError("heard: given without the neighbours that they are of")
        indptr = indices = NO_INDICES
        if n >= _TRIANGULATE_FROM:
            size = 8 * n + 4
            mesh = np.full((2, size), -1, np.int32) if warm is None or warm.shape[1] != size else warm.copy()
    else:
        indptr, indices = neighbours.indptr, neighbours.indices
    known = _NOT_HEARD if heard is None else np.ascontiguousarray(heard)
    mass, centroid = np.empty(n), np.empty((n, 2))
    count = cells_of(points, region.sides, known, indptr, indices, n, mesh, mass, centroid, _NO_EDGES)
    if count < 0:
        bad = -1 - count
        raise InputError(f"generators[{bad}]: {quote(points[bad].tolist())}, but finite numbers were wanted")
    if mesh.shape[1] > 0 and mesh[0, 0] < 0:
        mesh = np.empty((2, 0), dtype=np.int32)  # the triangulation failed
    mesh.setflags(write=False)
    edges = partial(_edges, points, region.sides, known, indptr, indices, mesh, count)
    triangulation = mesh if mesh.shape[1] else None
    cells = VoronoiPartition(points, mass, centroid, triangulation=triangulation, _find_edges=edges)
    return weighted(cells, density)


def _edges(
    points: Array, sides: Array, known: Array, indptr: IntArray, indices: IntArray, mesh: Mesh, count: int
) -> CellEdges:
    n, edges = len(points), np.empty((count, 6))
    work = points.copy(), sides, known, indptr, indices, n, mesh.copy(), np.empty(n), np.empty((n, 2))
    cells_of(*work, edges)
    return CellEdges(edges[:, :2].copy(), edges[:, 2:4].copy(), *edges[:, 4:].T.astype(np.intp))


def generators_of(values: object) -> Array:
    """Return a copy of what is to be (n, 2) generators; an InputError where it is not."""
    points = np.array(values, dtype=np.float64, order="C")
    if points.ndim != 2 or points.shape[1] != 2:
        raise InputError(f"generators: an array of shape {points.shape}, but (n, 2) was wanted")
    return points


def weighted(cells: _AnyCells, density: Density | None) -> _AnyCells:
    """Give cells that are being made mass and centroid by a density; return them, now read-only."""
    cells.density = density
    if density is not None and density.is_uniform:
        cells.mass = cells.mass * density.max_value
    elif density is not None:
        places = cells.generators
        cells.mass, cells.centroid = density.compute_mass_and_centroid(
            cells.edges, places, cells.mass, cells.centroid
        )
    for values in (cells.generators, cells.mass, cells.centroid):
        values.setflags(write=False)
    return cells


@kernel
def cells_of(
    points: Array, region: Array, heard: Array, indptr: IntArray, indices: IntArray, team: int, mesh: Mesh,
    mass: Array, centroid: Array, edges: Array,
) -> int:  # fmt: skip
    """Compute mass and centroid of all cells; return how many edges they have, or -1 - i for a bad point i.

    The region is `Region.sides`. Rows `indptr` and `indices` say who hears whom, and `heard`, (m, 2) m, where
    they know the others to be; arrays of no length stand for everybody of the same team of so many rows, and
    for where they are. The mesh is as `triangulated` takes it, of no length for none, and is changed. Written
    are mass, (n,) m², centroid, (n, 2) m, and as many edges, (e, 6), as there is room for: x, y, u, v of the
    ends relative to the generator (m), whose it is, and what is beyond.
    """
    n = len(points)
    for i in range(n):
        if not (abs(points[i, 0]) < np.inf and abs(points[i, 1]) < np.inf):
            return -1 - i
    ring = np.empty((2, len(region) + max(team, n) + 2, 4))
    near = np.empty((max(team, n), 4))
    total = 0
    if mesh.shape[1]:
        places, cotangent = np.empty((n + 3, 2)), np.empty(mesh.shape[1])
        begins, left = np.empty(mesh.shape[1], np.intp), 0.0
        area = _triangulated_within(points, region, mesh, places, cotangent, begins)
        for i in range(n if area > 0.0 else 0):
            count, side, start = _enclosed(ring, near, points, region, mesh, cotangent, begins[i], i)
            total = _finished(ring, side, count, start, points, i, mass, centroid, edges, total)
            left += mass[i]
        if area > 0.0 and abs(left - area) <= _TOLERANCE * area:
            return total
        mesh[0, 0], total = -1, 0
    for i in range(n):
        found, first = 0, i - i % team
        for k in range(indptr[i] if len(indptr) else first, indptr[i + 1] if len(indptr) else first + team):
            j = indices[k] if len(indptr) else k
            if len(heard):
                found = _noted(near, found, heard[k, 0] - points[i, 0], heard[k, 1] - points[i, 1], j)
            else:
                found = _noted(near, found, points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], j)
        count, side = _clipped(ring, near, found, points, region, i)
        total = _finished(ring, side, count, 0, points, i, mass, centroid, edges, total)
    return total


@kernel
def _noted(near: Array, found: int, dx: float, dy: float, j: int) -> int:
    """Note a robot by which a cell may be cut; those at the very same place do not cut each other."""
    near[found, 0], near[found, 1], near[found, 2], near[found, 3] = dx, dy, dx * dx + dy * dy, j
    return found + 1 if near[found, 2] > 0.0 else found


@kernel
def _triangulated_within(
    points: Array, region: Array, mesh: Mesh, places: Array, cotangent: Array, begins: IntArray
) -> float:
    """Triangulate, write a half-edge that begins at each point, return the region's area, -1 on failure."""
    n, sides = len(points), len(region)
    left = right = region[0, 0]
    low = high = region[0, 1]
    for k in range(1, sides):
        left, right = min(left, region[k, 0]), max(right, region[k, 0])
        low, high = min(low, region[k, 1]), max(high, region[k, 1])
    x, y, size = 0.5 * (left + right), 0.5 * (low + high), right - left + high - low
    for i in range(n):
        places[i, 0], places[i, 1] = points[i, 0], points[i, 1]
        # no sentinel then cuts a cell within the region, and all robots lie within their triangle
        if max(abs(points[i, 0] - x), abs(points[i, 1] - y)) > 2.0 * size:
            return -1.0
    places[n, 0], places[n, 1] = x - 8.0 * size, y - 5.0 * size
    places[n + 1, 0], places[n + 1, 1] = x + 8.0 * size, y - 5.0 * size
    places[n + 2, 0], places[n + 2, 1] = x, y + 9.0 * size
    if not triangulated(mesh, places, cotangent, begins):
        return -1.0
    for h in range(mesh.shape[1]):
        if h & 3 < 3:
            begins[mesh[0, h]] = h
    area = 0.0
    for k in range(sides):
        after = k + 1 if k + 1 < sides else 0
        area += 0.5 * (
            (region[k, 0] - x) * (region[after, 1] - y) - (region[after, 0] - x) * (region[k, 1] - y)
        )
    return area


@kernel
def _enclosed(
    ring: Array, near: Array, points: Array, region: Array, mesh: Mesh, cotangent: Array, begin: int, i: int
) -> tuple[int, int, int]:
    """Return number of vertices, side of `ring`, and the first vertex of the cell by the triangles around it.

    These are asked for the Voronoi vertices where they all lie within the region, and for neighbours else.
    """
    px, py = points[i, 0], points[i, 1]
    found, first, start, far = _around(ring, near, points, mesh, cotangent, begin, i)
    room = np.inf
    for k in range(len(region)):
        room = min(room, region[k, 4] - (region[k, 2] * px + region[k, 3] * py))
    if room > 0.0 and far < room * room:
        return found, 0, start
    found, _, _, _ = _around(ring, near, points, mesh, cotangent, first, i)
    count, side = _clipped(ring, near, found, points, region, i)
    return count, side, 0


@kernel
def _around(
    ring: Array, near: Array, points: Array, mesh: Mesh, cotangent: Array, begin: int, i: int
) -> tuple[int, int, int, float]:
    """Find neighbours and Voronoi vertices of a robot, counter-clockwise.

    Returns how many; the half-edge to the neighbour with the lowest number, from which on what is computed
    does not depend on the order of the triangles; its place among them; and the farthest vertex's squared
    distance.
    """
    n, px, py = len(points), points[i, 0], points[i, 1]
    h, found, far, lowest, first, start = begin, 0, 0.0, n, begin, 0
    while True:
        back = before(h)
        j = mesh[0, following(h)]
        if j < n:
            if j < lowest:
                lowest, first, start = j, h, found
            dx, dy = points[j, 0] - px, points[j, 1] - py
            # on the bisector, half the distance times the cotangent to the left
            x, y = 0.5 * (dx - cotangent[h] * dy), 0.5 * (dy + cotangent[h] * dx)
            far = max(far, x * x + y * y)
            near[found, 0], near[found, 1], near[found, 2], near[found, 3] = dx, dy, dx * dx + dy * dy, j
            ring[0, found, 0], ring[0, found, 1], ring[0, found, 2] = x, y, mesh[0, back]
            found += 1
        else:
            far = np.inf
        h = mesh[1, back]
        if h == begin:
            return found, first, start, far


@kernel
def _clipped(ring: Array, near: Array, found: int, points: Array, region: Array, i: int) -> tuple[int, int]:
    """Return number of vertices, and side of `ring`, of the region cut by the bisectors to `near`."""
    count, side, security = len(region), 0, 0.0
    for k in range(count):
        x, y = region[k, 0] - points[i, 0], region[k, 1] - points[i, 1]
        ring[0, k, 0], ring[0, k, 1], ring[0, k, 2] = x, y, REGION
        security = max(security, 4.0 * (x * x + y * y))
    for turn in range(found):
        if turn < _NEAREST:
            best = turn
            for k in range(turn + 1, found):
                if near[k, 2] < near[best, 2]:
                    best = k
            for k in range(4):
                near[turn, k], near[best, k] = near[best, k], near[turn, k]
        # a bisector lies half way to the other generator
        if near[turn, 2] <= security:
            size = _cut(ring, side, count, near[turn, 0], near[turn, 1], 0.5 * near[turn, 2], near[turn, 3])
            if size >= 0:
                count, side, security = size, 1 - side, 0.0
                for k in range(count):
                    security = max(security, 4.0 * (ring[side, k, 0] ** 2 + ring[side, k, 1] ** 2))
        elif turn < _NEAREST:
            break
    return count, side


@kernel
def _cut(ring: Array, old: int, count: int, dx: float, dy: float, level: float, other: float) -> int:
    """Put what has x dx + y dy <= level of ring[old] into ring[1 - old]; return its size, -1 for all of it.

    A vertex is x and y relative to the generator, what is beyond the edge that begins there, and how far it
    is beyond the line.
    """
    new, worst, excess = 1 - old, -1, 0.0
    for k in range(count):
        beyond = ring[old, k, 0] * dx + ring[old, k, 1] * dy - level
        ring[old, k, 3] = beyond
        if beyond > excess:
            worst, excess = k, beyond
    if worst < 0:
        return -1
    # the vertices beyond the line follow each other but for rounding; the polygon is convex
    first = last = worst
    for _ in range(count):
        after = last + 1 if last + 1 < count else 0
        if ring[old, after, 3] <= 0.0:
            break
        last = after
    else:
        return 0
    while ring[old, first - 1 if first else count - 1, 3] > 0.0:
        first = first - 1 if first else count - 1
    k, kept, size = after, after, 0
    while k != first:
        for c in range(3):
            ring[new, size, c] = ring[old, k, c]
        kept, size = k, size + 1
        k = k + 1 if k + 1 < count else 0
    if ring[old, kept, 3] == 0.0:
        ring[new, size - 1, 2] = other
    else:
        _meet(ring, new, size, old, kept, k, other)
        size += 1
    if ring[old, after, 3] < 0.0:
        _meet(ring, new, size, old, after, last, ring[old, last, 2])
        size += 1
    return size


@kernel
def _meet(ring: Array, new: int, size: int, old: int, inner: int, outer: int, beyond: float) -> None:
    """Put the place where an edge meets the line into ring[new, size]."""
    part = ring[old, inner, 3] / (ring[old, inner, 3] - ring[old, outer, 3])
    for c in range(2):
        ring[new, size, c] = ring[old, inner, c] + part * (ring[old, outer, c] - ring[old, inner, c])
    ring[new, size, 2] = beyond


@kernel
def _finished(
    ring: Array, side: int, count: int, start: int, points: Array, i: int, mass: Array, centroid: Array,
    edges: Array, total: int,
) -> int:  # fmt: skip
    """Write what is known of one cell; return how many edges there are with its own."""
    area = first_x = first_y = 0.0
    k = start
    for edge in range(total, total + count):
        after = k + 1 if k + 1 < count else 0
        x, y, u, v = ring[side, k, 0], ring[side, k, 1], ring[side, after, 0], ring[side, after, 1]
        cross = x * v - u * y
        area += cross
        first_x += cross * (x + u)
        first_y += cross * (y + v)
        if edge < len(edges):
            edges[edge, 0], edges[edge, 1], edges[edge, 2], edges[edge, 3] = x, y, u, v
            edges[edge, 4], edges[edge, 5] = i, ring[side, k, 2]
        k = after
    over = 1.0 / (3.0 * area) if area > 0.0 else 0.0
    mass[i] = max(0.5 * area, 0.0)
    centroid[i, 0], centroid[i, 1] = points[i, 0] + first_x * over, points[i, 1] + first_y * over
    return total + count


def disc_limited(edges: CellEdges, radius: Array) -> tuple[Array, Array]:
    """Return area (n,) m² and centroid (n, 2) m of the part of each cell within a distance of its generator.

    The centroid is **relative to the generator**; zero where nothing of the cell is that near. By the
    divergence theorem every edge adds, signed, the part of the triangle that it spans with the generator that
    lies in the disc: a smaller triangle where the edge is inside the disc, sectors where it is outside.
    Radii, (n,) m, are above 0; infinite for no limit.
    """
    count = len(radius)
    # a disc that holds the whole cell cuts nothing
    size = np.zeros(count)
    np.maximum.at(size, edges.cell, np.hypot(edges.start[:, 0], edges.start[:, 1]))
    rho = np.minimum(radius, 2.0 * size + 1.0)[edges.cell]
    first, last, arcs = _cut_by_discs(edges, rho)
    cross = first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]
    doubled = cross.copy()
    moment = cross[:, None] * (first + last) / 3.0
    for angle, turn in arcs:
        doubled += rho * rho * turn
        third = 2.0 / 3.0 * rho**3
        moment[:, 0] += third * (np.sin(angle + turn) - np.sin(angle))
        moment[:, 1] += third * (np.cos(angle) - np.cos(angle + turn))
    area = 0.5 * np.bincount(edges.cell, doubled, minlength=count)
    first_moment = np.column_stack([np.bincount(edges.cell, part, minlength=count) for part in moment.T])
    # less than rounding makes of nothing is nothing
    some = area > 1e-14 * np.minimum(radius, size) ** 2
    centroid = 0.5 * first_moment / np.where(some, area, 1.0)[:, None]
    return np.where(some, area, 0.0), np.where(some[:, None], centroid, 0.0)


def disc_polygons(edges: CellEdges, radius: Array) -> CellEdges:
    """Return the same parts of the cells as polygons, whose chords stand for the arcs of the discs.

    A chord is at most a 128th of a turn: of a whole disc 0.04 % of the area are missing. Pieces of no length
    are among them.
    """
    rho = np.minimum(radius[edges.cell], 4.0 * float(np.abs(edges.start).max(initial=0.0)) + 1.0)
    first, last, arcs = _cut_by_discs(edges, rho)
    pieces = [(first, last, edges.cell)]
    part = np.linspace(0.0, 1.0, _CHORDS + 1)
    for begin, turn in arcs:
        angle = begin[:, None] + turn[:, None] * part
        places = rho[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        some = (turn != 0.0).nonzero()[0]
        cell = np.repeat(edges.cell[some], _CHORDS)
        pieces.append((places[some, :-1].reshape(-1, 2), places[some, 1:].reshape(-1, 2), cell))
    start, end, cell = (np.concatenate([piece[k] for piece in pieces]) for k in (0, 1, 2))
    order = np.argsort(cell, kind="stable")
    return CellEdges(start[order], end[order], cell[order], np.full(len(cell), REGION))


def _cut_by_discs(edges: CellEdges, rho: Array) -> tuple[Array, Array, list[tuple[Array, Array]]]:
    """Return the ends of each edge's part in the disc round the generator, and the arcs before and behind it.

    An arc is the angle where it begins, and how far it turns. Out of the disc, an edge's part has no length.
    """
    step = edges.end - edges.start
    square = np.maximum((step * step).sum(axis=1), 1e-300)
    middle = -(edges.start * step).sum(axis=1) / square
    nearest = edges.start + middle[:, None] * step
    half2 = (rho * rho - (nearest * nearest).sum(axis=1)) / square
    half = np.sqrt(np.maximum(half2, 0.0))
    first, last = (edges.start + np.clip(middle + side, 0.0, 1.0)[:, None] * step for side in (-half, half))
    arcs = []
    for (x, y), (u, v) in ((edges.start.T, first.T), (last.T, edges.end.T)):
        arcs.append((np.arctan2(y, x), np.arctan2(x * v - y * u, x * u + y * v)))
    return first, last, arcs
