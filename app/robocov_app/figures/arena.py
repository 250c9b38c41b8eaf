"""Maps, and whole runs in them, drawn with matplotlib."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation

from robocov.environment import Environment
from robocov.record import Record
from robocov.typing import FloatArray, IntArray
from robocov_app.figures.page import POINTS_PER_INCH, get_figure, to_plot_color
from robocov_app.figures.start_numbers import place_start_numbers
from robocov_app.look import legend
from robocov_app.look.axes import TICK_FACTORS
from robocov_app.look.colors import Color, choose_text_color, mix
from robocov_app.look.hues import ColorScheme, choose_robot_hues, choose_trail_colors
from robocov_app.look.theme import Theme
from robocov_app.render.crowding import choose_width_factor, fit_mark_size, fit_radii
from robocov_app.render.density_shading import shade_density
from robocov_app.render.density_text import describe_density
from robocov_app.render.moving_obstacles import MovingObstacle, list_moving_obstacles
from robocov_app.render.scene import are_centroids

_DISC_PT = 6.4
"""Radius of the disc of a robot if there is enough space."""
_MIN_DISC_PT = 1.7
"""Radius of the disc of a robot in the densest crowd."""
_MIN_NUMBER_PT = 4.2
"""Numbers of robots that would be smaller are left out."""
_NUMBER_SIZES = (1.25, 1.1, 0.85, 0.65)
"""Text sizes of numbers of one, two, three and more digits, in radii of the robot."""
_START_PT = 6.2
"""Diameter of the ring at a start; it is larger if robots are large."""
_START_DIAMETERS = 0.6
"""Diameter of the ring at a start, in diameters of a large robot."""
_MAX_NUMBER_PT = 15.0
_MAX_START_NUMBER_PT = 10.0
"""Maximum text sizes of the numbers of large robots and of their starts."""
_START_NUMBER_SIZE = 1.1
"""Text size of the numbers of starts, in diameters of their rings."""
_MIN_START_NUMBER_PT = 5.5
"""Numbers of starts that would be smaller are left out: between crowded rings, they would be illegible."""
_MAX_NUMBERED_STARTS = 30
"""In a larger team, the numbers of starts would hide the trajectories."""
_START_NUMBER_HALO_PT = 1.6
"""Width of the light edge that separates the number of a start from what is below it."""
_GOAL_PT = 8.0
_GOAL_HALO_PT = 2.6
"""Width of the lines of a cross with its light edge."""
_GOAL_DIAMETERS = 0.6
"""Size of the mark of a goal, in diameters of a large robot."""
_MAX_TRAJECTORY_FACTOR = 1.6
"""Maximum factor for the width of the trajectories of large robots."""
_MIN_MARK_PT = 3.2
"""Sizes of starts and goals: of each if there is enough space, and of both in the densest crowd."""
_ARROW_PT = 16.0
"""Length of the arrow on a moving obstacle."""
_OBSTACLE_WIDTH_PT = 0.8
_PATH_WIDTH_PT = 0.8
_MOVING_WIDTH_PT = 1.4
_LINE_WIDTH_PT = 1.6
"""Width of the boundary of the known region, and of trajectories of a small team."""
_CELL_EDGE_WIDTH_PT = 0.8
_OUTLINED_CELL_EDGE_WIDTH_PT = 1.1
"""Width of the edges of cells that are not filled, because a density is drawn below them."""
_MAX_RING_WIDTH_PT = 1.1
_MAX_RING_WIDTH_FRACTION = 0.25
"""Maximum width of the ring of a robot, as a fraction of its radius."""
_HEADING_DISTANCE_RADII = 1.25
_HEADING_SIZE_RADII = 0.9
"""Distance of the triangle that shows a heading from the center of its disc, and its size, in disc radii."""

# Drawing order, from the bottom to the top.
_CELLS_ORDER = 1
_DENSITY_ORDER = 1.5
_OUTLINED_CELLS_ORDER = 1.6
_OBSTACLES_ORDER = 2
_MOVING_ORDER = 2.1
_PATHS_ORDER = 2.2
_ARROWS_ORDER = 2.3
_BOUNDARY_ORDER = 3
_TRAJECTORIES_ORDER = 4
_STARTS_ORDER = 5
_GOALS_ORDER = 6
_ROBOTS_ORDER = 7
_NUMBERS_ORDER = 8
_LABELS_OF_OPTIONAL_MARKS = (legend.CELL_CENTROID, legend.FINAL_VORONOI_CELL, legend.GOAL)
"""Legend entries of what is not drawn in every run."""
_DENSITY_DOTS = 400
"""Number of dots of a density image along the longer side of the map."""


def set_meter_axes(axes: Axes, environment: Environment, theme: Theme) -> None:
    """Set ticks in meters, and limits that show the whole map, on axes of a notebook."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    axes.set(aspect="equal", xlim=(low_x, high_x), ylim=(low_y, high_y), xlabel="x (m)", ylabel="y (m)")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator("auto", steps=list(TICK_FACTORS)))
    axes.set_facecolor(to_plot_color(theme.background))


