"""Messages of a page, checked; and pygame's events made of them."""

import unicodedata
from collections.abc import Iterator
from typing import Annotated, Any, Literal

import pygame
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, TypeAdapter
from pygame.event import Event

from robocov_app.toolkit import clipboard

MIN_PAGE_SIDE_PX, MAX_PAGE_SIDE_PX, MAX_PAGE_PIXELS = (
    200,
    7680,
    4096 * 2304,
)  # a page's sides, and its area, in pixels

MAX_UPLOAD_BYTES = 1 << 24
_STRIPPED_CATEGORIES = ("Cc", "Cs")
MAX_FILE_NAME_CHARACTERS = 300  # longer than what any file system takes, so that it is refused with a message


def strip_controls(text: str, keep: str = "") -> str:
    """Remove control characters such as NUL, escape and delete from a text.

    Parameters
    ----------
    text : str
        Text that came in from a page.
    keep : str
        Control characters that stay, such as line breaks in a text that is pasted.

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
    """Remove control characters except line breaks, which become line feeds, and tabs."""
    return strip_controls(text.replace("\r\n", "\n").replace("\r", "\n"), keep="\n\t")


_Line = AfterValidator(strip_controls)
_Lines = AfterValidator(_strip_lines)
_Pixel = Annotated[float, Field(ge=-1e5, le=1e5)]
_Turn = Annotated[float, Field(ge=-100.0, le=100.0)]


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _HeldMessage(_Message):
    held: int = Field(default=0, ge=0, le=15)  # Shift 1, Ctrl 2, Alt 4, Meta 8


class _PointerMessage(_HeldMessage):
    x: _Pixel
    y: _Pixel


class PointerMoved(_PointerMessage):
    """The pointer is elsewhere; `button` is held meanwhile, 0 for none."""

    kind: Literal["move"]
    button: int = Field(default=0, ge=0, le=3)


class ButtonChanged(_PointerMessage):
    """A button of the mouse is pressed, or let go."""

    kind: Literal["button"]
    button: int = Field(ge=1, le=3)
    down: bool


class WheelTurned(_PointerMessage):
    """The wheel is turned by notches."""

    kind: Literal["wheel"]
    right: _Turn = 0.0
    up: _Turn


class KeyChanged(_HeldMessage):
    """A key is pressed or let go; `key` is its name in browsers, empty if it was a control character."""

    kind: Literal["key"]
    key: Annotated[str, Field(min_length=1, max_length=20), _Line]
    down: bool


class TextTyped(_Message):
    """A text is typed without keys: on a phone, or put together from several."""

    kind: Literal["text"]
    text: Annotated[str, Field(max_length=1000), _Lines]


class TextPasted(_Message):
    """A text is pasted from the clipboard of who controls."""

    kind: Literal["paste"]
    text: Annotated[str, Field(max_length=100_000), _Lines]


class Left(_Message):
    """The pointer has left the page, or the page is not typed into any more."""

    kind: Literal["leave", "blur"]
    held: Literal[0] = 0


class PageChanged(_Message):
    """Size of the page in the device's pixels, how many of these are one of CSS, and its colours."""

    kind: Literal["page"]
    width: int = Field(ge=MIN_PAGE_SIDE_PX, le=MAX_PAGE_SIDE_PX)
    height: int = Field(ge=MIN_PAGE_SIDE_PX, le=MAX_PAGE_SIDE_PX)
    ratio: float = Field(ge=0.25, le=8.0)
    dark: bool


class FrameShown(_Message):
    """A picture has arrived."""

    kind: Literal["shown"]
    number: int = Field(ge=0, lt=2**32)


class Control(_Message):
    """Request to hand control to the page of a number; 0 asks for it."""

    kind: Literal["control"]
    to: int = Field(ge=0, lt=2**31)


class Named(_Message):
    """The name of who looks at a page."""

    kind: Literal["name"]
    name: Annotated[str, Field(max_length=40), _Line]


class UploadStarted(_Message):
    """A file follows in binary messages: its name, and its size in bytes."""

    kind: Literal["upload"]
    name: Annotated[str, Field(max_length=MAX_FILE_NAME_CHARACTERS), _Line]
    size: int = Field(ge=0, le=MAX_UPLOAD_BYTES)


class Uploaded(_Message):
    """A file that has been put into the folder, to be opened."""

    kind: Literal["uploaded"] = "uploaded"
    path: str


