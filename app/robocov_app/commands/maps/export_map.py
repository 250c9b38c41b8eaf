"""`robocov export`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from robocov.errors import InputError, to_one_line
from robocov.mapfile import load_map
from robocov_app.commands.options import JsonOption
from robocov_app.formats import EXPORTERS, WriteOptions, choose_exporter, export_map
from robocov_app.terminal.output import check_output_file, echo, print_answer


@dataclass
class Arguments(JsonOption):
    """Write a map in a foreign format, and say what that format cannot hold.

    The format is that of the suffix. What an option has no meaning for is refused.

      svg        .svg: boundary and obstacles by their ids, at true scale; --scale --digits
      geojson    .geojson: boundary and obstacles as features; --origin makes degrees; --digits
      wkt        .wkt: the free space as polygons with holes, as JuPedSim has it; --digits
      ros        .yaml: a map of ROS map_server, with its picture; --cell --mode --image
      movingai   .map: a grid of Moving AI's benchmarks; --cell
      picture    .png: a picture, obstacles black; --cell

    Example: robocov export office -o office.svg
    """

    map: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MAP")]
    """Path to a map JSON, or the name of a bundled map."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="FILE")]
    """The file to write."""
    format: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """The format, where the suffix does not say it."""
    overwrite: bool = False
    """Replace existing files."""
    write: tyro.conf.OmitArgPrefixes[WriteOptions] = field(default_factory=WriteOptions)


def command(options: Arguments) -> None:
    if options.format is not None and options.format not in EXPORTERS:
        known = ", ".join(EXPORTERS)
        raise InputError(f"--format: expected one of {known}, got {to_one_line(options.format)!r}")
    for file in choose_exporter(options.out, options.format).list_files(options.out, options.write):
        check_output_file(
            file, "another -o", overwrite=options.overwrite, source=Path(options.map), source_kind="map"
        )
    report = export_map(load_map(options.map), options.out, format=options.format, options=options.write)
    for line in report.warnings:
        echo(f"robocov: warning: {line}", to_stderr=True)
    print_answer(options, report.to_dict(), *report.format_lines())
