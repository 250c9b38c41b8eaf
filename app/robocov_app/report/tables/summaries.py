"""Tables of metrics by controller, for each map and team and for all together, and tables of every run."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from robocov_app.report.analysis.groups import (
    RunGroup,
    format_setting,
    label_runs,
    list_displayed_groups,
    list_settings,
)
from robocov_app.report.analysis.scaling import compute_medians, scale_distances
from robocov_app.report.results.references import RESTARTS
from robocov_app.report.results.result import ReportedResult, ReportedRun
from robocov_app.report.tables.run_columns import (
    RunColumn,
    build_final_distance_column,
    build_mean_over_run_column,
    build_other_columns,
    list_known_values,
)
from robocov_app.report.tables.table import NO_VALUE, PageTable, format_quartiles

MAX_RUN_ROWS = 60
"""Maximum number of runs that get a row each."""
MAX_SETTINGS = 40
"""Maximum number of combinations of map and team that get a table each."""
_SCALED_HEADING = "Mean distance / median"
_SCALED_NOTE = f"{_SCALED_HEADING}: divided by the median over all runs on the same map with the same team."
_SEVERAL_RUNS_NOTE = (
    "Numbers with brackets are medians over runs, with the quartiles in brackets. Over the run: the mean "
    "distance, averaged over time. Contacts: the runs in which a robot touched a wall or another robot. "
    "Clearance: the smallest distance to a wall in any run. Stuck robots: the mean number of robots that "
    "have stopped away from their goals; a dash if they have no goals."
)
_REFERENCE_NOTE = (
    f"Gap: J/J_ref − 1, where J is the final mean distance and J_ref that of the reference, the best of "
    f"{RESTARTS} searches for placements of the team with the whole map known, on the same lattice."
)


def build_summary_tables(result: ReportedResult) -> list[PageTable]:
    """Build the tables of metrics by controller.

    Parameters
    ----------
    result : ReportedResult

    Returns
    -------
    list of PageTable
        First a table for all maps and teams together, if there are several; then a table for each of them, if
        there are not too many.
    """
    groups = list_displayed_groups(result)
    settings = list_settings(result)
    gap_columns = []
    if result.references:
        gap_columns.append(_build_gap_column(result))
    settled_column = RunColumn("Settled", _format_settled)
    other_columns = build_other_columns(result)
    tables = []
    if len(settings) > 1:
        columns = [_build_scaled_column(result), *gap_columns, settled_column, *other_columns]
        table = _build_summary_table("All maps and teams together", columns, groups)
        tables.append(replace(table, notes=(_SCALED_NOTE,)))
    if len(settings) <= MAX_SETTINGS:
        columns = [
            build_final_distance_column(),
            *gap_columns,
            build_mean_over_run_column(),
            settled_column,
            *other_columns,
        ]
        for setting in settings:
            caption = "Final metrics"
            if len(settings) > 1:
                caption = format_setting(result, setting)
            setting_groups = [group.select(setting) for group in groups]
            tables.append(_build_summary_table(caption, columns, setting_groups))
    if tables and any(len(group.runs) > 1 for group in groups):
        tables[-1] = replace(tables[-1], notes=(*tables[-1].notes, _SEVERAL_RUNS_NOTE))
    if tables and result.references:
        tables[0] = replace(tables[0], notes=(*tables[0].notes, _REFERENCE_NOTE))
    return tables


def _build_summary_table(caption: str, columns: Sequence[RunColumn], groups: Sequence[RunGroup]) -> PageTable:
    """Build a table with a row for each group that has runs."""
    rows = []
    for group in groups:
        if group.runs:
            cells = [column.format_cell(group.runs) for column in columns]
            rows.append((group.label, str(len(group.runs)), *cells))
    headings = [column.heading for column in columns]
    return PageTable(caption, ("Controller", "Runs", *headings), rows)


def _build_gap_column(result: ReportedResult) -> RunColumn:
    """Build the column of gaps to the reference, in percent."""

    def format_gaps(runs: Sequence[ReportedRun]) -> str:
        gaps = [100.0 * result.compute_gap(run) for run in runs]
        return format_quartiles([gap for gap in gaps if np.isfinite(gap)], decimals=1)

    return RunColumn("Gap, %", format_gaps)


def _build_scaled_column(result: ReportedResult) -> RunColumn:
    """Build the column of final mean distances for all maps together: multiples of each map's median."""
    scales = compute_medians(result)
    return RunColumn(
        _SCALED_HEADING,
        lambda runs: format_quartiles(scale_distances(runs, scales).tolist(), decimals=3),
    )


def _format_settled(runs: Sequence[ReportedRun]) -> str:
    """Format whether the team settled in a single run, or in how many of several runs it did."""
    count = len(list_known_values(runs, "settled_at_s"))
    if len(runs) > 1:
        return f"{count} of {len(runs)}"
    return "yes" if count else "no"


def build_runs_table(result: ReportedResult) -> PageTable | None:
    """Build the table of all runs; return None if there are too many, or if summaries show each run."""
    labels = label_runs(result)
    run_count = len(result.completed_runs)
    if run_count > MAX_RUN_ROWS or run_count == len(set(labels.values())):
        return None
    columns = [
        build_final_distance_column(),
        build_mean_over_run_column(),
        *build_other_columns(result, unsettled="no"),
    ]
    rows = []
    for run in result.completed_runs:
        map_name = format_setting(result, run.setting)
        seed = NO_VALUE if run.seed is None else str(run.seed)
        cells = [column.format_cell([run]) for column in columns]
        rows.append((labels[run], map_name, run.start or NO_VALUE, seed, *cells))
    headings = [column.heading for column in columns]
    head = ("Controller", "Map", "Start", "Seed", *headings)
    return PageTable("Every run", head, rows, text_columns=frozenset({1, 2}))
