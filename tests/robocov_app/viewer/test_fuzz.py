"""Thousands of random keys, clicks, drags and texts, after which the viewer can still be used."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pygame
import pytest
from driven_window import KEYS, MODIFIERS, Driver, open_viewer, run_text
from sample_sessions import RAPF, RPF, compute_penetration

from robocov.environment import Environment
from robocov_app.viewer.costs.costs import Costs
from robocov_app.viewer.session.setup.scenario import MAX_PANES
from robocov_app.viewer.window.window import ViewerWindow

EVENTS = 5_000
EVENTS_PER_FRAME = 10
DRAWING_INTERVAL = 12
"""Number of frames of which one is drawn."""

MAX_CALLS = {
    "quit": 0,
    "screenshot": 4,
    "video": 4,
    "save:map": 4,
    "save:run": 1,
    "fullscreen": 2,
    "tour": 3,
    "more": 12,
}
"""How often commands are run at most that write files or take long."""

MAPS = ("square", "trap", "rooms", "l-shape", "pentagon")
TYPED_TEXTS = (
    "k_rep 0.5",
    "k_att 1e9",
    "rho_0 none",
    "radius 0.3",
    "max_speed 20",
    "sensing_range none",
    "viscosity 0",
    "robots 1",
    "robots 4",
    "robots 0",
    "seed 9",
    "start corner",
    "start uniform",
    "speed 16",
    "speed max",
    "speed 0.1",
    "controller lloyd",
    "controller rpf",
    "controller rapf",
    "time 0",
    "time 3",
    "robot 2",
    *(f"map {name}" for name in MAPS),
    "none",
    "pane",
    "layer",
    "zoom",
    "Voronoi",
    "𝔸 é ñ 中 🤖",
    "\t",
    "%s {x} <b> &",
    "..",
    "-",
    "1e309",
    "٣",
)
SIZES = ((640, 480), (900, 600), (1000, 1400), (2000, 640), (777, 601))
BUTTONS = (1, 1, 1, 1, 2, 3, 4, 8)


class CostsOfSmallMaps(Costs):
    """Costs of maps with few obstacles. Larger maps would take long, and are tested elsewhere."""

    def set_environment(self, environment: Environment, radius: float) -> None:
        if len(environment.obstacles) < 15:
            super().set_environment(environment, radius)
        else:
            self.forget()
            self._map_request = None


class RandomUser:
    """Posts random events."""

    def __init__(self, driver: Driver, seed: int) -> None:
        self.driver = driver
        self.random = random.Random(seed)
        self.held: list[int] = []
        commands = [item for item in driver.window.commands.commands if MAX_CALLS.get(item.name) != 0]
        self.command_keys = [key for item in commands for key in item.keys if not key.endswith("+")]

    def play(self, events: int) -> None:
        window = self.driver.window
        for k in range(0, events, EVENTS_PER_FRAME):
            for _ in range(EVENTS_PER_FRAME):
                self.post_event()
            window.advance(self.random.choice((0.0, 0.01, 0.02, 0.05)))
            if k // EVENTS_PER_FRAME % DRAWING_INTERVAL == 0:
                window.draw()
            self.keep_small()

    def keep_small(self) -> None:
        """Restart a run that has grown too large for many events."""
        session = self.driver.session
        has_many_robots = session.timeline.scenario.robots > 5 or len(session.displayed.numbers) > 6
        if has_many_robots or len(session.displayed.environment.obstacles) > 20:
            self.driver.viewer.attempt(lambda: self.driver.viewer.files.open_map("square"))
            self.driver.viewer.attempt(lambda: self.driver.viewer.playback.restart(robots=2))

    def post_event(self) -> None:
        """Post a random event, or a few that belong together."""
        kind = self.random.random()
        if kind < 0.30:
            self.press_key()
        elif kind < 0.36:
            self.type_text(self.random.choice(TYPED_TEXTS))
        elif kind < 0.62:
            self.move()
        elif kind < 0.92:
            self.change_button()
        elif kind < 0.97:
            amount = self.random.randint(-3, 3)
            self.driver.post(
                pygame.MOUSEWHEEL, x=0, y=amount, precise_x=0.0, precise_y=float(amount), flipped=False
            )
        elif kind < 0.98:
            self.driver.post(
                self.random.choice((pygame.WINDOWLEAVE, pygame.WINDOWFOCUSLOST, pygame.VIDEOEXPOSE))
            )
        elif kind < 0.982:
            size = self.random.choice(SIZES)
            pygame.display.set_mode(size, pygame.RESIZABLE)
            self.driver.post(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1])
        elif kind < 0.985:
            self.driver.viewer.attempt(
                lambda: self.driver.window.commands.run_text(f"map {self.random.choice(MAPS)}")
            )
        else:
            self.drag()

    def press_key(self) -> None:
        if self.random.random() < 0.7:
            *modifiers, name = self.random.choice(self.command_keys).split("+")
            mod = sum(MODIFIERS[modifier] for modifier in modifiers)
            code = KEYS.get(name) or pygame.key.key_code(name)
            text = name if len(name) == 1 and "ctrl" not in modifiers else ""
        else:
            code = self.random.choice((*KEYS.values(), *range(32, 127), pygame.K_KP_PLUS, pygame.K_LSHIFT, 0))
            mod = self.random.choice((0, 0, *MODIFIERS.values(), pygame.KMOD_MODE, pygame.KMOD_CAPS))
            text = chr(code) if 32 <= code < 127 else ""
            if code == pygame.K_q and mod == pygame.KMOD_LCTRL:
                return
        self.driver.post(pygame.KEYDOWN, key=code, mod=mod, unicode=text, scancode=0)
        if text and not mod & pygame.KMOD_CTRL:
            self.driver.post(pygame.TEXTINPUT, text=text)
        if self.random.random() < 0.9:
            self.driver.post(pygame.KEYUP, key=code, mod=mod, unicode=text, scancode=0)

    def type_text(self, text: str) -> None:
        if self.random.random() < 0.5:
            self.driver.post(pygame.KEYDOWN, key=pygame.K_k, mod=pygame.KMOD_LCTRL, unicode="", scancode=0)
        for letter in text:
            self.driver.post(pygame.TEXTINPUT, text=letter)
        if self.random.random() < 0.8:
            key = self.random.choice((pygame.K_RETURN, pygame.K_KP_ENTER, pygame.K_ESCAPE))
            self.driver.post(pygame.KEYDOWN, key=key, mod=0, unicode="", scancode=0)
            self.driver.post(pygame.KEYUP, key=key, mod=0, unicode="", scancode=0)

    def choose_pixel(self) -> tuple[int, int]:
        """Return a pixel, which is often one of a widget, a robot or a box of the layout."""
        window = self.driver.window
        rng = self.random
        width, height = window.layout.size
        target = rng.random()
        if target < 0.3:
            return rng.randint(-30, width + 30), rng.randint(-30, height + 30)
        panel = window.panel
        if target < 0.55 and panel.ui.widgets:
            box = rng.choice(list(panel.ui.widgets.values())).rect
            if panel.ui.open_list is not None and rng.random() < 0.7:
                box = panel.ui.open_list.rect
            return rng.randint(box.left, box.right), rng.randint(box.top, box.bottom)
        layout = window.layout
        boxes = [*layout.panes, layout.time_slider, layout.chart, layout.panel, layout.panel]
        if target > 0.7 and window._arrangement.key and window.canvas._scenes:
            session = self.driver.session
            pane = rng.randrange(min(len(session.timeline.panes), len(layout.panes)))
            x, y = rng.choice(session.displayed.get_positions(session.timeline.panes[pane]).tolist())
            column, row = self.driver.find_pixel((x, y), pane)
            return round(column) + rng.randint(-3, 3), round(row) + rng.randint(-3, 3)
        left, top, box_width, box_height = rng.choice(boxes)
        return left + rng.randrange(max(box_width, 1)), top + rng.randrange(max(box_height, 1))

    def move(self) -> None:
        x, y = self.choose_pixel()
        rel = x - self.driver.pixel[0], y - self.driver.pixel[1]
        pygame.mouse.set_pos((x, y))
        pygame.event.clear(pygame.MOUSEMOTION)
        buttons = tuple(int(k in self.held) for k in (1, 2, 3))
        self.driver.post(pygame.MOUSEMOTION, pos=(x, y), rel=rel, buttons=buttons)
        self.driver.pixel = (x, y)

    def change_button(self) -> None:
        """Release a held button, or press one."""
        if self.held and self.random.random() < 0.7:
            button = self.held.pop(self.random.randrange(len(self.held)))
            self.driver.post(pygame.MOUSEBUTTONUP, pos=self.driver.pixel, button=button)
            return
        if self.random.random() < 0.6:
            self.move()
        button = self.random.choice(BUTTONS)
        self.held.append(button)
        self.driver.post(pygame.MOUSEBUTTONDOWN, pos=self.driver.pixel, button=button)

    def drag(self) -> None:
        """Press and release the first button at two pixels."""
        for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            self.move()
            self.driver.post(kind, pos=self.driver.pixel, button=1)
            self.driver.window.advance(0.01)


@contextmanager
def limit_commands(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Run some commands a few times at most, and compute costs of small maps only."""
    remaining = dict(MAX_CALLS)
    run_command = ViewerWindow.run_command

    def run_if_remaining(window: ViewerWindow, name: str) -> None:
        if name in remaining:
            ends_video = name == "video" and window.video_recorder.video is not None
            if remaining[name] == 0 and not ends_video:
                return
            remaining[name] = max(remaining[name] - 1, 0)
        run_command(window, name)

    with monkeypatch.context() as patch:
        patch.setattr(ViewerWindow, "run_command", run_if_remaining)
        patch.setattr("driven_window.Costs", CostsOfSmallMaps)
        yield


