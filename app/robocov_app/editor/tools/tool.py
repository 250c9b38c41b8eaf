"""Base class of the editor's tools, and the pointer events that they receive. All lengths are in meters."""

from dataclasses import dataclass

from robocov.environment import Point
from robocov.errors import MapError
from robocov_app.editor.model.selection import Change
from robocov_app.editor.model.sketch import Sketch
from robocov_app.editor.tools.context import EditorContext
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay
from robocov_app.toolkit.tools.snapping import Guide
from robocov_app.toolkit.tools.tool import PointerEvent, Tool


@dataclass(frozen=True)
class EditorPointerEvent(PointerEvent):
    """Event of the pointer on the sheet."""


class EditorTool(Tool[EditorContext, EditorPointerEvent]):
    """Base class of the editor's tools, with methods that do nothing.

    Attributes
    ----------
    name, title, key, hint, snaps
        See `Tool`.
    accepts_text : bool
        Whether values can be typed while the tool is busy.
    starts_with_text : bool
        Whether values can also be typed before the tool is busy.
    guides : tuple of Guide
        Guides of the latest snap.
    pressed : EditorPointerEvent or None
        The press of the left button, while it is held down.
    clicked : list of Point
        Points clicked so far, m.
    cursor : Point
        Position of the cursor, m.
    change : Change or None
        Change that would be made if the button was released now.
    """

    snaps = True
    accepts_text = True
    starts_with_text = False

    def __init__(self) -> None:
        self.guides: tuple[Guide, ...] = ()
        self.pressed: EditorPointerEvent | None = None
        self.clicked: list[Point] = []
        self.cursor: Point = (0.0, 0.0)
        self.change: Change | None = None

    @property
    def is_busy(self) -> bool:
        """Whether an action has been started but not completed."""
        return self.pressed is not None or bool(self.clicked)

    @property
    def pending(self) -> Sketch | None:
        """The map as it would be if the button was released now; None if it would not change."""
        if self.change is None:
            return None
        return self.change.sketch

    @property
    def origin(self) -> Point | None:
        """Last point of the line that is being drawn, m; None without one."""
        return None

    @property
    def snap_points(self) -> tuple[Point, ...]:
        """Points drawn so far, to which the pointer snaps, m."""
        return ()

    def press(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Handle a press of the left button."""
        self.pressed = event
        self.change = None

    def double_click(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Handle the second press of a double click."""
        self.press(context, event)

    def move(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Handle a move of the pointer, with or without a button held down."""
        self.cursor = event.point

    def release(self, context: EditorContext, event: EditorPointerEvent, *, is_click: bool) -> None:
        """Handle the release of the left button; `is_click` if the pointer has not moved since the press."""

    def finish(self, context: EditorContext) -> None:
        """Complete the action, as Enter or a right click does."""

    def remove_last(self, context: EditorContext) -> bool:
        """Remove the last point, as Backspace does; return whether there was one."""
        if not self.clicked:
            return False
        self.clicked.pop()
        return True

    def cancel(self, context: EditorContext) -> bool:
        """Cancel the action; return whether there was one."""
        was_busy = self.is_busy
        self.pressed = None
        self.change = None
        self.clicked = []
        return was_busy

    def enter_text(self, context: EditorContext, text: str) -> None:
        """Handle a value that the user typed; raise MapError if it is invalid."""
        raise MapError(f"“{text}”: this tool takes no typed value")

    def build_overlay(self, context: EditorContext) -> EditorToolOverlay:
        """Build the overlay that the tool shows on the sheet."""
        return EditorToolOverlay()
