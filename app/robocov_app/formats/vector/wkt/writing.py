"""Writing the free space of maps as well-known text."""

from pathlib import Path

from shapely import MultiPolygon, Polygon

from robocov.environment import Environment
from robocov.files.writing import replace_file
from robocov_app.formats.geometry.cells.rasterize import describe_unsupported
from robocov_app.formats.geometry.polygons import DEFAULT_DIGITS, format_decimal, list_rings, snap_to_grid
from robocov_app.formats.options import WriteOptions, get_or_default
from robocov_app.formats.reports import ExportReport


def write(environment: Environment, path: Path, options: WriteOptions) -> ExportReport:
    """Write the free space of an environment as polygons with holes.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    digits = get_or_default(options.digits, DEFAULT_DIGITS)
    polygons = snap_to_grid(environment.free, digits)
    texts = [_format_polygon(polygon, digits) for polygon in polygons]
    text = f"MULTIPOLYGON ({', '.join(texts)})"
    if len(texts) == 1:
        text = f"POLYGON {texts[0]}"
    with replace_file(path) as temporary:
        temporary.write_text(text + "\n", encoding="ascii")
    notes = [f"in meters, {digits} decimals"]
    if len(polygons) > 1:
        notes.append(f"the free space has {len(polygons)} parts: some programs accept only one polygon")
    return ExportReport(
        format="wkt",
        files=(path,),
        area=environment.free_area,
        area_written=float(MultiPolygon(polygons).area),
        dropped=(
            *describe_unsupported(environment),
            "the boundary and the obstacles as such: only the free space is written",
        ),
        notes=tuple(notes),
    )


def _format_polygon(polygon: Polygon, digits: int) -> str:
    """Return the rings of a polygon as well-known text, in brackets."""
    rings = [_format_ring(ring, digits) for ring in list_rings(polygon)]
    return f"({', '.join(rings)})"


def _format_ring(ring: list[tuple[float, float]], digits: int) -> str:
    points = [f"{format_decimal(x, digits)} {format_decimal(y, digits)}" for x, y in ring]
    return f"({', '.join(points)})"
