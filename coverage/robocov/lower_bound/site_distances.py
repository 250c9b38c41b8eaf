"""Distances from candidate positions to the sites, used to search for prices of the sites.

Prices are the variables of the Lagrangian dual; see `lower_bound`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from robocov.compiled import kernel
from robocov.typing import Float32Array, FloatArray, Int32Array, IntArray

_MIN_ROBOT_COUNT = 1e-9
"""Positions with a smaller number of robots are ignored, which saves most of the work."""


class SiteDistances(NamedTuple):
    """Distances from p positions to the sites near them, in compressed sparse row form.

    There is an entry for each pair of a position and a site that may pay for a robot there. The entries are
    sorted by position.
    """

    entry_starts: IntArray
    """(p + 1,) The entries of position k are those from ``entry_starts[k]`` up to ``entry_starts[k + 1]``."""
    sites: Int32Array
    """(e,) The site of each entry."""
    distances: Float32Array
    """(e,) Distance from the position of each entry to its site, m."""

    @classmethod
    def build_empty(cls) -> SiteDistances:
        """Build a table without positions.

        Returns
        -------
        SiteDistances
        """
        return cls(np.zeros(1, np.int64), np.empty(0, np.int32), np.empty(0, np.float32))

    def with_positions(self, distances: FloatArray, max_distances: FloatArray) -> SiteDistances:
        """Return a table with more positions at the end.

        Parameters
        ----------
        distances : (p, m) array, m
            Distances from the new positions to all m sites.
        max_distances : (m,) array, m
            Only smaller distances to a site get an entry.

        Returns
        -------
        SiteDistances
        """
        positions, sites = np.nonzero((distances < max_distances) & np.isfinite(distances))
        entry_counts = np.bincount(positions, minlength=len(distances))
        new_starts = self.entry_starts[-1] + np.cumsum(entry_counts)
        new_distances = distances[positions, sites].astype(np.float32)
        return SiteDistances(
            entry_starts=np.append(self.entry_starts, new_starts),
            sites=np.append(self.sites, sites.astype(np.int32)),
            distances=np.append(self.distances, new_distances),
        )

    def compute_profits(self, prices: FloatArray, weights: FloatArray) -> FloatArray:
        """Compute the profit of a robot at each position of the table.

        A site pays its price for a robot, less the distance to the robot, if the difference is positive. The
        profit is the sum of these payments, each times the weight of the site.

        Parameters
        ----------
        prices : (m,) array, m
            Prices of the sites. Each must be at most the `max_distances` of its site in every call of
            `with_positions`, because more distant sites have no entry and would not pay.
        weights : (m,) array
            Weights of the sites.

        Returns
        -------
        (p,) array, m
        """
        profits = np.empty(len(self.entry_starts) - 1)
        _write_profits(self, prices, weights, profits)
        return profits

    def count_paid_robots(self, prices: FloatArray, robot_counts: FloatArray) -> FloatArray:
        """Count the robots that each site pays for, for a fractional number of robots at each position.

        A site pays for a robot if the price of the site is higher than its distance to the robot.
        Positions with at most 1e-9 robots are ignored.

        Parameters
        ----------
        prices : (m,) array, m
            Prices of the sites, limited as in `compute_profits`.
        robot_counts : (p,) array
            Number of robots at each position of the table, which need not be an integer.

        Returns
        -------
        (m,) array
        """
        paid_robot_counts = np.zeros(len(prices))
        _add_paid_robots(self, prices, robot_counts, paid_robot_counts)
        return paid_robot_counts


@kernel
def _write_profits(
    table: SiteDistances, prices: FloatArray, weights: FloatArray, profits: FloatArray
) -> None:
    """Write the profit of each position: the sum over the sites of weight * max(price - distance, 0)."""
    for position in range(len(profits)):
        profit = 0.0
        for entry in range(table.entry_starts[position], table.entry_starts[position + 1]):
            site = table.sites[entry]
            profit += weights[site] * max(prices[site] - table.distances[entry], 0.0)
        profits[position] = profit


@kernel
def _add_paid_robots(
    table: SiteDistances, prices: FloatArray, robot_counts: FloatArray, paid_robot_counts: FloatArray
) -> None:
    """Add the number of robots at each position to the counts of all sites that pay for a robot there."""
    for position in range(len(robot_counts)):
        if robot_counts[position] > _MIN_ROBOT_COUNT:
            for entry in range(table.entry_starts[position], table.entry_starts[position + 1]):
                site = table.sites[entry]
                if prices[site] > table.distances[entry]:
                    paid_robot_counts[site] += robot_counts[position]
