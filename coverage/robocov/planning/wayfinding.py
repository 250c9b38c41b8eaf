"""Ways among known walls: a lattice of nodes over a window of a raster, with distances and routes.

A node is joined to those one step away, diagonally, and a knight's move away: 16 directions, so that a way
on the lattice is at most 2.8 % longer than the shortest one. Two nodes are joined when no cell lies on the
straight line between them that is too close to a wall; nodes close to walls can be reached, and not passed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import count
from typing import Any, NamedTuple, TypeVar
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.planning.discovered import BLOCKS, UNKNOWN, DiscoveredMap, Raster, dilate, openness

Cell = TypeVar("Cell", bound=np.generic)

_MOVES = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (1, -2), (2, 1), (2, -1))
"""Rows and columns of half the directions; the others are their opposites."""

_DETOUR = 0.4  # part by which ways through what nobody has seen are longer, as walls turn up there
_NEAREST = 12  # so many nodes are tried for the first, and the last, of a route
_MOST_SOURCES, _NODES_OF_SOURCE = 180, 9  # a plan chooses among at most so many nodes, or one of so many
_REMEMBERED = 1000  # places whose nodes in sight are kept: on a map that stays the same robots go on
_FINE = 0.5  # a straight line is looked at after every so many cells


class Window(NamedTuple):
    """The part of a raster that carries nodes, one for each square block of cells."""

    row: int  # the first of its cells
    column: int
    rows: int  # of nodes
    columns: int
    stride: int  # cells along the side of a block

    @classmethod
    def around(cls, raster: Raster, middle: Array, reach: float, most: int) -> Window:
        """Return the window of at most `most` nodes that holds what is at most `reach` metres away.

        It has the finest blocks with which that goes, and moves on in steps of a quarter of the reach: it
        stays the same while the middle hardly moves.
        """
        rows, columns = raster.shape
        row, column = (int(k) for k in raster.cells(np.asarray(middle, dtype=float)))
        half = rows + columns if math.isinf(reach) else max(4, math.ceil(reach / raster.cell))
        low_row, high_row = _stepped(row, half, rows)
        low_column, high_column = _stepped(column, half, columns)
        high, wide = high_row - low_row, high_column - low_column
        stride = max(1, math.floor(math.sqrt(high * wide / most)))
        while math.ceil(high / stride) * math.ceil(wide / stride) > most:
            stride += 1
        return cls(low_row, low_column, math.ceil(high / stride), math.ceil(wide / stride), stride)

    def cut(self, cells: NDArray[Cell], fill: Cell | bool) -> NDArray[Cell]:
        """Return the window's part of (rows, columns) cells; beyond their last ones there is `fill`."""
        high, wide = self.rows * self.stride, self.columns * self.stride
        part = cells[self.row : self.row + high, self.column : self.column + wide]
        missing = high - part.shape[0], wide - part.shape[1]
        if missing == (0, 0):
            return part
        return np.pad(part, ((0, missing[0]), (0, missing[1])), constant_values=fill)

    def nodes(self, raster: Raster) -> Array:
        """Return the places of the nodes, (m, 2) m, row by row."""
        row, column = np.mgrid[: self.rows, : self.columns].reshape(2, -1) * self.stride + self.stride // 2
        return raster.middles(row + self.row, column + self.column)


