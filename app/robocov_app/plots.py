"""Publication plots: trajectories, cost curves and comparisons, as matplotlib figures.

matplotlib is imported when a plot is made, never before; pyplot, which would want a display, never.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from robocov.atomic import written
from robocov.errors import ParameterError, shown
from robocov_app.page import SMALL, TEXT, TITLE, Box, Page, plain_style, tone
from robocov_app.plot_arena import draw_map, draw_run, map_handles, run_handles
from robocov_app.plot_curves import Curve, draw_curves, end_label
from robocov_app.view.camera import length_label, round_length
from robocov_app.view.theme import LIGHT, Theme, theme_named

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from robocov.environment import Environment
    from robocov.record import Record


def plot_environment(
    environment: Environment,
    axes: Axes | None = None,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
) -> Figure:
    """Plot a map: its free space, its obstacles and the convex region that the robots know.

    Parameters
    ----------
    environment : Environment
    axes : matplotlib Axes or None
        Where to draw; they get ticks in metres. None makes a page with title, scale bar and legend.
    theme : Theme or {"light", "dark"}
    size : (width, height) or None, px
        Of the page; by default what suits the shape of the map.

    Returns
    -------
    matplotlib Figure
    """
    theme = _theme(theme)
    with plain_style():
        if axes is not None:
            _ticks(axes, environment, theme)
            draw_map(axes, environment, theme)
            return _figure_of(axes)
        page = Page(size or _size_for(environment), theme)
        facts = f"{environment.area:.4g} m² inside the boundary, {environment.free_area:.4g} m² free"
        box = _arena_box(page, environment)
        axes = _arena(page, box, environment)
        draw_map(axes, environment, theme)
        _titles(page, box, environment.name, facts)
        _scale_bar(page, box[0], box[1] + box[3], _zoom(box, environment))
        page.legend(map_handles(environment, theme), box[1] + box[3] + 34 * page.scale)
        return page.figure


def plot_trajectories(
    record: Record,
    axes: Axes | None = None,
    theme: Theme | str = LIGHT,
    colours: str = "paper",
    size: tuple[int, int] | None = None,
    mean_distance: float | None = None,
) -> Figure:
    """Plot a whole run: map, where the robots began, went and ended, and the final Voronoi cells.

    Parameters
    ----------
    record : Record
    axes : matplotlib Axes or None
        Where to draw; they get ticks in metres. None makes a page with title, scale bar and legend.
    theme : Theme or {"light", "dark"}
    colours : {"paper", "robots"}
        The paper's green starts, red trajectories and blue final positions, or a hue for each robot.
    size : (width, height) or None, px
        Of the page; by default what suits the shape of the map.
    mean_distance : float or None, m
        Of the final positions, for the title.

    Returns
    -------
    matplotlib Figure
    """
    _check_colours(colours)
    theme = _theme(theme)
    with plain_style():
        if axes is not None:
            _ticks(axes, record.environment, theme)
            draw_run(axes, record, theme, colours)
            return _figure_of(axes)
        page = Page(size or _size_for(record.environment), theme)
        box = _arena_box(page, record.environment)
        axes = _arena(page, box, record.environment)
        draw_run(axes, record, theme, colours)
        n = len(record.team)
        facts = f"{_facts(record, mean_distance)}  ·  {n} robot{'s' if n > 1 else ''}"
        _titles(page, box, f"{record.label}  ·  {record.environment.name}", facts)
        _scale_bar(page, box[0], box[1] + box[3], _zoom(box, record.environment))
        page.legend(run_handles(record, theme, colours), box[1] + box[3] + 34 * page.scale)
        return page.figure


def plot_comparison(
    records: Sequence[Record],
    theme: Theme | str = LIGHT,
    colours: str = "paper",
    size: tuple[int, int] | None = None,
    mean_distances: Sequence[float | None] | None = None,
) -> Figure:
    """Plot several runs side by side at one scale.

    Parameters
    ----------
    records : sequence of Record
        At least one.
    theme : Theme or {"light", "dark"}
    colours : {"paper", "robots"}
    size : (width, height) or None, px
        Of the page; by default what suits the shapes of the maps.
    mean_distances : sequence of float or None, m
        Of the final positions, for the titles.

    Returns
    -------
    matplotlib Figure

    Raises
    ------
    ParameterError
        When there are no records, or not one mean distance for each.
    """
    _check_colours(colours)
    costs = list(mean_distances) if mean_distances is not None else [None] * len(records)
    if not records or len(costs) != len(records):
        raise ParameterError(
            f"comparison: {len(records)} runs and {len(costs)} mean distances, "
            f"but at least one run and one distance for each was wanted"
        )
    theme = _theme(theme)
    with plain_style():
        bounds = np.array([record.environment.region.bounds for record in records])
        limits = (*bounds[:, :2].min(axis=0).tolist(), *bounds[:, 2:].max(axis=0).tolist())
        aspect = (limits[2] - limits[0]) / (limits[3] - limits[1])
        if size is not None:
            columns = _columns(len(records), aspect, size)
        else:
            in_a_row = len(records) <= 3 and aspect < 2.5
            columns = len(records) if in_a_row else _columns(len(records), aspect, (1400, 800))
            rows, wide = -(-len(records) // columns), 1400 if columns < 3 else 1800
            size = (wide, int(np.clip(rows * ((wide - 36) / columns / aspect + 62) + 70, 320, 2400)))
        page = Page(size, theme)
        facts = [_facts(record, cost) for record, cost in zip(records, costs, strict=True)]
        words = max(page.text_width(text) for text in facts)
        panels = page.panels(len(records), columns, aspect, words)
        for record, text, (box, room) in zip(records, facts, panels, strict=True):
            axes = page.axes(box)
            axes.set_xlim(limits[0], limits[2])
            axes.set_ylim(limits[1], limits[3])
            axes.set_axis_off()
            draw_run(axes, record, theme, colours)
            left, top = box[0], box[1]
            page.text(record.label, left, top - 38 * page.scale, points=TITLE, bold=True, room=room)
            page.text(text, left, top - 16 * page.scale, colour=theme.faint, room=room)
        (left, _, width, _), _ = panels[0]
        bottom = max(box[1] + box[3] for box, _ in panels)
        _scale_bar(page, left, bottom, width / (limits[2] - limits[0]))
        handles: dict[str, Artist] = {}
        for record in records:
            handles |= {str(h.get_label()): h for h in run_handles(record, theme, colours)}
        page.legend(list(handles.values()), bottom + 34 * page.scale)
        return page.figure


def plot_cost(
    curves: Sequence[Curve],
    axes: Axes | None = None,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "Coverage cost over time",
) -> Figure:
    """Plot mean distance against time, each curve named with its final value at its end.

    Parameters
    ----------
    curves : sequence of (label, controller, (T,) s, (T,) m)
        RAPF is blue and RPF red, as in the paper; curves differ in their dashes as well.
    axes : matplotlib Axes or None
        Where to draw; the labels stand to the right of them. None makes a page.
    theme : Theme or {"light", "dark"}
    size : (width, height) or None, px
        Of the page; by default 1000 x 560.
    title : str

    Returns
    -------
    matplotlib Figure

    Raises
    ------
    ParameterError
        When there are no curves, or one has no finite value.
    """
    if not curves:
        raise ParameterError("curves: none were given, but at least one was wanted")
    for label, _, time, values in curves:
        if len(time) != len(values) or not np.isfinite(values).any():
            raise ParameterError(
                f"curve {shown(label)}: {len(time)} times, {int(np.isfinite(values).sum())} finite values, "
                f"but a value for each time and a finite one was wanted"
            )
    theme = _theme(theme)
    with plain_style():
        size = size or (1000, 560)
        page = Page(size, theme) if axes is None else None
        if axes is None:
            assert page is not None
            s = page.scale
            longest = max(page.text_width(end_label(curve), bold=True) for curve in curves)
            right = min(36 * s + longest, 0.45 * size[0])
            box = (74 * s, 58 * s, size[0] - 74 * s - right, size[1] - 58 * s - 62 * s)
            page.text(title, page.margin, 28 * s, points=TITLE, bold=True, room=size[0] - 2 * page.margin)
            axes = page.axes(box)
        draw_curves(axes, curves, theme)
        return _figure_of(axes)


def save_figure(figure: Figure, path: Path | str) -> None:
    """Write a figure as PNG or SVG, by the path's suffix, whole or not at all.

    A PNG has exactly the page's pixels. An SVG holds its letters as outlines, so that it looks the
    same everywhere, and no date: the same plot gives the same bytes.

    Raises
    ------
    OutputError
        When the file cannot be written.
    ParameterError
        When the suffix is another.
    """
    import matplotlib

    path = Path(path)
    kind = path.suffix.lower().lstrip(".")
    if kind not in ("png", "svg"):
        raise ParameterError(f"{path}: suffix {shown(path.suffix)}, but .png or .svg was wanted")
    metadata: dict[str, str | None] = {"Date": None} if kind == "svg" else {"Software": None}
    with (
        written(path) as part,
        matplotlib.rc_context({"svg.hashsalt": "robocov", "svg.fonttype": "path", "savefig.bbox": None}),
    ):
        figure.savefig(part, format=kind, dpi=figure.dpi, metadata=metadata, facecolor=figure.get_facecolor())


def _figure_of(axes: Axes) -> Figure:
    return cast("Figure", axes.get_figure(root=True))


def _theme(theme: Theme | str) -> Theme:
    return theme_named(theme) if isinstance(theme, str) else theme


def _check_colours(colours: str) -> None:
    if colours not in ("paper", "robots"):
        raise ParameterError(f"colours: {shown(colours)}, but 'paper' or 'robots' was wanted")


def _ticks(axes: Axes, environment: Environment, theme: Theme) -> None:
    """Prepare axes that somebody else laid out: equal scales, ticks in metres."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    axes.set_aspect("equal")
    axes.set_xlim(low_x, high_x)
    axes.set_ylim(low_y, high_y)
    axes.set_xlabel("x (m)")
    axes.set_ylabel("y (m)")
    axes.set_facecolor(tone(theme.background))


