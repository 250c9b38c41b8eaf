"""A table of distances from some positions to the sites, used to search for prices of the sites."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel

_MIN_SHARE = 1e-9
"""Smaller shares of a robot at a position are ignored, which saves most of the work."""


class PriceTable(NamedTuple):
    """Distances from p positions to the sites that may pay for a robot there.

    There is an entry for each pair of a position and such a site. The entries are sorted by position.
    """

    entry_starts: IntArray
    """(p + 1,) The entries of position k are those from ``entry_starts[k]`` up to ``entry_starts[k + 1]``."""
    sites: NDArray[np.int32]
    """(e,) The site of each entry."""
    distances: NDArray[np.float32]
    """(e,) Distance from the position of each entry to its site, m."""

    @classmethod
    def build_empty(cls) -> PriceTable:
        """Build a table without positions.

        Returns
        -------
        PriceTable
        """
        return cls(np.zeros(1, np.int64), np.empty(0, np.int32), np.empty(0, np.float32))

    def append(self, distances: Array, max_distances: Array) -> PriceTable:
        """Return a table with more positions at the end.

        Parameters
        ----------
        distances : (p, m) array, m
            Distances from the new positions to all sites.
        max_distances : (m,) array, m
            Only smaller distances to a site get an entry.

        Returns
        -------
        PriceTable
        """
        positions, sites = np.nonzero((distances < max_distances) & np.isfinite(distances))
        entry_counts = np.bincount(positions, minlength=len(distances))
        new_starts = self.entry_starts[-1] + np.cumsum(entry_counts)
        new_distances = distances[positions, sites].astype(np.float32)
        return PriceTable(
            entry_starts=np.append(self.entry_starts, new_starts),
            sites=np.append(self.sites, sites.astype(np.int32)),
            distances=np.append(self.distances, new_distances),
        )

    def compute_profits(self, prices: Array, weights: Array) -> Array:
        """Compute the profit of a robot at each position of the table.

        A site pays its price for a robot, less the distance to the robot, if the difference is positive. The
        profit is the sum of these payments, each times the weight of the site.

        Parameters
        ----------
        prices : (m,) array, m
            Prices of the sites.
        weights : (m,) array
            Weights of the sites.

        Returns
        -------
        (p,) array, m
        """
        profits = np.empty(len(self.entry_starts) - 1)
        _compute_profits(self, prices, weights, profits)
        return profits


@kernel
def _compute_profits(table: PriceTable, prices: Array, weights: Array, profits: Array) -> None:
    """Write the profit of each position: the sum over the sites of weight * max(price - distance, 0).

    Sites that are too far away to pay for a robot at a position have no entry in the table.
    """
    for position in range(len(profits)):
        profit = 0.0
        for entry in range(table.entry_starts[position], table.entry_starts[position + 1]):
            site = table.sites[entry]
            profit += weights[site] * max(prices[site] - table.distances[entry], 0.0)
        profits[position] = profit


@kernel
def add_paid_shares(table: PriceTable, prices: Array, shares: Array, paid_shares: Array) -> None:
    """Add up the shares of robots that each site pays for.

    The smoothed search divides the robots among the positions of the table. A site pays for a robot if the
    price of the site is higher than its distance to the robot.

    Parameters
    ----------
    table : PriceTable
    prices : (m,) array, m
        Prices of the sites.
    shares : (p,) array
        Number of robots at each position of the table, in general a fraction.
    paid_shares : (m,) array
        Result: for each site, the sum of the shares is added to the value that it has on entry.
    """
    for position in range(len(shares)):
        if shares[position] > _MIN_SHARE:
            for entry in range(table.entry_starts[position], table.entry_starts[position + 1]):
                site = table.sites[entry]
                if prices[site] > table.distances[entry]:
                    paid_shares[site] += shares[position]
