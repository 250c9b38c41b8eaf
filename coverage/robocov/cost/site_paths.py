"""The nearest robot of every site, and the path to it: equation (22) without the mean.

Most sites see the robot that is nearest in a straight line. The others are called hidden. They are reached
via a corner, or from another robot that they see, whichever path is shorter. If several robots are equally
far away, the one with the lowest index owns the site.

All lengths are in grid steps, except for the result.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.cost.corner_views import CornerViews
from robocov.cost.lattice import NO_SITE, SLOTS, TILES_PER_GROUP, Tiles
from robocov.geodesic.angular_index import (
    NO_SPACE,
    AngularWallIndex,
    add_walls,
    is_box_hidden,
    is_certainly_visible,
    is_visible,
)
from robocov.geodesic.box_tree import (
    HIGH_X,
    HIGH_Y,
    LEAF_SIZE,
    LOW_X,
    LOW_Y,
    compute_squared_box_distance,
    get_leaf,
)
from robocov.geodesic.corner_graph import NO_CORNER, CornerGraph, CornerPaths, CornerQueue, relax_paths
from robocov.geodesic.walls import Walls, can_bend_at_corner

_MAX_SMALL_TEAM = 12
"""Size of the largest team for which walls are indexed at any distance. In such a small team, each robot is
tested with most sites anyway."""

NO_ROBOT = -1
"""Used in place of a robot if no path leads to a site."""

_REACH_PADDING = 1e-9
"""Relative margin added to the reach of a robot's view, far larger than rounding."""


class CostMap(NamedTuple):
    """The data of a map that do not depend on the robots."""

    walls: Walls
    graph: CornerGraph
    tiles: Tiles
    views: CornerViews


class Search(NamedTuple):
    """Scratch space and results of the search from n robots."""

    wall_index: AngularWallIndex
    """The walls around each robot."""
    reach: Array
    """(n,) Distance from each robot to the farthest site to which it is the nearest in a straight line."""
    all_robots: IntArray
    """(n,) Indices of all robots."""
    group_robots: IntArray
    """(n,) The robots that may own a site of the current group of tiles, or a corner of the current leaf."""
    tile_robots: IntArray
    """(n,) The robots that may own a site of the current tile."""
    queue: CornerQueue
    """The corners from which paths to other corners may be shortened."""
    corner_paths: CornerPaths
    """The shortest paths from the robots to the corners."""
    hidden_slots: IntArray
    """(t,) Bit mask of the hidden sites of each tile: bit s is set if the site in slot s is hidden."""
    nearest_robot: IntArray
    """(t, SLOTS) The robot that is nearest to each site in a straight line."""
    site_length: Array
    """(t, SLOTS) Length of the shortest path to each site; inf if there is none."""
    site_robot: IntArray
    """(t, SLOTS) The robot where that path starts, or `NO_ROBOT`."""
    site_corner: IntArray
    """(t, SLOTS) The last corner at which that path bends, or `NO_CORNER`."""

    @classmethod
    def allocate(
        cls, wall_index: AngularWallIndex, robot_count: int, corner_count: int, tile_count: int
    ) -> Search:
        """Allocate a search.

        Parameters
        ----------
        wall_index : AngularWallIndex
        robot_count, corner_count, tile_count : int

        Returns
        -------
        Search
        """
        return cls(
            wall_index=wall_index,
            reach=np.empty(robot_count),
            all_robots=np.arange(robot_count),
            group_robots=np.empty(robot_count, np.int64),
            tile_robots=np.empty(robot_count, np.int64),
            queue=CornerQueue.allocate(corner_count),
            corner_paths=CornerPaths.allocate(corner_count),
            hidden_slots=np.empty(tile_count, np.int64),
            nearest_robot=np.empty((tile_count, SLOTS), np.int64),
            site_length=np.empty((tile_count, SLOTS)),
            site_robot=np.empty((tile_count, SLOTS), np.int64),
            site_corner=np.empty((tile_count, SLOTS), np.int64),
        )


