"""``robocov demo``: the interactive window."""

from __future__ import annotations

from contextlib import ExitStack, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from robocov.errors import ParameterError, require_number
from robocov_app.commands.options import LayerOptions, ScenarioOptions, WindowOptions, get_robot_count
from robocov_app.terminal.arguments import parse_gains, parse_window_size
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import echo
from robocov_app.terminal.progress import show_progress

if TYPE_CHECKING:
    from collections.abc import Iterator

    from robocov_app.runs.encoding import Frame
    from robocov_app.viewer.launch import Launcher
    from robocov_app.viewer.session.session import Session
    from robocov_app.viewer.window import Window


@dataclass
class Arguments(ScenarioOptions, WindowOptions, LayerOptions):
    """The interactive window: watch a team cover a map, touch it, compare controllers, go back in time.

    Everything has a key: press F1. Settings of the look are remembered.

    Example: robocov demo museum --controllers rapf rpf lloyd --robots 8
    """

    controllers: Annotated[tuple[str, ...], tyro.conf.arg(metavar="NAME ...")] = ("rapf",)
    """Up to four, side by side: names, or mine.py:MyController."""
    gains: Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="GAIN=VALUE ...")] = ()
    """Gains of the first controller, as in --set k_rep=0.3."""
    speed: float = 1.0
    """Simulated seconds per second at the beginning."""
    paused: bool = False
    """Begin paused."""
    tour: bool = False
    """Play the lesson that comes with robocov, in eleven short chapters."""
    lesson: Path | None = None
    """Play a lesson of your own, see `robocov lesson`."""
    frames: int | None = None
    """Render so many frames of the window without a display, 30 a second, and end; needs --out or --video."""
    out: Path | None = None
    """Folder for these frames: 000000.png, 000001.png, ..."""
    video: Path | None = None
    """Render the window without a display to this film; with --tour, all of the tour."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number("--robots", self.robots, 1, 1000)
        require_number("--seed", self.seed, 0, 2**63 - 1)
        require_number("--lattice", self.lattice, 2, 1024)
        require_number("--speed", self.speed, 0.01, 1000.0)
        if self.frames is not None:
            require_number("--frames", self.frames, 1, 1_000_000)
        if not 1 <= len(self.controllers) <= 4:
            raise ParameterError(f"--controllers: expected 1 to 4, got {len(self.controllers)}")
        if self.out is not None and self.frames is None:
            raise ParameterError("--out: nothing to write there; requires --frames N")
        if self.frames is not None and self.out is None and self.video is None:
            raise ParameterError("--frames: requires --out DIR or --video FILE")
        if self.video is not None and self.frames is None and not self.tour:
            raise ParameterError("--video: requires --frames N or --tour")
        if self.serve and (self.frames is not None or self.video is not None):
            raise ParameterError("--serve: cannot be combined with --frames or --video")
        if self.video is not None and self.video.suffix.lower() != ".mp4":
            raise ParameterError(f"--video: expected a name ending in .mp4, got {str(self.video)!r}")


def command(options: Arguments) -> int:
    from robocov.kernel_compilation import compile_in_background
    from robocov_app.toolkit.termination import ending_on_signals
    from robocov_app.web import prepare, serve_each

    prepare(options, options.folder)
    if options.each:
        return serve_each(command, options)
    headless = options.frames is not None or options.video is not None
    with ExitStack() as stack:
        if not headless:
            stack.enter_context(ending_on_signals())
            stack.enter_context(compile_in_background())
        return _open_window(options, headless=headless)


def _open_window(options: Arguments, *, headless: bool) -> int:
    from robocov.controllers import list_controller_classes
    from robocov_app.viewer.launch import Launcher
    from robocov_app.viewer.session.file import SUFFIX, load_session
    from robocov_app.viewer.session.session import Session
    from robocov_app.web import show

    file, name, laws = None, options.map, (*list_controller_classes(), *options.controllers)
    if options.map.endswith(SUFFIX):
        file = Path(options.map)
        saved = load_session(file, laws)
        session, name = Session.opened(saved), str(saved.view.get("map") or "")
        if options.serve and not file.resolve().is_relative_to(options.folder.resolve()):
            file = None  # it is saved to a file of its own, where it may be
    else:
        session = session_of(options)
    also, without = options.read_layers()
    look: dict[str, Any] = {
        "theme": options.theme,
        "size": parse_window_size(options.size),
        "scale": options.scale,
    }
    look |= {"also": also, "without": without, "headless": headless, "served": options.serve}
    first = file is None and options.lesson is None and not options.tour
    given: dict[str, Any] = {"laws": laws, "lattice": options.lattice, "file": file, "offers_lesson": first}
    opening = Launcher(session, name, options.folder, **look, **given)
    if headless:
        return rendered(opening, options)
    with opening.window() as window:
        _begin_lesson(window, options)
        show(window, options, options.folder)
    return 0


def _begin_lesson(window: Window, options: Arguments) -> None:
    if options.lesson is not None:
        window.start_lesson(options.lesson)
    elif options.tour:
        window.do("tour")


def session_of(options: Arguments) -> Session:
    from robocov.mapfile import load_map
    from robocov.team_files import read_team
    from robocov_app.viewer.session.scenario import ControllerChoice, Scenario, TeamSpec
    from robocov_app.viewer.session.session import Session

    robots, limits = options.robots, TeamSpec(radius=options.radius)
    if options.team is not None:
        team = read_team(options.team, {"radius": options.radius})
        robots, limits = get_robot_count(team, robots, Arguments.robots, options.team), TeamSpec.of(team)
    first, *others = options.controllers
    laws = (ControllerChoice(first, parse_gains(options.gains)), *map(ControllerChoice, others))
    conditions, start = (
        options.conditions.build_conditions(options.seed, robots),
        (options.start, options.seed),
    )
    environment = load_map(options.map)
    session = Session(Scenario(environment, laws, robots, *start, limits, options.dt, conditions=conditions))
    session.clock.speed = options.speed
    session.playing = not options.paused
    return session


def rendered(opening: Launcher, options: Arguments) -> int:
    from robocov.files.result_folder import create_result
    from robocov.files.writing import resolve_target
    from robocov_app.runs.encoding import find_encoder, save_frames_and_video
    from robocov_app.viewer.film import pixels
    from robocov_app.viewer.launch import HEADLESS_FPS

    if options.video is not None:
        resolve_target(options.video)
        find_encoder()
    made = nullcontext() if options.out is None else create_result(options.out, overwrite=False)
    with made as result, opening.window() as window, Interruption() as stop:
        _begin_lesson(window, options)
        count = options.frames
        if count is None:
            assert window.tour is not None
            count = round(window.tour.seconds * HEADLESS_FPS)
        with show_progress("frames", count) as update:

            def frames() -> Iterator[Frame]:
                for done in range(count):
                    if stop.requested or (options.frames is None and window.tour is None):
                        return
                    window.frame(1.0 / HEADLESS_FPS)
                    yield pixels(window.screen)
                    update(done + 1)

            out = None if result is None else result.staging
            save_frames_and_video(frames(), out, options.video, HEADLESS_FPS)
    for target in filter(None, (options.out, options.video)):
        echo(f"saved {target}")
    return INTERRUPTED if stop.requested else 0
