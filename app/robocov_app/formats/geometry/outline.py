"""The rings of polygons as flat arrays, and drawn again with fewer vertices.

Along a wall at an angle the outline of cells is a flight of stairs: every short side between two
opposite turns becomes its middle, and these lie along the wall to within a third of a cell. Then the
algorithm of Douglas and Peucker leaves out what is within the tolerance, from one vertex that must
stay to the next.

D. H. Douglas, T. K. Peucker, Algorithms for the reduction of the number of points required to represent
a digitized line or its caricature, Cartographica 10 (1973), 112-122.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from robocov.arrays import Array, BoolArray, IntArray, beginnings, ranges
from robocov_app.formats.geometry.tracing import NECK

MIDDLES = 0.75
"""From this tolerance on, in cells, stairs are drawn as lines."""

_FEW = 3
"""A line through fewer middles of stairs says little."""

_UNBALANCED = 0.02
"""From this part of it on, the area that a ring lost is given back to it."""

_SIZES = 16
"""Of a thing with the area of a square of so many tolerances and more, all of the tolerance is left out."""

_FINEST = 0.4
"""Of smaller ones less is, but always so much, in cells."""

_RIGHT = 1e-5
"""Lines whose cosine of the angle between them is smaller are at right angles."""

_SQUARE = 0.2
"""Lines whose sine of the angle between them is smaller meet nowhere in particular."""

_LONGEST = 1024
"""Most vertices between two that must stay: the algorithm's depth may grow with their number."""


@dataclass(frozen=True, eq=False)
class Outline:
    """The k vertices of the rings of polygons, ring after ring, no first one repeated.

    `points`: (k, 2) m. `begin`, (r,): where each ring begins. `owner`, (r,): the polygon that each ring
    belongs to; its outer ring comes first. `neck`, (k,): whether two obstacles touch there: the vertex stands
    for a neck as `tracing` makes them. `cell`, m: side of the cells that it is the outline of, the longer
    one.
    """

    points: Array
    begin: IntArray
    owner: IntArray
    neck: BoolArray
    cell: float | None

    @property
    def size(self) -> IntArray:
        """Vertices of each ring, (r,)."""
        return np.diff(self.begin, append=len(self.points))

    @property
    def ring(self) -> IntArray:
        """The ring of each vertex, (k,)."""
        return np.arange(len(self.begin)).repeat(self.size)


@dataclass(frozen=True, eq=False)
class Drawing:
    """An outline with fewer vertices: its own, and middles of its sides.

    `points`: (m, 2) m. `begin`, (r,): where each ring begins; rings may have fewer than three vertices.
    `source`, (m,): the vertex of the outline that each one is; with a half added, the middle of the side
    after it. Along a ring they grow, but for one step back to the ring's lowest.
    """

    points: Array
    begin: IntArray
    source: Array


@dataclass(frozen=True, eq=False)
class _Path:
    """An outline on its way to a drawing: p vertices.

    `points`: (p, 2) m. `begin`: (r,). `source`, (p,): as of a `Drawing`. `allowed`, (p,) m: the tolerance at
    each. `fixed`, (p,): which of them stay in any case.
    """

    points: Array
    begin: IntArray
    source: Array
    allowed: Array
    fixed: BoolArray


def outline_of(parts: MultiPolygon | list[Polygon], cell: float | None) -> Outline:
    """Return the rings of `parts`; if they are the outline of cells, without its necks."""
    polygons = list(parts.geoms) if not isinstance(parts, list) else parts
    rings, owner = shapely.get_rings(polygons, return_index=True)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    closing = np.append(ring[1:] != ring[:-1], True)
    points, ring = points[~closing], ring[~closing]
    begin = np.searchsorted(ring, np.arange(len(rings)))
    neck = np.zeros(len(points), dtype=bool)
    if cell is not None:
        # the two ends of a neck, a short side between two at right angles, become the corner between them
        after, before = neighbours(begin, len(points))
        side = points[after] - points
        length = np.hypot(*side.T)
        along = side[before] / np.maximum(length[before], 1e-300)[:, None]
        square = np.abs(np.einsum("kd,kd->k", along, along[after[after]])) < _RIGHT
        neck = square & (length < np.minimum(length[before], length[after]))
        neck &= length < 1.001 * np.sqrt(2) * NECK * cell
        to_corner = np.einsum("kd,kd->k", side, along)[:, None] * along
        points = np.where(neck[:, None], points + to_corner, points)
        keep = ~neck[before]
        points, neck, ring = points[keep], neck[keep], ring[keep]
        begin = np.searchsorted(ring, np.arange(len(rings)))
    return Outline(points, begin, np.asarray(owner), neck, cell)


