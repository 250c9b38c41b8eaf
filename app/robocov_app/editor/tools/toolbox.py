"""All tools of the editor, in the order in which they are shown."""

from __future__ import annotations

from robocov_app.editor.tools.density import DensityTool
from robocov_app.editor.tools.draw import (
    BoundaryTool,
    CircleTool,
    DiscTool,
    DoorTool,
    MeasureTool,
    PlacesTool,
    PolygonTool,
    RectangleTool,
    WallTool,
)
from robocov_app.editor.tools.motion_path import MotionPathTool
from robocov_app.editor.tools.reference_image import ReferenceImageTool
from robocov_app.editor.tools.select import PanTool, SelectTool
from robocov_app.editor.tools.tool import Tool

TOOLS: tuple[type[Tool], ...] = (
    *(SelectTool, PanTool, PolygonTool, RectangleTool, CircleTool, WallTool, DoorTool, BoundaryTool),
    *(MeasureTool, DiscTool, PlacesTool, DensityTool, MotionPathTool, ReferenceImageTool),
)


def toolbox() -> dict[str, Tool]:
    """Return one of each tool by name."""
    return {kind.name: kind() for kind in TOOLS}
