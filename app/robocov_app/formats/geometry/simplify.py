"""Fewer vertices for a free space, and nothing closed by it.

Walls move by at most the tolerance. Afterwards it is checked that no outline meets another one or
itself, that every obstacle and every part that is as thin as the tolerance keeps its size, and that a robot
passes wherever it passed; where something is not so, the tolerance is smaller around that place, and it is
reported.

Along a wall at an angle the outline of cells is a flight of stairs: every short side between two
opposite turns becomes its middle, and these lie along the wall to within a third of a cell. Then the
algorithm of Douglas and Peucker leaves out what is within the tolerance, from one vertex that must
stay to the next.

D. H. Douglas, T. K. Peucker, Algorithms for the reduction of the number of points required to represent
a digitized line or its caricature, Cartographica 10 (1973), 112-122.
"""

from collections import Counter
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, STRtree
from shapely.geometry.base import BaseGeometry

from robocov.arrays import Array, BoolArray, IntArray, concatenate_ranges, find_run_starts
from robocov.errors import format_count
from robocov_app.formats.geometry.polygons import buffer_with_mitres
from robocov_app.formats.geometry.vectorize import NECK

KEPT_OUTLINE, KEPT_AREA = 0.1, 0.02  # parts of an outline's area, and of all that is free, that may change
_BLOCKS = 16  # a thing of fewer cells stays as it is: what it is like, its cells say best
# halvings of the tolerance around a place until everything stays there; rounds until all of a wall that is
# wrong stays, and until everything does everywhere, as it does after so many times the vertices
_HALVINGS, _PATIENCE, _ROUNDS, _WORK = 3, 24, 60, 1_000_000
_MIDDLES, _FEW = 0.75, 3  # cells of tolerance from which on stairs are lines; middles that make a line
_MIN_STAIRS_SIZE = 8.0  # side of the square, in cells, as large as a thing whose stairs are lines
_UNBALANCED = 0.02  # from this part of it on, the area that a ring lost is given back to it
# of a thing with the area of a square of so many tolerances and more, all of the tolerance is left out; of
# smaller ones less is, but always so much, in cells
_SIZES, _FINEST = 16, 0.4
_RIGHT, _SQUARE = (
    1e-5,
    0.2,
)  # of angles: cosines up to which one is right, sines up to which lines do not meet
# in tolerances: a short edge, and how far its run may be from the corner; and the sine of parallel walls
_SHORT, _NEAR, _PARALLEL = 1.5, 2.0, 0.1
_CHUNK = 2048  # sides that are looked at together for gaps, which bounds the memory
_MOST_GAPS, _MOST_RAYS = 200_000, 300_000_000  # looked at; sides that rays cross to tell what is inside
_CLEARLY = 1 + 1e-6  # a gap of just a robot's diameter is none
_THIN = 1.5  # a part is thin if it is narrower than so many tolerances
_MIN_THIN_LENGTH = 2.5  # in tolerances: what is shorter is a bump
_MIN_THIN_WIDTH = 0.01  # in tolerances: what is thinner comes of rounding
_THIN_SLACK = (
    0.5  # in tolerances squared: by how much the area of a thin part may change, next to KEPT_OUTLINE
)
_MAX_THIN_VERTICES = (
    80_000  # of an outline: in larger ones to look for thin parts takes more than some seconds
)
_LONGEST = 1024  # most vertices between two that must stay: the algorithm's depth may grow with their number


class SimplifiedSpace(NamedTuple):
    """A free space, m, whose walls may have moved by `tolerance`; `changed`: where less was done, and why."""

    free: MultiPolygon
    tolerance: float
    changed: tuple[str, ...] = ()


class ThinParts(NamedTuple):
    """Parts of a free space, or of what is solid, about as thin as the tolerance.

    `areas`, (n,) m². `vertex` and `part`, (m,): vertices of an outline, and the part that each belongs to.
    """

    areas: Array
    vertex: IntArray
    part: IntArray


