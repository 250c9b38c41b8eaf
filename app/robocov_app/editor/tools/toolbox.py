"""All tools of the editor, in the order in which they are shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.editor.tools.density import DensityTool
from robocov_app.editor.tools.draw import Boundary, Circle, Disc, Measure, Places, Polygon, Rectangle, Wall
from robocov_app.editor.tools.motion_path import MotionPathTool
from robocov_app.editor.tools.reference_image import ReferenceImageTool
from robocov_app.editor.tools.select import Pan, Select

if TYPE_CHECKING:
    from robocov_app.editor.tools.tool import Tool


def toolbox() -> dict[str, Tool]:
    """Return one of each tool by name."""
    tools: list[Tool] = [
        Select(),
        Pan(),
        Polygon(),
        Rectangle(),
        Circle(),
        Wall(),
        Boundary(),
        Measure(),
        Disc(),
        Places(),
        DensityTool(),
        MotionPathTool(),
        ReferenceImageTool(),
    ]
    return {tool.name: tool for tool in tools}
