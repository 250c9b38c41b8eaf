"""The page that compares results of the benchmark: tables and Pareto plots for each track."""

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from robocov import __version__
from robocov.errors import ParameterError, format_count
from robocov.text import escape_controls
from robocov.typing import FloatArray
from robocov_app.benchmark import ratings, suite
from robocov_app.benchmark.anomalies import find_anomalies
from robocov_app.benchmark.label_placement import (
    MARK_HALF_SIZE_PX,
    compute_half_sizes,
    compute_nearest_points,
    place_labels,
)
from robocov_app.benchmark.ratings import Rating, shorten
from robocov_app.benchmark.results import describe_method, get_results_version, shares_maps_by_messages
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import style_axes, to_plot_color
from robocov_app.look.curve_styles import MARKER_PATHS, CurveStyle, choose_curve_styles
from robocov_app.look.theme import LIGHT
from robocov_app.report import replay
from robocov_app.report.document import load_template
from robocov_app.report.svg import inline_svg
from robocov_app.report.tables.table import PageTable
from robocov_app.report.theme_css import build_theme_rules
from robocov_app.sweep.worker import list_result_versions


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
YARDSTICKS = ("rapf", "atlas", "oracle")
"""Controllers with which incomplete entries are compared, over the runs of each entry."""
_WHOLE_MAP = "whole map"
"""Information of the controllers that do not compete."""
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
"""Minimum median of the gaps for this ratio, %."""
MAX_INCOMPLETE_TABLES = 10
"""Maximum number of incomplete entries on each track that are compared with the yardsticks."""
MAX_PLOTTED_ENTRIES = 40
"""Maximum number of entries in a plot, apart from the bundled ones; those with the highest scores."""
_MAX_PLOT_LABEL_CHARS = 28
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
    """Whether the controller competes, which means that it does not know the whole map."""
    is_bundled: bool = False
    """Whether the result is part of robocov, and not from a file."""


class ParetoPlot(NamedTuple):
    """A plot of the gap against a quantity."""

    title: str
    svg: str
    note: str
    """Sentence about controllers that are not drawn; empty if there are none."""


class _Entries(NamedTuple):
    """Properties of the controllers on the page, by label."""

    styles: Mapping[str, CurveStyle]
    information: Mapping[str, str]
    bundled: Collection[str]
    """Labels of the bundled results."""
    yardsticks: Sequence[str]
    """Labels of the entries of `YARDSTICKS`."""


def build_page(results: Sequence[Mapping[str, Any]], title: str) -> str:
    """Build the page that compares results, with a section for each track.

    Complete entries are ranked by their scores. Each entry is rated over its own runs, so that the rating of
    an entry does not depend on other entries. Bundled results keep their labels and colors, and other entries
    are compared with these, whatever controller another result claims to be from.

    Parameters
    ----------
    results : sequence of Mapping
        As returned by `robocov_app.benchmark.results.read_result`, or by
        `robocov_app.benchmark.results.load_bundled_results`.
    title : str
        Title of the page.

    Returns
    -------
    str
        The page as HTML. Equal results give identical pages.

    Raises
    ------
    ParameterError
        If the results contain no runs of the suite.
    """
    results = sorted(results, key=lambda result: not result["is_bundled"])
    labels = ratings.label_results(results)
    styles = choose_curve_styles([result["entry"]["controller"] for result in results])
    information = [result["entry"]["information"] for result in results]
    entries = _Entries(
        styles=dict(zip(labels, styles, strict=True)),
        information=dict(zip(labels, information, strict=True)),
        bundled={label for result, label in zip(results, labels, strict=True) if result["is_bundled"]},
        yardsticks=_find_yardsticks(results, labels),
    )
    tracks = {
        name: sorted(track_ratings, key=_build_sort_key)
        for name, track_ratings in ratings.build_ratings(results).items()
    }
    if not tracks:
        raise ParameterError("DIR: the results contain no run of the suite, so there is nothing to compare")
    labeled_results = sorted(
        zip(labels, results, strict=True), key=lambda labeled_result: labeled_result[0].casefold()
    )
    page = load_template("benchmark.html.jinja").render(
        title=title,
        suite=suite.VERSION,
        version=__version__,
        style=build_theme_rules(":root") + replay.read_asset("report.css"),
        marks=MARKER_PATHS,
        styles=entries.styles,
        overviews=_build_overviews(labels, tracks, entries),
        other_versions=_list_other_versions(results, labels),
        file_mark="" if all(result["is_bundled"] for result in results) else ratings.FILE_MARK,
        anomalies=_build_anomaly_table(labeled_results, _find_default_rapf(results)),
        tracks=[_build_section(name, track_ratings, entries) for name, track_ratings in tracks.items()],
        notes=[*ratings.NOTES, *_describe_entries_without_messages(results, labels)],
        method=describe_method(),
        entries=_build_entries_table(labeled_results),
    )
    return escape_controls(page)


