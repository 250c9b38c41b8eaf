"""The task that is to be learned: on which maps, by which team, for how long, for what reward."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from robocov.conditions import Conditions
from robocov.errors import ParameterError, checked, counted, shown, unknown_name
from robocov.robots import Team
from robocov.simulation import DEFAULT_DT, check_dt
from robocov_app.learning.driving import FOLLOWING, Action, checked_action
from robocov_app.learning.layout import ObservationLayout
from robocov_app.learning.rewards import Reward, checked_reward
from robocov_app.learning.scenarios import MapSource

MOST_ROBOTS = 10_000


@dataclass(frozen=True, eq=False)
class CoverageTask:
    """All that makes a learning environment, for one learner or many.

    Attributes
    ----------
    maps : map, its name or path, or a function from a seed to one; or a sequence of these
        With several, one is drawn for each episode, each as likely; a function, such as `GeneratedMaps`,
        is given a new seed each time.
    start : str or None
        A named start of the maps; None for each map's first, ``"*"`` for any of its starts.
    robots : int
    team : Team or None
        Limits and ranges of the robots; None for `Team.homogeneous(robots)`. Its size goes before `robots`.
    duration : float, s
        After that an episode is truncated. It never ends by itself.
    dt : float, s
        Control period of the physics.
    repeat : int
        So many control periods long an action is held: 6 of 1/60 s are 10 decisions a second.
    action : {"force", "velocity"}
        See `robocov_app.learning.driving`.
    reward : {"shared", "own", "level"}
        See `robocov_app.learning.rewards.shares`; in units of `reference_distance`, with all robots and the
        whole area that they can come to.
    contact_penalty : float
        What a second in contact with a wall or another robot costs a robot.
    lattice : int
        Of the coverage cost that is rewarded: exact distances, from few sites.
    reward_every : int
        The cost is evaluated, and rewarded, after every so many actions and after the last one: it takes
        about as long as ten control periods of six robots.
    observation : ObservationLayout
    conditions : Conditions or None
        Noise, loss of messages, robots that fail or join. Their seed is drawn anew for each episode.
    recording : bool
        Keep what `Episode.record` needs: some 2 MB a minute for six robots.

    Raises ParameterError when a value is out of range.

    Examples
    --------
    >>> task = CoverageTask(robots=4, duration=30.0)
    >>> task.cycles, round(task.period, 3)
    (300, 0.1)
    """

    maps: MapSource | Sequence[MapSource] = "rooms"
    start: str | None = None
    robots: int = 6
    team: Team | None = None
    duration: float = 60.0
    dt: float = DEFAULT_DT
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
        check_dt(self.dt)
        for name, most in (("robots", MOST_ROBOTS), ("repeat", 100_000), ("reward_every", 100_000)):
            checked(name, getattr(self, name), 1, most, whole=True)
        if not np.isfinite(self.duration) or self.duration < self.period - 5e-7:
            raise ParameterError(
                f"duration: {shown(self.duration)} s, but at least the time of one action, "
                f"{self.period:g} s, was wanted"
            )
        if not 0.0 <= self.contact_penalty < np.inf:
            raise ParameterError(
                f"contact_penalty: {shown(self.contact_penalty)}, but a finite number from 0 was wanted"
            )
        checked_reward(self.reward)
        if checked_action(self.action) == "velocity" and self.dt > FOLLOWING:
            raise ParameterError(
                f"dt: {self.dt:g} s, but at most {FOLLOWING:g} s was wanted for robots to follow velocities"
            )
        for name, kind in (("team", Team), ("observation", ObservationLayout), ("conditions", Conditions)):
            value = getattr(self, name)
            if not isinstance(value, kind) and not (value is None and name != "observation"):
                raise ParameterError(f"{name}: {shown(value)}, but a {kind.__name__} was wanted")
        if self.conditions is not None:
            self.conditions.check_team(len(self.whole_team))
        object.__setattr__(self, "team", self.whole_team)
        object.__setattr__(self, "robots", len(self.whole_team))

    @property
    def whole_team(self) -> Team:
        """The team, whether it was given or not."""
        return Team.homogeneous(self.robots) if self.team is None else self.team

    @property
    def period(self) -> float:
        """Seconds for which an action is held."""
        return self.repeat * self.dt

    @property
    def cycles(self) -> int:
        """How many actions an episode has."""
        return max(1, round(self.duration / self.period))

    @property
    def agents(self) -> list[str]:
        """What the robots are called: ``robot_1``, ``robot_2``, ..."""
        return [f"robot_{number}" for number in range(1, self.robots + 1)]

    def __repr__(self) -> str:
        return (
            f"<CoverageTask {counted(self.robots, 'robot')}, {self.duration:g} s, "
            f"{counted(self.cycles, 'action')}, {self.action}, reward {self.reward}>"
        )


def changed_task(task: CoverageTask | None, changes: Mapping[str, Any]) -> CoverageTask:
    """Return a task with some of its attributes changed; None is the usual one.

    Raises ParameterError when there is no attribute of that name, with the nearest one, or a value is out of
    range.
    """
    known = [each.name for each in fields(CoverageTask)]
    for name in changes:
        if name not in known:
            raise ParameterError(unknown_name("part of a task", name, known))
    if task is None:
        return CoverageTask(**changes)
    # the number of robots goes with the team, and would else be that of the old one
    team: dict[str, Any] = {"team": None} if "robots" in changes else {}
    return replace(task, **(team | dict(changes)))
