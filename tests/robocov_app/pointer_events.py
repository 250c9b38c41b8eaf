"""Events that the tools of the viewer get."""

from __future__ import annotations

from robocov_app.viewer.tools.tool import ViewerPointerEvent

REACH_M = 0.1
"""Width of a finger on the map."""


def build_event(
    point: tuple[float, float],
    *,
    robot: int | None = None,
    is_right: bool = False,
    shift: bool = False,
    alt: bool = False,
) -> ViewerPointerEvent:
    """Build the event of a pointer that does not snap, at a position in m."""
    return ViewerPointerEvent(point, point, REACH_M, shift, alt, robot=robot, is_right=is_right)
