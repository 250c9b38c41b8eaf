"""Visibility among walls: for each source, an index of the walls that face it, by direction.

The directions from a source are divided into angular bins. Each bin has a list of the walls that face the
source in these directions. To test whether the source sees a point, only the walls in one bin are examined,
and in most cases none: all points up to the *clear distance* of a bin are visible, and all points beyond its
*horizon* are hidden.

A wall from a to b, with free space on its left, hides a point q from a source p if and only if p is not
behind the wall, q is behind it, and the segment from p to q meets it, ends included. A point may therefore be
hidden by a vertex that the segment only touches; the path via that vertex is just as short. Walls that start
or end at p are left out. If p is a vertex, its sectors (see `Walls`) say in which directions there is free
space.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.compiled import inlined_kernel, kernel
from robocov.geodesic.box_tree import (
    END_OF_TREE,
    HIGH_X,
    HIGH_Y,
    LEAF_SIZE,
    LOW_X,
    LOW_Y,
    ROOT,
    compute_squared_box_distance,
    get_first_child,
    get_first_item,
    is_leaf,
    skip_subtree,
)
from robocov.geodesic.integer_grid import cross
from robocov.geodesic.walls import (
    END_X,
    END_Y,
    NO_VERTEX,
    NO_WALL,
    Walls,
    contains_direction,
    find_vertex,
    get_relative_ends,
)
from robocov.typing import FloatArray, IntArray

_ANGLE_PADDING = 1e-9
"""Margin by which the range of pseudo-angles of a wall or a box is widened, far larger than rounding
errors."""

_DISTANCE_PADDING = 1e-9
"""Relative margin by which squared distances are lowered or raised, far larger than rounding errors."""

_MAX_CHAIN_WALLS = 16
"""Maximum number of next walls that are examined to find out whether a chain of walls covers a bin."""

_MAX_SIDE_ERROR = 2.0**55
"""Upper bound on the rounding error of a sum of two products of grid coordinates."""

_STACK_SIZE = 64
"""Size of the stack of a tree search. It is enough for 2**60 walls: a search adds one node per level."""

ONLY_SOURCE = 0
"""Row of the source in an index that has only one source."""

NO_ENTRY = -1
"""Used in place of an entry if there is none."""

NO_SPACE = -1
"""Returned instead of a number of entries or rows if the array for them is too small."""

_FULL_TURN = 4.0
"""Pseudo-angle of a full turn; see `compute_pseudo_angle`."""

_MIN_LENGTH = 1e-300
"""Minimum divisor; prevents division by zero."""

_SOURCE_AT_VERTEX = -1.0
"""Used in place of the squared clear distances of a source at a vertex. No squared distance is below it."""


class AngularWallIndex(NamedTuple):
    """The walls that face each of n sources, in angular bins, in grid steps.

    The bins cover a full turn. Each contains a linked list of entries, one for each wall in these directions.
    """

    positions: FloatArray
    """(n, 2) Positions of the sources."""
    squared_ranges: FloatArray
    """(n,) Squares of the distances up to which the walls around each source are in the index."""
    squared_clear_distances: FloatArray
    """(n, bins) Squares of the distances up to which no point is hidden by a wall. If the source is at a
    vertex, they are `_SOURCE_AT_VERTEX`."""
    squared_horizons: FloatArray
    """(n, bins) Squares of the distances beyond which every point is hidden."""
    heads: IntArray
    """(n, bins) The entry that was last added to each bin, or `NO_ENTRY`."""
    entry_walls: IntArray
    """(m,) The wall of each entry."""
    previous_entries: IntArray
    """(m,) The entry that was added to the same bin before each entry, or `NO_ENTRY`."""
    stack: IntArray
    """Scratch space: the nodes of the box tree that a search still has to visit."""

    @classmethod
    def allocate(cls, source_count: int, bin_count: int, max_entries: int) -> AngularWallIndex:
        """Allocate an uninitialized index, to which `add_walls` adds one source after the other.

        Parameters
        ----------
        source_count : int
            Number of sources.
        bin_count : int
            Number of angular bins of each source. It must be a power of 2, because a bit mask is used to wrap
            the indices of bins around after a full turn.
        max_entries : int
            Maximum number of entries of all sources together.

        Returns
        -------
        AngularWallIndex
        """
        return cls(
            positions=np.empty((source_count, 2)),
            squared_ranges=np.empty(source_count),
            squared_clear_distances=np.empty((source_count, bin_count)),
            squared_horizons=np.empty((source_count, bin_count)),
            heads=np.empty((source_count, bin_count), np.int64),
            entry_walls=np.empty(max_entries, np.int64),
            previous_entries=np.empty(max_entries, np.int64),
            stack=np.empty(_STACK_SIZE, np.int64),
        )


class _SpannedBins(NamedTuple):
    """The angular bins in which a wall lies, seen from a source.

    The wall covers a bin if it lies in every direction of the bin. Bin numbers are not wrapped; they continue
    past a full turn.
    """

    first: int
    """The first bin in which the wall lies."""
    last: int
    """The last bin in which the wall lies (inclusive)."""
    first_covered: int
    """The first bin that the wall covers."""
    end_covered: int
    """The end of the bins that the wall covers (exclusive)."""


@inlined_kernel
def compute_pseudo_angle(dx: float, dy: float) -> float:
    """Compute a number from 0 to 4 that grows with the angle, counter-clockwise from straight down.

    It needs no trigonometry.

    Parameters
    ----------
    dx, dy : float
        The direction, as a vector of any length.

    Returns
    -------
    float
        The pseudo-angle. It is 0 straight down and 1 to the right.

    Examples
    --------
    >>> [compute_pseudo_angle(dx, dy) for dx, dy in ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))]
    [0.0, 1.0, 2.0, 3.0]
    """
    slope = dy / max(abs(dx) + abs(dy), _MIN_LENGTH)
    return 1.0 + slope if dx >= 0.0 else 3.0 - slope


@kernel
def is_box_hidden(boxes: FloatArray, box: int, index: AngularWallIndex, source: int) -> bool:
    """Return whether a box is certainly hidden from a source by walls.

    The directions from the source are divided into angular bins. In each bin, walls hide everything beyond
    the horizon. The box is hidden if it is beyond the horizon in every bin in which it may lie.

    Parameters
    ----------
    boxes : (m, 4) array, grid steps
        A tree of `box_tree`, or other boxes with the same columns.
    box : int
        Row of the box.
    index : AngularWallIndex
    source : int
        Row of the source in the index.

    Returns
    -------
    bool
        False does not mean that the source sees any part of the box.
    """
    x = index.positions[source, 0]
    y = index.positions[source, 1]
    squared_distance = compute_squared_box_distance(boxes, box, x, y) * (1.0 - _DISTANCE_PADDING)
    if squared_distance == 0.0:
        return False
    bin_count = index.squared_horizons.shape[1]
    half_width = 0.5 * (boxes[box, HIGH_X] - boxes[box, LOW_X])
    half_height = 0.5 * (boxes[box, HIGH_Y] - boxes[box, LOW_Y])
    dx = boxes[box, LOW_X] + half_width - x
    dy = boxes[box, LOW_Y] + half_height - y
    # The box lies in the circle around its center through its corners. From a source outside this circle, the
    # sine of the angle between the direction of the center and that of any point of the box is at most the
    # radius divided by the distance to the center. The angle is then at most pi/2 times its sine, and a
    # pseudo-angle grows at most as fast as the angle. From a source inside, the box may lie in any direction.
    squared_sine = (half_width * half_width + half_height * half_height) / (dx * dx + dy * dy)
    half_angle = 0.5 * _FULL_TURN
    if squared_sine < 1.0:
        half_angle = np.sqrt(squared_sine) * (0.5 * np.pi) + _ANGLE_PADDING
    angle = compute_pseudo_angle(dx, dy)
    bins_per_unit = bin_count / _FULL_TURN
    first_bin = int(np.floor((angle - half_angle) * bins_per_unit))
    last_bin = int(np.floor((angle + half_angle) * bins_per_unit))
    for unwrapped_bin in range(first_bin, min(last_bin, first_bin + bin_count - 1) + 1):
        k = _wrap_bin(unwrapped_bin, bin_count)
        if index.squared_horizons[source, k] >= squared_distance:
            return False
    return True


@kernel
def _wrap_bin(unwrapped_bin: int, bin_count: int) -> int:
    """Convert the index of a bin that was counted beyond a full turn, or backward, to one within a full turn.

    Since `bin_count` is a power of 2, the bit mask gives the remainder of the division by it, even for a
    negative index.
    """
    return unwrapped_bin & (bin_count - 1)


@kernel
def add_walls(
    walls: Walls,
    index: AngularWallIndex,
    source: int,
    x: float,
    y: float,
    squared_range: float,
    entry_count: int,
) -> int:
    """Add a source to an index, with the walls around it.

    A search in the box tree of the walls visits nearby boxes first. It skips boxes that are out of range or
    hidden by the walls found so far.

    Parameters
    ----------
    walls : Walls
    index : AngularWallIndex
        Modified in place.
    source : int
        Row of the source in the index.
    x, y : float, grid steps
        Position of the source, not inside an obstacle.
    squared_range : float, grid steps²
        Square of the distance up to which walls are added.
    entry_count : int
        Number of entries that other sources already use.

    Returns
    -------
    int
        The new number of entries, or `NO_SPACE`.
    """
    tree = walls.tree
    stack = index.stack
    bin_count = index.heads.shape[1]
    _reset_source(index, source, x, y, squared_range)
    stack[0] = ROOT
    stack_size = 1
    while stack_size > 0:
        stack_size -= 1
        node = stack[stack_size]
        if compute_squared_box_distance(tree, node, x, y) >= squared_range:
            continue
        if is_box_hidden(tree, node, index, source):
            continue
        if not is_leaf(tree, node):
            stack_size = _push_children(stack, stack_size, tree, node, x, y)
            continue
        first_wall = get_first_item(tree, node)
        for wall in range(first_wall, min(first_wall + LEAF_SIZE, len(walls.ends))):
            # A wall may need an entry in every bin.
            if entry_count + bin_count > len(index.entry_walls):
                return NO_SPACE
            if walls.can_hide_free_space[wall]:
                entry_count = _add_wall(walls, wall, index, source, entry_count)
    # At a vertex, some directions lead into the obstacle. This value makes `is_visible` check the direction.
    if find_vertex(walls.vertices, x, y) != NO_VERTEX:
        for k in range(bin_count):
            index.squared_clear_distances[source, k] = _SOURCE_AT_VERTEX
    return entry_count


@kernel
def _push_children(stack: IntArray, stack_size: int, tree: FloatArray, node: int, x: float, y: float) -> int:
    """Push the two children of a node on the stack, the nearer one last; return the new size of the stack.

    The nearer child is then visited first, because its walls may hide the box of the other child.
    """
    nearer = get_first_child(node)
    farther = nearer + 1
    nearer_squared_distance = compute_squared_box_distance(tree, nearer, x, y)
    farther_squared_distance = compute_squared_box_distance(tree, farther, x, y)
    if farther_squared_distance < nearer_squared_distance:
        nearer, farther = farther, nearer
    stack[stack_size] = farther
    stack[stack_size + 1] = nearer
    return stack_size + 2


@kernel
def index_walls(walls: Walls, index: AngularWallIndex, x: float, y: float) -> int:
    """Index the walls at any distance around a single source.

    Parameters
    ----------
    walls : Walls
    index : AngularWallIndex
        An index of one source, which is overwritten. The row of the source is `ONLY_SOURCE`.
    x, y : float, grid steps
        Position of the source, not inside an obstacle.

    Returns
    -------
    int
        Number of entries, or `NO_SPACE`.
    """
    squared_range = np.inf
    entry_count = 0
    return add_walls(walls, index, ONLY_SOURCE, x, y, squared_range, entry_count)


@kernel
def _reset_source(index: AngularWallIndex, source: int, x: float, y: float, squared_range: float) -> None:
    """Set the position of a source, with no walls around it yet."""
    index.positions[source, 0] = x
    index.positions[source, 1] = y
    index.squared_ranges[source] = squared_range
    for k in range(index.heads.shape[1]):
        index.squared_clear_distances[source, k] = squared_range
        index.squared_horizons[source, k] = np.inf
        index.heads[source, k] = NO_ENTRY


@kernel
def _add_wall(walls: Walls, wall: int, index: AngularWallIndex, source: int, entry_count: int) -> int:
    """If a wall faces the source, add it to its bins; return the new number of entries.

    The clear distance of a bin is at most the distance of the nearest point of each wall in the bin. The
    horizon of a bin is at most the distance of the farthest point of each wall that covers the bin. A wall
    beyond the horizon of a bin is not added to the bin. Distances and angles are padded to allow for
    rounding. The caller makes sure that there is space for an entry in every bin.
    """
    x = index.positions[source, 0]
    y = index.positions[source, 1]
    ax, ay, bx, by = get_relative_ends(walls.ends, wall, x, y)
    # Whatever a back-facing wall hides is already hidden by the walls in front of it.
    if not _faces(walls.ends, wall, x, y):
        return entry_count
    min_squared_distance = _compute_squared_segment_distance(ax, ay, bx, by) * (1.0 - _DISTANCE_PADDING)
    if min_squared_distance >= index.squared_ranges[source]:
        return entry_count
    max_squared_distance = max(ax * ax + ay * ay, bx * bx + by * by) * (1.0 + _DISTANCE_PADDING)
    # Seen from its front, a wall runs counter-clockwise from a to b, by at most half a turn.
    bin_count = index.heads.shape[1]
    start_angle = compute_pseudo_angle(ax, ay)
    end_angle = compute_pseudo_angle(bx, by)
    if end_angle < start_angle:
        end_angle += _FULL_TURN
    bins = _span_bins(start_angle, end_angle, bin_count)
    for unwrapped_bin in range(bins.first, bins.last + 1):
        k = _wrap_bin(unwrapped_bin, bin_count)
        if min_squared_distance > index.squared_horizons[source, k]:
            continue
        _add_to_bin(index, source, k, wall, min_squared_distance, entry_count)
        entry_count += 1
        if bins.first_covered <= unwrapped_bin < bins.end_covered:
            index.squared_horizons[source, k] = min(index.squared_horizons[source, k], max_squared_distance)
    _limit_horizon_of_last_bin(walls, wall, index, source, bins, end_angle, max_squared_distance)
    return entry_count


@inlined_kernel
def _limit_horizon_of_last_bin(
    walls: Walls,
    wall: int,
    index: AngularWallIndex,
    source: int,
    bins: _SpannedBins,
    end_angle: float,
    max_squared_distance: float,
) -> None:
    """Limit the horizon of the bin in which a wall ends, if the walls after it cover the rest of the bin.

    The wall itself covers only the beginning of the bin. The chain of these walls covers the whole bin, and
    its farthest point limits the horizon. `end_angle` is the pseudo-angle of the end of the wall, and
    `max_squared_distance` the squared distance of the farthest point of the wall.
    """
    bin_count = index.heads.shape[1]
    # False if the wall starts and ends in the same bin, or has already covered a full turn.
    has_partial_bin = bins.first_covered <= bins.end_covered < bins.first + bin_count
    k = _wrap_bin(bins.end_covered, bin_count)
    if has_partial_bin and max_squared_distance < index.squared_horizons[source, k]:
        bin_end_angle = (bins.end_covered + 1) * _FULL_TURN / bin_count
        x = index.positions[source, 0]
        y = index.positions[source, 1]
        max_squared_chain_distance = _compute_max_squared_chain_distance(
            walls, wall, x, y, end_angle, bin_end_angle, max_squared_distance
        )
        index.squared_horizons[source, k] = min(index.squared_horizons[source, k], max_squared_chain_distance)


@kernel
def _span_bins(start_angle: float, end_angle: float, bin_count: int) -> _SpannedBins:
    """Return the bins between the pseudo-angles of the start and the end of a wall.

    The bins in which the wall lies are rounded outward, and those that it covers inward, so that rounding
    errors of the angles do no harm.
    """
    bins_per_unit = bin_count / _FULL_TURN
    first = int(np.floor((start_angle - _ANGLE_PADDING) * bins_per_unit))
    last = int(np.floor((end_angle + _ANGLE_PADDING) * bins_per_unit))
    return _SpannedBins(
        first=first,
        # At most a full turn, so that no bin appears twice.
        last=min(last, first + bin_count - 1),
        first_covered=int(np.ceil((start_angle + _ANGLE_PADDING) * bins_per_unit)),
        end_covered=int(np.floor((end_angle - _ANGLE_PADDING) * bins_per_unit)),
    )


@inlined_kernel
def _add_to_bin(
    index: AngularWallIndex, source: int, k: int, wall: int, min_squared_distance: float, entry: int
) -> None:
    """Add a wall to bin k of a source as a new entry, and limit the clear distance of the bin."""
    index.entry_walls[entry] = wall
    index.previous_entries[entry] = index.heads[source, k]
    index.heads[source, k] = entry
    index.squared_clear_distances[source, k] = min(
        index.squared_clear_distances[source, k], min_squared_distance
    )


@kernel
def _compute_squared_segment_distance(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the squared distance from the origin to the segment from (ax, ay) to (bx, by)."""
    ux = bx - ax
    uy = by - ay
    fraction = min(max(-(ax * ux + ay * uy) / (ux * ux + uy * uy), 0.0), 1.0)
    nearest_x = ax + fraction * ux
    nearest_y = ay + fraction * uy
    return nearest_x * nearest_x + nearest_y * nearest_y


