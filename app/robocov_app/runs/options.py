"""Options that commands share: what goes wrong in a run, what films look like, and what a run is."""

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
from robocov.errors import ParameterError, require_number
from robocov_app.terminal.arguments import parsed_size, window_size

if TYPE_CHECKING:
    from collections.abc import Mapping

    from robocov.conditions import Conditions
    from robocov.environment import Environment
    from robocov.scenario import Scenario
    from robocov.team import Team
    from robocov_app.render.theme import Theme

USUAL_ROWS = 4e6  # largest record where its rate is left open: about 320 MB


@dataclass(kw_only=True)
class JsonOption:
    """Answers for programs."""

    json: bool = False
    """Print one JSON object and nothing else."""


@dataclass(kw_only=True)
class PlotOptions(JsonOption):
    """A picture of the answer."""

    plot: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Draw it to a PNG, SVG or PDF."""
    theme: Literal["light", "dark"] = "light"
    """Colours of the picture."""

    def __post_init__(self) -> None:
        if self.plot is not None:
            from robocov_app.figures.files import check_figure_path

            check_figure_path(self.plot)


@dataclass(kw_only=True)
class LayerOptions:
    """What pictures show."""

    show: tuple[str, ...] = ()
    """Layers to show besides the usual ones: distances, geodesic-cells, ..."""
    hide: tuple[str, ...] = ()
    """Layers not to show, as in --hide cells centroids."""

    def layers(self) -> tuple[frozenset[str], frozenset[str]]:
        """Return the layers that are shown besides the usual ones, and hidden; raises ParameterError."""
        from robocov_app.render.picture import checked_layers

        return checked_layers("--show", self.show), checked_layers("--hide", self.hide)


@dataclass(kw_only=True)
class WebOptions:
    """The window in a browser."""

    serve: bool = False
    """Show the window in browsers instead of on this screen: prints the link."""
    host: str = "127.0.0.1"
    """Address to listen at with --serve; 0.0.0.0 for all of this machine's, which is not encrypted."""
    port: int = 8765
    """Port to listen at with --serve; 0 for any that is free."""
    each: bool = False
    """With --serve: every visitor with the link gets a window of their own, a process each."""
    max_sessions: int = 8
    """Maximum number of concurrent windows (with --each)."""
    idle_minutes: float = 10.0
    """Minutes without a browser after which a window is ended; its work is kept as a draft (with --each)."""

    def __post_init__(self) -> None:
        require_number("--port", self.port, 0, 65535)
        require_number("--max-sessions", self.max_sessions, 1, 200)
        require_number("--idle-minutes", self.idle_minutes, 0.05, 10_000.0)
        if self.each and not self.serve:
            raise ParameterError("--each: requires --serve")


@dataclass(kw_only=True)
class WindowOptions(WebOptions):
    """How a window looks."""

    theme: Annotated[Literal["light", "dark"] | None, tyro.conf.arg(metavar="{light,dark}")] = None
    """Colours; by default those of the last time."""
    size: Annotated[str | None, tyro.conf.arg(metavar="WxH")] = None
    """Size of the window in pixels; by default that of the last time."""
    scale: float | None = None
    """Scale of text and lines, as 2 on a screen of twice the density; by default what suits the screen."""
    folder: Path = Path()
    """Where screenshots, films, runs and maps are saved that are not given a path."""

    def __post_init__(self) -> None:
        super().__post_init__()
        window_size(self.size)
        if self.scale is not None:
            require_number("--scale", self.scale, 0.5, 4.0)


