"""A table of distances from some positions, used to search for prices of the sites."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array, IntArray
from robocov.compiled import kernel

_MIN_SHARE = 1e-9
"""Smaller shares of a robot are ignored, which saves most of the work."""


class PriceTable(NamedTuple):
    """Distances from p positions to the sites that may pay for a robot there, one entry per pair."""

    first_entry: IntArray
    """(p + 1,) The entries of position k are those from ``first_entry[k]`` up to ``first_entry[k + 1]``."""
    site: NDArray[np.int32]
    """(e,) The site of each entry."""
    distance: NDArray[np.float32]
    """(e,) Distance from the position to the site, m."""

    @classmethod
    def build_empty(cls) -> PriceTable:
        """Build a table without positions.

        Returns
        -------
        PriceTable
        """
        return cls(np.zeros(1, np.int64), np.empty(0, np.int32), np.empty(0, np.float32))

    def append(self, distances: Array, max_distance: Array) -> PriceTable:
        """Return the table with more positions at the end.

        Parameters
        ----------
        distances : (p, m) array, m
            Distances from the new positions to all sites.
        max_distance : (m,) array, m
            Only smaller distances get an entry.

        Returns
        -------
        PriceTable
        """
        position, site = np.nonzero((distances < max_distance) & np.isfinite(distances))
        count = np.bincount(position, minlength=len(distances))
        return PriceTable(
            first_entry=np.append(self.first_entry, self.first_entry[-1] + np.cumsum(count)),
            site=np.append(self.site, site.astype(np.int32)),
            distance=np.append(self.distance, distances[position, site].astype(np.float32)),
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
        profits = np.empty(len(self.first_entry) - 1)
        _compute_profits(self, prices, weights, profits)
        return profits


@kernel
def _compute_profits(table: PriceTable, prices: Array, weights: Array, profits: Array) -> None:
    """Write the profit of each position: the sum over the sites of weight * max(price - distance, 0).

    Sites that are too far away to pay for a robot at a position have no entry in the table.
    """
    for position in range(len(profits)):
        profit = 0.0
        for entry in range(table.first_entry[position], table.first_entry[position + 1]):
            site = table.site[entry]
            profit += weights[site] * max(prices[site] - table.distance[entry], 0.0)
        profits[position] = profit


@kernel
def add_paid_shares(table: PriceTable, prices: Array, shares: Array, paid_shares: Array) -> None:
    """Add up the shares of robots that each site pays for.

    The smoothed search divides the robots among the positions of the table. A site pays for a robot if its
    price is above the distance to the robot.

    Parameters
    ----------
    table : PriceTable
    prices : (m,) array, m
    shares : (p,) array
        The share of a robot that is at each position of the table.
    paid_shares : (m,) array
        Result: the sum for each site is added to its value.
    """
    for position in range(len(shares)):
        if shares[position] > _MIN_SHARE:
            for entry in range(table.first_entry[position], table.first_entry[position + 1]):
                site = table.site[entry]
                if prices[site] > table.distance[entry]:
                    paid_shares[site] += shares[position]
