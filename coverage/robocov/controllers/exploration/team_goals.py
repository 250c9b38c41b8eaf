"""The first stage of a plan with `Atlas`: goals for all robots of the team, or for a group of robots."""

from __future__ import annotations

import math
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from robocov.controllers.exploration.atlas_memory import PlanBasis, TeamGoals
from robocov.density import Density
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.planning.team_placement import MinSavings, TeamSituation, compute_node_weights, place_team
from robocov.planning.window import Window
from robocov.typing import BoolArray, FloatArray, IntArray

_MIN_TEAM_NODES = 1000
_MAX_TEAM_NODES = 4000
"""Range of the number of nodes of the lattice for a whole team."""
_NODES_PER_ROBOT = 160
"""Number of nodes for each robot, within that range."""
_MIN_NODES_PER_ROBOT = 27
"""Minimum number of nodes for each robot, even if they exceed the range."""
_GROUP_NODES = 500
"""Number of nodes of the lattice for a group within a larger team."""
_GROUP_WINDOW_FACTOR = 2.0
"""Half the side of the window for a group, divided by the distance to its farthest robot."""
_MIN_GROUP_HALF_SIDE_M = 1.0
"""Minimum of half the side of that window."""


class Cooperation(NamedTuple):
    """Extent to which a robot plans for the k others that it knows of."""

    is_agreed: bool
    """Whether all robots plan on the same map, and therefore make the same plan."""
    is_joint: bool
    """Whether the robot plans for others as well, not for itself alone."""
    group_size: int
    """Number of robots with a goal in the plan: the robot itself, and the first ones of the others."""
    is_fixed: BoolArray
    """(k,) Whether each of the others keeps its position in the plan."""
    savings_factor: float
    """Factor of the savings that relocations and goals require."""


class _AgreedPlan(NamedTuple):
    """A plan that all robots of a team share, and what it was made for."""

    key: tuple[object, ...]
    """The situation, as values that can be compared with those of another situation."""
    density: Density | None
    goals: FloatArray
    """(k, 2) m, in the order of the indices of the robots."""


_LATEST_PLANS: WeakKeyDictionary[GridPlanner, _AgreedPlan] = WeakKeyDictionary()
"""The latest plan on each planner that several robots share, so that it is not computed again for each."""


def compute_team_goals(
    previous: TeamGoals | None,
    basis: PlanBasis,
    density: Density | None,
    cooperation: Cooperation,
    min_savings: MinSavings,
) -> TeamGoals:
    """Compute goals for the robots that a robot plans for.

    Parameters
    ----------
    previous : TeamGoals or None
        Goals in the robot's last plan, from which the search starts.
    basis : PlanBasis
        The map, and the positions of the robots.
    density : Density or None
    cooperation : Cooperation
    min_savings : MinSavings
        Fractions of the cost that changes of the goals must save.

    Returns
    -------
    TeamGoals
    """
    group = basis.robots[: cooperation.group_size]
    group_positions = basis.positions[: cooperation.group_size]
    is_whole_team = len(group) == len(basis.robots)
    window = _build_window(basis.known_map, group_positions, is_whole_team=is_whole_team)
    previous_planner = basis.planner if previous is None else previous.planner
    planner = previous_planner.update(basis.known_map, window)
    situation = _build_situation(basis, previous, cooperation)
    if cooperation.is_agreed:
        goals = _place_agreed_team(planner, density, group, situation, min_savings)
    else:
        # A robot that plans for itself alone does not move to cells that may not be free.
        weights = compute_node_weights(planner.map_window, density, only_known=not cooperation.is_joint)
        goals = place_team(planner, weights, situation, min_savings)
    return TeamGoals(planner=planner, robots=group, goals=goals)


def _build_window(known_map: DiscoveredMap, positions: FloatArray, *, is_whole_team: bool) -> Window:
    """Build the window for a whole team, or for a group around its first robot; `positions` are (k, 2) m."""
    if is_whole_team:
        max_nodes = min(_NODES_PER_ROBOT * len(positions), _MAX_TEAM_NODES)
        max_nodes = max(_MIN_TEAM_NODES, max_nodes, _MIN_NODES_PER_ROBOT * len(positions))
        return Window.build_around(known_map.raster, positions[0], math.inf, max_nodes)
    farthest_distance = float(np.sqrt(((positions - positions[0]) ** 2).sum(axis=1).max()))
    half_side = max(_GROUP_WINDOW_FACTOR * farthest_distance, _MIN_GROUP_HALF_SIDE_M)
    return Window.build_around(known_map.raster, positions[0], half_side, _GROUP_NODES)


def _build_situation(basis: PlanBasis, previous: TeamGoals | None, cooperation: Cooperation) -> TeamSituation:
    """Return the situation of the robots of a group, in which they have their previous goals.

    Fixed robots, and robots without a previous goal, have their positions as goals instead.
    """
    size = cooperation.group_size
    group = basis.robots[:size]
    positions = basis.positions[:size]
    # The first robot, which makes the plan, is never fixed, and has no entry in `cooperation.is_fixed`.
    is_fixed = np.concatenate([[False], cooperation.is_fixed])[:size]
    previous_goals = positions.copy()
    if previous is not None:
        _, rows, previous_rows = np.intersect1d(group, previous.robots, return_indices=True)
        is_mobile = ~is_fixed[rows]
        previous_goals[rows[is_mobile]] = previous.goals[previous_rows[is_mobile]]
    return TeamSituation(
        positions=positions,
        previous_goals=previous_goals,
        is_fixed=is_fixed,
        other_positions=basis.positions[size:],
    )


def _place_agreed_team(
    planner: GridPlanner,
    density: Density | None,
    group: IntArray,
    situation: TeamSituation,
    min_savings: MinSavings,
) -> FloatArray:
    """Return the goals of a team, (k, 2) m, in the plan on which all robots agree.

    The plan is computed for the first robot that needs it, and stored for the others. `group` contains the
    indices of the robots, in the order of the situation.
    """
    # In ascending order, the situation is the same for all robots.
    order = np.argsort(group)
    situation = TeamSituation(
        positions=situation.positions[order],
        previous_goals=situation.previous_goals[order],
        is_fixed=situation.is_fixed[order],
        other_positions=situation.other_positions,
    )
    key = (
        group[order].tobytes(),
        situation.positions.tobytes(),
        situation.previous_goals.tobytes(),
        min_savings.relocation,
    )
    plan = _LATEST_PLANS.get(planner)
    if plan is None or plan.key != key or plan.density is not density:
        weights = compute_node_weights(planner.map_window, density)
        goals = place_team(planner, weights, situation, min_savings)
        plan = _AgreedPlan(key=key, density=density, goals=goals)
        _LATEST_PLANS[planner] = plan
    goals_in_order_of_group = np.empty_like(plan.goals)
    goals_in_order_of_group[order] = plan.goals
    return goals_in_order_of_group
