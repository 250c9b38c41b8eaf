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
    save_settings,
)
from robocov_app.viewer.launch import ViewerSettings

load_window_settings = partial(load_settings, ViewerSettings)

OTHERS = ViewerSettings(
    theme="dark", scale=2.0, width=1600, height=900, shown=("cells", "robots"), tab="robot", fade=True
)


def test_what_is_saved_is_loaded(tmp_path):
    file = tmp_path / "a" / "folder" / "window.json"
    assert save_settings(OTHERS, file) == ""
    assert load_window_settings(file) == (OTHERS, "")
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
def test_whatever_they_are_they_come_back(settings):
    assert ViewerSettings.model_validate_json(settings.model_dump_json()) == settings


def test_the_first_time_there_are_none(tmp_path):
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
def test_what_cannot_be_read_is_told_and_left_out(tmp_path, text):
    file = tmp_path / "window.json"
    file.write_text(text)
    settings, words = load_window_settings(file)
    assert settings == ViewerSettings()
    assert words == f"{file} cannot be read; using default settings"
    # and is put right the next time
    assert save_settings(settings, file) == ""
    assert load_window_settings(file) == (ViewerSettings(), "")


def test_bytes_that_are_no_text(tmp_path):
    file = tmp_path / "window.json"
    file.write_bytes(b'{"tab": "\xff\xfe"}')
    assert load_window_settings(file)[0] == ViewerSettings()


def test_a_folder_in_its_place(tmp_path):
    (tmp_path / "window.json").mkdir()
    settings, words = load_window_settings(tmp_path / "window.json")
    assert settings == ViewerSettings()
    assert "cannot be read" in words
    assert save_settings(ViewerSettings(), tmp_path / "window.json").startswith("settings cannot be saved: ")


def test_settings_of_other_versions(tmp_path):
    file = tmp_path / "window.json"
    file.write_text(json.dumps({"theme": "dark", "of_tomorrow": [1, 2]}))
    assert load_window_settings(file) == (ViewerSettings(theme="dark"), "")


def test_what_cannot_be_written_is_told(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    words = save_settings(OTHERS, blocked / "window.json")
    assert words.startswith("settings cannot be saved: ")
    assert "\n" not in words
    assert blocked.read_text() == "in the way"
    assert save_settings(OTHERS, None) == ""


def test_where_they_are_kept(tmp_path, monkeypatch):
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


def test_only_what_was_changed_is_kept():
    before, opened = ViewerSettings(width=1000), ViewerSettings(theme="dark", width=1300)
    assert merge_changed_settings(before, opened, opened) == before
    closed = opened.model_copy(update={"fade": True, "width": 1400})
    assert merge_changed_settings(before, opened, closed) == ViewerSettings(width=1400, fade=True)
