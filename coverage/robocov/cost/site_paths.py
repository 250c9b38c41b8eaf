"""The nearest robot of every site, and the way to it: equation (22) without the mean.

Most sites see the robot that is nearest as the crow flies. The others are reached by way of a corner, or
from another robot in view that is nearer than that. Of robots that are equally far that of the lowest
number counts.
"""

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.geodesic import Graph, relax
from robocov.geodesic.angular_index import AngularWallIndex, add_walls, is_box_hidden, is_visible
from robocov.geodesic.walls import (
    LEAF_SIZE,
    Walls,
    can_bend_at_corner,
    compute_squared_box_distance,
    skip_subtree,
)

GROUP = 16
"""Tiles that are looked at together first."""

TILE = 4
"""Cells along a side of a tile."""

SLOTS = TILE**2

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
    """and the `build_box_tree` of the first."""


class CornerViews(NamedTuple):
    """Sites visible from each corner, in rows of one corner and one tile, sorted by tile."""

    first: IntArray
    """(t + 1,) The rows of a tile are those from its own `first` up to the next."""
    rows: IntArray
    """(r, 2) The corner, and a bit for each site of the tile: whether it is in useful view."""
    spans: Array
    """(r, 2) Distances of the nearest and the farthest of these sites."""


class CostMap(NamedTuple):
    """All that is known before the robots."""

    walls: Walls
    graph: Graph
    tiles: Tiles
    views: CornerViews


class Work(NamedTuple):
    """The search from n robots: room for it, and in the end the shortest ways."""

    sight: AngularWallIndex
    """Visible walls of each robot."""
    lists: IntArray
    """(3, n) Robots: all of them, those near a group of tiles, those near a tile."""
    queue: IntArray
    """(2, k + 1) See `relax`."""
    hidden: IntArray
    """(t,) A bit for each site of a tile: whether it does not see its nearest robot."""
    to_corners: Array
    """(k,) Length of the way to each corner, grid steps, inf where none leads."""
    corner_ways: IntArray
    """(k, 3) The robot where it begins, the corners where it bends first and last, -1 for none."""
    to_sites: Array
    """(t, SLOTS) Length of the way to each site, grid steps, inf where none leads."""
    ways: IntArray
    """(3, t, SLOTS) The robot where it begins, the corner where it bends last, -1 for none; and the robot
    that is nearest as the crow flies."""


@kernel
def corner_views(
    walls: Walls, tiles: Tiles, begin: int, end: int, index: AngularWallIndex, rows: IntArray, spans: Array
) -> int:
    """Write what the corners from `begin` to `end` see: corner, tile, mask of a row, and its span.

    Return how many rows there are, -1 if there is no room.
    """
    corners, tree, used, leaves = walls.corners, tiles.tree, 0, len(tiles.tree) // 2
    for k in range(begin, end):
        if add_walls(walls, index, 0, corners[k, 0], corners[k, 1], np.inf, 0) < 0:
            return -1
        node = 1
        while node:
            if tree[node, 0] == np.inf or is_box_hidden(tree, node, index, 0):
                node = skip_subtree(node)
                continue
            if node < leaves:
                node *= 2
                continue
            leaf = (node - leaves) * LEAF_SIZE
            for tile in range(leaf, min(leaf + LEAF_SIZE, len(tiles.boxes))):
                if used == len(rows):
                    return -1
                if not is_box_hidden(tiles.boxes, tile, index, 0):
                    rows[used, 0], rows[used, 1] = k, tile
                    rows[used, 2] = _seen_sites(walls, index, tiles, k, tile, spans[used])
                    used += rows[used, 2] != 0
            node = skip_subtree(node)
    return used


