"""The figure of an import: the map as read and as imported, with the differences marked."""

from pathlib import Path

import numpy as np
import shapely
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.patheffects import withStroke
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from robocov.environment import Environment, Gap
from robocov_app.figures.files import check_figure_path, plain_style, save_figure
from robocov_app.figures.map_drawing import build_map_handles, draw_map
from robocov_app.figures.page import HEADING_SIZE_PT, SMALL_SIZE_PT, TITLE_SIZE_PT, FigurePage, to_plot_color
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.conversion.comparison import ImportComparison, compare_maps
from robocov_app.formats.preview.layout import (
    LINE_HEIGHT_PX,
    Caption,
    ImportPage,
    lay_out_page,
    measure_caption_indent,
)
from robocov_app.formats.reports import ImportReport
from robocov_app.look.colors import Color
from robocov_app.look.theme import LIGHT, Theme, get_theme

_MARK_OPACITY = 0.55
_EDGE_WIDTH_PT = 0.8
_BOUNDARY_WIDTH_PT = 1.6
"""As wide as the boundary of the map as imported, which `draw_map` draws."""
_AREA_ORDER = 2
"""Drawing order of areas: above the ground."""
_MARK_ORDER = 5
"""Drawing order of positions and of the narrowest passage: above everything else."""
_TITLE_Y_PX = 24
_SUBTITLE_Y_PX = 44
"""Baselines of the title and of the line below it, from the top of the page at scale 1."""
_CAPTION_OFFSET_PX = 14
"""Distance of a caption from the arena below it, at scale 1."""
_LAST_LINE_OFFSET_PX = 16
"""Distance of the last line from the bottom of the page, at scale 1."""
_POSITION_MARK_PT = 8.0
_POSITION_TEXT_OFFSET_PT = 6
_TEXT_HALO_PT = 3.0
_PASSAGE_WIDTH_PT = 2.0
_PASSAGE_HALO_PT = 4.2
_PASSAGE_RING_WIDTH_PT = 1.8
_PASSAGE_RING_PT = 20.0
"""Diameter of the ring around the narrowest passage if it is too small to be seen."""
_MIN_GROUPED_NUMBER = 9999.5
"""Numbers from this one on are written without decimals, with thin spaces between groups of digits."""
_THIN_SPACE = "\u202f"
FORMAT_LABELS = {
    "argos": "ARGoS",
    "coverage-control": "CoverageControl",
    "dxf": "DXF",
    "geojson": "GeoJSON",
    "houseexpo": "HouseExpo",
    "image": "an image",
    "imdf": "IMDF",
    "irsim": "IR-SIM",
    "movingai": "Moving AI",
    "osm": "OpenStreetMap",
    "rings": "lists of rings",
    "ros": "ROS",
    "stage": "Stage",
    "svg": "SVG",
    "tmx": "Tiled",
    "wkt": "well-known text",
}
"""Names of formats in figures, by their names in commands."""


def save_preview(foreign: ForeignMap, environment: Environment, report: ImportReport, path: Path) -> None:
    """Save the figure of an import.

    Parameters
    ----------
    foreign, environment, report
        See `plot_import`.
    path : Path
        File with the suffix .png, .svg or .pdf.

    Raises
    ------
    ParameterError
        If the path has another suffix.
    OutputError
        If the file cannot be written.
    """
    check_figure_path(path)
    save_figure(plot_import(foreign, environment, report), path)


