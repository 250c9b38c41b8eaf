"""The nearest robot of every site, and the way to it: equation (22) without the mean.

Most sites see the robot that is nearest as the crow flies. The others are reached by way of a corner, or
from another robot in view that is nearer than that. Of robots that are equally far that of the lowest
number counts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import inner_kernel
from robocov.geodesic.distances import Graph, relax
from robocov.geodesic.visibility import AngularWallIndex, beyond_horizon, enter_walls, sees
from robocov.geodesic.walls import LEAF, Walls, near2, skipped, useful

GROUP = 16
"""Tiles that are looked at together first."""


class Tiles(NamedTuple):
    """The sites of a lattice in square tiles of at most 64, neighbours together, grid steps."""

    sites: Array
    """(m, 2) Where they are, by tile."""
    facts: IntArray
    """(m, 2) Their numbers in the lattice, and which component of the free space holds them."""
    first: IntArray
    """(t + 1,) The sites of a tile are those from its own `first` up to the next."""
    boxes: Array
    """(t, 4) Around the sites of each tile,"""
    groups: Array
    """around each `GROUP` tiles,"""
    tree: Array
    """and the `box_tree` of the first."""


class CornerViews(NamedTuple):
    """Which sites each corner sees, in rows of a corner and a tile, by tile."""

    first: IntArray
    """(t + 1,) The rows of a tile are those from its own `first` up to the next."""
    rows: IntArray
    """(r, 2) The corner, and a bit for each site of the tile: whether it is in useful view."""
    spans: Array
    """(r, 2) Distance of the nearest of these sites; of the farthest if all are in useful view, else inf."""


class Paths(NamedTuple):
    """The shortest ways to sites or corners."""

    distance: Array
    """(m,) grid steps, inf where none leads."""
    ways: IntArray
    """(m, 4) The robot where it begins, the corners where it bends first and last, -1 for none; and the robot
    that is nearest as the crow flies."""

    @classmethod
    def room(cls, m: int) -> Paths:
        """Return room for the ways to so many sites."""
        return cls(np.empty(m), np.empty((m, 4), np.int64))


@inner_kernel
def corner_views(
    walls: Walls, tiles: Tiles, begin: int, end: int, index: AngularWallIndex, rows: IntArray, spans: Array
) -> int:
    """Write what the corners from `begin` to `end` see: corner, tile, mask of a row, and its span.

    Return how many rows there are, -1 if there is no room.
    """
    corners, tree, used, leaves = walls.corners, tiles.tree, 0, len(tiles.tree) // 2
    for k in range(begin, end):
        if enter_walls(walls, index, 0, corners[k, 0], corners[k, 1], np.inf, 0) < 0:
            return -1
        node = 1
        while node:
            if tree[node, 0] == np.inf or beyond_horizon(tree, node, index, 0):
                node = skipped(node)
                continue
            if node < leaves:
                node *= 2
                continue
            leaf = (node - leaves) * LEAF
            for tile in range(leaf, min(leaf + LEAF, len(tiles.boxes))):
                if used == len(rows):
                    return -1
                if not beyond_horizon(tiles.boxes, tile, index, 0):
                    rows[used, 0], rows[used, 1] = k, tile
                    rows[used, 2] = _seen_sites(walls, index, tiles, k, tile, spans[used])
                    used += rows[used, 2] != 0
            node = skipped(node)
    return used


@inner_kernel
def _seen_sites(walls: Walls, index: AngularWallIndex, tiles: Tiles, k: int, tile: int, span: Array) -> int:
    """Return the mask of a tile's sites in useful view of a corner; write their span."""
    mask, bit, least, most = 0, 1, np.inf, 0.0
    for s in range(tiles.first[tile], tiles.first[tile + 1]):
        x, y = tiles.sites[s, 0], tiles.sites[s, 1]
        if useful(walls.corners, k, x, y) and sees(walls, index, 0, x, y):
            mask |= bit
            dx, dy = x - walls.corners[k, 0], y - walls.corners[k, 1]
            length = np.sqrt(dx * dx + dy * dy)
            least, most = min(least, length), max(most, length)
        else:
            most = np.inf
        bit <<= 1
    span[0], span[1] = least, most
    return mask


