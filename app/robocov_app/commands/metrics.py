"""`robocov metrics`."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from robocov_app.terminal.arguments import in_range

if TYPE_CHECKING:
    from robocov_app.figures.metrics import Measured
    from robocov_app.runs.saved import Saved


@dataclass
class Arguments:
    """What the field measures of saved runs: covered and visible area, energy, ways, connectivity, clearance.

    Writes metrics.csv into the folder of each run, one row a moment. Areas: within the sensing range and in
    line of sight, within it through walls, and in line of sight at any distance. Energy: the integrals of
    |F v| and of |F|² of the forces that the controller asked for.

    Example: robocov metrics museum --plot museum-metrics.png
    """

    folder: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DIR")]
    """The folder of a run or a comparison."""
    rate: float = 2.0
    """Moments per simulated second."""
    plot: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Draw the metrics against time to a PNG, SVG or PDF."""
    theme: Literal["light", "dark"] = "light"
    """Colours of the picture."""
    json: bool = False
    """Print one JSON object and nothing else."""

    def __post_init__(self) -> None:
        in_range("--rate", self.rate, 0.0, 1e4, "Hz")


def command(options: Arguments) -> None:
    """Measure, write and print."""
    from robocov.files.result_folder import extended
    from robocov_app.runs.saved import load_saved
    from robocov_app.terminal.output import write_csv

    if options.plot is not None:
        from robocov_app.figures.files import check_figure_path

        check_figure_path(options.plot)
    from robocov.metrics.run_metrics import COLUMNS

    measured, answers = [], []
    runs = load_saved(options.folder)
    folder = options.folder if options.folder.is_dir() else options.folder.parent
    with extended(folder) as result:
        for saved in runs:
            run = measure(saved, options)
            target = result.new / saved.folder.relative_to(folder)
            target.mkdir(exist_ok=True)
            write_csv(target / "metrics.csv", ",".join(COLUMNS.values()), run.metrics.rows())
            measured.append(run)
            answers.append(answer_of(saved, run))
    if options.plot is not None:
        from robocov_app.figures.files import save_figure
        from robocov_app.figures.metrics import plot_metrics

        save_figure(
            plot_metrics(measured, options.theme, title=f"Metrics  ·  {options.folder.name}"), options.plot
        )
    if options.json:
        print(json.dumps({"runs": answers}))
        return
    print_table(answers)


def measure(saved: Saved, options: Arguments) -> Measured:
    """Measure one run."""
    from robocov.metrics.run_metrics import run_metrics
    from robocov.record import nearest_moments
    from robocov_app.figures.metrics import Measured
    from robocov_app.terminal.progress import counting, progress

    record = saved.record
    total = len(nearest_moments(record.time, options.rate))
    with progress(f"measuring {record.label}", total, quiet=options.json) as update:
        return Measured(record.label, record.controller, run_metrics(record, options.rate, counting(update)))


def answer_of(saved: Saved, run: Measured) -> dict[str, Any]:
    """Return what is said of one run: the figures of its end."""
    from robocov.metrics.run_metrics import time_near_final

    near = None if saved.history is None or not len(saved.history.time) else time_near_final(saved.history)
    return {
        "folder": str(saved.folder),
        "controller": run.controller,
        "label": run.label,
        "free_area_m2": run.metrics.free_area,
        **run.metrics.final(),
        "near_final_s": near,
    }


def print_table(answers: list[dict[str, Any]]) -> None:
    """Print the figures of all runs for people."""
    from robocov_app.terminal.tables import BOLD, RIGHT, print_table

    titles = ("sensed", "visible", "work", "effort", "way", "within 5 %", "parts", "to walls", "to robots")
    rows = (
        (
            answer["label"],
            f"{answer['sensed_area_m2'] / answer['free_area_m2']:.1%}",
            f"{answer['visible_area_m2'] / answer['free_area_m2']:.1%}",
            f"{answer['work_J']:.1f} J",
            f"{answer['effort_N2_s']:.1f} N²s",
            f"{answer['path_length_m']:.2f} m",
            _text(answer["near_final_s"], 1, "s"),
            f"{answer['components']:.0f}",
            _text(answer["wall_clearance_m"], 3, "m"),
            _text(answer["robot_clearance_m"], 3, "m"),
        )
        for answer in answers
    )
    print_table([("", BOLD), *((title, RIGHT) for title in titles)], rows)
    print("written to metrics.csv in", ", ".join(answer["folder"] for answer in answers))


def _text(value: float | None, decimals: int, unit: str) -> str:
    return "–" if value is None else f"{value:.{decimals}f} {unit}"
