"""`robocov demo`: the interactive window."""

from __future__ import annotations

import math
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from robocov.errors import MAX_SEED, ParameterError, StartError, require_number
from robocov_app.commands.options import LayerOptions, ScenarioOptions, WindowOptions, get_robot_count
from robocov_app.runs.settings import MIN_LATTICE
from robocov_app.terminal.arguments import parse_gains, parse_window_size
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import echo
from robocov_app.terminal.progress import show_progress

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from robocov_app.runs.encoding import Frame
    from robocov_app.viewer.launch import ViewerLauncher
    from robocov_app.viewer.session.session import Session
    from robocov_app.viewer.session.setup.scenario import SessionScenario
    from robocov_app.viewer.start.cards import StartChoice
    from robocov_app.viewer.start.launch import StartLauncher
    from robocov_app.viewer.window.window import ViewerWindow

DEFAULT_MAP = "rooms"
"""Map of the window if an option is given, but no map."""
_MAX_CONTROLLERS = 4
"""Maximum number of controllers side by side."""
_MAX_WINDOW_LATTICE = 1024
"""Maximum lattice size in the window, which evaluates the cost several times per second."""


@dataclass
class Arguments(ScenarioOptions, WindowOptions, LayerOptions):
    """Open the interactive window: watch a team cover a map, edit it, compare controllers, go back in time.

    Without a map and options, a start page shows examples, all bundled maps and recent sessions. All commands
    have keys: press F1. The settings of the window are remembered.

    Example: robocov demo museum --controllers rapf rpf lloyd --robots 8
    """

    map: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[MAP]")] = ""
    """Path of a map or session file, or the name of a bundled map (default with other options: rooms)."""
    controllers: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = ("rapf",)
    """Up to four controllers side by side: names, or mine.py:MyController."""
    gains: Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="GAIN=VALUE ...")] = ()
    """Gains, as in --set k_rep=0.3 for all controllers or rapf.k_rep=0.3 for one of them."""
    speed: float = 1.0
    """Initial playback speed, simulated seconds per second."""
    paused: bool = False
    """Start paused."""
    tour: bool = False
    """Play the bundled lesson, in eleven short chapters."""
    lesson: Path | None = None
    """Play a lesson of your own; see `robocov lesson`."""
    frames: int | None = None
    """Number of frames to render without a display, 30 per second; requires --out or --video."""
    out: Path | None = None
    """Folder for the frames of --frames: 000000.png, 000001.png, ..."""
    video: Path | None = None
    """MP4 file to render without a display; with --tour or --lesson, the whole lesson."""

    def __post_init__(self) -> None:
        """Check that the options are in range and do not contradict each other."""
        super().__post_init__()
        require_number("--robots", self.robots, 1, 1000)
        require_number("--seed", self.seed, 0, MAX_SEED)
        require_number("--lattice", self.lattice, MIN_LATTICE, _MAX_WINDOW_LATTICE)
        require_number("--speed", self.speed, 0.01, 1000.0)
        if self.frames is not None:
            require_number("--frames", self.frames, 1, 1_000_000)
        if not 1 <= len(self.controllers) <= _MAX_CONTROLLERS:
            raise ParameterError(f"--controllers: expected 1 to 4, got {len(self.controllers)}")
        self._check_headless_options()

    def _check_headless_options(self) -> None:
        """Raise a ParameterError if options for frames and videos contradict each other."""
        if self.out is not None and self.frames is None:
            raise ParameterError("--out: nothing to write; requires --frames N")
        if self.frames is not None and self.out is None and self.video is None:
            raise ParameterError("--frames: requires --out DIR or --video FILE")
        if self.serve and self.is_headless:
            raise ParameterError("--serve: cannot be combined with --frames or --video")
        if self.video is None:
            return
        if self.frames is None and not self.tour and self.lesson is None:
            raise ParameterError("--video: requires --frames N, --tour or --lesson FILE")
        if self.video.suffix.lower() != ".mp4":
            raise ParameterError(f"--video: expected a name ending in .mp4, got {str(self.video)!r}")

    @property
    def shows_start_page(self) -> bool:
        """Whether there are no options other than the look of the window."""
        look = Arguments(theme=self.theme, size=self.size, scale=self.scale, folder=self.folder)
        return self == look

    @property
    def is_headless(self) -> bool:
        """Whether the window is rendered without a display."""
        return self.frames is not None or self.video is not None


