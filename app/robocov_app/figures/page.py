"""The page of a plot: a matplotlib figure of an exact size, laid out in pixels from its top left."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal, TypeAlias

from robocov.errors import OutputError, ParameterError, shown
from robocov.files.atomic import writable, written
from robocov_app.render.camera import length_label, round_length
from robocov_app.render.theme import Colour, Theme

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend


_METADATA: dict[str, dict[str, str | None]] = {
    "png": {"Software": None},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""What would differ from one time, or one version of matplotlib, to the next is left out."""

_STYLE: Any = {
    "savefig.bbox": None,
    "svg.hashsalt": "robocov",
    # outlines: an SVG cannot hold a font, and others than ours would not fit their places
    "svg.fonttype": "path",
    # the whole letters as TrueType: publishers refuse Type 3, and the words can be searched and copied
    "pdf.fonttype": 42,
}


def figure_png(figure: Figure) -> bytes:
    """Return a figure as PNG, of exactly the page's pixels."""
    file = io.BytesIO()
    _write(figure, file, "png")
    return file.getvalue()


def save_figure(figure: Figure, path: Path | str) -> None:
    """Write a figure as PNG, SVG or PDF, by the path's suffix, whole or not at all.

    A PNG has exactly the page's pixels. An SVG holds its letters as outlines, a PDF the fonts themselves, so
    that both look the same everywhere. None holds a date: the same plot gives the same bytes. Raises
    OutputError when the file cannot be written; ParameterError when the suffix is another.
    """
    path = Path(path)
    kind = figure_kind(path)
    with written(path) as part:
        _write(figure, part, kind)


def _write(figure: Figure, file: Path | IO[bytes], kind: str) -> None:
    import matplotlib

    with plain_style(), matplotlib.rc_context(_STYLE):
        figure.savefig(
            file, format=kind, dpi=figure.dpi, metadata=_METADATA[kind], facecolor=figure.get_facecolor()
        )


def check_figure_path(path: Path) -> None:
    """Make sure, before any work is done, that a figure can be written there.

    Raises OutputError when there is no such folder, or something else than a file in its place;
    ParameterError when the suffix is neither PNG, SVG nor PDF.
    """
    figure_kind(path)
    if not writable(path).parent.is_dir():
        raise OutputError(f"{path}: cannot be written: there is no folder {path.parent}")


def figure_kind(path: Path) -> str:
    """Return ``png``, ``svg`` or ``pdf``, by the suffix of a path.

    Raises ParameterError when the suffix is another.
    """
    kind = path.suffix.lower().lstrip(".")
    if kind not in _METADATA:
        raise ParameterError(f"{path}: suffix {shown(path.suffix)}, but .png, .svg or .pdf was wanted")
    return kind


HEADING, TITLE, TEXT, SMALL = 14.0, 12.5, 9.5, 8.5
"""Text sizes in points."""

Box: TypeAlias = tuple[float, float, float, float]
"""Left, top, width and height in pixels."""

Place: TypeAlias = Literal["upper left", "upper center", "center right"]
"""Which part of a legend is where it is put."""


@contextmanager
def plain_style() -> Iterator[None]:
    """Give a context in which matplotlib draws alike whatever style its user has set.

    Names of maps and controllers are words: dollars in them are no formula, and letters that the font
    has not are boxes and no reason for a warning.
    """
    import matplotlib.style

    style: dict[str, Any] = {
        "font.family": "DejaVu Sans",
        "text.usetex": False,
        "text.parse_math": False,
        "axes.unicode_minus": True,
    }
    with matplotlib.style.context(["default", style]), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from font")
        yield


