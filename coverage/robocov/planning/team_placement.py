"""Goals for a team, based on the knowledge of one robot: a k-median on the nodes of its map.

The cost is (22) on the nodes of a `GridPlanner`, each weighted by its area (times the density):

    J(P) = sum over q of w_q min_j d(q, p_j)

with geodesic distances d. An unknown cell is weighted by the probability that it is free (see
`openness`).
"""

from typing import NamedTuple

import numpy as np
import scipy

from robocov.arrays import Array, BoolArray, IntArray
from robocov.density import Density
from robocov.k_median import improve_sources, move_first_source
from robocov.planning.grid_planner import NO_NODE, GridPlanner

UNREACHABLE_M = 1e9
"""Finite stand-in for the distance to a node that no robot can reach."""
_MAX_SQUARED_LENGTH_M2 = 1e9
"""Finite stand-in for the squared length of a path that does not exist."""
_MAX_ROBOTS_FOR_THOROUGH_SEARCH = 8
"""Up to this team size, the search also tries to remove two or three goals at once."""


class TeamSituation(NamedTuple):
    """Positions and previous goals of the robots of a team, as known to the first robot, which plans."""

    positions: Array
    """(k, 2) m"""
    previous_goals: Array
    """(k, 2) m, goals in the previous plan."""
    is_fixed: BoolArray
    """(k,) Whether each robot keeps its previous goal. The first robot never does."""
    other_positions: Array
    """(o, 2) m, positions of robots that do not move and are not part of the plan."""


class MinSavings(NamedTuple):
    """Fractions of the cost that changes to a plan must save."""

    relocation: float
    """Minimum saving of all relocations together."""
    own_cell: float
    """Minimum saving if all others are fixed and only the first robot is relocated, within its own cell."""
    swap: float = 0.0
    """Fraction of the sum of squared path lengths that an exchange of goals between robots must save."""


def compute_node_weights(
    planner: GridPlanner, density: Density | None = None, *, only_known: bool = False
) -> Array:
    """Compute the weights w of the nodes.

    Parameters
    ----------
    planner : GridPlanner
    density : Density or None
        It is evaluated at each node; None means 1 everywhere.
    only_known : bool
        If true, unknown cells do not count. Otherwise, they are weighted by their openness.

    Returns
    -------
    (m,) array
        Number of free cells that each node represents, times the density.
    """
    weights = planner.free_counts if only_known else planner.expected_free_counts
    if density is not None and not density.is_uniform:
        weights = weights * density.evaluate(planner.nodes)
    return weights


