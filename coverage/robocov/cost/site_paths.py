"""The nearest robot of every site, and the way to it: equation (22) without the mean.

Most sites see the robot that is nearest as the crow flies. The others are reached by way of a corner, or from
another robot in view that is nearer than that.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import inlined_kernel, inner_kernel, kernel
from robocov.geodesic.corners import useful
from robocov.geodesic.distances import BINS, CORNER_BINS, Scene, relax
from robocov.geodesic.visibility import LEAF, Boxes, Fans, beyond_horizon, fans_of, near2, sees, skipped

if TYPE_CHECKING:
    from robocov.geodesic.distances import Scene
    from robocov.geodesic.visibility import Fans

GROUP = 16
"""Tiles that are looked at together first."""

_FEW = 1 << 13
"""Pairs of robots and walls that are few enough to look at all."""


class Tiles(NamedTuple):
    """The sites of a lattice in square tiles, neighbours together, grid steps."""

    site: IntArray
    """(m,) Their numbers in the lattice, by tile."""
    x: Array
    y: Array
    slot: IntArray
    """(m,) The place among the cells of the tile."""
    component: IntArray
    """(m,) Which component of the free space holds the site."""
    first: IntArray
    """(t + 1,) The sites of a tile are those from its own `first` up to the next."""
    boxes: Boxes
    """(t,) Around the sites of each tile,"""
    groups: Boxes
    """around each `GROUP` tiles,"""
    tree: Boxes
    """and the tree of the first."""


class CornerViews(NamedTuple):
    """Which sites each corner sees, in rows of a corner and a tile, by tile."""

    first: IntArray
    """(t + 1,) The rows of a tile are those from its own `first` up to the next."""
    corner: IntArray
    mask: IntArray
    """A bit for each slot: whether the site is in useful view."""
    least: Array
    """Distance of the nearest of these sites, grid steps."""
    most: Array
    """That of the farthest site if all are in useful view, else inf."""


@inner_kernel
def _seen_sites(scene: Scene, tiles: Tiles, fans: Fans, k: int, tile: int, least_most: Array) -> int:
    """Return the mask of a tile's sites in useful view of a corner; write their least and most distance."""
    x, y = scene.corners.x[k], scene.corners.y[k]
    mask, least, most = 0, np.inf, 0.0
    for s in range(tiles.first[tile], tiles.first[tile + 1]):
        dx, dy = tiles.x[s] - x, tiles.y[s] - y
        if useful(scene.corners, k, tiles.x[s], tiles.y[s]) and sees(
            scene.tree, fans, 0, tiles.x[s], tiles.y[s]
        ):
            mask |= 1 << tiles.slot[s]
            length = np.sqrt(dx * dx + dy * dy)
            least, most = min(least, length), max(most, length)
        else:
            most = np.inf
    least_most[0], least_most[1] = least, most
    return mask


@inner_kernel
def _perhaps_seen(scene: Scene, tiles: Tiles, fans: Fans, k: int, out: IntArray) -> int:
    """Write the tiles that are not beyond the horizon of a corner; return how many."""
    x, y, horizon = scene.corners.x[k], scene.corners.y[k], fans.horizon[0]
    boxes, leaves, found, node = tiles.tree, len(tiles.tree.low_x) // 2, 0, 1
    while node:
        if boxes.low_x[node] == np.inf or beyond_horizon(boxes, node, x, y, horizon):
            node = skipped(node)
            continue
        if node < leaves:
            node *= 2
            continue
        leaf = (node - leaves) * LEAF
        for tile in range(leaf, min(leaf + LEAF, len(tiles.first) - 1)):
            if not beyond_horizon(tiles.boxes, tile, x, y, horizon):
                out[found] = tile
                found += 1
        node = skipped(node)
    return found


