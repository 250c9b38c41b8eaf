"""The coverage cost as one page: its curves, and maps of the distances that it is the mean of."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from robocov.arrays import IntArray
from robocov.environment import Environment
from robocov.record import Record
from robocov.team import Team
from robocov_app.figures import arena
from robocov_app.figures.curves import DISTANCE, TIME, WEIGHED, Curve, draw_curves, end_label
from robocov_app.figures.files import plain_style
from robocov_app.figures.page import SMALL, TEXT, Box, Page, check_some, tone
from robocov_app.figures.runs import plot_cost
from robocov_app.look.legend import merge_legends
from robocov_app.look.theme import LIGHT, Theme, get_theme
from robocov_app.render.density import cost_label, density_label, mean_label
from robocov_app.render.distance_field import Field, levels, palette, round_limit, strength, ticks

_FINE = 2  # dots of a map's picture for each pixel of the page
_LEAST = 720, 400  # smallest page for curves and maps
_BAR_LABEL = "distance to the nearest robot"


@dataclass(frozen=True, eq=False)
class Moment:
    """A team at one moment (s), with the distances around it and what stands above the map."""

    environment: Environment
    team: Team
    field: Field
    title: str = ""
    facts: str = ""
    numbers: tuple[int, ...] | None = None
    time: float = 0.0

    @classmethod
    def last_of(
        cls,
        record: Record,
        field: Field,
        mean_distance: float,
        counted: IntArray | None = None,
        mean_time: float | None = None,
    ) -> "Moment":
        """Return the last moment of a run, its mean distance, m, and time, s, of `counted` rows."""
        cost = cost_label(mean_label(record.environment), mean_distance, mean_time)
        cost = cost.replace(", mean time", ", time")  # three maps side by side leave little room
        time = float(record.time[-1])
        facts = f"{cost} after {time:.1f} s".lstrip()
        rows = np.arange(len(record.team)) if counted is None else counted
        numbers = tuple((rows + 1).tolist())
        return cls(record.environment, record.team[rows], field, record.label, facts, numbers, time)


@plain_style()
def plot_coverage(
    curves: Sequence[Curve],
    moments: Sequence[Moment],
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "Coverage cost",
    times: Sequence[Curve] = (),
) -> Figure:
    """Plot cost curves, and maps of the distance to the nearest robot, all in one scale of colors.

    `curves` may be empty, `moments` not: that raises ParameterError. `size`: (width, height) of the page;
    below 720 x 400 it has the curves alone. `times`: mean times, s, where robots are not equally fast.
    """
    check_some("moments", moments)
    if curves and size is not None and (size[0] < _LEAST[0] or size[1] < _LEAST[1]):
        return plot_cost(curves, theme=theme, size=size, title=title)
    theme = get_theme(theme)
    bounds = np.array([moment.environment.region.bounds for moment in moments])
    low_x, low_y = bounds[:, :2].min(axis=0).tolist()
    high_x, high_y = bounds[:, 2:].max(axis=0).tolist()
    aspect = (high_x - low_x) / (high_y - low_y)
    limit, maps = _limit(moments), len(moments)
    handles = _handles(moments, theme)
    page = Page(size or (1500, 1000), theme, 1.3 if size is None else None)
    s, margin = page.scale, page.margin
    beside = bool(curves) and maps == 1 and aspect < 1.9
    below = bool(curves) and not beside
    part = 0.5 if beside else 1.0
    footer = page.footer_height(handles, (1.0 - part) * page.size[0] + margin)
    room, head, highest = part * page.size[0] - 2 * margin, 46 * s, 290 * s
    if size is None:
        columns = min(maps, max(1, round(np.sqrt(maps * 1.6 / aspect)))) if maps > 3 else maps
        slot = (room - (columns - 1) * 16 * s) / columns
        tall = -(-maps // columns) * (min(slot / aspect, 760) + 66 * s) - 16 * s
        above = 2 * head + highest if below else head
        least = 480 * s if maps == 1 and aspect < 1.9 else 320
        page = Page((page.size[0], int(np.clip(above + tall + footer, least, 2600))), theme, 1.3)
    width, height = page.size
    curves_room: Box = (margin, head, 0.5 * width - margin, height - head)
    maps_room: Box = ((1.0 - part) * width + margin, head, room, height - head - footer)
    bar_y = 26 * s  # of the scale of colors
    if below:
        high = highest if size is None else min(highest, 0.4 * (height - head - footer))
        end = head + high
        curves_room = margin, head, width - 2 * margin, high
        maps_room, bar_y = (margin, end + head, room, height - footer - end - head), end + 24 * s
    bar_left = _draw_bar(page, limit, maps_room, bar_y, maps_room[0] if below or not curves else 0.5 * width)
    page.title(title, 26, (width if below else bar_left) - 2 * margin)
    if curves:
        weighed = any(density_label(moment.environment) for moment in moments)
        _draw_both(page, curves, times, curves_room, WEIGHED if weighed else DISTANCE)
    panels = _panels(maps_room, maps, aspect, 50 * s, 16 * s)
    for moment, (box, slot) in zip(moments, panels, strict=True):
        _draw_moment(page.map_axes(box, low_x, low_y, high_x, high_y), moment, limit, theme, box, s)
        page.text(moment.title, box[0], box[1] - 35 * s, points=TEXT + 1.5, bold=True, room=slot)
        page.text(moment.facts, box[0], box[1] - 14 * s, color=theme.faint, room=slot)
    boxes = [box for box, _ in panels]
    page.footer(handles, boxes, boxes[0][2] / (high_x - low_x), maps_room[0])
    return page.figure


@plain_style()
def plot_distances(moment: Moment, axes: Axes, theme: Theme | str = LIGHT) -> None:
    """Plot distances on axes of somebody else, which get ticks in meters and a scale of colors."""
    theme = get_theme(theme)
    limit = _limit([moment])
    arena.ticks_in_meters(axes, moment.environment, theme)
    axes.apply_aspect()
    extent, scale = axes.get_window_extent(), axes.figure.dpi / 100
    # small axes may be saved large
    fine = max(_LEAST[0] / extent.width, 1.0)
    box = (0.0, 0.0, fine * extent.width, fine * extent.height)
    _draw_moment(axes, moment, limit, theme, box, fine * scale)
    axes.set_aspect("equal")
    bar = axes.inset_axes((1.03, 0.0, 0.035, 1.0))
    bar.imshow(
        theme.build_heat_table(256)[:, None], origin="lower", aspect="auto", extent=(0.0, 1.0, 0.0, limit)
    )
    bar.set(xticks=[], yticks=ticks(limit), ylabel=f"{_BAR_LABEL} (m)")
    bar.yaxis.tick_right()
    bar.yaxis.set_label_position("right")


def _limit(moments: Sequence[Moment]) -> float:
    largest = [moment.field.largest for moment in moments if np.isfinite(moment.field.largest)]
    return round_limit(max(largest, default=1.0))


def _handles(moments: Sequence[Moment], theme: Theme) -> list[Artist]:
    line = Line2D([], [], color=tone(theme.geodesic_border), linewidth=1.6, label="geodesic cell border")
    handles: list[Artist] = [arena.robot_handle("robot", theme.final, theme), line]
    every = [arena.map_handles(moment.environment, theme, density=False)[1:] for moment in moments]
    for handle in merge_legends(every, arena.label_of):
        handle.set_label(arena.label_of(handle).removesuffix(" (unknown to robots)"))
        handles.append(handle)
    if any((moment.field.result.owner < 0).any() for moment in moments):
        color, edge = tone(theme.unreached), tone(theme.obstacle_edge)
        closed: Any = {"hatch": "////", "linewidth": 0.0, "label": "no robot can come"}
        handles.append(Patch(facecolor=color, edgecolor=edge, **closed))
    return handles


def _draw_both(page: Page, curves: Sequence[Curve], times: Sequence[Curve], room: Box, label: str) -> None:
    """Draw the mean distances, and if there are any the mean times: below, or beside them in a wide room."""
    s, (left, top, width, height) = page.scale, room
    drawn = [(curves, label, "m"), *[(times, TIME, "s")] * bool(times)]
    for k, (some, words, unit) in enumerate(drawn):
        x, y, wide, high = left, top + k * height / len(drawn), width, height / len(drawn)
        if times and width > 2.4 * height:
            x, y, wide, high = left + k * width / 2, top, width / 2, height
        longest = max(page.text_width(end_label(curve, unit), bold=True) for curve in some)
        right = min(26 * s + longest, 0.45 * wide)
        axes = page.axes((x + 34 * s, y + 34 * s, wide - 34 * s - right, high - 34 * s - 50 * s))
        draw_curves(axes, some, page.theme, label=words, unit=unit)


def _panels(room: Box, count: int, aspect: float, above: float, gap: float) -> list[tuple[Box, float]]:
    """Return the largest equal boxes in a room, with captions above them, and how wide these may be."""
    left, top, width, height = room
    best: tuple[float, int] = (0.0, 1)
    for columns in range(1, count + 1):
        rows = -(-count // columns)
        wide = (width - (columns - 1) * gap) / columns
        high = (height - (rows - 1) * gap) / rows - above
        best = max(best, (min(wide, max(high, 1.0) * aspect), columns))
    wide, columns = best
    slot, high = (width - (columns - 1) * gap) / columns, wide / aspect
    aside = 0.0 if count > 1 else (slot - wide) / 2
    boxes = []
    for row, column in (divmod(number, columns) for number in range(count)):
        x, y = left + column * (slot + gap) + aside, top + row * (high + above + gap) + above
        boxes.append(((x, y, wide, high), slot - aside))
    return boxes


def _draw_moment(axes: Axes, moment: Moment, limit: float, theme: Theme, box: Box, scale: float) -> None:
    (low_x, high_x), (low_y, high_y) = axes.get_xlim(), axes.get_ylim()
    zoom = _FINE * box[2] / (high_x - low_x)
    columns, rows = max(round(_FINE * box[2]), 2), max(round(_FINE * box[3]), 2)
    x = low_x + (np.arange(columns) + 0.5) * (high_x - low_x) / columns
    y = high_y - (np.arange(rows) + 0.5) * (high_y - low_y) / rows
    picture = palette(theme)[levels(moment.field, x, y, limit, _FINE * 9)]
    width = _FINE * 1.4 * scale
    borders = moment.field.borders(x, y, width / zoom)
    part = strength(borders, zoom, width)[:, None]
    place = borders.row, borders.column
    picture[place] = np.rint((1.0 - part) * picture[place] + part * np.array(theme.geodesic_border))
    extent = low_x, high_x, low_y, high_y
    image = axes.imshow(picture, extent=extent, aspect="auto", interpolation="antialiased", zorder=0)
    image.set_clip_path(Polygon(moment.environment.region.vertices, transform=axes.transData))
    arena.draw_map(axes, moment.environment, theme, density=False, time=moment.time)
    places = moment.field.result.positions
    arena.draw_robots(axes, places, moment.team.radius, [theme.final] * len(places), theme, moment.numbers)


def _draw_bar(page: Page, limit: float, maps: Box, middle: float, least: float) -> float:
    """Draw the scale of colors above the right edge of the maps; return where it, or its words, begin.

    Words that would reach to the left of `least` px are left out.
    """
    theme, s = page.theme, page.scale
    right, width = maps[0] + maps[2] - 14 * s, 190 * s
    axes = page.axes((right - width, middle - 9 * s, width, 10 * s))
    axes.imshow(theme.build_heat_table(256)[None], aspect="auto", extent=(0.0, limit, 0.0, 1.0))
    for side in axes.spines.values():
        side.set(edgecolor=tone(theme.faint), linewidth=0.6)
    marks = ticks(limit)
    axes.set_xticks(marks, [*(f"{mark:g}" for mark in marks[:-1]), f"{marks[-1]:g} m"], fontsize=SMALL)
    axes.set_yticks([])
    axes.tick_params(colors=tone(theme.faint), labelcolor=tone(theme.ink), length=2.5, pad=1.5)
    left = right - width - 12 * s
    wide = page.text_width(_BAR_LABEL)
    if left - wide > least:
        page.text(_BAR_LABEL, left, middle - 4 * s, align="right")
        left -= wide
    return left
