"""One headless run: simulate, evaluate, save, draw."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from robocov.cost import CoverageCost, MomentaryCost
from robocov.files.result_folder import ResultFolder
from robocov.metrics import CostHistory, cost_history, sample_moments, summarise
from robocov.record import Record
from robocov_app.runs.cost import built_cost, cost_for_pictures
from robocov_app.runs.spec import COST_RATE, RunSpec
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import finite, write_csv
from robocov_app.terminal.progress import counting, progress

if TYPE_CHECKING:  # not for the processes of a sweep
    from matplotlib.figure import Figure

    from robocov_app.figures.coverage import Moment
    from robocov_app.figures.curves import Curve
    from robocov_app.runs.options import RunOptions

STOPPED_SAMPLES = 200  # samples of the coverage cost of a run that was stopped
COST_COLUMNS = "time_s,mean_distance_m,cost_m3,uncovered_area_m2"  # the header of ``cost.csv``


@dataclass(frozen=True, eq=False)
class Run:
    """A finished (or stopped) run with its evaluation."""

    record: Record
    history: CostHistory
    summary: dict[str, Any]

    @property
    def final_time(self) -> float | None:
        """The mean time until the first robot is there at the end, s; None where all are equally fast."""
        return None if self.history.mean_time is None else float(self.history.mean_time[-1])


def simulated(spec: RunSpec, every: int, stop: Interruption, *, quiet: bool) -> Record:
    """Simulate, and return the record, of one step in `every`, up to the end or to Ctrl-C."""
    simulation = spec.simulation()
    # what a user's controller prints must not get among the answer
    chatter = redirect_stdout(sys.stderr) if quiet else nullcontext()
    with chatter, progress(f"simulating {simulation.controller.label}", spec.steps, quiet=quiet) as update:

        def watch(step: int) -> bool:
            if step % 10 == 0 or step == spec.steps or stop.requested:
                update(step)
            return stop.requested

        return spec.record(simulation, every=every, watch=watch)


def evaluated(record: Record, cost: CoverageCost, stop: Interruption, *, quiet: bool) -> Run:
    """Evaluate the coverage cost along a record, after Ctrl-C at fewer moments, and sum the run up."""
    rate = COST_RATE
    if stop.requested and record.time[-1] > 0:
        rate = min(rate, STOPPED_SAMPLES / float(record.time[-1]))
    total = len(sample_moments(record, rate))
    with progress("coverage cost", total, quiet=quiet) as update:
        history = cost_history(record, cost, rate, counting(update))
    return Run(record, history, summarise(record, history))


def saved_run(
    spec: RunSpec,
    cost: CoverageCost,
    result: ResultFolder,
    part: str,
    options: RunOptions,
    stop: Interruption,
) -> Run:
    """Simulate and evaluate a run, and save its numbers in a part of a folder."""
    record = simulated(spec, options.record_every, stop, quiet=options.json)
    record.save(result.new / part)
    result.keep()  # what took long is safe, whatever happens to the evaluation
    run = evaluated(record, cost, stop, quiet=options.json)
    save_numbers(run, result.new / part, options.lattice)
    result.keep()
    return run


def save_numbers(run: Run, folder: Path, lattice: int) -> None:
    """Write ``record.npz``, ``run.json`` and ``cost.csv``; the summary depends on the lattice."""
    run.record.save(folder, finite(run.summary), lattice=lattice)
    write_csv(folder / "cost.csv", cost_columns(run.history), cost_rows(run.history))


def cost_columns(history: CostHistory) -> str:
    """Return the header of ``cost.csv``; where robots are not equally fast, with one column more."""
    return COST_COLUMNS if history.mean_time is None else f"{COST_COLUMNS},mean_time_s"


def cost_rows(history: CostHistory) -> Iterator[tuple[float, ...]]:
    """Return the rows of ``cost.csv``, under `cost_columns`."""
    columns = [history.time, history.mean_distance, history.cost, history.uncovered_area]
    if history.mean_time is not None:
        columns.append(history.mean_time)
    return zip(*(column.tolist() for column in columns), strict=True)


def save_pictures(
    runs: Sequence[Run], cost: CoverageCost, folder: Path, options: RunOptions, *, comparison: bool = False
) -> None:
    """Draw ``trajectories.png|svg`` and ``cost.png|svg`` of a run, or of a comparison."""
    from robocov_app.figures.coverage import plot_coverage
    from robocov_app.figures.runs import plot_comparison, plot_trajectories
    from robocov_app.render.theme import theme_named

    records, times = [run.record for run in runs], [run.final_time for run in runs]
    finals = [float(run.history.mean_distance[-1]) for run in runs]
    theme, size = theme_named(options.theme), options.picture_size()
    curves = [
        (run.record.label, run.record.controller, run.history.time, run.history.mean_distance) for run in runs
    ]

    def trajectories() -> Figure:
        if comparison:
            return plot_comparison(records, theme, options.colours, size, finals, times)
        return plot_trajectories(records[0], None, theme, options.colours, size, finals[0], times[0])

    def costs() -> Figure:
        n = len(records[0].team)
        title = f"Coverage cost  ·  {records[0].environment.name}  ·  {n} robot{'s' if n > 1 else ''}"
        return plot_coverage(curves, last_moments(runs, cost), theme, size, title, time_curves(runs))

    save_figures(folder, {"trajectories": trajectories, "cost": costs}, quiet=options.json)


def last_moments(runs: Sequence[Run], cost: CoverageCost) -> list[Moment]:
    """Return the last moments of runs, to be drawn, with what `cost` knows of the map of the first.

    The others are on the same map, but for robots that failed at other places.
    """
    from robocov_app.figures.coverage import Moment
    from robocov_app.render.distance_field import Field, FieldLattice

    drawn, moments = runs[0].record.environment, []
    cost = cost_for_pictures(drawn, cost)
    for run in runs:
        record = run.record
        if record.environment != drawn:
            drawn = record.environment
            cost = built_cost(drawn, cost.lattice, quiet=True)
        momentary, time = MomentaryCost(cost), float(record.time[-1])
        counted = momentary.counted(time, record.positions[-1], record.working[-1])
        if not counted.any():
            continue
        now, rows = momentary.at(time), np.flatnonzero(counted)
        field = Field(FieldLattice(now.sites), now(record.positions[-1][rows]))
        some = None if counted.all() else rows
        moments.append(
            Moment.last_of(record, field, float(run.history.mean_distance[-1]), some, run.final_time)
        )
    return moments


def time_curves(runs: Sequence[Run]) -> list[Curve]:
    """Return the curves of the mean time of runs; none where robots are equally fast, or none worked."""
    return [
        (run.record.label, run.record.controller, run.history.time, run.history.mean_time)
        for run in runs
        if run.history.mean_time is not None and np.isfinite(run.history.mean_time).any()
    ]


def save_figures(folder: Path, figures: Mapping[str, Callable[[], Figure]], *, quiet: bool) -> None:
    """Draw each figure and write it as PNG and SVG under its name."""
    from robocov_app.figures.files import save_figure

    with progress("pictures", 2 * len(figures), quiet=quiet) as update:
        done = counting(update)
        for stem, draw in figures.items():
            figure = draw()
            for suffix in (".png", ".svg"):
                save_figure(figure, folder / (stem + suffix))
                done()
