"""Figures of several runs side by side."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robocov.record import Record
from robocov.typing import FloatArray
from robocov_app.figures import map_drawing, run_drawing
from robocov_app.figures.contact_points import find_contact_points
from robocov_app.figures.extent import Extent, enclose_maps
from robocov_app.figures.files import plain_style
from robocov_app.figures.map_grid import (
    PAGE_SCALE,
    PAGE_WIDTH_PX,
    SPACE_WITHOUT_HEADING_PX,
    MapGrid,
    compute_column_width,
    write_heading,
)
from robocov_app.figures.page import TITLE_SIZE_PT, FigurePage, PagePanel
from robocov_app.figures.run_titles import (
    build_run_title,
    format_end_time,
    format_robot_count,
    format_run_cost,
    join_facts,
)
from robocov_app.look.hues import ColorScheme
from robocov_app.look.legend import merge_legends
from robocov_app.look.theme import LIGHT, Theme, get_theme
from robocov_app.render.panel_grid import choose_column_count

_MAX_PAGE_HEIGHT_PX = 1800
_INITIAL_PAGE_HEIGHT_PX = 1000
"""Height of the page on which texts are measured before its height is chosen."""
# Space above the panels at scale 1, px.
_ONE_LINE_CAPTION_PX = 30
_TWO_LINE_CAPTION_PX = 54
_CAPTION_GAP_PX = 16
# Rows of text above a panel at scale 1, px.
_NAME_ROW_PX = 38
_FACTS_ROW_PX = 16
_HEADING_RISE_PX = 20
"""Distance of the heading above the captions."""
_SPACE_WITH_HEADING_PX = 50


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

    def fit_in_one_line(self, width: float) -> bool:
        """Return whether each name fits next to its facts in lines of a width, px."""
        return self.max_joined_width <= width


@plain_style()
def plot_comparison(
    records: Sequence[Record],
    *,
    theme: Theme | str = LIGHT,
    colors: ColorScheme = "robots",
    size: tuple[int, int] | None = None,
    mean_distances: Sequence[float | None] | None = None,
    mean_times: Sequence[float | None] | None = None,
) -> Figure:
    """Plot runs side by side at the same scale.

    Parameters
    ----------
    records : sequence of Record
    theme : Theme or str
    colors : {"robots", "paper"}
        A hue for each robot, or the colors of the paper.
    size : (width, height), px, optional
    mean_distances, mean_times : sequence of float or None, optional
        Costs of the final positions, m and s, for the titles.

    Returns
    -------
    matplotlib.figure.Figure
    """
    contents = _Contents(
        records=records,
        contacts=[find_contact_points(record) for record in records],
        mean_distances=mean_distances,
        mean_times=mean_times,
        theme=get_theme(theme),
        colors=colors,
    )
    handles = contents.build_handles()
    figure, drawn_handles = _draw_page(contents, size, handles)
    if size is None and len(drawn_handles) < len(handles):
        # A legend with fewer entries may need less space.
        figure, _ = _draw_page(contents, size, drawn_handles)
    return figure


@dataclass(frozen=True, eq=False)
class _Contents:
    """Contents of a comparison figure.

    Attributes
    ----------
    records : sequence of Record
    contacts : list of (c, 2) array, m
        Points at which contacts of each run began.
    mean_distances, mean_times : sequence of float or None
        Costs of the final positions, m and s; None if they are unknown.
    theme : Theme
    colors : {"robots", "paper"}
    """

    records: Sequence[Record]
    contacts: list[FloatArray]
    mean_distances: Sequence[float | None] | None
    mean_times: Sequence[float | None] | None
    theme: Theme
    colors: ColorScheme

    def build_handles(self) -> list[Artist]:
        """Build the legend entries for all that the runs may contain."""
        legends = [
            run_drawing.build_run_handles(record, self.theme, self.colors, contacts=points)
            for record, points in zip(self.records, self.contacts, strict=True)
        ]
        return merge_legends(legends, map_drawing.get_label)


def _draw_page(
    contents: _Contents, size: tuple[int, int] | None, handles: list[Artist]
) -> tuple[Figure, list[Artist]]:
    """Draw a comparison with space for a legend; return the page, and the entries that the legend needs."""
    theme = contents.theme
    extent = enclose_maps(record.environment for record in contents.records)
    page = _create_page(size, theme)
    captions = _build_captions(page, contents)
    grid = _choose_grid(page, captions, extent.aspect)
    if size is None:
        height = grid.compute_page_height(page, handles, _MAX_PAGE_HEIGHT_PX)
        page = FigurePage((PAGE_WIDTH_PX, height), theme, PAGE_SCALE)
    panels = grid.arrange(page, handles)
    all_axes = []
    for record, points, panel in zip(contents.records, contents.contacts, panels, strict=True):
        axes = _add_panel_axes(page, panel, extent)
        run_drawing.draw_run(axes, record, theme, contents.colors, contacts=points)
        all_axes.append(axes)
    _write_captions(page, captions, panels, grid)
    drawn_handles = run_drawing.drop_undrawn_handles(handles, all_axes)
    boxes = [panel.box for panel in panels]
    if captions.fit_in_one_line(grid.caption_width):
        boxes = [panel.box._replace(width=max(panel.box.width, panel.caption_width)) for panel in panels]
    page.draw_footer(drawn_handles, boxes, panels[0].box.width / extent.width)
    return page.figure, drawn_handles


def _create_page(size: tuple[int, int] | None, theme: Theme) -> FigurePage:
    """Create a page of a size, px, or of default width, with a height that serves only to measure texts."""
    if size is None:
        return FigurePage((PAGE_WIDTH_PX, _INITIAL_PAGE_HEIGHT_PX), theme, PAGE_SCALE)
    return FigurePage(size, theme)


def _add_panel_axes(page: FigurePage, panel: PagePanel, extent: Extent) -> Axes:
    """Add axes for one of the maps with a common extent."""
    return page.add_map_axes(panel.box, extent.low_x, extent.low_y, extent.high_x, extent.high_y)


def _choose_grid(page: FigurePage, captions: _Captions, aspect: float) -> MapGrid:
    """Choose the grid of maps with a given aspect ratio; captions are on one line if they all fit."""
    top = SPACE_WITHOUT_HEADING_PX * page.scale
    if captions.shared:
        top = _SPACE_WITH_HEADING_PX * page.scale
    columns = _choose_columns(page, captions, aspect, top)
    caption_width = captions.max_width
    caption_height = _TWO_LINE_CAPTION_PX * page.scale
    if captions.fit_in_one_line(compute_column_width(page, columns)):
        caption_width = captions.max_joined_width
        caption_height = _ONE_LINE_CAPTION_PX * page.scale
    return MapGrid(
        count=len(captions.names),
        columns=columns,
        aspect=aspect,
        caption_width=caption_width,
        caption_height=caption_height,
        top=top,
    )


def _write_captions(
    page: FigurePage, captions: _Captions, panels: Sequence[PagePanel], grid: MapGrid
) -> None:
    """Write the name and the facts of each run above its panel, and the shared facts above all panels."""
    for number, panel in enumerate(panels):
        if captions.fit_in_one_line(grid.caption_width):
            _write_one_line(page, captions, number, panel, grid.caption_width)
        else:
            _write_two_lines(page, captions, number, panel)
    write_heading(page, captions.shared, panels[0].box, grid.caption_height + _HEADING_RISE_PX * page.scale)


def _build_captions(page: FigurePage, contents: _Contents) -> _Captions:
    """Build the captions; facts that all runs have in common are only in the heading of the page."""
    records = contents.records
    unknown = [None] * len(records)
    costs = [
        format_run_cost(record, distance, time)
        for record, distance, time in zip(
            records, contents.mean_distances or unknown, contents.mean_times or unknown, strict=True
        )
    ]
    facts = [
        (record.environment.name, format_robot_count(record), format_end_time(record)) for record in records
    ]
    is_shared = [len(set(column)) == 1 for column in zip(*facts, strict=True)]
    shared = [fact for fact, is_same in zip(facts[0], is_shared, strict=True) if is_same]
    different_facts = []
    for cost, row in zip(costs, facts, strict=True):
        different = [fact for fact, is_same in zip(row, is_shared, strict=True) if not is_same]
        different_facts.append(join_facts([cost, *different]))
    names = [build_run_title(record) for record in records]
    return _Captions(
        shared=join_facts(shared),
        names=names,
        facts=different_facts,
        name_widths=[page.measure_text(name, points=TITLE_SIZE_PT, bold=True) for name in names],
        facts_widths=[page.measure_text(text) for text in different_facts],
        gap=_CAPTION_GAP_PX * page.scale,
    )


def _choose_columns(page: FigurePage, captions: _Captions, aspect: float, top: float) -> int:
    """Return the number of columns for which panels are as large as possible and captions still fit."""
    space = (page.size[0], page.size[1] - 2 * top)
    best = choose_column_count(
        len(captions.names), aspect, space, row_margin=_TWO_LINE_CAPTION_PX * page.scale
    )
    max_columns = int((page.size[0] - page.margin) / (captions.max_width + page.margin))
    return max(min(best, max_columns), 1)


def _write_one_line(
    page: FigurePage, captions: _Captions, number: int, panel: PagePanel, width: float
) -> None:
    """Write the name of a run above its panel on the left, and its facts on the right."""
    left, top, panel_width, _ = panel.box
    row = top - _FACTS_ROW_PX * page.scale
    right = left + max(panel_width, min(panel.caption_width, width))
    page.write(captions.names[number], left, row, points=TITLE_SIZE_PT, bold=True)
    page.write(captions.facts[number], right, row, color=page.theme.faint, align="right")


def _write_two_lines(page: FigurePage, captions: _Captions, number: int, panel: PagePanel) -> None:
    """Write the name of a run above its panel, and its facts below the name."""
    left, top, _, _ = panel.box
    name_row = top - _NAME_ROW_PX * page.scale
    facts_row = top - _FACTS_ROW_PX * page.scale
    max_width = panel.caption_width
    page.write(captions.names[number], left, name_row, points=TITLE_SIZE_PT, bold=True, max_width=max_width)
    page.write(captions.facts[number], left, facts_row, color=page.theme.faint, max_width=max_width)