def drawn(outline: Outline, tolerance: Array, fixed: BoolArray) -> Drawing:
    """Return `outline` with what is within the tolerance left out.

    `tolerance`, (k,) m: of each of its vertices; where it is 0 they all stay. `fixed`, (k,): which of them
    stay besides, or the middles that stand for them.
    """
    path = _without_stairs(outline, tolerance, fixed)
    if not len(path.points):
        return Drawing(path.points, path.begin, path.source)
    # small things have few corners to lose
    size = np.sqrt(np.abs(ring_areas(outline.points, outline.begin)))
    finest = 0.0 if outline.cell is None else _FINEST * outline.cell
    kept, begin = _kept(path, np.maximum(size / _SIZES, finest))
    drawing = Drawing(path.points[kept], begin, path.source[kept])
    return drawing if outline.cell is None else _fitted(path, kept, drawing)


def _kept(path: _Path, most: Array) -> tuple[IntArray, IntArray]:
    """Return the vertices of `path` that stay, ring after ring, and where each ring begins among them.

    In each ring no more than `most` (r,) m is left out.
    """
    begin, allowed = path.begin, path.allowed
    index = np.arange(len(allowed))
    after, _ = neighbours(begin, len(allowed))
    stays = _extremes(path.points, begin) | path.fixed | (allowed == 0.0) | (index % _LONGEST == 0)
    changes = allowed != allowed[after]
    stays |= changes
    stays[after[changes]] = True
    # each ring from its first vertex that stays, round to that one again
    count = np.diff(begin, append=len(allowed))
    first = np.minimum.reduceat(np.where(stays, index, len(index)), begin)
    ring = np.arange(len(begin)).repeat(count + 1)
    step = ranges(np.zeros_like(count), count + 1)
    vertex = begin[ring] + (first[ring] - begin[ring] + step) % count[ring]
    inner = stays[vertex] & (step > 0) & (step < count[ring])
    # a vertex that stays ends one line and begins the next
    twice = np.arange(len(vertex)).repeat(1 + inner)
    line = (np.cumsum(inner | (step == 0)) - 1)[twice]
    line[:-1] -= twice[:-1] == twice[1:]
    vertex = vertex[twice]
    # all of a line between its ends has one tolerance
    second = vertex[beginnings(line) + 1]
    within = np.minimum(allowed[second], most[np.searchsorted(begin, second, side="right") - 1])
    lines = shapely.linestrings(np.column_stack([path.points[vertex], vertex]), indices=line)
    simple = shapely.simplify(lines, within, preserve_topology=False)
    kept, line = shapely.get_coordinates(simple, include_z=True, return_index=True)
    kept = kept[np.append(line[1:] == line[:-1], False), 2].astype(np.intp)
    ring = np.searchsorted(begin, kept, side="right") - 1
    return kept, np.searchsorted(ring, np.arange(len(begin)))


def _fitted(path: _Path, kept: IntArray, drawing: Drawing) -> Drawing:
    """Return `drawing` with the sides that stand for stairs in the middle of these, and corners whole.

    Such a side becomes the line of least squares of the middles that it stands for, and its ends go
    where it meets its neighbours. A short side between two long ones that meet nearby is a corner.
    """
    points, begin, allowed = drawing.points, drawing.begin, path.allowed[kept]
    after, before = neighbours(begin, len(kept))
    chord = points[after] - points
    length = np.hypot(*chord.T)
    chord /= np.maximum(length, 1e-300)[:, None]
    stairs, foot, along = _stairs(path, kept, drawing)
    # a line for each side: a point of it, and its direction
    foot = np.where(stairs[:, None], foot, points)
    along = np.where(stairs[:, None], along, chord)

    meeting, square = _meeting(foot[before], along[before], foot, along)
    # lines that hardly turn have no good meeting: half-way between them
    flat = (_foot(points, foot[before], along[before]) + _foot(points, foot, along)) / 2
    move = np.where(square[:, None], meeting, flat) - points
    move[~(stairs | stairs[before])] = 0.0
    move[np.hypot(*move.T) > 2 * allowed] = 0.0

    # neither end of the side may be one that stays
    both = np.minimum(allowed, allowed[after])
    long = length > 4 * both
    corner, square = _meeting(foot[before], along[before], foot[after], along[after])
    cut = square & ~stairs & (both > 0.0) & (length <= 2 * both) & long[before] & long[after]
    for end in (points, points[after]):
        cut &= np.hypot(*(corner - end).T) <= 2 * both
    move[cut] = corner[cut] - points[cut]
    stays = ~cut[before]
    ring = np.searchsorted(begin, np.arange(len(kept)), side="right")[stays]
    begin = np.searchsorted(ring, np.arange(1, len(begin) + 1))
    return Drawing((points + move)[stays], begin, drawing.source[stays])


