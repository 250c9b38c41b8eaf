"""Plots of final mean distances against gains and parameters of the team."""

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from robocov.controllers.gains import Value, format_value
from robocov.typing import FloatArray, IntArray
from robocov_app.figures.gains import MAX_LEVELS, GainGrid, GainResults, plot_gain_grid, plot_gains
from robocov_app.look.curve_styles import CurveStyle, choose_controller_styles
from robocov_app.report.analysis.groups import RunGroup, find_varying_gains, group_by_controller
from robocov_app.report.analysis.scaling import Scales, compute_medians, scale_distance
from robocov_app.report.plots.plot import (
    FINAL_DISTANCE_LABEL,
    PANEL_SIZE_PX,
    SCALED_DISTANCE_LABEL,
    PagePlot,
)
from robocov_app.report.results.result import ReportedResult, ReportedRun
from robocov_app.report.svg import inline_svg
from robocov_app.sweep.study.parameters import TEXT_PARAMETERS, UNITS

_MAX_MISSING_FRACTION = 0.5
"""If more combinations of two gains are missing, they do not form a grid."""


class _Parameter(NamedTuple):
    """A gain or a parameter of the team that varies in a result.

    Attributes
    ----------
    name : str
    title : str
        Name and unit.
    get_value : callable
        Returns the value of the parameter in a run.
    choices : tuple of str
        Values of the parameter if they are texts; empty if they are numbers.
    """

    name: str
    title: str
    get_value: Callable[[ReportedRun], Value]
    choices: tuple[str, ...] = ()

    def to_coordinate(self, value: Value) -> float:
        """Return the coordinate of a value on an axis: nan for no limit, the index for a text."""
        if value is None:
            return np.nan
        if isinstance(value, str):
            return float(self.choices.index(value))
        return float(value)

    def to_value(self, coordinate: float) -> Value:
        """Return the value at a coordinate; the inverse of `to_coordinate`."""
        if np.isnan(coordinate):
            return None
        if self.choices:
            return self.choices[int(coordinate)]
        return coordinate

    def format_coordinate(self, coordinate: float) -> str:
        """Format the value at a coordinate."""
        return format_value(self.to_value(coordinate), digits=4)


class _DistanceAxis(NamedTuple):
    """An axis of final mean distances.

    Attributes
    ----------
    label : str
    scales : Scales
    """

    label: str
    scales: Scales


def build_parameter_plots(result: ReportedResult, key: str) -> list[PagePlot]:
    """Build the plots of final mean distances against parameters.

    Parameters
    ----------
    result : ReportedResult
    key : str
        Start of the ids in the plots.

    Returns
    -------
    list of PagePlot
        A plot for each gain that varies, then for each parameter of the team that varies, then grids of two
        gains of a controller.
    """
    groups = group_by_controller(result)
    styles = choose_controller_styles(group.controller for group in groups)
    varying_gains = find_varying_gains(result)
    gains = {name: _describe_gain(result, name) for name in varying_gains}
    axis = _choose_axis(result, SCALED_DISTANCE_LABEL, attrgetter("setting"))
    plots: list[PagePlot | None] = []
    for number, (name, controllers) in enumerate(varying_gains.items()):
        gain_groups = [group for group in groups if group.controller in controllers]
        title = name
        if len(gain_groups) == 1:
            title = f"{name} of {gain_groups[0].label}"
        plots.append(_build_plot(gains[name], gain_groups, styles, axis, key=f"{key}-{number}", title=title))
    # A setting includes the team, which varies here, so distances are divided by the median of the map.
    map_axis = _choose_axis(result, "final distance / median of map", attrgetter("map"))
    for number, parameter in enumerate(_list_team_parameters(result)):
        if len({parameter.get_value(run) for run in result.completed_runs}) > 1:
            title = parameter.name.replace("_", " ")
            team_key = f"{key}-team-{number}"
            plots.append(_build_plot(parameter, groups, styles, map_axis, key=team_key, title=title))
    grid_plots: list[PagePlot] = []
    for group in groups:
        group_gains = [gains[name] for name, names in varying_gains.items() if group.controller in names]
        for first, second in combinations(group_gains, 2):
            grid_key = f"{key}-grid-{len(grid_plots) + 1}"
            plot = _build_grid_plot(group, first, second, axis, key=grid_key)
            if plot is not None:
                grid_plots.append(plot)
    return [plot for plot in plots if plot is not None] + grid_plots


