"""The application as the library's `robocov.drawing.DrawingBackend`: matplotlib, and what notebooks show."""

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

from robocov.controllers.gains import get_gain_values
from robocov.controllers.individual import unwrap_controller
from robocov.cost import CoverageResult
from robocov.defaults import DEFAULT_LATTICE
from robocov.environment import Environment
from robocov.errors import ParameterError, RobocovError, format_count, quote
from robocov.mapfile import save_map
from robocov.metrics import CostHistory, compute_cost_history
from robocov.record import Record
from robocov.scenario import Comparison, Scenario
from robocov.simulation import Simulation
from robocov.team import Team
from robocov.text import escape_controls
from robocov_app.figures.files import figure_png
from robocov_app.render.camera import length_label, round_length
from robocov_app.render.density import mean_label
from robocov_app.render.distance_field import Field, FieldLattice
from robocov_app.render.theme import LIGHT, Theme
from robocov_app.report.pictures import Frame, map_picture
from robocov_app.report.replay import ReplayRun, asset, replay_html
from robocov_app.report.theme_css import theme_rules
from robocov_app.runs.cost import MIN_FIGURE_LATTICE, build_cost
from robocov_app.web.live import LiveWindow

if TYPE_CHECKING:  # pages of HTML need no matplotlib
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COST_SAMPLES = 120  # at so many moments of the run it is evaluated, at the most
COST_VERTICES = 2500  # of the free space, up to which it is shown: beyond, notebooks would wait for seconds

_MAP_SIZE = 640.0, 420.0  # largest width and height of a map in a notebook, in pixels
_REPLAY_SIZE = 760.0, 520.0  # the same of the map of a replay; the whole is not narrower than its controls
_CONTROLS = 520.0  # width at which the controls of a replay are beside each other, in pixels

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


def plot_environment(environment: Environment, axes: Axes | None = None, **options: Any) -> Axes:
    """Plot a map, and return its axes; see `robocov_app.figures.runs.plot_environment`."""
    return _plotted("plot_environment", environment, axes, options)


def plot_record(record: Record, axes: Axes | None = None, **options: Any) -> Axes:
    """Plot a run, and return its axes; see `robocov_app.figures.runs.plot_trajectories`."""
    return _plotted("plot_trajectories", record, axes, options)


def plot_history(
    history: CostHistory,
    axes: Axes | None = None,
    *,
    label: str = "at the end",
    controller: str = "",
    **options: Any,
) -> Axes:
    """Plot the mean distance against time, and return the axes; see `robocov_app.figures.runs.plot_cost`."""
    return _plotted("plot_cost", [(label, controller, history.time, history.mean_distance)], axes, options)


def plot_result(
    result: CoverageResult,
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    size: tuple[int, int] | None = None,
    radius: ArrayLike | None = None,
) -> Axes:
    """Plot the distance of every place to its nearest robot; see `robocov_app.figures.coverage`.

    A lattice too coarse for a picture is replaced by a finer one. Raises ParameterError without a map.
    """
    from robocov_app.figures.coverage import Moment, plot_coverage, plot_distances

    _checked(axes)
    environment, sites, n = result.environment, result.sites, len(result.positions)
    if environment is None or sites is None:
        raise ParameterError("result: it does not know its map; expected one that a CoverageCost returned")
    team = Team.homogeneous(n)
    if radius is not None:
        team = replace(team, radius=np.broadcast_to(np.asarray(radius, dtype=float), (n,)))
    facts = f"{format_count(n, 'robot')}, {mean_label(environment)} {result.mean_distance:.3f} m"
    if sites.lattice < MIN_FIGURE_LATTICE:
        finer = build_cost(environment, MIN_FIGURE_LATTICE, quiet=True)
        sites, result = finer.sites, finer(result.positions)
    moment = Moment(environment, team, Field(FieldLattice(sites), result), environment.name, facts)
    if axes is None:
        return plot_coverage([], [moment], theme, size, "Coverage cost").axes[-1]
    plot_distances(moment, axes, theme)
    return axes


def plot_comparison(
    comparison: Comparison,
    axes: Axes | None = None,
    *,
    theme: Theme | str = LIGHT,
    colours: str = "paper",
    size: tuple[int, int] | None = None,
) -> Axes:
    """Plot the runs of a comparison side by side.

    Parameters
    ----------
    comparison : Comparison
    axes : None
        A comparison needs a page of its own.
    theme : {"light", "dark"}
    colours : {"paper", "robots"}
    size : (width, height) or None, px
        Size of the page.

    Returns
    -------
    matplotlib.axes.Axes
        The axes of the last panel.

    Raises
    ------
    ParameterError
        If axes are given.
    """
    from robocov_app.figures import runs

    if axes is not None:
        raise ParameterError("axes: expected None, because a comparison has one panel for each run")
    figure = runs.plot_comparison(
        list(comparison.records.values()),
        theme,
        colours,
        size,
        mean_distances=[float(history.mean_distance[-1]) for history in comparison.histories.values()],
    )
    return figure.axes[-1]


