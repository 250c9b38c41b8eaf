"""The page of a plot: a matplotlib figure of an exact size, laid out in pixels from its top left."""

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias, cast

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from robocov.arrays import Array
from robocov.errors import ParameterError
from robocov_app.figures.files import figure_png
from robocov_app.look.axes import MAX_VALUE_INTERVALS, TICK_FACTORS, VALUE_MARGIN, choose_value_limits
from robocov_app.look.colors import Color
from robocov_app.look.lengths import format_scale_length, round_down
from robocov_app.look.theme import Theme

HEADING, TITLE, TEXT, SMALL = 14.0, 12.5, 9.5, 8.5  # text sizes in points
Box: TypeAlias = tuple[float, float, float, float]  # left, top, width and height in pixels
Tone: TypeAlias = tuple[float, float, float]  # a color as matplotlib has it


def tone(color: Color) -> Tone:
    red, green, blue = color
    return red / 255, green / 255, blue / 255


def figure_of(axes: Axes) -> Figure:
    return cast("Figure", axes.get_figure(root=True))


def check_some(what: str, items: Sequence[object]) -> None:
    if not items:
        raise ParameterError(f"{what}: expected at least one, got none")


def quiet_axes(axes: Axes, theme: Theme, x: str = "", y: str = "", grid: Literal["x", "y", ""] = "") -> None:
    """Give axes the theme's colors, labels, a quiet grid, and no frame but the bottom below a grid."""
    ink, faint = tone(theme.ink), tone(theme.faint)
    axes.set_facecolor(tone(theme.background))
    axes.tick_params(colors=faint, labelcolor=ink, labelsize=SMALL, left=False)
    axes.set_xlabel(x, fontsize=TEXT, color=ink)
    if y:  # level words are read more easily than words on their side
        axes.set_ylabel(y, fontsize=TEXT, color=ink)
        axes.yaxis.label.set(rotation=0, ha="left", va="bottom")
        axes.yaxis.set_label_coords(0.0, 1.03)
    for side, spine in axes.spines.items():
        spine.set_visible(bool(grid) and side == "bottom")
        spine.set_color(faint)
    if grid:
        axes.grid(axis=grid, color=tone(theme.grid), linewidth=0.8, alpha=0.7)
        axes.set_axisbelow(True)


def set_even_ticks(axis: Any, max_intervals: int) -> None:
    """Give an axis round ticks in at most so many intervals; they follow when a notebook zooms."""
    axis.set_major_locator(MaxNLocator(nbins=max_intervals, steps=list(TICK_FACTORS)))
    axis.set_major_formatter("{x:g}")


def set_value_axis(axis: Any, values: Array, *, margin: float = VALUE_MARGIN, origin: float = 0.0) -> None:
    """Give an axis the limits and ticks that suit finite values, see `choose_value_limits`."""
    low = float(values.min())
    high = float(values.max())
    limits = choose_value_limits(low, high, margin=margin, origin=origin)
    axis.axes.set(**{f"{axis.axis_name}lim": limits})
    set_even_ticks(axis, MAX_VALUE_INTERVALS)


class PageAxes(Axes):
    """Axes of a page, for which a notebook shows the page: without pyplot it would show no figure."""

    def _repr_png_(self) -> tuple[bytes, dict[str, Any]]:
        """Return the page as PNG, how wide it is to be shown, and its words for who cannot see it."""
        page = figure_of(self)
        words = [text.get_text() for text in page.texts if text.get_text()]
        # a dot of the page at 100 dots an inch is a pixel of the screen
        return figure_png(page), {"width": round(page.bbox.width * 100 / page.dpi), "alt": "; ".join(words)}


