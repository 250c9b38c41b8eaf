"""`robocov report`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from robocov.errors import InputError, OutputError, ParameterError, format_count
from robocov.files.result_folder import extend_result, is_report
from robocov.files.result_names import REPORT_FILE
from robocov.files.writing import replace_file, resolve_target
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import echo, print_answer
from robocov_app.terminal.progress import show_progress

if TYPE_CHECKING:
    from robocov_app.report.results.result import ReportedResult

_SESSION_SUFFIX = ".robocov"
"""Suffix of session files."""


@dataclass
class Arguments(JsonOption):
    """Build one HTML page of runs, comparisons, sweeps and sessions, with interactive replay; works offline.

    Example: robocov report sweeps/rooms --out rooms.html
    """

    folders: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="DIR [DIR ...]")]
    """Folders of runs, comparisons and sweeps, and session files (all branches); one section each."""
    out: Path | None = None
    """The page; by default report.html in the folder, or next to the folders if there are several."""
    overwrite: bool = False
    """Replace a file that is not a report; an earlier report is always replaced."""
    title: str | None = None
    """Page title; by default a description of the runs."""
    theme: Literal["auto", "light", "dark"] = "auto"
    """Colors; auto follows the reader's preference."""
    optimum: bool = False
    """Search for the best placement on each map, a few seconds each; cached ones are always used."""


def command(options: Arguments) -> None:
    """Run `robocov report`."""
    if not options.folders:
        raise ParameterError("DIR: expected the folder of a run, a comparison or a sweep")
    target = options.out or _choose_target(options.folders)
    if target.parent not in options.folders:
        check_target(target, overwrite=options.overwrite)
    with TemporaryDirectory(prefix="robocov-") as temporary:
        scratch = Path(temporary)
        sections = [section for path in options.folders for section in _find_sections(path, scratch)]
        _write_report(options, sections, target, scratch)


def _choose_target(sources: Sequence[Path]) -> Path:
    """Return the default file for the page about folders and sessions.

    A page about several of them is not saved in the first folder, where it would replace the page about this
    folder alone. It is saved next to them, or in the current folder if they have different parents.
    """
    source = sources[0]
    if len(sources) > 1:
        parents = {path.parent for path in sources}
        return parents.pop() / REPORT_FILE if len(parents) == 1 else Path(REPORT_FILE)
    if source.suffix == _SESSION_SUFFIX:
        return source.with_suffix(".html")
    return source / REPORT_FILE


def _find_sections(path: Path, scratch: Path) -> list[tuple[Path, str]]:
    """Return the result folders at a path, each with a description.

    If the path is a session, its branches are simulated first, into the scratch folder. A branch has one
    result folder for each of its parts.
    """
    from robocov_app.viewer.branch_output.folders import list_part_folders

    if path.suffix != _SESSION_SUFFIX:
        return list_part_folders(path)
    from robocov_app.commands import run

    run_options = run.Arguments(map=str(path), out=scratch / path.stem, all_branches=True, json=True)
    with Interruption() as interruption:
        branch_folders = [Path(answer["out"]) for answer in run.save_branches(run_options, interruption)]
    return [section for folder in branch_folders for section in list_part_folders(folder)]


def _write_report(
    options: Arguments, sections: Sequence[tuple[Path, str]], target: Path, scratch: Path
) -> None:
    """Load the results, write the page, and print the answer."""
    from robocov_app.report.document import build_report
    from robocov_app.report.results.loading import load_result

    results = [replace(load_result(folder), description=description) for folder, description in sections]
    check_target(target, overwrite=options.overwrite)
    results = _read_runs(options, results)
    _check_damaged_runs(options, results)
    results = _add_references(options, results)
    page = build_report(results, title=options.title, theme=options.theme)
    content = page.html.encode("utf-8", "replace")
    # A report in the folder of a run is registered as a file of the run, so that it is replaced together
    # with the run.
    run_folder = None
    if target == options.folders[0] / REPORT_FILE and results[0].kind != "sweep":
        run_folder = options.folders[0]
    replaced = ", replacing an earlier report" if target.exists() else ""
    _write_page(content, target, run_folder)
    counts = []
    lines = []
    for (folder, _), result, shown in zip(sections, results, page.shown, strict=True):
        counts.append(_count_runs(result, _name_folder(folder, scratch), shown))
        lines.append(_describe_result(result, _name_folder(result.folder, scratch)))
    answer = {"path": str(target), "bytes": len(content), "results": counts}
    print_answer(options, answer, *lines, f"saved in {target} ({len(content) / 1e6:.2f} MB){replaced}")


