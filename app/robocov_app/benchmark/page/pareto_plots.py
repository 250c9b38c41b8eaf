"""Pareto plots of the page: the gap of controllers against another quantity."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from robocov.typing import FloatArray
from robocov_app.benchmark.page.label_placement import (
    MARK_HALF_SIZE_PX,
    compute_half_sizes,
    compute_nearest_points,
    place_labels,
)
from robocov_app.benchmark.ratings import FILE_MARK, Rating, shorten
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import style_axes, to_plot_color
from robocov_app.look.curve_styles import CurveStyle
from robocov_app.look.theme import LIGHT
from robocov_app.report.svg import inline_svg


class Quantity(NamedTuple):
    """A quantity against which the gap is plotted."""

    title: str
    """Name of the quantity in the title of a plot."""
    axis_label: str
    """Label of the horizontal axis, with the unit."""
    compute: Callable[[Rating], float]
    """Returns the quantity for a rating."""


QUANTITIES: Mapping[str, Quantity] = {
    "path": Quantity(
        "path length",
        "mean path length of a robot (m)",
        lambda rating: rating.compute_median("path_length_m"),
    ),
    "computing": Quantity(
        "computing time, as reported",
        "µs per robot and second",
        lambda rating: 1e6 * rating.compute_rate("deciding_s"),
    ),
    "sent": Quantity(
        "bytes sent",
        "bytes a robot sends per second",
        lambda rating: rating.compute_rate("sent_bytes"),
    ),
}
PLOT_SIZE_PX = (560, 400)
"""Size of a plot, which must have space for many labels."""
_DPI = 72.0
"""Resolution of the plots, at which pixels equal points."""
_MAX_DISTANCE_WITHOUT_LINE_PX = 10.0
"""Maximum distance of a label from its mark at which no line needs to connect them."""
_MIN_RATIO = 1.01
"""Minimum ratio of the largest value to the smallest for plotting a quantity."""
_MIN_LOG_RATIO = 8.0
"""Minimum ratio of the largest value to the smallest for a logarithmic axis."""
_MAX_RATIO_TO_MEDIAN = 1e4
"""Maximum ratio of a plotted value to the median of the bundled entries, or of all without bundled ones."""
_MIN_MEDIAN_GAP = 1.0
"""Smaller medians of the gaps count as this value, %, because a ratio to a median near 0 says little."""
_MAX_RATIO_TO_BUNDLED = 4.0
"""Maximum ratio of a value from a file to the largest one of the bundled entries, or of the smallest one of
these to it. With larger ratios, a file could squeeze all bundled entries into a small part of a plot."""
_MIN_BUNDLED_FRACTION = 0.4
"""Minimum fraction of the horizontal axis that the bundled entries fill when a value from a file is added."""
_MIN_BUNDLED_RATIO = 2.0
"""Minimum ratio of the largest to the smallest bundled value. Smaller ratios count as this one, because
nearly equal bundled values would leave no space for others."""
_MAX_LABEL_CHARS = 28
"""Maximum length of a label in a plot."""
_MAX_EQUAL_POINTS = 4
"""Maximum number of controllers with the same value of a quantity that are all drawn."""


class ParetoPoint(NamedTuple):
    """A controller in a plot."""

    style: CurveStyle
    label: str
    x: float
    """Value of the quantity."""
    gap: float
    """Median gap, %."""
    is_rival: bool
    is_bundled: bool = False


class ParetoPlot(NamedTuple):
    """A plot of the gap against a quantity."""

    title: str
    svg: str
    note: str
    """Sentence about controllers that are not drawn; empty if there are none."""


class PlottedEntry(NamedTuple):
    """An entry of the benchmark on one track."""

    rating: Rating
    style: CurveStyle
    is_rival: bool
    """Whether the controller competes, which means that it does not know the whole map."""
    is_bundled: bool
    """Whether the result is part of robocov, and not from a file."""


def build_plots(track: str, entries: Sequence[PlottedEntry]) -> list[ParetoPlot]:
    """Build the plots of a track: the gap against each quantity in which controllers differ.

    Parameters
    ----------
    track : str
        Name of the track, which is the start of the ids in the plots.
    entries : sequence of PlottedEntry

    Returns
    -------
    list of ParetoPlot
    """
    plots = []
    for key, quantity in QUANTITIES.items():
        points, outliers = _split_outliers(_build_points(entries, quantity))
        points, zeros = _split_zeros(points)
        values = [point.x for point in points]
        if len(points) < 2 or max(values) <= _MIN_RATIO * min(values):
            continue
        texts = [f"{point.label}: {point.x:.3g}, gap {point.gap:.1f}%" for point in points]
        description = f"Median gap against {quantity.axis_label}. {'; '.join(texts)}."
        drawn, omitted = thin_out_equal_values(points)
        figure = draw_pareto_figure(drawn, quantity.axis_label)
        svg = inline_svg(figure, f"{track}-{key}", description)
        note = _describe_omitted_points(omitted, [*zeros, *outliers])
        plots.append(ParetoPlot(f"Gap and {quantity.title}", svg, note))
    return plots


def _build_points(entries: Sequence[PlottedEntry], quantity: Quantity) -> list[ParetoPoint]:
    """Return the points of the entries whose quantity and median gap are finite."""
    points = []
    for entry in entries:
        point = ParetoPoint(
            style=entry.style,
            label=_shorten_label(entry.rating.label, is_bundled=entry.is_bundled),
            x=quantity.compute(entry.rating),
            gap=100.0 * entry.rating.gap.estimate,
            is_rival=entry.is_rival,
            is_bundled=entry.is_bundled,
        )
        if np.isfinite((point.x, point.gap)).all():
            points.append(point)
    return points


def _describe_omitted_points(omitted: Sequence[ParetoPoint], outliers: Sequence[ParetoPoint]) -> str:
    """Return sentences about points that a plot does not contain; empty if there are none.

    Parameters
    ----------
    omitted : sequence of ParetoPoint
        Points with the same value as better ones.
    outliers : sequence of ParetoPoint
        Points far from all others.
    """
    sentences = []
    for value in dict.fromkeys(_format_value(point) for point in omitted):
        # Some labels contain commas.
        labels = "; ".join(point.label for point in omitted if _format_value(point) == value)
        sentences.append(
            f"Not drawn, because the gap of another controller with the same value ({value}) is no larger: "
            f"{labels}."
        )
    if outliers:
        labels = "; ".join(point.label for point in outliers)
        sentences.append(f"Not drawn, because they are far from all others: {labels}.")
    return " ".join(sentences)


def _format_value(point: ParetoPoint) -> str:
    """Format the value of a point with three significant digits. Points with the same text count as equal."""
    rounded = float(f"{point.x:.3g}")
    return f"{rounded:g}"


def _shorten_label(label: str, *, is_bundled: bool) -> str:
    """Shorten a label for a plot; the mark of a result from a file is kept."""
    if is_bundled:
        return shorten(label, _MAX_LABEL_CHARS)
    name = label.removesuffix(FILE_MARK)
    return shorten(name, _MAX_LABEL_CHARS - len(FILE_MARK)) + FILE_MARK


def thin_out_equal_values(
    points: Sequence[ParetoPoint],
) -> tuple[list[ParetoPoint], list[ParetoPoint]]:
    """Split points into those to draw and those to omit.

    If many controllers have the same value of the quantity, such as those that send only their positions,
    their marks would hide each other. Of these controllers, only the one with the smallest gap in each of
    four groups is drawn: competing or not, bundled or from a file. Bundled results are only omitted if there
    are many of them, so that no file removes one.

    Parameters
    ----------
    points : sequence of ParetoPoint
        At least one.

    Returns
    -------
    drawn, omitted : list of ParetoPoint
    """
    points_by_value: dict[str, list[ParetoPoint]] = {}
    for point in points:
        points_by_value.setdefault(_format_value(point), []).append(point)
    omitted: list[ParetoPoint] = []
    for equal_points in points_by_value.values():
        omitted += _list_superfluous_points(equal_points)
    return [point for point in points if point not in omitted], omitted


def _list_superfluous_points(equal_points: Sequence[ParetoPoint]) -> list[ParetoPoint]:
    """Return those of the points with one value of the quantity that are omitted, sorted by their gaps."""
    if len(equal_points) <= _MAX_EQUAL_POINTS:
        return []
    bundled_count = sum(point.is_bundled for point in equal_points)
    points = sorted(equal_points, key=lambda point: point.gap)
    best: dict[tuple[bool, bool], ParetoPoint] = {}
    for point in points:
        best.setdefault((point.is_rival, point.is_bundled), point)
    superfluous_points = [point for point in points if point not in best.values()]
    if bundled_count > _MAX_EQUAL_POINTS:
        return superfluous_points
    return [point for point in superfluous_points if not point.is_bundled]


def _split_outliers(points: Sequence[ParetoPoint]) -> tuple[list[ParetoPoint], list[ParetoPoint]]:
    """Split points into those to draw and outliers, next to which no others could be told apart.

    Bundled results determine what is typical, so that no file can make them outliers.
    """
    typical = [point for point in points if point.is_bundled] or points
    if not typical:
        return [], []
    median = float(np.median([point.x for point in typical]))
    median_gap = max(_MIN_MEDIAN_GAP, float(np.median([point.gap for point in typical])))
    drawn: list[ParetoPoint] = []
    outliers: list[ParetoPoint] = []
    for point in points:
        is_small = 0.0 < point.x < median / _MAX_RATIO_TO_MEDIAN
        is_large = point.x > median * _MAX_RATIO_TO_MEDIAN or point.gap > median_gap * _MAX_RATIO_TO_MEDIAN
        group = outliers if is_small or is_large else drawn
        group.append(point)
    bundled = [point for point in drawn if point.is_bundled]
    far_points = [point for point in drawn if not point.is_bundled and _is_far(point, bundled)]
    return [point for point in drawn if point not in far_points], [*far_points, *outliers]


def _is_far(point: ParetoPoint, bundled: Sequence[ParetoPoint]) -> bool:
    """Return whether a point is so far from all bundled ones that these would fill a small part of a plot."""
    if not bundled:
        return False
    values = [other.x for other in bundled]
    max_gap = max(_MIN_MEDIAN_GAP, *[other.gap for other in bundled])
    return (
        point.x * _MAX_RATIO_TO_BUNDLED < min(values)
        or point.x > _MAX_RATIO_TO_BUNDLED * max(values)
        or point.gap > _MAX_RATIO_TO_BUNDLED * max_gap
        or _compute_bundled_fraction(point.x, values) < _MIN_BUNDLED_FRACTION
    )


def _compute_bundled_fraction(value: float, bundled_values: Sequence[float]) -> float:
    """Return the fraction of the horizontal axis that bundled values fill when another value is added."""
    positive = [other for other in bundled_values if other > 0.0]
    if _needs_log_axis([*positive, value]):
        # Points at 0 are not drawn on a logarithmic axis.
        bundled_values = positive
    low = min(bundled_values)
    high = max(bundled_values)
    low = min(low, high / _MIN_BUNDLED_RATIO)
    axis_low = min(low, value)
    axis_high = max(high, value)
    if axis_low > 0.0 and _needs_log_axis([axis_low, axis_high]):
        return math.log(high / low) / math.log(axis_high / axis_low)
    if axis_high == axis_low:
        return 1.0
    return (high - low) / (axis_high - axis_low)


def _needs_log_axis(values: Sequence[float]) -> bool:
    """Return whether the positive values of a quantity differ so much that its axis is logarithmic."""
    positive = [value for value in values if value > 0.0]
    return bool(positive) and max(positive) > _MIN_LOG_RATIO * min(positive)


def _split_zeros(points: Sequence[ParetoPoint]) -> tuple[list[ParetoPoint], list[ParetoPoint]]:
    """Split points into those to draw and those at 0, if the others need a logarithmic axis."""
    if not _needs_log_axis([point.x for point in points]):
        return list(points), []
    positive = [point for point in points if point.x > 0.0]
    return positive, [point for point in points if point.x <= 0.0]


@plain_style()
def draw_pareto_figure(points: Sequence[ParetoPoint], axis_label: str) -> Figure:
    """Draw the gap of controllers against another quantity. Smaller values are better in both.

    A line, the Pareto front, connects the competing controllers that no other competing controller dominates;
    see `find_pareto_front`. If there are bundled results, it connects only these, because files may contain
    anything.

    Parameters
    ----------
    points : sequence of ParetoPoint
        The controllers.
    axis_label : str
        Label of the horizontal axis.

    Returns
    -------
    Figure
    """
    width, height = PLOT_SIZE_PX
    figure = Figure((width / _DPI, height / _DPI), dpi=_DPI)
    axes = figure.add_axes((0.08, 0.14, 0.9, 0.75))
    # Files neither change the line nor cover the mark of a bundled result.
    compared = [point for point in points if point.is_bundled] or points
    rivals = [(point.x, point.gap) for point in compared if point.is_rival]
    front = np.array([rivals[k] for k in find_pareto_front(rivals)]).reshape(-1, 2)
    axes.plot(*front.T, color=to_plot_color(LIGHT.faint), linewidth=1.0, zorder=1)
    for point in sorted(points, key=lambda point: point.is_bundled):
        _draw_pareto_point(axes, point)
    _style_pareto_axes(axes, points, axis_label)
    _label_pareto_points(axes, points, front)
    return figure


def _draw_pareto_point(axes: Axes, point: ParetoPoint) -> None:
    """Draw the mark of a controller, which is filled if the controller competes."""
    color = to_plot_color(point.style.get_color(LIGHT))
    axes.plot(
        [point.x],
        [point.gap],
        marker=point.style.mark,
        markerfacecolor=color if point.is_rival else to_plot_color(LIGHT.background),
        zorder=3,
        markersize=9,
        markeredgewidth=1.6,
        markeredgecolor=color,
        linestyle="",
    )


def _style_pareto_axes(axes: Axes, points: Sequence[ParetoPoint], axis_label: str) -> None:
    """Choose the scales and ticks of the axes; the horizontal scale is logarithmic for a wide range."""
    values = [point.x for point in points]
    if min(values) > 0.0 and _needs_log_axis(values):
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.set_yscale("symlog", linthresh=1.0)  # Linear up to one percent.
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())
    axes.margins(x=0.12, y=0.12)
    style_axes(axes, LIGHT, axis_label, "median gap (%)", grid="y")


def _label_pareto_points(axes: Axes, points: Sequence[ParetoPoint], front: FloatArray) -> None:
    """Write the label of each controller next to its mark and, if possible, not on the Pareto front."""
    labels = [point.label for point in points]
    axes.autoscale_view()  # The transformation of the data is only valid when the limits are known.
    marks = axes.transData.transform([(point.x, point.gap) for point in points])
    front_line = axes.transData.transform(front)
    centers = place_labels(marks, labels, axes.bbox.extents, front_line)
    half_sizes = compute_half_sizes(labels)
    for point, mark, center, half_size in zip(points, marks, centers, half_sizes, strict=True):
        offset = compute_nearest_points(mark, center, half_size) - mark
        if np.linalg.norm(offset) > _MAX_DISTANCE_WITHOUT_LINE_PX:
            _draw_label_line(axes, point, offset)
        axes.annotate(
            point.label,
            (point.x, point.gap),
            center - mark,
            textcoords="offset points",
            fontsize=11,
            color=to_plot_color(LIGHT.ink),
            ha="center",
            va="center",
        )


def _draw_label_line(axes: Axes, point: ParetoPoint, offset: FloatArray) -> None:
    """Draw the line that connects a mark with the end of its label at the given offset, px."""
    axes.annotate(
        "",
        (point.x, point.gap),
        (offset[0], offset[1]),
        textcoords="offset points",
        arrowprops={
            "arrowstyle": "-",
            "color": to_plot_color(LIGHT.faint),
            "linewidth": 0.7,
            "shrinkA": 0.0,
            "shrinkB": MARK_HALF_SIZE_PX,
        },
        zorder=2,
    )


def find_pareto_front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Find the points that no other point dominates. Of equal points, only the first is found.

    A point dominates another one if neither of its values is larger, and at least one is smaller.

    Parameters
    ----------
    points : sequence of (float, float)
        Pairs of values; smaller values are better.

    Returns
    -------
    list of int
        Indices of these points, sorted by their first value.

    Examples
    --------
    >>> find_pareto_front([(3.0, 1.0), (1.0, 2.0), (2.0, 4.0)])
    [1, 0]
    """
    front: list[int] = []
    for k in sorted(range(len(points)), key=lambda k: points[k]):
        if not front or points[k][1] < points[front[-1]][1]:
            front.append(k)
    return front
