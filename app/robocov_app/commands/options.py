"""Options that several commands share."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from robocov.defaults import (
    DEFAULT_DT_S,
    DEFAULT_DURATION_S,
    DEFAULT_LATTICE,
    DEFAULT_MAX_ACCELERATION_M_S2,
    DEFAULT_MAX_SPEED_M_S,
    DEFAULT_RADIUS_M,
    DEFAULT_ROBOTS,
    DEFAULT_SENSING_RANGE_M,
    DEFAULT_TRACK_WIDTH_M,
    DEFAULT_TURNING_RATE_RAD_S,
    DEFAULT_VISCOSITY_N_S_M,
)
from robocov.errors import MAX_SEED, ParameterError, require_number
from robocov.files.paths import describe_path
from robocov_app.runs.settings import MAX_LATTICE, MIN_LATTICE
from robocov_app.terminal.arguments import parse_size, parse_window_size

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov.conditions import Conditions
    from robocov.environment import Environment
    from robocov.scenario import Scenario
    from robocov.team import Team
    from robocov_app.runs.settings import OutputSettings, VideoSettings

MAX_DEFAULT_RECORD_ROWS = 4e6
"""Maximum number of recorded steps times robots, about 320 MB, unless ``--record-hz`` is given."""
_MIN_FIGURE_SIZE_PX = (320, 240)
"""Minimum width and height of figures and videos."""
_MAX_FIGURE_SIZE_PX = (7680, 4320)
"""Maximum width and height of figures and videos."""


@dataclass(kw_only=True)
class JsonOption:
    """Output for programs."""

    json: bool = False
    """Print one JSON object and nothing else."""


@dataclass(kw_only=True)
class FigureOptions(JsonOption):
    """A figure of the answer."""

    plot: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """File for a figure (.png, .svg or .pdf)."""
    theme: Literal["light", "dark"] = "light"
    """Colors of the figure."""

    def __post_init__(self) -> None:
        if self.plot is not None:
            from robocov_app.figures.files import check_figure_path

            check_figure_path(self.plot)


@dataclass(kw_only=True)
class LayerOptions:
    """Layers of frames and windows."""

    show: Annotated[tuple[str, ...], tyro.conf.arg(metavar="LAYER ...")] = ()
    """Layers to show in addition to the standard ones: distances, geodesic-cells, ..."""
    hide: Annotated[tuple[str, ...], tyro.conf.arg(metavar="LAYER ...")] = ()
    """Layers to hide, as in --hide cells centroids."""

    def read_layers(self) -> tuple[frozenset[str], frozenset[str]]:
        """Return the layers to show in addition to the standard ones, and the layers to hide.

        Raises
        ------
        ParameterError
            If a layer is unknown.
        """
        from robocov_app.render.layer_catalog import check_layer_names

        return check_layer_names("--show", self.show), check_layer_names("--hide", self.hide)


@dataclass(kw_only=True)
class WebOptions:
    """The window in a browser."""

    serve: bool = False
    """Show the window in browsers instead of on this screen; prints the links."""
    host: str = "127.0.0.1"
    """Address to listen on with --serve; 0.0.0.0 for all addresses of this machine (not encrypted)."""
    port: int = 8765
    """Port to listen on with --serve; 0 for any free port."""
    each: bool = False
    """With --serve: give every visitor with the link a window of their own, in its own process."""
    max_sessions: int = 8
    """Maximum number of concurrent windows (with --each)."""
    idle_minutes: float = 10.0
    """Minutes without a browser after which a window is closed and kept as a draft (with --each)."""

    def __post_init__(self) -> None:
        require_number("--port", self.port, 0, 65535)
        require_number("--max-sessions", self.max_sessions, 1, 200)
        require_number("--idle-minutes", self.idle_minutes, 0.05, 10_000.0)
        if self.each and not self.serve:
            raise ParameterError("--each: requires --serve")


@dataclass(kw_only=True)
class WindowOptions(WebOptions):
    """The look of a window."""

    theme: Annotated[Literal["light", "dark"] | None, tyro.conf.arg(metavar="{light,dark}")] = None
    """Colors (default: those of the last window)."""
    size: Annotated[str | None, tyro.conf.arg(metavar="WxH")] = None
    """Size of the window in pixels (default: that of the last window)."""
    scale: float | None = None
    """Scale of text and lines, such as 2 for a high-density screen (default: fitted to the screen)."""
    folder: Path = Path()
    """Default folder of screenshots, videos, runs and maps; only --serve creates it."""

    def __post_init__(self) -> None:
        super().__post_init__()
        parse_window_size(self.size)
        if not self.serve and not self.folder.is_dir():
            actual = describe_path(self.folder)
            raise ParameterError(f"--folder: {self.folder}: expected an existing folder, got {actual}")
        if self.scale is not None:
            require_number("--scale", self.scale, 0.5, 4.0)


@dataclass
class ConditionOptions:
    """Noise, message loss, failures and late robots; the same for every controller."""

    loss: float = 0.0
    """Probability that a message between two robots is lost."""
    delay: float = 0.0
    """Message latency, s."""
    message_rate: float | None = None
    """Times per second that each robot sends its position and messages; by default in every step."""
    bandwidth: float | None = None
    """Bytes per second that each robot can send; by default unlimited."""
    forget_after: float = 3.0
    """Time without messages after which a robot is forgotten, s."""
    position_noise: float = 0.0
    """Standard deviation of the localization noise, in x and in y, m."""
    sensing_noise: float = 0.0
    """Standard deviation of the noise of the range sensor, m."""
    failure_rate: float = 0.0
    """Failures per second of each robot; 0.01 means a mean lifetime of 100 s."""
    fail: Annotated[tuple[str, ...], tyro.conf.arg(metavar="ROBOT@S ...")] = ()
    """Robots that fail, with their times: --fail 3@20 5@40. They stop, and become obstacles."""
    join: Annotated[tuple[str, ...], tyro.conf.arg(metavar="ROBOT@S[:X,Y] ...")] = ()
    """Robots that join late, with their times and, optionally, positions: --join 6@30:2.5,1."""
    density: Literal["known", "sensed"] = "known"
    """Whether robots know the density, or can only measure it within their sensing range."""

    def build_conditions(self, seed: int, robots: int) -> Conditions | None:
        """Build the conditions for a team.

        Parameters
        ----------
        seed : int
            Seed of all random disturbances.
        robots : int
            Number of robots.

        Returns
        -------
        Conditions or None
            None if the conditions are ideal.

        Raises
        ------
        ParameterError
            If an option is invalid.
        """
        if self == ConditionOptions():
            return None
        from robocov.conditions import PARAMETERS, Conditions, Failure, Join

        values = {name: getattr(self, name) for name in PARAMETERS}
        conditions = Conditions(
            **values,
            failures=_parse_events("--fail", Failure, self.fail),
            joins=_parse_events("--join", Join, self.join),
            density=self.density,
            seed=seed,
        )
        conditions.check_team(robots)
        return None if conditions.is_ideal else conditions


def _parse_events(option: str, kind: Any, texts: tuple[str, ...]) -> tuple[Any, ...]:
    """Parse the events of an option, such as ``3@20``."""
    from robocov.conditions import parse_event

    try:
        return tuple(parse_event(kind, text) for text in texts)
    except ParameterError as error:
        raise ParameterError(f"{option}: {error}") from None


@dataclass
class VideoOptions(LayerOptions):
    """Frames and videos, and the look of figures."""

    frames: bool = False
    """Save every video frame as a PNG."""
    video: bool = False
    """Save a video (H.264, MP4)."""
    fps: int = 30
    """Video frames per second."""
    video_speed: float = 4.0
    """Simulated seconds per second of video."""
    theme: Annotated[Literal["light", "dark"] | None, tyro.conf.arg(metavar="{light,dark}")] = None
    """Colors (default: light; in a window, those of the last window)."""
    colors: Literal["robots", "paper"] = "robots"
    """Colors of trajectories, also in videos: one color per robot, or the paper's red."""
    size: Annotated[str | None, tyro.conf.arg(metavar="WxH")] = None
    """Size in pixels (default: 1280x720 for the video of a run, otherwise fitted to the map)."""

    def __post_init__(self) -> None:
        require_number("--fps", self.fps, 1, 240)
        require_number("--video-speed", self.video_speed, 0.01, 1e4)
        self.parse_size()
        if self.video:
            # If there is no encoder, fail now rather than after the run.
            from robocov_app.runs.encoding import find_encoder

            find_encoder()

    def parse_size(self) -> tuple[int, int] | None:
        """Return the width and height in pixels; None if ``--size`` is not given.

        Raises
        ------
        ParameterError
            If the option is not a size, or the size is out of range.
        """
        if self.size is None:
            return None
        return parse_size("--size", self.size, _MIN_FIGURE_SIZE_PX, _MAX_FIGURE_SIZE_PX)

    def build_settings(self) -> VideoSettings:
        """Build the settings for frames, videos and figures.

        Returns
        -------
        VideoSettings

        Raises
        ------
        ParameterError
            If an option is invalid.
        """
        from robocov_app.runs.settings import VideoSettings

        shown_layers, hidden_layers = self.read_layers()
        return VideoSettings(
            frames=self.frames,
            video=self.video,
            fps=self.fps,
            speed=self.video_speed,
            theme=self.theme or "light",
            colors=self.colors,
            size=self.parse_size(),
            shown_layers=shown_layers,
            hidden_layers=hidden_layers,
        )


