"""Random events for a window: keys, text, mouse, fingers, files, sizes and focus."""

from __future__ import annotations

import json
import math
import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pygame
from driven_window import MODIFIERS, build_key_event

from robocov.mapfile import list_bundled_maps, load_map, save_map
from robocov_app.toolkit.window.clipboard import Clipboard
from robocov_app.toolkit.window.page_view import PageAppearance
from robocov_app.toolkit.window.window import BaseWindow
from robocov_app.web import events as page_events

EVENTS_PER_FRAME = 8
RARE_COMMANDS = {
    "screenshot": 3,
    "video": 2,
    "fullscreen": 4,
    "save": 6,
    "save:as": 4,
    "save:map": 3,
    "save:run": 0,
    "export": 4,
    "more": 10,
    "tour": 3,
    "try": 6,
}
"""Commands that write files or take long, with the maximum number of times that each is used."""

SIZES = ((1, 1), (2, 1), (3, 700), (200, 200), (460, 600), (640, 480), (900, 600), (1300, 30), (2000, 700))
SCALES = (0.25, 0.5, 1.0, 1.0, 1.5, 3.0, 8.0)
EXTREME_COORDINATES = (-(2**15), -1, 0, 10**5)
BUTTONS = (1, 1, 1, 1, 1, 2, 3, 3, 4, 5, 8, 20)
FRAME_DURATIONS_S = (0.0, 0.001, 0.01, 0.02, 0.05, 0.3)
REPEATED_KEYS = ("a", "space", "tab", "return", "escape", "backspace", "delete", "left", "ctrl+z")
UNUSUAL_KEYS = (0, 1, 127, pygame.K_CAPSLOCK, pygame.K_F15, 2**30 + 250, -1)
TEXTS = (
    "a\x00b",
    "\x00",
    "\x1b[31mred",
    "\r\n",
    "\u202eabc",
    "\udcff",
    "\ud83e",
    "\u2028",
    "𝔸 é ñ 中 🤖",
    "nan",
    "inf",
    "-inf",
    "1e309",
    "-1",
    "0",
    "1e-320",
    "9" * 400,
    "٣",
    "½",
    "1,5",
    "2 x 3",
    "@1<45",
    "%s {x}",
    "..",
    "/",
    "~",
    "~nobody/x",
    "a/../../b",
    "C:\\x",
    "x" * 3000,
    "robots 3",
    "seed 9",
    "radius 0.3",
    "map square",
    "map nowhere",
    "controller lloyd",
    "k_rep nan",
    "speed 0",
    "time 1e308",
    "branch 9",
    "open .",
    "open odd.json",
    "save a\x00b",
    "grid 0",
    "move 1e308 1",
    "rotate nan",
    "scale 0",
)
"""Texts with control characters, unpaired surrogates, odd numbers, odd paths, and commands."""

