"""The page of a plot: a matplotlib figure of an exact size, with positions in pixels from the top left."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias, cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from robocov.errors import ParameterError, is_number, quote
from robocov.typing import FloatArray
from robocov_app.figures.files import render_png
from robocov_app.look.axes import MAX_VALUE_INTERVALS, TICK_FACTORS, VALUE_MARGIN, choose_value_limits
from robocov_app.look.colors import Color
from robocov_app.look.lengths import format_scale_length, round_down
from robocov_app.look.theme import Theme

# Text sizes.
HEADING_SIZE_PT = 14.0
TITLE_SIZE_PT = 12.5
TEXT_SIZE_PT = 9.5
SMALL_SIZE_PT = 8.5
POINTS_PER_INCH = 72


PlotColor: TypeAlias = tuple[float, float, float]
"""A color of matplotlib: red, green and blue from 0 to 1."""

_Anchor: TypeAlias = Literal["upper left", "upper center", "center right"]
_FULL_SCALE_SIZE_PX = (960, 640)
"""Page size at scale 1, at which texts have their nominal size at 100 dots per inch."""
MAX_PAGE_SIDE_PX = 2**23 - 1
"""Maximum width and height of a figure of matplotlib."""
_MIN_SCALE = 0.8
_MAX_SCALE = 6.0
# Lengths at scale 1, px.
_MARGIN_PX = 18.0
_MAX_SCALE_BAR_PX = 120
_MAX_SCALE_BAR_FRACTION = 1 / 7
"""Maximum length of the scale bar, as a fraction of the page width."""
_SCALE_BAR_LABEL_PX = 80
_MIN_SCALE_BAR_FRACTION = 0.5
"""If the legend needs the space, the maximum length of the scale bar is reduced by up to this factor."""
_PANEL_GAP_PX = 14
_LEGEND_GAP_PX = 24
# Heights of the footer, and distances below the maps in it.
_ONE_LINE_FOOTER_PX = 46
_ONE_LINE_MIDDLE_PX = 24
_UPPER_LINE_MIDDLE_PX = 20
_LEGEND_TOP_PX = 38
_SPACE_ABOVE_LEGEND_PX = 36
_SPACE_BELOW_LEGEND_PX = 14
_HALF_TICK_PX = 4
"""Half the height of the ticks at the ends of the scale bar."""
_SCALE_BAR_LABEL_GAP_PX = 8
_MIN_SCALE_BAR_PX = 20.0
"""Minimum of the maximum length of the scale bar, which does not depend on the scale of the page."""


def to_plot_color(color: Color) -> PlotColor:
    """Convert a color of a theme to a matplotlib color."""
    red, green, blue = color
    return red / 255, green / 255, blue / 255


def get_figure(axes: Axes) -> Figure:
    """Return the figure that contains axes, even if they are in a subfigure."""
    return cast("Figure", axes.get_figure(root=True))


def check_not_empty(name: str, items: Sequence[object]) -> None:
    """Raise a ParameterError if there are no items."""
    if not items:
        raise ParameterError(f"{name}: expected at least one, got none")


def style_axes(axes: Axes, theme: Theme, x: str = "", y: str = "", grid: Literal["x", "y", ""] = "") -> None:
    """Set the colors, labels and grid of axes; with a grid, the bottom line of the frame is visible as well.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    theme : Theme
    x, y : str
        Labels of the axes. The label of the vertical axis is horizontal and above the axis.
    grid : {"x", "y", ""}
        Axis whose ticks have grid lines.
    """
    ink = to_plot_color(theme.ink)
    faint = to_plot_color(theme.faint)
    axes.set_facecolor(to_plot_color(theme.background))
    axes.tick_params(colors=faint, labelcolor=ink, labelsize=SMALL_SIZE_PT, left=False)
    axes.set_xlabel(x, fontsize=TEXT_SIZE_PT, color=ink)
    if y:
        axes.set_ylabel(y, fontsize=TEXT_SIZE_PT, color=ink)
        axes.yaxis.label.set(rotation=0, ha="left", va="bottom")
        axes.yaxis.set_label_coords(0.0, 1.03)
    for side, spine in axes.spines.items():
        spine.set_visible(bool(grid) and side == "bottom")
        spine.set_color(faint)
    if grid:
        axes.grid(axis=grid, color=to_plot_color(theme.grid), linewidth=0.8, alpha=0.7)
        axes.set_axisbelow(True)


def set_even_ticks(axis: Axis, max_intervals: int) -> None:
    """Set round ticks with at most `max_intervals` intervals, which adapt when a notebook zooms."""
    axis.set_major_locator(MaxNLocator(nbins=max_intervals, steps=list(TICK_FACTORS)))
    axis.set_major_formatter("{x:g}")


@dataclass(frozen=True)
class ValueAxis:
    """An axis of values.

    Attributes
    ----------
    label : str
    unit : str
        Unit of values that are written in the plot.
    origin : float
        Start of the axis, unless all values are far from it.
    value_range : (low, high), optional
        Range of the values for which the limits are chosen; by default that of the plotted values.
        Panels with the same range have the same limits.
    """

    label: str
    unit: str = ""
    origin: float = 0.0
    value_range: tuple[float, float] | None = None


def set_value_limits(
    axis: Any, values: FloatArray, value_axis: ValueAxis, margin: float = VALUE_MARGIN
) -> None:
    """Set the limits and ticks of an axis; see `choose_value_limits`.

    Parameters
    ----------
    axis : matplotlib.axis.Axis
    values : (m,) array
        Plotted values, finite; ignored if `value_axis` has a range. Without values and a range, the range
        starts at the origin and has a length of 1.
    value_axis : ValueAxis
    margin : float
        Free space on both sides, as a fraction of the range.
    """
    low = value_axis.origin
    high = low + 1.0
    if value_axis.value_range is not None:
        low, high = value_axis.value_range
    elif len(values):
        low = float(values.min())
        high = float(values.max())
    limits = choose_value_limits(low, high, margin=margin, origin=value_axis.origin)
    axis.axes.set(**{f"{axis.axis_name}lim": limits})
    set_even_ticks(axis, MAX_VALUE_INTERVALS)


def _get_font_weight(bold: bool) -> str:
    """Return matplotlib's name of the weight of a text."""
    return "bold" if bold else "normal"


