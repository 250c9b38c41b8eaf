"""Keys that type a value for a tool, on keyboards of several countries."""

from __future__ import annotations

from types import SimpleNamespace

import pygame
import pytest

from robocov_app.editor.ui.typed_values import edit_typed_value

ALT_GR_ON_WINDOWS = pygame.KMOD_LCTRL | pygame.KMOD_RALT


def press_key(character: str, modifiers: int) -> str | None:
    """Press a key while a tool is in use, and return the typed value; None if the key was not used."""
    tool = SimpleNamespace(accepts_text=True, is_busy=True, starts_with_text=True)
    editor = SimpleNamespace(typed="", tool=tool)
    event = pygame.event.Event(pygame.KEYDOWN, key=pygame.K_q, mod=modifiers, unicode=character, scancode=0)
    is_used = edit_typed_value(editor, event)
    return editor.typed if is_used else None


@pytest.mark.parametrize(
    "modifiers", [0, pygame.KMOD_MODE, pygame.KMOD_LALT, pygame.KMOD_RALT, ALT_GR_ON_WINDOWS]
)
def test_symbols_are_typed_with_alt_option_or_alt_gr(modifiers: int) -> None:
    assert press_key("@", modifiers) == "@"


@pytest.mark.parametrize(
    ("character", "modifiers"),
    [
        ("1", pygame.KMOD_LALT),
        ("x", pygame.KMOD_LALT),
        ("-", pygame.KMOD_LCTRL),
        ("-", pygame.KMOD_LCTRL | pygame.KMOD_LALT),
        ("-", pygame.KMOD_RCTRL | pygame.KMOD_RALT),
        ("-", pygame.KMOD_LMETA),
    ],
)
def test_keys_of_commands_are_not_typed(character: str, modifiers: int) -> None:
    assert press_key(character, modifiers) is None
