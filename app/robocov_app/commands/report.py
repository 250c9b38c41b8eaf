"""`robocov report`."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from robocov.errors import InputError, OutputError, ParameterError, counted
from robocov.files.atomic import writable, written
from robocov.files.result_folder import REPORT, extended, is_report
from robocov_app.runs.options import JsonOption

if TYPE_CHECKING:
    from robocov_app.report.results import Result


@dataclass
class Arguments(JsonOption):
    """One HTML page of runs, comparisons and sweeps, with an interactive replay; it needs no network.

    Example: robocov report sweeps/rooms --out rooms.html
    """

    folders: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="DIR [DIR ...]")]
    """Folders of runs, comparisons or sweeps; several make a section each."""
    out: Path | None = None
    """The page; by default report.html in the (first) folder."""
    overwrite: bool = False
    """Replace a file that is no report; an earlier report is replaced anyway."""
    title: str | None = None
    """What stands above; by default what was run."""
    theme: Literal["auto", "light", "dark"] = "auto"
    """Colours; auto follows the reader's preference."""
    optimum: bool = False
    """Search for the centralised reference of each map and team, some seconds each, and tell how far every
    run stays above it; those that were found before are in the page anyway."""


def command(options: Arguments) -> None:
    """Read, draw and write."""
    if not options.folders:
        raise ParameterError("DIR: the folder of a run, a comparison or a sweep was wanted")
    from robocov_app.report.document import report
    from robocov_app.report.results import gathered

    target = options.folders[0] / REPORT if options.out is None else options.out
    if options.out is not None:
        check_target(target, overwrite=options.overwrite)
    results = [gathered(folder) for folder in options.folders]
    check_target(target, overwrite=options.overwrite)
    results = [_readable(result, quiet=options.json) for result in results]
    damaged = [(result.folder, each) for result in results for each in result.damaged]
    if not any(result.entries for result in results):
        folder, lost = damaged[0]
        raise InputError(f"{folder}: {lost.folder}: {lost.reason}; no run is left to report")
    for folder, lost in () if options.json else damaged:
        print(f"robocov: warning: {folder}: {lost.folder} is left out: {lost.reason}", file=sys.stderr)
    results = [_with_references(result, options) for result in results]
    page = report(results, title=options.title, theme=options.theme)
    data = page.html.encode("utf-8", "replace")
    if options.out is None and results[0].kind != "sweep":
        with extended(options.folders[0]) as result, written(result.new / REPORT) as part:
            result.claim(REPORT)
            part.write_bytes(data)
    else:
        with written(target) as part:
            part.write_bytes(data)
    if options.json:
        counts = [
            _counts(folder, result, shown)
            for folder, result, shown in zip(options.folders, results, page.shown, strict=True)
        ]
        print(json.dumps({"path": str(target), "bytes": len(data), "results": counts}))
        return
    for each in results:
        print(_told(each))
    print(f"written to {target} ({len(data) / 1e6:.2f} MB)")


def _readable(result: Result, *, quiet: bool) -> Result:
    """Return the result with its damaged runs apart; reading all takes 10 ms a run."""
    from robocov_app.terminal.progress import progress

    with progress("runs read", len(result.fine), quiet=quiet or result.kind != "sweep") as tell:
        return result.readable(tell)


def _with_references(result: Result, options: Arguments) -> Result:
    """Return the result with the references that are known, or searched for."""
    from robocov_app.report.results import with_references
    from robocov_app.terminal.progress import progress

    quiet, total = options.json or not options.optimum, len({entry.setting for entry in result.fine})
    with progress("searching", total, quiet=quiet) as tell:
        return with_references(result, search=options.optimum, tell=tell)


def check_target(target: Path, *, overwrite: bool) -> None:
    """Raise InputError or OutputError, before any work is done, where no page may be written."""
    writable(target)
    if not target.parent.is_dir():
        raise OutputError(f"{target}: cannot be written: there is no folder {target.parent}")
    if target.exists() and not overwrite and not is_report(target):
        raise InputError(
            f"{target}: the file is no report of robocov; another --out, or --overwrite, was wanted"
        )


def _counts(folder: Path, result: Result, shown: int) -> dict[str, object]:
    return {
        "folder": str(folder),
        "kind": result.kind,
        "runs": len(result.fine),
        "failed": len(result.failed),
        "damaged": [each._asdict() for each in result.damaged],
        "missing": result.missing,
        "shown": shown,
    }


def _told(result: Result) -> str:
    words = [f"{result.folder}: {result.kind} of {counted(len(result.fine), 'run')}"]
    if result.failed:
        words.append(f"{len(result.failed)} failed")
    if result.damaged:
        words.append(f"{len(result.damaged)} cannot be read")
    if result.missing:
        words.append(f"{result.missing} of {result.wanted} missing")
    return ", ".join(words)
