"""Running the benchmark: a sweep for each track, and a small file with all results."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from robocov.errors import InputError, OutputError
from robocov.files.result_names import RUNS_FOLDER
from robocov.files.writing import replace_file
from robocov_app.benchmark.rated_controller import RatedController, Selection
from robocov_app.benchmark.result_checks import Row, check_sent_bytes
from robocov_app.benchmark.results import (
    RESULT_FILE,
    RESULT_FORMAT,
    build_row,
    describe_method,
    identify_suite,
    read_result,
)
from robocov_app.sweep.ledger import Ledger
from robocov_app.sweep.study.study import Study
from robocov_app.sweep.sweeping import sweep
from robocov_app.sweep.tasks import generate_tasks
from robocov_app.sweep.worker import EFFORT_FILE
from robocov_app.terminal.interruption import Interruption

TRACKS_FOLDER = "tracks"
"""Folder of the sweeps, one for each track."""


def run_benchmark(
    controller: RatedController,
    selection: Selection,
    out: Path,
    *,
    stop: Interruption,
    workers: int | None = None,
    scheduler: str | None = None,
    quiet: bool = False,
) -> dict[str, Any] | None:
    """Run the benchmark, and write its result to ``result.json``.

    Runs that were finished by an earlier call are reused.

    Parameters
    ----------
    controller : RatedController
        The controller to rate.
    selection : Selection
        The runs of the suite.
    out : Path
        Folder for the runs and the result, which is created if it does not exist.
    stop : Interruption
        Ends the benchmark early when it is requested.
    workers : int, optional
        Maximum number of processes; by default one per processor.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers execute the runs.
    quiet : bool
        Whether to show no progress.

    Returns
    -------
    dict or None
        The result; None if the benchmark was interrupted.

    Raises
    ------
    InputError
        If the folder contains anything other than a benchmark, or the result of another controller or of
        other gains, or if robots send messages although the controller does not declare it.
    ParameterError
        If the controller, a track or a map is unknown.
    """
    _check_folder(out)
    studies = dict(controller.build_studies(selection))
    entry = controller.describe(next(iter(studies.values())))
    _check_entry(out, entry)
    rows: list[Row] = []
    for track, study in studies.items():
        folder = out / TRACKS_FOLDER / track
        summary = sweep(
            study, folder, title=track, stop=stop, workers=workers, scheduler=scheduler, quiet=quiet
        )
        if summary.interrupted:
            return None
        track_rows = list(_read_rows(track, study, folder))
        for row in track_rows:
            check_sent_bytes(row, entry["information"], f"{track} on {row['map']}")
        rows += track_rows
    result = _describe_result(entry, selection, controller.list_versions())
    _write_result(out / RESULT_FILE, result, rows)
    return {**result, "rows": rows}


def _describe_result(entry: dict[str, Any], selection: Selection, versions: dict[str, str]) -> dict[str, Any]:
    """Return a result without rows; `entry` is the description of the controller."""
    return {
        **RESULT_FORMAT,
        "suite": identify_suite(),
        "selection": {"quick": selection.quick, "tracks": selection.tracks, "maps": selection.maps},
        "entry": entry,
        "versions": versions,
        "method": describe_method(),
    }


def _check_folder(out: Path) -> None:
    """Raise InputError if a folder contains anything other than a benchmark."""
    foreign = set()
    if out.is_dir():
        foreign = {path.name for path in out.iterdir()} - {RESULT_FILE, TRACKS_FOLDER}
    if foreign or (out.exists() and not out.is_dir()):
        raise InputError(f"{out}: expected an empty folder or a benchmark; choose another --out")


def _check_entry(out: Path, entry: dict[str, Any]) -> None:
    """Raise InputError if a folder contains the result of another controller, or of other gains.

    A result of the same controller is replaced, also after its file has changed.
    """
    if not (out / RESULT_FILE).is_file():
        return
    expected = _name_entry(entry)
    present = _name_entry(read_result(out)["entry"])
    if present != expected:
        raise InputError(
            f"{out}: expected no result or that of {expected}, got that of {present}; choose another --out"
        )


def _name_entry(entry: dict[str, Any]) -> str:
    """Return the controller of an entry and the gains that were set."""
    gains = " ".join(f"{name}={value}" for name, value in sorted(entry["set"].items()))
    return f"{entry['controller']} with {gains}" if gains else entry["controller"]


def _read_rows(track: str, study: Study, folder: Path) -> Iterator[Row]:
    """Yield the rows of a finished sweep."""
    ledger = Ledger(folder)
    for task in generate_tasks(study):
        entry = ledger.read_entry(task)
        if entry is None:
            raise OutputError(f"{folder}: {task.name} was removed by another program")
        effort_path = folder / RUNS_FOLDER / task.name / EFFORT_FILE
        effort = effort_path.read_bytes() if effort_path.exists() else b"{}"
        yield build_row(track, task, entry, effort)


def _write_result(path: Path, result: dict[str, Any], rows: list[Row]) -> None:
    """Write a result as JSON with one line per run."""
    head = json.dumps(result, indent=1).removesuffix("\n}")
    lines = ",\n".join(json.dumps(row, allow_nan=False) for row in rows)
    with replace_file(path) as temporary:
        temporary.write_text(f'{head},\n "rows": [\n{lines}\n]}}\n', encoding="utf-8")
