"""The window of a visitor, which runs in a process of its own."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
from _thread import interrupt_main
from collections.abc import Callable
from contextlib import suppress
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from threading import Thread
from time import monotonic, time
from typing import Any, TypeAlias

from robocov.errors import InputError, RobocovError
from robocov_app.terminal.interruption import block_interrupts, unblock_interrupts
from robocov_app.toolkit.window.share_link import ShareLink

OPENING_TIMEOUT_S = 120.0
ENDING_TIMEOUT_S = 5.0
"""Time that a process has to write a draft before it is killed."""
_CHECK_INTERVAL_S = 0.02

WindowCommand = Callable[[Any], int]
"""A command of robocov that shows a window, called with its options."""


@dataclass(frozen=True)
class WindowAddress:
    """The address of an open window, sent by its process.

    Attributes
    ----------
    port : int
        Port of the process's own server, which accepts local connections only.
    token : str
        Access token of that server.
    """

    port: int
    token: str


@dataclass(frozen=True)
class OpeningFailure:
    """The reason why a window did not open, sent by its process.

    Attributes
    ----------
    message : str
    """

    message: str


OpeningResult: TypeAlias = WindowAddress | OpeningFailure


@dataclass(frozen=True)
class VisitorServerAccess:
    """Access to the server of all visitors from the process of a visitor's window.

    Attributes
    ----------
    send_address : callable
        Sends the address of the window to the server.
    link : ShareLink
        Link with which everyone opens a window of their own.
    """

    send_address: Callable[[WindowAddress], object]
    link: ShareLink


_server_access: ContextVar[VisitorServerAccess | None] = ContextVar("server_access", default=None)


def get_server_access() -> VisitorServerAccess | None:
    """Return the access to the server of all visitors.

    Returns
    -------
    VisitorServerAccess or None
        None if this process does not run the window of a visitor.
    """
    return _server_access.get()


@dataclass(eq=False)
class WindowProcess:
    """A window that is open in a process of its own.

    Attributes
    ----------
    process : SpawnProcess
    folder : Path
        Folder for the visitor's files.
    address : WindowAddress
    opened_at : float
        Time at which it was assigned to its visitor, s since the epoch.
    """

    process: SpawnProcess
    folder: Path
    address: WindowAddress
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


def start_window_process(
    command: WindowCommand, options: Any, folder: Path, link: ShareLink
) -> tuple[SpawnProcess, Connection]:
    """Start the process of a window.

    Parameters
    ----------
    command : callable
        Command that shows the window.
    options : WindowOptions
        Options of the command; folder, host and port are replaced.
    folder : Path
        Folder for the files of the visitor.
    link : ShareLink
        Link with which everyone opens a window of their own.

    Returns
    -------
    process : SpawnProcess
    receiver : Connection
        Receives an `OpeningResult`.

    Raises
    ------
    OSError
        If the process cannot be started.
    """
    own_options = replace(options, each=False, host="127.0.0.1", port=0, folder=folder)
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_run_window, args=(command, own_options, sender, link), daemon=False)
    if os.name == "posix":
        # Starting this tracker unblocks signals, so it must be started before they are blocked.
        resource_tracker.ensure_running()
    block_interrupts()
    try:
        process.start()
    except BaseException:
        receiver.close()
        raise
    finally:
        unblock_interrupts()
        sender.close()
    return process, receiver


async def wait_until_open(process: SpawnProcess, receiver: Connection, folder: Path) -> WindowProcess:
    """Wait until a window's process has sent the address of its window.

    Parameters
    ----------
    process : SpawnProcess
    receiver : Connection
        Receives the result; closed afterwards.
    folder : Path

    Returns
    -------
    WindowProcess

    Raises
    ------
    InputError
        If the window does not open, with the message of its process. The folder is removed if it is empty.
    """
    with receiver:
        result = await asyncio.to_thread(_receive_result, receiver)
    if isinstance(result, WindowAddress):
        return WindowProcess(process, folder, result)
    process.terminate()
    with suppress(OSError):
        folder.rmdir()
    raise InputError(result.message)


def _run_window(command: WindowCommand, options: Any, sender: Connection, link: ShareLink) -> None:
    """Show a window until it is closed or the server's process ends; runs in the window's process."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        parent.join()
        interrupt_main()

    def send(result: OpeningResult) -> None:
        # After the window has opened, the server no longer reads.
        with suppress(OSError):
            sender.send(result)

    Thread(target=end_with_parent, daemon=True).start()
    _server_access.set(VisitorServerAccess(send, link))
    with suppress(KeyboardInterrupt):
        try:
            command(options)
        except RobocovError as error:
            send(OpeningFailure(str(error)))


def _receive_result(receiver: Connection) -> OpeningResult:
    """Return the result that a window's process sends; an error if it sends none in time."""
    with suppress(EOFError, OSError):
        if receiver.poll(OPENING_TIMEOUT_S):
            result: OpeningResult = receiver.recv()
            return result
    return OpeningFailure("the window did not open")
