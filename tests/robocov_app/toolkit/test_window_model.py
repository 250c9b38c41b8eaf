"""Messages and actions of a window, without the window."""

from __future__ import annotations

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
    assert model.message == "not saved"
    model.pass_time(MESSAGE_S)
    assert model.message == ""


def test_an_empty_message_leaves_the_present_one() -> None:
    model = WindowModel()
    model.show_message("saved")
    model.show_message("")
    assert model.message == "saved"


def test_actions_show_their_message_or_their_error() -> None:
    model = WindowModel()
    model.attempt(lambda: "done")
    assert (model.message, model.has_error_message, model.revision) == ("done", False, 1)
    model.attempt(lambda: fail(MapError("map: too small")))
    assert (model.message, model.has_error_message, model.revision) == ("map: too small", True, 2)
    model.attempt(lambda: fail(PermissionError(13, "Permission denied", "map.json")))
    assert model.has_error_message
    assert "map.json" in model.message
    model.attempt(lambda: None)
    assert "map.json" in model.message