class RingVertices:
    """The k vertices, `points` (k, 2) m, of the rings of polygons, ring after ring, no first one repeated.

    `begin`, `size`, (r,): where each ring begins, and its vertices; none is empty. `source`, (k,): the vertex
    of the outline that each one is; with a half added, the middle of the side after it. Along a ring they
    grow, but for one step back to its lowest. `vertex`, (k,): the same without the half. `ring`, `after`,
    `before`, (k,): the ring of each, and the next and the previous one along it.
    """

    def __init__(self, points: Array, begin: IntArray, source: Array) -> None:
        self.points, self.begin, self.source = points, begin, source
        self.vertex = source.astype(np.intp)
        self.size = np.diff(begin, append=len(points))
        self.ring = np.arange(len(begin)).repeat(self.size)
        self.after = np.arange(1, len(points) + 1)
        self.after[begin + self.size - 1] = begin
        self.before = np.argsort(self.after)

    @cached_property
    def areas(self) -> Array:
        """The signed area of each ring, (r,) m²: positive counter-clockwise."""
        local = self.points - self.points[self.begin].repeat(self.size, axis=0)
        total = np.append(0.0, np.cumsum(_cross(local, local[self.after])))
        return np.asarray((total[self.begin + self.size] - total[self.begin]) / 2)

    @cached_property
    def sides(self) -> Array:
        """From each vertex to the next one, (k, 2) m."""
        return np.asarray(self.points[self.after] - self.points)

    @cached_property
    def lengths(self) -> Array:
        """Of the sides, (k,) m."""
        return np.asarray(np.hypot(*self.sides.T))

    @property
    def ends(self) -> Array:
        """Of the sides, (k, 2, 2) m."""
        return np.stack([self.points, self.points[self.after]], axis=1)

    def _extremes(self) -> BoolArray:
        """Return which vertices stay whatever the tolerance: in each ring two far from each other."""
        middle = np.add.reduceat(self.points, self.begin, axis=0) / self.size[:, None]
        stays = np.zeros(len(self.points), dtype=bool)
        for _ in range(2):
            away = np.hypot(*(self.points - middle[self.ring]).T)
            # to a millionth, so that rounding does not choose among equals
            far = np.lexsort((-np.round(away / away.max(), 6), self.ring))[self.begin]
            stays[far] = True
            middle = self.points[far]
        return stays

    def _kept(self, allowed: Array, stays: BoolArray, most: Array) -> tuple[IntArray, IntArray]:
        """Return which vertices are kept: those that stay, and all but `most` (r,) m of a ring."""
        begin, count = self.begin, self.size
        changes = allowed != allowed[self.after]
        stays |= changes
        stays[self.after[changes]] = True
        # each ring from its first vertex that stays, round to that one again
        first = np.minimum.reduceat(np.where(stays, np.arange(len(stays)), len(stays)), begin)
        ring = np.arange(len(begin)).repeat(count + 1)
        step = concatenate_ranges(np.zeros_like(count), count + 1)
        vertex = begin[ring] + (first[ring] - begin[ring] + step) % count[ring]
        inner = stays[vertex] & (step > 0) & (step < count[ring])
        # a vertex that stays ends one line and begins the next
        twice = np.arange(len(vertex)).repeat(1 + inner)
        line = (np.cumsum(inner | (step == 0)) - 1)[twice]
        line[:-1] -= twice[:-1] == twice[1:]
        vertex = vertex[twice]
        # all of a line between its ends has one tolerance
        second = vertex[find_run_starts(line) + 1]
        within = np.minimum(allowed[second], most[self.ring[second]])
        lines = shapely.linestrings(np.column_stack([self.points[vertex], vertex]), indices=line)
        simple = shapely.simplify(lines, within, preserve_topology=False)
        kept, line = shapely.get_coordinates(simple, include_z=True, return_index=True)
        kept = kept[np.append(line[1:] == line[:-1], False), 2].astype(np.intp)
        return kept, np.searchsorted(self.ring[kept], np.arange(len(begin)))


