"""`robocov check`."""

import json
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console

from robocov.defaults import DEFAULT_RADIUS_M
from robocov.errors import (
    InputError,
    MapError,
    format_count,
    format_path,
    format_position,
    require_number,
)
from robocov.mapfile import find_map_file, load_map
from robocov.mapfile.check import MapReport, check_map
from robocov_app.commands.options import JsonOption
from robocov_app.terminal.file_watching import watch_files
from robocov_app.terminal.output import create_console, echo, print_answer

_MAX_LISTED_COMPONENTS = 5
"""Maximum number of components whose areas are printed."""
_MIN_UNREACHABLE_FRACTION = 1e-9
"""Smaller unreachable areas, as fractions of the free area, are rounding errors."""
_MIN_RADIUS_M = 1e-3
_MAX_RADIUS_M = 1e3
"""Limits of the radius of a robot, as in a team."""
_INVALID = 2
"""Exit status if a map is not valid."""


@dataclass
class Arguments(JsonOption):
    """Validate maps, and print area, free area, components, unreachable area and narrowest passage of each.

    The exit status is 2 if one of them is not a valid map. Errors are reported with line and column, as in
    mine.json:14:9. Warnings, such as a gap narrower than a robot, do not make a map invalid.

    With --watch the maps are checked again whenever they are saved, until Ctrl+C, and changes since the last
    valid state are marked. With --json as well, each check is one JSON object on a line.

    Example: robocov check mine.json rooms
    """

    files: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="MAP ...")] = ()
    """Paths of map files, or names of bundled maps."""
    watch: bool = False
    """Check again at each save."""
    radius: float = DEFAULT_RADIUS_M
    """Radius of a robot, m. Free space behind narrower gaps is unreachable."""

    def __post_init__(self) -> None:
        require_number("--radius", self.radius, _MIN_RADIUS_M, _MAX_RADIUS_M, "m")


def command(options: Arguments) -> int:
    """Run `robocov check`, and return its exit status."""
    if not options.files:
        raise InputError("check: expected at least one map file")
    if options.watch:
        _watch(options)
        return 0
    rows = []
    for name in options.files:
        outcome = _check(name, options.radius)
        rows.append(_build_row(name, outcome))
        if not options.json:
            _print_outcome(name, outcome)
    print_answer(options, {"maps": rows}, indent=1)
    if not all(row["valid"] for row in rows):
        return _INVALID
    return 0


def _check(name: str, radius: float) -> MapReport | InputError:
    """Return the report on a valid map, or the error that makes it invalid."""
    try:
        return check_map(load_map(name), radius)
    except InputError as error:
        return error


def _print_outcome(name: str, outcome: MapReport | InputError) -> None:
    """Print the report on a map; errors go to standard error."""
    lines = _format_outcome(outcome)
    if isinstance(outcome, MapReport):
        echo(f"{name}: valid", *lines, sep="\n")
        return
    for line in lines:
        echo(f"robocov: error: {line}", to_stderr=True)


def _watch(options: Arguments) -> None:
    """Check the maps, and each again whenever it is saved, until Ctrl+C.

    Changes since the last valid state of a map are marked.
    """
    names = _find_watched_files(options.files)
    console = create_console()
    outcomes: dict[str, MapReport | InputError] = {}
    valid_reports: dict[str, MapReport] = {}
    for changed_paths in watch_files(list(names)):
        new_outcomes = {names[path]: _check(names[path], options.radius) for path in changed_paths}
        outcomes.update(new_outcomes)
        if options.json:
            for name, outcome in new_outcomes.items():
                echo(json.dumps(_build_row(name, outcome)), flush=True)
        else:
            _display_outcomes(console, outcomes, new_outcomes, valid_reports)
        valid_reports.update(
            {name: outcome for name, outcome in new_outcomes.items() if isinstance(outcome, MapReport)}
        )


def _find_watched_files(names: tuple[str, ...]) -> dict[Path, str]:
    """Return the given names of the maps by the paths of their files, which need not exist yet."""
    files = {}
    for name in names:
        try:
            files[find_map_file(name)] = name
        except MapError:
            files[Path(name)] = name
    return files


def _display_outcomes(
    console: Console,
    outcomes: Mapping[str, MapReport | InputError],
    new_outcomes: Mapping[str, MapReport | InputError],
    previous_reports: Mapping[str, MapReport],
) -> None:
    """Display new outcomes and what has changed; in a terminal, on a clear screen and with all other maps."""
    if console.is_terminal:
        console.clear()
    clock_time = time.strftime("%H:%M:%S")
    for name, outcome in new_outcomes.items():
        _display(console, f"{clock_time}  {name}", outcome, previous_reports.get(name))
    if console.is_terminal:
        for name, outcome in outcomes.items():
            if name not in new_outcomes:
                _display(console, name, outcome)
        console.print("Watching for changes. Press Ctrl+C to stop.", style="dim")
    console.file.flush()


def _display(
    console: Console, title: str, outcome: MapReport | InputError, previous: MapReport | None = None
) -> None:
    """Display the verdict on a map and its details, with changes since the previous report."""
    if isinstance(outcome, MapReport):
        verdict = "valid"
        color = "green"
    else:
        verdict = "invalid"
        color = "red"
    console.print(f"{title}: {verdict}", style=f"bold {color}", soft_wrap=True)
    for line in _format_outcome(outcome, previous):
        console.print(line, soft_wrap=True)


