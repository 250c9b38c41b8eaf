"""What the field measures of single runs, against time: small plots, one for each metric."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robocov.metrics.run_metrics import run_metrics
from robocov_app.figures.results import Band, plot_cost_bands
from robocov_app.report.embedding import has_path
from robocov_app.report.groups import shown_groups
from robocov_app.report.result_plots import PANEL, SCALE, Looks, Plot
from robocov_app.report.svg import inline_svg

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from robocov.arrays import Array
    from robocov.metrics.run_metrics import RunMetrics
    from robocov_app.report.embedding import ReplayRun
    from robocov_app.report.gathering import Entry, Result

MOST_MEASURED = 4
"""Runs up to which they are measured: what is in sight takes a while to know."""

MOST_ROBOTS = 60
"""Robots up to which they are."""

_MOMENTS = 30
"""Moments of a run, besides its first."""


class _Panel(NamedTuple):
    title: str
    label: str
    unit: str
    of: Callable[[RunMetrics], Array]


def _part(area: Callable[[RunMetrics], Array]) -> Callable[[RunMetrics], Array]:
    return lambda metrics: np.asarray(100.0 * area(metrics) / metrics.free_area)


def _in_contact(gaps: Array) -> Array:
    """Return gaps in whole millimetres: what is below is the solver's slop, which has no sign."""
    return np.asarray(np.round(gaps, 3) + 0.0)


_PANELS = (
    _Panel("Sensed", "in range and in sight (% of the free area)", "%", _part(lambda m: m.sensed_area)),
    _Panel("Seen", "in line of sight (% of the free area)", "%", _part(lambda m: m.visible_area)),
    _Panel("Energy", "work |F v| so far (J)", "J", lambda m: m.work),
    _Panel("Path", "path of a robot so far, mean (m)", "m", lambda m: m.path_length),
    _Panel("Clearance", "smallest gap to a wall (m)", "m", lambda m: _in_contact(m.wall_clearance)),
    _Panel("Distance kept", "smallest gap between robots (m)", "m", lambda m: _in_contact(m.robot_clearance)),
    _Panel(
        "Connectivity", "parts of the team that hear each other", "", lambda m: m.components.astype(float)
    ),
)


def measure_plots(
    result: Result, runs: Sequence[ReplayRun], entries: Sequence[Entry], looks: Looks, key: str
) -> list[Plot]:
    """Return a plot for each metric of a run, or of the runs of a comparison; none of a sweep.

    Nor are there any of very many runs or robots, or where a record does not tell the robots' ways. A
    metric that tells nothing is left out, as the gap between robots where there is one.
    """
    if result.kind == "sweep" or not 0 < len(runs) <= MOST_MEASURED:
        return []
    if any(len(run.record.team) > MOST_ROBOTS or not has_path(run.record) for run in runs):
        return []
    groups = shown_groups(result)
    group_of = {entry: group for group in groups for entry in group.entries}
    measured = [_measured(run) for run in runs]
    curves = [
        (panel, [(metrics.time, panel.of(metrics)) for metrics in measured])
        for panel in _PANELS
        if panel.title != "Connectivity" or any((m.components != m.components[0]).any() for m in measured)
    ]
    histories = [run.history for run in runs]
    times = [(each.time, each.mean_time) for each in histories if each and each.mean_time is not None]
    if len(times) == len(runs):
        title, what = "Time to come", "mean time until the first robot is there (s)"
        curves.insert(0, (_Panel(title, what, "s", lambda m: m.time), times))
    plots = []
    for panel, found in curves:
        bands = [
            Band(
                group_of[entry].label, entry.controller, time - time[0], np.where(known, values, np.nan)[None]
            )
            for entry, (time, values) in zip(entries, found, strict=True)
            if entry in group_of and (known := np.isfinite(values)).any()
        ]
        if bands:
            own = [looks[band.label] for band in bands]
            figure = plot_cost_bands(
                bands, size=PANEL, scale=SCALE, title="", styles=own, label=panel.label, unit=panel.unit
            )
            name = f"{key}-{panel.title.lower().replace(' ', '-')}"
            plots.append(Plot(panel.title, inline_svg(figure, name, _sentence(panel, bands))))
    return plots


def _measured(run: ReplayRun) -> RunMetrics:
    record = run.record
    seconds = float(record.time[-1] - record.time[0])
    return run_metrics(record, _MOMENTS / seconds if seconds > 0.0 else 0.0)


def _sentence(panel: _Panel, bands: Sequence[Band]) -> str:
    """Return a plot's curves in words."""
    words = []
    for band in bands:
        first, last = band.values[0][np.isfinite(band.values[0])][[0, -1]]
        words.append(f"{band.label}: from {first:.4g} to {last:.4g} {panel.unit}".rstrip())
    return f"{panel.title}: {panel.label} against time. {'; '.join(words)}."
