"""The page that compares results of the benchmark: tables and Pareto plots for each track."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from robocov import __version__
from robocov.arrays import Array
from robocov.errors import ParameterError, format_count
from robocov.text import escape_controls
from robocov_app.benchmark import ratings, suite
from robocov_app.benchmark.ratings import Rating, number
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import quiet_axes, tone
from robocov_app.figures.styles import MARKS, CurveStyle, styles_of
from robocov_app.render.theme import LIGHT
from robocov_app.report import replay
from robocov_app.report.document import template
from robocov_app.report.plots import Plot
from robocov_app.report.svg import inline_svg
from robocov_app.report.tables import Table
from robocov_app.report.theme_css import theme_rules

AXES: Mapping[str, tuple[str, str, Callable[[Rating], float]]] = {
    "path": ("path length", "mean path length of a robot (m)", lambda each: each.median("path_length_m")),
    "computing": ("computing time", "µs per robot and second", lambda each: 1e6 * each.rate("deciding_s")),
    "told": ("bytes sent", "bytes a robot sends per second", lambda each: each.rate("told_bytes")),
}
"""Quantities that the gap is plotted against: title, axis label, and the value of an entry."""
WHOLE = "whole map"  # what those know that are no rivals
PANEL = 560, 350  # of a plot in pixels: there are many labels
_POINTS = 72.0  # in an inch
_LETTER, _LINE = 6.0, 13.0  # width of a letter of a label, and height of the label, in pixels
_AWAY = 8.0  # pixels of a label from its mark
_ALIKE = 1.01  # times that values differ at least
_SPAN = 8.0  # times that values differ from which on their axis is logarithmic


class Point(NamedTuple):
    """An entry in a plot; `rival`: it does not know the whole map."""

    style: CurveStyle
    label: str
    x: float
    gap: float
    rival: bool


def page_of(results: Sequence[Mapping[str, Any]], title: str) -> str:
    """Return the page of some results, a section for each track; same results, same page."""
    labels = ratings.labels_of(results)
    looks = dict(zip(labels, styles_of([each["entry"]["controller"] for each in results]), strict=True))
    knows = {label: each["entry"]["information"] for label, each in zip(labels, results, strict=True)}
    tracks = {
        name: sorted(own, key=lambda each: (np.isnan(each.gap.estimate), each.gap.estimate))
        for name, own in ratings.ratings_of(results).items()
    }
    if not tracks:
        raise ParameterError("DIR: the results have no run in common, so there is nothing to compare")
    page = template("benchmark.html.jinja").render(
        title=title,
        suite=suite.VERSION,
        version=__version__,
        style=theme_rules(":root") + replay.asset("report.css"),
        marks=MARKS,
        looks=looks,
        overview=_overview(labels, tracks),
        tracks=[_section(name, own, looks, knows) for name, own in tracks.items()],
        notes=ratings.NOTES,
        method=list(dict.fromkeys(words for each in results for words in each["method"])),
        entries=_entries(results, labels),
    )
    return escape_controls(page)


def _overview(labels: Sequence[str], tracks: Mapping[str, Sequence[Rating]]) -> Table:
    """Return the median gaps of all entries on all tracks, those first that are ahead on most."""
    gaps = {(each.label, name): each.gap.estimate for name, own in tracks.items() for each in own}
    every = [(each.label, rank) for own in tracks.values() for rank, each in enumerate(own)]
    ranks = {label: [rank for other, rank in every if other == label] for label in labels}
    order = sorted((label for label in labels if ranks[label]), key=lambda label: np.mean(ranks[label]))
    percent = [[number(100.0 * gaps.get((label, name), np.nan), ".1f") for name in tracks] for label in order]
    rows = [(label, *cells) for label, cells in zip(order, percent, strict=True)]
    heads = (suite.heading(name) for name in tracks)
    return Table("Median gap to the best placement known, %", ("Controller", *heads), rows)


def _section(
    name: str, own: Sequence[Rating], looks: Mapping[str, CurveStyle], knows: Mapping[str, str]
) -> dict[str, Any]:
    track, some = suite.TRACKS[name], own[0]
    maps = len({row["map"] for rating in own for row in rating.rows})
    head, families = ratings.family_rows(own)
    runs = f"{format_count(len(some.rows) + some.failed, 'run')} on {format_count(maps, 'map')}"
    team = f"{format_count(track.robots, 'robot')}, {track.duration:g} s"
    rows, plots = [ratings.rating_row(each, knows[each.label]) for each in own], []
    for axis, (title, label, of) in AXES.items():
        points = []
        for each in own:
            x, gap, rival = of(each), 100.0 * each.gap.estimate, knows[each.label] != WHOLE
            points.append(Point(looks[each.label], each.label, x, gap, rival))
        fine = [point for point in points if np.isfinite((point.x, point.gap)).all()]
        values = [point.x for point in fine]
        # what is the same for all tells nothing
        if len(fine) > 1 and max(values) > _ALIKE * min(values):
            words = "; ".join(f"{point.label}: {point.x:.3g}, gap {point.gap:.1f} %" for point in fine)
            sentence = f"Median gap against {label}. {words}."
            svg = inline_svg(pareto_figure(fine, label), f"{name}-{axis}", sentence)
            plots.append(Plot(f"Gap and {title}", svg))
    return {
        "name": name,
        "title": suite.heading(name),
        "summary": f"{track.summary.capitalize()}; {team}. {runs}, the same for all entries.",
        "table": Table("Ratings", ratings.HEAD, rows, frozenset({1})),
        "families": Table("Median gap by families of maps, %", head, families),
        "plots": plots,
    }


@plain_style()
def pareto_figure(points: Sequence[Point], label: str) -> Figure:
    """Plot the gap (%) of entries against something else, both to be small, with the front of the rivals."""
    width, height = PANEL
    figure = Figure((width / _POINTS, height / _POINTS), dpi=_POINTS)
    axes = figure.add_axes((0.08, 0.14, 0.9, 0.75))
    rivals = [(point.x, point.gap) for point in points if point.rival]
    front = np.array([rivals[k] for k in pareto_front(rivals)]).reshape(-1, 2)
    axes.plot(*front.T, color=tone(LIGHT.faint), linewidth=1.0, zorder=1)
    for point in points:
        colour = tone(point.style.colour(LIGHT))
        fill = colour if point.rival else tone(LIGHT.background)
        look: Any = {"markersize": 9, "markeredgewidth": 1.6, "markeredgecolor": colour, "linestyle": ""}
        axes.plot([point.x], [point.gap], marker=point.style.mark, markerfacecolor=fill, zorder=3, **look)
    values = [point.x for point in points]
    if min(values) > 0.0 and max(values) > _SPAN * min(values):
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.set_yscale("symlog", linthresh=1.0)  # per cent
    for line in (axes.xaxis, axes.yaxis):
        line.set_major_formatter("{x:g}")
        line.set_minor_locator(NullLocator())
    axes.margins(x=0.12, y=0.1)
    quiet_axes(axes, LIGHT, label, "median gap (%)", grid="y")
    pixels = axes.transData.transform([(point.x, point.gap) for point in points])
    words: Any = {"fontsize": 11, "color": tone(LIGHT.ink), "ha": "center", "va": "center"}
    for point, place, middle in zip(points, pixels, label_places(pixels, points), strict=True):
        axes.annotate(point.label, (point.x, point.gap), middle - place, textcoords="offset points", **words)
    return figure


def label_places(marks: Array, points: Sequence[Point]) -> Array:
    """Return where the middles of the labels are, (n, 2) pixels, so that they hide no mark and no label."""
    taken = list(shapely.box(*(marks - 6.0).T, *(marks + 6.0).T))
    frame, middles = shapely.box(0.0, 0.0, *PANEL), []
    for mark, point in zip(marks, points, strict=True):
        half = np.array([0.5 * _LETTER * len(point.label), 0.5 * _LINE])
        beside, steps = half[0] + _AWAY, []
        for up in (0.0, 0.7, -0.7, 1.4, -1.4, 2.1, -2.1, 2.8, -2.8):
            steps += [(beside, up * _LINE), (-beside, up * _LINE)] + [(0.0, up * _LINE)] * (abs(up) > 1.0)
        tried = mark + np.array(steps)
        boxes = shapely.box(*(tried - half).T, *(tried + half).T)
        hidden = shapely.area(shapely.intersection(boxes[:, None], taken)).sum(axis=1)
        best = int(np.argmin(np.round(hidden + 1e3 * shapely.area(shapely.difference(boxes, frame)), 6)))
        taken.append(boxes[best])
        middles.append(tried[best])
    return np.array(middles)


def pareto_front(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return which points no other one beats in both, by their first values."""
    front: list[int] = []
    for k in sorted(range(len(points)), key=lambda k: points[k]):
        if not front or points[k][1] < points[front[-1]][1]:
            front.append(k)
    return front


def _entries(results: Sequence[Mapping[str, Any]], labels: Sequence[str]) -> Table:
    rows = []
    for result, label in zip(results, labels, strict=True):
        entry = result["entry"]
        gains = ", ".join(f"{name} {value}" for name, value in entry["gains"].items())
        source = f"source {entry['source_sha256'][:12]}" if entry["source_sha256"] else "built in"
        versions = ", ".join(f"{name} {number}" for name, number in result["versions"].items())
        rows.append((label, entry["controller"], source, gains or "–", versions))
    head = ("Controller", "Name", "Code", "Gains", "Made with")
    return Table("Entries", head, rows, frozenset({1, 2, 3, 4}))
