"""Settings of the viewer: saved, loaded and merged."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.storage.settings import (
    FOLDER_VARIABLE,
    find_settings_file,
    load_settings,
    merge_changed_settings,
    save_changed_settings,
    save_settings,
)
from robocov_app.viewer.launch import ViewerSettings

load_window_settings = partial(load_settings, ViewerSettings)

CHANGED = ViewerSettings(
    theme="dark", scale=2.0, width=1600, height=900, shown=("cells", "robots"), tab="robot", fade=True
)


def test_saved_settings_are_loaded(tmp_path):
    file = tmp_path / "a" / "folder" / "window.json"
    assert save_settings(CHANGED, file) == ""
    assert load_window_settings(file) == (CHANGED, "")
    assert [path.name for path in file.parent.iterdir()] == ["window.json"]
    assert save_settings(ViewerSettings(), file) == ""
    assert load_window_settings(file) == (ViewerSettings(), "")


@given(
    st.builds(
        ViewerSettings,
        theme=st.sampled_from(["light", "dark"]),
        scale=st.none() | st.floats(0.5, 4.0),
        width=st.integers(900, 7680),
        height=st.integers(600, 4320),
        shown=st.none() | st.lists(st.text(), max_size=4).map(tuple),
        tab=st.text(),
        fade=st.booleans(),
    )
)
def test_any_settings_are_restored_from_json(settings):
    assert ViewerSettings.model_validate_json(settings.model_dump_json()) == settings


def test_missing_settings_have_the_defaults(tmp_path):
    assert load_window_settings(tmp_path / "window.json") == (ViewerSettings(), "")
    assert load_window_settings(None) == (ViewerSettings(), "")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        '{"theme": "pink"}',
        '{"scale": 0.1}',
        '{"scale": NaN}',
        '{"width": 10}',
        '{"width": "wide"}',
        '{"shown": 3}',
        "\x00",
    ],
)
def test_unreadable_settings_are_reported_and_replaced(tmp_path, text):
    file = tmp_path / "window.json"
    file.write_text(text)
    settings, message = load_window_settings(file)
    assert settings == ViewerSettings()
    assert message == f"{file} cannot be read; using default settings"
    # The next save replaces the file.
    assert save_settings(settings, file) == ""
    assert load_window_settings(file) == (ViewerSettings(), "")


def test_files_that_are_not_text_are_ignored(tmp_path):
    file = tmp_path / "window.json"
    file.write_bytes(b'{"tab": "\xff\xfe"}')
    assert load_window_settings(file)[0] == ViewerSettings()


def test_a_folder_instead_of_the_file_is_reported(tmp_path):
    (tmp_path / "window.json").mkdir()
    settings, message = load_window_settings(tmp_path / "window.json")
    assert settings == ViewerSettings()
    assert "cannot be read" in message
    assert save_settings(ViewerSettings(), tmp_path / "window.json").startswith("settings cannot be saved: ")


def test_unknown_settings_are_ignored(tmp_path):
    file = tmp_path / "window.json"
    file.write_text(json.dumps({"theme": "dark", "unknown": [1, 2]}))
    assert load_window_settings(file) == (ViewerSettings(theme="dark"), "")


def test_errors_while_saving_are_reported(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    message = save_settings(CHANGED, blocked / "window.json")
    assert message.startswith("settings cannot be saved: ")
    assert "\n" not in message
    assert blocked.read_text() == "not a folder"
    assert save_settings(CHANGED, None) == ""


def test_the_file_is_in_the_folder_of_the_environment_variable_or_the_user(tmp_path, monkeypatch):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    assert find_settings_file() == tmp_path / "window.json"
    monkeypatch.setenv(FOLDER_VARIABLE, "")
    assert find_settings_file() is None
    monkeypatch.delenv(FOLDER_VARIABLE)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    file = find_settings_file()
    assert file is not None
    assert file.name == "window.json"
    assert "robocov" in file.parts
    assert not Path(tmp_path / "config").exists()


def test_only_settings_changed_in_the_window_are_saved():
    saved = ViewerSettings(width=1000)
    opened = ViewerSettings(theme="dark", width=1300)
    assert merge_changed_settings(saved, opened, opened) == saved
    closed = opened.model_copy(update={"fade": True, "width": 1400})
    assert merge_changed_settings(saved, opened, closed) == ViewerSettings(width=1400, fade=True)


class ChangedWindow:
    """A window whose settings a test changes while it is open."""

    def __init__(self) -> None:
        self.changes: dict[str, object] = {}

    def read(self, settings: ViewerSettings) -> ViewerSettings:
        return settings.model_copy(update=self.changes)


def test_a_window_keeps_the_settings_that_another_one_has_saved(tmp_path):
    file = tmp_path / "window.json"
    assert save_settings(ViewerSettings(), file) == ""
    settings, _ = load_window_settings(file)
    first = ChangedWindow()
    second = ChangedWindow()
    with save_changed_settings(settings, file, second.read):
        with save_changed_settings(settings, file, first.read):
            first.changes["theme"] = "dark"
        second.changes["width"] = 1400
    assert load_window_settings(file) == (ViewerSettings(theme="dark", width=1400), "")
    with save_changed_settings(settings, file, lambda settings: settings):
        pass
    assert load_window_settings(file) == (ViewerSettings(theme="dark", width=1400), "")


def test_the_first_window_saves_its_settings_even_if_nothing_changes(tmp_path):
    file = tmp_path / "window.json"
    with save_changed_settings(ViewerSettings(), file, lambda settings: settings):
        pass
    assert load_window_settings(file) == (ViewerSettings(), "")


def test_an_unreadable_file_is_kept_when_settings_are_saved(tmp_path):
    file = tmp_path / "window.json"
    text = '{"theme": "dark",}'
    file.write_text(text)
    settings, _ = load_window_settings(file)
    window = ChangedWindow()
    with save_changed_settings(settings, file, window.read):
        pass
    assert file.read_text() == text
    with save_changed_settings(settings, file, window.read):
        window.changes["width"] = 1400
    assert load_window_settings(file) == (ViewerSettings(width=1400), "")
    assert (tmp_path / "window.json.bak").read_text() == text
