"""Validation of messages from a page, and their translation to pygame events."""

import unicodedata
from collections.abc import Iterator
from typing import Annotated, Literal

import pygame
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter
from pygame.event import Event

from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.input import COMMAND_EVENT

MIN_PAGE_SIDE_PX = 200
NARROW_PAGE_PX = 700
"""Width in CSS pixels below which a page is small."""
LOW_PAGE_PX = 440
"""Height in CSS pixels below which a page is small."""
MAX_PAGE_SIDE_PX = 7680
MAX_PAGE_PIXELS = 4096 * 2304
MAX_UPLOAD_BYTES = 1 << 24
MAX_FILE_NAME_CHARACTERS = 300
"""More than any file system allows, so that names that are too long are rejected with a message."""
_STRIPPED_CATEGORIES = ("Cc", "Cs")


def strip_controls(text: str, keep: str = "") -> str:
    """Remove control characters such as NUL, escape and delete.

    Parameters
    ----------
    text : str
        Text from a page.
    keep : str
        Control characters to keep, such as line breaks in pasted text.

    Returns
    -------
    str
        The text without characters of Unicode's categories Cc (control) and Cs (surrogate).
    """
    return "".join(
        character
        for character in text
        if character in keep or unicodedata.category(character) not in _STRIPPED_CATEGORIES
    )


def _strip_lines(text: str) -> str:
    """Remove control characters except tabs and line breaks; all line breaks become line feeds."""
    return strip_controls(text.replace("\r\n", "\n").replace("\r", "\n"), keep="\n\t")


_Line = AfterValidator(strip_controls)
_Lines = AfterValidator(_strip_lines)
_Pixel = Annotated[float, Field(ge=-1e5, le=1e5)]
_Notches = Annotated[float, Field(ge=-100.0, le=100.0)]


