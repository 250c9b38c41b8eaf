"""Publication plots of maps and runs: trajectories, cost curves, comparisons, metrics; never pyplot's."""

from collections.abc import Callable, Sequence
from itertools import compress
from operator import not_
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov.arrays import Array
from robocov.environment import Environment
from robocov.errors import ParameterError, format_count, quote
from robocov.metrics.run_metrics import RunMetrics
from robocov.record import Record
from robocov_app.figures.arena import draw_map, draw_run, label_of, map_handles, run_handles, ticks_in_meters
from robocov_app.figures.curves import Curve, draw_curves, end_label
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import HEADING, TEXT, TITLE, Page, check_some, figure_of
from robocov_app.look.legend import merge_legends
from robocov_app.look.robot_colors import ColorScheme
from robocov_app.look.theme import LIGHT, Theme, get_theme
from robocov_app.render.density import cost_label, mean_label
from robocov_app.render.layout import columns_for

_SCALE = 1.3  # of texts and lines on a page of the usual width: its legend stands beside the scale bar
MOST_MAPS = 60  # maps on a sheet: more would be too small to be seen
_WIDTH, _HIGHEST = 1600, 1600  # pixels of a sheet, across and at most down


@plain_style()
def plot_environment(
    environment: Environment,
    axes: Axes | None = None,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
) -> Figure:
    """Plot a map on `axes`, or on a page of `size` px: free space, obstacles, the region that robots know."""
    theme = get_theme(theme)
    if axes is None:
        facts = f"{environment.area:.4g} m² inside the boundary, {environment.free_area:.4g} m² free"
        axes = _map_page(environment, theme, size, environment.name, facts, map_handles(environment, theme))
    else:
        ticks_in_meters(axes, environment, theme)
    draw_map(axes, environment, theme)
    return figure_of(axes)


@plain_style()
def plot_trajectories(
    record: Record,
    axes: Axes | None = None,
    theme: Theme | str = LIGHT,
    colors: ColorScheme = "paper",
    size: tuple[int, int] | None = None,
    mean_distance: float | None = None,
    mean_time: float | None = None,
) -> Figure:
    """Plot a whole run: map, where the robots began, went and ended, and the final Voronoi cells.

    `axes`: None makes a page of `size` px. `colors`: those of the paper, or a hue for each robot.
    `mean_distance`, m, and `mean_time`, s, of the final positions are for the title.
    """
    if colors not in ("paper", "robots"):
        raise ParameterError(f"colors: expected 'paper' or 'robots', got {quote(colors)}")
    theme = get_theme(theme)
    if axes is None:
        facts = _line(*_facts(record, mean_distance, mean_time))
        title, handles = _line(record.label, record.environment.name), run_handles(record, theme, colors)
        axes = _map_page(record.environment, theme, size, title, facts, handles)
    else:
        ticks_in_meters(axes, record.environment, theme)
    draw_run(axes, record, theme, colors)
    return figure_of(axes)


