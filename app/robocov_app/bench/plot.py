"""The ratios of a benchmark as a figure: a dot each."""

from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import cast

from robocov_app.bench.measure import Row
from robocov_app.figures.files import plain_style, save_figure
from robocov_app.figures.page import HEADING, SMALL, TEXT, Page, quiet_axes, tone
from robocov_app.render.theme import LIGHT, Theme

NOTE = "medians of calls in turn on one thread; below 1 robocov is quicker; a bar marks what is wanted"
WIDTH = 1100
ABOVE, ROW, LEFT, RIGHT = 92, 26, 400, 90  # pixels: for the title, for a line, for its words, for its value
GAP = 66  # pixels between what belongs to one part and the next, for its heading
HEADINGS = {
    "step": "Simulated step", "maps": "Exact coverage cost on maps",
    "cost": "Exact coverage cost among random obstacles", "learning": "Learning environments",
    "sweep": "Sweeps", "render": "Pictures", "window": "Window", "start": "Start",
}  # fmt: skip


def save_ratios(rows: Sequence[Row], path: Path, theme: Theme = LIGHT) -> None:
    """Draw every ratio and every goal on logarithmic axes, and write them as `save_figure` does."""
    rows = [row for row in rows if row.ratio is not None]
    parts = [(part, list(group)) for part, group in groupby(rows, key=lambda row: row.part)]
    height = ABOVE + sum(GAP + ROW * len(group) + 16 for _, group in parts)
    with plain_style():
        page = Page((WIDTH, height), theme, scale=1.0)
        page.text("Time as a multiple of the yardstick's", 24, 30, points=HEADING, bold=True)
        page.text(NOTE, 24, 58, colour=theme.faint)
        top = float(ABOVE)
        for part, group in parts:
            _draw_part(page, HEADINGS[part], group, top)
            top += GAP + ROW * len(group) + 16
    save_figure(page.figure, path)


def _draw_part(page: Page, heading: str, rows: Sequence[Row], top: float) -> None:
    theme = page.theme
    page.text(heading, 24, top + 16, points=TEXT + 1.5, bold=True)
    axes = page.axes((LEFT, top + GAP - 26, WIDTH - LEFT - RIGHT, ROW * len(rows)))
    quiet_axes(axes, theme, grid="x")
    axes.set_xscale("log")
    values = [1.0, *(value for row in rows for value in (row.ratio, row.goal) if value is not None)]
    low, high = 0.75 * min(values), 1.35 * max(values)
    axes.axvline(1.0, color=tone(theme.faint), linewidth=1)
    for place, row in enumerate(rows):
        ratio, y = cast("float", row.ratio), len(rows) - 1 - place
        colour = tone(theme.controller("rpf" if row.met is False else "rapf"))
        axes.plot([1.0, ratio], [y, y], color=colour, linewidth=1.6, alpha=0.5)
        axes.plot(ratio, y, "o", color=colour, markersize=6.5)
        if row.goal is not None:
            axes.plot([row.goal] * 2, [y - 0.36, y + 0.36], color=tone(theme.ink), linewidth=2)
        words = f"{', '.join(filter(None, (row.name, row.case)))}  /  {row.yardstick}"
        middle = top + GAP - 26 + ROW * (place + 0.5)
        page.text(words, LEFT - 14, middle, points=SMALL, room=LEFT - 38, align="right")
        page.text(f"{ratio:.2f}", WIDTH - RIGHT + 14, middle, points=SMALL, bold=row.met is False)
    axes.set_ylim(-0.5, len(rows) - 0.5)
    axes.set_xlim(low, high)
    ticks = _ticks(low, high)
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.set_yticks([])
    axes.minorticks_off()


def _ticks(low: float, high: float) -> list[float]:
    """Return round numbers between two bounds, few enough to be read.

    >>> _ticks(0.08, 6.0)
    [0.1, 0.2, 0.5, 1.0, 2.0, 5.0]
    """
    for leading in ((1, 2, 5), (1, 3), (1,)):
        numbers = [float(f"{digit}e{power}") for power in range(-4, 6) for digit in leading]
        found = [tick for tick in numbers if low <= tick <= high]
        if len(found) <= 7:
            break
    return found
