"""Thousands of random keys, clicks, drags and letters: the window must bear them all."""

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

from robocov_app.viewer.costs import Costs
from robocov_app.viewer.session.scenario import MAX_PANES
from robocov_app.viewer.window import ViewerWindow

EVENTS, BATCH, DRAWN = 5_000, 10, 12
"""Events of one seed, events between two frames, and frames of which one is drawn."""

MOST = {
    "quit": 0,
    "screenshot": 4,
    "video": 4,
    "save:map": 4,
    "save:run": 1,
    "fullscreen": 2,
    "tour": 3,
    "more": 12,
}
"""What is done so often at most, since it writes files or takes long."""

MAPS = ("square", "trap", "rooms", "l-shape", "pentagon")
# fmt: off
WORDS = (
    *(
        "k_rep 0.5",
        "k_att 1e9",
        "rho_0 none",
        "radius 0.3",
        "max_speed 20",
        "sensing_range none",
        "viscosity 0",
    ),
    *("robots 1", "robots 4", "robots 0", "seed 9", "start corner", "start uniform", "speed 16", "speed max"),
    *("speed 0.1", "controller lloyd", "controller rpf", "controller rapf", "time 0", "time 3", "robot 2"),
    *(f"map {name}" for name in MAPS),
    *("none", "pane", "layer", "zoom", "Voronoi", "𝔸 é ñ 中 🤖", "\t", "%s {x} <b> &", "..", "-", "1e309",
        "٣"),
)
# fmt: on
SIZES = ((640, 480), (900, 600), (1000, 1400), (2000, 640), (777, 601))
BUTTONS = (1, 1, 1, 1, 2, 3, 4, 8)


class SomeCosts(Costs):
    """The costs of small maps; those of large ones take long, and are tested elsewhere."""

    def environment(self, environment) -> None:
        if len(environment.obstacles) < 15:
            super().environment(environment)
        else:
            self.forget()
            self._map = None