class Page:
    """A figure laid out in pixels; texts and lines are `scale` times those at 100 dots an inch."""

    def __init__(self, size: tuple[int, int], theme: Theme, scale: float | None = None) -> None:
        self.size, self.theme = size, theme
        self.scale = min(max(min(size[0] / 960, size[1] / 640), 0.8), 6.0) if scale is None else scale
        self.margin = 18.0 * self.scale  # pixels that stay free at the edges
        self.room = size[0] - 2 * self.margin  # between the margins
        self._longest_bar = max(min(120 * self.scale, size[0] / 7), 20.0)
        dpi = 100.0 * self.scale
        # the pixels are counted by truncation: a hair more keeps 899.9999 at 900
        inches = ((size[0] + 1e-3) / dpi, (size[1] + 1e-3) / dpi)
        self.figure = Figure(figsize=inches, dpi=dpi, facecolor=tone(theme.background))
        FigureCanvasAgg(self.figure)

    def at(self, x: float, y: float) -> tuple[float, float]:
        return x / self.size[0], 1.0 - y / self.size[1]

    def axes(self, box: Box) -> Axes:
        """Return axes that fill `box`; a notebook shows the page for them."""
        left, top, width, height = box
        x, y = self.at(left, top + height)
        return self.figure.add_axes((x, y, width / self.size[0], height / self.size[1]), axes_class=PageAxes)

    def map_axes(self, box: Box, low_x: float, low_y: float, high_x: float, high_y: float) -> Axes:
        """Return axes without ticks that show a part of the world, m, in a box of its shape."""
        axes = self.axes(box)
        axes.set(xlim=(low_x, high_x), ylim=(low_y, high_y))
        axes.set_axis_off()
        return axes

    def title(self, text: str, y: float, room: float | None = None) -> None:
        """Write the title at the left margin, at so many pixels at scale 1 from the top."""
        room = self.room if room is None else room
        self.text(text, self.margin, y * self.scale, points=TITLE, bold=True, room=room)

    def panels(
        self, count: int, columns: int, aspect: float, words: float, above: float, top: float, below: float
    ) -> list[tuple[Box, float]]:
        """Return equal boxes, px, and how wide lines above each may be: `words` where there is room."""
        rows, gap = -(-count // columns), 14 * self.scale
        widest = (self.size[0] - self.margin) / columns - self.margin
        highest = (self.size[1] - top - below + gap) / rows - above - gap
        width = min(widest, highest * aspect)
        height = width / aspect
        slot, block = min(max(width, words), widest), above + height + gap
        left = (self.size[0] - columns * slot - (columns - 1) * self.margin) / 2
        top += max((self.size[1] - top - below + gap - rows * block) / 2, 0.0)
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
        color: Color | None = None,
        room: float | None = None,
        align: str = "left",
    ) -> None:
        """Write one line, its middle at height `y`; with `room` it is cut to so many pixels."""
        style: Any = {"fontsize": points, "fontweight": "bold" if bold else "normal", "ha": align}
        style |= {"va": "center", "color": tone(color or self.theme.ink)}
        written = self.figure.text(*self.at(x, y), text, **style)
        # the same words are up to a pixel wider in one place than in another
        while room is not None and len(text) > 1 and self.width_of(written) > room + 1:
            text = text[:-1]
            written.set_text(text.rstrip(" ·") + "…")

    def text_width(self, text: str, *, points: float = TEXT, bold: bool = False) -> float:
        written = self.figure.text(0, 0, text, fontsize=points, fontweight="bold" if bold else "normal")
        width = self.width_of(written)
        written.remove()
        return width

    def width_of(self, artist: Any) -> float:
        return float(artist.get_window_extent(self.figure.canvas.get_renderer()).width)  # type: ignore[attr-defined]

    def footer_height(self, handles: Sequence[Artist], begin: float = 0) -> float:
        begin = max(begin, self.margin)
        columns, width, height = self._legend_extent(handles, begin)
        if columns == len(handles) and width <= self._beside_bar(begin):
            return 46 * self.scale
        return 36 * self.scale + height + 14 * self.scale

    def footer(self, handles: Sequence[Artist], boxes: Sequence[Box], zoom: float, begin: float = 0) -> None:
        """Draw the scale bar, at `zoom` px/m, and the legend below `boxes`; nothing left of `begin` px."""
        begin = max(begin, self.margin)
        left, right = boxes[0][0], max(x + width for x, _, width, _ in boxes)
        bottom = max(y + height for _, y, _, height in boxes)
        columns, width, _ = self._legend_extent(handles, begin)
        middle, end = bottom + 24 * self.scale, self.size[0] - self.margin
        if columns == len(handles) and width <= self._beside_bar(begin):
            start = min(left, end - width - (end - begin - self._beside_bar(begin)))
            taken = self._scale_bar(max(start, begin), middle, zoom)
            x = min(max(right, taken + 24 * self.scale + width), end)
            self._legend(handles, columns, "center right", (x, middle))
        else:
            self._scale_bar(left, bottom + 20 * self.scale, zoom)
            self._legend(handles, columns, "upper center", ((begin + end) / 2, bottom + 38 * self.scale))

    def _beside_bar(self, begin: float) -> float:
        """Return the width that the longest scale bar, with its words, leaves a legend in the same line."""
        return self.size[0] - self.margin - begin - self._longest_bar - 80 * self.scale

    def _scale_bar(self, left: float, y: float, zoom: float) -> float:
        """Draw a bar of a round length; return where its words end."""
        length = round_down(self._longest_bar / zoom)
        tick, right = 4 * self.scale, left + length * zoom
        for x1, x2, half in ((left, right, 0.0), (left, left, tick), (right, right, tick)):
            (a, b), (c, d) = self.at(x1, y - half), self.at(x2, y + half)
            self.figure.add_artist(Line2D([a, c], [b, d], color=tone(self.theme.ink), linewidth=1.3))
        words = right + 8 * self.scale
        self.text(format_scale_length(length), words, y, points=SMALL, bold=True)
        return words + self.text_width(format_scale_length(length), points=SMALL, bold=True)

    def _legend_extent(self, handles: Sequence[Artist], begin: float) -> tuple[int, float, float]:
        """Return columns in which the legend fits the page in the fewest rows, and its width and height."""
        for rows in range(1, len(handles) + 1):
            columns = -(-len(handles) // rows)
            legend = self._legend(handles, columns, "upper left", (0.0, 0.0))
            extent = legend.get_window_extent(self.figure.canvas.get_renderer())  # type: ignore[attr-defined]
            legend.remove()
            if extent.width <= self.size[0] - begin or columns == 1:
                break
        return columns, float(extent.width), float(extent.height)

    def _legend(self, handles: Sequence[Artist], columns: int, place: str, at: tuple[float, float]) -> Legend:
        """Draw a legend of which the `place`, as in "upper left", is `at` a pixel."""
        style: Any = {"loc": place, "bbox_to_anchor": self.at(*at), "frameon": False, "fontsize": SMALL}
        style |= {"labelcolor": tone(self.theme.ink), "borderpad": 0.0, "borderaxespad": 0.0}
        style |= {"columnspacing": 1.6, "handletextpad": 0.6, "handlelength": 1.6}
        return self.figure.legend(handles=list(handles), ncols=columns, **style)
