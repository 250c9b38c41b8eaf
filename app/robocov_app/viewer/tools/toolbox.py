"""All tools of the viewer."""

from robocov_app.toolkit.tools.tool import Toolbox
from robocov_app.viewer.inspection import Inspection
from robocov_app.viewer.tools.brush import BrushTool
from robocov_app.viewer.tools.clicks import AddRobotTool, EraserTool, FailureTool
from robocov_app.viewer.tools.hand import HandTool
from robocov_app.viewer.tools.outlines import AddPolygonTool, AddWallTool
from robocov_app.viewer.tools.segments import AddCircleTool, RulerTool
from robocov_app.viewer.tools.tool import ViewerTool


class ViewerToolbox(Toolbox[ViewerTool]):
    """The tools, and the one in use.

    Parameters
    ----------
    inspection : Inspection
        The selection, which the hand changes.

    Attributes
    ----------
    by_name, current
        See `Toolbox`.
    hand : HandTool
        The hand, to which Escape returns.
    wall : AddWallTool
        The wall tool, whose width can be changed while other tools are in use.
    """

    def __init__(self, inspection: Inspection) -> None:
        """Create the tools, in the order in which the panel shows them."""
        self.hand = HandTool(inspection)
        self.wall = AddWallTool()
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
        super().__init__(tools)

    @property
    def resizable_tool(self) -> ViewerTool:
        """The tool whose size the keys [ and ] change: the current one if resizable, otherwise the wall."""
        if self.current.is_resizable:
            return self.current
        return self.wall
