"""The editor's window and its mouse: events in, frames out. What happens between is the editor's."""

from collections.abc import Callable
from math import dist
from pathlib import Path
from time import monotonic

import pygame

from robocov_app.editor.canvas.canvas import REACH, EditorCanvas
from robocov_app.editor.model.geometry import point_words
from robocov_app.editor.model.hit_test import owners_at
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.tools.snapping import Snap
from robocov_app.editor.tools.tool import PointerEvent
from robocov_app.editor.ui.commands import GHOST, GROUPS, editor_commands, offered, typed_commands
from robocov_app.editor.ui.editor import Editor, Team, TeamThread
from robocov_app.editor.ui.file_commands import FileCommands
from robocov_app.editor.ui.import_dialog import ImportDialog
from robocov_app.editor.ui.panel import TABS, Panel
from robocov_app.editor.ui.play_mode import PlayWindow, begun, brought_back
from robocov_app.render.theme import theme_named
from robocov_app.toolkit.command import Commands, Menu, draw_keys, palette
from robocov_app.toolkit.display import set_title
from robocov_app.toolkit.input import DOUBLE, OF_THE_MOUSE, SLIP, WHEEL, key_of, show_cursor, wheel_notches
from robocov_app.toolkit.layout import laid_out
from robocov_app.toolkit.overlay import draw_message, draw_status
from robocov_app.toolkit.window import BaseWindow

_SHAPES = {"arrow": pygame.SYSTEM_CURSOR_ARROW, "cross": pygame.SYSTEM_CURSOR_CROSSHAIR}
_SHAPES |= {"hand": pygame.SYSTEM_CURSOR_HAND, "move": pygame.SYSTEM_CURSOR_SIZEALL}
_SHAPES |= {"sideways": pygame.SYSTEM_CURSOR_SIZEWE, "updown": pygame.SYSTEM_CURSOR_SIZENS}
_SHAPES |= {"rising": pygame.SYSTEM_CURSOR_SIZENESW, "falling": pygame.SYSTEM_CURSOR_SIZENWSE}


def facts(editor: Editor, frames: float, team: Team | None) -> list[str]:
    sketch, idle, owner = editor.sketch, editor.tool is editor.selector, editor.selector.hovered
    item = sketch.item(owner) if idle and isinstance(owner, int) and owner in sketch.places else None
    standing = team if "robots" in editor.shown else None
    grid = f"grid {editor.grid:g} m" if "grid" in editor.snaps else "grid off"
    said = (
        point_words(editor.cursor) if editor.cursor is not None else "",
        "" if idle else f"{editor.tool.title}: {editor.tool.hint}",
        f"{item.shape.name or 'note'}: {item.note}" if item is not None and item.note else "",
        editor.selection.words(sketch) if idle and editor.selection else "",
        standing and (standing.words or f"{len(standing.places)} robots at {standing.start or 'anywhere'}"),
        editor.tool.hint if idle and not editor.selection else "",
        grid if editor.snaps else "no snapping",
        "measuring …" if editor.readings.busy else "",
        f"{frames:.0f} fps",
    )
    return [each for each in said if each]


# what numbers are typed with, and what may follow in one
_OF_NUMBERS, _UNITS = frozenset("0123456789.,-+@<*/%°×x; "), frozenset("mcm'\"rad")
_DRAFT_PAUSE_S = 1.0  # between two drafts of a map that is tried
_HINT = "Wheel: zoom · right button: pan, or menu · Alt-drag: copy · Ctrl: no snapping · F1 or Esc closes"


