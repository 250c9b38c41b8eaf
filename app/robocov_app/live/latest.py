"""Questions answered in a process of its own, beside a window that must not wait; only the newest counts."""

from __future__ import annotations

import math
import os
import threading
import time
import traceback
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, BinaryIO, Generic, TypeAlias, TypeVar

from robocov.errors import RobocovError
from robocov_app.live.messages import receive, send
from robocov_app.live.own_process import own_streams
from robocov_app.live.talk import Talk

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType
    from typing import Self

_Answer = TypeVar("_Answer")

_Tell: TypeAlias = "Callable[[Any], object]"


@dataclass(frozen=True, eq=False)
class Reply:
    """The answer to a question; or in words why there is none."""

    number: int
    answer: Any
    trouble: str = ""


class LatestWorker(Generic[_Answer]):
    """A process that answers questions. No call waits for it; only the newest question counts.

    After the process has ended, for whatever reason, the next question starts another one.

    Parameters
    ----------
    module : str
        What the process runs: it calls `Service.serve`.
    doing : str
        What it does, for people: ``measures the map``.
    teller : callable or None
        Gives for each new process what turns a question into what that one is told; None tells it as it is.
        It is called on a thread, for the questions in their order.
    patience : float, s
        A process that has worked longer on an older question than that is ended for a newer one.
    """

    def __init__(
        self,
        module: str,
        doing: str,
        teller: Callable[[], _Tell] | None = None,
        *,
        patience: float = math.inf,
    ) -> None:
        self._module, self._doing, self._teller, self._patience = module, doing, teller, patience
        self._since = 0.0
        self._number = 0
        self._answered = 0
        self._talk: _Talk | None = None
        self._trouble = ""

    @property
    def lives(self) -> bool:
        """Whether there is a process."""
        return self._talk is not None and not self._talk.ended

    def put(self, question: object) -> None:
        """Ask; an older question that is not answered yet is not wanted any more."""
        now = time.monotonic()
        if not self.busy:
            self._since = now
        talk = self._talk
        if talk is None or talk.ended or now - self._since > self._patience:
            self.close()
            self._since = now
            talk = self._talk = _Talk(self._module, self._teller() if self._teller else None)
        self._number += 1
        talk.ask(self._number, question)

    def poll(self) -> _Answer | None:
        """Return the newest answer since the last call; None if there is none."""
        if self._talk is None:
            return None
        ended = self._talk.ended
        reply = self._talk.heard()
        if reply is not None:
            self._answered, self._trouble = reply.number, reply.trouble
        elif ended and self.busy:
            self._answered, self._trouble = self._number, f"the process that {self._doing} has ended"
        return None if reply is None else reply.answer

    @property
    def busy(self) -> bool:
        """Whether the newest question is not answered yet."""
        return self._answered < self._number

    @property
    def trouble(self) -> str:
        """Why the last question was not answered, in words; empty if it was."""
        return self._trouble

    def close(self) -> None:
        """End the process."""
        if self._talk is not None:
            self._talk.close()
            self._talk = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Talk(Talk):
    """A talk about the newest question."""

    def __init__(self, module: str, tell: _Tell | None) -> None:
        self._wanted: tuple[int, object] | None = None
        self._reply: Reply | None = None
        self._tell = tell
        super().__init__(module)

    def ask(self, number: int, question: object) -> None:
        with self.changed:
            self._wanted = number, question
            self.changed.notify()

    def heard(self) -> Reply | None:
        """Return the newest reply, once."""
        with self.changed:
            reply, self._reply = self._reply, None
            return reply

    def taken(self) -> tuple[int, object] | None:
        wanted, self._wanted = self._wanted, None
        return wanted

    def messages(self, taken: tuple[int, object]) -> list[tuple[int, object]]:
        number, question = taken
        return [(number, question if self._tell is None else self._tell(question))]

    def hear(self, message: Reply) -> None:
        with self.changed:
            self._reply = message


class Service:
    """The process's side: reads questions, and answers the newest.

    Parameters
    ----------
    answer : callable
        Takes the questions that have come since the last answer, and answers the last of them.
    failing : str
        What is said where that fails unforeseen: ``the map could not be measured``.
    """

    def __init__(self, answer: Callable[[list[Any]], object], failing: str) -> None:
        self._answer, self._failing = answer, failing
        self._asked = threading.Condition()
        self._questions: list[tuple[int, Any]] = []

    def serve(self) -> None:
        """Go on for ever; the process ends when its standard input does, however its parent ends."""
        source, target = own_streams()
        threading.Thread(target=self._read, args=(source,), daemon=True).start()
        while True:
            with self._asked:
                self._asked.wait_for(lambda: self._questions)
                questions, self._questions = self._questions, []
            try:
                send(target, self.reply(questions))
            except OSError:
                os._exit(0)

    def reply(self, questions: list[tuple[int, Any]]) -> Reply:
        """Return the reply to numbered questions, one at least."""
        number = questions[-1][0]
        try:
            return Reply(number, self._answer([question for _, question in questions]))
        except RobocovError as error:
            return Reply(number, None, str(error))
        except Exception as error:
            # what nobody has foreseen is not to end the window
            traceback.print_exc()
            return Reply(number, None, f"{self._failing}: {error}")

    def _read(self, source: BinaryIO) -> None:
        while (question := receive(source)) is not None:
            with self._asked:
                self._questions.append(question)
                self._asked.notify()
        os._exit(0)


class DirectWorker(Generic[_Answer]):
    """A `LatestWorker` that answers at once: for pictures without a display, and for tests."""

    busy = False

    def __init__(self, service: Service) -> None:
        self._service = service
        self._reply = Reply(0, None)

    @property
    def trouble(self) -> str:
        """Why the last question was not answered."""
        return self._reply.trouble

    def put(self, question: object) -> None:
        """Ask."""
        self._reply = self._service.reply([(0, question)])

    def poll(self) -> _Answer | None:
        """Return the answer, once."""
        answer: _Answer | None = self._reply.answer
        self._reply = Reply(0, None, self._reply.trouble)
        return answer

    def close(self) -> None:
        """There is nothing to end."""
