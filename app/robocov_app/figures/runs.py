"""Figures of maps and runs: trajectories, cost curves, comparisons and metrics, without pyplot."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov.environment import Environment
from robocov.errors import ParameterError, format_count, quote
from robocov.metrics.run_metrics import RunMetrics
from robocov.record import Record
from robocov.typing import FloatArray
from robocov_app.figures import arena
from robocov_app.figures.curves import (
    CurveMargins,
    TimeCurve,
    add_curve_axes,
    draw_curves,
    measure_end_labels,
)
from robocov_app.figures.extent import enclose_maps
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import (
    HEADING,
    TITLE,
    FigurePage,
    PageBox,
    PagePanel,
    ValueAxis,
    check_not_empty,
    get_figure,
)
from robocov_app.figures.run_titles import build_run_title
from robocov_app.look.hues import ColorScheme
from robocov_app.look.legend import merge_legends
from robocov_app.look.theme import LIGHT, Theme, get_theme
from robocov_app.render.density_text import format_cost, get_cost_name
from robocov_app.render.panel_grid import choose_column_count

MAX_MAPS = 60
"""Maximum number of maps on a sheet; more would be too small to recognize."""
_MAP_SCALE = 1.3
"""Scale of texts and lines on a page of default width, on which the legend fits next to the scale bar."""
_SHEET_WIDTH_PX = 1600
_MAX_SHEET_HEIGHT_PX = 1600
_SHEET_SCALE = 1.5
_MAX_COMPARISON_HEIGHT_PX = 1800
_MIN_HEIGHT_PX = 320
_PANEL_GAP = 14
"""Space below each panel at scale 1."""
# Space above the panels of a comparison at scale 1, px.
_ONE_LINE_CAPTION = 30
_TWO_LINE_CAPTION = 54
_CAPTION_GAP = 16
# Rows of text above a panel or a map at scale 1, px.
_NAME_ROW = 38
_FACTS_ROW = 16
_HEADING_RISE = 20
"""Distance of the heading above the captions of a comparison."""
_TOP_WITHOUT_HEADING = 8
_TOP_WITH_HEADING = 50
_SHEET_CAPTION_HEIGHT = 26
_SHEET_NAME_ROW = 12
_SHEET_HEADING_RISE = 18
_SHEET_TOP_WITH_HEADING = 46
_SHEET_SHAPE_PX = (1600, 1200)
"""Width and height of the area that the maps of a sheet should about fill."""
# Size of a page with one map, px.
_MIN_MAP_PAGE_WIDTH_PX = 840
_MAX_MAP_PAGE_WIDTH_PX = 1400
_MIN_MAP_PAGE_HEIGHT_PX = 300
_MAX_MAP_PAGE_HEIGHT_PX = 1300
_COST_MARGINS = CurveMargins(left=52, top=86, bottom=56, right=52)
"""Space around the curves on a page without maps; the title is above them."""
_MAP_HEAD = 58
"""Space above the map of a page at scale 1, px."""
_METRICS_SIZE_PX = (1200, 800)
_METRIC_TITLE_HEIGHT = 40
"""Space above the panels of metrics at scale 1, px, for the title."""
_METRIC_MARGINS = CurveMargins(left=44, top=36, bottom=48, right=36, max_right_fraction=0.5)


@plain_style()
def plot_environment(
    environment: Environment,
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
) -> Figure:
    """Plot a map: the free space, obstacles, and the region that robots know.

    Parameters
    ----------
    environment : Environment
    axes : matplotlib.axes.Axes, optional
        By default, new axes on a separate page.
    theme : Theme or str
    size : (width, height), px, optional
        Size of the page.

    Returns
    -------
    matplotlib.figure.Figure
    """
    theme = get_theme(theme)
    if axes is None:
        facts = f"{environment.area:.4g} m² inside the boundary, {environment.free_area:.4g} m² free"
        handles = arena.build_map_handles(environment, theme)
        map_page = _create_map_page(environment, theme, size, handles, title=environment.name, facts=facts)
        arena.draw_map(map_page.axes, environment, theme)
        map_page.draw_footer(handles)
        return map_page.page.figure
    arena.set_meter_axes(axes, environment, theme)
    arena.draw_map(axes, environment, theme)
    return get_figure(axes)


@plain_style()
def plot_trajectories(
    record: Record,
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    colors: ColorScheme = "paper",
    size: tuple[int, int] | None = None,
    mean_distance: float | None = None,
    mean_time: float | None = None,
) -> Figure:
    """Plot a whole run: map, starts, trajectories, final positions and final Voronoi cells.

    Parameters
    ----------
    record : Record
    axes : matplotlib.axes.Axes, optional
        By default, new axes on a separate page.
    theme : Theme or str
    colors : {"paper", "robots"}
        Colors of the paper, or a hue for each robot.
    size : (width, height), px, optional
        Size of the page.
    mean_distance, mean_time : float, optional
        Costs of the final positions, m and s, for the title.

    Returns
    -------
    matplotlib.figure.Figure
    """
    if colors not in ("paper", "robots"):
        raise ParameterError(f"colors: expected 'paper' or 'robots', got {quote(colors)}")
    theme = get_theme(theme)
    if axes is None:
        title = _join_facts([build_run_title(record), record.environment.name])
        facts = _join_facts(
            [_format_cost(record, mean_distance, mean_time), _format_time(record), _format_robots(record)]
        )
        handles = arena.build_run_handles(record, theme, colors)
        map_page = _create_map_page(record.environment, theme, size, handles, title=title, facts=facts)
        arena.draw_run(map_page.axes, record, theme, colors)
        map_page.draw_footer(arena.select_drawn(handles, [map_page.axes]))
        return map_page.page.figure
    arena.set_meter_axes(axes, record.environment, theme)
    arena.draw_run(axes, record, theme, colors)
    return get_figure(axes)


@dataclass(frozen=True)
class _Captions:
    """Captions above the panels of a comparison.

    Attributes
    ----------
    shared : str
        Facts that all runs have in common, for the heading of the page.
    names, facts : list of str
        Name of each run, and the facts in which the runs differ.
    name_widths, facts_widths : list of float, px
        Widths of the names and of the facts.
    gap : float, px
        Minimum space between a name and the facts in one line.
    """

    shared: str
    names: list[str]
    facts: list[str]
    name_widths: list[float]
    facts_widths: list[float]
    gap: float

    @property
    def max_width(self) -> float:
        """Width of the longest line if facts are written below names, px."""
        return max(*self.name_widths, *self.facts_widths)

    @property
    def max_joined_width(self) -> float:
        """Width of the longest line if facts are written in the same line as names, px."""
        widths = zip(self.name_widths, self.facts_widths, strict=True)
        return max(name_width + facts_width + self.gap for name_width, facts_width in widths)


@plain_style()
def plot_comparison(
    records: Sequence[Record],
    *,
    theme: Theme | str = LIGHT,
    colors: ColorScheme = "paper",
    size: tuple[int, int] | None = None,
    mean_distances: Sequence[float | None] | None = None,
    mean_times: Sequence[float | None] | None = None,
) -> Figure:
    """Plot runs side by side at the same scale.

    Parameters
    ----------
    records : sequence of Record
    theme : Theme or str
    colors : {"paper", "robots"}
    size : (width, height), px, optional
    mean_distances, mean_times : sequence of float or None, optional
        Costs of the final positions, m and s, for the titles.

    Returns
    -------
    matplotlib.figure.Figure
    """
    theme = get_theme(theme)
    extent = enclose_maps(record.environment for record in records)
    legends = [arena.build_run_handles(record, theme, colors) for record in records]
    handles = merge_legends(legends, arena.get_label)
    if size is None:
        page = FigurePage((_SHEET_WIDTH_PX, 1000), theme, _SHEET_SCALE)
    else:
        page = FigurePage(size, theme)
    captions = _build_captions(page, records, mean_distances, mean_times)
    layout = _arrange_comparison(page, captions, extent.aspect)
    if size is None:
        height = layout.compute_page_height(len(records), extent.aspect, page.measure_footer(handles))
        page = FigurePage((page.size[0], height), theme, _SHEET_SCALE)
    arrange_panels = partial(
        page.arrange_panels,
        len(records),
        layout.columns,
        aspect=extent.aspect,
        caption_width=layout.caption_width,
        caption_height=layout.caption_height,
        top=layout.top,
    )
    panels = arrange_panels(bottom=page.measure_footer(handles))
    # Below maps that are narrower than the page, the footer may need more space.
    panels = arrange_panels(bottom=page.measure_footer(handles, bar_left=panels[0].box.left))
    all_axes = []
    for number, panel in enumerate(panels):
        axes = page.add_map_axes(panel.box, extent.low_x, extent.low_y, extent.high_x, extent.high_y)
        arena.draw_run(axes, records[number], theme, colors)
        all_axes.append(axes)
        if layout.has_one_line_captions:
            _write_one_line(page, captions, number, panel, layout.caption_width)
        else:
            _write_two_lines(page, captions, number, panel)
    first_box = panels[0].box
    _write_heading(page, captions.shared, first_box, layout.caption_height + _HEADING_RISE * page.scale)
    footer_boxes = [_widen_box(panel) if layout.has_one_line_captions else panel.box for panel in panels]
    drawn_handles = arena.select_drawn(handles, all_axes)
    page.draw_footer(drawn_handles, footer_boxes, first_box.width / extent.width)
    return page.figure


@dataclass(frozen=True)
class _ComparisonLayout:
    """Arrangement of the panels of a comparison, px.

    Attributes
    ----------
    top : float
        Space above all panels, for the heading.
    columns : int
    column_width : float
    has_one_line_captions : bool
        Whether the name of a run and its facts are on one line.
    caption_width, caption_height : float
        Size of the lines above a panel.
    gap : float
        Space below each panel.
    """

    top: float
    columns: int
    column_width: float
    has_one_line_captions: bool
    caption_width: float
    caption_height: float
    gap: float

    def compute_page_height(self, count: int, aspect: float, footer_height: float) -> int:
        """Return the height of a page for a number of panels with a given aspect ratio, px."""
        rows = math.ceil(count / self.columns)
        panels_height = rows * (self.caption_height + self.column_width / aspect + self.gap)
        height = self.top + panels_height + footer_height
        return int(np.clip(height, _MIN_HEIGHT_PX, _MAX_COMPARISON_HEIGHT_PX))


def _arrange_comparison(page: FigurePage, captions: _Captions, aspect: float) -> _ComparisonLayout:
    """Choose the layout of panels with a given aspect ratio; captions are on one line if they all fit."""
    scale = page.scale
    top = _TOP_WITHOUT_HEADING * scale
    if captions.shared:
        top = _TOP_WITH_HEADING * scale
    columns = _choose_columns(page, captions, aspect, top)
    column_width = (page.size[0] - page.margin) / columns - page.margin
    has_one_line_captions = captions.max_joined_width <= column_width
    if has_one_line_captions:
        caption_width = captions.max_joined_width
        caption_height = _ONE_LINE_CAPTION * scale
    else:
        caption_width = captions.max_width
        caption_height = _TWO_LINE_CAPTION * scale
    return _ComparisonLayout(
        top=top,
        columns=columns,
        column_width=column_width,
        has_one_line_captions=has_one_line_captions,
        caption_width=caption_width,
        caption_height=caption_height,
        gap=_PANEL_GAP * scale,
    )


def _widen_box(panel: PagePanel) -> PageBox:
    """Return the box of a panel, widened to its caption if that is wider."""
    return panel.box._replace(width=max(panel.box.width, panel.caption_width))


def _write_heading(page: FigurePage, text: str, first_box: PageBox, up: float) -> None:
    """Write the heading `up` pixels above the first panel, unless it is empty."""
    if text:
        y = first_box.top - up
        page.write(text, first_box.left, y, points=HEADING, bold=True, max_width=page.content_width)


def _build_captions(
    page: FigurePage,
    records: Sequence[Record],
    mean_distances: Sequence[float | None] | None,
    mean_times: Sequence[float | None] | None,
) -> _Captions:
    """Build the captions; facts that all runs have in common are only in the heading of the page."""
    unknown = [None] * len(records)
    costs = [
        _format_cost(record, distance, time)
        for record, distance, time in zip(
            records, mean_distances or unknown, mean_times or unknown, strict=True
        )
    ]
    facts = [(record.environment.name, _format_robots(record), _format_time(record)) for record in records]
    is_shared = [len(set(column)) == 1 for column in zip(*facts, strict=True)]
    shared = [fact for fact, is_same in zip(facts[0], is_shared, strict=True) if is_same]
    different_facts = []
    for cost, row in zip(costs, facts, strict=True):
        different = [fact for fact, is_same in zip(row, is_shared, strict=True) if not is_same]
        different_facts.append(_join_facts([cost, *different]))
    names = [build_run_title(record) for record in records]
    return _Captions(
        shared=_join_facts(shared),
        names=names,
        facts=different_facts,
        name_widths=[page.measure_text(name, points=TITLE, bold=True) for name in names],
        facts_widths=[page.measure_text(text) for text in different_facts],
        gap=_CAPTION_GAP * page.scale,
    )


def _choose_columns(page: FigurePage, captions: _Captions, aspect: float, top: float) -> int:
    """Return the number of columns for which panels are as large as possible and captions still fit."""
    space = (page.size[0], page.size[1] - 2 * top)
    best = choose_column_count(len(captions.names), aspect, space, row_margin=_TWO_LINE_CAPTION * page.scale)
    max_columns = int((page.size[0] - page.margin) / (captions.max_width + page.margin))
    return max(min(best, max_columns), 1)


def _write_one_line(
    page: FigurePage, captions: _Captions, number: int, panel: PagePanel, width: float
) -> None:
    """Write the name of a run above its panel on the left, and its facts on the right."""
    left, top, panel_width, _ = panel.box
    row = top - _FACTS_ROW * page.scale
    right = left + max(panel_width, min(panel.caption_width, width))
    page.write(captions.names[number], left, row, points=TITLE, bold=True)
    page.write(captions.facts[number], right, row, color=page.theme.faint, align="right")


def _write_two_lines(page: FigurePage, captions: _Captions, number: int, panel: PagePanel) -> None:
    """Write the name of a run above its panel, and its facts below the name."""
    left, top, _, _ = panel.box
    name_row = top - _NAME_ROW * page.scale
    facts_row = top - _FACTS_ROW * page.scale
    max_width = panel.caption_width
    page.write(captions.names[number], left, name_row, points=TITLE, bold=True, max_width=max_width)
    page.write(captions.facts[number], left, facts_row, color=page.theme.faint, max_width=max_width)


@plain_style()
def plot_cost(
    curves: Sequence[TimeCurve],
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "Mean distance over time",
) -> Figure:
    """Plot mean distances against time, each curve labeled at its end with its name and final value.

    Parameters
    ----------
    curves : sequence of TimeCurve
    axes : matplotlib.axes.Axes, optional
        By default, new axes on a separate page.
    theme : Theme or str
    size : (width, height), px, optional
        Size of the page.
    title : str
        Title of the page.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ParameterError
        If there are no curves, or one has no finite value.
    """
    check_not_empty("curves", curves)
    for curve in curves:
        _check_curve(curve)
    theme = get_theme(theme)
    if axes is None:
        axes = _create_cost_page(curves, theme, size or (1000, 560), title)
    draw_curves(axes, curves, theme)
    return get_figure(axes)


def _check_curve(curve: TimeCurve) -> None:
    """Raise a ParameterError unless a curve has a value for each time, at least one of them finite."""
    if len(curve.times) != len(curve.values) or not np.isfinite(curve.values).any():
        finite = int(np.isfinite(curve.values).sum())
        raise ParameterError(
            f"curve {quote(curve.label)}: expected a value for each time, at least one of them finite, "
            f"got {len(curve.times)} times and {finite} finite values"
        )


def _create_cost_page(curves: Sequence[TimeCurve], theme: Theme, size: tuple[int, int], title: str) -> Axes:
    """Create a page with only curves, whose texts can be larger than on pages with maps."""
    width, height = size
    page = FigurePage(size, theme, float(np.clip(min(width / 800, height / 450), 0.8, 6.0)))
    left = _COST_MARGINS.left * page.scale
    title_row = 30 * page.scale
    page.write(title, left, title_row, points=TITLE, bold=True, max_width=width - left - page.margin)
    return add_curve_axes(page, curves, _COST_MARGINS)


def _create_map_page(
    environment: Environment,
    theme: Theme,
    size: tuple[int, int] | None,
    handles: Sequence[Artist],
    *,
    title: str,
    facts: str,
) -> "_MapPage":
    """Create a page with axes for one map, a title and facts above it, and space for the legend below."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    aspect = (high_x - low_x) / (high_y - low_y)
    if size is None:
        page = FigurePage(_choose_map_page_size(aspect, theme, handles), theme, _MAP_SCALE)
    else:
        page = FigurePage(size, theme)
    above = _MAP_HEAD * page.scale
    box = _place_map(page, aspect, above, page.measure_footer(handles))
    # Below a map that is narrower than the page, the footer may need more space.
    box = _place_map(page, aspect, above, page.measure_footer(handles, bar_left=box.left))
    _write_above_map(page, title, facts, box)
    axes = page.add_map_axes(box, low_x, low_y, high_x, high_y)
    return _MapPage(page=page, axes=axes, box=box, zoom=box.width / (high_x - low_x))