@kernel
def _compute_max_squared_chain_distance(
    walls: Walls,
    wall: int,
    x: float,
    y: float,
    end_angle: float,
    bin_end_angle: float,
    max_squared_distance: float,
) -> float:
    """Return the squared distance from (x, y) to the farthest point of a chain of consecutive walls.

    If a wall ends within an angular bin, the next wall usually starts there, and the two together hide
    everything behind them. The chain starts with `wall`, which ends in the direction `end_angle` and whose
    farthest point is at the squared distance `max_squared_distance`. The next walls are added to the chain as
    long as they face (x, y), until one ends at or beyond `bin_end_angle`, the end of the bin. The result is
    inf if none does. All directions are pseudo-angles; see `compute_pseudo_angle`.
    """
    for _ in range(_MAX_CHAIN_WALLS):
        # The next wall leads from (ax, ay), where this one ends, to (bx, by), both relative to (x, y).
        ax = walls.ends[wall, END_X] - x
        ay = walls.ends[wall, END_Y] - y
        wall = walls.next_walls[wall]
        if wall == NO_WALL:
            break
        bx = walls.ends[wall, END_X] - x
        by = walls.ends[wall, END_Y] - y
        if cross(ax, ay, bx - ax, by - ay) <= 0.0:
            break
        # A wall that faces (x, y) runs counter-clockwise, so its end has the larger pseudo-angle. After the
        # direction in which pseudo-angles start again at 0, whole turns are added.
        previous_end_angle = end_angle
        end_angle = compute_pseudo_angle(bx, by)
        while end_angle < previous_end_angle - _ANGLE_PADDING:
            end_angle += _FULL_TURN
        # The point of a wall that is farthest away is one of its ends.
        max_squared_distance = max(max_squared_distance, (bx * bx + by * by) * (1.0 + _DISTANCE_PADDING))
        if end_angle - _ANGLE_PADDING >= bin_end_angle:
            return max_squared_distance
    return np.inf


