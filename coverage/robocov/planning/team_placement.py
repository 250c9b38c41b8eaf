"""Goals for a team, based on the knowledge of one robot: the k-median problem on the nodes of its map.

The goals P minimize the coverage cost (22) on the nodes q of a `GridPlanner`,

    J(P) = sum over q of w_q min_j d(q, p_j),

where d are geodesic distances, and the weight w_q is the number of free cells that the node represents, times
the density. Unknown cells are weighted by the probability that they are free (see `openness`).

Equation numbers refer to Renzaglia and Martinelli, "Distributed Coverage Control for a Multi-Robot Team in a
Non-Convex Environment".
"""

from typing import NamedTuple

import numpy as np
import scipy

from robocov.arrays import compute_point_distances
from robocov.density import Density
from robocov.k_median import improve_sources, move_first_source
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.map_window import MapWindow
from robocov.planning.node_visibility import NO_NODE
from robocov.typing import BoolArray, FloatArray, IntArray

UNREACHABLE_M = 1e9
"""Finite value used in place of the infinite distance to a node that cannot be reached."""
_MAX_SQUARED_LENGTH_M2 = 1e9
"""Upper limit of squared path lengths, used in place of infinity if there is no path."""
_MAX_ROBOTS_FOR_THOROUGH_SEARCH = 8
"""Maximum number of robots for which the search also tries to replace two or three goals at once."""


class TeamSituation(NamedTuple):
    """Positions and previous goals of k robots, as known to the first of them, which makes the plan."""

    positions: FloatArray
    """(k, 2) m, positions of the robots."""
    previous_goals: FloatArray
    """(k, 2) m, goals in the previous plan, or the positions of robots without one."""
    is_fixed: BoolArray
    """(k,) Whether each robot keeps its previous goal. The first robot never does."""
    other_positions: FloatArray
    """(o, 2) m, positions of robots that do not move and are not part of the plan."""


class MinSavings(NamedTuple):
    """Fractions of the cost that changes to a plan must save. 1 allows no change."""

    relocation: float
    """Fraction of the coverage cost that all relocations together must save."""
    own_cell: float
    """Fraction of the coverage cost that a new goal of the first robot in its own cell must save.

    It matters only if all other robots are fixed.
    """
    swap: float = 0.0
    """Fraction of the sum of squared path lengths that an exchange of goals between robots must save."""


def compute_node_weights(
    map_window: MapWindow, density: Density | None = None, *, only_known: bool = False
) -> FloatArray:
    """Compute the weights w of the nodes of a map window.

    Parameters
    ----------
    map_window : MapWindow
    density : Density or None
        It is evaluated at each node; None means 1 everywhere.
    only_known : bool
        If true, unknown cells do not count. Otherwise, they are weighted by their openness.

    Returns
    -------
    (m,) array
        Number of free cells that each node represents, times the density.
    """
    weights = map_window.free_counts if only_known else map_window.expected_free_counts
    if density is not None and not density.is_uniform:
        weights = weights * density.evaluate(map_window.nodes)
    return weights


def place_team(
    planner: GridPlanner, weights: FloatArray, team: TeamSituation, min_savings: MinSavings
) -> FloatArray:
    """Compute goals for a team that have a low coverage cost and need few relocations.

    Parameters
    ----------
    planner : GridPlanner
        Planner of the robot that makes the plan.
    weights : (m,) array
        Weights of the nodes; see `compute_node_weights`.
    team : TeamSituation
    min_savings : MinSavings

    Returns
    -------
    (k, 2) array, m
        The goals; the previous ones if the robot that makes the plan can reach no target, or fewer nodes that
        may become goals than there are robots.

    Notes
    -----
    Starting from the previous plan, Lloyd's iteration alternates with larger changes (see `improve_sources`).
    If all robots except for the first are fixed, the first one gets the best goal in its own cell. Goals are
    assigned so that the sum of the squared path lengths is minimal: then the assignment stays the same while
    the robots move, and their paths do not cross. Since robots also leave these paths to look around, they
    exchange goals only if that saves the fraction `MinSavings.swap` of the sum.
    """
    own_node = planner.visibility.find_entry_node(team.positions[0])
    if own_node == NO_NODE:
        return team.previous_goals
    # Candidates are the nodes that may become goals, and targets the nodes that count in the cost.
    candidates, distances = planner.get_team_candidates(own_node)
    is_target = np.isfinite(planner.graph.get_distances(own_node)) & (weights > 0.0)
    if len(candidates) < len(team.positions) or not is_target.any():
        return team.previous_goals
    other_distances = np.minimum(planner.compute_distances_from(team.other_positions), UNREACHABLE_M)
    # Entry (q, c) of the table is the weighted distance from target q to candidate c. The last column stands
    # for all robots outside the plan: it contains the weighted distance to the nearest of them.
    target_distances = np.vstack([distances[:, is_target], other_distances[is_target]])
    table = np.ascontiguousarray((target_distances * weights[is_target]).T)

    chosen = _choose_previous_candidates(planner, candidates, distances, team)
    chosen = _improve_goals(table, chosen, team, min_savings.relocation)
    if team.is_fixed[1:].all():
        # Distances from each candidate to the goal of each robot, and to the nearest robot outside the plan.
        goal_distances = np.column_stack([distances[:, candidates[chosen]], other_distances[candidates]])
        is_in_own_cell = goal_distances.argmin(axis=1) == 0
        chosen = _move_first_goal(table, chosen, is_in_own_cell, min_savings.own_cell)
    mobile = np.flatnonzero(~team.is_fixed)
    path_lengths = np.array(
        [planner.look_up_distances(team.positions[robot], distances[chosen[mobile]]) for robot in mobile]
    )
    assignment = _assign_goals(path_lengths, min_savings.swap)
    goals = team.previous_goals.copy()
    goals[mobile] = planner.map_window.nodes[candidates[chosen[mobile[assignment]]]]
    return goals


