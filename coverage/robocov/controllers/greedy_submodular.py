"""Greedy placement on the map that the team discovers, and local descent from there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robocov.controllers.gains import gain
from robocov.controllers.shared_map import Candidates, Placement, SharedMapController, Situation, assign_goals
from robocov.k_median import choose_greedily, run_lloyd


@dataclass(frozen=True)
class GreedySubmodular(SharedMapController):
    """Each place in turn is where it helps the most, given the earlier ones; then all descend.

    Sun, Cassandras and Meng (Automatica 100, 2019) start the distributed gradient descent of Zhong and
    Cassandras (IEEE T-AC 56, 2011) from the greedy solution. Coverage is monotone and submodular in the set
    of places: each place adds the less the more there are, so that the greedy ones gain at least 1 - 1/e of
    what the best ones gain (Nemhauser, Wolsey and Fisher 1978).

    The papers maximise a probability of detection on a known map. Here it is the cost (22): the gain of a set
    of places is by how much it lowers the cost of one robot that is far from everything, which is submodular,
    too; the bound holds for that gain, not for the cost. The descent is Lloyd's iteration on geodesic cells,
    without any interchange. The map is the one that the robots discover and share; what is not known to be
    wall counts as free where a way may lead to. As it grows the team plans anew, and keeps the former places,
    descending from them, where greedy ones save less than the part `threshold` of the cost. Who goes where is
    such that the sum of the squared ways is the least.

    Taken from the abstracts of the papers and what is generally known of them, not from their text.
    """

    name = "greedy-submodular"
    label = "Greedy submodular"
    summary = "greedy placement on the shared map, then Lloyd's descent (after Sun, Cassandras and Meng 2019)"

    threshold: float = gain(0.01, "1", "part of the cost that a greedy plan made anew must save", high=1.0)

    def compute_placement(self, situation: Situation) -> Placement:
        notes = np.empty((0, 2))
        weights = situation.compute_weights(~situation.known_map.is_blocked)
        candidates = Candidates.build_at_nodes(situation, weights, situation.planner.sources)
        count = len(situation.positions)
        if len(candidates.positions) < count:
            return Placement(goals=situation.positions, is_final=False, notes=notes)
        chosen = run_lloyd(candidates.table, choose_greedily(candidates.table, count))
        if np.isfinite(situation.former_goals).all():
            former = run_lloyd(candidates.table, candidates.find_nearest(situation.former_goals))
            max_cost = (1.0 - self.threshold) * candidates.compute_cost(former)
            if not candidates.compute_cost(chosen) < max_cost:
                chosen = former
        goals = assign_goals(situation, candidates.refine(situation, weights, chosen))
        return Placement(goals=goals, is_final=True, notes=notes)
