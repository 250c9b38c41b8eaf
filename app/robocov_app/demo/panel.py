"""The panel at the right: what is chosen often stays in sight, the rest is on pages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from robocov.controllers import controller_kind
from robocov_app.demo.actions import all_actions
from robocov_app.demo.clock import SPEEDS, speed_words
from robocov_app.demo.pages import MARGIN, WIDE, keep_page, parameters_page, robot_page, show_page
from robocov_app.demo.scenario import MOST_PANES
from robocov_app.demo.widgets import Widgets

if TYPE_CHECKING:
    from collections.abc import Callable

    import pygame

    from robocov_app.demo.desk import Desk
    from robocov_app.demo.layout import Box, Layout
    from robocov_app.view.theme import Theme

TABS = ("parameters", "show", "robot", "keep")
_QUARTER = 69.5
"""Width of four buttons side by side."""


class Panel:
    """Builds the widgets, and keeps them as the desk is.

    Parameters
    ----------
    desk : Desk
    titles : dict of name to title
        Of the layers.
    do : callable
        Does an action by its name.

    Attributes
    ----------
    tab : str
        The page that is open.
    body : Box
        Where the page is, in the window.
    covered : bool
        Something else is drawn in its place: it takes no events.
    """

    def __init__(self, desk: Desk, titles: dict[str, str], do: Callable[[str], None]) -> None:
        self.desk, self.titles, self._do = desk, titles, do
        self.tab = TABS[0]
        self.body: Box = (0, 0, 0, 0)
        self.covered = False
        self._actions = {action.name: action for action in all_actions(titles)}
        self._widgets: Widgets | None = None
        self._structure: object = None
        self._version = -1

    def arrange(self, layout: Layout, theme: Theme) -> None:
        """Build everything for a layout and a theme."""
        self._structure = None
        self._widgets = None
        if layout.panel[2]:
            self._widgets = Widgets(layout.size, layout.panel, theme, layout.scale, self._actions, self._do)
            self._refresh(self._widgets)

    def show_tab(self, name: str) -> None:
        """Turn to a page."""
        if name in TABS:
            self.tab = name
            self.desk.version += 1

    def update(self, seconds: float) -> None:
        """Let the widgets live, and say what the desk says."""
        if self._widgets is None:
            return
        if self._version != self.desk.version or self._structure != self._wanted():
            self._refresh(self._widgets)
        self._widgets.manager.update(seconds)

    def draw(self, screen: pygame.Surface) -> None:
        """Draw the widgets."""
        if self._widgets is not None:
            self._widgets.manager.draw_ui(screen)

    def draw_over(self, screen: pygame.Surface) -> None:
        """Draw again what must lie on top of the inspector's words: an open menu."""
        if self.unfolded:
            self.draw(screen)

    @property
    def busy(self) -> bool:
        """Whether it must keep up with every frame: somebody types, or a menu is open."""
        return self.typing or self.unfolded or self._version != self.desk.version

    @property
    def typing(self) -> bool:
        """Whether keys go into a field."""
        return self._widgets is not None and self._widgets.typing

    def stop_typing(self) -> None:
        """Take the keys away from all fields."""
        if self.typing and self._widgets is not None:
            self._widgets.stop_typing()
            self.desk.version += 1

    @property
    def unfolded(self) -> bool:
        """Whether a menu is open, which may hang over other things."""
        return self._widgets is not None and not self.covered and self._widgets.unfolded

    def take(self, event: pygame.event.Event) -> bool:
        """Give an event to the widgets; return whether one of them took it."""
        return self._widgets is not None and not self.covered and self._widgets.take(event)

    # building

    def _wanted(self) -> object:
        """Return all on which it depends what widgets there are."""
        desk, session = self.desk, self.desk.session
        laws = tuple(session.circumstances(lane).law.name for lane in session.lanes)
        return (
            *(laws, desk.active, self.tab, desk.map_name, tuple(desk.starts()), session.scenario.start_name),
            tuple(desk.laws),
        )

    def _refresh(self, widgets: Widgets) -> None:
        wanted = self._wanted()
        if wanted != self._structure:
            self._structure = wanted
            self._build(widgets)
        self._sync(widgets)
        self._version = self.desk.version

    def _build(self, widgets: Widgets) -> None:
        widgets.clear()
        y = self._environment(widgets, 8.0)
        y = self._controllers(widgets, y)
        y = self._run(widgets, y)
        y = self._tools(widgets, y)
        wide = WIDE / len(TABS)
        for k, name in enumerate(TABS):
            style = "#chosen_tab" if name == self.tab else "#small"

            def turn(name: str = name) -> None:
                self.show_tab(name)

            widgets.button(
                name.capitalize(), widgets.rect(MARGIN + k * wide, y, wide - 2, 26), turn, style=style
            )
        top = round((y + 32) * widgets.scale)
        left, _, width, height = widgets.place
        self.body = (left, top, width, height - top)
        if self.tab == "parameters":
            parameters_page(widgets, self.desk, top)
        elif self.tab == "show":
            show_page(widgets, self.desk, top, self.titles)
        elif self.tab == "robot":
            robot_page(widgets, top)
        else:
            keep_page(widgets, top)

    def _environment(self, widgets: Widgets, y: float) -> float:
        desk, rect = self.desk, widgets.rect

        def number(what: str, text: str) -> None:
            desk.attempt(lambda: desk.command(f"{what} {text}"))

        widgets.label("ENVIRONMENT", rect(MARGIN, y, WIDE, 18), style="#header")
        y += 20
        widgets.menu(
            desk.maps(),
            desk.map_name,
            rect(MARGIN, y, 172, 28),
            lambda name: desk.attempt(lambda: desk.open_map(name)),
        )
        widgets.menu(
            desk.starts(),
            desk.session.scenario.start_name,
            rect(MARGIN + 178, y, 118, 28),
            lambda name: desk.attempt(lambda: desk.restart(start=name)),
        )
        y += 33
        widgets.label("Robots", rect(MARGIN, y, 50, 26))
        widgets.entry("robots", "", rect(MARGIN + 52, y, 44, 26), lambda text: number("robots", text))
        widgets.does("−", rect(MARGIN + 99, y, 24, 26), "fewer")
        widgets.does("+", rect(MARGIN + 126, y, 24, 26), "more")
        widgets.label("Seed", rect(MARGIN + 168, y, 36, 26))
        widgets.entry("seed", "", rect(MARGIN + 206, y, 60, 26), lambda text: number("seed", text))
        widgets.does("↻", rect(MARGIN + 270, y, 26, 26), "seed")
        return y + 34

    def _controllers(self, widgets: Widgets, y: float) -> float:
        desk, session = self.desk, self.desk.session
        count = len(session.lanes)
        title = "CONTROLLER" if count == 1 else "CONTROLLERS, SIDE BY SIDE"
        widgets.label(title, widgets.rect(MARGIN, y, WIDE, 18), style="#header")
        y += 20
        now = [session.circumstances(lane).law.name for lane in session.lanes]
        names = {str(controller_kind(name).label): name for name in dict.fromkeys([*desk.laws, *now])}
        labels = {name: label for label, name in names.items()}
        places = min(count + 1, MOST_PANES)
        columns = 3 if places == 3 else 2
        wide = (WIDE - 6 * (columns - 1)) / columns
        for k in range(places):
            x, row = MARGIN + (k % columns) * (wide + 6), y + (k // columns) * 32
            if k == count:
                text = "+ compare" if count == 1 else "+"
                widgets.does(text, widgets.rect(x, row, wide, 28), "pane:add")
                continue

            def choose(label: str, pane: int = k) -> None:
                desk.attempt(lambda: desk.set_law(pane, names[label]))

            def close(pane: int = k) -> None:
                desk.active = pane
                self._do("pane:remove")

            room = 26 if count > 1 else 0
            widgets.menu(list(names), labels[now[k]], widgets.rect(x, row, wide - room, 28), choose)
            if room:
                rect = widgets.rect(x + wide - 24, row, 24, 28)
                widgets.button("×", rect, close, tip="Remove this pane", style="#small")
        return y + 32 * (-(-places // columns)) + 4

    def _run(self, widgets: Widgets, y: float) -> float:
        widgets.label("RUN", widgets.rect(MARGIN, y, WIDE, 18), style="#header")
        y += 20
        for k, (text, action) in enumerate(
            (("Pause", "pause"), ("Step", "step"), ("Settle", "settle"), ("Restart", "restart"))
        ):
            widgets.does(text, widgets.rect(MARGIN + k * (_QUARTER + 6), y, _QUARTER, 28), action)
        y += 33
        widgets.label("Speed", widgets.rect(MARGIN, y, 50, 22))
        widgets.slider(
            "speed",
            widgets.rect(MARGIN + 52, y + 3, 188, 16),
            SPEEDS.index(1.0),
            (0, len(SPEEDS) - 1),
            lambda place: self.desk.attempt(lambda: self.desk.set_speed(SPEEDS[round(place)])),
        )
        self._speed = widgets.label("1×", widgets.rect(MARGIN + 248, y, 48, 22))
        return y + 28

    def _tools(self, widgets: Widgets, y: float) -> float:
        widgets.label("MOUSE", widgets.rect(MARGIN, y, WIDE, 18), style="#header")
        y += 20
        for k, tool in enumerate(self.desk.tools.values()):
            x, row = MARGIN + (k % 4) * (_QUARTER + 6), y + (k // 4) * 30
            widgets.does(tool.title, widgets.rect(x, row, _QUARTER, 26), f"tool:{tool.name}")
        return y + 66

    # keeping up

    def _sync(self, widgets: Widgets) -> None:
        desk, session = self.desk, self.desk.session
        widgets.caption("pause", "Pause" if session.playing else "Play")
        widgets.mark("pause", not session.playing)
        widgets.mark("settle", session.stop_when_settled)
        widgets.mark("film", desk.filming)
        for name in desk.tools:
            widgets.mark(f"tool:{name}", desk.tool.name == name)
        widgets.say("robots", str(session.scenario.robots))
        widgets.say("seed", str(session.scenario.seed))
        speed = session.clock.speed
        widgets.slide("speed", min(range(len(SPEEDS)), key=lambda k: abs(_order(SPEEDS[k]) - _order(speed))))
        if self._speed.text != speed_words(speed):
            self._speed.set_text(speed_words(speed))
        for each in desk.parameters():
            widgets.slide(each.name, each.place())
            widgets.say(each.name, each.words())
        for name in self.titles:
            widgets.tick(name, name in desk.shown)


def _order(speed: float) -> float:
    return math.log(speed) if math.isfinite(speed) else 10.0