class _MapPage(NamedTuple):
    """A page with one map.

    Attributes
    ----------
    page : FigurePage
    axes : matplotlib.axes.Axes
        Axes of the map.
    box : PageBox
        Box of the map, px.
    zoom : float, px/m
        Scale at which the map is drawn.
    """

    page: FigurePage
    axes: Axes
    box: PageBox
    zoom: float

    def draw_footer(self, handles: Sequence[Artist]) -> None:
        """Draw the scale bar and a legend below the map."""
        self.page.draw_footer(handles, [self.box], self.zoom)


def _place_map(page: FigurePage, aspect: float, above: float, below: float) -> PageBox:
    """Return the largest box of an aspect ratio with space above and below it, in the middle, px."""
    free_height = page.size[1] - above - below
    width = min(page.content_width, free_height * aspect)
    height = width / aspect
    return PageBox((page.size[0] - width) / 2, above + (free_height - height) / 2, width, height)


def _choose_map_page_size(aspect: float, theme: Theme, handles: Sequence[Artist]) -> tuple[int, int]:
    """Return the width and height of a page that suits a map with an aspect, px."""
    # A page of the maximum width and any height serves to measure the footer.
    page = FigurePage((_MAX_MAP_PAGE_WIDTH_PX, 1000), theme, _MAP_SCALE)
    surroundings = _MAP_HEAD * page.scale + page.measure_footer(handles)
    widest = (_MAX_MAP_PAGE_HEIGHT_PX - surroundings) * aspect + 2 * page.margin
    width = float(np.clip(widest, _MIN_MAP_PAGE_WIDTH_PX, _MAX_MAP_PAGE_WIDTH_PX))
    highest = (width - 2 * page.margin) / aspect + surroundings
    height = float(np.clip(highest, _MIN_MAP_PAGE_HEIGHT_PX, _MAX_MAP_PAGE_HEIGHT_PX))
    return int(width), int(height)


