"""Visibility among walls: for each source, the walls that face it, sorted into angular bins.

A wall a → b (free space on its left) hides a target q from a source p if and only if p is not behind it, q is
behind it, and the segment from p to q meets it, ends included. A target may therefore be hidden by a vertex
that the segment only touches; the path via that vertex is just as short. Walls that end at p are left out. If
p is a vertex, its sectors decide in which directions there is free space.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, IntArray
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
from robocov.geodesic.grid import cross
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

_ANGLE_PADDING = 1e-9
"""Margin by which the pseudo-angles that a wall or a box spans are widened, far larger than rounding."""

_DISTANCE_PADDING = 1e-9
"""Relative margin by which squared distances are lowered or raised, far larger than rounding."""

_MAX_CHAIN = 16
"""Maximum number of walls that are followed after one that ends within a bin."""

_MAX_SIDE_ERROR = 2.0**55
"""Bound on the rounding error of sums of products of grid coordinates."""

_MAX_TREE_DEPTH = 64
"""Size of the stack of a tree search, which contains at most one node for each level of the tree."""

ONLY_SOURCE = 0
"""Row of the source in an index that has only one."""

NO_ENTRY = -1
"""Used in place of an entry where there is none."""

NO_SPACE = -1
"""Returned instead of a number of entries, or of rows, if there is not enough space for them."""

_FULL_TURN = 4.0
"""Pseudo-angle of a full turn; see `compute_pseudo_angle`."""

_MIN_LENGTH = 1e-300
"""Smallest length used as a divisor, which prevents division by zero."""

_MUST_CHECK_SECTORS = -1.0
"""Squared clear distance in all bins of a source at a vertex; less than the square of any distance."""


class AngularWallIndex(NamedTuple):
    """The walls that face each of n sources, in angular bins, in grid steps."""

    positions: Array
    """(n, 2) Positions of the sources."""
    squared_reach: Array
    """(n,) Squares of the distances within which all walls are in the index."""
    squared_clear_distance: Array
    """(n, bins) Squared distances up to which nothing is hidden; `_MUST_CHECK_SECTORS` if the source is at a
    vertex."""
    squared_horizon: Array
    """(n, bins) Squared distances beyond which everything is hidden."""
    head: IntArray
    """(n, bins) The last entry of each bin, or `NO_ENTRY` if it is empty."""
    entry_wall: IntArray
    """(m,) The wall of each entry."""
    entry_before: IntArray
    """(m,) The previous entry in the same bin, or `NO_ENTRY`."""
    stack: IntArray
    """Nodes of the box tree that are still to be visited."""

    @classmethod
    def allocate(cls, source_count: int, bin_count: int, max_entries: int) -> AngularWallIndex:
        """Allocate an index, to be filled by `add_walls`.

        Parameters
        ----------
        source_count : int
        bin_count : int
            Number of angular bins of each source. It must be a power of 2, because a bit mask is used to wrap
            the indices of bins around after a full turn.
        max_entries : int
            Maximum number of entries, for all sources together.

        Returns
        -------
        AngularWallIndex
        """
        return cls(
            positions=np.empty((source_count, 2)),
            squared_reach=np.empty(source_count),
            squared_clear_distance=np.empty((source_count, bin_count)),
            squared_horizon=np.empty((source_count, bin_count)),
            head=np.empty((source_count, bin_count), np.int64),
            entry_wall=np.empty(max_entries, np.int64),
            entry_before=np.empty(max_entries, np.int64),
            stack=np.empty(_MAX_TREE_DEPTH, np.int64),
        )


class _SpannedBins(NamedTuple):
    """The angular bins that a wall spans, seen from a source.

    The wall covers a bin if it crosses every direction of the bin.
    """

    first: int
    """The first bin that contains a direction to the wall."""
    last: int
    """The last such bin (inclusive)."""
    first_covered: int
    """The first bin that the wall covers."""
    end_covered: int
    """The bin after the last one that the wall covers (exclusive)."""


@kernel
def compute_pseudo_angle(dx: float, dy: float) -> float:
    """Compute a number from 0 to 4 that grows with the angle of a direction, without trigonometry.

    Parameters
    ----------
    dx, dy : float
        The direction, of any length.

    Returns
    -------
    float

    Examples
    --------
    >>> [compute_pseudo_angle(dx, dy) for dx, dy in ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))]
    [0.0, 1.0, 2.0, 3.0]
    """
    slope = dy / max(abs(dx) + abs(dy), _MIN_LENGTH)
    return 1.0 + slope if dx >= 0.0 else 3.0 - slope


@kernel
def is_box_hidden(boxes: Array, node: int, index: AngularWallIndex, source: int) -> bool:
    """Return whether a box lies entirely beyond the horizon of a source, in every bin that it meets.

    The directions from the source are divided into angular bins. In each bin, the horizon is the distance
    beyond which walls hide everything. A few more bins may be tested than the box meets.

    Parameters
    ----------
    boxes : (nodes, 4) array, grid steps
        Boxes of a tree, as `box_tree` builds it.
    node : int
        The node of the box.
    index : AngularWallIndex
    source : int
        Row of the source in the index.

    Returns
    -------
    bool
    """
    x = index.positions[source, 0]
    y = index.positions[source, 1]
    squared_distance = compute_squared_box_distance(boxes, node, x, y) * (1.0 - _DISTANCE_PADDING)
    if squared_distance == 0.0:
        return False
    bin_count = index.squared_horizon.shape[1]
    half_width = 0.5 * (boxes[node, HIGH_X] - boxes[node, LOW_X])
    half_height = 0.5 * (boxes[node, HIGH_Y] - boxes[node, LOW_Y])
    dx = boxes[node, LOW_X] + half_width - x
    dy = boxes[node, LOW_Y] + half_height - y
    # The angle that half the box spans is at most pi/2 times its sine, and its sine is the half diagonal
    # divided by the distance to the center. A pseudo-angle grows at most as fast as the angle.
    squared_sine = (half_width * half_width + half_height * half_height) / (dx * dx + dy * dy)
    half_angle = np.sqrt(squared_sine) * (0.5 * np.pi) + _ANGLE_PADDING
    angle = compute_pseudo_angle(dx, dy)
    bins_per_unit = bin_count / _FULL_TURN
    first_bin = int(np.floor((angle - half_angle) * bins_per_unit))
    last_bin = int(np.floor((angle + half_angle) * bins_per_unit))
    for unwrapped_bin in range(first_bin, min(last_bin, first_bin + bin_count - 1) + 1):
        k = _wrap_bin(unwrapped_bin, bin_count)
        if index.squared_horizon[source, k] >= squared_distance:
            return False
    return True


@kernel
def _wrap_bin(unwrapped_bin: int, bin_count: int) -> int:
    """Return the bin that has the same directions, whole turns apart, from 0 up to `bin_count`.

    `bin_count` is a power of 2, so that this is the remainder of the division by it, also of negative bins.
    """
    return unwrapped_bin & (bin_count - 1)


@kernel
def add_walls(
    walls: Walls,
    index: AngularWallIndex,
    source: int,
    x: float,
    y: float,
    squared_reach: float,
    entry_count: int,
) -> int:
    """Add a source to an index, with the walls around it.

    A search in the box tree of the walls visits nearby boxes first, and skips those that are out of reach or
    hidden by the walls found so far.

    Parameters
    ----------
    walls : Walls
    index : AngularWallIndex
        Modified in place.
    source : int
        Row of the source in the index.
    x, y : float, grid steps
        Its position, not inside an obstacle.
    squared_reach : float
        Squared distance up to which walls are added.
    entry_count : int
        Number of entries that other sources already use.

    Returns
    -------
    int
        New number of entries, or `NO_SPACE`.
    """
    boxes = walls.boxes
    stack = index.stack
    bin_count = index.head.shape[1]
    _reset_source(index, source, x, y, squared_reach)
    stack[0] = ROOT
    stack_size = 1
    while stack_size > 0:
        stack_size -= 1
        node = stack[stack_size]
        if compute_squared_box_distance(boxes, node, x, y) >= squared_reach:
            continue
        if is_box_hidden(boxes, node, index, source):
            continue
        if not is_leaf(boxes, node):
            stack_size = _push_children(stack, stack_size, boxes, node, x, y)
            continue
        first_wall = get_first_item(boxes, node)
        for wall in range(first_wall, min(first_wall + LEAF_SIZE, len(walls.ends))):
            # A wall may need an entry in every bin.
            if entry_count + bin_count > len(index.entry_wall):
                return NO_SPACE
            if walls.can_hide_free_space[wall]:
                entry_count = _add_wall(walls, wall, index, source, entry_count)
    # At a vertex, some directions lead into the obstacle: no clear distance may skip that test.
    if find_vertex(walls.vertices, x, y) != NO_VERTEX:
        for k in range(bin_count):
            index.squared_clear_distance[source, k] = _MUST_CHECK_SECTORS
    return entry_count


@kernel
def _push_children(stack: IntArray, stack_size: int, boxes: Array, node: int, x: float, y: float) -> int:
    """Push the two children of a node on the stack, the nearer one last; return the new size of the stack.

    The last node on the stack is visited first. Boxes that its walls hide need not be visited.
    """
    nearer = get_first_child(node)
    farther = nearer + 1
    nearer_distance = compute_squared_box_distance(boxes, nearer, x, y)
    farther_distance = compute_squared_box_distance(boxes, farther, x, y)
    if farther_distance < nearer_distance:
        nearer, farther = farther, nearer
    stack[stack_size] = farther
    stack[stack_size + 1] = nearer
    return stack_size + 2


@kernel
def index_walls(walls: Walls, index: AngularWallIndex, x: float, y: float) -> int:
    """Index the walls around a single source, `ONLY_SOURCE`, at any distance.

    Parameters
    ----------
    walls : Walls
    index : AngularWallIndex
        Overwritten; it has space for one source.
    x, y : float, grid steps
        Position of the source, not inside an obstacle.

    Returns
    -------
    int
        Number of entries, or `NO_SPACE`.
    """
    squared_reach = np.inf
    entry_count = 0
    return add_walls(walls, index, ONLY_SOURCE, x, y, squared_reach, entry_count)


@kernel
def _reset_source(index: AngularWallIndex, source: int, x: float, y: float, squared_reach: float) -> None:
    """Set the position of a source, with no walls around it yet."""
    index.positions[source, 0] = x
    index.positions[source, 1] = y
    index.squared_reach[source] = squared_reach
    for k in range(index.head.shape[1]):
        index.squared_clear_distance[source, k] = squared_reach
        index.squared_horizon[source, k] = np.inf
        index.head[source, k] = NO_ENTRY


@kernel
def _add_wall(walls: Walls, wall: int, index: AngularWallIndex, source: int, entry_count: int) -> int:
    """Add a wall to the bins that it spans if it faces the source; return the new number of entries.

    The directions from the source are divided into angular bins, each with a list of the walls in it.
    Nothing is hidden up to the clear distance of a bin, which is at most the smallest distance of each wall
    in the bin. Everything is hidden beyond the horizon of a bin, which is at most the largest distance of
    each wall that covers the whole bin. A wall beyond the horizon of a bin is not added to the bin. Distances
    and angles are padded to allow for rounding.
    """
    x = index.positions[source, 0]
    y = index.positions[source, 1]
    ax, ay, bx, by = get_relative_ends(walls.ends, wall, x, y)
    # A wall in line with the source hides nothing, unless the source is in its interior.
    if not _faces(walls.ends, wall, x, y):
        return entry_count
    min_squared_distance = _compute_squared_segment_distance(ax, ay, bx, by) * (1.0 - _DISTANCE_PADDING)
    if min_squared_distance >= index.squared_reach[source]:
        return entry_count
    max_squared_distance = max(ax * ax + ay * ay, bx * bx + by * by) * (1.0 + _DISTANCE_PADDING)
    # Seen from its front, a wall runs counter-clockwise from a to b, by at most half a turn.
    bin_count = index.head.shape[1]
    start_angle = compute_pseudo_angle(ax, ay)
    end_angle = compute_pseudo_angle(bx, by)
    if end_angle < start_angle:
        end_angle += _FULL_TURN
    bins = _span_bins(start_angle, end_angle, bin_count)
    for unwrapped_bin in range(bins.first, bins.last + 1):
        k = _wrap_bin(unwrapped_bin, bin_count)
        if min_squared_distance > index.squared_horizon[source, k]:
            continue
        _add_to_bin(index, source, k, wall, min_squared_distance, entry_count)
        entry_count += 1
        if bins.first_covered <= unwrapped_bin < bins.end_covered:
            index.squared_horizon[source, k] = min(index.squared_horizon[source, k], max_squared_distance)
    # The wall covers only the first part of the bin in which it ends. If the next walls cover the rest, the
    # chain of these walls covers the bin, and its largest distance limits the horizon.
    k = _wrap_bin(bins.end_covered, bin_count)
    has_partial_bin = bins.first_covered <= bins.end_covered < bins.first + bin_count
    if has_partial_bin and max_squared_distance < index.squared_horizon[source, k]:
        bin_end_angle = (bins.end_covered + 1) / (bin_count / _FULL_TURN)
        max_squared_chain_distance = _compute_max_squared_chain_distance(
            walls, wall, x, y, end_angle, bin_end_angle, max_squared_distance
        )
        index.squared_horizon[source, k] = min(index.squared_horizon[source, k], max_squared_chain_distance)
    return entry_count


@kernel
def _span_bins(start_angle: float, end_angle: float, bin_count: int) -> _SpannedBins:
    """Return the bins between two pseudo-angles. Bins beyond a full turn are not wrapped around.

    Spanned bins are rounded outward and covered bins inward, so that rounding errors of angles do no harm.
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
    index.entry_wall[entry] = wall
    index.entry_before[entry] = index.head[source, k]
    index.head[source, k] = entry
    index.squared_clear_distance[source, k] = min(
        index.squared_clear_distance[source, k], min_squared_distance
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
    """Return the largest squared distance from (x, y) to a chain of consecutive walls.

    Where one wall ends within an angular bin, the next one usually continues, and the two together hide
    everything behind them. The chain starts with `wall`, which ends in the direction `end_angle`; its largest
    squared distance is `max_squared_distance`. The walls that follow are added, as long as they face (x, y),
    until one ends at or beyond the end of the bin, at `bin_end_angle`. The result is inf if none does.
    Directions are given as pseudo-angles, which grow with the angle; see `compute_pseudo_angle`.
    """
    for _ in range(_MAX_CHAIN):
        # The next wall leads from (ax, ay), where this one ends, to (bx, by), relative to the point.
        ax = walls.ends[wall, END_X] - x
        ay = walls.ends[wall, END_Y] - y
        wall = walls.following[wall]
        if wall == NO_WALL:
            break
        bx = walls.ends[wall, END_X] - x
        by = walls.ends[wall, END_Y] - y
        if cross(ax, ay, bx - ax, by - ay) <= 0.0:
            break
        # The direction in which the wall ends, at or after the end of the wall before.
        previous_end_angle = end_angle
        end_angle = compute_pseudo_angle(bx, by)
        while end_angle < previous_end_angle - _ANGLE_PADDING:
            end_angle += _FULL_TURN
        # The point of a wall that is farthest away is one of its ends.
        max_squared_distance = max(max_squared_distance, (bx * bx + by * by) * (1.0 + _DISTANCE_PADDING))
        if end_angle - _ANGLE_PADDING >= bin_end_angle:
            return max_squared_distance
    return np.inf


@kernel
def find_bin(bin_count: int, dx: float, dy: float) -> int:
    """Return the angular bin of a direction.

    Parameters
    ----------
    bin_count : int
        Number of bins in a full turn.
    dx, dy : float
        The direction, of any length.

    Returns
    -------
    int
    """
    return min(int(compute_pseudo_angle(dx, dy) * (bin_count / _FULL_TURN)), bin_count - 1)


@kernel
def is_visible(walls: Walls, index: AngularWallIndex, source: int, x: float, y: float) -> bool:
    """Return whether a source sees a point, that is, no wall lies between them. The range is unlimited.

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
    k = find_bin(index.squared_clear_distance.shape[1], dx, dy)
    # In this angular bin around the source, no point within the clear distance is hidden, and every point
    # beyond the horizon is. These two comparisons decide most cases.
    if squared_distance <= index.squared_clear_distance[source, k]:
        return True
    if squared_distance > index.squared_horizon[source, k]:
        return False
    return _is_visible_past_walls(walls, index, source, k, dx, dy)


@kernel
def is_certainly_visible(index: AngularWallIndex, source: int, x: float, y: float) -> bool:
    """Return whether a point is so close to a source that nothing can hide it.

    Loops that test many points call this before `is_visible`, which is too large for the compiler to inline.

    Parameters
    ----------
    index : AngularWallIndex
    source : int
        Row of the source in the index.
    x, y : float, grid steps
        The point.

    Returns
    -------
    bool
    """
    dx = x - index.positions[source, 0]
    dy = y - index.positions[source, 1]
    k = find_bin(index.squared_clear_distance.shape[1], dx, dy)
    is_clear: bool = dx * dx + dy * dy <= index.squared_clear_distance[source, k]
    return is_clear


@kernel
def _is_visible_past_walls(
    walls: Walls, index: AngularWallIndex, source: int, k: int, dx: float, dy: float
) -> bool:
    """Return whether a source sees the point at offset (dx, dy), by testing every wall in angular bin k.

    The walls of a bin are a linked list: `head` is its last entry, and `entry_before` leads to the one
    before.
    """
    x = index.positions[source, 0]
    y = index.positions[source, 1]
    if index.squared_clear_distance[source, k] == _MUST_CHECK_SECTORS:
        # The source is at a vertex, where some directions lead into the obstacle.
        vertex = find_vertex(walls.vertices, x, y)
        if not contains_direction(walls, vertex, dx, dy):
            return False
    if dx * dx + dy * dy > index.squared_reach[source]:
        # The bins may lack walls that are this far away.
        return _is_segment_free(walls, x, y, dx, dy)
    entry = index.head[source, k]
    while entry != NO_ENTRY:
        if _hides(walls.ends, index.entry_wall[entry], x, y, dx, dy):
            return False
        entry = index.entry_before[entry]
    return True


@kernel
def _hides(ends: Array, wall: int, x: float, y: float, dx: float, dy: float) -> bool:
    """Return whether a wall that faces (x, y) hides the point at offset (dx, dy) from there."""
    ax, ay, bx, by = get_relative_ends(ends, wall, x, y)
    # The point is behind the wall, and its direction is between those of the ends of the wall.
    return (
        cross(bx - ax, by - ay, dx - ax, dy - ay) < 0.0
        and cross(ax, ay, dx, dy) >= 0.0
        and cross(dx, dy, bx, by) >= 0.0
    )


@kernel
def _faces(ends: Array, wall: int, x: float, y: float) -> bool:
    """Return whether (x, y) is in front of a wall, or in its interior."""
    ax, ay, bx, by = get_relative_ends(ends, wall, x, y)
    side: float = cross(ax, ay, bx - ax, by - ay)
    return side > 0.0 or (side == 0.0 and ax * bx + ay * by < 0.0)


@kernel
def _is_segment_free(walls: Walls, x: float, y: float, dx: float, dy: float) -> bool:
    """Return whether no wall hides the point at offset (dx, dy) from (x, y).

    Only walls whose boxes in the tree meet the segment between the two points are tested.
    """
    boxes = walls.boxes
    node = ROOT
    while node != END_OF_TREE:
        if _is_box_off_segment(boxes, node, x, y, dx, dy):
            node = skip_subtree(node)
        elif not is_leaf(boxes, node):
            node = get_first_child(node)
        else:
            first_wall = get_first_item(boxes, node)
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
def _is_box_off_segment(boxes: Array, node: int, x: float, y: float, dx: float, dy: float) -> bool:
    """Return whether a box certainly does not meet the segment from (x, y) to (x + dx, y + dy).

    That is so if the two are apart in x, in y, or across the segment (separating axes).
    """
    if boxes[node, LOW_X] > x + max(dx, 0.0) or boxes[node, HIGH_X] < x + min(dx, 0.0):
        return True
    if boxes[node, LOW_Y] > y + max(dy, 0.0) or boxes[node, HIGH_Y] < y + min(dy, 0.0):
        return True
    half_width = 0.5 * (boxes[node, HIGH_X] - boxes[node, LOW_X])
    half_height = 0.5 * (boxes[node, HIGH_Y] - boxes[node, LOW_Y])
    # Compare the distance from the line to the center with the extent of the box across the line, both
    # multiplied by the length of the segment.
    side = dx * (boxes[node, LOW_Y] + half_height - y) - dy * (boxes[node, LOW_X] + half_width - x)
    half_extent: float = abs(dx) * half_height + abs(dy) * half_width
    distance: float = abs(side) * (1.0 - _DISTANCE_PADDING)
    return distance > half_extent * (1.0 + _DISTANCE_PADDING) + _MAX_SIDE_ERROR
