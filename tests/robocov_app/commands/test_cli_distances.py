"""Maps of distances in videos and figures of the command line."""

import json
from pathlib import Path

import numpy as np
import pytest
from command_calls import SHORT, read_error
from PIL import Image

from robocov_app.cli import main

MIN_BLUE = 60
"""Minimum difference of blue and red in a blue pixel; in pale cells the difference is smaller."""


def read_frames(folder: Path) -> list[np.ndarray]:
    return [np.array(Image.open(path)).astype(int) for path in sorted((folder / "frames").iterdir())]


def compute_white_fraction(frame: np.ndarray) -> float:
    return float((frame == 255).all(axis=2).mean())


def compute_blue_fraction(frame: np.ndarray) -> float:
    return float((frame[..., 2] - frame[..., 0] > MIN_BLUE).mean())


@pytest.mark.parametrize(
    "arguments", [("run", "trap"), ("compare", "trap", "--controllers", "rapf", "lloyd")]
)
@pytest.mark.slow
def test_layers_are_shown_and_hidden_in_videos(arguments: tuple[str, ...], tmp_path: Path) -> None:
    layer_options = {
        "default": (),
        "without-cells": ("--hide", "cells", "grid"),
        "with-distances": ("--show", "distances"),
    }
    frames = {}
    for name, options in layer_options.items():
        video = ("--frames", "--fps", "2", "--video-speed", "1", "--out", str(tmp_path / name))
        assert main([*arguments, *SHORT, *video, *options]) == 0
        frames[name] = read_frames(tmp_path / name)
    assert len(frames["default"]) == len(frames["without-cells"]) == len(frames["with-distances"]) >= 3
    default, without_cells, with_distances = (frames[name][0] for name in layer_options)
    # Without the tints of cells, a frame is mostly white; with distances it is mostly blue.
    assert compute_white_fraction(without_cells) > compute_white_fraction(default) + 0.2
    assert compute_blue_fraction(with_distances) > compute_blue_fraction(default) + 0.1


@pytest.mark.parametrize("option", ["--show", "--hide"])
def test_unknown_layers_are_rejected_before_the_run(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "run"
    message = read_error(capsys, "run", "trap", *SHORT, option, "distanses", "--out", str(out))
    assert message.startswith(f"{option}: unknown layer 'distanses': did you mean 'distances'?")
    assert not out.exists()


@pytest.mark.slow
def test_cost_draws_a_map_of_distances(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
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


def test_an_unwritable_figure_is_reported_before_missing_positions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ("cost", "rooms", "--positions", str(tmp_path / "missing.json"), "--plot")
    assert "'.jpg'" in read_error(capsys, *arguments, str(tmp_path / "a.jpg"))
    assert "there is no folder" in read_error(capsys, *arguments, str(tmp_path / "b" / "a.png"))