@kernel
def _seen_sites(walls: Walls, index: AngularWallIndex, tiles: Tiles, k: int, tile: int, span: Array) -> int:
    """Return the mask of a tile's sites in useful view of a corner; write their span."""
    mask, least, most = 0, np.inf, 0.0
    for s in range(SLOTS):
        x, y = tiles.places[0, tile, s], tiles.places[1, tile, s]
        if (
            tiles.facts[0, tile, s] >= 0
            and can_bend_at_corner(walls.corners, k, x, y)
            and is_visible(walls, index, 0, x, y)
        ):
            mask |= 1 << s
            dx, dy = x - walls.corners[k, 0], y - walls.corners[k, 1]
            length = np.sqrt(dx * dx + dy * dy)
            least, most = min(least, length), max(most, length)
    span[0], span[1] = least, most
    return mask


@kernel
def _perhaps_nearest(
    boxes: Array, k: int, index: AngularWallIndex, given: IntArray, count: int, out: IntArray
) -> int:
    """Write which of `count` given robots may be nearest to a place in a box; return how many."""
    bound2 = np.inf
    for j in range(count):
        x, y = index.sources[given[j], 0], index.sources[given[j], 1]
        dx, dy = max(x - boxes[k, 0], boxes[k, 2] - x), max(y - boxes[k, 1], boxes[k, 3] - y)
        bound2 = min(bound2, dx * dx + dy * dy)
    return _within(boxes, k, index, bound2, given, count, out)


@kernel
def _within(
    boxes: Array, k: int, index: AngularWallIndex, bound2: float, given: IntArray, count: int, out: IntArray
) -> int:
    """Write which of `count` given robots are not farther from a box than a bound; return how many."""
    found = 0
    for j in range(count):
        i = given[j]
        if compute_squared_box_distance(boxes, k, index.sources[i, 0], index.sources[i, 1]) <= bound2:
            out[found] = i
            found += 1
    return found


