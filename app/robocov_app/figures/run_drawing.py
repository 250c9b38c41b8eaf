"""Whole runs drawn with matplotlib: trajectories, starts, and the final positions, goals and cells."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.transforms import ScaledTranslation

from robocov.record import Record
from robocov.typing import BoolArray, FloatArray, IntArray
from robocov_app.figures.map_drawing import (
    LINE_WIDTH_PT,
    build_map_handles,
    compute_points_per_meter,
    draw_map,
    get_label,
    to_meters,
    to_points,
)
from robocov_app.figures.number_placement import Discs, join_discs, place_numbers, select_discs
from robocov_app.figures.page import POINTS_PER_INCH, get_figure, to_plot_color
from robocov_app.figures.robot_drawing import (
    MAX_NUMBERED_ROBOTS,
    NUMBER_PT,
    build_robot_handle,
    draw_discs,
    write_numbers,
    write_numbers_in_discs,
)
from robocov_app.look import legend
from robocov_app.look.colors import Color
from robocov_app.look.hues import (
    MAX_OWN_HUES,
    ColorScheme,
    choose_robot_hues,
    choose_trail_color,
    choose_trail_colors,
)
from robocov_app.look.theme import Theme
from robocov_app.render.crowding import choose_width_factor, fit_mark_size, select_spaced_rows
from robocov_app.render.density_text import describe_density
from robocov_app.render.scene import are_centroids

_START_PT = 6.2
"""Diameter of the ring at a start; it is larger if robots are large."""
_START_DIAMETERS = 0.6
"""Diameter of the ring at a start, in diameters of a large robot."""
START_NUMBER_PT = 6.4
"""Text size of the number next to a start, smaller than that of the robot."""
_NUMBER_RADIUS = 0.6
"""Distance from the center of a number that other numbers keep, in text sizes."""
_MIN_NUMBERED_START_PT = 4.6
"""Starts have no numbers if their rings are smaller, because the numbers would be too close to each other."""
_GOAL_PT = 8.0
_HALO_PT = 2.6
"""Width of the lines of a cross or star, including its light edge."""
_GOAL_DIAMETERS = 0.6
"""Size of the mark of a goal, in diameters of a large robot."""
MIN_GOAL_DISTANCE = 0.03
"""Minimum distance of a goal that is drawn from its robot, as a fraction of the longer side of the map. The
rule does not depend on the size of the map on the page, so a run has the same crosses in all figures."""
_CONTACT_PT = 8.0
_CONTACT_WIDTH_PT = 1.3
_CONTACT_RAYS = 8
_ASTERISK = 2
"""Style of matplotlib's markers that consist of rays."""
_MAX_TRAJECTORY_FACTOR = 1.6
"""Maximum factor for the width of the trajectories of large robots."""
_MIN_MARK_PT = 3.2
"""Size of the marks of starts and goals in the densest crowd."""
_LARGE_ROBOT_PT = 12.8
"""Diameter of robots above which trajectories become wider."""
_CELL_EDGE_WIDTH_PT = 0.8
_OUTLINED_CELL_EDGE_WIDTH_PT = 1.1
"""Width of the edges of cells that are not filled, because a density is drawn below them."""
_HEADING_DISTANCE_RADII = 1.25
_HEADING_SIZE_RADII = 0.9
"""Distance of the triangle that shows a heading from the center of its disc, and its size, in disc radii."""

# Drawing order, from the bottom to the top; robots and numbers are in `robot_drawing`.
_CELLS_ORDER = 1
_OUTLINED_CELLS_ORDER = 1.6
_TRAJECTORIES_ORDER = 4
_STARTS_ORDER = 5
_HEADINGS_ORDER = 6
_GOALS_ORDER = 8
_CONTACTS_ORDER = 8.5
_LABELS_OF_OPTIONAL_MARKS = (
    legend.CELL_CENTROID,
    legend.CONTACT,
    legend.FINAL_VORONOI_CELL,
    legend.GOAL,
)
"""Legend entries of what is not drawn in every run."""


@dataclass(frozen=True)
class _RunColors:
    """Colors of a run, one for each robot of the team.

    Attributes
    ----------
    trails, starts, robots : list of Color
        Colors of trajectories, of starts with their numbers, and of final positions.
    numbers : list of Color
        Colors of the numbers next to final positions.
    cells : list of Color or None
        None for outlines only.
    """

    trails: list[Color]
    starts: list[Color]
    robots: list[Color]
    numbers: list[Color]
    cells: list[Color] | None