def environment_html(environment: Environment) -> str:
    """Return a map with its facts and a scale bar, in light or dark as the notebook is."""
    low_x, low_y, high_x, high_y = environment.region.bounds
    width, height = high_x - low_x, high_y - low_y
    frame, bar = Frame(environment, *_MAP_SIZE), round_length(width / 5)
    left, right = frame.at(np.array([[low_x, low_y], [low_x + bar, low_y]]))[:, 0] / (frame.width / 100)
    starts = ", ".join(environment.starts) or "uniform"
    facts = (
        f"{width:.4g} × {height:.4g} m, {environment.free_area:.4g} m² free, "
        f"{format_count(len(environment.obstacles), 'obstacle')}; "
        f"start{'s' if len(environment.starts) > 1 else ''} {starts}"
    )
    return escape_controls(
        f"<style>{theme_rules('.robocov-map')}{asset('picture.css')}{_MAP_CSS}</style>"
        f'<figure class="robocov-map" style="max-width:{frame.width + 24:.0f}px">'
        f"<figcaption><b>{escape(environment.name)}</b> {escape(facts)}</figcaption>"
        f"{map_picture(environment, *_MAP_SIZE)}"
        f'<div class="robocov-scale"><i style="margin-left:{left:.2f}%;width:{right - left:.2f}%"></i>'
        f"{length_label(bar)}</div>"
        f"</figure>"
    )


def environment_png(environment: Environment) -> bytes:
    return _page_png(plot_environment(environment))


def record_html(record: Record) -> str:
    """Return a replay of a run, with its cost where that does not take long."""
    run = ReplayRun(record, _history_to_show(record), f"{record.label} on {record.environment.name}")
    width = max(Frame(record.environment, *_REPLAY_SIZE).width, _CONTROLS)
    begin = f'<style>{_RUN_CSS}</style><div class="robocov-run" style="max-width:{width:.0f}px">'
    return f"{begin}{replay_html([run])}</div>"


def comparison_html(comparison: Comparison) -> str:
    """Return a replay of the runs of a comparison, side by side, with their costs."""
    runs = []
    for label, record in comparison.records.items():
        run = ReplayRun(
            record, comparison.histories[label], f"{label} on {record.environment.name}", label=label
        )
        runs.append(run)
    return f'<style>{_RUN_CSS}</style><div class="robocov-run">{replay_html(runs)}</div>'


def comparison_png(comparison: Comparison) -> bytes:
    """Return the picture of a comparison for notebooks that display no HTML."""
    return _page_png(plot_comparison(comparison))


def _history_to_show(record: Record) -> CostHistory | None:
    if shapely.get_num_coordinates(record.environment.free) > COST_VERTICES:
        return None
    span = float(record.time[-1] - record.time[0])
    rate = min(COST_SAMPLES / span, 10.0) if span > 0.0 else 0.0
    try:
        return compute_cost_history(record, build_cost(record.environment, DEFAULT_LATTICE, quiet=True), rate)
    except RobocovError:  # a map without a free site, a robot in an obstacle
        return None


def record_png(record: Record) -> bytes:
    return _page_png(plot_record(record))


def show(
    map: str | Path | Environment | Simulation,  # noqa: A002 - as everywhere else
    *,
    robots: int = 6,
    controllers: Sequence[str] = ("rapf",),
    seed: int = 0,
    height: int = 620,
) -> LiveWindow | Record:
    """Return the interactive window of a map, live; without ``robocov[web]`` a replay of one minute.

    Of a simulation, the others but `height` are as there: the team begins where it is, and goes on beside it.
    """
    here = find_spec("websockets") is not None
    if isinstance(map, Simulation):
        return _live(map, height) if here else map.copy().run(60.0)
    if not here:
        return Scenario(map, controllers[0], robots=robots, seed=seed).run()
    options = ["--robots", str(robots), "--seed", str(seed), "--controllers", *controllers]
    if not isinstance(map, Environment):
        return LiveWindow(["demo", str(map), *options], height)
    with TemporaryDirectory() as folder:  # the window has read it when it is there
        file = Path(folder) / "map.json"
        save_map(map, file)
        return LiveWindow(["demo", str(file), *options], height)


def _live(simulation: Simulation, height: int) -> LiveWindow:
    from robocov_app.viewer.session.file import save_session
    from robocov_app.viewer.session.scenario import ControllerChoice, Scenario, TeamSpec
    from robocov_app.viewer.session.session import Session

    law, team = simulation.controller, simulation.team
    choice = (ControllerChoice(law.name, get_gain_values(unwrap_controller(law))),)
    now = simulation.positions, simulation.velocities, simulation.conditions
    given = simulation.environment, choice, len(team), None, 0, TeamSpec.of(team), simulation.dt
    session = Session(Scenario(*given, *now))
    with TemporaryDirectory() as folder:
        file = Path(folder) / "simulation.robocov"
        save_session(file, session.document, session.head, 0, {})
        return LiveWindow(["demo", str(file)], height)


def _page_png(axes: Any) -> bytes:
    return figure_png(axes.figure)


def _checked(axes: Any) -> Any:
    """Return axes on which a plot can be drawn, or None; raises ParameterError for any others."""
    from matplotlib.axes import Axes

    flat = isinstance(axes, Axes) and axes.transData.is_separable and not hasattr(axes, "get_zlim")
    if axes is not None and not flat:
        raise ParameterError(f"axes: expected one matplotlib Axes with straight x and y, got {quote(axes)}")
    return axes


def _plotted(function: str, thing: Any, axes: Axes | None, options: dict[str, Any]) -> Axes:
    """Return the axes on which a function of `robocov_app.figures.runs` has drawn: the given ones, or new."""
    from robocov_app.figures import runs

    figure: Figure = getattr(runs, function)(thing, _checked(axes), **options)
    return figure.axes[-1] if axes is None else axes
