"""`robocov check`."""

import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self

import tyro
from rich.console import Console

from robocov.errors import InputError, MapError, place
from robocov.mapfile import load_map, map_file
from robocov.mapfile.check import MapReport, check_map
from robocov_app.runs.options import JsonOption
from robocov_app.terminal.output import console
from robocov_app.terminal.watch import changes

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


@dataclass(frozen=True)
class Outcome:
    """Outcome of checking a map: a report or an error."""

    name: str
    report: MapReport | None
    error: InputError | None = None

    @classmethod
    def of(cls, name: str) -> Self:
        """Check the map with a name."""
        try:
            return cls(name, check_map(load_map(name)))
        except InputError as error:
            return cls(name, None, error)

    def to_dict(self) -> dict[str, Any]:
        """Return it as a JSON document."""
        if self.report is not None:
            return {"map": self.name, "valid": True, **self.report.to_dict()}
        row: dict[str, Any] = {"map": self.name, "valid": False, "error": str(self.error)}
        if isinstance(self.error, MapError):
            row |= {"line": self.error.line, "column": self.error.column}
            row["mistakes"] = [
                {"path": place(each.path), "text": each.text, "line": each.line, "column": each.column}
                for each in self.error.mistakes
            ]
            row["mistakes_not_listed"] = self.error.unlisted
        return row

    def complaints(self) -> Iterator[str]:
        """Yield a line for each mistake, in the order of the file."""
        if not isinstance(self.error, MapError) or not self.error.mistakes:
            yield str(self.error)
            return
        for mistake in sorted(self.error.mistakes, key=lambda each: (each.line or 0, each.column or 0)):
            yield mistake.told(self.error.where)
        if self.error.unlisted:
            yield f"{self.error.where}: and {self.error.unlisted} more mistakes"


def command(options: Arguments) -> int:
    """Check each, and say what is wrong with all that are wrong."""
    if not options.files:
        raise InputError("check: at least one map file was wanted")
    if options.watch:
        watch(options)
        return 0
    outcomes = []
    for name in options.files:
        outcome = Outcome.of(name)
        outcomes.append(outcome)
        if outcome.report is not None and not options.json:
            print(f"{name}: valid", *report_lines(outcome.report), sep="\n")
        for line in () if outcome.report or options.json else outcome.complaints():
            print(f"robocov: error: {line}", file=sys.stderr)
    if options.json:
        print(json.dumps({"maps": [outcome.to_dict() for outcome in outcomes]}, indent=1))
    return 0 if all(outcome.report for outcome in outcomes) else 2


def watch(options: Arguments) -> None:
    """Check again at each save, and say what has changed since the map was last valid; Ctrl-C ends it."""
    names = {_path(name): name for name in options.files}
    output = console()
    outcomes: dict[str, Outcome] = {}
    valid: dict[str, MapReport] = {}
    for changed in changes(list(names)):
        former = dict(valid)
        fresh = {names[path]: Outcome.of(names[path]) for path in changed}
        outcomes |= fresh
        valid |= {name: each.report for name, each in fresh.items() if each.report is not None}
        if options.json:
            for outcome in fresh.values():
                print(json.dumps(outcome.to_dict()), flush=True)
            continue
        if output.is_terminal:
            output.clear()
        for name, outcome in fresh.items():
            _show(output, f"{time.strftime('%H:%M:%S')}  {name}", outcome, former.get(name))
        if output.is_terminal:
            for name in (name for name in outcomes if name not in fresh):
                _show(output, name, outcomes[name], outcomes[name].report)
            output.print("watching; Ctrl-C ends", style="dim")
        output.file.flush()


def _show(output: Console, title: str, outcome: Outcome, former: MapReport | None) -> None:
    told, colour = ("valid", "green") if outcome.report else ("invalid", "red")
    output.print(f"{title}: {told}", style=f"bold {colour}", soft_wrap=True)
    for line in report_lines(outcome.report, former) if outcome.report else outcome.complaints():
        output.print(line, soft_wrap=True)


def _path(name: str) -> Path:
    try:
        return map_file(name)
    except MapError:
        return Path(name)


def report_lines(report: MapReport, former: MapReport | None = None) -> Iterator[str]:
    """Yield the lines of a report, with what was otherwise in one before the map was changed."""
    rows, told = _rows(report), []
    if former is None:
        told = [*rows.items(), *(("warning", warning) for warning in report.warnings)]
    else:
        was = _rows(former)
        for title, value in rows.items():
            same = was.get(title) == value
            told.append((title, value if same else f"{value}, was {was.get(title, 'none')}"))
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
    return rows | {
        f"start {each.name}": f"{each.kind}, room for about {each.capacity}" for each in report.starts
    }
