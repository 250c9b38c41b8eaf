"""The window: events in, frames out. What happens between is the presenter's and the session's."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from math import dist
from pathlib import Path

import numpy as np
import pygame

from robocov.environment import Point
from robocov.errors import RobocovError
from robocov_app.look.theme import get_theme
from robocov_app.render.picture import standard_layers
from robocov_app.storage.autosave import Draft, remove_draft
from robocov_app.terminal.output import find_free_path
from robocov_app.toolkit.command import Command, Commands, draw_keys, palette
from robocov_app.toolkit.dialogs import Answer, Dialogs, Option, Question, file_choice, list_choice
from robocov_app.toolkit.input import DOUBLE, OF_THE_MOUSE, SLIP, WHEEL, show_cursor, wheel_notches
from robocov_app.toolkit.layout import inside, laid_out
from robocov_app.toolkit.overlay import draw_message, draw_status
from robocov_app.toolkit.window import FPS, BaseWindow
from robocov_app.viewer.canvas import ViewerCanvas
from robocov_app.viewer.chart import Chart
from robocov_app.viewer.commands import GROUPS, REPEATS, Row, grouped, parameter_commands, viewer_commands
from robocov_app.viewer.explain import report_on
from robocov_app.viewer.film import FPS as FILM_FPS
from robocov_app.viewer.film import Film
from robocov_app.viewer.lesson_page import draw_caption, draw_tour
from robocov_app.viewer.lessons import FIRST, LessonPlayer, load_lesson
from robocov_app.viewer.panel import TABS, Panel
from robocov_app.viewer.presenter import Presenter, plain
from robocov_app.viewer.session.file import SUFFIX
from robocov_app.viewer.session.run_saver import RunSaver
from robocov_app.viewer.session.workspace import describe_draft
from robocov_app.viewer.status import HINT, facts, suggestion
from robocov_app.viewer.tools import Brush

_ASKED_AGAIN = 0.2  # seconds between two explanations of a robot
_GAP = 0.3  # seconds at the beginning of a curve that are not missed
_PAN = 60  # pixels that a key pans
_GOES_ON_WITH = {  # commands that do not leave the lesson
    *("help", "theme", "screenshot", "film", "panel", "fullscreen", "quit", "pause"),
    *("slower", "faster", "fit", "zoom:in", "zoom:out", "plot", "tour"),
}
_HINT = "Wheel: zoom at the cursor · drag the floor or the right button: pan · F1 or Esc closes"
_TAKES_ROBOTS = ("hand", "eraser", "failure")  # tools that take hold of a robot


class Pointer:
    """Turns events of the mouse into what panel, canvas, chart and tools do: the panel comes first."""

    def __init__(self, window: "Window") -> None:
        self._viewer, self._canvas, self._chart = window.viewer, window.canvas, window.chart
        self._panel, self._interrupt = window.panel, window.leave_lesson
        self.at = self._pressed_at = (0, 0)
        self._drag, self._held, self._button = "", 0, 0
        self._last_click = -1.0, (0, 0)

    def take(self, event: pygame.event.Event, now: float) -> None:
        self.at = self.at if event.type == pygame.MOUSEWHEEL else event.pos
        taken = not self._drag and self._panel.take(event)
        if event.type == pygame.MOUSEMOTION:
            self._moved(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            self._released(event)
        elif taken:
            self._viewer.cursor = None
        elif event.type == pygame.MOUSEBUTTONDOWN:
            self._panel.ui.stop_typing()
            self._pressed(event, now)
        elif self._canvas.pane_at(self.at) is not None:
            factor = WHEEL ** wheel_notches(event)
            if isinstance(self._viewer.tool, Brush):
                self._viewer.widen(factor)
            else:
                self._canvas.zoom(factor, self.at)

    def show(self) -> None:
        """Let the cursor, and a ring around the robot under it, tell what a press would do."""
        viewer, canvas, layout = self._viewer, self._canvas, self._canvas.layout
        pane, number = canvas.pane_at(self.at) if viewer.cursor is not None else None, None
        if pane is not None:  # the cameras may have moved below it
            viewer.cursor, viewer.cursor_pane = canvas.to_world(self.at, pane), pane
            number = canvas.robot_at(self.at, pane) if viewer.tool.name in _TAKES_ROBOTS else None
        canvas.hovered = (-1, -1) if pane is None or number is None else (pane, number)
        shape = pygame.SYSTEM_CURSOR_ARROW
        if number is not None:
            shape = pygame.SYSTEM_CURSOR_HAND
        elif pane is not None and viewer.tool is not viewer.hand:
            shape = pygame.SYSTEM_CURSOR_CROSSHAIR
        elif inside(layout.track, self.at) or inside(layout.chart, self.at):
            shape = pygame.SYSTEM_CURSOR_HAND if self._chart.offers(self.at) else pygame.SYSTEM_CURSOR_SIZEWE
        show_cursor(shape)

    def _pressed(self, event: pygame.event.Event, now: float) -> None:
        viewer, layout = self._viewer, self._canvas.layout
        if self._drag:  # a second button while the first is held
            return
        pane = self._canvas.pane_at(event.pos)
        self._pressed_at, self._button = event.pos, event.button
        if inside(layout.track, event.pos) or inside(layout.chart, event.pos):
            if event.button == 1:
                self._press_chart(event.pos)
            return
        if pane is None or event.button not in (1, 2, 3):
            return
        brush = viewer.tool if isinstance(viewer.tool, Brush) else None
        if event.button != 1 and not (brush and event.button == 3):
            self._drag = "pan"
            return
        if brush:
            brush.lowers = event.button == 3
        self._interrupt()
        pane = min(pane, len(viewer.session.timeline.panes) - 1)
        if viewer.active != pane:
            viewer.active = pane
            viewer.version += 1
        then, where = self._last_click
        double = now - then < DOUBLE and dist(where, event.pos) < SLIP
        self._last_click = now, event.pos
        if double and viewer.tool.name in ("polygon", "wall"):
            viewer.attempt(viewer.finish)
            return
        point = self._canvas.to_world(event.pos, pane)
        number, reach = self._canvas.robot_at(event.pos, pane), self._canvas.reach(pane)
        viewer.attempt(lambda: viewer.tool.press(viewer.session, point, reach, number))
        if viewer.tool is viewer.hand and number is not None:
            self._panel.show_tab("robot")
        self._drag = "pan" if viewer.tool is viewer.hand and not viewer.hand.holds else "tool"
        self._held = pane

    def _press_chart(self, at: tuple[int, int]) -> None:
        viewer, chart = self._viewer, self._chart
        if chart.offers(at):
            viewer.attempt(chart.switch)
        elif (ghost := chart.ghost_at(at)) is not None:
            viewer.attempt(lambda: viewer.enter(ghost))
        else:
            self._interrupt()
            self._drag = "time"
            viewer.attempt(lambda: viewer.look_at(chart.time_at(at[0])))

    def _moved(self, event: pygame.event.Event) -> None:
        viewer = self._viewer
        pane, viewer.cursor = self._canvas.pane_at(event.pos), None
        if pane is not None and not inside(self._canvas.layout.panel, event.pos):
            viewer.cursor, viewer.cursor_pane = self._canvas.to_world(event.pos, pane), pane
        self._chart.hover = event.pos if not self._drag else None
        if self._drag == "time":
            viewer.attempt(lambda: viewer.look_at(self._chart.time_at(event.pos[0])))
        elif self._drag == "pan":
            self._canvas.pan(*event.rel)
        elif self._drag == "tool":
            viewer.attempt(lambda: viewer.tool.move(viewer.session, self._place(event.pos)))
        elif viewer.cursor is not None:
            viewer.tool.move(viewer.session, viewer.cursor)

    def _released(self, event: pygame.event.Event) -> None:
        if event.button != self._button:  # another one than the one that is held
            return
        viewer, drag, clicked = self._viewer, self._drag, dist(event.pos, self._pressed_at) < SLIP
        self._drag = ""
        if drag == "tool":
            viewer.attempt(lambda: viewer.tool.release(viewer.session, self._place(event.pos)))
        elif drag == "pan" and clicked and event.button == 3:
            viewer.attempt(viewer.finish)
        elif drag == "pan" and clicked and event.button == 1 and viewer.tool is viewer.hand:
            viewer.hand.selected = None
            viewer.version += 1

    def _place(self, at: tuple[int, int]) -> Point:
        """Return the place under a pixel, m, in the pane in which the button was pressed."""
        return self._canvas.to_world(at, min(self._held, len(self._canvas.layout.panes) - 1))


class Window(BaseWindow):
    """Shows a session and lets it be touched."""

    hint = HINT

    def __init__(
        self,
        viewer: Presenter,
        size: tuple[int, int],
        scale: float,  # of text and lines
        *,
        patient: bool = False,  # nobody watches: films wait for their encoder instead of leaving frames out
        screen: pygame.Surface | None = None,  # of a window that is there already
    ) -> None:
        super().__init__(size, screen)
        self.viewer, self.scale, self.help = viewer, scale, False
        self.tour: LessonPlayer | None = None
        self.film: Film | None = None
        self.keeper = RunSaver(viewer.costs.lattice)
        self.titles = {layer.name: layer.title for layer in standard_layers()}
        pygame.display.set_caption("robocov")
        self.canvas = ViewerCanvas(viewer, get_theme(viewer.theme))
        self.chart, self.dialogs = Chart(viewer), Dialogs()
        listed = [*viewer_commands(viewer, self.titles), *self._own_commands()]
        self.commands = Commands(listed, viewer.attempt, lambda: parameter_commands(viewer))
        self.panel = Panel(viewer, self.titles, self.commands, self.do)
        self.pointer, self._patient = Pointer(self), patient
        self._arranged: tuple[object, ...] | None = None
        self._reported: tuple[object, float] = None, 0.0
        self._now = self._unfilmed = self._steps_rate = 0.0
        self._answers, self._serial = 0, -1
        self._spots: list[tuple[pygame.Rect, Callable[[], object]]] = []
        self._arrange()
        self.draw()

    def save_point(self) -> Callable[[], None]:
        viewer = self.viewer
        session = viewer.session
        point = session.build_save_point()

        def take_back() -> None:
            if viewer.session is session:
                session.restore(point, in_step=True)
            viewer.tool.cancel(viewer.session)
            viewer.version += 1

        return take_back

    def report_fault(self, message: str, *, in_drawing: bool) -> None:
        if in_drawing:
            self.help = False
            self.dialogs.drop()
            self._end_tour()
            self.canvas.fit()
        self.viewer.say(message, trouble=True)
        self.viewer.version += 1

    def close(self) -> None:
        self.viewer.workspace.save_draft(self.viewer.view, at_once=True)
        self._end_tour()  # what was before it is kept
        if self.film is not None:
            self.viewer.attempt(self.toggle_film)
        self.viewer.costs.close()

    def suit(self, scale: float, theme: str, *, panel: bool | None) -> None:
        viewer, self.scale = self.viewer, scale
        viewer.theme, viewer.panel = theme, viewer.panel if panel is None else panel
        viewer.version += 1

    def update(self, seconds: float) -> None:
        self._now += seconds
        self._unfilmed += seconds
        self._pass_time(seconds)
        self._ask_costs()
        self._arrange()
        self._inspect()
        self.panel.covered = self._lesson is not None
        self.panel.update(seconds)
        self.pointer.show()

    def look(self) -> object:
        viewer, session, tour = self.viewer, self.viewer.session, self.tour
        at_rest = (
            session.timeline.is_settled
            and session.timeline.is_live
            and not session.displayed.environment.has_moving_obstacles
        )
        if (session.playback.is_playing and not at_rest) or self.film is not None:
            return None
        told = (
            viewer.version,
            viewer.message,
            viewer.trouble,
            session.displayed.time,
            session.timeline.past_version,
            session.playback.is_playing,
        )
        drawn = self._answers, viewer.costs.state, self._arranged, self.panel.ui.stale
        return *told, *drawn, tour and (tour.state, tour.number, tour.progress)

    def _pass_time(self, seconds: float) -> None:
        viewer, session = self.viewer, self.viewer.session
        viewer.pass_time(seconds)
        viewer.workspace.save_draft(viewer.view)
        for words, trouble in self.keeper.poll():
            viewer.say(words, trouble=trouble)
        if self.tour is not None:
            self.tour.advance(seconds)
            self.tour = None if self.tour.done else self.tour
        playing = session.playback.is_playing
        try:
            slices = max(round(seconds * FPS), 1) if self.resting else 1  # a long pause is many frames
            steps = sum(session.playback.advance(seconds / slices) for _ in range(slices))
            for pane in session.timeline.panes:
                session.displayed.get_snapshot(
                    pane
                )  # what is decided belongs to the simulation, not to drawing
        except RobocovError as error:
            steps = 0
            viewer.say(plain(str(error)), trouble=True)
        if session.timeline.is_settled:
            viewer.rested = session.timeline.head
        if session.playback.is_playing != playing:
            viewer.version += 1
            if session.timeline.is_settled:
                viewer.say(f"settled at {session.displayed.time:.1f} s")
            elif session.timeline.is_at_record_end and session.timeline.is_live and not viewer.trouble:
                viewer.say("the record ends here; Space goes on from it, by simulating")
        if seconds > 0:
            self._steps_rate += 0.1 * (steps / seconds - self._steps_rate)
        viewer.look_at_map()

    def _ask_costs(self) -> None:
        viewer, session = self.viewer, self.viewer.session
        if session.timeline.past_version != self._serial:
            self._serial = session.timeline.past_version
            viewer.costs.forget()
        point = np.array(viewer.cursor) if "path" in viewer.shown and viewer.cursor is not None else None
        for pane in session.timeline.panes:
            positions, known = session.displayed.get_positions(pane), viewer.costs.known.get(pane.number)
            fresh = known is not None and point is None and abs(known.time - session.displayed.time) < 1e-9
            if known is None or not (fresh and np.array_equal(known.result.positions, positions)):
                viewer.costs.ask(
                    pane.number,
                    session.displayed.time,
                    positions,
                    point,
                    session.displayed.get_setup(pane).speed_limits,
                )
        self._ask_beginning()
        for number, known in viewer.costs.poll():
            self._answers += 1
            for pane in session.timeline.panes:
                if pane.number == number and known.time <= pane.time + 1e-9:
                    pane.distance_curve.add(known.time, known.result.mean_distance)
                    if known.travel_time is not None:
                        pane.curves["time"].add(known.time, known.travel_time)

    def _ask_beginning(self) -> None:
        """Ask in turn with the present for the costs of the time in which nobody answered yet."""
        session, costs = self.viewer.session, self.viewer.costs
        if (
            session.timeline.head.kind != "begin"
            or not session.timeline.is_live
            or (session.playback.is_playing and self._answers % 2)
        ):
            return
        for pane in session.timeline.panes:
            first = min(pane.distance_curve.times, default=0.0)
            if first <= _GAP:
                continue
            k = session.timeline.history.find_index(first - _GAP if first > 2 * _GAP else 0.0)
            state, time = (
                session.timeline.history[k].states[pane.number],
                session.timeline.history.get_time(k),
            )
            costs.ask(pane.number, time, state.positions, speeds=state.setup.speed_limits, aside=True)

    def _arrange(self) -> None:
        viewer, session, size = self.viewer, self.viewer.session, self.screen.get_size()
        panes = len(session.timeline.panes)
        rows = max(self.canvas.shared_rows(), 1) if panes > 1 and self._arranged else 1
        low_x, low_y, high_x, high_y = session.displayed.environment.region.bounds
        aspect = (high_x - low_x) / (high_y - low_y)
        outer = size, self.scale, viewer.panel, viewer.theme
        key = outer, panes, round(aspect, 3), rows
        if key == self._arranged:
            return
        before, self._arranged = self._arranged, key
        self.theme = theme = get_theme(viewer.theme)
        self.layout = layout = laid_out(size, self.scale, panes, aspect, panel=viewer.panel, legend_rows=rows)
        self.canvas.arrange(layout, theme)
        self.chart.arrange(layout, theme)
        if before is None or outer != before[0]:
            self.panel.arrange(layout, theme)

    def draw(self) -> None:
        layout, theme, viewer = self.layout, self.theme, self.viewer
        if len(layout.panes) > 1:
            self.screen.fill(theme.background, pygame.Rect(layout.arena))
        self.canvas.draw(self.screen)
        self.chart.draw(self.screen)
        filmed = None if self.film is None else self.film.frames / FILM_FPS
        line = facts(viewer, self.rate, self._steps_rate, filmed)
        waits = self.tour is not None and self._lesson is None
        hint = (
            self.hint
            if viewer.session.playback.is_playing
            else self.hint.replace("Space pause", "Space play")
        )
        hint = "F2 back to the lesson · Esc ends it" if waits else hint
        draw_status(self.screen, layout.status, theme, layout.scale, line, hint)
        self._spots = []
        if (lesson := self._lesson) is not None and layout.panel[2]:
            self._spots = draw_tour(self.screen, layout, theme, lesson)
        elif lesson is not None:
            draw_caption(self.screen, layout, theme, lesson)
        elif layout.panel[2]:
            self.panel.draw(self.screen)
        said, trouble = viewer.message, bool(viewer.message) and viewer.trouble
        if not said and not self._patient and lesson is None:
            said = suggestion(viewer)
        draw_message(self.screen, said, layout.arena, theme, layout.scale, trouble)
        if self.help:
            draw_keys(self.screen, theme, layout.scale, self.commands.listed, GROUPS, _HINT)
        self.dialogs.draw(self.screen, theme, layout.scale)
        self.show_screen()
        if self.film is not None:
            self.film.add(self.screen, self._unfilmed)
        self._unfilmed = 0.0

    def _inspect(self) -> None:
        number, panel, session = self.viewer.selected, self.panel, self.viewer.session
        if number is None or panel.tab != "robot" or panel.hidden:
            panel.report = None
            return
        shown, (before, at) = (
            (number, session.displayed.time, session.timeline.past_version, self.viewer.version),
            self._reported,
        )
        if panel.report is None or (shown != before and self._now - at >= _ASKED_AGAIN):
            self._reported = shown, self._now
            panel.report = report_on(self.viewer, number)

    def do(self, name: str) -> None:
        if self._lesson is not None and name in ("back", "forward"):
            self._lesson.skip(1 if name == "forward" else -1)
            return
        if name == "pause" and self.tour is not None and self.tour.state in ("asks", "ended"):
            first = "first say what you expect: press its number, or click it"
            self.viewer.say(first if self.tour.state == "asks" else self.tour.hold())
            return
        if name == "cancel" and self._end_tour():
            return
        if name not in _GOES_ON_WITH:
            self.leave_lesson()
        if name == "cancel" and self.help:
            self.help = False
            return
        self.commands.do(name)
        self.panel.report = None
        if name in ("robot:next", "robot:previous"):
            self.panel.show_tab("robot")

    def _own_commands(self) -> list[Command]:
        pan, zoom = self.canvas.pan, self._zoom
        groups: dict[str, Iterable[Row]] = {
            "View": [
                Row("fit", "Show the whole map", self.canvas.fit, "f"),
                Row("zoom:in", "Zoom in", partial(zoom, 1.25), "ctrl+=, ctrl++", REPEATS),
                Row("zoom:out", "Zoom out", partial(zoom, 0.8), "ctrl+-", REPEATS),
                Row("pan:left", "Pan left", partial(pan, _PAN, 0), "ctrl+left", REPEATS),
                Row("pan:right", "Pan right", partial(pan, -_PAN, 0), "ctrl+right", REPEATS),
                Row("pan:up", "Pan up", partial(pan, 0, _PAN), "ctrl+up", REPEATS),
                Row("pan:down", "Pan down", partial(pan, 0, -_PAN), "ctrl+down", REPEATS),
                Row("plot", "Plot mean distance or mean time", self.chart.switch, "y"),
                Row("tab", "Next page of the panel", self._next_tab, "ctrl+tab"),
                Row("fullscreen", "Full screen", self.toggle_fullscreen, "f11"),
            ],
            "Keep": [
                Row("screenshot", "Screenshot", lambda: self.save_screenshot(self.viewer.folder), "f12"),
                Row("film", "Record a film, or end it", self.toggle_film, "f9"),
                Row("save:run", "Save the run", self._save_run, "ctrl+e"),
                Row("open:file", "Open a session or a map", self._open_file, "ctrl+o"),
            ],
            "Help": [
                Row("help", "Keys", self._toggle_help, "f1, shift+/"),
                Row("palette", "Commands by name", self._open_palette, "ctrl+k, /"),
                Row("tour", "The lesson, or just play", self._start_tour, "f2"),
                Row("quit", "Quit", self._quit, "ctrl+q"),
            ],
            "Time": [Row("branches", "List of branches", self._list_branches, "ctrl+b")],
        }
        return grouped(groups)

    def _end_tour(self) -> bool:
        if self.tour is None:
            return False
        self.tour.end()
        self.tour = None
        return True

    def _zoom(self, factor: float) -> None:
        left, top, width, height = self.layout.panes[0]
        over = self.canvas.pane_at(self.pointer.at) is not None
        self.canvas.zoom(factor, self.pointer.at if over else (left + width / 2, top + height / 2))

    def _next_tab(self) -> None:
        self.panel.show_tab(TABS[(TABS.index(self.panel.tab) + 1) % len(TABS)])

    def _open_palette(self) -> None:
        def told(words: str) -> None:
            self.viewer.attempt(lambda: words or None)
            self.panel.report = None

        ghost = "Type a command, or  k_rep 0.5 · robots 12 · map office · speed 4"
        self.dialogs.ask(palette(self.commands, ghost, told))

    def _open_file(self) -> None:
        viewer, title, endings = self.viewer, "Open a session or a map", (SUFFIX, ".json")
        recent = [path for name in viewer.recent if (path := Path(name)).exists()]
        self.dialogs.ask(file_choice(title, viewer.folder, viewer.open_file, endings=endings, recent=recent))

    def _list_branches(self) -> None:
        viewer, session = self.viewer, self.viewer.session
        session.timeline.cache_present()  # the curve of the present with those of the others

        def lines() -> Iterator[Option]:
            for k, each in enumerate(session.timeline.document.list_branches(), 1):
                text = f"{k}  {each.description}" + ("  (here)" if each.node is session.timeline.head else "")
                yield Option(text, each.describe_end(session.timeline.scenario.dt), value=each.node.number)

        self.dialogs.ask(list_choice("Branches", lines, lambda option: viewer.enter(int(str(option.value)))))

    def offer_lesson(self) -> None:
        session = self.viewer.session
        playing, session.playback.is_playing = session.playback.is_playing, False

        def go_on(*, lesson: bool = False) -> None:
            session.playback.is_playing = playing
            if lesson:
                self._start_tour()

        words = (
            "A team of robots spreads over a map that it does not know. The lesson shows what holds it back "
            "and what helps, in a few minutes; it is also there later, by F2."
        )
        answers = [Answer("Lesson 1", partial(go_on, lesson=True)), Answer("Just let me play", go_on)]
        self.dialogs.ask(Question("Welcome to robocov", words, answers, go_on))

    def offer_recovery(self, found: Sequence[Draft]) -> None:
        """Ask whether to go on with what windows left behind, the newest first; until then the team waits."""
        viewer, session, newest = self.viewer, self.viewer.session, found[0]
        playing, session.playback.is_playing = session.playback.is_playing, False

        def later() -> None:
            session.playback.is_playing = playing

        def recover() -> None:
            later()
            viewer.attempt(lambda: viewer.recover(newest))

        def drop() -> None:
            remove_draft(newest.folder)
            later()
            if found[1:]:
                self.offer_recovery(found[1:])

        words = f"A window ended without saving: {describe_draft(newest)}."
        if more := len(found) - 1:
            words += f"\n{more} more {'are' if more > 1 else 'is'} kept besides."
        answers = [Answer("Recover", recover, "r"), Answer("Discard", drop, "d"), Answer("Later", later, "l")]
        self.dialogs.ask(Question("Recover unsaved work?", words, answers, later))

    def _toggle_help(self) -> None:
        self.help = not self.help

    def _quit(self) -> None:
        self.closed = True

    def _start_tour(self) -> None:
        if self.tour is None:
            self.start_lesson()
        elif self.tour.state == "left":
            self.tour.skip(0)
        else:
            self.tour.leave(task=True)

    def start_lesson(self, path: Path | None = None) -> None:
        """Play a lesson of a file, or the first; MapError as `load_lesson`."""
        lesson = load_lesson(path or FIRST)
        self.tour = LessonPlayer(self.viewer, self.canvas.fit, lesson, alone=self._patient)

    @property
    def _lesson(self) -> LessonPlayer | None:
        """The lesson, where it has the place of the panel."""
        return self.tour if self.tour is not None and self.tour.state != "left" else None

    def _spot(self, at: tuple[int, int]) -> Callable[[], object] | None:
        return next((do for box, do in self._spots if box.collidepoint(at)), None)

    def leave_lesson(self) -> None:
        if self.tour is not None:
            self.tour.leave()

    def _save_run(self) -> str:
        return self.keeper.save(self.viewer.session, self.viewer.folder, self.viewer.map_name)

    def toggle_film(self) -> str:
        if self.film is None:
            target = find_free_path(self.viewer.folder, "robocov", ".mp4")
            self.film = Film(target, self.screen.get_size(), patient=self._patient)
            self.viewer.filming = True
            return f"recording {target}; F9 ends it"
        film, self.film, self.viewer.filming = self.film, None, False
        film.close()
        left_out = f", {film.left_out} frames left out" if film.left_out else ""
        return f"film saved: {film.path} ({film.frames / FILM_FPS:.1f} s{left_out})"

    def take(self, event: pygame.event.Event) -> None:
        if event.type == pygame.KEYUP:
            self.commands.release(event)
        elif event.type == pygame.WINDOWFOCUSLOST:
            self.commands.forget_keys()
        if event.type == pygame.QUIT:
            self.closed = True
        elif self.dialogs.take(event):
            return
        elif event.type == pygame.DROPFILE:
            self.viewer.attempt(lambda: self.viewer.open_file(Path(event.file)))
        elif event.type == pygame.KEYDOWN:
            if self.tour is not None and self.tour.state == "asks" and event.unicode in tuple("1234"):
                self.tour.reply(int(event.unicode))
            elif not self.panel.take(event):  # a key is for a field first, else for a command
                if (command := self.commands.of_key(event)) is not None:
                    self.do(command.name)
                # the key's letter is still to come, and not meant for the palette
                self.dialogs.swallow(event.unicode)
        elif event.type == pygame.MOUSEBUTTONDOWN and self.help:
            self.help = False
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1 and (spot := self._spot(event.pos)):
            spot()
        elif event.type in OF_THE_MOUSE:
            self.pointer.take(event, self._now)
        elif event.type == pygame.WINDOWLEAVE:
            self.viewer.cursor = self.chart.hover = None
        else:
            self.panel.take(event)
