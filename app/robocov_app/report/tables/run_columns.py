"""Columns of metrics in tables of runs."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from robocov_app.report.results.result import ReportedResult, ReportedRun
from robocov_app.report.tables.table import NO_VALUE, format_quartiles


class RunColumn(NamedTuple):
    """A column of metrics.

    Attributes
    ----------
    heading : str
    format_cell : callable
        Returns the text of the cell for one or several runs.
    """

    heading: str
    format_cell: Callable[[Sequence[ReportedRun]], str]


def build_quartiles_column(heading: str, name: str, decimals: int, no_value: str = NO_VALUE) -> RunColumn:
    """Build a column with the median and the quartiles of a metric."""
    return RunColumn(
        heading, lambda runs: format_quartiles(list_known_values(runs, name), decimals, no_value)
    )


def build_final_distance_column() -> RunColumn:
    """Build the column of final mean distances."""
    return build_quartiles_column("Mean distance, m", "mean_distance_m", 3)


def build_mean_over_run_column() -> RunColumn:
    """Build the column of mean distances over the run."""
    return build_quartiles_column("Over the run, m", "mean_distance_over_run_m", 3)


def build_other_columns(result: ReportedResult, unsettled: str = NO_VALUE) -> list[RunColumn]:
    """Build the columns of all other metrics.

    Parameters
    ----------
    result : ReportedResult
        Result whose runs are shown. Mean times are a column only if some robots are faster than others, and
        the size of messages per second only if there are any.
    unsettled : str
        Text in the column of settling times for a team that did not settle.

    Returns
    -------
    list of RunColumn
    """
    settled_at = "Settled at, s"
    if unsettled == NO_VALUE:
        settled_at = "Settled at, s (settled runs)"
    columns = [
        build_quartiles_column(settled_at, "settled_at_s", 1, unsettled),
        RunColumn("Contacts", _format_contacts),
        RunColumn("Clearance, m", _format_clearance),
        build_quartiles_column("Path, m", "path_length_m", 2),
        RunColumn("Stuck robots", _format_stuck_robots),
    ]
    if any(run.has_metric("mean_time_s") for run in result.completed_runs):
        columns.append(build_quartiles_column("Mean time, s", "mean_time_s", 3))
    if any(run.metrics.get("sent_bytes_per_s") for run in result.completed_runs):
        columns.append(build_quartiles_column("Messages, B/s", "sent_bytes_per_s", 0))
    return columns


def list_known_values(runs: Sequence[ReportedRun], name: str) -> list[float]:
    """List the known values of a metric in some runs."""
    return [float(run.metrics[name] or 0.0) for run in runs if run.has_metric(name)]


def _format_contacts(runs: Sequence[ReportedRun]) -> str:
    """Format the number of contacts of a single run, or the number of runs with contacts."""
    counts = list_known_values(runs, "contacts")
    if not counts:
        return NO_VALUE
    if len(runs) == 1:
        return f"{counts[0]:.0f}"
    return f"{sum(count > 0 for count in counts)} of {len(counts)} runs"


def _format_stuck_robots(runs: Sequence[ReportedRun]) -> str:
    """Format the number of stuck robots of a single run, or the mean of several runs."""
    counts = list_known_values(runs, "stuck_robots")
    if not counts:
        return NO_VALUE
    if len(runs) == 1:
        return f"{counts[0]:.0f}"
    return f"{np.mean(counts):.2g} per run"


def _format_clearance(runs: Sequence[ReportedRun]) -> str:
    """Format the smallest distance to a wall in any of the runs."""
    gaps = list_known_values(runs, "min_clearance_m")
    if not gaps:
        return NO_VALUE
    text = f"{min(gaps):.3f}"
    is_zero = not text.strip("-0.")
    if is_zero:
        return text.removeprefix("-")
    # A minus sign is as wide as a digit, unlike a hyphen.
    return text.replace("-", "\u2212")
