"""The application's `robocov.drawing.DrawingBackend`: matplotlib figures, and HTML for notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from html import escape
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from robocov.controllers import CONTROLLERS
from robocov.controllers.gains import get_gain_values
from robocov.controllers.individual import unwrap_controller
from robocov.cost import CoverageResult
from robocov.defaults import DEFAULT_CONTROLLER, DEFAULT_LATTICE, DEFAULT_ROBOTS
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError, format_area, format_count, quote
from robocov.mapfile import save_map
from robocov.metrics import CostHistory, compute_cost_history
from robocov.record import Record
from robocov.scenario import Comparison, Scenario
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.text import escape_controls
from robocov_app.figures.files import render_png
from robocov_app.look.hues import ColorScheme
from robocov_app.look.lengths import format_scale_length, round_down
from robocov_app.look.theme import LIGHT, Theme
from robocov_app.render.density_text import get_cost_name
from robocov_app.render.distance_map.pixel_distances import DistanceField
from robocov_app.render.distance_map.site_lattice import FieldLattice
from robocov_app.report.embedding import ReplayRun
from robocov_app.report.pictures import PictureFrame, draw_map
from robocov_app.report.replay import build_replay_html, read_asset
from robocov_app.report.theme_css import build_theme_rules
from robocov_app.runs.cost import MIN_FIGURE_LATTICE, build_cost
from robocov_app.web.notebook_window import LiveWindow

if TYPE_CHECKING:
    # Pages of HTML need no matplotlib.
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_COST_SAMPLES = 120
"""Maximum number of time steps at which the cost of a displayed run is computed."""
MAX_COST_RATE_HZ = 10.0
"""Maximum number of such time steps per simulated second."""
MAX_COST_VERTICES = 2500
"""Maximum number of vertices of a map whose cost is displayed; larger maps would make notebooks slow."""
FALLBACK_DURATION_S = 60.0
"""Simulated time of the replay that is shown if a live window is not available."""

_MAX_MAP_SIZE_PX = (640.0, 420.0)
"""Maximum width and height of a map in a notebook."""
_MAX_REPLAY_MAP_SIZE_PX = (760.0, 520.0)
"""Maximum width and height of the map in a replay."""
_MIN_REPLAY_WIDTH_PX = 520.0
"""Minimum width of a replay, at which its controls fit next to each other."""

_MAP_CSS = """
.robocov-map { margin: 0; padding: 12px; box-sizing: border-box; border-radius: 6px;
  background: var(--rc-background); color: var(--rc-ink); font: 13px/1.4 system-ui, sans-serif; }
