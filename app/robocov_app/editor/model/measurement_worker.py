"""Measurements of a sketch in a process of its own, beside a window that must not wait.

The process is told what has changed since the question before, so that much of what it has derived stays.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from robocov.robots import DEFAULT_RADIUS
from robocov_app.editor.model.measurement import Measurement, measure
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.live.latest import LatestWorker, Service


@dataclass(frozen=True, eq=False)
class Question:
    """What is a sketch like?

    Attributes
    ----------
    rest : Sketch
        Without its obstacles.
    order : tuple of int
        The keys of its obstacles.
    changed : tuple of Item
        Those that differ from what the process knows by the same key.
    radius : float, m
    """

    rest: Sketch
    order: tuple[int, ...]
    changed: tuple[Item, ...]
    radius: float

    @classmethod
    def about(cls, sketch: Sketch, radius: float, known: Mapping[int, Item]) -> Question:
        """Return the question about a sketch for a process that knows some obstacles."""
        changed = tuple(item for item in sketch.obstacles if known.get(item.key) is not item)
        order = tuple(item.key for item in sketch.obstacles)
        return cls(replace(sketch, obstacles=()), order, changed, radius)

    def sketch(self, known: Mapping[int, Item]) -> Sketch:
        """Return the sketch that it is about, for a process that knows all its obstacles by now."""
        return replace(self.rest, obstacles=tuple(known[key] for key in self.order))


class Measuring:
    """Measures sketches of which it is told what is new."""

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def __call__(self, questions: Iterable[Question]) -> Measurement:
        """Learn from all questions, one at least, and answer the last."""
        for question in questions:
            self._known |= {item.key: item for item in question.changed}
            self._known = {key: self._known[key] for key in question.order}
        return measure(question.sketch(self._known), question.radius)


SERVICE = Service(Measuring(), "the map could not be measured")


class MeasurementWorker(LatestWorker[Measurement]):
    """Measurements in a process of its own.

    Examples
    --------
    ::

        with MeasurementWorker() as worker:
            worker.ask(history.sketch, radius)      # whenever the sketch has changed
            while running:
                measurement = worker.poll() or measurement  # in every frame
    """

    def __init__(self) -> None:
        super().__init__("robocov_app.editor.model.measurement_worker", "measures the map", _Teller)
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


if __name__ == "__main__":
    SERVICE.serve()