def command(options: Arguments) -> int:
    """Run `robocov demo`, and return its exit status."""
    from robocov_app.toolkit.window.termination import ending_on_signals
    from robocov_app.web import prepare, serve_each

    prepare(options, options.folder)
    if options.each:
        return serve_each(command, options)
    if options.is_headless:
        return _render(_build_launcher(options), options)
    with ExitStack() as stack:
        stack.enter_context(ending_on_signals())
        if options.shows_start_page:
            return _open_start_page(options)
        from robocov.kernel_compilation import compile_in_background

        stack.enter_context(compile_in_background())
        return _open_window(_build_launcher(options), options)


def _open_start_page(options: Arguments) -> int:
    """Show the start page and open the user's choice; return the exit status."""
    from robocov.errors import RobocovError
    from robocov_app.viewer.start.launch import StartLauncher

    launcher = StartLauncher(options.theme, parse_window_size(options.size), options.scale, options.folder)
    message = ""
    with launcher as start:
        while (choice := start.choose(message)) is not None:
            try:
                return _open_choice(start, choice, options)
            except RobocovError as error:
                message = str(error)
    return 0


def _open_choice(start: StartLauncher, choice: StartChoice, options: Arguments) -> int:
    """Open the window for a choice on the start page, and return the exit status.

    Raises
    ------
    RobocovError
        If it cannot be opened.
    """
    from robocov_app.viewer.start.cards import Target

    width, height = start.size
    if choice.target is Target.EDITOR:
        from robocov_app.commands import edit

        theme = start.theme if start.has_new_theme else options.theme
        edit.open_editor(
            edit.Arguments(theme=theme, size=f"{width}x{height}", scale=options.scale, folder=options.folder)
        )
        return 0
    chosen = replace(options, size=f"{width}x{height}", **choice.options)
    launcher = _build_launcher(chosen)
    # The start page has offered both.
    launcher.offers_lesson = False
    launcher.offers_recovery = False
    with launcher.window() as window:
        if choice.draft is not None:
            window.viewer.files.attempt_recovery(choice.draft)
        if start.has_new_theme:
            window.viewer.view.theme = start.theme
        if choice.target is Target.LESSON:
            window.lesson.start()
        window.run()
    return 0


def _build_launcher(options: Arguments) -> ViewerLauncher:
    """Load the session from a file, or build it from the options, and build the launcher of its window."""
    from robocov.controllers import list_controller_classes
    from robocov_app.viewer.launch import ViewerLauncher
    from robocov_app.viewer.session.files.session_file import SUFFIX

    controllers = (*list_controller_classes(), *options.controllers)
    options = replace(options, map=options.map or DEFAULT_MAP)
    file: Path | None = None
    if options.map.endswith(SUFFIX):
        file = Path(options.map)
        session, map_name = _load_session(file, controllers, at_once=options.is_headless)
        if options.serve and not file.resolve().is_relative_to(options.folder.resolve()):
            # Visitors may only write to the folder, so the session is saved to a new file there.
            file = None
    else:
        session = build_session(options)
        map_name = options.map
    shown_layers, hidden_layers = options.read_layers()
    return ViewerLauncher(
        session,
        map_name,
        options.folder,
        theme=options.theme,
        size=parse_window_size(options.size),
        scale=options.scale,
        shown_layers=shown_layers,
        hidden_layers=hidden_layers,
        headless=options.is_headless,
        served=options.serve,
        controllers=controllers,
        lattice=options.lattice,
        file=file,
        offers_lesson=file is None and options.lesson is None and not options.tour,
    )


def _load_session(file: Path, controllers: tuple[str, ...], *, at_once: bool) -> tuple[Session, str]:
    """Load a session, and return it with the name of its map.

    With `at_once`, the whole session is recomputed now; otherwise, the window recomputes it after opening.
    """
    from robocov_app.viewer.session.files.session_file import load_session
    from robocov_app.viewer.session.session import Session

    saved = load_session(file, controllers)
    seconds = math.inf if at_once else 0.0
    return Session.open(saved, seconds), str(saved.view.get("map") or "")