def assert_consistent(driver: Driver) -> None:
    """Check that the state is valid."""
    session = driver.session
    window = driver.window
    assert 1 <= len(session.timeline.panes) <= MAX_PANES
    numbers = session.timeline.panes[0].numbers
    assert len(numbers) >= 1
    assert list(numbers) == sorted(set(numbers))
    for pane in session.timeline.panes:
        assert pane.numbers == numbers
        assert pane.setup.failed.keys() == session.timeline.panes[0].setup.failed.keys()
        assert pane.setup.environment is session.timeline.panes[0].setup.environment
        assert pane.simulation.positions.shape == (len(numbers), 2)
        assert np.isfinite(pane.simulation.positions).all()
        assert np.isfinite(pane.simulation.velocities).all()
        assert pane.time == pytest.approx(session.timeline.end_time, abs=1e-6)
        assert (np.diff(pane.distance_curve.times) > 0).all()
        assert pane.distance_curve.last_time <= session.timeline.end_time + 1e-6
    assert compute_penetration(session) < 0.01
    assert 0.0 <= session.displayed.time <= session.timeline.end_time + 1e-9
    # The stored value, because `viewer.active_pane` is always within the number of panes.
    assert 0 <= driver.viewer.inspection.active_pane < MAX_PANES
    assert window.panel.tab in window.panel.tabs
    assert len(window.layout.panes) == len(session.timeline.panes)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1])
