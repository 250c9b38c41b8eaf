"""The tool for the paths of obstacles that move: way points by clicking and dragging, speeds by typing."""

from robocov.environment import ObstaclePath, Point
from robocov_app.editor.edits import paths
from robocov_app.editor.model.geometry import bearing_words
from robocov_app.editor.model.hit_test import obstacles_at
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.tools.tool import PointerEvent, Preview, Tool, Workspace

NEAR = 0.75  # part of a finger's width within which a way point is taken hold of


class MotionPathTool(Tool):
    """Gives the selected obstacle a path, and changes it."""

    name = "path"
    hint = "click an obstacle, then where it goes; drag way points, Backspace takes one; type its speed"

    def __init__(self) -> None:
        super().__init__()
        self.speed = paths.FIRST_SPEED
        self.chosen: int | None = None
        self._held: int | None = None
        self._led: tuple[int | None, ObstaclePath | None] = None, None  # at the last event, see `_led_of`

    @property
    def busy(self) -> bool:
        return self._led[0] is not None

    @property
    def origin(self) -> Point | None:
        return self._led[1].points[-1] if self._led[1] is not None else None

    def press(self, context: Workspace, event: PointerEvent) -> None:
        subject, path = _led_of(context)
        self.change = None
        self._held = None if path is None else paths.way_point_at(path, event.raw, NEAR * event.reach)
        if self._held is not None:
            self.chosen = self._held
            return
        over = obstacles_at(context.sketch, event.raw, 0.0)
        if over and subject not in over:
            self.chosen = None
            context.select(Selection.of(over[0]))
        elif subject is None:
            self.chosen = None
            context.say("click the obstacle that is to move first")
        elif path is None and subject in over:
            context.say("now click where it goes")
        else:
            at = None if path is None else paths.leg_at(path, event.raw, 0.5 * event.reach)
            point = event.point if at is not None else event.constrained(self.origin)
            context.change(paths.way_point_added(context.sketch, subject, point, at, self.speed))
            last = len(path.points) if path is not None else 1
            self.chosen = self._held = last if at is None else at
        self._led = _led_of(context)

    def twice(self, context: Workspace, event: PointerEvent) -> None:
        self.finish(context)

    def move(self, context: Workspace, event: PointerEvent) -> None:
        self.at, self._led = event.point, _led_of(context)
        subject, path = self._led
        if subject is None or self._held is None:
            return
        if path is None or self._held >= len(path.points):
            self._held = None
        elif self.change is not None or event.is_apart_from(path.points[self._held]):
            to = event.constrained(path.points[self._held - 1] if self._held else None)
            self.change = paths.way_point_moved(context.sketch, subject, self._held, to)

    def release(self, context: Workspace, event: PointerEvent, *, clicked: bool) -> None:
        change, self._held, self.change = self.change, None, None
        if change is not None and not clicked:
            context.change(change)
        self._led = _led_of(context)

    def finish(self, context: Workspace) -> bool:
        if had := _led_of(context)[0] is not None:
            context.select(Selection())
        self.cancel(context)
        return had

    def back(self, context: Workspace) -> bool:
        subject, path = _led_of(context)
        if subject is None or path is None:
            return False
        last = len(path.points) - 1
        chosen = last if self.chosen is None else min(self.chosen, last)
        context.change(paths.way_point_removed(context.sketch, subject, chosen))
        self.chosen = max(chosen - 1, 0) if len(path.points) > 2 else None
        self._led = _led_of(context)
        return True

    def cancel(self, context: Workspace) -> bool:
        had, self._led = self._held is not None, (None, None)
        self._held = self.change = self.chosen = None
        return had

    def enter(self, context: Workspace, text: str) -> None:
        speed = paths.speed_of(text)
        subject, path = _led_of(context)
        if subject is not None and path is not None:
            context.change(paths.path_paced(context.sketch, Selection.of(subject), speed))
        self.speed = speed

    def preview(self, context: Workspace) -> Preview | None:
        subject, path = _led_of(context)
        if subject is None:
            return None
        if self.change is not None:
            path = self.change.sketch.item(subject).shape.path
        if path is None:
            return Preview(words=f"where it goes, {self.speed:g} m/s")
        words = paths.path_words(path)
        if self._held:
            words = f"{bearing_words(path.points[self._held - 1], path.points[self._held])}; {words}"
        return Preview(words=words, dots=path.points, chosen=self.chosen)

    def shape_of_cursor(self, context: Workspace) -> str:
        path = _led_of(context)[1]
        over = path is not None and paths.way_point_at(path, self.at, 8.0 * context.pixel) is not None
        return "move" if over or self._held is not None else "cross"


def _led_of(context: Workspace) -> tuple[int | None, ObstaclePath | None]:
    chosen = context.selection.within(context.sketch)
    if len(chosen.items) != 1 or chosen.starts or chosen.boundary:
        return None, None
    (key,) = chosen.items
    return key, context.sketch.item(key).shape.path
