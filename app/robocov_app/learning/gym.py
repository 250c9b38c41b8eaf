"""Environments for gymnasium, with one learner for the whole team, registered as ``robocov/Coverage-v0``.

Importing this module registers the environment. ``gymnasium.make`` does both if the name contains the module,
``"robocov_app.learning.gym:robocov/Coverage-v0"``; gymnasium no longer supports entry points of packages.
``gymnasium.make_vec`` builds a `CoverageVectorEnv` with ``vectorization_mode="vector_entry_point"``.
"""

from functools import partial
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from robocov.errors import ParameterError, quote, require_whole_number
from robocov.typing import Float32Array, FloatArray
from robocov_app.learning.actions import check_actions, compute_action_limits
from robocov_app.learning.environment import EpisodeEnv, draw_episode
from robocov_app.learning.episode import ActionOutcome, SharedRun, SharedSimulation
from robocov_app.learning.maps import MapSampler
from robocov_app.learning.task import CoverageTask, change_task

ID = "robocov/Coverage-v0"
"""Name of the registered environment."""


class CoverageEnv(EpisodeEnv, gymnasium.Env[Float32Array, Float32Array]):
    """Environment in which one learner with the knowledge of all robots drives the team: gymnasium's ``Env``.

    An observation has one row for each robot, (n, size) float32 from -1 to 1, in the task's
    `ObservationLayout`. The row of a robot that has failed or not yet joined is zero. An action has one row
    for each robot, (n, 2), with a force in N or a velocity in m/s that is held for `CoverageTask.repeat`
    control periods. The reward is the mean of the robots' rewards in `CoverageParallelEnv`.

    An episode is truncated after `CoverageTask.duration`, and terminates when no robot works. The same seed
    and actions give the same episode, bit for bit.

    Parameters
    ----------
    task : CoverageTask, optional
        By default, a task with default values.
    **options
        Options of `robocov_app.learning.environment.EpisodeEnv`, and attributes of the task to change, as in
        ``gymnasium.make(..., maps="museum", robots=4)``.

    Attributes
    ----------
    shared_run : SharedRun or None
        Place of this environment in a simulation that is shared with others.
    next_outcome : ActionOutcome or None
        Outcome of the next action, if the shared simulation has already executed it.

    Raises
    ------
    ParameterError
        If a value is out of range.
    InputError
        If a map cannot be read.

    See Also
    --------
    CoverageVectorEnv : Many of these environments, advanced together.
    CoverageParallelEnv : One learner for each robot.
    CoverageTask : Everything that defines the environment.

    Examples
    --------
    >>> from robocov_app.learning import CoverageEnv
    >>> env = CoverageEnv(maps="square", robots=3, duration=1.0)
    >>> observation, info = env.reset(seed=0)
    >>> observation.shape, env.action_space.shape
    ((3, 19), (3, 2))
    >>> is_truncated = False
    >>> while not is_truncated:
    ...     action = env.action_space.sample()
    ...     observation, reward, is_terminated, is_truncated, info = env.step(action)
    >>> env.close()
    """

    shared_run: "SharedRun | None" = None
    next_outcome: ActionOutcome | None = None

    def __init__(self, task: CoverageTask | None = None, **options: Any) -> None:
        super().__init__(task, **options)
        low, high = self.task.observation.bounds
        copies = (self.task.robots, 1)
        self.observation_space = Box(np.tile(low, copies), np.tile(high, copies), dtype=np.float32)
        limits = compute_action_limits(self.task.action, self.task.whole_team)
        high_actions = np.tile(limits[:, None], (1, 2)).astype(np.float32)
        self.action_space = Box(-high_actions, high_actions, dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32Array, dict[str, Any]]:
        """Start an episode.

        Parameters
        ----------
        seed : int, optional
            Seed of the random numbers. Without a seed, their sequence continues.
        options : dict, optional
            Values to use instead of random ones; see `robocov_app.learning.environment.draw_episode`.

        Returns
        -------
        observation : (n, size) array
        info : dict
        """
        gymnasium.Env.reset(self, seed=seed)
        self.next_outcome = None
        self.episode = draw_episode(self.task, self._sampler, self.np_random, options, self.shared_run)
        self._update_window()
        info = self._build_info(np.zeros(self.task.robots))
        return self._build_rows(), {**info, "map": self.episode.environment.name}

    def step(self, action: Any) -> tuple[Float32Array, float, bool, bool, dict[str, Any]]:
        """Execute the actions of the team.

        Parameters
        ----------
        action : (n, 2) array_like, N or m/s
            One row for each robot.

        Returns
        -------
        observation : (n, size) array
        reward : float
        terminated, truncated : bool
        info : dict
        """
        episode = self.get_episode()
        outcome = self.next_outcome or episode.advance(action)
        self.next_outcome = None
        self._update_window()
        is_terminated = not episode.is_working.any()
        is_truncated = episode.cycle >= self.task.cycles
        reward = float(outcome.rewards.sum()) / len(episode.team)
        info = self._build_info(outcome.contact_time)
        return self._build_rows(), reward, is_terminated, is_truncated, info

    def _build_rows(self) -> Float32Array:
        """Return the current observation, with zeros for robots that do not work."""
        episode = self.get_episode()
        rows = episode.build_rows()
        rows[~episode.is_working] = 0.0
        return rows

    def _build_info(self, contact_time: FloatArray) -> dict[str, Any]:
        """Build the info dictionary; `contact_time`, (n,) s, is that of the last action."""
        episode = self.get_episode()
        return {
            **episode.summarize(),
            "contact_s": contact_time.copy(),
            "working": episode.is_working.copy(),
        }


