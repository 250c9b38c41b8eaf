"""The process that measures sketches for a `ReadoutWorker`.

It is told what has changed since the question before, so that much of what it has derived stays.
"""

from __future__ import annotations

from collections.abc import Iterable

from robocov_app.editor.model.document import Item
from robocov_app.editor.model.readout import Readout, readout
from robocov_app.editor.model.readout_messages import Question
from robocov_app.live.latest import Service


class Measuring:
    """Measures sketches of which it is told what is new."""

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def __call__(self, questions: Iterable[Question]) -> Readout:
        """Learn from all questions, one at least, and answer the last."""
        for question in questions:
            self._known |= {item.key: item for item in question.changed}
            self._known = {key: self._known[key] for key in question.order}
        return readout(question.sketch(self._known), question.radius)


SERVICE = Service(Measuring(), "the map could not be measured")

if __name__ == "__main__":
    SERVICE.serve()
