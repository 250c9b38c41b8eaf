"""Messages from a page: their validation, and the events of the window that they become."""

import json
import unicodedata

import pygame
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.input import get_key_name
from robocov_app.web.events import (
    MESSAGES,
    ControlPassed,
    EventTranslator,
    FrameShown,
    NameEntered,
    PageChanged,
    UploadStarted,
)

MESSAGES_WITHOUT_EVENTS = (PageChanged, FrameShown, ControlPassed, NameEntered, UploadStarted)


def parse_message(**message):
    return MESSAGES.validate_json(json.dumps(message))


@pytest.mark.parametrize(
    ("key", "held", "name"),
    [
        ("z", 2, "ctrl+z"),
        ("Z", 3, "ctrl+shift+z"),
        ("?", 1, "shift+/"),
        ("ArrowLeft", 0, "left"),
        ("PageUp", 0, "page up"),
        ("F5", 0, "f5"),
        (" ", 0, "space"),
        ("+", 0, "+"),
        ("+", 1, "shift+="),
        ("Enter", 0, "return"),
        ("Escape", 0, "escape"),
        ("k", 8, "ctrl+k"),
        ("!", 1, "shift+1"),
    ],
)
def test_keys_of_a_page_have_the_names_of_the_windows_keys(key, held, name):
    message = parse_message(kind="key", key=key, down=True, held=held)
    event = next(EventTranslator(Clipboard()).translate(message))
    assert get_key_name(event) == name


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=5,
)
FIELDS = st.sampled_from(
    "x y held button down key text right up width height ratio dark number to name size".split()
)
KINDS = st.sampled_from(
    "move button wheel key text paste leave blur page shown control name upload what".split()
)


@given(KINDS, st.dictionaries(FIELDS, JSON_VALUES))
def test_arbitrary_messages_are_translated_or_raise_value_errors(kind, fields):
    try:
        message = parse_message(**fields, kind=kind)
    except ValueError:
        return
    if isinstance(message, MESSAGES_WITHOUT_EVENTS):
        return
    for event in EventTranslator(Clipboard()).translate(message):
        assert event.type


def test_a_held_button_is_released_when_the_page_loses_focus():
    translator = EventTranslator(Clipboard())

    def translate(**message):
        return [event.type for event in translator.translate(parse_message(**message))]

    translate(kind="button", x=5, y=6, button=1, down=True)
    assert translate(kind="blur") == [pygame.MOUSEBUTTONUP, pygame.WINDOWFOCUSLOST]
    assert translate(kind="blur") == [pygame.WINDOWFOCUSLOST]


TEXT_WITH_CONTROLS = "a\0b\x1b[31m\x7f\x85\r\nc\td"


@pytest.mark.parametrize(
    ("message", "field", "expected"),
    [
        ({"kind": "paste", "text": TEXT_WITH_CONTROLS}, "text", "ab[31m\nc\td"),
        ({"kind": "text", "text": TEXT_WITH_CONTROLS}, "text", "ab[31m\nc\td"),
        ({"kind": "name", "name": TEXT_WITH_CONTROLS}, "name", "ab[31mcd"),
        ({"kind": "key", "key": "\0", "down": True}, "key", ""),
        ({"kind": "key", "key": "a\0", "down": True}, "key", "a"),
        ({"kind": "upload", "name": "\0a.json", "size": 1}, "name", "a.json"),
    ],
)
def test_control_characters_are_removed_from_messages(message, field, expected):
    assert getattr(parse_message(**message), field) == expected


def has_control_characters(text, allowed=""):
    return any(unicodedata.category(character) == "Cc" and character not in allowed for character in text)


TEXTS_WITH_CONTROLS = st.text(
    st.characters(categories=["Cc", "Zl", "Zp", "Cf", "Ll"]), min_size=1, max_size=20
)


@given(TEXTS_WITH_CONTROLS, st.sampled_from(["paste", "text", "key"]))
def test_events_and_the_clipboard_contain_no_control_characters(text, kind):
    if kind == "key":
        message = parse_message(kind=kind, key=text, down=True)
    else:
        message = parse_message(kind=kind, text=text)
    clipboard = Clipboard()
    for event in EventTranslator(clipboard).translate(message):
        assert not has_control_characters(getattr(event, "unicode", ""))
        assert not has_control_characters(getattr(event, "text", ""))
    if kind == "paste":
        assert not has_control_characters(clipboard.get(), allowed="\n\t")


def test_a_line_break_in_text_from_a_phone_presses_return():
    message = parse_message(kind="text", text="7\n")
    events = EventTranslator(Clipboard()).translate(message)
    keys = [event.key for event in events if event.type == pygame.KEYDOWN]
    assert keys == [pygame.K_7, pygame.K_RETURN]