def _list_other_versions(results: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> list[str]:
    """Return the labels of the results that were made with another version, and cannot be compared."""
    current_version = get_results_version(list_result_versions())
    others = []
    for result, label in zip(results, labels, strict=True):
        version = get_results_version(result["versions"])
        if version is not None and version != current_version:
            others.append(label)
    return others


def _find_yardsticks(results: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> list[str]:
    """Return the labels of the results of yardsticks with default gains."""
    yardsticks = []
    for result, label in zip(results, labels, strict=True):
        if _is_default_result(result, results) and result["entry"]["controller"] in YARDSTICKS:
            yardsticks.append(label)
    return yardsticks


def _is_default_result(result: Mapping[str, Any], results: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether a result is that of a built-in controller with default gains.

    If there are bundled results, only these count, because a file can contain any name of a controller.
    """
    if any(other["is_bundled"] for other in results) and not result["is_bundled"]:
        return False
    return not result["entry"]["set"] and not result["entry"]["source_sha256"]


def _build_sort_key(rating: Rating) -> tuple[bool, float]:
    """Return a sort key that puts complete ratings first, then higher scores."""
    return not rating.is_complete, -rating.score


def _build_overviews(
    labels: Sequence[str], tracks: Mapping[str, Sequence[Rating]], entries: _Entries
) -> list[tuple[str, str, PageTable]]:
    """Build the identifier, heading and table of each ranking for which there are runs.

    If all tracks are in no ranking, the only table compares the results on these tracks.
    """
    overviews = []
    for ranking, heading in suite.RANKINGS.items():
        ranked_tracks = {name: tracks[name] for name in suite.RANKED_TRACKS[ranking] if name in tracks}
        if ranked_tracks:
            overview = _build_overview(labels, ranked_tracks, entries)
            overviews.append((f"overview-{ranking}", heading, overview))
    if not overviews:
        overviews.append(("overview-other", "Overview", _build_overview(labels, tracks, entries)))
    return overviews


def _build_overview(
    labels: Sequence[str], tracks: Mapping[str, Sequence[Rating]], entries: _Entries
) -> PageTable:
    """Build the table of scores and gaps on some tracks.

    Entries that have all runs of all these tracks come first, ranked by mean score. The other entries have no
    rank and follow in alphabetical order. Notes list the entries without any runs, and those that have the
    smallest gap on a track but no rank.
    """
    by_label: dict[str, dict[str, Rating]] = {label: {} for label in labels}
    for name, track_ratings in tracks.items():
        for rating in track_ratings:
            by_label[rating.label][name] = rating
    mean_scores = _compute_mean_scores(by_label, tracks)
    scores = {label: mean_score.score for label, mean_score in mean_scores.items()}
    ranked = sorted(scores, key=lambda label: -scores[label])
    not_ranked = [label for label in labels if label not in scores and by_label[label]]
    not_ranked.sort(key=str.casefold)
    # Results from files change no rank of bundled ones.
    compared_scores = [scores[label] for label in ranked if label in entries.bundled] or list(scores.values())
    rows = []
    for label in [*ranked, *not_ranked]:
        rank = score = ratings.NO_VALUE
        if label in scores:
            rank = str(_compute_rank(scores[label], compared_scores))
            margin = ratings.format_number(100.0 * mean_scores[label].margin, ".1f")
            score = f"{100.0 * scores[label]:.1f} ± {margin}"
        cells = _build_overview_cells(by_label[label], tracks)
        rows.append((label, entries.information[label], rank, score, *cells))
    headings = [suite.format_heading(name) for name in tracks]
    head = ("Controller", "Knows", "Rank", "Score, %", "Runs", "Runs with contacts", "Settled", *headings)
    notes = []
    competing = [label for label in labels if entries.information[label] != _WHOLE_MAP]
    leaders = _find_unranked_leaders({label: by_label[label] for label in competing}, scores, tracks)
    if leaders:
        notes.append(
            "The best ranked controller is not the best on every track. Of the controllers that do not know "
            "the whole map, these have the smallest gap on a track, but lack runs on others and have no "
            f"rank: {'; '.join(leaders)}."
        )
    missing = sorted((label for label in labels if not by_label[label]), key=str.casefold)
    if missing:
        notes.append(f"Without runs on these tracks: {'; '.join(missing)}.")
    caption = "Scores, and median gaps on each track, %"
    return PageTable(caption, head, rows, text_columns=frozenset({1}), notes=tuple(notes))


def _compute_rank(score: float, scores: Iterable[float]) -> int:
    """Return the rank of a score among others. Equal scores have the same rank."""
    return 1 + sum(other > score for other in scores)


def _find_unranked_leaders(
    by_label: Mapping[str, Mapping[str, Rating]], ranked: Collection[str], tracks: Iterable[str]
) -> list[str]:
    """Return the label and the tracks of each entry that has the smallest gap on a track, but no rank."""
    led_tracks: dict[str, list[str]] = {}
    for track in tracks:
        gaps = {
            label: label_ratings[track].gap.estimate
            for label, label_ratings in by_label.items()
            if track in label_ratings and label_ratings[track].is_complete
        }
        if not gaps:
            continue
        leader = min(gaps, key=lambda label: gaps[label])
        if leader not in ranked:
            led_tracks.setdefault(leader, []).append(suite.format_heading(track))
    return [f"{label} ({', '.join(names)})" for label, names in led_tracks.items()]


def _compute_mean_scores(
    by_label: Mapping[str, Mapping[str, Rating]], tracks: Collection[str]
) -> dict[str, ratings.MeanScore]:
    """Return the mean score of each entry that has all runs of all tracks, by its label."""
    scores = {}
    for label, label_ratings in by_label.items():
        is_complete = all(rating.is_complete for rating in label_ratings.values())
        if is_complete and label_ratings.keys() == set(tracks):
            scores[label] = ratings.compute_mean_score(label_ratings.values())
    return scores


def _build_overview_cells(
    label_ratings: Mapping[str, Rating], tracks: Mapping[str, Sequence[Rating]]
) -> list[str]:
    """Return the cells for runs, contacts and settled runs, and for the gap on each complete track."""
    rows = [row for rating in label_ratings.values() for row in rating.rows]
    run_count = sum(rating.run_count for rating in label_ratings.values())
    suite_run_count = sum(len(ratings.list_run_keys(name)) for name in tracks)
    contacts = sum(row["contacts"] > 0 for row in rows)
    at_rest = sum(row["settled_at_s"] is not None for row in rows)
    run_text = ratings.format_run_count(run_count, suite_run_count, run_count - len(rows))
    cells = [_break_lines(run_text)]
    cells.append(f"{contacts / len(rows):.0%}" if rows else ratings.NO_VALUE)
    cells.append(f"{at_rest / run_count:.0%}" if run_count else ratings.NO_VALUE)
    for name in tracks:
        rating = label_ratings.get(name)
        gap = np.nan
        if rating is not None and rating.is_complete:
            gap = rating.gap.estimate
        cells.append(ratings.format_gap(gap))
    return cells


def _build_section(name: str, track_ratings: Sequence[Rating], entries: _Entries) -> dict[str, Any]:
    """Return the template variables for the section of a track."""
    ranked = [rating for rating in track_ratings if rating.is_complete]
    plotted = _select_ratings_to_plot(ranked, entries)
    family_head, family_rows = ratings.build_family_rows(ranked)
    return {
        "name": name,
        "title": suite.format_heading(name),
        "summary": _summarize_track(name),
        "table": _build_rating_table("Ratings", ranked, entries),
        "families": PageTable("Median gap by families of maps, %", family_head, family_rows),
        "incomplete": _build_incomplete_tables(track_ratings, entries),
        "plots": _build_plots(name, plotted, entries),
        "omitted_from_plots": len(ranked) - len(plotted),
    }


def _summarize_track(name: str) -> str:
    """Return sentences about the conditions of a track, and the numbers of its runs and maps."""
    track = suite.TRACKS[name]
    run_count = len(ratings.list_run_keys(name))
    runs = f"{format_count(run_count, 'run')} on {format_count(len(track.maps), 'map')}"
    team = f"{format_count(track.robots, 'robot')}, {track.duration:g} s"
    return f"{track.summary.capitalize()}; {team}. {runs}, the same for all ranked entries."


def _build_incomplete_tables(track_ratings: Sequence[Rating], entries: _Entries) -> list[PageTable]:
    """Build a table for each entry that lacks runs.

    For comparison, it also contains the ratings of the yardsticks over the runs of the entry.
    """
    yardsticks = [rating for rating in track_ratings if rating.label in entries.yardsticks]
    incomplete = [rating for rating in track_ratings if not rating.is_complete]
    tables = []
    for rating in incomplete[:MAX_INCOMPLETE_TABLES]:
        compared = [yardstick.select_runs(rating.run_keys) for yardstick in yardsticks]
        caption = f"{rating.label}, incomplete and not ranked"
        if compared:
            caption += ", and others over the same runs"
        tables.append(_build_rating_table(caption, [rating, *compared], entries))
    omitted_count = len(incomplete) - len(tables)
    if omitted_count:
        tables[-1] = replace(tables[-1], notes=(f"Incomplete entries without a table: {omitted_count}.",))
    return tables


def _build_rating_table(caption: str, track_ratings: Sequence[Rating], entries: _Entries) -> PageTable:
    """Build the table of ratings on a track."""
    rows = []
    for rating in track_ratings:
        cells = ratings.build_rating_cells(rating, entries.information[rating.label])
        cells["Runs"] = _break_lines(cells["Runs"])
        rows.append(tuple(cells[column] for column in ratings.HEAD))
    return PageTable(caption, ratings.HEAD, rows, text_columns=frozenset({1}))


def _break_lines(text: str) -> str:
    """Return a text with a new line after each comma, so that a column of a wide table stays narrow."""
    return text.replace(", ", ",\n")


def _select_ratings_to_plot(track_ratings: Sequence[Rating], entries: _Entries) -> list[Rating]:
    """Return the ratings of bundled results, and the best of the others, in the order of their scores."""
    others = [rating for rating in track_ratings if rating.label not in entries.bundled]
    omitted = {rating.label for rating in others[MAX_PLOTTED_ENTRIES:]}
    return [rating for rating in track_ratings if rating.label not in omitted]


def _build_plots(name: str, track_ratings: Sequence[Rating], entries: _Entries) -> list[ParetoPlot]:
    """Build the plots of a track: the gap against each quantity in which controllers differ."""
    plots = []
    for key, quantity in QUANTITIES.items():
        points = []
        for rating in track_ratings:
            point = ParetoPoint(
                style=entries.styles[rating.label],
                label=_shorten_plot_label(rating.label, is_bundled=rating.label in entries.bundled),
                x=quantity.compute(rating),
                gap=100.0 * rating.gap.estimate,
                is_rival=entries.information[rating.label] != _WHOLE_MAP,
                is_bundled=rating.label in entries.bundled,
            )
            if np.isfinite((point.x, point.gap)).all():
                points.append(point)
        points, outliers = _split_outliers(points)
        points = _select_points_for_log_axis(points)
        values = [point.x for point in points]
        if len(points) < 2 or max(values) <= _MIN_RATIO * min(values):
            continue
        texts = [f"{point.label}: {point.x:.3g}, gap {point.gap:.1f}%" for point in points]
        description = f"Median gap against {quantity.axis_label}. {'; '.join(texts)}."
        drawn, omitted = thin_out_equal_values(points)
        figure = draw_pareto_figure(drawn, quantity.axis_label)
        svg = inline_svg(figure, f"{name}-{key}", description)
        note = _describe_omitted_points(omitted, outliers)
        plots.append(ParetoPlot(f"Gap and {quantity.title}", svg, note))
    return plots


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
    if omitted:
        labels = "; ".join(point.label for point in omitted)  # Some labels contain commas.
        sentences.append(
            f"Not drawn, because a controller with the same value ({omitted[0].x:.4g}) has a smaller "
            f"gap: {labels}."
        )
    if outliers:
        labels = "; ".join(point.label for point in outliers)
        sentences.append(f"Not drawn, because they are far from all others: {labels}.")
    return " ".join(sentences)


def _shorten_plot_label(label: str, *, is_bundled: bool) -> str:
    """Shorten a label for a plot; the mark of a result from a file is kept."""
    if is_bundled:
        return shorten(label, _MAX_PLOT_LABEL_CHARS)
    name = label.removesuffix(ratings.FILE_MARK)
    return shorten(name, _MAX_PLOT_LABEL_CHARS - len(ratings.FILE_MARK)) + ratings.FILE_MARK


def thin_out_equal_values(
    points: Sequence[ParetoPoint],
) -> tuple[list[ParetoPoint], list[ParetoPoint]]:
    """Split points into those to draw and those to omit.

    If many controllers have the same value of the quantity, as those that send only their positions, their
    marks would hide each other. Then only the smallest gap of the competing controllers and the smallest gap
    of those that know the whole map are drawn.

    Parameters
    ----------
    points : sequence of ParetoPoint
        At least one.

    Returns
    -------
    drawn, omitted : list of ParetoPoint
    """
    counts = Counter(f"{point.x:.3g}" for point in points)
    common_value, count = counts.most_common(1)[0]
    if count <= _MAX_EQUAL_POINTS:
        return list(points), []
    equal = sorted(
        (point for point in points if f"{point.x:.3g}" == common_value), key=lambda point: point.gap
    )
    best = [
        next((point for point in equal if point.is_rival == is_rival), None) for is_rival in (True, False)
    ]
    omitted = [point for point in equal if point not in best]
    return [point for point in points if point not in omitted], omitted


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
    return drawn, outliers


def _select_points_for_log_axis(points: Sequence[ParetoPoint]) -> list[ParetoPoint]:
    """Return the points without those at 0 if the others need a logarithmic axis."""
    positive = [point for point in points if point.x > 0.0]
    values = [point.x for point in positive]
    if values and max(values) > _MIN_LOG_RATIO * min(values):
        return positive
    return list(points)


@plain_style()
def draw_pareto_figure(points: Sequence[ParetoPoint], axis_label: str) -> Figure:
    """Draw the gap of controllers against another quantity. Smaller values are better in both.

    A line, the Pareto front, connects the competing controllers for which no other competing controller is
    better in both quantities.

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
    rivals = [(point.x, point.gap) for point in points if point.is_rival]
    front = np.array([rivals[k] for k in find_pareto_front(rivals)]).reshape(-1, 2)
    axes.plot(*front.T, color=to_plot_color(LIGHT.faint), linewidth=1.0, zorder=1)
    for point in points:
        _draw_pareto_point(axes, point)
    _style_pareto_axes(axes, points, axis_label)
    _label_pareto_points(axes, points)
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
    if min(values) > 0.0 and max(values) > _MIN_LOG_RATIO * min(values):
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.set_yscale("symlog", linthresh=1.0)  # Linear up to one percent.
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_locator(NullLocator())
    axes.margins(x=0.12, y=0.12)
    style_axes(axes, LIGHT, axis_label, "median gap (%)", grid="y")


def _label_pareto_points(axes: Axes, points: Sequence[ParetoPoint]) -> None:
    """Write the label of each controller next to its mark."""
    labels = [point.label for point in points]
    axes.autoscale_view()  # The transformation of the data is only valid when the limits are known.
    marks = axes.transData.transform([(point.x, point.gap) for point in points])
    centers = place_labels(marks, labels, axes.bbox.extents)
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
    """Find the points for which no other point is better in both values.

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


def _describe_entries_without_messages(
    results: Sequence[Mapping[str, Any]], labels: Sequence[str]
) -> Iterator[str]:
    """Yield a note on the entries that were made before robots shared maps by messages, if there are any."""
    pairs = zip(results, labels, strict=True)
    old_entries = [label for result, label in pairs if not shares_maps_by_messages(result)]
    if old_entries:
        yield (
            f"{', '.join(old_entries)}: made with an earlier version, in which robots read the current maps "
            "of all robots in communication range, without messages. Loss, latency, message rate and "
            "bandwidth had no effect on shared maps. B/s is an estimate: 20 bytes for a position, 5 for each "
            "changed cell of a map, 28 for each reported position of another robot (number, position, time)."
        )


def _build_entries_table(labeled_results: Iterable[tuple[str, Mapping[str, Any]]]) -> PageTable:
    """Build the table of the entries with their names, source hashes, gains and versions."""
    rows = []
    for label, result in labeled_results:
        entry = result["entry"]
        gains = ", ".join(f"{name} {value}" for name, value in entry["gains"].items())
        source = "built in"
        if entry["source_sha256"]:
            source = f"source {entry['source_sha256'][:12]}"
        origin = "robocov"
        if not result["is_bundled"]:
            # A file can contain any name and any hash.
            source = f"according to the file: {source}"
            origin = "a file, not verified here"
        versions = ", ".join(f"{name} {version}" for name, version in result["versions"].items())
        rows.append((label, entry["controller"], source, origin, gains or ratings.NO_VALUE, versions))
    head = ("Controller", "Name", "Code", "Result from", "Gains", "Versions")
    return PageTable("Entries", head, rows, text_columns=frozenset({1, 2, 3, 4, 5}))


def _build_anomaly_table(
    labeled_results: Iterable[tuple[str, Mapping[str, Any]]], rapf: Mapping[str, Any]
) -> PageTable:
    """Build the table of suspicious runs, with the number of runs for each reason.

    Parameters
    ----------
    labeled_results : iterable of (str, Mapping)
        Labels of the entries, and their results.
    rapf : Mapping
        The result of RAPF with default gains, with which the others are compared.

    Returns
    -------
    PageTable
        The table.
    """
    rows = []
    for label, result in labeled_results:
        runs_by_reason: dict[str, list[str]] = {}
        for anomaly in find_anomalies(result, rapf):
            run = f"{anomaly.track}, {anomaly.map}, seed {anomaly.seed}"
            runs_by_reason.setdefault(anomaly.reason, []).append(run)
        for reason, runs in runs_by_reason.items():
            rows.append((label, str(len(runs)), reason, runs[0]))
    head = ("Controller", "Runs", "Reason", "First run")
    return PageTable("Suspicious runs by controller and reason", head, rows, text_columns=frozenset({2, 3}))


def _find_default_rapf(results: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return the result of RAPF with default gains; without one, a result without rows."""
    for result in results:
        if _is_default_result(result, results) and result["entry"]["controller"] == "rapf":
            return result
    return {"rows": []}