def _build_row(name: str, outcome: MapReport | InputError) -> dict[str, Any]:
    """Build the JSON content about a map."""
    if isinstance(outcome, MapReport):
        return {"map": name, "valid": True, **outcome.to_dict()}
    row: dict[str, Any] = {"map": name, "valid": False, "error": str(outcome)}
    if isinstance(outcome, MapError):
        row["line"] = outcome.line
        row["column"] = outcome.column
        row["issues"] = [
            {
                "path": format_path(issue.path),
                "text": issue.text,
                "line": issue.line,
                "column": issue.column,
            }
            for issue in outcome.issues
        ]
        row["issues_not_listed"] = outcome.unlisted
    return row


def _format_outcome(outcome: MapReport | InputError, previous: MapReport | None = None) -> Iterator[str]:
    """Yield the lines of a report or, for an invalid map, a line for each issue in the order of the file."""
    if isinstance(outcome, MapReport):
        yield from format_report(outcome, previous)
    elif not isinstance(outcome, MapError) or not outcome.issues:
        yield str(outcome)
    else:
        issues = sorted(outcome.issues, key=lambda issue: (issue.line or 0, issue.column or 0))
        for issue in issues:
            yield issue.format_message(outcome.source_name)
        if outcome.unlisted:
            yield f"{outcome.source_name}: and {format_count(outcome.unlisted, 'more issue')}"


def format_report(report: MapReport, previous: MapReport | None = None) -> Iterator[str]:
    """Yield the lines of a report, with the changes since a previous one marked.

    Parameters
    ----------
    report : MapReport
        Report on the current state of the map.
    previous : MapReport or None
        Report on an earlier state of the map; by default nothing is marked.

    Yields
    ------
    str
    """
    if previous is None:
        previous = report
    lines = _mark_changed_rows(_format_rows(report), _format_rows(previous))
    for warning in report.warnings:
        text = warning
        if warning not in previous.warnings:
            text += " (new)"
        lines.append(("warning", text))
    lines += [("no longer", warning) for warning in previous.warnings if warning not in report.warnings]
    width = max(len(title) for title, _ in lines)
    for title, value in lines:
        yield f"  {title:<{width}}  {value}"


def _mark_changed_rows(rows: Mapping[str, str], previous_rows: Mapping[str, str]) -> list[tuple[str, str]]:
    """Return the titles and values of a report; changed values are followed by the previous value."""
    lines = []
    for title, value in rows.items():
        previous_value = previous_rows.get(title, "none")
        text = value
        if value != previous_value:
            text += f", was {previous_value}"
        lines.append((title, text))
    for title, previous_value in previous_rows.items():
        if title not in rows:
            lines.append((title, f"none, was {previous_value}"))
    return lines


def _format_rows(report: MapReport) -> dict[str, str]:
    """Return the values of a report as text, by title."""
    areas = [_format_area(area) for area in report.components[:_MAX_LISTED_COMPONENTS]]
    if len(report.components) > _MAX_LISTED_COMPONENTS:
        areas.append("...")
    rows = {
        "name": report.name,
        "area": _format_area(report.area),
        "free area": f"{_format_area(report.free_area)} ({report.free_fraction:.1%})",
        "obstacles": _format_obstacles(report),
        "components": f"{len(report.components)} ({', '.join(areas)})",
        "unreachable": _format_unreachable_area(report),
        "narrowest passage": _format_narrowest_gap(report),
    }
    if report.density_kind is not None and report.density_bounds is not None:
        low, high = report.density_bounds
        rows["density"] = f"{report.density_kind}, {low:.4g} to {high:.4g}, mean {report.mean_density:.4g}"
    for start in report.starts:
        rows[f'start "{start.name}"'] = (
            f"{start.kind}, space for about {format_count(start.capacity, 'robot')}"
        )
    return rows


def _format_unreachable_area(report: MapReport) -> str:
    """Return the area that no robot can reach, and the radius of the robots, as text."""
    fraction = report.unreachable_area / report.free_area
    if fraction < _MIN_UNREACHABLE_FRACTION:
        return f"none, for robots of radius {report.radius:g} m"
    area = _format_area(report.unreachable_area)
    return f"{area} ({fraction:.1%} of the free area), for robots of radius {report.radius:g} m"


def _format_obstacles(report: MapReport) -> str:
    """Format the number of obstacles. Walls that touch the boundary are not counted: they are part of it."""
    vertices = f"{report.vertex_count} vertices (boundary included)"
    if not report.obstacle_count:
        return f"0 separate obstacles, walls are part of the boundary; {vertices}"
    return f"{report.obstacle_count}, with {vertices}"


def _format_area(area: float) -> str:
    """Return an area as text: two decimals at most, or three significant digits if it is below 1 m²."""
    text = f"{round(area, 2):.10g}" if area >= 1.0 else f"{area:.3g}"
    return f"{text} m²"


def _format_narrowest_gap(report: MapReport) -> str:
    """Return the width of the narrowest passage, and the points at its ends, as text."""
    if report.narrowest_gap is None:
        return "none"
    start, end = report.narrowest_gap.between
    width = report.narrowest_gap.width
    return f"{width:.3f} m, between {format_position(*start)} and {format_position(*end)}"
