"""The window of a visitor, which runs in a process of its own."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
from _thread import interrupt_main
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from dataclasses import dataclass, field, replace
from io import TextIOBase
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from threading import Thread
from time import monotonic, time
from typing import Any
from urllib.parse import urlsplit

from robocov.errors import InputError, RobocovError
from robocov_app.terminal.interruption import block_interrupts, unblock_interrupts
from robocov_app.web.access import CONTROL_LABEL, get_token

OPENING_TIMEOUT_S = 120.0
ENDING_TIMEOUT_S = 5.0
"""Time that a process has to write a draft before it is killed."""
_CHECK_INTERVAL_S = 0.02

WindowCommand = Callable[[Any], int]
"""A command of robocov that shows a window, called with its options."""


@dataclass(eq=False)
class WindowProcess:
    """A window that is open in a process of its own.

    Attributes
    ----------
    process : SpawnProcess
    folder : Path
        Folder for the visitor's files.
    port : int
        Port of the process's own server, which accepts local connections only.
    token : str
        Access token of that server.
    opened_at : float
        Time at which it was assigned to its visitor, s since the epoch.
    """

    process: SpawnProcess
    folder: Path
    port: int
    token: str
    opened_at: float = field(default_factory=time)

    @property
    def is_alive(self) -> bool:
        """Whether the process is running."""
        return self.process.is_alive()

    async def end(self) -> None:
        """End the process, which first writes a draft of unsaved work."""
        self.process.terminate()
        deadline = monotonic() + ENDING_TIMEOUT_S
        while self.process.is_alive() and monotonic() < deadline:
            await asyncio.sleep(_CHECK_INTERVAL_S)
        self.process.kill()

    def remove_folder(self) -> None:
        """Remove the folder if it is empty."""
        with suppress(OSError):
            self.folder.rmdir()


def start_process(command: WindowCommand, options: Any, folder: Path) -> tuple[SpawnProcess, Connection]:
    """Start the process of a window.

    Parameters
    ----------
    command : callable
        Command that shows the window.
    options : WindowOptions
        Options of the command; folder, host and port are replaced.
    folder : Path
        Folder for the files of the visitor.

    Returns
    -------
    process : SpawnProcess
    output : Connection
        Receives the standard output of the process.
    """
    own_options = replace(options, each=False, host="127.0.0.1", port=0, folder=folder)
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_run_window, args=(command, own_options, sender), daemon=False)
    if os.name == "posix":
        # Starting this tracker unblocks signals, so it must be started before they are blocked.
        resource_tracker.ensure_running()
    block_interrupts()
    process.start()
    unblock_interrupts()
    sender.close()
    return process, receiver


async def wait_until_open(process: SpawnProcess, output: Connection, folder: Path) -> WindowProcess:
    """Wait until a window's process has printed its link.

    Parameters
    ----------
    process : SpawnProcess
    output : Connection
        Standard output of the process; closed afterwards.
    folder : Path

    Returns
    -------
    WindowProcess

    Raises
    ------
    InputError
        If the window does not open, with the message of its process. The folder is removed if it is empty.
    """
    with output:
        line = await asyncio.to_thread(_receive_line, output)
    if line.startswith(CONTROL_LABEL):
        link = line.removeprefix(CONTROL_LABEL).strip()
        return WindowProcess(process, folder, urlsplit(link).port or 0, get_token(link))
    process.terminate()
    with suppress(OSError):
        folder.rmdir()
    raise InputError(line)


class _PipeOutput(TextIOBase):
    """Stream that sends the standard output of a window's process to the server."""

    def __init__(self, pipe: Connection) -> None:
        self._pipe = pipe

    def write(self, text: str, /) -> int:
        """Send text; it is lost if the server no longer reads."""
        with suppress(OSError):
            self._pipe.send(text)
        return len(text)


def _run_window(command: WindowCommand, options: Any, pipe: Connection) -> None:
    """Show a window until it is closed or the server's process ends; runs in the window's process."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        parent.join()
        interrupt_main()

    Thread(target=end_with_parent, daemon=True).start()
    with suppress(KeyboardInterrupt), redirect_stdout(_PipeOutput(pipe)):
        try:
            command(options)
        except RobocovError as error:
            # After the window has opened, the server no longer reads.
            with suppress(OSError):
                pipe.send(str(error))


def _receive_line(receiver: Connection) -> str:
    """Return the first line that a window's process prints, or an error message if there is none."""
    with suppress(EOFError, OSError):
        if receiver.poll(OPENING_TIMEOUT_S):
            return str(receiver.recv())
    return "the window did not open"
