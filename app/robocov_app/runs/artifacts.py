"""Result folders: the numbers, figures and video of one run, or of several runs side by side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from enum import Enum
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.cost import CoverageCost, TimeVaryingCost
from robocov.errors import format_count
from robocov.files.result_folder import ResultFolder, create_result
from robocov.files.result_names import (
    COMPARISON_FILE,
    COMPARISON_TABLE_FILE,
    COST_FIGURE,
    FIGURE_SUFFIXES,
    TRAJECTORIES_FIGURE,
)
from robocov.kernel_compilation import compile_kernels
from robocov.metrics import compute_relative_excess
from robocov.scenario import Scenario
from robocov_app.runs.cost import build_cost, refine_cost_for_figures
from robocov_app.runs.execution import Run, execute_scenario, is_partial_record
from robocov_app.runs.saved_runs import COMPARISON_FORMAT, COMPARISON_VERSION
from robocov_app.runs.settings import OutputSettings
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import replace_non_finite, write_csv, write_json
from robocov_app.terminal.progress import make_counter, show_progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from robocov_app.figures.coverage import DistanceSnapshot
    from robocov_app.figures.curves import TimeCurve

_COMPARISON_HEADER = {"format": COMPARISON_FORMAT, "version": COMPARISON_VERSION}
_SUMMARY_COLUMNS = (
    "mean_distance_m",
    "cost_m3",
    "uncovered_area_m2",
    "settled_at_s",
    "contacts",
    "min_clearance_m",
    "mean_time_s",  # only if some robots are faster than others
)
"""Entries of a run's summary that become columns of a comparison."""
_JSON_ONLY_COLUMNS = ("label", "gains", "notes")
"""Columns that are only in ``comparison.json``, not in ``comparison.csv``."""


class Ending(Enum):
    """Whether, and when, Ctrl+C ended the execution of runs early.

    Attributes
    ----------
    COMPLETE
        All runs and their files are complete.
    VIDEO_INTERRUPTED
        All runs are complete, but Ctrl+C ended the writing of their frames and video early.
    RUN_INTERRUPTED
        Ctrl+C ended a run early, or before it was started.
    """

    COMPLETE = "complete"
    VIDEO_INTERRUPTED = "video interrupted"
    RUN_INTERRUPTED = "run interrupted"


def execute_run(scenario: Scenario, out: Path, settings: OutputSettings) -> tuple[Run, Ending]:
    """Execute one scenario, and write its results to a folder.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    out : Path
        The folder, which is created.
    settings : OutputSettings
        Settings of the evaluation and of the files.

    Returns
    -------
    run : Run
        The run, which has fewer steps if it was interrupted.
    ending : Ending
        Whether Ctrl+C ended the run, or the writing of its video, early.

    Raises
    ------
    RobocovError
        If the run fails, or the folder cannot be written.
    """
    # The folder is created first, so that an unusable one is reported before the long computations.
    with create_result(out, "run", overwrite=settings.overwrite) as result:
        compile_kernels()
        cost = build_cost(
            scenario.environment,
            settings.lattice,
            radius=scenario.team.min_radius,
            quiet=settings.hide_progress,
        )
        with Interruption() as interruption:
            run = execute_scenario(scenario, cost, result, settings, interruption)
            save_figures([run], cost, result.staging, settings)
            _save_videos([run], cost, result, settings, interruption)
    return run, _determine_ending([scenario], [run], settings, interruption)


def execute_comparison(
    scenarios: Mapping[str, Scenario], out: Path, settings: OutputSettings
) -> tuple[dict[str, Run], Ending]:
    """Execute scenarios on one map, and write their results to a folder with a subfolder for each.

    Parameters
    ----------
    scenarios : mapping of str to Scenario
        The scenarios, by the names of their subfolders.
    out : Path
        The folder, which is created.
    settings : OutputSettings
        Settings of the evaluation and of the files.

    Returns
    -------
    runs : dict of str to Run
        The runs, by the names of their subfolders. If Ctrl+C ended the comparison early, only those that
        were started.
    ending : Ending
        Whether Ctrl+C ended the comparison, or the writing of its video, early.

    Raises
    ------
    RobocovError
        If a run fails, or the folder cannot be written.
    """
    environment = next(iter(scenarios.values())).environment
    min_radius = min(scenario.team.min_radius for scenario in scenarios.values())
    runs: dict[str, Run] = {}
    with create_result(out, "comparison", overwrite=settings.overwrite, run_names=scenarios) as result:
        compile_kernels()
        cost = build_cost(environment, settings.lattice, radius=min_radius, quiet=settings.hide_progress)
        with Interruption() as interruption:
            start_comparison(result.staging, list(scenarios))
            for subfolder, scenario in scenarios.items():
                runs[subfolder] = execute_scenario(
                    scenario, cost, result, settings, interruption, subfolder=subfolder
                )
                if interruption.requested:
                    break
            save_comparison(runs, cost, result.staging, settings)
            _save_videos(list(runs.values()), cost, result, settings, interruption)
    return runs, _determine_ending(scenarios.values(), runs.values(), settings, interruption)


