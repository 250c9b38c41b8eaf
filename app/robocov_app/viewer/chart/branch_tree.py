"""The branches of a session as a small tree between the chart and the time slider.

The time slider is the trunk. Each other branch is a line from the time at which it leaves the trunk, or an
earlier branch, to its end.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile

import pygame
from pygame import Surface

from robocov_app.look.colors import mix
from robocov_app.viewer.chart.frame import ChartFrame
from robocov_app.viewer.session.document import Branch, Node
from robocov_app.viewer.session.timeline import Timeline

MAX_BRANCH_LINES = 3
"""Maximum number of branches in the tree; the list of branches has them all."""
LANE_PX = 8.0
"""Distance of two lines, at scale 1."""
_LINE_PX = 2.0
_LINE_STRENGTH = 0.5
_DOT_RADIUS_PX = 3.0
_HOVERED_DOT_RADIUS_PX = 4.5
_REACH_PX = 4.0
"""Distance of the pointer from a line or from its end at which it counts as hovered."""


@dataclass(frozen=True)
class BranchLine:
    """The line of a branch.

    Attributes
    ----------
    node : int
        Number of the node at which the branch ends.
    lane : int
        Number of the line, counted upwards from the time slider, which is lane 0.
    parent_lane : int
        Lane that it leaves.
    start_time, end_time : float, s
    text : str
        Description of the branch and of its end.
    """

    node: int
    lane: int
    parent_lane: int
    start_time: float
    end_time: float
    text: str


def list_branch_lines(timeline: Timeline) -> list[BranchLine]:
    """Return the lines of the newest branches other than the displayed one.

    Parameters
    ----------
    timeline : Timeline

    Returns
    -------
    list of BranchLine
    """
    document = timeline.document
    dt = timeline.scenario.dt
    present_path = document.get_path(timeline.head)
    root = present_path[0]
    # The chapters of a lesson are runs of their own, which share no time with the displayed one.
    others = [
        branch
        for branch in document.list_branches()
        if branch.node not in present_path and document.get_path(branch.node)[0] is root
    ]
    paths = [present_path]
    lines: list[BranchLine] = []
    for branch in others[-MAX_BRANCH_LINES:]:
        path = document.get_path(branch.node)
        shared_counts = [_count_shared(path, other) for other in paths]
        shared = max(shared_counts)
        parent_lane = shared_counts.index(shared)
        lines.append(
            BranchLine(
                node=branch.node.number,
                lane=len(paths),
                parent_lane=parent_lane,
                start_time=_find_fork_step(path[shared:], paths[parent_lane][shared:]) * dt,
                end_time=branch.last_step * dt,
                text=_describe(branch, dt),
            )
        )
        paths.append(path)
    return lines


def _count_shared(path: list[Node], other: list[Node]) -> int:
    """Return the number of nodes at the beginning that two paths share."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] is pair[1], zip(path, other, strict=False)))


def _find_fork_step(path: list[Node], other: list[Node]) -> int:
    """Return the step at which two paths diverge, from the nodes that they do not share."""
    return min(node.first_step for node in [*path[:1], *other[:1]])


def _describe(branch: Branch, dt: float) -> str:
    return f"Branch: {branch.description} · {branch.describe_end(dt)}. Click to enter it."


def measure_tree(line_count: int) -> float:
    """Return the height of the tree, px at scale 1."""
    return LANE_PX * line_count


def draw_branch_tree(
    screen: Surface, frame: ChartFrame, lines: Sequence[BranchLine], hovered: int | None
) -> None:
    """Draw the tree onto the window.

    Parameters
    ----------
    screen : Surface
    frame : ChartFrame
    lines : sequence of BranchLine
    hovered : int or None
        Node of the branch that is highlighted.
    """
    theme = frame.theme
    width = max(1, round(_LINE_PX * frame.scale))
    for line in lines:
        is_hovered = line.node == hovered
        color = theme.accent if is_hovered else mix(theme.panel, theme.ink, _LINE_STRENGTH)
        row = _get_row(frame, line.lane)
        left, right = _get_columns(frame, line)
        pygame.draw.line(screen, color, (left, _get_row(frame, line.parent_lane)), (left, row), width)
        pygame.draw.line(screen, color, (left, row), (right, row), width)
        if line.end_time > frame.times.end:
            continue  # The branch ends beyond the axis.
        radius = _HOVERED_DOT_RADIUS_PX if is_hovered else _DOT_RADIUS_PX
        pygame.draw.aacircle(screen, color, (right, row), round(radius * frame.scale))


def find_branch_line(
    frame: ChartFrame, lines: Sequence[BranchLine], pixel: tuple[int, int]
) -> BranchLine | None:
    """Return the line at a pixel of the window; None if there is none."""
    reach = _REACH_PX * frame.scale
    for line in lines:
        left, right = _get_columns(frame, line)
        is_in_columns = left - reach <= pixel[0] <= right + reach
        if is_in_columns and abs(pixel[1] - _get_row(frame, line.lane)) < reach:
            return line
    return None


def get_line_box(frame: ChartFrame, line: BranchLine) -> pygame.Rect:
    """Return the area of a line in the window."""
    reach = round(_REACH_PX * frame.scale)
    left, right = _get_columns(frame, line)
    row = _get_row(frame, line.lane)
    return pygame.Rect(left - reach, row - reach, right - left + 2 * reach, 2 * reach)


def _get_columns(frame: ChartFrame, line: BranchLine) -> tuple[int, int]:
    """Return the columns of the window at which a line starts and ends; it ends at the end of the axis."""
    times = frame.times
    left = round(min(times.to_column(line.start_time), times.right))
    right = round(min(times.to_column(line.end_time), times.right))
    return left, max(left, right)


def _get_row(frame: ChartFrame, lane: int) -> int:
    """Return the row of a lane in the window; lane 0 is the middle of the time slider."""
    slider = frame.layout.time_slider
    if lane == 0:
        return round(slider.top + 0.5 * slider.height)
    return round(slider.top - (lane - 0.5) * LANE_PX * frame.scale)
