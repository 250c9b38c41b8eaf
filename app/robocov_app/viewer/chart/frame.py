"""Layout, theme and content that all parts of the chart share."""

from dataclasses import dataclass

import pygame

from robocov_app.look.colors import Color
from robocov_app.look.theme import Theme
from robocov_app.toolkit.window.layout import Layout
from robocov_app.viewer.chart.scale import BOTTOM_PX, TOP_PX, TimeScale, build_time_scale
from robocov_app.viewer.session.past.curves import Curve, GhostCurve, PlottedQuantity
from robocov_app.viewer.session.session import Session
from robocov_app.viewer.session.timeline import Timeline


@dataclass(frozen=True, eq=False)
class ChartFrame:
    """Layout, theme and content of the chart.

    Attributes
    ----------
    layout : Layout
        Layout of the window.
    theme : Theme
    session : Session
    quantity : PlottedQuantity
    has_branches : bool
        Whether other branches are shown.
    """

    layout: Layout
    theme: Theme
    session: Session
    quantity: PlottedQuantity
    has_branches: bool = True

    @property
    def scale(self) -> float:
        """Scale of text and lines."""
        return self.layout.scale

    @property
    def timeline(self) -> Timeline:
        """The timeline of the session."""
        return self.session.timeline

    @property
    def times(self) -> TimeScale:
        """The time axis, in pixels of the window."""
        return build_time_scale(self.layout, self.timeline, self.ghosts, self.theme.small_text)

    @property
    def ghosts(self) -> list[GhostCurve]:
        """Curves of other branches, for all quantities; empty if they are hidden."""
        return self.timeline.ghosts if self.has_branches else []

    def list_curves(self) -> list[Curve]:
        """Return the curve of each pane."""
        return [pane.curves[self.quantity.name] for pane in self.timeline.panes]

    def list_ghosts(self) -> list[GhostCurve]:
        """Return the curves of other branches, for the plotted quantity."""
        return [ghost for ghost in self.ghosts if ghost.quantity == self.quantity.name]

    def draw_rule(self, surface: pygame.Surface, column: float, color: Color, *, top: int) -> None:
        """Draw a vertical line across the chart, whose upper edge is at row `top` of the surface."""
        height = self.layout.chart.height - (TOP_PX + BOTTOM_PX) * self.scale
        surface.fill(color, (round(column), round(top + TOP_PX * self.scale), 1, round(height)))