class OriginalOutline(RingVertices):
    """All vertices of polygons; `owner`, (r,): the polygon of each ring, whose outer one comes first.

    `cell`, m: the longer side of the cells that it is the outline of, if any: then without their necks, and
    `neck`, (k,), is where a vertex stands for one.
    """

    def __init__(self, polygons: list[Polygon], cell: float | None) -> None:
        lines, owner = shapely.get_rings(polygons, return_index=True)
        points, ring = shapely.get_coordinates(lines, return_index=True)
        closing = np.append(ring[1:] != ring[:-1], True)
        points, ring = points[~closing], ring[~closing]
        begin, source = np.searchsorted(ring, np.arange(len(lines))), np.arange(len(points), dtype=float)
        neck = np.zeros(len(points), dtype=bool)
        if cell is not None:
            # the two ends of a neck, a short side between two at right angles, become the corner between them
            rings = RingVertices(points, begin, source)
            before, length = rings.before, rings.lengths
            along = rings.sides[before] / np.maximum(length[before], 1e-300)[:, None]
            neck = np.abs(_dot(along, along[rings.after[rings.after]])) < _RIGHT
            neck &= length < np.minimum(length[before], length[rings.after])
            neck &= length < 1.001 * np.sqrt(2) * NECK * cell
            points = np.where(neck[:, None], points + _dot(rings.sides, along)[:, None] * along, points)
            keep = ~neck[before]
            points, neck, ring, source = points[keep], neck[keep], ring[keep], source[: keep.sum()]
            begin = np.searchsorted(ring, np.arange(len(lines)))
        super().__init__(points, begin, source)
        self.owner, self.neck, self.cell = owner, neck, cell

    def drawn(self, tolerance: Array, fixed: BoolArray) -> RingVertices:
        """Return the outline with what is within the tolerance of each vertex, (k,) m, left out.

        Where that is 0 vertices stay, and where they are `fixed`, (k,), or the middles that stand for them.
        """
        path = self._without_stairs(tolerance)
        allowed = tolerance[path.vertex]
        stays = fixed[path.vertex] | ((path.source != path.vertex) & fixed[self.after[path.vertex]])
        stays |= path._extremes() | (allowed == 0.0) | (np.arange(len(allowed)) % _LONGEST == 0)
        # small things have few corners to lose
        finest = 0.0 if self.cell is None else _FINEST * self.cell
        kept, begin = path._kept(allowed, stays, np.maximum(np.sqrt(np.abs(self.areas)) / _SIZES, finest))
        drawing = RingVertices(path.points[kept], begin, path.source[kept])
        return drawing if self.cell is None else _fitted(path, kept, drawing, allowed[kept])

    def _without_stairs(self, tolerance: Array) -> RingVertices:
        """Return the vertices, stairs drawn by the middles of their short sides."""
        points, after, cell = self.points, self.after, self.cell
        if cell is None:
            return self
        turn = np.sign(np.round(_cross(self.sides[self.before], self.sides) / cell**2, 6))
        # the steps of a small thing are its shape, not the stairs of a wall
        is_large = np.sqrt(np.abs(self.areas)) >= _MIN_STAIRS_SIZE * cell
        wide = (tolerance >= _MIDDLES * cell) & is_large[self.ring]
        short = self.lengths <= cell * (1 + 1e-6)
        step = short & (turn * turn[after] < 0) & wide & wide[after]
        keep = np.column_stack([~(step | step[self.before]), step]).ravel()
        return RingVertices(
            np.stack([points, (points + points[after]) / 2], axis=1).reshape(-1, 2)[keep],
            np.append(0, np.cumsum(keep))[2 * self.begin],
            np.column_stack([self.source, self.source + 0.5]).ravel()[keep],
        )

    def balanced(self, drawing: RingVertices, tolerance: Array) -> RingVertices:
        """Return `drawing` with rings of the area that they had, where they lost or won much of it.

        All sides of one move by the same distance, of at most half the tolerance. Small round things need it:
        with few corners, each on their rim, they get smaller.
        """
        points, was, now = drawing.points, self.areas, drawing.areas
        some = (np.abs(now - was) > _UNBALANCED * np.abs(was)) & (2 * now * np.sign(was) > np.abs(was))
        if not some.any():
            return drawing
        side, length = drawing.sides, drawing.lengths
        # to the right of a side is the outside of a ring that runs counter-clockwise
        normal = np.column_stack([side[:, 1], -side[:, 0]]) / np.maximum(length, 1e-300)[:, None]
        around = np.maximum(np.add.reduceat(length, drawing.begin), 1e-300)
        allowed = tolerance[drawing.vertex] / 2
        distance = np.clip(np.where(some, (was - now) / around, 0.0)[drawing.ring], -allowed, allowed)
        both = normal + normal[drawing.before]
        # a corner moves further than its sides, a sharp one up to twice as far
        part = distance / np.maximum(_dot(both, both) / 2, 0.5)
        return RingVertices(points + part[:, None] * both, drawing.begin, drawing.source)

    def with_necks(self, drawing: RingVertices) -> RingVertices:
        """Return `drawing` with the self's necks again; the source of each vertex is its vertex."""
        points = drawing.points
        neck = self.neck[drawing.vertex] & (drawing.source == drawing.vertex)
        if self.cell is None or not neck.any():
            return RingVertices(points, drawing.begin, np.arange(len(points), dtype=float))
        twice = np.arange(len(points)).repeat(1 + neck)
        second = np.append(False, twice[1:] == twice[:-1])
        way = points[np.where(second, drawing.after[twice], drawing.before[twice])] - points[twice]
        length = np.maximum(np.hypot(*way.T), 1e-300)
        part = np.where(neck[twice], np.minimum(NECK * self.cell / length, 0.4), 0.0)
        begin = np.searchsorted(twice, drawing.begin)
        return RingVertices(points[twice] + part[:, None] * way, begin, twice.astype(float))

    @cached_property
    def walls(self) -> STRtree:
        """The sides of all rings."""
        return STRtree(shapely.linestrings(self.ends))

    def restrain(self, drawing: RingVertices, tolerance: Array) -> RingVertices:
        """Return `drawing` with vertices that are farther from all walls than the tolerance put back."""
        vertex = drawing.vertex
        # where each vertex comes from: a vertex of the outline, or the middle of the side after it
        half = (drawing.source % 1.0)[:, None]
        origin = (1.0 - half) * self.points[vertex] + half * self.points[self.after[vertex]]
        moved = np.flatnonzero((drawing.points != origin).any(axis=1))
        places = shapely.points(drawing.points[moved])
        _, distance = self.walls.query_nearest(places, return_distance=True, all_matches=False)
        too_far = moved[distance > tolerance[vertex[moved]]]
        points = drawing.points.copy()
        points[too_far] = origin[too_far]
        return RingVertices(points, drawing.begin, drawing.source)

    def find_thin_parts(self, free: MultiPolygon, tolerance: float) -> ThinParts:
        """Return the thin parts of the free space that this is the outline of, and of what is solid."""
        if len(self.points) > _MAX_THIN_VERTICES:
            return ThinParts(np.empty(0), np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp))
        radius = _THIN * tolerance / 2
        grown, shrunk = (_offset(free, distance) for distance in (radius, -radius))
        closed, opened = _offset(grown, -radius), _offset(shrunk, radius)
        thin = [shapely.difference(closed, free), shapely.difference(free, opened)]
        pieces = shapely.get_parts(shapely.get_parts(thin))
        x, y, right, top = shapely.bounds(pieces).T
        is_long = np.maximum(right - x, top - y) > _MIN_THIN_LENGTH * tolerance
        is_rounding = shapely.area(pieces) < _MIN_THIN_WIDTH * tolerance * shapely.length(pieces)
        pieces = pieces[is_long & ~is_rounding]
        reach = 1e-9 if self.cell is None else 1.5 * NECK * self.cell
        part, vertex = STRtree(shapely.points(self.points)).query(pieces, "dwithin", distance=reach)
        return ThinParts(np.asarray(shapely.area(pieces)), vertex, part)

    def polygons(self, drawing: RingVertices) -> MultiPolygon:
        rings = shapely.linearrings(drawing.points, indices=drawing.ring)
        return MultiPolygon(list(shapely.polygons(rings, indices=self.owner)))