.robocov-map figcaption { margin: 0 0 8px; color: var(--rc-faint); }
.robocov-map figcaption b { color: var(--rc-ink); margin-right: .6em; }
.robocov-scale { display: flex; align-items: center; gap: 8px; margin-top: 6px; font-weight: 600; }
.robocov-scale i { box-sizing: border-box; height: 7px; border: solid; border-width: 0 1.4px 1.4px; }
"""

_RUN_CSS = """
.robocov-run .robocov-replay { padding: 12px; box-sizing: border-box; border-radius: 6px; }
"""


def plot_environment(
    environment: Environment,
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
) -> Axes:
    """Plot a map.

    Parameters
    ----------
    environment : Environment
        The map.
    axes : matplotlib.axes.Axes or None
        Axes to draw on; by default those of a new page.
    theme : {"light", "dark"}
        Color theme.
    size : (width, height) or None, px
        Size of the page.

    Returns
    -------
    matplotlib.axes.Axes
        The axes with the plot.

    Raises
    ------
    ParameterError
        If the axes, the theme or the size cannot be used.
    """
    from robocov_app.figures.map_pages import plot_environment as plot_map

    _check_axes(axes)
    return _get_axes(plot_map(environment, axes, theme=theme, size=size), axes)


def plot_record(
    record: Record,
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    colors: ColorScheme = "robots",
    size: tuple[int, int] | None = None,
    mean_distance: float | None = None,
    mean_time: float | None = None,
) -> Axes:
    """Plot the trajectories of a run, and its final cells.

    Parameters
    ----------
    record : Record
        The run.
    axes : matplotlib.axes.Axes or None
        Axes to draw on; by default those of a new page.
    theme : {"light", "dark"}
        Color theme.
    colors : {"robots", "paper"}
        A hue for each robot, or the colors of the paper.
    size : (width, height) or None, px
        Size of the page.
    mean_distance, mean_time : float or None, m, s
        Costs of the final positions, for the title of the page.

    Returns
    -------
    matplotlib.axes.Axes
        The axes with the plot.

    Raises
    ------
    ParameterError
        If the axes or an option cannot be used.
    """
    from robocov_app.figures.map_pages import plot_trajectories

    _check_axes(axes)
    figure = plot_trajectories(
        record,
        axes,
        theme=theme,
        colors=colors,
        size=size,
        mean_distance=mean_distance,
        mean_time=mean_time,
    )
    return _get_axes(figure, axes)


def plot_history(
    history: CostHistory,
    axes: Axes | None = None,
    *,
    label: str = "at the end",
    controller: str = "",
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    title: str = "Mean distance over time",
) -> Axes:
    """Plot the mean distance against time.

    Parameters
    ----------
    history : CostHistory
        The coverage cost over a run.
    axes : matplotlib.axes.Axes or None
        Axes to draw on; by default those of a new page.
    label : str
        Label at the end of the curve.
    controller : str
        Name of the controller, which determines the color of the curve.
    theme : {"light", "dark"}
        Color theme.
    size : (width, height) or None, px
        Size of the page.
    title : str
        Title of the page.

    Returns
    -------
    matplotlib.axes.Axes
        The axes with the plot.

    Raises
    ------
    ParameterError
        If the axes, the theme or the size cannot be used, or the history has no finite value.
    """
    from robocov_app.figures.cost_curves import plot_cost
    from robocov_app.figures.curves import TimeCurve

    _check_axes(axes)
    curve = TimeCurve(label, controller, history.time, history.mean_distance)
    return _get_axes(plot_cost([curve], axes, theme=theme, size=size, title=title), axes)


def plot_result(
    result: CoverageResult,
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    radius: ArrayLike | None = None,
) -> Axes:
    """Plot the distance of every point to its nearest robot.

    If the lattice is too coarse for an image, the cost is computed again on a finer lattice.

    Parameters
    ----------
    result : CoverageResult
        The result, which must contain its map.
    axes : matplotlib.axes.Axes or None
        Axes to draw on; by default those of a new page.
    theme : {"light", "dark"}
        Color theme.
    size : (width, height) or None, px
        Size of the page.
    radius : float or (n,) array or None, m
        Radii of the robots.

    Returns
    -------
    matplotlib.axes.Axes
        The axes with the plot.

    Raises
    ------
    ParameterError
        If the axes, the theme or the size cannot be used, or the result has no map.
    """
    from robocov_app.figures.coverage import DistanceSnapshot, plot_coverage, plot_distances

    _check_axes(axes)
    environment = result.environment
    sites = result.sites
    if environment is None or sites is None:
        raise ParameterError("result: expected a result with its map, as a CoverageCost returns it, got none")
    robots = len(result.positions)
    team = Team.homogeneous(robots)
    if radius is not None:
        team = replace(team, radius=np.broadcast_to(np.asarray(radius, dtype=float), (robots,)))
    facts = f"{format_count(robots, 'robot')}, {get_cost_name(environment)} {result.mean_distance:.3f} m"
    if sites.lattice < MIN_FIGURE_LATTICE:
        finer_cost = build_cost(environment, MIN_FIGURE_LATTICE, radius=result.radius, quiet=True)
        sites = finer_cost.sites
        result = finer_cost(result.positions)
    field = DistanceField(FieldLattice(sites), result)
    snapshot = DistanceSnapshot(environment, team, field, environment.name, facts)
    if axes is None:
        return plot_coverage([], [snapshot], theme=theme, size=size).axes[-1]
    plot_distances(snapshot, axes, theme)
    return axes


def plot_comparison(
    comparison: Comparison,
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    colors: ColorScheme = "robots",
    size: tuple[int, int] | None = None,
) -> Axes:
    """Plot the runs of a comparison side by side.

    Parameters
    ----------
    comparison : Comparison
        The runs.
    axes : None
        A comparison is always drawn on a new page.
    theme : {"light", "dark"}
        Color theme.
    colors : {"robots", "paper"}
        A hue for each robot, or the colors of the paper.
    size : (width, height) or None, px
        Size of the page.

    Returns
    -------
    matplotlib.axes.Axes
        The axes of the last panel.

    Raises
    ------
    ParameterError
        If axes are given, or the size cannot be used.
    """
    from robocov_app.figures import comparisons

    if axes is not None:
        raise ParameterError("axes: expected None, because a comparison has one panel for each run")
    mean_distances = [float(history.mean_distance[-1]) for history in comparison.histories.values()]
    records = list(comparison.records.values())
    figure = comparisons.plot_comparison(
        records, theme=theme, colors=colors, size=size, mean_distances=mean_distances
    )
    return figure.axes[-1]


def render_environment_html(environment: Environment) -> str:
    """Return the HTML of a map with its properties and a scale bar, in the theme of the notebook."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    width = high_x - low_x
    frame = PictureFrame(environment, *_MAX_MAP_SIZE_PX)
    bar_length = round_down(width / 5)
    bar_ends = np.array([[low_x, low_y], [low_x + bar_length, low_y]])
    # The ends are in percent of the width, so that the bar keeps its scale if the page shrinks the map.
    left, right = frame.to_pixels(bar_ends)[:, 0] / (frame.width / 100)
    starts = ", ".join(environment.starts) or "uniform"
    facts = (
        f"{width:.4g} × {high_y - low_y:.4g} m, {format_area(environment.free_area)} free, "
        f"{format_count(len(environment.obstacles), 'obstacle')}; "
        f"start{'s' if len(environment.starts) > 1 else ''} {starts}"
    )
    return escape_controls(
        f"<style>{build_theme_rules('.robocov-map')}{read_asset('picture.css')}{_MAP_CSS}</style>"
        f'<figure class="robocov-map" style="max-width:{frame.width + 24:.0f}px">'
        f"<figcaption><b>{escape(environment.name)}</b> {escape(facts)}</figcaption>"
        f"{draw_map(environment, *_MAX_MAP_SIZE_PX)}"
        f'<div class="robocov-scale"><i style="margin-left:{left:.2f}%;width:{right - left:.2f}%"></i>'
        f"{format_scale_length(bar_length)}</div>"
        f"</figure>"
    )