@kernel
def looked_for(scene: Scene, tiles: Tiles, begin: int, end: int) -> tuple[IntArray, Array]:
    """Return the rows of the corners from `begin` to `end`: corner, tile, mask; least, most."""
    corners, reach, some = scene.corners, np.full(1, np.inf), np.empty(len(tiles.first), dtype=np.int64)
    rows, lengths, used = np.empty((64, 3), dtype=np.int64), np.empty((64, 2)), 0
    for k in range(begin, end):
        fans = fans_of(scene.tree, corners.x[k : k + 1], corners.y[k : k + 1], reach, CORNER_BINS)
        count = _perhaps_seen(scene, tiles, fans, k, some)
        if used + count > len(rows):
            more, further = np.empty((2 * used + count, 3), dtype=np.int64), np.empty((2 * used + count, 2))
            more[:used], further[:used] = rows[:used], lengths[:used]
            rows, lengths = more, further
        for tile in some[:count]:
            mask = _seen_sites(scene, tiles, fans, k, tile, lengths[used])
            if mask:
                rows[used, 0], rows[used, 1], rows[used, 2] = k, tile, mask
                used += 1
    return rows[:used], lengths[:used]


@inner_kernel
def _perhaps_nearest(
    boxes: Boxes, k: int, x: Array, y: Array, given: IntArray, count: int, out: IntArray
) -> int:
    """Write which of `count` given robots may be nearest to a place in a box; return how many."""
    bound = np.inf
    for j in range(count):
        i = given[j]
        dx = max(x[i] - boxes.low_x[k], boxes.high_x[k] - x[i])
        dy = max(y[i] - boxes.low_y[k], boxes.high_y[k] - y[i])
        bound = min(bound, dx * dx + dy * dy)
    found = 0
    for j in range(count):
        if near2(boxes, k, x[given[j]], y[given[j]]) <= bound:
            out[found] = given[j]
            found += 1
    return found


@inner_kernel
def _within(
    boxes: Boxes, k: int, x: Array, y: Array, bound2: float, given: IntArray, count: int, out: IntArray
) -> int:
    """Write which of `count` given robots are nearer to a box than a bound; return how many."""
    found = 0
    for j in range(count):
        if near2(boxes, k, x[given[j]], y[given[j]]) < bound2:
            out[found] = given[j]
            found += 1
    return found


@inlined_kernel
def _nearest(px: float, py: float, x: Array, y: Array, given: IntArray, count: int) -> tuple[int, float]:
    """Return the nearest of `count` given robots, of equals the first, and its squared distance."""
    best, nearest = np.inf, given[0]
    for j in range(count):
        dx, dy = px - x[given[j]], py - y[given[j]]
        if dx * dx + dy * dy < best:
            best, nearest = dx * dx + dy * dy, given[j]
    return nearest, best