@plain_style()
def plot_comparison(
    records: Sequence[Record],
    theme: Theme | str = LIGHT,
    colors: ColorScheme = "paper",
    size: tuple[int, int] | None = None,
    mean_distances: Sequence[float | None] | None = None,
    mean_times: Sequence[float | None] | None = None,
) -> Figure:
    """Plot runs side by side at one scale, with final mean distances, m, and times, s, in the titles."""
    costs, times = (known or [None] * len(records) for known in (mean_distances, mean_times))
    theme = get_theme(theme)
    bounds = np.array([record.environment.region.bounds for record in records])
    limits = (*bounds[:, :2].min(axis=0).tolist(), *bounds[:, 2:].max(axis=0).tolist())
    aspect = (limits[2] - limits[0]) / (limits[3] - limits[1])
    shared, captions = _captions(records, costs, times)
    entries = merge_legends((run_handles(record, theme, colors) for record in records), label_of)
    scale = 1.5 if size is None else None
    page = Page(size or (1600, 1000), theme, scale)
    s = page.scale
    above, top = 54 * s, 50 * s if shared else 8 * s
    words = [
        (page.text_width(record.label, points=TITLE, bold=True), page.text_width(text))
        for record, text in zip(records, captions, strict=True)
    ]
    columns = columns_for(len(records), aspect, (page.size[0], page.size[1] - 2 * top), above)
    fitting = (page.size[0] - page.margin) / (max(max(both) for both in words) + page.margin)
    columns = max(min(columns, int(fitting)), 1)
    slot = (page.size[0] - page.margin) / columns - page.margin
    one_line = all(name + text + 16 * s <= slot for name, text in words)
    above = (30 if one_line else 54) * s
    if size is None:
        rows = -(-len(records) // columns)
        tall = top + rows * (above + slot / aspect + 14 * s) + page.footer_height(entries)
        page = Page((page.size[0], int(np.clip(tall, 320, 1800))), theme, scale)
    wide = max((name + text + 16 * s if one_line else max(name, text)) for name, text in words)
    panels = page.panels(len(records), columns, aspect, wide, above, top, page.footer_height(entries))
    first, room = panels[0]
    for record, text, (box, _) in zip(records, captions, panels, strict=True):
        draw_run(page.map_axes(box, *limits), record, theme, colors)
        left, edge, up = box[0], box[1], 16 * s
        if one_line:
            page.text(record.label, left, edge - up, points=TITLE, bold=True)
            right = left + max(box[2], min(room, wide))
            page.text(text, right, edge - up, color=theme.faint, align="right")
        else:
            page.text(record.label, left, edge - 38 * s, points=TITLE, bold=True, room=room)
            page.text(text, left, edge - up, color=theme.faint, room=room)
    if shared:
        page.text(shared, first[0], first[1] - above - 20 * s, points=HEADING, bold=True, room=page.room)
    taken = [(x, y, max(width, room if one_line else 0.0), height) for (x, y, width, height), _ in panels]
    page.footer(entries, taken, first[2] / (limits[2] - limits[0]))
    return page.figure


@plain_style()
def plot_cost(
    curves: Sequence[Curve],
    axes: Axes | None = None,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "Coverage cost over time",
) -> Figure:
    """Plot mean distance against time, each curve named with its final value at its end.

    `axes`: None makes a page of `size` px with a `title`. Raises ParameterError when there are no
    curves, or one has no finite value.
    """
    check_some("curves", curves)
    for label, _, time, values in curves:
        if len(time) != len(values) or not np.isfinite(values).any():
            raise ParameterError(
                f"curve {quote(label)}: {len(time)} times, {int(np.isfinite(values).sum())} finite values, "
                f"expected a value for each time and a finite one"
            )
    theme = get_theme(theme)
    if axes is None:
        wide, high = size or (1000, 560)
        # few things are on it: they may be large
        page = Page((wide, high), theme, float(np.clip(min(wide / 800, high / 450), 0.8, 6.0)))
        s = page.scale
        longest = max(page.text_width(end_label(curve), bold=True) for curve in curves)
        right = min(40 * s + longest, 0.45 * wide)
        page.text(title, 52 * s, 30 * s, points=TITLE, bold=True, room=wide - 52 * s - page.margin)
        axes = page.axes((52 * s, 86 * s, wide - 52 * s - right, high - 86 * s - 56 * s))
    draw_curves(axes, curves, theme)
    return figure_of(axes)


def _map_page(
    environment: Environment,
    theme: Theme,
    size: tuple[int, int] | None,
    title: str,
    facts: str,
    handles: Sequence[Artist],
) -> Axes:
    low_x, low_y, high_x, high_y = environment.region.bounds
    aspect = (high_x - low_x) / (high_y - low_y)
    page = Page(size or (1400, 1000), theme, None if size else _SCALE)
    if size is None:
        around = 58 * page.scale + page.footer_height(handles)
        wide = float(np.clip((1300 - around) * aspect + 2 * page.margin, 840, 1400))
        high = float(np.clip((wide - 2 * page.margin) / aspect + around, 300, 1300))
        page = Page((int(wide), int(high)), theme, _SCALE)
    above = 58 * page.scale
    room_y = page.size[1] - above - page.footer_height(handles)
    width = min(page.room, room_y * aspect)
    height = width / aspect
    box = (page.size[0] - width) / 2, above + (room_y - height) / 2, width, height
    lines = (title, 38, TITLE, True, theme.ink), (facts, 16, TEXT, False, theme.faint)
    for text, up, points, bold, color in lines:
        # above a narrow map lines may be wider than it
        wide = min(page.text_width(text, points=points, bold=bold), page.room)
        start = box[0] if wide <= width else max(box[0] + (width - wide) / 2, page.margin)
        y = box[1] - up * page.scale
        page.text(text, start, y, points=points, bold=bold, color=color, room=page.room)
    page.footer(handles, [box], width / (high_x - low_x))
    return page.map_axes(box, low_x, low_y, high_x, high_y)


def _captions(
    records: Sequence[Record], costs: Sequence[float | None], times: Sequence[float | None]
) -> tuple[str, list[str]]:
    """Return what is true of all runs, for the page's title, and of each, what is not."""
    known = [_facts(*each) for each in zip(records, costs, times, strict=True)]
    both = zip(records, known, strict=True)
    every = [(record.environment.name, robots, time) for record, (_, time, robots) in both]
    shared = [len(set(found)) == 1 for found in zip(*every, strict=True)]
    unlike = [tuple(compress(facts, map(not_, shared))) for facts in every]
    own = [_line(cost, *facts) for (cost, _, _), facts in zip(known, unlike, strict=True)]
    return _line(*compress(every[0], shared)), own


def _line(*facts: str) -> str:
    return "  ·  ".join(fact for fact in facts if fact)


def _facts(record: Record, mean_distance: float | None, mean_time: float | None) -> tuple[str, str, str]:
    """Return the cost (empty where it is not known), the time, and the number of robots in words."""
    mean = mean_label(record.environment)
    cost = "" if mean_distance is None else cost_label(mean, mean_distance, mean_time)
    return cost, f"t = {record.time[-1]:.1f} s", format_count(len(record.team), "robot")


@plain_style()
def plot_maps(environments: Sequence[Environment], theme: Theme | str = LIGHT) -> Figure:
    """Plot the first `MOST_MAPS` maps side by side at one scale, each under its name."""
    theme = get_theme(theme)
    drawn = environments[:MOST_MAPS]
    title = f"{len(drawn)} of {len(environments)}" if len(drawn) < len(environments) else ""
    bounds = np.array([environment.region.bounds for environment in drawn])
    wide, high = (bounds[:, 2:] - bounds[:, :2]).max(axis=0).tolist()
    entries = [*{label_of(each): each for one in drawn for each in map_handles(one, theme)}.values()]
    page = Page((_WIDTH, _HIGHEST), theme, 1.5)
    above, top = 26 * page.scale, (46 if title else 8) * page.scale
    columns = columns_for(len(drawn), wide / high, (1600, 1200), above)
    slot = (_WIDTH - page.margin) / columns - page.margin
    rows = -(-len(drawn) // columns)
    tall = top + rows * (above + slot * high / wide + 14 * page.scale) + page.footer_height(entries)
    page = Page((_WIDTH, int(np.clip(tall, 320, _HIGHEST))), theme, 1.5)
    panels = page.panels(len(drawn), columns, wide / high, 0.0, above, top, page.footer_height(entries))
    for environment, (low_x, low_y, *_), (box, room) in zip(drawn, bounds.tolist(), panels, strict=True):
        draw_map(page.map_axes(box, low_x, low_y, low_x + wide, low_y + high), environment, theme)
        page.text(environment.name, box[0], box[1] - 12 * page.scale, bold=True, room=room)
    first, _ = panels[0]
    if title:
        y = first[1] - above - 18 * page.scale
        page.text(title, first[0], y, points=HEADING, bold=True, room=page.room)
    page.footer(entries, [box for box, _ in panels], first[2] / wide)
    return page.figure


class Measured(NamedTuple):
    """A run and what was measured of it."""

    label: str
    controller: str
    metrics: RunMetrics


def share(area: Callable[[RunMetrics], Array]) -> Callable[[RunMetrics], Array]:
    return lambda metrics: np.asarray(100.0 * area(metrics) / metrics.free_area)


# label, unit and values of each panel
PANELS: tuple[tuple[str, str, Callable[[RunMetrics], Array]], ...] = (
    ("sensed, in line of sight (% of the free area)", "%", share(lambda each: each.sensed_area)),
    ("in line of sight (% of the free area)", "%", share(lambda each: each.visible_area)),
    ("work |F v| (J)", "J", lambda each: each.work),
    ("way of a robot (m)", "m", lambda each: each.path_length),
)


@plain_style()
def plot_metrics(runs: Sequence[Measured], theme: Theme | str, title: str) -> Figure:
    theme = get_theme(theme)
    page = Page((1200, 800), theme)
    s = page.scale
    page.title(title, 26)
    width, height = 600.0, 400.0 - 20 * s
    for k, (label, unit, of) in enumerate(PANELS):
        curves = [(each.label, each.controller, each.metrics.time, of(each.metrics)) for each in runs]
        longest = max(page.text_width(end_label(curve, unit), bold=True) for curve in curves)
        row, column = divmod(k, 2)
        left, top = column * width + 44 * s, 40 * s + row * height + 36 * s
        right = min(24 * s + longest, 0.5 * width)
        axes = page.axes((left, top, width - 44 * s - right, height - 84 * s))
        draw_curves(axes, curves, theme, label=label, unit=unit, weight=0.8)
    return page.figure
