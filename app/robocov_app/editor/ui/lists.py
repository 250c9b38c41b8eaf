"""Lists in the panel that are drawn, not made of widgets: vertices and problems; a click takes a line."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pygame

from robocov_app.editor.canvas.overlay import draw_badge
from robocov_app.editor.edits.fixes import TITLES
from robocov_app.editor.model.selection import Selection, Vertex, numbered_name, place_of, points_of
from robocov_app.editor.model.sketch import BOUNDARY, Owner
from robocov_app.editor.model.validation import Problem
from robocov_app.editor.ui.commands import fix_problem
from robocov_app.render.canvas import Canvas
from robocov_app.render.fonts import label, shortened
from robocov_app.render.theme import mix
from robocov_app.viewer.layout import inside
from robocov_app.viewer.overlays import FLAT, wrapped

if TYPE_CHECKING:
    from robocov_app.editor.ui.editor import Editor
    from robocov_app.render.theme import Theme
    from robocov_app.viewer.layout import Box

MOST_ROWS = 5000


class Row(NamedTuple):
    """A line of a list: where it begins and how high it is, px at scale 1; what it is about."""

    top: float
    height: float
    lines: tuple[str, ...]
    about: Vertex | Problem | Selection | int


class PanelList(ABC):
    """A list that scrolls."""

    def __init__(self, desk: Editor) -> None:
        self._desk = desk
        self.box: Box = (0, 0, 0, 0)
        self._scale = 1.0
        self._scrolled = 0.0
        self._rows: list[Row] = []
        self._key: object = None

    @abstractmethod
    def rows(self, wide: float) -> list[Row]:
        """Return the lines for a width in pixels at scale 1."""

    @abstractmethod
    def key(self) -> object:
        """Return all that the lines depend on."""

    @abstractmethod
    def chosen(self, row: Row) -> bool:
        """Return whether a line is about what is chosen."""

    @abstractmethod
    def take(self, row: Row) -> None:
        """Take a click on a line."""

    def empty_words(self) -> str:
        """Return what to say where there are no lines."""
        return ""

    def wheel(self, amount: float) -> None:
        """Scroll."""
        self._scrolled -= 40.0 * amount

    def click(self, pixel: tuple[int, int]) -> bool:
        """Take a click; say whether it was on a line."""
        if not inside(self.box, pixel):
            return False
        y = (pixel[1] - self.box[1]) / self._scale + self._scrolled
        for row in self._rows:
            if row.top <= y < row.top + row.height:
                self.take(row)
                return True
        return False

    def draw(self, screen: pygame.Surface, box: Box, theme: Theme, scale: float) -> None:
        """Draw it in a box."""
        self.box, self._scale = box, scale
        left, top, width, height = box
        if height < 12 * scale:
            return
        key = (self.key(), width, scale)
        if key != self._key:
            self._key, self._rows = key, self.rows(width / scale - 24)
        whole = self._rows[-1].top + self._rows[-1].height if self._rows else 0.0
        self._scrolled = min(max(self._scrolled, 0.0), max(whole - height / scale, 0.0))
        clip = pygame.Rect(box)
        screen.set_clip(clip)
        if not self._rows:
            words = wrapped(self.empty_words(), round(11.5 * scale), width - 30 * scale)
            for k, line in enumerate(words):
                at = (left + round(12 * scale), top + round((4 + 18 * k) * scale))
                screen.blit(label(line, round(11.5 * scale), theme.faint), at)
        for row in self._rows:
            y = top + (row.top - self._scrolled) * scale
            if y + row.height * scale >= top and y < top + height:
                rect = pygame.Rect(
                    left + round(6 * scale), round(y), width - round(12 * scale), round(row.height * scale)
                )
                if self.chosen(row):
                    tint = mix(theme.panel, theme.final, 0.2)
                    pygame.draw.rect(screen, tint, rect, border_radius=round(4 * scale))
                self.draw_row(screen, row, rect, theme, scale)
        if whole * scale > height:
            high = max(height * height / (whole * scale), 20 * scale)
            y = top + (height - high) * self._scrolled / max(whole - height / scale, 1e-9)
            knob = pygame.Rect(left + width - round(7 * scale), round(y), round(4 * scale), round(high))
            pygame.draw.rect(screen, mix(theme.panel, theme.ink, 0.3), knob, border_radius=round(2 * scale))
        screen.set_clip(None)

    @abstractmethod
    def draw_row(
        self, screen: pygame.Surface, row: Row, rect: pygame.Rect, theme: Theme, scale: float
    ) -> None:
        """Draw a line."""


class VertexList(PanelList):
    """The vertices of what is selected, with their coordinates."""

    def key(self) -> object:
        """Return the sketch and whose vertices are listed."""
        return id(self._desk.sketch), self._desk.handled

    def rows(self, wide: float) -> list[Row]:
        """Return one line for each vertex."""
        found = [vertex for owner in self._desk.handled for vertex, _ in points_of(self._desk.sketch, owner)]
        return [Row(20.0 * k, 20.0, (str(k + 1),), vertex) for k, vertex in enumerate(found[:MOST_ROWS])]

    def chosen(self, row: Row) -> bool:
        """Return whether the vertex is selected."""
        return row.about in self._desk.selection.vertices

    def take(self, row: Row) -> None:
        """Select the vertex; with Shift it too."""
        assert isinstance(row.about, Vertex)
        own = Selection(vertices=frozenset({row.about}))
        added = pygame.key.get_mods() & pygame.KMOD_SHIFT
        self._desk.select(Selection(vertices=self._desk.selection.vertices).toggled(own) if added else own)

    def draw_row(
        self, screen: pygame.Surface, row: Row, rect: pygame.Rect, theme: Theme, scale: float
    ) -> None:
        """Draw number, x and y in columns; in a drag, where the vertex is by now."""
        assert isinstance(row.about, Vertex)
        size = round(11.5 * scale)
        x, y = place_of(self._desk.preview[0], row.about)
        texts = (*row.lines, f"{x:.3f}", f"{y:.3f}")
        for text, right, ink in zip(texts, (34, 130, 226), (theme.faint, theme.ink, theme.ink), strict=True):
            words = label(text, size, ink)
            screen.blit(words, words.get_rect(midright=(rect.left + round(right * scale), rect.centery)))
        unit = label("m", size, theme.faint)
        screen.blit(unit, unit.get_rect(midleft=(rect.left + round(232 * scale), rect.centery)))


class ThingList(PanelList):
    """All things of the map, the topmost first, also those that are locked or hidden; a click selects one."""

    def key(self) -> object:
        """Return the sketch: every edit makes another one."""
        return id(self._desk.sketch)

    def rows(self, wide: float) -> list[Row]:
        """Return one line for each obstacle and start, and the boundary."""
        sketch = self._desk.sketch
        things: list[tuple[Owner, str]] = []
        for item in reversed(sketch.obstacles):
            marks = [item.group, "locked" if item.locked else "", "hidden" if item.hidden else ""]
            things.append((item.key, " · ".join(filter(None, marks))))
        things += [(name, "") for name, _ in sketch.starts]
        things += [(BOUNDARY, "")] if sketch.boundary is not None else []
        return [
            Row(20.0 * k, 20.0, (numbered_name(sketch, owner), marks), Selection.of(owner))
            for k, (owner, marks) in enumerate(things[:MOST_ROWS])
        ]

    def chosen(self, row: Row) -> bool:
        """Return whether it is selected."""
        return isinstance(row.about, Selection) and row.about.owners <= self._desk.selection.owners

    def take(self, row: Row) -> None:
        """Select it; with Shift it too."""
        assert isinstance(row.about, Selection)
        added = pygame.key.get_mods() & pygame.KMOD_SHIFT
        before = self._desk.selection.without_vertices()
        self._desk.select(before.toggled(row.about) if added else row.about)

    def draw_row(
        self, screen: pygame.Surface, row: Row, rect: pygame.Rect, theme: Theme, scale: float
    ) -> None:
        """Draw its name, and what is marked of it."""
        size = round(11.5 * scale)
        name, marks = row.lines
        said = label(marks, size, theme.faint)
        screen.blit(said, said.get_rect(midright=(rect.right - round(10 * scale), rect.centery)))
        ink = theme.faint if "hidden" in marks else theme.ink
        words = label(shortened(name, size, rect.width - said.get_width() - 24 * scale), size, ink)
        screen.blit(words, words.get_rect(midleft=(rect.left + round(8 * scale), rect.centery)))


class ProblemList(PanelList):
    """What is wrong with the map."""

    def key(self) -> object:
        """Return the problems."""
        return tuple(id(problem) for problem in self._desk.problems)

    def rows(self, wide: float) -> list[Row]:
        """Return some lines for each problem."""
        rows: list[Row] = []
        y = 2.0
        for problem in self._desk.problems[:MOST_ROWS]:
            lines = tuple(wrapped(problem.words, 12, wide - (36 if problem.kind not in TITLES else 96)))
            high = 17.0 * len(lines) + 11
            rows.append(Row(y, high, lines, problem))
            y += high + 2
        return rows

    def empty_words(self) -> str:
        """Return that all is well, or that nobody knows yet."""
        return "Nothing is wrong with the map." if self._desk.measurement is not None else "Being looked at …"

    def chosen(self, row: Row) -> bool:
        """Return whether the problem is the one that is shown."""
        return row.about is self._desk.problem

    def click(self, pixel: tuple[int, int]) -> bool:
        """Show the problem; a click on its button mends it."""
        if not super().click(pixel):
            return False
        desk, problem = self._desk, self._desk.problem
        left, _, width, _ = self.box
        if problem is not None and problem.kind in TITLES and pixel[0] > left + width - 70 * self._scale:
            desk.attempt(lambda: fix_problem(desk))
        return True

    def take(self, row: Row) -> None:
        """Show the problem, and select what it is about."""
        assert isinstance(row.about, Problem)
        self._desk.problem = row.about
        if row.about.of is not None:
            self._desk.select(Selection.of(row.about.of).within(self._desk.sketch))
        self._desk.version += 1

    def draw_row(
        self, screen: pygame.Surface, row: Row, rect: pygame.Rect, theme: Theme, scale: float
    ) -> None:
        """Draw the badge and the words."""
        assert isinstance(row.about, Problem)
        canvas = Canvas(screen, FLAT, theme, scale, np.zeros(1, dtype=np.intp))
        draw_badge(canvas, rect.left + 14 * scale, rect.top + 14 * scale, grave=row.about.grave)
        if row.about.kind in TITLES:
            button = pygame.Rect(rect.right - round(62 * scale), rect.top + round(3 * scale), 0, 0)
            button.size = round(54 * scale), round(22 * scale)
            pygame.draw.rect(screen, mix(theme.panel, theme.ink, 0.3), button, 1, round(4 * scale))
            words = label(TITLES[row.about.kind], round(11.5 * scale), theme.ink)
            screen.blit(words, words.get_rect(center=button.center))
        for k, line in enumerate(row.lines):
            at = (rect.left + round(30 * scale), rect.top + round((6 + 17 * k) * scale))
            screen.blit(label(line, round(12 * scale), theme.ink), at)


class HistoryList(PanelList):
    """What was done, the newest first, with what was undone above it; a click goes there."""

    def key(self) -> object:
        """Return what there is now: every edit makes another sketch."""
        history = self._desk.document.history
        return history, id(history.sketch), bool(history.future)

    def rows(self, wide: float) -> list[Row]:
        """Return a line for each edit, about how many are to be undone to be there."""
        history = self._desk.document.history
        future, past = history.future[:MOST_ROWS], history.past[:MOST_ROWS]
        steps = [(words, k - len(future)) for k, words in enumerate(reversed(future))]
        steps += [(words, k) for k, words in enumerate(past)]
        steps.append(("as it was opened" if len(past) < MOST_ROWS else "…", len(past)))
        return [Row(22.0 * k, 22.0, (words,), count) for k, (words, count) in enumerate(steps)]

    def chosen(self, row: Row) -> bool:
        """Return whether the map is as it was after that edit."""
        return row.about == 0

    def take(self, row: Row) -> None:
        """Go there."""
        assert isinstance(row.about, int)
        self._desk.travel(row.about)

    def draw_row(
        self, screen: pygame.Surface, row: Row, rect: pygame.Rect, theme: Theme, scale: float
    ) -> None:
        """Draw what was done; what was undone is faint."""
        assert isinstance(row.about, int)
        size = round(12 * scale)
        ink = theme.ink if row.about >= 0 else theme.faint
        words = shortened(row.lines[0], size, rect.width - 16 * scale)
        picture = label(words, size, ink)
        screen.blit(picture, picture.get_rect(midleft=(rect.left + round(8 * scale), rect.centery)))
