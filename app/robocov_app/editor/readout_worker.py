"""The readout of a sketch beside a window that must not wait: asked for in one frame, there in another."""

from __future__ import annotations

from types import TracebackType

from robocov.robots import DEFAULT_RADIUS
from robocov_app.editor.document import Item, Sketch
from robocov_app.editor.readout import Readout
from robocov_app.editor.readout_messages import Answer, Question
from robocov_app.live.talk import Talk


class ReadoutWorker:
    """Readouts in a process of its own. No call waits for it; only the newest question counts.

    After the process has ended, for whatever reason, the next question starts another one.

    Examples
    --------
    ::

        with ReadoutWorker() as worker:
            worker.ask(history.sketch, radius)      # whenever the sketch has changed
            while running:
                readout = worker.poll() or readout  # in every frame
    """

    def __init__(self) -> None:
        self._asked: tuple[Sketch, float] | None = None
        self._number = 0
        self._answered = 0
        self._talk: _Talk | None = None
        self._trouble = ""

    def ask(self, sketch: Sketch, radius: float = DEFAULT_RADIUS) -> None:
        """Ask about a sketch; asking again about the same does nothing."""
        talk = self._talk
        lives = talk is not None and not talk.ended
        if lives and self._asked is not None and self._asked[0] is sketch and self._asked[1] == radius:
            return
        if talk is None or talk.ended:
            if talk is not None:
                talk.close()
            talk = self._talk = _Talk()
        self._asked = sketch, radius
        self._number += 1
        talk.ask(self._number, sketch, radius)

    def poll(self) -> Readout | None:
        """Return the newest answer since the last call; None if there is none."""
        if self._talk is None:
            return None
        ended = self._talk.ended
        answer = self._talk.heard()
        if answer is not None:
            self._answered, self._trouble = answer.number, answer.trouble
        elif ended and self.busy:
            self._answered, self._trouble = self._number, "the process that measures the map has ended"
        return None if answer is None else answer.readout

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

    def __enter__(self) -> ReadoutWorker:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Talk(Talk):
    """A talk about the newest sketch; of each only what is new is told."""

    def __init__(self) -> None:
        self._wanted: tuple[int, Sketch, float] | None = None
        self._answer: Answer | None = None
        self._known: dict[int, Item] = {}
        super().__init__("robocov_app.editor.readout_process")

    def ask(self, number: int, sketch: Sketch, radius: float) -> None:
        with self.changed:
            self._wanted = number, sketch, radius
            self.changed.notify()

    def heard(self) -> Answer | None:
        """Return the newest answer, once."""
        with self.changed:
            answer, self._answer = self._answer, None
            return answer

    def taken(self) -> tuple[int, Sketch, float] | None:
        wanted, self._wanted = self._wanted, None
        return wanted

    def messages(self, taken: tuple[int, Sketch, float]) -> list[Question]:
        number, sketch, radius = taken
        question = Question.about(number, sketch, radius, self._known)
        self._known = {item.key: item for item in sketch.obstacles}
        return [question]

    def hear(self, message: Answer) -> None:
        with self.changed:
            self._answer = message
