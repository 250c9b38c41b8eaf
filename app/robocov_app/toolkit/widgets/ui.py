"""Immediate-mode widgets: a page is a function that shows each value and handles its input in one place.

The function runs once for every event and once for every drawing. A widget returns the user's input in this
run: a button returns True when it is pressed; others return the new value, or None if nothing happened::

    def show_run(ui: Ui) -> None:
        ui.row(0, 0, 80)  # Widths of the cells at scale 1; cells of width 0 share the rest.
        if ui.button("Pause", key="pause", disabled_reason="" if is_running else "nothing runs"):
            pause()
        robots = ui.text_field("robots", str(count))
        if robots is not None:  # After Enter.
            set_count(robots)

Keys of widgets are unique within a page.
"""

from collections.abc import Callable

import pygame

from robocov_app.look.theme import Theme
from robocov_app.toolkit.widgets import (
    buttons,
    dropdown,
    icon_buttons,
    labels,
    scroll_area,
    sections,
    slider,
    text_field,
)
from robocov_app.toolkit.widgets.page import Page
from robocov_app.toolkit.widgets.page_events import PageEvents


class Ui(Page):
    """A page that has the widgets as methods.

    Parameters
    ----------
    content : callable
        Called with the page in every run; shows the widgets and handles their input.
    theme : Theme
    scale : float
        Size of texts and widgets.
    """

    # Each widget is a function of the page in a module of `widgets`, where it is documented.
    header = labels.show_header
    label = labels.show_label
    paragraph = labels.show_paragraph
    button = buttons.show_button
    icon_button = icon_buttons.show_icon_button
    main_button = icon_buttons.show_main_button
    option = buttons.show_option
    area = buttons.show_area
    tabs = buttons.show_tabs
    check_box = buttons.show_check_box
    section = sections.show_section
    slider = slider.show_slider
    text_field = text_field.show_text_field
    dropdown = dropdown.show_dropdown
    scroll = scroll_area.scroll
    visible_rows = scroll_area.list_visible_rows

    def __init__(self, content: Callable[["Ui"], None], theme: Theme, scale: float = 1.0) -> None:
        super().__init__(theme, scale)
        self._content = content
        self._events = PageEvents(self)

    def build(self) -> None:
        """Run the content function."""
        self._content(self)

    def handle_event(self, event: pygame.event.Event) -> bool:
        """Pass an event to the widgets; return whether it was meant for the page."""
        return self._events.handle(event)
