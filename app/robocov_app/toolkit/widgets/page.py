"""The page of an immediate-mode user interface: its content runs for every event and every drawing.

`Page` defines no widgets. A widget is a function in `toolkit.widgets` that takes a page, occupies its next
cell, draws itself and returns the user's input; `toolkit.widgets.ui.Ui` is a page with these functions as
methods.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter

import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import Color
from robocov_app.look.theme import Theme
from robocov_app.toolkit.sentence_case import to_sentence_case
from robocov_app.toolkit.widgets.open_list import OpenList
from robocov_app.toolkit.widgets.row_layout import RowLayout
from robocov_app.toolkit.widgets.text_edit import TextEdit
from robocov_app.toolkit.widgets.tool_tip import TipDrawing, TipSide, ToolTip, draw_tool_tip
from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.input import DOUBLE_CLICK_S, ENTER_KEYS, get_key_name

_OUTSIDE = (-1, -1)
"""Position of a pointer that is not in the window."""
_MAX_RUNS = 3
"""Maximum number of runs for one drawing. The height of the content is known only after a run."""


@dataclass
class Widget:
    """A widget as it appeared in the last run, for tooltips, the focus and tests.

    Attributes
    ----------
    kind : str
        Kind of widget, such as "button".
    key : str
        Identifies the widget among those of its kind.
    rect : pygame.Rect
        Visible part in the window, px.
    text : str
    value : object
    tip : str
        Tooltip; if it has several lines, the first one is its title.
    enabled : bool
    drawing : TipDrawing or None
        Drawing in the tooltip.
    """

    kind: str
    key: str
    rect: Rect
    text: str = ""
    value: object = None
    tip: str = ""
    enabled: bool = True
    drawing: TipDrawing | None = None


class Page(RowLayout):
    """Runs the content of a page, a function that shows widgets, inside a box of the window.

    Parameters
    ----------
    theme : Theme
    scale : float
        Size of texts and widgets.

    Attributes
    ----------
    background : color or None
        Background color; None if the widgets are drawn over something else.
    needs_redraw : bool
        Whether the page may have changed since it was drawn.
    surface : pygame.Surface or None
        Surface to draw on; None in a run for an event.
    pointer : tuple of int
        Position of the mouse, px.
    focus : str or None
        Key of the widget that receives key presses.
    focused_rect : pygame.Rect or None
        Position of that widget in the last run, also if it is scrolled out of sight, px.
    reveals_focus : bool
        Whether the scroll area scrolls to that widget when it is drawn next.
    active : str or None
        Key of the widget on which a mouse button is held down.
    grab_offset : float
        Distance of the pointer from the left or upper end of the knob being dragged, px.
    drag_value : float
        Value of the slider being dragged, before it is rounded.
    edit : TextEdit or None
        Text being edited, if the widget with the focus is a text field.
    clipboard : Clipboard
        Clipboard for copying and pasting in text fields.
    open_list : OpenList or None
        List of the drop-down menu that is open.
    widgets : dict of str to Widget
        Widgets of the last run by kind and key, such as "button:pause".
    toggled_sections : set of str
        Keys of the sections that are open although they start closed, or closed although they start open.
    scroll_offsets, content_heights : dict of str to float
        Scroll offset and total height of the content at scale 1, px, by the key of the scroll area.
    tool_tip : ToolTip
        Decides when the tooltip of the widget under the pointer appears.
    tip_side : TipSide
        Where tooltips appear: below their widgets, or to the left or right of the page.
    """

    def __init__(self, theme: Theme, scale: float = 1.0) -> None:
        """Build an empty page; its box must be set before it runs."""
        super().__init__(scale)
        self.theme = theme
        self.background: Color | None = theme.panel
        self.needs_redraw = True
        self.surface: Surface | None = None
        self.pointer = _OUTSIDE
        self.focus: str | None = None
        self.focused_rect: Rect | None = None
        self.reveals_focus = False
        self.active: str | None = None
        self.grab_offset = 0.0
        self.drag_value = 0.0
        self.edit: TextEdit | None = None
        self.clipboard = Clipboard()
        self.open_list: OpenList | None = None
        self.widgets: dict[str, Widget] = {}
        self.toggled_sections: set[str] = set()
        self.scroll_offsets: dict[str, float] = {}
        self.content_heights: dict[str, float] = {}
        self._event: pygame.event.Event | None = None
        self._image: Surface | None = None
        self._runs_again = False
        self._last_click_s = -1.0
        self._last_click_key = ""
        self.tool_tip = ToolTip()
        self.tip_side: TipSide = "below"

    def build(self) -> None:
        """Show the widgets and handle their input; called in every run."""

    def run(self, event: pygame.event.Event | None = None, surface: Surface | None = None) -> None:
        """Run the content to handle an event, to draw it, or only to measure its height.

        Parameters
        ----------
        event : pygame.event.Event, optional
        surface : pygame.Surface, optional
            Surface to draw on.
        """
        self._event = event
        self.surface = surface
        self.restart()
        self.widgets = {}
        self.build()
        self.end_row()
        self._event = None
        self.surface = None
        if self.focus not in self.list_focusable_keys():
            # The widget with the focus has disappeared.
            self.focus = None
            self.edit = None

    def list_focusable_keys(self) -> list[str]:
        """Return the keys of the widgets that can have the focus, in the order in which Tab visits them."""
        widgets = self.widgets.values()
        keys = [widget.key for widget in widgets if widget.enabled and widget.kind not in ("label", "bar")]
        # A slider and the text field of the same value have one key.
        return list(dict.fromkeys(keys))

    # Focus

    @property
    def is_busy(self) -> bool:
        """Whether text is being edited, a list is open or a mouse button is held down."""
        return self.active is not None or self.edit is not None or self.open_list is not None

    def leave(self) -> None:
        """Record that the pointer has left the window, so that it is over no widget."""
        self.pointer = _OUTSIDE
        self.tool_tip.set_hovered("")
        self.needs_redraw = True

    def clear_focus(self) -> None:
        """Take the focus away from all widgets, and close the open list."""
        self.focus = None
        self.edit = None
        self.open_list = None
        self.needs_redraw = True

    def set_focus(self, key: str) -> None:
        """Give the focus to a widget; if it is a text field, start editing it."""
        self.focus = key
        self.reveals_focus = True
        self.open_list = None
        self.needs_redraw = True
        self.edit = None
        entry = self.find("entry", key)
        if entry is not None:
            self.edit = TextEdit.select_all(entry.text)

    def get_edit(self, key: str) -> TextEdit | None:
        """Return the text being edited in a field; None while it is not being edited."""
        if self.focus != key:
            return None
        return self.edit

    # Drawing

    def draw(self, screen: Surface) -> None:
        """Draw the page; if nothing has changed, copy the image of the last drawing."""
        if not self.needs_redraw and self._image is not None and self._image.get_size() == self.box.size:
            screen.blit(self._image, self.box)
            return
        self.needs_redraw = False
        for _ in range(_MAX_RUNS):
            self._runs_again = False
            if self.background is not None:
                screen.fill(self.background, self.box)
            self.run(None, screen)
            if not self._runs_again:
                break
        if self.background is not None:
            self._image = screen.subsurface(self.box.clip(screen.get_rect())).copy()

    def request_another_run(self) -> None:
        """Request one more run for this drawing, because the height of something has changed."""
        self._runs_again = True

    def draw_overlays(self, screen: Surface) -> None:
        """Draw the open list and the tooltip, which may be larger than the page."""
        if self.open_list is not None:
            self.open_list.draw(screen, self.theme, self.scale)
        widget = next((widget for widget in self.find_hovered_widgets() if widget.tip), None)
        if widget is not None and self.active is None and self.tool_tip.is_due:
            draw_tool_tip(
                screen,
                widget.tip,
                self.theme,
                self.scale,
                widget=widget.rect,
                page=self.box,
                side=self.tip_side,
                drawing=widget.drawing,
            )

    # For widgets

    def is_pointer_inside(self) -> bool:
        """Return whether the pointer is in the box of the page."""
        return bool(self.box.collidepoint(self.pointer))

    def find_hovered_widgets(self) -> Iterator[Widget]:
        """Yield the widgets under the pointer; none while a list is open."""
        if self.open_list is None and self.is_pointer_inside():
            for widget in self.widgets.values():
                if widget.rect.collidepoint(self.pointer):
                    yield widget

    def find(self, kind: str, key: str) -> Widget | None:
        """Return the widget with this kind and key in the last run; None if there was none."""
        return self.widgets.get(f"{kind}:{key}")

    def is_event(self, event_type: int) -> bool:
        """Return whether the run is for an event of this type that no widget has consumed yet."""
        return self._event is not None and self._event.type == event_type

    def consume_event(self) -> None:
        """Hide the event from the following widgets."""
        self._event = None

    def get_event(self) -> pygame.event.Event | None:
        """Return the event for which the page runs; None if there is none, or if it was consumed."""
        return self._event

    def get_key(self, key: str) -> str:
        """Return the name of the key just pressed, if this widget has the focus; otherwise empty."""
        if self._event is None or self.focus != key or self._event.type != pygame.KEYDOWN:
            return ""
        return get_key_name(self._event)

    def is_hovered(self, rect: Rect) -> bool:
        """Return whether the pointer is over a visible part of `rect`, with no button held or list open."""
        is_free = self.open_list is None and self.active is None
        return is_free and bool(rect.collidepoint(self.pointer) and self.clip.collidepoint(self.pointer))

    def is_pressed(self, rect: Rect) -> bool:
        """Return whether the left button was just pressed over the visible part of a rectangle."""
        return self.is_event(pygame.MOUSEBUTTONDOWN) and self.is_hovered(rect)

    def record_click(self, key: str) -> bool:
        """Record a click on a widget, and return whether it is the second one of a double click."""
        now = perf_counter()
        is_second = now - self._last_click_s < DOUBLE_CLICK_S and self._last_click_key == key
        self._last_click_s = now
        self._last_click_key = key
        return is_second

    def add_widget(self, widget: Widget, disabled_reason: str = "") -> None:
        """Register a widget of this run.

        Parameters
        ----------
        widget : Widget
            The widget. Its rectangle is clipped to the visible part.
        disabled_reason : str
            Why the widget is disabled, which is appended to its tooltip; empty if it is enabled.
        """
        if widget.key == self.focus:
            self.focused_rect = widget.rect.copy()
        widget.rect = widget.rect.clip(self.clip)
        widget.enabled = not disabled_reason
        widget.tip = to_sentence_case(": ".join(text for text in (widget.tip, disabled_reason) if text))
        self.widgets[f"{widget.kind}:{widget.key}"] = widget

    def add_clickable(self, widget: Widget, disabled_reason: str = "") -> bool:
        """Register a widget that reacts to a click, Enter or Space; return whether it was just used.

        A click is complete only when the button is released over the widget on which it was pressed.
        """
        rect = widget.rect
        key = widget.key
        self.add_widget(widget, disabled_reason)
        if disabled_reason:
            return False
        if self.is_pressed(rect):
            self.active = key
            self.consume_event()
        elif self.is_event(pygame.MOUSEBUTTONUP) and self.active == key:
            self.active = None
            self.consume_event()
            return bool(rect.collidepoint(self.pointer) and self.clip.collidepoint(self.pointer))
        elif self.get_key(key) in (*ENTER_KEYS, "space"):
            self.consume_event()
            return True
        return False