@dataclass(frozen=True, eq=False)
class _RunMarks:
    """Marks that a run consists of, in points of the page.

    Attributes
    ----------
    present : (n,) int array
        Rows of the present robots in the team.
    discs, starts : Discs
        Final position and start of each present robot.
    all : Discs
        All marks, also those of goals and contacts, which numbers should not cover.
    """

    present: IntArray
    discs: Discs
    starts: Discs
    all: Discs


def draw_run(
    axes: Axes,
    record: Record,
    theme: Theme,
    colors: ColorScheme,
    *,
    contacts: FloatArray | None = None,
) -> None:
    """Draw a whole run: map, trajectories, and the final positions, goals and cells of the robots.

    On a map with a density, the cells are outlines, because the density is shown by colors.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes that show the map in meters.
    record : Record
    theme : Theme
    colors : {"robots", "paper"}
    contacts : (c, 2) array, m, optional
        Points at which contacts began; see `find_contact_points`. By default, none are drawn.
    """
    draw_map(axes, record.environment, theme, time=float(record.time[-1]))
    cells = record.compute_cells()
    run_colors = _choose_colors(record, theme, colors, cells.adjacency)
    _draw_cells(axes, cells.outlines, run_colors.cells, theme)
    _draw_trajectories(axes, record, run_colors.trails)
    present = np.flatnonzero(record.is_present[-1])
    starts = _draw_starts(axes, record, present, run_colors.starts)
    discs = draw_discs(
        axes,
        record.positions[-1, present],
        record.team.radius[present],
        [run_colors.robots[robot] for robot in present.tolist()],
        theme,
    )
    radii = np.zeros(len(record.team))
    radii[present] = discs.radii
    if record.steering is not None:
        _draw_headings(axes, record, record.steering[-1], radii, theme)
    marks = [discs, starts]
    if has_goals(record):
        marks.append(_draw_goals(axes, record, cells.centroids, theme))
    if contacts is not None and len(contacts):
        marks.append(_draw_contacts(axes, contacts, theme))
    _draw_numbers(axes, record, _RunMarks(present, discs, starts, join_discs(marks)), run_colors, theme)


def _choose_colors(record: Record, theme: Theme, scheme: ColorScheme, adjacency: IntArray) -> _RunColors:
    """Choose the colors of a run; `adjacency`, (m, 2), contains the pairs of adjacent cells."""
    robots = len(record.team)
    working = np.flatnonzero(record.is_working[-1])
    hues = choose_robot_hues(robots, working[adjacency])
    trails = choose_trail_colors(theme, hues.tolist(), scheme)
    if scheme == "paper":
        final_colors = [theme.final] * robots
    else:
        final_colors = [choose_trail_color(theme, hue) for hue in hues.tolist()]
    starts = [theme.start] * robots
    numbers = [theme.ink] * robots
    if has_color_per_robot(robots, scheme):
        starts = trails
        numbers = trails
    failed = record.is_present[-1] & ~record.is_working[-1]
    for robot in np.flatnonzero(failed).tolist():
        final_colors[robot] = theme.failed_robot
    cells = None
    if not describe_density(record.environment):
        cells = [theme.get_paper_cell_color(hue) for hue in hues[working].tolist()]
    return _RunColors(
        trails=trails,
        starts=starts,
        robots=final_colors,
        numbers=numbers,
        cells=cells,
    )


def has_color_per_robot(robots: int, scheme: ColorScheme) -> bool:
    """Return whether each robot of a team has a color of its own."""
    return scheme == "robots" and robots <= MAX_OWN_HUES


