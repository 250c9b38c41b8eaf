"""All tools of the editor."""

from robocov_app.editor.tools.background import BackgroundTool
from robocov_app.editor.tools.density import DensityTool
from robocov_app.editor.tools.door import DoorTool
from robocov_app.editor.tools.draw import (
    BoundaryTool,
    CircleTool,
    DiscTool,
    MeasureTool,
    PolygonTool,
    RectangleTool,
    StartPositionsTool,
    WallTool,
)
from robocov_app.editor.tools.motion_path import MotionPathTool
from robocov_app.editor.tools.select import PanTool, SelectTool
from robocov_app.editor.tools.tool import EditorTool
from robocov_app.toolkit.tools.tool import Toolbox


class EditorToolbox(Toolbox[EditorTool]):
    """The tools of the editor, and the one in use.

    Attributes
    ----------
    by_name, current
        See `Toolbox`.
    selector : SelectTool
        Selection tool, to which Escape returns.
    tape : MeasureTool
        Measuring tool; its line can level the map.
    density : DensityTool
        Density tool, which has the weight of new areas.
    """

    def __init__(self) -> None:
        self.selector = SelectTool()
        self.tape = MeasureTool()
        self.density = DensityTool()
        super().__init__(
            (self.selector, PanTool()),
            (BoundaryTool(), WallTool(), DoorTool(), PolygonTool(), RectangleTool(), CircleTool()),
            (DiscTool(), StartPositionsTool(), self.density, MotionPathTool()),
            (BackgroundTool(), self.tape),
        )