def test_the_window_survives_random_events(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    controllers = (RAPF, RPF) if seed % 2 else (RAPF,)
    with limit_commands(monkeypatch), open_viewer(tmp_path, *controllers, robots=2, lattice=4) as driver:
        user = RandomUser(driver, seed)
        for _ in range(5):
            user.play(EVENTS // 5)
            driver.settle()
            assert_consistent(driver)
        assert_usable(driver)
    assert len(list(tmp_path.iterdir())) <= 16


def assert_usable(driver: Driver) -> None:
    """Check that the window can still be used."""
    window = driver.window
    viewer = driver.viewer
    for button in (1, 2, 3):
        driver.release(button)
    pygame.display.set_mode((900, 600), pygame.RESIZABLE)
    driver.post(pygame.VIDEORESIZE, size=(900, 600), w=900, h=600)
    driver.post(pygame.WINDOWFOCUSLOST)  # releases all keys
    driver.press_key("escape", 6)
    viewer.view.has_panel = True
    window.scale = 1.0
    viewer.view.layers = {"robots", "obstacles", "boundary"}
    while len(driver.session.timeline.panes) > 1:
        driver.session.remove_pane(driver.session.timeline.panes[-1])
    viewer.attempt(lambda: viewer.files.open_map("square"))
    run_text(viewer, "robots 2")
    for name in ("radius 0.1", "max_speed 1", "speed 1", "controller rapf"):
        run_text(viewer, name)
    driver.settle()
    driver.settle()
    driver.push_button("tool:hand")
    driver.press_key("f")
    driver.session.playback.is_playing = False
    driver.settle()
    driver.drag(driver.find_robot_pixel(1), driver.find_pixel((5.0, 5.0)))
    pane = driver.session.timeline.panes[0]
    assert np.allclose(pane.simulation.positions[0], (5.0, 5.0), atol=0.05)
    assert window.panel.tab == "robot"
    driver.push_button("pause")
    driver.run_frames(5)
    assert driver.session.playback.is_playing
    assert driver.session.timeline.end_time > 0.0
    driver.open_tab("parameters")
    driver.type_into("k_rep", "0.75")
    driver.press_key("return")
    assert pane.controller.get_value("k_rep") == 0.75
    assert_consistent(driver)