def _choose_axis(
    result: ReportedResult, label: str, get_key: Callable[[ReportedRun], object]
) -> _DistanceAxis:
    """Return the axis of final distances.

    Distances are divided by the median of all runs with the same key. If all runs have the same key, they are
    in meters.
    """
    if len({get_key(run) for run in result.completed_runs}) == 1:
        return _DistanceAxis(FINAL_DISTANCE_LABEL, dict.fromkeys(result.completed_runs, 1.0))
    return _DistanceAxis(label, compute_medians(result, get_key))


def _describe_gain(result: ReportedResult, name: str) -> _Parameter:
    """Return a gain as a parameter."""
    values = dict.fromkeys(dict(run.gains).get(name) for run in result.completed_runs)
    return _Parameter(
        name=name,
        title=_add_unit(name, result.gain_units.get(name, "")),
        get_value=lambda run: dict(run.gains)[name],
        choices=tuple(value for value in values if isinstance(value, str)),
    )


def _list_team_parameters(result: ReportedResult) -> list[_Parameter]:
    """Return the number of robots, and the numeric parameters of the team, as parameters."""
    parameters = [_Parameter("robots", "robots", lambda run: run.robots)]
    if result.completed_runs:
        names = [name for name, _ in result.completed_runs[0].team if name not in TEXT_PARAMETERS]
        parameters += [_describe_team_parameter(name) for name in names]
    return parameters


def _describe_team_parameter(name: str) -> _Parameter:
    """Return a parameter of the team."""
    title = _add_unit(name.replace("_", " "), UNITS[name])
    return _Parameter(name, title, lambda run: dict(run.team)[name])


def _add_unit(title: str, unit: str) -> str:
    """Return a title with a unit in parentheses, if there is one."""
    if unit:
        return f"{title} ({unit})"
    return title


def _build_plot(
    parameter: _Parameter,
    groups: Sequence[RunGroup],
    styles: Mapping[str, CurveStyle],
    axis: _DistanceAxis,
    *,
    key: str,
    title: str,
) -> PagePlot | None:
    """Build the plot of distances against a parameter; return None if no distance is known."""
    all_results = []
    for group in groups:
        results = _collect_results(parameter, group, axis.scales, styles[group.controller])
        if len(results.values):
            all_results.append(results)
    if not all_results:
        return None
    figure = plot_gains(all_results, parameter.title, PANEL_SIZE_PX, axis.label, parameter.choices)
    texts = "; ".join(_describe_results(results, parameter) for results in all_results)
    description = f"{axis.label} against {parameter.title}. {texts}."
    return PagePlot(title, inline_svg(figure, key, description))


def _collect_results(
    parameter: _Parameter, group: RunGroup, scales: Scales, style: CurveStyle
) -> GainResults:
    """Collect the finite scaled distances of the runs of a group, and the coordinates of the parameter."""
    coordinates = []
    distances = []
    for run in group.runs:
        distance = scale_distance(run, scales)
        if np.isfinite(distance):
            coordinates.append(parameter.to_coordinate(parameter.get_value(run)))
            distances.append(distance)
    return GainResults(group.label, style, np.array(coordinates), np.array(distances))