def _read_runs(options: Arguments, results: Sequence[ReportedResult]) -> list[ReportedResult]:
    """Read all runs, about 10 ms each; return the results with unreadable runs marked as damaged."""
    readable_results = []
    for result in results:
        is_quiet = options.json or result.kind != "sweep"
        with show_progress("runs read", len(result.completed_runs), quiet=is_quiet) as update:
            readable_results.append(result.drop_unreadable(update))
    return readable_results


def _check_damaged_runs(options: Arguments, results: Sequence[ReportedResult]) -> None:
    """Print a warning for each damaged run.

    Raises
    ------
    InputError
        If all runs are damaged.
    """
    damaged_runs = [(result.folder, run) for result in results for run in result.damaged_runs]
    if not any(result.runs for result in results):
        folder, run = damaged_runs[0]
        raise InputError(f"{folder}: {run.folder}: {run.reason}; no runs remain to report")
    if options.json:
        return
    for folder, run in damaged_runs:
        echo(f"robocov: warning: {folder}: {run.folder} is skipped: {run.reason}", to_stderr=True)


def _add_references(options: Arguments, results: Sequence[ReportedResult]) -> list[ReportedResult]:
    """Return the results with the best placements, from the cache or, with ``--optimum``, by a search."""
    from robocov_app.report.results.references import add_references

    complete_results = []
    for result in results:
        settings = {run.setting for run in result.completed_runs}
        is_quiet = options.json or not options.optimum
        with show_progress("searching", len(settings), quiet=is_quiet) as update:
            complete_results.append(add_references(result, search=options.optimum, report_progress=update))
    return complete_results


def _write_page(content: bytes, target: Path, run_folder: Path | None) -> None:
    """Write the page. If `run_folder` is given, the page becomes one of the files of that run."""
    with ExitStack() as stack:
        if run_folder is not None:
            result = stack.enter_context(extend_result(run_folder))
            result.claim_file(REPORT_FILE)
            target = result.staging / REPORT_FILE
        stack.enter_context(replace_file(target)).write_bytes(content)


def _name_folder(folder: Path, scratch: Path) -> str:
    """Return the path of a folder, relative to the scratch folder if it is inside."""
    if folder.is_relative_to(scratch):
        folder = folder.relative_to(scratch)
    return str(folder)


def _count_runs(result: ReportedResult, folder: str, shown: int) -> dict[str, Any]:
    """Return the numbers of runs in a section of the page, as JSON content."""
    return {
        "folder": folder,
        "kind": result.kind,
        "runs": len(result.completed_runs),
        "failed": len(result.failed_runs),
        "damaged": [run._asdict() for run in result.damaged_runs],
        "missing": result.missing_count,
        "shown": shown,
    }


def _describe_result(result: ReportedResult, folder: str) -> str:
    """Return the numbers of runs in a section of the page as text."""
    kind = result.kind
    count = format_count(len(result.completed_runs), "run")
    texts = [f"{folder}: {kind}" if kind == "run" else f"{folder}: {kind} of {count}"]
    if result.failed_runs:
        texts.append(f"{len(result.failed_runs)} failed")
    if result.damaged_runs:
        texts.append(f"{len(result.damaged_runs)} cannot be read")
    if result.missing_count:
        texts.append(f"{result.missing_count} of {result.expected_count} missing")
    return ", ".join(texts)


def check_target(target: Path, *, overwrite: bool) -> None:
    """Check that a page may be written, before any work is done.

    Parameters
    ----------
    target : Path
        File for the page. An earlier report may always be replaced.
    overwrite : bool
        Whether a file that is not a report may be replaced.

    Raises
    ------
    InputError
        If the file exists and may not be replaced.
    OutputError
        If the folder of the file does not exist.
    """
    resolve_target(target)
    if not target.parent.is_dir():
        raise OutputError(f"{target}: cannot be written: there is no folder {target.parent}")
    if target.exists() and not overwrite and not is_report(target):
        advice = "choose another --out or pass --overwrite"
        raise InputError(f"{target}: the file is not a report of robocov; {advice}")
