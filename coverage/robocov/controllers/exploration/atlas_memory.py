"""Memory of robots with the controllers `Atlas` and `AtlasShared`: knowledge of the team, and last plans.

No object is changed after it is built: a robot that makes a new plan replaces the old one. Copies of a
simulation can therefore share these objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from robocov.controllers.exploration.localization import Estimates
from robocov.controllers.exploration.scan_exchange import ScanExchange
from robocov.controllers.exploration.teammates import TeammateReport, Teammates
from robocov.planning.discovered_map import DiscoveredMap
from robocov.planning.grid_planner import GridPlanner
from robocov.team import Team
from robocov.typing import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class TeamKnowledge:
    """Knowledge of one robot about the others."""

    teammates: Teammates
    """The robots that the robot takes into account."""
    encountered: frozenset[int] = frozenset()
    """Indices of the robots that the robot has met or learned of from reports; without failed ones."""
    loss_times: Mapping[int, float] = field(default_factory=dict)
    """Time at which each lost robot was found to have failed or to be missing, s, by index."""


@dataclass(frozen=True, eq=False)
class TraveledPath:
    """Path of one robot since the start, or since the last change of the team or the walls."""

    start_time: float = 0.0
    """Time at which the path begins, s."""
    length: float = 0.0
    """Length of the whole path, m."""
    viewpoint_length: float = 0.0
    """Length of the parts of the path that led to viewpoints, m."""
    viewpoints: tuple[FloatArray, ...] = ()
    """Viewpoints that the robot has reached, (2,) m each."""


@dataclass(frozen=True, eq=False)
class PlanBasis:
    """The map and the positions on which a robot based its last plan."""

    known_map: DiscoveredMap
    planner: GridPlanner
    """Planner of the robot's own goal and its routes."""
    robots: IntArray
    """(k,) Indices of the robot itself, which comes first, and of the others that it knew of."""
    positions: FloatArray
    """(k, 2) m, positions of these robots."""
    is_quiet: bool
    """Whether all others were at rest or out of contact."""


@dataclass(frozen=True, eq=False)
class TeamGoals:
    """Goals of a robot and of others in the robot's last plan."""

    planner: GridPlanner
    """Planner with which the goals were found."""
    robots: IntArray
    """(p,) Indices of the robot itself, which comes first, and of the others with goals in the plan."""
    goals: FloatArray
    """(p, 2) m, goals of these robots."""


@dataclass(frozen=True, eq=False)
class OwnMotion:
    """Motion of a robot according to its last plan."""

    goal: FloatArray
    """(2,) m, goal of the robot."""
    viewpoint: FloatArray | None = None
    """(2,) m, point to which the robot moves first, to look around. None: it moves straight to its goal."""
    is_idle: bool = False
    """Whether the next plan may be skipped as long as nothing changes."""


@dataclass(frozen=True, eq=False)
class JamState:
    """State of a robot that is stuck among others, or moves away from them."""

    stuck_plans: int = 0
    """Number of consecutive plans during which the robot has been stuck."""
    evasion_end: float = 0.0
    """Time until which the robot moves out of the jam, s."""


@dataclass(frozen=True, eq=False)
class PlannerState:
    """Memory of one robot. Immutable."""

    known_map: DiscoveredMap
    """The map that the robot has discovered; with shared maps, the map when it last planned."""
    next_plan_time: float
    """Time of the next plan, s."""
    knowledge: TeamKnowledge
    """Knowledge of the other robots."""
    path: TraveledPath = TraveledPath()
    basis: PlanBasis | None = None
    """Map and positions on which the last plan is based; None before the first plan."""
    team_goals: TeamGoals | None = None
    """Result of the first stage of the last plan; None before the first plan."""
    motion: OwnMotion | None = None
    """Result of the later stages of the last plan; None before the first plan."""
    jam: JamState = JamState()

    @property
    def viewpoint(self) -> FloatArray | None:
        """The viewpoint to which the robot moves, (2,) m; None if it does not move to any."""
        return None if self.motion is None else self.motion.viewpoint

    def __deepcopy__(self, memo: object) -> PlannerState:
        # Copies share the object, because it never changes.
        return self


@dataclass(frozen=True, slots=True, eq=False)
class AtlasMemory:
    """Memory of all robots of a team. Row or entry i belongs to robot i alone."""

    team: Team
    """The robots. Each robot knows only its own body and limits."""
    states: tuple[PlannerState, ...]
    """State of each robot."""
    routes: tuple[FloatArray, ...]
    """Waypoints of each robot, (w, 2) m. The last one is its goal."""
    waypoint_indices: IntArray
    """(n,) Index, in its route, of the waypoint that each robot heads for."""
    exchange: ScanExchange | None
    """The scans that robots with shared maps exchange; None if they share nothing."""
    reports: tuple[Mapping[int, TeammateReport], ...]
    """For each robot, the newest report from each sender that has arrived since the robot's last plan."""
    returns: FloatArray | None = None
    """(n, rays, 2) m, obstacle points in the last scan of each robot; nan for none."""
    estimates: Estimates | None = None
    """Position estimates, if robots know the positions of others only from messages."""

    @property
    def maps(self) -> tuple[DiscoveredMap, ...]:
        """The map that each robot has discovered; with shared maps, when it last planned."""
        return tuple(state.known_map for state in self.states)
