"""Supervision of commands that run a user's controllers, by a second process.

`os._exit`, a signal or a crash of the interpreter end a process without a message and cannot be caught: the
exit status could be 0 although the command did nothing. Therefore a command that names controllers of the
user runs in a second process, which is started before any large import, while the first one only waits. This
takes some hundredths of a second. The second process sends its status through a pipe when it ends properly.
Without that message, the first process names the controllers and ends with status 1. All other commands run
in the first process.

Where descriptors cannot be inherited (Windows), such commands are not supervised.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

_DESCRIPTOR_VARIABLE = "_ROBOCOV_SUPERVISOR"
"""Private environment variable with the descriptor of the pipe."""
_CONTROLLER = re.compile(r"[^\s,\"'\[\]]+\.py:[^\W\d]\w*")
_MAX_STUDY_BYTES = 1_000_000
"""Maximum size of the part of a study file that is searched for controllers."""
_FORWARDED_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
"""Signals that the first process sends on to the second one."""
_PARENT_POLL_S = 1.0
"""Time between two checks of whether the parent process is still running."""


def find_user_controllers(words: Sequence[str]) -> list[str]:
    """Find the controllers from users' files in a command line and in the study file that it names.

    Parameters
    ----------
    words : sequence of str
        The command line.

    Returns
    -------
    list of str
        ``file.py:ClassName``, without duplicates.
    """
    controllers: list[str] = []
    for argument in words:
        word = argument
        # Of an option like --controller=mine.py:C, only the value matters.
        if argument.startswith("--") and "=" in argument:
            word = argument.partition("=")[2]
        controllers += _CONTROLLER.findall(word)
        if word.lower().endswith(".toml"):
            with suppress(OSError, ValueError):
                content = Path(word).read_bytes()[:_MAX_STUDY_BYTES]
                controllers += _CONTROLLER.findall(content.decode("utf-8", "replace"))
    return list(dict.fromkeys(controllers))


def can_supervise() -> bool:
    """Return whether this process can supervise the command: it must not be supervised itself."""
    return os.name == "posix" and _DESCRIPTOR_VARIABLE not in os.environ


def supervise(controllers: Sequence[str]) -> tuple[int, str]:
    """Run this command again in a second process, and wait for it.

    Parameters
    ----------
    controllers : sequence of str
        The user's controllers, for the message.

    Returns
    -------
    status : int
        The exit status of the command; 1 if it did not end properly.
    error_message : str
        Message that names the controllers; empty if the command ended properly, or if a signal to this
        process stopped it.
    """
    reader, writer = os.pipe()
    environment = {**os.environ, _DESCRIPTOR_VARIABLE: str(writer)}
    command = [sys.executable, *sys.orig_argv[1:]]
    child = subprocess.Popen(command, env=environment, pass_fds=(writer,))
    os.close(writer)
    with _forward_signals(child) as received_signals:
        status = child.wait()
    message = _read_message(reader)
    if message:
        # The second process has ended properly, and its message is its status.
        return int(message), ""
    if received_signals:
        # If a signal ends a process, its status is -signal in Python, and 128 + signal in shells.
        exit_status = 128 - status if status < 0 else status
        # Without a message, status 0 does not mean success.
        return exit_status or 1, ""
    names = ", ".join(controllers)
    reason = f"it terminated Python ({describe_status(status)}) before the command had finished"
    return 1, f"controller {names}: {reason}"


@contextmanager
def _forward_signals(child: subprocess.Popen[bytes]) -> Iterator[list[int]]:
    """Forward signals to a child process; yield the list of signals received so far."""
    received_signals: list[int] = []

    def forward(number: int, frame: FrameType | None) -> None:
        received_signals.append(number)
        # Ctrl+C in a terminal reaches both processes without forwarding.
        if number != signal.SIGINT or not _is_in_foreground():
            with suppress(OSError):
                child.send_signal(number)

    previous_handlers = {}
    for name in _FORWARDED_SIGNALS:
        number = getattr(signal, name)
        previous_handlers[number] = signal.signal(number, forward)
    try:
        yield received_signals
    finally:
        for number, handler in previous_handlers.items():
            signal.signal(number, handler)


def _read_message(descriptor: int) -> bytes:
    """Return the content of a pipe; empty if nothing was written to it."""
    with open(descriptor, "rb") as pipe:
        # Do not wait for the end of the pipe: a process that the command left behind may keep it open.
        os.set_blocking(descriptor, False)
        return pipe.read() or b""


def prepare_supervision() -> int | None:
    """Prepare this process if it is supervised: from then on it ends when its parent does.

    Returns
    -------
    int or None
        Descriptor for `report_status`; None if this process is not supervised.
    """
    text = os.environ.pop(_DESCRIPTOR_VARIABLE, None)
    if text is None:
        return None
    descriptor = int(text)
    parent = os.getppid()
    os.set_inheritable(descriptor, False)

    def end_with_parent() -> None:
        while os.getppid() == parent:
            threading.Event().wait(_PARENT_POLL_S)
        os.kill(os.getpid(), signal.SIGKILL)

    threading.Thread(target=end_with_parent, daemon=True).start()
    return descriptor


def report_status(descriptor: int, status: int) -> None:
    """Report to the supervising process that the command has ended properly.

    Parameters
    ----------
    descriptor : int
        Descriptor that `prepare_supervision` returned.
    status : int
        Exit status of the command.
    """
    with suppress(OSError):
        os.write(descriptor, str(status).encode())


def describe_status(status: int) -> str:
    """Describe how a process ended.

    Parameters
    ----------
    status : int
        Return code as in `subprocess`: the exit status, or the negative number of a signal.

    Returns
    -------
    str

    Examples
    --------
    >>> describe_status(3), describe_status(-9)
    ('exit status 3', 'killed by signal 9 (SIGKILL)')
    """
    if status >= 0:
        return f"exit status {status}"
    try:
        name = f" ({signal.Signals(-status).name})"
    except ValueError:
        name = ""
    return f"killed by signal {-status}{name}"


def _is_in_foreground() -> bool:
    """Return whether this process is in the foreground of its terminal."""
    try:
        terminal = os.open("/dev/tty", os.O_RDONLY)
    except OSError:
        return False
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:
        return False
    finally:
        os.close(terminal)