def _draw_cells(
    axes: Axes, outlines: tuple[list[FloatArray], IntArray], fills: Sequence[Color] | None, theme: Theme
) -> None:
    """Draw the cells of working robots.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    outlines : (list of (k, 2) arrays, (c,) int array)
        Outlines of cells, m, and the working robot that owns each.
    fills : sequence of Color or None
        Color of each working robot's cell; None for outlines only.
    theme : Theme
    """
    polygons = []
    owners = []
    for outline, owner in zip(*outlines, strict=True):
        if len(outline) > 2:
            polygons.append(outline)
            owners.append(int(owner))
    face_colors: Any = "none"
    edge_width = _OUTLINED_CELL_EDGE_WIDTH_PT
    order: float = _OUTLINED_CELLS_ORDER
    if fills is not None:
        face_colors = [to_plot_color(fills[owner]) for owner in owners]
        edge_width = _CELL_EDGE_WIDTH_PT
        order = _CELLS_ORDER
    collection = PolyCollection(
        polygons,
        facecolors=face_colors,
        edgecolors=to_plot_color(theme.cell_edge),
        linewidths=edge_width,
        zorder=order,
        # A single cell has no edge in the region.
        label=legend.FINAL_VORONOI_CELL if len(polygons) > 1 else "",
    )
    axes.add_collection(collection, autolim=False)


def _draw_trajectories(axes: Axes, record: Record, colors: Sequence[Color]) -> None:
    """Draw the trajectory of each robot while it is present."""
    robots = len(record.team)
    trajectories = [record.positions[record.is_present[:, robot], robot] for robot in range(robots)]
    enlargement = np.sqrt(_compute_median_diameter(axes, record) / _LARGE_ROBOT_PT)
    size_factor = float(np.clip(enlargement, 1.0, _MAX_TRAJECTORY_FACTOR))
    collection = LineCollection(
        trajectories,
        colors=[to_plot_color(color) for color in colors],
        linewidths=LINE_WIDTH_PT * choose_width_factor(robots) * size_factor,
        capstyle="round",
        joinstyle="round",
        zorder=_TRAJECTORIES_ORDER,
    )
    axes.add_collection(collection, autolim=False)


def _draw_starts(axes: Axes, record: Record, present: IntArray, colors: Sequence[Color]) -> Discs:
    """Draw a ring at the first position of each present robot: its start, or where it joined later.

    `colors` are those of all robots. The returned discs are the rings, in points.
    """
    first_rows = np.argmax(record.is_present, axis=0)[present]
    starts = record.positions[first_rows, present]
    points = to_points(axes, starts)
    max_size = _choose_max_mark_size(axes, record, _START_PT, _START_DIAMETERS)
    size = fit_mark_size(points, _MIN_MARK_PT, max_size)
    for robot, start in zip(present.tolist(), starts, strict=True):
        axes.plot(*start, zorder=_STARTS_ORDER, **_build_start_style(colors[robot], size))
    return Discs(points, np.full(len(points), 0.5 * size))


def _draw_headings(axes: Axes, record: Record, steering: FloatArray, radii: FloatArray, theme: Theme) -> None:
    """Draw a triangle next to the disc of each working unicycle, pointing along its heading.

    The first column of `steering`, (n, ...), is the heading, rad. `radii`, (n,), are those of discs, points.
    """
    inches_to_pixels = get_figure(axes).dpi_scale_trans
    is_working_unicycle = record.is_working[-1] & record.team.is_unicycle
    for robot in np.flatnonzero(is_working_unicycle).tolist():
        heading = steering[robot, 0]
        distance_in = _HEADING_DISTANCE_RADII * radii[robot] / POINTS_PER_INCH
        offset = ScaledTranslation(
            distance_in * np.cos(heading), distance_in * np.sin(heading), inches_to_pixels
        )
        axes.plot(
            *record.positions[-1, robot],
            transform=axes.transData + offset,
            # A triangle (3 sides, style 0); without rotation it points up.
            marker=(3, 0, float(np.degrees(heading)) - 90.0),
            markersize=_HEADING_SIZE_RADII * radii[robot],
            markeredgecolor="none",
            color=to_plot_color(theme.ink),
            linestyle="",
            zorder=_HEADINGS_ORDER,
            clip_on=False,
        )


def _draw_goals(axes: Axes, record: Record, centroids: FloatArray, theme: Theme) -> Discs:
    """Draw the goals of working robots, or the centroids of their cells if all goals are centroids.

    Robots that are at their goals, or nearly there, have no cross. The returned discs are the marks, points.
    """
    working = np.flatnonzero(record.is_working[-1])
    goals = record.goals[-1][working]
    is_centroid = are_centroids(goals, centroids)
    if is_centroid:
        goals = centroids
    goal_points = to_points(axes, goals)
    distances = np.hypot(*(goals - record.positions[-1][working]).T)
    max_size = _choose_max_mark_size(axes, record, _GOAL_PT, _GOAL_DIAMETERS)
    size = fit_mark_size(goal_points[np.isfinite(distances)], _MIN_MARK_PT, max_size)
    is_away = distances > MIN_GOAL_DISTANCE * np.ptp(record.environment.boundary, axis=0).max()
    if is_away.any():
        style = _build_goal_style(theme, size, is_centroid=is_centroid)
        axes.plot(*goals[is_away].T, zorder=_GOALS_ORDER, path_effects=_build_halo(theme), **style)
    centers = goal_points[is_away]
    return Discs(centers, np.full(len(centers), 0.5 * size))