@kernel
def _paths_to_corners(known: CostMap, work: Work) -> None:
    """Write the shortest ways to the corners."""
    corners, boxes, n = known.walls.corners, known.walls.corner_boxes, len(work.sight.sources)
    everyone, some, leaves, waiting = work.lists[0], work.lists[1], len(boxes) // 2, 0
    index, queue, distance, ways = work.sight, work.queue, work.to_corners, work.corner_ways
    for k in range(len(corners)):
        if k % LEAF_SIZE == 0:
            near = _perhaps_nearest(boxes, leaves + k // LEAF_SIZE, index, everyone, n, some)
        best, nearest = np.inf, -1
        for j in range(near):
            dx, dy = corners[k, 0] - index.sources[some[j], 0], corners[k, 1] - index.sources[some[j], 1]
            if dx * dx + dy * dy < best:
                best, nearest = dx * dx + dy * dy, some[j]
        distance[k], ways[k, 0], queue[1, k] = np.inf, n, 0
        waiting = _straight_to_corner(known.walls, work, k, nearest, waiting)
    # few of the other robots matter once it is known how far the nearest one has to go, if not straight
    relax(known.graph, distance, ways, queue, waiting)
    waiting = 0
    for k in range(len(corners)):
        if k % LEAF_SIZE == 0:
            bound = 0.0
            for j in range(k, min(k + LEAF_SIZE, len(corners))):
                bound = max(bound, distance[j])
            near = _within(boxes, leaves + k // LEAF_SIZE, index, bound * bound, everyone, n, some)
        for j in range(near):
            waiting = _straight_to_corner(known.walls, work, k, some[j], waiting)
    relax(known.graph, distance, ways, queue, waiting)


@kernel
def _straight_to_corner(walls: Walls, work: Work, k: int, i: int, waiting: int) -> int:
    """Write the straight way from a robot to a corner if it is the shortest; return how many then wait."""
    distance, ways, x, y = work.to_corners, work.corner_ways, walls.corners[k, 0], walls.corners[k, 1]
    from_x, from_y = work.sight.sources[i, 0], work.sight.sources[i, 1]
    away = np.sqrt((x - from_x) * (x - from_x) + (y - from_y) * (y - from_y))
    if (
        (away < distance[k] or (away == distance[k] and i < ways[k, 0]))
        and can_bend_at_corner(walls.corners, k, from_x, from_y)
        and is_visible(walls, work.sight, i, x, y)
    ):
        distance[k], ways[k, 0], ways[k, 1], ways[k, 2] = away, i, k, -1
        if not work.queue[1, k]:
            work.queue[0, waiting], work.queue[1, k] = k, 1
            waiting += 1
    return waiting


@kernel
def _nearest_robots(tiles: Tiles, tile: int, count: int, work: Work) -> None:
    """Write the nearest of `count` robots to the sites of a tile as the crow flies, of equals the first."""
    to_sites, ways, sources = work.to_sites, work.ways, work.sight.sources
    for s in range(SLOTS):
        to_sites[tile, s] = np.inf
    for j in range(count):
        i = work.lists[2, j]
        x, y = sources[i, 0], sources[i, 1]
        for s in range(SLOTS):
            dx, dy = tiles.places[0, tile, s] - x, tiles.places[1, tile, s] - y
            away2, best = dx * dx + dy * dy, to_sites[tile, s]
            ways[2, tile, s] = i if away2 < best else ways[2, tile, s]
            to_sites[tile, s] = away2 if away2 < best else best
    for s in range(SLOTS):
        i, away = ways[2, tile, s], np.sqrt(to_sites[tile, s])
        to_sites[tile, s], ways[0, tile, s], ways[1, tile, s] = away, i, -1
        sources[i, 2] = max(sources[i, 2], away)


@kernel
def _hide(known: CostMap, work: Work, tile: int, covered: BoolArray) -> bool:
    """Note which sites of a tile do not see their nearest robot; return whether there are any."""
    facts, to_sites, ways, mask = known.tiles.facts, work.to_sites, work.ways, 0
    for s in range(SLOTS):
        i, x, y = ways[2, tile, s], known.tiles.places[0, tile, s], known.tiles.places[1, tile, s]
        if not covered[facts[1, tile, s]]:
            to_sites[tile, s], ways[0, tile, s] = np.inf, -1
        elif facts[0, tile, s] >= 0 and not is_visible(known.walls, work.sight, i, x, y):
            to_sites[tile, s] = np.inf
            mask |= 1 << s
    work.hidden[tile] = mask
    return mask != 0


@kernel
def _by_corners(known: CostMap, work: Work, tile: int) -> None:
    """Write the shortest ways to the hidden sites of a tile by a corner."""
    places, views, corners = known.tiles.places, known.views, known.walls.corners
    to_sites, ways, hidden, bound = work.to_sites, work.ways, work.hidden[tile], np.inf
    # a row cannot be the best for any of them where another one is better for all
    for row in range(views.first[tile], views.first[tile + 1]):
        if hidden & ~views.rows[row, 1] == 0:
            bound = min(bound, work.to_corners[views.rows[row, 0]] + views.spans[row, 1])
    for row in range(views.first[tile], views.first[tile + 1]):
        k, mask = views.rows[row, 0], views.rows[row, 1] & hidden
        begin, owner = work.to_corners[k], work.corner_ways[k, 0]
        if mask == 0 or begin + views.spans[row, 0] > bound or begin == np.inf:
            continue
        for s in range(SLOTS):
            if (mask >> s) & 1:
                dx, dy = places[0, tile, s] - corners[k, 0], places[1, tile, s] - corners[k, 1]
                total, best = begin + np.sqrt(dx * dx + dy * dy), to_sites[tile, s]
                if total < best or (total == best and owner < ways[0, tile, s]):
                    to_sites[tile, s], ways[0, tile, s], ways[1, tile, s] = total, owner, k


@kernel
def _farthest(work: Work, tile: int) -> float:
    """Return the longest of the ways to the hidden sites of a tile."""
    hidden, farthest = work.hidden[tile], 0.0
    for s in range(SLOTS):
        if (hidden >> s) & 1:
            farthest = max(farthest, work.to_sites[tile, s])
    return farthest


@kernel
def _from_another(known: CostMap, work: Work, tile: int, i: int) -> None:
    """Write the straight ways from a robot to the hidden sites of a tile where they are the shortest."""
    to_sites, ways, index, hidden = work.to_sites, work.ways, work.sight, work.hidden[tile]
    from_x, from_y = index.sources[i, 0], index.sources[i, 1]
    for s in range(SLOTS):
        if (hidden >> s) & 1:
            x, y = known.tiles.places[0, tile, s], known.tiles.places[1, tile, s]
            dx, dy = x - from_x, y - from_y
            away, best = np.sqrt(dx * dx + dy * dy), to_sites[tile, s]
            if (
                (away < best or (away == best and i < ways[0, tile, s]))
                and i != ways[2, tile, s]
                and is_visible(known.walls, index, i, x, y)
            ):
                to_sites[tile, s], ways[0, tile, s], ways[1, tile, s] = away, i, -1


@kernel
def _unhide(known: CostMap, work: Work) -> None:
    """Write the ways to the sites that do not see the robot that is nearest as the crow flies."""
    tiles, index, lists = known.tiles, work.sight, work.lists
    for group in range(len(tiles.groups)):
        begin, end, bound = group * GROUP, min(group * GROUP + GROUP, len(tiles.boxes)), -1.0
        for tile in range(begin, end):
            if work.hidden[tile]:
                _by_corners(known, work, tile)
                bound = max(bound, _farthest(work, tile))
        if bound < 0.0:
            continue
        # whoever else is nearer than by way of a corner may see the site
        near = _within(tiles.groups, group, index, bound * bound, lists[0], len(index.sources), lists[1])
        for tile in range(begin, end):
            if work.hidden[tile]:
                bound = _farthest(work, tile)
                some = _within(tiles.boxes, tile, index, bound * bound, lists[1], near, lists[2])
                for j in range(some):
                    if not is_box_hidden(tiles.boxes, tile, index, lists[2, j]):
                        _from_another(known, work, tile, lists[2, j])


@kernel
def _team_paths(known: CostMap, work: Work, robots: Array, covered: BoolArray) -> bool:
    """Write the ways of the nearest of (n, 2) robots; return whether there was room for what they see."""
    tiles, index, lists, n = known.tiles, work.sight, work.lists, len(robots)
    for i in range(n):
        lists[0, i], index.sources[i, 2] = i, 0.0
        index.sources[i, 0], index.sources[i, 1] = robots[i, 0], robots[i, 1]
    for tile in range(len(tiles.boxes)):
        if tile % GROUP == 0:
            near = _perhaps_nearest(tiles.groups, tile // GROUP, index, lists[0], n, lists[1])
        _nearest_robots(
            tiles, tile, _perhaps_nearest(tiles.boxes, tile, index, lists[1], near, lists[2]), work
        )
    used, any_hidden = 0, False
    for i in range(n):
        reach = index.sources[i, 2] * (1.0 + 1e-9) if n > _FEW else np.inf
        used = add_walls(known.walls, index, i, robots[i, 0], robots[i, 1], reach * reach, used)
        if used < 0:
            return False
    for tile in range(len(tiles.boxes)):
        any_hidden = _hide(known, work, tile, covered) or any_hidden
    if any_hidden:
        _paths_to_corners(known, work)
        _unhide(known, work)
    return True


@kernel
def site_paths(
    known: CostMap, work: Work, teams: Array, covered: BoolArray, unit: float, out: Array, ways: IntArray
) -> bool:
    """Write the ways of the nearest robots of each of some teams; return whether there was room.

    Parameters
    ----------
    teams : (r, n, 2)
    covered : (r, c)
        Which components of the free space hold robots of each.
    unit : float, m
        Of a grid step.
    out : (r, m) m
    ways : (r, 3, m)
        The robot where each way begins, the corners where it bends first and last, -1 for none, by site.
    """
    facts = known.tiles.facts
    for r in range(len(teams)):
        if not _team_paths(known, work, teams[r], covered[r]):
            return False
        for tile in range(facts.shape[1]):
            for s in range(SLOTS):
                site, last = facts[0, tile, s], work.ways[1, tile, s]
                if site >= 0:
                    out[r, site] = work.to_sites[tile, s] * unit
                    ways[r, 0, site], ways[r, 2, site] = work.ways[0, tile, s], last
                    ways[r, 1, site] = work.corner_ways[last, 1] if last >= 0 else -1
    return True
