"""A process that watches over a command which runs a user's controllers.

`os._exit`, a signal or a crash of the interpreter end a process without a word, and cannot be caught in it:
the status could be 0 though nothing was done. So a command that names controllers of the user runs in a
second process, started before anything large is imported, while the first one only waits; it costs some
hundredths of a second. The second one sends its status through a pipe when it ends properly. Without that
message, the first one names the controllers, and the status is 1. All other commands run as they are.

Where descriptors cannot be handed on (Windows), such commands are not watched.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import FrameType

_DESCRIPTOR = (
    "_ROBOCOV_SUPERVISOR"  # environment variable, for this module alone, with the descriptor of the pipe
)
_CONTROLLER = re.compile(r"[^\s,\"'\[\]]+\.py:[^\W\d]\w*")
_MAX_STUDY_BYTES = 1_000_000
_FORWARDED = ("SIGINT", "SIGTERM", "SIGHUP")


def find_own_controllers(words: Sequence[str]) -> list[str]:
    """Return the controllers of the user, ``file.py:ClassName``, that a command line or its study names."""
    found: list[str] = []
    for word in words:
        found += _CONTROLLER.findall(word)
        if word.lower().endswith(".toml"):
            with suppress(OSError, ValueError):
                content = Path(word).read_bytes()[:_MAX_STUDY_BYTES]
                found += _CONTROLLER.findall(content.decode("utf-8", "replace"))
    return list(dict.fromkeys(found))


def can_supervise() -> bool:
    """Return whether this process may run the command in another one: not if it is that one already."""
    return os.name == "posix" and _DESCRIPTOR not in os.environ


def supervise(controllers: Sequence[str]) -> tuple[int, str]:
    """Run this command again in a process of its own and wait for it.

    Returns
    -------
    status : int
        The exit status of the command, 1 if it did not end properly.
    complaint : str
        What ended it, naming the controllers; empty if it ended properly, or was stopped by a signal that
        this process was sent.
    """
    ours, theirs = os.pipe()
    stopped: list[int] = []
    environment = {**os.environ, _DESCRIPTOR: str(theirs)}
    command = [sys.executable, *sys.orig_argv[1:]]
    child = subprocess.Popen(command, env=environment, pass_fds=(theirs,))
    os.close(theirs)

    def forward(number: int, frame: FrameType | None) -> None:
        stopped.append(number)
        # a terminal sends Ctrl-C to both
        if number != signal.SIGINT or not _is_in_foreground():
            with suppress(OSError):
                child.send_signal(number)

    former = {}
    for name in _FORWARDED:
        number = getattr(signal, name)
        former[number] = signal.signal(number, forward)
    try:
        status = child.wait()
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)
    with open(ours, "rb") as pipe:  # noqa: PTH123 - a descriptor
        os.set_blocking(ours, False)
        message = pipe.read() or b""
    if message:
        return int(message), ""
    if stopped:
        return (128 - status if status < 0 else status) or 1, ""
    names = ", ".join(controllers)
    return 1, f"controller {names}: it ended Python ({describe_status(status)}) before the command was done"


def begin_supervised() -> int | None:
    """Return the descriptor for `report_status` if another process supervises this one, else None."""
    text = os.environ.pop(_DESCRIPTOR, None)
    if text is None:
        return None
    descriptor, parent = int(text), os.getppid()
    os.set_inheritable(descriptor, False)

    def end_with_parent() -> None:
        while os.getppid() == parent:
            threading.Event().wait(1.0)
        os.kill(os.getpid(), signal.SIGKILL)

    threading.Thread(target=end_with_parent, daemon=True).start()
    return descriptor


def report_status(descriptor: int, status: int) -> None:
    """Tell the supervising process that the command has ended properly, and how."""
    with suppress(OSError):
        os.write(descriptor, str(status).encode())


def describe_status(status: int) -> str:
    """Return how a process ended, from its status as `subprocess` has it.

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
