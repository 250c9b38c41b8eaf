"""Running the sweeps of a study, which can be interrupted and resumed at any time."""

import json
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path

from robocov.errors import InputError
from robocov.files.result_folder import report_folder_errors
from robocov.files.writing import replace_file
from robocov.kernel_compilation import compile_kernels
from robocov_app.replication.design.plan import Plan
from robocov_app.replication.results.references import References, find_references
from robocov_app.sweep import worker
from robocov_app.sweep.ledger import Ledger, open_ledger
from robocov_app.sweep.local_pool import LocalPool
from robocov_app.sweep.progress import SweepProgress, report_progress
from robocov_app.sweep.study.study import Study, StudyMap
from robocov_app.sweep.sweeping import execute_tasks, sweep
from robocov_app.sweep.tasks import Task, generate_tasks
from robocov_app.terminal.interruption import Interruption

STUDY_FILE = "paper.json"
"""File that marks a folder as the folder of a study, and says whether it is the quick or the full one."""
_HEAD = {"format": "robocov-paper", "version": 1}


class StudyInterrupted(Exception):  # noqa: N818 - it is no error
    """The user has pressed Ctrl+C."""


@dataclass(frozen=True)
class RunnerOptions:
    """Options for executing the runs of a study.

    Parameters
    ----------
    workers : int
        Maximum number of processes.
    scheduler : str or None
        Address of a Dask scheduler, whose workers execute the runs.
    quiet : bool
        Whether to show no progress.
    stop : Interruption
        Whether the user has interrupted the study.
    keep_versions : bool
        Whether to keep runs of other versions of robocov and its dependencies.
    """

    workers: int
    scheduler: str | None
    quiet: bool
    stop: Interruption
    keep_versions: bool = False

    def raise_if_stopped(self) -> None:
        """Raise StudyInterrupted if the user has interrupted the study."""
        if self.stop.requested:
            raise StudyInterrupted


def open_folder(folder: Path, plan: Plan) -> None:
    """Create the folder of a study, or check that an existing folder contains the same study.

    Raises
    ------
    InputError
        If the folder contains another study or anything else.
    """
    with report_folder_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        is_empty = not any(folder.iterdir())
    path = folder / STUDY_FILE
    if is_empty:
        with replace_file(path) as temporary:
            temporary.write_text(json.dumps({**_HEAD, "plan": plan.name}) + "\n", encoding="utf-8")
        return
    problem = "expected an empty folder or a study of the paper"
    with suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        content = json.loads(path.read_bytes())
        if content["format"] == _HEAD["format"]:
            if content["plan"] == plan.name:
                return
            problem = f"expected the {plan.name} study, got the {content['plan']} one"
    raise InputError(f"{folder}: {problem}; choose another --out")


def get_study_folder(folder: Path, name: str) -> Path:
    """Return the folder of a sweep within the folder of a study."""
    return folder / "studies" / name


def run_study(study: Study, folder: Path, name: str, options: RunnerOptions) -> Path:
    """Run a sweep, except for runs that are finished already, and return its folder.

    Raises
    ------
    StudyInterrupted
        If the user has interrupted the sweep.
    """
    target = get_study_folder(folder, name)
    sweep(
        study,
        target,
        title=f"paper: {name}",
        workers=options.workers,
        scheduler=options.scheduler,
        quiet=options.quiet,
        stop=options.stop,
        keep_versions=options.keep_versions,
    )
    options.raise_if_stopped()
    return target


def run_studies(studies: Mapping[str, Study], folder: Path, options: RunnerOptions, title: str) -> None:
    """Run several sweeps with one pool of processes.

    Most sweeps are so small that starting processes takes longer than their runs. Each sweep gets its own
    folder and table, as if it had been run alone.

    Parameters
    ----------
    studies : Mapping
        Sweeps by name.
    folder : Path
        Folder of the study.
    options : RunnerOptions
    title : str
        Title of the progress display.

    Raises
    ------
    StudyInterrupted
        If the user has interrupted the sweeps.
    """
    uses_pool = options.scheduler is None
    if uses_pool:
        _run_in_one_pool(studies, folder, options, title)
    options.raise_if_stopped()
    # After the pool, only the tables are left to be written, without progress.
    quiet = options.quiet or uses_pool
    for name, study in studies.items():
        run_study(study, folder, name, replace(options, quiet=quiet))


def _run_in_one_pool(studies: Mapping[str, Study], folder: Path, options: RunnerOptions, title: str) -> None:
    """Execute the unfinished runs of all sweeps in local processes; store each in all sweeps that have it."""
    tasks: dict[str, Task] = {}
    ledgers: dict[str, list[Ledger]] = {}  # Two sweeps may have a task in common.
    notes = []

    def store(task: Task, outcome: worker.Outcome) -> None:
        for ledger in ledgers[task.input_hash]:
            ledger.store(task, outcome)

    def open_pool() -> LocalPool:
        # Otherwise all processes would compile the same kernels.
        compile_kernels()
        return LocalPool(min(options.workers, len(tasks)))

    with ExitStack() as stack:
        for name, study in studies.items():
            ledger = stack.enter_context(open_ledger(get_study_folder(folder, name), study.to_json()))
            survey = ledger.survey(generate_tasks(study), keep_versions=options.keep_versions)
            for task in compress(generate_tasks(study), survey.must_execute):
                tasks[task.input_hash] = task
                ledgers.setdefault(task.input_hash, []).append(ledger)
            notes += [f"{name}: {line}" for line in survey.describe(keep_versions=options.keep_versions)]
        if not tasks and not notes:
            return
        progress = SweepProgress(len(tasks))
        reporter = stack.enter_context(report_progress(title, progress, quiet=options.quiet))
        for note in notes:
            reporter.print_line(note)
        for _ in execute_tasks(tasks.values(), open_pool, progress, options.stop, store):
            reporter.update(progress)


def find_map_references(
    maps: Sequence[StudyMap], folder: Path, plan: Plan, options: RunnerOptions
) -> References:
    """Return the reference placements of maps; those that are not stored yet are computed.

    Raises
    ------
    StudyInterrupted
        If the user has interrupted the search.
    """
    references = find_references(
        maps, folder / "references", plan, options.workers, options.stop, quiet=options.quiet
    )
    options.raise_if_stopped()
    return references
