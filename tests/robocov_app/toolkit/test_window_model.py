"""Messages and actions of a window, without the window."""

from __future__ import annotations

from pathlib import Path

import pytest

from robocov.errors import MapError
from robocov_app.toolkit.window.window_model import MESSAGE_S, WindowModel


class PatientModel(WindowModel):
    """A model that shows errors twice as long as other messages."""

    error_message_s = 2 * MESSAGE_S


def raise_error(error: Exception) -> None:
    raise error


def test_messages_disappear_after_some_seconds() -> None:
    model = PatientModel()
    model.show_message("saved")
    model.pass_time(MESSAGE_S + 0.1)
    assert model.message == ""


def test_errors_can_be_shown_longer_than_other_messages() -> None:
    model = PatientModel()
    model.show_message("not saved", is_error=True)
    model.pass_time(MESSAGE_S + 0.1)
    assert model.message == "Not saved"
    model.pass_time(MESSAGE_S)
    assert model.message == ""


def test_an_empty_message_keeps_the_previous_one() -> None:
    model = WindowModel()
    model.show_message("saved")
    model.show_message("")
    assert model.message == "Saved"


class TestActions:
    def test_an_action_shows_the_message_that_it_returns(self) -> None:
        model = WindowModel()
        model.attempt(lambda: "done")
        assert model.message == "Done"
        assert not model.has_error_message

    def test_an_error_of_an_action_is_shown(self) -> None:
        model = WindowModel()
        model.attempt(lambda: raise_error(MapError("map: too small")))
        assert model.message == "Map: too small"
        assert model.has_error_message

    def test_an_error_of_the_operating_system_is_shown_with_its_file(self) -> None:
        model = WindowModel()
        model.attempt(lambda: raise_error(PermissionError(13, "Permission denied", "map.json")))
        assert "map.json" in model.message
        assert model.has_error_message

    def test_each_action_increments_the_revision(self) -> None:
        model = WindowModel()
        model.attempt(lambda: "done")
        assert model.revision == 1
        model.attempt(lambda: raise_error(MapError("map: too small")))
        assert model.revision == 2

    def test_an_action_without_a_message_keeps_the_previous_one(self) -> None:
        model = WindowModel()
        model.attempt(lambda: "done")
        model.attempt(lambda: None)
        assert model.message == "Done"


class TestHiddenFolder:
    def test_messages_have_whole_paths_by_default(self, tmp_path: Path) -> None:
        model = WindowModel()
        path = tmp_path / "lab" / "rooms-1.robocov"
        model.show_message(f"session saved: {path}")
        assert str(path) in model.message

    def test_messages_omit_the_hidden_folder(self, tmp_path: Path) -> None:
        model = WindowModel()
        model.hidden_folder = tmp_path
        path = tmp_path / "lab" / "rooms-1.robocov"
        model.show_message(f"session saved: {path}")
        assert model.message == "Session saved: lab/rooms-1.robocov"

    def test_errors_omit_the_hidden_folder(self, tmp_path: Path) -> None:
        model = WindowModel()
        model.hidden_folder = tmp_path
        path = tmp_path / "lab" / "rooms-1.robocov"
        model.attempt(lambda: raise_error(MapError(f"{path}: not found")))
        assert model.message == "lab/rooms-1.robocov: not found"

    @pytest.mark.parametrize(
        ("name", "is_absolute"),
        [("", False), ("lab", False), ("link", True)],
        ids=["here", "lab", "absolute"],
    )
    def test_relative_absolute_and_resolved_paths_are_shortened(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, is_absolute: bool
    ) -> None:
        monkeypatch.chdir(tmp_path)
        folder = tmp_path / name if is_absolute else Path(name)
        model = WindowModel()
        model.hidden_folder = folder
        for spelling in (folder, folder.absolute(), folder.resolve()):
            path = spelling / "rooms.json"
            assert model.shorten_paths(f"map opened: {path}") == "map opened: rooms.json"

    def test_paths_outside_the_hidden_folder_are_not_shortened(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        model = WindowModel()
        model.hidden_folder = Path()
        assert model.shorten_paths("../other/rooms.json") == "../other/rooms.json"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("wall drawn; the team is split into 2 groups", "Wall drawn; the team is split into 2 groups"),
        ("undone: robot 2 failed", "Undone: robot 2 failed"),
        ("rooms.json: walls: expected a list", "rooms.json: walls: expected a list"),
        ("k_rep: expected a number", "k_rep: expected a number"),
        ("“trap” opened", "“trap” opened"),
        ("2 robots failed", "2 robots failed"),
    ],
)
def test_messages_are_in_sentence_case_but_names_are_not_changed(text: str, message: str) -> None:
    model = WindowModel()
    model.show_message(text)
    assert model.message == message
