"""Widgets, commands and dialogs, used by events without a window."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pygame
import pytest
from driven_window import open_viewer

from robocov.errors import InputError
from robocov_app.look.theme import DARK, LIGHT, Theme
from robocov_app.toolkit.commands.command import Argument, Command, CommandTable
from robocov_app.toolkit.commands.menu import Menu
from robocov_app.toolkit.commands.palette import create_palette
from robocov_app.toolkit.dialogs import (
    Answer,
    Dialogs,
    Option,
    Question,
    create_file_choice,
    create_list_choice,
)
from robocov_app.toolkit.widgets.page import Widget
from robocov_app.toolkit.widgets.text_edit import TextEdit
from robocov_app.toolkit.widgets.ui import Ui

KEYS = {
    "return": pygame.K_RETURN,
    "tab": pygame.K_TAB,
    "escape": pygame.K_ESCAPE,
    "left": pygame.K_LEFT,
    "up": pygame.K_UP,
    "down": pygame.K_DOWN,
    "page down": pygame.K_PAGEDOWN,
    "backspace": pygame.K_BACKSPACE,
    "space": pygame.K_SPACE,
}
MODIFIERS = {"ctrl": pygame.KMOD_LCTRL, "shift": pygame.KMOD_LSHIFT}


def build_key_event(name: str) -> pygame.event.Event:
    """Return the press of a key with modifiers, such as "ctrl+z"."""
    *modifiers, key = name.split("+")
    mod = sum(MODIFIERS[modifier] for modifier in modifiers)
    return pygame.event.Event(pygame.KEYDOWN, key=KEYS.get(key) or ord(key), mod=mod, unicode="")


def build_text_event(text: str) -> pygame.event.Event:
    return pygame.event.Event(pygame.TEXTINPUT, text=text)


def build_wheel_event(notches: int) -> pygame.event.Event:
    """Return a turn of the mouse wheel, which scrolls up if positive."""
    return pygame.event.Event(pygame.MOUSEWHEEL, x=0, y=notches, precise_y=float(notches))


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> Iterator[pygame.Surface]:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame.display.init()
    pygame.font.init()
    yield pygame.display.set_mode((320, 300))
    pygame.display.quit()


class EditedPage:
    """A page with one widget of each kind, and the values that they edit."""

    def __init__(self, screen: pygame.Surface, theme: Theme = LIGHT, scale: float = 1.0) -> None:
        self.screen = screen
        self.value = 0.5
        self.is_on = False
        self.name = "8"
        self.letter = "b"
        self.tab = "one"
        self.press_count = 0
        self.ui = Ui(self.show_page, theme, scale)
        self.ui.box = screen.get_rect()
        self.draw()

    def show_page(self, ui: Ui) -> None:
        self.press_count += ui.button("Go", tip="goes")
        self.press_count += ui.button("Stop", disabled_reason="nothing goes")
        self.value = ui.slider("value", self.value, 0.0, 1.0) or self.value
        is_on = ui.check_box("On", value=self.is_on)
        if is_on is not None:
            self.is_on = is_on
        self.name = ui.text_field("name", self.name) or self.name
        self.letter = ui.dropdown("letter", "abcdefghijklmnopqrstuvwxyz", self.letter) or self.letter
        self.tab = ui.tabs("tab", ["one", "two"], self.tab) or self.tab
        with ui.scroll("more"):
            if ui.section("MORE"):
                for k in range(20):
                    ui.label(f"line {k}")

    def draw(self) -> None:
        self.ui.draw(self.screen)
        self.ui.draw_overlays(self.screen)

    def find(self, kind: str, name: str) -> Widget:
        """Return a widget, which has to be there."""
        widget = self.ui.find(kind, name)
        assert widget is not None
        return widget

    def click(self, kind: str, name: str, fraction: float = 0.5) -> None:
        """Click a widget at a fraction of its width."""
        rect = self.find(kind, name).rect
        self.click_pixel(rect.left + fraction * rect.width, rect.centery)

    def click_pixel(self, x: float, y: float) -> None:
        position = (round(x), round(y))
        for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            self.ui.handle_event(pygame.event.Event(kind, pos=position, button=1))
            self.draw()

    def press_keys(self, *names: str) -> None:
        for name in names:
            self.ui.handle_event(build_key_event(name))

    def type(self, *texts: str) -> None:
        for text in texts:
            self.ui.handle_event(build_text_event(text))

    def get_field_text(self) -> str:
        """Return the text that the text field shows, which may not be accepted yet."""
        self.draw()
        return self.find("entry", "name").text


@pytest.fixture
def page(screen: pygame.Surface) -> EditedPage:
    return EditedPage(screen)


class TestWidgets:
    def test_a_button_is_pressed(self, page: EditedPage) -> None:
        page.click("button", "Go")
        assert page.press_count == 1

    def test_a_disabled_button_is_not_pressed_and_tells_why(self, page: EditedPage) -> None:
        page.click("button", "Stop")
        assert page.press_count == 0
        assert page.find("button", "Stop").tip == "Nothing goes"

    def test_a_slider_moves_to_the_pointer(self, page: EditedPage) -> None:
        page.click("slider", "value", 0.9)
        assert 0.85 < page.value < 0.95

    def test_a_check_box_is_checked(self, page: EditedPage) -> None:
        page.click("check", "On")
        assert page.is_on

    def test_a_tab_is_selected(self, page: EditedPage) -> None:
        page.click("button", "tab:two")
        assert page.tab == "two"


class TestTextField:
    def test_return_accepts_the_text(self, page: EditedPage) -> None:
        page.click("entry", "name")
        page.type("1", "2")
        assert page.ui.edit
        assert page.name == "8"
        page.press_keys("return")
        assert page.name == "12"
        assert not page.ui.edit

    def test_consecutive_characters_are_undone_together(self, page: EditedPage) -> None:
        page.click("entry", "name")
        page.type("1", "2")
        page.press_keys("ctrl+z")
        assert page.get_field_text() == "8"
        page.press_keys("ctrl+y")
        assert page.get_field_text() == "12"

    def test_the_selected_text_is_copied(self, page: EditedPage) -> None:
        page.click("entry", "name")
        page.type("1", "2")
        page.press_keys("ctrl+a", "ctrl+c")
        assert page.ui.clipboard.get() == "12"

    def test_escape_reverts_the_text(self, page: EditedPage) -> None:
        page.click("entry", "name")
        page.press_keys("backspace", "escape")
        assert page.name == "8"
        assert page.get_field_text() == "8"

    def test_return_does_not_accept_a_text_that_is_being_composed(self, page: EditedPage) -> None:
        page.click("entry", "name")
        page.ui.handle_event(pygame.event.Event(pygame.TEXTEDITING, text="にほ", start=0, length=2))
        page.draw()
        page.press_keys("return")
        assert page.ui.edit
        assert page.get_field_text() == "8"

    def test_a_composed_text_is_accepted(self, page: EditedPage) -> None:
        page.click("entry", "name")
        page.ui.handle_event(pygame.event.Event(pygame.TEXTEDITING, text="にほ", start=0, length=2))
        page.type("日本")
        page.press_keys("return")
        assert page.name == "日本"


def draw_empty_field(screen: pygame.Surface, placeholder: str) -> bytes:
    """Return the pixels of the cursor in an empty field that is being edited."""
    ui = Ui(lambda page: page.text_field("name", "", placeholder=placeholder), LIGHT)
    ui.box = screen.get_rect()
    ui.focus = "name"
    ui.edit = TextEdit.append_to("")
    screen.fill(LIGHT.panel)
    ui.run()
    ui.draw(screen)
    (field,) = ui.widgets.values()
    cursor = pygame.Rect(field.rect.topleft, (_CURSOR_PART_PX, field.rect.height))
    return pygame.image.tobytes(screen.subsurface(cursor), "RGB")


_CURSOR_PART_PX = 8
"""Width of the part of a field up to its cursor."""


def test_the_cursor_of_an_empty_field_does_not_cover_its_placeholder(screen: pygame.Surface) -> None:
    assert draw_empty_field(screen, "type to find") == draw_empty_field(screen, "")


class TestDropdown:
    def test_a_click_chooses_from_the_list_and_not_from_widgets_below(self, page: EditedPage) -> None:
        page.click("menu", "letter")
        open_list = page.ui.open_list
        assert open_list is not None
        next_item = open_list.get_item_rect(open_list.highlighted + 1)
        page.click_pixel(*next_item.center)
        assert page.letter == "c"
        assert page.ui.open_list is None
        assert page.tab == "one"

    def test_keys_choose_from_the_list(self, page: EditedPage) -> None:
        page.click("menu", "letter")
        page.press_keys("up", "return")
        assert page.letter == "a"

    def test_a_click_next_to_the_list_only_closes_it(self, page: EditedPage) -> None:
        page.click("menu", "letter")
        page.click("button", "Go")
        assert page.press_count == 0
        assert page.ui.open_list is None


class TestFocus:
    def test_without_focus_keys_are_not_taken(self, page: EditedPage) -> None:
        assert not page.ui.handle_event(build_key_event("tab"))

    def test_keys_operate_the_widget_with_the_focus(self, page: EditedPage) -> None:
        page.click("entry", "name")
        page.press_keys("shift+tab", "space")
        assert page.is_on
        assert not page.ui.edit
        page.press_keys("shift+tab", "left")
        assert page.value < 0.5
        page.press_keys("shift+tab", "return")
        assert page.press_count == 1

    def test_keys_without_meaning_for_the_widget_are_not_taken(self, page: EditedPage) -> None:
        page.click("entry", "name")
        page.press_keys("shift+tab")
        assert not page.ui.handle_event(build_key_event("x"))

    def test_escape_removes_the_focus(self, page: EditedPage) -> None:
        page.click("entry", "name")
        page.press_keys("shift+tab")
        assert page.ui.handle_event(build_key_event("escape"))
        assert not page.ui.handle_event(build_key_event("space"))


class TestScrolling:
    def test_the_wheel_scrolls_long_content(self, page: EditedPage) -> None:
        assert page.find("bar", "more").value == 0.0
        page.ui.pointer = (50, 280)
        page.ui.handle_event(build_wheel_event(-1))
        page.draw()
        assert page.find("bar", "more").value == 40.0
        page.ui.handle_event(build_wheel_event(1))
        page.draw()
        assert page.find("bar", "more").value == 0.0

    def test_a_folded_section_has_no_content_and_no_scroll_bar(self, page: EditedPage) -> None:
        page.click("section", "section:MORE")
        assert page.ui.find("label", "line 0") is None
        assert page.ui.find("bar", "more") is None

    @pytest.mark.parametrize("scale", [1.0, 1.125, 1.25, 1.75])
    def test_the_rows_of_a_long_list_fill_the_area_at_any_scale(
        self, scale: float, screen: pygame.Surface
    ) -> None:
        rows: list[tuple[int, pygame.Rect]] = []

        def show_rows(ui: Ui) -> None:
            rows.clear()
            with ui.scroll("rows"):
                rows.extend((number, ui.cell()) for number in ui.visible_rows(1000, 22.0))

        ui = Ui(show_rows, LIGHT, scale)
        ui.box = screen.get_rect()
        ui.draw(screen)
        for offset in (0.0, 2200.0, 11000.0, 22000.0):
            ui.scroll_offsets["rows"] = offset
            ui.run(None, screen)
            _, first = rows[0]
            _, last = rows[-1]
            assert first.top <= ui.box.top
            assert last.bottom >= ui.box.bottom - 1
        assert rows[-1][0] == 999


@pytest.mark.parametrize("scale", [1.0, 1.5, 2.25])
def test_an_unchanged_page_is_drawn_again(scale: float, screen: pygame.Surface) -> None:
    page = EditedPage(screen, DARK, scale)
    expected = pygame.surfarray.array3d(screen)
    screen.fill("red")
    page.draw()
    assert (pygame.surfarray.array3d(screen) == expected).all()


class RecordedCommands:
    """Commands that record their effects and errors."""

    def __init__(self) -> None:
        self.effects: list[object] = []
        self.errors: list[str] = []
        pause = Command("pause", "Play or pause", "Run", lambda: self.effects.append("pause"), ("space",))
        undo = Command(
            "undo",
            "Undo",
            "Edit",
            lambda: self.effects.append("undo"),
            ("ctrl+z",),
            get_disabled_reason=lambda: "nothing to undo",
        )
        open_map = Command(
            "map",
            "Open a map",
            "Run",
            self.open_map,
            argument=Argument("name", list_values=self.list_maps),
        )
        self.commands = CommandTable([pause, undo, open_map], self.attempt)

    def list_maps(self) -> list[str]:
        return ["rooms", "office"]

    def open_map(self, name: object) -> str:
        if name not in self.list_maps():
            raise InputError(f"there is no map {name}")
        self.effects.append(name)
        return f"{name} is open"

    def attempt(self, call: Callable[[], object]) -> None:
        try:
            call()
        except InputError as error:
            self.errors.append(str(error))


def send_events(dialogs: Dialogs, screen: pygame.Surface, *events: pygame.event.Event) -> None:
    """Send events to the open dialog, which is drawn before each of them."""
    for event in events:
        dialogs.draw(screen, LIGHT, 1.0)
        dialogs.handle_event(event)


class TestCommands:
    def test_a_key_that_is_held_down_runs_its_command_once(self) -> None:
        commands = RecordedCommands().commands
        command = commands.take_command(build_key_event("space"))
        assert command is not None
        assert command.name == "pause"
        assert commands.take_command(build_key_event("space")) is None
        commands.release_key(build_key_event("space"))
        assert commands.take_command(build_key_event("space")) is command

    def test_a_command_runs(self) -> None:
        recorded = RecordedCommands()
        recorded.commands.run("pause")
        assert recorded.effects == ["pause"]
        assert recorded.errors == []

    def test_a_disabled_command_reports_why_it_does_not_run(self) -> None:
        recorded = RecordedCommands()
        recorded.commands.run("undo")
        assert recorded.effects == []
        assert recorded.errors == ["nothing to undo"]

    def test_the_tip_of_a_command_has_its_key(self) -> None:
        assert RecordedCommands().commands["undo"].tip == "Undo (Ctrl+Z)"

    def test_an_unknown_command_is_rejected(self) -> None:
        with pytest.raises(InputError, match="mao"):
            RecordedCommands().commands.run_text("mao office")


class TestPalette:
    @pytest.fixture
    def recorded(self) -> RecordedCommands:
        return RecordedCommands()

    @pytest.fixture
    def messages(self) -> list[str]:
        return []

    @pytest.fixture
    def dialogs(self, recorded: RecordedCommands, messages: list[str]) -> Dialogs:
        """Dialogs with a palette that was just opened with the key "/"."""
        dialogs = Dialogs()
        dialogs.ask(create_palette(recorded.commands, "", messages.append))
        dialogs.ignore_character("/")
        return dialogs

    def test_the_palette_stays_open_with_an_invalid_text(
        self, dialogs: Dialogs, recorded: RecordedCommands, screen: pygame.Surface
    ) -> None:
        send_events(
            dialogs,
            screen,
            build_text_event("/"),
            build_text_event("open"),
            build_key_event("return"),
            build_text_event("attic"),
            build_key_event("return"),
        )
        assert dialogs.is_open
        assert dialogs.current.text == "map attic"
        assert dialogs.current.error == "there is no map attic"
        assert recorded.effects == []

    def test_tab_completes_the_argument_of_a_command(
        self, dialogs: Dialogs, recorded: RecordedCommands, messages: list[str], screen: pygame.Surface
    ) -> None:
        send_events(
            dialogs,
            screen,
            build_text_event("/"),
            build_text_event("open"),
            build_key_event("return"),
            build_text_event("of"),
            build_key_event("tab"),
            build_key_event("return"),
        )
        assert not dialogs.is_open
        assert recorded.effects == ["office"]
        assert messages == ["office is open"]

    def test_a_word_is_deleted_and_replaced(
        self, dialogs: Dialogs, recorded: RecordedCommands, screen: pygame.Surface
    ) -> None:
        send_events(
            dialogs,
            screen,
            build_text_event("open"),
            build_key_event("return"),
            build_text_event("attic"),
            build_key_event("ctrl+backspace"),
            build_text_event("office"),
            build_key_event("return"),
        )
        assert recorded.effects == ["office"]


@pytest.mark.parametrize(
    ("keys", "answer"),
    [
        pytest.param(["return"], "save", id="first answer"),
        pytest.param(["tab", "return"], "discard", id="second answer"),
        pytest.param(["d"], "discard", id="letter"),
        pytest.param(["escape"], "cancel", id="cancel"),
    ],
)
def test_a_question_is_answered_by_keys(screen: pygame.Surface, keys: list[str], answer: str) -> None:
    given_answers: list[str] = []
    answers = [
        Answer("Save", lambda: given_answers.append("save")),
        Answer("Discard", lambda: given_answers.append("discard"), "d"),
    ]
    dialogs = Dialogs()
    dialogs.ask(
        Question("Save first? " * 9, "It was edited.", answers, lambda: given_answers.append("cancel"), 300)
    )
    send_events(dialogs, screen, *(build_key_event(key) for key in keys))
    assert given_answers == [answer]
    assert not dialogs.is_open


class TestFileChoice:
    def test_files_are_chosen_in_folders(self, screen: pygame.Surface, tmp_path: Path) -> None:
        (tmp_path / "maps").mkdir()
        (tmp_path / "maps" / "a.json").touch()
        (tmp_path / "maps" / "b.txt").touch()
        chosen: list[object] = []
        dialogs = Dialogs()
        dialogs.ask(create_file_choice("Open", tmp_path, chosen.append, suffixes=(".json",)))
        send_events(dialogs, screen, build_key_event("return"), build_key_event("return"))
        assert chosen == [tmp_path / "maps" / "a.json"]
        assert not dialogs.is_open

    @pytest.fixture
    def recent(self, tmp_path: Path) -> tuple[Path, ...]:
        """A recent file in a folder with another file."""
        for name in ("old.json", "new.json"):
            (tmp_path / name).touch()
        return (tmp_path / "old.json",)

    def test_the_folder_is_shown(self, tmp_path: Path, recent: tuple[Path, ...]) -> None:
        choice = create_file_choice("Open", tmp_path, print, recent=recent)
        assert str(tmp_path) in choice.placeholder
        assert choice.options("")[0].text == str(recent[0])

    def test_the_folder_can_be_hidden(self, tmp_path: Path, recent: tuple[Path, ...]) -> None:
        choice = create_file_choice("Open", tmp_path, print, recent=recent, hides_folder=True)
        texts = [option.text + option.completion for option in choice.options("")]
        assert "old.json" in texts[0]
        assert not any(str(tmp_path.parent) in text for text in [choice.placeholder, *texts])


class TestListChoice:
    @pytest.fixture
    def options(self) -> list[Option]:
        return [Option(f"Line {number}", description="described") for number in range(30)]

    @pytest.fixture
    def dialogs(self, options: list[Option]) -> Dialogs:
        dialogs = Dialogs()
        dialogs.ask(create_list_choice("Lines", lambda: options, print))
        return dialogs

    def test_the_highlighted_line_stays_visible_in_a_smaller_window(self, dialogs: Dialogs) -> None:
        send_events(dialogs, pygame.Surface((320, 900)), *[build_key_event("down")] * 8)
        assert self.list_visible(dialogs, pygame.Surface((320, 300)))[-1] == "Line 8"

    def test_the_remaining_lines_are_visible_if_others_disappear(
        self, dialogs: Dialogs, options: list[Option], screen: pygame.Surface
    ) -> None:
        send_events(dialogs, screen, *[build_key_event("page down")] * 4)
        del options[2:]
        assert self.list_visible(dialogs, screen) == ["Line 0", "Line 1"]

    @staticmethod
    def list_visible(dialogs: Dialogs, screen: pygame.Surface) -> list[str]:
        """Draw the dialog, and return its visible lines."""
        dialogs.draw(screen, LIGHT, 1.0)
        assert dialogs.ui is not None
        return [widget.text for widget in dialogs.ui.widgets.values() if widget.kind == "option"]


class TestMenu:
    @pytest.fixture
    def recorded(self) -> RecordedCommands:
        return RecordedCommands()

    @pytest.fixture
    def dialogs(self, recorded: RecordedCommands, screen: pygame.Surface) -> Dialogs:
        """Dialogs with a menu that was opened in the lower right corner of the screen."""
        commands = recorded.commands
        dialogs = Dialogs()
        dialogs.ask(Menu([commands["undo"], None, commands["pause"]], (310, 290), commands.run))
        dialogs.draw(screen, LIGHT, 1.0)
        return dialogs

    def test_a_menu_stays_in_the_window(self, dialogs: Dialogs, screen: pygame.Surface) -> None:
        assert dialogs.ui is not None
        assert screen.get_rect().contains(dialogs.ui.box)

    def test_keys_skip_disabled_commands(self, dialogs: Dialogs, recorded: RecordedCommands) -> None:
        dialogs.handle_event(build_key_event("down"))
        dialogs.handle_event(build_key_event("return"))
        assert recorded.effects == ["pause"]
        assert not dialogs.is_open

    def test_a_long_menu_scrolls_to_the_highlighted_command(self, screen: pygame.Surface) -> None:
        rows = [Command(f"command:{number}", f"Command {number}", "Many", print) for number in range(20)]
        dialogs = Dialogs()
        dialogs.ask(Menu(rows, (0, 0), print))
        send_events(dialogs, screen, *[build_key_event("down")] * 18)
        dialogs.draw(screen, LIGHT, 1.0)
        assert dialogs.ui is not None
        highlighted = dialogs.ui.find("option", "command:17")
        assert highlighted is not None
        assert highlighted.value
        assert highlighted.rect.height > 20


def test_a_command_typed_within_one_frame_runs(tmp_path: Path) -> None:
    """On a slow machine, all keys may come before the palette is drawn."""
    with open_viewer(tmp_path) as driver:
        for character in ("/", *"robots 1", "\r"):
            key = pygame.K_RETURN if character == "\r" else ord(character)
            attributes = {"key": key, "mod": 0, "unicode": character, "scancode": 0}
            pygame.event.post(pygame.event.Event(pygame.KEYDOWN, attributes))
            if character.isprintable():
                pygame.event.post(pygame.event.Event(pygame.TEXTINPUT, text=character))
            pygame.event.post(pygame.event.Event(pygame.KEYUP, attributes))
        driver.run_frames(2)
        assert not driver.window.dialogs.is_open
        assert driver.viewer.session.displayed.numbers == (1,)
