"""Shared base of a task's environments: the present episode, and its pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.errors import ParameterError, RobocovError, unknown_name
from robocov_app.learning.episode import Episode
from robocov_app.learning.task import CoverageTask, Scenarios, changed_task

if TYPE_CHECKING:
    from robocov_app.render.picture import Painter
    from robocov_app.runs.recording import Frame

RENDER_MODES = ("rgb_array", "human")

# of films of the usual task, one picture for each action
METADATA = {"render_modes": list(RENDER_MODES), "render_fps": 10}


class EpisodeEnv:
    """An environment with `changes` of a task, whose `episode` is drawn as runs are drawn everywhere.

    `render_mode` is ``rgb_array``, ``human``, which opens a window and needs a display, or None; `size` is
    width and height in pixels, `theme` light or dark. Several may share the `scenarios` of their task. Raises
    InputError when the task makes no sense or a map cannot be read.
    """

    def __init__(
        self,
        task: CoverageTask | None = None,
        *,
        render_mode: str | None = None,
        size: tuple[int, int] = (640, 480),
        theme: str = "light",
        scenarios: Scenarios | None = None,
        **changes: Any,
    ) -> None:
        self.task = changed_task(task, changes)
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise ParameterError(f"render_mode: {unknown_name('mode', str(render_mode), RENDER_MODES)}")
        if len(size) != 2 or not all(64 <= side <= 8192 for side in size):
            raise ParameterError(f"size: {size}, but width and height from 64 to 8192 pixels were wanted")
        if theme not in ("light", "dark"):
            raise ParameterError(f"theme: {unknown_name('theme', str(theme), ('light', 'dark'))}")
        self.render_mode, self._theme, self._size = render_mode, theme, (int(size[0]), int(size[1]))
        self._scenarios = Scenarios(self.task.maps, self.task.lattice) if scenarios is None else scenarios
        self.episode: Episode | None = None
        self._painter: Painter | None = None
        self._window: Any = None
        self._clock: Any = None

    def _present(self) -> Episode:
        if self.episode is None:
            raise RobocovError("environment: reset() was wanted before anything else")
        return self.episode

    def render(self) -> Frame | None:
        """Return a picture, (height, width, 3) of 0 to 255, with ``rgb_array``; else None."""
        episode = self._present()
        if self.render_mode != "rgb_array":
            return None
        painter, scene = self._drawn(episode)
        return painter.frame(scene).copy()

    def close(self) -> None:
        if self._window is not None:
            import pygame

            pygame.display.quit()
            self._window = self._clock = None

    def _drawn(self, episode: Episode) -> tuple[Painter, Any]:
        from robocov_app.render.picture import Painter
        from robocov_app.render.scene import Scene
        from robocov_app.render.theme import theme_named

        if self._painter is None or self._painter.environment is not episode.environment:
            self._painter = Painter(episode.environment, self._size, theme_named(self._theme))
        trail = np.array(episode.trail)
        scene = Scene.of(
            episode.environment,
            episode.team,
            episode.simulation.snapshot,
            starts=trail[0],
            trail=trail,
            trail_time=np.arange(float(len(trail))) * episode.task.period,
            label=f"action {episode.cycle} of {episode.task.cycles}",
            cost=f"mean distance {episode.result.mean_distance:.3f} m",
        )
        return self._painter, scene

    def _show(self) -> None:
        if self.render_mode != "human":
            return
        import pygame

        if self._window is None:
            try:
                pygame.display.init()
                self._window = pygame.display.set_mode(self._size)
            except pygame.error as error:
                raise RobocovError(f"render_mode: 'human', but there is no display ({error})") from error
            pygame.display.set_caption("robocov")
            self._clock = pygame.time.Clock()
        pygame.event.pump()
        painter, scene = self._drawn(self._present())
        painter.draw(self._window, scene)
        pygame.display.flip()
        self._clock.tick(1.0 / self.task.period)
