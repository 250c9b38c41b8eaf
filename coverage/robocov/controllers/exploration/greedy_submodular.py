"""Greedy placement on the map that the team discovers, followed by local descent.

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robocov.controllers.exploration.shared_map import (
    Candidates,
    Placement,
    SharedMapController,
    Situation,
    assign_goals,
)
from robocov.controllers.gains import gain
from robocov.k_median import choose_greedily, run_lloyd


@dataclass(frozen=True)
class GreedySubmodular(SharedMapController):
    """Greedy placement, followed by descent (after Sun, Cassandras and Meng 2019).

    Robots are placed one after another, each where it reduces the cost most, given the earlier ones; then all
    positions descend. The map is the one that the robots discover and share; unknown space that a path may
    lead to counts as free. When the map has changed, the team plans again. It keeps descending from the
    previous goals unless the new greedy solution saves the fraction `threshold` of the cost. Goals are
    assigned to robots so that the sum of the squared path lengths is minimal.

    Notes
    -----
    Sun, Cassandras and Meng (Automatica 100, 2019) start the distributed gradient descent of Zhong and
    Cassandras (IEEE T-AC 56, 2011) from the greedy solution. Coverage is monotone and submodular in the set
    of positions: the more positions there are, the less another one adds. The greedy solution therefore gains
    at least 1 - 1/e of the maximum gain (Nemhauser, Wolsey and Fisher 1978).

    The papers maximize a probability of detection on a known map. This controller minimizes the cost (22).
    The gain of a set of positions is the reduction of the cost of a single robot that is far from everything.
    This gain is submodular as well; the bound holds for it, not for the cost. The descent is Lloyd's
    iteration on geodesic cells, without interchange.

    We had only the abstracts of the papers, not their full texts; details may differ.
    """

    name = "greedy-submodular"
    label = "Greedy submodular"
    summary = "greedy placement on the shared map, then Lloyd's descent (after Sun, Cassandras and Meng 2019)"

    threshold: float = gain(0.01, "1", "fraction of the cost that a new greedy plan must save", high=1.0)

    def compute_placement(self, situation: Situation) -> Placement:
        """Compute the greedy placement, or the previous one if that is about as good, after descent."""
        weights = situation.compute_weights(~situation.known_map.is_blocked)
        candidates = Candidates.build_spread_out(situation, weights)
        count = len(situation.positions)
        if len(candidates.positions) < count:
            return Placement(goals=situation.positions, is_final=False)
        chosen = run_lloyd(candidates.table, choose_greedily(candidates.table, count))
        previous_goals = situation.previous_goals
        if np.isfinite(previous_goals).all():
            previous = run_lloyd(candidates.table, candidates.assign_to_positions(previous_goals))
            max_cost = (1.0 - self.threshold) * candidates.compute_cost(previous)
            if not candidates.compute_cost(chosen) < max_cost:
                chosen = previous
        goals = assign_goals(situation, candidates.refine(situation, weights, chosen))
        return Placement(goals=goals, is_final=True)
