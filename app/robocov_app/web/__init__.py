"""The window in a browser: its pictures go out, pointer, keys, wheel and the size of the page come in."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov.optional_imports import import_optional
from robocov_app.terminal.output import echo

if TYPE_CHECKING:
    from robocov_app.toolkit.window import BaseWindow


def prepare(options: Any, folder: Path) -> None:
    """Check what a served window needs before anything is opened for it.

    Parameters
    ----------
    options : WebOptions
        Options of a command; nothing is checked without ``--serve``.
    folder : Path
        Folder for files of the window; it is created.

    Raises
    ------
    RobocovError
        Without the extra, or if files cannot be written to the folder.
    """
    if not options.serve:
        return
    import_optional("websockets", "web")
    from robocov_app.web.files import prepare_folder

    prepare_folder(folder)


def show(window: BaseWindow, options: Any, folder: Path) -> None:
    """Run a window until it is closed: on the screen, or in browsers, as the options of a command say.

    Files below the folder alone can be used then. Raises RobocovError without the extra.
    """
    if not options.serve:
        window.run()
        return
    from robocov_app.terminal.interruption import unblock_interrupts
    from robocov_app.toolkit.termination import ending_on_signals, is_ending
    from robocov_app.web.confined import confine_files
    from robocov_app.web.server import WebDisplay

    with (
        WebDisplay(options.host, options.port, folder) as display,
        confine_files(folder),
        ending_on_signals(),
    ):
        echo(f"open {display.link}", flush=True)
        echo(f"to watch only: {display.watch_link}", flush=True)
        window.remote = display
        stopped: list[int] = []

        def stop(number: int, _: object) -> None:
            if stopped:
                raise KeyboardInterrupt  # a second time: at once
            stopped.append(number)
            window.closed = True  # who stops the process cannot be asked about unsaved work

        signal.signal(signal.SIGINT, stop)  # the window itself sees to SIGTERM
        unblock_interrupts()
        window.run()
    if stopped or is_ending():
        raise KeyboardInterrupt


def serve_each(command: Callable[[Any], int], options: Any) -> int:
    """Serve a command's window to each visitor in a process of their own, until the process is stopped."""
    import asyncio

    from robocov_app.web.visitor_server import VisitorServer

    max_idle_s = 60.0 * options.idle_minutes
    server = VisitorServer(command, options, options.max_sessions, max_idle_s)
    try:
        asyncio.run(server.serve(lambda line: echo(line, flush=True)))
    except asyncio.CancelledError:  # by SIGINT or SIGTERM
        raise KeyboardInterrupt from None
    return 0
