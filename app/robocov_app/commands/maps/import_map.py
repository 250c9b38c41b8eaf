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
    """Turn a foreign map file into a map JSON, and say what was dropped, repaired and changed.

    The format is known from the content, or else the suffix. What an option has no meaning for is refused.

      ros        YAML of ROS map_server with its PGM or PNG: --unknown --threshold --anywhere
      movingai   .map of Moving AI's benchmarks: --cell --trees --water
      picture    PNG, JPEG, BMP, TIFF, PGM, PPM of a plan, dark is an obstacle: --cell --threshold
                 --invert --unknown --min-stroke --free-colour --solid-colour --ignore-colour
      stage, argos, irsim
                 worlds of these simulators, robots as a start: --only --skip --anywhere
      tmx        map of Tiled, --only LAYER says which tiles are solid: --cell --scale --skip --thickness
      houseexpo  JSON with "verts" in metres
      osm        OpenStreetMap's buildings, water and barriers, XML or the JSON of Overpass: --water
                 --thickness --pillar --skip; or the rooms of a floor: --level
      imdf       a floor of an indoor map, zip or folder: --level --thickness --only --skip
      wkt, geojson, svg, dxf, rings
                 drawings and geometries: --scale --thickness --outlines --boundary --around and others;
                 a wrong one is answered with those that there are; svg also by colour, as a picture

    --ignore-layer (or --skip) and --only choose by the name of a layer, group, class or shape; options of
    several values can be repeated.

    Example: robocov import office.yaml -o office.json --preview office.png
    """

    file: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="FILE")]
    """The foreign map."""
    out: Annotated[Path | None, tyro.conf.arg(aliases=["-o"], metavar="MAP.json")] = None
    """The map JSON to write; by default the name of FILE with .json, in this folder."""
    format: Annotated[str | None, tyro.conf.arg(metavar="NAME")] = None
    """The format of FILE, where its content does not say it."""
    preview: Annotated[Path | None, tyro.conf.arg(metavar="PICTURE")] = None
    """A picture (.png, .svg or .pdf) of the map as it was read and as it became."""
    overwrite: bool = False
    """Replace existing files."""
    read: tyro.conf.OmitArgPrefixes[ReadOptions] = field(default_factory=ReadOptions)
    shaping: tyro.conf.OmitArgPrefixes[Shaping] = field(default_factory=Shaping)


def command(options: Arguments) -> None:
    if options.format is not None and options.format not in IMPORTERS:
        known = ", ".join(IMPORTERS)
        raise InputError(f"--format: expected one of {known}, got {to_one_line(options.format)!r}")
    out = Path(f"{options.file.stem}.json") if options.out is None else options.out
    check_output_file(out, "another -o", overwrite=options.overwrite, source=options.file)
    if options.preview is not None:
        check_figure_path(options.preview)
        check_output_file(
            options.preview, "another --preview", overwrite=options.overwrite, source=options.file
        )
    with show_progress("importing", 3, quiet=options.json or not sys.stderr.isatty()) as done:
        environment, report, foreign = import_map(
            options.file, format=options.format, options=options.read, shaping=options.shaping
        )
        done(1)
        save_map(environment, out)
        done(2)
        if options.preview is not None:
            from robocov_app.formats.preview import preview

            preview(foreign, environment, report, options.preview)
        done(3)
    files = {"out": str(out)} | ({} if options.preview is None else {"preview": str(options.preview)})
    print_answer(
        options, files | report.to_dict(), *report.format_lines(), f"saved in {' and '.join(files.values())}"
    )