def _describe_results(results: GainResults, parameter: _Parameter) -> str:
    """Describe results by the median at each value; if there are many values, by their range and the best."""
    coordinates = np.unique(results.gains)
    if len(coordinates) > MAX_LEVELS:
        low = np.nanmin(results.gains)
        high = np.nanmax(results.gains)
        best = parameter.format_coordinate(results.gains[int(np.argmin(results.values))])
        runs = f"{results.label}, {len(results.values)} runs"
        return f"{runs} from {low:.3g} to {high:.3g}, the lowest value at {best}"
    medians = []
    for coordinate in coordinates.tolist():
        has_value = results.gains == coordinate
        if np.isnan(coordinate):
            has_value = np.isnan(results.gains)
        median = np.median(results.values[has_value])
        medians.append(f"{parameter.format_coordinate(coordinate)}: {median:.3f}")
    return f"{results.label}, medians at {', '.join(medians)}"


def _build_grid_plot(
    group: RunGroup, first: _Parameter, second: _Parameter, axis: _DistanceAxis, *, key: str
) -> PagePlot | None:
    """Build the plot of the median distance for each combination of two gains of a controller.

    Return None if the combinations in the runs do not form a grid.
    """
    known_runs = [run for run in group.runs if np.isfinite(scale_distance(run, axis.scales))]
    distances = np.array([scale_distance(run, axis.scales) for run in known_runs])
    first_values = [first.to_coordinate(first.get_value(run)) for run in known_runs]
    second_values = [second.to_coordinate(second.get_value(run)) for run in known_runs]
    columns, column_indices = np.unique(first_values, return_inverse=True)
    rows, row_indices = np.unique(second_values, return_inverse=True)
    if not (1 < len(columns) <= MAX_LEVELS and 1 < len(rows) <= MAX_LEVELS):
        return None
    medians = _compute_cell_medians(distances, row_indices, column_indices)
    if np.isnan(medians).mean() > _MAX_MISSING_FRACTION:
        return None
    grid = GainGrid(
        column_label=first.title,
        row_label=second.title,
        columns=[first.to_value(coordinate) for coordinate in columns],
        rows=[second.to_value(coordinate) for coordinate in rows],
        values=medians,
    )
    figure = plot_gain_grid(grid, PANEL_SIZE_PX)
    title = f"{group.label}: distance against {first.name} and {second.name}"
    distance_label = SCALED_DISTANCE_LABEL
    if axis.label == FINAL_DISTANCE_LABEL:
        distance_label = "final distance in m"
    span = _describe_grid(medians, first, second, columns, rows)
    return PagePlot(title, inline_svg(figure, key, f"{title}: medians of the {distance_label}, {span}."))


def _compute_cell_medians(
    distances: FloatArray, row_indices: IntArray, column_indices: IntArray
) -> FloatArray:
    """Return the median of the distances in each cell of a grid; nan for cells without runs.

    Parameters
    ----------
    distances : (k,) array
        Final distance of each run.
    row_indices, column_indices : (k,) arrays of int
        Cell of each run.

    Returns
    -------
    (rows, columns) array
    """
    medians = np.full((row_indices.max() + 1, column_indices.max() + 1), np.nan)
    for row, column in set(zip(row_indices.tolist(), column_indices.tolist(), strict=True)):
        is_in_cell = (row_indices == row) & (column_indices == column)
        medians[row, column] = np.median(distances[is_in_cell])
    return medians


def _describe_grid(
    medians: FloatArray, first: _Parameter, second: _Parameter, columns: FloatArray, rows: FloatArray
) -> str:
    """Describe the lowest median and its gains, and the highest median."""
    row, column = np.unravel_index(int(np.nanargmin(medians)), medians.shape)
    first_text = f"{first.title} {first.format_coordinate(columns[column])}"
    second_text = f"{second.title} {second.format_coordinate(rows[row])}"
    low = np.nanmin(medians)
    high = np.nanmax(medians)
    return f"from {low:.3g} at {first_text} and {second_text} to {high:.3g}"