def _stairs(path: _Path, kept: IntArray, drawing: Drawing) -> tuple[BoolArray, Array, Array]:
    """Return which sides stand for stairs, and the lines of these: a point and a direction, (m, 2) each."""
    count = np.diff(path.begin, append=len(path.points))
    ring = np.searchsorted(drawing.begin, np.arange(len(kept)), side="right") - 1
    # what lies between each vertex that stays and the next one, round the ring
    length = (kept[neighbours(drawing.begin, len(kept))[0]] - kept) % count[ring] - 1
    length = np.maximum(length, 0)
    side = np.arange(len(kept)).repeat(length)
    first = path.begin[ring][side]
    inside = first + (ranges(kept + 1, length) - first) % count[ring][side]
    middle = path.source[inside] % 1.0 != 0.0
    side, inside = side[middle], inside[middle]
    number = np.bincount(side, minlength=len(kept))

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(side, values, len(kept)) / np.maximum(number, 1))

    # from the side's first vertex: squares of large coordinates would cancel
    x, y = (path.points[inside] - drawing.points[side]).T
    centre = np.column_stack([mean(x), mean(y)])
    x, y = x - centre[side, 0], y - centre[side, 1]
    angle = np.arctan2(2 * mean(x * y), mean(x * x) - mean(y * y)) / 2
    along = np.column_stack([np.cos(angle), np.sin(angle)])
    return (number >= _FEW) & (2 * number >= length), drawing.points + centre, along


def _meeting(a: Array, u: Array, b: Array, v: Array) -> tuple[Array, BoolArray]:
    """Return where the lines through a along u and through b along v meet, and whether they clearly do."""
    cross = _cross(u, v)
    square = np.abs(cross) > _SQUARE
    part = _cross(b - a, v) / np.where(square, cross, 1.0)
    return a + part[:, None] * u, square


def _foot(p: Array, a: Array, u: Array) -> Array:
    """Return the points nearest to p on the lines through a along u."""
    return np.asarray(a + np.einsum("kd,kd->k", p - a, u)[:, None] * u)


def with_necks(outline: Outline, drawing: Drawing) -> tuple[Array, IntArray, IntArray]:
    """Return `drawing` with the outline's necks again.

    Returns: `points`, (n, 2) m. `begin`, (r,): where each ring begins. `vertex`, (n,): the vertex of the
    drawing that each point stands for.
    """
    points, begin, source = drawing.points, drawing.begin, drawing.source
    whole = source.astype(np.intp)
    neck = outline.neck[whole] & (source == whole)
    if outline.cell is None or not neck.any():
        return points, begin, np.arange(len(points))
    after, before = neighbours(begin, len(points))
    twice = np.arange(len(points)).repeat(1 + neck)
    second = np.append(False, twice[1:] == twice[:-1])
    towards = np.where(second, after[twice], before[twice])
    way = points[towards] - points[twice]
    length = np.maximum(np.hypot(*way.T), 1e-300)
    part = np.where(neck[twice], np.minimum(NECK * outline.cell / length, 0.4), 0.0)
    return points[twice] + part[:, None] * way, np.searchsorted(twice, begin), twice