@kernel
def _nearest_of_sites(tiles: Tiles, x: Array, y: Array) -> tuple[IntArray, Array]:
    """Return the robot that is nearest to each site as the crow flies, and its squared distance."""
    m, n = len(tiles.x), len(x)
    owner, away2 = np.empty(m, dtype=np.int64), np.empty(m)
    everyone = np.arange(n)
    some, few = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    for tile in range(len(tiles.first) - 1):
        if tile % GROUP == 0:
            near = _perhaps_nearest(tiles.groups, tile // GROUP, x, y, everyone, n, some)
        count = _perhaps_nearest(tiles.boxes, tile, x, y, some, near, few)
        for s in range(tiles.first[tile], tiles.first[tile + 1]):
            owner[s], away2[s] = _nearest(tiles.x[s], tiles.y[s], x, y, few, count)
    return owner, away2


@inner_kernel
def _corners_seen_from_nearest(
    scene: Scene, fans: Fans, leaf: int, some: IntArray, near: int, owner: IntArray, distance: Array
) -> None:
    """Write the nearest robot of each corner of a leaf, and its distance if it is in useful view."""
    corners = scene.corners
    for k in scene.order[leaf * LEAF : (leaf + 1) * LEAF]:
        i, away2 = _nearest(corners.x[k], corners.y[k], fans.x, fans.y, some, near)
        owner[k] = i
        if useful(corners, k, fans.x[i], fans.y[i]) and sees(scene.tree, fans, i, corners.x[k], corners.y[k]):
            distance[k] = np.sqrt(away2)


@inner_kernel
def _corners_seen_from_others(
    scene: Scene, fans: Fans, leaf: int, some: IntArray, near: int, owner: IntArray, distance: Array,
    before: IntArray,
) -> None:  # fmt: skip
    """Write which other robots see the corners of a leaf, and are nearer than has been found."""
    corners = scene.corners
    for k in scene.order[leaf * LEAF : (leaf + 1) * LEAF]:
        nearest = owner[k]
        for i in some[:near]:
            dx, dy = corners.x[k] - fans.x[i], corners.y[k] - fans.y[i]
            away = np.sqrt(dx * dx + dy * dy)
            if (
                away < distance[k] and i != nearest and useful(corners, k, fans.x[i], fans.y[i])
                and sees(scene.tree, fans, i, corners.x[k], corners.y[k])
            ):  # fmt: skip
                distance[k], owner[k], before[k] = away, i, -1


@kernel
def _to_corners(scene: Scene, fans: Fans) -> tuple[Array, IntArray, IntArray]:
    """Return the distance of each corner from the nearest robot, that robot, and the corner before, or -1."""
    boxes, x, y = scene.boxes, fans.x, fans.y
    count, n, leaves = len(scene.order), len(x), len(boxes.low_x) // 2
    distance, before, owner = np.full(count, np.inf), np.full(count, -1), np.full(count, -1)
    everyone, some = np.arange(n), np.empty(n, dtype=np.int64)
    for leaf in range((count + LEAF - 1) // LEAF):
        near = _perhaps_nearest(boxes, leaves + leaf, x, y, everyone, n, some)
        _corners_seen_from_nearest(scene, fans, leaf, some, near, owner, distance)
    # few of the other robots matter once it is known how far the nearest one has to go, if not straight
    relax(scene.graph, distance, before)
    for leaf in range((count + LEAF - 1) // LEAF):
        bound = distance[scene.order[leaf * LEAF : (leaf + 1) * LEAF]].max()
        near = _within(boxes, leaves + leaf, x, y, bound * bound, everyone, n, some)
        _corners_seen_from_others(scene, fans, leaf, some, near, owner, distance, before)
    relax(scene.graph, distance, before)
    return distance, owner, before


@inner_kernel
def _by_corners(
    tiles: Tiles, views: CornerViews, corner_x: Array, corner_y: Array, away: Array, tile: int,
    hidden: BoolArray, distance: Array, last: IntArray,
) -> None:  # fmt: skip
    """Write the least distance of the hidden sites of a tile by way of a corner, and that corner."""
    rows = range(views.first[tile], views.first[tile + 1])
    # a row cannot be the best for any site of its tile where another one is better for all of them
    bound = np.inf
    for row in rows:
        bound = min(bound, away[views.corner[row]] + views.most[row])
    for row in rows:
        k = views.corner[row]
        if away[k] == np.inf or away[k] + views.least[row] > bound:
            continue
        for s in range(tiles.first[tile], tiles.first[tile + 1]):
            if hidden[s] and (views.mask[row] >> tiles.slot[s]) & 1:
                dx, dy = tiles.x[s] - corner_x[k], tiles.y[s] - corner_y[k]
                total = away[k] + np.sqrt(dx * dx + dy * dy)
                if total < distance[s]:
                    distance[s], last[s] = total, k


@kernel
def _first_corners(before: IntArray) -> IntArray:
    """Return where the way to each corner bends first."""
    first = np.empty(len(before), dtype=np.int64)
    for k in range(len(before)):
        at = k
        while before[at] >= 0:
            at = before[at]
        first[k] = at
    return first


@inner_kernel
def _seen_from_nearest(
    scene: Scene, tiles: Tiles, fans: Fans, covered: BoolArray, owner: IntArray, distance: Array,
    hidden: BoolArray,
) -> bool:  # fmt: skip
    """Mark the sites that do not see their nearest robot; return whether there are any."""
    any_hidden = False
    for s in range(len(distance)):
        if not covered[tiles.component[s]]:
            owner[s], distance[s] = -1, np.inf
        elif not sees(scene.tree, fans, owner[s], tiles.x[s], tiles.y[s]):
            hidden[s], any_hidden, distance[s] = True, True, np.inf
    return any_hidden


@inner_kernel
def _farthest(tiles: Tiles, begin: int, end: int, hidden: BoolArray, distance: Array) -> float:
    """Return the largest distance of a hidden site of the tiles from `begin` to `end`."""
    bound = 0.0
    for s in range(tiles.first[begin], tiles.first[end]):
        if hidden[s]:
            bound = max(bound, distance[s])
    return bound


@inner_kernel
def _seen_from_others(
    scene: Scene, tiles: Tiles, fans: Fans, s: int, some: IntArray, count: int, nearest: int,
    owner: IntArray, distance: Array,
) -> bool:  # fmt: skip
    """Return whether one of `count` robots, but for the nearest, sees a site and is nearer than any found."""
    found = False
    for i in some[:count]:
        dx, dy = tiles.x[s] - fans.x[i], tiles.y[s] - fans.y[i]
        away = np.sqrt(dx * dx + dy * dy)
        if away < distance[s] and i != nearest and sees(scene.tree, fans, i, tiles.x[s], tiles.y[s]):
            distance[s], owner[s], found = away, i, True
    return found


@kernel
def site_paths(
    scene: Scene, tiles: Tiles, views: CornerViews, x: Array, y: Array, covered: BoolArray
) -> tuple[Array, IntArray, IntArray, IntArray]:
    """Return the ways of the nearest of (n,) robots, which stand in the components that are `covered`.

    Returns
    -------
    distance : (m,) grid steps
        inf where none can come.
    owner : (m,)
        That robot, -1 where none can come.
    first, last : (m,)
        The corners where its way bends first and last, -1 where it is straight.
    """
    m, n = len(tiles.x), len(x)
    owner, away2 = _nearest_of_sites(tiles, x, y)
    reach = np.zeros(n)
    for s in range(m):
        reach[owner[s]] = max(reach[owner[s]], away2[s])
    # some walls beyond the own sites save second looks; with few walls that costs more than all of them
    reach = np.sqrt(reach) * (1.0 + 1e-9) + np.sqrt(reach).mean()
    if n * len(scene.tree.ax) <= _FEW:
        reach[:] = np.inf
    fans = fans_of(scene.tree, x, y, reach, BINS)
    distance, hidden = np.sqrt(away2), np.zeros(m, dtype=np.bool_)
    first, last = np.full(m, -1), np.full(m, -1)
    if _seen_from_nearest(scene, tiles, fans, covered, owner, distance, hidden):
        away, corner_owner, before = _to_corners(scene, fans)
        bends = _first_corners(before)
        everyone = np.arange(n)
        some, few = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
        corner_x, corner_y = scene.corners.x, scene.corners.y
        for tile in range(len(tiles.first) - 1):
            if tile % GROUP == 0:
                end = min(tile + GROUP, len(tiles.first) - 1)
                for member in range(tile, end):
                    _by_corners(tiles, views, corner_x, corner_y, away, member, hidden, distance, last)
                # whoever else is nearer than by way of a corner may see the site
                bound = _farthest(tiles, tile, end, hidden, distance)
                near = _within(tiles.groups, tile // GROUP, x, y, bound * bound, everyone, n, some)
            bound = _farthest(tiles, tile, tile + 1, hidden, distance)
            count = _within(tiles.boxes, tile, x, y, bound * bound, some, near, few)
            for s in range(tiles.first[tile], tiles.first[tile + 1]):
                if hidden[s]:
                    nearest = owner[s]
                    if last[s] >= 0:
                        first[s] = bends[last[s]]
                        owner[s] = corner_owner[first[s]]
                    if _seen_from_others(scene, tiles, fans, s, few, count, nearest, owner, distance):
                        first[s], last[s] = -1, -1
    site = tiles.site
    out_distance, out = np.empty(m), np.empty((3, m), dtype=np.int64)
    for s in range(m):
        out_distance[site[s]] = distance[s]
        out[0, site[s]], out[1, site[s]], out[2, site[s]] = owner[s], first[s], last[s]
    return out_distance, out[0], out[1], out[2]