@inner_kernel
def _perhaps_nearest(boxes: Array, k: int, robots: Array, given: IntArray, count: int, out: IntArray) -> int:
    """Write which of `count` given robots may be nearest to a place in a box; return how many."""
    bound = np.inf
    for j in range(count):
        x, y = robots[given[j], 0], robots[given[j], 1]
        dx, dy = max(x - boxes[k, 0], boxes[k, 2] - x), max(y - boxes[k, 1], boxes[k, 3] - y)
        bound = min(bound, dx * dx + dy * dy)
    return _within(boxes, k, robots, bound, given, count, out)


@inner_kernel
def _within(
    boxes: Array, k: int, robots: Array, bound2: float, given: IntArray, count: int, out: IntArray
) -> int:
    """Write which of `count` given robots are not farther from a box than a bound; return how many."""
    found = 0
    for j in range(count):
        i = given[j]
        if near2(boxes, k, robots[i, 0], robots[i, 1]) <= bound2:
            out[found] = i
            found += 1
    return found


@inner_kernel
def _nearest_robot(
    x: float, y: float, robots: Array, given: IntArray, count: int, paths: Paths, k: int
) -> None:
    """Write the nearest of `count` given robots as the crow flies, of equals the first, and its distance."""
    best, nearest = np.inf, -1
    for j in range(count):
        dx, dy = x - robots[given[j], 0], y - robots[given[j], 1]
        if dx * dx + dy * dy < best:
            best, nearest = dx * dx + dy * dy, given[j]
    paths.distance[k], paths.ways[k, 0], paths.ways[k, 3] = np.sqrt(best), nearest, nearest
    paths.ways[k, 1], paths.ways[k, 2] = -1, -1


