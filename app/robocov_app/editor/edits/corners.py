"""Corners cut off and rounded."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np

from robocov.environment import SAGITTA
from robocov.errors import MapError
from robocov_app.editor.model.plane import ring_near, tenths
from robocov_app.editor.model.selection import Change, Selection, place_of, ring_points, rings_of, with_rings

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from robocov.arrays import Array
    from robocov.environment import Point, Ring
    from robocov_app.editor.model.document import Owner, Sketch

_STRAIGHT = math.radians(0.1)
"""A corner that turns by less has nothing to be cut off."""

_MOST_SEGMENTS = 256


def bevelled(sketch: Sketch, selection: Selection, length: float, *, segments: int = 1) -> Change:
    """Cut the selected corners off, `length` metres from each along both edges; ends of walls are none.

    With more segments they are rounded, by the arc that touches both edges there.
    """
    if not (math.isfinite(length) and length > 0.0):
        raise MapError("a bevel needs a length above 0 m")
    if not 1 <= segments <= _MOST_SEGMENTS:
        raise MapError(f"1 to {_MOST_SEGMENTS} segments were wanted")
    return _cut(sketch, selection, lambda turn: (length, segments), "bevelled")


def rounded_off(sketch: Sketch, selection: Selection, radius: float) -> Change:
    """Round the selected corners with a radius in metres, to a millimetre."""
    if not (math.isfinite(radius) and radius > 0.0):
        raise MapError("a radius above 0 m was wanted")

    def cut(turn: float) -> tuple[float, int]:
        step = 2.0 * math.acos(max(1.0 - SAGITTA / radius, 0.0))
        return radius * math.tan(turn / 2.0), min(_MOST_SEGMENTS, math.ceil(turn / step))

    return _cut(sketch, selection, cut, "rounded")


def _cut(
    sketch: Sketch, selection: Selection, wanted: Callable[[float], tuple[float, int]], words: str
) -> Change:
    """Cut corners; `wanted` says for the angle that a corner turns by the length and the segments."""
    chosen: dict[Owner, dict[int, set[int]]] = defaultdict(lambda: defaultdict(set))
    for vertex in selection.vertices:
        place_of(sketch, vertex)
        chosen[vertex.of][vertex.ring].add(vertex.index)
    after, count = sketch, 0
    for owner, by_ring in chosen.items():
        closed = {number: is_closed for number, _, is_closed in rings_of(sketch, owner)}
        rings = list(ring_points(sketch, owner))
        for number, indices in by_ring.items():
            if number in closed:
                cuts = _cuts(rings[number], indices, closed[number], wanted)
                rings[number] = _without_corners(rings[number], cuts, closed[number])
                count += len(cuts)
        if closed:
            after = with_rings(after, owner, rings)
    if not count:
        raise MapError("select corners first, of polygons, walls or the boundary")
    return Change(
        after,
        Selection(selection.items, frozenset(), selection.starts, selection.boundary),
        (f"{count} corners {words}" if count > 1 else f"corner {words}"),
    )


def _cuts(
    ring: Ring, indices: set[int], closed: bool, wanted: Callable[[float], tuple[float, int]]
) -> dict[int, tuple[float, int]]:
    """Return length and segments for those of the indices that are corners."""
    points = np.array(ring)
    cuts = {}
    for k in sorted(indices):
        if not closed and k in (0, len(ring) - 1):
            continue
        turn = _turn(points, k)
        if turn < _STRAIGHT:
            continue
        if turn > math.pi - _STRAIGHT:
            raise MapError("a corner that turns right back cannot be cut off")
        cuts[k] = wanted(turn)
    count = len(ring)
    for k, (length, _) in cuts.items():
        for other in ((k - 1) % count, (k + 1) % count):
            edge = math.dist(ring[k], ring[other])
            both = other in cuts
            taken = length + (cuts[other][0] if both else 0.0)
            if taken > edge + 1e-9:
                more = " for the corners at both ends" if both else ""
                raise MapError(
                    f"that takes {tenths(taken):g} m of an edge that is {tenths(edge):g} m long{more}: "
                    f"less was wanted"
                )
    return cuts


def _turn(points: Array, k: int) -> float:
    """Return by how many radians a ring turns at a vertex, either way; 0 where an edge has no length."""
    before = points[k] - points[k - 1]
    after = points[(k + 1) % len(points)] - points[k]
    cross = before[0] * after[1] - before[1] * after[0]
    return abs(math.atan2(float(cross), float(before @ after)))


def _without_corners(ring: Ring, cuts: Mapping[int, tuple[float, int]], closed: bool) -> Ring:
    points = np.array(ring)
    count = len(ring)
    new: list[Array] = []
    for k in range(count):
        if k in cuts:
            length, segments = cuts[k]
            new.append(_arc(points[k - 1], points[k], points[(k + 1) % count], length, segments))
        else:
            new.append(points[k : k + 1])
    kept: list[Point] = []
    for point in ring_near(np.concatenate(new)):
        if not kept or point != kept[-1]:
            kept.append(point)
    if closed and len(kept) > 1 and kept[0] == kept[-1]:
        kept.pop()
    return tuple(kept)


def _arc(before: Array, corner: Array, after: Array, length: float, segments: int) -> Array:
    """Return the (segments + 1, 2) points of the arc that touches both edges so far from the corner."""
    back, on = before - corner, after - corner
    back, on = back / np.hypot(*back), on / np.hypot(*on)
    first, last = corner + length * back, corner + length * on
    if segments == 1:
        return np.array([first, last])
    # the centre is where the normals at both ends meet: on the bisector
    half = math.acos(float(np.clip(back @ on, -1.0, 1.0))) / 2.0
    bisector = (back + on) / np.hypot(*(back + on))
    center = corner + bisector * (length / math.cos(half))
    spoke, end = first - center, last - center
    sweep = math.atan2(float(spoke[0] * end[1] - spoke[1] * end[0]), float(spoke @ end))
    angle = np.linspace(0.0, sweep, segments + 1)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(
        center + np.column_stack([cos * spoke[0] - sin * spoke[1], sin * spoke[0] + cos * spoke[1]])
    )
