"""World layers of a plot: the map, and a whole run in it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Polygon
from matplotlib.path import Path as Outline
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation

from robocov.arrays import Array
from robocov.environment import Environment
from robocov.record import Record
from robocov_app.figures.page import figure_of, tone
from robocov_app.look.colors import Color, choose_text_color, mix
from robocov_app.look.robot_colors import ColorScheme, choose_robot_hues, choose_trail_colors
from robocov_app.look.theme import Theme
from robocov_app.render.density import density_label, shading
from robocov_app.render.layout import fitted_radii, line_crowding, mark_size
from robocov_app.render.moving_obstacles import MovingObstacle, list_moving_obstacles
from robocov_app.render.scene import CENTROID, GOAL, are_centroids

# radius of a robot where it has room and in the densest crowd, and least size of its number, in points
_DISC, _SMALLEST_DISC, _SMALLEST_NUMBER = 6.4, 1.7, 4.2
_START, _AIM = 6.2, 8.0  # sizes of marks where they have room, in points
_ARROW = 16.0  # length of the arrow on an obstacle that moves, in points
_DOTS = 400  # dots of the shading of a density along the longer side of a map


def ticks_in_meters(axes: Axes, environment: Environment, theme: Theme) -> None:
    low_x, low_y, high_x, high_y = environment.region.bounds
    axes.set(aspect="equal", xlim=(low_x, high_x), ylim=(low_y, high_y), xlabel="x (m)", ylabel="y (m)")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 5, 10]))
    axes.set_facecolor(tone(theme.background))


def _static_style(theme: Theme) -> dict[str, Any]:
    return {"facecolor": tone(theme.obstacle), "edgecolor": tone(theme.obstacle_edge), "linewidth": 0.8}


def _path_style(theme: Theme) -> dict[str, Any]:
    return {"color": tone(theme.ink), "linewidth": 0.8, "linestyle": (0, (4, 3))}


def draw_map(
    axes: Axes, environment: Environment, theme: Theme, *, density: bool = True, time: float = 0.0
) -> None:
    if density and environment.density is not None and not environment.density.is_uniform:
        low_x, low_y, high_x, high_y = environment.region.bounds
        # limits stay as they are, which imshow would change
        extent = low_x, high_x, low_y, high_y
        image = AxesImage(axes, extent=extent, origin="lower", interpolation="bilinear", zorder=1.5)
        image.set_data(shading(environment, _DOTS, theme))
        axes.add_image(image)
        image.set_clip_path(Polygon(environment.region.vertices, transform=axes.transData))
    for part in environment.at(time).blocked.geoms:
        rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
        outline = Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings))
        axes.add_patch(PathPatch(outline, zorder=2, **_static_style(theme)))
    for obstacle in list_moving_obstacles(environment, time):
        _draw_motion(axes, environment, obstacle, theme)
    rim: Any = {"edgecolor": tone(theme.boundary), "linewidth": 1.6, "joinstyle": "miter"}
    vertices = environment.region.vertices
    axes.add_patch(Polygon(vertices, closed=True, fill=False, clip_on=False, zorder=3, **rim))


def _draw_motion(axes: Axes, environment: Environment, obstacle: MovingObstacle, theme: Theme) -> None:
    ring, hollow = np.asarray(obstacle.polygon.exterior.coords), bool(obstacle.polygon.interiors)
    fill: Any = {"facecolor": "none" if hollow else tone(theme.moving_obstacle)}
    shape = Polygon(ring, edgecolor=tone(theme.obstacle_edge), linewidth=1.4, zorder=2.1, **fill)
    axes.add_patch(shape)
    shape.set_clip_path(Polygon(environment.region.vertices, transform=axes.transData))
    axes.plot(*obstacle.path.T, zorder=2.2, **_path_style(theme))
    half = 0.5 * _ARROW * obstacle.heading
    origin, one = _in_points(axes, np.eye(2)[::-1])
    half /= abs(float(one[0] - origin[0]))
    arrow: Any = {"arrowstyle": "-|>", "linewidth": 1.4, "shrinkA": 0.0, "shrinkB": 0.0}
    arrow["color"] = tone(theme.ink)
    begin, end = (obstacle.middle - half).tolist(), (obstacle.middle + half).tolist()
    axes.annotate("", xy=end, xytext=begin, arrowprops=arrow, zorder=2.3)


def draw_run(axes: Axes, record: Record, theme: Theme, colors: ColorScheme) -> None:
    draw_map(axes, record.environment, theme, time=float(record.time[-1]))
    last, n = record.positions[-1], record.positions.shape[1]
    working, there = np.flatnonzero(record.working[-1]), np.flatnonzero(record.present[-1])
    cells = record.cells()
    outlines, owners = cells.outlines
    hues = choose_robot_hues(n, working[cells.adjacency])
    paper = colors == "paper"
    tint = theme.paper_tint if paper else theme.tint
    areas = [k for k, outline in enumerate(outlines) if len(outline) > 2]
    style: Any = {"edgecolors": tone(theme.cell_edge), "linewidths": 0.8, "zorder": 1}
    own = [theme.robots[hue] for hue in hues[working[owners[areas]]].tolist()]
    style["facecolors"] = [tone(mix(theme.background, color, tint)) for color in own]
    axes.add_collection(PolyCollection([outlines[k] for k in areas], **style), autolim=False)
    ways = [record.positions[record.present[:, robot], robot] for robot in range(n)]
    style = {"capstyle": "round", "joinstyle": "round", "zorder": 4, "linewidths": 1.6 * line_crowding(n)}
    style["colors"] = [tone(color) for color in choose_trail_colors(theme, hues.tolist(), colors)]
    axes.add_collection(LineCollection(ways, **style), autolim=False)
    # of one that joins, where it does
    begin = record.positions[np.argmax(record.present, axis=0), np.arange(n)][there]
    axes.plot(*begin.T, zorder=5, **_start_style(theme, mark_size(_in_points(axes, begin), 3.2, _START)))
    own = [theme.final if paper else theme.robots[hue] for hue in hues.tolist()]
    failed = record.present[-1] & ~record.working[-1]
    robots = [theme.failed_robot if failed[robot] else own[robot] for robot in there.tolist()]
    drawn = draw_robots(axes, last[there], record.team.radius[there], robots, theme, (there + 1).tolist())
    if record.steering is not None:
        # where robots face, triangles at their discs
        radii, inches = dict(zip(there.tolist(), drawn, strict=True)), figure_of(axes).dpi_scale_trans
        for robot in working[record.team.is_unicycle[working]].tolist():
            heading, off = record.steering[-1, robot, 0], 1.25 * radii[robot] / 72.0
            shift = ScaledTranslation(off * np.cos(heading), off * np.sin(heading), inches)
            style = {"transform": axes.transData + shift, "zorder": 6, "clip_on": False, "ls": ""}
            style |= {"marker": (3, 0, float(np.degrees(heading)) - 90.0), "ms": 0.9 * radii[robot]}
            axes.plot(*last[robot], mec="none", c=tone(theme.ink), **style)
    if has_goals(record):
        radius = np.array(drawn)[np.searchsorted(there, working)]
        aims = record.goals[-1][working]
        plus = are_centroids(aims, cells.centroid)
        aims = cells.centroid if plus else aims
        places = _in_points(axes, aims)
        away = np.hypot(*(places - _in_points(axes, last[working])).T)
        apart = mark_size(places[np.isfinite(away)], 3.2, _AIM)
        # where a robot has arrived, only the ends of the cross would stick out from under its disc
        axes.plot(*aims[away > radius].T, zorder=6, **_aim_style(plus, theme, apart))


def draw_robots(
    axes: Axes,
    places: Array,
    radius: Array,
    fills: Sequence[Color],
    theme: Theme,
    numbers: Sequence[int] | None = None,
) -> list[float]:
    """Draw robots at (n, 2) m as discs with numbers, 1, 2, 3 by default; return their radii in points."""
    unit = _in_points(axes, np.array([[0.0, 0.0], [1.0, 0.0]]))
    true = radius * float(unit[1, 0] - unit[0, 0])
    # readable where there is room, in a crowd down to true size
    drawn: list[float] = fitted_radii(_in_points(axes, places), true, _SMALLEST_DISC, _DISC).tolist()
    style: Any = {"c": [tone(fill) for fill in fills], "edgecolors": tone(theme.robot_ring)}
    style |= {"s": [(2 * r) ** 2 for r in drawn], "linewidths": [min(1.1, 0.25 * r) for r in drawn]}
    axes.scatter(*places.T, zorder=7, clip_on=False, **style)
    numbers = range(1, len(places) + 1) if numbers is None else numbers
    style = {"fontweight": "bold", "ha": "center", "va": "center_baseline", "zorder": 8}
    for robot, (x, y), r, fill in zip(numbers, places.tolist(), drawn, fills, strict=True):
        size = r * (1.25, 1.1, 0.85, 0.65)[min(len(str(robot)), 4) - 1]
        if size >= _SMALLEST_NUMBER:
            axes.text(x, y, str(robot), fontsize=size, color=tone(choose_text_color(fill)), **style)
    return drawn


def _in_points(axes: Axes, places: Array) -> Array:
    """Return where (n, 2) m places are drawn, in points."""
    axes.apply_aspect()
    return np.asarray(axes.transData.transform(places)) * (72 / axes.figure.dpi)


def has_goals(record: Record) -> bool:
    return bool(np.isfinite(record.goals[-1]).any())


def _start_style(theme: Theme, size: float) -> dict[str, Any]:
    style = {"linestyle": "none", "marker": "o", "markersize": size, "markerfacecolor": "none"}
    return style | {"markeredgecolor": tone(theme.start), "markeredgewidth": min(1.5, 0.25 * size)}


def _aim_style(plus: bool, theme: Theme, size: float) -> dict[str, Any]:
    if plus:
        style = {"label": CENTROID, "marker": "+", "markersize": size, "markeredgecolor": tone(theme.ink)}
        return style | {"linestyle": "none", "markeredgewidth": min(1.2, 0.2 * size)}
    style = {"label": GOAL, "marker": "x", "markersize": 0.8 * size, "markeredgecolor": tone(theme.final)}
    return style | {"linestyle": "none", "markeredgewidth": min(1.6, 0.2 * size)}


def label_of(handle: Artist) -> str:
    return str(handle.get_label())


def map_handles(environment: Environment, theme: Theme, *, density: bool = True) -> list[Artist]:
    handles: list[Artist] = [Line2D([], [], color=tone(theme.boundary), linewidth=1.6, label="known region")]
    if not environment.blocked.is_empty:
        handles.append(Patch(label="obstacle (unknown to robots)", **_static_style(theme)))
    if environment.has_moving_obstacles:
        mark: Any = {"marker": "s", "markersize": 7.0, "markerfacecolor": tone(theme.moving_obstacle)}
        mark["markeredgecolor"] = tone(theme.obstacle_edge)
        handles.append(Line2D([], [], label="moving obstacle and its path", **mark, **_path_style(theme)))
    if density and (words := density_label(environment)):
        color = mix(theme.background, theme.density, 0.7 * theme.density_strength)
        handles.append(Patch(facecolor=tone(color), linewidth=0.0, label=words))
    return handles


def robot_handle(label: str, fill: Color, theme: Theme) -> Artist:
    style: Any = {"markerfacecolor": tone(fill), "markeredgecolor": tone(theme.robot_ring)}
    return Line2D([], [], label=label, linestyle="none", marker="o", markersize=8.0, **style)


def run_handles(record: Record, theme: Theme, colors: ColorScheme) -> list[Artist]:
    paper, n = colors == "paper", record.positions.shape[1]
    failed = record.present[-1] & ~record.working[-1]
    line = choose_trail_colors(theme, list(range(n)), colors)[0]
    aims: list[Artist] = []
    if has_goals(record):
        plus = are_centroids(record.goals[-1][record.working[-1]], record.cells().centroid)
        aims = [Line2D([], [], **_aim_style(plus, theme, _AIM))]
    return [
        Line2D([], [], label="start", **_start_style(theme, _START)),
        Line2D([], [], color=tone(line), linewidth=1.6, label="trajectory"),
        robot_handle("final position", theme.final if paper else theme.robots[0], theme),
        *([robot_handle("failed robot", theme.failed_robot, theme)] if failed.any() else []),
        *aims,
        Line2D([], [], color=tone(theme.cell_edge), linewidth=0.9, label="final Voronoi cell"),
        *map_handles(record.environment, theme)[1:],
    ]
