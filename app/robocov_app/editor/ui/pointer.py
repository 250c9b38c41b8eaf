"""The editor's mouse: what is pressed, dragged and let go where, and what that means."""

from collections.abc import Callable
from math import dist

import pygame

from robocov_app.editor.canvas.canvas import EditorCanvas
from robocov_app.editor.tools.snapping import Snap
from robocov_app.editor.tools.tool import PointerEvent
from robocov_app.editor.ui.editor import Editor
from robocov_app.editor.ui.panel import Panel
from robocov_app.toolkit.input import DOUBLE, WHEEL, show_cursor, wheel_notches
from robocov_app.toolkit.layout import inside

SLIP = 4.0  # pixels at scale 1 that a click may move

_SHAPES = {
    "arrow": pygame.SYSTEM_CURSOR_ARROW,
    "cross": pygame.SYSTEM_CURSOR_CROSSHAIR,
    "hand": pygame.SYSTEM_CURSOR_HAND,
    "move": pygame.SYSTEM_CURSOR_SIZEALL,
    "sideways": pygame.SYSTEM_CURSOR_SIZEWE,
    "updown": pygame.SYSTEM_CURSOR_SIZENS,
    "rising": pygame.SYSTEM_CURSOR_SIZENESW,
    "falling": pygame.SYSTEM_CURSOR_SIZENWSE,
}


class Pointer:
    """Turns events of the mouse into what panel, sheet and tools do: the panel comes first."""

    def __init__(
        self, editor: Editor, canvas: EditorCanvas, panel: Panel, menu: Callable[[tuple[int, int]], object]
    ) -> None:
        self._editor, self._canvas, self._panel, self._menu = editor, canvas, panel, menu
        self.at = (0, 0)
        self.held = False  # whether the left button pans, for as long as a key is held
        self._drag = ""
        self._button = 0
        self._pressed_at = (0, 0)
        self._last_click = -1.0, (0, 0)
        self._moved_off = False
        self._shape = -1

    @property
    def dragging(self) -> bool:
        """Whether a button is held down on something."""
        return bool(self._drag)

    def take(self, event: pygame.event.Event, now: float) -> None:
        """Take an event of the mouse at a time in seconds."""
        if event.type != pygame.MOUSEWHEEL:
            self.at = event.pos
        taken = not self._drag and self._panel.take(event)
        if event.type == pygame.MOUSEMOTION:
            self._moved(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            self._released(event)
        elif taken:
            self._editor.cursor = None
        elif event.type == pygame.MOUSEBUTTONDOWN:
            self._panel.ui.stop_typing()
            self._pressed(event, now)
        elif self._canvas.over(self.at):
            self._canvas.zoom(WHEEL ** wheel_notches(event), self.at)

    def aim(self, pixel: tuple[int, int]) -> PointerEvent:
        """Return where a pixel means, with what is held down on the keyboard."""
        raw, reach = self._canvas.to_world(pixel), self._canvas.reach
        held, tool, point = pygame.key.get_mods(), self._editor.tool, raw
        ctrl = bool(held & (pygame.KMOD_CTRL | pygame.KMOD_META))
        if tool.snaps:
            snap = Snap(raw) if ctrl else self._editor.snap(raw, reach)
            point, tool.guides = snap.point, snap.guides
        shift, alt = bool(held & pygame.KMOD_SHIFT), bool(held & pygame.KMOD_ALT)
        return PointerEvent(point, raw, reach, shift, alt, ctrl)

    def leave(self) -> None:
        """The mouse is not in the window any more."""
        self._editor.cursor = self._canvas.at = self._canvas.hovered = None

    def _pressed(self, event: pygame.event.Event, now: float) -> None:
        editor = self._editor
        if self._drag or not self._canvas.over(event.pos) or event.button not in (1, 2, 3):
            return
        self._pressed_at, self._button, self._moved_off = event.pos, event.button, False
        if event.button != 1 or editor.tool.name == "pan" or self.held:
            self._drag = "pan"
            return
        problem = self._canvas.problem_at(event.pos)
        if problem is not None and not editor.tool.busy:
            editor.problem = None if editor.problem is problem else problem
            editor.say(problem.words, trouble=problem.grave)
            editor.version += 1
            return
        then, where = self._last_click
        double = now - then < DOUBLE and dist(where, event.pos) < SLIP * self._canvas.layout.scale
        self._last_click = (-1.0 if double else now), event.pos
        self._drag = "tool"
        aim = self.aim(event.pos)
        act = editor.tool.twice if double else editor.tool.press
        editor.attempt(lambda: act(editor, aim))

    def _moved(self, event: pygame.event.Event) -> None:
        editor, canvas = self._editor, self._canvas
        over = canvas.over(event.pos) and not inside(canvas.layout.panel, event.pos)
        aimed = over or self._drag == "tool"
        editor.cursor = canvas.to_world(event.pos) if aimed else None
        canvas.at = (float(event.pos[0]), float(event.pos[1])) if aimed else None
        canvas.hovered = canvas.problem_at(event.pos) if over and not self._drag else None
        far = dist(event.pos, self._pressed_at) >= SLIP * canvas.layout.scale
        self._moved_off = self._moved_off or (bool(self._drag) and far)
        if self._drag == "pan":
            if self._moved_off:
                canvas.pan(*event.rel)
        elif aimed:
            aim, version = self.aim(event.pos), editor.version
            editor.attempt(lambda: editor.tool.move(editor, aim))
            editor.version = version  # the panel need not look again at every move of the mouse
        else:
            editor.tool.guides = ()

    def _released(self, event: pygame.event.Event) -> None:
        editor, drag = self._editor, self._drag
        if event.button != self._button or not drag:
            return
        self._drag, self._button = "", 0
        if drag == "tool":
            aim = self.aim(event.pos)
            editor.attempt(lambda: editor.tool.release(editor, aim, clicked=not self._moved_off))
            editor.document.history.break_drag()
        elif event.button == 3 and not self._moved_off:
            if editor.tool.busy:
                editor.attempt(lambda: editor.tool.finish(editor))
            else:
                self._menu(event.pos)

    def show(self) -> None:
        """Let the cursor tell what a press would do."""
        canvas, editor = self._canvas, self._editor
        if inside(canvas.layout.panel, self.at):
            self._shape = -1  # the panel has set its own
            return
        shape = "arrow"
        if canvas.over(self.at):
            panned = self._drag == "pan" or self.held
            shape = "move" if panned else "hand" if canvas.hovered else editor.tool.shape_of_cursor(editor)
        if _SHAPES[shape] != self._shape:
            self._shape = _SHAPES[shape]
            show_cursor(self._shape)
