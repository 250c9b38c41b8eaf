"""One headless run: simulate, evaluate, save its numbers."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import nullcontext, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robocov.cost import CoverageCost
from robocov.files.result_folder import ResultFolder
from robocov.metrics import CostHistory, compute_cost_history, select_sampled_moments, summarize
from robocov.metrics.cost_history import DEFAULT_RATE_HZ
from robocov.record import Record
from robocov.scenario import Scenario
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import finite, write_csv
from robocov_app.terminal.progress import counting, progress

if TYPE_CHECKING:  # not for the processes of a sweep
    from robocov_app.runs.options import RunOptions

STOPPED_SAMPLES = 200  # samples of the coverage cost of a run that was stopped


@dataclass(frozen=True, eq=False)
class Run:
    """A finished (or stopped) run with its evaluation."""

    record: Record
    history: CostHistory
    summary: dict[str, Any]

    @property
    def final_time(self) -> float | None:
        """Mean time until the first robot is there at the end, s; None where all are equally fast."""
        return None if self.history.mean_time is None else float(self.history.mean_time[-1])


def evaluated(record: Record, cost: CoverageCost, stop: Interruption, *, quiet: bool) -> Run:
    """Evaluate the coverage cost along a record, after Ctrl-C at fewer moments, and sum the run up."""
    rate = DEFAULT_RATE_HZ
    if stop.requested and record.time[-1] > 0:
        rate = min(rate, STOPPED_SAMPLES / float(record.time[-1]))
    with progress("coverage cost", len(select_sampled_moments(record, rate)), quiet=quiet) as update:
        history = compute_cost_history(record, cost, rate, counting(update))
    return Run(record, history, summarize(record, history))


def saved_run(
    scenario: Scenario,
    cost: CoverageCost,
    into: ResultFolder,
    part: str,
    options: RunOptions,
    stop: Interruption,
) -> Run:
    """Simulate and evaluate up to the end or to Ctrl-C, and save the numbers in a part of a folder."""
    simulation, quiet = scenario.build_simulation(), options.json
    # what a user's controller prints must not get among the answer
    chatter = redirect_stdout(sys.stderr) if quiet else nullcontext()
    with (
        chatter,
        progress(f"simulating {simulation.controller.label}", scenario.steps, quiet=quiet) as update,
    ):

        def watch(step: int) -> bool:
            if step % 10 == 0 or step == scenario.steps or stop.requested:
                update(step)
            return stop.requested

        record = scenario.run(simulation, every=options.record_every, should_stop=watch)
    record.save(into.staging / part)
    into.save_progress()  # what took long is safe, whatever happens to the evaluation
    run = evaluated(record, cost, stop, quiet=quiet)
    save_numbers(run, into.staging / part, options.lattice)
    into.save_progress()
    return run


def save_numbers(run: Run, folder: Path, lattice: int) -> None:
    """Write ``record.npz``, ``run.json`` and ``cost.csv``; the summary depends on the lattice."""
    run.record.save(folder, finite(run.summary), lattice=lattice)
    write_csv(folder / "cost.csv", *cost_table(run.history))


def cost_table(history: CostHistory) -> tuple[str, Iterator[tuple[float, ...]]]:
    """Return the header and the rows of ``cost.csv``; where robots are not equally fast, with times."""
    columns = {"time_s": history.time, "mean_distance_m": history.mean_distance, "cost_m3": history.cost}
    columns["uncovered_area_m2"] = history.uncovered_area
    if history.mean_time is not None:
        columns["mean_time_s"] = history.mean_time
    return ",".join(columns), zip(*(column.tolist() for column in columns.values()), strict=True)
