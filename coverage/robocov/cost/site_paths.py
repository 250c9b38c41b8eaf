"""The robot that is nearest to each site, and the shortest path from there: equation (22) without the mean.

For most sites, the robot that is nearest in a straight line sees the site, and the path is straight. All
other sites are called hidden. The path to a hidden site leads via a corner, or straight from another robot
that sees the site, whichever is shorter. Of several robots at the same distance, the one with the lowest
index owns the site.

All lengths are in grid steps, except for those in `SitePaths`.

Functions that are called for each tile, corner or site are inlined, and the longest loops read each array
of a named tuple only once. Otherwise, numba would update the reference counts of arrays so often that the
search would take almost twice as long.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.compiled import inlined_kernel, kernel
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
from robocov.typing import BoolArray, FloatArray, IntArray

_MAX_SMALL_TEAM = 12
"""Number of robots up to which the walls at any distance from each robot are indexed. In such a small team,
nearly every robot has to be tested with distant sites anyway."""

NO_ROBOT = -1
"""Used in place of a robot if no path leads to a site."""

_RANGE_PADDING = 1e-9
"""Relative margin by which the range of a wall index is enlarged, far larger than rounding errors."""


class CostMap(NamedTuple):
    """The data of a map that do not depend on the robots."""

    walls: Walls
    """The boundary of the free space."""
    graph: CornerGraph
    """The links between the corners."""
    tiles: Tiles
    """The sites."""
    views: CornerViews
    """The sites that each corner sees."""


class Search(NamedTuple):
    """Scratch space and results of the search for paths from n robots to the sites in t tiles."""

    wall_index: AngularWallIndex
    """The walls around each robot."""
    max_site_distances: FloatArray
    """(n,) Distance from each robot to the farthest of the sites to which it is nearest in a straight
    line."""
    all_robots: IntArray
    """(n,) Indices of all robots."""
    group_robots: IntArray
    """(n,) The robots that may be nearest to a site of a group of tiles, or to a corner of a leaf."""
    tile_robots: IntArray
    """(n,) The robots that may be nearest to a site of a tile."""
    queue: CornerQueue
    """The corners from which paths to other corners may be shortened."""
    corner_paths: CornerPaths
    """The shortest paths from the robots to the corners."""
    hidden_slots: IntArray
    """(t,) Bit mask of the hidden sites of each tile: bit s is set if the site in slot s is hidden."""
    nearest_robots: IntArray
    """(t, SLOTS) The robot that is nearest to each site in a straight line."""
    site_lengths: FloatArray
    """(t, SLOTS) Length of the shortest path to each site; inf if there is none."""
    site_robots: IntArray
    """(t, SLOTS) The robot where that path starts, or `NO_ROBOT`."""
    site_corners: IntArray
    """(t, SLOTS) The last corner at which that path bends, or `NO_CORNER`."""

    @classmethod
    def allocate(
        cls, wall_index: AngularWallIndex, robot_count: int, corner_count: int, tile_count: int
    ) -> Search:
        """Allocate a search; all its own arrays except `all_robots` are uninitialized.

        Parameters
        ----------
        wall_index : AngularWallIndex
            An index with one source for each robot.
        robot_count, corner_count, tile_count : int
            Number of robots of a team, of corners and of tiles.

        Returns
        -------
        Search
        """
        return cls(
            wall_index=wall_index,
            max_site_distances=np.empty(robot_count),
            all_robots=np.arange(robot_count),
            group_robots=np.empty(robot_count, np.int64),
            tile_robots=np.empty(robot_count, np.int64),
            queue=CornerQueue.allocate(corner_count),
            corner_paths=CornerPaths.allocate(corner_count),
            hidden_slots=np.empty(tile_count, np.int64),
            nearest_robots=np.empty((tile_count, SLOTS), np.int64),
            site_lengths=np.empty((tile_count, SLOTS)),
            site_robots=np.empty((tile_count, SLOTS), np.int64),
            site_corners=np.empty((tile_count, SLOTS), np.int64),
        )


class SitePaths(NamedTuple):
    """The shortest paths to m sites from the robots of r teams."""

    distances: FloatArray
    """(r, m) Length of each path in meters; inf if no robot can reach the site."""
    owners: IntArray
    """(r, m) The robot at which each path starts, or `NO_ROBOT`."""
    first_corners: IntArray
    """(r, m) The first corner at which each path bends, or `NO_CORNER`."""
    last_corners: IntArray
    """(r, m) The last corner at which each path bends, or `NO_CORNER`."""

    @classmethod
    def allocate(cls, team_count: int, site_count: int) -> SitePaths:
        """Allocate uninitialized paths for a given number of teams and sites.

        Parameters
        ----------
        team_count, site_count : int

        Returns
        -------
        SitePaths
        """
        shape = (team_count, site_count)
        return cls(
            distances=np.empty(shape),
            owners=np.empty(shape, np.int64),
            first_corners=np.empty(shape, np.int64),
            last_corners=np.empty(shape, np.int64),
        )


@kernel
def find_site_paths(
    cost_map: CostMap,
    search: Search,
    teams: FloatArray,
    is_covered: BoolArray,
    grid_spacing: float,
    paths: SitePaths,
) -> bool:
    """Find the shortest path to each site from the robots of each of several teams.

    Parameters
    ----------
    cost_map : CostMap
    search : Search
        Scratch space.
    teams : (r, n, 2) array, grid steps
        Positions of the robots of each team.
    is_covered : (r, c) bool array
        For each team, which of the c components of the free space contain robots.
    grid_spacing : float, m
        Length of a grid step.
    paths : SitePaths
        Result.

    Returns
    -------
    bool
        Whether the wall index of `search` had enough entries. If not, the result is incomplete.
    """
    for team in range(len(teams)):
        if not _find_team_paths(cost_map, search, teams[team], is_covered[team]):
            return False
        _write_team_paths(cost_map.tiles, search, team, grid_spacing, paths)
    return True


@kernel
def _write_team_paths(tiles: Tiles, search: Search, team: int, grid_spacing: float, paths: SitePaths) -> None:
    """Copy the paths that a search has found into the row of a team in `paths`."""
    sites = tiles.sites
    site_lengths = search.site_lengths
    site_robots = search.site_robots
    site_corners = search.site_corners
    corner_first_corners = search.corner_paths.first_corners
    distances = paths.distances[team]
    owners = paths.owners[team]
    first_corners = paths.first_corners[team]
    last_corners = paths.last_corners[team]
    for tile in range(len(sites)):
        for slot in range(SLOTS):
            site = sites[tile, slot]
            if site == NO_SITE:
                continue
            last_corner = site_corners[tile, slot]
            first_corner = NO_CORNER
            if last_corner != NO_CORNER:
                first_corner = corner_first_corners[last_corner]
            distances[site] = site_lengths[tile, slot] * grid_spacing
            owners[site] = site_robots[tile, slot]
            first_corners[site] = first_corner
            last_corners[site] = last_corner


@kernel
def _find_team_paths(cost_map: CostMap, search: Search, robots: FloatArray, is_covered: BoolArray) -> bool:
    """Find the shortest path to each site from the robots of a team, which are at (n, 2) grid positions.

    At first, each site belongs to the robot that is nearest in a straight line. Sites that this robot does
    not see are hidden. For these, paths via corners and from other robots are searched. `is_covered`, (c,),
    says which components of the free space contain robots. Return whether the index of the walls around the
    robots had enough entries.
    """
    tiles = cost_map.tiles
    _find_nearest_robots(tiles, search, robots)
    entry_count = 0
    for i in range(len(robots)):
        # In a large team, most visibility tests of a robot are those with the sites to which it is nearest.
        # `is_visible` can do without an index of the walls beyond them.
        wall_range = np.inf
        if len(robots) > _MAX_SMALL_TEAM:
            wall_range = search.max_site_distances[i] * (1.0 + _RANGE_PADDING)
        squared_range = wall_range * wall_range
        entry_count = add_walls(
            cost_map.walls, search.wall_index, i, robots[i, 0], robots[i, 1], squared_range, entry_count
        )
        if entry_count == NO_SPACE:
            return False
    if _find_hidden_sites(cost_map, search, is_covered):
        _find_corner_paths(cost_map, search, robots)
        _find_hidden_site_paths(cost_map, search, robots)
    return True


@kernel
def _find_nearest_robots(tiles: Tiles, search: Search, robots: FloatArray) -> None:
    """Find the robot that is nearest to each site in a straight line.

    Robots that are too far away to be nearest to any site of a group of neighboring tiles are first excluded
    for the whole group, and of the others, those that are too far away from a tile are excluded for the tile.
    """
    search.max_site_distances[:] = 0.0
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
        _find_nearest_robots_in_tile(tiles, search, robots, tile, tile_robot_count)


@inlined_kernel
def _list_nearest_candidates(
    boxes: FloatArray,
    box: int,
    robots: FloatArray,
    candidates: IntArray,
    candidate_count: int,
    result: IntArray,
) -> int:
    """Write the candidates that may be nearest to some point of a box to `result`; return their number.

    The candidates are the robots in the first `candidate_count` entries of `candidates`. If every point of
    the box is at most a distance d from one of them, then a robot farther than d from the box is not nearest
    to any of these points. The smallest such d leaves the fewest candidates.
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


