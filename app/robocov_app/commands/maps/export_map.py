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
    """Export a map to another format, and report what that format cannot express.

    The format follows from the suffix. Inapplicable options are rejected.

      svg        .svg: boundary and obstacles with their ids, at true scale; --scale --digits
      geojson    .geojson: boundary and obstacles as features; degrees with --origin; --digits
      wkt        .wkt: the free space as polygons with holes, as in JuPedSim; --digits
      ros        .yaml: a map of ROS map_server, with its image; --cell --mode --image
      movingai   .map: a grid of the Moving AI benchmarks; --cell
      image      .png: an image with black obstacles; --cell

    Example: robocov export office -o office.svg
    """

    map: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MAP")]
    """Path of a map file, or the name of a bundled map."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="FILE")]
    """File to write."""
    format: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """Format; by default that of the suffix."""
    overwrite: bool = False
    """Replace existing files."""
    write: tyro.conf.OmitArgPrefixes[WriteOptions] = field(default_factory=WriteOptions)


def command(options: Arguments) -> None:
    """Run `robocov export`."""
    if options.format is not None and options.format not in EXPORTERS:
        known = ", ".join(EXPORTERS)
        raise InputError(f"--format: expected one of {known}, got {to_one_line(options.format)!r}")
    for file in choose_exporter(options.out, options.format).list_files(options.out, options.write):
        check_output_file(
            file, "another -o", overwrite=options.overwrite, source=Path(options.map), source_kind="map"
        )
    environment = load_map(options.map)
    report = export_map(environment, options.out, format=options.format, options=options.write)
    for warning in report.warnings:
        echo(f"robocov: warning: {warning}", to_stderr=True)
    print_answer(options, report.to_dict(), *report.format_lines())