class _Message(BaseModel):
    """A message from a page; unknown fields and numbers that are not finite are rejected."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _HeldMessage(_Message):
    """A message with the modifier keys that are held."""

    held: int = Field(default=0, ge=0, le=15)  # sum of Shift 1, Ctrl 2, Alt 4, Meta 8


class PointerMessage(_HeldMessage):
    """A message with the position of the pointer, in pixels of the frame that the page shows."""

    x: _Pixel
    y: _Pixel


class PointerMoved(PointerMessage):
    """The pointer has moved while `button` was held; 0 for none."""

    kind: Literal["move"]
    button: int = Field(default=0, ge=0, le=3)


class ButtonChanged(PointerMessage):
    """A mouse button is pressed or released."""

    kind: Literal["button"]
    button: int = Field(ge=1, le=3)
    down: bool


class WheelTurned(PointerMessage):
    """The wheel is turned by a number of notches."""

    kind: Literal["wheel"]
    right: _Notches = 0.0
    up: _Notches


class KeyChanged(_HeldMessage):
    """A key is pressed or released; `key` is its name in browsers, empty if it was a control character."""

    kind: Literal["key"]
    key: Annotated[str, Field(min_length=1, max_length=20), _Line]
    down: bool


class TextTyped(_Message):
    """Text is entered by other means than single keys: on a phone, or with an input method."""

    kind: Literal["text"]
    text: Annotated[str, Field(max_length=1000), _Lines]


class TextPasted(_Message):
    """Text is pasted from the clipboard of the user in control."""

    kind: Literal["paste"]
    text: Annotated[str, Field(max_length=100_000), _Lines]


class PointerLeft(_Message):
    """The pointer has left the page."""

    kind: Literal["leave"]
    held: Literal[0] = 0


class CommandChosen(_Message):
    """A button of the page has been pressed that runs a command of the window."""

    kind: Literal["command"]
    name: Annotated[str, Field(min_length=1, max_length=40), _Line]
    held: Literal[0] = 0


class FocusLost(_Message):
    """The page has lost the keyboard focus."""

    kind: Literal["blur"]
    held: Literal[0] = 0


class PageChanged(_Message):
    """The page reports its size and resolution, and the preferences of its user.

    `width` and `height` are in device pixels; `ratio` is the number of device pixels per CSS pixel; `touch`
    is true if the main pointer is a finger.
    """

    kind: Literal["page"]
    width: int = Field(ge=MIN_PAGE_SIDE_PX, le=MAX_PAGE_SIDE_PX)
    height: int = Field(ge=MIN_PAGE_SIDE_PX, le=MAX_PAGE_SIDE_PX)
    ratio: float = Field(ge=0.25, le=8.0)
    dark: bool
    reduced_motion: bool = False
    touch: bool = False

    @property
    def is_small(self) -> bool:
        """Whether the page is as small as that of a phone, in portrait or landscape."""
        return self.width < NARROW_PAGE_PX * self.ratio or self.height < LOW_PAGE_PX * self.ratio

    @property
    def is_compact(self) -> bool:
        """Whether the page is that of a phone, which has buttons for the window."""
        return self.touch and self.is_small


class FrameShown(_Message):
    """The page has shown a frame."""

    kind: Literal["shown"]
    number: int = Field(ge=0, lt=2**32)


class ControlPassed(_Message):
    """Control is handed to the page with a number; 0 requests control."""

    kind: Literal["control"]
    to: int = Field(ge=0, lt=2**31)


class NameEntered(_Message):
    """The user of a page has entered a name."""

    kind: Literal["name"]
    name: Annotated[str, Field(max_length=40), _Line]


class UploadStarted(_Message):
    """A file follows in binary messages; its size is in bytes."""

    kind: Literal["upload"]
    name: Annotated[str, Field(max_length=MAX_FILE_NAME_CHARACTERS), _Line]
    size: int = Field(ge=0, le=MAX_UPLOAD_BYTES)


class Uploaded(_Message):
    """An uploaded file was saved on the server and should be opened in the window."""

    kind: Literal["uploaded"] = "uploaded"
    path: str


InputMessage = (
    PointerMoved
    | ButtonChanged
    | WheelTurned
    | KeyChanged
    | TextTyped
    | TextPasted
    | CommandChosen
    | PointerLeft
    | FocusLost
)
"""Messages with input for a window."""
Message = InputMessage | PageChanged | FrameShown | ControlPassed | NameEntered | UploadStarted
MESSAGES: TypeAdapter[Message] = TypeAdapter(Annotated[Message, Field(discriminator="kind")])
_KEYS_WITH_SAME_NAME = [
    *("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"),
    *("Escape", "Backspace", "Tab", "Delete", "Insert"),
    *(f"F{number}" for number in range(1, 13)),
]
_KEYS = {
    **{name: getattr(pygame, f"K_{name.removeprefix('Arrow').upper()}") for name in _KEYS_WITH_SAME_NAME},
    "Enter": pygame.K_RETURN,
    "Shift": pygame.K_LSHIFT,
    "Control": pygame.K_LCTRL,
    "Alt": pygame.K_LALT,
    "Meta": pygame.K_LMETA,
}
"""pygame's key codes by the names of keys in browsers."""
# pygame identifies a key by its character without Shift, browsers by the character it produces (US layout).
_UNSHIFTED = str.maketrans('!@#$%^&*()_+{}|:"<>?~', "1234567890-=[]\\;',./`")
_CHARACTER_KEYS = {"\n": "Enter", "\t": "Tab"}
"""Keys for characters that the on-screen keyboard of a phone sends as text instead of key presses."""
_SHIFT = 0b0001
_CTRL = 0b0010
_CTRL_OR_META = 0b1010
_MODIFIERS = (pygame.KMOD_LSHIFT, pygame.KMOD_LCTRL, pygame.KMOD_LALT, pygame.KMOD_LMETA)
"""pygame's modifiers, in the order of the bits of `held`."""


