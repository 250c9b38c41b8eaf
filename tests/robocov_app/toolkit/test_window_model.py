"""Messages and actions of a window, without the window."""

from __future__ import annotations

from pathlib import Path

import pytest

from robocov.errors import MapError
from robocov_app.toolkit.window.window_model import MESSAGE_S, WindowModel


class PatientModel(WindowModel):
    """A model that shows errors twice as long as other messages."""

    error_message_s = 2 * MESSAGE_S


def fail(error: Exception) -> None:
    raise error


def test_errors_may_be_shown_longer_than_other_messages() -> None:
    model = PatientModel()
    model.show_message("saved")
    model.pass_time(MESSAGE_S + 0.1)
    assert model.message == ""
    model.show_message("not saved", is_error=True)
    model.pass_time(MESSAGE_S + 0.1)
    assert model.message == "Not saved"
    model.pass_time(MESSAGE_S)
    assert model.message == ""


def test_an_empty_message_leaves_the_present_one() -> None:
    model = WindowModel()
    model.show_message("saved")
    model.show_message("")
    assert model.message == "Saved"


def test_actions_show_their_message_or_their_error() -> None:
    model = WindowModel()
    model.attempt(lambda: "done")
    assert (model.message, model.has_error_message, model.revision) == ("Done", False, 1)
    model.attempt(lambda: fail(MapError("map: too small")))
    assert (model.message, model.has_error_message, model.revision) == ("Map: too small", True, 2)
    model.attempt(lambda: fail(PermissionError(13, "Permission denied", "map.json")))
    assert model.has_error_message
    assert "map.json" in model.message
    model.attempt(lambda: None)
    assert "map.json" in model.message


def test_messages_omit_the_hidden_folder_from_paths(tmp_path: Path) -> None:
    model = WindowModel()
    file = tmp_path / "lab" / "rooms-1.robocov"
    model.show_message(f"session saved: {file}")
    assert str(file) in model.message
    model.hidden_folder = tmp_path
    model.show_message(f"session saved: {file}")
    assert model.message == "Session saved: lab/rooms-1.robocov"
    model.attempt(lambda: fail(MapError(f"{file}: not found")))
    assert model.message == "lab/rooms-1.robocov: not found"


def test_a_relative_hidden_folder_is_omitted_in_every_spelling(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    model = WindowModel()
    for folder in (Path(), Path("lab"), tmp_path / "link"):
        model.hidden_folder = folder
        for spelling in (folder, folder.absolute(), folder.resolve()):
            path = spelling / "rooms.json"
            assert model.shorten_paths(f"map opened: {path}") == "map opened: rooms.json"
    model.hidden_folder = Path()
    assert model.shorten_paths("../other/rooms.json") == "../other/rooms.json"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("wall drawn; the team is split into 2 groups", "Wall drawn; the team is split into 2 groups"),
        ("undone: robot 2 failed", "Undone: robot 2 failed"),
        ("rooms.json: walls: expected a list", "rooms.json: walls: expected a list"),
        ("k_rep: expected a number", "k_rep: expected a number"),
        ("“trap” opened", "“trap” opened"),
        ("2 robots failed", "2 robots failed"),
    ],
)
def test_messages_are_in_sentence_case_but_names_are_not_changed(text: str, shown: str) -> None:
    model = WindowModel()
    model.show_message(text)
    assert model.message == shown