def _build_obstacle_style(theme: Theme) -> dict[str, Any]:
    """Return the matplotlib properties of obstacles."""
    return {
        "facecolor": to_plot_color(theme.obstacle),
        "edgecolor": to_plot_color(theme.obstacle_edge),
        "linewidth": _OBSTACLE_WIDTH_PT,
    }


def _build_path_style(theme: Theme) -> dict[str, Any]:
    """Return the matplotlib properties of the paths of moving obstacles."""
    return {"color": to_plot_color(theme.ink), "linewidth": _PATH_WIDTH_PT, "linestyle": (0, (4, 3))}


def draw_map(
    axes: Axes, environment: Environment, theme: Theme, *, has_density: bool = True, time: float = 0.0
) -> None:
    """Draw a map: its density, obstacles at rest, moving obstacles and boundary.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes that show the map in meters.
    environment : Environment
    theme : Theme
    has_density : bool
        Whether the density is drawn.
    time : float, s
        Time at which moving obstacles are drawn.
    """
    if has_density and describe_density(environment):
        _draw_density(axes, environment, theme)
    for polygon in environment.at(time).blocked.geoms:
        rings = [
            Path(np.asarray(ring.coords), closed=True) for ring in (polygon.exterior, *polygon.interiors)
        ]
        outline = Path.make_compound_path(*rings)
        axes.add_patch(PathPatch(outline, zorder=_OBSTACLES_ORDER, **_build_obstacle_style(theme)))
    for obstacle in list_moving_obstacles(environment, time):
        _draw_moving_obstacle(axes, environment, obstacle, theme)
    boundary = Polygon(
        environment.region.vertices,
        closed=True,
        fill=False,
        edgecolor=to_plot_color(theme.boundary),
        linewidth=_LINE_WIDTH_PT,
        joinstyle="miter",
        clip_on=False,
        zorder=_BOUNDARY_ORDER,
    )
    axes.add_patch(boundary)


