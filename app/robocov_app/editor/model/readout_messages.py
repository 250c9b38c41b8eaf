"""Messages to the process that measures a window's sketch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from robocov_app.editor.model.document import Item, Sketch


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
