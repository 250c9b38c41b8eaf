"""Faults do not end a window, and control characters are removed from input."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import pygame
import pytest
from driven_editor import open_editor
from driven_window import open_viewer
from sample_sessions import start_session

from robocov.environment import CircleObstacle
from robocov_app.editor.edits.create import add_circle
from robocov_app.toolkit.widgets.text_edit import MAX_CHARS, TextEdit
from robocov_app.toolkit.window import exceptions
from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.display import open_display, set_title
from robocov_app.toolkit.window.exceptions import LOG_FILE, ExceptionLog
from robocov_app.toolkit.window.input import clean_event
from robocov_app.toolkit.window.window import BaseWindow
from robocov_app.viewer.session.session import Session
from robocov_app.web.events import MESSAGES, EventTranslator

CONTROLS = "".join(map(chr, [*range(32), *range(127, 160)])) + "\u202e\u2066\udcff"


class Fragile(BaseWindow):
    """A window whose parts raise the exceptions in `raises`."""

    def __init__(self) -> None:
        super().__init__((900, 600))
        self.raises: dict[str, Exception] = {}
        self.calls: list[str] = []
        self.value = 0
        self.reports: list[str] = []

    def call(self, name: str) -> None:
        self.calls.append(name)
        if name in self.raises:
            raise self.raises[name]

    def handle_event(self, event: pygame.event.Event) -> None:
        if event.type == pygame.KEYDOWN:
            self.value += 1
            self.call("take")
        elif event.type == pygame.QUIT:
            self.call("quit")

    def update(self, seconds: float) -> None:
        self.call("update")

    def draw(self) -> None:
        self.call("draw")

    def build_frame_key(self) -> object:
        self.call("look")
        return None

    def create_save_point(self) -> Callable[[], None]:
        value = self.value
        return lambda: setattr(self, "value", value)

    def report_exception(self, message: str, *, in_drawing: bool) -> None:
        self.reports.append(message)


@pytest.fixture
def window(tmp_path: Path) -> Iterator[Fragile]:
    with open_display(headless=True):
        pygame.event.clear()
        fragile = Fragile()
        fragile.guard.log = ExceptionLog(tmp_path)
        yield fragile


def post_key() -> None:
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_a, mod=0, unicode="a", scancode=0))


def test_an_event_that_raises_is_logged_reported_and_reverted(window: Fragile, tmp_path: Path) -> None:
    window.raises["take"] = ValueError("embedded\nnull byte")
    post_key()
    window.run_frame(0.02)
    assert window.value == 0
    assert not window.closed
    (report,) = window.reports
    assert report.startswith("Internal error while handling KeyDown (ValueError: embedded null byte).")
    assert str(tmp_path / LOG_FILE) in report
    assert "\n" not in report
    log = (tmp_path / LOG_FILE).read_text()
    assert "Traceback" in log
    assert "ValueError: embedded" in log
    window.raises.clear()
    post_key()
    window.run_frame(0.02)
    assert window.value == 1


@pytest.mark.parametrize("part", ["update", "draw", "look"])
def test_a_part_that_always_fails_is_retried_rarely_and_recovers(
    window: Fragile, part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    window.raises[part] = RuntimeError("always")
    for _ in range(500):
        window.run_frame(0.02)
    assert window.calls.count(part) < 20, "it is retried rarely"
    assert (tmp_path / LOG_FILE).read_text().count("Traceback") == 1
    window.raises.clear()
    window.guard._retry_at_s.clear()
    window.calls.clear()
    window.run_frame(0.02)
    assert part in window.calls


def test_a_window_whose_closing_fails_closes(window: Fragile) -> None:
    window.raises["quit"] = RuntimeError("cannot ask")
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    window.run_frame(0.02)
    assert window.closed


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, MemoryError])
def test_exceptions_that_end_a_program_are_passed_on(window: Fragile, error: type[Exception]) -> None:
    window.raises["take"] = error()
    post_key()
    with pytest.raises(error):
        window.run_frame(0.02)


def test_a_lost_display_ends_the_window(window: Fragile) -> None:
    window.raises["draw"] = pygame.error("display Surface quit")
    pygame.display.quit()
    with pytest.raises(pygame.error):
        window.run_frame(0.02)


def test_a_log_file_stays_small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exceptions, "_MAX_LOG_BYTES", 5_000)
    log = ExceptionLog(tmp_path)
    for k in range(300):
        error = type(f"Error{k}", (Exception,), {})("x" * 500)
        log.record(error, "testing")
    files = list(tmp_path.iterdir())
    assert len(files) == 2
    assert sum(file.stat().st_size for file in files) < 12_000
    assert log.count == 300


def test_standard_error_replaces_an_unwritable_log_file(tmp_path: Path, capsys) -> None:
    (tmp_path / "file").write_text("")
    sentence = ExceptionLog(tmp_path / "file").record(ValueError("boom\x1b[31m"), "testing")
    assert sentence == "Internal error while testing (ValueError: boom[31m). Details: the terminal."
    assert "ValueError: boom" in capsys.readouterr().err


def test_control_characters_are_removed_from_input(tmp_path: Path) -> None:
    clipboard = Clipboard()
    with open_display(headless=True):
        for text in ("a\x00b", f"a{CONTROLS}b"):
            clipboard.put(text)
            assert clipboard.get().replace("\n", "").replace("\t", "") == "ab"
            for kind in (pygame.TEXTINPUT, pygame.TEXTEDITING):
                event = clean_event(pygame.event.Event(kind, text=text, start=0, length=0))
                assert event is not None
                assert event.text == "ab"
        assert clean_event(pygame.event.Event(pygame.TEXTINPUT, text="\x00")) is None
        dropped = clean_event(pygame.event.Event(pygame.DROPFILE, file="a\x00 b\n.json"))
        assert dropped is not None
        assert dropped.file == "a b\n.json"
        pygame.display.set_mode((100, 100))
        set_title(f"a{CONTROLS}b")
        assert pygame.display.get_caption()[0] == "ab"
        message = MESSAGES.validate_json(json.dumps({"kind": "paste", "text": "a\x00b"}))
        assert list(EventTranslator(clipboard).translate(message))
        assert clipboard.get() == "ab"


def test_a_field_limits_the_length_of_its_text() -> None:
    edit = TextEdit.select_all("ab")
    edit.place(1)
    edit.type("x\x00y\tz" * MAX_CHARS)
    assert len(edit.text) == MAX_CHARS
    assert edit.text.startswith("axyzxyz")
    assert edit.text.endswith("b")
    edit.type("more")
    assert len(edit.text) == MAX_CHARS


def test_an_edit_of_a_map_that_raises_is_reverted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_editor(tmp_path, drafts=tmp_path / "drafts") as driver:
        window = driver.window
        editor = driver.editor
        window.guard.is_enabled = True
        editor.apply(add_circle(editor.sketch, (2.0, 2.0), 0.5))
        before = editor.sketch

        def fail_half_way() -> None:
            editor.document.history.apply(add_circle(editor.sketch, (5.0, 5.0), 0.5))
            raise ZeroDivisionError("half-way")

        monkeypatch.setattr(window.play_mode, "start", fail_half_way)
        monkeypatch.setattr(window, "do", lambda name: fail_half_way())
        driver.press_key("f5")
        assert editor.sketch == before
        assert "Internal error" in editor.message
        assert editor.has_error_message
        monkeypatch.undo()
        driver.press_key("ctrl+z")
        assert editor.sketch.obstacles == ()
        driver.press_key("ctrl+y")
        assert editor.sketch == before


def test_a_dialog_that_cannot_be_drawn_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_editor(tmp_path) as driver:
        driver.window.guard.is_enabled = True
        driver.press_key("ctrl+k")
        palette = driver.editor.dialogs.current
        assert palette is not None

        def fail(ui: object) -> None:
            raise IndexError("page")

        monkeypatch.setattr(palette, "show_content", fail)
        driver.window.run_frame(0.1)
        driver.window.run_frame(0.1)
        assert driver.editor.dialogs.current is None
        assert "IndexError" in driver.editor.message


def test_an_edit_of_a_session_that_raises_is_reverted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_viewer(tmp_path) as driver:
        window = driver.window
        session = driver.session
        window.guard.is_enabled = True
        for _ in range(20):
            session.playback.step()
        session.fail_robot(2)
        nodes = len(session.timeline.document.nodes)
        positions = session.timeline.panes[0].simulation.positions.copy()
        amend = session.timeline.history.amend

        def fail(moment: object) -> None:
            raise ZeroDivisionError("half-way")

        monkeypatch.setattr(session.timeline.history, "amend", fail)
        driver.viewer.inspection.selected = 1
        driver.press_key("delete")
        assert "ZeroDivisionError" in driver.viewer.message
        monkeypatch.setattr(session.timeline.history, "amend", amend)
        assert session.displayed.numbers == (1, 3)
        assert len(session.timeline.document.nodes) == nodes
        assert (session.timeline.panes[0].simulation.positions == positions).all()
        again = build_session_without_fault()
        for _ in range(30):
            session.playback.step()
            again.playback.step()
        expected = again.timeline.panes[0].simulation.positions
        assert (session.timeline.panes[0].simulation.positions == expected).all()


def build_session_without_fault() -> Session:
    session = start_session()
    for _ in range(20):
        session.playback.step()
    session.fail_robot(2)
    return session


def test_a_step_that_raises_is_reverted_and_pauses_the_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_viewer(tmp_path) as driver:
        window = driver.window
        session = driver.session
        window.guard.is_enabled = True
        for _ in range(20):
            session.playback.step()
        pane = session.timeline.panes[0]
        positions = pane.simulation.positions.copy()
        step = pane.step

        def fail(pull: object) -> None:
            step(pull)
            raise ZeroDivisionError("half-way")

        monkeypatch.setattr(pane, "step", fail)
        session.playback.is_playing = True
        driver.run_frames(3, 0.1)
        assert not session.playback.is_playing
        assert "ZeroDivisionError" in driver.viewer.message
        assert session.timeline.panes[0].time == pytest.approx(session.timeline.end_time)
        assert (session.timeline.panes[0].simulation.positions == positions).all()
        session.playback.is_playing = True
        driver.run_frames(3, 0.1)
        assert session.timeline.end_time > 20 * session.timeline.scenario.dt


def test_a_message_with_control_characters_is_drawn(tmp_path: Path) -> None:
    with open_editor(tmp_path) as driver:
        driver.editor.apply(add_circle(driver.sketch, (5.0, 5.0), 1.0))
        (item,) = driver.sketch.obstacles
        assert isinstance(item.shape, CircleObstacle)
        driver.editor.show_message("a\x00b\udcff", is_error=True)
        driver.window.run_frame(0.1)
