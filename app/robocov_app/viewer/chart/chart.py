"""The chart of the coverage cost over time, and the time slider below it."""

import numpy as np
import pygame

from robocov_app.look.theme import Theme
from robocov_app.render.canvas import Canvas
from robocov_app.toolkit.overlay import create_flat_canvas
from robocov_app.toolkit.sentence_case import to_sentence_case
from robocov_app.toolkit.window.layout import Box, Layout, is_inside
from robocov_app.viewer.chart.axes import (
    draw_axes,
    draw_computation_state,
    draw_switch,
    draw_title,
    draw_waiting_text,
)
from robocov_app.viewer.chart.branch_tree import (
    BranchLine,
    draw_branch_tree,
    find_branch_line,
    get_line_box,
    list_branch_lines,
    measure_tree,
)
from robocov_app.viewer.chart.captions import draw_captions
from robocov_app.viewer.chart.curves import (
    GHOST_REACH_PX,
    GhostLine,
    draw_curves,
    draw_ghosts,
    find_nearest_ghost,
)
from robocov_app.viewer.chart.events import draw_events
from robocov_app.viewer.chart.frame import ChartFrame
from robocov_app.viewer.chart.pointer_tag import draw_pointer_tag
from robocov_app.viewer.chart.scale import ChartScale, TimeScale, build_chart_scale
from robocov_app.viewer.chart.time_slider import draw_empty_slider, draw_slider_state
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.past.curves import DISTANCE, TIME, PlottedQuantity
from robocov_app.viewer.window.status import describe_cut_off

_FIRST_VALUE_TEXT = "Computing the first value"
"""Shown in place of the curves while the cost of the first step is computed."""
REFRESH_INTERVAL_S = 0.1
"""Minimum time between two drawings of curves that grow."""