def plot_import(
    foreign: ForeignMap, environment: Environment, report: ImportReport, *, theme: Theme | str = LIGHT
) -> Figure:
    """Plot a map as read and as imported, at the same scale, above the lines of the import report.

    The figure marks free space that is no longer in the map, solid areas that became free, and the narrowest
    passage.

    Parameters
    ----------
    foreign : ForeignMap
        The map as read.
    environment : Environment
        The map as imported.
    report : ImportReport
    theme : Theme or str
    """
    theme = get_theme(theme)
    comparison = compare_maps(foreign, environment, report)
    low_x, low_y, high_x, high_y = comparison.bounds
    aspect = (high_x - low_x) / (high_y - low_y)
    free_before = _format_number(comparison.before.area)
    free_after = _format_number(comparison.after.area)
    captions = (
        Caption("as read", f"{_format_number(report.vertices_read)} vertices, {free_before} m² free"),
        Caption("as imported", f"{_format_number(report.vertices_kept)} vertices, {free_after} m² free"),
    )
    with plain_style():
        handles = _build_handles(environment, theme, comparison)
        # The facts of the report are in the title and the captions.
        layout = lay_out_page(theme, aspect, captions, handles, report.format_remarks())
        _write_title(layout, environment, report)
        for panel, caption in zip(layout.panels, captions, strict=True):
            _write_caption(layout.page, caption, panel.box.left, panel.box.top, panel.caption_width)
        boxes = [panel.box for panel in layout.panels]
        before = layout.page.add_map_axes(boxes[0], *comparison.bounds)
        after = layout.page.add_map_axes(boxes[1], *comparison.bounds)
        _draw_before(before, comparison, report, theme)
        draw_map(after, environment, theme)
        _draw_area(after, comparison.opened, theme.start, theme.start, _MARK_OPACITY)
        if comparison.gap is not None:
            _draw_gap(after, comparison.gap, theme)
        zoom = boxes[0].width / (high_x - low_x)
        layout.page.draw_footer(handles, boxes, zoom)
        _write_lines(layout)
        return layout.page.figure


def _get_left(layout: ImportPage) -> float:
    """Return the left edge of the arenas, px."""
    return min(panel.box.left for panel in layout.panels)


def _write_title(layout: ImportPage, environment: Environment, report: ImportReport) -> None:
    """Write the name of the map, and below it its size and the format of the file."""
    page = layout.page
    left = _get_left(layout)
    max_width = page.size[0] - left - page.margin
    page.write(
        environment.name,
        left,
        _TITLE_Y_PX * page.scale,
        points=HEADING_SIZE_PT,
        bold=True,
        max_width=max_width,
    )
    width, height = report.size
    label = FORMAT_LABELS.get(report.format, report.format)
    facts = f"{width:.2f} x {height:.2f} m, imported from {label}"
    page.write(facts, left, _SUBTITLE_Y_PX * page.scale, color=page.theme.faint, max_width=max_width)


def _write_caption(page: FigurePage, caption: Caption, left: float, top: float, width: float) -> None:
    """Write a caption above the arena whose left and top edges are given, px."""
    y = top - _CAPTION_OFFSET_PX * page.scale
    page.write(caption.name, left, y, points=TITLE_SIZE_PT, bold=True)
    indent = measure_caption_indent(page, caption.name)
    page.write(caption.facts, left + indent, y, color=page.theme.faint, max_width=width - indent)


def _write_lines(layout: ImportPage) -> None:
    """Write the lines of the report at the bottom of the page, from the last line upward."""
    page = layout.page
    left = _get_left(layout)
    for k, line in enumerate(reversed(layout.lines)):
        y = page.size[1] - (LINE_HEIGHT_PX * k + _LAST_LINE_OFFSET_PX) * page.scale
        page.write(line, left, y, points=SMALL_SIZE_PT, color=page.theme.faint)


