"""Showing a window in a browser: frames are sent to web pages, which send back input and their size."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov.optional_imports import import_optional
from robocov_app.terminal.output import echo

if TYPE_CHECKING:
    from robocov_app.toolkit.window.window import BaseWindow


def prepare(options: Any, folder: Path) -> None:
    """Check the requirements of a served window before anything is opened for it.

    Parameters
    ----------
    options : WebOptions
        Options of a command; nothing is checked without ``--serve``.
    folder : Path
        Folder for files of the window; it is created if necessary.

    Raises
    ------
    RobocovError
        If the optional "web" dependencies are not installed, or files cannot be written to the folder.
    """
    if not options.serve:
        return
    import_optional("websockets", "web")
    from robocov_app.web.files import prepare_folder

    prepare_folder(folder)


def show(window: BaseWindow, options: Any, folder: Path) -> None:
    """Run a window until it is closed, on the screen or in browsers.

    Parameters
    ----------
    window : BaseWindow
    options : WebOptions
        Options of the command; with ``--serve``, the window is shown in browsers.
    folder : Path
        The only folder in which a window in a browser can read and write files.

    Raises
    ------
    RobocovError
        If the optional "web" dependencies are not installed.
    KeyboardInterrupt
        If SIGINT, SIGTERM or SIGHUP ended a served window.
    """
    if not options.serve:
        window.run()
        return
    from robocov_app.terminal.interruption import unblock_interrupts
    from robocov_app.toolkit.window.termination import ending_on_signals, is_ending
    from robocov_app.web.access import CONTROL_LABEL
    from robocov_app.web.confined import confine_files
    from robocov_app.web.server import WebDisplay
    from robocov_app.web.window_process import WindowAddress, get_server_access

    # With --each, pages connect through the server of all visitors, which needs the address of the window.
    server_access = get_server_access()
    visitor_link = None if server_access is None else server_access.link
    with (
        WebDisplay(options.host, options.port, folder, visitor_link) as display,
        confine_files(folder),
        ending_on_signals(),
    ):
        if server_access is not None:
            server_access.send_address(WindowAddress(display.port, display.token))
        else:
            echo(f"{CONTROL_LABEL}{display.link}", flush=True)
            echo(f"Watch it:           {display.watch_link}", flush=True)
            echo("Press Ctrl+C to stop.", flush=True)
        window.remote = display
        window.hide_folder(folder)
        was_interrupted = False

        def close_window(number: int, frame: object) -> None:
            """Close the window without asking about unsaved work; on the second signal, stop at once."""
            nonlocal was_interrupted
            if was_interrupted:
                raise KeyboardInterrupt
            was_interrupted = True
            window.closed = True

        # SIGTERM and SIGHUP are handled by `ending_on_signals`.
        signal.signal(signal.SIGINT, close_window)
        unblock_interrupts()
        window.run()
    if was_interrupted or is_ending():
        raise KeyboardInterrupt


def serve_each(command: Callable[[Any], int], options: Any) -> int:
    """Serve a window of a command to each visitor, each in its own process, until the server is stopped.

    Raises
    ------
    KeyboardInterrupt
        When SIGINT or SIGTERM stops the server.
    """
    import asyncio

    from robocov_app.web.visitor_server import VisitorServer

    max_idle_s = 60.0 * options.idle_minutes
    server = VisitorServer(command, options, options.max_sessions, max_idle_s)
    try:
        asyncio.run(server.serve(lambda line: echo(line, flush=True)))
    except asyncio.CancelledError:  # by SIGINT or SIGTERM
        raise KeyboardInterrupt from None
    return 0