def place_team(planner: GridPlanner, weights: Array, team: TeamSituation, min_savings: MinSavings) -> Array:
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
        The previous goals if the robot that makes the plan cannot go anywhere.

    Notes
    -----
    Starting from the previous plan, Lloyd's iteration alternates with interchange (`robocov.k_median`). If
    all robots but the first are fixed, the first one goes to the best position in its own cell. Goals are
    assigned so that the sum of the squared path lengths is minimal: then the assignment stays the same while
    the robots move, and their paths do not cross. Since robots also leave these paths to look around, they
    exchange goals only if that saves the fraction `MinSavings.swap` of the sum.
    """
    own_node = planner.find_own_node(team.positions[0])
    if own_node == NO_NODE:
        return team.previous_goals
    # Sources are the nodes that may become goals, and targets the nodes that count in the cost.
    is_reachable = np.isfinite(planner.get_distances(own_node))
    is_usable = is_reachable[planner.sources]
    sources = planner.sources[is_usable]
    is_target = is_reachable & (weights > 0.0)
    if len(sources) < len(team.positions) or not is_target.any():
        return team.previous_goals
    distances = planner.source_distances[is_usable]
    other_distances = np.minimum(planner.compute_distances_from(team.other_positions), UNREACHABLE_M)
    # Treat the robots outside the plan together as one more source, which is fixed; see `_improve_sources`.
    # Row q contains the weighted distances from target q to all sources.
    target_distances = np.vstack([distances[:, is_target], other_distances[is_target]])
    weighted_distances = np.ascontiguousarray((target_distances * weights[is_target]).T)

    chosen = _choose_previous_sources(planner.nodes[sources], team)
    chosen = _improve_sources(weighted_distances, chosen, team, min_savings.relocation)
    if team.is_fixed[1:].all():
        # Distances from each source to the goal of each robot, and to the nearest robot outside the plan.
        from_team = np.column_stack([distances[:, sources[chosen]], other_distances[sources]])
        is_in_own_cell = from_team.argmin(axis=1) == 0
        chosen = _move_first_source(weighted_distances, chosen, is_in_own_cell, min_savings.own_cell)
    return _assign_goals(
        planner.nodes[sources], distances[:, sources[chosen]], chosen, team, min_savings.swap
    )


def _choose_previous_sources(source_positions: Array, team: TeamSituation) -> IntArray:
    """Return the source nearest to each previous goal, (k,), all different; fixed robots choose first.

    Sources are the nodes of the map that may become goals.
    """
    chosen = np.empty(len(team.positions), dtype=np.intp)
    is_taken = np.zeros(len(source_positions), dtype=bool)
    for robot in np.argsort(~team.is_fixed, kind="stable").tolist():
        squared_distances = ((source_positions - team.previous_goals[robot]) ** 2).sum(axis=1)
        squared_distances[is_taken] = np.inf
        chosen[robot] = squared_distances.argmin()
        is_taken[chosen[robot]] = True
    return chosen


def _improve_sources(
    weighted_distances: Array, chosen: IntArray, team: TeamSituation, min_saving: float
) -> IntArray:
    """Return goals with a lower coverage cost for the k robots of a plan, as indices of sources, (k,).

    Sources are the nodes that may become goals. `chosen` contains the source that is currently the goal of
    each robot. Entry (q, s) of `weighted_distances` is the weighted distance from target q to source s.

    Robots outside the plan stay where they are, but cover the targets close to them. The last column stands
    for all of these robots together: it contains the weighted distance to the nearest one. This column is
    always chosen, just as the goals of fixed robots are.
    """
    # Sort the robots in an order that is the same on whichever robot makes the plan. If two plans are equally
    # good, all robots then choose the same one.
    order = np.lexsort(team.previous_goals.T)
    outside_source = weighted_distances.shape[1] - 1
    improved_sources = improve_sources(
        weighted_distances,
        np.append(chosen[order], outside_source),
        np.append(team.is_fixed[order], True),
        min_saving,
        removals=len(chosen) <= _MAX_ROBOTS_FOR_THOROUGH_SEARCH,
    )
    result = chosen.copy()
    result[order] = improved_sources[:-1]
    return result


def _move_first_source(
    weighted_distances: Array, chosen: IntArray, is_in_own_cell: BoolArray, min_saving: float
) -> IntArray:
    """Return sources, (k,), with that of the first robot moved to the best position in its own cell.

    Sources are the nodes that may become goals, and `chosen` contains the current one of each robot of the
    plan. `is_in_own_cell` marks the sources to which no other robot is nearer. Entry (q, s) of
    `weighted_distances` is the weighted distance from target q to source s. As in `_improve_sources`, the
    last column represents the robots outside the plan, which do not move.
    """
    outside_source = weighted_distances.shape[1] - 1
    moved_sources = move_first_source(
        weighted_distances,
        np.append(chosen, outside_source),
        np.append(is_in_own_cell, False),
        min_saving,
    )
    return moved_sources[:-1]


def _assign_goals(
    source_positions: Array, distances: Array, chosen: IntArray, team: TeamSituation, min_saving: float
) -> Array:
    """Assign the chosen nodes to robots as goals, so that the sum of squared path lengths is minimal.

    Parameters
    ----------
    source_positions : (c, 2) array, m
        Positions of the nodes that may become goals (the sources).
    distances : (c, k) array, m
        Distances from all sources to the chosen ones.
    chosen : (k,) int array
        Index of the source chosen for each robot. Fixed robots keep their previous goals; the other robots
        may exchange theirs.
    team : TeamSituation
    min_saving : float
        Fraction of the sum that an exchange of goals must save; otherwise, no goals are exchanged.

    Returns
    -------
    (k, 2) array, m
        The goal of each robot.
    """
    # Row i of `squared_lengths` belongs to mobile robot i, and column j to the goal now chosen for mobile
    # robot j.
    mobile = np.flatnonzero(~team.is_fixed)
    starts = [_find_nearest(source_positions, team.positions[robot]) for robot in mobile]
    squared_lengths = np.minimum(distances[starts][:, mobile] ** 2, _MAX_SQUARED_LENGTH_M2)
    _, assignment = scipy.optimize.linear_sum_assignment(squared_lengths)
    unchanged = np.arange(len(mobile))
    if min_saving:
        assigned_sum = squared_lengths[unchanged, assignment].sum()
        unchanged_sum = squared_lengths[unchanged, unchanged].sum()
        if assigned_sum > (1.0 - min_saving) * unchanged_sum:
            assignment = unchanged
    goals = team.previous_goals.copy()
    goals[mobile] = source_positions[chosen[mobile[assignment]]]
    return goals


def _find_nearest(points: Array, position: Array) -> int:
    """Return the index of the point nearest to a position."""
    return int(((points - position) ** 2).sum(axis=1).argmin())