class EventTranslator:
    """Translates messages from a page to pygame events; keeps track of the pointer and the pressed button.

    Parameters
    ----------
    clipboard : Clipboard
        Clipboard that receives text pasted in the page.
    """

    def __init__(self, clipboard: Clipboard) -> None:
        self._clipboard = clipboard
        self._position = (0, 0)
        self._pressed_button = 0

    def translate(self, message: InputMessage | Uploaded) -> Iterator[Event]:
        """Yield the pygame events that correspond to a message."""
        match message:
            case PointerMoved():
                yield self._move(message.x, message.y, message.button)
            case ButtonChanged():
                yield from self._change_button(message)
            case WheelTurned():
                yield self._move(message.x, message.y, 0)
                yield Event(
                    pygame.MOUSEWHEEL,
                    x=round(message.right),
                    y=round(message.up),
                    precise_x=message.right,
                    precise_y=message.up,
                    flipped=False,
                    touch=False,
                )
            case KeyChanged():
                yield from _translate_key(message)
            case TextTyped():
                for character in message.text:
                    yield from _press_key(_CHARACTER_KEYS.get(character, character))
            case TextPasted():
                self._clipboard.put(message.text)
                yield from _press_key("v", held=_CTRL)
            case Uploaded():
                yield Event(pygame.DROPFILE, file=message.path)
            case CommandChosen():
                yield Event(COMMAND_EVENT, name=message.name)
            case PointerLeft():
                yield Event(pygame.WINDOWLEAVE)
            case FocusLost():
                yield from self._release_button()
                yield Event(pygame.WINDOWFOCUSLOST)

    def _change_button(self, message: ButtonChanged) -> Iterator[Event]:
        """Yield the motion to the pointer, and the press or release of a button there."""
        if message.down:
            yield self._move(message.x, message.y, 0)
            self._pressed_button = message.button
            kind = pygame.MOUSEBUTTONDOWN
        else:
            yield self._move(message.x, message.y, message.button)
            self._pressed_button = 0
            kind = pygame.MOUSEBUTTONUP
        yield Event(kind, pos=self._position, button=message.button, touch=False)

    def _release_button(self) -> Iterator[Event]:
        """Release the pressed button, because without the focus the page will not notice its release."""
        if self._pressed_button:
            yield Event(pygame.MOUSEBUTTONUP, pos=self._position, button=self._pressed_button, touch=False)
            self._pressed_button = 0

    def _move(self, x: float, y: float, button: int) -> Event:
        """Return the motion of the pointer to a position, px, with the number of the held button, or 0."""
        previous_x, previous_y = self._position
        self._position = (round(x), round(y))
        return Event(
            pygame.MOUSEMOTION,
            pos=self._position,
            rel=(self._position[0] - previous_x, self._position[1] - previous_y),
            buttons=tuple(int(button == number) for number in (1, 2, 3)),
            touch=False,
        )


def get_modifiers(held: int) -> int:
    """Return pygame's modifier mask for the bits in `held` of a message."""
    return sum(modifier for bit, modifier in enumerate(_MODIFIERS) if held >> bit & 1)


def _press_key(name: str, held: int = 0) -> Iterator[Event]:
    """Yield the events of a key press and its release."""
    yield from _translate_key(KeyChanged(kind="key", key=name, down=True, held=held))
    yield from _translate_key(KeyChanged(kind="key", key=name, down=False, held=held))


def _translate_key(message: KeyChanged) -> Iterator[Event]:
    """Yield the key event of a message, and for a character without Ctrl or Meta the text event."""
    name = message.key
    if not name:
        return
    is_character = len(name) == 1
    if name not in _KEYS and not is_character:
        return  # A key that the window does not use.
    text = name if is_character and not message.held & _CTRL_OR_META else ""
    yield Event(
        pygame.KEYDOWN if message.down else pygame.KEYUP,
        key=_get_key_code(name, message.held),
        mod=get_modifiers(message.held),
        unicode=text,
        scancode=0,
    )
    if message.down and text:
        yield Event(pygame.TEXTINPUT, text=text)


def _get_key_code(name: str, held: int) -> int:
    """Return pygame's code of a key with a given name in browsers; 0 for a character without a key."""
    if name in _KEYS:
        return int(_KEYS[name])
    character = name.lower()
    if held & _SHIFT:
        character = character.translate(_UNSHIFTED)
    # pygame's code of a character key is the character's code point.
    return ord(character) if len(character) == 1 and character.isascii() else 0
