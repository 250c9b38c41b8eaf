"""The tables of foreign formats, and functions that import and export maps in them."""

from dataclasses import replace
from pathlib import Path

from robocov.environment import Environment
from robocov.errors import MapError, ParameterError, describe_unknown_name, format_count, to_one_line
from robocov_app.formats.files import read_head
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geodata import geojson, imdf, osm
from robocov_app.formats.geometry.conversion.conversion_options import Shaping
from robocov_app.formats.geometry.conversion.environment import build_environment
from robocov_app.formats.interface import Exporter, Importer
from robocov_app.formats.options import ReadOptions, WriteOptions
from robocov_app.formats.raster import movingai, picture, ros, tmx
from robocov_app.formats.reports import ExportReport, ImportReport
from robocov_app.formats.simulators import argos, coverage_control, irsim, stage
from robocov_app.formats.unsupported import describe_head, describe_unsupported_file
from robocov_app.formats.vector import dxf, houseexpo, rings, svg, wkt

_DRAWING_OPTIONS = frozenset(
    {"thickness", "pillar", "outlines", "boundary", "around", "snap", "only", "skip"}
)
_COLOR_OPTIONS = frozenset({"free_color", "solid_color", "ignore_color", "color_tolerance"})

# The order matters: a file has the first format whose `sniff` accepts it, so specific formats come first.
_IMPORTERS = (
    Importer(
        name="irsim",
        title="IR-SIM: YAML of a world, robots and obstacles",
        suffixes=(),  # a .yaml is detected by its content only
        sniff=irsim.sniff,
        reader=irsim.read,
        options=frozenset({"thickness", "anywhere", "only", "skip"}),
    ),
    Importer(
        name="ros",
        title="ROS map_server: YAML with a PGM or PNG",
        suffixes=(".yaml", ".yml"),
        sniff=ros.sniff,
        reader=ros.read,
        options=frozenset({"unknown", "threshold", "anywhere"}),
    ),
    Importer(
        name="movingai",
        title="MovingAI grid: .map",
        suffixes=(".map",),
        sniff=movingai.sniff,
        reader=movingai.read,
        options=frozenset({"cell", "trees", "water"}),
    ),
    Importer(
        name="stage",
        title="Stage: .world with its includes and bitmaps",
        suffixes=(".world",),
        sniff=stage.sniff,
        reader=stage.read,
        options=frozenset({"anywhere", "around", "only", "skip"}),
    ),
    Importer(
        name="argos",
        title="ARGoS: the arena of an experiment (.argos)",
        suffixes=(".argos",),
        sniff=argos.sniff,
        reader=argos.read,
        options=frozenset({"only", "skip"}),
    ),
    Importer(
        name="coverage-control",
        title="CoverageControl: density (.env) and robots (.pos) of a world",
        suffixes=(),  # a .env is usually something else, so it is detected by its content only
        sniff=coverage_control.sniff,
        reader=coverage_control.read,
        options=frozenset({"cell"}),
    ),
    Importer(
        name="tmx",
        title="Tiled: TMX of orthogonal maps, tiles and objects",
        suffixes=(".tmx",),
        sniff=tmx.sniff,
        reader=tmx.read,
        options=frozenset({"cell", "scale", "thickness", "pillar", "anywhere", "only", "skip"}),
    ),
    Importer(
        name="image",
        title="image: PNG, JPEG, BMP, TIFF, PGM, PPM, dark is an obstacle",
        suffixes=(".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pbm", ".pgm", ".ppm"),
        sniff=picture.sniff,
        reader=picture.read,
        options=frozenset({"cell", "unknown", "threshold", "invert", "min_stroke"}) | _COLOR_OPTIONS,
    ),
    Importer(
        name="osm",
        title="OpenStreetMap (.osm, JSON of Overpass): buildings, water, barriers; rooms of a level",
        suffixes=(".osm",),
        sniff=osm.sniff,
        reader=osm.read,
        options=frozenset({"water", "level"}) | _DRAWING_OPTIONS,
    ),
    Importer(
        name="svg",
        title="SVG drawings: filled shapes, strokes as walls",
        suffixes=(".svg", ".svgz"),
        sniff=lambda path, head: svg.ROOT.search(head) is not None or path.suffix.lower() == ".svgz",
        reader=svg.read,
        options=frozenset({"scale", "min_stroke"}) | _COLOR_OPTIONS | _DRAWING_OPTIONS - {"pillar"},
    ),
    Importer(
        name="dxf",
        title="DXF drawings (with ezdxf): closed outlines, lines as walls, blocks",
        suffixes=(".dxf",),
        sniff=dxf.sniff,
        reader=dxf.read,
        options=frozenset({"scale", "hatches"}) | _DRAWING_OPTIONS,
    ),
    Importer(
        name="wkt",
        title="well-known text (JuPedSim, PostGIS, shapely): polygons, lines, collections",
        suffixes=(".wkt", ".ewkt"),
        sniff=wkt.sniff,
        reader=wkt.read,
        options=frozenset({"scale", "units", "thickness", "pillar", "outlines", "around", "snap"}),
    ),
    Importer(
        name="geojson",
        title="GeoJSON and sequences of it, in degrees (with pyproj) or meters",
        suffixes=(".geojson", ".geojsonl", ".geojsons", ".ndjson"),
        sniff=geojson.sniff,
        reader=geojson.read,
        options=frozenset({"scale", "units"}) | _DRAWING_OPTIONS,
    ),
    Importer(
        name="imdf",
        title="IMDF: a level of a venue, from a zip or folder of GeoJSON (with pyproj)",
        suffixes=(".zip", ".imdf"),
        sniff=imdf.sniff,
        reader=imdf.read,
        options=frozenset({"level", "thickness", "snap", "only", "skip"}),
    ),
    Importer(
        name="houseexpo",
        title="HouseExpo floor plans (JSON with verts in meters)",
        suffixes=(".json",),
        sniff=houseexpo.sniff,
        reader=houseexpo.read,
    ),
    Importer(
        name="rings",
        title="lists of rings (JSON as earcut takes it): outline and holes",
        suffixes=(".json",),
        sniff=rings.sniff,
        reader=rings.read,
        options=frozenset({"scale", "outlines", "around", "snap"}),
    ),
)
IMPORTERS: dict[str, Importer] = {importer.name: importer for importer in _IMPORTERS}
"""Formats that can be read, by name."""

