"""One learner for the whole team: an environment of gymnasium, registered as ``robocov/Coverage-v0``.

Importing this module registers it; ``gymnasium.make("robocov_app.learning.gym:robocov/Coverage-v0")`` does
both. (gymnasium knows no entry points of packages any more.)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray

from robocov.errors import RobocovError
from robocov_app.learning.driving import action_limit
from robocov_app.learning.episode import Episode, drawn_episode
from robocov_app.learning.pictures import FRAMES_PER_SECOND, RENDER_MODES, Pictures
from robocov_app.learning.scenarios import Scenarios
from robocov_app.learning.task import CoverageTask, changed_task

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov_app.learning.layout import Rows
    from robocov_app.recording import Frame

ID = "robocov/Coverage-v0"


class CoverageEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """A team that one learner steers, who is told what all robots know: gymnasium's ``Env``.

    Observations are the robots' rows of the task's `ObservationLayout` below each other, (n, size) float32
    from -1 to 1; actions one row for each robot, (n, 2), forces in N or velocities in m/s, held for
    `CoverageTask.repeat` control periods. (`gymnasium.wrappers.RescaleAction` makes them -1 to 1,
    `gymnasium.wrappers.FlattenObservation` flattens the rows.) The reward is the mean of what
    `CoverageParallelEnv` gives each robot. The row of a robot that has failed, or not yet joined, is zero.

    An episode is truncated after `CoverageTask.duration`, and ends when no robot is left. The same seed and
    actions give the same episode, bit for bit.

    Parameters
    ----------
    task : CoverageTask or None
    render_mode : {"rgb_array", "human"} or None
        ``human`` opens a window; it needs a display.
    size : (width, height), px
        Of pictures.
    theme : {"light", "dark"}
    **changes
        Of the task, as in ``gymnasium.make(..., maps="museum", robots=4)``.

    Attributes
    ----------
    task : CoverageTask
    episode : Episode
        The present one; None before the first ``reset``.

    Raises
    ------
    InputError
        When the task makes no sense or a map cannot be read.
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "render_modes": list(RENDER_MODES),
        "render_fps": FRAMES_PER_SECOND,
    }

    def __init__(
        self,
        task: CoverageTask | None = None,
        *,
        render_mode: str | None = None,
        size: tuple[int, int] = (640, 480),
        theme: str = "light",
        **changes: Any,
    ) -> None:
        self.task = changed_task(task, changes)
        self.render_mode = render_mode
        self._pictures = Pictures(render_mode, size, theme)
        self._scenarios = Scenarios(self.task.maps, self.task.lattice)
        self.episode: Episode | None = None
        n = self.task.robots
        low, high = (np.tile(row, (n, 1)) for row in self.task.observation.bounds)
        self.observation_space = Box(low, high, dtype=np.float32)
        limit = np.tile(action_limit(self.task.action, self.task.whole_team)[:, None], (1, 2))
        self.action_space = Box(-limit.astype(np.float32), limit.astype(np.float32), dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Rows, dict[str, Any]]:
        """Begin an episode.

        Parameters
        ----------
        seed : int or None
            Without one the random numbers go on.
        options : dict or None
            See `robocov_app.learning.episode.drawn_episode`.
        """
        super().reset(seed=seed)
        self.episode = drawn_episode(self.task, self._scenarios, self.np_random, options)
        self._pictures.shown(self.episode)
        info = self._info(np.zeros(self.task.robots))
        return self._rows(), {**info, "map": self.episode.environment.name}

    def step(self, action: Any) -> tuple[Rows, float, bool, bool, dict[str, Any]]:
        """Let the team act, and return observation, reward, termination, truncation and info.

        Raises
        ------
        ParameterError
            When the action is not finite numbers of shape (n, 2).
        """
        episode = self._present()
        over = episode.cycle + 1 >= self.task.cycles
        outcome = episode.advance(action, last=over)
        self._pictures.shown(episode)
        ended = not episode.working.any()
        return self._rows(), float(outcome.rewards.mean()), ended, over, self._info(outcome.contact)

    def render(self) -> Frame | None:
        """Return a picture, (height, width, 3) of 0 to 255, with ``rgb_array``; else None."""
        return self._pictures.frame(self._present())

    def close(self) -> None:
        """Close the window, if there is one."""
        self._pictures.close()

    def _present(self) -> Episode:
        if self.episode is None:
            raise RobocovError("environment: reset() was wanted before anything else")
        return self.episode

    def _rows(self) -> Rows:
        rows = self._present().observations()
        rows[~self._present().working] = 0.0
        return rows

    def _info(self, contact: Array) -> dict[str, Any]:
        episode = self._present()
        return {**episode.facts(), "contact_s": contact.copy(), "working": episode.working.copy()}


gymnasium.register(ID, f"{__name__}:{CoverageEnv.__name__}")