@inlined_kernel
def find_angular_bin(bin_count: int, dx: float, dy: float) -> int:
    """Return the angular bin of a direction.

    Parameters
    ----------
    bin_count : int
        Number of bins in a full turn.
    dx, dy : float
        The direction, as a vector of any length.

    Returns
    -------
    int
        Index of the bin, from 0 to ``bin_count - 1``.
    """
    return min(int(compute_pseudo_angle(dx, dy) * (bin_count / _FULL_TURN)), bin_count - 1)


@inlined_kernel
def is_visible(walls: Walls, index: AngularWallIndex, source: int, x: float, y: float) -> bool:
    """Return whether a source sees a point at any distance, that is, whether no wall lies between them.

    A source at a vertex of the walls sees only points in directions that lead into free space.

    Parameters
    ----------
    walls : Walls
    index : AngularWallIndex
    source : int
        Row of the source in the index.
    x, y : float, grid steps
        Coordinates of the point.

    Returns
    -------
    bool
    """
    dx = x - index.positions[source, 0]
    dy = y - index.positions[source, 1]
    squared_distance = dx * dx + dy * dy
    k = find_angular_bin(index.squared_clear_distances.shape[1], dx, dy)
    # In angular bin k around the source, every point up to the clear distance is visible, and every point
    # beyond the horizon is hidden. These two comparisons decide most cases.
    if squared_distance <= index.squared_clear_distances[source, k]:
        return True
    if squared_distance > index.squared_horizons[source, k]:
        return False
    return _is_visible_past_walls(walls, index, source, k, dx, dy)


