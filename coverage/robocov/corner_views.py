"""Which corners the sites of a lattice see, in rows of one corner and one tile of sites."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov.grouping import beginnings, least, ranges, sizes
from robocov.lattice import TILE

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.arrays import Array, IntArray
    from robocov.geodesic import Geodesics
    from robocov.lattice import Lattice

_PAIRS = 1 << 16
"""Pairs of sites and corners looked at in one piece, which bounds the memory."""


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
        block = max(1, _PAIRS // len(x))
        pieces = [(np.empty(0, np.intp), np.empty(0, np.intp), np.empty((0, TILE * TILE)))]
        for begin in range(0, count, block):
            if progress is not None:
                progress(begin / count)
            corner = np.arange(begin, min(begin + block, count))
            row, site = paths.walls.useful(corner[:, None], x, y).nonzero()
            row += begin
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