def _stepped(middle: int, half: int, most: int) -> tuple[int, int]:
    step = max(1, half // 4)
    low = (middle - half) // step * step
    high = -((-middle - half - 1) // step) * step
    return max(0, low), min(most, high)


@dataclass(frozen=True, eq=False)
class GridPlanner:
    """Distances and routes in a window of a discovered map, around its walls."""

    known: DiscoveredMap
    window: Window
    clearance: float  # how far ways keep from walls, but for the last step to a node, m
    plans: dict[Any, Any] = field(default_factory=dict, repr=False)  # of a team, by what they come from
    _tables: dict[int, Array] = field(default_factory=dict, repr=False)
    _sights: dict[bytes, IntArray] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, known: DiscoveredMap, window: Window, clearance: float) -> GridPlanner:
        """Return the planner of a map, the one in use where robots that share the map have made it."""
        key = id(known), window, clearance  # whoever is found holds its map, so no other one has this id
        made = _IN_USE.get(key) or cls(known, window, clearance)
        return _IN_USE.setdefault(key, made)

    def updated(self, known: DiscoveredMap, window: Window) -> GridPlanner:
        """Return the planner for a later map and window; the same one where it makes no difference."""
        later = GridPlanner.of(known, window, self.clearance)
        same = self.window == window and np.array_equal(self.blocked, later.blocked)
        return self if same and np.array_equal(self.unknown, later.unknown) else later

    @cached_property
    def blocked(self) -> BoolArray:
        """The window's cells that are walls, (h, w)."""
        return self.window.cut(self.known.blocked, True)

    @cached_property
    def unknown(self) -> BoolArray:
        """The window's cells that the robot has not seen, (h, w)."""
        return np.asarray(self.window.cut(self.known.state, np.uint8(UNKNOWN)) == UNKNOWN)

    @cached_property
    def outside(self) -> BoolArray:
        """The window's cells that are not in the region, (h, w)."""
        return self.window.cut(self.known.raster.outside, True)

    @cached_property
    def free(self) -> BoolArray:
        """The window's cells that are known to be free, (h, w)."""
        return np.asarray(~(self.unknown | self.blocked | self.outside))

    @cached_property
    def openness(self) -> Array:
        """The chance of each unseen cell to be free, 0 for all others, (h, w)."""
        state = self.window.cut(self.known.state, np.uint8(UNKNOWN))
        return openness(state, self.outside, min(BLOCKS, self.window.rows * self.window.columns))

    @cached_property
    def patches(self) -> IntArray:
        """The numbers of the connected patches of what the robot has not seen, 0 for all else, (h, w)."""
        return np.asarray(ndimage.label(self.unknown & ~self.outside)[0])

    @cached_property
    def free_cells(self) -> Array:
        """For how many free cells each node stands, (m,)."""
        return self.sums(self.free)

    @cached_property
    def expected_cells(self) -> Array:
        """The same with the unknown ones, which count by their openness, (m,)."""
        return self.sums(self.free + self.openness)

    @cached_property
    def border(self) -> tuple[IntArray, IntArray, IntArray, BoolArray]:
        """The unseen cells beside free ones with room for a robot: row, column, patch, and on which sides.

        (b,) each, and (b, 4): right, above, left and below.
        """
        usable = np.pad(self.free & ~self.tight, 1)
        beside = np.stack([usable[1:-1, 2:], usable[2:, 1:-1], usable[1:-1, :-2], usable[:-2, 1:-1]], axis=-1)
        row, column = np.nonzero(beside.any(axis=-1) & (self.patches > 0))
        return row, column, self.patches[row, column], beside[row, column]

    @cached_property
    def unseen(self) -> tuple[IntArray, IntArray, Array]:
        """The free cells that are expected in a patch, by nodes: patch, node, and their number, (p,) each."""
        row, column = self.patches.nonzero()
        stride, m = self.window.stride, len(self.nodes)
        node = row // stride * self.window.columns + column // stride
        pair, index = np.unique(self.patches[row, column] * m + node, return_inverse=True)
        return pair // m, pair % m, np.bincount(index, self.openness[row, column]).astype(np.float64)

    def sums(self, worth: Array | BoolArray) -> Array:
        """Return the sums of the window's cells, (h, w), by nodes, (m,)."""
        _, _, rows, columns, stride = self.window
        blocks = worth.reshape(rows, stride, columns, stride)
        return np.asarray(blocks.sum(axis=(1, 3), dtype=np.float64).ravel())

    @property
    def spacing(self) -> float:
        """Between nodes, m."""
        return self.window.stride * self.known.raster.cell

    @cached_property
    def nodes(self) -> Array:
        """Places of the nodes, (m, 2) m, row by row."""
        return self.window.nodes(self.known.raster)

    @cached_property
    def tight(self) -> BoolArray:
        """The cells that are too close to walls, (h, w)."""
        return dilate(self.blocked, self.clearance / self.known.raster.cell)

    @cached_property
    def roomy(self) -> BoolArray:
        """The nodes that keep the clearance, (m,)."""
        half, stride = self.window.stride // 2, self.window.stride
        return np.asarray(~self.tight[half::stride, half::stride].ravel())

    @cached_property
    def _graph(self) -> csr_array:
        """The graph of the nodes, its edges as long as they are; those that nobody has seen count as longer.

        Nodes in tight cells are the ends of ways and nothing more: no way leads on from there, be it through
        a hole in a wall that has not been seen as a whole.
        """
        _, _, rows, columns, stride = self.window
        crossed = [_crossed(down, right, stride) for down, right in _MOVES]
        counts = np.array([len(cells) for cells in crossed])
        lengths = np.array([math.hypot(*move) for move in _MOVES]) * self.spacing
        graph = _joined(
            self.tight, self.blocked, self.unknown, self.roomy, (rows, columns, stride),
            np.array(_MOVES), lengths, counts, np.concatenate(crossed),
        )  # fmt: skip
        return csr_array(graph, shape=(rows * columns, rows * columns))

    @cached_property
    def _frame(self) -> tuple[float, float, float, int, int, int, int]:
        """Lower left corner and side of the raster's cells, m; first and last row and column here."""
        (rows, columns), (high, wide) = self.known.raster.shape, self.blocked.shape
        row, column = self.window[:2]
        last = min(row + high, rows) - 1, min(column + wide, columns) - 1
        return (*self.known.raster.origin, self.known.raster.cell, row, column, *last)

    @cached_property
    def sources(self) -> IntArray:
        """Every k-th node in both directions, as many as a plan for a team may choose among."""
        row, column = np.divmod(np.arange(len(self.nodes)), self.window.columns)
        for k in count(1):
            sources = np.flatnonzero(self.roomy & (row % k == k // 2) & (column % k == k // 2))
            if len(sources) <= max(_MOST_SOURCES, len(self.nodes) // _NODES_OF_SOURCE):
                break
        return sources

    @cached_property
    def source_distances(self) -> Array:
        """The distances from the sources to all nodes, (c, m) m."""
        return self.table(self.sources)

    def distances(self, node: int) -> Array:
        """Return the distances from a node to all nodes, (m,) m, infinite where there is no way."""
        if node not in self._tables:
            self._tables[node] = self.table(np.array([node]))[0]
        return self._tables[node]

    def near(self, nodes: Sequence[int], limit: float) -> list[Array]:
        """Return the same for some nodes, infinite beyond a limit, m; it is quicker the lower this is."""
        return [
            self._tables[node] if node in self._tables else self._ways([node], [0.0], limit) for node in nodes
        ]

    def table(self, nodes: IntArray) -> Array:
        """Return the distances from some nodes to all, (k, m) m."""
        return np.array([self._ways([node], [0.0]) for node in nodes.tolist()]).reshape(-1, len(self.nodes))

    def from_places(self, places: Array) -> Array:
        """Return the distances of all nodes, (m,) m, from the nearest of (k, 2) places between them."""
        seen = [self._in_sight(place) for place in places]
        away = [np.sqrt(((self.nodes[k] - at) ** 2).sum(axis=1)) for k, at in zip(seen, places, strict=True)]
        return self._ways(np.concatenate([[], *seen]), np.concatenate([[], *away]))

    def _ways(self, nodes: ArrayLike, away: ArrayLike, limit: float = math.inf) -> Array:
        """Return the distances from the nearest of some nodes, each of which is so far away already."""
        graph, begin, far = self._graph, np.asarray(nodes, dtype=np.intp), np.asarray(away, dtype=np.float64)
        edges: tuple[IntArray, IntArray, Array] = graph.indptr, graph.indices, graph.data  # type: ignore[assignment]
        return _distances(*edges, self.spacing, begin, far, limit)

    def nearest(self, place: Array) -> int:
        """Return the roomy node nearest to a place; -1 for none."""
        away = np.where(self.roomy, ((self.nodes - place) ** 2).sum(axis=1), np.inf)
        return int(away.argmin()) if self.roomy.any() else -1

    def standing(self, place: Array) -> int:
        """Return the node where somebody stands: the nearest roomy one in sight, or at all; -1 for none."""
        seen = self._in_sight(place)
        return int(seen[0]) if len(seen) else -1

    def _in_sight(self, place: Array) -> IntArray:
        """Return the roomy nodes in sight of those near a place; where there are none, the nearest."""
        key = place.tobytes()
        if key not in self._sights:
            if len(self._sights) >= _REMEMBERED:
                self._sights.clear()
            near = self._closest(place, self.roomy)
            seen = near[self.clear(place, self.nodes[near], self.blocked)]
            # who stands in what is taken for a wall is beside it
            self._sights[key] = seen if len(seen) else near[:1]
        return self._sights[key]

    def _closest(self, place: Array, among: BoolArray) -> IntArray:
        """Return some nodes near a place, the nearest first."""
        return _nearest(place, self.nodes, among, _NEAREST)

    def clear(self, place: Array, ends: Array, cells: BoolArray, skip: float = 0.0) -> BoolArray:
        """Return whether straight lines from a place to (k, 2) ends meet none of (h, w) cells.

        What is closer to the place than `skip` metres does not count: somebody may stand where no route
        leads, but away from there.
        """
        return _clear(place, ends, cells, self._frame, skip)

    def route(self, place: Array, goal: Array) -> Array:
        """Return the way-points from a place to a goal, (w, 2) m, each in sight of the one before it.

        The last one is the goal, or the nearest place to it that a way leads to. Between way-points no
        tight cell is crossed; only a place that is tight itself is left straight.
        """
        if self.clear(place, goal[None], self.tight, self.clearance)[0]:
            return np.array(goal[None])
        begin = self._entrance(place)
        if begin < 0:
            return np.array(place[None])
        tables = dijkstra(self._graph, indices=[begin], return_predecessors=True)
        distance, before = tables[0][0], tables[1][0]
        near = self._closest(goal, np.isfinite(distance) & self.roomy)
        if not len(near):
            return np.array(place[None])
        seen = self.clear(goal, self.nodes[near], self.tight)
        chain = [int(near[seen.argmax()])]
        while before[chain[-1]] >= 0:
            chain.append(int(before[chain[-1]]))
        points = self.nodes[chain[::-1]]
        return self._pulled(place, np.vstack([points, goal]) if seen.any() else points)

    def _entrance(self, place: Array) -> int:
        """Return the node with which a route begins: near, roomy, and in sight."""
        near = self._closest(place, self.roomy)
        for cells, skip in ((self.tight, 2.0 * self.clearance), (self.blocked, 0.0)):
            seen = self.clear(place, self.nodes[near], cells, skip)
            if seen.any():
                return int(near[seen.argmax()])
        return -1

    def _pulled(self, place: Array, points: Array) -> Array:
        """Return way-points without those that are passed in sight of later ones."""
        kept: list[Array] = []
        at, k = place, 0
        while k < len(points):
            seen = self.clear(at, points[k:], self.tight, 0.0 if kept else self.clearance).nonzero()[0]
            k += int(seen[-1]) if len(seen) else 0
            at = points[k]
            kept.append(at)
            k += 1
        return np.array(kept)


_IN_USE: WeakValueDictionary[tuple[int, Window, float], GridPlanner] = WeakValueDictionary()


@kernel
def _joined(
    tight: BoolArray, blocked: BoolArray, unknown: BoolArray, roomy: BoolArray, size: tuple[int, int, int],
    moves: IntArray, lengths: Array, counts: IntArray, crossed: IntArray,
) -> tuple[Array, IntArray, IntArray]:  # fmt: skip
    """Return the graph of a lattice as lengths, ends, and where the edges of each node begin.

    For each of the moves there is its length and how many cells it crosses, (m, 2) from that of its node on.
    """
    rows, columns, stride = size
    length = np.full((rows * columns, 5, 5), np.inf)
    first = 0
    for k in range(len(moves)):
        down, right = moves[k]
        for row in range(rows - down):
            for column in range(max(0, -right), columns - max(0, right)):
                top, left = stride // 2 + row * stride, stride // 2 + column * stride
                way, no_wall, unseen = True, True, 0
                for m in range(first, first + counts[k]):
                    i, j = top + crossed[m, 0], left + crossed[m, 1]
                    way, no_wall = way and not tight[i, j], no_wall and not blocked[i, j]
                    unseen += unknown[i, j]
                one, other = row * columns + column, (row + down) * columns + column + right
                far = lengths[k] * (1.0 + _DETOUR / counts[k] * unseen)
                if way or (no_wall and roomy[one] and not roomy[other]):
                    length[one, 2 + down, 2 + right] = far
                if way or (no_wall and roomy[other] and not roomy[one]):
                    length[other, 2 - down, 2 - right] = far
        first += counts[k]
    count = 0
    data, ends = np.empty(length.size), np.empty(length.size, dtype=np.intp)
    begins = np.zeros(rows * columns + 1, dtype=np.intp)
    for node in range(rows * columns):
        for down in range(5):
            for right in range(5):
                if length[node, down, right] < np.inf:
                    data[count] = length[node, down, right]
                    ends[count] = node + (down - 2) * columns + right - 2
                    count += 1
        begins[node + 1] = count
    return data[:count].copy(), ends[:count].copy(), begins


@kernel
def _distances(
    begins: IntArray, ends: IntArray, lengths: Array, least: float, nodes: IntArray, away: Array, limit: float
) -> Array:
    """Return the distances of all nodes of a graph, in rows of edges, from the nearest of some.

    Dijkstra's algorithm, but all nodes at once that are at most the length of the `least` edge farther than
    the nearest one, as no way to one of them leads over another.
    """
    distance = np.full(len(begins) - 1, np.inf)
    front, inside, count = np.empty(len(distance), dtype=np.intp), np.zeros(len(distance), dtype=np.bool_), 0
    for k in range(len(nodes)):
        distance[nodes[k]] = min(distance[nodes[k]], away[k])
        if not inside[nodes[k]]:
            front[count], inside[nodes[k]], count = nodes[k], True, count + 1
    settled = np.empty(len(distance), dtype=np.intp)
    while count:
        nearest = np.inf
        for k in range(count):
            nearest = min(nearest, distance[front[k]])
        found, left = 0, 0
        for k in range(count):
            if distance[front[k]] < nearest + least:
                settled[found], inside[front[k]], found = front[k], False, found + 1
            else:
                front[left], left = front[k], left + 1
        count = left
        for k in range(found):
            for edge in range(begins[settled[k]], begins[settled[k] + 1]):
                node, far = ends[edge], distance[settled[k]] + lengths[edge]
                if far < distance[node] and far <= limit:
                    distance[node] = far
                    if not inside[node]:
                        front[count], inside[node], count = node, True, count + 1
    return distance


@kernel
def _nearest(place: Array, nodes: Array, among: BoolArray, most: int) -> IntArray:
    """Return the nodes nearest to a place, the nearest first."""
    found, away, count = np.empty(most, dtype=np.intp), np.empty(most), 0
    for node in range(len(nodes)):
        far = (nodes[node, 0] - place[0]) ** 2 + (nodes[node, 1] - place[1]) ** 2
        if not among[node] or (count == most and far >= away[most - 1]):
            continue
        count = min(count + 1, most)
        k = count - 1
        while k > 0 and away[k - 1] > far:
            found[k], away[k] = found[k - 1], away[k - 1]
            k -= 1
        found[k], away[k] = node, far
    return found[:count]


@kernel
def _clear(
    place: Array,
    ends: Array,
    cells: BoolArray,
    frame: tuple[float, float, float, int, int, int, int],
    skip: float,
) -> BoolArray:
    """Return whether lines from a place to (k, 2) ends meet none of the cells farther away than `skip`."""
    low_x, low_y, side, row, column, last_row, last_column = frame
    length = np.empty(len(ends))
    for k in range(len(ends)):
        length[k] = math.sqrt((ends[k, 0] - place[0]) ** 2 + (ends[k, 1] - place[1]) ** 2)
    longest = 0.0
    for k in range(len(ends)):
        longest = max(longest, length[k])
    steps = math.ceil(longest / (_FINE * side)) + 1
    seen = np.ones(len(ends), dtype=np.bool_)
    for k in range(len(ends)):
        for step in range(steps + 1):
            part = step * (1.0 / steps) if step < steps else 1.0
            x = place[0] + (ends[k, 0] - place[0]) * part
            y = place[1] + (ends[k, 1] - place[1]) * part
            i, j = math.floor((y - low_y) * (1.0 / side)), math.floor((x - low_x) * (1.0 / side))
            i, j = min(max(i, row), last_row) - row, min(max(j, column), last_column) - column
            if cells[i, j] and not (skip > 0.0 and length[k] * part <= skip):
                seen[k] = False
                break
    return seen


@lru_cache(maxsize=512)
def _crossed(down: int, right: int, stride: int) -> tuple[tuple[int, int], ...]:
    """Return the cells, from that of a node, that the line to its neighbour crosses."""
    part = np.linspace(0.0, 1.0, 2 * max(down, abs(right)) * stride + 1)
    row, column = np.rint(part * down * stride).astype(int), np.rint(part * right * stride).astype(int)
    return tuple(dict.fromkeys(zip(row.tolist(), column.tolist(), strict=True)))
