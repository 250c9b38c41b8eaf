"""A picture of an import: the map as it was read and as it became, with what was lost between."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

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
from robocov_app.figures.arena import build_map_handles, draw_map
from robocov_app.figures.files import check_figure_path, plain_style, save_figure
from robocov_app.figures.page import HEADING, SMALL, TITLE, Box, Page, tone
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geometry.comparison import ImportComparison, compare_maps
from robocov_app.formats.reports import ImportReport
from robocov_app.look.colors import Color
from robocov_app.look.theme import LIGHT, Theme, get_theme
from robocov_app.render.layout import columns_for

# of the page, of the arenas on it, and the least for what is written, in pixels
_WIDTH, _HEIGHT, _NARROWEST = 1600, 1000, 1040
# of texts and lines; then pixels at scale 1 for titles, captions, and a line of the report
_SCALE, _TOP, _ABOVE, _LINE = 1.3, 66.0, 34.0, 17.0
_MARK = 0.55  # opacity of what is marked
_MOST_LINES = 12  # of the report; what is beyond is counted
_RING = 20.0  # size of the ring around a passage that is too short to be seen, in points


def preview(foreign: ForeignMap, environment: Environment, report: ImportReport, path: Path) -> None:
    """Draw an import to a .png, .svg or .pdf: `plot_import`, saved."""
    check_figure_path(path)
    save_figure(plot_import(foreign, environment, report), path)


def plot_import(
    foreign: ForeignMap, environment: Environment, report: ImportReport, *, theme: Theme | str = LIGHT
) -> Figure:
    """Plot a map as it was read and as it became, at one scale, and what was done to it in words.

    Marked are free space that is not in the map any more, places that were solid and are free, and the
    narrowest passage.
    """
    theme = get_theme(theme)
    compared = compare_maps(foreign, environment, report)
    captions = (
        ("as read", f"{_number(report.vertices_read)} vertices, {_number(compared.before.area)} m² free"),
        ("as imported", f"{_number(report.vertices_kept)} vertices, {_number(compared.after.area)} m² free"),
    )
    with plain_style():
        handles = _handles(environment, theme, compared)
        page, panels, said = _laid_out(theme, compared.bounds, captions, handles, report.format_lines()[2:])
        s, left = page.scale, min(box[0] for box, _ in panels)
        room = page.size[0] - left - page.margin
        page.text(environment.name, left, 24 * s, points=HEADING, bold=True, room=room)
        facts = f"{report.size[0]:.4g} x {report.size[1]:.4g} m, imported from {report.format}"
        page.text(facts, left, 44 * s, color=theme.faint, room=room)
        for (box, slot), (name, facts) in zip(panels, captions, strict=True):
            y = box[1] - 14 * s
            page.text(name, box[0], y, points=TITLE, bold=True)
            beside = _indent(page, name)
            page.text(facts, box[0] + beside, y, color=theme.faint, room=slot - beside)
        low_x, _, high_x, _ = compared.bounds
        first, second = (page.map_axes(box, *compared.bounds) for box, _ in panels)
        outside = shapely.difference(compared.region, compared.before)
        _draw(first, outside, theme.obstacle, theme.obstacle_edge)
        # where free space ends, also where the page is what lies beyond
        rings = shapely.get_rings(shapely.get_parts(compared.before))
        style: Any = {"colors": tone(theme.obstacle_edge), "linewidths": 0.8, "clip_on": False, "zorder": 2}
        edges = LineCollection([*map(shapely.get_coordinates, rings)], **style)
        first.add_collection(edges, autolim=False)
        _draw(first, compared.lost, theme.trajectory, theme.trajectory, _MARK)
        halo = [withStroke(linewidth=3.0, foreground=tone(theme.background))]
        style = {"color": tone(theme.ink), "zorder": 5, "path_effects": halo}
        for x, y in report.others:
            first.plot([x], [y], marker="+", markersize=8.0, **style)
            words = f"{x:.10g} {y:.10g}"
            first.annotate(words, (x, y), (6, 6), textcoords="offset points", fontsize=SMALL, **style)
        draw_map(second, environment, theme)
        _draw(second, compared.opened, theme.start, theme.start, _MARK)
        _draw_gap(second, compared.gap, theme)
        page.footer(handles, [box for box, _ in panels], panels[0][0][2] / (high_x - low_x))
        for k, line in enumerate(reversed(said)):
            y = page.size[1] - (_LINE * k + 16) * s
            page.text(line, left, y, points=SMALL, color=theme.faint)
        return page.figure


def _laid_out(
    theme: Theme, bounds: Box, captions: Sequence[tuple[str, str]], handles: list[Artist], told: Sequence[str]
) -> tuple[Page, list[tuple[Box, float]], list[str]]:
    """Return a page, the boxes of two arenas on it with the room above each, and the lines below."""
    page = Page((_WIDTH, _WIDTH), theme, _SCALE)
    s, (x, y, right, top) = page.scale, bounds
    aspect = (right - x) / (top - y)
    words = max(_indent(page, name) + page.text_width(facts) for name, facts in captions)
    columns = columns_for(2, aspect, (_WIDTH, _HEIGHT), _ABOVE * s)
    rows = 2 // columns
    # a map that is higher than wide needs no wide page
    widest = (_WIDTH - page.margin) / columns - page.margin
    wide = min(widest, max(aspect * _HEIGHT / rows, words))
    width = max(columns * (wide + page.margin) + page.margin, _NARROWEST)
    page = Page((int(width), _WIDTH), theme, _SCALE)
    high = min(wide / aspect, _HEIGHT / rows)
    slot = min(max(high * aspect, words), (width - page.margin) / columns - page.margin)
    left = (width - columns * slot - (columns - 1) * page.margin) / 2
    said = _wrapped(page, told, width - left - page.margin)
    below = page.footer_height(handles) + (_LINE * len(said) + 14) * s
    tall = _TOP * s + rows * (_ABOVE * s + high) + (rows - 1) * 14 * s + below
    page = Page((int(width), int(max(tall, 320))), theme, _SCALE)
    return page, page.panels(2, columns, aspect, words, _ABOVE * s, _TOP * s, below), said


def _indent(page: Page, name: str) -> float:
    return page.text_width(name, points=TITLE, bold=True) + 12 * page.scale


def _style(fill: Color, edge: Color, opacity: float) -> dict[str, Any]:
    return {"facecolor": (*tone(fill), opacity), "edgecolor": tone(edge), "linewidth": 0.8}


def _draw(axes: Axes, area: BaseGeometry, fill: Color, edge: Color, opacity: float = 1.0) -> None:
    for part in shapely.get_parts(area):
        if isinstance(part, Polygon):
            rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
            outline = Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings))
            axes.add_patch(PathPatch(outline, zorder=2, **_style(fill, edge, opacity)))


def _draw_gap(axes: Axes, gap: Gap | None, theme: Theme) -> None:
    if gap is None:
        return
    color, points = tone(theme.final), np.array(gap.between)
    halo = [withStroke(linewidth=4.2, foreground=tone(theme.background))]
    style: dict[str, Any] = {"zorder": 5, "clip_on": False, "path_effects": halo}
    axes.plot(*points.T, color=color, linewidth=2.0, **style)
    ends = axes.transData.transform(points) * (72 / axes.figure.dpi)
    if np.hypot(*(ends[1] - ends[0])) < _RING:
        style |= {"markerfacecolor": "none", "markeredgecolor": color, "markeredgewidth": 1.8}
        axes.plot(*points.mean(axis=0), "o", markersize=_RING, **style)


def _number(value: float) -> str:
    """Return a number as it is read most easily: whole where it is large."""
    return f"{value:.4g}" if abs(value) < 9999.5 else f"{value:,.0f}".replace(",", "\u202f")


def _handles(environment: Environment, theme: Theme, compared: ImportComparison) -> list[Artist]:
    handles = build_map_handles(environment, theme)
    for area, words, color in (
        (compared.lost, "left out: {} m² were free", theme.trajectory),
        (compared.opened, "opened: {} m² were solid", theme.start),
    ):
        if not area.is_empty:
            handles.append(Patch(label=words.format(_number(area.area)), **_style(color, color, _MARK)))
    if compared.gap is not None:
        words = f"narrowest passage, {compared.gap.width:.3g} m"
        handles.append(Line2D([], [], color=tone(theme.final), linewidth=2.0, label=words))
    return handles


def _wrapped(page: Page, lines: Sequence[str], room: float) -> list[str]:
    """Return lines of at most so many pixels, those that are longer in several, and not too many."""
    wrapped: list[str] = []
    for line in lines:
        begun = ""
        whole = page.text_width(line, points=SMALL) <= room
        for word in [line] if whole else line.split():
            longer = f"{begun} {word}".strip()
            if begun.strip() and page.text_width(longer, points=SMALL) > room:
                wrapped.append(begun)
                longer = f"    {word}"
            begun = longer
        wrapped.append(begun)
    if len(wrapped) > _MOST_LINES:
        wrapped = [*wrapped[: _MOST_LINES - 1], f"and {len(wrapped) - _MOST_LINES + 1} more lines"]
    return wrapped
