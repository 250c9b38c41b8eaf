"""The tool for the background image: two clicked points scale or level it, and a drag moves it."""

from dataclasses import replace

from robocov.errors import MapError
from robocov_app.editor.edits.properties import set_background
from robocov_app.editor.model import require
from robocov_app.editor.model.background import Background, level_background, scale_to_length
from robocov_app.editor.model.coordinates import parse_length
from robocov_app.editor.model.geometry import distance, format_length
from robocov_app.editor.tools.context import EditorContext
from robocov_app.editor.tools.tool import EditorPointerEvent, EditorTool
from robocov_app.editor.tools.tool_overlay import EditorToolOverlay

CORNER_DECIMALS = 4  # decimal places of the position of the image, m


class BackgroundTool(EditorTool):
    """Scales, levels and moves the background image.

    Attributes
    ----------
    moved : Background or None
        The image at the position to which it is being dragged.
    """

    name = "background"
    title = "Image"
    key = "i"
    hint = "click two points; type their distance, or Enter to make their line level; drag moves it"
    snaps = False

    def __init__(self) -> None:
        super().__init__()
        self.moved: Background | None = None

    def press(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Start a click or a drag; raise MapError if there is no background image."""
        require(context.sketch.background is not None, "there is no background image: Ctrl+B chooses one")
        self.pressed = event

    def double_click(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Ignore the second press of a double click, because the distance of two equal points is 0."""

    def move(self, context: EditorContext, event: EditorPointerEvent) -> None:
        """Drag the image."""
        self.cursor = event.unsnapped_point
        background = context.sketch.background
        if (
            self.pressed is None
            or background is None
            or not event.has_moved_from(self.pressed.unsnapped_point)
        ):
            return
        dx = event.unsnapped_point[0] - self.pressed.unsnapped_point[0]
        dy = event.unsnapped_point[1] - self.pressed.unsnapped_point[1]
        corner = (background.corner[0] + dx, background.corner[1] + dy)
        self.moved = replace(background, corner=corner)

    def release(self, context: EditorContext, event: EditorPointerEvent, *, is_click: bool) -> None:
        """Apply the drag, or add a point."""
        pressed = self.pressed
        moved = self.moved
        self.pressed = None
        self.moved = None
        if pressed is None:
            return
        if moved is not None and not is_click:
            x, y = moved.corner
            corner = (round(x, CORNER_DECIMALS), round(y, CORNER_DECIMALS))
            context.apply(set_background(context.sketch, replace(moved, corner=corner)))
            return
        self.clicked = [*self.clicked[-1:], event.unsnapped_point]
        if len(self.clicked) == 2:
            context.show_message(
                "type how many meters apart the points are; Enter alone makes their line level"
            )

    def finish(self, context: EditorContext) -> None:
        """Rotate the image so that the line between the two points is horizontal or vertical."""
        if len(self.clicked) != 2 or context.sketch.background is None:
            return
        start, end = self.clicked
        self.clicked = []
        background = level_background(context.sketch.background, start, end)
        context.apply(set_background(context.sketch, background))

    def enter_text(self, context: EditorContext, text: str) -> None:
        """Scale the image so that the distance between the two points is a typed length."""
        if len(self.clicked) != 2 or context.sketch.background is None:
            raise MapError("click two points of the image first")
        start, end = self.clicked
        background = scale_to_length(context.sketch.background, start, end, parse_length(text))
        self.clicked = []
        context.apply(set_background(context.sketch, background))

    def cancel(self, context: EditorContext) -> bool:
        """Cancel the drag, and remove the points."""
        self.moved = None
        return super().cancel(context)

    def build_overlay(self, context: EditorContext) -> EditorToolOverlay:
        """Return the dragged image, and the line between the points."""
        if not self.clicked:
            return EditorToolOverlay(background=self.moved)
        line = (*self.clicked, self.cursor)[:2]
        label = f"now {format_length(distance(*line))}"
        if len(self.clicked) == 2:
            label += "; type their distance, or Enter makes them level"
        return EditorToolOverlay(background=self.moved, line=line, label=label)