def _draw_contacts(axes: Axes, contacts: FloatArray, theme: Theme) -> Discs:
    """Draw a star at each contact, (c, 2) m, except at those that are hidden by the star of another one."""
    points = to_points(axes, contacts)
    rows = select_spaced_rows(points, 0.5 * _CONTACT_PT)
    axes.plot(
        *contacts[rows].T,
        zorder=_CONTACTS_ORDER,
        path_effects=_build_halo(theme),
        clip_on=False,
        **_build_contact_style(theme),
    )
    return Discs(points[rows], np.full(len(rows), 0.5 * _CONTACT_PT))


def _build_halo(theme: Theme) -> list[withStroke]:
    """Return the light edge that separates a cross or star from obstacles and trajectories."""
    return [withStroke(linewidth=_HALO_PT, foreground=to_plot_color(theme.background))]


def _draw_numbers(axes: Axes, record: Record, marks: _RunMarks, colors: _RunColors, theme: Theme) -> None:
    """Write the number of each present robot in its disc, or next to it, and next to its start."""
    robots = marks.present.tolist()
    is_inside = write_numbers_in_discs(
        axes,
        record.positions[-1, marks.present],
        marks.discs.radii,
        [robot + 1 for robot in robots],
        [colors.robots[robot] for robot in robots],
    )
    if len(robots) > MAX_NUMBERED_ROBOTS:
        return

    def is_free(points: FloatArray) -> BoolArray:
        return np.asarray(shapely.contains_xy(record.environment.free, *to_meters(axes, points).T))

    obstacles = join_discs([_list_trail_points(axes, record, marks.present), marks.all])
    outside = np.flatnonzero(~is_inside)
    centers = place_numbers(
        select_discs(marks.discs, outside), obstacles, text_size=NUMBER_PT, is_allowed=is_free
    )
    outside_robots = marks.present[outside].tolist()
    _write_robot_numbers(axes, centers, outside_robots, colors.numbers, theme, size=NUMBER_PT)
    if marks.starts.radii[0] < 0.5 * _MIN_NUMBERED_START_PT:
        return
    numbers = Discs(centers, np.full(len(centers), _NUMBER_RADIUS * NUMBER_PT))
    start_centers = place_numbers(
        marks.starts, join_discs([obstacles, numbers]), text_size=START_NUMBER_PT, is_allowed=is_free
    )
    _write_robot_numbers(axes, start_centers, robots, colors.starts, theme, size=START_NUMBER_PT)


def _write_robot_numbers(
    axes: Axes,
    centers: FloatArray,
    robots: Sequence[int],
    colors: Sequence[Color],
    theme: Theme,
    *,
    size: float,
) -> None:
    """Write the numbers of robots, by their rows in the team, in their colors at positions in points."""
    texts = [str(robot + 1) for robot in robots]
    write_numbers(axes, centers, texts, [colors[robot] for robot in robots], theme, size=size)


def _list_trail_points(axes: Axes, record: Record, present: IntArray) -> Discs:
    """Return the known points of the trajectories of present robots, in points."""
    positions = record.positions[:, present].reshape(-1, 2)
    is_known = np.isfinite(positions).all(axis=1)
    points = to_points(axes, positions[is_known])
    return Discs(points, np.zeros(len(points)))


def _choose_max_mark_size(axes: Axes, record: Record, size: float, diameters: float) -> float:
    """Return the maximum size of the mark of a start or goal, points.

    It is smaller in a large team, and grows with large robots.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    record : Record
    size : float, points
        Size in a small team of small robots.
    diameters : float
        Size in diameters of a large robot.
    """
    reduced_size = max(size * choose_width_factor(len(record.team)), _MIN_MARK_PT)
    return max(reduced_size, diameters * _compute_median_diameter(axes, record))


