"""Everything about the editor that is drawn in one frame."""

from dataclasses import dataclass

from pygame import Surface

from robocov.environment import Point
from robocov_app.editor.canvas.sheet_view import View
from robocov_app.editor.editor import Editor
from robocov_app.editor.model.measurement import Measurement
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.team import Team
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay
from robocov_app.render.canvas import Canvas


@dataclass(frozen=True, eq=False)
class EditorScene:
    """Everything that the layers draw in one frame.

    Attributes
    ----------
    surface : Surface
        The arena: the part of the window in which the map is drawn.
    canvas : Canvas
        Draws on the arena.
    view : View
        The view of the sheet.
    editor : Editor
        The editor.
    tool_overlay : EditorToolOverlay
        Overlay of the active tool.
    committed_sketch : Sketch
        The map without the changes of the current drag.
    sketch : Sketch
        The map as it is displayed.
    selection : Selection
        The selection as it is displayed.
    hidden_keys : frozenset of int
        Keys of obstacles that are dragged or changed, and therefore not drawn on the sheet.
    team : Team or None
        The team that is shown at a start.
    hovered : Problem or None
        Problem under the cursor.
    cursor : Point or None
        Position of the cursor in the arena, px.
    """

    surface: Surface
    canvas: Canvas
    view: View
    editor: Editor
    tool_overlay: EditorToolOverlay
    committed_sketch: Sketch
    sketch: Sketch
    selection: Selection
    hidden_keys: frozenset[int]
    team: Team | None
    hovered: Problem | None
    cursor: Point | None

    @property
    def pixel(self) -> float:
        """Side length of a pixel at scale 1, m."""
        return self.canvas.scale / self.canvas.camera.zoom

    @property
    def measurement(self) -> Measurement | None:
        """Measurement of the map; None if passages that are too narrow are not shown."""
        return self.editor.shown_measurement