def _choose_previous_candidates(
    planner: GridPlanner, candidates: IntArray, distances: FloatArray, team: TeamSituation
) -> IntArray:
    """Return the candidate closest to each previous goal, (k,), without using any candidate twice.

    Fixed robots choose first.

    Parameters
    ----------
    planner : GridPlanner
    candidates : (c,) int array
        Nodes of the candidates.
    distances : (c, m) array, m
        Distances from the candidates to all nodes.
    team : TeamSituation
    """
    chosen = np.empty(len(team.positions), dtype=np.intp)
    is_taken = np.zeros(len(candidates), dtype=bool)
    for robot in np.argsort(~team.is_fixed, kind="stable").tolist():
        goal = team.previous_goals[robot]
        goal_distances = planner.look_up_distances(goal, distances)
        # Candidates to which there is no path come last. Straight distances decide between them.
        straight_distances = compute_point_distances(planner.map_window.nodes[candidates], goal)
        is_reachable = np.isfinite(goal_distances)
        goal_distances = np.where(is_reachable, goal_distances, UNREACHABLE_M + straight_distances)
        goal_distances[is_taken] = np.inf
        chosen[robot] = goal_distances.argmin()
        is_taken[chosen[robot]] = True
    return chosen


def _improve_goals(table: FloatArray, chosen: IntArray, team: TeamSituation, min_saving: float) -> IntArray:
    """Return goals with a lower coverage cost for the k robots of a plan, as indices of candidates, (k,).

    Parameters
    ----------
    table : (q, c + 1) array
        Weighted distances from targets to candidates and, in the last column, to the robots outside the plan.
    chosen : (k,) int array
        The candidate that is the goal of each robot so far.
    team : TeamSituation
        Goals of its fixed robots do not change.
    min_saving : float
        Fraction of the cost that the changes must save.
    """
    # Sort the robots in an order that is the same on whichever robot makes the plan. If two plans are equally
    # good, all robots then choose the same one.
    order = np.lexsort(team.previous_goals.T)
    # Robots outside the plan cover the targets close to them: their column is always chosen, like the goals
    # of fixed robots.
    outside_column = table.shape[1] - 1
    improved_columns = improve_sources(
        table,
        np.append(chosen[order], outside_column),
        np.append(team.is_fixed[order], True),
        min_saving,
        removals=len(chosen) <= _MAX_ROBOTS_FOR_THOROUGH_SEARCH,
    )
    improved = chosen.copy()
    improved[order] = improved_columns[:-1]
    return improved


def _move_first_goal(
    table: FloatArray, chosen: IntArray, is_in_own_cell: BoolArray, min_saving: float
) -> IntArray:
    """Return the goals, (k,), with that of the first robot moved to the best candidate in its own cell.

    Parameters
    ----------
    table : (q, c + 1) array
        Weighted distances from targets to candidates and, in the last column, to the robots outside the plan.
    chosen : (k,) int array
        The candidate that is the goal of each robot so far.
    is_in_own_cell : (c,) bool array
        Whether no other robot is nearer to the candidate.
    min_saving : float
        Fraction of the cost that the move must save.
    """
    outside_column = table.shape[1] - 1
    moved_columns = move_first_source(
        table,
        np.append(chosen, outside_column),
        np.append(is_in_own_cell, False),
        min_saving,
    )
    return moved_columns[:-1]


def _assign_goals(path_lengths: FloatArray, min_saving: float) -> IntArray:
    """Assign goals to robots so that the sum of squared path lengths is minimal.

    Parameters
    ----------
    path_lengths : (k, k) array, m
        Entry (i, j) is the length of the path from robot i to the goal that was chosen for robot j.
    min_saving : float
        Fraction of the sum that an exchange of goals must save; otherwise, no goals are exchanged.

    Returns
    -------
    (k,) int array
        For each robot, the index of its goal.
    """
    unchanged = np.arange(len(path_lengths))
    squared_lengths = np.minimum(path_lengths**2, _MAX_SQUARED_LENGTH_M2)
    _, assignment = scipy.optimize.linear_sum_assignment(squared_lengths)
    if min_saving:
        assigned_sum = squared_lengths[unchanged, assignment].sum()
        unchanged_sum = squared_lengths[unchanged, unchanged].sum()
        if assigned_sum > (1.0 - min_saving) * unchanged_sum:
            return unchanged
    return np.asarray(assignment, dtype=np.intp)
