"""The graph of the corners that see each other, and shortest paths in it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.geodesic.angular_index import (
    NO_SPACE,
    ONLY_SOURCE,
    AngularWallIndex,
    index_walls,
    is_box_hidden,
    is_visible,
)
from robocov.geodesic.box_tree import (
    END_OF_TREE,
    LEAF_SIZE,
    LOW_X,
    ROOT,
    get_first_child,
    get_first_item,
    is_leaf,
    skip_subtree,
)
from robocov.geodesic.walls import Walls, can_bend_at_corner

NO_CORNER = -1
"""Used in place of a corner if a path is straight, and does not bend."""


class CornerGraph(NamedTuple):
    """The pairs of corners that see each other and can follow each other on a shortest path."""

    first_link: IntArray
    """(k + 1,) The links of corner i are those from ``first_link[i]`` up to ``first_link[i + 1]``."""
    neighbor: IntArray
    """(l,) The corner to which each link leads."""
    length: Array
    """(l,) Length of each link, grid steps."""


class CornerPaths(NamedTuple):
    """The shortest paths from the nearest of several sources to all corners."""

    length: Array
    """(k,) Length, grid steps; inf if no path leads there."""
    source: IntArray
    """(k,) The source where the path starts."""
    first_corner: IntArray
    """(k,) The first corner at which the path bends, or where it ends if it is straight."""
    previous_corner: IntArray
    """(k,) The last corner at which the path bends before its end, or `NO_CORNER` if it is straight."""

    @classmethod
    def allocate(cls, corner_count: int) -> CornerPaths:
        """Allocate paths to a given number of corners.

        Parameters
        ----------
        corner_count : int

        Returns
        -------
        CornerPaths
        """
        return cls(
            length=np.empty(corner_count),
            source=np.empty(corner_count, np.int64),
            first_corner=np.empty(corner_count, np.int64),
            previous_corner=np.empty(corner_count, np.int64),
        )


class CornerQueue(NamedTuple):
    """The corners whose neighbors may be reached by a shorter path; a ring buffer."""

    corners: IntArray
    """(k + 1,)"""
    is_waiting: BoolArray
    """(k,) Whether each corner is in the queue."""

    @classmethod
    def allocate(cls, corner_count: int) -> CornerQueue:
        """Allocate a queue with space for all corners.

        Parameters
        ----------
        corner_count : int

        Returns
        -------
        CornerQueue
        """
        return cls(corners=np.empty(corner_count + 1, np.int64), is_waiting=np.empty(corner_count, np.bool_))


def build_corner_graph(corner_count: int, pairs: IntArray, lengths: Array) -> CornerGraph:
    """Build the graph of corners from its links.

    Parameters
    ----------
    corner_count : int
    pairs : (l, 2) int array
        The two corners of each link, each pair once.
    lengths : (l,) array, grid steps

    Returns
    -------
    CornerGraph
        Each link appears in both directions.
    """
    start = np.concatenate([pairs[:, 0], pairs[:, 1]])
    end = np.concatenate([pairs[:, 1], pairs[:, 0]])
    order = np.lexsort((end, start))
    return CornerGraph(
        first_link=np.searchsorted(start[order], np.arange(corner_count + 1)),
        neighbor=end[order],
        length=np.tile(lengths, 2)[order],
    )


@kernel
def find_visible_corners(
    walls: Walls, index: AngularWallIndex, source: int, first_corner: int, visible: IntArray
) -> int:
    """Find the corners that a source sees and at which a shortest path from it can bend.

    Parameters
    ----------
    walls : Walls
    index : AngularWallIndex
        Its reach must be unlimited.
    source : int
        Row of the source in the index.
    first_corner : int
        The first corner to consider; those before it are skipped.
    visible : (k,) int array
        Result: the corners that were found.

    Returns
    -------
    int
        Number of corners that were found.
    """
    corners = walls.corners
    boxes = walls.corner_boxes
    x = index.positions[source, 0]
    y = index.positions[source, 1]
    count = 0
    node = ROOT
    while node != END_OF_TREE:
        is_empty = boxes[node, LOW_X] == np.inf
        if is_empty or is_box_hidden(boxes, node, index, source):
            node = skip_subtree(node)
        elif not is_leaf(boxes, node):
            node = get_first_child(node)
        else:
            first_in_leaf = get_first_item(boxes, node)
            end_of_leaf = min(first_in_leaf + LEAF_SIZE, len(corners))
            for corner in range(max(first_in_leaf, first_corner), end_of_leaf):
                if can_bend_at_corner(corners, walls.corner_walls, corner, x, y) and is_visible(
                    walls, index, source, corners[corner, 0], corners[corner, 1]
                ):
                    visible[count] = corner
                    count += 1
            node = skip_subtree(node)
    return count


@kernel
def find_links(
    walls: Walls,
    visible: IntArray,
    first: int,
    end: int,
    index: AngularWallIndex,
    pairs: IntArray,
    lengths: Array,
) -> int:
    """Find the links from a range of corners to the corners after them.

    Two corners are linked if they see each other and a shortest path can bend at both of them.

    Parameters
    ----------
    walls : Walls
    visible : (k,) int array
        Scratch space.
    first, end : int
        The corners are those from `first` up to `end`.
    index : AngularWallIndex
        Scratch space for one source.
    pairs : (m, 2) int array
        Result: the two corners of each link.
    lengths : (m, 1) array, grid steps
        Result: the length of each link.

    Returns
    -------
    int
        Number of links, or `NO_SPACE`.
    """
    corners = walls.corners
    link_count = 0
    for corner in range(first, end):
        x = corners[corner, 0]
        y = corners[corner, 1]
        if index_walls(walls, index, x, y) == NO_SPACE:
            return NO_SPACE
        count = find_visible_corners(walls, index, ONLY_SOURCE, corner + 1, visible)
        if link_count + count > len(pairs):
            return NO_SPACE
        for k in range(count):
            visible_x = corners[visible[k], 0]
            visible_y = corners[visible[k], 1]
            # The visible corners are those at which a path from this one can bend. A path from there must
            # also be able to bend at this one.
            if can_bend_at_corner(corners, walls.corner_walls, corner, visible_x, visible_y):
                dx = visible_x - x
                dy = visible_y - y
                pairs[link_count, 0] = corner
                pairs[link_count, 1] = visible[k]
                lengths[link_count, 0] = np.sqrt(dx * dx + dy * dy)
                link_count += 1
    return link_count


@kernel
def relax_paths(graph: CornerGraph, paths: CornerPaths, queue: CornerQueue, waiting_count: int) -> None:
    """Shorten the paths to corners via other corners until none can be shortened further.

    A corner whose path has become shorter waits in a queue until the paths to its neighbors are tested. If
    paths are equally short, the one from the first source is taken.

    Parameters
    ----------
    graph : CornerGraph
    paths : CornerPaths
        On entry, the straight paths from the sources; their length is infinite where there is none.
    queue : CornerQueue
        On entry, the corners to which there are straight paths, at the beginning of the queue.
    waiting_count : int
        Number of corners in the queue.
    """
    # The queue is a ring: the corners from `head` up to `tail` wait, and indices wrap around at its end.
    size = len(queue.corners)
    head = 0
    tail = waiting_count
    while head != tail:
        corner = queue.corners[head]
        head = _get_next_slot(head, size)
        queue.is_waiting[corner] = False
        for link in range(graph.first_link[corner], graph.first_link[corner + 1]):
            neighbor = graph.neighbor[link]
            length = paths.length[corner] + graph.length[link]
            is_tie = length == paths.length[neighbor]
            if length < paths.length[neighbor] or (is_tie and paths.source[corner] < paths.source[neighbor]):
                paths.length[neighbor] = length
                paths.source[neighbor] = paths.source[corner]
                paths.first_corner[neighbor] = paths.first_corner[corner]
                paths.previous_corner[neighbor] = corner
                if not queue.is_waiting[neighbor]:
                    queue.is_waiting[neighbor] = True
                    queue.corners[tail] = neighbor
                    tail = _get_next_slot(tail, size)


@kernel
def _get_next_slot(slot: int, size: int) -> int:
    """Return the index after `slot` in a ring buffer."""
    return slot + 1 if slot + 1 < size else 0
