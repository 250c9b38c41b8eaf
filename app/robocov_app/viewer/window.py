"""The window: events in, frames out. What happens between is the presenter's and the session's."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pygame

from robocov.errors import RobocovError
from robocov_app.render.picture import standard_layers
from robocov_app.render.theme import theme_named
from robocov_app.terminal.output import free_name
from robocov_app.toolkit.autosave import discard
from robocov_app.toolkit.command import Command, Commands, draw_keys, palette
from robocov_app.toolkit.dialogs import Answer, Dialogs, Option, Question, file_choice, list_choice
from robocov_app.toolkit.input import OF_THE_MOUSE
from robocov_app.toolkit.layout import laid_out
from robocov_app.toolkit.overlay import draw_message, draw_status
from robocov_app.toolkit.window import FPS, BaseWindow
from robocov_app.viewer.canvas import ViewerCanvas
from robocov_app.viewer.chart import Chart
from robocov_app.viewer.commands import GROUPS, REPEATS, Row, grouped, parameter_commands, viewer_commands
from robocov_app.viewer.explain import report_on
from robocov_app.viewer.film import FPS as FILM_FPS
from robocov_app.viewer.film import Film
from robocov_app.viewer.lesson_page import draw_caption, draw_tour
from robocov_app.viewer.lessons import LessonPlayer, load_lesson
from robocov_app.viewer.panel import TABS, Panel
from robocov_app.viewer.pointer import Pointer
from robocov_app.viewer.presenter import Presenter, plain
from robocov_app.viewer.saving import RunSaver
from robocov_app.viewer.session.curves import speeds_of
from robocov_app.viewer.session.file import SUFFIX
from robocov_app.viewer.session.workspace import Recovered
from robocov_app.viewer.status import HINT, facts, suggestion

_ASKED_AGAIN = 0.2  # seconds between two explanations of a robot
_GAP = 0.3  # seconds at the beginning of a curve that are not missed
_PAN = 60  # pixels that a key pans

_GOES_ON_WITH = {
    *("help", "theme", "screenshot", "film", "panel", "fullscreen", "quit", "pause"),
    *("slower", "faster", "fit", "zoom:in", "zoom:out", "plot"),
}
"""Commands that do not leave the lesson."""

_HINT = "Wheel: zoom at the cursor · drag the floor or the right button: pan · F1 or Esc closes"


class Window(BaseWindow):
    """Shows a session and lets it be touched.

    `scale`: of text and lines. `patient`: nobody watches: films wait for their encoder instead of leaving
    frames out. `screen`: of a window that is there already.
    """

    hint = HINT

    def __init__(
        self,
        viewer: Presenter,
        size: tuple[int, int],
        scale: float,
        *,
        patient: bool = False,
        screen: pygame.Surface | None = None,
    ) -> None:
        super().__init__(size, screen)
        self.viewer, self.scale = viewer, scale
        self.help = False
        self.tour: LessonPlayer | None = None
        self.film: Film | None = None
        self.keeper = RunSaver(viewer.costs.lattice)
        self.titles = {layer.name: layer.title for layer in standard_layers()}
        pygame.display.set_caption("robocov")
        self.canvas = ViewerCanvas(viewer, theme_named(viewer.theme))
        self.chart = Chart(viewer)
        self.dialogs = Dialogs()
        listed = [*viewer_commands(viewer, self.titles), *self._own_commands()]
        self.commands = Commands(listed, viewer.attempt, lambda: parameter_commands(viewer))
        self.panel = Panel(viewer, self.titles, self.commands, self.do)
        self.pointer = Pointer(viewer, self.canvas, self.chart, self.panel, self._leave_lesson)
        self._patient = patient
        self._arranged: tuple[object, ...] | None = None
        self._reported: tuple[object, float] = None, 0.0
        self._now = self._unfilmed = self._steps_rate = 0.0
        self._answers, self._serial = 0, -1
        self._spots: list[tuple[pygame.Rect, Callable[[], object]]] = []
        self._arrange()
        self.draw()

    # frames

    def close(self) -> None:
        """End what is going on beside the window, and a lesson, so that what was before it is kept."""
        self._end_tour()
        if self.film is not None:
            self.viewer.attempt(self.toggle_film)
        self.viewer.costs.close()

    def suit(self, scale: float, theme: str, *, panel: bool | None) -> None:
        """Take the look of where the window is shown; `panel`: to show or hide it, None to leave it."""
        viewer, self.scale = self.viewer, scale
        viewer.theme, viewer.panel = theme, viewer.panel if panel is None else panel
        viewer.version += 1

    def update(self, seconds: float) -> None:
        """Let so many seconds pass, for the simulation, its cost and the panel."""
        self._now += seconds
        self._unfilmed += seconds
        self._pass_time(seconds)
        self._ask_costs()
        self._arrange()
        self._inspect()
        self.panel.covered = self._lesson_shown
        self.panel.update(seconds)
        self.pointer.show()

    def look(self) -> object:
        """Return all that changes the picture without an event; None while something moves."""
        viewer, session, tour = self.viewer, self.viewer.session, self.tour
        at_rest = session.settled and session.live and not session.environment.moves
        if (session.playing and not at_rest) or self.film is not None:
            return None
        return (
            *(viewer.version, viewer.message, viewer.trouble, session.time, session.serial, session.playing),
            *(self._answers, viewer.costs.state, self._arranged, self.panel.ui.stale),
            tour and (tour.state, tour.number, tour.progress),
        )

    def _pass_time(self, seconds: float) -> None:
        viewer, session = self.viewer, self.viewer.session
        viewer.pass_time(seconds)
        viewer.workspace.keep(viewer.view)
        for words, trouble in self.keeper.poll():
            viewer.say(words, trouble=trouble)
        if self.tour is not None:
            self.tour.advance(seconds)
            if self.tour.done:
                self.tour = None
        playing = session.playing
        try:
            slices = max(round(seconds * FPS), 1) if self.resting else 1  # a long pause is many frames
            steps = sum(session.advance(seconds / slices) for _ in range(slices))
            for pane in session.panes:
                session.snapshot(pane)  # what is decided belongs to the simulation, not to drawing
        except RobocovError as error:
            steps = 0
            viewer.say(plain(str(error)), trouble=True)
        if session.settled:
            viewer.rested = session.head
        if session.playing != playing:
            viewer.version += 1
            if session.settled:
                viewer.say(f"settled at {session.time:.1f} s")
            elif session.at_end_of_record and session.live and not viewer.trouble:
                viewer.say("the record ends here; Space goes on from it, by simulating")
        if seconds > 0:
            self._steps_rate += 0.1 * (steps / seconds - self._steps_rate)
        viewer.look_at_map()

    def _ask_costs(self) -> None:
        """Ask for the cost of what is shown, and note the answers that tell of the present."""
        viewer, session = self.viewer, self.viewer.session
        if session.serial != self._serial:
            self._serial = session.serial
            viewer.costs.forget()
        point = np.array(viewer.cursor) if "path" in viewer.shown and viewer.cursor is not None else None
        for pane in session.panes:
            positions, known = session.positions(pane), viewer.costs.known.get(pane.number)
            fresh = known is not None and point is None and abs(known.time - session.time) < 1e-9
            if not (fresh and known is not None and np.array_equal(known.result.positions, positions)):
                viewer.costs.ask(pane.number, session.time, positions, point, speeds_of(session, pane))
        self._ask_beginning()
        for number, known in viewer.costs.poll():
            self._answers += 1
            for pane in session.panes:
                if pane.number == number and known.time <= pane.time + 1e-9:
                    pane.curve.add(known.time, known.result.mean_distance)
                    if known.travel_time is not None:
                        pane.curves["time"].add(known.time, known.travel_time)

    def _ask_beginning(self) -> None:
        """Ask in turn with the present for the costs of the time in which nobody answered yet."""
        session, costs = self.viewer.session, self.viewer.costs
        if session.head.kind != "begin" or not session.live or (session.playing and self._answers % 2):
            return
        for pane in session.panes:
            first = min(pane.curve.time, default=0.0)
            if first <= _GAP:
                continue
            k = session.history.at(first - _GAP if first > 2 * _GAP else 0.0)
            state, speeds = session.history[k].states[pane.number], speeds_of(session, pane)
            if speeds is None or len(speeds) == len(state.positions):
                costs.ask(pane.number, session.history.time(k), state.positions, speeds=speeds, aside=True)

    def _arrange(self) -> None:
        """Lay the window out anew when its size, look or number of panes is another."""
        viewer, session = self.viewer, self.viewer.session
        size = self.screen.get_size()
        panes = len(session.panes)
        rows = self.canvas.shared_rows() if panes > 1 and self._arranged else 1
        low_x, low_y, high_x, high_y = session.environment.region.bounds
        aspect = (high_x - low_x) / (high_y - low_y)
        outer = (size, self.scale, viewer.panel, viewer.theme)
        key = (outer, panes, round(aspect, 3), max(rows, 1))
        if key == self._arranged:
            return
        before, self._arranged = self._arranged, key
        theme = theme_named(viewer.theme)
        layout = laid_out(size, self.scale, panes, aspect, panel=viewer.panel, legend_rows=max(rows, 1))
        self.layout, self.theme = layout, theme
        self.canvas.arrange(layout, theme)
        self.chart.arrange(layout, theme)
        if before is None or outer != before[0]:
            self.panel.arrange(layout, theme)

    def draw(self) -> None:
        """Draw everything, and show it."""
        layout, theme, viewer = self.layout, self.theme, self.viewer
        if len(layout.panes) > 1:
            self.screen.fill(theme.background, pygame.Rect(layout.arena))
        self.canvas.draw(self.screen)
        self.chart.draw(self.screen)
        filmed = None if self.film is None else self.film.frames / FILM_FPS
        line = facts(viewer, self.rate, self._steps_rate, filmed)
        waits = self.tour is not None and not self._lesson_shown
        hint = "F2 back to the lesson · Esc ends it" if waits else self.hint
        draw_status(self.screen, layout.status, theme, layout.scale, line, hint)
        self._spots = []
        if layout.panel[2] and self.tour is not None and self._lesson_shown:
            self._spots = draw_tour(self.screen, layout, theme, self.tour)
        elif layout.panel[2]:
            self.panel.draw(self.screen)
        if self.tour is not None and self._lesson_shown and not layout.panel[2]:
            words = " ".join([self.tour.text, *self.tour.asks])
            draw_caption(self.screen, layout, theme, self.tour.title, words, self.tour.progress)
        said = viewer.message
        if not said and not self._patient and not self._lesson_shown:
            said = suggestion(viewer)
        draw_message(
            self.screen, said, layout.arena, theme, layout.scale, bool(viewer.message) and viewer.trouble
        )
        if self.help:
            draw_keys(self.screen, theme, layout.scale, self.commands.listed, GROUPS, _HINT)
        self.dialogs.draw(self.screen, theme, layout.scale)
        pygame.display.flip()
        if self.film is not None:
            self.film.add(self.screen, self._unfilmed)
        self._unfilmed = 0.0

    def _inspect(self) -> None:
        """Let the inspector explain the robot that is asked, a few times a second while that is in sight."""
        number, panel, session = self.viewer.selected, self.panel, self.viewer.session
        if number is None or panel.tab != "robot" or panel.hidden:
            panel.report = None
            return
        shown, (before, at) = (number, session.time, session.serial, self.viewer.version), self._reported
        if panel.report is None or (shown != before and self._now - at >= _ASKED_AGAIN):
            self._reported = shown, self._now
            panel.report = report_on(self.viewer, number)

    # doing

    def do(self, name: str) -> None:
        """Do the action of this name."""
        if self.tour is not None and self.tour.state != "left" and name in ("back", "forward"):
            self.tour.skip(1 if name == "forward" else -1)
            return
        if name == "pause" and self._asked():
            self.viewer.say("first say what you expect: press its number, or click it")
            return
        if name == "pause" and self.tour is not None and self.tour.state == "ended":
            self.viewer.say(self.tour.hold())
            return
        if name == "cancel" and self._end_tour():
            return
        if name not in _GOES_ON_WITH and name != "tour":
            self._leave_lesson()
        if name == "cancel" and self.help:
            self.help = False
            return
        self.commands.do(name)
        self.panel.report = None
        if name in ("robot:next", "robot:previous"):
            self.panel.show_tab("robot")

    def _own_commands(self) -> list[Command]:
        def panned(x: int, y: int) -> Callable[[], None]:
            return lambda: self.canvas.pan(_PAN * x, _PAN * y)

        def zoomed(factor: float) -> Callable[[], None]:
            return lambda: self.canvas.zoom(factor, self._middle())

        return [
            *grouped(
                "View",
                Row("fit", "Show the whole map", self.canvas.fit, "f"),
                Row("zoom:in", "Zoom in", zoomed(1.25), "ctrl+=, ctrl++", REPEATS),
                Row("zoom:out", "Zoom out", zoomed(0.8), "ctrl+-", REPEATS),
                Row("pan:left", "Pan left", panned(1, 0), "ctrl+left", REPEATS),
                Row("pan:right", "Pan right", panned(-1, 0), "ctrl+right", REPEATS),
                Row("pan:up", "Pan up", panned(0, 1), "ctrl+up", REPEATS),
                Row("pan:down", "Pan down", panned(0, -1), "ctrl+down", REPEATS),
                Row("plot", "Plot mean distance or mean time", self.chart.switch, "y"),
                Row("tab", "Next page of the panel", self._next_tab, "ctrl+tab"),
                Row("fullscreen", "Full screen", self.toggle_fullscreen, "f11"),
            ),
            *grouped(
                "Keep",
                Row("screenshot", "Screenshot", lambda: self.save_screenshot(self.viewer.folder), "f12"),
                Row("film", "Record a film, or end it", self.toggle_film, "f9"),
                Row("save:run", "Save the run", self._save_run, "ctrl+e"),
                Row("open:file", "Open a session or a map", self._open_file, "ctrl+o"),
            ),
            *grouped(
                "Help",
                Row("help", "Keys", self._toggle_help, "f1, shift+/"),
                Row("palette", "Commands by name", self._open_palette, "ctrl+k, /"),
                Row("tour", "The lesson, or just play", self._start_tour, "f2"),
                Row("quit", "Quit", self._quit, "ctrl+q"),
            ),
            *grouped("Time", Row("branches", "List of branches", self._list_branches, "ctrl+b")),
        ]

    def _end_tour(self) -> bool:
        if self.tour is None:
            return False
        self.tour.end()
        self.tour = None
        return True

    def _middle(self) -> tuple[float, float]:
        if self.canvas.pane_at(self.pointer.at) is not None:
            return self.pointer.at
        left, top, width, height = self.layout.panes[0]
        return left + width / 2, top + height / 2

    def _next_tab(self) -> None:
        self.panel.show_tab(TABS[(TABS.index(self.panel.tab) + 1) % len(TABS)])

    def _open_palette(self) -> None:
        def told(words: str) -> None:
            self.viewer.attempt(lambda: words or None)
            self.panel.report = None

        ghost = "Type a command, or  k_rep 0.5 · robots 12 · map office · speed 4"
        self.dialogs.ask(palette(self.commands, ghost, told))

    def _open_file(self) -> None:
        recent = [path for name in self.viewer.recent if (path := Path(name)).exists()]
        endings = (SUFFIX, ".json")
        title = "Open a session or a map"
        self.dialogs.ask(
            file_choice(title, self.viewer.folder, self.viewer.open_file, endings=endings, recent=recent)
        )

    def _list_branches(self) -> None:
        viewer, session = self.viewer, self.viewer.session
        session.stow()  # the curve of the present with those of the others

        def lines() -> list[Option]:
            found = []
            for k, each in enumerate(session.branches, 1):
                text = f"{k}  {each.words}" + ("  (here)" if each.node is session.head else "")
                found.append(Option(text, each.told(session.scenario.dt), value=each.node.number))
            return found

        self.dialogs.ask(list_choice("Branches", lines, lambda option: viewer.enter(int(str(option.value)))))

    def offer_lesson(self) -> None:
        """Ask who is here for the first time whether to begin with the lesson; until then the team waits."""
        session = self.viewer.session
        playing, session.playing = session.playing, False

        def go_on() -> None:
            session.playing = playing

        def begin_lesson() -> None:
            go_on()
            self._start_tour()

        words = (
            "A team of robots spreads over a map that it does not know. The lesson shows what holds it back "
            "and what helps, in a few minutes; it is also there later, by F2."
        )
        answers = [Answer("Lesson 1", begin_lesson), Answer("Just let me play", go_on)]
        self.dialogs.ask(Question("Welcome to robocov", words, answers, go_on))

    def offer_recovery(self, found: Sequence[Recovered]) -> None:
        """Ask whether to go on with what windows left behind, the newest first; until then the team waits."""
        viewer, session, newest = self.viewer, self.viewer.session, found[0]
        playing, session.playing = session.playing, False

        def later() -> None:
            session.playing = playing

        def recover() -> None:
            later()
            viewer.attempt(lambda: viewer.recover(newest))

        def throw_away() -> None:
            discard(newest.folder)
            later()
            if found[1:]:
                self.offer_recovery(found[1:])

        words = f"A window ended without saving: {newest.words}."
        if more := len(found) - 1:
            words += f"\n{more} more {'are' if more > 1 else 'is'} kept besides."
        answers = [
            Answer("Recover", recover, "r"),
            Answer("Discard", throw_away, "d"),
            Answer("Later", later, "l"),
        ]
        self.dialogs.ask(Question("Recover unsaved work?", words, answers, later))

    def _toggle_help(self) -> None:
        self.help = not self.help

    def _quit(self) -> None:
        self.closed = True

    def _start_tour(self) -> None:
        if self.tour is None:
            self.tour = LessonPlayer(self.viewer, self.canvas.fit, alone=self._patient)
        elif self.tour.state == "left":
            self.tour.come_back()
        else:
            self.tour.leave(task=True)

    def start_lesson(self, path: Path) -> None:
        """Play a lesson of a file; MapError as `load_lesson`."""
        self.tour = LessonPlayer(self.viewer, self.canvas.fit, load_lesson(path), alone=self._patient)

    @property
    def _lesson_shown(self) -> bool:
        """Whether a lesson has the place of the panel."""
        return self.tour is not None and self.tour.state != "left"

    def _asked(self) -> bool:
        return self.tour is not None and self.tour.state == "asks"

    def _spot(self, at: tuple[int, int]) -> Callable[[], object] | None:
        """What a click does on the page of a lesson."""
        return next((do for box, do in self._spots if box.collidepoint(at)), None)

    def _leave_lesson(self) -> None:
        """Let whoever touches something play; the lesson waits."""
        if self.tour is not None:
            self.tour.leave()

    def _save_run(self) -> str:
        return self.keeper.save(self.viewer.session, self.viewer.folder, self.viewer.map_name)

    def toggle_film(self) -> str:
        """Begin to record what is in the window, or end it."""
        if self.film is None:
            target = free_name(self.viewer.folder, "robocov", ".mp4")
            self.film = Film(target, self.screen.get_size(), patient=self._patient)
            self.viewer.filming = True
            return f"recording {target}; F9 ends it"
        film, self.film = self.film, None
        self.viewer.filming = False
        film.close()
        left_out = f", {film.left_out} frames left out" if film.left_out else ""
        return f"film saved: {film.path} ({film.frames / FILM_FPS:.1f} s{left_out})"

    # events

    def take(self, event: pygame.event.Event) -> None:
        """Take one event."""
        if event.type == pygame.KEYUP:
            self.commands.release(event)
        elif event.type == pygame.WINDOWFOCUSLOST:
            self.commands.forget_keys()
        if event.type == pygame.QUIT:
            self.closed = True
        elif self.dialogs.take(event):
            return
        elif event.type == pygame.DROPFILE:
            path = Path(event.file)
            self.viewer.attempt(lambda: self.viewer.open_file(path))
        elif event.type == pygame.KEYDOWN and self._asked() and event.unicode in "1234" and event.unicode:
            assert self.tour is not None
            self.tour.reply(int(event.unicode))
        elif event.type == pygame.KEYDOWN:
            self._press(event)
        elif event.type == pygame.MOUSEBUTTONDOWN and self.help:
            self.help = False
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1 and (spot := self._spot(event.pos)):
            spot()
        elif event.type in OF_THE_MOUSE:
            self.pointer.take(event, self._now)
        elif event.type == pygame.WINDOWLEAVE:
            self.pointer.leave()
        else:
            self.panel.take(event)

    def _press(self, event: pygame.event.Event) -> None:
        """Take a key: for a field first, else for a command."""
        if self.panel.take(event):
            return
        command = self.commands.of_key(event)
        if command is not None:
            self.do(command.name)
        # the key's letter is still to come, and not meant for the palette
        self.dialogs.swallow(event.unicode)
