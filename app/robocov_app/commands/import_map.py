"""`robocov import`."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Literal

import tyro

from robocov.errors import InputError, one_line
from robocov.mapfile import save_map
from robocov.robots import DEFAULT_RADIUS
from robocov_app.figures.files import check_figure_path
from robocov_app.formats import IMPORTERS, ReadOptions, Shaping, import_map
from robocov_app.runs.options import JsonOption
from robocov_app.terminal.output import require_fresh
from robocov_app.terminal.progress import progress


@dataclass
class Arguments(JsonOption):
    """Turn a foreign map file into a map JSON, and say what was dropped, repaired and changed.

    The format is known from the content, or else the suffix. What an option has no meaning for is refused.

      ros        YAML of ROS map_server with its PGM or PNG: --unknown --threshold --anywhere
      movingai   .map of Moving AI's benchmarks: --cell --trees --water
      picture    PNG, JPEG, BMP, TIFF, PGM, PPM of a plan, dark is an obstacle: --cell --threshold
                 --invert --unknown
      stage, argos, irsim
                 worlds of these simulators, robots as a start: --only --skip --anywhere
      tmx        map of Tiled, --only LAYER says which tiles are solid: --cell --scale --skip --thickness
      houseexpo  JSON with "verts" in metres
      osm        OpenStreetMap's buildings, water and barriers: --water --thickness --pillar --skip
      wkt, geojson, svg, dxf, rings
                 drawings and geometries: --scale --thickness --outlines --boundary --around and others;
                 a wrong one is answered with those that there are

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

    simplify: float | None = None
    """Walls may move by so many metres, and corners by twice as much, where that saves vertices; 0 keeps
    all. By default one cell of a grid, 0.02 of the rest."""
    specks: float | None = None
    """Obstacles smaller than so many m² are dropped. By default single cells of ROS maps and JPEGs are, else
    none."""
    keep: Literal["largest", "all"] = "largest"
    """Which connected parts of the free space stay."""
    inside: Annotated[tuple[float, float] | None, tyro.conf.arg(metavar="X Y")] = None
    """The part of the free space that holds this place, in the map's metres, stays instead of the largest."""
    hull: bool = False
    """The boundary is the convex hull of the free space, not its outline."""
    margin: float = 0.0
    """So many metres around the free space are solid."""
    radius: float = DEFAULT_RADIUS
    """Radius of a robot in metres: where it passes in FILE, it passes in the map."""
    default_start: Literal["room", "uniform"] = "room"
    """The map's default start: a disc at the roomiest place, or anywhere."""

    cell: float | None = None
    """Side of a cell or pixel, or width of a tile, in metres. By default MovingAI's and Tiled's have 1."""
    unknown: Literal["obstacle", "free", "cut"] | None = None
    """What unknown or transparent cells are; with cut the map ends where the known cells end."""
    threshold: float | None = None
    """From 0 to 1. What is darker in a picture is an obstacle; what is occupied with this probability in
    a ROS map of mode scale or raw is one. 0.5 by default."""
    invert: bool = False
    """In a picture light is an obstacle, not dark."""
    trees: Literal["obstacle", "free"] | None = None
    """Whether trees (T) in a MovingAI grid are obstacles (the default)."""
    water: Literal["obstacle", "free"] | None = None
    """Whether water (W) in a MovingAI grid, or of OpenStreetMap, is an obstacle (the default)."""
    anywhere: bool = False
    """Pictures and includes that a file names may be outside of its folder."""

    scale: float | None = None
    """Metres that a unit of a drawing, or a pixel of a TMX, stands for."""
    units: Literal["metres", "degrees"] | None = None
    """What the coordinates of GeoJSON are, whatever it says of itself."""
    thickness: float | None = None
    """Width in metres of walls that are drawn as lines."""
    pillar: float | None = None
    """Radius in metres of a pillar for each point; without it points are left out."""
    outlines: Literal["free", "solid"] | None = None
    """What closed outlines of a drawing are, but for the boundary."""
    boundary: str | None = None
    """Name, id, class or layer of the shape that is the outer boundary."""
    around: float | None = None
    """Room in metres around the shapes where none of them is the boundary."""
    only: tuple[str, ...] | None = None
    """Names, ids, classes or layers that are read; all else is left out."""
    skip: tuple[str, ...] | None = None
    """Names, ids, classes or layers that are left out."""
    hatches: bool = False
    """Hatches are areas, as outlines are."""

    overwrite: bool = False
    """Replace existing files."""


def command(options: Arguments) -> None:
    """Import, save and report."""
    if options.format is not None and options.format not in IMPORTERS:
        known = ", ".join(IMPORTERS)
        raise InputError(f"--format: {one_line(options.format)!r}, but one of {known} was wanted")
    out = Path(f"{options.file.stem}.json") if options.out is None else options.out
    require_fresh(out, "another -o", overwrite=options.overwrite, source=options.file)
    if options.preview is not None:
        check_figure_path(options.preview)
        require_fresh(options.preview, "another --preview", overwrite=options.overwrite, source=options.file)
    quiet = options.json or not sys.stderr.isatty()
    with progress("importing", 3, quiet=quiet) as done:
        environment, report, foreign = import_map(
            options.file, format=options.format, options=_read_options(options), shaping=_shaping(options)
        )
        done(1)
        save_map(environment, out)
        done(2)
        if options.preview is not None:
            from robocov_app.formats.preview import preview

            preview(foreign, environment, report, options.preview)
        done(3)
    files = {"out": str(out)} | ({} if options.preview is None else {"preview": str(options.preview)})
    if options.json:
        print(json.dumps({**files, **report.to_dict()}))
        return
    for line in report.lines():
        print(line)
    print(f"saved in {' and '.join(files.values())}")


def _read_options(options: Arguments) -> ReadOptions:
    """Return what was given for the file; a switch that is off was not given."""
    given = {field.name: getattr(options, field.name) for field in fields(ReadOptions)}
    return ReadOptions(**{name: None if value is False else value for name, value in given.items()})


def _shaping(options: Arguments) -> Shaping:
    return Shaping(**{field.name: getattr(options, field.name) for field in fields(Shaping)})