@inlined_kernel
def _list_robots_within(
    boxes: FloatArray,
    box: int,
    robots: FloatArray,
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


@inlined_kernel
def _find_nearest_robots_in_tile(
    tiles: Tiles, search: Search, robots: FloatArray, tile: int, candidate_count: int
) -> None:
    """Find the robot that is nearest to each site of a tile in a straight line.

    The candidates are the first `candidate_count` robots in `search.tile_robots`. Empty slots of the tile
    repeat another site, so that they need no special treatment.
    """
    lengths = search.site_lengths
    nearest_robots = search.nearest_robots
    for slot in range(SLOTS):
        lengths[tile, slot] = np.inf
    for k in range(candidate_count):
        i = search.tile_robots[k]
        x = robots[i, 0]
        y = robots[i, 1]
        # This loop has no branches, so that the compiler can vectorize it. For the time being, `lengths`
        # contains squared lengths.
        for slot in range(SLOTS):
            dx = tiles.x[tile, slot] - x
            dy = tiles.y[tile, slot] - y
            squared_length = dx * dx + dy * dy
            min_squared_length = lengths[tile, slot]
            is_nearer = squared_length < min_squared_length
            nearest_robots[tile, slot] = i if is_nearer else nearest_robots[tile, slot]
            lengths[tile, slot] = squared_length if is_nearer else min_squared_length
    for slot in range(SLOTS):
        i = nearest_robots[tile, slot]
        lengths[tile, slot] = np.sqrt(lengths[tile, slot])
        search.site_robots[tile, slot] = i
        search.site_corners[tile, slot] = NO_CORNER
        search.max_site_distances[i] = max(search.max_site_distances[i], lengths[tile, slot])


@kernel
def _find_hidden_sites(cost_map: CostMap, search: Search, is_covered: BoolArray) -> bool:
    """Find the hidden sites: those that a wall hides from their nearest robot. Return whether there are any.

    The hidden sites of each tile are written to a bit mask, with one bit for each slot. `is_covered`, (c,),
    tells which components of the free space contain robots. Sites in the other components get an infinite
    length and no robot.
    """
    walls = cost_map.walls
    wall_index = search.wall_index
    sites = cost_map.tiles.sites
    site_x = cost_map.tiles.x
    site_y = cost_map.tiles.y
    components = cost_map.tiles.components
    nearest_robots = search.nearest_robots
    site_lengths = search.site_lengths
    site_robots = search.site_robots
    hidden_slots = search.hidden_slots
    is_any_hidden = False
    for tile in range(len(sites)):
        hidden_slots_of_tile = 0
        for slot in range(SLOTS):
            if not is_covered[components[tile, slot]]:
                site_lengths[tile, slot] = np.inf
                site_robots[tile, slot] = NO_ROBOT
            elif sites[tile, slot] != NO_SITE:
                x = site_x[tile, slot]
                y = site_y[tile, slot]
                robot = nearest_robots[tile, slot]
                # This test is faster than the next one, but does not recognize every visible site.
                if is_certainly_visible(wall_index, robot, x, y):
                    continue
                if not is_visible(walls, wall_index, robot, x, y):
                    # Infinite until a path via a corner, or from another robot, is found.
                    site_lengths[tile, slot] = np.inf
                    hidden_slots_of_tile |= 1 << slot
                    is_any_hidden = True
        hidden_slots[tile] = hidden_slots_of_tile
    return is_any_hidden


@kernel
def _find_corner_paths(cost_map: CostMap, search: Search, robots: FloatArray) -> None:
    """Find the shortest path to each corner from the robots.

    A path starts with a straight segment from a robot to a corner that it sees, and continues along the graph
    of the corners.
    """
    # At first, only the robot nearest to each corner is tried. This finds short paths quickly, so that few
    # other robots are near enough to shorten them.
    waiting_count = _try_nearest_robots(cost_map.walls, search, robots)
    relax_paths(cost_map.graph, search.corner_paths, search.queue, waiting_count)
    waiting_count = _try_closer_robots(cost_map.walls, search, robots)
    relax_paths(cost_map.graph, search.corner_paths, search.queue, waiting_count)


@kernel
def _try_nearest_robots(walls: Walls, search: Search, robots: FloatArray) -> int:
    """Try the straight path to each corner from the robot that is nearest to it in a straight line.

    The robots that may be nearest to a corner are listed once for each leaf of the box tree, which contains
    `LEAF_SIZE` consecutive corners. Return the number of corners in the queue.
    """
    tree = walls.corner_tree
    paths = search.corner_paths
    # The scratch space of groups of tiles is free at this time.
    leaf_robots = search.group_robots
    candidate_count = 0
    waiting_count = 0
    for corner in range(len(walls.corners)):
        is_first_in_leaf = corner % LEAF_SIZE == 0
        if is_first_in_leaf:
            leaf = get_leaf(tree, corner)
            candidate_count = _list_nearest_candidates(
                tree, leaf, robots, search.all_robots, len(robots), leaf_robots
            )
        # No path to the corner is known yet. Its source is larger than the index of any robot, so that every
        # path is better.
        paths.lengths[corner] = np.inf
        paths.sources[corner] = len(robots)
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
def _try_closer_robots(walls: Walls, search: Search, robots: FloatArray) -> int:
    """Try the straight path to each corner from every robot that is near enough to shorten the path so far.

    The robots that are near enough are listed once for each leaf of the box tree, which contains `LEAF_SIZE`
    consecutive corners. Return the number of corners in the queue.
    """
    tree = walls.corner_tree
    # The scratch space of groups of tiles is free at this time.
    leaf_robots = search.group_robots
    candidate_count = 0
    waiting_count = 0
    for corner in range(len(walls.corners)):
        is_first_in_leaf = corner % LEAF_SIZE == 0
        if is_first_in_leaf:
            leaf = get_leaf(tree, corner)
            # A robot farther away than this cannot shorten the path to any corner of the leaf.
            max_length = 0.0
            for leaf_corner in range(corner, min(corner + LEAF_SIZE, len(walls.corners))):
                max_length = max(max_length, search.corner_paths.lengths[leaf_corner])
            candidate_count = _list_robots_within(
                tree, leaf, robots, max_length * max_length, search.all_robots, len(robots), leaf_robots
            )
        for k in range(candidate_count):
            waiting_count = _try_straight_path_to_corner(walls, search, corner, leaf_robots[k], waiting_count)
    return waiting_count


@inlined_kernel
def _find_nearest_candidate(
    robots: FloatArray, candidates: IntArray, candidate_count: int, x: float, y: float
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


@inlined_kernel
def _try_straight_path_to_corner(
    walls: Walls, search: Search, corner: int, robot: int, waiting_count: int
) -> int:
    """Use the straight path from a robot to a corner if it is the shortest path so far.

    The robot must see the corner, and a shortest path from the robot must be able to bend there. If the path
    is used, the corner joins the queue of the corners from which other paths may be shortened. Return the
    number of corners in the queue, which was `waiting_count` before.
    """
    paths = search.corner_paths
    corner_x = walls.corners[corner, 0]
    corner_y = walls.corners[corner, 1]
    x = search.wall_index.positions[robot, 0]
    y = search.wall_index.positions[robot, 1]
    length = np.sqrt((corner_x - x) * (corner_x - x) + (corner_y - y) * (corner_y - y))
    if (
        _is_better(length, robot, paths.lengths[corner], paths.sources[corner])
        and can_bend_at_corner(walls.corners, walls.corner_walls, corner, x, y)
        and is_visible(walls, search.wall_index, robot, corner_x, corner_y)
    ):
        paths.lengths[corner] = length
        paths.sources[corner] = robot
        paths.first_corners[corner] = corner
        paths.previous_corners[corner] = NO_CORNER
        if not search.queue.is_waiting[corner]:
            search.queue.is_waiting[corner] = True
            search.queue.corners[waiting_count] = corner
            waiting_count += 1
    return waiting_count


@kernel
def _find_hidden_site_paths(cost_map: CostMap, search: Search, robots: FloatArray) -> None:
    """Find the paths to the hidden sites, which the robot that is nearest in a straight line does not see.

    First, the shortest paths via corners are found. A straight path from another robot can be shorter only if
    the robot is nearer than the length of these paths.
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
    cost_map: CostMap, search: Search, robots: FloatArray, group: int, max_length: float
) -> None:
    """Try the straight paths from other robots to the hidden sites of a group of tiles.

    `max_length` is the length of the longest path to these sites so far. A robot that is farther away cannot
    shorten any path. The same holds for each tile, with the longest path to its own hidden sites.
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


@inlined_kernel
def _try_corner_paths(cost_map: CostMap, search: Search, tile: int) -> None:
    """Find the shortest paths via corners to the hidden sites of a tile.

    The last segment of such a path leads from a corner to a site that it sees, as listed in `cost_map.views`.
    Sets of sites of a tile are bit masks, with one bit for each slot.
    """
    tiles = cost_map.tiles
    views = cost_map.views
    corners = cost_map.walls.corners
    paths = search.corner_paths
    hidden_slots = search.hidden_slots[tile]
    first_row = views.row_starts[tile]
    end_row = views.row_starts[tile + 1]
    # If a corner sees all hidden sites, the path via that corner limits the length of all their paths.
    max_length = np.inf
    for row in range(first_row, end_row):
        unseen_slots = hidden_slots & ~views.visible_slots[row]
        if unseen_slots == 0:
            max_length = min(max_length, paths.lengths[views.corners[row]] + views.max_distances[row])
    # Try each corner, unless even the path to the nearest site that it sees is too long.
    for row in range(first_row, end_row):
        corner = views.corners[row]
        seen_slots = hidden_slots & views.visible_slots[row]
        corner_length = paths.lengths[corner]
        if (
            seen_slots == 0
            or corner_length + views.min_distances[row] > max_length
            or corner_length == np.inf
        ):
            continue
        robot = paths.sources[corner]
        for slot in range(SLOTS):
            if _contains_slot(seen_slots, slot):
                dx = tiles.x[tile, slot] - corners[corner, 0]
                dy = tiles.y[tile, slot] - corners[corner, 1]
                length = corner_length + np.sqrt(dx * dx + dy * dy)
                if _is_better(length, robot, search.site_lengths[tile, slot], search.site_robots[tile, slot]):
                    search.site_lengths[tile, slot] = length
                    search.site_robots[tile, slot] = robot
                    search.site_corners[tile, slot] = corner


@inlined_kernel
def _contains_slot(slots: int, slot: int) -> bool:
    """Return whether a bit mask of the slots of a tile contains a slot."""
    return (slots >> slot) & 1 != 0


@inlined_kernel
def _is_better(length: float, robot: int, best_length: float, best_robot: int) -> bool:
    """Return whether a path is shorter than the best one, or as long, but from a robot with a lower index."""
    return length < best_length or (length == best_length and robot < best_robot)


@inlined_kernel
def _compute_max_hidden_length(search: Search, tile: int) -> float:
    """Return the length of the longest path to a hidden site of a tile."""
    hidden_slots = search.hidden_slots[tile]
    max_length = 0.0
    for slot in range(SLOTS):
        if _contains_slot(hidden_slots, slot):
            max_length = max(max_length, search.site_lengths[tile, slot])
    return max_length


@inlined_kernel
def _try_straight_paths_to_sites(cost_map: CostMap, search: Search, tile: int, robot: int) -> None:
    """Use the straight path from a robot to each hidden site of a tile if it is the shortest path so far.

    Hidden sites are those that their nearest robot does not see; another robot may see them. The set of
    hidden sites is a bit mask, with one bit for each slot of the tile.
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
                _is_better(length, robot, search.site_lengths[tile, slot], search.site_robots[tile, slot])
                # If the nearest robot saw the site, it would not be hidden.
                and robot != search.nearest_robots[tile, slot]
                and is_visible(cost_map.walls, wall_index, robot, x, y)
            ):
                search.site_lengths[tile, slot] = length
                search.site_robots[tile, slot] = robot
                search.site_corners[tile, slot] = NO_CORNER