def tone(colour: Colour) -> tuple[float, float, float]:
    """Return a colour as matplotlib wants it."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


class Page:
    """A figure with titles and a legend that keep clear of what is plotted.

    Texts and lines are `scale` times those of a page of 100 dots an inch; None is what suits the size.
    """

    def __init__(self, size: tuple[int, int], theme: Theme, scale: float | None = None) -> None:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        self.size = size
        self.theme = theme
        fitting = min(max(min(size[0] / 960, size[1] / 640), 0.8), 6.0)
        self.scale = fitting if scale is None else scale
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
        """Return axes that fill `box`; a notebook shows the page for them."""
        from robocov_app.figures.page_axes import PageAxes

        left, top, width, height = box
        x, y = self.at(left, top + height)
        return self.figure.add_axes((x, y, width / self.size[0], height / self.size[1]), axes_class=PageAxes)

    def panels(
        self, count: int, columns: int, aspect: float, words: float, above: float, top: float, below: float
    ) -> list[tuple[Box, float]]:
        """Return equal boxes in rows, and how wide the lines above each may be.

        `aspect` is width by height of a box; `words` is how wide the lines above would be: slots grow for
        them as far as there is room; `above` is the height of those lines; `top` and `below` stay free. All
        in px.
        """
        rows = -(-count // columns)
        gap = 14 * self.scale
        widest = (self.size[0] - self.margin) / columns - self.margin
        highest = (self.size[1] - top - below + gap) / rows - above - gap
        width = min(widest, highest * aspect)
        height = width / aspect
        slot = min(max(width, words), widest)
        left = (self.size[0] - columns * slot - (columns - 1) * self.margin) / 2
        block = above + height + gap
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
        # the same words are up to a pixel wider in one place than in another
        while room is not None and len(text) > 1 and self.width_of(written) > room + 1:
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

    def footer_height(self, handles: Sequence[Artist], begin: float | None = None) -> float:
        """Return how much room `footer` needs below what is plotted, in pixels."""
        begin = self.margin if begin is None else begin
        columns, width, height = self._legend_extent(handles, begin)
        if columns == len(handles) and width <= self._beside_bar(begin):
            return 46 * self.scale
        return 36 * self.scale + height + 14 * self.scale

    def footer(
        self,
        handles: Sequence[Artist],
        left: float,
        right: float,
        bottom: float,
        zoom: float,
        begin: float | None = None,
    ) -> None:
        """Draw the scale bar and the legend: beside each other where that fits, else below each other.

        `left`, `right` and `bottom` are edges of what is plotted above, px; `zoom` is in px/m; nothing is
        left of `begin`.
        """
        begin = self.margin if begin is None else begin
        columns, width, _ = self._legend_extent(handles, begin)
        middle = bottom + 24 * self.scale
        if columns == len(handles) and width <= self._beside_bar(begin):
            end = self.size[0] - self.margin
            start = min(left, end - width - (end - begin - self._beside_bar(begin)))
            taken = self._scale_bar(max(start, begin), middle, zoom)
            x = min(max(right, taken + 24 * self.scale + width), end)
            self._legend(handles, columns, "center right", (x, middle))
        else:
            self._scale_bar(left, bottom + 20 * self.scale, zoom)
            centre = (begin + self.size[0] - self.margin) / 2
            self._legend(handles, columns, "upper center", (centre, bottom + 38 * self.scale))

    @property
    def _longest_bar(self) -> float:
        return max(min(120 * self.scale, self.size[0] / 7), 20.0)

    def _beside_bar(self, begin: float) -> float:
        """Return the width that the longest scale bar, with its words, leaves a legend in the same line."""
        return self.size[0] - self.margin - begin - self._longest_bar - 80 * self.scale

    def _scale_bar(self, left: float, y: float, zoom: float) -> float:
        """Draw a bar of a round length; return where its words end."""
        from matplotlib.lines import Line2D

        length = round_length(self._longest_bar / zoom)
        tick, right = 4 * self.scale, left + length * zoom
        for (x1, y1), (x2, y2) in (
            ((left, y), (right, y)),
            ((left, y - tick), (left, y + tick)),
            ((right, y - tick), (right, y + tick)),
        ):
            (a, b), (c, d) = self.at(x1, y1), self.at(x2, y2)
            self.figure.add_artist(Line2D([a, c], [b, d], color=tone(self.theme.ink), linewidth=1.3))
        words = right + 8 * self.scale
        self.text(length_label(length), words, y, points=SMALL, bold=True)
        return words + self.text_width(length_label(length), points=SMALL, bold=True)

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

    def _legend(
        self, handles: Sequence[Artist], columns: int, place: Place, at: tuple[float, float]
    ) -> Legend:
        return self.figure.legend(
            handles=list(handles),
            loc=place,
            bbox_to_anchor=self.at(*at),
            ncols=columns,
            frameon=False,
            fontsize=SMALL,
            labelcolor=tone(self.theme.ink),
            borderaxespad=0.0,
            borderpad=0.0,
            columnspacing=1.6,
            handletextpad=0.6,
            handlelength=1.6,
        )
