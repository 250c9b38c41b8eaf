"""The page of a plot: a matplotlib figure of an exact size, laid out in pixels from its top left."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from robocov_app.view.theme import Colour, Theme

TITLE, TEXT, SMALL = 12.5, 9.5, 8.5
"""Text sizes in points."""

Box: TypeAlias = tuple[float, float, float, float]
"""Left, top, width and height in pixels."""


def plain_style() -> AbstractContextManager[None]:
    """Return a context in which matplotlib draws alike whatever style its user has set."""
    import matplotlib.style

    style: dict[str, Any] = {"font.family": "DejaVu Sans", "text.usetex": False, "axes.unicode_minus": True}
    return matplotlib.style.context(["default", style])


def tone(colour: Colour) -> tuple[float, float, float]:
    """Return a colour as matplotlib wants it."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


class Page:
    """A figure with a title and a legend that keep clear of what is plotted.

    Attributes
    ----------
    figure : matplotlib.figure.Figure
    size : (width, height), px
    scale : float
        Pixels for what is one pixel on a page of 1200 x 800.
    """

    def __init__(self, size: tuple[int, int], theme: Theme) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.size = size
        self.theme = theme
        self.scale = min(max(min(size[0] / 1200, size[1] / 800), 0.8), 4.0)
        dpi = 100.0 * self.scale
        # the pixels are counted by truncation: a hair more keeps 899.9999 at 900
        inches = ((size[0] + 1e-3) / dpi, (size[1] + 1e-3) / dpi)
        self.figure: Figure = Figure(figsize=inches, dpi=dpi, facecolor=tone(theme.background))
        FigureCanvasAgg(self.figure)

    @property
    def margin(self) -> float:
        """Pixels that stay free at the edges."""
        return 18.0 * self.scale

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return a pixel as fractions of the figure, which hold for every resolution."""
        return x / self.size[0], 1.0 - y / self.size[1]

    def axes(self, box: Box) -> Axes:
        """Return axes that fill `box`."""
        left, top, width, height = box
        x, y = self.at(left, top + height)
        return self.figure.add_axes((x, y, width / self.size[0], height / self.size[1]))

    def panels(self, count: int, columns: int, aspect: float, words: float) -> list[tuple[Box, float]]:
        """Return equal boxes in rows, and how wide the lines above each may be.

        Parameters
        ----------
        count, columns : int
        aspect : float
            Width by height of each box.
        words : float, px
            How wide the lines above would be; slots grow for them as far as there is room.
        """
        rows = -(-count // columns)
        above, gap, below = 52 * self.scale, 6 * self.scale, 70 * self.scale
        widest = (self.size[0] - self.margin) / columns - self.margin
        highest = (self.size[1] - below - self.margin / 2) / rows - above - gap
        width = min(widest, highest * aspect)
        height = width / aspect
        slot = min(max(width, words), widest)
        left = (self.size[0] - columns * slot - (columns - 1) * self.margin) / 2
        block = above + height + gap
        top = max((self.size[1] - below - rows * block) / 2, self.margin / 2)
        boxes = []
        for number in range(count):
            row, column = divmod(number, columns)
            x, y = left + column * (slot + self.margin), top + row * block + above
            boxes.append(((x, y, width, height), slot))
        return boxes

    def text(
        self,
        text: str,
        x: float,
        y: float,
        *,
        points: float = TEXT,
        bold: bool = False,
        colour: Colour | None = None,
        room: float | None = None,
        align: str = "left",
    ) -> None:
        """Write one line, its middle at height `y`; with `room` it is cut to so many pixels."""
        written = self.figure.text(
            *self.at(x, y),
            text,
            fontsize=points,
            fontweight="bold" if bold else "normal",
            color=tone(colour or self.theme.ink),
            ha=align,
            va="center",
        )
        while room is not None and len(text) > 1 and self.width_of(written) > room:
            text = text[:-1]
            written.set_text(text.rstrip(" ·") + "…")

    def text_width(self, text: str, *, points: float = TEXT, bold: bool = False) -> float:
        """Return how wide a line would be, in pixels."""
        written = self.figure.text(0, 0, text, fontsize=points, fontweight="bold" if bold else "normal")
        width = self.width_of(written)
        written.remove()
        return width

    def width_of(self, artist: Any) -> float:
        """Return how wide a text or legend is, in pixels."""
        return float(artist.get_window_extent(self.figure.canvas.get_renderer()).width)  # type: ignore[attr-defined]

    def legend(self, handles: list[Artist], top: float) -> float:
        """Put the legend in rows in the middle, its upper edge at `top`; return its height in pixels."""
        room = self.size[0] - self.margin
        for columns in range(len(handles), 0, -1):
            legend = self.figure.legend(
                handles=handles,
                loc="upper center",
                bbox_to_anchor=self.at(self.size[0] / 2, top),
                ncols=columns,
                frameon=False,
                fontsize=SMALL,
                labelcolor=tone(self.theme.ink),
                borderaxespad=0.0,
                borderpad=0.0,
                columnspacing=1.8,
                handletextpad=0.6,
                handlelength=1.6,
            )
            extent = legend.get_window_extent(self.figure.canvas.get_renderer())  # type: ignore[attr-defined]
            if extent.width <= room or columns == 1:
                return float(extent.height)
            legend.remove()
        return 0.0
