"""The tool for the density: hot spots by dragging, their weights by typing."""

from __future__ import annotations

import numpy as np

from robocov.arrays import Array
from robocov.environment import Point, Ring
from robocov_app.editor.edits.density import (
    peak_added,
    peak_moved,
    peak_removed,
    peak_sized,
    peak_weighed,
    peaks_of,
    spread_of,
    weight_of,
)
from robocov_app.editor.model.geometry import distance
from robocov_app.editor.model.selection import Change
from robocov_app.editor.tools.tool import PointerEvent, Preview, Tool, ToolContext, length_words

FIRST_WEIGHT = 4.0
"""What a new hot spot adds at its centre, until another weight is typed."""

_CORNERS = 64


class DensityTool(Tool):
    """Adds hot spots, moves, sizes and weighs them, and takes them away."""

    name = "density"
    title = "Density"
    hint = "drag from a hot spot's middle outwards; drag middles and rims; click a middle, type its weight"

    def __init__(self) -> None:
        super().__init__()
        self.weight = FIRST_WEIGHT
        self.chosen: int | None = None
        self.change: Change | None = None
        """What letting go of the mouse would make."""
        self._from: Point | None = None
        self._at: Point = (0.0, 0.0)
        self._taken: int | None = None
        self._sizes = False

    @property
    def busy(self) -> bool:
        """Whether something is dragged, or chosen: then digits are for it."""
        return self._from is not None or self.chosen is not None

    def press(self, context: ToolContext, event: PointerEvent) -> None:
        """Take hold of a middle or a rim, else begin a hot spot."""
        self._from, self._at, self.change = event.point, event.point, None
        self._taken, self._sizes = self._under(context, event)
        if self._taken is not None and not self._sizes:
            self.chosen = self._taken

    def move(self, context: ToolContext, event: PointerEvent) -> None:
        """Drag."""
        self._at = event.point
        if self._from is None or distance(self._from, event.raw) < 0.25 * event.reach:
            return
        self.change = self._wanted(context, event.point)

    def release(self, context: ToolContext, event: PointerEvent, *, clicked: bool) -> None:
        """Make what was dragged; a click on a middle chooses it, elsewhere nothing is chosen."""
        begun, change, self._from, self.change = self._from, self.change, None, None
        if begun is None:
            return
        if clicked or change is None:
            self.chosen = None if self._sizes else self._taken
            if self.chosen is not None:
                context.say("type what it weighs, then Enter; Backspace takes it away")
            return
        context.change(change)
        count = len(peaks_of(context.sketch))
        self.chosen = self._taken if self._taken is not None else count - 1

    def twice(self, context: ToolContext, event: PointerEvent) -> None:
        """Take it for a press."""
        self.press(context, event)

    def finish(self, context: ToolContext) -> bool:
        """Choose nothing any more."""
        had, self.chosen = self.chosen is not None, None
        return had

    def back(self, context: ToolContext) -> bool:
        """Take the chosen one away."""
        chosen, self.chosen = self.chosen, None
        if chosen is None or chosen >= len(peaks_of(context.sketch)):
            return False
        context.change(peak_removed(context.sketch, chosen))
        return True

    def cancel(self, context: ToolContext) -> bool:
        """Give up what is dragged, then choose nothing."""
        had = self.busy
        self._from = self.change = self.chosen = None
        return had

    def enter(self, context: ToolContext, text: str) -> None:
        """Give the chosen hot spot, or the next one, another weight."""
        weight = weight_of(text)
        if self.chosen is not None:
            context.change(peak_weighed(context.sketch, self.chosen, weight))
        self.weight = weight

    def preview(self, context: ToolContext) -> Preview | None:
        """Show all hot spots at one standard deviation, and what the dragged one will be."""
        peaks = peaks_of(self.change.sketch if self.change is not None else context.sketch)
        rings = tuple(_ellipse(peak.center, np.array(peak.matrix)) for peak in peaks)
        dots = tuple(peak.center for peak in peaks)
        words = ""
        if self._from is not None and self._taken is None:
            words = f"σ {length_words(distance(self._from, self._at))}, weight {self.weight:g}"
        elif self._from is not None and self._sizes and self._taken is not None:
            words = f"σ {length_words(spread_of(peaks[self._taken]))}"
        elif self.chosen is not None and self.chosen < len(peaks):
            words = f"weight {peaks[self.chosen].weight:g}"
        if not rings and not words:
            return None
        return Preview(words=words, rings=rings, dots=dots, chosen=self.chosen)

    def shape_of_cursor(self, context: ToolContext) -> str:
        """A move where something can be taken hold of."""
        return "move" if self._taken is not None and self._from is not None else "cross"

    def _under(self, context: ToolContext, event: PointerEvent) -> tuple[int | None, bool]:
        """Return the hot spot whose middle or rim is under the cursor, and whether it is the rim."""
        peaks = peaks_of(context.sketch)
        near = [(distance(peak.center, event.raw), k) for k, peak in enumerate(peaks)]
        if near and min(near)[0] < event.reach:
            return min(near)[1], False
        rims = [(abs(away - spread_of(peaks[k])), k) for away, k in near if peaks[k].sigma is not None]
        if rims and min(rims)[0] < 0.6 * event.reach:
            return min(rims)[1], True
        return None, False

    def _wanted(self, context: ToolContext, point: Point) -> Change | None:
        assert self._from is not None
        if self._taken is None:
            return peak_added(context.sketch, self._from, max(distance(self._from, point), 0.02), self.weight)
        if self._taken >= len(peaks_of(context.sketch)):
            return None
        if self._sizes:
            return peak_sized(
                context.sketch, self._taken, distance(peaks_of(context.sketch)[self._taken].center, point)
            )
        return peak_moved(context.sketch, self._taken, point)


def _ellipse(center: Point, covariance: Array) -> Ring:
    """Return the outline one standard deviation away from the centre."""
    turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
    points = np.column_stack([np.cos(turn), np.sin(turn)]) @ np.linalg.cholesky(covariance).T
    return tuple((x, y) for x, y in (points + np.array(center)).tolist())
