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

TILE = 4
"""Cells along a side of a tile."""

SLOTS = TILE * TILE

_FEW = 12
"""Robots of which it is known from the beginning what they see, however far: each is asked of most sites."""


class Tiles(NamedTuple):
    """The sites of a lattice in square tiles, neighbours together, grid steps; a tile need not be full."""

    places: Array
    """(2, t, SLOTS) x and y; of a slot without a site those of another one of the tile."""
    facts: IntArray
    """(2, t, SLOTS) Their numbers in the lattice, -1 without a site, and which component holds them."""
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
    """(r, 2) Distances of the nearest and the farthest of these sites."""


class Paths(NamedTuple):
    """The shortest ways to corners."""

    distance: Array
    """(k,) grid steps, inf where none leads."""
    ways: IntArray
    """(k, 4) The robot where it begins, the corners where it bends first and last, -1 for none; and the robot
    that is nearest as the crow flies."""


class TilePaths(NamedTuple):
    """The shortest ways to sites."""

    distance: Array
    """(t, SLOTS) grid steps, inf where none leads."""
    ways: IntArray
    """(3, t, SLOTS) The robot where it begins, the corner where it bends last, -1 for none; and the robot
    that is nearest as the crow flies."""


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
    mask, least, most = 0, np.inf, 0.0
    for s in range(SLOTS):
        x, y = tiles.places[0, tile, s], tiles.places[1, tile, s]
        if tiles.facts[0, tile, s] >= 0 and useful(walls.corners, k, x, y) and sees(walls, index, 0, x, y):
            mask |= 1 << s
            dx, dy = x - walls.corners[k, 0], y - walls.corners[k, 1]
            length = np.sqrt(dx * dx + dy * dy)
            least, most = min(least, length), max(most, length)
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
        best, i, queue[1, k] = np.inf, -1, 0
        for j in range(near):
            dx, dy = x - robots[some[j], 0], y - robots[some[j], 1]
            if dx * dx + dy * dy < best:
                best, i = dx * dx + dy * dy, some[j]
        paths.distance[k], paths.ways[k, 0], paths.ways[k, 3] = np.sqrt(best), i, i
        paths.ways[k, 1], paths.ways[k, 2] = -1, -1
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
def _nearest_robots(
    tiles: Tiles, tile: int, robots: Array, some: IntArray, count: int, paths: TilePaths
) -> None:
    """Write the nearest of `count` robots to the sites of a tile as the crow flies, of equals the first."""
    for s in range(SLOTS):
        paths.distance[tile, s] = np.inf
    for j in range(count):
        i = some[j]
        x, y = robots[i, 0], robots[i, 1]
        for s in range(SLOTS):
            dx, dy = tiles.places[0, tile, s] - x, tiles.places[1, tile, s] - y
            away2, best = dx * dx + dy * dy, paths.distance[tile, s]
            paths.ways[2, tile, s] = i if away2 < best else paths.ways[2, tile, s]
            paths.distance[tile, s] = away2 if away2 < best else best
    for s in range(SLOTS):
        paths.distance[tile, s] = np.sqrt(paths.distance[tile, s])
        paths.ways[0, tile, s], paths.ways[1, tile, s] = paths.ways[2, tile, s], -1


@inner_kernel
def _by_corners(
    tiles: Tiles, views: CornerViews, corners: Array, to: Paths, tile: int, hidden: int, paths: TilePaths
) -> float:
    """Write the shortest ways to the hidden sites of a tile by a corner; return the longest of these."""
    # a row cannot be the best for any of them where another one is better for all
    bound = np.inf
    for row in range(views.first[tile], views.first[tile + 1]):
        if hidden & ~views.rows[row, 1] == 0:
            bound = min(bound, to.distance[views.rows[row, 0]] + views.spans[row, 1])
    for row in range(views.first[tile], views.first[tile + 1]):
        k, mask = views.rows[row, 0], views.rows[row, 1] & hidden
        begin, owner = to.distance[k], to.ways[k, 0]
        if mask == 0 or begin + views.spans[row, 0] > bound or begin == np.inf:
            continue
        for s in range(SLOTS):
            if (mask >> s) & 1:
                dx, dy = tiles.places[0, tile, s] - corners[k, 0], tiles.places[1, tile, s] - corners[k, 1]
                total, best = begin + np.sqrt(dx * dx + dy * dy), paths.distance[tile, s]
                if total < best or (total == best and owner < paths.ways[0, tile, s]):
                    paths.distance[tile, s], paths.ways[0, tile, s], paths.ways[1, tile, s] = total, owner, k
    return _farthest(tile, hidden, paths)


@inner_kernel
def _farthest(tile: int, hidden: int, paths: TilePaths) -> float:
    """Return the longest of the ways to the hidden sites of a tile."""
    farthest = 0.0
    for s in range(SLOTS):
        if (hidden >> s) & 1:
            farthest = max(farthest, paths.distance[tile, s])
    return farthest


@inner_kernel
def _from_others(
    walls: Walls, index: AngularWallIndex, robots: Array, i: int, tiles: Tiles, tile: int, hidden: int,
    paths: TilePaths,
) -> None:  # fmt: skip
    """Write the straight ways from a robot to the hidden sites of a tile where they are the shortest."""
    for s in range(SLOTS):
        if (hidden >> s) & 1:
            x, y = tiles.places[0, tile, s], tiles.places[1, tile, s]
            dx, dy = x - robots[i, 0], y - robots[i, 1]
            away, best = np.sqrt(dx * dx + dy * dy), paths.distance[tile, s]
            if (
                (away < best or (away == best and i < paths.ways[0, tile, s]))
                and i != paths.ways[2, tile, s]
                and sees(walls, index, i, x, y)
            ):
                paths.distance[tile, s], paths.ways[0, tile, s], paths.ways[1, tile, s] = away, i, -1