InputMessage = PointerMoved | ButtonChanged | WheelTurned | KeyChanged | TextTyped | TextPasted | Left
"""Messages of hands to a window."""
Message = InputMessage | PageChanged | FrameShown | Control | Named | UploadStarted
MESSAGES: TypeAdapter[Message] = TypeAdapter(Annotated[Message, Field(discriminator="kind")])
_NAMED_ALIKE = [
    *("ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"),
    *("Escape", "Backspace", "Tab", "Delete", "Insert", *(f"F{k}" for k in range(1, 13))),
]
_KEYS = {name: getattr(pygame, f"K_{name.removeprefix('Arrow').upper()}") for name in _NAMED_ALIKE}
_KEYS |= {"Enter": pygame.K_RETURN, "Shift": pygame.K_LSHIFT, "Control": pygame.K_LCTRL}
_KEYS |= {"Alt": pygame.K_LALT, "Meta": pygame.K_LMETA}
# pygame names keys by what they are without Shift, browsers by what they write
_UNSHIFTED = str.maketrans('!@#$%^&*()_+{}|:"<>?~', "1234567890-=[]\\;',./`")
_MODIFIERS = (pygame.KMOD_LSHIFT, pygame.KMOD_LCTRL, pygame.KMOD_LALT, pygame.KMOD_LMETA)


class EventTranslator:
    """Turns what hands do to the page into pygame's events."""

    def __init__(self) -> None:
        self._at, self._pressed = (0, 0), 0

    def events(self, message: InputMessage | Uploaded) -> Iterator[Event]:
        match message:
            case PointerMoved():
                yield self._moved(message.x, message.y, message.button)
            case ButtonChanged():
                yield self._moved(message.x, message.y, 0 if message.down else message.button)
                kind = pygame.MOUSEBUTTONDOWN if message.down else pygame.MOUSEBUTTONUP
                self._pressed = message.button * message.down
                yield Event(kind, pos=self._at, button=message.button, touch=False)
            case WheelTurned():
                yield self._moved(message.x, message.y, 0)
                right, up = message.right, message.up
                turned: dict[str, Any] = {"x": round(right), "y": round(up)}
                turned |= {"precise_x": right, "precise_y": up}
                yield Event(pygame.MOUSEWHEEL, **turned, flipped=False, touch=False)
            case KeyChanged():
                yield from _translate_key(message)
            case TextTyped():
                for character in message.text:
                    # a telephone's keyboard writes a line break where another presses Enter
                    key = {"\n": "Enter", "\t": "Tab"}.get(character, character)
                    yield from _translate_key(KeyChanged(kind="key", key=key, down=True))
                    yield from _translate_key(KeyChanged(kind="key", key=key, down=False))
            case TextPasted():
                clipboard.put(message.text)
                for down in (True, False):
                    yield from _translate_key(KeyChanged(kind="key", key="v", down=down, held=2))
            case Uploaded():
                yield Event(pygame.DROPFILE, file=message.path)
            case Left():
                if message.kind == "blur" and self._pressed:  # it will be let go elsewhere
                    yield Event(pygame.MOUSEBUTTONUP, pos=self._at, button=self._pressed, touch=False)
                    self._pressed = 0
                yield Event(pygame.WINDOWLEAVE if message.kind == "leave" else pygame.WINDOWFOCUSLOST)

    def _moved(self, x: float, y: float, button: int) -> Event:
        before, self._at = self._at, (round(x), round(y))
        rel = self._at[0] - before[0], self._at[1] - before[1]
        buttons = tuple(int(button == k) for k in (1, 2, 3))
        return Event(pygame.MOUSEMOTION, pos=self._at, rel=rel, buttons=buttons, touch=False)


def get_modifiers(held: int) -> int:
    return sum(mask for k, mask in enumerate(_MODIFIERS) if held >> k & 1)


def _translate_key(message: KeyChanged) -> Iterator[Event]:
    name, held = message.key, message.held
    if not name:
        return
    writes = name if len(name) == 1 and not held & 0b1010 else ""
    code = _KEYS.get(name)
    if code is None:
        if len(name) > 1:
            return  # keys that neither write nor mean anything here
        plain = name.lower().translate(_UNSHIFTED) if held & 1 else name.lower()
        code = ord(plain) if len(plain) == 1 and plain.isascii() else 0
    pressed: dict[str, Any] = {"key": code, "mod": get_modifiers(held), "unicode": writes, "scancode": 0}
    yield Event(pygame.KEYDOWN if message.down else pygame.KEYUP, **pressed)
    if message.down and writes:
        yield Event(pygame.TEXTINPUT, text=writes)
