"""The mouse over the map of the editor: tools, panning, double clicks, wheel and context menu."""

from collections.abc import Callable, Sequence

import pygame

from robocov_app.editor.canvas.canvas import EditorCanvas
from robocov_app.editor.editor import Editor
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.tools.tool import EditorPointerEvent
from robocov_app.toolkit.tools.pointer import (
    LEFT_BUTTON,
    RIGHT_BUTTON,
    Gesture,
    PanGesture,
    Pixel,
    Pointer,
    read_modifiers,
)
from robocov_app.toolkit.tools.snapping import Snap
from robocov_app.toolkit.tools.viewport import REACH_PX
from robocov_app.toolkit.window.input import ZOOM_PER_NOTCH, get_wheel_notches
from robocov_app.toolkit.window_part import WindowPart


class EditorPointer(Pointer):
    """Passes mouse events over the map to the tools, and pans and zooms the view.

    Parameters
    ----------
    editor : Editor
        The editor.
    canvas : EditorCanvas
        The view of the map.
    parts : sequence of WindowPart
        Top bar, tool rail and panel, which receive events first.
    open_menu : callable
        Opens the context menu at a pixel.

    Attributes
    ----------
    pans_with_left : bool
        Whether the left button pans, while a key is held down.
    """

    def __init__(
        self,
        editor: Editor,
        canvas: EditorCanvas,
        parts: Sequence[WindowPart],
        open_menu: Callable[[Pixel], object],
    ) -> None:
        super().__init__(parts)
        self.editor = editor
        self.canvas = canvas
        self.pans_with_left = False
        self._open_menu = open_menu

    def get_scale(self) -> float:
        """Return the scale of the window."""
        return self.canvas.layout.scale

    @property
    def is_panning(self) -> bool:
        """Whether a drag pans the view."""
        return self.pans_with_left or (self.gesture is not None and self.gesture.is_pan)

    def hold_pan(self) -> None:
        """Let the left button pan until the key is released."""
        self.pans_with_left = True

    def leave(self) -> None:
        """Forget the position of the mouse, which has left the map."""
        self.editor.cursor = None
        self.canvas.cursor_pixel = None
        self.canvas.hovered = None

    def start_gesture(self, event: pygame.event.Event, now: float) -> Gesture | None:
        """Handle a press: start to pan, show or hide the message of a problem, or start to use the tool.

        Return None if the press is outside the sheet or on a problem, because it starts no gesture there.
        """
        if not self.canvas.contains(event.pos):
            return None
        tool = self.editor.tool
        if event.button != LEFT_BUTTON or tool.name == "pan" or self.pans_with_left:
            return PanGesture(self.canvas.pan, self._click_without_tool)
        problem = self.canvas.find_problem(event.pos)
        if problem is not None and not tool.is_busy:
            self._toggle_problem(problem)
            return None
        self._press_tool(event, now)
        return EditorToolGesture(self)

    def _toggle_problem(self, problem: Problem) -> None:
        """Show the message of a problem, or hide it if it is shown."""
        editor = self.editor
        if editor.problem is problem:
            editor.problem = None
            editor.clear_message()
        else:
            editor.problem = problem
            editor.show_message(problem.message, is_error=problem.is_error)
        editor.revision += 1

    def _press_tool(self, event: pygame.event.Event, now: float) -> None:
        editor = self.editor
        pointer = self._build_event(event.pos)
        handle = editor.tool.press
        if self._record_press(event, now):
            handle = editor.tool.double_click
        editor.attempt(lambda: handle(editor, pointer))

    def _record_press(self, event: pygame.event.Event, now: float) -> bool:
        """Record a press; return whether it completes a double click. A third quick one is single again."""
        return self.record_press(event, now) % 2 == 0

    def _click_without_tool(self, event: pygame.event.Event) -> None:
        """Handle a click of a button that pans: a right click completes a drawing or opens the menu."""
        editor = self.editor
        if event.button != RIGHT_BUTTON:
            return
        if editor.tool.is_busy:
            editor.attempt(lambda: editor.tool.finish(editor))
        else:
            self._open_menu(event.pos)

    def hover(self, event: pygame.event.Event) -> None:
        """Update the position of the mouse and, while no button is held down, the problem under it."""
        editor = self.editor
        canvas = self.canvas
        is_over_map = canvas.contains(event.pos)
        is_using_tool = self.gesture is not None and not self.gesture.is_pan
        self.leave()
        if is_over_map or is_using_tool:
            editor.cursor = canvas.to_world(event.pos)
            canvas.cursor_pixel = (float(event.pos[0]), float(event.pos[1]))
        if self.is_busy:
            return
        if is_over_map:
            canvas.hovered = canvas.find_problem(event.pos)
            self.move_tool(event)
        else:
            editor.tool.guides = ()

    def move_tool(self, event: pygame.event.Event) -> None:
        """Pass a move of the mouse to the tool."""
        editor = self.editor
        pointer = self._build_event(event.pos)
        revision = editor.revision
        editor.attempt(lambda: editor.tool.move(editor, pointer))
        # The panel need not be redrawn for every move of the mouse.
        editor.revision = revision

    def release_tool(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Pass the release of the button to the tool."""
        editor = self.editor
        pointer = self._build_event(event.pos)
        editor.attempt(lambda: editor.tool.release(editor, pointer, is_click=is_click))
        editor.document.history.starts_new_step = True

    def handle_wheel(self, event: pygame.event.Event) -> None:
        """Zoom about the mouse position, by the notches that the wheel has turned."""
        if self.canvas.contains(self.pixel):
            self.canvas.zoom(ZOOM_PER_NOTCH ** get_wheel_notches(event), self.pixel)

    def _build_event(self, pixel: Pixel) -> EditorPointerEvent:
        """Build the event of the pointer at a pixel; its point snaps unless the tool or Ctrl prevents it."""
        editor = self.editor
        tool = editor.tool
        unsnapped = self.canvas.to_world(pixel)
        reach = REACH_PX * editor.pixel
        modifiers = read_modifiers()
        point = unsnapped
        if tool.snaps:
            snap = Snap(unsnapped)
            if editor.snaps and not modifiers.ctrl:
                snap = editor.snap(unsnapped, reach, tool.origin, tool.snap_points)
            point = snap.point
            tool.guides = snap.guides
        return EditorPointerEvent(
            point=point,
            unsnapped_point=unsnapped,
            reach=reach,
            shift=modifiers.shift,
            alt=modifiers.alt,
            ctrl=modifiers.ctrl,
        )


class EditorToolGesture(Gesture):
    """Gesture that passes a drag to the tool.

    Parameters
    ----------
    pointer : EditorPointer
        The mouse over the map.
    """

    def __init__(self, pointer: EditorPointer) -> None:
        self._pointer = pointer

    def move(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Pass a move to the tool."""
        self._pointer.move_tool(event)

    def release(self, event: pygame.event.Event, *, is_click: bool) -> None:
        """Pass the release of the button to the tool."""
        self._pointer.release_tool(event, is_click=is_click)
