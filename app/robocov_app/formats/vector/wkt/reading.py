"""Well-known text as maps.

Polygons are free space, even where they overlap or contain each other. Their holes are obstacles, even where
another polygon overlaps them: JuPedSim unites accessible areas, and then excludes holes (``build_geometry``
in the manual, https://www.jupedsim.org). Only a polygon completely inside a hole is free there, as in a
MULTIPOLYGON. In a file without polygons, lines are walls. The option ``outlines`` takes precedence; see
`Shapes.build_foreign_map`. Coordinates are meters, unless a prefix ``SRID=...;`` names another system.
"""

from dataclasses import replace
from pathlib import Path

from robocov_app.formats.files import get_map_name, read_text
from robocov_app.formats.foreign_map import ForeignMap
from robocov_app.formats.geodata.georeference import convert_to_meters
from robocov_app.formats.geometry.shapes.collection import Shapes
from robocov_app.formats.options import ReadOptions
from robocov_app.formats.vector.wkt.holes import exclude_holes
from robocov_app.formats.vector.wkt.parser import WktParser


def read(path: Path, options: ReadOptions) -> ForeignMap:
    """Read the geometries of a file.

    Raises
    ------
    MapError
        If the file is damaged, too large, or contains no map.
    """
    text, source_name = read_text(path, b",")
    shapes = Shapes(source_name, options)
    parser = WktParser(text, source_name, shapes)
    geometries = parser.parse()
    system = f"EPSG:{parser.srid}" if parser.srid else None
    geometries = convert_to_meters(geometries, shapes, system)
    has_polygons = any(geometry.kind == "polygon" for geometry in geometries)
    if options.outlines is None and has_polygons:
        shapes.options = replace(options, outlines="free")
        geometries = exclude_holes(geometries, shapes)
    shapes.add_all(geometries)
    return shapes.build_foreign_map(get_map_name(path), "Imported from WKT.", solid=False, overlap=True)
