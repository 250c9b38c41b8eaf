"""Exemplar-based clustering of the known map: goals are chosen greedily, one after another."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from robocov.controllers.placement.placement_controller import KnownTeam, PlacementController, PlacementMap
from robocov.k_median import compute_costs_with_column
from robocov.typing import IntArray


@dataclass(frozen=True)
class Exemplar(PlacementController):
    """Greedy choice of exemplars on the known map (after NavEX: Ghimire, Nieto-Granda and Kia 2025).

    Goals are chosen one after another among the points of a square lattice, each so that the mean geodesic
    distance from all points to the nearest goal becomes as low as possible. Points are weighted by the
    density of the map. There is no descent afterwards. The robots are then sent to the goals along shortest
    paths.

    Notes
    -----
    D. Ghimire, C. Nieto-Granda and S. S. Kia, "NavEX: A Multi-Agent Coverage in Non-Convex and Uneven
    Environments via Exemplar-Clustering" (arXiv 2504.21113). Let L(S) be the mean distance from all points to
    the nearest element of S. The utility of a set of exemplars S is

        f(S) = L({s0}) - L(S ∪ {s0}),

    where s0 is a phantom exemplar, farther from every point than any real one. The utility is monotone and
    submodular for any measure of distance. Therefore, the utility of the greedy choice is at least 1 - 1/e of
    the maximum (Nemhauser, Wolsey and Fisher 1978), or at least 1/2 of it if the free space has several
    components, each of which gets as many exemplars as it has robots. These bounds hold for f, not for the
    coverage cost L(S).

    Each robot computes the exemplars for the robots that it knows of; see `PlacementController`.

    We had only the abstract of the paper and a summary of its method, not the full text; details may differ.
    The paper computes distances with a visibility graph; these are the geodesic distances used here. It also
    covers uneven terrain, which robocov lacks.
    """

    name = "exemplar"
    label = "Exemplar clustering"
    summary = "greedy exemplars of the known map, without descent (after Ghimire et al. 2025, NavEX)"

    def choose_candidates(self, placement_map: PlacementMap, known_team: KnownTeam) -> IntArray:
        """Choose as many exemplars in each component of the configuration space as it has robots."""
        robot_counts = np.bincount(known_team.components)
        return _choose_cached_exemplars(placement_map, tuple(robot_counts.tolist()))


def choose_exemplars(placement_map: PlacementMap, robot_counts: IntArray) -> IntArray:
    """Choose candidates one after another, each so that the cost becomes as low as possible.

    Parameters
    ----------
    placement_map : PlacementMap
    robot_counts : (p,) int array
        Number of robots in each component of the configuration space, up to the last one with a robot.

    Returns
    -------
    (q,) int array
        The candidates, in the order in which they were chosen. There are fewer of them than robots if a
        component has too few.
    """
    components = placement_map.components
    remaining_counts = np.zeros(max(len(robot_counts), components.max(initial=-1) + 1), dtype=np.intp)
    remaining_counts[: len(robot_counts)] = robot_counts
    is_taken = np.zeros(len(components), dtype=bool)
    distances = np.full(len(placement_map.table), np.inf)
    chosen: list[int] = []
    while True:
        is_usable = ~is_taken & (remaining_counts[components] > 0)
        if not is_usable.any():
            return np.array(chosen, dtype=np.intp)
        costs = compute_costs_with_column(placement_map.table, distances)
        best = int(np.where(is_usable, costs, np.inf).argmin())
        chosen.append(best)
        is_taken[best] = True
        remaining_counts[components[best]] -= 1
        distances = np.minimum(distances, placement_map.table[:, best])


@lru_cache(maxsize=256)
def _choose_cached_exemplars(placement_map: PlacementMap, robot_counts: tuple[int, ...]) -> IntArray:
    """Return the cached result of `choose_exemplars`: several robots and plans need the same exemplars."""
    chosen = choose_exemplars(placement_map, np.array(robot_counts, dtype=np.intp))
    chosen.setflags(write=False)
    return chosen
