"""Which corners the sites of a lattice see, in rows of one corner and one tile of sites."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.arrays.grouping import beginnings, least, ranges, sizes
from robocov.cost.lattice import TILE
from robocov.geodesic.visibility import pseudo_angle

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.arrays import Array, IntArray
    from robocov.cost.lattice import Lattice
    from robocov.geodesic import Geodesics

_PAIRS = 1 << 16
"""Pairs of tiles and corners looked at in one piece, which bounds the memory."""

_RADII = (1, 3, 7, 15, 31)
"""Bins to either side that a tile may span, each at most one more than twice the one before."""

_PAD = 1e-9
"""Far more than rounding."""


class CornerViews:
    """For each tile the corners useful to one of its sites and in view of it.

    Parameters
    ----------
    lattice : Lattice
    corner : (r,)
        The corner of each row; the rows follow the tiles.
    first : (t + 1,)
        The rows of a tile are those from its own `first` up to the next.
    length : (r, 16) grid steps
        From the corner to the cells of the tile; inf where it is of no use or not in view.
    """

    def __init__(self, lattice: Lattice, corner: IntArray, first: IntArray, length: Array) -> None:
        self.corner, self.first, self.length = corner, first, length
        self._least = length.min(axis=1, initial=np.inf)
        used = np.zeros((lattice.tiles, TILE * TILE), dtype=bool)
        used[lattice.tile, lattice.slot] = True
        self._most = np.where(used.repeat(np.diff(first), axis=0), length, 0.0).max(axis=1, initial=0.0)

    @classmethod
    def looked_for(
        cls, paths: Geodesics, lattice: Lattice, progress: Callable[[float], None] | None = None
    ) -> CornerViews:
        """Return the views by looking from every corner at every site.

        Parameters
        ----------
        paths : Geodesics
        lattice : Lattice
        progress : callable
            Called now and then with the part that is done. It may raise, to give up.
        """
        x, y = lattice.x[lattice.by_tile], lattice.y[lattice.by_tile]
        count = len(paths.corner_x)
        block = max(1, _PAIRS // lattice.tiles)
        pieces = [(np.empty(0, np.intp), np.empty(0, np.intp), np.empty((0, TILE * TILE)))]
        for begin in range(0, count, block):
            if progress is not None:
                progress(begin / count)
            row, tile = _perhaps_seen(paths, lattice, begin, min(begin + block, count))
            many = lattice.first[tile + 1] - lattice.first[tile]
            row, site = row.repeat(many), ranges(lattice.first[tile], many)
            useful = paths.walls.useful(row, x[site], y[site]).nonzero()[0]
            row, site = row[useful], site[useful]
            dx, dy = x[site] - paths.corner_x[row], y[site] - paths.corner_y[row]
            distance2 = dx * dx + dy * dy
            seen = paths.corner_fans.see_along(row, dx, dy, distance2).nonzero()[0]
            if len(seen):
                row, site, distance = row[seen], site[seen], np.sqrt(distance2[seen])
                # a row for every corner and tile that occur together
                group = beginnings(row * lattice.tiles + lattice.tile[site])
                length = np.full((len(group), TILE * TILE), np.inf)
                number = np.arange(len(group)).repeat(sizes(group, len(row)))
                length[number, lattice.slot[site]] = distance
                pieces.append((row[group], lattice.tile[site[group]], length))
        corner, tile, length = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
        order = np.argsort(tile, kind="stable")
        first = np.searchsorted(tile[order], np.arange(lattice.tiles + 1))
        return cls(lattice, corner[order], first, length[order])

    def shortest(self, tile: IntArray, slot: IntArray, distance: Array) -> tuple[Array, IntArray]:
        """Return the least distance of (h,) sites by way of a corner, inf for none, and that corner.

        Parameters
        ----------
        tile, slot : (h,)
            The sites, by tile.
        distance : (k,) grid steps
            From the corners to the nearest robot.
        """
        best, way = np.full(len(tile), np.inf), np.zeros(len(tile), dtype=np.intp)
        begin = beginnings(tile)
        tiles, sites = tile[begin], sizes(begin, len(tile))
        first = self.first[tiles]
        count = self.first[tiles + 1] - first
        row, place = ranges(first, count), np.arange(len(tiles)).repeat(count)
        start = distance[self.corner[row]]
        # a row cannot be the best for any site of its tile where another one is better for all of them
        bound = np.full(len(tiles), np.inf)
        np.minimum.at(bound, place, start + self._most[row])
        low = start + self._least[row]
        some = ((low <= bound[place]) & (low < np.inf)).nonzero()[0]
        row, start, count = row[some], start[some], np.bincount(place[some], minlength=len(tiles))
        # every site with every row of its tile that is left
        first, count = (count.cumsum() - count).repeat(sites), count.repeat(sites)
        entry, site = ranges(first, count), np.arange(len(tile)).repeat(count)
        total = start[entry] + self.length.take(row[entry] * TILE**2 + slot[site])
        least(site, total, best, (way, self.corner[row[entry]]))
        return best, way


def _perhaps_seen(paths: Geodesics, lattice: Lattice, begin: int, end: int) -> tuple[IntArray, IntArray]:
    """Return the pairs of a corner, from `begin` to `end`, and a tile that may have a site in useful view."""
    walls = paths.walls
    middle_x, middle_y = (lattice.low_x + lattice.high_x) / 2.0, (lattice.low_y + lattice.high_y) / 2.0
    half_x, half_y = (lattice.high_x - lattice.low_x) / 2.0, (lattice.high_y - lattice.low_y) / 2.0
    dx = middle_x - paths.corner_x[begin:end, None]
    dy = middle_y - paths.corner_y[begin:end, None]
    # useful is what is neither behind both of the corner's walls nor in front of both
    in_front = behind = np.ones(dx.shape, dtype=bool)
    for wall_x, wall_y in (walls.corner_in[:, begin:end, None], walls.corner_out[:, begin:end, None]):
        side = wall_x * dy - wall_y * dx
        beside = (np.abs(wall_x) * half_y + np.abs(wall_y) * half_x) * (1.0 + _PAD) + _PAD * np.abs(side)
        in_front, behind = in_front & (side > beside), behind & (side < -beside)
    row, tile = (~(in_front | behind)).nonzero()

    # what begins beyond the horizon in all directions in which it lies is hidden
    dx, dy, half_x, half_y = dx[row, tile], dy[row, tile], half_x[tile], half_y[tile]
    apart = np.hypot(dx, dy)
    near2 = np.maximum(np.abs(dx) - half_x, 0.0) ** 2 + np.maximum(np.abs(dy) - half_y, 0.0) ** 2
    horizons = _widened(paths.corner_fans.horizons(begin, end))
    bins = horizons.shape[-1]
    # a pseudo-angle grows by at most the angle, of which a half turn is at most pi/2 by its sine
    wide = np.hypot(half_x, half_y) * (np.pi / 2.0) * (bins / 4.0) / np.maximum(apart, 1.0) + 1.0
    level = np.searchsorted(_RADII, wide)
    bin_ = np.minimum((pseudo_angle(dx, dy) * (bins / 4.0)).astype(np.intp), bins - 1)
    far = np.append(horizons, np.full((1, *horizons.shape[1:]), np.inf), axis=0)[level, row, bin_]
    some = (near2 * (1.0 - _PAD) <= far).nonzero()[0]
    return row[some] + begin, tile[some]


def _widened(horizons: Array) -> Array:
    """Return for (k, bins) the farthest horizon of any bin up to each of `_RADII` away, (radii, k, bins)."""
    widened = []
    reached = 0
    for radius in _RADII:
        step = radius - reached
        sides = np.roll(horizons, step, axis=1), np.roll(horizons, -step, axis=1)
        horizons = np.maximum(np.maximum(*sides), horizons)
        widened.append(horizons)
        reached = radius
    return np.array(widened)
