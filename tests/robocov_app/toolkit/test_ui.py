"""Widgets, dialogs, menus and the palette, used by events without a window."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pygame
import pytest
from driven_window import open_viewer

from robocov.errors import InputError
from robocov_app.look.theme import DARK, LIGHT
from robocov_app.toolkit.commands.command import Argument, Command, CommandTable
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.commands.palette import create_palette
from robocov_app.toolkit.dialogs import Answer, Dialogs, Question, create_file_choice
from robocov_app.toolkit.widgets.ui import Ui

KEYS = {"return": pygame.K_RETURN, "tab": pygame.K_TAB, "escape": pygame.K_ESCAPE, "left": pygame.K_LEFT}
KEYS |= {"up": pygame.K_UP, "down": pygame.K_DOWN, "backspace": pygame.K_BACKSPACE, "space": pygame.K_SPACE}
MODIFIERS = {"ctrl": pygame.KMOD_LCTRL, "shift": pygame.KMOD_LSHIFT}


def build_key_event(name: str) -> pygame.event.Event:
    *modifiers, last = name.split("+")
    mod = sum(MODIFIERS[modifier] for modifier in modifiers)
    return pygame.event.Event(pygame.KEYDOWN, key=KEYS.get(last) or ord(last), mod=mod, unicode="")


def build_text_event(text: str) -> pygame.event.Event:
    return pygame.event.Event(pygame.TEXTINPUT, text=text)


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> Iterator[pygame.Surface]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame.display.init()
    pygame.font.init()
    yield pygame.display.set_mode((320, 300))
    pygame.display.quit()


class EditedPage:
    """A page with one widget of each kind, and the values that they edit."""

    def __init__(self, screen: pygame.Surface) -> None:
        self.screen = screen
        self.value = 0.5
        self.on = False
        self.name = "8"
        self.word = "b"
        self.tab = "one"
        self.pressed = 0
        self.ui = Ui(self.page, LIGHT)
        self.ui.box = screen.get_rect()
        self.draw()

    def page(self, ui: Ui) -> None:
        self.pressed += ui.button("Go", tip="goes")
        self.pressed += ui.button("Stop", disabled_reason="nothing goes")
        self.value = ui.slider("value", self.value, 0.0, 1.0) or self.value
        is_on = ui.check_box("On", value=self.on)
        if is_on is not None:
            self.on = is_on
        self.name = ui.text_field("name", self.name) or self.name
        self.word = ui.dropdown("word", "abcdefghijklmnopqrstuvwxyz", self.word) or self.word
        self.tab = ui.tabs("tab", ["one", "two"], self.tab) or self.tab
        with ui.scroll("more"):
            if ui.section("MORE"):
                for k in range(20):
                    ui.label(f"line {k}")

    def draw(self) -> None:
        self.ui.draw(self.screen)
        self.ui.draw_overlays(self.screen)

    def press(self, kind: str, name: str, at: float = 0.5) -> None:
        found = self.ui.find(kind, name)
        assert found is not None
        self.at(found.rect.left + at * found.rect.width, found.rect.centery)

    def at(self, x: float, y: float) -> None:
        pos = round(x), round(y)
        for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            self.ui.handle_event(pygame.event.Event(kind, pos=pos, button=1))
            self.draw()

    def keys(self, *names: str) -> None:
        for name in names:
            self.ui.handle_event(build_key_event(name))

    def text(self) -> str:
        found = self.ui.find("entry", "name")
        assert found is not None
        return found.text


@pytest.fixture
def page(screen: pygame.Surface) -> EditedPage:
    return EditedPage(screen)


def test_widgets_edit_their_values(page: EditedPage) -> None:
    page.press("button", "Go")
    page.press("button", "Stop")  # disabled, with the reason as tip
    assert page.pressed == 1
    assert page.ui.widgets["button:Stop"].tip == "Nothing goes"
    page.press("slider", "value", 0.9)
    assert 0.85 < page.value < 0.95
    page.press("check", "On")
    page.press("button", "tab:two")
    assert page.on
    assert page.tab == "two"


def test_a_text_field_edits_undoes_and_accepts_text(page: EditedPage) -> None:
    page.press("entry", "name")
    page.ui.handle_event(build_text_event("1"))
    page.ui.handle_event(build_text_event("2"))
    assert page.ui.edit
    assert page.name == "8"
    page.keys("ctrl+z")
    page.draw()
    assert page.text() == "8"  # letters that follow each other are undone together
    page.keys("ctrl+y", "ctrl+a", "ctrl+c", "return")
    assert page.name == "12"
    assert not page.ui.edit
    assert page.ui.clipboard.get() == "12"
    page.press("entry", "name")
    page.keys("backspace", "escape")
    page.draw()
    assert page.name == "12"
    assert page.text() == "12"


def test_an_input_method_composes_text(page: EditedPage) -> None:
    page.press("entry", "name")
    page.ui.handle_event(pygame.event.Event(pygame.TEXTEDITING, text="にほ", start=0, length=2))
    page.draw()
    page.keys("return")
    assert page.ui.edit
    assert page.text() == "8"
    page.ui.handle_event(build_text_event("日本"))
    page.keys("return")
    assert page.name == "日本"


def test_an_open_list_covers_the_widgets_below(page: EditedPage) -> None:
    page.press("menu", "word")
    found = page.ui.open_list
    assert found is not None
    item = found.get_item_rect(found.highlighted + 1)
    page.at(*item.center)
    assert page.word == "c"
    assert page.ui.open_list is None
    assert page.tab == "one"
    page.press("menu", "word")
    page.keys("up", "return")
    assert page.word == "b"
    page.press("menu", "word")
    page.press("button", "Go")  # only closes the list
    assert page.pressed == 0
    assert page.ui.open_list is None


def test_tab_moves_the_focus_and_keys_press_widgets(page: EditedPage) -> None:
    assert not page.ui.handle_event(build_key_event("tab")), "no widget has the focus"
    page.press("entry", "name")
    page.keys("shift+tab", "space")
    assert page.on
    assert not page.ui.edit
    page.keys("shift+tab", "left")
    assert page.value < 0.5
    page.keys("shift+tab", "return")
    assert page.pressed == 1
    assert not page.ui.handle_event(build_key_event("x"))
    assert page.ui.handle_event(build_key_event("escape"))
    assert not page.ui.handle_event(build_key_event("space"))


def test_long_content_scrolls_and_folds(page: EditedPage) -> None:
    bar = page.ui.find("bar", "more")
    assert bar is not None
    assert bar.value == 0.0
    page.ui.pointer = (50, 280)
    page.ui.handle_event(pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=-1, precise_y=-1.0))
    page.draw()
    bar = page.ui.find("bar", "more")
    assert bar is not None
    assert bar.value == 40.0
    page.ui.handle_event(pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=1, precise_y=1.0))
    page.draw()
    page.press("section", "section:MORE")
    assert page.ui.find("label", "line 0") is None
    assert page.ui.find("bar", "more") is None


@pytest.mark.parametrize("scale", [1.0, 1.5, 2.25])
def test_an_unchanged_page_is_copied(scale: float, screen: pygame.Surface) -> None:
    page = EditedPage(screen)
    page.ui = Ui(page.page, DARK, scale)
    page.ui.box = screen.get_rect()
    page.draw()
    first = pygame.surfarray.array3d(screen)
    screen.fill("red")
    page.draw()
    assert (pygame.surfarray.array3d(screen) == first).all()


# commands


class RecordedCommands:
    """Commands that record their effects and errors."""

    def __init__(self) -> None:
        self.done: list[object] = []
        self.errors: list[str] = []
        self.commands = CommandTable(
            [
                Command("pause", "Play or pause", "Run", lambda: self.done.append("pause"), ("space",)),
                Command(
                    "undo",
                    "Undo",
                    "Edit",
                    lambda: None,
                    ("ctrl+z",),
                    get_disabled_reason=lambda: "nothing to undo",
                ),
                Command(
                    "map", "Open a map", "Run", self._open, argument=Argument("name", list_values=self._maps)
                ),
            ],
            self._attempt,
        )

    def _maps(self) -> list[str]:
        return ["rooms", "office"]

    def _open(self, name: object) -> str:
        if name not in self._maps():
            raise InputError(f"there is no map {name}")
        self.done.append(name)
        return f"{name} is open"

    def _attempt(self, call: Any) -> None:
        try:
            call()
        except InputError as error:
            self.errors.append(str(error))


def test_keys_run_commands_once_and_disabled_commands_report_why() -> None:
    recorded = RecordedCommands()
    command = recorded.commands.take_command(build_key_event("space"))
    assert command is not None
    assert command.name == "pause"
    assert recorded.commands.take_command(build_key_event("space")) is None, "it is held down"
    recorded.commands.release_key(build_key_event("space"))
    recorded.commands.run("pause")
    recorded.commands.run("undo")
    assert recorded.done == ["pause"]
    assert recorded.errors == ["nothing to undo"]
    assert recorded.commands["undo"].tip == "Undo (Ctrl+Z)"


def test_the_palette_completes_names_and_keeps_invalid_text(screen: pygame.Surface) -> None:
    recorded = RecordedCommands()
    dialogs = Dialogs()
    messages = []
    dialogs.ask(create_palette(recorded.commands, "", messages.append))
    dialogs.ignore_letter("/")

    def send(*events: pygame.event.Event) -> None:
        for event in events:
            dialogs.draw(screen, LIGHT, 1.0)
            dialogs.handle_event(event)

    send(
        build_text_event("/"),
        build_text_event("open"),
        build_key_event("return"),
        build_text_event("attic"),
        build_key_event("return"),
    )
    assert dialogs.is_open
    assert recorded.done == []
    assert dialogs.current.text == "map attic"
    assert dialogs.current.error == "there is no map attic"
    send(
        build_key_event("ctrl+backspace"),
        build_text_event("of"),
        build_key_event("tab"),
        build_key_event("return"),
    )
    assert not dialogs.is_open
    assert recorded.done == ["office"]
    assert messages == ["office is open"]
    with pytest.raises(InputError, match="mao"):
        recorded.commands.run_text("mao office")


def test_questions_are_answered_by_keys_and_clicks(screen: pygame.Surface) -> None:
    given: list[str] = []
    for events in (
        [build_key_event("return")],
        [build_key_event("tab"), build_key_event("return")],
        [build_key_event("d")],
        [build_key_event("escape")],
    ):
        dialogs = Dialogs()
        answers = [
            Answer("Save", lambda: given.append("s")),
            Answer("Discard", lambda: given.append("d"), "d"),
        ]
        dialogs.ask(Question("Save first? " * 9, "It was edited.", answers, lambda: given.append("c"), 300))
        for event in events:
            dialogs.draw(screen, LIGHT, 1.0)
            dialogs.handle_event(event)
        assert not dialogs.is_open
    assert given == ["s", "d", "d", "c"]


def test_files_are_chosen_in_folders(screen: pygame.Surface, tmp_path: Any) -> None:
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "a.json").touch()
    (tmp_path / "maps" / "b.txt").touch()
    chosen: list[object] = []
    dialogs = Dialogs()
    dialogs.ask(create_file_choice("Open", tmp_path, chosen.append, suffixes=(".json",)))
    for event in (build_key_event("return"), build_key_event("return")):
        dialogs.draw(screen, LIGHT, 1.0)
        dialogs.handle_event(event)
    assert chosen == [tmp_path / "maps" / "a.json"]
    assert not dialogs.is_open


def test_a_choice_of_files_can_hide_where_its_folder_is(tmp_path: Path) -> None:
    for name in ("old.json", "new.json"):
        (tmp_path / name).touch()
    recent = (tmp_path / "old.json",)
    choice = create_file_choice("Open", tmp_path, print, recent=recent, hides_folder=True)
    texts = [choice.placeholder, *(option.text + option.completion for option in choice.options(""))]
    assert "old.json" in texts[1]
    assert not any(str(tmp_path.parent) in text for text in texts)
    shown = create_file_choice("Open", tmp_path, print, recent=recent)
    assert str(tmp_path) in shown.placeholder
    assert shown.options("")[0].text == str(recent[0])


def test_a_menu_stays_in_the_window_and_skips_disabled_commands(
    screen: pygame.Surface,
) -> None:
    recorded = RecordedCommands()
    dialogs = Dialogs()
    dialogs.ask(
        Menu([recorded.commands["undo"], None, recorded.commands["pause"]], (310, 290), recorded.commands.run)
    )
    dialogs.draw(screen, LIGHT, 1.0)
    assert dialogs.ui is not None
    assert screen.get_rect().contains(dialogs.ui.box)
    dialogs.handle_event(build_key_event("down"))
    dialogs.handle_event(build_key_event("return"))
    assert recorded.done == ["pause"]
    assert not dialogs.is_open


def test_a_command_typed_within_one_frame_runs(tmp_path: Path) -> None:
    """On a slow machine, all keys may come before the palette is drawn."""
    with open_viewer(tmp_path) as driver:
        for letter in ("/", *"robots 1", "\r"):
            key = pygame.key.key_code("return") if letter == "\r" else ord(letter)
            attributes = {"key": key, "mod": 0, "unicode": letter, "scancode": 0}
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, attributes))
            if letter.isprintable():
                pygame.event.post(pygame.event.Event(pygame.TEXTINPUT, text=letter))
            pygame.event.post(pygame.event.Event(pygame.KEYUP, attributes))
        driver.run_frames(2)
        assert not driver.window.dialogs.is_open
        assert driver.viewer.session.displayed.numbers == (1,)