class SitePaths(NamedTuple):
    """The shortest paths to m sites from the robots of r teams."""

    distance: Array
    """(r, m) Length of each path, m; inf if no robot can reach the site."""
    owner: IntArray
    """(r, m) The robot where the path starts, or `NO_ROBOT`."""
    first_corner: IntArray
    """(r, m) The first corner at which the path bends, or `NO_CORNER`."""
    last_corner: IntArray
    """(r, m) The last corner at which the path bends, or `NO_CORNER`."""

    @classmethod
    def allocate(cls, team_count: int, site_count: int) -> SitePaths:
        """Allocate paths for a given number of teams and sites.

        Parameters
        ----------
        team_count, site_count : int

        Returns
        -------
        SitePaths
        """
        shape = (team_count, site_count)
        return cls(
            distance=np.empty(shape),
            owner=np.empty(shape, np.int64),
            first_corner=np.empty(shape, np.int64),
            last_corner=np.empty(shape, np.int64),
        )


@kernel
def find_site_paths(
    cost_map: CostMap, search: Search, teams: Array, is_covered: BoolArray, unit: float, paths: SitePaths
) -> bool:
    """Find the shortest paths to all sites from the robots of each of several teams.

    The sites are the free cells of a lattice, which is divided into square tiles. Each tile has as
    many slots as cells; the last ones contain `NO_SITE` if some of its cells are not free.

    Parameters
    ----------
    cost_map : CostMap
    search : Search
        Scratch space.
    teams : (r, n, 2) array, grid steps
        Positions of the robots.
    is_covered : (r, c) bool array
        Whether each component of the free space contains robots of each team.
    unit : float, m
        Length of a grid step.
    paths : SitePaths
        Result.

    Returns
    -------
    bool
        Whether the wall index of `search` had enough entries. If not, the result is incomplete.
    """
    tiles = cost_map.tiles
    for team in range(len(teams)):
        if not _find_team_paths(cost_map, search, teams[team], is_covered[team]):
            return False
        for tile in range(len(tiles.boxes)):
            _write_tile_paths(tiles, search, tile, team, unit, paths)
    return True


@kernel
def _write_tile_paths(
    tiles: Tiles, search: Search, tile: int, team: int, unit: float, paths: SitePaths
) -> None:
    """Store the paths that a search has found to the sites of a tile in the row of a team in `paths`."""
    for slot in range(SLOTS):
        site = tiles.site[tile, slot]
        if site == NO_SITE:
            continue
        last_corner = search.site_corner[tile, slot]
        first_corner = NO_CORNER
        if last_corner != NO_CORNER:
            first_corner = search.corner_paths.first_corner[last_corner]
        paths.distance[team, site] = search.site_length[tile, slot] * unit
        paths.owner[team, site] = search.site_robot[tile, slot]
        paths.first_corner[team, site] = first_corner
        paths.last_corner[team, site] = last_corner


@kernel
def _find_team_paths(cost_map: CostMap, search: Search, robots: Array, is_covered: BoolArray) -> bool:
    """Find the paths from the robots of a team, (n, 2), to all sites.

    At first, each site belongs to the robot that is nearest in a straight line. Sites that this robot does
    not see are hidden. Paths to them are searched via corners, and from other robots. `is_covered`, (c,),
    says which components of the free space contain robots. Return whether the index of the walls around the
    robots had enough entries.
    """
    tiles = cost_map.tiles
    _find_nearest_robots(tiles, search, robots)
    entry_count = 0
    for i in range(len(robots)):
        # In a large team, walls beyond the farthest site to which a robot is the nearest one hardly matter.
        reach = np.inf
        if len(robots) > _MAX_SMALL_TEAM:
            reach = search.reach[i] * (1.0 + _REACH_PADDING)
        entry_count = add_walls(
            cost_map.walls, search.wall_index, i, robots[i, 0], robots[i, 1], reach * reach, entry_count
        )
        if entry_count == NO_SPACE:
            return False
    is_any_hidden = False
    for tile in range(len(tiles.boxes)):
        _find_hidden_sites(cost_map, search, tile, is_covered)
        is_any_hidden = is_any_hidden or search.hidden_slots[tile] != 0
    if is_any_hidden:
        _find_corner_paths(cost_map, search, robots)
        _find_hidden_site_paths(cost_map, search, robots)
    return True


