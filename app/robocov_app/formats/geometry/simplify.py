"""Fewer vertices for a free space, and nothing closed by it.

Walls move by at most the tolerance. Afterwards it is checked that no outline meets another one or
itself, that every obstacle keeps its size, and that a robot passes wherever it passed; where something is
not so, the tolerance is smaller around that place, and it is said.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import MultiPolygon, STRtree

from robocov.arrays import Array, BoolArray, IntArray, beginnings
from robocov.errors import counted
from robocov_app.formats.geometry.outline import (
    Drawing,
    Outline,
    balanced,
    drawn,
    neighbours,
    outline_of,
    ring_areas,
    with_necks,
)
from robocov_app.formats.geometry.passages import closed_gaps, paths_of

KEPT_OUTLINE = 0.1
"""By so much of it the area of an outline may change: of an obstacle, or a part of the free space."""

KEPT_AREA = 0.02
"""By so much of it the free area may change as a whole."""

BLOCKS = 16
"""A thing of fewer cells stays as it is: what it is like, its cells say best."""

_HALVINGS = 3
"""How often the tolerance is halved around a place before everything stays there."""

_PATIENCE = 24
"""After so many rounds all of a wall stays where something is wrong."""

_ROUNDS, _WORK = 60, 1_000_000
"""After so many everything stays everywhere, and after so many times the vertices."""


@dataclass(frozen=True, eq=False)
class Simplified:
    """A free space with fewer vertices.

    `free` in m. `tolerance`, m: walls may have moved by so much. `changed`: where less was done than wanted,
    and why; one line each.
    """

    free: MultiPolygon
    tolerance: float
    changed: tuple[str, ...] = ()


@dataclass
class _Found:
    """How often each thing that is checked was wrong at first, for robots of a diameter `width` (m)."""

    width: float
    narrow: int = 0
    sizes: int = 0
    meetings: int = 0
    whole: int = 0

    def lines(self) -> tuple[str, ...]:
        said = (
            (
                self.narrow,
                "narrow place",
                f"so that a robot of radius {self.width / 2:g} m passes where it passed",
            ),
            (self.sizes, "outline", f"whose area would have changed by more than {100 * KEPT_OUTLINE:g} %"),
            (self.meetings, "place", "where walls would have met"),
        )
        lines = [f"simplified less at {counted(n, what)}, {why}" for n, what, why in said if n]
        if self.whole:
            lines.append(f"simplified less, so that the free area changes by less than {100 * KEPT_AREA:g} %")
        return tuple(lines)


def simplified(free: MultiPolygon, tolerance: float, cell: float | None, radius: float) -> Simplified:
    """Return `free` with fewer vertices.

    `free`, m: valid; of a raster as `tracing.traced` makes it. `tolerance`, m: walls may move by so much; 0
    changes nothing. `cell`, m: side of the cells that it is the outline of. `radius`, m: of a robot: where it
    passes, it still passes.
    """
    if tolerance == 0.0 or free.is_empty:
        return Simplified(free, 0.0)
    outline = outline_of(free, cell)
    allowed = np.full(len(outline.points), tolerance)
    if cell is not None:
        blocks = np.abs(ring_areas(outline.points, outline.begin)) < BLOCKS * cell * cell
        allowed[blocks[outline.ring]] = 0.0
    fixed = np.zeros(len(outline.points), dtype=bool)
    found = _Found(2 * radius)
    for attempt in range(min(_ROUNDS, 1 + _WORK // len(allowed))):
        drawing = balanced(outline, drawn(outline, allowed, fixed), allowed)
        wrong, far = _misdrawn(outline, drawing, allowed, tolerance, found)
        parts = None
        if not (wrong.any() or far.any()):
            parts, wrong = _met(outline, drawing, allowed, tolerance, found)
        if parts is None or wrong.any():
            wrong |= far & fixed
            fixed |= far
            if attempt >= _PATIENCE:
                allowed[_beside(outline, drawing, wrong | far)] = 0.0
            allowed[wrong] /= 2
            allowed[allowed < 0.75 * tolerance * 0.5**_HALVINGS] = 0.0
            continue
        narrow = _narrowed(outline, drawing, parts, allowed, tolerance, found)
        if narrow is None:
            return Simplified(free, 0.0, ("not simplified: too many gaps that a robot may pass or not",))
        if not narrow.any():
            return Simplified(parts, tolerance, found.lines())
        allowed[narrow] = 0.0
    return Simplified(free, 0.0, ("not simplified: walls would have met, or closed passages",))


def _misdrawn(
    outline: Outline, drawing: Drawing, allowed: Array, tolerance: float, found: _Found
) -> tuple[BoolArray, BoolArray]:
    """Return which vertices of the outline belong to a ring of another size, and which are drawn too far off.

    Of those that one side stands for it is the one that is furthest.
    """
    distance = _distance(outline, drawing)
    side = _sides(outline, drawing)
    furthest = np.lexsort((-distance, side))
    furthest = furthest[beginnings(side[furthest])]
    far = np.zeros(len(distance), dtype=bool)
    far[furthest] = distance[furthest] > allowed[furthest] * (1 + 1e-9)
    far &= allowed > 0.0
    was = ring_areas(outline.points, outline.begin)
    now = ring_areas(drawing.points, drawing.begin)
    off = np.abs(now - was) > KEPT_OUTLINE * np.abs(was)
    ring = outline.ring
    fresh = np.zeros(len(off), dtype=bool)
    fresh[ring[allowed == tolerance]] = True
    found.sizes += int(np.count_nonzero(off & fresh))
    wrong = off[ring] & (allowed > 0.0)
    if not (wrong.any() or far.any()) and abs(now.sum() - was.sum()) > KEPT_AREA * was.sum():
        found.whole += 1
        wrong = allowed > 0.0
    return wrong, far


def _beside(outline: Outline, drawing: Drawing, some: BoolArray) -> BoolArray:
    """Return which vertices of the outline one side stands for together with one of `some`."""
    side = _sides(outline, drawing)
    all_of = np.zeros(len(drawing.points), dtype=bool)
    all_of[side[some]] = True
    return np.asarray(all_of[side])


def _distance(outline: Outline, drawing: Drawing) -> Array:
    """Return how far each vertex of the outline is from what is drawn for it, (k,) m."""
    after, before = neighbours(drawing.begin, len(drawing.points))
    side = _sides(outline, drawing)
    nearest = np.full(len(outline.points), np.inf)
    # where a corner was made whole, the side before or after may be the nearer one
    for near in (side, before[side], after[side]):
        start, along = drawing.points[near], drawing.points[after[near]] - drawing.points[near]
        length = np.einsum("kd,kd->k", along, along)
        part = np.einsum("kd,kd->k", outline.points - start, along) / np.maximum(length, 1e-300)
        foot = start + np.clip(part, 0.0, 1.0)[:, None] * along
        nearest = np.minimum(nearest, np.hypot(*(outline.points - foot).T))
    return nearest


def _sides(outline: Outline, drawing: Drawing) -> IntArray:
    """Return which side of the drawing, by its first vertex, stands for each vertex of the outline, (k,)."""
    order = np.argsort(drawing.source, kind="stable")
    place = np.searchsorted(drawing.source[order], np.arange(len(outline.points)), side="right") - 1
    # before the first of a ring comes its last
    ring = outline.ring
    end = np.append(drawing.begin[1:], len(drawing.points)) - 1
    return np.asarray(order[np.where(place < drawing.begin[ring], end[ring], place)])


def _met(
    outline: Outline, drawing: Drawing, allowed: Array, tolerance: float, found: _Found
) -> tuple[MultiPolygon, BoolArray]:
    """Return the drawing as polygons, and which vertices of the outline are drawn across something else."""
    points, begin, vertex = with_necks(outline, drawing)
    size = np.diff(begin, append=len(points))
    rings = shapely.linearrings(points, indices=np.arange(len(begin)).repeat(size))
    parts = MultiPolygon(list(shapely.polygons(rings, indices=outline.owner)))
    if parts.is_valid:
        return parts, np.zeros(len(outline.points), dtype=bool)
    after, _ = neighbours(begin, len(points))
    sides = shapely.linestrings(np.stack([points, points[after]], axis=1))
    one, other = STRtree(sides).query(sides, predicate="intersects")
    apart = (one < other) & (after[one] != other) & (after[other] != one)
    across = np.zeros(len(drawing.points), dtype=bool)
    across[vertex[one[apart]]] = across[vertex[other[apart]]] = True
    wrong = across[_sides(outline, drawing)]
    wrong |= wrong[neighbours(outline.begin, len(outline.points))[0]]
    wrong &= allowed > 0.0
    found.meetings += int(np.count_nonzero(apart)) if (allowed[wrong] == tolerance).any() else 0
    # a ring that lies where it may not, and crosses nothing
    return parts, wrong if wrong.any() else allowed > 0.0


def _narrowed(
    outline: Outline, drawing: Drawing, parts: MultiPolygon, allowed: Array, tolerance: float, found: _Found
) -> BoolArray | None:
    """Return which vertices of the outline are about gaps that a robot does not pass any more.

    None where there are too many gaps to look at.
    """
    after, _ = neighbours(drawing.begin, len(drawing.points))
    sides = np.stack([drawing.points, drawing.points[after]], axis=1)
    # a side from or to the middle of a short one stands for all of that
    first, last = drawing.source.astype(np.intp), np.ceil(drawing.source[after]).astype(np.intp)
    ring = np.searchsorted(outline.begin, first, side="right") - 1
    paths = paths_of(outline.points, outline.begin[ring], outline.size[ring], first, last)
    closed = closed_gaps(sides, paths, parts, found.width, 3 * tolerance)
    if closed is None:
        return None
    pairs, places = closed
    wrong = np.zeros(len(outline.points), dtype=bool)
    if len(pairs):
        side = _sides(outline, drawing)
        order = np.argsort(side, kind="stable")
        begin = np.searchsorted(side[order], np.arange(len(sides) + 1))
        for pair, place in zip(pairs.tolist(), places, strict=True):
            about = np.concatenate([order[begin[k] : begin[k + 1]] for k in pair])
            about = np.unique(np.concatenate([about, first[after[pair]]]))
            loose = about[allowed[about] > 0.0]
            away = np.hypot(*(outline.points[loose] - place).T)
            near = loose[away <= found.width + 3 * tolerance]
            wrong[near if len(near) else loose] = True
        found.narrow += len(pairs)
    return wrong
