"""The tool for the picture under the map: two points give its scale or make it level, dragging moves it."""

from dataclasses import replace

from robocov.errors import MapError
from robocov_app.editor.edits.properties import underlaid
from robocov_app.editor.model import require
from robocov_app.editor.model.background import Background, levelled, to_scale
from robocov_app.editor.model.coordinates import length_of
from robocov_app.editor.model.geometry import distance, length_words
from robocov_app.editor.tools.tool import PointerEvent, Preview, Tool, Workspace


class ReferenceImageTool(Tool):
    """Scales, levels and moves the picture."""

    name = "picture"
    hint = "click two points; type how far apart they are, or Enter to make their line level; drag moves it"
    snaps = False

    def __init__(self) -> None:
        super().__init__()
        self.moved: Background | None = None  # the picture where it is being dragged to

    def press(self, context: Workspace, event: PointerEvent) -> None:
        require(context.sketch.background is not None, "there is no picture under the map: Ctrl B takes one")
        self.begun = event

    def twice(self, context: Workspace, event: PointerEvent) -> None:
        """Take no notice: two points in one place mean nothing."""

    def move(self, context: Workspace, event: PointerEvent) -> None:
        self.at, laid = event.raw, context.sketch.background
        if self.begun is not None and laid is not None and event.is_apart_from(self.begun.raw):
            dx, dy = event.raw[0] - self.begun.raw[0], event.raw[1] - self.begun.raw[1]
            self.moved = replace(laid, corner=(laid.corner[0] + dx, laid.corner[1] + dy))

    def release(self, context: Workspace, event: PointerEvent, *, clicked: bool) -> None:
        begun, moved, self.begun, self.moved = self.begun, self.moved, None, None
        if begun is not None and moved is not None and not clicked:
            corner = round(moved.corner[0], 4), round(moved.corner[1], 4)
            context.change(underlaid(context.sketch, replace(moved, corner=corner)))
        elif begun is not None:
            self.clicked = [*self.clicked[-1:], event.raw]
            if len(self.clicked) == 2:
                context.say("type how many metres apart the points are; Enter alone makes their line level")

    def finish(self, context: Workspace) -> bool:
        if len(self.clicked) != 2 or context.sketch.background is None:
            return False
        (a, b), self.clicked = self.clicked, []
        context.change(underlaid(context.sketch, levelled(context.sketch.background, a, b)))
        return True

    def enter(self, context: Workspace, text: str) -> None:
        if len(self.clicked) != 2 or context.sketch.background is None:
            raise MapError("click two points of the picture first")
        a, b = self.clicked
        laid = to_scale(context.sketch.background, a, b, length_of(text))
        self.clicked = []
        context.change(underlaid(context.sketch, laid))

    def cancel(self, context: Workspace) -> bool:
        self.moved = None
        return super().cancel(context)

    def preview(self, context: Workspace) -> Preview | None:
        if not self.clicked:
            return None
        line = (*self.clicked, self.at)[:2]
        words = f"now {length_words(distance(*line))}"
        if len(self.clicked) == 2:
            words += "; type how far apart they are, or Enter makes them level"
        return Preview(line, words=words)
