"""Main loop of the process of a service, which answers requests until its program ends."""

from __future__ import annotations

import ctypes
import faulthandler
import importlib
import os
import signal
import sys
import threading
from contextlib import suppress
from typing import Any, BinaryIO

from robocov_app.jobs.messages import READY, Channel, Progress, answer_requests, receive, send

_STDIN = 0
_STDOUT = 1
_STDERR = 2
"""File descriptors of the standard streams."""
_SET_DEATH_SIGNAL = 1
"""Value of PR_SET_PDEATHSIG in Linux: the signal that a process receives when its parent ends."""


class _PipeChannel(Channel):
    """Channel of a service over two pipes, to and from its program."""

    def __init__(self, source: BinaryIO, target: BinaryIO) -> None:
        self._source = source
        self._target = target
        self._has_requests = threading.Condition()
        self._requests: list[tuple[int, Any]] = []
        self._number = 0

    def get_newer_requests(self) -> list[Any]:
        """Return the requests that have arrived since the service started to work."""
        return [request for _, request in self._requests]

    def report_progress(self, progress: object) -> None:
        """Send the progress of the current request."""
        self.send(Progress(self._number, progress))

    def send(self, message: object) -> None:
        """Send a message, or end the process if its program has ended."""
        try:
            send(self._target, message)
        except OSError:
            os._exit(0)

    def wait_for_requests(self) -> list[tuple[int, Any]]:
        """Wait until there is a request, and return all new requests with their numbers."""
        with self._has_requests:
            self._has_requests.wait_for(lambda: self._requests)
            requests = self._requests
            self._requests = []
        self._number = requests[-1][0]
        return requests

    def listen(self) -> None:
        """Collect incoming requests, and exit the process when the input ends; the target of a thread."""
        while True:
            request = receive(self._source)
            if request is None:
                os._exit(0)
            with self._has_requests:
                self._requests.append(request)
                self._has_requests.notify()


def serve(service: str) -> None:
    """Load a service, and answer requests until the standard input is closed.

    The standard input is closed when the program ends, even if it crashes.

    Parameters
    ----------
    service : str
        Class of the service as ``package.module:Class``.
    """
    prepare_process()
    source, target = take_standard_streams()
    channel = _PipeChannel(source, target)
    threading.Thread(target=channel.listen, daemon=True).start()
    module, _, name = service.partition(":")
    answering_service = getattr(importlib.import_module(module), name)()
    channel.send(READY)
    while True:
        requests = channel.wait_for_requests()
        channel.send(answer_requests(answering_service, requests, channel))


def prepare_process() -> None:
    """Report crashes, end when the parent program ends, and ignore Ctrl+C, which the parent handles.

    The process of a service calls this function first.
    """
    if sys.version_info >= (3, 14):
        # The C stack of the physics engine would hide the Python stack of a user's code.
        faulthandler.enable(c_stack=False)
    else:
        faulthandler.enable()
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).prctl(_SET_DEATH_SIGNAL, signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def take_standard_streams() -> tuple[BinaryIO, BinaryIO]:
    """Return the input and output pipes, and detach the standard streams from them.

    Code that prints then writes to standard error instead of into the messages, and code that reads standard
    input gets no data.
    """
    source = os.fdopen(os.dup(_STDIN), "rb")
    target = os.fdopen(os.dup(_STDOUT), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), _STDIN)
    os.dup2(_STDERR, _STDOUT)
    return source, target
