"""`robocov metrics`."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from robocov.errors import require_number
from robocov_app.commands.options import FigureOptions
from robocov_app.terminal.output import BOLD, RIGHT, print_answer, print_table, write_csv
from robocov_app.terminal.progress import make_counter, show_progress


@dataclass
class Arguments(FigureOptions):
    """What the field measures of saved runs: covered and visible area, energy, ways, connectivity, clearance.

    Writes metrics.csv into the folder of each run, one row a moment. Areas: within the sensing range and in
    line of sight, within it through walls, and in line of sight at any distance. Energy: the integrals of
    |F v| and of |F|² of the forces that the controller asked for. --plot draws all against time.

    Example: robocov metrics museum --plot museum-metrics.png
    """

    folder: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DIR")]
    """The folder of a run or a comparison."""
    rate: float = 2.0
    """Moments per simulated second."""

    def __post_init__(self) -> None:
        super().__post_init__()
        require_number("--rate", self.rate, 0.0, 1e4, "Hz")


def command(options: Arguments) -> None:
    from robocov.files.result_folder import extend_result
    from robocov.metrics.run_metrics import COLUMNS, compute_run_metrics, find_time_near_final
    from robocov.record import select_nearest_moments
    from robocov_app.figures.runs import Measured
    from robocov_app.runs.saved_runs import load_saved_runs

    measured, runs = [], load_saved_runs(options.folder)
    answers: list[dict[str, Any]] = []
    folder = options.folder if options.folder.is_dir() else options.folder.parent
    with extend_result(folder) as result:
        for saved in runs:
            record, history = saved.record, saved.history
            total = len(select_nearest_moments(record.time, options.rate))
            with show_progress(f"measuring {record.label}", total, quiet=options.json) as update:
                metrics = compute_run_metrics(record, options.rate, make_counter(update))
            target = result.staging / saved.folder.relative_to(folder)
            target.mkdir(exist_ok=True)
            write_csv(target / "metrics.csv", ",".join(COLUMNS.values()), metrics.rows())
            measured.append(Measured(record.label, record.controller, metrics))
            about = {"folder": str(saved.folder), "controller": record.controller, "label": record.label}
            near = None if history is None or not len(history.time) else find_time_near_final(history)
            figures = {"free_area_m2": metrics.free_area, **metrics.final(), "near_final_s": near}
            answers.append(about | figures)
    if options.plot is not None:
        from robocov_app.figures.files import save_figure
        from robocov_app.figures.runs import plot_metrics

        title = f"Metrics  ·  {options.folder.name}"
        save_figure(plot_metrics(measured, options.theme, title=title), options.plot)
    if not options.json:
        print_table([(title, RIGHT if title else BOLD) for title in _COLUMNS], map(_cells, answers))
    folders = ", ".join(answer["folder"] for answer in answers)
    print_answer(options, {"runs": answers}, f"written to metrics.csv in {folders}")


_COLUMNS = {
    # title: name and format of a figure; areas are told as parts of the free area
    "": ("label", "{}"),
    "sensed": ("sensed_area_m2", "{:.1%}"),
    "visible": ("visible_area_m2", "{:.1%}"),
    "work": ("work_J", "{:.1f} J"),
    "effort": ("effort_N2_s", "{:.1f} N²s"),
    "way": ("path_length_m", "{:.2f} m"),
    "within 5 %": ("near_final_s", "{:.1f} s"),
    "parts": ("components", "{:.0f}"),
    "to walls": ("wall_clearance_m", "{:.3f} m"),
    "to robots": ("robot_clearance_m", "{:.3f} m"),
}


def _cells(answer: dict[str, Any]) -> Iterator[str]:
    for name, template in _COLUMNS.values():
        value = answer[name]
        if value is not None and name.endswith("area_m2"):
            value /= answer["free_area_m2"]
        yield "–" if value is None else template.format(value)