@kernel
def _find_nearest_robots(tiles: Tiles, search: Search, robots: Array) -> None:
    """Find the robot that is nearest to each site in a straight line.

    Most robots are too far from a group of neighboring tiles to be nearest to any of its sites. Such robots
    are dropped once for each group, and those that are too far from a single tile once for each tile.
    """
    search.reach[:] = 0.0
    group_robot_count = 0
    for tile in range(len(tiles.boxes)):
        if tile % TILES_PER_GROUP == 0:
            group = tile // TILES_PER_GROUP
            group_robot_count = _list_nearest_candidates(
                tiles.group_boxes, group, robots, search.all_robots, len(robots), search.group_robots
            )
        tile_robot_count = _list_nearest_candidates(
            tiles.boxes, tile, robots, search.group_robots, group_robot_count, search.tile_robots
        )
        _find_nearest_robots_of_tile(tiles, search, robots, tile, tile_robot_count)


@kernel
def _list_nearest_candidates(
    boxes: Array, box: int, robots: Array, candidates: IntArray, candidate_count: int, result: IntArray
) -> int:
    """Write the candidates that may be nearest to some point of a box to `result`; return their number.

    The candidates are the robots in the first `candidate_count` entries of `candidates`. If one of them is at
    most a distance d from every point of the box, then a robot farther than d from the box is not nearest to
    any of its points. The smallest such d leaves the fewest candidates.
    """
    max_squared_distance = np.inf
    for k in range(candidate_count):
        x = robots[candidates[k], 0]
        y = robots[candidates[k], 1]
        # Offsets to the corner of the box that is farthest from the robot.
        dx = max(x - boxes[box, LOW_X], boxes[box, HIGH_X] - x)
        dy = max(y - boxes[box, LOW_Y], boxes[box, HIGH_Y] - y)
        max_squared_distance = min(max_squared_distance, dx * dx + dy * dy)
    return _list_robots_within(boxes, box, robots, max_squared_distance, candidates, candidate_count, result)


@kernel
def _list_robots_within(
    boxes: Array,
    box: int,
    robots: Array,
    max_squared_distance: float,
    candidates: IntArray,
    candidate_count: int,
    result: IntArray,
) -> int:
    """Write the candidates within a squared distance of a box to `result`; return their number.

    The candidates are the robots in the first `candidate_count` entries of `candidates`.
    """
    result_count = 0
    for k in range(candidate_count):
        i = candidates[k]
        squared_distance = compute_squared_box_distance(boxes, box, robots[i, 0], robots[i, 1])
        if squared_distance <= max_squared_distance:
            result[result_count] = i
            result_count += 1
    return result_count


@kernel
def _find_nearest_robots_of_tile(
    tiles: Tiles, search: Search, robots: Array, tile: int, candidate_count: int
) -> None:
    """Find the robot that is nearest to each site of a tile in a straight line.

    The candidates are the first `candidate_count` robots in `search.tile_robots`. Each slot of the tile
    contains a site; an empty one repeats another site. The reach of a robot is its distance from the farthest
    site to which it is the nearest robot.
    """
    length = search.site_length
    nearest_robot = search.nearest_robot
    for slot in range(SLOTS):
        length[tile, slot] = np.inf
    for k in range(candidate_count):
        i = search.tile_robots[k]
        x = robots[i, 0]
        y = robots[i, 1]
        # The loop has no branches, so that the compiler can vectorize it. Lengths are squared until it ends.
        for slot in range(SLOTS):
            dx = tiles.x[tile, slot] - x
            dy = tiles.y[tile, slot] - y
            squared_length = dx * dx + dy * dy
            best_squared_length = length[tile, slot]
            is_nearer = squared_length < best_squared_length
            nearest_robot[tile, slot] = i if is_nearer else nearest_robot[tile, slot]
            length[tile, slot] = squared_length if is_nearer else best_squared_length
    for slot in range(SLOTS):
        i = nearest_robot[tile, slot]
        length[tile, slot] = np.sqrt(length[tile, slot])
        search.site_robot[tile, slot] = i
        search.site_corner[tile, slot] = NO_CORNER
        search.reach[i] = max(search.reach[i], length[tile, slot])


