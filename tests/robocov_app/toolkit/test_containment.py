"""Exceptions that do not end a window, and control characters that are removed from input."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest.mock import Mock

import numpy as np
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

C0_AND_C1_CONTROLS = "".join(chr(code) for code in [*range(32), *range(127, 160)])
BIDI_CONTROLS = "\u202e\u2066"
UNPAIRED_SURROGATE = "\udcff"
CONTROLS = C0_AND_C1_CONTROLS + BIDI_CONTROLS + UNPAIRED_SURROGATE


class FailingWindow(BaseWindow):
    """A window whose methods raise the exceptions in `errors`."""

    def __init__(self) -> None:
        super().__init__((900, 600))
        self.errors: dict[str, Exception] = {}
        self.calls: list[str] = []
        self.key_count = 0
        self.reports: list[str] = []

    def record_call(self, name: str) -> None:
        """Record the call of a method, and raise its exception if it has one."""
        self.calls.append(name)
        if name in self.errors:
            raise self.errors[name]

    def handle_event(self, event: pygame.event.Event) -> None:
        if event.type == pygame.KEYDOWN:
            self.key_count += 1
            self.record_call("handle_key")
        elif event.type == pygame.QUIT:
            self.record_call("quit")

    def update(self, seconds: float) -> None:
        self.record_call("update")

    def draw(self) -> None:
        self.record_call("draw")

    def build_frame_key(self) -> object:
        self.record_call("build_frame_key")
        return None

    def create_save_point(self) -> Callable[[], None]:
        key_count = self.key_count
        return lambda: setattr(self, "key_count", key_count)

    def report_exception(self, message: str, *, in_drawing: bool) -> None:
        self.reports.append(message)


@pytest.fixture
def window(tmp_path: Path) -> Iterator[FailingWindow]:
    """A window that logs exceptions to a file in `tmp_path`."""
    with open_display(headless=True):
        pygame.event.clear()
        window = FailingWindow()
        window.guard.log = ExceptionLog(tmp_path)
        yield window


def press_key(window: FailingWindow) -> None:
    pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_a, mod=0, unicode="a", scancode=0))
    window.run_frame(0.02)


class TestEventThatRaises:
    def test_the_window_stays_open_and_the_event_is_reverted(self, window: FailingWindow) -> None:
        window.errors["handle_key"] = ValueError("embedded\nnull byte")
        press_key(window)
        assert window.key_count == 0
        assert not window.closed

    def test_the_exception_is_reported_in_one_line(self, window: FailingWindow, tmp_path: Path) -> None:
        window.errors["handle_key"] = ValueError("embedded\nnull byte")
        press_key(window)
        (report,) = window.reports
        assert report.startswith("Internal error while handling KeyDown (ValueError: embedded null byte).")
        assert str(tmp_path / LOG_FILE) in report
        assert "\n" not in report

    def test_the_exception_is_logged_with_its_traceback(self, window: FailingWindow, tmp_path: Path) -> None:
        window.errors["handle_key"] = ValueError("embedded\nnull byte")
        press_key(window)
        log = (tmp_path / LOG_FILE).read_text()
        assert "Traceback" in log
        assert "ValueError: embedded" in log

    def test_later_events_are_handled(self, window: FailingWindow) -> None:
        window.errors["handle_key"] = ValueError("embedded\nnull byte")
        press_key(window)
        window.errors.clear()
        press_key(window)
        assert window.key_count == 1


@pytest.mark.parametrize("method", ["update", "draw", "build_frame_key"])
class TestMethodThatAlwaysRaises:
    def test_it_is_rarely_called_again(self, window: FailingWindow, method: str) -> None:
        window.errors[method] = RuntimeError("always")
        for _ in range(500):
            window.run_frame(0.02)
        assert window.calls.count(method) < 20

    def test_its_exception_is_logged_once(self, window: FailingWindow, method: str, tmp_path: Path) -> None:
        window.errors[method] = RuntimeError("always")
        for _ in range(500):
            window.run_frame(0.02)
        assert (tmp_path / LOG_FILE).read_text().count("Traceback") == 1

    def test_it_is_called_again_after_some_time(self, window: FailingWindow, method: str) -> None:
        window.errors[method] = RuntimeError("always")
        for _ in range(500):
            window.run_frame(0.02)
        window.errors.clear()
        window.guard._retry_at_s.clear()
        window.calls.clear()
        window.run_frame(0.02)
        assert method in window.calls


def test_a_window_closes_although_handling_the_close_button_raises(window: FailingWindow) -> None:
    window.errors["quit"] = RuntimeError("cannot ask")
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    window.run_frame(0.02)
    assert window.closed


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, MemoryError])
def test_exceptions_that_end_a_program_are_passed_on(window: FailingWindow, error: type[Exception]) -> None:
    window.errors["handle_key"] = error()
    with pytest.raises(error):
        press_key(window)


def test_a_lost_display_ends_the_window(window: FailingWindow) -> None:
    window.errors["draw"] = pygame.error("display Surface quit")
    pygame.display.quit()
    with pytest.raises(pygame.error):
        window.run_frame(0.02)


class TestExceptionLog:
    def test_old_exceptions_are_dropped_so_that_the_log_stays_small(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(exceptions, "_MAX_LOG_BYTES", 5_000)
        log = ExceptionLog(tmp_path)
        for k in range(300):
            error = type(f"Error{k}", (Exception,), {})("x" * 500)
            log.record(error, "testing")
        files = list(tmp_path.iterdir())
        assert len(files) == 2
        assert sum(file.stat().st_size for file in files) < 12_000
        assert log.count == 300

    def test_standard_error_replaces_a_file_that_cannot_be_written(
        self, tmp_path: Path, capsys: pytest.CaptureFixture[str]
    ) -> None:
        (tmp_path / "file").write_text("")
        sentence = ExceptionLog(tmp_path / "file").record(ValueError("boom\x1b[31m"), "testing")
        assert sentence == "Internal error while testing (ValueError: boom[31m). Details: the terminal."
        assert "ValueError: boom" in capsys.readouterr().err


@pytest.mark.usefixtures("window")
class TestControlCharacters:
    @pytest.mark.parametrize("text", ["a\x00b", f"a{CONTROLS}b"], ids=["null", "all"])
    def test_pasted_text_has_only_line_breaks_and_tabs(self, text: str) -> None:
        clipboard = Clipboard()
        clipboard.put(text)
        assert clipboard.get().replace("\n", "").replace("\t", "") == "ab"

    @pytest.mark.parametrize("text", ["a\x00b", f"a{CONTROLS}b"], ids=["null", "all"])
    @pytest.mark.parametrize(
        "event_type", [pygame.TEXTINPUT, pygame.TEXTEDITING], ids=pygame.event.event_name
    )
    def test_they_are_removed_from_typed_text(self, event_type: int, text: str) -> None:
        event = clean_event(pygame.event.Event(event_type, text=text, start=0, length=0))
        assert event is not None
        assert event.text == "ab"

    def test_a_text_of_control_characters_is_ignored(self) -> None:
        assert clean_event(pygame.event.Event(pygame.TEXTINPUT, text="\x00")) is None

    def test_they_are_removed_from_the_path_of_a_dropped_file(self) -> None:
        event = clean_event(pygame.event.Event(pygame.DROPFILE, file="a\x00 b\n.json"))
        assert event is not None
        assert event.file == "a b\n.json"

    def test_they_are_removed_from_the_title_of_a_window(self) -> None:
        pygame.display.set_mode((100, 100))
        set_title(f"a{CONTROLS}b")
        assert pygame.display.get_caption()[0] == "ab"

    def test_they_are_removed_from_text_that_a_browser_pastes(self) -> None:
        clipboard = Clipboard()
        message = MESSAGES.validate_json(json.dumps({"kind": "paste", "text": "a\x00b"}))
        assert list(EventTranslator(clipboard).translate(message))
        assert clipboard.get() == "ab"

    def test_they_are_removed_from_text_typed_into_a_field(self) -> None:
        edit = TextEdit.select_all("")
        edit.type("x\x00y\tz")
        assert edit.text == "xyz"


def test_the_length_of_a_text_in_a_field_is_limited() -> None:
    edit = TextEdit.select_all("ab")
    edit.place(1)
    edit.type("xyz" * MAX_CHARS)
    assert len(edit.text) == MAX_CHARS
    assert edit.text.startswith("axyzxyz")
    assert edit.text.endswith("b")
    edit.type("more")
    assert len(edit.text) == MAX_CHARS


def test_an_edit_of_a_map_that_raises_is_reverted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_editor(tmp_path, drafts=tmp_path / "drafts") as driver:
        editor = driver.editor
        driver.window.guard.is_enabled = True
        editor.apply(add_circle(editor.sketch, (2.0, 2.0), 0.5))
        sketch = editor.sketch

        def apply_edit_and_fail(*arguments: object) -> None:
            editor.document.history.apply(add_circle(editor.sketch, (5.0, 5.0), 0.5))
            raise ZeroDivisionError("half-way")

        with monkeypatch.context() as patch:
            patch.setattr(driver.window.play_mode, "start", apply_edit_and_fail)
            patch.setattr(driver.window, "run_command", apply_edit_and_fail)
            driver.press_key("f5")
        assert editor.sketch == sketch
        assert "Internal error" in editor.message
        assert editor.has_error_message
        driver.press_key("ctrl+z")
        assert editor.sketch.obstacles == ()
        driver.press_key("ctrl+y")
        assert editor.sketch == sketch


def test_a_dialog_that_cannot_be_drawn_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with open_editor(tmp_path) as driver:
        driver.window.guard.is_enabled = True
        driver.press_key("ctrl+k")
        palette = driver.editor.dialogs.current
        assert palette is not None
        monkeypatch.setattr(palette, "show_content", Mock(side_effect=IndexError("page")))
        driver.window.run_frame(0.1)
        driver.window.run_frame(0.1)
        assert driver.editor.dialogs.current is None
        assert "IndexError" in driver.editor.message


def run_steps(session: Session, n_steps: int) -> None:
    for _ in range(n_steps):
        session.playback.step()


def get_positions(session: Session) -> np.ndarray:
    """Return a copy of the robots' positions in the first pane, (n, 2) m."""
    return session.timeline.panes[0].simulation.positions.copy()


