"""Run `robocov paper` with the tiny study, as a program of its own that tests can interrupt."""

import sys
from pathlib import Path

from matplotlib.figure import Figure
from tiny_paper import TINY

from robocov_app.cli import main
from robocov_app.figures.files import save_figure
from robocov_app.replication.design import plan
from robocov_app.replication.figures import figure_files

SAVED_FIGURES = ("figure-4.png", "figure-5-limited.svg", "figure-6-best.pdf")
"""Figures that the command saves; the others would only take time."""


def save_selected_figure(figure: Figure, path: Path) -> None:
    """Save a figure if it is one of `SAVED_FIGURES`."""
    if path.name in SAVED_FIGURES:
        save_figure(figure, path)


if __name__ == "__main__":
    plan.QUICK = TINY
    figure_files.save_figure = save_selected_figure
    sys.exit(main(["paper", "--quick", "--without-beyond", *sys.argv[1:]]))