@kernel
def _find_hidden_sites(cost_map: CostMap, search: Search, tile: int, is_covered: BoolArray) -> None:
    """Find the hidden sites of a tile: those that a wall hides from their nearest robot.

    They are marked in a bit mask with one bit for each slot of the tile. `is_covered`, (c,), says which
    components of the free space contain robots; sites in the others have no path.
    """
    tiles = cost_map.tiles
    hidden_slots = 0
    for slot in range(SLOTS):
        if not is_covered[tiles.component[tile, slot]]:
            search.site_length[tile, slot] = np.inf
            search.site_robot[tile, slot] = NO_ROBOT
        elif tiles.site[tile, slot] != NO_SITE:
            x = tiles.x[tile, slot]
            y = tiles.y[tile, slot]
            robot = search.nearest_robot[tile, slot]
            # This test is faster, but does not recognize every visible site.
            if is_certainly_visible(search.wall_index, robot, x, y):
                continue
            if not is_visible(cost_map.walls, search.wall_index, robot, x, y):
                # Infinite until a path via a corner, or from another robot, is found.
                search.site_length[tile, slot] = np.inf
                hidden_slots |= 1 << slot
    search.hidden_slots[tile] = hidden_slots


@kernel
def _find_corner_paths(cost_map: CostMap, search: Search, robots: Array) -> None:
    """Find the shortest paths from the robots to the corners.

    Straight paths from robots are the start. Then paths via other corners are shortened along the graph of
    corners that see each other.
    """
    # Trying only the robot nearest to each corner first finds short paths quickly.
    waiting_count = _try_nearest_robots(cost_map.walls, search, robots)
    relax_paths(cost_map.graph, search.corner_paths, search.queue, waiting_count)
    waiting_count = _try_closer_robots(cost_map.walls, search, robots)
    relax_paths(cost_map.graph, search.corner_paths, search.queue, waiting_count)


@kernel
def _try_nearest_robots(walls: Walls, search: Search, robots: Array) -> int:
    """Try the straight path to each corner from the robot that is nearest to it.

    Robots that may be nearest to one of the corners are listed for each leaf of the corners' box tree, which
    contains `LEAF_SIZE` consecutive corners. Return the number of corners in the queue.
    """
    boxes = walls.corner_boxes
    paths = search.corner_paths
    # While corners are searched, there is no group of tiles, and its scratch space is free.
    leaf_robots = search.group_robots
    candidate_count = 0
    waiting_count = 0
    for corner in range(len(walls.corners)):
        is_first_in_leaf = corner % LEAF_SIZE == 0
        if is_first_in_leaf:
            candidate_count = _list_nearest_candidates(
                boxes, get_leaf(boxes, corner), robots, search.all_robots, len(robots), leaf_robots
            )
        # No path to the corner is known yet; its source is the index of no robot.
        paths.length[corner] = np.inf
        paths.source[corner] = len(robots)
        search.queue.is_waiting[corner] = False
        nearest = _find_nearest_candidate(
            robots,
            leaf_robots,
            candidate_count,
            walls.corners[corner, 0],
            walls.corners[corner, 1],
        )
        waiting_count = _try_straight_path_to_corner(walls, search, corner, nearest, waiting_count)
    return waiting_count


@kernel
def _try_closer_robots(walls: Walls, search: Search, robots: Array) -> int:
    """Try the straight path to each corner from every robot that is near enough to shorten its path.

    A robot at a larger distance than the length of the path so far cannot shorten it. Robots are listed for
    each leaf of the corners' box tree, which contains `LEAF_SIZE` consecutive corners. Return the number of
    corners in the queue.
    """
    boxes = walls.corner_boxes
    leaf_robots = search.group_robots
    candidate_count = 0
    waiting_count = 0
    for corner in range(len(walls.corners)):
        is_first_in_leaf = corner % LEAF_SIZE == 0
        if is_first_in_leaf:
            leaf = get_leaf(boxes, corner)
            max_length = 0.0
            for leaf_corner in range(corner, min(corner + LEAF_SIZE, len(walls.corners))):
                max_length = max(max_length, search.corner_paths.length[leaf_corner])
            candidate_count = _list_robots_within(
                boxes, leaf, robots, max_length * max_length, search.all_robots, len(robots), leaf_robots
            )
        for k in range(candidate_count):
            waiting_count = _try_straight_path_to_corner(walls, search, corner, leaf_robots[k], waiting_count)
    return waiting_count