def test_an_edit_of_a_session_that_raises_is_reverted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_viewer(tmp_path) as driver:
        session = driver.session
        driver.window.guard.is_enabled = True
        run_steps(session, 20)
        session.fail_robot(2)
        n_nodes = len(session.timeline.document.nodes)
        positions = get_positions(session)
        with monkeypatch.context() as patch:
            patch.setattr(session.timeline.history, "amend", Mock(side_effect=ZeroDivisionError("half-way")))
            driver.viewer.inspection.selected = 1
            driver.press_key("delete")
        assert "ZeroDivisionError" in driver.viewer.message
        assert session.displayed.numbers == (1, 3)
        assert len(session.timeline.document.nodes) == n_nodes
        assert (get_positions(session) == positions).all()
        run_steps(session, 30)
        expected = start_session()
        run_steps(expected, 20)
        expected.fail_robot(2)
        run_steps(expected, 30)
        assert (get_positions(session) == get_positions(expected)).all()


def test_a_step_that_raises_is_reverted_and_pauses_the_session(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_viewer(tmp_path) as driver:
        session = driver.session
        driver.window.guard.is_enabled = True
        run_steps(session, 20)
        pane = session.timeline.panes[0]
        positions = get_positions(session)
        step = pane.step

        def step_and_fail(pull: object) -> None:
            step(pull)
            raise ZeroDivisionError("half-way")

        monkeypatch.setattr(pane, "step", step_and_fail)
        session.playback.is_playing = True
        driver.run_frames(3, 0.1)
        assert not session.playback.is_playing
        assert "ZeroDivisionError" in driver.viewer.message
        assert session.timeline.panes[0].time == pytest.approx(session.timeline.end_time)
        assert (get_positions(session) == positions).all()
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
