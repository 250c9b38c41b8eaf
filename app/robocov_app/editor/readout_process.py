"""The process that measures sketches for a `ReadoutWorker`: ``python -m robocov_app.editor.readout_process``.

It is told what has changed since the question before, so that much of what it has derived stays. Only the
newest question counts. It ends when its standard input does, which it does however its parent ends.
"""

from __future__ import annotations

import os
import threading
import traceback
from collections.abc import Iterable
from typing import BinaryIO

from robocov_app.editor.document import Item
from robocov_app.editor.readout import readout
from robocov_app.editor.readout_messages import Answer, Question
from robocov_app.live.messages import receive, send
from robocov_app.live.own_process import own_streams


class Process:
    """Reads questions, and answers the newest."""

    def __init__(self, source: BinaryIO, target: BinaryIO) -> None:
        self._source, self._target = source, target
        self._asked = threading.Condition()
        self._questions: list[Question] = []
        self._known: dict[int, Item] = {}

    def run(self) -> None:
        """Go on for ever; reading ends the process."""
        threading.Thread(target=self._read, daemon=True).start()
        while True:
            with self._asked:
                self._asked.wait_for(lambda: self._questions)
                questions, self._questions = self._questions, []
            answer = self.answer(questions)
            try:
                send(self._target, answer)
            except OSError:
                os._exit(0)

    def answer(self, questions: Iterable[Question]) -> Answer:
        """Learn from all questions, one at least, and answer the last."""
        for question in questions:
            self._known |= {item.key: item for item in question.changed}
            self._known = {key: self._known[key] for key in question.order}
        try:
            return Answer(question.number, readout(question.sketch(self._known), question.radius))
        except Exception as error:
            # geometry may fail in ways that nobody has foreseen: the window is not to end for that
            traceback.print_exc()
            return Answer(question.number, None, f"the map could not be measured: {error}")

    def _read(self) -> None:
        while (question := receive(self._source)) is not None:
            with self._asked:
                self._questions.append(question)
                self._asked.notify()
        os._exit(0)


def main() -> None:
    """Talk to the parent, which after Ctrl-C closes the pipe."""
    Process(*own_streams()).run()


if __name__ == "__main__":
    main()
