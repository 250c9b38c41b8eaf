"""``robocov replay``: saved runs again, in the window or as frames and films."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from robocov.errors import InputError, ParameterError, summarize_names
from robocov_app.runs.options import FilmOptions, JsonOption, WebOptions
from robocov_app.terminal import output
from robocov_app.terminal.arguments import window_size
from robocov_app.terminal.interruption import INTERRUPTED, Interruption

if TYPE_CHECKING:
    from robocov_app.runs.saved import Saved
    from robocov_app.viewer.session.session import Session


@dataclass
class Arguments(JsonOption, WebOptions):
    """A saved run or comparison again: in the window, or headlessly as frames and a film.

    In the window the run is the past: go back and forth in it, go on from any moment of it with other
    gains, another controller or a wall in the way. A run of a controller that is none of robocov's is shown
    from its record, and the controller is loaded only where --controller names it.

    Example: robocov replay rooms-rapf --video --film-speed 1 --show distances --out rooms-film
    """

    run: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DIR")]
    """The folder of a run or a comparison."""
    controller: Annotated[tuple[str, ...], tyro.conf.arg(metavar="FILE.py:Class ...")] = ()
    """Controllers of your own that may be loaded to go on with their runs in the window."""
    out: Path | None = None
    """Folder for frames and film."""
    overwrite: bool = False
    """Replace an earlier result in that folder."""
    film: tyro.conf.OmitArgPrefixes[FilmOptions] = field(default_factory=FilmOptions)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.each:
            raise ParameterError("--each: requires a session file, opened by robocov demo")
        if self.headless and self.serve:
            raise ParameterError("--serve: cannot be combined with --frames or --video")
        if self.headless and self.out is None:
            raise ParameterError("--out: expected a folder for the frames and the video")
        if self.headless and self.controller:
            raise ParameterError("--controller: cannot be combined with --frames or --video")
        if not self.headless:
            for name in ("out", "json"):
                if getattr(self, name):
                    raise ParameterError(f"--{name}: requires --frames or --video")
            window_size(self.film.size)

    @property
    def headless(self) -> bool:
        return self.film.frames or self.film.video


def command(options: Arguments) -> int:
    if options.headless:
        return _replay(options)
    from robocov.kernel_compilation import compile_in_background
    from robocov_app.toolkit.termination import ending_on_signals

    with ending_on_signals(), compile_in_background():
        return _replay(options)


def _replay(options: Arguments) -> int:
    from robocov_app.runs.saved import load_saved

    options.film.layers()
    story = options.run / "session.robocov" if (options.run / "story.json").is_file() else options.run
    if story.suffix == ".robocov":
        from robocov_app.viewer.session.file import load_session
        from robocov_app.viewer.session.session import Session

        if options.headless:
            raise ParameterError(f"{story}: a film of a session is made by robocov run {story} --video")
        session = Session.opened(load_session(story, options.controller))
        session.recorded_until = session.end
        session.look_at(0.0)
        session.playing = True
        return open_window(options, session, story)
    saved = load_saved(options.run)
    if options.headless:
        return make_film(options, saved)
    from robocov.controllers import load_controller_class
    from robocov_app.viewer.session.recorded import replayed_session

    for controller in options.controller:
        load_controller_class(controller)
        names = [each.record.controller for each in saved]
        if controller.rpartition(":")[2] not in (name.rpartition(":")[2] for name in names):
            wanted = f"expected the controller of a run ({summarize_names(names)})"
            raise ParameterError(f"--controller: {wanted}, got {controller}")
    try:
        session = replayed_session(saved, options.controller)
    except InputError as error:
        where = str(options.run)
        raise InputError(str(error) if where in str(error) else f"{where}: {error}") from error
    return open_window(options, session)


def open_window(options: Arguments, session: Session, file: Path | None = None) -> int:
    from robocov.mapfile import list_bundled_maps, load_map
    from robocov_app.viewer.launch import Launcher
    from robocov_app.web import prepare, show

    prepare(options, Path())

    same = (key for key in list_bundled_maps() if load_map(key) == session.environment)
    (also, without), film = options.film.layers(), options.film
    look: dict[str, Any] = {"theme": film.theme, "size": window_size(film.size), "laws": options.controller}
    look |= {"also": also, "without": without, "file": file, "served": options.serve}
    with Launcher(session, next(same, session.environment.name), Path(), **look).window() as window:
        show(window, options, Path())
    return 0


def make_film(options: Arguments, saved: list[Saved]) -> int:
    import numpy as np

    from robocov.files.result_folder import create_result
    from robocov.metrics import CostHistory
    from robocov_app.runs.film import save_moving
    from robocov_app.runs.run import Run
    from robocov_app.runs.saved import roster_of

    assert options.out is not None
    out = options.out
    for folder in (options.run, *(each.folder for each in saved)):  # no run is replaced by its own film
        if Path(os.path.realpath(folder)).is_relative_to(os.path.realpath(out)):
            raise InputError(f"--out: {out}: expected another folder than that of the run")
    runs = [Run(each.record, each.history or CostHistory(*np.empty((4, 0))), {}) for each in saved]
    # robots may have failed at other places in each run: distances are to one map, that without them
    bare = [replace(run, record=replace(run.record, environment=roster_of(run.record)[0])) for run in runs]
    content = {"format": "robocov-replay", "version": 1, "of": str(options.run)}
    with create_result(out, "replay", overwrite=options.overwrite) as result, Interruption() as stop:
        output.write_json(result.staging / "replay.json", content)
        same = bare if len(runs) > 1 else None
        save_moving(runs, None, result.staging, options.film, stop, quiet=options.json, bare=same)
    done = "stopped; what was done is in" if stop.requested else "saved in"
    answer = {"out": str(out), "interrupted": stop.requested}
    output.tell(options, answer, f"{done} {out}/: {output.listed(out)}")
    return INTERRUPTED if stop.requested else 0