@inner_kernel
def _seen_from_nearest(
    walls: Walls, index: AngularWallIndex, tiles: Tiles, tile: int, covered: BoolArray, paths: TilePaths
) -> int:
    """Return the mask of the sites of a tile that do not see their nearest robot."""
    mask = 0
    for s in range(SLOTS):
        if not covered[tiles.facts[1, tile, s]]:
            paths.distance[tile, s], paths.ways[0, tile, s] = np.inf, -1
        elif tiles.facts[0, tile, s] >= 0 and not sees(
            walls, index, paths.ways[2, tile, s], tiles.places[0, tile, s], tiles.places[1, tile, s]
        ):
            paths.distance[tile, s] = np.inf
            mask |= 1 << s
    return mask


@inner_kernel
def _unhide(
    walls: Walls, tiles: Tiles, views: CornerViews, robots: Array, index: AngularWallIndex, lists: IntArray,
    hidden: IntArray, to_corners: Paths, paths: TilePaths,
) -> None:  # fmt: skip
    """Write the ways to the sites that do not see the robot that is nearest as the crow flies."""
    for group in range(len(tiles.groups)):
        begin, end, bound = group * GROUP, min(group * GROUP + GROUP, len(tiles.boxes)), -1.0
        for tile in range(begin, end):
            if hidden[tile]:
                far = _by_corners(tiles, views, walls.corners, to_corners, tile, hidden[tile], paths)
                bound = max(bound, far)
        if bound < 0.0:
            continue
        # whoever else is nearer than by way of a corner may see the site
        near = _within(tiles.groups, group, robots, bound * bound, lists[0], len(robots), lists[1])
        for tile in range(begin, end):
            if hidden[tile]:
                bound = _farthest(tile, hidden[tile], paths)
                for j in range(near):
                    i = lists[1, j]
                    near_enough = near2(tiles.boxes, tile, robots[i, 0], robots[i, 1]) <= bound * bound
                    if near_enough and not beyond_horizon(tiles.boxes, tile, index, i):
                        _from_others(walls, index, robots, i, tiles, tile, hidden[tile], paths)


@inner_kernel
def _team_paths(
    walls: Walls, graph: Graph, tiles: Tiles, views: CornerViews, robots: Array, covered: BoolArray,
    index: AngularWallIndex, lists: IntArray, queue: IntArray, hidden: IntArray, to_corners: Paths,
    paths: TilePaths,
) -> int:  # fmt: skip
    """Write the ways of the nearest of (n, 2) robots; return a number that is negative without room."""
    n, count = len(robots), len(tiles.boxes)
    for i in range(n):
        lists[0, i], index.sources[i, 2] = i, 0.0
    for tile in range(count):
        if tile % GROUP == 0:
            near = _perhaps_nearest(tiles.groups, tile // GROUP, robots, lists[0], n, lists[1])
        some = _perhaps_nearest(tiles.boxes, tile, robots, lists[1], near, lists[2])
        _nearest_robots(tiles, tile, robots, lists[2], some, paths)
        for s in range(SLOTS):
            i = paths.ways[2, tile, s]
            index.sources[i, 2] = max(index.sources[i, 2], paths.distance[tile, s])
    used = 0
    for i in range(n):
        reach = index.sources[i, 2] * (1.0 + 1e-9) if n > _FEW else np.inf
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
    return used


@inner_kernel
def site_paths(
    walls: Walls, graph: Graph, tiles: Tiles, views: CornerViews, teams: Array, covered: BoolArray,
    index: AngularWallIndex, lists: IntArray, queue: IntArray, hidden: IntArray, to_corners: Paths,
    paths: TilePaths, unit: float, distances: Array, ways: IntArray,
) -> int:  # fmt: skip
    """Write the ways of the nearest robots of each of some teams.

    Parameters
    ----------
    teams : (r, n, 2)
    covered : (r, c)
        Which components of the free space hold robots of each.
    lists : (3, n)
        For work, as are `queue`, (2, k + 1), `hidden`, (t,), and the ways to corners and by tile.
    unit : float
        Length of a grid step.
    distances : (r, m)
    ways : (r, 3, m)
        The robot where each way begins, the corners where it bends first and last, -1 for none, by site.

    Returns
    -------
    int
        Not negative if there was room in the index.
    """
    used = 0
    for r in range(len(teams)):
        used = _team_paths(
            walls, graph, tiles, views, teams[r], covered[r], index, lists, queue, hidden, to_corners, paths
        )  # fmt: skip
        if used < 0:
            break
        for tile in range(len(tiles.boxes)):
            for s in range(SLOTS):
                site, last = tiles.facts[0, tile, s], paths.ways[1, tile, s]
                if site >= 0:
                    distances[r, site] = paths.distance[tile, s] * unit
                    ways[r, 0, site], ways[r, 2, site] = paths.ways[0, tile, s], last
                    ways[r, 1, site] = to_corners.ways[last, 1] if last >= 0 else -1
    return used
