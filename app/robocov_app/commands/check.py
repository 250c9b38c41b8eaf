"""`robocov check`."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from robocov.errors import InputError, MapError, place
from robocov.mapfile import load_map, map_file
from robocov.mapfile.check import MapReport, check_map
from robocov_app.terminal.watch import changes

if TYPE_CHECKING:
    from rich.console import Console


_LISTED = 5  # components whose areas are told


@dataclass
class Arguments:
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
    json: bool = False
    """Print one JSON object and nothing else."""


@dataclass(frozen=True)
class Outcome:
    """What came of checking a map: a report or an error."""

    name: str
    report: MapReport | None
    error: InputError | None = None

    @classmethod
    def of(cls, name: str) -> Outcome:
        """Return that of the map with a name."""
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
                {
                    "path": place(mistake.path),
                    "text": mistake.text,
                    "line": mistake.line,
                    "column": mistake.column,
                }
                for mistake in self.error.mistakes
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
        return _watch(options)
    outcomes = []
    for name in options.files:
        outcome = Outcome.of(name)
        outcomes.append(outcome)
        if options.json:
            continue
        if outcome.report is not None:
            print_report(name, outcome.report)
            continue
        for line in outcome.complaints():
            print(f"robocov: error: {line}", file=sys.stderr)
    if options.json:
        print(json.dumps({"maps": [outcome.to_dict() for outcome in outcomes]}, indent=1))
    return 0 if all(outcome.report for outcome in outcomes) else 2


def print_report(name: str, report: MapReport) -> None:
    """Print a report for people."""
    print(f"{name}: valid")
    for line in report_lines(report):
        print(line)


def _watch(options: Arguments) -> int:
    """Check again at each save; Ctrl-C ends it."""
    from robocov_app.terminal.tables import console

    names = {_path(name): name for name in options.files}
    output = console()
    outcomes: dict[str, Outcome] = {}
    valid: dict[str, MapReport] = {}
    for changed in changes(list(names)):
        blocks = {}
        for path in changed:
            name = names[path]
            outcome = outcomes[name] = Outcome.of(name)
            if options.json:
                print(json.dumps(outcome.to_dict()), flush=True)
            blocks[name] = (outcome, valid.get(name))
            if outcome.report is not None:
                valid[name] = outcome.report
        if not options.json:
            _show(output, blocks, outcomes)
    return 0


def _show(
    output: Console, blocks: dict[str, tuple[Outcome, MapReport | None]], outcomes: dict[str, Outcome]
) -> None:
    """Show what has changed; in a terminal, on a clean screen, and what has not below it."""
    if output.is_terminal:
        output.clear()
    for name, (outcome, former) in blocks.items():
        _print_block(output, f"{time.strftime('%H:%M:%S')}  {name}", outcome, former)
    if output.is_terminal:
        for name, outcome in outcomes.items():
            if name not in blocks:
                _print_block(output, name, outcome, outcome.report)
        output.print("watching; Ctrl-C ends", style="dim")
    output.file.flush()


def _print_block(output: Console, title: str, outcome: Outcome, former: MapReport | None) -> None:
    valid = outcome.report is not None
    output.print(
        f"{title}: {'valid' if valid else 'invalid'}",
        style="bold green" if valid else "bold red",
        soft_wrap=True,
    )
    for line in report_lines(outcome.report, former) if outcome.report else outcome.complaints():
        output.print(line, soft_wrap=True)


def _path(name: str) -> Path:
    """Return the file to watch; where there is none of that name, the one that may come."""
    try:
        return map_file(name)
    except MapError:
        return Path(name)


def report_lines(report: MapReport, former: MapReport | None = None) -> Iterator[str]:
    """Yield the lines of a report, with what was otherwise in one before the map was changed."""
    rows, was = _rows(report), {} if former is None else _rows(former)
    told = [(title, _changed(value, was.get(title), former)) for title, value in rows.items()]
    told += [(title, f"none, was {value}") for title, value in was.items() if title not in rows]
    before = () if former is None else former.warnings
    for warning in report.warnings:
        told.append(("warning", warning + (" (new)" if former and warning not in before else "")))
    told += [("no longer", warning) for warning in before if warning not in report.warnings]
    width = max(len(title) for title, _ in told)
    for title, value in told:
        yield f"  {title:<{width}}  {value}"


def _changed(value: str, was: str | None, former: MapReport | None) -> str:
    if former is None or value == was:
        return value
    return f"{value}, was {was or 'none'}"


def _rows(report: MapReport) -> dict[str, str]:
    return {
        "name": report.name,
        "area": f"{report.area:.6g} m²",
        "free area": f"{report.free_area:.6g} m² ({report.free_fraction:.1%})",
        "obstacles": f"{report.obstacles}, with {report.vertices} vertices (boundary included)",
        "components": _components(report),
        "narrowest gap": _gap(report),
        **({} if report.density is None else {"density": _density(report)}),
        **{
            f"start {start.name}": f"{start.kind}, room for about {start.capacity}" for start in report.starts
        },
    }


def _density(report: MapReport) -> str:
    assert report.density_range is not None
    low, high = report.density_range
    return f"{report.density}, {low:.4g} to {high:.4g}, mean {report.mean_density:.4g}"


def _components(report: MapReport) -> str:
    areas = ", ".join(f"{area:.6g} m²" for area in report.components[:_LISTED])
    more = ", ..." if len(report.components) > _LISTED else ""
    return f"{len(report.components)} ({areas}{more})"


def _gap(report: MapReport) -> str:
    if report.narrowest_gap is None:
        return "none"
    (a, b), (c, d) = report.narrowest_gap.between
    return f"{report.narrowest_gap.width:.3f} m, between [{a:.4g}, {b:.4g}] and [{c:.4g}, {d:.4g}]"
