"""Figures with one map: a map alone, or a run with its trajectories."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov.environment import Environment
from robocov.errors import ParameterError, format_area, quote
from robocov.record import Record
from robocov_app.figures import map_drawing, run_drawing
from robocov_app.figures.contact_points import find_contact_points
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import TITLE_SIZE_PT, FigurePage, PageBox, get_figure
from robocov_app.figures.run_titles import (
    build_run_title,
    format_end_time,
    format_robot_count,
    format_run_cost,
    join_facts,
)
from robocov_app.look.hues import ColorScheme
from robocov_app.look.theme import LIGHT, Theme, get_theme

_MAP_SCALE = 1.3
"""Scale of texts and lines on a page of default width, on which the legend fits next to the scale bar."""
# Size of a page, px.
_MIN_PAGE_WIDTH_PX = 840
_MAX_PAGE_WIDTH_PX = 1400
_MIN_PAGE_HEIGHT_PX = 300
_MAX_PAGE_HEIGHT_PX = 1300
# Space above the map and the rows of text in it at scale 1, px.
_SPACE_ABOVE_PX = 58
_NAME_ROW_PX = 38
_FACTS_ROW_PX = 16


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
        facts = (
            f"{format_area(environment.area)} inside the boundary, {format_area(environment.free_area)} free"
        )
        handles = map_drawing.build_map_handles(environment, theme)
        map_page = _create_map_page(environment, theme, size, handles, title=environment.name, facts=facts)
        map_drawing.draw_map(map_page.axes, environment, theme)
        map_page.draw_footer(handles)
        return map_page.page.figure
    map_drawing.set_meter_axes(axes, environment, theme)
    map_drawing.draw_map(axes, environment, theme)
    return get_figure(axes)


@plain_style()
def plot_trajectories(
    record: Record,
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    colors: ColorScheme = "robots",
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
    colors : {"robots", "paper"}
        A hue for each robot, or the colors of the paper.
    size : (width, height), px, optional
        Size of the page.
    mean_distance, mean_time : float, optional
        Costs of the final positions, m and s, for the title.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ParameterError
        If `colors` is neither of these.
    """
    if colors not in ("paper", "robots"):
        raise ParameterError(f"colors: expected 'paper' or 'robots', got {quote(colors)}")
    theme = get_theme(theme)
    contacts = find_contact_points(record)
    if axes is None:
        title = join_facts([build_run_title(record), record.environment.name])
        facts = join_facts(
            [
                format_run_cost(record, mean_distance, mean_time),
                format_end_time(record),
                format_robot_count(record),
            ]
        )
        handles = run_drawing.build_run_handles(record, theme, colors, contacts=contacts)
        map_page = _create_map_page(record.environment, theme, size, handles, title=title, facts=facts)
        run_drawing.draw_run(map_page.axes, record, theme, colors, contacts=contacts)
        map_page.draw_footer(run_drawing.drop_undrawn_handles(handles, [map_page.axes]))
        return map_page.page.figure
    map_drawing.set_meter_axes(axes, record.environment, theme)
    run_drawing.draw_run(axes, record, theme, colors, contacts=contacts)
    return get_figure(axes)


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
    above = _SPACE_ABOVE_PX * page.scale
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
    page = FigurePage((_MAX_PAGE_WIDTH_PX, 1000), theme, _MAP_SCALE)
    surroundings = _SPACE_ABOVE_PX * page.scale + page.measure_footer(handles)
    widest = (_MAX_PAGE_HEIGHT_PX - surroundings) * aspect + 2 * page.margin
    width = float(np.clip(widest, _MIN_PAGE_WIDTH_PX, _MAX_PAGE_WIDTH_PX))
    highest = (width - 2 * page.margin) / aspect + surroundings
    height = float(np.clip(highest, _MIN_PAGE_HEIGHT_PX, _MAX_PAGE_HEIGHT_PX))
    return int(width), int(height)


def _write_above_map(page: FigurePage, title: str, facts: str, box: PageBox) -> None:
    """Write the title and the facts above a map; center them as a block if they are wider than the map."""
    title_width = page.measure_text(title, points=TITLE_SIZE_PT, bold=True)
    text_width = min(max(title_width, page.measure_text(facts)), page.content_width)
    left = box.left
    if text_width > box.width:
        left = max(box.left + (box.width - text_width) / 2, page.margin)
    max_width = page.content_width
    title_row = box.top - _NAME_ROW_PX * page.scale
    facts_row = box.top - _FACTS_ROW_PX * page.scale
    page.write(title, left, title_row, points=TITLE_SIZE_PT, bold=True, max_width=max_width)
    page.write(facts, left, facts_row, color=page.theme.faint, max_width=max_width)
