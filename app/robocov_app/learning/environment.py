"""Base class of learning environments, which starts random episodes and renders them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np

from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError, StartError, describe_unknown_name, quote
from robocov.scenario import Scenario
from robocov.typing import FloatArray
from robocov_app.learning.episode import Episode, SharedRun
from robocov_app.learning.maps import SEED_LIMIT, MapSampler, build_map
from robocov_app.learning.task import CoverageTask, change_task

if TYPE_CHECKING:
    from robocov_app.render.painter import Painter
    from robocov_app.render.scene import Scene
    from robocov_app.runs.encoding import Frame

RENDER_MODES = ("rgb_array", "human")
"""Render modes of gymnasium: images as arrays, and a window."""
THEMES = ("light", "dark")
MIN_SIDE_PX = 64
MAX_SIDE_PX = 8192
_FRAME_RATE = 10
"""Frames per second of a video of the default task, with one frame for each action."""


def draw_episode(
    task: CoverageTask,
    sampler: MapSampler,
    rng: np.random.Generator,
    options: Mapping[str, Any] | None = None,
    shared_run: SharedRun | None = None,
) -> Episode:
    """Draw a random episode.

    Parameters
    ----------
    task : CoverageTask
    sampler : MapSampler
        Maps of the task.
    rng : numpy.random.Generator
    options : Mapping, optional
        Values to use instead of random ones. ``map``: a map, or its name or path. ``start``: name of a start
        of the map. ``start_seed``: seed of the positions, as in `robocov run`. ``positions``: the positions
        themselves, (n, 2) m. ``conditions_seed``: seed of the task's conditions.
    shared_run : SharedRun, optional
        Position in a simulation that is shared with other episodes on the same map.

    Returns
    -------
    Episode

    Raises
    ------
    StartError
        If the positions are invalid, or the map has no start of the given name.
    InputError
        If a map cannot be read.

    See Also
    --------
    EpisodeEnv : Base class of environments that run episodes.
    """
    options = options or {}
    environment = sampler.draw(rng)
    if "map" in options:
        # The given map replaces the one that was drawn. Its seed is a further random number.
        environment = build_map(options["map"], int(rng.integers(SEED_LIMIT)))
    random_values = _RandomValues.draw(rng, environment)
    scenario = _build_scenario(task, environment, random_values, options)
    return Episode(task, scenario, sampler.get_cost(environment), shared_run)


def _build_scenario(
    task: CoverageTask, environment: Environment, random_values: _RandomValues, options: Mapping[str, Any]
) -> Scenario:
    """Build the scenario of an episode, which begins at given positions or at a start of the map."""
    conditions = task.conditions
    if conditions is not None:
        conditions_seed = options.get("conditions_seed", random_values.conditions_seed)
        conditions = replace(conditions, seed=conditions_seed)
    name = options.get("start", task.start)
    if name == "*":
        name = random_values.start
    # Look the start up even if positions are given, so that an unknown name is an error.
    start = environment.start(name)
    if "positions" in options:
        return Scenario(
            environment,
            team=task.whole_team,
            starts=_parse_positions(options["positions"]),
            seed=None,
            duration=task.duration,
            dt=task.dt,
            conditions=conditions,
        )
    return Scenario(
        environment,
        team=task.whole_team,
        start=start.name,
        seed=options.get("start_seed", random_values.start_seed),
        duration=task.duration,
        dt=task.dt,
        conditions=conditions,
    )


class _RandomValues(NamedTuple):
    """Random values of an episode.

    Attributes
    ----------
    start : str
        Name of a start of the map.
    start_seed : int
        Seed of the positions.
    conditions_seed : int
        Seed of the conditions.
    """

    start: str
    start_seed: int
    conditions_seed: int

    @classmethod
    def draw(cls, rng: np.random.Generator, environment: Environment) -> Self:
        """Draw all values, even those that options replace, so that the others do not change."""
        start_names = list(environment.starts) or ["uniform"]
        start = start_names[int(rng.integers(len(start_names)))]
        start_seed = int(rng.integers(SEED_LIMIT))
        conditions_seed = int(rng.integers(SEED_LIMIT))
        return cls(start, start_seed, conditions_seed)


def _parse_positions(positions: Any) -> FloatArray:
    """Convert positions to an array; raise StartError if that is impossible."""
    try:
        return np.asarray(positions, dtype=float)
    except (TypeError, ValueError):
        raise StartError(f"positions: expected an array of shape (n, 2), got {quote(positions)}") from None


class EpisodeEnv:
    """Base class of learning environments.

    Parameters
    ----------
    task : CoverageTask, optional
        By default, a task with default values.
    render_mode : str, optional
        "rgb_array", or "human", which opens a window and needs a display.
    size : (int, int)
        Width and height of the rendered images, px.
    theme : str
        "light" or "dark".
    sampler : MapSampler, optional
        Maps of the task. Several environments may share one.
    **changes
        Attributes of the task to change.

    Attributes
    ----------
    episode : Episode or None
        The current episode; None before the first one.

    Raises
    ------
    ParameterError
        If a value is out of range.
    InputError
        If a map cannot be read.

    See Also
    --------
    CoverageEnv : Environment with one agent for all robots, for gymnasium.
    CoverageParallelEnv : Environment with one agent per robot, for PettingZoo.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": list(RENDER_MODES), "render_fps": _FRAME_RATE}

    def __init__(
        self,
        task: CoverageTask | None = None,
        *,
        render_mode: str | None = None,
        size: tuple[int, int] = (640, 480),
        theme: str = "light",
        sampler: MapSampler | None = None,
        **changes: Any,
    ) -> None:
        self.task = change_task(task, changes)
        _check_rendering(render_mode, size, theme)
        self.render_mode = render_mode
        self._theme = theme
        self._size = (int(size[0]), int(size[1]))
        if sampler is None:
            radius = self.task.whole_team.min_radius
            sampler = MapSampler(self.task.maps, self.task.lattice, radius)
        self._sampler = sampler
        self.episode: Episode | None = None
        self._painter: Painter | None = None
        self._window: Any = None
        self._clock: Any = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for pickling or copying, without the window and the painter."""
        return {**vars(self), "_painter": None, "_window": None, "_clock": None}

    def get_episode(self) -> Episode:
        """Return the current episode.

        Returns
        -------
        Episode

        Raises
        ------
        RobocovError
            Before the first episode.
        """
        if self.episode is None:
            raise RobocovError("environment: call reset() first")
        return self.episode

    def format_actions(self, actions: FloatArray) -> dict[str, FloatArray] | FloatArray:
        """Return the actions of all robots in the form that `step` expects.

        Parameters
        ----------
        actions : (n, 2) array, N or m/s

        Returns
        -------
        dict or (n, 2) array
            Actions by agent for a parallel environment; otherwise an array.
        """
        return actions

    def render(self) -> Frame | None:
        """Return an image, (height, width, 3) from 0 to 255, in the mode "rgb_array"; None in other modes."""
        episode = self.get_episode()
        if self.render_mode != "rgb_array":
            return None
        painter = self._get_painter(episode)
        return painter.render_frame(self._build_scene(episode)).copy()

    def close(self) -> None:
        """Close the window."""
        if self._window is not None:
            import pygame

            pygame.display.quit()
            self._window = None
            self._clock = None

    def _get_painter(self, episode: Episode) -> Painter:
        """Return the painter of an episode's map, which is reused as long as the map stays the same."""
        from robocov_app.look.theme import get_theme
        from robocov_app.render.painter import Painter

        if self._painter is None or self._painter.environment is not episode.environment:
            self._painter = Painter(episode.environment, self._size, get_theme(self._theme))
        return self._painter

    def _build_scene(self, episode: Episode) -> Scene:
        """Build the scene of the current state of an episode, with the trails of its robots."""
        from robocov_app.render.scene import Scene

        trail = np.array(episode.trail)
        return Scene.from_snapshot(
            episode.environment,
            episode.team,
            episode.take_snapshot(),
            starts=trail[0],
            trail=trail,
            trail_time=np.arange(float(len(trail))) * episode.task.period,
            label=f"action {episode.cycle} of {episode.task.cycles}",
            cost=f"mean distance {episode.coverage.mean_distance:.3f} m",
        )

    def _update_window(self) -> None:
        """Draw the current episode in the window in the mode "human"; do nothing in other modes."""
        if self.render_mode != "human":
            return
        import pygame

        if self._window is None:
            self._open_window()
        pygame.event.pump()
        episode = self.get_episode()
        self._get_painter(episode).draw(self._window, self._build_scene(episode))
        pygame.display.flip()
        self._clock.tick(1.0 / self.task.period)

    def _open_window(self) -> None:
        """Open the window; raise RobocovError if there is no display."""
        import pygame

        try:
            pygame.display.init()
            self._window = pygame.display.set_mode(self._size)
        except pygame.error as error:
            raise RobocovError(f"render_mode: 'human', but there is no display ({error})") from error
        pygame.display.set_caption("robocov")
        self._clock = pygame.time.Clock()


def _check_rendering(render_mode: str | None, size: tuple[int, int], theme: str) -> None:
    """Raise a ParameterError unless the options for rendering are valid."""
    if render_mode is not None and render_mode not in RENDER_MODES:
        raise ParameterError(f"render_mode: {describe_unknown_name('mode', str(render_mode), RENDER_MODES)}")
    if len(size) != 2 or not all(MIN_SIDE_PX <= side <= MAX_SIDE_PX for side in size):
        raise ParameterError(
            f"size: expected width and height from {MIN_SIDE_PX} to {MAX_SIDE_PX} pixels, got {size}"
        )
    if theme not in THEMES:
        raise ParameterError(f"theme: {describe_unknown_name('theme', str(theme), THEMES)}")
