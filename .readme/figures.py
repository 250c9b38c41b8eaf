"""Draw the figures in README and handbook: with the commands that their captions name, and large plans."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from robocov_app.benchmark import suite
from robocov_app.cli import main
from robocov_app.figures.files import save_figure
from robocov_app.figures.map_sheets import plot_maps

PICTURES = Path(__file__).parents[1] / "app/handbook/pictures"
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
PLAN_COLORS = 16
"""Number of colors of the figure of the large plans, which contains shades of two colors only."""
WIDTH_PX = 1400
SHADED = Image.Quantize.MEDIANCUT
COLORED = Image.Quantize.FASTOCTREE
"""Choices of the colors of an image: the first suits shades, the second keeps the hues of lines apart."""
SUFFIXES = {"light": "", "dark": "-dark"}


def draw_figure(name: str, theme: str) -> None:
    """Run the command of a figure in a theme, and save the figure as a small PNG file."""
    with TemporaryDirectory() as folder:
        out = Path(folder) / name
        status = main([*COMMANDS[name], "--theme", theme, "--out", str(out)])
        if status:
            raise SystemExit(status)
        method = COLORED if FIGURES[name] == "trajectories.png" else SHADED
        save_small_image(out / FIGURES[name], f"{name}{SUFFIXES[theme]}.png", method=method)


def draw_large_plans(theme: str) -> None:
    """Draw the large plans of the benchmark in a theme, one track in each row."""
    names = [name for track in PLAN_TRACKS for name in suite.TRACKS[track].maps]
    figure = plot_maps([suite.build_map(name) for name in names], theme)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "plans.png"
        save_figure(figure, path)
        save_small_image(path, f"plans{SUFFIXES[theme]}.png", colors=PLAN_COLORS)


def save_small_image(source: Path, name: str, colors: int = 256, method: Image.Quantize = SHADED) -> None:
    """Reduce an image to the width of the handbook and a number of colors, and save it."""
    image = Image.open(source).convert("RGB")
    height = round(image.height * WIDTH_PX / image.width)
    image = image.resize((WIDTH_PX, height), Image.Resampling.LANCZOS)
    image = image.quantize(colors, method=method, dither=Image.Dither.NONE)
    image.save(PICTURES / name, optimize=True)


if __name__ == "__main__":
    for figure_theme in SUFFIXES:
        for figure_name in COMMANDS:
            draw_figure(figure_name, figure_theme)
        draw_large_plans(figure_theme)
