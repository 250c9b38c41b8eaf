"""Sheets of several maps, for an overview."""

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from robocov.environment import Environment
from robocov_app.figures import map_drawing
from robocov_app.figures.files import plain_style
from robocov_app.figures.map_grid import (
    PAGE_SCALE,
    PAGE_WIDTH_PX,
    SPACE_WITHOUT_HEADING_PX,
    MapGrid,
    write_heading,
)
from robocov_app.figures.page import FigurePage, PagePanel
from robocov_app.look.legend import merge_legends
from robocov_app.look.theme import LIGHT, Theme, get_theme
from robocov_app.render.panel_grid import choose_column_count

MAX_MAPS = 60
"""Maximum number of maps on a sheet; more would be too small to recognize."""
_MAX_PAGE_HEIGHT_PX = 1600
_MAPS_AREA_PX = (1600, 1200)
"""Width and height of the area that the maps of a sheet should approximately fill."""
# Rows of text at scale 1, px.
_CAPTION_HEIGHT_PX = 26
_NAME_ROW_PX = 12
_HEADING_RISE_PX = 18
_SPACE_WITH_HEADING_PX = 46


@plain_style()
def plot_maps(environments: Sequence[Environment], theme: Theme | str = LIGHT) -> Figure:
    """Plot the first `MAX_MAPS` maps side by side at the same scale, each below its name.

    Parameters
    ----------
    environments : sequence of Environment
        At least one.
    theme : Theme or str

    Returns
    -------
    matplotlib.figure.Figure
    """
    theme = get_theme(theme)
    drawn = environments[:MAX_MAPS]
    heading = ""
    if len(drawn) < len(environments):
        heading = f"{len(drawn)} of {len(environments)}"
    map_size = _compute_largest_size(drawn)
    handles = _list_handles(drawn, theme)
    grid = _choose_grid(len(drawn), map_size, has_heading=bool(heading))
    # A page of the maximum height serves to measure the legend.
    page = FigurePage((PAGE_WIDTH_PX, _MAX_PAGE_HEIGHT_PX), theme, PAGE_SCALE)
    height = grid.compute_page_height(page, handles, _MAX_PAGE_HEIGHT_PX)
    page = FigurePage((PAGE_WIDTH_PX, height), theme, PAGE_SCALE)
    panels = grid.arrange(page, handles)
    for environment, panel in zip(drawn, panels, strict=True):
        _draw_panel(page, panel, environment, map_size)
    first_box = panels[0].box
    write_heading(page, heading, first_box, grid.caption_height + _HEADING_RISE_PX * page.scale)
    map_width, _ = map_size
    page.draw_footer(handles, [panel.box for panel in panels], first_box.width / map_width)
    return page.figure


def _compute_largest_size(environments: Sequence[Environment]) -> tuple[float, float]:
    """Return the largest width and the largest height of several maps, m."""
    bounds = np.array([environment.region.bounds for environment in environments])
    width, height = (bounds[:, 2:] - bounds[:, :2]).max(axis=0).tolist()
    return width, height


def _list_handles(environments: Sequence[Environment], theme: Theme) -> list[Artist]:
    """Return the legend entries of several maps, each once."""
    legends = [map_drawing.build_map_handles(environment, theme) for environment in environments]
    return merge_legends(legends, map_drawing.get_label)


def _choose_grid(count: int, map_size: tuple[float, float], *, has_heading: bool) -> MapGrid:
    """Choose the grid for a number of maps of a size, m, on a page of default width."""
    map_width, map_height = map_size
    aspect = map_width / map_height
    caption_height = _CAPTION_HEIGHT_PX * PAGE_SCALE
    top = _SPACE_WITH_HEADING_PX if has_heading else SPACE_WITHOUT_HEADING_PX
    return MapGrid(
        count=count,
        columns=choose_column_count(count, aspect, _MAPS_AREA_PX, row_margin=caption_height),
        aspect=aspect,
        caption_width=0.0,
        caption_height=caption_height,
        top=top * PAGE_SCALE,
    )


def _draw_panel(
    page: FigurePage, panel: PagePanel, environment: Environment, map_size: tuple[float, float]
) -> None:
    """Draw a map in the lower left corner of a panel for maps of a size, m, and its name above it."""
    low_x, low_y, _, _ = environment.region.bounds
    map_width, map_height = map_size
    axes = page.add_map_axes(panel.box, low_x, low_y, low_x + map_width, low_y + map_height)
    map_drawing.draw_map(axes, environment, page.theme)
    name_row = panel.box.top - _NAME_ROW_PX * page.scale
    page.write(environment.name, panel.box.left, name_row, bold=True, max_width=panel.caption_width)
