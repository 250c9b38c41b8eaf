"""The mouse over the map: tools, panning, double clicks, the wheel and the context menu."""

from collections.abc import Callable
from enum import Enum
from math import dist

import pygame

from robocov_app.editor.canvas.canvas import REACH_PX, EditorCanvas
from robocov_app.editor.editor import Editor
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.tools.snapping import Snap
from robocov_app.editor.tools.tool import EditorPointerEvent
from robocov_app.toolkit.input import DOUBLE_CLICK_S, MAX_CLICK_MOVE_PX, ZOOM_PER_NOTCH, get_wheel_notches

BUTTONS = (1, 2, 3)  # left, middle, right
_NEVER_S = -1.0


class Gesture(Enum):
    """Action of a mouse button while it is held down."""

    NONE = "none"
    TOOL = "tool"
    PAN = "pan"


class Pointer:
    """Turns mouse events over the map into actions of the tools, and pans.

    Parameters
    ----------
    editor : Editor
        The editor.
    canvas : EditorCanvas
        The view of the map.
    open_menu : callable
        Opens the context menu at a pixel.

    Attributes
    ----------
    gesture : Gesture
        What the button does that is held down.
    pans_with_left : bool
        Whether the left button pans, because a key is held down.
    """

    def __init__(
        self, editor: Editor, canvas: EditorCanvas, open_menu: Callable[[tuple[int, int]], object]
    ) -> None:
        self.editor = editor
        self.canvas = canvas
        self.gesture = Gesture.NONE
        self.pans_with_left = False
        self._open_menu = open_menu
        self._button = 0
        self._has_moved = False  # since the press, farther than a click may move
        self._pressed_at = (0, 0)
        self._last_click_s = _NEVER_S
        self._last_click_at = (0, 0)

    @property
    def is_busy(self) -> bool:
        """Whether a button is held down."""
        return self.gesture is not Gesture.NONE

    @property
    def is_panning(self) -> bool:
        """Whether dragging pans."""
        return self.gesture is Gesture.PAN or self.pans_with_left

    def reset(self) -> None:
        """Forget the button that is held down."""
        self.gesture = Gesture.NONE
        self._button = 0

    def hold_pan(self) -> None:
        """Pan with the left button until the key is released."""
        self.pans_with_left = True

    def leave(self) -> None:
        """Handle that the pointer has left the window."""
        self.editor.cursor = None
        self.canvas.at = None
        self.canvas.hovered = None

    def press(self, event: pygame.event.Event) -> None:
        """Handle a press of a button."""
        if self.is_busy or not self.canvas.contains(event.pos) or event.button not in BUTTONS:
            return
        self._pressed_at = event.pos
        self._button = event.button
        self._has_moved = False
        if event.button != 1 or self.editor.tool.name == "pan" or self.pans_with_left:
            self.gesture = Gesture.PAN
            return
        problem = self.canvas.find_problem(event.pos)
        if problem is not None and not self.editor.tool.is_busy:
            self._toggle_problem(problem)
            return
        self._press_tool(event)

    def _toggle_problem(self, problem: Problem) -> None:
        editor = self.editor
        editor.problem = None if editor.problem is problem else problem
        editor.show_message(problem.message, is_error=problem.is_error)
        editor.revision += 1

    def _press_tool(self, event: pygame.event.Event) -> None:
        editor = self.editor
        max_slip = MAX_CLICK_MOVE_PX * self.canvas.layout.scale
        is_quick = editor.now - self._last_click_s < DOUBLE_CLICK_S
        is_double = is_quick and dist(self._last_click_at, event.pos) < max_slip
        # The third of three quick clicks is a single click again.
        self._last_click_s = _NEVER_S if is_double else editor.now
        self._last_click_at = event.pos
        self.gesture = Gesture.TOOL
        pointer = self._build_event(event.pos)
        handle = editor.tool.double_click if is_double else editor.tool.press
        editor.attempt(lambda: handle(editor, pointer))

    def move(self, event: pygame.event.Event) -> None:
        """Handle a move of the mouse."""
        editor = self.editor
        canvas = self.canvas
        is_over_map = canvas.contains(event.pos)
        is_followed = is_over_map or self.gesture is Gesture.TOOL
        editor.cursor = canvas.to_world(event.pos) if is_followed else None
        canvas.at = (float(event.pos[0]), float(event.pos[1])) if is_followed else None
        canvas.hovered = None
        if is_over_map and not self.is_busy:
            canvas.hovered = canvas.find_problem(event.pos)
        if self.is_busy and dist(event.pos, self._pressed_at) >= MAX_CLICK_MOVE_PX * canvas.layout.scale:
            self._has_moved = True
        if self.gesture is Gesture.PAN:
            if self._has_moved:
                canvas.pan(*event.rel)
        elif is_followed:
            self._move_tool(event)
        else:
            editor.tool.guides = ()

    def _move_tool(self, event: pygame.event.Event) -> None:
        editor = self.editor
        pointer = self._build_event(event.pos)
        revision = editor.revision
        editor.attempt(lambda: editor.tool.move(editor, pointer))
        # The panel need not be drawn again for every move of the mouse.
        editor.revision = revision

    def release(self, event: pygame.event.Event) -> None:
        """Handle the release of a button."""
        if event.button != self._button or not self.is_busy:
            return
        editor = self.editor
        gesture = self.gesture
        self.reset()
        if gesture is Gesture.TOOL:
            pointer = self._build_event(event.pos)
            is_click = not self._has_moved
            editor.attempt(lambda: editor.tool.release(editor, pointer, clicked=is_click))
            editor.document.history.starts_new_step = True
        elif event.button == 3 and not self._has_moved:
            if editor.tool.is_busy:
                editor.attempt(lambda: editor.tool.finish(editor))
            else:
                self._open_menu(event.pos)

    def turn_wheel(self, event: pygame.event.Event, pixel: tuple[int, int]) -> None:
        """Zoom about a pixel by the notches of the wheel."""
        if self.canvas.contains(pixel):
            self.canvas.zoom(ZOOM_PER_NOTCH ** get_wheel_notches(event), pixel)

    def _build_event(self, pixel: tuple[int, int]) -> EditorPointerEvent:
        """Return the pointer at a pixel, snapped unless the tool or Ctrl prevents it."""
        editor = self.editor
        tool = editor.tool
        raw = self.canvas.to_world(pixel)
        reach = REACH_PX * editor.pixel
        modifiers = pygame.key.get_mods()
        has_ctrl = bool(modifiers & (pygame.KMOD_CTRL | pygame.KMOD_META))
        point = raw
        if tool.snaps:
            snap = Snap(raw)
            if editor.snaps and not has_ctrl:
                snap = editor.snap(raw, reach, tool.origin, tool.snap_points)
            point = snap.point
            tool.guides = snap.guides
        return EditorPointerEvent(
            point=point,
            raw=raw,
            reach=reach,
            shift=bool(modifiers & pygame.KMOD_SHIFT),
            alt=bool(modifiers & pygame.KMOD_ALT),
            ctrl=has_ctrl,
        )
