"""The editor's panel: file and tools stay in sight, the rest is on pages."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robocov_app.editor.ui.commands import all_commands
from robocov_app.editor.ui.fields import FIELDS
from robocov_app.editor.ui.lists import HistoryList, PanelList, ProblemList, ThingList, VertexList
from robocov_app.editor.ui.pages import (
    FACTS,
    OBJECT_HEIGHTS,
    facts,
    history_page,
    map_page,
    object_kind,
    object_page,
    object_words,
    problems_page,
    snap_page,
)
from robocov_app.editor.ui.settings import SHOWN, SNAPS
from robocov_app.render.fonts import shortened
from robocov_app.viewer.paged import Paged
from robocov_app.viewer.pages import MARGIN, WIDE, columns

if TYPE_CHECKING:
    from collections.abc import Callable

    import pygame

    from robocov_app.editor.ui.editor import Editor
    from robocov_app.render.theme import Theme
    from robocov_app.viewer.layout import Box
    from robocov_app.viewer.widgets import Widgets

TABS = ("map", "object", "snap", "problems", "history")


class Panel(Paged):
    """Builds the widgets, and keeps them as the desk is."""

    tabs = TABS
    tab_widths = (44, 56, 46, 72, 54)

    def __init__(self, desk: Editor, do: Callable[[str], None]) -> None:
        super().__init__(desk, all_commands(), do)
        self.desk = desk
        self.vertices, self.things, self.problems = VertexList(desk), ThingList(desk), ProblemList(desk)
        self.history = HistoryList(desk)

    def wanted(self) -> object:
        """Return all on which it depends what widgets there are."""
        return self.tab, object_kind(self.desk) if self.tab == "object" else ""

    def build(self, widgets: Widgets) -> None:
        """Make the widgets."""
        widgets.section("file", None, 8, lambda: self._file(widgets))
        widgets.section("tools", None, 94, lambda: self._tools(widgets))
        below = 100 + 30 * -(-len(self.desk.tools) // 4) + 20
        widgets.section("tabs", None, below, lambda: self._tabs(widgets))
        y = below + 34.0
        self._place_body(widgets, y)
        if self.tab == "map":
            map_page(widgets, self.desk, y)
        elif self.tab == "object":
            object_page(widgets, self.desk, y)
        elif self.tab == "snap":
            snap_page(widgets, self.desk, y)
        elif self.tab == "problems":
            problems_page(widgets, y)
        else:
            history_page(widgets, y)

    def _file(self, widgets: Widgets) -> None:
        rect = widgets.rect
        widgets.label(" " * 60, rect(MARGIN, 0, WIDE, 18), name="title", style="#header")
        rows = (
            (("New", "new"), ("Open", "open"), ("Save", "save"), ("Try it", "try")),
            (("Undo", "undo"), ("Redo", "redo"), ("Keys", "help"), ("Commands", "palette")),
        )
        for k, row in enumerate(rows):
            for (x, width), (text, action) in zip(columns(4), row, strict=True):
                style = "#small" if text == "Commands" else None
                rect_of = rect(x, 20 + 31 * k, width, 27)
                widgets.does(text, rect_of, action, style=style)

    def _tools(self, widgets: Widgets) -> None:
        widgets.label("TOOLS", widgets.rect(MARGIN, 0, WIDE, 18), style="#header")
        for k, tool in enumerate(self.desk.tools.values()):
            x, width = columns(4)[k % 4]
            place = widgets.rect(x, 20 + 30 * (k // 4), width, 26)
            widgets.does(tool.title, place, f"tool:{tool.name}", style="#small")

    # keeping up

    def sync(self, widgets: Widgets) -> None:
        """Let the widgets say what the desk says."""
        desk = self.desk
        self._mark_tabs(widgets)
        document = desk.document
        words = f"{document.title}{', not saved' if document.unsaved else ''}"
        widgets.say("label", "title", shortened(words, round(11 * widgets.scale), WIDE * widgets.scale, True))
        for name in desk.tools:
            widgets.mark(f"tool:{name}", desk.tool.name == name, ("#chosen_tab", "#small"))
        count = len(desk.problems)
        widgets.say("button", "tab:problems", f"Problems {min(count, 99)}" if count else "Problems")
        for name, spec in FIELDS.items():
            if widgets.find("entry", name) is not None:
                widgets.fill(name, spec.text(desk))
        for name in SNAPS:
            widgets.tick(f"snap:{name}", name in desk.snaps)
        for name in SHOWN:
            widgets.tick(f"page:{name}", name in desk.shown)
        widgets.tick("show:robots", "robots" in desk.shown)
        if self.tab == "map":
            said = facts(desk)
            room = (WIDE - 70) * widgets.scale
            for name in FACTS:
                widgets.say("label", f"fact:{name}", shortened(said[name], round(12 * widgets.scale), room))
        if self.tab == "object":
            words = shortened(object_words(desk), round(11 * widgets.scale), WIDE * widgets.scale, True)
            widgets.say("label", "object", words)
        if desk.sketch.background is not None:
            widgets.slide("opacity", desk.sketch.background.opacity)

    def focus(self, name: str) -> None:
        """Let keys go into a field of the open page."""
        if self.widgets is not None:
            self.update(0.0)
            self.widgets.focus(name)

    # lists

    @property
    def list(self) -> PanelList | None:
        """The list that is drawn on the open page."""
        if self.tab in ("problems", "history"):
            return self.problems if self.tab == "problems" else self.history
        if self.tab == "object":
            return self.vertices if self.desk.handled else self.things
        return None

    def list_box(self) -> Box:
        """Return where it is."""
        assert self.widgets is not None
        left, top, width, height = self.body
        used = 40 if self.tab in ("problems", "history") else OBJECT_HEIGHTS[object_kind(self.desk)]
        used = round(used * self.widgets.scale)
        return left, top + used, width, max(height - used - round(6 * self.widgets.scale), 0)

    def draw_list(self, screen: pygame.Surface, theme: Theme) -> None:
        """Draw it."""
        found = self.list
        if found is not None and self.widgets is not None:
            found.draw(screen, self.list_box(), theme, self.widgets.scale)
