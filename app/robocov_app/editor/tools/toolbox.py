"""All tools of the editor, in the order in which they are shown."""

from robocov_app.editor.tools import density, draw, motion_path, reference_image, select
from robocov_app.editor.tools.tool import Tool

TOOLS: tuple[type[Tool], ...] = (
    *(select.SelectTool, select.PanTool, draw.PolygonTool, draw.RectangleTool, draw.CircleTool),
    *(draw.WallTool, draw.DoorTool, draw.BoundaryTool, draw.MeasureTool, draw.DiscTool, draw.PlacesTool),
    *(density.DensityTool, motion_path.MotionPathTool, reference_image.ReferenceImageTool),
)


def toolbox() -> dict[str, Tool]:
    """Return one of each tool by name."""
    return {kind.name: kind() for kind in TOOLS}
