"""Foreign map formats, read and written.

A format is one module that reads, writes or does both, and a line in the tables here. What is read is a
`ForeignMap`: what is free, as the file has it; `robocov_app.formats.geometry.conversion` makes the
`Environment` of it, in the same way for all.
"""

from dataclasses import replace
from pathlib import Path

from robocov.environment import Environment
from robocov.errors import MapError, ParameterError, describe_unknown_name, format_count, to_one_line
from robocov_app.formats import (
    argos,
    dxf,
    files,
    geojson,
    houseexpo,
    imdf,
    irsim,
    movingai,
    osm,
    picture,
    rings,
    ros,
    stage,
    tmx,
    wkt,
)
from robocov_app.formats.base import (
    Exporter,
    ExportReport,
    ForeignMap,
    Importer,
    ImportReport,
    ReadOptions,
    WriteOptions,
)
from robocov_app.formats.geometry.conversion import build_environment
from robocov_app.formats.geometry.shaping import Shaping
from robocov_app.formats.svg import drawing as svg
from robocov_app.formats.unreadable import described, named_kind

__all__ = [
    "EXPORTERS",
    "IMPORTERS",
    "ExportReport",
    "Exporter",
    "ForeignMap",
    "ImportReport",
    "Importer",
    "ReadOptions",
    "Shaping",
    "WriteOptions",
    "build_environment",
    "detect",
    "export_map",
    "exporter",
    "import_map",
    "importer",
    "read_map",
]  # fmt: skip
# options of drawings
_DRAWN = ("thickness", "pillar", "outlines", "boundary", "around", "snap", "only", "skip")
_COLOURS = ("free_colour", "solid_colour", "ignore_colour", "colour_tolerance")
# the first whose `sniff` says yes has a file: the surest come first
IMPORTERS: dict[str, Importer] = {each.name: each for each in (
    # a .yaml is this by its content only
    Importer("irsim", "IR-SIM: YAML of a world, robots and obstacles", (), irsim.sniff, irsim.read,
             frozenset({"thickness", "anywhere", "only", "skip"})),
    Importer("ros", "ROS map_server: YAML with a PGM or PNG", (".yaml", ".yml"), ros.sniff, ros.read,
             frozenset({"unknown", "threshold", "anywhere"})),
    Importer("movingai", "MovingAI grid: .map", (".map",), movingai.sniff, movingai.read,
             frozenset({"cell", "trees", "water"})),
    Importer("stage", "Stage: .world with its includes and bitmaps", (".world",),
             lambda path, head: path.suffix.lower() == ".world" and stage.MODELS.search(head) is not None,
             stage.read, frozenset({"anywhere", "around", "only", "skip"})),
    Importer("argos", "ARGoS: the arena of an experiment (.argos)", (".argos",),
             lambda path, head: b"<argos-configuration" in head, argos.read, frozenset({"only", "skip"})),
    Importer("tmx", "Tiled: TMX of orthogonal maps, tiles and objects", (".tmx",),
             lambda path, head: tmx.ROOT.search(head) is not None and b"tilewidth" in head, tmx.read,
             frozenset({"cell", "scale", "thickness", "pillar", "anywhere", "only", "skip"})),
    Importer("picture", "picture: PNG, JPEG, BMP, TIFF, PGM, PPM, dark is an obstacle",
             (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pbm", ".pgm", ".ppm"),
             lambda path, head: picture.is_picture(head), picture.read,
             frozenset({"cell", "unknown", "threshold", "invert", "min_stroke", *_COLOURS})),
    Importer("osm", "OpenStreetMap (.osm, JSON of Overpass): buildings, water, barriers; rooms of a level",
             (".osm",), osm.sniff, osm.read,
             frozenset({"water", "level", *_DRAWN})),
    Importer("svg", "SVG drawings: filled shapes, strokes as walls", (".svg", ".svgz"),
             lambda path, head: svg.ROOT.search(head) is not None or path.suffix.lower() == ".svgz", svg.read,
             frozenset({"scale", "thickness", "min_stroke", "outlines", "boundary", "around", "snap", "only",
                        "skip", *_COLOURS})),
    Importer("dxf", "DXF drawings (with ezdxf): closed outlines, lines as walls, blocks", (".dxf",),
             lambda path, head: head.startswith(dxf.BINARY) or dxf.TEXT.match(head) is not None, dxf.read,
             frozenset({"scale", *_DRAWN, "hatches"})),
    Importer("wkt", "well-known text (JuPedSim, PostGIS, shapely): polygons, lines, collections",
             (".wkt", ".ewkt"), lambda path, head: wkt.BEGIN.match(head) is not None, wkt.read,
             frozenset({"scale", "units", "thickness", "pillar", "outlines", "around", "snap"})),
    Importer("geojson", "GeoJSON and sequences of it, in degrees (with pyproj) or metres",
             (".geojson", ".geojsonl", ".geojsons", ".ndjson"), geojson.sniff, geojson.read,
             frozenset({"scale", "units", *_DRAWN})),
    Importer("imdf", "IMDF: a level of a venue, from a zip or folder of GeoJSON (with pyproj)",
             (".zip", ".imdf"), imdf.sniff, imdf.read,
             frozenset({"level", "thickness", "snap", "only", "skip"})),
    Importer("houseexpo", "HouseExpo floor plans (JSON with verts in metres)", (".json",),
             lambda path, head: files.begins_with(head, b"{") and b'"verts"' in head, houseexpo.read),
    Importer("rings", "lists of rings (JSON as earcut takes it): outline and holes", (".json",),
             rings.sniff, rings.read, frozenset({"scale", "outlines", "around", "snap"})),
)}  # fmt: skip
# the formats that can be written
EXPORTERS: dict[str, Exporter] = {each.name: each for each in (
    Exporter("ros", "ROS map_server: YAML with a PGM or PNG", (".yaml", ".yml"), ros.write,
             frozenset({"cell", "mode", "image"}), ros.files_of),
    Exporter("movingai", "MovingAI grid: .map", (".map",), movingai.write, frozenset({"cell"})),
    Exporter("picture", "picture: PNG in black and white, with its scale and place", (".png",), picture.write,
             frozenset({"cell"})),
    Exporter("svg", "SVG at true scale: boundary and obstacles by their ids", (".svg",), svg.write,
             frozenset({"digits", "scale"})),
    Exporter("wkt", "well-known text (JuPedSim): the free space as polygons with holes", (".wkt",), wkt.write,
             frozenset({"digits"})),
    Exporter("geojson", "GeoJSON: boundary and obstacles as features, in metres or degrees", (".geojson",),
             geojson.write, frozenset({"digits", "origin"})),
)}  # fmt: skip


def importer(name: str) -> Importer:
    if name not in IMPORTERS:
        raise ParameterError(describe_unknown_name("format", name, IMPORTERS))
    return IMPORTERS[name]


def detect(path: str | Path) -> Importer:
    """Return the format of the file at `path`: by its content, or else by its suffix."""
    path = Path(path)
    if imdf.is_archive_folder(path):
        return IMPORTERS["imdf"]
    head = files.head(path)
    if (kind := named_kind(path, head)) is not None:
        raise MapError(f"{to_one_line(path)}: {to_one_line(kind)}")
    for candidate in IMPORTERS.values():
        if candidate.sniff(path, head):
            return candidate
    named = [each for each in IMPORTERS.values() if path.suffix.lower() in each.suffixes]
    if len(named) == 1:  # its reader says best what is missing
        return named[0]
    wanted = f"expected one of {', '.join(IMPORTERS)}"
    raise MapError(f"{to_one_line(path)}: unknown format ({described(head)}), {wanted}")


def import_map(
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 - as the option is called
    options: ReadOptions = ReadOptions(),
    shaping: Shaping = Shaping(),
) -> tuple[Environment, ImportReport, ForeignMap]:
    """Return the foreign map at `path` as an environment, what was done to it, and what was read.

    `format` is its name; None looks at the file. Raises MapError when the file cannot be read, understood or
    driven in; ParameterError when the format is unknown, or does not have an option that is given.
    """
    foreign = read_map(path, format=format, options=options)
    environment, report = build_environment(foreign, shaping, to_one_line(path))
    return environment, report, foreign


def read_map(
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 - as the option is called
    options: ReadOptions = ReadOptions(),
) -> ForeignMap:
    """Return the foreign map at `path` as it was read; parameters and errors are those of `import_map`."""
    path = Path(path)
    chosen = detect(path) if format is None else importer(format)
    options.require_known(chosen)
    return chosen.read(path, options)


def exporter(path: str | Path, name: str | None = None) -> Exporter:
    if name is not None and name not in EXPORTERS:
        raise ParameterError(describe_unknown_name("format", name, EXPORTERS))
    suffix = Path(path).suffix.lower()
    for candidate in EXPORTERS.values():
        if candidate.name == name or (name is None and suffix in candidate.suffixes):
            return candidate
    known = ", ".join(suffix for candidate in EXPORTERS.values() for suffix in candidate.suffixes)
    raise ParameterError(f"{to_one_line(path)}: unknown format, expected a file ending in one of {known}")


def export_map(
    environment: Environment,
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 - as the option is called
    options: WriteOptions = WriteOptions(),
) -> ExportReport:
    """Write `environment` to `path` in a foreign format, and return what came of it.

    `format` is its name; None goes by the suffix. Raises ParameterError as `import_map`; OutputError when a
    file cannot be written: what was there before is then untouched.
    """
    path = Path(path)
    chosen = exporter(path, format)
    options.require_known(chosen)
    report = chosen.write(environment, path, options)
    dropped = list(report.dropped)
    if environment.density is not None:
        dropped.append(f"the density ({environment.density.kind})")
    if environment.has_moving_obstacles:
        count = sum(shape.path is not None for shape in environment.obstacles)
        dropped.append(
            f"the {format_count(count, 'path')} of obstacles, which stand where they are at time zero"
        )
    return replace(report, dropped=tuple(dropped))
