"""Measurements of a sketch in a process beside the window, which is told only what has changed."""

from __future__ import annotations

from dataclasses import dataclass, replace

from robocov_app.editor.model.measurement import Measurement, measure
from robocov_app.editor.model.sketch import Item, Sketch
from robocov_app.toolkit.worker import DirectWorker, LatestWorker, Line, Wire, Worker


@dataclass(frozen=True, eq=False)
class Question:
    """What is a sketch like?"""

    rest: Sketch  # without its obstacles
    order: tuple[int, ...]  # the keys of its obstacles
    changed: tuple[Item, ...]  # those that differ from what the process knows by the same key
    radius: float  # m


class MeasurementWire(Wire):
    """Tells a process of each sketch only what is new."""

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def encode(self, question: tuple[Sketch, float]) -> Question:
        """Return the question about a sketch, for robots of a radius in m."""
        sketch, radius = question
        known, self._known = self._known, {item.key: item for item in sketch.obstacles}
        changed = tuple(item for item in sketch.obstacles if known.get(item.key) is not item)
        return Question(replace(sketch, obstacles=()), tuple(self._known), changed, radius)


class Measuring:
    """Measures sketches of which it is told what is new."""

    failing = "the map could not be measured"

    def __init__(self) -> None:
        self._known: dict[int, Item] = {}

    def __call__(self, questions: list[Question], line: Line) -> Measurement:
        """Learn from all questions, and answer the last."""
        for question in questions:
            self._known |= {item.key: item for item in question.changed}
            self._known = {key: self._known[key] for key in question.order}
        last = questions[-1]
        return measure(replace(last.rest, obstacles=tuple(self._known.values())), last.radius)


def measurement_worker(*, direct: bool = False) -> Worker[Measurement]:
    """Return what measures sketches, asked by (sketch, radius), in another process or at once in this one."""
    if direct:
        return DirectWorker(Measuring(), MeasurementWire())
    service = "robocov_app.editor.model.measurement_worker:Measuring"
    return LatestWorker(service, "measures the map", MeasurementWire)