class CoverageVectorEnv(SyncVectorEnv):
    """Many `CoverageEnv` environments in one process, several times as fast: gymnasium's ``VectorEnv``.

    Each environment behaves exactly as it would alone, bit for bit: after ``reset(seed=s)``, environment k
    behaves as one with the seed s + k. The environments are advanced together if they are all on the same
    map, without conditions or moving obstacles, and otherwise one by one.

    Parameters
    ----------
    num_envs : int
        Number of environments.
    task : CoverageTask, optional
        By default, a task with default values.
    autoreset_mode : str or gymnasium.vector.AutoresetMode
        When the next episode starts after one has ended.
    render_mode : str, optional
        Render mode of each environment.
    **changes
        Attributes of the task to change.

    Raises
    ------
    ParameterError
        If a value is out of range.
    InputError
        If a map cannot be read.

    See Also
    --------
    CoverageEnv : One of these environments.

    Examples
    --------
    >>> from robocov_app.learning import CoverageVectorEnv
    >>> envs = CoverageVectorEnv(2, maps="square", robots=3)
    >>> observations, infos = envs.reset(seed=0)
    >>> observations.shape
    (2, 3, 19)
    >>> observations, rewards, terminations, truncations, infos = envs.step(envs.action_space.sample())
    >>> rewards.shape
    (2,)
    >>> envs.close()
    """

    def __init__(
        self,
        num_envs: int,
        task: CoverageTask | None = None,
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        **changes: Any,
    ) -> None:
        require_whole_number("num_envs", num_envs, 1)
        self.task = change_task(task, changes)
        radius = self.task.whole_team.min_radius
        sampler = MapSampler(self.task.maps, self.task.lattice, radius)
        make = partial(CoverageEnv, self.task, sampler=sampler, render_mode=render_mode)
        super().__init__([make] * num_envs, autoreset_mode=autoreset_mode)
        self._environments = cast("list[CoverageEnv]", self.envs)
        self._shared = self._share_simulation(sampler)

    def _share_simulation(self, sampler: MapSampler) -> SharedSimulation | None:
        """Let all environments share one simulation if the task allows it; return it, or None."""
        only_map = sampler.only_map
        is_ideal = self.task.conditions is None or self.task.conditions.is_ideal
        if only_map is None or only_map.has_moving_obstacles or not is_ideal or self.task.recording:
            return None
        simulation = SharedSimulation(self.task, only_map, self.num_envs)
        for run, environment in enumerate(self._environments):
            environment.shared_run = SharedRun(simulation, run)
        return simulation

    def step(self, actions: Any) -> Any:
        """Execute the actions of all teams, with results in the format of gymnasium.

        Parameters
        ----------
        actions : (num_envs, n, 2) array_like, N or m/s
            One row for each robot of each environment.

        Returns
        -------
        observations : (num_envs, n, size) array
        rewards : (num_envs,) array
        terminations, truncations : (num_envs,) bool arrays
        infos : dict

        Raises
        ------
        ParameterError
            If there are not as many rows as environments, or if the actions of an environment have the wrong
            shape or are not finite.
        """
        expected = f"expected one array for each of {self.num_envs} environments"
        try:
            count = len(actions)
        except TypeError as error:
            raise ParameterError(f"actions: {expected}, got {quote(actions)}") from error
        if count != self.num_envs:
            raise ParameterError(f"actions: {expected}, got {count}")
        # This step only resets these environments, and ignores their actions.
        is_reset_only = self._autoreset_envs & (self.autoreset_mode == AutoresetMode.NEXT_STEP)
        checked = np.zeros((self.num_envs, self.task.robots, 2))
        shared_episodes = {}
        for run, (environment, action) in enumerate(zip(self._environments, actions, strict=True)):
            if is_reset_only[run]:
                continue
            checked[run] = check_actions(action, self.task.robots)
            if environment.episode is not None and environment.episode.shared is not None:
                shared_episodes[run] = environment.episode
        if self._shared is not None and shared_episodes:
            for run, outcome in self._shared.step(checked, shared_episodes).items():
                self._environments[run].next_outcome = outcome
        # Each environment returns the outcome that was stored above, or advances by itself.
        return super().step(checked)


gymnasium.register(
    ID,
    entry_point=f"{__name__}:{CoverageEnv.__name__}",
    vector_entry_point=f"{__name__}:{CoverageVectorEnv.__name__}",
)