@dataclass
class ConditionOptions:
    """What goes wrong, or changes, during the run; the same for every controller."""

    loss: float = 0.0
    """Probability with which a message between two robots is lost."""
    delay: float = 0.0
    """Seconds that a message is on its way."""
    message_rate: float | None = None
    """Messages per second with which each robot tells where it is; at every step by default."""
    forget_after: float = 3.0
    """Seconds of silence after which a robot is taken to be gone."""
    position_noise: float = 0.0
    """Standard deviation in metres of what a robot takes its own position to be, in x and in y."""
    sensing_noise: float = 0.0
    """Standard deviation in metres of what the range sensor measures."""
    failure_rate: float = 0.0
    """Failures per second of each robot; 0.01 is a mean life of 100 s."""
    fail: Annotated[tuple[str, ...], tyro.conf.arg(metavar="ROBOT@S ...")] = ()
    """Robots that fail, and when: --fail 3@20 5@40. They stand still then, as obstacles."""
    join: Annotated[tuple[str, ...], tyro.conf.arg(metavar="ROBOT@S[:X,Y] ...")] = ()
    """Robots that join late, and when and where: --join 6@30:2.5,1; else at their start."""

    def conditions(self, seed: int, robots: int) -> Conditions | None:
        """Return the conditions for a team, None where they are ideal; raises ParameterError."""
        if self == ConditionOptions():
            return None
        from robocov.conditions import PARAMETERS, Conditions, Failure, Join, parse_event

        events: dict[str, Any] = {}
        for option, kind, texts in (("fail", Failure, self.fail), ("join", Join, self.join)):
            try:
                events[option] = tuple(parse_event(kind, text) for text in texts)
            except ParameterError as error:
                raise ParameterError(f"--{option}: {error}") from None
        limits = {name: getattr(self, name) for name in PARAMETERS}
        conditions = Conditions(**limits, failures=events["fail"], joins=events["join"], seed=seed)
        conditions.check_team(robots)
        return None if conditions.is_ideal else conditions


@dataclass
class FilmOptions(LayerOptions):
    """Frames and films, and the look of pictures."""

    frames: bool = False
    """Save every film frame as a PNG."""
    video: bool = False
    """Save a film (H.264, MP4)."""
    fps: int = 30
    """Film frames per second."""
    film_speed: float = 4.0
    """Simulated seconds per second of film."""
    theme: Annotated[Literal["light", "dark"] | None, tyro.conf.arg(metavar="{light,dark}")] = None
    """Colours; by default light, in a window as the last time."""
    colours: Literal["paper", "robots"] = "paper"
    """Trajectories in the paper's red, or a colour for each robot; in films too."""
    size: Annotated[str | None, tyro.conf.arg(metavar="WxH")] = None
    """Size in pixels; by default 1280x720 for the film of a run, else what suits the map."""

    def __post_init__(self) -> None:
        require_number("--fps", self.fps, 1, 240)
        require_number("--film-speed", self.film_speed, 0.01, 1e4)
        self.picture_size()
        if self.video:  # rather than after the run
            from robocov_app.runs.encoding import encoder

            encoder()

    def picture_size(self) -> tuple[int, int] | None:
        return None if self.size is None else parsed_size("--size", self.size, (320, 240), (7680, 4320))

    def film_size(self) -> tuple[int, int]:
        return self.picture_size() or (1280, 720)

    @property
    def colour_theme(self) -> Theme:
        from robocov_app.render.theme import theme_named

        return theme_named(self.theme or "light")


@dataclass(kw_only=True)
class ScenarioOptions:
    """A map, a team at its start, and what goes wrong."""

    map: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[MAP]")] = "rooms"
    """Path to a map JSON, or the name of a bundled map (see `robocov maps`)."""
    robots: int = DEFAULT_ROBOTS
    """Number of robots."""
    start: str | None = None
    """Named start of the map; the map's first by default."""
    seed: int = 0
    """Seed of the starting positions; every controller gets the same."""
    dt: float = DEFAULT_DT_S
    """Control period in seconds."""
    radius: float = DEFAULT_RADIUS_M
    """Radius of a robot in metres."""
    team: Annotated[Path | None, tyro.conf.arg(metavar="TEAM.toml")] = None
    """TOML or JSON file of a mixed team: [[group]] with count, max_speed, ...; options give the rest."""
    lattice: int = DEFAULT_LATTICE
    """The coverage cost is evaluated on a lattice of N x N sites over the map."""
    conditions: tyro.conf.OmitArgPrefixes[ConditionOptions] = field(default_factory=ConditionOptions)


