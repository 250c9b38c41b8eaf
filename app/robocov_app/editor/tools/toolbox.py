"""All tools of the editor, in the order in which they are shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.editor.tools.drawing import Boundary, Measure, Places, Polygon, Wall
from robocov_app.editor.tools.leading import Leading
from robocov_app.editor.tools.selecting import Pan, Select
from robocov_app.editor.tools.stretching import Circle, Disc, Rectangle
from robocov_app.editor.tools.underlay import Underlay
from robocov_app.editor.tools.weighing import Weighing

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
        Weighing(),
        Leading(),
        Underlay(),
    ]
    return {tool.name: tool for tool in tools}