def build_session(options: Arguments) -> Session:
    """Build the session that the options describe.

    Parameters
    ----------
    options : Arguments
        Options of the command.

    Returns
    -------
    Session

    Raises
    ------
    InputError
        If the map or the team file is invalid.
    """
    from robocov.mapfile import load_map
    from robocov.team_files import read_team
    from robocov_app.commands.gain_options import select_gains
    from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
    from robocov_app.viewer.session.setup.robot_properties import RobotProperties
    from robocov_app.viewer.session.setup.scenario import SessionScenario

    robots = options.robots
    properties = RobotProperties(radius=options.radius)
    if options.team is not None:
        team = read_team(options.team, {"radius": options.radius})
        robots = get_robot_count(team, robots, Arguments.robots, options.team)
        properties = RobotProperties.from_team(team)
    gains = select_gains(options.controllers, parse_gains(options.gains))
    choices = [
        ControllerChoice(name, own_gains) for name, own_gains in zip(options.controllers, gains, strict=True)
    ]
    conditions = options.condition.build_conditions(options.seed, robots)
    scenario = SessionScenario(
        load_map(options.map or DEFAULT_MAP),
        tuple(choices),
        robots,
        options.start,
        options.seed,
        properties=properties,
        dt=options.dt,
        conditions=conditions,
    )
    session = _start_session(scenario, can_change_start=options.start is None)
    session.playback.clock.speed = options.speed
    session.playback.is_playing = not options.paused
    return session


def _start_session(scenario: SessionScenario, *, can_change_start: bool) -> Session:
    """Start a session. With `can_change_start`, robots start uniformly if the start has too little space."""
    from robocov_app.viewer.session.session import Session

    try:
        return Session(scenario)
    except StartError:
        if not can_change_start:
            raise
    session = Session(replace(scenario, start="uniform"))
    problem = f"not enough space for {scenario.robots} robots at start '{scenario.start_name}'"
    echo(f"robocov: {problem}; using --start uniform", to_stderr=True)
    return session


def _open_window(launcher: ViewerLauncher, options: Arguments) -> int:
    """Show the window until it is closed, and return the exit status."""
    from robocov_app.web import show

    with launcher.window() as window:
        _start_lesson(window, options)
        show(window, options, options.folder)
    return 0


def _start_lesson(window: ViewerWindow, options: Arguments) -> None:
    """Start the lesson or the tour that the options select, if any."""
    if options.lesson is None and not options.tour:
        return
    # The class sees this session when the lesson has ended; it starts when the user plays it.
    window.viewer.session.playback.is_playing = False
    if options.lesson is not None:
        window.lesson.start(options.lesson)
    else:
        window.run_command("tour")


def _render(launcher: ViewerLauncher, options: Arguments) -> int:
    """Render the window to frames, a video or both, and return the exit status."""
    from robocov.files.result_folder import create_result
    from robocov.files.writing import resolve_target
    from robocov_app.runs.encoding import find_encoder, save_frames_and_video
    from robocov_app.viewer.launch import HEADLESS_FPS

    if options.video is not None:
        resolve_target(options.video)
        find_encoder()
    context = nullcontext() if options.out is None else create_result(options.out, overwrite=False)
    with context as result, launcher.window() as window, Interruption() as interruption:
        _start_lesson(window, options)
        count = options.frames
        if count is None:
            assert window.lesson.player is not None
            count = round(window.lesson.player.duration * HEADLESS_FPS)
        with show_progress("frames", count) as update:
            stops_at_end = options.frames is None
            frames = _draw_frames(window, count, interruption, update, stops_at_lesson_end=stops_at_end)
            folder = None
            if result is not None:
                folder = result.staging
            save_frames_and_video(frames, folder, options.video, HEADLESS_FPS)
    targets = " and ".join(str(target) for target in (options.out, options.video) if target is not None)
    if interruption.requested:
        echo(f"Interrupted. Partial results are in {targets}.")
        return INTERRUPTED
    echo(f"saved {targets}")
    return 0


def _draw_frames(
    window: ViewerWindow,
    count: int,
    interruption: Interruption,
    update: Callable[[int], None],
    *,
    stops_at_lesson_end: bool,
) -> Iterator[Frame]:
    """Draw frames of the window until `count` are drawn, the lesson is over, or the user interrupts.

    The end of the lesson only counts with `stops_at_lesson_end`. `update` is called with the number of drawn
    frames.
    """
    from robocov_app.viewer.launch import HEADLESS_FPS
    from robocov_app.viewer.window.screen_video import copy_pixels

    for number in range(1, count + 1):
        # There is no player once the lesson has ended.
        if stops_at_lesson_end and window.lesson.player is None:
            return
        window.run_frame(1.0 / HEADLESS_FPS)
        yield copy_pixels(window.screen)
        update(number)
        # At least one frame is drawn, because a video needs one.
        if interruption.requested:
            return