def simplify_free_space(
    free: MultiPolygon, tolerance: float, cell: float | None, radius: float
) -> SimplifiedSpace:
    """Return `free`, m, valid, with fewer vertices; walls move by the tolerance, m, at most.

    `cell`, m: side of the cells that it is the outline of. `radius`, m: robots pass wherever they passed.
    """
    if tolerance == 0.0 or free.is_empty:
        return SimplifiedSpace(free, 0.0)
    outline = OriginalOutline(list(free.geoms), cell)
    allowed = np.full(len(outline.points), tolerance)
    if cell is not None:
        allowed[(np.abs(outline.areas) < _BLOCKS * cell * cell)[outline.ring]] = 0.0
    fixed = np.zeros(len(outline.points), dtype=bool)
    thin = outline.find_thin_parts(free, tolerance)
    found: Counter[str] = Counter()
    for attempt in range(min(_ROUNDS, 1 + _WORK // len(allowed))):
        drawing = outline.balanced(outline.drawn(allowed, fixed), allowed)
        drawing = outline.restrain(drawing, allowed)
        check = _Check(outline, drawing, allowed, tolerance, 2 * radius, found)
        wrong, far = check.misdrawn()
        parts = None
        wrong |= check.find_misshapen(thin)
        if not (wrong.any() or far.any()):
            parts, wrong = check.met()
        if parts is None or wrong.any():
            wrong |= far & fixed
            fixed |= far
            if attempt >= _PATIENCE:  # all that a side stands for together with one of these
                allowed[np.isin(check.side, check.side[wrong | far])] = 0.0
            allowed[wrong] /= 2
            allowed[allowed < 0.75 * tolerance * 0.5**_HALVINGS] = 0.0
            continue
        narrow = check.narrowed(parts)
        if narrow is None:
            return SimplifiedSpace(free, 0.0, ("not simplified: too many gaps that a robot may pass or not",))
        if not narrow.any():
            return SimplifiedSpace(parts, tolerance, _told(found, radius))
        allowed[narrow] = 0.0
    return SimplifiedSpace(free, 0.0, ("not simplified: walls would have met, or closed passages",))


def _told(found: Counter[str], radius: float) -> tuple[str, ...]:
    less = {
        "narrow place": f"so that a robot of radius {radius:g} m passes where it passed",
        "thin part": f"whose area would have changed by more than {100 * KEPT_OUTLINE:g} %",
        "outline": f"whose area would have changed by more than {100 * KEPT_OUTLINE:g} %",
        "place": "where walls would have met",
    }
    told = [f"simplified less at {format_count(found[k], k)}, {why}" for k, why in less.items() if found[k]]
    if found["area"]:
        told.append(f"simplified less, so that the free area changes by less than {100 * KEPT_AREA:g} %")
    return tuple(told)


class _Check:
    """Checks of a drawing of an outline; each answer is a mask of the outline's vertices, (k,).

    `allowed`, (k,) m: the tolerance at each; `found` counts what is wrong where that is still the whole one.
    `width`, m: of a robot. `side`, (k,): the drawing's side that stands for each vertex, by its first one.
    """

    def __init__(
        self,
        outline: OriginalOutline,
        drawing: RingVertices,
        allowed: Array,
        most: float,
        width: float,
        found: Counter[str],
    ) -> None:
        self.outline, self.drawing, self.allowed = outline, drawing, allowed
        self.tolerance, self.width, self.found = most, width, found
        order, ring = np.argsort(drawing.source, kind="stable"), outline.ring
        place = np.searchsorted(drawing.source[order], np.arange(len(ring)), side="right") - 1
        # before the first of a ring comes its last
        end = drawing.begin + drawing.size - 1
        self.side = order[np.where(place < drawing.begin[ring], end[ring], place)]

    def misdrawn(self) -> tuple[BoolArray, BoolArray]:
        """Return what is in a ring of another size, and what a side stands for from furthest off."""
        allowed, drawing, points = self.allowed, self.drawing, self.outline.points
        distance = np.full(len(points), np.inf)
        # where a corner was made whole, the side before or after may be the nearer one
        for near in (self.side, drawing.before[self.side], drawing.after[self.side]):
            start, along = drawing.points[near], drawing.sides[near]
            part = _dot(points - start, along) / np.maximum(_dot(along, along), 1e-300)
            foot = start + np.clip(part, 0.0, 1.0)[:, None] * along
            distance = np.minimum(distance, np.hypot(*(points - foot).T))
        furthest = np.lexsort((-distance, self.side))
        furthest = furthest[find_run_starts(self.side[furthest])]
        far = np.zeros(len(distance), dtype=bool)
        far[furthest] = distance[furthest] > allowed[furthest] * (1 + 1e-9)
        far &= allowed > 0.0
        was, now, ring = self.outline.areas, drawing.areas, self.outline.ring
        off = np.abs(now - was) > KEPT_OUTLINE * np.abs(was)
        self.found["outline"] += int(np.count_nonzero(off[np.unique(ring[allowed == self.tolerance])]))
        wrong = off[ring] & (allowed > 0.0)
        if not (wrong.any() or far.any()) and abs(now.sum() - was.sum()) > KEPT_AREA * was.sum():
            self.found["area"] += 1
            wrong = allowed > 0.0
        return wrong, far

    def find_misshapen(self, thin: ThinParts) -> BoolArray:
        """Return what is of a thin part that has another size in the drawing."""
        wrong = np.zeros(len(self.outline.points), dtype=bool)
        if not len(thin.areas):
            return wrong
        changes = self._measure_changes()
        # a side counts once, of however many vertices of the part it is the side
        pairs = np.unique(np.column_stack([thin.part, self.side[thin.vertex]]), axis=0)
        change = np.bincount(pairs[:, 0], changes[pairs[:, 1]], minlength=len(thin.areas))
        off = np.abs(change) > KEPT_OUTLINE * thin.areas + _THIN_SLACK * self.tolerance**2
        vertex, part = thin.vertex[off[thin.part]], thin.part[off[thin.part]]
        self.found["thin part"] += len(np.unique(part[self.allowed[vertex] == self.tolerance]))
        wrong[vertex] = True
        return wrong & (self.allowed > 0.0)

    def _measure_changes(self) -> Array:
        """Return by how much the area of rings changes at each side of the drawing, (m,) m².

        It is the signed area between the side and the run of the outline that it stands for: together, the
        difference of the areas of the rings.
        """
        outline, drawing = self.outline, self.drawing
        first, last = drawing.vertex, drawing.vertex[drawing.after]
        # along the outline, from the run's first vertex to its last: summed up from the ring's beginning,
        # and once more around where a run passes that
        origin = outline.points[outline.begin[outline.ring]]
        local = outline.points - origin
        steps = _cross(local, local[outline.after])
        total = np.append(0.0, np.cumsum(steps))
        run = total[last] - total[first]
        begin, size = outline.begin[drawing.ring], outline.size[drawing.ring]
        passes = last <= first
        run += np.where(passes, total[begin + size] - total[begin], 0.0)
        start, end = (
            drawing.points - outline.points[begin],
            drawing.points[drawing.after] - outline.points[begin],
        )
        before, after = local[first], local[last]
        drawn = _cross(before, start) + _cross(start, end) + _cross(end, after)
        return np.asarray((drawn - run) / 2)

    def met(self) -> tuple[MultiPolygon, BoolArray]:
        outline, drawing, allowed = self.outline, self.outline.with_necks(self.drawing), self.allowed
        parts = outline.polygons(drawing)
        if parts.is_valid:
            return parts, np.zeros(len(outline.points), dtype=bool)
        after, sides = drawing.after, shapely.linestrings(drawing.ends)
        one, other = STRtree(sides).query(sides, predicate="intersects")
        apart = (one < other) & (after[one] != other) & (after[other] != one)
        wrong = np.isin(self.side, drawing.vertex[np.append(one[apart], other[apart])])
        wrong |= wrong[outline.after]
        wrong &= allowed > 0.0
        if (allowed[wrong] == self.tolerance).any():
            self.found["place"] += int(np.count_nonzero(apart))
        # a ring that lies where it may not, and crosses nothing
        return parts, wrong if wrong.any() else allowed > 0.0

    def narrowed(self, parts: MultiPolygon) -> BoolArray | None:
        """Return what is about gaps that a robot does not pass any more; None where these are too many."""
        outline, drawing = self.outline, self.drawing
        # a side from or to the middle of a short one stands for all of that
        first, last = drawing.vertex, np.ceil(drawing.source[drawing.after]).astype(np.intp)
        begin, size = outline.begin[drawing.ring], outline.size[drawing.ring]
        count = (last - first - 1) % size + 2
        at = begin.repeat(count) + (concatenate_ranges(first - begin, count)) % size.repeat(count)
        runs = shapely.linestrings(outline.points[at], indices=np.arange(len(count)).repeat(count))
        closed = find_closed_gaps(drawing.ends, runs, parts, self.width, 3 * self.tolerance)
        if closed is None:
            return None
        wrong = np.zeros(len(outline.points), dtype=bool)
        order = np.argsort(self.side, kind="stable")
        of_sides = np.split(order, np.searchsorted(self.side[order], np.arange(1, len(count))))
        for pair, place in zip(*closed, strict=True):
            about = np.concatenate([*(of_sides[k] for k in pair), first[drawing.after[pair]]])
            loose = about[self.allowed[about] > 0.0]
            near = loose[np.hypot(*(outline.points[loose] - place).T) <= self.width + 3 * self.tolerance]
            wrong[near if len(near) else loose] = True
        self.found["narrow place"] += len(closed[0])
        return wrong


def _fitted(path: RingVertices, kept: IntArray, drawing: RingVertices, allowed: Array) -> RingVertices:
    """Return `drawing` with corners whole, and sides that stand for stairs in the middle of these.

    Such a side becomes the line of least squares of the middles that it stands for; it ends where that meets
    its neighbours. A short side between two long ones that meet nearby is a corner.
    """
    points, after, before, length = drawing.points, drawing.after, drawing.before, drawing.lengths
    chord = drawing.sides / np.maximum(length, 1e-300)[:, None]
    stairs, foot, along = _stairs(path, kept, drawing)
    # a line for each side: a point of it, and its direction
    foot = np.where(stairs[:, None], foot, points)
    along = np.where(stairs[:, None], along, chord)
    meeting, sine = _meeting(foot[before], along[before], foot, along)
    # lines that hardly turn have no good meeting: half-way between them
    flat = (_foot(points, foot[before], along[before]) + _foot(points, foot, along)) / 2
    move = np.where(np.abs(sine)[:, None] > _SQUARE, meeting, flat) - points
    move[~(stairs | stairs[before])] = 0.0
    move[np.hypot(*move.T) > 2 * allowed] = 0.0
    # neither end of the side may be one that stays
    both = np.minimum(allowed, allowed[after])
    long = length > 4 * both
    corner, sine = _meeting(foot[before], along[before], foot[after], along[after])
    cut = np.abs(sine) > _SQUARE
    cut &= ~stairs & (both > 0.0) & (length <= 2 * both) & long[before] & long[after]
    for end in (points, points[after]):
        cut &= np.hypot(*(corner - end).T) <= 2 * both
    move[cut] = corner[cut] - points[cut]
    stays = ~cut[before]
    begin = np.searchsorted(drawing.ring[stays], np.arange(len(drawing.begin)))
    return RingVertices((points + move)[stays], begin, drawing.source[stays])


def _stairs(path: RingVertices, kept: IntArray, drawing: RingVertices) -> tuple[BoolArray, Array, Array]:
    """Return which sides stand for stairs, and the lines of these: a point and a direction, (m, 2) each."""
    count, first = path.size[drawing.ring], path.begin[drawing.ring]
    # what lies between each vertex that stays and the next one, round the ring
    length = np.maximum((kept[drawing.after] - kept) % count - 1, 0)
    side = np.arange(len(kept)).repeat(length)
    inside = first[side] + (concatenate_ranges(kept + 1, length) - first[side]) % count[side]
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


def _offset(area: BaseGeometry, distance: float) -> BaseGeometry:
    """Return an area grown by a distance, m, with corners as they are."""
    grown: BaseGeometry = buffer_with_mitres(area, distance)
    return grown


def _meeting(a: Array, u: Array, b: Array, v: Array) -> tuple[Array, Array]:
    """Return where the lines through a along u and through b along v meet, and u cross v."""
    cross = _cross(u, v)
    part = _cross(b - a, v) / np.where(np.abs(cross) < 1e-200, 1.0, cross)
    return a + part[:, None] * u, cross


def _foot(p: Array, a: Array, u: Array) -> Array:
    return np.asarray(a + _dot(p - a, u)[:, None] * u)


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("kd,kd->k", a, b))


def sharpen_corners(plan: Polygon, tolerance: float) -> Polygon:
    """Return `plan`, m, with its cut corners made whole, or as it is where that would break it.

    A run of short edges becomes the point where the long edges before and after it meet, if all of the run is
    near that: unlike a plain simplification, it keeps the directions of the walls.
    """
    rings = [_sharpened(np.asarray(ring.coords)[:-1], tolerance) for ring in (plan.exterior, *plan.interiors)]
    sharp = Polygon(rings[0], rings[1:])
    return sharp if sharp.is_valid else plan


def _sharpened(ring: Array, tolerance: float) -> Array:
    side = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(*side.T)
    long = np.flatnonzero(length > _SHORT * tolerance)
    if len(long) < 3:
        return ring
    following = np.roll(long, -1)
    corner, sine = _meeting(ring[long], side[long], ring[following], side[following])
    turns = np.abs(sine) > _PARALLEL * length[long] * length[following]
    runs = np.split(np.roll(ring, -long[0] - 1, axis=0), long[1:] - long[0])
    for k in np.flatnonzero(turns & (np.array([len(run) for run in runs]) > 1)):
        is_near = np.hypot(*(runs[k] - corner[k]).T).max() <= _NEAR * tolerance
        if is_near and shapely.LineString(runs[k]).distance(shapely.Point(corner[k])) <= tolerance:
            runs[k] = corner[k : k + 1]
    return np.concatenate(runs)


def count_crossed_sides(sides: Array, y: Array) -> int:
    """Return how many sides horizontal lines at `y` cross, together: the cost of telling what is inside."""
    bounds = shapely.bounds(sides)
    low, high = np.sort(bounds[:, 1]), np.sort(bounds[:, 3])
    return int((np.searchsorted(low, y, side="right") - np.searchsorted(high, y)).sum())


def find_closed_gaps(
    sides: Array, paths: Array, free: MultiPolygon, width: float, moved: float
) -> tuple[IntArray, Array] | None:
    """Return the (p, 2) sides and the middles of gaps that are too narrow now; None if they are too many.

    A gap is where two `sides`, (m, 2, 2), of walls as they are now face each other across the `free` space.
    It was wide enough for a robot of diameter `width` if the walls as they were, `paths`, (m,) linestrings,
    are further apart there; none has `moved` further than so many metres.
    """
    lines = shapely.linestrings(sides)
    tree = STRtree(lines)
    pairs = np.empty((0, 2), dtype=np.intp)
    for begin in range(0, len(lines), _CHUNK):
        one, other = tree.query(lines[begin : begin + _CHUNK], predicate="dwithin", distance=width)
        one += begin
        # neighbours meet in a corner; and two walls that are far closer now were close before
        apart = (one < other) & (sides[one, 1] != sides[other, 0]).any(axis=1)
        apart &= (sides[other, 1] != sides[one, 0]).any(axis=1)
        one, other = one[apart], other[apart]
        distance = shapely.distance(lines[one], lines[other])
        narrow = (distance < width) & (distance > width - 2 * moved)
        pairs = np.concatenate([pairs, np.column_stack([one[narrow], other[narrow]])])
        if len(pairs) > _MOST_GAPS:
            return None
    ends = shapely.get_coordinates(shapely.shortest_line(lines[pairs[:, 0]], lines[pairs[:, 1]]))
    places = ends.reshape(-1, 2, 2).mean(axis=1)
    if count_crossed_sides(lines, places[:, 1]) > _MOST_RAYS:
        return None
    shapely.prepare(free)
    across = shapely.contains_xy(free, *places.T)
    pairs, places = pairs[across], places[across]
    reach = width / 2 + 2 * moved
    windows = shapely.box(*(places - reach).T, *(places + reach).T)
    before = [shapely.intersection(paths[pairs[:, k]], windows) for k in (0, 1)]
    # where nothing is left of a wall it was further away
    lost = np.nan_to_num(shapely.distance(*before), nan=np.inf) > width * _CLEARLY
    return pairs[lost], places[lost]
