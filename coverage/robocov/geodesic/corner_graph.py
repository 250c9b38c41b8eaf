"""The graph of the corners that see each other, and shortest paths in it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

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
from robocov.typing import BoolArray, FloatArray, IntArray

NO_CORNER = -1
"""Used in place of a corner if a path is straight, and does not bend."""


class CornerGraph(NamedTuple):
    """A visibility graph: links between the corners that can follow each other on a shortest path.

    A link is a straight segment between two corners that see each other. There is a link in each direction.
    """

    link_starts: IntArray
    """(k + 1,) The links of corner i are those from ``link_starts[i]`` up to ``link_starts[i + 1]``."""
    neighbors: IntArray
    """(l,) The corner to which each link leads."""
    lengths: FloatArray
    """(l,) Length of each link, grid steps."""


class CornerPaths(NamedTuple):
    """Paths from several sources to all k corners, one for each corner; in the end, the shortest ones."""

    lengths: FloatArray
    """(k,) Length of each path, grid steps; inf if there is none."""
    sources: IntArray
    """(k,) The source at which each path starts."""
    first_corners: IntArray
    """(k,) The first corner of each path. If the path is straight, it is the corner where the path ends."""
    previous_corners: IntArray
    """(k,) The last corner of each path before its end, or `NO_CORNER` if the path is straight."""

    @classmethod
    def allocate(cls, corner_count: int) -> CornerPaths:
        """Allocate uninitialized paths to a given number of corners.

        Parameters
        ----------
        corner_count : int

        Returns
        -------
        CornerPaths
        """
        return cls(
            lengths=np.empty(corner_count),
            sources=np.empty(corner_count, np.int64),
            first_corners=np.empty(corner_count, np.int64),
            previous_corners=np.empty(corner_count, np.int64),
        )


class CornerQueue(NamedTuple):
    """A queue of corners whose outgoing links must be relaxed. `relax_paths` stores its head and tail."""

    corners: IntArray
    """(k + 1,) The corners in the queue: a ring buffer. One slot stays unused, so that a full queue differs
    from an empty one."""
    is_waiting: BoolArray
    """(k,) Whether each corner is in the queue."""

    @classmethod
    def allocate(cls, corner_count: int) -> CornerQueue:
        """Allocate an uninitialized queue with space for all corners.

        Parameters
        ----------
        corner_count : int

        Returns
        -------
        CornerQueue
        """
        return cls(corners=np.empty(corner_count + 1, np.int64), is_waiting=np.empty(corner_count, np.bool_))


def build_corner_graph(corner_count: int, pairs: IntArray, lengths: FloatArray) -> CornerGraph:
    """Build the graph of corners from the pairs of linked corners.

    Parameters
    ----------
    corner_count : int
        Number of corners.
    pairs : (p, 2) int array
        The linked corners, each pair once.
    lengths : (p,) array, grid steps
        Distance between the corners of each pair.

    Returns
    -------
    CornerGraph
        It has two links for each pair, one in each direction.
    """
    starts = np.concatenate([pairs[:, 0], pairs[:, 1]])
    ends = np.concatenate([pairs[:, 1], pairs[:, 0]])
    order = np.lexsort((ends, starts))
    return CornerGraph(
        link_starts=np.searchsorted(starts[order], np.arange(corner_count + 1)),
        neighbors=ends[order],
        lengths=np.tile(lengths, 2)[order],
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
        The walls around the source, at any distance.
    source : int
        Row of the source in the index.
    first_corner : int
        Only this corner and those with higher indices are considered.
    visible : (k,) int array
        Result: the corners that were found, at the beginning of the array.

    Returns
    -------
    int
        Number of corners that were found.
    """
    corners = walls.corners
    tree = walls.corner_tree
    x = index.positions[source, 0]
    y = index.positions[source, 1]
    count = 0
    node = ROOT
    while node != END_OF_TREE:
        is_empty = tree[node, LOW_X] == np.inf
        if is_empty or is_box_hidden(tree, node, index, source):
            node = skip_subtree(node)
        elif not is_leaf(tree, node):
            node = get_first_child(node)
        else:
            first_in_leaf = get_first_item(tree, node)
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
    lengths: FloatArray,
) -> int:
    """Find the corners with higher indices to which each corner of a range is linked.

    Two corners are linked if they see each other and a shortest path through both can bend at both of them.

    Parameters
    ----------
    walls : Walls
    visible : (k,) int array
        Scratch space.
    first, end : int
        The range of corners, from `first` up to but not including `end`.
    index : AngularWallIndex
        Scratch space for one source.
    pairs : (m, 2) int array
        Result: the linked corners, the one of the range first.
    lengths : (m, 1) array, grid steps
        Result: the distance between the corners of each pair.

    Returns
    -------
    int
        Number of pairs, or `NO_SPACE` if they do not fit into the result, or the walls into the index.
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
            # A path from `corner` can bend at each of the visible corners. A path from the visible corner
            # must also be able to bend at `corner`.
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
    """Shorten the paths to corners via other corners until all of them are shortest paths.

    A corner to which the path has become shorter waits in a queue until the paths from there to its neighbors
    have been tried (the Bellman-Ford algorithm with a queue). Of two paths of the same length, the one from
    the source with the lower index is taken.

    Parameters
    ----------
    graph : CornerGraph
    paths : CornerPaths
        Modified in place. On entry, the paths found so far, of infinite length where there is none.
    queue : CornerQueue
        On entry, the corners whose paths may shorten other ones, at the beginning of the queue.
    waiting_count : int
        Number of corners in the queue on entry.
    """
    # Corners join the queue at `tail` and leave it at `head`. It is empty if both are the same slot.
    size = len(queue.corners)
    head = 0
    tail = waiting_count
    while head != tail:
        corner = queue.corners[head]
        head = _get_next_slot(head, size)
        queue.is_waiting[corner] = False
        for link in range(graph.link_starts[corner], graph.link_starts[corner + 1]):
            neighbor = graph.neighbors[link]
            length = paths.lengths[corner] + graph.lengths[link]
            is_tie = length == paths.lengths[neighbor]
            if length < paths.lengths[neighbor] or (
                is_tie and paths.sources[corner] < paths.sources[neighbor]
            ):
                paths.lengths[neighbor] = length
                paths.sources[neighbor] = paths.sources[corner]
                paths.first_corners[neighbor] = paths.first_corners[corner]
                paths.previous_corners[neighbor] = corner
                if not queue.is_waiting[neighbor]:
                    queue.is_waiting[neighbor] = True
                    queue.corners[tail] = neighbor
                    tail = _get_next_slot(tail, size)


@kernel
def _get_next_slot(slot: int, size: int) -> int:
    """Return the index after `slot` in a ring buffer."""
    return slot + 1 if slot + 1 < size else 0
