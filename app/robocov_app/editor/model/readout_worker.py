"""The readout of a sketch beside a window that must not wait: asked for in one frame, there in another."""

from __future__ import annotations

from robocov.robots import DEFAULT_RADIUS
from robocov_app.editor.model.document import Item, Sketch
from robocov_app.editor.model.readout import Readout
from robocov_app.editor.model.readout_messages import Question
from robocov_app.live.latest import LatestWorker


class ReadoutWorker(LatestWorker[Readout]):
    """Readouts in a process of its own.

    Examples
    --------
    ::

        with ReadoutWorker() as worker:
            worker.ask(history.sketch, radius)      # whenever the sketch has changed
            while running:
                readout = worker.poll() or readout  # in every frame
    """

    def __init__(self) -> None:
        super().__init__("robocov_app.editor.model.readout_process", "measures the map", _Teller)
        self._asked: tuple[Sketch, float] | None = None

    def ask(self, sketch: Sketch, radius: float = DEFAULT_RADIUS) -> None:
        """Ask about a sketch; asking again about the same does nothing."""
        before = self._asked
        if self.lives and before is not None and before[0] is sketch and before[1] == radius:
            return
        self._asked = sketch, radius
        self.put(self._asked)


class _Teller:
    """Tells a process of each sketch only what is new."""

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def __call__(self, asked: tuple[Sketch, float]) -> Question:
        sketch, radius = asked
        question = Question.about(sketch, radius, self._known)
        self._known = {item.key: item for item in sketch.obstacles}
        return question
