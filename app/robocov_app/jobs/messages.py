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
    """Interface of a service: a callable that answers questions.

    Attributes
    ----------
    failure_message : str
        Beginning of the message on an unexpected error, such as ``the map could not be measured``.
    """

    failure_message: str

    def __call__(self, questions: list[Any], channel: Channel) -> object:
        """Answer the newest question.

        Parameters
        ----------
        questions : list
            All questions since the last answer, at least one. Only the last one needs an answer.
        channel : Channel
            Channel for newer questions and for progress.
        """


class Codec:
    """Converts questions before they are sent, and answers after they are received.

    This base class leaves them unchanged. Each process has its own codec. Questions are converted in one
    thread and answers in another, each in order.
    """

    def encode(self, question: Any) -> object:
        """Convert a question to the object that is sent."""
        return question

    def decode(self, answer: Any) -> Any:
        """Convert a received object to the answer."""
        return answer


class Channel:
    """Connection of a working service to its program: it receives newer questions and sends progress."""

    def get_newer_questions(self) -> list[Any]:
        """Return the questions that have arrived since the service started to work."""
        return []

    def report_progress(self, progress: object) -> None:
        """Report the progress of the current question."""


@dataclass(frozen=True, eq=False)
class Reply:
    """The reply to a question.

    Attributes
    ----------
    number : int
        Number of the question.
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
    """Progress of the answer to a question, sent before the reply.

    Attributes
    ----------
    number : int
        Number of the question.
    value : object
        The progress, as reported by the service.
    """

    number: int
    value: Any


def answer_questions(service: Service, questions: list[tuple[int, Any]], channel: Channel) -> Reply:
    """Ask a service for its answer, and turn errors into replies.

    Parameters
    ----------
    service : Service
        The service.
    questions : list of (int, object)
        Numbered questions, oldest first.
    channel : Channel
        Channel of the service for newer questions and for progress.

    Returns
    -------
    Reply
        Reply to the newest question. An error becomes its `problem`, so that it does not crash the window.
    """
    number = questions[-1][0]
    try:
        return Reply(number, service([question for _, question in questions], channel))
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
