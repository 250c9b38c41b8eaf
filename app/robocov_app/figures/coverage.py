"""A page about the coverage cost: its curves, and maps of the distance to the nearest robot."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray

from robocov.environment import Environment
from robocov.record import Record
from robocov.team import Team
from robocov.typing import FloatArray, IntArray
from robocov_app.figures import map_drawing, robot_drawing
from robocov_app.figures.cost_curves import plot_cost
from robocov_app.figures.coverage_layout import (
    BAR_INDENT_PX,
    BAR_WIDTH_PX,
    CAPTION_TITLE_SIZE_PT,
    CURVE_MARGINS,
    CoverageArrangement,
    CoverageContents,
    create_coverage_page,
)
from robocov_app.figures.curves import (
    DISTANCE,
    TIME,
    WEIGHTED_DISTANCE,
    TimeCurve,
    add_curve_axes,
    draw_curves,
)
from robocov_app.figures.extent import Extent, enclose_maps
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import (
    SMALL_SIZE_PT,
    FigurePage,
    PageBox,
    PagePanel,
    ValueAxis,
    check_not_empty,
    require_page_size,
    to_plot_color,
)
from robocov_app.figures.run_titles import build_run_title
from robocov_app.look import legend
from robocov_app.look.theme import LIGHT, Theme, get_theme
from robocov_app.render.density_text import describe_density, format_cost, get_cost_name
from robocov_app.render.distance_map.colors import (
    build_palette,
    choose_color_limit,
    compute_color_levels,
    compute_line_opacities,
    list_color_ticks,
)
from robocov_app.render.distance_map.pixel_distances import DistanceField

IMAGE_PIXELS_PER_PAGE_PIXEL = 2
"""Resolution of the images of maps, relative to that of the page."""
MIN_SIZE_PX = (720, 400)
"""Minimum size of a page with curves and maps; a smaller page shows only the curves."""
_MIN_ASPECT_SIDE_BY_SIDE = 2.4
"""Minimum width / height of a box in which mean distances and mean times are next to each other."""
_HATCH_PX = 9
"""Distance between the lines that hatch areas that no robot can reach."""
_BORDER_WIDTH_PX = 1.4
_BAR_LABEL = "distance to the nearest robot"
# Heights at scale 1, px.
_TITLE_ROW_PX = 26
_CAPTION_TITLE_ROW_PX = 35
_CAPTION_FACTS_ROW_PX = 14
"""Distances of the rows of a caption above its map."""
_BAR_HEIGHT_PX = 10
_BAR_RISE_PX = 9
"""Distance of the top of the color scale above the middle of its row; the ticks are below."""
_BAR_LABEL_GAP_PX = 12
_BAR_LABEL_RISE_PX = 4
"""Distance of the label above the middle of the row, at the height of the color scale."""


@dataclass(frozen=True, eq=False)
class DistanceSnapshot:
    """A team at one time of a run, with the distance map.

    Attributes
    ----------
    environment : Environment
    team : Team
    field : DistanceField
        Distances to the nearest robot.
    title, facts : str
        Lines above the map.
    numbers : tuple of int or None
        Numbers of the robots; by default 1, 2, 3, ...
    time : float, s
    """

    environment: Environment
    team: Team
    field: DistanceField
    title: str = ""
    facts: str = ""
    numbers: tuple[int, ...] | None = None
    time: float = 0.0

    @classmethod
    def build_final(
        cls,
        record: Record,
        field: DistanceField,
        mean_distance: float,
        counted: IntArray | None = None,
        mean_time: float | None = None,
    ) -> "DistanceSnapshot":
        """Build the snapshot of the final positions of a run.

        Parameters
        ----------
        record : Record
        field : DistanceField
            Distances at the end.
        mean_distance : float, m
        counted : int array, optional
            Rows of the robots that the cost takes into account; by default all.
        mean_time : float, s, optional
            Mean time until the first robot arrives, if robots differ in speed.

        Returns
        -------
        DistanceSnapshot
        """
        cost = format_cost(get_cost_name(record.environment), mean_distance, mean_time)
        # Captions above three maps side by side have little space.
        cost = cost.replace(", mean time", ", time")
        time = float(record.time[-1])
        if counted is None:
            counted = np.arange(len(record.team))
        return cls(
            environment=record.environment,
            team=record.team[counted],
            field=field,
            title=build_run_title(record),
            facts=f"{cost} after {time:.1f} s".lstrip(),
            numbers=tuple((counted + 1).tolist()),
            time=time,
        )


@plain_style()
def plot_coverage(
    curves: Sequence[TimeCurve],
    snapshots: Sequence[DistanceSnapshot],
    *,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "Coverage",
    times: Sequence[TimeCurve] = (),
) -> Figure:
    """Plot cost curves, and maps of the distance to the nearest robot with a common color scale.

    Parameters
    ----------
    curves : sequence of TimeCurve
        Mean distances, m; may be empty.
    snapshots : sequence of DistanceSnapshot
    theme : Theme or str
    size : (width, height), px, optional
        Size of the page; by default chosen to fit the maps. If it is smaller than `MIN_SIZE_PX` and there
        are curves, the page shows only these.
    title : str
    times : sequence of TimeCurve
        Mean times, s, if robots differ in speed.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ParameterError
        If there are no snapshots, or the size is not that of a figure.
    """
    check_not_empty("snapshots", snapshots)
    if size is not None:
        require_page_size(size)
    if curves and size is not None and (size[0] < MIN_SIZE_PX[0] or size[1] < MIN_SIZE_PX[1]):
        return plot_cost(curves, theme=theme, size=size, title=title)
    theme = get_theme(theme)
    extent = enclose_maps(snapshot.environment for snapshot in snapshots)
    limit = _choose_limit(snapshots)
    handles = _build_handles(snapshots, theme)
    contents = CoverageContents(
        title=title,
        captions=[(snapshot.title, snapshot.facts) for snapshot in snapshots],
        aspect=extent.aspect,
        end_curves=times or curves,
        handles=handles,
    )
    page, arrangement = create_coverage_page(contents, theme, size)
    bar_left = _draw_bar(page, limit, arrangement)
    title_end: float = page.size[0]
    if not arrangement.is_below:
        title_end = bar_left
    page.write_title(title, _TITLE_ROW_PX, title_end - 2 * page.margin)
    if curves:
        distance_label = DISTANCE
        if any(describe_density(snapshot.environment) for snapshot in snapshots):
            distance_label = WEIGHTED_DISTANCE
        _draw_curves(page, curves, times, arrangement.curves, distance_label)
    _draw_maps(page, snapshots, extent, limit, arrangement.panels)
    boxes = [panel.box for panel in arrangement.panels]
    pixels_per_meter = boxes[0].width / extent.width
    page.draw_footer(handles, boxes, pixels_per_meter, arrangement.footer_left)
    return page.figure


@plain_style()
def plot_distances(snapshot: DistanceSnapshot, axes: Axes, theme: Theme | str = LIGHT) -> None:
    """Plot the distance map on axes of a notebook, with ticks in meters and a color scale.

    Parameters
    ----------
    snapshot : DistanceSnapshot
    axes : matplotlib.axes.Axes
    theme : Theme or str
    """
    theme = get_theme(theme)
    limit = _choose_limit([snapshot])
    map_drawing.set_meter_axes(axes, snapshot.environment, theme)
    axes.apply_aspect()
    extent = axes.get_window_extent()
    # As on pages, texts and lines have scale 1 at 100 dots per inch.
    scale = axes.figure.dpi / 100
    # The image is at least as fine as on the smallest page, because small axes may be saved at a larger size.
    enlargement = max(MIN_SIZE_PX[0] / extent.width, 1.0)
    box = PageBox(0.0, 0.0, enlargement * extent.width, enlargement * extent.height)
    _draw_snapshot(axes, snapshot, limit, theme, box=box, scale=enlargement * scale)
    axes.set_aspect("equal")
    bar = axes.inset_axes((1.03, 0.0, 0.035, 1.0))
    heat = theme.build_heat_table(256)[:, None]
    bar.imshow(heat, origin="lower", aspect="auto", extent=(0.0, 1.0, 0.0, limit))
    bar.set(xticks=[], yticks=list_color_ticks(limit), ylabel=f"{_BAR_LABEL} (m)")
    bar.yaxis.tick_right()
    bar.yaxis.set_label_position("right")


def _choose_limit(snapshots: Sequence[DistanceSnapshot]) -> float:
    """Return the end of the color scale that all snapshots share, m."""
    finite = [
        snapshot.field.max_distance for snapshot in snapshots if np.isfinite(snapshot.field.max_distance)
    ]
    return choose_color_limit(max(finite, default=1.0))


def _build_handles(snapshots: Sequence[DistanceSnapshot], theme: Theme) -> list[Artist]:
    """Build the legend entries of all snapshots, each once."""
    border = Line2D(
        [], [], color=to_plot_color(theme.geodesic_border), linewidth=1.6, label=legend.GEODESIC_BORDER
    )
    handles: list[Artist] = [robot_drawing.build_robot_handle(legend.ROBOT, theme.final, theme), border]
    legends = [
        map_drawing.build_map_handles(snapshot.environment, theme, show_boundary=False, show_density=False)
        for snapshot in snapshots
    ]
    for handle in legend.merge_legends(legends, map_drawing.get_label):
        if map_drawing.get_label(handle) == legend.UNKNOWN_OBSTACLE:
            handle.set_label(legend.OBSTACLE)
        handles.append(handle)
    if any((snapshot.field.result.owners < 0).any() for snapshot in snapshots):
        unreached = Patch(
            facecolor=to_plot_color(theme.unreached),
            edgecolor=to_plot_color(theme.obstacle_edge),
            hatch="////",
            linewidth=0.0,
            label=legend.UNREACHED,
        )
        handles.append(unreached)
    return handles


def _draw_curves(
    page: FigurePage,
    curves: Sequence[TimeCurve],
    times: Sequence[TimeCurve],
    box: PageBox,
    distance_label: str,
) -> None:
    """Draw the mean distances and any mean times, stacked or, in a wide box, side by side."""
    left, top, width, height = box
    if not times:
        _draw_curve_panel(page, curves, box, distance_label, "m")
        return
    if width > _MIN_ASPECT_SIDE_BY_SIDE * height:
        distances_box = PageBox(left, top, width / 2, height)
        times_box = PageBox(left + width / 2, top, width / 2, height)
    else:
        distances_box = PageBox(left, top, width, height / 2)
        times_box = PageBox(left, top + height / 2, width, height / 2)
    _draw_curve_panel(page, curves, distances_box, distance_label, "m")
    _draw_curve_panel(page, times, times_box, TIME, "s")


def _draw_curve_panel(
    page: FigurePage, curves: Sequence[TimeCurve], box: PageBox, label: str, unit: str
) -> None:
    """Draw curves in a box, px, that leaves space for axis labels and for end labels."""
    axes = add_curve_axes(page, curves, CURVE_MARGINS, box=box, unit=unit)
    draw_curves(axes, curves, page.theme, ValueAxis(label, unit))


def _draw_maps(
    page: FigurePage,
    snapshots: Sequence[DistanceSnapshot],
    extent: Extent,
    limit: float,
    panels: Sequence[PagePanel],
) -> None:
    """Draw the map of each snapshot in its panel, below its title."""
    scale = page.scale
    for snapshot, panel in zip(snapshots, panels, strict=True):
        box = panel.box
        max_width = panel.caption_width
        axes = page.add_map_axes(box, extent.low_x, extent.low_y, extent.high_x, extent.high_y)
        _draw_snapshot(axes, snapshot, limit, page.theme, box=box, scale=scale)
        title_row = box.top - _CAPTION_TITLE_ROW_PX * scale
        facts_row = box.top - _CAPTION_FACTS_ROW_PX * scale
        page.write(
            snapshot.title, box.left, title_row, points=CAPTION_TITLE_SIZE_PT, bold=True, max_width=max_width
        )
        page.write(snapshot.facts, box.left, facts_row, color=page.theme.faint, max_width=max_width)


def _draw_snapshot(
    axes: Axes, snapshot: DistanceSnapshot, limit: float, theme: Theme, *, box: PageBox, scale: float
) -> None:
    """Draw distances, the borders of geodesic cells, the map and the robots in axes that fill a box, px."""
    low_x, high_x = axes.get_xlim()
    low_y, high_y = axes.get_ylim()
    x, y = _compute_pixel_centers(axes, box)
    pixels = _paint_distances(
        snapshot.field,
        x,
        y,
        limit,
        theme,
        image_pixels_per_meter=IMAGE_PIXELS_PER_PAGE_PIXEL * box.width / (high_x - low_x),
        border_width=_BORDER_WIDTH_PX * scale,
    )
    image = axes.imshow(
        pixels,
        extent=(low_x, high_x, low_y, high_y),
        aspect="auto",
        interpolation="antialiased",
        zorder=0,
    )
    image.set_clip_path(Polygon(snapshot.environment.region.vertices, transform=axes.transData))
    map_drawing.draw_map(axes, snapshot.environment, theme, show_density=False, time=snapshot.time)
    positions = snapshot.field.result.positions
    numbers = snapshot.numbers or range(1, len(positions) + 1)
    robot_drawing.draw_robots(axes, positions, snapshot.team.radius, numbers, theme)


def _compute_pixel_centers(axes: Axes, box: PageBox) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates of the pixel centers of an image that fills the axes; `box` is their size, px.

    Returns
    -------
    x : (columns,) array, m
        From left to right.
    y : (rows,) array, m
        From top to bottom.
    """
    low_x, high_x = axes.get_xlim()
    low_y, high_y = axes.get_ylim()
    # At least two, because borders are measured in distances between adjacent pixels.
    columns = max(round(IMAGE_PIXELS_PER_PAGE_PIXEL * box.width), 2)
    rows = max(round(IMAGE_PIXELS_PER_PAGE_PIXEL * box.height), 2)
    x = low_x + (np.arange(columns) + 0.5) * (high_x - low_x) / columns
    y = high_y - (np.arange(rows) + 0.5) * (high_y - low_y) / rows
    return x, y


