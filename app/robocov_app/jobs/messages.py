"""Messages between a program and the processes of its services."""

from __future__ import annotations

import pickle
import traceback
from dataclasses import dataclass
from typing import IO, Any, Protocol

from robocov.errors import RobocovError

READY = "ready"
"""First message from a process, sent when its service is loaded."""


class Service(Protocol):
    """Interface of a service: a callable that answers requests.

    Attributes
    ----------
    failure_message : str
        Beginning of the message on an unexpected error, such as ``the map could not be measured``.
    """

    failure_message: str

    def __call__(self, requests: list[Any], channel: Channel) -> object:
        """Answer the newest request.

        Parameters
        ----------
        requests : list
            All requests since the last answer, at least one. Only the last one needs an answer.
        channel : Channel
            Channel for newer requests and for progress.
        """


class Codec:
    """Converts requests before they are sent, and answers after they are received.

    This base class leaves them unchanged. Each process has its own codec. Requests are converted in one
    thread and answers in another, each in order.
    """

    def encode(self, request: Any) -> object:
        """Convert a request to the object that is sent."""
        return request

    def decode(self, answer: Any) -> Any:
        """Convert a received object to the answer."""
        return answer


class Channel:
    """Connection of a working service to its program: it receives newer requests and sends progress."""

    def get_newer_requests(self) -> list[Any]:
        """Return the requests that have arrived since the service started to work."""
        return []

    def report_progress(self, progress: object) -> None:
        """Report the progress of the current request."""


@dataclass(frozen=True, eq=False)
class Reply:
    """The reply to a request.

    Attributes
    ----------
    number : int
        Number of the request.
    answer : object
        The answer, or None if there is none.
    problem : str
        Reason why there is no answer.
    """

    number: int
    answer: Any
    problem: str = ""


@dataclass(frozen=True, eq=False)
class Progress:
    """Progress of the answer to a request, sent before the reply.

    Attributes
    ----------
    number : int
        Number of the request.
    value : object
        The progress, as reported by the service.
    """

    number: int
    value: Any


def answer_requests(service: Service, requests: list[tuple[int, Any]], channel: Channel) -> Reply:
    """Ask a service for its answer, and turn errors into replies.

    Parameters
    ----------
    service : Service
        The service.
    requests : list of (int, object)
        Numbered requests, oldest first.
    channel : Channel
        Channel of the service for newer requests and for progress.

    Returns
    -------
    Reply
        Reply to the newest request. An error becomes its `problem`, so that it does not crash the window.
    """
    number = requests[-1][0]
    try:
        return Reply(number, service([request for _, request in requests], channel))
    except RobocovError as error:
        return Reply(number, None, str(error))
    except Exception as error:
        traceback.print_exc()
        return Reply(number, None, f"{service.failure_message}: {error}")


def send(stream: IO[bytes], message: object) -> None:
    """Write one message to a stream."""
    stream.write(pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL))
    stream.flush()


def receive(stream: IO[bytes]) -> Any:
    """Read one message from a stream; return None if the stream ends, even within a message."""
    try:
        return pickle.load(stream)
    except (EOFError, pickle.UnpicklingError):
        return None
