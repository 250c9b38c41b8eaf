"""Draw the figures in README and handbook with the commands that their captions name."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

from robocov_app.cli import main

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
WIDTH_PX = 1400
SUFFIXES = {"light": "", "dark": "-dark"}


def draw_figure(name: str, theme: str) -> None:
    """Run the command of a figure in a theme, and save the figure as a small PNG file."""
    with TemporaryDirectory() as folder:
        out = Path(folder) / name
        status = main([*COMMANDS[name], "--theme", theme, "--out", str(out)])
        if status:
            raise SystemExit(status)
        image = Image.open(out / FIGURES[name]).convert("RGB")
    height = round(image.height * WIDTH_PX / image.width)
    image = image.resize((WIDTH_PX, height), Image.Resampling.LANCZOS)
    image = image.quantize(256, dither=Image.Dither.NONE)
    image.save(PICTURES / f"{name}{SUFFIXES[theme]}.png", optimize=True)


if __name__ == "__main__":
    for figure in COMMANDS:
        for figure_theme in SUFFIXES:
            draw_figure(figure, figure_theme)
