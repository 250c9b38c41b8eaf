"""Outlines with fewer vertices, and the same shape within a tolerance."""

import math

import numpy as np
import shapely
from shapely import LineString, Polygon

from robocov.arrays import BoolArray
from robocov.environment import Ring
from robocov.errors import MapError, counted
from robocov.mapfile.models import LARGEST
from robocov_app.editor.model.geometry import ring_near
from robocov_app.editor.model.selection import Change, Selection, ring_points, rings_of, with_rings
from robocov_app.editor.model.sketch import BOUNDARY, Owner, Sketch

_STEPS = 12  # tolerances that are tried, each half of the one before, until nothing crosses


def simplified(sketch: Sketch, selection: Selection, tolerance: float) -> Change:
    """Leave out vertices of the selected obstacles and boundary; of all obstacles if none is selected.

    By Douglas and Peucker (1973), to `tolerance` m; nothing crosses itself afterwards that did not before.
    """
    if not (math.isfinite(tolerance) and 0.0 <= tolerance <= LARGEST):
        raise MapError("a tolerance of 0 m or more was wanted")
    after, before = sketch, 0
    for owner in _owners(sketch, selection):
        rings = ring_points(sketch, owner)
        fewer = _simpler(rings, tolerance, closed=rings_of(sketch, owner)[0][2])
        before += sum(map(len, rings)) - sum(map(len, fewer))
        if fewer != rings:
            after = with_rings(after, owner, fewer)
    if not before:
        raise MapError("no vertex can be left out at that tolerance")
    words = "1 vertex left out" if before == 1 else f"{before} vertices left out"
    return Change(after, selection.without_vertices(), words)


def straightened(sketch: Sketch, selection: Selection, degrees: float = 5.0) -> Change:
    """Make edges horizontal or vertical that nearly are; those in line come to lie on one line."""
    if not 0.0 < degrees <= 30.0:
        raise MapError("an angle of up to 30 degrees was wanted")
    after, count = sketch, 0
    for owner in _owners(sketch, selection):
        rings = []
        for _, points, closed in rings_of(sketch, owner):
            rings.append(_straight(points, degrees, closed=closed))
            count += rings[-1] != points
        if any(new != old for new, old in zip(rings, ring_points(sketch, owner), strict=True)):
            after = with_rings(after, owner, rings)
    if not count:
        raise MapError(f"no edge is within {degrees:g} degrees of level or upright, and not so already")
    return Change(after, selection.without_vertices(), f"{counted(count, 'outline')} straightened")


def _owners(sketch: Sketch, selection: Selection) -> list[Owner]:
    """Return the obstacles with vertices, and the boundary, that are meant."""
    everything = not (selection.items or selection.boundary)
    owners: list[Owner] = [
        item.key
        for item in sketch.obstacles
        if (everything or item.key in selection.items) and rings_of(sketch, item.key)
    ]
    if selection.boundary and sketch.boundary is not None:
        owners.append(BOUNDARY)
    if not owners:
        raise MapError("select polygons, walls or the boundary first")
    return owners


def _simpler(rings: tuple[Ring, ...], tolerance: float, *, closed: bool) -> tuple[Ring, ...]:
    """Return the rings of one thing with fewer vertices; the vertices that stay are the same."""
    sound = _is_sound(rings, closed=closed)
    for step in range(_STEPS):
        fewer = tuple(_fewer(ring, tolerance / 2**step, closed=closed) for ring in rings)
        if _is_sound(fewer, closed=closed) >= sound:
            return fewer
    return rings


def _is_sound(rings: tuple[Ring, ...], *, closed: bool) -> bool:
    if not closed:
        return True
    return min(map(len, rings)) >= 3 and bool(Polygon(rings[0], rings[1:]).is_valid)


def _fewer(ring: Ring, tolerance: float, *, closed: bool) -> Ring:
    if len(set(ring)) < (4 if closed else 3):
        return ring
    if not closed:
        return tuple(LineString(ring).simplify(tolerance, preserve_topology=False).coords)
    # begin at a vertex that stays: the one farthest from the middle is a corner of the hull
    points = np.array(ring)
    first = int(np.hypot(*(points - points.mean(axis=0)).T).argmax())
    turned = np.roll(points, -first, axis=0)
    line = LineString(np.concatenate([turned, turned[:1]])).simplify(tolerance, preserve_topology=False)
    kept = [(float(x), float(y)) for x, y in line.coords[:-1]]
    if len(set(kept)) < 3 or not shapely.MultiPoint(kept).convex_hull.area > 0.0:
        return ring
    # in the order in which they were
    there = set(kept)
    return tuple(point for point in ring if point in there)


def _straight(ring: Ring, degrees: float, *, closed: bool) -> Ring:
    points = np.array(ring, dtype=float).reshape(-1, 2)
    if len(points) < 2:
        return ring
    edges = np.roll(points, -1, axis=0) - points
    if not closed:
        edges[-1] = np.nan
    slope = math.tan(math.radians(degrees))
    size = np.abs(edges)
    moved = points.copy()
    # level edges give their ends the same y, upright ones the same x
    for axis, flat in ((1, size[:, 1] <= slope * size[:, 0]), (0, size[:, 0] <= slope * size[:, 1])):
        for run in _runs(flat & (size.max(axis=1) > 0.0)):
            values = points[run, axis]
            moved[run, axis] = (values.min() + values.max()) / 2
    if closed and (len({tuple(p) for p in moved.tolist()}) < 3 or Polygon(moved).area == 0.0):
        return ring
    return ring_near(moved)


def _runs(flat: BoolArray) -> list[list[int]]:
    """Return the vertices of each run of edges of a ring that are flat, one after another."""
    count = len(flat)
    if flat.all():
        return []
    first = int(np.flatnonzero(~flat)[0]) + 1
    runs: list[list[int]] = []
    for k in (np.arange(first, first + count) % count).tolist():
        if not flat[k]:
            continue
        if not runs or runs[-1][-1] != k:
            runs.append([k])
        runs[-1].append((k + 1) % count)
    return runs
