"""Thousands of random keys, clicks, drags and texts do not break the editor."""

import random
from collections.abc import Callable
from pathlib import Path

import pygame
import pytest
from drawn_sketches import renumber
from driven_editor import EditorDriver, build_sheet, load_sketch, open_editor
from driven_window import MODIFIERS, build_key_event

from robocov.environment import CircleObstacle, DiscStart, PointsStart, PolygonObstacle, WallObstacle
from robocov_app.editor.model.measurement import measure
from robocov_app.editor.model.parser import parse_sketch
from robocov_app.editor.model.sketch import dump_sketch
from robocov_app.editor.ui.panel import EditorPanel
from robocov_app.editor.ui.typed_commands import TYPED_COMMANDS

EVENTS_PER_SEED = 1_500
EVENTS_PER_STEP = 6
STEPS_PER_FRAME = 5
MAX_RUNS = {
    "screenshot": 2,
    "save": 6,
    "save:as": 4,
    "fullscreen": 2,
    "try": 3,
    "quit": 6,
    "open": 6,
    "background": 4,
}
"""Maximum number of runs of commands that write files or take long."""

WORDS = (
    *(f"{word} {value}" for word in TYPED_COMMANDS for value in ("1", "2 x 3", "-1", "1e309", "0", "zz")),
    *("3 x 2", "@1<45", "120cm", "+0.5 -0.5", "90", "𝔸 é ñ 中 🤖", "%s {x} <b> &", "..", "1e309", "-", "٣"),
)
SIZES = ((640, 480), (900, 600), (1000, 1400), (2000, 640), (777, 601))
BUTTONS = (1, 1, 1, 1, 1, 2, 3, 3, 4, 8)
SHEETS: dict[str, Callable[[], object]] = {
    "plain": lambda: build_sheet(
        PolygonObstacle(((2, 2), (4, 2), (4, 4), (2, 4)), (((2.5, 2.5), (3, 2.5), (3, 3)),), "box"),
        CircleObstacle((7, 7), 1.0),
        WallObstacle(((1, 8), (3, 8), (3, 9)), 0.1),
        WallObstacle(((3, 9), (5, 9)), 0.2),
        starts=(("disc", DiscStart((8, 2), 0.8)), ("spots", PointsStart(((1, 1), (1.5, 1))))),
    ),
    "broken": lambda: build_sheet(
        PolygonObstacle(((2, 2), (4, 4), (4, 2), (2, 4))),
        PolygonObstacle(((5, 5), (6, 6))),
        WallObstacle(((1, 8), (1, 8)), 0.1),
        CircleObstacle((50, 50), 1.0),
    ),
    "rooms": lambda: load_sketch("rooms"),
}


class RareMeasurer:
    """Measures every fortieth time only: the measurement has tests of its own."""

    is_busy = False

    def __init__(self) -> None:
        self._asked = None
        self._count = 0

    def put(self, request) -> None:
        self._asked = request

    def poll(self):
        self._count += 1
        if self._asked is None or self._count % 40:
            return None
        request = self._asked
        self._asked = None
        return measure(*request)

    def close(self) -> None:
        pass