def _size_for(environment: Environment) -> tuple[int, int]:
    """Return a page's size that suits the map's shape: about a million pixels, neither side too short."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    aspect = (high_x - low_x) / (high_y - low_y)
    if aspect >= 1.0:
        return 1400, int(np.clip(1364 / aspect + 155, 290, 1400))
    return int(np.clip(1130 * aspect + 60, 800, 1300)), 1300


def _arena_box(page: Page, environment: Environment) -> Box:
    """Return the largest box for the map that leaves room for titles above, scale bar and legend below."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    aspect = (high_x - low_x) / (high_y - low_y)
    above, below = 58 * page.scale, 74 * page.scale
    room_x, room_y = page.size[0] - 2 * page.margin, page.size[1] - above - below
    width = min(room_x, room_y * aspect)
    height = width / aspect
    top = above + (room_y - height) / 2
    return (page.size[0] - width) / 2, top, width, height


def _arena(page: Page, box: Box, environment: Environment) -> Axes:
    """Return axes that show exactly the region's bounds, without ticks: the page has a scale bar."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    axes = page.axes(box)
    axes.set_xlim(low_x, high_x)
    axes.set_ylim(low_y, high_y)
    axes.set_axis_off()
    return axes


def _titles(page: Page, box: Box, title: str, facts: str) -> None:
    """Write two lines above `box`; above a narrow map they may be wider than it."""
    left, top, width, _ = box
    room = page.size[0] - 2 * page.margin
    for text, up, points, bold, colour in (
        (title, 38, TITLE, True, page.theme.ink),
        (facts, 16, TEXT, False, page.theme.faint),
    ):
        wide = min(page.text_width(text, points=points, bold=bold), room)
        start = left if wide <= width else max(left + (width - wide) / 2, page.margin)
        page.text(text, start, top - up * page.scale, points=points, bold=bold, colour=colour, room=room)


def _facts(record: Record, mean_distance: float | None) -> str:
    """Return the mean distance and the time: first what may not be cut."""
    facts = [f"t = {record.time[-1]:.1f} s"]
    if mean_distance is not None and np.isfinite(mean_distance):
        facts.insert(0, f"mean distance {mean_distance:.3f} m")
    return "  ·  ".join(facts)


def _scale_bar(page: Page, left: float, bottom: float, zoom: float) -> None:
    """Draw a bar of a round length under the left end of an arena; `zoom` is in pixels per metre."""
    from matplotlib.lines import Line2D

    length = round_length(max(min(140 * page.scale, page.size[0] / 6), 20.0) / zoom)
    y, tick = bottom + 17 * page.scale, 4 * page.scale
    right = left + length * zoom
    for (x1, y1), (x2, y2) in (
        ((left, y), (right, y)),
        ((left, y - tick), (left, y + tick)),
        ((right, y - tick), (right, y + tick)),
    ):
        (a, b), (c, d) = page.at(x1, y1), page.at(x2, y2)
        page.figure.add_artist(Line2D([a, c], [b, d], color=tone(page.theme.ink), linewidth=1.3))
    page.text(length_label(length), right + 8 * page.scale, y, points=SMALL, bold=True)


def _zoom(box: Box, environment: Environment) -> float:
    low_x, _, high_x, _ = environment.region.bounds
    return box[2] / (high_x - low_x)


def _columns(count: int, aspect: float, size: tuple[int, int]) -> int:
    """Return the number of columns that lets `count` panels of this aspect be largest on a page."""

    def width(columns: int) -> float:
        rows = -(-count // columns)
        return min(size[0] / columns, (size[1] - 90) / rows * aspect)

    return max(range(1, count + 1), key=lambda columns: (width(columns), columns))