class EditorWindow(BaseWindow):
    """Shows the editor and lets it be touched."""

    def __init__(
        self, editor: Editor, size: tuple[int, int], scale: float, drafts: Path | None, patient: bool = False
    ) -> None:
        super().__init__(size)
        self.editor, self.scale = editor, scale
        self.help = False
        self.trial: PlayWindow | None = None
        self.canvas = EditorCanvas(editor)
        self.documents = FileCommands(editor, drafts, self.canvas.fit, patient=patient)
        self.dialogs = editor.dialogs
        of_window: dict[str, Callable[[], object]] = {
            "try": self.try_it,
            "screenshot": lambda: self.save_screenshot(editor.folder),
            "name": self._name,
            "menu": lambda: self.open_menu(self.at),
            "pan:hold": lambda: setattr(self, "held", True),
            "tab": lambda: self.panel.show_tab(TABS[(TABS.index(self.panel.tab) + 1) % len(TABS)]),
            "fullscreen": self.toggle_fullscreen,
            "help": lambda: setattr(self, "help", not self.help),
            "palette": lambda: self.dialogs.ask(palette(self.commands, GHOST, editor.say)),
        }
        listed = editor_commands(editor, self.canvas, self.documents, of_window)
        self.commands = Commands(listed, self._attempt, lambda: typed_commands(editor))
        self.panel = Panel(editor, self.commands, self.do, lambda: self.canvas.go_to(editor.problem))
        self.at = (0, 0)  # where the mouse is, px
        self.held = False  # whether the left button pans, for as long as a key is held
        self.drag = ""  # what a button that is held down drags: "tool", "pan"
        self._button, self._moved_off = 0, False
        self._pressed_at, self._last_click = (0, 0), (-1.0, (0, 0))
        self.team = TeamThread()
        self._drafted: object = None  # the map that is tried, when its draft was kept
        self._draft_due = 0.0
        self._patient = editor.snapper.patient = patient
        self._arranged: tuple[object, ...] | None = None
        self._arrange()
        self.canvas.fit()
        editor.ask_readings()
        self.draw()

    def save_point(self) -> Callable[[], None]:
        editor = self.editor
        document = editor.document
        take_back_history = document.history.save_point()

        def take_back() -> None:
            self.drag, self._button = "", 0
            editor.typed = ""
            if editor.document is document:
                take_back_history()
            try:
                editor.tool.cancel(editor)
            except Exception:
                editor.tool = editor.selector  # which forgets what it was doing when it is chosen next
                raise
            finally:
                editor.version += 1
                document.keep()

        return take_back

    def report_fault(self, message: str, *, in_drawing: bool) -> None:
        editor = self.editor
        if in_drawing:
            self.help = False
            editor.dialogs.drop()
            editor.problem = None
            self.canvas.fit()
        editor.say(message, trouble=True)
        editor.version += 1

    def close(self) -> None:
        if self.trial is not None:
            self._keep_draft_of(self.trial, at_once=True)
            self.trial.close()
        self.team.close()
        self.dialogs.close()
        self.editor.snapper.close()

    def look(self) -> object:
        editor, canvas, ui = self.editor, self.canvas, self.panel.ui
        importing = isinstance(editor.dialogs.asked, ImportDialog) and editor.dialogs.asked.busy
        if ui.stale or editor.moves_since is not None or importing:
            return None
        return (
            *(editor.version, editor.message, editor.trouble, editor.typed, editor.readings.busy),
            *(editor.problem, editor.sketch, editor.selection, editor.measurement, editor.tool),
            *(editor.cursor, frozenset(editor.shown), editor.grid, frozenset(editor.snaps)),
            *(canvas.team, canvas.camera, canvas.hovered, self.help, id(editor.dialogs.asked)),
            *(self._arranged, pygame.display.get_caption()),
        )

    def suit(self, scale: float, theme: str, *, panel: bool | None) -> None:
        editor, self.scale = self.editor, scale
        editor.theme, editor.panel = theme, editor.panel if panel is None else panel
        editor.version += 1
        if self.trial is not None:
            self.trial.suit(scale, theme, panel=panel)

    def update(self, seconds: float) -> None:
        if self.trial is not None:
            self._play(self.trial, seconds)
            return
        editor = self.editor
        if self.documents.leaving:
            self.closed = True
            return
        editor.pass_time(seconds)
        if not self.drag:
            self.documents.look()
            if "robots" in editor.shown:
                wanted = editor.start_name, editor.robots, editor.seed, editor.radius
                if (team := self.team.ask(editor.sketch, *wanted)) is not None:
                    self.canvas.team = team
                    editor.say(team.words, trouble=True)
        if not (self.drag and editor.readings.busy):
            editor.ask_readings()
        editor.say(editor.document.autosaver.trouble, trouble=True)
        if self.documents.leaving:
            self.closed = True
            return
        self._arrange()
        self.panel.covered = self.dialogs.open
        self.panel.update()
        shape = "arrow"
        if self.canvas.over(self.at):
            panned = self.drag == "pan" or self.held
            shape = "hand" if self.canvas.hovered else editor.tool.shape_of_cursor(editor)
            shape = "move" if panned else shape
        show_cursor(_SHAPES[shape])
        mark = "● " if editor.document.history.unsaved else ""
        set_title(f"{mark}{editor.document.title} · robocov edit")

    def _arrange(self) -> None:
        editor = self.editor
        key = (self.screen.get_size(), self.scale, editor.panel, editor.theme)
        if key == self._arranged:
            return
        self._arranged, self.theme = key, theme_named(editor.theme)
        self.layout = laid_out(key[0], self.scale, 1, 1.0, panel=editor.panel, plot=False)
        self.canvas.arrange(self.layout, self.theme)
        self.panel.arrange(self.layout, self.theme)

    def draw(self) -> None:
        layout, theme, editor = self.layout, self.theme, self.editor
        self.canvas.draw(self.screen)
        told = facts(editor, self.rate, self.canvas.team)
        draw_status(self.screen, layout.status, theme, layout.scale, told, "F5 try it · F1 keys")
        if layout.panel[2]:
            self.panel.draw(self.screen)
        draw_message(self.screen, editor.message, layout.arena, theme, layout.scale, editor.trouble)
        if self.help:
            draw_keys(self.screen, theme, layout.scale, self.commands.listed, GROUPS, _HINT)
        self.dialogs.draw(self.screen, theme, layout.scale)
        self.show_screen()

    def do(self, name: str) -> None:
        if name == "cancel" and self.help:
            self.help = False
        else:
            self.commands.do(name)

    def _attempt(self, action: Callable[[], object]) -> None:
        editor, problem = self.editor, self.editor.problem
        editor.attempt(action)
        if editor.problem is not problem:
            self.canvas.go_to(editor.problem)

    def _name(self) -> None:
        field, tab = ("name", "object") if len(self.editor.selection.owners) == 1 else ("title", "map")
        self.editor.panel = True
        self._arrange()
        self.panel.show_tab(tab)
        self.panel.ui.run(None, None)
        self.panel.ui.set_focus(field)

    def open_menu(self, pixel: tuple[int, int]) -> None:
        editor = self.editor
        if self.canvas.over(pixel):
            there = owners_at(editor.sketch, self.canvas.to_world(pixel), 0.5 * REACH * editor.pixel)
            if not (editor.selection.vertices or any(each in editor.selection.owners for each in there)):
                editor.select(Selection.of(*there[:1]))
        found = [self.commands[name] if name else None for name in offered(editor)]
        self.dialogs.ask(Menu(found, pixel, self.do))

    def try_it(self) -> None:
        if self.editor.selector.busy:  # the mouse lets go of what it drags; what is half drawn stays
            self.editor.selector.cancel(self.editor)
        trial = begun(self.editor, self.screen, self.scale, patient=self._patient)
        trial.windowed = self.windowed
        self.trial = self.inner = trial

    def _play(self, trial: PlayWindow, seconds: float) -> None:
        trial.screen, trial.rate = self.screen, self.rate
        if not (trial.ended or trial.closed):
            trial.update(seconds)
        if not (trial.ended or trial.closed):
            self._keep_draft_of(trial)
            return
        trial.close()
        trial.keeper.finish()
        self.trial = self.inner = None
        self.adopt_display()
        self.windowed = trial.windowed
        editor, viewer = self.editor, trial.viewer
        editor.theme = viewer.theme
        change = brought_back(editor.sketch, viewer.tried, viewer.session.environment)
        if change is not None and not viewer.elsewhere:
            editor.change(change)
        self._drafted = None
        editor.document.keep()
        held = pygame.key.get_pressed()[pygame.K_F5]  # its repeated presses would begin anew
        self.commands.forget_keys(*([pygame.K_F5] if held else ()))
        self._arrange()
        editor.version += 1
        if trial.ended:
            self.draw()
        else:
            self.do("quit")

    def _keep_draft_of(self, trial: PlayWindow, *, at_once: bool = False) -> None:
        """Keep a draft of the map with what is changed while it is tried, about once a second."""
        viewer, document = trial.viewer, self.editor.document
        environment = viewer.session.environment
        now = monotonic()
        if environment is self._drafted or viewer.elsewhere or (now < self._draft_due and not at_once):
            return
        is_unchanged = self._drafted is None and environment is viewer.tried
        self._drafted = environment
        if is_unchanged:
            return
        self._draft_due = now + _DRAFT_PAUSE_S
        change = brought_back(self.editor.sketch, viewer.tried, environment)
        if change is None:
            document.keep()
        else:
            document.keep_draft(change.sketch)

    def take(self, event: pygame.event.Event) -> None:
        kind = event.type
        if kind == pygame.KEYUP:
            self.commands.release(event)
            self.held = self.held and event.key != pygame.K_SPACE
        elif kind == pygame.WINDOWFOCUSLOST:
            self.commands.forget_keys()
            self.held = False
        elif kind == pygame.KEYDOWN and event.key == pygame.K_F12:
            self.do("screenshot")
            return
        if kind in OF_THE_MOUSE and kind != pygame.MOUSEWHEEL:
            self.at = event.pos
        if kind == pygame.QUIT:
            if isinstance(self.editor.dialogs.asked, ImportDialog | Menu):
                self.dialogs.close()
            if not self.dialogs.open:
                self.do("quit")
        elif self.dialogs.take(event):
            return
        elif kind == pygame.DROPFILE:
            self.editor.attempt(lambda: self.documents.open(Path(event.file)))
        elif kind == pygame.KEYDOWN:
            # a key is for a field, for a number while something is drawn, else for a command
            taken = self.panel.take(event) or (not self.panel.ui.busy and self._number(event))
            if not taken and (command := self.commands.of_key(event)) is not None:
                self.do(command.name)
            if self.trial is not None:
                self.trial.held = event.key
            self.dialogs.swallow(event.unicode)
        elif kind == pygame.MOUSEBUTTONDOWN and self.help:
            self.help = False
        elif kind in OF_THE_MOUSE:
            self._mouse(event)
        elif kind == pygame.WINDOWLEAVE:
            self.editor.cursor = self.canvas.at = self.canvas.hovered = None
        else:
            self.panel.take(event)

    def _mouse(self, event: pygame.event.Event) -> None:
        taken = not self.drag and self.panel.take(event)
        if event.type == pygame.MOUSEMOTION:
            self._moved(event)
        elif event.type == pygame.MOUSEBUTTONUP:
            self._released(event)
        elif taken:
            self.editor.cursor = None
        elif event.type == pygame.MOUSEBUTTONDOWN:
            self.panel.ui.stop_typing()
            self._pressed(event)
        elif self.canvas.over(self.at):
            self.canvas.zoom(WHEEL ** wheel_notches(event), self.at)

    def _aim(self, pixel: tuple[int, int]) -> PointerEvent:
        raw, reach = self.canvas.to_world(pixel), REACH * self.editor.pixel
        editor, tool, held, point = self.editor, self.editor.tool, pygame.key.get_mods(), raw
        ctrl = bool(held & (pygame.KMOD_CTRL | pygame.KMOD_META))
        if tool.snaps:
            free = ctrl or not editor.snaps
            snap = Snap(raw) if free else editor.snapped(raw, reach, tool.origin, tool.drawn)
            point, tool.guides = snap.point, snap.guides
        shift, alt = bool(held & pygame.KMOD_SHIFT), bool(held & pygame.KMOD_ALT)
        return PointerEvent(point, raw, reach, shift, alt, ctrl)

    def _pressed(self, event: pygame.event.Event) -> None:
        editor = self.editor
        if self.drag or not self.canvas.over(event.pos) or event.button not in (1, 2, 3):
            return
        self._pressed_at, self._button, self._moved_off = event.pos, event.button, False
        if event.button != 1 or editor.tool.name == "pan" or self.held:
            self.drag = "pan"
            return
        if (problem := self.canvas.problem_at(event.pos)) is not None and not editor.tool.busy:
            editor.problem = None if editor.problem is problem else problem
            editor.say(problem.words, trouble=problem.grave)
            editor.version += 1
            return
        (then, where), now = self._last_click, editor.now
        double = now - then < DOUBLE and dist(where, event.pos) < SLIP * self.canvas.layout.scale
        self._last_click = (-1.0 if double else now), event.pos
        self.drag = "tool"
        aim = self._aim(event.pos)
        act = editor.tool.twice if double else editor.tool.press
        editor.attempt(lambda: act(editor, aim))

    def _moved(self, event: pygame.event.Event) -> None:
        editor, canvas = self.editor, self.canvas
        over = canvas.over(event.pos)
        aimed = over or self.drag == "tool"
        editor.cursor = canvas.to_world(event.pos) if aimed else None
        canvas.at = (float(event.pos[0]), float(event.pos[1])) if aimed else None
        canvas.hovered = canvas.problem_at(event.pos) if over and not self.drag else None
        far = dist(event.pos, self._pressed_at) >= SLIP * canvas.layout.scale
        self._moved_off = self._moved_off or (bool(self.drag) and far)
        if self.drag == "pan":
            if self._moved_off:
                canvas.pan(*event.rel)
        elif aimed:
            aim, version = self._aim(event.pos), editor.version
            editor.attempt(lambda: editor.tool.move(editor, aim))
            editor.version = version  # the panel need not look again at every move of the mouse
        else:
            editor.tool.guides = ()

    def _released(self, event: pygame.event.Event) -> None:
        editor, drag = self.editor, self.drag
        if event.button != self._button or not drag:
            return
        self.drag, self._button = "", 0
        if drag == "tool":
            aim = self._aim(event.pos)
            editor.attempt(lambda: editor.tool.release(editor, aim, clicked=not self._moved_off))
            editor.document.history.broken = True
        elif event.button == 3 and not self._moved_off:
            if editor.tool.busy:
                editor.attempt(lambda: editor.tool.finish(editor))
            else:
                self.open_menu(event.pos)

    def _number(self, event: pygame.event.Event) -> bool:
        editor, tool, name, sign = self.editor, self.editor.tool, key_of(event), event.unicode
        text, modifiers = editor.typed, pygame.KMOD_CTRL | pygame.KMOD_META | pygame.KMOD_ALT
        if not (tool.takes_numbers and (tool.busy or tool.begins_typed or text)) or event.mod & modifiers:
            return False
        begins = sign in _OF_NUMBERS and sign not in ("x×*/ ;%" if tool.busy else "x×*/ ;%,-+@<°")
        if text and name in ("return", "enter"):
            editor.typed = ""
            editor.attempt(lambda: tool.enter(editor, text))
        elif text and name in ("backspace", "tab"):
            editor.typed = text[:-1] if name == "backspace" else f"{text} "
        elif len(sign) == 1 and (begins or (text and (sign in _OF_NUMBERS or sign in _UNITS))):
            editor.typed = (text + sign)[:40]
        else:
            return False
        return True
