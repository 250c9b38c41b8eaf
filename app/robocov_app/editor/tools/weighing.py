"""The tool for the density: hot spots by dragging, their weights by typing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robocov_app.editor.edits.densities import (
    peak_added,
    peak_moved,
    peak_removed,
    peak_sized,
    peak_weighed,
    peaks_of,
    spread_of,
    weight_of,
)
from robocov_app.editor.tools.tool import Preview, Tool, apart, length_words

if TYPE_CHECKING:
    from robocov.arrays import Array
    from robocov.environment import Point, Ring
    from robocov_app.editor.model.selection import Change
    from robocov_app.editor.tools.tool import Aim
    from robocov_app.editor.ui.desk import Desk

FIRST_WEIGHT = 4.0
"""What a new hot spot adds at its centre, until another weight is typed."""

_CORNERS = 64


class Weighing(Tool):
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

    def press(self, desk: Desk, aim: Aim) -> None:
        """Take hold of a middle or a rim, else begin a hot spot."""
        self._from, self._at, self.change = aim.point, aim.point, None
        self._taken, self._sizes = self._under(desk, aim)
        if self._taken is not None and not self._sizes:
            self.chosen = self._taken

    def move(self, desk: Desk, aim: Aim) -> None:
        """Drag."""
        self._at = aim.point
        if self._from is None or apart(self._from, aim.raw) < 0.25 * aim.reach:
            return
        self.change = self._wanted(desk, aim.point)

    def release(self, desk: Desk, aim: Aim, *, clicked: bool) -> None:
        """Make what was dragged; a click on a middle chooses it, elsewhere nothing is chosen."""
        begun, change, self._from, self.change = self._from, self.change, None, None
        if begun is None:
            return
        if clicked or change is None:
            self.chosen = None if self._sizes else self._taken
            if self.chosen is not None:
                desk.say("type what it weighs, then Enter; Backspace takes it away")
            return
        desk.change(change)
        count = len(peaks_of(desk.sketch))
        self.chosen = self._taken if self._taken is not None else count - 1

    def twice(self, desk: Desk, aim: Aim) -> None:
        """Take it for a press."""
        self.press(desk, aim)

    def finish(self, desk: Desk) -> bool:
        """Choose nothing any more."""
        had, self.chosen = self.chosen is not None, None
        return had

    def back(self, desk: Desk) -> bool:
        """Take the chosen one away."""
        chosen, self.chosen = self.chosen, None
        if chosen is None or chosen >= len(peaks_of(desk.sketch)):
            return False
        desk.change(peak_removed(desk.sketch, chosen))
        return True

    def cancel(self, desk: Desk) -> bool:
        """Give up what is dragged, then choose nothing."""
        had = self.busy
        self._from = self.change = self.chosen = None
        return had

    def enter(self, desk: Desk, text: str) -> None:
        """Give the chosen hot spot, or the next one, another weight."""
        weight = weight_of(text)
        if self.chosen is not None:
            desk.change(peak_weighed(desk.sketch, self.chosen, weight))
        self.weight = weight

    def preview(self, desk: Desk) -> Preview | None:
        """Show all hot spots at one standard deviation, and what the dragged one will be."""
        peaks = peaks_of(self.change.sketch if self.change is not None else desk.sketch)
        rings = tuple(_ellipse(peak.center, np.array(peak.matrix)) for peak in peaks)
        dots = tuple(peak.center for peak in peaks)
        words = ""
        if self._from is not None and self._taken is None:
            words = f"σ {length_words(apart(self._from, self._at))}, weight {self.weight:g}"
        elif self._from is not None and self._sizes and self._taken is not None:
            words = f"σ {length_words(spread_of(peaks[self._taken]))}"
        elif self.chosen is not None and self.chosen < len(peaks):
            words = f"weight {peaks[self.chosen].weight:g}"
        if not rings and not words:
            return None
        return Preview(words=words, rings=rings, dots=dots, chosen=self.chosen)

    def shape_of_cursor(self, desk: Desk) -> str:
        """A move where something can be taken hold of."""
        return "move" if self._taken is not None and self._from is not None else "cross"

    def _under(self, desk: Desk, aim: Aim) -> tuple[int | None, bool]:
        """Return the hot spot whose middle or rim is under the cursor, and whether it is the rim."""
        peaks = peaks_of(desk.sketch)
        near = [(apart(peak.center, aim.raw), k) for k, peak in enumerate(peaks)]
        if near and min(near)[0] < aim.reach:
            return min(near)[1], False
        rims = [(abs(away - spread_of(peaks[k])), k) for away, k in near if peaks[k].sigma is not None]
        if rims and min(rims)[0] < 0.6 * aim.reach:
            return min(rims)[1], True
        return None, False

    def _wanted(self, desk: Desk, point: Point) -> Change | None:
        assert self._from is not None
        if self._taken is None:
            return peak_added(desk.sketch, self._from, max(apart(self._from, point), 0.02), self.weight)
        if self._taken >= len(peaks_of(desk.sketch)):
            return None
        if self._sizes:
            return peak_sized(
                desk.sketch, self._taken, apart(peaks_of(desk.sketch)[self._taken].center, point)
            )
        return peak_moved(desk.sketch, self._taken, point)


def _ellipse(center: Point, covariance: Array) -> Ring:
    """Return the outline one standard deviation away from the centre."""
    turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS, endpoint=False)
    points = np.column_stack([np.cos(turn), np.sin(turn)]) @ np.linalg.cholesky(covariance).T
    return tuple((x, y) for x, y in (points + np.array(center)).tolist())
