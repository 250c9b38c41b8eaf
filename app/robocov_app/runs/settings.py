"""Settings of the evaluation of runs, and of their figures and videos."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from robocov.defaults import DEFAULT_LATTICE

if TYPE_CHECKING:
    from robocov_app.look.hues import ColorScheme
    from robocov_app.look.theme import Theme

DEFAULT_VIDEO_SIZE_PX = (1280, 720)
"""Default width and height of the video of a single run."""
MIN_LATTICE = 2
"""Minimum lattice size."""
MAX_LATTICE = 2048
"""Maximum lattice size that options and study files accept. The library accepts larger ones."""


@dataclass(frozen=True)
class VideoSettings:
    """Settings of frames and videos, and of the look of figures.

    Attributes
    ----------
    frames, video : bool
        Whether to save frames as PNG files, and whether to save a video.
    fps : float
        Frames per second of the video.
    speed : float
        Simulated seconds per second of the video.
    theme : str
        Name of the color theme, ``light`` or ``dark``.
    colors : {"robots", "paper"}
        Trajectories in a color for each robot, or in the paper's red.
    size : (width, height) or None, px
        Size of frames and figures. By default, one that suits the content.
    shown_layers, hidden_layers : frozenset of str
        Layers to show in addition to the standard ones, and standard layers to hide.
    """

    frames: bool = False
    video: bool = False
    fps: float = 30
    speed: float = 4.0
    theme: str = "light"
    colors: ColorScheme = "robots"
    size: tuple[int, int] | None = None
    shown_layers: frozenset[str] = frozenset()
    hidden_layers: frozenset[str] = frozenset()

    @property
    def has_output(self) -> bool:
        """Whether frames or a video are to be saved."""
        return self.frames or self.video

    @property
    def video_size(self) -> tuple[int, int]:
        """Size of the video of a single run, px."""
        return self.size or DEFAULT_VIDEO_SIZE_PX

    @property
    def color_theme(self) -> Theme:
        """The color theme.

        Raises
        ------
        ParameterError
            If no theme has this name.
        """
        from robocov_app.look.theme import get_theme

        return get_theme(self.theme)


@dataclass(frozen=True)
class OutputSettings:
    """Settings of the evaluation of runs and of their files.

    Attributes
    ----------
    lattice : int
        Number of sites along each side of the map on which the coverage cost is computed.
    record_every : int
        Number of steps from one recorded step to the next.
    overwrite : bool
        Whether to replace an earlier result in the folder.
    figures : bool
        Whether to save figures.
    hide_progress : bool
        Whether to hide progress, because a program reads the output.
    video : VideoSettings
        Settings of frames and videos, and of the look of figures.
    """

    lattice: int = DEFAULT_LATTICE
    record_every: int = 1
    overwrite: bool = False
    figures: bool = True
    hide_progress: bool = False
    video: VideoSettings = field(default_factory=VideoSettings)