class PageBox(NamedTuple):
    """A rectangle on a page, px from the top left."""

    left: float
    top: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Right edge."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """Bottom edge."""
        return self.top + self.height


class PageAxes(Axes):
    """Axes of a page, for which notebooks display the whole page.

    Without this, notebooks would not display a figure that is created without pyplot.
    """

    def _repr_png_(self) -> tuple[bytes, dict[str, Any]]:
        """Return the page as PNG, its width in a notebook, and its texts for screen readers."""
        figure = get_figure(self)
        texts = [text.get_text() for text in figure.texts if text.get_text()]
        # The width in a notebook is that of the page at 100 dots per inch.
        width = round(figure.bbox.width * 100 / figure.dpi)
        return render_png(figure), {"width": width, "alt": "; ".join(texts)}


class PagePanel(NamedTuple):
    """One of several equal panels of a page.

    Attributes
    ----------
    box : PageBox
    caption_width : float, px
        Maximum width of the text above the panel.
    """

    box: PageBox
    caption_width: float


class _LegendExtent(NamedTuple):
    """Size of a legend, and its number of columns.

    Attributes
    ----------
    columns : int
    width, height : float, px
    """

    columns: int
    width: float
    height: float


def require_page_size(size: Any) -> None:
    """Raise a ParameterError unless a size is a width and a height, px, that a figure can have.

    Parameters
    ----------
    size : object
        The size to check.

    Raises
    ------
    ParameterError
        If `size` is anything but two numbers of pixels.
    """
    is_pair = isinstance(size, Sequence | np.ndarray) and len(size) == 2
    if not is_pair or not all(is_number(side) and 1 <= side <= MAX_PAGE_SIDE_PX for side in size):
        expected = f"expected width and height from 1 to {MAX_PAGE_SIDE_PX} pixels"
        raise ParameterError(f"size: {expected}, got {quote(size)}")


class FigurePage:
    """A figure on which positions are in pixels from the top left.

    Parameters
    ----------
    size : (width, height), px
    theme : Theme
    scale : float, optional
        Scale of texts and lines; 1 means 100 dots per inch. By default it suits the size of the page.

    Attributes
    ----------
    size : (width, height), px
    theme : Theme
    scale : float
    margin : float, px
        Space at the edges.
    content_width : float, px
        Width between the margins.
    figure : matplotlib.figure.Figure

    Raises
    ------
    ParameterError
        If the size is not that of a figure; see `require_page_size`.
    """

    def __init__(self, size: tuple[int, int], theme: Theme, scale: float | None = None) -> None:
        require_page_size(size)
        width, height = size
        if scale is None:
            full_width, full_height = _FULL_SCALE_SIZE_PX
            scale = min(max(min(width / full_width, height / full_height), _MIN_SCALE), _MAX_SCALE)
        self.size = size
        self.theme = theme
        self.scale = scale
        self.margin = _MARGIN_PX * scale
        self.content_width = width - 2 * self.margin
        max_bar_length = min(_MAX_SCALE_BAR_PX * scale, _MAX_SCALE_BAR_FRACTION * width)
        self._max_bar_length = max(max_bar_length, _MIN_SCALE_BAR_PX)
        dpi = 100.0 * scale
        # matplotlib truncates the number of pixels, so rounding errors could turn 900 into 899.
        inches = ((width + 1e-3) / dpi, (height + 1e-3) / dpi)
        self.figure = Figure(figsize=inches, dpi=dpi, facecolor=to_plot_color(theme.background))
        FigureCanvasAgg(self.figure)

    def to_figure(self, x: float, y: float) -> tuple[float, float]:
        """Convert a position, px, to fractions of the figure from the bottom left."""
        width, height = self.size
        return x / width, 1.0 - y / height

    def add_axes(self, box: PageBox) -> Axes:
        """Add axes that fill a box, px; raise a ParameterError if the page has no space for them."""
        page_width, page_height = self.size
        if min(box.width, box.height) <= 0.0:
            expected = "expected a page with space for all maps and curves"
            raise ParameterError(f"size: {expected}, got {page_width} x {page_height} pixels")
        x, y = self.to_figure(box.left, box.bottom)
        rectangle = (x, y, box.width / page_width, box.height / page_height)
        return self.figure.add_axes(rectangle, axes_class=PageAxes)

    def add_map_axes(self, box: PageBox, low_x: float, low_y: float, high_x: float, high_y: float) -> Axes:
        """Add axes without ticks that show a rectangle of the world, m, in a box with the same aspect, px."""
        axes = self.add_axes(box)
        axes.set(xlim=(low_x, high_x), ylim=(low_y, high_y))
        axes.set_axis_off()
        return axes

    def write_title(self, text: str, y: float, max_width: float | None = None) -> None:
        """Write the title at the left margin.

        Parameters
        ----------
        text : str
        y : float
            Middle of the line, px at scale 1.
        max_width : float, px, optional
            By default the width between the margins.
        """
        if max_width is None:
            max_width = self.content_width
        self.write(text, self.margin, y * self.scale, points=TITLE_SIZE_PT, bold=True, max_width=max_width)

    def write(
        self,
        text: str,
        x: float,
        y: float,
        *,
        points: float = TEXT_SIZE_PT,
        bold: bool = False,
        color: Color | None = None,
        max_width: float | None = None,
        align: str = "left",
    ) -> None:
        """Write one line of text.

        Parameters
        ----------
        text : str
        x, y : float, px
            Left edge, right edge or center of the text, depending on `align`; y is its vertical middle.
        points : float
            Text size.
        bold : bool
        color : Color, optional
        max_width : float, px, optional
            Texts that are wider are shortened.
        align : {"left", "right", "center"}
        """
        text_x, text_y = self.to_figure(x, y)
        artist = self.figure.text(
            text_x,
            text_y,
            text,
            color=to_plot_color(color or self.theme.ink),
            fontsize=points,
            fontweight=_get_font_weight(bold),
            ha=align,
            va="center",
        )
        if max_width is None:
            return
        # The measured width of a text varies with its position by up to a pixel.
        while len(text) > 1 and self._measure_width(artist) > max_width + 1:
            text = text[:-1]
            artist.set_text(text.rstrip(" ·") + "…")

    def measure_text(self, text: str, *, points: float = TEXT_SIZE_PT, bold: bool = False) -> float:
        """Return the width of a text of a size in points, px."""
        artist = self.figure.text(0, 0, text, fontsize=points, fontweight=_get_font_weight(bold))
        width = self._measure_width(artist)
        artist.remove()
        return width

    def _measure_width(self, artist: Artist) -> float:
        """Return the width at which an artist is drawn, px."""
        return float(artist.get_window_extent(self._get_renderer()).width)

    def _get_renderer(self) -> Any:
        """Return the renderer that measures texts."""
        canvas: Any = self.figure.canvas
        return canvas.get_renderer()

    def arrange_panels(
        self,
        count: int,
        columns: int,
        *,
        aspect: float,
        caption_width: float,
        caption_height: float,
        top: float,
        bottom: float,
    ) -> list[PagePanel]:
        """Arrange panels of equal size in a centered grid, each with a caption above it.

        Parameters
        ----------
        count : int
        columns : int
        aspect : float
            Width of a panel divided by its height.
        caption_width : float, px
            Width of the widest caption; columns are at least this wide if there is enough space.
        caption_height : float, px
        top, bottom : float, px
            Space above and below all panels.

        Returns
        -------
        list of PagePanel
        """
        page_width, page_height = self.size
        gap = _PANEL_GAP_PX * self.scale
        rows = math.ceil(count / columns)
        max_width = (page_width - self.margin) / columns - self.margin
        # There is no gap below the last row.
        max_height = (page_height - top - bottom + gap) / rows - caption_height - gap
        width = min(max_width, max_height * aspect)
        height = width / aspect
        slot_width = min(max(width, caption_width), max_width)
        slot_height = caption_height + height + gap
        left = (page_width - columns * slot_width - (columns - 1) * self.margin) / 2
        top += max((page_height - top - bottom + gap - rows * slot_height) / 2, 0.0)
        panels = []
        for number in range(count):
            row, column = divmod(number, columns)
            x = left + column * (slot_width + self.margin)
            y = top + row * slot_height + caption_height
            panels.append(PagePanel(PageBox(x, y, width, height), slot_width))
        return panels

    def measure_footer(
        self, handles: Sequence[Artist], start: float = 0, bar_left: float | None = None
    ) -> float:
        """Return the height that `draw_footer` needs, px.

        Parameters
        ----------
        handles : sequence of matplotlib.artist.Artist
            Entries of the legend.
        start : float, px
            Left edge of the footer.
        bar_left : float, px, optional
            Left edge of the maps, below which the scale bar starts; by default that of the footer.
        """
        start = max(start, self.margin)
        if bar_left is None:
            bar_left = start
        legend = self._measure_legend(handles, start)
        if self._fits_next_to_bar(legend, len(handles), bar_left):
            return _ONE_LINE_FOOTER_PX * self.scale
        return self._compute_two_line_height(legend)

    def _compute_two_line_height(self, legend: _LegendExtent) -> float:
        """Return the height of a footer with the legend below the scale bar, px."""
        return _SPACE_ABOVE_LEGEND_PX * self.scale + legend.height + _SPACE_BELOW_LEGEND_PX * self.scale

    def draw_footer(
        self, handles: Sequence[Artist], boxes: Sequence[PageBox], zoom: float, start: float = 0
    ) -> None:
        """Draw the scale bar below the maps, at their left edge, and the legend next to the bar or below it.

        Parameters
        ----------
        handles : sequence of matplotlib.artist.Artist
            Entries of the legend.
        boxes : sequence of PageBox
            Boxes of the maps.
        zoom : float, px/m
            Scale at which the maps are drawn.
        start : float, px
            Left edge of the legend.
        """
        start = max(start, self.margin)
        end = self.size[0] - self.margin
        left = boxes[0].left
        right = max(box.right for box in boxes)
        bottom = max(box.bottom for box in boxes)
        legend = self._measure_legend(handles, start)
        if self._fits_next_to_bar(legend, len(handles), left):
            y = bottom + _ONE_LINE_MIDDLE_PX * self.scale
            # The bar is shorter if the legend needs the space.
            bar_space = end - left - legend.width - _SCALE_BAR_LABEL_PX * self.scale
            bar_end = self._draw_scale_bar(left, y, zoom, min(self._max_bar_length, bar_space))
            min_legend_right = bar_end + _LEGEND_GAP_PX * self.scale + legend.width
            legend_right = min(max(right, min_legend_right), end)
            self._draw_legend(handles, legend.columns, "center right", (legend_right, y))
        else:
            y = bottom + _UPPER_LINE_MIDDLE_PX * self.scale
            self._draw_scale_bar(left, y, zoom, min(self._max_bar_length, right - left))
            # The legend is below the middle of the maps, as far as the edges of the footer permit.
            half_width = legend.width / 2
            middle = min(max((left + right) / 2, start + half_width), end - half_width)
            row = bottom + _LEGEND_TOP_PX * self.scale
            self._draw_legend(handles, legend.columns, "upper center", (middle, row))

    def _fits_next_to_bar(self, legend: _LegendExtent, entries: int, bar_left: float) -> bool:
        """Return whether a legend of some entries is a single line that fits to the right of a scale bar."""
        label_width = _SCALE_BAR_LABEL_PX * self.scale
        bar_length = _MIN_SCALE_BAR_FRACTION * self._max_bar_length
        space = self.size[0] - self.margin - bar_left - bar_length - label_width
        return legend.columns == entries and legend.width <= space

    def _draw_scale_bar(self, left: float, y: float, zoom: float, max_length: float) -> float:
        """Draw a scale bar of a round length up to a maximum, px; return the right end of its label, px."""
        length = round_down(max_length / zoom)
        right = left + length * zoom
        half_tick = _HALF_TICK_PX * self.scale
        self._draw_line((left, y), (right, y))
        for x in (left, right):
            self._draw_line((x, y - half_tick), (x, y + half_tick))
        label = format_scale_length(length)
        label_left = right + _SCALE_BAR_LABEL_GAP_PX * self.scale
        self.write(label, label_left, y, points=SMALL_SIZE_PT, bold=True)
        return label_left + self.measure_text(label, points=SMALL_SIZE_PT, bold=True)

    def _draw_line(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Draw a line between two positions, px."""
        start_x, start_y = self.to_figure(*start)
        end_x, end_y = self.to_figure(*end)
        line = Line2D([start_x, end_x], [start_y, end_y], color=to_plot_color(self.theme.ink), linewidth=1.3)
        self.figure.add_artist(line)

    def _measure_legend(self, handles: Sequence[Artist], start: float) -> _LegendExtent:
        """Return the size of a legend with the fewest rows that fit to the right of `start`, px."""
        max_width = self.size[0] - start
        rows = 1
        while True:
            columns = math.ceil(len(handles) / rows)
            legend = self._draw_legend(handles, columns, "upper left", (0.0, 0.0))
            extent = legend.get_window_extent(self._get_renderer())
            legend.remove()
            if extent.width <= max_width or columns <= 1:
                return _LegendExtent(columns, float(extent.width), float(extent.height))
            rows += 1

    def _draw_legend(
        self, handles: Sequence[Artist], columns: int, anchor: _Anchor, position: tuple[float, float]
    ) -> Legend:
        """Draw a legend whose anchor, such as "upper left", is at a position, px."""
        return self.figure.legend(
            handles=list(handles),
            ncols=columns,
            loc=anchor,
            bbox_to_anchor=self.to_figure(*position),
            frameon=False,
            fontsize=SMALL_SIZE_PT,
            labelcolor=to_plot_color(self.theme.ink),
            borderpad=0.0,
            borderaxespad=0.0,
            columnspacing=1.6,
            handletextpad=0.6,
            handlelength=1.6,
        )