POLYGON = {"kind": "polygon", "vertices": [[0, 0], [1, 1], [0, 1], [1, 0]]}
CIRCLE: dict[str, Any] = {"kind": "circle", "center": [5, 5], "radius": 0.5}
MAP: dict[str, Any] = {"format": "robocov-map", "version": 1}
PASTED_TEXTS = (
    "",
    " ",
    "\x00",
    "{",
    "[" * 2000,
    "[[0,0],[1,0],[1,1]]",
    "[[0,0],[1,0]]",
    "[null]",
    "NaN",
    "x" * 50_000,
    '{"kind": "circle", "center": [5, 5], "radius": 0.4, "note": "a\\u0000b\\ud800"}',
    "\udcff" * 10,
    json.dumps(POLYGON),
    json.dumps([POLYGON, CIRCLE]),
    json.dumps({"kind": "circle"}),
    json.dumps(CIRCLE | {"radius": 1e308}),
    json.dumps(CIRCLE | {"name": "a\x00b"}),
    json.dumps(CIRCLE | {"note": "\x00\x1b"}),
    json.dumps(MAP | {"name": "\x00"}),
    json.dumps(MAP | {"format": "robocov-clipboard", "obstacles": [{"kind": "wall", "points": []}]}),
    json.dumps(MAP | {"name": "odd", "boundary": [[0, 0]], "obstacles": [CIRCLE], "starts": {"": 1}}),
)
MESSAGES: tuple[dict[str, Any], ...] = (
    {"kind": "paste", "text": "a\x00b"},
    {"kind": "text", "text": "\x00\x1bx"},
    {"kind": "blur"},
    {"kind": "leave"},
    {"kind": "wheel", "x": -1e5, "y": 1e5, "up": 100.0, "right": -100.0},
    {"kind": "key", "key": "\x00", "down": True},
    {"kind": "key", "key": "😀", "down": True, "held": 15},
    {"kind": "move", "x": 1e5, "y": -1e5, "button": 3},
    {"kind": "button", "button": 3, "down": True, "x": 10.5, "y": 10.2},
)
OTHER_EVENTS = (
    "WINDOWLEAVE",
    "WINDOWENTER",
    "WINDOWFOCUSLOST",
    "WINDOWFOCUSGAINED",
    "WINDOWMINIMIZED",
    "USEREVENT",
    "WINDOWRESTORED",
    "WINDOWMOVED",
    "WINDOWSHOWN",
    "WINDOWHIDDEN",
    "WINDOWCLOSE",
    "CLIPBOARDUPDATE",
    "DROPBEGIN",
    "DROPCOMPLETE",
    "KEYMAPCHANGED",
    "LOCALECHANGED",
    "AUDIODEVICEREMOVED",
    "WINDOWEXPOSED",
    "RENDER_TARGETS_RESET",
    "APP_LOWMEMORY",
    "APP_TERMINATING",
    "WINDOWDISPLAYCHANGED",
    "ACTIVEEVENT",
)
"""Names in pygame of events of the window and of the system."""

DECOMPRESSION_BOMB = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\x02" + bytes(3)
ODD_FILES: dict[str, bytes] = {
    "empty.json": b"",
    "odd.json": b'{"format": "robocov-map", "version": 1, "name": "odd", "boundary": [[0,0],[1,0]]}',
    "binary.json": bytes(range(256)),
    "deep.json": b"[" * 5000,
    "list.json": b"[1, 2]",
    "nul.json": b'{"format": "robocov-map", "version": 1, "name": "a\\u0000b"}',
    "new\nline.json": b"{}",
    "cut.png": b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR",
    "bomb.png": DECOMPRESSION_BOMB,
    "text.png": b"hello",
    "x.svg": b"<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0 L1e400 nan z'/></svg>",
    "x.dxf": b"0\nSECTION\n",
    "x.osm": b"<osm><way id='1'/></osm>",
    "x.wkt": b"POLYGON ((0 0, 1 0",
    "x.yaml": b"image: [\n",
    "x.geojson": b'{"type": "Polygon", "coordinates": []}',
    "x.robocov": b'{"format": "robocov-session", "version": 1}',
    "x.exe": b"MZ",
    "no suffix": b"?",
}


def write_odd_files(folder: Path) -> list[str]:
    """Write odd files and a valid map, and return their paths, paths that do not exist, and bundled maps."""
    folder.mkdir()
    (folder / "folder.json").mkdir()
    for name, content in ODD_FILES.items():
        (folder / name).write_bytes(content)
    save_map(load_map("square"), folder / "fine.json")
    names = [*ODD_FILES, "fine.json", "folder.json", "missing.json", "missing/x.json"]
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "pipe.json")
        os.mkfifo(folder / "pipe.png")
        (folder / "loop.json").symlink_to(folder / "loop.json")
        names += ["pipe.json", "pipe.png", "loop.json", "/dev/null", "/dev/zero"]
    paths = [str(folder / name) for name in names]
    if os.name == "posix":
        raw = os.fsencode(folder) + b"/not\xffutf8.json"
        with open(raw, "wb") as file:  # noqa: PTH123 - a name of bytes
            file.write((folder / "fine.json").read_bytes())
        paths.append(os.fsdecode(raw))
    long_name = "x" * 5000 + ".json"
    return [*paths, "", ".", "\x00", "a\x00b.json", long_name, *map(str, list_bundled_maps().values())]


