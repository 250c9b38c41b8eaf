"""Policies as controllers, and controllers as policies."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from robocov.arrays import Array
from robocov.controllers import inform_controller
from robocov.controllers.base import Controller
from robocov.controllers.gains import gain, validate_gains
from robocov.errors import ParameterError, require_type
from robocov.observation import Decision, Observations, Scanning, Scans
from robocov.observation.region import Region
from robocov.team import Team
from robocov_app.learning import task as tasks
from robocov_app.learning.episode import Episode
from robocov_app.learning.task import Action, ObservationLayout, actions_of, driving_forces

Policy: TypeAlias = Callable[[NDArray[np.float32]], Any]
"""From an observation, (size,), to an action, (2,)."""
_SOON = 5e-7  # seconds that sums of control periods may miss


@dataclass(frozen=True, eq=False)
class Held:
    """Memory of a policy: its last actions, (n, 2) N or m/s, and when the next are due, s."""

    team: Team
    actions: Array | None = None
    due: float = -np.inf


@dataclass(frozen=True)
class PolicyController:
    """A controller that does what a policy says, decided as often and observed as in training.

    The policy is asked for each robot alone, with its own row of the observations: that it uses nothing
    that the robot does not know is so by construction. For the command line a class is wanted that has the
    policy in it::

        # mine.py
        @dataclass(frozen=True)
        class MyPolicy(PolicyController):
            layout: ObservationLayout = ObservationLayout(neighbours=4)

            def act(self, observation):
                return observation @ WEIGHTS

    and ``robocov run rooms --controller mine.py:MyPolicy``.

    `policy` makes an action, (2,) in N or m/s, of an observation, (size,) float32, and is None where a
    subclass has `act`; `period` is the time for which an action is held, `CoverageTask.period` in training.

    Raises ParameterError when an attribute makes no sense, or the policy gives something else than two
    numbers.

    Examples
    --------
    >>> still = PolicyController(lambda observation: (0.0, 0.0))
    >>> still.name, still.period
    ('policy', 0.1)
    """

    name: ClassVar[str] = "policy"
    label: ClassVar[str] = "policy"
    summary: ClassVar[str] = "a policy that was learned"

    policy: Policy | None = None
    layout: ObservationLayout = field(default_factory=ObservationLayout)
    action: Action = "force"
    period: float = gain(0.1, "s", "for which an action is held")

    def __post_init__(self) -> None:
        tasks.checked_kind("action", self.action, tasks.ACTIONS)
        require_type("layout", self.layout, ObservationLayout, "an ObservationLayout")
        validate_gains(self)

    def __init_subclass__(cls) -> None:
        for attribute in ("name", "label"):
            if attribute not in vars(cls):
                setattr(cls, attribute, cls.__name__)

    @property
    def scanning(self) -> Scanning | None:
        return Scanning(self.layout.rays, self.period) if self.layout.rays else None

    def act(self, observation: NDArray[np.float32]) -> Any:
        """Return the action of one robot, (2,), from its observation, (size,)."""
        if self.policy is None:
            raise ParameterError(f"{self.name}: expected a policy or a method act(observation)")
        return self.policy(observation)

    def begin(self, region: Region, team: Team) -> Held:
        return Held(team)

    def decide(self, seen: Observations, memory: Held) -> Decision:
        """Return the forces of the actions, which are asked for when they are due."""
        due = seen.time >= memory.due - _SOON if not self.layout.rays else seen.scans is not None
        if memory.actions is None or due:
            rows = self.layout.rows(seen, memory.team)
            given = [np.asarray(self.act(row), dtype=np.float64) for row in rows]
            if wrong := [action.shape for action in given if action.shape != (2,)]:
                raise ParameterError(f"{self.name}: expected an action of shape (2,), got {wrong[0]}")
            memory = Held(memory.team, np.array(given), seen.time + self.period)
        assert memory.actions is not None
        forces = driving_forces(self.action, memory.actions, seen.velocities, memory.team)
        return Decision(forces, memory=memory)


class ControllerPolicy:
    """Says what a controller would do in the present state of a learning environment.

    It knows what the controller knows, not the observations that learners get; with ``repeat=1`` an episode
    is the same as a run, bit for bit. Scans that it wants are taken without the noise of any conditions.

    ::

        expert = ControllerPolicy(rc.Rapf())
        observations, infos = env.reset(seed=0)
        while env.agents:
            observations, rewards, *_ = env.step(expert(env))
    """

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self._episode: Episode | None = None
        self._law: Any = None
        self._memory: Any = None
        self._actions = np.empty((0, 2))

    def __call__(self, env: Any) -> Any:
        """Return the actions of a team: by agent for a parallel environment, else (n, 2) N or m/s.

        What the controller remembers begins anew with each episode. Asked twice about the same moment it
        says the same. The environment, `CoverageParallelEnv` or `CoverageEnv`, may be wrapped.
        """
        bare = env.unwrapped
        actions = self._decided(bare.episode).copy()
        if not hasattr(bare, "agents"):
            return actions
        rows = dict(zip(bare.possible_agents, actions, strict=True))
        return {agent: rows[agent] for agent in bare.agents}

    def _decided(self, episode: Episode) -> Array:
        if self._episode is not episode:
            self._episode, self._asked_at, self._scan_number = episode, -1, -1
            self._law = inform_controller(self.controller, episode.environment)
            self._memory = self._law.begin(episode.environment.region, episode.team)
        if self._asked_at != episode.cycle:
            seen = replace(episode.observe(), scans=self._scanned(episode))
            decision = self._law.decide(seen, self._memory)
            self._memory, self._asked_at = decision.memory, episode.cycle
            self._actions = actions_of(episode.task.action, decision.forces, seen.velocities, episode.team)
        return self._actions

    def _scanned(self, episode: Episode) -> Scans | None:
        """Return a scan where the controller wants one, as often as in a run or at each decision."""
        scanning: Scanning | None = getattr(self._law, "scanning", None)
        if scanning is None:
            return None
        number = episode.cycle * episode.task.repeat // scanning.count_steps(episode.task.dt)
        if number == self._scan_number:
            return None
        self._scan_number, simulation = number, episode.simulation
        scans = simulation.sensor.scan(episode.positions, scanning.rays, episode.team.sensing_range)
        return Scans(*scans)
