"""The panel at the right: what is chosen often stays in sight, the rest is on pages."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import chain, zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from robocov.controllers import get_controller_label, load_controller_class
from robocov.errors import ParameterError
from robocov_app.render.fonts import shortened
from robocov_app.toolkit.command import Commands
from robocov_app.toolkit.overlay import flat_canvas
from robocov_app.toolkit.ui import SMALL, SidePanel, Ui
from robocov_app.viewer.explain import NOTHING, Report
from robocov_app.viewer.parameters import Parameter, Pick
from robocov_app.viewer.presenter import Presenter
from robocov_app.viewer.session.clock import SPEEDS, find_speed_index, format_speed
from robocov_app.viewer.session.scenario import MAX_PANES

TABS = ("parameters", "show", "robot", "keep")
# layers without a check box: a picture without them is no use; they have keys all the same
NOT_OFFERED = frozenset({"obstacles", "boundary", "robots", "failed", "selection", "caption"})
_KEPT = (
    *(("Screenshot", "screenshot"), ("Record film", "film")),
    *(("Save session", "save:session"), ("Recover…", "recover")),
    *(("Save run", "save:run"), ("Save map", "save:map")),
    *(("◀ Branch", "branch:previous"), ("Branch ▶", "branch:next")),
    *(("Undo", "undo"), ("Redo", "redo"), ("Keys", "help"), ("Commands…", "palette")),
    *(("Lesson", "tour"), ("Full screen", "fullscreen")),
)
_ASKED_AGAIN = 0.25  # seconds between two looks at what there is while the simulation goes on
_NOBODY = "Click a robot, or press Tab: it tells why it moves, and why it does not."


class Panel(SidePanel):
    """Shows what there is, and lets it be edited; `report` is on the robot that is asked about."""

    def __init__(
        self, viewer: Presenter, titles: dict[str, str], commands: Commands, do: Callable[[str], None]
    ) -> None:
        self.viewer, self.titles, self._commands, self._do = viewer, titles, commands, do
        self.report: Report | None = None
        self._age = 0.0
        super().__init__(TABS[0])

    def show_tab(self, name: str) -> None:
        if name in TABS:
            self.tab = name
            self.viewer.version += 1

    def update(self, seconds: float) -> None:
        self._age += seconds
        if self.covered and self.ui.busy:
            self.ui.stop_typing()
        viewer, session = self.viewer, self.viewer.session
        shows = (viewer.version, self.tab, viewer.theme, session.playback.is_playing, id(self.report))
        old = self._age >= _ASKED_AGAIN and session.playback.is_playing and not session.timeline.is_settled
        if shows != self._drawn or old:
            self._drawn, self._age, self.ui.stale = shows, 0.0, True

    def _page(self, ui: Ui) -> None:
        ui.inset(12, 8, 12)
        self._environment(ui)
        self._controllers(ui)
        self._run(ui)
        self._tools(ui)
        if (tab := ui.tabs("tab", TABS, self.tab, 86, 64, 64, 64)) is not None:
            self.show_tab(tab)
        pages = {"parameters": self._parameters, "show": self._show, "robot": self._robot, "keep": self._keep}
        pages[self.tab](ui)

    def _does(self, ui: Ui, text: str, action: str, **look: Any) -> None:
        if ui.button(text, key=action, tip=self._commands[action].tip, **look):
            self._do(action)

    def _environment(self, ui: Ui) -> None:
        viewer, session = self.viewer, self.viewer.session
        files = short_names(viewer.maps())
        names = {name: file for file, name in files.items()}
        ui.header("ENVIRONMENT")
        ui.row(172, 0, height=28, below=5)
        if (name := ui.dropdown("map", list(names), files.get(viewer.map_name, viewer.map_name))) is not None:
            viewer.attempt(partial(viewer.open_map, names[name]))
        if (start := ui.dropdown("start", viewer.starts(), session.timeline.scenario.start_name)) is not None:
            viewer.attempt(lambda: viewer.restart(start=start))
        ui.row(49, 44, 24, 24, 8, 36, 60, 26, gap=3.5, below=8)
        ui.label("Robots")
        if (robots := ui.text_entry("robots", str(len(viewer.numbers)))) is not None:
            viewer.attempt(lambda: self._commands.typed(f"robots {robots}"))
        self._does(ui, "−", "fewer")
        self._does(ui, "+", "more")
        ui.cell()
        ui.label("Seed")
        if (seed := ui.text_entry("seed", str(session.timeline.scenario.seed))) is not None:
            viewer.attempt(lambda: self._commands.typed(f"seed {seed}"))
        self._does(ui, "↻", "seed:next")

    def _controllers(self, ui: Ui) -> None:
        viewer, session = self.viewer, self.viewer.session
        laws = [session.displayed.get_setup(pane).controller for pane in session.timeline.panes]
        labels = law_labels(viewer.laws, {law.name: law.label for law in laws})
        names, count = {label: name for name, label in labels.items()}, len(laws)
        ui.header("CONTROLLER" if count == 1 else "CONTROLLERS, SIDE BY SIDE")
        # of two there are three in a row, for which the third is small
        widths = {1: (0, 0), 2: (0, 24, 3, 0, 24, 3, 28)}.get(count, (0, 24, 3, 0, 24))
        ui.row(*widths, height=28, gap=2 if count > 1 else 6, below=4)
        for k, law in enumerate(laws):
            if (label := ui.dropdown(f"law:{k}", list(names), labels[law.name])) is not None:
                viewer.attempt(partial(viewer.set_law, k, names[label]))
            if count > 1:
                if ui.button("×", key=f"close:{k}", tip="Remove this pane", small=True):
                    viewer.active = k
                    self._do("pane:remove")
                if count == 2 or k % 2 == 0:
                    ui.cell()
        if count < MAX_PANES:
            self._does(ui, "+ compare" if count != 2 else "+", "pane:add")
        ui.space(4)

    def _run(self, ui: Ui) -> None:
        session = self.viewer.session
        ui.header("RUN")
        ui.row(0, 0, 0, 0, height=28, below=5)
        self._does(
            ui,
            "Pause" if session.playback.is_playing else "Play",
            "pause",
            chosen=not session.playback.is_playing,
        )
        self._does(ui, "Step", "step")
        self._does(ui, "Settle", "settle", chosen=session.playback.stop_when_settled)
        self._does(ui, "Restart", "restart")
        ui.row(46, 0, 42, height=22)
        ui.label("Speed")
        now = float(find_speed_index(session.playback.clock.speed))
        if (place := ui.slider("speed", now, 0.0, len(SPEEDS) - 1.0, step=1.0)) is not None:
            self.viewer.attempt(lambda: self.viewer.set_speed(SPEEDS[round(place)]))
        ui.label(format_speed(session.playback.clock.speed), key="speed")

    def _tools(self, ui: Ui) -> None:
        ui.header("MOUSE")
        ui.row(0, 0, 0, 0, 0, below=4)
        for tool in self.viewer.tools.values():
            self._does(ui, tool.title, f"tool:{tool.name}", chosen=self.viewer.tool is tool, small=True)
        ui.space(6)

    def _parameters(self, ui: Ui) -> None:
        found, law = (
            self.viewer.parameters(),
            self.viewer.session.displayed.get_setup(self.viewer.pane).controller,
        )
        team = [each for each in found if each.name.startswith("team.")]
        gains = [each for each in found if each not in team]
        groups = {f"GAINS OF {law.label.upper()}": gains, "ROBOTS": team}
        with ui.scroll(f"parameters:{law.name}"):
            for title, group in groups.items():
                if not ui.section(title, key=title.split()[0]):
                    continue
                if not group:
                    ui.label("none", style="unit")
                for each in group:
                    if isinstance(each, Pick):
                        self._words(ui, each)
                    else:
                        self._slider(ui, each)
                ui.space(4)

    def _set(self, name: str, value: float | str | None) -> None:
        self.viewer.attempt(lambda: self.viewer.set_parameter(name, value))

    def _slider(self, ui: Ui, each: Parameter) -> None:
        ui.row(100, 0, 50, 34, 22, height=24, gap=3, below=3)
        ui.label(each.label, tip=f"{each.meaning} ({each.unit})" if each.unit else each.meaning)
        if (place := ui.slider(each.name, each.place(), 0.0, 1.0)) is not None:
            self._set(each.name, each.at(place))
        if (text := ui.text_entry(each.name, each.words())) is not None:
            self.viewer.attempt(lambda: self.viewer.set_parameter(each.name, each.read(text)))
        ui.label(each.unit, key=f"unit:{each.name}", style="unit")
        usual = "no limit" if each.default is None else f"{each.default:g} {each.unit}".rstrip()
        self._reset(ui, each, usual)

    def _words(self, ui: Ui, each: Pick) -> None:
        count = len(each.offered)
        width = (ui.wide - 103 - 25 - 3 * (count - 1)) / count
        fits = all(shortened(word, round(SMALL), width - 6) == word for word in each.offered)
        ui.row(100, *([0.0] * (count if fits else 1)), 22, height=24, gap=3, below=3)
        ui.label(each.label, tip=each.meaning)
        if not fits and (word := ui.dropdown(each.name, each.offered, each.value, tip=each.meaning)):
            self._set(each.name, word)
        for word in each.offered if fits else ():
            key, chosen = f"{each.name}:{word}", word == each.value
            if ui.button(word, key=key, tip=each.meaning, chosen=chosen, small=True):
                self._set(each.name, word)
        self._reset(ui, each, each.default)

    def _reset(self, ui: Ui, each: Parameter | Pick, usual: str) -> None:
        if ui.button("↺", key=f"reset:{each.name}", tip=f"Back to the default: {usual}", small=True):
            self._set(each.name, each.default)

    def _show(self, ui: Ui) -> None:
        viewer, names = self.viewer, [name for name in self.titles if name not in NOT_OFFERED]
        rows = -(-len(names) // 2)
        with ui.scroll("show"):
            ui.row(0, 0, height=21, below=3)
            # down the first column, then the second
            for name in chain.from_iterable(zip_longest(names[:rows], names[rows:])):
                if name is None:
                    ui.cell()
                    continue
                tip = self._commands[f"layer:{name}"].tip
                if ui.check(self.titles[name], key=name, now=name in viewer.shown, tip=tip) is not None:
                    self._do(f"layer:{name}")
            ui.space(5)
            ui.row(0, 0, 0)
            self._does(ui, "Fading", "fade", chosen=viewer.fade)
            self._does(ui, "Dark" if viewer.theme == "light" else "Light", "theme")
            self._does(ui, "Whole map", "fit")

    def _robot(self, ui: Ui) -> None:
        why = "" if self.viewer.selected is not None else "no robot is chosen: click one first, or press Tab"
        ui.row(0, 0, 0, 0, below=8)
        self._does(ui, "◀", "robot:previous")
        self._does(ui, "▶", "robot:next")
        failed = self.viewer.selected in self.viewer.session.displayed.get_setup(self.viewer.pane).failed
        self._does(ui, "Revive" if failed else "Fail", "robot:fail", why=why)
        self._does(ui, "Remove", "robot:remove", why=why)
        with ui.scroll(f"robot:{self.viewer.selected}"):
            if self.report is None:
                ui.words(_NOBODY, color=ui.theme.faint)
            else:
                show_report(ui, self.report)

    def _keep(self, ui: Ui) -> None:
        ui.row(0, 0, height=28, below=5)
        for text, action in _KEPT:
            filming = action == "film" and self.viewer.filming
            self._does(ui, "End film" if filming else text, action, chosen=filming)


def show_report(ui: Ui, report: Report) -> None:
    ui.words(report.title, size=14, bold=True)
    ui.space(3)
    ui.words(report.verdict, size=12.5, bold=True, color=ui.theme.final)
    ui.space(4)
    largest = max((float(np.hypot(*e.vector)) for e in report.lines if e.vector is not None), default=1.0)
    for each in report.lines:
        size = 0.0 if each.vector is None else float(np.hypot(*each.vector))
        if ui.surface is not None and each.vector is not None and size >= NOTHING:
            length = 13 * ui.scale * (0.35 + 0.65 * size / max(largest, NOTHING))
            half = np.array(each.vector) / size * (length, -length)
            middle = np.array(ui.rest.topleft) + np.array([14, 8]) * ui.scale
            canvas = flat_canvas(ui.surface, ui.theme, ui.scale)
            color = ui.theme.forces.get(each.kind, ui.theme.ink)
            canvas.arrow((middle - half).tolist(), (middle + half).tolist(), color, 2 * ui.scale)
        ui.words(each.text, size=11.5, indent=34.0 if each.vector is not None else 0.0)
        ui.space(3)


def short_names(files: list[str]) -> dict[str, str]:
    """Return what maps are called in the menu, by what they are: files without their folders.

    >>> short_names(["rooms", "/tmp/a/rooms-1.json", "a/x.json", "b/x.json"])
    {'rooms': 'rooms', '/tmp/a/rooms-1.json': 'rooms-1.json', 'a/x.json': 'a/x.json', 'b/x.json': 'b/x.json'}
    """
    names = [Path(file).name for file in files]
    return {file: name if names.count(name) == 1 else file for file, name in zip(files, names, strict=True)}


def law_labels(names: Iterable[str], shown: Mapping[str, str]) -> dict[str, str]:
    """Return what controllers are called in the menu, by their names; no two are called the same.

    A user's are loaded for it, but not those in `shown`, which are at work and may be of a saved run.

    >>> law_labels(["rapf", "lloyd"], {"theirs.py:Mine": "Mine"})
    {'rapf': 'RAPF', 'lloyd': 'Lloyd', 'theirs.py:Mine': 'Mine'}
    """
    found: dict[str, str] = {}
    for name in dict.fromkeys([*names, *shown]):
        try:
            label = shown[name] if name in shown else str(load_controller_class(name).label)
        except ParameterError:  # its file has changed since
            label = get_controller_label(name)
        file = Path(name.rpartition(":")[0]).name
        tried = (label, f"{label} ({file})", f"{label} ({name})")
        found[name] = next(each for each in tried if each not in found.values())
    return found
