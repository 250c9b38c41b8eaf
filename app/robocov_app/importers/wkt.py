"""Well-known text, as of JuPedSim, PostGIS and shapely: polygons with holes, lines, collections."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from robocov.errors import one_line
from robocov_app.importers.enclosing import foreign_map
from robocov_app.importers.georeference import in_metres
from robocov_app.importers.reading import Importer, ReadOptions
from robocov_app.importers.shapes import Shapes
from robocov_app.importers.text_file import read_text
from robocov_app.importers.wkt_text import CURVED, KINDS, WktText

if TYPE_CHECKING:
    from pathlib import Path

    from robocov_app.importers.foreign import ForeignMap

_BEGIN = re.compile(
    rb"(?:\xef\xbb\xbf)?(?:\s|(?:#|--)[^\n]*\n)*(?:SRID\s*=\s*\d+\s*;\s*)?(?:%s)(?:ZM|Z|M)?\s*(?:ZM|Z|M)?\s*(?:\(|EMPTY)"
    % b"|".join(kind.encode() for kind in (*KINDS, *CURVED)),
    re.IGNORECASE,
)


def is_wkt(path: Path, head: bytes) -> bool:
    """Return whether a file that begins with `head` begins with a geometry."""
    return _BEGIN.match(head) is not None


def read_wkt(path: Path, options: ReadOptions) -> ForeignMap:
    """Return the map that the geometries of a file of well-known text stand for.

    Polygons are free space, all of them together, and their holes are obstacles: JuPedSim's accessible areas.
    Only where all other polygons lie wholly in one, to which they would add nothing, they are obstacles in
    it; where there are only lines they are walls. The option ``outlines`` says it otherwise; see
    `robocov_app.importers.enclosing.foreign_map`. Third coordinates and measures are left out. Coordinates
    are metres, unless a prefix ``SRID=...;`` names a system other than 0.

    Parameters
    ----------
    path : Path
    options : ReadOptions

    Raises
    ------
    MapError
        When the file cannot be read or understood; with line and column.
    """
    text, where = read_text(path, b",")
    shapes = Shapes(where, options)
    parsed = WktText(text, where, shapes)
    figures = parsed.figures()
    crs = f"EPSG:{parsed.srid}" if parsed.srid else None
    figures, notes = in_metres(figures, options, where, crs=crs)
    for figure in figures:
        shapes.add(figure)
    shapes.join_lines()
    name = one_line(path.stem)[:60] or "map"
    return foreign_map(
        shapes,
        format=IMPORTER.name,
        name=name,
        description="Imported from WKT.",
        solid=False,
        accessible=True,
        notes=notes,
    )


IMPORTER = Importer(
    name="wkt",
    title="well-known text (JuPedSim, PostGIS, shapely): polygons, lines, collections",
    suffixes=(".wkt", ".ewkt"),
    sniff=is_wkt,
    read=read_wkt,
    options=frozenset({"scale", "units", "thickness", "pillar", "outlines", "around"}),
)
