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
from robocov.controllers.exploration.visits import NO_VISIT, Visits
from robocov.controllers.gains import gain
from robocov.k_median import choose_greedily, improve_sources
from robocov.planning.discovered_map import FREE, UNKNOWN, dilate
from robocov.typing import FloatArray, IntArray

_ARRIVAL_RADIUS_M = 0.3
"""Distance from a target at which a robot has inspected it."""
_WAITING_TIME_S = 3.0
"""Time for which robots may wait at or before a target, s, before it is given up."""
_TRAVEL_TIME_FACTOR = 2.0
"""Maximum time to a target, relative to the time along the shortest path at the maximum speed."""
_NO_TARGET = -1
"""Index that stands for no target."""
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
    are ignored, and so are frontiers that are shorter than `shortest` or out of reach.

    *Targets of others.* Robots out of communication range are assumed to be at their targets. Because this is
    uncertain, the robots in range share these targets when no other target has any utility left for them. A
    robot stays where it is if the targets of robots in range leave no utility for it; in the paper, it moves
    to a target even then. With unlimited communication, staying saves path length.

    *End of exploration.* A target is not visited again after a robot has arrived there. Robots out of range
    are only assumed to arrive, so they end no visit unless a report says so. A target is given up when robots
    in range have headed for it for longer than 3 s plus twice the time that the nearest of them would need at
    the maximum speed of the robot that plans. Every exploration therefore comes to an end. Targets closer
    than 0.5 m to each other count as one. Robots do not wait for frontiers that only robots out of range
    could reach.

    *Reports of visits.* With a limited communication range, robots make different plans. A robot might wait
    for another robot to visit a target that the other one has already visited or given up. After each plan, a
    robot therefore reports the targets of all visits that it knows to be over, including those that others
    have reported to it. While all robots are in range of each other, a robot sends a report only if another
    robot has come into range since its last plan.
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
        visits = _stop_visits(situation)
        targets = self._find_targets(situation, visits)
        path_lengths = self._compute_path_lengths(situation, targets)
        # Robots out of range may not be where they are assumed to be: do not wait for them.
        is_in_range = situation.group.is_in_range
        is_reachable = np.isfinite(path_lengths[is_in_range]).any(axis=0)
        if not is_reachable.any():
            return Placement(goals=self._compute_median(situation), is_final=True, visits=visits)
        targets = targets[is_reachable]
        path_lengths = path_lengths[:, is_reachable]
        unassigned = np.full(len(is_in_range), _NO_TARGET)
        assignment = self._assign_targets(situation, targets, path_lengths, unassigned)
        # Robots out of range may never arrive: robots in range without a target share theirs.
        assignment[is_in_range] = self._assign_targets(
            situation, targets, path_lengths[is_in_range], assignment[is_in_range]
        )
        goals = np.where((assignment == _NO_TARGET)[:, None], situation.positions, targets[assignment])
        visits = _start_visits(situation, visits, targets, path_lengths, assignment)
        return Placement(goals=goals, is_final=False, visits=visits)

    def _find_targets(self, situation: Situation, visits: Visits) -> FloatArray:
        """Return the targets on the frontiers whose visits are not over, (t, 2) m."""
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
        return np.asarray(targets[~visits.find_excluded(targets)])

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
        self, situation: Situation, targets: FloatArray, path_lengths: FloatArray, assignment: IntArray
    ) -> IntArray:
        """Assign targets to those of k robots that have none.

        The pair of a robot and a target with the largest U - β V is assigned first; see `FrontierMedian`.

        Parameters
        ----------
        situation : Situation
        targets : (t, 2) array, m
        path_lengths : (k, t) array, m
            Path length from each robot to each target; infinite without a path.
        assignment : (k,) int array
            Index of the target of each robot, or `_NO_TARGET`.

        Returns
        -------
        (k,) int array
            The assignment, with `_NO_TARGET` for robots for which no target has any utility left.
        """
        assignment = assignment.copy()
        utilities = np.ones(len(targets))
        for target in assignment[assignment != _NO_TARGET].tolist():
            utilities -= _compute_utility_losses(situation, targets, target)
        while True:
            is_possible = (assignment == _NO_TARGET)[:, None] & (utilities > 0.0)
            values = np.where(is_possible, utilities - self.beta * path_lengths, -np.inf)
            robot, target = np.unravel_index(values.argmax(), values.shape)
            if values[robot, target] == -np.inf:
                return assignment
            assignment[robot] = target
            utilities -= _compute_utility_losses(situation, targets, int(target))

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


def _stop_visits(situation: Situation) -> Visits:
    """Return the visits of the last plan, updated by the time since then.

    The positions of robots out of range are only assumed, so their visits take no time and do not end.
    """
    group = situation.group
    previous_plan = situation.previous_plan
    if previous_plan is None or previous_plan.placement.visits is None:
        return Visits.build_empty(len(group.robots))
    visits = previous_plan.placement.visits
    robots_on_visit = np.full(len(group.robots), NO_VISIT)
    rows, previous_rows = group.match(previous_plan.group)
    robots_on_visit[rows] = visits.current[previous_rows]
    robots_on_visit[~group.is_in_range] = NO_VISIT
    distances = np.sqrt(((situation.positions - situation.previous_goals) ** 2).sum(axis=1))
    return visits.stop(
        robots_on_visit,
        has_arrived=distances < _ARRIVAL_RADIUS_M,
        time_spent=group.time - previous_plan.group.time,
    )


def _start_visits(
    situation: Situation, visits: Visits, targets: FloatArray, path_lengths: FloatArray, assignment: IntArray
) -> Visits:
    """Return the visits after the robots in range have started to head for their targets.

    The arrays are those of `FrontierMedian._assign_targets`.
    """
    is_visiting = situation.group.is_in_range & (assignment != _NO_TARGET)
    for target in np.unique(assignment[is_visiting]):
        is_visitor = is_visiting & (assignment == target)
        travel_time = path_lengths[is_visitor, target].min() / situation.limits.max_speed
        limit = _WAITING_TIME_S + _TRAVEL_TIME_FACTOR * travel_time
        visits = visits.start(targets[target], is_visitor, limit)
    return visits


def _compute_utility_losses(situation: Situation, targets: FloatArray, target: int) -> FloatArray:
    """Return by how much the utility of each of t targets decreases if a robot visits one of them, (t,)."""
    planner = situation.planner
    sensing_range = situation.limits.sensing_range
    distances = np.sqrt(((targets - targets[target]) ** 2).sum(axis=1))
    is_clear = planner.visibility.find_clear_lines(targets[target], targets, planner.map_window.is_blocked)
    is_in_view = (distances < sensing_range) & is_clear
    return np.where(is_in_view, 1.0 - distances / sensing_range, 0.0)
