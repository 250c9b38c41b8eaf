"""One learner for the whole team: an environment of gymnasium, registered as ``robocov/Coverage-v0``.

Importing this module registers it; ``gymnasium.make("robocov_app.learning.gym:robocov/Coverage-v0")`` does
both. (gymnasium knows no entry points of packages any more.) ``gymnasium.make_vec`` makes a
`CoverageVectorEnv` with ``vectorization_mode="vector_entry_point"``.
"""

from functools import partial
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from numpy.typing import NDArray

from robocov.arrays import Array
from robocov_app.learning import episode as episodes
from robocov_app.learning.episode import EpisodeEnv, Outcome, Place, SharedSimulation
from robocov_app.learning.task import CoverageTask, Rows, Scenarios, action_limit, changed_task

ID = "robocov/Coverage-v0"


class CoverageEnv(EpisodeEnv, gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A team that one learner steers, who is told what all robots know: gymnasium's ``Env``.

    Observations are the robots' rows of the task's `ObservationLayout` below each other, (n, size) float32
    from -1 to 1, zero for a robot that has failed, or not yet joined; actions one row for each robot, (n, 2),
    forces in N or velocities in m/s, held for `CoverageTask.repeat` control periods. The reward is the mean
    of what `CoverageParallelEnv` gives each robot.

    An episode is truncated after `CoverageTask.duration`, and ends when no robot is left. The same seed and
    actions give the same episode, bit for bit. The `options` are those of
    `robocov_app.learning.episode.EpisodeEnv`, with changes of the task, as in
    ``gymnasium.make(..., maps="museum", robots=4)``.

    Raises InputError when the task makes no sense or a map cannot be read.
    """

    place: "Place | None" = None
    outcome: Outcome | None = None

    def __init__(self, task: CoverageTask | None = None, **options: Any) -> None:
        super().__init__(task, **options)
        low, high = (np.tile(row, (self.task.robots, 1)) for row in self.task.observation.bounds)
        self.observation_space = Box(low, high, dtype=np.float32)
        limit = np.tile(action_limit(self.task.action, self.task.whole_team)[:, None], (1, 2))
        self.action_space = Box(-limit.astype(np.float32), limit.astype(np.float32), dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Rows, dict[str, Any]]:
        """Begin an episode; without a seed the random numbers go on. The options are `drawn_episode`'s."""
        gymnasium.Env.reset(self, seed=seed)
        self.outcome = None
        self.episode = episodes.drawn_episode(self.task, self._scenarios, self.np_random, options, self.place)
        self._show()
        info = self._info(np.zeros(self.task.robots))
        return self._rows(), {**info, "map": self.episode.environment.name}

    def step(self, action: Any) -> tuple[Rows, float, bool, bool, dict[str, Any]]:
        """Let the team act, and return observation, reward, termination, truncation and info."""
        episode = self._present()
        outcome, self.outcome = self.outcome or episode.advance(action), None
        self._show()
        ended, over = not episode.working.any(), episode.cycle >= self.task.cycles
        reward = float(outcome.rewards.sum()) / len(episode.team)
        return self._rows(), reward, ended, over, self._info(outcome.contact)

    def _rows(self) -> Rows:
        rows = self._present().observations()
        rows[~self._present().working] = 0.0
        return rows

    def _info(self, contact: Array) -> dict[str, Any]:
        episode = self._present()
        return {**episode.facts(), "contact_s": contact.copy(), "working": episode.working.copy()}


class CoverageVectorEnv(SyncVectorEnv):
    """Many of `CoverageEnv` in one process, several times as quick: gymnasium's ``VectorEnv``.

    Each environment is what it is alone, bit for bit: with ``reset(seed=s)`` that of the seed s + k.
    Those on one map without conditions and moving obstacles are moved on together, others one by one.
    `autoreset_mode` says when an episode that is over is followed by the next one, `render_mode` is that of
    each environment, and `changes` are of the task.

    Raises InputError when the task makes no sense or a map cannot be read.
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
        self.task = changed_task(task, changes)
        scenarios = Scenarios(self.task.maps, self.task.lattice)
        make = partial(CoverageEnv, self.task, scenarios=scenarios, render_mode=render_mode)
        super().__init__([make] * num_envs, autoreset_mode=autoreset_mode)
        self._teams = cast("list[CoverageEnv]", self.envs)
        ideal = self.task.conditions is None or self.task.conditions.is_ideal
        self._shared: SharedSimulation | None = None
        if (
            scenarios.only is not None
            and not scenarios.only.has_moving_obstacles
            and ideal
            and not self.task.recording
        ):
            self._shared = SharedSimulation(self.task, scenarios.only, num_envs)
            for run, env in enumerate(self._teams):
                env.place = self._shared, run

    def step(self, actions: Any) -> Any:
        """Let all teams act, and return observations, rewards, terminations, truncations and infos."""
        begun_now = self._autoreset_envs & (self.autoreset_mode == AutoresetMode.NEXT_STEP)
        values, together = np.zeros((self.num_envs, self.task.robots, 2)), {}
        for run, (env, action) in enumerate(zip(self._teams, actions, strict=True)):
            if not begun_now[run]:
                values[run] = episodes.checked_actions(action, self.task.robots)
                if env.episode is not None and env.episode.shared is not None:
                    together[run] = env.episode
        if self._shared is not None and together:
            for run, outcome in self._shared.advance(values, together).items():
                self._teams[run].outcome = outcome
        return super().step(values)


gymnasium.register(
    ID,
    entry_point=f"{__name__}:{CoverageEnv.__name__}",
    vector_entry_point=f"{__name__}:{CoverageVectorEnv.__name__}",
)
