"""Execution of one scenario: simulation, evaluation, and saving of the numbers."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, nullcontext, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robocov.cost import CoverageCost
from robocov.files.result_folder import ResultFolder
from robocov.files.result_names import COST_FILE
from robocov.metrics import CostHistory, compute_cost_history, select_sampled_steps, summarize
from robocov.metrics.cost_history import DEFAULT_RATE_HZ
from robocov.record import Record
from robocov.scenario import Scenario
from robocov_app.runs.cost_table import build_cost_table
from robocov_app.runs.settings import OutputSettings
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import replace_non_finite, write_csv
from robocov_app.terminal.progress import make_counter, show_progress

MAX_SAMPLES_AFTER_INTERRUPTION = 200
"""Maximum number of samples of the coverage cost of an interrupted run, so that it ends soon."""
_STEPS_PER_PROGRESS_UPDATE = 10
"""Number of simulation steps between two updates of the progress display."""


@dataclass(frozen=True, eq=False)
class Run:
    """A finished or interrupted run with its evaluation.

    Attributes
    ----------
    record : Record
        The simulated run.
    history : CostHistory
        The coverage cost over the run.
    summary : dict
        Results of the run; see `summarize`.
    """

    record: Record
    history: CostHistory
    summary: dict[str, Any]

    @property
    def final_time(self) -> float | None:
        """Mean time until the first robot arrives, at the end of the run, s; None if speeds are equal."""
        return None if self.history.mean_time is None else float(self.history.mean_time[-1])


def execute_scenario(
    scenario: Scenario,
    cost: CoverageCost,
    result: ResultFolder,
    settings: OutputSettings,
    interruption: Interruption,
    *,
    subfolder: str = "",
) -> Run:
    """Simulate a scenario, evaluate the run, and save its numbers.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    cost : CoverageCost
        Cost of the scenario's map.
    result : ResultFolder
        Folder for the results.
    settings : OutputSettings
        Settings of the evaluation and of the files.
    interruption : Interruption
        The run ends early if an interruption is requested.
    subfolder : str
        Name of a subfolder of the result; empty for the result folder itself.

    Returns
    -------
    Run
    """
    record = _simulate(scenario, settings, interruption)
    record.save(result.staging / subfolder)
    # The simulation takes longest, so its record is saved before the evaluation starts.
    result.save_progress()
    run = evaluate_record(
        record, cost, limit_samples=is_partial_record(record, scenario), quiet=settings.hide_progress
    )
    save_numbers(run, result.staging / subfolder, settings.lattice)
    result.save_progress()
    return run


def _simulate(scenario: Scenario, settings: OutputSettings, interruption: Interruption) -> Record:
    """Simulate a scenario to its end, or until it is interrupted."""
    simulation = scenario.build_simulation()
    redirected: AbstractContextManager[Any] = nullcontext()
    if settings.hide_progress:
        # The output of a user's controller must not be mixed with the JSON on standard output.
        redirected = redirect_stdout(sys.stderr)
    title = f"simulating {simulation.controller.label}"
    with redirected, show_progress(title, scenario.steps, quiet=settings.hide_progress) as update:

        def report_step(step: int) -> bool:
            is_due = step % _STEPS_PER_PROGRESS_UPDATE == 0
            if is_due or step == scenario.steps or interruption.requested:
                update(step)
            return interruption.requested

        return scenario.run(simulation, every=settings.record_every, on_step=report_step)


def is_partial_record(record: Record, scenario: Scenario) -> bool:
    """Return whether a record has fewer steps than its scenario because the run was interrupted."""
    return round(float(record.time[-1]) / scenario.dt) < scenario.steps


def evaluate_record(record: Record, cost: CoverageCost, *, limit_samples: bool, quiet: bool) -> Run:
    """Compute the coverage cost along a record, and its summary.

    Parameters
    ----------
    record : Record
        The run.
    cost : CoverageCost
        Cost of the record's map.
    limit_samples : bool
        Whether to evaluate only about `MAX_SAMPLES_AFTER_INTERRUPTION` steps, so that an interrupted command
        ends soon.
    quiet : bool
        Whether to hide progress.

    Returns
    -------
    Run
    """
    rate = DEFAULT_RATE_HZ
    end = float(record.time[-1])
    if limit_samples and end > 0:
        rate = min(rate, MAX_SAMPLES_AFTER_INTERRUPTION / end)
    samples = len(select_sampled_steps(record, rate))
    with show_progress("coverage cost", samples, quiet=quiet) as update:
        history = compute_cost_history(record, cost, rate, make_counter(update))
    return Run(record, history, summarize(record, history))


def save_numbers(run: Run, folder: Path, lattice: int) -> None:
    """Write ``record.npz``, ``run.json`` and ``cost.csv``.

    Parameters
    ----------
    run : Run
        The evaluated run.
    folder : Path
        Folder of the files.
    lattice : int
        Number of lattice sites along each side of the map with which the cost was computed.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    run.record.save(folder, replace_non_finite(run.summary), lattice=lattice)
    write_csv(folder / COST_FILE, *build_cost_table(run.history))
