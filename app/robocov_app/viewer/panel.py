"""The panel at the right: what is chosen often stays in sight, the rest is on pages."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robocov.controllers import controller_kind, short_name
from robocov.errors import ParameterError
from robocov_app.render.theme import LIGHT
from robocov_app.viewer.actions import all_actions
from robocov_app.viewer.paged import Paged
from robocov_app.viewer.pages import (
    GAP,
    MARGIN,
    WIDE,
    columns,
    keep_page,
    parameters_page,
    robot_page,
    show_page,
)
from robocov_app.viewer.parameters import Pick
from robocov_app.viewer.session.clock import SPEEDS, speed_index, speed_words
from robocov_app.viewer.session.scenario import MOST_PANES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from robocov_app.viewer.presenter import Desk
    from robocov_app.viewer.widgets import Widgets

TABS = ("parameters", "show", "robot", "keep")
_TAB_WIDTHS = (86, 64, 64, 64)


class Panel(Paged):
    """Builds the widgets, and keeps them as the desk is.

    Parameters
    ----------
    desk : Desk
    titles : dict of name to title
        Of the layers.
    do : callable
        Does an action by its name.
    """

    tabs = TABS
    tab_widths = _TAB_WIDTHS

    def __init__(self, desk: Desk, titles: dict[str, str], do: Callable[[str], None]) -> None:
        super().__init__(desk, all_actions(titles), do)
        self.desk, self.titles = desk, titles

    # building

    def wanted(self) -> object:
        """Return all on which it depends what widgets there are."""
        desk, session = self.desk, self.desk.session
        laws = tuple(session.circumstances(lane).law.name for lane in session.lanes)
        starts = tuple(session.environment.starts)
        return laws, desk.active, self.tab, desk.map_name, starts, session.scenario.start_name, *desk.laws

    def build(self, widgets: Widgets) -> None:
        """Make the widgets."""
        y = self._environment(widgets, 8)
        y = self._controllers(widgets, y)
        y = self._run(widgets, y)
        y = self._tools(widgets, y)
        widgets.section("tabs", None, y, lambda: self._tabs(widgets))
        y += 34
        self._place_body(widgets, y)
        if self.tab == "parameters":
            parameters_page(widgets, self.desk, y)
        elif self.tab == "show":
            show_page(widgets, self.desk, y, self.titles)
        elif self.tab == "robot":
            robot_page(widgets, y)
        else:
            keep_page(widgets, y)

    def _environment(self, widgets: Widgets, y: float) -> float:
        desk, rect = self.desk, widgets.rect
        maps, starts, start = desk.maps(), desk.starts(), desk.session.scenario.start_name
        files = short_names(maps)
        names = {name: file for file, name in files.items()}

        def number(what: str, text: str) -> None:
            desk.attempt(lambda: desk.command(f"{what} {text}"))

        def open_map(name: str) -> None:
            desk.attempt(lambda: desk.open_map(names.get(name, name)))

        def begin(name: str) -> None:
            desk.attempt(lambda: desk.restart(start=name))

        def build() -> None:
            widgets.label("ENVIRONMENT", rect(MARGIN, 0, WIDE, 18), style="#header")
            now = files.get(desk.map_name, desk.map_name)
            widgets.menu("map", list(names), now, rect(MARGIN, 20, 172, 28), open_map)
            widgets.menu("start", starts, start, rect(MARGIN + 178, 20, 118, 28), begin)
            widgets.label("Robots", rect(MARGIN, 53, 50, 26))
            widgets.entry("robots", "", rect(MARGIN + 52, 53, 44, 26), lambda text: number("robots", text))
            widgets.does("−", rect(MARGIN + 99, 53, 24, 26), "fewer")
            widgets.does("+", rect(MARGIN + 126, 53, 24, 26), "more")
            widgets.label("Seed", rect(MARGIN + 168, 53, 36, 26))
            widgets.entry("seed", "", rect(MARGIN + 206, 53, 60, 26), lambda text: number("seed", text))
            widgets.does("↻", rect(MARGIN + 270, 53, 26, 26), "seed")

        widgets.section("environment", (desk.map_name, *maps, *starts, start), y, build)
        return y + 87

    def _controllers(self, widgets: Widgets, y: float) -> float:
        desk, session, rect = self.desk, self.desk.session, widgets.rect
        laws = [session.circumstances(lane).law for lane in session.lanes]
        now = [law.name for law in laws]
        labels = law_labels(desk.laws, {law.name: law.label for law in laws})
        names = {label: name for name, label in labels.items()}
        count = len(now)

        def pane(k: int, x: float, row: float, width: float) -> None:
            def choose(label: str) -> None:
                desk.attempt(lambda: desk.set_law(k, names[label]))

            def close() -> None:
                desk.active = k
                self._do("pane:remove")

            room = 26 if count > 1 else 0
            place = rect(x, row, width - room, 28)
            widgets.menu(f"law:{k}", list(names), labels[now[k]], place, choose)
            if room:
                place, name = rect(x + width - 24, row, 24, 28), f"close:{k}"
                widgets.button("×", place, close, name=name, tip="Remove this pane", style="#small")

        def build() -> None:
            title = "CONTROLLER" if count == 1 else "CONTROLLERS, SIDE BY SIDE"
            widgets.label(title, rect(MARGIN, 0, WIDE, 18), style="#header")
            if count == 2:  # three in a row, for which the third is small
                places = [(x, 20.0, width) for x, width in columns(2, WIDE - 28 - GAP)]
                places.append((MARGIN + WIDE - 28.0, 20.0, 28.0))
            else:
                places = [(x, row, width) for row in (20.0, 52.0) for x, width in columns(2)]
            for k in range(count):
                pane(k, *places[k])
            if count < MOST_PANES:
                x, row, width = places[count]
                widgets.does("+ compare" if count != 2 else "+", rect(x, row, width, 28), "pane:add")

        widgets.section("controllers", (tuple(now), tuple(labels)), y, build)
        return y + (56 if count < 3 else 88)

    def _run(self, widgets: Widgets, y: float) -> float:
        rect = widgets.rect
        does = (("Pause", "pause"), ("Step", "step"), ("Settle", "settle"), ("Restart", "restart"))

        def speed(place: float) -> None:
            self.desk.attempt(lambda: self.desk.set_speed(SPEEDS[round(place)]))

        def build() -> None:
            widgets.label("RUN", rect(MARGIN, 0, WIDE, 18), style="#header")
            for (x, width), (text, action) in zip(columns(len(does)), does, strict=True):
                widgets.does(text, rect(x, 20, width, 28), action)
            widgets.label("Speed", rect(MARGIN, 53, 50, 22))
            place = rect(MARGIN + 52, 57, 194, 14)
            widgets.slider("speed", place, SPEEDS.index(1.0), (0.0, len(SPEEDS) - 1.0), speed)
            widgets.label("1×", rect(MARGIN + 254, 53, 42, 22), name="speed")

        widgets.section("run", None, y, build)
        return y + 81

    def _tools(self, widgets: Widgets, y: float) -> float:
        def build() -> None:
            widgets.label("MOUSE", widgets.rect(MARGIN, 0, WIDE, 18), style="#header")
            for k, tool in enumerate(self.desk.tools.values()):
                x, width = columns(5)[k % 5]
                place = widgets.rect(x, 20 + 30 * (k // 5), width, 26)
                widgets.does(tool.title, place, f"tool:{tool.name}", style="#small")

        widgets.section("tools", None, y, build)
        return y + 86

    # keeping up

    def sync(self, widgets: Widgets) -> None:
        """Let the widgets say what the desk says."""
        desk, session = self.desk, self.desk.session
        widgets.say("button", "pause", "Pause" if session.playing else "Play")
        widgets.mark("pause", not session.playing)
        widgets.mark("settle", session.stop_when_settled)
        widgets.say("button", "film", "End film" if desk.filming else "Record film")
        widgets.mark("film", desk.filming)
        widgets.mark("fade", desk.fade)
        widgets.say("button", "theme", "Dark" if self._theme is LIGHT else "Light")
        self._mark_tabs(widgets)
        for name in desk.tools:
            widgets.mark(f"tool:{name}", desk.tool.name == name, ("#chosen_tab", "#small"))
        widgets.fill("robots", str(session.scenario.robots))
        widgets.fill("seed", str(session.scenario.seed))
        speed = session.clock.speed
        widgets.slide("speed", speed_index(speed))
        widgets.say("label", "speed", speed_words(speed))
        for each in desk.parameters():
            if isinstance(each, Pick):
                for word in each.offered:
                    widgets.mark(f"{each.name}:{word}", word == each.value, ("#chosen_tab", "#small"))
                widgets.say("button", f"next:{each.name}", f"{each.value} ›")
                continue
            widgets.slide(each.name, each.place())
            widgets.fill(each.name, each.words())
        for name in self.titles:
            widgets.tick(name, name in desk.shown)


def short_names(files: list[str]) -> dict[str, str]:
    """Return what maps are called in the menu, by what they are: files without their folders.

    >>> short_names(["rooms", "/tmp/a/rooms-1.json", "a/x.json", "b/x.json"])
    {'rooms': 'rooms', '/tmp/a/rooms-1.json': 'rooms-1.json', 'a/x.json': 'a/x.json', 'b/x.json': 'b/x.json'}
    """
    names = [Path(file).name for file in files]
    return {file: name if names.count(name) == 1 else file for file, name in zip(files, names, strict=True)}


def law_labels(names: Iterable[str], shown: Mapping[str, str]) -> dict[str, str]:
    """Return what controllers are called in the menu, by their names; no two are called the same.

    Parameters
    ----------
    names : names of controllers
        To choose from. A user's are loaded for it.
    shown : dict of name to label
        Those at work, which may be of a saved run: they are not loaded.

    >>> law_labels(["rapf", "lloyd"], {"theirs.py:Mine": "Mine"})
    {'rapf': 'RAPF', 'lloyd': 'Lloyd', 'theirs.py:Mine': 'Mine'}
    """
    found: dict[str, str] = {}
    for name in dict.fromkeys([*names, *shown]):
        try:
            label = shown[name] if name in shown else str(controller_kind(name).label)
        except ParameterError:  # its file has changed since
            label = short_name(name)
        file = Path(name.rpartition(":")[0]).name
        tried = (label, f"{label} ({file})", f"{label} ({name})")
        found[name] = next(each for each in tried if each not in found.values())
    return found
