"""Occupancy grid of one robot, filled by its own range scans.

A cell is *unknown* until a ray has passed it, or a robot was there (then it is *free*), or a ray has ended in
it (then it is a *wall*, until rays have passed it several times and none has ended there). The ends of
neighbouring rays that are closer together than `BRIDGE` belong to one surface: what lies between them is
*presumed* to be wall, until a ray passes there. Ways may lead through unknown cells; how much these count is
said by their `openness`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, BoolArray, IntArray
from robocov.compiled import kernel
from robocov.observation import compute_headings
from robocov.observation.region import Region

UNKNOWN, FREE, PRESUMED, WALL, SURE = 0, 1, 2, 3, 6
"""Evidence of a cell, the more the higher; from `WALL` to `SURE` it is one, the surer the higher."""

BRIDGE = 0.5  # no wider, m, than the passages that a robot should find; doors seen from afar would be closed
_STRIDE = 0.7  # a ray is looked at after every so many cells
_INTO = 0.25  # the obstacle is so many cells behind the end of a ray, which may be on the border of two cells
_CORE = 0.3  # a ray that passes the middle of a presumed cell, to so much of its side, shows that it is free

PRIOR, LONG = 0.8, 30.0  # openness of what is far, so many blocks, from all that is known
BLOCKS = 1000  # that a map is divided into, at most
_OVER = 1.9  # relaxation factor; the best for walks that end after `LONG` blocks
_SWEEPS, _EXACT = 1000, 1e-5


@dataclass(frozen=True, eq=False)
class Raster:
    """The square cells, of a side in m, that cover the bounding box of a region."""

    region: Region
    cell: float

    @property
    def origin(self) -> tuple[float, float]:
        """The lower left corner, m."""
        return self.region.bounds[:2]

    @cached_property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        low_x, low_y, high_x, high_y = self.region.bounds
        rows, columns = (high_y - low_y) / self.cell, (high_x - low_x) / self.cell
        return max(1, math.ceil(rows - 1e-9)), max(1, math.ceil(columns - 1e-9))

    @cached_property
    def outside(self) -> BoolArray:
        """The cells whose middle is outside the region, (rows, columns)."""
        return np.asarray(~self.region.contains(self.middles(*np.indices(self.shape))))

    def middles(self, row: IntArray, column: IntArray) -> Array:
        """Return the middles of cells, (..., 2) m."""
        x, y = self.origin
        return np.stack([x + (column + 0.5) * self.cell, y + (row + 0.5) * self.cell], axis=-1)

    def cells(self, points: Array) -> tuple[IntArray, IntArray]:
        """Return row and column of the cells that hold (..., 2) points, the nearest for points beside."""
        number = np.floor((points - self.origin) * (1.0 / self.cell)).astype(np.intp)
        number = np.minimum(np.maximum(number, 0), (self.shape[1] - 1, self.shape[0] - 1))
        return number[..., 1], number[..., 0]


@dataclass(frozen=True, eq=False)
class DiscoveredMap:
    """Occupancy grid of a robot. Immutable: whatever adds to it gives another map."""

    raster: Raster
    state: NDArray[np.uint8]  # (rows, columns), the lowest row first: `UNKNOWN`, `FREE`, `PRESUMED` or `WALL`

    def __post_init__(self) -> None:
        self.state.setflags(write=False)

    @classmethod
    def nothing(cls, raster: Raster) -> DiscoveredMap:
        """Return the map of who has not seen anything yet."""
        return cls(raster, np.zeros(raster.shape, dtype=np.uint8))

    def __deepcopy__(self, memo: object) -> DiscoveredMap:
        return self

    @cached_property
    def blocked(self) -> BoolArray:
        """The cells where there is a wall, or the region ends, (rows, columns)."""
        return np.asarray((self.state >= PRESUMED) | self.raster.outside)

    def scanned(self, position: Array, distances: Array, hit: BoolArray) -> DiscoveredMap:
        """Return the map with one scan more, taken at (2,) m; the same one where it tells nothing new."""
        state = self.state.copy()
        # beyond the region there is nothing to know
        far = np.minimum(distances, self.raster.region.diameter)
        grid = np.array([*self.raster.origin, self.raster.cell])
        _enter_scan(state, grid, position, compute_headings(len(distances)), far, hit)
        return self if np.array_equal(state, self.state) else DiscoveredMap(self.raster, state)

    def visited(self, places: Array, radius: float) -> DiscoveredMap:
        """Return the map after robots of a radius, m, were at (k, 2) m: they fit there, so it is free."""
        state = self.state.copy()
        _enter_visits(state, np.array([*self.raster.origin, self.raster.cell]), places, radius)
        return self if np.array_equal(state, self.state) else DiscoveredMap(self.raster, state)

    def walls_changed(self, before: DiscoveredMap) -> int:
        """Return how many cells of walls have gone, or appeared in the open, since an earlier map."""
        return (
            0
            if before is self
            else _walls_gone(before.state, self.state) + _walls_gone(self.state, before.state)
        )

    def merged(self, others: Iterable[DiscoveredMap]) -> DiscoveredMap:
        """Return the map with what others know of unseen cells; the same one where that is nothing."""
        state = self.state
        for other in others:
            # who has looked knows better than who presumes, and each knows best what it has seen itself
            unseen = (state == UNKNOWN) | ((state == PRESUMED) & (other.state != UNKNOWN))
            state = np.where(unseen, other.state, state)
        return self if np.array_equal(state, self.state) else DiscoveredMap(self.raster, state)


@kernel
def _walls_gone(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> int:
    """Return how many cells were walls before that are free now, with none but free cells around them.

    At the border of walls a cell is now free and now a wall, as it is looked at from here or there.
    """
    count, (rows, columns) = 0, before.shape
    for r in range(1, rows - 1):
        for c in range(1, columns - 1):
            if before[r, c] >= WALL and after[r, c] == FREE:
                open_around = True
                for i in range(r - 1, r + 2):
                    for j in range(c - 1, c + 2):
                        open_around = open_around and after[i, j] == FREE
                count += open_around
    return count


@kernel
def _cell_of(at: float, low: float, side: float, count: int) -> int:
    return min(max(math.floor((at - low) / side), 0), count - 1)


@kernel
def _enter_scan(
    state: NDArray[np.uint8], grid: Array, position: Array, headings: Array, distances: Array, hit: BoolArray
) -> None:
    """Enter what rays from a position show: free cells, presumed walls between their ends, walls."""
    low_x, low_y, side = grid
    rows, columns = state.shape
    for k in range(len(distances)):
        along = 0.5 * _STRIDE * side
        while along < distances[k] - _STRIDE * side:
            x, y = position[0] + along * headings[k, 0], position[1] + along * headings[k, 1]
            r, c = _cell_of(y, low_y, side, rows), _cell_of(x, low_x, side, columns)
            if state[r, c] == UNKNOWN:
                state[r, c] = FREE
            elif state[r, c] >= WALL:
                state[r, c] = FREE if state[r, c] == WALL else state[r, c] - 1
            elif state[r, c] == PRESUMED:
                off_x, off_y = (x - low_x) / side - c - 0.5, (y - low_y) / side - r - 0.5
                if max(abs(off_x), abs(off_y)) < _CORE:
                    state[r, c] = FREE
            along += _STRIDE * side
    ends = np.empty(headings.shape)
    for k in range(len(distances)):
        far = distances[k] + _INTO * side
        ends[k, 0], ends[k, 1] = position[0] + far * headings[k, 0], position[1] + far * headings[k, 1]
    for k in range(len(distances)):
        following = (k + 1) % len(distances)
        dx, dy = ends[following, 0] - ends[k, 0], ends[following, 1] - ends[k, 1]
        gap = math.sqrt(dx * dx + dy * dy)
        if hit[k] and hit[following] and 0.5 * side < gap < BRIDGE:
            steps = math.ceil(BRIDGE / (0.5 * side))
            for step in range(1, steps):
                x, y = ends[k, 0] + dx * step / steps, ends[k, 1] + dy * step / steps
                r, c = _cell_of(y, low_y, side, rows), _cell_of(x, low_x, side, columns)
                if state[r, c] == UNKNOWN:
                    state[r, c] = PRESUMED
                elif state[r, c] >= WALL:
                    state[r, c] = SURE
    for k in range(len(distances)):
        if hit[k]:
            r, c = _cell_of(ends[k, 1], low_y, side, rows), _cell_of(ends[k, 0], low_x, side, columns)
            state[r, c] = SURE


@kernel
def _enter_visits(state: NDArray[np.uint8], grid: Array, places: Array, radius: float) -> None:
    """Enter as free all cells, but for walls, whose middle is within a radius of one of the places."""
    low_x, low_y, side = grid
    rows, columns = state.shape
    for x, y in places:
        first, last = _cell_of(y - radius, low_y, side, rows), _cell_of(y + radius, low_y, side, rows)
        for r in range(first, last + 1):
            left, right = (
                _cell_of(x - radius, low_x, side, columns),
                _cell_of(x + radius, low_x, side, columns),
            )
            for c in range(left, right + 1):
                off_x, off_y = low_x + (c + 0.5) * side - x, low_y + (r + 0.5) * side - y
                if state[r, c] < WALL and off_x * off_x + off_y * off_y <= radius * radius:
                    state[r, c] = FREE


def dilate(blocked: BoolArray, reach: float) -> BoolArray:
    """Return the cells whose middle is at most `reach` sides from that of a blocked, or outer, cell."""
    margin = int(reach)
    padded, result = np.pad(blocked, margin, constant_values=True), np.zeros_like(blocked)
    row, column = np.mgrid[-margin : margin + 1, -margin : margin + 1]
    for up, right in np.argwhere(row**2 + column**2 <= reach * reach).tolist():
        result |= padded[up : up + len(blocked), right : right + blocked.shape[1]]
    return result


def openness(state: NDArray[np.uint8], outside: BoolArray, blocks: int = BLOCKS) -> Array:
    """Return how likely each unknown cell is free, from 0 to 1; 0 for all other cells, (rows, columns).

    The openness u of an unknown cell is the chance that a random walk among unknown cells, which begins
    there, comes to a free cell before it comes to a wall:

        Laplace(u) = 0,   u = 1 at free cells,   u = 0 at walls,   no flow through the border of the region.

    The inside of an obstacle has only walls around it; what lies in the shadow of one is open to where the
    shadow begins; the rock around a cave, though it is one patch with all that is unknown, is closed a few
    cells behind its walls. Where walks are very long they end by themselves, in `PRIOR`: of what is far from
    all that is known, nothing is known but how much of a usual region is free.

    It is solved on square blocks of cells, at most `blocks`: a block is one unknown, joined to its neighbours
    by as many cells as meet. The state is that of a `DiscoveredMap`; cells `outside` of the region do not
    count at all.

    >>> state = np.array([[3, 3, 3, 3], [3, 0, 1, 1], [3, 3, 3, 3]], dtype=np.uint8)
    >>> openness(state, np.zeros((3, 4), dtype=bool)).round(2)[1]
    array([0.  , 0.25, 0.  , 0.  ])
    """
    rows, columns = state.shape
    side = 1
    while -(-rows // side) * -(-columns // side) > blocks:
        side += 1
    return _relaxed(np.where(outside, 255, state).astype(np.uint8), side)


@kernel
def _meet(
    here: int, there: int, i: int, j: int, a: int, b: int, links: Array, open_to: Array, closed_to: Array
) -> None:
    """Count the border between a cell in block (i, j) and the next one, in block (a, b)."""
    if here == there:
        if here == UNKNOWN and (a > i or b > j):
            links[i, j] += 1.0
    elif here == UNKNOWN and there != 255:
        (open_to if there == FREE else closed_to)[i, j] += 1.0
    elif there == UNKNOWN and here != 255:
        (open_to if here == FREE else closed_to)[a, b] += 1.0


@kernel
def _relaxed(state: NDArray[np.uint8], side: int) -> Array:
    """Solve Laplace's equation on blocks by successive over-relaxation; 255 marks cells that do not count."""
    rows, columns = state.shape
    high, wide = -(-rows // side), -(-columns // side)
    # of each block: unknown cells, those beside that are free, walls, or unknown in the next blocks
    count, open_to, closed_to = np.zeros((high, wide)), np.zeros((high, wide)), np.zeros((high, wide))
    above, right = np.zeros((high + 1, wide + 1)), np.zeros((high + 1, wide + 1))
    for r in range(rows):
        i = r // side
        for c in range(columns):
            j, here = c // side, state[r, c]
            if here == UNKNOWN:
                count[i, j] += 1.0
            if r + 1 < rows:
                _meet(here, state[r + 1, c], i, j, (r + 1) // side, j, above, open_to, closed_to)
            if c + 1 < columns:
                _meet(here, state[r, c + 1], i, j, i, (c + 1) // side, right, open_to, closed_to)
    u = np.full((high + 1, wide + 1), PRIOR)
    for _ in range(_SWEEPS):
        change = 0.0
        for i in range(high):
            for j in range(wide):
                if count[i, j] == 0.0:
                    continue
                # the middles of two blocks are one side apart, a block's border is half a side from its own
                lost = count[i, j] / (side * LONG**2)
                flow = 2.0 * open_to[i, j] + lost * PRIOR
                links = 2.0 * (open_to[i, j] + closed_to[i, j]) + lost
                # row and column -1 are the spare ones, without links
                flow += above[i, j] * u[i + 1, j] + above[i - 1, j] * u[i - 1, j]
                flow += right[i, j] * u[i, j + 1] + right[i, j - 1] * u[i, j - 1]
                links += above[i, j] + above[i - 1, j] + right[i, j] + right[i, j - 1]
                step = _OVER * (flow / links - u[i, j])
                u[i, j] += step
                change = max(change, abs(step))
        if change < _EXACT:
            break
    result = np.zeros((rows, columns))
    for r in range(rows):
        for c in range(columns):
            if state[r, c] == UNKNOWN:
                result[r, c] = min(max(u[r // side, c // side], 0.0), 1.0)
    return result
