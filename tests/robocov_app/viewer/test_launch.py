"""Opening the window from the command line, with and without a display."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pygame
import pytest
from command_calls import COMMAND, read_error
from PIL import Image
from sample_sessions import start_session

from robocov_app.cli import main
from robocov_app.commands import demo
from robocov_app.commands.demo import Arguments, build_session
from robocov_app.storage.settings import FOLDER_VARIABLE
from robocov_app.toolkit.window.display import fit_to_screen, get_screen_scale, open_display
from robocov_app.viewer.launch import NO_DISPLAY, ViewerLauncher
from robocov_app.viewer.session.clock import FRAME_BUDGET_S

SHORT = ("--lattice", "8", "--size", "900x600")


@pytest.fixture(autouse=True)
def _no_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, "")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")  # restored after the test


@pytest.mark.skipif(sys.platform != "linux", reason="a display can be missing on Linux only")
def test_a_missing_display_is_reported_in_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    assert read_error(capsys, "demo", "square") == NO_DISPLAY


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="X11")
def test_a_display_that_does_not_answer_is_reported(tmp_path: Path) -> None:
    environment = dict(os.environ)
    environment.pop("WAYLAND_DISPLAY", None)
    environment.pop("SDL_VIDEODRIVER", None)
    environment |= {"DISPLAY": ":987654", FOLDER_VARIABLE: "", "XDG_RUNTIME_DIR": str(tmp_path)}
    done = subprocess.run(
        [*COMMAND, "demo", "square"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.splitlines() == [f"robocov: error: {NO_DISPLAY}"]


def save_frames(folder: Path, *options: str) -> list[np.ndarray]:
    """Save three frames of the demo, and return their pixels."""
    assert main(["demo", "square", *SHORT, "--frames", "3", "--out", str(folder), *options]) == 0
    paths = sorted(folder.glob("[!.]*"))
    assert [path.name for path in paths] == ["000000.png", "000001.png", "000002.png"]
    return [np.asarray(Image.open(path).convert("RGB")) for path in paths]


def test_frames_are_saved_without_a_display(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frames = save_frames(tmp_path / "frames", "--robots", "2")
    assert capsys.readouterr().out.splitlines() == [f"saved {tmp_path / 'frames'}"]
    assert all(frame.shape == (600, 900, 3) for frame in frames)
    assert not np.array_equal(frames[0], frames[2])


@pytest.mark.slow
def test_equal_options_lead_to_equal_frames(tmp_path: Path) -> None:
    options = ("--controllers", "rapf", "rpf", "--robots", "3", "--show", "scan", "distances", "--seed")
    first = save_frames(tmp_path / "first", *options, "4")
    second = save_frames(tmp_path / "second", *options, "4")
    for first_frame, second_frame in zip(first, second, strict=True):
        assert np.array_equal(first_frame, second_frame)
    other_seed = save_frames(tmp_path / "other", *options, "5")
    assert not np.array_equal(first[0], other_seed[0])


def test_a_video_has_all_frames_and_the_requested_size(tmp_path: Path) -> None:
    path = tmp_path / "window.mp4"
    command = ["demo", "square", *SHORT, "--frames", "8", "--video", str(path), "--theme", "dark"]
    assert main([*command, "--robots", "1", "--speed", "4"]) == 0
    assert imageio_ffmpeg.count_frames_and_secs(str(path))[0] == 8
    assert next(imageio_ffmpeg.read_frames(str(path)))["size"] == (900, 600)


def test_an_early_ctrl_c_leaves_a_video_of_one_frame(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(demo, "_start_lesson", lambda *_: signal.raise_signal(signal.SIGINT))
    path = tmp_path / "window.mp4"
    assert main(["demo", "square", *SHORT, "--frames", "8", "--video", str(path), "--robots", "1"]) == 130
    assert capsys.readouterr().out == f"Interrupted. Partial results are in {path}.\n"
    assert imageio_ffmpeg.count_frames_and_secs(str(path))[0] == 1


def test_frames_neither_read_nor_write_settings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "settings"
    folder.mkdir()
    (folder / "window.json").write_text('{"theme": "dark", "width": 1000}')
    before = (folder / "window.json").read_text()
    monkeypatch.setenv(FOLDER_VARIABLE, str(folder))
    (first, *_) = save_frames(tmp_path / "frames", "--robots", "1")
    assert first.mean() > 190
    assert [path.name for path in folder.iterdir()] == ["window.json"]
    assert (folder / "window.json").read_text() == before


def test_existing_frames_are_not_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "000000.png").write_text("mine")
    message = read_error(capsys, "demo", "square", *SHORT, "--frames", "2", "--out", str(tmp_path))
    assert str(tmp_path) in message
    assert (tmp_path / "000000.png").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("nowhere",), "nowhere"),
        (("square", "--robots", "0"), "--robots"),
        (("square", "--robots", "1001"), "--robots"),
        (("square", "--start", "nowhere"), "nowhere"),
        (("square", "--seed", "-1"), "--seed"),
        (("square", "--controllers", "nobody"), "nobody"),
        (("square", "--controllers", *("rapf",) * 5), "--controllers: expected 1 to 4, got 5"),
        (("square", "--controllers", "mine.py:Mine"), "mine.py"),
        (("square", "--set", "k_rep=much"), "k_rep"),
        (("square", "--set", "k_none=1"), "k_none"),
        (("square", "--size", "100x100"), "--size"),
        (("square", "--size", "wide"), "--size"),
        (("square", "--scale", "0.1"), "--scale"),
        (("square", "--speed", "0"), "--speed"),
        (("square", "--lattice", "1"), "--lattice"),
        (("square", "--dt", "0"), "dt"),
        (("square", "--radius", "-1"), "radius"),
        (("square", "--show", "ghosts"), "ghosts"),
        (("square", "--hide", "ghosts"), "ghosts"),
        (("square", "--frames", "3"), "--out"),
        (("square", "--frames", "0", "--out", "x"), "--frames"),
        (("square", "--out", "x"), "--frames"),
        (("square", "--video", "x.mp4"), "--frames"),
        (("square", "--frames", "2", "--video", "x.gif"), ".mp4"),
    ],
)
def test_invalid_options_are_reported_in_one_line(
    arguments: tuple[str, ...], part: str, capsys: pytest.CaptureFixture[str], monkeypatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SDL_VIDEODRIVER")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.setenv(name, ":987654")  # a display that cannot be opened
    assert part in read_error(capsys, "demo", *arguments)
    assert list(tmp_path.iterdir()) == []


def test_the_session_starts_with_the_options() -> None:
    options = Arguments(
        controllers=("rpf", "lloyd"),
        gains=("k_rep=2",),
        paused=True,
        robots=4,
        start="kitchen",
        seed=7,
        dt=0.05,
        radius=0.15,
        speed=2.0,
    )
    session = build_session(options)
    assert [pane.controller.name for pane in session.timeline.panes] == ["rpf", "lloyd"]
    assert session.timeline.panes[0].controller.get_value("k_rep") == 2.0
    scenario = session.timeline.scenario
    assert (scenario.robots, scenario.start_name, scenario.seed, scenario.dt) == (4, "kitchen", 7, 0.05)
    assert scenario.properties.radius == 0.15
    assert session.playback.clock.speed == 2.0
    assert not session.playback.is_playing


def test_the_display_is_closed_after_an_error() -> None:
    with pytest.raises(ZeroDivisionError), open_display(headless=True):
        assert pygame.display.get_init()
        1 / 0
    assert not pygame.display.get_init()


@pytest.mark.parametrize(
    ("height", "scale"), [(768, 1.0), (1080, 1.0), (1440, 1.25), (2160, 2.0), (4320, 3.0)]
)
def test_the_scale_depends_on_the_screen(height: int, scale: float, monkeypatch) -> None:
    monkeypatch.setattr(pygame.display, "get_desktop_sizes", lambda: [(height * 16 // 9, height)])
    assert get_screen_scale() == scale
    assert fit_to_screen((3000, 500)) == (min(3000, height * 16 // 9), 500)


def test_unreadable_settings_are_reported_and_kept(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    (tmp_path / "window.json").write_text("{ nonsense")
    with ViewerLauncher(start_session(), "hall", tmp_path, lattice=4, size=(900, 600)).window() as window:
        assert "default settings" in window.viewer.message
        window.close()
    assert (tmp_path / "window.json").read_text() == "{ nonsense"


def test_options_are_not_saved_in_the_settings(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    file = tmp_path / "window.json"
    file.write_text('{"width": 1000, "height": 700, "shown": ["cells", "robots"]}')
    launcher = ViewerLauncher(
        start_session(),
        "hall",
        tmp_path,
        lattice=4,
        theme="dark",
        size=(900, 600),
        scale=2.0,
        shown_layers=frozenset({"scan"}),
        hidden_layers=frozenset({"cells"}),
    )
    with launcher.window() as window:
        assert window.viewer.view.layers == {"robots", "scan"}
        assert window.viewer.view.theme == "dark"
        assert window.viewer.session.playback.clock.budget == FRAME_BUDGET_S
        window.viewer.view.layers.add("trails")
    settings = json.loads(file.read_text())
    assert [settings[name] for name in ("theme", "width", "height", "scale")] == ["light", 1000, 700, None]
    assert settings["shown"] == ["cells", "robots", "trails"]


def test_layers_are_shown_and_hidden_by_options(tmp_path: Path) -> None:
    launcher = ViewerLauncher(
        start_session(),
        "hall",
        tmp_path,
        headless=True,
        lattice=4,
        shown_layers=frozenset({"scan"}),
        hidden_layers=frozenset({"cells"}),
    )
    with launcher.window() as window:
        assert "scan" in window.viewer.view.layers
        assert "cells" not in window.viewer.view.layers
        assert math.isinf(window.viewer.session.playback.clock.budget), "nobody waits for the frames"
        window.close()


def test_gains_apply_to_all_controllers_or_to_one() -> None:
    options = Arguments(map="square", controllers=("rapf", "rpf", "lloyd"), gains=("k_rep=2", "rpf.k_rep=3"))
    controllers = build_session(options).timeline.scenario.controllers
    assert [choice.gains for choice in controllers] == [{"k_rep": 2}, {"k_rep": 3}, {}]
