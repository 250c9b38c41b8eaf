"""The task to learn: maps, team, duration, observations, actions and reward."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from robocov.conditions import Conditions
from robocov.defaults import DEFAULT_DT_S, DEFAULT_DURATION_S, DEFAULT_ROBOTS
from robocov.errors import (
    ParameterError,
    describe_unknown_name,
    format_count,
    quote,
    require_number,
    require_type,
)
from robocov.simulation import check_dt
from robocov.team import Team
from robocov_app.learning.actions import ACTIONS, VELOCITY_TIME_CONSTANT_S, Action
from robocov_app.learning.maps import MapSource
from robocov_app.learning.observation_layout import ObservationLayout
from robocov_app.learning.rewards import REWARDS, Reward

MAX_ROBOTS = 10_000
_MAX_REPEAT = 100_000
_TIME_TOLERANCE_S = 5e-7
"""Tolerance for rounding errors in sums of control periods."""


def check_kind(name: str, kind: str, known: Sequence[str]) -> None:
    """Check the name of a kind of action or reward.

    Raises
    ------
    ParameterError
        If the kind is unknown.
    """
    if kind not in known:
        raise ParameterError(f"{name}: {describe_unknown_name(f'kind of {name}', str(kind), known)}")


@dataclass(frozen=True, eq=False)
class CoverageTask:
    """Everything that defines a learning environment, for one learner or many, in SI units.

    Parameters
    ----------
    maps : MapSource or sequence of MapSource
        Sources of maps. One is drawn for each episode, all with equal probability. A function, for example
        `GeneratedMaps`, is called with a new seed each time.
    start : str, optional
        Name of the start; by default, the first start of each map. "*" draws one of the map's starts.
    robots : int
        Number of robots; ignored if there is a `team`.
    team : Team, optional
        By default, identical robots.
    duration : float
        Time after which an episode is truncated, s.
    dt : float
        Control period of the physics, s.
    repeat : int
        Number of control periods for which an action is held.
    action : str
        Kind of the actions: "force" (N) or "velocity" (m/s).
    reward : str
        How rewards are shared; see `robocov_app.learning.rewards.share_reward`. They are divided by the
        reference distance; see `robocov_app.learning.rewards.compute_reference_distance`.
    contact_penalty : float
        Penalty for each second in contact with a wall or another robot.
    lattice : int
        Number of sites along each side of the lattice of the coverage cost. Distances are exact.
    reward_every : int
        Number of actions after which the cost is evaluated and rewarded. The last action is always rewarded.
        An evaluation takes about as long as ten control periods of six robots.
    observation : ObservationLayout
        Layout of the observations.
    conditions : Conditions, optional
        Conditions of the episodes. A new seed is drawn for each episode.
    recording : bool
        Whether the data for `Episode.record` are stored: about 2 MB per minute for six robots.

    Raises
    ------
    ParameterError
        If a value is out of range.

    See Also
    --------
    CoverageEnv : The environment of one learner.
    CoverageParallelEnv : The environment with one learner for each robot.

    Examples
    --------
    >>> from robocov_app.learning import CoverageTask
    >>> task = CoverageTask(robots=4, duration=30.0)
    >>> task.cycles, round(task.period, 3)
    (300, 0.1)
    """

    maps: MapSource | Sequence[MapSource] = "rooms"
    start: str | None = None
    robots: int = DEFAULT_ROBOTS
    team: Team | None = None
    duration: float = DEFAULT_DURATION_S
    dt: float = DEFAULT_DT_S
    repeat: int = 6
    action: Action = "force"
    reward: Reward = "shared"
    contact_penalty: float = 0.1
    lattice: int = 32
    reward_every: int = 1
    observation: ObservationLayout = field(default_factory=ObservationLayout)
    conditions: Conditions | None = None
    recording: bool = False

    def __post_init__(self) -> None:
        self._check_numbers()
        self._check_choices_and_types()
        self._check_velocity_step()
        # The class is frozen. `team` and `robots` must agree, whichever was given.
        object.__setattr__(self, "team", self.whole_team)
        object.__setattr__(self, "robots", len(self.whole_team))

    def _check_numbers(self) -> None:
        """Check that the numbers are in their ranges."""
        check_dt(self.dt)
        require_number("robots", self.robots, 1, MAX_ROBOTS, whole=True)
        require_number("repeat", self.repeat, 1, _MAX_REPEAT, whole=True)
        require_number("reward_every", self.reward_every, 1, _MAX_REPEAT, whole=True)
        if not np.isfinite(self.duration) or self.duration < self.period - _TIME_TOLERANCE_S:
            raise ParameterError(
                f"duration: expected at least the time of one action, {self.period:g} s, "
                f"got {quote(self.duration)} s"
            )
        if not 0.0 <= self.contact_penalty < np.inf:
            raise ParameterError(
                f"contact_penalty: expected a finite number of at least 0, got {quote(self.contact_penalty)}"
            )

    def _check_choices_and_types(self) -> None:
        """Check the kinds of action and reward, and the types of team, observation and conditions."""
        check_kind("reward", self.reward, REWARDS)
        check_kind("action", self.action, ACTIONS)
        if self.team is not None:
            require_type("team", self.team, Team, "a Team")
        require_type("observation", self.observation, ObservationLayout, "an ObservationLayout")
        if self.conditions is not None:
            require_type("conditions", self.conditions, Conditions, "a Conditions")
            self.conditions.check_team(len(self.whole_team))

    def _check_velocity_step(self) -> None:
        """Check that the control period is short enough for robots to follow desired velocities."""
        if self.action == "velocity" and self.dt > VELOCITY_TIME_CONSTANT_S:
            raise ParameterError(
                f"dt: expected at most {VELOCITY_TIME_CONSTANT_S:g} s for robots to follow velocities, "
                f"got {self.dt:g} s"
            )

    @property
    def whole_team(self) -> Team:
        """The given team, or by default one of identical robots."""
        return Team.homogeneous(self.robots) if self.team is None else self.team

    @property
    def period(self) -> float:
        """Time for which an action is held, s."""
        return self.repeat * self.dt

    @property
    def cycles(self) -> int:
        """Number of actions in an episode."""
        return max(1, round(self.duration / self.period))

    @property
    def agents(self) -> list[str]:
        """Names of the robots, starting with "robot_1"."""
        return [f"robot_{number}" for number in range(1, self.robots + 1)]

    def __repr__(self) -> str:
        robots = format_count(self.robots, "robot")
        actions = format_count(self.cycles, "action")
        return f"<CoverageTask {robots}, {self.duration:g} s, {actions}, {self.action}, reward {self.reward}>"


def change_task(task: CoverageTask | None, changes: Mapping[str, Any]) -> CoverageTask:
    """Return a task with some of its attributes changed.

    Parameters
    ----------
    task : CoverageTask or None
        By default, a task with default values.
    changes : Mapping
        New values by attribute. If the number of robots changes, the team is replaced by identical robots,
        unless a new team is given, too.

    Returns
    -------
    CoverageTask

    Raises
    ------
    ParameterError
        If an attribute is unknown, or a value is out of range.
    """
    known = [attribute.name for attribute in fields(CoverageTask)]
    for name in changes:
        if name not in known:
            raise ParameterError(describe_unknown_name("attribute of a task", name, known))
    new_values = dict(changes)
    if "robots" in changes:
        new_values.setdefault("team", None)
    return replace(task or CoverageTask(), **new_values)
