"""Values that the user types for a tool, for example while drawing."""

import pygame

from robocov_app.editor.editor import Editor
from robocov_app.toolkit.window.input import get_key_name

MAX_TYPED_CHARACTERS = 40
_VALUE_CHARACTERS = frozenset("0123456789.,-+@<*/%°×x; ")
_UNIT_CHARACTERS = frozenset("mcm'\"rad")  # only after the first character
_INVALID_FIRST_CHARACTERS = frozenset("x×*/ ;%")
_INVALID_FIRST_CHARACTERS_WHEN_IDLE = frozenset("x×*/ ;%,-+@<°")
_SYMBOLS = frozenset(".,-+@<*/%°×;")
"""Characters of a value for which some keyboards need Alt, Option or AltGr."""
_COMMAND_MODIFIERS = pygame.KMOD_CTRL | pygame.KMOD_META | pygame.KMOD_ALT


def edit_typed_value(editor: Editor, event: pygame.event.Event) -> bool:
    """Edit the value that is being typed for the tool with a key; return whether the key was used."""
    if not _accepts_text(editor) or _is_command(event):
        return False
    text = editor.typed
    key = get_key_name(event)
    if text and key in ("return", "enter"):
        editor.typed = ""
        editor.attempt(lambda: editor.tool.enter_text(editor, text))
        return True
    if text and key == "backspace":
        editor.typed = text[:-1]
        return True
    if text and key == "tab":
        editor.typed = f"{text} "
        return True
    if _continues_value(editor, event.unicode):
        editor.typed = (text + event.unicode)[:MAX_TYPED_CHARACTERS]
        return True
    return False


def _is_command(event: pygame.event.Event) -> bool:
    """Return whether a key is pressed with a modifier of commands, rather than to type a symbol."""
    modifiers = event.mod & _COMMAND_MODIFIERS
    if event.unicode in _SYMBOLS:
        modifiers &= ~pygame.KMOD_ALT
        if event.mod & pygame.KMOD_RALT:
            # Windows reports AltGr as the left Ctrl and the right Alt key.
            modifiers &= ~pygame.KMOD_LCTRL
    return bool(modifiers)


def _accepts_text(editor: Editor) -> bool:
    tool = editor.tool
    if not tool.accepts_text:
        return False
    return tool.is_busy or tool.starts_with_text or bool(editor.typed)


def _continues_value(editor: Editor, character: str) -> bool:
    """Return whether a character can follow the text typed so far.

    Fewer characters can begin a value while the tool is idle, because others are keys of commands.
    """
    if len(character) != 1:
        return False
    if editor.typed:
        return character in _VALUE_CHARACTERS or character in _UNIT_CHARACTERS
    invalid_characters = (
        _INVALID_FIRST_CHARACTERS if editor.tool.is_busy else _INVALID_FIRST_CHARACTERS_WHEN_IDLE
    )
    return character in _VALUE_CHARACTERS and character not in invalid_characters
