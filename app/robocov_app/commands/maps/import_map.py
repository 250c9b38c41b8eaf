"""`robocov import`."""

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from robocov.errors import InputError, to_one_line
from robocov.mapfile import save_map
from robocov_app.commands.options import JsonOption
from robocov_app.figures.files import check_figure_path
from robocov_app.formats import IMPORTERS, ReadOptions, Shaping, import_map
from robocov_app.terminal.output import check_output_file, print_answer
from robocov_app.terminal.progress import show_progress


@dataclass
class Arguments(JsonOption):
    """Convert a map of another program, and report dropped, repaired and changed elements.

    The format is detected from the content, otherwise from the suffix. Inapplicable options are rejected.

      ros        YAML of ROS map_server with its PGM or PNG: --unknown --threshold --anywhere
      movingai   .map of the Moving AI benchmarks: --cell --trees --water
      image      PNG, JPEG, BMP, TIFF, PGM or PPM of a plan, dark pixels are obstacles: --cell --threshold
                 --invert --unknown --min-stroke --free-color --solid-color --ignore-color
      stage, argos, irsim
                 worlds of these simulators, robots become a start: --only --skip --anywhere
      coverage-control
                 density (.env) and robots (.pos of the same name) of CoverageControl: --cell
      tmx        map of Tiled, --only LAYER selects the solid tiles: --cell --scale --skip --thickness
      houseexpo  JSON with "verts" in meters
      osm        buildings, water and barriers of OpenStreetMap, XML or JSON of Overpass: --water
                 --thickness --pillar --skip; or the rooms of a floor: --level
      imdf       a floor of an indoor map, zip or folder: --level --thickness --only --skip
      wkt, geojson, svg, dxf, rings
                 drawings and geometries: --scale --thickness --outlines --boundary --around and others;
                 svg also accepts the color options of image

    --ignore-layer (or --skip) and --only select by the name of a layer, group, class or shape. Options with
    several values can be repeated.

    Example: robocov import office.yaml -o office.json --preview office.png
    """

    file: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="FILE")]
    """Map file of another program."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"], metavar="MAP.json")] = None
    """Map file to write; by default the name of FILE with .json, in the current folder."""
    format: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """Format of FILE; by default detected."""
    preview: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Figure (.png, .svg or .pdf) of the original map next to the converted one."""
    overwrite: bool = False
    """Replace existing files."""
    read: tyro.conf.OmitArgPrefixes[ReadOptions] = field(default_factory=ReadOptions)
    shaping: tyro.conf.OmitArgPrefixes[Shaping] = field(default_factory=Shaping)


def command(options: Arguments) -> None:
    """Run `robocov import`."""
    out = options.out
    if out is None:
        out = Path(f"{options.file.stem}.json")
    _check_options(options, out)
    is_quiet = options.json or not sys.stderr.isatty()
    with show_progress("importing", 3, quiet=is_quiet) as update:
        environment, report, foreign_map = import_map(
            options.file, format=options.format, options=options.read, shaping=options.shaping
        )
        update(1)
        save_map(environment, out)
        update(2)
        if options.preview is not None:
            from robocov_app.formats.preview import save_preview

            save_preview(foreign_map, environment, report, options.preview)
        update(3)
    files = {"out": str(out)}
    if options.preview is not None:
        files["preview"] = str(options.preview)
    saved = f"saved in {' and '.join(files.values())}"
    print_answer(options, {**files, **report.to_dict()}, *report.format_lines(), saved)


def _check_options(options: Arguments, out: Path) -> None:
    """Check the format and the output files before the import, which may take long."""
    if options.format is not None and options.format not in IMPORTERS:
        known = ", ".join(IMPORTERS)
        raise InputError(f"--format: expected one of {known}, got {to_one_line(options.format)!r}")
    check_output_file(out, "another -o", overwrite=options.overwrite, source=options.file)
    if options.preview is not None:
        check_figure_path(options.preview)
        check_output_file(
            options.preview, "another --preview", overwrite=options.overwrite, source=options.file
        )
