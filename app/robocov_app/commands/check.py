"""`robocov check`."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from typing import Annotated, Any

import tyro

from robocov.errors import InputError
from robocov.mapcheck import MapReport, check_map
from robocov.mapfile import load_map


@dataclass
class Arguments:
    """Validate maps; print area, free area, vertices, components and the narrowest gap of each.

    The exit status is 2 when one of them is not a valid map. Warnings (a gap that is narrower than
    a robot, say) do not make a map invalid.

    Example: robocov check mine.json rooms
    """

    files: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="MAP ...")] = ()
    """Map files, or names of bundled maps."""
    json: bool = False
    """Print one JSON object and nothing else."""


def command(options: Arguments) -> int:
    """Check each, and say what is wrong with all that are wrong."""
    if not options.files:
        raise InputError("check: at least one map file was wanted")
    rows: list[dict[str, Any]] = []
    failed = False
    for name in options.files:
        try:
            report = check_map(load_map(name))
        except InputError as error:
            failed = True
            rows.append({"map": name, "valid": False, "error": str(error)})
            if not options.json:
                print(f"robocov: error: {error}", file=sys.stderr)
            continue
        rows.append({"map": name, "valid": True, **report.to_dict()})
        if not options.json:
            print_report(name, report)
    if options.json:
        print(json.dumps({"maps": rows}, indent=1))
    return 2 if failed else 0


def print_report(name: str, report: MapReport) -> None:
    """Print a report for people."""
    print(f"{name}: valid")
    rows = [
        ("name", report.name),
        ("area", f"{report.area:.6g} m²"),
        ("free area", f"{report.free_area:.6g} m² ({report.free_fraction:.1%})"),
        ("obstacles", f"{report.obstacles}, with {report.vertices} vertices (boundary included)"),
        ("components", _components(report)),
        ("narrowest gap", _gap(report)),
        *(
            (f"start {start.name}", f"{start.kind}, room for about {start.capacity}")
            for start in report.starts
        ),
        *(("warning", warning) for warning in report.warnings),
    ]
    width = max(len(title) for title, _ in rows)
    for title, value in rows:
        print(f"  {title:<{width}}  {value}")


def _components(report: MapReport) -> str:
    areas = ", ".join(f"{area:.6g} m²" for area in report.components[:5])
    more = ", ..." if len(report.components) > 5 else ""
    return f"{len(report.components)} ({areas}{more})"


def _gap(report: MapReport) -> str:
    if report.narrowest_gap is None:
        return "none"
    (a, b), (c, d) = report.narrowest_gap.between
    return f"{report.narrowest_gap.width:.3f} m, between [{a:.4g}, {b:.4g}] and [{c:.4g}, {d:.4g}]"
