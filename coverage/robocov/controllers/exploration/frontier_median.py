"""Exploration by frontiers, followed by placement of the robots at the k-median of the discovered map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from robocov.controllers.exploration.shared_map import (
    Candidates,
    Placement,
    SharedMapController,
    Situation,
    assign_goals,
)
from robocov.controllers.gains import gain
from robocov.k_median import choose_greedily, improve_sources
from robocov.planning.discovered_map import FREE, UNKNOWN, dilate
from robocov.typing import FloatArray, IntArray

_INSPECTED_RADIUS_M = 0.5
"""Targets closer than this to an inspected target are not worth a visit."""
_ARRIVAL_RADIUS_M = 0.3
"""Distance from a target at which a robot has inspected it."""
_MIN_PROGRESS_M = 0.05
"""A robot with a goal that moves less than this between two plans is stuck."""
_BLOCK = np.ones((3, 3), dtype=bool)
"""A cell and its eight neighbors."""
_BLOCK_RADIUS = 1.5
"""Radius, in cells, within which all eight neighbors of a cell lie: the square root of 2, rounded up."""


@dataclass(frozen=True)
class FrontierMedian(SharedMapController):
    """Exploration of the whole region by frontiers, and then the k-median of the discovered map.

    *Exploration.* Frontiers are the borders between known free space and unknown space (Yamauchi 1997, and
    1998 for several robots, which share their maps). Targets on the frontiers are assigned to robots by
    Burgard, Moors, Stachniss and Schneider (IEEE T-RO 21, 2005).

    *Placement.* When no frontier is left that a robot can reach, robots move to the k-median of the known
    free space: the greedy solution, improved by Lloyd's iteration and interchange (`robocov.k_median`), then
    on a finer lattice.

    Notes
    -----
    The pair of robot i and target t with the largest

        U_t - β V_t^i

    is assigned first, where V is the path length, and U is the utility, which is 1 at first. Then the utility
    of each target t' in view of t and within the sensing range R is reduced by 1 - |t - t'| / R, because a
    robot at t will see it. This is repeated for the remaining robots.

    We had only the abstracts of the papers, not their full texts; details may differ. The following choices
    are our own. The distance between targets is the spacing of the planning lattice. Small gaps between rays
    are ignored, and so are frontiers that are shorter than `shortest` or out of reach. A frontier is also
    ignored after a robot has been there, or was stuck on its path to it. A robot stays where it is if no
    target has any utility left for it; in the paper, it moves to a target even then.

    Robots out of communication range are assumed to have reached their targets, which then count as
    inspected. With a short range, robots may therefore stop exploring too early.
    """

    name = "frontier-median"
    label = "Frontiers, then k-median"
    summary = "explores by frontiers (Yamauchi 1997, Burgard et al. 2005), then moves to the map's k-median"

    period: float = gain(1.0, "s", "time between two plans", low=0.05, high=60.0)
    beta: float = gain(
        0.05, "1/m", "β, cost of a meter of path relative to the utility of a frontier", high=1e3
    )
    shortest: float = gain(0.15, "m", "minimum length of a frontier that is explored", high=100.0)
    threshold: float = gain(0.01, "1", "fraction of the cost that another placement must save", high=1.0)

    def compute_placement(self, situation: Situation) -> Placement:
        """Compute targets on frontiers or, if there are none, the final goals."""
        inspected = self._list_inspected_targets(situation)
        targets = self._find_targets(situation, inspected)
        path_lengths = self._compute_path_lengths(situation, targets)
        is_reachable = np.isfinite(path_lengths).any(axis=0)
        if is_reachable.any():
            goals = self._assign_targets(situation, targets[is_reachable], path_lengths[:, is_reachable])
            return Placement(goals=goals, is_final=False, inspected_targets=inspected)
        return Placement(goals=self._compute_median(situation), is_final=True, inspected_targets=inspected)

    def _list_inspected_targets(self, situation: Situation) -> FloatArray:
        """Return the targets that need no further visit, (t, 2) in meters."""
        previous_plan = situation.previous_plan
        if previous_plan is None:
            return np.empty((0, 2))
        inspected = previous_plan.placement.inspected_targets
        if previous_plan.placement.is_final:
            return inspected
        goals = situation.previous_goals
        has_arrived = np.sqrt(((situation.positions - goals) ** 2).sum(axis=1)) < _ARRIVAL_RADIUS_M
        # The previous group may have consisted of other robots: the nearest previous position counts.
        moves = situation.positions[:, None] - previous_plan.group.positions
        progress = np.sqrt((moves**2).sum(axis=2)).min(axis=1)
        is_stuck = np.isfinite(goals[:, 0]) & (progress < _MIN_PROGRESS_M)
        return np.unique(np.vstack([inspected, goals[has_arrived | is_stuck]]), axis=0)

    def _find_targets(self, situation: Situation, inspected: FloatArray) -> FloatArray:
        """Return positions on the frontiers, (t, 2) m."""
        raster = situation.known_map.raster
        map_window = situation.planner.map_window
        window = map_window.window
        labels = self._label_frontiers(situation)
        rows, columns = np.nonzero(labels)
        # Choose one target for each pair of a frontier and a node that represents some of its cells. A pair
        # is one number, so that the cells can be grouped by pair.
        nodes = window.find_nodes(rows, columns)
        pairs = labels[rows, columns] * len(map_window.nodes) + nodes
        _, first = np.unique(pairs, return_index=True)
        targets = raster.compute_centers(rows[first] + window.first_row, columns[first] + window.first_column)
        squared_distances = ((targets[:, None] - inspected) ** 2).sum(axis=2).min(axis=1, initial=np.inf)
        return np.asarray(targets[squared_distances > _INSPECTED_RADIUS_M**2])

    def _label_frontiers(self, situation: Situation) -> IntArray:
        """Return the label of the frontier, from 1, to which each cell of the window belongs; 0 for none."""
        map_window = situation.planner.map_window
        state = map_window.window.crop(situation.known_map.state, np.uint8(FREE))
        is_unknown = (state == UNKNOWN) & ~map_window.is_outside
        # Gaps between neighboring rays are not worth a visit: only blocks of 3 x 3 unknown cells count. For
        # this morphological opening, `dilate` takes less time than `scipy.ndimage`.
        is_block_center = ~dilate(~is_unknown, _BLOCK_RADIUS)
        is_in_block = dilate(is_block_center, _BLOCK_RADIUS, is_outside_marked=False)
        is_beside_area = dilate(is_in_block & ~map_window.is_near_wall, 1.0, is_outside_marked=False)
        is_frontier = (state == FREE) & ~map_window.is_near_wall & is_beside_area
        labels, _ = ndimage.label(is_frontier, _BLOCK)
        cell_size = situation.known_map.raster.cell_size
        is_long = np.bincount(labels.ravel()) * cell_size >= self.shortest
        return np.asarray(np.where(is_long[labels], labels, 0))

    def _compute_path_lengths(self, situation: Situation, targets: FloatArray) -> FloatArray:
        """Return the path length from each robot to each target, (k, t) m; infinite without a path."""
        planner = situation.planner
        map_window = planner.map_window
        clear_nodes = np.flatnonzero(map_window.has_clearance)
        if not len(targets) or not len(clear_nodes):
            return np.full((len(situation.positions), len(targets)), np.inf)
        squared_distances = ((targets[:, None] - map_window.nodes[clear_nodes]) ** 2).sum(axis=2)
        target_nodes = clear_nodes[squared_distances.argmin(axis=1)]
        return np.array(
            [planner.compute_distances_from(position[None])[target_nodes] for position in situation.positions]
        )

    def _assign_targets(
        self, situation: Situation, targets: FloatArray, path_lengths: FloatArray
    ) -> FloatArray:
        """Return the target of each robot, (k, 2) m, or its position if it has no target.

        The pair of a robot and a target with the largest U - β V is assigned first; see `FrontierMedian`.
        """
        planner = situation.planner
        goals = situation.positions.copy()
        utilities = np.ones(len(targets))
        is_unassigned = np.ones(len(goals), dtype=bool)
        for _ in range(len(goals)):
            is_possible = is_unassigned[:, None] & (utilities > 0.0)
            values = np.where(is_possible, utilities - self.beta * path_lengths, -np.inf)
            robot, target = np.unravel_index(values.argmax(), values.shape)
            if values[robot, target] == -np.inf:
                break
            goals[robot] = targets[target]
            is_unassigned[robot] = False
            # The robot will also see the other targets in view of its own, so these become less useful.
            distances = np.sqrt(((targets - targets[target]) ** 2).sum(axis=1))
            is_clear = planner.visibility.find_clear_lines(
                targets[target], targets, planner.map_window.is_blocked
            )
            is_in_view = (distances < situation.sensing_range) & is_clear
            utilities -= np.where(is_in_view, 1.0 - distances / situation.sensing_range, 0.0)
        return goals

    def _compute_median(self, situation: Situation) -> FloatArray:
        """Return the final goals of all robots, (k, 2) m."""
        weights = situation.compute_weights(situation.known_map.state == FREE)
        candidates = Candidates.build_spread_out(situation, weights)
        count = len(situation.positions)
        if len(candidates.positions) < count:
            return situation.positions
        previous_plan = situation.previous_plan
        goals = situation.previous_goals
        if previous_plan is not None and previous_plan.placement.is_final and np.isfinite(goals).all():
            first = candidates.assign_to_positions(goals)
            min_saving = self.threshold
        else:
            first = choose_greedily(candidates.table, count)
            min_saving = 0.0
        chosen = improve_sources(candidates.table, first, np.zeros(count, dtype=bool), min_saving)
        return assign_goals(situation, candidates.refine(situation, weights, chosen))