def _write_above_map(page: FigurePage, title: str, facts: str, box: PageBox) -> None:
    """Write the title and the facts above a map; center them as a block if they are wider than the map."""
    title_width = page.measure_text(title, points=TITLE, bold=True)
    text_width = min(max(title_width, page.measure_text(facts)), page.content_width)
    left = box.left
    if text_width > box.width:
        left = max(box.left + (box.width - text_width) / 2, page.margin)
    max_width = page.content_width
    title_row = box.top - _NAME_ROW * page.scale
    facts_row = box.top - _FACTS_ROW * page.scale
    page.write(title, left, title_row, points=TITLE, bold=True, max_width=max_width)
    page.write(facts, left, facts_row, color=page.theme.faint, max_width=max_width)


def _join_facts(facts: Sequence[str]) -> str:
    """Join facts to one line; empty facts are left out."""
    return "  ·  ".join(fact for fact in facts if fact)


def _format_cost(record: Record, mean_distance: float | None, mean_time: float | None) -> str:
    """Return the cost of the final positions as text; an empty text if it is unknown."""
    if mean_distance is None:
        return ""
    return format_cost(get_cost_name(record.environment), mean_distance, mean_time)


def _format_time(record: Record) -> str:
    """Return the time at the end of a run as text."""
    return f"t = {record.time[-1]:.1f} s"


