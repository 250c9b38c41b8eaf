"""Maps drawn with matplotlib: density, obstacles, moving obstacles and boundary."""

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Polygon
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator

from robocov.environment import Environment
from robocov.typing import FloatArray
from robocov_app.figures.page import POINTS_PER_INCH, get_figure, to_plot_color
from robocov_app.look import legend
from robocov_app.look.axes import TICK_FACTORS
from robocov_app.look.colors import mix
from robocov_app.look.theme import Theme
from robocov_app.render.density_shading import shade_density
from robocov_app.render.density_text import describe_density
from robocov_app.render.moving_obstacles import MovingObstacle, list_moving_obstacles

_ARROW_PT = 16.0
"""Length of the arrow on a moving obstacle."""
_OBSTACLE_WIDTH_PT = 0.8
_PATH_WIDTH_PT = 0.8
_MOVING_WIDTH_PT = 1.4
LINE_WIDTH_PT = 1.6
"""Width of the boundary of the known region, and of trajectories of a small team."""

# Drawing order, from the bottom to the top. Elements of runs are between and above these.
_DENSITY_ORDER = 1.5
_OBSTACLES_ORDER = 2
_MOVING_ORDER = 2.1
_PATHS_ORDER = 2.2
_ARROWS_ORDER = 2.3
_BOUNDARY_ORDER = 3
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
    axes: Axes, environment: Environment, theme: Theme, *, show_density: bool = True, time: float = 0.0
) -> None:
    """Draw a map: its density, obstacles at rest, moving obstacles and boundary.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes that show the map in meters.
    environment : Environment
    theme : Theme
    show_density : bool
        Whether to draw the density.
    time : float, s
        Time at which moving obstacles are drawn.
    """
    if show_density and describe_density(environment):
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
        linewidth=LINE_WIDTH_PT,
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
    half_arrow = 0.5 * _ARROW_PT * obstacle.heading / compute_points_per_meter(axes)
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


def compute_points_per_meter(axes: Axes) -> float:
    """Return the length on the page of a meter of the map, in points (1/72 inch)."""
    ends = to_points(axes, np.array([[0.0, 0.0], [1.0, 0.0]]))
    return abs(float(ends[1, 0] - ends[0, 0]))


def to_points(axes: Axes, positions: FloatArray) -> FloatArray:
    """Convert positions, (n, 2) m, to coordinates on the page in points (1/72 inch)."""
    # The transformation is only valid once the aspect has been applied.
    axes.apply_aspect()
    return np.asarray(axes.transData.transform(positions)) * (POINTS_PER_INCH / get_figure(axes).dpi)


def to_meters(axes: Axes, points: FloatArray) -> FloatArray:
    """Convert coordinates on the page in points, (n, 2), to positions, m."""
    axes.apply_aspect()
    pixels = points * (get_figure(axes).dpi / POINTS_PER_INCH)
    return np.asarray(axes.transData.inverted().transform(pixels))


def get_label(handle: Artist) -> str:
    """Return the text of an entry of a legend."""
    return str(handle.get_label())


def build_map_handles(
    environment: Environment, theme: Theme, *, show_boundary: bool = True, show_density: bool = True
) -> list[Artist]:
    """Build the legend entries for the elements that `draw_map` draws."""
    handles: list[Artist] = []
    if show_boundary:
        color = to_plot_color(theme.boundary)
        handles.append(Line2D([], [], color=color, linewidth=LINE_WIDTH_PT, label=legend.KNOWN_REGION))
    if not environment.static.blocked.is_empty:
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
    if show_density and density:
        # A medium density, since the legend has a single color for the gradient.
        medium = mix(theme.background, theme.density, 0.7 * theme.density_strength)
        handles.append(Patch(facecolor=to_plot_color(medium), linewidth=0.0, label=density))
    return handles