class Chart:
    """Chart and time slider of a session. Parts that rarely change are cached as an image.

    Parameters
    ----------
    viewer : Presenter

    Attributes
    ----------
    hover : (x, y) or None, px
        Position of the pointer in the window; None if the tag at the pointer is not shown.
    ghosts : list of GhostLine
        Curves of other branches in the image.
    layout : Layout
        Layout of the window, from `arrange`.
    theme : Theme
        Colors, from `arrange`.
    switch_box : Box or None
        Area of the window where a click plots the other quantity; None if there is no other.
    """

    layout: Layout
    theme: Theme

    def __init__(self, viewer: Presenter) -> None:
        """Build a chart without an image; it is drawn after `arrange`."""
        self.viewer = viewer
        self.hover: tuple[int, int] | None = None
        self.ghosts: list[GhostLine] = []
        self.switch_box: Box | None = None
        self._selected_quantity = DISTANCE
        self._branch_lines: list[BranchLine] = []
        self._image: pygame.Surface | None = None
        self._scale: ChartScale
        self._image_key: object = None
        self._image_samples: object = None
        self._image_time = -1.0

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Adopt the layout and the theme of the window."""
        self.layout = layout
        self.theme = theme
        self._image = None

    @property
    def quantity(self) -> PlottedQuantity:
        """The quantity that the chart shows."""
        if self._has_times:
            return self._selected_quantity
        return DISTANCE

    @property
    def times(self) -> TimeScale:
        """The axis of times, in pixels of the window."""
        return self._frame.times

    @property
    def branch_lines(self) -> list[BranchLine]:
        """Lines of the tree of branches, as they were drawn last."""
        return self._branch_lines

    def find_branch(self, pixel: tuple[int, int]) -> int | None:
        """Return the last node of the branch at a pixel, in the tree or as a curve; None if there is none."""
        line = find_branch_line(self._frame, self._branch_lines, pixel)
        if line is not None:
            return line.node
        return self.find_ghost(pixel)

    def get_branch_box(self, line: BranchLine) -> pygame.Rect:
        """Return the area of a branch's line in the window."""
        return get_line_box(self._frame, line)

    @property
    def _has_times(self) -> bool:
        """Whether mean times are known; they are computed only if robots differ in maximum speed."""
        return any(len(pane.curves["time"]) for pane in self.viewer.session.timeline.panes)

    @property
    def _has_curves(self) -> bool:
        """Whether there are curves above the time slider."""
        return self.layout.chart.height > 0

    @property
    def _frame(self) -> ChartFrame:
        return ChartFrame(
            self.layout,
            self.theme,
            self.viewer.session,
            self.quantity,
            has_branches=self.viewer.view.has_branches,
        )

    def switch_quantity(self) -> str:
        """Show the other quantity, and return the status message."""
        if not self._has_times:
            return "all robots are equally fast: the mean time is proportional to the mean distance"
        self._selected_quantity = TIME if self.quantity is DISTANCE else DISTANCE
        self._image = None
        title = self._selected_quantity.title
        return f"plotted: {title[:1].lower()}{title[1:]}"

    def is_on_switch(self, pixel: tuple[int, int]) -> bool:
        """Return whether a click at a pixel of the window switches the quantity."""
        return self.switch_box is not None and is_inside(self.switch_box, pixel)

    def find_ghost(self, pixel: tuple[int, int]) -> int | None:
        """Return the last node of the branch whose curve is at a pixel; None if there is none."""
        point = np.array([pixel[0], pixel[1] - self.layout.chart.top])
        return find_nearest_ghost(self.ghosts, point, GHOST_REACH_PX * self.layout.scale)

    def _describe_branch(self, pixel: tuple[int, int]) -> str:
        """Describe the branch at a pixel, in the tree or as a curve; empty if there is none."""
        line = find_branch_line(self._frame, self._branch_lines, pixel)
        if line is not None:
            return line.text
        node = self.find_ghost(pixel)
        for ghost in self.viewer.session.timeline.ghosts:
            if ghost.node == node:
                return f"Branch: {ghost.description}. Click to enter it."
        return ""

    def to_time(self, column: float) -> float:
        """Return the time, s, at a column of the window, limited to the simulated time."""
        end_time = self.viewer.session.timeline.end_time
        return float(np.clip(self.times.to_time(column), 0.0, end_time))

    def to_column(self, time: float) -> float:
        """Return the column of a time, s, in the window."""
        return self.times.to_column(time)

    def draw(self, screen: pygame.Surface) -> None:
        """Draw the parts of the chart and the time slider that the layout has space for."""
        if not self.layout.time_slider.height:
            return
        frame = self._frame
        screen.blit(self._update_image(frame), self.layout.chart.position)
        if self._has_curves:
            cut_off_notes = {
                pane.number: describe_cut_off(self.viewer, pane) for pane in frame.timeline.panes
            }
            draw_captions(screen, frame, self._scale, cut_off_notes)
        hovered = None if self.hover is None else self.find_branch(self.hover)
        draw_branch_tree(screen, frame, self._branch_lines, hovered)
        draw_slider_state(screen, frame)
        if self.hover is not None:
            branch_text = self._describe_branch(self.hover)
            draw_pointer_tag(screen, frame, self.hover, self.to_time(self.hover[0]), branch_text)

    def _update_image(self, frame: ChartFrame) -> pygame.Surface:
        """Return the image of the parts that rarely change; draw it again if it is outdated.

        If only samples were appended to the curves, it is drawn again after `REFRESH_INTERVAL_S`.
        """
        key = self._build_image_key(frame)
        samples = [(len(curve), curve.last_time, curve.interpolate(np.inf)) for curve in frame.list_curves()]
        is_old = self.viewer.now - self._image_time >= REFRESH_INTERVAL_S
        has_grown = is_old and samples != self._image_samples
        if self._image is None or key != self._image_key or has_grown:
            self._image = self._draw_image(frame)
            self._image_key = key
            self._image_samples = samples
            self._image_time = self.viewer.now
        return self._image

    def _build_image_key(self, frame: ChartFrame) -> object:
        """Return everything on which the image depends, except for the samples of the curves.

        The samples change with almost every frame.
        """
        timeline = frame.timeline
        return (
            tuple(pane.number for pane in timeline.panes),
            len(timeline.events),
            len(frame.ghosts),
            frame.has_branches,
            len(timeline.document.nodes),
            timeline.head.number,
            frame.times,
            frame.quantity,
            self.viewer.costs.state,
            None if timeline.is_live else frame.session.displayed.time,
            timeline.past_version,
            frame.session.playback.is_playing,
        )

    def _draw_image(self, frame: ChartFrame) -> pygame.Surface:
        """Draw axes, events, curves, and the empty time slider."""
        layout = frame.layout
        image = pygame.Surface((layout.chart.width, layout.chart.height + layout.time_slider.height), 0, 32)
        curves = [curve.values for curve in frame.list_curves()]
        ghosts = [ghost.values for ghost in frame.list_ghosts()]
        self._branch_lines = []
        if self._has_curves and frame.has_branches:
            self._branch_lines = list_branch_lines(frame.timeline)
        tree_height = measure_tree(len(self._branch_lines))
        scale = build_chart_scale(frame.times, layout, curves + ghosts, tree_height)
        self._scale = scale
        canvas = create_flat_canvas(image, frame.theme, frame.scale)
        image.fill(frame.theme.panel)
        if self._has_curves:
            self._draw_curves(canvas, frame)
        else:
            self.ghosts = []
            self.switch_box = None
        draw_empty_slider(canvas, frame, scale.times)
        return image

    def _draw_curves(self, canvas: Canvas, frame: ChartFrame) -> None:
        """Draw title, axes, events and curves."""
        scale = self._scale
        title_end = draw_title(canvas, frame)
        self.switch_box = draw_switch(canvas, frame, title_end) if self._has_times else None
        state = to_sentence_case(self.viewer.costs.state)
        has_samples = any(len(curve) for curve in frame.list_curves())
        if has_samples:
            draw_computation_state(canvas, frame, state, left=title_end, right=scale.times.right)
        draw_axes(canvas, frame, scale)
        if not has_samples:
            draw_waiting_text(canvas, frame, scale, state or _FIRST_VALUE_TEXT)
        draw_events(canvas, frame, scale)
        self.ghosts = draw_ghosts(canvas, frame, scale)
        draw_curves(canvas, frame, scale)