def _determine_ending(
    scenarios: Iterable[Scenario],
    runs: Iterable[Run],
    settings: OutputSettings,
    interruption: Interruption,
) -> Ending:
    """Return what Ctrl+C ended early, if anything; `runs` are those of the first scenarios."""
    if not interruption.requested:
        return Ending.COMPLETE
    for scenario, run in zip_longest(scenarios, runs):
        if run is None or is_partial_record(run.record, scenario):
            return Ending.RUN_INTERRUPTED
    if settings.video.has_output:
        return Ending.VIDEO_INTERRUPTED
    return Ending.COMPLETE


def _save_videos(
    runs: Sequence[Run],
    cost: CoverageCost,
    result: ResultFolder,
    settings: OutputSettings,
    interruption: Interruption,
) -> None:
    """Save the results so far, and then the frames and videos if they were requested."""
    result.save_progress()
    if settings.video.has_output:
        from robocov_app.runs.video import save_videos

        save_videos(runs, cost, result.staging, settings.video, interruption, quiet=settings.hide_progress)


def build_comparison_rows(runs: Mapping[str, Run]) -> list[dict[str, Any]]:
    """Build the rows of a comparison.

    Parameters
    ----------
    runs : mapping of str to Run
        Runs, keyed by the names of the controllers' folders.

    Returns
    -------
    list of dict
        One row for each run: its results, and ``above_best``, the relative difference between its mean
        distance and the lowest one.
    """
    excess = compute_relative_excess([run.summary["mean_distance_m"] for run in runs.values()])
    rows = []
    for (name, run), above_best in zip(runs.items(), excess, strict=True):
        summary = run.summary
        row: dict[str, Any] = {"controller": name, "label": run.record.label, "gains": dict(run.record.gains)}
        row |= {column: summary[column] for column in _SUMMARY_COLUMNS if column in summary}
        row["mean_path_length_m"] = sum(summary["path_length_m"]) / len(run.record.team)
        row["above_best"] = above_best
        if "notes" in summary:
            row["notes"] = summary["notes"]
        rows.append(row)
    return rows


def start_comparison(folder: Path, subfolders: Sequence[str]) -> None:
    """Write ``comparison.json`` without results, so that the runs can be found if the program is killed.

    Parameters
    ----------
    folder : Path
        Folder of the comparison.
    subfolders : sequence of str
        Names of the subfolders of the runs.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_json(folder / COMPARISON_FILE, {**_COMPARISON_HEADER, "folders": list(subfolders), "runs": []})


def save_comparison(
    runs: Mapping[str, Run], cost: CoverageCost, folder: Path, settings: OutputSettings
) -> None:
    """Write ``comparison.json``, ``comparison.csv`` and the figures of a comparison.

    Parameters
    ----------
    runs : mapping of str to Run
        The runs, by the names of their subfolders.
    cost : CoverageCost
        Cost of the map.
    folder : Path
        Folder of the comparison.
    settings : OutputSettings
        Settings of the files.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    rows = build_comparison_rows(runs)
    content = {**_COMPARISON_HEADER, "lattice": settings.lattice, "folders": list(runs), "runs": rows}
    write_json(folder / COMPARISON_FILE, replace_non_finite(content))
    columns = [name for name in rows[0] if name not in _JSON_ONLY_COLUMNS]
    lines = ([row[name] for name in columns] for row in rows)
    write_csv(folder / COMPARISON_TABLE_FILE, ",".join(columns), lines)
    save_figures(list(runs.values()), cost, folder, settings, is_comparison=True)