@dataclass(kw_only=True)
class ScenarioOptions:
    """A map, a team at its start, and conditions."""

    map: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[MAP]")] = "rooms"
    """Path of a map file, or the name of a bundled map (see `robocov maps`)."""
    robots: int = DEFAULT_ROBOTS
    """Number of robots."""
    start: str | None = None
    """Name of a start of the map; by default the first one."""
    seed: int = 0
    """Seed of the starting positions, the same for every controller."""
    dt: float = DEFAULT_DT_S
    """Control period, s."""
    radius: float = DEFAULT_RADIUS_M
    """Radius of a robot, m."""
    team: Annotated[Path | None, tyro.conf.arg(metavar="TEAM.toml")] = None
    """TOML or JSON file of a mixed team; options apply if a group sets no value."""
    lattice: int = DEFAULT_LATTICE
    """Compute the coverage cost on a lattice of N x N sites over the map."""
    condition: tyro.conf.OmitArgPrefixes[ConditionOptions] = field(default_factory=ConditionOptions)


@dataclass(kw_only=True)
class RunOptions(ScenarioOptions, JsonOption):
    """A run and its results."""

    gains: Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="GAIN=VALUE ...")] = ()
    """Gains, as in --set k_rep=0.3 target=median attraction_limit=null (see `robocov controllers`)."""
    duration: float = DEFAULT_DURATION_S
    """Simulated time, s."""
    record_hz: float | None = None
    """Approximate number of recorded samples per second (default: every step, up to 320 MB)."""
    max_speed: float = DEFAULT_MAX_SPEED_M_S
    """Maximum speed, m/s."""
    max_acceleration: float = DEFAULT_MAX_ACCELERATION_M_S2
    """Maximum acceleration, m/s²."""
    viscosity: float = DEFAULT_VISCOSITY_N_S_M
    """Viscosity nu in m q'' = F - nu q', N s/m, with m = 1 kg."""
    sensing_range: float = DEFAULT_SENSING_RANGE_M
    """Sensing range from the robot's center, m."""
    communication_range: float | None = None
    """Communication range, m; unlimited by default."""
    kinematics: Literal["point", "unicycle"] = "point"
    """Points move in any direction; unicycles have two driven wheels and must turn."""
    track_width: float = DEFAULT_TRACK_WIDTH_M
    """Distance between the wheels of a unicycle, m; 0 means 1.6 times the radius."""
    turning_rate: float = DEFAULT_TURNING_RATE_RAD_S
    """Maximum turning rate of a unicycle, rad/s."""
    out: Path | None = None
    """Folder for the results (default: MAP-CONTROLLER)."""
    overwrite: bool = False
    """Replace an earlier result in that folder."""
    no_figures: bool = False
    """Write no figures, only data."""
    video: tyro.conf.OmitArgPrefixes[VideoOptions] = field(default_factory=VideoOptions)

    def __post_init__(self) -> None:
        if self.team is not None:
            self.robots = get_robot_count(self.build_team(), self.robots, RunOptions.robots, self.team)
        require_number("--robots", self.robots, 1, 10_000)
        require_number("--seed", self.seed, 0, MAX_SEED)
        require_number("--duration", self.duration, 0.0, 1e6, "s")
        require_number("--lattice", self.lattice, MIN_LATTICE, MAX_LATTICE)
        self._check_record_size()

    def _check_record_size(self) -> None:
        """Raise a ParameterError if the record would be too large."""
        # Imported here, because printing the help must not load the physics.
        from robocov.scenario import MAX_RECORD_ROWS
        from robocov.simulation import check_dt

        check_dt(self.dt)
        if self.record_hz is not None:
            require_number("--record-hz", self.record_hz, 0.001, 1e4, "Hz")
        rows = self.duration / self.dt * self.robots / self.record_every
        if rows > MAX_RECORD_ROWS:
            raise ParameterError(
                f"--record-hz: expected at most {MAX_RECORD_ROWS:.0e} rows of the record, got {rows:.3g} "
                f"({self.record_hz:g} Hz, {self.duration:g} s, {self.robots} robots)"
            )

    @property
    def record_every(self) -> int:
        """Number of steps from one recorded step to the next; 1 if all steps are recorded."""
        if self.record_hz is None:
            rows = self.duration / self.dt * self.robots
            return math.ceil(max(rows / MAX_DEFAULT_RECORD_ROWS, 1.0))
        return max(round(1.0 / (self.record_hz * self.dt)), 1)

    def describe_record(self) -> str:
        """Return a remark about steps that are not recorded; empty if all steps are recorded."""
        every = self.record_every
        if every == 1:
            return ""
        return f"; the record has one step in {every}, and its numbers are computed from these"

    def describe_interrupted_video(self) -> str:
        """Return the start of the message about complete runs whose frames or video were interrupted."""
        if self.video.video:
            return "The video is incomplete. Results are in"
        return "The frames are incomplete. Results are in"

    def build_team(self) -> Team:
        """Build the team from the options and, if there is one, the team file.

        Returns
        -------
        Team

        Raises
        ------
        ParameterError
            If an option is out of range.
        InputError
            If the team file is invalid.
        """
        from robocov.team import PARAMETERS, Team
        from robocov.team_files import read_team

        # There is no option for the mass, which is always 1 kg.
        properties: dict[str, Any] = {name: getattr(self, name) for name in PARAMETERS if name != "mass"}
        if self.communication_range is None:
            properties["communication_range"] = math.inf
        if self.kinematics == "unicycle":
            properties["kinematics"] = self.kinematics
        if self.team is not None:
            return read_team(self.team, properties)
        return Team.homogeneous(self.robots, **properties)

    def build_scenario(self, environment: Environment, controller: str, gains: Mapping[str, Any]) -> Scenario:
        """Build the scenario of the run, and check that it can start.

        Parameters
        ----------
        environment : Environment
            The map.
        controller : str
            Name of the controller, or ``file.py:Class``.
        gains : mapping
            Gains that differ from their defaults.

        Returns
        -------
        Scenario

        Raises
        ------
        InputError
            If the scenario cannot start.
        """
        from robocov.scenario import Scenario

        scenario = Scenario(
            environment,
            controller,
            gains,
            team=self.build_team(),
            start=self.start,
            seed=self.seed,
            duration=self.duration,
            dt=self.dt,
            conditions=self.condition.build_conditions(self.seed, self.robots),
        )
        scenario.check()
        return scenario

    def build_output_settings(self) -> OutputSettings:
        """Build the settings for the evaluation and for the output files.

        Returns
        -------
        OutputSettings

        Raises
        ------
        ParameterError
            If an option is invalid.
        """
        from robocov_app.runs.settings import OutputSettings

        return OutputSettings(
            lattice=self.lattice,
            record_every=self.record_every,
            overwrite=self.overwrite,
            figures=not self.no_figures,
            hide_progress=self.json,
            video=self.video.build_settings(),
        )


def get_robot_count(team: Team, robots: int, default: int, path: Path) -> int:
    """Return the number of robots in a team file, and check that ``--robots`` does not contradict it.

    Parameters
    ----------
    team : Team
        The team in the file.
    robots : int
        Value of the option ``--robots``.
    default : int
        Its default, which cannot be told apart from the same number typed by the user.
    path : Path
        The file.

    Returns
    -------
    int

    Raises
    ------
    ParameterError
        If `robots` is neither the default nor the number in the file.
    """
    if robots not in (default, len(team)):
        raise ParameterError(f"--robots: expected {len(team)} as in {path}, got {robots}")
    return len(team)