_EXPORTERS = (
    Exporter(
        name="ros",
        title="ROS map_server: YAML with a PGM or PNG",
        suffixes=(".yaml", ".yml"),
        write=ros.write,
        options=frozenset({"cell", "mode", "image"}),
        list_files=ros.list_files,
    ),
    Exporter(
        name="movingai",
        title="MovingAI grid: .map",
        suffixes=(".map",),
        write=movingai.write,
        options=frozenset({"cell"}),
    ),
    Exporter(
        name="image",
        title="image: PNG in black and white, with its scale and place",
        suffixes=(".png",),
        write=picture.write,
        options=frozenset({"cell"}),
    ),
    Exporter(
        name="svg",
        title="SVG at true scale: boundary and obstacles by their ids",
        suffixes=(".svg",),
        write=svg.write,
        options=frozenset({"digits", "scale"}),
    ),
    Exporter(
        name="wkt",
        title="well-known text (JuPedSim): the free space as polygons with holes",
        suffixes=(".wkt",),
        write=wkt.write,
        options=frozenset({"digits"}),
    ),
    Exporter(
        name="geojson",
        title="GeoJSON: boundary and obstacles as features, in meters or degrees",
        suffixes=(".geojson",),
        write=geojson.write,
        options=frozenset({"digits", "origin"}),
    ),
)
EXPORTERS: dict[str, Exporter] = {exporter.name: exporter for exporter in _EXPORTERS}
"""Formats that can be written, by name."""


def get_importer(name: str) -> Importer:
    """Return the importer of a format.

    Raises
    ------
    ParameterError
        If there is no such format.
    """
    if name not in IMPORTERS:
        raise ParameterError(describe_unknown_name("format", name, IMPORTERS))
    return IMPORTERS[name]