def _draw_density(axes: Axes, environment: Environment, theme: Theme) -> None:
    """Draw the density as an image, without changing the limits of the axes as `imshow` would."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    image = AxesImage(
        axes,
        extent=(low_x, high_x, low_y, high_y),
        origin="lower",
        interpolation="bilinear",
        zorder=_DENSITY_ORDER,
    )
    image.set_data(shade_density(environment, _DENSITY_DOTS, theme))
    axes.add_image(image)
    image.set_clip_path(Polygon(environment.region.vertices, transform=axes.transData))


def _draw_moving_obstacle(
    axes: Axes, environment: Environment, obstacle: MovingObstacle, theme: Theme
) -> None:
    """Draw a moving obstacle, its path, and an arrow that shows its heading."""
    fill: Any = to_plot_color(theme.moving_obstacle)
    is_hollow = bool(obstacle.polygon.interiors)
    if is_hollow:
        # The shape is drawn without its holes, which a fill would cover.
        fill = "none"
    shape = Polygon(
        np.asarray(obstacle.polygon.exterior.coords),
        facecolor=fill,
        edgecolor=to_plot_color(theme.obstacle_edge),
        linewidth=_MOVING_WIDTH_PT,
        zorder=_MOVING_ORDER,
    )
    axes.add_patch(shape)
    shape.set_clip_path(Polygon(environment.region.vertices, transform=axes.transData))
    axes.plot(*obstacle.path.T, zorder=_PATHS_ORDER, **_build_path_style(theme))
    half_arrow = 0.5 * _ARROW_PT * obstacle.heading / _compute_points_per_meter(axes)
    arrow = {
        "arrowstyle": "-|>",
        "linewidth": _MOVING_WIDTH_PT,
        "shrinkA": 0.0,
        "shrinkB": 0.0,
        "color": to_plot_color(theme.ink),
    }
    axes.annotate(
        "",
        xy=(obstacle.middle + half_arrow).tolist(),
        xytext=(obstacle.middle - half_arrow).tolist(),
        arrowprops=arrow,
        zorder=_ARROWS_ORDER,
    )


def draw_run(axes: Axes, record: Record, theme: Theme, colors: ColorScheme) -> None:
    """Draw a whole run: map, trajectories, and the final positions, goals and cells of the robots.

    On a map with a density, the cells are outlines, because the density is shown by colors.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes that show the map in meters.
    record : Record
    theme : Theme
    colors : {"paper", "robots"}
    """
    draw_map(axes, record.environment, theme, time=float(record.time[-1]))
    cells = record.cells()
    working = np.flatnonzero(record.working[-1])
    hues = choose_robot_hues(len(record.team), working[cells.adjacency])
    fills = None
    if not describe_density(record.environment):
        get_fill = theme.get_paper_cell_color if colors == "paper" else theme.get_cell_color
        fills = [get_fill(hue) for hue in hues[working].tolist()]
    _draw_cells(axes, cells.outlines, fills, theme)
    _draw_trajectories(axes, record, choose_trail_colors(theme, hues.tolist(), colors))
    _draw_starts(axes, record, theme)
    radii = _draw_final_positions(axes, record, hues, theme, colors)
    if record.steering is not None:
        _draw_headings(axes, record, record.steering[-1], radii, theme)
    if has_goals(record):
        _draw_goals(axes, record, cells.centroids, radii, theme)


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
    faces = []
    for outline, owner in zip(*outlines, strict=True):
        if len(outline) > 2:
            polygons.append(outline)
            if fills is not None:
                faces.append(to_plot_color(fills[int(owner)]))
    collection = PolyCollection(
        polygons,
        facecolors="none" if fills is None else faces,
        edgecolors=to_plot_color(theme.cell_edge),
        linewidths=_OUTLINED_CELL_EDGE_WIDTH_PT if fills is None else _CELL_EDGE_WIDTH_PT,
        zorder=_OUTLINED_CELLS_ORDER if fills is None else _CELLS_ORDER,
        # A single cell has no edge in the region.
        label=legend.FINAL_VORONOI_CELL if len(polygons) > 1 else "",
    )
    axes.add_collection(collection, autolim=False)


def _draw_trajectories(axes: Axes, record: Record, colors: Sequence[Color]) -> None:
    """Draw the trajectory of each robot while it is present."""
    robots = len(record.team)
    trajectories = [record.positions[record.present[:, robot], robot] for robot in range(robots)]
    enlargement = np.sqrt(_compute_median_diameter(axes, record) / (2.0 * _DISC_PT))
    size_factor = float(np.clip(enlargement, 1.0, _MAX_TRAJECTORY_FACTOR))
    collection = LineCollection(
        trajectories,
        colors=[to_plot_color(color) for color in colors],
        linewidths=_LINE_WIDTH_PT * choose_width_factor(robots) * size_factor,
        capstyle="round",
        joinstyle="round",
        zorder=_TRAJECTORIES_ORDER,
    )
    axes.add_collection(collection, autolim=False)


def _draw_starts(axes: Axes, record: Record, theme: Theme) -> None:
    """Draw a ring at the first position of each robot: its start, or where it joined later."""
    present = np.flatnonzero(record.present[-1])
    first_rows = np.argmax(record.present, axis=0)[present]
    starts = record.positions[first_rows, present]
    max_size = _choose_max_mark_size(axes, record, _START_PT, _START_DIAMETERS)
    size = fit_mark_size(_to_points(axes, starts), _MIN_MARK_PT, max_size)
    axes.plot(*starts.T, zorder=_STARTS_ORDER, **_build_start_style(theme, size))
    if len(present) <= _MAX_NUMBERED_STARTS and _START_NUMBER_SIZE * size >= _MIN_START_NUMBER_PT:
        starts_by_robot = dict(zip(present.tolist(), starts, strict=True))
        _draw_start_numbers(axes, record, starts_by_robot, size, theme)


def _draw_start_numbers(
    axes: Axes, record: Record, starts: Mapping[int, FloatArray], size: float, theme: Theme
) -> None:
    """Write the number of each robot next to the ring at its start, (2,) m. Rings have a size in points."""
    trajectories = record.positions[:, list(starts)].reshape(-1, 2)
    is_known = np.isfinite(trajectories).all(axis=1)
    marks = _to_points(axes, trajectories[is_known])
    start_points = _to_points(axes, np.array(list(starts.values())))
    text_size = min(_START_NUMBER_SIZE * size, _MAX_START_NUMBER_PT)
    centers = place_start_numbers(start_points, marks, mark_size=size, text_size=text_size)
    halo = [withStroke(linewidth=_START_NUMBER_HALO_PT, foreground=to_plot_color(theme.background))]
    for (robot, start), offset in zip(starts.items(), centers - start_points, strict=True):
        axes.annotate(
            str(robot + 1),
            xy=start.tolist(),
            xytext=offset.tolist(),
            textcoords="offset points",
            fontsize=text_size,
            fontweight="bold",
            color=to_plot_color(theme.start),
            ha="center",
            va="center_baseline",
            path_effects=halo,
            zorder=_STARTS_ORDER,
        )


def _draw_final_positions(
    axes: Axes, record: Record, hues: IntArray, theme: Theme, colors: ColorScheme
) -> dict[int, float]:
    """Draw the robots at their final positions; return the drawn radius of each by its row, points."""
    present = np.flatnonzero(record.present[-1])
    failed = record.present[-1] & ~record.working[-1]
    fills = []
    for robot in present.tolist():
        if failed[robot]:
            fills.append(theme.failed_robot)
        elif colors == "paper":
            fills.append(theme.final)
        else:
            fills.append(theme.robots[hues[robot]])
    numbers = (present + 1).tolist()
    positions = record.positions[-1][present]
    radii = draw_robots(axes, positions, record.team.radius[present], fills, theme, numbers=numbers)
    return dict(zip(present.tolist(), radii, strict=True))


def _draw_headings(
    axes: Axes, record: Record, steering: FloatArray, radii: Mapping[int, float], theme: Theme
) -> None:
    """Draw a triangle next to the disc of each working unicycle, pointing along its heading.

    The first column of `steering`, (n, ...), is the heading, rad. `radii` are those of discs, points.
    """
    inches_to_pixels = get_figure(axes).dpi_scale_trans
    is_working_unicycle = record.working[-1] & record.team.is_unicycle
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
            zorder=_GOALS_ORDER,
            clip_on=False,
        )


def _draw_goals(
    axes: Axes, record: Record, centroids: FloatArray, radii: Mapping[int, float], theme: Theme
) -> None:
    """Draw the goals of working robots, or the centroids of their cells if all goals are centroids."""
    working = np.flatnonzero(record.working[-1])
    goals = record.goals[-1][working]
    is_centroid = are_centroids(goals, centroids)
    if is_centroid:
        goals = centroids
    goal_points = _to_points(axes, goals)
    distances = np.hypot(*(goal_points - _to_points(axes, record.positions[-1][working])).T)
    max_size = _choose_max_mark_size(axes, record, _GOAL_PT, _GOAL_DIAMETERS)
    size = fit_mark_size(goal_points[np.isfinite(distances)], _MIN_MARK_PT, max_size)
    # The disc of a robot at its goal would hide the cross, except for its ends.
    is_away = distances > np.array([radii[robot] for robot in working.tolist()])
    if is_away.any():
        # A light edge separates the crosses from obstacles and trajectories.
        halo = [withStroke(linewidth=_GOAL_HALO_PT, foreground=to_plot_color(theme.background))]
        style = _build_goal_style(is_centroid, theme, size)
        axes.plot(*goals[is_away].T, zorder=_GOALS_ORDER, path_effects=halo, **style)


def draw_robots(
    axes: Axes,
    positions: FloatArray,
    radius: FloatArray,
    fills: Sequence[Color],
    theme: Theme,
    *,
    numbers: Sequence[int] | None = None,
) -> list[float]:
    """Draw robots as discs with numbers.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    positions : (n, 2) array, m
    radius : (n,) array, m
        True radii. Discs are drawn larger if there is enough space, so that their numbers are readable.
    fills : sequence of Color
    theme : Theme
    numbers : sequence of int, optional
        By default 1, 2, 3, ...

    Returns
    -------
    list of float
        Radii of the discs, points.
    """
    true_radii = radius * _compute_points_per_meter(axes)
    radii: list[float] = fit_radii(_to_points(axes, positions), true_radii, _MIN_DISC_PT, _DISC_PT).tolist()
    axes.scatter(
        positions[:, 0],
        positions[:, 1],
        # The size of a scatter mark is the square of its diameter, in points.
        s=[(2 * disc) ** 2 for disc in radii],
        c=[to_plot_color(fill) for fill in fills],
        edgecolors=to_plot_color(theme.robot_ring),
        linewidths=[min(_MAX_RING_WIDTH_PT, _MAX_RING_WIDTH_FRACTION * disc) for disc in radii],
        zorder=_ROBOTS_ORDER,
        clip_on=False,
    )
    if numbers is None:
        numbers = range(1, len(positions) + 1)
    for number, (x, y), disc, fill in zip(numbers, positions.tolist(), radii, fills, strict=True):
        digits = min(len(str(number)), len(_NUMBER_SIZES))
        size = min(disc * _NUMBER_SIZES[digits - 1], _MAX_NUMBER_PT)
        if size >= _MIN_NUMBER_PT:
            axes.text(
                x,
                y,
                str(number),
                fontsize=size,
                fontweight="bold",
                color=to_plot_color(choose_text_color(fill)),
                ha="center",
                va="center_baseline",
                zorder=_NUMBERS_ORDER,
            )
    return radii


def _compute_points_per_meter(axes: Axes) -> float:
    """Return the number of points of the page in a meter of the map."""
    ends = _to_points(axes, np.array([[0.0, 0.0], [1.0, 0.0]]))
    return abs(float(ends[1, 0] - ends[0, 0]))


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
    return 2.0 * float(np.median(record.team.radius)) * _compute_points_per_meter(axes)


def _to_points(axes: Axes, positions: FloatArray) -> FloatArray:
    """Convert positions, (n, 2) m, to points of the page."""
    # The transformation is only valid once the aspect has been applied.
    axes.apply_aspect()
    return np.asarray(axes.transData.transform(positions)) * (POINTS_PER_INCH / axes.figure.dpi)


def has_goals(record: Record) -> bool:
    """Return whether any robot has a goal at the end of a run."""
    return bool(np.isfinite(record.goals[-1]).any())


def _build_start_style(theme: Theme, size: float) -> dict[str, Any]:
    """Return the matplotlib properties of the mark of a start, with a size in points."""
    return {
        "linestyle": "none",
        "marker": "o",
        "markersize": size,
        "markerfacecolor": "none",
        "markeredgecolor": to_plot_color(theme.start),
        "markeredgewidth": min(1.5, 0.25 * size),
    }


def _build_goal_style(is_centroid: bool, theme: Theme, size: float) -> dict[str, Any]:
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


def get_label(handle: Artist) -> str:
    """Return the text of an entry of a legend."""
    return str(handle.get_label())


def build_map_handles(environment: Environment, theme: Theme, *, has_density: bool = True) -> list[Artist]:
    """Build the legend entries for what `draw_map` draws; the first one is the boundary."""
    handles: list[Artist] = [
        Line2D(
            [], [], color=to_plot_color(theme.boundary), linewidth=_LINE_WIDTH_PT, label=legend.KNOWN_REGION
        )
    ]
    if not environment.blocked.is_empty:
        handles.append(Patch(label=legend.UNKNOWN_OBSTACLE, **_build_obstacle_style(theme)))
    if environment.has_moving_obstacles:
        square = Line2D(
            [],
            [],
            label=legend.MOVING_OBSTACLE,
            marker="s",
            markersize=7.0,
            markerfacecolor=to_plot_color(theme.moving_obstacle),
            markeredgecolor=to_plot_color(theme.obstacle_edge),
            **_build_path_style(theme),
        )
        handles.append(square)
    density = describe_density(environment)
    if has_density and density:
        # A medium density, since the legend has a single color for the gradient.
        color = mix(theme.background, theme.density, 0.7 * theme.density_strength)
        handles.append(Patch(facecolor=to_plot_color(color), linewidth=0.0, label=density))
    return handles


def build_robot_handle(label: str, fill: Color, theme: Theme) -> Artist:
    """Build a legend entry with a disc, for robots of one color."""
    return Line2D(
        [],
        [],
        label=label,
        linestyle="none",
        marker="o",
        markersize=8.0,
        markerfacecolor=to_plot_color(fill),
        markeredgecolor=to_plot_color(theme.robot_ring),
    )


def build_run_handles(record: Record, theme: Theme, colors: ColorScheme) -> list[Artist]:
    """Build the legend entries for what `draw_run` may draw; see `select_drawn`."""
    robots = len(record.team)
    trail_color = choose_trail_colors(theme, list(range(robots)), colors)[0]
    final_color = theme.robots[0]
    if colors == "paper":
        final_color = theme.final
    handles: list[Artist] = [
        Line2D([], [], label=legend.START, **_build_start_style(theme, _START_PT)),
        Line2D([], [], color=to_plot_color(trail_color), linewidth=_LINE_WIDTH_PT, label=legend.TRAJECTORY),
        build_robot_handle(legend.FINAL_POSITION, final_color, theme),
    ]
    if (record.present[-1] & ~record.working[-1]).any():
        handles.append(build_robot_handle(legend.FAILED_ROBOT, theme.failed_robot, theme))
    if has_goals(record):
        is_centroid = are_centroids(record.goals[-1][record.working[-1]], record.cells().centroids)
        handles.append(Line2D([], [], **_build_goal_style(is_centroid, theme, _GOAL_PT)))
    cell_edge = to_plot_color(theme.cell_edge)
    handles.append(Line2D([], [], color=cell_edge, linewidth=0.9, label=legend.FINAL_VORONOI_CELL))
    # The boundary needs no entry here.
    return [*handles, *build_map_handles(record.environment, theme)[1:]]


def select_drawn(handles: Iterable[Artist], axes: Iterable[Axes]) -> list[Artist]:
    """Return legend entries without those of goals and cells that none of the axes contain.

    Goals are not drawn where robots have reached them, and a single cell has no visible edge.
    """
    drawn_labels: set[str] = set()
    for item in axes:
        _, labels = item.get_legend_handles_labels()
        drawn_labels.update(labels)
    return [
        handle
        for handle in handles
        if get_label(handle) not in _LABELS_OF_OPTIONAL_MARKS or get_label(handle) in drawn_labels
    ]