class RandomEvents:
    """Posts random events to a window, and runs its frames.

    Parameters
    ----------
    window : BaseWindow
        Window on an invisible display.
    folder : Path
        Folder for odd files, which does not exist yet.
    seed : int
        The same seed gives the same events.
    """

    def __init__(self, window: BaseWindow, folder: Path, seed: int) -> None:
        self.window = window
        self.random = random.Random(seed)
        self.files = write_odd_files(folder)
        self.clipboard = Clipboard()
        self.page = page_events.EventTranslator(self.clipboard)
        self.pixel = (5, 5)
        self.held: list[int] = []
        self.pressed: dict[str, int] = {}

    def play(self, count: int, after_frame: Callable[[], object] = lambda: None) -> None:
        """Post a number of events, with a frame after every `EVENTS_PER_FRAME` events."""
        kinds: list[tuple[float, Callable[[], None]]] = [
            (0.24, self.press_key_of_command),
            (0.05, self.repeat_key),
            (0.06, self.type_text),
            (0.02, self.compose_text),
            (0.04, self.paste),
            (0.015, self.drop_file),
            (0.22, self.move),
            (0.18, self.press_button),
            (0.05, self.turn_wheel),
            (0.03, self.touch),
            (0.02, self.resize),
            (0.03, self.post_other),
            (0.02, self.send_message),
            (0.01, self.quit),
            (0.005, self.use_palette),
        ]
        weights = [weight for weight, _ in kinds]
        actions = [action for _, action in kinds]
        for number in range(count):
            self.random.choices(actions, weights)[0]()
            if number % EVENTS_PER_FRAME == 0:
                self.window.run_frame(self.random.choice(FRAME_DURATIONS_S))
                self.window.closed = False
                after_frame()

    def post(self, kind: int, **content: Any) -> None:
        pygame.event.post(pygame.event.Event(kind, **content))

    def press_key(self, content: dict[str, Any]) -> None:
        """Post the press of a key, and the text that it types."""
        self.post(pygame.KEYDOWN, **content)
        if content["unicode"]:
            self.post(pygame.TEXTINPUT, text=content["unicode"])

    def post_key(self, name: str) -> None:
        """Post the press of a key and, mostly, its release."""
        content = build_key_event(name)
        self.press_key(content)
        if self.random.random() < 0.9:
            self.post(pygame.KEYUP, **content)

    def press_key_of_command(self) -> None:
        """Press the key of a command, except for rare commands that were used often enough."""
        commands: Any = (self.window.replacement or self.window).commands  # type: ignore[attr-defined]
        pairs = [(command.name, key) for command in commands.commands for key in command.keys]
        name, key = self.random.choice(pairs)
        self.pressed[name] = self.pressed.get(name, 0) + 1
        if self.pressed[name] <= RARE_COMMANDS.get(name, math.inf):
            self.post_key(key)

    def repeat_key(self) -> None:
        """Press a key many times without releasing it, then an unusual or invalid key."""
        content = build_key_event(self.random.choice(REPEATED_KEYS))
        for _ in range(self.random.randint(2, 25)):
            self.press_key(content)
        code = self.random.choice(UNUSUAL_KEYS)
        modifiers = self.random.randrange(2**15)
        self.post(pygame.KEYDOWN, key=code, mod=modifiers, unicode="\x00", scancode=0)

    def type_text(self) -> None:
        text = self.random.choice(TEXTS)
        if self.random.random() < 0.5:
            self.post(pygame.TEXTINPUT, text=text)
        else:
            for character in text[:40]:
                code = min(ord(character), 2**20)
                self.post(pygame.KEYDOWN, key=code, mod=0, unicode=character, scancode=0)
                self.post(pygame.TEXTINPUT, text=character)
        if self.random.random() < 0.6:
            self.post_key("return")

    def compose_text(self) -> None:
        self.post(pygame.TEXTEDITING, text=self.random.choice((*TEXTS, "", "")), start=0, length=0)

    def paste(self) -> None:
        self.clipboard.put(self.random.choice((*PASTED_TEXTS, *TEXTS)))
        self.post_key(self.random.choice(("ctrl+v", "ctrl+shift+v")))

    def drop_file(self) -> None:
        self.post(pygame.DROPFILE, file=self.random.choice(self.files))

    def choose_pixel(self) -> tuple[int, int]:
        """Return a pixel in, near or far from the window, or on a widget of the panel."""
        width, height = self.window.screen.get_size()
        probability = self.random.random()
        if probability < 0.04:
            x = self.random.choice(EXTREME_COORDINATES)
            y = self.random.choice(EXTREME_COORDINATES)
            return x, y
        panel = getattr(self.window.replacement or self.window, "panel", None)
        if probability < 0.45 and panel is not None and panel.ui.widgets:
            box = self.random.choice(list(panel.ui.widgets.values())).rect
            return self.random.randint(box.left, box.right), self.random.randint(box.top, box.bottom)
        return self.random.randint(-10, width + 10), self.random.randint(-10, height + 10)

    def move(self) -> None:
        x, y = self.pixel
        self.pixel = self.choose_pixel()
        shift = (self.pixel[0] - x, self.pixel[1] - y)
        buttons = tuple(int(k in self.held) for k in (1, 2, 3))
        self.post(pygame.MOUSEMOTION, pos=self.pixel, rel=shift, buttons=buttons, touch=False)

    def press_button(self) -> None:
        if self.held and self.random.random() < 0.7:
            self.post(pygame.MOUSEBUTTONUP, pos=self.pixel, button=self.held.pop(), touch=False)
            return
        self.move()
        button = self.random.choice(BUTTONS)
        self.held.append(button)
        for _ in range(self.random.choice((1, 1, 2))):
            self.post(pygame.MOUSEBUTTONDOWN, pos=self.pixel, button=button, touch=False)

    def turn_wheel(self) -> None:
        amount = self.random.choice((-1, 1, 1, 3, -3, 10**6, -(10**6), 0))
        precise = self.random.choice((float(amount), 0.0, 1e-9, math.nan, math.inf, -1e30))
        self.post(
            pygame.MOUSEWHEEL,
            x=0,
            y=amount,
            precise_x=0.0,
            precise_y=precise,
            flipped=False,
            touch=False,
        )

    def touch(self) -> None:
        kind = self.random.choice((pygame.FINGERDOWN, pygame.FINGERMOTION, pygame.FINGERUP))
        x = self.random.uniform(-1, 2)
        y = self.random.uniform(-1, 2)
        self.post(kind, touch_id=0, finger_id=1, x=x, y=y, dx=0.1, dy=math.nan, pressure=1.0)
        self.post(pygame.MULTIGESTURE, touch_id=0, x=x, y=y, pinched=math.inf, rotated=0.1, num_fingers=2)

    def resize(self) -> None:
        size = self.random.choice(SIZES)
        pygame.display.set_mode(size, pygame.RESIZABLE)
        kind = self.random.choice((pygame.VIDEORESIZE, pygame.WINDOWSIZECHANGED))
        self.post(kind, size=size, w=size[0], h=size[1], x=size[0], y=size[1])
        if self.random.random() < 0.3:
            appearance = PageAppearance(
                scale=self.random.choice(SCALES),
                theme=self.random.choice(("light", "dark")),
                shows_panel=self.random.choice((None, True, False)),
                is_compact=self.random.choice((True, False)),
                is_motion_reduced=self.random.choice((True, False)),
            )
            self.window.set_appearance(appearance)

    def post_other(self) -> None:
        """Post an event of the window or of the system, with random modifier keys."""
        pygame.key.set_mods(self.random.choice((0, 0, 0, *MODIFIERS.values())))
        kind = getattr(pygame, self.random.choice(OTHER_EVENTS), None)
        if kind is not None:
            self.post(kind)

    def send_message(self) -> None:
        """Post the events of a message from a browser."""
        message = page_events.MESSAGES.validate_python(self.random.choice(MESSAGES))
        for event in self.page.translate(message):  # type: ignore[arg-type]
            pygame.event.post(event)

    def quit(self) -> None:
        """Ask the window to close, and cancel that."""
        self.post(pygame.QUIT)
        self.post_key(self.random.choice(("escape", "c")))

    def use_palette(self) -> None:
        self.post_key("ctrl+k")
        self.post(pygame.TEXTINPUT, text=self.random.choice(TEXTS))
        self.post_key("return")