def balanced(outline: Outline, drawing: Drawing, tolerance: Array) -> Drawing:
    """Return `drawing` with rings of the area that they had, where they lost or won much of it.

    All sides of such a ring move by the same distance, of at most half the `tolerance` (k,) at its
    vertices. Small round things need it: with few corners, each on their rim, they get smaller.
    """
    points, begin = drawing.points, drawing.begin
    was, now = ring_areas(outline.points, outline.begin), ring_areas(points, begin)
    some = (np.abs(now - was) > _UNBALANCED * np.abs(was)) & (2 * now * np.sign(was) > np.abs(was))
    if not some.any():
        return drawing
    after, before = neighbours(begin, len(points))
    side = points[after] - points
    length = np.hypot(*side.T)
    # to the right of a side is the outside of a ring that runs counter-clockwise
    normal = np.column_stack([side[:, 1], -side[:, 0]]) / np.maximum(length, 1e-300)[:, None]
    distance = np.where(some, (was - now) / np.maximum(np.add.reduceat(length, begin), 1e-300), 0.0)
    allowed = tolerance[drawing.source.astype(np.intp)] / 2
    ring = np.arange(len(begin)).repeat(np.diff(begin, append=len(points)))
    distance = np.clip(distance[ring], -allowed, allowed)
    both = normal + normal[before]
    # a corner moves further than its sides, a sharp one up to twice as far
    part = distance / np.maximum(np.einsum("kd,kd->k", both, both) / 2, 0.5)
    return Drawing(points + part[:, None] * both, begin, drawing.source)


def ring_areas(points: Array, begin: IntArray) -> Array:
    """Return the signed area of each ring, (r,) m²: positive counter-clockwise."""
    if not len(points):
        return np.zeros(len(begin))
    size = np.diff(begin, append=len(points))
    local = points - points[np.minimum(begin, len(points) - 1)].repeat(size, axis=0)
    ahead = local[neighbours(begin, len(points))[0]]
    double = np.append(np.cumsum(local[:, 0] * ahead[:, 1] - local[:, 1] * ahead[:, 0]), 0.0)
    total = np.append(0.0, double[:-1])
    return np.asarray((total[begin + size] - total[begin]) / 2)


def neighbours(begin: IntArray, total: int) -> tuple[IntArray, IntArray]:
    """Return the next and the previous of so many vertices along their rings; no ring is empty.

    >>> neighbours(np.array([0, 3]), 5)
    (array([1, 2, 0, 4, 3]), array([2, 0, 1, 4, 3]))
    """
    after = np.arange(1, total + 1)
    after[begin + np.diff(begin, append=total) - 1] = begin
    before = np.empty_like(after)
    before[after] = np.arange(total)
    return after, before


def _without_stairs(outline: Outline, tolerance: Array, fixed: BoolArray) -> _Path:
    """Return the vertices of `outline`, stairs drawn by the middles of their short sides."""
    points, cell = outline.points, outline.cell
    source = np.arange(len(points), dtype=float)
    if cell is None or not len(points):
        return _Path(points, outline.begin, source, tolerance, fixed)
    after, before = neighbours(outline.begin, len(points))
    side = points[after] - points
    turn = np.sign(np.round(_cross(side[before], side) / cell**2, 6))
    wide = tolerance >= MIDDLES * cell
    short = np.hypot(*side.T) <= cell * (1 + 1e-6)
    step = short & (turn * turn[after] < 0) & wide & wide[after]
    keep = np.column_stack([~(step | step[before]), step]).ravel()
    return _Path(
        np.stack([points, (points + points[after]) / 2], axis=1).reshape(-1, 2)[keep],
        np.append(0, np.cumsum(keep))[2 * outline.begin],
        np.column_stack([source, source + 0.5]).ravel()[keep],
        np.repeat(tolerance, 2)[keep],
        np.column_stack([fixed, fixed | fixed[after]]).ravel()[keep],
    )


def _extremes(points: Array, begin: IntArray) -> BoolArray:
    """Return which vertices stay whatever the tolerance: in each ring two that are far from each other."""
    size = np.diff(begin, append=len(points))
    ring = np.arange(len(begin)).repeat(size)
    middle = np.add.reduceat(points, begin, axis=0) / size[:, None]
    stays = np.zeros(len(points), dtype=bool)
    for _ in range(2):
        away = np.hypot(*(points - middle[ring]).T)
        # to a millionth, so that rounding does not choose among equals
        far = np.lexsort((-np.round(away / away.max(), 6), ring))[begin]
        stays[far] = True
        middle = points[far]
    return stays


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