class RandomUser:
    """Does random actions one after the other."""

    def __init__(self, driver: EditorDriver, seed: int) -> None:
        self.driver = driver
        self.random = random.Random(seed)
        self.done: dict[str, int] = {}
        self.held = 0

    def choose_position(self) -> tuple[int, int]:
        width, height = self.driver.window.screen.get_size()
        if self.random.random() < 0.25:
            return self.random.randrange(width), self.random.randrange(height)
        # Near the map, where the objects are.
        x, y = self.driver.find_pixel((self.random.uniform(-1, 11), self.random.uniform(-1, 11)))
        return int(min(max(x, 0), width - 1)), int(min(max(y, 0), height - 1))

    def press_key(self) -> None:
        commands = self.driver.window.commands.commands
        name, key = self.random.choice([(command.name, key) for command in commands for key in command.keys])
        self.done[name] = self.done.get(name, 0) + 1
        if self.done[name] > MAX_RUNS.get(name, 10**9):
            return
        attributes = build_key_event(key)
        self.driver.post(pygame.KEYDOWN, **attributes)
        if attributes["unicode"]:
            self.driver.post(pygame.TEXTINPUT, text=attributes["unicode"])
        if self.random.random() < 0.9:
            self.driver.post(pygame.KEYUP, **attributes)

    def type_text(self) -> None:
        for letter in self.random.choice(WORDS):
            code = ord(letter) if letter.isascii() else 0
            self.driver.post(pygame.KEYDOWN, key=code, mod=0, unicode=letter, scancode=0)
            self.driver.post(pygame.TEXTINPUT, text=letter)
        if self.random.random() < 0.7:
            self.driver.post(pygame.KEYDOWN, key=pygame.K_RETURN, mod=0, unicode="\r", scancode=0)

    def move(self) -> None:
        at = self.choose_position()
        rel = at[0] - self.driver.pixel[0], at[1] - self.driver.pixel[1]
        pygame.mouse.set_pos(at)
        self.driver.pixel = at
        self.driver.post(pygame.MOUSEMOTION, pos=at, rel=rel, buttons=(self.held == 1, 0, self.held == 3))

    def press(self) -> None:
        self.held = self.random.choice(BUTTONS)
        self.driver.post(pygame.MOUSEBUTTONDOWN, pos=self.driver.pixel, button=self.held)

    def release(self) -> None:
        button = self.held if self.random.random() < 0.9 else self.random.choice(BUTTONS)
        self.driver.post(pygame.MOUSEBUTTONUP, pos=self.driver.pixel, button=button)
        self.held = 0

    def turn_wheel(self) -> None:
        amount = self.random.choice((-3, -1, 1, 2))
        self.driver.post(
            pygame.MOUSEWHEEL, x=0, y=amount, precise_x=0.0, precise_y=float(amount), flipped=False
        )

    def disturb_window(self) -> None:
        window = self.driver.window
        which = self.random.randrange(6)
        if which == 0:
            size = self.random.choice(SIZES)
            pygame.display.set_mode(size, pygame.RESIZABLE)
            self.driver.post(pygame.WINDOWSIZECHANGED, x=size[0], y=size[1])
        elif which == 1:
            self.driver.post(self.random.choice((pygame.WINDOWLEAVE, pygame.WINDOWFOCUSLOST)))
        elif which == 2:
            pygame.key.set_mods(self.random.choice((0, 0, *MODIFIERS.values())))
        elif which == 3:
            window.panel.show_tab(self.random.choice(EditorPanel.tabs))
        elif which == 4:
            window.canvas.fit()
        else:
            self.driver.post(pygame.KEYDOWN, key=pygame.K_ESCAPE, mod=0, unicode="", scancode=0)

    def act(self) -> None:
        dice = self.random.random()
        if dice < 0.42:
            self.move()
        elif dice < 0.62:
            (self.press if not self.held else self.release)()
        elif dice < 0.87:
            self.press_key()
        elif dice < 0.91:
            self.type_text()
        elif dice < 0.94:
            self.turn_wheel()
        else:
            self.disturb_window()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1])
@pytest.mark.parametrize("name", SHEETS)
def test_random_events_do_no_harm(name: str, seed: int, tmp_path: Path) -> None:
    play_events(name, seed, tmp_path, EVENTS_PER_SEED)


def test_some_random_events_do_no_harm(tmp_path: Path) -> None:
    play_events("rooms", 3, tmp_path, EVENTS_PER_SEED // 20)


def play_events(name: str, seed: int, tmp_path: Path, events: int) -> None:
    measurer = RareMeasurer()
    with open_editor(tmp_path, SHEETS[name](), drafts=tmp_path / "drafts", readings=measurer) as driver:
        user = RandomUser(driver, seed)
        for step in range(events // EVENTS_PER_STEP):
            for _ in range(EVENTS_PER_STEP):
                user.act()
            window = driver.window
            if window.play_mode.window is not None or step % STEPS_PER_FRAME == 0:
                window.run_frame(1 / 50)
            else:
                window.advance(1 / 50)
            if window.closed:
                window.closed = window.file_commands.may_close = False
            if step % 50 == 0:
                sketch = driver.sketch
                assert parse_sketch(dump_sketch(sketch), "map") == renumber(sketch)
                assert driver.editor.selection.restrict_to(sketch) == driver.editor.selection
        # Undoing everything leads exactly to the first state.
        pygame.event.clear()
        if driver.window.play_mode.window is not None:
            driver.window.play_mode.window.returns_to_editor = True
            driver.window.run_frame(0.0)
        history = driver.editor.document.history
        last = history.sketch
        undone = 0
        while history.undo() is not None:
            undone += 1
        for _ in range(undone):
            history.redo()
        assert history.sketch == last