class Monkey:
    """Posts random events."""

    def __init__(self, driver: Driver, seed: int) -> None:
        self.driver, self.random = driver, random.Random(seed)
        self.held: list[int] = []
        listed = [each for each in driver.window.commands.commands if MOST.get(each.name) != 0]
        self.named = [key for each in listed for key in each.keys if not key.endswith("+")]

    def play(self, events: int) -> None:
        window = self.driver.window
        for k in range(0, events, BATCH):
            for _ in range(BATCH):
                self.one()
            window.advance(self.random.choice((0.0, 0.01, 0.02, 0.05)))
            if k // BATCH % DRAWN == 0:
                window.draw()
            self.tame()

    def tame(self) -> None:
        """Keep the run small, so that there is time for many events."""
        session = self.driver.session
        large = session.timeline.scenario.robots > 5 or len(session.displayed.numbers) > 6
        if large or len(session.displayed.environment.obstacles) > 20:
            self.driver.viewer.attempt(lambda: self.driver.viewer.files.open_map("square"))
            self.driver.viewer.attempt(lambda: self.driver.viewer.playback.restart(robots=2))

    def one(self) -> None:
        what = self.random.random()
        if what < 0.30:
            self.key()
        elif what < 0.36:
            self.type(self.random.choice(WORDS))
        elif what < 0.62:
            self.move()
        elif what < 0.92:
            self.button()
        elif what < 0.97:
            amount = self.random.randint(-3, 3)
            self.driver.post(
                pygame.MOUSEWHEEL, x=0, y=amount, precise_x=0.0, precise_y=float(amount), flipped=False
            )
        elif what < 0.98:
            self.driver.post(
                self.random.choice((pygame.WINDOWLEAVE, pygame.WINDOWFOCUSLOST, pygame.VIDEOEXPOSE))
            )
        elif what < 0.982:
            size = self.random.choice(SIZES)
            pygame.display.set_mode(size, pygame.RESIZABLE)
            self.driver.post(pygame.VIDEORESIZE, size=size, w=size[0], h=size[1])
        elif what < 0.985:
            self.driver.viewer.attempt(
                lambda: self.driver.window.commands.run_text(f"map {self.random.choice(MAPS)}")
            )
        else:
            self.drag()

    def key(self) -> None:
        if self.random.random() < 0.7:
            *held, last = self.random.choice(self.named).split("+")
            mod = sum(MODIFIERS[each] for each in held)
            code = KEYS.get(last) or pygame.key.key_code(last)
            text = last if len(last) == 1 and "ctrl" not in held else ""
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

    def type(self, text: str) -> None:
        if self.random.random() < 0.5:
            self.driver.post(pygame.KEYDOWN, key=pygame.K_k, mod=pygame.KMOD_LCTRL, unicode="", scancode=0)
        for letter in text:
            self.driver.post(pygame.TEXTINPUT, text=letter)
        if self.random.random() < 0.8:
            key = self.random.choice((pygame.K_RETURN, pygame.K_KP_ENTER, pygame.K_ESCAPE))
            self.driver.post(pygame.KEYDOWN, key=key, mod=0, unicode="", scancode=0)
            self.driver.post(pygame.KEYUP, key=key, mod=0, unicode="", scancode=0)

    def somewhere(self) -> tuple[int, int]:
        """Return a pixel: anywhere, rather often where there is something."""
        window, rng = self.driver.window, self.random
        width, height = window.layout.size
        what = rng.random()
        if what < 0.3:
            return rng.randint(-30, width + 30), rng.randint(-30, height + 30)
        panel = window.panel
        if what < 0.55 and panel.ui.widgets:
            box = rng.choice(list(panel.ui.widgets.values())).rect
            if panel.ui.open_list is not None and rng.random() < 0.7:
                box = panel.ui.open_list.rect
            return rng.randint(box.left, box.right), rng.randint(box.top, box.bottom)
        layout = window.layout
        boxes = [*layout.panes, layout.track, layout.chart, layout.panel, layout.panel]
        if what > 0.7 and window._arranged and window.canvas._scenes:
            session = self.driver.session
            pane = rng.randrange(min(len(session.timeline.panes), len(layout.panes)))
            x, y = rng.choice(session.displayed.get_positions(session.timeline.panes[pane]).tolist())
            at = self.driver.pixel((x, y), pane)
            return round(at[0]) + rng.randint(-3, 3), round(at[1]) + rng.randint(-3, 3)
        left, top, wide, high = rng.choice(boxes)
        return left + rng.randrange(max(wide, 1)), top + rng.randrange(max(high, 1))

    def move(self, at: tuple[int, int] | None = None) -> None:
        at = at or self.somewhere()
        rel = at[0] - self.driver.at[0], at[1] - self.driver.at[1]
        pygame.mouse.set_pos(at)
        pygame.event.clear(pygame.MOUSEMOTION)
        buttons = tuple(int(k in self.held) for k in (1, 2, 3))
        self.driver.post(pygame.MOUSEMOTION, pos=at, rel=rel, buttons=buttons)
        self.driver.at = at

    def button(self) -> None:
        if self.held and self.random.random() < 0.7:
            button = self.held.pop(self.random.randrange(len(self.held)))
            self.driver.post(pygame.MOUSEBUTTONUP, pos=self.driver.at, button=button)
            return
        if self.random.random() < 0.6:
            self.move()
        button = self.random.choice(BUTTONS)
        self.held.append(button)
        self.driver.post(pygame.MOUSEBUTTONDOWN, pos=self.driver.at, button=button)

    def drag(self) -> None:
        """Drag something by the whole of its way, and choose from what has opened."""
        for kind in (pygame.MOUSEBUTTONDOWN, pygame.MOUSEBUTTONUP):
            self.move()
            self.driver.post(kind, pos=self.driver.at, button=1)
            self.driver.window.advance(0.01)


