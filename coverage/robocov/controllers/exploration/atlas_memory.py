"""Memory of the robots with the controller `Atlas`: their knowledge of the team, and their last plans.

All objects are immutable; a plan that changes is replaced. Simulations can therefore share them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from robocov.arrays import Array, IntArray
from robocov.controllers.exploration.localization import Estimates
from robocov.controllers.exploration.scan_exchange import ScanExchange
from robocov.controllers.exploration.teammates import TeammateReport, Teammates
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.team import Team


@dataclass(frozen=True, eq=False)
class TeamKnowledge:
    """Knowledge of one robot about the others."""

    teammates: Teammates
    """The robots that it takes into account."""
    encountered: frozenset[int] = frozenset()
    """Robots that it has heard, or that others have reported to it, except for failed ones."""
    loss_times: Mapping[int, float] = field(default_factory=dict)
    """Times at which it lost robots, because they had failed or were missing, s. Never changed in place."""


@dataclass(frozen=True, eq=False)
class TraveledPath:
    """Path of one robot since its start, or since the last change of the team or the walls."""

    start_time: float = 0.0
    """Time at which the path begins, s."""
    length: float = 0.0
    """Length of the whole path, m."""
    viewpoint_length: float = 0.0
    """Length of the parts of the path that led to viewpoints, m."""
    viewpoints: tuple[Array, ...] = ()
    """(2,) m each, viewpoints that it has reached."""


@dataclass(frozen=True, eq=False)
class PlanBasis:
    """Knowledge of a robot when it made its last plan."""

    known_map: DiscoveredMap
    planner: GridPlanner
    """Planner of the robot's own goal and its routes."""
    robots: IntArray
    """(k,) Numbers of the robots that it knew of, its own first."""
    positions: Array
    """(k, 2) m, positions of these robots."""
    is_quiet: bool
    """True if all others were at rest."""


@dataclass(frozen=True, eq=False)
class TeamGoals:
    """Goals of several robots in the last plan of one of them."""

    planner: GridPlanner
    robots: IntArray
    """(p,) Numbers of the robots with goals in the plan, its own first."""
    goals: Array
    """(p, 2) m, goals of these robots."""


@dataclass(frozen=True, eq=False)
class OwnMotion:
    """Motion of a robot by its last plan."""

    goal: Array
    """(2,) m, its own goal."""
    viewpoint: Array | None = None
    """(2,) m, the point where it first looks around."""
    is_idle: bool = False
    """True if the next plan may be skipped as long as nothing changes."""


@dataclass(frozen=True, eq=False)
class JamState:
    """State of a robot that is stuck among others, and moves away from them for a while."""

    stuck_plans: int = 0
    """Number of consecutive plans during which it has been stuck."""
    evasion_end: float = 0.0
    """Time until which it moves out of the jam, s."""


@dataclass(frozen=True, eq=False)
class PlannerState:
    """Memory of one robot for its plans."""

    known_map: DiscoveredMap
    next_plan_time: float
    """Time of the next plan, s."""
    knowledge: TeamKnowledge
    path: TraveledPath = TraveledPath()
    basis: PlanBasis | None = None
    """Knowledge for the last plan; like the goals and the motion, None before the first plan."""
    team_goals: TeamGoals | None = None
    motion: OwnMotion | None = None
    jam: JamState = JamState()

    def __deepcopy__(self, memo: object) -> PlannerState:
        return self


@dataclass(frozen=True, slots=True, eq=False)
class AtlasMemory:
    """Memory of the robots."""

    team: Team
    """A robot knows its own limits."""
    states: tuple[PlannerState, ...]
    """State of each robot."""
    routes: tuple[Array, ...]
    """Waypoints of each robot, (w, 2) m, the last one the goal."""
    legs: IntArray
    """(n,) Index of the waypoint that each robot heads for."""
    returns: Array | None = None
    """(n, rays, 2) m, obstacle points in the last scan of each robot; nan for none."""
    estimates: Estimates | None = None
    """Position estimates, if robots know positions of others by messages."""
    exchange: ScanExchange | None = None
    """The scans that robots with shared maps exchange; None if they share nothing."""
    reports: tuple[Mapping[int, TeammateReport], ...] = ()
    """The newest report from each other robot since the last plan of each robot, by sender. Never changed in
    place."""

    @property
    def maps(self) -> tuple[DiscoveredMap, ...]:
        """The map that each robot has discovered; with shared maps, when it last planned."""
        return tuple(state.known_map for state in self.states)