def render_environment_png(environment: Environment) -> bytes:
    """Return the image of a map, for notebooks that display no HTML."""
    return _export_png(plot_environment(environment))


def render_record_html(record: Record) -> str:
    """Return the HTML of a replay of a run, with its cost if that can be computed quickly."""
    run = ReplayRun(record, _compute_history(record), f"{record.label} on {record.environment.name}")
    map_width = PictureFrame(record.environment, *_MAX_REPLAY_MAP_SIZE_PX).width
    width = max(map_width, _MIN_REPLAY_WIDTH_PX)
    return (
        f'<style>{_RUN_CSS}</style><div class="robocov-run" style="max-width:{width:.0f}px">'
        f"{build_replay_html([run])}</div>"
    )


def render_record_png(record: Record) -> bytes:
    """Return the image of a run, for notebooks that display no HTML."""
    return _export_png(plot_record(record))


def render_comparison_html(comparison: Comparison) -> str:
    """Return the HTML of a replay of the runs of a comparison, side by side, with their costs."""
    runs = []
    for label, record in comparison.records.items():
        title = f"{label} on {record.environment.name}"
        runs.append(ReplayRun(record, comparison.histories[label], title, label=label))
    return f'<style>{_RUN_CSS}</style><div class="robocov-run">{build_replay_html(runs)}</div>'


def render_comparison_png(comparison: Comparison) -> bytes:
    """Return the image of a comparison, for notebooks that display no HTML."""
    return _export_png(plot_comparison(comparison))


def _compute_history(record: Record) -> CostHistory | None:
    """Compute the cost of a run; return None if that would take too long, or is impossible."""
    if shapely.get_num_coordinates(record.environment.free) > MAX_COST_VERTICES:
        return None
    duration = float(record.time[-1] - record.time[0])
    rate = min(MAX_COST_SAMPLES / duration, MAX_COST_RATE_HZ) if duration > 0.0 else 0.0
    try:
        cost = build_cost(record.environment, DEFAULT_LATTICE, radius=record.team.min_radius, quiet=True)
        return compute_cost_history(record, cost, rate)
    except RobocovError:
        # The lattice may have no free site, or a robot may be in an obstacle.
        return None