def _paint_distances(
    field: DistanceField,
    x: FloatArray,
    y: FloatArray,
    limit: float,
    theme: Theme,
    *,
    image_pixels_per_meter: float,
    border_width: float,
) -> NDArray[np.uint8]:
    """Return the RGB image of distances and borders, (h, w, 3).

    Parameters
    ----------
    field : DistanceField
    x : (w,) array, m
    y : (h,) array, m
    limit : float, m
        End of the color scale.
    theme : Theme
    image_pixels_per_meter : float
    border_width : float, px
    """
    levels = compute_color_levels(field, x, y, limit, IMAGE_PIXELS_PER_PAGE_PIXEL * _HATCH_PX)
    pixels = build_palette(theme)[levels]
    width = IMAGE_PIXELS_PER_PAGE_PIXEL * border_width
    borders = field.compute_borders(x, y, width / image_pixels_per_meter)
    opacity = compute_line_opacities(borders, image_pixels_per_meter, width)[:, None]
    border_pixels = (borders.rows, borders.columns)
    border_color = np.array(theme.geodesic_border)
    pixels[border_pixels] = np.rint((1.0 - opacity) * pixels[border_pixels] + opacity * border_color)
    return pixels


def _draw_bar(page: FigurePage, limit: float, arrangement: CoverageArrangement) -> float:
    """Draw the color scale above the maps, at the right, with a label if there is enough space.

    Parameters
    ----------
    page : FigurePage
    limit : float, m
        End of the scale.
    arrangement : CoverageArrangement

    Returns
    -------
    float
        Left end of the scale and its label, px.
    """
    middle = arrangement.bar_row
    theme = page.theme
    scale = page.scale
    right = arrangement.maps.right - BAR_INDENT_PX * scale
    width = BAR_WIDTH_PX * scale
    box = PageBox(right - width, middle - _BAR_RISE_PX * scale, width, _BAR_HEIGHT_PX * scale)
    axes = page.add_axes(box)
    axes.imshow(theme.build_heat_table(256)[None], aspect="auto", extent=(0.0, limit, 0.0, 1.0))
    for spine in axes.spines.values():
        spine.set(edgecolor=to_plot_color(theme.faint), linewidth=0.6)
    marks = list_color_ticks(limit)
    labels = [f"{mark:g}" for mark in marks]
    labels[-1] += " m"
    axes.set_xticks(marks, labels, fontsize=SMALL_SIZE_PT)
    axes.set_yticks([])
    axes.tick_params(
        colors=to_plot_color(theme.faint), labelcolor=to_plot_color(theme.ink), length=2.5, pad=1.5
    )
    left = right - width - _BAR_LABEL_GAP_PX * scale
    label_width = page.measure_text(_BAR_LABEL)
    if left - label_width <= arrangement.bar_min_left:
        return left
    page.write(_BAR_LABEL, left, middle - _BAR_LABEL_RISE_PX * scale, align="right")
    return left - label_width
