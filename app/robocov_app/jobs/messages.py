"""Messages between a program and the processes of its services."""

from __future__ import annotations

import pickle
import traceback
from dataclasses import dataclass
from typing import IO, Any, Protocol

from robocov.errors import RobocovError

READY = "ready"
"""First message of a process, when its service is loaded."""


class Service(Protocol):
    """Answers questions.

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


class Wire:
    """Translates questions and answers; used by threads, in order. Each process has a wire of its own."""

    def encode(self, question: Any) -> object:
        """Return a question as it is sent."""
        return question

    def decode(self, answer: Any) -> Any:
        """Return the answer that was received."""
        return answer


class Channel:
    """Channel of a service while it works: newer questions in, progress out."""

    def get_newer_questions(self) -> list[Any]:
        """Return the questions that have arrived since the service started to work."""
        return []

    def report_progress(self, progress: object) -> None:
        """Report progress."""


@dataclass(frozen=True, eq=False)
class Reply:
    """The reply to a question.

    Attributes
    ----------
    number : int
        Number of the question.
    answer : object
        The answer; None if there is none. Of a reply that is not final, the progress.
    problem : str
        Reason why there is no answer.
    is_final : bool
        Whether it is the answer, rather than progress.
    """

    number: int
    answer: Any
    problem: str = ""
    is_final: bool = True


def answer_questions(service: Service, questions: list[tuple[int, Any]], channel: Channel) -> Reply:
    """Let a service answer questions.

    Parameters
    ----------
    service : Service
    questions : list of (int, object)
        Numbers and questions.
    channel : Channel

    Returns
    -------
    Reply
        An unexpected error is part of the reply, so that it does not end the window.
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
    """Write one message."""
    stream.write(pickle.dumps(message, protocol=pickle.HIGHEST_PROTOCOL))
    stream.flush()


def receive(stream: IO[bytes]) -> Any:
    """Read one message; None at the end of the stream, also in the middle of a message."""
    try:
        return pickle.load(stream)
    except (EOFError, pickle.UnpicklingError):
        return None
