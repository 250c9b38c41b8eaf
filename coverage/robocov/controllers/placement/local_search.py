"""Local search for the k-median of the known map: goals move one at a time, each to the best point.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from robocov.controllers.gains import gain
from robocov.controllers.placement.placement_controller import KnownTeam, PlacementController, PlacementMap
from robocov.k_median import compute_costs_with_column
from robocov.typing import IntArray


@dataclass(frozen=True)
class LocalSearch(PlacementController):
    """Local search for the k-median of the known map (after Sadeghi, Asghar and Smith 2020).

    Robots take turns. In its turn, a robot compares all points of its own region and of the regions of the
    robots that it knows of: if it moved to another region, the others would take over its own. The best point
    becomes its goal if that lowers the cost of the team by more than the fraction `threshold`. The search
    ends when no robot finds such a point. Then the robots move to their goals along shortest paths.

    Notes
    -----
    A. Sadeghi, A. B. Asghar and S. L. Smith, "Approximation Algorithms for Distributed Multi-Robot Coverage
    in Non-Convex Environments" (arXiv 2005.02471). Lloyd's algorithm moves a robot only within its own
    region, and stops where one room has a robot too many and another one a robot too few. Moves to the
    regions of others lead out of such placements. If no single move improves a placement, it costs at most
    five times the optimum (Arya et al., SIAM J. Comput. 33, 2004). For a positive threshold, the bound is a
    little higher. It requires that all robots know of each other.

    The cost is (22) with the density, on the points of a square lattice and with geodesic distances. The
    search starts from the goals of the previous plan or, in the first plan, from the positions of the robots.
    Each robot computes the turns of all robots that it knows of; see `PlacementController`.

    We had only the abstract and the first lines of the paper, not its full text; details may differ. In the
    paper, robots exchange messages, and the bound requires twice the usual communication range. Here, robots
    know only positions.
    """

    name = "local-search"
    label = "Local search"
    summary = "k-median of the known map by single moves (after Sadeghi, Asghar and Smith 2020)"

    threshold: float = gain(1e-4, "1", "fraction of the cost that a move must save", high=1.0)

    def choose_candidates(self, placement_map: PlacementMap, known_team: KnownTeam) -> IntArray:
        """Choose candidates by local search, starting from the previous goals."""
        sources = placement_map.find_nearest_candidates(known_team.previous_goals, known_team.components)
        return _run_cached_search(placement_map, tuple(sources.tolist()), self.threshold)


def move_in_turn(placement_map: PlacementMap, sources: IntArray, threshold: float) -> IntArray:
    """Find the candidates to which robots move one after another, each to where the cost is lowest.

    The search ends when no move saves enough.

    Parameters
    ----------
    placement_map : PlacementMap
    sources : (k,) int array
        The candidate at which each robot is.
    threshold : float
        Fraction of the cost that a move must save.

    Returns
    -------
    (k,) int array
        The candidates after the last move. Each robot remains in its component of the configuration space.
    """
    sources = sources.copy()
    robot = 0
    turns_without_move = 0
    while turns_without_move < len(sources):
        other_sources = np.delete(sources, robot)
        other_distances = placement_map.table[:, other_sources].min(axis=1, initial=np.inf)
        costs = compute_costs_with_column(placement_map.table, other_distances)
        is_reachable = placement_map.components == placement_map.components[sources[robot]]
        best = int(np.where(is_reachable, costs, np.inf).argmin())
        turns_without_move += 1
        if costs[best] < costs[sources[robot]] * (1.0 - threshold):
            sources[robot] = best
            turns_without_move = 0
        robot = (robot + 1) % len(sources)
    return sources


@lru_cache(maxsize=256)
def _run_cached_search(placement_map: PlacementMap, sources: tuple[int, ...], threshold: float) -> IntArray:
    """Return the cached result of `move_in_turn`: several robots and plans start from the same sources."""
    chosen = move_in_turn(placement_map, np.array(sources, dtype=np.intp), threshold)
    chosen.setflags(write=False)
    return chosen