def _format_robots(record: Record) -> str:
    """Return the number of robots of a run as text."""
    return format_count(len(record.team), "robot")


@plain_style()
def plot_maps(environments: Sequence[Environment], theme: Theme | str = LIGHT) -> Figure:
    """Plot the first `MAX_MAPS` maps side by side at the same scale, each below its name.

    Parameters
    ----------
    environments : sequence of Environment
    theme : Theme or str

    Returns
    -------
    matplotlib.figure.Figure
    """
    theme = get_theme(theme)
    drawn = environments[:MAX_MAPS]
    title = ""
    if len(drawn) < len(environments):
        title = f"{len(drawn)} of {len(environments)}"
    bounds = np.array([environment.region.bounds for environment in drawn])
    map_width, map_height = (bounds[:, 2:] - bounds[:, :2]).max(axis=0).tolist()  # of the largest map
    aspect = map_width / map_height
    handles = _list_different_handles(drawn, theme)
    # A page of the maximum height serves to measure; its final height is chosen below.
    page = FigurePage((_SHEET_WIDTH_PX, _MAX_SHEET_HEIGHT_PX), theme, _SHEET_SCALE)
    scale = page.scale
    above = _SHEET_CAPTION_HEIGHT * scale
    top = (_SHEET_TOP_WITH_HEADING if title else _TOP_WITHOUT_HEADING) * scale
    columns = choose_column_count(len(drawn), aspect, _SHEET_SHAPE_PX, row_margin=above)
    slot = (_SHEET_WIDTH_PX - page.margin) / columns - page.margin
    rows = math.ceil(len(drawn) / columns)
    panels_height = rows * (above + slot * map_height / map_width + _PANEL_GAP * scale)
    height = int(
        np.clip(top + panels_height + page.measure_footer(handles), _MIN_HEIGHT_PX, _MAX_SHEET_HEIGHT_PX)
    )
    page = FigurePage((_SHEET_WIDTH_PX, height), theme, _SHEET_SCALE)
    arrange_panels = partial(
        page.arrange_panels,
        len(drawn),
        columns,
        aspect=aspect,
        caption_width=0.0,
        caption_height=above,
        top=top,
    )
    panels = arrange_panels(bottom=page.measure_footer(handles))
    # Below maps that are narrower than the page, the footer may need more space.
    panels = arrange_panels(bottom=page.measure_footer(handles, bar_left=panels[0].box.left))
    for environment, panel in zip(drawn, panels, strict=True):
        low_x, low_y, _, _ = environment.region.bounds
        axes = page.add_map_axes(panel.box, low_x, low_y, low_x + map_width, low_y + map_height)
        arena.draw_map(axes, environment, theme)
        name_row = panel.box.top - _SHEET_NAME_ROW * scale
        page.write(environment.name, panel.box.left, name_row, bold=True, max_width=panel.caption_width)
    first_box = panels[0].box
    _write_heading(page, title, first_box, above + _SHEET_HEADING_RISE * scale)
    page.draw_footer(handles, [panel.box for panel in panels], first_box.width / map_width)
    return page.figure