def show(
    map: str | Path | Environment | Simulation,  # noqa: A002 - The parameter has this name in all functions.
    *,
    robots: int = DEFAULT_ROBOTS,
    controllers: str | Sequence[str] = (DEFAULT_CONTROLLER,),
    seed: int = 0,
    height: int = 620,
) -> LiveWindow | Record:
    """Show the interactive window of a map in a notebook.

    Parameters
    ----------
    map : str, Path, Environment or Simulation
        Name of a bundled map, a file, the map itself, or a simulation. The window does not change the
        simulation: see `robocov.Simulation.show` for the state from which it starts.
    robots : int
        Number of robots; ignored for a simulation.
    controllers : str or sequence of str
        Name of the controller, or names of several; ignored for a simulation.
    seed : int
        Seed of the starting positions; ignored for a simulation.
    height : int, px
        Height of the window.

    Returns
    -------
    LiveWindow or Record
        The window or, if ``robocov[web]`` is not installed, the record of a run of one minute under the first
        controller. For a simulation, the record of its next minute.

    Raises
    ------
    ParameterError
        If there are no controllers, or if the window cannot show a simulation, because its controller is not
        built in, its obstacles have moved, or no robot works.
    RobocovError
        If the window cannot start.
    """
    has_web = find_spec("websockets") is not None
    if isinstance(map, Simulation):
        return _show_simulation(map, height) if has_web else map.copy().run(FALLBACK_DURATION_S)
    names = (controllers,) if isinstance(controllers, str) else tuple(controllers)
    if not any(names):
        raise ParameterError("controllers: expected at least one, got none")
    if not has_web:
        return Scenario(map, names[0], robots=robots, seed=seed).run()
    options = ["--robots", str(robots), "--seed", str(seed), "--controllers", *names]
    if not isinstance(map, Environment):
        return LiveWindow(["demo", str(map), *options], height)
    # The file can be removed afterwards, because the window has read it when this returns.
    with TemporaryDirectory() as folder:
        file = Path(folder) / "map.json"
        save_map(map, file)
        return LiveWindow(["demo", str(file), *options], height)


def _show_simulation(simulation: Simulation, height: int) -> LiveWindow:
    """Show the window of a session that starts from the state of a simulation."""
    from robocov_app.viewer.session.files.session_file import save_session
    from robocov_app.viewer.session.session import Session
    from robocov_app.viewer.session.setup.controller_choice import ControllerChoice
    from robocov_app.viewer.session.setup.robot_properties import RobotProperties
    from robocov_app.viewer.session.setup.scenario import SessionScenario

    _require_showable(simulation)
    controller = simulation.controller
    gains = get_gain_values(unwrap_controller(controller))
    conditions = simulation.conditions
    if conditions is not None:
        conditions = conditions.advance(simulation.time, len(simulation.team))
    session = Session(
        SessionScenario(
            simulation.environment,
            (ControllerChoice(controller.name, gains),),
            len(simulation.team),
            properties=RobotProperties.from_team(simulation.team),
            dt=simulation.dt,
            given_starts=simulation.positions,
            velocities=simulation.velocities,
            steering=simulation.steering,
            conditions=conditions,
        )
    )
    with TemporaryDirectory() as folder:
        file = Path(folder) / "simulation.robocov"
        save_session(file, session.timeline.document, session.timeline.head, 0, {})
        return LiveWindow(["demo", str(file)], height)


def _require_showable(simulation: Simulation) -> None:
    """Raise a ParameterError if a session cannot start from the state of a simulation."""
    controller = unwrap_controller(simulation.controller)
    if type(controller) is not CONTROLLERS.get(simulation.controller.name):
        expected = "the window can show only simulations with built-in controllers"
        raise ParameterError(f"controller: {expected}, got {type(controller).__name__}")
    if simulation.time > 0.0 and simulation.environment.has_moving_obstacles:
        expected = "the window can show simulations with moving obstacles only at 0 s"
        raise ParameterError(f"simulation: {expected}, got {simulation.time:.2f} s")
    if not simulation.is_working.any():
        raise ParameterError("simulation: expected at least one working robot, got none")


def _check_axes(axes: Any) -> None:
    """Raise a ParameterError unless a plot can be drawn on the axes, or they are None."""
    from matplotlib.axes import Axes

    if axes is None:
        return
    is_planar = isinstance(axes, Axes) and axes.transData.is_separable and not hasattr(axes, "get_zlim")
    if not is_planar:
        raise ParameterError(f"axes: expected one matplotlib Axes with straight x and y, got {quote(axes)}")


def _get_axes(figure: Figure, axes: Axes | None) -> Axes:
    """Return the axes on which a plot was drawn: the given ones, or those of the new page."""
    return figure.axes[-1] if axes is None else axes


def _export_png(axes: Any) -> bytes:
    """Return the PNG file of the figure that contains the axes."""
    return render_png(axes.figure)
