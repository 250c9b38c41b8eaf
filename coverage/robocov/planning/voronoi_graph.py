"""Generalized Voronoi graph of the room that walls leave: the places as far from one wall as from another.

It is the roadmap of Choset and Burdick (IJRR 19, 2000), on a grid: a thinning of the room that keeps how it
is connected, its rings and what is halfway between two walls that face each other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel

_FACING = math.radians(120.0)  # angle between the directions to two walls, from which these face each other
_STEPS = np.array([(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)])
"""The neighbours of a cell, round it: those that share a side at even places."""


def voronoi_cells(room: BoolArray) -> BoolArray:
    """Return the cells of the generalized Voronoi graph of a room, (rows, columns), one or two cells wide.

    Cells are taken away from the walls inwards where that changes no connection (distance-ordered homotopic
    thinning, Pudney 1998), but for those whose nearest wall is in quite another direction than that of the
    cell beside: branches into corners vanish, those into rooms do not.
    """
    room = np.pad(room, 1)
    away, nearest = ndimage.distance_transform_edt(room, return_indices=True)
    facing = np.zeros_like(room)
    for axis in (0, 1):
        one, other = ((*(slice(None),) * axis, side) for side in (slice(None, -1), slice(1, None)))
        apart = np.sqrt((np.diff(nearest, axis=axis + 1) ** 2).sum(axis=0))
        # two points at a distance, seen under the angle, are so far apart
        far = apart > 2.0 * np.maximum(away[one], away[other]) * math.sin(0.5 * _FACING) + 1.0
        facing[one] |= far
        facing[other] |= far
    order = np.flatnonzero(room)
    order = order[np.argsort(away.ravel()[order], kind="stable")]
    _thin(room, facing & room, order, _STEPS)
    return room[1:-1, 1:-1]


@kernel
def _thin(room: BoolArray, kept: BoolArray, order: IntArray, steps: IntArray) -> None:
    """Take cells away in an order, again and again, as long as there are some that join nothing."""
    columns, changed = room.shape[1], True
    while changed:
        changed = False
        for cell in order:
            r, c = cell // columns, cell % columns
            if not room[r, c] or kept[r, c]:
                continue
            # it joins nothing when its neighbours are in one piece: Hilditch's crossing number is 1
            pieces = 0
            for k in range(0, 8, 2):
                if not room[r + steps[k, 0], c + steps[k, 1]]:
                    one, two = (k + 1) % 8, (k + 2) % 8
                    if (
                        room[r + steps[one, 0], c + steps[one, 1]]
                        or room[r + steps[two, 0], c + steps[two, 1]]
                    ):
                        pieces += 1
            if pieces == 1:
                room[r, c], changed = False, True


@kernel
def _grouped(cells: BoolArray, spacing: int, steps: IntArray) -> tuple[IntArray, IntArray]:
    """Return the cell with which each group begins, and the group of each cell, (rows, columns), -1 for none.

    A group are those cells that are not more steps than the spacing from its first one, and in no other yet.
    """
    rows, columns = cells.shape
    group, first = np.full(cells.shape, -1), np.empty(cells.size, dtype=np.intp)
    front, far, groups = np.empty(cells.size, dtype=np.intp), np.empty(cells.size, dtype=np.intp), 0
    for begin in range(cells.size):
        if not cells[begin // columns, begin % columns] or group[begin // columns, begin % columns] >= 0:
            continue
        first[groups], front[0], far[0], done, count = begin, begin, 0, 0, 1
        group[begin // columns, begin % columns] = groups
        while done < count:
            r, c, reached = front[done] // columns, front[done] % columns, far[done]
            done += 1
            for k in range(len(steps)):
                a, b = r + steps[k, 0], c + steps[k, 1]
                inside = 0 <= a < rows and 0 <= b < columns
                if reached < spacing and inside and cells[a, b] and group[a, b] < 0:
                    group[a, b], front[count], far[count] = groups, a * columns + b, reached + 1
                    count += 1
        groups += 1
    return first[:groups], group


@kernel
def _spread(group: IntArray, room: BoolArray, steps: IntArray) -> None:
    """Give each cell of a room the group of the nearest cell that is in one, by the number of steps."""
    rows, columns = room.shape
    front, done, count = np.empty(room.size, dtype=np.intp), 0, 0
    for cell in range(room.size):
        if group[cell // columns, cell % columns] >= 0:
            front[count], count = cell, count + 1
    while done < count:
        r, c = front[done] // columns, front[done] % columns
        done += 1
        for k in range(len(steps)):
            a, b = r + steps[k, 0], c + steps[k, 1]
            if 0 <= a < rows and 0 <= b < columns and room[a, b] and group[a, b] < 0:
                group[a, b] = group[r, c]
                front[count], count = a * columns + b, count + 1


class VoronoiGraph(NamedTuple):
    """Vertices along the generalized Voronoi graph of a room, each with the part of the room beside it."""

    vertices: IntArray  # (v, 2), row and column of the cells where they are
    distances: Array  # (v, v) along the graph, in sides of cells; infinite where it is in pieces
    region: IntArray  # (rows, columns), the vertex that each cell belongs to, -1 for none

    @classmethod
    def of(cls, room: BoolArray, free: BoolArray, spacing: float, most: int) -> VoronoiGraph:
        """Return the graph of a room, (rows, columns), with regions of all that is free.

        There is a vertex every `spacing` cells, or more, and about so many at most.
        """
        cells = voronoi_cells(room)
        steps = max(1, math.ceil(max(spacing, np.count_nonzero(cells) / most)))
        first, group = _grouped(cells, steps, _STEPS)
        vertices = np.column_stack(np.divmod(first, room.shape[1]))
        joined = []
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            one = group[: len(group) - down, max(0, -right) : group.shape[1] - max(0, right)]
            other = group[down:, max(0, right) : group.shape[1] + min(0, right)]
            beside = (one >= 0) & (other >= 0) & (one != other)
            joined.append(np.sort(np.column_stack([one[beside], other[beside]]), axis=1))
        begin, end = np.unique(np.concatenate(joined), axis=0).T
        length = np.sqrt(((vertices[begin] - vertices[end]) ** 2).sum(axis=1))
        graph = csr_array((length, (begin, end)), shape=(len(vertices), len(vertices)))
        _spread(group, free, _STEPS[::2])
        return cls(vertices, dijkstra(graph, directed=False), group)