def _list_different_handles(environments: Sequence[Environment], theme: Theme) -> list[Artist]:
    """Return the legend entries of several maps, each once."""
    handles: dict[str, Artist] = {}
    for environment in environments:
        for handle in arena.build_map_handles(environment, theme):
            handles[arena.get_label(handle)] = handle
    return list(handles.values())


class MeasuredRun(NamedTuple):
    """A run with its metrics.

    Attributes
    ----------
    label : str
    controller : str
        Name of the controller, which decides the color.
    metrics : RunMetrics
    """

    label: str
    controller: str
    metrics: RunMetrics


class MetricPanel(NamedTuple):
    """A panel of `plot_metrics`.

    Attributes
    ----------
    label, unit : str
        Label of the value axis, and unit of the final values.
    get_values : callable
        Returns the plotted values of a run.
    """

    label: str
    unit: str
    get_values: Callable[[RunMetrics], FloatArray]


def to_free_area_percent(get_area: Callable[[RunMetrics], FloatArray]) -> Callable[[RunMetrics], FloatArray]:
    """Turn a function that returns areas into one that returns percentages of the free area."""
    return lambda metrics: np.asarray(100.0 * get_area(metrics) / metrics.free_area)


METRIC_PANELS = (
    MetricPanel(
        "sensed area (% of the free area)",
        "%",
        to_free_area_percent(lambda metrics: metrics.sensed_area),
    ),
    MetricPanel(
        "visible area (% of the free area)",
        "%",
        to_free_area_percent(lambda metrics: metrics.visible_area),
    ),
    MetricPanel("work ∫|F·v| dt (J)", "J", lambda metrics: metrics.work),
    MetricPanel("path length per robot (m)", "m", lambda metrics: metrics.path_length),
)


