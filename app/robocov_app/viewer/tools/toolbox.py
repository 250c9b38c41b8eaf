"""All tools of the viewer."""

from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.tools.brush import BrushTool
from robocov_app.viewer.tools.clicks import AddRobotTool, EraserTool, FailureTool
from robocov_app.viewer.tools.hand import HandTool
from robocov_app.viewer.tools.outlines import AddPolygonTool, AddWallTool
from robocov_app.viewer.tools.segments import AddCircleTool, RulerTool
from robocov_app.viewer.tools.tool import ViewerTool


class Toolbox:
    """The tools, and the one in use.

    Parameters
    ----------
    inspection : Inspection
        The selection, which the hand changes.

    Attributes
    ----------
    by_name : dict of str to ViewerTool
        The tools, in the order of the panel.
    hand : HandTool
        The tool to which Escape returns.
    wall : AddWallTool
        The tool whose width can be changed at any time.
    current : ViewerTool
        The tool in use.
    """

    def __init__(self, inspection: Inspection) -> None:
        self.hand = HandTool(inspection)
        self.wall = AddWallTool()
        self.current: ViewerTool = self.hand
        tools: list[ViewerTool] = [
            self.hand,
            AddPolygonTool(),
            self.wall,
            AddCircleTool(),
            BrushTool(),
            EraserTool(),
            AddRobotTool(),
            FailureTool(),
            RulerTool(),
        ]
        self.by_name = {tool.name: tool for tool in tools}

    @property
    def resizable(self) -> ViewerTool:
        """The tool whose size the keys [ and ] change: the one in use, or the wall if that has no size."""
        return self.current if self.current.is_resizable else self.wall