@kernel
def is_certainly_visible(index: AngularWallIndex, source: int, x: float, y: float) -> bool:
    """Return whether a point is so close to a source that no wall can hide it.

    Loops that test many points call this before `is_visible`, which is slower because it reads more arrays.

    Parameters
    ----------
    index : AngularWallIndex
    source : int
        Row of the source in the index.
    x, y : float, grid steps
        Coordinates of the point.

    Returns
    -------
    bool
        False does not mean that the point is hidden.
    """
    dx = x - index.positions[source, 0]
    dy = y - index.positions[source, 1]
    k = find_angular_bin(index.squared_clear_distances.shape[1], dx, dy)
    is_clear: bool = dx * dx + dy * dy <= index.squared_clear_distances[source, k]
    return is_clear


@kernel
def _is_visible_past_walls(
    walls: Walls, index: AngularWallIndex, source: int, k: int, dx: float, dy: float
) -> bool:
    """Return whether a source sees the point at offset (dx, dy), by testing every wall in angular bin k."""
    x = index.positions[source, 0]
    y = index.positions[source, 1]
    if index.squared_clear_distances[source, k] == _SOURCE_AT_VERTEX:
        # The source is at a vertex, where some directions lead into the obstacle.
        vertex = find_vertex(walls.vertices, x, y)
        if not contains_direction(walls, vertex, dx, dy):
            return False
    if dx * dx + dy * dy > index.squared_ranges[source]:
        # Walls that are as far away as the point may be missing from the index.
        return _is_segment_free(walls, x, y, dx, dy)
    # The walls of a bin are a linked list, from the last entry to the first.
    entry = index.heads[source, k]
    while entry != NO_ENTRY:
        if _hides(walls.ends, index.entry_walls[entry], x, y, dx, dy):
            return False
        entry = index.previous_entries[entry]
    return True