@plain_style()
def plot_metrics(runs: Sequence[MeasuredRun], theme: Theme | str, title: str) -> Figure:
    """Plot the metrics of runs against time in the panels of `METRIC_PANELS`.

    Parameters
    ----------
    runs : sequence of MeasuredRun
    theme : Theme or str
    title : str
        Title of the page.

    Returns
    -------
    matplotlib.figure.Figure
    """
    theme = get_theme(theme)
    page = FigurePage(_METRICS_SIZE_PX, theme)
    page.write_title(title, 26)
    curves_of_panels = [_build_metric_curves(runs, panel) for panel in METRIC_PANELS]
    # All panels have space for the widest label, so that their time axes have the same length.
    label_width = max(
        measure_end_labels(page, curves, panel.unit)
        for curves, panel in zip(curves_of_panels, METRIC_PANELS, strict=True)
    )
    for number, (curves, panel) in enumerate(zip(curves_of_panels, METRIC_PANELS, strict=True)):
        axes = _create_metric_axes(page, number, curves, label_width)
        maximum = max(float(np.nanmax(curve.values)) for curve in curves)
        value_axis = ValueAxis(panel.label, panel.unit, value_range=(0.0, maximum))
        draw_curves(axes, curves, theme, value_axis, weight=0.8)
    return page.figure


def _build_metric_curves(runs: Sequence[MeasuredRun], panel: MetricPanel) -> list[TimeCurve]:
    """Build the curves of a panel, one for each run."""
    return [
        TimeCurve(run.label, run.controller, run.metrics.time, panel.get_values(run.metrics)) for run in runs
    ]


def _create_metric_axes(
    page: FigurePage, number: int, curves: Sequence[TimeCurve], label_width: float
) -> Axes:
    """Create the axes of a panel in a grid of 2 x 2, with space for the labels of its curves."""
    page_width, page_height = page.size
    top = _METRIC_TITLE_HEIGHT * page.scale
    width = page_width / 2
    height = (page_height - top) / 2
    row, column = divmod(number, 2)
    box = PageBox(column * width, top + row * height, width, height)
    return add_curve_axes(page, curves, _METRIC_MARGINS, box=box, label_width=label_width)
