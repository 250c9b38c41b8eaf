"""Draw the figures in README and handbook: with the commands that their captions name, and maps."""

from __future__ import annotations

import runpy
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image
from small_images import reduce_colors

from robocov import Environment
from robocov_app.benchmark import suite
from robocov_app.cli import main
from robocov_app.figures.files import save_figure
from robocov_app.figures.map_sheets import plot_maps

PICTURES = Path(__file__).parents[1] / "app/handbook/pictures"
NEW_FAMILIES = Path(__file__).parents[1] / "tests/bench/new_families.py"
COMMANDS = {
    "first-run": ("run", "rooms"),
    "hospital": ("run", "hospital"),
    "museum": ("compare", "museum"),
    "trap": ("compare", "trap", "--controllers", "rapf", "lloyd", "atlas"),
}
"""Arguments of `robocov` that draw each figure."""
FIGURES = {
    "first-run": "cost.png",
    "hospital": "trajectories.png",
    "museum": "trajectories.png",
    "trap": "trajectories.png",
}
"""File in the result folder of the command that is shown."""
PLAN_TRACKS = ("plans-small", "plans-medium", "plans-large", "plans-crowd")
"""Tracks of the benchmark whose maps are the large plans."""
FIGURE_SHADES = 256
MAP_SHADES = 16
"""Numbers of colors of a figure with a color scale, and of maps, which contain shades of two colors."""
WIDTH_PX = 1400
SUFFIXES = {"light": "", "dark": "-dark"}


def draw_figure(name: str, theme: str) -> None:
    """Run the command of a figure in a theme, and save the figure as a small PNG file."""
    with TemporaryDirectory() as folder:
        out = Path(folder) / name
        status = main([*COMMANDS[name], "--theme", theme, "--out", str(out)])
        if status:
            raise SystemExit(status)
        image = resize_image(out / FIGURES[name])
    if FIGURES[name] == "trajectories.png":
        image = reduce_colors(np.asarray(image))
    else:
        image = reduce_shades(image, FIGURE_SHADES)
    image.save(PICTURES / f"{name}{SUFFIXES[theme]}.png", optimize=True)


def draw_large_plans(theme: str) -> None:
    """Draw the large plans of the benchmark in a theme, one track in each row."""
    names = [name for track in PLAN_TRACKS for name in suite.TRACKS[track].maps]
    draw_maps("plans", [suite.build_map(name) for name in names], theme)


def draw_new_families(theme: str) -> None:
    """Draw the first map of each of the five kinds that are not in the benchmark, in a theme."""
    script = runpy.run_path(str(NEW_FAMILIES))
    maps = [script["build_map"](family, script["SEEDS"][0]) for family in script["FAMILIES"]]
    draw_maps("new-families", maps, theme)


def draw_maps(name: str, maps: Sequence[Environment], theme: str) -> None:
    """Draw maps in a theme, and save the figure as a small PNG file."""
    figure = plot_maps(maps, theme)
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.png"
        save_figure(figure, path)
        image = reduce_shades(resize_image(path), MAP_SHADES)
    image.save(PICTURES / f"{name}{SUFFIXES[theme]}.png", optimize=True)


def resize_image(source: Path) -> Image.Image:
    """Return an image with the width of the handbook."""
    image = Image.open(source).convert("RGB")
    height = round(image.height * WIDTH_PX / image.width)
    return image.resize((WIDTH_PX, height), Image.Resampling.LANCZOS)


def reduce_shades(image: Image.Image, colors: int) -> Image.Image:
    """Reduce an image that consists of shades of a few colors to a number of colors."""
    return image.quantize(colors, dither=Image.Dither.NONE)


if __name__ == "__main__":
    for figure_theme in SUFFIXES:
        for figure_name in COMMANDS:
            draw_figure(figure_name, figure_theme)
        draw_large_plans(figure_theme)
        draw_new_families(figure_theme)
