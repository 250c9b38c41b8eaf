"""The editor's window: events in, frames out. What happens between is the desk's."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

import pygame

from robocov.files.atomic import written
from robocov_app.editor.canvas.arena import Arena
from robocov_app.editor.model.hit_test import owners_at
from robocov_app.editor.model.selection import Selection
from robocov_app.editor.ui.commands import GROUPS, all_commands, offered, told_commands
from robocov_app.editor.ui.dialogs import Commands, Dialogs, Menu
from robocov_app.editor.ui.file_commands import FileCommands
from robocov_app.editor.ui.importing import ImportQuestion
from robocov_app.editor.ui.keyboard import Keyboard
from robocov_app.editor.ui.panel import TABS, Panel
from robocov_app.editor.ui.play_mode import PlayWindow, begun, brought_back
from robocov_app.editor.ui.pointer import Pointer
from robocov_app.editor.ui.status import HINT, facts
from robocov_app.editor.ui.team import TeamThread
from robocov_app.render.theme import theme_named
from robocov_app.runs.recording import png_bytes
from robocov_app.terminal.output import free_name
from robocov_app.toolkit.input import OF_THE_MOUSE
from robocov_app.viewer.film import pixels
from robocov_app.viewer.layout import inside, laid_out
from robocov_app.viewer.overlays import draw_keys, draw_message
from robocov_app.viewer.screen import shown, undisturbed
from robocov_app.viewer.status import draw_status
from robocov_app.viewer.window import FPS

if TYPE_CHECKING:
    from collections.abc import Callable

    from robocov.environment import Environment
    from robocov_app.editor.ui.editor import Editor

_SELDOM = 0.1
"""Seconds after which the panel looks at its widgets also while nobody is near."""

_CALM = 0.5
"""Seconds without anything new after which the window waits for events."""

_PAN = 60
"""Pixels that a key pans."""

_CAPTION = "robocov edit"

_HINT = "Wheel: zoom · right button: pan, or menu · Alt-drag: copy · Ctrl: no snapping · F1 or Esc closes"


class EditorWindow:
    """Shows a desk and lets it be touched."""

    def __init__(
        self, desk: Editor, size: tuple[int, int], scale: float, drafts: Path | None, *, patient: bool = False
    ) -> None:
        self.desk, self.scale = desk, scale
        self.closed = False
        self.help = False
        self.trial: PlayWindow | None = None
        self.windowed: tuple[int, int] | None = None
        self.screen = shown(size)
        self.arena = Arena(desk)
        self.documents = FileCommands(desk, drafts, self.arena.fit, patient=patient)
        self.panel = Panel(desk, self.do)
        self.palette = Commands()
        self.dialogs = Dialogs(desk)
        self.menu: Menu | None = None
        self.pointer = Pointer(desk, self.arena, self.panel, self.open_menu)
        self.keyboard = Keyboard(desk, self.panel, self.palette, self.dialogs, self.do)
        self.team = TeamThread()
        self._patient = desk.snapper.patient = patient
        of_desk = {each.name: partial(each.run, desk) for each in all_commands() if each.run is not None}
        self._own: dict[str, Callable[[], object]] = {
            **of_desk,
            **self.documents.commands(),
            **self._what_to_do(),
        }
        self._arranged: tuple[object, ...] | None = None
        self._tried: Environment | None = None
        self._caption = ""
        self._rate = float(FPS)
        self._unseen = self._calm = 0.0
        self._come: list[pygame.event.Event] = []
        self._touched = False
        self._drawn: tuple[object, ...] | None = None
        self._arrange()
        self.arena.fit()
        desk.ask_readings()
        self.draw()

    # frames

    def run(self) -> None:
        """Go on until the window is closed."""
        clock = pygame.time.Clock()
        before = perf_counter()
        with undisturbed():
            while not self.closed:
                now = perf_counter()
                self.frame(now - before)
                before = now
                if self._calm < _CALM or self.trial is not None:
                    clock.tick(FPS)
                elif (event := pygame.event.wait(round(1000 * _SELDOM))).type != pygame.NOEVENT:
                    self._come.append(event)

    def close(self) -> None:
        """End what is going on beside the window."""
        if self.trial is not None:
            self.trial.close()
        self.team.close()
        self.documents.close()
        self.desk.snapper.close()

    def frame(self, seconds: float) -> None:
        """Take what has happened, let so many seconds pass, and draw."""
        if self.trial is not None:
            self._try_on(seconds)
            return
        self.advance(seconds)
        if self.closed or self.trial is not None:
            return
        shown = self._what_is_shown()
        self._calm = self._calm + seconds if shown is not None and shown == self._drawn else 0.0
        if self._calm == 0.0:
            self.draw()
        self._drawn = shown

    def _what_is_shown(self) -> tuple[object, ...] | None:
        """Return all on which it depends what the window looks like; None where it always changes."""
        desk, arena = self.desk, self.arena
        animated = self._touched or self.panel.busy or desk.moves_since is not None or desk.asked is not None
        if animated or inside(self.layout.panel, self.pointer.at):
            return None
        return (
            *(desk.version, desk.message, desk.trouble, desk.typed, desk.readings.busy, desk.problem),
            *(desk.sketch, desk.selection, desk.measurement, desk.tool, desk.cursor, frozenset(desk.shown)),
            *(arena.team, arena.camera, arena.hovered, self.help, self.palette.open, self.menu),
            *(self._arranged, self._caption, desk.grid, frozenset(desk.snaps)),
        )

    def advance(self, seconds: float) -> None:
        """Take what has happened, and let so many seconds pass."""
        come, self._come = [*self._come, *pygame.event.get()], []
        self._touched = bool(come)
        for event in come:
            if self.trial is None:
                self.take(event)
            else:  # what came while it was opened
                self.trial.take(event)
        if self.trial is not None:
            return
        if seconds > 0 and self._calm < _CALM:
            self._rate += 0.05 * (min(1.0 / seconds, 1000.0) - self._rate)
        desk = self.desk
        desk.pass_time(seconds)
        if not self.pointer.dragging:
            self.documents.look()
            self._ask_team()
        if not (self.pointer.dragging and desk.readings.busy):
            desk.ask_readings()
        if desk.document.trouble:
            desk.say(desk.document.trouble, trouble=True)
        if self.documents.leaving:
            self.closed = True
            return
        self._arrange()
        self._update_panel(seconds)
        self.pointer.show()
        caption = f"{'● ' if desk.document.unsaved else ''}{desk.document.title} · {_CAPTION}"
        if caption != self._caption:
            self._caption = caption
            pygame.display.set_caption(caption)

    def _ask_team(self) -> None:
        desk = self.desk
        if "robots" in desk.shown:
            self.team.ask(desk.sketch, desk.start_name, desk.robots, desk.seed, desk.radius)
            answer = self.team.poll()
            if answer is not None:
                self.arena.team = answer
                if answer.words:
                    desk.say(answer.words, trouble=True)

    def _arrange(self) -> None:
        """Lay the window out anew when its size or look is another."""
        desk = self.desk
        key = (self.screen.get_size(), self.scale, desk.panel, desk.theme)
        if key == self._arranged:
            return
        self._arranged = key
        self.theme = theme_named(desk.theme)
        self.layout = laid_out(key[0], self.scale, 1, 1.0, panel=desk.panel, plot=False)
        self.arena.arrange(self.layout, self.theme)
        self.panel.arrange(self.layout, self.theme)

    def _update_panel(self, seconds: float) -> None:
        """Let the panel live; seldom while nobody is near it, since it looks at all of its widgets."""
        self._unseen += seconds
        self.panel.covered = self.dialogs.open or self.menu is not None
        near = inside(self.layout.panel, self.pointer.at) or self.panel.busy
        if near or self._unseen >= _SELDOM:
            self.panel.update(self._unseen)
            self._unseen = 0.0

    def draw(self) -> None:
        """Draw everything, and show it."""
        layout, theme, desk = self.layout, self.theme, self.desk
        self.arena.draw(self.screen)
        draw_status(self.screen, layout, theme, facts(desk, self._rate, self.arena.team), HINT)
        if layout.panel[2]:
            self.panel.fill(self.screen)
            self.panel.draw_list(self.screen, theme)
            self.panel.draw(self.screen)
        draw_message(self.screen, desk, layout, theme)
        if self.menu is not None:
            self.menu.draw(self.screen, theme, layout.scale)
        if self.help:
            draw_keys(self.screen, layout, theme, told_commands(), GROUPS, _HINT)
        elif self.palette.open:
            self.palette.draw(self.screen, layout, theme)
        self.dialogs.draw(self.screen, layout, theme)
        pygame.display.flip()

    # doing

    def do(self, name: str) -> None:
        """Do the action of this name."""
        desk = self.desk
        kind, _, what = name.partition(":")
        self.menu = None
        if name == "cancel" and (self.help or self.palette.open):
            self.help = self.palette.open = False
        elif kind == "tool":
            desk.attempt(lambda: desk.choose(what))
        elif kind == "type":
            self.palette.show(f"{what} ")
        elif kind in ("show", "snap"):
            desk.attempt(lambda: desk.switch(kind, what))
        else:
            problem = desk.problem
            desk.attempt(self._own[name])
            if desk.problem is not None and desk.problem is not problem:
                self.arena.go_to(desk.problem)

    def _what_to_do(self) -> dict[str, Callable[[], object]]:
        return {
            "fit": self.arena.fit,
            "fit:selection": self.arena.fit_selection,
            "zoom:in": lambda: self.arena.zoom(1.25, self._middle()),
            "zoom:out": lambda: self.arena.zoom(0.8, self._middle()),
            "pan:left": lambda: self.arena.pan(_PAN, 0),
            "pan:right": lambda: self.arena.pan(-_PAN, 0),
            "pan:up": lambda: self.arena.pan(0, _PAN),
            "pan:down": lambda: self.arena.pan(0, -_PAN),
            "pan:hold": lambda: setattr(self.pointer, "held", True),
            "theme": self._switch_theme,
            "panel": self._switch_panel,
            "tab": self._next_tab,
            "name": self._name,
            "menu": lambda: self.open_menu(self.pointer.at),
            "fullscreen": self._fullscreen,
            "screenshot": self.screenshot,
            "help": self._toggle_help,
            "palette": self.palette.show,
            "try": self.try_it,
        }

    def _middle(self) -> tuple[float, float]:
        if self.arena.over(self.pointer.at):
            return self.pointer.at
        left, top, width, height = self.arena.camera.view
        return left + width / 2, top + height / 2

    def _switch_theme(self) -> None:
        self.desk.theme = "dark" if self.desk.theme == "light" else "light"

    def _switch_panel(self) -> None:
        self.desk.panel = not self.desk.panel

    def _next_tab(self) -> None:
        self.panel.show_tab(TABS[(TABS.index(self.panel.tab) + 1) % len(TABS)])

    def _name(self) -> None:
        """Go to the field with the name of what is selected, or of the map."""
        field, tab = ("name", "object") if len(self.desk.selection.owners) == 1 else ("title", "map")
        self.desk.panel = True
        self._arrange()
        self.panel.show_tab(tab)
        self.panel.focus(field)

    def _fullscreen(self) -> None:
        windowed, self.windowed = self.windowed, None if self.windowed else self.screen.get_size()
        self.screen = shown(windowed) if windowed else pygame.display.set_mode((0, 0), pygame.FULLSCREEN)

    def _toggle_help(self) -> None:
        self.help = not self.help

    def screenshot(self) -> str:
        """Save what is in the window as a PNG."""
        target = free_name(self.desk.folder, "robocov", ".png")
        with written(target) as part:
            part.write_bytes(png_bytes(pixels(self.screen)))
        return f"screenshot saved: {target}"

    def open_menu(self, pixel: tuple[int, int]) -> None:
        """Open the menu for what is at a pixel; what is not selected yet is selected then."""
        desk = self.desk
        if self.arena.over(pixel):
            found = owners_at(desk.sketch, self.arena.to_world(pixel), 0.5 * self.arena.reach)
            near = desk.selection.vertices or any(each in desk.selection.owners for each in found)
            if not near:
                desk.select(Selection.of(*found[:1]))
        known = {command.name: command for command in all_commands()}
        self.menu = Menu([known.get(name) for name in offered(desk)], pixel)

    # trying

    def try_it(self) -> None:
        """Begin the demo on the map."""
        if self.desk.selector.busy:  # the mouse lets go of what it drags; what is half drawn stays
            self.desk.selector.cancel(self.desk)
        trial = begun(self.desk, self.screen, self.scale, patient=self._patient)
        self._tried = trial.desk.session.environment
        trial.windowed = self.windowed
        self.trial = trial

    def _try_on(self, seconds: float) -> None:
        trial = self.trial
        assert trial is not None
        trial.frame(seconds)
        if not (trial.ended or trial.closed):
            return
        leaving = trial.closed and not trial.ended
        trial.close()
        trial.keeper.finish()
        self.trial = None
        self.screen = pygame.display.get_surface() or self.screen
        self.windowed = trial.windowed
        desk = self.desk
        desk.theme = trial.desk.theme
        assert self._tried is not None
        change = brought_back(desk.sketch, self._tried, trial.desk.session.environment)
        if change is not None and not trial.desk.elsewhere:
            desk.change(change)
        self.keyboard.leave()
        if pygame.key.get_pressed()[pygame.K_F5]:  # its repeated presses would begin anew
            self.keyboard.hold(pygame.K_F5)
        self._arrange()
        desk.version += 1
        if leaving:
            self.do("quit")
        else:
            self.draw()

    # events

    def take(self, event: pygame.event.Event) -> None:
        """Take one event."""
        if event.type == pygame.QUIT:
            if isinstance(self.desk.asked, ImportQuestion):
                self.dialogs.key("escape")
            if not self.dialogs.open:
                self.do("quit")
        elif event.type == pygame.DROPFILE:
            if not self.dialogs.open and self.trial is None:
                self.desk.attempt(lambda: self.documents.open(Path(event.file)))
        elif event.type in (pygame.VIDEORESIZE, pygame.WINDOWSIZECHANGED):
            self.screen = pygame.display.get_surface() or self.screen
        elif event.type == pygame.KEYDOWN and self.menu is not None:
            self._key_of_menu(event)
        elif event.type == pygame.KEYDOWN:
            self.keyboard.press(event)
            if self.trial is not None:
                self.trial.held = event.key
        elif event.type == pygame.TEXTINPUT and self.dialogs.open:
            self.dialogs.letters(event.text)
        elif event.type == pygame.TEXTINPUT and self.palette.open:
            self.keyboard.letters(event.text)
        elif event.type in OF_THE_MOUSE:
            self._mouse(event)
        elif event.type == pygame.WINDOWLEAVE:
            self.pointer.leave()
        else:
            if event.type == pygame.KEYUP:
                self.keyboard.release(event)
                if event.key == pygame.K_SPACE:
                    self.pointer.held = False
            elif event.type == pygame.WINDOWFOCUSLOST:
                self.keyboard.leave()
                self.pointer.held = False
            self.panel.take(event)

    def _mouse(self, event: pygame.event.Event) -> None:
        pressed = event.type == pygame.MOUSEBUTTONDOWN
        if self.dialogs.open or self.menu is not None:
            if event.type != pygame.MOUSEWHEEL:
                self.pointer.at = event.pos
            self._mouse_over(event)
        elif pressed and (self.help or self.palette.open):
            self.help = self.palette.open = False
        elif self._over_list() and event.type == pygame.MOUSEWHEEL:
            assert self.panel.list is not None
            self.panel.list.wheel(event.y)
        elif pressed and event.button == 1 and self._over_list(event.pos):
            assert self.panel.list is not None
            self.panel.stop_typing()
            if self.panel.list.click(event.pos) and self.desk.problem is not None:
                self.arena.go_to(self.desk.problem)
        else:
            self.pointer.take(event, self.desk.now)

    def _over_list(self, pixel: tuple[int, int] | None = None) -> bool:
        found = self.panel.list
        at = self.pointer.at if pixel is None else pixel
        if found is None or not self.desk.panel or self.panel.unfolded or self.pointer.dragging:
            return False
        return inside(found.box, at)

    def _mouse_over(self, event: pygame.event.Event) -> None:
        """Let the mouse do to a question or the menu what it does."""
        if self.menu is not None:
            self._after(self.menu.mouse(event, self.layout.scale))
        elif event.type == pygame.MOUSEMOTION:
            self.dialogs.hover(event.pos)
        elif event.type == pygame.MOUSEBUTTONDOWN and event.button == 1:
            self.dialogs.click(event.pos)
        elif event.type == pygame.MOUSEWHEEL:
            self.dialogs.wheel(event.y)

    def _after(self, chosen: str | None) -> None:
        """Do what was chosen in the menu; an empty name only closes it."""
        if chosen is not None:
            self.menu = None
            if chosen:
                self.do(chosen)

    def _key_of_menu(self, event: pygame.event.Event) -> None:
        assert self.menu is not None
        chosen = self.menu.key(event.key)
        self._after(chosen)
        if chosen == "" and event.key != pygame.K_ESCAPE:
            self.keyboard.press(event)
