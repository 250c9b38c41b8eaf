"""`robocov check`."""

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

from robocov.errors import InputError, MapError, format_path
from robocov.mapfile import find_map_file, load_map
from robocov.mapfile.check import MapReport, check_map
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.file_watching import watch_files
from robocov_app.terminal.output import create_console, echo, print_answer

_LISTED = 5  # components whose areas are told


@dataclass
class Arguments(JsonOption):
    """Validate maps; print area, free area, vertices, components and the narrowest gap of each.

    The exit status is 2 when one of them is not a valid map. Each mistake is named with its line and
    column, as in mine.json:14:9. Warnings (a gap that is narrower than a robot, say) do not make a map
    invalid.

    With --watch the maps are checked again whenever they are saved, until Ctrl-C; what is not as it was
    before is told. With --json as well, each check is one JSON object on a line.

    Example: robocov check mine.json rooms
    """

    files: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="MAP ...")] = ()
    """Map files, or names of bundled maps."""
    watch: bool = False
    """Check again at each save."""


def command(options: Arguments) -> int:
    if not options.files:
        raise InputError("check: expected at least one map file")
    if options.watch:
        watch(options)
        return 0
    rows = []
    for name in options.files:
        outcome = _outcome(name)
        valid = isinstance(outcome, MapReport)
        rows.append(_row(name, outcome))
        if valid and not options.json:
            echo(f"{name}: valid", *_lines(outcome), sep="\n")
        for line in () if valid or options.json else _lines(outcome):
            echo(f"robocov: error: {line}", to_stderr=True)
    print_answer(options, {"maps": rows}, indent=1)
    return 0 if all(row["valid"] for row in rows) else 2


def watch(options: Arguments) -> None:
    """Check again at each save, and say what has changed since the map was last valid; Ctrl-C ends it."""
    names, output = {}, create_console()
    for name in options.files:
        try:
            names[find_map_file(name)] = name
        except MapError:
            names[Path(name)] = name
    outcomes: dict[str, MapReport | InputError] = {}
    valid: dict[str, MapReport] = {}
    for changed in watch_files(list(names)):
        former = dict(valid)
        fresh = {names[path]: _outcome(names[path]) for path in changed}
        outcomes |= fresh
        valid |= {name: each for name, each in fresh.items() if isinstance(each, MapReport)}
        if options.json:
            for name, outcome in fresh.items():
                echo(json.dumps(_row(name, outcome)), flush=True)
            continue
        if output.is_terminal:
            output.clear()
        for name, outcome in fresh.items():
            _show(output, f"{time.strftime('%H:%M:%S')}  {name}", outcome, former.get(name))
        if output.is_terminal:
            for name in (each for each in outcomes if each not in fresh):
                _show(output, name, outcomes[name])
            output.print("watching; Ctrl-C ends", style="dim")
        output.file.flush()


def _show(out: Console, title: str, outcome: MapReport | InputError, former: MapReport | None = None) -> None:
    told, colour = ("valid", "green") if isinstance(outcome, MapReport) else ("invalid", "red")
    out.print(f"{title}: {told}", style=f"bold {colour}", soft_wrap=True)
    for line in _lines(outcome, former):
        out.print(line, soft_wrap=True)


def _outcome(name: str) -> MapReport | InputError:
    try:
        return check_map(load_map(name))
    except InputError as error:
        return error


def _row(name: str, outcome: MapReport | InputError) -> dict[str, Any]:
    if isinstance(outcome, MapReport):
        return {"map": name, "valid": True, **outcome.to_dict()}
    row: dict[str, Any] = {"map": name, "valid": False, "error": str(outcome)}
    if isinstance(outcome, MapError):
        row |= {"line": outcome.line, "column": outcome.column}
        row["mistakes"] = [
            {"path": format_path(each.path), "text": each.text, "line": each.line, "column": each.column}
            for each in outcome.mistakes
        ]
        row["mistakes_not_listed"] = outcome.unlisted
    return row


def _lines(outcome: MapReport | InputError, former: MapReport | None = None) -> Iterator[str]:
    """Yield the lines of a report, or one for each mistake, in the order of the file."""
    if isinstance(outcome, MapReport):
        yield from report_lines(outcome, former)
    elif not isinstance(outcome, MapError) or not outcome.mistakes:
        yield str(outcome)
    else:
        for mistake in sorted(outcome.mistakes, key=lambda each: (each.line or 0, each.column or 0)):
            yield mistake.format_message(outcome.where)
        if outcome.unlisted:
            yield f"{outcome.where}: and {outcome.unlisted} more mistakes"


def report_lines(report: MapReport, former: MapReport | None = None) -> Iterator[str]:
    """Yield the lines of a report, with what was otherwise in one before the map was changed."""
    former = report if former is None else former
    rows, was, told = _rows(report), _rows(former), []
    for title, value in rows.items():
        told.append((title, value if was.get(title) == value else f"{value}, was {was.get(title, 'none')}"))
    told += [(title, f"none, was {value}") for title, value in was.items() if title not in rows]
    for warning in report.warnings:
        told.append(("warning", warning if warning in former.warnings else f"{warning} (new)"))
    told += [("no longer", warning) for warning in former.warnings if warning not in report.warnings]
    width = max(len(title) for title, _ in told)
    for title, value in told:
        yield f"  {title:<{width}}  {value}"


def _rows(report: MapReport) -> dict[str, str]:
    areas = [f"{area:.6g} m²" for area in report.components[:_LISTED]]
    areas += ["..."] * (len(report.components) > _LISTED)
    gap = "none"
    if report.narrowest_gap is not None:
        (a, b), (c, d) = report.narrowest_gap.between
        gap = f"{report.narrowest_gap.width:.3f} m, between [{a:.4g}, {b:.4g}] and [{c:.4g}, {d:.4g}]"
    rows = {
        "name": report.name,
        "area": f"{report.area:.6g} m²",
        "free area": f"{report.free_area:.6g} m² ({report.free_fraction:.1%})",
        "obstacles": f"{report.obstacles}, with {report.vertices} vertices (boundary included)",
        "components": f"{len(report.components)} ({', '.join(areas)})",
        "narrowest gap": gap,
    }
    if report.density is not None and report.density_range is not None:
        low, high = report.density_range
        rows["density"] = f"{report.density}, {low:.4g} to {high:.4g}, mean {report.mean_density:.4g}"
    starts = {f"start {each.name}": f"{each.kind}, room for about {each.capacity}" for each in report.starts}
    return rows | starts
