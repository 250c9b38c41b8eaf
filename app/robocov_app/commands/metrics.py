"""`robocov metrics`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from robocov.errors import require_number
from robocov.files.result_names import METRICS_FILE
from robocov_app.commands.options import FigureOptions
from robocov_app.terminal.output import BOLD, RIGHT, print_answer, print_table, write_csv
from robocov_app.terminal.progress import make_counter, show_progress

if TYPE_CHECKING:
    from robocov.metrics.run_metrics import RunMetrics
    from robocov_app.figures.metric_curves import MeasuredRun
    from robocov_app.runs.saved_runs import SavedRun

_COLUMNS = {
    "": ("label", "{}"),
    "sensed": ("sensed_area_m2", "{:.1%}"),
    "visible": ("visible_area_m2", "{:.1%}"),
    "work": ("work_J", "{:.1f} J"),
    "effort": ("effort_N2_s", "{:.1f} N²s"),
    "path length": ("path_length_m", "{:.2f} m"),
    "within 5%": ("near_final_s", "{:.1f} s"),
    "components": ("components", "{:.0f}"),
    "to walls": ("wall_clearance_m", "{:z.3f} m"),
    "to robots": ("robot_clearance_m", "{:z.3f} m"),
}
"""Titles of the table's columns, with their keys and formats. Areas are printed relative to the free area."""


@dataclass
class Arguments(FigureOptions):
    """Compute metrics of saved runs: sensed and visible area, energy, path length, connectivity, clearance.

    Writes metrics.csv into the folder of each run, with one row per sample, and prints the values at the end.
    The sensed area is within the sensing range of a robot and in its line of sight, the visible area in line
    of sight at any distance. Work and effort are the integrals of |F v| and of |F|² of the controller's
    forces. The components are groups of robots that can communicate with each other.

    --plot draws four of the metrics against time: sensed area, visible area, work and path length.

    Example: robocov metrics museum --plot museum-metrics.png
    """

    folder: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DIR")]
    """Folder of a run or a comparison."""
    rate: float = 2.0
    """Samples per simulated second."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number("--rate", self.rate, 0.0, 1e4, "Hz")


def command(options: Arguments) -> None:
    """Run `robocov metrics`."""
    from robocov.files.result_folder import extend_result
    from robocov.metrics.run_metrics import COLUMNS
    from robocov_app.figures.metric_curves import MeasuredRun
    from robocov_app.runs.saved_runs import load_saved_runs

    saved_runs = load_saved_runs(options.folder)
    folder = options.folder if options.folder.is_dir() else options.folder.parent
    measured_runs: list[MeasuredRun] = []
    rows: list[dict[str, Any]] = []
    with extend_result(folder) as result:
        for saved in saved_runs:
            metrics = _compute_metrics(options, saved)
            target = result.staging / saved.folder.relative_to(folder)
            target.mkdir(exist_ok=True)
            write_csv(target / METRICS_FILE, ",".join(COLUMNS.values()), metrics.rows())
            measured_runs.append(MeasuredRun(saved.record.label, saved.record.controller, metrics))
            rows.append(_build_row(saved, metrics))
    if options.plot is not None:
        _save_figure(options, options.plot, measured_runs)
    if not options.json:
        columns = [(title, RIGHT if title else BOLD) for title in _COLUMNS]
        print_table(columns, [_format_cells(row) for row in rows])
    files = [str(Path(row["folder"]) / METRICS_FILE) for row in rows]
    if options.plot is not None:
        files.append(str(options.plot))
    *others, last = files
    listed = f"{', '.join(others)} and {last}" if others else last
    print_answer(options, {"runs": rows}, f"saved {listed}")


def _compute_metrics(options: Arguments, saved: SavedRun) -> RunMetrics:
    """Compute the metrics of a run, and show the progress."""
    from robocov.metrics.run_metrics import compute_run_metrics
    from robocov.record import select_nearest_steps

    record = saved.record
    samples = len(select_nearest_steps(record.time, options.rate))
    with show_progress(f"measuring {record.label}", samples, quiet=options.json) as update:
        return compute_run_metrics(record, options.rate, make_counter(update))


def _build_row(saved: SavedRun, metrics: RunMetrics) -> dict[str, Any]:
    """Build the JSON object with the metrics of a run."""
    from robocov.metrics.run_metrics import find_time_near_final

    record = saved.record
    near_final = None
    if saved.history is not None and len(saved.history.time):
        near_final = find_time_near_final(saved.history)
    return {
        "folder": str(saved.folder),
        "controller": record.controller,
        "label": record.label,
        "free_area_m2": metrics.free_area,
        **metrics.final(),
        "near_final_s": near_final,
    }


def _save_figure(options: Arguments, path: Path, measured_runs: list[MeasuredRun]) -> None:
    """Draw the metrics of all runs against time, and save the figure."""
    from robocov_app.figures.files import save_figure
    from robocov_app.figures.metric_curves import plot_metrics

    # The path may be ".", which has no name.
    title = f"Metrics  ·  {options.folder.resolve().name}"
    save_figure(plot_metrics(measured_runs, options.theme, title=title), path)


def _format_cells(row: dict[str, Any]) -> list[str]:
    """Return the table cells for a run."""
    cells = []
    for key, cell_format in _COLUMNS.values():
        value = row[key]
        if value is None:
            cells.append("–")
            continue
        if key.endswith("area_m2"):
            value /= row["free_area_m2"]
        cells.append(cell_format.format(value))
    return cells