def _draw_before(axes: Axes, comparison: ImportComparison, report: ImportReport, theme: Theme) -> None:
    """Draw the map as read, the free space that was lost, and a position in each part that was left out."""
    outside = shapely.difference(comparison.region, comparison.before)
    _draw_area(axes, outside, theme.obstacle, theme.obstacle_edge)
    # Free space also has an edge where it ends at the edge of the arena.
    outlines = shapely.get_exterior_ring(shapely.get_parts(comparison.before))
    edges = LineCollection(
        [shapely.get_coordinates(outline) for outline in outlines],
        colors=to_plot_color(theme.boundary),
        linewidths=_BOUNDARY_WIDTH_PT,
        clip_on=False,
        zorder=_AREA_ORDER,
    )
    axes.add_collection(edges, autolim=False)
    _draw_area(axes, comparison.lost, theme.trajectory, theme.trajectory, _MARK_OPACITY)
    ink = to_plot_color(theme.ink)
    halo = [withStroke(linewidth=_TEXT_HALO_PT, foreground=to_plot_color(theme.background))]
    for x, y in report.others:
        axes.plot(
            [x],
            [y],
            marker="+",
            markersize=_POSITION_MARK_PT,
            color=ink,
            zorder=_MARK_ORDER,
            path_effects=halo,
        )
        axes.annotate(
            f"{x:.10g} {y:.10g}",
            (x, y),
            (_POSITION_TEXT_OFFSET_PT, _POSITION_TEXT_OFFSET_PT),
            textcoords="offset points",
            fontsize=SMALL_SIZE_PT,
            color=ink,
            zorder=_MARK_ORDER,
            path_effects=halo,
        )


def _draw_area(axes: Axes, area: BaseGeometry, fill: Color, edge: Color, opacity: float = 1.0) -> None:
    """Draw the polygons of a geometry, m."""
    for part in shapely.get_parts(area):
        if not isinstance(part, Polygon):
            continue
        rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
        outline = Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings))
        patch = PathPatch(
            outline,
            zorder=_AREA_ORDER,
            facecolor=(*to_plot_color(fill), opacity),
            edgecolor=to_plot_color(edge),
            linewidth=_EDGE_WIDTH_PT,
        )
        axes.add_patch(patch)


def _draw_gap(axes: Axes, gap: Gap, theme: Theme) -> None:
    """Draw the narrowest passage as a line, with a ring around it if the line is short."""
    color = to_plot_color(theme.final)
    points = np.array(gap.between)
    halo = [withStroke(linewidth=_PASSAGE_HALO_PT, foreground=to_plot_color(theme.background))]
    axes.plot(
        points[:, 0],
        points[:, 1],
        color=color,
        linewidth=_PASSAGE_WIDTH_PT,
        zorder=_MARK_ORDER,
        clip_on=False,
        path_effects=halo,
    )
    points_per_pixel = 72 / axes.figure.dpi
    start, end = axes.transData.transform(points) * points_per_pixel
    if np.hypot(*(end - start)) >= _PASSAGE_RING_PT:
        return
    x, y = points.mean(axis=0)
    axes.plot(
        x,
        y,
        "o",
        markersize=_PASSAGE_RING_PT,
        markerfacecolor="none",
        markeredgecolor=color,
        markeredgewidth=_PASSAGE_RING_WIDTH_PT,
        zorder=_MARK_ORDER,
        clip_on=False,
        path_effects=halo,
    )


def _build_handles(environment: Environment, theme: Theme, comparison: ImportComparison) -> list[Artist]:
    """Return the entries of the legend; marks have an entry only if the figure contains them."""
    handles = build_map_handles(environment, theme)
    if not comparison.lost.is_empty:
        area = _format_number(comparison.lost.area)
        handles.append(_build_mark_handle(f"left out: {area} m² were free", theme.trajectory))
    if not comparison.opened.is_empty:
        area = _format_number(comparison.opened.area)
        handles.append(_build_mark_handle(f"opened: {area} m² were solid", theme.start))
    if comparison.gap is not None:
        label = f"narrowest passage, {comparison.gap.width:.3g} m"
        handles.append(
            Line2D([], [], color=to_plot_color(theme.final), linewidth=_PASSAGE_WIDTH_PT, label=label)
        )
    return handles


def _build_mark_handle(label: str, color: Color) -> Patch:
    return Patch(
        label=label,
        facecolor=(*to_plot_color(color), _MARK_OPACITY),
        edgecolor=to_plot_color(color),
        linewidth=_EDGE_WIDTH_PT,
    )


def _format_number(value: float) -> str:
    """Format a number with four significant digits, or without decimals if it is large."""
    if abs(value) < _MIN_GROUPED_NUMBER:
        return f"{value:.4g}"
    return f"{value:,.0f}".replace(",", _THIN_SPACE)