@kernel
def _find_nearest_candidate(
    robots: Array, candidates: IntArray, candidate_count: int, x: float, y: float
) -> int:
    """Return the candidate at the smallest Euclidean distance from (x, y). There is at least one."""
    min_squared_distance = np.inf
    nearest: int = candidates[0]
    for k in range(candidate_count):
        i = candidates[k]
        dx = x - robots[i, 0]
        dy = y - robots[i, 1]
        if dx * dx + dy * dy < min_squared_distance:
            min_squared_distance = dx * dx + dy * dy
            nearest = i
    return nearest


@kernel
def _try_straight_path_to_corner(
    walls: Walls, search: Search, corner: int, robot: int, waiting_count: int
) -> int:
    """Use the straight path from a robot to a corner if it is the shortest so far.

    The robot must see the corner, and a shortest path from the robot must be able to bend there. The corner
    then joins the queue of those from which paths to other corners may be shortened. Return the number of
    corners in the queue, which was `waiting_count` before.
    """
    paths = search.corner_paths
    corner_x = walls.corners[corner, 0]
    corner_y = walls.corners[corner, 1]
    x = search.wall_index.positions[robot, 0]
    y = search.wall_index.positions[robot, 1]
    length = np.sqrt((corner_x - x) * (corner_x - x) + (corner_y - y) * (corner_y - y))
    if (
        _is_better(length, robot, paths.length[corner], paths.source[corner])
        and can_bend_at_corner(walls.corners, walls.corner_walls, corner, x, y)
        and is_visible(walls, search.wall_index, robot, corner_x, corner_y)
    ):
        paths.length[corner] = length
        paths.source[corner] = robot
        paths.first_corner[corner] = corner
        paths.previous_corner[corner] = NO_CORNER
        if not search.queue.is_waiting[corner]:
            search.queue.is_waiting[corner] = True
            search.queue.corners[waiting_count] = corner
            waiting_count += 1
    return waiting_count


@kernel
def _find_hidden_site_paths(cost_map: CostMap, search: Search, robots: Array) -> None:
    """Find the paths to the hidden sites, which the robot that is nearest in a straight line does not see.

    First, the shortest paths via corners are found. Their lengths limit which other robots can be near enough
    to reach the sites on a shorter, straight path.
    """
    tiles = cost_map.tiles
    for group in range(len(tiles.group_boxes)):
        first_tile = group * TILES_PER_GROUP
        end_tile = min(first_tile + TILES_PER_GROUP, len(tiles.boxes))
        has_hidden_sites = False
        max_length = 0.0
        for tile in range(first_tile, end_tile):
            if search.hidden_slots[tile]:
                has_hidden_sites = True
                _try_corner_paths(cost_map, search, tile)
                max_length = max(max_length, _compute_max_hidden_length(search, tile))
        if has_hidden_sites:
            _try_other_robots(cost_map, search, robots, group, max_length)


@kernel
def _try_other_robots(
    cost_map: CostMap, search: Search, robots: Array, group: int, max_length: float
) -> None:
    """Try the straight paths from other robots to the hidden sites of a group of tiles.

    `max_length` is the length of the longest path to these sites so far. Robots that are farther away than
    that from a tile cannot shorten a path to its sites.
    """
    tiles = cost_map.tiles
    group_robot_count = _list_robots_within(
        tiles.group_boxes,
        group,
        robots,
        max_length * max_length,
        search.all_robots,
        len(robots),
        search.group_robots,
    )
    first_tile = group * TILES_PER_GROUP
    for tile in range(first_tile, min(first_tile + TILES_PER_GROUP, len(tiles.boxes))):
        if search.hidden_slots[tile]:
            max_length_of_tile = _compute_max_hidden_length(search, tile)
            tile_robot_count = _list_robots_within(
                tiles.boxes,
                tile,
                robots,
                max_length_of_tile * max_length_of_tile,
                search.group_robots,
                group_robot_count,
                search.tile_robots,
            )
            for k in range(tile_robot_count):
                _try_straight_paths_to_sites(cost_map, search, tile, search.tile_robots[k])


