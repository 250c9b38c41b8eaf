"""The maps of distances, as the command line gives them."""

import json
from pathlib import Path

import numpy as np
import pytest
from called import SHORT, read_error
from PIL import Image

from robocov_app.cli import main

MIN_BLUE = 60
"""Difference of blue and red above which a pixel is blue; that of pale cells is less."""


def read_frames(folder: Path) -> list[np.ndarray]:
    return [np.array(Image.open(path)).astype(int) for path in sorted((folder / "frames").iterdir())]


@pytest.mark.parametrize("words", [("run", "trap"), ("compare", "trap", "--controllers", "rapf", "lloyd")])
@pytest.mark.slow
def test_layers_are_shown_and_hidden_in_films(words: tuple[str, ...], tmp_path: Path) -> None:
    for name, more in (
        ("plain", ()),
        ("bare", ("--hide", "cells", "grid")),
        ("warm", ("--show", "distances")),
    ):
        options = (*SHORT, "--frames", "--fps", "2", "--video-speed", "1", "--out", str(tmp_path / name))
        assert main([*words, *options, *more]) == 0
    plain = read_frames(tmp_path / "plain")
    bare = read_frames(tmp_path / "bare")
    warm = read_frames(tmp_path / "warm")
    assert len(plain) == len(bare) == len(warm) >= 3
    # tints of cells are many colors; without them the page is mostly white, with distances mostly blue
    assert (bare[0] == 255).all(axis=2).mean() > (plain[0] == 255).all(axis=2).mean() + 0.2
    blue = (warm[0][..., 2] - warm[0][..., 0] > MIN_BLUE).mean()
    assert blue > (plain[0][..., 2] - plain[0][..., 0] > MIN_BLUE).mean() + 0.1


@pytest.mark.parametrize("option", ["--show", "--hide"])
def test_unknown_layers_are_rejected_before_the_run(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    message = read_error(capsys, "run", "trap", *SHORT, option, "distanses", "--out", str(out))
    assert message.startswith(f"{option}: unknown layer 'distanses': did you mean 'distances'?")
    assert not out.exists()


@pytest.mark.slow
def test_cost_draws_a_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robots = tmp_path / "robots.json"
    robots.write_text(json.dumps([[1.0, 1.0], [8.0, 4.0]]))
    for name in ("light.png", "map.svg"):
        assert main(["cost", "rooms", "--positions", str(robots), "--plot", str(tmp_path / name)]) == 0
    dark = tmp_path / "dark.png"
    assert main(["cost", "rooms", "--positions", str(robots), "--plot", str(dark), "--theme", "dark"]) == 0
    capsys.readouterr()
    assert np.array(Image.open(tmp_path / "light.png"))[0, 0, :3].min() == 255
    assert np.array(Image.open(dark))[0, 0, :3].max() < 50
    assert (tmp_path / "map.svg").read_text().startswith("<?xml")


def test_an_unwritable_map_is_reported_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("cost", "rooms", "--positions", str(tmp_path / "missing.json"), "--plot")
    assert "'.jpg'" in read_error(capsys, *words, str(tmp_path / "a.jpg"))
    assert "there is no folder" in read_error(capsys, *words, str(tmp_path / "b" / "a.png"))