@dataclass(kw_only=True)
class RunOptions(ScenarioOptions, JsonOption):
    """What a run is made of, and what is made of it."""

    gains: Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="GAIN=VALUE ...")] = ()
    """Gains, as in --set k_rep=0.3 target=median attraction_limit=null (see `robocov controllers`)."""
    duration: float = DEFAULT_DURATION_S
    """Simulated seconds."""
    record_hz: float | None = None
    """Moments a second that the record keeps, about; by default all, of large teams what makes 320 MB."""
    max_speed: float = DEFAULT_MAX_SPEED_M_S
    """Largest speed in m/s."""
    max_acceleration: float = DEFAULT_MAX_ACCELERATION_M_S2
    """Largest acceleration in m/s²."""
    viscosity: float = DEFAULT_VISCOSITY_N_S_M
    """Viscosity nu of (28) in N s/m; a robot has 1 kg."""
    sensing_range: float = DEFAULT_SENSING_RANGE_M
    """How far the range sensor reaches, in metres from the robot's centre."""
    communication_range: float | None = None
    """How far robots hear each other, in metres; without limit by default."""
    kinematics: Literal["point", "unicycle"] = "point"
    """What robots can do: move in any direction, or drive on two wheels and turn (differential drive)."""
    track_width: float = DEFAULT_TRACK_WIDTH_M
    """Distance between a unicycle's wheels in metres; 1.6 radii where it is 0."""
    turning_rate: float = DEFAULT_TURNING_RATE_RAD_S
    """Largest turning rate of a unicycle in rad/s."""
    out: Path | None = None
    """Folder for the results."""
    overwrite: bool = False
    """Replace an earlier result in that folder."""
    no_pictures: bool = False
    """Save the numbers only, without trajectories and cost as pictures."""
    film: tyro.conf.OmitArgPrefixes[FilmOptions] = field(default_factory=FilmOptions)

    def __post_init__(self) -> None:
        if self.team is not None:
            self.robots = robots_of(self.made_team(), self.robots, RunOptions.robots, self.team)
        require_number("--robots", self.robots, 1, 10_000)
        require_number("--seed", self.seed, 0, 2**63 - 1)
        require_number("--duration", self.duration, 0.0, 1e6, "s")
        require_number("--lattice", self.lattice, 2, 2048)
        from robocov.scenario import MAX_RECORD_ROWS
        from robocov.simulation import check_dt  # asking for help must not load the physics

        check_dt(self.dt)
        if self.record_hz is not None:
            require_number("--record-hz", self.record_hz, 0.001, 1e4, "Hz")
        rows = self.duration / self.dt * self.robots / self.record_every
        if rows > MAX_RECORD_ROWS:
            size = f"{self.duration:g} s of {self.robots} robots are {rows:.3g} rows of the record"
            wanted = f"expected at most {MAX_RECORD_ROWS:.0e}"
            raise ParameterError(f"--record-hz: {wanted}, got {self.record_hz:g} Hz for {size}")

    @property
    def record_every(self) -> int:
        """Of so many steps the record keeps one."""
        if self.record_hz is None:
            return math.ceil(max(self.duration / self.dt * self.robots / USUAL_ROWS, 1.0))
        return max(round(1.0 / (self.record_hz * self.dt)), 1)

    @property
    def record_words(self) -> str:
        every = self.record_every
        return f"; the record, and what is counted in it, is of one step in {every}" if every > 1 else ""

    def made_team(self) -> Team:
        from robocov.team import PARAMETERS, Team
        from robocov.team_files import read_team

        said = {name: getattr(self, name) for name in PARAMETERS if name != "mass"}
        if self.communication_range is None:
            said["communication_range"] = math.inf
        if self.kinematics == "unicycle":
            said["kinematics"] = self.kinematics
        return Team.homogeneous(self.robots, **said) if self.team is None else read_team(self.team, said)

    def build_scenario(self, environment: Environment, controller: str, gains: Mapping[str, Any]) -> Scenario:
        """Return what is to be run; raises InputError when it cannot be."""
        from robocov.scenario import Scenario

        scenario = Scenario(
            environment,
            controller,
            gains,
            team=self.made_team(),
            start=self.start,
            seed=self.seed,
            duration=self.duration,
            dt=self.dt,
            conditions=self.conditions.conditions(self.seed, self.robots),
        )
        scenario.check()
        return scenario


def robots_of(team: Team, robots: int, default: int, path: Path) -> int:
    """Return how many robots a team file has; the option --robots may say the same, and nothing else."""
    if robots not in (default, len(team)):
        raise ParameterError(f"--robots: {robots}, but the team of {path} has {len(team)}")
    return len(team)
