"""What a window and the process that measures its sketch say to each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robocov_app.editor.document import Item, Sketch
    from robocov_app.editor.readout import Readout


@dataclass(frozen=True, eq=False)
class Question:
    """What is a sketch like?

    Attributes
    ----------
    number : int
        Counts the questions.
    rest : Sketch
        Without its obstacles.
    order : tuple of int
        The keys of its obstacles.
    changed : tuple of Item
        Those that differ from what the process knows by the same key.
    radius : float, m
    """

    number: int
    rest: Sketch
    order: tuple[int, ...]
    changed: tuple[Item, ...]
    radius: float

    @classmethod
    def about(cls, number: int, sketch: Sketch, radius: float, known: Mapping[int, Item]) -> Question:
        """Return the question about a sketch for a process that knows some obstacles."""
        changed = tuple(item for item in sketch.obstacles if known.get(item.key) is not item)
        order = tuple(item.key for item in sketch.obstacles)
        return cls(number, replace(sketch, obstacles=()), order, changed, radius)

    def sketch(self, known: Mapping[int, Item]) -> Sketch:
        """Return the sketch that it is about, for a process that knows all its obstacles by now."""
        return replace(self.rest, obstacles=tuple(known[key] for key in self.order))


@dataclass(frozen=True, eq=False)
class Answer:
    """What a sketch is like; or in words why that is not known."""

    number: int
    readout: Readout | None
    trouble: str = ""