@kernel
def _try_corner_paths(cost_map: CostMap, search: Search, tile: int) -> None:
    """Find the shortest paths via a corner to the hidden sites of a tile.

    The last segment of such a path leads from a corner to a site that it sees. Each row of `cost_map.views`
    belongs to a corner and a tile in which it sees sites. Sets of sites of a tile are bit masks, with one bit
    for each slot.
    """
    tiles = cost_map.tiles
    views = cost_map.views
    corners = cost_map.walls.corners
    paths = search.corner_paths
    hidden_slots = search.hidden_slots[tile]
    first_row = views.first_row[tile]
    end_row = views.first_row[tile + 1]
    # If a corner sees all hidden sites, none of their paths needs to be longer than the one via that corner.
    max_length = np.inf
    for row in range(first_row, end_row):
        unseen_slots = hidden_slots & ~views.visible_slots[row]
        if unseen_slots == 0:
            max_length = min(max_length, paths.length[views.corner[row]] + views.farthest[row])
    # Try each corner, unless even the nearest site that it sees is too far away.
    for row in range(first_row, end_row):
        corner = views.corner[row]
        seen_slots = hidden_slots & views.visible_slots[row]
        to_corner = paths.length[corner]
        if seen_slots == 0 or to_corner + views.nearest[row] > max_length or to_corner == np.inf:
            continue
        robot = paths.source[corner]
        for slot in range(SLOTS):
            if _contains_slot(seen_slots, slot):
                dx = tiles.x[tile, slot] - corners[corner, 0]
                dy = tiles.y[tile, slot] - corners[corner, 1]
                length = to_corner + np.sqrt(dx * dx + dy * dy)
                if _is_better(length, robot, search.site_length[tile, slot], search.site_robot[tile, slot]):
                    search.site_length[tile, slot] = length
                    search.site_robot[tile, slot] = robot
                    search.site_corner[tile, slot] = corner


@kernel
def _contains_slot(slots: int, slot: int) -> bool:
    """Return whether a bit mask of the slots of a tile contains a slot."""
    return (slots >> slot) & 1 != 0


@kernel
def _is_better(length: float, robot: int, best_length: float, best_robot: int) -> bool:
    """Return whether a path is shorter than the best one, or equally long from a robot of a lower index."""
    return length < best_length or (length == best_length and robot < best_robot)


@kernel
def _compute_max_hidden_length(search: Search, tile: int) -> float:
    """Return the length of the longest path to a hidden site of a tile."""
    hidden_slots = search.hidden_slots[tile]
    max_length = 0.0
    for slot in range(SLOTS):
        if _contains_slot(hidden_slots, slot):
            max_length = max(max_length, search.site_length[tile, slot])
    return max_length


@kernel
def _try_straight_paths_to_sites(cost_map: CostMap, search: Search, tile: int, robot: int) -> None:
    """Use the straight paths from a robot to the hidden sites of a tile where they are the shortest so far.

    Hidden sites are those that their nearest robot does not see. This robot may see them. The set of hidden
    sites is a bit mask, with one bit for each slot of the tile.
    """
    tiles = cost_map.tiles
    wall_index = search.wall_index
    if is_box_hidden(tiles.boxes, tile, wall_index, robot):
        return
    hidden_slots = search.hidden_slots[tile]
    for slot in range(SLOTS):
        if _contains_slot(hidden_slots, slot):
            x = tiles.x[tile, slot]
            y = tiles.y[tile, slot]
            dx = x - wall_index.positions[robot, 0]
            dy = y - wall_index.positions[robot, 1]
            length = np.sqrt(dx * dx + dy * dy)
            if (
                _is_better(length, robot, search.site_length[tile, slot], search.site_robot[tile, slot])
                # The nearest robot does not see the site, or it would not be hidden.
                and robot != search.nearest_robot[tile, slot]
                and is_visible(cost_map.walls, wall_index, robot, x, y)
            ):
                search.site_length[tile, slot] = length
                search.site_robot[tile, slot] = robot
                search.site_corner[tile, slot] = NO_CORNER
