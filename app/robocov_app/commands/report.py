"""`robocov report`."""

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Literal

import tyro

from robocov.errors import InputError, OutputError, ParameterError, format_count
from robocov.files.result_folder import REPORT_FILE, extend_result, is_report
from robocov.files.writing import replace_file, resolve_target
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.interruption import Interruption
from robocov_app.terminal.output import echo, print_answer
from robocov_app.terminal.progress import show_progress

SESSION = ".robocov"


@dataclass
class Arguments(JsonOption):
    """One HTML page of runs, comparisons, sweeps and sessions, with interactive replay; it needs no network.

    Example: robocov report sweeps/rooms --out rooms.html
    """

    folders: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="DIR [DIR ...]")]
    """Folders of runs, comparisons and sweeps, and sessions of the window (all branches); a section each."""
    out: Path | None = None
    """The page; by default report.html in the (first) folder."""
    overwrite: bool = False
    """Replace a file that is no report; an earlier report is replaced anyway."""
    title: str | None = None
    """What stands above; by default what was run."""
    theme: Literal["auto", "light", "dark"] = "auto"
    """Colours; auto follows the reader's preference."""
    optimum: bool = False
    """Search for the best placement on each map, some seconds each; those found before are used anyway."""


def command(options: Arguments) -> None:
    if not options.folders:
        raise ParameterError("DIR: expected the folder of a run, a comparison or a sweep")
    first = options.folders[0]
    target = options.out or (first.with_suffix(".html") if first.suffix == SESSION else first / REPORT_FILE)
    if options.out is not None or first.suffix == SESSION:
        check_target(target, overwrite=options.overwrite)
    with TemporaryDirectory(prefix="robocov-") as temporary:
        parts = [part for path in options.folders for part in parts_of(path, Path(temporary))]
        write_report(options, parts, target, Path(temporary))


def parts_of(path: Path, temporary: Path) -> list[tuple[Path, str]]:
    """Return folders of results with words on each: of a story its parts, of a session all of them."""
    from robocov_app.viewer.headless import story_folders

    if path.suffix != SESSION:
        return story_folders(path)
    from robocov_app.commands import run

    words = run.Arguments(map=str(path), out=temporary / path.stem, all_branches=True, json=True)
    with Interruption() as stop:
        stories = [Path(answer["out"]) for answer in run.save_branches(words, stop)]
    return [part for story in stories for part in story_folders(story)]


def write_report(options: Arguments, parts: Sequence[tuple[Path, str]], target: Path, scratch: Path) -> None:
    """Gather the results of folders, and write the page; words tell which part of a story one is.

    Results in the `scratch` folder are called by their path in it: they are gone afterwards.
    """

    def called(folder: Path) -> str:
        return str(folder.relative_to(scratch) if folder.is_relative_to(scratch) else folder)

    from robocov_app.report.document import report
    from robocov_app.report.results import gathered, with_references

    results = [replace(gathered(folder), part=words) for folder, words in parts]
    check_target(target, overwrite=options.overwrite)
    for k, result in enumerate(results):  # reading all takes 10 ms a run
        quiet = options.json or result.kind != "sweep"
        with show_progress("runs read", len(result.fine), quiet=quiet) as update:
            results[k] = result.readable(update)
    damaged = [(result.folder, each) for result in results for each in result.damaged]
    if not any(result.entries for result in results):
        folder, each = damaged[0]
        raise InputError(f"{folder}: {each.folder}: {each.reason}; no run is left to report")
    for folder, each in () if options.json else damaged:
        echo(f"robocov: warning: {folder}: {each.folder} is left out: {each.reason}", to_stderr=True)
    for k, result in enumerate(results):
        quiet, total = options.json or not options.optimum, len({entry.setting for entry in result.fine})
        with show_progress("searching", total, quiet=quiet) as update:
            results[k] = with_references(result, search=options.optimum, tell=update)
    page = report(results, title=options.title, theme=options.theme)
    data = page.html.encode("utf-8", "replace")
    with ExitStack() as stack:
        if target == options.folders[0] / REPORT_FILE and results[0].kind != "sweep":
            more = stack.enter_context(extend_result(options.folders[0]))
            more.claim_file(REPORT_FILE)
            stack.enter_context(replace_file(more.staging / REPORT_FILE)).write_bytes(data)
        else:
            stack.enter_context(replace_file(target)).write_bytes(data)
    counts, lines = [], []
    for (folder, _), result, shown in zip(parts, results, page.shown, strict=True):
        runs, failed, lost = len(result.fine), len(result.failed), [each._asdict() for each in result.damaged]
        count = {"folder": called(folder), "kind": result.kind, "runs": runs, "failed": failed}
        counts.append(count | {"damaged": lost, "missing": result.missing, "shown": shown})
        words = [f"{called(result.folder)}: {result.kind} of {format_count(runs, 'run')}"]
        words += [f"{failed} failed"] * bool(failed) + [f"{len(lost)} cannot be read"] * bool(lost)
        words += [f"{result.missing} of {result.wanted} missing"] * bool(result.missing)
        lines.append(", ".join(words))
    answer = {"path": str(target), "bytes": len(data), "results": counts}
    print_answer(options, answer, *lines, f"written to {target} ({len(data) / 1e6:.2f} MB)")


def check_target(target: Path, *, overwrite: bool) -> None:
    """Raise InputError or OutputError, before any work is done, where no page may be written."""
    resolve_target(target)
    if not target.parent.is_dir():
        raise OutputError(f"{target}: cannot be written: there is no folder {target.parent}")
    if target.exists() and not overwrite and not is_report(target):
        wanted = "choose another --out or pass --overwrite"
        raise InputError(f"{target}: the file is no report of robocov; {wanted}")