@kernel
def _hides(ends: FloatArray, wall: int, x: float, y: float, dx: float, dy: float) -> bool:
    """Return whether a wall that faces (x, y) hides the point at offset (dx, dy) from there."""
    ax, ay, bx, by = get_relative_ends(ends, wall, x, y)
    # The point is behind the wall, and its direction is between those of the ends of the wall.
    return (
        cross(bx - ax, by - ay, dx - ax, dy - ay) < 0.0
        and cross(ax, ay, dx, dy) >= 0.0
        and cross(dx, dy, bx, by) >= 0.0
    )


@kernel
def _faces(ends: FloatArray, wall: int, x: float, y: float) -> bool:
    """Return whether (x, y) is in front of a wall, or in its interior."""
    ax, ay, bx, by = get_relative_ends(ends, wall, x, y)
    side: float = cross(ax, ay, bx - ax, by - ay)
    return side > 0.0 or (side == 0.0 and ax * bx + ay * by < 0.0)


@kernel
def _is_segment_free(walls: Walls, x: float, y: float, dx: float, dy: float) -> bool:
    """Return whether no wall hides the point at offset (dx, dy) from (x, y).

    A search in the box tree of the walls skips boxes that do not meet the segment between the two points.
    """
    tree = walls.tree
    node = ROOT
    while node != END_OF_TREE:
        if _is_box_off_segment(tree, node, x, y, dx, dy):
            node = skip_subtree(node)
        elif not is_leaf(tree, node):
            node = get_first_child(node)
        else:
            first_wall = get_first_item(tree, node)
            for wall in range(first_wall, min(first_wall + LEAF_SIZE, len(walls.ends))):
                if (
                    walls.can_hide_free_space[wall]
                    and _faces(walls.ends, wall, x, y)
                    and _hides(walls.ends, wall, x, y, dx, dy)
                ):
                    return False
            node = skip_subtree(node)
    return True


