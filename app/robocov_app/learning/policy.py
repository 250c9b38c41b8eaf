"""Policies as controllers, and controllers as policies."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, TypeAlias

import numpy as np

from robocov.controllers import inform_controller
from robocov.controllers.base import Controller
from robocov.controllers.gains import gain, validate_gains
from robocov.errors import ParameterError, require_type
from robocov.observation import Decision, Observations, Scanning, Scans
from robocov.observation.region import Region
from robocov.team import Team
from robocov.typing import Float32Array, FloatArray
from robocov_app.learning.actions import ACTIONS, Action, compute_actions, compute_driving_forces
from robocov_app.learning.episode import Episode
from robocov_app.learning.observation_layout import ObservationLayout
from robocov_app.learning.task import check_kind

Policy: TypeAlias = Callable[[Float32Array], Any]
"""Function that takes the observation of a robot, (size,), and returns its action, (2,)."""
_TIME_TOLERANCE_S = 5e-7
"""Tolerance for rounding errors in sums of control periods."""


@dataclass(frozen=True, eq=False)
class PolicyMemory:
    """Memory of a `PolicyController` between control steps.

    Parameters
    ----------
    team : Team
    actions : (n, 2) array, N or m/s, optional
        Current actions; None before the first decision.
    next_time : float
        Time at which the next actions are decided, s.
    """

    team: Team
    actions: FloatArray | None = None
    next_time: float = -np.inf


@dataclass(frozen=True)
class PolicyController:
    """A controller that executes a policy, with the same observations and action period as in training.

    The policy is called separately for each robot, with the observation of that robot, so that it cannot use
    the knowledge of other robots. To use a policy on the command line, write a subclass with a method `act`
    in a file, and run ``robocov run rooms --controller mine.py:MyPolicy``.

    Parameters
    ----------
    policy : callable, optional
        Takes an observation, (size,) float32, and returns an action, (2,) in N or m/s. Not needed by a
        subclass with a method `act`.
    layout : ObservationLayout
        Layout of the observations in training.
    action : str
        Kind of the actions.
    period : float
        Time for which an action is held, s. Should be the `CoverageTask.period` of the training.

    Raises
    ------
    ParameterError
        If an attribute is invalid, or the policy does not return two numbers.

    See Also
    --------
    ControllerPolicy : The opposite: lets a controller act in a learning environment.
    CoverageTask : The training task, which has the same layout, action and period.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> from robocov_app.learning import ObservationLayout, PolicyController
    >>> still = PolicyController(lambda observation: (0.0, 0.0))
    >>> still.name, still.period
    ('policy', 0.1)

    A policy as a subclass, whose robots return to the middle of the map:

    >>> import robocov as rc
    >>> @dataclass(frozen=True)
    ... class Returning(PolicyController):
    ...     layout: ObservationLayout = ObservationLayout(neighbors=2)
    ...
    ...     def act(self, observation):
    ...         return -3.0 * observation[:2]
    >>> rc.run("square", Returning(), robots=2, duration=0.5)
    <Record Returning on Square, 2 robots, 0.5 s>
    """

    name: ClassVar[str] = "policy"
    label: ClassVar[str] = "policy"
    summary: ClassVar[str] = "learned policy"

    policy: Policy | None = None
    layout: ObservationLayout = field(default_factory=ObservationLayout)
    action: Action = "force"
    period: float = gain(0.1, "s", "for which an action is held")

    def __post_init__(self) -> None:
        check_kind("action", self.action, ACTIONS)
        require_type("layout", self.layout, ObservationLayout, "an ObservationLayout")
        validate_gains(self)

    def __init_subclass__(cls) -> None:
        for attribute in ("name", "label"):
            if attribute not in vars(cls):
                setattr(cls, attribute, cls.__name__)

    @property
    def scanning(self) -> Scanning | None:
        """Scans that the observations need."""
        return Scanning(self.layout.rays, self.period) if self.layout.rays else None

    def act(self, observation: Float32Array) -> Any:
        """Return the action of one robot for its observation.

        Parameters
        ----------
        observation : (size,) float32 array
            Observation of the robot; see `ObservationLayout`.

        Returns
        -------
        (2,) array_like, N or m/s

        Raises
        ------
        ParameterError
            If there is no policy, and the subclass does not define this method.
        """
        if self.policy is None:
            raise ParameterError(f"{self.name}: expected a policy or a method act(observation)")
        return self.policy(observation)

    def begin(self, region: Region, team: Team) -> PolicyMemory:
        """Return the memory before the first decision.

        Parameters
        ----------
        region : Region
        team : Team

        Returns
        -------
        PolicyMemory
        """
        return PolicyMemory(team)

    def decide(self, seen: Observations, memory: PolicyMemory) -> Decision:
        """Compute the forces of the current actions; ask the policy for new actions once per period.

        Parameters
        ----------
        seen : Observations
        memory : PolicyMemory

        Returns
        -------
        Decision
        """
        actions = memory.actions
        if actions is None or self._needs_new_actions(seen, memory):
            actions = self._compute_actions(seen, memory.team)
            memory = PolicyMemory(memory.team, actions, next_time=seen.time + self.period)
        forces = compute_driving_forces(self.action, actions, seen.velocities, memory.team)
        return Decision(forces, memory=memory)

    def _needs_new_actions(self, seen: Observations, memory: PolicyMemory) -> bool:
        """Return whether a decision is due: after each new scan or, with no rays, after each period."""
        if self.layout.rays:
            return seen.scans is not None
        return seen.time >= memory.next_time - _TIME_TOLERANCE_S

    def _compute_actions(self, seen: Observations, team: Team) -> FloatArray:
        """Call the policy for each robot, and return the actions, (n, 2)."""
        rows = self.layout.build_rows(seen, team)
        actions = [np.asarray(self.act(row), dtype=np.float64) for row in rows]
        for action in actions:
            if action.shape != (2,):
                raise ParameterError(f"{self.name}: expected an action of shape (2,), got {action.shape}")
        return np.array(actions)


class ControllerPolicy:
    """A policy that returns the actions of a controller in the current state of a learning environment.

    The controller receives its usual observations, not those of learners. With ``repeat=1``, an episode is
    the same as a run with this controller, bit for bit. Scans have no noise, even if the conditions do.

    Parameters
    ----------
    controller : Controller
        Controller that chooses the actions.

    See Also
    --------
    PolicyController : The opposite: turns a policy into a controller.

    Examples
    --------
    >>> import robocov as rc
    >>> from robocov_app.learning import ControllerPolicy, CoverageParallelEnv
    >>> expert = ControllerPolicy(rc.Rapf())
    >>> env = CoverageParallelEnv(maps="square", robots=3, duration=1.0)
    >>> observations, infos = env.reset(seed=0)
    >>> while env.agents:
    ...     observations, rewards, *_ = env.step(expert(env))
    >>> len(rewards)
    3
    """

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self._episode: Episode | None = None
        self._informed: Any = None
        self._memory: Any = None
        self._decision_cycle = -1
        self._next_scan_step = 0
        self._actions = np.empty((0, 2))

    def __call__(self, env: Any) -> dict[str, FloatArray] | FloatArray:
        """Return the actions of the team in the current state of an environment.

        The memory of the controller is reset in each episode. Repeated calls between two steps of the
        environment return the same actions.

        Parameters
        ----------
        env : CoverageParallelEnv or CoverageEnv
            The environment, which may have wrappers.

        Returns
        -------
        dict or (n, 2) array, N or m/s
            Actions by agent for a parallel environment; otherwise an array.
        """
        environment = env.unwrapped
        actions = self._update_actions(environment.get_episode()).copy()
        formatted_actions: dict[str, FloatArray] | FloatArray = environment.format_actions(actions)
        return formatted_actions

    def _update_actions(self, episode: Episode) -> FloatArray:
        """Return the actions of the current decision; ask the controller if it has not decided yet."""
        if self._episode is not episode:
            self._start(episode)
        if self._decision_cycle != episode.cycle:
            seen = replace(episode.observe(), scans=self._take_due_scan(episode))
            decision = self._informed.decide(seen, self._memory)
            self._memory = decision.memory
            self._decision_cycle = episode.cycle
            self._actions = compute_actions(
                episode.task.action, decision.forces, seen.velocities, episode.team
            )
        return self._actions

    def _start(self, episode: Episode) -> None:
        """Reset the memory of the controller for a new episode."""
        self._episode = episode
        self._decision_cycle = -1
        self._next_scan_step = 0
        self._informed = inform_controller(self.controller, episode.environment)
        self._memory = self._informed.begin(episode.environment.region, episode.team)

    def _take_due_scan(self, episode: Episode) -> Scans | None:
        """Scan if a scan is due, and schedule the next one; otherwise return None.

        Scans are due as often as in a run, but at most once per decision.
        """
        # Controllers in a user's file may lack this attribute.
        scanning: Scanning | None = getattr(self._informed, "scanning", None)
        if scanning is None:
            return None
        step = episode.cycle * episode.task.repeat
        if step < self._next_scan_step:
            return None
        scan_interval = scanning.count_steps(episode.task.dt)
        self._next_scan_step = (step // scan_interval + 1) * scan_interval
        sensor = episode.simulation.sensor
        return Scans(*sensor.scan(episode.positions, scanning.rays, episode.team.sensing_range))
