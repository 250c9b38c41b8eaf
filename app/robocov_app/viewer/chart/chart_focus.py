"""The keyboard focus in the chart: time slider, branches, and the button that plots the other quantity."""

from pygame import Rect, Surface

from robocov_app.toolkit.keyboard_focus import BasicFocusGroup
from robocov_app.toolkit.widgets.appearance import draw_ring
from robocov_app.viewer.chart.branch_tree import BranchLine
from robocov_app.viewer.chart.chart import Chart

_SLIDER = "time"
_SWITCH = "quantity"
_SLIDER_MARGIN_PX = 10.0
"""Distance of the ring from the ends of the time slider, at scale 1."""


class ChartFocus(BasicFocusGroup):
    """Gives the focus to parts of the chart: time slider, button and branches.

    The arrow keys always move the time, so the time slider needs no keys of its own.

    Parameters
    ----------
    chart : Chart
    """

    def __init__(self, chart: Chart) -> None:
        super().__init__()
        self._chart = chart

    def list_focusable_keys(self) -> list[str]:
        """Return the parts that can have the focus, in the order of Tab."""
        branches = [_name_branch(line) for line in self._chart.branch_lines]
        if self._chart.switch_box is None:
            return [_SLIDER, *branches]
        return [_SLIDER, _SWITCH, *branches]

    def activate(self, key: str) -> bool:
        """Plot the other quantity, or go to the branch with the focus; return whether anything was done."""
        viewer = self._chart.viewer
        if key == _SWITCH:
            viewer.attempt(self._chart.switch_quantity)
            return True
        line = self._find_line()
        if line is None:
            return False
        self.focus = _SLIDER
        viewer.attempt(lambda: viewer.playback.go_to_node(line.node))
        return True

    def _find_line(self) -> BranchLine | None:
        """Return the line of the branch with the focus; None if no branch has it."""
        lines = self._chart.branch_lines
        return next((line for line in lines if _name_branch(line) == self.focus), None)

    def draw(self, screen: Surface) -> None:
        """Draw a ring around the part with the focus."""
        layout = self._chart.layout
        if self.focus == _SLIDER:
            times = self._chart.times
            margin = _SLIDER_MARGIN_PX * layout.scale
            left = round(times.left - margin)
            width = round(times.right - times.left + 2 * margin)
            box = Rect(left, layout.time_slider.top, width, layout.time_slider.height)
            draw_ring(screen, box, self._chart.theme, layout.scale)
        elif self.focus == _SWITCH and self._chart.switch_box is not None:
            draw_ring(screen, Rect(self._chart.switch_box), self._chart.theme, layout.scale)
        line = self._find_line()
        if line is not None:
            draw_ring(screen, self._chart.get_branch_box(line), self._chart.theme, layout.scale)


def _name_branch(line: BranchLine) -> str:
    """Return the key of the branch with this line."""
    return f"branch:{line.node}"