@kernel
def _is_box_off_segment(tree: FloatArray, node: int, x: float, y: float, dx: float, dy: float) -> bool:
    """Return whether the box of a node certainly does not meet the segment from (x, y) to (x + dx, y + dy).

    By the separating axis theorem, the two do not meet if they are apart in x, in y, or in the direction
    perpendicular to the segment.
    """
    if tree[node, LOW_X] > x + max(dx, 0.0) or tree[node, HIGH_X] < x + min(dx, 0.0):
        return True
    if tree[node, LOW_Y] > y + max(dy, 0.0) or tree[node, HIGH_Y] < y + min(dy, 0.0):
        return True
    half_width = 0.5 * (tree[node, HIGH_X] - tree[node, LOW_X])
    half_height = 0.5 * (tree[node, HIGH_Y] - tree[node, LOW_Y])
    # Compare the distance of the center of the box from the line of the segment with half the extent of the
    # box perpendicular to that line. Both are multiplied by the length of the segment.
    side = dx * (tree[node, LOW_Y] + half_height - y) - dy * (tree[node, LOW_X] + half_width - x)
    half_extent: float = abs(dx) * half_height + abs(dy) * half_width
    distance: float = abs(side) * (1.0 - _DISTANCE_PADDING)
    return distance > half_extent * (1.0 + _DISTANCE_PADDING) + _MAX_SIDE_ERROR