@inner_kernel
def _paths_to_corners(
    walls: Walls, graph: Graph, index: AngularWallIndex, robots: Array, lists: IntArray, queue: IntArray,
    paths: Paths,
) -> None:  # fmt: skip
    """Write the shortest ways to the corners."""
    corners, boxes, n = walls.corners, walls.corner_boxes, len(robots)
    everyone, some, leaves, waiting = lists[0], lists[1], len(walls.corner_boxes) // 2, 0
    for k in range(len(corners)):
        x, y = corners[k, 0], corners[k, 1]
        if k % LEAF == 0:
            near = _perhaps_nearest(boxes, leaves + k // LEAF, robots, everyone, n, some)
        _nearest_robot(x, y, robots, some, near, paths, k)
        i, queue[1, k] = paths.ways[k, 0], 0
        if useful(corners, k, robots[i, 0], robots[i, 1]) and sees(walls, index, i, x, y):
            paths.ways[k, 1] = k
            queue[0, waiting], queue[1, k] = k, 1
            waiting += 1
        else:
            paths.distance[k] = np.inf
    # few of the other robots matter once it is known how far the nearest one has to go, if not straight
    relax(graph, paths.distance, paths.ways, queue, waiting)
    waiting = 0
    for k in range(len(corners)):
        x, y = corners[k, 0], corners[k, 1]
        if k % LEAF == 0:
            bound = 0.0
            for j in range(k, min(k + LEAF, len(corners))):
                bound = max(bound, paths.distance[j])
            near = _within(boxes, leaves + k // LEAF, robots, bound * bound, everyone, n, some)
        for j in range(near):
            i = some[j]
            dx, dy = x - robots[i, 0], y - robots[i, 1]
            away, owner = np.sqrt(dx * dx + dy * dy), paths.ways[k, 0]
            if (
                i != paths.ways[k, 3]
                and (away < paths.distance[k] or (away == paths.distance[k] and i < owner))
                and useful(corners, k, robots[i, 0], robots[i, 1])
                and sees(walls, index, i, x, y)
            ):
                paths.distance[k], paths.ways[k, 0], paths.ways[k, 1], paths.ways[k, 2] = away, i, k, -1
                if not queue[1, k]:
                    queue[0, waiting], queue[1, k] = k, 1
                    waiting += 1
    relax(graph, paths.distance, paths.ways, queue, waiting)


@inner_kernel
def _by_corners(
    tiles: Tiles, views: CornerViews, corners: Array, to: Paths, tile: int, hidden: int, paths: Paths
) -> float:
    """Write the shortest ways to the hidden sites of a tile by a corner; return the longest of these."""
    # a row cannot be the best for any site of its tile where another one is better for all of them
    bound, begin = np.inf, tiles.first[tile]
    for row in range(views.first[tile], views.first[tile + 1]):
        bound = min(bound, to.distance[views.rows[row, 0]] + views.spans[row, 1])
    for row in range(views.first[tile], views.first[tile + 1]):
        k, mask = views.rows[row, 0], views.rows[row, 1] & hidden
        if mask == 0 or to.distance[k] + views.spans[row, 0] > bound or to.distance[k] == np.inf:
            continue
        for s in range(begin, tiles.first[tile + 1]):
            if (mask >> (s - begin)) & 1:
                dx, dy = tiles.sites[s, 0] - corners[k, 0], tiles.sites[s, 1] - corners[k, 1]
                total = to.distance[k] + np.sqrt(dx * dx + dy * dy)
                owner = to.ways[k, 0]
                if total < paths.distance[s] or (total == paths.distance[s] and owner < paths.ways[s, 0]):
                    paths.distance[s], paths.ways[s, 0], paths.ways[s, 1] = total, owner, to.ways[k, 1]
                    paths.ways[s, 2] = k
    farthest = 0.0
    for s in range(begin, tiles.first[tile + 1]):
        if (hidden >> (s - begin)) & 1:
            farthest = max(farthest, paths.distance[s])
    return farthest


@inner_kernel
def _from_others(
    walls: Walls, index: AngularWallIndex, robots: Array, x: float, y: float, some: IntArray, count: int,
    paths: Paths, s: int,
) -> None:  # fmt: skip
    """Write the straight way to a site from one of `count` robots, but for the nearest, if it is shorter."""
    for j in range(count):
        i = some[j]
        dx, dy = x - robots[i, 0], y - robots[i, 1]
        away = np.sqrt(dx * dx + dy * dy)
        if (
            i != paths.ways[s, 3]
            and (away < paths.distance[s] or (away == paths.distance[s] and i < paths.ways[s, 0]))
            and sees(walls, index, i, x, y)
        ):
            paths.distance[s], paths.ways[s, 0], paths.ways[s, 1], paths.ways[s, 2] = away, i, -1, -1


@inner_kernel
def _seen_from_nearest(
    walls: Walls, index: AngularWallIndex, tiles: Tiles, tile: int, covered: BoolArray, paths: Paths
) -> int:
    """Return the mask of the sites of a tile that do not see their nearest robot."""
    mask, bit = 0, 1
    for s in range(tiles.first[tile], tiles.first[tile + 1]):
        if not covered[tiles.facts[s, 1]]:
            paths.distance[s], paths.ways[s, 0] = np.inf, -1
        elif not sees(walls, index, paths.ways[s, 0], tiles.sites[s, 0], tiles.sites[s, 1]):
            mask |= bit
        bit <<= 1
    return mask


@inner_kernel
def _unhide(
    walls: Walls, tiles: Tiles, views: CornerViews, robots: Array, index: AngularWallIndex, lists: IntArray,
    hidden: IntArray, to_corners: Paths, paths: Paths,
) -> None:  # fmt: skip
    """Write the ways to the sites that do not see the robot that is nearest as the crow flies."""
    for group in range(len(tiles.groups)):
        begin, end, bound = group * GROUP, min(group * GROUP + GROUP, len(tiles.boxes)), -1.0
        for tile in range(begin, end):
            if hidden[tile]:
                first = tiles.first[tile]
                for s in range(first, tiles.first[tile + 1]):
                    if (hidden[tile] >> (s - first)) & 1:
                        paths.distance[s] = np.inf
                far = _by_corners(tiles, views, walls.corners, to_corners, tile, hidden[tile], paths)
                bound = max(bound, far)
        if bound < 0.0:
            continue
        # whoever else is nearer than by way of a corner may see the site
        near = _within(tiles.groups, group, robots, bound * bound, lists[0], len(robots), lists[1])
        for tile in range(begin, end):
            if hidden[tile]:
                first, bound = tiles.first[tile], 0.0
                for s in range(first, tiles.first[tile + 1]):
                    if (hidden[tile] >> (s - first)) & 1:
                        bound = max(bound, paths.distance[s])
                count = 0
                for j in range(near):
                    i = lists[1, j]
                    near_enough = near2(tiles.boxes, tile, robots[i, 0], robots[i, 1]) <= bound * bound
                    if near_enough and not beyond_horizon(tiles.boxes, tile, index, i):
                        lists[2, count] = i
                        count += 1
                for s in range(first, tiles.first[tile + 1]):
                    if (hidden[tile] >> (s - first)) & 1:
                        x, y = tiles.sites[s, 0], tiles.sites[s, 1]
                        _from_others(walls, index, robots, x, y, lists[2], count, paths, s)


@inner_kernel
def site_paths(
    walls: Walls, graph: Graph, tiles: Tiles, views: CornerViews, robots: Array, covered: BoolArray,
    index: AngularWallIndex, lists: IntArray, queue: IntArray, hidden: IntArray, to_corners: Paths,
    paths: Paths, unit: float, out_distance: Array, out_ways: IntArray,
) -> int:  # fmt: skip
    """Write the ways of the nearest of (n, 2) robots, which stand in the components that are `covered`.

    Parameters
    ----------
    lists : (3, n)
        For work, as are `queue`, (2, k + 1), `hidden`, (2, t), and the ways by tile.
    unit : float
        Length of a grid step.
    out_distance : (m,)
    out_ways : (3, m)
        As `Paths` has them, by site.

    Returns
    -------
    int
        Not negative if there was room in the index.
    """
    n, count = len(robots), len(tiles.boxes)
    for i in range(n):
        lists[0, i], index.sources[i, 2] = i, 0.0
    for tile in range(count):
        if tile % GROUP == 0:
            near = _perhaps_nearest(tiles.groups, tile // GROUP, robots, lists[0], n, lists[1])
        some = _perhaps_nearest(tiles.boxes, tile, robots, lists[1], near, lists[2])
        for s in range(tiles.first[tile], tiles.first[tile + 1]):
            _nearest_robot(tiles.sites[s, 0], tiles.sites[s, 1], robots, lists[2], some, paths, s)
            i = paths.ways[s, 0]
            index.sources[i, 2] = max(index.sources[i, 2], paths.distance[s])
    used = 0
    for i in range(n):
        reach = index.sources[i, 2] * (1.0 + 1e-9)
        used = enter_walls(walls, index, i, robots[i, 0], robots[i, 1], reach * reach, used)
        if used < 0:
            return -1
    any_hidden = False
    for tile in range(count):
        hidden[tile] = _seen_from_nearest(walls, index, tiles, tile, covered, paths)
        any_hidden = any_hidden or hidden[tile] != 0
    if any_hidden:
        _paths_to_corners(walls, graph, index, robots, lists, queue, to_corners)
        _unhide(walls, tiles, views, robots, index, lists, hidden, to_corners, paths)
    for s in range(len(paths.distance)):
        site = tiles.facts[s, 0]
        out_distance[site] = paths.distance[s] * unit
        for part in range(3):
            out_ways[part, site] = paths.ways[s, part]
    return used
