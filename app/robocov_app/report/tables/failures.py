"""The table of runs that failed or cannot be read."""

from robocov.errors import format_count
from robocov_app.report.analysis.groups import format_gains, format_setting
from robocov_app.report.results.result import ReportedResult
from robocov_app.report.tables.table import NO_VALUE, PageTable

MAX_FAILURE_ROWS = 60


def build_failures_table(result: ReportedResult) -> PageTable | None:
    """Build the table of runs that failed or cannot be read; return None if there are none."""
    rows: list[tuple[str, ...]] = []
    for run in result.failed_runs:
        row = (
            run.label,
            format_setting(result, run.setting),
            f"{run.start}, {run.seed}",
            format_gains(run.gains, result.gain_units),
            run.error or "",
        )
        rows.append(row)
    # Of a run that cannot be read, only the folder is known.
    rows += [(run.folder, NO_VALUE, NO_VALUE, NO_VALUE, run.reason) for run in result.damaged_runs]
    if not rows:
        return None
    notes: tuple[str, ...] = ()
    if len(rows) > MAX_FAILURE_ROWS:
        notes = (f"{format_count(len(rows) - MAX_FAILURE_ROWS, 'more run')}.",)
    return PageTable(
        caption="Runs that failed or cannot be read",
        head=("Controller or folder", "Map", "Start, seed", "Gains", "Error"),
        rows=rows[:MAX_FAILURE_ROWS],
        text_columns=frozenset({1, 2, 3, 4}),
        notes=notes,
    )