def _compute_median_diameter(axes: Axes, record: Record) -> float:
    """Return the median diameter of the robots of a run, in points of the page."""
    return 2.0 * float(np.median(record.team.radius)) * compute_points_per_meter(axes)


def has_goals(record: Record) -> bool:
    """Return whether any robot has a goal at the end of a run."""
    return bool(np.isfinite(record.goals[-1]).any())


def _build_start_style(color: Color, size: float) -> dict[str, Any]:
    """Return the matplotlib properties of the mark of a start, with a size in points."""
    return {
        "linestyle": "none",
        "marker": "o",
        "markersize": size,
        "markerfacecolor": "none",
        "markeredgecolor": to_plot_color(color),
        "markeredgewidth": min(1.5, 0.25 * size),
    }


def _build_goal_style(theme: Theme, size: float, *, is_centroid: bool) -> dict[str, Any]:
    """Return the matplotlib properties of the mark of a goal or centroid, with a size in points."""
    if is_centroid:
        return {
            "label": legend.CELL_CENTROID,
            "linestyle": "none",
            "marker": "+",
            "markersize": size,
            "markeredgecolor": to_plot_color(theme.ink),
            "markeredgewidth": min(1.2, 0.2 * size),
        }
    return {
        "label": legend.GOAL,
        "linestyle": "none",
        "marker": "x",
        "markersize": 0.8 * size,
        "markeredgecolor": to_plot_color(theme.final),
        "markeredgewidth": min(1.6, 0.2 * size),
    }


def _build_contact_style(theme: Theme) -> dict[str, Any]:
    """Return the matplotlib properties of the star that marks a contact."""
    return {
        "label": legend.CONTACT,
        "linestyle": "none",
        "marker": (_CONTACT_RAYS, _ASTERISK, 0.0),
        "markersize": _CONTACT_PT,
        "markeredgecolor": to_plot_color(theme.error),
        "markeredgewidth": _CONTACT_WIDTH_PT,
    }


def build_run_handles(
    record: Record, theme: Theme, colors: ColorScheme, *, contacts: FloatArray | None = None
) -> list[Artist]:
    """Build the legend entries for what `draw_run` may draw; see `drop_undrawn_handles`."""
    start_color = theme.start
    trail_color = theme.trajectory
    final_color = theme.final
    if colors == "robots":
        # Gray stands for the colors of all robots.
        final_color = theme.faint
        trail_color = choose_trail_colors(theme, [0] * len(record.team), colors)[0]
    if has_color_per_robot(len(record.team), colors):
        start_color = theme.faint
        trail_color = theme.faint
    handles: list[Artist] = [
        Line2D([], [], label=legend.START, **_build_start_style(start_color, _START_PT)),
        Line2D([], [], color=to_plot_color(trail_color), linewidth=LINE_WIDTH_PT, label=legend.TRAJECTORY),
        build_robot_handle(legend.FINAL_POSITION, final_color, theme),
    ]
    if (record.is_present[-1] & ~record.is_working[-1]).any():
        handles.append(build_robot_handle(legend.FAILED_ROBOT, theme.failed_robot, theme))
    if has_goals(record):
        is_centroid = are_centroids(record.goals[-1][record.is_working[-1]], record.compute_cells().centroids)
        handles.append(Line2D([], [], **_build_goal_style(theme, _GOAL_PT, is_centroid=is_centroid)))
    if contacts is not None and len(contacts):
        handles.append(Line2D([], [], **_build_contact_style(theme)))
    cell_edge = to_plot_color(theme.cell_edge)
    handles.append(Line2D([], [], color=cell_edge, linewidth=0.9, label=legend.FINAL_VORONOI_CELL))
    return [*handles, *build_map_handles(record.environment, theme, show_boundary=False)]


def drop_undrawn_handles(handles: Iterable[Artist], panels: Iterable[Axes]) -> list[Artist]:
    """Drop the handles of goals, contacts and cells that no panel contains.

    Goals are not drawn where robots have reached them, and a single cell has no visible edge.
    """
    drawn_labels: set[str] = set()
    for panel in panels:
        _, labels = panel.get_legend_handles_labels()
        drawn_labels.update(labels)
    return [
        handle
        for handle in handles
        if get_label(handle) not in _LABELS_OF_OPTIONAL_MARKS or get_label(handle) in drawn_labels
    ]
