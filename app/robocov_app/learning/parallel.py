"""Environment with one learner for each robot: a PettingZoo parallel environment."""

from collections.abc import Iterable, Mapping
from itertools import compress
from typing import Any, TypeAlias, TypeVar

import numpy as np
from gymnasium.spaces import Box
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from robocov.errors import ParameterError, quote, require_whole_number, to_floats
from robocov.typing import Float32Array, FloatArray
from robocov_app.learning.actions import compute_action_limits
from robocov_app.learning.environment import EpisodeEnv, draw_episode
from robocov_app.learning.task import CoverageTask

_Value = TypeVar("_Value")
Flags: TypeAlias = dict[str, bool]
"""One flag for each agent."""
Step: TypeAlias = tuple[dict[str, Float32Array], dict[str, float], Flags, Flags, dict[str, dict[str, Any]]]
"""Observations, rewards, terminations, truncations and infos by agent."""


class CoverageParallelEnv(EpisodeEnv, ParallelEnv):
    """Environment with one learner for each robot: PettingZoo's ``ParallelEnv``.

    A learner knows only what its robot knows.

    The agents are ``robot_1`` to ``robot_n``. An observation is one row of the task's `ObservationLayout`:
    float32, from -1 to 1. An action is a force in N or a velocity in m/s, (2,), held for
    `CoverageTask.repeat` control periods. An episode is truncated after `CoverageTask.duration`, or after
    `max_cycles` actions if that is earlier. The same seed and actions give the same episode, bit for bit.

    Parameters
    ----------
    task : CoverageTask, optional
        By default, a task with default values.
    max_cycles : int, optional
        Maximum number of actions; at most, and by default, as many as fit into the duration.
    **options
        Options of `robocov_app.learning.environment.EpisodeEnv`, and attributes of the task to change, as in
        ``CoverageParallelEnv(maps="museum", robots=4)``.

    Raises
    ------
    ParameterError
        If a value is out of range.
    InputError
        If a map cannot be read.

    See Also
    --------
    CoverageEnv : One learner for all robots.
    ObservationLayout : The numbers of an observation.
    CoverageTask : Everything that defines the environment.

    Examples
    --------
    >>> from robocov_app.learning import CoverageParallelEnv
    >>> env = CoverageParallelEnv(maps="square", robots=3, duration=1.0)
    >>> observations, infos = env.reset(seed=0)
    >>> sorted(observations), observations["robot_1"].shape
    (['robot_1', 'robot_2', 'robot_3'], (19,))
    >>> while env.agents:
    ...     actions = {agent: env.action_space(agent).sample() for agent in env.agents}
    ...     observations, rewards, terminations, truncations, infos = env.step(actions)
    >>> sorted(rewards)
    ['robot_1', 'robot_2', 'robot_3']
    """

    metadata = EpisodeEnv.metadata | {"name": "robocov_coverage_v0", "is_parallelizable": True}

    def __init__(
        self, task: CoverageTask | None = None, *, max_cycles: int | None = None, **options: Any
    ) -> None:
        super().__init__(task, **options)
        self.max_cycles = self.task.cycles
        if max_cycles is not None:
            require_whole_number("max_cycles", max_cycles, 1)
            self.max_cycles = min(max_cycles, self.task.cycles)
        self.possible_agents = self.task.agents
        self.agents: list[str] = []
        self._rng = np.random.default_rng()
        low, high = self.task.observation.bounds
        self.observation_spaces = {agent: Box(low, high, dtype=np.float32) for agent in self.possible_agents}
        limits = compute_action_limits(self.task.action, self.task.whole_team).tolist()
        self.action_spaces = {
            agent: Box(-limit, limit, (2,), np.float32)
            for agent, limit in zip(self.possible_agents, limits, strict=True)
        }
        self.state_space = Box(-1.0, 1.0, (4 * self.task.robots,), np.float32)

    def observation_space(self, agent: str) -> Box:
        """Return the space of a robot's observations, always the same object.

        Parameters
        ----------
        agent : str
            Name of the robot, such as ``robot_1``.

        Returns
        -------
        Box
        """
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """Return the space of a robot's actions, always the same object.

        Parameters
        ----------
        agent : str
            Name of the robot, such as ``robot_1``.

        Returns
        -------
        Box
            Forces in N or velocities in m/s, up to the largest useful ones.
        """
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Float32Array], dict[str, dict[str, Any]]]:
        """Start an episode.

        Parameters
        ----------
        seed : int, optional
            Seed of the random numbers. Without a seed, their sequence continues.
        options : Mapping, optional
            Values to use instead of random ones; see `robocov_app.learning.environment.draw_episode`.

        Returns
        -------
        observations, infos : dict
            By agent.
        """
        if seed is not None:
            self._rng, _ = seeding.np_random(seed)
        self.episode = draw_episode(self.task, self._sampler, self._rng, options)
        self.agents = list(compress(self.possible_agents, self.episode.is_working))
        self._update_window()
        info = {**self.episode.summarize(), "contact_s": 0.0, "map": self.episode.environment.name}
        infos = {agent: dict(info) for agent in self.possible_agents}
        return self._select(self.agents, self.episode.build_rows()), infos

    def step(self, actions: Mapping[str, Any]) -> Step:
        """Execute the actions of all robots.

        Parameters
        ----------
        actions : Mapping
            Action of each agent by its name, (2,) N or m/s.

        Returns
        -------
        observations, rewards, terminations, truncations, infos : dict
            Results by agent, for each robot that was working before the actions or is working after them.
        """
        episode = self.get_episode()
        checked = self._check_actions(actions)
        acting = self.agents
        is_truncated = episode.cycle + 1 >= self.max_cycles
        outcome = episode.advance(checked, is_last=is_truncated)
        self.agents = list(compress(self.possible_agents, episode.is_working))
        reported = [agent for agent in self.possible_agents if agent in acting or agent in self.agents]
        # A robot that has failed never works again, so its episode has terminated.
        terminations = {agent: agent not in self.agents for agent in reported}
        truncations = {agent: is_truncated and not terminations[agent] for agent in reported}
        observations = self._select(reported, episode.build_rows())
        rewards = self._select(reported, outcome.rewards.tolist())
        contact_times = self._select(reported, outcome.contact_time.tolist())
        summary = episode.summarize()
        infos = {agent: {**summary, "contact_s": seconds} for agent, seconds in contact_times.items()}
        if is_truncated:
            self.agents = []
        self._update_window()
        return observations, rewards, terminations, truncations, infos

    def _check_actions(self, actions: Mapping[str, Any]) -> FloatArray:
        """Check the actions, and return them as an array, (n, 2), with zeros for robots that do not work."""
        checked = np.zeros((self.task.robots, 2))
        for robot, agent in enumerate(self.possible_agents):
            if agent not in self.agents:
                continue
            if agent not in actions:
                raise ParameterError(f"actions: expected one for each agent, got none for {agent}")
            action = to_floats(f"action of {agent}", actions[agent], "two finite numbers")
            if action.shape != (2,) or not np.isfinite(action).all():
                raise ParameterError(
                    f"action of {agent}: expected two finite numbers, got {quote(actions[agent])}"
                )
            checked[robot] = action
        return checked

    def state(self) -> Float32Array:
        """Return positions and velocities of all robots, for a central critic; see `Episode.build_state`."""
        return self.get_episode().build_state()

    def format_actions(self, actions: FloatArray) -> dict[str, FloatArray]:
        """Return the actions of all robots by the names of the current agents.

        Parameters
        ----------
        actions : (n, 2) array, N or m/s

        Returns
        -------
        dict of str to (2,) array
        """
        return self._select(self.agents, actions)

    def _select(self, agents: list[str], values: Iterable[_Value]) -> dict[str, _Value]:
        """Return the values of some agents by name, given one value for each robot."""
        by_agent = dict(zip(self.possible_agents, values, strict=True))
        return {agent: by_agent[agent] for agent in agents}
