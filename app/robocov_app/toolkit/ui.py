"""Immediate-mode widgets: a page is a function that shows and edits each value in one place.

A page runs once for every event and once for every drawing; a widget returns what the user did to it in
this run: a button True, others the new value, None where nothing happened::

    def page(ui: Ui) -> None:
        ui.row(0, 0, 80)  # widths at scale 1 of the cells of the rows to come; 0 shares what is left
        if ui.button("Pause", key="pause", why="" if running else "nothing runs"):
            pause()
        if (robots := ui.text_entry("robots", str(count))) is not None:  # after Enter
            set_count(robots)

Keys of widgets are unique within a page. Where `why` is given a widget is disabled, and says so in its tip.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter

import pygame
from pygame import Rect, Surface

from robocov_app.look.colors import Color, mix
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.fonts import label, shortened, text_width
from robocov_app.toolkit.input import DOUBLE, OF_THE_MOUSE, key_of, wheel_notches
from robocov_app.toolkit.layout import Layout
from robocov_app.toolkit.overlay import field_color, on_accent, rounded, wrapped
from robocov_app.toolkit.text_edit import TextEdit

# pixels at scale 1
TEXT = 12.0  # a widget's text
SMALL = 11.0  # the text of small buttons, headings and units
BAR = 10.0  # width of a scroll bar
MARGIN = 12.0  # of a panel, in which its scroll bar is
LONGEST_LIST = 268.0  # greatest height of an open list
LIST_ROW = 24.0
_TALLEST = 32.0  # a button in a row that is higher
_NOTCH = 40.0
TIP_AFTER = 0.6  # seconds for which the mouse rests before a tool tip appears
_ENTER = ("return", "enter")


@dataclass
class Shown:
    """One widget as it was shown last: what tests and tool tips look at."""

    kind: str
    key: str
    rect: Rect
    text: str = ""
    value: object = None
    tip: str = ""
    enabled: bool = True


def _is_function_key(name: str) -> bool:
    return name[:1] == "f" and name[1:].isdigit()


@dataclass
class _List:
    """An open list: what it offers, and where."""

    key: str  # of the menu that it hangs from
    options: list[str]
    rect: Rect
    row: int
    chosen: int = 0
    top: float = 0.0
    picked: str | None = None

    @property
    def beyond(self) -> float:
        return max(len(self.options) * self.row + 2 - self.rect.height, 0)

    def item(self, k: int) -> Rect:
        y = self.rect.top + 1 + k * self.row - round(self.top)
        return Rect(self.rect.left + 1, y, self.rect.width - 2, self.row)

    def at(self, pixel: tuple[int, int]) -> int | None:
        k = int((pixel[1] - self.rect.top - 1 + self.top) // self.row)
        return k if self.rect.collidepoint(pixel) and 0 <= k < len(self.options) else None

    def show(self, k: int) -> None:
        self.chosen = min(max(k, 0), len(self.options) - 1)
        low, high = self.chosen * self.row, (self.chosen + 1) * self.row + 2 - self.rect.height
        self.top = min(max(self.top, high, 0.0), low)


class Ui:
    """Runs a page in a box of the window."""

    def __init__(self, page: Callable[["Ui"], None], theme: Theme, scale: float = 1.0) -> None:
        self.page, self.theme, self.scale = page, theme, scale
        self.box = Rect(0, 0, 1, 1)  # where the page is, px
        self.background: Color | None = theme.panel
        self.stale = True  # whether what was drawn is not what there is any more
        self.at = (-1, -1)
        self.focus: str | None = None
        self.active: str | None = None
        self.edit: TextEdit | None = None
        self.open_list: _List | None = None
        self._event: pygame.event.Event | None = None
        self.surface: Surface | None = None  # to draw on in cells; None in a run for an event
        self._picture: Surface | None = None
        self._folded: set[str] = set()
        self._scrolled: dict[str, float] = {}
        self._heights: dict[str, float] = {}
        self._hot, self._rested = "", perf_counter()
        self._clicked = (-1.0, "")
        self._again, self._grabbed = False, 0.0
        self._begin()

    def _begin(self) -> None:
        self.x, self.y, self.wide = 0.0, 0.0, self.box.width / self.scale
        self._clip = self.box
        self._cells: list[tuple[float, float]] = []
        self._next, self._height, self._below = 0, 26.0, 6.0
        self.shown: dict[str, Shown] = {}  # the widgets of the last run

    @property
    def _order(self) -> list[str]:
        """Keys of what can have the focus, in the order of Tab."""
        shown = self.shown.values()
        return [each.key for each in shown if each.enabled and each.kind not in ("label", "bar")]

    def run(self, event: pygame.event.Event | None, surface: Surface | None) -> None:
        """Run the page for an event, for a drawing, or to learn how high it is."""
        self._event, self.surface = event, surface
        self._begin()
        self.page(self)
        self.end_row()
        self._event = self.surface = None
        if self.focus not in self._order:  # its widget is gone
            self.focus = self.edit = None

    def take(self, event: pygame.event.Event) -> bool:
        """Give an event to the widgets; return whether it was meant for one of them."""
        kind, held = event.type, self.active
        if kind in (pygame.MOUSEMOTION, pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            self.at = event.pos
        if kind == pygame.MOUSEMOTION:
            if self.open_list is not None and (k := self.open_list.at(event.pos)) is not None:
                self.open_list.chosen = k
            if held is None:
                under = next((f"{each.kind}:{each.key}" for each in self._under()), "")
                if under != self._hot:
                    self._hot, self._rested, self.stale = under, perf_counter(), True
                return self.box.collidepoint(event.pos)
        elif kind == pygame.MOUSEBUTTONDOWN and event.button != 1:
            return self.box.collidepoint(event.pos)
        if kind in (pygame.MOUSEBUTTONDOWN, pygame.KEYDOWN):
            self._rested = perf_counter()
        if self.open_list is not None and self._list_takes(event):
            return True
        if kind == pygame.KEYDOWN:
            name = key_of(event)
            if self.focus is None or (self.edit is not None and _is_function_key(name)):
                return False
            if name in ("tab", "shift+tab"):
                order, by = self._order, -1 if "shift" in name else 1
                k = order.index(self.focus) + by if self.focus in order else 0
                self.set_focus(order[k % len(order)] if order else self.focus)
            elif name == "escape":
                self.stop_typing()
            elif self.edit is None and name not in (*_ENTER, "space", "left", "right", "up", "down"):
                return False
        if kind in (pygame.TEXTINPUT, pygame.TEXTEDITING):
            if self.edit is None:
                return False
            if kind == pygame.TEXTEDITING:
                self.edit.composed = event.text
            else:
                self.edit.type(event.text)
            self.stale = True
            return True
        if kind not in (*OF_THE_MOUSE, pygame.KEYDOWN):
            return False
        if kind == pygame.MOUSEBUTTONDOWN and self.focus is not None:
            shown = self.shown.values()
            if not any(each.key == self.focus and each.rect.collidepoint(event.pos) for each in shown):
                self.stop_typing()
        self.stale = True
        self.run(event, None)
        if kind == pygame.MOUSEBUTTONUP:
            self.active = None
        return held is not None or kind == pygame.KEYDOWN or self.box.collidepoint(self.at)

    def _under(self) -> Iterator[Shown]:
        if self.open_list is None and self.box.collidepoint(self.at):
            yield from (each for each in self.shown.values() if each.rect.collidepoint(self.at))

    def draw(self, screen: Surface) -> None:
        if self.stale or self._picture is None or self._picture.get_size() != self.box.size:
            self.stale = False
            for _ in range(3):  # what a page needs of height is known after it has run
                self._again = False
                if self.background is not None:
                    screen.fill(self.background, self.box)
                self.run(None, screen)
                if not self._again:
                    break
            if self.background is not None:
                self._picture = screen.subsurface(self.box.clip(screen.get_rect())).copy()
            return
        screen.blit(self._picture, self.box)

    def draw_over(self, screen: Surface) -> None:
        if self.open_list is not None:
            self._draw_list(screen, self.open_list)
        tipped = next((each for each in self._under() if each.tip), None)
        if tipped is None or self.active is not None or perf_counter() - self._rested < TIP_AFTER:
            return
        size, theme = self.px(SMALL), self.theme
        lines, high = wrapped(tipped.tip, size, self.px(240)), self.px(SMALL + 5)
        box = Rect(0, 0, max(text_width(line, size) for line in lines) + self.px(14), 0)
        box.height = high * len(lines) + self.px(9)
        box.topleft = self.at[0], tipped.rect.bottom + self.px(5)
        if box.bottom > screen.get_height():
            box.bottom = tipped.rect.top - self.px(5)
        box.clamp_ip(screen.get_rect())
        fill = mix(theme.panel, theme.ink, 0.92 if theme is LIGHT else 0.2)
        rounded(screen, box, fill, self._shade(0.24), self.px(4))
        for k, line in enumerate(lines):
            picture = label(line, size, (245, 247, 250))
            screen.blit(picture, (box.left + self.px(7), box.top + self.px(5) + k * high))

    @property
    def busy(self) -> bool:
        return any(each is not None for each in (self.active, self.edit, self.open_list))

    def stop_typing(self) -> None:
        self.focus = self.edit = self.open_list = None
        self.stale = True

    def set_focus(self, key: str) -> None:
        self.focus, self.open_list, self.stale = key, None, True
        entry = self.shown.get(f"entry:{key}")
        self.edit = TextEdit.of(entry.text) if entry is not None else None

    def px(self, length: float) -> int:
        return round(length * self.scale)

    def inset(self, left: float, top: float, right: float = 0.0) -> None:
        self.end_row()
        self.x, self.y, self.wide = self.x + left, self.y + top, self.wide - left - right

    def row(self, *widths: float, height: float = 26.0, gap: float = 6.0, below: float = 6.0) -> None:
        """Lay the next widgets side by side, again and again; a width of 0 shares what is left."""
        self.end_row()
        widths = widths or (0.0,)
        share = (self.wide - sum(widths) - gap * (len(widths) - 1)) / max(widths.count(0), 1)
        self._cells, x = [], self.x
        for width in widths:
            self._cells.append((x, width or share))
            x += (width or share) + gap
        self._height, self._below = height, below

    def end_row(self) -> None:
        if self._next:
            self.y += self._height + self._below
        self._next = 0

    def space(self, height: float) -> None:
        self.end_row()
        self.y += height

    def cell(self) -> Rect:
        if not self._cells:
            self.row()
        if self._next == len(self._cells):
            self.end_row()
        x, width = self._cells[self._next]
        self._next += 1
        left, top = self.box.left + self.px(x), self.box.top + self.px(self.y)
        return Rect(left, top, self.px(width), self.px(self._height))

    @property
    def rest(self) -> Rect:
        """Rest of the box below the last row that was ended, px."""
        left, top = self.box.left + self.px(self.x), self.box.top + self.px(self.y)
        return Rect(left, top, self.px(self.wide), max(self.box.bottom - top, 0))

    @contextmanager
    def scroll(self, key: str) -> Iterator[None]:
        self.end_row()
        room = self.rest.height / self.scale
        before = self.x, self.y, self.wide, self._clip
        rect = Rect(self.box.left, self.rest.top, self.box.width, self.px(room))
        needed = self._heights.get(key, 0.0)
        beyond = max(needed - room, 0.0)
        top = self._scrolled[key] = min(max(self._scrolled.get(key, 0.0), 0.0), beyond)
        if beyond:
            top = self._bar(key, rect, needed, top)
            self.wide -= BAR + 4 - MARGIN
        self._clip = self._clip.clip(rect)
        if self.surface is not None:
            self.surface.set_clip(self._clip)
        self.y -= top
        began, self._cells = self.y, []
        yield
        self.end_row()
        ended = self.y - began
        if abs(ended - needed) > 0.5:
            self._heights[key], self._again = ended, True
        self.x, self.y, self.wide, self._clip = before
        self.y += room
        if self.surface is not None:
            self.surface.set_clip(None)

    def visible_rows(self, count: int, height: float) -> Iterator[int]:
        self.end_row()
        first = int((self._clip.top - self.box.top - self.px(self.y)) / self.px(height))
        first = min(max(first, 0), count)
        last = min(first + self._clip.height // self.px(height) + 2, count)
        self.y += first * height
        self.row(height=height, below=0)
        yield from range(first, last)
        self.end_row()
        self.y += (count - last) * height

    def _bar(self, key: str, rect: Rect, needed: float, top: float) -> float:
        room = rect.height / self.scale
        event, name = self._event, f"bar:{key}"
        track = Rect(rect.right - self.px(BAR + 1), rect.top, self.px(BAR), rect.height)
        knob = Rect(0, 0, track.width, max(round(track.height * room / needed), self.px(20)))
        free = max(track.height - knob.height, 1)
        knob.topleft = track.left, track.top + round(free * top / (needed - room))
        if event is not None and event.type == pygame.MOUSEWHEEL and rect.collidepoint(self.at):
            top -= wheel_notches(event) * _NOTCH
            self._event = None
        elif (pressed := self._pressed(track)) or (self.active == name and self._is(pygame.MOUSEMOTION)):
            inside = pressed and knob.collidepoint(self.at)
            if pressed:
                self.active, self._event = name, None
                self._grabbed = self.at[1] - knob.top if inside else knob.height / 2
            if not inside:
                top = (self.at[1] - self._grabbed - track.top) / free * (needed - room)
        top = self._scrolled[key] = min(max(top, 0.0), needed - room)
        self.shown[name] = Shown("bar", key, knob, value=top)
        fill = self._shade(0.55 if self.active == name else 0.45 if self._hovers(track) else 0.3)
        self._round(knob.inflate(-self.px(4), -self.px(2)), fill, radius=BAR / 2)
        return top

    def _shade(self, part: float) -> Color:
        return mix(self.theme.panel, self.theme.ink, part)

    def _draws(self, rect: Rect) -> bool:
        return self.surface is not None and bool(rect.colliderect(self._clip))

    def _hovers(self, rect: Rect) -> bool:
        free = self.open_list is None and self.active is None
        return free and rect.collidepoint(self.at) and self._clip.collidepoint(self.at)

    def _is(self, kind: int) -> bool:
        return self._event is not None and self._event.type == kind

    def _pressed(self, rect: Rect) -> bool:
        return self._is(pygame.MOUSEBUTTONDOWN) and self._hovers(rect)

    def _key(self, key: str) -> str:
        event = self._event if self.focus == key else None
        return key_of(event) if event is not None and event.type == pygame.KEYDOWN else ""

    def _note(self, kind: str, key: str, rect: Rect, text: str, value: object, tip: str, why: str) -> None:
        tip = f"{tip}: {why}" if tip and why else tip or why
        self.shown[f"{kind}:{key}"] = Shown(kind, key, rect.clip(self._clip), text, value, tip, not why)

    def _clicks(self, kind: str, key: str, rect: Rect, text: str, value: object, tip: str, why: str) -> bool:
        self._note(kind, key, rect, text, value, tip, why)
        if why:
            return False
        if self._pressed(rect):
            self.active, self._event = key, None
        elif self._is(pygame.MOUSEBUTTONUP) and self.active == key:
            self._event = self.active = None
            return rect.collidepoint(self.at) and self._clip.collidepoint(self.at)
        elif self._key(key) in (*_ENTER, "space"):
            self._event = None
            return True
        return False

    def _round(
        self, rect: Rect, fill: Color, edge: Color | None = None, radius: float = 4, width: int = 1
    ) -> None:
        if self.surface is not None:
            rounded(self.surface, rect, fill, edge or fill, self.px(radius), width)

    def _face(self, rect: Rect, key: str, why: str, *, chosen: bool = False) -> Color:
        theme, hovered = self.theme, self._hovers(rect)
        held = self.active == key and rect.collidepoint(self.at)
        if why:
            fill, edge, ink = theme.panel, self._shade(0.14), self._shade(0.45)
        elif chosen:
            fill = mix(theme.final, theme.ink, 0.25 if held else 0.15 if hovered else 0.0)
            edge, ink = fill, on_accent(theme)
        else:
            fill = mix(field_color(theme), theme.final, 0.28 if held else 0.14 if hovered else 0.0)
            edge, ink = theme.final if held or hovered else self._shade(0.24), theme.ink
        self._round(rect, fill, edge, width=max(1, self.px(0.75)))
        self._ring(key, rect)
        return ink

    def _ring(self, key: str, rect: Rect) -> None:
        if self.surface is not None and self.focus == key:
            width = max(2, self.px(1.5))
            pygame.draw.rect(self.surface, self.theme.final, rect, width, border_radius=self.px(4))

    def _write(
        self, text: str, rect: Rect, color: Color, size: float, *, bold: bool = False, at: str = "left"
    ) -> None:
        if self.surface is not None and text and self._draws(rect):
            picture = label(shortened(text, self.px(size), rect.width, bold), self.px(size), color, bold)
            side = "center" if at == "center" else f"mid{at}"
            self.surface.blit(picture, picture.get_rect(**{side: getattr(rect, side)}))

    def header(self, text: str) -> None:
        self.row(height=18, below=2)
        self.label(text, style="header")
        self.row()

    def label(self, text: str, *, key: str = "", style: str = "", tip: str = "", at: str = "left") -> None:
        """Write a word; `style` is ``header``, ``unit`` or ``bold``, `at` is ``center`` or ``right``."""
        rect = self.cell()
        self._note("label", key or text, rect, text, None, tip, "")
        faint, bold = style in ("header", "unit"), style in ("header", "bold")
        color = self.theme.faint if faint else self.theme.ink
        self._write(text, rect, color, SMALL if faint else TEXT, bold=bold, at=at)

    def words(
        self,
        text: str,
        *,
        size: float = TEXT,
        color: Color | None = None,
        bold: bool = False,
        indent: float = 0.0,
    ) -> None:
        self.row(*((indent, 0.0) if indent else (0.0,)), height=size + 4, gap=0, below=1)
        for line in wrapped(text, self.px(size), self.px(self.wide - indent), bold):
            if indent:
                self.cell()
            self._write(line, self.cell(), color or self.theme.ink, size, bold=bold)
        self.row()

    def button(
        self,
        text: str,
        *,
        key: str = "",
        tip: str = "",
        why: str = "",
        chosen: bool = False,
        small: bool = False,
    ) -> bool:
        key, rect = key or text, self.cell()
        rect.height = min(rect.height, self.px(_TALLEST))
        clicked = self._clicks("button", key, rect, text, chosen, tip, why)
        if self._draws(rect):
            ink, size = self._face(rect, key, why, chosen=chosen), SMALL if small else TEXT
            self._write(text, rect.inflate(-self.px(6), 0), ink, size, bold=chosen and not small, at="center")
        return clicked

    def option(self, text: str, aside: str = "", *, key: str, chosen: bool = False, why: str = "") -> bool:
        rect = self.cell()
        clicked = self._clicks("option", key, rect, text, chosen, "", why)
        if self._draws(rect):
            if chosen or self._hovers(rect):
                self._round(rect, mix(self.theme.panel, self.theme.final, 0.2 if chosen else 0.08))
            inner = rect.inflate(-self.px(16), 0)
            self._write(aside, inner, self.theme.faint, SMALL, at="right")
            inner.width -= text_width(aside, self.px(SMALL)) + self.px(12) if aside else 0
            lines, ink = text.split("\n"), self._shade(0.45) if why else self.theme.ink
            inner.top -= self.px((TEXT + 5) * (len(lines) - 1) / 2)
            for k, line in enumerate(lines):
                self._write(line, inner.move(0, self.px((TEXT + 5) * k)), ink, TEXT)
        return clicked

    def area(self, key: str) -> tuple[Rect, bool]:
        """Take the next cell for a picture; return where it is, px, and whether it was clicked."""
        rect = self.cell()
        return rect, self._clicks("area", key, rect, "", None, "", "")

    def tabs(
        self, key: str, names: Sequence[str], now: str, *widths: float, titles: Mapping[str, str] = {}
    ) -> str | None:
        self.row(*(widths or [0.0] * len(names)), below=8)
        found = None
        for name in names:
            title, chosen = titles.get(name, name.capitalize()), name == now
            if self.button(title, key=f"{key}:{name}", chosen=chosen, small=True) and not chosen:
                found = name
        self.row()
        return found

    def section(self, title: str, *, key: str = "") -> bool:
        key = f"section:{key or title}"
        self.row(height=20, below=4)
        rect = self.cell()
        if self._clicks("section", key, rect, title, None, "", ""):
            self._folded ^= {key}
            self.stale = True
        is_open = key not in self._folded
        self.shown[f"section:{key}"].value = is_open
        if self._hovers(rect):
            self._round(rect, self._shade(0.06))
        self._write(f"{'▾' if is_open else '▸'} {title}", rect, self.theme.faint, SMALL, bold=True)
        self._ring(key, rect)
        self.row()
        return is_open

    def check(self, text: str, *, now: bool, key: str = "", tip: str = "") -> bool | None:
        key, rect = key or text, self.cell()
        clicked = self._clicks("check", key, rect, text, now, tip, "")
        if self._draws(rect):
            box = Rect(0, 0, self.px(16), self.px(16))
            box.midleft = rect.midleft
            theme, hovered = self.theme, self._hovers(rect)
            field = mix(field_color(theme), theme.final, 0.14 if hovered else 0.0)
            edge = theme.final if now or hovered else self._shade(0.35)
            self._round(box, theme.final if now else field, edge, 3, max(1, self.px(0.75)))
            if now and self.surface is not None:
                side = 4 * box.width
                large = Surface((side, side), pygame.SRCALPHA, 32)
                corners = [(x * side, y * side) for x, y in ((0.22, 0.52), (0.42, 0.72), (0.78, 0.28))]
                for start, end in pairwise(corners):
                    pygame.draw.line(large, on_accent(theme), start, end, max(4, round(side / 8)))
                tick = pygame.transform.smoothscale(large.premul_alpha(), box.size)
                self.surface.blit(tick, box, special_flags=pygame.BLEND_PREMULTIPLIED)
            words = rect.move(self.px(23), 0)
            words.width -= self.px(23)
            self._write(text, words, theme.ink, TEXT)
            self._ring(key, rect)
        return (not now) if clicked else None

    def slider(
        self, key: str, now: float, low: float, high: float, *, step: float = 0.0, why: str = ""
    ) -> float | None:
        """Show a slider; return where it was moved to. Arrows move it by `step`, or a fiftieth."""
        rect, theme = self.cell(), self.theme
        track, knob = Rect(rect.left, 0, rect.width, self.px(14)), Rect(0, 0, self.px(12), self.px(14))
        track.centery = rect.centery
        free, span = max(track.width - knob.width, 1), max(high - low, 1e-300)
        value = now
        if not why:
            place = track.left + free * min(max((now - low) / span, 0.0), 1.0)
            pressed = self._pressed(track)
            on_knob = pressed and place <= self.at[0] <= place + knob.width
            if pressed:
                self.active, self._event = key, None
                self._grabbed = self.at[0] - place if on_knob else knob.width / 2
            if (pressed and not on_knob) or (self.active == key and self._is(pygame.MOUSEMOTION)):
                value = low + span * (self.at[0] - self._grabbed - track.left) / free
            elif by := {"left": -1, "down": -1, "right": 1, "up": 1}.get(self._key(key), 0):
                value = now + by * (step or span / 50)
        if value != now:
            value = min(max(value, low), high)
            if step:
                value = min(max(low + round((value - low) / step) * step, low), high)
        self._note("slider", key, track, "", value, "", why)
        if self._draws(rect):
            part = min(max((value - low) / span, 0.0), 1.0)
            groove = track.inflate(0, -self.px(8))
            half = groove.height // 2 / self.scale
            self._round(groove, self._shade(0.18), radius=half)
            groove.width = max(round(part * (track.width - knob.width)) + self.px(6), groove.height)
            accent = self._shade(0.35) if why else theme.final
            self._round(groove, mix(theme.panel, accent, 0.6), radius=half)
            strength = 0.3 if self.active == key else 0.2 if self._hovers(track) and not why else 0.0
            knob.topleft = track.left + round(part * (track.width - knob.width)), track.top
            self._round(knob, mix(accent, theme.ink, strength), radius=5)
            self._ring(key, track)
        return value if value != now else None

    def text_entry(
        self, key: str, text: str, *, ghost: str = "", tip: str = "", live: bool = False
    ) -> str | None:
        """Show a field; return its text after Enter, with `live` after each letter."""
        rect = self.cell()
        given: str | None = None
        if self._pressed(rect):
            self._event, now = None, perf_counter()
            double = now - self._clicked[0] < DOUBLE and self._clicked[1] == key
            self._clicked = now, key
            if self.focus == key and self.edit is not None:
                self.active = key
                self.edit.place(self._caret_at(self.edit, rect))
                if double:
                    self.edit.select_word(self.edit.caret)
            else:
                self.focus, self.edit = key, TextEdit.of(text)
        edit = self.edit if self.focus == key else None
        if edit is not None:
            if self._is(pygame.MOUSEMOTION) and self.active == key:
                edit.place(self._caret_at(edit, rect), extend=True)
            elif name := self._key(key):
                self._event = None
                if name in _ENTER and not edit.composed:
                    given = edit.text
                    self.stop_typing()
                    edit = None
                elif not edit.composed:
                    edit.key(name)
        if live and edit is not None and edit.text != text:
            given = edit.text
        shown = edit.text if edit is not None else text
        self._note("entry", key, rect, shown, text, tip, "")
        if self._draws(rect):
            self._draw_field(rect, edit, shown, ghost)
        return given

    def _caret_at(self, edit: TextEdit, rect: Rect) -> int:
        """Return the caret position next to the mouse; texts are wider the longer they are, so bisect."""
        x = self.at[0] - rect.left - self.px(6) + self._shifted(edit, rect)

        def width_before(caret: int) -> int:
            return text_width(edit.text[:caret], self.px(TEXT))

        after = bisect_left(range(len(edit.text) + 1), x, key=width_before)
        nearby = range(max(after - 1, 0), min(after, len(edit.text)) + 1)
        return min(nearby, key=lambda caret: abs(width_before(caret) - x))

    def _shifted(self, edit: TextEdit, rect: Rect) -> int:
        """Return by how much a long text stands further left, so that its caret is in sight."""
        before = text_width(edit.text[: edit.caret] + edit.composed, self.px(TEXT))
        return max(before - (rect.width - self.px(14)), 0)

    def _draw_field(self, rect: Rect, edit: TextEdit | None, text: str, ghost: str) -> None:
        screen, theme, size = self.surface, self.theme, self.px(TEXT)
        assert screen is not None
        edge = theme.final if edit is not None or self._hovers(rect) else self._shade(0.24)
        width = max(1, self.px(0.75)) if edit is None else max(2, self.px(1.25))
        self._round(rect, field_color(theme), edge, width=width)
        inner = rect.inflate(-self.px(12), -self.px(4))
        if edit is None:
            self._write(text or ghost, inner, theme.ink if text else theme.faint, TEXT)
            return
        clip = screen.get_clip()
        screen.set_clip(inner.inflate(self.px(4), 0).clip(clip))
        left = inner.left - self._shifted(edit, rect)
        whole = edit.text[: edit.caret] + edit.composed + edit.text[edit.caret :]
        low, high = (text_width(edit.text[:k], size) for k in edit.selection)
        tall = Rect(left + low, 0, high - low, self.px(17))
        tall.centery = rect.centery
        if low != high:
            screen.fill(mix(field_color(theme), theme.final, 0.35), tall)
        picture = label(whole or ghost, size, theme.ink if whole else theme.faint)
        screen.blit(picture, picture.get_rect(midleft=(left, rect.centery)))
        x = left + text_width(edit.text[: edit.caret], size)
        if edit.composed:
            wide = text_width(edit.composed, size)
            screen.fill(theme.ink, (x, tall.bottom - 1, wide, max(1, self.px(1))))
            pygame.key.set_text_input_rect(Rect(x, rect.top, wide, rect.height))
            x += wide
        screen.fill(theme.ink, (x, tall.top, max(1, self.px(1)), tall.height))
        screen.set_clip(clip)

    def dropdown(self, key: str, options: Sequence[str], now: str, *, tip: str = "") -> str | None:
        rect = self.cell()
        picked: str | None = None
        if self.open_list is not None and self.open_list.key == key:
            picked = self.open_list.picked
            is_old = self.open_list.options != list(options)  # what there is to choose has changed meanwhile
            if picked is not None or is_old:
                self.open_list = None
            if picked is not None and picked not in options:
                picked = None
        opened = self._clicks("menu", key, rect, now, now, tip, "") or self._key(key) == "down"
        if opened and picked is None:
            row = self.px(LIST_ROW)
            high = min(len(options) * row + 2, self.px(LONGEST_LIST))
            below, above = self.box.bottom - rect.bottom - self.px(8), rect.top - self.box.top - self.px(8)
            place = Rect(rect.left, rect.bottom + self.px(2), rect.width, min(high, max(below, above)))
            if below < high and above > below:
                place.bottom = rect.top - self.px(2)
            wide = max((text_width(each, self.px(TEXT)) for each in options), default=0) + self.px(34)
            place.width = min(max(wide, rect.width), self.box.width - self.px(16))
            place.right = min(place.right, self.box.right - self.px(8))
            self.open_list = _List(key, list(options), place, row)
            self.open_list.show(self.open_list.options.index(now) if now in options else 0)
            self.focus, self.edit, self._event = key, None, None
        if self.surface is not None and self._draws(rect):
            ink, words = self._face(rect, key, ""), rect.inflate(-self.px(18), 0)
            words.width -= self.px(12)
            self._write(now, words, ink, TEXT)
            x, y, side = rect.right - self.px(13), rect.centery + self.px(1), self.px(4)
            corners = [(x - side, y - side // 2), (x + side, y - side // 2), (x, y + side // 2 + 1)]
            pygame.draw.polygon(self.surface, ink, corners)
        return picked if picked != now else None

    def _list_takes(self, event: pygame.event.Event) -> bool:
        found = self.open_list
        assert found is not None
        self.stale = True
        if event.type == pygame.MOUSEBUTTONDOWN:
            if (k := found.at(event.pos)) is None:
                self.stop_typing()
            else:
                self._pick(found, k)
        elif event.type == pygame.MOUSEWHEEL:
            found.top = min(max(found.top - wheel_notches(event) * found.row, 0.0), found.beyond)
        elif event.type == pygame.KEYDOWN:
            name = key_of(event)
            by = {"up": -1, "down": 1, "page up": -8, "page down": 8, "home": -9999, "end": 9999}.get(name, 0)
            begun = [k for k, each in enumerate(found.options) if each.lower().startswith(name)]
            if by:
                found.show(found.chosen + by)
            elif name in (*_ENTER, "space"):
                self._pick(found, found.chosen)
            elif len(name) == 1 and begun:
                found.show(next((k for k in begun if k > found.chosen), begun[0]))
            elif _is_function_key(name):
                return False
            else:
                self.stop_typing()
        else:
            return event.type in (pygame.MOUSEBUTTONUP, pygame.TEXTINPUT)
        return True

    def _pick(self, found: _List, k: int) -> None:
        found.picked, self.focus = found.options[k], None
        self.run(None, None)
        self.open_list = None

    def _draw_list(self, screen: Surface, found: _List) -> None:
        theme, field = self.theme, field_color(self.theme)
        rounded(screen, found.rect, field, self._shade(0.4), self.px(4))
        inner = found.rect.inflate(-2, -2)
        screen.set_clip(inner)
        for k, option in enumerate(found.options):
            item = found.item(k)
            if not item.colliderect(inner):
                continue
            if k == found.chosen:
                screen.fill(mix(field, theme.final, 0.25), item)
            words = shortened(option, self.px(TEXT), item.width - self.px(24 if found.beyond else 14))
            picture = label(words, self.px(TEXT), theme.ink)
            screen.blit(picture, picture.get_rect(midleft=(item.left + self.px(8), item.centery)))
        if found.beyond:
            whole = inner.height + found.beyond
            bar = Rect(0, 0, self.px(6), round(inner.height * inner.height / whole))
            bar.topright = inner.right - self.px(2), inner.top + round(found.top * inner.height / whole)
            rounded(screen, bar, self._shade(0.3), self._shade(0.3), self.px(3))
        screen.set_clip(None)

    def find(self, kind: str, key: str) -> Shown | None:
        return self.shown.get(f"{kind}:{key}")


class SidePanel:
    """A panel beside the arena whose page is drawn anew when the layout, or what it shows, is different."""

    def __init__(self, tab: str) -> None:
        self.tab = tab  # the page that is open
        self.covered = False  # something else is drawn in its place, or takes the events
        self.hidden, self.ui = False, Ui(self._page, LIGHT)
        self._drawn: object = None  # what the page showed when it was drawn

    def _page(self, ui: Ui) -> None:
        """Show it."""

    def arrange(self, layout: Layout, theme: Theme) -> None:
        self.hidden = not layout.panel[2]
        if self.hidden:
            self.ui.stop_typing()
        if theme is not self.ui.theme or layout.scale != self.ui.scale:
            self.ui = Ui(self._page, theme, layout.scale)
        self.ui.box, self.ui.stale = Rect(layout.panel), True

    def draw(self, screen: Surface) -> None:
        self.ui.draw(screen)
        self.ui.draw_over(screen)

    def take(self, event: pygame.event.Event) -> bool:
        return not self.covered and not self.hidden and self.ui.take(event)
