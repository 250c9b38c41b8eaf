"""`robocov replay`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from robocov.errors import InputError, ParameterError
from robocov.files.result_names import REPLAY_FILE, SESSION_FILE
from robocov_app.commands.options import JsonOption, VideoOptions, WebOptions
from robocov_app.terminal.arguments import parse_window_size
from robocov_app.terminal.interruption import INTERRUPTED, Interruption
from robocov_app.terminal.output import list_files, print_answer, write_json

if TYPE_CHECKING:
    from robocov_app.runs.saved_runs import SavedRun
    from robocov_app.viewer.session.session import Session


@dataclass
class Arguments(JsonOption, WebOptions):
    """Replay a saved run or comparison in the window, or render it as frames and a video.

    In the window, the run is the past: go to any time of it, and continue from there with other gains,
    another controller or a new wall. A run of a controller outside robocov is shown from its record; the
    controller is only loaded if --controller names it.

    Example: robocov replay rooms-rapf --video --show distances --out rooms-video
    """

    run: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DIR")]
    """Folder of a run or a comparison."""
    controller: Annotated[tuple[str, ...], tyro.conf.arg(metavar="FILE.py:Class ...")] = ()
    """Your own controllers that may be loaded to continue their runs in the window."""
    out: Path | None = None
    """Folder for frames and video."""
    overwrite: bool = False
    """Replace an earlier result in that folder."""
    video: tyro.conf.OmitArgPrefixes[VideoOptions] = field(default_factory=VideoOptions)

    def __post_init__(self) -> None:
        """Check the options, which differ between the window and a video."""
        super().__post_init__()
        if self.each:
            raise ParameterError("--each: requires a session file, opened by robocov demo")
        if self.is_headless:
            self._check_headless_options()
        else:
            for name in ("out", "json"):
                if getattr(self, name):
                    raise ParameterError(f"--{name}: requires --frames or --video")
            parse_window_size(self.video.size)

    def _check_headless_options(self) -> None:
        """Raise a ParameterError if an option does not suit a video or frames, or if --out is missing."""
        if self.serve:
            raise ParameterError("--serve: cannot be combined with --frames or --video")
        if self.out is None:
            raise ParameterError("--out: expected a folder for the frames and the video")
        if self.controller:
            raise ParameterError("--controller: cannot be combined with --frames or --video")

    @property
    def is_headless(self) -> bool:
        """Whether the run is rendered without a window."""
        return self.video.frames or self.video.video


def command(options: Arguments) -> int:
    """Run `robocov replay`, and return its exit status."""
    if options.is_headless:
        return _replay(options)
    from robocov.kernel_compilation import compile_in_background
    from robocov_app.toolkit.window.termination import ending_on_signals

    with ending_on_signals(), compile_in_background():
        return _replay(options)


def _replay(options: Arguments) -> int:
    """Replay a session or saved runs, in the window or as a video, and return the exit status."""
    options.video.read_layers()
    from robocov_app.viewer.branch_output.folders import find_branch_file

    path = options.run
    if find_branch_file(path) is not None:
        path = path / SESSION_FILE
    if path.suffix == ".robocov":
        return _replay_session(path, options)
    from robocov_app.runs.saved_runs import load_saved_runs

    saved_runs = load_saved_runs(options.run)
    if options.is_headless:
        return _save_video(options, saved_runs)
    return _open_window(options, _build_session(options, saved_runs))


def _replay_session(path: Path, options: Arguments) -> int:
    """Open a session in the window, playing from its start."""
    from robocov_app.viewer.session.files.session_file import load_session
    from robocov_app.viewer.session.session import Session

    if options.is_headless:
        raise ParameterError(f"{path}: run `robocov run {path} --video` for the video of a session")
    session = Session.open(load_session(path, options.controller))
    session.timeline.record_end_time = session.timeline.end_time
    session.show_time(0.0)
    session.playback.is_playing = True
    return _open_window(options, session, path)


def _build_session(options: Arguments, saved_runs: Sequence[SavedRun]) -> Session:
    """Build the session whose past is a saved run or comparison; check the controllers that may be loaded."""
    from robocov.controllers import load_controller_class
    from robocov_app.viewer.session.recorded import build_replay_session

    names = [saved.record.controller for saved in saved_runs]
    class_names = [name.rpartition(":")[2] for name in names]
    for controller in options.controller:
        load_controller_class(controller)
        if controller.rpartition(":")[2] not in class_names:
            expected = f"expected the controller of a run ({', '.join(dict.fromkeys(names))})"
            raise ParameterError(f"--controller: {expected}, got {controller}")
    try:
        return build_replay_session(saved_runs, options.controller)
    except InputError as error:
        message = str(error)
        if str(options.run) not in message:
            message = f"{options.run}: {message}"
        raise InputError(message) from error


def _open_window(options: Arguments, session: Session, file: Path | None = None) -> int:
    """Show a session in the window until it is closed."""
    from robocov_app.viewer.launch import ViewerLauncher
    from robocov_app.web import prepare, show

    prepare(options, Path())
    shown_layers, hidden_layers = options.video.read_layers()
    launcher = ViewerLauncher(
        session,
        _find_map_name(session),
        Path(),
        theme=options.video.theme,
        size=parse_window_size(options.video.size),
        controllers=options.controller,
        shown_layers=shown_layers,
        hidden_layers=hidden_layers,
        file=file,
        served=options.serve,
    )
    with launcher.window() as window:
        show(window, options, Path())
    return 0


def _find_map_name(session: Session) -> str:
    """Return the name of the bundled map in a session; for other maps, the title in the map."""
    from robocov.mapfile import list_bundled_maps, load_map

    for name in list_bundled_maps():
        if load_map(name) == session.displayed.environment:
            return name
    return session.displayed.environment.name


def _save_video(options: Arguments, saved_runs: Sequence[SavedRun]) -> int:
    """Render saved runs into a folder, and return the exit status."""
    import numpy as np

    from robocov.files.result_folder import create_result
    from robocov.metrics import CostHistory
    from robocov_app.runs.execution import Run
    from robocov_app.runs.saved_runs import build_roster
    from robocov_app.runs.video import save_videos

    assert options.out is not None
    out = options.out
    for folder in (options.run, *(saved.folder for saved in saved_runs)):
        # Writing the video must not replace the run itself.
        if Path(os.path.realpath(folder)).is_relative_to(os.path.realpath(out)):
            raise InputError(f"--out: {out}: expected a folder that does not contain the run")
    runs = []
    roster_runs = []
    for saved in saved_runs:
        history = saved.history or CostHistory(*np.empty((4, 0)))
        runs.append(Run(saved.record, history, {}))
        # Failed robots are obstacles, at different positions in each run. Distances on a common map ignore
        # them.
        environment = build_roster(saved.record).environment
        roster_runs.append(Run(replace(saved.record, environment=environment), history, {}))
    runs_on_one_map = None
    if len(runs) > 1:
        runs_on_one_map = roster_runs
    with create_result(out, "replay", overwrite=options.overwrite) as result, Interruption() as interruption:
        content = {"format": "robocov-replay", "version": 1, "of": str(options.run)}
        write_json(result.staging / REPLAY_FILE, content)
        save_videos(
            runs,
            None,
            result.staging,
            options.video.build_settings(),
            interruption,
            quiet=options.json,
            runs_on_one_map=runs_on_one_map,
        )
    ending = "saved in"
    if interruption.requested:
        ending = "Interrupted. Partial results are in"
    answer = {"out": str(out), "interrupted": interruption.requested}
    print_answer(options, answer, f"{ending} {out}/: {list_files(out)}")
    return INTERRUPTED if interruption.requested else 0
