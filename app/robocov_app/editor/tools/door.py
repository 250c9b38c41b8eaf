"""The tool that cuts doors into walls."""

from dataclasses import dataclass

from robocov.environment import Point
from robocov_app.editor.edits import create
from robocov_app.editor.model import require
from robocov_app.editor.model.coordinates import parse_length
from robocov_app.editor.model.geometry import distance, format_length
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.tools.context import EditorContext
from robocov_app.editor.tools.tool import EditorPointerEvent, EditorTool
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay

DEFAULT_DOOR_WIDTH_M = 0.9
WALL_REACH_FRACTION = 0.6  # of the pointer's reach: walls are picked within this distance
MIN_DRAG_FRACTION = 0.1  # of a door's width: only longer drags set the width of the opening


@dataclass(frozen=True)
class _OpenedDoor:
    """A door that was opened by a click, and whose width can still be typed."""

    before: Sketch
    after: Sketch
    wall: int
    point: Point


class DoorTool(EditorTool):
    """Cuts a door into a wall, which leaves two walls.

    Attributes
    ----------
    width : float
        Width of a door opened by a click, m. A typed width also applies to the door that was just opened.
    """

    name = "door"
    title = "Door"
    key = "k"
    hint = "click a wall to open a door, then type its width in meters; or drag along the wall"
    starts_with_text = True

    def __init__(self) -> None:
        super().__init__()
        self.width = DEFAULT_DOOR_WIDTH_M
        self._wall: int | None = None  # key of the wall that was pressed or is under the cursor
        self._opened: _OpenedDoor | None = None

    def press(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Choose the wall under the pointer."""
        self.pressed = event
        self.cursor = event.point
        self._wall = create.find_wall(
            context.sketch, event.unsnapped_point, WALL_REACH_FRACTION * event.reach
        )
        require(self._wall is not None, "click a wall: doors are opened in walls")

    def move(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Move the preview of the door."""
        self.cursor = event.point
        if self.pressed is None:
            self._wall = create.find_wall(
                context.sketch, event.unsnapped_point, WALL_REACH_FRACTION * event.reach
            )

    def release(self, context: EditorContext, event: EditorPointerEvent, *, is_click: bool) -> None:
        """Cut an opening into the wall: a door at a click, or everything between both ends of a drag."""
        pressed = self.pressed
        wall = self._wall
        self.pressed = None
        self._wall = None
        if pressed is None or wall is None:
            return
        before = context.sketch
        if is_click:
            context.apply(create.open_door(before, wall, event.point, self.width))
            self._opened = _OpenedDoor(before, context.sketch, wall, event.point)
        else:
            context.apply(create.open_wall(before, wall, pressed.point, event.point))

    def enter_text(self, context: EditorContext, text: str) -> None:
        """Set the width of doors, including that of a door which was just opened."""
        width = parse_length(text)
        create.require_door_width(width)
        opened = self._opened
        if opened is None or context.sketch is not opened.after:
            self.width = width
            context.show_message(f"doors are {format_length(width)} wide")
            return
        context.apply(create.open_door(opened.before, opened.wall, opened.point, width))
        self.width = width
        self._opened = _OpenedDoor(opened.before, context.sketch, opened.wall, opened.point)

    def build_overlay(self, context: EditorContext) -> EditorToolOverlay:
        """Return the preview of the opening, with its width."""
        sketch = context.sketch
        wall = self._wall
        if wall is None or wall not in sketch.index_by_key:
            return EditorToolOverlay()
        start, end = create.compute_door_ends(sketch, wall, self.cursor, self.width)
        pressed = self.pressed
        if pressed is not None and distance(pressed.point, self.cursor) > MIN_DRAG_FRACTION * self.width:
            start = create.project_on_wall(sketch, wall, pressed.point)
            end = create.project_on_wall(sketch, wall, self.cursor)
        return EditorToolOverlay(line=(start, end), label=f"door, {format_length(distance(start, end))}")
