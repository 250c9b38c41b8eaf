"""One learner for each robot: a parallel environment of PettingZoo."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from itertools import compress
from typing import Any, TypeAlias, TypeVar

import numpy as np
from gymnasium.spaces import Box
from gymnasium.utils import seeding
from pettingzoo import ParallelEnv

from robocov.errors import ParameterError, quote
from robocov_app.learning.episode import EpisodeEnv, drawn_episode
from robocov_app.learning.task import CoverageTask, Rows, action_limit

_T = TypeVar("_T")
Flags: TypeAlias = dict[str, bool]
Step: TypeAlias = tuple[dict[str, Rows], dict[str, float], Flags, Flags, dict[str, dict[str, Any]]]


class CoverageParallelEnv(EpisodeEnv, ParallelEnv):
    """A team that learns to cover, each robot by what it knows: PettingZoo's ``ParallelEnv``.

    The agents are ``robot_1`` to ``robot_n``. An observation is one row of the task's `ObservationLayout`:
    float32, from -1 to 1. An action is a force in N or a velocity in m/s, (2,), held for
    `CoverageTask.repeat` control periods. An episode is truncated after `CoverageTask.duration`, or after
    `max_cycles` actions. The same seed and actions give the same episode, bit for bit.

    The `options` are those of `robocov_app.learning.episode.EpisodeEnv`, with changes of the task, as in
    ``CoverageParallelEnv(maps="museum", robots=4)``.

    Raises InputError when the task makes no sense or a map cannot be read.
    """

    metadata = EpisodeEnv.metadata | {"name": "robocov_coverage_v0", "is_parallelizable": True}

    def __init__(
        self, task: CoverageTask | None = None, *, max_cycles: int | None = None, **options: Any
    ) -> None:
        super().__init__(task, **options)
        self.max_cycles = self.task.cycles if max_cycles is None else max_cycles
        if self.max_cycles < 1:
            raise ParameterError(f"max_cycles: expected a whole number of at least 1, got {max_cycles}")
        self.possible_agents = self.task.agents
        self.agents: list[str] = []
        self._rng = np.random.default_rng()
        low, high = self.task.observation.bounds
        limits = action_limit(self.task.action, self.task.whole_team).tolist()
        self.observation_spaces = {agent: Box(low, high, dtype=np.float32) for agent in self.possible_agents}
        boxes = (Box(-limit, limit, (2,), np.float32) for limit in limits)
        self.action_spaces = dict(zip(self.possible_agents, boxes, strict=True))
        self.state_space = Box(-1.0, 1.0, (4 * self.task.robots,), np.float32)

    def observation_space(self, agent: str) -> Box:
        """Return the space of a robot's observations, the same object every time."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """Return the space of a robot's actions, the same object every time."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Rows], dict[str, dict[str, Any]]]:
        """Begin an episode; without a seed the random numbers go on. The options are `drawn_episode`'s."""
        if seed is not None:
            self._rng, _ = seeding.np_random(seed)
        self.episode = drawn_episode(self.task, self._scenarios, self._rng, options)
        self.agents = list(compress(self.possible_agents, self.episode.working))
        self._show()
        told = {**self.episode.facts(), "contact_s": 0.0, "map": self.episode.environment.name}
        infos = {agent: dict(told) for agent in self.possible_agents}
        return self._of(self.agents, self.episode.observations()), infos

    def step(self, actions: Mapping[str, Any]) -> Step:
        """Let every robot act, and return observations, rewards, terminations, truncations and infos."""
        episode = self._present()
        values = np.zeros((self.task.robots, 2))
        for robot, agent in enumerate(self.possible_agents):
            if agent not in self.agents:
                continue
            if agent not in actions:
                raise ParameterError(f"actions: expected one for each agent, got none for {agent}")
            action = np.empty(0)
            with suppress(TypeError, ValueError):
                action = np.asarray(actions[agent], dtype=np.float64)
            if action.shape != (2,) or not np.isfinite(action).all():
                found = quote(actions[agent])
                raise ParameterError(f"action of {agent}: expected two finite numbers, got {found}")
            values[robot] = action
        acting, over = self.agents, episode.cycle + 1 >= self.max_cycles
        outcome = episode.advance(values, last=over)
        self.agents = list(compress(self.possible_agents, episode.working))
        told = [agent for agent in self.possible_agents if agent in acting or agent in self.agents]
        # who has failed will not come back: for it the episode has ended
        ended = {agent: agent not in self.agents for agent in told}
        truncated = {agent: over and not ended[agent] for agent in told}
        observations, rewards = self._of(told, episode.observations()), outcome.rewards.tolist()
        touched, common = self._of(told, outcome.contact.tolist()), episode.facts()
        infos = {agent: {**common, "contact_s": seconds} for agent, seconds in touched.items()}
        if over:
            self.agents = []
        self._show()
        return observations, self._of(told, rewards), ended, truncated, infos

    def state(self) -> Rows:
        """Return where all robots are and how fast, for critics: see `Episode.state`."""
        return self._present().state()

    def _of(self, agents: list[str], values: Iterable[_T]) -> dict[str, _T]:
        """Return the values of some of the agents, of one for each robot."""
        every = dict(zip(self.possible_agents, values, strict=True))
        return {agent: every[agent] for agent in agents}