def detect_format(path: str | Path) -> Importer:
    """Detect the format of a file from its content or, if that fails, from its suffix.

    Parameters
    ----------
    path : str or Path
        A file, or a folder with an unpacked IMDF archive.

    Raises
    ------
    MapError
        If there is no such file, or its format is unknown.
    """
    path = Path(path)
    if imdf.is_archive_folder(path):
        return IMPORTERS["imdf"]
    head = read_head(path)
    unsupported = describe_unsupported_file(path, head)
    if unsupported is not None:
        raise MapError(f"{to_one_line(path)}: {to_one_line(unsupported)}")
    for importer in IMPORTERS.values():
        if importer.sniff(path, head):
            return importer
    with_suffix = [importer for importer in IMPORTERS.values() if path.suffix.lower() in importer.suffixes]
    if len(with_suffix) == 1:  # the reader of that format will raise the most helpful error
        return with_suffix[0]
    expected = f"expected one of {', '.join(IMPORTERS)}"
    raise MapError(f"{to_one_line(path)}: unknown format ({describe_head(head)}), {expected}")


def import_map(
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 - as the option is called
    options: ReadOptions = ReadOptions(),
    shaping: Shaping = Shaping(),
) -> tuple[Environment, ImportReport, ForeignMap]:
    """Import a foreign map.

    Parameters
    ----------
    path : str or Path
    format : str, optional
        Name of the format. By default, it is detected.
    options : ReadOptions
    shaping : Shaping
        Parameters of the conversion to an environment, such as simplification.

    Returns
    -------
    environment : Environment
    report : ImportReport
        Repairs, losses and changes.
    foreign : ForeignMap
        The map as it was read.

    Raises
    ------
    MapError
        If the file cannot be read or parsed, or if no robot could drive in the map.
    ParameterError
        If the format is unknown, or does not have an option that is given.
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
    """Read a foreign map without converting it; parameters and errors are those of `import_map`."""
    path = Path(path)
    importer = detect_format(path) if format is None else get_importer(format)
    options.require_supported(importer.name, importer.options)
    return importer.read(path, options)


def choose_exporter(path: str | Path, name: str | None = None) -> Exporter:
    """Return the exporter for a file.

    Parameters
    ----------
    path : str or Path
        File to be written.
    name : str, optional
        Name of the format. By default the suffix of the file decides.

    Raises
    ------
    ParameterError
        If the format is unknown.
    """
    if name is not None:
        if name not in EXPORTERS:
            raise ParameterError(describe_unknown_name("format", name, EXPORTERS))
        return EXPORTERS[name]
    suffix = Path(path).suffix.lower()
    known_suffixes: list[str] = []
    for exporter in EXPORTERS.values():
        if suffix in exporter.suffixes:
            return exporter
        known_suffixes += exporter.suffixes
    known = ", ".join(known_suffixes)
    raise ParameterError(f"{to_one_line(path)}: unknown format, expected a file ending in one of {known}")


def export_map(
    environment: Environment,
    path: str | Path,
    *,
    format: str | None = None,  # noqa: A002 - as the option is called
    options: WriteOptions = WriteOptions(),
) -> ExportReport:
    """Write an environment in a foreign format.

    Parameters
    ----------
    environment : Environment
    path : str or Path
        File to write. Some formats write further files next to it.
    format : str, optional
        Name of the format. By default the suffix of the file decides.
    options : WriteOptions

    Returns
    -------
    ExportReport
        The files, and what the format cannot represent.

    Raises
    ------
    ParameterError
        If the format is unknown, or does not have an option that is given.
    OutputError
        If a file cannot be written. Existing files are then unchanged.
    """
    path = Path(path)
    exporter = choose_exporter(path, format)
    options.require_supported(exporter.name, exporter.options)
    report = exporter.write(environment, path, options)
    dropped = list(report.dropped)
    if environment.density is not None:
        dropped.append(f"the density ({environment.density.kind})")
    if environment.has_moving_obstacles:
        count = sum(shape.path is not None for shape in environment.obstacles)
        position = "its position" if count == 1 else "their positions"
        dropped.append(f"motion of {format_count(count, 'obstacle')} (written at {position} at 0 s)")
    return replace(report, dropped=tuple(dropped))