@contextmanager
def limited(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    left = dict(MOST)
    do = ViewerWindow.do

    def seldom(window: ViewerWindow, name: str) -> None:
        if name in left:
            if left[name] == 0 and not (name == "video" and window.video is not None):
                return
            left[name] = max(left[name] - 1, 0)
        do(window, name)

    with monkeypatch.context() as patch:
        patch.setattr(ViewerWindow, "do", seldom)
        patch.setattr("driven_window.Costs", SomeCosts)
        yield


def check(driver: Driver) -> None:
    """Fail unless the state is one that can be."""
    session, window = driver.session, driver.window
    assert 1 <= len(session.timeline.panes) <= MAX_PANES == 4
    numbers = session.timeline.panes[0].numbers
    assert len(numbers) >= 1 and list(numbers) == sorted(set(numbers))
    for pane in session.timeline.panes:
        assert pane.numbers == numbers
        assert pane.setup.failed.keys() == session.timeline.panes[0].setup.failed.keys()
        assert pane.setup.environment is session.timeline.panes[0].setup.environment
        assert pane.simulation.positions.shape == (len(numbers), 2)
        assert np.isfinite(pane.simulation.positions).all() and np.isfinite(pane.simulation.velocities).all()
        assert pane.time == pytest.approx(session.timeline.end_time, abs=1e-6)
        assert (
            np.diff(pane.distance_curve.times) > 0
        ).all() and pane.distance_curve.last_time <= session.timeline.end_time + 1e-6
    assert compute_penetration(session) < 0.01
    assert 0.0 <= session.displayed.time <= session.timeline.end_time + 1e-9
    assert 0 <= driver.viewer.active_pane < MAX_PANES
    assert window.panel.tab in ("parameters", "show", "robot", "file")
    assert len(window.layout.panes) == len(session.timeline.panes)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1])
def test_it_bears_whatever_is_pressed(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    laws = (RAPF, RPF) if seed % 2 else (RAPF,)
    with limited(monkeypatch), open_viewer(tmp_path, *laws, robots=2, lattice=4) as driver:
        monkey = Monkey(driver, seed)
        for _ in range(5):
            monkey.play(EVENTS // 5)
            driver.settle()
            check(driver)
        usual(driver)
    assert len(list(tmp_path.iterdir())) <= 16


def usual(driver: Driver) -> None:
    """Fail unless a window that has borne all that can still be used."""
    window, viewer = driver.window, driver.viewer
    for button in (1, 2, 3):
        driver.release(button)
    pygame.display.set_mode((900, 600), pygame.RESIZABLE)
    driver.post(pygame.VIDEORESIZE, size=(900, 600), w=900, h=600)
    driver.post(pygame.WINDOWFOCUSLOST)  # so that no key is held any more
    driver.key("escape", 6)
    viewer.view.has_panel, window.scale, viewer.view.layers = True, 1.0, {"robots", "obstacles", "boundary"}
    while len(driver.session.timeline.panes) > 1:
        driver.session.remove_pane(driver.session.timeline.panes[-1])
    viewer.attempt(lambda: viewer.files.open_map("square"))
    run_text(viewer, "robots 2")
    for name in ("radius 0.1", "max_speed 1", "speed 1", "controller rapf"):
        run_text(viewer, name)
    driver.settle()
    driver.settle()
    driver.push("tool:hand")
    driver.key("f")
    driver.session.playback.is_playing = False
    driver.settle()
    driver.drag(driver.robot(1), driver.pixel((5.0, 5.0)))
    pane = driver.session.timeline.panes[0]
    assert np.allclose(pane.simulation.positions[0], (5.0, 5.0), atol=0.05)
    assert window.panel.tab == "robot"
    driver.push("pause")
    driver.frames(5)
    assert driver.session.playback.is_playing and driver.session.timeline.end_time > 0.0
    driver.turn("parameters")
    driver.write("k_rep", "0.75")
    driver.key("return")
    assert pane.controller.get_value("k_rep") == 0.75
    check(driver)
