"""What a desk snaps to: of small maps known at once, of large ones worked out beside the window."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from typing import TYPE_CHECKING

from robocov_app.editor.tools.targets import Targets

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from robocov.environment import Point
    from robocov_app.editor.model.document import Owner, Sketch
    from robocov_app.editor.model.selection import Vertex

MANY = 1500
"""Vertices of a map from which on the window does not wait for its targets."""


def vertex_count(sketch: Sketch) -> int:
    """Return about how many vertices a sketch has."""
    shapes = (item.shape for item in sketch.obstacles)
    return sum(len(getattr(shape, "vertices", getattr(shape, "points", ()))) for shape in shapes)


class Snapper:
    """Keeps the targets that were asked for last.

    Attributes
    ----------
    patient : bool
        Wait for the targets of large maps too.
    """

    def __init__(self) -> None:
        self.patient = False
        self._sketch: Sketch | None = None
        self._key: object = None
        self._known: Targets | None = None
        self._coming: Future[Targets] | None = None
        self._pool: ThreadPoolExecutor | None = None

    def targets(
        self, sketch: Sketch, without: Iterable[Owner | Vertex] = (), more: Sequence[Point] = ()
    ) -> Targets | None:
        """Return what to snap to; None as long as that is being worked out."""
        without, more = frozenset(without), tuple(more)
        if self._sketch is not sketch or self._key != (without, more):
            self._sketch, self._key = sketch, (without, more)
            self._known, self._coming = None, None
            if self.patient or vertex_count(sketch) < MANY:
                self._known = Targets(sketch, without, more)
            else:
                self._pool = self._pool or ThreadPoolExecutor(1, "targets")
                self._coming = self._pool.submit(Targets, sketch, without, more)
        if self._known is None and self._coming is not None and self._coming.done():
            self._known = self._coming.result()
        return self._known

    def close(self) -> None:
        """End."""
        if self._pool is not None:
            self._pool.shutdown(cancel_futures=True)