def save_figures(
    runs: Sequence[Run],
    cost: CoverageCost,
    folder: Path,
    settings: OutputSettings,
    *,
    is_comparison: bool = False,
) -> None:
    """Draw ``trajectories`` and ``cost`` as PNG and SVG, if figures were requested.

    Parameters
    ----------
    runs : sequence of Run
        The runs to draw.
    cost : CoverageCost
        Cost of the map.
    folder : Path
        Folder of the figures.
    settings : OutputSettings
        Settings of the files.
    is_comparison : bool
        Whether the runs are drawn side by side, even if there is only one.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    if not settings.figures:
        return
    from robocov_app.figures.files import save_figure

    with show_progress("figures", 2 * len(FIGURE_SUFFIXES), quiet=settings.hide_progress) as update:
        report_figure = make_counter(update)

        def save(figure: Figure, stem: str) -> None:
            for suffix in FIGURE_SUFFIXES:
                save_figure(figure, folder / (stem + suffix))
                report_figure()

        save(_plot_trajectories(runs, settings, is_comparison=is_comparison), TRAJECTORIES_FIGURE)
        save(_plot_cost(runs, cost, settings), COST_FIGURE)


def _plot_trajectories(runs: Sequence[Run], settings: OutputSettings, *, is_comparison: bool) -> Figure:
    """Plot the trajectories of the only run, or of several runs side by side."""
    from robocov_app.figures.comparisons import plot_comparison
    from robocov_app.figures.map_pages import plot_trajectories

    video = settings.video
    mean_distances = [float(run.history.mean_distance[-1]) for run in runs]
    if is_comparison:
        return plot_comparison(
            [run.record for run in runs],
            theme=video.color_theme,
            colors=video.colors,
            size=video.size,
            mean_distances=mean_distances,
            mean_times=[run.final_time for run in runs],
        )
    return plot_trajectories(
        runs[0].record,
        theme=video.color_theme,
        colors=video.colors,
        size=video.size,
        mean_distance=mean_distances[0],
        mean_time=runs[0].final_time,
    )


def _plot_cost(runs: Sequence[Run], cost: CoverageCost, settings: OutputSettings) -> Figure:
    """Plot the costs of runs over time, with maps of the distances at the end of each run."""
    from robocov_app.figures.coverage import plot_coverage

    record = runs[0].record
    robots = format_count(len(record.team), "robot")
    return plot_coverage(
        _build_curves(runs, "mean_distance"),
        build_final_snapshots(runs, cost),
        theme=settings.video.color_theme,
        size=settings.video.size,
        title=f"Coverage  ·  {record.environment.name}  ·  {robots}",
        times=_build_curves(runs, "mean_time"),
    )


def _build_curves(runs: Sequence[Run], quantity: str) -> list[TimeCurve]:
    """Return the curves of a quantity, ``mean_distance`` or ``mean_time``; runs without it are left out."""
    from robocov_app.figures.curves import TimeCurve

    curves = []
    for run in runs:
        values = getattr(run.history, quantity)
        is_known = values is not None and (quantity == "mean_distance" or np.isfinite(values).any())
        if is_known:
            curves.append(TimeCurve(run.record.label, run.record.controller, run.history.time, values))
    return curves


def build_final_snapshots(runs: Sequence[Run], cost: CoverageCost) -> list[DistanceSnapshot]:
    """Compute the distances at the end of each run, for figures of the coverage cost.

    Parameters
    ----------
    runs : sequence of Run
        Runs on one map. The maps of the records may differ by failed robots, which are obstacles.
    cost : CoverageCost
        Cost of the map of the first run.

    Returns
    -------
    list of DistanceSnapshot
        A snapshot of each run in which at least one robot works at the end.
    """
    from robocov_app.figures.coverage import DistanceSnapshot
    from robocov_app.render.distance_map.pixel_distances import DistanceField
    from robocov_app.render.distance_map.site_lattice import FieldLattice

    environment = runs[0].record.environment
    cost = refine_cost_for_figures(environment, cost)
    snapshots = []
    for run in runs:
        record = run.record
        if record.environment != environment:
            environment = record.environment
            cost = build_cost(environment, cost.lattice, radius=cost.radius, quiet=True)
        varying_cost = TimeVaryingCost(cost)
        time = float(record.time[-1])
        positions = record.positions[-1]
        is_available = varying_cost.find_available_robots(time, positions, record.is_working[-1])
        if not is_available.any():
            continue
        final_cost = varying_cost.get_cost(time)
        rows = np.flatnonzero(is_available)
        field = DistanceField(FieldLattice(final_cost.sites), final_cost(positions[rows]))
        mean_distance = float(run.history.mean_distance[-1])
        snapshots.append(DistanceSnapshot.build_final(record, field, mean_distance, rows, run.final_time))
    return snapshots
